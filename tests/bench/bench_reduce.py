# SPDX-License-Identifier: MIT
"""The part of the benchmark about stream reduction: what is empty is taken out of a stream by chunks, as `rayspace` does it,
by segments and by a geometry shader, as its paper does ('Whitted Ray-Tracing for Dynamic Scenes using a Ray-Space Hierarchy
on the GPU', section 4), and as Horn does, which the paper compares itself with.

`results`: of each stream `elements`, `kept`, and of each way `time_ns`, `elements_per_s`, `chunk_over` (how many times as
fast chunks are), and `chunk_over_cpu`: by the time of all processors together, which other work hardly makes longer.
"""
from bench_animated import met, run_json
from bench_common import figure, paired_ratio, significant, table, with_spread

WAYS = {"chunk": "chunks", "segments": "segments of 64", "geometry": "geometry shader", "horn": "Horn's"}
STREAMS = (1 << 22, 1 << 24)
GOALS = (("horn", 1 << 24, 12), ("geometry", 1 << 22, 4))  # chunks over it, of so many elements, at least


def measured(result):
    rows = {row["way"]: row for row in result["rows"]}
    chunk = rows["chunk"]
    return {"elements": result["elements"], "kept": result["kept"], "ways": {
        way: {"time_ns": figure(row["runs_ns"]), "elements_per_s": figure([result["elements"] / ns * 1e9 for ns in row["runs_ns"]]),
              "chunk_over": paired_ratio(row["runs_ns"], chunk["runs_ns"]),
              "chunk_over_cpu": paired_ratio(row["cpu_ns"], chunk["cpu_ns"])} for way, row in rows.items()}}


def measure(bench):
    streams = (1 << 16,) if bench.tiny else STREAMS
    return {"results": [measured(run_json(bench, "reduce", n, bench.times(7))) for n in streams]}


def show(data):
    rows, verdicts = [], []
    for result in data["results"]:
        for way, name in WAYS.items():
            one = result["ways"][way]
            rows.append((f"{result['elements'] / (1 << 20):.1f} M", name, significant(one["elements_per_s"]["median"] / 1e6),
                         *(("", "") if way == "chunk" else (with_spread(one["chunk_over"]), with_spread(one["chunk_over_cpu"])))))
        for way, elements, wanted in GOALS:
            if elements <= result["elements"] < elements + 64:
                ratio = result["ways"][way]["chunk_over"]
                verdicts.append(f"chunks over {WAYS[way]}, {elements >> 20} M elements: wanted at least {wanted}, "
                                f"measured {significant(ratio['median'])}: {met(ratio['median'] >= wanted)}")
    header = [("elements", "reduced by", "million a second", "chunks over it", "by time of processors")]
    return "\n".join([table(header, rows), "", *verdicts]).rstrip()
