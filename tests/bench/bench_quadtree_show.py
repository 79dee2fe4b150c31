# SPDX-License-Identifier: MIT
"""Tables of the part `quadtree`, the paper's figures beside ours: its times on a GeForce GTX 980 at 1600x900, ours of processors, so
that ratios say more."""
from bench_common import figure, significant, table, with_spread
from bench_quadtree import build_ns, form_of, stereo_ns, upsampled
from bench_reach import show as show_wanted

# Scene, triangles, ms.
PAPER_BUILDS = (("Sponza", "227K", 0.646), ("living room", "456K", 0.636), ("San Miguel", "6550K", 0.657))
# Of the living room: ms of an eye and of the whole, million rays a second.
PAPER_STEREO = {"mesh": (1.37, 3.53, None), "minmax": (3.85, 8.5, 373.78), "dda 1": (5.77, 12.33, 249.28),
                "dda 2": (7.80, 17.01, 184.60), "quadtree 1": (1.49, 4.35, 980.9), "quadtree 2": (1.7, 5.45, 850.5)}
# Of the living room: ms of a frame that is made, and of one of four in the mean.
PAPER_UPSAMPLING = {"mesh": (1.4, 1.25), "minmax": (2.2, 1.84), "dda": (1.53, 1.5), "one": (0.89, 0.86), "two": (1.03, 1.13)}
# Of Sponza, one colour sample a ray: ms and million rays a second, by rays a pixel.
PAPER_LENS = {"dda": {4: (6.56, 876.97), 8: (9.34, 1233.4)}, "one": {4: (2.8, 2055.67), 8: (5.32, 2167.05)},
              "two": {4: (3.21, 1792.72), 8: (5.85, 1967.21)}}
# Rays, samples of each, bounces: ms of the cube map and of reflections with one layer, then with two.
PAPER_REFLECTIONS = {"1/8/1": (2.38, 1.974, 5.15, 4.91), "3/8/1": (2.39, 6.96, 5.20, 13.5), "3/4/3": (2.33, 10.25, 5.19, 22.96),
                     "3/8/3": (2.35, 12.38, 5.27, 24.75)}
NAMES = {"one": "1 layer", "two": "2 layers", "three": "3 layers", "adaptive": "adaptive, 2 layers", "minmax": "minmax, 2 layers",
         "dda": "dda, 2 layers", "stack": "with a stack, 2 layers", "primitives": "hits on primitives, 2 layers"}


def ms(times):
    return with_spread(figure([ns / 1e6 for ns in times])) if times else "-"


def mrays(rays, times):
    return significant(1e3 * rays / figure(times)["median"])


def number(value, form="{:.2f}"):
    return "-" if value is None else form.format(value)


def percent(share):
    return f"{100 * share:.2f}"


def agrees(result, contender):
    return percent(contender["agree"] / max(contender["known"], 1)), percent(contender["unknown"] / result["rays"])


def show_builds(data):
    lines = []
    for result in data["builds"]:
        ours = form_of(result, "quadtree")
        lines.append((f"family, {result['triangles']}", ms(ours["nodes_ns"]), ms(ours["draw_ns"]), ms(ours["update_ns"]),
                      ms(ours["trace_ns"])))
    paper = ", ".join(f"{name} ({triangles}) {time}" for name, triangles, time in PAPER_BUILDS)
    return (f"Building, one layer, {data['builds'][0]['width']}x{data['builds'][0]['height']}. The paper, ms of the nodes: {paper}.\n\n" +
            table([("triangles", "nodes, ms", "drawing, ms", "all, ms", "rays of a view, ms")], lines))


def stereo_line(title, paper, result, contender):
    return (title, number(paper[0]), number(paper[1]), number(paper[2]), ms(build_ns(contender)), ms(contender["eye_ns"]),
            ms(contender["trace_ns"]), ms(stereo_ns(contender)), mrays(result["rays"], contender["eye_ns"]), number(contender["steps"]),
            *agrees(result, contender))


def show_stereo(data):
    mesh = form_of(data["mesh"]["moves"][0], "mesh")
    lines = [("mesh", *map(number, PAPER_STEREO["mesh"]), "-", ms(mesh["cpu_ns"]), "-", ms([2 * ns for ns in mesh["cpu_ns"]]), "-", "-", "-",
              percent(mesh["unseen"]))]
    for layers, result in enumerate(data["stereo"], 1):
        for name in ("minmax", "dda", "quadtree"):
            paper = PAPER_STEREO.get(f"{name} {layers}", PAPER_STEREO.get(name) if layers == 1 else None) or (None, None, None)
            lines.append(stereo_line(f"{name}, {result['title']}", paper, result, form_of(result, name)))
    result = data["stereo"][0]
    lines += [stereo_line(name, (None, None, None), result, form_of(result, name)) for name in ("bvh", "reference")]
    return (f"Stereo, {result['width']}x{result['height']}: an eye 6.5 cm aside, without shading: from the camera to its hits, and rays "
            "alone, made before, the long way; all: building and two eyes. The paper: its living room.\n\n" +
            table([("", "paper:", "all,", "M rays", "building,", "an eye,", "rays,", "all,", "M rays", "steps", "known:", "unknown,"),
                   ("", "an eye, ms", "ms", "/ s", "ms", "ms", "ms", "ms", "/ s", "a ray", "right, %", "%")], lines))


def show_layers(data):
    result = data["layers"]
    lines = []
    for name in ("one", "two", "three", "adaptive", "stack", "primitives"):
        contender = form_of(result, name)
        lines.append((NAMES[name], ms(contender["update_ns"]), ms(contender["trace_ns"]), number(contender["steps"]),
                      number(contender["layers"]), *agrees(result, contender)))
    return table([("the same rays", "building, ms", "an eye, ms", "steps a ray", "layers a ray", "known: right, %", "unknown, %")], lines)


def show_upsampling(data):
    lines = []
    for name in ("one", "two", "minmax", "dda"):
        for move in data["upsampling"]["moves"]:
            form = form_of(move, name)
            amortised = [(cold + 3 * warm) / 4 for cold, warm in zip(form["cold_ns"], form["warm_ns"])]
            paper = PAPER_UPSAMPLING[name] if move is data["upsampling"]["moves"][0] else (None, None)
            lines.append((NAMES[name], move["name"], *map(number, paper), ms(move["rendered_ns"]), ms(form["warm_ns"]), ms(amortised),
                          with_spread(figure(upsampled(move, name))), number(form["psnr_db"]), percent(form["unseen"])))
    mesh = PAPER_UPSAMPLING["mesh"]
    return (f"15 to 60 frames a second, whole frames of a walk. The paper: its living room; a mesh {mesh[0]} and {mesh[1]} ms; its dda and "
            "minmax as here have two layers and one.\n\n" +
            table([("", "ahead, m", "paper:", "in the", "rendered,", "made,", "in the", "frames a second", "PSNR,", "unseen,"),
                   ("", "", "made, ms", "mean, ms", "ms", "ms", "mean, ms", "/ rendered", "dB", "%")], lines))


def show_lens(data):
    lines = []
    for result in data["lens"]:
        move = result["moves"][0]
        rays = result["width"] * result["height"] * result["samples"]
        for name in ("dda", "one", "two"):
            form = form_of(move, name)
            paper = PAPER_LENS[name].get(result["samples"], (None, None))
            lines.append((NAMES[name], result["samples"], *map(number, paper), ms(form["cold_ns"]), ms(form["warm_ns"]),
                          mrays(rays, form["warm_ns"]), ms(move["rendered_ns"]), number(form["psnr_db"]), number(move["psnr_db"]),
                          percent(form["unseen"])))
    size = f"{data['lens'][0]['width']}x{data['lens'][0]['height']}"
    return (f"Depth of field, whole frames, {size}; one colour sample a ray. The paper: Sponza.\n\n" +
            table([("", "rays", "paper:", "M rays", "first", "next", "M rays", "rendered,", "PSNR,", "rendered,", "unseen,"),
                   ("", "a pixel", "ms", "/ s", "frame, ms", "frame, ms", "/ s", "ms", "dB", "dB", "%")], lines))


def show_reflections(data):
    lines = []
    for result in data["reflections"]:
        for name in ("one", "two", "bvh", "reference"):
            contender = form_of(result, name)
            lines.append((result["title"] if name == "one" else "", NAMES.get(name, name), result["rays"], ms(contender["update_ns"]),
                          ms(contender["trace_ns"]), mrays(result["rays"], contender["trace_ns"]), number(contender["steps"]),
                          *agrees(result, contender)))
    paper = "; ".join(f"{how} {a} and {b}, {c} and {d}" for how, (a, b, c, d) in PAPER_REFLECTIONS.items())
    return ("Reflections in a cube of the eye, everything a mirror. The paper, ms of building and of reflections with one layer, then with "
            f"two, by rays/samples/bounces: {paper}.\n\n" +
            table([("", "", "rays", "building, ms", "rays, ms", "M rays / s", "steps a ray", "known: right, %", "unknown, %")], lines))


def picture_lines(warps, eyes):
    lines = [(f"eye moved by {eyes['name']} m", "a rendered frame", "", "", "", ms(eyes["rendered_ns"]))]
    for method in warps["methods"]:
        lines.append(("", method["name"], number(method["psnr_db"]), number(method["seen_psnr_db"]), percent(method["unseen"]),
                      ms(method["cpu_ns"])))
    for form in eyes["forms"]:
        lines.append(("", f"quadtree, {NAMES[form['name']]}", number(form["psnr_db"]), number(form["seen_psnr_db"]),
                      percent(form["unseen"]), ms(form["warm_ns"])))
    return lines


def show_pictures(data):
    lines = [line for warps, eyes in zip(data["warps"]["moves"], data["eyes"]["moves"]) for line in picture_lines(warps, eyes)]
    size = f"{data['eyes']['width']}x{data['eyes']['height']}"
    return (f"Pictures of other eyes, {size}, beside rendered ones. Warps take one layer, and one thread; the splat that the goals are held against closes cracks along rows. Frames by quadtree: all of a frame, from a key "
            "view that is there.\n\n" +
            table([("", "", "PSNR, dB", "of what is seen", "unseen, %", "ms")], lines))


def show(data):
    return "\n\n".join(part(data) for part in (show_builds, show_stereo, show_layers, show_upsampling, show_lens, show_reflections,
                                               show_pictures)) + "\n\nWhat is wanted\n\n" + show_wanted({"rows": data["wanted"], "gpu": []})
