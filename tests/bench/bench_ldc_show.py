# SPDX-License-Identifier: MIT
"""The tables of the part `ldc` of the benchmark."""
from bench_common import figure, paired_ratio, significant, table, with_spread
from bench_forms import form_of, milliseconds, ratio, wave_of
from bench_ldc import ACCURACY_WAVES, PAPER, PICTURES, USUAL, after_build_ms, at, error_cells, same_samples
from bench_reach import show as show_wanted

LOOKED_AT = ("nodes", "texels", "samples")  # cells in place of texels, where nodes are of cells


def show_table1(rows):
    """Ours beside the paper's; A builds, B is all the rest of the picture, of which tracing is a part."""
    lines = []
    for got in rows:
        name, triangles, paper, paper_layers, *_ = next(row for row in PAPER if row[0] == got["name"])
        forms = [at(got["frames"], n) for n in (512, 1024)]
        builds = [at(got["builds"], n)["build_ns"] if got["builds"] else form["build_ns"]
                  for n, form in zip((512, 1024), forms)]
        a = [milliseconds(runs) for runs in builds]
        b = [after_build_ms(form) for form in forms]
        trace = [milliseconds(form["stages_ns"]["trace"]) for form in forms]
        needed = max(forms[1]["structure"].get(f"{part}/layers_needed", 0) for part in ("static", "dynamic"))
        cells = [f"{with_spread(a[i])} | {with_spread(b[i])} | {significant(trace[i]['median'])}" for i in range(2)]
        growth = " ".join(significant(x[1]["median"] / x[0]["median"]) for x in (a, b, trace))
        lines.append((name, got["instead"], got["frames"]["triangles"], needed, *cells, growth,
                      significant(after_build_ms(form_of(got["frames"], "bvh"))["median"])))
        lines.append(("  paper", "", triangles, paper_layers, *(f"{pa} | {pb} | -" for pa, pb in paper),
                      " ".join(significant(paper[1][i] / paper[0][i]) for i in range(2)) + " -", "-"))
    header = [("scene", "here", "triangles", "layers", "512: A | B | trace", "1024: A | B | trace", "1024 / 512", "bvh, B"),
              ("", "", "", "needed", "ms", "ms", "A B trace", "ms")]
    return table(header, lines)


def show_scenes(results):
    lines = []
    for result in results:
        bvh = form_of(result, "bvh")
        for form in result["forms"]:
            if form is bvh:
                continue
            said = form["structure"]
            waves = []
            for kind in ("reflection", "bounce", "shadow"):
                rays = wave_of(form, kind)["rays"]
                waves += [with_spread(figure([rays * 1e3 / ns for ns in wave_of(form, kind)["hits_ns"]])),
                          significant(ratio(bvh, form, kind)["median"])]
            looked = wave_of(form, "reflection")
            lines.append((result["title"], result["triangles"], said["static/resolution"], said["static/layers_needed"],
                          f"{said['static/samples'] / 1e6:.2f}", f"{form['bytes'] / (1 << 20):.0f}", *waves,
                          *(significant(looked[what]) for what in LOOKED_AT)))
    header = [("scene", "triangles", "cells", "layers", "samples", "memory", "reflection", "/ bvh", "bounce", "/ bvh",
               "shadow", "/ bvh", *(["reflection"] * 3)),
              ("", "", "", "", "M", "MiB", *(["Mray/s", "x"] * 3), *(f"{what}/ray" for what in LOOKED_AT))]
    return table(header, lines)


def show_accuracy(scenes, pictures):
    closed = {(result["title"], result["how"]): result for result in pictures}
    lines = []
    for result in scenes:
        for i, form in enumerate(form for form in result["forms"] if "static/cell" in form["structure"]):
            cells = []
            for kind in ACCURACY_WAVES:
                wave = wave_of(form, kind)
                cells += [f"{100 * wave['agree']:.3f}", *(significant(error_cells(form, wave, which)) for which in
                                                          ("error_median", "error_p99")),
                          *(significant(100 * wave[what]) for what in ("far", "normals"))]
            same = [closed.get((result["title"], how)) for how in PICTURES]
            lines.append((result["title"], form["structure"]["static/resolution"], *cells,
                          *(significant(picture["forms"][i]["psnr_db"] if picture else None) for picture in same)))
    header = [("scene", "cells", *(["reflection"] * 5), *(["bounce"] * 5), *PICTURES),
              ("", "", *(["agree %", "error, cells", "of 99 %", "far %", "normals %"] * 2), *(["PSNR, dB"] * len(PICTURES)))]
    return table(header, lines)


def show_family(results):
    lines = []
    for result in results:
        for name, form in (("ldc", at(result, USUAL)), ("bvh", form_of(result, "bvh"))):
            wave = wave_of(form, "reflection")
            lines.append((result["triangles"], name,
                          *(with_spread(figure([ns / wave["rays"] for ns in wave[key]])) for key in ("hits_ns", "traversal_ns"))))
    return table([("triangles", "tracer", "reflection", "the traversal alone"), ("", "", "ns/ray", "ns/ray")], lines)


def show_depths(results):
    lines = []
    for result in results:
        peel, lists = result["forms"]
        said = lists["structure"]
        faster = paired_ratio(peel["build_ns"], lists["build_ns"])
        lines.append((result["title"], result["triangles"], said["static/resolution"], said["static/layers_needed"],
                      f"{said['static/samples'] / 1e6:.2f}", with_spread(milliseconds(peel["build_ns"])),
                      with_spread(milliseconds(lists["build_ns"])), with_spread(faster),
                      "one pass" if faster["median"] > 1 else "peeling", "yes" if same_samples(result) else "NO"))
    header = [("scene", "triangles", "cells", "layers", "samples", "peeling", "one pass", "peeling", "the faster", "same"),
              ("", "", "", "", "M", "ms", "ms", "/ one pass", "", "samples")]
    return table(header, lines)


def show_variants(results):
    lines = []
    for result in results:
        for form in result["forms"]:
            name = form["name"].partition(",")[2]
            cells = []
            for kind in ACCURACY_WAVES:
                wave = wave_of(form, kind)
                cells += [with_spread(figure([wave["rays"] * 1e3 / ns for ns in wave["hits_ns"]])),
                          significant(ratio(result["forms"][0], form, kind)["median"]), f"{100 * wave['agree']:.3f}",
                          significant(error_cells(form, wave)), " ".join(significant(wave[what]) for what in LOOKED_AT)]
            lines.append((result["title"], result["what"], name, *cells))
    header = [("scene", "what", "form", *(["reflection"] * 5), *(["bounce"] * 5)),
              ("", "", "", *(["Mray/s", "x first", "agree %", "error, cells", "looked at / ray"] * 2))]
    return table(header, lines)


def show(data):
    return "\n\n".join((
        "The paper's table 1: 1280x1024, everything a mirror, one bounce. A: building; B: the rest of the picture, of which\n"
        "'trace' is the waves alone. The paper's on a GeForce 8800 GTX. The figure plays a clip; its cube is built each frame.",
        show_table1(data["table1"]),
        "Rays to hits, surfaces included, from where the camera's rays hit; beside bvh on the same waves",
        show_scenes(data["scenes"]),
        "How far answers are from the reference's: share of the rays that hit with both or miss with both, and errors of\n"
        "distance in cells where both hit; 'far': both hit, more than 0.0001 of the diagonal apart; 'normals': near, but another surface. Pictures by the Whitted integrator: as the model is, and all of it a mirror.",
        show_accuracy(data["scenes"], data["pictures"]),
        f"Time against triangles at {USUAL}", show_family(data["family"]),
        "Peeling, as the paper builds, both targets with each layer, and one pass with lists: from triangles to samples, without\n"
        "what leads over emptiness. Each sample's surface is found where its targets are written: by peeling in every layer for\n"
        "all fragments that are not rejected, by lists once.",
        show_depths(data["depths"]),
        f"Variants at {USUAL}", show_variants(data["variants"]),
        show_wanted({"rows": data["wanted"], "gpu": []})))
