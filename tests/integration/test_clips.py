# SPDX-License-Identifier: MIT
"""Rendered clips against rendered models that stand as gltf_pose.py says, and blurred frames of divided ranges."""
import os

import farlight_test
from farlight_test import SHARED_SCENES, Case, Daemon, farlight, needs_shared_scenes, read_png
from gltf_pose import Model, write_still

WIDTH, HEIGHT = 160, 120
SIZE = ["--size", f"{WIDTH}x{HEIGHT}"]
# Vertices differ by rounding (test_poses.py), so that edges may lie on the other side of a pixel's middle here and
# there: of the pixels at outlines, some thousandths of the picture. Elsewhere a channel is off by rounding only.
EDGE_PIXELS = WIDTH * HEIGHT // 200
SAME = 3


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

    def picture(self, name, model, *arguments):
        path = self.folder / f"{name}.png"
        self.expect(farlight("render", model, "-o", path, *SIZE, *arguments), 0)
        return path

    def view_of(self, model, animation, time):
        """A camera that is the same for both."""
        corners = [p for part in model.parts(animation, time) for p in part.positions]
        low, high = ([pick(p[i] for p in corners) for i in range(3)] for pick in (min, max))
        size = max(b - a for a, b in zip(low, high))
        middle = [(a + b) / 2 for a, b in zip(low, high)]
        eye = [middle[0] + 0.7 * size, middle[1] + 0.5 * size, middle[2] + 1.3 * size]
        return ["--eye", ",".join(map(repr, eye)), "--look-at", ",".join(map(repr, middle)), "--fov", "45"]


@needs_shared_scenes
class Stills(Clips):
    MODELS = ("gltf/Fox.glb", "gltf/khronos/AnimatedMorphCube-glTF/AnimatedMorphCube.gltf")

    def test_a_moment_of_a_clip_shows_the_model_that_stands_so(self):
        for name in self.MODELS:
            path = SHARED_SCENES / name
            model, animation = Model(path), len(Model(path).json["animations"]) - 1
            begin, end = model.times(animation)
            times = [begin + 0.31 * (end - begin), begin + 0.62 * (end - begin)]
            view = self.view_of(model, animation, times[0])
            moving, still = [], []
            for i, time in enumerate(times):
                write_still(model, animation, time, self.folder / "still.gltf")
                moving.append(self.picture(f"moving-{i}", path, *view, "--clip", animation, "--time", repr(time)))
                still.append(self.picture(f"still-{i}", self.folder / "still.gltf", *view))
            for tracer in ("bvh", "reference"):
                traced = self.picture(tracer, path, *view, "--clip", animation, "--time", repr(times[1]),
                                      "--tracer", tracer, "--primary", "trace")
                with self.subTest(model=name, tracer=tracer):
                    self.assertLess(differing(traced, still[1]), EDGE_PIXELS)
            for i in range(2):
                with self.subTest(model=name, time=times[i]):
                    self.assertLess(differing(moving[i], still[i]), EDGE_PIXELS)
            with self.subTest(model=name):
                self.assertGreater(differing(moving[0], moving[1]), 2 * EDGE_PIXELS, "or nothing above could fail")


@needs_shared_scenes
class Blurred(Clips):
    def frames(self, folder, *arguments):
        (self.folder / folder).mkdir()
        self.expect(farlight("animate", SHARED_SCENES / "gltf/Fox.glb", "--clip", "Run", "--fps", "12", *SIZE,
                             "--samples", "4", "--shutter", "0.5", "--aperture", "5", *arguments,
                             "-o", self.folder / folder / "%d.png"), 0)
        return {int(file.stem): read_png(file) for file in (self.folder / folder).iterdir()}

    def test_blurred_frames_are_the_same_to_the_bit_however_the_range_was_divided(self):
        whole = self.frames("whole", "--frames", "3-8")
        divided = {**self.frames("odd", "--frames", "3-8:2"), **self.frames("first", "--frames", "3-8", "--shard", "1/3"),
                   **self.frames("last", "--frames", "3-8", "--shard", "3/3"),
                   **self.frames("middle", "--frames", "3-8", "--shard", "2/3")}
        self.assertEqual(sorted(divided), sorted(whole))
        for frame, picture in whole.items():
            self.assertEqual(picture, divided[frame], f"frame {frame}")

    def test_an_open_shutter_is_seen(self):
        self.frames("open", "--frames", "3")
        self.expect(farlight("animate", SHARED_SCENES / "gltf/Fox.glb", "--clip", "Run", "--fps", "12", *SIZE,
                             "--samples", "4", "--integrator", "distributed", "--aperture", "5", "--frames", "3",
                             "-o", self.folder / "open" / "still-%d.png"), 0)
        self.assertGreater(differing(self.folder / "open/3.png", self.folder / "open/still-3.png"), EDGE_PIXELS)


if __name__ == "__main__":
    farlight_test.unittest.main()
