#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Kills the daemon or the client of an animation at random moments, round after round, as happens on a farm: whoever was
killed is started again, by a service manager (the daemon) or by the farm's queue (the client, with --resume). Then every
frame is there, with the same bytes as without disturbance, and every exit status was right.
Exit status: 0 it held, 1 it did not, 2 wrong usage."""
import argparse
import collections
import contextlib
import os
import pathlib
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "integration"))
import farlight_test  # pylint: disable=wrong-import-position

ROUNDS = 1000
TIMEOUT_S = 120  # of one client
FRAMES = 8
TRY_AGAIN = 75
REQUEUED_MAX = 10
# The first as when a client comes to a daemon of its own; the others, to one that a service manager starts again, with a
# socket of its own or with the manager's, on which connections wait meanwhile.
KINDS = ("private", "listening", "activated")
SIGNALS = {"daemon": (signal.SIGKILL, signal.SIGKILL, signal.SIGTERM),
           "client": (signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT)}
MARK = "FARLIGHT_DRILL"  # in the environment of all that a drill starts
SCENE = """v
from 0 0 5
at 0 0 0
up 0 1 0
angle 40
hither 0.1
resolution 64 64
l 3 4 5
f 0.9 0.4 0.2 0.8 0.2 10 0 1
s 0.4 0 0 1
p 3
-2 -1 -2
2 -1 -2
0 -1 2
"""


class Wrong(Exception):
    """A round did not hold what was promised."""


class Service:
    """A daemon that is started again as soon as it has ended."""

    def __init__(self, folder, kind, environment):
        self.path, self.environment, self.kind = folder / f"{kind}.sock", environment, kind
        self.listener = None
        if kind == "activated":
            self.listener = socket.socket(socket.AF_UNIX)
            self.listener.bind(str(self.path))
            self.listener.listen(64)
        self.log = open(folder / f"{kind}.log", "w")  # pylint: disable=consider-using-with
        self.start()

    def start(self):
        command, fds = [farlight_test.BIN / "farlightd", "--listen", f"unix:{self.path}"], ()
        if self.listener:
            number = self.listener.fileno()
            fds = (number,)
            move = f"exec 3<&{number} {number}<&-; " if number != 3 else ""
            command = ["bash", "-c", move + 'LISTEN_PID=$$ LISTEN_FDS=1 exec "$0"', farlight_test.BIN / "farlightd"]
        self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=self.log, env=self.environment,
                                        pass_fds=fds)

    def kill(self, number):
        self.process.send_signal(number)
        status = self.process.wait(TIMEOUT_S)
        self.start()
        return status

    def close(self):
        self.process.kill()
        self.process.wait()
        self.log.close()
        if self.listener:
            self.listener.close()


def child(pid, name):
    """The child of a process that runs the program `name`; None: there is none."""
    with contextlib.suppress(OSError):
        for number in pathlib.Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
            with contextlib.suppress(OSError):
                if pathlib.Path(f"/proc/{number}/comm").read_text().strip() == name:
                    return int(number)
    return None


def marked(folder):
    """Numbers of the processes that a drill in `folder` has started, directly or not."""
    mark, found = f"{MARK}={folder}".encode(), []
    for path in pathlib.Path("/proc").glob("[0-9]*/environ"):
        with contextlib.suppress(OSError):
            if mark in path.read_bytes().split(b"\0"):
                found.append(int(path.parent.name))
    return found


class Drill:
    def __init__(self, folder, seed):
        self.folder, self.seed = pathlib.Path(folder), seed
        self.scene = self.folder / "scene.nff"
        self.scene.write_text(SCENE)
        self.environment = {**farlight_test.private_daemon(), MARK: str(self.folder),
                            "XDG_CACHE_HOME": os.environ.get("XDG_CACHE_HOME", str(self.folder / "cache"))}
        self.counts = collections.Counter()
        self.services, self.whole, self.whole_s = {}, {}, {}
        for kind in KINDS:
            if kind != "private":
                self.services[kind] = Service(self.folder, kind, self.environment)
            for ending in ("png", "exr"):
                # The first time fills caches.
                self.whole_s[kind, ending] = min(self.make_whole(kind, ending) for _ in range(3))

    def make_whole(self, kind, ending):
        """What an undisturbed run makes, which is the same of every daemon, and how long it takes."""
        out, begin = self.folder / "whole", time.monotonic()
        self.finish(self.start(out, ending, self.server(kind) + ["--retry-for", "1m"]), 0)
        needed_s = time.monotonic() - begin
        made = self.files(out)
        if len(made) != FRAMES or self.whole.setdefault(ending, made) != made:
            raise Wrong(f"undisturbed runs make {sorted(made)} and {sorted(self.whole[ending])}, or other bytes")
        shutil.rmtree(out)
        return needed_s

    @staticmethod
    def files(out):
        return {path.name: path.read_bytes() for path in out.iterdir()} if out.is_dir() else {}

    def start(self, out, ending, arguments):
        out.mkdir(exist_ok=True)
        return subprocess.Popen([farlight_test.BIN / "farlight", "animate", self.scene, "--frames", f"1-{FRAMES}", "--size",
                                 "64x64", "--samples", "6", "-o", out / f"%02d.{ending}", *arguments], stdout=subprocess.DEVNULL,
                                stderr=subprocess.PIPE, text=True, env=self.environment)

    @staticmethod
    def finish(client, *allowed):
        try:
            errors = client.communicate(timeout=TIMEOUT_S)[1]
        except subprocess.TimeoutExpired as late:
            client.kill()
            raise Wrong(f"the client did not end in {TIMEOUT_S} s: {client.communicate()[1]}") from late
        status = client.returncode
        if status not in allowed:
            raise Wrong(f"the client ended with {status}, not with one of {allowed}:\n{errors}")
        return status

    def server(self, kind):
        return [] if kind == "private" else ["--server", f"unix:{self.services[kind].path}"]

    def kill_daemon(self, kind, client, number):
        """False: it or its client has ended before."""
        if kind != "private":
            self.services[kind].kill(number)
            return True
        while client.poll() is None:
            pid = child(client.pid, "farlightd")
            if pid:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, number)
                    return True
            time.sleep(0.002)
        return False

    def disturb(self, client, out, delay_s, kind, victim, number):
        """Returns the statuses with which the client may end."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            client.wait(delay_s)
        if client.poll() is not None or (victim == "daemon" and not self.kill_daemon(kind, client, number)):
            self.counts["too late"] += 1
            return (0,)
        self.counts[f"{victim} killed while {'rendering' if any(out.iterdir()) else 'loading'}"] += 1
        if victim == "daemon":
            return (0,)
        client.send_signal(number)
        # It may have been about to end, or have been too young to know the signal.
        return (0, -number) if number == signal.SIGKILL else (0, -number, 128 + number)

    def round(self, number):
        chance = random.Random(f"{self.seed}/{number}")
        kind, victim, ending = chance.choice(KINDS), chance.choice(("daemon", "client")), chance.choice(("png", "exr"))
        sent, delay_s = chance.choice(SIGNALS[victim]), 0.95 * chance.random() ** 1.5 * self.whole_s[kind, ending]
        patient = chance.random() < 0.75
        out = self.folder / f"round-{number}"
        server = self.server(kind)
        if not patient:
            server += ["--retry-for", "0"]
        elif kind == "listening":
            server += ["--retry-for", "1m"]  # else a daemon that is not yet there again would end it
        client = self.start(out, ending, server)
        allowed = self.disturb(client, out, delay_s, kind, victim, sent)
        status = self.finish(client, *allowed, *(() if patient else (TRY_AGAIN,)))
        for _ in range(REQUEUED_MAX):
            if status == 0:
                break
            self.counts[f"requeued after {status if status >= 0 else signal.Signals(-status).name}"] += 1
            status = self.finish(self.start(out, ending, [*server, "--resume"]), 0, *(() if patient else (TRY_AGAIN,)))
            if status == TRY_AGAIN:
                time.sleep(0.2)
        self.check(out, ending)

    def check(self, out, ending):
        deadline = time.monotonic() + 20
        while sorted(path.name for path in out.iterdir()) != sorted(self.whole[ending]):
            if time.monotonic() > deadline:  # until then a killed client's helpers finish their files
                raise Wrong(f"there are {sorted(path.name for path in out.iterdir())}")
            time.sleep(0.01)
        made = self.files(out)
        for name, data in self.whole[ending].items():
            if made[name] != data:
                raise Wrong(f"{name} has other bytes than without disturbance")
        for name in made:
            (out / name).unlink()
        out.rmdir()

    def close(self):
        """Ends the daemons. Everything else must have ended by itself."""
        for service in self.services.values():
            service.close()
        deadline = time.monotonic() + 20
        while (left := marked(self.folder)) and time.monotonic() < deadline:
            time.sleep(0.05)
        if left:
            names = [pathlib.Path(f"/proc/{pid}/comm").read_text().strip() for pid in left]
            raise Wrong(f"processes are left over: {names}")


def drill(folder, rounds, seed, first=1):
    """Counts of what was done. Wrong: what failed, with how to do it again."""
    done = Drill(folder, seed)
    try:
        for number in range(first, first + rounds):
            try:
                done.round(number)
            except Wrong as wrong:
                raise Wrong(f"round {number} of seed {seed}: {wrong}") from wrong
    finally:
        done.close()
    return done.counts


def parse():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("build", type=pathlib.Path, help="folder of the programs")
    parser.add_argument("rounds", type=int, nargs="?", default=ROUNDS, help="%(default)s if not given")
    parser.add_argument("--seed", type=int, default=None, help="of what is killed, and when; random if not given")
    parser.add_argument("--first", type=int, default=1, help="number of the first round")
    return parser.parse_args()


def main():
    options = parse()
    farlight_test.BIN = options.build.resolve()
    seed = random.randrange(1 << 32) if options.seed is None else options.seed
    print(f"seed {seed}", flush=True)
    begin = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="farlight-drill-") as folder:
        try:
            counts = drill(folder, options.rounds, seed, options.first)
        except Wrong as wrong:
            print(f"WRONG: {wrong}")
            return 1
    print(f"{options.rounds} rounds in {time.monotonic() - begin:.0f} s, every frame there with the same bytes: "
          + ", ".join(f"{count} {what}" for what, count in sorted(counts.items())))
    return 0


if __name__ == "__main__":
    sys.exit(main())
