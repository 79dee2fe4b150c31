# SPDX-License-Identifier: MIT
"""What a picture is made of: several models in a scene, a model from standard input, files that change; and contact
sheets of whole folders."""
import json
import os
import signal
import subprocess
import unittest

from farlight_test import BIN, OneDaemon, bundled_scenes, farlight, read_png

# A square of one metre about the origin that faces the camera, and shines by itself.
SQUARE = ("mtllib square.mtl\no square\nv -.5 -.5 0\nv .5 -.5 0\nv .5 .5 0\nv -.5 .5 0\nusemtl paint\nf 1 2 3\nf 1 3 4\n")
PAINT = "newmtl paint\nKd 0 0 0\nKe {} {} {}\n"
# Four metres high at the origin: 16 pixels a metre.
FRONT = ("--eye", "0,0,10", "--look-at", "0,0,0", "--fov", "22.6199", "--size", "128x64", "--background", "transparent",
         "--integrator", "whitted", "--filter", "box", "--tone-map", "none")


def colour(path, x_m, y_m):
    """Of a picture by FRONT, where that place of the plane z = 0 is: the strongest of red, green and blue, a mirror of the sky
    aside; None: nothing is there."""
    _, _, rows, channels = read_png(path)
    x, y = int(64 + 16 * x_m), int(32 - 16 * y_m)
    *seen, alpha = rows[y][x * channels:(x + 1) * channels]
    return ("red", "green", "blue")[seen.index(max(seen))] if alpha == 255 else None


class Inputs(OneDaemon):
    def setUp(self):
        super().setUp()
        self.square = self.folder / "square.obj"
        self.square.write_text(SQUARE)
        (self.folder / "square.mtl").write_text(PAINT.format(1, 0, 0))
        self.picture = self.folder / "picture.png"

    # ---- several models -----------------------------------------------------------------------------

    def test_models_are_where_their_places_say(self):
        other = self.folder / "other.obj"
        other.write_text(SQUARE.replace("square.mtl", "other.mtl"))
        (self.folder / "other.mtl").write_text(PAINT.format(0, 1, 0))
        self.expect(farlight("render", self.square, other, "--at", "2,0,0", other, "--at", "-2,0,0:0,0,45", "--at",
                             "-2,1.5,0::0.5", "-o", self.picture, *FRONT), 0)
        self.assertEqual(colour(self.picture, 0.4, 0.4), "red")
        self.assertEqual(colour(self.picture, 2.4, 0.4), "green")
        self.assertEqual(colour(self.picture, -2, 0), "green")
        self.assertIsNone(colour(self.picture, -1.6, 0.4), "a square on its corner has no corner there")
        self.assertIsNotNone(colour(self.picture, -1.4, 0), "but here")
        self.assertEqual(colour(self.picture, -2, 1.5), "green")
        self.assertIsNone(colour(self.picture, -1.6, 1.5), "half a metre reaches a quarter")

    def test_rotations_are_about_x_then_y_then_z(self):
        # Of a square that turns by 60 degrees half is left. About y, it is narrow; then about z by 90 degrees, it is low, and
        # in the other order it were narrow still. About x and then y, (x, y) is seen at (x / 2 + y * 3 / 4, y / 2); in the
        # other order nothing would be seen beyond x = 0.25.
        for degrees, seen, empty in (("0,60,90", (0.4, 0), (0, 0.4)), ("60,60,0", (0.4, 0.15), (-0.4, 0.15)),
                                     ("60,0,0", (0.4, 0), (0, 0.4))):
            with self.subTest(degrees=degrees):
                self.expect(farlight("render", self.square, "--at", f"0,0,0:{degrees}", "-o", self.picture, *FRONT), 0)
                self.assertIsNotNone(colour(self.picture, *seen))
                self.assertIsNone(colour(self.picture, *empty))

    def test_names_stay_distinct_and_one_file_is_sent_once(self):
        def sent(*more):
            result = self.expect(farlight("render", self.square, *more, "-o", self.picture, "--timings=json", *FRONT), 0)
            return json.loads(result.stdout.splitlines()[-1])["offered_bytes"]

        self.assertEqual(sent(), sent("--at", "1,0,0", "--at", "-1,0,0"))
        result = self.expect(farlight("render", self.square, "--at", "1,0,0", "--at", "-1,0,0", "--frame", "x", "-o",
                                      self.picture), 2)
        for name in ("'square'", "'square/square.obj'", "'square-2'", "'square-2/square.obj'"):
            self.assertIn(name, result.stderr)
        self.expect(farlight("render", self.square, "--at", "1,0,0", "--at", "-1,0,0", "--frame", "square-2", "-o",
                             self.picture, "--size", "64x64"), 0)

    def test_each_of_two_models_has_its_clips(self):
        carousel = bundled_scenes() / "carousel.glb"
        result = self.expect(farlight("render", carousel, carousel, "--at", "9,0,0", "--clip", "x", "-o", self.picture), 2)
        self.assertIn("'carousel/ride'", result.stderr)
        self.expect(farlight("render", carousel, carousel, "--at", "9,0,0", "--clip", "carousel-2/ride", "--time", "1",
                             "-o", self.picture, "--size", "64x64"), 0)

    # ---- standard input and output ------------------------------------------------------------------

    def test_a_model_from_standard_input_looks_as_from_its_file(self):
        stl = self.folder / "square.stl"
        stl.write_text("solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\nendloop\n"
                       "endfacet\nendsolid s\n")
        for path, more in ((bundled_scenes() / "teapot.glb", ()), (bundled_scenes() / "sphereflake-2.nff", ()), (stl, ()),
                           (self.square, ("--format", "obj")), (bundled_scenes() / "teapot.glb", ("--format", "glb"))):
            with self.subTest(model=path.name, more=more):
                wanted = self.expect(farlight("render", path, "-o", "-", "--size", "64x48", text=False), 0)
                with open(path, "rb") as model:
                    got = self.expect(farlight("render", "-", *more, "-o", "-", "--size", "64x48", text=False,
                                               stdin=model), 0)
                (self.folder / "wanted.png").write_bytes(wanted.stdout)
                (self.folder / "got.png").write_bytes(got.stdout)
                if path != self.square:  # whose paint lies beside it
                    self.assertEqual(read_png(self.folder / "got.png"), read_png(self.folder / "wanted.png"))

    def test_what_cannot_be_read_from_standard_input_is_said(self):
        result = self.expect(farlight("info", "-", input=SQUARE), 0)
        self.assertRegex(result.stdout, "triangles +2")
        for typed, arguments, status, part in (
                (b"", ("-",), 1, "is empty"), (b"hello", ("-",), 1, "first bytes"),
                (b"hello", ("-", "--format", "pmg"), 1, "known are .gltf"),
                (b"", ("-", "-"), 2, "only once"), (b"", (self.square, "--format", "pmg"), 2, "unknown format 'pmg'"),
                (b"", ("--at", "1,2,3", self.square), 2, "no model is named before it"),
                (b"", (self.square, "--at", "1,2"), 2, "X,Y,Z:RX,RY,RZ:SCALE"),
                (b"", (self.square, "--at", "1,2,3:0,0,0:0"), 2, "--at"),
                (b"", ("-", "--watch"), 2, "standard input")):
            with self.subTest(arguments=arguments):
                result = farlight("render", *arguments, "-o", self.picture, text=False, input=typed)
                self.expect(result, status)
                self.assertIn(part, result.stderr.decode())
        self.assertFalse(self.picture.exists())

    def test_a_video_goes_to_standard_output(self):
        result = self.expect(farlight("animate", self.square, "--frames", "1-3", "-o", "-", "--format", "mkv", "--size",
                                      "64x64", text=False), 0)
        self.assertEqual(result.stdout[:4], b"\x1a\x45\xdf\xa3")
        result = self.expect(farlight("animate", self.square, "--frames", "1-3", "-o", "-", "--format", "png"), 2)
        self.assertIn("cannot go to standard output", result.stderr)

    # ---- contact sheets -----------------------------------------------------------------------------

    def test_a_sheet_shows_what_can_be_read_and_says_what_cannot(self):
        (self.folder / "sub").mkdir()
        (self.folder / "sub/broken.glb").write_bytes(b"glTF is no model")
        (self.folder / "notes.txt").write_text("no model")
        sheet = self.folder / "sheet.png"
        result = self.expect(farlight("thumbnail", self.folder, "-o", sheet, "--size", "96x64", "--columns", "2", "--view",
                                      "front", "--background", "transparent"), 1)
        self.assertIn("broken.glb", result.stderr)
        self.assertIn("1 of 2 models could not be shown", result.stderr)
        width, height, rows, channels = read_png(sheet)
        # Two cells of 96 x 64 with a gap of 8 about each, and a line of 22 pixels for the names.
        self.assertEqual((width, height), (8 + 2 * 104, 8 + 64 + 22 + 8))
        middle = rows[8 + 32][(8 + 48) * channels:][:3]
        self.assertGreater(middle[0], 200)
        self.assertLess(middle[2], 100)
        for left, top, lines in ((8, 72, 22), (112, 72, 22), (112, 8, 64)):  # two names, and why one is missing
            box = [row[left * channels:(left + 96) * channels] for row in rows[top:top + lines]]
            self.assertGreater(max(map(max, (row[0::channels] for row in box))), 180, (left, top))

    def test_a_folder_gets_a_picture_for_each_model(self):
        out = self.folder / "out"
        teapot = bundled_scenes() / "teapot.glb"
        self.expect(farlight("thumbnail", self.square, teapot, "-o", f"{out}/", "--size", "32x32"), 0)
        self.assertEqual(sorted(path.name for path in out.iterdir()), ["square.obj.png", "teapot.glb.png"])
        self.assertEqual(read_png(out / "teapot.glb.png")[:2], (32, 32))

    def test_a_model_whose_name_is_not_utf_8_does_not_stop_the_others(self):
        folder = self.folder / "names"
        folder.mkdir()
        for name in (b"a\xff.obj", b"b.obj"):
            with open(os.path.join(os.fsencode(folder), name), "wb") as file:
                file.write(self.square.read_bytes())
        result = self.expect(farlight("thumbnail", folder, "-o", f"{self.folder}/out/", "--size", "16x16"), 1)
        self.assertIn("is not UTF-8; rename it", result.stderr)
        self.assertEqual([path.name for path in (self.folder / "out").iterdir()], ["b.obj.png"])

    def test_endings_of_models_are_those_that_the_importer_knows(self):
        unknown = self.folder / "model.xyz"
        unknown.write_text("?")
        known = farlight("info", unknown).stderr.split("known are ")[1].replace(" and ", ", ").split(", ")
        (self.folder / "all").mkdir()
        for ending in known:
            (self.folder / f"all/a{ending.strip()}").write_text("")
        result = self.expect(farlight("thumbnail", self.folder / "all", "-o", f"{self.folder}/out/", "--size", "16x16"), 1)
        self.assertIn(f"{len(known)} of {len(known)} models", result.stderr)

    # ---- files that change --------------------------------------------------------------------------

    def wait_for(self, process, part):
        for line in process.stderr:
            if part in line:
                return line
        self.fail(f"it ended with {process.wait()} without '{part}'")

    def replace(self, path, text):
        """As editors do: another file is given the name."""
        new = path.with_suffix(".new")
        new.write_text(text)
        new.rename(path)

    def scene_and_builds(self):
        """The revision of the one scene that there is, and how many steps building structures has taken."""
        result = self.expect(farlight("stats", "--json"), 0)
        stats = json.loads(result.stdout)
        scene, = stats["scenes"]
        return scene["revision"], sum(stage["count"] for stage in stats["stages"] if stage["stage"] == "build")

    def test_a_picture_follows_the_files_of_its_model(self):
        paint = self.folder / "square.mtl"
        process = subprocess.Popen([BIN / "farlight", "render", self.square, "--watch", "-o", self.picture, *FRONT],
                                   stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        self.wait_for(process, "watching 2 files")
        self.assertEqual(colour(self.picture, 0, 0), "red")
        before = self.scene_and_builds()
        self.replace(paint, PAINT.format(0, 0, 1))
        line = self.wait_for(process, "is new")
        self.assertEqual(colour(self.picture, 0, 0), "blue")
        self.assertIn("sent 0.000 of", line, "the square is the same: no blob is sent")
        revision, steps = self.scene_and_builds()
        self.assertEqual(revision, before[0] + 1, "the same scene")
        self.assertLess(steps - before[1], before[1] / 2, "its structure is kept: a step finds that it is up to date")
        self.square.write_text("v 1 2 3\nf 1 2 99\n")
        self.wait_for(process, "vertex 2 does not exist")
        self.assertEqual(colour(self.picture, 0, 0), "blue", "the last good one stays")
        self.square.write_text(SQUARE.replace(".5", ".25"))
        self.wait_for(process, "is new")
        self.assertIsNone(colour(self.picture, 0.4, 0.4))
        self.assertIsNotNone(colour(self.picture, 0.2, 0.2))
        for text, revision in ((SQUARE.replace("f 1 3", "usemtl nothing\nf 1 3"), before[0] + 3), (SQUARE, before[0] + 4)):
            self.square.write_text(text)
            self.wait_for(process, "is new")
            self.assertEqual(self.scene_and_builds()[0], revision, "what is gone, the default material, is removed")
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(), 0)
        self.assertEqual(self.leftovers(), ["picture.png", "square.mtl", "square.obj"])


if __name__ == "__main__":
    unittest.main()
