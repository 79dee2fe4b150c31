# SPDX-License-Identifier: MIT
"""The parts of the benchmark about `bvh` in animated, distributed ray tracing: packets of rays, instances that
move, meshes that deform, and the sphereflake's scaling, next to what the paper has ('Stackless traversal of a sphere BVH').
"""
import json
import pathlib
import subprocess

from bench_client import Daemon, records, stage_ms
from bench_common import Failure, command, figure, fit_exponent, paired_ratio, say, significant, table, with_spread
from bench_rays import find_measure, find_wave, sweep

ORDERS = ("coherent", "partly", "incoherent")
PACKETS = (1, 2, 3, 4, 8)
# Frames a second on a GeForce 9800: one ray a pixel, then packets of two. Twice the rays a frame.
PAPER_SIZES = {"512x512": (51, {"coherent": 44, "partly": 26, "incoherent": 14}),
               "256x256": (72, {"coherent": 66, "partly": 54, "incoherent": 36})}
FLAKES = {2: 91, 3: 820, 4: 7381, 5: 66430, 6: 597871}
UPDATE_MAX, REFIT_MIN, FLAKE_EXPONENT_MAX = 0.02, 10, 0.25
FRAME_STAGES = ("primary", "trace", "shade", "resolve", "readback")


def run_json(bench, name, *arguments):
    """What a program prints; a wrong answer (status 1 with something printed) is noted as a fault."""
    full = list(map(str, (*bench.form(name), *arguments)))
    say("  " + " ".join([name, *map(str, arguments)]))
    result = subprocess.run(full, stdout=subprocess.PIPE, text=True, check=False)
    if not result.stdout:
        raise Failure(f"{' '.join(full)} ended with {result.returncode}")
    if result.returncode != 0:
        bench.faults.append(f"{name}: wrong answers")
    return json.loads(result.stdout)


def met(is_met):
    return "met" if is_met else "MISSED"


# ---- packets of rays ----------------------------------------------------------------------------------


def measure_parallel(bench):
    return {"results": [run_json(bench, "parallel", n, bench.times(5)) for n in ((1000,) if bench.tiny else (1800, 146000))]}


def beside_one(result, order, bounds):
    """{rays of a packet: rays a second over those of one ray at a time, a figure}"""
    runs = {row["packet"]: row["runs_ns"] for row in result["rows"] if (row["order"], row["bounds"]) == (order, bounds)}
    return {n: paired_ratio(runs[1], runs[n]) for n in PACKETS}


def show_parallel(data):
    rows, verdicts = [], []
    for result in data["results"]:
        for order in ORDERS:
            for bounds in ("boxes", "spheres"):
                found = [row for row in result["rows"] if (row["order"], row["bounds"]) == (order, bounds)]
                one = next(row for row in found if row["packet"] == 1)
                ratios = beside_one(result, order, bounds)
                rows.append((f"{result['triangles']} triangles", order, bounds, one["rays"],
                             significant(one["rays"] / figure(one["runs_ns"])["median"] * 1e3),
                             *(with_spread(ratios[n]) for n in PACKETS[1:]),
                             *(significant(2 * fps[order] / single) for single, fps in PAPER_SIZES.values())))
                best = max(PACKETS, key=lambda n, r=ratios: r[n]["median"])
                worst = min(PACKETS, key=lambda n, r=ratios: r[n]["median"])
                verdicts.append(f"{result['triangles']:7} triangles, {order:10} {bounds:8} "
                                f"{'wins with packets of ' + str(best) + ': ' + significant(ratios[best]['median']) if best > 1 else 'wins with none':36} "
                                f"{'loses most with ' + str(worst) + ': ' + significant(ratios[worst]['median']) if worst > 1 else 'never loses'}")
    header = [("scene", "rays", "bounds", "number", "1 ray", *(str(n) for n in PACKETS[1:]), *(["paper, 2"] * 2)),
              ("", "", "", "", "Mray/s", *(["x 1 ray"] * 4), *PAPER_SIZES)]
    return ("Coherent: 24 jittered camera rays a pixel; partly: their reflections; incoherent: diffuse bounces in random order.\n"
            "Of a packet, rays that go apart are traversed one after the other (bvh/packet.glsl), which the paper's are not.\n"
            "Paper: twice the frames a second with two rays of a pixel, over those with one: its 512x512 (51; 44, 26, 14) and\n"
            "256x256 (72; 66, 54, 36).\n\n" + table(header, rows) + "\n\n" + "\n".join(verdicts))


# ---- what changes -----------------------------------------------------------------------------------


def measure_instances(bench):
    return run_json(bench, "changes", "instances", *((20, 2) if bench.tiny else (1000, bench.times(15))))


def show_instances(data):
    share = data["update_ms"]["median"] / data["frame_ms"]["median"]
    rows = [(name, with_spread(data[f"{key}_ms"])) for name, key in (
        ("commit of one transaction", "apply"), ("upload of scene and top tree", "upload"), ("refit of the top tree", "build"),
        ("all of this", "update"), ("the whole frame", "frame"))]
    return (table([(f"{data['instances']} instances move each frame, {data['width']}x{data['height']}", "ms")], rows) +
            f"\n\n{data['uploaded_bytes']} bytes go to the device. The update takes {100 * share:.2f} % of the frame "
            f"(wanted: under {100 * UPDATE_MAX:.0f} %): {met(share < UPDATE_MAX)}")


def measure_refit(bench):
    return run_json(bench, "changes", "refit", *((2000, 2) if bench.tiny else (100000, bench.times(25))))


def show_refit(data):
    # The minimum of all runs: one that something else held up says nothing of either.
    ratio = data["rebuild_ms"]["min"] / data["refit_ms"]["min"]
    rows = [(name, with_spread(data[f"{key}_ms"]), significant(data[f"{key}_ms"]["min"])) for name, key in
            (("refit", "refit"), ("rebuild from the same vertices", "rebuild"))]
    return (table([(f"{data['triangles']} triangles, {data['elements']} elements", "ms", "min")], rows) +
            f"\n\nrebuild / refit {ratio:.1f} by the minima (wanted: at least {REFIT_MIN}): {met(ratio >= REFIT_MIN)}. "
            f"{data['rays']} rays through it: {significant(data['trace_refitted_ms'])} ms refitted, "
            f"{significant(data['trace_rebuilt_ms'])} ms rebuilt; {data['differing']} answers differ.")


# ---- the sphereflake --------------------------------------------------------------------------------


def flakes(bench, folder):
    """[(spheres, file)]: of the Standard Procedural Databases what is there, the rest generated."""
    levels = (2, 3, 4) if bench.tiny else tuple(FLAKES)
    command(bench.program("tests/tools/make_scenes"), folder, *(f"flake-{n}" for n in levels if n > 4))
    for n in levels:
        database = bench.shared / f"bvh/spd-balls-{n}.nff"
        yield FLAKES[n], database if database.is_file() else pathlib.Path(folder) / f"sphereflake-{n}.nff"


def measure_flake(bench):
    size = "64x64" if bench.tiny else "512x512"
    models = list(flakes(bench, bench.scenes))
    traversals = sweep(bench, [(f"sphereflake {n}", ["--model", model, "--size", size, "--waves", "primary,bounce"])
                               for n, model in models])
    frames = []
    for n, model in models:
        say(f"  frames of {n} spheres")
        with Daemon(bench) as daemon:
            got = [records(bench.program("farlight"), "render", model, "-o", f"{daemon.folder}/x.png", "--size",
                           "64x64" if bench.tiny else "640x480", "--samples", "1", "--depth", "4", "--server", daemon.address,
                           "--timings=json")[0][0]
                   for _ in range(1 + bench.times(3))][1:]
        frames.append({"spheres": n, "frame_ms": figure([sum(stage_ms(f, s) for s in FRAME_STAGES) for f in got])})
    return {**traversals, "frames": frames}


def flake_lines(data):
    """{name: [(spheres, ns a ray or ms a frame, a figure)]}"""
    lines = {}
    for kind in ("primary", "bounce"):
        points = []
        for result in data["results"]:
            wave = find_wave(result, kind)
            measure = find_measure(wave, "bvh", "auto", "traversal")
            points.append((result["spheres"], figure([ns / wave["rays"] for ns in measure["time"]["runs_ns"]])))
        lines[f"traversal, {kind}, ns/ray"] = points
    lines["whole frame, ms"] = [(frame["spheres"], frame["frame_ms"]) for frame in data["frames"]]
    return lines


def show_flake(data):
    lines = flake_lines(data)
    rows = [(n, *(with_spread(points[i][1]) for points in lines.values())) for i, (n, _) in
            enumerate(next(iter(lines.values())))]
    fits = []
    for name, points in lines.items():
        fit = fit_exponent([(n, value["median"]) for n, value in points])
        if fit:
            fits.append(f"{name:22} n^{fit[0]:.3f} ± {fit[1]:.3f} (wanted: at most {FLAKE_EXPONENT_MAX}): "
                        f"{met(fit[0] <= FLAKE_EXPONENT_MAX)}")
    return ("Figure 6 of the paper. Frames: 640x480, one sample, depth 4, three lights, all that is done on the device.\n\n" +
            table([("spheres", *lines)], rows) + "\n\n" + "\n".join(fits))
