# SPDX-License-Identifier: MIT
"""The parts that hold `bvh` against its paper ('Stackless traversal of a sphere BVH'):

  flake        results of bench_pictures.py over the sphereflake (figure 6)
  distributed  what `bench distributed` prints: 16 distributed samples beside a plain one (section 7)
"""
import json
import pathlib

from bench_common import command, figure, fit_exponent, paired_ratio, table, with_spread
from bench_pictures import pictures, size
from bench_wanted import row

FLAKES = {2: 91, 3: 820, 4: 7381, 5: 66430, 6: 597871}
FLAKE_EXPONENT_MAX = 0.25
RATIO_MAX, PAPER_RATIO = 8, 13.7
PLAIN, WHOLE = "whitted, 1 sample", "and motion"  # lens, soft light, gloss and motion


# ---- the sphereflake --------------------------------------------------------------------------------


def measure_flake(bench):
    results = []
    for level, spheres in list(FLAKES.items())[:3 if bench.tiny else None]:
        if level > 4:
            command(bench.program("tests/tools/make_scenes"), bench.scenes, f"flake-{level}")
        database = bench.shared / f"bvh/spd-balls-{level}.nff"
        model = database if database.is_file() else pathlib.Path(bench.scenes) / f"sphereflake-{level}.nff"
        options = [*size(bench, "640x480"), "--samples", 1, "--depth", 4, "--integrator", "whitted", "--primary", "trace"]
        results.append({"spheres": spheres, **pictures(bench, f"{spheres} spheres", model, {"bvh": []}, options)})
    data = {"results": results}
    return {**data, "wanted": [row("bvh, exponent of a picture's time against spheres", FLAKE_EXPONENT_MAX,
                                   {"median": slope, "deviation": error}, f"sphereflake, {FLAKES[2]} to {results[-1]['spheres']}",
                                   at_most=True) for slope, error in [exponent(data, "rest")]]}


def exponent(data, key):
    return fit_exponent([(r["spheres"], r["forms"][0]["ms"][key]["median"]) for r in data["results"]])


def show_flake(data):
    rows = [(r["spheres"], *(with_spread(r["forms"][0]["ms"][key]) for key in ("build", "trace", "rest"))) for r in data["results"]]
    fits = [f"{name} grows as n^{slope:.3f} ± {error:.3f}" for name, (slope, error) in
            ((key, exponent(data, key)) for key in ("trace", "rest"))]
    return ("Figure 6 of the paper: 640x480, one sample, depth 4, three lights. 'Rest': the picture without the build.\n\n" +
            table([("spheres", "build", "trace", "rest"), ("", "ms", "ms", "ms")], rows) + "\n\n" + "\n".join(fits))


# ---- distributed frames -----------------------------------------------------------------------------


def measure_distributed(bench):
    small = ["--size", "64x48"] if bench.tiny else []
    data = json.loads(command(*bench.form("distributed"), "--runs", bench.times(5), *small))
    whole = times_of_plain(data, next(form for form in data["forms"] if form["name"] == WHOLE))
    return {**data, "wanted": [row("16 distributed samples with lens, soft light, gloss and motion / one plain", RATIO_MAX, whole,
                                   f"{data['scene']['primitives']} primitives; the paper {PAPER_RATIO}", at_most=True)]}


def times_of_plain(data, form):
    plain = next(form for form in data["forms"] if form["name"] == PLAIN)
    return paired_ratio(form["frame_ns"], plain["frame_ns"])


def show_distributed(data):
    scene = data["scene"]
    rows = []
    for form in data["forms"]:
        milliseconds = figure([ns / 1e6 for ns in form["frame_ns"]])
        stages = {stage: figure([ns / 1e6 for ns in runs])["median"] for stage, runs in form["stages_ns"].items()}
        rays = form["primary_rays"] + form["shadow_rays"] + form["secondary_rays"]
        rows.append((form["name"], with_spread(milliseconds), with_spread(times_of_plain(data, form)),
                     f"{rays / 1e6:.2f}", *(f"{stages.get(stage, 0):.0f}" for stage in ("primary", "trace", "shade"))))
    head = [("frame", "ms", "x plain", "Mrays", "primary", "trace", "shade"), ("", "", "", "", "ms", "ms", "ms")]
    return (f"{scene['primitives']} primitives, {scene['width']}x{scene['height']}, whole frames; 'and' adds to the form before. "
            f"The paper: {PAPER_RATIO} times for 16 samples.\n\n" + table(head, rows))
