# SPDX-License-Identifier: MIT
"""The parts of the benchmark that measure rays: `bench tracers` over scenes, triangles, pixels and rays per pixel.

A result is what `bench tracers` prints, with "title" added. Two measures: through the interface (rays to hits on the device,
surface included), and the traversal alone (distance, primitive, instance, barycentrics), which is held against Embree itself. A
visibility is all that an any-hit wave asks for, so there the two are the same.
"""
import json
import subprocess

from bench_common import (KITCHEN_VIEW, Failure, bundled, command, figure, fit_exponent, paired_ratio, say, shared,
                          significant, table, with_spread)

WAVES = ("primary", "reflection", "shadow", "occlusion", "bounce")
FAMILY = [1000 * 2 ** k for k in range(11)]
REACH = (5000, 37000, 147000)
EXACT = ("--tracers", "bvh,reference")
MEBI = 1 << 20


# ---- measuring --------------------------------------------------------------------------------------


def trace(bench, title, runs, *arguments):
    """One call of `bench tracers`, which says what it does on our standard error. A disagreement is noted as a fault."""
    full = [*bench.form("tracers"), "--runs", runs, *arguments]
    result = subprocess.run(list(map(str, full)), stdout=subprocess.PIPE, text=True, check=False)
    if not result.stdout:
        raise Failure(f"{' '.join(map(str, full))} ended with {result.returncode}")
    if result.returncode != 0:
        bench.faults.append(f"{title}: a tracer disagrees with the reference beyond 0.01 % of the rays, edges aside")
    return {"title": title, **json.loads(result.stdout)}


def ray_models(bench, left_out):
    if bench.tiny:
        yield "cornell (bundled)", bundled(bench, "cornell.glb"), []
        return
    yield "teapot (bundled)", bundled(bench, "teapot.glb"), []
    yield "bumpy 150K (bundled)", bundled(bench, "bumpy-150.glb"), []
    yield from shared(bench, [
        ("helmet 15K", "gltf/DamagedHelmet.glb", []), ("dragon 47K", "common/dragon-47k.glb", []),
        ("bunny 69K", "common/bunny-69k.obj", []), ("kitchen 86K", "rayspace/kitchen.obj", KITCHEN_VIEW),
        ("dragon 871K", "common/dragon-871k.glb", []), ("balls, 7K spheres", "bvh/spd-balls-4.nff", []),
        ("building 23K, 70 instances", "gltf/samplebuilding.gltf", [])], left_out)


def measure_tracers(bench):
    left_out = []
    size = "64x64" if bench.tiny else "512x512"
    results = [trace(bench, title, bench.times(5), "--model", model, "--size", size, "--waves", ",".join(WAVES), *options)
               for title, model, options in ray_models(bench, left_out)]
    return {"results": results, "left_out": left_out}


def measure_reach(bench):
    sizes = (1000,) if bench.tiny else REACH
    size = "64x64" if bench.tiny else "512x512"
    return {"results": [trace(bench, f"family {n}", bench.times(5), "--family", n, "--size", size, *EXACT) for n in sizes]}


def join_times(into, more):
    """Adds the runs of a figure of `bench tracers` to those of another."""
    into["runs_ns"] += more["runs_ns"]
    joined = figure(into["runs_ns"])
    into.update({f"{key}_ns": joined[key] for key in ("median", "deviation", "min", "max")})


def join(into, more):
    """Adds the runs of a result to those of another of the same scene."""
    for structure, other in zip(into["structures"], more["structures"]):
        join_times(structure["build"], other["build"])
    for wave, other_wave in zip(into["waves"], more["waves"]):
        for measure, other in zip(wave["measures"], other_wave["measures"]):
            join_times(measure["time"], other["time"])
            measure["rays_per_s"] = 1e9 * wave["rays"] / measure["time"]["median_ns"]


def sweep(bench, calls):
    """Results of calls (title, arguments) that make a curve. There and back, so that a machine that grows slower or faster
    meanwhile bends the curve less; the runs are put together."""
    runs = max(1, bench.times(6) // 2)
    results = [trace(bench, title, runs, *arguments, *EXACT, "--quick") for title, arguments in calls]
    if bench.times(6) > 1:
        for result, (title, arguments) in reversed(list(zip(results, calls))):
            join(result, trace(bench, title, runs, *arguments, *EXACT, "--quick"))
    return {"results": results}


def measure_family(bench):
    sizes = FAMILY[:3] if bench.tiny else FAMILY
    size = "64x64" if bench.tiny else "512x512"
    return sweep(bench, [(f"family {n}", ["--family", n, "--size", size, "--waves", "primary,bounce"]) for n in sizes])


def middle_model(bench):
    """(title, arguments) of what the curves against pixels and rays are measured with."""
    model = bench.shared / "common/dragon-47k.glb"
    if bench.tiny or not model.is_file():
        return "bumpy 37K", ["--family", "1000" if bench.tiny else "37000"]
    return "dragon 47K", ["--model", model]


def measure_pixels(bench):
    title, arguments = middle_model(bench)
    edges = (16, 32, 64) if bench.tiny else (128, 256, 512, 1024)
    return sweep(bench, [(f"{title}, {edge}x{edge}", [*arguments, "--size", f"{edge}x{edge}", "--waves", "primary,bounce"])
                         for edge in edges])


def measure_rays(bench):
    title, arguments = middle_model(bench)
    size = "32x32" if bench.tiny else "256x256"
    counts = (1, 2, 4) if bench.tiny else (1, 2, 4, 8, 16)
    return sweep(bench, [(f"{title}, {n} rays a pixel", [*arguments, "--size", size, "--waves", "occlusion,bounce",
                                                         "--rays-per-pixel", n]) for n in counts])


def measure_forms(bench):
    """The table of the forms of `bvh` that `bench bvh` prints, with a warm-up and medians of its own; two of its sizes."""
    say("  bench bvh")
    return {"text": command(*bench.form("bvh"), *(["1000"] if bench.tiny else ["37000", "146000"]))}


# ---- reading results --------------------------------------------------------------------------------


def find_wave(result, kind):
    return next((wave for wave in result["waves"] if wave["kind"] == kind), None)


def find_measure(wave, tracer, form, way):
    """None: was not measured. The traversal of an any-hit wave is what the interface does."""
    if wave and wave["any"] and way == "traversal":
        way = "interface"
    return next((m for m in wave["measures"] if (m["tracer"], m["form"], m["way"]) == (tracer, form, way)), None) if wave else None


def rate(measure):
    """Million rays a second as a figure."""
    if measure is None:
        return None
    rays = measure["rays_per_s"] * measure["time"]["median_ns"]
    return figure([rays / ns / 1e6 for ns in measure["time"]["runs_ns"]])


def times_as_fast(measure, other):
    """How many times as fast as the other, a figure over the rounds."""
    if measure is None or other is None:
        return None
    return paired_ratio(other["time"]["runs_ns"], measure["time"]["runs_ns"])


def tracers_of(result):
    """Their names, in the protocol's order, bar Embree itself."""
    return list(dict.fromkeys(s["tracer"] for s in result["structures"] if s["tracer"] != "embree"))


def disagreement(result, tracer, form):
    """(rays that differ, of them edges, rays) of all waves; None: nobody could tell."""
    told = [(m["agreement"], wave["rays"]) for wave in result["waves"] for m in wave["measures"]
            if m["tracer"] == tracer and m["form"] == form and "agreement" in m]
    if not told:
        return None
    return sum(a["differing"] for a, _ in told), sum(a["edges"] for a, _ in told), sum(rays for _, rays in told)


def agreed_text(result, tracer, form):
    told = disagreement(result, tracer, form)
    if told is None:
        return "-"
    differing, edges, rays = told
    return f"{100 * (1 - differing / rays):.4f}" + (f" ({edges} of {differing} edges)" if differing else "")


# ---- tables -----------------------------------------------------------------------------------------


def tracer_rows(result):
    """One row a tracer, through the interface, and one for Embree itself, 1 ray a call."""
    for tracer, form, built, way in [(t, "auto", "auto", "interface") for t in tracers_of(result)] + [
            ("embree", "1 a call", "default", "raw")]:
        structure = next(s for s in result["structures"] if (s["tracer"], s["form"]) == (tracer, built))
        primary = find_measure(find_wave(result, "primary"), tracer, form, way)
        reference = [times_as_fast(find_measure(find_wave(result, kind), tracer, form, way),
                                   find_measure(find_wave(result, kind), "reference", "auto", "interface"))
                     for kind in ("primary", "bounce")]
        build_ms = structure["build"]["median_ns"] / 1e6
        trace_ms = primary["time"]["median_ns"] / 1e6 if primary else None
        yield (result["title"], f"{result['width']}x{result['height']}",
               tracer if way == "interface" else "(embree itself)", significant(build_ms), significant(trace_ms),
               significant(build_ms + trace_ms) if primary else "-", f"{structure['memory_bytes'] / MEBI:.1f}",
               *(with_spread(rate(find_measure(find_wave(result, kind), tracer, form, way))) for kind in WAVES),
               *(significant(r["median"]) if r else "-" for r in reference), agreed_text(result, tracer, form))


def interface_table(results):
    header = [("scene", "pixels", "tracer", "build", "trace", "total", "memory", *WAVES, "x reference", "x reference",
               "agreed"),
              ("", "", "", "ms", "ms", "ms", "MiB", *(["Mray/s"] * len(WAVES)), "primary", "bounce", "% of rays")]
    return table(header, [row for result in results for row in tracer_rows(result)])


TRAVERSERS = [("bvh", "bvh", "auto", "traversal"), ("bvh 1 ray", "bvh", "1 ray", "traversal"), ("reference", "reference", "auto", "traversal"),
              ("Embree 1", "embree", "1 a call", "raw"), ("Embree 8", "embree", "8 a call", "raw"),
              ("Embree 16", "embree", "16 a call", "raw"), ("robust 1", "embree", "1 a call, robust", "raw"),
              ("robust 8", "embree", "8 a call, robust", "raw"), ("robust 16", "embree", "16 a call, robust", "raw")]


def traversal_table(results):
    rows = []
    for result in results:
        for wave in result["waves"]:
            measures = [find_measure(wave, *which[1:]) for which in TRAVERSERS]
            beside = times_as_fast(measures[0], measures[3])
            packets = times_as_fast(measures[0], measures[1])
            rows.append((result["title"], wave["kind"], wave["rays"], *(with_spread(rate(m)) for m in measures),
                         with_spread(beside), with_spread(packets)))
    header = [("scene", "wave", "rays", *(which[0] for which in TRAVERSERS), "bvh", "bvh"),
              ("", "", "", *(["Mray/s"] * len(TRAVERSERS)), "/ Embree 1", "/ bvh 1 ray")]
    return table(header, rows)


def show_tracers(data):
    text = ("Rays to hits on the device, surface included; median ± median absolute deviation. Trace: the primary wave. Any-hit\n"
            "waves of scenes with translucent or cut-out surfaces are not the same work for Embree itself, and left out there.\n\n")
    return (text + interface_table(data["results"]) + "\n\nThe traversal alone beside Embree itself, 1, 8 and 16 rays a call, "
            "default and robust scene; all cores, denormals flushed.\n\n" + traversal_table(data["results"]))


def show_reach(data):
    return "The generated family at three sizes: what is wanted of it is in the table at the end.\n\n" + traversal_table(data["results"])


CURVES = [("bvh, traversal", "bvh", "auto", "traversal"), ("bvh, hits", "bvh", "auto", "interface"),
          ("reference, hits", "reference", "auto", "interface"), ("Embree, 1 ray a call", "embree", "1 a call", "raw")]


def curve(results, kind, which, x):
    """[(x, ns a ray as a figure)] of one line of a plot. What the interface adds to a traversal is surfaces: not for any hit."""
    points = []
    for result in results:
        wave = find_wave(result, kind)
        measure = find_measure(wave, *which[1:])
        if measure and not (wave["any"] and which[0] == "bvh, hits"):
            points.append((x(result), figure([ns / wave["rays"] for ns in measure["time"]["runs_ns"]])))
    return points


def exponents(results):
    """{(wave, line): (exponent, error)} of time a ray against triangles."""
    found = {}
    for kind in ("primary", "bounce"):
        for which in CURVES:
            fit = fit_exponent([(x, y["median"]) for x, y in curve(results, kind, which, lambda r: r["triangles"])])
            if fit:
                found[kind, which[0]] = fit
    return found


def curve_table(results, kinds, x_name, x):
    rows = []
    lines = [(kind, which) for kind in kinds for which in CURVES if curve(results, kind, which, x)]
    for result in results:
        values = [dict(curve([result], kind, which, x)).get(x(result)) for kind, which in lines]
        rows.append((str(x(result)), *(with_spread(value) for value in values)))
    return table([(x_name, *(which[0] for _, which in lines)), ("", *(f"{kind}, ns/ray" for kind, _ in lines))], rows)


def show_family(data):
    lines = [f"{kind:8} {name:22} n^{slope:.3f} ± {error:.3f}" for (kind, name), (slope, error) in
             exponents(data["results"]).items()]
    return (curve_table(data["results"], ("primary", "bounce"), "triangles", lambda r: r["triangles"]) +
            "\n\ntime a ray grows with the number of triangles as\n" + "\n".join(lines))


def show_pixels(data):
    return curve_table(data["results"], ("primary", "bounce"), "pixels", lambda r: r["width"] * r["height"])


def show_rays(data):
    return curve_table(data["results"], ("occlusion", "bounce"), "rays a pixel", lambda r: r["rays_per_pixel"])
