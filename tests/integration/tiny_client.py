# SPDX-License-Identifier: MIT
"""A client of farlightd in the standard library of Python 3 alone, written from protocol.md and nothing else: whoever
writes one in another language may begin with it. Run as a program it renders a triangle into a PPM file:
tiny_client.py SOCKET IMAGE"""
import hashlib
import socket
import struct
import sys
import time

OK, ERROR, PING, PONG, GOODBYE, CANCEL, CREDIT, BLOCKED = 0x0001, 0x0002, 0x0003, 0x0004, 0x0005, 0x0006, 0x0007, 0x8008
SCENE_OPEN, SCENE_CHANGED, BLOB_OFFER, BLOB_NEED, BLOB_DATA = 0x0101, 0x8108, 0x0110, 0x0111, 0x0112
EDIT_BEGIN, EDIT_COMMIT, SET_NODE, SET_MESH, SET_MATERIAL, SET_LIGHT = 0x0120, 0x0121, 0x0130, 0x0131, 0x0134, 0x0136
RENDER, VIEW_CAMERA, FRAME_BEGIN, FRAME_DATA, FRAME_END, FRAME_ACK = 0x0201, 0x0202, 0x0210, 0x0211, 0x0212, 0x0213
FRAME_PARTS = 0x0214

BATCH, VIEW = 0, 1  # job_kind
PRIVATE, KEPT, SHARED = 0, 1, 2  # sharing
NODE_MESH, NODE_LIGHT = 1, 3  # node_kind
DIRECTIONAL = 2  # light_kind
CAMERA_PATH_KEYS = 2  # camera_path
VERSION = 2  # of the protocol
CANCELLED = 8  # error_code
UPLOAD_CHANNEL, CHUNK_BYTES, PIECE_BYTES = 1, 1 << 20, 262144
IDENTITY = (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0)


class Failed(Exception):
    """An error that the daemon has sent."""

    def __init__(self, code, field, text):
        super().__init__(f"{code}: {field}: {text}")
        self.code, self.field = code, field


# ---- payloads

def string(text):
    data = text.encode()
    return struct.pack("<I", len(data)) + data


def array(records):
    return struct.pack("<I", len(records)) + b"".join(records)


def payload(fixed=b"", *counted):
    return struct.pack("<H", len(fixed)) + fixed + b"".join(counted)


def bulk(data, before):
    """`before`: the payload up to here."""
    return struct.pack("<I", len(data)) + bytes(-(len(before) + 4) % 8) + data


def blob_hash(data):
    def short(part):
        return hashlib.blake2b(part, digest_size=32).digest()
    return short(b"".join(short(data[i:i + CHUNK_BYTES]) for i in range(0, len(data), CHUNK_BYTES)))


def blob_reference(data):
    return struct.pack("<Q", len(data)) + blob_hash(data)


def fixed_of(body):
    """The fixed fields of a payload, and what follows them."""
    size, = struct.unpack_from("<H", body)
    return body[2:2 + size], body[2 + size:]


class Frame:
    """From its frame_begin on; `pixels` are complete when frame_end has come."""

    def __init__(self, request, channel, body):
        fixed, _ = fixed_of(body)
        self.request, self.channel, self.pixels, self.complete, self.fixed = request, channel, bytearray(), False, fixed
        (self.number, self.width, self.height, self.samples, self.revision, self.size_bytes, self.format, self.encoding,
         self.tracer, self.integrator, self.digest) = struct.unpack_from("<4I2Q4IQ", fixed)
        self.command, = struct.unpack_from("<Q", fixed, 136)
        self.attached_bytes = sum(struct.unpack_from("<2Q24xQ", fixed, 184))  # depth, normals, sticking, behind the pixels
        self.parts = []  # (kind, bytes) of a frame in parts, in the order of its bytes
        self.abandoned = False


class Client:
    def __init__(self, path, name="tiny client", capabilities=0):
        """`path` of a Unix socket; or host and port of one that listens without keys."""
        self.socket = socket.socket(socket.AF_UNIX if isinstance(path, str) else socket.AF_INET)
        self.socket.settimeout(240)
        self.socket.connect(path)
        self.waiting, self.last_request = b"", 0
        self.credit, self.sent = 0, 0  # bytes of blob data, on channel 1
        self.answers = {}  # request -> (type, body), or Failed
        self.frames, self.goodbye = [], None  # complete ones that nobody has taken
        self.begun = {}  # channel -> frame that is not complete
        self.acknowledged = set()  # channels of views
        self.takes_s = 0  # that a frame seems to be on its way from its begin to its end
        self.changes = []  # (scene, revision)
        self.greet(name, capabilities)

    # ---- bytes

    def read(self, count):
        while len(self.waiting) < count:
            data = self.socket.recv(1 << 16)
            if not data:
                raise EOFError("the daemon has closed the connection")
            self.waiting += data
        data, self.waiting = self.waiting[:count], self.waiting[count:]
        return data

    def greet(self, name, capabilities):
        name = name.encode()
        hello = b"FARL" + struct.pack("<2HQ16sB", VERSION, VERSION, capabilities, bytes(16), len(name)) + name
        self.socket.sendall(hello + bytes(-len(hello) % 8))
        reply = self.read(48)
        assert reply[:4] == b"FARL", reply
        self.version, limits_bytes = struct.unpack_from("<2H", reply, 4)
        limits = self.read(limits_bytes)
        texts = []
        used = 48 + limits_bytes
        for _ in range(2):
            length, = self.read(1)
            texts.append(self.read(length).decode())
            used += 1 + length
        self.read(-used % 8)
        if self.version != VERSION:
            raise Failed(2, "version", texts[1])
        self.daemon, self.requests_in_flight = texts[0], struct.unpack_from("<I", limits, 28)[0]

    def send(self, kind, request, channel, body):
        header = struct.pack("<I2H2I", len(body), kind, 0, request, channel)
        self.socket.sendall(header + body + bytes(-len(body) % 8))

    def ask(self, kind, body, channel=0):
        """A request; its number, for wait()."""
        self.last_request += 1
        self.send(kind, self.last_request, channel, body)
        return self.last_request

    # ---- messages that come

    def receive(self):
        size, kind, flags, request, channel = struct.unpack("<I2H2I", self.read(16))
        body = self.read(size)
        self.read(-size % 8)
        assert flags == 0
        fixed, rest = fixed_of(body)
        if kind == ERROR:
            code, = struct.unpack_from("<I", fixed)
            texts = []
            for _ in range(3):  # field, text, remedy
                length, = struct.unpack_from("<I", rest)
                texts.append(rest[4:4 + length].decode())
                rest = rest[4 + length:]
            failed = Failed(code, texts[0], texts[1])
            if request == 0:
                raise failed
            self.answers[request] = failed
        elif kind == CREDIT:
            of, total = struct.unpack("<IQ", fixed)
            assert of == UPLOAD_CHANNEL
            self.credit = max(self.credit, total)
        elif kind == PING:
            self.send(PONG, request, 0, payload(fixed + bytes(8)))
        elif kind == GOODBYE:
            self.goodbye, = struct.unpack_from("<I", fixed)
        elif kind == SCENE_CHANGED:
            self.changes.append(struct.unpack("<IQ", fixed))
        elif kind == FRAME_BEGIN:
            self.begun[channel] = Frame(request, channel, body)
            self.acknowledge(self.begun[channel], 0)
        elif kind == FRAME_PARTS:
            count, = struct.unpack_from("<I", rest)
            self.begun[channel].parts = list(struct.iter_unpack("<IQ", rest[4:4 + 12 * count]))
        elif kind == FRAME_DATA:
            self.take_piece(self.begun[channel], fixed, rest, len(body))
        elif kind == FRAME_END:
            frame = self.begun.pop(channel)
            assert struct.unpack_from("<I", fixed) == (frame.number,)
            frame.abandoned = bool(struct.unpack_from("<I", fixed, 52)[0])
            whole = sum(size for _, size in frame.parts) or frame.size_bytes + frame.attached_bytes
            assert (len(frame.pixels) < whole) == frame.abandoned
            self.frames.append(frame)
            time.sleep(self.takes_s)
            self.acknowledge(frame, 1)
        elif kind not in (BLOCKED,):
            self.answers[request] = kind, body

    @staticmethod
    def take_piece(frame, fixed, rest, size):
        offset, = struct.unpack("<Q", fixed)
        length, = struct.unpack_from("<I", rest)
        assert offset == len(frame.pixels)
        frame.pixels += rest[-length:] if length else b""
        assert size == 2 + len(fixed) + len(rest) and (size - length) % 8 == 0

    def acknowledge(self, frame, whole):
        if frame.channel in self.acknowledged:
            self.send(FRAME_ACK, 0, 0, payload(struct.pack("<4I", frame.channel, frame.number, whole, 0)))

    def wait(self, request, kind=OK):
        """The body of a request's answer."""
        while request not in self.answers:
            self.receive()
        answer = self.answers.pop(request)
        if isinstance(answer, Failed):
            raise answer
        assert answer[0] == kind, hex(answer[0])
        return answer[1]

    def revision(self, request):
        return struct.unpack("<Q", fixed_of(self.wait(request))[0])[0]

    def next_frame(self, job=None):
        """Raises Failed where the job has ended with an error instead."""
        while not self.frames:
            if isinstance(self.answers.get(job), Failed):
                raise self.answers.pop(job)
            self.receive()
        return self.frames.pop(0)

    # ---- a scene

    def open_scene(self, scene, name="", sharing=PRIVATE):
        self.wait(self.ask(SCENE_OPEN, payload(struct.pack("<2I", scene, sharing), string(name))))

    def upload(self, blobs):
        """What the daemon does not have; how many bytes that were."""
        answer = self.wait(self.ask(BLOB_OFFER, payload(b"", array([blob_reference(blob) for blob in blobs]))), BLOB_NEED)
        count, = struct.unpack_from("<I", answer, 2)
        needed = [blobs[i] for i in struct.unpack_from(f"<{count}I", answer, 6)]
        for blob in needed:
            self.wait(self.send_blob(blob))
        return sum(map(len, needed))

    def send_blob(self, blob):
        self.last_request += 1
        request, name = self.last_request, blob_hash(blob)
        for offset in range(0, len(blob), PIECE_BYTES):
            piece = blob[offset:offset + PIECE_BYTES]
            while self.credit - self.sent < len(piece):
                self.receive()
            body = payload(struct.pack("<Q", offset) + name)
            self.send(BLOB_DATA, request, UPLOAD_CHANNEL, body + bulk(piece, body))
            self.sent += len(piece)
        return request

    def commit(self, scene, edits):
        """edits: (type, body) each; the scene's revision with them."""
        request = self.ask(EDIT_BEGIN, payload(struct.pack("<I", scene)))
        for kind, body in edits:
            self.send(kind, request, 0, body)
        self.send(EDIT_COMMIT, request, 0, payload())
        return self.revision(request)

    # ---- pictures

    def render(self, scene, channel, size, camera, kind=BATCH, samples=1, depth=8, credit=1):
        """camera: eye, point looked at, upward direction, vertical field of view. The last fields of each record are
        left to their defaults, as an older client would send it."""
        if kind == VIEW:
            self.acknowledged.add(channel)
        fixed = struct.pack("<8If3I", scene, kind, channel, 0, credit, 0, 0, 1, 24, 0, 0, 1)
        picture, shot, sampling, lighting = (*size,), (CAMERA_PATH_KEYS,), (samples,), (0, depth)
        for values in (picture, shot, sampling, lighting, (), (), ()):  # view, comparison and tracing: defaults
            fixed += record(struct.pack(f"<{len(values)}I", *values))
        return self.ask(RENDER, payload(fixed, array([struct.pack("<f", 0) + camera_bytes(camera)]), array([])))

    def look(self, channel, command, camera, moving=False):
        self.send(VIEW_CAMERA, 0, 0, payload(struct.pack("<IQIf", channel, command, moving, 0) + camera_bytes(camera)))

    def raise_credit(self, channel, total):
        self.send(CREDIT, 0, 0, payload(struct.pack("<IQ", channel, total)))

    def cancel(self, target):
        """Ends a request; what it was answered with."""
        self.wait(self.ask(CANCEL, payload(struct.pack("<I", target))))
        return self.answers.pop(target)

    def say_goodbye(self):
        self.send(GOODBYE, 0, 0, payload(struct.pack("<I", 0), string("")))
        rest = self.waiting
        while data := self.socket.recv(1 << 16):
            rest += data
        self.socket.close()
        return rest


def camera_bytes(camera):
    eye, look_at, up, fov_y = camera
    return struct.pack("<10f", *eye, *look_at, *up, fov_y)


# ---- edits

def record(fixed):
    """A record among the fixed fields of a message."""
    return struct.pack("<H", len(fixed)) + fixed


def set_material(material, base_colour, roughness=1, unlit=0, metallic=0):
    value = struct.pack("<3I", 0, 0, unlit)
    value += struct.pack("<7fI", *base_colour, 1, 0, 0, 0, 0)
    value += struct.pack("<7f", metallic, roughness, 0, 1.5, 0, 0, 0)
    value += struct.pack("<9f", 1, 1, 1, 1, 1, 1, 1, 0, 0)  # mirror and body as usual
    value += struct.pack("<15fI", 0, 0, 0, 0, 0, 0, 0, 1.3, 100, 400, 0, 0, 1, 1, 1, 0)  # no layers
    return SET_MATERIAL, payload(struct.pack("<I", material) + record(value), array([]), string(""))


def set_mesh(mesh, vertex_count, triangle_count, blobs, material):
    """blobs: positions, indices and, where there are any, normals."""
    fixed = struct.pack("<I", mesh) + record(struct.pack("<5I", vertex_count, triangle_count, 0, 0, 0))
    ranges = [struct.pack("<3I", 0, triangle_count, material)]
    return SET_MESH, payload(fixed, array([blob_reference(blob) for blob in blobs]), array(ranges), array([]), string(""))


def set_node(node, kind, thing, parent_from_node=IDENTITY):
    fixed = struct.pack("<I", node) + record(struct.pack("<4I12f2I", 0, kind, thing, 0, *parent_from_node, 0, 0))
    return SET_NODE, payload(fixed, array([]), string(""))


def set_light(light, kind, colour):
    value = struct.pack("<I8f", kind, *colour, 0, 0, 0, 0, 0)
    return SET_LIGHT, payload(struct.pack("<I", light) + record(value), string(""))


def triangle(colour=(0.8, 0.4, 0.2)):
    """Blobs and edits of what the end of protocol.md shows: a lit triangle that fills the picture of the camera there."""
    blobs = [struct.pack("<9f", -1, -1, 0, 3, -1, 0, -1, 3, 0), struct.pack("<3I", 0, 1, 2)]
    edits = [set_material(1, colour), set_mesh(1, 3, 1, blobs, 1), set_node(1, NODE_MESH, 1),
             set_light(1, DIRECTIONAL, [3.1415927] * 3), set_node(2, NODE_LIGHT, 1)]
    return blobs, edits


def main():
    client = Client(sys.argv[1])
    blobs, edits = triangle()
    client.open_scene(1)
    client.upload(blobs)
    client.commit(1, edits)
    job = client.render(1, 2, (320, 240), ((0, 0, 6), (0, 0, 0), (0, 1, 0), 0.8))
    frame = client.next_frame()
    client.wait(job)
    client.say_goodbye()
    colours = b"".join(bytes(frame.pixels[i:i + 3]) for i in range(0, len(frame.pixels), 4))
    with open(sys.argv[2], "wb") as image:
        image.write(b"P6 %d %d 255\n" % (frame.width, frame.height) + colours)


if __name__ == "__main__":
    main()
