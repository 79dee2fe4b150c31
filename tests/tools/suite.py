# SPDX-License-Identifier: MIT
"""Which tests `make test` runs, which it leaves to `make test-all`, and in which ways a test runs.

A test of the runner is a file of C tests, a module of integration tests or a row of the contract suite; its name is a
path below tests/ without its ending. `make test` is what a commit has to pass, in minutes. `make test-all` runs all
the rest, and CI one part of it each day, so that a week sees everything."""
import collections
import pathlib
import re

import check_sync

PARTS = 7  # of the rest: one a day

# How a test runs: its environment, and what the daemon must then say that it renders with.
Way = collections.namedtuple("Way", "environment renderer")
WAYS = {
    "": Way({}, ""),
    # llvmpipe that takes a GPU's way through the passes (server/gpu/device.h).
    "like-gpu/": Way({"FARLIGHT_LIKE_GPU": "1"}, ""),
    # A second driver stack: OpenGL over Vulkan, here on lavapipe (mesa-vulkan-drivers).
    "zink/": Way({"LIBGL_ALWAYS_SOFTWARE": "1", "GALLIUM_DRIVER": "zink"}, "zink"),
}

# Tables of patterns, each of which must match the whole name of a test that there is.

# Tests that depend on the device and its driver run in every way; forms of a tracer, which differ in settings, in one, but for
# nodes, of which `auto` chooses by the device.
ON_DEVICE = (r"accuracy/.*", r"contract/\w+(, nodes of \w+)?", r"unit/gpu/.*", r"unit/gpu_scene/.*", r"unit/render/.*", r"unit/trace/.*", r"test_stacks")
# Compares zink with llvmpipe.
ZINK_ALONE = (r"test_stacks",)
# What `make test` runs as GPUs do it.
LIKE_GPU = (r"contract/(naive|bvh(, nodes of \w+)?|ldc|abuffer|rayspace|quadtree)", r"accuracy/(render_frame|frame_steps|frame_shared)")
# Left to `make test-all`: breadth that costs much, beside what others see of the same kind.
LEFT = (r"contract/(naive|bvh|ldc|abuffer|rayspace|quadtree)", r"contract/\w+(,| in | with | by ).*", r"test_bench")

# With config=sanitize, `make test` runs what needs no OpenGL device: codecs, sessions, scenes, readers of files.
WITHOUT_DEVICE = (r"test_import(_\w+)?", r"unit/(base|client|edit|encode|fuzz|helper|import|net|protocol|scene|session|store|viewer|warp|web)/.*",)
# The sanitizers see nothing of shaders, which Mesa compiles at run time, and make what rasterises large structures take
# ten times as long: pictures against closed forms, forms of a tracer that differ in shaders, commands whose pictures are compared.
NOT_SANITIZED = (
    r"accuracy/(?!render_frame|tracer_owners|wave_comparison).*",
    r"contract/(ldc|abuffer|rayspace,|quadtree).*",
    r"unit/trace/(abuffer|ldc)/traversal", r"unit/trace/quadtree/layers",
    r"test_(animate|bench|check_device|compare.*|guide|import_animation|layers|models|pictures|poses|shot|siege|tracer_commands|view)")

# Targets of make that are no tests of the runner: their part of the rest, and a command that says why if they cannot run here.
Step = collections.namedtuple("Step", "target part check")
NO_FIDELITY = 'test -e "${FARLIGHT_SCENES:-../shared/scenes}/fidelity" || { echo "no folder fidelity at FARLIGHT_SCENES"; false; }'
ROOT = "tests/packages/clean_install.sh --check"
STEPS = (
    Step("soak ROUNDS=400", 1, "true"),
    Step("deb-test", 2, ROOT),
    Step("container-test", 2, f"{ROOT} && unshare --net --pid --fork --mount-proc true"),
    Step("siege ATTACKS='--any-machine --seconds 2'", 3, "true"),
    Step("web-test", 3, "true"),
    Step("farm-test", 4, "true"),
    Step("blender-test", 5, "true"),
    Step("fuzz SECONDS=10", 6, "true"),
    Step("check-sync", 7, "true"),
    Step("farm-drill ROUNDS=60", 7, "true"),
    Step("fidelity SMALL=1 SAMPLES=16", 7, NO_FIDELITY),
)
# Names of targets that must be among them.
STEP_NAMES = r"check-sync|farm-drill|fidelity|fuzz|siege|soak|\w+-test"
# What takes longest where no times of an earlier run are known: it begins first.
LONGEST = ("test_pictures", "like-gpu/contract/rayspace", "like-gpu/contract/quadtree", "like-gpu/contract/ldc", "test_animate",
           "like-gpu/contract/abuffer", "test_tracer_commands", "test_compare", "test_units", "test_view", "test_siege", "accuracy/materials")

Run = collections.namedtuple("Run", "name test environment")


def matches(table, name):
    return any(re.fullmatch(pattern, name) for pattern in table)


def has_long(name):
    """Whether a file of tests does more for FARLIGHT_TEST_LONG."""
    files = {"contract": sorted(pathlib.Path("tests/tracers").glob("*.c"))}.get(
        name.partition("/")[0], [pathlib.Path(f"tests/{name}.c"), pathlib.Path(f"tests/integration/{name}.py")])
    return any(re.search(r"FARLIGHT_TEST_LONG|\b(TEST_)?LONG\b|\blong_test\b", file.read_text()) for file in files if file.is_file())


def runs(names, sanitized):
    """(those of `make test`, those of `make test-all`), which together run every test in every way that it has, and long
    tests in the first way alone."""
    core, rest = [], []
    for name in sorted(names):
        for prefix, way in WAYS.items():
            if prefix and (sanitized or not matches(ON_DEVICE, name)):
                continue
            if prefix != "zink/" and matches(ZINK_ALONE, name):
                continue
            if sanitized:
                if matches(NOT_SANITIZED, name):
                    continue
                is_core = matches(WITHOUT_DEVICE, name)
            else:
                is_core = {"": not matches(LEFT, name), "like-gpu/": matches(LIKE_GPU, name)}.get(prefix, False)
            if is_core:
                core.append(Run(prefix + name, name, way.environment))
            if prefix and not is_core:
                rest.append(Run(prefix + name, name, way.environment))
            elif not prefix and (not is_core or has_long(name)):
                rest.append(Run(name, name, {"FARLIGHT_TEST_LONG": "1"}))
    return core, rest


def part(rest, number):
    """One of PARTS, counted from 1. Neighbours in the alphabet take as long as each other: they go to different parts."""
    return rest[number - 1::PARTS]


def faults(names):
    """What is wrong with the tables above, where all programs of tests are built."""
    every = [prefix + name for prefix in WAYS for name in names]
    for table in (ON_DEVICE, ZINK_ALONE, LIKE_GPU, LEFT, WITHOUT_DEVICE, NOT_SANITIZED, LONGEST):
        for pattern in table:
            if not any(re.fullmatch(pattern, name) for name in every):
                yield f"tests/tools/suite.py: no test is called {pattern}"
    for test in (*(frame[0] for frame in check_sync.FRAMES), check_sync.WITHOUT_BARRIERS):
        if test.split(":")[0] not in names:
            yield f"tests/tools/check_sync.py: no test is called {test}"
    rules = "\n".join(pathlib.Path(name).read_text() for name in ("Makefile", "tests/tests.mk", "conf/install.mk"))
    targets = re.findall(r"^\.PHONY:(.*)", rules, re.MULTILINE)
    for target in " ".join(targets).split():
        if re.fullmatch(STEP_NAMES, target) and not any(step.target.split()[0] == target for step in STEPS):
            yield f"tests/tools/suite.py: no part of `make test-all` runs `make {target}`"
