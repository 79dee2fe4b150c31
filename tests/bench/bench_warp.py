# SPDX-License-Identifier: MIT
"""The part `warp` of the benchmark: what somebody sees who walks through a scene over a link (`farlight view --link`),
with today's stream and, where the viewer can, with views that it makes itself (`--views on`). Its JSON:

  size, seconds, hertz  of the walk: a hand that orbits, moves aside, comes nearer and looks round, in steps of so many a second
  links   one for each link and `views` ("off", "on"): kbit_per_s, round_trip_ms, resets (% in each second), and figures over
          the states of the walk: displayed_per_s (pictures shown in the last second), latency_ms (from a camera to its
          picture: the median of the last second) and latency_99_ms (what 99 % do not exceed; the stream says only medians:
          the 99 % of those), unseen (share of a view that no picture shows; null: of the stream); kbyte_per_s, all that the
          daemon sent in the walk by its time; lost, connections; psnr_db over the pictures of a second walk, each held
          against a true render of where the camera is by then, and psnr_at, those pictures in their order
  wanted  rows as in bench_reach.py

The hand is a replay, so that it does the same over every link, and the scene lies on the daemon before. One connection of
each link with resets is reset in the midst of the first walk (the seed of the link). In the second walk each picture that is
written keeps the viewer from its work for some ten milliseconds, so that rates and times are those of the first.
"""
import json
import pathlib
import subprocess
import tempfile

from bench_client import Daemon
from bench_common import Failure, bundled, command, figure, say, significant, table, with_spread
from bench_reach import row

KBITS_PER_S, ROUND_TRIPS_MS, RESETS = (2000, 10000, 50000), (0, 50, 100), (0, 1)
SEED = 458  # with 1 % the first connection is reset after 8 s, the second after minutes
HERTZ = 60
STATES_EVERY_S, PICTURES_EVERY_S = 0.5, 1
# So that the link, and not the rendering, is what takes long: nearest surfaces alone, lit without shadows.
LIGHT = ("--integrator", "raycast", "--layer-opacity", 1)
TRUE_SAMPLES = 4
PSNR_SAME_DB = 100  # of pictures without a difference, in place of an infinite one
DISPLAY_MIN, LATENCY_MS_MAX, GAIN_DB_MIN = 60, 1000 / 60 + 12, 6
SCENE = "walk"


# ---- the walk ---------------------------------------------------------------------------------------


def drag(button, steps, right, down, **more):
    """A hand that pulls by so many pixels a step. It ends where it began, off the window or not."""
    at = {"button": button, "x": 0, "y": 0, **more}
    yield {"mouse": "down", **at}
    for step in range(1, steps + 1):
        yield {"mouse": "move", "x": step * right, "y": step * down, "after": 1 / HERTZ}
    yield {"mouse": "up", **at, "x": steps * right, "y": steps * down}


def walk(seconds, height):
    """By shares of the window's height, so that a small window shows the same."""
    steps, pixel = int(seconds * HERTZ / 4), height / 720
    yield from drag("left", steps, pixel, 0.2 * pixel)  # round it: 0.3 rad a second
    yield from drag("middle", steps, -pixel, 0)  # aside
    for _ in range(steps):
        yield {"wheel": 0.05, "after": 1 / HERTZ}  # nearer, by a third a second
    yield from drag("right", steps, 2 * pixel, 0)  # look round


def with_stops(events, every_s, stop):
    """What `stop` makes of a number, after each so many seconds."""
    passed, number = 0, 0
    for event in events:
        yield event
        passed += event.get("after", 0)
        if passed >= every_s * (number + 1) - 1e-9:
            yield from stop(number)
            number += 1


def replay(seconds, height):
    """Twice the walk, the second time back from the first camera."""
    quiet = [{"key": "o", "shift": True}]  # no overlay in the pictures
    first = with_stops(walk(seconds, height), STATES_EVERY_S, lambda n: [{"state": f"walk {n}"}])
    second = with_stops(walk(seconds, height), PICTURES_EVERY_S,
                        lambda n: [{"screenshot": f"{n:03}.png"}, {"state": f"picture {n}"}])
    return [{"wait": "live"}, *quiet, {"state": "begin"}, *first, {"state": "end"}, {"key": "home"}, {"wait": "rest", "samples": 1},
            *second]


# ---- one link ---------------------------------------------------------------------------------------


def sent_bytes(bench, daemon):
    """To the viewers that are connected, by the number of their connection."""
    clients = json.loads(command(bench.program("farlight"), "stats", "--json", "--server", daemon.address))["clients"]
    return {client["client"]: client["sent_bytes"] for client in clients if client["name"].startswith("farlight view")}


def watch(bench, daemon, link, views, size, folder):
    """The states of the walk; each has "sent", what was sent so far by connection."""
    arguments = [bench.program("farlight"), "view", "--scene", SCENE, "--server", daemon.tcp, "--link", link, "--headless",
                 "--replay", folder / "replay.json", "--size", f"{size[0]}x{size[1]}", *LIGHT,
                 *([] if views is None else ["--views", views])]
    states = []
    with subprocess.Popen(list(map(str, arguments)), cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as viewer:
        try:
            for line in viewer.stdout:
                states.append(json.loads(line))
                if not states[-1]["state"].startswith("picture"):
                    states[-1]["sent"] = sent_bytes(bench, daemon)
            errors = viewer.stderr.read()
        except BaseException:  # else it would walk to its end
            viewer.kill()
            raise
    if viewer.returncode != 0:
        raise Failure(f"over {link}: {errors.strip()}")
    return states


def percentile(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]


def of_states(states, seconds):
    """What the viewer says of itself while it is connected, after the first second, whose pictures it still counts."""
    told, sent = [], {}
    for state in states:
        local = state.get("local", {})
        local = local if local.get("shown") else {}
        sent |= state["sent"]
        if state["status"] == "live" and state["state"] not in ("begin", "walk 0"):
            told.append({"displayed_per_s": max(state["frames_per_second"], local.get("views_per_second", 0)),
                         "latency_ms": 1e3 * local.get("latency_s", state["latency_s"]),
                         "latency_99_ms": 1e3 * local.get("latency_99_s", state["latency_s"]), "unseen": local.get("unseen")})
    if not told:
        raise Failure("the viewer was never connected while the camera moved")
    unseen = [t["unseen"] for t in told if t["unseen"] is not None]
    new_bytes = sum(sent.values()) - sum(states[0]["sent"].values())
    return {"displayed_per_s": figure([t["displayed_per_s"] for t in told]), "latency_ms": figure([t["latency_ms"] for t in told]),
            "latency_99_ms": percentile([t["latency_99_ms"] for t in told], 0.99), "unseen": figure(unseen) if unseen else None,
            "kbyte_per_s": new_bytes / 1e3 / seconds, "lost": states[-1]["times_live"] - 1}


class Truths:
    """True renders of where the camera was, each made once: the hand does the same over every link."""

    def __init__(self, bench, daemon, size, folder):
        self.bench, self.daemon, self.size, self.folder, self.paths = bench, daemon, size, folder, {}

    def path(self, state):
        eye, look_at = (",".join(f"{v:.7g}" for v in state[key]) for key in ("eye", "look_at"))
        if (eye, look_at) not in self.paths:
            path = self.folder / f"true-{len(self.paths)}.png"
            command(self.bench.program("farlight"), "render", "--scene", SCENE, "--server", self.daemon.address, "-q", "-o", path,
                    f"--eye={eye}", f"--look-at={look_at}", "--fov", f"{state['fov_y'] * 57.29577951308232:.7g}", "--size",
                    f"{self.size[0]}x{self.size[1]}", *LIGHT, "--samples", TRUE_SAMPLES)
            self.paths[eye, look_at] = path
        return self.paths[eye, look_at]

    def psnr_db(self, state, picture):
        result = subprocess.run([self.bench.program("farlight"), "compare", "--json", "--ignore-alpha", picture, self.path(state)],
                                stdout=subprocess.PIPE, text=True, check=True)
        psnr = json.loads(result.stdout)["psnr"]
        return PSNR_SAME_DB if psnr is None else psnr


def measure_link(bench, daemon, truths, cell, views, seconds):
    kbit_per_s, round_trip_ms, resets = cell
    link = f"{kbit_per_s}kbit,{round_trip_ms}ms,{resets}%,seed={SEED}"
    say(f"  {link}, views {views or 'off'}")
    with tempfile.TemporaryDirectory(prefix="farlight-bench-") as name:
        folder = pathlib.Path(name)
        (folder / "replay.json").write_text(json.dumps(replay(seconds, truths.size[1])))
        states = watch(bench, daemon, link, views, truths.size, folder)
        pictures = [state for state in states if state["state"].startswith("picture")]
        psnr_at = [truths.psnr_db(state, folder / f"{number:03}.png") for number, state in enumerate(pictures)]
    return {"kbit_per_s": kbit_per_s, "round_trip_ms": round_trip_ms, "resets": resets, "views": views or "off",
            **of_states([state for state in states if "sent" in state], seconds), "psnr_db": figure(psnr_at), "psnr_at": psnr_at}


# ---- the part ---------------------------------------------------------------------------------------


def kinds_of_views(bench):
    """None: the viewer has no such option."""
    return ["off", "on"] if "--views=off" in command(bench.program("farlight"), "view", "--help") else [None]


def find(data, kbit_per_s, round_trip_ms, views):
    return next((link for link in data["links"] if (link["kbit_per_s"], link["round_trip_ms"], link["resets"], link["views"]) ==
                 (kbit_per_s, round_trip_ms, 0, views)), None)


def wanted(data):
    narrow, stream, middle = find(data, 2000, 100, "on"), find(data, 2000, 100, "off"), find(data, 10000, 100, "on")
    if not (narrow and stream and middle):
        return []
    gain = figure([a - b for a, b in zip(narrow["psnr_at"], stream["psnr_at"])])
    return [row("2 Mbit/s, 100 ms: pictures displayed a second", DISPLAY_MIN, narrow["displayed_per_s"], "views made by the client"),
            row("2 Mbit/s, 100 ms: PSNR of a walk over the stream's, dB", GAIN_DB_MIN, gain,
                f"{significant(narrow['kbyte_per_s'])} KB/s beside {significant(stream['kbyte_per_s'])}"),
            row("10 Mbit/s, 100 ms: from the hand to the displayed picture, 99 %, ms", round(LATENCY_MS_MAX, 1),
                figure([middle["latency_99_ms"]]), "views made by the client", at_most=True)]


def grid_of(bench):
    """(kbit/s, ms, % of resets, kinds of views)"""
    kinds = kinds_of_views(bench)
    if bench.tiny:
        return [(50000, 50, resets, kinds) for resets in RESETS]
    if bench.goals:
        return [(2000, 100, 0, kinds), (10000, 100, 0, kinds[-1:])]
    return [(kbit, ms, resets, kinds) for kbit in KBITS_PER_S for ms in ROUND_TRIPS_MS for resets in RESETS]


def measure(bench):
    size, seconds = ((160, 90), 2) if bench.tiny else ((1280, 720), 8)
    data = {"size": size, "seconds": seconds, "hertz": HERTZ, "links": []}
    with Daemon(bench, tcp=True, yields=True) as daemon, tempfile.TemporaryDirectory(prefix="farlight-bench-") as name:
        truths = Truths(bench, daemon, size, pathlib.Path(name))
        server = subprocess.Popen([bench.program("farlight"), "serve", bundled(bench, "carousel.glb"), "--name", SCENE, "--server",
                                   daemon.address], stdout=subprocess.PIPE, text=True)
        try:
            if not server.stdout.readline():
                raise Failure("the scene was not served")
            for *cell, kinds in grid_of(bench):
                data["links"] += [measure_link(bench, daemon, truths, cell, views, seconds) for views in kinds]
        finally:
            server.terminate()
            server.wait()
            server.stdout.close()
    data["wanted"] = wanted(data)
    return data


def show(data):
    rows = [(f"{link['kbit_per_s'] / 1000:g} Mbit/s, {link['round_trip_ms']} ms, {link['resets']} %", link["views"],
             with_spread(link["displayed_per_s"]), significant(link["latency_ms"]["median"]), significant(link["latency_99_ms"]),
             significant(link["kbyte_per_s"]), significant(link["psnr_db"]["median"]), significant(link["psnr_db"]["min"]),
             f"{100 * link['unseen']['median']:.1f}" if link["unseen"] else "-", link["lost"]) for link in data["links"]]
    width, height = data["size"]
    return (f"The carousel, at rest, at {width}x{height}, a walk of {data['seconds']} s whose camera moves {data['hertz']} times a "
            f"second; PSNR against true renders of {TRUE_SAMPLES} samples\nof where the camera is when a picture is shown. The daemon, "
            "which stands for one of another machine, runs with nice -n 19 beside\nthe viewer.\n\n" +
            table([("link", "views", "displayed", "latency", "99 %", "sent", "PSNR", "lowest", "unseen", "lost"),
                   ("rate, round trip, resets", "", "pictures/s", "ms", "ms", "KB/s", "dB", "dB", "%", "")], rows))
