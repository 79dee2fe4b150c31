# SPDX-License-Identifier: MIT
"""`farlight compare MODEL`: rays by two tracers wave by wave (--tracers A,B), or what is made of depth layers beside what is
rendered (--stereo ..), then the pictures; on the bundled scenes."""
import json
import math
import os
import pty
import subprocess

from farlight_test import BIN, TIMEOUT_S, Case, OneDaemon, bundled_scenes, farlight, frames_of, long_test, private_daemon, read_png

SIZE = ["--size", "48x36"]
FLAKE, ROOM = "sphereflake-2.nff", "cornell.glb"
PAIR = ["--tracers", "bvh,naive"]
EYES = ["--stereo", "0.2", "--quadtree-layers", "1", "--integrator", "whitted"]  # so far apart that one layer leaves something out


def compare(*options, model=FLAKE, tracers=PAIR, **more):
    return farlight("compare", bundled_scenes() / model, *SIZE, *tracers, *options, **more)


class Comparisons(OneDaemon):
    def report(self, *options, status=0, **more):
        return json.loads(self.expect(compare("--json", *options, **more), status).stdout)

    def test_bvh_and_brute_force_agree_on_every_ray_of_every_wave(self):
        """The same intersection code on the same numbers: nothing may differ. A private daemon gives the same counts."""
        report = self.report("--samples", "2", "--fail-above", "agree=100%", "-o", self.folder / "side.png")
        self.assertEqual((report["tracer"], report["reference"], report["within"]), ("bvh", "naive", True))
        kinds = [(w["wave"], w["kind"]) for w in report["waves"]]
        self.assertEqual(kinds[:4], [(0, "primary"), (0, "shadow"), (1, "secondary"), (1, "shadow")])
        self.assertEqual(report["waves"][0]["rays"], 48 * 36 * 2)
        for wave in report["waves"]:
            with self.subTest(wave=wave["wave"], kind=wave["kind"]):
                self.assertEqual([wave[key] for key in ("agree", "only_tracer", "only_reference", "far", "edges")], [1, 0, 0, 0, 0])
                self.assertEqual(wave["rays"], wave["both_hit"] + wave["both_missed"])
                self.assertGreater(min(wave["tracer_mrays"], wave["reference_mrays"]), 0)
                if wave["kind"] != "shadow":
                    self.assertEqual((wave["distance_max"], wave["normal_max"]), (0, 0))
        self.assertEqual(report["all"]["rays"], sum(w["rays"] for w in report["waves"]))
        self.assertTrue(report["image"]["identical"])
        self.check_side_by_side(self.folder / "side.png", report["image"], 48)
        here = self.report("--samples", "2", env=private_daemon())
        keys = ("wave", "kind", "rays", "both_hit", "both_missed")
        self.assertEqual([[wave[key] for key in keys] for wave in here["waves"]], [[wave[key] for key in keys] for wave in report["waves"]])

    def check_side_by_side(self, path, image, width):
        """The true picture, the other one and the errors; returns the rows of the first."""
        whole, height, rows, channels = read_png(path)
        self.assertEqual((whole, height), (image["picture_width"], image["picture_height"]))
        gap = (whole - 3 * width) // 2
        parts = [[row[(width + gap) * channels * i:(width * (i + 1) + gap * i) * channels] for row in rows[-36:]] for i in range(3)]
        self.assertGreater(max(map(max, parts[0])), 100)
        if image["identical"]:
            self.assertEqual(parts[0], parts[1])
            self.assertLess(max(map(max, parts[2])), 8)  # the scale's lower end is not quite black
        return parts[0], channels

    def test_the_table_names_waves_tracers_and_what_its_columns_mean(self):
        result = self.expect(compare(), 0)
        for word in ("bvh against naive", "0 primary", "0 shadow", "1 secondary", "agree %", "edges", "Mray/s",
                     "scene's diagonal", "PSNR", "SSIM"):
            self.assertIn(word, result.stdout)
        self.assertLessEqual(max(map(len, result.stdout.splitlines())), 110)
        text = self.expect(compare("--ldc-resolution", "256", tracers=["--tracers", "ldc,bvh"], model=ROOM), 0).stdout
        self.assertIn("structure static: resolution 256, cell ", text)

    @long_test
    def test_options_of_render_are_accepted_and_a_limit_decides_the_status(self):
        report = self.report("--depth", "0", "--eye", "3,3,3", "--look-at", "0,0,0", "--up", "0,0,1", "--bvh-form", "paper",
                             "--fail-above", "agree=99.99%", "--fail-above", "psnr=60")
        self.assertEqual({w["wave"] for w in report["waves"]}, {0})
        # 64 pixels are too few for SSIM, and what was not measured is within no limit.
        self.assertIn("over the limit: ssim", self.expect(compare("--size", "8x8", "--fail-above", "ssim=0.5"), 1).stdout)

    @long_test
    def test_figures_of_views_are_those_of_two_pictures_that_render_makes(self):
        for name, made, rendered in (
                ("stereo", EYES, ["--views", "rays"]),
                ("lens", ["--aperture", "0.2", "--samples", "4", "--lens", "quadtree", "--integrator", "whitted"], ["--lens", "rays"])):
            with self.subTest(name=name):
                paths, unknown = [], []
                for more in ([], rendered):
                    paths.append(self.folder / f"{len(paths)}.png")
                    result = self.expect(farlight("render", bundled_scenes() / ROOM, "-o", paths[-1], *SIZE, "--timings=json", *made, *more), 0)
                    unknown.append(frames_of(result)[0]["structure"].get("views/unknown_per_ray"))
                figures = json.loads(self.expect(farlight("compare", *paths[::-1], "--ignore-alpha", "--json"), 0).stdout)
                got = self.report(*made, "-o", self.folder / "side.png", model=ROOM, tracers=[])
                frame, = got["frames"]
                self.assertEqual((got["unknown"], frame["frame"]), (unknown[0], 0))
                for key in ("psnr", "ssim", "max", "beyond_pixels", "width", "height"):
                    self.assertEqual(frame["image"][key], figures[key], key)
                width, _, rows, channels = read_png(paths[1])
                first, _ = self.check_side_by_side(self.folder / "side.png", frame["image"], width)
                if channels == 3:
                    self.assertEqual(first[-1], rows[-1])

    @long_test
    def test_every_frame_of_a_series_is_compared(self):
        series = ["--upsample", "4", "--orbit=12", "--frames", "1-5", "--eye", "0,1,2.2", "--look-at", "0,1,0", "--integrator", "whitted"]
        got = self.report(*series, "-o", self.folder / "%d.png", model=ROOM, tracers=[])
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
        text = self.expect(compare(*series, "--fail-above", "unknown=0", model=ROOM, tracers=[]), 1).stdout
        self.assertEqual(text.count("over the limit: unknown"), sum(share > 0 for share in unknown))
        self.assertIn("all frames", text)

    def test_temporary_files_go_away(self):
        for tracers, options in ((PAIR, []), (["--tracers", "bvh,reference"], []), ([], EYES), ([], [*EYES, "--quadtree-resolution", "16"])):
            compare(*options, model=ROOM if options else FLAKE, tracers=tracers, env={**os.environ, "TMPDIR": str(self.folder)})
            self.assertEqual(self.leftovers(), [], (tracers, options))

    def test_brute_force_sees_all_or_refuses(self):
        # 38,084 triangles with glass among them are more rounds than software GL runs a shader's loop. Each ray takes
        # them all, however few rays there are.
        result = compare("--fail-above", "agree=99.99%", "--size", "8x6", model="teapot.glb")
        self.assertIn(result.returncode, (0, 2), result.stdout)
        if result.returncode == 2:
            self.assertIn("primitives", result.stderr)


class Talk(Case):
    def on_a_terminal(self, *options):
        """What a terminal shows of it (standard error alone), and the exit status."""
        ours, theirs = pty.openpty()
        with subprocess.Popen([BIN / "farlight", "compare", bundled_scenes() / FLAKE, *PAIR, *SIZE, *options], stderr=theirs,
                              stdout=subprocess.DEVNULL, env={**os.environ, "TERM": "xterm"}) as process:
            os.close(theirs)
            shown = b""
            try:
                while piece := os.read(ours, 4096):
                    shown += piece
            except OSError:  # how Linux says that the other side is closed
                pass
            os.close(ours)
            return shown.decode(), process.wait(TIMEOUT_S)

    def test_a_progress_bar_names_the_steps_and_is_erased(self):
        shown, status = self.on_a_terminal()
        self.assertEqual(status, 0, shown)
        for step in ("0 of 3: rays of bvh and naive", "1 of 3: picture of naive", "2 of 3: comparing the pictures"):
            self.assertIn(step, shown)
        self.assertTrue(shown.endswith("\r\x1b[K"), shown)
        self.assertEqual(self.on_a_terminal("--quiet"), ("", 0))

    def test_each_mistake_is_2_and_named(self):
        x_exr, stereo, series = self.folder / "x.exr", ["--stereo", "1"], ["--upsample", "2", "--frames", "1-3"]
        flake = bundled_scenes() / FLAKE
        for arguments, *words in (
                ([flake, "--tracers", "bvh"], "bvh"), ([flake, "--tracers", "bvh,magic"], "magic"),
                ([flake, "--tracers", "bvh,naive,bvh"], "a pair of tracers"), ([flake, "--tracers", ",naive"], "a pair of tracers"),
                ([flake, *PAIR, "--fail-above", "agree=101%"], "--fail-above"), ([flake, *PAIR, "--fail-above", "agree=nan"], "--fail-above"),
                ([flake, *PAIR, "--fail-above", "nothing=1"], "nothing"), ([flake, *PAIR, "--far", "0"], "--far"),
                ([flake, *PAIR, "--tracer", "bvh"], "--tracer"), ([flake, "--tracer", "bvh"], "a pair of tracers"),
                ([flake, *PAIR, "-o", x_exr], "PNG"), ([flake, *PAIR, "-o", flake / "x.png"], "folder"),
                ([flake, *PAIR, "--encoding", "jpeg"], "jpeg"), ([self.folder / "missing.glb", *PAIR], "missing.glb"),
                ([flake], "--tracers"), (PAIR, "MODEL"), (stereo, "MODEL"),
                ([flake, *stereo, "--views", "rays"], "farlight: --views: ", "use the source quadtree"),
                ([flake, "--aperture", "1", "--lens", "rays"], "farlight: --lens: ", "use the source quadtree"),
                ([flake, *stereo, "--frames", "1-3"], "farlight: --frames: ", "add --upsample"),
                ([flake, *stereo, "--orbit"], "farlight: --orbit: ", "add --upsample"),
                ([flake, "--upsample", "2"], "farlight: --frames: ", "--frames 1-120"),
                ([flake, *series, "-o", self.folder / "x.png"], "farlight: --output: ", "%04d"),
                ([flake, *series, "--time", "1"], "farlight: --time: ", "--clip-start"),
                ([flake, *stereo, "-o", x_exr], f"farlight: {x_exr}: ", ".png"),
                ([flake, *stereo, "--fail-above", "unknown=101%"], "farlight: --fail-above: "),
                ([flake, *stereo, "--shutter", "0.5"], "farlight: --shutter: ", "leave it out")):
            with self.subTest(arguments=arguments):
                result = self.expect(farlight("compare", *arguments), 2)
                for word in words:
                    self.assertIn(word, result.stderr)
        self.assertEqual(self.leftovers(), [])


if __name__ == "__main__":
    import unittest
    unittest.main()
