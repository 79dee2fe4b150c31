# SPDX-License-Identifier: MIT
"""Denoised pictures of bundled and shared scenes are no farther from converged ones than noisy ones are."""
import math

from farlight_test import SHARED_SCENES, OneDaemon, bundled_scenes, farlight, frames_of, long_test, needs_shared_scenes, read_exr, read_png

SIZE = ["--size", "80x45"]
SCENES = ("cornell.glb", "teapot.glb", "carousel.glb", "sphereflake-3.nff")
# Highlights that few samples miss and many show weigh alike in both pictures, so that what is left of them decides: a
# thousandth either way. More is never lost where anything is gained.
AS_GOOD = 1.005
# Black tiles that mirror among white ones that scatter, which grow smaller than a pixel: light differs from one to the next, and
# nothing there is rare.
TILES = "ldc/reflection_scene.gltf"
# The last ones have little noise to lose, and detail: tiny facets, folds smaller than a pixel, texture.
SHARED = ("bvh/spider.obj", "bvh/spd-gears-2.nff", "gltf/DamagedHelmet.glb", TILES, "bvh/spd-balls-4.nff", "gltf/Fox.glb",
          "gltf/sampleroom.gltf", "gltf/spot.obj", "bvh/spd-teapot.nff", "bvh/spd-tetra.nff", "ldc/igea-bust.glb",
          "ldc/CesiumMan.glb")
SEEDS = ("1", "2", "3")


def distance(a, b):
    """Root mean square difference of display values, 0 to 255."""
    pairs = [(x, y) for p, q in zip(a, b) for x, y in zip(p[:3], q[:3])]
    return math.sqrt(sum((x - y) ** 2 for x, y in pairs) / len(pairs))


class Denoise(OneDaemon):
    def render(self, scene, *options, name="x.png"):
        path = self.folder / name
        result = farlight("render", bundled_scenes() / scene, "-o", path, *SIZE, "--timings=json", *options)
        return path, frames_of(self.expect(result, 0))[0]

    def picture(self, *arguments):
        _, _, rows, channels = read_png(self.render(*arguments)[0])
        return [row[x:x + 3] for row in rows for x in range(0, len(row), channels)]

    def digest(self, *arguments):
        return self.render(*arguments)[1]["digest"]

    def test_no_scene_is_worse_for_it(self):
        for scene in SCENES:
            for integrator in ("path", "distributed"):
                options = [scene, "--integrator", integrator]
                truth = self.picture(*options, "--samples", "64", "--seed", "7")
                for samples in ("1", "4", "16"):
                    with self.subTest(scene=scene, integrator=integrator, samples=samples):
                        few = [*options, "--samples", samples]
                        noisy, denoised = distance(self.picture(*few), truth), distance(self.picture(*few, "--denoise"), truth)
                        self.assertLessEqual(denoised, AS_GOOD * noisy)

    def ratio(self, options, samples, truth, seeds):
        """The error of denoised pictures to that of noisy ones, root of the means over seeds."""
        sums = [0.0, 0.0]
        for seed in seeds:
            few = [*options, "--samples", samples, "--seed", seed]
            for i, more in enumerate(((), ("--denoise",))):
                sums[i] += distance(self.picture(*few, *more), truth) ** 2
        return math.sqrt(sums[1] / sums[0])

    @needs_shared_scenes
    def test_tiles_that_mirror_and_scatter_are_no_worse_for_it_at_all(self):
        options = [SHARED_SCENES / TILES, "--integrator", "distributed"]
        truth = self.picture(*options, "--samples", "64", "--seed", "7")
        self.assertLessEqual(self.ratio(options, "16", truth, ("0",)), 1.0)

    @long_test
    @needs_shared_scenes
    def test_nor_are_scenes_of_many_kinds_with_many_samples(self):
        """Over three seeds, as of one a single highlight may decide."""
        for scene in [*(bundled_scenes() / name for name in SCENES), *(SHARED_SCENES / name for name in SHARED)]:
            options = [scene, "--integrator", "distributed"]
            truth = self.picture(*options, "--samples", "256", "--seed", "7")
            for samples in ("16", "64"):
                with self.subTest(scene=scene.name, samples=samples):
                    self.assertLessEqual(self.ratio(options, samples, truth, SEEDS), AS_GOOD)

    def test_more_than_a_third_of_the_noise_of_a_room_is_gone(self):
        """Of four samples. The truth's noise, a thirty-second of it, counts in both."""
        options = ["cornell.glb", "--integrator", "path"]
        truth, noisy, denoised = (self.picture(*options, *more) for more in (
            ("--samples", "128", "--seed", "7"), ("--samples", "4"), ("--samples", "4", "--denoise")))
        self.assertLess(distance(denoised, truth), 0.65 * distance(noisy, truth))

    def test_so_are_a_third_of_eight_samples_in_a_room_and_a_fifth_among_mirrors(self):
        for scene, left in (("cornell.glb", 0.667), ("sphereflake-3.nff", 0.79)):
            with self.subTest(scene=scene):
                options = [scene, "--integrator", "distributed"]
                truth = self.picture(*options, "--samples", "128", "--seed", "7")
                self.assertLess(self.ratio(options, "8", truth, ("0",)), left)

    def test_the_option_says_whether_and_the_same_request_gives_the_same_bytes(self):
        options = ["cornell.glb", "--integrator", "path", "--samples", "2"]
        plain, denoised = self.digest(*options), self.digest(*options, "--denoise")
        self.assertNotEqual(plain, denoised)
        for same, words in ((plain, ["--denoise=off"]), (denoised, ["--denoise=on"]), (denoised, ["--denoise=auto"]),
                            (denoised, ["--denoise"])):
            self.assertEqual(self.digest(*options, *words), same, words)
        by_noise = [*options[:-2], "--samples", "64", "--noise", "0.2"]
        self.assertNotEqual(self.digest(*by_noise), self.digest(*by_noise, "--denoise"))
        refused = farlight("render", bundled_scenes() / "cornell.glb", "-o", self.folder / "x.png", "--denoise=much")
        self.assertIn("known: off, on, auto", self.expect(refused, 2).stderr)

    def test_only_the_beauty_of_layers_is_filtered(self):
        options = ["cornell.glb", "--integrator", "path", "--samples", "2", "--float", "--layers", "beauty,albedo,normal,depth"]
        plain, denoised = (read_exr(self.render(*options, *more, name="x.exr")[0])[2] for more in ((), ("--denoise",)))
        changed = {name for name in plain if plain[name] != denoised[name]}
        self.assertEqual(changed, {"R", "G", "B"})
