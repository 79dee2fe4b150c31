#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs frames of every tracer and integrator on Mesa's zink under Vulkan's synchronisation validation, and fails if it
finds a hazard: a pass that reads or overwrites what an earlier one wrote, without the glMemoryBarrier() for it.

Usage: check_sync.py BUILD_FOLDER
zink's own barriers between shaders are left out (sync_layer.c). At the end a frame is rendered without any barrier
between shaders, and it fails unless hazards are found.

No hazard found is no proof. The validation of Vulkan 1.3.239 recognises few of the accesses by zink's shaders: in frames
without any barrier it reports about one dispatch in twenty, so that a single missing barrier may stay unseen. It cannot
tell apart the bits of a glMemoryBarrier() for storage buffers and for buffer textures. It does not see a missing
GL_BUFFER_UPDATE_BARRIER_BIT, as zink orders copies and the host itself, hazards between command buffers, of which zink
begins one where the host waits, and invocations of one dispatch that are in each other's way.
"""
import collections
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

# Tests of unit_tests, and which passes they have. They check their pictures, too.
FRAMES = (
    ("accuracy/frame_ahead:the_host_waits_once_for", "frames whose waves are queued and waited for"),
    ("accuracy/layers:", "layers of every tracer"),
    ("accuracy/render_frame:rasterised_and_traced", "rasterised first hits"),
    ("accuracy/frame_ycbcr:", "pictures as YCbCr"),
    ("unit/trace/bvh/refit:", "refits of a hierarchy"),
    ("unit/gpu_scene/motion:", "scenes that move and deform"),
    ("unit/trace/abuffer/build:", "builds of A-buffers"),
)
# Its waves are queued: where the host makes their lists it waits for each.
WITHOUT_BARRIERS = "accuracy/frame_ahead:rays_behind_the_last_queued"
# Messages about zink itself, each with its reason.
NOT_OURS = (
    ("INDIRECT_COMMAND_READ, prior_usage: SYNC_COPY_TRANSFER_WRITE",
     "OpenGL orders what a client writes itself (glNamedBufferSubData) before all commands that follow: no glMemoryBarrier() "
     "is for it. Of a buffer that shaders have written since, the validation does not see that they did."),
)

SETTINGS = """khronos_validation.enables = VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT
khronos_validation.disables = VK_VALIDATION_FEATURE_DISABLE_CORE_CHECKS_EXT,VK_VALIDATION_FEATURE_DISABLE_API_PARAMETERS_EXT,\
VK_VALIDATION_FEATURE_DISABLE_OBJECT_LIFETIMES_EXT,VK_VALIDATION_FEATURE_DISABLE_THREAD_SAFETY_EXT,\
VK_VALIDATION_FEATURE_DISABLE_UNIQUE_HANDLES_EXT
khronos_validation.duplicate_message_limit = 0
khronos_validation.debug_action = VK_DBG_LAYER_ACTION_LOG_MSG
khronos_validation.report_flags = error,warn
khronos_validation.log_filename = {log}
"""
LAYER = "VK_LAYER_FARLIGHT_sync"


def prepare(folder, library):
    """The environment in which a program renders under validation."""
    (folder / "vk_layer_settings.txt").write_text(SETTINGS.format(log=folder / "log"))
    (folder / "sync_layer.json").write_text(json.dumps({"file_format_version": "1.2.0", "layer": {
        "name": LAYER, "type": "GLOBAL", "library_path": str(library), "api_version": "1.3.239",
        "implementation_version": "1", "description": "barriers of glMemoryBarrier() alone",
        "functions": {"vkNegotiateLoaderLayerInterfaceVersion": "farlight_sync_layer"}}}))
    return {**os.environ, "LIBGL_ALWAYS_SOFTWARE": "1", "GALLIUM_DRIVER": "zink", "FARLIGHT_TEST_LONG": "1",
            "VK_ADD_LAYER_PATH": str(folder), "VK_INSTANCE_LAYERS": f"{LAYER}:VK_LAYER_KHRONOS_validation",
            "VK_LAYER_SETTINGS_PATH": str(folder), "FARLIGHT_SYNC_COUNTS": str(folder / "counts")}


def hazards_of(folder, program, test, environment):
    """(result, hazards, dispatches) of a test; ends the run if it fails or nothing was dispatched under validation."""
    log, counts = folder / "log", folder / "counts"
    log.unlink(missing_ok=True)
    counts.unlink(missing_ok=True)
    result = subprocess.run([program, test], env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                            errors="replace", check=False)
    if not log.is_file() or not counts.is_file():
        sys.exit(f"{result.stdout}\n{test}: not under validation; see the packages of make check-sync")
    hazards = [line for line in log.read_text(errors="replace").splitlines() if line.startswith("SYNC-")]
    return result, hazards, sum(int(line.split()[0]) for line in counts.read_text().splitlines())


def kinds(hazards):
    """What they say, without handles: text -> how often."""
    texts = (re.sub(r"0x[0-9a-f]+(\[\])?|seq_no: \d+|reset_no: \d+", "", line.partition("MessageID")[2]) for line in hazards)
    return collections.Counter(" ".join(text.lstrip(" =|").split()) for text in texts)


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    program, library = build / "tests/unit/unit_tests", build / "tests/tools/sync_layer.so"
    cache = build.parent / "cache"
    cache.mkdir(exist_ok=True)
    os.environ.setdefault("XDG_CACHE_HOME", str(cache))
    failed = False
    with tempfile.TemporaryDirectory(prefix="farlight-sync-") as name:
        folder = pathlib.Path(name)
        environment = prepare(folder, library)
        for test, what in FRAMES:
            result, hazards, dispatches = hazards_of(folder, program, test, environment)
            ours = kinds(line for line in hazards if not any(re.search(pattern, line) for pattern, _ in NOT_OURS))
            failed = failed or bool(ours) or result.returncode != 0
            print(f"{what}: {dispatches} dispatches, {sum(ours.values())} hazards", flush=True)
            for text, count in ours.most_common(20):
                print(f"   {count} times {text}")
            if result.returncode != 0:
                print(f"{test} failed:\n{result.stdout}")
        _, hazards, dispatches = hazards_of(folder, program, WITHOUT_BARRIERS, {**environment, "FARLIGHT_SYNC_DROP_ALL": "1"})
        failed = failed or not hazards
        print(f"a frame without barriers: {dispatches} dispatches, {len(hazards)} hazards, as there must be some")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
