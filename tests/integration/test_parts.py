# SPDX-License-Identifier: MIT
"""One still by many commands: `render --part` and `merge`. Any number of parts has the bytes of one run, and what is no part, or is
none of the same picture, is refused with the reason."""
import json
import os
import random
import signal
import struct
import subprocess
import unittest

import farlight_test
from farlight_test import (Case, Daemon, OneDaemon, bundled_scenes, exr_attributes, farlight, private_daemon, read_exr)

ROOM = ["cornell.glb", "--size", "96x54", "--samples", "2", "--integrator", "path"]
ALL_LAYERS = ["--float", "--layers", "beauty,light,depth,normal,id,crypto-object,motion,ao", "--light-group", "key=*"]
DRIVER = b"llvmpipe"


def render(options, *more, **environment):
    model, *others = options
    return farlight("render", bundled_scenes() / model, *others, "--progress", "lines", *more, **environment)


class PartsCase(Case):
    def parts(self, options, count, *more, name="part"):
        """The files of all parts."""
        paths = [self.folder / f"{name}-{number}-of-{count}.exr" for number in range(1, count + 1)]
        for number, path in enumerate(paths, 1):
            self.expect(render(options, "--part", f"{number}/{count}", "-o", path, *more), 0)
        return paths

    def merge(self, parts, *more, status=0, name="merged.exr"):
        """The file's bytes, or what is said."""
        path = self.folder / name
        result = self.expect(farlight("merge", *parts, "-o", path, *more), status)
        if status == 0:
            return path.read_bytes()
        self.assertFalse(path.exists())
        return result.stderr


class Parts(PartsCase, OneDaemon):
    def is_as_one_run(self, options, counts, *more):
        whole, merged = self.folder / "whole.exr", self.folder / "merged.exr"
        self.expect(render(options, "--primary", "trace", "-o", whole, *more), 0)
        files = [self.merge(reversed(self.parts(options, count, *more))) for count in counts]
        self.assertEqual([file == files[0] for file in files], [True] * len(counts))
        self.assertEqual(read_exr(merged), read_exr(whole))
        ours, theirs = exr_attributes(merged), exr_attributes(whole)
        self.assertIsNotNone(theirs.pop("farlight/digest"))  # of pixels as they came from the daemon
        for attributes in (ours, theirs):
            attributes.pop("")
        self.assertEqual(ours, theirs)

    def test_any_number_of_parts_has_the_bytes_of_one_run(self):
        self.is_as_one_run(ROOM, (1, 2, 3, 8))

    def test_so_have_all_layers(self):
        self.is_as_one_run(ROOM, (1, 3), *ALL_LAYERS)

    def test_software_rounds_alike_in_all_parts_and_a_crop_of_the_whole(self):
        """A whole picture has rays of several origins in packets, and a crop has not."""
        options = ["teapot.glb", "--size", "320x180", "--samples", "4", "--integrator", "path"]
        files = [self.merge(self.parts(options, count)) for count in (1, 2)]
        self.assertEqual(files[0] == files[1], True)
        self.expect(render(options, "--primary", "trace", "--crop", "0,0,320,180", "-o", self.folder / "crop.exr"), 0)
        self.assertEqual(read_exr(self.folder / "merged.exr"), read_exr(self.folder / "crop.exr"))

    def test_how_frames_travel_does_not_matter(self):
        first, second = self.parts(ROOM, 2)
        self.expect(render(ROOM, "--part", "2/2", "-o", self.folder / "other.exr", "--encoding", "zstd", env=private_daemon()), 0)
        self.assertEqual((self.folder / "other.exr").read_bytes(), second.read_bytes())
        self.assertTrue(self.merge([first, self.folder / "other.exr"]))

    def test_a_part_is_black_where_it_has_no_pixels(self):
        """So all parts add up to the whole in any program."""
        parts = [read_exr(path)[2] for path in self.parts(ROOM, 3, "--float")]
        self.merge(sorted(self.folder.glob("part-*")))
        for name, values in read_exr(self.folder / "merged.exr")[2].items():
            self.assertEqual([sum(each) for each in zip(*(part[name] for part in parts))], values)

    def test_a_part_that_exists_is_left_out_if_it_is_of_the_same_picture(self):
        path = self.parts(ROOM, 2)[0]
        before = path.stat().st_mtime_ns
        again = ["--part", "1/2", "--resume", "-o", path]
        self.assertIn("part 1 of 2 exists already", self.expect(render(ROOM, *again), 0).stderr)
        self.assertEqual(path.stat().st_mtime_ns, before)
        for more in (["--seed", "3"], ["--layers", "beauty,depth"], ["--layers", "beauty,depth", "--float"]):
            self.assertNotIn("exists", self.expect(render(ROOM, *again, *more), 0).stderr)
        self.assertIn("add --part", self.expect(render(ROOM, "--resume", "-o", path), 2).stderr)

    def test_what_is_missing_or_doubled_is_named(self):
        one, two, three, four = self.parts(ROOM, 4)
        self.assertIn("parts 1 and 3 of 4 are missing", self.merge([two, four], status=1))
        self.assertIn("part 4 of 4 is missing", self.merge([one, two, three], status=1))
        said = self.merge([one, two, three, four, two], status=1)
        self.assertIn(f"{two}: is part 2, and so is {two}", said)
        self.assertIn("would replace", self.expect(farlight("merge", one, two, three, four, "-o", one), 2).stderr)
        self.assertEqual(self.expect(farlight("merge", "-o", self.folder / "x.exr"), 2).stderr.count("no part is named"), 1)
        self.assertIn("--output", self.expect(farlight("merge", one, "-o", "x.png"), 2).stderr)

    def test_parts_of_another_picture_are_refused(self):
        one, _ = self.parts(ROOM, 2)
        for more, words in ((["--samples", "3"], "in farlight/samples"), (["--seed", "7"], "the model, the camera or an option differs"),
                            (["--size", "96x56"], "in dataWindow"), (["--float"], "in channels"),
                            (["--edit", "material.white.roughness=0.5"], "the model, the camera or an option differs"),
                            (["--exposure", "1"], "in farlight/exposure_stops")):
            with self.subTest(more):
                other = self.folder / "other.exr"
                self.expect(render(ROOM, *more, "--part", "2/2", "-o", other), 0)
                self.assertIn(f"{other}: ", said := self.merge([one, other], status=1))
                self.assertIn(words, said)
        for options, words in ((["--part", "2/3"], "is one of 3 parts"), ([], "is no part of a picture")):
            self.expect(render(ROOM, *options, "-o", self.folder / "other.exr"), 0)
            self.assertIn(words, self.merge([one, self.folder / "other.exr"], status=1))

    def test_parts_of_another_device_or_version_are_refused(self):
        one, two = self.parts(ROOM, 2)
        good, bytes_ = self.merge([one, two], name="good.exr"), two.read_bytes()
        self.assertEqual(bytes_.count(DRIVER), 1)
        two.write_bytes(bytes_.replace(DRIVER, b"A40-card"))
        self.assertRegex(self.merge([one, two], status=1), rf"{two}: was rendered by 'A40-card .*, and {one} by 'llvmpipe .*--any-device")
        self.assertEqual(self.merge([one, two], "--any-device"), good)
        (self.folder / "merged.exr").unlink()
        version = exr_attributes(two)["Software"]
        two.write_bytes(bytes_.replace(version, version[:-1] + b"x"))
        self.assertIn("merge them, with one version", self.merge([one, two], status=1))

    def test_what_does_not_go_with_parts_is_said(self):
        for more, words in ((["--noise", "0.1"], "--noise"), (["--samples", "auto"], "--samples auto"), (["--denoise"], "--denoise"),
                            (["--stereo", "0.06"], "--stereo"), (["--crop", "0,0,8,8"], "--crop"), (["--progressive"], "--progressive"),
                            (["--watch"], "--watch"), (["--exr-compression", "dwaa"], "dwaa"), (["--metadata", "full"], "--metadata full"),
                            (["--size", "16x16"], "at most 4"), (["-o", "x.png"], "no png file"), (["--part", "0/8"], "--part"),
                            (["--part", "9/8"], "no part 9 of 8"), (["--part", "1/513", "--size", "4096x4096"], "at most 512")):
            with self.subTest(more):
                result = self.expect(render(ROOM, "--part", "1/8", "-o", self.folder / "x.exr", *more), 2)
                self.assertIn("--part", result.stderr)
                self.assertIn(words, result.stderr)
        result = farlight("render", "--scene", "x", "--part", "1/2", "-o", self.folder / "x.exr")
        self.assertIn("--part: cannot be combined with --scene", self.expect(result, 2).stderr)
        result = farlight("render", "-", "--part", "1/2", "-o", self.folder / "x.exr", input="")
        self.assertIn("standard input", self.expect(result, 2).stderr)

    def test_a_part_that_is_killed_leaves_no_file_and_is_repeated(self):
        long_ = [*ROOM, "--samples", "4096"]  # eleven more squares, each of seconds
        command = [farlight_test.BIN / "farlight", "render", bundled_scenes() / long_[0], *long_[1:], "--part", "1/2", "-o",
                   self.folder / "part.exr"]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
            self.assertIn("squares of the part", process.stderr.readline())
            process.kill()
        self.assertEqual(self.leftovers(), [])
        first, second = self.parts(ROOM, 2)
        before = first.read_bytes()
        self.parts(ROOM, 2)
        self.assertEqual(first.read_bytes(), before)
        self.assertTrue(self.merge([first, second]))


class LikeGpu(PartsCase):
    def test_a_gpu_has_the_bytes_of_one_run_where_software_would_round(self):
        options = ["teapot.glb", "--size", "320x180", "--samples", "4", "--integrator", "path"]
        with Daemon(environment={**os.environ, "FARLIGHT_LIKE_GPU": "1"}) as gpu:
            server = ["--server", gpu.address]
            self.merge(self.parts(options, 2, *server))
            self.expect(render(options, "--primary", "trace", "-o", self.folder / "whole.exr", *server), 0)
        self.assertEqual(read_exr(self.folder / "merged.exr"), read_exr(self.folder / "whole.exr"))

    def test_a_daemon_that_comes_back_costs_the_square_that_it_was_at(self):
        options = [*ROOM, "--samples", "64"]
        whole = self.parts(options, 2)[0].read_bytes()
        with Daemon() as daemon:
            command = [farlight_test.BIN / "farlight", "render", bundled_scenes() / options[0], *options[1:], "--part", "1/2", "-o",
                       self.folder / "part.exr", "--server", daemon.address, "--timings=json"]
            with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
                while "squares of the part" not in process.stderr.readline():
                    self.assertIsNone(process.poll())
                daemon.stop(signal.SIGKILL)
                daemon.process.stdout.close()
                with Daemon(listen=daemon.address):
                    frames = [json.loads(line) for line in process.communicate()[0].splitlines()]
        self.assertEqual(process.returncode, 0)
        self.assertEqual((self.folder / "part.exr").read_bytes(), whole)
        self.assertEqual(sum(frame["kind"] == "frame" for frame in frames), 12)


class HostileFiles(PartsCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.daemon = cls.enterClassContext(Daemon())

    def setUp(self):
        super().setUp()
        self.one, self.two = self.parts(["cornell.glb", "--size", "32x24", "--samples", "1"], 2, "--server", self.daemon.address)
        self.bytes = self.two.read_bytes()
        self.good = self.merge([self.one, self.two], name="good.exr")

    def with_bytes(self, data):
        self.two.write_bytes(data)
        (self.folder / "merged.exr").unlink(missing_ok=True)
        result = farlight("merge", self.one, self.two, "-o", self.folder / "merged.exr")
        self.assertNotIn("the image writer failed", result.stderr)
        return result

    def refused(self, data, words=""):
        self.assertIn(words, self.expect(self.with_bytes(data), 1).stderr)
        self.assertFalse((self.folder / "merged.exr").exists())

    def test_a_part_that_is_cut_off_is_refused(self):
        size = len(self.bytes)
        for length in sorted({0, 3, 4, 8, 9, *range(50, size, size // 16), size - 1}):
            with self.subTest(length):
                self.refused(self.bytes[:length], f"{self.two}: is ")

    def test_a_part_of_an_impossible_size_is_refused(self):
        at = self.bytes.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
        for window in ((0, 0, 8191, 8191), (0, 0, 8192, 23), (0, 0, 0x7fffffff, 0x7fffffff), (-1, 0, 30, 23), (5, 5, 1, 1), (0, 0, 15, 23)):
            with self.subTest(window):
                self.refused(self.bytes[:at] + struct.pack("<4i", *window) + self.bytes[at + 16:])

    def test_a_part_that_lies_about_itself_is_refused(self):
        name = exr_attributes(self.two)["farlight/part"]
        digest = name.split()[1]
        for other in (b"0/2", b"3/2", b"2/0", b"a/2", b"2 2", b"1/2"):
            with self.subTest(other):
                self.refused(self.bytes.replace(name, other + name[3:]))
        self.refused(self.bytes.replace(digest, b"g" + digest[1:]), "does not say which picture it belongs to")
        self.refused(self.bytes.replace(digest, b"0" * 16), "another picture")
        rays = self.bytes.index(b"farlight/primary_rays\0string\0") + len(b"farlight/primary_rays\0string\0") + 4
        self.refused(self.bytes[:rays] + b"-" + self.bytes[rays + 1:], "farlight/primary_rays is no number of rays")

    def test_other_files_are_refused(self):
        for data, words in ((b"", "is no EXR file"), (b"\x89PNG\r\n\x1a\n" + bytes(100), "is no EXR file"), (os.urandom(5000), "is no EXR file")):
            self.refused(data, words)
        for path, words in ((self.folder, "is not a file"), (self.folder / "none.exr", "cannot be read")):
            self.assertIn(words, self.merge([self.one, path], status=1))

    def test_a_changed_byte_is_refused_or_does_not_matter(self):
        rng = random.Random(1)
        refused = 0
        for _ in range(60):
            data = bytearray(self.bytes)
            at = rng.randrange(len(data))
            data[at] ^= 1 << rng.randrange(8)
            result = self.with_bytes(data)
            if result.returncode == 0:
                self.assertEqual((self.folder / "merged.exr").read_bytes(), self.good, at)
            else:
                self.expect(result, 1)
                refused += 1
        self.assertGreater(refused, 40)


if __name__ == "__main__":
    unittest.main()
