# SPDX-License-Identifier: MIT
"""`--trace-file` of the client and of the daemon: trace events that viewers open, with the frames' own times."""
import collections
import json
import signal
import subprocess
import time

from farlight_test import BIN, TIMEOUT_S, Case, Daemon, bundled_scenes, farlight

STAGES = {"apply", "build", "upload", "primary", "trace", "shade", "resolve", "readback", "encode", "queue", "send"}


def spans(events):
    return [event for event in events if event["ph"] == "X"]


def ns(event):
    """Start and end, as whole nanoseconds: microseconds have three digits after the point."""
    start = round(event["ts"] * 1000)
    return start, start + round(event["dur"] * 1000)


class Traced(Case):
    def render(self, *options, frames=None, **more):
        path = self.folder / ("%d.png" if frames else "a.png")
        command = ["animate", "--frames", frames] if frames else ["render"]
        return farlight(command[0], bundled_scenes() / "sphereflake-2.nff", *command[1:], "-o", path, "--size", "64x48",
                        "-q", *options, **more)

    def check_form(self, events):
        """What a viewer needs: names for every process and thread, known phases, events of a thread that nest."""
        threads = collections.defaultdict(list)
        names = {(e["name"], e["pid"], e["tid"] if e["name"] == "thread_name" else 0) for e in events if e["ph"] == "M"}
        for event in spans(events):
            self.assertIn(("process_name", event["pid"], 0), names)
            self.assertIn(("thread_name", event["pid"], event["tid"]), names)
            self.assertGreaterEqual(event["dur"], 0)
            threads[event["tid"]].append(event)
        self.assertEqual({event["ph"] for event in events}, {"M", "X"})
        for thread, found in threads.items():
            within = []
            for start, end in sorted(map(ns, found), key=lambda span: (span[0], -span[1])):
                while within and within[-1] <= start:
                    within.pop()
                self.assertTrue(not within or end <= within[-1], f"events of thread {thread} overlap without nesting")
                within.append(end)

    def check_frame_times(self, events, timings):
        """Every stage of every frame with the duration, the wave and the clock of --timings=json."""
        for line in map(json.loads, timings.splitlines()):
            if line["kind"] != "frame":
                continue
            want = sorted((s["stage"], s["clock"], s["wave"], s["duration_ns"]) for s in line["stages"])
            got = sorted((e["name"], e["cat"], e["args"]["wave"], round(e["dur"] * 1000)) for e in spans(events)
                         if e["args"].get("frame") == line["frame"] and "wave" in e["args"])
            self.assertEqual(got, want)
            self.assertGreater(len(want), len(STAGES))


class OfTheClient(Traced):
    def test_it_holds_the_stages_of_all_frames_and_the_clients_own(self):
        path = self.folder / "trace.json"
        result = self.expect(self.render("--trace-file", path, "--timings=json", frames="1-3"), 0)
        events = json.loads(path.read_text())
        self.check_form(events)
        self.check_frame_times(events, result.stdout)
        client = json.loads(result.stdout.splitlines()[-1])
        own = collections.Counter()
        for event in spans(events):
            own[event["name"]] += round(event["dur"] * 1000)
        for stage in ("start", "import", "load", "upload", "commit", "wait", "receive", "decode", "export"):
            if stage == "upload":  # the daemon has a stage of this name, too
                continue
            self.assertEqual(own[stage], client[f"{stage}_ns"], stage)
        command = next(event for event in spans(events) if event["name"] == "animate")
        for event in spans(events):
            if event["pid"] == command["pid"]:
                self.assertLessEqual(ns(command)[0], ns(event)[0], event)
                self.assertGreaterEqual(ns(command)[1], ns(event)[1], event)

    def test_cpu_and_gpu_are_tracks_of_their_own(self):
        path = self.folder / "trace.json"
        self.expect(self.render("--trace-file", path), 0)
        clocks = collections.defaultdict(set)
        for event in spans(json.loads(path.read_text())):
            clocks[event["tid"]].add(event["cat"])
        self.assertTrue(all(len(found) == 1 for found in clocks.values()), clocks)
        self.assertIn({"gpu"}, clocks.values())

    def test_after_an_interruption_the_file_is_still_valid(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            path = self.folder / f"{number}.json"
            process = subprocess.Popen([BIN / "farlight", "animate", bundled_scenes() / "sphereflake-2.nff", "--frames",
                                        "1-100000", "-o", self.folder / "%d.png", "--size", "64x48", "-q", "--trace-file",
                                        path], stderr=subprocess.DEVNULL)
            deadline = time.monotonic() + TIMEOUT_S
            while time.monotonic() < deadline and not (self.folder / "5.png").exists():
                time.sleep(0.02)
            process.send_signal(number)
            self.assertEqual(process.wait(TIMEOUT_S), 128 + number)
            events = json.loads(path.read_text())
            self.check_form(events)
            self.assertTrue(STAGES <= {event["name"] for event in spans(events)})
            for picture in self.folder.glob("*.png"):
                picture.unlink()

    def test_a_command_that_fails_leaves_a_valid_file_and_its_own_message(self):
        path = self.folder / "trace.json"
        result = self.expect(farlight("render", self.folder / "missing.glb", "-o", self.folder / "a.png", "--trace-file",
                                      path), 1)
        self.assertIn("missing.glb", result.stderr)
        self.check_form(json.loads(path.read_text()))

    def test_an_unwritable_file_is_reported_before_anything_is_rendered(self):
        self.assertIn("no/trace.json", self.expect(self.render("--trace-file", self.folder / "no" / "trace.json"),
                                                   1).stderr)
        self.assertEqual(self.leftovers(), [])
        model = self.folder / "model.nff"
        model.write_text("v\n")
        self.assertIn("would replace", self.expect(farlight("render", model, "-o", self.folder / "a.png", "--trace-file",
                                                            model), 2).stderr)
        self.assertEqual(model.read_text(), "v\n")
        self.assertIn("No space left", self.expect(self.render("--trace-file", "/dev/full"), 1).stderr)


class OfTheDaemon(Traced):
    def test_it_holds_every_jobs_frames_with_client_and_job(self):
        path = self.folder / "trace.json"
        with Daemon("--trace-file", path) as daemon:
            timings = [self.expect(self.render("--server", daemon.address, "--timings=json", frames="1-4"), 0).stdout,
                       self.expect(self.render("--server", daemon.address, "--timings=json"), 0).stdout]
            self.assertEqual(daemon.stop(), 0)
        events = json.loads(path.read_text())
        self.check_form(events)
        for client, output in enumerate(timings, 1):
            mine = [event for event in events if event["pid"] == client]
            self.check_frame_times(mine, output)
            self.assertEqual(len({event["args"]["job"] for event in spans(mine)}), 1)
        names = [e["args"]["name"] for e in events if e["name"] == "process_name"]
        self.assertEqual([name.split()[:2] for name in names], [["client", "1"], ["client", "2"]])

    def test_frames_of_one_job_follow_each_other_in_time(self):
        path = self.folder / "trace.json"
        with Daemon("--trace-file", path) as daemon:
            self.expect(self.render("--server", daemon.address, frames="1-4"), 0)
        starts = [(ns(e)[0], e["args"]["frame"]) for e in spans(json.loads(path.read_text())) if e["name"] == "frame"]
        self.assertEqual([frame for _, frame in sorted(starts)], [1, 2, 3, 4])

    def test_while_it_runs_only_the_end_of_the_array_is_missing(self):
        path = self.folder / "trace.json"
        with Daemon("--trace-file", path) as daemon:
            self.expect(self.render("--server", daemon.address), 0)
            deadline = time.monotonic() + TIMEOUT_S
            while time.monotonic() < deadline and '"send"' not in path.read_text():
                time.sleep(0.02)
            self.check_form(json.loads(path.read_text() + "]"))
            daemon.signal_all(signal.SIGKILL)
            daemon.process.wait()
        self.check_form(json.loads(path.read_text() + "]"))

    def test_it_stops_at_its_limit_with_a_line_in_the_log_and_stays_valid(self):
        path, config = self.folder / "trace.json", self.folder / "farlightd.conf"
        config.write_text(f"[server]\ntrace_file = {path}\n[limits]\ntrace_file = 32K\n")
        with Daemon("--config", config) as daemon:
            self.expect(self.render("--server", daemon.address, frames="1-20"), 0)
            daemon.stop()
            log = daemon.messages()
        self.assertEqual(log.count("limit of 32768 bytes"), 1, log)
        self.assertLessEqual(path.stat().st_size, 32768)
        self.assertGreater(path.stat().st_size, 16384)
        self.check_form(json.loads(path.read_text()))

    def test_a_full_disk_is_reported_at_the_start(self):
        result = subprocess.run([BIN / "farlightd", "--listen", f"unix:{self.folder}/s", "--trace-file", "/dev/full"],
                                stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False,
                                timeout=TIMEOUT_S)
        self.assertEqual(result.returncode, 1)
        self.assertIn("/dev/full: the trace file cannot be written: No space left", result.stderr)

    def test_a_file_that_cannot_be_created_is_reported_at_the_start(self):
        path = self.folder / "no" / "trace.json"
        result = subprocess.run([BIN / "farlightd", "--listen", f"unix:{self.folder}/s", "--trace-file", path],
                                stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False,
                                timeout=TIMEOUT_S)
        self.assertEqual(result.returncode, 1)
        self.assertIn(f"{path}: the trace file cannot be written: No such file", result.stderr)
