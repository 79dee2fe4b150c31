# SPDX-License-Identifier: MIT
"""What a daemon has, looked at from outside and asked for, while nobody is there; and whether it stays the same."""
import contextlib
import json
import pathlib
import statistics
import time

import farlight_test

KIB, MIB = 1 << 10, 1 << 20
# Memory that comes and goes while nothing leaks: a program that the driver compiles late takes 5 MiB.
WOBBLE_BYTES = 8 * MIB
# What one round of 10 connects, one upload and 100 frames may leave behind for ever, once there are enough samples to
# tell. Resident: 10 bytes for each frame, or 100 for each connect, less than the smallest struct that any of them has. Data
# counts as well what the allocator has reserved and not used.
MEMORY = {"rss": 1 * KIB, "data": 4 * KIB}
SAMPLES_MIN = 7  # beside the first
BLOB_CACHE_BYTES = 1 * MIB  # as the daemon is told
SETTLED_S = 60

COUNTS = ("descriptors", "threads", "device_objects", "device_bytes", "host_bytes", "scenes", "jobs", "clients")


def threads_of(folder):
    """How many, without those that compile programs, which end with that."""
    count = 0
    for thread in (folder / "task").iterdir():
        with contextlib.suppress(OSError):  # it has ended meanwhile
            count += (thread / "comm").read_text() != "compile\n"
    return count


def look(daemon):
    """Asks once."""
    result = farlight_test.farlight("stats", "--json", "--server", daemon.address)
    assert result.returncode == 0, result.stderr
    stats = json.loads(result.stdout)
    time.sleep(0.02)  # until who asked is gone, mostly
    folder = pathlib.Path(f"/proc/{daemon.process.pid}")
    status = dict(line.split(":", 1) for line in (folder / "status").read_text().splitlines())
    return {
        "rss": int(status["VmRSS"].split()[0]) * KIB,
        "data": int(status["VmData"].split()[0]) * KIB,
        "threads": threads_of(folder),
        "descriptors": len(list((folder / "fd").iterdir())),
        "scenes": len(stats["scenes"]),
        "clients": len(stats["clients"]),  # who asks is one
        "blob_bytes": stats["blob_bytes"],
        **{name: stats[name] for name in ("host_bytes", "device_bytes", "device_objects", "jobs", "frames")},
    }


def settle(daemon, descriptors):
    """Asks until all who have left are forgotten, and the scenes that lingered; the last one of them was a moment ago."""
    end = time.monotonic() + SETTLED_S
    while True:
        seen = look(daemon)
        left = (seen["scenes"], seen["jobs"], seen["clients"], seen["descriptors"])
        if left == (0, 0, 1, descriptors) or time.monotonic() > end:
            return seen
        time.sleep(0.05)


def slope(values):
    """Of the straight line through them, a step: the median of those through any two (Theil and Sen), so that what grows
    once does not look like a leak, which goes on."""
    return statistics.median((values[j] - values[i]) / (j - i) for j in range(len(values)) for i in range(j))


class Verdict:
    """On samples that were taken every `rounds` rounds, the first before anything was done: `rows` of a table, and
    `complaints`."""

    def __init__(self, samples, rounds):
        self.rows, self.complaints = [], []
        used = samples[1:]  # what is loaded and compiled at first use is there from then on
        assert len(used) >= SAMPLES_MIN
        third = len(used) // 3
        for name in MEMORY:
            self.judge_memory(name, [one[name] for one in used], third, rounds)
        for name in COUNTS:
            self.judge_count(name, [one[name] for one in used[third:]])
        maximum = max(one["blob_bytes"] for one in used)
        self.rows.append(("blob_bytes", "", maximum, f"at most {BLOB_CACHE_BYTES} (its cache)"))
        if maximum > BLOB_CACHE_BYTES:
            self.complaints.append(f"{maximum} bytes of unused blobs")

    def judge_memory(self, name, values, third, rounds):
        second, last = max(values[third:2 * third]), max(values[2 * third:])
        later = values[third:]
        a_round = slope(later) / rounds
        # As uncertain as a line is through so many samples, each of which wobbles.
        allowed = max(MEMORY[name], WOBBLE_BYTES / (rounds * len(later)**1.5))
        self.rows.append((name, f"{second / MIB:.1f}", f"{last / MIB:.1f}",
                          f"MiB, second and last third; {a_round:+.0f} bytes a round, at most {allowed:.0f}"))
        if last > second + WOBBLE_BYTES:
            self.complaints.append(f"{name}: {last - second} bytes more in the last third than in the second")
        if a_round > allowed:
            self.complaints.append(f"{name}: grows by {a_round:.0f} bytes a round")

    def judge_count(self, name, values):
        self.rows.append((name, values[0], values[-1], "first and last: the same all the while"))
        if len(set(values)) > 1:
            self.complaints.append(f"{name}: not always the same, {values[0]} at first, {sorted(set(values))} later")
