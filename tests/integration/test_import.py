#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""farlight-import against a peer that answers as a server would.

Properties verified:
  - every model of the scenes folder is imported: exit 0, one transaction, references and sizes consistent;
  - every hostile file ends with exit 0 or 1 within ten seconds of processor time and bounded memory, never by a signal, and a
    refused one names its file and what is wrong, and commits nothing;
  - a file that the Khronos validator finds no error in is imported;
  - blob data arrives whole, in order, within the credit, and has the hash that names it;
  - a peer that refuses, hangs up or gives no credit is survived;
  - made-up models give the numbers that they should (counts, materials, transforms, lights, cameras).

Environment: FARLIGHT_BIN (default build/release), FARLIGHT_SCENES (default ../shared/scenes beside the checkout).
"""

import base64
import concurrent.futures
import hashlib
import json
import os
import resource
import select
import shutil
import socket
import struct
import subprocess
import tempfile
import threading
import time
import unittest
import unittest.mock

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BIN = os.environ.get("FARLIGHT_BIN") or os.path.join(ROOT, "build", "release")
IMPORTER = os.path.join(os.path.abspath(BIN), "farlight-import")
SCENES = os.environ.get("FARLIGHT_SCENES") or os.path.join(os.path.dirname(ROOT), "shared", "scenes")
SLOWER = 6 if "sanitize" in BIN else 1
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
        node, parent, node_kind, thing, hidden = f.take("5I")
        return dict(id=node, parent=parent, kind=node_kind, object=thing, hidden=hidden, matrix=f.take("12f"),
                    skin=f.take("I"), weights=f.array("f"), name=f.string())
    if kind == SET_MESH:
        mesh, vertices, triangles, influences, targets, closed = f.take("6I")
        return dict(id=mesh, vertices=vertices, triangles=triangles, influences=influences, targets=targets, closed=closed,
                    arrays=blob_refs(f), ranges=f.array("3I"), weights=f.array("f"), name=f.string())
    if kind == SET_SPHERES:
        spheres, count = f.take("2I")
        return dict(id=spheres, count=count, arrays=blob_refs(f), ranges=f.array("3I"), name=f.string())
    if kind == SET_MATERIAL:
        material, alpha_mode, double_sided, unlit = f.take("4I")
        base, emission = f.take("4f"), f.take("3f")
        metallic, roughness, transmission, ior, cutoff, *anisotropy = f.take("7f")
        uses = [dict(texture=u[0], texcoord=u[1], transform=u[2:8], strength=u[8]) for u in f.array("2I6ff")]
        return dict(id=material, alpha_mode=alpha_mode, double_sided=double_sided, unlit=unlit, base=base,
                    emission=emission, metallic=metallic, roughness=roughness, transmission=transmission, ior=ior,
                    cutoff=cutoff, anisotropy=anisotropy, textures=uses, name=f.string())
    if kind == SET_TEXTURE:
        texture, width, height, form, wrap_u, wrap_v, nearest = f.take("7I")
        return dict(id=texture, width=width, height=height, format=form, wrap=(wrap_u, wrap_v), nearest=nearest,
                    arrays=blob_refs(f), name=f.string())
    if kind == SET_LIGHT:
        light, light_kind = f.take("2I")
        return dict(id=light, kind=light_kind, colour=f.take("3f"), range=f.take("f"), cones=f.take("2f"),
                    size=f.take("2f"), name=f.string())
    if kind == SET_CAMERA:
        return dict(id=f.take("I"), fov_y=f.take("f"), height=f.take("f"), near=f.take("f"), name=f.string())
    if kind == SET_ENVIRONMENT:
        return dict(id=0, colour=f.take("3f"), rotation=f.take("f"), size=f.take("2I"), arrays=blob_refs(f))
    if kind == SET_SKIN:
        return dict(id=f.take("I"), joints=f.take("I"), arrays=blob_refs(f), name=f.string())
    if kind == SET_CLIP:
        return dict(id=f.take("I"), arrays=blob_refs(f), name=f.string())
    if kind == SET_CHANNEL:
        names = ("id", "clip", "path", "object", "interpolation", "width", "keys", "first_time", "first_value")
        return dict(zip(names, f.take("9I")))
    raise AssertionError("unexpected edit 0x%04x" % kind)


def blob_hash(data):
    names = b"".join(hashlib.blake2b(data[at:at + CHUNK], digest_size=32).digest() for at in range(0, len(data), CHUNK))
    return hashlib.blake2b(names, digest_size=32).digest()


class Result:
    def __init__(self):
        self.notes, self.clips, self.edits = [], [], []
        self.blobs = {}
        self.committed = self.done = False
        self.faults = []
        self.status = None
        self.stderr = ""
        self.seconds = 0.0
        self.times = None

    def of(self, kind):
        return [edit for edit_kind, edit in self.edits if edit_kind == kind]

    def data(self, reference):
        return self.blobs[reference[1]]

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
            result.times = Fields(payload).take("5Q")
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

        process = subprocess.Popen([IMPORTER, "--fd", str(theirs.fileno())] + arguments, pass_fds=[theirs.fileno()],
                                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        theirs.close()
        if memory and "sanitize" not in BIN:
            resource.prlimit(process.pid, resource.RLIMIT_AS, (memory, memory))
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
    return (12, None, 12, 16, 8, 8, 4, 2 * influences, 4 * influences) + (12 * targets,) * 3


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


def model_files(folder, endings):
    for base, folders, names in os.walk(folder):
        folders.sort()
        for name in sorted(names):
            if name.lower().endswith(endings):
                yield os.path.join(base, name)


def needs_scenes(test):
    def run(self):
        if not os.path.isdir(SCENES):
            print("skipped: there is no folder %s" % SCENES)
            self.skipTest("no scenes folder")
        test(self)

    run.__doc__, run.__name__ = test.__doc__, test.__name__
    return run


def shorter(path):
    return os.path.relpath(path, SCENES)


class Models(unittest.TestCase):
    @needs_scenes
    def test_every_model_is_imported(self):
        """All of common, ldc, bvh, rayspace, screenspace and gltf."""
        count, triangles, spheres, warned = 0, 0, 0, 0
        for folder in ("common", "ldc", "bvh", "rayspace", "screenspace", "gltf"):
            paths = list(model_files(os.path.join(SCENES, folder), (".obj", ".gltf", ".glb", ".nff")))
            for path, result in import_files(paths, seconds=30):
                with self.subTest(shorter(path)):
                    self.assertEqual(result.faults, [])
                    self.assertEqual(result.status, 0, result.text() + result.stderr)
                    self.assertTrue(result.committed)
                    self.assertEqual(inconsistencies(result), [])
                    count += 1
                    warned += any(note[0] == 1 for note in result.notes)
                    triangles += sum(mesh["triangles"] for mesh in result.of(SET_MESH))
                    spheres += sum(one["count"] for one in result.of(SET_SPHERES))
        print("models: %d imported, %d with warnings; %d triangles, %d spheres" % (count, warned, triangles, spheres))

    @needs_scenes
    def test_known_counts(self):
        """Triangles and spheres as the scenes' README states them."""
        for name, triangles, spheres in (
                ("common/dragon-871k.glb", 871414, 0), ("common/bunny-69k.obj", 69451, 0),
                ("common/teapot.obj", 6320, 0), ("rayspace/kitchen.obj", 85864, 0),
                ("screenspace/classroom.obj", 111164, 0), ("bvh/spd-mount.nff", 8192, 4),
                ("bvh/spd-tetra.nff", 4096, 0), ("gltf/DamagedHelmet.glb", 15452, 0),
                ("ldc/CesiumMan.glb", 4672, 0), ("gltf/CornellBox.glb", 36, 0)):
            with self.subTest(name):
                result = import_file(os.path.join(SCENES, name), seconds=30)
                self.assertEqual(sum(mesh["triangles"] for mesh in result.of(SET_MESH)), triangles)
                self.assertEqual(sum(one["count"] for one in result.of(SET_SPHERES)), spheres)

    @needs_scenes
    def test_environments_are_imported(self):
        """Every file of env, without a model."""
        for path in model_files(os.path.join(SCENES, "env"), (".exr", ".hdr")):
            with self.subTest(shorter(path)):
                result = Peer().run(["--environment", path, "--no-model"], seconds=30)
                self.assertEqual(result.status, 0, result.text() + result.stderr)
                width, height = result.of(SET_ENVIRONMENT)[0]["size"]
                halves = memoryview(result.data(result.of(SET_ENVIRONMENT)[0]["arrays"][0])).cast("H")
                self.assertEqual(len(halves), width * height * 4)
                self.assertLessEqual(max(halves), 0x7bff, "a half that is not finite or negative")

    @needs_scenes
    def test_unknown_format_is_named(self):
        result = import_file(os.path.join(SCENES, "formats", "stl", "colored.stl"))
        self.assertEqual(result.status, 1)
        self.assertIn("unknown format .stl", result.text())


# Valid by the letter, and yet there is nothing that could be shown of them.
NOT_TO_BE_HAD = {
    "accessor/unknown_type.gltf": "an accessor of a type that does not exist",
    "buffer/non_relative_uri.gltf": "a buffer on the network",
    "buffer/valid_placeholder.glb": "a buffer whose bytes are nowhere",
    "json/integer_written_as_float.gltf": "buffers whose bytes are nowhere",
    "root/named_objects.gltf": "buffers whose bytes are nowhere",
    "root/unused_objects.gltf": "buffers whose bytes are nowhere",
}


class Hostile(unittest.TestCase):
    results = {}

    @classmethod
    def import_all(cls):
        """Every file of the folder, once for all tests of this class."""
        if not cls.results:
            cls.results.update(import_files(list(model_files(os.path.join(SCENES, "hostile"), ("",))), memory=6 << 30))
        return cls.results

    @needs_scenes
    def test_every_hostile_file_is_refused_or_imported(self):
        """All of hostile: also those that are no models, given as if they were."""
        imported, refused, slowest = 0, 0, 0.0
        for path, result in self.import_all().items():
            with self.subTest(shorter(path)):
                self.assertEqual(result.faults, [])
                self.assertIn(result.status, (0, 1), result.stderr)
                self.assertEqual(result.stderr, "")
                self.assertEqual(result.committed, result.status == 0)
                self.assertEqual(result.done, result.status == 0)
                if result.status == 1:
                    self.assertEqual(len(result.errors()), 1)
                    _, where, text = result.errors()[0]
                    self.assertIn(os.path.basename(path)[:60], where)
                    self.assertGreater(len(text), 8)
                else:
                    self.assertEqual(inconsistencies(result), [])
                imported += result.status == 0
                refused += result.status == 1
                slowest = max(slowest, result.seconds)
        print("hostile: %d imported, %d refused; slowest %.2f s" % (imported, refused, slowest))

    @needs_scenes
    def test_what_the_validator_accepts_is_imported(self):
        accepted, shown, empty, paths = 0, 0, 0, []
        for report_path in model_files(os.path.join(SCENES, "hostile", "gltf-validator"), (".report.json",)):
            with open(report_path, encoding="utf-8") as file:
                report = json.load(file)
            path = report_path[:-len(".report.json")]
            if report["issues"]["numErrors"] == 0 and os.path.exists(path):
                paths.append(path)
        for path in paths:
            result = self.import_all()[path]
            accepted += 1
            with self.subTest(shorter(path)):
                if any(path.endswith(ending) for ending in NOT_TO_BE_HAD):
                    self.assertEqual(result.status, 1)
                    continue
                self.assertEqual(result.status, 0, result.text())
                shown += bool(result.edits)
                empty += not result.edits
        print("validator: %d without errors; %d imported, %d hold nothing to show, %d name bytes that are nowhere"
              % (accepted, shown, empty, accepted - shown - empty))

    def test_a_fifo_or_a_folder_as_buffer_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            os.mkfifo(os.path.join(folder, "pipe.bin"))
            os.mkdir(os.path.join(folder, "folder.bin"))
            for name in ("pipe.bin", "folder.bin", "/etc/passwd", "../x.bin", "missing.bin"):
                with self.subTest(name):
                    path = os.path.join(folder, "model.gltf")
                    with open(path, "w", encoding="utf-8") as file:
                        json.dump({"asset": {"version": "2.0"}, "buffers": [{"uri": name, "byteLength": 4}]}, file)
                    result = import_file(path, seconds=5)
                    self.assertEqual((result.status, result.faults), (1, []))
                    self.assertEqual(len(result.errors()), 1, result.notes)

    def test_secrets_beside_a_model_are_no_buffers(self):
        with tempfile.TemporaryDirectory() as folder:
            secrets = {".ssh/id": b"\0" * 16, ".token": b"\0" * 16, "key.bin": os.urandom(32),
                       "id_rsa": b"-----BEGIN OPENSSH PRIVATE KEY-----\n" * 4, "secrets.json": b'{"password": "\xc3\xa4"}',
                       "cookies.sqlite": b"SQLite format 3\0" + bytes(32), "key.der": b"\x30\x82\1\2\2\1\0" + bytes(32),
                       "program": b"\x7fELF" + bytes(32), "packed.gz": b"\x1f\x8b\x08" + bytes(32)}
            os.mkdir(os.path.join(folder, ".ssh"))
            os.mkdir(os.path.join(folder, "plain"))
            os.mkdir(os.path.join(folder, ".hidden"))
            for name, data in secrets.items():
                with open(os.path.join(folder, name), "wb") as file:
                    file.write(data)
            os.chmod(os.path.join(folder, "key.bin"), 0o600)
            os.symlink(".ssh", os.path.join(folder, "link"))
            os.symlink("../.token", os.path.join(folder, "plain", "link.bin"))
            for name in [*secrets, "link/id", "plain/link.bin", "./plain/../.token", "plain\\..\\.token"]:
                with self.subTest(name):
                    path = os.path.join(folder, "model.gltf")
                    with open(path, "w", encoding="utf-8") as file:
                        json.dump({"asset": {"version": "2.0"}, "buffers": [{"uri": name, "byteLength": 16}]}, file)
                    result = import_file(path, seconds=5)
                    self.assertEqual((result.status, result.faults, result.blobs), (1, [], {}))
                    self.assertRegex(result.text(), "begin with a dot|mode of a key|is (text|a |an |packed)")

    def test_links_within_the_folder_and_a_hidden_folder_of_the_model_are_read(self):
        with tempfile.TemporaryDirectory() as folder:
            models = os.path.join(folder, ".models")
            os.makedirs(os.path.join(models, "data"))
            with open(os.path.join(models, "data", "real.bin"), "wb") as file:
                file.write(bytes(16))
            os.symlink("data", os.path.join(models, "also"))
            os.symlink("../also/real.bin", os.path.join(models, "data", "link.bin"))
            for name in ("data/real.bin", "./data/link.bin", "also/../data/./real.bin", "data\\real.bin"):
                with self.subTest(name):
                    path = os.path.join(models, "model.gltf")
                    with open(path, "w", encoding="utf-8") as file:
                        json.dump({"asset": {"version": "2.0"}, "buffers": [{"uri": name, "byteLength": 16}]}, file)
                    result = import_file(path, seconds=5)
                    self.assertNotIn("real.bin", result.text())
                    self.assertNotIn("buffer", result.text())

    def test_a_material_file_that_is_none_is_not_read(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, data in (("passwords", b"admin newmtl secret\n"), ("binary.mtl", b"newmtl a\n\0"), (".hidden.mtl", b"newmtl a\n")):
                with self.subTest(name):
                    with open(os.path.join(folder, name), "wb") as file:
                        file.write(data)
                    path = os.path.join(folder, "model.obj")
                    with open(path, "w", encoding="utf-8") as file:
                        file.write(f"mtllib {name}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n")
                    result = import_file(path, seconds=5)
                    self.assertEqual((result.status, result.faults), (0, []))
                    self.assertRegex(result.text(), "no statement 'newmtl'|begin with a dot")

    def test_a_fifo_as_model_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "model.obj")
            os.mkfifo(path)
            result = import_file(path, seconds=5)
            self.assertEqual(result.status, 1)
            self.assertIn("FIFO", result.text())


class Peers(unittest.TestCase):
    """What the importer does when its peer is not kind."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.path = os.path.join(self.folder.name, "strip.obj")
        with open(self.path, "w", encoding="utf-8") as file:
            for i in range(40000):
                file.write("v %d %d 0\n" % (i // 2, i % 2))
            for i in range(1, 39999):
                file.write("f %d %d %d\n" % (i, i + 1, i + 2))

    def tearDown(self):
        self.folder.cleanup()

    def test_small_credits_are_kept(self):
        result = import_file(self.path, credit=300000)
        self.assertEqual((result.status, result.faults), (0, []))
        self.assertGreater(sum(map(len, result.blobs.values())), 900000)

    def test_nothing_is_sent_that_is_not_needed(self):
        result = import_file(self.path, need=False)
        self.assertEqual((result.status, result.faults, len(result.blobs)), (0, [], 0))

    def test_without_credit_no_data_is_sent(self):
        result = import_file(self.path, first_credit=False, wall_s=1.5)
        self.assertEqual(result.blobs, {})
        self.assertFalse(result.committed)

    def test_a_refused_transaction_is_reported(self):
        result = import_file(self.path, refuse_commit=True)
        self.assertEqual(result.status, 1)
        self.assertFalse(result.done)
        self.assertIn("not today", result.errors()[0][2])

    def test_a_peer_that_hangs_up_is_left_quietly(self):
        for after in (1, 3, 4):
            result = import_file(self.path, hang_up_after=after)
            self.assertEqual((result.status, result.stderr), (1, ""))

    def test_wrong_usage_ends_with_2(self):
        for arguments in ([], ["--fd", "x", "m.obj"], ["--fd", "0"], ["--bogus"]):
            done = subprocess.run([IMPORTER] + arguments, stdin=subprocess.DEVNULL, capture_output=True, check=False)
            self.assertEqual(done.returncode, 2, arguments)

    def test_a_missing_model_is_named(self):
        result = import_file(os.path.join(self.folder.name, "nowhere.glb"))
        self.assertEqual(result.status, 1)
        self.assertIn("nowhere.glb", result.errors()[0][1])


# 1x1 texel of linear 0.5 in all channels.
HDR = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x80\x80\x80"
TRIANGLE = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)


def gltf(extra, data=TRIANGLE, views=None, accessors=None):
    """A glTF file whose one buffer is in it."""
    model = {"asset": {"version": "2.0"},
             "buffers": [{"uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode("ascii"),
                          "byteLength": len(data)}],
             "bufferViews": views or [{"buffer": 0, "byteLength": len(data)}],
             "accessors": accessors or [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}]}
    model.update(extra)
    return model


class Written(unittest.TestCase):
    """Small models, made here, whose outcome is known."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()

    def tearDown(self):
        self.folder.cleanup()

    def run_text(self, name, text, status=0):
        path = os.path.join(self.folder.name, name)
        with open(path, "wb") as file:
            file.write(text if isinstance(text, bytes) else text.encode("utf-8"))
        result = import_file(path)
        self.assertEqual((result.status, result.faults, result.stderr), (status, [], ""), result.text())
        if status == 0:
            self.assertEqual(inconsistencies(result), [])
        return result

    def run_gltf(self, *arguments, status=0, **options):
        return self.run_text("model.gltf", json.dumps(gltf(*arguments, **options)), status)

    def floats(self, result, mesh, array):
        return list(memoryview(result.data(mesh["arrays"][array])).cast("f"))

    def integers(self, result, mesh):
        return list(memoryview(result.data(mesh["arrays"][1])).cast("I"))

    def test_gltf_transform_camera_and_light(self):
        result = self.run_gltf({
            "scenes": [{"nodes": [0]}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "nodes": [{"mesh": 0, "camera": 0, "name": "all", "translation": [1, 2, 3], "scale": [2, 2, 2],
                       "extensions": {"KHR_lights_punctual": {"light": 0}}}],
            "cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}],
            "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 5, "color": [1, 0.5, 0]}]}}})
        group, *below = result.of(SET_NODE)
        self.assertEqual(group["matrix"], (2, 0, 0, 1, 0, 2, 0, 2, 0, 0, 2, 3))
        self.assertEqual([(node["parent"], node["kind"]) for node in below], [(group["id"], kind) for kind in (1, 4, 3)])
        self.assertAlmostEqual(result.of(SET_CAMERA)[0]["fov_y"], 0.7, 6)
        self.assertEqual(result.of(SET_LIGHT)[0]["colour"], (5, 2.5, 0))

    def test_gltf_point_lights_with_a_radius_are_spheres_that_send_as_much(self):
        lights = [{"type": "point", "intensity": 5, "color": [1, 0.5, 0], "extras": {"radius": radius}}
                  for radius in (0.5, 0, -1, "wide")]
        result = self.run_gltf({
            "scenes": [{"nodes": [0, 1, 2, 3]}],
            "nodes": [{"extensions": {"KHR_lights_punctual": {"light": i}}} for i in range(4)],
            "extensions": {"KHR_lights_punctual": {"lights": lights}}})
        sphere, *points = result.of(SET_LIGHT)
        self.assertEqual((sphere["kind"], sphere["size"][0]), (4, 0.5))
        for got, intensity in zip(sphere["colour"], (5, 2.5, 0)):
            self.assertAlmostEqual(got * 3.14159265 * 0.25, intensity, 5)
        self.assertEqual([(light["kind"], light["colour"]) for light in points], [(0, (5, 2.5, 0))] * 3)

    def test_gltf_strips_and_fans_become_triangles(self):
        data = struct.pack("<12f", 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0)
        for mode, wanted in ((5, [0, 1, 2, 1, 3, 2]), (6, [1, 2, 0, 2, 3, 0])):
            result = self.run_gltf(
                {"nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": mode}]}]},
                data=data, accessors=[{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}])
            self.assertEqual(self.integers(result, result.of(SET_MESH)[0]), wanted)

    def test_gltf_quantised_and_sparse_positions(self):
        data = struct.pack("<9bxxx", 0, 0, 0, 127, 0, 0, 0, 127, 0) + struct.pack("<Bxxx3f", 2, 0, 3, 0) + TRIANGLE
        views = [{"buffer": 0, "byteLength": 9}, {"buffer": 0, "byteOffset": 12, "byteLength": 1},
                 {"buffer": 0, "byteOffset": 16, "byteLength": 12}, {"buffer": 0, "byteOffset": 28, "byteLength": 36}]
        sparse = {"count": 1, "indices": {"bufferView": 1, "componentType": 5121}, "values": {"bufferView": 2}}
        accessors = [{"bufferView": 0, "componentType": 5120, "normalized": True, "count": 3, "type": "VEC3"},
                     {"bufferView": 3, "componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse}]
        result = self.run_gltf({"nodes": [{"mesh": 0}, {"mesh": 1}],
                                "meshes": [{"primitives": [{"attributes": {"POSITION": i}}]} for i in (0, 1)]},
                               data=data, views=views, accessors=accessors)
        first, second = result.of(SET_MESH)
        self.assertEqual(self.floats(result, first, 0), [0, 0, 0, 1, 0, 0, 0, 1, 0])
        self.assertEqual(self.floats(result, second, 0), [0, 0, 0, 1, 0, 0, 0, 3, 0])

    def test_gltf_primitives_are_one_mesh_with_ranges(self):
        result = self.run_gltf({
            "nodes": [{"mesh": 0}], "materials": [{"name": "a"}, {"name": "b", "doubleSided": True}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": m} for m in (1, 0)]}]})
        mesh, = result.of(SET_MESH)
        names = {m["id"]: m["name"] for m in result.of(SET_MATERIAL)}
        self.assertEqual([(first, count, names[m]) for first, count, m in mesh["ranges"]], [(0, 1, "b"), (1, 1, "a")])
        self.assertEqual((mesh["vertices"], mesh["triangles"]), (3, 2), "equal accessors share their vertices")

    def test_gltf_primitives_that_bound_a_body_together_are_closed(self):
        corners = struct.pack("<12f", 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1)
        faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
        for kept, closed in ((4, 1), (3, 0)):
            # Each face is a primitive with corners and a material of its own.
            data = b"".join(corners[12 * c:12 * c + 12] for face in faces for c in face)
            result = self.run_gltf(
                {"nodes": [{"mesh": 0}], "materials": [{}, {}],
                 "meshes": [{"primitives": [{"attributes": {"POSITION": i}, "material": i % 2} for i in range(kept)]}]},
                data=data, accessors=[{"bufferView": 0, "byteOffset": 36 * i, "componentType": 5126, "count": 3,
                                       "type": "VEC3"} for i in range(4)])
            self.assertEqual([mesh["closed"] for mesh in result.of(SET_MESH)], [closed])

    def test_gltf_material_extensions(self):
        extensions = {"KHR_materials_transmission": {"transmissionFactor": 0.9}, "KHR_materials_ior": {"ior": 1.33},
                      "KHR_materials_emissive_strength": {"emissiveStrength": 4}, "KHR_materials_unlit": {}}
        result = self.run_gltf({
            "nodes": [{"mesh": 0}],
            "materials": [{"emissiveFactor": [1, 0.5, 0], "alphaMode": "MASK", "alphaCutoff": 0.25,
                           "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1, 0.5], "metallicFactor": 0.5,
                                                    "roughnessFactor": 0.125}, "extensions": extensions}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}]})
        material, = result.of(SET_MATERIAL)
        self.assertEqual((material["base"], material["emission"]), ((0.5, 0.25, 1, 0.5), (4, 2, 0)))
        self.assertEqual((material["metallic"], material["roughness"], material["unlit"]), (0.5, 0.125, 1))
        self.assertEqual((material["alpha_mode"], material["cutoff"]), (1, 0.25))
        self.assertAlmostEqual(material["transmission"], 0.9, 6)
        self.assertAlmostEqual(material["ior"], 1.33, 6)

    def test_gltf_anisotropy(self):
        def materials(*brushed):
            result = self.run_gltf({
                "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}], "extensionsRequired": ["KHR_materials_anisotropy"],
                "images": [{"uri": "nowhere.png"}], "textures": [{"source": 0}],
                "materials": [{"extensions": {"KHR_materials_anisotropy": one}} for one in brushed],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": i} for i in range(len(brushed))]}]})
            return [m["anisotropy"] for m in result.of(SET_MATERIAL)], result
        got, result = materials({"anisotropyStrength": 0.5, "anisotropyRotation": -1.5}, {}, {"anisotropyRotation": 2})
        self.assertEqual(got, [[0.5, -1.5], [0, 0], [0, 2]])
        self.assertEqual(result.notes, [])
        got, result = materials({"anisotropyStrength": 3, "anisotropyRotation": "east", "anisotropyTexture": {"index": 0}})
        self.assertEqual(got, [[1, 0]])
        self.assertIn("anisotropyStrength", result.text())
        self.assertIn("texture of anisotropy is not shown", result.text())
        self.assertNotIn("nowhere.png", result.text(), "what is not shown is not read either")

    def test_gltf_missing_image_is_marked(self):
        result = self.run_gltf({
            "nodes": [{"mesh": 0}], "images": [{"uri": "nowhere.png"}], "textures": [{"source": 0}],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "normalTexture": {"index": 0}}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}]})
        self.assertEqual(sorted(t["format"] for t in result.of(SET_TEXTURE)), [0, 1], "colour and data")
        self.assertEqual(result.data(result.of(SET_TEXTURE)[0]["arrays"][0])[:4], b"\xff\x00\xff\xff")
        self.assertTrue(any("nowhere.png" in text for _, _, text in result.notes), result.notes)

    def textured(self):
        """The text of a model with one image, which is HDR."""
        return json.dumps(gltf({
            "nodes": [{"mesh": 0}], "textures": [{"source": 0}],
            "images": [{"uri": "data:image/vnd.radiance;base64," + base64.b64encode(HDR).decode("ascii")}],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}]}))

    def test_gltf_images_are_found_however_their_name_is_spelt(self):
        for text in (self.textured(), self.textured().replace('"images"', '"im\\u0061ges"')):
            result = self.run_text("model.gltf", text)
            self.assertNotIn("image", result.text())
            texel, = set(result.data(result.of(SET_TEXTURE)[0]["arrays"][0])[:3])
            self.assertAlmostEqual(texel, 188, delta=1, msg="sRGB of 0.5")

    def test_without_its_module_the_importer_reads_models_but_no_images(self):
        alone = shutil.copy(IMPORTER, self.folder.name)
        with unittest.mock.patch.dict(globals(), IMPORTER=alone):
            plain = self.run_text("model.nff", "v\nfrom 0 0 5\nat 0 0 0\nup 0 1 0\nangle 45\nhither 1\nresolution 8 8\ns 0 0 0 1\n")
            self.assertNotIn("farlight-textures", plain.text())
            result = self.run_text("model.gltf", self.textured())
            self.assertIn("farlight-textures.so", result.text())
            self.assertEqual(result.data(result.of(SET_TEXTURE)[0]["arrays"][0])[:4], b"\xff\x00\xff\xff")

    def test_gltf_broken_references_are_named(self):
        mesh = [{"primitives": [{"attributes": {"POSITION": 0}}]}]
        for extra, expected in (
                ({"nodes": [{"children": [1]}, {"children": [0]}]}, "ancestor"),
                ({"nodes": [{"children": [2]}, {"children": [2]}, {}]}, "child of node 0 and of node 1"),
                ({"nodes": [{"mesh": 7}]}, "mesh 7"),
                ({"nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 9}}]}]}, "accessor 9"),
                ({"nodes": [{"mesh": 0}], "meshes": mesh, "extensionsRequired": ["ACME_x"]}, "ACME_x"),
                ({"nodes": [{"mesh": 0}], "meshes": mesh,
                  "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}]}, "exceed")):
            with self.subTest(expected):
                self.assertIn(expected, self.run_gltf(extra, status=1).text())

    def test_gltf_broken_positions_are_left_out(self):
        data = TRIANGLE + struct.pack("<9f", float("nan"), 0, 0, 1, 0, 0, 0, 1, 0)
        result = self.run_gltf(
            {"nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}]}, data=data,
            accessors=[{"bufferView": 0, "componentType": 5126, "count": 6, "type": "VEC3"}])
        self.assertEqual(result.of(SET_MESH)[0]["triangles"], 1)
        self.assertIn("NaN", result.text())

    def test_gltf_morph_targets_and_their_default_weights(self):
        data = TRIANGLE + struct.pack("<9f", 0, 0, 2, 0, 0, 2, 0, 0, 2)
        views = [{"buffer": 0, "byteOffset": at, "byteLength": 36} for at in (0, 36)]
        result = self.run_gltf(
            {"nodes": [{"mesh": 0}, {"mesh": 0, "weights": [1]}],
             "meshes": [{"weights": [0.5], "primitives": [{"attributes": {"POSITION": 0},
                                                            "targets": [{"POSITION": 1}]}]}]},
            data=data, views=views,
            accessors=[{"bufferView": i, "componentType": 5126, "count": 3, "type": "VEC3"} for i in (0, 1)])
        mesh, = result.of(SET_MESH)
        self.assertEqual((mesh["targets"], mesh["weights"]), (1, [0.5]))
        self.assertEqual(self.floats(result, mesh, 0)[2], 0, "as the file has it")
        self.assertEqual(self.floats(result, mesh, 9), [0, 0, 2] * 3)
        self.assertEqual([node["weights"] for node in result.of(SET_NODE)], [[], [1]])

    def test_obj_faces_and_materials(self):
        with open(os.path.join(self.folder.name, "m.mtl"), "w", encoding="utf-8") as file:
            file.write("newmtl red\nKd 1 0 0\nNs 10\nd 0.5\n\nnewmtl mirror\nKd 0 0 0\nKs 0.9 0.9 0.9\nNs 1000\nillum 3\n"
                       "aniso 0.5\nanisor 0.25\n"
                       "newmtl glass\nKd 0 0 0\nd 0.1\nNi 1.5\nillum 7\n")
        result = self.run_text("model.obj", "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0.25\n"
                               "usemtl red\nf 1/1 2/1 3/1 4/1\nusemtl mirror\nf -4 -3 -2\nusemtl glass\nf 1 2 4\n")
        mesh, = result.of(SET_MESH)
        red, mirror, glass = result.of(SET_MATERIAL)
        self.assertEqual([r[:2] for r in mesh["ranges"]], [(0, 2), (2, 1), (3, 1)])
        self.assertEqual((red["base"], red["alpha_mode"]), ((1, 0, 0, 0.5), 2))
        self.assertAlmostEqual(red["roughness"], (2 / 12) ** 0.5, 5)
        self.assertEqual((mirror["metallic"], mirror["roughness"]), (1, 0))
        self.assertEqual(mirror["anisotropy"][0], 0.5)
        self.assertAlmostEqual(mirror["anisotropy"][1], 1.5707963, 5, "a quarter of a turn")
        self.assertEqual(red["anisotropy"], [0, 0])
        self.assertAlmostEqual(glass["transmission"], 0.9, 6)
        self.assertEqual(glass["base"][:3], (1, 1, 1))
        self.assertEqual(self.floats(result, mesh, 4)[1], 0.75, "v runs downwards here")

    def test_obj_concave_polygon(self):
        result = self.run_text("model.obj", "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 1 2 3 4 5\n")
        mesh, = result.of(SET_MESH)
        positions, area = self.floats(result, mesh, 0), 0
        corners = self.integers(result, mesh)
        for t in range(0, len(corners), 3):
            (ax, ay), (bx, by), (cx, cy) = (positions[c * 3:c * 3 + 2] for c in corners[t:t + 3])
            one = ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)) / 2
            self.assertGreater(one, 0)
            area += one
        self.assertEqual(area, 10)

    def test_polygons_have_a_limit_of_corners(self):
        corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
        for count, status in ((65536, 0), (65537, 1)):
            face = "f" + " 1 2 3" * (count // 3) + " 1" * (count % 3)
            polygon = "f 1 1 1 0 0 0 1 1\np %d\n" % count + "0 0 0\n1 0 0\n0 1 0\n" * (count // 3) + "0 0 0\n" * (count % 3)
            for name, text in (("model.obj", corners + face + "\n"), ("model.nff", polygon)):
                with self.subTest(name=name, count=count):
                    result = self.run_text(name, text, status)
                    if status:
                        self.assertIn("65537 corners; 3 to 65536 are allowed", result.text())

    def test_obj_faults_name_their_line(self):
        for text, expected in (("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "line 4: vertex 4"),
                               ("v 0 0 0\nf -2 1 1\n", "line 2: vertex -2"), ("v 0 0 0\nv nan 0 0\n", "line 2: 'nan'"),
                               ("v 0 0 0\nf 1/2 1 1\n", "line 2: texture coordinate 2"), ("# nothing\n", "no faces")):
            with self.subTest(expected):
                self.assertIn(expected, self.run_text("model.obj", text, 1).text())

    NFF = ("# all of it\nb 0.1 0.2 0.3\nv\nfrom 0 0 5\nat 0 0 0\nup 0 1 0\nangle 40\nhither 1\nresolution 512 512\n"
           "l 0 0 5\nl 0 3 4 1 0.5 0\nf 1 0 0 0.5 0.5 3 0 0\ns 0 0 0 1\nf 1 1 1 0 0 0 0.9 1.5\ns 2 0 0 0.5\n"
           "f 1 0 0 0.5 0.5 3 0 0\ns 4 0 0 0.5\nc 0 0 0 1\n0 2 0 0.5\np 4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
           "pp 3\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 1 0\n")

    def test_nff_statements(self):
        result = self.run_text("model.nff", self.NFF)
        spheres, = result.of(SET_SPHERES)
        red, glass = result.of(SET_MATERIAL)
        self.assertEqual([r[:2] for r in spheres["ranges"]], [(0, 2), (2, 1)], "sorted by material")
        self.assertEqual((red["metallic"], red["base"][:3], red["roughness"]), (0.5, (1, 0, 0), 0))
        self.assertAlmostEqual(glass["transmission"], 0.9, 6)
        self.assertEqual(glass["ior"], 1.5)
        self.assertEqual(result.of(SET_MESH)[0]["triangles"], 64 + 2 + 1)
        self.assertAlmostEqual(result.of(SET_CAMERA)[0]["fov_y"], 0.6981317, 5)
        self.assertAlmostEqual(result.of(SET_LIGHT)[1]["colour"][0], 3.14159265 * 25, 3)
        for got, wanted in zip(result.of(SET_ENVIRONMENT)[0]["colour"], (0.1, 0.2, 0.3)):
            self.assertAlmostEqual(got, wanted, 6)
        camera = [node for node in result.of(SET_NODE) if node["kind"] == 4][0]
        self.assertEqual(camera["matrix"], (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 5))

    def test_nff_solids_are_closed(self):
        """Every edge of the triangles is met once in each direction, at equal places."""
        for word, triangles in (("tet", 4), ("hex", 12), ("oct", 8), ("dod", 36)):
            with self.subTest(word):
                result = self.run_text("model.nff", word + " 1 2 3 5\n")
                mesh, = result.of(SET_MESH)
                self.assertEqual(mesh["triangles"], triangles)
                positions, corners = self.floats(result, mesh, 0), self.integers(result, mesh)
                places = [tuple(round(x, 4) for x in positions[c * 3:c * 3 + 3]) for c in corners]
                edges = [(places[t + k], places[t + (k + 1) % 3]) for t in range(0, len(places), 3) for k in range(3)]
                self.assertEqual(len(set(edges)), len(edges))
                self.assertEqual(set(edges), {(b, a) for a, b in edges})

    def test_nff_faults_name_line_and_word(self):
        for text, expected in (("s 0 0 0\nx\n", "line 2: 'x'"), ("p 3\n0 0 0\n", "line 1: a polygon"),
                               ("f 1 0 0\nwhat 3\n", "line 2: 'what'"), ("s 0 0 0 nan\n", "'nan'"),
                               ("s 0 0 0 0\n", "radius 0"), ("p 1e9\n", "polygon")):
            with self.subTest(expected):
                self.assertIn(expected, self.run_text("model.nff", text, 1).text())

    def test_many_materials_make_several_sets(self):
        lines = ["f %g 0 0\ns %d 0 0 0.25\n" % (i / 5000, i) for i in range(5000)]
        result = self.run_text("model.nff", "".join(lines))
        self.assertEqual([one["count"] for one in result.of(SET_SPHERES)], [4096, 904])


if __name__ == "__main__":
    unittest.main(verbosity=2)
