#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Breaks what serves an animation again and again: kills the daemon's workers, or makes them lose their GPU. Every frame comes
once, with the same bytes as without disturbance, and the front keeps its memory and descriptors.
Exit status: 0 it held, 1 it did not, 2 wrong usage."""
import argparse
import collections
import contextlib
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / "integration"), str(HERE)]
import drill  # pylint: disable=wrong-import-position
import farlight_test  # pylint: disable=wrong-import-position
import flat  # pylint: disable=wrong-import-position
import soak  # pylint: disable=wrong-import-position
from drill import Wrong  # pylint: disable=wrong-import-position

TIMEOUT_S = 120
# A frame takes some 20 ms; an animation has enough of them for the breaks that it may have.
FRAMES = {"killed": 200, "lost": 30}
# A job that has lost the GPU three times in five minutes is put aside.
LOSSES_OF_A_JOB = 2
PAUSE_S = 0.1  # at most, between a frame and the next break
TWICE = 0.25  # share of the kills that meet a worker which is starting, too
SAMPLED = 10  # breaks between two looks at memory
FRONT_GROWTH_BYTES = 256  # a break: less than what the front has for a worker or a client


class Animation:
    """A client that says in its messages when a frame has come."""

    def __init__(self, scene, out, frames, *arguments):
        self.out, self.frames = out, []  # (when, number)
        out.mkdir()
        self.process = subprocess.Popen(
            [farlight_test.BIN / "farlight", "animate", scene, "--frames", f"1-{frames}", "--size", "64x64", "--samples", "6",
             "-o", out / "%d.png", *arguments], stderr=subprocess.PIPE, text=True, env=farlight_test.private_daemon())
        self.messages = collections.deque(maxlen=40)
        self.changed = threading.Condition()
        self.ended = False
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()

    def read(self):
        for line in self.process.stderr:
            self.messages.append(line)
            number = re.match(r"frame (\d+):", line)
            if number:
                with self.changed:
                    self.frames.append((time.monotonic(), int(number[1])))
                    self.changed.notify()
        with self.changed:
            self.ended = True
            self.changed.notify()

    def wait_for_frame(self, since):
        """When the first frame came after `since`; None: the animation is over."""
        def came():
            return self.frames and self.frames[-1][0] > since
        with self.changed:
            if not self.changed.wait_for(lambda: came() or self.ended, TIMEOUT_S):
                raise Wrong(f"no frame in {TIMEOUT_S} s: {''.join(self.messages)}")
            return next(when for when, _ in self.frames if when > since) if came() else None

    def finish(self, expected):
        """Checks frames against {name: bytes}; None: makes them what is expected."""
        try:
            status = self.process.wait(TIMEOUT_S)
        except subprocess.TimeoutExpired as late:
            self.process.kill()
            raise Wrong("the animation does not end") from late
        self.reader.join()
        self.process.stderr.close()
        if status:
            raise Wrong(f"the animation ended with {status}: {''.join(self.messages)}")
        made = drill.Drill.files(self.out)
        shutil.rmtree(self.out)
        numbers = [number for _, number in self.frames]
        if len(set(numbers)) != len(numbers) or len(made) != len(numbers):
            raise Wrong(f"frames {sorted(numbers)}, files {sorted(made)}")
        if expected is not None and made != expected:
            raise Wrong(f"other bytes than without disturbance: {[name for name in made if made[name] != expected.get(name)]}")
        return made


def memory_of(process):
    """Bytes and descriptors of a process; empty where it has ended."""
    with contextlib.suppress(OSError):
        status = dict(line.split(":", 1) for line in pathlib.Path(f"/proc/{process}/status").read_text().splitlines())
        return {**{name: int(status[name].split()[0]) * flat.KIB for name in ("VmSize", "VmRSS", "VmData") if name in status},
                "descriptors": len(os.listdir(f"/proc/{process}/fd"))}
    return {}


class Breaking:
    """One daemon, and animations by it."""

    def __init__(self, folder, how, of_a_job=LOSSES_OF_A_JOB):
        self.folder, self.how, self.of_a_job = pathlib.Path(folder), how, of_a_job
        self.chance = random.Random(1)
        self.scene, self.losses = self.folder / "scene.nff", self.folder / "losses"
        self.scene.write_text(drill.SCENE)
        self.losses.write_bytes(b"")
        self.waits_s, self.breaks, self.animations = [], 0, 0
        self.front, self.workers = [], []  # samples; of workers: (process, its bytes)
        self.whole = None

    def daemon(self):
        environment = {**os.environ, "FARLIGHT_TEST_LOSSES": str(self.losses), "FARLIGHT_SERVER_LOG_LEVEL": "error"}
        return farlight_test.Daemon(environment=environment,
                                    program="tests/tools/farlightd_losing" if self.how == "lost" else "farlightd")

    def sample(self, daemon):
        self.front.append(memory_of(daemon.process.pid))
        self.workers += [(worker, has) for worker in daemon.workers() if (has := memory_of(worker))]

    def kill(self, daemon):
        for worker in daemon.workers():
            with contextlib.suppress(ProcessLookupError):
                os.kill(worker, signal.SIGKILL)
                self.breaks += 1

    def break_once(self, daemon, animation):
        """False: the animation was over before."""
        if self.how == "killed":
            self.kill(daemon)
            if self.chance.random() < TWICE:
                time.sleep(3 * PAUSE_S * self.chance.random())
                self.kill(daemon)
            return True
        self.losses.write_bytes(b"x")
        deadline = time.monotonic() + TIMEOUT_S
        while self.losses.stat().st_size:
            if animation.ended:
                self.losses.write_bytes(b"")
                return False
            if time.monotonic() > deadline:
                raise Wrong("the GPU is not asked whether it is there")
            time.sleep(0.001)
        self.breaks += 1
        return True

    def animate(self, daemon, breaks):
        """One animation, with so many breaks at most."""
        animation = Animation(self.scene, self.folder / "out", FRAMES[self.how], "--server", daemon.address)
        since, done = 0, 0
        while (came := animation.wait_for_frame(since)) is not None:
            if done:
                self.waits_s.append(came - since)
            if done >= breaks:
                break
            time.sleep(PAUSE_S * self.chance.random())
            before = self.breaks
            since = time.monotonic()
            if not self.break_once(daemon, animation):
                break
            done += self.breaks - before
            if self.breaks // SAMPLED > before // SAMPLED:
                self.sample(daemon)
        self.animations += 1
        made = animation.finish(self.whole)
        self.whole = self.whole or made

    def run(self, count):
        begin, bar = time.monotonic(), soak.Bar(count)
        with self.daemon() as daemon:
            self.animate(daemon, 0)
            while self.breaks < count:
                left = count - self.breaks
                self.animate(daemon, left if self.how == "killed" else min(self.of_a_job, left))
                bar.show(self.breaks, f"{self.breaks} {self.how}, longest wait {max(self.waits_s, default=0):.2f} s")
            bar.end()
            end = time.monotonic()
            if (status := daemon.stop()) != 0:
                raise Wrong(f"the daemon ended with {status}: {daemon.messages()[-2000:]}")
            self.end_s = time.monotonic() - end
        self.took_s = time.monotonic() - begin

    def report(self):
        waits = sorted(self.waits_s)
        print(f"{self.breaks} {self.how} in {self.took_s:.0f} s, {self.animations} animations, every frame once with the same bytes; "
              f"until the next frame: median {waits[len(waits) // 2]:.3f} s, 99 % {waits[int(0.99 * len(waits))]:.3f} s, "
              f"longest {waits[-1]:.3f} s; SIGTERM {self.end_s:.2f} s")
        for name in self.front[0]:
            values = [one[name] for one in self.front]
            print(f"  front {name:<12} first {values[0]}, last {values[-1]}, at most {max(values)}, "
                  f"{flat.growth(values) / SAMPLED:+.0f} a break")
        for name in ("VmSize", "VmRSS") if self.how == "lost" else ():
            of_one = collections.defaultdict(list)
            for worker, has in self.workers:
                of_one[worker].append(has[name])
            longest = max(of_one.values(), key=len)
            print(f"  a worker's {name:<7} first {longest[0] / flat.MIB:.1f}, last {longest[-1] / flat.MIB:.1f} MiB in "
                  f"{len(longest)} samples; at most {max(max(values) for values in of_one.values()) / flat.MIB:.1f} MiB in "
                  f"{len(of_one)} workers")

    def complaints(self):
        found = []
        for name, most in (("VmData", FRONT_GROWTH_BYTES), ("VmRSS", FRONT_GROWTH_BYTES), ("descriptors", 0)):
            a_break = flat.growth([one[name] for one in self.front[1:]]) / SAMPLED
            if a_break > most:
                found.append(f"the front's {name} grows by {a_break:.1f} a break")
        return found


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("build", type=pathlib.Path, help="folder of the programs")
    parser.add_argument("how", choices=FRAMES, help="workers are killed, or lose their GPU")
    parser.add_argument("breaks", type=int, nargs="?", default=1000, help="how often (1000)")
    parser.add_argument("--of-a-job", type=int, default=LOSSES_OF_A_JOB, help="losses that a job may have (2)")
    options = parser.parse_args()
    if options.breaks < (flat.SAMPLES_MIN + 1) * SAMPLED:
        parser.error(f"fewer than {(flat.SAMPLES_MIN + 1) * SAMPLED} breaks tell nothing")
    farlight_test.BIN = options.build.resolve()
    with tempfile.TemporaryDirectory(prefix="farlight-breaks-") as folder:
        breaking = Breaking(folder, options.how, options.of_a_job)
        try:
            breaking.run(options.breaks)
        except Wrong as wrong:
            print(f"WRONG after {breaking.breaks}: {wrong}")
            return 1
    breaking.report()
    for complaint in breaking.complaints():
        print(f"NOT FLAT: {complaint}")
    return 1 if breaking.complaints() else 0


if __name__ == "__main__":
    sys.exit(main())
