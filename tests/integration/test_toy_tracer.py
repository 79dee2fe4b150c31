# SPDX-License-Identifier: MIT
"""What it takes to add a tracer: tests/tracers/toy, which is one folder of C, one of shaders, its rows of tracers.def
and its row of the contract suite. The product is built with it, and the command line, shot files, the viewer, help and
completion know it."""
import json
import os
import pathlib
import shutil
import subprocess
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
RELEASE = pathlib.Path(os.environ.get("FARLIGHT_BIN", ROOT / "build" / "release")).resolve()
TOY = RELEASE.parent / f"{RELEASE.name}-toy"
os.environ["FARLIGHT_BIN"] = str(TOY)  # what farlight_test runs; each module of tests is a process of its own

from farlight_test import Case, bundled_scenes, farlight, long_test, read_png, LONG  # pylint: disable=wrong-import-position

FOLDER = "tests/tracers/toy"
TARGETS = ("farlightd", "farlight", "farlight-import", "farlight-export", "farlight-video", "farlight-view",
           "shot.schema.json", "tests/tracers/test_contract")
ADDED = {"tracers.def", "tracer.c", "row.c", "shaders/toy/traverse.glsl"}
PICTURE = ("--size", "64x48", "--samples", "1", "--primary", "trace", "-q")


def setUpModule():
    """A copy of the build of which only what reads the table of the tracers is compiled again."""
    if not LONG:
        return  # the class is skipped
    shutil.rmtree(TOY, ignore_errors=True)
    shutil.copytree(RELEASE, TOY, symlinks=True, ignore=shutil.ignore_patterns("out", "corpus", "unit", "bench", "*.json"))
    (TOY / "tests/tools").mkdir(parents=True, exist_ok=True)
    for depends in TOY.rglob("*.d"):
        if "protocol/tracers.def" in depends.read_text():
            depends.with_suffix(".o").unlink(missing_ok=True)
            depends.with_suffix(".opp").unlink(missing_ok=True)
    for name in ("shader_sources.c", "shader_sources.o", *TARGETS):
        (TOY / name).unlink(missing_ok=True)
    subprocess.run(["make", "-s", f"-j{os.cpu_count()}", f"B={TOY.relative_to(ROOT)}", f"config={RELEASE.name}", f"EXTRA_TRACER={FOLDER}",
                    *(f"{TOY.relative_to(ROOT)}/{target}" for target in TARGETS)], cwd=ROOT, check=True)


@long_test
class AddedTracer(Case):
    def test_it_is_four_files(self):
        folder = ROOT / FOLDER
        self.assertEqual({str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}, ADDED)

    def test_help_and_completion_know_it_and_its_settings(self):
        listed = farlight("tracers").stdout
        for part in ("toy: every primitive of every instance", "--toy-batch", "--toy-order", "backward"):
            self.assertIn(part, listed)
        self.assertIn("--toy-batch", farlight("render", "--help").stdout)
        self.assertIn("toy", farlight("complete", "--tracer").stdout.split())
        self.assertEqual(set(farlight("complete", "--toy-order").stdout.split()), {"forward", "backward"})

    def test_the_command_line_chooses_it(self):
        pictures = []
        for name, options in (("toy", ("--toy-batch", "256", "--toy-order", "backward")), ("bvh", ())):
            path = self.folder / f"{name}.png"
            self.expect(farlight("render", bundled_scenes() / "teapot.glb", *PICTURE, "--tracer", name, *options, "-o", path),
                        0)
            pictures.append(read_png(path))
        self.assertEqual(*pictures)
        refused = farlight("render", bundled_scenes() / "teapot.glb", *PICTURE, "--tracer", "toy", "--toy-batch", "7", "-o",
                           self.folder / "refused.png")
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("192", refused.stderr)

    def test_a_shot_file_chooses_it(self):
        shot = {"model": str(bundled_scenes() / "teapot.glb"), "frames": "1-1", "size": [64, 48], "samples": 1,
                "primary": "trace", "tracer": "toy", "toy_batch": 256, "toy_order": "backward",
                "output": str(self.folder / "%04d.png")}
        (self.folder / "shot.json").write_text(json.dumps(shot))
        self.expect(farlight("animate", "--script", self.folder / "shot.json", "-q"), 0)
        self.assertTrue((self.folder / "0001.png").exists())
        self.assertIn("toy_batch", (TOY / "shot.schema.json").read_text())

    def test_a_key_of_the_viewer_chooses_it(self):
        events = [{"wait": "rest", "samples": 1}, {"state": "before"}, {"key": "t"}, {"wait": "rest", "samples": 1},
                  {"state": "after"}]
        (self.folder / "replay.json").write_text(json.dumps(events))
        result = farlight("view", bundled_scenes() / "teapot.glb", "--replay", self.folder / "replay.json", "--headless",
                          "--size", "64x48", "--samples", "1", "--tracer", "quadtree")
        self.expect(result, 0)
        states = {state["state"]: state for state in map(json.loads, result.stdout.splitlines())}
        self.assertEqual({name: state["tracer"] for name, state in states.items()}, {"before": "quadtree", "after": "toy"})
        self.assertEqual(states["after"]["settings"], {"toy_batch": "4096", "toy_order": "forward"})
        self.assertRegex(states["after"]["structure"][0], r"^instances looked at \d+$")

    def test_it_keeps_what_every_tracer_promises(self):
        result = subprocess.run([TOY / "tests/tracers/test_contract", "toy"], stdout=subprocess.PIPE, text=True, check=False)
        self.assertEqual(result.returncode, 0, result.stdout)
        self.assertGreater(result.stdout.count("[       OK ] toy: "), 20)


if __name__ == "__main__":
    unittest.main()
