# SPDX-License-Identifier: MIT
"""The part `quadtree`: quadtrees over what a view sees ('An Adaptive Acceleration Structure for Screen-space Ray Tracing'), the
paper's tables 1 to 5 beside ours, as whole pictures that a user asks for. Its JSON has results of bench_pictures.py: `builds`,
`stereo`, `upsampling`, `lens` and `reflections`. The paper's baseline of a warped mesh is left out.
"""
import json
import pathlib

from bench_common import command, significant, table
from bench_pictures import MIRRORS, form_of, median_ratio, models, ms, pictures, size

VIEW = ["--eye=-6.079,0.764,-0.244", "--look-at=3.862,-0.288,-0.498", "--up=0,0,1", "--fov", "50"]
ROOM = [("classroom", "screenspace/classroom.obj", VIEW)]
FAMILY = (5, 20, 80, 325, 1300)  # thousands of triangles
ONE, TWO = ["--quadtree-layers", 1], ["--quadtree-layers", 2]
WAYS = {"quadtree": [], "paper": ["--quadtree-form", "paper"]}
SAMPLES = (4, 8, 16)
# The paper's figures, on a GeForce GTX 980 at 1600x900. Table 1: scene, ms.
PAPER_BUILDS = (("Sponza, 227K", 0.646), ("living room, 456K", 0.636), ("San Miguel, 6550K", 0.657))
# Table 2, living room: ms of building and both eyes.
PAPER_STEREO = {"paper, 1 layer": 4.35, "paper, 2 layers": 5.45}
# Table 3: ms of a frame in the mean, one of four rendered. Table 4, Sponza: ms by rays a pixel.
PAPER_UPSAMPLING = {"1 layer": 0.86, "2 layers": 1.13}
PAPER_LENS = {"1 layer": {4: 2.8, 8: 5.32}, "2 layers": {4: 3.21, 8: 5.85}}
# Table 5: ms of the cube map and of one glossy bounce of 8 samples.
PAPER_REFLECTIONS = {"1 layer": (2.38, 1.974), "2 layers": (5.15, 4.91)}
LAYERS = {"1 layer": ONE, "2 layers": TWO}


def walk(bench):
    """Writes camera keys: a second ahead at 1.4 m/s."""
    eye, look_at = ([float(number) for number in VIEW[k].partition("=")[2].split(",")] for k in (0, 1))
    way = [b - a for a, b in zip(eye, look_at)]
    step = [1.4 * part / sum(p * p for p in way) ** 0.5 for part in way]
    path = pathlib.Path(bench.scenes) / "walk.json"
    keys = [{"time": t, "eye": [a + t * s for a, s in zip(eye, step)], "look_at": [a + t * s for a, s in zip(look_at, step)],
             "up": [0, 0, 1], "fov": 50} for t in (0, 1)]
    path.write_text(json.dumps(keys))
    return path


def measure_builds(bench):
    sizes = (1, 2) if bench.tiny else FAMILY
    command(bench.program("tests/tools/make_scenes"), bench.scenes, *sizes)
    options = [*size(bench, "1600x896"), "--samples", 1, "--depth", 1, "--tracer", "quadtree", "--quadtree-faces", "view"]
    return [pictures(bench, f"{n}K", pathlib.Path(bench.scenes) / f"bumpy-{n}.glb", {"quadtree": ONE}, options, 5)
            for n in sizes]


def measure(bench):
    left_out = []
    title, model, view = models(bench, ROOM, left_out)[0]
    still = [*view, "--samples", 1, "--integrator", "whitted"]
    stereo = {"rendered": ["--views", "rays"],
              **{f"{way}, {n}": [*how, *layers] for n, layers in LAYERS.items() for way, how in WAYS.items()}}
    upsampling = {"rendered": [], **{n: [*layers, "--upsample", 4] for n, layers in LAYERS.items()}}
    lens = {f"{n}, {samples} samples": [*layers, "--lens", way, "--samples", samples] for samples in SAMPLES
            for n, layers, way in (("rendered", [], "rays"), *((n, layers, "quadtree") for n, layers in LAYERS.items()))}
    mirrors = {"bvh": ["--tracer", "bvh"], **{n: ["--tracer", "quadtree", *layers] for n, layers in LAYERS.items()}}
    moving = ("animate", "--keys", walk(bench), "--fps", 60, "--frames", "1-9")
    return {"builds": measure_builds(bench), "left_out": left_out,
            "stereo": pictures(bench, title, model, stereo, [*still, *size(bench, "1600x896"), "--stereo", "0.065"]),
            "upsampling": pictures(bench, title, model, upsampling,
                                   ["--samples", 1, "--integrator", "whitted", *size(bench, "1280x720")], 3, moving),
            "lens": pictures(bench, title, model, lens, [*view, *size(bench, "640x360"), "--aperture", "0.1", "--focus", 4]),
            "reflections": [pictures(bench, f"{depth} bounce{'s' * (depth > 1)}", model, mirrors,
                                     [*still, *size(bench, "640x360"), *MIRRORS, "--depth", depth]) for depth in (1, 3)]}


def unknown(form):
    """Unknown share of the rays of views or of bounces, in per cent."""
    found = [value for name, value in form["structure"].items()
             if "unknown" in name and name.startswith(("views/", "secondary/"))]
    return f"{100 * sum(found):.2f}" if found else "-"


def lines_of(result, paper):
    """One row for each form: the paper's time, ours, the speed-up over the first form, and the unknown share."""
    first = result["forms"][0]
    return [(form["name"], significant(paper.get(form["name"])), *ms(form, "build", "frame"),
             significant(median_ratio(first, form, "frame")), unknown(form)) for form in result["forms"]]


def show_lens(result):
    lines = []
    for samples in SAMPLES:
        rendered = form_of(result, f"rendered, {samples} samples")
        for n in ("rendered", *LAYERS):
            form = form_of(result, f"{n}, {samples} samples")
            lines.append((form["name"], significant(PAPER_LENS.get(n, {}).get(samples)), *ms(form, "build", "frame"),
                          significant(median_ratio(rendered, form, "frame")), unknown(form)))
    return lines


def show(data):
    nodes = [r["forms"][0]["ms"]["nodes"] for r in data["builds"]]
    middles = [value["median"] for value in nodes]
    spread = 100 * (max(middles) - min(middles)) / (sum(middles) / len(middles))
    head = [("", "paper", "build", "a frame", "rendered", "unknown"), ("", "ms", "ms", "ms", "/ it", "%")]
    reflections = [(result["title"], *line) for result in data["reflections"] for line in lines_of(result, {})]
    return "\n\n".join((
        "Table 1, building, one layer, 1600x896. The paper, ms of the nodes: " +
        "; ".join(f"{name}: {time}" for name, time in PAPER_BUILDS) + "\n\n" +
        table([("bumpy sphere", "nodes", "with the layers"), ("triangles", "ms", "ms")],
              [(r["title"], *ms(r["forms"][0], "nodes", "build")) for r in data["builds"]]) +
        f"\n\nspread of the nodes over their mean: {spread:.0f} % (the paper: 3)",
        "Table 2, stereo, 1600x896, eyes 6.5 cm apart, both pictures with shading; the paper's without: its living room\n\n" +
        table(head, lines_of(data["stereo"], PAPER_STEREO)),
        "Table 3, 15 to 60 frames a second, 1280x720, the mean of a walk's frames\n\n" +
        table(head, lines_of(data["upsampling"], PAPER_UPSAMPLING)),
        "Table 4, depth of field, 640x360; the paper: Sponza\n\n" + table(head, show_lens(data["lens"])),
        "Table 5, reflections in a cube round the eye, 640x360, everything a mirror.\nThe paper, ms of the cube and glossy rays: " +
        "; ".join(f"{n} {a} and {b}" for n, (a, b) in PAPER_REFLECTIONS.items()) + "\n\n" +
        table([("", *head[0]), ("", *head[1])], reflections)))
