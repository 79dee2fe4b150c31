# SPDX-License-Identifier: MIT
"""Animations: in parts and resumed, through lost daemons, from request files, as videos; progressive pictures.

Frames are compared by their digest, which the daemon computes of the pixels and the client checks: frames with the same
digest are the same to the bit.
"""
import base64
import contextlib
import json
import os
import pathlib
import pty
import select
import signal
import socket
import struct
import subprocess
import tempfile
import threading
import time

import farlight_test
from farlight_test import BIN, Case, Daemon, OneDaemon, Paced, bundled_scenes, farlight, long_test

SIZE = ["--size", "48x32"]


def digest(path):
    return farlight_test.exr_attributes(path)["farlight/digest"]


def children(pid, name):
    """Process numbers of the children of `pid` that run the program `name`."""
    found = []
    with contextlib.suppress(FileNotFoundError, ProcessLookupError):
        for child in pathlib.Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):
                if pathlib.Path(f"/proc/{child}/comm").read_text().strip() == name:
                    found.append(int(child))
    return found


class Cut:
    """A relay to a daemon's socket whose first connection ends after so many bytes of the daemon's, as if it was killed."""

    def __init__(self, path, count):
        self.path, self.count = path, count

    def __enter__(self):
        self.folder = tempfile.TemporaryDirectory(prefix="farlight-cut-")
        self.address = f"unix:{self.folder.name}/socket"
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(self.address.removeprefix("unix:"))
        self.listener.listen()
        self.thread = threading.Thread(target=self.serve, daemon=True)
        self.thread.start()
        return self

    def serve(self):
        left = self.count
        while True:
            try:
                client = self.listener.accept()[0]
            except OSError:
                return
            with contextlib.suppress(OSError), client, socket.socket(socket.AF_UNIX) as daemon:
                daemon.connect(str(self.path))
                self.relay(client, daemon, left)
            left = None

    @staticmethod
    def relay(client, daemon, left):
        while left is None or left > 0:
            for one in select.select([client, daemon], [], [])[0]:
                data = one.recv(65536 if left is None else min(left, 65536))
                if not data:
                    return
                if one is daemon and left is not None:
                    left -= len(data)
                (daemon if one is client else client).sendall(data)

    def __exit__(self, *_):
        self.listener.shutdown(socket.SHUT_RDWR)
        self.listener.close()
        self.thread.join()
        self.folder.cleanup()


def moving_model(path):
    """A glTF file with a pyramid that slides, spins, and (`pulse`) grows along a cubic spline; the ground sinks."""
    chunks, views, accessors = [], [], []

    def add(values, kind, component=5126):
        data = struct.pack(f"<{len(values)}{'f' if component == 5126 else 'H'}", *values)
        views.append({"buffer": 0, "byteOffset": sum(map(len, chunks)), "byteLength": len(data)})
        chunks.append(data + bytes(-len(data) % 4))
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[kind]
        parts = [values[i::width] for i in range(width)]
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": len(values) // width,
                          "type": kind, "min": [min(p) for p in parts], "max": [max(p) for p in parts]})
        return len(accessors) - 1

    corners = [-1, 0, -1, 1, 0, -1, 1, 0, 1, -1, 0, 1, 0.3, 2, 0.2]  # the apex stands askew: no turn is like another
    position = add(corners, "VEC3")
    index = add([0, 1, 2, 0, 2, 3, 0, 4, 1, 1, 4, 2, 2, 4, 3, 3, 4, 0], "SCALAR", 5123)
    half = 0.5 ** 0.5
    clips = {
        "slide": (0, "translation", "LINEAR", [0, 1], [-1, 0, 0, 1, 0, 0], "VEC3"),
        "spin": (0, "rotation", "LINEAR", [0, 0.5, 1], [0, 0, 0, 1, 0, half, 0, half, 0, 1, 0, 0], "VEC4"),
        "pulse": (0, "scale", "CUBICSPLINE", [0, 1], [0, 0, 0, 1, 1, 1, 1, 2, 1, 0, 0, 0, 2, 1, 2, 0, 0, 0], "VEC3"),
        "sink": (1, "translation", "LINEAR", [0, 1], [0, -2.2, -1, 0, -3, -1], "VEC3"),
    }
    animations = []
    for name, (node, target, interpolation, times, values, kind) in clips.items():
        sampler = {"input": add(times, "SCALAR"), "output": add(values, kind), "interpolation": interpolation}
        animations.append({"name": name, "samplers": [sampler],
                           "channels": [{"sampler": 0, "target": {"node": node, "path": target}}]})
    data = b"".join(chunks)
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2]}],
        "nodes": [{"name": "pyramid", "mesh": 0}, {"name": "ground", "mesh": 0, "translation": [0, -2.2, -1],
                                                   "scale": [4, 1, 4]},
                  {"name": "light", "extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [2, 5, 4]}],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "name": "bulb", "intensity": 400}]}},
        "meshes": [{"primitives": [{"attributes": {"POSITION": position}, "indices": index, "material": 0}]}],
        "materials": [{"name": "clay", "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.4, 0.2, 1],
                                                               "metallicFactor": 0}}],
        "animations": animations, "accessors": accessors, "bufferViews": views,
        "buffers": [{"byteLength": len(data), "uri": "data:application/octet-stream;base64," +
                     base64.b64encode(data).decode()}]}
    path.write_text(json.dumps(document))
    return path


class Animations(Case):
    def setUp(self):
        super().setUp()
        self.model = bundled_scenes() / "sphereflake-2.nff"

    def animate(self, folder, *arguments, status=0, **options):
        """Runs it into a folder of its own and returns the digests by frame, and what it said."""
        path = self.folder / folder
        path.mkdir(exist_ok=True)
        result = self.expect(farlight("animate", *arguments, "-o", path / "%04d.exr", *SIZE, **options), status)
        return self.digests(folder), result

    def digests(self, folder):
        return {int(file.stem): digest(file) for file in sorted((self.folder / folder).glob("*.exr"))}

    def write(self, document, name="shot.json"):
        path = self.folder / name
        path.write_text(json.dumps(document))
        return path


class Parts(OneDaemon, Animations):
    RANGE = ["--frames", "10-31:3"]  # 10 13 16 19 22 25 28 31

    def test_parts_together_equal_the_whole_to_the_bit(self):
        whole, _ = self.animate("whole", self.model, *self.RANGE)
        self.assertEqual(list(whole), list(range(10, 32, 3)))
        self.assertEqual(len(set(whole.values())), 8, "frames of an orbit differ")
        for part, frames in ((1, [10, 19, 28]), (2, [13, 22, 31]), (3, [16, 25])):
            got, _ = self.animate(f"part{part}", self.model, *self.RANGE, "--shard", f"{part}/3")
            self.assertEqual(got, {frame: whole[frame] for frame in frames})
        got, _ = self.animate("chunk", self.model, *self.RANGE, "--chunk", "2/3")
        self.assertEqual(got, {frame: whole[frame] for frame in (16, 19, 22)})
        got, result = self.animate("part9", self.model, *self.RANGE, "--shard", "9/9")
        self.assertEqual(got, {})
        self.assertIn("part 9 has none", result.stderr)

    def test_resuming_makes_what_is_missing_and_leaves_the_rest_alone(self):
        """Also of a part. With all frames present no daemon is asked."""
        whole, _ = self.animate("whole", self.model, *self.RANGE)
        folder = self.folder / "whole"
        (folder / "0010.exr").unlink()
        (folder / "0013.exr").unlink()
        data = (folder / "0019.exr").read_bytes()
        (folder / "0019.exr").write_bytes(data[:-1])  # as a full disk leaves copies
        self.expect(farlight("animate", self.model, "--frames", "31", "--size", "40x32", "-o", folder / "%04d.exr"), 0)
        kept = {frame: (folder / f"{frame:04d}.exr").stat() for frame in (16, 22, 25, 28)}
        again, result = self.animate("whole", self.model, *self.RANGE, "--resume")
        self.assertEqual(again, whole)
        self.assertIn("4 of 8 frames exist already", result.stderr)
        for frame, before in kept.items():
            after = (folder / f"{frame:04d}.exr").stat()
            self.assertEqual((after.st_ino, after.st_mtime_ns), (before.st_ino, before.st_mtime_ns))
        again, _ = self.animate("whole", self.model, *self.RANGE, "--resume", "--server", "unix:/nonexistent")
        self.assertEqual(again, whole, "with all frames present no daemon is asked")
        for frame in (10, 22):
            (folder / f"{frame:04d}.exr").unlink()
        again, _ = self.animate("whole", self.model, *self.RANGE, "--resume", "--shard", "2/3")
        self.assertEqual(again, {frame: of for frame, of in whole.items() if frame != 10}, "only what the part has is made")

    def test_files_of_all_formats_are_known(self):
        """That of a frame alone lets no daemon be asked for it."""
        for ending in ("png", "jpg", "hdr", "webp", "tiff", "gif"):
            with self.subTest(ending):
                arguments = "animate", self.model, "--frames", "1-1", *SIZE, "-o", self.folder / f"%d.{ending}"
                self.expect(farlight(*arguments), 0)
                self.expect(farlight(*arguments, "--resume", "--server", "unix:/nonexistent"), 0)


class Lost(Animations):
    """The daemon goes away in the middle."""

    FRAMES = ["--frames", "1-24"]
    reference = {}  # digests of the frames, made once

    def whole(self):
        if not self.reference:
            self.reference.update(self.animate("whole", self.model, *self.FRAMES)[0])
        return self.reference

    def start(self, folder, *arguments, name="%04d.exr"):
        return self.enterContext(Paced(self.folder / folder, name, self.model, *self.FRAMES, *SIZE, *arguments))

    def finish(self, client, status):
        self.assertEqual(client.finish(), (status, client.errors))
        return client.errors

    def test_a_killed_private_daemon_is_started_again_and_nothing_is_lost(self):
        client = self.start("killed")
        for frame in (3, 9):
            client.until(f"frame {frame}:")
            daemon, = children(client.process.pid, "farlightd")
            os.kill(daemon, signal.SIGKILL)
            client.until("trying again")
        errors = self.finish(client, 0)
        self.assertEqual(self.digests(client.folder), self.whole())
        self.assertEqual(errors.count("trying again"), 2, errors)
        self.assertEqual([p.name for p in client.folder.iterdir() if p.suffix != ".exr"], [])

    def test_a_daemon_that_is_killed_or_shuts_down_is_sought_again_until_it_is_back(self):
        for how in (signal.SIGKILL, signal.SIGTERM):
            with self.subTest(how=how), Daemon() as daemon:
                client = self.start(how.name, "--server", daemon.address)
                client.until("frame 4:")
                daemon.stop(how)
                with contextlib.suppress(FileNotFoundError):
                    os.unlink(daemon.path)
                for _ in range(2):  # the first attempt finds no daemon
                    client.until("trying again")
                with Daemon(listen=daemon.address):
                    self.finish(client, 0)
                self.assertEqual(self.digests(client.folder), self.whole())

    def test_a_daemon_that_falls_silent_is_given_up_after_both_times(self):
        with Daemon() as daemon:
            client = self.start("silent", "--server", daemon.address, "--lost-after", "3", "--retry-for", "1")
            client.until("frame 2:")
            daemon.signal_all(signal.SIGSTOP)
            try:
                errors = self.finish(client, 75)
            finally:
                daemon.signal_all(signal.SIGCONT)
            self.assertIn("counts as lost: it answered nothing, no ping either, for 3 s", errors)
            self.assertIn("given up after", errors)
            made = self.digests(client.folder)
            self.assertEqual(made, {frame: self.whole()[frame] for frame in made})

    def test_a_time_that_is_too_short_for_pings_is_refused(self):
        for command in (["ping"], ["animate", self.model, "--frames", "1-2", "-o", "%d.png"]):
            result = self.expect(farlight(*command, "--lost-after", "2.9"), 2)
            self.assertRegex(result.stderr, "--lost-after: .*at least 3 seconds")

    def test_a_daemon_that_was_silent_goes_on_in_time_or_is_found_again(self):
        """Within one connection, after a ping that waited; and within a second one."""
        often = {**os.environ, "FARLIGHT_NETWORK_IDLE": "12000"}  # a client pings thrice in this time, however late it calls one lost
        for name, lost_after, is_lost in (("time", "10m", False), ("again", "3", True)):
            with self.subTest(lost_after=lost_after), Daemon(environment=often) as daemon:
                client = self.start(name, "--server", daemon.address, "--lost-after", lost_after, "--retry-for", "10m")
                client.until("frame 2:")
                daemon.signal_all(signal.SIGSTOP)
                try:
                    if is_lost:
                        client.until("trying again")
                    else:
                        client.drain(5)
                finally:
                    daemon.signal_all(signal.SIGCONT)
                errors = self.finish(client, 0)
                self.assertEqual(self.digests(client.folder), self.whole())
                if not is_lost:
                    self.assertNotIn("trying again", errors)

    def test_a_private_daemon_that_falls_silent_is_started_again(self):
        client = self.start("hangs", "--lost-after", "3")
        client.until("frame 2:")
        os.kill(children(client.process.pid, "farlightd")[0], signal.SIGSTOP)
        errors = self.finish(client, 0)
        self.assertIn("counts as lost", errors)
        self.assertEqual(self.digests(client.folder), self.whole())

    def test_attempts_end_after_the_number_or_the_time_that_was_given(self):
        """With complete files only."""
        for name, options, tries in (("none", ["--retry-for", "0"], 0), ("two", ["--retries", "2"], 2), ("time", ["--retry-for", "1.5s"], None)):
            with self.subTest(options=options), Daemon() as daemon:
                client = self.start(name, "--server", daemon.address, *options)
                client.until("frame 2:")
                begin = time.monotonic()
                daemon.stop(signal.SIGKILL)
                errors = self.finish(client, 75)
                if tries is None:
                    self.assertGreater(time.monotonic() - begin, 1.5)
                    self.assertIn("given up after", errors)
                else:
                    self.assertEqual(errors.count("trying again"), tries, errors)
                made = self.digests(client.folder)
                self.assertLessEqual(len(made), 2 + Paced.AHEAD)
                self.assertEqual(made, {frame: self.whole()[frame] for frame in made})

    def test_a_daemon_that_never_was_is_not_waited_for(self):
        _, result = self.animate("none", self.model, "--frames", "1-2", "--server", "unix:/nonexistent/socket",
                                 status=75)
        self.assertNotIn("trying again", result.stderr)
        self.assertIn("farlightd --listen", result.stderr)

    def test_a_daemon_that_is_not_there_yet_is_waited_for_if_that_is_asked_for(self):
        address = f"unix:{self.folder}/later.sock"
        child = subprocess.Popen([BIN / "farlight", "render", self.model, *SIZE, "-o", self.folder / "one.exr", "--server",
                                  address, "--retry-for", "10m"], stderr=subprocess.PIPE, text=True)
        self.addCleanup(child.stderr.close)
        self.assertIn("No such file", child.stderr.readline())
        with Daemon(listen=address):
            errors = child.stderr.read()
            self.assertEqual(child.wait(farlight_test.TIMEOUT_S), 0, errors)

    def test_a_private_daemon_that_is_killed_while_the_scene_is_loading_is_started_again(self):
        client = self.start("loading")
        while not (daemons := children(client.process.pid, "farlightd")):
            self.assertIsNone(client.process.poll())
        os.kill(daemons[0], signal.SIGKILL)
        errors = self.finish(client, 0)
        self.assertEqual(errors.count("trying again"), 1, errors)

    @long_test
    def test_a_daemon_that_is_lost_while_the_scene_is_loading_is_sought_again(self):
        """It hangs up at each step of the beginning: before the handshake, after the scene was opened, and so on."""
        with Daemon() as daemon:
            for cut in (0, 100, 3000):
                with self.subTest(cut=cut), Cut(daemon.path, cut) as proxy:
                    result = self.expect(farlight("render", self.model, *SIZE, "-o", self.folder / "one.exr", "--server",
                                                  proxy.address), 0)
                    self.assertIn("trying again", result.stderr)

    def test_commands_without_retries_end_with_75_if_the_daemon_hangs_up(self):
        with Daemon() as daemon:
            for command in (["stats"], ["ping"], ["scenes"]):
                with self.subTest(command=command), Cut(daemon.path, 10) as proxy:
                    self.expect(farlight(*command, "--server", proxy.address), 75)

    def test_what_would_fail_again_ends_with_1_and_is_not_tried_again(self):
        """As there is no socket within a file, or the private daemon cannot start."""
        for more, environment in ((["--retry-for", "1m", "--server", f"unix:{self.model}/socket"], None),
                                  ([], farlight_test.private_daemon(FARLIGHT_LIMITS_SAMPLES="none"))):
            result = self.expect(farlight("render", self.model, *SIZE, "-o", self.folder / "one.exr", *more, env=environment), 1)
            self.assertNotIn("trying again", result.stderr)

    def test_an_interrupt_while_waiting_ends_it(self):
        with Daemon() as daemon:
            client = self.start("interrupted", "--server", daemon.address, "--retries", "100")
            client.until("frame 2:")
            daemon.stop(signal.SIGKILL)
            client.until("trying again")
            client.process.send_signal(signal.SIGINT)
            self.finish(client, 130)
        for path in client.folder.iterdir():
            self.assertEqual(path.suffix, ".exr", "an unfinished file was left")
            digest(path)

    def test_a_video_continues_after_a_killed_daemon(self):
        whole = self.folder / "whole.mkv"
        self.expect(farlight("animate", self.model, *self.FRAMES, *SIZE, "--lossless", "-o", whole), 0)
        client = self.start("movie", "--lossless", name="movie.mkv")
        client.until("frame 1:")
        os.kill(children(client.process.pid, "farlightd")[0], signal.SIGKILL)
        self.assertIn("trying again", self.finish(client, 0))
        hashes = [subprocess.run(["ffmpeg", "-v", "error", "-i", file, "-f", "framemd5", "-"], check=True,
                                 stdout=subprocess.PIPE).stdout for file in (whole, client.folder / "movie.mkv")]
        self.assertEqual(hashes[0].count(b"\n0,"), 24)
        self.assertEqual(hashes[0], hashes[1])


class Videos(OneDaemon, Animations):
    def test_one_script_writes_a_video_and_images(self):
        (self.folder / "f").mkdir()
        script = self.write({"model": str(self.model), "frames": "1-5", "size": [48, 32], "camera": {"orbit": True},
                             "outputs": ["f/%d.png", "movie.mp4", "raw.y4m"]})
        self.expect(farlight("animate", "--script", script), 0)
        self.assertEqual(self.leftovers(), [*(f"f/{n}.png" for n in range(1, 6)), "movie.mp4", "raw.y4m", "shot.json"])
        raw = (self.folder / "raw.y4m").read_bytes()
        self.assertTrue(raw.startswith(b"YUV4MPEG2 W48 H32 F24:1"), raw[:60])
        self.assertEqual(raw.count(b"FRAME\n"), 5)
        got = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-show_entries", "stream=nb_read_frames",
                              "-of", "csv=p=0", self.folder / "movie.mp4"], check=True, stdout=subprocess.PIPE, text=True)
        self.assertEqual(got.stdout.strip(), "5")

    def test_standard_output_gets_raw_video_and_no_talk(self):
        result = farlight("animate", self.model, "--frames", "1-3", "--fps", "25", *SIZE, "-o", "-", "--timings",
                          text=False)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertTrue(result.stdout.startswith(b"YUV4MPEG2 W48 H32 F25:1"), result.stdout[:60])
        header = result.stdout.index(b"\n") + 1
        self.assertEqual(len(result.stdout) - header, 3 * (len(b"FRAME\n") + 48 * 32 * 3 // 2))

    def test_a_terminal_gets_no_video(self):
        ours, theirs = pty.openpty()
        try:
            result = subprocess.run([BIN / "farlight", "animate", self.model, "--frames", "1-3", "-o", "-"],
                                    stdout=theirs, stderr=subprocess.PIPE, text=True, check=False,
                                    timeout=farlight_test.TIMEOUT_S)
        finally:
            os.close(ours)
            os.close(theirs)
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("terminal", result.stderr)

    def test_a_closed_standard_output_is_reported(self):
        child = subprocess.Popen([BIN / "farlight", "animate", self.model, "--frames", "1-500", *SIZE, "-q", "-o", "-"],
                                 stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        child.stdout.read(1000)
        child.stdout.close()
        errors = child.stderr.read().decode()
        child.stderr.close()
        self.assertEqual(child.wait(farlight_test.TIMEOUT_S), 1, errors)
        self.assertNotIn("trying again", errors)

    def test_what_makes_no_video_is_refused_before_anything_is_rendered(self):
        for arguments, said in ((["-o", "m.mp4", "--resume"], "--resume"), (["-o", "m.mp4", "--shard", "1/2"], "--shard"),
                                (["-o", "m.mp4", "--chunk", "1/2"], "--chunk"), (["-o", "%d.png", "--chunk", "1/2", "--shard", "1/2"], "--shard"),
                                (["-o", "-", "--format", "png"], "standard output"), (["-o", "m.webm"], "m.webm"),
                                (["-o", "m.mp4", "--lossless"], ".mkv"), (["-o", "m.mp4", "--quality", "60"], "51"),
                                (["-o", "m.gif", "--resume"], "--resume"), (["-o", "m.webp", "--shard", "1/2"], "--shard"),
                                (["-o", "m.gif", "--lossless"], ".webp"), (["-o", "m.webp", "--quality", "101"], "100")):
            with self.subTest(arguments=arguments):
                result = self.expect(farlight("animate", self.model, "--frames", "1-2", *arguments,
                                              cwd=self.folder), 2)
                self.assertIn(said, result.stderr)
        result = self.expect(farlight("render", self.model, "-o", self.folder / "m.mp4"), 2)
        self.assertIn("animate", result.stderr)
        self.assertEqual(self.leftovers(), [])

    def test_an_interrupted_video_leaves_nothing(self):
        for name in ("movie.mp4", "movie.gif"):
            with self.subTest(name=name):
                with Paced(self.folder, name, self.model, "--frames", "1-24", *SIZE, "--fps", "25") as client:
                    client.until("frame 1:")
                    client.process.send_signal(signal.SIGINT)
                    self.assertEqual(client.finish(), (130, client.errors))
                self.assertEqual(self.leftovers(), [])


class MovingPictures(OneDaemon, Animations):
    """GIF and WebP whose names have no place for a number, beside the PNG files of the same frames."""
    COUNT = 6

    def pictures(self, **more):
        """Renders into PNG files and what else is wanted; returns what it said, and their pixels, RGBA."""
        script = self.write({"model": str(self.model), "frames": f"1-{self.COUNT}", "size": [48, 32], "samples": 1,
                             "camera": {"orbit": True}, "outputs": ["%d.png", "around.gif"], **more})
        result = self.expect(farlight("animate", "--script", script), 0)
        return result, [self.decode(self.folder / f"{n}.png") for n in range(1, self.COUNT + 1)]

    def decode(self, source, data=None):
        """All pictures of a file that ffmpeg reads, RGBA, one after the other."""
        return subprocess.run(["ffmpeg", "-v", "error", "-i", source, "-vsync", "passthrough", "-f", "rawvideo", "-pix_fmt", "rgba", "-"],
                              input=data, check=True, stdout=subprocess.PIPE).stdout

    def test_a_gif_has_every_frame_near_to_its_colours_and_is_shown_for_ever(self):
        result, pictures = self.pictures(background="#ffffff")
        self.assertIn("24 frames per second become 25", result.stderr)
        path = self.folder / "around.gif"
        self.assertIn(b"NETSCAPE2.0\x03\x01\0\0\0", path.read_bytes())  # 0 times: without end
        said = subprocess.run(["ffprobe", "-v", "error", "-show_entries", "packet=duration_time", "-of", "csv=p=0", path],
                              check=True, stdout=subprocess.PIPE, text=True).stdout.split()
        self.assertEqual([float(duration.strip(",")) for duration in said], [0.04] * self.COUNT)
        # The dither adds 2 at most, and 255 colours are most of those that this model has.
        shown = self.decode(path)
        self.assertEqual(len(shown), sum(map(len, pictures)))
        for frame, wanted in enumerate(pictures):
            got = shown[frame * len(wanted):(frame + 1) * len(wanted)]
            self.assertLess(sum(abs(a - b) for a, b in zip(got, wanted)) / len(wanted), 1, f"frame {frame}")

    def chunks(self, data):
        """The parts of a RIFF file: names and contents."""
        while data:
            size = int.from_bytes(data[4:8], "little")
            yield data[:4], data[8:8 + size]
            data = data[8 + size + size % 2:]

    def show(self, canvas, data):
        """Draws a frame of a WebP file (RFC 9649, section 2.7.1.1); returns its milliseconds."""
        x, y, width, height, milliseconds = (int.from_bytes(data[at:at + 3], "little") for at in range(0, 15, 3))
        kind = b"VP8X" + struct.pack("<I4B", 10, 0x10, 0, 0, 0) + data[6:12]  # a file of its own, with alpha
        pixels = self.decode("-", b"RIFF" + struct.pack("<I", 4 + len(kind) + len(data) - 16) + b"WEBP" + kind + data[16:])
        is_blended = data[15] & 2 == 0
        for row in range(height + 1):
            for column in range(width + 1):
                pixel = pixels[4 * (row * (width + 1) + column):][:4]
                if pixel[3] > 0 or not is_blended:
                    canvas[2 * y + row, 2 * x + column] = pixel
        return milliseconds, data[15] & 1 and [(2 * y + row, 2 * x + column) for row in range(height + 1) for column in range(width + 1)]

    @long_test
    def test_a_lossless_webp_has_every_pixel_and_its_alpha(self):
        _, pictures = self.pictures(model=str(bundled_scenes() / "carousel.glb"), outputs=["%d.png", "around.webp"], lossless=True,
                                    background="transparent")
        self.assertLess(min(pictures[0][3::4]), 255)
        chunks = list(self.chunks((self.folder / "around.webp").read_bytes()[12:]))
        self.assertEqual([data[4:6] for name, data in chunks if name == b"ANIM"], [b"\0\0"])  # without end
        frames = [data for name, data in chunks if name == b"ANMF"]
        self.assertEqual(len(frames), self.COUNT)
        canvas, times, clear = {}, [], b"\0\0\0\0"
        for number, (frame, wanted) in enumerate(zip(frames, pictures)):
            milliseconds, disposed = self.show(canvas, frame)
            times.append(milliseconds)
            for at in range(48 * 32):
                got, right = canvas.get((at // 48, at % 48), clear), wanted[4 * at:4 * at + 4]
                if got != right and (got[3] or right[3]):
                    self.fail(f"frame {number}, pixel {at}: {got} in place of {right}")
            for place in disposed or ():
                canvas[place] = clear
        self.assertIn(sum(times), range(1000 * self.COUNT // 24 - 1, 1000 * self.COUNT // 24 + 2), times)

    def test_standard_output_gets_the_same_file(self):
        command = ("animate", self.model, "--frames", "1-3", "--fps", "25", *SIZE, "--samples", "1")
        result = farlight(*command, "-o", "-", "--format", "gif", text=False)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertNotIn(b"note", result.stderr)  # 25 per second are 4 hundredths
        self.expect(farlight(*command, "-o", self.folder / "around.gif"), 0)
        self.assertEqual(result.stdout, (self.folder / "around.gif").read_bytes())


class Scripts(OneDaemon, Animations):
    EYE, LOOK_AT = [2, 1.5, 2.5], [0, 0, 0]

    def camera(self, **more):
        return {"eye": self.EYE, "look_at": self.LOOK_AT, "fov": 40, **more}

    def shot(self, folder, name="shot.json", **more):
        (self.folder / folder).mkdir(exist_ok=True)
        script = self.write({"model": str(self.model), "size": [48, 32], "output": f"{folder}/%04d.exr", **more}, name)
        result = self.expect(farlight("animate", "--script", script), 0)
        return self.digests(folder), result

    def still(self, *arguments, name="still.exr"):
        path = self.folder / name
        self.expect(farlight("render", self.model, "-o", path, *SIZE, "--samples", "1", *arguments), 0)
        return digest(path)

    def test_an_orbit_is_that_of_the_command_line(self):
        got, _ = self.shot("script", camera=self.camera(orbit={"degrees": 90}), frames="5-9")
        want, _ = self.animate("typed", self.model, "--frames", "5-9", "--orbit=90", "--eye", "2,1.5,2.5", "--look-at",
                               "0,0,0", "--fov", "40")
        self.assertEqual(got, want)

    def test_the_command_line_overrides_the_script(self):
        self.shot("script", camera=self.camera(orbit=True), frames="1-4")
        self.expect(farlight("animate", "--script", self.folder / "shot.json", "--shard", "2/2", "-o",
                             self.folder / "%d.exr"), 0)
        self.assertEqual({2: digest(self.folder / "2.exr"), 4: digest(self.folder / "4.exr")},
                         {n: value for n, value in self.digests("script").items() if n in (2, 4)})
        self.expect(farlight("animate", "--script", self.folder / "shot.json", "--frames", "1-1", "--eye", "2,1.5,2.5",
                             "--look-at", "0,0,0", "--fov", "40", "-o", self.folder / "still-%d.exr"), 0)
        self.assertEqual(digest(self.folder / "still-1.exr"), self.still("--eye", "2,1.5,2.5", "--look-at", "0,0,0",
                                                                         "--fov", "40"))

    def test_models_have_their_places(self):
        """As the command line's --at has them; a model of the command line replaces them all."""
        models = [str(self.model), {"model": str(self.model), "at": [1, 0, 0], "rotation_degrees": [0, 90, 0], "scale": 0.5}]
        script = self.write({"models": models, "camera": self.camera(), "size": [48, 32], "frames": "1-1", "samples": 1})
        for more, typed in (((), (self.model, "--at", "1,0,0:0,90,0:0.5")), ((self.model,), ())):
            self.expect(farlight("animate", "--script", script, *more, "-o", self.folder / "script-%d.exr"), 0)
            self.assertEqual(digest(self.folder / "script-1.exr"),
                             self.still(*typed, "--eye", "2,1.5,2.5", "--look-at", "0,0,0", "--fov", "40"))

    def test_keys_begin_and_end_where_they_say(self):
        """The first and the last frame are pictures of a camera that stands there."""
        eye = {"times": [0, 0.25], "values": [self.EYE, [3, 1, 1]]}
        for interpolation in ("linear", "catmull-rom", "bezier", "cubic-spline"):
            with self.subTest(interpolation=interpolation):
                got, _ = self.shot(interpolation, camera=self.camera(
                    eye={**eye, "interpolation": interpolation},
                    fov={"times": [0, 0.25], "values": [40, 60], "interpolation": interpolation}))
                self.assertEqual(list(got), list(range(1, 8)), "without a range: up to the last key")
                self.assertEqual(len(set(got.values())), 7)
                self.assertEqual(got[1], self.still("--eye", "2,1.5,2.5", "--look-at", "0,0,0", "--fov", "40"))
                self.assertEqual(got[7], self.still("--eye", "3,1,1", "--look-at", "0,0,0", "--fov", "60"))
        got, _ = self.shot("steps", frames="1-6", camera=self.camera(
            eye={"times": [0, 0.125], "values": [self.EYE, [3, 1, 1]], "interpolation": "step"}))
        self.assertEqual([got[n] == got[1] for n in range(1, 7)], [True, True, True, False, False, False])
        self.assertEqual(got[4], got[6])

    def test_a_dolly_arrives_with_the_last_frame(self):
        got, _ = self.shot("dolly", frames="1-5", camera=self.camera(dolly={"to": [3, 1, 1]}))
        self.assertEqual(got[5], self.still("--eye", "3,1,1", "--look-at", "0,0,0", "--fov", "40"))
        ease, _ = self.shot("ease", frames="1-5", camera=self.camera(dolly={"to": [3, 1, 1], "ease": True}))
        self.assertEqual((ease[1], ease[5]), (got[1], got[5]))
        self.assertNotEqual(ease[2], got[2])

    def test_names_that_the_model_lacks_are_reported_with_their_line(self):
        model = moving_model(self.folder / "moving.gltf")
        for member, value, told in (("materials", [{"target": "brass", "roughness": 1}], "clay"),
                                    ("nodes", [{"target": "pyramids", "scale": [1, 1, 1]}], "pyramid"),
                                    ("lights", [{"target": 7, "size": 1}], "bulb"), ("clips", ["sliding"], "slide")):
            with self.subTest(member=member):
                script = self.write({"model": str(model), "frames": "1", "output": "%d.png", member: value})
                result = self.expect(farlight("animate", "--script", script), 2)
                self.assertRegex(result.stderr, rf"shot\.json: line 1: {member}")
                self.assertIn(told, result.stderr, "what there is, is listed")

    def test_a_light_without_a_size_gets_none(self):
        model = moving_model(self.folder / "moving.gltf")
        script = self.write({"model": str(model), "frames": "1", "output": "%d.png",
                             "lights": [{"target": "bulb", "colour": [1, 1, 1], "size": 0.5}]})
        result = self.expect(farlight("animate", "--script", script), 2)
        self.assertRegex(result.stderr, r"shot\.json: line 1: lights\[0\]\.size: the light 'bulb' has no size.*radius")
        document = json.loads(model.read_text())
        document["extensions"]["KHR_lights_punctual"]["lights"][0]["extras"] = {"radius": 0.1}
        model.write_text(json.dumps(document))
        self.expect(farlight("animate", "--script", script, "--size", "16x16"), 0)


class Clips(OneDaemon, Animations):
    """Clips of a small model of our own, and of a bundled one."""

    VIEW = ["--eye", "0,2,7", "--look-at", "0,0.5,0", "--fov", "45"]

    def setUp(self):
        super().setUp()
        self.model = moving_model(self.folder / "moving.gltf")

    def still(self, *arguments):
        path = self.folder / "still.exr"
        self.expect(farlight("render", self.model, "-o", path, *SIZE, *self.VIEW, "--samples", "1", *arguments), 0)
        return digest(path)

    def test_a_clip_runs_once_through_and_every_moment_can_be_rendered_alone(self):
        for clip in ("slide", "1", "pulse"):
            with self.subTest(clip=clip):
                got, _ = self.animate(f"clip-{clip}", self.model, "--clip", clip, "--fps", "8", *self.VIEW)
                self.assertEqual(list(got), list(range(1, 9)), "the ninth would be the first again")
                self.assertGreater(len(set(got.values())), 7)
                for frame in (1, 4):
                    self.assertEqual(got[frame], self.still("--clip", clip, "--time", (frame - 1) / 8))

    def test_clips_end_once_begin_later_and_run_faster(self):
        once, _ = self.animate("once", self.model, "--clip", "slide", "--clip-once", "--fps", "4", *self.VIEW)
        self.assertEqual(list(once), list(range(1, 6)), "the last pose is one of them")
        long, _ = self.animate("long", self.model, "--clip", "slide", "--clip-once", "--fps", "4", "--frames", "1-7",
                               *self.VIEW)
        self.assertEqual((long[5], long[6]), (long[7], long[7]))
        loop, _ = self.animate("loop", self.model, "--clip", "slide", "--fps", "4", "--frames", "1-7", *self.VIEW)
        self.assertEqual(loop[5], loop[1])
        late, _ = self.animate("late", self.model, "--clip", "slide", "--fps", "4", "--frames", "1-4", "--clip-start",
                               "0.5", *self.VIEW)
        self.assertEqual((late[1], late[3], late[4]), (loop[1], loop[1], loop[2]))
        fast, _ = self.animate("fast", self.model, "--clip", "slide", "--fps", "4", "--clip-speed", "2", *self.VIEW)
        self.assertEqual(fast, {1: loop[1], 2: loop[3]})

    def test_two_clips_are_played_at_once(self):
        both, _ = self.animate("both", self.model, "--clip", "slide", "--clip", "sink", "--fps", "4", *self.VIEW)
        alone, _ = self.animate("alone", self.model, "--clip", "slide", "--fps", "4", *self.VIEW)
        self.assertEqual(both[1], alone[1])
        self.assertNotEqual(both[2], alone[2])

    def test_a_script_moves_what_a_clip_moves(self):
        """The same keys from the model and from a script give the same pictures."""
        clip, _ = self.animate("clip", self.model, "--clip", "slide", "--fps", "4", "--frames", "1-5", "--clip-once",
                               *self.VIEW)
        (self.folder / "script").mkdir()
        script = self.write({
            "model": str(self.model), "fps": 4, "frames": "1-5", "size": [48, 32], "output": "script/%04d.exr",
            "camera": {"eye": [0, 2, 7], "look_at": [0, 0.5, 0], "fov": 45},
            "nodes": [{"target": "pyramid", "translation": {"times": [0, 1], "values": [[-1, 0, 0], [1, 0, 0]]}}]})
        self.expect(farlight("animate", "--script", script), 0)
        self.assertEqual(self.digests("script"), clip)

    def test_lights_materials_and_nodes_change(self):
        view = {"camera": {"eye": [0, 2, 7], "look_at": [0, 0.5, 0], "fov": 45}}
        plain = self.still()
        for name, change in {
                "colour": {"lights": [{"target": "bulb", "colour": {"times": [0, 1], "values": [[30, 30, 30], [1, 5, 9]]}}]},
                "base colour": {"materials": [{"target": "clay", "base_colour": {"times": [0, 1], "values":
                                                                               [[0.8, 0.4, 0.2], [0, 0, 1]]}}]},
                "emission": {"materials": [{"target": 0, "emission": {"times": [0, 1], "values": [[0, 0, 0], [1, 1, 1]]}}]},
                "roughness": {"materials": [{"target": 0, "roughness": {"times": [0, 1], "values": [1, 0.2]}}]},
                "rotation": {"nodes": [{"target": "pyramid", "rotation_degrees": {"times": [0, 1], "values":
                                                                                 [[0, 0, 0], [0, 45, 0]]}}]},
                "hidden": {"nodes": [{"target": "pyramid", "hidden": {"times": [0, 0.9], "values": [False, True]}}]},
        }.items():
            with self.subTest(change=name):
                folder = self.folder / name.replace(" ", "-")
                folder.mkdir()
                script = self.write({"model": str(self.model), "fps": 1, "frames": "1-2", "size": [48, 32],
                                     "output": f"{folder.name}/%d.exr", **view, **change})
                self.expect(farlight("animate", "--script", script), 0)
                first, second = (digest(folder / f"{n}.exr") for n in (1, 2))
                self.assertNotEqual(first, second)
                if name not in ("colour",):  # its first key is not the model's own
                    self.assertEqual(first, plain)

    def test_a_turn_of_360_degrees_is_a_full_turn(self):
        """Between 0 and 360 degrees the shorter arc would stand still."""
        script = self.write({"model": str(self.model), "fps": 4, "frames": "1-5", "size": [48, 32], "output": "%d.exr",
                             "camera": {"eye": [0, 2, 7], "look_at": [0, 0.5, 0]},
                             "nodes": [{"target": "pyramid", "rotation_degrees": {"times": [0, 1], "values":
                                                                                 [[0, 0, 0], [0, 360, 0]]}},
                                       {"target": "ground", "hidden": True}]})
        self.expect(farlight("animate", "--script", script), 0)
        frames = [digest(self.folder / f"{n}.exr") for n in range(1, 6)]
        self.assertEqual(frames[0], frames[4])
        self.assertEqual(len(set(frames)), 4)

    def test_blurred_frames_are_the_same_to_the_bit_however_the_range_was_divided(self):
        """Of a skinned model, with shutter and lens."""
        common = ["--clip", "ride", "--fps", "12", "--frames", "3-6", "--samples", "2", "--shutter", "0.5", "--aperture", "0.3", "--focus", "7.4"]
        model = bundled_scenes() / "carousel.glb"
        whole, _ = self.animate("whole", model, *common)
        self.assertEqual(len(set(whole.values())), 4)
        for part in (2, 1):
            parts, _ = self.animate("parts", model, *common, "--shard", f"{part}/2")
        self.assertEqual(parts, whole)
        (self.folder / "parts/0004.exr").unlink()
        self.assertEqual(self.animate("parts", model, *common, "--resume")[0], whole)
        still, _ = self.animate("still", model, *common[:4], "--frames", "3", "--samples", "2", *common[-4:])
        self.assertNotEqual(still[3], whole[3], "an open shutter is seen")


class Info(Animations):
    def test_info_lists_names_and_boxes(self):
        model = moving_model(self.folder / "moving.gltf")
        info = json.loads(self.expect(farlight("info", "--json", model), 0).stdout)
        names = {kind: [one["name"] for one in info[kind]] for kind in ("node_list", "material_list", "light_list")}
        self.assertEqual(names, {"node_list": ["pyramid", "ground", "light"], "material_list": ["clay"],
                                 "light_list": ["bulb"]})
        boxes = [info["bounds"], *(node.get("bounds") for node in info["node_list"])]
        expected = [([-4, -2.2, -5], [4, 2, 3]), ([-1, 0, -1], [1, 2, 1]), ([-4, -2.2, -5], [4, -0.2, 3]), None]
        for box, wanted in zip(boxes, expected):
            self.assertEqual(box is None, wanted is None)
            for got, value in zip(box["lower"] + box["upper"] if box else [], wanted[0] + wanted[1] if wanted else []):
                self.assertAlmostEqual(got, value, places=5)
        table = self.expect(farlight("info", model), 0).stdout
        for line in ("  node 1: ground, (-4 -2.2 -5) to (4 -0.2 3)", "  material 0: clay", "  light 0: bulb",
                     "  box        (-4 -2.2 -5) to (4 2 3)"):
            self.assertIn(line + "\n", table)


class Progressive(OneDaemon, Animations):
    ARGUMENTS = [*SIZE, "--aperture", "0.2"]

    def samples(self, path):
        return float(farlight_test.exr_attributes(path)["farlight/samples"].decode(errors="replace").strip("\0") or 0)

    @long_test
    def test_passes_add_up_to_the_samples(self):
        path = self.folder / "p.exr"
        for passes in ("--progressive", "--progressive=3"):
            with self.subTest(passes=passes):
                result = self.expect(farlight("render", bundled_scenes() / "teapot.glb", "-o", path, *self.ARGUMENTS,
                                              "--samples", "8", passes, "--timings=json"), 0)
                lines = [json.loads(line) for line in result.stdout.splitlines()]
                held = [line["samples"] for line in lines if line["kind"] == "frame"]
                self.assertEqual(held, [1, 2, 4, 8] if passes == "--progressive" else [3, 6, 8])

    def test_the_picture_is_replaced_pass_by_pass_and_stays_after_an_interrupt(self):
        path = self.folder / "p.exr"
        child = subprocess.Popen([BIN / "farlight", "render", bundled_scenes() / "teapot.glb", "-o", path,
                                  *self.ARGUMENTS, "--samples", "60000", "--progressive=4"], stderr=subprocess.PIPE)
        seen, deadline = set(), time.monotonic() + farlight_test.TIMEOUT_S
        while len(seen) < 3 and time.monotonic() < deadline and child.poll() is None:
            with contextlib.suppress(FileNotFoundError):
                seen.add(digest(path))
            time.sleep(0.02)
        child.send_signal(signal.SIGINT)
        errors = child.stderr.read().decode()
        child.stderr.close()
        self.assertEqual(child.wait(farlight_test.TIMEOUT_S), 130, errors)
        self.assertGreaterEqual(len(seen), 3, errors)
        self.assertEqual(self.leftovers(), ["p.exr"])
        digest(path)

    def test_without_a_number_an_interrupt_is_the_end_and_the_picture_says_how_many_samples_it_has(self):
        self.default_samples()
        path = self.folder / "p.exr"
        child = subprocess.Popen([BIN / "farlight", "render", bundled_scenes() / "teapot.glb", "-o", path,
                                  *self.ARGUMENTS, "--progressive=2"], stderr=subprocess.PIPE)
        held, deadline = 0, time.monotonic() + farlight_test.TIMEOUT_S
        while held < 6 and time.monotonic() < deadline and child.poll() is None:
            with contextlib.suppress(FileNotFoundError):
                held = self.samples(path)
            time.sleep(0.02)
        child.send_signal(signal.SIGINT)
        errors = child.stderr.read().decode()
        child.stderr.close()
        self.assertEqual(child.wait(farlight_test.TIMEOUT_S), 0, errors)
        self.assertEqual(self.leftovers(), ["p.exr"])
        self.assertGreaterEqual(self.samples(path), held)
        self.assertIn(f"has {self.samples(path):.0f} samples a pixel", errors)
        # What was refined is what the same number of samples gives at once, if it is not clamped either.
        whole = self.folder / "whole.exr"
        self.expect(farlight("render", bundled_scenes() / "teapot.glb", "-o", whole, *self.ARGUMENTS, "--samples",
                             f"{self.samples(path):.0f}", "--progressive", "--clamp", "0"), 0)
        self.assertEqual(digest(path), digest(whole))

    def test_standard_output_is_written_once(self):
        result = self.expect(farlight("render", bundled_scenes() / "teapot.glb", "-o", "-", "--progressive"), 2)
        self.assertIn("--progressive", result.stderr)


if __name__ == "__main__":
    farlight_test.unittest.main()
