# SPDX-License-Identifier: MIT
"""Frames of a clip with an open shutter and a lens, of ranges that were divided."""
import os

import farlight_test
from farlight_test import SHARED_SCENES, Case, Daemon, farlight, needs_shared_scenes, read_png

WIDTH, HEIGHT = 128, 96
SIZE = ["--size", f"{WIDTH}x{HEIGHT}"]
SAME = 3  # of 255: what rounding may do


def differing(one, other):
    """Pixels whose colours are apart in two PNG files."""
    _, _, rows, channels = read_png(one)
    _, _, other_rows, _ = read_png(other)
    count = 0
    for row, other_row in zip(rows, other_rows):
        for x in range(0, len(row), channels):
            count += any(abs(row[x + c] - other_row[x + c]) > SAME for c in range(3))
    return count


class Clips(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        daemon = cls.enterClassContext(Daemon())
        os.environ["FARLIGHT_SERVER"] = daemon.address
        cls.addClassCleanup(os.environ.pop, "FARLIGHT_SERVER")


@needs_shared_scenes
class Blurred(Clips):
    def frames(self, folder, *arguments):
        (self.folder / folder).mkdir()
        self.expect(farlight("animate", SHARED_SCENES / "gltf/Fox.glb", "--clip", "Run", "--fps", "12", *SIZE,
                             "--samples", "4", "--shutter", "0.5", "--aperture", "5", *arguments,
                             "-o", self.folder / folder / "%d.png"), 0)
        return {int(file.stem): read_png(file) for file in (self.folder / folder).iterdir()}

    def test_blurred_frames_are_the_same_to_the_bit_however_the_range_was_divided(self):
        whole = self.frames("whole", "--frames", "3-6")
        divided = {**self.frames("last", "--frames", "3-6", "--shard", "2/2"),
                   **self.frames("first", "--frames", "3-6", "--shard", "1/2")}
        stepped = self.frames("stepped", "--frames", "3-6:3")
        self.assertEqual(sorted(divided), sorted(whole))
        for frame, picture in whole.items():
            self.assertEqual(picture, divided[frame], f"frame {frame}")
            self.assertEqual(picture, stepped.get(frame, picture), f"frame {frame} of every third")

    def test_an_open_shutter_is_seen(self):
        self.frames("open", "--frames", "3")
        self.expect(farlight("animate", SHARED_SCENES / "gltf/Fox.glb", "--clip", "Run", "--fps", "12", *SIZE,
                             "--samples", "4", "--integrator", "distributed", "--aperture", "5", "--frames", "3",
                             "-o", self.folder / "open" / "still-%d.png"), 0)
        # A running leg alone covers more of the picture than this.
        self.assertGreater(differing(self.folder / "open/3.png", self.folder / "open/still-3.png"),
                           WIDTH * HEIGHT // 200)


if __name__ == "__main__":
    farlight_test.unittest.main()
