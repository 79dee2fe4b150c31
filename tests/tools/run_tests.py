#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs tests and prints one closing line: N passed, N failed, N skipped.

Usage: run_tests.py BUILD_FOLDER                        those of `make test` (suite.py says which)
       run_tests.py BUILD_FOLDER --rest                 all that `make test` leaves out
       run_tests.py BUILD_FOLDER --part 3               one of the parts that the rest is cut into
       run_tests.py BUILD_FOLDER PART_OF_A_NAME ..      tests with such a word in their name: /scene/ is that folder alone,
                                                        like-gpu/ or zink/ before the word runs them in that way

C tests are cmocka programs below BUILD_FOLDER/tests that hold many files of tests; each file runs in a process of its
own. Integration tests are unittest modules in tests/integration, which find the programs through FARLIGHT_BIN. Files and
modules run side by side, as most of them leave processors idle: FARLIGHT_TEST_JOBS at a time (default: two more than
there are processors, at most 4), those first that took longest the last time.
With CI=true in the environment, a skipped test fails unless EXPECTED_SKIPS names its reason. FARLIGHT_TEST_LONG=1, which
--rest and --part set in the plain way, runs the tests as well that are declared as long.
"""
import collections
import concurrent.futures
import functools
import io
import json
import os
import pathlib
import re
import resource
import subprocess
import sys
import threading
import time
import unittest

import suite

FILE_TIMEOUT_S = 900  # of one file of C tests, beside others
JOBS_MAX = 4  # each holds pictures, structures and daemons
SLOWEST = 10  # so many are named at the end
MODULE = "--module"  # run_tests.py --module NAME: one module of integration tests, for run_module()

LEFT = "left to make test-all"
NO_MODELS = "no folder of models at FARLIGHT_SCENES"
# Reasons for which a test may be skipped in CI.
EXPECTED_SKIPS = (
    NO_MODELS,  # they lie beside a checkout that has them
    r"no systemd can be started here",  # most containers start none
    r"sanitizers (do not run within|have an allocator)",
    r"ptrace: ",  # forbidden in many containers
    r"this kernel does not name children",
    r"a GPU refits nothing in order",
    r"this device's buffers are no memory of the host",  # of one that works as GPUs do
    r"no promtool",  # its package starts a server
    r"programs on such a library need its compiler flags",  # of the sanitizers and of coverage
)
# skips: (test, reason); used: processor time of it and of the programs that it has waited for, in seconds
Result = collections.namedtuple("Result", "text passed failed skips used")


def processor_time(usage):
    return usage.ru_utime + usage.ru_stime


def run_command(command, environment=None, timeout=None):
    """(output, exit status, processor time); `environment` is added to that of this process."""
    with subprocess.Popen(command, env={**os.environ, **(environment or {})}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True, errors="replace") as program:
        timer = threading.Timer(timeout or threading.TIMEOUT_MAX, program.kill)
        timer.start()
        output = program.stdout.read()
        _, status, usage = os.wait4(program.pid, 0)
        program.returncode = os.waitstatus_to_exitcode(status)
        output += "" if timer.is_alive() else "\ntimed out\n"
        timer.cancel()
    return output, program.returncode, processor_time(usage)


def run_check(name, command):
    output, status, used = run_command(command)
    return Result(f"== {name}\n{output}", int(status == 0), int(status != 0), [], used)


def run_program(command, environment):
    """(output, exit status, test -> verdict, (test, reason) of those that were skipped, processor time)"""
    output, status, used = run_command(command, environment, FILE_TIMEOUT_S)
    verdicts, reason, skips = {}, "", []  # by name: cmocka lists those that failed once more at the end
    for line in output.splitlines():
        if line.startswith(("skipped: ", "SKIP: ")):
            reason = line.partition(": ")[2]
        found = re.match(r"\[ +(OK|FAILED|SKIPPED) +\] (?!\d+ test)(.+)", line)
        if found and found[2] not in verdicts:
            verdicts[found[2]] = found[1]
            if found[1] == "SKIPPED":
                skips.append((found[2], reason or "without a reason"))
    if not verdicts and status == 0 and reason:  # a program that skips all of its tests
        skips.append(("all of them", reason))
    return output, status, verdicts, skips, used


def run_cmocka(name, environment, command, tests):
    """`tests`: their names in order, where they are known. What follows a test that failed, or after which the program
    died, may have failed because of it, and is run again alone."""
    output, status, verdicts, skips, used = run_program(command, environment)
    first = next((i for i, test in enumerate(tests) if verdicts.get(test) in (None, "FAILED")), len(tests))
    if first < len(tests):
        verdicts[tests[first]] = "FAILED"
    for test in tests[first + 1:]:
        if verdicts.get(test) in (None, "FAILED"):
            again, _, alone, _, more = run_program([command[0], f"{command[1]}:{test}"], environment)
            verdicts[test], used = alone.get(test, "FAILED"), used + more
            output += f"\nalone:\n{again}"
    passed, failed = (sum(verdict == word for verdict in verdicts.values()) for word in ("OK", "FAILED"))
    if status != 0 and failed == 0:  # it died after the last test
        failed = 1
    lines = [f"== {name}"]
    if failed or os.environ.get("VERBOSE"):
        lines.append(output)
    lines += [f"   failed: {test}" for test, verdict in verdicts.items() if verdict == "FAILED"]
    lines.append(f"   {passed} passed, {failed} failed, {len(skips)} skipped" + (f" (exit status {status})" if status else ""))
    return Result("\n".join(lines), passed, failed, skips, used)


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
    """In a process of its own: the tests' report, and what run_module() needs of it in a last line."""
    sys.path.insert(0, "tests/integration")
    stream = io.StringIO()
    result = unittest.TextTestRunner(verbosity=2, stream=stream, resultclass=Timed).run(
        unittest.TestLoader().loadTestsFromName(name))
    print(stream.getvalue(), end="")
    # One test fails once, however many of its subtests do.
    failed = len({getattr(test, "test_case", test).id() for test, _ in result.failures + result.errors})
    print(json.dumps({"failed": failed, "passed": max(result.testsRun - failed - len(result.skipped), 0),
                      "skips": [(test.id(), reason) for test, reason in result.skipped]}))


def run_module(name, environment, module):
    output, status, used = run_command([sys.executable, __file__, MODULE, module], environment)
    text, _, last = output.rstrip("\n").rpartition("\n")
    if status != 0 or not last.startswith('{"failed"'):  # it died
        return Result(f"== {name}\n{output}", 0, 1, [], used)
    counts = json.loads(last)
    return Result(f"== {name}\n{text}", counts["passed"], counts["failed"], counts["skips"], used)


def tests_of(build):
    """What there is to run: name -> function of the name that it goes by and of its environment."""
    found = {path.stem: functools.partial(run_module, module=path.stem)
             for path in sorted(pathlib.Path("tests/integration").glob("test_*.py"))}
    for program in sorted(build.glob("tests/*/*_tests")):
        listing = subprocess.run([program, "--list"], stdout=subprocess.PIPE, text=True, check=True).stdout
        files = collections.defaultdict(list)
        for line in listing.splitlines():
            file, test, *_ = line.split(" ")
            files[file].append(test)
        found.update({file: functools.partial(run_cmocka, command=[program, file], tests=tests) for file, tests in files.items()})
    contract = build / "tests/tracers/test_contract"
    if contract.is_file():
        rows = subprocess.run([contract, "--list"], stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()
        found.update({f"contract/{row}": functools.partial(run_cmocka, command=[contract, f"{row}: "], tests=())
                      for row in rows})
    return found


def named(core, rest, words):
    """In the way that a word begins with, as a part of `make test` if it is one."""
    chosen = {}
    for run in core + rest:
        way = run.name.removesuffix(run.test)
        if any(word.startswith(way) and word.removeprefix(way) in f"/{run.test}" for word in words):
            chosen.setdefault(run.name, run._replace(environment=suite.WAYS[way].environment))
    return list(chosen.values())


def known_times(path):
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return {}


def timed(task):
    begin = time.monotonic()
    return task(), time.monotonic() - begin


class Sums:
    """What has been run so far; prints what each has to say."""

    def __init__(self):
        self.passed = self.failed = self.skipped = self.left = self.without_models = 0
        self.skips_are_failures = os.environ.get("CI") == "true"

    def add(self, result, seconds=None, leaves=False):
        """`leaves`: tests may be left to another run."""
        print(result.text + ("" if seconds is None else f" in {seconds:.1f} s, of processors {result.used:.1f} s"), flush=True)
        self.passed += result.passed
        self.failed += result.failed
        for test, reason in result.skips:
            if leaves and reason == LEFT:
                self.left += 1
                continue
            expected = any(re.search(pattern, reason) for pattern in EXPECTED_SKIPS)
            fails = reason == LEFT or (self.skips_are_failures and not expected)
            self.failed += fails
            self.skipped += not fails
            self.without_models += NO_MODELS in reason
            print(f"   {'FAILED, as it was skipped' if fails else 'skipped'}: {test}: {reason}", flush=True)

    def show(self):
        if self.left:
            print(f"{self.left} tests are {LEFT}")
        if self.without_models:
            print(f"{self.without_models} of the skipped tests need models: FARLIGHT_SCENES=FOLDER says where they are")
        print(f"\n{self.passed} passed, {self.failed} failed, {self.skipped} skipped")


def device_of(build, way):
    """The device that programs render with in a way, where a way asks for one. None: it is not there."""
    if not way.renderer:
        return ""
    listing = subprocess.run([build / "farlightd", "--list-devices"], env={**os.environ, **way.environment},
                             stdout=subprocess.PIPE, text=True, check=False).stdout.strip()
    return listing if way.renderer in listing else None


def begin_ways(build, runs):
    """Whether every way of the runs can be had; says which devices they are."""
    for prefix in sorted({run.name.removesuffix(run.test) for run in runs}):
        device = device_of(build, suite.WAYS[prefix])
        if device is None:
            print(f"{prefix}: no device of that kind is here; its driver is in the packages of `make stack-packages`")
            return False
        if device:
            print(f"{prefix} is on {device}")
    return True


def choose(found, sanitized, arguments):
    """The runs that are asked for."""
    core, rest = suite.runs(found, sanitized)
    if arguments[:1] == ["--rest"]:
        return rest
    if arguments[:1] == ["--part"]:
        return suite.part(rest, int(arguments[1]))
    return named(core, rest, arguments) if arguments else core


def run_all(build, runs, tests, sums):
    jobs = int(os.environ.get("FARLIGHT_TEST_JOBS") or min(JOBS_MAX, len(os.sched_getaffinity(0)) + 2))
    times_path = build / "test_times.json"
    times, took, used = {**dict.fromkeys(suite.LONGEST, 1000), **known_times(times_path)}, {}, {}
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        running = {pool.submit(timed, functools.partial(tests[run.test], run.name, run.environment)): run
                   for run in sorted(runs, key=lambda run: -times.get(run.name, 0))}
        for done in concurrent.futures.as_completed(running):
            run = running[done]
            result, took[run.name] = done.result()
            used[run.name] = result.used
            sums.add(result, took[run.name], "FARLIGHT_TEST_LONG" not in {**os.environ, **run.environment})
    times_path.write_text(json.dumps({**times, **took}, indent=1))
    for title, seconds in (("slowest", took), ("most processor time", used)):
        longest = sorted(seconds.items(), key=lambda item: -item[1])[:SLOWEST]
        print(f"\n{title}: " + ", ".join(f"{name} {value:.0f} s" for name, value in longest), end="")
    print(f"\nprocessor time: {processor_time(resource.getrusage(resource.RUSAGE_CHILDREN)):.0f} s")


def main():
    if len(sys.argv) < 2 or sys.argv[1] in ("-h", "--help"):
        print(__doc__.strip())
        return 0
    if sys.argv[1] == MODULE:
        module_main(sys.argv[2])
        return 0
    build = pathlib.Path(sys.argv[1]).resolve()
    # Mesa's driver keeps memory until the process ends; that is not ours to free. In full: tests run in folders of their own.
    suppressions = pathlib.Path(__file__).resolve().with_name("lsan.supp")
    os.environ.setdefault("LSAN_OPTIONS", f"suppressions={suppressions}:print_suppressions=0")
    # Or LeakSanitizer may follow what lies before a library's thread-local memory as if it were a pointer, and crash.
    os.environ.setdefault("ASAN_OPTIONS", "intercept_tls_get_addr=0")
    os.environ.setdefault("UBSAN_OPTIONS", "print_stacktrace=1")
    os.environ["FARLIGHT_BIN"] = str(build)
    scenes = pathlib.Path("../shared/scenes").resolve()
    if scenes.is_dir():
        os.environ.setdefault("FARLIGHT_SCENES", str(scenes))
    # Compiled shaders, of Mesa and of the daemon: all programs and all configurations share them.
    cache = build.parent / "cache"
    cache.mkdir(exist_ok=True)
    os.environ.setdefault("XDG_CACHE_HOME", str(cache))
    tests = tests_of(build)
    sums = Sums()
    runs = choose(tests, build.name == "sanitize", sys.argv[2:])
    if not begin_ways(build, runs):
        return 1
    if len(sys.argv) == 2:
        for fault in suite.faults(tests):
            sums.add(Result(fault, 0, 1, [], 0))
        sums.add(run_check("include rules", [sys.executable, "tests/tools/check_includes.py"]))
        sums.add(run_check("headers alone", ["make", "-s", "check-headers"]))
    run_all(build, runs, tests, sums)
    sums.show()
    return 1 if sums.failed or not sums.passed else 0


if __name__ == "__main__":
    sys.exit(main())
