# SPDX-License-Identifier: MIT
"""Request files of `farlight animate`: what is taken, how mistakes are told, and that the published schema gives the
same verdicts as the program."""
import copy
import json
import re

import farlight_test
from farlight_test import Case, bundled_scenes, farlight

SCHEMA = farlight_test.BIN / "shot.schema.json"

# Between them the examples have every member that there is, each in every shape.
EXAMPLES = {
    "stills": {
        "$schema": "https://example.org/shot.schema.json",
        "description": "all settings",
        "model": "teapot.glb", "environment": "sky.hdr", "environment_rotation": 90, "variant": "red",
        "background": "#10a0ff", "camera": 0,
        "frames": "1-240:2", "fps": 23.976, "shard": "3/8", "size": [64, 48], "samples": 4, "depth": 0, "seed": 7,
        "exposure": -1.5, "tone_map": "aces", "shutter": 0.5, "filter": "gaussian", "tracer": "bvh",
        "bvh_form": "paper", "ldc_resolution": 512, "ldc_form": "paper", "quadtree_pixels": 0.5,
        "abuffer_resolution": 512, "abuffer_voxels": 16, "abuffer_form": "fast", "brdf": "ward", "clamp": 5, "ao_distance": 0.5, "ao_falloff": 1,
        "ao_rays": 4, "layer_opacity": 0.25, "layers": ["beauty", "depth", "id"], "light_groups": {"key": ["Sun", "Lamp*"], "sky": ["environment"]},
        "integrator": "path", "primary": "trace", "encoding": "zstd",
        "quality": 3, "format": "exr", "half": True, "float": False, "output": "%04d.exr"},
    "movie": {
        "model": "teapot.glb", "camera": "a camera", "lossless": True, "frames": "5",
        "clips": ["walk", 1, {"clip": "run", "start": -1, "speed": 2, "loop": False}, {"clip": 0}],
        "outputs": ["movie.mkv"]},
    "moving": {
        "model": "teapot.glb",
        "camera": {
            "eye": {"times": [0, 1, 2.5], "values": [[0, 1, 5], [2, 1, 5], [5, 1, 0]], "interpolation": "bezier",
                    "handles": [[[0, 1, 5], [1, 1, 5]], [[1, 1, 5], [3, 1, 5]], [[5, 1, 1], [5, 1, 0]]]},
            "look_at": {"times": [0, 2], "values": [[0, 0, 0], [0, 1, 0]]}, "up": [0, 1, 0.1],
            "fov": {"times": [0, 1], "values": [40, 30], "interpolation": "cubic-spline",
                    "handles": [[0, -5], [5, 0]]},
            "aperture": {"times": [0], "values": [0.1]}, "focus": 3.2,
            "exposure": {"times": [0, 1], "values": [0, -2], "interpolation": "step"}},
        "lights": [{"target": "Light", "colour": [10, 9, 8], "size": 0.5},
                   {"target": 0, "colour": {"times": [0, 1], "values": [[0, 0, 0], [1, 1, 1]]},
                    "size": {"times": [0, 1], "values": [[1, 2], 0.5]}}],
        "materials": [{"target": 0, "base_colour": [1, 0.5, 0], "emission": [0, 0, 4], "metallic": 1, "roughness": 0.3,
                       "transmission": 0, "ior": 1.33},
                      {"target": "glaze",
                       "base_colour": {"times": [0, 1], "values": [[1, 0, 0], [0, 1, 0, 0.5]], "interpolation":
                                       "catmull-rom"},
                       "roughness": {"times": [0, 1], "values": [0, 1], "interpolation": "bezier"}}],
        "nodes": [{"target": "pot", "translation": [0, 1, 0], "rotation": [0, 0, 0, 1], "scale": [1, 2, 1],
                   "hidden": False},
                  {"target": 3, "rotation_degrees": {"times": [0, 4], "values": [[0, 0, 0], [0, 720, 0]]},
                   "hidden": {"times": [0, 1], "values": [False, True], "interpolation": "step"}},
                  {"target": 4, "rotation_degrees": [0, 90, 0]}],
        "outputs": ["%04d.png", "movie.mp4"]},
    "orbit": {"model": "teapot.glb", "camera": {"eye": [0, 1, 5], "look_at": [0, 0, 0], "fov": 40,
                                                "orbit": {"degrees": -90, "seconds": 2}}, "output": "%d.jpg"},
    "dolly": {"model": "teapot.glb", "bounces": 3, "abuffer_voxels": "auto", "camera": {"eye": [0, 1, 5], "look_at": [0, 0, 0],
                                                "dolly": {"by": 2, "seconds": 2, "ease": True}}, "output": "%d.png"},
    "dolly to": {"model": "teapot.glb", "camera": {"eye": [0, 1, 5], "look_at": [0, 0, 0],
                                                   "dolly": {"to": [1, 1, 1]}}, "output": "-"},
    "lens": {"model": "teapot.glb", "camera": {"name": "a camera", "aperture": 0.1, "focus": 2}, "output": "%d.png"},
    "furnished": {"models": ["teapot.glb", {"model": "teapot.glb", "at": [1, 0, 2]},
                             {"model": "teapot.glb", "rotation_degrees": [0, 90, 0], "scale": 0.5}], "output": "%d.png"},
    "turning": {"model": "teapot.glb", "camera": {"orbit": True}, "output": "%d.png"},
    "turning half": {"model": "teapot.glb", "camera": {"orbit": 180}, "output": "%d.png"},
}

# What only the program can see: the example, the way to the value, what to put there (None: take it out), and words
# that must be told, the line's beginning among them.
BEYOND_THE_SCHEMA = [
    ("moving", ("camera", "eye", "times", 1), 0, "camera.eye.times[1]: is not later"),
    ("moving", ("camera", "eye", "values"), [[0, 0, 0]], "camera.eye.values: has 1 values for 3 times"),
    ("moving", ("camera", "eye", "handles", 2), None, "camera.eye.handles: has 2 pairs for 3 times"),
    ("moving", ("nodes", 0, "rotation"), [0, 0, 0, 0], "nodes[0].rotation: has length 0"),
    ("moving", ("nodes", 1, "rotation_degrees", "values"), [[0, -3.6e6, 0], [0, 3.6e6, 0]], "turns too often"),
    ("moving", ("camera", "orbit"), True, "camera.eye: cannot change on an orbit"),
    ("orbit", ("camera", "dolly"), {"by": 1}, "camera.dolly: cannot be combined with an orbit"),
    ("dolly", ("camera", "look_at"), [0, 1, 5], '"look_at" and "eye" are the same point'),
    ("stills", ("frames",), "240-1", "frames: '240-1': the last frame is before the first"),
    ("stills", ("shard",), "9/8", "shard: '9/8': there is no part 9 of 8"),
    ("stills", ("output",), "frames.exr", "output: 'frames.exr' has no place for the frame's number"),
    ("stills", ("output",), "%d/0001.exr", "output: '%d/0001.exr': the frame's number may only be in the file's"),
    ("dolly", ("depth",), 2, "contradicts"),
    ("furnished", ("models",), ["-", {"model": "-"}], "models[1].model: standard input can be read only once"),
    ("movie", ("outputs", 0), "movie.webm", "outputs[0]: the ending belongs to no known format"),
]


def places(value, way=()):
    """Every way to a value in a document."""
    yield way
    if isinstance(value, dict):
        for key in value:
            yield from places(value[key], way + (key,))
    elif isinstance(value, list):
        for index in range(len(value)):
            yield from places(value[index], way + (index,))


def put(document, way, value):
    """A copy with another value there, or without it."""
    changed = copy.deepcopy(document)
    inner = changed
    for step in way[:-1]:
        inner = inner[step]
    if value is None:
        del inner[way[-1]]
    else:
        inner[way[-1]] = value
    return changed


def look_up(document, way):
    for step in way:
        document = document[step]
    return document


class Shots(Case):
    def setUp(self):
        super().setUp()
        self.model = bundled_scenes() / "teapot.glb"
        for name in ("teapot.glb", "sky.hdr"):
            (self.folder / name).symlink_to(bundled_scenes() / name)

    def try_text(self, text, *arguments):
        (self.folder / "shot.json").write_text(text)
        return farlight("animate", "--script", self.folder / "shot.json", "--dry-run", *arguments)

    def try_shot(self, document, *arguments):
        return self.try_text(json.dumps(document, indent=1), *arguments)

    def is_taken(self, document, *arguments):
        """Whether the program finds nothing wrong with the file; a model that is not there is another matter (1)."""
        result = self.try_shot(document, *arguments)
        self.assertIn(result.returncode, (0, 1, 2), result.stderr)
        return result.returncode != 2


class Mistakes(Shots):
    def test_the_examples_are_accepted(self):
        for name, document in EXAMPLES.items():
            with self.subTest(example=name):
                self.expect(self.try_shot(document, "--frames", "1-240"), 0)

    def test_a_mistake_is_reported_with_file_line_path_and_remedy(self):
        text = json.dumps(EXAMPLES["moving"], indent=1)
        for wrong, right, told in (
                ('"roughness": 0.3', '"roughness": 1.3', "materials[0].roughness: is out of range"),
                ('"ior": 1.33', '"ior": "glass"', "materials[0].ior: must be a number"),
                ('"metallic"', '"metalic"', "materials[0].metalic: is not known"),
                ('"step"', '"stepp"', "camera.exposure.interpolation: is not an interpolation"),
                ('"target": "glaze",\n', '\n', 'materials[1]: "target" is missing'),
                ('"hidden": false', '"hidden": 0', "nodes[0].hidden: must be true or false")):
            with self.subTest(told=told):
                self.assertEqual(text.count(wrong) > 0, True, wrong)
                changed = text.replace(wrong, right, 1)
                line = text[:text.index(wrong)].count("\n") + 1
                if "missing" in told:
                    line -= 1  # the object's own
                result = self.expect(self.try_text(changed), 2)
                self.assertIn(f"shot.json: line {line}: {told}", result.stderr)
                self.assertRegex(result.stderr.strip(), r"\([^()]+(\(5\))?\)$", "a remedy in brackets at the end")

    def test_other_mistakes_are_reported_with_what_is_near(self):
        for text, *words in (('{\n "model": "teapot.glb",\n "samples": 4,,\n}', "shot.json: line 3"),
                             ('{"samples": 4,\n"samples": 5}', "shot.json: line 2"),
                             ('{"model": "teapot.glb", "colour_map": 1, "outputs": ["%d.png"]}', "tone_map"),
                             ('{"model": "teapot.glb", "sampels": 1}', "did you mean 'samples'?")):
            self.assertIn(words[0], self.expect(self.try_text(text), 2).stderr)
        result = self.expect(farlight("animate", "--script", self.folder / "no.json"), 1)
        self.assertIn("no.json", result.stderr)

    def test_what_the_schema_cannot_say_the_program_does(self):
        for example, way, value, told in BEYOND_THE_SCHEMA:
            with self.subTest(told=told):
                result = self.expect(self.try_shot(put(EXAMPLES[example], way, value)), 2)
                self.assertIn(told, result.stderr)
                self.assertRegex(result.stderr, r"shot\.json: line \d+: ")

    def test_the_command_line_overrides_the_file(self):
        stills = EXAMPLES["stills"]
        self.assertIn("15 frames would be rendered", self.expect(self.try_shot(stills), 0).stdout)
        result = self.expect(self.try_shot(stills, "--shard", "1/1", "--frames", "1-9"), 0)
        self.assertIn("9 frames would be rendered", result.stdout)
        result = self.expect(self.try_shot(stills, "-o", self.folder / "%d.png"), 2)
        self.assertIn("--half", result.stderr, "the file's pixels do not go with the command line's output")
        self.assertEqual(self.try_shot(put(stills, ("samples",), 0), "--samples", "4").returncode, 2,
                         "a mistake is told even where the command line says something else")


class Schema(Shots):
    """Examples, and each of their values replaced by what may be wrong there: both must say the same."""

    ARGUMENTS = {"movie": ["-o", "{folder}/movie.mkv"], "stills": ["-o", "{folder}/%d.exr"]}

    def setUp(self):
        super().setUp()
        try:
            import jsonschema  # pylint: disable=import-outside-toplevel
        except ImportError:
            self.skipTest("python3-jsonschema is not installed")
        schema = json.loads(SCHEMA.read_text())
        jsonschema.Draft202012Validator.check_schema(schema)
        self.validator = jsonschema.Draft202012Validator(schema)

    def compare(self, name, document):
        arguments = self.ARGUMENTS.get(name, ["-o", "{folder}/%d.png"])
        taken = self.is_taken(document, self.model, "--frames", "1-2",
                              *(argument.format(folder=self.folder) for argument in arguments))
        self.assertEqual(taken, self.validator.is_valid(document),
                         f"{name}: {'taken' if taken else 'refused'}, but not by the schema: {json.dumps(document)}")

    def test_the_examples_and_what_only_the_program_can_see_are_valid(self):
        """Else BEYOND_THE_SCHEMA would be of what the schema does say."""
        for name, document in EXAMPLES.items():
            with self.subTest(example=name):
                self.validator.validate(document)
        for example, way, value, _ in BEYOND_THE_SCHEMA:
            with self.subTest(way=way):
                self.validator.validate(put(EXAMPLES[example], way, value))

    def test_wrong_types_get_the_same_verdict(self):
        for name, document in EXAMPLES.items():
            seen = set()
            for way in list(places(document))[::1 if farlight_test.LONG else 5]:
                # One element stands for all; what stands in a list of keys has its own test.
                kind = tuple(step if isinstance(step, str) else "[]" for step in way)
                if not way or kind in seen:
                    continue
                seen.add(kind)
                for value in ({}, "", -1e13, True, [[]]):
                    if kind[-1] in ("times", "values", "handles") and value == [[]]:
                        continue
                    with self.subTest(example=name, way=way, value=value):
                        self.compare(name, put(document, way, value))

    def test_members_too_many_and_too_few_get_the_same_verdict(self):
        for name, document in EXAMPLES.items():
            for way in list(places(document))[::1 if farlight_test.LONG else 5]:
                value = look_up(document, way)
                if isinstance(value, dict):
                    with self.subTest(example=name, way=way, change="unknown member"):
                        self.compare(name, put(document, way + ("unknown",), 1))
                numbers = isinstance(value, list) and all(isinstance(item, (int, float)) for item in value)
                if way and isinstance(way[-1], str):
                    with self.subTest(example=name, way=way, change="left out"):
                        self.compare(name, put(document, way, None))
                if numbers and way[-1] != "times" and not isinstance(value[0], bool) and "values" not in way[-1:]:
                    with self.subTest(example=name, way=way, change="a number more"):
                        self.compare(name, put(document, way, value + [0.5]))

    def test_limits_and_names_are_the_same(self):
        for example, way, values in (
                ("stills", ("samples",), (0, 1, 65536, 65537, 4.0, 4.5)),
                ("stills", ("depth",), (0, 32, 33)),
                ("stills", ("seed",), (0, 2 ** 53, 2 ** 53 + 2, -1)),
                ("stills", ("fps",), (0.001, 0, 100000, 100001)),
                ("stills", ("size",), ([1, 8192], [0, 1], [1, 8193], [1], [1, 1, 1])),
                ("stills", ("exposure",), (-64, 64, 64.5)),
                ("stills", ("shutter",), (0, 64, 64.1, -0.1)),
                ("stills", ("tracer",), ("naive", "reference", "ldc", "ldc ")),
                ("stills", ("ldc_resolution",), (0, 1, 15, 16, 4096, 4097, 512.5)),
                ("stills", ("quadtree_layers",), range(-1, 5)),
                ("stills", ("quadtree_pixels",), (0.001, 64, 64.5, -0.1)),
                ("stills", ("abuffer_resolution",), (0, 1, 15, 16, 4096, 4097, 512.5)),
                ("stills", ("abuffer_voxels",), (0, 8, 16, 17, 32, 64, 100, 128, 256, 512, -1, "auto", "all", "64", 16.5)),
                ("stills", ("abuffer_form",), ("fast", "paper", "papers")),
                ("stills", ("clamp",), (0, 1e6, 1.1e6, -0.1)),
                ("stills", ("ao_distance",), (0, 1e12, 1.1e12, -0.1)),
                ("stills", ("ao_falloff",), (0, 64, 64.5, -0.1)),
                ("stills", ("ao_rays",), (0, 1, 256, 257)),
                ("stills", ("layer_opacity",), (0, 0.001, 1, 1.01)),
                ("stills", ("layers",), ([], ["beauty"], ["ao", "ao"], ["beauty,ao"], ["z"], "beauty", [1])),
                ("stills", ("light_groups",), ({"a": ["x"]}, {}, {"rest": ["x"]}, {"a b": ["x"]}, {"a=b": ["x"]}, {"": ["x"]}, {"a": []},
                                               {"a": "x"}, {"a": [1]}, {"a": [""]}, {"a": ["x,y"]}, ["a=x"], {"a" * 31: ["x"]},
                                               {"a" * 32: ["x"]}, {f"g{i}": ["x"] for i in range(7)}, {f"g{i}": ["x"] for i in range(8)})),
                ("dolly", ("bounces",), (0, 32, 33, -1)),
                ("stills", ("quality",), (0, 1, 19)),
                ("stills", ("frames",), ("1", "1-2", "1-2:1", "1:2", "1-", "a", "1-2:", " 1")),
                ("stills", ("shard",), ("1/1", "1", "/1", "1/1/1")),
                ("stills", ("format",), ("exr", "tga")),
                ("moving", ("camera", "fov"), (0.1, 177, 0, 178)),
                ("moving", ("camera", "focus"), (0, 1e12, 1.1e12)),
                ("moving", ("materials", 0, "ior"), (1, 10, 0.9, 10.1)),
                ("moving", ("materials", 0, "metallic"), (0, 1, 1.01)),
                ("moving", ("materials", 0, "target"), (0, 0.5, 4294967295, 4294967296, "a", "")),
                ("moving", ("nodes", 1, "hidden", "interpolation"), ("linear", "step")),
                ("moving", ("nodes", 1, "rotation_degrees", "interpolation"), ("linear", "step", "bezier")),
                ("moving", ("nodes", 0, "rotation_degrees"), ([0, 0, 0],)),
                ("moving", ("camera", "eye", "interpolation"), ("cubic-spline", "linear", "catmull-rom", "step")),
                ("moving", ("outputs",), (["%d.png"], ["%d.png", "%d.png"], ["-"], ["-", "-"], ["a.mp4", "a.mkv"])),
                ("movie", ("clips", 2, "speed"), (0.001, 1000, 0, 1001)),
                ("orbit", ("camera", "orbit"), (True, False, 0, 1e6, 1e7, {}, {"degrees": 1}, {"seconds": 0}))):
            for value in values:
                with self.subTest(way=way, value=value):
                    self.compare(example, put(EXAMPLES[example], way, value))

    def test_the_schema_lists_the_names_that_the_program_knows(self):
        properties = json.loads(SCHEMA.read_text())["properties"]
        for name in ("tone_map", "filter", "tracer", "bvh_form", "quadtree_hits", "integrator", "brdf", "primary", "encoding"):
            with self.subTest(name=name):
                result = self.expect(self.try_shot({"model": "teapot.glb", name: "nonsense"}), 2)
                known = re.search(r"known: ([^)]*)\)", result.stderr).group(1).split(", ")
                for_views_alone = {"h264"}
                self.assertEqual(sorted(set(known) - for_views_alone), sorted(properties[name]["enum"]))
        result = self.expect(self.try_shot({"model": "teapot.glb", "layers": ["nonsense"]}), 2)
        known = re.search(r"known: ([^)]*)\)", result.stderr).group(1)
        self.assertEqual(sorted([*known.split(", "), "light"]), sorted(properties["layers"]["items"]["enum"]))  # stands for seven


if __name__ == "__main__":
    farlight_test.unittest.main()
