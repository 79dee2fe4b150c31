#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Which room may include which: the architecture's rules as a table, checked against the sources.

Usage: check_includes.py [--write], check_includes.py --matrix FOLDER... Run from the root of the project. One line for
each fault, and exit status 1: an include that no rule allows, a permission that no file uses, a table in server/README.md
that is out of date (--write brings it up to date). --matrix counts what is in a folder instead, each room or file without
its ending as one: arrows (who includes whom), floors, and the circles.
"""
import pathlib
import re
import sys

# Room (a folder with all below it) -> rooms that it may include from, besides itself. From the lowest to the highest
# floor: a row may name only rows above it. `*` stands for one folder that has no row of its own, the same in the whole
# row; so a new tracer needs no row.
BASE, GPU, SCENE, GPU_SCENE, TRACE = "server/base", "server/gpu", "server/scene", "server/gpu_scene", "server/trace"
SHARED, COMMON = "shaders/shared", "shaders/common"
CONTEXT, COMPARE, LIGHT = "server/render/context", "server/render/compare", "server/render/light"
PICTURE, WAVES, FRAME = "server/render/picture", "server/render/waves", "server/render/frame"
PASSES = PRIMARY, GROUND, WIREFRAME, DENOISE, LAYERS, KEY_VIEW = tuple(
    f"server/render/passes/{room}" for room in ("primary", "ground", "wireframe", "denoise", "layers", "key_view"))
MAY_INCLUDE = {
    "protocol": (),
    "protocol/sealed": ("protocol",),
    "protocol/common": (),
    "protocol/pixels": ("protocol/common",),
    "protocol/docs": ("protocol", "protocol/sealed", "protocol/common"),
    SHARED: (),
    COMMON: (SHARED,),
    "shaders/gpu_scene": (SHARED, COMMON),
    "shaders/raster": (SHARED, COMMON),
    "shaders/trace": (SHARED, COMMON),
    "shaders/render": (SHARED, COMMON),
    "shaders/tree": (SHARED, COMMON),
    "shaders/quadtree": (SHARED, COMMON),  # a row of its own, as the client has the layout of nodes too
    "shaders/*": (SHARED, COMMON, "shaders/raster", "shaders/tree"),
    BASE: ("protocol/common",),
    GPU: (BASE,),
    SCENE: (BASE,),
    "server/host_passes": (GPU, SHARED),
    GPU_SCENE: ("protocol/common", BASE, GPU, SCENE, SHARED),
    TRACE: (BASE, GPU, GPU_SCENE, SHARED),
    "server/trace/raster": (BASE, GPU, GPU_SCENE, TRACE, SHARED, "shaders/raster"),
    "server/trace/tree": (BASE, GPU, GPU_SCENE, TRACE, SHARED, "shaders/tree"),
    "server/trace/*": (
        "protocol/common", BASE, GPU, SCENE, GPU_SCENE, TRACE, "server/trace/raster", "server/trace/tree", SHARED, "shaders/*",
    ),
    COMPARE: (BASE, GPU, TRACE, SHARED),
    CONTEXT: (BASE, GPU, SCENE, GPU_SCENE, TRACE, "server/trace/raster", SHARED),
    LIGHT: (BASE, GPU, SCENE, GPU_SCENE, SHARED),
    PICTURE: (BASE, GPU, SHARED, CONTEXT),
    WAVES: (BASE, GPU, "server/host_passes", SHARED, COMPARE, CONTEXT, LIGHT),
    PRIMARY: (BASE, GPU, TRACE, "server/trace/raster", SHARED, CONTEXT, PICTURE, WAVES),
    LAYERS: (GPU, GPU_SCENE, SHARED, CONTEXT, LIGHT, PICTURE, WAVES),
    KEY_VIEW: (GPU, SHARED, CONTEXT, LIGHT, PICTURE, WAVES, PRIMARY, LAYERS),
    GROUND: (SHARED, CONTEXT, LIGHT, WAVES),
    WIREFRAME: (SHARED, CONTEXT),
    DENOISE: (SCENE, GPU_SCENE, SHARED, CONTEXT, PICTURE, WAVES),
    FRAME: (BASE, GPU, "server/host_passes", SCENE, TRACE, SHARED, COMPARE, CONTEXT, LIGHT, PICTURE, WAVES, *PASSES),
    "server/check": (BASE, GPU, SCENE, CONTEXT, FRAME),
    "server/encode": (BASE, "protocol/pixels"),
    "server/net": (BASE, "protocol", "protocol/sealed"),
    "server/front": (BASE, "server/net"),
    "server/engine": ("protocol/common", BASE, GPU, SCENE, CONTEXT, FRAME, "server/check", "server/encode"),
    "server/store": (BASE, "protocol"),
    "server/session": (BASE, SCENE, "server/encode", "server/net", "server/store", "server/engine", "protocol", "protocol/common"),
    "server": (BASE, GPU, "server/check", "server/net", "server/front", "server/store", "server/engine", "server/session", "protocol/common"),
    "client/warp": ("shaders/quadtree",),  # no protocol, GL, window or socket
    "client/lib": ("protocol", "protocol/sealed", "protocol/common", "protocol/pixels", "client/warp"),
    "client/edit": ("protocol", "protocol/common", "client/lib"),  # a part of the library
    "client/helper": ("protocol", "protocol/common"),
    "client/import/model": ("protocol", "protocol/common"),
    "client/import/image": ("protocol/common", "client/helper"),
    "client/import/obj": ("protocol/common", "client/import/model", "client/import/image"),
    "client/import/gltf": ("protocol/common", "client/import/model", "client/import/image"),
    "client/import/nff": ("protocol/common", "client/import/model"),
    "client/import/threemf": ("protocol/common", "client/import/model"),
    # Its materials become those of obj.
    "client/import/assimp": ("protocol/common", "client/helper", "client/import/model", "client/import/obj"),
    "client/import": (
        "protocol", "protocol/common", "client/helper", *(f"client/import/{room}" for room in (
            "model", "image", "gltf", "obj", "nff", "assimp", "threemf")), SHARED),  # of shaders: the default sky
    "client/output": ("protocol", "protocol/common", "client/helper"),
    "client/output/library": ("protocol/common", "client/output"),
    "client/video": ("protocol", "protocol/pixels", "client/helper", "client/lib"),  # of lib: rate
    "client/options": ("protocol", "protocol/common", "client/lib"),  # the command line of a picture, a window and a page
    "client/cli/shot": ("client/lib", "client/options"),
    "client/cli/jobs": ("protocol", "protocol/common", "client/lib", "client/options", "client/cli/shot"),
    "client/cli/compare": ("client/lib", "client/options", "client/cli/jobs"),
    "client/cli/daemon": ("protocol", "protocol/sealed", "client/lib", "client/options"),
    "client/cli": (
        "protocol/common", "client/lib", "client/options", "client/cli/jobs", "client/cli/compare", "client/cli/daemon"),
    "client/web": ("protocol/common", "client/lib", "client/options"),  # no scene file; pixels are compared, but never encoded
    "client/viewer/input": ("protocol", "client/warp", "client/lib", "client/options"),
    "client/viewer/overlay": ("protocol/common", "client/lib", "client/viewer/input"),
    "client/viewer/view": (
        "protocol/common", "client/warp", "client/lib", "client/options", "client/viewer/input", "client/viewer/overlay"),
    "client/viewer/edit": (
        "protocol/common", "client/lib", "client/options", "client/viewer/input", "client/viewer/overlay", "client/viewer/view"),
    "client/viewer": (
        "protocol/common", "client/lib", "client/options", *(f"client/viewer/{room}" for room in (
            "input", "overlay", "view", "edit"))),
}
# Files that every room may include.
FOR_EVERYBODY = re.compile(r"^protocol/((version|plain_text|sanitized)\.h|(words|tracers|values)\.(h|def))$")
# A test in tests/unit/ROOM is one of the rooms of that name, with those in it (`client`: all of the client): it may include
# them, all that is below them, and what UNIT_ALSO says. The rest of tests/ may include every room; no room includes tests/.
TESTS, UNIT = "tests", "tests/unit/"
UNIT_ROOTS = ("", "server/", "server/trace/", "client/")
UNIT_ALSO = {
    "protocol": ("server/base",),  # lines of the log
    "client": ("server/encode",),  # what the daemon encodes is decoded
    "encode": ("server/engine",),  # the pool of encoders
    "gpu_scene": ("server/trace",),  # where rays meet what moved
    "net": ("server/session",),  # the blobs of a connection
    "session": ("server",),  # the limits of the configuration
    "trace/ldc": (FRAME,),  # cubes of tracers that are switched
}
# System headers that only some rooms, and the folders below them, may use.
RESTRICTED = {
    r"(epoxy|GL|EGL)/": (GPU, GPU_SCENE, TRACE, "server/render"),
    r"embree": ("server/trace/reference",),
    r"(sys/socket|sys/un|netinet/.*|netdb|arpa/inet)\.h": (
        BASE, "server/net", "client/lib", "client/helper", "client/import", "client/web"),
    r"lib(av|sw)": ("client/video", "client/viewer", "server/encode"),
    r"SDL2?/": ("client/viewer",),
    r"OpenImageIO/": ("client/import/image", "client/output/library"),
    r"png\.h": ("client/import/image", "client/output"),
    r"(OpenEXR|Imath)/": ("client/output",),
    r"tiny_gltf": ("client/import/gltf",),
    r"tiny_obj_loader": ("client/import/obj",),
    r"assimp/": ("client/import/assimp",),
    r"turbojpeg\.h": ("client/import/image", "client/lib", "client/output", "server/encode"),
    r"libexif/": ("client/output",),
    r"stb_": ("client/import/image",),
    r"zstd\.h": ("server/encode", "client/lib", "protocol/pixels"),
    r"libwebsockets\.h": ("client/web",),
    r"sodium\.h": ("client/cli", "client/web", "server/session", "server/store", "protocol/common", "protocol/sealed"),
}
# Where the matrix of the server's rooms stands.
README = pathlib.Path("server/README.md")
MARKERS = ("<!-- include rules: begin -->", "<!-- include rules: end -->")

FILE = "tests/tools/check_includes.py"
ROOTS = ("", "server", "shaders", "client")  # as the compiler's -I
SOURCES = {".c", ".h", ".cpp", ".hpp"}
STAGES = {".comp", ".vert", ".geom", ".frag"}
INCLUDE = re.compile(r'^\s*#\s*include\s+(?:"([^"]+)"|<([^>]+)>)')
MAIN = re.compile(r"^\s*void\s+main\s*\(", re.M)


def room_of(path):
    """(room, its row in the table) of a file; of a test, which has no row, (its folder, None)."""
    for folder in (path.parent, *path.parent.parents):
        for row in (folder.as_posix(), (folder.parent / "*").as_posix()):
            if row in MAY_INCLUDE:
                return folder.as_posix(), row
    return path.parent.as_posix(), None


def below(room, row):
    """The room and all that it may include, by way of others too."""
    found, open_rows = set(), [(room, row)]
    while open_rows:
        room, row = open_rows.pop()
        if room not in found:
            found.add(room)
            name = room.rpartition("/")[2]
            open_rows += [(other.replace("*", name), other) for other in MAY_INCLUDE.get(row, ())]
    return found


def resolve(including, name):
    of_shader = including.parts[0] == "shaders" and including.suffix != ".h"  # these count from shaders/ alone
    for base in [pathlib.Path("shaders")] if of_shader else (including.parent, *map(pathlib.Path, ROOTS)):
        if (base / name).is_file():
            return pathlib.Path((base / name).resolve().relative_to(pathlib.Path.cwd()))
    return None


class Checker:
    """The faults found so far, and which permissions were used."""

    def __init__(self):
        self.faults = []
        self.files = 0
        self.used = set()  # (row, room of the row), (pattern, room) and (test's room, room)

    def report(self, path, line, text):
        self.faults.append(f"{path}:{line}: {text}")

    def may_include(self, path, target):
        room, row = room_of(path)
        other, _ = room_of(target)
        if other == room or FOR_EVERYBODY.match(target.as_posix()):
            return True
        if row:
            name = room.rpartition("/")[2]
            allowed = [permission for permission in MAY_INCLUDE[row] if permission.replace("*", name) == other]
            self.used.update((row, permission) for permission in allowed)
            return bool(allowed)
        if not room.startswith(UNIT) or other.startswith(TESTS):
            return True
        subject = room[len(UNIT):]
        name = pathlib.Path(subject).name
        rooms = [room for room in (row.replace("*", name) for row in MAY_INCLUDE) for root in UNIT_ROOTS
                 if f"{room}/".startswith(f"{root}{subject}/") and pathlib.Path(room).is_dir()]
        if not rooms or any(other in below(*room_of(pathlib.Path(room, "file"))) for room in rooms):
            return True
        self.used.add((subject, other))
        return other in UNIT_ALSO.get(subject, ())

    def check_system(self, path, line, header):
        room, row = room_of(path)
        for pattern, rooms in RESTRICTED.items():
            if row and re.match(pattern, header):
                allowed = [one for one in rooms if room == one or room.startswith(one + "/")]
                self.used.update((pattern, one) for one in allowed)
                if not allowed:
                    self.report(path, line, f"<{header}> is for {', '.join(rooms)}")

    def check(self, path):
        self.files += 1
        text = path.read_text()
        own_header = next((path.with_suffix(end) for end in (".h", ".hpp") if path.with_suffix(end).is_file()), None)
        first = path.suffix in {".c", ".cpp"} and own_header is not None and not path.parts[0] == TESTS
        for number, line in enumerate(text.splitlines(), 1):
            match = INCLUDE.match(line)
            if not match:
                continue
            quoted, system = match.groups()
            target = resolve(path, quoted) if quoted else None
            if first and target != own_header:
                self.report(path, number, "the first include is not the file's own header")
            first = False
            if system:
                self.check_system(path, number, system)
            elif target is None:
                self.report(path, number, f"no such header in the project: {quoted}")
            elif not self.may_include(path, target):
                self.report(path, number, f"{room_of(path)[0]} may not include {room_of(target)[0]} ({quoted})")
        if path.parts[0] == "shaders" and bool(MAIN.search(text)) != (path.suffix in STAGES):
            self.report(path, 1, "main() stands in files with a stage's suffix, and only there")

    def check_table(self):
        """Rows name only rows above them, and everything that is allowed is used."""
        rows = list(MAY_INCLUDE)
        for row, permissions in MAY_INCLUDE.items():
            for permission in permissions:
                if rows.index(permission) >= rows.index(row):
                    self.faults.append(f"{FILE}: {row} names {permission}, which is not below it")
                elif (row, permission) not in self.used:
                    self.faults.append(f"{FILE}: no file of {row} includes {permission}: take the permission away")
        for pattern, rooms in RESTRICTED.items():
            for room in rooms:
                if (pattern, room) not in self.used:
                    self.faults.append(f"{FILE}: no file of {room} includes <{pattern}>: take the permission away")
        for subject, rooms in UNIT_ALSO.items():
            for room in rooms:
                if (subject, room) not in self.used:
                    self.faults.append(f"{FILE}: no test of {subject} includes {room}: take the permission away")


def sources():
    for root, suffixes in (("protocol", SOURCES), ("server", SOURCES), ("client", SOURCES), ("tests", SOURCES),
                           ("shaders", {".h", ".glsl"} | STAGES)):
        yield from sorted(path for path in pathlib.Path(root).rglob("*") if path.suffix in suffixes)


def matrix():
    """The server's part of the table, as Markdown."""
    def named(room):
        return "main" if room == "server" else room.removeprefix("server/").replace("*", "TRACER")
    rows = [row for row in MAY_INCLUDE if row == "server" or row.startswith("server/")]
    columns = [row for row in rows if any(row in MAY_INCLUDE[other] for other in rows)]
    lines = ["| room | " + " | ".join(map(named, columns)) + " | others |", "|" + " --- |" * (len(columns) + 2)]
    for row in rows:
        others = [permission.replace("*", "TRACER") for permission in MAY_INCLUDE[row] if permission not in columns]
        marks = ["x" if column in MAY_INCLUDE[row] else "" for column in columns]
        lines.append("| " + " | ".join([f"`{named(row)}`", *marks, ", ".join(others)]) + " |")
    return "\n".join([MARKERS[0], *(re.sub(" +", " ", line) for line in lines), MARKERS[1]])


def check_matrix(checker, write):
    text = README.read_text()
    begin, end = (text.find(marker) for marker in MARKERS)
    if begin < 0 or end < begin:
        checker.faults.append(f"{README}: no lines {MARKERS[0]} and {MARKERS[1]}, between which the matrix stands")
        return
    current = text[:begin] + matrix() + text[end + len(MARKERS[1]):]
    if write:
        README.write_text(current)
    elif current != text:
        checker.faults.append(f"{README}: the matrix is out of date: run {sys.argv[0]} --write")


def print_arrows(folder):
    def named(path):
        part = path.relative_to(folder).parts
        return f"{part[0]}/" if len(part) > 1 else part[0].split(".")[0]
    reached = {}
    for path in sources():
        if folder not in path.parents:
            continue
        ahead = reached.setdefault(named(path), set())
        quoted = (match[1] for match in map(INCLUDE.match, path.read_text().splitlines()) if match and match[1])
        targets = filter(None, (resolve(path, name) for name in quoted))
        ahead.update(named(target) for target in targets if folder in target.parents)
        ahead.discard(named(path))
    arrows = [(room, other) for room in reached for other in reached[room]]
    for middle in reached:
        for ahead in reached.values():
            if middle in ahead:
                ahead |= reached[middle]
    circles = {frozenset(other for other in ahead if room in reached[other]) for room, ahead in reached.items() if room in ahead}
    floors = {}
    for room in sorted(reached, key=lambda room: len(reached[room] - {room})):  # from the lowest floor on
        floors[room] = max((floors[other] + 1 for other in reached[room] if room not in reached[other]), default=0)
    inside = sum(room in reached[other] for room, other in arrows)
    print(f"{folder}: {len(reached)} rooms, {len(arrows)} arrows, {max(floors.values(), default=0) + 1} floors, "
          f"{inside} arrows in {len(circles)} circles")
    for circle in circles:
        print(f"  circle: {' '.join(sorted(circle))}")


def main():
    if sys.argv[1:2] == ["--matrix"]:
        for folder in sys.argv[2:]:
            print_arrows(pathlib.Path(folder))
        return 0
    checker = Checker()
    for path in sources():
        checker.check(path)
    checker.check_table()
    check_matrix(checker, "--write" in sys.argv[1:])
    for fault in checker.faults:
        print(fault)
    print(f"include rules: {checker.files} files, {len(checker.faults)} faults")
    return 1 if checker.faults else 0


if __name__ == "__main__":
    sys.exit(main())
