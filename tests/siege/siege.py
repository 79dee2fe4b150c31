#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Attacks a daemon as one user, in each way that attacks.py knows, while an innocent client of another user looks at a
triangle beside it, 20 times a second. Says per attack how long the innocent waits for its frames, how long it sees
nothing at all, how much memory the daemon has, how much it logs, and how soon it ends when it is told to. Memory, the log and
the end are judged on any machine, times on one that does nothing else. Exit status: 0 all within their bounds, 1 not all,
2 wrong usage."""
import argparse
import dataclasses
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / "integration"), str(HERE)]
import attacks  # pylint: disable=wrong-import-position
import farlight_test  # pylint: disable=wrong-import-position
import tiny_client  # pylint: disable=wrong-import-position

OUT = HERE.parents[1] / "out/siege.json"
SIZE, PERIOD_S = (160, 120), 0.05
STRANGER = 65534  # the attacker's user, where this one may become another: nobody

TIMEOUT_S = 120  # within which an attack that is held off keeps nobody waiting, however busy the machine
LOG_BYTES_A_S = 4096


@dataclasses.dataclass
class Bounds:
    """The innocent's 99th percentile, against its own without an attack. That is 9 to 40 ms on machines with two
    processors, which run the attackers as well: the floor is what a quiet one with 20 ms would be allowed."""
    slower: float = 2.5
    p99_floor_ms: float = 50
    frozen_ms: float = 250
    end_s: float = 1.0
    stats_s: float = 5.0


# Limits of memory, in MiB, that can be seen to hold on any machine; and such as an attack fills: what it then comes to
# is what those limits allow, and the innocent sees its triangle all the same.
ROOMY = {"scene": 1024, "blobs": 1024, "blob_cache": 64, "transactions": 256, "device": 6144, "frames": 16384}
TIGHT = {"scene": 256, "blobs": 600, "blob_cache": 64, "transactions": 128, "device": 512, "frames": 512}
TIGHT_PREFIX = "tight_"
FILLED = {"many_meshes": ("scene", "blobs"), "environments": ("device", "blobs"), "weights": ("device", "frames"),
          "encoding": ("device", "frames"), "uncommitted": ("transactions",)}
# Frames that are encoded are within the device's limit here: an attack has one of either.
ALL_FILLED = ("scene", "blobs", "transactions", "device")
MEMORY_ROOM = 1.05  # more than that is not within a limit
# What the attacks' connections, 64 at most, have beside all that: room for the largest message of each (256 KiB), and
# for one that is decoded (128 KiB).
CONNECTIONS_MIB = 64 * (256 + 128) // 1024
# What the driver compiles and the threads that begin after the innocent's first frame.
LATE_MIB = 64


class Innocent(threading.Thread):
    """Looks at a triangle; `waits_ms` has one entry a look."""

    def __init__(self, path):
        super().__init__(daemon=True)
        self.client = attacks.with_triangle(path)
        self.client.render(1, 2, SIZE, attacks.CAMERA, kind=tiny_client.VIEW, samples=1, depth=1, credit=1)
        self.client.next_frame()
        self.ended, self.failure, self.began, self.waits_ms, self.credit = False, None, 0, [], 1

    def look(self, command):
        eye = (0.01 * (command % 100), 0, 6)
        self.credit += 1
        self.client.raise_credit(2, self.credit)
        self.client.look(2, command, (eye, *attacks.CAMERA[1:]))
        while self.client.next_frame().command < command:
            self.credit += 1
            self.client.raise_credit(2, self.credit)

    def run(self):
        due = time.monotonic()
        command = 0
        try:
            while not self.ended:
                command += 1
                self.began = time.monotonic()
                self.look(command)
                if not self.ended:
                    self.waits_ms.append((time.monotonic() - self.began) * 1000)
                self.began = 0
                due = max(due + PERIOD_S, time.monotonic())
                time.sleep(max(0, due - time.monotonic()))
        except (OSError, EOFError, tiny_client.Failed) as failure:
            self.failure = repr(failure)

    def wait(self, seconds, looks):
        """Until so much time has passed and so many looks were answered, or it has failed or waits in vain."""
        begin = time.monotonic()
        while (passed := time.monotonic() - begin) < seconds or len(self.waits_ms) < looks:
            if self.failure or passed > seconds + TIMEOUT_S:
                break
            time.sleep(0.01)

    def end(self, now):
        """The waits; a look that has not come back by `now` counts with its time so far."""
        self.ended = True
        if self.began and self.began < now:
            self.waits_ms.append((now - self.began) * 1000)
        self.join(TIMEOUT_S)
        return self.waits_ms


def percentile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))] if values else float("inf")


def resident_mib(daemon):
    """The most that one of its processes has had; limits are for each."""
    statuses = (pathlib.Path(f"/proc/{process}/status").read_text() for process in (daemon.process.pid, *daemon.workers()))
    return max(int(line.split()[1]) >> 10 for status in statuses for line in status.splitlines() if line.startswith("VmHWM:"))


def besieged(name, limits, folder, seconds=0.0, looks=0, niceness=0):
    """One daemon with these limits under one attack, or None, for at least so long and for so many looks. The figures."""
    config = pathlib.Path(folder) / "siege.conf"
    config.write_text("[memory]\n" + "".join(f"{limit} = {mib}M\n" for limit, mib in limits.items()))
    with farlight_test.Daemon("--config", config, "--device", "software", "--listen", "tcp:127.0.0.1:0") as daemon:
        tcp = daemon.process.stdout.readline().strip().rpartition(":")[2]
        os.chmod(daemon.folder, 0o755)
        os.chmod(daemon.path, 0o666)
        user = STRANGER if os.geteuid() == 0 else 0
        address = daemon.path if user else f"127.0.0.1:{tcp}"
        innocent = Innocent(daemon.path)
        before_mib = resident_mib(daemon)
        attacker = None
        if name:
            attacker = subprocess.Popen([sys.executable, HERE / "attacks.py", name, str(user), address], stdout=subprocess.PIPE,
                                        preexec_fn=lambda: os.nice(niceness), env={**os.environ, "FARLIGHT_BIN": str(farlight_test.BIN)})
            attacker.stdout.readline()
        log_before, begin = len(daemon.messages()), time.monotonic()
        innocent.start()
        innocent.wait(seconds, looks)
        answered, failure = len(innocent.waits_ms), innocent.failure
        newcomer_s = come_new(daemon) if name else 0
        before = time.monotonic()
        log_bytes_a_s = (len(daemon.messages()) - log_before) / max(before - begin, 1)
        peak_mib = resident_mib(daemon)
        stuck = innocent.client
        daemon.process.terminate()
        waits = innocent.end(before)
        try:
            status = daemon.process.wait(TIMEOUT_S)
        except subprocess.TimeoutExpired:
            daemon.process.kill()
            status = None
        end_s = time.monotonic() - before
        stuck.socket.close()
        if attacker:
            attacker.kill()
            attacker.wait()
            attacker.stdout.close()
    return {"looks": answered, "failure": failure, "p50_ms": percentile(waits, 0.5), "p99_ms": percentile(waits, 0.99),
            "max_ms": max(waits, default=float("inf")), "newcomer_s": newcomer_s, "end_s": end_s, "status": status,
            "before_mib": before_mib, "peak_mib": peak_mib, "log_bytes_a_s": log_bytes_a_s}


def come_new(daemon):
    """How long another client of the daemon's own user takes to hear its figures; None: it does not hear them at all."""
    before = time.monotonic()
    try:
        done = farlight_test.farlight("stats", "--server", daemon.address, timeout=TIMEOUT_S)
    except subprocess.TimeoutExpired:
        return None
    return time.monotonic() - before if done.returncode == 0 else None


def limits_of(name):
    """The attack's own name, its limits, and those of them that it may fill."""
    attack = name.removeprefix(TIGHT_PREFIX)
    return (attack, ROOMY, ALL_FILLED) if attack == name else (attack, TIGHT, FILLED[attack])


def memory_max_mib(name, figures):
    """What the daemon may come to: what it has before the attack, the connections, and what the attack may fill."""
    _, limits, filled = limits_of(name)
    return figures["before_mib"] + LATE_MIB + CONNECTIONS_MIB + int(MEMORY_ROOM * sum(limits[limit] for limit in filled))


def broken(name, figures, looks=1):
    """What did not hold, of what holds on any machine."""
    checks = [
        (figures["looks"] >= looks, f"the innocent saw {figures['looks']} frames of {looks}, {figures['failure'] or 'and waits'}"),
        (figures["status"] == 0, f"SIGTERM: status {figures['status']} after {figures['end_s']:.2f} s"),
        (figures["newcomer_s"] is not None, "the owner's stats had no answer"),
        (figures["peak_mib"] <= memory_max_mib(name, figures),
         f"{figures['peak_mib']} MiB, bound {memory_max_mib(name, figures)}"),
        (figures["log_bytes_a_s"] <= LOG_BYTES_A_S, f"logs {figures['log_bytes_a_s']:.0f} bytes/s"),
    ]
    return [text for good, text in checks if not good]


def late(figures, alone, bounds):
    """What took too long, on a machine that does nothing else."""
    bound_ms = max(bounds.slower * alone["p99_ms"], bounds.p99_floor_ms)
    checks = [
        (figures["p99_ms"] <= bound_ms, f"p99 {figures['p99_ms']:.0f} ms, bound {bound_ms:.0f}"),
        (figures["max_ms"] <= bounds.frozen_ms, f"frozen for {figures['max_ms']:.0f} ms, bound {bounds.frozen_ms:.0f}"),
        (figures["end_s"] <= bounds.end_s, f"SIGTERM: {figures['end_s']:.2f} s, bound {bounds.end_s}"),
        ((figures["newcomer_s"] or 0) <= bounds.stats_s, f"the owner's stats took {figures['newcomer_s']} s"),
    ]
    return [text for good, text in checks if not good]


def line(name, figures):
    return (f"{name:18} p50 {figures['p50_ms']:6.1f}  p99 {figures['p99_ms']:6.1f}  max {figures['max_ms']:6.1f} ms  "
            f"end {figures['end_s']:5.2f} s  stats {figures['newcomer_s'] or TIMEOUT_S:4.1f} s  {figures['peak_mib']:5} MiB  "
            f"log {figures['log_bytes_a_s']:7.0f} B/s  {'; '.join(figures['complaints']) or 'holds'}")


def siege(names, seconds, folder, bounds):
    """Per attack its figures, with what is to be complained of; first '' for none. Without bounds being late is no fault."""
    # The attacker is not to take the innocent's own processor, whose time is measured.
    alone = besieged(None, ROOMY, folder, seconds)
    found = {"": alone}
    print(f"{'alone':18} p50 {alone['p50_ms']:6.1f}  p99 {alone['p99_ms']:6.1f}  max {alone['max_ms']:6.1f} ms")
    for name in names:
        attack, limits, _ = limits_of(name)
        figures = found[name] = besieged(attack, limits, folder, seconds, niceness=19)
        figures["complaints"] = broken(name, figures) + (late(figures, alone, bounds) if bounds else [])
        print(line(name, figures))
    return found


def hold(name, looks, folder):
    """What does not hold, on any machine, while so many looks beside an attack are answered; and the figures in a line."""
    attack, limits, _ = limits_of(name)
    figures = besieged(attack, limits, folder, looks=looks)
    figures["complaints"] = broken(name, figures, looks)
    return figures["complaints"], line(name, figures)


CASES = [*attacks.ATTACKS, *(TIGHT_PREFIX + attack for attack in FILLED)]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10, help="of each attack (10)")
    parser.add_argument("--any-machine", action="store_true", help="judge what holds beside other work as well, and no time")
    parser.add_argument("--list", action="store_true", help="list the attacks")
    parser.add_argument("attack", nargs="*", help="those to run; none: all")
    arguments = parser.parse_args()
    if arguments.list:
        for name in CASES:
            attack = attacks.ATTACKS[name.removeprefix(TIGHT_PREFIX)]
            print(f"{name:18} {(attack.__doc__ or '').splitlines()[0] if attack.__doc__ else ''}")
        return 0
    unknown = set(arguments.attack) - set(CASES)
    if unknown:
        parser.error(f"no attack is called {', '.join(sorted(unknown))}; --list names them")
    with tempfile.TemporaryDirectory() as folder:
        found = siege(arguments.attack or CASES, arguments.seconds, folder, None if arguments.any_machine else Bounds())
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text(json.dumps(found, indent=1))
    return 1 if any(figures.get("complaints") for figures in found.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
