# SPDX-License-Identifier: MIT
"""What is wanted, held against what was measured: derived from the parts `reach`, `family`, `tracers`, `distributed`,
`view`, `warp`, `ldc`, `abuffer`, `rayspace` and `quadtree`."""
from bench_common import significant, table, with_spread
from bench_frames import distributed_row
from bench_rays import CURVES, exponents, find_measure, find_wave, times_as_fast

RAY_BYTES = 32
SMALL, MIDDLE = 40000, 150000
PACKET_MIN = 0.95
EXPONENT_MAX = 0.2


def row(line, wanted, measured, where, at_most=False):
    """By the median; what it misses by no more than twice its deviation may be noise, and is said to be within the spread."""
    sign = -1 if at_most else 1
    short = sign * (wanted - measured["median"])
    return {"line": line, "wanted": f"{'<=' if at_most else '>='} {wanted}", "measured": measured, "met": short <= 0,
            "within_spread": 0 < short <= 2 * measured["deviation"], "where": where}


def verdict(line):
    return "met" if line["met"] else "missed, within the spread" if line["within_spread"] else "MISSED"


def beside_embree(result, kind, wanted):
    wave = find_wave(result, kind)
    embree = find_measure(wave, "embree", "1 a call", "raw")
    traversal = times_as_fast(find_measure(wave, "bvh", "auto", "traversal"), embree)
    hits = times_as_fast(find_measure(wave, "bvh", "auto", "interface"), embree)
    if traversal is None:
        return None
    return row(f"bvh {kind}, the traversal / rtcIntersect1", wanted, traversal,
               f"{result['triangles']} triangles; with surfaces {significant(hits['median'])}")


def packet_rows(results):
    """One for each kind of wave: the scene in which choosing pays least."""
    for kind in ("primary", "shadow", "reflection", "occlusion", "bounce", "shuffled"):
        worst = None
        for result in results:
            wave = find_wave(result, kind)
            ratio = times_as_fast(find_measure(wave, "bvh", "auto", "traversal"), find_measure(wave, "bvh", "1 ray", "traversal"))
            if ratio and (worst is None or ratio["median"] < worst[0]["median"]):
                worst = ratio, result["title"], wave["order"]
        if worst:
            yield row(f"bvh {kind} ({worst[2]}), packets as chosen / 1 ray", PACKET_MIN, worst[0],
                      f"worst of {len(results)} scenes: {worst[1]}")


def exponent_rows(results):
    for (kind, name), (slope, error) in exponents(results).items():
        if name == CURVES[0][0]:
            yield row(f"bvh {kind}, exponent of time against triangles", EXPONENT_MAX,
                      {"median": slope, "deviation": error},
                      f"{results[0]['triangles']} to {results[-1]['triangles']} triangles, ± standard error", at_most=True)


def bandwidth_rows(results):
    """Where a GPU traces. A lower bound: the structure once, the rays, the answers; not what was read again and again."""
    for result in results:
        copy = result["environment"].get("copy_bytes_per_s")
        structure = next((s for s in result["structures"] if (s["tracer"], s["form"]) == ("bvh", "auto")), None)
        for wave in result["waves"] if copy and structure else []:
            measure = find_measure(wave, "bvh", "auto", "interface")
            moved = structure["memory_bytes"] + wave["rays"] * (RAY_BYTES + wave["answer_bytes"])
            share = moved / (measure["time"]["median_ns"] / 1e9) / copy
            yield {"scene": result["title"], "wave": wave["kind"], "rays_per_s": measure["rays_per_s"],
                   "bandwidth_share": share, "copy_bytes_per_s": copy}


def derive(parts):
    """The part `wanted`, of whatever has been measured; None: nothing that it is made of."""
    reach = parts.get("reach", {}).get("results", [])
    family = parts.get("family", {}).get("results", [])
    scenes = reach + parts.get("tracers", {}).get("results", [])
    rows = []
    for result in reach:
        if result["triangles"] <= SMALL:
            rows.append(beside_embree(result, "primary", 1.0))
        elif result["triangles"] <= MIDDLE:
            rows += [beside_embree(result, "primary", 0.8), beside_embree(result, "bounce", 0.33)]
    rows += list(packet_rows(scenes)) + list(exponent_rows(family))
    if "distributed" in parts:
        line, wanted, measured, where = distributed_row(parts["distributed"])
        rows.append(row(line, wanted, measured, where, at_most=True))
    rows = [r for r in rows if r] + [r for part in ("view", "deadline", "warp", "ldc", "abuffer", "rayspace", "quadtree") for r in parts.get(part, {}).get("wanted", [])]
    if not rows:
        return None
    return {"rows": rows, "gpu": list(bandwidth_rows(scenes))}


def show(data):
    rows = [(r["line"], r["wanted"], with_spread(r["measured"]) if "runs" in r["measured"] else
             f"{r['measured']['median']:.3f} ± {r['measured']['deviation']:.3f}", verdict(r), r["where"])
            for r in data["rows"]]
    text = table([("line", "wanted", "measured", "", "where")], rows)
    if data["gpu"]:
        text += ("\n\nOn this GPU; the share of its bandwidth is a lower bound: structure once, rays and answers, against a "
                 "copy on the device\n\n" +
                 table([("scene", "wave", "Mray/s", "share of bandwidth")],
                       [(r["scene"], r["wave"], significant(r["rays_per_s"] / 1e6), f"{100 * r['bandwidth_share']:.1f} %")
                        for r in data["gpu"]]))
    return text
