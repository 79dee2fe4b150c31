#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""farlight-import and the extensions of glTF that change what a file's bytes are, or what of it is shown.

Properties verified:
  - an extension that is required and unknown is named with a remedy, whatever else the file lacks without it; others that are only
    used are listed in one note;
  - meshes that Draco or meshoptimizer has packed are those that were packed: every mode, filter and version;
  - packed bytes that are cut off, or whose counts lie, are refused with the place in the file, at once and within little memory;
  - instances share one mesh; variants choose materials by name; visibility and pointers reach nodes, lights and materials;
  - specular and glossiness become a mirror of that strength over a body, or metallic and roughness that reflect as much.

The encoders here write what the formats allow at its plainest. The cube that Draco's own encoder has packed is kept as it is.
"""
import base64
import json
import os
import struct
import unittest
import zlib

import importer
from farlight_test import LONG, SHARED_SCENES, farlight, needs_shared_scenes
from importer import SET_CHANNEL, SET_ENVIRONMENT, SET_LIGHT, SET_MATERIAL, SET_MESH, SET_NODE, SET_TEXTURE, Peer, import_files

MEMORY = 1 << 30  # bytes of addresses, of which libraries take a third
FLOAT, U8, I8, U16, I16, U32 = 5126, 5121, 5120, 5123, 5122, 5125
CUBE = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
QUADS = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6))
CORNERS = [corner for a, b, c, d in QUADS for corner in (a, b, c, a, c, d)]
# draco_encoder -qp 11 -cl 7: edgebreaker, of positions alone.
DRACO_CUBE = base64.b64decode("RFJBQ08CAgEBAAAACAwACwAAA2+rFAEBEAH/AAABAAkDAAACAQEBAAMDATABEAMAmJYUGAAEAAAAAP8HAAAAAAAAAAAAAAAAAAAAAIA/Cw==")
# Red and green above blue and white, lossless.
WEBP = base64.b64decode("UklGRiwAAABXRUJQVlA4TB8AAAAvAUAAAB8gEEjeHzqN+RcQFPwf3fxHZA/gBgwR/Q8BAA==")


def varint(value):
    out = b""
    while value >= 128:
        out += bytes([value % 128 + 128])
        value //= 128
    return out + bytes([value])


def zigzag(value, bits):
    value %= 1 << bits
    return (value << 1 ^ (-1 if value >> bits - 1 else 0)) % (1 << bits)


# ---- Draco: sequential, nothing compressed

def draco(positions, corners, faces=None, points=None, attributes=1, components=3):
    faces, points = faces if faces is not None else len(corners) // 3, points if points is not None else len(positions)
    out = b"DRACO" + bytes([2, 2, 1, 0]) + struct.pack("<H", 0) + varint(faces) + varint(points) + bytes([1])
    out += bytes(corners) + bytes([1]) + varint(attributes)
    for number in range(attributes):
        out += bytes([0, 9, components, 0]) + varint(number)  # positions of 32-bit floats
    out += bytes(attributes)
    return out + b"".join(struct.pack("<3f", *position) for position in positions)


# ---- meshoptimizer

def attributes_0(data, stride):
    """Version 0 with all deltas as bytes."""
    return pack_attributes(data, stride, 0xa0, lambda groups: bytes([255] * ((groups + 3) // 4)), 32, b"", b"")


def attributes_1(data, stride, mode=0):
    """Version 1 with all deltas as literals. Channel mode 0: bytes, 1: pairs, 2 + 16 r: words, rotated."""
    modes = bytes([mode] * (stride // 4))
    return pack_attributes(data, stride, 0xa1, None, 24, bytes([255] * (stride // 4)), modes)


def delta(value, last, mode):
    if mode % 16 == 2:
        turn, difference = mode // 16, value ^ last
        return (difference >> turn | difference << (32 - turn)) % (1 << 32)
    bits = 16 if mode else 8
    parts = [(value >> shift) - (last >> shift) for shift in range(0, 32, bits)]
    return sum(zigzag(part, bits) << place * bits for place, part in enumerate(parts))


def pack_attributes(data, stride, version, header, tail, control, modes):
    count, block_max = len(data) // stride, min(8192 // stride // 16 * 16, 256)
    last, out = bytearray(data[:stride]), bytes([version])
    for first in range(0, count, block_max):
        elements = [data[at * stride:at * stride + stride] for at in range(first, min(first + block_max, count))]
        planes = [b""] * stride
        for element in elements:
            for channel in range(0, stride, 4):
                value, before = (int.from_bytes(one[channel:channel + 4], "little") for one in (element, last))
                packed = delta(value, before, modes[channel // 4] if modes else 0)
                for k in range(4):
                    planes[channel + k] += bytes([packed >> 8 * k & 255])
            last = element
        groups = (len(elements) + 15) // 16
        out += control
        for plane in planes:
            out += (header(groups) + plane + bytes(groups * 16 - len(elements))) if header else plane
    end = data[:stride] + modes
    return out + bytes(max(0, tail - len(end))) + end


def index_bytes(values, code):
    out, last = b"", 0
    for value in values:
        out += varint(code(zigzag(value - last, 32)))
        last = value
    return out


def triangles(corners):
    """Every triangle by the code that says all three of its corners."""
    data = b""
    last = 0
    for at in range(0, len(corners), 3):
        data += b"\xff"
        for corner in corners[at:at + 3]:
            data += varint(zigzag(corner - last, 32))
            last = corner
    return b"\xe1" + b"\xff" * (len(corners) // 3) + data + bytes(16)


def indices(corners):
    """Deltas from the first of two baselines, whose number is the lowest bit."""
    return b"\xd1" + index_bytes(corners, lambda value: value << 1) + bytes(4)


class Model:
    """A file of one mesh, put together piece by piece."""

    def __init__(self):
        self.data = b""
        self.json = {"asset": {"version": "2.0"}, "bufferViews": [], "accessors": [], "scenes": [{"nodes": [0]}],
                     "nodes": [{"mesh": 0, "name": "cube"}], "meshes": [{"primitives": [{"attributes": {}}]}]}
        self.primitive = self.json["meshes"][0]["primitives"][0]

    def view(self, data, **more):
        self.data += bytes(-len(self.data) % 4)
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **more})
        self.data += data
        return len(self.json["bufferViews"]) - 1

    def accessor(self, view, kind, component, count, **more):
        place = {} if view is None else {"bufferView": view}
        self.json["accessors"].append({**place, "type": kind, "componentType": component, "count": count, **more})
        return len(self.json["accessors"]) - 1

    def floats(self, kind, values):
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[kind]
        flat = [number for value in values for number in (value if width > 1 else (value,))]
        return self.accessor(self.view(struct.pack("<%df" % len(flat), *flat)), kind, FLOAT, len(values))

    def cube(self):
        self.primitive["attributes"]["POSITION"] = self.floats("VEC3", CUBE)
        self.primitive["indices"] = self.accessor(self.view(bytes(CORNERS)), "SCALAR", U8, 36)
        return self

    def draco(self, data, points=8, corners=36, attributes=None):
        self.primitive["attributes"]["POSITION"] = self.accessor(None, "VEC3", FLOAT, points)
        self.primitive["indices"] = self.accessor(None, "SCALAR", U16, corners)
        self.primitive["extensions"] = {"KHR_draco_mesh_compression": {
            "bufferView": self.view(data), "attributes": attributes or {"POSITION": 0}}}
        return self.requires("KHR_draco_mesh_compression")

    def packed(self, data, count, stride, mode, kind="KHR", **more):
        """A view whose own bytes are in no file."""
        self.data += bytes(-len(self.data) % 4)
        name = kind + "_meshopt_compression"
        packed = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), "byteStride": stride, "count": count,
                  "mode": mode, **more}
        self.data += data
        self.json["bufferViews"].append({"buffer": 1, "byteLength": count * stride, "extensions": {name: packed}})
        if mode == "ATTRIBUTES":
            self.json["bufferViews"][-1]["byteStride"] = stride
        self.requires(name)
        return len(self.json["bufferViews"]) - 1

    def requires(self, name):
        for key in ("extensionsUsed", "extensionsRequired"):
            if name not in self.json.setdefault(key, []):
                self.json[key].append(name)
        return self

    def binary(self):
        data = self.data + bytes(-len(self.data) % 4)
        text = json.dumps({**self.json, "buffers": [{"byteLength": len(data)}]}).encode("ascii")
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<II", len(text), 0x4e4f534a) + text + struct.pack("<II", len(data), 0x004e4942) + data
        return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks

    def text(self):
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode("ascii")
        buffers = [{"uri": uri, "byteLength": len(self.data)}]
        if any(view["buffer"] == 1 for view in self.json["bufferViews"]):
            buffers.append({"byteLength": 1 << 20, "extensions": {"KHR_meshopt_compression": {"fallback": True}}})
        return json.dumps({**self.json, "buffers": buffers})


class Gltf(importer.Written):
    def run_model(self, model, status=0, **options):
        text = json.dumps(model) if isinstance(model, dict) else model.text()
        return self.import_text("model.gltf", text, status, **options)

    def shape(self, result):
        """The mesh's triangles as positions, however its vertices are numbered."""
        mesh, = result.of(SET_MESH)
        numbers = result.floats(mesh["arrays"][0])
        points = [tuple(round(number, 4) for number in numbers[at:at + 3]) for at in range(0, len(numbers), 3)]
        corners = [points[index] for index in result.integers(mesh["arrays"][1])]
        faces = [tuple(corners[at:at + 3]) for at in range(0, len(corners), 3)]
        return sorted(min(face[k:] + face[:k] for k in range(3)) for face in faces)

    def cube_shape(self):
        return self.shape(self.run_model(Model().cube()))

    def assert_refused(self, models, words):
        paths = []
        for number, model in enumerate(models):
            paths.append(str(self.write("hostile_%d.gltf" % number, model.text())))
        for (path, result) in import_files(paths, memory=MEMORY):
            with self.subTest(path):
                self.assertEqual((result.status, result.faults, result.stderr), (1, [], ""), result.text())
                self.assertRegex(result.errors()[0][2], words)
                self.assertIn("[", result.errors()[0][1], "it says where")
                self.assertLess(result.seconds, 2)


class Extensions(Gltf):
    def test_extensions_that_are_not_read_are_named(self):
        """With a remedy where one is required, whatever else the file lacks without it; others in one note."""
        model = Model().cube().requires("ACME_squeeze")
        del model.json["accessors"][model.primitive["indices"]]["bufferView"]  # which the parser refuses
        for made, words in ((model, "without the extension 'ACME_squeeze', which is not supported; export the model without it"),
                            (Model().cube().requires("KHR_texture_basisu"), "KHR_texture_basisu.*PNG.*ktxdecompress")):
            error, = self.run_model(made, status=1).errors()
            self.assertRegex(error[2], words)
        model = Model().cube()
        model.json["extensionsUsed"] = ["ACME_b", "KHR_mesh_quantization", "ACME_a"]
        note, = (text for _, where, text in self.run_model(model).notes if "extensionsUsed" in where)
        self.assertRegex(note, "not supported: ACME_a, ACME_b$")

    def test_a_model_with_cameras_alone_is_refused_as_it_shows_nothing(self):
        model = {"asset": {"version": "2.0"}, "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}],
                 "nodes": [{"camera": 0}], "scenes": [{"nodes": [0]}], "scene": 0}
        self.assertIn("it contains nothing that can be shown", self.run_model(model, status=1).text())

    @needs_shared_scenes
    def test_files_of_other_programs_are_imported_but_for_basisu(self):
        paths = [os.path.join(folder, name) for folder, _, names in os.walk(os.path.join(SHARED_SCENES, "formats"))
                 for name in sorted(names) if name.endswith((".glb", ".gltf"))][::1 if LONG else 6]
        for path, result in import_files(paths):
            with self.subTest(path):
                refused = any("KHR_texture_basisu" in text for _, _, text in result.errors())
                with open(path, "rb") as file:
                    self.assertEqual(refused, b"KHR_texture_basisu" in file.read())
                self.assertEqual((result.status, result.faults), (int(refused), []), result.text())
                self.assertEqual([] if refused else importer.inconsistencies(result), [])
                self.assertEqual(refused, not result.of(SET_MESH))
        self.assertGreater(len(paths), 0)


class Draco(Gltf):
    def test_a_packed_mesh_is_the_one_that_was_packed(self):
        whole = self.cube_shape()
        for name, data in (("sequential", draco(CUBE, CORNERS)), ("edgebreaker", DRACO_CUBE)):
            with self.subTest(name):
                result = self.run_model(Model().draco(data))
                mesh, = result.of(SET_MESH)
                self.assertEqual((mesh["vertices"], mesh["triangles"], mesh["closed"]), (8, 12, 1))
                # Of 11 bits: half a step is 0.0003.
                self.assertEqual(self.shape(result), whole)

    def test_a_binary_file_may_have_it_too(self):
        result = self.import_text("cube.glb", Model().draco(DRACO_CUBE).binary())
        self.assertEqual(self.shape(result), self.cube_shape())

    def test_bytes_that_are_cut_off_are_refused(self):
        for data in (draco(CUBE, CORNERS), DRACO_CUBE):
            self.assert_refused([Model().draco(data[:cut]) for cut in (1, 4, 9, 11, 13, 20, len(data) // 2, len(data) - 5)],
                                "Draco")

    def test_counts_that_lie_are_refused_before_memory_is_spent(self):
        many = 1 << 27
        self.assert_refused([Model().draco(draco(CUBE, CORNERS, faces=many)), Model().draco(draco(CUBE, CORNERS, points=many)),
                             Model().draco(draco(CUBE, CORNERS, faces=many), corners=3 * many, points=many),
                             Model().draco(draco(CUBE, CORNERS), points=9), Model().draco(draco(CUBE, CORNERS), corners=39),
                             Model().draco(draco(CUBE, CORNERS), corners=3 * (1 << 40)),
                             Model().draco(draco(CUBE, CORNERS, components=200)),
                             Model().draco(draco(CUBE, CORNERS, attributes=1000)),
                             Model().draco(DRACO_CUBE, points=7), Model().draco(DRACO_CUBE, corners=33)],
                            "where the accessors have|at most .* allowed|are not allowed")

    def test_what_the_extension_names_must_be_there(self):
        without = Model().draco(DRACO_CUBE)
        del without.primitive["extensions"]["KHR_draco_mesh_compression"]["attributes"]
        beyond = Model().draco(DRACO_CUBE)
        beyond.primitive["extensions"]["KHR_draco_mesh_compression"]["bufferView"] = 9
        self.assert_refused([without, beyond, Model().draco(DRACO_CUBE, attributes={"POSITION": 5}),
                             Model().draco(DRACO_CUBE, attributes={"NORMAL": 0}),
                             Model().draco(DRACO_CUBE, attributes={"POSITION": -1}),
                             Model().draco(draco(CUBE, CORNERS[:-1] + [200]))],
                            "names no attributes|does not exist|no attribute|beyond the 8 vertices|cannot be decoded")


class Meshopt(Gltf):
    POSITIONS = b"".join(struct.pack("<3f", *position) for position in CUBE)

    def cube(self, positions, faces, mode="TRIANGLES", stride=2, kind="KHR", **more):
        model = Model()
        model.primitive["attributes"]["POSITION"] = model.accessor(
            model.packed(positions, 8, 12, "ATTRIBUTES", kind, **more), "VEC3", FLOAT, 8)
        model.primitive["indices"] = model.accessor(
            model.packed(faces, 36, stride, mode, kind), "SCALAR", U16 if stride == 2 else U32, 36)
        return model

    def test_every_mode_and_version_gives_the_mesh_that_was_packed(self):
        whole = self.cube_shape()
        for positions in (attributes_0(self.POSITIONS, 12), *(attributes_1(self.POSITIONS, 12, mode) for mode in (0, 1, 2, 0x52))):
            for faces, mode in ((triangles(CORNERS), "TRIANGLES"), (indices(CORNERS), "INDICES")):
                for stride in (2, 4):
                    with self.subTest((positions[0], mode, stride)):
                        kind = "EXT" if positions[0] == 0xa0 else "KHR"
                        self.assertEqual(self.shape(self.run_model(self.cube(positions, faces, mode, stride, kind))), whole)

    def test_sentinels_and_blocks_of_version_1(self):
        """A byte that changes with every third of 600 elements and others: planes without data, single bits, literals; three blocks."""
        data = b"".join(struct.pack("<BBH", i // 3 % 256, 7, i * 40) for i in range(600))
        out, last = b"\xa1", bytearray(data[:4])
        for first in range(0, 600, 256):
            block = data[first * 4:first * 4 + 1024]
            deltas = [bytes(zigzag(block[at + k] - (block[at + k - 4] if at else last[k]), 8) for at in range(0, len(block), 4))
                      for k in range(4)]
            last = block[-4:]
            groups = (len(deltas[0]) + 15) // 16
            padded = deltas[0] + bytes(groups * 16 - len(deltas[0]))
            plane = bytes((groups + 3) // 4)  # control mode 1, bit lengths 1
            for at in range(0, len(padded), 16):
                bits = [int(value > 0) for value in padded[at:at + 16]]
                plane += bytes(sum(bit << k for k, bit in enumerate(bits[half:half + 8])) for half in (0, 8))
                plane += bytes(value for value in padded[at:at + 16] if value > 0)
            out += bytes([1 | 2 << 2 | 3 << 4 | 3 << 6]) + plane + deltas[2] + deltas[3]
        out += bytes(24 - 5) + data[:4] + b"\0"
        model = Model().cube()
        model.primitive["attributes"] = {"POSITION": model.floats("VEC3", [CUBE[i % 8] for i in range(600)]),
                                         "COLOR_0": model.accessor(model.packed(out, 600, 4, "ATTRIBUTES"), "VEC4", U8, 600,
                                                                   normalized=True)}
        result = self.run_model(model)
        mesh, = result.of(SET_MESH)
        self.assertEqual(result.data(mesh["arrays"][6]), data)

    def test_exponential_octahedral_and_colour_filters(self):
        exponents = b"".join(struct.pack("<I", (-1 & 255) << 24 | (2 * number) % (1 << 24)) for position in CUBE for number in position)
        model = self.cube(attributes_0(exponents, 12), triangles(CORNERS), filter="EXPONENTIAL")
        up = b"".join(struct.pack("<4b", 0, 0, 127, 0) for _ in CUBE)  # x, y, what one is
        model.primitive["attributes"]["NORMAL"] = model.accessor(
            model.packed(attributes_0(up, 4), 8, 4, "ATTRIBUTES", filter="OCTAHEDRAL"), "VEC3", I8, 8, normalized=True)
        # Y, Co, Cg of 8 bits, alpha of 7 with a 1 before it: orange, opaque.
        red, green, blue = 255, 128, 0
        chroma = (red - blue) // 2, (2 * green - red - blue) // 4
        luma = green - chroma[1]
        packed = struct.pack("<BbbB", luma, chroma[0] - 256 if chroma[0] > 127 else chroma[0], chroma[1], 255) * 8
        model.primitive["attributes"]["COLOR_0"] = model.accessor(
            model.packed(attributes_1(packed, 4), 8, 4, "ATTRIBUTES", filter="COLOR"), "VEC4", U8, 8, normalized=True)
        result = self.run_model(model)
        self.assertEqual(self.shape(result), self.cube_shape())
        mesh, = result.of(SET_MESH)
        self.assertEqual(result.floats(mesh["arrays"][2]), [0, 0, 1] * 8)
        for value, wanted in zip(result.data(mesh["arrays"][6]), (red, green, blue, 255)):
            self.assertAlmostEqual(value, wanted, delta=2)  # the integer transform loses a bit

    def test_quaternions_turn_instances(self):
        """Half a turn about y: the maximum component is w or, here, y; the other three are stored."""
        turn = struct.pack("<4h", 0, 0, 0, 2047 & ~3 | 1)  # y is left out and is 1
        model = Model().cube()
        view = model.packed(attributes_0(turn * 2, 8), 2, 8, "ATTRIBUTES", filter="QUATERNION")
        model.json["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {
            "ROTATION": model.accessor(view, "VEC4", I16, 2, normalized=True)}}}
        shown = [node for node in self.run_model(model).of(SET_NODE) if node["kind"] == 1]
        for node in shown:
            for value, wanted in zip(node["matrix"], (-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0)):
                self.assertAlmostEqual(value, wanted, delta=1e-4)
        self.assertEqual(len(shown), 2)

    def test_bytes_that_are_cut_off_or_too_many_are_refused(self):
        faces, bad = triangles(CORNERS), []
        for positions in (attributes_0(self.POSITIONS, 12), attributes_1(self.POSITIONS, 12)):
            for cut in (0, 1, 20, len(positions) // 2, len(positions) - 1):
                bad.append(self.cube(positions[:cut], faces))
            bad.append(self.cube(positions[:1] + b"\0" + positions[1:], faces))
        for packed, mode in ((faces, "TRIANGLES"), (indices(CORNERS), "INDICES")):
            for cut in (0, 1, 13, len(packed) - 1):
                bad.append(self.cube(attributes_0(self.POSITIONS, 12), packed[:cut], mode))
        self.assert_refused(bad, "compressed bytes")

    def test_counts_strides_and_names_that_lie_are_refused(self):
        def changed(view, parent=None, **changes):
            model = self.cube(attributes_1(self.POSITIONS, 12), triangles(CORNERS))
            model.json["bufferViews"][view]["extensions"]["KHR_meshopt_compression"].update(changes)
            model.json["bufferViews"][view].update(parent or {})
            return model

        huge = 1 << 31
        self.assert_refused(
            [changed(0, count=9), changed(0, count=huge), changed(0, {"byteLength": huge * 12}, count=huge),
             changed(1, {"byteLength": huge * 6}, count=3 * huge), changed(0, byteStride=6, count=16), changed(0, byteStride=0),
             changed(0, byteOffset=huge), changed(0, byteOffset=-1), changed(0, buffer=7), changed(0, mode="TRIANGLES"),
             changed(0, mode="NOISE"), changed(0, filter="SHARPEN"), changed(0, filter="QUATERNION"), changed(1, filter="COLOR"),
             changed(1, mode="ATTRIBUTES"), changed(1, count=35, byteStride=2)],
            "compressed|exceed|does not exist|allowed|unknown")

    def test_indices_beyond_the_vertices_are_refused(self):
        wrong = CORNERS[:-1] + [8]
        self.assert_refused([self.cube(attributes_0(self.POSITIONS, 12), triangles(wrong)),
                             self.cube(attributes_0(self.POSITIONS, 12), indices(wrong), "INDICES")],
                            r"index 8 \(number 35\) is beyond the 8 vertices")


class Instances(Gltf):
    def instanced(self, **attributes):
        model = Model().cube()
        kinds = {"TRANSLATION": "VEC3", "ROTATION": "VEC4", "SCALE": "VEC3"}
        model.json["nodes"][0]["translation"] = [0, 0, 5]
        model.json["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {
            name: model.floats(kinds[name], values) for name, values in attributes.items()}}}
        return model

    def test_instances_share_one_mesh_below_their_node(self):
        result = self.run_model(self.instanced(TRANSLATION=[(1, 0, 0), (2, 0, 0), (3, 0, 0)], SCALE=[(1, 1, 1), (2, 2, 2), (3, 3, 3)]))
        group, *shown = result.of(SET_NODE)
        self.assertEqual((group["kind"], group["matrix"][11]), (0, 5))
        self.assertEqual([node["matrix"] for node in shown],
                         [(k, 0, 0, k, 0, k, 0, 0, 0, 0, k, 0) for k in (1, 2, 3)])
        self.assertEqual({(node["parent"], node["object"]) for node in shown}, {(group["id"], result.of(SET_MESH)[0]["id"])})

    def test_attributes_of_different_counts_or_without_end_are_refused(self):
        endless = self.instanced(TRANSLATION=[(0, 0, 0)])
        attributes = endless.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]
        attributes["TRANSLATION"] = endless.accessor(None, "VEC3", FLOAT, 1 << 24)  # zeros take no bytes
        self.assert_refused([self.instanced(TRANSLATION=[(0, 0, 0)], SCALE=[(1, 1, 1)] * 2), endless,
                             self.instanced(TRANSLATION=[(0, 0, float("inf"))])],
                            "where another attribute has 1|more than 1048576 instances|not finite")


class Sky(Gltf):
    def lit(self, *nodes, lights=({"type": "point", "intensity": 30},), **more):
        """A cube from the origin to 1, 1, 1, lights, and further nodes."""
        model = Model().cube()
        model.json["extensionsUsed"] = ["KHR_lights_punctual"]
        model.json["extensions"] = {"KHR_lights_punctual": {"lights": list(lights)}}
        model.json["nodes"] += [{"translation": [3, 5, 4], "extensions": {"KHR_lights_punctual": {"light": i}}} for i in range(len(lights))]
        model.json["nodes"] += nodes
        model.json["scenes"][0]["nodes"] = list(range(len(model.json["nodes"])))
        model.json.update(more)
        return model

    def test_lights_have_a_sky_beside_them_but_not_in_a_room(self):
        """As scenes without any light have one of the daemon's."""
        cameras = [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}]
        for at, sky in (([9, 1, 9], 1), ([0.5, 0.4, 0.45], 0)):
            with self.subTest(at):
                camera = {"camera": 0, "translation": at}
                environments = self.run_model(self.lit(camera, cameras=cameras)).of(SET_ENVIRONMENT)
                self.assertEqual(len(environments), sky)
        self.assertEqual(len(self.run_model(self.lit()).of(SET_ENVIRONMENT)), 1)
        self.assertEqual(importer.import_file(str(self.write("lit.gltf", self.lit().text())), "--no-sky").of(SET_ENVIRONMENT), [])
        self.assertEqual(self.run_model(Model().cube()).of(SET_ENVIRONMENT), [])


class Shown(Gltf):
    def test_a_variant_chooses_materials_by_its_name(self):
        """By the importer, and as an option of the commands."""
        model = Model().cube()
        model.json["materials"] = [{"name": name} for name in ("plain", "red", "blue")]
        model.json["extensions"] = {"KHR_materials_variants": {"variants": [{"name": "Red one"}, {"name": "Blue"}, {"name": "-"}]}}
        model.primitive.update(material=0, extensions={"KHR_materials_variants": {"mappings": [
            {"material": 1, "variants": [0]}, {"material": 2, "variants": [1]}]}})
        path = str(self.write("model.gltf", model.text()))
        for name, material in ((None, "plain"), ("Red one", "red"), ("Blue", "blue"), ("-", "plain")):
            with self.subTest(name):
                chosen = [f"--variant={name}"] if name else []
                result = Peer().run([*chosen, path])
                self.assertEqual(result.status, 0, result.text())
                self.assertEqual([one["name"] for one in result.of(SET_MATERIAL)], [material])
                info = json.loads(self.expect(farlight("info", "--json", *chosen, path), 0).stdout)
                self.assertEqual((info["variants"], info["material_list"][0]["name"]), (result.variants, material))
        self.assertEqual(result.variants, ["Red one", "Blue", "-"])
        error, = Peer().run(["--variant", "Green", path]).errors()
        self.assertEqual(error[2], "the model has no variant 'Green'; it has 'Red one', 'Blue', '-'")

    def test_a_variant_of_a_model_without_variants_is_refused(self):
        for name, text in (("model.gltf", Model().cube().text()), ("model.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")):
            error, = Peer().run(["--variant", "Red", str(self.write(name, text))]).errors()
            self.assertRegex(error[2], "none can be called 'Red'")

    def test_nodes_that_are_not_visible_are_hidden(self):
        model = Model().cube()
        model.json["nodes"][0]["extensions"] = {"KHR_node_visibility": {"visible": False}}
        model.json["nodes"].append({"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": True}}})
        model.json["scenes"][0]["nodes"].append(1)
        self.assertEqual([node["hidden"] for node in self.run_model(model).of(SET_NODE)], [1, 0])

    def test_pointers_animate_nodes_materials_and_lights(self):
        model = Model().cube()
        model.primitive["material"] = 0
        model.json["materials"] = [{"emissiveFactor": [1, 0.5, 0],
                                    "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}}}]
        model.json["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 10, "color": [1, 0.5, 0]}]}}
        model.json["nodes"] += [{"name": "a", "extensions": {"KHR_lights_punctual": {"light": 0}}}] * 2
        model.json["scenes"][0]["nodes"] += [1, 2]
        flags = model.accessor(model.view(bytes([1, 0])), "SCALAR", U8, 2)
        times, numbers = model.floats("SCALAR", [0, 1]), model.floats("SCALAR", [2, 6])
        colours = model.floats("VEC3", [(1, 1, 1), (0.25, 0.5, 0.75)])
        channels = (("/nodes/0/extensions/KHR_node_visibility/visible", flags, "STEP"), ("/nodes/0/translation", colours, "LINEAR"),
                    ("/materials/0/emissiveFactor", colours, "LINEAR"),
                    ("/extensions/KHR_lights_punctual/lights/0/intensity", numbers, "LINEAR"),
                    ("/materials/0/pbrMetallicRoughness/roughnessFactor", numbers, "LINEAR"),
                    ("/materials/0/normalTexture/scale", numbers, "LINEAR"))
        model.json["animations"] = [{
            "samplers": [{"input": times, "output": output, "interpolation": kind} for _, output, kind in channels],
            "channels": [{"sampler": i, "target": {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": path}}}}
                         for i, (path, _, _) in enumerate(channels)]}]
        path = str(self.write("model.gltf", model.requires("KHR_animation_pointer").text()))
        result = Peer().run([path])
        self.assertEqual(result.status, 0, result.text())
        floats = result.floats(result.of(importer.SET_CLIP)[0]["arrays"][0])
        found = {(c["path"], c["object"]): floats[c["first_value"]:c["first_value"] + c["keys"] * c["width"]]
                 for c in result.of(SET_CHANNEL)}
        cube, light_ids = result.of(SET_NODE)[0]["id"], [light["id"] for light in result.of(SET_LIGHT)]
        material = result.of(SET_MATERIAL)[0]["id"]
        self.assertEqual(found[importer.HIDDEN, cube], [0, 1])
        self.assertEqual(found[importer.TRANSLATION, cube], [1, 1, 1, 0.25, 0.5, 0.75])
        self.assertEqual(found[33, material], [4, 4, 4, 1, 2, 3])
        self.assertEqual(found[35, material], [2, 6])
        self.assertEqual(len(light_ids), 2, "each of the two nodes has one")
        for light in light_ids:
            self.assertEqual(found[16, light], [2, 1, 0, 6, 3, 0])
        self.assertIn("'/materials/0/normalTexture/scale', a property that cannot be animated here", result.text())


class Materials(Gltf):
    def gloss(self, images=(), **old):
        model = Model().cube()
        model.primitive["material"] = 0
        model.json["materials"] = [{"extensions": {"KHR_materials_pbrSpecularGlossiness": old},
                                    "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]}}]
        model.json["images"] = [{"bufferView": model.view(image), "mimeType": "image/webp"} for image in images]
        model.json["textures"] = [{"extensions": {"EXT_texture_webp": {"source": i}}} for i in range(len(images))]
        return self.run_model(model)

    def test_specular_and_glossiness_become_what_reflects_as_much(self):
        for name, diffuse, specular, base, metallic in (
                ("plastic", (0.5, 0.25, 0.125), (0.04,) * 3, (0.5, 0.25, 0.125), 0),
                ("gold", (0, 0, 0), (1, 0.71, 0.29), (1, 0.71, 0.29), 1)):
            with self.subTest(name):
                material, = self.gloss(diffuseFactor=[*diffuse, 0.5], specularFactor=specular, glossinessFactor=0.75).of(SET_MATERIAL)
                for value, wanted in zip(material["base"], (*base, 0.5)):
                    self.assertAlmostEqual(value, wanted, delta=1e-5)
                self.assertAlmostEqual(material["metallic"], metallic, delta=1e-5)
                self.assertAlmostEqual(material["roughness"], 0.25, delta=1e-5)

    def test_a_dielectric_keeps_its_specular_colour(self):
        """Its mirror is given beside 0.04, and its body is what the strongest channel of the mirror leaves."""
        material, = self.gloss(diffuseFactor=[0.5, 0.5, 0.25, 1], specularFactor=[0.2, 0.1, 0.04]).of(SET_MATERIAL)
        for value, wanted in zip(material["specular"], (1, 5, 2.5, 1)):
            self.assertAlmostEqual(value, wanted, delta=1e-5)
        for value, wanted in zip(material["base"], (0.5, 0.5 * 0.8 / 0.9, 0.25 * 0.8 / 0.96, 1)):
            self.assertAlmostEqual(value, wanted, delta=1e-5)
        self.assertEqual(material["metallic"], 0)

    def test_its_textures_are_converted_texel_by_texel(self):
        """The red, green, blue and white texels as diffuse colours of a plastic."""
        result = self.gloss([WEBP], diffuseTexture={"index": 0}, specularFactor=[0.04] * 3, glossinessFactor=0.6)
        material, = result.of(SET_MATERIAL)
        textures = {one["id"]: one for one in result.of(SET_TEXTURE)}
        base, rough, mirror = (textures[material["textures"][at]["texture"]] for at in (0, 2, 8))
        self.assertEqual((base["format"], rough["format"], mirror["format"], len(textures)), (0, 1, 0, 3))
        self.assertEqual(result.data(base["arrays"][0]), bytes([255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 255]))
        self.assertEqual(result.data(rough["arrays"][0]), bytes([255, 102, 0, 255]) * 4)
        self.assertEqual(result.data(mirror["arrays"][0]), bytes([56, 56, 56, 255]) * 4, "0.04")
        self.assertEqual((material["base"], material["metallic"], material["roughness"]), ((1, 1, 1, 1), 1, 1))
        self.assertEqual(material["specular"], (1, 25, 25, 25), "of 0.04, which the texture has whole")

    def texels(self, mime, **image):
        """Of the base colour of a material, in a binary file."""
        model = Model().cube()
        model.primitive["material"] = 0
        if "data" in image:
            image = {"bufferView": model.view(image["data"]), "mimeType": mime}
        model.json.update(materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}], textures=[{"source": 0}],
                          images=[image])
        result = self.import_text("model.glb", model.binary())
        texture, = result.of(SET_TEXTURE)
        return result.data(texture["arrays"][0]), result.text()

    def test_a_texture_uses_the_coordinates_that_the_material_says(self):
        """One of two sets, that of the transform before that of the texture; a third one is told and is the first."""
        model = Model().cube()
        model.primitive["material"] = 0
        for number in (0, 1):
            model.primitive["attributes"][f"TEXCOORD_{number}"] = model.floats("VEC2", [(number, 0.25)] * 8)
        model.json.update(textures=[{"source": 0}], images=[{"bufferView": model.view(WEBP), "mimeType": "image/webp"}],
                          materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 1}},
                                      "occlusionTexture": {"index": 0, "texCoord": 2},
                                      "emissiveTexture": {"index": 0, "extensions": {"KHR_texture_transform": {"texCoord": 1}}}}])
        result = self.import_text("model.glb", model.binary())
        (material,), (mesh,) = result.of(SET_MATERIAL), result.of(SET_MESH)
        self.assertEqual([material["textures"][at]["texcoord"] for at in (0, 3, 4)], [1, 0, 1])
        self.assertEqual([result.floats(mesh["arrays"][at]) for at in (4, 5)], [[0, 0.25] * 8, [1, 0.25] * 8])
        self.assertIn("texture coordinate set 2 is not read", result.text())

    def test_every_kind_of_png_becomes_four_bytes_a_texel(self):
        """Two texels. 16 bits are rounded: 0x0180 is 1.494 of 255, 0x0182 is 1.502."""
        for name, kind, depth, row, more, wanted in (
                ("grey of one bit", 0, 1, b"\x40", {}, [0, 0, 0, 255, 255, 255, 255, 255]),
                ("grey of 16 bits with alpha", 4, 16, bytes.fromhex("0180ffff01820000"), {}, [1, 1, 1, 255, 2, 2, 2, 0]),
                ("a palette with alpha", 3, 2, b"\x40", {b"PLTE": b"\1\2\3\4\5\6", b"tRNS": b"\x80"}, [4, 5, 6, 255, 1, 2, 3, 128]),
                ("colours of which one is clear", 2, 8, b"\1\2\3\4\5\6", {b"tRNS": b"\0\4\0\5\0\6"}, [1, 2, 3, 255, 4, 5, 6, 0])):
            with self.subTest(name):
                chunks = [(b"IHDR", struct.pack(">IIBBBBB", 2, 1, depth, kind, 0, 0, 0)), *more.items(),
                          (b"IDAT", zlib.compress(b"\0" + row)), (b"IEND", b"")]
                image = b"\x89PNG\r\n\x1a\n" + b"".join(struct.pack(">I", len(data)) + tag + data +
                                                       struct.pack(">I", zlib.crc32(tag + data)) for tag, data in chunks)
                self.assertEqual(list(self.texels("image/png", data=image)[0]), wanted)

    def test_an_image_is_what_its_first_bytes_say(self):
        """Whatever its MIME type or name is: in the binary part, in a data URI and beside the model."""
        self.write("my wood.png", WEBP)
        for mime, image in (("image/webp", {"data": WEBP}), ("image/png", {"data": WEBP}), ("", {"uri": "my%20wood.png"}),
                            ("", {"uri": "data:image/jpeg;base64," + base64.b64encode(WEBP).decode()})):
            with self.subTest(mime or image["uri"][:20]):
                texels, text = self.texels(mime, **image)
                self.assertEqual((texels[:4], text), (bytes([255, 0, 0, 255]), ""))

    def test_an_image_in_a_buffer_of_another_file_is_what_its_first_bytes_say(self):
        """In base64, and in a file beside the model."""
        for uri in (None, "my%20buffer.bin"):
            with self.subTest(uri):
                model = Model().cube()
                model.primitive["material"] = 0
                model.json.update(materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
                                  textures=[{"source": 0}], images=[{"bufferView": model.view(WEBP), "mimeType": "image/png"}])
                self.write("my buffer.bin", model.data)
                text = model.text()
                if uri:
                    text = json.dumps({**json.loads(text), "buffers": [{"uri": uri, "byteLength": len(model.data)}]})
                result = self.import_text("model.gltf", text)
                texture, = result.of(SET_TEXTURE)
                self.assertEqual((result.data(texture["arrays"][0])[:4], result.text()), (bytes([255, 0, 0, 255]), ""))

    def test_an_image_of_no_known_format_is_named(self):
        texels, text = self.texels("image/png", data=b"no image at all")
        self.assertEqual(texels[:4], bytes([255, 0, 255, 255]), "magenta stands in")
        self.assertIn("is not an image of a known format", text)

    def test_a_specular_texture_makes_metal_of_what_shines(self):
        """Black below it: the coloured texels reflect as metals of their colours."""
        result = self.gloss([WEBP], diffuseFactor=[0, 0, 0, 1], specularGlossinessTexture={"index": 0})
        base, rough, _ = result.of(SET_TEXTURE)
        self.assertEqual(result.data(base["arrays"][0])[:4], bytes([255, 0, 0, 255]))
        self.assertEqual(result.data(rough["arrays"][0]), bytes([255, 0, 255, 255]) * 4)


if __name__ == "__main__":
    unittest.main(verbosity=2)
