# SPDX-License-Identifier: MIT
"""A daemon that is meant to run for months: told to read its configuration again, and under a service manager."""
import contextlib
import ctypes
import itertools
import os
import pathlib
import signal
import socket
import struct
import sys
import time

import farlight_test
import sealed_link
import tiny_client
from farlight_test import Case, Daemon
from test_daemon import ERROR, GOODBYE, LIMIT, OK, PING, PONG, SCENE_OPEN, STATS, Peer, error_code, hello, message, text
from test_serve import wait_until

PONG_1 = struct.pack("<HHI", PONG, 0, 1)  # within the header of the answer to request 1

DEVICE_LOST, SHUTTING_DOWN = 11, 14  # error_code

READ_AGAIN, STAYS = "read again", "stays as it was"


class Manager:
    """A service manager as far as the daemon sees one: it listens to what it is told."""

    def __init__(self, folder):
        self.path = str(folder / "notify")
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.settimeout(farlight_test.TIMEOUT_S)
        self.socket.bind(self.path)
        self.told = []

    def environment(self, **more):
        return {**os.environ, "NOTIFY_SOCKET": self.path, **more}

    def hear(self):
        """The next datagram, as a dictionary."""
        lines = self.socket.recv(4096).decode().splitlines()
        self.told.append(dict(line.split("=", 1) for line in lines))
        return self.told[-1]

    def wait_for(self, name):
        while name not in (one := self.hear()):
            pass
        return one

    def close(self):
        self.socket.close()


# Becomes the daemon with the descriptors that are named first, as a service manager hands them over.
LAUNCHER = """
import os, sys
fds = [int(word) for word in sys.argv[1].split(",")]
for place, fd in enumerate(fds):
    os.dup2(fd, 100 + place)
for place in range(len(fds)):
    os.dup2(100 + place, 3 + place)
os.environ["LISTEN_PID"] = str(os.getpid() + (sys.argv[2] == "another"))
os.execv(sys.argv[3], sys.argv[3:])
"""


class Activation(Case):
    """Sockets that were there before the daemon."""

    def setUp(self):
        super().setUp()
        self.elsewhere = self.folder / "elsewhere"
        self.path = self.folder / "activated"
        self.unix = socket.socket(socket.AF_UNIX)
        self.unix.bind(str(self.path))
        self.tcp = socket.socket()
        self.tcp.bind(("127.0.0.1", 0))
        for one in (self.unix, self.tcp):
            self.addCleanup(one.close)

    def daemon(self, *sockets, whose="own", **more):
        fds = [one.fileno() for one in sockets]
        environment = {**os.environ, "LISTEN_FDS": str(len(fds)), "LISTEN_FDNAMES": "first:second", **more}
        return Daemon(listen=f"unix:{self.elsewhere}", environment=environment, pass_fds=fds,
                      launcher=[sys.executable, "-c", LAUNCHER, ",".join(map(str, fds)), whose])

    def test_inherited_sockets_replace_addresses_and_outlive_the_daemon(self):
        self.unix.listen()
        self.tcp.listen()
        address = f"tcp:127.0.0.1:{self.tcp.getsockname()[1]}"
        for _ in range(2):
            # Who comes while nobody is there waits.
            early = socket.socket(socket.AF_UNIX)
            self.addCleanup(early.close)
            early.settimeout(farlight_test.TIMEOUT_S)
            early.connect(str(self.path))
            early.sendall(hello())
            with self.daemon(self.unix, self.tcp) as daemon:
                self.assertEqual(daemon.ready, [f"READY unix:{self.path}"])
                self.assertEqual(early.recv(4), b"FARL")
                self.expect(farlight_test.farlight("stats", "--server", address), 0)
                self.assertFalse(self.elsewhere.exists())
                self.assertEqual(daemon.stop(), 0)
            self.assertTrue(self.path.exists())

    def test_a_daemon_that_has_had_no_client_for_a_while_ends(self):
        """A client that came before the daemon began is its client from the beginning."""
        self.unix.listen()
        client = socket.socket(socket.AF_UNIX)
        self.addCleanup(client.close)
        client.connect(str(self.path))
        client.sendall(hello())
        with self.daemon(self.unix, FARLIGHT_SERVER_UNUSED="1") as daemon:
            time.sleep(2)
            self.assertIsNone(daemon.process.poll())
            client.close()
            self.assertEqual(daemon.process.wait(farlight_test.TIMEOUT_S), 0)

    def test_those_of_another_process_are_left_alone(self):
        self.unix.listen()
        with self.daemon(self.unix, whose="another") as daemon:
            self.assertEqual(daemon.ready, [f"READY unix:{self.elsewhere}"])
            Peer(daemon).close()

    def test_what_does_not_listen_is_refused_by_its_name(self):
        self.tcp.listen()
        with self.assertRaises(AssertionError) as failure:
            self.daemon(self.tcp, self.unix).__enter__()
        self.assertIn("ended with 1", str(failure.exception))
        self.assertIn("second", str(failure.exception))
        self.assertIn("Accept=no", str(failure.exception))

    def test_beyond_loopback_the_same_rules_hold(self):
        everywhere = socket.socket()
        self.addCleanup(everywhere.close)
        everywhere.bind(("0.0.0.0", 0))
        everywhere.listen()
        with self.assertRaises(AssertionError) as failure:
            self.daemon(everywhere).__enter__()
        self.assertIn("--insecure", str(failure.exception))


class Reading(Case):
    """SIGHUP."""

    def setUp(self):
        super().setUp()
        self.config = self.folder / "farlightd.conf"
        self.manager = Manager(self.folder)
        self.addCleanup(self.manager.close)

    def daemon(self, *arguments, **options):
        return Daemon("--config", self.config, *arguments, environment=self.manager.environment(), **options)

    def reload(self, daemon, words):
        """Sends the signal, and waits until the daemon has said all that it says; which that is."""
        said_before = len(daemon.messages())
        before = time.clock_gettime_ns(time.CLOCK_MONOTONIC) // 1000
        daemon.process.send_signal(signal.SIGHUP)
        told = self.manager.wait_for("RELOADING")
        self.assertGreaterEqual(int(told["MONOTONIC_USEC"]), before)
        self.assertEqual(self.manager.hear(), {"READY": "1"})
        log = daemon.messages()[said_before:]
        self.assertEqual(log.count(READ_AGAIN) + log.count(STAYS), 1, log)
        self.assertIn(words, log)
        return log

    def scenes_that_open(self, peer, first, count):
        """How many of them, of one client, before the limit."""
        for scene in range(first, first + count):
            peer.send(SCENE_OPEN, scene, struct.pack("<I", scene), text("x"))
            kind, payload = peer.answer(scene)
            if kind == ERROR:
                self.assertEqual(error_code(payload), LIMIT)
                return scene - first
            self.assertEqual(kind, OK)
        return count

    def test_limits_are_read_again_for_new_and_present_clients(self):
        self.config.write_text("[limits]\nscenes = 2\n")
        with self.daemon() as daemon:
            before = Peer(daemon)
            self.assertEqual(self.scenes_that_open(before, 1, 9), 2)
            self.config.write_text("[limits]\nscenes = 4\n")
            self.reload(daemon, READ_AGAIN)
            self.assertEqual(self.scenes_that_open(before, 10, 9), 2)
            after = Peer(daemon)
            self.assertEqual(self.scenes_that_open(after, 1, 9), 4)
            before.close()
            after.close()

    def test_a_broken_file_changes_nothing_and_is_named_with_its_line(self):
        self.config.write_text("[limits]\nscenes = 2\n")
        with self.daemon() as daemon:
            self.config.write_text("[limits]\nscenes = 4\nrequests = lots\n")
            log = self.reload(daemon, STAYS)
            self.assertIn(f"{self.config}:3", log)
            peer = Peer(daemon)
            self.assertEqual(self.scenes_that_open(peer, 1, 9), 2)
            peer.close()
            self.config.unlink()
            self.reload(daemon, STAYS)
            self.config.write_text("[limits]\nscenes = 5\n")
            self.reload(daemon, READ_AGAIN)
            peer = Peer(daemon)
            self.assertEqual(self.scenes_that_open(peer, 1, 9), 5)
            peer.close()

    def test_what_needs_a_restart_is_named_and_stays(self):
        self.config.write_text("")
        with self.daemon() as daemon:
            self.config.write_text(f"[engine]\nencode_threads = 1\n[server]\ntrace_file = {self.folder}/trace\n")
            log = self.reload(daemon, READ_AGAIN)
            for name in ("engine.encode_threads", "server.trace_file"):
                line = next(line for line in log.splitlines() if name in line)
                self.assertIn("restart", line)
            self.assertFalse((self.folder / "trace").exists())
            Peer(daemon).close()

    def test_the_command_line_still_overrides(self):
        self.config.write_text("[server]\nlog_level = info\n")
        with self.daemon("--log-level", "debug") as daemon:
            self.config.write_text("[server]\nlog_level = error\n")
            log = self.reload(daemon, READ_AGAIN)
            self.assertNotIn("server.log_level", log)
            Peer(daemon).close()

    def test_keys_are_read_again(self):
        keys = [self.folder / name for name in ("key", "other")]
        for key in keys:
            self.expect(farlight_test.farlight("key", key), 0)
        self.config.write_text(f"[server]\nkey_file = {keys[0]}\n[network]\nwrong_key = 0\n")
        with self.daemon(listen="tcp:127.0.0.1:0") as daemon:
            address = daemon.ready[0].split()[1]

            def comes_in(key):
                return farlight_test.farlight("stats", "--server", address, "--key", key).returncode == 0

            self.assertTrue(comes_in(keys[0]))
            self.assertFalse(comes_in(keys[1]))
            self.config.write_text(self.config.read_text().replace(str(keys[0]), str(keys[1])))
            self.reload(daemon, READ_AGAIN)
            self.assertFalse(comes_in(keys[0]))
            self.assertTrue(comes_in(keys[1]))
            keys[1].chmod(0o644)
            log = self.reload(daemon, STAYS)
            self.assertIn(str(keys[1]), log)
            keys[1].chmod(0o600)
            self.assertTrue(comes_in(keys[1]))

    def test_a_handshake_in_progress_ends_with_the_former_keys_and_is_told_of_the_new_one(self):
        """A proof is for the keys that were there when it began; its holder is then sent away, as all holders of that key."""
        keys = [self.folder / name for name in ("key", "other")]
        for key in keys:
            self.expect(farlight_test.farlight("key", key), 0)
        old, new = (key.read_bytes() for key in keys)
        self.config.write_text(f"[server]\nkey_file = {keys[0]}\n[network]\nwrong_key = 0\n")
        with self.daemon(listen="tcp:127.0.0.1:0") as daemon:
            under_way = [self.begin_sealed(daemon, key) for key in (old, new)]
            self.config.write_text(self.config.read_text().replace(str(keys[0]), str(keys[1])))
            self.reload(daemon, READ_AGAIN)
            said = self.end_sealed(*under_way[0])
            self.assertIn(b"key was replaced", said)
            self.assertNotIn(PONG_1, said)
            with self.assertRaises(sealed_link.Refused):
                self.end_sealed(*under_way[1])
            self.assertIn(PONG_1, self.end_sealed(*self.begin_sealed(daemon, new)))
            with self.assertRaises(sealed_link.Refused):
                self.end_sealed(*self.begin_sealed(daemon, old))

    def begin_sealed(self, daemon, key):
        """Up to where the daemon waits for the proof."""
        connection = socket.create_connection(("127.0.0.1", int(daemon.ready[0].rpartition(":")[2])))
        self.addCleanup(connection.close)
        connection.settimeout(farlight_test.TIMEOUT_S)
        client = sealed_link.Client(key)
        connection.sendall(client.message_1)
        return connection, client, connection.recv(72, socket.MSG_WAITALL)

    def end_sealed(self, connection, client, message_2):
        """What the daemon says, until it answers a ping or closes."""
        connection.sendall(client.proving(message_2))
        client.finish(connection.recv(64, socket.MSG_WAITALL))
        connection.sendall(client.seal(hello() + message(PING, 1, struct.pack("<Q", 1))))
        plain = b""
        while PONG_1 not in plain and (head := connection.recv(4, socket.MSG_WAITALL)):
            plain += client.open(head + connection.recv(struct.unpack("<I", head)[0], socket.MSG_WAITALL))[0]
        return plain


class Losing(Daemon):
    """A daemon whose GPU is lost as often as it is told to."""

    def __init__(self, folder, *arguments):
        self.losses = folder / "losses"
        self.losses.write_bytes(b"")
        super().__init__(*arguments, environment={**os.environ, "FARLIGHT_TEST_LOSSES": str(self.losses)},
                         program="tests/tools/farlightd_losing")

    def lose(self, times):
        self.losses.write_bytes(b"x" * times)

    def left(self):
        """How many of them are still to come."""
        return self.losses.stat().st_size


def code_bytes(process):
    """Memory for code that a driver makes at run time. Mesa's has 10 MiB of it, which it does not give back when it is unloaded."""
    total = 0
    for line in pathlib.Path(f"/proc/{process}/maps").read_text().splitlines():
        where, rights, _, _, _, *file = line.split()
        begin, end = (int(word, 16) for word in where.split("-"))
        total += end - begin if rights.startswith("rwx") and not file else 0
    return total


LEFT, RIGHT = (((x, 1, 5), (0, 0, 0), (0, 1, 0), 0.8) for x in (-2, 2))
SAMPLES = 4  # of a picture that rests


class LostGpu(Case):
    def client(self, daemon, name=""):
        client = tiny_client.Client(daemon.path)
        self.addCleanup(client.socket.close)
        blobs, edits = tiny_client.triangle()
        client.open_scene(1, name, tiny_client.SHARED if name else tiny_client.PRIVATE)
        client.upload(blobs)
        client.commit(1, edits)
        return client

    @staticmethod
    def rests(client, command, camera):
        """Digest of the picture that a view comes to, once it is told to look from there; numbers of its frames."""
        client.look(2, command, camera)
        numbers = []
        while True:
            frame = client.next_frame()
            numbers.append(frame.number)
            client.raise_credit(2, frame.number + 3)
            if (frame.command, frame.samples) == (command, SAMPLES):
                return frame.digest, numbers

    def test_a_view_continues_and_shows_the_same_pictures(self):
        with Losing(self.folder) as daemon:
            client = self.client(daemon)
            view = client.render(1, 2, (64, 48), LEFT, kind=tiny_client.VIEW, samples=SAMPLES, credit=2)
            left, numbers = self.rests(client, 1, LEFT)
            right, more = self.rests(client, 2, RIGHT)
            numbers += more
            self.assertNotEqual(left, right)
            worker, = daemon.workers()
            before = code_bytes(worker)
            for command, camera, digest in ((3, LEFT, left), (4, RIGHT, right)):
                daemon.lose(1)
                again, more = self.rests(client, command, camera)
                numbers += more
                self.assertEqual(daemon.left(), 0)
                self.assertEqual(again, digest)
            self.assertEqual(code_bytes(worker), before)
            self.assertEqual(numbers, list(range(len(numbers))))  # none is lost, none comes twice
            self.assertEqual(client.cancel(view).code, tiny_client.CANCELLED)
            self.assertEqual(client.say_goodbye(), b"")
            self.assertEqual(daemon.messages().count("the GPU was lost; opening it again"), 2)
            self.assertEqual(daemon.stop(), 0)

    def test_a_job_that_keeps_losing_the_gpu_is_put_aside_and_others_continue(self):
        with Losing(self.folder) as daemon:
            client, other = self.client(daemon), self.client(daemon)
            daemon.lose(3)
            with self.assertRaises(tiny_client.Failed) as failure:
                client.wait(client.render(1, 2, (32, 24), LEFT))
            self.assertEqual(failure.exception.code, DEVICE_LOST)
            self.assertIn("put aside", str(failure.exception))
            self.assertEqual(daemon.left(), 0, daemon.messages())
            other.wait(other.render(1, 2, (32, 24), LEFT))
            self.assertEqual(len(other.frames), 1)
            self.assertEqual(daemon.stop(), 0)

    def test_a_gpu_that_is_lost_for_good_ends_its_users_worker_and_the_next_client_has_another(self):
        with Losing(self.folder) as daemon:
            client, bystander = self.client(daemon, "triangle"), Peer(daemon)
            daemon.lose(1000)
            with self.assertRaises(tiny_client.Failed) as failure:
                for channel in range(2, 9):
                    client.wait(client.render(1, channel, (32, 24), LEFT))
            self.assertEqual(failure.exception.code, DEVICE_LOST)
            with self.assertRaises((EOFError, ConnectionError, tiny_client.Failed)):
                for channel in range(9, 20):
                    try:
                        client.wait(client.render(1, channel, (32, 24), LEFT))
                    except tiny_client.Failed as again:
                        self.assertIn(again.code, (DEVICE_LOST, SHUTTING_DOWN))
            self.assertIn(GOODBYE, [kind for kind, _, _ in bystander.until_closed()])
            self.assertIn("lost for good", daemon.messages())
            daemon.lose(0)
            other = self.client(daemon)
            other.wait(other.render(1, 2, (32, 24), LEFT))
            self.assertEqual(len(other.frames), 1)
            self.assertEqual(daemon.stop(), 0)


PTRACE_ATTACH, PTRACE_DETACH, WALL = 16, 17, 0x40000000
INTERVAL_S = 1.0


class Frozen:
    """One thread of another process that does not run, as one that waits for a driver that hangs."""

    def __init__(self, process, name):
        folder = pathlib.Path(f"/proc/{process}/task")
        self.thread = next(int(one.name) for one in folder.iterdir() if (one / "comm").read_text().strip() == name)
        self.trace = ctypes.CDLL(None, use_errno=True).ptrace
        self.trace.argtypes = [ctypes.c_long] * 2 + [ctypes.c_void_p] * 2

    def __enter__(self):
        if self.trace(PTRACE_ATTACH, self.thread, None, None) < 0:
            raise farlight_test.unittest.SkipTest(f"ptrace: {os.strerror(ctypes.get_errno())}")
        os.waitpid(self.thread, WALL)
        return self

    def __exit__(self, *_):
        if self.trace(PTRACE_DETACH, self.thread, None, None) < 0:
            os.waitpid(self.thread, WALL)  # it was killed: who traces it is told first


class Watchdog(Case):
    def setUp(self):
        super().setUp()
        self.manager = Manager(self.folder)
        self.addCleanup(self.manager.close)

    def environment(self, **more):
        return self.manager.environment(WATCHDOG_USEC=str(int(INTERVAL_S * 1e6)), **more)

    def drop_pings(self):
        """Those that have come so far."""
        self.manager.socket.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            while True:
                self.manager.hear()
        self.manager.socket.settimeout(farlight_test.TIMEOUT_S)

    def pings(self, seconds):
        """How many come within that time."""
        count, end = 0, time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self.manager.socket.settimeout(left)
            try:
                count += "WATCHDOG" in self.manager.hear()
            except TimeoutError:
                break
        self.manager.socket.settimeout(farlight_test.TIMEOUT_S)
        return count

    def test_it_pings_always_and_a_worker_whose_gpu_hangs_is_killed(self):
        with Daemon(environment=self.environment()) as daemon:
            self.manager.wait_for("WATCHDOG")  # while it is idle
            child = farlight_test.subprocess.Popen(
                [farlight_test.BIN / "farlight", "animate", farlight_test.bundled_scenes() / "teapot.glb", "--server",
                 daemon.address, "--frames", "1-1", "--samples", "65536", "-o", self.folder / "%04d.png"],
                stdout=farlight_test.subprocess.DEVNULL, stderr=farlight_test.subprocess.DEVNULL)
            try:
                self.wait_for_a_job(daemon)
                self.drop_pings()
                self.manager.wait_for("WATCHDOG")  # while it works
                worker = daemon.workers()[0]
                with Frozen(worker, "gl"):
                    self.drop_pings()
                    wait_until(lambda: "its GPU does not answer" in daemon.messages(), "a worker that hangs goes on")
                wait_until(lambda: worker not in daemon.workers(), "it was not killed")
                self.manager.wait_for("WATCHDOG")
                peer = Peer(daemon)  # another worker serves
                peer.send(PING, 1, struct.pack("<Q", 1))
                self.assertEqual(peer.answer(1)[0], PONG)
                peer.close()
            finally:
                child.kill()
                child.wait()

    def wait_for_a_job(self, daemon):
        """It is one long frame, so from then on the thread has always something to do."""
        peer = Peer(daemon)
        end = time.monotonic() + farlight_test.TIMEOUT_S
        for request in itertools.count(1):
            peer.send(STATS, request)
            _, payload = peer.answer(request)
            if struct.unpack_from("<I", payload, 2 + 8 * 8 + 4)[0] > 0:  # as in test_daemon.py
                peer.close()
                return
            self.assertLess(time.monotonic(), end, "no job comes")
            time.sleep(0.02)

    def test_a_manager_that_does_not_listen_holds_no_client_up(self):
        with Daemon(environment=self.manager.environment(WATCHDOG_USEC="400000")) as daemon:
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as other:
                other.setblocking(False)
                with self.assertRaises(BlockingIOError):
                    while True:
                        other.sendto(b"STATUS=x", self.manager.path)
            time.sleep(0.5)  # pings that there is no room for
            peer = Peer(daemon)
            peer.send(PING, 1, struct.pack("<Q", 1))
            self.assertEqual(peer.answer(1)[0], PONG)
            peer.close()

    def test_one_for_another_process_is_left_alone(self):
        with Daemon(environment=self.environment(WATCHDOG_PID="1")):
            self.assertEqual(self.pings(INTERVAL_S), 0)
            self.assertEqual(self.manager.told[:1], [{"READY": "1"}])

    def test_the_manager_hears_of_the_start_and_of_the_end(self):
        with Daemon(environment=self.manager.environment()) as daemon:
            self.assertEqual(self.manager.hear(), {"READY": "1"})
            daemon.stop()
            self.assertEqual(self.manager.hear(), {"STOPPING": "1"})


if __name__ == "__main__":
    farlight_test.unittest.main()
