# SPDX-License-Identifier: MIT
"""`farlightd --check-device`: rows with verdicts for people and for programs, and an exit status that sums them up."""
import json
import os
import subprocess

import farlight_test
from farlight_test import Case, tracers


def check_device(*arguments, **environment):
    return farlight_test.run("farlightd", "--check-device", *arguments, env={**os.environ, **environment})


class CheckDevice(Case):
    def rows(self, result):
        """Rows by what is checked; the last one sums them up."""
        rows, of_check = [json.loads(line) for line in result.stdout.splitlines()], {}
        for row in rows:
            self.assertEqual(set(row), {"check", "name", "verdict", "value", "bound", "unit", "text", "remedy"})
            of_check.setdefault(row["check"], {})[row["name"]] = row
        self.assertEqual(rows[-1]["check"], "all")
        self.assertEqual(set(of_check["rays"]), {tracer["name"] for tracer in tracers()})
        self.assertLessEqual({"path", "distributed", "raycast", "ao"}, set(of_check["picture"]))
        return rows, of_check

    @farlight_test.long_test
    def test_every_tracer_limit_and_program_of_this_device_holds(self):
        rows, of_check = self.rows(self.expect(check_device("--json"), 0))
        self.assertEqual({row["verdict"] for row in rows}, {"ok", "note"})
        self.assertGreater(len(of_check["program"]), 50)
        self.assertTrue(all(row["value"] > 0 for row in of_check["program"].values()))
        self.assertGreater(max(row["value"] for row in of_check["dispatch"].values()), 0)
        self.assertEqual(len(of_check["first hits"]), 3)

    def test_the_first_tracer_of_this_device_holds(self):
        """Up to its row, as it comes: the others take a minute."""
        process = subprocess.Popen([farlight_test.BIN / "farlightd", "--check-device", "--json"], stdout=subprocess.PIPE, text=True)
        with process.stdout as lines:
            for row in map(json.loads, lines):
                self.assertIn(row["verdict"], ("ok", "note"), row)
                if row["check"] == "rays":
                    break
        process.kill()
        process.wait()
        self.assertEqual((row["check"], row["name"], row["verdict"]), ("rays", "bvh", "ok"))

    def test_a_limit_of_memory_that_is_too_low_fails_what_needs_more(self):
        _, of_check = self.rows(self.expect(check_device("--json", FARLIGHT_MEMORY_DEVICE="2M"), 1))
        for row in of_check["limit"].values():
            self.assertGreaterEqual(row["value"], row["bound"], row)
        self.assertEqual(of_check["memory"]["a byte beyond the limit"]["text"], "is refused")
        self.assertEqual((of_check["memory"]["64 MiB are written and read"]["verdict"], of_check["rays"]["bvh"]["verdict"]),
                         ("failed", "failed"))
        self.assertRegex(of_check["all"]["failed checks"]["text"], r"^\d+ of \d+$")

    def test_a_device_that_is_not_there_is_a_row_and_exit_1(self):
        result = self.expect(check_device("--json", "--device", "1000"), 1)
        rows = [json.loads(line) for line in result.stdout.splitlines()]
        self.assertEqual([row["verdict"] for row in rows], ["failed", "failed"])
        self.assertIn("1000", rows[0]["text"])
        self.assertIn("--list-devices", rows[0]["remedy"])

    def test_a_device_is_listed_with_its_way_to_first_hits_and_its_workers(self):
        with farlight_test.Daemon() as daemon:
            self.expect(farlight_test.run("farlight", "ping", "--server", daemon.address, "--count", "1"), 0)
            lines = self.expect(farlight_test.run("farlightd", "--list-devices"), 0).stdout.splitlines()
            workers = [f"   worker 1: user {os.geteuid()} (process {worker})" for worker in daemon.workers()]
        self.assertEqual(len(workers), 1)
        self.assertIn(workers[0], lines)
        lines = [line for line in lines if not line.startswith("   worker ")]  # there may be other daemons
        self.assertGreaterEqual(len(lines), 2)
        for device, way in zip(lines[::2], lines[1::2]):
            self.assertRegex(device, r"^[0-9]+  ")
            self.assertRegex(way, r"^   first hits are (rasterised|traced of|traced from)")

    def test_json_alone_is_wrong_usage(self):
        self.expect(farlight_test.run("farlightd", "--json"), 2)
