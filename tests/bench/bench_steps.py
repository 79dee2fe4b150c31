# SPDX-License-Identifier: MIT
"""The part `steps` of the benchmark: how long one step of a frame takes, which is how long a cancel waits, with every
integrator and tracer; and how long a client waits for a cancel. Its JSON is `results`: what bench_steps prints (its head says
what), with "title" added; and `cancels`: title, tracer and ms, a figure, from the call to the daemon's answer.
"""
import json

from bench_client import Daemon
from bench_common import KITCHEN_VIEW, bundled, command, figure, shared, table

SERVED_MS = 50  # a cancel is to be served within so long
TRACERS = {"bvh": 0, "abuffer": 4}  # the protocol's numbers


def models(bench, left_out):
    if bench.tiny:
        return [("family 200", ["--family", "200", "--size", "64x64", "--tracers", "bvh", "--integrators", "path"])]
    named = shared(bench, [("dragon 202K", "common/dragon-202k.glb", []), ("kitchen 86K", "rayspace/kitchen.obj", KITCHEN_VIEW)],
                   left_out)
    return [("family 150K", ["--family", "150000"]), *((title, ["--model", path, *options]) for title, path, options in named)]


def measure(bench):
    left_out = []
    results = [{"title": title, **json.loads(command(*bench.form("steps"), *options))}
               for title, options in models(bench, left_out)]
    return {"results": results, "cancels": measure_cancels(bench), "left_out": left_out}


def measure_cancels(bench):
    dragon = bench.shared / "common/dragon-202k.glb"
    model = dragon if dragon.is_file() and not bench.tiny else bundled(bench, "teapot.glb")
    rows = []
    with Daemon(bench) as daemon:
        for tracer, number in list(TRACERS.items())[:1 if bench.tiny else None]:
            times = json.loads(command(*bench.form("cancel"), daemon.address, model, 1 if bench.tiny else 30,
                                       number))["cancels_ns"]
            rows.append({"title": model.stem, "tracer": tracer, "ms": figure([ns / 1e6 for ns in times])})
    return rows


def steps_row(result, form):
    stages = {stage["stage"]: stage for stage in form["stages"]}
    whole = stages.pop("all")
    longest = max(stages.values(), key=lambda stage: stage["max_ns"])
    return (f"{result['title']}, {form['tracer']}, {form['integrator']}", f"{form['frame_ns'] / 1e6:.0f}" + "+" * (not form["whole"]),
            whole["count"], *(f"{whole[key] / 1e6:.1f}" for key in ("median_ns", "p99_ns", "max_ns")), longest["stage"],
            f"{whole['cpu_max_ns'] / 1e6:.1f}", f"{form['first_begin_ns'] / 1e6:.0f}",
            f"{form['first_max_ns'] / 1e6:.0f}")


def show(data):
    head = [("steps of a frame", "frame", "steps", "median", "99 %", "longest", "which", "of all", "first", "longest"),
            ("", "ms", "", "ms", "ms", "ms", "", "cores, ms", "begin, ms", "of it, ms")]
    size = data["results"][0]
    cancels = [(f"{row['title']}, {row['tracer']}, path", row["ms"]["runs"], f"{row['ms']['median']:.1f}",
                f"{row['ms']['max']:.1f}") for row in data["cancels"]]
    return (f"{size['width']}x{size['height']}, {size['samples']} sample; +: left before its end. A cancel is to be served within "
            f"{SERVED_MS} ms.\nThe first frame builds the structure and compiles.\n\n" +
            table(head, [steps_row(result, form) for result in data["results"] for form in result["forms"]]) + "\n\n" +
            table([("a cancel over the socket, 1280x720", "cancels", "median", "longest"), ("", "", "ms", "ms")], cancels))
