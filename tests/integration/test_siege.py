# SPDX-License-Identifier: MIT
"""A short run of what `make siege` does: of the attacks those that would stop the daemon for everyone else."""
import pathlib
import sys

from farlight_test import BIN, ROOT, Case, unittest

sys.path.insert(0, str(ROOT / "tests/siege"))
import siege  # pylint: disable=wrong-import-position

SECONDS = 3
ATTACKS = ("meshes", "stats", "places", "silent", "encoding", "noise", "tight_weights")


@unittest.skipIf(b"__asan_init" in (BIN / "farlightd").read_bytes(), "its bounds of time are those of a daemon as it is shipped")
class Short(Case):
    def test_no_attack_of_one_user_stops_the_daemon_for_another(self):
        lines = []
        found = siege.siege(ATTACKS, SECONDS, pathlib.Path(self.folder), siege.COARSE, lines.append)
        self.assertEqual({name: figures["complaints"] for name, figures in found.items() if figures.get("complaints")}, {},
                         "\n".join(lines))


if __name__ == "__main__":
    unittest.main()
