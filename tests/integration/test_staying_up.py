# SPDX-License-Identifier: MIT
"""A daemon that is meant to run for months: told to read its configuration again, and under a service manager."""
import ctypes
import os
import pathlib
import signal
import socket
import struct
import sys
import time

import farlight_test
from farlight_test import Case, Daemon
from test_daemon import ERROR, LIMIT, OK, PING, PONG, SCENE_OPEN, STATS, Peer, error_code, hello, text

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

    def test_sockets_are_taken_in_place_of_addresses_and_outlive_the_daemon(self):
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
        self.answers = 0

    def daemon(self, *arguments, **options):
        return Daemon("--config", self.config, *arguments, environment=self.manager.environment(), **options)

    def reload(self, daemon, words):
        """Sends the signal, and waits until the daemon has said all that it says."""
        self.answers += 1
        before = time.clock_gettime_ns(time.CLOCK_MONOTONIC) // 1000
        daemon.process.send_signal(signal.SIGHUP)
        told = self.manager.wait_for("RELOADING")
        self.assertGreaterEqual(int(told["MONOTONIC_USEC"]), before)
        self.assertEqual(self.manager.hear(), {"READY": "1"})
        log = daemon.messages()
        self.assertEqual(log.count(READ_AGAIN) + log.count(STAYS), self.answers, log)
        self.assertIn(words, log.splitlines()[-1])
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

    def test_limits_are_read_again_for_those_who_come_and_those_who_are_there(self):
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
            self.config.write_text(f"[engine]\nqueue = 64\n[server]\ntrace_file = {self.folder}/trace\n")
            log = self.reload(daemon, READ_AGAIN)
            for name in ("engine.queue", "server.trace_file"):
                line = next(line for line in log.splitlines() if name in line)
                self.assertIn("restart", line)
            self.assertFalse((self.folder / "trace").exists())
            Peer(daemon).close()

    def test_the_command_line_still_goes_first(self):
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
            self.assertIn(str(keys[1]), log.splitlines()[-1])
            keys[1].chmod(0o600)
            self.assertTrue(comes_in(keys[1]))


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
        self.trace(PTRACE_DETACH, self.thread, None, None)


class Watchdog(Case):
    def setUp(self):
        super().setUp()
        self.manager = Manager(self.folder)
        self.addCleanup(self.manager.close)

    def environment(self, **more):
        return self.manager.environment(WATCHDOG_USEC=str(int(INTERVAL_S * 1e6)), **more)

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

    def test_it_pings_while_idle_and_while_it_works_but_not_while_the_gpu_hangs(self):
        with Daemon(environment=self.environment()) as daemon:
            self.assertGreaterEqual(self.pings(INTERVAL_S * 1.5), 1, "idle")
            child = farlight_test.subprocess.Popen(
                [farlight_test.BIN / "farlight", "animate", farlight_test.bundled_scenes() / "teapot.glb", "--server",
                 daemon.address, "--frames", "1-1", "--samples", "65536", "-o", self.folder / "%04d.png"],
                stdout=farlight_test.subprocess.DEVNULL, stderr=farlight_test.subprocess.DEVNULL)
            try:
                self.wait_for_a_job(daemon)
                self.assertGreaterEqual(self.pings(INTERVAL_S * 3), 1, "at work")
                with Frozen(daemon.process.pid, "gl"):
                    self.pings(INTERVAL_S / 2)  # one may be on its way, for what went on before
                    self.assertEqual(self.pings(INTERVAL_S * 1.5), 0, "hung")
                    # The network's thread lives, and tells who asks; the manager is who ends it.
                    peer = Peer(daemon)
                    peer.send(PING, 1, struct.pack("<Q", 1))
                    self.assertEqual(peer.answer(1)[0], PONG)
                    peer.close()
                self.assertGreaterEqual(self.pings(INTERVAL_S * 3), 1, "again")
            finally:
                child.kill()
                child.wait()

    def wait_for_a_job(self, daemon):
        """It is one long frame, so from then on the thread has always something to do."""
        peer = Peer(daemon)
        for request in range(1, 10000):
            peer.send(STATS, request)
            _, payload = peer.answer(request)
            if struct.unpack_from("<I", payload, 2 + 8 * 8 + 4)[0] > 0:  # as in test_daemon.py
                peer.close()
                return
            time.sleep(0.02)
        self.fail("no job comes")

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
