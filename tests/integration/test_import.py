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
import json
import math
import os
import shutil
import struct
import subprocess
import unittest
import unittest.mock

import importer
from farlight_test import LONG, SHARED_SCENES as SCENES, Case, bundled_scenes, long_test, needs_shared_scenes
from importer import (
    SET_CAMERA, SET_ENVIRONMENT, SET_LIGHT, SET_MATERIAL, SET_MESH, SET_NODE, SET_SPHERES, SET_TEXTURE,
    Peer, import_file, import_files, inconsistencies)


def model_files(folder, endings):
    for base, folders, names in os.walk(folder):
        folders.sort()
        for name in sorted(names):
            if name.lower().endswith(endings):
                yield os.path.join(base, name)


def shorter(path):
    return os.path.relpath(path, SCENES)


# Triangles and spheres of some models as the scenes' README states them.
COUNTS = {"common/dragon-871k.glb": (871414, 0), "common/bunny-69k.obj": (69451, 0), "common/teapot.obj": (6320, 0),
          "rayspace/kitchen.obj": (85864, 0), "screenspace/classroom.obj": (111164, 0), "bvh/spd-mount.nff": (8192, 4),
          "bvh/spd-tetra.nff": (4096, 0), "gltf/DamagedHelmet.glb": (15452, 0), "ldc/CesiumMan.glb": (4672, 0),
          "gltf/CornellBox.glb": (36, 0)}
STRIDE = 1 if LONG else 12  # of models, and of hostile files of each folder


class Models(unittest.TestCase):
    @needs_shared_scenes
    def test_every_model_is_imported(self):
        """All of common, ldc, bvh, rayspace, screenspace and gltf; otherwise those of known counts that are small, and some."""
        paths = [path for folder in ("common", "ldc", "bvh", "rayspace", "screenspace", "gltf")
                 for path in model_files(os.path.join(SCENES, folder), (".obj", ".gltf", ".glb", ".nff"))]
        if not LONG:
            paths = [path for i, path in enumerate(paths) if os.path.getsize(path) < 3_000_000 and
                     (i % STRIDE == 0 or shorter(path) in COUNTS)]
        for path, result in import_files(paths, seconds=30):
            with self.subTest(shorter(path)):
                self.assertEqual((result.status, result.committed, result.faults), (0, True, []), result.text() + result.stderr)
                self.assertEqual(inconsistencies(result), [])
                counts = (sum(mesh["triangles"] for mesh in result.of(SET_MESH)), sum(one["count"] for one in result.of(SET_SPHERES)))
                self.assertEqual(counts, COUNTS.get(shorter(path), counts))

    def test_bundled_scenes_face_the_way_that_their_normals_do(self):
        """But for at most one triangle of a hundred: in a fold, such as a pot's under its knob, the normals are means."""
        for name in ("cornell", "teapot", "carousel"):
            result = import_file(str(bundled_scenes() / f"{name}.glb"))
            self.assertEqual((result.status, inconsistencies(result)), (0, []))
            for mesh in result.of(SET_MESH):
                positions, corners, normals = (result.floats(mesh["arrays"][0]), result.integers(mesh["arrays"][1]),
                                               result.floats(mesh["arrays"][2]))
                against = 0
                for at in range(0, len(corners), 3):
                    a, b, c = (positions[3 * i:3 * i + 3] for i in corners[at:at + 3])
                    u, v = [q - p for p, q in zip(a, b)], [q - p for p, q in zip(a, c)]
                    lean = [sum(normals[3 * i + k] for i in corners[at:at + 3]) for k in range(3)]
                    against += sum((u[k - 2] * v[k - 1] - u[k - 1] * v[k - 2]) * lean[k] for k in range(3)) < 0
                self.assertLess(against, len(corners) / 300, f"{name}: {mesh['name']}")

    @long_test
    @needs_shared_scenes
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


# Valid by the letter, and yet there is nothing that could be shown of them.
NOT_TO_BE_HAD = {
    "accessor/unknown_type.gltf": "an accessor of a type that does not exist",
    "buffer/non_relative_uri.gltf": "a buffer on the network",
    "buffer/valid_placeholder.glb": "a buffer whose bytes are nowhere",
    "json/integer_written_as_float.gltf": "buffers whose bytes are nowhere",
    "root/named_objects.gltf": "buffers whose bytes are nowhere",
    "root/unused_objects.gltf": "buffers whose bytes are nowhere",
}


class Hostile(Case):
    @needs_shared_scenes
    def test_every_hostile_file_is_refused_or_imported(self):
        """Also those that are no models, given as if they were; one that the validator finds no error in is imported. All of hostile,
        or some of each folder and ending."""
        kinds, imported, refused = {}, 0, 0
        for path in model_files(os.path.join(SCENES, "hostile"), ("",)):
            kinds.setdefault((os.path.dirname(path), os.path.splitext(path)[1]), []).append(path)
        for path, result in import_files([path for paths in kinds.values() for path in paths[::STRIDE]], memory=6 << 30):
            with self.subTest(shorter(path)):
                self.assertEqual((result.faults, result.stderr), ([], ""))
                self.assertIn(result.status, (0, 1))
                self.assertEqual((result.committed, result.done), (result.status == 0,) * 2)
                if result.status == 1:
                    (_, where, text), = result.errors()
                    self.assertIn(os.path.basename(path)[:60], where)
                    self.assertGreater(len(text), 8)
                else:
                    self.assertEqual(inconsistencies(result), [])
                if os.path.exists(path + ".report.json"):
                    with open(path + ".report.json", encoding="utf-8") as file:
                        accepted = json.load(file)["issues"]["numErrors"] == 0
                    nowhere = any(path.endswith(ending) for ending in NOT_TO_BE_HAD)
                    shows_nothing = "contains nothing that can be shown" in result.text()
                    self.assertFalse(accepted and not shows_nothing and result.status == (0 if nowhere else 1), result.text())
                imported += result.status == 0
                refused += result.status == 1
        print("hostile: %d imported, %d refused" % (imported, refused))
        self.assertGreater(min(imported, refused), 0)

    def import_buffer(self, name, folder=None, size=16):
        path = (folder or self.folder) / "model.gltf"
        path.write_text(json.dumps({"asset": {"version": "2.0"}, "buffers": [{"uri": name, "byteLength": size}]}), encoding="utf-8")
        return import_file(str(path), seconds=5)

    def test_secrets_fifos_and_folders_beside_a_model_are_no_buffers(self):
        secrets = {".ssh/id": b"\0" * 16, ".token": b"\0" * 16, "key.bin": os.urandom(32),
                   "id_rsa": b"-----BEGIN OPENSSH PRIVATE KEY-----\n" * 4, "secrets.json": b'{"password": "\xc3\xa4"}',
                   "cookies.sqlite": b"SQLite format 3\0" + bytes(32), "key.der": b"\x30\x82\1\2\2\1\0" + bytes(32),
                   "program": b"\x7fELF" + bytes(32), "packed.gz": b"\x1f\x8b\x08" + bytes(32)}
        for name in (".ssh", "plain", "folder.bin"):
            (self.folder / name).mkdir()
        for name, data in secrets.items():
            (self.folder / name).write_bytes(data)
        (self.folder / "key.bin").chmod(0o600)
        (self.folder / "link").symlink_to(".ssh")
        (self.folder / "plain/link.bin").symlink_to("../.token")
        os.mkfifo(self.folder / "pipe.bin")
        for name in [*secrets, "link/id", "plain/link.bin", "./plain/../.token", "plain\\..\\.token"]:
            result = self.import_buffer(name)
            self.assertEqual((result.status, result.faults, result.blobs), (1, [], {}), name)
            self.assertRegex(result.text(), "begin with a dot|mode of a key|is (text|a |an |packed)", name)
        for name in ("pipe.bin", "folder.bin", "/etc/passwd", "../x.bin", "missing.bin"):
            result = self.import_buffer(name, size=4)
            self.assertEqual((result.status, result.faults, len(result.errors())), (1, [], 1), (name, result.notes))
        os.mkfifo(self.folder / "model.obj")
        self.assertIn("FIFO", import_file(str(self.folder / "model.obj"), seconds=5).text())

    def test_links_within_the_folder_and_a_hidden_folder_of_the_model_are_read(self):
        models = self.folder / ".models"
        (models / "data").mkdir(parents=True)
        (models / "data/real.bin").write_bytes(bytes(16))
        (models / "also").symlink_to("data")
        (models / "data/link.bin").symlink_to("../also/real.bin")
        for name in ("data/real.bin", "./data/link.bin", "also/../data/./real.bin", "data\\real.bin"):
            self.assertNotRegex(self.import_buffer(name, models).text(), "real.bin|buffer")

    def test_a_material_file_that_is_none_is_not_read(self):
        for name, data in (("passwords", b"admin newmtl secret\n"), ("binary.mtl", b"newmtl a\n\0"), (".hidden.mtl", b"newmtl a\n")):
            (self.folder / name).write_bytes(data)
            (self.folder / "model.obj").write_text(f"mtllib {name}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n")
            result = import_file(str(self.folder / "model.obj"), seconds=5)
            self.assertEqual((result.status, result.faults), (0, []), name)
            self.assertRegex(result.text(), "no statement 'newmtl'|begin with a dot", name)


class Peers(Case):
    """What the importer does when its peer is not kind."""

    def setUp(self):
        super().setUp()
        self.path = str(self.folder / "strip.obj")
        with open(self.path, "w", encoding="utf-8") as file:
            for i in range(40000):
                file.write("v %d %d 0\n" % (i // 2, i % 2))
            for i in range(1, 39999):
                file.write("f %d %d %d\n" % (i, i + 1, i + 2))

    def test_a_peer_decides_what_is_sent_and_when(self):
        for options, status, sent in (({"credit": 300000}, 0, True), ({"need": False}, 0, False), ({"refuse_commit": True}, 1, True)):
            result = import_file(self.path, **options)
            self.assertEqual((result.status, result.faults, result.done), (status, [], status == 0), options)
            self.assertEqual(sum(map(len, result.blobs.values())) > 900000, sent, options)
        self.assertIn("not today", result.errors()[0][2])
        result = import_file(self.path, first_credit=False, wall_s=1.5)
        self.assertEqual((result.blobs, result.committed), ({}, False))

    def test_a_peer_that_hangs_up_is_left_quietly(self):
        for after in (1, 3, 4):
            result = import_file(self.path, hang_up_after=after)
            self.assertEqual((result.status, result.stderr), (1, ""))

    def test_wrong_usage_ends_with_2(self):
        for arguments in ([], ["--fd", "x", "m.obj"], ["--fd", "0"], ["--bogus"]):
            done = subprocess.run([importer.IMPORTER] + arguments, stdin=subprocess.DEVNULL, capture_output=True, check=False)
            self.assertEqual(done.returncode, 2, arguments)

    def test_a_missing_model_is_named(self):
        result = import_file(str(self.folder / "nowhere.glb"))
        self.assertEqual((result.status, "nowhere.glb" in result.errors()[0][1]), (1, True))


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


class Written(importer.Written):
    def run_gltf(self, *arguments, status=0, **options):
        return self.import_text("model.gltf", json.dumps(gltf(*arguments, **options)), status)

    def test_gltf_transform_camera_and_lights(self):
        """Point lights with a radius are spheres that send as much."""
        lights = [{"type": "point", "intensity": 5, "color": [1, 0.5, 0], **({"extras": {"radius": radius}} if radius else {})}
                  for radius in (None, 0.5, -1, "wide")]
        result = self.run_gltf({
            "scenes": [{"nodes": [0]}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "nodes": [{"mesh": 0, "camera": 0, "name": "all", "translation": [1, 2, 3], "scale": [2, 2, 2], "children": [1, 2, 3],
                       "extensions": {"KHR_lights_punctual": {"light": 0}}}] +
                     [{"extensions": {"KHR_lights_punctual": {"light": i}}} for i in (1, 2, 3)],
            "cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}],
            "extensions": {"KHR_lights_punctual": {"lights": lights}}})
        group, *below = result.of(SET_NODE)
        self.assertEqual(group["matrix"], (2, 0, 0, 1, 0, 2, 0, 2, 0, 0, 2, 3))
        self.assertEqual([(node["parent"], node["kind"]) for node in below[:3]], [(group["id"], kind) for kind in (1, 4, 3)])
        area = math.pi * 0.25
        self.assert_has(result.of(SET_CAMERA), [{"fov_y": 0.7}])
        self.assert_has(sorted(result.of(SET_LIGHT), key=lambda light: light["kind"]),
                        [{"kind": 0, "colour": (5, 2.5, 0)}] * 3 + [{"kind": 4, "size": (0.5, 0), "colour": (5 / area, 2.5 / area, 0.0)}])

    def test_gltf_strips_and_fans_become_triangles(self):
        data = struct.pack("<12f", 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0)
        for mode, wanted in ((5, [0, 1, 2, 1, 3, 2]), (6, [1, 2, 0, 2, 3, 0])):
            result = self.run_gltf(
                {"nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": mode}]}]},
                data=data, accessors=[{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}])
            self.assertEqual(result.integers(result.of(SET_MESH)[0]["arrays"][1]), wanted)

    PLACES = ((0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0))
    COLOURS = (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)

    def run_modes(self, *primitives, places=PLACES, last=3, status=0, arguments=(), **extra):
        """Of the modes, each with positions 0, colours 1 and indices 2 as it likes."""
        data = b"".join(struct.pack("<3f", *place) for place in (*places, *self.COLOURS)) + struct.pack("<4H", 0, 2, 1, last)
        views = [{"buffer": 0, "byteOffset": at, "byteLength": size} for at, size in ((0, 48), (48, 48), (96, 8))]
        accessors = [{"bufferView": i, "componentType": kind, "count": 4, "type": name}
                     for i, (kind, name) in enumerate(((5126, "VEC3"), (5126, "VEC3"), (5123, "SCALAR")))]
        model = {"nodes": [{"mesh": 0, "name": "n"}], "meshes": [{"primitives": list(primitives)}], **extra}
        self.write("model.gltf", json.dumps(gltf(model, data=data, views=views, accessors=accessors)))
        result = import_file(str(self.folder / "model.gltf"), *arguments)
        self.assertEqual((result.status, result.faults), (status, []), result.text())
        self.assertEqual(inconsistencies(result) if status == 0 else [], [])
        return result

    def test_gltf_points_are_spheres_in_the_colours_of_their_vertices(self):
        points = {"mode": 0, "attributes": {"POSITION": 0, "COLOR_0": 1}, "material": 0}
        result = self.run_modes(points, {"attributes": {"POSITION": 0}, "indices": 2, "mode": 5},
                                materials=[{"pbrMetallicRoughness": {"baseColorFactor": [0.5, 1, 1, 1]}}])
        spheres, = result.of(SET_SPHERES)
        values = result.floats(spheres["arrays"][0])
        materials = {material["id"]: material["base"][:3] for material in result.of(SET_MATERIAL)}
        shown = {tuple(values[at * 4:at * 4 + 3]): materials[material]
                 for first, count, material in spheres["ranges"] for at in range(first, first + count)}
        self.assertEqual(set(shown), set(self.PLACES))
        for place, colour in zip(self.PLACES, self.COLOURS):
            for got, wanted in zip(shown[place], (colour[0] * 0.5, *colour[1:])):
                self.assertAlmostEqual(got, wanted, 5)
        self.assertEqual(set(values[3::4]), {2}, "the distance to the nearest other point")
        # Beside the triangles of the same mesh, below its node.
        group, *below = result.of(SET_NODE)
        self.assertEqual(sorted((node["parent"], node["kind"]) for node in below), [(group["id"], 1), (group["id"], 2)])
        given = self.run_modes(points, arguments=("--point-size", "0.5"), materials=[{}])
        self.assertEqual(set(given.floats(given.of(SET_SPHERES)[0]["arrays"][0])[3::4]), {0.25})

    def test_gltf_lines_are_closed_tubes(self):
        for mode, indices, ends in ((1, None, ((0, 1), (2, 3))), (1, 2, ((0, 2), (1, 3))), (2, None, ((0, 1), (1, 2), (2, 3), (3, 0))),
                                    (3, 2, ((0, 2), (2, 1), (1, 3)))):
            with self.subTest((mode, indices)):
                line = {"mode": mode, "attributes": {"POSITION": 0, "COLOR_0": 1}, **({"indices": indices} if indices else {})}
                result = self.run_modes(line, arguments=("--point-size", "0.1"))
                mesh, = result.of(SET_MESH)
                self.assertEqual((mesh["vertices"], mesh["triangles"]), (8 * len(ends), 12 * len(ends)))
                places, colours = result.floats(mesh["arrays"][0]), result.data(mesh["arrays"][6])
                self.check_closed(result.integers(mesh["arrays"][1]), places)
                for tube, pair in enumerate(ends):
                    for vertex in range(8):
                        at, end = tube * 8 + vertex, pair[vertex % 2]
                        self.assertAlmostEqual(math.dist(places[at * 3:at * 3 + 3], self.PLACES[end]), 0.05, 5)
                        self.assertEqual(tuple(colours[at * 4:at * 4 + 4]), tuple(255 * c for c in (*self.COLOURS[end], 1)))
        chosen = self.run_modes({"mode": 1, "attributes": {"POSITION": 0}})
        places = chosen.floats(chosen.of(SET_MESH)[0]["arrays"][0])
        self.assertAlmostEqual(math.dist(places[:3], self.PLACES[0]), math.sqrt(8) / 200 / 2, 5)

    def check_closed(self, corners, places):
        """Each edge is in two triangles, in both directions, and the volume is not negative."""
        edges, volume = set(), 0
        for at in range(0, len(corners), 3):
            a, b, c = corners[at:at + 3]
            edges |= {(a, b), (b, c), (c, a)}
            p, q, r = (places[one * 3:one * 3 + 3] for one in (a, b, c))
            volume += (p[0] * (q[1] * r[2] - q[2] * r[1]) + p[1] * (q[2] * r[0] - q[0] * r[2]) + p[2] * (q[0] * r[1] - q[1] * r[0])) / 6
        self.assertEqual(len(edges), len(corners))
        self.assertEqual(edges, {(b, a) for a, b in edges})
        self.assertGreater(volume, 0)

    def test_gltf_points_and_lines_that_cannot_be_shown_are_said(self):
        far, here = float("inf"), (0, 0, 0)
        for mode, wanted in ((0, "NaN or infinite"), (2, "without length")):
            result = self.run_modes({"mode": mode, "attributes": {"POSITION": 0}}, places=(here, here, (far, 0, 0), (1, 0, 0)))
            self.assertIn(wanted, result.text())
        self.assertEqual(result.of(SET_MESH)[0]["triangles"], 12)
        moved = {"mode": 1, "attributes": {"POSITION": 0}, "targets": [{"POSITION": 0}]}
        self.assertIn("at rest", self.run_modes(moved).text())
        self.assertIn("without positions", self.run_modes({"mode": 3, "attributes": {}}, status=1).text())
        for mode in (0, 1):
            wrong = self.run_modes({"mode": mode, "attributes": {"POSITION": 0}, "indices": 2}, last=4, status=1)
            self.assertIn("index 4 (number 3) is beyond the 4 vertices", wrong.text())

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
        self.assertEqual(result.floats(first["arrays"][0]), [0, 0, 0, 1, 0, 0, 0, 1, 0])
        self.assertEqual(result.floats(second["arrays"][0]), [0, 0, 0, 1, 0, 0, 0, 3, 0])

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

    def materials(self, *materials, **more):
        """Of a file that has a triangle of each, and an image that is nowhere as ten textures."""
        return self.run_gltf({
            "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}], "materials": list(materials), "images": [{"uri": "nowhere.png"}],
            "textures": [{"source": 0, "name": str(i)} for i in range(10)],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": i} for i in range(len(materials))]}], **more})

    def test_gltf_materials(self):
        """Rows: what the file says, what the material has, and how many values were out of range and set."""
        def extended(**extensions):
            return {"extensions": {f"KHR_materials_{name}": value for name, value in extensions.items()}}
        flat = (0, 0, 0, 0)
        rows = (
            ({"emissiveFactor": [1, 0.5, 0], "alphaMode": "MASK", "alphaCutoff": 0.25, "pbrMetallicRoughness": {
                "baseColorFactor": [0.5, 0.25, 1, 0.5], "metallicFactor": 0.5, "roughnessFactor": 0.125},
              **extended(transmission={"transmissionFactor": 0.9}, ior={"ior": 1.33}, emissive_strength={"emissiveStrength": 4}, unlit={})},
             {"base": (0.5, 0.25, 1, 0.5), "emission": (4, 2, 0), "metallic": 0.5, "roughness": 0.125, "unlit": 1, "alpha_mode": 1,
              "cutoff": 0.25, "transmission": 0.9, "ior": 1.33}, 0),
            ({}, {"coat": (0, 0), "sheen": flat, "film": (0.0, 1.3, 100, 400), "dispersion": 0, "through": (0, 1, 1, 1), "thin_walled": 0,
                  "anisotropy": [0, 0], "specular": (1, 1, 1, 1), "body": (0, 1, 1, 1, 0), "seen_only": 0}, 0),
            (extended(clearcoat={"clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.25}), {"coat": (0.5, 0.25)}, 0),
            (extended(clearcoat={"clearcoatFactor": 2}), {"coat": (1, 0)}, 1),
            (extended(sheen={"sheenColorFactor": [1, 0.5, 0.25], "sheenRoughnessFactor": 0.75}), {"sheen": (1, 0.5, 0.25, 0.75)}, 0),
            (extended(sheen={"sheenColorFactor": [-1, 0, 0]}), {"sheen": flat}, 1),
            (extended(iridescence={"iridescenceFactor": 0.5, "iridescenceIor": 1.5, "iridescenceThicknessMinimum": 200,
                                   "iridescenceThicknessMaximum": 800}), {"film": (0.5, 1.5, 200, 800)}, 0),
            (extended(iridescence={"iridescenceIor": 0}), {"film": (0, 1, 100, 400)}, 1),
            (extended(dispersion={"dispersion": 2}), {"dispersion": 2}, 0), (extended(dispersion={"dispersion": -1}), {"dispersion": 0}, 1),
            (extended(diffuse_transmission={"diffuseTransmissionFactor": 0.25, "diffuseTransmissionColorFactor": [1, 0.5, 0]}),
             {"through": (0.25, 1, 0.5, 0), "thin_walled": 1}, 0),
            (extended(transmission={"transmissionFactor": 1}, volume={"thicknessFactor": 1}), {"thin_walled": 0}, 0),
            (extended(anisotropy={"anisotropyStrength": 0.5, "anisotropyRotation": -1.5}), {"anisotropy": [0.5, -1.5]}, 0),
            (extended(anisotropy={"anisotropyRotation": 2}), {"anisotropy": [0, 2]}, 0),
            (extended(anisotropy={"anisotropyStrength": 3, "anisotropyRotation": "east"}), {"anisotropy": [1, 0]}, 1),
            (extended(specular={"specularFactor": 0.25, "specularColorFactor": [2, 1, 0.5]}), {"specular": (0.25, 2, 1, 0.5)}, 0),
            (extended(specular={"specularFactor": 3, "specularColorFactor": [-1, 1, 1]}), {"specular": (1, 0, 1, 1)}, 2),
            (extended(volume={"attenuationDistance": 0.5, "attenuationColor": [1, 0.5, 0.25], "thicknessFactor": 4}),
             {"body": (0.5, 1, 0.5, 0.25, 4)}, 0),
            (extended(volume={"attenuationDistance": -1, "attenuationColor": "blue"}), {"body": (0, 1, 1, 1, 0)}, 1),
            *(({"emissiveFactor": [1, 1, 1], "extras": {"emission_seen_only": value}}, {"seen_only": wanted}, 0)
              for value, wanted in ((True, 1), (False, 0), (1, 1), (0, 0), ("yes", 0))),
            ({"emissiveFactor": [1, 1, 1], "extras": 3}, {"seen_only": 0}, 0))
        names = sorted({name for given, _, _ in rows for name in given.get("extensions", ())})
        result = self.materials(*({"name": str(i), **given} for i, (given, _, _) in enumerate(rows)), extensionsRequired=names)
        self.assert_has(result.of(SET_MATERIAL), [{"name": str(i), **wanted} for i, (_, wanted, _) in enumerate(rows)])
        self.assertEqual(len([note for note in result.notes if "was set to" in note[2]]), sum(count for _, _, count in rows), result.text())

    def test_gltf_textures_of_layers_have_their_places_and_formats(self):
        """Colours of cloth and of what goes through are sRGB."""
        keys = (("clearcoat", "clearcoat"), ("clearcoat", "clearcoatRoughness"), ("clearcoat", "clearcoatNormal"), ("sheen", "sheenColor"),
                ("sheen", "sheenRoughness"), ("iridescence", "iridescence"), ("iridescence", "iridescenceThickness"),
                ("diffuse_transmission", "diffuseTransmission"), ("diffuse_transmission", "diffuseTransmissionColor"),
                ("anisotropy", "anisotropy"))
        extensions = {}
        for index, (extension, key) in enumerate(keys):
            extensions.setdefault(f"KHR_materials_{extension}", {})[f"{key}Texture"] = {"index": index, **(
                {"scale": 0.5} if key == "clearcoatNormal" else {})}
        result = self.materials({"extensions": extensions})
        (material,), textures = result.of(SET_MATERIAL), {one["id"]: one for one in result.of(SET_TEXTURE)}
        uses = material["textures"]
        self.assertEqual([textures[uses[at]["texture"]]["format"] for at in range(9, 19)], [1, 1, 1, 0, 1, 1, 1, 1, 0, 1])
        self.assertEqual((len(uses), uses[11]["strength"]), (19, 0.5))

    def test_gltf_missing_image_is_marked(self):
        result = self.materials({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "normalTexture": {"index": 0}})
        self.assertEqual(sorted(t["format"] for t in result.of(SET_TEXTURE)), [0, 1], "colour and data")
        self.assertEqual(result.data(result.of(SET_TEXTURE)[0]["arrays"][0])[:4], b"\xff\x00\xff\xff")
        self.assertIn("nowhere.png", result.text())

    def textured(self):
        """The text of a model with one image, which is HDR."""
        return json.dumps(gltf({
            "nodes": [{"mesh": 0}], "textures": [{"source": 0}],
            "images": [{"uri": "data:image/vnd.radiance;base64," + base64.b64encode(HDR).decode("ascii")}],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}]}))

    def test_gltf_images_are_found_however_their_name_is_spelt(self):
        for text in (self.textured(), self.textured().replace('"images"', '"im\\u0061ges"')):
            result = self.import_text("model.gltf", text)
            self.assertNotIn("image", result.text())
            texel, = set(result.data(result.of(SET_TEXTURE)[0]["arrays"][0])[:3])
            self.assertAlmostEqual(texel, 188, delta=1, msg="sRGB of 0.5")

    def import_environment(self, data, status=0):
        result = Peer().run(["--environment", self.write("sky.hdr", data), "--no-model"])
        self.assertEqual(result.status, status, result.text() + result.stderr)
        return result

    def halves_of(self, result):
        environment, = result.of(SET_ENVIRONMENT)
        return environment["size"], list(memoryview(result.data(environment["arrays"][0])).cast("H"))

    @long_test
    def test_environments_are_read_whole_or_not_at_all(self):
        """With runs, and without, as narrow ones are. The second row is 16 times as bright."""
        dim, bright = b"\x80\x40\x20\x80", b"\x80\x40\x20\x84"
        dim_halves, bright_halves = [0x3800, 0x3400, 0x3000, 0], [0x4800, 0x4400, 0x4000, 0]
        head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n"
        runs = b"".join(b"\x02\x02\x00\x08" + bytes(b for value in row for b in (0x88, value)) for row in (dim, bright))
        for width, data in ((8, head + b"-Y 2 +X 8\n" + runs), (1, head + b"-Y 2 +X 1\n" + dim + bright)):
            size, texels = self.halves_of(self.import_environment(data))
            self.assertEqual((size, texels), ((width, 2), dim_halves * width + bright_halves * width))
            for cut in (11, len(head) - 2, len(head) + 4, len(head + b"-Y 2 +X "), len(data) - 1):
                with self.subTest(width=width, cut=cut):
                    self.assertIn("cannot be read", self.import_environment(data[:cut], status=1).text())

    def test_without_its_module_the_importer_reads_models_but_no_images(self):
        alone = shutil.copy(importer.IMPORTER, self.folder)
        with unittest.mock.patch.object(importer, "IMPORTER", alone):
            self.assertEqual(self.halves_of(self.import_environment(HDR)), ((1, 1), [0x3800, 0x3800, 0x3800, 0]))
            plain = self.import_text("model.nff", "v\nfrom 0 0 5\nat 0 0 0\nup 0 1 0\nangle 45\nhither 1\nresolution 8 8\ns 0 0 0 1\n")
            self.assertNotIn("farlight-textures", plain.text())
            result = self.import_text("model.gltf", self.textured())
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
        self.assertEqual(result.floats(mesh["arrays"][0])[2], 0, "as the file has it")
        self.assertEqual(result.floats(mesh["arrays"][9]), [0, 0, 2] * 3)
        self.assertEqual([node["weights"] for node in result.of(SET_NODE)], [[], [1]])

    def test_obj_faces_and_materials(self):
        """Sheen is grey, with the roughness that Blender's shader has by default; a map without a number is whole."""
        rows = (
            ("Kd 1 0 0\nNs 10\nd 0.5", {"base": (1, 0, 0, 0.5), "alpha_mode": 2, "roughness": (2 / 12) ** 0.5, "anisotropy": [0, 0]}),
            ("Kd 0 0 0\nKs 0.9 0.9 0.9\nNs 1000\nillum 3\naniso 0.5\nanisor 0.25", {"metallic": 1, "roughness": 0, "anisotropy": [0.5, math.pi / 2]}),
            ("Kd 0 0 0\nd 0.1\nNi 1.5\nillum 7", {"transmission": 0.9, "base": (1, 1, 1, 1)}),
            ("Kd 1 0 0\nPr 0.4\nPm 0.25\nPc 0.75\nPcr 0.125", {"coat": (0.75, 0.125), "sheen": (0, 0, 0, 0), "metallic": 0.25}),
            ("Ps 0.5", {"coat": (0, 0), "sheen": (0.5,) * 4}), ("map_Ps fibres.ppm", {"sheen": (1, 1, 1, 0.5)}))
        self.write("fibres.ppm", b"P6\n1 1\n255\n\x80\x80\x80")
        self.write("m.mtl", "".join(f"newmtl {i}\n{text}\n" for i, (text, _) in enumerate(rows)))
        faces = ["f 1/1 2/1 3/1 4/1", "f -4 -3 -2", *["f 1/1 2/1 4/1"] * 4]
        result = self.import_text("model.obj", "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0.25\n" +
                                  "".join(f"usemtl {i}\n{face}\n" for i, face in enumerate(faces)))
        mesh, = result.of(SET_MESH)
        self.assertEqual([r[:2] for r in mesh["ranges"]], [(0, 2), *((i + 1, 1) for i in range(1, 6))])
        self.assertEqual(result.floats(mesh["arrays"][4])[1], 0.75, "v runs downwards here")
        materials = result.of(SET_MATERIAL)
        self.assert_has(materials, [{"name": str(i), **wanted} for i, (_, wanted) in enumerate(rows)])
        texture, = result.of(SET_TEXTURE)
        self.assertEqual((materials[5]["textures"][12]["texture"], texture["format"]), (texture["id"], 1), "linear")
        self.assertEqual(result.text(), "")

    def test_what_has_no_material_is_light_grey_unless_its_vertices_have_colours(self):
        corners = "v 0 0 0 %s\nv 1 0 0 %s\nv 1 1 0 %s\nv 0 1 0 %s\n"
        bare, coloured = corners % (("",) * 4), corners % (("1 0 0",) * 4)
        self.write("m.mtl", "newmtl red\nKd 1 0 0\n")
        result = self.import_text("model.obj", "mtllib m.mtl\n" + bare + "f 1 2 3\nusemtl red\nf 1 3 4\n")
        mesh, = result.of(SET_MESH)
        materials = {m["id"]: (m["name"], m["base"], m["double_sided"]) for m in result.of(SET_MATERIAL)}
        grey = tuple(struct.unpack("4f", struct.pack("4f", 0.6, 0.6, 0.6, 1)))
        self.assertEqual({materials[m] for _, _, m in mesh["ranges"]}, {("default", grey, 1), ("red", (1, 0, 0, 1), 1)})
        result = self.run_gltf({"nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}]})
        self.assertEqual([m["name"] for m in result.of(SET_MATERIAL)], ["default"])
        self.assertEqual(self.import_text("coloured.obj", coloured + "f 1 2 3\n").of(SET_MATERIAL), [])

    def test_obj_concave_polygon(self):
        result = self.import_text("model.obj", "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 1 2 3 4 5\n")
        mesh, = result.of(SET_MESH)
        positions, area = result.floats(mesh["arrays"][0]), 0
        corners = result.integers(mesh["arrays"][1])
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
                    result = self.import_text(name, text, status)
                    if status:
                        self.assertIn("65537 corners; 3 to 65536 are allowed", result.text())

    def test_faults_name_line_and_word(self):
        for name, text, expected in (
                ("model.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "line 4: vertex 4"),
                ("model.obj", "v 0 0 0\nf -2 1 1\n", "line 2: vertex -2"), ("model.obj", "v 0 0 0\nv nan 0 0\n", "line 2: 'nan'"),
                ("model.obj", "v 0 0 0\nf 1/2 1 1\n", "line 2: texture coordinate 2"), ("model.obj", "# nothing\n", "no faces"),
                ("model.nff", "s 0 0 0\nx\n", "line 2: 'x'"), ("model.nff", "p 3\n0 0 0\n", "line 1: a polygon"),
                ("model.nff", "f 1 0 0\nwhat 3\n", "line 2: 'what'"), ("model.nff", "s 0 0 0 nan\n", "'nan'"),
                ("model.nff", "s 0 0 0 0\n", "radius 0"), ("model.nff", "p 1e9\n", "polygon")):
            with self.subTest(expected):
                self.assertIn(expected, self.import_text(name, text, 1).text())

    NFF = ("# all of it\nb 0.1 0.2 0.3\nv\nfrom 0 0 5\nat 0 0 0\nup 0 1 0\nangle 40\nhither 1\nresolution 512 512\n"
           "l 0 0 5\nl 0 3 4 1 0.5 0\nf 1 0 0 0.5 0.5 3 0 0\ns 0 0 0 1\nf 1 1 1 0 0 0 0.9 1.5\ns 2 0 0 0.5\n"
           "f 1 0 0 0.5 0.5 3 0 0\ns 4 0 0 0.5\nc 0 0 0 1\n0 2 0 0.5\np 4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
           "pp 3\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 1 0\n")

    def test_nff_statements(self):
        result = self.import_text("model.nff", self.NFF)
        spheres, = result.of(SET_SPHERES)
        red, glass = result.of(SET_MATERIAL)
        self.assertEqual([r[:2] for r in spheres["ranges"]], [(0, 2), (2, 1)], "sorted by material")
        # A display's numbers, with which light is computed. What scatters is below the mirror, which takes its part and is the same
        # at every angle: by its colour, Fresnel's curve begins at 1.
        self.assertEqual((red["metallic"], red["roughness"], red["specular"][0]), (0, 0, 0.5))
        for got in red["specular"][1:]:
            self.assertAlmostEqual(got * ((red["ior"] - 1) / (red["ior"] + 1)) ** 2, 1, 5)
        for got, wanted in zip(red["base"], (0.5 / (1 - 0.5), 0, 0)):
            self.assertAlmostEqual(got, wanted, 5)
        self.assertEqual((glass["transmission"], glass["specular"][0], glass["thin_walled"]), (1, 0, 0))
        self.assertAlmostEqual(glass["base"][0], 0.9, 5)
        self.assertEqual(glass["ior"], 1.5)
        self.assertEqual(result.of(SET_MESH)[0]["triangles"], 64 + 2 + 1)
        self.assertAlmostEqual(result.of(SET_CAMERA)[0]["fov_y"], 0.6981317, 5)
        self.assertAlmostEqual(result.of(SET_LIGHT)[1]["colour"][0], 3.14159265, 6)
        self.assertEqual(result.of(SET_LIGHT)[1]["kind"], 5, "the same at every distance")
        environment, = result.of(SET_ENVIRONMENT)
        self.assertEqual((environment["backdrop"], environment["display_values"]), (1, 1))
        for got, wanted in zip(environment["colour"], (0.1, 0.2, 0.3)):
            self.assertAlmostEqual(got, wanted, 5)
        camera = [node for node in result.of(SET_NODE) if node["kind"] == 4][0]
        self.assertEqual(camera["matrix"], (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 5))

    def test_nff_solids_are_closed(self):
        """Every edge of the triangles is met once in each direction, at equal places."""
        for word, triangles in (("tet", 4), ("hex", 12), ("oct", 8), ("dod", 36)):
            with self.subTest(word):
                result = self.import_text("model.nff", word + " 1 2 3 5\n")
                mesh, = result.of(SET_MESH)
                self.assertEqual(mesh["triangles"], triangles)
                positions, corners = result.floats(mesh["arrays"][0]), result.integers(mesh["arrays"][1])
                places = [tuple(round(x, 4) for x in positions[c * 3:c * 3 + 3]) for c in corners]
                edges = [(places[t + k], places[t + (k + 1) % 3]) for t in range(0, len(places), 3) for k in range(3)]
                self.assertEqual(len(set(edges)), len(edges))
                self.assertEqual(set(edges), {(b, a) for a, b in edges})

    def test_many_materials_make_several_sets(self):
        lines = ["f %g 0 0\ns %d 0 0 0.25\n" % (i / 5000, i) for i in range(5000)]
        result = self.import_text("model.nff", "".join(lines))
        self.assertEqual([one["count"] for one in result.of(SET_SPHERES)], [4096, 904])


if __name__ == "__main__":
    unittest.main(verbosity=2)
