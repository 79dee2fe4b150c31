# SPDX-License-Identifier: MIT
"""What the integration tests share: the programs, a daemon, the bundled scenes, and readers of PNG and EXR."""
import atexit
import json
import contextlib
import functools
import os
import pathlib
import re
import shutil
import signal
import struct
import subprocess
import tempfile
import unittest
import unittest.mock
import zlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("FARLIGHT_BIN", ROOT / "build" / "release"))
SHARED_SCENES = pathlib.Path(os.environ.get("FARLIGHT_SCENES", ROOT.parent / "shared" / "scenes"))
TIMEOUT_S = 900  # on a busy machine; sanitizers and software GL together are slow

# `make test-all` runs what takes minutes and adds breadth, not another kind of check.
LONG = bool(os.environ.get("FARLIGHT_TEST_LONG"))
long_test = unittest.skipUnless(LONG, "left to make test-all")

# A picture has one sample where a test says nothing, in place of 16 and more of what is noisy (Case.default_samples).
os.environ.setdefault("FARLIGHT_SAMPLES", "1")

# A shell's background commands ignore SIGINT, and so would all programs that tests start.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

@functools.cache
def protocol_fields(name):
    """The fixed fields of a message or record by protocol.md: name -> (offset, letter of struct, default). A record
    stands as its size, "picture.bytes", and its fields."""
    text = (BIN / "protocol.md").read_text()
    table = text[re.search(rf"^### (0x[0-9a-f]+ )?{name}$", text, re.M).end():]
    table = table[:table.index("\n### ")]
    fields = {}
    for offset, field, kind, allowed in re.findall(r"^\| (\d+) \| `(\w+)` \| (.*?) \| (.*?) \|", table, re.M):
        offset = int(offset)
        if nested := re.fullmatch(r"u16 (\d+), then (\w+)", kind):
            fields[field + ".bytes"] = offset, "H", int(nested[1])
            fields.update({inner: (offset + 2 + place, letter, default)
                           for inner, (place, letter, default) in protocol_fields(nested[2]).items()})
            continue
        letter = {"u8": "B", "u16": "H", "u64": "Q", "f32": "f"}.get(kind.split()[0], "I")
        count = int(kind.split()[2]) if " x " in kind else 1
        given, lowest = re.search(r"default ([-+.\de]+)$", allowed), re.match(r"([-+.\de]+) \.\.", allowed)
        default = float(given[1] if given else lowest[1] if lowest and float(lowest[1]) > 0 else 0)
        for i in range(count):
            fields[field + f"[{i}]" * (count > 1)] = offset + 4 * i, letter, default if letter == "f" else int(default)
    return fields


def fixed_part(message, **values):
    """The fixed part of a message; fields that are not given have their defaults."""
    fields = protocol_fields(message)
    assert values.keys() <= fields.keys(), values.keys() - fields.keys()
    fixed = bytearray(max(offset + struct.calcsize("<" + letter) for offset, letter, _ in fields.values()) - 2)
    for name, (offset, letter, default) in fields.items():
        struct.pack_into("<" + letter, fixed, offset - 2, values.get(name, default))
    return bytes(fixed)


_bundled = None


def bundled_scenes():
    """Folder with the scenes of the project's own generator; made once per run and gone at its end."""
    global _bundled
    if _bundled is None:
        _bundled = tempfile.mkdtemp(prefix="farlight-scenes-")
        atexit.register(shutil.rmtree, _bundled, ignore_errors=True)
        subprocess.run([BIN / "tests/tools/make_scenes", _bundled], check=True)
    return pathlib.Path(_bundled)


def run(program, *arguments, timeout=TIMEOUT_S, **options):
    """Runs one of the programs to its end; text output unless text=False is given."""
    options.setdefault("text", True)
    return subprocess.run([BIN / program, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          check=False, timeout=timeout, **options)


def farlight(*arguments, **options):
    return run("farlight", *arguments, **options)


def tracers():
    """Those that there are, in their order, as `farlight tracers` says."""
    return json.loads(farlight("tracers", "--json").stdout)["tracers"]


def daemon_pose(path, animation, times):
    """For each time: a list of (place, normal) for each corner of a triangle, as the daemon has it."""
    result = run("tests/tools/pose_dump", path, "-" if animation is None else animation, *map(repr, times))
    assert result.returncode == 0, result.stderr
    poses = []
    for line in result.stdout.splitlines():
        word, _, rest = line.partition(" ")
        if word == "time":
            poses.append([])
        elif word == "c":
            numbers = tuple(map(float, rest.split()))
            poses[-1].append((numbers[:3], numbers[3:]))
    return poses


class Daemon:
    """A farlightd on a socket of its own; a context manager."""

    def __init__(self, *arguments, listen=None, environment=None, launcher=(), pass_fds=(), program="farlightd"):
        self.program = program
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="farlight-daemon-"))
        self.address = f"unix:{self.folder}/farlight.sock" if listen is None else listen
        self.arguments = [*(["--listen", self.address] if self.address else []), *map(str, arguments)]
        self.environment = environment  # None: as it is here
        self.launcher = list(launcher)  # a command that becomes the daemon whose command line follows it
        self.pass_fds = pass_fds
        self.process = None
        self.ready = []

    def __enter__(self):
        self.log = open(self.folder / "log", "w+")
        self.process = subprocess.Popen([*self.launcher, BIN / self.program, *self.arguments],
                                        stdout=subprocess.PIPE, stderr=self.log, text=True, env=self.environment,
                                        pass_fds=self.pass_fds)
        for line in self.process.stdout:
            self.ready.append(line.strip())
            if line.startswith("READY"):
                return self
        failure = AssertionError(f"farlightd ended with {self.process.wait()}: {self.messages()}")
        self.__exit__()
        raise failure

    def messages(self):
        self.log.flush()
        return pathlib.Path(self.log.name).read_text()

    def workers(self):
        """Numbers of the processes that serve its users."""
        return [int(child) for child in pathlib.Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()]

    def signal_all(self, number):
        """Sends a signal to its workers and to it. It is stopped meanwhile if it is to be killed: a worker that sees its end
        would end in order, and another one would be started in the place of one that has ended."""
        if number == signal.SIGKILL:
            os.kill(self.process.pid, signal.SIGSTOP)
        for process in (*self.workers(), self.process.pid):
            with contextlib.suppress(ProcessLookupError):  # a worker that has ended meanwhile
                os.kill(process, number)

    @property
    def path(self):
        return self.address.removeprefix("unix:")

    def stop(self, number=signal.SIGTERM, timeout=TIMEOUT_S):
        """Ends it with a signal and returns its exit status. SIGKILL is for its workers, too, at the same time."""
        if self.process.poll() is None:
            (self.signal_all if number == signal.SIGKILL else self.process.send_signal)(number)
        return self.process.wait(timeout)

    def __exit__(self, *_):
        try:
            self.stop()
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.process.stdout.close()
        self.log.close()
        shutil.rmtree(self.folder, ignore_errors=True)


class Paced:
    """`farlight animate` that gets a few frames ahead of its reader at most, so that a test can disturb it between two frames
    on any machine.

    The client says each file that is complete in a line that begins with `frame N:` and ends with its path. The path is
    longer than half a page and the pipe has one page: until it is read, it holds one line and a part of the next. After
    until("frame N:") the client stops at the line of frame N + 2 at the latest, when it has received frame N + 3, and the
    daemon may have sent the two frames after that, for which the job has credit (protocol/messages.def)."""

    AHEAD = 5  # frames behind the last one that was read
    PAGE = os.sysconf("SC_PAGESIZE")

    def __init__(self, folder, name, *arguments, **options):
        """Makes folders below `folder`; `name` is the output's there, for example %d.png."""
        self.folder = pathlib.Path(folder)
        while len(str(self.folder)) <= self.PAGE // 2:
            self.folder /= "x" * 200
        self.folder.mkdir(parents=True, exist_ok=True)
        self.errors = ""
        self.process = subprocess.Popen([BIN / "farlight", "animate", *map(str, arguments), "-o", self.folder / name],
                                        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, bufsize=0, pipesize=self.PAGE, **options)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.stderr.close()
        self.process.wait()

    def until(self, words):
        """Reads up to a line with these words."""
        while line := self.process.stderr.readline().decode():
            self.errors += line
            if words in line:
                return
        raise AssertionError(f"it ended with {self.process.wait()} without '{words}': {self.errors}")

    def finish(self):
        """Reads to the end: the exit status, and all that it said."""
        self.errors += self.process.communicate(timeout=TIMEOUT_S)[1].decode()
        return self.process.returncode, self.errors

    def drain(self, seconds):
        """Reads for that time, or until the end."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.communicate(timeout=seconds)


def read_png(path):
    """(width, height, rows of bytes, channels) of an 8-bit PNG without interlacing."""
    data = pathlib.Path(path).read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", f"{path} is no PNG"
    at, packed, header = 8, b"", None
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            header = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            packed += body
        at += 12 + length
    width, height, depth, colour, _, _, interlace = header
    channels = {0: 1, 2: 3, 4: 2, 6: 4}[colour]
    assert depth == 8 and interlace == 0, header
    raw, stride, rows = zlib.decompress(packed), width * channels, []
    before = bytearray(stride)
    for y in range(height):
        kind = raw[y * (stride + 1)]
        row = bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for x in range(stride):
            left = row[x - channels] if x >= channels else 0
            up, corner = before[x], before[x - channels] if x >= channels else 0
            if kind == 1:
                row[x] = (row[x] + left) & 255
            elif kind == 2:
                row[x] = (row[x] + up) & 255
            elif kind == 3:
                row[x] = (row[x] + (left + up) // 2) & 255
            elif kind == 4:
                a, b, c = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
                row[x] = (row[x] + (left if a <= b and a <= c else up if b <= c else corner)) & 255
        rows.append(bytes(row))
        before = row
    return width, height, rows, channels


def exr_parts(path):
    """The headers of an EXR file, of one part or several: name -> bytes each; "" -> where its table of chunks begins."""
    data, headers = pathlib.Path(path).read_bytes(), []
    at, several = 8, data[5] & 0x10
    while not headers or several and data[at]:
        headers.append(_exr_header(data, at))
        at = headers[-1][""]
    at += 1 if several else 0
    for header in headers:
        header[""] = at
        at += 8 * struct.unpack("<I", header["chunkCount"])[0] if several else 0
    return headers


def exr_attributes(path):
    return exr_parts(path)[0]


def _exr_header(data, at):
    found = {}
    while data[at]:
        name_end = data.index(b"\0", at)
        kind_end = data.index(b"\0", name_end + 1)
        size = struct.unpack_from("<I", data, kind_end + 1)[0]
        found[data[at:name_end].decode()] = data[kind_end + 5:kind_end + 5 + size]
        at = kind_end + 5 + size
    found[""] = at + 1
    return found


def exr_channels(path, part=0):
    """name -> 0 whole numbers, 1 half floats, 2 floats; in the order of the file."""
    listing, found = exr_parts(path)[part]["channels"], {}
    while listing[0]:
        name, rest = listing.split(b"\0", 1)
        found[name.decode()] = struct.unpack_from("<i", rest)[0]
        listing = rest[16:]
    return found


def read_exr(path, part=0):
    """(width, height, name -> values row by row) of a part of an EXR file of scan lines, zip-compressed or not."""
    data, head, channels = pathlib.Path(path).read_bytes(), exr_parts(path)[part], exr_channels(path, part)
    left, top, right, bottom = struct.unpack("<4i", head["dataWindow"])
    width, height, compression = right - left + 1, bottom - top + 1, head["compression"][0]
    lines = {0: 1, 2: 1, 3: 16}[compression]
    formats = {name: f"<{width}{'Ief'[kind]}" for name, kind in channels.items()}
    values = {name: [] for name in channels}
    for chunk in range(-(-height // lines)):
        at = struct.unpack_from("<Q", data, head[""] + 8 * chunk)[0] + (4 if data[5] & 0x10 else 0)  # the part's number
        first, size = struct.unpack_from("<ii", data, at)
        rows = min(lines, bottom + 1 - first)
        plain_bytes = rows * sum(map(struct.calcsize, formats.values()))
        body = data[at + 8:at + 8 + size]
        if size < plain_bytes:  # what would not get smaller is stored as it is
            packed = bytearray(zlib.decompress(body))
            for i in range(1, len(packed)):
                packed[i] = (packed[i - 1] + packed[i] - 128) & 255
            half = (len(packed) + 1) // 2
            body = bytearray(len(packed))
            body[0::2], body[1::2] = packed[:half], packed[half:]
        assert len(body) == plain_bytes, path
        at = 0
        for _ in range(rows):
            for name, form in formats.items():
                values[name].extend(struct.unpack_from(form, body, at))
                at += struct.calcsize(form)
    return width, height, values


def grid_means(path, cells=8):
    """Mean red, green and blue of cells x cells parts of a PNG, row by row: a picture's stored figures."""
    width, height, rows, channels = read_png(path)
    means = []
    for cy in range(cells):
        for cx in range(cells):
            y0, y1 = cy * height // cells, (cy + 1) * height // cells
            x0, x1 = cx * width // cells, (cx + 1) * width // cells
            count = (y1 - y0) * (x1 - x0)
            means.append([round(sum(sum(rows[y][x0 * channels + c:x1 * channels:channels]) for y in range(y0, y1))
                                / count, 1) for c in range(3)])
    return means


def frames_of(result):
    """The frames of --timings=json."""
    return [record for record in map(json.loads, result.stdout.splitlines()) if record["kind"] == "frame"]


def needs_shared_scenes(test):
    return unittest.skipUnless(SHARED_SCENES.is_dir(), f"no folder of models at FARLIGHT_SCENES ({SHARED_SCENES.name})")(test)


class Case(unittest.TestCase):
    """A test with a folder of its own."""

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="farlight-test-"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def default_samples(self):
        """For the rest of the test: as many as where no one has said a number."""
        self.enterContext(unittest.mock.patch.dict(os.environ))
        del os.environ["FARLIGHT_SAMPLES"]

    def expect(self, result, status):
        self.assertEqual(result.returncode, status, f"\nstdout: {result.stdout}\nstderr: {result.stderr}")
        return result

    def leftovers(self):
        """Files in the test's folder, for the promise 'complete or not at all'."""
        return sorted(str(p.relative_to(self.folder)) for p in self.folder.rglob("*") if p.is_file())


def private_daemon(**variables):
    """The environment of a command that starts a daemon of its own, in a OneDaemon too; with more variables."""
    return {**{name: value for name, value in os.environ.items() if name != "FARLIGHT_SERVER"}, **variables}


class OneDaemon(Case):
    """One daemon for all tests of a class, which commands find by themselves: it starts and compiles once."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.daemon = cls.enterClassContext(Daemon())
        os.environ["FARLIGHT_SERVER"] = cls.daemon.address
        cls.addClassCleanup(os.environ.pop, "FARLIGHT_SERVER")
