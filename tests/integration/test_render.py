# SPDX-License-Identifier: MIT
"""What a person does with `farlight render`: files of all formats and what they say, mistakes, a daemon, and what is told."""
import contextlib
import fcntl
import json
import math
import os
import pathlib
import os
import pty
import re
import shutil
import signal
import socket
import struct
import subprocess
import tempfile
import termios
import time
import zlib

import farlight_test
from farlight_test import BIN, Case, Daemon, OneDaemon, Paced, bundled_scenes, farlight, read_png

SMALL = ["--size", "48x36", "--integrator", "whitted", "--samples", "1"]


def render_picture(name, output, *more):
    return farlight("render", bundled_scenes() / f"{name}.glb", "-o", output, *SMALL, *more)


class Outputs(OneDaemon):
    def test_every_format_is_written_and_the_same_request_makes_the_same_bytes(self):
        magics = {"png": b"\x89PNG", "jpg": b"\xff\xd8\xff", "exr": b"\x76\x2f\x31\x01", "hdr": b"#?RADIANCE", "webp": b"RIFF",
                  "tif": b"II*\0", "gif": b"GIF89a"}
        folders = [self.folder / "a", self.folder / "b"]
        for folder in folders:
            folder.mkdir()
            shutil.copy(bundled_scenes() / "cornell.glb", folder)
            for ending in (*magics, "full.png"):
                self.expect(farlight("render", folder / "cornell.glb", "-o", folder / f"p.{ending}", *SMALL,
                                     *(["--metadata", "full"] if ending == "full.png" else []),
                                     *(["--layers", "beauty,depth"] if ending == "exr" else [])), 0)
            time.sleep(1)  # dates in files have seconds
        for ending, magic in magics.items():
            one, other = ((folder / f"p.{ending}").read_bytes() for folder in folders)
            self.assertTrue(one.startswith(magic), ending)
            self.assertTrue(one == other, ending)
        self.assertTrue((folders[0] / "p.full.png").read_bytes() != (folders[1] / "p.full.png").read_bytes())
        self.assertEqual(len(self.leftovers()), 2 * (len(magics) + 2))

    def test_tiff_has_the_pixels_of_png_and_webp_its_alpha(self):
        def picture(ending):
            path = self.folder / f"picture.{ending}"
            self.expect(farlight("render", bundled_scenes() / "carousel.glb", "-o", path, *SMALL, "--background",
                                 "transparent"), 0)
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

    def test_exr_says_where_its_camera_and_its_pixels_are(self):
        """As OpenEXR defines it: z grows along the view, (0, 0) is the upper left corner of the whole picture."""
        path = self.folder / "picture.exr"
        place = ["--eye", "1,2,5", "--look-at", "1,2,1", "--fov", "40"]
        self.expect(farlight("render", bundled_scenes() / "cornell.glb", "-o", path, "--size", "40x30", "--samples", "1", "--crop", "10,4,8,6",
                             *place), 0)
        found = farlight_test.exr_attributes(path)
        self.assertEqual(struct.unpack("<4i", found["displayWindow"]), (0, 0, 39, 29))
        self.assertEqual(struct.unpack("<4i", found["dataWindow"]), (10, 4, 17, 9))
        up = 2 * math.tan(math.radians(20))
        self.assertAlmostEqual(struct.unpack("<f", found["screenWindowWidth"])[0], up * 40 / 30, 5)
        for name, point, wanted in (("worldToCamera", (1.5, 2.25, 3), (0.5, 0.25, 2, 1)), ("worldToNDC", (1, 2, 1), (0.5, 0.5)),
                                    ("worldToNDC", (1 - up / 2 * 4 / 3 * 4, 2 + up / 2 * 4, 1), (0, 0))):
            matrix = struct.unpack("<16f", found[name])
            mapped = [sum(of * matrix[4 * row + column] for row, of in enumerate((*point, 1))) for column in range(4)]
            for value, at in zip(mapped, wanted):
                self.assertAlmostEqual(value / (mapped[3] if name == "worldToNDC" else 1), at, 5)

    def test_standard_output_gets_the_picture_and_no_talk(self):
        for output in ("-", "/dev/stdout"):
            result = farlight("render", bundled_scenes() / "cornell.glb", "-o", output, "--format", "png", "--size", "32x24",
                              "--timings", text=False)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertTrue(result.stdout.startswith(b"\x89PNG"), result.stdout[:40])
            self.assertTrue(result.stdout.endswith(b"IEND\xaeB`\x82"), "text after the picture")

    def test_devices_are_written_to_and_stay(self):
        for device, status in (("/dev/null", 0), ("/dev/full", 1)):
            result = self.expect(farlight("render", bundled_scenes() / "cornell.glb", "-o", device, "--format", "png", "--size", "8x6"), status)
            self.assertEqual("/dev/full: cannot be written: No space left" in result.stderr, status == 1, result.stderr)
            self.assertTrue(pathlib.Path(device).is_char_device())

    def test_timings_as_json_name_every_stage(self):
        path = self.folder / "picture.png"
        result = self.expect(render_picture("cornell", path, "--timings=json"), 0)
        lines = [json.loads(line) for line in result.stdout.splitlines()]
        text = json.dumps(lines)
        for stage in ("apply", "build", "upload", "primary", "trace", "shade", "resolve", "readback", "encode", "queue",
                      "send"):
            self.assertIn(f'"{stage}"', text)


@farlight_test.long_test
class FirstPicture(Case):
    def test_what_other_processors_compile_is_not_compiled_again(self):
        """Software GL hands code over in the files of its cache: as many as where one processor compiles all."""
        files, pictures = [], []
        for name, processors in (("one", {min(os.sched_getaffinity(0))}), ("all", os.sched_getaffinity(0))):
            cache, picture = self.folder / name, self.folder / f"{name}.png"
            result = farlight("render", bundled_scenes() / "teapot.glb", "-o", picture, "--size", "80x60", "--integrator", "path",
                              "--denoise=off", "--studio", "off", env={**os.environ, "XDG_CACHE_HOME": str(cache)},
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
        """What is nearly an option or a subcommand is guessed; a value that looks like an option is none."""
        output = ("-o", self.folder / "x.png")
        cornell, nobody = bundled_scenes() / "cornell.glb", f"unix:{self.folder}/nobody.sock"
        before = self.folder.stat().st_mtime_ns
        for status, arguments, *says in (
                (1, ("render", self.folder / "missing.glb", *output), "missing.glb"),
                (2, ("render", cornell, *output, "--tracer", "magic"), "magic", "bvh"),
                (2, ("render", cornell, *output, "--size", "0x10"), "0x10"), (2, ("render", cornell, *output, "--size", "99999x99999"), "8192"),
                (2, ("render", cornell, *output, "--fov", "nan"), "nan"),
                (2, ("render", cornell, *output, "--eye", "1,inf,0", "--look-at", "0,0,0"), "inf"),
                (2, ("render", cornell), "-o"), (2, ("render",), "MODEL"), (2, ("render", cornell, *output, "--no-such-option")),
                (75, ("render", cornell, *output, "--server", nobody), "nobody.sock"),
                (2, ("render", cornell, *output, "--camera", "no such camera"), "no such camera"),
                (2, ("render", cornell, *output, "--stereo", "0.065", "--noise", "0.02"), "--noise", "--views rays"),
                (2, ("animate", cornell, "--frames", "1-4", "-o", self.folder / "%s.png"), "%"),
                (2, ("render", "--sise", "1x1"), "'--size'"), (2, ("render", "-q", "--tracr=bvh"), "'--tracer'"),
                (2, ("stats", "--wacth"), "'--watch'"), (2, ("rendr",), "'render'"), (2, ("help", "rendr"), "'render'"),
                (2, ("help", "nonsense"), "not a subcommand"), (2, ("render", cornell, "-qo", "--sise"), "no image format")):
            result = self.refused(status, *arguments, says=says)
            self.assertEqual("did you mean" in result.stderr, bool(says) and says[0].startswith("'"), result.stderr)
        self.assertEqual(self.folder.stat().st_mtime_ns, before, "a file with a name was there")

    def test_a_script_that_is_no_json_is_a_mistake_in_usage(self):
        script = self.folder / "script.json"
        cornell = bundled_scenes() / "cornell.glb"
        for text in ("nothing", "[1", ""):
            script.write_text(text)
            for command in (["animate", "--script", script], ["view", cornell, "--headless", "--replay", script],
                            ["animate", cornell, "--frames", "1-2", "--keys", script, "-o", self.folder / "%d.png"]):
                with self.subTest(text=text, command=command):
                    self.assertIn("script.json", self.expect(farlight(*command), 2).stderr)

    def test_a_missing_folder_is_made_if_that_is_wanted_when_there_is_something_to_write(self):
        cornell, folder = bundled_scenes() / "cornell.glb", self.folder / "made" / "for" / "it"
        for command, name in ((["render"], "x.png"), (["animate", "--frames", "1-2"], "%d.png"), (["animate", "--frames", "1-2"], "x.mp4"),
                              (["thumbnail"], "x.png")):
            self.refused(1, *command, cornell, "-o", folder / name, says=[f"{folder / name}: there is no folder '{folder}'", "--parents"])
        self.expect(farlight("animate", cornell, "--frames", "1-2", "-o", folder / "%d.png", "--dry-run", "--parents"), 0)
        self.refused(1, "render", self.folder / "missing.glb", "-o", folder / "x.png", "--parents", says=["missing.glb"])
        self.assertEqual(list(self.folder.iterdir()), [])
        self.expect(farlight("render", cornell, "--size", "8x8", "-o", folder / "x.png", "--parents"), 0)
        self.assertEqual(self.leftovers(), ["made/for/it/x.png"])

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

    def test_a_model_that_is_no_model_is_refused_by_name(self):
        path = self.folder / "rubbish.glb"
        path.write_bytes(b"glTF\x02\0\0\0" + bytes(range(256)) * 3)
        result = farlight("render", path, "-o", self.folder / "x.png")
        self.expect(result, 1)
        self.assertIn("rubbish.glb", result.stderr)
        self.assertEqual(self.leftovers(), ["rubbish.glb"])

    def test_a_full_disk_is_reported_and_leaves_no_half_file(self):
        result = subprocess.run(["sh", "-c", 'ulimit -f 2; exec "$0" "$@"', BIN / "farlight", "render",
                                 bundled_scenes() / "cornell.glb", "-o", self.folder / "x.exr", "--float", "--size",
                                 "96x64", "--samples", "1"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False,
                                timeout=farlight_test.TIMEOUT_S)
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertIn("x.exr", result.stderr)
        self.assertEqual(self.leftovers(), [])

    def test_no_space_may_be_there_later(self):
        """On a disk of 4 KB; the status asks a queue for another try."""
        full = self.folder / "full"
        full.mkdir()
        alone = ["unshare", "--map-root-user", "--mount", "sh", "-c", 'mount -t tmpfs -o size=4k none "$0" && exec "$@"', full]
        if subprocess.run([*alone, "true"], check=False, capture_output=True).returncode != 0:
            self.skipTest("no file system can be mounted here")
        for name in ("x.png", "x.exr", "x.tiff", "%d.png", "x.mp4", "x.y4m"):
            what = ["render", "--size", "96x80"] if name.startswith("x.") and name[2:] in ("png", "exr", "tiff") else \
                ["animate", "--frames", "1-9", "--orbit", "--size", "240x160", "--integrator", "distributed"]
            with self.subTest(name):
                result = subprocess.run([*alone, BIN / "farlight", *what, bundled_scenes() / "teapot.glb", "-o", full / name],
                                        check=False, capture_output=True, text=True, timeout=farlight_test.TIMEOUT_S)
                self.assertEqual(result.returncode, 75, result.stderr)
                self.assertIn("No space left", result.stderr)
                self.assertNotIn("trying again", result.stderr)

    def test_an_interrupt_ends_an_animation_cleanly(self):
        with Paced(self.folder, "%04d.png", bundled_scenes() / "teapot.glb", "--frames", "1-24", "--size", "320x240") as client:
            client.until("frame 1:")
            client.process.send_signal(signal.SIGINT)
            self.assertEqual(client.finish(), (130, client.errors))
        self.assertIn(str(client.folder / "0001.png"), map(str, client.folder.iterdir()))
        for name in self.leftovers():
            read_png(self.folder / name)  # complete, or it would not be here

    def test_a_hang_up_that_is_ignored_ends_nothing(self):
        """As nohup starts a program."""
        with Paced(self.folder, "%04d.png", bundled_scenes() / "teapot.glb", "--frames", "1-8", "--size", "96x72",
                   preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN)) as client:
            client.until("frame 1:")
            pid = client.process.pid
            for process in (pid, *pathlib.Path(f"/proc/{pid}/task/{pid}/children").read_text().split()):
                os.kill(int(process), signal.SIGHUP)
            self.assertEqual(client.finish(), (0, client.errors))
        self.assertEqual(len(self.leftovers()), 8)

    def test_programs_go_on_without_standard_descriptors(self):
        for closed in ("<&- >&- 2>&-", "<&- 2>&-", ">&-"):
            for name in ("a.%d.png", "a.gif"):
                result = subprocess.run(["sh", "-c", f'exec "$0" "$@" {closed}', BIN / "farlight", "animate",
                                         bundled_scenes() / "teapot.glb", "--frames", "1-2", "--size", "32x24", "-o",
                                         self.folder / name], check=False, timeout=farlight_test.TIMEOUT_S,
                                        stderr=subprocess.DEVNULL)
                self.assertEqual(result.returncode, 0, (closed, name))
            self.assertEqual(self.leftovers(), ["a.1.png", "a.2.png", "a.gif"])
            for file in self.folder.iterdir():
                file.unlink()


class NoDaemon(Case):
    """The daemon is not there, or answers with something else."""

    def program(self, name, text):
        """Puts a script into a folder; returns the folder."""
        folder = self.folder / "programs"
        folder.mkdir(exist_ok=True)
        (folder / name).write_text("#!/bin/sh\n" + text)
        (folder / name).chmod(0o755)
        return folder

    def ping(self, *arguments, status=75, **variables):
        begin = time.monotonic()
        result = self.expect(farlight("ping", "--count", "1", *arguments, env=farlight_test.private_daemon(**variables)), status)
        return result.stderr, time.monotonic() - begin

    def test_a_private_daemon_that_does_not_start_says_its_whole_reason(self):
        folder = self.program("farlightd", "echo log >&2\necho 'farlightd: device: no OpenGL\nfarlightd: install one' >&2\nexit 1\n")
        said, _ = self.ping(status=1, FARLIGHT_LIBEXEC=str(folder))
        self.assertIn("the daemon did not start: farlightd ended with status 1: device: no OpenGL; install one\n", said)

    def test_an_ssh_that_refuses_is_tried_once_unless_more_is_wanted(self):
        folder = self.program("ssh", f"echo >>{self.folder}/logins\necho 'Permission denied (publickey).' >&2\nexit 255\n")
        environment = farlight_test.private_daemon(PATH=f"{folder}:{os.environ['PATH']}")
        for more, logins in (((), 1), (("--retry-for", "10m", "--retries", "1"), 3)):
            result = self.expect(farlight("render", bundled_scenes() / "teapot.glb", "-o", self.folder / "x.png", "--server", "ssh:host",
                                          *more, env=environment), 75)
            self.assertIn("Permission denied", result.stderr)
            self.assertEqual(len((self.folder / "logins").read_text().splitlines()), logins)

    def test_a_login_script_that_prints_is_named(self):
        folder = self.program("ssh", "echo 'Welcome to \033[1mfarm07'\nsleep 1\n")
        said, _ = self.ping("--server", "ssh:host", status=1, PATH=f"{folder}:{os.environ['PATH']}")
        self.assertIn("Welcome to", said)
        self.assertIn(".bashrc", said)
        self.assertNotIn("\033", said)

    def test_a_daemon_that_comes_late_is_waited_for(self):
        folder = pathlib.Path(tempfile.mkdtemp(dir=self.folder))
        address = f"unix:{folder}/late"
        self.ping("--server", address)
        with subprocess.Popen([BIN / "farlight", "ping", "--count", "1", "--server", address, "--retry-for", "10m"],
                              stdout=subprocess.DEVNULL) as waiting, Daemon(listen=address):
            self.assertEqual(waiting.wait(farlight_test.TIMEOUT_S), 0)

    def test_a_server_that_is_silent_takes_no_longer_than_it_is_to_be_tried(self):
        with contextlib.closing(socket.create_server(("127.0.0.1", 0))) as silent:
            said, seconds = self.ping("--server", f"tcp:127.0.0.1:{silent.getsockname()[1]}", "--retry-for", "1")
        self.assertIn("does not answer the handshake", said)
        self.assertLess(seconds, 25)  # the usual time is 30 s, and a second of it is wanted


class ThroughADaemon(Case):
    def test_the_second_upload_moves_no_bulk_data_and_stats_name_the_device(self):
        with Daemon() as daemon:
            uploaded, pictures = [], []
            for number in range(2):
                path = self.folder / f"{number}.png"
                result = self.expect(render_picture("cornell", path, "--server", daemon.address, "--timings=json"), 0)
                uploaded += [one["uploaded_bytes"] for one in map(json.loads, result.stdout.splitlines()) if one["kind"] == "client"]
                pictures.append(read_png(path)[2])
            record = json.loads(self.expect(farlight("stats", "--server", daemon.address, "--json"), 0).stdout)
        self.assertEqual([size > 0 for size in uploaded], [True, False])
        self.assertEqual(pictures[0], pictures[1])
        self.assertTrue(record["device"])
        self.assertEqual(record["frames"], 2)

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

    def test_names_that_a_terminal_would_obey_are_shown_harmless_and_complete_in_json(self):
        name = "a\u009b2J\u202egpj.exe\u2066\u00e4"
        with tempfile.TemporaryDirectory(prefix="farlight-test-") as folder:
            path = os.path.join(folder, "names.gltf")
            with open(path, "w", encoding="utf-8") as file:
                json.dump({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
                           "nodes": [{"camera": 0, "name": name}, {"extensions": {"KHR_lights_punctual": {"light": 0}}}],
                           "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point"}]}},
                           "cameras": [{"type": "perspective", "name": name, "perspective": {"yfov": 1, "znear": 1}}]}, file)
            table = self.expect(farlight("info", path), 0).stdout
            line = self.expect(farlight("info", path, "--json"), 0).stdout
        for word in ("triangles", "materials", "lights", "cameras", "a?2J?gpj.exe?\u00e4"):
            self.assertIn(word, table)
        self.assertTrue(line.isascii())
        self.assertIn(name, [camera["name"] for camera in json.loads(line)["cameras"]])


if __name__ == "__main__":
    farlight_test.unittest.main()
