#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Renders scenes whose pictures by other renderers are known, and measures how far ours are from theirs.

fidelity.py BUILD [--samples N] [--small] [--only A,B] [--jobs N] [--out FOLDER]

Models, cameras, environments and the others' pictures are in the folder fidelity of FARLIGHT_SCENES (default:
../shared/scenes beside the checkout). All pictures are brought to one display curve. For each scene the mean absolute
difference to each path tracer is measured, in steps of 255 and over means of 4 x 4 pixels where all of them see a surface.
The spread is the difference between the two path tracers that differ most, or, if there is only one, its difference to the
nearest rasteriser. Our picture is as true as theirs if its difference to the nearest path tracer is within the spread.
A wide spread is a weak judge, so the sum names scenes that are within it although an effect is missing. Noise counts as a
difference: with fewer samples than 256 more scenes are outside, and only scenes that could not be rendered fail.
known.json lists effects that farlight does not have, and renderers that lack a scene's main effect: they do not judge it.

Writes fidelity.txt, fidelity.json and index.html, pictures side by side. A picture that the same programs
rendered with the same command is used again, so a run that was stopped continues.
Exit status: 0 all goals are reached, 1 some are not (the last lines say which), 2 wrong usage."""
import argparse
import concurrent.futures
import hashlib
import itertools
import json
import os
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "integration"))

PATH_TRACERS = ("blender-cycles", "three-gpu-pathtracer", "vray", "stellar", "dspbr-pt")
RASTERISERS = ("filament", "gltf-sample-viewer")
GAMMA = ("blender-cycles", "vray", "stellar")  # display by a power of 1 / 2.2, all others by sRGB's curve
JUDGED_SAMPLES = 256
WITHIN_SHARE = 0.8  # of the scenes: the goal
BLOCK = 4  # pixels: noise and edges count less, colour and shape as much
OPAQUE = 0.99  # the pictures' alpha is coverage
TIMEOUT_S = 3600
MAGNIFIED = 4  # differences, where they are shown


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--samples", type=int, default=256, help="per pixel (default 256)")
    parser.add_argument("--small", action="store_true",
                        help=f"pictures a {BLOCK}th as wide and high, whose pixels are what the means are compared with: "
                             "hours become minutes, and noise and edges count more")
    parser.add_argument("--only", default="", help="scenes, separated by commas")
    parser.add_argument("--jobs", type=int, default=1, help="clients at once (default 1)")
    parser.add_argument("--out", type=pathlib.Path, default=HERE.parents[1] / "out" / "fidelity")
    return parser.parse_args()


OPTIONS = arguments()
os.environ["FARLIGHT_BIN"] = str(OPTIONS.build.resolve())
import farlight_test  # pylint: disable=wrong-import-position
import numpy  # pylint: disable=wrong-import-position
import pictures  # pylint: disable=wrong-import-position
import sheet  # pylint: disable=wrong-import-position

FOLDER = farlight_test.SHARED_SCENES / "fidelity"
SCALE = BLOCK if OPTIONS.small else 1
KNOWN = json.loads((HERE / "known.json").read_text())


def programs_digest():
    """Of what a picture depends on beside its command."""
    digest = hashlib.sha256()
    for name in ("farlightd", "farlight", "farlight-import", "farlight-images.so", "farlight-textures.so"):
        digest.update((farlight_test.BIN / name).read_bytes())
    return digest.hexdigest()


def render(scene, digest):
    """The picture's path, and what went wrong or None."""
    picture = OPTIONS.out / "pictures" / f"{scene['name']}.exr"
    command = ["render", FOLDER / scene["model"], "-o", picture, "--float", "--integrator", "path", "--quiet",
               "--size", f"{-(-scene['golden_width'] // SCALE)}x{-(-scene['golden_height'] // SCALE)}", "--samples", OPTIONS.samples,
               "--fov", scene["verticalFoV"], "--environment", FOLDER / scene["lighting"]]
    command += [f"--{option}=" + ",".join(map(str, scene[key]))
                for option, key in (("eye", "eye"), ("look-at", "lookat"), ("up", "up"))]
    stamp, made_by = picture.with_suffix(".stamp"), digest + " ".join(map(str, command))
    if picture.exists() and stamp.exists() and stamp.read_text() == made_by:
        return picture, None
    stamp.unlink(missing_ok=True)
    try:
        result = farlight_test.farlight(*command, timeout=TIMEOUT_S)
    except subprocess.TimeoutExpired:
        return picture, f"no picture after {TIMEOUT_S} s"
    if result.returncode:
        return picture, (result.stderr.strip() or f"exit status {result.returncode}").splitlines()[-1]
    stamp.write_text(made_by)
    return picture, None


def known_pictures(scene, names):
    """renderer -> picture for the renderers that show what the scene is about; all in sRGB."""
    found = {}
    for name in names:
        path = FOLDER / "goldens" / scene["name"] / f"{name}.webp"
        if path.exists() and name not in KNOWN["no judges"].get(scene["name"], {}):
            found[name] = pictures.with_alpha(pictures.read(path))
            if name in GAMMA:
                found[name][..., :3] = pictures.to_srgb(found[name][..., :3] ** 2.2)
    return found


def judge(scene, picture):
    """What is said of a scene, and its pictures are laid beside each other."""
    ours = pictures.displayed(numpy.maximum(pictures.read(picture)[..., :3], 0))
    ours = ours.repeat(SCALE, 0).repeat(SCALE, 1)[:scene["golden_height"], :scene["golden_width"]]
    means = pictures.block_means(ours, BLOCK)  # of what is displayed, as the others' are
    tracers, rasterisers = known_pictures(scene, PATH_TRACERS), known_pictures(scene, RASTERISERS)
    shown = sheet.lay_out(OPTIONS.out / "pictures", scene["name"], ours, {**tracers, **rasterisers}, tracers, MAGNIFIED)
    row = {"scene": scene["name"], "judges": len(tracers), "within": False, "pictures": shown}
    if not tracers:
        return row
    small = {name: pictures.block_means(each, BLOCK) for name, each in {**tracers, **rasterisers}.items()}
    seen = numpy.all([small[name][..., 3] > OPAQUE for name in tracers], axis=0)
    away = {name: pictures.difference(means, each[..., :3], seen) for name, each in small.items()}
    if len(tracers) > 1:
        spreads = [pictures.difference(small[a][..., :3], small[b][..., :3], seen)
                   for a, b in itertools.combinations(tracers, 2)]
    else:
        only = small[next(iter(tracers))][..., :3]
        spreads = [min(pictures.difference(only, small[name][..., :3], seen) for name in rasterisers)]
    nearest = min(tracers, key=away.get)
    return row | {"nearest": nearest, "difference": away[nearest], "to": away, "spread": max(spreads),
                  "closest": min(spreads), "within": away[nearest] <= max(spreads)}


def line(row):
    if "failed" in row:
        return f"{row['scene']:28} failed: {row['failed']}"
    reason = KNOWN["reasons"].get(row["scene"], "")
    if not row["judges"]:
        return f"{row['scene']:28} {'no judge':>31}  OUTSIDE  {'-':21} {reason}".rstrip()
    return (f"{row['scene']:28} {row['difference']:6.1f}  {row['closest']:5.1f} {row['spread']:6.1f}  {row['judges']:6}   "
            f"{'within' if row['within'] else 'OUTSIDE':8} {row['nearest']:21} {reason}").rstrip()


def conclude(rows):
    """Lines of what was reached; False if a goal was not."""
    judged = [row for row in rows if "failed" not in row]
    within = [row for row in judged if row["within"]]
    unnamed = [row["scene"] for row in judged if not row["within"] and row["scene"] not in KNOWN["reasons"]]
    partly = [row["scene"] for row in within if row["scene"] in KNOWN["reasons"]]
    failed = len(rows) - len(judged)
    lines = [f"{len(rows)} scenes at {OPTIONS.samples} samples: {failed} failed (wanted: 0), {len(within)} are within the"
             f" spread of the path tracers ({100 * len(within) / len(rows):.0f} %, wanted: {100 * WITHIN_SHARE:.0f} %)"]
    if unnamed:
        lines.append("outside for no reason that known.json names: " + ", ".join(unnamed))
    if partly:
        lines.append("within, but only as the judges differ so much; something is not shown: " + ", ".join(partly))
    if OPTIONS.samples < JUDGED_SAMPLES:
        lines.append(f"their noise is a difference as well: below {JUDGED_SAMPLES} samples only scenes that fail count")
        return lines, not failed
    return lines, not failed and len(within) >= WITHIN_SHARE * len(rows) and not unnamed


def main():
    if not (FOLDER / "scenarios.json").exists():
        print(f"fidelity.py: no scenes in {FOLDER}; let FARLIGHT_SCENES name the folder that has the folder 'fidelity'",
              file=sys.stderr)
        return 2
    only = [name for name in OPTIONS.only.split(",") if name]
    scenes = [scene for scene in json.loads((FOLDER / "scenarios.json").read_text())["scenarios"]
              if (FOLDER / scene["model"]).exists() and (not only or scene["name"] in only)]
    strange = set(only) - {scene["name"] for scene in scenes}
    if strange or not scenes:
        print(f"fidelity.py: --only: no scene is called {', '.join(sorted(strange))}", file=sys.stderr)
        return 2
    (OPTIONS.out / "pictures").mkdir(parents=True, exist_ok=True)
    digest, rows = programs_digest(), []
    lines = [f"{'scene':28} {'ours':>6}  {'between them':>12}  {'judges':6}           nearest path tracer"]
    print(lines[0], flush=True)
    with farlight_test.Daemon() as daemon, concurrent.futures.ThreadPoolExecutor(OPTIONS.jobs) as clients:
        os.environ["FARLIGHT_SERVER"] = daemon.address
        for scene, (picture, failed) in zip(scenes, clients.map(lambda each: render(each, digest), scenes)):
            rows.append({"scene": scene["name"], "failed": failed} if failed else judge(scene, picture))
            lines.append(line(rows[-1]))
            print(lines[-1], flush=True)
    last, reached = conclude(rows)
    print("\n" + "\n".join(last))
    (OPTIONS.out / "fidelity.txt").write_text("\n".join([*lines, "", *last]) + "\n")
    (OPTIONS.out / "fidelity.json").write_text(json.dumps({"samples": OPTIONS.samples, "scenes": rows}, indent=1))
    sheet.write(OPTIONS.out / "index.html", rows, last, KNOWN, MAGNIFIED)
    print(f"pictures side by side: {OPTIONS.out / 'index.html'}")
    return 0 if reached else 1


if __name__ == "__main__":
    sys.exit(main())
