# SPDX-License-Identifier: MIT
"""Raw bytes to a real daemon: what a careless, broken or hostile client gets, and that nobody else notices.

Each test that misbehaves ends with `assert_alive`: a bystander, connected all the while, still gets its answer.
"""
import contextlib
import itertools
import json
import os
import pathlib
import random
import shutil
import signal
import socket
import stat
import struct
import subprocess
import time

import farlight_test
from farlight_test import Case, Daemon, bundled_scenes, farlight

OK, ERROR, PING, PONG, GOODBYE, CANCEL, STATS, STATS_REPLY = 1, 2, 3, 4, 5, 6, 9, 10
SCENE_OPEN, BLOB_OFFER, BLOB_NEED, BLOB_DATA, EDIT_BEGIN, EDIT_COMMIT = 0x101, 0x110, 0x111, 0x112, 0x120, 0x121
SET_NODE, SET_DISC, RENDER = 0x130, 0x133, 0x201
PROTOCOL, INVALID, UNKNOWN_ID, LIMIT = 1, 3, 4, 6
IDENTITY = (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0)


def hello(version_min=2, version_max=2, name=b"test"):
    data = b"FARL" + struct.pack("<HHQ", version_min, version_max, 0) + os.urandom(16) + bytes([len(name)]) + name
    return data + bytes(-len(data) % 8)


def message(kind, request, fixed=b"", counted=b"", channel=0):
    payload = struct.pack("<H", len(fixed)) + fixed + counted
    return struct.pack("<IHHII", len(payload), kind, 0, request, channel) + payload + bytes(-len(payload) % 8)


def text(value):
    return struct.pack("<I", len(value)) + value.encode()


def set_node(node, parent=0, kind=0, thing=0, matrix=IDENTITY):
    """The fixed part without its last field, the skin, as an older client sends it."""
    value = struct.pack("<4I12f", parent, kind, thing, 0, *matrix)  # without its last two fields, as an older client's
    return struct.pack("<IH", node, len(value)) + value


def named(value):
    """What follows the fixed part of a node: no weights, and its name."""
    return struct.pack("<I", 0) + text(value)


class Peer:
    """A client of raw bytes."""

    def __init__(self, daemon, greet=True):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(60)
        self.socket.connect(daemon.path)
        self.buffer = b""
        if greet:
            self.socket.sendall(hello())
            self.read_reply()

    def read(self, count):
        while len(self.buffer) < count:
            more = self.socket.recv(65536)
            if not more:
                raise EOFError("the daemon closed the connection")
            self.buffer += more
        data, self.buffer = self.buffer[:count], self.buffer[count:]
        return data

    def read_reply(self):
        head = self.read(48)
        magic, version, limits = head[:4], *struct.unpack("<HH", head[4:8])
        assert magic == b"FARL", magic
        rest = self.read(limits + 1)
        count = 48 + limits + 1 + rest[-1]
        self.read(rest[-1])
        note = self.read(self.read(1)[0])
        self.read(-(count + 1 + len(note)) % 8)
        return version, note.decode()

    def send(self, *arguments, **options):
        self.socket.sendall(message(*arguments, **options))

    def receive(self):
        """(type, request, payload) of the next message."""
        size, kind, _, request, _ = struct.unpack("<IHHII", self.read(16))
        payload = self.read(size)
        self.read(-size % 8)
        return kind, request, payload

    def answer(self, request):
        """The answer to a request, past credit and other talk."""
        while True:
            kind, of, payload = self.receive()
            if of == request and kind in (OK, ERROR, PONG, STATS_REPLY, BLOB_NEED):
                return kind, payload

    def until_closed(self):
        """Everything that still comes before the daemon closes."""
        messages = []
        try:
            while True:
                messages.append(self.receive())
        except (EOFError, ConnectionResetError):
            self.close()
            return messages

    def close(self):
        self.socket.close()


def error_code(payload):
    return struct.unpack_from("<I", payload, 2)[0]


def error_text(payload):
    return payload[2 + struct.unpack_from("<H", payload)[0]:].decode(errors="replace")


class Hostile(Case):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()
        cls.daemon.__enter__()
        cls.bystander = Peer(cls.daemon)
        cls.pings = 0

    @classmethod
    def tearDownClass(cls):
        cls.bystander.close()
        cls.daemon.__exit__()

    def assert_alive(self):
        type(self).pings += 1
        self.bystander.send(PING, self.pings, struct.pack("<Q", 42))
        kind, payload = self.bystander.answer(self.pings)
        self.assertEqual(kind, PONG)
        self.assertEqual(struct.unpack_from("<Q", payload, 2)[0], 42)

    def test_a_wrong_magic_is_closed(self):
        peer = Peer(self.daemon, greet=False)
        peer.socket.sendall(b"GET / HTTP/1.1\r\n\r\n")
        peer.until_closed()
        self.assert_alive()

    def test_another_version_is_answered_with_the_supported_ones(self):
        peer = Peer(self.daemon, greet=False)
        peer.socket.sendall(hello(77, 99))
        self.addCleanup(peer.close)
        version, note = peer.read_reply()
        self.assertEqual(version, 0)
        self.assertIn("2", note)
        self.assertEqual(peer.until_closed(), [])
        self.assert_alive()

    def test_random_bytes_are_answered_with_an_error_and_closed(self):
        seeded = random.Random(1)
        for _ in range(50):
            peer = Peer(self.daemon)
            try:
                peer.socket.sendall(seeded.randbytes(seeded.randrange(16, 4096)))
                peer.socket.shutdown(socket.SHUT_WR)
            except OSError:
                pass  # closed while we were still talking
            for kind, request, payload in peer.until_closed():
                if kind == ERROR and request == 0:
                    self.assertEqual(error_code(payload), PROTOCOL, error_text(payload))
            peer.close()
        self.assert_alive()

    def test_an_unknown_type_is_fatal_and_one_with_the_top_bit_is_skipped(self):
        peer = Peer(self.daemon)
        peer.send(0xBEEF, 1)
        peer.send(PING, 2, struct.pack("<Q", 1))
        self.assertEqual(peer.answer(2)[0], PONG)
        peer.send(0x3EEF, 3)
        kinds = [kind for kind, _, _ in peer.until_closed()]
        self.assertIn(ERROR, kinds)
        self.assert_alive()

    def test_too_much_is_refused_before_it_has_come(self):
        peer = Peer(self.daemon)
        peer.socket.sendall(struct.pack("<IHHII", 0xFFFFFFF0, BLOB_DATA, 0, 1, 1))
        self.assertIn(ERROR, [kind for kind, _, _ in peer.until_closed()])
        self.assert_alive()

    def test_half_a_message_and_a_vanished_client_affect_no_other_client(self):
        whole = message(SCENE_OPEN, 1, struct.pack("<I", 1), text("half"))
        for count in range(len(whole)):
            peer = Peer(self.daemon)
            peer.socket.sendall(whole[:count])
            peer.close()
        self.assert_alive()

    def test_a_message_byte_by_byte_is_a_message(self):
        peer = Peer(self.daemon, greet=False)
        for byte in hello():
            peer.socket.sendall(bytes([byte]))
        peer.read_reply()
        for byte in message(PING, 5, struct.pack("<Q", 9)):
            peer.socket.sendall(bytes([byte]))
        self.assertEqual(peer.answer(5)[0], PONG)
        peer.close()

    def test_a_message_of_the_server_from_a_client_is_refused(self):
        peer = Peer(self.daemon)
        peer.send(OK, 1, struct.pack("<Q", 0))
        self.assertIn(ERROR, [kind for kind, _, _ in peer.until_closed()])
        self.assert_alive()


class Sessions(Case):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()
        cls.daemon.__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.__exit__()

    def setUp(self):
        super().setUp()
        self.peer = Peer(self.daemon)
        self.addCleanup(self.peer.close)

    def open_scene(self):
        self.peer.send(SCENE_OPEN, 1, struct.pack("<I", 1), text("test"))
        self.assertEqual(self.peer.answer(1)[0], OK)

    def transact(self, request, *edits):
        self.peer.send(EDIT_BEGIN, request, struct.pack("<I", 1))
        for kind, fixed, counted in edits:
            self.peer.send(kind, request, fixed, counted)
        self.peer.send(EDIT_COMMIT, request)
        return self.peer.answer(request)

    def test_revisions_count_transactions_and_a_failed_one_changes_nothing(self):
        self.open_scene()
        kind, payload = self.transact(2, (SET_NODE, set_node(1), named("a")))
        self.assertEqual((kind, struct.unpack_from("<Q", payload, 2)[0]), (OK, 1))
        kind, payload = self.transact(3, (SET_NODE, set_node(2), named("b")), (SET_NODE, set_node(3, parent=99), named("c")))
        self.assertEqual(kind, ERROR)
        self.assertIn("parent", error_text(payload))
        # Had node 2 been made, it could be a parent now.
        kind, payload = self.transact(4, (SET_NODE, set_node(4, parent=2), named("d")))
        self.assertEqual(kind, ERROR, "the failed transaction left node 2 behind")
        kind, payload = self.transact(5, (SET_NODE, set_node(5, parent=1), named("e")))
        self.assertEqual((kind, struct.unpack_from("<Q", payload, 2)[0]), (OK, 2))

    def test_a_cycle_of_nodes_is_refused(self):
        self.open_scene()
        kind, _ = self.transact(2, (SET_NODE, set_node(1, parent=2), named("")), (SET_NODE, set_node(2, parent=1), named("")))
        self.assertEqual(kind, ERROR)

    def test_not_a_number_is_refused_by_its_field(self):
        self.open_scene()
        for bad in (float("nan"), float("inf")):
            peer = Peer(self.daemon)
            peer.send(SCENE_OPEN, 1, struct.pack("<I", 1), text("x"))
            peer.answer(1)
            peer.send(EDIT_BEGIN, 2, struct.pack("<I", 1))
            peer.send(SET_NODE, 2, set_node(1, matrix=(bad,) + IDENTITY[1:]), named(""))
            errors = [error_text(payload) for kind, _, payload in self.drain(peer) if kind == ERROR]
            self.assertTrue(any("parent_from_node" in line for line in errors), errors)
            peer.close()

    def drain(self, peer):
        """Messages up to an error or the end of the connection."""
        messages = []
        try:
            while not messages or messages[-1][0] not in (ERROR, GOODBYE):
                messages.append(peer.receive())
        except EOFError:
            pass
        return messages

    def test_unknown_scenes_and_channels_are_errors_of_that_request_alone(self):
        self.peer.send(EDIT_BEGIN, 7, struct.pack("<I", 12))
        self.peer.send(EDIT_COMMIT, 7)
        kind, payload = self.peer.answer(7)
        self.assertEqual((kind, error_code(payload)), (ERROR, UNKNOWN_ID))
        self.peer.send(CANCEL, 8, struct.pack("<I", 4711))
        self.assertIn(self.peer.answer(8)[0], (OK, ERROR))
        self.peer.send(PING, 9, struct.pack("<Q", 1))
        self.assertEqual(self.peer.answer(9)[0], PONG)

    def test_a_blob_with_other_bytes_than_its_hash_is_refused(self):
        name = bytes(32)
        self.peer.send(BLOB_OFFER, 2, b"", struct.pack("<I", 1) + struct.pack("<Q", 8) + name)
        kind, payload = self.peer.answer(2)
        self.assertEqual(kind, BLOB_NEED)
        body = struct.pack("<Q", 0) + name
        padding = -(2 + len(body) + 4) % 8
        self.peer.send(BLOB_DATA, 3, body, struct.pack("<I", 8) + bytes(padding) + b"12345678", channel=1)
        kind, payload = self.peer.answer(3)
        self.assertEqual(kind, ERROR)
        self.assertIn("hash", error_text(payload))

    def test_stats_are_answered_on_a_bare_connection(self):
        self.peer.send(STATS, 2)
        kind, payload = self.peer.answer(2)
        self.assertEqual(kind, STATS_REPLY)
        self.assertGreater(len(payload), 100)


class Listening(Case):
    def as_plain_user(self, *arguments, **environment):
        """A daemon of a user who may write to nothing of the system's; its first line, or its status and errors."""
        self.folder.chmod(0o755)
        program = shutil.copy(farlight_test.BIN / "farlightd", self.folder)
        user = {"user": 65534, "group": 65534, "extra_groups": []} if os.geteuid() == 0 else {}
        child = subprocess.Popen([program, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd="/",
                                 env={"PATH": os.environ["PATH"], **environment}, **user)
        self.addCleanup(child.stdout.close)
        self.addCleanup(child.stderr.close)
        line = child.stdout.readline()
        if line:
            child.terminate()
            child.wait(farlight_test.TIMEOUT_S)  # a program that runs cannot be written
        return line.strip() or (child.wait(farlight_test.TIMEOUT_S), child.stderr.read())

    def test_a_plain_user_has_a_socket_of_their_own_or_hears_how_to_get_one(self):
        runtime = self.folder / "runtime"
        runtime.mkdir()
        runtime.chmod(0o777)
        self.assertEqual(self.as_plain_user(XDG_RUNTIME_DIR=str(runtime)), f"READY unix:{runtime}/farlight/farlight.sock")
        status, errors = self.as_plain_user()
        self.assertEqual(status, 1)
        self.assertIn("--listen", errors)
        self.assertIn("XDG_RUNTIME_DIR", errors)

    def test_a_misspelt_folder_is_not_made(self):
        refused = self.expect(farlight_test.run("farlightd", "--listen", f"unix:{self.folder}/mispelt/farlight.sock"), 1)
        self.assertIn("mispelt", refused.stderr)
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_paths_with_blanks_stand_beside_other_addresses(self):
        folder = self.folder / "a  folder"
        folder.mkdir()
        paths = [f"unix:{folder}/its socket", f"unix:{self.folder}/another one", "tcp:127.0.0.1:0"]

        def check(daemon):
            ready = [daemon.ready[-1], *(next(daemon.process.stdout).strip() for _ in paths[1:])]
            self.assertEqual(ready[:-1], [f"READY {path}" for path in paths[:-1]])
            self.assertIn("READY tcp:127.0.0.1:", ready[-1])
            for path in paths[:-1]:
                self.expect(farlight("stats", "--server", path), 0)

        with Daemon("--listen", paths[1], "--listen", paths[2], listen=paths[0]) as daemon:
            check(daemon)
        config = self.folder / "farlightd.conf"
        config.write_text(f"[server]\nlisten = {'  '.join(paths)}\n")
        with Daemon("--config", config, listen=False) as daemon:
            check(daemon)

    def test_the_socket_is_not_for_the_world(self):
        with Daemon() as daemon:
            mode = stat.S_IMODE(os.stat(daemon.path).st_mode)
            self.assertEqual(mode & 0o007, 0, oct(mode))

    def test_a_live_daemon_keeps_its_socket_and_a_stale_one_is_replaced(self):
        with Daemon() as first:
            second = farlight_test.run("farlightd", "--listen", first.address)
            self.expect(second, 1)
            self.assertIn(first.path, second.stderr)
            Peer(first).close()
            path = first.path
            first.stop(signal.SIGKILL)
            self.assertTrue(pathlib.Path(path).exists(), "a killed daemon leaves its socket file")
            with Daemon(listen=first.address) as third:
                Peer(third).close()

    def test_it_ends_on_sigterm_says_goodbye_and_removes_its_socket(self):
        with Daemon() as daemon:
            peer = Peer(daemon)
            self.assertEqual(daemon.stop(), 0, daemon.messages())
            self.assertIn(GOODBYE, [kind for kind, _, _ in peer.until_closed()])
            self.assertFalse(pathlib.Path(daemon.path).exists())

    def test_tcp_on_loopback_serves_and_elsewhere_is_refused(self):
        with Daemon(listen="tcp:127.0.0.1:0") as daemon:
            address = next(word for line in daemon.ready for word in line.split() if word.startswith("tcp:"))
            self.expect(farlight("stats", "--server", address), 0)
        refused = farlight_test.run("farlightd", "--listen", "tcp:0.0.0.0:0")
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("--insecure", refused.stderr)

    def test_clients_that_are_being_refused_count_as_not_introduced(self):
        """Or one host could have all the places for those who come."""
        patient = dict(os.environ, FARLIGHT_NETWORK_HANDSHAKE="600000")  # so that this is not why a connection ends
        with Daemon(listen="tcp:127.0.0.1:0", environment=patient) as daemon:
            port = int(daemon.ready[-1].rsplit(":", 1)[1])
            refused = [socket.create_connection(("127.0.0.1", port)) for _ in range(8)]
            for one in refused:
                one.settimeout(60)
                one.sendall(hello(900, 901))
                self.assertTrue(one.recv(1))  # and does not go away
            with socket.create_connection(("127.0.0.1", port)):  # takes the place of one of them, chosen at random
                gone, end = set(), time.monotonic() + farlight_test.TIMEOUT_S
                while not gone and time.monotonic() < end:
                    for one in refused:
                        try:
                            one.send(b"x")  # what is sent to one that is closed is answered by a reset
                        except OSError:
                            gone.add(one)
                    time.sleep(0.1)
                self.assertEqual(len(gone), 1)
            for one in refused:
                one.close()

    def test_bad_options_and_configurations_are_named(self):
        self.assertEqual(farlight_test.run("farlightd", "--no-such-option").returncode, 2)
        self.assertNotEqual(farlight_test.run("farlightd", "--listen", "carrier-pigeon:x").returncode, 0)
        path = self.folder / "bad.conf"
        path.write_text("[limits]\n\nno_such_key = 3\n")
        result = farlight_test.run("farlightd", "--config", path, "--listen", f"unix:{self.folder}/s")
        self.assertNotEqual(result.returncode, 0)
        self.assertIn("bad.conf:3", result.stderr)
        self.assertIn("no_such_key", result.stderr)

    def test_help_version_and_devices_go_to_standard_output(self):
        for program in ("farlight", "farlightd", "farlight-import", "farlight-export", "farlight-video", "farlight-web"):
            for option in ("--help", "--version"):
                result = self.expect(farlight_test.run(program, option), 0)
                self.assertIn(program, result.stdout)
        self.assertTrue(self.expect(farlight_test.run("farlightd", "--list-devices"), 0).stdout.strip())

    def test_clients_come_and_go_without_leaving_descriptors(self):
        with Daemon() as daemon:
            held = Peer(daemon)
            self.addCleanup(held.close)
            def descriptors():
                return sum(len(os.listdir(f"/proc/{process}/fd")) for process in (daemon.process.pid, *daemon.workers()))
            before = descriptors()  # one that is handed over is in both for a moment
            for _ in range(200):
                Peer(daemon).close()
            end = time.monotonic() + farlight_test.TIMEOUT_S
            while (left := descriptors()) > before:
                self.assertLess(time.monotonic(), end, f"{left} descriptors, {before} before")
                time.sleep(0.01)

    def test_stats_of_more_clients_and_scenes_than_a_message_holds_are_shortened(self):
        with Daemon() as daemon:
            peers = [Peer(daemon) for _ in range(250)]
            for peer in peers:
                for scene in (1, 2):
                    peer.send(SCENE_OPEN, scene, struct.pack("<I", scene), text("x" * 128))
            for peer in peers:
                for scene in (1, 2):
                    self.assertEqual(peer.answer(scene)[0], OK)
            peers[0].send(STATS, 3)
            kind, payload = peers[0].answer(3)
            self.assertEqual(kind, STATS_REPLY)
            self.assertGreater(len(payload), 60000)
            self.assertLessEqual(len(payload), 65536)
            for peer in peers:
                peer.close()


class Jobs(Case):
    def test_a_vanished_client_does_not_leave_its_job_running(self):
        with Daemon() as daemon:
            child = farlight_test.subprocess.Popen(
                [farlight_test.BIN / "farlight", "animate", bundled_scenes() / "teapot.glb", "--server", daemon.address,
                 "--frames", "1-1000", "--orbit", "--size", "320x240", "-o", self.folder / "%04d.png"],
                stdout=farlight_test.subprocess.DEVNULL, stderr=farlight_test.subprocess.DEVNULL)
            deadline = time.monotonic() + farlight_test.TIMEOUT_S
            while not list(self.folder.glob("*.png")) and time.monotonic() < deadline:
                time.sleep(0.05)
            child.kill()
            child.wait()
            peer = Peer(daemon)
            jobs = None
            end = time.monotonic() + farlight_test.TIMEOUT_S
            for request in itertools.count(1):
                peer.send(STATS, request)
                kind, payload = peer.answer(request)
                self.assertEqual(kind, STATS_REPLY)
                # uptime frames rays host host_limit device device_limit blob_bytes: 8 u64; then blobs, jobs: u32
                jobs = struct.unpack_from("<I", payload, 2 + 8 * 8 + 4)[0]
                if jobs == 0 or time.monotonic() > end:
                    break
                time.sleep(0.05)
            self.assertEqual(jobs, 0)
            peer.close()

    def test_stats_say_whose_jobs_run_and_which_frame_of_how_many(self):
        with Daemon() as daemon, self.animation(daemon):
            deadline = time.monotonic() + farlight_test.TIMEOUT_S
            jobs = []
            while not (jobs and jobs[0]["frames_sent"] > 0):
                self.assertLess(time.monotonic(), deadline)
                jobs = json.loads(self.expect(farlight("stats", "--json", "--server", daemon.address), 0).stdout)["running"]
                time.sleep(0.02)
            job = jobs[0]
            self.assertEqual((len(jobs), job["owner"], job["kind"], job["scene"], job["tracer"], job["frames_total"]),
                             (1, f"user {os.getuid()}", "batch", "teapot.glb", "bvh", 100001))
            self.assertEqual(job["frame"], 7 + 3 * job["frames_sent"])
            self.assertGreater(job["running_ns"], 0)
            table = self.expect(farlight("stats", "--server", daemon.address), 0).stdout
            self.assertRegex(table, r"(?m)^job of \d+ +user \d+, batch of teapot.glb, bvh, for [0-9.]+ s, frame \d+, \d+ of 100001 sent$")

    def test_stats_are_watched_until_an_interrupt(self):
        with Daemon() as daemon:
            watched = subprocess.Popen([farlight_test.BIN / "farlight", "stats", "--json", "--watch=0.1", "--server",
                                        daemon.address], stdout=subprocess.PIPE, text=True)
            self.addCleanup(watched.stdout.close)
            uptimes = [json.loads(watched.stdout.readline())["uptime_ns"] for _ in range(3)]
            self.assertEqual(uptimes, sorted(set(uptimes)))
            watched.send_signal(signal.SIGINT)
            self.assertEqual(watched.wait(farlight_test.TIMEOUT_S), 0)
            watched = subprocess.Popen([farlight_test.BIN / "farlight", "stats", "--watch=0.1", "--server", daemon.address],
                                       stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            self.addCleanup(watched.stderr.close)
            self.addCleanup(watched.stdout.close)
            while watched.stdout.readline() != "\n":  # the end of a block
                self.assertIsNone(watched.poll())
            daemon.stop(signal.SIGKILL)
            self.assertEqual(watched.wait(farlight_test.TIMEOUT_S), 75)
        for wrong in ("0", "x", "1e9"):
            self.expect(farlight("stats", "--server", "unix:/nonexistent", f"--watch={wrong}"), 2)

    def test_a_daemon_without_a_place_ends_a_client_with_75_and_says_why(self):
        with Daemon(listen="tcp:127.0.0.1:0", environment={**os.environ, "FARLIGHT_LIMITS_CLIENTS": "1"}) as daemon:
            address = next(word for line in daemon.ready for word in line.split() if word.startswith("tcp:"))
            holder = subprocess.Popen([farlight_test.BIN / "farlight", "stats", "--json", "--watch=1", "--server", address],
                                      stdout=subprocess.PIPE, text=True)
            self.addCleanup(holder.stdout.close)
            self.assertEqual(len(json.loads(holder.stdout.readline())["clients"]), 1)
            for command in (["stats"], ["render", bundled_scenes() / "cornell.glb", "-o", self.folder / "x.png", "--retry-for", "0"]):
                result = self.expect(farlight(*command, "--server", address), 75)
                self.assertIn("the limit", result.stderr)
            holder.send_signal(signal.SIGINT)
            holder.wait(farlight_test.TIMEOUT_S)
            # The place is free once the daemon has seen the client go.
            self.expect(farlight("stats", "--server", address, "--retry-for", "1m"), 0)

    @contextlib.contextmanager
    def animation(self, daemon):
        child = subprocess.Popen(
            [farlight_test.BIN / "farlight", "animate", bundled_scenes() / "teapot.glb", "--server", daemon.address, "--frames",
             "7-300007:3", "--orbit", "--size", "320x240", "-o", self.folder / "%04d.png", "-q"])
        try:
            yield child
        finally:
            child.kill()
            child.wait()


if __name__ == "__main__":
    farlight_test.unittest.main()
