# SPDX-License-Identifier: MIT
"""That protocol.md is enough to write a client: one that was written from it puts up a scene, renders and looks on, and
the session that the document writes out byte by byte is what a daemon really says."""
import ctypes
import json
import math
import re
import socket
import struct

import farlight_test
import tiny_client
from farlight_test import Case, Daemon, farlight, frames_of
from tiny_client import BATCH, CANCELLED, SHARED, VIEW, Client

STRAIGHT = ((0, 0, 5), (0, 0, 0), (0, 1, 0), 0.8)
ABOVE, LEFT = ((0, 1, 5), (0, 0, 0), (0, 1, 0), 0.8), ((-1, 1, 5), (0, 0, 0), (0, 1, 0), 0.8)
JPEG = 2  # encoding
COLOURS, DEPTH, NORMALS, COARSE_DEPTH = 0, 1, 2, 3  # frame_part_kind
GRID = 300  # 90,601 vertices: positions of more than a megabyte


def srgb(linear):
    return 255 * (12.92 * linear if linear <= 0.0031308 else 1.055 * linear**(1 / 2.4) - 0.055)


def grid():
    """A wavy sheet of many triangles: blobs of several chunks and pieces."""
    points = [((i % (GRID + 1)) * 4 / GRID - 2, (i // (GRID + 1)) * 4 / GRID - 2) for i in range((GRID + 1)**2)]
    positions = struct.pack(f"<{3 * len(points)}f",
                            *[v for x, y in points for v in (x, y, math.sin(3 * x) * math.cos(2 * y) / 4)])
    corners = [first + step for row in range(GRID) for column in range(GRID) for first in [row * (GRID + 1) + column]
               for step in (0, 1, GRID + 2, 0, GRID + 2, GRID + 1)]
    return positions, struct.pack(f"<{len(corners)}I", *corners)


def grid_scene():
    blobs = list(grid())
    edits = [tiny_client.set_material(1, (0.7, 0.5, 0.3)),
             tiny_client.set_mesh(1, (GRID + 1)**2, 2 * GRID**2, blobs, 1),
             tiny_client.set_node(1, tiny_client.NODE_MESH, 1),
             tiny_client.set_light(1, tiny_client.DIRECTIONAL, (3, 3, 3)),
             tiny_client.set_node(2, tiny_client.NODE_LIGHT, 1)]
    return blobs, edits


def document():
    return (farlight_test.BIN / "protocol.md").read_text()


def unpack_zstd(data, size):
    library = ctypes.CDLL("libzstd.so.1")
    library.ZSTD_decompress.restype = ctypes.c_size_t
    unpacked = ctypes.create_string_buffer(size)
    made = library.ZSTD_decompress(unpacked, ctypes.c_size_t(size), data, ctypes.c_size_t(len(data)))
    assert made == size, made
    return unpacked.raw


def restore_predicted(data, width, height, pixel_bytes):
    """The planes of bytes."""
    stored, plane = unpack_zstd(data, width * height * pixel_bytes), width * height
    planes = []
    for b in range(pixel_bytes):
        out = bytearray(plane)
        for i in range(plane):
            left = out[i - 1] if i % width else 0
            above = out[i - width] if i >= width else 0
            corner = out[i - width - 1] if i % width and i >= width else 0
            low, high = min(left, above), max(left, above)
            guess = low if corner >= high else high if corner <= low else left + above - corner
            out[i] = (stored[b * plane + i] + guess) % 256
        planes.append(out)
    return planes


def restore_coarse_depth(data, width, height):
    """The numbers of all pixels, and by how much none of them is off."""
    off, = struct.unpack_from("<H", data)
    across, down = (width + 7) // 8, (height + 7) // 8
    low, high = restore_predicted(data[2:], across, down, 2)
    squares = [a + 256 * b for a, b in zip(low, high)]
    numbers = []
    for y in range(height):
        j, v = (y + 4) // 8, 2 * ((y + 4) % 8) + 1
        rows = [max(j - 1, 0) * across, min(j, down - 1) * across]
        for x in range(width):
            i, u = (x + 4) // 8, 2 * ((x + 4) % 8) + 1
            columns = max(i - 1, 0), min(i, across - 1)
            a, b, c, d = (squares[row + column] for row in rows for column in columns)
            if (max(a, b, c, d) - min(a, b, c, d)) * 8 <= max(a, b, c, d):
                numbers.append(((a * (16 - v) + c * v) * (16 - u) + (b * (16 - v) + d * v) * u + 128) // 256)
            else:
                numbers.append(squares[y // 8 * across + x // 8])
    return numbers, off


def decode_jpeg(data, width, height):
    library = ctypes.CDLL("libturbojpeg.so.0")
    library.tjInitDecompress.restype = ctypes.c_void_p
    pixels, decoder = ctypes.create_string_buffer(3 * width * height), ctypes.c_void_p(library.tjInitDecompress())
    stop_on_warning = 8192
    failed = library.tjDecompress2(decoder, data, ctypes.c_ulong(len(data)), pixels, width, 0, height, 0, stop_on_warning)
    library.tjDestroy(decoder)
    assert not failed
    return pixels.raw


class Document(Case):
    """The session at the end of protocol.md."""

    def steps(self):
        """(what, bytes) of each step."""
        text = document()
        session = text[text.index("## A session, byte by byte"):]
        found = re.findall(r"^([^\n]+):\n\n```\n([^`]*)```$", session, re.M)
        self.assertGreater(len(found), 20)
        return [(what, bytes.fromhex(shown)) for what, shown in found]

    @staticmethod
    def message(connection):
        head = connection.recv(16, socket.MSG_WAITALL)
        size, = struct.unpack_from("<I", head)
        return head + connection.recv(size + -size % 8, socket.MSG_WAITALL)

    def compare(self, what, came, shown):
        if "`credit`" in what:  # the total is the daemon's to choose
            came, shown = came[:22], shown[:22]
        elif "`frame_begin`" in what:  # digest, and when it was taken up and read back
            for start, end in ((154, 170), (50, 58)):
                came = came[:16 + start] + came[16 + end:]
                shown = shown[:16 + start] + shown[16 + end:]
        elif "`frame_data`" in what:
            self.assertEqual(came[:32], shown[:32])
            for a, b in zip(came[32:], shown[32:]):
                self.assertLessEqual(abs(a - b), 1, f"{came[32:].hex(' ')} is not {shown[32:].hex(' ')}")
            return
        self.assertEqual(came.hex(" "), shown.hex(" "), what)

    def test_a_daemon_answers_the_documents_bytes_as_the_document_says(self):
        with Daemon() as daemon, socket.socket(socket.AF_UNIX) as connection:
            connection.settimeout(240)
            connection.connect(daemon.path)
            kinds = set()
            for what, shown in self.steps():
                kinds.add(what.split(",")[0].split(" ")[0])
                if what.startswith("Client"):
                    connection.sendall(shown)
                    if "hello" in what:
                        self.take_reply(connection)
                    continue
                came = self.message(connection)
                if "`ok`" in what and came[4:6] == b"\x12\x02":
                    came = self.message(connection)  # frame_end is not written out
                self.compare(what, came, shown)
            self.assertEqual(kinds, {"Client", "Daemon"})
            self.assertEqual(connection.recv(1), b"")

    def take_reply(self, connection):
        reply = connection.recv(48, socket.MSG_WAITALL)
        self.assertEqual(reply[:6], b"FARL\2\0")
        limits_bytes, = struct.unpack_from("<H", reply, 6)
        reply += connection.recv(limits_bytes, socket.MSG_WAITALL)
        for _ in range(2):
            length = connection.recv(1, socket.MSG_WAITALL)
            reply += length + connection.recv(length[0], socket.MSG_WAITALL)
        connection.recv(-len(reply) % 8, socket.MSG_WAITALL)

    def test_the_client_sends_what_the_document_shows(self):
        sent = b"".join(shown for what, shown in self.steps() if what.startswith("Client"))
        blobs, edits = tiny_client.triangle()
        for blob in blobs:
            self.assertIn(tiny_client.blob_reference(blob), sent)
        for _, body in edits:
            self.assertIn(body, sent)


class Session(Case):
    """One daemon for all."""

    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()
        cls.daemon.__enter__()
        cls.addClassCleanup(cls.daemon.__exit__)

    def connect(self, scene=None, sharing=tiny_client.PRIVATE, name="", **options):
        client = Client(self.daemon.path, **options)
        self.addCleanup(client.socket.close)
        if scene:
            blobs, edits = scene
            client.open_scene(1, name, sharing)
            client.upload(blobs)
            self.assertEqual(client.commit(1, edits), 1)
        return client

    def test_a_frame_has_the_requested_size_and_revision(self):
        client = self.connect(tiny_client.triangle())
        job = client.render(1, 2, (31, 17), ABOVE)
        frame = client.next_frame()
        client.wait(job)
        self.assertEqual((frame.width, frame.height, frame.samples, frame.revision), (31, 17, 1, 1))
        self.assertEqual(len(frame.pixels), 31 * 17 * 4)
        self.assertEqual(client.say_goodbye(), b"")

    def test_pixels_are_where_and_what_they_have_to_be(self):
        """A square that is not lit, 1 m wide and 2 m high, in the right half of what is seen at its distance.
        A light, so that there is no sky."""
        blobs = [struct.pack("<12f", 0, -1, 0, 1, -1, 0, 1, 1, 0, 0, 1, 0), struct.pack("<6I", 0, 1, 2, 0, 2, 3)]
        linear = (0.5, 0.25, 0.05)  # below what the tone map bends
        edits = [tiny_client.set_material(1, linear, unlit=1), tiny_client.set_mesh(1, 4, 2, blobs, 1),
                 tiny_client.set_node(1, tiny_client.NODE_MESH, 1),
                 tiny_client.set_light(1, tiny_client.DIRECTIONAL, (1, 1, 1)),
                 tiny_client.set_node(2, tiny_client.NODE_LIGHT, 1)]
        client = self.connect((blobs, edits))
        camera = ((0, 0, 2), (0, 0, 0), (0, 1, 0), 2 * math.atan(0.5))  # 2 m high at 2 m
        client.wait(client.render(1, 2, (16, 16), camera))
        frame = client.next_frame()
        # Khronos PBR neutral takes away an offset that the minimum of the three channels gives.
        minimum = min(linear)
        offset = minimum - 6.25 * minimum**2 if minimum < 0.08 else 0.04
        for y in range(16):
            for x in range(16):
                pixel = frame.pixels[4 * (16 * y + x):4 * (16 * y + x) + 4]
                self.assertEqual(pixel[3], 255 if x >= 8 else 0, (x, y))
                for got, channel in zip(pixel, linear):
                    self.assertAlmostEqual(got, srgb(channel - offset) if x >= 8 else 0, delta=1, msg=f"{x} {y}")

    def test_the_picture_is_that_of_farlights_own_client(self):
        client = self.connect(grid_scene(), SHARED, "sheet")
        client.wait(client.render(1, 2, (160, 120), ABOVE))
        digest = client.next_frame().digest
        result = self.expect(farlight("render", "--scene", "sheet", "--server", self.daemon.address, "--size", "160x120",
                                      "--samples", "1", "--primary", "raster", "--eye", "0,1,5", "--look-at", "0,0,0", "--fov", math.degrees(0.8),
                                      "-o", self.folder / "a.png", "--timings=json"), 0)
        self.assertEqual(int(frames_of(result)[0]["digest"], 16), digest)

    def test_the_picture_is_that_of_the_same_model_in_a_file(self):
        blobs, edits = tiny_client.triangle()
        (self.folder / "triangle.bin").write_bytes(b"".join(blobs))
        (self.folder / "triangle.gltf").write_text(json.dumps(gltf_triangle()))
        client = self.connect((blobs, edits))
        client.wait(client.render(1, 2, (40, 30), ABOVE))
        digest = client.next_frame().digest
        result = self.expect(farlight("render", self.folder / "triangle.gltf", "--size", "40x30", "--samples", "1", "--eye", "0,1,5",
                                      "--look-at", "0,0,0", "--fov", math.degrees(0.8), "-o", self.folder / "a.png",
                                      "--server", self.daemon.address, "--studio", "off", "--timings=json"), 0)
        self.assertEqual(int(frames_of(result)[0]["digest"], 16), digest)

    def test_a_view_shows_the_requested_camera_and_ends(self):
        client = self.connect(tiny_client.triangle())
        view = client.render(1, 2, (32, 24), ABOVE, kind=VIEW, samples=4, credit=2)
        first = client.next_frame()
        self.assertEqual((first.command, first.width, first.height), (0, 32, 24))
        client.look(2, 5, LEFT)
        credit = 2
        frame = first
        while frame.command != 5 or frame.samples != 4:
            credit += 1
            client.raise_credit(2, credit)
            frame = client.next_frame()
            self.assertIn(frame.command, (0, 5))
        self.assertEqual(frame.request, view)
        ended = client.cancel(view)
        self.assertEqual(ended.code, CANCELLED)
        # The same again, as a batch: the channel is free, and the scene is there.
        client.wait(client.render(1, 2, (32, 24), LEFT, kind=BATCH))
        self.assertEqual(client.frames[-1].command, 0)
        self.assertEqual(client.say_goodbye(), b"")

    def test_inverse_depths_are_what_the_document_says(self):
        """The triangle is the plane z = 0, seen by cameras at z = 5: 1 / depth of a pixel follows from its ray."""
        client, (width, height) = self.connect(tiny_client.triangle()), (32, 24)
        fixed = farlight_test.fixed_part("render", scene=1, kind=VIEW, channel=2, width=width, height=height, attachments=1, depth_form=1,
                           depth_pixels=0.5, depth_radius=0.2, margin=0.25, camera_path=tiny_client.CAMERA_PATH_KEYS, credit=9)
        client.acknowledged.add(2)
        client.ask(tiny_client.RENDER, tiny_client.payload(
            fixed, tiny_client.array([struct.pack("<f", 0) + tiny_client.camera_bytes(ABOVE)]), tiny_client.array([])))
        client.next_frame()
        client.look(2, 1, LEFT, moving=True)
        frame = client.next_frame()
        while frame.command != 1:
            frame = client.next_frame()
        begin = {name: struct.unpack_from("<" + letter, frame.fixed, offset - 2)[0]
                 for name, (offset, letter, _) in farlight_test.protocol_fields("frame_begin").items()}
        self.assertEqual((begin["margin_x"], begin["margin_y"], frame.width, frame.height), (8, 6, 48, 36))
        focal = height / (2 * math.tan(LEFT[3] / 2))
        self.assertAlmostEqual(frame.height / (2 * math.tan(begin["fov_y"] / 2)), focal, delta=1e-4)
        self.assertAlmostEqual(begin["depth_step"], 2 * 0.5 / (focal * 0.2), delta=1e-6)
        low, high = restore_predicted(bytes(frame.pixels[frame.size_bytes:]), frame.width, frame.height, 2)
        eye = LEFT[0]
        forward = [-v / math.dist(eye, (0, 0, 0)) for v in eye]
        right = [-forward[2], 0, forward[0]]
        right = [v / math.hypot(*right) for v in right]
        up = [right[1] * forward[2] - right[2] * forward[1], right[2] * forward[0] - right[0] * forward[2],
              right[0] * forward[1] - right[1] * forward[0]]
        seen = 0
        for y in range(frame.height):
            for x in range(frame.width):
                across, over = (x + 0.5 - frame.width / 2) / focal, (frame.height / 2 - y - 0.5) / focal
                ray = [f + across * r + over * u for f, r, u in zip(forward, right, up)]
                inverse = -ray[2] / eye[2]  # of the depth along `forward`
                place = [e + v / inverse for e, v in zip(eye, ray)]
                inside = min(place[0] + 1, place[1] + 1, 2 - place[0] - place[1])
                if abs(inside) < 0.3:  # a pixel is some 0.2 m wide, and its sample may be off the middle
                    continue
                number = low[y * frame.width + x] + 256 * high[y * frame.width + x]
                if inside < 0:
                    self.assertEqual(number, 0)
                    continue
                seen += 1
                # Samples lie within half a pixel of the middle; 1 / depth is linear over the picture.
                slack = (abs(right[2]) + abs(up[2])) / focal / eye[2] / 2
                self.assertLess(abs(number * begin["depth_step"] - inverse), begin["depth_step"] / 2 + slack + 1e-6)
        self.assertGreater(seen, 100)

    def test_every_prefix_of_parts_is_what_the_document_says(self):
        """The link seems to take long for each frame, so that they come in parts."""
        client, (width, height) = self.connect(grid_scene()), (96, 64)
        fixed = farlight_test.fixed_part("render", scene=1, kind=VIEW, channel=2, width=width, height=height, encoding=JPEG, quality=75,
                           still_encoding=JPEG, attachments=3, depth_form=1, depth_pixels=0.5, depth_radius=0.2, parts=1,
                           camera_path=tiny_client.CAMERA_PATH_KEYS, credit=99)
        client.acknowledged.add(2)
        client.takes_s = 0.1
        client.ask(tiny_client.RENDER, tiny_client.payload(
            fixed, tiny_client.array([struct.pack("<f", 0) + tiny_client.camera_bytes(ABOVE)]), tiny_client.array([])))
        frame = client.next_frame()
        self.assertEqual(frame.parts, [])  # nothing is known of the link
        for command in range(1, 20):
            client.look(2, command, (LEFT, ABOVE)[command % 2], moving=True)
            frame = client.next_frame()
            if frame.parts and not frame.abandoned:
                break
        self.assertEqual([kind for kind, _ in frame.parts], [COLOURS, COARSE_DEPTH, COLOURS, DEPTH, COLOURS, NORMALS])
        came = {}
        prefixes = []
        at = 0
        for kind, size in frame.parts:
            came[kind] = came.get(kind, b"") + bytes(frame.pixels[at:at + size])
            at += size
            prefixes.append(dict(came))
        self.assertEqual(len(came[COLOURS]), frame.size_bytes)
        self.assertEqual(len(came[DEPTH]) + len(came[NORMALS]), frame.attached_bytes)
        low, high = restore_predicted(came[DEPTH], width, height, 2)
        depth = [a + 256 * b for a, b in zip(low, high)]
        coarse, off = restore_coarse_depth(came[COARSE_DEPTH], width, height)
        self.assertEqual(max(abs(a - b) for a, b in zip(coarse, depth)), off)
        picture = decode_jpeg(came[COLOURS], width, height)
        before = None
        for prefix in prefixes:
            is_all = len(prefix[COLOURS]) == frame.size_bytes
            colours = decode_jpeg(prefix[COLOURS] + (b"" if is_all else b"\xff\xd9"), width, height)
            error = sum((a - b)**2 for a, b in zip(colours, picture))
            self.assertLessEqual(error, error if before is None else before)
            before = error
        self.assertEqual(before, 0)

    def test_what_sticks_is_what_the_document_says(self):
        """The triangle as a mirror, and as what scatters all light. Blocks at its edges, or a pixel off, are left out."""
        for metallic, roughness, inside in ((1, 0, 7), (1, 1, 0), (0, 1, 0)):
            blobs, edits = tiny_client.triangle()
            mirror = tiny_client.set_material(1, (0.9, 0.9, 0.9), metallic=metallic, roughness=roughness)
            client, (width, height) = self.connect((blobs, [mirror] + edits[1:])), (30, 21)
            fixed = farlight_test.fixed_part("render", scene=1, kind=VIEW, channel=2, width=width, height=height, attachments=4,
                               camera_path=tiny_client.CAMERA_PATH_KEYS, credit=1)
            client.acknowledged.add(2)
            client.ask(tiny_client.RENDER, tiny_client.payload(
                fixed, tiny_client.array([struct.pack("<f", 0) + tiny_client.camera_bytes(STRAIGHT)]), tiny_client.array([])))
            frame = client.next_frame()
            begin = {name: struct.unpack_from("<" + letter, frame.fixed, offset - 2)[0]
                     for name, (offset, letter, _) in farlight_test.protocol_fields("frame_begin").items()}
            across, down = -(-width // 4), -(-height // 4)
            packed = bytes(frame.pixels[frame.size_bytes:])
            self.assertEqual((begin["attachments"], begin["sticking_bytes"]), (4, len(packed)))
            blocks = unpack_zstd(packed, across * down)
            pixel = 5 * 2 * math.tan(STRAIGHT[3] / 2) / height  # metres, at the triangle
            seen = set()
            for i, share in enumerate(blocks):
                left, top = i % across * 4 - 1, i // across * 4 - 1
                points = [((x - width / 2) * pixel, (height / 2 - y) * pixel) for x in range(left, left + 7)
                          for y in range(top, top + 7)]
                insides = {min(x + 1, y + 1, 2 - x - y) > 0 for x, y in points}
                if len(insides) == 1:
                    self.assertEqual(share, inside if True in insides else 0, i)
                    seen |= insides
            self.assertEqual(seen, {True, False})

    def test_blobs_that_are_there_are_not_sent_again(self):
        client = self.connect(grid_scene())
        self.assertEqual(client.upload(list(grid())), 0)

    def test_another_attached_client_hears_of_changes(self):
        watcher, editor = Client(self.daemon.path), self.connect(tiny_client.triangle(), SHARED, "watched")
        self.addCleanup(watcher.socket.close)
        attached = watcher.ask(0x0103, tiny_client.payload(struct.pack("<I", 7), tiny_client.string("watched")))
        self.assertEqual(watcher.revision(attached), 1)
        self.assertEqual(editor.commit(1, [tiny_client.set_material(1, (0.1, 0.2, 0.3))]), 2)
        while not watcher.changes:
            watcher.receive()
        self.assertEqual(watcher.changes, [(7, 2)])

    def test_an_error_ends_its_request_alone(self):
        client = self.connect(tiny_client.triangle())
        with self.assertRaises(tiny_client.Failed) as raised:
            client.wait(client.render(9, 2, (8, 8), ABOVE))
        self.assertEqual(raised.exception.field, "render.scene")
        client.wait(client.render(1, 2, (8, 8), ABOVE))


def gltf_triangle():
    """The same objects in glTF's words; the importer takes its lux for W/m2."""
    return {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "directional", "intensity": 3.1415927}]}},
        "nodes": [{"mesh": 0}, {"extensions": {"KHR_lights_punctual": {"light": 0}}}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.4, 0.2, 1], "metallicFactor": 0,
                                                "roughnessFactor": 1}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "buffers": [{"uri": "triangle.bin", "byteLength": 48}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 12}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-1, -1, 0],
                       "max": [3, 3, 0]},
                      {"bufferView": 1, "componentType": 5125, "count": 3, "type": "SCALAR"}],
    }
