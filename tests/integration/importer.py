# SPDX-License-Identifier: MIT
"""farlight-import as its tests see it: a peer that answers as a server would, what came of a model, and whether a server
would take it."""
import concurrent.futures
import hashlib
import os
import resource
import select
import socket
import struct
import subprocess
import threading
import time

from farlight_test import BIN, Case

IMPORTER = os.path.join(os.path.abspath(BIN), "farlight-import")
SLOWER = 6 if any(config in str(BIN) for config in ("sanitize", "coverage")) else 1
BUSY_S = 120  # that other work on the machine may take meanwhile

OK, ERROR, CREDIT = 0x0001, 0x0002, 0x0007
BLOB_OFFER, BLOB_NEED, BLOB_DATA = 0x0110, 0x0111, 0x0112
EDIT_BEGIN, EDIT_COMMIT = 0x0120, 0x0121
SET_NODE, SET_MESH, SET_SPHERES, SET_MATERIAL = 0x0130, 0x0131, 0x0132, 0x0134
SET_TEXTURE, SET_LIGHT, SET_CAMERA, SET_ENVIRONMENT = 0x0135, 0x0136, 0x0137, 0x0138
SET_SKIN, SET_CLIP, SET_CHANNEL = 0x0139, 0x013a, 0x013b
TRANSLATION, ROTATION, SCALE, WEIGHTS, HIDDEN = 0, 1, 2, 3, 4
STEP, LINEAR, CUBIC = 0, 1, 2
IMPORT_NOTE, IMPORT_CLIP, IMPORT_PROGRESS, IMPORT_DONE, IMPORT_BOUNDS = 0x8301, 0x8302, 0x8303, 0x8304, 0x8305
IMPORT_VARIANT, IMPORT_FILE = 0x8306, 0x8307
UPLOAD_CHANNEL = 1
CHUNK = 1 << 20


class Fields:
    """Cursor over a payload: fixed part, then counted fields."""

    def __init__(self, payload):
        self.payload = payload
        self.at = 2

    def take(self, form):
        values = struct.unpack_from("<" + form, self.payload, self.at)
        self.at += struct.calcsize("<" + form)
        return values if len(values) > 1 else values[0]

    def head(self):
        """An object's number, which its record follows behind a size."""
        return self.take("IH")[0]

    def string(self):
        size = self.take("I")
        self.at += size
        return self.payload[self.at - size:self.at].decode("utf-8")

    def array(self, form):
        return [self.take(form) for _ in range(self.take("I"))]


def blob_refs(fields):
    return [(size, name) for size, name in fields.array("Q32s")]


def decode(kind, payload):
    """The edits as dictionaries; what no test looks at is left out."""
    f = Fields(payload)
    if kind == SET_NODE:
        node = f.head()
        parent, node_kind, thing, hidden = f.take("4I")
        return dict(id=node, parent=parent, kind=node_kind, object=thing, hidden=hidden, matrix=f.take("12f"),
                    skin=f.take("I"), light_group=f.take("I"), weights=f.array("f"), name=f.string())
    if kind == SET_MESH:
        mesh = f.head()
        vertices, triangles, influences, targets, closed = f.take("5I")
        return dict(id=mesh, vertices=vertices, triangles=triangles, influences=influences, targets=targets, closed=closed,
                    arrays=blob_refs(f), ranges=f.array("3I"), weights=f.array("f"), name=f.string())
    if kind == SET_SPHERES:
        spheres, count = f.head(), f.take("I")
        return dict(id=spheres, count=count, arrays=blob_refs(f), ranges=f.array("3I"), name=f.string())
    if kind == SET_MATERIAL:
        material = f.head()
        alpha_mode, double_sided, unlit = f.take("3I")
        base, emission, seen_only = f.take("4f"), f.take("3f"), f.take("I")
        metallic, roughness, transmission, ior, cutoff, *anisotropy = f.take("7f")
        specular, tint, body = f.take("4f"), f.take("3f"), f.take("2f")
        body = (body[0], *tint, body[1])
        layers = dict(coat=f.take("2f"), sheen=f.take("4f"), film=f.take("4f"), dispersion=f.take("f"), through=f.take("4f"),
                      thin_walled=f.take("I"))
        uses = [dict(texture=u[0], texcoord=u[1], transform=u[2:8], strength=u[8]) for u in f.array("2I6ff")]
        return dict(layers, id=material, alpha_mode=alpha_mode, double_sided=double_sided, unlit=unlit, base=base,
                    emission=emission, metallic=metallic, roughness=roughness, transmission=transmission, ior=ior,
                    cutoff=cutoff, anisotropy=anisotropy, seen_only=seen_only, specular=specular, body=body, textures=uses,
                    name=f.string())
    if kind == SET_TEXTURE:
        texture = f.head()
        width, height, form, wrap_u, wrap_v, nearest = f.take("6I")
        return dict(id=texture, width=width, height=height, format=form, wrap=(wrap_u, wrap_v), nearest=nearest,
                    arrays=blob_refs(f), name=f.string())
    if kind == SET_LIGHT:
        light, light_kind = f.head(), f.take("I")
        return dict(id=light, kind=light_kind, colour=f.take("3f"), range=f.take("f"), cones=f.take("2f"),
                    size=f.take("2f"), name=f.string())
    if kind == SET_CAMERA:
        return dict(id=f.head(), fov_y=f.take("f"), height=f.take("f"), near=f.take("f"), name=f.string())
    if kind == SET_ENVIRONMENT:
        f.take("H")  # bytes of the record
        return dict(id=0, colour=f.take("3f"), rotation=f.take("f"), size=f.take("2I"), backdrop=f.take("I"), keeps_image=f.take("I"),
                    display_values=f.take("I"), light_group=f.take("I"), arrays=blob_refs(f))
    if kind == SET_SKIN:
        return dict(id=f.head(), joints=f.take("I"), arrays=blob_refs(f), name=f.string())
    if kind == SET_CLIP:
        return dict(id=f.take("I"), arrays=blob_refs(f), name=f.string())
    if kind == SET_CHANNEL:
        names = ("id", "clip", "path", "object", "interpolation", "width", "keys", "first_time", "first_value")
        return dict(zip(names, (f.head(), *f.take("8I"))))
    raise AssertionError("unexpected edit 0x%04x" % kind)


def blob_hash(data):
    names = b"".join(hashlib.blake2b(data[at:at + CHUNK], digest_size=32).digest() for at in range(0, len(data), CHUNK))
    return hashlib.blake2b(names, digest_size=32).digest()


class Result:
    def __init__(self):
        self.notes, self.clips, self.variants, self.files, self.edits = [], [], [], [], []
        self.blobs = {}
        self.committed = self.done = False
        self.faults = []
        self.status = None
        self.stderr = ""
        self.seconds = 0.0
        self.times = self.origin = None

    def of(self, kind):
        return [edit for edit_kind, edit in self.edits if edit_kind == kind]

    def data(self, reference):
        return self.blobs[reference[1]]

    def floats(self, reference):
        return list(memoryview(self.data(reference)).cast("f"))

    def integers(self, reference):
        return list(memoryview(self.data(reference)).cast("I"))

    def colours(self, mesh):
        """Of vertices, 4 each: linear, 65535 is 1. Those that bytes hold exactly are sent as bytes."""
        data = memoryview(self.data(mesh["arrays"][6]))
        return list(data.cast("H")) if len(data) == 8 * mesh["vertices"] else [257 * one for one in data]

    def channels(self):
        """{(node's name, path): (interpolation, times, values)} of the only clip."""
        names = {node["id"]: node["name"] for node in self.of(SET_NODE)}
        clip, = self.of(SET_CLIP)
        numbers, found = self.floats(clip["arrays"][0]), {}
        for c in self.of(SET_CHANNEL):
            count = c["keys"] * c["width"] * (3 if c["interpolation"] == CUBIC else 1)
            found[names[c["object"]], c["path"]] = (
                c["interpolation"], numbers[c["first_time"]:c["first_time"] + c["keys"]],
                numbers[c["first_value"]:c["first_value"] + count])
        return found

    def errors(self):
        return [note for note in self.notes if note[0] == 2]

    def text(self):
        return "; ".join("%s: %s" % (where, text) for _, where, text in self.notes)


class Peer:
    """Answers like a server: asks for all blobs (or none), gives credit bit by bit, checks what comes."""

    def __init__(self, credit=4 << 20, refuse_commit=False, need=True, hang_up_after=None, first_credit=True):
        self.credit_step, self.refuse_commit, self.need = credit, refuse_commit, need
        self.hang_up_after, self.first_credit = hang_up_after, first_credit
        self.result = Result()
        self.sent, self.credit = 0, 0
        self.sizes, self.partial = {}, {}
        self.open_request = None

    def send(self, kind, request, payload, channel=0):
        padding = b"\0" * (-len(payload) % 8)
        try:
            self.socket.sendall(struct.pack("<IHHII", len(payload), kind, 0, request, channel) + payload + padding)
        except (BrokenPipeError, ConnectionResetError):
            pass

    def give_credit(self):
        self.credit += self.credit_step
        self.send(CREDIT, 0, struct.pack("<HIQ", 12, UPLOAD_CHANNEL, self.credit))

    def ok(self, request):
        self.send(OK, request, struct.pack("<HQ", 8, 1))

    def fault(self, text):
        self.result.faults.append(text)

    def on_offer(self, request, payload):
        refs = Fields(payload).array("Q32s")
        if not 1 <= len(refs) <= 1024:
            self.fault("an offer of %d blobs" % len(refs))
        self.sizes.update({name: size for size, name in refs})
        wanted = range(len(refs)) if self.need else []
        self.send(BLOB_NEED, request, struct.pack("<HI", 0, len(wanted)) + struct.pack("<%dI" % len(wanted), *wanted))

    def on_data(self, request, channel, payload):
        fields = Fields(payload)
        offset, name = fields.take("Q32s")
        count = fields.take("I")
        start = fields.at + (-fields.at % 8)
        piece = payload[start:start + count]
        self.sent += count
        if channel != UPLOAD_CHANNEL or count > 262144 or len(piece) != count:
            self.fault("a piece of %d bytes on channel %d" % (count, channel))
        if self.sent > self.credit:
            self.fault("%d bytes sent with a credit of %d" % (self.sent, self.credit))
        blob = self.partial.setdefault((request, name), bytearray())
        if offset != len(blob):
            self.fault("a piece out of order")
        blob += piece
        if self.credit - self.sent < self.credit_step // 2:
            self.give_credit()
        if len(blob) >= self.sizes.get(name, 0):
            if blob_hash(bytes(blob)) != name:
                self.fault("a blob without the hash that names it")
            self.result.blobs[name] = bytes(self.partial.pop((request, name)))
            self.ok(request)

    def on_message(self, kind, request, channel, payload):
        result = self.result
        if kind == IMPORT_NOTE:
            fields = Fields(payload)
            result.notes.append((fields.take("I"), fields.string(), fields.string()))
        elif kind == IMPORT_CLIP:
            fields = Fields(payload)
            result.clips.append(dict(id=fields.take("I"), channels=fields.take("I"), duration=fields.take("f"),
                                     name=fields.string()))
        elif kind == IMPORT_VARIANT:
            result.variants.append(Fields(payload).string())
        elif kind == IMPORT_FILE:
            fields = Fields(payload)
            result.files.append((fields.take("I"), fields.string()))
        elif kind == BLOB_OFFER:
            self.on_offer(request, payload)
        elif kind == BLOB_DATA:
            self.on_data(request, channel, payload)
        elif kind == EDIT_BEGIN:
            self.open_request = request
        elif kind == EDIT_COMMIT:
            if request != self.open_request:
                self.fault("commit of request %d, begun as %s" % (request, self.open_request))
            if self.refuse_commit:
                text, empty = b"not today", struct.pack("<I", 0)
                self.send(ERROR, request, struct.pack("<HIII", 12, 6, 0, 0) + empty +
                          struct.pack("<I", len(text)) + text + empty)
            else:
                result.committed = True
                self.ok(request)
        elif kind == IMPORT_DONE:
            result.done = True
            fields = Fields(payload)
            result.times, result.origin = fields.take("5Q"), fields.take("3f")
        elif kind == IMPORT_BOUNDS:
            values = Fields(payload).take("II6f")
            if not all(lower <= upper for lower, upper in zip(values[2:5], values[5:])):
                self.fault("a box that is inside out")
        elif kind != IMPORT_PROGRESS:
            if request != self.open_request:
                self.fault("an edit outside the transaction")
            result.edits.append((kind, decode(kind, payload)))

    def pump(self, deadline):
        buffer, seen = bytearray(), 0
        while True:
            left = deadline - time.monotonic()
            if left <= 0 or not select.select([self.socket], [], [], left)[0]:
                return False
            try:
                data = self.socket.recv(1 << 20)
            except ConnectionResetError:
                return True
            if not data:
                return True
            buffer += data
            at = 0
            while len(buffer) - at >= 16:
                size, kind, _, request, channel = struct.unpack_from("<IHHII", buffer, at)
                whole = 16 + size + (-size % 8)
                if len(buffer) - at < whole:
                    break
                self.on_message(kind, request, channel, bytes(buffer[at + 16:at + 16 + size]))
                at += whole
                seen += 1
                if self.hang_up_after is not None and seen >= self.hang_up_after:
                    self.socket.close()
                    return True
            del buffer[:at]

    def run(self, arguments, seconds=10, wall_s=None, memory=None):
        """`seconds` of processor time; `wall_s` on the clock, where it is to wait in vain."""
        ours, theirs = socket.socketpair()
        self.socket = ours
        began = time.monotonic()

        def limit():  # from the beginning: the importer sets limits of its own
            resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
        process = subprocess.Popen([IMPORTER, "--fd", str(theirs.fileno())] + arguments, pass_fds=[theirs.fileno()],
                                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                   preexec_fn=limit if memory and SLOWER == 1 else None)
        theirs.close()
        if self.first_credit:
            self.give_credit()
        seconds *= SLOWER
        end = began + (wall_s or seconds + BUSY_S)
        in_time = self.pump(end)
        late = threading.Timer(max(0.1, end - time.monotonic()), process.kill)
        late.start()
        with process.stderr:
            self.result.stderr = process.stderr.read().decode("utf-8", "replace")
        _, status, usage = os.wait4(process.pid, 0)
        late.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        # Sanitized, it lets the libraries talk; and the leak sanitizer cannot stop threads that libraries started
        # before the sandbox was entered.
        self.result.stderr = "".join(line for line in self.result.stderr.splitlines(True)
                                     if SLOWER == 1 or not ("was not suspended. False leaks" in line or
                                                            line.startswith("libpng ")))
        self.result.seconds = usage.ru_utime + usage.ru_stime
        if not in_time or self.result.seconds > seconds:
            self.fault("not done within %g s of processor time" % seconds)
        ours.close()
        self.result.status = process.returncode
        return self.result


def import_file(path, *more, **options):
    run = {key: options.pop(key) for key in ("seconds", "wall_s", "memory") if key in options}
    return Peer(**options).run(list(more) + [path], **run)


def import_files(paths, **options):
    """Pairs of path and result; two at a time."""
    with concurrent.futures.ThreadPoolExecutor(max_workers=2) as pool:
        return list(zip(paths, pool.map(lambda path: import_file(path, **options), paths)))


def array_widths(mesh):
    """Bytes of a vertex in each array; the second one has 12 a triangle."""
    influences, targets = mesh["influences"], mesh["targets"]
    colours = 8 if len(mesh["arrays"]) > 6 and mesh["arrays"][6][0] == 8 * mesh["vertices"] else 4
    return (12, None, 12, 16, 8, 8, colours, 2 * influences, 4 * influences) + (12 * targets,) * 3


def animation_inconsistencies(result):
    found = []
    nodes = {e["id"]: e for e in result.of(SET_NODE)}
    meshes = {e["id"]: e for e in result.of(SET_MESH)}
    skins = {e["id"]: e for e in result.of(SET_SKIN)}
    clips = {e["id"]: memoryview(result.data(e["arrays"][0])).cast("f") for e in result.of(SET_CLIP)}
    order = [(kind, edit["id"]) for kind, edit in result.edits]
    for skin in skins.values():
        joints = memoryview(result.data(skin["arrays"][0])).cast("I")
        if len(joints) != skin["joints"] or any(joint not in nodes for joint in joints):
            found.append("skin %d: joints" % skin["id"])
        if any(order.index((SET_NODE, joint)) > order.index((SET_SKIN, skin["id"])) for joint in joints):
            found.append("skin %d: a joint comes after it" % skin["id"])
        if len(skin["arrays"]) == 2 and skin["arrays"][1][0] != skin["joints"] * 48:
            found.append("skin %d: matrices" % skin["id"])
    for node in nodes.values():
        mesh = meshes[node["object"]] if node["kind"] == 1 else None
        if node["skin"]:
            if not mesh or not mesh["influences"] or node["skin"] not in skins:
                found.append("node %d: skin" % node["id"])
            elif max(memoryview(result.data(mesh["arrays"][7])).cast("H")) >= skins[node["skin"]]["joints"]:
                found.append("node %d: its mesh names joints that its skin has not" % node["id"])
        if len(node["weights"]) > (mesh["targets"] if mesh else 0):
            found.append("node %d: weights" % node["id"])
    moved = {}
    for channel in result.of(SET_CHANNEL):
        floats, path, node = clips.get(channel["clip"], ()), channel["path"], nodes.get(channel["object"])
        count = channel["keys"] * channel["width"] * (3 if channel["interpolation"] == CUBIC else 1)
        times = list(floats[channel["first_time"]:channel["first_time"] + channel["keys"]])
        width = {TRANSLATION: 3, ROTATION: 4, SCALE: 3, HIDDEN: 1}.get(path)
        if path == WEIGHTS and node and node["kind"] == 1:
            width = meshes[node["object"]]["targets"]
        if (len(times) != channel["keys"] or times != sorted(set(times)) or channel["width"] != width or
                channel["first_value"] + count > len(floats)):
            found.append("channel %d" % channel["id"])
        key = (channel["clip"], channel["object"])
        if path in moved.setdefault(key, set()):
            found.append("channel %d: a second one of its property" % channel["id"])
        moved[key].add(path)
    # Cameras and lights have no scale: their matrices can be taken apart.
    found += ["node %d of clip %d: paths %s" % (node, clip, paths) for (clip, node), paths in moved.items()
              if nodes[node]["kind"] not in (3, 4) and
              paths - {WEIGHTS, HIDDEN} not in (set(), {TRANSLATION, ROTATION, SCALE})]
    listed = [clip["id"] for clip in result.clips if clip["id"]]
    if sorted(listed) != sorted(clips) or len(set(listed)) != len(listed):
        found.append("the clips %s are told as %s" % (sorted(clips), listed))
    if any(value - value != 0 for floats in clips.values() for value in floats):
        found.append("a clip with numbers that are not finite")
    return found


def inconsistencies(result):
    """What a server would refuse, and a little more."""
    found = animation_inconsistencies(result)
    meshes = {e["id"]: e for e in result.of(SET_MESH)}
    spheres = {e["id"]: e for e in result.of(SET_SPHERES)}
    materials = {e["id"] for e in result.of(SET_MATERIAL)} | {0}
    textures = {e["id"] for e in result.of(SET_TEXTURE)} | {0}
    nodes = {e["id"] for e in result.of(SET_NODE)} | {0}
    things = [None, meshes, spheres, {e["id"] for e in result.of(SET_LIGHT)}, {e["id"] for e in result.of(SET_CAMERA)}]
    for mesh in meshes.values():
        for number, (size, name) in enumerate(mesh["arrays"]):
            wanted = mesh["triangles"] * 12 if number == 1 else mesh["vertices"] * array_widths(mesh)[number]
            if size != wanted and not (size == 0 and number > 1):
                found.append("mesh %d array %d has %d bytes, not %d" % (mesh["id"], number, size, wanted))
        if (mesh["influences"] > 0) != (len(mesh["arrays"]) > 8 and mesh["arrays"][8][0] > 0):
            found.append("mesh %d: %d influences" % (mesh["id"], mesh["influences"]))
        if (mesh["targets"] > 0) != (len(mesh["arrays"]) > 9) or len(mesh["weights"]) > mesh["targets"]:
            found.append("mesh %d: %d morph targets" % (mesh["id"], mesh["targets"]))
        if max(memoryview(result.data(mesh["arrays"][1])).cast("I")) >= mesh["vertices"]:
            found.append("mesh %d: index out of range" % mesh["id"])
        positions = memoryview(result.data(mesh["arrays"][0])).cast("f")
        if any(value - value != 0 for value in positions[:300000]):
            found.append("mesh %d: position not finite" % mesh["id"])
        end = 0
        for first, count, material in mesh["ranges"]:
            if first < end or first + count > mesh["triangles"] or material not in materials:
                found.append("mesh %d: bad range" % mesh["id"])
            end = first + count
    for entry in result.of(SET_TEXTURE):
        if entry["arrays"][0][0] != entry["width"] * entry["height"] * 4:
            found.append("texture %d: size" % entry["id"])
    for material in result.of(SET_MATERIAL):
        if any(use["texture"] not in textures for use in material["textures"]):
            found.append("material %d: texture" % material["id"])
    for node in result.of(SET_NODE):
        if node["parent"] not in nodes or (node["kind"] and node["object"] not in things[node["kind"]]):
            found.append("node %d: reference" % node["id"])
    return found


class Written(Case):
    """Small models, written by the test, whose outcome is known."""

    def write(self, name, text):
        path = self.folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8"))
        return path

    def import_text(self, name, text, status=0, **options):
        result = import_file(str(self.write(name, text)), **options)
        self.assertEqual((result.status, result.faults, result.stderr), (status, [], ""), result.text())
        if status == 0:
            self.assertEqual(inconsistencies(result), [])
        return result

    def assert_has(self, got, wanted, where=""):
        """Dictionaries have at least the members that are wanted; numbers are equal to five places; all else is the same."""
        if isinstance(wanted, dict):
            for key, value in wanted.items():
                self.assert_has(got[key], value, f"{where}.{key}")
        elif isinstance(wanted, (list, tuple)):
            self.assertEqual(len(got), len(wanted), f"{where}: {got}")
            for i, value in enumerate(wanted):
                self.assert_has(got[i], value, f"{where}[{i}]")
        elif isinstance(wanted, float):
            self.assertAlmostEqual(got, wanted, 5, where)
        else:
            self.assertEqual(got, wanted, where)
