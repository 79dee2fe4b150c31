# SPDX-License-Identifier: MIT
"""`farlight stats --prometheus`: read by Prometheus' own parser, and what the dashboard asks for is there."""
import collections
import json
import pathlib
import re
import shutil
import stat
import subprocess
import unittest

from farlight_test import Case, Daemon, bundled_scenes, farlight

DASHBOARD = pathlib.Path(__file__).parents[2] / "conf/examples/grafana-dashboard.json"


# Packages of Debian come for Debian's own Python.
PARSE = """
import json, sys
from prometheus_client.parser import text_string_to_metric_families
print(json.dumps([[sample.name, sorted(sample.labels.items()), sample.value]
                  for family in text_string_to_metric_families(sys.stdin.read()) for sample in family.samples]))
"""


def metrics(text):
    """By name and labels: name -> {labels: value}."""
    result = subprocess.run(["/usr/bin/python3", "-c", PARSE], input=text, stdout=subprocess.PIPE, text=True, check=True)
    found = collections.defaultdict(dict)
    for name, labels, value in json.loads(result.stdout):
        found[name][tuple(map(tuple, labels))] = value
    return found


class Metrics(Case):
    def setUp(self):
        super().setUp()
        if subprocess.run(["/usr/bin/python3", "-c", "import prometheus_client"], stderr=subprocess.DEVNULL, check=False).returncode:
            self.skipTest("python3-prometheus-client is not installed")

    def test_the_figures_are_those_of_json_and_the_dashboard_finds_its_own(self):
        path = self.folder / "farlight.prom"
        with Daemon() as daemon:
            self.expect(farlight("render", bundled_scenes() / "cornell.glb", "-o", self.folder / "x.png", "--size", "32x32", "--server", daemon.address), 0)
            printed = self.expect(farlight("stats", "--prometheus", "--server", daemon.address), 0).stdout
            self.expect(farlight("stats", f"--prometheus={path}", "--server", daemon.address), 0)
            record = json.loads(self.expect(farlight("stats", "--json", "--server", daemon.address), 0).stdout)
        found = metrics(printed)
        self.assertEqual(found["farlight_up"], {(): 1})
        for name, key in (("frames_total", "frames"), ("rays_total", "rays"), ("scenes", None), ("host_memory_limit_bytes", "host_limit_bytes"),
                          ("device_objects", "device_objects")):
            self.assertEqual(found[f"farlight_{name}"][()], record[key] if key else len(record["scenes"]), name)
        stages = {(("clock", stage["clock"]), ("stage", stage["stage"])): stage for stage in record["stages"]}
        self.assertTrue(stages)
        spans, seconds = found["farlight_stage_spans_total"], found["farlight_stage_seconds_total"]
        for key, stage in stages.items():
            if stage["stage"] in ("trace", "shade"):  # others may run between the two questions
                self.assertEqual(spans[key], stage["count"])
                self.assertAlmostEqual(seconds[key], stage["total_ns"] * 1e-9, delta=1e-9)
        labels = dict(next(iter(found["farlight_build_info"])))
        self.assertEqual({key: labels[key] for key in ("version", "device")}, {key: record[key] for key in ("version", "device")})
        self.assertEqual(set(metrics(path.read_text())), set(found))
        self.assertEqual(stat.S_IMODE(path.stat().st_mode), 0o644)  # node_exporter has a user of its own
        asked = set(re.findall(r"farlight_\w+", DASHBOARD.read_text()))
        self.assertGreater(len(asked), 8)
        self.assertLessEqual(asked, set(found))

    @unittest.skipUnless(shutil.which("promtool"), "no promtool, which Debian's package prometheus has")
    def test_prometheus_own_tool_finds_no_fault(self):
        """Neither in the text nor in what the dashboard asks."""
        with Daemon() as daemon:
            printed = self.expect(farlight("stats", "--prometheus", "--server", daemon.address), 0).stdout
        questions = re.findall(r'"expr": ("(?:[^"\\]|\\.)*")', DASHBOARD.read_text())
        self.assertGreater(len(questions), 8)
        rules = self.folder / "rules.yml"
        rules.write_text("groups:\n- name: dashboard\n  rules:\n" + "".join(
            f"  - {{record: asked{number}, expr: {question.replace('$__rate_interval', '1m')}}}\n"
            for number, question in enumerate(questions)))
        for arguments, text in ((["metrics"], printed), (["rules", rules], "")):
            done = subprocess.run(["promtool", "check", *arguments], input=text, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                  text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stdout)

    def test_a_daemon_that_is_away_is_a_figure_too(self):
        path = self.folder / "farlight.prom"
        self.expect(farlight("stats", f"--prometheus={path}", "--server", f"unix:{self.folder}/none"), 75)
        self.assertEqual(metrics(path.read_text()), {"farlight_up": {(): 0}})
        self.assertEqual([entry.name for entry in self.folder.iterdir()], [path.name])

    def test_what_cannot_be_written_or_meant_is_said(self):
        with Daemon() as daemon:
            result = self.expect(farlight("stats", f"--prometheus={self.folder}/none/x.prom", "--server", daemon.address), 1)
        self.assertIn("none/x.prom", result.stderr)
        result = self.expect(farlight("stats", "--prometheus", "--json", "--server", "unix:/nonexistent"), 2)
        self.assertIn("--prometheus", result.stderr)


if __name__ == "__main__":
    unittest.main()
