#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs every test and prints one closing line: N passed, N failed, N skipped.

Usage: run_tests.py BUILD_FOLDER [PART_OF_A_NAME ..]
Unit and accuracy tests are cmocka programs below BUILD_FOLDER/tests; integration tests are unittest modules
in tests/integration, which find the programs through FARLIGHT_BIN. The rules of the sources are checked first.
"""
import os
import pathlib
import re
import subprocess
import sys
import time
import unittest

UNIT_TIMEOUT_S = 300


class Tally:
    def __init__(self):
        self.passed = self.failed = self.skipped = 0

    def add(self, passed, failed, skipped=0):
        self.passed += passed
        self.failed += failed
        self.skipped += skipped


def run_check(tally, name, command):
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    print(f"== {name}\n{result.stdout}", end="", flush=True)
    tally.add(result.returncode == 0, result.returncode != 0)


def run_cmocka(tally, program, environment):
    print(f"== {program.name}", flush=True)
    begin = time.monotonic()
    try:
        result = subprocess.run([program], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
                                errors="replace", timeout=UNIT_TIMEOUT_S, env=environment)
        output, status = result.stdout, result.returncode
    except subprocess.TimeoutExpired as timeout:
        output, status = (timeout.stdout or b"").decode(errors="replace") + "\ntimed out\n", -1
    counts = [len(re.findall(rf"^\[ +{word} +\] (?!\d+ test)(?!.*tests?:)", output, re.M))
              for word in ("OK", "FAILED", "SKIPPED")]
    passed, failed, skipped = counts
    if status != 0 and failed == 0:  # it died
        failed = 1
    if status != 0 or os.environ.get("VERBOSE"):
        print(output, flush=True)
    else:
        for line in output.splitlines():
            if "SKIPPED" in line or line.startswith("skipped"):
                print(line)
    print(f"   {passed} passed, {failed} failed, {skipped} skipped in {time.monotonic() - begin:.1f} s"
          + (f" (exit status {status})" if status else ""), flush=True)
    tally.add(passed, failed, skipped)


class Timed(unittest.TextTestResult):
    """Says how long each test took; what its class prepares counts for its first one."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self.ended = time.monotonic()

    def addSuccess(self, test):  # pylint: disable=invalid-name
        self.stream.write(f"{time.monotonic() - self.ended:.1f} s, ")
        super().addSuccess(test)

    def stopTest(self, test):  # pylint: disable=invalid-name
        super().stopTest(test)
        self.ended = time.monotonic()


def run_integration(tally, names):
    sys.path.insert(0, "tests/integration")
    loader = unittest.TestLoader()
    suite = unittest.TestSuite()
    for path in sorted(pathlib.Path("tests/integration").glob("test_*.py")):
        if not names or any(name in path.stem for name in names):
            suite.addTests(loader.loadTestsFromName(path.stem))
    if not suite.countTestCases():
        return
    print("== integration", flush=True)
    result = unittest.TextTestRunner(verbosity=2, stream=sys.stdout, resultclass=Timed).run(suite)
    for test, reason in result.skipped:
        print(f"   skipped {test}: {reason}")
    bad = len(result.failures) + len(result.errors)
    tally.add(result.testsRun - bad - len(result.skipped), bad, len(result.skipped))


def main():
    build = pathlib.Path(sys.argv[1])
    names = sys.argv[2:]
    tally = Tally()
    environment = dict(os.environ)
    # Mesa's driver keeps memory until the process ends; that is not ours to free.
    environment.setdefault("LSAN_OPTIONS", "suppressions=tests/tools/lsan.supp:print_suppressions=0")
    environment.setdefault("UBSAN_OPTIONS", "print_stacktrace=1")
    os.environ.update(environment)
    os.environ["FARLIGHT_BIN"] = str(build.resolve())
    if not names:
        run_check(tally, "include rules", [sys.executable, "tests/tools/check_includes.py"])
        run_check(tally, "headers alone", ["make", "-s", "check-headers"])
    for program in sorted(build.glob("tests/unit/test_*")) + sorted(build.glob("tests/accuracy/test_*")):
        if program.suffix == "" and (not names or any(name in program.name for name in names)):
            run_cmocka(tally, program, os.environ)
    run_integration(tally, names)
    print(f"\n{tally.passed} passed, {tally.failed} failed, {tally.skipped} skipped")
    return 1 if tally.failed or not tally.passed else 0


if __name__ == "__main__":
    sys.exit(main())
