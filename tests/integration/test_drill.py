# SPDX-License-Identifier: MIT
"""A short run of what `make farm-drill` does: kills, while loading and while rendering, lose and change no frame."""
import random
import sys

from farlight_test import ROOT, Case, long_test

sys.path.insert(0, str(ROOT / "tests/soak"))
import drill  # pylint: disable=wrong-import-position

ROUNDS = 50


class Short(Case):
    def check(self, counts, kills):
        self.assertEqual(sum(count for what, count in counts.items() if "killed" in what), kills, counts)

    def test_kills_while_loading_and_rendering_lose_no_frame_change_no_byte_and_end_with_the_right_status(self):
        self.check(drill.drill_few(self.folder), len(drill.FEW))

    @long_test
    def test_so_do_kills_at_random_moments(self):
        seed = random.randrange(1 << 32)
        counts = drill.drill(self.folder, ROUNDS, seed)
        print(f"seed {seed}: {dict(counts)}")
        self.check(counts, ROUNDS)


if __name__ == "__main__":
    import farlight_test
    farlight_test.unittest.main()
