# SPDX-License-Identifier: MIT
"""What the clients of a soak do: they come and go in every way, put up scenes, edit them and look at them. By chance, but
each run the same."""
import array
import dataclasses
import math
import random
import re
import socket
import struct

import farlight_test
import tiny_client
from farlight_test import fixed_part
from tiny_client import BATCH, KEPT, PRIVATE, SHARED, VIEW, Client

SIZE = (32, 24)  # of a frame, pixels: what a frame costs beside its pixels is what may leak
RAW, ZSTD, JPEG, H264, PREDICTED = range(5)
BVH, NAIVE, REFERENCE, LDC, ABUFFER = range(5)  # tracers
WHITTED, DISTRIBUTED, RAYCAST, AO, PATH = range(5)  # integrators
CAN_H264 = 1
SCENE_CLOSE, SCENE_ATTACH, SET_SPHERES, SET_TEXTURE, REMOVE = 0x0102, 0x0103, 0x0132, 0x0135, 0x013f
NODE_SPHERES = 2
EYE, UP, FOV_Y = (0, 1, 5), (0, 1, 0), 0.8
SAMPLES = 4  # of a view that rests
TEXELS = 16  # along an edge of a texture
# Structures of a few cells, built at once.
LDC_RESOLUTION, ABUFFER_RESOLUTION, ABUFFER_VOXELS = 32, 32, 16


@dataclasses.dataclass
class Mix:
    """What a round consists of; its parts take turns, so that after `cycle` rounds all have had theirs. A round is one
    upload, and:"""
    connects: int = 10
    frames: int = 100
    cycle: int = 20
    sides: tuple = (1, 8, 8, 30, 8, 30, 1, 60, 8, 120)  # of the uploaded sheets, in squares; the last has several pieces
    tracers: tuple = (BVH, LDC, ABUFFER, REFERENCE)
    integrators: tuple = (WHITTED, DISTRIBUTED, RAYCAST, AO, PATH)


# Without what takes seconds to compile, in software, when it is first used.
SHORT = Mix(frames=25, cycle=1, sides=(1, 8, 30), tracers=(BVH,), integrators=(WHITTED,))


def sheet(side, unique):
    """A wavy square of 2 * side * side triangles; `unique` sets its blobs apart from all others."""
    row = side + 1
    positions = array.array("f")
    for i in range(row * row):
        x, y = (i % row) * 4 / side - 2, (i // row) * 4 / side - 2
        positions.extend((x, y, math.sin(3 * x) * math.cos(2 * y) / 4))
    positions[2] += unique * 1e-4
    corners = array.array("I", [first + step for line in range(side) for column in range(side)
                                for first in [line * row + column] for step in (0, 1, row + 1, 0, row + 1, row)])
    corners[0:3] = array.array("I", [corners[unique % 3], corners[(unique + 1) % 3], corners[(unique + 2) % 3]])
    return positions.tobytes(), corners.tobytes()


def scene_of(side, unique):
    """Blobs and edits: a textured sheet, a sphere and a light."""
    positions, corners = sheet(side, unique)
    texels = struct.pack("<I", unique) * (TEXELS * TEXELS)
    sphere = struct.pack("<4f", 0, 0, 1, 0.5 + unique * 1e-5)
    references = [tiny_client.blob_reference(blob) for blob in (texels, sphere)]
    payload, array_of, string = tiny_client.payload, tiny_client.array, tiny_client.string
    first = struct.pack("<I", 1)
    edits = [
        (SET_TEXTURE, payload(first + tiny_client.record(struct.pack("<6I", TEXELS, TEXELS, 0, 0, 0, 0)), array_of(references[:1]),
                              string(""))),
        tiny_client.set_material(1, (0.7, 0.5, 0.3)),
        tiny_client.set_mesh(1, (side + 1)**2, 2 * side**2, [positions, corners], 1),
        (SET_SPHERES, payload(first + tiny_client.record(first), array_of(references[1:]),
                              array_of([struct.pack("<3I", 0, 1, 1)]), string(""))),
        tiny_client.set_node(1, tiny_client.NODE_MESH, 1),
        tiny_client.set_light(1, tiny_client.DIRECTIONAL, (3, 3, 3)),
        tiny_client.set_node(2, tiny_client.NODE_LIGHT, 1),
        tiny_client.set_node(3, NODE_SPHERES, 1),
    ]
    return [positions, corners, texels, sphere], edits


def moved(node, kind, thing, by):
    """An edit: what hangs at a node is elsewhere."""
    return tiny_client.set_node(node, kind, thing, (1, 0, 0, by, 0, 1, 0, 0, 0, 0, 1, 0))


def eye_at(angle):
    return (5 * math.sin(angle), 1, 5 * math.cos(angle)), (0, 0, 0), UP, FOV_Y


class Soak:
    """The clients of one daemon. `unix` and `tcp`: where it listens."""

    def __init__(self, unix, tcp, mix, chance=1):
        self.unix, self.tcp, self.mix = unix, tcp, mix
        self.random = random.Random(chance)
        self.connects = self.uploads = self.frames = 0
        self.resident, self.resident_edits = None, 0

    # ---- who comes and goes

    def connect(self, **options):
        self.connects += 1
        return Client(self.tcp if self.random.random() < 0.2 else self.unix, capabilities=CAN_H264, **options)

    def bare(self, data, close=False):
        """Bytes of a connection that ends then, without a word or once the daemon has closed it."""
        self.connects += 1
        tcp = self.random.random() < 0.3
        with socket.socket(socket.AF_INET if tcp else socket.AF_UNIX) as connection:
            connection.settimeout(60)
            connection.connect(self.tcp if tcp else self.unix)
            connection.sendall(data)
            try:
                while close and connection.recv(4096):
                    pass
            except ConnectionResetError:
                pass  # it has closed before it had read all

    @staticmethod
    def hello(lowest=2, highest=2, name=b"soak"):
        data = b"FARL" + struct.pack("<2HQ16sB", lowest, highest, 0, bytes(16), len(name)) + name
        return data + bytes(-len(data) % 8)

    def come_and_go(self, way):
        """One connection; `way` counts up."""
        chance = self.random
        if way % 8 < 2:
            self.connect().say_goodbye()
        elif way % 8 == 2:  # cut in the middle of the introduction
            self.bare(self.hello()[:chance.randrange(len(self.hello()))])
        elif way % 8 == 3:
            self.bare(self.hello(7, 9), close=True)
        elif way % 8 == 4:  # of something else
            self.bare(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n" + chance.randbytes(chance.randrange(64)), close=True)
        elif way % 8 == 5:  # cut in the middle of a message
            client = self.connect()
            whole = struct.pack("<I2H2I", 10, tiny_client.PING, 0, 1, 0) + tiny_client.payload(bytes(8))
            client.socket.sendall(whole[:chance.randrange(1, len(whole))])
            client.socket.close()
        elif way % 8 == 6:  # what no message is
            client = self.connect()
            client.socket.sendall(struct.pack("<I2H2I", 8, 0x0fff, 0, 1, 0) + bytes(8))
            try:
                while client.socket.recv(4096):
                    pass
            except ConnectionResetError:
                pass
            client.socket.close()
        else:  # gone with its answer on the way
            client = self.connect()
            client.ask(tiny_client.PING, tiny_client.payload(bytes(8)))
            client.socket.close()

    # ---- who looks

    def tracer(self, number):
        return self.mix.tracers[number % len(self.mix.tracers)]

    def integrator(self, number):
        return self.mix.integrators[number % len(self.mix.integrators)]

    def render(self, client, kind, channel, **options):
        """As of the message render; the rest has the values that cost least."""
        fields = dict(tracer=BVH, integrator=WHITTED, encoding=ZSTD, still=PREDICTED, attachments=0, credit=8, frames=1,
                      samples=1)
        fields.update(options)
        one = fields.__getitem__
        if kind == VIEW:
            client.acknowledged.add(channel)
        quality = 80 if one("encoding") in (JPEG, H264) else 1
        fixed = fixed_part("render", scene=1, kind=kind, channel=channel, still_encoding=one("still"),
                           attachments=one("attachments"), credit=one("credit"), width=SIZE[0], height=SIZE[1],
                           samples=one("samples"), depth=2, seed=1, last_frame=one("frames") - 1, frames_per_second=1000,
                           tracer=one("tracer"), integrator=one("integrator"), primary=int(one("tracer") != BVH),
                           encoding=one("encoding"), quality=quality, camera_path=tiny_client.CAMERA_PATH_KEYS,
                           ldc_resolution=LDC_RESOLUTION, abuffer_resolution=ABUFFER_RESOLUTION,
                           abuffer_voxels=ABUFFER_VOXELS)
        turn = math.pi * self.random.random()
        keys = [struct.pack("<f", i / 100) + tiny_client.camera_bytes(eye_at(turn + i / 10)) for i in range(10)]
        keys = tiny_client.array(keys[:1 if kind == VIEW else 10])
        return client.ask(tiny_client.RENDER, tiny_client.payload(fixed, keys, tiny_client.array([])))

    def take(self, client, channel, credit, job):
        frame = client.next_frame(job)
        self.frames += 1
        client.raise_credit(channel, credit)
        return frame

    def batch(self, client, channel, frames, **options):
        job = self.render(client, BATCH, channel, frames=frames, **options)
        for i in range(frames):
            self.take(client, channel, 8 + i + 1, job)
        client.wait(job)

    def view(self, client, channel, frames, **options):
        """Follows the camera, a command for each picture, and rests until the last one has all its samples."""
        job = self.render(client, VIEW, channel, samples=SAMPLES, **options)
        for i in range(frames):
            client.look(channel, i + 1, eye_at(i / 7), moving=True)
            self.take(client, channel, 8 + i + 1, job)
        client.look(channel, frames + 1, eye_at(0))
        credit = 8 + frames
        while True:
            credit += 1
            frame = self.take(client, channel, credit, job)
            if (frame.command, frame.samples) == (frames + 1, SAMPLES):
                break
        try:
            assert client.cancel(job).code == tiny_client.CANCELLED
        finally:
            client.frames.clear()

    # ---- who puts something up

    def put_up(self, client, number, sharing):
        side = self.mix.sides[number % len(self.mix.sides)]
        blobs, edits = scene_of(side, number)
        client.open_scene(1, f"soak {number}" if sharing else "", sharing)
        client.upload(blobs)
        client.commit(1, edits)
        self.uploads += 1

    def upload_round(self, number):
        client = self.connect()
        if number % 10 == 4:  # lost in the middle of it
            self.lose_upload(client, number)
            return
        self.put_up(client, number, (PRIVATE, PRIVATE, KEPT, SHARED)[number % 4])
        self.batch(client, 2, 10, tracer=self.tracer(number), integrator=self.integrator(number),
                   encoding=(RAW, ZSTD, JPEG, PREDICTED)[number % 4])
        client.commit(1, [moved(1, tiny_client.NODE_MESH, 1, 0.1), tiny_client.set_material(1, (0.1, 0.2, 0.9))])
        self.batch(client, 3, 4, tracer=self.tracer(number))
        client.commit(1, [(REMOVE, tiny_client.payload(struct.pack("<2I", 0, 3)))])
        self.leave(client, number)

    def leave(self, client, number):
        way = number % 5
        if way == 0:
            client.wait(client.ask(SCENE_CLOSE, tiny_client.payload(struct.pack("<I", 1))))
        if way < 3:
            client.say_goodbye()
            return
        if way == 3:  # in the middle of a job
            self.render(client, BATCH, 4, frames=1000)
        else:  # in the middle of a transaction
            request = client.ask(tiny_client.EDIT_BEGIN, tiny_client.payload(struct.pack("<I", 1)))
            kind, body = tiny_client.set_material(1, (0.9, 0.2, 0.1))
            client.send(kind, request, 0, body)
        client.socket.close()

    def lose_upload(self, client, number):
        blobs, _ = scene_of(30, number)
        client.open_scene(1)
        references = [tiny_client.blob_reference(blob) for blob in blobs]
        client.wait(client.ask(tiny_client.BLOB_OFFER, tiny_client.payload(b"", tiny_client.array(references))),
                    tiny_client.BLOB_NEED)
        body = tiny_client.payload(struct.pack("<Q", 0) + tiny_client.blob_hash(blobs[0]))
        client.send(tiny_client.BLOB_DATA, 99, tiny_client.UPLOAD_CHANNEL, body + tiny_client.bulk(blobs[0][:1000], body))
        client.socket.close()
        self.uploads += 1

    # ---- a round

    def begin(self):
        """A scene that stays for the rounds that follow, and who edits it."""
        self.resident = self.connect(name="resident")
        blobs, edits = scene_of(8, 0)
        self.resident.open_scene(1, "resident", SHARED)
        self.resident.upload(blobs)
        self.resident.commit(1, edits)

    def end(self):
        self.resident.say_goodbye()
        self.resident = None

    def look_on(self, number):
        """Somebody else comes to what is there, and one edits while he looks."""
        client = self.connect(name="viewer")
        attach = tiny_client.payload(struct.pack("<I", 1), tiny_client.string("resident"))
        client.revision(client.ask(SCENE_ATTACH, attach))
        motion = (JPEG, ZSTD, H264, RAW)[number % 4]
        still = JPEG if motion == H264 else (PREDICTED, RAW, ZSTD, RAW)[number % 4]
        self.view(client, 2, 6, tracer=self.tracer(number + 1), encoding=motion, still=still, attachments=number % 4)
        self.resident_edits += 1
        self.resident.commit(1, [moved(1, tiny_client.NODE_MESH, 1, (self.resident_edits % 10) / 10)])
        self.view(client, 3, 4, integrator=self.integrator(number))
        if number % 2:
            client.say_goodbye()
        else:  # a viewer that is closed while it looks
            self.render(client, VIEW, 4, credit=64)
            client.socket.close()

    def round(self, number):
        """Counted from 1. After round n, n times as much has been done as one round does, or a little more."""
        self.upload_round(number)
        self.look_on(number)
        while self.connects < number * self.mix.connects:
            self.come_and_go(self.connects)
        missing = number * self.mix.frames - self.frames
        if missing > 0:
            self.batch(self.resident, number + 1, missing, tracer=self.tracer(number), encoding=(ZSTD, JPEG)[number % 2])
