# SPDX-License-Identifier: MIT
"""What the parts of the benchmark share: programs, scenes, statistics, tables."""
import datetime
import json
import math
import os
import pathlib
import statistics
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]


class Failure(Exception):
    """Something that is measured did not work; the text is for people."""


class Bench:
    """One run of the benchmark: where the programs lie, how often, and what went wrong on the way."""

    def __init__(self, build, runs=None, tiny=False, link_seconds=60):
        self.build = pathlib.Path(build).resolve()
        self.shared = pathlib.Path(os.environ.get("FARLIGHT_SCENES", ROOT.parent / "shared" / "scenes"))
        self.runs = runs
        self.tiny = tiny  # the smallest scene and one run: for the test of the benchmark itself
        self.link_seconds = link_seconds  # of a view over a slow link
        self.scenes = None  # folder of the bundled scenes
        self.faults = []
        os.environ.setdefault("FARLIGHT_LIBEXEC", str(self.build))  # for clients among the programs below it

    def program(self, name):
        return self.build / name

    def form(self, name):
        """The beginning of the command line of one measurement of the program `bench`."""
        return self.program("tests/bench/bench"), name

    def times(self, usual):
        """How many runs, where `usual` is what is done when nobody asks for another number."""
        return self.runs or usual


def say(*words):
    """What goes on, for who waits; the tables are written to the files and to standard output."""
    print(*words, file=sys.stderr, flush=True)


def command(*arguments):
    result = subprocess.run(list(map(str, arguments)), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
    if result.returncode != 0:
        raise Failure(f"{' '.join(map(str, arguments))} ended with {result.returncode}: {result.stderr.strip()}")
    return result.stdout


# ---- scenes -----------------------------------------------------------------------------------------

KITCHEN_VIEW = ["--eye", "7.634,-4.168,1.422", "--look-at", "12.037,4.713,0.107", "--up", "0,0,1", "--fov", "58.7"]


def bundled(bench, name):
    return bench.scenes / name


def shared(bench, names, left_out):
    """Of (title, name below FARLIGHT_SCENES, options) those that are there; the others' names go to `left_out`."""
    for title, name, options in names:
        if (bench.shared / name).is_file():
            yield title, bench.shared / name, options
        else:
            left_out.append(name)


# ---- statistics -------------------------------------------------------------------------------------


def figure(values):
    """Median and median absolute deviation, minimum and maximum."""
    middle = statistics.median(values)
    return {"median": middle, "deviation": statistics.median(abs(v - middle) for v in values), "min": min(values),
            "max": max(values), "runs": len(values)}


def paired_ratio(numerators, denominators):
    """Ratio of two that took turns: round by round, so that what slowed both cancels out."""
    return figure([n / d for n, d in zip(numerators, denominators) if d > 0])


def fit_exponent(points):
    """Least squares of log y against log x: (exponent, its standard error). Needs three points."""
    logs = [(math.log(x), math.log(y)) for x, y in points if x > 0 and y > 0]
    if len(logs) < 3:
        return None
    mean_x, mean_y = (statistics.fmean(v) for v in zip(*logs))
    spread = sum((x - mean_x) ** 2 for x, _ in logs)
    slope = sum((x - mean_x) * (y - mean_y) for x, y in logs) / spread
    residual = sum((y - mean_y - slope * (x - mean_x)) ** 2 for x, y in logs)
    return slope, math.sqrt(residual / (len(logs) - 2) / spread)


# ---- text -------------------------------------------------------------------------------------------


def table(header, rows):
    """Columns as wide as they need; the first is aligned to the left, the rest to the right. `header` may have lines."""
    lines = [row for row in header] + rows
    widths = [max(len(str(line[i])) for line in lines) for i in range(len(lines[0]))]
    return "\n".join("  ".join(str(cell).ljust(width) if i == 0 else str(cell).rjust(width)
                               for i, (cell, width) in enumerate(zip(line, widths))).rstrip() for line in lines)


def significant(value):
    """Three figures, and no exponent."""
    if value is None:
        return "-"
    if value == 0:
        return "0"
    digits = max(0, 2 - math.floor(math.log10(abs(value))))
    return f"{value:.{min(digits, 4)}f}"


def with_spread(value):
    """'12.3 ±2%' of a figure."""
    if value is None:
        return "-"
    share = 100 * value["deviation"] / abs(value["median"]) if value["median"] else 0
    return f"{significant(value['median'])} ±{share:.0f}%"


# ---- environment ------------------------------------------------------------------------------------


def processor_name():
    try:
        for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return "unknown"


def commit_name():
    """As `git describe --dirty` has it, but for the figures that a run itself writes."""
    def git(*arguments):
        return subprocess.run(["git", "-C", ROOT, *arguments], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
                              check=False).stdout.strip()
    name = git("describe", "--always")
    changed = git("status", "--porcelain", "--untracked-files=no", "--", ".", ":!tests/bench/README.md")
    return name + ("-dirty" if changed else "") if name else "unknown"


def environment(bench):
    """Where it was measured; the device as `bench tracers` opens it."""
    probe = json.loads(command(*bench.form("tracers"), "--family", "100", "--size", "8x8", "--waves",
                               "primary", "--runs", "1", "--tracers", "bvh"))["environment"]
    return {"date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"), "commit": commit_name(),
            "processor": processor_name(), "processors": len(os.sched_getaffinity(0)), **probe}
