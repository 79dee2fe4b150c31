#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs every test and prints one closing line: N passed, N failed, N skipped.

Usage: run_tests.py BUILD_FOLDER [PART_OF_A_NAME ..]      /scene/ is the folder of that name alone
C tests are cmocka programs below BUILD_FOLDER/tests that hold many files of tests; each file runs in a process of its
own. Integration tests are unittest modules in tests/integration, which find the programs through FARLIGHT_BIN. The
rules of the sources are checked first. Files and modules run side by side, as most of them leave processors idle:
FARLIGHT_TEST_JOBS at a time (default: two more than there are processors, at most 4), those first that took longest
the last time. With CI=true in the environment, a skipped test fails unless EXPECTED_SKIPS names its reason.
FARLIGHT_TEST_SANITIZED=1 leaves out where the sanitizers see little for their time (NOT_SANITIZED).
FARLIGHT_TEST_STACK=zink runs what depends on the driver on another driver stack than Mesa's default (STACKS): without a
part of a name what is worth most for its time, with FARLIGHT_TEST_LONG=1 all of it.
FARLIGHT_TEST_LONG=1 also runs what adds breadth, not another kind of check: LONG, which a part of a name chooses too.
"""
import collections
import concurrent.futures
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

FILE_TIMEOUT_S = 900  # of one file of C tests, beside others
JOBS_MAX = 4  # each holds pictures, structures and daemons
SLOWEST = 10  # so many are named at the end
MODULE = "--module"  # run_tests.py --module NAME: one module of integration tests, for run_module()

# Reasons for which a test may be skipped in CI.
EXPECTED_SKIPS = (
    r"no systemd can be started here",  # most containers start none
    r"sanitizers (do not run within|have an allocator)",
    r"ptrace: ",  # forbidden in many containers
    r"this kernel does not name children",
    r"a GPU refits nothing in order",
    r"no promtool",  # its package starts a server
    r"left to make test-all",
    r"programs on such a library need its compiler flags",  # of the sanitizers and of coverage
)
# Under the sanitizers each large allocation of Mesa's is mapped and cleared anew, so that what rasterises large
# structures takes ten times as long, and they see nothing of shaders, which Mesa compiles at run time. Left out are
# pictures and samples against closed forms, forms of a tracer that differ in shaders, rows of the tracers that rasterise
# (their rooms' unit tests stay, but for those of answers), and programs from end to end where pictures are compared.
NOT_SANITIZED = re.compile(
    r"accuracy/(?!render_frame|tracer_owners|wave_comparison)"
    r"|contract/(.*(ray alone|packets of|rays? a call)|bvh in the plain|ldc|abuffer|rayspace, |quadtree)"
    r"|unit/trace/(abuffer/traversal|ldc/traversal|quadtree/layers)"
    r"|test_(abuffer|animate|check_device|compare.*|denoise|guide|import_animation|layers|ldc|light|models|poses|quadtree|rayspace|shot|siege|view)$")
# Where no times of an earlier run are known: what takes longest begins first.
LONGEST_FIRST = ("test_view", "test_import", "accuracy/sampled_against_reference", "accuracy/frame_ahead",
                 "accuracy/emitters", "test_light", "test_models", "test_siege", "accuracy/distributed", "test_animate",
                 "test_render", "test_denoise", "test_compare", "accuracy/energy", "test_drill", "test_compare_tracers",
                 "test_abuffer", "accuracy/path_light", "contract/quadtree", "unit/trace/ldc/traversal",
                 "contract/rayspace, flat, by spheres, in batches of 256", "test_check_device", "test_poses",
                 "test_quadtree", "test_staying_up", "test_sealed", "test_units")

# Left to FARLIGHT_TEST_LONG=1: forms of a tracer whose settings other rows have in other combinations, or whose answers
# others hold against brute force: unit/trace/ldc/traversal (all levels, packets and layers one by one) and build (lists as
# peeled), unit/trace/bvh/tracer (one ray alone, packets, spheres, the plain form), accuracy/sampled_against_reference (searches),
# unit/trace/rayspace/reduce and tracer (ways to reduce, too little room) and nodes (sorted, turned round),
# accuracy/quadtree_against_reference (numbers of layers, the view, planes).
LONG = re.compile(r"contract/(bvh, one|bvh, packets|bvh in the plain|bvh with|ldc, |ldc by|abuffer, |rayspace, flat$|rayspace, sorted"
                  r"|rayspace with|quadtree, of one layer|quadtree, of the view|quadtree, planes)")

# Driver stacks beside the default one: what chooses it, and what the daemon must then say that it renders with.
# zink is OpenGL 4.6 over Vulkan, here on lavapipe (mesa-vulkan-drivers).
Stack = collections.namedtuple("Stack", "environment renderer")
STACKS = {"zink": Stack({"LIBGL_ALWAYS_SOFTWARE": "1", "GALLIUM_DRIVER": "zink"}, "zink")}
# What depends on the driver: tracers, frames, layers, and commands from end to end.
ON_A_STACK = re.compile(r"accuracy/|contract/|unit/(gpu|gpu_scene|render|trace)/|test_stacks$"
                        r"|test_(render|layers|ldc|abuffer|compare_tracers|animate|carousel|light|poses)$")
# Left to FARLIGHT_TEST_LONG=1, as others see the same of a driver in less time: scattering and light against closed forms,
# which is GLSL's arithmetic again; the lengths of steps; forms of a tracer that differ in constants of a shader, or in
# what the host does; what fills memory up to limits; commands that differ from those of test_stacks in files and options.
LONG_ON_A_STACK = re.compile(
    r"accuracy/(bsdf|sampling|sampled_against_reference|shading_.*|path_light|distributed_light|emitters|energy.*|fireflies|sheen|film"
    r"|depth_of_field|frame_steps)"
    r"|contract/(bvh, one ray alone|reference, |ldc by|rayspace, flat, by|quadtree, of boxes)"
    r"|unit/trace/(abuffer|ldc)/(limits|traversal)|unit/trace/bvh/history"
    r"|test_(render|ldc|abuffer|animate|carousel|light|poses)$")
# Compares two stacks.
ONLY_ON_A_STACK = re.compile(r"test_stacks$")

# skips: (test, reason); used: processor time of it and of the programs that it has waited for, in seconds
Result = collections.namedtuple("Result", "text passed failed skips used")


def processor_time(usage):
    return usage.ru_utime + usage.ru_stime


def run_command(command, timeout=None):
    """(output, exit status, processor time)"""
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace") as program:
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


def run_program(command):
    """(output, exit status, test -> verdict, (test, reason) of those that were skipped, processor time)"""
    output, status, used = run_command(command, FILE_TIMEOUT_S)
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


def run_cmocka(name, command, tests):
    """`tests`: their names in order, where they are known. What follows a test that failed, or after which the program
    died, may have failed because of it, and is run again alone."""
    output, status, verdicts, skips, used = run_program(command)
    first = next((i for i, test in enumerate(tests) if verdicts.get(test) in (None, "FAILED")), len(tests))
    if first < len(tests):
        verdicts[tests[first]] = "FAILED"
    for test in tests[first + 1:]:
        if verdicts.get(test) in (None, "FAILED"):
            again, _, alone, _, more = run_program([command[0], f"{command[1]}:{test}"])
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


def run_module(name):
    output, status, used = run_command([sys.executable, __file__, MODULE, name])
    text, _, last = output.rstrip("\n").rpartition("\n")
    if status != 0 or not last.startswith('{"failed"'):  # it died
        return Result(f"== {name}\n{output}", 0, 1, [], used)
    counts = json.loads(last)
    return Result(f"== {name}\n{text}", counts["passed"], counts["failed"], counts["skips"], used)


def tasks(build, names):
    """What there is to run: name -> function."""
    found = {path.stem: lambda name=path.stem: run_module(name)
             for path in sorted(pathlib.Path("tests/integration").glob("test_*.py"))}
    for program in sorted(build.glob("tests/*/*_tests")):
        listing = subprocess.run([program, "--list"], stdout=subprocess.PIPE, text=True, check=True).stdout
        files = collections.defaultdict(list)
        for line in listing.splitlines():
            file, test, *_ = line.split(" ")
            files[file].append(test)
        for file, tests in files.items():
            found[file] = lambda file=file, program=program, tests=tests: run_cmocka(file, [program, file], tests)
    contract = build / "tests/tracers/test_contract"
    if contract.is_file():
        rows = subprocess.run([contract, "--list"], stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()
        found.update({f"contract/{row}": lambda row=row: run_cmocka(f"contract/{row}", [contract, f"{row}: "], ())
                      for row in rows})
    if os.environ.get("FARLIGHT_TEST_SANITIZED"):
        found = {name: task for name, task in found.items() if not NOT_SANITIZED.match(name)}
    if not names and not os.environ.get("FARLIGHT_TEST_LONG"):
        found = {name: task for name, task in found.items() if not LONG.match(name)}
    stack = STACKS.get(os.environ.get("FARLIGHT_TEST_STACK"))
    found = {name: task for name, task in found.items()
             if (ON_A_STACK.match(name) if stack else not ONLY_ON_A_STACK.match(name))}
    if stack and not names and not os.environ.get("FARLIGHT_TEST_LONG"):
        found = {name: task for name, task in found.items() if not LONG_ON_A_STACK.match(name)}
    return {name: task for name, task in found.items() if not names or any(part in f"/{name}" for part in names)}


def known_times(path):
    try:
        times = json.loads(path.read_text())
    except (OSError, ValueError):
        times = {}
    return {**{name: 1000 - place for place, name in enumerate(LONGEST_FIRST)}, **times}


def timed(task):
    begin = time.monotonic()
    return task(), time.monotonic() - begin


class Sums:
    """What has been run so far; prints what each has to say."""

    def __init__(self):
        self.passed = self.failed = self.skipped = 0
        self.skips_are_failures = os.environ.get("CI") == "true"

    def add(self, result, seconds=None):
        print(result.text + ("" if seconds is None else f" in {seconds:.1f} s, of processors {result.used:.1f} s"), flush=True)
        self.passed += result.passed
        self.failed += result.failed
        for test, reason in result.skips:
            expected = any(re.search(pattern, reason) for pattern in EXPECTED_SKIPS)
            fails = self.skips_are_failures and not expected
            self.failed += fails
            self.skipped += not fails
            print(f"   {'FAILED, as it was skipped' if fails else 'skipped'}: {test}: {reason}", flush=True)


def choose_stack(build):
    """True when the programs render with the driver stack that FARLIGHT_TEST_STACK names; unset: Mesa's default."""
    name = os.environ.get("FARLIGHT_TEST_STACK")
    if not name:
        return True
    if name not in STACKS:
        print(f"FARLIGHT_TEST_STACK={name} is not one of: {', '.join(STACKS)}")
        return False
    os.environ.update(STACKS[name].environment)
    listing = subprocess.run([build / "farlightd", "--list-devices"], stdout=subprocess.PIPE, text=True, check=False).stdout
    if STACKS[name].renderer not in listing:
        print(f"no driver stack {name}: farlightd --list-devices says {listing.strip() or 'nothing'}")
        return False
    print(f"on {listing.strip()}")
    return True


def run_all(build, names):
    sums = Sums()
    if not names and not os.environ.get("FARLIGHT_TEST_STACK"):
        sums.add(run_check("include rules", [sys.executable, "tests/tools/check_includes.py"]))
        sums.add(run_check("headers alone", ["make", "-s", "check-headers"]))
    jobs = int(os.environ.get("FARLIGHT_TEST_JOBS") or min(JOBS_MAX, len(os.sched_getaffinity(0)) + 2))
    times_path = build / f"test_times{os.environ.get('FARLIGHT_TEST_STACK', '')}.json"
    times, todo, took, used = known_times(times_path), tasks(build, names), {}, {}
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        running = {pool.submit(timed, todo[name]): name
                   for name in sorted(todo, key=lambda name: -times.get(name, 0))}
        for done in concurrent.futures.as_completed(running):
            result, took[running[done]] = done.result()
            used[running[done]] = result.used
            sums.add(result, took[running[done]])
    times_path.write_text(json.dumps({**times, **took}, indent=1))
    for title, seconds in (("slowest", took), ("most processor time", used)):
        longest = sorted(seconds.items(), key=lambda item: -item[1])[:SLOWEST]
        print(f"\n{title}: " + ", ".join(f"{name} {value:.0f} s" for name, value in longest), end="")
    print(f"\nprocessor time: {processor_time(resource.getrusage(resource.RUSAGE_CHILDREN)):.0f} s")
    return sums


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
    if not choose_stack(build):
        return 1
    sums = run_all(build, sys.argv[2:])
    print(f"\n{sums.passed} passed, {sums.failed} failed, {sums.skipped} skipped")
    return 1 if sums.failed or not sums.passed else 0


if __name__ == "__main__":
    sys.exit(main())
