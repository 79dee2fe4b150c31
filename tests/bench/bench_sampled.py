# SPDX-License-Identifier: MIT
"""The parts `ldc` ('GPU Rendering of Secondary Effects') and `abuffer` ('Ray Tracing via GPU Rasterization'): the table 1 of
each paper beside ours. Their JSON is `results`, of bench_pictures.py; those of ldc have `paper`, the name of a row of PAPER_LDC,
those of abuffer `how`, a row of PAPER_ABUFFER. The octree of the A-buffers' paper is not built: its times are the paper's.
"""
from bench_common import significant, table
from bench_pictures import GLASS, MIRRORS, form_of, median_ratio, models, ms, pictures, size, told

# Name: triangles; ms of building (A) and of ray tracing with the picture (B) at 512 and at 1024 on a GeForce 8800 GTX; layers.
# Then what is rendered here, below FARLIGHT_SCENES.
PAPER_LDC = {"bunny": (8192, ((7, 61), (19, 115)), 8, "rayspace/bunny-5187.glb"),
             "car": (20264, ((9, 82), (25, 250)), 12, "ldc/legocar.obj"),
             "dragon": (120000, ((12, 205), (31, 441)), 7, "gltf/chinesedragon.gltf"),
             "bust": (300000, ((19, 160), (53, 346)), 6, "ldc/igea-bust.glb"),
             "skinned figure": (1628, ((5, 44), (16, 95)), 6, "ldc/CesiumMan.glb")}
CELLS = (512, 1024)
PLAYS = "skinned figure"
# ms of construction, tracing and others, by A-buffers and by the paper's octree.
PAPER_ABUFFER = {"mirrors": ("Figure 1(b)", (13.2, 11.6, 2.7), (42.8, 84.6, 3.8)),
                 "glass": ("Figure 8 top", (10.8, 8.7, 2.6), (35.6, 79.6, 2.9))}
LOOKS = {"mirrors": MIRRORS, "glass": GLASS}
CLOSED = [("spot 5.9K", "gltf/spot.obj", []), ("dragon 101K", "gltf/chinesedragon.gltf", [])]
FORMS = ("paper", "fast")
TEXELS = 1024


# ---- layered depth cubes ----------------------------------------------------------------------------


def measure_ldc(bench):
    left_out, results = [], []
    forms = {**{f"ldc {n}": ["--tracer", "ldc", "--ldc-resolution", n // 16 if bench.tiny else n] for n in CELLS},
             "bvh": ["--tracer", "bvh"]}
    for name, (_, _, _, file) in list(PAPER_LDC.items())[3 if bench.tiny else 0:]:
        plays = name == PLAYS
        for _, model, _ in models(bench, [(name, file, [])], left_out, "carousel.glb" if plays else "teapot.glb"):
            options = [*size(bench, "1280x1024"), "--samples", 1, "--depth", 1, *MIRRORS]
            moving = ("animate", "--clip", 0, "--frames", "1-8") if plays else ("render",)
            results.append({"paper": name, **pictures(bench, name, model, forms, options, 2 if plays else 5, moving)})
    return {"results": results, "left_out": left_out}


def show_ldc(data):
    lines = []
    for result in data["results"]:
        triangles, paper, layers, _ = PAPER_LDC[result["paper"]]
        low, high = (form_of(result, f"ldc {n}") for n in CELLS)
        part = "dynamic" if result["paper"] == PLAYS else "static"
        for n, form, (a, b) in zip(CELLS, (low, high), paper):
            lines.append((f"{result['paper']}, {result['here']}", n, told(form, f"{part}/layers_needed"),
                          *ms(form, "build", "rest", "trace"), layers, a, b))
        growth = [significant(median_ratio(high, low, key)) for key in ("build", "rest", "trace")]
        beside = ms(form_of(result, "bvh"), "build", "rest", "trace")
        lines.append(("", "1024 / 512", "", *growth, "", *(significant(paper[1][k] / paper[0][k]) for k in range(2))))
        lines.append((f"  the paper's has {triangles} triangles", "bvh", "", *beside, "", "", ""))
    return ("The paper's table 1: 1280x1024, everything a mirror, one bounce. A: building; B: the rest of the picture, of which 'trace'\n"
            "is the waves alone. The paper's on a GeForce 8800 GTX. Each picture has a new scene, so A allocates the cube as well. The\n"
            "figure plays a clip; its cube is built each frame.\n\n" +
            table([("scene", "cells", "layers", "A", "B", "trace", "paper:", "A", "B"),
                   ("", "", "needed", "ms", "ms", "ms", "layers", "ms", "ms")], lines))


# ---- voxels and A-buffers ---------------------------------------------------------------------------


def measure_abuffer(bench):
    left_out, results = [], []
    texels = ["--tracer", "abuffer", "--abuffer-resolution", TEXELS // 16 if bench.tiny else TEXELS]
    forms = {**{form: [*texels, "--abuffer-form", form] for form in FORMS}, "bvh": ["--tracer", "bvh"]}
    for (title, model, _), (how, look) in zip(models(bench, CLOSED, left_out), LOOKS.items()):
        options = [*size(bench, "800x600"), "--samples", 1, "--depth", 3, *look]
        results.append({"how": how, **pictures(bench, title, model, forms, options)})
    return {"results": results, "left_out": left_out}


def show_abuffer(data):
    lines = []
    for result in data["results"]:
        name, *paper = PAPER_ABUFFER[result["how"]]
        for form in result["forms"]:
            rest, trace = form["ms"]["rest"]["median"], form["ms"]["trace"]["median"]
            lines.append((f"{result['title']}, {result['how']}", form["name"], *ms(form, "build", "trace"),
                          significant(rest - trace), *ms(form, "frame")))
        lines += [(f"  the paper, {name}", which, *times, significant(sum(times)))
                  for which, times in zip(("A-buffers", "octree"), paper)]
    return (f"The paper's table 1, 800x600, depth 3, {TEXELS} texels; others: all of the picture but building and its rays.\n"
            "The paper's on a GeForce GTX 780.\n\n" +
            table([("picture", "form", "construction", "tracing", "others", "total"), ("", "", "ms", "ms", "ms", "ms")], lines))
