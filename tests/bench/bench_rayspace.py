# SPDX-License-Identifier: MIT
"""The part `rayspace` of the benchmark: a hierarchy over the rays ('Whitted Ray-Tracing for Dynamic Scenes using a Ray-Space
Hierarchy on the GPU'), its counts and laws, beside `bvh` and `reference`. Its JSON:

  counts   results of `bench rayspace`: waves in the kitchen, one whole wave each
  pixels   likewise, two of these waves at four times the pixels
  scenes   likewise, primary rays of scenes of many sizes
  beside   likewise, primary rays beside bvh and reference
  moving   likewise, a family mesh of which all vertices move before each run: with the update of the tracer
  anew     likewise by the flat descent, beside a bvh that is built anew
  paper    of each of PAPER that is there, by the names of BOUNCES: likewise, two reflections, the first one's shadow rays
  reflectors  likewise, mirrors in the kitchen
  rounds   likewise, the waves of `counts` in ROUNDS rounds
  turned   likewise, shadow rays that are turned round, beside those that are not
  over     likewise, small pictures, beside the flat descent
  frames   likewise, flat: first_ns and cpu_ns are the first and the tenth frame of a tracer
  cut      likewise, the kitchen in triangles of CUT_EDGE, flat, spheres
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
ROUNDS, ROUNDS_MAX = 8, {"primary": 25, "ball": 30, "mirror": 65, "shadow": 25, "turned": 25}
TURNED_MAX = 0.8
OVER_FLAT, FIRST_PERCENT, FRAMES = 20, 5, 10
CUT_EDGE, CUT_TESTS = 0.1, (2.5, 4.5)
ANEW = (5000, 20000)
# Mirrors in the kitchen, of which the paper has curves and no figures: bunnies of 948 to 69K triangles, a statue of 25K.
REFLECTORS = [("smooth ball", None), *SCENES[:4], ("bunny 69451", MIRROR), SCENES[4]]
# Where everything is a mirror, and the paper's ms, 512x512: one reflection, two, these with the shadow rays of the first, one
# with them. All of a picture, on a GeForce 8800 GTS. The second kitchen and the robot it does not have.
PAPER = [("kitchen", KITCHEN, ("83K", 302, 674, 993, None)),
         ("BART's museum", "rayspace/bart/museum/aff/museum5.aff", ("10K", None, None, None, 289)),
         # museum7.aff is there, but not the triangles that it includes
         ("BART's museum, large", "rayspace/bart/museum/aff/animart7.aff", ("75K", 1316, None, None, 3330)),
         ("BART's kitchen", "rayspace/bart/kitchen/aff/kitchen.aff", ("-", None, None, None, None)),
         ("BART's robot", "rayspace/bart/robot/aff/Robot.aff", ("-", None, None, None, None))]
BOUNCES = {"one": ("reflection", 0), "two": ("reflection", 1), "shadow": ("shadow", 1)}
BOUNCE_NAMES = {"one": "first reflection", "two": "second", "shadow": "shadows of the first"}


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


def measure_wave(bench, wave, pixels, left_out, *settings):
    return call(bench, NAMES[wave], 5, *kitchen(bench, left_out), "--wave", wave, *mirror(bench, wave, left_out), "--size",
                side(bench, pixels), *settings)


def measure_scenes(bench, left_out):
    results = [call(bench, title, 5, *model) for title, model in models(bench, SCENES, left_out)]
    results.append(call(bench, "kitchen", 5, *kitchen(bench, left_out)))
    results.append(call(bench, "family", 5, "--family", 1000 if bench.tiny else FAMILY))
    return results


def measure_moving(bench):
    moving = [call(bench, "family", 9, "--family", 1000 if bench.tiny else MOVING, "--moves", "--size", side(bench, pixels))
              for pixels in (256, 512)]
    anew = [call(bench, "family", 5, "--family", 1000 if bench.tiny else triangles, "--moves", "--anew", "--mode", "flat")
            for triangles in ANEW]
    return {"moving": moving, "anew": anew}


def measure_reflectors(bench, left_out):
    """Mirrors in the kitchen."""
    found = [("smooth ball", None)] if bench.tiny else [
        (title, path) for title, path in REFLECTORS
        if not path or list(shared(bench, [(title, path, [])], left_out))]
    return [call(bench, title, 3, *kitchen(bench, left_out), "--wave", "mirror" if path else "ball",
                 *(["--mirror", bench.shared / path] if path else []), "--size", side(bench, 512)) for title, path in found]


def measure_bounces(bench, title, arguments):
    return {"title": title, **{name: call(bench, title, 3, *arguments, "--wave", wave, "--after", after, "--size", side(bench, 512))
                               for name, (wave, after) in BOUNCES.items()}}


def measure_paper(bench, left_out):
    if bench.tiny:
        return [measure_bounces(bench, "kitchen", kitchen(bench, left_out))]
    return [measure_bounces(bench, title, ["--model", model, *(VIEW if path == KITCHEN else [])])
            for title, path, _ in PAPER for _, model, _ in shared(bench, [(title, path, [])], left_out)]


def measure_flat(bench, left_out):
    room, size = kitchen(bench, left_out), ["--size", "64x48"]
    bunny = next(models(bench, [("bunny", MIRROR)], left_out))[1]
    over = [call(bench, title, 3, *arguments, "--beside", "bvh,flat") for title, arguments in (
        ("kitchen", [*room, *size]), ("mirror bunny in it", [*room, *size, "--wave", "mirror", *mirror(bench, "mirror", left_out)]),
        ("bunny", [*bunny, "--size", side(bench, 256)]))]
    frames = [call(bench, title, 3, *arguments, "--mode", "flat", "--frames", FRAMES) for title, arguments in (
        ("kitchen", [*room, *size]), ("smooth mirror ball in it", [*room, *size, "--wave", "ball"]),
        ("bunny", [*bunny, "--size", side(bench, 256)]))]
    paper = ["--mode", "flat", "--bounds", "sphere", "--size", side(bench, 128)]
    cut = [call(bench, "kitchen", 1, *room, *paper, "--cut", 1 if bench.tiny else CUT_EDGE)]
    return {"over": over, "frames": frames, "cut": cut}


def measure(bench):
    left_out = []
    data = {"counts": [measure_wave(bench, wave, pixels, left_out) for wave, (pixels, *_) in COUNTS.items()],
            "rounds": [measure_wave(bench, wave, pixels, left_out, "--rounds", ROUNDS) for wave, (pixels, *_) in COUNTS.items()],
            "turned": [measure_wave(bench, "shadow", COUNTS["shadow"][0], left_out, "--turn", "on", "--beside", "bvh,unturned")],
            "pixels": [measure_wave(bench, wave, 2 * COUNTS[wave][0], left_out) for wave in ("primary", "ball")],
            "scenes": measure_scenes(bench, left_out),
            "beside": [call(bench, "kitchen", 9, *kitchen(bench, left_out), "--beside", "bvh,reference", "--size",
                            side(bench, 512))],
            **measure_moving(bench), **measure_flat(bench, left_out),
            "reflectors": measure_reflectors(bench, left_out), "paper": measure_paper(bench, left_out)}
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


def over_flat(result):
    """Joint's rate over flat's."""
    return paired_ratio(times(result, "flat"), times(result))


def over_unturned(result):
    return paired_ratio(times(result), times(result, "unturned"))


def first_over_last(result):
    """Per cent by which a tracer's first frame takes longer than its tenth."""
    return figure([100 * (first / last - 1) for first, last in zip(result["first_ns"], times(result))])


def together(row, *names):
    """The time of several waves."""
    return [sum(parts) for parts in zip(*(times(row[name]) for name in names))]


# ---- what is wanted ---------------------------------------------------------------------------------


def wanted(data):
    rows = [row(f"rayspace, cone tests a ray: {r['title']}", COUNTS[r["wave"]][1], once(a_ray(r)),
                f"kitchen, {r['width']}x{r['height']}, {r['triangles']} triangles; the prototype {COUNTS[r['wave']][2]}",
                at_most=True)
            for r in data["counts"]]
    rows += [row(f"rayspace, cone tests a ray, {ROUNDS} rounds: {r['title']}", ROUNDS_MAX[r["wave"]], once(a_ray(r)),
                 f"kitchen, {r['width']}x{r['height']}", at_most=True) for r in data["rounds"]]
    rows += [row("rayspace, turned shadow rays / unturned, time", TURNED_MAX, over_unturned(r),
                 f"kitchen, {r['width']}x{r['height']}; the prototype 0.62 to 0.77", at_most=True) for r in data["turned"]]
    tests = data["cut"][0]
    rows.append(row("rayspace, triangle tests a ray: flat, spheres", CUT_TESTS[1], once(a_ray(tests, "triangle_tests")),
                    f"kitchen, edges at most {CUT_EDGE} m, {tests['triangles']} triangles, {tests['width']}x{tests['height']}; "
                    f"the paper {CUT_TESTS[0]} to {CUT_TESTS[1]}", at_most=True))
    rows += [row("rayspace, joint over flat, time", OVER_FLAT, over_flat(r),
                 f"{r['title']}, {NAMES[r['wave']]}, {r['width']}x{r['height']}") for r in data["over"]]
    rows += [row("rayspace, first frame over the tenth, flat, %", FIRST_PERCENT, first_over_last(r),
                 f"{r['title']}, {r['width']}x{r['height']}, {r['triangles']} triangles", at_most=True) for r in data["frames"]]
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
    rows += [row("rayspace, all vertices move: flat / bvh built anew", 1, paired_ratio(times(r), times(r, "bvh")),
                 f"primary rays, {r['width']}x{r['height']}, {r['triangles']} triangles", at_most=True) for r in data["anew"]]
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


def show_rounds(data):
    lines = [(one["title"], f"{one['width']}x{one['height']}", significant(a_ray(one)), significant(a_ray(r)),
              significant(a_ray(one, "triangle_tests")), significant(a_ray(r, "triangle_tests")), one["passes"], r["passes"],
              with_spread(milliseconds(times(one))), with_spread(milliseconds(times(r))))
             for one, r in zip(data["counts"], data["rounds"])]
    return table([("wave", "pixels", *["cone tests a ray"] * 2, *["triangle tests a ray"] * 2, *["passes"] * 2, *["ms"] * 2),
                  ("", "", *["one round", f"{ROUNDS} rounds"] * 4)], lines)


def show_flat(data):
    over = [(r["title"], f"{r['width']}x{r['height']}", r["rays"], r["triangles"], with_spread(milliseconds(times(r))),
             with_spread(milliseconds(times(r, "flat"))), with_spread(over_flat(r))) for r in data["over"]]
    frames = [(r["title"], f"{r['width']}x{r['height']}", r["triangles"], with_spread(milliseconds(r["first_ns"])),
               with_spread(milliseconds(times(r))), with_spread(first_over_last(r))) for r in data["frames"]]
    tests = [(f"{r['title']}, edges at most {CUT_EDGE} m", f"{r['width']}x{r['height']}", r["triangles"], significant(a_ray(r)),
              significant(a_ray(r, "triangle_tests")), r["halvings"], with_spread(milliseconds(times(r)))) for r in data["cut"]]
    anew = [(r["title"], f"{r['width']}x{r['height']}", r["triangles"], with_spread(milliseconds(times(r))),
             with_spread(milliseconds(times(r, "bvh")))) for r in data["anew"]]
    return "\n\n".join([
        table([("joint beside flat", "pixels", "rays", "triangles", "joint, ms", "flat, ms", "joint is faster by")], over),
        table([("frames of a flat tracer", "pixels", "triangles", "first, ms", "tenth, ms", "first takes longer by, %")], frames),
        table([("spheres alone, primary", "pixels", "triangles", "cone tests", "triangle", "halved", "ms"),
               ("", "", "", "a ray", "tests a ray", "", "")], tests),
        table([("all vertices move", "pixels", "triangles", "flat, ms", "bvh built anew, ms")], anew)])


def show_reflectors(results):
    lines = [(r["title"], r["rays"], significant(a_ray(r)), significant(a_ray(r, "triangle_tests")), r["halvings"],
              with_spread(build_percent(r)), with_spread(milliseconds(times(r))), with_spread(beside(r, "bvh"))) for r in results]
    return table([("mirror in the kitchen", "rays", "cone tests", "triangle", "halved", "building", "all", "rate"),
                  ("", "", "a ray", "tests a ray", "", "% of all", "ms", "/ bvh")], lines)


def show_bounces(rows):
    lines = []
    for r in rows:
        for name, title in BOUNCE_NAMES.items():
            wave = r[name]
            lines.append((r["title"] if name == "one" else "", title, wave["triangles"], wave["rays"], significant(a_ray(wave)),
                          significant(a_ray(wave, "triangle_tests")), with_spread(build_percent(wave)),
                          with_spread(milliseconds(times(wave))), with_spread(beside(wave, "bvh"))))
    return table([("all is a mirror", "wave", "triangles", "rays", "cone tests", "triangle", "building", "all", "rate"),
                  ("", "", "", "", "a ray", "tests a ray", "% of all", "ms", "/ bvh")], lines)


def beside_paper(ms, first_ms):
    return f"{ms}" + (f" ({ms / first_ms:.2f})" if first_ms and ms != first_ms else "") if ms else "-"


def beside_first(figures):
    """Milliseconds, the later ones with their ratio to the first."""
    first, *others = (f["median"] for f in figures)
    return [significant(first), *(f"{significant(ms)} ({ms / first:.2f})" for ms in others)]


def show_paper(rows):
    lines = []
    for title, _, (triangles, *paper) in PAPER:
        r = next((r for r in rows if r["title"] == title), None)
        here = ["no such file"] + ["-"] * 4
        if r:
            sums = [milliseconds(together(r, *names)) for names in (("one",), ("one", "two"), BOUNCES, ("one", "shadow"))]
            here = [r["one"]["triangles"], *beside_first(sums)]
        lines.append((title, triangles, *(beside_paper(ms, paper[0]) for ms in paper), *here))
    columns = ["triangles", "one reflection", "two", "two, shadows", "one, shadows"]
    return table([("ms (over one)", *["paper"] * len(columns), *["here"] * len(columns)), ("", *columns, *columns)], lines)


PAPER_TEXT = """The paper's table beside ours, 512x512. The paper: a whole picture on a GeForce 8800 GTS, of another kitchen;
here the waves of rays, on processors, so that its ratios say more than its times. It has 2.5 to 4.5 triangle tests a ray, 60 %
of the time in stream reduction, 15 % in cone tests and less than 1 % in building; cone tests and its mirrors it has as curves
alone. Its small museum has 10,412 triangles; the large one needs a file of BART that is missing. Patio (87K triangles 143 ms,
236K 402, 705K 308 to 898) and alley (987K 8.3 s, 2.3 M 1.3 to 18.5 s) are not to be had.

"""


def show(data):
    return "\n\n".join([
        "Waves in the kitchen, joint descent. Counts are exact. Leaves of the tree hold several triangles, those of the "
        "prototype one:\nfewer cone tests, and more triangle tests. Times of the processor, here and below.\n\n" +
        show_counts(data),
        "The same waves in rounds: what is far away waits until rays end at what they have hit\n\n" + show_rounds(data),
        "Primary rays, 256x256\n\n" + show_scenes(data["scenes"]),
        "Primary rays beside other tracers\n\n" + show_beside(data["beside"]),
        "All vertices move before each run: refitting the tree, and primary rays\n\n" + show_moving(data["moving"]),
        "The flat descent, as in the paper. It is measured at sizes that it finishes; on a GPU it would be others\n\n" +
        show_flat(data),
        PAPER_TEXT + show_paper(data["paper"]) + "\n\n" + show_bounces(data["paper"]) + "\n\n" +
        show_reflectors(data["reflectors"]),
        "What is wanted\n\n" + show_wanted({"rows": data["wanted"], "gpu": []})])
