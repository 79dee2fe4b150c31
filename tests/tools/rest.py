#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs what `make test` leaves out: some of the parts that suite.py cuts it into, or all.

Usage: rest.py BUILD_FOLDER all|PART ..
A part is a share of the tests and some targets of make. The last lines say what ran, what could not run here and why, and
what the other parts have. Exit status 1 if something failed. With the sanitizers' build folder there are tests alone."""
import pathlib
import shlex
import subprocess
import sys
import time

import suite


def run(title, command):
    """Whether it passed."""
    begin = time.monotonic()
    passed = subprocess.run(command, check=False).returncode == 0
    print(f"{title} {'passed' if passed else 'FAILED'} in {time.monotonic() - begin:.0f} s", flush=True)
    return passed


def why_not(step):
    """Why a step cannot run here; '' if it can."""
    check = subprocess.run(step.check, shell=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    return "" if check.returncode == 0 else (check.stdout.strip().splitlines() or [step.check])[-1]


def main():
    if len(sys.argv) < 3 or sys.argv[1] in ("-h", "--help"):
        print(__doc__.strip())
        return 2
    build, every = pathlib.Path(sys.argv[1]), list(range(1, suite.PARTS + 1))
    parts = every if sys.argv[2:] == ["all"] else [int(word) for word in sys.argv[2:]]
    if not set(parts) <= set(every):
        print(f"rest.py: there are the parts 1 to {suite.PARTS}")
        return 2
    steps = [] if build.name == "sanitize" else suite.STEPS
    failed, left_out = [], []
    chosen = [("--rest",)] if parts == every else [("--part", str(part)) for part in parts]
    for words in chosen:
        title = "tests " + " ".join(words)
        if not run(title, [sys.executable, "tests/tools/run_tests.py", build, *words]):
            failed.append(title)
    for step in steps:
        if step.part not in parts:
            continue
        reason = why_not(step)
        if reason:
            left_out.append(f"make {step.target}: {reason}")
        elif not run(f"make {step.target}", ["make", *shlex.split(step.target)]):
            failed.append(f"make {step.target}")
    print(f"parts that ran: {', '.join(map(str, parts))} of {suite.PARTS}, of the tests and: "
          + (", ".join(step.target for step in steps if step.part in parts) or "nothing else"))
    for part in sorted(set(every) - set(parts)):
        print(f"not in this run: part {part} of the tests, " + ", ".join(step.target for step in steps if step.part == part))
    for line in left_out:
        print(f"LEFT OUT: {line}")
    for line in failed:
        print(f"FAILED: {line}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
