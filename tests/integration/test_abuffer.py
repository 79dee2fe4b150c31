# SPDX-License-Identifier: MIT
"""The tracer `abuffer` as a person meets it: options, pictures beside those of `bvh`, what a frame says of its lists,
limits, animation, comparison."""
import json
import os

import farlight_test
from farlight_test import Case, OneDaemon, bundled_scenes, farlight, frames_of, grid_means, private_daemon

SIZE = ["--size", "160x120"]
ABUFFER = ["--tracer", "abuffer"]
SMALL = [*ABUFFER, "--abuffer-resolution", "256", "--abuffer-voxels", "16"]  # so that searches have much to find in a voxel


class Options(Case):
    def test_each_wrong_value_is_reported_with_its_option_and_what_is_allowed(self):
        for option, value, says in (
                ("--abuffer-resolution", "15", "16 to 4096"), ("--abuffer-resolution", "4097", "4096"),
                ("--abuffer-resolution", "fine", "fine"), ("--abuffer-voxels", "100", "auto, 16, 32, 64, 128, 256"),
                ("--abuffer-voxels", "512", "auto, 16"), ("--abuffer-voxels", "8", "auto, 16"), ("--abuffer-voxels", "many", "auto, 16"),
                ("--abuffer-search", "linear2", "auto, dda, linear3, linear1, voxels3, voxels1, parity3, parity1"),
                ("--integrator", "photons", "whitted, distributed, raycast, ao, path"), ("--brdf", "phong", "ggx, ward"),
                ("--ao-distance", "-1", "-1"), ("--ao-falloff", "65", "64"), ("--ao-rays", "0", "256"),
                ("--ao-rays", "257", "256"), ("--layer-opacity", "0", "from 1e-06 to 1"), ("--layer-opacity", "1.5", "1.5"),
                ("--bounces", "33", "32")):
            for command in (["render"], ["animate", "--frames", "1-2"], ["compare", "--tracers", "abuffer,bvh"]):
                with self.subTest(option=option, value=value, command=command[0]):
                    result = self.expect(farlight(*command, bundled_scenes() / "cornell.glb", "-o",
                                                  self.folder / "%d.png", option, value), 2)
                    self.assertIn(option, result.stderr)
                    self.assertIn(says, result.stderr)
                    self.assertEqual(self.leftovers(), [])

    def test_the_grid_is_not_finer_than_the_images(self):
        result = self.expect(farlight("render", bundled_scenes() / "cornell.glb", "-o", self.folder / "x.png", *ABUFFER,
                                      "--abuffer-resolution", "64", "--abuffer-voxels", "128"), 2)
        for words in ("--abuffer-voxels: 128", "64 texels", "--abuffer-resolution"):
            self.assertIn(words, result.stderr)

    def dry_run(self, *arguments, **variables):
        return farlight("animate", bundled_scenes() / "cornell.glb", "--frames", "1-2", "-o", self.folder / "%d.png", "--dry-run",
                        *arguments, env={**os.environ, **variables})

    def test_bounces_and_depth_are_one_number(self):
        for first, second in (("--depth", "--bounces"), ("--bounces", "--depth")):
            self.expect(self.dry_run(first, "3", second, "3"), 0)
            result = self.expect(self.dry_run(first, "3", second, "0"), 2)
            self.assertIn(f"{second}: 0 contradicts {first} 3", result.stderr)
            self.assertIn("(leave out one of them)", result.stderr)
        # What is typed overrules the environment, by whichever name; two variables contradict each other.
        self.expect(self.dry_run("--bounces", "2", FARLIGHT_DEPTH="3"), 0)
        self.assertIn("FARLIGHT_", self.expect(self.dry_run(FARLIGHT_DEPTH="3", FARLIGHT_BOUNCES="2"), 2).stderr)

    def test_the_environment_gives_defaults(self):
        for name, value in (("ABUFFER_RESOLUTION", "7"), ("ABUFFER_VOXELS", "7"), ("ABUFFER_SEARCH", "x"), ("AO_RAYS", "0"),
                            ("AO_DISTANCE", "x"), ("AO_FALLOFF", "-1"), ("BRDF", "x"), ("LAYER_OPACITY", "2")):
            with self.subTest(name=name):
                result = self.expect(self.dry_run(**{f"FARLIGHT_{name}": value}), 2)
                self.assertIn(f"FARLIGHT_{name}: ", result.stderr)


class Pictures(OneDaemon):
    def picture(self, name, *options, scene="teapot.glb", **more):
        path = self.folder / f"{name}.png"
        result = self.expect(farlight("render", bundled_scenes() / scene, "-o", path, *SIZE, "--integrator", "whitted",
                                      "--primary", "trace", "--timings=json", *options, **more), 0)
        return path, frames_of(result)[0]

    def test_samples_are_shaded_as_the_surfaces_that_they_are_of(self):
        """First hits by the tracer itself. Of 255, in the mean over cells of 20 x 15 pixels: half a step where no edge is,
        and what silhouettes, a texel rough, may move where a mirror or glass repeats them. A wrong colour, texture or shadow
        is far more, and everywhere."""
        for scene in ("cornell.glb", "teapot.glb"):
            with self.subTest(scene=scene):
                means = [grid_means(self.picture(tracer, "--samples", "4", "--tracer", tracer, scene=scene)[0])
                         for tracer in ("bvh", "abuffer")]
                errors = sorted(abs(a - b) for got, want in zip(*means) for a, b in zip(got, want))
                self.assertLess(errors[len(errors) // 2], 0.5)
                self.assertLess(errors[-1], 5)

    def test_options_arrive(self):
        digests = {}
        for options in ((), ("--abuffer-search", "auto"), ("--abuffer-search", "dda"), ("--abuffer-search", "linear3"), ("--abuffer-search", "linear1"),
                        ("--abuffer-search", "voxels3"), ("--abuffer-search", "voxels1"), ("--abuffer-voxels", "32"), ("--abuffer-resolution", "200")):
            digests[options] = self.picture("x", *SMALL, *options)[1]["digest"]
        same = {digests[()], digests["--abuffer-search", "auto"], digests["--abuffer-search", "dda"]}
        self.assertEqual(len(same), 1, "auto is dda, and one picture comes of one request")
        self.assertNotIn(digests["--abuffer-search", "linear3"], same)
        searches = ("linear3", "linear1", "voxels3", "voxels1")
        self.assertEqual(len({digests["--abuffer-search", search] for search in searches}), len(searches))
        self.assertNotIn(digests["--abuffer-resolution", "200"], same)

    def test_voxels_are_chosen_by_the_resolution(self):
        """The power of two nearest to the root of three times the resolution: 27.7 of 256 texels, 32; 62 of 1280, 64."""
        for resolution, voxels in ((256, 32), (1280, 64)):
            options = [*ABUFFER, "--abuffer-resolution", resolution]
            digests = {self.picture("x", *options, *more)[1]["digest"] for more in ((), ("--abuffer-voxels", "auto"),
                                                                                     ("--abuffer-voxels", voxels))}
            self.assertEqual(len(digests), 1, resolution)

    def test_two_tracers_of_one_daemon_do_not_affect_each_other(self):
        alone = {tracer: self.picture("x", "--tracer", tracer, env=private_daemon())[1]["digest"]
                 for tracer in ("bvh", "abuffer")}
        for tracer in ("bvh", "abuffer", "bvh", "abuffer", "abuffer"):
            self.assertEqual(self.picture("x", "--tracer", tracer)[1]["digest"], alone[tracer], tracer)

    def test_rasterised_first_hits_show_the_same(self):
        means = [grid_means(self.picture(primary, *ABUFFER, "--samples", "4", "--primary", primary)[0])
                 for primary in ("raster", "trace")]
        errors = sorted(abs(a - b) for got, want in zip(*means) for a, b in zip(got, want))
        self.assertLess(errors[len(errors) // 2], 0.5)  # as beside bvh
        self.assertLess(errors[-1], 5)


class Lists(OneDaemon):
    def render(self, *arguments, status=0, **options):
        return self.expect(farlight("render", bundled_scenes() / "teapot.glb", "-o", self.folder / "x.png", *SIZE, *arguments,
                                    **options), status)

    def test_a_frame_says_how_finely_it_is_sampled(self):
        texels = {}
        for resolution in (128, 512):
            frame, = frames_of(self.render(*ABUFFER, "--abuffer-resolution", resolution, "--timings=json"))
            self.assertEqual(frame["tracer"], "abuffer")
            said = frame["structure"]
            self.assertEqual((said["resolution"], said["built"]), (resolution, True))
            self.assertGreater(said["longest_list"], 1)
            self.assertGreater(said["samples"], resolution * resolution / 4, "the floor is below much of one image")
            texels[resolution] = said["cell_metres"]
        # The box is the same; a texel or two of it may be a margin.
        self.assertAlmostEqual(texels[128] / texels[512], 4, delta=0.1)

    def test_the_table_of_timings_describes_the_structure(self):
        text = self.render(*ABUFFER, "--abuffer-resolution", "128", "--timings").stdout
        self.assertRegex(text, r"structure +resolution 128, cell [0-9.]+ m?m, samples \d+, longest list \d+; built for 1 of 1 frame\n")

    def test_a_scene_that_needs_more_than_it_may_is_refused_with_the_remedy(self):
        result = self.render(*ABUFFER, status=1, env=private_daemon(FARLIGHT_MEMORY_ABUFFER="1M"))
        for words in ("memory.abuffer", "lower"):
            self.assertIn(words, result.stderr)
        self.assertEqual(self.leftovers(), [])

    def test_exr_metadata_holds_the_size_of_a_texel(self):
        path = self.folder / "x.exr"
        self.expect(farlight("render", bundled_scenes() / "teapot.glb", "-o", path, *SIZE, *SMALL), 0)
        self.assertIn("farlight/structure/cell_metres", farlight_test.exr_attributes(path))


class Animations(OneDaemon):
    def test_what_moves_is_drawn_anew_and_what_stands_still_is_not(self):
        result = self.expect(farlight("animate", bundled_scenes() / "carousel.glb", "--clip", "ride", "--frames", "1-3",
                                      "--fps", "8", "-o", self.folder / "%d.png", *SIZE, *SMALL, "--timings=json"), 0)
        self.assertEqual([frame["structure"]["built"] for frame in frames_of(result)], [True] * 3)
        result = self.expect(farlight("animate", bundled_scenes() / "teapot.glb", "--orbit", "--frames", "1-3",
                                      "-o", self.folder / "%d.png", *SIZE, *SMALL, "--timings=json"), 0)
        self.assertEqual([frame["structure"]["built"] for frame in frames_of(result)], [True, False, False])

    def test_what_moves_while_the_shutter_is_open_is_refused(self):
        result = self.expect(farlight("animate", bundled_scenes() / "carousel.glb", "--clip", "ride", "--frames", "1-2",
                                      "--shutter", "0.5", "-o", self.folder / "%d.png", *SIZE, *SMALL), 1)
        for words in ("shutter", "abuffer", "another tracer"):
            self.assertIn(words, result.stderr)
        self.assertEqual(self.leftovers(), [])


class Comparison(OneDaemon):
    def test_rays_agree_with_the_reference(self):
        """99 % of the rays hit with both or miss with both, as is wanted of closed meshes."""
        result = farlight("compare", bundled_scenes() / "teapot.glb", "--tracers", "abuffer,reference", *SIZE, "--json")
        if "libembree-dev" in result.stderr:
            self.skipTest("this farlightd was built without Embree")
        report = json.loads(self.expect(result, 0).stdout)
        self.assertEqual((report["tracer"], report["integrator"]), ("abuffer", "whitted"))
        self.assertIn(report["structure"]["resolution"], range(128, 1280))  # of a small picture
        for kind in ("primary", "secondary"):
            waves = [wave for wave in report["waves"] if wave["kind"] == kind]
            agreed, rays = (sum(wave[key] for wave in waves for key in keys) for keys in
                            (("both_hit", "both_missed"), ("rays",)))
            self.assertGreater(rays, 1000)
            self.assertGreaterEqual(agreed / rays, 0.99, kind)
        text = self.expect(farlight("compare", bundled_scenes() / "teapot.glb", "--tracers", "abuffer,bvh", "--abuffer-search",
                                    "linear1", "--abuffer-resolution", "1280", *SIZE), 0).stdout
        self.assertIn("abuffer against bvh", text)
        self.assertIn("structure: resolution 1280, cell ", text)


if __name__ == "__main__":
    farlight_test.unittest.main()
