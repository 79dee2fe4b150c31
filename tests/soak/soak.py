#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Uses one daemon for a long time, and sees whether it has the same memory, descriptors, threads and GPU objects then.
A round is 10 connects, one upload of a scene and 100 frames; 1000 of them take some ten minutes on software GL. All
samples go to out/soak.json. Exit status: 0 flat, 1 not flat, 2 wrong usage."""
import argparse
import json
import os
import pathlib
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / "integration"), str(HERE)]
import farlight_test  # pylint: disable=wrong-import-position
import flat  # pylint: disable=wrong-import-position
import load  # pylint: disable=wrong-import-position

OUT = HERE.parents[1] / "out/soak.json"
ROUNDS = 1000

# Nothing lingers for longer than it takes to look.
CONFIGURATION = """
[limits]
scene_linger = {linger}
[memory]
blob_cache = {cache}
[network]
handshake = 2000
"""


# The allocator, jemalloc, has one arena and gives free memory back at once. By default each thread keeps some, freed pages
# stay for ten seconds and addresses for ever: steps of 2 to 10 MiB that say nothing about leaks.
ALLOCATOR = {"MALLOC_CONF": "narenas:1,tcache:false,retain:false,dirty_decay_ms:0,muzzy_decay_ms:0"}


class Bar:
    """On a terminal only."""

    def __init__(self, total, stream=sys.stderr):
        self.total, self.stream = total, stream if stream.isatty() else None

    def show(self, done, text):
        if self.stream:
            filled = 30 * done // self.total
            self.stream.write(f"\r[{'#' * filled}{'.' * (30 - filled)}] {100 * done // self.total:3} %  {text}\033[K")
            self.stream.flush()

    def end(self):
        if self.stream:
            self.stream.write("\r\033[K")


def soak(folder, rounds, mix, settled, linger_s=1):
    """The samples that were taken, each a cycle of `mix` after the one before, and what was done. From the sample `settled`
    on, everything has been used once, and what the daemon has stays."""
    config = pathlib.Path(folder) / "farlightd.conf"
    config.write_text(CONFIGURATION.format(cache=flat.BLOB_CACHE_BYTES, linger=linger_s))
    bar = Bar(rounds)
    with farlight_test.Daemon("--config", config, "--device", "software", "--listen", "tcp:127.0.0.1:0",
                              environment={**os.environ, **ALLOCATOR}) as daemon:
        tcp = daemon.process.stdout.readline().rpartition(":")[2]  # the second of two addresses
        clients = load.Soak(daemon.path, ("127.0.0.1", int(tcp)), mix)
        farlight_test.farlight("stats", "--server", f"tcp:127.0.0.1:{int(tcp)}")  # whose worker is there from then on
        # A client that was handed over has a descriptor in both processes for a moment.
        samples = [min((flat.look(daemon) for _ in range(5)), key=lambda one: one["descriptors"])]
        expected = {"scenes": 0, "jobs": 0, "clients": 1, "descriptors": samples[0]["descriptors"]}
        for first in range(1, rounds + 1, mix.cycle):
            clients.begin()
            for number in range(first, min(first + mix.cycle, rounds + 1)):
                clients.round(number)
                bar.show(number, f"{clients.connects} connects, {clients.uploads} uploads, {clients.frames} frames, "
                                 f"{samples[-1]['rss'] >> 20} MiB")
            clients.end()
            samples.append(flat.settle(daemon, expected))
            if len(samples) > settled:
                expected = {name: samples[-1][name] for name in flat.COUNTS}
        bar.end()
        status = daemon.stop()
        assert status == 0, f"farlightd ended with {status}: {daemon.messages()}"
    return samples, clients


def parse():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("build", type=pathlib.Path, help="folder of the programs")
    parser.add_argument("rounds", type=int, nargs="?", default=ROUNDS, help="%(default)s if not given")
    options = parser.parse_args()
    minimum = flat.SAMPLES_MIN * load.Mix.cycle
    if options.rounds < minimum:
        parser.error(f"fewer than {minimum} rounds tell nothing")
    return options


def main():
    options = parse()
    farlight_test.BIN = options.build.resolve()
    mix = load.Mix()
    settled = options.rounds // mix.cycle // 3
    begin = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="farlight-soak-") as folder:
        samples, clients = soak(folder, options.rounds, mix, settled)
    verdict = flat.Verdict(samples, mix.cycle, settled)
    print(f"{clients.connects} connects, {clients.uploads} uploads, {clients.frames} frames in "
          f"{time.monotonic() - begin:.0f} s, {len(samples)} samples")
    for name, before, after, what in verdict.rows:
        print(f"  {name:<14}{before!s:>12}{after!s:>12}  {what}")
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text(json.dumps({"rounds_a_sample": mix.cycle, "samples": samples}, indent=0) + "\n")
    for complaint in verdict.complaints:
        print(f"NOT FLAT: {complaint}")
    return 1 if verdict.complaints else 0


if __name__ == "__main__":
    sys.exit(main())
