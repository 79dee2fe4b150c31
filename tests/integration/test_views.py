# SPDX-License-Identifier: MIT
"""Several views in one picture: each is what a picture from that eye alone shows, to the byte."""
import json

from farlight_test import OneDaemon, bundled_scenes, farlight, read_exr, read_png

WIDTH, HEIGHT = 40, 28
# Along the axes of the world, and sums that floats hold: the eyes of views are exactly those of the single pictures.
EYE, LOOK_AT, APART = (0.25, 1.0, 3.5), (0.25, 1.0, 0.0), 0.25
SHARP = ["--integrator", "whitted"]
NOISY = ["--denoise=off", "--integrator", "distributed", "--samples", "3", "--aperture", "0.125", "--focus", "3"]


def place(point, across, up):
    return ",".join(map(repr, (point[0] + across, point[1] + up, point[2])))


class Views(OneDaemon):
    def render(self, name, *options, across=0.0, up=0.0, status=0):
        path = self.folder / name
        result = self.expect(farlight("render", bundled_scenes() / "cornell.glb", "-o", path, "--size",
                                      f"{WIDTH}x{HEIGHT}", "--primary", "trace", "--eye", place(EYE, across, up),
                                      "--look-at", place(LOOK_AT, across, up), *options), status)
        return path if status == 0 else result

    def part(self, path, i, j):
        _, _, rows, channels = read_png(path)
        return [bytes(row[i * WIDTH * channels:(i + 1) * WIDTH * channels])
                for row in rows[j * HEIGHT:(j + 1) * HEIGHT]]

    def expect_eye(self, picture, i, j, across, up, options):
        single = self.render("single.png", *options, across=across, up=up)
        self.assertEqual(self.part(picture, i, j), self.part(single, 0, 0), f"view {i},{j}")

    def test_two_views_are_two_pictures_beside_each_other(self):
        for options in (SHARP, [*SHARP, "--tracer", "rayspace"]):
            with self.subTest(options=options):
                pair = self.render("pair.png", "--stereo", APART, "--views", "rays", *options)
                self.assertEqual(read_png(pair)[:2], (2 * WIDTH, HEIGHT))
                for i in range(2):
                    self.expect_eye(pair, i, 0, (i - 0.5) * APART, 0, options)
                self.assertNotEqual(self.part(pair, 0, 0), self.part(pair, 1, 0))

    def test_two_views_are_filtered_each_by_itself(self):
        options = [*NOISY, "--denoise"]
        pair = self.render("pair.png", "--stereo", APART, *options)
        self.assertNotEqual(self.part(pair, 0, 0), self.part(self.render("noisy.png", "--stereo", APART, "--views", "rays", *NOISY), 0, 0))
        for i in range(2):
            self.expect_eye(pair, i, 0, (i - 0.5) * APART, 0, options)

    def test_the_left_view_may_lie_above_the_other_or_in_a_file_of_its_own(self):
        over, *files = (self.folder / name for name in ("over.png", "pair-left.png", "pair-right.png"))
        for name, layout in (("over.png", "over"), ("pair.png", "files")):
            self.render(name, "--stereo", APART, "--stereo-layout", layout, "--views", "rays", *SHARP)
        self.assertEqual(self.leftovers(), ["over.png", "pair-left.png", "pair-right.png"])
        self.assertEqual(read_png(over)[:2], (WIDTH, 2 * HEIGHT))
        for eye, path in enumerate(files):
            self.assertEqual(read_png(path)[:2], (WIDTH, HEIGHT))
            self.expect_eye(over, 0, eye, (eye - 0.5) * APART, 0, SHARP)
            self.assertEqual(self.part(path, 0, 0), self.part(over, 0, eye))
        refused = farlight("render", bundled_scenes() / "cornell.glb", "-o", "-", "--stereo", "0.1",
                           "--stereo-layout", "files")
        self.assertIn("--stereo-layout: standard output is a single file", self.expect(refused, 2).stderr)

    def test_a_light_field_has_the_views_of_a_grid_of_eyes(self):
        field = self.render("field.png", "--light-field", "3x2", "--baseline", APART, "--views", "rays", *NOISY)
        self.assertEqual(read_png(field)[:2], (3 * WIDTH, 2 * HEIGHT))
        for j in range(2):
            for i in range(3):
                self.expect_eye(field, i, j, (i - 1) * APART, (0.5 - j) * APART, NOISY)

    def test_layers_are_those_of_each_view(self):
        layers = [*SHARP, "--float", "--layers", "beauty,albedo,normal,depth,position,id"]
        width, _, pair = read_exr(self.render("pair.exr", "--stereo", APART, "--views", "rays", *layers))
        self.assertEqual(width, 2 * WIDTH)
        for i in range(2):
            _, _, single = read_exr(self.render("single.exr", *layers, across=(i - 0.5) * APART))
            for name, values in single.items():
                got = [value for y in range(HEIGHT)
                       for value in pair[name][y * width + i * WIDTH:y * width + (i + 1) * WIDTH]]
                # What is measured from the camera's eye is rounded otherwise than from the view's.
                error = max(abs(a - b) for a, b in zip(got, values))
                self.assertLessEqual(error, 2e-6 if name == "Z" else 0, name)

    def test_frames_of_a_series_are_found_again(self):
        script = self.folder / "shot.json"
        script.write_text(json.dumps({
            "model": str(bundled_scenes() / "cornell.glb"), "frames": "1-2", "size": [WIDTH, HEIGHT],
            "light_field": [2, 2], "baseline": 0.1, "views": "rays", "output": "%d.png"}))
        self.expect(farlight("animate", "--script", script), 0)
        again = self.expect(farlight("animate", "--script", script, "--resume"), 0)
        self.assertIn("2 of 2 frames exist already", again.stderr)
        self.assertEqual(read_png(self.folder / "2.png")[:2], (2 * WIDTH, 2 * HEIGHT))

    def test_what_cannot_be_is_refused_with_its_option_and_a_remedy(self):
        for options, field, remedy in (
                (["--stereo", "0"], "--stereo", "such as 0.065"),
                (["--stereo", "1", "--light-field", "2x2"], "--stereo", "leave out one"),
                (["--stereo-layout", "over"], "--stereo-layout", "add --stereo"),
                (["--stereo", "1", "--stereo-layout", "under"], "--stereo-layout", "known: side, over, files"),
                (["--light-field", "3x3"], "--light-field", "add --baseline"),
                (["--light-field", "65x1", "--baseline", "1"], "--light-field", "to 64x64"),
                (["--light-field", "1x1", "--baseline", "1"], "--light-field", "from 2x1"),
                (["--baseline", "1"], "--baseline", "add --light-field"),
                (["--views", "rays"], "--views", "add --stereo"),
                (["--stereo", "1", "--views", "layers"], "--views", "known: rays, quadtree"),
                (["--lens", "quadtree"], "--lens", "add --aperture"),
                (["--stereo", "1", "--aperture", "1", "--views", "rays", "--lens", "quadtree"], "--lens",
                 "leave out one"),
                (["--stereo", "1", "--shutter", "0.5"], "--shutter", "--views rays"),
                (["--stereo", "1", "--denoise", "--views", "quadtree"], "--denoise", "--views rays"),
                (["--aperture", "1", "--denoise", "--lens", "quadtree"], "--denoise", "--lens rays")):
            with self.subTest(options=options):
                result = self.render("x.png", *options, status=2)
                self.assertTrue(result.stderr.startswith(f"farlight: {field}: "), result.stderr)
                self.assertIn(remedy, result.stderr)
        refused = self.render("x.png", "--light-field", "64x1", "--baseline", "1", "--size", "400x10", "--views",
                              "rays", status=1)
        self.assertIn("render.views_across: 64 x 1 views of 400 x 10 pixels are 25600 x 10", refused.stderr)
        self.assertIn("ask for fewer or smaller views", refused.stderr)
        animation = farlight("animate", bundled_scenes() / "cornell.glb", "--frames", "1-9:3", "-o",
                             self.folder / "%d.png", "--upsample", "32")
        self.assertIn("--upsample: every 32-th of every 3-th frame", self.expect(animation, 2).stderr)
        animation = farlight("animate", bundled_scenes() / "cornell.glb", "--frames", "7", "-o", self.folder / "%d.png",
                             "--upsample", "4")
        self.assertIn("--upsample: a single frame is rendered", self.expect(animation, 2).stderr)
        self.assertEqual(self.leftovers(), [])
