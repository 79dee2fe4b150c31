#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Noise over time beside Blender's Cycles, on processors: how long each renderer takes to the same noise.

equal_time.py BUILD [--samples N] [--only A,B] [--size WxH] [--option OPTION].. [--denoise] [--out FOLDER]

Each renderer renders five scenes without clamps or denoiser, with N and 4 N samples and with 64 N, which is its own truth:
neither renderer's truth is the other's, as Cycles sees materials as Blender's importers make them. Noise is the mean squared
error of luminance relative to the square of the truth's; the truth's own noise is subtracted. Time is processor time, so
other work on the machine counts little; loading, building trees and compiling cancel out in the difference of both renders.
A power of time through both points gives the time at which each renderer reaches the noise that Cycles has at 4 N samples.
--option adds an option of `farlight render`, such as --option=--tracer=reference. --denoise also measures the error of a
denoised picture of N samples, and compares its time with that of Cycles to the same error without a denoiser.

Blender comes from the Debian package of that name. Writes equal-time.txt and equal-time.json, and the pictures.
Exit status: 0 measured, 1 a renderer failed, 2 wrong usage."""
import argparse
import json
import math
import os
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "integration"))

GOAL, GOAL_DENOISED = 1.5, 0.25  # times Cycles' time to its noise
DEPTH = 8  # bounces in Cycles
TRUTH = 64  # times the fewest samples
OUTLIERS = 1000  # one pixel of so many, the worst, is left out: else single bright ones would decide
ROOM_FOV = 58.7  # 90 degrees across 16:9
TIMEOUT_S = 7200

OPTIONS = argparse.ArgumentParser(description=__doc__.splitlines()[0])
OPTIONS.add_argument("build", type=pathlib.Path)
OPTIONS.add_argument("--samples", type=int, default=8, help="the fewest (default 8)")
OPTIONS.add_argument("--only", default="", help="scenes, separated by commas")
OPTIONS.add_argument("--size", default="320x180")
OPTIONS.add_argument("--option", action="append", default=[], help="one more of farlight render")
OPTIONS.add_argument("--denoise", action="store_true", help="measure denoised pictures as well")
OPTIONS.add_argument("--out", type=pathlib.Path, default=HERE.parents[1] / "out" / "equal-time")
OPTIONS = OPTIONS.parse_args()
os.environ["FARLIGHT_BIN"] = str(OPTIONS.build.resolve())
import farlight_test  # pylint: disable=wrong-import-position
import numpy  # pylint: disable=wrong-import-position
import pictures  # pylint: disable=wrong-import-position

SHARED = farlight_test.SHARED_SCENES


def scenes():
    """name -> job as cycles.py has it; environment None: only what the model has."""
    bundled, fidelity = farlight_test.bundled_scenes(), SHARED / "fidelity"
    vase = next(scene for scene in json.loads((fidelity / "scenarios.json").read_text())["scenarios"]
                if scene["name"] == "GlassVaseFlowers")
    rows = {
        "kitchen": (SHARED / "rayspace/kitchen.obj", (7.634, -4.168, 1.422), (12.037, 4.713, 0.107), (0, 0, 1), ROOM_FOV,
                    None),
        "classroom": (SHARED / "screenspace/classroom.obj", (-6.079, 0.764, -0.244), (3.862, -0.288, -0.498), (0, 0, 1),
                      ROOM_FOV, None),
        "cornell": (SHARED / "gltf/CornellBox.glb", (-278, 274, 700), (-278, 274, -280), (0, 1, 0), 40, None),
        "glass": (fidelity / vase["model"], vase["eye"], vase["lookat"], vase["up"], 20, fidelity / vase["lighting"]),
        "carousel": (bundled / "carousel.glb", (0.5, 3, 8.8), (0.052, 0.915, 0), (0, 1, 0), 31.51, bundled / "sky.hdr"),
    }
    keys = ("model", "eye", "look_at", "up", "fov", "environment")
    return {name: dict(zip(keys, map(lambda value: str(value) if isinstance(value, pathlib.Path) else value, row)))
            for name, row in rows.items()}


def samples():
    return OPTIONS.samples, 4 * OPTIONS.samples, TRUTH * OPTIONS.samples


def cycles(name, job):
    """Seconds and picture for each number of samples."""
    outputs = [OPTIONS.out / f"{name}.cycles-{count}.exr" for count in samples()]
    job = {**job, "size": list(map(int, OPTIONS.size.split("x"))), "depth": DEPTH,
           "renders": [{"samples": count, "seed": seed, "output": str(output)}
                       for seed, (count, output) in enumerate(zip(samples(), outputs))]}
    path = OPTIONS.out / f"{name}.job.json"
    path.write_text(json.dumps(job))
    result = subprocess.run(["blender", "--background", "--factory-startup", "--python-exit-code", "1", "--python",
                             HERE / "cycles.py", "--", path], capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    times = [float(line.split()[2]) for line in result.stdout.splitlines() if line.startswith("CPU_S")]
    if result.returncode or len(times) != 3:
        raise RuntimeError(f"blender: {(result.stderr.strip() or result.stdout.strip()).splitlines()[-1]}")
    return [(count, time, pictures.read(output)) for count, time, output in zip(samples(), times, outputs)]


def cpu_s(process):
    """Processor time of a process and its threads."""
    fields = pathlib.Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def ours(daemon, name, job, counts, options=()):
    """The same of farlight; the daemon's time, of which programs are compiled before."""
    environment, depth = job["environment"], DEPTH
    if not environment:  # only emissive surfaces, which ours does not ask for light at the last hit
        environment, depth = OPTIONS.out / "black.exr", DEPTH + 1
        pictures.write(environment, numpy.zeros((2, 4, 3)))

    def render(count, seed, output):
        command = ["render", job["model"], "-o", output, "--float", "--quiet", "--integrator", "path", "--depth", depth,
                   "--filter", "box", "--size", OPTIONS.size, "--samples", count, "--seed", seed, "--fov", job["fov"],
                   "--environment", environment, *OPTIONS.option, *options]
        command += [f"--{key.replace('_', '-')}=" + ",".join(map(str, job[key])) for key in ("eye", "look_at", "up")]
        before = cpu_s(daemon.workers()[0])
        result = farlight_test.farlight(*command, timeout=TIMEOUT_S)
        if result.returncode:
            raise RuntimeError(f"farlight: {result.stderr.strip().splitlines()[-1]}")
        return count, cpu_s(daemon.workers()[0]) - before, pictures.read(output)

    render(1, 0, OPTIONS.out / "warm.exr")
    return [render(count, seed, OPTIONS.out / f"{name}.ours{''.join(options)}-{count}.exr")
            for seed, count in enumerate(counts)]


def error(picture, truth, count, outliers):
    """Of a picture of so many samples, without what the truth's noise adds: relative mean squared error of luminance, with the
    0.01 of Rousselle et al. (2011, section 5) against division by nothing."""
    one, other = picture[..., :3] @ pictures.LUMINANCE, truth[..., :3] @ pictures.LUMINANCE
    errors = numpy.sort(((one - other) ** 2 / (other ** 2 + 0.01)).ravel())
    kept = errors[:len(errors) - (len(errors) // OUTLIERS if outliers else 0)]
    return float(kept.mean()) * samples()[2] / (samples()[2] + count)


def curve(renders, outliers):
    """((seconds, error) at N, at 4 N); seconds without what does not grow with samples."""
    (few, few_s, one), (many, _, two), (most, most_s, truth) = renders
    a_sample_s = (most_s - few_s) / (most - few)
    return [(a_sample_s * count, error(picture, truth, count, outliers)) for count, picture in ((few, one), (many, two))]


def seconds_to(points, wanted):
    """Through both points, as a power of time."""
    (few_s, few), (many_s, many) = points
    slope = math.log(many / few) / math.log(many_s / few_s)
    return few_s * (wanted / few) ** (1 / slope), slope


def measure(daemon, name, job):
    theirs, mine = cycles(name, job), ours(daemon, name, job, samples())
    row = {"scene": name}
    for key, outliers in (("ratio", True), ("ratio_all", False)):
        their_points, my_points = curve(theirs, outliers), curve(mine, outliers)
        wanted = their_points[1][1]
        time, slope = seconds_to(my_points, wanted)
        row[key] = time / their_points[1][0]
        if outliers:
            row |= {"cycles": their_points, "ours": my_points, "slope": slope,
                    "cycles_slope": seconds_to(their_points, wanted)[1]}
    row["mean"] = float((mine[2][2][..., :3] @ pictures.LUMINANCE).mean())
    row["cycles_mean"] = float((theirs[2][2][..., :3] @ pictures.LUMINANCE).mean())
    if OPTIONS.denoise:
        count, time, picture = ours(daemon, name, job, samples()[:1], ["--denoise"])[0]
        left, fixed_s = error(picture, mine[2][2], count, True), mine[0][1] - row["ours"][0][0]
        row["denoised"] = {"seconds": time - fixed_s, "error": left,
                           "ratio": (time - fixed_s) / seconds_to(row["cycles"], left)[0]}
    return row


def line(row):
    (mine_few_s, mine_few), (_, mine_many) = row["ours"]
    (few_s, few), (_, many) = row["cycles"]
    text = (f"{row['scene']:10} {1000 * mine_few_s / samples()[0]:8.1f} {1000 * few_s / samples()[0]:8.1f}   "
            f"{mine_few:8.5f} {few:8.5f}   {mine_many:8.5f} {many:8.5f}   {row['slope']:5.2f} {row['cycles_slope']:5.2f}   "
            f"{row['mean']:6.3f} {row['cycles_mean']:6.3f}   {row['ratio']:6.2f} {row['ratio_all']:6.2f}  "
            f"{'met' if row['ratio'] <= GOAL else 'MISSED':6}")
    if "denoised" in row:
        text += f"   {row['denoised']['ratio']:6.3f}  {'met' if row['denoised']['ratio'] <= GOAL_DENOISED else 'MISSED'}"
    return text


def main():
    if not SHARED.is_dir():
        print(f"equal_time.py: no models in {SHARED}; let FARLIGHT_SCENES name their folder", file=sys.stderr)
        return 2
    OPTIONS.out.mkdir(parents=True, exist_ok=True)
    few, many, most = samples()
    lines = [f"{OPTIONS.size}, {few} and {many} samples, truths {most}; each pair: ours, Cycles; wanted: at most {GOAL}"
             + (f", denoised {GOAL_DENOISED}" if OPTIONS.denoise else "")
             + (f"; ours with {' '.join(OPTIONS.option)}" if OPTIONS.option else ""),
             f"{'scene':10} {'CPU ms a sample':>17}   {f'error at {few}':>17}   {f'error at {many}':>17}   {'slope':>11}   "
             f"{'mean':>13}   time / Cycles'; all pixels" + ("   denoised" if OPTIONS.denoise else "")]
    print("\n".join(lines), flush=True)
    rows, failed = [], 0
    with farlight_test.Daemon() as daemon:
        os.environ["FARLIGHT_SERVER"] = daemon.address
        for name, job in scenes().items():
            if OPTIONS.only and name not in OPTIONS.only.split(","):
                continue
            try:
                rows.append(measure(daemon, name, job))
                lines.append(line(rows[-1]))
            except (RuntimeError, OSError) as fault:
                failed += 1
                lines.append(f"{name:10} failed: {fault}")
            print(lines[-1], flush=True)
    (OPTIONS.out / "equal-time.txt").write_text("\n".join(lines) + "\n")
    measured = {"size": OPTIONS.size, "samples": samples(), "scenes": rows}
    (OPTIONS.out / "equal-time.json").write_text(json.dumps(measured, indent=1))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
