# SPDX-License-Identifier: MIT
"""Cameras without coordinates: the side that a model is seen from, and how near."""
import json
import math

from farlight_test import OneDaemon, bundled_scenes, exr_attributes, farlight, read_png

COLOURS = {"front": (1, 0, 0), "back": (0, 1, 0), "left": (0, 0, 1), "right": (1, 1, 0), "top": (0, 1, 1), "bottom": (1, 0, 1)}
# x -2 .. 2, y 0 .. 1, z -0.5 .. 0.5: each side has its colour.
CORNERS = [(x, y, z) for x in (-2, 2) for y in (0, 1) for z in (-0.5, 0.5)]
SIDES = {"front": (2, 6, 8, 4), "back": (5, 7, 3, 1), "left": (1, 2, 4, 3), "right": (6, 5, 7, 8), "top": (3, 4, 8, 7),
         "bottom": (1, 5, 6, 2)}


class Sides(OneDaemon):
    def setUp(self):
        super().setUp()
        (self.folder / "box.mtl").write_text("".join(
            f"newmtl {name}\nKd {' '.join(str(c) for c in colour)}\n" for name, colour in COLOURS.items()))
        self.box = self.folder / "box.obj"
        self.box.write_text("mtllib box.mtl\no box\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS) + "".join(
            f"usemtl {name}\nf {' '.join(str(i) for i in corners)}\n" for name, corners in SIDES.items()))

    def render(self, *options, size="96x54", model=None):
        path = self.folder / "x.png"
        self.expect(farlight("render", model or self.box, "-o", path, "--size", size, "--background", "transparent", *options), 0)
        _, _, rows, channels = read_png(path)
        self.assertEqual(channels, 4)
        return [[row[x:x + 4] for x in range(0, len(row), 4)] for row in rows]

    def covered(self, picture):
        """The first and last column and row that show something."""
        rows = [y for y, row in enumerate(picture) if any(p[3] > 127 for p in row)]
        columns = [x for x in range(len(picture[0])) if any(row[x][3] > 127 for row in picture)]
        return columns[0], columns[-1], rows[0], rows[-1]

    def test_places_of_the_camera_are_those_of_a_model_far_from_the_origin(self):
        """By options, keys and a shot; half a metre is lost in floats there."""
        far = self.folder / "far.obj"
        base = (452340.0, 312.0, 5411190.0)
        far.write_text("mtllib box.mtl\n" + "".join(f"v {' '.join(str(a + b) for a, b in zip(base, corner))}\n" for corner in CORNERS) +
                       "".join(f"usemtl {name}\nf {' '.join(str(i) for i in corners)}\n" for name, corners in SIDES.items()))

        def places(origin, *all_places):
            return [[round(a + b, 3) for a, b in zip(origin, place)] for place in all_places]
        made = []
        # The middle of the box is 0, 0.5, 0, which is rounded to whole metres.
        for model, origin in ((self.box, (0, 0, 0)), (far, base)):
            eye, target, other = places(origin, (3.125, 2.25, 6.375), (0.25, 0.5, 0), (-3, 2, 6))
            texts = [",".join(map(str, one)) for one in (eye, target)]
            keys, shot = self.folder / "keys.json", self.folder / "shot.json"
            keys.write_text(json.dumps([{"time": i, "eye": one, "look_at": target} for i, one in enumerate((eye, other))]))
            shot.write_text(json.dumps({"model": model.name, "frames": "1-2", "camera": {"eye": eye, "look_at": target, "dolly": {"to": other}}}))
            pictures = [self.render(f"--eye={texts[0]}", f"--look-at={texts[1]}", model=model, size="48x27")]
            for options in ((model, "--keys", keys, "--frames", "1-2"), ("--script", shot)):
                self.expect(farlight("animate", *options, "-o", self.folder / "f-%d.png", "--size", "48x27", "--samples", "4"), 0)
                pictures += [read_png(self.folder / f"f-{i}.png") for i in (1, 2)]
            made.append(pictures)
        self.assertEqual(made[0][0], made[1][0])
        self.expect(farlight("render", far, "-o", self.folder / "x.exr", "--size", "8x8", "--samples", "1"), 0)
        self.assertIn(b"452340,313,5411190", exr_attributes(self.folder / "x.exr")["farlight/origin"])
        # Places of keys and shots are floats, which are half a metre apart there.
        for near, away in zip(made[0][1:], made[1][1:]):
            self.assertLess(sum(a != b for a, b in zip(b"".join(near[2]), b"".join(away[2]))), len(near[2]) * len(near[2][0]) // 2)

    def test_each_side_is_the_one_that_it_is_called(self):
        for name, colour in COLOURS.items():
            with self.subTest(view=name):
                picture = self.render("--view", name)
                pixel = picture[27][48]
                self.assertEqual([value > max(pixel[:3]) / 2 for value in pixel[:3]], [bool(c) for c in colour], pixel)
        self.assertEqual(self.render("--azimuth", "90", "--elevation", "0"), self.render("--view", "right"))

    def test_the_model_fills_the_picture_less_the_margin(self):
        """Four by one from the front: it touches left and right; and above and below where the picture is a strip. A box's
        front face is its nearest part, so nothing else reaches as far. Half a pixel is rounded."""
        for margin in (0.0, 0.1):
            options = ["--view", "front", "--margin", str(margin)]
            left, right, _, _ = self.covered(self.render(*options))
            self.assertAlmostEqual(left, 96 * margin, delta=1)
            self.assertAlmostEqual(95 - right, 96 * margin, delta=1)
            _, _, top, bottom = self.covered(self.render(*options, size="320x40"))
            self.assertAlmostEqual(top, 40 * margin, delta=1)
            self.assertAlmostEqual(39 - bottom, 40 * margin, delta=1)

    def test_a_round_model_is_framed_by_its_vertices(self):
        """A ball off the middle of its space, whose bounds would leave a third of the height free. A share of 0.01 is 2 pixels, of
        which rounding takes a half."""
        path, rings = self.folder / "ball.nff", range(24)
        places = [[(3 + math.sin(a) * math.cos(b), 2 + math.cos(a), math.sin(a) * math.sin(b)) for b in (math.tau * k / 48 for k in range(49))]
                  for a in (math.pi * i / 24 for i in range(25))]
        path.write_text("".join("p 4\n" + "".join("%r %r %r\n" % place for place in (places[i][k], places[i + 1][k], places[i + 1][k + 1],
                                                                                  places[i][k + 1])) for i in rings for k in range(48)))
        for options, margin in (([], 0.03), (["--azimuth", "70", "--elevation", "40", "--margin", "0.1"], 0.1)):
            left, right, top, bottom = self.covered(self.render(*options, size="300x200", model=path))
            self.assertAlmostEqual(top / 200, margin, delta=0.01)
            self.assertAlmostEqual((199 - bottom) / 200, margin, delta=0.01)
            self.assertAlmostEqual(left, 299 - right, delta=2, msg="it is in the middle")

    def test_info_says_its_camera_as_options(self):
        box = self.folder / "box.obj"
        for word in ("seen by", "azimuth 24"):
            self.assertIn(word, self.expect(farlight("info", box), 0).stdout)
        done = self.expect(farlight("info", box, "--camera", "--json"), 0)
        camera = json.loads(done.stdout)["camera"]
        options = [f"--{name}=" + ",".join(map(str, camera[key])) for name, key in (("eye", "eye"), ("look-at", "target"), ("up", "up"))]
        line = next(line for line in self.expect(farlight("info", box, "--camera"), 0).stdout.splitlines() if "camera  " in line)
        same, usual = self.render(*line.split()[1:], size="160x90"), self.render(size="160x90")
        self.assertEqual(same, self.render(*options, "--fov", str(camera["fov_degrees"]), size="160x90"))
        apart = sum(a != b for row, other in zip(same, usual) for a, b in zip(row, other))
        self.assertLess(apart, 160, "as coordinates are rounded, less than a pixel of a row at silhouettes")

    def test_another_field_of_view_and_a_zoom_keep_the_middle(self):
        for fov in ("10", "90"):
            left, right, _, _ = self.covered(self.render("--view", "front", "--fov", fov, "--margin", "0"))
            self.assertAlmostEqual(left, 0, delta=1)
            self.assertAlmostEqual(right, 95, delta=1)
        left, right, _, _ = self.covered(self.render("--view", "front", "--margin", "0", "--zoom", "0.5"))
        self.assertAlmostEqual(left, 24, delta=1)
        self.assertAlmostEqual(right, 71, delta=1)

    def test_a_node_is_framed_with_what_is_below_it(self):
        """A pot of copper on an arm of the roundabout, 1.4 m wide beside a floor of 80. It covers a fifth of the picture; half of
        that is red, as it mirrors a blue sky, too, and of a picture of everything it is not a pixel."""
        def red_share(*options):
            path = self.folder / "x.png"
            self.expect(farlight("render", bundled_scenes() / "carousel.glb", "-o", path, "--size", "64x36", *options), 0)
            _, _, rows, channels = read_png(path)
            pixels = [row[x:x + 3] for row in rows for x in range(0, len(row), channels)]
            return sum(p[0] > 1.3 * p[2] + 10 for p in pixels) / len(pixels)
        self.assertGreater(red_share("--frame", "copper pot"), 0.05)
        self.assertLess(red_share("--azimuth", "24"), 0.01)

    def test_what_contradicts_itself_is_refused_with_a_remedy(self):
        for options, words in ((["--view", "sideways"], "front, back, left"), (["--frame", "lid"], "box.obj"),
                               (["--view", "top", "--eye", "1,2,3", "--look-at", "0,0,0"], "cannot be combined with"),
                               (["--zoom", "2", "--camera", "0"], "cannot be combined with"), (["--margin", "0.6"], "0.45")):
            with self.subTest(options=options):
                result = farlight("render", self.box, "-o", self.folder / "x.png", *options)
                self.assertNotEqual(result.returncode, 0)
                self.assertIn(words, result.stderr)

    def test_a_turntable_goes_once_around_and_repeats(self):
        """The colours of the sides come one after the other, and what follows the last frame is the first."""
        out = self.folder / "frames"
        out.mkdir()
        self.expect(farlight("turntable", self.box, "-o", out / "%02d.png", "--size", "48x27", "--fps", "2", "--azimuth", "0",
                             "--elevation", "0"), 0)
        names = sorted(path.name for path in out.iterdir())
        self.assertEqual(names, [f"{i:02d}.png" for i in range(1, 9)], "4 seconds")
        seen = [read_png(out / name)[2][13] for name in names]
        middle = [[value > max(row[24 * 3:24 * 3 + 3]) / 2 for value in row[24 * 3:24 * 3 + 3]] for row in seen]
        for frame, side in ((0, "front"), (2, "right"), (4, "back"), (6, "left")):
            self.assertEqual(middle[frame], [bool(c) for c in COLOURS[side]], (frame, side))
        self.assertNotEqual(seen[7], seen[0])
