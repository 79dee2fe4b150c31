# SPDX-License-Identifier: MIT
"""The contact sheet: a row for each scene, with our picture, the others', and how ours differs from the path tracers'."""
import html
import pathlib

import numpy
import pictures

HEAD = """<!doctype html><meta charset="utf-8"><title>Fidelity</title><style>
body { font: 14px sans-serif; background: #888; color: #000 } h2 { margin: 1.5em 0 .3em } p { margin: .3em 0 }
figure { display: inline-block; margin: 0 .5em .5em 0 } img { display: block; height: 256px } .outside { color: #a00 }
</style><h1>Ours beside pictures of other renderers</h1>
"""


def lay_out(folder, name, ours, others, tracers, magnified):
    """Writes PNGs of a scene and returns a list of (caption, file name)."""
    files = [("ours", f"{name}.ours.png")]
    pictures.write(folder / files[0][1], ours)
    for renderer, picture in others.items():
        files.append((renderer, f"{name}.{renderer}.png"))
        pictures.write(folder / files[-1][1], picture)
    for renderer in tracers:
        files.append((f"ours - {renderer}", f"{name}.minus-{renderer}.png"))
        other, seen = others[renderer][..., :3], others[renderer][..., 3:] > 0
        pictures.write(folder / files[-1][1], numpy.where(seen, 0.5 + (ours - other) * magnified / 2, 0.5))
    return files


def write(path: pathlib.Path, rows, conclusion, known, magnified):
    parts = [HEAD, *(f"<p>{html.escape(line)}</p>\n" for line in conclusion),
             f"<p>Differences: grey is none; {magnified} times as large as they are, about half of white.</p>\n"]
    for row in rows:
        name = html.escape(row["scene"])
        if "failed" in row:
            parts.append(f'<h2 class="outside">{name}: failed</h2><p>{html.escape(row["failed"])}</p>\n')
            continue
        style = "" if row["within"] else ' class="outside"'
        said = "no judge"
        if row["judges"]:
            said = (f"{row['difference']:.1f} from {row['nearest']}, between the judges {row['closest']:.1f} to"
                    f" {row['spread']:.1f}")
        parts.append(f"<h2{style}>{name}: {said}</h2>\n")
        if row["scene"] in known["reasons"]:
            parts.append(f"<p>{html.escape(known['reasons'][row['scene']])}</p>\n")
        parts += [f'<figure><img src="pictures/{html.escape(file)}" alt=""><figcaption>{html.escape(caption)}'
                  "</figcaption></figure>\n" for caption, file in row["pictures"]]
    path.write_text("".join(parts))
