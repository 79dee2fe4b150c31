#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`make bench-gpu`: what a GPU does, measured in one run of at most ten minutes, on this machine or on another one.

  bench_gpu.py pack BUILD FOLDER   programs, their libraries, models and this file into FOLDER
  bench_gpu.py run [--software] [--seconds N] [--out NAME]
                                   in FOLDER, which may have been copied: a table on standard output and in NAME.txt, and
                                   everything that was printed in NAME.tar.gz (NAME: measured)

Rates are those of the device's own time stamps. The device is kept at work before each figure, its clock stands beside it,
and answers are copied before the host reads them. Without hardware, or with --software, the same steps run with small
sizes: a rehearsal. Each step has a limit, so that one that hangs costs no other. Needs Python and a GL driver."""
import argparse
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import threading
import time

PROGRAMS = "farlight", "farlightd", "farlight-import", "farlight-export", "tests/bench/bench"
OF_EVERY_MACHINE = re.compile(r"/(ld-linux|libc|libm|libpthread|libdl|librt)[.-]")
# The benchmark's client of videos needs FFmpeg, and that a hundred libraries, of which nothing is called here.
STAND_INS = re.compile(r"lib(avcodec|swscale|avutil)\.so")
WAVES = "primary", "shadow", "bounce"
FRAMES = ("whitted", 1), ("whitted", 16), ("path", 1), ("path", 16), ("distributed", 16)


# ---- pack -------------------------------------------------------------------------------------------

def output_of(*command):
    return subprocess.run(list(map(str, command)), check=True, capture_output=True, text=True).stdout


def needed(program):
    return re.findall(r"NEEDED.*\[(.*)\]", output_of("readelf", "-d", program))


def pack(build, folder):
    shutil.rmtree(folder, ignore_errors=True)
    libraries = folder / "lib"
    libraries.mkdir(parents=True)
    paths = dict(re.findall(r"^\s*(\S+) .* => (\S+)$", output_of("/sbin/ldconfig", "-p"), re.M)[::-1])
    for name in PROGRAMS:
        to = folder / "bin" / name
        to.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(build / name, to)
        subprocess.run(["strip", to], check=True)
        for library in needed(build / name):
            if STAND_INS.match(library):
                subprocess.run(["gcc", "-shared", "-nostdlib", "-x", "c", "/dev/null", "-o", libraries / library,
                                f"-Wl,-soname,{library}"], check=True)
                continue
            for path in [paths[library]] + re.findall(r"=> (/\S+)", output_of("ldd", paths[library])):
                if not OF_EVERY_MACHINE.search(path):
                    shutil.copy(path, libraries / pathlib.Path(path).name)
    output_of(build / "tests/tools/make_scenes", folder)
    shared = pathlib.Path(os.environ.get("FARLIGHT_SCENES", build.parents[1].parent / "shared/scenes"))
    dragon = shared / "common/dragon-871k.glb"
    if dragon.is_file():
        shutil.copy(dragon, folder)
    for scene in folder.iterdir():
        if scene.is_file() and scene.name not in ("carousel.glb", "dusk.hdr", dragon.name):
            scene.unlink()
    shutil.copy(__file__, folder)
    print(f"{folder}: {sum(f.stat().st_size for f in folder.rglob('*') if f.is_file()) / 1e6:.0f} MB")


# ---- run --------------------------------------------------------------------------------------------

class Clock(threading.Thread):
    """Reads the clock of the device's processors, MHz, twice a second; without nvidia-smi there is none."""

    def __init__(self):
        super().__init__(daemon=True)
        self.readings = []
        self.start()

    def run(self):
        query = ["nvidia-smi", "--query-gpu=clocks.sm", "--format=csv,noheader,nounits"]
        while shutil.which("nvidia-smi"):
            read = subprocess.run(query, capture_output=True, text=True, check=False)
            if read.returncode == 0 and read.stdout.split():
                self.readings.append((time.monotonic(), int(read.stdout.split()[0])))
            time.sleep(0.5)

    def text(self, since):
        """The clock during what began then."""
        seen = sorted(mhz for when, mhz in self.readings if when >= since)
        return f", clock {seen[0]} to {seen[-1]} MHz" if seen else ""


class Run:
    def __init__(self, options):
        self.folder = pathlib.Path(__file__).resolve().parent
        self.bin = self.folder / "bin"
        self.software = options.software
        self.until = time.monotonic() + options.seconds
        self.printed = pathlib.Path(tempfile.mkdtemp(prefix="farlight-measured-"))
        self.lines = []
        self.clock = Clock()
        self.environment = dict(os.environ, LD_LIBRARY_PATH=str(self.folder / "lib"), FARLIGHT_LIBEXEC=str(self.bin),
                                XDG_CACHE_HOME=str(self.printed / "cache"))
        listed = self.step("devices", 60, self.bin / "farlightd", "--list-devices")
        self.software |= "software" in listed.split("\n")[0]
        self.device = ["--device", "software"] if self.software else []

    def say(self, line):
        print(line, flush=True)
        self.lines.append(line)

    def step(self, name, limit_s, *command):
        """What the command printed; what it reported beside it lies in the archive. "" where it failed, and says so."""
        left_s = self.until - time.monotonic()
        if left_s < 5:
            self.say(f"{name}: left out, the time is over")
            return ""
        files = self.printed / f"{name}.txt", self.printed / f"{name}.errors.txt"
        with open(files[0], "w") as out, open(files[1], "w") as errors:
            try:
                status = subprocess.run(list(map(str, command)), stdout=out, stderr=errors, env=self.environment, check=False,
                                        timeout=min(limit_s, left_s)).returncode
            except subprocess.TimeoutExpired:
                status = f"no end within {min(limit_s, left_s):.0f} s"
        if status != 0:
            self.say(f"{name}: failed ({status}) {files[1].read_text().strip()[-200:]}")
            return ""
        return files[0].read_text()

    # -- steps

    def machine(self):
        self.say(time.strftime("%Y-%m-%d ") + ("REHEARSAL ON SOFTWARE GL" if self.software else ""))
        if shutil.which("nvidia-smi"):
            self.say(self.step("driver", 20, "nvidia-smi", "--query-gpu=name,driver_version,clocks.sm,clocks.max.sm,clocks.mem",
                               "--format=csv,noheader").strip())
        begun = time.monotonic()
        text = self.step("check", 120, self.bin / "farlightd", "--check-device", *self.device)
        if text:
            self.say(f"--check-device in {time.monotonic() - begun:.1f} s: {text.strip().splitlines()[-1]}")

    def rates(self, name, limit_s, tracers, side, *scene):
        """Million rays a second of waves, memory and time of builds."""
        begun = time.monotonic()
        text = self.step(name, limit_s, self.bin / "tests/bench/bench", "tracers", *scene, "--size", f"{side}x{side}", "--tracers",
                         tracers, "--waves", ",".join(WAVES), "--runs", 3 if self.software else 9)
        if not text:
            return
        result = json.loads(text)
        self.say(f"-- {result['triangles']} triangles, {side}x{side}{self.clock.text(begun)}")
        self.say(f"{'Mray/s':18}" + "".join(f"{wave:>10}" for wave in WAVES) + "   MB  build, ms")
        rows = {}
        for wave in result["waves"]:
            for measure in wave["measures"]:
                rate = measure.get("device_rays_per_s", measure["rays_per_s"])
                rows.setdefault((measure["tracer"], measure["way"]), {})[wave["kind"]] = rate / 1e6
        structures = {structure["tracer"]: structure for structure in result["structures"]}
        for (tracer, way), row in rows.items():
            cells = "".join(f"{row[wave]:10.1f}" if wave in row else f"{'-':>10}" for wave in WAVES)
            built = structures[tracer]
            self.say(f"{tracer + (' alone' if way == 'traversal' else ''):18}{cells} {built['memory_bytes'] / 1e6:6.1f} "
                     f"{built['build']['median_ns'] / 1e6:9.1f}")

    def frames(self, size):
        socket = "unix:" + str(self.printed / "socket")
        with open(self.printed / "daemon.txt", "w") as log, \
             subprocess.Popen([self.bin / "farlightd", "--listen", socket, *self.device], env=self.environment, stdout=log,
                              stderr=log) as daemon:
            self.say(f"-- frames of {size}, carousel, depth 8; the second of each, which compiles nothing")
            self.say(f"{'integrator, samples':18} ms whole  on device   Mrays dispatches barriers waits")
            for integrator, samples in FRAMES:
                begun = time.monotonic()
                for turn in "first", "second":
                    text = self.step(f"frame-{integrator}-{samples}-{turn}", 60, self.bin / "farlight", "render",
                                     self.folder / "carousel.glb", "--environment", self.folder / "dusk.hdr", "--server", socket,
                                     "--retry-for", "30s", "--integrator", integrator, "--samples", samples, "--depth", 8,
                                     "--size", size, "--primary", "trace", "--timings=json", "-o", self.printed / "frame.png")
                found = [json.loads(line) for line in text.splitlines() if line.startswith("{")]
                self.frame_row(f"{integrator}, {samples}", found, self.clock.text(begun))
            daemon.terminate()

    def frame_row(self, name, found, clock):
        for frame in (item for item in found if item["kind"] == "frame"):
            whole_ns = sum(span["duration_ns"] for span in frame["stages"] if span["stage"] == "frame")
            device_ns = sum(span["duration_ns"] for span in frame["stages"] if span["clock"] == "gpu")
            rays = sum(frame[kind + "_rays"] for kind in ("primary", "shadow", "secondary"))
            self.say(f"{name:18}{whole_ns / 1e6:9.1f} {device_ns / 1e6:10.1f} {rays / 1e6:7.2f} {frame['dispatches']:10} "
                     f"{frame['barriers']:8} {frame['device_waits']:5}{clock}")

    def all(self):
        self.machine()
        large = self.folder / "dragon-871k.glb"
        scene = ("--family", 5000 if self.software else 871000) if self.software or not large.is_file() else ("--model", large)
        self.rates("nodes", 150, "bvh-links,bvh-eight", 128 if self.software else 1024, *scene)
        self.rates("tracers", 150, "bvh,ldc,abuffer", 128 if self.software else 1024, *scene)
        self.rates("views", 120, "quadtree,rayspace", 64 if self.software else 512, *scene)
        if not self.software:
            self.rates("caches", 80, "bvh-links,bvh-eight", 1024, "--family", 3000000)
        self.frames("160x90" if self.software else "1280x720")


def run(options):
    measured = Run(options)
    try:
        measured.all()
    finally:
        shutil.rmtree(measured.printed / "cache", ignore_errors=True)
        pathlib.Path(options.out + ".txt").write_text("\n".join(measured.lines) + "\n")
        with tarfile.open(options.out + ".tar.gz", "w:gz") as archive:
            archive.add(measured.printed, "measured")
        shutil.rmtree(measured.printed, ignore_errors=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    packing = commands.add_parser("pack")
    packing.add_argument("build", type=pathlib.Path)
    packing.add_argument("folder", type=pathlib.Path)
    running = commands.add_parser("run")
    running.add_argument("--software", action="store_true")
    running.add_argument("--seconds", type=float, default=565)
    running.add_argument("--out", default="measured")
    options = parser.parse_args()
    if options.command == "pack":
        pack(options.build.resolve(), options.folder)
    else:
        run(options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
