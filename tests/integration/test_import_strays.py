#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Models as exporters write them that stray from their format, or use corners of it that few readers know: each is shown as its
author meant it, or a note names what is left out and why."""
import base64
import json
import struct
import unittest

import importer
from importer import SET_CAMERA, SET_LIGHT, SET_MATERIAL, SET_MESH, SET_SPHERES, SET_TEXTURE

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

    def import_text(self, *arguments, **options):
        self.last = super().import_text(*arguments, **options)
        return self.last

    def test_colours_of_vertices_are_srgb(self):
        result = self.import_text("model.obj", "v 0 0 0 0.5 0.5 0.5\nv 1 0 0 1 1 1\nv 1 1 0 0 0 0\nf 1 2 3\n")
        colours = result.data(result.of(SET_MESH)[0]["arrays"][6])
        self.assertEqual(list(colours), [55, 55, 55, 255, 255, 255, 255, 255, 0, 0, 0, 255])

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
        self.assertIn("lines cannot be shown", self.import_text("model.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n", 1).text())


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

    def test_a_bad_camera_or_light_leaves_itself_out(self):
        cameras = [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}},
                   {"type": "perspective", "perspective": {"yfov": 0, "znear": 0.1}},
                   {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 0, "znear": 0, "zfar": 1}}]
        result = self.run_gltf({"cameras": cameras, "nodes": [{"mesh": 0}, *({"camera": i} for i in range(4)),
                                                              {"extensions": {"KHR_lights_punctual": {"light": 7}}}]})
        self.assert_has(result.of(SET_CAMERA), [{"fov_y": 0.7}])
        for wanted in ("cameras[1]: the camera is left out: yfov", "cameras[2]: the camera is left out: ymag",
                       "nodes[4]: the camera is left out: there is no", "nodes[5]: the light is left out: there is no"):
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
        for kind, intensity, wanted in (("point", 54351.4, 79.577), ("point", 79.577, 79.577), ("directional", 3.0, 3.0),
                                        ("directional", 68300.0, 100.0)):
            result = self.run_gltf({"nodes": [{"mesh": 0}, {"translation": [0, 5, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}}],
                                    "extensions": {"KHR_lights_punctual": {"lights": [{"type": kind, "intensity": intensity}]}}})
            self.assertAlmostEqual(result.of(SET_LIGHT)[0]["colour"][0], wanted, 2)
            self.assertEqual("divided by 683" in result.text(), intensity != wanted)

    def test_whole_numbers_of_colours_are_parts_of_255(self):
        result = self.run_gltf(primitives=[{"attributes": {"POSITION": 0, "COLOR_0": 2}}])
        self.assertEqual(result.data(result.of(SET_MESH)[0]["arrays"][6]), bytes((255, 51, 0, 0)) * 3)

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


def result_corners(mesh, result):
    places = result.floats(mesh["arrays"][0])
    return [value for corner in result.integers(mesh["arrays"][1]) for value in places[3 * corner:3 * corner + 3]]


if __name__ == "__main__":
    unittest.main(verbosity=2)
