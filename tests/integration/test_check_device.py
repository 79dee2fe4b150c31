# SPDX-License-Identifier: MIT
"""`farlightd --check-device`: rows with verdicts for people and for programs, and an exit status that sums them up."""
import json
import os

import farlight_test
from farlight_test import Case, tracers


def check_device(*arguments, **environment):
    return farlight_test.run("farlightd", "--check-device", *arguments, env={**os.environ, **environment})


class CheckDevice(Case):
    def test_every_tracer_limit_and_program_of_this_device_holds(self):
        result = self.expect(check_device("--json"), 0)
        rows = [json.loads(line) for line in result.stdout.splitlines()]
        for row in rows:
            self.assertEqual(set(row), {"check", "name", "verdict", "value", "bound", "unit", "text", "remedy"})
            self.assertIn(row["verdict"], ("ok", "note"), row)
        self.assertEqual(rows[-1]["check"], "all")
        of_check = {}
        for row in rows:
            of_check.setdefault(row["check"], []).append(row)
        self.assertEqual({row["name"] for row in of_check["rays"]}, {tracer["name"] for tracer in tracers()})
        self.assertLessEqual({"path", "distributed", "raycast", "ao"}, {row["name"] for row in of_check["picture"]})
        for row in of_check["limit"]:
            self.assertGreaterEqual(row["value"], row["bound"], row)
        memory = {row["name"]: row for row in of_check["memory"]}
        self.assertEqual(memory["a byte beyond the limit"]["text"], "is refused")
        self.assertGreater(len(of_check["program"]), 50)
        self.assertTrue(all(row["value"] > 0 for row in of_check["program"]))
        self.assertGreater(of_check["dispatch"][0]["value"], 0)
        self.assertEqual(len(of_check["first hits"]), 3)

    def test_a_limit_of_memory_that_is_too_low_fails_what_needs_more(self):
        result = self.expect(check_device(FARLIGHT_MEMORY_DEVICE="2M"), 1)
        failed = [line for line in result.stdout.splitlines() if line.startswith("FAILED")]
        self.assertTrue(any("memory" in line and "64 MiB" in line for line in failed), result.stdout)
        self.assertTrue(any(" bvh " in line for line in failed), result.stdout)
        self.assertIn(" of ", failed[-1])

    def test_a_device_that_is_not_there_is_a_row_and_exit_1(self):
        result = self.expect(check_device("--json", "--device", "1000"), 1)
        rows = [json.loads(line) for line in result.stdout.splitlines()]
        self.assertEqual([row["verdict"] for row in rows], ["failed", "failed"])
        self.assertIn("1000", rows[0]["text"])
        self.assertIn("--list-devices", rows[0]["remedy"])

    def test_a_device_is_listed_with_its_way_to_first_hits(self):
        lines = self.expect(farlight_test.run("farlightd", "--list-devices"), 0).stdout.splitlines()
        self.assertGreaterEqual(len(lines), 2)
        for device, way in zip(lines[::2], lines[1::2]):
            self.assertRegex(device, r"^[0-9]+  ")
            self.assertRegex(way, r"^   first hits are (rasterised|traced of|traced from)")

    def test_json_alone_is_wrong_usage(self):
        self.expect(farlight_test.run("farlightd", "--json"), 2)
