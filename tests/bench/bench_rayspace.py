# SPDX-License-Identifier: MIT
"""The part `rayspace`: a hierarchy over the rays ('Whitted Ray-Tracing for Dynamic Scenes using a Ray-Space Hierarchy on the GPU').
Its JSON has results of bench_pictures.py:

  tests     tests a ray, everything a mirror, one bounce: joint, and the paper's descent (flat, spheres), beside bvh
  paper     the kitchen with one and two reflections, and with shadow rays
  pictures  pictures of the Standard Procedural Databases beside bvh's, which README.md speaks of
  wanted    rows as in bench_wanted.py
"""
from bench_common import KITCHEN_VIEW, significant, table, with_spread
from bench_pictures import MIRRORS, form_of, median_ratio, models, ms, pictures, ratio, size, told
from bench_wanted import row

BVH, JOINT = ["--tracer", "bvh"], ["--tracer", "rayspace"]
FLAT = [*JOINT, "--rayspace-form", "paper"]
TESTS = [("bunny 5K", "rayspace/bunny-5187.glb", []), ("bunny 69K", "common/bunny-69k.obj", []),
         ("dragon 101K", "gltf/chinesedragon.gltf", [])]
KITCHEN = [("kitchen", "rayspace/kitchen.obj", KITCHEN_VIEW)]
# The paper's kitchen (83K triangles), 512x512 on a GeForce 8800 GTS.
PAPER_MS = {"one reflection": 302, "two": 674, "two and shadows": 993}
PAPER_TESTS = (2.5, 4.5)
DATABASES = [(name, f"bvh/spd-{name}.nff", []) for name in ("balls-4", "gears", "mount", "rings", "teapot", "tetra", "tree")]
PICTURES_MAX = 2.4  # times bvh's, as README.md has it


def measure(bench):
    left_out = []
    sky = ["--environment", bench.scenes / "sky.hdr", "--samples", 1]  # its light sends no shadow rays
    tests = [pictures(bench, title, model, {"joint": JOINT, "flat, spheres": FLAT, "bvh": BVH},
                      [*size(bench, "256x256"), *MIRRORS, *sky, "--depth", 1])
             for title, model, _ in models(bench, TESTS, left_out)]
    bounces = {"one reflection": ["--depth", 1, *sky], "two": ["--depth", 2, *sky],
               "two and shadows": ["--depth", 2, "--samples", 1]}
    paper = [pictures(bench, title, model, {f"{tracer[1]}, {name}": [*tracer, *how] for name, how in bounces.items()
                                            for tracer in (JOINT, BVH)}, [*size(bench, "512x512"), *MIRRORS, *view])
             for title, model, view in models(bench, KITCHEN, left_out)]
    databases = [pictures(bench, title, model, {"rayspace": JOINT, "bvh": BVH}, [*size(bench, "640x480"), "--samples", 1])
                 for title, model, _ in models(bench, DATABASES, left_out, "sphereflake-3.nff")]
    data = {"tests": tests, "paper": paper, "pictures": databases, "left_out": left_out}
    worst = max(databases, key=lambda r: ratio(r, "rayspace", "bvh")["median"])
    data["wanted"] = [row("rayspace, a picture of the SPD / bvh's", PICTURES_MAX, ratio(worst, "rayspace", "bvh"),
                          f"worst of {len(databases)}: {worst['title']}", at_most=True)]
    return data


def show(data):
    tests = [(result["title"], form["name"], form["rays"]["secondary"],
              *(told(form, f"secondary/{kind}_tests_per_ray") for kind in ("cone", "triangle")), *ms(form, "trace"),
              significant(median_ratio(form, form_of(result, "bvh"), "trace")))
             for result in data["tests"] for form in result["forms"]]
    paper = []
    for result in data["paper"]:
        first = {tracer: form_of(result, f"{tracer}, one reflection") for tracer in ("rayspace", "bvh")}
        for name, paper_ms in PAPER_MS.items():
            cells = []
            for tracer, one in first.items():
                form = form_of(result, f"{tracer}, {name}")
                cells += [*ms(form, "rest"), significant(median_ratio(form, one, "rest"))]
            paper.append((f"{result['title']}, {name}", paper_ms, significant(paper_ms / PAPER_MS["one reflection"]), *cells))
    databases = [(result["title"], *(cell for name in ("rayspace", "bvh") for cell in ms(form_of(result, name), "frame")),
                  with_spread(ratio(result, "rayspace", "bvh"))) for result in data["pictures"]]
    return "\n\n".join((
        f"Tests a ray, everything a mirror, 256x256: the paper's flat descent makes {PAPER_TESTS[0]} to {PAPER_TESTS[1]} triangle "
        "tests.\n\n" + table([("mirror", "descent", "rays", "cone tests", "triangle", "trace", "x bvh"),
                                      ("", "", "", "a ray", "tests a ray", "ms", "")], tests),
        "The paper's kitchen and another one, 512x512, the picture without its structures; over one: times one reflection\n\n" +
        table([("everything a mirror", "paper", "over one", "rayspace", "over one", "bvh", "over one"),
               ("", "ms", "", "ms", "", "ms", "")], paper),
        "Pictures of the Standard Procedural Databases, 640x480\n\n" +
        table([("database", "rayspace", "bvh", "rayspace"), ("", "ms", "ms", "/ bvh")], databases)))
