# SPDX-License-Identifier: MIT
"""The parts of the benchmark that measure what a user waits for: programs, one command, frames, an animation."""
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import time

from bench_common import KITCHEN_VIEW, Failure, bundled, command, figure, say, shared, significant, table, with_spread

STAGES = ("apply", "build", "upload", "primary", "trace", "shade", "resolve", "readback", "encode", "queue", "send")


def records(*arguments):
    lines = [json.loads(line) for line in command(*arguments).splitlines()]
    return [r for r in lines if r["kind"] == "frame"], next(r for r in lines if r["kind"] == "client")


def stage_ms(frame, stage, clock="cpu"):
    return sum(s["duration_ns"] for s in frame["stages"] if s["stage"] == stage and s["clock"] == clock) / 1e6


class Daemon:
    """A warm daemon on a socket of its own and, if wanted, on a TCP port of this host; a context manager. `yields`: it stands
    for one of another machine, and takes of this one's processors what the programs beside it leave."""

    def __init__(self, bench, tcp=False, yields=False):
        self.folder = tempfile.mkdtemp(prefix="farlight-bench-")
        self.address = f"unix:{self.folder}/socket"
        self.tcp = "tcp:127.0.0.1:0" if tcp else None
        self.process = subprocess.Popen([*(["nice", "-n", "19"] if yields else []), bench.program("farlightd"), "--listen",
                                         self.address, *(["--listen", self.tcp] if tcp else [])], stdout=subprocess.PIPE,
                                        stderr=subprocess.DEVNULL, text=True)

    def __enter__(self):
        try:
            self.wait_until_ready()
        except BaseException:  # nobody calls __exit__() then
            self.__exit__()
            raise
        return self

    def wait_until_ready(self):
        for line in self.process.stdout:  # READY and an address, one line each
            if self.tcp and not line.startswith("READY tcp:"):
                continue
            if line.startswith("READY"):
                self.tcp = line.split()[-1] if self.tcp else None
                return
        raise Failure("the daemon did not start")

    def workers(self):
        """Numbers of the processes that serve its users; one waits for the first client."""
        children = pathlib.Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text()
        return [int(child) for child in children.split()]

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()
        self.process.stdout.close()
        shutil.rmtree(self.folder, ignore_errors=True)


# ---- start ------------------------------------------------------------------------------------------


def timed(bench, *arguments):
    """Seconds; the first run is a warm-up."""
    seconds = []
    for _ in range(1 + bench.times(9)):
        begin = time.monotonic()
        command(*arguments)
        seconds.append(time.monotonic() - begin)
    return figure(seconds[1:])


def first_picture(bench):
    """A small picture by a private daemon: with neither programs of ours nor of Mesa's on the disk, and once more with both."""
    cold, warm = [], []
    for _ in range(bench.times(5)):
        with tempfile.TemporaryDirectory(prefix="farlight-bench-") as folder:
            environment = os.environ | {"XDG_CACHE_HOME": folder, "MESA_SHADER_CACHE_DIR": folder}
            for seconds in (cold, warm):
                begin = time.monotonic()
                subprocess.run([bench.program("farlight"), "render", bundled(bench, "teapot.glb"), "-o", f"{folder}/x.png",
                                "--size", "640x360", "--samples", "1"], env=environment, check=True, capture_output=True)
                seconds.append(time.monotonic() - begin)
    return [{"command": "first picture, cold caches", "seconds": figure(cold)},
            {"command": "first picture, warm caches", "seconds": figure(warm)}]


def measure_start(bench):
    names = ("farlight", "farlightd", "farlight-import", "farlight-export")
    rows = [{"command": f"{name} --help", "seconds": timed(bench, bench.program(name), "--help")} for name in names]
    with Daemon(bench) as daemon:
        rows.append({"command": "farlight stats",
                     "seconds": timed(bench, bench.program("farlight"), "stats", "--server", daemon.address)})
    return {"rows": rows + first_picture(bench)}


def show_start(data):
    rows = [(row["command"], with_spread(row["seconds"])) for row in data["rows"]]
    return table([("starting", "seconds")], rows)


# ---- one command ------------------------------------------------------------------------------------


def measure_oneshot(bench):
    left_out = []
    models = list(shared(bench, [("dragon 871K", "common/dragon-871k.glb", [])], left_out))
    if not models:
        return {"left_out": left_out}
    model = models[0][1]
    runs = []
    with tempfile.TemporaryDirectory(prefix="farlight-bench-") as folder:
        for _ in range(1 + bench.times(3)):
            begin = time.monotonic()
            frames, client = records(bench.program("farlight"), "render", model, "-o", f"{folder}/x.png", "--size",
                                     "1280x720", "--samples", "1", "--timings=json")
            runs.append((1000 * (time.monotonic() - begin), frames[0], client))
    runs = sorted(runs[1:], key=lambda run: run[0])
    wall_ms, frame, client = runs[len(runs) // 2]
    rows = {"whole command": wall_ms}
    for name, key in (("start of the daemon", "start_ns"), ("load", "load_ns"), ("  importer's own work", "import_ns"),
                      ("  upload over the socket", "upload_ns"), ("  commit", "commit_ns")):
        rows[name] = client[key] / 1e6
    rows.update({f"frame: {stage}": stage_ms(frame, stage) for stage in STAGES})
    rows["export"] = client["export_ns"] / 1e6
    return {"left_out": left_out, "wall_ms": figure([run[0] for run in runs]), "rows_ms": rows}


def show_oneshot(data):
    if "rows_ms" not in data:
        return "nothing to measure it with"
    rows = [(name, f"{value:.1f}") for name, value in data["rows_ms"].items()]
    return (table([("dragon-871k.glb to a 1280x720 PNG, the median run", "ms")], rows) +
            f"\n\nthe whole command {with_spread(data['wall_ms'])} ms")


# ---- frames -----------------------------------------------------------------------------------------


def frame_models(bench, left_out):
    sky = ["--environment", bundled(bench, "sky.hdr")]
    yield "teapot (bundled)", bundled(bench, "teapot.glb"), sky
    if bench.tiny:
        return
    yield "cornell (bundled)", bundled(bench, "cornell.glb"), []
    yield "sphereflake-4 (bundled)", bundled(bench, "sphereflake-4.nff"), []
    yield "bumpy 150K (bundled)", bundled(bench, "bumpy-150.glb"), sky
    yield from shared(bench, [
        ("dragon 47K", "common/dragon-47k.glb", sky), ("bunny 69K", "common/bunny-69k.obj", sky),
        ("kitchen 86K", "rayspace/kitchen.obj", sky + KITCHEN_VIEW), ("helmet, textured", "gltf/DamagedHelmet.glb", sky),
        ("balls, 7,381 spheres", "bvh/spd-balls-4.nff", []), ("gears 37K", "bvh/spd-gears.nff", []),
        ("dragon 871K", "common/dragon-871k.glb", sky)], left_out)


def measure_frames(bench):
    left_out, rows = [], []
    for title, model, options in frame_models(bench, left_out):
        say(f"  {title}")
        frames = []
        with Daemon(bench) as daemon:
            for run in range(1 + bench.times(3)):
                got, client = records(bench.program("farlight"), "render", model, "-o", f"{daemon.folder}/x.png", "--size",
                                      "64x64" if bench.tiny else "640x480", "--samples", "1", "--depth", "4",
                                      "--server", daemon.address, "--timings=json", *options)
                if run == 0:
                    first = client
                else:
                    frames.append(got[0])
        stages = {stage: figure([stage_ms(frame, stage) for frame in frames]) for stage in STAGES}
        rays = sum(frames[0][key] for key in ("primary_rays", "shadow_rays", "secondary_rays"))
        rows.append({"scene": title, "import_ms": first["import_ns"] / 1e6, "upload_ms": first["upload_ns"] / 1e6,
                     "stages_ms": stages, "rays": rays, "again_bytes": client["uploaded_bytes"],
                     "rays_per_s": 1e3 * rays / max(stages["primary"]["median"] + stages["trace"]["median"], 1e-9)})
    return {"rows": rows, "left_out": left_out}


def show_frames(data):
    header = [("scene", "import", "upload", *STAGES[1:], "Mray/s", "2nd bulk B")]
    rows = [(row["scene"], significant(row["import_ms"]), significant(row["upload_ms"]),
             *(f"{row['stages_ms'][stage]['median']:.1f}" for stage in STAGES[1:]), significant(row["rays_per_s"] / 1e6),
             row["again_bytes"]) for row in data["rows"]]
    return "milliseconds; 640x480, one sample, depth 4, a warm daemon\n\n" + table(header, rows)


# ---- an animation -----------------------------------------------------------------------------------


def measure_animation(bench):
    with Daemon(bench) as daemon:
        arguments = [bench.program("farlight"), "animate", bundled(bench, "teapot.glb"), "--environment",
                     bundled(bench, "sky.hdr"), "--frames", "1-24", "--size", "480x270", "--orbit", "--server",
                     daemon.address, "--timings=json", "--quiet", "-o", f"{daemon.folder}/%04d.jpg"]
        rounds = [records(*arguments) for _ in range(1 + bench.times(3))][1:]
    results = []
    for frames, client in rounds:
        per_stage = {stage: sum(stage_ms(frame, stage) for frame in frames) for stage in STAGES}
        render_ms = sum(per_stage[stage] for stage in STAGES[:8])
        busy_ms = max(client["wait_ns"] / 1e6, (client["total_ns"] - client["start_ns"] - client["load_ns"]) / 1e6)
        slowest_ms = max(render_ms, per_stage["encode"], per_stage["send"])
        results.append({"frames_per_s": 1000 * len(frames) / busy_ms, "render_ms": render_ms / len(frames),
                        "encode_ms": per_stage["encode"] / len(frames), "send_ms": per_stage["send"] / len(frames),
                        "not_slowest_share": max(0.0, 1 - slowest_ms / busy_ms)})
    return {key: figure([result[key] for result in results]) for key in results[0]}


def show_animation(data):
    names = (("frames a second", "frames_per_s"), ("render, ms a frame", "render_ms"), ("encode, ms a frame", "encode_ms"),
             ("send, ms a frame", "send_ms"), ("share of the time that is not the slowest stage", "not_slowest_share"))
    return table([("teapot, 24 frames, 480x270, one sample, over the socket", "")],
                 [(name, with_spread(data[key])) for name, key in names])
