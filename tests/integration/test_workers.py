# SPDX-License-Identifier: MIT
"""A user is a process: who comes is served by the worker of his user or address, which breaks, hangs and ends alone."""
import contextlib
import json
import os
import signal
import socket
import struct
import subprocess
import time

import tiny_client
from farlight_test import Case, Daemon, Paced, bundled_scenes, farlight, long_test
from test_serve import SCENE_ATTACH, is_gone, wait_until

LOOK = (0, 1, 5), (0, 0, 0), (0, 1, 0), 0.8
TERM_S = 20  # of SIGTERM, which takes 0.6 s and the time that a busy machine takes; a worker that is silent for 30 s is killed


class Workers(Case):
    @contextlib.contextmanager
    def daemon(self, **options):
        """One that listens for a user, and for whom nobody knows; its TCP address."""
        with Daemon("--listen", "tcp:127.0.0.1:0", **options) as daemon:
            daemon.tcp = ("127.0.0.1", int(daemon.process.stdout.readline().rpartition(":")[2]))
            yield daemon

    def client(self, where, name="", sharing=tiny_client.PRIVATE):
        """With a scene of its own."""
        client = tiny_client.Client(where)
        self.addCleanup(client.socket.close)
        blobs, edits = tiny_client.triangle()
        client.open_scene(1, name, sharing)
        client.upload(blobs)
        client.commit(1, edits)
        return client

    @staticmethod
    def attach(client, name, scene=1):
        return client.ask(SCENE_ATTACH, tiny_client.payload(struct.pack("<I", scene), tiny_client.string(name)))

    def renders(self, client, channel=2):
        count = len(client.frames)
        client.wait(client.render(1, channel, (32, 24), LOOK))
        self.assertEqual(len(client.frames), count + 1)
        return client.frames[-1].digest

    def test_each_has_a_process_and_figures_are_of_all(self):
        with self.daemon() as daemon:
            one, other = self.client(daemon.path), self.client(daemon.tcp)
            self.assertEqual(self.renders(one), self.renders(other))
            self.assertEqual(len(daemon.workers()), 2)
            self.client(daemon.path)
            self.assertEqual(len(daemon.workers()), 2)
            stats = json.loads(self.expect(farlight("stats", "--json", "--server", daemon.address), 0).stdout)
            self.assertEqual(len(stats["clients"]), 4)
            self.assertEqual(len(stats["scenes"]), 3)
            self.assertEqual(stats["frames"], 2)
            self.assertEqual(len({client["client"] for client in stats["clients"]}), 4)

    def test_one_that_is_killed_ends_alone_and_its_clients_go_on_with_another(self):
        frames = ["--frames", "1-12", "--samples", "2", "--size", "96x72", "--digests"]
        model = bundled_scenes() / "carousel.glb"
        self.expect(farlight("animate", model, *frames, "-o", self.folder / "whole-%d.png"), 0)
        with self.daemon() as daemon:
            other = self.client(daemon.tcp)
            before = self.renders(other)
            of_other = set(daemon.workers())
            with Paced(self.folder, "%d.png", model, *frames, "--server", daemon.address) as client:
                client.until("frame 2:")
                killed, = set(daemon.workers()) - of_other
                os.kill(killed, signal.SIGKILL)
                self.assertEqual(client.finish(), (0, client.errors))
            self.assertIn("trying again", client.errors)
            self.assertEqual(self.renders(other, 3), before)
        for number in range(1, 13):
            self.assertEqual((client.folder / f"{number}.png").read_bytes(), (self.folder / f"whole-{number}.png").read_bytes())

    def test_a_scene_of_another_user_is_attached_to_by_the_first_request(self):
        with self.daemon() as daemon:
            owner = self.client(daemon.tcp, "shown", tiny_client.SHARED)
            guest = tiny_client.Client(daemon.path)
            self.addCleanup(guest.socket.close)
            guest.revision(self.attach(guest, "shown"))
            self.assertEqual(self.renders(guest), self.renders(owner))
            for name in ("shown", "nothing"):
                busy = self.client(daemon.path)
                with self.assertRaises(tiny_client.Failed) as failure:
                    busy.revision(self.attach(busy, name, 2))
                self.assertEqual("no other request" in str(failure.exception), name == "shown", failure.exception)
                self.assertEqual("is shared, or kept" in str(failure.exception), name == "nothing", failure.exception)
                self.renders(busy)
            self.assertIn("shown", self.expect(farlight("scenes", "--server", daemon.address), 0).stdout)

    def test_what_does_not_answer_holds_up_neither_figures_nor_the_end(self):
        with self.daemon() as daemon:
            self.client(daemon.path)
            before = set(daemon.workers())
            self.client(daemon.tcp)
            stopped, = set(daemon.workers()) - before
            os.kill(stopped, signal.SIGSTOP)
            begin = time.monotonic()
            self.expect(farlight("stats", "--server", daemon.address), 0)
            self.assertLess(time.monotonic() - begin, TERM_S)
            begin = time.monotonic()
            self.assertEqual(daemon.stop(), 0)
            self.assertLess(time.monotonic() - begin, TERM_S)
            self.assertTrue(is_gone(stopped))

    @long_test
    def test_one_that_does_not_answer_for_long_is_replaced(self):
        with self.daemon() as daemon:
            self.client(daemon.path)
            stopped, = daemon.workers()
            os.kill(stopped, signal.SIGSTOP)
            wait_until(lambda: is_gone(stopped), "it is there still")
            self.renders(self.client(daemon.path))
            self.assertIn("it does not answer", daemon.messages())

    def refusal(self, where):
        """What a client is told that is not let in."""
        with self.assertRaises(tiny_client.Failed) as refused:
            self.addCleanup(tiny_client.Client(where).socket.close)
        return str(refused.exception)

    def test_one_client_too_many_is_refused_and_may_come_later_and_the_daemons_user_finds_a_place(self):
        with self.daemon(environment={**os.environ, "FARLIGHT_LIMITS_CLIENTS": "2", "FARLIGHT_LIMITS_SHARE": "100"}) as daemon:
            one, other = self.client(daemon.tcp), self.client(daemon.tcp)
            self.assertIn("2 clients are connected", self.refusal(daemon.tcp))
            at_home = [self.client(daemon.path) for _ in range(4)]
            self.assertIn("2 clients are connected", self.refusal(daemon.path))
            for client in (one, other, *at_home):
                self.renders(client)
            for client in (other, *at_home):
                client.socket.close()
            def comes_in():
                with contextlib.suppress(tiny_client.Failed):
                    return self.client(daemon.tcp)
                return None
            wait_until(comes_in, "they are there still")

    def test_one_network_leaves_places_for_others_and_the_daemons_user_has_all(self):
        with self.daemon(environment={**os.environ, "FARLIGHT_LIMITS_CLIENTS": "6", "FARLIGHT_LIMITS_SHARE": "50"}) as daemon:
            several = [self.client(daemon.tcp) for _ in range(3)]
            self.assertIn("3 of 6 places", self.refusal(daemon.tcp))
            for client in (*(self.client(daemon.path) for _ in range(4)), *several):
                self.renders(client)

    def test_silent_connections_keep_no_one_out(self):
        """They give way to the next, whosever they are: only a client of their own may have to come again."""
        limits = {"FARLIGHT_LIMITS_UNAUTHENTICATED": "8", "FARLIGHT_LIMITS_UNAUTHENTICATED_PER_ADDRESS": "64",
                  "FARLIGHT_NETWORK_HANDSHAKE": "600000"}
        with self.daemon(environment={**os.environ, **limits}) as daemon:
            client = self.client(daemon.path)
            silent = [socket.create_connection(daemon.tcp) for _ in range(32)]
            self.renders(client)
            self.renders(self.client(daemon.path))  # comes last, and has a place
            told = 0
            for one in silent:
                one.settimeout(0.1)
                with contextlib.suppress(TimeoutError):
                    told += b"have not introduced themselves" in one.recv(4096)
                one.close()
            self.assertGreaterEqual(told, 32 - 4)  # half of the limit may stay

    def test_the_daemon_ends_with_the_client_that_has_started_it_though_that_says_nothing(self):
        ours, theirs = socket.socketpair()
        with theirs, ours, Daemon("--fd", theirs.fileno(), pass_fds=[theirs.fileno()]) as daemon:
            theirs.close()
            ours.close()
            self.assertEqual(daemon.process.wait(60), 0)

    def test_workers_end_with_the_front_however_that_ends(self):
        with self.daemon() as daemon:
            self.client(daemon.path)
            self.client(daemon.tcp)
            workers = daemon.workers()
            self.assertEqual(len(workers), 2)
            daemon.process.kill()
            for worker in workers:
                wait_until(lambda worker=worker: is_gone(worker), "it is there still")
