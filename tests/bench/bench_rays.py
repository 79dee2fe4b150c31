# SPDX-License-Identifier: MIT
"""The parts of the benchmark that measure rays: `bench tracers` over scenes, triangles, pixels and rays per pixel.

A result is what `bench tracers` prints, with "title" added. Two measures: through the interface (rays to hits on the device,
surface included), and the traversal alone (distance, primitive, instance, barycentrics). A visibility is all that an any-hit
wave asks for, so there the two are the same.
"""
import json
import subprocess

from bench_common import KITCHEN_VIEW, Failure, bundled, figure, fit_exponent, paired_ratio, shared, significant, table, with_spread

WAVES = ("primary", "reflection", "shadow", "occlusion", "bounce")
FAMILY = [1000 * 2 ** k for k in range(11)]
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
    results = [trace(bench, title, runs, *arguments, *EXACT) for title, arguments in calls]
    if bench.times(6) > 1:
        for result, (title, arguments) in reversed(list(zip(results, calls))):
            join(result, trace(bench, title, runs, *arguments, *EXACT))
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


# ---- reading results --------------------------------------------------------------------------------


def find_wave(result, kind):
    return next((wave for wave in result["waves"] if wave["kind"] == kind), None)


def find_measure(wave, tracer, way):
    """None: was not measured. The traversal of an any-hit wave is what the interface does."""
    if wave and wave["any"] and way == "traversal":
        way = "interface"
    return next((m for m in wave["measures"] if (m["tracer"], m["way"]) == (tracer, way)), None) if wave else None


def rate(measure):
    """Million rays a second as a figure."""
    if measure is None:
        return None
    rays = measure["rays_per_s"] * measure["time"]["median_ns"]
    return figure([rays / ns / 1e6 for ns in measure["time"]["runs_ns"]])


def beside_reference(wave, measure):
    """How many times as fast, as a cell."""
    reference = find_measure(wave, "reference", "interface")
    if measure is None or reference is None:
        return "-"
    return significant(paired_ratio(reference["time"]["runs_ns"], measure["time"]["runs_ns"])["median"])


def agreed_text(result, tracer):
    told = [(m["agreement"], wave["rays"]) for wave in result["waves"] for m in wave["measures"]
            if m["tracer"] == tracer and "agreement" in m]
    if not told:
        return "-"
    differing, edges, rays = sum(a["differing"] for a, _ in told), sum(a["edges"] for a, _ in told), sum(n for _, n in told)
    return f"{100 * (1 - differing / rays):.4f}" + (f" ({edges} of {differing} edges)" if differing else "")


# ---- tables -----------------------------------------------------------------------------------------


def tracer_rows(result):
    """One row a tracer, through the interface."""
    for structure in result["structures"]:
        tracer = structure["tracer"]
        waves = {kind: find_wave(result, kind) for kind in WAVES}
        found = {kind: find_measure(wave, tracer, "interface") for kind, wave in waves.items()}
        build_ms, trace_ms = structure["build"]["median_ns"] / 1e6, found["primary"]["time"]["median_ns"] / 1e6
        yield (result["title"], f"{result['width']}x{result['height']}", tracer, significant(build_ms), significant(trace_ms),
               significant(build_ms + trace_ms), f"{structure['memory_bytes'] / MEBI:.1f}",
               *(with_spread(rate(measure)) for measure in found.values()),
               *(beside_reference(waves[kind], found[kind]) for kind in ("primary", "bounce")), agreed_text(result, tracer))


def show_tracers(data):
    header = [("scene", "pixels", "tracer", "build", "trace", "total", "memory", *WAVES, "x reference", "x reference", "agreed"),
              ("", "", "", "ms", "ms", "ms", "MiB", *(["Mray/s"] * len(WAVES)), "primary", "bounce", "% of rays")]
    traversals = [(result["title"], tracer, *(with_spread(rate(find_measure(find_wave(result, kind), tracer, "traversal")))
                                              for kind in WAVES)) for result in data["results"] for tracer in ("bvh", "reference")]
    return ("Rays to hits on the device, surface included; median ± median absolute deviation. Trace: the primary wave.\n\n" +
            table(header, [row for result in data["results"] for row in tracer_rows(result)]) +
            "\n\nThe traversal alone, Mray/s\n\n" + table([("scene", "tracer", *WAVES)], traversals))


CURVES = [("bvh, traversal", "bvh", "traversal"), ("bvh, hits", "bvh", "interface"), ("reference, hits", "reference", "interface")]


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
