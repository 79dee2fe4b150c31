# SPDX-License-Identifier: MIT
"""The tables of the part `abuffer` of the benchmark."""
from bench_abuffer import (ACCURATE_RAYS, OCTREES, PAPER_TABLE1, SEARCHES, WAVES, build_pairs, by_search, costs, faster,
                           ns_a_ray, psnr, trace_ns)
from bench_common import figure, paired_ratio, significant, table, with_spread
from bench_forms import milliseconds, ratio
from bench_reach import show as show_wanted

LOOKED_AT = ("nodes", "texels", "samples")


def show_searches(results):
    lines = []
    for result in results:
        for name, form in by_search(result["frames"]).items():
            gains = faster(result["frames"], name) if name in SEARCHES else (None, None)
            lines.append((f"{result['title']}, {result['how']}", name, with_spread(milliseconds(form["frame_ns"])),
                          with_spread(gains[0]), with_spread(milliseconds(trace_ns(form))), with_spread(gains[1]),
                          form["secondary_rays"] + form["shadow_rays"], significant(psnr(form)) if name in SEARCHES else "-"))
    header = [("picture", "search", "frame", "", "its rays", "", "rays", "PSNR"),
              ("", "", "ms", "dda / it", "ms", "dda / it", "", "dB")]
    return table(header, lines)


def show_waves(results):
    lines = []
    for result in (r for r in results if r["waves"]):
        found = by_search(result["waves"])
        for wave in found["bvh"]["waves"]:
            kind = wave["kind"]
            for name, form in found.items():
                own = next(w for w in form["waves"] if w["kind"] == kind)
                lines.append((f"{result['title']}, {kind}", name,
                              with_spread(figure([own["rays"] * 1e3 / ns for ns in own["hits_ns"]])),
                              significant(ratio(found["bvh"], form, kind)["median"]),
                              significant(ratio(found["dda"], form, kind)["median"]),
                              *(significant(own.get(what)) for what in LOOKED_AT),
                              f"{100 * (1 - own['agree']):.3f}" if "agree" in own else "-"))
    header = [("wave", "search", "Mray/s", "x bvh", "x dda", *LOOKED_AT, "differing"),
              ("", "", "", "", "", *(["a ray"] * 3), "% of the rays")]
    return table(header, lines)


def show_rays(result):
    lines = []
    for form in result["forms"]:
        trace, frame = ns_a_ray(form)
        lines.append((form["name"].rpartition("ao=")[2], form["shadow_rays"], with_spread(trace), with_spread(frame)))
    return table([("rays a pixel", "rays", "the rays alone", "whole frame"), ("", "", "ns/ray", "ns/ray")], lines)


def show_builds(results):
    lines = []
    for result in results:
        for texels, ours, plain in build_pairs(result):
            lines.append((result["title"], texels, with_spread(milliseconds(ours["build_ns"])),
                          with_spread(milliseconds(plain["build_ns"])),
                          with_spread(paired_ratio(ours["build_ns"], plain["build_ns"])), f"{ours['bytes'] / (1 << 20):.0f}"))
    header = [("scene", "texels", "build and sort", "depths alone", "ratio", "memory"), ("", "", "ms", "ms", "", "MiB")]
    return table(header, lines)


def show_table1(rows):
    lines = []
    for row in rows:
        ours = costs(row, "abuffer")
        for kind in ("abuffer", *OCTREES):
            own = costs(row, kind)
            frame = next(form for form in row["frames"]["forms"] if form["name"].startswith(kind))
            lines.append((f"{row['title']}, {row['how']}", kind,
                          *(with_spread(milliseconds(own[what])) for what in ("construction", "tracing", "others", "total")),
                          with_spread(paired_ratio(own["both"], ours["both"])), significant(psnr(frame))))
    for name, ours, octree in PAPER_TABLE1:
        for kind, cost in (("paper's", ours), ("paper's octree", octree)):
            lines.append((name, kind, *(significant(x) for x in cost), significant(sum(cost)),
                          significant(sum(cost[:2]) / sum(ours[:2])), "-"))
    header = [("scene", "", "construction", "tracing", "others", "total", "first two / abuffer", "PSNR"),
              ("", "", *(["ms"] * 4), "", "dB")]
    return table(header, lines)


def show_accuracy(results):
    lines = [(result["title"], *(significant(psnr(form)) for form in result["forms"]),
              *(significant(psnr(form) - psnr(result["forms"][0])) for form in result["forms"][1:])) for result in results]
    return table([("scene", *SEARCHES, *SEARCHES[1:]), ("", *(["PSNR, dB"] * 3), *(["to dda, dB"] * 2))], lines)


def show_voxels(result):
    lines = [(form["name"].rpartition("voxels=")[2] if "voxels=" in form["name"] else "auto",
              with_spread(milliseconds(form["frame_ns"])), with_spread(milliseconds(trace_ns(form))), significant(psnr(form)))
             for form in result["forms"]]
    return table([("voxels", "frame", "its rays", "PSNR"), ("along a side", "ms", "ms", "dB")], lines)


def show(data):
    return "\n\n".join((
        "Searches, whole pictures and their rays (figure 6): depth 3, or 8 rays of ambient occlusion a pixel. A ratio above\n"
        "1 is faster than dda.", show_searches(data["searches"]),
        f"Waves of {', '.join(WAVES)} rays by themselves; nodes are blocks of voxels.", show_waves(data["searches"]),
        f"Ambient occlusion with more rays, {data['rays']['title']}", show_rays(data["rays"]),
        "Building, beside a pass over the same triangles that keeps the nearest depths and nothing else",
        show_builds(data["builds"]),
        "Beside an octree of as many cells (table 1): svo-tiles as Crassin and Green have it, and traversed from the root in\n"
        "each step; svo-cells the same hits, with records of two levels, a stack, and fragments that know where they have\n"
        "come to; svo-planes with a plane in each leaf, as near to the surface as A-buffers are. abuffer: linear3, as in the\n"
        "paper. Others: all of the picture but its rays.",
        show_table1(data["table1"]),
        f"Ambient occlusion with {ACCURATE_RAYS} rays, beside the reference", show_accuracy(data["accuracy"]),
        f"Voxels along a side, {data['voxels']['title']}", show_voxels(data["voxels"]),
        show_wanted({"rows": data["wanted"], "gpu": []})))
