# SPDX-License-Identifier: MIT
"""The part `sampled` of the benchmark: in a few minutes, what tracers that sample surfaces cost beside `bvh` on the same waves,
from rays to hits with surfaces, and how far their answers are from the reference's. Its JSON:

  ldc        results of `bench forms` waves: ldc, bvh
  abuffer    likewise: every search of abuffer, those of the paper too, and bvh

A result is what `bench forms` prints (its head says what), with "title" added.
"""
from bench_common import significant, table, with_spread
from bench_forms import call, form_of, models, ratio, wave_of

SIZE = "256x256"
CELLS = 1024
SCENES = [("teapot 6K", "common/teapot.obj"), ("dragon 48K", "common/dragon-47k.glb"), ("bunny 69K", "common/bunny-69k.obj"),
          ("balls 7K", "bvh/spd-balls-4.nff"), ("dragon 871K", "common/dragon-871k.glb")]
CLOSED = [("dragon 101K", "gltf/chinesedragon.gltf")]
SEARCHES = ("dda", "linear3", "linear1", "voxels3", "voxels1", "parity3", "parity1")
WAVES = ("reflection", "bounce", "shadow")


def waves(bench, title, model, kinds, names):
    forms = [argument for name in (*names, "bvh") for argument in ("--form", name)]
    return call(bench, "waves", title, 3, *model, "--size", "64x64" if bench.tiny else SIZE, "--waves", ",".join(kinds), *forms)


def measure(bench):
    left_out, cells = [], CELLS // 16 if bench.tiny else CELLS
    data = {"ldc": [waves(bench, title, model, WAVES, [f"ldc:resolution={cells}"]) for title, model in
                    models(bench, SCENES, left_out)],
            "abuffer": [waves(bench, title, model, ("reflection", "shadow"),
                              [f"abuffer:resolution={cells},search={search}" for search in SEARCHES])
                        for title, model in models(bench, CLOSED, left_out)]}
    return {**data, "left_out": sorted(set(left_out))}


def share(wave, what):
    return significant(100 * wave[what]) if what in wave else "-"


def rows_of(result, kinds):
    """Of each form: how many times as fast as bvh each wave is, and of the first wave how far its answers are."""
    bvh = form_of(result, "bvh")
    for form in result["forms"]:
        if form is not bvh:
            first = wave_of(form, kinds[0])
            agree = f"{100 * first['agree']:.2f}" if "agree" in first else "-"
            yield (result["title"], form["name"].rpartition("search=")[2],
                   *(with_spread(ratio(bvh, form, kind)) for kind in kinds), agree, share(first, "far"), share(first, "normals"))


def show_rows(results, kinds):
    header = [("scene", "form", *kinds, "agree", "far", "normals"), ("", "", *["x bvh"] * len(kinds), "%", "%", "%")]
    return table(header, [row for result in results for row in rows_of(result, kinds)])


def show(data):
    return "\n\n".join((
        f"Layered depth cubes at {CELLS} cells, {SIZE}. 'Agree': of the reflections both hit, or both miss; 'far': more than 0.0001\n"
        "of the diagonal from the reference's hit; 'normals': near it, but of another surface.",
        show_rows(data["ldc"], WAVES),
        f"The searches of A-buffers at {CELLS} texels; voxels and parity are the paper's own forms.",
        show_rows(data["abuffer"], ("reflection", "shadow"))))
