# SPDX-License-Identifier: MIT
"""A short run of what `make siege` does, with what holds on any machine: while one user attacks the daemon, another one goes on
getting frames and its owner an answer, memory stays within its limits, the log is short, and it ends when it is told to."""
import sys

from farlight_test import BIN, ROOT, Case, long_test, unittest

sys.path.insert(0, str(ROOT / "tests/siege"))
import siege  # pylint: disable=wrong-import-position

LOOKS = 30


@unittest.skipIf(b"__asan_init" in (BIN / "farlightd").read_bytes(), "sanitizers have an allocator of their own, which keeps what is freed")
class Short(Case):
    def check(self, *names):
        for name in names:
            with self.subTest(name):
                complaints, line = siege.hold(name, LOOKS, self.folder)
                self.assertEqual(complaints, [], line)

    def test_no_attack_of_one_user_stops_the_daemon_for_another(self):
        self.check("places", "noise", "tight_weights")

    @long_test
    def test_nor_does_any_attack_that_takes_a_processor_or_a_connection(self):
        self.check("meshes", "stats", "silent", "encoding")


if __name__ == "__main__":
    unittest.main()
