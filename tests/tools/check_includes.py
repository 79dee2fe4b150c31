#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Who may include whom: the architecture's rules as a table, held against the sources.

Exit status 1 and a line for each include that no rule allows. Run from the root of the project.
"""
import pathlib
import re
import sys

# Folder -> folders of the project that it may include from (itself is always allowed).
BASE, GPU = "server/base", "server/gpu"
STRUCTURES = {BASE, GPU, "server/scene", "server/gpu_scene", "server/trace", "shaders/shared"}  # what each may use
MAY_INCLUDE = {
    "protocol": set(),
    "protocol/sealed": {"protocol"},
    "protocol/common": set(),
    "protocol/pixels": {"protocol/common"},
    "protocol/docs": {"protocol", "protocol/sealed", "protocol/common"},
    BASE: {"protocol/common"},
    "server/scene": {BASE},
    GPU: {BASE},
    "server/gpu_scene": {BASE, GPU, "server/scene", "shaders/shared", "protocol/common"},
    "server/trace": STRUCTURES,
    "server/trace/raster": STRUCTURES | {"shaders/raster"},
    "server/trace/abuffer": STRUCTURES | {"server/trace/raster", "shaders/abuffer"},
    "server/trace/bvh": STRUCTURES | {"shaders/bvh"},
    "server/trace/ldc": STRUCTURES | {"server/trace/raster", "shaders/ldc"},
    "server/trace/naive": STRUCTURES,
    "server/trace/reference": STRUCTURES | {"protocol/common"},
    "server/render": STRUCTURES,
    "server/encode": {BASE, "protocol/pixels"},
    "server/engine": {BASE, GPU, "server/scene", "server/gpu_scene", "server/trace", "server/render", "server/encode"},
    "server/net": {BASE, "protocol", "protocol/sealed"},
    "server/session": {BASE, "server/net", "server/scene", "server/engine", "server/encode", "server/render",
                       "protocol", "protocol/sealed", "server"},
    "server": {BASE, GPU, "server/net", "server/session", "server/engine", "server/encode", "protocol",
               "protocol/sealed"},
    "client/lib": {"protocol", "protocol/common", "protocol/sealed", "protocol/pixels"},
    "client/cli": {"client/lib", "protocol", "protocol/common", "protocol/sealed"},
    "client/helper": {"protocol"},
    "client/import": {"client/helper", "protocol", "protocol/common"},
    "client/output": {"client/helper", "protocol", "protocol/common"},
    "client/video": {"client/helper", "client/lib", "protocol", "protocol/pixels"},  # of lib: rate
    "client/viewer": {"protocol", "protocol/common", "client/lib", "client/cli"},  # the command line is parsed as that of render
    "shaders/shared": set(),
    "shaders/raster": {"shaders/shared"},
    "shaders/abuffer": {"shaders/shared", "shaders/raster"},
    "shaders/bvh": {"shaders/shared"},
    "shaders/ldc": {"shaders/shared", "shaders/raster"},
}
# System headers that only some folders, and those below them, may use.
RESTRICTED = [
    (re.compile(r"^(epoxy|GL|EGL)/"), {"server/gpu", "server/gpu_scene", "server/trace", "server/render"}),
    (re.compile(r"^embree"), {"server/trace/reference"}),
    (re.compile(r"^(sys/socket|sys/un|netinet/.*|netdb|arpa/inet)\.h"),
     {"server/base", "server/net", "client/lib", "client/helper", "client/import", "client/cli"}),
    (re.compile(r"^lib(av|sw)"), {"client/video", "client/viewer", "server/encode"}),
    (re.compile(r"^SDL2?/"), {"client/viewer"}),
    (re.compile(r"^OpenImageIO/"), {"client/import", "client/output"}),
    (re.compile(r"^(tiny_gltf|tiny_obj_loader)"), {"client/import"}),
    (re.compile(r"^(turbojpeg|zstd)\.h"), {"server/encode", "client/lib", "protocol/pixels"}),
    (re.compile(r"^sodium\.h"), {"server/session", "client/lib", "protocol/common", "protocol/sealed", "protocol/docs"}),
]
ROOTS = ("", "server", "shaders", "client")  # as the compiler's -I
INCLUDE = re.compile(r'^\s*#\s*include\s+(?:"([^"]+)"|<([^>]+)>)')


def owner(path):
    """The folder whose rules hold for a file, the longest that is in the table."""
    folder = path.parent.as_posix()
    while folder and folder not in MAY_INCLUDE:
        folder = folder.rpartition("/")[0]
    return folder


def resolve(including, name):
    for base in (including.parent, *map(pathlib.Path, ROOTS)):
        if (base / name).is_file():
            return pathlib.Path((base / name).resolve().relative_to(pathlib.Path.cwd()))
    return None


def check(path, report):
    here = owner(path)
    own_header_expected = path.suffix == ".c" and path.with_suffix(".h").is_file()
    first = True
    for number, line in enumerate(path.read_text().splitlines(), 1):
        match = INCLUDE.match(line)
        if not match:
            continue
        quoted, system = match.groups()
        if first and own_header_expected and resolve(path, quoted or "") != path.with_suffix(".h"):
            report(path, number, "the first include is not the file's own header")
        first = False
        if quoted:
            target = resolve(path, quoted)
            if target is None:
                report(path, number, f"no such header in the project: {quoted}")
            elif owner(target) != here and owner(target) not in MAY_INCLUDE[here]:
                report(path, number, f"{here} may not include {owner(target)} ({quoted})")
        for pattern, allowed in RESTRICTED:
            if system and pattern.match(system) and not any(here == one or here.startswith(one + "/") for one in allowed):
                report(path, number, f"<{system}> belongs to {', '.join(sorted(allowed))}")


SHADER_INCLUDE_OK = re.compile(r"^(shared|common|raster)/")


def check_shader(path, report):
    text = path.read_text()
    tracer = path.parent.name
    for number, line in enumerate(text.splitlines(), 1):
        match = INCLUDE.match(line)
        if match and match.group(1):
            name = match.group(1)
            if not (pathlib.Path("shaders") / name).is_file():
                report(path, number, f"no such shader file: {name}")
            elif not SHADER_INCLUDE_OK.match(name) and not name.startswith(tracer + "/"):
                report(path, number, f"{tracer} may include shared/, common/, raster/ and itself, not {name}")
    has_main = re.search(r"^\s*void\s+main\s*\(", text, re.M) is not None
    if has_main != (path.suffix in {".comp", ".vert", ".geom", ".frag"}):
        report(path, 1, "main() stands in files with a stage suffix, and only there")


def main():
    faults = []

    def report(path, number, text):
        faults.append(f"{path}:{number}: {text}")

    files = 0
    for root in ("protocol", "server", "client"):
        for path in sorted(pathlib.Path(root).rglob("*")):
            if path.suffix in {".c", ".h", ".cpp"}:
                check(path, report)
                files += 1
    for path in sorted(pathlib.Path("shaders").rglob("*")):
        if path.suffix in {".glsl", ".comp", ".vert", ".geom", ".frag"}:
            check_shader(path, report)
            files += 1
        elif path.suffix == ".h":
            check(path, report)
            files += 1
    for fault in faults:
        print(fault)
    print(f"include rules: {files} files, {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
