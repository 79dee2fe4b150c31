# SPDX-License-Identifier: MIT
"""Whole pictures by a warm daemon: what the papers' tables are made of. A result is

  {"title", "here", "forms": [{"name", "ms", "structure", "rays"}]}

`here` is the file. `ms` has figures of build, nodes (of quadtrees, a part of build), trace, frame and rest (all but build), a
picture each; `rays` counts primary, secondary and shadow rays. Forms take turns, run by run, after a warm-up; each command
brings a scene of its own, so that structures are built anew. Clocks of the wall: other work on the machine is in them.
"""
from bench_client import Daemon, records, stage_ms
from bench_common import figure, paired_ratio, say, shared, significant, with_spread

MIRRORS = ["--edit", "material.*.transmission=0", "--edit", "material.*.metallic=1", "--edit", "material.*.roughness=0"]
GLASS = ["--edit", "material.*.metallic=0", "--edit", "material.*.transmission=1", "--edit", "material.*.roughness=0"]


def size(bench, pixels):
    return ["--size", "64x48" if bench.tiny else pixels]


def models(bench, rows, left_out, instead="teapot.glb"):
    """Models as (title, file, options), of rows that name a file below FARLIGHT_SCENES; a bundled one where none is there."""
    found = [] if bench.tiny else list(shared(bench, rows, left_out))
    return found or [("teapot", bench.scenes / instead, [])]


def times_of(frames):
    """Milliseconds of a picture: the mean of the pictures that a command made."""
    def mean(value):
        return sum(map(value, frames)) / len(frames)
    build, whole = (mean(lambda frame, stage=stage: stage_ms(frame, stage)) for stage in ("build", "frame"))
    nodes = mean(lambda frame: sum(s["duration_ns"] for s in frame["stages"]
                                   if (s["stage"], s["wave"], s["clock"]) == ("build", 1, "cpu")) / 1e6)
    return {"build": build, "nodes": nodes, "trace": mean(lambda frame: stage_ms(frame, "trace")), "frame": whole,
            "rest": whole - build}


def pictures(bench, title, model, forms, options, runs=3, command=("render",)):
    """Renders `model` with the arguments of each of `forms`, a dictionary by name."""
    say(f"  {title}: {', '.join(forms)}")
    taken, last = {name: [] for name in forms}, {}
    with Daemon(bench) as daemon:
        where = f"{daemon.folder}/%04d.jpg" if command[0] == "animate" else f"{daemon.folder}/x.png"
        for run in range(1 + bench.times(runs)):
            for name, arguments in forms.items():
                frames, _ = records(bench.program("farlight"), *command, model, *options, *arguments, "--server", daemon.address,
                                    "--timings=json", "--quiet", "-o", where)
                last[name] = frames[-1]
                if run > 0:
                    taken[name].append(times_of(frames))
    return {"title": title, "here": model.name, "forms": [
        {"name": name, "ms": {key: figure([one[key] for one in taken[name]]) for key in taken[name][0]},
         "runs_ms": [one["frame"] for one in taken[name]], "structure": last[name].get("structure", {}),
         "rays": {kind: last[name][f"{kind}_rays"] for kind in ("primary", "secondary", "shadow")}} for name in forms]}


def form_of(result, name):
    return next(form for form in result["forms"] if form["name"] == name)


def ratio(result, name, other):
    """How many times as long the first form's pictures take."""
    return paired_ratio(form_of(result, name)["runs_ms"], form_of(result, other)["runs_ms"])


def ms(form, *keys):
    """Cells of a table."""
    return [with_spread(form["ms"][key]) for key in keys]


def median_ratio(form, other, key):
    return form["ms"][key]["median"] / max(other["ms"][key]["median"], 1e-9)


def told(form, name):
    """One fact of the structure as a cell; '-' where it has none."""
    return significant(form["structure"].get(name))
