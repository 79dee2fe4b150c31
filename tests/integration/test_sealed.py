# SPDX-License-Identifier: MIT
"""Sealed connections, from outside: the stored session computed again by other means, a daemon that others than the
loopback may reach, keys that are right, wrong or open to others, and somebody on the way."""
import json
import os
import pathlib
import select
import signal
import socket
import struct
import subprocess
import threading
import time

import farlight_test
import sealed_link
from farlight_test import Case, Daemon, bundled_scenes, farlight
from test_daemon import PING, PONG, hello, message

GOLDEN = farlight_test.ROOT / "tests/unit/protocol/golden/sealed.hex"


class Golden(Case):
    """What the C side stored as golden bytes is what the document says."""

    def test_the_stored_session_is_the_documents(self):
        lines = (line.split(" ") for line in pathlib.Path(GOLDEN).read_text().splitlines())
        stored = {name: bytes.fromhex(value) for name, value in lines}
        client = sealed_link.Client(stored["key"], stored["client_secret"], stored["client_nonce"],
                                    stored["client_header"])
        self.assertEqual(client.message_1, stored["message_1"])
        self.assertEqual(stored["message_2"],
                         b"SEAL\2\0\0\0" + sealed_link.public_key(stored["server_secret"]) + stored["server_nonce"])
        self.assertEqual(client.proving(stored["message_2"]), stored["message_3"])
        self.assertEqual(stored["message_4"][8:32], stored["server_header"])
        client.finish(stored["message_4"])
        self.assertEqual(client.seal(stored["client_plain_1"]), stored["client_record_1"])
        self.assertEqual(client.seal(stored["client_plain_2"]), stored["client_record_2"])
        self.assertEqual(client.seal(b"", last=True), stored["client_last_record"])
        self.assertEqual(client.open(stored["server_record_1"]), (stored["server_plain_1"], sealed_link.Stream.MESSAGE))
        self.assertEqual(client.open(stored["server_last_record"]), (b"", sealed_link.Stream.FINAL))


class SealedDaemon(Daemon):
    """Listens where everybody could reach it."""

    def __init__(self, folder, *arguments, environment=None):
        super().__init__("--key-file", folder / "key", "--reader-key-file", folder / "reader", *arguments,
                         listen="tcp:0.0.0.0:0", environment=environment)

    @property
    def port(self):
        return int(self.ready[0].rpartition(":")[2])

    @property
    def reached(self):
        return f"tcp:127.0.0.1:{self.port}"

    def connect(self):
        connection = socket.create_connection(("127.0.0.1", self.port))
        connection.settimeout(60)
        return connection


class Keys(Case):
    def setUp(self):
        super().setUp()
        for name in ("key", "reader", "other"):
            self.expect(farlight("key", self.folder / name), 0)

    def test_a_picture_is_the_same_sealed_as_over_a_unix_socket(self):
        digests = []
        options = (bundled_scenes() / "teapot.glb", "--size", "200x150", "--timings=json")
        with Daemon() as daemon:
            result = self.expect(farlight("render", *options, "-o", self.folder / "a.png", "--server", daemon.address), 0)
            digests.append(farlight_test.frames_of(result)[0]["digest"])
        with SealedDaemon(self.folder) as daemon:
            for encoding in ("raw", "zstd"):
                result = self.expect(farlight("render", *options, "-o", self.folder / f"{encoding}.png", "--server",
                                              daemon.reached, "--key", self.folder / "key", "--encoding", encoding), 0)
                digests.append(farlight_test.frames_of(result)[0]["digest"])
        self.assertEqual(len(set(digests)), 1, digests)

    def test_uploaded_scenes_are_held_for_the_holder_of_the_key_only(self):
        def uploaded(*options):
            result = self.expect(farlight("render", bundled_scenes() / "teapot.glb", "--size", "16x16", "--timings=json",
                                          "-o", self.folder / "a.png", *options), 0)
            return next(record["uploaded_bytes"] for record in map(json.loads, result.stdout.splitlines())
                        if record["kind"] == "client")

        with SealedDaemon(self.folder, "--listen", f"unix:{self.folder}/s") as daemon:
            sealed = ("--server", daemon.reached, "--key", self.folder / "key")
            here = ("--server", f"unix:{self.folder}/s")
            self.assertGreater(uploaded(*sealed), 0)
            self.assertEqual(uploaded(*sealed), 0)
            self.assertGreater(uploaded(*here), 0)
            self.assertEqual(uploaded(*here), 0)
            # Over the Unix socket too the key says who it is.
            self.assertEqual(uploaded(*here, "--key", self.folder / "key"), 0)

    def test_a_public_address_needs_a_key(self):
        with SealedDaemon(self.folder) as daemon:
            result = self.expect(farlight("ping", "--server", daemon.reached), 1)
            self.assertIn("--key", result.stderr)
            self.expect(farlight("ping", "--server", daemon.reached, "--key", self.folder / "key"), 0)
            named = dict(os.environ, FARLIGHT_KEY=str(self.folder / "key"))
            self.expect(farlight("ping", "--server", daemon.reached, env=named), 0)
            result = self.expect(farlight("stats", "--server", daemon.reached, "--key", self.folder / "reader"), 0)
            self.assertIn("reader's key", result.stdout)

    def test_a_readers_key_is_for_looking(self):
        with SealedDaemon(self.folder) as daemon:
            options = (bundled_scenes() / "teapot.glb", "--size", "32x24", "-o", self.folder / "a.png",
                       "--server", daemon.reached)
            result = self.expect(farlight("render", *options, "--key", self.folder / "reader"), 1)
            self.assertIn("look", result.stderr)
            self.assertFalse((self.folder / "a.png").exists())
            self.expect(farlight("render", *options, "--key", self.folder / "key"), 0)

    def test_a_wrong_key_is_refused_after_a_second(self):
        with SealedDaemon(self.folder) as daemon:
            begin = time.monotonic()
            result = self.expect(farlight("ping", "--server", daemon.reached, "--key", self.folder / "other"), 1)
            self.assertGreater(time.monotonic() - begin, 0.9)
            self.assertIn("another key", result.stderr)
            self.assertIn("--key", result.stderr)

    def test_a_key_that_is_open_to_others_is_not_used(self):
        (self.folder / "key").chmod(0o640)
        result = self.expect(farlight("ping", "--server", "unix:/nowhere", "--key", self.folder / "reader"), 75)
        self.assertNotIn("chmod", result.stderr)
        with Daemon() as daemon:
            result = self.expect(farlight("ping", "--server", daemon.address, "--key", self.folder / "key"), 1)
            self.assertIn("chmod 600", result.stderr)
        refused = farlight_test.run("farlightd", "--listen", f"unix:{self.folder}/s", "--key-file", self.folder / "key")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("chmod 600", refused.stderr)

    def test_clients_of_a_replaced_key_are_told_to_go(self):
        with SealedDaemon(self.folder) as daemon:
            def serve(key, name):
                command = [farlight_test.BIN / "farlight", "serve", bundled_scenes() / "teapot.glb", "--server", daemon.reached, "--key",
                           self.folder / key, "--name", name]
                process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
                self.addCleanup(process.kill)
                self.assertIn("serving", process.stdout.readline())
                return process
            served = serve("key", "served")
            os.replace(self.folder / "other", self.folder / "key")
            daemon.process.send_signal(signal.SIGHUP)
            _, said = served.communicate(timeout=farlight_test.TIMEOUT_S)
            self.assertEqual(served.returncode, 1, said)
            self.assertIn("key was replaced", said)
            stats = self.expect(farlight("stats", "--server", daemon.reached, "--key", self.folder / "key"), 0)
            self.assertIn("farlightd", stats.stdout)

    def test_on_this_host_tcp_needs_the_key_and_sockets_do_not(self):
        with Daemon("--key-file", self.folder / "key", "--listen", "tcp:127.0.0.1:0") as daemon:
            loopback = daemon.process.stdout.readline().split()[1]
            self.expect(farlight("ping", "--server", daemon.address), 0)
            for address in (daemon.address, loopback):
                self.expect(farlight("ping", "--server", address, "--key", self.folder / "key"), 0)
            refused = self.expect(farlight("ping", "--server", loopback), 1)
            self.assertIn("--key", refused.stderr)

    def test_a_daemon_without_a_key_says_so(self):
        with Daemon() as daemon:
            result = self.expect(farlight("ping", "--server", daemon.address, "--key", self.folder / "key"), 1)
            self.assertIn("no key", result.stderr)
            self.assertIn("leave --key", result.stderr)
        result = farlight_test.run("farlightd", "--listen", "tcp:0.0.0.0:0")
        self.assertNotEqual(result.returncode, 0)
        self.assertIn("--key-file", result.stderr)

    def test_a_key_is_never_made_over_another(self):
        before = (self.folder / "key").read_bytes()
        self.assertEqual(len(before), 32)
        self.assertEqual((self.folder / "key").stat().st_mode & 0o777, 0o600)
        self.expect(farlight("key", self.folder / "key"), 1)
        self.assertEqual((self.folder / "key").read_bytes(), before)
        self.expect(farlight("key"), 2)


def read_exactly(connection, count):
    data = b""
    while len(data) < count:
        more = connection.recv(count - len(data))
        if not more:
            raise EOFError
        data += more
    return data


class Peer:
    """A client that has only read the document."""

    def __init__(self, daemon, key):
        self.socket, self.plain = daemon.connect(), b""
        self.seal = sealed_link.Client(key)
        self.said = []
        self.say(self.seal.message_1)
        self.say(self.seal.proving(read_exactly(self.socket, 72)))
        self.say(self.seal.seal(hello()))
        self.seal.finish(read_exactly(self.socket, 64))

    def say(self, data):
        self.said.append(data)
        self.socket.sendall(data)

    def read(self, count):
        while len(self.plain) < count:
            head = read_exactly(self.socket, 4)
            plain, tag = self.seal.open(head + read_exactly(self.socket, struct.unpack("<I", head)[0]))
            assert (tag == sealed_link.Stream.FINAL) == (not plain)
            if not plain:
                raise EOFError
            self.plain += plain
        data, self.plain = self.plain[:count], self.plain[count:]
        return data

    def read_reply(self):
        head = self.read(48)
        limits = struct.unpack_from("<H", head, 6)[0]
        rest = self.read(limits + 1)
        text = self.read(rest[-1] + 1)
        self.read(text[-1])
        self.read(-(48 + limits + 1 + rest[-1] + 1 + text[-1]) % 8)
        return struct.unpack_from("<H", head, 4)[0]

    def answer(self, request):
        while True:
            size, kind, _, of, _ = struct.unpack("<IHHII", self.read(16))
            payload = self.read(size + -size % 8)[:size]
            if of == request:
                return kind, payload


def try_key(daemon, key):
    """A connection that has sent its proof."""
    connection, seal = daemon.connect(), sealed_link.Client(key)
    connection.sendall(seal.message_1)
    connection.sendall(seal.proving(read_exactly(connection, 72)))
    return connection


class WrongKeys(Case):
    def test_the_right_key_gets_in_beside_wrong_ones_from_its_address(self):
        for name in ("key", "reader"):
            self.expect(farlight("key", self.folder / name), 0)
        wrong, over = [], threading.Event()

        def attack(daemon, hello):
            """As fast as it can, and without computing anything."""
            while not over.is_set():
                try:
                    with daemon.connect() as connection:
                        connection.sendall(hello)
                        read_exactly(connection, 72)
                        connection.sendall(b"SEAL\3\0\0\0" + os.urandom(56))
                        wrong.append(connection.getsockname())
                except (OSError, EOFError):
                    pass

        with SealedDaemon(self.folder) as daemon:
            hello = sealed_link.Client(bytes(32)).message_1
            attackers = [threading.Thread(target=attack, args=(daemon, hello)) for _ in range(3)]
            for attacker in attackers:
                attacker.start()
            try:
                while len(wrong) < 50:
                    time.sleep(0.01)
                for _ in range(5):
                    self.expect(farlight("ping", "--server", daemon.reached, "--key", self.folder / "key", "--retry-for", "1m"), 0)
            finally:
                over.set()
                for attacker in attackers:
                    attacker.join()

    def test_handshakes_beyond_the_rate_wait_for_their_turn(self):
        for name in ("key", "reader"):
            self.expect(farlight("key", self.folder / name), 0)
        with SealedDaemon(self.folder, environment=dict(os.environ, FARLIGHT_LIMITS_HANDSHAKES="1")) as daemon:
            begin = time.monotonic()
            for _ in range(3):
                self.expect(farlight("ping", "--count", "1", "--server", daemon.reached, "--key", self.folder / "key"), 0)
            self.assertGreater(time.monotonic() - begin, 2)

    def test_clients_that_wait_for_their_refusal_count_as_not_introduced(self):
        for name in ("key", "reader"):
            self.expect(farlight("key", self.folder / name), 0)
        # One of them is closed neither for its key nor for its time while this lasts.
        slowly = dict(os.environ, FARLIGHT_NETWORK_WRONG_KEY="60000", FARLIGHT_NETWORK_HANDSHAKE="600000")
        with SealedDaemon(self.folder, environment=slowly) as daemon:
            tries = [try_key(daemon, bytes([i]) * 32) for i in range(8)]
            ninth = daemon.connect()  # takes the place of one of them, chosen at random
            closed, _, _ = select.select(tries, [], [], farlight_test.TIMEOUT_S)
            self.assertEqual([each.recv(4) for each in closed], [b"FARL"])  # not b"SEAL", which begins the refusal of a key
            for each in (*tries, ninth):
                each.close()
            self.expect(farlight("ping", "--server", daemon.reached, "--key", self.folder / "key"), 0)


class OnTheWay(Case):
    """Somebody between the client and the daemon, or with what he has heard there."""

    @classmethod
    def setUpClass(cls):
        cls.keys = pathlib.Path(farlight_test.tempfile.mkdtemp(prefix="farlight-keys-"))
        cls.addClassCleanup(farlight_test.shutil.rmtree, cls.keys, ignore_errors=True)
        for name in ("key", "reader"):
            assert farlight("key", cls.keys / name).returncode == 0
        cls.daemon = SealedDaemon(cls.keys)
        cls.daemon.__enter__()
        cls.addClassCleanup(cls.daemon.__exit__)

    def peer(self):
        peer = Peer(self.daemon, (self.keys / "key").read_bytes())
        self.addCleanup(peer.socket.close)
        self.assertEqual(peer.read_reply(), 2)
        return peer

    def test_a_client_written_from_the_document_gets_its_answer(self):
        peer = self.peer()
        for request in range(1, 4):
            peer.say(peer.seal.seal(message(PING, request, struct.pack("<Q", 42))))
            kind, payload = peer.answer(request)
            self.assertEqual(kind, PONG)
            self.assertEqual(struct.unpack_from("<Q", payload, 2)[0], 42)

    def test_what_was_heard_once_is_of_no_use(self):
        peer = self.peer()
        peer.say(peer.seal.seal(message(PING, 1, struct.pack("<Q", 42))))
        self.assertEqual(peer.answer(1)[0], PONG)
        with self.daemon.connect() as again:
            for data in peer.said:
                again.sendall(data)
            self.assertEqual(read_exactly(again, 72)[:5], b"SEAL\2")
            self.assertEqual(read_exactly(again, 8), b"SEAL\4\1\0\0")
            self.assertEqual(again.recv(1), b"")
        # The last record once more: the connection ends there, with an error that is sealed itself.
        peer.say(peer.said[-1])
        with self.assertRaises(EOFError):
            while True:
                self.assertNotEqual(peer.answer(1)[0], PONG)

    def proxy(self, change):
        """An address that leads to the daemon by way of change(bytes of its side so far, their offset)."""
        listener = socket.create_server(("127.0.0.1", 0))
        self.addCleanup(listener.close)

        def carry(source, target, changed):
            offset = 0
            try:
                while data := source.recv(65536):
                    there = change(data, offset) if changed else data
                    offset += len(data)
                    target.sendall(there)
                    if len(there) < len(data):
                        break
                target.shutdown(socket.SHUT_WR)
            except OSError:
                pass

        def serve():
            client, _ = listener.accept()
            with client, self.daemon.connect() as server:
                up = threading.Thread(target=carry, args=(client, server, False))
                up.start()
                carry(server, client, True)
                for end in (client, server):
                    try:
                        end.shutdown(socket.SHUT_RDWR)
                    except OSError:
                        pass  # it went away by itself
                up.join()

        thread = threading.Thread(target=serve)
        thread.start()
        self.addCleanup(thread.join)
        return f"tcp:127.0.0.1:{listener.getsockname()[1]}"

    def test_a_changed_byte_is_noticed_wherever_it_is(self):
        # Of the daemon's side: message 2, message 4, and records of the handshake and after it. Not the length of a
        # record: with that changed the client waits for what does not come.
        for at in (0, 4, 8, 60, 72, 80, 110, 150, 250):
            def change(data, offset, at=at):
                if offset <= at < offset + len(data):
                    data = bytearray(data)
                    data[at - offset] ^= 0x10
                return bytes(data)
            result = farlight("ping", "--count", "100", "--server", self.proxy(change), "--key", self.keys / "key",
                              timeout=120)
            self.assertEqual(result.returncode, 1, f"byte {at}: {result.stdout}")

    def test_a_connection_that_is_cut_is_noticed(self):
        for at in (10, 72, 100, 136, 200, 400):
            def change(data, offset, at=at):
                return data[:max(0, at - offset)]
            result = farlight("ping", "--count", "100", "--server", self.proxy(change), "--key", self.keys / "key",
                              timeout=120)
            self.assertEqual(result.returncode, 75, f"byte {at}: {result.stdout}")
            self.assertIn("closed the connection", result.stderr)


if __name__ == "__main__":
    farlight_test.unittest.main()
