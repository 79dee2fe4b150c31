# SPDX-License-Identifier: MIT
"""What a person does with `farlight`: pictures of the bundled scenes, with and without a daemon.

Pictures are compared with stored figures: the mean colour of 8 x 8 parts. `python3 test_render.py --update` writes
them anew after a change that is meant to change pictures; look at the pictures first.
"""
import contextlib
import fcntl
import json
import os
import pty
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import termios
import time
import zlib

import farlight_test
from farlight_test import BIN, Case, Daemon, OneDaemon, bundled_scenes, farlight, grid_means, read_png

FIGURES = farlight_test.ROOT / "tests/integration/figures.json"
# Two of 255 in the mean over a cell of 20 x 15 pixels: what another driver's rounding and rasterisation may move at
# edges, and far less than any fault of shading does.
TOLERANCE = 2.0
PICTURES = {
    # The integrator without noise, and samples that stay in their pixel, or differences of these pictures would be that.
    "cornell": ("cornell.glb", ["--integrator", "whitted", "--filter", "box"]),
    "teapot": ("teapot.glb", ["--integrator", "whitted", "--filter", "box"]),
    "sphereflake-2": ("sphereflake-2.nff", ["--integrator", "whitted", "--filter", "box"]),
}


def render_picture(name, output, *more):
    model, options = PICTURES[name]
    return farlight("render", bundled_scenes() / model, "-o", output, "--size", "160x120", "--samples", "4",
                    *options, *more)


class Pictures(OneDaemon):
    def test_bundled_scenes_look_as_stored(self):
        stored = json.loads(FIGURES.read_text())
        for name in PICTURES:
            with self.subTest(scene=name):
                path = self.folder / f"{name}.png"
                self.expect(render_picture(name, path), 0)
                for cell, (got, want) in enumerate(zip(grid_means(path), stored[name])):
                    for channel in range(3):
                        self.assertAlmostEqual(got[channel], want[channel], delta=TOLERANCE,
                                               msg=f"{name}, cell {cell % 8},{cell // 8}, channel {channel}")

    def test_raster_and_traced_primaries_give_the_same_picture(self):
        paths = []
        for primary in ("raster", "trace"):
            paths.append(self.folder / f"{primary}.png")
            self.expect(render_picture("teapot", paths[-1], "--primary", primary), 0)
        for got, want in zip(grid_means(paths[0]), grid_means(paths[1])):
            for channel in range(3):
                self.assertAlmostEqual(got[channel], want[channel], delta=TOLERANCE)

    def test_boxes_spheres_and_brute_force_give_the_same_picture(self):
        variants = {"box": ["--bvh-bounds", "box"], "sphere": ["--bvh-bounds", "sphere"],
                    "naive": ["--tracer", "naive"]}
        means = {}
        for name, options in variants.items():
            path = self.folder / f"{name}.png"
            self.expect(render_picture("sphereflake-2", path, *options), 0)
            means[name] = grid_means(path)
        for name in ("sphere", "naive"):
            for got, want in zip(means[name], means["box"]):
                for channel in range(3):
                    self.assertAlmostEqual(got[channel], want[channel], delta=0.5, msg=name)

    def test_the_reference_tracer_gives_the_picture_of_bvh(self):
        """Spheres, mirrors and glass; the tracers see the same surfaces, so that only rays on edges differ: 0.5 of 255
        in the mean over a cell of 300 pixels is one such pixel gone from black to half white."""
        for name in PICTURES:
            with self.subTest(scene=name):
                paths = {tracer: self.folder / f"{name}-{tracer}.png" for tracer in ("bvh", "reference")}
                for tracer, path in paths.items():
                    result = render_picture(name, path, "--tracer", tracer, "--primary", "trace")
                    if tracer == "reference" and "libembree-dev" in result.stderr:
                        self.assertEqual(result.returncode, 1)
                        self.skipTest("this farlightd was built without Embree")
                    self.expect(result, 0)
                for got, want in zip(grid_means(paths["reference"]), grid_means(paths["bvh"])):
                    for channel in range(3):
                        self.assertAlmostEqual(got[channel], want[channel], delta=0.5, msg=name)
                unasked = self.folder / f"{name}-unasked.png"
                self.expect(render_picture(name, unasked, "--tracer", "reference"), 0)
                self.assertEqual(read_png(unasked), read_png(paths["reference"]),
                                 "the reference traces first hits, too, unless it is told to rasterise them")

    def test_a_crop_is_that_part_of_the_whole_picture(self):
        """To the byte, of rasterised and of traced first hits, and of all layers."""
        for primary, (x, y, width, height) in (("raster", (37, 21, 50, 33)), ("trace", (0, 112, 160, 8))):
            with self.subTest(primary=primary):
                whole, part = self.folder / "whole.png", self.folder / "part.png"
                self.expect(render_picture("cornell", whole, "--primary", primary), 0)
                self.expect(render_picture("cornell", part, "--primary", primary, "--crop", f"{x},{y},{width},{height}"), 0)
                _, _, rows, channels = read_png(whole)
                wanted = [row[x * channels:(x + width) * channels] for row in rows[y:y + height]]
                self.assertTrue(read_png(part) == (width, height, wanted, channels))
        whole, part = self.folder / "whole.exr", self.folder / "part.exr"
        layers = ("--layers", "beauty,normal,depth", "--float")
        self.expect(render_picture("cornell", whole, *layers), 0)
        self.expect(render_picture("cornell", part, *layers, "--crop", "37,21,50,33"), 0)
        wanted, got = farlight_test.read_exr(whole)[2], farlight_test.read_exr(part)[2]
        for name in got:
            self.assertEqual(list(got[name]), [value for y in range(21, 54)
                                               for value in wanted[name][y * 160 + 37:y * 160 + 87]], name)
        for options in (("--crop", "150,0,20,20"), ("--crop", "1,2,3"), ("--crop", "0,0,8,8", "--noise", "0.1")):
            self.assertIn("--crop", self.expect(render_picture("cornell", part, *options), 2).stderr)

    def test_wireframe_draws_edges_as_wide_as_asked(self):
        """One square, 40 pixels wide: of the row through its upper half lines 4 pixels wide cover 2 at each border, whose other
        halves lie outside, and sqrt(2) times 4 where the diagonal is crossed, which goes on to both sides of the edge."""
        model = self.folder / "square.obj"
        model.write_text("v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\nf 1 3 4\n")
        for integrator, primary in (("whitted", "raster"), ("raycast", "trace"), ("path", "trace")):
            with self.subTest(integrator=integrator):
                path = self.folder / "square.exr"
                self.expect(farlight("render", model, "-o", path, "--size", "60x60", "--eye", "0,0,10", "--look-at", "0,0,0",
                                     "--fov", "16.9924", "--wireframe", "4", "--integrator", integrator, "--primary", primary,
                                     "--layers", "albedo", "--filter", "box", "--samples", "16", "--float"), 0)
                _, _, values = farlight_test.read_exr(path)
                row = values["albedo.R"][20 * 60:21 * 60]
                self.assertAlmostEqual(sum(row) / 0.6, 40 - 4 - 4 * 2 ** 0.5, delta=0.5)

    def test_an_environment_lies_as_in_viewers_of_gltf(self):
        """Its middle column is +x and what is right of that is +z; a turn of 90 degrees about +y takes +x to -z."""
        red, green, dark = bytes((255, 16, 16, 129)), bytes((16, 255, 16, 129)), bytes((16, 16, 16, 129))
        sky = self.folder / "columns.hdr"
        sky.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n" + (3 * dark + 2 * red + 2 * green + dark) * 4)
        for towards, rotation, channel in (("1,100,0", 0, 0), ("0,100,1", 0, 1), ("0,100,-1", 90, 0), ("1,100,0", 90, 1)):
            with self.subTest(towards=towards, rotation=rotation):
                path = self.folder / "sky.png"
                self.expect(farlight("render", bundled_scenes() / "teapot.glb", "-o", path, "--size", "8x8", "--fov", "10",
                                     "--eye", "0,100,0", "--look-at", towards, "--environment", sky,
                                     "--environment-rotation", rotation), 0)
                _, _, rows, channels = read_png(path)
                middle = rows[4][4 * channels:4 * channels + 3]
                self.assertEqual(max(range(3), key=lambda c: middle[c]), channel, middle)

    def test_a_background_lies_behind_all_surfaces(self):
        """A colour is that of the display, whatever the exposure; what stands before it is as before the environment."""
        def corner_and_middle(background):
            path = self.folder / "background.png"
            self.expect(farlight("render", bundled_scenes() / "carousel.glb", "-o", path, "--size", "80x60", "--exposure", "1",
                                 "--integrator", "whitted", "--background", background), 0)
            width, height, rows, channels = read_png(path)
            return [tuple(rows[y][x * channels:(x + 1) * channels]) for x, y in ((0, 0), (width // 2, height // 2))]
        _, carousel = corner_and_middle("environment")
        self.assertEqual(corner_and_middle("transparent"), [(0, 0, 0, 0), carousel])
        colour, before = corner_and_middle("#2040a0")
        self.assertEqual((colour[:3], before), ((0x20, 0x40, 0xa0), carousel))
        result = self.expect(render_picture("teapot", self.folder / "none.png", "--background", "#2040a"), 2)
        self.assertIn("#ffffff", result.stderr)

    def test_a_ground_shows_the_shadow_of_a_model_and_nothing_else(self):
        """A square 2 m above a small one, which lies on the ground, under light from straight above: of its shadow what lies
        in front of the small one is seen."""
        model = self.folder / "roof.nff"
        model.write_text("v\nfrom 0 6 8\nat 0 0 0\nup 0 1 0\nangle 40\nhither 0.1\nresolution 64 64\nl 0 500 0\nf 1 1 1 1 0 0 0 1\n"
                         "p 4\n-1 2 -1\n-1 2 1\n1 2 1\n1 2 -1\np 4\n-0.1 0 -0.1\n-0.1 0 0.1\n0.1 0 0.1\n0.1 0 -0.1\n")
        def pixels(*options):
            path = self.folder / "ground.png"
            self.expect(farlight("render", model, "-o", path, "--size", "64x64", "--integrator", "whitted", *options), 0)
            _, _, rows, channels = read_png(path)
            place = lambda x, y: tuple(rows[y][x * channels:(x + 1) * channels])
            return place(32, 35), place(60, 60)  # 0.6 m in front of the middle, and far off
        self.assertEqual(pixels("--background", "transparent", "--ground"), ((0, 0, 0, 255), (0, 0, 0, 0)))
        self.assertEqual(pixels("--background", "transparent"), ((0, 0, 0, 0), (0, 0, 0, 0)))
        self.assertEqual([pixel[:3] for pixel in pixels("--background", "#2040a0", "--ground")], [(0, 0, 0), (0x20, 0x40, 0xa0)])
        result = self.expect(farlight("render", model, "-o", self.folder / "none.png", "--ground", "--stereo", "0.1"), 2)
        self.assertIn("--views rays", result.stderr)

    def test_light_from_below_a_ground_does_not_count_for_its_shadows(self):
        """Alpha beneath a roof, under images that are alike above the horizon, and as bright or 8 times as bright below it; what
        its 64 rows mix at the horizon is 1 % of the light. A ray is off by
        1/2 at most, the mean of 1024 pixels of 64 rays each by 0.002."""
        model = self.folder / "roof.obj"
        model.write_text("v -1 1 -1\nv -1 1 1\nv 1 1 1\nv 1 1 -1\nv 0 0 0\nv 0.01 0 0\nv 0 0 0.01\nf 1 2 3 4\nf 5 6 7\n")
        means = []
        for below in (129, 132):
            sky = self.folder / "below.hdr"
            sky.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 64 +X 8\n" + bytes((128, 128, 128, 129)) * 256
                            + bytes((128, 128, 128, below)) * 256)
            path = self.folder / "below.png"
            self.expect(farlight("render", model, "-o", path, "--size", "32x32", "--eye", "0,0.9,4", "--look-at", "0,0,0",
                                 "--fov", "20", "--samples", "16", "--ground", "--background", "transparent",
                                 "--environment", sky), 0)
            _, _, rows, _ = read_png(path)
            means.append(sum(sum(row[3::4]) for row in rows) / (255 * 32 * 32))
        self.assertGreater(means[0], 0.1)
        self.assertAlmostEqual(means[0], means[1], delta=0.006)

    def test_the_same_seed_gives_the_same_bytes(self):
        paths = [self.folder / "a.png", self.folder / "b.png"]
        for path in paths:
            self.expect(render_picture("teapot", path, "--seed", "7"), 0)
        self.assertEqual(read_png(paths[0])[2], read_png(paths[1])[2])


class Outputs(OneDaemon):
    def test_every_format_is_written_and_nothing_else(self):
        magics = {"png": b"\x89PNG", "jpg": b"\xff\xd8\xff", "exr": b"\x76\x2f\x31\x01", "hdr": b"#?RADIANCE", "webp": b"RIFF",
                  "tif": b"II*\0", "gif": b"GIF89a"}
        for ending, magic in magics.items():
            path = self.folder / f"picture.{ending}"
            self.expect(render_picture("cornell", path), 0)
            self.assertTrue(path.read_bytes().startswith(magic), ending)
        self.assertEqual(self.leftovers(), sorted(f"picture.{ending}" for ending in magics))

    def test_tiff_has_the_pixels_of_png_and_webp_its_alpha(self):
        def picture(ending):
            path = self.folder / f"picture.{ending}"
            self.expect(farlight("render", bundled_scenes() / "carousel.glb", "-o", path, "--size", "80x60", "--integrator",
                                 "whitted", "--background", "transparent"), 0)
            return path
        data, (width, height, rows, _) = picture("tiff").read_bytes(), read_png(picture("png"))
        at, tags = struct.unpack_from("<I", data, 4)[0], {}
        for i in range(struct.unpack_from("<H", data, at)[0]):
            tag, _, _, value = struct.unpack_from("<HHII", data, at + 2 + 12 * i)
            tags[tag] = value
        self.assertEqual([tags[tag] for tag in (256, 257, 277, 338)], [width, height, 4, 2], "size, channels, straight alpha")
        plain = zlib.decompress(data[tags[273]:tags[273] + tags[279]])
        for y, row in enumerate(rows):
            got = bytearray(plain[y * width * 4:(y + 1) * width * 4])
            for i in range(4, len(got)):
                got[i] = (got[i] + got[i - 4]) & 255
            self.assertTrue(bytes(got) == row, y)
        data = picture("webp").read_bytes()
        self.assertEqual((data[8:16], data[20] >> 4 & 1), (b"WEBPVP8X", 1))

    def test_jpeg_tells_in_a_comment_and_in_exif_what_it_shows(self):
        path = self.folder / "picture.jpg"
        for metadata, tags_wanted in (("stable", {270, 305}), ("full", {270, 305, 306})):
            self.expect(render_picture("cornell", path, "--metadata", metadata), 0)
            data, at, segments = path.read_bytes(), 2, {}
            while data[at + 1] != 0xda:
                count, = struct.unpack_from(">H", data, at + 2)
                segments[data[at + 1]] = data[at + 4:at + 2 + count]
                at += 2 + count
            exif = segments[0xe1][6:]
            self.assertEqual((segments[0xe1][:6], exif[:4]), (b"Exif\0\0", b"II*\0"))
            first, = struct.unpack_from("<I", exif, 4)
            entries = (struct.unpack_from("<HHII", exif, first + 2 + 12 * i) for i in range(*struct.unpack_from("<H", exif, first)))
            texts = {tag: exif[offset:offset + count] for tag, kind, count, offset in entries if kind == 2}
            self.assertEqual(set(texts), tags_wanted, "description, software and, in full, date")
            self.assertEqual(texts[270], segments[0xfe] + b"\0")
            self.assertIn(b"farlight/tracer=bvh\n", segments[0xfe])
            self.assertEqual(texts[305][:9], b"farlight ")

    def test_exr_metadata_holds_camera_and_tracer_and_in_full_revision_times_and_path(self):
        path = self.folder / "picture.exr"
        always = {"worldToCamera", "farlight/tracer", "farlight/digest", "farlight/model"}
        only_full = {"capDate", "farlight/revision", "farlight/stage/primary/gpu_ms"}
        self.expect(render_picture("cornell", path), 0)
        stable = farlight_test.exr_attributes(path)
        self.expect(render_picture("cornell", path, "--metadata", "full"), 0)
        full = farlight_test.exr_attributes(path)
        self.assertLessEqual(always, set(stable))
        self.assertLessEqual(always | only_full, set(full))
        self.assertEqual(only_full & set(stable), set())
        self.assertEqual(stable["farlight/model"], b"cornell.glb")
        # ITU-R BT.709: red, green, blue and the white D65; as floats, so to a part in 1e7
        for got, wanted in zip(struct.unpack("<8f", stable["chromaticities"]),
                               (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329), strict=True):
            self.assertAlmostEqual(got, wanted, delta=1e-6)
        self.assertEqual(full["farlight/model"], str(bundled_scenes() / "cornell.glb").encode())

    def test_the_same_request_makes_the_same_bytes_in_every_format(self):
        folders, coarse = [self.folder / "a", self.folder / "b"], ["--ldc-resolution", "64"]  # of PNG as it is by default
        formats = {"png": [], "exr": [*coarse, "--layers", "beauty,depth"],
                   **{ending: coarse for ending in ("jpg", "hdr", "webp", "tiff", "gif")}}
        for folder in folders:
            folder.mkdir()
            shutil.copy(bundled_scenes() / "teapot.glb", folder)
            for ending, options in formats.items():
                self.expect(farlight("render", folder / "teapot.glb", "-o", folder / f"p.{ending}", "--size", "40x30",
                                     "--tracer", "ldc", *options), 0)
            self.expect(farlight("render", folder / "teapot.glb", "-o", folder / "full.png", "--size", "40x30",
                                 "--metadata", "full"), 0)
            time.sleep(1)  # dates in files have seconds
        for ending in formats:
            same = [(folder / f"p.{ending}").read_bytes() for folder in folders]
            self.assertTrue(same[0] == same[1], ending)
        self.assertTrue((folders[0] / "full.png").read_bytes() != (folders[1] / "full.png").read_bytes())

    def test_standard_output_gets_the_picture_and_no_talk(self):
        for output in ("-", "/dev/stdout"):
            result = farlight("render", bundled_scenes() / "cornell.glb", "-o", output, "--format", "png", "--size", "32x24",
                              "--timings", text=False)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertTrue(result.stdout.startswith(b"\x89PNG"), result.stdout[:40])
            self.assertTrue(result.stdout.endswith(b"IEND\xaeB`\x82"), "text after the picture")

    def test_timings_as_json_name_every_stage(self):
        path = self.folder / "picture.png"
        result = self.expect(render_picture("teapot", path, "--timings=json"), 0)
        lines = [json.loads(line) for line in result.stdout.splitlines()]
        text = json.dumps(lines)
        for stage in ("apply", "build", "upload", "primary", "trace", "shade", "resolve", "readback", "encode", "queue",
                      "send"):
            self.assertIn(f'"{stage}"', text)

    def test_an_animation_writes_every_frame_and_turns(self):
        pattern = self.folder / "frames" / "%04d.png"
        pattern.parent.mkdir()
        self.expect(farlight("animate", bundled_scenes() / "sphereflake-2.nff", "--frames", "1-4", "--fps", "24",
                             "--orbit", "--size", "64x48", "-o", pattern), 0)
        self.assertEqual(self.leftovers(), [f"frames/{n:04d}.png" for n in range(1, 5)])
        pictures = {read_png(self.folder / name)[2][24] for name in self.leftovers()}
        self.assertEqual(len(pictures), 4, "frames of an orbit must differ")


class FirstPicture(Case):
    def test_what_other_processors_compile_is_not_compiled_again(self):
        """Software GL hands code over in the files of its cache: as many as where one processor compiles all."""
        files, pictures = [], []
        for name, processors in (("one", {min(os.sched_getaffinity(0))}), ("all", os.sched_getaffinity(0))):
            cache, picture = self.folder / name, self.folder / f"{name}.png"
            result = farlight("render", bundled_scenes() / "teapot.glb", "-o", picture, "--size", "80x60", "--integrator", "path",
                              env={**os.environ, "XDG_CACHE_HOME": str(cache)},
                              preexec_fn=lambda own=processors: os.sched_setaffinity(0, own))
            self.expect(result, 0)
            files.append(sum(path.is_file() for path in cache.glob("mesa_shader_cache/**/*")))
            pictures.append(picture.read_bytes())
        self.assertEqual(*files)
        self.assertEqual(*pictures)


class BadInput(Case):
    def refused(self, status, *arguments, says=()):
        result = self.expect(farlight(*arguments), status)
        for word in says:
            self.assertIn(word, result.stderr)
        self.assertEqual(self.leftovers(), [])
        return result

    def test_each_mistake_is_named_and_leaves_nothing_behind(self):
        cornell, output = bundled_scenes() / "cornell.glb", self.folder / "x.png"
        self.refused(1, "render", self.folder / "missing.glb", "-o", output, says=["missing.glb"])
        self.refused(2, "render", cornell, "-o", output, "--tracer", "magic", says=["magic", "bvh"])
        self.refused(2, "render", cornell, "-o", output, "--size", "0x10", says=["0x10"])
        self.refused(2, "render", cornell, "-o", output, "--size", "99999x99999", says=["8192"])
        self.refused(2, "render", cornell, "-o", output, "--fov", "nan", says=["nan"])
        self.refused(2, "render", cornell, "-o", output, "--eye", "1,inf,0", "--look-at", "0,0,0", says=["inf"])
        self.refused(2, "render", cornell, says=["-o"])
        self.refused(2, "render", says=["MODEL"])
        self.refused(2, "render", cornell, "-o", output, "--no-such-option")
        self.refused(75, "render", cornell, "-o", output, "--server", f"unix:{self.folder}/nobody.sock",
                     says=["nobody.sock"])
        self.refused(2, "render", cornell, "-o", output, "--camera", "no such camera", says=["no such camera"])
        self.refused(2, "animate", cornell, "--frames", "1-4", "-o", self.folder / "%s.png", says=["%"])

    def test_what_is_nearly_an_option_or_a_subcommand_is_guessed(self):
        self.refused(2, "render", "--sise", "1x1", says=["'--size'"])
        self.refused(2, "render", "-q", "--tracr=bvh", says=["'--tracer'"])
        self.refused(2, "stats", "--wacth", says=["'--watch'"])
        self.refused(2, "rendr", says=["'render'"])
        self.refused(2, "help", "rendr", says=["'render'"])
        self.refused(2, "help", "nonsense", says=["not a subcommand"])
        # A value that looks like an option is none.
        result = self.refused(2, "render", bundled_scenes() / "cornell.glb", "-qo", "--sise", says=["no image format"])
        self.assertNotIn("did you mean", result.stderr)

    def test_a_script_that_is_no_json_is_a_mistake_in_usage(self):
        script = self.folder / "script.json"
        cornell = bundled_scenes() / "cornell.glb"
        for text in ("nothing", "[1", ""):
            script.write_text(text)
            for command in (["animate", "--script", script], ["view", cornell, "--headless", "--replay", script],
                            ["animate", cornell, "--frames", "1-2", "--keys", script, "-o", self.folder / "%d.png"]):
                with self.subTest(text=text, command=command):
                    self.assertIn("script.json", self.expect(farlight(*command), 2).stderr)

    def test_a_missing_folder_is_made_when_there_is_something_to_write(self):
        cornell, folder = bundled_scenes() / "cornell.glb", self.folder / "made" / "for" / "it"
        self.expect(farlight("animate", cornell, "--frames", "1-2", "-o", folder / "%d.png", "--dry-run"), 0)
        self.refused(1, "render", self.folder / "missing.glb", "-o", folder / "x.png", says=["missing.glb"])
        self.assertEqual(list(self.folder.iterdir()), [])
        self.expect(farlight("render", cornell, "--size", "8x8", "-o", folder / "x.png"), 0)
        self.assertEqual(self.leftovers(), ["made/for/it/x.png"])

    def test_a_client_that_is_killed_while_it_tries_its_folder_leaves_no_file_there(self):
        before = self.folder.stat().st_mtime_ns
        self.refused(75, "render", bundled_scenes() / "cornell.glb", "-o", self.folder / "x.png", "--server",
                     f"unix:{self.folder}/nobody.sock")
        self.assertEqual(self.folder.stat().st_mtime_ns, before, "a file with a name was there")

    def test_messages_name_the_pattern_of_the_files_not_a_file_that_nobody_wants(self):
        (self.folder / "file").write_text("")
        result = farlight("animate", bundled_scenes() / "cornell.glb", "--frames", "1-2", "-o", self.folder / "file" / "%04d.png")
        self.expect(result, 1)
        self.assertIn("file/%04d.png: ", result.stderr)
        self.assertNotIn("10000000", result.stderr)

    def shown_by(self, columns, *command):
        """What the command shows on a terminal that is so wide."""
        parent, child = pty.openpty()
        fcntl.ioctl(child, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
        drawing = subprocess.Popen([BIN / "farlight", *command], stderr=child, env={**os.environ, "TERM": "xterm"})
        os.close(child)
        shown = b""
        with contextlib.suppress(OSError):  # the end of a terminal
            while data := os.read(parent, 65536):
                shown += data
        os.close(parent)
        self.assertEqual(drawing.wait(farlight_test.TIMEOUT_S), 0, shown)
        return shown

    def test_progress_fits_a_narrow_terminal(self):
        for columns in (10, 30, 60):
            shown = self.shown_by(columns, "animate", bundled_scenes() / "cornell.glb", "--frames", "1-3", "--size", "16x16", "-o",
                                  self.folder / "%d.png")
            lines = [line for line in re.split(rb"[\r\n]|\x1b\[K", shown) if line]
            self.assertIn(b"3", lines[-1])
            self.assertLess(max(map(len, lines)), columns, lines)

    def test_noise_ends_a_picture_by_its_error_and_tells_how_far_it_is(self):
        wanted = ["--size", "64x48", "--integrator", "path", "--noise", "0.3"]
        self.default_samples()
        self.expect(farlight("render", bundled_scenes() / "cornell.glb", "-o", self.folder / "whole.exr", *wanted), 0)
        shown = self.shown_by(100, "render", bundled_scenes() / "cornell.glb", "-o", self.folder / "again.exr", *wanted)
        self.assertRegex(shown, rb"error [0-9.]+ %, wanted 30 %")
        self.assertEqual((self.folder / "whole.exr").read_bytes(), (self.folder / "again.exr").read_bytes())

    def test_noise_counts_only_what_tiles_need(self):
        """A picture of nothing has 16 samples, however many it might have."""
        self.default_samples()
        result = self.expect(farlight("render", bundled_scenes() / "teapot.glb", "-o", self.folder / "x.png", "--size", "64x48",
                                      "--eye", "0,90,0", "--look-at", "0,180,1", "--noise", "0.02", "--quiet", "--timings=json"), 0)
        self.assertEqual(json.loads(result.stdout.splitlines()[0])["samples"], 16)

    def test_noise_of_pictures_made_of_layers_is_refused_with_a_remedy(self):
        result = farlight("render", bundled_scenes() / "teapot.glb", "-o", self.folder / "x.png", "--size", "64x48",
                          "--stereo", "0.065", "--noise", "0.02")
        self.expect(result, 2)
        self.assertIn("--noise", result.stderr)
        self.assertIn("--views rays", result.stderr)

    def test_a_model_that_is_no_model_is_refused_by_name(self):
        path = self.folder / "rubbish.glb"
        path.write_bytes(b"glTF\x02\0\0\0" + bytes(range(256)) * 3)
        result = farlight("render", path, "-o", self.folder / "x.png")
        self.expect(result, 1)
        self.assertIn("rubbish.glb", result.stderr)
        self.assertEqual(self.leftovers(), ["rubbish.glb"])

    def test_a_full_disk_is_reported_and_leaves_no_half_file(self):
        result = subprocess.run(["sh", "-c", 'ulimit -f 8; exec "$0" "$@"', BIN / "farlight", "render",
                                 bundled_scenes() / "cornell.glb", "-o", self.folder / "x.exr", "--float", "--size",
                                 "320x240"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False,
                                timeout=farlight_test.TIMEOUT_S)
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn("x.exr", result.stderr)
        self.assertEqual(self.leftovers(), [])

    def test_an_interrupt_ends_an_animation_cleanly(self):
        pattern = self.folder / "%04d.png"
        child = subprocess.Popen([BIN / "farlight", "animate", bundled_scenes() / "teapot.glb", "--frames", "1-500",
                                  "--orbit", "--size", "320x240", "-o", pattern], stdout=subprocess.PIPE,
                                 stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + farlight_test.TIMEOUT_S
        while not any(self.folder.iterdir()) and time.monotonic() < deadline and child.poll() is None:
            time.sleep(0.05)
        child.send_signal(signal.SIGINT)
        _, errors = child.communicate(timeout=farlight_test.TIMEOUT_S)
        self.assertEqual(child.returncode, 130, errors)
        for name in self.leftovers():
            read_png(self.folder / name)  # complete, or it would not be here


class ThroughADaemon(Case):
    def test_the_second_upload_moves_no_bulk_data(self):
        with Daemon() as daemon:
            uploaded, pictures = [], []
            for number in range(2):
                path = self.folder / f"{number}.png"
                result = self.expect(render_picture("teapot", path, "--server", daemon.address, "--timings=json"), 0)
                records = [json.loads(line) for line in result.stdout.splitlines()]
                uploaded.append(next(r["uploaded_bytes"] for r in records if r["kind"] == "client"))
                pictures.append(read_png(path)[2])
            self.assertGreater(uploaded[0], 0)
            self.assertEqual(uploaded[1], 0)
            self.assertEqual(pictures[0], pictures[1])

    def test_stats_name_the_device_and_the_stages(self):
        with Daemon() as daemon:
            self.expect(render_picture("cornell", self.folder / "x.png", "--server", daemon.address), 0)
            record = json.loads(self.expect(farlight("stats", "--server", daemon.address, "--json"), 0).stdout)
            self.assertTrue(record["device"])
            self.assertGreaterEqual(record["frames"], 1)

    def test_stats_tell_the_limits_that_the_configuration_sets(self):
        changed = dict(os.environ, FARLIGHT_LIMITS_SCENES="7")
        with Daemon(environment=changed) as daemon:
            record = json.loads(self.expect(farlight("stats", "--server", daemon.address, "--json"), 0).stdout)
            table = self.expect(farlight("stats", "--server", daemon.address, "--limits"), 0).stdout
            without = self.expect(farlight("stats", "--server", daemon.address), 0).stdout
        self.assertEqual((record["limits"]["scenes_per_client"], record["limits"]["samples_max"]), (7, 65536))
        self.assertRegex(table, r"(?m)^limit  scenes_per_client +7  scenes of a client$")
        self.assertEqual(sum(line.startswith("limit ") for line in table.splitlines()), len(record["limits"]))
        self.assertNotIn("limit ", without)

    def test_info_counts_what_is_in_a_file(self):
        text = self.expect(farlight("info", bundled_scenes() / "cornell.glb"), 0).stdout
        for word in ("triangles", "materials", "lights", "cameras"):
            self.assertIn(word, text)

    def test_names_that_a_terminal_would_obey_are_shown_harmless_and_complete_in_json(self):
        name = "a\u009b2J\u202egpj.exe\u2066\u00e4"
        with tempfile.TemporaryDirectory(prefix="farlight-test-") as folder:
            path = os.path.join(folder, "names.gltf")
            with open(path, "w", encoding="utf-8") as file:
                json.dump({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
                           "nodes": [{"camera": 0, "name": name}],
                           "cameras": [{"type": "perspective", "name": name, "perspective": {"yfov": 1, "znear": 1}}]}, file)
            table = self.expect(farlight("info", path), 0).stdout
            line = self.expect(farlight("info", path, "--json"), 0).stdout
        self.assertIn("a?2J?gpj.exe?\u00e4", table)
        self.assertTrue(line.isascii())
        self.assertIn(name, [camera["name"] for camera in json.loads(line)["cameras"]])


def update_figures():
    figures = {}
    for name in PICTURES:
        path = f"/tmp/farlight-{os.getpid()}-{name}.png"
        result = render_picture(name, path)
        if result.returncode:
            sys.exit(result.stderr)
        figures[name] = grid_means(path)
        os.unlink(path)
    FIGURES.write_text("{\n" + ",\n".join(f'"{name}": {json.dumps(means)}' for name, means in figures.items()) + "\n}\n")


if __name__ == "__main__":
    if "--update" in sys.argv:
        update_figures()
    else:
        farlight_test.unittest.main()
