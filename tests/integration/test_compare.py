# SPDX-License-Identifier: MIT
"""`farlight compare` on made images whose figures are known beforehand."""
import json
import math
import os
import random
import struct
import subprocess
import zlib

from farlight_test import BIN, Case, bundled_scenes, farlight, long_test, read_png

# Figures travel as 32-bit floats: 24 bits of mantissa.
FLOAT = 1e-6
MAGENTA = (255, 0, 255)


def write_png(path, width, height, channels, values):
    """8 bits; `values` row by row."""
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    rows = b"".join(b"\0" + bytes(values[y * width * channels:(y + 1) * width * channels]) for y in range(height))
    colour = {1: 0, 2: 4, 3: 2, 4: 6}[channels]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, colour, 0, 0, 0))
                     + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))
    return path


def write_exr(path, width, height, names, values):
    """Uncompressed 32-bit floats; `values` pixel by pixel in the order of `names`."""
    def attribute(name, kind, body):
        return name + b"\0" + kind + b"\0" + struct.pack("<i", len(body)) + body
    order = sorted(names)
    channels = b"".join(n.encode() + b"\0" + struct.pack("<iiii", 2, 0, 1, 1) for n in order) + b"\0"
    box = struct.pack("<iiii", 0, 0, width - 1, height - 1)
    head = (struct.pack("<ii", 20000630, 2) + attribute(b"channels", b"chlist", channels)
            + attribute(b"compression", b"compression", b"\0") + attribute(b"dataWindow", b"box2i", box)
            + attribute(b"displayWindow", b"box2i", box) + attribute(b"lineOrder", b"lineOrder", b"\0")
            + attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1))
            + attribute(b"screenWindowCenter", b"v2f", struct.pack("<ff", 0, 0))
            + attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)) + b"\0")
    step, lines = len(names), []
    for y in range(height):
        row = values[y * width * step:(y + 1) * width * step]
        data = b"".join(struct.pack(f"<{width}f", *row[names.index(n)::step]) for n in order)
        lines.append(struct.pack("<ii", y, len(data)) + data)
    at, offsets = len(head) + 8 * height, b""
    for line in lines:
        offsets += struct.pack("<Q", at)
        at += len(line)
    path.write_bytes(head + offsets + b"".join(lines))
    return path


def ssim(a, b, width, height):
    """Wang et al. 2004 word by word, of planes of luma with range 1: the mean over all 11x11 windows."""
    weight = [[math.exp(-(x * x + y * y) / (2 * 1.5 ** 2)) for x in range(-5, 6)] for y in range(-5, 6)]
    total = sum(map(sum, weight))
    sums = []
    for top in range(height - 10):
        for left in range(width - 10):
            window = [(weight[y][x] / total, a[(top + y) * width + left + x], b[(top + y) * width + left + x])
                      for y in range(11) for x in range(11)]
            mean_a, mean_b = sum(w * p for w, p, _ in window), sum(w * q for w, _, q in window)
            var_a = sum(w * (p - mean_a) ** 2 for w, p, _ in window)
            var_b = sum(w * (q - mean_b) ** 2 for w, _, q in window)
            cov = sum(w * (p - mean_a) * (q - mean_b) for w, p, q in window)
            sums.append((2 * mean_a * mean_b + 1e-4) * (2 * cov + 9e-4)
                        / ((mean_a ** 2 + mean_b ** 2 + 1e-4) * (var_a + var_b + 9e-4)))
    return sum(sums) / len(sums)


def noise(count, seed):
    source = random.Random(seed)
    return [source.randrange(256) for _ in range(count)]


class Compare(Case):
    def compare(self, a, b, *options, status=0):
        """The JSON of a comparison."""
        return json.loads(self.expect(farlight("compare", a, b, "--json", *options), status).stdout)

    def refused(self, *arguments, says=()):
        result = self.expect(farlight("compare", *arguments), 2)
        for word in says:
            self.assertIn(str(word), result.stderr)
        self.assertEqual(result.stdout, "")

    def png(self, name, values, width=16, height=16, channels=3):
        return write_png(self.folder / name, width, height, channels, values)

    def exr(self, name, values, width=16, height=16, names=("R", "G", "B")):
        return write_exr(self.folder / name, width, height, list(names), values)


class Figures(Compare):
    def test_a_constant_offset_has_that_mean_rms_and_maximum(self):
        got = self.compare(self.png("a.png", [100] * 768), self.png("b.png", [105] * 768))
        for figure in ("mean", "rms", "max"):
            self.assertAlmostEqual(got[figure], 5 / 255, delta=FLOAT, msg=figure)
        self.assertAlmostEqual(got["psnr"], 20 * math.log10(255 / 5), delta=1e-4)
        self.assertEqual((got["beyond"], got["space"], got["peak"], got["shown_psnr"]), (1, "srgb", 1, got["psnr"]))
        self.assertFalse(got["identical"])
        for threshold, share in (("0", 1), ("0.019", 1), ("0.02", 0)):  # 5 / 255 = 0.0196
            got = self.compare(self.folder / "a.png", self.folder / "b.png", "--threshold", threshold)
            self.assertEqual(got["beyond"], share, threshold)
            self.assertAlmostEqual(got["threshold"], float(threshold), delta=1e-8)

    def test_linear_files_are_compared_as_they_are_beyond_white_too(self):
        got = self.compare(self.exr("a.exr", [8.0] * 768), self.exr("b.exr", [6.0] * 768))
        self.assertEqual((got["mean"], got["rms"], got["max"], got["space"]), (2, 2, 2, "linear"))
        self.assertAlmostEqual(got["psnr"], 20 * math.log10(1 / 2), delta=1e-5)

    @long_test
    def test_a_highlight_outweighs_linear_light_and_not_what_a_screen_shows(self):
        a, b = [0.5] * 768, [0.5] * 768
        a[:3], b[:3] = [400.0] * 3, [500.0] * 3
        files = self.exr("a.exr", a), self.exr("b.exr", b)
        got = self.compare(*files)
        self.assertAlmostEqual(got["psnr"], 20 * math.log10(16 / 100), delta=1e-4)  # one of 256 is off by 100

        def neutral(x):  # the tone mapper's part for light greys: both are nearly white
            return 1 - 0.24 ** 2 / (x - 0.04 + 0.24 - 0.76)
        off = [1.055 * neutral(x) ** (1 / 2.4) for x in (400, 500)]
        # A difference of 1e-5 of floats near 1, which are true to 6e-8: 1 %, 0.1 dB.
        self.assertAlmostEqual(got["shown_psnr"], 20 * math.log10(16 / (off[1] - off[0])), delta=0.1)
        self.assertIsNone(self.compare(*files, "--tone-map", "none")["shown_psnr"], "clamped, both are white")
        self.compare(*files, "--tone-map", "aces", "--fail-above", "shown_psnr=40", status=0)
        self.compare(*files, "--fail-above", "psnr=40", status=1)
        lines = self.expect(farlight("compare", *files), 0).stdout.splitlines()
        self.assertEqual(len([line for line in lines if "PSNR" in line and "peak: white, 1" in line]), 2, lines)
        self.refused(*files, "--tone-map", "film", says=("--tone-map", "neutral, aces, none"))

    def test_one_changed_pixel_is_found_and_is_one_of_all(self):
        values = [100] * 768
        values[3 * (16 * 5 + 7) + 1] = 200
        got = self.compare(self.png("a.png", [100] * 768), self.png("b.png", values))
        self.assertEqual((got["beyond_pixels"], got["beyond"]), (1, 1 / 256))
        self.assertEqual(got["max_at"], {"x": 7, "y": 5, "channel": 1})
        self.assertAlmostEqual(got["mean"], 100 / 255 / 768, delta=FLOAT)
        self.assertAlmostEqual(got["rms"], 100 / 255 / math.sqrt(768), delta=FLOAT)

    def test_identical_images_have_no_error_and_a_psnr_that_json_can_hold(self):
        a = self.png("a.png", noise(768, 1))
        got = self.compare(a, a, "--fail-above", "psnr=99", "--fail-above", "0")
        self.assertEqual([got[k] for k in ("mean", "rms", "max", "beyond", "butteraugli")], [0] * 5)
        self.assertEqual((got["psnr"], got["identical"], got["ssim"], got["within"]), (None, True, 1, True))
        text = self.expect(farlight("compare", a, a), 0).stdout
        self.assertIn("infinite", text)

    def test_noise_has_the_figures_that_python_finds(self):
        a, b = noise(768, 1), noise(768, 2)
        got = self.compare(self.png("a.png", a), self.png("b.png", b))
        errors = [abs(p - q) / 255 for p, q in zip(a, b)]
        self.assertAlmostEqual(got["mean"], sum(errors) / 768, delta=FLOAT)
        self.assertAlmostEqual(got["rms"], math.sqrt(sum(e * e for e in errors) / 768), delta=FLOAT)
        self.assertAlmostEqual(got["max"], max(errors), delta=FLOAT)
        far = sum(any(e > 0.01 for e in errors[i:i + 3]) for i in range(0, 768, 3))
        self.assertEqual(got["beyond_pixels"], far)

    def test_ssim_is_that_of_wang_and_others_of_luma(self):
        # 2e-6: variances are differences of means in 32-bit floats, some 1e-7 beside a constant of 9e-4.
        a, colours = noise(14 * 13, 3), [noise(12 * 12 * 3, seed) for seed in (5, 6)]
        luma = [[(0.2126 * v[i] + 0.7152 * v[i + 1] + 0.0722 * v[i + 2]) / 255 for i in range(0, len(v), 3)] for v in colours]
        grey = [value / 255 for value in a]
        for name, one, other, size, planes in (
                ("shifted", a, a[1:] + a[:1], (14, 13, 1), (grey, grey[1:] + grey[:1])),
                ("dark", a, [v // 2 for v in a], (14, 13, 1), (grey, [v // 2 / 255 for v in a])),
                ("colours", *colours, (12, 12, 3), luma)):
            got = self.compare(self.png("a.png", one, *size), self.png("b.png", other, *size))
            self.assertAlmostEqual(got["ssim"], ssim(*planes, *size[:2]), delta=2e-6, msg=name)

    @long_test
    def test_small_images_have_no_similarity_rather_than_a_wrong_one(self):
        got = self.compare(self.png("a.png", [0] * 49, 7, 7, 1), self.png("b.png", [255] * 49, 7, 7, 1))
        self.assertEqual((got["ssim"], got["butteraugli"], got["visible"], got["max"]), (None, None, None, 1))
        got = self.compare(self.png("a.png", [0] * 49, 7, 7, 1), self.png("b.png", [255] * 49, 7, 7, 1),
                           "--fail-above", "ssim=-1", status=1)
        self.assertFalse(got["within"], "what was not measured cannot be within a limit")

    @long_test
    def test_the_perceptual_figure_grows_with_what_is_seen(self):
        grey = self.png("a.png", [120] * 3072, 32, 32)
        got = [self.compare(grey, self.png("b.png", [120 + d] * 3072, 32, 32))["butteraugli"] for d in (0, 1, 4, 100)]
        self.assertEqual(got[0], 0)
        self.assertTrue(0 < got[1] < got[2] < got[3], got)
        # Brightness alone counts, too.
        black_white = self.compare(self.png("c.png", [0] * 3072, 32, 32), self.png("d.png", [255] * 3072, 32, 32))
        self.assertGreater(black_white["butteraugli"], 100)
        self.assertEqual(black_white["visible"], 1)

    def test_pixels_that_are_no_numbers_are_counted_and_break_no_figure(self):
        a, b = [0.5] * 768, [0.25] * 768
        a[0], a[3 * 17 + 2], b[3 * 17], b[3 * 30] = math.nan, math.inf, -math.inf, math.nan
        a, b = self.exr("a.exr", a), self.exr("b.exr", b)
        got = self.compare(a, b, "--threshold", "0.3")
        self.assertEqual((got["nonfinite_pixels"], got["nonfinite_pixels_a"], got["nonfinite_pixels_b"]), (3, 2, 2))
        self.assertEqual((got["beyond_pixels"], got["max"]), (3, 0.25))
        for figure in ("mean", "rms"):
            self.assertAlmostEqual(got[figure], 0.25, delta=FLOAT, msg=figure)
        self.assertFalse(self.compare(a, a)["identical"])
        text = self.expect(farlight("compare", a, b), 0).stdout
        self.assertIn("3 pixels (2 in the first, 2 in the second)", text)

    def test_images_without_any_number_have_no_errors_but_are_beyond(self):
        a = self.exr("a.exr", [math.nan] * 768)
        got = self.compare(a, self.exr("b.exr", [1.0] * 768))
        self.assertEqual([got[k] for k in ("psnr", "shown_psnr", "mean", "rms", "max")], [None] * 5)
        self.assertEqual((got["beyond"], got["nonfinite"], got["nonfinite_pixels_b"]), (1, 1, 0))

    def test_the_maximum_floats_do_not_overflow_the_answer(self):
        a, b = self.exr("a.exr", [3.4e38] * 768), self.exr("b.exr", [-3.4e38] * 768)
        got = self.compare(a, b, "-o", self.folder / "d.png")
        self.assertGreaterEqual(got["max"], 2.9e38)
        self.assertLess(got["psnr"], -700)

    @long_test
    def test_files_of_one_render_agree_as_shown_and_each_format_can_be_compared(self):
        """Half a step of 8 bits, and half of what half floats round near white (2^-12, steeper by up to 1.2 there)."""
        rendered = ["--size", "48x36", "--integrator", "whitted", "--samples", "1", "-q"]
        for name, tone_map in (("a.exr", "none"), ("a.hdr", "none"), ("a.jpg", "none"), ("none.png", "none"), ("aces.png", "aces"),
                               ("neutral.png", "neutral")):
            path = self.folder / name
            self.expect(farlight("render", bundled_scenes() / "cornell.glb", "-o", path, *rendered, "--tone-map", tone_map), 0)
            got = self.compare(path, path, "--fail-above", "0")
            self.assertEqual((got["space"], got["identical"]), ("linear" if path.suffix in (".exr", ".hdr") else "srgb", True))
            if path.suffix == ".png":
                got = self.compare(self.folder / "a.exr", path, "--tone-map", tone_map)
                self.assertEqual(got["space"], "srgb")
                self.assertLess(got["max"], 0.5 / 255 + 0.0006, tone_map)
                self.assertGreater(got["ssim"], 0.99)


class Limits(Compare):
    def setUp(self):
        super().setUp()
        values = [100] * 768
        values[3 * (16 * 8 + 8)] = 200  # max 0.392, beyond 1 / 256, PSNR 37
        self.a, self.b = self.png("a.png", [100] * 768), self.png("b.png", values)

    def test_a_limit_says_which_side_of_it_a_figure_is_on(self):
        within = ["0.4", "max=0.4", "psnr=36", "beyond=0.004", "beyond=0.4%", "ssim=0", "mean=1", "rms=1",
                  "butteraugli=1e6", "visible=100%", "nonfinite=0"]
        over = ["0.39", "max=0.39", "psnr=38", "beyond=0.0039", "beyond=0.39%", "ssim=1", "mean=0", "rms=0",
                "butteraugli=0", "visible=0"]
        for limits, status in ((within, 0), (over, 1)):
            got = self.compare(self.a, self.b, *sum((["--fail-above", each] for each in limits), []), status=status)
            self.assertEqual([each["within"] for each in got["limits"]], [status == 0] * len(limits), got["limits"])
            self.assertEqual(got["within"], status == 0)
        self.compare(self.a, self.b, "--fail-above", "0.39", status=1)

    def test_of_several_limits_one_is_enough_to_fail_and_is_named(self):
        result = self.expect(farlight("compare", self.a, self.b, "--fail-above", "1", "--fail-above", "psnr=50",
                                      "--fail-above", "beyond=50%"), 1)
        lines = [line for line in result.stdout.splitlines() if "over the limit" in line]
        self.assertEqual(len(lines), 1, result.stdout)
        self.assertIn("psnr", lines[0])
        self.assertIn("at least 50", lines[0])

    @long_test
    def test_a_pixel_that_is_no_number_fails_any_limit_unless_it_has_its_own(self):
        values = [0.5] * 768
        values[0] = math.nan
        a = self.exr("a.exr", values)
        self.compare(a, a, "--fail-above", "1", status=1)
        self.compare(a, a, "--fail-above", "1", "--fail-above", "nonfinite=0", status=1)
        self.compare(a, a, "--fail-above", "1", "--fail-above", "nonfinite=1%", status=0)

    def test_limits_that_cannot_be_meant_are_refused(self):
        for text, says in (("", "number"), ("x", "number"), ("psnr=", "number"), ("sharpness=1", "known: psnr"),
                           ("psnr=5%", "share"), ("beyond=101%", "--fail-above"), ("max=-1", "--fail-above"),
                           ("max=nan", "--fail-above"), ("=1", "figure")):
            with self.subTest(text):
                self.refused(self.a, self.b, "--fail-above", text, says=("--fail-above", says))


class Pictures(Compare):
    def test_the_heat_map_has_the_images_size_and_a_bright_spot_where_they_differ(self):
        values, path = [100] * 3072, self.folder / "d.png"
        values[3 * (32 * 9 + 20)] = 250
        got = self.compare(self.png("a.png", [100] * 3072, 32, 32), self.png("b.png", values, 32, 32), "-o", path)
        width, height, rows, channels = read_png(path)
        self.assertEqual((width, height, channels), (32, 32, 3))
        self.assertEqual((got["picture_width"], got["picture_height"]), (32, 32))
        self.assertAlmostEqual(got["heat_top"], 150 / 255, delta=FLOAT)
        sums = {(x, y): sum(rows[y][3 * x:3 * x + 3]) for x in range(32) for y in range(32)}
        self.assertGreater(sums.pop((20, 9)), 600)
        self.assertLess(max(sums.values()), 10)

    @long_test
    def test_the_scale_can_be_fixed_and_is_reported(self):
        a, b = self.png("a.png", [100] * 768), self.png("b.png", [110] * 768)
        brightness = []
        for top in ("0.04", "0.4"):
            path = self.folder / f"{top}.png"
            self.assertAlmostEqual(self.compare(a, b, "-o", path, "--heat-top", top)["heat_top"], float(top), delta=1e-7)
            brightness.append(sum(read_png(path)[2][8][24:27]))
        self.assertGreater(brightness[0], brightness[1])
        self.assertIn("light yellow, 0.04,", self.expect(
            farlight("compare", a, b, "-o", self.folder / "e.png", "--heat-top", "0.04"), 0).stdout)

    def test_pixels_that_are_no_numbers_are_magenta(self):
        values, path = [0.5] * 768, self.folder / "d.png"
        values[3 * 18] = math.nan  # 2,1
        self.compare(self.exr("a.exr", values), self.exr("b.exr", [0.5] * 768), "-o", path)
        rows = read_png(path)[2]
        self.assertEqual(tuple(rows[1][6:9]), MAGENTA)
        self.assertEqual(tuple(rows[1][9:12]), tuple(rows[0][0:3]))

    def test_side_by_side_shows_both_images_and_the_errors(self):
        path = self.folder / "d.png"
        a, b = self.png("a.png", [10, 200, 30] * 256), self.png("b.png", [10, 200, 90] * 256)
        got = self.compare(a, b, "-o", path, "--layout", "side")
        width, height, rows, _ = read_png(path)
        self.assertEqual((width, height), (3 * 16 + 2 * 4, 16), "three pictures, two gaps, too narrow for titles")
        self.assertEqual((got["picture_width"], got["picture_height"]), (width, height))
        self.assertEqual(tuple(rows[8][3 * 8:3 * 8 + 3]), (10, 200, 30))
        self.assertEqual(tuple(rows[8][3 * 28:3 * 28 + 3]), (10, 200, 90))
        self.assertGreater(sum(rows[8][3 * 48:3 * 48 + 3]), 600)

    def test_side_by_side_shows_linear_light_as_a_screen_would(self):
        path, linear = self.folder / "d.png", 0.2
        a = self.exr("a.exr", [linear] * 768)
        self.compare(a, a, "-o", path, "--layout", "side")
        # The neutral tone map takes 0.04 from colours this dark, then comes the sRGB curve.
        want = 255 * (1.055 * (linear - 0.04) ** (1 / 2.4) - 0.055)
        self.assertAlmostEqual(read_png(path)[2][8][24], want, delta=1)

    def test_jpeg_is_written_and_other_formats_are_refused(self):
        a, path = self.png("a.png", [9] * 768), self.folder / "d.jpg"
        self.compare(a, a, "-o", path)
        self.assertTrue(path.read_bytes().startswith(b"\xff\xd8\xff"))
        self.refused(a, a, "-o", self.folder / "d.exr", says=("d.exr", "PNG or JPEG"))
        self.refused(a, a, "-o", self.folder / "d", says=("PNG or JPEG",))

    def test_a_picture_never_replaces_what_is_compared(self):
        a = self.png("a.png", [9] * 768)
        before = a.read_bytes()
        self.refused(a, a, "-o", a, says=("would replace",))
        self.assertEqual(a.read_bytes(), before)

    def test_an_unwritable_picture_is_reported(self):
        a = self.png("a.png", [9] * 768)
        self.refused(a, a, "-o", a / "d.png", says=("d.png", "folder"))
        self.assertEqual(self.leftovers(), ["a.png"])


class BadFiles(Compare):
    def setUp(self):
        super().setUp()
        self.good = self.png("good.png", noise(768, 1))

    def test_what_is_no_image_is_named(self):
        fifo, text, missing = (self.folder / name for name in ("fifo.png", "text.png", "missing.png"))
        os.mkfifo(fifo)
        text.write_text("no image at all\n" * 50)
        other = self.png("other.png", [0] * 600, 20, 10)
        for a, b, *says in ((missing, self.good, missing, "No such file"), (self.good, missing, missing, "No such file"),
                            (self.good, self.folder, self.folder, "not a file"), (self.good, fifo, fifo, "not a file"),
                            (text, self.good, text, "is not an EXR, HDR, PNG or JPEG"),
                            (self.good, other, "good.png", "16x16", "other.png", "20x10")):
            self.refused(a, b, says=says)

    @long_test
    def test_of_a_file_with_layers_the_picture_is_compared(self):
        generator = random.Random(5)
        names = ("A", "B", "G", "R", "Z", "albedo.R", "normal.X", "position.Y")
        picture = [generator.random() for _ in range(16 * 16 * 4)]
        layered = self.exr("layered.exr", [value for i in range(256) for value in
                                           (*picture[4 * i:4 * i + 4], *(generator.random() for _ in range(4)))], names=names)
        plain = self.exr("plain.exr", picture, names=names[:4])
        got = self.compare(layered, plain)
        self.assertEqual((got["max"], got["channels"], got["identical"]), (0, "R,G,B,A", True))
        for some in (names[4:], names):  # five or more, and no picture among them
            values = [0.5] * (256 * (len(some) + 1))
            self.refused(self.exr("a.exr", values, names=[f"layer.{n}" for n in (*some, "W")]), plain, says=("a.exr", "channels"))

    def test_two_sets_of_channels_are_both_said_and_alpha_can_be_left_out(self):
        opaque = [v for p in zip(*[iter(noise(768, 1))] * 3) for v in (*p, 7)]
        other = self.png("other.png", opaque, channels=4)
        self.refused(self.good, other, says=("good.png", "R,G,B,", "other.png", "R,G,B,A", "--ignore-alpha"))
        got = self.compare(self.good, other, "--ignore-alpha")
        self.assertEqual((got["max"], got["channels"]), (0, "R,G,B"))

    @long_test
    def test_no_prefix_of_a_file_is_read_as_an_image(self):
        whole = {"png": self.good.read_bytes(), "exr": self.exr("e.exr", [0.5] * 768).read_bytes()}
        path = self.folder / "j.jpg"
        self.expect(farlight("render", bundled_scenes() / "cornell.glb", "-o", path, "--size", "48x36", "-q"), 0)
        whole["jpg"] = path.read_bytes()
        for ending, data in whole.items():
            for length in (0, 30, len(data) // 2, len(data) - 40):
                with self.subTest(ending=ending, length=length):
                    path = self.folder / f"cut.{ending}"
                    path.write_bytes(data[:length])
                    self.refused(path, path, says=(path,))

    def test_damaged_files_end_in_a_figure_or_a_message(self):
        source = random.Random(7)
        exr = self.exr("e.exr", [0.5] * 768)
        for whole in (self.good, exr):
            for _ in range(3):
                data = bytearray(whole.read_bytes())
                for _ in range(4):
                    data[source.randrange(8, min(400, len(data)))] = source.randrange(256)
                path = self.folder / f"damaged{whole.suffix}"
                path.write_bytes(data)
                result = farlight("compare", whole, path, "--json")
                self.assertIn(result.returncode, (0, 2), result.stderr)
                self.assertNotIn("signal", result.stderr)

    @long_test
    def test_channel_names_are_made_harmless_and_are_no_lists(self):
        four = write_exr(self.folder / "four.exr", 64, 64, ["R", "G", "B", "A"], [math.nan] * 4 * 4096)
        one = write_exr(self.folder / "one.exr", 64, 64, ["R,G,B,A"], [0.5] * 4096)
        for a, b in ((four, one), (one, four)):
            self.refused(a, b, says=(a, b, "channels"))
        for name in ("\x1b[2J", "\u00e4", "x" * 200):
            path = write_exr(self.folder / "name.exr", 8, 8, [name], [0.5] * 64)
            result = self.expect(farlight("compare", path, path), 0)
            self.assertTrue(result.stdout.replace("\n", "").isprintable() and result.stdout.isascii(), result.stdout)

    def test_a_header_that_promises_too_much_is_refused_before_it_costs_memory(self):
        data = bytearray(self.good.read_bytes())
        data[16:24] = struct.pack(">II", 60000, 60000)
        data[29:33] = struct.pack(">I", zlib.crc32(data[12:29]))
        path = self.folder / "large.png"
        path.write_bytes(data)
        self.refused(path, path, says=(path, "60000x60000", "8192"))

    def test_wrong_arguments_are_reported(self):
        self.refused(self.good, says=("two image files",))
        self.refused(self.good, self.good, self.good, says=("two images",))
        self.refused(self.good, self.good, "--threshold", "-1", says=("--threshold",))
        self.refused(self.good, self.good, "--threshold", "inf", says=("--threshold",))
        self.refused(self.good, self.good, "--layout", "round", says=("--layout", "heat, side"))

    def test_a_full_standard_output_is_a_failure(self):
        with open("/dev/full", "w", encoding="ascii") as full:
            result = subprocess.run([BIN / "farlight", "compare", self.good, self.good], stdout=full,
                                    stderr=subprocess.PIPE, check=False)
        self.assertEqual(result.returncode, 2)
