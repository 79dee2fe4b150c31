#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`make bench`: where the time goes, in tables. Usage: bench.py BUILD_FOLDER

Everything is run several times after a warm-up; the median is printed. Ratios come from one run on one machine.
Scenes of FARLIGHT_SCENES (default: ../shared/scenes beside the checkout) are left out, and named, where missing.
"""
import json
import os
import pathlib
import shutil
import statistics
import struct
import subprocess
import sys
import tempfile
import time

BUILD = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "build/release").resolve()
SHARED = pathlib.Path(os.environ.get("FARLIGHT_SCENES", "../shared/scenes"))
FARLIGHT = BUILD / "farlight"
RUNS = int(os.environ.get("BENCH_RUNS", "3"))
STAGES = ("apply", "build", "upload", "primary", "trace", "shade", "resolve", "readback", "encode", "queue", "send")


def command(*arguments):
    result = subprocess.run(list(map(str, arguments)), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                            check=False)
    if result.returncode != 0:
        sys.exit(f"bench: {' '.join(map(str, arguments))} ended with {result.returncode}: {result.stderr}")
    return result.stdout


def timed(*arguments):
    begin = time.monotonic()
    command(*arguments)
    return time.monotonic() - begin


def records(*arguments):
    lines = [json.loads(line) for line in command(*arguments).splitlines()]
    return [r for r in lines if r["kind"] == "frame"], next(r for r in lines if r["kind"] == "client")


def stage_ms(frame, stage, clock="cpu"):
    return sum(s["duration_ns"] for s in frame["stages"] if s["stage"] == stage and s["clock"] == clock) / 1e6


class Daemon:
    def __init__(self):
        self.folder = tempfile.mkdtemp(prefix="farlight-bench-")
        self.address = f"unix:{self.folder}/socket"
        self.process = subprocess.Popen([BUILD / "farlightd", "--listen", self.address], stdout=subprocess.PIPE,
                                        stderr=subprocess.DEVNULL, text=True)
        for line in self.process.stdout:
            if line.startswith("READY"):
                return
        sys.exit("bench: the daemon did not start")

    def close(self):
        self.process.terminate()
        self.process.wait()
        self.process.stdout.close()
        shutil.rmtree(self.folder, ignore_errors=True)


def models(folder):
    """(title, model, further options) of the bundled and the shared scenes."""
    sky = ["--environment", folder / "sky.hdr"]
    yield "teapot (bundled)", folder / "teapot.glb", sky
    yield "cornell (bundled)", folder / "cornell.glb", []
    yield "sphereflake-4 (bundled)", folder / "sphereflake-4.nff", []
    yield "bumpy 150K (bundled)", folder / "bumpy-150.glb", sky
    kitchen = ["--eye", "7.634,-4.168,1.422", "--look-at", "12.037,4.713,0.107", "--up", "0,0,1", "--fov", "58.7"]
    for title, name, options in (("dragon 47K", "common/dragon-47k.glb", sky), ("bunny 69K", "common/bunny-69k.obj", sky),
                                 ("kitchen 86K", "rayspace/kitchen.obj", sky + kitchen),
                                 ("helmet, textured", "gltf/DamagedHelmet.glb", sky),
                                 ("balls, 7,381 spheres", "bvh/spd-balls-4.nff", []),
                                 ("gears 37K", "bvh/spd-gears.nff", []), ("dragon 871K", "common/dragon-871k.glb", sky)):
        if (SHARED / name).is_file():
            yield title, SHARED / name, options
        else:
            print(f"left out: {name} is not below FARLIGHT_SCENES")


def scene_table(folder):
    print("\n## Scenes: 640x480, one sample, depth 4; milliseconds on the daemon's clock; a warm daemon\n")
    print(f"{'scene':24} {'import':>7} {'upload':>7} " + " ".join(f"{s:>8}" for s in STAGES[1:]) +
          f" {'Mray/s':>7} {'2nd bulk B':>10}")
    for title, model, options in models(folder):
        daemon = Daemon()
        try:
            runs, again = [], None
            for run in range(RUNS + 1):
                frames, client = records(FARLIGHT, "render", model, "-o", f"{daemon.folder}/x.png", "--size", "640x480",
                                         "--depth", "4", "--server", daemon.address, "--timings=json", *options)
                if run == 0:
                    first = client
                else:
                    runs.append(frames[0])
                    again = client
            median = {s: statistics.median(stage_ms(f, s) for f in runs) for s in STAGES}
            rays = runs[0]["primary_rays"] + runs[0]["shadow_rays"] + runs[0]["secondary_rays"]
            rate = rays / 1e3 / max(median["primary"] + median["trace"], 1e-9)
            print(f"{title:24} {first['import_ns'] / 1e6:7.0f} {first['upload_ns'] / 1e6:7.1f} " +
                  " ".join(f"{median[s]:8.1f}" for s in STAGES[1:]) + f" {rate:7.2f} {again['uploaded_bytes']:10d}",
                  flush=True)
        finally:
            daemon.close()


def start_table():
    print("\n## Starting: seconds, median of 9, help texts\n")
    for name, arguments in (("farlight --help", [FARLIGHT, "--help"]), ("farlightd --help", [BUILD / "farlightd", "--help"]),
                            ("farlight-import --help", [BUILD / "farlight-import", "--help"]),
                            ("farlight-export --help", [BUILD / "farlight-export", "--help"])):
        print(f"{name:28} {statistics.median(timed(*arguments) for _ in range(9)):8.4f}")
    daemon = Daemon()
    try:
        stats = statistics.median(timed(FARLIGHT, "stats", "--server", daemon.address) for _ in range(9))
    finally:
        daemon.close()
    importer = statistics.median(timed(BUILD / "farlight-import", "--help") for _ in range(9))
    print(f"{'farlight stats':28} {stats:8.4f}   {stats / importer:.3f} of farlight-import --help (wanted: at most 0.1)")


def animation_table(folder):
    print("\n## An animation over the socket: teapot, 24 frames, 480x270, one sample\n")
    daemon = Daemon()
    try:
        arguments = [FARLIGHT, "animate", folder / "teapot.glb", "--environment", folder / "sky.hdr", "--frames", "1-24",
                     "--size", "480x270", "--orbit", "--server", daemon.address, "--timings=json", "--quiet", "-o",
                     f"{daemon.folder}/%04d.jpg"]
        records(*arguments)  # warm-up
        frames, client = records(*arguments)
    finally:
        daemon.close()
    wall_ms = client["wait_ns"] / 1e6
    per_stage = {s: sum(stage_ms(f, s) for f in frames) for s in STAGES}
    render_ms = sum(per_stage[s] for s in STAGES[:8])
    slowest = max(render_ms, per_stage["encode"], per_stage["send"])
    busy = max(wall_ms, client["total_ns"] / 1e6 - client["start_ns"] / 1e6 - client["load_ns"] / 1e6)
    print(f"frames per second          {1000 * len(frames) / busy:8.2f}")
    print(f"render, encode, send, ms   {render_ms / len(frames):8.2f} {per_stage['encode'] / len(frames):8.2f} "
          f"{per_stage['send'] / len(frames):8.2f}   a frame")
    print(f"share of the time that is not the slowest stage: {max(0.0, 1 - slowest / busy):.3f}")


def glb_triangles(path):
    """Offsets of positions and indices in a GLB of one float mesh: what the yardstick reads."""
    data = path.read_bytes()
    json_bytes = struct.unpack_from("<I", data, 12)[0]
    gltf = json.loads(data[20:20 + json_bytes])
    base = 20 + json_bytes + 8
    primitive = gltf["meshes"][0]["primitives"][0]

    def place(accessor):
        view = gltf["bufferViews"][accessor["bufferView"]]
        return base + view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    positions = gltf["accessors"][primitive["attributes"]["POSITION"]]
    indices = gltf["accessors"][primitive["indices"]]
    return place(positions), positions["count"], place(indices), indices["count"] // 3


def one_shot_table():
    model = SHARED / "common/dragon-871k.glb"
    if not model.is_file():
        print("\nleft out: dragon-871k.glb is not below FARLIGHT_SCENES")
        return
    print("\n## One command, private daemon: dragon-871k.glb to a 1280x720 PNG; milliseconds\n")
    embree = BUILD / "tests/bench/embree_build"
    yardstick = json.loads(command(embree, model, *glb_triangles(model)))
    best = sum(yardstick.values()) / 1e6
    folder = tempfile.mkdtemp(prefix="farlight-bench-")
    runs = []
    for run in range(RUNS + 1):
        begin = time.monotonic()
        frames, client = records(FARLIGHT, "render", model, "-o", f"{folder}/x.png", "--size", "1280x720", "--timings=json")
        wall_ms = 1000 * (time.monotonic() - begin)
        if run:
            runs.append((wall_ms, frames[0], client))
    shutil.rmtree(folder)
    runs.sort(key=lambda r: r[0])
    wall_ms, frame, client = runs[len(runs) // 2]
    rows = [("whole command", wall_ms), ("start of the daemon", client["start_ns"] / 1e6), ("load", client["load_ns"] / 1e6),
            ("  importer's own work", client["import_ns"] / 1e6), ("  upload over the socket", client["upload_ns"] / 1e6),
            ("  commit", client["commit_ns"] / 1e6)]
    rows += [(f"frame: {stage}", stage_ms(frame, stage)) for stage in STAGES] + [("export", client["export_ns"] / 1e6)]
    for name, value in rows:
        print(f"{name:28} {value:9.1f}")
    import_upload_build = client["load_ns"] / 1e6 + stage_ms(frame, "upload") + stage_ms(frame, "build")
    print(f"\n{'read + hash + Embree build':28} {best:9.1f}   (" +
          ", ".join(f"{key[:-3]} {value / 1e6:.1f}" for key, value in yardstick.items()) + ")")
    print(f"{'import + upload + build':28} {import_upload_build:9.1f}   {import_upload_build / best:.2f} of it "
          "(wanted: under 5)")


def main():
    folder = pathlib.Path(tempfile.mkdtemp(prefix="farlight-bench-"))
    try:
        command(BUILD / "tests/tools/make_scenes", folder, "150")
        start_table()
        one_shot_table()
        scene_table(folder)
        animation_table(folder)
        print("\n## bvh against its plain form\n", flush=True)
        subprocess.run([BUILD / "tests/bench/bench_bvh"], check=True)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
