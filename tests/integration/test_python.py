# SPDX-License-Identifier: MIT
"""The Python package: its codec against the stored bytes of the C side, pictures against the command line's, servers that
lie, and connections that are cut."""
import asyncio
import contextlib
import importlib.util
import json
import os
import random
import re
import select
import socket
import struct
import subprocess
import sys
import threading
import time
import unittest.mock

import farlight_test
from farlight_test import Case, Daemon, OneDaemon, bundled_scenes, frames_of, long_test, read_png
from test_animate import Cut
from test_sealed import SealedDaemon

PACKAGE = farlight_test.BIN.absolute() / "python"
EXAMPLES = farlight_test.ROOT / "client/python/examples"
DEBIANS = "/usr/lib/python3/dist-packages"
sys.path.insert(0, str(PACKAGE))
if not importlib.util.find_spec("numpy"):  # another python3 comes before Debian's
    sys.path.append(DEBIANS)
import numpy as np  # pylint: disable=wrong-import-position
import farlight  # pylint: disable=wrong-import-position
from farlight import blobs, errors, fields, framing, importer, messages  # pylint: disable=wrong-import-position
from farlight.core import Core  # pylint: disable=wrong-import-position

GOLDEN = farlight_test.ROOT / "tests/unit/protocol/golden/messages.hex"
STRAIGHT = farlight.Camera((0, 0, 6), fov_degrees=40)
os.environ["FARLIGHT_LIBEXEC"] = str(farlight_test.BIN.absolute())


def triangle(colour=(0.8, 0.4, 0.2)):
    scene = farlight.Scene()
    material = scene.add_material(colour, roughness=1)
    scene.add_node(scene.add_mesh([(-1, -1, 0), (3, -1, 0), (-1, 3, 0)], material=material))
    scene.add_light("directional", (3, 3, 3))
    return scene, material


def python(*arguments, **options):
    path = os.pathsep.join([str(PACKAGE)] + [DEBIANS] * (DEBIANS in sys.path))
    return subprocess.run([sys.executable, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          check=False, timeout=farlight_test.TIMEOUT_S, env={**os.environ, "PYTHONPATH": path}, **options)


# ---- bytes

class Codec(Case):
    def test_the_stored_messages_of_the_c_side_are_read_and_written_byte_by_byte(self):
        rows = {row.NAME: row for row in messages.MESSAGES.values()}
        for line in GOLDEN.read_text().splitlines():
            name, case, stored = (line.split(" ") + [""])[:3]
            payload = bytes.fromhex(stored)
            with self.subTest(message=name, case=case):
                self.assertEqual(fields.encode(fields.decode(rows[name], payload)), payload)

    def test_every_prefix_of_a_message_is_refused_with_the_name_of_a_field(self):
        for line in GOLDEN.read_text().splitlines():
            name, _, stored = (line.split(" ") + [""])[:3]
            row = next(row for row in messages.MESSAGES.values() if row.NAME == name)
            payload = bytes.fromhex(stored)
            for size in {*range(min(len(payload), 40)), len(payload) // 2, len(payload) - 1} - {-1}:
                with self.subTest(message=name, size=size), self.assertRaises(errors.ProtocolError) as raised:
                    fields.decode(row, payload[:size])
                self.assertTrue(raised.exception.field.startswith(name))

    def test_a_value_that_may_not_be_sent_names_its_field_and_what_is_allowed(self):
        for values, field, text in (({"width": 0}, "render.width", "1 .. 8192"), ({"width": 1.5}, "render.width", "whole"),
                                    ({"tracer": "bwh"}, "render.tracer", "bvh, naive"), ({"noise": float("nan")}, "render.noise", "0"),
                                    ({"quadtree_layers": 9}, "render.quadtree_layers", "3"), ({"abuffer_voxels": 5}, "render.abuffer_voxels", "16, 32"),
                                    ({"keys": [3]}, "render.keys[0]", "CameraKey"), ({"exposure_stops": "x"}, "render.exposure_stops", "number")):
            with self.subTest(**values), self.assertRaises(farlight.InvalidValue) as raised:
                fields.encode(messages.Render(scene=1, channel=2, **values))
            self.assertEqual(raised.exception.field, field)
            self.assertIn(text, str(raised.exception))

    def test_edits_are_what_has_changed_since(self):
        scene, material = triangle()
        version, objects = scene.version, len(scene.edits_since(0))
        self.assertEqual(objects, 5)
        scene.change(material, roughness=scene.get(material).roughness)  # as it is: no change
        self.assertEqual(scene.version, version)
        scene.change(material, roughness=0.5)
        passing = scene.add_node()
        scene.remove(passing)  # which was never sent
        self.assertEqual([edit.NAME for edit in scene.edits_since(version)], ["set_material"])
        lamp = scene.objects("node")[-1]
        scene.change(scene.shown(lamp), colour=(9, 9, 9))
        self.assertEqual([edit.NAME for edit in scene.edits_since(version)], ["set_material", "set_light"])
        group = scene.add_node()
        scene.add_node(parent=group)
        version = scene.version
        scene.remove(group)
        self.assertEqual([(edit.NAME, edit.object) for edit in scene.edits_since(version)],
                         [("remove", group.number + 1), ("remove", group.number)])
        self.assertEqual(len(scene.edits_since(0)), objects)


# ---- servers that lie

def say(message, request=0, channel=0):
    return framing.pack(message, request, channel)


DIGEST = 0x1059105ad19bfa09  # XXH3-64 of bytes(range(256)) * 2
REPLY = b"FARL" + struct.pack("<HHQ", 2, 0, 0) + bytes(32) + b"\0\0" + bytes(6)


class Asked:
    """A core that has asked for the frames of a batch of 16x8 pixels, and what it did then. No socket, no clock."""

    def __init__(self):
        self.core = Core()
        self.frames = []
        self.scene, _ = triangle()
        self.steps = self.work()

    def work(self):
        yield from self.core.greet()
        render = farlight.camera.request(STRAIGHT, (), {"width": 16, "height": 8, "last_frame": 1})
        for frame in self.core.batch(self.scene, render):
            if frame is not None:
                self.frames.append(frame)
            yield frame is not None

    def hear(self, data):
        """What it raises, or None."""
        self.core.receive(data)
        return self.go_on()

    def go_on(self):
        try:
            while True:
                sent = len(self.core.unsent())
                if not next(self.steps) and len(self.core.unsent()) == sent:
                    return None
        except StopIteration:
            return None
        except farlight.Error as why:
            return why


def started(data=b""):
    """After the daemon has taken the scene; the batch is request 4 on channel 2."""
    asked = Asked()
    for one in (REPLY, say(messages.Ok(), 1), say(messages.BlobNeed([]), 2), say(messages.Ok(1), 3)):
        assert asked.hear(one) is None
    return asked, asked.hear(data)


def begin(**values):
    return messages.FrameBegin(**{"width": 16, "height": 8, "samples": 1, "size_bytes": 512, "layers": 1, "digest": DIGEST, **values})


def frame(number, **values):
    return (say(begin(frame=number, **values), 4, 2) + say(messages.FrameData(0, bytes(range(256)) * 2), 4, 2) +
            say(messages.FrameEnd(number), 4, 2))


class Lies(Case):
    def test_what_is_no_handshake_ends_the_connection(self):
        for reply, kind in ((b"HTTP/1.1 400 Bad Request", farlight.ProtocolError), (b"F" + bytes(47), farlight.ProtocolError),
                            (b"FARL" + struct.pack("<HH", 2, 60000) + bytes(40), farlight.ProtocolError),
                            (b"FARL" + struct.pack("<HHQ", 7, 0, 0) + bytes(34) + bytes(6), farlight.Refused),
                            (b"FARL" + struct.pack("<HHQ", 0, 0, 4) + bytes(34) + bytes(6), farlight.Refused)):
            with self.subTest(reply=reply[:8]):
                asked = Asked()
                self.assertIsInstance(asked.hear(reply), kind)

    def test_messages_that_nobody_may_send_now_end_the_connection(self):
        header = struct.pack
        for lie in (header("<I2H2I", 1 << 31, 0x0001, 0, 4, 0),  # two gigabytes
                    header("<I2H2I", 65544, 0x000a, 0, 4, 0), header("<I2H2I", 8, 0x7fff, 0, 0, 0) + bytes(8),
                    header("<I2H2I", 8, 0x0003, 1, 0, 0) + bytes(8), header("<I2H2I", 2, 0x0003, 0, 0, 0) + bytes(2) + b"padded",
                    say(messages.Render(1, channel=2)), say(messages.ImportDone()), say(messages.Ok(), 77), say(messages.Ok(), 1),
                    say(messages.BlobNeed([]), 4), say(begin(), 4, 9), say(begin(), 9, 2), say(messages.FrameData(0, b"x"), 4, 2),
                    say(messages.FrameEnd(), 4, 2), say(begin(width=8192, height=8192, size_bytes=1 << 28), 4, 2),
                    say(begin(size_bytes=511), 4, 2), say(begin(encoding=2), 4, 2), say(begin(format=2), 4, 2), say(begin(layers=255), 4, 2),
                    say(begin(depth_bytes=9, attachments=1), 4, 2), say(begin(), 4, 2) * 2,
                    say(begin(), 4, 2) + say(messages.FrameData(8, b"x"), 4, 2), say(begin(), 4, 2) + say(messages.FrameEnd(), 4, 2),
                    say(begin(), 4, 2) + say(messages.FrameData(0, bytes(513)), 4, 2), frame(0) + frame(1) + frame(2) + frame(3),
                    say(messages.SetNode(1), 4), say(messages.FrameParts(0, []), 4, 2)):
            with self.subTest(lie=lie[:24]):
                asked, why = started(lie)
                self.assertIsInstance(why, farlight.ProtocolError)
                self.assertTrue(why.field)
                self.assertIsInstance(asked.hear(b"more"), (farlight.ProtocolError, type(None)))

    def test_nothing_is_kept_of_a_frame_but_what_has_come(self):
        asked, why = started(say(begin(), 4, 2) + say(messages.FrameData(0, bytes(100)), 4, 2))
        self.assertIsNone(why)
        self.assertIsNone(asked.hear(struct.pack("<I2H2I", 262144, 0x0211, 0, 4, 2)))
        self.assertLess(len(asked.core._in), 100)  # pylint: disable=protected-access

    def test_an_honest_daemon_is_believed(self):
        asked, why = started(frame(0) + say(messages.Ping(5)) + struct.pack("<I2H2I", 3, 0x9999, 0, 0, 0) + bytes(8) + frame(1) +
                             say(messages.Ok(), 4))
        self.assertIsNone(why)
        self.assertEqual([one.number for one in asked.frames], [0, 1])
        self.assertEqual(asked.frames[0].data, bytes(range(256)) * 2)

    def test_an_error_says_what_helps_and_the_connection_goes_on(self):
        error = messages.Error(messages.ErrorCode.BUSY, 0, 1500, "render.scene", "no place", "wait")
        asked, why = started(say(error, 4))
        self.assertIsInstance(why, farlight.Refused)
        self.assertEqual((why.field, why.remedy, why.retryable, why.retry_after_s), ("render.scene", "wait", True, 1.5))
        self.assertIsNone(asked.core.failure)
        asked, why = started(say(error))
        self.assertIsInstance(asked.core.failure, farlight.Refused)
        asked, why = started(say(messages.Goodbye(messages.ErrorCode.SHUTTING_DOWN, "until later")))
        self.assertIsInstance(why, farlight.ConnectionLost)
        self.assertIn("until later", str(why))

    def test_changed_bytes_raise_nothing_but_errors_of_the_package(self):
        random.seed(farlight_test.ROOT.name)
        honest = frame(0) + say(messages.Blocked(2, 1, "why")) + frame(1) + say(messages.Ok(), 4)
        for _ in range(600 if farlight_test.LONG else 150):
            changed = bytearray(honest)
            for _ in range(random.randrange(1, 4)):
                changed[random.choice((random.randrange(16), random.randrange(len(changed))))] = random.randrange(256)
            asked, why = started(bytes(changed))
            ended = asked.hear(b"")
            self.assertTrue(why is None or isinstance(why, farlight.Error), why)
            self.assertTrue(ended is None or isinstance(ended, farlight.Error), ended)
            self.assertIsNotNone(asked.core.failure)

    def test_a_connection_that_ends_after_any_byte_is_lost_and_may_be_sought_again(self):
        honest = [REPLY, say(messages.Ok(), 1), say(messages.BlobNeed([]), 2), say(messages.Ok(1), 3), frame(0)]
        for cut in range(0, sum(map(len, honest)), 3):
            asked, left, why = Asked(), cut, None
            for one in honest:
                why = asked.hear(one[:left]) if left else None
                left -= min(left, len(one))
                self.assertIsNone(why)
            why = asked.hear(b"")
            self.assertIsInstance(why, farlight.ConnectionLost, cut)
            self.assertTrue(why.retryable)

    def test_a_server_that_says_nothing_or_too_little_is_not_waited_for(self):
        for said in (b"", REPLY[:20], REPLY):
            with self.subTest(said=said[:4]), socket.socket(socket.AF_UNIX) as listener:
                path = self.folder / f"silent-{len(said)}"
                listener.bind(str(path))
                listener.listen()
                held = []
                thread = threading.Thread(target=lambda: (held.append(listener.accept()[0]), held[0].sendall(said)))
                thread.start()
                began = time.monotonic()
                with self.assertRaises(farlight.TimedOut):
                    with farlight.connect(f"unix:{path}", timeout=0.3) as client:
                        client.stats()
                self.assertLess(time.monotonic() - began, 60)
                thread.join()
                held[0].close()
                thread = threading.Thread(target=lambda: (held.append(listener.accept()[0]), held[1].sendall(said)))
                thread.start()
                with self.assertRaises(farlight.TimedOut):
                    asyncio.run(self.ask_async(f"unix:{path}"))
                thread.join()
                held[1].close()

    @staticmethod
    async def ask_async(address):
        async with await farlight.aio.connect(address, timeout=0.3) as client:
            await client.stats()

    def test_an_importer_gets_no_secrets(self):
        program = self.folder / "farlight-import"
        program.write_text("#!/bin/sh\necho \"secret ${TOKEN-unset}, zone $TZ\"\nexit 3\n")
        program.chmod(0o700)
        with unittest.mock.patch.dict(os.environ, {"FARLIGHT_LIBEXEC": str(self.folder), "TOKEN": "x", "TZ": "UTC"}):
            with self.assertRaises(farlight.Error) as raised:
                farlight.load(program)
        self.assertIn("secret unset, zone UTC", str(raised.exception))

    def test_a_program_that_cannot_start_says_why(self):
        fake = self.folder / "farlightd"
        fake.write_text("#!/bin/sh\necho log >&2\necho 'farlightd: no device gives OpenGL 4.5\nfarlightd: install one' >&2\nexit 1\n")
        fake.chmod(0o755)
        environment = {**os.environ, "FARLIGHT_LIBEXEC": str(self.folder)}
        environment.pop("FARLIGHT_SERVER", None)
        with unittest.mock.patch.dict(os.environ, environment, clear=True):
            for connect in (farlight.connect, lambda: asyncio.run(farlight.aio.connect())):
                with self.assertRaises(farlight.ConnectionLost) as raised:
                    connect()
                self.assertIn("farlightd ended with status 1: no device gives OpenGL 4.5; install one", str(raised.exception))
                self.assertFalse(raised.exception.retryable)
        with unittest.mock.patch.dict(os.environ, {"FARLIGHT_LIBEXEC": "", "PATH": str(self.folder / "none")}):
            with self.assertRaises(farlight.FileFailed) as raised:
                farlight.load(__file__)
            self.assertIn("FARLIGHT_LIBEXEC", raised.exception.remedy)

    def test_an_importer_is_believed_no_more_than_a_daemon(self):
        blob = bytes(12)
        name = blobs.blob_hash(blob)
        reference = messages.BlobRef(12, name)
        offer = say(messages.BlobOffer([reference]), 1)
        for lie in (say(messages.Render(1, channel=2), 1), say(messages.Ok(), 1), say(messages.SceneOpen(2), 1), say(messages.SetNode(1), 3),
                    say(messages.BlobData(0, name, blob), 2, 1), offer + say(messages.BlobData(0, name, bytes(13)), 2, 1),
                    offer + say(messages.BlobData(4, name, blob), 2, 1), offer + say(messages.BlobData(0, name, b"wrong bytes "), 2, 1),
                    say(messages.EditBegin(1), 3) + say(messages.SetSpheres(1, 1, [reference]), 3)):
            with self.subTest(lie=lie[:24]), self.assertRaises(farlight.Error):
                importer._Import(farlight.Scene(), 1 << 20).receive(lie)  # pylint: disable=protected-access


# ---- daemons

class WithDaemon(OneDaemon):
    def connect(self, **options):
        client = farlight.connect(self.daemon.address, **options)
        self.addCleanup(client.close)
        return client

    def test_pictures_are_the_command_lines_to_the_byte(self):
        self.default_samples()
        client = self.connect()
        for model, size in (("teapot.glb", (64, 48)),) + ((("sphereflake-2.nff", (48, 32)),) if farlight_test.LONG else ()):
            path = bundled_scenes() / model
            shape = f"{size[0]}x{size[1]}"
            self.expect(farlight_test.farlight("render", path, "--size", shape, "-o", self.folder / "c.png"), 0)
            self.expect(python("-m", "farlight", "render", path, "--size", shape, "-o", self.folder / "python.png"), 0)
            self.assertEqual(read_png(self.folder / "python.png")[2:], read_png(self.folder / "c.png")[2:])
        scene = farlight.load(bundled_scenes() / "teapot.glb")
        named = ("--eye", "1,2,6", "--look-at", "0,0.5,0", "--fov", "40", "--size", "40x30", "--samples", "2", "--integrator", "whitted")
        result = self.expect(farlight_test.farlight("render", bundled_scenes() / "teapot.glb", *named, "--layers", "beauty,depth,normal,albedo",
                                                    "-o", self.folder / "c.exr", "--float", "--timings=json"), 0)
        camera = farlight.Camera((1, 2, 6), (0, 0.5, 0), fov_degrees=40)
        picture = client.render(scene, camera, width=40, height=30, samples=2, primary="auto", clamp=10,
                                layers=("beauty", "depth", "normal", "albedo"))
        width, height, channels = farlight_test.read_exr(self.folder / "c.exr")
        self.assertEqual((width, height), picture.size)
        self.assertEqual(picture.begin.digest, int(frames_of(result)[0]["digest"], 16))
        self.assertEqual(picture.colour[..., 0].ravel().tolist(), list(channels["R"]))
        self.assertEqual(picture.albedo[..., 1].ravel().tolist(), list(channels["albedo.G"]))
        self.assertEqual(picture.normal[..., 2].ravel().tolist(), list(channels["normal.Z"]))

    @long_test
    def test_ssh_makes_the_same_picture_and_says_why_it_cannot(self):
        scene, _ = triangle()
        place = self.daemon.address.removeprefix("unix:")
        fake = self.folder / "ssh"
        fake.write_text("""#!/bin/sh
case "$1 $2 $3" in
"-T -- gpu-host") shift 3; exec "$@" ;;
"-T -- waiting") echo "Confirm user presence for key" >&2; exec sleep 60 ;;
"-T -- chatty") exec yes >&2 ;;
*) echo "unknown host $3" >&2; exit 255 ;;
esac
""")
        fake.chmod(0o755)
        with unittest.mock.patch.dict(os.environ, {"PATH": f"{self.folder}:{farlight_test.BIN}:{os.environ['PATH']}"}):
            with farlight.connect(f"ssh:gpu-host:{place}") as client:
                self.assertEqual(client.render(scene, STRAIGHT, width=8, height=8).data,
                                 self.connect().render(scene, STRAIGHT, width=8, height=8).data)
            # A signal 25 is for files that grow too long: another host may say as much as it likes.
            for host, words in (("elsewhere", "ssh ended with status 255: unknown host elsewhere"),
                                ("chatty", "ssh was ended by signal 25: y"),
                                ("waiting", "the daemon has been silent for 0.5 s: Confirm user presence for key")):
                for connect in (farlight.connect, lambda *where, **how: asyncio.run(farlight.aio.connect(*where, **how))):
                    with self.subTest(host), self.assertRaises(farlight.ConnectionLost) as raised:
                        connect(f"ssh:{host}:{place}", timeout=0.5 if host == "waiting" else 60)
                    self.assertEqual(str(raised.exception), f"ssh:{host}:{place}: no daemon can be reached: {words}; try 'ssh {host} "
                                     f"farlight ping --count 1 --server {self.daemon.address}' in a terminal")
            for wrong in ("ssh:", "ssh:-oProxyCommand=x", "ssh:gpu-host:a;b"):
                with self.assertRaises(farlight.InvalidValue):
                    farlight.connect(wrong)

    def test_arrays_are_seen_as_they_were_given(self):
        """An unlit quad that fills the right half of the picture, with a texture of two colours; its depth is 2 m."""
        scene = farlight.Scene()
        texture = scene.add_texture(np.array([[[255, 0, 0]], [[0, 0, 255]]], np.uint8), nearest=1)
        material = scene.add_material((1, 1, 1), unlit=1, textures={0: texture})
        scene.add_node(scene.add_mesh([(0, -1, 0), (1, -1, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)], material=material,
                                      texcoords=[(0, 1), (1, 1), (1, 0), (0, 0)]))
        scene.add_light("point", (1, 1, 1), farlight.look_at((0, 0, 5), (0, 0, 0)))
        seen = farlight.Camera((0, 0, 2), fov_degrees=np.degrees(2 * np.arctan(0.5)))
        picture = self.connect().render(scene, seen, width=16, height=16, layers=("beauty", "depth", "normal"), samples=1)
        np.testing.assert_allclose(picture.colour[:8, 8:, :3], np.broadcast_to((1, 0, 0), (8, 8, 3)), atol=1e-6)
        np.testing.assert_allclose(picture.colour[8:, 8:, :3], np.broadcast_to((0, 0, 1), (8, 8, 3)), atol=1e-6)
        np.testing.assert_allclose(picture.depth[:, 8:], 2, atol=1e-5)
        self.assertTrue(np.isinf(picture.depth[:, :8]).all())
        np.testing.assert_allclose(picture.normal[:, 8:], np.broadcast_to((0, 0, 1), (16, 8, 3)), atol=1e-5)
        self.assertFalse(picture.colour.flags.writeable)

    def test_what_is_added_is_shown_unless_a_node_shows_it(self):
        client = self.connect()
        scene = farlight.Scene()
        ball = scene.add_spheres([(0, 0, 0)], 1)
        scene.add_mesh([(5, 0, 0), (6, 0, 0), (5, 1, 0)])
        scene.add_instances(ball, [farlight.scene.look_at((x, 0, 0), (x, 0, -1)) for x in (-3, 3)])
        bounds = client.describe(scene)
        self.assertEqual((list(bounds.lower_world), list(bounds.upper_world)), ([-4, -1, -1], [6, 1, 1]))
        self.assertEqual(len(scene.objects("node")), 3)
        hidden = farlight.Scene()
        hidden.add_spheres([(0, 0, 0)], 1, place=False)
        with self.assertWarnsRegex(UserWarning, "shows nothing"):
            client.send(hidden)

    def test_a_pinhole_and_a_pose_put_points_where_they_say(self):
        """Two small balls; of a principal point that is not the middle, and of OpenCV's axes."""
        scene = farlight.Scene()
        places = [(0.5, 0.25, 0), (-0.75, 0.5, -1)]
        balls = [scene.add_node(scene.add_spheres([place], 0.1)) for place in places]
        pose = farlight.look_at((1, 2, 4), (0, 0, 0)) @ np.diag([1, -1, -1, 1])
        K = np.array([[60, 0, 40.5], [0, 60, 20], [0, 0, 1]])
        camera, size = farlight.Camera.intrinsics(K, 64, 48, pose)
        frame = self.connect().render(scene, camera, layers="id", samples=1, primary="trace", **size)
        self.assertEqual(frame.size, (64, 48))
        np.testing.assert_allclose(frame.K, K, atol=1e-3)  # by the angle of view in floats
        np.testing.assert_allclose(frame.world_from_view @ np.diag([1, -1, -1, 1]), pose, atol=1e-5)
        for place, ball in zip(places, balls):
            ray = K @ (np.linalg.inv(pose) @ [*place, 1])[:3]
            rows, columns = np.nonzero(frame.mask(ball))
            # A ball of 3 pixels: its pixels lie evenly round the point, to a pixel.
            np.testing.assert_allclose([columns.mean() + 0.5, rows.mean() + 0.5], ray[:2] / ray[2], atol=1)
        for wrong in (np.eye(2), [[60, 0, 99], [0, 60, 20], [0, 0, 1]], [[60, 0, 32], [0, 90, 20], [0, 0, 1]]):
            with self.assertRaises(farlight.InvalidValue):
                farlight.Camera.intrinsics(wrong, 64, 48, pose)

    def test_motion_leads_to_where_a_place_is_seen_in_the_next_frame_and_was_in_the_one_before(self):
        """Places by the layer position, cameras by the frames: floats of some metres, times some ten pixels a metre."""
        scene, _ = triangle()
        keys = [farlight.Camera((x, 0.5, 6), (x / 2, 0, 0), time_s=time_s) for x, time_s in ((0, 0), (1, 0.5), (1.5, 1))]
        frames = list(self.connect().frames(scene, keys, layers=("position", "motion"), width=64, height=48, samples=1, last_frame=2,
                                            frames_per_second=4))
        middle = frames[1]
        self.assertEqual((middle.motion.shape, middle.motion.dtype), ((48, 64, 4), np.float32))
        self.assertFalse(frames[0].motion[..., 2:].any(), "the camera stands still before its first key")
        seen = middle.layer("position")[..., 3] > 0
        self.assertGreater(seen.sum(), 500)
        places = np.concatenate((middle.position, np.ones((48, 64, 1))), axis=-1)[seen]

        def pixels(frame):
            x, y, z = (np.linalg.inv(frame.world_from_view) @ places.T)[:3]
            u, v, w = frame.K @ [x, -y, -z]
            return np.stack((u / w, v / w), axis=-1)

        for other, motion in ((frames[2], middle.motion[..., :2]), (frames[0], middle.motion[..., 2:])):
            flow = (motion * (1, -1))[seen]
            self.assertGreater(abs(flow).max(), 1)
            np.testing.assert_allclose(flow, pixels(other) - pixels(middle), atol=1e-3)

    def test_a_name_makes_the_mask_of_all_that_it_stands_for(self):
        """A car of two wheels beside a ball, from the scene that made them, and attached to."""
        scene = farlight.Scene("garage", "kept")
        rubber = scene.add_material(name="rubber")
        ball = scene.add_spheres([(0, 0, 0)], 1, material=rubber)
        car = scene.add_node(name="car")
        wheels = [scene.add_node(ball, farlight.translate(x), parent=car, name="wheel") for x in (-3, 0)]
        other = scene.add_node(ball, farlight.translate(3), name="ball")
        client, seen = self.connect(), {"width": 32, "height": 12, "layers": "id"}
        frame = client.render(scene, **seen)
        attached = self.connect().render(self.connect().attach("garage"), **seen)
        for one in (frame, attached):
            self.assertEqual(one.names, {car.number: "car", wheels[0].number: "wheel", wheels[1].number: "wheel", other.number: "ball"})
            self.assertEqual(one.material_names, {rubber.number: "rubber"})
            both = np.isin(one.ids[..., 0], [wheel.number for wheel in wheels])
            self.assertEqual(set(np.unique(one.ids[..., 0])), {0, other.number, *(wheel.number for wheel in wheels)})
            for thing, mask in (("car", both), (car, both), ("wheel", both), ("rubber", both | one.mask(other))):
                np.testing.assert_array_equal(one.mask(thing), mask)
            with self.assertRaisesRegex(farlight.InvalidValue, "did you mean wheel"):
                one.mask("weel")
        self.assertEqual(client.render(scene, width=4, height=4).names, {})

    def test_a_notebook_shows_a_frame(self):
        client, (scene, _) = self.connect(), triangle()
        picture = client.render(scene, STRAIGHT, width=8, height=8, samples=1)
        (self.folder / "cell.png").write_bytes(picture._repr_png_())  # pylint: disable=protected-access
        self.assertEqual(read_png(self.folder / "cell.png")[:2], (8, 8))

    def test_a_forked_process_connects_anew_and_leaves_its_parents_connection(self):
        scene, _ = triangle()
        with farlight.connect() as own:  # with a daemon that must not end with the child's client
            for client in (self.connect(), own):
                wanted = client.render(scene, STRAIGHT, width=8, height=8).data
                pipes = [os.pipe() for _ in range(2)]
                for _, write in pipes:
                    child = os.fork()
                    if child == 0:
                        try:
                            picture = client.render(scene, STRAIGHT, width=8, height=8).data
                            client.close()
                            os.write(write, b"same" if picture == wanted else b"other")
                        finally:
                            os._exit(0)
                    self.assertEqual(client.render(scene, STRAIGHT, width=8, height=8).data, wanted)
                    os.waitpid(child, 0)
                    self.assertEqual(client.render(scene, STRAIGHT, width=8, height=8).data, wanted)
                for read, write in pipes:
                    os.close(write)
                    self.assertEqual(os.read(read, 9), b"same")
                    os.close(read)

    def test_only_what_has_changed_is_sent(self):
        client, (scene, material) = self.connect(), triangle()
        first = client.render(scene, STRAIGHT, width=16, height=16)
        sent = client._core._uploaded  # pylint: disable=protected-access
        scene.change(material, base_colour=(0, 0, 1, 1))
        node = scene.find("node", "")[0]
        second = client.render(scene, STRAIGHT, width=16, height=16)
        self.assertEqual((first.begin.revision, second.begin.revision), (1, 2))
        self.assertGreater(second.colour[8, 8, 2], second.colour[8, 8, 0])
        self.assertEqual(client._core._uploaded, sent)  # pylint: disable=protected-access
        scene.remove(node)
        self.assertEqual(client.describe(scene).empty, 1)
        self.assertEqual(client.send(scene), 3)

    def test_others_attach_edit_and_notice_conflicts(self):
        owner, guest = self.connect(), self.connect()
        scene = farlight.Scene("python-shared", "shared")
        steel = scene.add_material((0.5, 0.5, 0.5), name="steel")
        scene.add_node(scene.add_spheres([(0, 0, 0)], 1, material=steel))
        owner.send(scene)
        self.assertIn("python-shared", [entry.name for entry in guest.scenes()])
        other = guest.attach("python-shared")
        found, = guest.objects(other, "material", "steel")
        message, revision = guest.read(other, farlight.Object(messages.ObjectKind.MATERIAL, found.object))
        message.base_colour = (1, 0, 0, 1)
        other.set(message)
        scene.change(steel, roughness=0.1)
        owner.send(scene)
        with self.assertRaises(farlight.Refused) as raised:
            guest.send(other, base_revision=revision)
        self.assertEqual(raised.exception.code, messages.ErrorCode.CONFLICT)
        self.assertEqual(guest.send(other), 3)
        self.assertEqual((guest.changed(other), owner.read(scene, steel)[1], owner.changed(scene)), (2, 3, 3))
        self.assertEqual(owner.read(scene, steel)[0].base_colour, (1, 0, 0, 1))

    def test_frames_that_nobody_wants_any_more_are_cancelled(self):
        client, (scene, _) = self.connect(), triangle()
        for picture in client.frames(scene, STRAIGHT, width=8, height=8, last_frame=1000000):
            if picture.number == 2:
                break
        self.assertEqual(client.render(scene, STRAIGHT, width=8, height=8).number, 0)
        deadline = time.monotonic() + 60
        while client.stats().jobs and time.monotonic() < deadline:
            time.sleep(0.05)
        self.assertEqual(client.stats().jobs, 0)

    def test_a_view_shows_the_newest_camera_and_ends(self):
        client, (scene, _) = self.connect(), triangle()
        with client.view(scene, STRAIGHT, width=16, height=12, samples=2) as view:
            self.assertEqual(view.next_frame().begin.command, 0)
            number = view.set_camera(farlight.Camera((1, 1, 6)))
            while (picture := view.next_frame()).begin.command != number or picture.begin.samples != 2:
                pass
        np.testing.assert_allclose(picture.world_from_view[:3, 3], (1, 1, 6), atol=1e-6)
        self.assertEqual(client.render(scene, STRAIGHT, width=8, height=8).size, (8, 8))

    def test_tasks_share_an_asyncio_client(self):
        async def all_of_it():
            async with await farlight.aio.connect(self.daemon.address) as client:
                (scene, _), (other, _) = triangle(), triangle((0.1, 0.2, 0.8))
                plan = [(one, step) for one in (scene, other) for step in (1, 2, 3)]
                made = await asyncio.gather(*(client.render(one, farlight.Camera((0, 0, 5 + step)), width=16, height=12)
                                              for one, step in plan))
                numbers = [frame.number async for frame in client.frames(scene, STRAIGHT, width=8, height=8, last_frame=4)]
                async with await client.view(scene, STRAIGHT, width=16, height=12) as view:
                    shown = await view.next_frame()
                task = asyncio.create_task(client.render(scene, width=640, height=480, samples=4096))
                await asyncio.sleep(0.05)
                task.cancel()
                with self.assertRaises(asyncio.CancelledError):
                    await task
                with self.assertRaises(farlight.InvalidValue):
                    await client.render(scene, width=-1)
                jobs = (await client.stats()).version
                return plan, made, numbers, shown, jobs

        plan, made, numbers, shown, version = asyncio.run(all_of_it())
        self.assertEqual((numbers, shown.size, version), ([0, 1, 2, 3, 4], (16, 12), farlight.__version__))
        client = self.connect()
        for (scene, step), picture in zip(plan, made):
            same = client.render(scene, farlight.Camera((0, 0, 5 + step)), width=16, height=12)
            self.assertEqual(same.data, picture.data)

    def test_models_say_what_they_lack_and_what_is_wrong_with_them(self):
        (self.folder / "broken.glb").write_bytes(b"glTF" + bytes(40))
        with self.assertRaises(farlight.ImportFailed) as raised:
            farlight.load(self.folder / "broken.glb")
        self.assertIn("broken.glb", raised.exception.field)
        with self.assertRaises(farlight.FileFailed):
            farlight.load(self.folder / "nothing.glb")
        with self.assertRaises(farlight.ImportFailed) as raised:
            farlight.load(bundled_scenes() / "teapot.glb", max_bytes=1000)
        self.assertEqual(raised.exception.field, "max_bytes")
        (self.folder / "far.obj").write_text("v 452340 312 5411190\nv 452342 312 5411190\nv 452340 314 5411190\nf 1 2 3\n")
        self.assertEqual(farlight.load(self.folder / "far.obj").origin, (452341, 313, 5411190))

    @long_test
    def test_the_man_page_has_every_option_of_the_command_line(self):
        page = (farlight_test.ROOT / "conf/man/farlight-python.1").read_text()
        done = python("-m", "farlight", "render", "--help")
        options = set(re.findall(r"--([a-z-]+)", done.stdout)) - {"output", "help"}
        self.assertGreater(len(options), 10)
        for option in options:
            self.assertIn(f".It Fl -{option}", page)

    def test_the_command_line_says_how_it_ended(self):
        model, output = bundled_scenes() / "teapot.glb", ("-o", self.folder / "a.png")
        for arguments, status in (((self.folder / "none.glb", *output), 1), ((model, *output, "--set", "tracer=none"), 2),
                                  ((model, *output, "--server", f"unix:{self.folder}/nowhere"), 75)):
            result = self.expect(python("-m", "farlight", "render", *arguments), status)
            self.assertTrue(result.stderr.strip())
            self.assertNotIn("Traceback", result.stderr)
        self.assertEqual(self.leftovers(), [])
        self.expect(python("-m", "farlight", "render", model, "-o", self.folder / "a.npz", "--size", "24x16", "--samples", "1",
                           "--layers", "depth,normal"), 0)
        with np.load(self.folder / "a.npz") as layers:
            self.assertEqual({name: layers[name].shape for name in layers}, {"depth": (16, 24, 4), "normal": (16, 24, 4)})

    @long_test
    def test_the_examples_run(self):
        result = self.expect(python(EXAMPLES / "training_set.py", bundled_scenes() / "teapot.glb", self.folder / "set", "--count", 2,
                                    "--size", 24, "--samples", 1), 0)
        self.assertEqual(len(result.stdout.splitlines()), 2)
        with np.load(self.folder / "set/00001.npz") as made:
            self.assertEqual({name: made[name].shape for name in ("colour", "depth", "normal", "world_from_view")},
                             {"colour": (24, 24, 4), "depth": (24, 24), "normal": (24, 24, 3), "world_from_view": (4, 4)})
            self.assertTrue(np.isfinite(made["depth"]).any())
        coco = json.loads((self.folder / "set/coco.json").read_text())
        self.assertEqual([image["file_name"] for image in coco["images"]], ["00000.png", "00001.png"])
        self.assertLessEqual({one["category_id"] for one in coco["annotations"]}, {one["id"] for one in coco["categories"]})
        self.assertTrue(coco["annotations"])
        self.expect(python(EXAMPLES / "turntable.py", bundled_scenes() / "sphereflake-2.nff", self.folder / "turn", 2), 0)
        self.assertEqual(sorted(path.name for path in (self.folder / "turn").iterdir()), ["000.png", "001.png"])


# ---- daemons that go away

class Faults(Case):
    def frames(self, client, count=4):
        scene, _ = triangle()
        return [picture.data for picture in client.frames(scene, [STRAIGHT, farlight.Camera((0, 3, 5), time_s=1)], width=16, height=12,
                                                          frames_per_second=3, last_frame=count - 1)]

    def test_cut_connections_lose_no_frame_and_change_no_byte(self):
        with Daemon() as daemon:
            with farlight.connect(daemon.address) as client:
                undisturbed = self.frames(client)
            for cut in (0, 1, 47, 250, 400, 1500, 3000, 5000, 7000):
                with self.subTest(cut=cut), Cut(daemon.path, cut) as proxy:
                    with farlight.connect(proxy.address, retry_for=60) as client:
                        self.assertEqual(self.frames(client), undisturbed)
                with self.subTest(cut=cut, client="asyncio"), Cut(daemon.path, cut) as proxy:
                    self.assertEqual(asyncio.run(self.frames_async(proxy.address)), undisturbed)
            with Cut(daemon.path, 400) as proxy, self.assertRaises(farlight.ConnectionLost) as raised:
                with farlight.connect(proxy.address) as client:
                    self.frames(client)
            self.assertTrue(raised.exception.retryable)

    @long_test
    def test_connections_that_are_cut_in_an_upload_or_sealed_lose_no_frame_either(self):
        self.expect(farlight_test.farlight("key", self.folder / "key"), 0)
        self.expect(farlight_test.farlight("key", self.folder / "reader"), 0)
        with SealedDaemon(self.folder, "--listen", f"unix:{self.folder}/s") as daemon:
            with farlight.connect(f"unix:{self.folder}/s") as client:
                undisturbed = self.frames(client)
            plain, sealed = f"{self.folder}/s", ("127.0.0.1", daemon.port)
            # Of a client: its greeting, the offer, the blob of 36 bytes, edits, the job. Sealed: hello, proof, first record.
            for place, of_client, cuts, options in ((plain, True, (0, 20, 100, 200, 260, 330, 500, 900), {}),
                                                    (sealed, True, (0, 71, 72, 130, 136, 200, 700, 1300), {"key_file": self.folder / "key"}),
                                                    (sealed, False, (0, 71, 72, 135, 136, 150, 900, 3500), {"key_file": self.folder / "key"})):
                for cut in cuts:
                    with self.subTest(place=place, of_client=of_client, cut=cut), CutOf(place, cut, of_client) as relay:
                        with farlight.connect(relay.address, retry_for=60, **options) as client:
                            self.assertEqual(self.frames(client), undisturbed)

    @staticmethod
    async def frames_async(address):
        scene, _ = triangle()
        async with await farlight.aio.connect(address, retry_for=60) as client:
            return [picture.data async for picture in client.frames(
                scene, [STRAIGHT, farlight.Camera((0, 3, 5), time_s=1)], width=16, height=12, frames_per_second=3, last_frame=3)]

    def test_a_killed_daemon_of_ones_own_is_started_again(self):
        os.environ.pop("FARLIGHT_SERVER", None)
        with farlight.connect(retry_for=60) as client:
            scene, _ = triangle()
            numbers = []
            for picture in client.frames(scene, STRAIGHT, width=8, height=8, last_frame=5):
                numbers.append(picture.number)
                if picture.number == 2:
                    client._link.process.kill()  # pylint: disable=protected-access
            self.assertEqual(numbers, [0, 1, 2, 3, 4, 5])
            process = client._link.process  # pylint: disable=protected-access
        self.assertEqual(process.poll(), 0)

    @long_test
    def test_a_kept_scene_outlives_the_connection_and_is_not_sent_again(self):
        with Daemon() as daemon, farlight.connect(daemon.address) as client:
            scene, material = triangle()
            kept = farlight.Scene("python-kept", "kept")
            for edit in scene.edits_since(0):
                for blob in getattr(edit, "arrays", ()):
                    kept.blob(scene.blob_bytes(blob))
                kept.set(edit)
            before = client.render(kept, STRAIGHT, width=8, height=8)
            client._link.socket.shutdown(socket.SHUT_RDWR)  # pylint: disable=protected-access
            after = client.render(kept, STRAIGHT, width=8, height=8)
            self.assertEqual((after.data, after.begin.revision), (before.data, before.begin.revision))
            self.assertEqual(client._core._uploaded, 0)  # pylint: disable=protected-access
            kept.change(material, roughness=0.7)
            self.assertEqual(client.send(kept), 2)

    @long_test
    def test_a_client_that_was_idle_too_long_connects_again_by_itself(self):
        (self.folder / "conf").write_text("[network]\nidle = 1000\n")
        with Daemon("--config", self.folder / "conf") as daemon, farlight.connect(daemon.address) as client:
            scene, _ = triangle()
            before = client.render(scene, STRAIGHT, width=8, height=8)
            time.sleep(2.2)
            self.assertEqual(client.render(scene, STRAIGHT, width=8, height=8).data, before.data)

    @long_test
    def test_a_sealed_connection_makes_the_same_picture_and_wrong_keys_say_so(self):
        for name in ("key", "reader", "other"):
            self.expect(farlight_test.farlight("key", self.folder / name), 0)
        scene, _ = triangle()
        with SealedDaemon(self.folder, "--listen", f"unix:{self.folder}/s") as daemon:
            with farlight.connect(daemon.reached, key_file=self.folder / "key") as client:
                sealed = client.render(scene, STRAIGHT, width=64, height=48)
            with farlight.connect(f"unix:{self.folder}/s") as client:
                self.assertEqual(client.render(scene, STRAIGHT, width=64, height=48).data, sealed.data)
            with self.assertRaises(farlight.Refused) as raised:
                farlight.connect(daemon.reached, key_file=self.folder / "other")
            self.assertIn("another key", str(raised.exception))
            with self.assertRaises(farlight.Refused) as raised:
                farlight.connect(daemon.reached)
            self.assertIn("key_file", raised.exception.remedy)
            self.expect(python("-m", "farlight", "render", bundled_scenes() / "sphereflake-2.nff", "-o", self.folder / "a.png", "--size", "8x8",
                               "--server", daemon.reached, "--key", self.folder / "key"), 0)
            with Changed(daemon.port) as proxy, self.assertRaises(farlight.ProtocolError) as raised:
                with farlight.connect(proxy.address, key_file=self.folder / "key") as client:
                    client.render(scene, STRAIGHT, width=64, height=48)
            self.assertIn("changed", str(raised.exception))
        (self.folder / "key").chmod(0o644)
        with self.assertRaises(farlight.FileFailed) as raised:
            farlight.connect("tcp:127.0.0.1:9", key_file=self.folder / "key")
        self.assertIn("chmod 600", raised.exception.remedy)


class CutOf(Cut):
    """Ends the first connection to a Unix or TCP socket after so many bytes of the client's or the daemon's."""

    def __init__(self, place, count, of_client):
        super().__init__(place, count)
        self.of_client = of_client

    def serve(self):
        left = self.count
        while True:
            try:
                client = self.listener.accept()[0]
            except OSError:
                return
            family = socket.AF_INET if isinstance(self.path, tuple) else socket.AF_UNIX
            with contextlib.suppress(OSError), client, socket.socket(family) as daemon:
                daemon.connect(self.path)
                # relay() counts what its second argument sends.
                self.relay(*((daemon, client) if self.of_client else (client, daemon)), left)
            left = None


class Changed(CutOf):
    """Changes a byte of the daemon's on the way."""

    def __init__(self, port):
        super().__init__(("127.0.0.1", port), None, False)

    @staticmethod
    def relay(client, daemon, left):
        came = 0
        while True:
            for one in select.select([client, daemon], [], [])[0]:
                data = bytearray(one.recv(65536))
                if not data:
                    return
                if one is daemon:
                    if came <= 3000 < came + len(data):
                        data[3000 - came] ^= 1
                    came += len(data)
                (daemon if one is client else client).sendall(data)


if __name__ == "__main__":
    farlight_test.unittest.main()
