# SPDX-License-Identifier: MIT
"""The benchmark itself, on the smallest scenes: that each part runs and writes sound JSON, that its sections of the README are
replaced, that the curves are drawn, and that it says what is met."""
import contextlib
import json
import math
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from farlight_test import BIN, ROOT, TIMEOUT_S, long_test

BENCH = ROOT / "tests" / "bench"
sys.path.insert(0, str(BENCH))
import bench as driver  # noqa: E402  pylint: disable=wrong-import-position
import bench_common  # noqa: E402  pylint: disable=wrong-import-position
import bench_plot  # noqa: E402  pylint: disable=wrong-import-position
import bench_rays  # noqa: E402  pylint: disable=wrong-import-position
import bench_readme  # noqa: E402  pylint: disable=wrong-import-position
import bench_wanted  # noqa: E402  pylint: disable=wrong-import-position

ENVIRONMENT = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}


def setUpModule():
    if not (BIN / "tests/bench/bench").is_file():
        raise unittest.SkipTest("make tests-all builds the benchmark: left to make test-all")


def figures(value):
    """All of them, however deep."""
    if isinstance(value, dict):
        if "median" in value and "runs" in value:
            yield value
        value = list(value.values())
    for part in value if isinstance(value, list) else ():
        yield from figures(part)


def children(process):
    """Of a program that runs: number -> name."""
    found = {}
    with contextlib.suppress(OSError):  # one may end meanwhile
        for number in pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split():
            found[number] = pathlib.Path(f"/proc/{number}/comm").read_text().strip()
    return found


class OnAGpu(unittest.TestCase):
    @long_test
    def test_what_is_packed_runs_and_keeps_all_that_was_printed(self):
        folder = tempfile.mkdtemp(prefix="farlight-bench-gpu-")
        self.addCleanup(shutil.rmtree, folder)
        subprocess.run([sys.executable, BENCH / "bench_gpu.py", "pack", BIN, folder + "/packed"], env=ENVIRONMENT, check=True)
        subprocess.run([sys.executable, folder + "/packed/bench_gpu.py", "run", "--software", "--out", folder + "/measured"],
                       env=ENVIRONMENT, timeout=TIMEOUT_S, check=True)
        table = pathlib.Path(folder, "measured.txt").read_text()
        self.assertNotIn("failed", table.replace("failed checks", ""))
        for row in "bvh-links", "bvh-eight alone", "ldc", "abuffer", "quadtree", "rayspace", "whitted, 16", "path, 1":
            self.assertRegex(table, rf"(?m)^{row} +[\d.]+ ")
        self.assertLess(len(table.splitlines()), 60)
        self.assertGreater(pathlib.Path(folder, "measured.tar.gz").stat().st_size, 1000)


class Figures(unittest.TestCase):
    def test_a_power_law_is_found_with_its_error_and_two_points_have_no_fit(self):
        slope, error = bench_common.fit_exponent([(n, 3 * n ** 0.25) for n in (1000, 2000, 4000, 8000)])
        self.assertAlmostEqual(slope, 0.25, places=9)
        self.assertAlmostEqual(error, 0, places=9)
        self.assertGreater(bench_common.fit_exponent([(1, 1), (2, 4), (4, 5)])[1], 0.1)
        self.assertIsNone(bench_common.fit_exponent([(1, 1), (2, 4)]))

    def test_what_slows_both_of_two_that_take_turns_leaves_their_ratio(self):
        ratio = bench_common.paired_ratio([10, 40, 10], [5, 20, 5])
        self.assertEqual((ratio["median"], ratio["deviation"]), (2, 0))

    def test_runs_there_and_back_are_put_together(self):
        def result(*times):
            return {"structures": [{"build": {"runs_ns": list(times)}}],
                    "waves": [{"rays": 1000, "measures": [{"time": {"runs_ns": list(times)}}]}]}
        joined = result(10, 20, 30)
        bench_rays.join(joined, result(40, 50))
        measure = joined["waves"][0]["measures"][0]
        self.assertEqual((measure["time"]["median_ns"], measure["time"]["max_ns"]), (30, 50))
        self.assertEqual(joined["structures"][0]["build"]["runs_ns"], [10, 20, 30, 40, 50])
        self.assertAlmostEqual(measure["rays_per_s"] * 30e-9, 1000)

    def test_a_miss_within_two_deviations_differs_from_one_beyond(self):
        for median, deviation, at_most, verdict in ((0.8, 0.1, False, "met"), (0.7, 0.1, True, "met"),
                                                    (0.7, 0.06, False, "missed, within the spread"), (0.7, 0.04, False, "MISSED"),
                                                    (0.9, 0.04, True, "MISSED")):
            row = bench_wanted.row("line", 0.8, {"median": median, "deviation": deviation}, "", at_most)
            self.assertEqual(bench_wanted.verdict(row), verdict, (median, deviation, at_most))


@long_test
class Benchmark(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.out = pathlib.Path(tempfile.mkdtemp(prefix="farlight-bench-"))
        cls.result = subprocess.run([sys.executable, BENCH / "bench.py", BIN, "--tiny", "--runs", "1", "--out", cls.out],
                                    stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False, timeout=3 * TIMEOUT_S,
                                    cwd=ROOT, env=ENVIRONMENT)
        cls.document = driver.load(cls.out / "bench.json") or {"environment": {}, "parts": {}}

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.out, ignore_errors=True)

    def test_a_tiny_run_of_all_parts_succeeds_and_says_where_it_was_measured(self):
        self.assertEqual(self.result.returncode, 0, self.result.stderr[-2000:])
        self.assertEqual(self.result.stdout.split()[-2:], [str(self.out / "bench.txt"), str(self.out / "bench.json")])
        self.assertEqual(set(self.document["parts"]), {*driver.PARTS, "wanted"})
        for key in ("date", "commit", "processor", "processors", "device", "vendor", "version", "software"):
            self.assertIn(key, self.document["environment"])

    def test_figures_are_of_one_run_and_each_part_has_some(self):
        for name, data in self.document["parts"].items():
            found = list(figures(data))
            self.assertTrue(found or "runs_ns" in json.dumps(data) or "frame_ns" in json.dumps(data) or data["left_out"], name)
            for figure in found:
                self.assertTrue(math.isfinite(figure["median"]), (name, figure))
                self.assertLessEqual(figure["min"], figure["median"], name)
                self.assertLessEqual(figure["median"], figure["max"], name)

    def test_tracers_agree_with_the_reference(self):
        results = [r for part in ("tracers", "family", "pixels", "rays") for r in self.document["parts"][part]["results"]]
        self.assertEqual(len(results), 10)
        for result in results:
            self.assertGreater(result["triangles"], 0)
            self.assertIn("bvh", {s["tracer"] for s in result["structures"]})
            for wave, measure in ((wave, measure) for wave in result["waves"] for measure in wave["measures"]):
                self.assertGreater(measure["rays_per_s"], 0)
                self.assertFalse(measure.get("agreement", {}).get("failed"), (result["title"], wave["kind"], measure))

    def test_papers_have_their_tables(self):
        parts = self.document["parts"]
        self.assertEqual([row["spheres"] for row in parts["flake"]["results"]], [91, 820, 7381])
        still, figure = parts["ldc"]["results"]
        self.assertEqual([form["structure"].get("static/resolution") for form in still["forms"]], [32, 64, None])
        self.assertIn("dynamic/resolution", figure["forms"][0]["structure"])
        self.assertEqual({form["structure"].get("resolution") for form in parts["abuffer"]["results"][0]["forms"]}, {64, None})
        joint, flat, _ = parts["rayspace"]["tests"][0]["forms"]
        self.assertLess(joint["structure"]["secondary/cone_tests_per_ray"], flat["structure"]["secondary/cone_tests_per_ray"])
        quadtree = parts["quadtree"]
        for result in (*quadtree["builds"], quadtree["stereo"], quadtree["lens"], *quadtree["reflections"]):
            for form in result["forms"]:
                is_made = form["name"].partition(",")[0] not in ("rendered", "bvh")
                self.assertEqual("faces" in form["structure"], is_made, form["name"])
        forms = {form["name"]: form["primary_rays"] for form in parts["distributed"]["forms"]}
        self.assertEqual(forms["and motion"], 16 * forms["whitted, 1 sample"])

    def test_what_is_wanted_stands_in_the_text(self):
        text = (self.out / "bench.txt").read_text()
        for title, *_ in driver.PARTS.values():
            self.assertIn(f"## {title}\n", text)
        for row in self.document["parts"]["wanted"]["rows"]:
            self.assertFalse(row["met"] and row["within_spread"], row)
            self.assertIn(row["line"], text)

    def test_sections_of_the_readme_are_replaced_and_others_stay(self):
        path = self.out / "README.md"
        before = bench_readme.PATH.read_text()
        path.write_text(before)
        parts = [("flake", "Time against spheres", "a table"), ("new", "New", "another")]
        bench_readme.write(self.document["environment"], parts, path)
        after = path.read_text()
        begin, end = (before.index(marker) for marker in bench_readme.markers("flake"))
        self.assertEqual(after[:begin], before[:begin])
        self.assertIn(before[end:].rstrip(), after)
        self.assertIn(f"at {self.document['environment']['commit']}", after[begin:])
        self.assertEqual((after.count("a table"), after.count(bench_readme.markers("flake")[0])), (1, 1))
        self.assertTrue(after.endswith(bench_readme.markers("new")[1] + "\n"))

    @unittest.skipUnless(shutil.which("gnuplot"), "gnuplot is not installed")
    def test_the_curves_are_drawn(self):
        paths = bench_plot.draw(self.document, self.out)
        self.assertEqual(len(paths), 8)
        for path in paths:
            start = path.read_bytes()[:200]
            self.assertTrue(start.startswith(b"\x89PNG") or b"<svg" in start, path)

    def test_a_part_that_is_not_there_is_a_usage_error(self):
        result = subprocess.run([sys.executable, BENCH / "bench.py", BIN, "speed"], stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True, check=False, timeout=TIMEOUT_S, cwd=ROOT)
        self.assertEqual(result.returncode, 2)
        self.assertIn("speed", result.stderr)

    def test_a_run_that_is_ended_leaves_no_daemon(self):
        with tempfile.TemporaryDirectory(prefix="farlight-bench-") as out, subprocess.Popen(
                [sys.executable, BENCH / "bench.py", BIN, "frames", "--tiny", "--out", out], stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL, cwd=ROOT, env=ENVIRONMENT) as bench:
            daemon, end = None, time.monotonic() + TIMEOUT_S
            while not daemon and bench.poll() is None and time.monotonic() < end:
                daemon = next((number for number, name in children(bench).items() if name == "farlightd"), None)
                time.sleep(0.01)
            self.assertTrue(daemon)
            bench.terminate()
            self.assertEqual(bench.wait(TIMEOUT_S), 128 + signal.SIGTERM)
            self.assertFalse(pathlib.Path(f"/proc/{daemon}").exists())
