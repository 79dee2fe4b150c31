# SPDX-License-Identifier: MIT
"""Time to the first picture of five models, beside f3d, which rasterises (apt-get install f3d xvfb).

Each run is one command that reads a model and writes a 640x480 PNG with one sample a pixel, from its start to its end, with all
that it starts. cold: no program of ours and none of Mesa's is on the disk, the files are in the host's memory; warm: the same
again. The programs take turns, run by run. f3d has an X server that runs already.

The part's JSON: `models`, each with title, and for cold and warm `ours` and `theirs` (wall_s and cpu_s: figures; the latter of all
processes), `ratio` of the least wall times, and `parts_ms` of ours' fastest warm run. `f3d` is its version, or null and
`no_f3d` the reason.
"""
import contextlib
import json
import os
import shutil
import subprocess
import tempfile
import time

from bench_common import Failure, bundled, command, figure, say, shared, table

SIZE = (640, 480)
MODELS = (("teapot, 6K", "common/teapot.obj", []), ("car, 39K", "ldc/car-beetle.obj", []),
          ("helmet, 15K, 5 textures", "gltf/DamagedHelmet.glb", []), ("bust, 269K", "ldc/igea-bust.glb", []),
          ("dragon, 871K", "common/dragon-871k.glb", []))
PARTS = (("start", "start_ns"), ("load", "load_ns"), ("wait", "wait_ns"), ("export", "export_ns"))


def why_no_f3d():
    for name in ("f3d", "Xvfb"):
        if not shutil.which(name):
            return f"{name} is not installed"
    return None


@contextlib.contextmanager
def x_server(wanted):
    """The name of a display of its own; None: none is wanted."""
    if not wanted:
        yield None
        return
    with subprocess.Popen(["Xvfb", "-displayfd", "1", "-screen", "0", "1024x768x24"], stdout=subprocess.PIPE,
                          stderr=subprocess.DEVNULL, text=True) as server:
        try:
            number = server.stdout.readline().strip()
            if not number:
                raise Failure("Xvfb did not start")
            yield f":{number}"
        finally:
            server.terminate()


def timed(arguments, environment):
    """Wall and processor seconds of a command and of all that it started and waited for, and what it printed."""
    begin = time.monotonic()
    with tempfile.TemporaryFile() as out, subprocess.Popen(list(map(str, arguments)), env=environment, stdout=out,
                                                           stderr=subprocess.STDOUT) as process:
        _, status, used = os.wait4(process.pid, 0)
        wall_s = time.monotonic() - begin
        process.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        text = out.read().decode(errors="replace")
    if process.returncode != 0:
        raise Failure(f"{' '.join(map(str, arguments))} ended with {process.returncode}: {text.strip()[-300:]}")
    return wall_s, used.ru_utime + used.ru_stime, text


def ours(bench, model, folder):
    return (bench.program("farlight"), "render", model, "-o", f"{folder}/ours.png", "--size", f"{SIZE[0]}x{SIZE[1]}",
            "--samples", "1", "--timings=json", "--quiet")


def theirs(model, folder):
    return "f3d", model, "--output", f"{folder}/theirs.png", "--resolution", f"{SIZE[0]},{SIZE[1]}"


def parts_ms(run):
    client = next(record for record in map(json.loads, run[2].splitlines()) if record["kind"] == "client")
    return {name: client[key] / 1e6 for name, key in PARTS if key in client}


def measure_model(bench, title, model, display):
    say(f"    {title}")
    runs = {}
    for _ in range(bench.times(7)):
        for name in ("ours", "theirs") if display else ("ours",):
            with tempfile.TemporaryDirectory(prefix="farlight-bench-") as folder:
                environment = os.environ | {"XDG_CACHE_HOME": folder, "MESA_SHADER_CACHE_DIR": folder,
                                            **({"DISPLAY": display} if display else {})}
                arguments = ours(bench, model, folder) if name == "ours" else theirs(model, folder)
                for state in ("cold", "warm"):
                    runs.setdefault((state, name), []).append(timed(arguments, environment))
    row = {"title": title, "parts_ms": parts_ms(min(runs["warm", "ours"]))}
    for state in ("cold", "warm"):
        row[state] = {name: {"wall_s": figure([run[0] for run in runs[state, name]]),
                             "cpu_s": figure([run[1] for run in runs[state, name]])}
                      for name in ("ours", "theirs") if (state, name) in runs}
        if display:
            row[state]["ratio"] = row[state]["ours"]["wall_s"]["min"] / row[state]["theirs"]["wall_s"]["min"]
    return row


def measure(bench):
    left_out, reason = [], why_no_f3d()
    models = [("teapot", bundled(bench, "teapot.glb"), [])] if bench.tiny else list(shared(bench, MODELS, left_out))
    with x_server(not reason) as display:
        rows = [measure_model(bench, title, model, display) for title, model, _ in models]
    version = None if reason else command("f3d", "--version").splitlines()[0]
    return {"left_out": left_out, "models": rows, "f3d": version, "no_f3d": reason}


def seconds(one):
    return f"{one['wall_s']['min']:.2f} ({one['cpu_s']['min']:.2f})"


def show(data):
    if not data["models"]:
        return "nothing to measure it with"
    lines = []
    for model in data["models"]:
        for state in ("warm", "cold"):
            one = model[state]
            lines.append((model["title"] if state == "warm" else "", state, seconds(one["ours"]),
                          seconds(one["theirs"]) if "theirs" in one else "-", f"{one['ratio']:.2f}" if "ratio" in one else "-"))
    parts = [(model["title"], *(f"{model['parts_ms'].get(name, 0):.0f}" for name, _ in PARTS)) for model in data["models"]]
    beside = data["f3d"] or f"f3d was left out: {data['no_f3d']}"
    return (table([("model", "caches", "farlight", "f3d", "farlight / f3d")], lines) +
            "\n\nseconds, the least of the runs; in brackets the processors' time of all processes (wanted: a ratio of at most 1).\n"
            f"640x480, one sample a pixel; {beside}.\n\n" +
            table([("of the fastest warm run, ms", *(name for name, _ in PARTS))], parts))
