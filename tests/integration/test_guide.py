# SPDX-License-Identifier: MIT
"""Every command of farlight-guide(7) is run, in its order, as it stands there; ELSEWHERE names who runs the others."""
import os
import pathlib
import re
import shlex
import shutil
import socket
import subprocess
import unittest

import farlight_test
from farlight_test import BIN, Case, Daemon, bundled_scenes, long_test

ROOT = pathlib.Path(__file__).parents[2]
# Commands within a sentence, which need a system of their own, or minutes: the test that runs them.
ELSEWHERE = {"systemctl enable --now farlightd": "test_units.py", "farlightd --check-device": "test_check_device.py"}
# The other host is this one, with a daemon of this test in place of its service's: -T -- HOST farlight bridge unix:..
SSH = """#!/bin/sh
exec farlight bridge "$THERE"
"""


def commands():
    """By part of the page."""
    parts, title = {}, None
    for line in (ROOT / "conf/man/farlight-guide.7").read_text().splitlines():
        if line.startswith(".Sh "):
            title = line[4:]
        elif line.startswith(".Dl "):
            parts.setdefault(title, []).append(line[4:])
    return parts


class Guide(Case):
    def setUp(self):
        super().setUp()
        (self.folder / "bin").mkdir()
        (self.folder / "bin/ssh").write_text(SSH)
        (self.folder / "bin/ssh").chmod(0o755)
        work = self.folder / "work"
        (work / "models").mkdir(parents=True)
        shutil.copy(bundled_scenes() / "teapot.glb", work / "model.glb")
        shutil.copy(bundled_scenes() / "cornell.glb", work / "models")
        for name in ("carousel.glb", "dusk.hdr"):
            shutil.copy(bundled_scenes() / name, work)
        shutil.copy(ROOT / "conf/examples/shot.json", work)
        there = self.enterContext(Daemon())
        with socket.create_server(("127.0.0.1", 0)) as free:
            self.port = free.getsockname()[1]
        self.environment = {**os.environ, "PATH": f"{self.folder}/bin:{BIN}:{ROOT}/conf/farm:{os.environ['PATH']}",
                            "XDG_RUNTIME_DIR": str(self.folder), "XDG_STATE_HOME": str(self.folder), "FARLIGHT_SIZE": "48x32",
                            "FARLIGHT_SAMPLES": "1", "FARLIGHT_GPU": "software", "THERE": there.address, "FARLIGHT_UNUSED": "1"}
        self.environment.pop("FARLIGHT_SERVER", None)
        self.work = work

    def here(self, command):
        """The page's host and port are this one's; a picture of few samples has all the noise that it may have."""
        return command.replace("gpu-host:4170", f"127.0.0.1:{self.port}").replace("0.0.0.0:4170", f"127.0.0.1:{self.port}")

    def run_part(self, title, display=None):
        """One shell for all of it, as one person has. A window is closed as soon as it shows a picture."""
        lines = ["trap 'kill $(jobs -p) 2>/dev/null; wait' EXIT"]
        for command in commands()[title]:
            here = self.here(command)
            if here.startswith("farlight view "):
                if not display:
                    continue
                here = f"{{ timeout --signal=TERM 4 {here}; test $? -eq 124; }}"
            lines += [f"echo {shlex.quote('$ ' + command)}", here if here.endswith("&") else f"{here} || exit 1"]
            if here.startswith("farlightd --listen"):
                address = shlex.split(here)[2].replace("$PWD", str(self.work))
                key = " --key my.key" if "--key-file" in here else ""
                lines.append(f"until farlight ping --count 1 --server {address}{key} >/dev/null 2>&1; do sleep 0.1; done")
            if here.startswith("farlight serve"):
                lines[-1] = here[:-1] + ">serving.txt &"
                lines.append("until grep -q 'view it with' serving.txt; do sleep 0.1; done")
        environment = {**self.environment, **({"DISPLAY": display} if display else {})}
        result = subprocess.run(["bash", "-c", "\n".join(lines)], cwd=self.work, env=environment, stdout=subprocess.PIPE,
                                stderr=subprocess.STDOUT, text=True, check=False, timeout=farlight_test.TIMEOUT_S)
        self.assertEqual(result.returncode, 0, result.stdout[-3000:])
        return result.stdout

    @long_test
    def test_looking_at_models(self):
        if not shutil.which("Xvfb"):
            self.skipTest("no Xvfb")
        reading, writing = os.pipe()
        xvfb = subprocess.Popen(["Xvfb", "-displayfd", str(writing), "-screen", "0", "320x200x24"], pass_fds=[writing],
                                stderr=subprocess.DEVNULL)
        self.addCleanup(xvfb.wait)
        self.addCleanup(xvfb.terminate)
        os.close(writing)
        with os.fdopen(reading) as pipe:
            display = f":{pipe.readline().strip()}"
        self.run_part("LOOKING AT MODELS", display)
        self.assertEqual({path.name for path in self.work.glob("*.png")},
                         {f"{name}.png" for name in ("picture", "iso", "clean", "quick", "sheet", "remote", "sealed", "brighter")})
        self.assertGreater((self.work / "around.mp4").stat().st_size, 1000)

    def test_a_render_farm(self):
        text = self.run_part("A RENDER FARM")
        for word in ("8 pictures, 8 good", "7 of 8 frames exist already", "farlight_up 1"):
            self.assertIn(word, text)

    def test_scripts(self):
        text = self.run_part("SCRIPTS")
        self.assertIn("36 frames would be rendered", text)

    def test_when_something_is_wrong(self):
        self.assertIn("OpenGL", self.run_part("WHEN SOMETHING IS WRONG"))

    def test_no_command_is_left_out(self):
        page = (ROOT / "conf/man/farlight-guide.7").read_text()
        self.assertEqual(set(re.findall(r"Ql ((?:farlight|systemctl)\S* .*?)(?: :)?$", page, re.MULTILINE)), set(ELSEWHERE))
        for command, module in ELSEWHERE.items():
            self.assertIn(f'"{command.split()[1]}"', (ROOT / "tests/integration" / module).read_text())
        self.assertEqual(set(commands()), {"LOOKING AT MODELS", "A RENDER FARM", "SCRIPTS", "WHEN SOMETHING IS WRONG"})


if __name__ == "__main__":
    unittest.main()
