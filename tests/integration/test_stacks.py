# SPDX-License-Identifier: MIT
"""The same commands on the driver stack under test and on llvmpipe: every tracer with every integrator, layers, and a
clip with lens and shutter. `make test-zink` runs them.

GLSL does not say whether a * b + c is rounded once or twice, nor how exact sin(), pow() or inversesqrt() are, so that
stacks differ in the last bits of positions and directions. Colours then differ by some 1e-4. A ray that meets an edge
within these bits hits on one stack and misses on the other, and its pixel differs by more: BEYOND_MAX is the share of
such pixels, and PSNR_MIN is below a picture that has some, above one with a wrong object, light or texel."""
import json
import os

from farlight_test import Case, Daemon, bundled_scenes, farlight, read_exr

# Choices as on the stack under test, which queues its work: of two drivers alike in that, only their arithmetic differs.
OTHER = {**os.environ, "GALLIUM_DRIVER": "llvmpipe", "FARLIGHT_LIKE_GPU": "1"}
SIZE = ["--size", "64x48"]
TRACERS = ("bvh", "reference", "ldc", "abuffer", "rayspace")  # naive takes no scene of this size
INTEGRATORS = ("raycast", "whitted", "distributed", "ao", "path")
PSNR_MIN = 50  # dB, in linear light with a peak of 1
BEYOND_MAX = 0.005  # share of the pixels that differ by more than 0.01


class Stacks(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.daemons = {"tested": cls.enterClassContext(Daemon()),
                       "llvmpipe": cls.enterClassContext(Daemon(environment=OTHER))}

    def on_both(self, command, model, *options, output="picture.exr"):
        """The file that the command writes on either stack; None where the build has no such tracer."""
        paths = []
        for name, daemon in self.daemons.items():
            paths.append(self.folder / name / output)
            result = farlight(command, bundled_scenes() / model, "--server", daemon.address, *SIZE, *options, "--parents", "-o", paths[-1])
            if "libembree-dev" in result.stderr:
                return None
            self.expect(result, 0)
        return paths

    def expect_alike(self, paths, psnr_min=PSNR_MIN):
        result = farlight("compare", *paths, "--json", "--fail-above", f"psnr={psnr_min}",
                          "--fail-above", f"beyond={BEYOND_MAX}", "--fail-above", "nonfinite=0")
        self.assertEqual(result.returncode, 0, f"{result.stderr}{result.stdout}")
        return json.loads(result.stdout)["psnr"] or float("inf")

    def test_the_daemons_render_by_different_drivers(self):
        names = [json.loads(self.expect(farlight("stats", "--json", "--server", daemon.address), 0).stdout)["device"]
                 for daemon in self.daemons.values()]
        self.assertTrue(names[1].startswith("llvmpipe"), names)
        self.assertFalse(names[0].startswith("llvmpipe"), names)

    def test_every_tracer_and_integrator_gives_the_picture_of_the_other_stack(self):
        for tracer in TRACERS:
            for integrator in INTEGRATORS:
                with self.subTest(tracer=tracer, integrator=integrator):
                    paths = self.on_both("render", "cornell.glb", "--tracer", tracer, "--integrator", integrator,
                                         "--samples", "4")
                    # Where rays pass between samples, rounding decides, and a path that goes another way may bring
                    # anything: the number of such pixels is limited, and not what they differ by. (Three such pixels
                    # of another seed make 28 dB.)
                    psnr_min = 0 if tracer == "ldc" and integrator in ("path", "distributed") else PSNR_MIN
                    if paths:
                        print(f"{tracer} {integrator}: {self.expect_alike(paths, psnr_min):.1f} dB")

    def test_layers_are_those_of_the_other_stack(self):
        """One sample per pixel: numbers of objects are the same ones, except at an edge."""
        layers = "beauty,albedo,normal,depth,position,ao,id"
        pictures = [read_exr(path)[2] for path in self.on_both("render", "teapot.glb", "--layers", layers, "--float",
                                                               "--primary", "trace")]
        self.assertEqual(set(pictures[0]), set(pictures[1]))
        for name, values in pictures[0].items():
            far = sum(not (a == b or abs(a - b) <= 1e-3 * max(abs(a), abs(b), 1)) for a, b in zip(values, pictures[1][name]))
            with self.subTest(channel=name):
                self.assertLessEqual(far, BEYOND_MAX * len(values))

    def test_a_clip_with_lens_and_shutter_is_that_of_the_other_stack(self):
        for paths in zip(*(sorted(path.parent.iterdir()) for path in self.on_both(
                "animate", "carousel.glb", "--clip", "ride", "--frames", "1-2", "--fps", "12", "--samples", "4",
                "--aperture", "0.3", "--focus", "7.4", "--shutter", "0.5", output="%04d.exr"))):
            self.expect_alike(paths)
