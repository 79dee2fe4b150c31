# SPDX-License-Identifier: MIT
"""What a client that means harm does to a daemon, one function an attack; each goes on until it is ended. Run as a program:
attacks.py NAME USER ADDRESS. USER: whom the attacker becomes, as a number; 0: nobody else. It says BEGUN once it is at it."""
import array
import itertools
import os
import pathlib
import selectors
import socket
import struct
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / "integration"), str(HERE.parent / "soak")]
import load  # pylint: disable=wrong-import-position
import tiny_client  # pylint: disable=wrong-import-position
from tiny_client import BATCH, CREDIT, VIEW, Client  # pylint: disable=wrong-import-position

RGBA32F, ZSTD, JPEG, H264, PREDICTED, REFERENCE, BVH, WHITTED, RAYCAST = 2, 1, 2, 3, 4, 2, 0, 0, 2
CAN_H264 = 1  # a capability
STATS, SET_ENVIRONMENT, SET_SKIN = 0x0009, 0x0138, 0x0139
CAMERA = ((0, 0, 6), (0, 0, 0), (0, 1, 0), 0.8)
KEY = [struct.pack("<f", 0) + tiny_client.camera_bytes(CAMERA)]


def begun():
    print("BEGUN", flush=True)


def stay():
    while True:
        time.sleep(60)


def render(client, **fields):
    fields = {"kind": BATCH, "width": 64, "height": 64, "samples": 1, "depth": 1, "seed": 1, "last_frame": 0,
              "frames_per_second": 24, "camera_path": tiny_client.CAMERA_PATH_KEYS, "scene": 1, "channel": 2, **fields}
    fixed = load.fixed_part("render", **fields)
    return client.ask(tiny_client.RENDER, tiny_client.payload(fixed, tiny_client.array(KEY), tiny_client.array([])))


def with_triangle(address, **options):
    client = Client(address, **options)
    blobs, edits = tiny_client.triangle()
    client.open_scene(1)
    client.upload(blobs)
    client.commit(1, edits)
    return client


def drain(client, seconds):
    """Takes what comes for some time; answers do not matter."""
    client.socket.settimeout(seconds)
    try:
        while True:
            client.receive()
    except (TimeoutError, socket.timeout, tiny_client.Failed):
        pass
    client.socket.settimeout(240)


def transact(client, edits, scene=1):
    """A transaction; its answer, and an error, do not matter."""
    request = client.ask(tiny_client.EDIT_BEGIN, tiny_client.payload(struct.pack("<I", scene)))
    client.socket.sendall(b"".join(
        struct.pack("<I2H2I", len(body), kind, 0, request, 0) + body + bytes(-len(body) % 8) for kind, body in edits))
    client.send(tiny_client.EDIT_COMMIT, request, 0, tiny_client.payload())
    try:
        client.wait(request)
    except tiny_client.Failed:
        pass


def meshes(address):
    """One mesh again and again, with 24 MB of numbers each time."""
    vertices, triangles = 1 << 20, 1 << 20
    positions = array.array("f", [0.5]) * (3 * vertices)
    indices = array.array("I", [0, 1, 2]) * triangles
    blobs = [positions.tobytes(), indices.tobytes()]
    client = Client(address)
    client.open_scene(1)
    client.upload(blobs)
    edits = [tiny_client.set_mesh(1, vertices, triangles, blobs, 0)] * 2000
    begun()
    while True:
        transact(client, edits)


def many_meshes(address):
    """The same numbers as a thousand meshes, each of which counts."""
    vertices, triangles = 1 << 20, 1 << 20
    blobs = [(array.array("f", [0.5]) * (3 * vertices)).tobytes(), (array.array("I", [0, 1, 2]) * triangles).tobytes()]
    client = Client(address)
    client.open_scene(1)
    client.upload(blobs)
    edits = [tiny_client.set_mesh(1 + i, vertices, triangles, blobs, 0) for i in range(1000)]
    begun()
    while True:
        transact(client, edits)


def shown_meshes(address):
    """A mesh of 2 M triangles that is set anew and shown, again and again."""
    edge = 1024
    vertices, triangles = edge * edge, 2 * (edge - 1) * (edge - 1)
    rows = [array.array("f", itertools.chain.from_iterable((x / edge, y / edge, side) for y in range(edge) for x in range(edge)))
            for side in (0, 1)]
    indices = array.array("I", itertools.chain.from_iterable(
        (i, i + 1, i + edge, i + 1, i + edge + 1, i + edge) for y in range(edge - 1) for i in range(y * edge, (y + 1) * edge - 1)))
    shapes = [[positions.tobytes(), indices.tobytes()] for positions in rows]
    client = Client(address)
    client.open_scene(1)
    client.upload([*shapes[0], shapes[1][0]])
    client.commit(1, [tiny_client.set_mesh(1, vertices, triangles, shapes[0], 0), tiny_client.set_node(1, tiny_client.NODE_MESH, 1)])
    begun()
    for shape in itertools.cycle(shapes):
        client.commit(1, [tiny_client.set_mesh(1, vertices, triangles, shape, 0)])
        request = render(client, credit=1)
        client.next_frame(request)


def skins(address):
    """One skin of 65,536 joints again and again."""
    joints = 65536
    blobs = [array.array("I", [1] * joints).tobytes(), (array.array("f", [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]) * joints).tobytes()]
    client = Client(address)
    client.open_scene(1)
    client.upload(blobs)
    body = tiny_client.payload(struct.pack("<I", 1) + tiny_client.record(struct.pack("<I", joints)),
                               tiny_client.array([tiny_client.blob_reference(blob) for blob in blobs]), tiny_client.string(""))
    edits = [tiny_client.set_node(1, 0, 0)] + [(SET_SKIN, body)] * 5000
    begun()
    while True:
        transact(client, edits)


def coincident(address):
    """Two million triangles in one place, seen by the reference: each ray meets them all."""
    triangles = 2 << 20
    blobs = [struct.pack("<9f", -1, -1, 0, 3, -1, 0, -1, 3, 0), (array.array("I", [0, 1, 2]) * triangles).tobytes()]
    client = Client(address)
    client.open_scene(1)
    client.upload(blobs)
    client.commit(1, [tiny_client.set_mesh(1, 3, triangles, blobs, 0), tiny_client.set_node(1, tiny_client.NODE_MESH, 1)])
    begun()
    while True:
        request = render(client, width=1024, height=1024, tracer=REFERENCE, integrator=RAYCAST, primary=1, credit=1)
        client.next_frame(request)


def large_picture(address):
    """A frame of 8192x7800 with four layers of floats, begun anew all the time, with credit and without."""
    client = with_triangle(address)
    begun()
    for credit in itertools.cycle((1, 0)):
        request = render(client, width=8192, height=7800, format=RGBA32F, layers=0b1111, encoding=ZSTD, credit=credit)
        drain(client, 4)
        try:
            client.cancel(request)
        except (tiny_client.Failed, KeyError):
            pass


def environments(address):
    """Images of 8192x4096 all around, each shown."""
    client = with_triangle(address)
    half = struct.pack("<4e", 1, 1, 1, 0)
    images = [(half * 8192 * 4096)[:-8] + struct.pack("<4e", 1 + i, 1, 1, 0) for i in range(2)]
    client.upload(images)
    fixed = tiny_client.record(struct.pack("<4f4I", 1, 1, 1, 0, 8192, 4096, 0, 0))
    edits = [(SET_ENVIRONMENT, tiny_client.payload(fixed, tiny_client.array([tiny_client.blob_reference(image)])))
             for image in images]
    begun()
    while True:
        for edit in edits:
            client.commit(1, [edit])
            request = render(client, credit=1)
            try:
                client.next_frame(request)
            except tiny_client.Failed:
                pass


def flood(clients, message):
    """Sends the message by all of them as fast as each is read from, and drops what comes."""
    selector = selectors.DefaultSelector()
    for client in clients:
        client.socket.setblocking(False)
        selector.register(client.socket, selectors.EVENT_READ | selectors.EVENT_WRITE, client)
        client.unsent = b""
    begun()
    while True:
        for key, events in selector.select():
            client = key.data
            try:
                if events & selectors.EVENT_READ and not client.socket.recv(1 << 20):
                    selector.unregister(client.socket)
                    continue
                if events & selectors.EVENT_WRITE:
                    client.unsent = client.unsent or message(client)
                    client.unsent = client.unsent[client.socket.send(client.unsent):]
            except BlockingIOError:
                pass
            except OSError:
                selector.unregister(client.socket)
        if not selector.get_map():
            stay()


def ask_often(kind, body, count):
    def message(client):
        first = client.last_request
        client.last_request += count
        return b"".join(struct.pack("<I2H2I", len(body), kind, 0, first + i + 1, 0) + body + bytes(-len(body) % 8)
                        for i in range(count))
    return message


def stats(address):
    """60 connections that ask for the figures without an end."""
    flood([Client(address) for _ in range(60)], ask_often(STATS, tiny_client.payload(), 64))


def pings(address):
    flood([Client(address) for _ in range(20)], ask_often(tiny_client.PING, tiny_client.payload(bytes(8)), 2000))


def credits(address):
    """Messages that go to the engine and have no answer."""
    clients = [with_triangle(address) for _ in range(20)]
    for client in clients:
        client.job = render(client, width=16, height=16, last_frame=1 << 20, credit=0)
        client.total = 0

    def message(client):
        client.total += 1000
        bodies = [tiny_client.payload(struct.pack("<IQ", 2, client.total - 1000 + i)) for i in range(1000)]
        return b"".join(struct.pack("<I2H2I", len(body), CREDIT, 0, 0, 0) + body + bytes(-len(body) % 8) for body in bodies)
    flood(clients, message)


def places(address):
    """All places that there are."""
    held = []
    said = False
    while True:
        try:
            held.append(Client(address))
        except (OSError, EOFError, tiny_client.Failed, AssertionError, struct.error):
            if not said:
                begun()
                said = True
            time.sleep(0.01)


def silent(address):
    """Connections that say nothing, as many as the daemon takes; one that it drops comes again."""
    held, family = [], socket.AF_UNIX if isinstance(address, str) else socket.AF_INET
    selector = selectors.DefaultSelector()
    said = False
    while True:
        while len(held) < 400:
            one = socket.socket(family)
            one.setblocking(False)
            try:
                one.connect(address)
            except BlockingIOError:
                one.close()
                break
            except OSError:
                one.close()
                break
            held.append(one)
            selector.register(one, selectors.EVENT_READ)
        if not said and len(held) > 60:
            begun()
            said = True
        for key, _ in selector.select(0.01):
            selector.unregister(key.fileobj)
            held.remove(key.fileobj)
            key.fileobj.close()


def weights(address):
    """20 connections with four batches each that want the largest share."""
    clients = []
    for _ in range(20):
        client = with_triangle(address)
        for channel in range(2, 6):
            render(client, channel=channel, weight=16, width=256, height=256, samples=64, last_frame=1 << 20, credit=65536)
        clients.append(client)
    flood(clients, lambda client: b"")


def encode_much(address, **fields):
    clients = []
    for _ in range(4):
        client = with_triangle(address)
        for channel in range(2, 6):
            render(client, channel=channel, last_frame=1 << 20, credit=65536, **fields)
        clients.append(client)
    flood(clients, lambda client: b"")


def encoding(address):
    """Frames that take long to encode."""
    encode_much(address, width=2048, height=2048, encoding=ZSTD, quality=19, format=RGBA32F)


def jpegs(address):
    """The largest frames as JPEG, which is not given up in the middle."""
    encode_much(address, width=8192, height=8192, encoding=JPEG, quality=100)


def videos(address):
    """The largest views as H.264, which is not given up in the middle, either."""
    clients = [with_triangle(address, capabilities=CAN_H264) for _ in range(4)]
    for client in clients:
        for channel in range(2, 4):
            render(client, kind=VIEW, channel=channel, width=8192, height=8192, encoding=H264, still_encoding=H264, quality=100,
                   credit=65536)
    command = itertools.count(1)

    def look(client):
        time.sleep(0.05)
        number = next(command)
        eye, *rest = CAMERA
        client.look(2 + number % 2, number, ((eye[0] + number % 1000 / 1000, *eye[1:]), *rest), True)
        return b""

    flood(clients, look)


def uncommitted(address):
    """Edits that are never committed, on as many connections as there may be."""
    clients = []
    for _ in range(64):
        try:
            client = Client(address)
            client.open_scene(1)
        except (OSError, EOFError, tiny_client.Failed):
            break
        request = client.ask(tiny_client.EDIT_BEGIN, tiny_client.payload(struct.pack("<I", 1)))
        weights_of = tiny_client.array([struct.pack("<f", 1)] * 1024)
        node = tiny_client.record(struct.pack("<4I12fI", 0, 0, 0, 0, *tiny_client.IDENTITY, 0))
        body = tiny_client.payload(struct.pack("<I", 1) + node, weights_of, tiny_client.string(""))
        head = struct.pack("<I2H2I", len(body), tiny_client.SET_NODE, 0, request, 0)
        client.edits = (head + body + bytes(-len(body) % 8)) * 64
        clients.append(client)
    flood(clients, lambda client: client.edits)


def noise(address):
    """Connections that each leave a line in the log: what is no transaction is committed."""
    begun()
    while True:
        try:
            client = Client(address)
            client.send(tiny_client.EDIT_COMMIT, 1, 0, tiny_client.payload())
            client.socket.recv(4096)
            client.socket.close()
        except (OSError, EOFError, tiny_client.Failed):
            pass


ATTACKS = {attack.__name__: attack for attack in (
    meshes, many_meshes, shown_meshes, skins, coincident, large_picture, environments, stats, pings, credits, places, silent, weights,
    encoding, jpegs, videos, uncommitted, noise)}


def main():
    name, user, address = sys.argv[1:]
    if int(user):
        os.setgid(int(user))
        os.setuid(int(user))
    host, _, port = address.rpartition(":")
    ATTACKS[name]((host, int(port)) if host else address)


if __name__ == "__main__":
    try:
        main()
    except (OSError, EOFError):
        stay()  # turned away: the daemon has won
