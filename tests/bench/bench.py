#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`make bench`: where the time goes, in tables and as JSON. Usage: bench.py BUILD_FOLDER [PART ..] [--out FOLDER]

Parts: start, first_picture, oneshot, frames, animation, tracers, family, pixels, rays, link, view; and of the tracers' papers
flake, distributed, ldc, abuffer, rayspace, quadtree; all of them where none is named. Each figure is the median of
several runs after a warm-up, with the median absolute deviation beside it; what is compared takes turns, run by run. Scenes of
FARLIGHT_SCENES (default: ../shared/scenes beside the checkout) are left out, and named, where missing.

Writes FOLDER/bench.txt and FOLDER/bench.json (FOLDER: out); a run that writes into out, other than with --tiny, also brings
the sections of its parts in tests/bench/README.md up to date. Parts that an earlier run on the same device and commit left
there stay. The JSON: {"format": 1, "environment": {date, commit, processor, processors, device, vendor, version, software},
"parts": {NAME: {..}}}. Figures are objects of median, deviation, min, max and runs; keys end with their unit. tracers, family,
pixels and rays have `results`, one for each call of bench_tracers: title, triangles, spheres, instances, width, height,
rays_per_pixel, `structures` (tracer, build, memory_bytes) and `waves` (kind, order, any, rays, `measures`: tracer, way, time,
rays_per_s, agreement). The others are described in the heads of bench_first_picture.py, bench_link.py, bench_view.py,
bench_bvh.py, bench_sampled.py, bench_rayspace.py and bench_quadtree.py. `wanted` has the lines that are to be reached: line,
wanted, measured, met, within_spread (missed by no more than twice its deviation), where.

Exit status 1 if something failed, or a tracer gave wrong answers; a line that was missed is no failure.
"""
import argparse
import json
import pathlib
import shutil
import signal
import sys
import tempfile
import time

import bench_bvh
import bench_client
import bench_first_picture
import bench_link
import bench_quadtree
import bench_rays
import bench_rayspace
import bench_readme
import bench_sampled
import bench_view
import bench_wanted
from bench_common import Bench, Failure, command, environment, say

# name: (title, measure, show)
PARTS = {
    "start": ("Starting", bench_client.measure_start, bench_client.show_start),
    "first_picture": ("Time to the first picture", bench_first_picture.measure, bench_first_picture.show),
    "oneshot": ("One command with a daemon of its own", bench_client.measure_oneshot, bench_client.show_oneshot),
    "frames": ("Frames", bench_client.measure_frames, bench_client.show_frames),
    "animation": ("An animation", bench_client.measure_animation, bench_client.show_animation),
    "tracers": ("Tracers, scene by scene", bench_rays.measure_tracers, bench_rays.show_tracers),
    "family": ("Time against triangles", bench_rays.measure_family, bench_rays.show_family),
    "pixels": ("Time against pixels", bench_rays.measure_pixels, bench_rays.show_pixels),
    "rays": ("Time against rays per pixel", bench_rays.measure_rays, bench_rays.show_rays),
    "link": ("A sealed connection beside an open one", bench_link.measure, bench_link.show),
    "view": ("Views whose camera moves", bench_view.measure, bench_view.show),
    "flake": ("Time against spheres", bench_bvh.measure_flake, bench_bvh.show_flake),
    "distributed": ("Distributed ray tracing, whole frames", bench_bvh.measure_distributed, bench_bvh.show_distributed),
    "ldc": ("Layered depth cubes", bench_sampled.measure_ldc, bench_sampled.show_ldc),
    "abuffer": ("Voxels and A-buffers", bench_sampled.measure_abuffer, bench_sampled.show_abuffer),
    "rayspace": ("A hierarchy over the rays", bench_rayspace.measure, bench_rayspace.show),
    "quadtree": ("Quadtrees over what a view sees", bench_quadtree.measure, bench_quadtree.show),
}
WANTED_TITLE = "What is wanted"
OUT = pathlib.Path("out")
SAME = ("commit", "device", "version", "processor", "processors")


def load(path):
    try:
        document = json.loads(path.read_text())
        return document if document.get("format") == 1 else None
    except (OSError, ValueError):
        return None


def section(title, text):
    return f"## {title}\n\n{text}\n"


def part_text(name, data):
    text = PARTS[name][2](data)
    if data.get("left_out"):
        text += "\n\nleft out, as they are not below FARLIGHT_SCENES: " + ", ".join(data["left_out"])
    return text


def part_section(name, data):
    return section(PARTS[name][0], part_text(name, data))


def show_environment(facts):
    where = "software GL" if facts["software"] else "GPU"
    return (f"farlight {facts['commit']}, {facts['date']}\n{facts['device']} ({where}), {facts['version']}\n"
            f"{facts['processor']}, {facts['processors']} processors\n")


def render(document):
    sections = [show_environment(document["environment"])]
    sections += [part_section(name, document["parts"][name]) for name in PARTS if name in document["parts"]]
    if "wanted" in document["parts"]:
        sections.append(section(WANTED_TITLE, bench_wanted.show(document["parts"]["wanted"]["rows"])))
    return "\n".join(sections)


def write(document, out):
    wanted = bench_wanted.derive(document["parts"])
    if wanted:
        document["parts"]["wanted"] = wanted
    out.mkdir(parents=True, exist_ok=True)
    (out / "bench.json").write_text(json.dumps(document, indent=1) + "\n")
    (out / "bench.txt").write_text(render(document))


def write_readme(document):
    """What bench.json has, in the README beside this file."""
    parts = [(name, PARTS[name][0], part_text(name, document["parts"][name])) for name in PARTS if name in document["parts"]]
    if "wanted" in document["parts"]:
        parts.append(("wanted", WANTED_TITLE, bench_wanted.show(document["parts"]["wanted"]["rows"])))
    bench_readme.write(document["environment"], parts)


def measure(bench, names, document, out):
    """Part by part; what is done is written at once, so that an interrupted run has left something."""
    for number, name in enumerate(names, 1):
        title, run_part, _ = PARTS[name]
        say(f"[{number}/{len(names)}] {name}: {title[0].lower()}{title[1:]}")
        begin = time.monotonic()
        try:
            document["parts"][name] = run_part(bench)
        except Failure as failure:
            bench.faults.append(f"{name}: {failure}")
            say(f"bench: {failure}")
            continue
        say(f"    {time.monotonic() - begin:.0f} s")
        write(document, out)
        print(part_section(name, document["parts"][name]), flush=True)


def run(bench, names, out):
    """Measures, writes, prints. Returns what went wrong, as texts."""
    folder = pathlib.Path(tempfile.mkdtemp(prefix="farlight-bench-"))
    try:
        command(bench.program("tests/tools/make_scenes"), folder, *([] if bench.tiny else ["150"]))
        bench.scenes = folder
        facts = environment(bench)
        before = load(out / "bench.json")
        keep = before and all(before["environment"].get(key) == facts[key] for key in SAME)
        document = {"format": 1, "environment": facts, "parts": before["parts"] if keep else {}}
        print(show_environment(facts), flush=True)
        measure(bench, names, document, out)
        if "wanted" in document["parts"]:
            print(section(WANTED_TITLE, bench_wanted.show(document["parts"]["wanted"]["rows"])))
    except Failure as failure:
        bench.faults.append(str(failure))
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return bench.faults


def main():
    parser = argparse.ArgumentParser(description="Measures farlight; see the head of this file.")
    parser.add_argument("build", help="folder with the programs, build/release")
    parser.add_argument("parts", nargs="*", metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--out", type=pathlib.Path, default=OUT, help="where the tables go (out)")
    parser.add_argument("--runs", type=int, help="how many runs a figure has (3 to 9)")
    parser.add_argument("--link-seconds", type=int, default=60, help="how long the part view looks over a slow link (60)")
    parser.add_argument("--tiny", action="store_true", help="the smallest scenes only: shows that it works, measures nothing")
    arguments = parser.parse_args()
    unknown = [name for name in arguments.parts if name not in PARTS]
    if unknown:
        parser.error(f"no part is called {', '.join(unknown)}; there are {', '.join(PARTS)}")
    if arguments.runs is not None and not 1 <= arguments.runs <= 64:
        parser.error("between 1 and 64 runs")
    if not 2 <= arguments.link_seconds <= 3600:
        parser.error("between 2 and 3600 seconds")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))  # what was started is ended on the way out
    bench = Bench(arguments.build, arguments.runs, arguments.tiny, arguments.link_seconds)
    faults = run(bench, arguments.parts or list(PARTS), arguments.out)
    document = load(arguments.out / "bench.json")
    if document and not arguments.tiny and arguments.out == OUT:
        write_readme(document)
    for fault in faults:
        print(f"bench: {fault}", file=sys.stderr)
    print(f"{arguments.out / 'bench.txt'}\n{arguments.out / 'bench.json'}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
