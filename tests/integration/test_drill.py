# SPDX-License-Identifier: MIT
"""A short run of what `make farm-drill` does: kills, while loading and while rendering, lose and change no frame."""
import random
import sys

from farlight_test import ROOT, Case, long_test

sys.path.insert(0, str(ROOT / "tests/soak"))
import breaks  # pylint: disable=wrong-import-position
import drill  # pylint: disable=wrong-import-position

ROUNDS = 50
LOSSES = 6  # a worker stands three in five minutes, and the next client has another
WAIT_S = 20  # for the next frame


class Short(Case):
    def check(self, counts, kills):
        self.assertEqual(sum(count for what, count in counts.items() if "killed" in what), kills, counts)

    def test_kills_while_loading_and_rendering_lose_no_frame_change_no_byte_and_end_with_the_right_status(self):
        self.check(drill.drill_few(self.folder), len(drill.FEW))

    def test_a_worker_whose_gpu_is_lost_for_good_is_replaced_at_once(self):
        breaking = breaks.Breaking(self.folder, "lost")
        breaking.run(LOSSES)
        self.assertLess(max(breaking.waits_s), WAIT_S)

    @long_test
    def test_so_do_kills_at_random_moments(self):
        seed = random.randrange(1 << 32)
        counts = drill.drill(self.folder, ROUNDS, seed)
        print(f"seed {seed}: {dict(counts)}")
        self.check(counts, ROUNDS)


if __name__ == "__main__":
    import farlight_test
    farlight_test.unittest.main()
