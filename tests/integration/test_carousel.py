# SPDX-License-Identifier: MIT
"""The bundled scene that moves: what its file promises, where its parts are at a time of the clip, and what is seen."""
import json
import math
import pathlib
import tempfile

import farlight_test
from farlight_test import Case, Daemon, bundled_scenes, farlight, read_png
from gltf_pose import Model
from test_poses import PoseCase

SIZE = (320, 180)
# Where parts are at 0.55 and at 0.95 s of the clip, as shares of the picture: left, right, top, bottom.
MOVING = {"skinned reed": (0.16, 0.28, 0.15, 0.50), "morphing blob": (0.08, 0.18, 0.34, 0.60),
          "turning wheel": (0.73, 0.93, 0.24, 0.60), "bobbing pots": (0.26, 0.72, 0.28, 0.62)}
STILL = {"a socket without the bulb": (0.54, 0.58, 0.87, 0.90), "the blob's plinth": (0.09, 0.2, 0.70, 0.73)}
BULB = {"the bulb's second place": (0.24, 0.27, 0.75, 0.81)}


def carousel():
    return bundled_scenes() / "carousel.glb"


class File(Case):
    def test_what_validators_ask_for_holds(self):
        model = Model(carousel())
        for index, accessor in enumerate(model.json["accessors"]):
            if "min" in accessor:
                columns = list(zip(*model.numbers(index)))
                self.assertEqual(tuple(accessor["min"]), tuple(float(f"{min(c):.9g}") for c in columns))
                self.assertEqual(tuple(accessor["max"]), tuple(float(f"{max(c):.9g}") for c in columns))
        for mesh in model.json["meshes"]:
            attributes = mesh["primitives"][0]["attributes"]
            for normal in model.numbers(attributes["NORMAL"]):
                self.assertAlmostEqual(math.hypot(*normal), 1, 5)
            self.assertIn("min", model.json["accessors"][attributes["POSITION"]])
            if "WEIGHTS_0" in attributes:
                for joints, weights in zip(model.numbers(attributes["JOINTS_0"]), model.numbers(attributes["WEIGHTS_0"])):
                    self.assertAlmostEqual(sum(weights), 1, 6)
                    self.assertFalse([j for j, w in zip(joints, weights) if w == 0 and j != 0])
        for node in model.nodes:
            self.assertAlmostEqual(math.hypot(*node.get("rotation", (0, 0, 0, 1))), 1, 6)

    def test_the_clip_has_every_kind_of_motion_and_ends_as_it_began(self):
        model = Model(carousel())
        clip, = model.json["animations"]
        self.assertEqual(clip["name"], "ride")
        self.assertEqual({s["interpolation"] for s in clip["samplers"]}, {"LINEAR", "STEP", "CUBICSPLINE"})
        self.assertEqual({c["target"]["path"] for c in clip["channels"]}, {"translation", "rotation", "weights"})
        first, last = model.pose(0, 0.0), model.pose(0, 3.0)
        for (node, path), value in first.items():
            # A quaternion and its negative are one rotation.
            sign = -1 if path == "rotation" and sum(a * b for a, b in zip(value, last[node, path])) < 0 else 1
            for a, b in zip(value, last[node, path]):
                self.assertAlmostEqual(a, sign * b, 5, (model.nodes[node]["name"], path))


class Motion(PoseCase):
    def test_every_vertex_is_where_glTF_says(self):
        self.compare(carousel(), 0, [0.7])


class Pictures(Case):
    def render(self, time, *more, server=None):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "frame.png"
            self.expect(farlight("render", carousel(), "--server", server, "--clip", "ride", "--time", time, "--samples", "1", "--size",
                                 f"{SIZE[0]}x{SIZE[1]}", "-o", path, *more), 0)
            width, _, rows, channels = read_png(path)
            return width, rows, channels

    @staticmethod
    def change(one, other, region):
        """Mean difference of 8-bit values within a region."""
        left, right, top, bottom = region
        width, rows, channels = one
        columns = slice(int(left * width) * channels, int(right * width) * channels)
        band = range(int(top * SIZE[1]), int(bottom * SIZE[1]))
        differences = [abs(a - b) for y in band for a, b in zip(rows[y][columns], other[1][y][columns])]
        return sum(differences) / len(differences)

    def test_parts_move_that_should_and_only_those(self):
        with Daemon() as daemon:
            before_leap, early, late = [self.render(time, server=daemon.address) for time in (0.45, 0.55, 0.95)]
        for name, region in MOVING.items():
            self.assertGreater(self.change(early, late, region), 4, name)
        for name, region in STILL.items():
            # What moves is seen in the floor and its light is reflected: a little may change, no edge may move.
            self.assertLess(self.change(early, late, region), 2, name)
        for name, region in BULB.items():
            self.assertLess(self.change(early, late, region), 2, name + " between two leaps")
            self.assertGreater(self.change(before_leap, early, region), 20, name + " across a leap")

    def test_bvh_agrees_with_the_reference_in_the_middle_of_the_clip(self):
        result = farlight("compare", carousel(), "--tracers", "bvh,reference", "--clip", "ride", "--time", "0.7",
                          "--size", "160x90", "--json", "--fail-above", "agree=99.99%", "--fail-above", "psnr=40")
        if "libembree-dev" in result.stderr:
            self.assertEqual(result.returncode, 2)
            self.skipTest("this farlightd was built without Embree")
        report = json.loads(self.expect(result, 0).stdout)
        self.assertTrue(report["within"])
        self.assertGreater(report["all"]["rays"], 160 * 90)


if __name__ == "__main__":
    farlight_test.unittest.main()
