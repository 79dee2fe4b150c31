# SPDX-License-Identifier: MIT
"""`farlight tracers`, and that the command line, the environment, the schema of shot files, the manual and the shell's
completion all offer what it lists."""
import json
import os
import subprocess

import farlight_test
from farlight_test import BIN, farlight, tracers


class Tracers(farlight_test.Case):
    def settings(self):
        return [setting for tracer in tracers() for setting in tracer["settings"]]

    def test_every_tracer_says_what_it_is(self):
        names = [tracer["name"] for tracer in tracers()]
        self.assertEqual(names, ["bvh", "naive", "reference", "ldc", "abuffer", "rayspace", "quadtree"])
        text = self.expect(farlight("tracers"), 0).stdout
        for tracer in tracers():
            self.assertIn(f"{tracer['name']}: {tracer['doc']}", text)
            for setting in tracer["settings"]:
                self.assertTrue(setting["name"].startswith(tracer["name"] + "_"))
                self.assertIn(setting["option"], text)

    def test_every_setting_is_offered_everywhere(self):
        schema = json.loads((BIN / "shot.schema.json").read_text())["properties"]
        manual = (BIN / "man/farlight.1").read_text()
        helps = {command: self.expect(farlight(command, "--help"), 0).stdout for command in ("render", "animate")}
        self.assertIn("Experiments", helps["render"])
        for setting in self.settings():
            with self.subTest(setting=setting["name"]):
                self.assertIn(setting["name"], schema)
                self.assertIn(f".It Fl -{setting['option'][2:]} ", manual)
                for text in helps.values():
                    self.assertIn(setting["option"] + "=", text)
        self.assertNotIn("@SETTINGS@", schema)
        self.assertNotIn("@TRACERS@", manual)

    def test_a_wrong_setting_is_refused_by_its_variable(self):
        for setting in self.settings():
            variable = "FARLIGHT_" + setting["name"].upper()
            result = subprocess.run([BIN / "farlight", "render", "x.glb", "-o", "x.png"], capture_output=True, text=True,
                                    env={**os.environ, variable: "nonsense"}, check=False)
            with self.subTest(variable=variable):
                self.assertEqual(result.returncode, 2)
                self.assertIn(variable, result.stderr)

    def test_the_shell_completes_options_and_their_values(self):
        def completed(*words, function="_farlight"):
            script = (f"source {farlight_test.ROOT}/client/cli/completion.bash; COMP_WORDS=({' '.join(words)}); "
                      f"COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); {function}; printf '%s\\n' \"${{COMPREPLY[@]}}\"")
            return subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True).stdout.split()
        program = str(BIN / "farlight")
        self.assertEqual(completed(program, "tra"), ["tracers"])
        self.assertEqual(completed(program, "render", "--ldc-bl"), ["--ldc-block"])
        self.assertEqual(completed(program, "render", "--ldc-levels", "py"), ["pyramid"])
        self.assertEqual(completed(program, "render", "--ldc-block", "1"), ["16"])
        self.assertIn("naive", completed(program, "render", "--tracer", "''"))
        self.assertEqual(completed(program, "render", "--metadata", "f"), ["full"])

        def others(name, *words):
            return completed(str(BIN / name), *words, function="_farlight_program")
        self.assertEqual(others("farlightd", "--key"), ["--key-file"])
        self.assertEqual(others("farlightd", "--device", "s"), ["software"])
        self.assertEqual(others("farlightd", "--log-level", "d"), ["debug"])
        self.assertEqual(others("farlight-view", "--tracer", "nai"), ["naive"])
        self.assertEqual(others("farlight-view", "--headl"), ["--headless"])
        self.assertEqual(others("farlight-import", "--env"), ["--environment", "--environment-rotation"])
        self.assertEqual(others("farlight-import", "--va"), ["--variant"])
        self.assertEqual(others("farlight-export", "--full"), ["--full-metadata"])
        self.assertEqual(others("farlight-video", "--fo"), ["--folder"])


if __name__ == "__main__":
    farlight_test.unittest.main()
