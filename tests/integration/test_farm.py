# SPDX-License-Identifier: MIT
"""What farms rely on: digests and `farlight verify`, progress in other programs' words, a daemon that ends when it is unused,
one that stays for many tasks. tests/farm tries the templates on the queues themselves."""
import hashlib
import json
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import unittest

import farlight_test
from farlight_test import Case, Daemon, bundled_scenes, farlight

NODE = pathlib.Path(__file__).parents[2] / "conf/farm/farlight-node"
GPU_VARIABLES = ("FARLIGHT_GPU", "SLURM_STEP_GPUS", "SLURM_JOB_GPUS", "SLURM_LOCALID", "CUDA_VISIBLE_DEVICES")
SMALL = ["--size", "24x16", "--samples", "1", "--orbit"]


def animate(*arguments, **options):
    return farlight("animate", bundled_scenes() / "cornell.glb", *SMALL, *arguments, **options)


class Digests(Case):
    def test_what_is_missing_or_differs_is_found_and_rendered_again(self):
        pattern = self.folder / "%02d.png"
        frames = ["--frames", "1-5"]
        with Daemon() as daemon:
            daemon_options = ["--server", daemon.address, "-q"]
            self.expect(animate(*frames, "-o", pattern, "--digests", *daemon_options), 0)
            for path in self.folder.glob("*.png"):
                self.assertEqual(pathlib.Path(f"{path}.sha256").read_text(),
                                 f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n")
            good = {path.name: path.read_bytes() for path in self.folder.iterdir()}
            self.assertEqual(len(good), 10)
            self.assertEqual(self.expect(farlight("verify", self.folder), 0).stdout, "5 pictures, 5 good\n")
            damaged = self.folder / "02.png"
            damaged.write_bytes(good["02.png"][:-1] + b"x")  # of the same size, and still a PNG by its head
            (self.folder / "03.png").unlink()
            (self.folder / "04.png.sha256").unlink()
            result = self.expect(farlight("verify", pattern, *frames), 1)
            self.assertEqual(result.stdout, f"{damaged}: differs from its digest\n{self.folder}/03.png: missing\n"
                                            f"{self.folder}/04.png: has no digest\n5 pictures, 2 good\n")
            record = json.loads(self.expect(farlight("verify", pattern, *frames, "--json"), 1).stdout)
            self.assertEqual((record["pictures"], record["good"], [bad["state"] for bad in record["bad"]]),
                             (5, 2, ["differs from its digest", "missing", "has no digest"]))
            self.assertEqual(self.expect(farlight("verify", self.folder, "-q"), 1).stdout, "")
            # Without the option a picture that has no digest is as good as its size.
            for options, there in ((["--digests"], 2), ([], 5)):
                result = self.expect(animate(*frames, "-o", pattern, "--resume", *options, "--server", daemon.address), 0)
                self.assertIn(f"{there} of 5 frames exist already", result.stderr)
            self.assertEqual({path.name: path.read_bytes() for path in self.folder.iterdir()}, good)

    def test_what_cannot_be_checked_is_said(self):
        for arguments, status, words in ((["verify"], 2, "FOLDER"), (["verify", self.folder], 1, "no picture in it has a digest"),
                                         (["verify", self.folder / "none"], 1, "cannot be read"),
                                         (["verify", self.folder, "--frames", "1-2"], 2, "%"),
                                         (["verify", self.folder / "%d.png", "--frames", "2-1"], 2, "--frames"),
                                         (["animate", "x.glb", "--frames", "1-2", "--digests", "-o", "x.mp4"], 2, "--digests")):
            result = self.expect(farlight(*arguments), status)
            self.assertIn(words, result.stderr)


class Progress(Case):
    def each_frame_has_a_line(self, result):
        told = re.findall(r"^frame (\d+): \d+\.\d\d s, (\d+) MB, (.*)$", self.expect(result, 0).stderr, re.M)
        self.assertEqual([(number, path) for number, _, path in told], [(str(i), f"{self.folder}/{i}.png") for i in range(1, 5)])
        for _, megabytes, _ in told:  # of the command and the daemon that it has started
            self.assertGreater(int(megabytes), 10)

    def test_a_log_has_a_line_for_each_frame_that_is_complete(self):
        output = ["--frames", "1-4", "-o", self.folder / "%d.png"]
        self.each_frame_has_a_line(animate(*output))
        self.assertNotIn("frame 1", self.expect(animate(*output, "-q"), 0).stderr)
        video = self.expect(animate("--frames", "1-2", "-o", self.folder / "x.y4m"), 0).stderr
        self.assertEqual(re.findall(r"^frame (\d+): .* MB, (.*)$", video, re.M), [(str(i), f"{self.folder}/x.y4m") for i in (1, 2)])

    def test_open_job_description_reads_it_on_standard_output(self):
        output = ["--frames", "1-4", "-o", self.folder / "%d.png"]
        lines = self.expect(animate(*output, "--progress", "openjd"), 0).stdout.splitlines()
        shares = [float(line.split(": ")[1]) for line in lines if line.startswith("openjd_progress: ")]
        self.assertEqual((shares, shares[-1]), (sorted(shares), 100))
        self.assertTrue(all(re.match(r"openjd_(progress: \d+\.\d|status: .+)$", line) for line in lines), lines)
        self.each_frame_has_a_line(animate(*output, "--progress", "openjd"))
        result = self.expect(farlight("render", "x.glb", "-o", "-", "--progress", "openjd"), 2)
        self.assertIn("--progress", result.stderr)
        self.assertIn("bar, lines and openjd", self.expect(animate(*output, "--progress", "loud"), 2).stderr)


class OpenJobDescription(Case):
    """The template, by the fields of the published schema and the names of its format strings."""

    def setUp(self):
        super().setUp()
        try:
            import jsonschema  # pylint: disable=import-outside-toplevel
            import yaml  # pylint: disable=import-outside-toplevel
        except ImportError as why:
            self.skipTest(f"python3-{why.name} is not installed")
        schema = json.loads((pathlib.Path(__file__).parents[1] / "farm/openjd.schema.json").read_text())
        self.validator = jsonschema.Draft7Validator(schema)
        self.template, self.still = (yaml.safe_load((NODE.parent / name).read_text()) for name in ("openjd.yaml", "openjd-still.yaml"))

    def faults(self, template=None):
        return [f"{'.'.join(map(str, one.absolute_path))}: {one.message}" for one in self.validator.iter_errors(template or self.template)]

    def test_the_templates_have_fields_that_there_are(self):
        self.assertEqual(self.faults() + self.faults(self.still), [])
        self.template["parameterDefinitions"][1]["allowedPattern"] = "[0-9]+-[0-9]+"  # of no version
        self.assertEqual(len(self.faults()), 1)

    def test_each_parameter_has_a_control_and_rendering_asks_for_a_gpu(self):
        for template in (self.template, self.still):
            for parameter in template["parameterDefinitions"]:
                self.assertIn("control", parameter["userInterface"], parameter["name"])
            render, last = template["steps"]
            self.assertEqual(render["hostRequirements"]["amounts"], [{"name": "amount.worker.gpu", "min": 1}])
            self.assertNotIn("amounts", last["hostRequirements"])

    def test_both_templates_keep_a_daemon_alike(self):
        self.assertEqual(*(template["steps"][0]["stepEnvironments"] for template in (self.template, self.still)))

    def test_the_daemon_of_a_session_has_the_gpu_that_was_given(self):
        script = self.folder / "enter"
        script.write_text(self.template["steps"][0]["stepEnvironments"][0]["script"]["embeddedFiles"][0]["data"])
        fake = self.folder / "farlightd"
        fake.write_text("#!/bin/sh\n[ \"$1\" = --list-devices ] && printf '%s  A40  (vendor, OpenGL 4.6)\\n' 0 1\nexit 3\n")
        fake.chmod(0o755)
        plain = {name: value for name, value in os.environ.items() if name not in GPU_VARIABLES}
        for given, gpu in (({}, "auto"), ({"CUDA_VISIBLE_DEVICES": "1"}, "1"), ({"FARLIGHT_GPU": "software"}, "software")):
            with self.subTest(given):
                environment = {**plain, "PATH": f"{self.folder}:{NODE.parent}:{farlight_test.BIN}:{os.environ['PATH']}", **given}
                result = subprocess.run(["bash", script, self.folder], env=environment, capture_output=True, text=True, check=False)
                self.assertEqual(result.returncode, 75, result.stderr)
                self.assertIn(f"openjd_fail: farlightd --listen unix:{self.folder}/farlight.sock --device {gpu} ended with status 3", result.stdout)

    def test_format_strings_name_what_there_is(self):
        for template in (self.template, self.still):
            self.names_what_there_is(template)

    def names_what_there_is(self, template):
        parameters = {one["name"] for one in template["parameterDefinitions"]}
        names = {f"{kind}.{name}" for name in parameters for kind in ("Param", "RawParam")} | {"Session.WorkingDirectory"}
        for step in template["steps"]:
            known = names | {f"Task.Param.{one['name']}" for one in step.get("parameterSpace", {}).get("taskParameterDefinitions", ())}
            known |= {f"Task.File.{one['name']}" for one in step["script"].get("embeddedFiles", ())}
            for environment in step.get("stepEnvironments", ()):
                known |= {f"Env.File.{one['name']}" for one in environment["script"]["embeddedFiles"]}
            for name in re.findall(r"{{\s*([\w.]+)\s*}}", json.dumps(step)):
                self.assertIn(name, known, step["name"])


class OneDaemonForManyTasks(Case):
    def test_the_second_task_sends_nothing_and_finds_the_same_daemon(self):
        environment = {**os.environ, "XDG_RUNTIME_DIR": str(self.folder), "FARLIGHT_GPU": "software", "FARLIGHT_UNUSED": "600",
                       "PATH": f"{farlight_test.BIN}:{os.environ['PATH']}"}
        environment.pop("FARLIGHT_SERVER", None)
        sent = []
        for task in range(2):
            result = subprocess.run([NODE, "farlight", "animate", bundled_scenes() / "teapot.glb", *SMALL, "--frames", "1", "-o",
                                     self.folder / f"{task}-%d.png", "--timings=json", "-q"], env=environment, stdout=subprocess.PIPE,
                                    stderr=subprocess.PIPE, text=True, check=False, timeout=farlight_test.TIMEOUT_S)
            self.expect(result, 0)
            sent += [json.loads(line)["uploaded_bytes"] for line in result.stdout.splitlines() if '"kind":"client"' in line]
        self.assertGreater(sent[0], 0)
        self.assertEqual(sent[1], 0)
        with socket.socket(socket.AF_UNIX) as connection:
            connection.connect(str(self.folder / f"farlight-{os.getuid()}/gpu-software.sock"))
            daemon, = struct.unpack_from("i", connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12))
        os.kill(daemon, signal.SIGTERM)

    def node(self, *command, **environment):
        environment = {**os.environ, "XDG_RUNTIME_DIR": str(self.folder), "PATH": f"{self.folder}:{farlight_test.BIN}:{os.environ['PATH']}",
                       "FARLIGHT_GPU": "software", **environment}
        environment.pop("FARLIGHT_SERVER", None)
        return subprocess.run([NODE, *command], env=environment, stderr=subprocess.PIPE, text=True, check=False,
                              timeout=farlight_test.TIMEOUT_S)

    def test_a_daemon_that_does_not_start_is_named_with_how_it_ended_and_its_log(self):
        folder = self.folder / f"farlight-{os.getuid()}"
        result = self.expect(self.node("true", FARLIGHT_GPU="77"), 75)  # there is none
        self.assertIn(f"farlightd --listen unix:{folder}/gpu-77.sock --device 77 ended with status ", result.stderr)
        self.assertRegex(result.stderr, rf"its log, {folder}/gpu-77.log:\n.*device.*77")
        fake, log = self.folder / "farlightd", folder / "gpu-software.log"
        for does, words in (("exit 3", "ended with status 3\n"), ("kill -9 $$", "ended with status 137, by signal 9\n"),
                            ("exec sleep 60", "has not answered for 1 s\n")):
            fake.write_text(f"#!/bin/sh\n{does}\n")
            fake.chmod(0o755)
            result = self.expect(self.node("true", FARLIGHT_START="1"), 75)
            self.assertEqual(result.stderr, "farlight-node: the daemon does not start: farlightd --listen "
                             f"unix:{folder}/gpu-software.sock --device software {words}farlight-node: it said nothing; its log, {log}, is empty\n")

    def test_the_gpu_that_the_queue_gave_is_taken(self):
        listed = "".join(f"{number}  {name}  (vendor, OpenGL 4.6{end})\n" for number, name, end in
                         ((0, "llvmpipe", ", software"), (1, "A40", ""), (2, "A40", ""), (4, "A40", ""), (5, "A40", "")))
        fake = self.folder / "farlightd"
        for given, hidden, gpu in (({}, False, "auto"), ({"SLURM_JOB_GPUS": "2"}, False, "4"), ({"CUDA_VISIBLE_DEVICES": "0"}, False, "1"),
                                   ({"SLURM_JOB_GPUS": "1,3", "SLURM_LOCALID": "1"}, False, "5"),
                                   ({"SLURM_JOB_GPUS": "1,3", "SLURM_LOCALID": "2"}, False, "2"),
                                   ({"SLURM_JOB_GPUS": "3", "CUDA_VISIBLE_DEVICES": "0"}, True, "1"), ({"SLURM_JOB_GPUS": "9"}, False, "auto"),
                                   ({"CUDA_VISIBLE_DEVICES": ""}, False, "software"), ({"CUDA_VISIBLE_DEVICES": "GPU-8932"}, False, "auto"),
                                   ({"SLURM_JOB_GPUS": "2", "FARLIGHT_GPU": "7"}, False, "7")):
            with self.subTest(given):
                shown = "\n".join(listed.splitlines()[:2]) if hidden else listed
                fake.write_text(f"#!/bin/sh\n[ \"$1\" != --list-devices ] || {{ cat <<'E'\n{shown}\nE\nexit; }}\nexit 3\n")
                fake.chmod(0o755)
                variables = {"FARLIGHT_GPU": "", **given}
                for name in GPU_VARIABLES:
                    os.environ.pop(name, None)
                self.assertIn(f" --device {gpu} ended", self.expect(self.node("true", **variables), 75).stderr)

    def test_an_element_of_an_array_alone_is_no_part_without_their_number(self):
        script = NODE.parent / "slurm.sbatch"
        fake = self.folder / "farlight-node"
        fake.write_text("#!/bin/sh\necho \"$@\"\n")
        fake.chmod(0o755)
        for low, high, count, parts, wanted in ((1, 4, 4, "", "3/4"), (3, 3, 1, "", None), (1, 5, 3, "", None), (3, 3, 1, "4", "3/4")):
            environment = {**os.environ, "PATH": f"{self.folder}:{os.environ['PATH']}", "MODEL": "m.glb", "FRAMES": "1-8", "OUTPUT": "%d.png",
                           "PARTS": parts, "SLURM_ARRAY_JOB_ID": "1", "SLURM_ARRAY_TASK_ID": "3", "SLURM_ARRAY_TASK_MIN": str(low),
                           "SLURM_ARRAY_TASK_MAX": str(high), "SLURM_ARRAY_TASK_COUNT": str(count)}
            result = subprocess.run(["bash", script], env=environment, capture_output=True, text=True, check=False)
            self.assertEqual(result.returncode, 0 if wanted else 2, result.stderr)
            self.assertIn(f"--shard {wanted} " if wanted else "give PARTS", result.stdout + result.stderr)

    def test_an_array_without_frames_renders_parts_of_a_still(self):
        fake = self.folder / "farlight-node"
        fake.write_text("#!/bin/sh\necho \"$@\"\n")
        fake.chmod(0o755)
        for output, wanted in (("a b.exr", "render -o a b.exr.parts/3-of-4.exr --parents --part 3/4 --resume"), ("%d.exr", None), ("x.png", None)):
            environment = {**os.environ, "PATH": f"{self.folder}:{os.environ['PATH']}", "MODEL": "m.glb", "FRAMES": "", "OUTPUT": output,
                           "PARTS": "", "SLURM_ARRAY_JOB_ID": "1", "SLURM_ARRAY_TASK_ID": "3", "SLURM_ARRAY_TASK_MIN": "1",
                           "SLURM_ARRAY_TASK_MAX": "4", "SLURM_ARRAY_TASK_COUNT": "4"}
            result = subprocess.run(["bash", NODE.parent / "slurm.sbatch"], env=environment, capture_output=True, text=True, check=False)
            self.assertEqual(result.returncode, 0 if wanted else 2, result.stderr)
            self.assertIn(wanted or f"OUTPUT, '{output}', is none: give FRAMES", result.stdout + result.stderr)

    def test_what_cannot_be_a_value_is_named(self):
        for command, environment, status, words in (
                ([], {}, 2, "no command is given"), (["true"], {"FARLIGHT_GPU": "../x"}, 2, "FARLIGHT_GPU is '../x'"),
                (["true"], {"FARLIGHT_START": "a[$(touch x)]"}, 2, "FARLIGHT_START is 'a[$(touch x)]'"),
                (["true"], {"XDG_RUNTIME_DIR": "/nowhere"}, 75, "/nowhere/farlight-")):
            with self.subTest(words):
                self.assertIn(words, self.expect(self.node(*command, **environment), status).stderr)


if __name__ == "__main__":
    unittest.main()
