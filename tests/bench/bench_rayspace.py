# SPDX-License-Identifier: MIT
"""The part `rayspace` of the benchmark: a hierarchy over the rays ('Whitted Ray-Tracing for Dynamic Scenes using a Ray-Space
Hierarchy on the GPU'), its counts and laws, beside `bvh` and `reference`. Its JSON:

  counts   results of `bench rayspace`: waves in the kitchen, one whole wave each
  pixels   likewise, two of these waves at four times the pixels
  scenes   likewise, primary rays of scenes of many sizes
  beside   likewise, primary rays beside bvh and reference
  moving   likewise, a family mesh of which all vertices move before each run: with the update of the tracer
  wanted   rows as in bench_reach.py

A result is what `bench rayspace` prints (its head says what), with "title" added. Counts are exact; times are of the
processor, all threads of the process, which other work on the machine does not lengthen."""
from bench_animated import run_json
from bench_common import KITCHEN_VIEW, figure, paired_ratio, shared, significant, table, with_spread
from bench_forms import models, once
from bench_reach import row
from bench_reach import show as show_wanted

KITCHEN, MIRROR = "rayspace/kitchen.obj", "common/bunny-69k.obj"
# The prototype's view of the kitchen: as KITCHEN_VIEW, but 90 degrees.
VIEW = [*KITCHEN_VIEW[:-1], "90", "--light", "10,0,2.3"]
# Wave: pixels along a side, cone tests a ray at most, those of the prototype and its triangle tests, one triangle a leaf.
COUNTS = {"primary": (256, 45, 37, 16), "ball": (256, 50, 42, 11), "mirror": (512, 90, 87, 14), "shadow": (256, 75, 69, 28),
          "turned": (256, 75, 69, 28)}
NAMES = {"primary": "primary", "ball": "smooth mirror ball", "mirror": "mirror bunny", "shadow": "shadow, to the light",
         "turned": "shadow, from the light"}
SCENES = [("bunny 1185", "rayspace/bunny-1185.glb"), ("bunny 5187", "rayspace/bunny-5187.glb"),
          ("bunny 15391", "rayspace/bunny-15391.glb"), ("bunny 29602", "rayspace/bunny-29602.glb"),
          ("nefertiti", "rayspace/statue-nefertiti.obj"), ("dragon 202K", "common/dragon-202k.glb")]
FAMILY, MOVING = 147000, 200000
BUILD_PERCENT_MAX, PIXELS_MAX, SPREAD_MAX, BESIDE_BVH, MOVING_MAX = 1, 2.2, 1.3, 0.125, 1.5


# ---- measuring --------------------------------------------------------------------------------------


def call(bench, title, usual_runs, *arguments):
    return {"title": title, **run_json(bench, "rayspace", *arguments, "--runs", bench.times(usual_runs))}


def side(bench, pixels):
    return f"{pixels // 4}x{pixels // 4}" if bench.tiny else f"{pixels}x{pixels}"


def kitchen(bench, left_out):
    """Arguments of the model and its view; of something bundled where it is not there."""
    found = [] if bench.tiny else list(shared(bench, [("kitchen", KITCHEN, [])], left_out))
    return ["--model", found[0][1], *VIEW] if found else ["--model", bench.scenes / "teapot.glb"]


def mirror(bench, wave, left_out):
    if wave != "mirror":
        return []
    found = [] if bench.tiny else list(shared(bench, [("bunny", MIRROR, [])], left_out))
    return ["--mirror", found[0][1] if found else bench.scenes / "teapot.glb"]


def measure_wave(bench, wave, pixels, left_out):
    return call(bench, NAMES[wave], 5, *kitchen(bench, left_out), "--wave", wave, *mirror(bench, wave, left_out), "--size",
                side(bench, pixels))


def measure_scenes(bench, left_out):
    results = [call(bench, title, 5, *model) for title, model in models(bench, SCENES, left_out)]
    results.append(call(bench, "kitchen", 5, *kitchen(bench, left_out)))
    results.append(call(bench, "family", 5, "--family", 1000 if bench.tiny else FAMILY))
    return results


def measure(bench):
    left_out = []
    data = {"counts": [measure_wave(bench, wave, pixels, left_out) for wave, (pixels, *_) in COUNTS.items()],
            "pixels": [measure_wave(bench, wave, 2 * COUNTS[wave][0], left_out) for wave in ("primary", "ball")],
            "scenes": measure_scenes(bench, left_out),
            "beside": [call(bench, "kitchen", 9, *kitchen(bench, left_out), "--beside", "bvh,reference", "--size",
                            side(bench, 512))],
            "moving": [call(bench, "family", 9, "--family", 1000 if bench.tiny else MOVING, "--moves", "--size",
                            side(bench, pixels)) for pixels in (256, 512)]}
    data["left_out"] = sorted(set(left_out))
    data["wanted"] = wanted(data)
    return data


# ---- reading ----------------------------------------------------------------------------------------


def a_ray(result, count="cone_tests"):
    return result[count] / result["rays"]


def times(result, tracer="rayspace"):
    return next(t["cpu_ns"] for t in result["tracers"] if t["name"] == tracer)


def build_percent(result):
    return figure([100 * nodes / whole for nodes, whole in zip(result["nodes_ns"], times(result))])


def growth(data, result):
    """Cone tests, all of them, over those at a quarter of the pixels."""
    before = next(r for r in data["counts"] if r["wave"] == result["wave"])
    return result["cone_tests"] / before["cone_tests"]


def test_ns(result):
    return figure([whole / result["cone_tests"] for whole in times(result)])


def spread(results):
    each = [test_ns(r) for r in results]
    least, most = (choose(each, key=lambda f: f["median"]) for choose in (min, max))
    share = most["median"] / least["median"]
    return {**once(share), "deviation": share * (most["deviation"] / most["median"] + least["deviation"] / least["median"])}


def beside(result, tracer):
    """Rate over the other's."""
    return paired_ratio(times(result, tracer), times(result))


# ---- what is wanted ---------------------------------------------------------------------------------


def wanted(data):
    rows = [row(f"rayspace, cone tests a ray: {r['title']}", COUNTS[r["wave"]][1], once(a_ray(r)),
                f"kitchen, {r['width']}x{r['height']}, {r['triangles']} triangles; the prototype {COUNTS[r['wave']][2]}",
                at_most=True)
            for r in data["counts"]]
    worst = max(data["counts"], key=lambda r: build_percent(r)["median"])
    rows.append(row("rayspace, building the hierarchy over rays, % of the wave", BUILD_PERCENT_MAX, build_percent(worst),
                    f"worst of {len(data['counts'])} waves: {worst['title']}", at_most=True))
    rows += [row("rayspace, cone tests at four times the pixels / before", PIXELS_MAX, once(growth(data, r)),
                 f"{r['title']}, {r['width']}x{r['height']}; the prototype 2.05", at_most=True) for r in data["pixels"]]
    rows.append(row("rayspace, maximum time a cone test / minimum", SPREAD_MAX, spread(data["scenes"]),
                    f"primary rays of {len(data['scenes'])} scenes", at_most=True))
    rows += [row("rayspace primary, rate / bvh", BESIDE_BVH, beside(r, "bvh"), f"{r['title']}, {r['triangles']} triangles")
             for r in data["beside"]]
    rows += [row("rayspace, all vertices move: refit and trace / bvh's", MOVING_MAX, paired_ratio(times(r), times(r, "bvh")),
                 f"primary rays, {r['width']}x{r['height']}, {r['triangles']} triangles", at_most=True) for r in data["moving"]]
    return rows


# ---- tables -----------------------------------------------------------------------------------------


def milliseconds(ns):
    return figure([t / 1e6 for t in ns])


def show_counts(data):
    lines = []
    for r in data["counts"] + data["pixels"]:
        maximum, *prototype = COUNTS[r["wave"]][1:] if r in data["counts"] else "---"
        lines.append((r["title"], f"{r['width']}x{r['height']}", r["rays"], significant(a_ray(r)), maximum, prototype[0],
                      significant(a_ray(r, "triangle_tests")), prototype[1], significant(r["pairs_max"] / r["rays"]),
                      r["passes"], r["halvings"], with_spread(build_percent(r)), with_spread(milliseconds(times(r))),
                      with_spread(beside(r, "bvh"))))
    return table([("wave", "pixels", "rays", "cone tests", "wanted", "proto-", "triangle", "proto-", "maximum of", "passes",
                   "halved", "building", "all", "rate"),
                  ("", "", "", "a ray", "<=", "type", "tests a ray", "type", "pairs a ray", "", "", "% of all", "ms", "/ bvh")],
                 lines)


def show_scenes(results):
    lines = [(r["title"], r["triangles"], significant(a_ray(r)), significant(a_ray(r, "triangle_tests")), with_spread(test_ns(r)),
              with_spread(milliseconds(times(r))), with_spread(beside(r, "bvh"))) for r in results]
    return table([("scene", "triangles", "cone tests", "triangle", "time a", "all", "rate"),
                  ("", "", "a ray", "tests a ray", "cone test, ns", "ms", "/ bvh")], lines)


def show_beside(results):
    lines = [(r["title"], f"{r['width']}x{r['height']}", *(with_spread(milliseconds(times(r, name))) for name in
                                                          ("rayspace", "bvh", "reference")),
              with_spread(beside(r, "bvh")), with_spread(beside(r, "reference"))) for r in results]
    return table([("scene", "pixels", "rayspace, ms", "bvh, ms", "reference, ms", "rate / bvh", "rate / reference")], lines)


def show_moving(results):
    lines = [(r["title"], r["triangles"], f"{r['width']}x{r['height']}", with_spread(milliseconds(times(r))),
              with_spread(milliseconds(times(r, "bvh")))) for r in results]
    return table([("scene", "triangles", "pixels", "rayspace, ms", "bvh, ms")], lines)


def show(data):
    return "\n\n".join([
        "Waves in the kitchen, joint descent. Counts are exact. Leaves of the tree hold several triangles, those of the "
        "prototype one:\nfewer cone tests, and more triangle tests. Times of the processor, here and below.\n\n" +
        show_counts(data),
        "Primary rays, 256x256\n\n" + show_scenes(data["scenes"]),
        "Primary rays beside other tracers\n\n" + show_beside(data["beside"]),
        "All vertices move before each run: refitting the tree, and primary rays\n\n" + show_moving(data["moving"]),
        "What is wanted\n\n" + show_wanted({"rows": data["wanted"], "gpu": []})])
