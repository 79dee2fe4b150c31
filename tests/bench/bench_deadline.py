# SPDX-License-Identifier: MIT
"""The part `deadline` of the benchmark: views that are heavy to render, as they come and with a rate to keep while they move. Its
JSON:

  views      scene, wanted (frames a second, null: none is asked for), frames, and of the second half of the time: frames_per_s,
             render_ms and processor_ms a frame (of all the daemon's threads, of all the time), and what the frame in the
             middle is: width, height, samples, depth
  wanted     rows as in bench_reach.py

What others do on the machine meanwhile is in the rates and in what is chosen, and only a little in processor_ms.
"""
import json

from bench_client import Daemon
from bench_common import bundled, command, figure, significant, say, table, with_spread
from bench_reach import row
from bench_view import frames_of

RATE = 15
DEPTH = 8
SIZE = "1280x720"


def scenes(bench):
    yield "carousel, distributed", [bundled(bench, "carousel.glb"), "--clip", 0, "--integrator", "distributed"]
    if bench.tiny:
        return
    yield "cornell, path", [bundled(bench, "cornell.glb"), "--integrator", "path"]
    yield "teapot, distributed", [bundled(bench, "teapot.glb"), "--environment", bundled(bench, "sky.hdr"), "--integrator",
                                  "distributed"]


def watch(bench, daemon, model, wanted):
    """One run: what stands in `views`, with numbers in place of figures."""
    options = ["--size", "64x36", "--seconds", 1] if bench.tiny else ["--size", SIZE, "--seconds", 12]
    told = json.loads(command(*bench.form("view"), daemon.address, *model, "--pid", daemon.process.pid, "--depth", DEPTH,
                              "--encoding", "raw", *options, *(["--moving-rate", wanted] if wanted else [])))
    frames = frames_of(told)
    half = (frames[0]["whole"] + frames[-1]["whole"]) / 2
    later = [frame for frame in frames if frame["whole"] >= half]
    later = later if len(later) > 1 else frames[-2:]
    middle = later[len(later) // 2]
    return {"frames": len(frames), "frames_per_s": (len(later) - 1) * 1e9 / (later[-1]["whole"] - later[0]["whole"]),
            "render_ms": sum(frame["rendered"] - frame["applied"] for frame in later) / len(later) / 1e6,
            "processor_ms": sum(told["threads_ns"].values()) / len(frames) / 1e6,
            **{key: middle[key] for key in ("width", "height", "samples")}, "depth": DEPTH - middle["depth_less"]}


def measure_view(bench, daemon, scene, model, wanted):
    say(f"  {scene}, {f'{wanted} a second' if wanted else 'as it comes'}")
    runs = [watch(bench, daemon, model, wanted) for _ in range(bench.times(3))]
    figures = {key: figure([run[key] for run in runs]) for key in ("frames_per_s", "render_ms", "processor_ms")}
    return {"scene": scene, "wanted": wanted, **sorted(runs, key=lambda run: run["width"])[len(runs) // 2], **figures}


def measure(bench):
    with Daemon(bench) as daemon:
        views = [measure_view(bench, daemon, scene, model, wanted) for scene, model in scenes(bench) for wanted in (None, RATE)]
    wanted = [row(f"{view['scene']}: frames a second while it moves", RATE, view["frames_per_s"],
                  f"{view['width']}x{view['height']}, {view['depth']} bounces of {DEPTH}") for view in views if view["wanted"]]
    return {"views": views, "wanted": wanted}


def show(data):
    rows = [(view["scene"], view["wanted"] or "-", with_spread(view["frames_per_s"]),
             *(significant(view[key]["median"]) for key in ("render_ms", "processor_ms")), f"{view['width']}x{view['height']}",
             view["samples"], view["depth"]) for view in data["views"]]
    return table([(SIZE, "asked", "frames/s", "render", "processors", "size", "samples", "bounces"),
                  ("", "a second", "", "ms", "ms a frame", "", "", "")], rows)
