# SPDX-License-Identifier: MIT
"""Colours of files beside the renderer's: spaces of known primaries, and those and views of an OpenColorIO configuration."""
import os
import struct
import unittest

from farlight_test import OneDaemon, bundled_scenes, exr_attributes, farlight, read_exr, read_png

VIEW = ["--size", "24x18", "--samples", "4", "--denoise=off"]
# Of linear Rec. 709, whites adapted by Bradford's transform, as ACES' document S-2014-004 and OpenColorIO have it.
ACESCG = ((0.613097, 0.339523, 0.047379), (0.070194, 0.916354, 0.013452), (0.020616, 0.109570, 0.869815))
AP1 = (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767)
CONFIGURATION = """ocio_profile_version: 1
roles:
  default: lin_rec709
  scene_linear: lin_rec709
displays:
  screen:
    - !<View> {name: root, colorspace: root}
    - !<View> {name: plain, colorspace: lin_rec709}
active_displays: [screen]
active_views: [root, plain]
colorspaces:
  - !<ColorSpace>
    name: lin_rec709
    isdata: false
  - !<ColorSpace>
    name: root
    isdata: false
    from_reference: !<ExponentTransform> {value: [0.5, 0.5, 0.5, 1]}
"""


class Colours(OneDaemon):
    def setUp(self):
        super().setUp()
        self.configuration = self.folder / "config.ocio"
        self.configuration.write_text(CONFIGURATION)

    def render(self, name, *options, status=0, **variables):
        path = self.folder / name
        return path, self.expect(farlight("render", bundled_scenes() / "cornell.glb", "-o", path, *VIEW, *options,
                                          env={**os.environ, **variables}), status)

    def linear(self, *options, **variables):
        path, _ = self.render("x.exr", "--float", *options, **variables)
        channels = read_exr(path)[2]
        return path, list(zip(*(channels[name] for name in "RGB")))

    def test_acescg_is_the_same_light_by_other_primaries(self):
        plain, wide = self.linear()[1], self.linear("--colour-space", "ACEScg")
        for before, after in zip(plain, wide[1]):
            for row, value in zip(ACESCG, after):  # numbers of six digits
                self.assertAlmostEqual(sum(a * b for a, b in zip(row, before)), value, delta=2e-6 * (1 + max(before)))
        found = struct.unpack("<8f", exr_attributes(wide[0])["chromaticities"])
        for a, b in zip(found, AP1):
            self.assertAlmostEqual(a, b, places=5)

    def test_spaces_and_views_are_the_configurations(self):
        plain = self.linear()[1]
        for options, variables in ((["--ocio", self.configuration], {}), ([], {"OCIO": str(self.configuration)})):
            for before, after in zip(plain, self.linear("--colour-space", "root", *options, **variables)[1]):
                for a, b in zip(before, after):
                    self.assertAlmostEqual(max(a, 0) ** 0.5, b, delta=2e-3)  # OpenColorIO's power is an approximation
        picture = self.render("x.png", "--display-view", "root", "--ocio", self.configuration)[0]
        _, _, rows, channels = read_png(picture)
        pixels = b"".join(rows)
        for k, before in enumerate(plain):
            for a, b in zip(before, pixels[channels * k:channels * k + 3]):
                self.assertAlmostEqual(255 * min(max(a, 0) ** 0.5, 1), b, delta=1.1)

    def test_what_there_is_not_is_refused_before_anything_is_rendered(self):
        for name, options, words in (
                ("x.exr", ["--colour-space", "nonsense"], ("ACEScg", "Linear Rec.2020")),
                ("x.exr", ["--colour-space", "nonsense", "--ocio", self.configuration], ("lin_rec709, root",)),
                ("x.png", ["--display-view", "AgX", "--ocio", self.configuration], ("screen/root, screen/plain",)),
                ("x.png", ["--display-view", "AgX"], ("--ocio FILE",)),
                ("x.png", ["--colour-space", "ACEScg"], (".exr",)),
                ("x.exr", ["--display-view", "root", "--ocio", self.configuration], (".png",))):
            with self.subTest(options=options):
                path = self.folder / name
                result = farlight("render", bundled_scenes() / "cornell.glb", "-o", path, *VIEW, *options)
                self.assertIn(result.returncode, (1, 2), result.stderr)
                for word in (options[0], *words):
                    self.assertIn(word, result.stderr)
                self.assertFalse(path.exists())


if __name__ == "__main__":
    unittest.main()
