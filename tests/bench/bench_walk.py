# SPDX-License-Identifier: MIT
"""The part `walk` of the benchmark: the walk of the part `warp` without a link, whose pictures come seldom and late by the
clock alone; what is made of each of them until the next one has come, in every way, beside true pictures of where the camera
is by then. Its JSON is the result of `bench walk` (bench_walk.c). PSNR and shares are exact; times are of the processor, one run."""
from bench_animated import run_json
from bench_common import bundled, figure, significant, table

PARTS = ("round it", "aside", "nearer", "looks round")
SAME_DB = 100  # of pictures without a difference, in place of an infinite one
NAMES = {"as it is": "as it is", "rotation": "rotation alone", "splat, both ways": "splats", "mesh": "mesh",
         "iterative": "iterative, client", "quadtree, client": "tree, client"}


def measure(bench):
    arguments = ["--size", "160x96", "--seconds", 2] if bench.tiny else []
    return run_json(bench, "walk", "--model", bundled(bench, "carousel.glb"), *arguments)


def psnr_of(method, chosen):
    """Of the pictures that are chosen, by number."""
    return [SAME_DB if method["psnr_db"][i] is None else method["psnr_db"][i] for i in chosen]


def middle(values):
    return significant(figure(values)["median"]) if values else "-"


def show_methods(data, methods):
    all_of_them = range(len(data["at_s"]))
    parts = [[i for i in all_of_them if data["part"][i] == number] for number in range(len(PARTS))]
    rows = [(NAMES[m["name"]], m["layers"], middle(psnr_of(m, all_of_them)), significant(min(psnr_of(m, all_of_them))),
             *(middle(psnr_of(m, part)) for part in parts), f"{100 * figure(m['unseen'])['median']:.1f}",
             f"{100 * max(m['unseen']):.1f}", middle([ns / 1e6 for ns in m["cpu_ns"]]),
             middle([ns / 1e6 for ns in m["build_ns"]]) if any(m["build_ns"]) else "-") for m in methods]
    return table([("", "layers", "PSNR", "lowest", *PARTS, "unseen", "most", "a picture", "a key"),
                  ("", "", "dB", "dB", *["dB"] * len(PARTS), "%", "%", "CPU ms", "CPU ms")], rows)


def show_over(title, keys, data, methods):
    """PSNR, and what is unseen by the tree, against what `keys` has for each picture."""
    tree = next(m for m in methods if m["name"] == "quadtree, client")
    rows = []
    for key in sorted(set(keys)):
        chosen = [i for i, k in enumerate(keys) if k == key]
        rows.append((key, *(middle(psnr_of(m, chosen)) for m in methods),
                     f"{100 * figure([tree['unseen'][i] for i in chosen])['median']:.1f}"))
    return table([(title, *(NAMES[m["name"]] for m in methods), "unseen"), ("", *["dB"] * len(methods), "%")], rows)


def show(data):
    methods = [next(m for m in data["methods"] if m["name"] == name) for name in NAMES]
    seconds = [int(at) for at in data["at_s"]]
    ages = [round(age / 50) * 50 for age in data["age_ms"]]
    return (f"The carousel, at rest, at {data['width']}x{data['height']}: a walk of {data['seconds']} s, of which {data['keys_per_s']} pictures a "
            f"second are rendered and are there {data['round_trip_ms']} ms later,\neach of where the camera is expected by then, with a tenth more "
            f"at each edge and with what an eye may see past edges. {len(seconds)} of\nthe pictures between them, beside true renders of where the "
            "camera is. All is made of the same pictures and depths.\n\n" + show_methods(data, methods) +
            "\n\nOver the time of the walk, medians; unseen: by the tree\n\n" + show_over("second", seconds, data, methods) +
            "\n\nBy the age of the picture that views are made of, since it was asked for\n\n" + show_over("ms", ages, data, methods))
