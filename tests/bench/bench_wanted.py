# SPDX-License-Identifier: MIT
"""What is wanted of figures, held against what was measured: the rows that parts have, and the exponents of `family`."""
from bench_common import table, with_spread
from bench_rays import exponents

EXPONENT_MAX = 0.2


def row(line, wanted, measured, where, at_most=False):
    """By the median; what it misses by no more than twice its deviation may be noise, and is said to be within the spread."""
    sign = -1 if at_most else 1
    short = sign * (wanted - measured["median"])
    return {"line": line, "wanted": f"{'<=' if at_most else '>='} {wanted}", "measured": measured, "met": short <= 0,
            "within_spread": 0 < short <= 2 * measured["deviation"], "where": where}


def verdict(line):
    return "met" if line["met"] else "missed, within the spread" if line["within_spread"] else "MISSED"


def exponent_rows(results):
    for (kind, name), (slope, error) in exponents(results).items():
        if name == "bvh, traversal":
            yield row(f"bvh {kind}, exponent of time against triangles", EXPONENT_MAX, {"median": slope, "deviation": error},
                      f"{results[0]['triangles']} to {results[-1]['triangles']} triangles, ± standard error", at_most=True)


def derive(parts):
    """The part `wanted`, of whatever has been measured; None: nothing that it is made of."""
    rows = list(exponent_rows(parts.get("family", {}).get("results", [])))
    rows += [line for name, data in parts.items() if name != "wanted" for line in data.get("wanted", [])]
    return {"rows": rows} if rows else None


def show(rows):
    lines = [(r["line"], r["wanted"], with_spread(r["measured"]) if "runs" in r["measured"] else
              f"{r['measured']['median']:.3f} ± {r['measured']['deviation']:.3f}", verdict(r), r["where"]) for r in rows]
    return table([("line", "wanted", "measured", "", "where")], lines)
