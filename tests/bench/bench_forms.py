# SPDX-License-Identifier: MIT
"""What the parts of the benchmark share that call `bench forms`: models, calls, and how results are read."""
from bench_animated import run_json
from bench_common import figure, paired_ratio, shared


def call(bench, part, title, usual_runs, *arguments):
    """What `bench forms` prints, with a title."""
    return {"title": title, **run_json(bench, "forms", part, *arguments, "--runs", bench.times(usual_runs))}


def wave_size(bench):
    return "64x64" if bench.tiny else "512x512"


def models(bench, names, left_out):
    """(title, arguments) of (title, file, options ..) that are there; something bundled where nothing is."""
    if bench.tiny:
        yield "teapot (bundled)", ["--model", bench.scenes / "teapot.glb"]
        return
    found = list(shared(bench, [(title, name, options) for title, name, *options in names], left_out))
    for title, path, options in found:
        yield title, ["--model", path, *options]
    if not found:
        yield "teapot (bundled)", ["--model", bench.scenes / "teapot.glb"]


# ---- reading ----------------------------------------------------------------------------------------


def form_of(result, resolution):
    """Of a cube the form of that many cells, else by name; None: there is none."""
    names = [form["name"] for form in result["forms"]]
    name = resolution if isinstance(resolution, str) else f"ldc:resolution={resolution}"
    return result["forms"][names.index(name)] if name in names else None


def wave_of(form, kind):
    return next(wave for wave in form["waves"] if wave["kind"] == kind)


def ratio(form, other, kind, key="hits_ns"):
    """How many times as long the form takes."""
    return paired_ratio(wave_of(form, kind)[key], wave_of(other, kind)[key])


def milliseconds(runs_ns):
    return figure([ns / 1e6 for ns in runs_ns])


def once(value):
    return {"median": value, "deviation": 0, "min": value, "max": value, "runs": 1}
