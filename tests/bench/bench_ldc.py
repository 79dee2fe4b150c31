# SPDX-License-Identifier: MIT
"""The part `ldc` of the benchmark: layered depth cubes next to what their paper has ('GPU Rendering of Secondary Effects'),
beside `bvh` and `reference`, and in their variants. Its JSON:

  table1     the paper's table: name, instead (what stands for the paper's model), `builds` and `frames`, results of `bench forms`
  scenes     results of `bench forms` waves: bvh, and ldc at 512, 1024 and 2048
  pictures   how, and results of `bench forms` frames of the meshes that accuracy is wanted of: ldc at 512, 1024 and 2048
  family     results of `bench forms` waves over triangles, at one resolution
  depths     results of `bench forms` samples: peeling and lists, at depth complexities and of models
  variants   what, and results of `bench forms` waves: levels, images, layers at once, packets, tolerance
  wanted     rows as in bench_reach.py

A result is what `bench forms` prints (its head says what), with "title" added.
"""
from bench_common import figure, paired_ratio
from bench_forms import call, form_of, models, once, ratio, wave_of, wave_size
from bench_reach import row

RESOLUTIONS = (512, 1024, 2048)
USUAL = 1024
PEEL, LISTS = "peel", "lists"
# Rows of the paper's table 1: triangles; ms of building (A) and of ray tracing with the picture (B) at 512 and at 1024 on a
# GeForce 8800 GTX; layers. Then what is rendered here: file below FARLIGHT_SCENES, else generated.
PAPER = [
    ("bunny", 8192, ((7, 61), (19, 115)), 8, "rayspace/bunny-5187.glb", ["--family", 8192], []),
    ("car", 20264, ((9, 82), (25, 250)), 12, "ldc/legocar.obj", "teapot.glb", []),
    ("dragon", 120000, ((12, 205), (31, 441)), 7, "gltf/chinesedragon.gltf", ["--family", 120000], []),
    ("bust", 300000, ((19, 160), (53, 346)), 6, "ldc/igea-bust.glb", ["--family", 300000], []),
    ("skinned figure", 1628, ((5, 44), (16, 95)), 6, "ldc/CesiumMan.glb", "carousel.glb", ["--play"]),
]
# What accuracy is wanted of: closed meshes.
CLOSED = [("bunny 69K", "common/bunny-69k.obj"), ("dragon 47K", "common/dragon-47k.glb"), ("teapot", "common/teapot.obj")]
# What is held against bvh; at least one in each hundred thousand.
LARGE = [("dragon 101K", "gltf/chinesedragon.gltf"), ("dragon 202K", "common/dragon-202k.glb"),
         ("bust 269K", "ldc/igea-bust.glb"), ("dragon 871K", "common/dragon-871k.glb")]
FAMILY = (8000, 19000, 44000, 104000, 300000)
LARGE_MIN = 100000
PEEL_WANTED = {8: 6, 48: 40}
GROWTH_MAX, FAMILY_MAX, BESIDE_BVH = 1.4, 2, 1
DISAGREE_MAX, ERROR_MAX, PSNR_MIN = 1, 0.25, 38
ACCURACY_WAVES = ("reflection", "bounce")
# Pictures: as the model is, and as in the paper; what mirrors multiply is shown, and nothing is wanted of it.
PICTURES = {"as it is, depth 8": ["--depth", 8], "mirrors, depth 1": ["--mirrors"],
            "mirrors, depth 4": ["--mirrors", "--depth", 4]}
WANTED_PICTURES = tuple(PICTURES)[:2]


# ---- measuring --------------------------------------------------------------------------------------


def ldc(resolution=USUAL, **options):
    return ["--form", "ldc:" + ",".join(f"{key}={value}" for key, value in {"resolution": resolution, **options}.items())]


def resolutions(bench):
    return tuple(n // 16 for n in RESOLUTIONS) if bench.tiny else RESOLUTIONS


def forms_of(bench, names=RESOLUTIONS):
    return [argument for n, real in zip(RESOLUTIONS, resolutions(bench)) if n in names for argument in ldc(real)]


def paper_rows(bench):
    """(paper's row, what stands for it, arguments that name it)"""
    for paper in PAPER[:1] + PAPER[-1:] if bench.tiny else PAPER:
        _, _, _, _, name, generated, _ = paper
        path = bench.shared / name
        if path.is_file() and not bench.tiny:
            yield paper, name, ["--model", path]
        elif isinstance(generated, str):
            yield paper, f"{generated} (bundled)", ["--model", bench.scenes / generated]
        else:
            yield paper, "generated", ["--family", 1000] if bench.tiny else generated


def measure_table1(bench):
    size = "64x64" if bench.tiny else "1280x1024"
    rows = []
    for (name, *_, options), instead, model in paper_rows(bench):
        forms = forms_of(bench, (512, 1024))
        frames = call(bench, "frames", name, 5, *model, "--mirrors", *options, "--size", size, *forms, "--form", "bvh")
        builds = None if options else call(bench, "builds", name, 7, *model, *forms)
        rows.append({"name": name, "instead": instead, "frames": frames, "builds": builds})
    return rows


def measure_scenes(bench, left_out):
    closed, large = dict(models(bench, CLOSED, left_out)), dict(models(bench, LARGE, left_out))
    large["family 147K"] = ["--family", 1000 if bench.tiny else 147000]
    return [call(bench, "waves", title, 5, *model, "--size", wave_size(bench), "--waves", "reflection,bounce,shadow",
                 *forms_of(bench, RESOLUTIONS if title in closed else (512, 1024)), "--form", "bvh")
            for title, model in {**large, **closed}.items()]


def measure_pictures(bench, left_out):
    size = "64x64" if bench.tiny else "640x480"
    return [{"how": how, **call(bench, "frames", title, 1, *model, *options, "--size", size, *forms_of(bench))}
            for title, model in models(bench, CLOSED, left_out) for how, options in PICTURES.items()]


def measure_family(bench):
    """There and back, as a machine may grow slower meanwhile."""
    sizes = (500, 1000) if bench.tiny else FAMILY
    results = {}
    for n in [*sizes, *(() if bench.runs == 1 else reversed(sizes))]:
        got = call(bench, "waves", f"family {n}", 3, "--family", n, "--size", wave_size(bench), "--waves", "reflection",
                   *forms_of(bench, (USUAL,)), "--form", "bvh")
        if n not in results:
            results[n] = got
            continue
        for form, more in zip(results[n]["forms"], got["forms"]):
            for key in ("hits_ns", "traversal_ns"):
                form["waves"][0][key] += more["waves"][0][key]
    return list(results.values())


def measure_depths(bench, left_out):
    resolution = 64 if bench.tiny else 512
    both = [*ldc(resolution, build=PEEL), *ldc(resolution, build=LISTS)]
    results = [{"depth": depth, **call(bench, "samples", f"{depth} sheets", 3, "--sheets", depth, *both)}
               for depth in PEEL_WANTED]
    both = both if bench.tiny else [*ldc(build=PEEL), *ldc(build=LISTS)]
    for title, model in models(bench, [*CLOSED, *LARGE, ("car", "ldc/legocar.obj"), ("tree", "ldc/oaktree.gltf")], left_out):
        results.append(call(bench, "samples", title, 3, *model, *both))
    return results


def variants(resolution, cell):
    """{what is varied: [forms' options]}; `cell` in metres. The first of each is compared with."""
    pyramid = {"levels": "pyramid"}
    return {"levels": [{"levels": "cells"}, pyramid, *({"levels": "blocks", "block": n} for n in (8, 32))],
            "images": [{"images": "overlap"}, {"images": "one"}],
            "layers of a texel at once": [{**pyramid, "layers": 1}, {**pyramid, "layers": 4}],
            "packets": [{"rays": 1}, {"rays": 4}],
            "packets, pyramid": [{**pyramid, "rays": 1}, {**pyramid, "rays": 4}],
            "hit, pyramid": [pyramid, {"tolerance": f"{cell:.6g}"}, {"tolerance": f"{cell / 2:.6g}"}]}


def measure_variants(bench, scenes):
    """On two of the scenes, which have said how large a cell is. Few rays, as some variants are slow."""
    size = "64x64" if bench.tiny else "256x256"
    results = []
    for scene in scenes[:1] if bench.tiny else scenes[:1] + scenes[-1:]:
        resolution = resolutions(bench)[RESOLUTIONS.index(USUAL)]
        cell = form_of(scene, resolution)["structure"]["static/cell"]
        model = ["--family", 1000 if bench.tiny else 147000] if scene["scene"] == "family" else ["--model", scene["scene"]]
        for what, options in variants(resolution, cell).items():
            forms = [argument for each in options for argument in ldc(resolution, **each)]
            results.append({"what": what, **call(bench, "waves", scene["title"], 5, *model, "--size", size, "--waves",
                                                 "reflection,bounce", *forms)})
    return results


def measure(bench):
    left_out = []
    data = {"table1": measure_table1(bench), "scenes": measure_scenes(bench, left_out)}
    data["pictures"] = measure_pictures(bench, left_out)
    data["family"] = measure_family(bench)
    data["depths"] = measure_depths(bench, left_out)
    data["variants"] = measure_variants(bench, data["scenes"])
    data["left_out"] = sorted(set(left_out))
    data["wanted"] = wanted(data)
    for result in data["depths"]:
        if not same_samples(result):
            bench.faults.append(f"{result['title']}: peeling and lists do not make the same samples")
    return data


# ---- reading ----------------------------------------------------------------------------------------


def at(result, usual):
    """Likewise of one of RESOLUTIONS, also in a tiny run."""
    return form_of(result, usual) or form_of(result, usual // 16)


def error_cells(form, wave, which="error_median"):
    cell = form["structure"].get("static/cell")
    return wave[which] / cell if which in wave and cell else None


def same_samples(result):
    """What of it the figures tell; the tests compare the samples themselves."""
    facts = [form["structure"] for form in result["forms"]]
    return all(fact == facts[0] for fact in facts)


def after_build_ms(form):
    """The picture without the structure."""
    return figure([(whole - build) / 1e6 for whole, build in zip(form["frame_ns"], form["build_ns"])])


# ---- what is wanted ---------------------------------------------------------------------------------


def depth_rows(results):
    for result in results:
        if "depth" in result:
            peel, lists = result["forms"]
            yield row(f"ldc build, peeling / one pass, {result['depth']} layers", PEEL_WANTED[result["depth"]],
                      paired_ratio(peel["build_ns"], lists["build_ns"]),
                      f"{peel['structure']['static/resolution']} cells, "
                      f"{peel['structure']['static/samples'] / 1e6:.1f} M samples")


def growth_row(results):
    worst = max(results, key=lambda r: ratio(at(r, 1024), at(r, 512), "reflection")["median"])
    return row("ldc reflection, time at 1024 / at 512", GROWTH_MAX, ratio(at(worst, 1024), at(worst, 512), "reflection"),
               f"worst of {len(results)} scenes: {worst['title']}; the paper 1.9 to 3.0", at_most=True)


def family_row(results):
    each = [figure([ns / wave_of(at(r, USUAL), "reflection")["rays"] for ns in wave_of(at(r, USUAL), "reflection")["hits_ns"]])
            for r in results]
    maximum, minimum = (choose(each, key=lambda f: f["median"]) for choose in (max, min))
    share = maximum["median"] / minimum["median"]
    deviation = share * (maximum["deviation"] / maximum["median"] + minimum["deviation"] / minimum["median"])
    return row("ldc reflection, maximum time a ray / minimum over triangles", FAMILY_MAX,
               {**once(share), "deviation": deviation}, f"{results[0]['triangles']} to {results[-1]['triangles']} triangles",
               at_most=True)


def beside_rows(results):
    for result in results:
        if result["triangles"] >= LARGE_MIN:
            yield row(f"ldc at {USUAL}, reflection, rate / bvh", BESIDE_BVH,
                      ratio(form_of(result, "bvh"), at(result, USUAL), "reflection"),
                      f"{result['title']}, {result['triangles']} triangles")


def accuracy_rows(scenes, pictures):
    closed = [title for title, _ in CLOSED] + ["teapot (bundled)"]
    for result in (r for r in scenes if r["title"] in closed):
        form = at(result, USUAL)
        for kind in ACCURACY_WAVES:
            wave = wave_of(form, kind)
            error = error_cells(form, wave)
            yield row(f"ldc at {USUAL}, {kind}: % of the rays that only one hits with", DISAGREE_MAX,
                      once(100 * (1 - wave["agree"])), result["title"], at_most=True)
            if error is not None:
                yield row(f"ldc at {USUAL}, {kind}: median distance error, cells", ERROR_MAX, once(error),
                          result["title"], at_most=True)
    for result in (r for r in pictures if r["how"] in WANTED_PICTURES):
        psnr = at(result, USUAL)["psnr_db"]
        yield row(f"ldc at {USUAL}: PSNR of the picture, dB", PSNR_MIN, once(99.0 if psnr is None else psnr),
                  f"{result['title']}, {result['how']}")


def wanted(data):
    return [*depth_rows(data["depths"]), growth_row(data["scenes"]), family_row(data["family"]), *beside_rows(data["scenes"]),
            *accuracy_rows(data["scenes"], data["pictures"])]
