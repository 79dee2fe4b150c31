# SPDX-License-Identifier: MIT
"""The part `link` of the benchmark: what sealing a connection costs. Its JSON has "mib"; for "open" and "sealed"
`mib_per_s`, and what the `daemon` and the `client` take of a processor in ns a KiB, figures all; and `ratio`, sealed to open
rates, run by run.
"""
import json

from bench_common import command, figure, paired_ratio, table, with_spread

BYTES_PER_MIB = 1 << 20


def measure(bench):
    mib = 4 if bench.tiny else 512
    told = json.loads(command(*bench.form("link"), mib, 1 if bench.tiny else bench.times(9)))
    data = {"mib": mib, "ratio": paired_ratio(told["open"]["wall_ns"], told["sealed"]["wall_ns"])}
    for name in ("open", "sealed"):
        data[name] = {"mib_per_s": figure([mib * 1e9 / ns for ns in told[name]["wall_ns"]])}
        for end in ("daemon", "client"):
            data[name][end] = figure([ns / (mib * 1024) for ns in told[name][f"{end}_ns"]])
    return data


def show(data):
    head = [("over TCP on loopback", "rate", "daemon", "client"), ("", "MiB/s", "ns per KiB", "ns per KiB")]
    rows = [(name, *(with_spread(data[name][key]) for key in ("mib_per_s", "daemon", "client"))) for name in ("open", "sealed")]
    return (table(head, rows) + f"\n\nsealed to open, run by run: {with_spread(data['ratio'])}; daemon and client: time of a "
            "processor, connecting included")
