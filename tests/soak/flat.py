# SPDX-License-Identifier: MIT
"""What a daemon has, looked at from outside and asked for, while nobody is there; and whether it stays the same."""
import collections
import contextlib
import json
import pathlib
import statistics
import time

import farlight_test

KIB, MIB = 1 << 10, 1 << 20
# Memory that one round of 10 connects, one upload and 100 frames may leave behind for ever, once there are enough samples to
# tell. Resident: 10 bytes for each frame, or 100 for each connect, less than the smallest struct that any of them has. Data
# counts as well what the allocator has reserved and not used.
MEMORY = {"rss": 1 * KIB, "data": 4 * KIB}
SAMPLES_MIN = 20  # from which growth of memory can be told from what comes and goes
BLOB_CACHE_BYTES = 1 * MIB  # as the daemon is told
SETTLED_S = 60  # a daemon that is left alone settles sooner, or never

COUNTS = ("descriptors", "threads", "device_objects", "device_bytes", "host_bytes", "scenes", "jobs", "clients")


def threads_of(folder):
    """How many there are, and how many compile programs, which end with that."""
    names = []
    for thread in (folder / "task").iterdir():
        with contextlib.suppress(OSError):  # it has ended meanwhile
            names.append((thread / "comm").read_text())
    return len(names), names.count("compile\n")


def look(daemon):
    """Asks once."""
    result = farlight_test.farlight("stats", "--json", "--server", daemon.address)
    assert result.returncode == 0, result.stderr
    stats = json.loads(result.stdout)
    has = collections.Counter()  # all of its processes
    for process in (daemon.process.pid, *daemon.workers()):
        folder = pathlib.Path(f"/proc/{process}")
        status = dict(line.split(":", 1) for line in (folder / "status").read_text().splitlines())
        threads, compiling = threads_of(folder)
        has.update(rss=int(status["VmRSS"].split()[0]) * KIB, data=int(status["VmData"].split()[0]) * KIB, threads=threads,
                   compiling=compiling, descriptors=len(list((folder / "fd").iterdir())))
    return {
        **has,
        "scenes": len(stats["scenes"]),
        "clients": len(stats["clients"]),  # who asks is one
        "blob_bytes": stats["blob_bytes"],
        **{name: stats[name] for name in ("host_bytes", "device_bytes", "device_objects", "jobs", "frames")},
    }


def settle(daemon, expected):
    """Asks until the figures are those that are expected: clients that have left are forgotten, scenes no longer linger, no
    thread compiles. After SETTLED_S the figures are what they are."""
    end = time.monotonic() + SETTLED_S
    while True:
        seen = look(daemon)
        if {**seen, **expected, "compiling": 0} == seen or time.monotonic() > end:
            return seen
        time.sleep(0.05)


def growth(values):
    """A step of the straight line through them: the lower quartile of those through any two. Theil and Sen take the median; in
    a quarter of all pairs neither a thread's stack nor a program that the driver compiles late lies between the two, so that
    memory which grows once or twice does not look like a leak, which goes on."""
    return statistics.quantiles(((values[j] - values[i]) / (j - i) for j in range(len(values)) for i in range(j)), n=4)[0]


class Verdict:
    """On samples that were taken every `rounds` rounds, the first before anything was done: `rows` of a table, and
    `complaints`. Counts are judged from the sample `settled` on; memory only in a run that is long enough."""

    def __init__(self, samples, rounds, settled, memory=True):
        self.rows, self.complaints = [], []
        if memory:
            used = samples[1:]  # what is loaded and compiled at first use is there from then on
            assert len(used) >= SAMPLES_MIN
            for name in MEMORY:
                self.judge_memory(name, [one[name] for one in used], rounds)
        for name in COUNTS:
            self.judge_count(name, [one[name] for one in samples[settled:]])
        maximum = max(one["blob_bytes"] for one in samples)
        self.rows.append(("blob_bytes", "", maximum, f"at most {BLOB_CACHE_BYTES} (its cache)"))
        if maximum > BLOB_CACHE_BYTES:
            self.complaints.append(f"{maximum} bytes of unused blobs")

    def judge_memory(self, name, values, rounds):
        a_round = growth(values) / rounds
        self.rows.append((name, f"{values[0] / MIB:.1f}", f"{values[-1] / MIB:.1f}",
                          f"MiB, first and last; {a_round:+.0f} bytes a round, at most {MEMORY[name]}"))
        if a_round > MEMORY[name]:
            self.complaints.append(f"{name}: grows by {a_round:.0f} bytes a round")

    def judge_count(self, name, values):
        self.rows.append((name, values[0], values[-1], "first and last: the same all the while"))
        if len(set(values)) > 1:
            self.complaints.append(f"{name}: not always the same, {values[0]} at first, {sorted(set(values))} later")
