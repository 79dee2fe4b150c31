# SPDX-License-Identifier: MIT
"""The tracer `ldc` as a person meets it: options, what a frame says of its cubes, comparison, animation."""
import os

import farlight_test
from farlight_test import Case, bundled_scenes, farlight


class Options(Case):
    def test_each_wrong_value_is_told_with_its_option_and_what_is_known(self):
        for option, value, says in (
                ("--ldc-resolution", "15", "16 to 4096"), ("--ldc-resolution", "4097", "4096"),
                ("--ldc-resolution", "fine", "fine"), ("--ldc-block", "12", "2, 4, 8, 16, 32"),
                ("--ldc-block", "64", "32"), ("--ldc-rays", "2", "0, 1, 4"), ("--ldc-rays", "8", "4"),
                ("--ldc-build", "magic", "auto, peel, lists"), ("--ldc-levels", "tree", "auto, blocks, pyramid"),
                ("--ldc-tolerance", "-1", "-1"), ("--ldc-tolerance", "nan", "nan")):
            for command in (["render"], ["animate", "--frames", "1-2"], ["compare", "--tracers", "ldc,bvh"]):
                with self.subTest(option=option, value=value, command=command[0]):
                    result = self.expect(farlight(*command, bundled_scenes() / "cornell.glb", "-o",
                                                  self.folder / "%d.png", option, value), 2)
                    self.assertIn(option, result.stderr)
                    self.assertIn(says, result.stderr)
                    self.assertEqual(self.leftovers(), [])

    def test_the_environment_gives_defaults(self):
        result = farlight("render", bundled_scenes() / "cornell.glb", "-o", self.folder / "x.png",
                          env={**os.environ, "FARLIGHT_LDC_RESOLUTION": "7"})
        self.expect(result, 2)
        self.assertIn("FARLIGHT_LDC_RESOLUTION", result.stderr)


if __name__ == "__main__":
    farlight_test.unittest.main()
