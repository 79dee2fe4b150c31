# SPDX-License-Identifier: MIT
"""`farlight compare MODEL --stereo ..`: what is made of depth layers beside what is rendered, on the bundled scenes."""
import json
import math
import subprocess

from farlight_test import BIN, TIMEOUT_S, OneDaemon, bundled_scenes, farlight, frames_of, private_daemon, read_png

ROOM = "cornell.glb"
SMALL = ["--size", "48x36", "--integrator", "whitted"]
INSIDE = ["--eye", "0,1,2.2", "--look-at", "0,1,0"]
EYES = ["--stereo", "0.2", "--quadtree-layers", "1"]  # far enough apart for one layer to leave something out


class CompareViews(OneDaemon):
    def compare(self, *options, status=0):
        result = farlight("compare", bundled_scenes() / ROOM, *SMALL, "--json", *options)
        return json.loads(self.expect(result, status).stdout)

    def render(self, name, *options):
        """Where the picture is, and the share of it that no layer shows."""
        path = self.folder / name
        result = self.expect(farlight("render", bundled_scenes() / ROOM, "--samples", "1", "-o", path, *SMALL, "--timings=json", *options), 0)
        return path, frames_of(result)[0]["structure"].get("views/unknown_per_ray")

    def test_the_figures_are_those_of_two_pictures_that_render_makes(self):
        for name, made, rendered in (
                ("stereo", EYES, [*EYES, "--views", "rays"]),
                ("field", ["--light-field", "3x2", "--baseline", "0.1"],
                 ["--light-field", "3x2", "--baseline", "0.1", "--views", "rays"]),
                ("lens", ["--aperture", "0.2", "--samples", "4", "--lens", "quadtree"],
                 ["--aperture", "0.2", "--samples", "4"])):
            with self.subTest(name=name):
                picture, unknown = self.render("made.png", *made)
                true, _ = self.render("true.png", *rendered)
                figures = json.loads(self.expect(farlight("compare", true, picture, "--ignore-alpha", "--json"), 0).stdout)
                got = self.compare(*made)
                self.assertEqual(got["unknown"], unknown)
                self.assertEqual([frame["frame"] for frame in got["frames"]], [0])
                image = got["frames"][0]["image"]
                self.assertEqual({key: image[key] for key in ("psnr", "ssim", "max", "beyond_pixels", "width", "height")},
                                 {key: figures[key] for key in ("psnr", "ssim", "max", "beyond_pixels", "width", "height")})
                self.assertAlmostEqual(got["psnr"], figures["psnr"], 6)

    def test_every_frame_of_a_series_is_compared(self):
        orbit = ["--orbit=12", "--frames", "1-5", *INSIDE]
        got = self.compare("--upsample", "4", *orbit, "-o", self.folder / "%d.png")
        self.assertEqual([frame["frame"] for frame in got["frames"]], [1, 2, 3, 4, 5])
        self.assertEqual(self.leftovers(), [f"{frame}.png" for frame in range(1, 6)])
        # Frames 1 and 5 are the keys, made of their own layers; the others are seen from elsewhere.
        unknown = [frame["unknown"] for frame in got["frames"]]
        self.assertEqual((unknown[0], unknown[4]), (0, 0))
        self.assertGreater(max(unknown[1:4]), 0)
        self.assertAlmostEqual(got["unknown"], sum(unknown) / 5, 9)
        quality = [frame["image"]["psnr"] or math.inf for frame in got["frames"]]  # null: no error
        self.assertTrue(min(quality[0], quality[4]) > max(quality[1:4]), quality)
        self.assertTrue(min(quality) < got["psnr"] < max(quality))
        # A limit holds for each frame, and the text names those that are beyond it.
        self.compare("--upsample", "4", *orbit, "--fail-above", f"unknown={max(unknown)}")
        self.compare("--upsample", "4", *orbit, "--fail-above", f"psnr={(min(quality) + got['psnr']) / 2}", status=1)
        text = self.expect(farlight("compare", bundled_scenes() / ROOM, *SMALL, "--upsample", "4", *orbit, "--fail-above",
                                    "unknown=0"), 1).stdout
        self.assertEqual(text.count("over the limit: unknown"), sum(share > 0 for share in unknown))
        self.assertIn("all frames", text)

    def test_the_true_picture_the_made_one_and_the_errors_stand_side_by_side(self):
        path = self.folder / "side.png"
        image = self.compare(*EYES, "-o", path)["frames"][0]["image"]
        width, height, rows, channels = read_png(path)
        self.assertEqual((width, height), (image["picture_width"], image["picture_height"]))
        true, _ = self.render("true.png", *EYES, "--views", "rays")
        _, _, true_rows, true_channels = read_png(true)
        first = [rows[height - 1][x * channels:x * channels + 3] for x in range(96)]
        self.assertEqual(first, [true_rows[35][x * true_channels:x * true_channels + 3] for x in range(96)])

    def test_temporary_files_go_away(self):
        here = private_daemon(TMPDIR=str(self.folder))
        for options, status in ((EYES, 0), (["--upsample", "2", "--frames", "1-3"], 0),
                                ([*EYES, "--quadtree-resolution", "16"], None)):
            result = subprocess.run([BIN / "farlight", "compare", bundled_scenes() / ROOM, *SMALL, *options], env=here,
                                    capture_output=True, check=False, timeout=TIMEOUT_S)
            if status is not None:
                self.assertEqual(result.returncode, status, result.stderr)
            self.assertEqual(self.leftovers(), [])

    def test_each_mistake_is_2_and_named(self):
        series = ["--upsample", "2", "--frames", "1-3"]
        for options, field, remedy in (
                (["--stereo", "1", "--views", "rays"], "--views", "use the source quadtree"),
                (["--aperture", "1", "--lens", "rays"], "--lens", "use the source quadtree"),
                (["--stereo", "1", "--frames", "1-3"], "--frames", "add --upsample"),
                (["--stereo", "1", "--orbit"], "--orbit", "add --upsample"),
                (["--upsample", "2"], "--frames", "--frames 1-120"),
                ([*series, "-o", self.folder / "x.png"], "--output", "%04d"),
                ([*series, "--time", "1"], "--time", "--clip-start"),
                (["--stereo", "1", "-o", self.folder / "x.exr"], str(self.folder / "x.exr"), ".png"),
                (["--stereo", "1", "--fail-above", "unknown=101%"], "--fail-above", ""),
                (["--stereo", "1", "--shutter", "0.5"], "--shutter", "leave it out")):
            with self.subTest(options=options):
                result = self.expect(farlight("compare", bundled_scenes() / ROOM, *SMALL, *options), 2)
                self.assertTrue(result.stderr.startswith(f"farlight: {field}: "), result.stderr)
                self.assertIn(remedy, result.stderr)
        self.assertIn("MODEL", self.expect(farlight("compare", "--stereo", "1"), 2).stderr)
        self.assertEqual(self.leftovers(), [])


if __name__ == "__main__":
    import unittest
    unittest.main()
