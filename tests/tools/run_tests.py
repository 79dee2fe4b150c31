#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs every test and prints one closing line: N passed, N failed, N skipped.

Usage: run_tests.py BUILD_FOLDER [PART_OF_A_NAME ..]
Unit, accuracy and tracer tests are cmocka programs below BUILD_FOLDER/tests; integration tests are unittest modules
in tests/integration, which find the programs through FARLIGHT_BIN. The rules of the sources are checked first.
Programs and modules run side by side, as most of them leave processors idle: FARLIGHT_TEST_JOBS at a time (default:
as many as there are processors, at most 4).
"""
import concurrent.futures
import io
import os
import pathlib
import re
import subprocess
import sys
import time
import unittest

UNIT_TIMEOUT_S = 600  # of a program, beside others
JOBS_MAX = 4  # each holds pictures, structures and daemons
MODULE = "--module"  # run_tests.py --module NAME: one module of integration tests, for run_module()


def run_check(name, command):
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    return f"== {name}\n{result.stdout}", (result.returncode == 0, result.returncode != 0, 0)


def run_cmocka(program):
    """(text, (passed, failed, skipped))"""
    begin = time.monotonic()
    try:
        result = subprocess.run([program], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
                                errors="replace", timeout=UNIT_TIMEOUT_S)
        output, status = result.stdout, result.returncode
    except subprocess.TimeoutExpired as timeout:
        output, status = (timeout.stdout or b"").decode(errors="replace") + "\ntimed out\n", -1
    counts = [len(re.findall(rf"^\[ +{word} +\] (?!\d+ test)(?!.*tests?:)", output, re.M))
              for word in ("OK", "FAILED", "SKIPPED")]
    passed, failed, skipped = counts
    if status != 0 and failed == 0:  # it died
        failed = 1
    lines = [f"== {program.name}"]
    if status != 0 or os.environ.get("VERBOSE"):
        lines.append(output)
    else:
        lines += [line for line in output.splitlines() if "SKIPPED" in line or line.startswith("skipped")]
    lines.append(f"   {passed} passed, {failed} failed, {skipped} skipped in {time.monotonic() - begin:.1f} s"
                 + (f" (exit status {status})" if status else ""))
    return "\n".join(lines) + "\n", (passed, failed, skipped)


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


def module_main(name):
    """In a process of its own: the tests' report, and their counts in a last line."""
    sys.path.insert(0, "tests/integration")
    stream = io.StringIO()
    result = unittest.TextTestRunner(verbosity=2, stream=stream, resultclass=Timed).run(
        unittest.TestLoader().loadTestsFromName(name))
    print(stream.getvalue(), end="")
    for test, reason in result.skipped:
        print(f"   skipped {test}: {reason}")
    failed = len(result.failures) + len(result.errors)
    print(result.testsRun - failed - len(result.skipped), failed, len(result.skipped))


def run_module(name):
    result = subprocess.run([sys.executable, __file__, MODULE, name], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                            text=True, errors="replace", check=False)
    text, _, last = result.stdout.rstrip("\n").rpartition("\n")
    if result.returncode != 0 or not re.fullmatch(r"\d+ \d+ \d+", last):  # it died
        return f"== {name}\n{result.stdout}\n", (0, 1, 0)
    return f"== {name}\n{text}\n", tuple(map(int, last.split()))


def tasks(build, names):
    """What there is to run, as functions."""
    def is_asked(name):
        return not names or any(part in name for part in names)
    for path in sorted(pathlib.Path("tests/integration").glob("test_*.py")):  # first: some take longest
        if is_asked(path.stem):
            yield lambda name=path.stem: run_module(name)
    for program in (path for folder in ("tracers", "unit", "accuracy")
                    for path in sorted(build.glob(f"tests/{folder}/test_*"))):
        if program.suffix == "" and is_asked(program.name):
            yield lambda program=program: run_cmocka(program)


def run_all(build, names):
    """Prints what each has to say as soon as it is done; the sums of (passed, failed, skipped)."""
    sums = [0, 0, 0]

    def tell(text, counts):
        print(text, end="", flush=True)
        sums[:] = map(sum, zip(sums, counts))
    if not names:
        tell(*run_check("include rules", [sys.executable, "tests/tools/check_includes.py"]))
        tell(*run_check("headers alone", ["make", "-s", "check-headers"]))
    jobs = int(os.environ.get("FARLIGHT_TEST_JOBS") or min(JOBS_MAX, len(os.sched_getaffinity(0))))
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for done in concurrent.futures.as_completed([pool.submit(task) for task in tasks(build, names)]):
            tell(*done.result())
    return sums


def main():
    if sys.argv[1] == MODULE:
        module_main(sys.argv[2])
        return 0
    build = pathlib.Path(sys.argv[1])
    # Mesa's driver keeps memory until the process ends; that is not ours to free. In full: tests run in folders of their own.
    suppressions = pathlib.Path(__file__).resolve().with_name("lsan.supp")
    os.environ.setdefault("LSAN_OPTIONS", f"suppressions={suppressions}:print_suppressions=0")
    os.environ.setdefault("UBSAN_OPTIONS", "print_stacktrace=1")
    os.environ["FARLIGHT_BIN"] = str(build.resolve())
    passed, failed, skipped = run_all(build, sys.argv[2:])
    print(f"\n{passed} passed, {failed} failed, {skipped} skipped")
    return 1 if failed or not passed else 0


if __name__ == "__main__":
    sys.exit(main())
