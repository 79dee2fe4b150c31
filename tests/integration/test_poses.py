# SPDX-License-Identifier: MIT
"""Skins, morph targets and clips against poses worked out here, by a reader of glTF that shares nothing with the
project (gltf_pose.py)."""
import math
import random

import farlight_test
from farlight_test import (LONG, SHARED_SCENES, Case, Daemon, bundled_scenes, daemon_pose, farlight, long_test, needs_shared_scenes,
                           read_png)
from gltf_pose import Model, Writer, unit, write_still

# Numbers travel as 32-bit floats (rounding 6e-8) through matrices of up to twenty nodes, each rounded once more.
PLACE_TOLERANCE = 2e-6  # of the model's size
# The same, and lengths of sums of joints' matrices near 0.1 in sharp bends, which magnify it.
NORMAL_TOLERANCE = 1e-3
MODELS = ("gltf/Fox.glb", "ldc/CesiumMan.glb", "gltf/MorphStressTest.gltf", "gltf/khronos/SimpleSkin.gltf",
          "gltf/khronos/simple_skin/simple_skin.gltf", "gltf/khronos/AnimatedMorphCube-glTF/AnimatedMorphCube.gltf")


def own_pose(model, animation, time):
    return [(place, normal) for part in model.parts(animation, time)
            for place, normal in zip(part.positions, part.normals or [None] * len(part.positions))]


def size_of(corners):
    bounds = [(min(p[i] for p, _ in corners), max(p[i] for p, _ in corners)) for i in range(3)]
    return math.dist([low for low, _ in bounds], [high for _, high in bounds])


class PoseCase(Case):
    def compare(self, path, animation, times):
        """Maximum distance between the two, as a share of the model's size."""
        model, maximum = Model(path), 0.0
        for time, theirs in zip(times, daemon_pose(path, animation, times)):
            ours = own_pose(model, animation, time)
            self.assertEqual(len(theirs), len(ours))
            size = size_of(ours)
            for (place, normal), (their_place, their_normal) in zip(ours, theirs):
                apart = math.dist(place, their_place) / size
                maximum = max(maximum, apart)
                self.assertLess(apart, PLACE_TOLERANCE, f"clip {animation} at {time}: {their_place} for {place}")
                if normal and any(their_normal):
                    self.assertLess(math.dist(normal, their_normal), NORMAL_TOLERANCE,
                                    f"clip {animation} at {time}: normal {their_normal} for {normal}")
        return maximum


class Files(PoseCase):
    def check(self, path):
        """All clips at one of two times, which are farther apart than the tolerance (or this could not fail), and at rest."""
        model = Model(path)
        for animation in range(len(model.json["animations"])):
            begin, end = model.times(animation)
            with self.subTest(model=path.name, clip=animation):
                times = [begin + share * (end - begin) for share in (0.3, 0.45)]
                self.compare(path, animation, times[:1])
                first, second = daemon_pose(path, animation, times)
                apart = max(math.dist(a, b) for (a, _), (b, _) in zip(first, second)) / size_of(first)
                self.assertGreater(apart, 1000 * PLACE_TOLERANCE)
        self.compare(path, None, [0.0])

    @long_test
    def test_every_vertex_of_the_bundled_scene_is_where_glTF_says(self):
        """Its clip has every kind of motion, and ends as it began."""
        path = bundled_scenes() / "carousel.glb"
        self.check(path)
        model = Model(path)
        clip, = model.json["animations"]
        self.assertEqual({s["interpolation"] for s in clip["samplers"]}, {"LINEAR", "STEP", "CUBICSPLINE"})
        self.assertEqual({c["target"]["path"] for c in clip["channels"]}, {"translation", "rotation", "weights"})
        first, last = model.pose(0, 0.0), model.pose(0, 3.0)
        for key, value in first.items():
            # A quaternion and its negative are one rotation.
            sign = -1 if key[1] == "rotation" and sum(a * b for a, b in zip(value, last[key])) < 0 else 1
            self.assertLess(math.dist(value, [sign * x for x in last[key]]), 1e-5, key)

    @needs_shared_scenes
    def test_every_clip_moves_every_vertex_to_where_glTF_says(self):
        for name in MODELS if LONG else MODELS[-4:]:
            self.check(SHARED_SCENES / name)


class Pictures(PoseCase):
    """A clip's picture at a time against one of a file without skins, targets and animations, whose vertices were moved
    here. The same places to a millionth of the model's size, which is a ten thousandth of a pixel here: only a pixel
    whose middle lies so close to an edge, or to the edge of a shadow, may show another surface."""

    DIFFERENT = 1e-3  # share of the pixels; by more than 2 of 255 in a channel
    FRAMES = 3        # the later ones show that no tree and no vertices of an earlier one are left
    # A ground stays where it is for all of a clip, and is elsewhere beneath a model that holds one pose.
    OPTIONS = ("--size", "96x72", "--samples", "1", "--depth", "2", "--quiet", "--studio", "off", "--denoise=off")

    def different(self, a, b):
        (width, height, ours, channels), (_, _, theirs, _) = read_png(a), read_png(b)
        count = sum(any(abs(x - y) > 2 for x, y in zip(row[at:at + channels], other[at:at + channels]))
                    for row, other in zip(ours, theirs) if row != other for at in range(0, len(row), channels))
        return count / (width * height)

    def compare_pictures(self, daemon, path, animation, camera, tracers):
        model = Model(path)
        begin, end = model.times(animation)
        start, speed = begin + 0.3 * (end - begin), 0.17 * (end - begin)
        stills = [self.folder / f"still-{frame}.gltf" for frame in range(self.FRAMES)]
        for frame, still in enumerate(stills):
            write_still(model, animation, start + frame * speed, still)
        options = ["--server", daemon.address, *camera, *self.OPTIONS]
        for tracer in tracers:
            result = farlight("animate", path, "--clip", animation, "--clip-once", "--clip-start", repr(-start / speed), "--clip-speed",
                              repr(speed), "--fps", "1", "--frames", f"0-{self.FRAMES - 1}", *options, "--tracer", tracer, "--primary",
                              "trace", "-o", self.folder / "clip-%d.png")
            if tracer == "reference" and "libembree-dev" in result.stderr:
                continue
            self.expect(result, 0)
            for frame, still in enumerate(stills):
                self.expect(farlight("render", still, *options, "--primary", "trace", "-o", still.with_suffix(".png")), 0)
                different = self.different(self.folder / f"clip-{frame}.png", still.with_suffix(".png"))
                self.assertLessEqual(different, self.DIFFERENT, f"{tracer}, frame {frame}")
            self.assertGreater(self.different(*(still.with_suffix(".png") for still in stills[-2:])), 5 * self.DIFFERENT,
                               "or this could not fail")

    def test_a_clip_gives_the_picture_of_the_moved_vertices(self):
        made = Made([{"mesh": 0, "skin": 0}, {}, {"translation": [0, 1, 0]}])
        made.mesh({"JOINTS_0": made.accessor("VEC4", [(0, 1, 0, 0)] * 4, 5121),
                   "WEIGHTS_0": made.accessor("VEC4", [(1 - w, w, 0, 0) for w in (0, 0.25, 0.5, 1)])},
                  primitive={"targets": [{"POSITION": made.accessor("VEC3", [(0, 0, 0), (1, 0, 0), (0, 0, 1), (0, 1, 0)])}]})
        made.json["skins"] = [{"joints": [1, 2]}]
        made.animate(0, "weights", [0, 2], [0.0, 1.0])
        made.animate(2, "rotation", [0, 1, 2], [(0, 0, 0, 1), unit((1, 0, 1, 2)), unit((0, 1, 0, 1))])
        path = self.folder / "model.gltf"
        path.write_text(made.text(), encoding="utf-8")
        with Daemon() as daemon:
            self.compare_pictures(daemon, path, 0, ("--eye", "4,3,7", "--look-at", "0.5,0.8,1"), ("bvh", "reference"))

    @long_test
    @needs_shared_scenes
    def test_clips_of_published_models_give_the_pictures_of_the_moved_vertices(self):
        with Daemon() as daemon:
            for name in MODELS:
                model = Model(SHARED_SCENES / name)
                last = len(model.json["animations"]) - 1
                corners = own_pose(model, last, model.times(last)[0])
                low, high = ([end(p[i] for p, _ in corners) for i in range(3)] for end in (min, max))
                middle = [(a + b) / 2 for a, b in zip(low, high)]
                eye = [m + math.dist(low, high) * x for m, x in zip(middle, (0.55, 0.45, 0.8))]
                with self.subTest(model=name):
                    self.compare_pictures(daemon, SHARED_SCENES / name, last,
                                          ("--eye", ",".join(map(repr, eye)), "--look-at", ",".join(map(repr, middle))), ("bvh",))


# A tetrahedron without any symmetry.
CORNERS = [(0, 0, 0), (1, 0, 0.25), (0, 2, 0), (0.5, 0.25, 3)]
FACES = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]


class Made(Writer):
    """A file with nodes and one animation."""

    def __init__(self, nodes, **more):
        super().__init__()
        self.json.update({"nodes": nodes, "meshes": [], "animations": [{"samplers": [], "channels": []}], **more})

    def mesh(self, attributes=None, **more):
        position = self.accessor("VEC3", CORNERS)
        primitive = {"attributes": {"POSITION": position, **(attributes or {})},
                     "indices": self.accessor("SCALAR", FACES, 5123)}
        primitive.update(more.pop("primitive", {}))
        self.json["meshes"].append({"primitives": [primitive], **more})
        return len(self.json["meshes"]) - 1

    def animate(self, node, path, times, values, interpolation="LINEAR", component=5126, **more):
        kind = {"translation": "VEC3", "scale": "VEC3", "rotation": "VEC4", "weights": "SCALAR"}[path]
        animation = self.json["animations"][0]
        animation["samplers"].append({"input": self.accessor("SCALAR", times, min=[min(times)], max=[max(times)]),
                                      "output": self.accessor(kind, values, component, **more),
                                      "interpolation": interpolation})
        animation["channels"].append({"sampler": len(animation["samplers"]) - 1, "target": {"node": node, "path": path}})


class MadeFiles(PoseCase):
    TIMES = [-0.5, 0.0, 0.2, 0.5, 0.75, 1.0, 1.3, 2.0, 2.9, 3.0, 7.0]
    KEYS = [0.5, 1.0, 3.0]

    def setUp(self):
        super().setUp()
        self.random = random.Random(20)

    def vector(self, low=-2.0, high=2.0, count=3):
        return tuple(self.random.uniform(low, high) for _ in range(count))

    def keys(self, interpolation, make):
        """Values for KEYS; tangents where the interpolation wants some."""
        values = []
        for _ in self.KEYS:
            values += [self.vector(count=len(make())), make(), self.vector(count=len(make()))] \
                if interpolation == "CUBICSPLINE" else [make()]
        return values

    def save(self, made, name="model.gltf"):
        path = self.folder / name
        path.write_text(made.text(), encoding="utf-8")
        return path

    def test_every_interpolation_of_every_transform(self):
        for interpolation in ("STEP", "LINEAR", "CUBICSPLINE"):
            for path, make in (("translation", self.vector), ("scale", self.vector),
                               ("rotation", lambda: unit(self.vector(-1, 1, 4)))):
                with self.subTest(interpolation=interpolation, path=path):
                    # Below a turned and stretched parent; what the clip leaves alone stays, a mirroring scale too.
                    made = Made([{"children": [1], "scale": [1, -2, 0.5], "rotation": unit((1, 2, 3, 4))},
                                 {"mesh": 0, "scale": [-1, 2, 3], "rotation": unit((4, -3, 2, 1)),
                                  "translation": [1, 2, 3]}])
                    made.mesh()
                    made.animate(1, path, self.KEYS, self.keys(interpolation, make), interpolation)
                    self.compare(self.save(made), 0, self.TIMES)

    def test_rotations_go_the_shorter_way_and_scales_through_zero(self):
        """A mesh is mirrored from half of the time on where its scale changes sign."""
        for path, values in (("rotation", [unit((0, 0, 0.1, 1)), tuple(-x for x in unit((0, 0, 0.9, 1)))]),
                             ("scale", [(1, 1, 1), (-1, 1, 2)])):
            made = Made([{"mesh": 0, "rotation": unit((1, 1, 0, 1))}])
            made.mesh()
            made.animate(0, path, [0, 1], values)
            self.compare(self.save(made), 0, [0, 0.25, 0.75, 1])

    def test_small_integers_as_rotations_and_weights(self):
        made = Made([{"mesh": 0}])
        made.mesh(primitive={"targets": [{"POSITION": made.accessor("VEC3", [self.vector() for _ in CORNERS])}
                                         for _ in range(2)]})
        for component, maximum in ((5122, 32767), (5120, 127)):
            with self.subTest(component=component):
                made.json["animations"] = [{"samplers": [], "channels": []}]
                made.animate(0, "rotation", self.KEYS, [tuple(round(maximum * x) for x in unit(self.vector(-1, 1, 4)))
                                                        for _ in self.KEYS], "LINEAR", component, normalized=True)
                made.animate(0, "weights", self.KEYS, [self.random.randrange(256) for _ in range(6)], "LINEAR", 5121,
                             normalized=True)
                self.compare(self.save(made), 0, self.TIMES)

    def test_weights_of_morph_targets_with_every_interpolation(self):
        for interpolation in ("STEP", "LINEAR", "CUBICSPLINE"):
            made = Made([{"mesh": 0}, {"mesh": 0, "weights": [0.5, 0, -1], "translation": [5, 0, 0]}])
            targets = [{"POSITION": made.accessor("VEC3", [self.vector() for _ in CORNERS]),
                        "NORMAL": made.accessor("VEC3", [self.vector(-0.2, 0.2) for _ in CORNERS])} for _ in range(2)]
            targets.append({"NORMAL": targets[0]["NORMAL"]})  # moves nothing, and has to be counted all the same
            made.mesh({"NORMAL": made.accessor("VEC3", [unit(self.vector(1, 2)) for _ in CORNERS])},
                      primitive={"targets": targets}, weights=[0.25, 1, 0])
            count = 3 * len(self.KEYS) * (3 if interpolation == "CUBICSPLINE" else 1)
            made.animate(0, "weights", self.KEYS, list(self.vector(-1, 1, count)), interpolation)
            with self.subTest(interpolation=interpolation):
                self.compare(self.save(made), 0, self.TIMES)
                self.compare(self.save(made), None, [0])

    def skin(self, made, joints, matrices=None):
        skin = {"joints": joints}
        if matrices:
            skin["inverseBindMatrices"] = made.accessor("MAT4", matrices)
        made.json.setdefault("skins", []).append(skin)
        return len(made.json["skins"]) - 1

    def weights(self, made, joints, sets=1):
        """Attributes that spread each vertex over random joints."""
        attributes = {}
        for number in range(sets):
            attributes[f"JOINTS_{number}"] = made.accessor(
                "VEC4", [tuple(self.random.randrange(joints) for _ in range(4)) for _ in CORNERS], 5121)
            attributes[f"WEIGHTS_{number}"] = made.accessor("VEC4", [self.vector(0, 1, 4) for _ in CORNERS])
        return attributes

    def test_one_mesh_with_two_skins_and_with_none(self):
        """Joints come after the mesh in the file, one is outside the scene, and the node's own place does not count."""
        made = Made([{"mesh": 0, "skin": 0, "translation": [100, 0, 0]}, {"mesh": 0, "skin": 1}, {"mesh": 0},
                     {"children": [4], "translation": [1, 0, 0]}, {"rotation": unit((0, 1, 0, 3))},
                     {"children": [6], "scale": [2, 1, 1]}, {"translation": [0, 3, 0]}],
                    scenes=[{"nodes": [0, 1, 2, 3]}], scene=0)
        made.mesh(self.weights(made, 2))
        matrices = [tuple(x for column in range(4) for x in (*self.vector(-1, 1), 1.0 if column == 3 else 0.0))
                    for _ in range(2)]
        self.skin(made, [4, 3], matrices)
        self.skin(made, [6, 4])
        made.animate(4, "rotation", self.KEYS, [unit(self.vector(-1, 1, 4)) for _ in self.KEYS])
        made.animate(6, "translation", self.KEYS, [self.vector() for _ in self.KEYS])
        path = self.save(made)
        self.compare(path, 0, self.TIMES)
        self.compare(path, None, [0])

    def test_up_to_sixteen_joints_move_a_vertex(self):
        for sets in (1, 2, 4):
            made = Made([{"mesh": 0, "skin": 0}] + [{"translation": self.vector()} for _ in range(20)])
            made.mesh(self.weights(made, 20, sets))
            self.skin(made, list(range(1, 21)))
            for joint in range(1, 21, 3):
                made.animate(joint, "translation", self.KEYS, [self.vector() for _ in self.KEYS])
            with self.subTest(sets=sets):
                self.compare(self.save(made), 0, self.TIMES)

    def test_skin_and_morph_targets_at_once(self):
        made = Made([{"mesh": 0, "skin": 0}, {}, {"translation": [0, 1, 0]}])
        made.mesh(self.weights(made, 2),
                  primitive={"targets": [{"POSITION": made.accessor("VEC3", [self.vector() for _ in CORNERS])}]})
        self.skin(made, [1, 2])
        made.animate(0, "weights", self.KEYS, [0.0, 1.0, -0.5])
        made.animate(2, "rotation", self.KEYS, [unit(self.vector(-1, 1, 4)) for _ in self.KEYS])
        self.compare(self.save(made), 0, self.TIMES)

    def test_an_animated_matrix_is_decomposed(self):
        """glTF forbids it; where the clip changes one of the parts, the others stay as the matrix has them."""
        turned = Made([{"mesh": 0, "matrix": [0, 2, 0, 0, -3, 0, 0, 0, 0, 0, 0.5, 0, 1, 2, 3, 1]}])
        turned.mesh()
        turned.animate(0, "translation", [0, 1], [(0, 0, 0), (4, 5, 6)])
        theirs, = daemon_pose(self.save(turned), 0, [0.5])
        parts = Made([{"mesh": 0, "translation": [1, 2, 3], "scale": [2, 3, 0.5],
                       "rotation": unit((0, 0, 1, 1))}])
        parts.mesh()
        parts.animate(0, "translation", [0, 1], [(0, 0, 0), (4, 5, 6)])
        for (place, _), (their_place, _) in zip(own_pose(Model(self.save(parts, "parts.gltf")), 0, 0.5), theirs):
            self.assertLess(math.dist(place, their_place), 1e-5)


if __name__ == "__main__":
    farlight_test.unittest.main()
