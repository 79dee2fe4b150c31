# SPDX-License-Identifier: MIT
"""The part `quadtree` of the benchmark: quadtrees over what a view sees ('An Adaptive Acceleration Structure for Screen-space Ray
Tracing'), the paper's tables beside ours, and other ways to make the same pictures. Its JSON:

  builds       results of `bench quadtree`: building over a family of scenes, 5K to 1.3 M triangles
  stereo       likewise, rays of an eye 6.5 cm aside in the classroom: quadtree, dda, minmax, bvh and reference with 1 layer,
               and with 2
  layers       likewise, with 1, 2 and 3 layers, and with adaptive thresholds
  reflections  likewise, faces of a cube: first and third mirror reflection, with 1 and 2 layers, beside bvh and reference
  warps        result of `bench views`: pictures of moved eyes by mesh, splats and iteration
  mesh         likewise, at the size of `stereo`
  eyes         result of `bench eyes`: the same moves by layers of the tracer
  upsampling   likewise, the three frames between two of a walk
  lens         for each of SAMPLES likewise, a lens
  wanted       rows as in bench_reach.py

Counts and PSNR are exact; times are of the processor, all threads of the process."""
from bench_animated import run_json
from bench_common import figure, paired_ratio, shared
from bench_forms import once
from bench_reach import row

CLASSROOM = "screenspace/classroom.obj"
VIEW = ["--eye=-6.079,0.764,-0.244", "--look-at=3.862,-0.288,-0.498", "--up=0,0,1", "--fov", "50"]
FAMILY = (5000, 20000, 80000, 325000, 1300000)
# The paper has 900 rows; rays go in tiles of 8x8.
STEREO_SIZE, SIZE = (1600, 896), (1280, 720)
LENS_SIZE = (640, 360)  # its true pictures have many samples
ASIDE = "0.065,0,0"
STEREO = "quadtree,dda,minmax"
# A walk at 1.4 m/s, shown at 60 frames a second of which 15 are rendered.
WALK = [f"0,0,{1.4 * k / 60:.4f}" for k in (1, 2, 3)]
# Of the true pictures, whose noise is measured and taken off: with 16 to 128 of them all PSNR agree within 0.5 dB.
SAMPLES, TRUE_SAMPLES = (4, 8, 16), 64
LENS = ["--move", "0,0,0", "--aperture", "0.1", "--focus", "4"]
SPREAD_MAX, BUILD_MAX, STEPS_MAX, LAYER_MAX, ADAPTIVE_MAX = 3, 1 / 3, 0.6, 1.25, 0.9
OVER = {"reference": 1.8, "dda": 3, "minmax": 1.4}
PSNR_MIN, OVER_SPLAT, OVER_MESH = (35, 32), (0.9, 4), 1.4
UNSEEN_MAX = {"two": 0.7, "three": 0.5}
LENS_MIN, LENS_PSNR, UPSAMPLING_MIN, UPSAMPLING_PSNR = 5, 35, 3, 33


# ---- measuring --------------------------------------------------------------------------------------


def call(bench, name, title, usual_runs, *arguments):
    return {"title": title, **run_json(bench, name, *arguments, "--runs", bench.times(usual_runs))}


def size(bench, pixels):
    return ["--size", "64x48"] if bench.tiny else ["--size", "{}x{}".format(*pixels)]


def classroom(bench, left_out):
    """Arguments of the model and its view; of something bundled where it is not there."""
    found = [] if bench.tiny else list(shared(bench, [("classroom", CLASSROOM, [])], left_out))
    return ["--model", found[0][1], *VIEW] if found else ["--model", bench.scenes / "teapot.glb"]


def measure_builds(bench):
    sizes = (500, 1000) if bench.tiny else FAMILY
    return [call(bench, "quadtree", f"family {n}", 9, "--family", n, *size(bench, STEREO_SIZE), "--layers", 1, "--forms",
                 "quadtree") for n in sizes]


def measure_rays(bench, room):
    stereo = ["--move", ASIDE, *size(bench, STEREO_SIZE)]
    return {"stereo": [call(bench, "quadtree", f"{n} layer{'s' * (n > 1)}", 5, *room, *stereo, "--layers", n, "--forms",
                            STEREO + ",reference") for n in (1, 2)],
            "layers": call(bench, "quadtree", "layers", 5, *room, *stereo, "--forms", "one,two,three,adaptive,stack,primitives"),
            "reflections": [call(bench, "quadtree", title, 3, *room, *size(bench, SIZE), "--wave", "reflection", "--after", after,
                                 "--faces", "cube", "--forms", "one,two,reference")
                            for title, after in (("first reflection", 0), ("third", 2))]}


def measure_pictures(bench, room):
    moves = [argument for way in WALK for argument in ("--move", way)]
    return {"warps": call(bench, "views", "moved", 3, *room, *size(bench, SIZE)),
            "mesh": call(bench, "views", "stereo", 3, *room, *size(bench, STEREO_SIZE), "--move", ASIDE),
            "eyes": call(bench, "eyes", "moved", 3, *room, *size(bench, SIZE), "--forms", "one,two,three,adaptive"),
            "upsampling": call(bench, "eyes", "walk", 3, *room, *size(bench, SIZE), *moves, "--forms", "one,two,minmax,dda"),
            "lens": [call(bench, "eyes", f"{n} samples", 3, *room, *size(bench, LENS_SIZE), *LENS, "--samples", n, "--true-samples",
                          4 if bench.tiny else TRUE_SAMPLES, "--forms", "one,two,dda") for n in SAMPLES]}


def measure(bench):
    left_out = []
    room = classroom(bench, left_out)
    data = {"builds": measure_builds(bench), **measure_rays(bench, room), **measure_pictures(bench, room)}
    data["left_out"] = sorted(set(left_out))
    data["wanted"] = wanted(data)
    return data


# ---- reading ----------------------------------------------------------------------------------------


def form_of(result, name):
    key = "contenders" if "contenders" in result else "forms" if "forms" in result else "methods"
    return next(form for form in result[key] if form["name"] == name)


def build_ns(contender):
    """What comes before the rays: a walk from texel to texel needs the layers, but no tree."""
    builds = contender["draw_ns" if contender["name"] == "dda" else "update_ns"]
    return builds or [0] * len(contender["trace_ns"])


def stereo_ns(contender):
    """Of a pair of pictures: building, and two eyes, each from the camera to its hits."""
    builds = build_ns(contender)
    return [build + 2 * eye for build, eye in zip(builds, contender["eye_ns"])]


def percent_spread(results):
    """Of the builds' medians, about their mean."""
    each = [figure(form_of(r, "quadtree")["nodes_ns"]) for r in results]
    middles = [f["median"] for f in each]
    mean = sum(middles) / len(middles)
    return {**once(100 * (max(middles) - min(middles)) / mean),
            "deviation": 100 * sum(f["deviation"] for f in each) / len(each) / mean}


def upsampled(move, name):
    """Frames a second over rendered ones, where one of four is rendered."""
    form = form_of(move, name)
    return [4 * whole / (cold + 3 * warm) for whole, cold, warm in zip(move["rendered_ns"], form["cold_ns"], form["warm_ns"])]


# ---- what is wanted ---------------------------------------------------------------------------------


def wanted_of_rays(data):
    one, layers = data["stereo"][0], data["layers"]
    ours = form_of(one, "quadtree")
    where = f"{one['triangles']} triangles, {one['width']}x{one['height']}, one layer"
    builds = data["builds"]
    yield row("quadtree, building: spread, %", SPREAD_MAX, percent_spread(builds),
              f"nodes, {builds[0]['triangles']} to {builds[-1]['triangles']} triangles; the paper 3", at_most=True)
    drawn = figure([b / t for b, t in zip(ours["update_ns"], ours["trace_ns"])])["median"]
    yield row("quadtree, building the nodes / one traced view", round(BUILD_MAX, 3),
              paired_ratio(ours["nodes_ns"], ours["trace_ns"]), f"{where}; with drawing the layers {drawn:.2f}", at_most=True)
    for name, least in OVER.items():
        yield row(f"quadtree, stereo with building: rate / {name}", least,
                  paired_ratio(stereo_ns(form_of(one, name)), stereo_ns(ours)), where)
    yield row("quadtree, steps a ray / minmax", STEPS_MAX, once(ours["steps"] / form_of(one, "minmax")["steps"]),
              f"{where}; the prototype 0.53", at_most=True)
    yield row("quadtree, time with a second layer / one", LAYER_MAX,
              paired_ratio(form_of(layers, "two")["trace_ns"], form_of(layers, "one")["trace_ns"]), "rays; the paper 1.1 to 1.2",
              at_most=True)


def wanted_of_pictures(data):
    for k, (warps, eyes) in enumerate(zip(data["warps"]["moves"], data["eyes"]["moves"])):
        one, ours = form_of(eyes, "one"), form_of(eyes, "three")  # the latter are what a picture has by itself
        where = f"eye moved by {eyes['name']} m, three layers; one {one['psnr_db']:.1f} dB"
        yield row("quadtree, PSNR, dB", PSNR_MIN[k], once(ours["psnr_db"]), where)
        for name, least in (("splat", OVER_SPLAT[k]), ("mesh", OVER_MESH)):
            yield row(f"quadtree, PSNR over {name}, dB", least, once(ours["psnr_db"] - form_of(warps, name)["psnr_db"]), where)
        for name, most in UNSEEN_MAX.items():
            yield row(f"quadtree, share unseen with {name} layers / one", most,
                      once(form_of(eyes, name)["unseen"] / max(one["unseen"], 1e-9)), f"eye moved by {eyes['name']} m", at_most=True)
    eyes, layers = data["eyes"]["moves"][0], data["layers"]
    yield row("quadtree, time with adaptive thresholds / without", ADAPTIVE_MAX,
              paired_ratio(form_of(layers, "adaptive")["trace_ns"], form_of(layers, "two")["trace_ns"]),
              f"{form_of(eyes, 'adaptive')['psnr_db']:.2f} and {form_of(eyes, 'two')['psnr_db']:.2f} dB", at_most=True)
    lens = data["lens"][-1]["moves"][0]
    ours = form_of(lens, "one")  # as lenses and frames between others have it by themselves
    where = f"{data['lens'][-1]['title']}, one layer; rendered ones {lens['psnr_db']:.1f} dB"
    yield row("quadtree, lens: frames a second / bvh", LENS_MIN, paired_ratio(lens["rendered_ns"], ours["cold_ns"]), where)
    yield row("quadtree, lens: PSNR, dB", LENS_PSNR, once(ours["psnr_db"]), where)
    walk = data["upsampling"]["moves"]
    yield row("quadtree, 15 to 60 frames a second: frames a second / rendered", UPSAMPLING_MIN,
              figure([ratio for move in walk for ratio in upsampled(move, "one")]), "one layer")
    yield row("quadtree, 15 to 60 frames a second: PSNR, dB", UPSAMPLING_PSNR,
              once(min(form_of(move, "one")["psnr_db"] for move in walk)), f"the worst of {len(walk)}, one layer")


def wanted(data):
    return [*wanted_of_rays(data), *wanted_of_pictures(data)]
