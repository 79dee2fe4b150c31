# SPDX-License-Identifier: MIT
"""The tracer `rayspace` as a person meets it: what a frame says of its waves."""
import json
import unittest

import farlight_test
from farlight_test import bundled_scenes, farlight

PICTURE = ("--size", "64x48", "--tracer", "rayspace")
ROWS = ("cone_tests_per_ray", "triangle_tests_per_ray", "waves", "sorted", "turned", "pairs_max", "passes", "halvings")


class Rayspace(farlight_test.Case):
    def frame(self, *options):
        result = farlight("render", bundled_scenes() / "teapot.glb", *PICTURE, *options, "--timings=json", "-o",
                          self.folder / "picture.png")
        self.expect(result, 0)
        return next(line for line in map(json.loads, result.stdout.splitlines()) if line["kind"] == "frame")

    def test_a_frame_says_what_each_kind_of_wave_has_cost(self):
        for mode in ("joint", "flat"):
            with self.subTest(mode=mode):
                said = self.frame("--primary", "trace", "--rayspace-mode", mode)["structure"]
                for kind in ("primary", "secondary", "shadow"):
                    self.assertTrue(all(f"{kind}/{row}" in said for row in ROWS), said)
                    self.assertGreater(said[f"{kind}/cone_tests_per_ray"], 1)
                    self.assertGreater(said[f"{kind}/passes"], said[f"{kind}/waves"])
        said = self.frame("--primary", "raster")["structure"]
        self.assertEqual({name.split("/")[0] for name in said if "/" in name}, {"secondary", "shadow"})

    def test_it_says_how_many_waves_were_sorted_or_turned_round(self):
        for turn in ("on", "off"):
            with self.subTest(turn=turn):
                said = self.frame("--rayspace-turn", turn, "--rayspace-sort", turn)["structure"]
                wanted = said["shadow/waves"] if turn == "on" else 0
                self.assertEqual((said["shadow/turned"], said["shadow/sorted"]), (wanted, wanted))

    def test_the_table_of_timings_has_a_line_for_each_kind(self):
        text = self.expect(farlight("render", bundled_scenes() / "teapot.glb", *PICTURE, "--primary", "trace", "--timings", "-o",
                                    self.folder / "picture.png"), 0).stdout
        for kind in ("primary", "shadow"):
            self.assertRegex(text, rf"\n +{kind} +cone tests [0-9.]+ a ray, triangle tests [0-9.]+ a ray, waves \d+, sorted \d+, "
                                   r"turned \d+, pairs max \d+, passes \d+, halvings \d+\n")

    def test_the_overlay_shows_a_line_for_each_kind(self):
        (self.folder / "replay.json").write_text(json.dumps([{"wait": "rest", "samples": 1}, {"state": "rest"}]))
        result = farlight("view", bundled_scenes() / "teapot.glb", "--replay", self.folder / "replay.json", "--headless",
                          *PICTURE, "--samples", "1")
        self.expect(result, 0)
        said = json.loads(result.stdout.splitlines()[0])["structure"]
        self.assertRegex(said[0], r"^nodes \d+")
        self.assertRegex(said[-1], r"^shadow: cone tests [0-9.]+ a ray, .*, halvings \d+$")


if __name__ == "__main__":
    unittest.main()
