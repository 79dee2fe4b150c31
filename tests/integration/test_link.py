# SPDX-License-Identifier: MIT
"""`--link`: commands over a link that is slower than the machine's own, and breaks."""
import json
import os
import re
import subprocess

from farlight_test import BIN, TIMEOUT_S, Case, Daemon, bundled_scenes, farlight, long_test

# Its first connection is reset after a minute, in which the scene is loaded on any machine; its second one after an hour.
BREAKS_ONCE = "50mbit,20ms,0.1%,seed=16438"


def milliseconds(result, which):
    return float(re.search(rf"{which} ([0-9.]+) ms", result.stdout)[1])


class Link(Case):
    def test_a_ping_takes_the_round_trip_of_the_link_at_least(self):
        with Daemon() as daemon:
            for address in ([], ["--server", daemon.address]):
                result = self.expect(farlight("ping", "--link", "10mbit,80ms", *address), 0)
                self.assertGreaterEqual(milliseconds(result, "minimum"), 80)
            shaped = self.expect(farlight("ping", "--server", daemon.address, env={**os.environ, "FARLIGHT_LINK": "80ms"}), 0)
            self.assertGreaterEqual(milliseconds(shaped, "minimum"), 80)

    def test_a_picture_over_a_link_is_the_same_to_the_byte(self):
        pictures = []
        for number, link in enumerate(([], ["--link", "20mbit,30ms"])):
            path = self.folder / f"{number}.png"
            self.expect(farlight("render", bundled_scenes() / "cornell.glb", "--size", "160x120", "-q", "-o", path, *link), 0)
            pictures.append(path.read_bytes())
        self.assertEqual(pictures[0], pictures[1])

    @long_test
    def test_a_view_goes_on_after_the_link_was_reset(self):
        pull = [{"mouse": "down", "button": "left", "x": 80, "y": 45}, {"mouse": "move", "x": 90, "y": 45},
                {"mouse": "up", "button": "left", "x": 90, "y": 45}]
        events = [{"wait": "lost"}, {"state": "lost"}, *pull, {"wait": "rest", "samples": 4}, {"state": "after"}]
        replay = self.folder / "replay.json"
        replay.write_text(json.dumps(events))
        with Daemon() as daemon:
            result = subprocess.run([BIN / "farlight", "view", bundled_scenes() / "cornell.glb", "--headless", "--replay", replay,
                                     "--size", "160x90", "--samples", "4", "--server", daemon.address, "--link", BREAKS_ONCE],
                                    stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False, timeout=TIMEOUT_S)
        self.expect(result, 0)
        lost, after = map(json.loads, result.stdout.splitlines())
        self.assertEqual((lost["status"], lost["times_live"]), ("lost", 1))
        self.assertEqual((after["status"], after["times_live"], after["samples"]), ("live", 2, 4))
        self.assertEqual(after["encoding"], "predicted")  # as over a network, though the socket is a local one

    def test_a_wrong_link_is_wrong_usage(self):
        for arguments in (["ping", "--link", "2mb"], ["render", bundled_scenes() / "cornell.glb", "-o", "x.png", "--link", "2mb"],
                          ["view", bundled_scenes() / "cornell.glb", "--link", "2mb"]):
            result = self.expect(farlight(*arguments), 2)
            for part in ("--link", "'2mb'", "mbit", "ms", "%"):
                self.assertIn(part, result.stderr)
