# SPDX-License-Identifier: MIT
"""Pictures end to end: one of each tracer, integrator and way to make one, on bundled scenes and by one daemon.

Pictures by `bvh` are compared with stored figures: the mean colour of 8 x 8 parts. `python3 test_pictures.py --update`
writes them anew after a change that is meant to change pictures; look at the pictures first. Pictures by other tracers are
compared with those by `bvh`.
"""
import json
import math
import os
import sys
import tempfile
import unittest

import farlight_test
from farlight_test import (LONG, Daemon, OneDaemon, bundled_scenes, farlight, frames_of, grid_means, long_test, private_daemon, read_exr,
                           read_png)

FIGURES = farlight_test.ROOT / "tests/integration/figures.json"
# Two of 255 in the mean over a cell of 12 x 7 pixels: what another driver's rounding and rasterisation may move at edges,
# and where it sends single paths another way. Any fault of shading does far more.
TOLERANCE = 2.0
ROOM = "cornell.glb"
# Samples that stay in their pixel, and no filter of noise, or differences between integrators would be the filters'; and first
# hits as software finds them, which a GPU chooses by what is faster.
COMMON = ["--size", "96x54", "--samples", "4", "--filter", "box", "--denoise=off", "--primary", "raster"]
STORED = {
    "room": [ROOM, "--integrator", "whitted"],
    "textures": ["teapot.glb", "--integrator", "whitted", "--studio", "off"],
    "sky beside lights": ["teapot.glb", "--integrator", "distributed"],
    "spheres": ["sphereflake-2.nff", "--integrator", "whitted"],
    "moved": ["carousel.glb", "--integrator", "whitted", "--clip", "ride", "--time", "0.7", "--samples", "1", "--studio", "off"],
    "distributed": [ROOM, "--integrator", "distributed"],
    "raycast": [ROOM, "--integrator", "raycast"],
    "ao": [ROOM, "--integrator", "ao", "--ao-rays", "8"],
    "path": [ROOM, "--integrator", "path"],
    "denoised": [ROOM, "--integrator", "path", "--denoise"],
    "pair of eyes from depth layers": [ROOM, "--integrator", "whitted", "--stereo", "0.065", "--size", "48x54"],
}
# Of 255, in the mean over cells of 81 pixels, in which one that goes from black to white is 3.1: at three quarters of the
# cells, and at all. By another exact tracer rays on an edge may go the other way; by sampled ones some at silhouettes, of
# which a mirror and glass repeat many. A wrong colour, texture or shadow is more, and everywhere.
TRACERS = {"reference": (0.1, 1), "rayspace": (0.1, 1), "ldc": (1, 10), "abuffer": (1, 10), "quadtree": (1, 10)}
BY_TRACER = ["--integrator", "whitted", "--primary", "trace", "--depth", "2"]
IN_CORE = ("path", "abuffer")
# Without a resolution one that fits a small picture is chosen by software alone.
BY_SAMPLES = {"ldc": ["--ldc-resolution", "512"], "abuffer": ["--abuffer-resolution", "512"]}


def command(options):
    model, *more = options
    return ["render", bundled_scenes() / model, *COMMON, *more]


def by_tracer(tracer, model=ROOM):
    return [model, *BY_TRACER, "--tracer", tracer, *BY_SAMPLES.get(tracer, [])]


class Pictures(OneDaemon):
    def render(self, *options, name="x.png", **more):
        """Where the picture is, and what its frame said; None where this farlightd was built without Embree."""
        path = self.folder / name
        result = farlight(*command(options), "-o", path, "--timings=json", **more)
        if "reference" in options and "libembree-dev" in result.stderr:
            return None, None
        return path, frames_of(self.expect(result, 0))[-1]

    def test_pictures_are_as_stored(self):
        stored = json.loads(FIGURES.read_text())
        self.assertEqual(set(stored), set(STORED))
        for name, options in STORED.items():
            for cell, (got, want) in enumerate(zip(grid_means(self.render(*options)[0]), stored[name], strict=True)):
                for a, b in zip(got, want):
                    with self.subTest(picture=name, cell=divmod(cell, 8)):
                        self.assertAlmostEqual(a, b, delta=TOLERANCE)

    def apart(self, one, other):
        return sorted(abs(a - b) for x, y in zip(grid_means(one), grid_means(other)) for a, b in zip(x, y))

    def test_every_tracer_gives_the_picture_of_bvh(self):
        """By a daemon that takes a GPU's way through the passes; first hits by the tracer itself, too."""
        gpu = self.enterContext(Daemon(environment={**os.environ, "FARLIGHT_LIKE_GPU": "1"}))
        for model, tracers in ((ROOM, TRACERS), ("sphereflake-2.nff", {"naive": (0, 0)})):
            wanted = self.render(*by_tracer("bvh", model), name="bvh.png")[0]
            for tracer, (most, maximum) in tracers.items():
                with self.subTest(tracer=tracer):
                    path, frame = self.render(*by_tracer(tracer, model), "--server", gpu.address)
                    if path:
                        errors = self.apart(path, wanted)
                        self.assertEqual(frame["tracer"], tracer)
                        self.assertLessEqual(errors[len(errors) * 3 // 4], most)
                        self.assertLessEqual(errors[-1], maximum)

    def test_the_reference_traces_first_hits_unless_it_is_told_to_rasterise_them(self):
        def digest(*options):
            result = farlight("render", bundled_scenes() / ROOM, "--size", "48x27", "--integrator", "whitted", "--samples", "4", "--tracer",
                              "reference", "-o", self.folder / "x.png", "--timings=json", *options)
            if "libembree-dev" in result.stderr:
                self.skipTest("this farlightd was built without Embree")
            return frames_of(self.expect(result, 0))[0]["digest"]
        self.assertEqual(digest(), digest("--primary", "trace"))
        self.assertNotEqual(digest(), digest("--primary", "raster"), "edges are rounded otherwise")

    def test_a_daemon_that_works_as_on_a_gpu_renders_the_same_bytes(self):
        """Waves are queued ahead and structures are built on the device there. By layers of rasterised texels, too; and one
        request gives one picture by whichever daemon."""
        requests = {**STORED, **{tracer: by_tracer(tracer) for tracer in TRACERS}}
        coarse = ["--size", "32x18", "--ldc-resolution", "128", "--abuffer-resolution", "128", "--samples", "1"]
        apart = {}
        with Daemon(environment={**os.environ, "FARLIGHT_LIKE_GPU": "1"}) as gpu:
            for name, options in requests.items():
                if LONG or name in IN_CORE:
                    here, there = (self.render(*options, *coarse, *more)[1] for more in ([], ["--server", gpu.address]))
                    if here and here["digest"] != there["digest"]:
                        apart[name] = here["digest"], there["digest"]
        self.assertEqual(apart, {})

    def test_a_crop_is_that_part_of_the_whole_picture(self):
        """To the byte, of rasterised and of traced first hits, and of all layers."""
        x, y, width, height = 17, 21, 50, 32
        crop = ["--crop", f"{x},{y},{width},{height}"]
        for primary in ("raster", "trace"):
            options = [*STORED["room"], "--primary", primary, "--layers", "beauty,normal,depth", "--float"]
            whole, part = (read_exr(self.render(*options, *more, name="x.exr")[0]) for more in ((), crop))
            self.assertEqual(part[:2], (width, height))
            for name, values in part[2].items():
                self.assertEqual(values, [value for row in range(y, y + height)
                                          for value in whole[2][name][row * 96 + x:row * 96 + x + width]], (primary, name))
        for options in (("--crop", "90,0,20,20"), ("--crop", "1,2,3"), ("--crop", "0,0,8,8", "--noise", "0.1")):
            result = farlight(*command([*STORED["room"], *options]), "-o", self.folder / "x.png")
            self.assertIn("--crop", self.expect(result, 2).stderr)

    def test_crops_agree_to_the_byte_where_they_overlap(self):
        """Their waves are others, and so are the packets that software GL would make of them."""
        width, x, y, side = 320, 0, 112, 56
        options = ["teapot.glb", "--size", "320x180", "--integrator", "path", "--primary", "trace", "--float"]
        whole, part = (read_exr(self.render(*options, "--crop", crop, name="x.exr")[0])
                       for crop in ("0,0,320,180", f"{x},{y},{side},{side}"))
        for name, values in part[2].items():
            self.assertEqual(values, [value for row in range(y, y + side) for value in whole[2][name][row * width + x:row * width + x + side]], name)

    def test_options_arrive(self):
        """Each row: what is common, and options that mean the same (`=`) or must not (`!`)."""
        path, rays = ["--integrator", "path"], ["--integrator", "raycast"]
        ao, abuffer = ["--integrator", "ao", "--ao-rays", "2"], ["--tracer", "abuffer", "--abuffer-resolution", "256", "--samples", "1"]
        bright, digests = [*path, "--exposure", "3"], {}

        def digest(*options):
            if options not in digests:
                digests[options] = self.render(ROOM, "--size", "32x18", *options)[1]["digest"]
            return digests[options]
        for common, one, sign, other in (
                (path, [], "!", ["--seed", "7"]), (path, ["--progressive=4"], "=", ["--progressive=2"]),
                (path, ["--bounces", "2"], "=", ["--depth", "2"]), (path, [], "!", ["--denoise"]),
                (path, ["--denoise"], "=", ["--denoise=auto"]), (path, [], "!", ["--brdf", "ward"]), (bright, [], "=", ["--clamp", "1.25"]),
                (bright, [], "!", ["--clamp", "0"]), ([*bright, "--samples", "16"], [], "=", ["--clamp", "2.5"]),
                (ao, [], "!", ["--ao-distance", "0.01"]), (ao, ["--ao-distance", "10"], "!", ["--ao-distance", "10", "--ao-falloff", "4"]),
                (ao, [], "!", ["--ao-rays", "8"]), (rays, [], "=", ["--layer-opacity", "0.5"]), (rays, [], "!", ["--layer-opacity", "0.2"]),
                (abuffer, ["--abuffer-voxels", "auto"], "=", ["--abuffer-voxels", "32"])):
            with self.subTest(common=common, one=one, sign=sign, other=other):
                (self.assertEqual if sign == "=" else self.assertNotEqual)(digest(*common, *one), digest(*common, *other))

    def test_pictures_to_look_at_are_denoised_where_nothing_is_said(self):
        """Not those in linear light, nor parts of a picture."""
        def digest(name, *options):
            result = farlight("render", bundled_scenes() / ROOM, "--size", "32x18", "--integrator", "path", "--samples", "4", *options,
                              "-o", self.folder / name, "--timings=json")
            return frames_of(self.expect(result, 0))[-1]["digest"]
        for name, usual in (("x.png", "on"), ("x.jpg", "on"), ("x.exr", "off")):
            with self.subTest(name):
                self.assertEqual([digest(name) == digest(name, f"--denoise={word}") for word in ("on", "off")], [usual == "on", usual == "off"])
        self.assertEqual(digest("x.png", "--crop", "8,8,8,8"), digest("x.png", "--crop", "8,8,8,8", "--denoise=off"))

    def test_a_model_without_light_of_its_own_stands_on_a_ground(self):
        """In pictures to look at, and not where the command or the file says what is around it. An axis turns what had it up."""
        model, sky = self.folder / "square.obj", ["--environment", bundled_scenes() / "sky.hdr"]
        model.write_text("v -1 0 -1\nv 1 0 -1\nv 1 2 -1\nv -1 2 -1\nf 1 2 3 4\n")
        view = ["--size", "32x18", "--samples", "1", "--integrator", "whitted"]

        def digest(*options, name="x.png"):
            result = farlight("render", *view, *options, "-o", self.folder / name, "--timings=json")
            return frames_of(self.expect(result, 0))[-1]["digest"]
        usual, bare = digest(model), digest(model, "--studio", "off")
        self.assertNotEqual(usual, bare)
        self.assertEqual(usual, digest(model, "--studio", "off", "--ground"))
        for options in ([model, "--background", "#ffffff"], [model, *sky, "--integrator", "distributed"]):
            self.assertNotEqual(digest(*options), digest(*options, "--ground"), options)
        self.assertNotEqual(digest(model, name="x.exr"), digest(model, "--ground", name="x.exr"))
        self.assertEqual(digest(model, "--up", "z"), digest(model, "--at", "0,0,0:-90,0,0"))
        self.assertNotEqual(usual, digest(model, "--up", "z"))
        self.assertIn("axis", self.expect(farlight("render", model, "--up", "1,1,0", "-o", "x.png"), 2).stderr)

    def test_wireframe_draws_edges_as_wide_as_asked(self):
        """One square, 40 pixels wide: of the row through its upper half lines 4 pixels wide cover 2 at each border, whose other
        halves lie outside, and sqrt(2) times 4 where the diagonal is crossed, which goes on to both sides of the edge."""
        model = self.folder / "square.obj"
        model.write_text("v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\nf 1 3 4\n")
        for integrator, primary in (("whitted", "raster"), ("path", "trace")):
            with self.subTest(integrator=integrator):
                path = self.render(model, "--size", "60x60", "--eye", "0,0,10", "--look-at", "0,0,0", "--fov", "16.9924", "--wireframe",
                                   "4", "--integrator", integrator, "--primary", primary, "--layers", "albedo", "--samples", "16",
                                   "--float", name="square.exr")[0]
                row = read_exr(path)[2]["albedo.R"][20 * 60:21 * 60]
                self.assertAlmostEqual(sum(row) / 0.6, 40 - 4 - 4 * 2 ** 0.5, delta=0.5)

    def middle(self, *options):
        """The colour in the middle of the picture."""
        width, height, rows, channels = read_png(self.render(*options)[0])
        return tuple(rows[height // 2][width // 2 * channels:(width // 2 + 1) * channels])

    def test_an_environment_lies_as_in_viewers_of_gltf(self):
        """Its middle column is +x and what is right of that is +z; a turn of 90 degrees about +y takes +x to -z."""
        red, green, dark = bytes((255, 16, 16, 129)), bytes((16, 255, 16, 129)), bytes((16, 16, 16, 129))
        sky = self.folder / "columns.hdr"
        sky.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n" + (3 * dark + 2 * red + 2 * green + dark) * 4)
        for towards, rotation, channel in (("1,100,0", 0, 0), ("0,100,1", 0, 1), ("0,100,-1", 90, 0), ("1,100,0", 90, 1)):
            middle = self.middle("teapot.glb", "--size", "8x8", "--fov", "10", "--eye", "0,100,0", "--look-at", towards,
                                 "--environment", sky, "--environment-rotation", rotation)
            self.assertEqual(max(range(3), key=lambda c, seen=middle: seen[c]), channel, (towards, rotation, middle))

    def test_a_background_lies_behind_all_surfaces_and_a_ground_has_shadows_alone(self):
        """A square 2 m above a small one, which lies on the ground, under light from straight above: a pixel of the shadow, and one
        far off. A colour is that of the display, whatever the exposure."""
        model = self.folder / "roof.nff"
        model.write_text("v\nfrom 0 6 8\nat 0 0 0\nup 0 1 0\nangle 40\nhither 0.1\nresolution 64 64\nl 0 500 0\nf 1 1 1 1 0 0 0 1\n"
                         "p 4\n-1 2 -1\n-1 2 1\n1 2 1\n1 2 -1\np 4\n-0.1 0 -0.1\n-0.1 0 0.1\n0.1 0 0.1\n0.1 0 -0.1\n")
        clear, shadow, blue = (0, 0, 0, 0), (0, 0, 0, 255), (0x20, 0x40, 0xa0)
        for options, wanted in ((["transparent", "--ground"], (shadow, clear)), (["transparent"], (clear, clear)),
                                (["#2040a0", "--ground"], (shadow[:3], blue)), (["#2040a0", "--exposure", "1"], (blue, blue))):
            _, _, rows, channels = read_png(self.render(model, "--size", "64x64", "--integrator", "whitted", "--background", *options)[0])
            seen = [tuple(rows[y][x * channels:(x + 1) * channels]) for x, y in ((32, 35), (60, 60))]
            self.assertEqual([pixel[:len(of)] for pixel, of in zip(seen, wanted)], list(wanted), options)
        for options, remedy in ((["--background", "#2040a"], "#ffffff"), (["--ground", "--stereo", "0.1"], "--views rays")):
            self.assertIn(remedy, self.expect(farlight(*command([model, *options]), "-o", self.folder / "no.png"), 2).stderr)

    VIEW = "v\nfrom 0 0 4\nat 0 0 0\nup 0 1 0\nangle 30\nhither 0.01\nresolution 8 8\n"
    SQUARE = "p 4\n-9 -9 {0}\n9 -9 {0}\n9 9 {0}\n-9 9 {0}\n"

    def write_nff(self, text):
        path = self.folder / "model.nff"
        path.write_text(self.VIEW + text)
        return path

    def check_nff(self, integrators):
        """NFF's numbers are a display's, and so is light, whatever the tone map: a surface that scatters shows colour times Kd times the
        cosine, a mirror Ks of what it shows at every angle, and no light, which no ray meets, a pane colour times T, a ray that leaves
        the background. Nothing else lights a surface, and no distance makes it darker."""
        sky, lit, dark = "b 0.078 0.361 0.753\n", "l 0 0 7\n", "l 0 0 -7\n"
        steep = "p 4\n-9 -1 6\n9 -1 6\n9 1 -6\n-9 1 -6\n"  # 80 degrees; Fresnel's equations would have it mirror 0.7
        background, scatters, square = (0.078, 0.361, 0.753), "f 1 0.75 0.33 0.8 0 0 0 1\n", self.SQUARE.format(0)
        for name, text, wanted, steps in (
                ("lit", sky + lit + scatters + square, (0.8, 0.6, 0.264), 1),
                ("far", sky + "l 0 0 700\n" + scatters + square, (0.8, 0.6, 0.264), 1),
                ("unlit", sky + dark + scatters + square, (0, 0, 0), 0),
                ("nothing", sky + lit + scatters + self.SQUARE.format(9), background, 1),
                ("bright", sky + 3 * lit + scatters + square, (1, 1, 0.4573), 1),  # sqrt(3) of "lit"
                ("mirror", sky + lit + "f 1 1 1 0 0.5 9 0 1\n" + square, (0.039, 0.1805, 0.3765), 1),
                ("sum", sky + lit + "f 1 0.5 0 0.4 0.5 9 0 1\n" + square, (0.439, 0.3805, 0.3765), 1),
                ("grazing", sky + dark + "f 1 1 1 0 0.5 9 0 1\n" + steep, (0.039, 0.1805, 0.3765), 1),
                ("pane", sky + dark + "f 1 0.5 0 0.4 0 9 0.5 0\n" + square, (0.039, 0.09025, 0), 1)):
            for integrator in integrators:
                with self.subTest(name=name, integrator=integrator):
                    middle = self.middle(self.write_nff(text), "--integrator", integrator, "--samples", "16", "--tone-map", "aces",
                                         "--size", "9x9")
                    for got, value in zip(middle[:3], wanted, strict=True):
                        self.assertLessEqual(abs(got - 255 * value), steps + 0.5, (middle, wanted))

    def test_nff_is_shown_as_its_author_does(self):
        self.check_nff(["whitted"])

    @long_test
    def test_nff_is_shown_so_by_chance_too(self):
        self.check_nff(["distributed", "path"])

    def test_nff_beside_other_light_is_linear_and_so_is_its_exr_file(self):
        """With an environment, or another model: the light that a display emits for its numbers, with the tone map's curve."""
        scene, sky = self.write_nff("l 0 0 7\nf 1 1 1 0.5 0 0 0 1\n" + self.SQUARE.format(0)), self.folder / "black.hdr"
        sky.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" + bytes(8))
        for more in (["--environment", sky], [bundled_scenes() / "teapot.glb", "--at", "50,0,0", "--studio", "off"]):
            plain, aces = (self.middle(scene, *more, "--tone-map", tone_map, "--size", "9x9", "--eye", "0,0,4", "--look-at", "0,0,0")[0]
                           for tone_map in ("none", "aces"))
            self.assertAlmostEqual(plain, 127.5, delta=1.5, msg=more)
            self.assertGreater(abs(aces - plain), 10, more)
        values = read_exr(self.render(scene, "--float", "--size", "9x9", "--layers", "beauty,albedo", name="x.exr")[0])[2]
        for name in ("G", "albedo.G"):
            self.assertAlmostEqual(values[name][4 * 9 + 4], ((0.5 + 0.055) / 1.055) ** 2.4, delta=0.002, msg=name)

    def test_a_picture_has_16_samples_and_more_of_what_is_noisy_by_default(self):
        def rendered(*options):
            result = self.expect(farlight("render", bundled_scenes() / ROOM, "--size", "8x6", "-o", self.folder / "x.png",
                                          "--timings=json", *options), 0)
            return frames_of(result)[0]
        self.default_samples()
        self.assertEqual(rendered()["integrator"], "distributed", "as several samples are, where nothing is said")
        for integrator, samples in (("whitted", 16), ("ao", 16), ("path", 64)):
            frame = rendered("--integrator", integrator)
            self.assertEqual((frame["integrator"], frame["samples"]), (integrator, samples))
            if integrator == "ao":
                self.assertEqual(frame["shadow_rays"], 128 * 8 * 6, "as in the paper, 128 a pixel")
        self.assertEqual(rendered("--integrator", "path", "--samples", "2")["samples"], 2)
        self.assertIn(rendered("--samples", "auto", "--integrator", "whitted")["samples"], range(16, 257))


@long_test
class Denoised(OneDaemon):
    # Highlights that few samples miss and many show weigh alike in both pictures, so that what is left of them decides: a
    # thousandth either way. More is never lost where anything is gained.
    AS_GOOD = 1.005

    def picture(self, *options):
        path = self.folder / "x.png"
        self.expect(farlight("render", *options, "--size", "80x45", "-o", path), 0)
        return [value for row in read_png(path)[2] for value in row]

    def test_no_scene_is_worse_for_it_and_much_noise_of_a_room_is_gone(self):
        """Root mean square differences of display values. The truth's noise, a thirty-second of it, counts in both."""
        for scene in (ROOM, "teapot.glb", "carousel.glb", "sphereflake-3.nff"):
            for integrator in ("path", "distributed"):
                options = [bundled_scenes() / scene, "--integrator", integrator, "--background", "#000000"]
                truth = self.picture(*options, "--samples", "128", "--seed", "7")
                for samples in ("1", "4", "16"):
                    noisy, denoised = (math.dist(self.picture(*options, "--samples", samples, *more), truth)
                                       for more in (("--denoise=off",), ()))
                    left = 0.65 if (scene, integrator, samples) == (ROOM, "path", "4") else self.AS_GOOD
                    self.assertLessEqual(denoised, left * noisy, (scene, integrator, samples))


class Twice(OneDaemon):
    def test_tracers_of_one_daemon_do_not_affect_each_other(self):
        def digest(tracer, **more):
            result = farlight(*command([*STORED["room"], "--size", "32x18", "--tracer", tracer]), "-o", self.folder / "x.png",
                              "--timings=json", **more)
            return frames_of(self.expect(result, 0))[0]["digest"]
        alone = {tracer: digest(tracer, env=private_daemon()) for tracer in ("bvh", "abuffer")}
        for tracer in ("bvh", "abuffer", "bvh", "abuffer", "abuffer"):
            self.assertEqual(digest(tracer), alone[tracer], tracer)


def update_figures():
    figures = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, options in STORED.items():
            result = farlight(*command(options), "-o", f"{folder}/x.png")
            if result.returncode:
                sys.exit(result.stderr)
            figures[name] = grid_means(f"{folder}/x.png")
    FIGURES.write_text("{\n" + ",\n".join(f'"{name}": {json.dumps(means)}' for name, means in figures.items()) + "\n}\n")


if __name__ == "__main__":
    if "--update" in sys.argv:
        update_figures()
    else:
        unittest.main()
