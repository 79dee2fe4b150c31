# SPDX-License-Identifier: MIT
"""The part `abuffer` of the benchmark: voxels and A-buffers next to what their paper has ('Ray Tracing via GPU
Rasterization'), beside `bvh`, and beside a sparse voxel octree of the same precision (tests/bench/svo). Its JSON:

  searches    the paper's figure 6: model, how (mirrors, glass, ao), `frames` and `waves`, results of `bench forms`, the waves
              None where an earlier one of the model has them: dda, linear3, linear1, bvh
  rays        result of frames: ambient occlusion with more and more rays a pixel
  builds      results of builds: the structure beside a pass for depths alone, at two resolutions
  table1      the paper's table: name, how, `builds` and `frames`: abuffer beside the octrees
  accuracy    results of frames: ambient occlusion with many rays, all searches
  voxels      result of frames: voxels along a side, in a room
  wanted      rows as in bench_reach.py

A result is what `bench forms` prints (its head says what), with "title" added. Octrees: svo-tiles is as it was published,
svo-cells the same answers faster, svo-planes nearer ones.
"""
from bench_common import KITCHEN_VIEW, figure, paired_ratio
from bench_forms import call, form_of, models, once, ratio, wave_of
from bench_reach import row

SEARCHES = ("dda", "linear3", "linear1")
USUAL = 1024  # texels along a side: a tree of ten levels
DEFAULT = 1280
OCTREES = ("svo-tiles", "svo-cells", "svo-planes")
CLOSED = [("spot 5.9K", "gltf/spot.obj"), ("dragon 101K", "gltf/chinesedragon.gltf")]
OCCLUDED = [("teapot 6.3K", "common/teapot.obj"), ("dragon 101K", "gltf/chinesedragon.gltf")]
ROOM = [("kitchen 86K", "rayspace/kitchen.obj", *KITCHEN_VIEW)]
HOW = {"mirrors": ["--mirrors", "--depth", 3], "glass": ["--glass", "--depth", 3]}
RAYS = (8, 16, 32, 64, 128, 256)
ACCURATE_RAYS = 128
GRIDS = (64, 128, 256)
WAVES = ("reflection", "refraction", "shadow", "occlusion")

# At least so many times as fast as dda, whole frames; the paper's frames a second: 69, 157, 210 and 11, 19, 27.
FASTER = {"whitted": {"linear3": 2.3, "linear1": 3.0}, "ao": {"linear3": 1.7, "linear1": 2.5}}
PAPER_FASTER = {"whitted": {"linear3": 157 / 69, "linear1": 210 / 69}, "ao": {"linear3": 19 / 11, "linear1": 27 / 11}}
EVEN_MAX, OCTREE_MIN, BESIDE_BVH = 1.1, 6, 1.5
# Passes for depths alone that a build may take: of a small model, whose pass is short, more.
BUILD_MAX, BUILD_MAX_SMALL, SMALL_TRIANGLES = 2, 4, 50_000
PSNR_MIN = {"whitted": 36, "ao": 34}
# ms of construction, tracing, others: figure 1(b) and the upper picture of figure 8, by the paper's tracer and its octree.
PAPER_TABLE1 = [("Figure 1(b)", (13.2, 11.6, 2.7), (42.8, 84.6, 3.8)), ("Figure 8 top", (10.8, 8.7, 2.6), (35.6, 79.6, 2.9))]


# ---- measuring --------------------------------------------------------------------------------------


def resolution(bench, usual=USUAL):
    return usual // 16 if bench.tiny else usual


def abuffer(texels=None, **options):
    options = {"resolution": texels, **options} if texels else options
    return "abuffer" + ":" * bool(options) + ",".join(f"{key}={value}" for key, value in options.items())


def octree(kind, texels):
    return f"{kind}:resolution={texels}"


def forms(names):
    return [argument for name in names for argument in ("--form", name)]


def size(bench, usual="512x512"):
    return ["--size", "64x64" if bench.tiny else usual]


def measure_searches(bench, left_out):
    texels = resolution(bench)
    names = forms([*(abuffer(texels, search=search) for search in SEARCHES), "bvh"])
    results, seen = [], set()
    for how, of, options in [*((how, CLOSED, options) for how, options in HOW.items()),
                             ("ao", OCCLUDED, ["--integrator", "ao", "--ao-rays", 8])]:
        kinds = "occlusion" if how == "ao" else "reflection,refraction,shadow"
        for title, model in models(bench, of, left_out):
            frames = call(bench, "frames", title, 3, *model, *options, *size(bench), *names)
            waves = None if (title, kinds) in seen else call(bench, "waves", title, 3, *model, *size(bench), "--waves", kinds,
                                                             *names)
            seen.add((title, kinds))
            results.append({"title": title, "how": how, "frames": frames, "waves": waves})
    return results


def measure_rays(bench, left_out):
    title, model = next(models(bench, OCCLUDED, left_out))
    names = forms(abuffer(resolution(bench), ao=rays) for rays in (RAYS[:2] if bench.tiny else RAYS))
    return call(bench, "frames", title, 3, *model, "--integrator", "ao", *size(bench, "192x192"), *names)


def measure_builds(bench, left_out):
    return [call(bench, "builds", title, 7, *model,
                 *forms(form for texels in (resolution(bench), resolution(bench, DEFAULT))
                        for form in (abuffer(texels), octree("plain", texels))))
            for title, model in models(bench, CLOSED, left_out)]


def measure_table1(bench, left_out):
    texels, rows = resolution(bench), []
    names = forms([abuffer(texels, search="linear3"), *(octree(kind, texels) for kind in OCTREES)])
    for (title, model), how in zip(models(bench, CLOSED, left_out), HOW):
        rows.append({"title": title, "how": how, "builds": call(bench, "builds", title, 5, *model, *names),
                     "frames": call(bench, "frames", title, 3, *model, *HOW[how], *size(bench, "800x600"), *names)})
    return rows


def measure_accuracy(bench, left_out):
    rays = 8 if bench.tiny else ACCURATE_RAYS
    names = forms(abuffer(resolution(bench) if bench.tiny else None, search=search) for search in SEARCHES)
    return [call(bench, "frames", title, 1, *model, "--integrator", "ao", "--ao-rays", rays, *size(bench, "128x128"), "--once",
                 *names)
            for title, model in models(bench, [*OCCLUDED, *ROOM], left_out)]


def measure_voxels(bench, left_out):
    title, model = next(models(bench, ROOM, left_out))
    grids = (16, 32) if bench.tiny else GRIDS
    texels = resolution(bench) if bench.tiny else None
    names = forms([*(abuffer(texels, voxels=n) for n in grids), abuffer(texels)])
    return call(bench, "frames", title, 2, *model, "--integrator", "ao", "--ao-rays", 8, *size(bench, "160x160"), *names)


def measure(bench):
    left_out = []
    data = {"searches": measure_searches(bench, left_out), "rays": measure_rays(bench, left_out)}
    data["builds"] = measure_builds(bench, left_out)
    data["table1"] = measure_table1(bench, left_out)
    data["accuracy"] = measure_accuracy(bench, left_out)
    data["voxels"] = measure_voxels(bench, left_out)
    data["left_out"] = sorted(set(left_out))
    data["wanted"] = wanted(data)
    return data


# ---- reading ----------------------------------------------------------------------------------------


def by_search(result):
    """{search: form} of one of `searches`, and bvh."""
    return {**{search: form for search in SEARCHES for form in result["forms"] if form["name"].endswith("=" + search)},
            "bvh": form_of(result, "bvh")}


def trace_ns(form):
    return form["stages_ns"]["trace"]


def faster(result, search):
    """Than dda: whole frames, and their rays alone."""
    found = by_search(result)
    return (paired_ratio(found["dda"]["frame_ns"], found[search]["frame_ns"]),
            paired_ratio(trace_ns(found["dda"]), trace_ns(found[search])))


def integrator_of(result):
    return "ao" if result["how"] == "ao" else "whitted"


def ns_a_ray(form):
    """Of frames of ambient occlusion: their rays alone, and all of the picture."""
    rays = form["shadow_rays"]
    return figure([ns / rays for ns in trace_ns(form)]), figure([ns / rays for ns in form["frame_ns"]])


def build_pairs(result):
    """(texels, A-buffers' form, plain pass's) of one of `builds`."""
    found = result["forms"]
    return [(ours["name"].partition("=")[2], ours, plain) for ours, plain in zip(found[::2], found[1::2])]


def costs(row_, kind):
    """ns of construction, tracing, others, total of the form that begins so; each run's."""
    build, frame = (next(form for form in row_[part]["forms"] if form["name"].startswith(kind)) for part in ("builds", "frames"))
    runs = list(zip(build["build_ns"], trace_ns(frame), frame["frame_ns"]))
    return {"construction": [b for b, _, _ in runs], "tracing": [t for _, t, _ in runs], "others": [f - t for _, t, f in runs],
            "total": [b + f for b, _, f in runs], "both": [b + t for b, t, _ in runs]}


# ---- what is wanted ---------------------------------------------------------------------------------


def search_rows(results):
    for result in results:
        integrator = integrator_of(result)
        for search, wanted_ in FASTER[integrator].items():
            frame, trace = faster(result["frames"], search)
            yield row(f"abuffer {integrator}, rays by {search} / by dda", wanted_, trace,
                      f"{result['title']}, {result['how']}; whole frames {frame['median']:.2f}, "
                      f"the paper's {PAPER_FASTER[integrator][search]:.2f}")


def even_row(result):
    each = [ns_a_ray(form)[0] for form in result["forms"]]
    maximum, minimum = (choose(each, key=lambda f: f["median"]) for choose in (max, min))
    share = maximum["median"] / minimum["median"]
    deviation = share * (maximum["deviation"] / maximum["median"] + minimum["deviation"] / minimum["median"])
    return row("abuffer, time an ambient-occlusion ray, maximum / minimum", EVEN_MAX, {**once(share), "deviation": deviation},
               f"{result['title']}, {len(each)} numbers of rays a pixel", at_most=True)


def build_rows(results):
    for result in results:
        maximum = BUILD_MAX_SMALL if result["triangles"] <= SMALL_TRIANGLES else BUILD_MAX
        for texels, ours, plain in build_pairs(result):
            yield row("abuffer, build / a pass for depths alone", maximum,
                      paired_ratio(ours["build_ns"], plain["build_ns"]), f"{result['title']}, {texels} texels",
                      at_most=True)


def octree_rows(rows):
    for row_ in rows:
        for kind in OCTREES:
            yield row(f"{kind}, build and trace / abuffer", OCTREE_MIN,
                      paired_ratio(costs(row_, kind)["both"], costs(row_, "abuffer")["both"]),
                      f"{row_['title']}, {row_['how']}; the paper has 5.1 and 5.9")


def beside_rows(results):
    for result in results:
        if result["how"] == "ao" and result["waves"]:
            found = by_search(result["waves"])
            for search in SEARCHES:
                yield row(f"abuffer by {search}, any-hit rays a second / bvh", BESIDE_BVH,
                          ratio(found["bvh"], found[search], "occlusion"), f"{result['title']}, ambient occlusion")


def accuracy_rows(searches, accuracy):
    for result in searches:
        if integrator_of(result) == "whitted":
            yield row("abuffer whitted by dda: PSNR of the picture, dB", PSNR_MIN["whitted"],
                      once(psnr(by_search(result["frames"])["dda"])), f"{result['title']}, {result['how']}, depth 3")
    for result in accuracy:
        yield row("abuffer ao by dda: PSNR of the picture, dB", PSNR_MIN["ao"], once(psnr(result["forms"][0])),
                  f"{result['title']}, {ACCURATE_RAYS} rays")


def psnr(form):
    """Where there is no error at all, more than any picture has."""
    return 99.0 if form["psnr_db"] is None else form["psnr_db"]


def wanted(data):
    return [*search_rows(data["searches"]), even_row(data["rays"]), *build_rows(data["builds"]), *octree_rows(data["table1"]),
            *beside_rows(data["searches"]), *accuracy_rows(data["searches"], data["accuracy"])]
