#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What farlight-import makes of skins, morph targets and animations, and what it does where they are broken: mend
it with a note, leave a channel out with a note, or refuse the file by name; never a crash, never much memory."""
import concurrent.futures
import copy
import json
import pathlib
import random
import tempfile
import unittest

import importer
from farlight_test import LONG
from gltf_pose import Writer

VERTICES = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]


class File(Writer):
    """A triangle at a node, a skin of two more nodes, two morph targets, and one animation of them all."""

    def __init__(self):
        super().__init__()
        position = self.accessor("VEC3", VERTICES)
        self.primitive = {"attributes": {"POSITION": position}}
        self.mesh = {"primitives": [self.primitive]}
        self.json.update({"nodes": [{"mesh": 0, "name": "body"}, {"name": "hip", "children": [2]}, {"name": "knee"}],
                          "meshes": [self.mesh], "scenes": [{"nodes": [0, 1]}], "scene": 0})

    def add_skin(self, joints=(1, 2), attributes=True, **more):
        self.json.setdefault("skins", []).append({"joints": list(joints), **more})
        self.json["nodes"][0]["skin"] = 0
        if attributes:
            self.primitive["attributes"].update({
                "JOINTS_0": self.accessor("VEC4", [(0, 1, 0, 0)] * 3, 5121),
                "WEIGHTS_0": self.accessor("VEC4", [(0.25, 0.75, 0, 0)] * 3)})
        return self

    def add_targets(self, count=2, names=("POSITION",)):
        self.primitive["targets"] = [{name: self.accessor("VEC3", [(i, 0, 1)] * 3) for name in names}
                                     for i in range(count)]
        return self

    def channel(self, node, path, times, values, interpolation=None, **more):
        animation = self.json.setdefault("animations", [{"name": "move", "samplers": [], "channels": []}])[0]
        kind = {"rotation": "VEC4", "weights": "SCALAR"}.get(path, "VEC3")
        sampler = {"input": self.accessor("SCALAR", times), "output": self.accessor(kind, values)}
        if interpolation:
            sampler["interpolation"] = interpolation
        animation["samplers"].append(sampler)
        target = {"path": path, **more}
        if node is not None:
            target["node"] = node
        animation["channels"].append({"sampler": len(animation["samplers"]) - 1, "target": target})
        return self


class Written(importer.Written):
    def run_file(self, made, status=0, **options):
        return self.import_text("model.gltf", made if isinstance(made, str) else made.text(), status, **options)

    def test_joints_and_weights_are_those_that_count(self):
        """Zeros go, the rest moves to the front; what no joint holds follows the first one."""
        made = File().add_skin(attributes=False)
        made.primitive["attributes"].update({
            "JOINTS_0": made.accessor("VEC4", [(9, 1, 0, 9), (1, 9, 9, 9), (9, 9, 9, 9)], 5123),
            "WEIGHTS_0": made.accessor("VEC4", [(0, 0.5, 0.25, 0), (1, 0, 0, 0), (0, 0, 0, 0)])})
        result = self.run_file(made)
        mesh, = result.of(importer.SET_MESH)
        self.assertEqual(mesh["influences"], 2)
        self.assertEqual(list(memoryview(result.data(mesh["arrays"][7])).cast("H")), [1, 0, 1, 0, 0, 0])
        self.assertEqual(result.floats(mesh["arrays"][8]), [0.5, 0.25, 1, 0, 1, 0])
        self.assertIn("without weights follow the first joint", result.text())

    def test_of_more_than_sixteen_joints_the_heaviest_are_kept(self):
        made = File()
        made.json["nodes"] += [{} for _ in range(20)]
        made.json["scenes"][0]["nodes"] += list(range(3, 23))
        made.add_skin(joints=range(3, 23), attributes=False)
        for number in range(5):
            made.primitive["attributes"][f"JOINTS_{number}"] = made.accessor(
                "VEC4", [tuple(range(4 * number, 4 * number + 4))] * 3, 5121)
            made.primitive["attributes"][f"WEIGHTS_{number}"] = made.accessor(
                "VEC4", [tuple(float(1 + j) for j in range(4 * number, 4 * number + 4))] * 3)
        result = self.run_file(made)
        mesh, = result.of(importer.SET_MESH)
        self.assertEqual(mesh["influences"], 16)
        self.assertEqual(sorted(memoryview(result.data(mesh["arrays"][7])).cast("H")[:16]), list(range(4, 20)))
        self.assertIn("the 16 with the largest weights", result.text())

    def test_a_skin_has_its_joints_and_matrices(self):
        made = File()
        columns = [tuple(float(i + 100 * j) for i in range(16)) for j in range(2)]
        made.add_skin(inverseBindMatrices=made.accessor("MAT4", columns), name="bones")
        result = self.run_file(made)
        skin, = result.of(importer.SET_SKIN)
        names = {node["id"]: node["name"] for node in result.of(importer.SET_NODE)}
        self.assertEqual([names[j] for j in result.integers(skin["arrays"][0])], ["hip", "knee"])
        self.assertEqual(result.floats(skin["arrays"][1]),
                         [columns[j][column * 4 + row] for j in (0, 1) for row in range(3) for column in range(4)])
        self.assertEqual(skin["name"], "bones")

    def test_joints_outside_the_scene_are_there_hidden(self):
        made = File().add_skin()
        made.json["nodes"].append({"name": "above", "children": [1], "mesh": 0})
        made.json["scenes"] = [{"nodes": [0]}]
        result = self.run_file(made.channel(2, "translation", [0, 1], [(0, 0, 0), (1, 0, 0)]))
        nodes = {node["name"]: node for node in result.of(importer.SET_NODE)}
        self.assertEqual([(name, nodes[name]["hidden"], nodes[name]["kind"]) for name in ("body", "above", "hip", "knee")],
                         [("body", 0, 1), ("above", 1, 0), ("hip", 1, 0), ("knee", 1, 0)])
        self.assertEqual(nodes["knee"]["parent"], nodes["hip"]["id"])
        self.assertEqual(nodes["hip"]["parent"], nodes["above"]["id"])
        self.assertIn(("knee", importer.TRANSLATION), result.channels())

    def test_broken_skins_are_refused_by_name(self):
        for made, expected in (
                (File().add_skin(joints=[1]), "names joint 1 of 1"), (File().add_skin(joints=[1, 77]), "node 77"),
                (File().add_skin(joints=[1, -3]), "node -3"), (File().add_skin(joints=[]), "0 joints"),
                (File().add_skin(joints=[1, 2], inverseBindMatrices=99), "accessor 99"),
                (File().add_skin(joints=[1, 2], inverseBindMatrices=0), "wrong type")):
            with self.subTest(expected):
                self.assertIn(expected, self.run_file(made, 1).text())

    def test_a_skin_without_joints_at_the_vertices_changes_nothing(self):
        """Nor do joints without a skin."""
        result = self.run_file(File().add_skin(attributes=False))
        self.assertEqual(result.of(importer.SET_NODE)[0]["skin"], 0)
        self.assertIn("no joints or weights", result.text())
        made = File().add_skin()
        del made.json["nodes"][0]["skin"]
        result = self.run_file(made)
        self.assertEqual((result.of(importer.SET_MESH)[0]["influences"], result.of(importer.SET_SKIN)), (0, []))

    def test_matrices_with_NaN_are_ignored(self):
        made = File()
        made.add_skin(inverseBindMatrices=made.accessor("MAT4", [(float("nan"),) * 16, (2.0,) * 16]))
        result = self.run_file(made)
        matrices = result.floats(result.of(importer.SET_SKIN)[0]["arrays"][1])
        self.assertEqual(matrices, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0] + [2] * 12)
        self.assertIn("not finite", result.text())

    def test_sparse_morph_targets(self):
        made = File()
        made.json["accessors"].append({
            "componentType": 5126, "count": 3, "type": "VEC3",
            "sparse": {"count": 1, "indices": {"bufferView": made.view(b"\2\0\0\0"), "componentType": 5121},
                       "values": {"bufferView": made.view(bytes.fromhex("0000803f00000040000040c0"))}}})
        made.primitive["targets"] = [{"POSITION": len(made.json["accessors"]) - 1}]
        result = self.run_file(made)
        self.assertEqual(result.floats(result.of(importer.SET_MESH)[0]["arrays"][9]), [0] * 6 + [1, 2, -3])

    def test_targets_of_normals_alone_come_with_zero_positions(self):
        made = File().add_targets(names=("NORMAL",))
        made.primitive["attributes"]["NORMAL"] = made.accessor("VEC3", [(0, 0, 1)] * 3)
        mesh, = (result := self.run_file(made)).of(importer.SET_MESH)
        self.assertEqual((mesh["targets"], result.floats(mesh["arrays"][9])), (2, [0] * 18))
        self.assertEqual(result.floats(mesh["arrays"][10]), [0, 0, 1] * 3 + [1, 0, 1] * 3)

    def test_targets_and_weights_beyond_the_limits_are_cut(self):
        made = File()
        target = {"POSITION": made.accessor("VEC3", [(0, 0, 1)] * 3)}
        made.primitive["targets"] = [target] * 1030
        made.mesh["weights"] = [0.5] * 1030
        made.json["nodes"][0]["weights"] = [1e9] * 2000
        made.channel(0, "weights", [0, 1], [i % 1030 for i in range(2060)])
        result = self.run_file(made)
        mesh, = result.of(importer.SET_MESH)
        self.assertEqual((mesh["targets"], len(mesh["weights"])), (1024, 1024))
        self.assertEqual(result.of(importer.SET_NODE)[0]["weights"], [1e6] * 1024)
        self.assertEqual(result.channels()["body", importer.WEIGHTS][2], list(range(1024)) * 2)
        self.assertIn("the first 1024 of 1030 morph targets", result.text())

    def test_a_small_file_that_asks_for_much_is_refused(self):
        """Accessors without bytes are zeros: 16 Mi vertices and 200 targets would be 40 GB."""
        made = File()
        made.json["accessors"] = [{"componentType": 5126, "count": 1 << 24, "type": "VEC3"}]
        made.primitive["attributes"] = {"POSITION": 0}
        made.primitive["targets"] = [{"POSITION": 0}] * 200
        result = self.run_file(made, 1, memory=6 << 30)
        self.assertRegex(result.text(), "more than 6 GiB|out of memory")
        self.assertLess(result.seconds, 5 * importer.SLOWER)

    def test_what_a_clip_leaves_alone_of_a_node_is_constant(self):
        made = File()
        made.json["nodes"][1].update({"scale": [-1, 2, 3], "translation": [4, 5, 6]})
        made.channel(1, "rotation", [0.5, 1], [(0, 0, 0, 1), (0, 1, 0, 0)])
        result = self.run_file(made)
        self.assertEqual(result.channels(), {
            ("hip", importer.ROTATION): (importer.LINEAR, [0.5, 1], [0, 0, 0, 1, 0, 1, 0, 0]),
            ("hip", importer.TRANSLATION): (importer.STEP, [0], [4, 5, 6]),
            ("hip", importer.SCALE): (importer.STEP, [0], [-1, 2, 3])})
        self.assertEqual(result.clips, [{"id": 1, "channels": 1, "duration": 1, "name": "move"}])

    def test_interpolations_keep_their_names(self):
        for name, number, values in ((None, importer.LINEAR, 2), ("STEP", importer.STEP, 2), ("CUBICSPLINE", importer.CUBIC, 6)):
            result = self.run_file(File().channel(1, "translation", [0, 1], [(i, 0, 0) for i in range(values)], name))
            self.assertEqual(result.channels()["hip", importer.TRANSLATION], (number, [0, 1], [x for i in range(values) for x in (i, 0, 0)]))

    def test_times_that_do_not_ascend_are_mended(self):
        """Of equal times the last is later by one step of its last digit; what lies between or goes back is left out."""
        made = File().channel(1, "translation", [0, 1, 1, 1, 0.5, 2, float("nan"), 3],
                              [(float(i), 0, 0) for i in range(8)])
        result = self.run_file(made)
        _, times, values = result.channels()["hip", importer.TRANSLATION]
        self.assertEqual(times, [0, 1, 1 + 2 ** -23, 2, 3])
        self.assertEqual(values[::3], [0, 1, 3, 5, 7])
        self.assertIn("do not ascend", result.text())

    def test_channels_that_cannot_be_played_are_left_out_and_the_rest_is_played(self):
        nan, move = float("nan"), [(0, 0, 0), (1, 0, 0)]

        def with_sampler(**changes):
            made = File().channel(2, "scale", [0, 1], move)
            made.json["animations"][0]["samplers"][0].update(changes)
            return made

        def named(number):
            made = File().channel(2, "scale", [0, 1], move)
            made.json["animations"][0]["channels"][0]["sampler"] = number
            return made

        for made, expected in (
                (File().channel(2, "scale", [0, 1], move + move), "ask for 2, is left out"),
                (File().channel(2, "scale", [0, 1], move, "CUBICSPLINE"), "ask for 6, is left out"),
                (File().channel(2, "scale", [0, 1], [(0, 0, 0), (nan, 0, 0)]), "not finite or beyond 1e12"),
                (File().channel(2, "scale", [nan, nan], move), "do not ascend"),
                (File().channel(2, "colour", [0, 1], move), "unknown path 'colour'"),
                (File().channel(0, "weights", [0, 1], [0, 1]), ""),  # no morph targets: nothing to say
                (File().channel(77, "scale", [0, 1], move), ""), (File().channel(None, "scale", [0, 1], move), None),
                (with_sampler(interpolation="WAVES"), "unknown interpolation 'WAVES'"),
                (named(9), "sampler that does not exist"), (named(-2), "sampler that does not exist"),
                (File().channel(None, "pointer", [0, 1], move,
                                extensions={"KHR_animation_pointer": {"pointer": "/cameras/0/perspective/yfov"}}),
                 "'/cameras/0/perspective/yfov', a property that cannot be animated here"),
                (File().channel(None, "pointer", [0, 1], move,
                                extensions={"KHR_animation_pointer": {"pointer": "/nodes/77/scale"}}), ""),
                (File().channel(1, "translation", [0, 1], move), "a second channel")):
            with self.subTest(expected):
                result = self.run_file(made.channel(1, "translation", [0, 2], [(3, 0, 0), (4, 0, 0)]))
                self.assertEqual([clip["channels"] for clip in result.clips], [1])
                self.assertEqual({name for name, _ in result.channels()}, {"hip"})
                self.assertIn(expected or "", result.text())

    def test_an_animation_with_nothing_to_play_is_reported(self):
        result = self.run_file(File().channel(77, "scale", [0, 1], [(0, 0, 0), (1, 0, 0)]))
        self.assertEqual(result.clips, [{"id": 0, "channels": 0, "duration": 0, "name": "move"}])
        self.assertEqual((result.of(importer.SET_CLIP), result.of(importer.SET_CHANNEL)), ([], []))
        self.assertIn("nothing that can be played", result.text())

    def test_channels_that_share_their_numbers_share_them_here(self):
        made = File()
        for node in (1, 2):
            made.channel(node, "translation", [0, 1], [(0, 0, 0), (1, 0, 0)])
        made.json["animations"][0]["channels"][1]["sampler"] = 0
        result = self.run_file(made)
        moved = [c for c in result.of(importer.SET_CHANNEL) if c["path"] == importer.TRANSLATION]
        self.assertEqual(len({(c["first_time"], c["first_value"]) for c in moved}), 1)

    def test_a_thousand_channels_of_sixteen_million_keys_take_no_time(self):
        """Zeros without bytes again: all keys at one time are two keys at most."""
        made = File().channel(1, "translation", [0, 1], [(0, 0, 0), (1, 0, 0)])
        made.json["accessors"] += [{"componentType": 5126, "count": 1 << 24, "type": "SCALAR"},
                                   {"componentType": 5126, "count": 1 << 24, "type": "VEC3"}]
        made.json["nodes"] += [{} for _ in range(1000)]
        made.json["scenes"][0]["nodes"] += list(range(3, 1003))
        count = len(made.json["accessors"])
        made.json["animations"] = [{"samplers": [{"input": count - 2, "output": count - 1}],
                                    "channels": [{"sampler": 0, "target": {"node": node, "path": "translation"}}
                                                 for node in range(3, 1003)]}]
        result = self.run_file(made, memory=6 << 30)
        self.assertIn("do not ascend", result.text())
        self.assertEqual(result.of(importer.SET_CHANNEL)[0]["keys"], 2)
        self.assertLess(result.seconds, 5 * importer.SLOWER)


def places(value, at=()):
    """Every number, text and list in a JSON value, by its way there."""
    if isinstance(value, dict):
        for key, below in value.items():
            yield from places(below, at + (key,))
    elif isinstance(value, list):
        yield at
        for i, below in enumerate(value):
            yield from places(below, at + (i,))
    else:
        yield at


class Mutated(unittest.TestCase):
    """Files with something wrong about skins, targets, animations or accessors."""

    COUNT = 100 if LONG else 30
    VALUES = (-1, -2147483648, 0, 1, 2, 3, 7, 255, 65535, 65536, 1 << 24, (1 << 31) - 1, 1 << 31, (1 << 32) - 1, 1e30,
              0.5, "", "MAT4", "SCALAR", "VEC4", "CUBICSPLINE", "weights", None, [], {}, [0] * 300, True)

    def whole(self):
        made = File().add_skin().add_targets(names=("POSITION", "NORMAL"))
        made.primitive["attributes"]["NORMAL"] = made.accessor("VEC3", [(0, 0, 1)] * 3)
        made.json["skins"][0]["inverseBindMatrices"] = made.accessor(
            "MAT4", [(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1)] * 2)
        made.mesh["weights"] = [0.5, 0.25]
        made.json["nodes"][0]["weights"] = [1, 0]
        made.channel(0, "weights", [0, 1], [0, 1, 1, 0])
        made.channel(1, "rotation", [0, 1], [(0, 0, 0, 1)] * 6, "CUBICSPLINE")
        made.channel(2, "translation", [0, 1], [(0, 0, 0), (1, 0, 0)], "STEP")
        return json.loads(made.text())

    def mutants(self):
        # Always the same ones: a failure can be looked at.
        chance, whole = random.Random(4), self.whole()
        ways = [way for way in places(whole) if way[0] in ("skins", "animations", "accessors", "meshes", "nodes")]
        for _ in range(self.COUNT):
            mutant = copy.deepcopy(whole)
            for _ in range(chance.choice((1, 1, 2))):
                way = chance.choice(ways)
                try:
                    at = mutant
                    for key in way[:-1]:
                        at = at[key]
                    at[way[-1]] = chance.choice(self.VALUES)
                except (IndexError, KeyError, TypeError):
                    pass  # the first change took the place of the second away
            yield way, json.dumps(mutant)

    def test_every_mutant_is_imported_or_refused(self):
        self.assertEqual(importer.inconsistencies(self.run_one((), json.dumps(self.whole()))[2]), [])
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            results = list(pool.map(lambda mutant: self.run_one(*mutant), self.mutants()))
        imported = 0
        for way, text, result in results:
            with self.subTest(way=way, text=text):
                self.assertEqual((result.faults, result.stderr), ([], ""))
                self.assertIn(result.status, (0, 1))
                self.assertEqual(len(result.errors()), result.status)
                if result.status == 0:
                    self.assertEqual(importer.inconsistencies(result), [])
                imported += result.status == 0
        print(f"{imported} of {self.COUNT} imported ", end="")
        self.assertGreater(imported, self.COUNT / 10)
        self.assertLess(imported, self.COUNT)

    def run_one(self, way, text):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "mutant.gltf"
            path.write_text(text, encoding="utf-8")
            return way, text, importer.import_file(str(path), memory=6 << 30)


if __name__ == "__main__":
    unittest.main(verbosity=2)
