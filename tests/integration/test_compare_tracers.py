# SPDX-License-Identifier: MIT
"""`farlight compare MODEL --tracers A,B`: rays compared wave by wave, then the pictures, on the bundled scenes."""
import json
import os
import pty
import subprocess

from farlight_test import BIN, TIMEOUT_S, Case, OneDaemon, bundled_scenes, farlight, private_daemon, read_png

SIZE = ["--size", "80x60"]
FLAKE = "sphereflake-2.nff"


def compare(*arguments, model=FLAKE, tracers="bvh,naive", **options):
    return farlight("compare", bundled_scenes() / model, "--tracers", tracers, *SIZE, *arguments, **options)


class Rays(OneDaemon):
    def test_bvh_and_brute_force_agree_on_every_ray_of_every_wave(self):
        result = self.expect(compare("--json", "--samples", "2", "--fail-above", "agree=100%"), 0)
        report = json.loads(result.stdout)
        self.assertEqual((report["tracer"], report["reference"], report["within"]), ("bvh", "naive", True))
        kinds = [(w["wave"], w["kind"]) for w in report["waves"]]
        self.assertEqual(kinds[:4], [(0, "primary"), (0, "shadow"), (1, "secondary"), (1, "shadow")])
        self.assertEqual(report["waves"][0]["rays"], 80 * 60 * 2)
        for wave in report["waves"]:
            with self.subTest(wave=wave["wave"], kind=wave["kind"]):
                # The same intersection code on the same numbers: nothing may differ.
                self.assertEqual(wave["agree"], 1)
                self.assertEqual(wave["only_tracer"] + wave["only_reference"] + wave["far"] + wave["edges"], 0)
                self.assertEqual(wave["rays"], wave["both_hit"] + wave["both_missed"])
                self.assertGreater(wave["tracer_mrays"], 0)
                self.assertGreater(wave["reference_mrays"], 0)
                if wave["kind"] != "shadow":
                    self.assertEqual((wave["distance_max"], wave["normal_max"]), (0, 0))
        self.assertEqual(report["all"]["rays"], sum(w["rays"] for w in report["waves"]))
        self.assertTrue(report["image"]["identical"])

    def test_bvh_agrees_with_the_reference(self):
        """Triangles, spheres, mirrors and glass. 99.99 % of the rays that are on no edge, as issue 3 asks; half of all
        distances within 1e-6 of their length: a few roundings of the 24 bits of a float. The last waves have a dozen
        rays, between spheres that touch, and short distances, beside which zink's roundings of where they begin are larger."""
        for model in ("teapot.glb", FLAKE):
            with self.subTest(model=model):
                result = compare("--json", "--fail-above", "agree=99.99%", "--fail-above", "psnr=40", model=model,
                                 tracers="bvh,reference")
                if "libembree-dev" in result.stderr:
                    self.assertEqual(result.returncode, 2)
                    self.skipTest("this farlightd was built without Embree")
                report = json.loads(self.expect(result, 0).stdout)
                self.assertEqual((report["tracer"], report["reference"], report["within"]), ("bvh", "reference", True))
                self.assertGreaterEqual(report["all"]["agree"], 0.9999)
                self.assertIn("secondary", {wave["kind"] for wave in report["waves"]})
                self.assertGreater(report["waves"][0]["both_hit"], 0)
                for wave in report["waves"]:
                    self.assertLessEqual(wave["edges"], wave["only_tracer"] + wave["only_reference"] + wave["far"])
                    on_other_stack = "FARLIGHT_TEST_STACK" in os.environ
                    if wave["kind"] != "shadow":
                        self.assertLess(wave["relative_median"], 1e-5 if on_other_stack and wave["rays"] < 100 else 1e-6)

    def test_the_table_names_waves_tracers_and_what_its_columns_mean(self):
        result = self.expect(compare(), 0)
        for word in ("bvh against naive", "0 primary", "0 shadow", "1 secondary", "agree %", "edges", "Mray/s",
                     "scene's diagonal", "PSNR", "SSIM"):
            self.assertIn(word, result.stdout)
        self.assertLessEqual(max(map(len, result.stdout.splitlines())), 110)

    def test_a_private_daemon_gives_the_same_counts(self):
        there = json.loads(self.expect(compare("--json"), 0).stdout)
        here = json.loads(self.expect(compare("--json", env=private_daemon()), 0).stdout)
        for a, b in zip(there["waves"], here["waves"]):
            self.assertEqual([a[k] for k in ("wave", "kind", "rays", "both_hit", "both_missed")],
                             [b[k] for k in ("wave", "kind", "rays", "both_hit", "both_missed")])

    def test_options_of_render_are_accepted(self):
        result = self.expect(compare("--depth", "0", "--eye", "3,3,3", "--look-at", "0,0,0", "--up", "0,0,1", "--json"), 0)
        self.assertEqual({w["wave"] for w in json.loads(result.stdout)["waves"]}, {0})


class Talk(Case):
    def compare_on_a_terminal(self, *options):
        """What a terminal shows of it (standard error alone), and the exit status."""
        ours, theirs = pty.openpty()
        with subprocess.Popen([BIN / "farlight", "compare", bundled_scenes() / FLAKE, "--tracers", "bvh,naive", *SIZE,
                               *options], stdout=subprocess.DEVNULL, stderr=theirs,
                              env={**os.environ, "TERM": "xterm"}) as process:
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
        shown, status = self.compare_on_a_terminal()
        self.assertEqual(status, 0, shown)
        for step in ("0 of 3: rays of bvh and naive", "1 of 3: picture of naive", "2 of 3: comparing the pictures"):
            self.assertIn(step, shown)
        self.assertTrue(shown.endswith("\r\x1b[K"), shown)
        self.assertEqual(self.compare_on_a_terminal("--quiet"), ("", 0))


class Picture(OneDaemon):
    def test_the_reference_the_tracer_and_the_errors_stand_side_by_side(self):
        path = self.folder / "side.png"
        report = json.loads(self.expect(compare("-o", path, "--json"), 0).stdout)
        width, height, rows, channels = read_png(path)
        self.assertEqual((width, height), (report["image"]["picture_width"], report["image"]["picture_height"]))
        self.assertGreaterEqual(width, 3 * 80)
        self.assertGreaterEqual(height, 60)
        # Both pictures are there and the same, and the errors are black.
        gap = (width - 3 * 80) // 2
        for y in range(height - 60, height):
            parts = [rows[y][(80 + gap) * channels * i:(80 * (i + 1) + gap * i) * channels] for i in range(3)]
            self.assertEqual(parts[0], parts[1])
            self.assertLess(max(parts[2]), 8)  # the scale's lower end is not quite black
        self.assertGreater(max(rows[height - 5]), 100)
        self.assertEqual(self.leftovers(), ["side.png"])

    def test_temporary_files_go_away(self):
        here = private_daemon(TMPDIR=str(self.folder))
        for arguments, status in (([], 0), (["--tracers", "bvh,reference"], None)):
            result = subprocess.run([BIN / "farlight", "compare", bundled_scenes() / FLAKE, "--tracers", "bvh,naive",
                                     *SIZE, *arguments], env=here, capture_output=True, check=False, timeout=TIMEOUT_S)
            if status is not None:
                self.assertEqual(result.returncode, status, result.stderr)
            self.assertEqual(self.leftovers(), [])


class Limits(OneDaemon):
    def test_one_beyond_a_limit_is_1_and_said(self):
        for bounds in ("box", "sphere"):
            self.expect(compare("--bvh-bounds", bounds, "--fail-above", "agree=99.99%", "--fail-above", "psnr=60"), 0)
        # Nothing agrees to 1.5 of 1: not a limit. SSIM cannot pass 1, and 64 pixels are too few for it.
        result = self.expect(farlight("compare", bundled_scenes() / FLAKE, "--tracers", "bvh,naive", "--size", "8x8",
                                      "--fail-above", "ssim=0.5"), 1)
        self.assertIn("over the limit: ssim", result.stdout)

    def test_each_mistake_is_2_and_named(self):
        cases = ((["--tracers", "bvh"], "bvh"), (["--tracers", "bvh,magic"], "magic"),
                 (["--tracers", "bvh,naive,bvh"], "a pair of tracers"), (["--tracers", ",naive"], "a pair of tracers"),
                 (["--tracers", "bvh,naive", "--fail-above", "agree=101%"], "--fail-above"),
                 (["--tracers", "bvh,naive", "--fail-above", "agree=nan"], "--fail-above"),
                 (["--tracers", "bvh,naive", "--fail-above", "nothing=1"], "nothing"),
                 (["--tracers", "bvh,naive", "--far", "0"], "--far"),
                 (["--tracers", "bvh,naive", "--tracer", "bvh"], "--tracer"), (["--tracer", "bvh"], "a pair of tracers"),
                 (["--tracers", "bvh,naive", "-o", self.folder / "x.exr"], "PNG"),
                 (["--tracers", "bvh,naive", "-o", bundled_scenes() / FLAKE / "x.png"], "folder"),
                 (["--tracers", "bvh,naive", "--encoding", "jpeg"], "jpeg"))
        for arguments, word in cases:
            with self.subTest(arguments=arguments):
                result = self.expect(farlight("compare", bundled_scenes() / FLAKE, *SIZE, *arguments), 2)
                self.assertIn(word, result.stderr)
        self.assertIn("missing.glb", self.expect(farlight("compare", self.folder / "missing.glb", "--tracers",
                                                          "bvh,naive"), 2).stderr)
        self.assertIn("--tracers", self.expect(farlight("compare", bundled_scenes() / FLAKE), 2).stderr)
        self.assertIn("MODEL", self.expect(farlight("compare", "--tracers", "bvh,naive"), 2).stderr)
        self.assertEqual(self.leftovers(), [])

    def test_brute_force_sees_all_or_refuses(self):
        # 38,084 triangles with glass among them are more rounds than software GL runs a shader's loop. Each ray takes
        # them all, however few rays there are.
        result = compare("--fail-above", "agree=99.99%", "--size", "16x12", model="teapot.glb")
        self.assertIn(result.returncode, (0, 2), result.stdout)
        if result.returncode == 2:
            self.assertIn("primitives", result.stderr)
