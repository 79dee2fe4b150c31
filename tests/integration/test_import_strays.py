#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Models as exporters write them that stray from their format, or use corners of it that few readers know: each is shown as its
author meant it, or a note names what is left out and why."""
import base64
import io
import json
import math
import struct
import unittest
import zipfile
import zlib

import importer
from importer import SET_CAMERA, SET_ENVIRONMENT, SET_LIGHT, SET_MATERIAL, SET_MESH, SET_NODE, SET_SPHERES, SET_TEXTURE

QUAD = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
PPM = b"P6\n1 1\n255\n\x80\x80\x80"


class Obj(importer.Written):
    def test_materials_are_what_their_exporters_mean(self):
        """MTL in any case; without a colour, or with a black one, a texture is shown as it is."""
        rows = (("Kd 0.5 0.5 0.5", (0.5, 0.5, 0.5, 1)), ("map_Kd w.ppm", (1, 1, 1, 1)), ("Kd 0 0 0\nmap_Kd w.ppm", (1, 1, 1, 1)),
                ("map_Kd w.ppm\nKd 0.25 1 1", (0.25, 1, 1, 1)), ("kd 1 0 0\nMAP_KD w.ppm", (1, 0, 0, 1)), ("Kd 0 0 0", (0, 0, 0, 1)),
                ("Kd 1 1 1\nTr 1", (1, 1, 1, 0)))
        self.write("w.ppm", PPM)
        self.write("m.mtl", "".join(f"newmtl {i}\n{text}\n" for i, (text, _) in enumerate(rows)))
        result = self.import_text("model.obj", "mtllib m.mtl\n" + QUAD + "".join(f"usemtl {i}\nf 1/1 2/2 3/3\n" for i in range(len(rows))))
        self.assert_has(result.of(SET_MATERIAL), [{"base": base} for _, base in rows])
        self.assertEqual([any(use["texture"] for use in material["textures"]) for material in result.of(SET_MATERIAL)],
                         ["map" in text.lower() for text, _ in rows])
        self.assertRegex(result.text(), "^[^;]*6: a material is wholly transparent[^;]*$")

    def test_one_statement_may_name_several_libraries_or_one_with_blanks(self):
        for name in ("a.mtl", "b.mtl", "c d.mtl"):
            self.write(name, f"newmtl {name[0]}\nKd 1 0 0\n")
        result = self.import_text("model.obj", "mtllib a.mtl b.mtl none.mtl\nmtllib c d.mtl\n" + QUAD +
                                  "".join(f"usemtl {one}\nf 1 2 3\n" for one in "abc"))
        self.assertEqual([material["name"] for material in result.of(SET_MATERIAL)], ["a", "b", "c"])
        self.assertRegex(result.text(), "^[^;]*'none.mtl' cannot be used: No such file[^;]*$")

    def test_text_that_strays_is_read_as_it_is_meant(self):
        corners = [0, 0, 0, 1, 0, 0, 1, 1, 0]
        for face, text in (("f 1/1/ 2/2/ 3/3/", QUAD), ("f 1/ 2// 3/", QUAD), ("f 1 2 3", QUAD.replace("1 0 0", "1,0 0,0 0"))):
            mesh, = self.import_text("model.obj", text + face + "\n").of(SET_MESH)
            self.assertEqual(result_corners(mesh, self.last), corners, face)

    def test_a_nan_of_windows_is_no_number(self):
        result = self.import_text("model.obj", QUAD + "vn -1.#IND00 -1.#IND00 1.#QNAN\nf 1//1 2//1 3//1\n")
        mesh, = result.of(SET_MESH)
        self.assertEqual(result.floats(mesh["arrays"][2]), [0, 0, 1] * 3)
        self.assertRegex(result.text(), "^[^;]*3 normals are missing or unusable and were made from the faces[^;]*$")
        self.assertIn("line 2: 'nanINF' is not a finite number", self.import_text("model.obj", "v 0 0 0\nv 0 1.#INF 0\n", 1).text())

    def import_text(self, *arguments, **options):
        self.last = super().import_text(*arguments, **options)
        return self.last

    def test_a_spike_without_width_is_no_part_of_a_polygon(self):
        """A square with one from a corner, and with one from its side."""
        for spike in ("1 1 0\nv 3 2 0\nv 1 1 0", "1 0 0\nv 1 0.5 0\nv 4 0.5 0\nv 1 0.5 0\nv 1 1 0"):
            text = f"v 0 0 0\nv 1 0 0\nv {spike}\nv 0 1 0\n"
            result = self.import_text("model.obj", text + "f " + " ".join(str(i + 1) for i in range(text.count("v"))) + "\n")
            places, total = result_corners(result.of(SET_MESH)[0], result), 0
            for at in range(0, len(places), 9):
                (ax, ay), (bx, by), (cx, cy) = (places[at + 3 * i:at + 3 * i + 2] for i in range(3))
                area = ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)) / 2
                self.assertTrue(area == 0 or max(ax, bx, cx) <= 1, (ax, bx, cx))
                total += area
            self.assertAlmostEqual(total, 1, 6)

    def test_colours_of_vertices_are_srgb(self):
        result = self.import_text("model.obj", "v 0 0 0 0.5 0.5 0.5\nv 1 0 0 1 1 1\nv 1 1 0 0 0 0\nf 1 2 3\n")
        full = 65535
        self.assertEqual(result.colours(result.of(SET_MESH)[0]), [14027, 14027, 14027, full, full, full, full, full, 0, 0, 0, full])

    def test_textures_are_found_by_their_name_alone(self):
        """Paths of the machine where the model was made, quotes and letters in another case; not where nothing is beside the model."""
        names = ("C:\\\\Users\\\\A B\\\\tex\\\\Wood.ppm", "D:/work/Wood.ppm", "/home/me/Wood.ppm", '"tex/Wood.ppm"', "TEX/WOOD.PPM", "Wood.ppm",
                 "..\\tex\\other.ppm")
        self.write("Wood.ppm", PPM)
        self.write("m.mtl", "".join(f"newmtl {i}\nKd 1 1 1\nmap_Kd {name}\n" for i, name in enumerate(names)))
        result = self.import_text("model.obj", "mtllib m.mtl\n" + QUAD +
                                  "".join(f"usemtl {i}\nf 1/1 2/2 3/3\n" for i in range(len(names))))
        self.assertEqual([texture["nearest"] for texture in result.of(SET_TEXTURE)].count(1), 1, "a marker")
        found, missing = (note for note in result.notes)
        self.assertRegex(found[2], "'Wood.ppm' was found by its name alone.*5 times")
        self.assertIn("other.ppm' cannot be used: lies outside the model's folder", missing[2])

    def test_points_alone_are_spheres_in_their_colours(self):
        result = self.import_text("model.obj", "v 0 0 0 1 0 0\nv 2 0 0 0 1 0\nv 4 0 0 0 0 1\np 1 2 3\n")
        spheres, = result.of(SET_SPHERES)
        self.assertEqual(spheres["count"], 3)
        self.assertEqual({material["base"][:3] for material in result.of(SET_MATERIAL)}, {(1, 0, 0), (0, 1, 0), (0, 0, 1)})

    def test_lines_are_tubes_in_their_colours_and_materials(self):
        """Also beside a face; by numbers from either end, with texture coordinates or without; each tube has 8 vertices."""
        self.write("m.mtl", "newmtl a\nKd 1 0 0\n")
        corners = "v 0 0 0 1 1 1\nv 1 0 0 0 0 0\nv 1 1 0 1 0 0\nvt 0 0\n"
        for text, tubes, triangles in (("l 1 2 3 1\n", 3, 0), ("usemtl a \nl -3/1 -2/1\nf 1 2 3\n", 1, 1)):
            result = self.import_text("model.obj", "mtllib m.mtl\n" + corners + text)
            mesh = result.of(SET_MESH)[0]
            self.assertEqual((mesh["vertices"], sum(one["triangles"] for one in result.of(SET_MESH)) - 12 * tubes), (8 * tubes, triangles))
            self.assertEqual(result.data(mesh["arrays"][6])[:8], bytes((255, 255, 255, 255, 0, 0, 0, 255)))
            self.assertIn(f"{tubes} lines are shown as tubes", result.text())
        names = {material["id"]: material["name"] for material in result.of(SET_MATERIAL)}
        self.assertEqual([names[material] for _, _, material in mesh["ranges"]], ["a"])
        for text in ("l 1 4\n", "l 0 1\n", "l -4 1\n"):
            self.assertRegex(self.import_text("model.obj", corners + text, 1).text(), "line 5: vertex -?[0-9] does not exist; there are 3 so far")


class Gltf(importer.Written):
    """A triangle of floats and, behind it, an index and one unnormalised colour for each corner."""

    DATA = struct.pack("<9f3H2x", 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 2) + bytes((255, 51, 0, 0)) * 3

    def run_gltf(self, extra=None, primitives=None, status=0, folder_buffer=None):
        uri = folder_buffer or "data:application/octet-stream;base64," + base64.b64encode(self.DATA).decode("ascii")
        model = {"asset": {"version": "2.0"}, "buffers": [{"uri": uri, "byteLength": len(self.DATA)}],
                 "bufferViews": [{"buffer": 0, "byteOffset": at, "byteLength": size} for at, size in ((0, 36), (36, 6), (44, 12))],
                 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
                               {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
                               {"bufferView": 2, "componentType": 5121, "count": 3, "type": "VEC4"},
                               {"componentType": 5126, "count": 0, "type": "VEC3"}, {"componentType": 5123, "count": 0, "type": "SCALAR"}],
                 "meshes": [{"primitives": primitives or [{"attributes": {"POSITION": 0}, "indices": 1}]}], "nodes": [{"mesh": 0}],
                 **(extra or {})}
        return self.import_text("model.gltf", json.dumps(model), status)

    def test_an_empty_primitive_is_left_out(self):
        good = {"attributes": {"POSITION": 0}, "indices": 1}
        for empty in ({"attributes": {"POSITION": 3}}, {"attributes": {"POSITION": 3}, "indices": 4}, {"attributes": {"POSITION": 0}, "indices": 4}):
            result = self.run_gltf(primitives=[empty, good])
            self.assert_has(result.of(SET_MESH), [{"triangles": 1}])
            self.assertIn("meshes[0].primitives[0]: a primitive without vertices is left out", result.text())

    def test_a_channel_without_keys_is_left_out(self):
        result = self.run_gltf({"animations": [{"channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
                                                "samplers": [{"input": 4, "output": 3}]}]})
        self.assertEqual(len(result.of(SET_MESH)), 1)
        self.assertIn("animations[0].channels[0]: a channel without keys is left out", result.text())

    def test_a_bad_camera_or_light_leaves_itself_out(self):
        cameras = [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}},
                   {"type": "perspective", "perspective": {"yfov": 0, "znear": 0.1}},
                   {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 0, "znear": 0, "zfar": 1}}]
        result = self.run_gltf({"cameras": cameras, "nodes": [{"mesh": 0}, *({"camera": i} for i in range(4)),
                                                              {"extensions": {"KHR_lights_punctual": {"light": 7}}}]})
        self.assert_has(result.of(SET_CAMERA), [{"fov_y": 0.7}])
        for wanted in ("cameras[1]: the camera is left out: yfov", "cameras[2]: the camera is left out: ymag",
                       "nodes[4]: the camera is left out: no camera", "nodes[5]: the light is left out: no light"):
            self.assertIn(wanted, result.text())

    def test_percent_signs_in_names_stand_for_themselves_or_for_characters(self):
        """And an image is found by its name alone, as those of other formats."""
        for name in ("10%.bin", "a b.bin", "a%20b.bin"):
            self.write(name, self.DATA)
        names = ("50%.ppm", "a%20b.ppm", "c%20d.ppm", "C:\\tex\\50%.ppm", "none%.ppm")
        for name in ("50%.ppm", "a b.ppm", "c%20d.ppm"):
            self.write(name, PPM)
        textured = {"images": [{"uri": name} for name in names], "textures": [{"source": i} for i in range(len(names))],
                    "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": i}}} for i in range(len(names))]}
        primitives = [{"attributes": {"POSITION": 0}, "material": i} for i in range(len(names))]
        for name in ("10%.bin", "a%20b.bin"):
            result = self.run_gltf(textured, primitives, folder_buffer=name)
            self.assertEqual([texture["nearest"] for texture in result.of(SET_TEXTURE)], [0, 0, 0, 0, 1], result.text())
            self.assertIn("'none%25.ppm' could not be read: No such file", result.text())

    def test_lights_in_candela_become_watts_where_all_would_be_white(self):
        blender = "Khronos glTF Blender I/O v3.6.28"
        for kind, intensity, wanted, generator in (
                ("point", 54351.4, 79.577, ""), ("point", 79.577, 79.577, blender), ("directional", 3.0, 3.0, blender),
                ("directional", 68300.0, 100.0, ""), ("directional", 68.3, 0.1, blender), ("directional", 68.3, 68.3, ""),
                ("directional", 68.3, 68.3, "Khronos glTF Blender I/O v3.3.0")):
            result = self.run_gltf({"asset": {"version": "2.0", "generator": generator},
                                    "nodes": [{"mesh": 0}, {"translation": [0, 5, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}}],
                                    "extensions": {"KHR_lights_punctual": {"lights": [{"type": kind, "intensity": intensity}]}}})
            self.assertAlmostEqual(result.of(SET_LIGHT)[0]["colour"][0], wanted, 2)
            self.assertEqual("divided by 683" in result.text(), intensity != wanted)

    def test_whole_numbers_of_colours_are_parts_of_255(self):
        result = self.run_gltf(primitives=[{"attributes": {"POSITION": 0, "COLOR_0": 2}}])
        self.assertEqual(result.data(result.of(SET_MESH)[0]["arrays"][6]), bytes((255, 51, 0, 0)) * 3)

    def test_gaussians_of_a_file_that_requires_them_are_bodies_with_a_note(self):
        rows = ((0, 0, 0, 1), (1, 2, 3), (1,), (0, 0, 0))
        names = ("ROTATION", "SCALE", "OPACITY", "SH_DEGREE_0_COEF_0")
        data = struct.pack("<14f", 5, 6, 7, *(one for row in rows for one in row))
        for space, wanted in (("srgb_rec709_display", 14027), ("lin_rec709_display", 32768)):
            model = {"asset": {"version": "2.0"}, "extensionsUsed": ["KHR_gaussian_splatting"], "extensionsRequired": ["KHR_gaussian_splatting"],
                     "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}], "buffers": [{
                         "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode("ascii"), "byteLength": len(data)}],
                     "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
                     "accessors": [{"bufferView": 0, "byteOffset": at, "componentType": 5126, "count": 1, "type": kind} for at, kind in (
                         (0, "VEC3"), (12, "VEC4"), (28, "VEC3"), (40, "SCALAR"), (44, "VEC3"))],
                     "meshes": [{"primitives": [{"mode": 0, "extensions": {"KHR_gaussian_splatting": {"kernel": "ellipse", "colorSpace": space}},
                                                 "attributes": {"POSITION": 0, **{f"KHR_gaussian_splatting:{name}": 1 + i
                                                                                  for i, name in enumerate(names)}}}]}]}
            result = self.import_text("model.gltf", json.dumps(model))
            mesh, = result.of(SET_MESH)
            places = result.floats(mesh["arrays"][0])
            halves = [(max(places[c::3]) - min(places[c::3])) / 2 for c in range(3)]
            for c in range(3):
                self.assertAlmostEqual(halves[c], (1 + c) * halves[0], 5)
            self.assertEqual(result.colours(mesh)[:4], [wanted, wanted, wanted, 65535])
            self.assertIn("3D Gaussians (3DGS) are not blended", result.text())

    def test_images_of_formats_that_are_not_read_are_named(self):
        basisu = {"KHR_texture_basisu": {"source": 1}}
        for texture, wanted in (({"source": 1}, "a KTX2 image, which is not read; convert"), ({"extensions": basisu}, "left out; convert"),
                                ({"source": 0, "extensions": basisu}, "the images that stand in for them are shown")):
            self.write("a.ppm", PPM)
            self.write("b.ktx2", b"\xabKTX 20\xbb\r\n\x1a\n" + bytes(64))
            result = self.run_gltf({"images": [{"uri": "a.ppm"}, {"uri": "b.ktx2"}], "textures": [texture],
                                    "extensionsUsed": ["KHR_texture_basisu"],
                                    "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]},
                                   [{"attributes": {"POSITION": 0}, "material": 0}])
            self.assertIn(wanted, result.text())
            self.assertEqual(len(result.notes), 2, "and that there is no scene")


class Scanned(importer.Written):
    """STL and PLY."""

    FACET = struct.pack("<12f2x", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0)

    def test_stl_files_that_stray_are_shown_or_say_why_not(self):
        """Bytes behind the facets, counts that are wrong, files that are cut, and words in other letters or none."""
        def binary(count, facets, tail=b"", head=b"solid of a program"):
            return head.ljust(80) + struct.pack("<I", count) + self.FACET * facets + tail
        corners = "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
        usual = f"solid a\nfacet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\nendsolid a\n"
        for data, triangles, said in ((binary(2, 2), 2, "^$"), (binary(2, 2, b"tail"), 2, "^$"), (binary(1, 2), 1, "^$"),
                                      (binary(2, 1, self.FACET[:30]), 1, "cut off: it states 2 facets and has 1 whole"),
                                      (binary(0, 2), 2, "states 0 facets; the 2"), (usual.encode(), 1, "^$"), (usual.upper().encode(), 1, "^$"),
                                      (f"solid a\n{corners * 2}endsolid".encode(), 2, "^$"), (binary(0, 0), 0, "without facets"),
                                      (binary(3, 0, self.FACET[:30]), 0, "states 3 facets, but is cut off"), (binary(1, 0)[:60] + b"\0", 0, "cut off within its head"),
                                      (b"solid a\nendsolid a\n", 0, "nothing that can be shown")):
            with self.subTest(data[:100]):
                result = self.import_text("model.stl", data, status=0 if triangles else 1)
                self.assertEqual(sum(mesh["triangles"] for mesh in result.of(SET_MESH)), triangles)
                self.assertRegex(result.text(), said)

    def ply(self, vertex, rows, faces="", form="ascii"):
        return (f"ply\nformat {form} 1.0\nelement vertex {len(rows)}\n" + "".join(f"property {one}\n" for one in vertex) + faces +
                "end_header\n")

    XYZ, QUAD = ["float x", "float y", "float z"], ["0 0 0", "1 0 0", "0 1 0", "1 1 0"]

    def import_ply(self, vertex, rows, faces="", face_rows=()):
        return self.import_text("model.ply", self.ply(vertex, rows, faces) + "\n".join([*rows, *face_rows]) + "\n")

    def test_ply_strips_are_triangles(self):
        strip = "element tristrips 1\nproperty list int int vertex_indices\n"
        for rows, wanted in ((["4 0 1 2 3"], 2), (["8 0 1 2 -1 0 1 2 3"], 3)):
            result = self.import_ply(self.XYZ, self.QUAD, strip, rows)
            mesh, = result.of(SET_MESH)
            self.assertEqual(mesh["triangles"], wanted)
            places = result_corners(mesh, result)
            for at in range(0, len(places), 9):
                a, b, c = (places[at + 3 * i:at + 3 * i + 2] for i in range(3))
                self.assertGreater((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]), 0, "the side that it faces")

    def test_ply_colours_are_those_of_faces_and_of_floats_up_to_255(self):
        face = "element face 2\nproperty list uchar int vertex_indices\n"
        colours = [f"property uchar {name}\n" for name in ("red", "green", "blue")]
        result = self.import_ply(self.XYZ, self.QUAD, face + "".join(colours), ["3 0 1 2 255 0 0", "3 1 3 2 0 0 255"])
        mesh, = result.of(SET_MESH)
        values = result.data(mesh["arrays"][6])
        self.assertEqual([tuple(values[4 * i:4 * i + 3]) for i in result.integers(mesh["arrays"][1])], [(255, 0, 0)] * 3 + [(0, 0, 255)] * 3)
        for full in (1, 255):
            rows = [f"{place} {full} {full / 2} 0" for place in self.QUAD]
            result = self.import_ply(self.XYZ + [f"float {name}" for name in ("red", "green", "blue")], rows, face, ["3 0 1 2", "3 1 3 2"])
            self.assertEqual(result.colours(result.of(SET_MESH)[0])[:4], [65535, 14027, 0, 65535])

    def test_gaussians_are_bodies_in_their_colours_as_large_and_turned_as_they_say(self):
        """A long red one, turned from x to y, a flat green one, and one that is too faint. The file is cut within a fourth."""
        full, none = 0.5 / 0.28209479177387814, -0.5 / 0.28209479177387814
        turned = " ".join([str(math.sqrt(0.5)), "0 0", str(math.sqrt(0.5))])
        rows = [f"5 0 0 {full} {none} {none} 20 {math.log(2)} {math.log(0.1)} {math.log(0.1)} {turned}",
                f"0 0 0 {none} {full} {none} 20 0 0 -90 1 0 0 0", "0 0 9 0 0 0 -1.5 0 0 0 1 0 0 0", "0 0 20 0 0"]
        result = self.import_ply(self.XYZ + [f"float {name}" for name in (
            "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3")], rows)
        mesh, = result.of(SET_MESH)
        self.assertEqual((mesh["vertices"], mesh["triangles"]), (12, 16))
        reach = math.sqrt(math.pi / 2) * math.sqrt(2 * math.log(5))  # to an opacity of 0.2, as wide as an ellipse of that area
        places = result.floats(mesh["arrays"][0])
        for first, middle, half in ((0, (5, 0, 0), (0.1, 2, 0.1)), (18, (0, 0, 0), (1, 1, 0))):
            for c in range(3):
                self.assertAlmostEqual(max(places[first + c:first + 18:3]), middle[c] + reach * half[c], 4)
                self.assertAlmostEqual(min(places[first + c:first + 18:3]), middle[c] - reach * half[c], 4)
        self.assertEqual(result.data(mesh["arrays"][6]), bytes((255, 0, 0, 255)) * 6 + bytes((0, 255, 0, 255)) * 6)
        self.assertRegex(result.text(), "(?s)states 4 Gaussians and has 3 whole ones.*1 of 3 are fainter")

    def test_a_cut_ply_file_shows_what_is_whole_and_says_so(self):
        face = "element face 2\nproperty list uchar int vertex_indices\n"
        for form in ("ascii", "binary_little_endian"):
            head = self.ply(self.XYZ, self.QUAD, face, form).encode()
            if form == "ascii":
                places, faces = "\n".join(self.QUAD).encode() + b"\n", (b"3 0 1 2\n", b"3 1 3 2\n")
            else:
                places = struct.pack("<12f", *(float(one) for row in self.QUAD for one in row.split()))
                faces = [struct.pack("<B3i", 3, *corners) for corners in ((0, 1, 2), (1, 3, 2))]
            for body, triangles, points, said in ((places + faces[0] + faces[1][:-2], 1, 0, "2 elements 'face' and has 1"),
                                                  (places + faces[0], 1, 0, "2 elements 'face' and has 1"),
                                                  (places[:-4], 0, 3, "4 elements 'vertex' and has 3"),
                                                  (places + faces[0] + faces[1], 2, 0, "^$")):
                with self.subTest(form, body=body):
                    result = self.import_text("model.ply", head + body)
                    self.assertEqual(sum(mesh["triangles"] for mesh in result.of(SET_MESH)), triangles)
                    self.assertEqual(sum(one["count"] for one in result.of(SET_SPHERES)), points)
                    self.assertRegex(result.text(), said)
            self.assertIn("before the end of its first vertex", self.import_text("model.ply", head + places[:3], 1).text())


class Far(importer.Written):
    """Models in the coordinates of a survey, whose details floats would lose."""

    BASE = (452340.0, 312.0, 5411190.0)

    def places(self, result):
        """Of all corners, in the scene's space, of nodes that only move."""
        nodes = {node["id"]: node for node in result.of(SET_NODE)}
        found = set()
        for node in nodes.values():
            shown = {mesh["id"]: mesh for mesh in result.of(SET_MESH if node["kind"] == 1 else SET_SPHERES)}.get(node["object"])
            if node["kind"] not in (1, 2) or not shown:
                continue
            values, width = result.floats(shown["arrays"][0]), 3 if node["kind"] == 1 else 4
            move, above = [0, 0, 0], node
            while above:
                move = [one + above["matrix"][4 * c + 3] for c, one in enumerate(move)]
                above = nodes.get(above["parent"])
            found |= {tuple(round(values[at + c] + move[c] + result.origin[c] - self.BASE[c], 4) for c in range(3))
                      for at in range(0, len(values), width)}
        return found

    DETAIL = {(0.12, 0.25, 0.38), (1.12, 0.25, 0.38), (1.12, 1.25, 0.51)}

    def rows(self):
        return [" ".join(f"{base + one:.3f}" for base, one in zip(self.BASE, place)) for place in sorted(self.DETAIL)]

    def check(self, result, wanted=None):
        self.assertEqual(self.places(result), wanted or self.DETAIL)
        self.assertLess(max(abs(node["matrix"][4 * c + 3]) for node in result.of(SET_NODE) for c in range(3)), 1000)
        self.assertRegex(result.text(), "lies 543[0-9]* m from the origin.*45234[0-2],31[23],54111[0-9]* is subtracted")

    def test_obj_and_ply_keep_what_doubles_say(self):
        self.check(self.import_text("model.obj", "".join(f"v {row}\n" for row in self.rows()) + "f 1 2 3\n"))
        self.check(self.import_text("model.obj", "".join(f"v {row}\n" for row in self.rows()) + "p 1 2 3\n"))
        head = "ply\nformat %s 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\nend_header\n"
        self.check(self.import_text("model.ply", head % "ascii" + "\n".join(self.rows()) + "\n"))
        values = [float(one) for row in self.rows() for one in row.split()]
        for form, order in (("binary_little_endian", "<"), ("binary_big_endian", ">")):
            self.check(self.import_text("model.ply", (head % form).encode() + struct.pack(order + "9d", *values)))

    def test_gltf_keeps_what_nodes_say(self):
        """Also below a root that has no place of its own, and where the positions themselves are far."""
        data = struct.pack("<9f", *(one for place in ((0, 0, 0), (1, 0, 0), (0, 1, 0)) for one in place))
        moved = {(place[0] + x, place[1] + y, place[2]) for place in ((0.12, 0.25, 0.38), (3.12, 0.25, 0.38)) for x, y in ((0, 0), (1, 0), (0, 1))}
        nodes = [{"mesh": 0, "translation": [base + one for base, one in zip(self.BASE, place)]}
                 for place in ((0.12, 0.25, 0.38), (3.12, 0.25, 0.38))]
        for more, roots in (([], [0, 1]), ([{"children": [0, 1]}], [2])):
            model = {"asset": {"version": "2.0"}, "scenes": [{"nodes": roots}], "nodes": nodes + more,
                     "buffers": [{"uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode(), "byteLength": 36}],
                     "bufferViews": [{"buffer": 0, "byteLength": 36}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
                     "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}]}
            self.check(self.import_text("model.gltf", json.dumps(model)), {tuple(round(one, 4) for one in place) for place in moved})
            # A clip that moves the root: all is moved by a node above.
            model["animations"] = [{"channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
                                    "samplers": [{"input": 1, "output": 0}]}]
            model["accessors"].append({"bufferView": 0, "componentType": 5126, "count": 3, "type": "SCALAR"})
            result = self.import_text("model.gltf", json.dumps(model))
            self.assertGreater(result.origin[2], 5411000)

    def test_a_model_around_the_origin_stays_where_it_is(self):
        result = self.import_text("model.obj", "v -9000 0 0\nv 9000 0 0\nv 0 9000 0\nf 1 2 3\n")
        self.assertEqual((result.origin, len(result.of(SET_NODE))), ((0, 0, 0), 1))


class Large(importer.Written):
    """Images beyond what textures may have are reduced, with a note."""

    WIDTH = 20480

    def test_textures_and_environments_are_reduced_to_what_can_be_shown(self):
        def chunk(kind, data):
            return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        row = b"\x00\xfe" * (self.WIDTH // 2)
        images = {"png": b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">2I5B", self.WIDTH, 3, 8, 0, 0, 0, 0)) +
                         chunk(b"IDAT", zlib.compress((b"\0" + row) * 3)) + chunk(b"IEND", b""),
                  "ppm": b"P6\n%d 3\n255\n" % self.WIDTH + bytes(one for value in row for one in (value,) * 3) * 3}
        for kind, data in images.items():
            self.write(f"w.{kind}", data)
            self.write("m.mtl", f"newmtl a\nmap_Kd w.{kind}\n")
            result = self.import_text("model.obj", "mtllib m.mtl\n" + QUAD + "usemtl a\nf 1/1 2/2 3/3\n")
            texture, = result.of(SET_TEXTURE)
            self.assertEqual((texture["width"], texture["height"]), (self.WIDTH // 2, 2))
            self.assertEqual(set(result.data(texture["arrays"][0])), {127, 255})
            self.assertIn("reduced to a half, 10240 x 2 texels", result.text())
        self.write("x.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X %d\n" % self.WIDTH + b"\x40\x40\x40\x80\xc0\xc0\xc0\x80" * self.WIDTH)
        result = importer.import_file(str(self.write("t.obj", QUAD + "f 1 2 3\n")), "--environment", str(self.folder / "x.hdr"))
        environment, = result.of(SET_ENVIRONMENT)
        self.assertEqual(environment["size"], (self.WIDTH // 2, 1))
        self.assertEqual(set(struct.unpack("<40960e", result.data(environment["arrays"][0]))[0::4]), {0.5})
        self.assertIn("x.hdr: is larger than can be shown: it is reduced to a half", result.text())

    def test_what_could_not_be_read_in_time_is_refused_with_the_limit(self):
        self.write("w.png", b"\x89PNG\r\n\x1a\n" + struct.pack(">I4s2I5B", 13, b"IHDR", 65537, 1, 8, 0, 0, 0, 0) +
                   struct.pack(">I", zlib.crc32(struct.pack(">4s2I5B", b"IHDR", 65537, 1, 8, 0, 0, 0, 0))) + struct.pack(">I4s", 0, b"IDAT") +
                   struct.pack(">I", zlib.crc32(b"IDAT")))
        self.write("m.mtl", "newmtl a\nmap_Kd w.png\n")
        self.assertIn("is 65537 x 1 texels; up to 65536 in one direction",
                      self.import_text("model.obj", "mtllib m.mtl\n" + QUAD + "usemtl a\nf 1/1 2/2 3/3\n").text())


class Bodies(importer.Written):
    def test_a_closed_body_that_absorbs_light_has_its_own_thickness(self):
        """Four volumes over the area of a box of 1 x 2 x 3; an open one keeps what the file says."""
        places = [(x, y, z) for z in (0, 3) for y in (0, 2) for x in (0, 1)]
        sides = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
        corners = [corner for a, b, c, d in sides for corner in (a, b, c, a, c, d)]
        for count, wanted in ((36, 4 * 6 / 22), (33, 7.0)):
            data = b"".join(struct.pack("<3f", *place) for place in places) + struct.pack("<36H", *corners)
            model = {"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                     "buffers": [{"uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode(), "byteLength": len(data)}],
                     "bufferViews": [{"buffer": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": 72}],
                     "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
                                   {"bufferView": 1, "componentType": 5123, "count": count, "type": "SCALAR"}],
                     "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
                     "materials": [{"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1},
                                                   "KHR_materials_volume": {"thicknessFactor": 7, "attenuationDistance": 1}}}]}
            material, = self.import_text("model.gltf", json.dumps(model)).of(SET_MATERIAL)
            self.assertAlmostEqual(material["body"][4], wanted, 5)


class Packages(importer.Written):
    """3MF."""

    def test_parts_are_found_by_the_rules_of_packages(self):
        """Relations in any quotes or none at all, names with backslashes, other letters and percent signs."""
        mesh = ('<model unit="meter"><resources>%s</resources><build><item objectid="1"%s/></build></model>')
        triangle = ('<object id="1"><mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="1" z="0"/></vertices>'
                    '<triangles><triangle v1="0" v2="1" v3="2"/></triangles></mesh></object>')
        whole, other = mesh % (triangle, ""), mesh % ("", ' p:path="/3D/a%20b.model"')
        kind = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
        for names in ({"3D/x.model": whole, "_rels/.rels": f"<R><Relationship Target='/3D/x.model' Type='{kind}'/></R>"},
                      {"3D\\3dmodel.model": whole, "_rels/.rels": f'<R><Relationship Target="/3D/3dmodel.model" Type="{kind}"/></R>'},
                      {"3D/3DModel.model": whole, "_rels/.rels": f'<R><Relationship Type = "{kind}" Target = "/3D/3dmodel.model"/></R>'},
                      {"other/only.model": whole}, {"3D/3dmodel.model": other, "3D/a b.model": whole}):
            archive = io.BytesIO()
            with zipfile.ZipFile(archive, "w") as packed:
                for name, text in names.items():
                    packed.writestr(name, text)
            result = self.import_text("model.3mf", archive.getvalue())
            self.assertEqual([one["triangles"] for one in result.of(SET_MESH)], [1], result.text())


def result_corners(mesh, result):
    places = result.floats(mesh["arrays"][0])
    return [value for corner in result.integers(mesh["arrays"][1]) for value in places[3 * corner:3 * corner + 3]]


if __name__ == "__main__":
    unittest.main(verbosity=2)
