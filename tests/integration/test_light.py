# SPDX-License-Identifier: MIT
"""The integrators as a person meets them: defaults, options that arrive, that each goes with every tracer."""
import farlight_test
from farlight_test import Case, Daemon, bundled_scenes, farlight, frames_of, grid_means, read_exr, read_png

SIZE = ["--size", "96x72"]


def srgb(linear):
    return 12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055


INTEGRATORS = ("whitted", "distributed", "raycast", "ao", "path")


class Light(Case):
    """One daemon for all, which compiles once; `alone`: by one of its own."""

    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()
        cls.daemon.__enter__()
        cls.addClassCleanup(cls.daemon.__exit__)

    def try_render(self, *options, scene="cornell.glb", name="x.png", alone=False):
        path = self.folder / name
        server = [] if alone else ["--server", self.daemon.address]
        return path, farlight("render", bundled_scenes() / scene, "-o", path, *SIZE, "--timings=json", *server, *options)

    def render(self, *options, **more):
        path, result = self.try_render(*options, **more)
        return path, frames_of(self.expect(result, 0))[0]

    def digest(self, *options, **more):
        return self.render(*options, **more)[1]["digest"]

    def mean(self, *options):
        """Of linear light."""
        _, _, channels = read_exr(self.render("--float", *options, name="x.exr")[0])
        return sum(sum(channels[c]) for c in "RGB") / (3 * len(channels["R"]))

    def test_nff_is_shown_as_its_author_does(self):
        """Its numbers are a display's, and so is light, whatever the tone map: a surface that scatters shows colour times Kd times the cosine, a mirror Ks of what it
        shows at every angle, and no light, which no ray meets, a pane colour times T, a ray that leaves the background. Nothing else lights a surface, and no distance
        makes it darker."""
        view = "b 0.078 0.361 0.753\nv\nfrom 0 0 4\nat 0 0 0\nup 0 1 0\nangle 30\nhither 0.01\nresolution 8 8\n"
        square, lamp = "p 4\n-9 -9 {0}\n9 -9 {0}\n9 9 {0}\n-9 9 {0}\n", "l 0 0 {}\n"
        steep = "p 4\n-9 -1 6\n9 -1 6\n9 1 -6\n-9 1 -6\n"  # 80 degrees; Fresnel's equations would have it mirror 0.7
        background, scatters = (0.078, 0.361, 0.753), "f 1 0.75 0.33 0.8 0 0 0 1\n"
        for name, text, wanted, steps in (
                ("lit", view + lamp.format(7) + scatters + square.format(0), (0.8, 0.6, 0.264), 1),
                ("far", view + lamp.format(700) + scatters + square.format(0), (0.8, 0.6, 0.264), 1),
                ("unlit", view + lamp.format(-7) + scatters + square.format(0), (0, 0, 0), 0),
                ("nothing", view + lamp.format(7) + scatters + square.format(9), background, 1),
                ("bright", view + 3 * lamp.format(7) + scatters + square.format(0), (1, 1, 0.4573), 1),  # sqrt(3) of "lit"
                ("mirror", view + lamp.format(7) + "f 1 1 1 0 0.5 9 0 1\n" + square.format(0), (0.039, 0.1805, 0.3765), 1),
                ("sum", view + lamp.format(7) + "f 1 0.5 0 0.4 0.5 9 0 1\n" + square.format(0), (0.439, 0.3805, 0.3765), 1),
                ("grazing", view + lamp.format(-7) + "f 1 1 1 0 0.5 9 0 1\n" + steep, (0.039, 0.1805, 0.3765), 1),
                ("pane", view + lamp.format(-7) + "f 1 0.5 0 0.4 0 9 0.5 0\n" + square.format(0), (0.039, 0.09025, 0), 1)):
            (self.folder / f"{name}.nff").write_text(text)
            for integrator in ("whitted", "distributed", "path"):
                with self.subTest(name=name, integrator=integrator):
                    path = self.render("--integrator", integrator, "--samples", "16", "--tone-map", "aces", "--size", "9x9",
                                       scene=self.folder / f"{name}.nff")[0]
                    width, _, rows, channels = read_png(path)
                    middle = rows[4][4 * channels:4 * channels + 3]
                    for got, value in zip(middle, wanted, strict=True):
                        self.assertLessEqual(abs(got - 255 * value), steps + 0.5, (width, list(middle), wanted))

    def test_exr_of_nff_has_the_light_of_its_picture(self):
        """So that what shows linear files shows it as it is. Half open to what lies behind: alpha stays that of the picture."""
        scene = self.folder / "open.nff"
        scene.write_text("v\nfrom 0 0 4\nat 0 0 0\nup 0 1 0\nangle 30\nhither 0.01\nresolution 8 8\nl 0 0 7\nf 1 0.75 0.33 0.8 0 0 0 1\n"
                         "p 4\n-9 -9 0\n0 -9 0\n0 9 0\n-9 9 0\n")
        options = ["--samples", "16", "--size", "9x9"]
        rows = read_png(self.render(*options, scene=scene)[0])[2]
        _, _, linear = read_exr(self.render("--float", *options, "--layers", "beauty,albedo", scene=scene, name="x.exr")[0])
        for place, coverage in ((4 * 9 + 1, 1), (4 * 9 + 4, 0.5)):
            self.assertAlmostEqual(linear["A"][place], coverage, delta=0.13)
            alpha = linear["A"][place]
            for c, albedo in zip("RGB", (0.8, 0.6, 0.264)):
                self.assertAlmostEqual(255 * srgb(linear[c][place] / alpha), rows[4][4 * (place - 36) + "RGB".index(c)], delta=1)
                self.assertAlmostEqual(srgb(linear["albedo." + c][place] / alpha), albedo, delta=0.01)

    def test_nff_beside_other_light_is_linear(self):
        """With an environment, or another model: the light that a display emits for its numbers, with the tone map's curve."""
        scene, sky = self.folder / "lit.nff", self.folder / "black.hdr"
        scene.write_text("v\nfrom 0 0 4\nat 0 0 0\nup 0 1 0\nangle 30\nhither 0.01\nresolution 8 8\nl 0 0 7\nf 1 1 1 0.5 0 0 0 1\n"
                         "p 4\n-9 -9 0\n9 -9 0\n9 9 0\n-9 9 0\n")
        sky.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" + bytes(8))
        for more in (["--environment", sky], [bundled_scenes() / "teapot.glb", "--at", "50,0,0"]):
            with self.subTest(more=more):
                shown = {}
                for tone_map in ("none", "aces"):
                    _, _, rows, _ = read_png(self.render(*more, "--tone-map", tone_map, "--size", "9x9", "--eye", "0,0,4", "--look-at", "0,0,0",
                                                         scene=scene)[0])
                    shown[tone_map] = rows[4][4 * 4]
                self.assertAlmostEqual(shown["none"], 127.5, delta=1.5)
                self.assertGreater(abs(shown["aces"] - shown["none"]), 10)

    def test_a_picture_has_16_samples_and_more_of_what_is_noisy_by_default(self):
        small = ["--size", "8x6"]
        self.default_samples()
        self.assertEqual(self.render(*small)[1]["integrator"], "distributed", "as several samples are, where nothing is said")
        for integrator, samples in (("whitted", 16), ("raycast", 16), ("ao", 16), ("path", 64)):
            _, frame = self.render("--integrator", integrator, *small)
            self.assertEqual((frame["integrator"], frame["samples"]), (integrator, samples))
            self.assertEqual(self.render("--integrator", integrator, "--samples", "2", *small)[1]["samples"], 2)
        held = self.render("--samples", "auto", "--integrator", "whitted", *small)[1]["samples"]
        self.assertTrue(16 <= held <= 256, held)
        # As in the paper, 128 rays of ambient occlusion a pixel.
        frame = self.render("--integrator", "ao", *small)[1]
        self.assertEqual(frame["shadow_rays"], 128 * 8 * 6)

    def test_every_integrator_shows_the_same_by_every_tracer(self):
        """By another tracer rays on an edge, or where two surfaces lie on each other, may go the other way, and by sampled ones
        some at silhouettes. Of 255, in the mean over cells of 108 pixels, in which a pixel gone from black to white is 2.4:
        almost nothing where no edge is, and four such pixels at most; a wrong colour, texture or shadow is more than that."""
        for integrator in INTEGRATORS:
            options = ["--integrator", integrator, "--samples", "4", "--primary", "trace", "--depth", "1"]
            wanted = grid_means(self.render(*options)[0])
            for tracer in ("reference", "ldc", "abuffer"):
                with self.subTest(integrator=integrator, tracer=tracer):
                    path, result = self.try_render(*options, "--tracer", tracer, name=f"{tracer}.png")
                    if "libembree-dev" in result.stderr:
                        continue  # this farlightd was built without Embree
                    self.expect(result, 0)
                    errors = sorted(abs(a - b) for x, y in zip(grid_means(path), wanted) for a, b in zip(x, y))
                    self.assertLess(errors[len(errors) * 3 // 4], 1)
                    self.assertLess(errors[-1], 10)

    def test_one_request_gives_one_picture(self):
        for integrator in ("raycast", "ao", "path"):
            options = ["--integrator", integrator, "--samples", "2"]
            self.assertEqual(self.digest(*options), self.digest(*options, alone=True), integrator)
            self.assertEqual(self.digest(*options, "--bounces", "2"), self.digest(*options, "--depth", "2"), integrator)

    def test_options_of_ambient_occlusion_arrive(self):
        options = ["--integrator", "ao", "--samples", "4"]
        means = {distance: self.mean(*options, "--ao-distance", distance) for distance in ("0.01", "0.3", "10")}
        self.assertGreater(means["0.01"], means["0.3"] + 0.01)
        self.assertGreater(means["0.3"], means["10"] + 0.1, "in a closed room everything is occluded from afar")
        self.assertGreater(self.mean(*options, "--ao-distance", "10", "--ao-falloff", "4"), means["10"] + 0.1,
                           "what is far counts less")
        few, many = (self.render(*options, "--ao-rays", rays)[1] for rays in ("2", "32"))
        self.assertEqual((few["shadow_rays"] * 16, few["primary_rays"]), (many["shadow_rays"], many["primary_rays"]))

    def test_layers_that_hide_all_hide_what_is_behind(self):
        """Of the last of many half transparent layers a sixteenth and less is seen."""
        options = ["--integrator", "raycast", "--samples", "1"]
        self.assertEqual(self.digest(*options), self.digest(*options, "--layer-opacity", "0.5"))
        rays = {opacity: self.render(*options, "--layer-opacity", opacity)[1]["secondary_rays"] for opacity in ("0.2", "0.5", "1")}
        self.assertGreater(rays["0.2"], rays["1"])
        self.assertNotEqual(self.digest(*options, "--layer-opacity", "0.2"), self.digest(*options, "--layer-opacity", "1"))

    def test_indirect_light_adds_up_bounce_by_bounce(self):
        """Each bounce adds light and none is taken away: the same random numbers decide, so that noise is no excuse."""
        means = [self.mean("--integrator", "path", "--samples", "16", "--bounces", bounces) for bounces in ("0", "1", "4")]
        self.assertGreater(means[1], means[0] * 1.05)
        self.assertGreater(means[2], means[1] * 1.02)

    def test_rough_surfaces_reflect_by_the_chosen_brdf(self):
        options = ["--integrator", "path", "--samples", "2"]
        self.assertEqual(self.digest(*options, scene="teapot.glb"), self.digest(*options, "--brdf", "ggx", scene="teapot.glb"))
        self.assertNotEqual(self.digest(*options, scene="teapot.glb"), self.digest(*options, "--brdf", "ward", scene="teapot.glb"))

    def test_fireflies_are_bounded_by_default_and_not_where_it_is_off(self):
        """By less where each of few samples shows more."""
        for samples, clamp in (("4", "1.25"), ("16", "2.5")):
            options = ["--integrator", "path", "--samples", samples, "--exposure", "3"]
            by_default, off = self.digest(*options), self.digest(*options, "--clamp", "0")
            self.assertEqual(by_default, self.digest(*options, "--clamp", clamp))
            self.assertNotEqual(by_default, off)
            self.assertNotEqual(by_default, self.digest(*options, "--clamp", "1"))

    def test_refined_pictures_are_those_of_one_rendering(self):
        for integrator in ("ao", "path"):
            options = ["--integrator", integrator, "--samples", "6"]
            wanted = read_png(self.render(*options, "--progressive=6")[0])
            self.assertEqual(read_png(self.render(*options, "--progressive=2")[0]), wanted)


if __name__ == "__main__":
    farlight_test.unittest.main()
