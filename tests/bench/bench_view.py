# SPDX-License-Identifier: MIT
"""The part `view` of the benchmark: what somebody waits for who looks at a view while its camera moves. Its JSON:

  rates      scene, encoding; figures over the runs: frames_per_s, ms of the stages render, encode and send, and share, of
             the frames that the slowest stage alone would allow
  latencies  where ("alone", "beside a batch"), stages (how many times a frame's stages it is held against), frames, and
             p50_ms and p99_ms: from the camera sent to the frame decoded, beyond the stages of that frame; `late_p99_ms`,
             by how much a sleep of the client ends late, which is what the machine does to each that waits; and `way`, the
             medians of its parts
  processor  ms of a processor that the daemon's network thread takes a frame
  viewers    count, frames of each in seconds, and slowest, the share of the mean that the slowest viewer has
  links      kbit_per_s, encoding, frames_per_s, render_per_s (what its rendering allows of those asked for), mbit_per_s, delay_ms of the
             first and of the last third (from the camera sent to the frame decoded, beyond its stages), scale (of the
             width, the mean); or `why` there is no such link here. Nothing is wanted of the narrower one: it is full also
             where rendering is slow
  load       processes that wanted to run, a minute's mean, before and after
  wanted     rows as in bench_wanted.py

Stages are those that the frame names, by the daemon's clock: the renderer's, encode and send, and decoding; not queue, which
is waiting. What others do on the machine meanwhile is in all times; shares are of one run.
"""
import json
import os
import pathlib
import statistics
import subprocess
import tempfile

from bench_client import Daemon
from bench_common import Failure, bundled, command, figure, say, shared, significant, table, with_spread
from bench_wanted import row

SHARE_MIN = 0.95
P50_MS_MAX, P99_MS_MAX = 2, 6
PROCESSOR_MS_MAX = 0.3
SLOWEST_MIN = 0.5
LINK_KBIT_PER_S, LINK_DELAY_MS, LINK_BUFFER_KIB = 10000, 50, 128
NARROW_KBIT_PER_S = 1000
LINK_FRAMES_PER_S = 20
LINK_ASKED_PER_S = 30
DELAY_GROWS_MAX = 1.1
NO_LINK, NO_ENCODER = 125, "no encoder"
SMALL = ["--size", "320x240"]
WAY = ("to the daemon", "taken up", "rendered, beyond its stages", "to the encoder", "queue", "to the client")


# ---- one run ----------------------------------------------------------------------------------------


def frames_of(told):
    """Those that were measured, as dictionaries."""
    frames = [dict(zip(told["columns"], values)) for values in told["frames"]]
    if len(frames) < 2:
        raise Failure("a view came to less than two frames; there is nothing to measure")
    return frames


def watch(bench, daemon, model, *options):
    return json.loads(command(*bench.form("view"), daemon.address, *model, "--pid", daemon.workers()[0],
                              *options))


def can_h264(bench, daemon, model):
    try:
        watch(bench, daemon, model, "--size", "64x64", "--seconds", "0.1", "--encoding", "h264")
    except Failure as failure:
        if NO_ENCODER in str(failure):
            return False
        raise
    return True


def stage_ns(frame, stage):
    return frame["stages" if stage == "render" else stage]


def rate_of(frames):
    """Of the frames after the first: how many a second, and what each stage took of the time."""
    span_ns = frames[-1]["whole"] - frames[0]["whole"]
    stages = {stage: sum(stage_ns(frame, stage) for frame in frames[1:]) for stage in ("render", "encode", "send")}
    count = len(frames) - 1
    return {"frames_per_s": count * 1e9 / span_ns, "share": max(stages.values()) / span_ns,
            "ms": {stage: ns / count / 1e6 for stage, ns in stages.items()}}


def beyond_stages_ms(frame, times=1):
    stages = sum(frame[key] for key in ("stages", "encode", "send", "decode"))
    return (frame["whole"] - frame["sent"] - times * stages) / 1e6


def percentile(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]


def way_ms(frame):
    encoded = frame["applied"] + frame["encode_begin"] + frame["encode"]
    ns = (frame["received"] - frame["sent"], frame["applied"] - frame["received"],
          frame["rendered"] - frame["applied"] - frame["stages"], frame["applied"] + frame["encode_begin"] - frame["rendered"],
          frame["queue"], frame["whole"] - encoded - frame["queue"] - frame["decode"])
    return [value / 1e6 for value in ns]


# ---- measures ---------------------------------------------------------------------------------------


def models(bench, left_out):
    sky = ["--environment", bundled(bench, "sky.hdr")]
    yield "teapot (bundled)", [bundled(bench, "teapot.glb"), *sky]
    if bench.tiny:
        return
    yield "cornell (bundled)", [bundled(bench, "cornell.glb")]
    for title, path, options in shared(bench, [("dragon 47K", "common/dragon-47k.glb", sky),
                                               ("bunny 69K", "common/bunny-69k.obj", sky)], left_out):
        yield title, [path, *options]


def measure_rates(bench, daemon, scenes, encodings):
    rows = []
    size = ["--size", "64x64", "--seconds", "3"] if bench.tiny else ["--size", "1280x720", "--seconds", "8"]
    for title, model in scenes:
        for encoding in encodings:
            say(f"  {title}, {encoding}")
            runs = [rate_of(frames_of(watch(bench, daemon, model, *size, "--encoding", encoding)))
                    for _ in range(bench.times(3))]
            rows.append({"scene": title, "encoding": encoding,
                         **{key: figure([run[key] for run in runs]) for key in ("frames_per_s", "share")},
                         "ms": {stage: figure([run["ms"][stage] for run in runs]) for stage in runs[0]["ms"]}})
    return rows


def measure_latency(bench, daemon, model, where, times, *options):
    say(f"  latency, {where}")
    runs, way = {"p50_ms": [], "p99_ms": [], "late_p99_ms": []}, []
    count = 0
    for _ in range(bench.times(3)):
        told = watch(bench, daemon, model, *SMALL, "--seconds", 3 if bench.tiny else 20, *options)
        frames = frames_of(told)
        beyond = [beyond_stages_ms(frame, times) for frame in frames]
        runs["p50_ms"].append(percentile(beyond, 0.5))
        runs["p99_ms"].append(percentile(beyond, 0.99))
        runs["late_p99_ms"].append(percentile([ns / 1e6 for ns in told["late_ns"]] or [0], 0.99))
        way += [way_ms(frame) for frame in frames]
        count += len(frames)
    return {"where": where, "stages": times, "frames": count, **{key: figure(values) for key, values in runs.items()},
            "way": {name: statistics.median(parts) for name, parts in zip(WAY, zip(*way))}}


def measure_processor(bench, daemon, model):
    """A camera for each frame; the thread has the program's name, as it is the first one."""
    say("  the daemon's own time")
    runs = []
    for _ in range(bench.times(3)):
        told = watch(bench, daemon, model, *SMALL, "--seconds", 3 if bench.tiny else 10, "--looks", 0)
        runs.append(told["threads_ns"].get("farlightd", 0) / 1e6 / len(frames_of(told)))
    return figure(runs)


def measure_viewers(bench, daemon, model):
    count, seconds = (4, 5) if bench.tiny else (64, 60)
    say(f"  {count} viewers")
    served = [0] * count
    for frame in frames_of(watch(bench, daemon, model, *SMALL, "--viewers", count, "--seconds", seconds, "--looks", 30)):
        served[frame["viewer"]] += 1
    return {"count": count, "seconds": seconds, "frames": served, "slowest": min(served) / statistics.fmean(served)}


def over_a_link(bench, model, kbit_per_s, seconds, encoding):
    """What `bench view` printed, and None; or None, and why there can be no such link here."""
    with tempfile.TemporaryDirectory(prefix="farlight-bench-") as folder:
        key, address = pathlib.Path(folder) / "key", "tcp:10.77.0.1:7100"
        command(bench.program("farlight"), "key", key)
        arguments = [bench.program("tests/bench/shaped_link"), kbit_per_s, LINK_DELAY_MS, LINK_BUFFER_KIB,
                     bench.program("farlightd"), "--listen", address, "--key-file", key, "--",
                     *bench.form("view"), address, *model, "--key", key, "--seconds", seconds,
                     "--encoding", encoding, "--adapt", "--rate", LINK_ASKED_PER_S, "--looks", 60]
        result = subprocess.run(list(map(str, arguments)), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                check=False)
    if result.returncode == NO_LINK:
        return None, result.stderr.strip()
    if result.returncode != 0:
        raise Failure(f"over a link: {result.stderr.strip()}")
    return json.loads(result.stdout), None


def rendering_allows(frames):
    """Frames a second. One that is rendered faster than was asked for does not make up for one that took longer."""
    min_ns = 1e9 / LINK_ASKED_PER_S
    return (len(frames) - 1) * 1e9 / sum(max(stage_ns(frame, "render"), min_ns) for frame in frames[1:])


def measure_link(bench, model, kbit_per_s, encoding):
    seconds = 5 if bench.tiny else bench.link_seconds
    say(f"  a link of {kbit_per_s / 1000:.0f} Mbit/s, {encoding}, {seconds} s")
    told, why = over_a_link(bench, model, kbit_per_s, seconds, encoding)
    if told is None:
        return {"kbit_per_s": kbit_per_s, "encoding": encoding, "why": why}
    frames = frames_of(told)
    rate = rate_of(frames)
    span_s = (frames[-1]["whole"] - frames[0]["whole"]) / 1e9
    third = max(1, len(frames) // 3)
    delays = [figure([beyond_stages_ms(frame) for frame in part]) for part in (frames[:third], frames[-third:])]
    return {"kbit_per_s": kbit_per_s, "encoding": encoding, "seconds": seconds, "frames": len(frames),
            "frames_per_s": rate["frames_per_s"], "render_per_s": rendering_allows(frames),
            "mbit_per_s": sum(f["bytes"] for f in frames[1:]) * 8e-6 / span_s,
            "delay_ms": delays, "scale": statistics.fmean(frame["width"] for frame in frames) / 1280}


# ---- the part ---------------------------------------------------------------------------------------


def single(value):
    return figure([value])


def wanted(data):
    worst = min(data["rates"], key=lambda r: r["share"]["median"])
    rows = [row("frames of a view / what its slowest stage alone allows", SHARE_MIN, worst["share"],
                f"worst of {len(data['rates'])}: {worst['scene']}, {worst['encoding']}")]
    for latency in data["latencies"]:
        stages = "its stages" if latency["stages"] == 1 else "twice its stages"
        for key, maximum in (("p50_ms", P50_MS_MAX), ("p99_ms", P99_MS_MAX)):
            late = significant(latency["late_p99_ms"]["median"])
            rows.append(row(f"camera to decoded frame {latency['where']}, {key[1:3]} %, ms beyond {stages}", maximum, latency[key],
                            f"{latency['frames']} frames; a sleep ends late by {late}, 99 %", at_most=True))
    rows.append(row("the daemon's own processor time a frame, ms", PROCESSOR_MS_MAX, data["processor"],
                    "its network thread", at_most=True))
    viewers = data["viewers"]
    rows.append(row(f"{viewers['count']} viewers, frames of the slowest / mean", SLOWEST_MIN, single(viewers["slowest"]),
                    f"{sum(viewers['frames'])} frames in {viewers['seconds']} s"))
    for link in data["links"]:
        if "why" in link or link["kbit_per_s"] != LINK_KBIT_PER_S:
            continue
        reach = min(LINK_FRAMES_PER_S, link["render_per_s"])
        rows.append(row(f"10 Mbit/s, 50 ms, {link['encoding']}: frames a second / the lesser of 20 and what rendering allows",
                        SHARE_MIN, single(link["frames_per_s"] / reach), f"{significant(link['frames_per_s'])} a second"))
        first, last = link["delay_ms"]
        rows.append(row(f"10 Mbit/s, 50 ms, {link['encoding']}: delay in the end / at first", DELAY_GROWS_MAX,
                        single(last["median"] / first["median"]), f"thirds of {link['seconds']} s", at_most=True))
    return rows


def measure(bench):
    left_out, before = [], os.getloadavg()[0]
    scenes = list(models(bench, left_out))
    small = scenes[0][1]
    with Daemon(bench) as daemon:
        encodings = ["raw", "jpeg"] + ["h264"] * can_h264(bench, daemon, small)
        data = {"left_out": left_out, "rates": measure_rates(bench, daemon, scenes, encodings),
                "latencies": [measure_latency(bench, daemon, small, "alone", 1),
                              measure_latency(bench, daemon, small, "beside a batch", 2, "--batch", "--weight", 1)],
                "processor": measure_processor(bench, daemon, small), "viewers": measure_viewers(bench, daemon, small)}
    data["links"] = [measure_link(bench, small, kbit_per_s, encoding) for encoding in encodings if encoding != "raw"
                     for kbit_per_s in (LINK_KBIT_PER_S, NARROW_KBIT_PER_S)[:1 if bench.tiny else None]]
    data["load"] = [before, os.getloadavg()[0]]
    data["wanted"] = wanted(data)
    return data


def show_link(link):
    name = f"{link['kbit_per_s'] / 1000:.0f} Mbit/s, {link['encoding']}"
    if "why" in link:
        return (f"{name}: {link['why']}", *[""] * 7)
    delays = (significant(delay["median"]) for delay in link["delay_ms"])
    return (name, link["frames"], significant(link["frames_per_s"]), significant(link["render_per_s"]),
            significant(link["mbit_per_s"]), f"{link['scale']:.2f}", *delays)


def show(data):
    rates = [(f"{r['scene']}, {r['encoding']}", with_spread(r["frames_per_s"]),
              *(significant(r["ms"][stage]["median"]) for stage in ("render", "encode", "send")), with_spread(r["share"]))
             for r in data["rates"]]
    latencies = [(l["where"], l["frames"], with_spread(l["p50_ms"]), with_spread(l["p99_ms"]), with_spread(l["late_p99_ms"]),
                  *(f"{l['way'][name]:.2f}" for name in WAY)) for l in data["latencies"]]
    viewers = data["viewers"]
    return "\n\n".join((
        f"Load {data['load'][0]:.1f} before, {data['load'][1]:.1f} after. A camera each millisecond, whitted, one sample.",
        table([("1280x720", "frames/s", "render", "encode", "send", "of the slowest"), ("", "", "ms", "ms", "ms", "stage's")],
              rates),
        "From the camera sent to the frame decoded, 320x240, JPEG, ms beyond the frame's stages (beside a batch of another\n"
        "client of equal weight: beyond twice those); by how much a sleep ends late here, 99 %; and the medians of what\n"
        "it is made of\n\n" +
        table([("", "frames", "50 %", "99 %", "a sleep", *WAY)], latencies),
        f"The daemon's network thread takes {with_spread(data['processor'])} ms of a processor a frame.",
        f"{viewers['count']} viewers of one scene, 320x240: {min(viewers['frames'])} to {max(viewers['frames'])} frames each "
        f"in {viewers['seconds']} s; the slowest has {viewers['slowest']:.2f} of the mean.",
        f"Links of {LINK_DELAY_MS} ms each way, a buffer of {LINK_BUFFER_KIB} KiB; 1280x720, "
        f"{LINK_ASKED_PER_S} a second asked for, quality and size adapt\n\n" +
        table([("", "frames", "frames/s", "render", "Mbit/s", "of the", "delay, first", "last"),
               ("", "", "", "allows", "", "width", "ms", "ms")], [show_link(link) for link in data["links"]])))
