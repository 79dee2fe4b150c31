# SPDX-License-Identifier: MIT
"""The part of the benchmark that measures whole frames of distributed ray tracing: `bench distributed` on the paper's kind of
scene. Its JSON is `scene` (primitives, width, height) and `forms`: name, samples, primary_rays, shadow_rays, secondary_rays,
frame_ns and stages_ns, times of each run. The forms take turns, so ratios are paired run by run.
"""
import json

from bench_common import command, figure, paired_ratio, table, with_spread

RATIO_MAX = 8
PAPER_RATIO = 13.7
PLAIN = "whitted, 1 sample"
WHOLE = "and motion"  # lens, soft light, gloss and motion


def measure_distributed(bench):
    size = ["--size", "64x48"] if bench.tiny else []
    return json.loads(command(*bench.form("distributed"), "--runs", bench.times(5), *size))


def form_of(data, name):
    return next(form for form in data["forms"] if form["name"] == name)


def times_of_plain(data, form):
    return paired_ratio(form["frame_ns"], form_of(data, PLAIN)["frame_ns"])


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


def distributed_row(data):
    """(line, wanted, measured, where) for the table of what is wanted."""
    return ("16 distributed samples with lens, soft light, gloss and motion / one plain", RATIO_MAX,
            times_of_plain(data, form_of(data, WHOLE)), f"{data['scene']['primitives']} primitives; the paper {PAPER_RATIO}")
