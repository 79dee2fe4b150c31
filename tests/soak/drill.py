#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Kills the daemon or the client of an animation at random moments, round after round, as happens on a farm: whoever was
killed is started again, by a service manager (the daemon) or by the farm's queue (the client, with --resume). Then every
frame is there, with the same bytes as without disturbance, and every exit status was right.
Exit status: 0 it held, 1 it did not, 2 wrong usage."""
import argparse
import collections
import contextlib
import itertools
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
TIMEOUT_S = 120  # of one client, and of what a killed one's helpers still do
FRAMES = 8
TRY_AGAIN = 75
REQUEUED_MAX = 10
ENDINGS = ("png", "exr")
# The first as when a client comes to a daemon of its own; the others, to one that a service manager starts again, with a
# socket of its own or with the manager's, on which connections wait meanwhile.
KINDS = ("private", "listening", "activated")
SIGNALS = {"daemon": (signal.SIGKILL, signal.SIGKILL, signal.SIGTERM),
           "client": (signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT)}

# A kill: of the daemon or the client, with which signal; when: "loading" before the first picture, "rendering" after it, or
# as a share of what an undisturbed run takes; patient: the client waits for a daemon that is away.
Kill = collections.namedtuple("Kill", "kind victim ending signal when patient")
# Every victim at either moment, and every kind.
FEW = (Kill("private", "daemon", "png", signal.SIGKILL, "loading", True),
       Kill("listening", "daemon", "exr", signal.SIGKILL, "rendering", True),
       Kill("activated", "daemon", "png", signal.SIGTERM, "rendering", True),
       Kill("private", "client", "exr", signal.SIGKILL, "loading", True),
       Kill("listening", "client", "png", signal.SIGKILL, "rendering", False),
       Kill("activated", "client", "exr", signal.SIGINT, "rendering", True))
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
    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.scene = self.folder / "scene.nff"
        self.scene.write_text(SCENE)
        self.environment = {**farlight_test.private_daemon(), MARK: str(self.folder),
                            "XDG_CACHE_HOME": os.environ.get("XDG_CACHE_HOME", str(self.folder / "cache"))}
        self.counts = collections.Counter()
        self.whole, self.whole_s = {}, {}
        self.services = {kind: Service(self.folder, kind, self.environment) for kind in KINDS if kind != "private"}

    def make_whole(self, kind, ending):
        """What an undisturbed run makes, which is the same of every daemon, and how long it takes."""
        out, begin = self.folder / "whole", time.monotonic()
        client = self.start(out, ending, self.server(kind) + ["--retry-for", "1m"])
        self.finish(client, 0)
        needed_s = time.monotonic() - begin
        made = self.files(client.folder)
        if len(made) != FRAMES or self.whole.setdefault(ending, made) != made:
            raise Wrong(f"undisturbed runs make {sorted(made)} and {sorted(self.whole[ending])}, or other bytes")
        shutil.rmtree(out)
        return needed_s

    def measure(self):
        for kind in KINDS:
            for ending in ENDINGS:
                # The first time fills caches.
                self.whole_s[kind, ending] = min(self.make_whole(kind, ending) for _ in range(3))

    @staticmethod
    def files(out):
        return {path.name: path.read_bytes() for path in out.iterdir()}

    def start(self, out, ending, arguments):
        """A client that renders no more than its first frames until finish(), or what waits for a share of the time, reads on."""
        return farlight_test.Paced(out, f"%02d.{ending}", self.scene, "--frames", f"1-{FRAMES}", "--size", "64x64", "--samples",
                                   "6", *arguments, env=self.environment)

    @staticmethod
    def finish(client, *allowed):
        with client:
            try:
                errors = client.process.communicate(timeout=TIMEOUT_S)[1].decode()
            except subprocess.TimeoutExpired as late:
                client.process.kill()
                raise Wrong(f"the client did not end in {TIMEOUT_S} s: {client.process.communicate()[1].decode()}") from late
        status = client.process.returncode
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
        while client.process.poll() is None:
            pid = child(client.process.pid, "farlightd")
            if pid:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, number)
                    return True
            time.sleep(0.002)
        return False

    def wait_until(self, kill, client):
        """Up to the moment of the kill, or until the client has ended."""
        if kill.when == "rendering":
            client.until("frame 1:")
        elif kill.when != "loading":
            client.drain(kill.when * self.whole_s[kill.kind, kill.ending])

    def disturb(self, kill, client):
        """Returns the statuses with which the client may end; none: it had ended before."""
        self.wait_until(kill, client)
        moment = "rendering" if any(client.folder.iterdir()) else "loading"
        if client.process.poll() is not None or (kill.victim == "daemon" and not self.kill_daemon(kill.kind, client, kill.signal)):
            return ()
        self.counts[f"{kill.victim} killed while {moment}"] += 1
        if kill.victim == "daemon":
            return (0,)
        client.process.send_signal(kill.signal)
        # It may have been about to end, or have been too young to know the signal.
        return (0, -kill.signal) if kill.signal == signal.SIGKILL else (0, -kill.signal, 128 + kill.signal)

    def round(self, kill):
        """False: it came too late."""
        out = self.folder / "round"
        server = self.server(kill.kind)
        if not kill.patient:
            server += ["--retry-for", "0"]
        elif kill.kind == "listening":
            server += ["--retry-for", "1m"]  # else a daemon that is not yet there again would end it
        client = self.start(out, kill.ending, server)
        allowed = self.disturb(kill, client)
        impatient = () if kill.patient else (TRY_AGAIN,)
        status = self.finish(client, *(allowed or (0,)), *impatient)
        for _ in range(REQUEUED_MAX):
            if status == 0:
                break
            self.counts[f"requeued after {status if status >= 0 else signal.Signals(-status).name}"] += 1
            status = self.finish(self.start(out, kill.ending, [*server, "--resume"]), 0, *impatient)
            if status == TRY_AGAIN:
                time.sleep(0.2)
        self.check(client.folder, kill.ending)
        return bool(allowed)

    def check(self, out, ending):
        deadline = time.monotonic() + TIMEOUT_S
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
        deadline = time.monotonic() + TIMEOUT_S
        while (left := marked(self.folder)) and time.monotonic() < deadline:
            time.sleep(0.05)
        if left:
            names = [pathlib.Path(f"/proc/{pid}/comm").read_text().strip() for pid in left]
            raise Wrong(f"processes are left over: {names}")


def by_chance(seed, number):
    """The kill of a round, and of each further try of it, sooner than the one before, where that comes too late."""
    for tries in itertools.count():
        chance = random.Random(f"{seed}/{number}/{tries}")
        victim = chance.choice(tuple(SIGNALS))
        yield Kill(chance.choice(KINDS), victim, chance.choice(ENDINGS), chance.choice(SIGNALS[victim]),
                   0.95 * chance.random() ** 1.5 / (1 + tries), chance.random() < 0.75)


@contextlib.contextmanager
def drilling(folder):
    done = Drill(folder)
    try:
        yield done
    finally:
        done.close()


def drill_few(folder):
    """FEW; counts of what was done."""
    with drilling(folder) as done:
        for ending in ENDINGS:
            done.make_whole("private", ending)
        for kill in FEW:
            try:
                if not done.round(kill):
                    raise Wrong("it came too late")
            except Wrong as wrong:
                raise Wrong(f"{kill}: {wrong}") from wrong
    return done.counts


def drill(folder, rounds, seed, first=1):
    """Counts of what was done. Wrong: what failed, with how to do it again."""
    with drilling(folder) as done:
        done.measure()
        for number in range(first, first + rounds):
            try:
                next(kill for kill in by_chance(seed, number) if done.round(kill))
            except Wrong as wrong:
                raise Wrong(f"round {number} of seed {seed}: {wrong}") from wrong
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
