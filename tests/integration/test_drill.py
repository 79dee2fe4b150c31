# SPDX-License-Identifier: MIT
"""A short run of what `make farm-drill` does: kills at random moments, loading included, lose and change no frame."""
import os
import random
import sys

from farlight_test import BIN, ROOT, Case

sys.path.insert(0, str(ROOT / "tests/soak"))
import drill  # pylint: disable=wrong-import-position

ROUNDS = 50 if os.environ.get("FARLIGHT_TEST_LONG") else 20
ROUNDS_SANITIZED = 10


class Short(Case):
    def test_kills_at_random_moments_lose_no_frame_change_no_byte_and_end_with_the_right_status(self):
        rounds = ROUNDS_SANITIZED if b"__asan_init" in (BIN / "farlightd").read_bytes() else ROUNDS
        seed = random.randrange(1 << 32)
        counts = drill.drill(self.folder, rounds, seed)
        print(f"seed {seed}: {dict(counts)}")
        self.assertGreater(sum(count for what, count in counts.items() if "killed" in what), rounds // 2)


if __name__ == "__main__":
    import farlight_test
    farlight_test.unittest.main()
