#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`make bench-plot`: the scaling curves of out/bench.json as SVG and PNG. Usage: bench_plot.py BUILD_FOLDER [--out FOLDER]

time-triangles, time-pixels, time-rays and build-triangles, drawn by gnuplot with both axes logarithmic; bars are the median
absolute deviation. What the curves are made of is measured first where the JSON does not have it.
"""
import argparse
import pathlib
import subprocess
import sys
import tempfile

import bench
from bench_common import Bench, Failure, figure, fit_exponent
from bench_rays import CURVES, curve

# One colour a contender, told apart without colour vision too (Okabe and Ito 2008); one dash and mark a kind of ray.
COLOURS = {"bvh, traversal": "#0072b2", "bvh, hits": "#56b4e9", "reference, hits": "#009e73"}
KINDS = {"primary": (1, 7), "occlusion": (1, 7), "bounce": (2, 9)}  # gnuplot's dash and point types
SIZES = {"svg": "svg size 1100,560 dynamic enhanced font 'DejaVu Sans,14' background '#ffffff'",
         "png": "pngcairo size 1650,840 enhanced font 'DejaVu Sans,18' background '#ffffff'"}


def named(name, letter, values):
    """The line's name with the exponent that fits it."""
    fit = fit_exponent([(at, y) for at, y, _ in values])
    return name + (f"  ({letter}^{{{fit[0]:.2f}}})" if fit else "")


def time_lines(results, kinds, x, letter, per_ray):
    """[(title, colour, dash, mark, [(x, y, deviation)])], times in ms a wave or in ns a ray."""
    for which in CURVES:
        for kind in kinds:
            points = curve(results, kind, which, x)
            rays = {x(result): next(w["rays"] for w in result["waves"] if w["kind"] == kind) for result in results
                    if any(w["kind"] == kind for w in result["waves"])}
            if not points:
                continue
            scale = {at: 1 if per_ray else rays[at] / 1e6 for at, _ in points}
            values = [(at, y["median"] * scale[at], y["deviation"] * scale[at]) for at, y in points]
            yield named(f"{kind}: {which[0]}", letter, values), COLOURS[which[0]], *KINDS[kind], values


def build_lines(results):
    names = {"bvh": ("bvh", "#0072b2"), "reference": ("reference", "#009e73")}
    for tracer, (name, colour) in names.items():
        values = []
        for result in results:
            for structure in result["structures"]:
                if structure["tracer"] == tracer:
                    build = figure([ns / 1e6 for ns in structure["build"]["runs_ns"]])
                    values.append((result["triangles"], build["median"], build["deviation"]))
        if values:
            yield named(name, "n", values), colour, 1, 7, values


def script(title, x_label, y_label, x_ticks, lines, terminal, path):
    """The text that gnuplot reads, data included."""
    text = [f"set terminal {terminal}", f"set output '{path}'", f"set title {quoted(title)}", "set logscale xy",
            f"set xlabel '{x_label}'", f"set ylabel '{y_label}'", "set grid xtics ytics lc rgb '#dddddd' lt 1",
            "set border 3 lc rgb '#555555'", "set tics nomirror", "set bars 0.5",
            "set key outside right center vertical Left reverse samplen 3 spacing 1.3 width -4",
            f"set xrange [{x_ticks[0][0] / 1.2:g}:{x_ticks[-1][0] * 1.2:g}]"]
    text.append("set xtics (" + ", ".join(f"'{label}' {at}" for at, label in x_ticks) + ")")
    low = min(y for line in lines for _, y, _ in line[4])
    high = max(y for line in lines for _, y, _ in line[4])
    text.append(f"set yrange [{low / 1.5:g}:{high * 1.5:g}]")
    text.append("set ytics (" + ", ".join(f"'{label}' {at:g}" for at, label in decimal_ticks(low / 1.5, high * 1.5)) + ")")
    for number, line in enumerate(lines):
        rows = "\n".join(f"{at} {y} {max(y - d, y * 0.01)} {y + d}" for at, y, d in line[4])
        text.append(f"$data{number} << EOD\n{rows}\nEOD")
    text.append("plot " + ", \\\n     ".join(
        f"$data{number} using 1:2:3:4 with yerrorlines lc rgb '{colour}' dt {dash} lw 2 pt {mark} ps 1 title {quoted(name)}"
        for number, (name, colour, dash, mark, _) in enumerate(lines)))
    return "\n".join(text) + "\n"


def quoted(text):
    return "'" + text.replace("'", "''") + "'"


def decimal_ticks(low, high):
    """1, 2 and 5 times the powers of ten within the range."""
    ticks = []
    for power in range(-6, 10):
        for step in (1, 2, 5):
            at = step * 10.0 ** power
            if low <= at <= high:
                ticks.append((at, f"{at:g}"))
    return ticks


def count_text(count):
    """1K, 64K, 1M of about so many."""
    for limit, suffix in ((1e6, "M"), (1e3, "K")):
        if count >= 0.95 * limit:
            value = count / limit
            return f"{value:.1f}".removesuffix(".0") + suffix if value < 10 else f"{value:.0f}{suffix}"
    return str(count)


def plots(document):
    """(file name, title, x label, y label, x ticks, lines)."""
    parts, device = document["parts"], document["environment"]["device"]
    family, pixels, rays = (parts[name]["results"] for name in ("family", "pixels", "rays"))

    def triangles(result):
        return result["triangles"]

    def area(result):
        return result["width"] * result["height"]

    def each(result):
        return result["rays_per_pixel"]

    across = [(triangles(r), count_text(triangles(r))) for r in family]
    yield ("time-triangles", f"Time against triangles: bumpy spheres, {family[0]['width']}x{family[0]['height']}, {device}",
           "triangles", "nanoseconds a ray", across, list(time_lines(family, ("primary", "bounce"), triangles, "n", True)))
    yield ("build-triangles", f"Build against triangles: bumpy spheres, {device}", "triangles",
           "milliseconds to build and upload", across, list(build_lines(family)))
    yield ("time-pixels", f"Time against pixels: {pixels[0]['title'].partition(',')[0]}, {device}", "pixels",
           "milliseconds a wave", [(area(r), f"{r['width']}x{r['height']}") for r in pixels],
           list(time_lines(pixels, ("primary", "bounce"), area, "p", False)))
    yield ("time-rays", f"Time against rays per pixel: {rays[0]['title'].partition(',')[0]}, "
           f"{rays[0]['width']}x{rays[0]['height']}, {device}", "rays per pixel", "milliseconds a wave",
           [(each(r), str(each(r))) for r in rays], list(time_lines(rays, ("occlusion", "bounce"), each, "r", False)))


def draw(document, out):
    """Writes the pictures; returns their paths."""
    paths = []
    for name, title, x_label, y_label, ticks, lines in plots(document):
        for suffix, terminal in SIZES.items():
            path = out / f"{name}.{suffix}"
            with tempfile.NamedTemporaryFile("w", suffix=".gp") as file:
                file.write(script(title, x_label, y_label, ticks, lines, terminal, path))
                file.flush()
                result = subprocess.run(["gnuplot", file.name], stderr=subprocess.PIPE, text=True, check=False)
            if result.returncode != 0 or not path.is_file():
                raise Failure(f"gnuplot: {result.stderr.strip()}")
            paths.append(path)
    return paths


def main():
    parser = argparse.ArgumentParser(description="Draws the scaling curves; see the head of this file.")
    parser.add_argument("build", help="folder with the programs, build/release")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out"), help="where bench.json is, and the plots go")
    arguments = parser.parse_args()
    document = bench.load(arguments.out / "bench.json")
    needed = [name for name in ("family", "pixels", "rays") if not document or name not in document["parts"]]
    faults = bench.run(Bench(arguments.build), needed, arguments.out) if needed else []
    try:
        document = bench.load(arguments.out / "bench.json")
        missing = [name for name in ("family", "pixels", "rays") if not document or name not in document["parts"]]
        if missing:
            raise Failure("not measured: " + ", ".join(missing))
        for path in draw(document, arguments.out):
            print(path)
    except Failure as failure:
        faults.append(str(failure))
    for fault in faults:
        print(f"bench-plot: {fault}", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
