#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Models as exporters write them that stray from their format, or use corners of it that few readers know: each is shown as its
author meant it, or a note names what is left out and why."""
import unittest

import importer
from importer import SET_MATERIAL, SET_MESH, SET_SPHERES, SET_TEXTURE

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


def result_corners(mesh, result):
    places = result.floats(mesh["arrays"][0])
    return [value for corner in result.integers(mesh["arrays"][1]) for value in places[3 * corner:3 * corner + 3]]


if __name__ == "__main__":
    unittest.main(verbosity=2)
