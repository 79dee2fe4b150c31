#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The templates of conf/farm, each tried on the real thing as far as Debian has it.

Slurm, one node: an animation as an array of tasks while workers and daemons are killed at random. Then a picture is
damaged, and the same job is submitted again. Every picture must be there once, with the bytes of a single run, and the
second job must render the damaged one alone. One still by as many parts, with the same killing, must have the bytes of one part. Open Job Description: the template's own scripts, run as its specification
says. Flamenco: the job type is compiled by Node.js with Flamenco's names, and the commands are run. xargs: as it is. All of
them once more with names that a shell, xargs or a parser of options could take for its own.

Usage: farm.py BIN [--tasks 64] [--only slurm,openjd,flamenco,xargs,node]   Exit status: 0 all good, 1 not.
"""
import argparse
import hashlib
import json
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
FARM = HERE.parents[1] / "conf/farm"
sys.path.insert(0, str(HERE))
from slurm import Slurm  # pylint: disable=wrong-import-position

PICTURE = ["--size", "96x72", "--samples", "4", "--integrator", "path", "--orbit"]
STILL = ["--size", "640x360", "--samples", "4", "--integrator", "path"]
KILL_EVERY_S = 2.0
FOR_GOOD_S = 900
HOSTILE = """-a "b' $(touch x) `touch y`; touch z {} \\ *"""
# The controller tells the database without haste.
ACCOUNTED_S = 60


def digests(folder):
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.glob("*.png"))}


class Farm:
    def __init__(self, programs, folder, tasks):
        self.programs, self.folder, self.tasks = programs, folder, tasks
        subprocess.run([programs / "tests/tools/make_scenes", folder], check=True)
        self.model = folder / "teapot.glb"
        runtime = folder / "run"
        runtime.mkdir(mode=0o700)
        for name in ("reference", "slurm", "openjd", "flamenco", "xargs", "node"):
            (self.folder / name).mkdir()
        os.environ.update(PATH=f"{programs}:{FARM}:{os.environ['PATH']}", XDG_RUNTIME_DIR=str(runtime), FARLIGHT_GPU="software",
                          FARLIGHT_UNUSED="20", FARLIGHT_LIBEXEC=str(programs))
        reference = folder / "reference"
        self.run("farlight", "animate", self.model, *self.range(tasks), "-o", reference / "%04d.png", *PICTURE, "-q")
        self.reference = digests(reference)
        self.run("farlight", "render", self.model, "--part", "1/1", "-o", folder / "whole.exr", *STILL, "-q")
        self.run("farlight", "merge", folder / "whole.exr", "-o", folder / "still.exr")
        self.still = (folder / "still.exr").read_bytes()

    @staticmethod
    def range(count):
        return ["--frames", f"1-{count}"]

    def run(self, *command, status=0, **options):
        result = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
                                **options)
        self.expect(result.returncode == status, f"{command[0]} ends with {result.returncode}:\n{result.stdout[-2000:]}")
        return result.stdout

    @staticmethod
    def expect(holds, what):
        if not holds:
            raise AssertionError(what)

    def is_as_one_run(self, folder, reference=None):
        wanted = reference or self.reference
        self.expect(digests(folder) == wanted, f"{folder}: other pictures than one run gives")
        self.run("farlight", "verify", folder / "%04d.png", *self.range(len(wanted)))
        left = {path.name for path in folder.iterdir()} - set(wanted) - {f"{name}.sha256" for name in wanted}
        self.expect(not left, f"left over: {left}")

    def is_as_one_part(self, path, count):
        self.expect(path.read_bytes() == self.still, f"{path}: another picture than one part gives")
        parts = {part.name for part in pathlib.Path(f"{path}.parts").iterdir()}
        self.expect(parts == {f"{number}-of-{count}.exr" for number in range(1, count + 1)}, f"parts: {parts}")

    # ---- what runs here ----

    def processes(self):
        """Of this test: clients that animate, and daemons; by number."""
        mine = {}
        for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
            try:
                words = path.read_bytes().split(b"\0")
            except OSError:
                continue
            if words[0].endswith((b"farlight", b"farlightd")) and str(self.folder).encode() in b" ".join(words):
                mine[int(path.parent.name)] = b" ".join(words[:2]).decode()
        return mine

    def kill_one(self, rng):
        mine = self.processes()
        if not mine:
            return 0
        number = rng.choice(sorted(mine))
        try:
            os.kill(number, signal.SIGKILL)
        except ProcessLookupError:
            return 0
        return 1

    # ---- one each ----

    def slurm(self):
        out, comments = self.folder / "slurm", set()
        variables = {"MODEL": str(self.model), "FRAMES": f"1-{self.tasks}", "OUTPUT": str(out / "%04d.png"), "RETRIES": "20"}
        (self.folder / "cluster").mkdir()
        with Slurm(self.folder / "cluster") as cluster:
            begin = time.monotonic()
            job = cluster.submit(FARM / "slurm.sbatch", f"1-{self.tasks}", *PICTURE, **variables)
            killed = self.kill_while_it_runs(cluster, comments)
            took_s = time.monotonic() - begin
            self.is_as_one_run(out)
            logs = list((self.folder / "cluster").glob("farlight-*.log"))
            requeued = sum(log.read_text().count("queued again") for log in logs)
            self.expect(any("of 1 frames" in comment for comment in comments), f"squeue shows {comments}")
            attempts = self.accounted(cluster, job)
            ended = [state for _, state, _ in attempts]
            self.expect(ended.count("REQUEUED") == requeued and len(attempts) == self.tasks + requeued, f"sacct shows {attempts}")
            print(f"slurm: {self.tasks} tasks in {took_s:.0f} s, {killed} processes killed, {requeued} tasks queued again, as sacct shows")
            self.poisoned(cluster, out, variables)
            for_all = self.hostile(self.folder / "cluster")
            cluster.submit(FARM / "slurm.sbatch", "1-2", *PICTURE, MODEL=f"{HOSTILE}.glb", FRAMES="1-2", OUTPUT=f"{HOSTILE}/%04d.png")
            while cluster.queue():
                time.sleep(0.2)
            for_all()
            self.slurm_still(cluster)

    def kill_while_it_runs(self, cluster, comments):
        begin = killed_s = time.monotonic()
        rng, killed = random.Random(1), 0
        while queue := cluster.queue():
            comments.update(queue)
            self.expect(time.monotonic() - begin < FOR_GOOD_S, f"the job does not end: {cluster.ask('squeue')}")
            if time.monotonic() - killed_s > KILL_EVERY_S:
                killed_s = time.monotonic()
                killed += self.kill_one(rng)
            time.sleep(0.1)
        self.expect(killed > 0, "nothing was killed")
        return killed

    def slurm_still(self, cluster):
        still = self.folder / "slurm-still.exr"
        cluster.submit(FARM / "slurm.sbatch", f"1-{self.tasks}", *STILL, MODEL=str(self.model), OUTPUT=str(still), FRAMES="", RETRIES="20")
        killed = self.kill_while_it_runs(cluster, set())
        self.run("farlight", "merge", "-o", still, "--", *pathlib.Path(f"{still}.parts").iterdir())
        self.is_as_one_part(still, self.tasks)
        print(f"slurm: one still by {self.tasks} parts, {killed} processes killed, has the bytes of one part")

    def hostile(self, folder):
        """A model with such a name in a folder, whose pictures shall be in a folder with that name. What is to be called then."""
        (folder / HOSTILE).mkdir(parents=True)
        shutil.copy(self.model, folder / f"{HOSTILE}.glb")
        reference = self.folder / "of 2"
        self.run("farlight", "animate", folder / f"{HOSTILE}.glb", *self.range(2), "-o", reference / "%04d.png", "--parents", *PICTURE, "-q")

        def check():
            self.is_as_one_run(folder / HOSTILE, digests(reference))
            made = [path for path in self.folder.rglob("*") if path.name in ("x", "y", "z") or path.name.startswith(("x)", "y`"))]
            self.expect(not made, f"a name was run: {made}")
        return check

    def accounted(self, cluster, job):
        """What sacct shows of each attempt; the comment of each task's last one must say that all is done."""
        deadline = time.monotonic() + ACCOUNTED_S
        while True:
            attempts = cluster.accounts(job)
            last = {task: (state, comment) for task, state, comment in attempts}
            if len(last) == self.tasks and all(state == "COMPLETED" for state, _ in last.values()):
                break
            self.expect(time.monotonic() < deadline, f"sacct shows {attempts}")
            time.sleep(0.5)
        self.expect(all("1 of 1 frames" in comment for _, comment in last.values()), f"sacct shows {last}")
        return attempts

    def poisoned(self, cluster, out, variables):
        poisoned = self.tasks // 4 + 1
        damaged = out / f"{poisoned:04d}.png"
        before = {path.name: path.stat().st_mtime_ns for path in out.glob("*.png")}
        damaged.write_bytes(damaged.read_bytes()[:-20] + bytes(20))
        text = self.run("farlight", "verify", out / "%04d.png", *self.range(self.tasks), status=1)
        self.expect(damaged.name in text and text.count("differs") == 1, text)
        job = cluster.submit(FARM / "slurm.sbatch", f"1-{self.tasks}", *PICTURE, **variables)
        while cluster.queue():
            time.sleep(0.2)
        self.is_as_one_run(out)
        changed = {path.name for path in out.glob("*.png") if path.stat().st_mtime_ns != before[path.name]}
        self.expect(changed == {damaged.name}, f"rendered again: {changed}")
        attempts = self.accounted(cluster, job)
        rendered = [task for task, _, comment in attempts if "exist already" not in comment]
        self.expect(rendered == [poisoned], f"sacct shows {attempts}")
        print(f"slurm: of {self.tasks} pictures the damaged one alone was rendered again, as sacct shows")

    def openjd(self):
        self.openjd_job(self.folder / "session", {"Model": self.model, "Frames": f"1-{self.tasks}", "OutputFolder": self.folder / "openjd",
                                                  "OutputName": "%04d.png", "Parts": 4, "Options": " ".join(PICTURE)})
        self.is_as_one_run(self.folder / "openjd")
        self.openjd_job(self.folder / "still-session", {"Model": self.model, "OutputFolder": self.folder, "OutputName": "openjd-still.exr",
                                                         "Parts": 3, "Options": " ".join(STILL)}, name="openjd-still.yaml")
        self.is_as_one_part(self.folder / "openjd-still.exr", 3)
        folder = self.folder / "hostile-openjd"  # a daemon's address has no spaces
        check = self.hostile(folder)
        self.openjd_job(folder / "$(id>x)", {"Model": f"{HOSTILE}.glb", "Frames": "1-2", "OutputFolder": HOSTILE, "OutputName": "%04d.png",
                                                "Parts": 2, "Options": " ".join([*PICTURE, ""])}, cwd=folder)
        check()
        print("openjd: 4 tasks, 3 parts of a still; 2 with a name that no shell may read")

    def openjd_job(self, session, given, name="openjd.yaml", **options):
        import yaml  # pylint: disable=import-outside-toplevel
        template = yaml.safe_load((FARM / name).read_text())
        self.expect({parameter["name"] for parameter in template["parameterDefinitions"]} == set(given), "other parameters")
        session.mkdir()
        values = {**{f"Param.{name}": value for name, value in given.items()}, "Session.WorkingDirectory": session}
        render, last = template["steps"]
        environment = render["stepEnvironments"][0]["script"]
        answered = openjd_run(self, environment, "onEnter", "Env", values, **options)
        os.environ.update(dict(re.findall(r"^openjd_env: (\w+)=(.*)$", answered, re.M)))
        try:
            self.expect(render["parameterSpace"]["taskParameterDefinitions"][0]["range"] == "1-{{Param.Parts}}", "another range")
            for part in range(1, given["Parts"] + 1):
                told = openjd_run(self, render["script"], "onRun", "Task", {**values, "Task.Param.Part": part}, **options)
                shares = [float(share) for share in re.findall(r"^openjd_progress: (.*)$", told, re.M)]
                self.expect(shares == sorted(shares) and shares[-1] == 100, f"progress {shares}")
        finally:
            openjd_run(self, environment, "onExit", "Env", values, **options)
            del os.environ["FARLIGHT_SERVER"]
        openjd_run(self, last["script"], "onRun", "Task", values, **options)

    def flamenco(self):
        out = self.folder / "flamenco"
        count = self.flamenco_job({"model": str(self.model), "frames": f"1-{self.tasks}", "chunk_size": 16, "output": str(out / "%04d.png"),
                                   "options": " ".join(PICTURE)})
        self.is_as_one_run(out)
        still = self.folder / "flamenco-still.exr"
        self.flamenco_job({"model": str(self.model), "output": str(still), "parts": 5, "options": " ".join(STILL)}, name="flamenco-still.js")
        self.is_as_one_part(still, 5)
        folder = self.folder / "hostile flamenco"
        check = self.hostile(folder)
        self.flamenco_job({"model": f"{HOSTILE}.glb", "frames": "1-2", "chunk_size": 1, "output": f"{HOSTILE}/%04d.png",
                           "options": " ".join(PICTURE)}, cwd=folder)
        check()
        print(f"flamenco: {count} tasks, 6 for a still; 3 with a name that no shell may read")

    def flamenco_job(self, settings, name="flamenco.js", **options):
        tasks = json.loads(self.run("node", HERE / "flamenco_compile.js", FARM / name, json.dumps(settings)))
        for task in tasks:
            for command in task["commands"]:
                self.expect(command["name"] == "exec", f"command {command['name']}")
                self.run(command["parameters"]["exe"], *command["parameters"]["args"], **options)
        self.expect(tasks[-1]["dependencies"] == [task["name"] for task in tasks[:-1]], "the last task does not wait for all")
        return len(tasks)

    def xargs(self):
        out = self.folder / "xargs"
        self.run(FARM / "xargs.sh", 8, 2, self.model, *self.range(self.tasks), "-o", out / "%04d.png", *PICTURE)
        self.is_as_one_run(out)
        folder = self.folder / "hostile xargs"
        check = self.hostile(folder)
        self.run(FARM / "xargs.sh", 2, 1, *self.range(2), "-o", f"{HOSTILE}/%04d.png", *PICTURE, "--", f"{HOSTILE}.glb", cwd=folder)
        check()
        self.run(FARM / "xargs.sh", "2/$(touch x)", 1, self.model, *self.range(2), status=2, cwd=folder)
        print("xargs: 8 parts, 2 at once; 2 with a name that no shell may read")

    def node(self):
        """What the first task of a node costs, and a later one."""
        self.end_daemons()
        os.environ["XDG_CACHE_HOME"] = str(self.folder / "cache")
        times, sent = [], []
        for task in range(100 if self.tasks >= 64 else 10):
            begin = time.monotonic()
            text = self.run("farlight-node", "farlight", "animate", self.model, "--frames", "1-1", "-o", self.folder / "node/%d.png",
                            *PICTURE, "--timings=json", "-q")
            times.append(time.monotonic() - begin)
            sent += [json.loads(line)["uploaded_bytes"] for line in text.splitlines() if '"kind":"client"' in line]
        later = sorted(times[1:])[len(times) // 2]
        self.expect(sent[0] > 0 and not any(sent[1:]), f"sent {sent}")
        print(f"node: first task {times[0]:.2f} s with {sent[0]} bytes sent, number 2 {times[1]:.2f} s, the last of {len(times)} "
              f"{times[-1]:.2f} s, median of the later ones {later:.2f} s with 0 bytes sent")

    def end_daemons(self):
        for number, name in self.processes().items():
            if "farlightd" in name:
                os.kill(number, signal.SIGTERM)
        while self.processes():
            time.sleep(0.05)


def openjd_run(farm, script, action, scope, values, **options):
    """One action: its embedded files are written, references replaced."""
    def replace(text, known):
        return re.sub(r"\{\{\s*([\w.]+)\s*\}\}", lambda match: str(known[match.group(1)]), text)

    known = dict(values)
    for file in script.get("embeddedFiles", []):
        path = pathlib.Path(values["Session.WorkingDirectory"]) / file["name"]
        known[f"{scope}.File.{file['name']}"] = path
        if file["name"] in script["actions"][action]["args"][0]:
            path.write_text(replace(file["data"], known))
    wanted = script["actions"][action]
    return farm.run(*(replace(word, known) for word in [wanted["command"], *wanted["args"]]), **options)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("--tasks", type=int, default=64)
    parser.add_argument("--only", default="slurm,openjd,flamenco,xargs,node")
    wanted = parser.parse_args()
    folder = pathlib.Path(tempfile.mkdtemp(prefix="farlight-farm-"))
    farm, failed = None, False
    try:
        farm = Farm(wanted.programs, folder, wanted.tasks)
        for name in wanted.only.split(","):
            try:
                getattr(farm, name)()
            except AssertionError as error:
                failed = True
                print(f"{name}: FAILED: {error}")
    finally:
        if farm:
            farm.end_daemons()
        if not failed:
            shutil.rmtree(folder)
    return f"left in {folder}" if failed else 0


if __name__ == "__main__":
    sys.exit(main())
