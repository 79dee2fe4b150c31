# SPDX-License-Identifier: MIT
"""The tracer `ldc` as a person meets it: options, what a frame says of its structure, comparison, animation."""
import json
import os

import farlight_test
from farlight_test import Case, OneDaemon, bundled_scenes, farlight, frames_of, grid_means, private_daemon, read_png

SIZE = ["--size", "160x120"]
LDC = ["--tracer", "ldc"]


def build_ms(frame, cube):
    """What building took; cube: 0 static, 1 dynamic. Looking whether a table of the lights is still right is in 0, too."""
    return sum(stage["duration_ns"] for stage in frame["stages"]
               if (stage["stage"], stage["wave"], stage["clock"]) == ("build", cube, "cpu")) / 1e6


class Options(Case):
    def test_each_wrong_value_is_reported_with_its_option_and_what_is_allowed(self):
        for option, value, says in (
                ("--ldc-resolution", "15", "16 to 4096"), ("--ldc-resolution", "4097", "4096"),
                ("--ldc-resolution", "fine", "fine"), ("--ldc-block", "12", "2, 4, 8, 16, 32"),
                ("--ldc-block", "64", "32"), ("--ldc-rays", "2", "auto, 1, 4"), ("--ldc-rays", "8", "4"),
                ("--ldc-build", "magic", "auto, peel, lists"), ("--ldc-levels", "tree", "auto, blocks, pyramid, cells"),
                ("--ldc-images", "two", "overlap, one"),
                ("--ldc-tolerance", "-1", "-1"), ("--ldc-tolerance", "nan", "nan")):
            for command in (["render"], ["animate", "--frames", "1-2"], ["compare", "--tracers", "ldc,bvh"]):
                with self.subTest(option=option, value=value, command=command[0]):
                    result = self.expect(farlight(*command, bundled_scenes() / "cornell.glb", "-o",
                                                  self.folder / "%d.png", option, value), 2)
                    self.assertIn(option, result.stderr)
                    self.assertIn(says, result.stderr)
                    self.assertEqual(self.leftovers(), [])

    def test_cells_and_a_tolerance_do_not_go_together(self):
        result = self.expect(farlight("render", bundled_scenes() / "cornell.glb", "-o", self.folder / "x.png", *LDC,
                                      "--ldc-levels", "cells", "--ldc-tolerance", "0.1"), 2)
        self.assertIn("--ldc-levels: cells cannot be combined with --ldc-tolerance (leave out one of them)", result.stderr)

    def test_the_environment_gives_defaults(self):
        result = farlight("render", bundled_scenes() / "cornell.glb", "-o", self.folder / "x.png",
                          env={**os.environ, "FARLIGHT_LDC_RESOLUTION": "7"})
        self.expect(result, 2)
        self.assertIn("FARLIGHT_LDC_RESOLUTION", result.stderr)


class Pictures(OneDaemon):
    def test_samples_are_shaded_as_the_surfaces_that_they_are_of(self):
        """First hits by the tracer itself. Of 255, in the mean over cells of 20 x 15 pixels: half a step where no edge is,
        and what silhouettes, a cell of the cube rough, may move where a mirror or glass repeats them: so the cells are fine.
        A wrong colour, texture or shadow is far more, and everywhere."""
        for scene in ("cornell.glb", "teapot.glb"):
            with self.subTest(scene=scene):
                paths = {tracer: self.folder / f"{tracer}.png" for tracer in ("bvh", "ldc")}
                for tracer, path in paths.items():
                    self.expect(farlight("render", bundled_scenes() / scene, "-o", path, *SIZE, "--samples", "4", "--primary",
                                         "trace", "--integrator", "whitted", "--tracer", tracer, "--ldc-resolution", "1024"), 0)
                errors = sorted(abs(a - b) for got, want in zip(*map(grid_means, paths.values())) for a, b in zip(got, want))
                self.assertLess(errors[len(errors) // 2], 0.5)
                self.assertLess(errors[-1], 5)

    def picture(self, *options):
        path = self.folder / "x.png"
        self.expect(farlight("render", bundled_scenes() / "teapot.glb", "-o", path, *SIZE, *LDC, "--primary", "trace",
                             "--ldc-resolution", "256", *options), 0)
        return path

    def test_the_same_picture_comes_of_every_build(self):
        """Cells and lists are filled by many invocations at once, in whatever order."""
        for levels in ("cells", "pyramid"):
            pictures = [read_png(self.picture("--ldc-levels", levels, "--ldc-build", build))
                        for build in ("peel", "lists", "lists", "lists")]
            for picture in pictures[1:]:
                self.assertEqual(picture, pictures[0])

    def test_all_levels_lead_to_the_same_samples(self):
        """In the mean over a cell of 300 pixels 0.85 of 255 is one pixel that went from black to white. Two of them: rays that
        pass within rounding of where a sample ends, of which there are many at 256 cells."""
        wanted = grid_means(self.picture())
        for options in (["--ldc-levels", "blocks", "--ldc-block", "4"], ["--ldc-levels", "pyramid"], ["--ldc-levels", "cells"],
                        ["--ldc-rays", "4"]):
            with self.subTest(options=options):
                for got, want in zip(grid_means(self.picture(*options)), wanted):
                    for channel in range(3):
                        self.assertAlmostEqual(got[channel], want[channel], delta=1.7)

    def test_images_that_do_not_overlap_show_the_same_but_for_cracks(self):
        errors = sorted(abs(a - b) for got, want in zip(grid_means(self.picture("--ldc-images", "one")),
                                                        grid_means(self.picture())) for a, b in zip(got, want))
        self.assertLess(errors[len(errors) // 2], 0.5)
        self.assertLess(errors[-1], 10)


class Structure(OneDaemon):
    def render(self, *arguments, **options):
        return self.expect(farlight("render", bundled_scenes() / "teapot.glb", "-o", self.folder / "x.png", *SIZE, *arguments,
                                    **options), 0)

    def test_a_frame_says_how_finely_it_is_sampled(self):
        cells = {}
        for resolution in (128, 512):
            frame, = frames_of(self.render(*LDC, "--ldc-resolution", resolution, "--timings=json"))
            said = frame["structure"]
            self.assertEqual({name.split("/")[0] for name in said}, {"static"})
            self.assertEqual((said["static/resolution"], said["static/built"]), (resolution, True))
            self.assertEqual((said["static/layers_kept"], said["static/samples_lost"]), (said["static/layers_needed"], 0))
            self.assertGreater(said["static/samples"], 0)
            self.assertEqual(frame["warnings"], [])
            cells[resolution] = said["static/cell_metres"]
        # The box is the same; a cell or two of it may be a margin.
        self.assertAlmostEqual(cells[128] / cells[512], 4, delta=0.1)
        frame, = frames_of(self.render("--timings=json"))
        self.assertEqual(set(frame["structure"]), {"nodes", "nodes_rebuilt", "nodes_refitted"})

    def test_the_table_of_timings_describes_the_structure(self):
        text = self.render(*LDC, "--ldc-resolution", "128", "--timings").stdout
        self.assertRegex(text, r"structure +static +resolution 128, cell [0-9.]+ m?m, layers needed \d+, layers kept \d+, "
                               r"samples \d+, samples lost 0; built for 1 of 1 frame\n")

    def test_layers_that_a_limit_drops_are_reported_with_the_remedy(self):
        result = self.render(*LDC, "--ldc-resolution", "128", "--timings=json",
                             env=private_daemon(FARLIGHT_LIMITS_LDC_LAYERS="1"))
        frame, = frames_of(result)
        said = frame["structure"]
        self.assertEqual(said["static/layers_kept"], 1)
        self.assertGreater(said["static/layers_needed"], 1)
        self.assertGreater(said["static/samples_lost"], 0)
        warning, = frame["warnings"]
        self.assertIn(f"warning: frame 0: {warning}", result.stderr)
        for words in ("the static cube has 1 of ", f"{said['static/samples_lost']} samples", "limits.ldc_layers"):
            self.assertIn(words, warning)

    def test_memory_is_a_limit_too(self):
        arguments = ["render", bundled_scenes() / "cornell.glb", "-o", self.folder / "x.png", *SIZE, *LDC, "--ldc-resolution",
                     "512", "--timings=json"]
        result = self.expect(farlight(*arguments, env=private_daemon(FARLIGHT_MEMORY_LDC="12M")), 0)
        said = frames_of(result)[0]["structure"]
        self.assertLess(said["static/layers_kept"], said["static/layers_needed"])
        self.assertGreater(said["static/samples_lost"], 0)
        self.assertIn("memory.ldc", result.stderr)
        result = self.expect(farlight(*arguments, env=private_daemon(FARLIGHT_MEMORY_LDC="1M")), 1)
        self.assertIn("no room for one layer", result.stderr)
        self.assertIn("take a lower resolution, or allow it more memory", result.stderr)

    def test_exr_metadata_holds_the_size_of_a_cell(self):
        path = self.folder / "x.exr"
        self.expect(farlight("render", bundled_scenes() / "teapot.glb", "-o", path, *SIZE, *LDC), 0)
        self.assertIn(b"farlight/structure/static/cell_metres", path.read_bytes()[:65536])


class Animations(OneDaemon):
    def test_what_stands_still_is_sampled_once(self):
        result = self.expect(farlight("animate", bundled_scenes() / "carousel.glb", "--clip", "ride", "--frames", "1-4",
                                      "--fps", "8", "-o", self.folder / "%d.png", *SIZE, *LDC, "--ldc-resolution", "256",
                                      "--timings=json"), 0)
        frames = frames_of(result)
        parts = ("static", "dynamic")
        self.assertTrue(all(f"{part}/resolution" in frame["structure"] for frame in frames for part in parts))
        rebuilt = [{part for part in parts if frame["structure"][f"{part}/built"]} for frame in frames]
        self.assertEqual(rebuilt[-1], {"dynamic"})
        self.assertGreater(build_ms(frames[0], 0), 1)
        self.assertGreater(build_ms(frames[-1], 1), 1)
        self.assertLess(build_ms(frames[-1], 0), 0.1, "the static cube cost time")
        # What moves is known from the first frame in which it does.
        self.assertIn("static", rebuilt[0])
        self.assertTrue(all("static" not in parts for parts in rebuilt[2:]), rebuilt)

    def test_what_moves_while_the_shutter_is_open_is_refused(self):
        result = self.expect(farlight("animate", bundled_scenes() / "carousel.glb", "--clip", "ride", "--frames", "1-2",
                                      "--shutter", "0.5", "-o", self.folder / "%d.png", *SIZE, *LDC), 1)
        for words in ("shutter", "ldc", "another tracer"):
            self.assertIn(words, result.stderr)
        self.assertEqual(self.leftovers(), [])


class Comparison(OneDaemon):
    def test_secondary_rays_agree_with_the_reference(self):
        """99 % of the rays hit with both or miss with both, as is wanted of closed meshes."""
        result = farlight("compare", bundled_scenes() / "teapot.glb", "--tracers", "ldc,reference", *SIZE, "--json")
        if "libembree-dev" in result.stderr:
            self.skipTest("this farlightd was built without Embree")
        report = json.loads(self.expect(result, 0).stdout)
        self.assertIn(report["structure"]["static/resolution"], range(128, 1024))  # of a small picture
        self.assertIn("secondary", {wave["kind"] for wave in report["waves"]})
        for kind in ("primary", "secondary"):
            waves = [wave for wave in report["waves"] if wave["kind"] == kind]
            agreed, rays = (sum(wave[key] for wave in waves for key in keys) for keys in
                            (("both_hit", "both_missed"), ("rays",)))
            self.assertGreater(rays, 1000)
            self.assertGreaterEqual(agreed / rays, 0.99, kind)
        text = self.expect(farlight("compare", bundled_scenes() / "teapot.glb", "--tracers", "ldc,bvh", "--ldc-resolution", "1024",
                                    *SIZE), 0).stdout
        self.assertIn("structure static: resolution 1024, cell ", text)


if __name__ == "__main__":
    farlight_test.unittest.main()
