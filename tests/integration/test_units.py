# SPDX-License-Identifier: MIT
"""conf/farlightd.service and conf/farlightd.socket under a real systemd, where one can be started for the purpose."""
import os
import shutil
import stat
import subprocess
import time
import unittest

from farlight_test import BIN, ROOT, TIMEOUT_S, bundled_scenes
from systemd_root import CannotBoot, SystemdRoot

SERVICE, SOCKET = "farlightd.service", "farlightd.socket"
FOLDER = "/run/farlight"
PATH = f"{FOLDER}/farlight.sock"
CONFIGURATION = "/etc/farlight/farlightd.conf"
DROP_IN = f"/etc/systemd/system/{SERVICE}.d/test.conf"
SCENE = "/srv/scene.nff"
INSTALLED = {"conf/farlightd.service": f"/usr/local/lib/systemd/system/{SERVICE}",
             "conf/farlightd.socket": f"/usr/local/lib/systemd/system/{SOCKET}",
             "conf/sysusers.conf": "/usr/local/lib/sysusers.d/farlight.conf",
             "conf/farlightd.conf": CONFIGURATION}
PROGRAMS = ("farlightd", "farlight", "farlight-import", "farlight-textures.so", "farlight-assimp.so", "farlight-export",
            "farlight-images.so")
USERS = "u member -\nm member farlight\nu stranger -\n"

SANITIZED = b"__asan_init" in (BIN / "farlightd").read_bytes()


@unittest.skipIf(SANITIZED, "sanitizers do not run within the limits of the service")
class Units(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        try:
            cls.root = SystemdRoot()
            cls.root.__enter__()
        except CannotBoot as reason:
            raise unittest.SkipTest(f"no systemd can be started here: {reason}") from reason
        cls.addClassCleanup(cls.root.__exit__)
        for source, target in INSTALLED.items():
            cls.put(ROOT / source, target)
        for program in PROGRAMS:
            cls.put(BIN / program, f"/usr/local/bin/{program}")
        cls.put(bundled_scenes() / "sphereflake-2.nff", SCENE)
        cls.write("/run/sysusers.d/users.conf", USERS)
        if (made := cls.root.run("systemd-sysusers")).returncode:
            raise AssertionError(made.stderr)

    @classmethod
    def put(cls, source, target):
        cls.root.path(target).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, cls.root.path(target))

    @classmethod
    def write(cls, target, text):
        cls.root.path(target).parent.mkdir(parents=True, exist_ok=True)
        cls.root.path(target).write_text(text)

    def setUp(self):
        self.addCleanup(self.as_it_was)
        self.systemctl("daemon-reload")
        self.systemctl("start", SOCKET)

    def as_it_was(self):
        self.root.run("systemctl", "stop", SOCKET, SERVICE)
        self.root.run("systemctl", "reset-failed")
        self.root.path(DROP_IN).unlink(missing_ok=True)
        shutil.copy(ROOT / "conf/farlightd.conf", self.root.path(CONFIGURATION))

    def succeed(self, *command, **options):
        result = self.root.run(*command, timeout=TIMEOUT_S, **options)
        if result.returncode:
            self.fail(f"{command}: {result.returncode}\n{result.stdout}\n{result.stderr}\n{self.journal()}")
        return result.stdout

    def systemctl(self, *arguments):
        return self.succeed("systemctl", *arguments)

    def journal(self):
        self.root.run("journalctl", "--sync")
        return self.root.run("journalctl", "--no-pager", f"--unit={SERVICE}").stdout

    def shown(self, name, unit=SERVICE):
        return self.systemctl("show", f"--property={name}", "--value", unit).strip()

    def stats(self, user="member"):
        return self.root.run("farlight", "stats", "--server", f"unix:{PATH}", user=user, timeout=TIMEOUT_S)

    def assert_served(self):
        result = self.stats()
        self.assertEqual(result.returncode, 0, f"{result.stderr}\n{self.journal()}")

    def assert_mode(self, path, mode):
        self.assertEqual(oct(stat.S_IMODE(self.root.path(path).stat().st_mode)), oct(mode), path)

    def drop_in(self, text):
        self.write(DROP_IN, f"[Service]\n{text}\n")
        self.systemctl("daemon-reload")

    def kill(self, signal_name):
        self.systemctl("kill", f"--signal={signal_name}", SERVICE)

    def test_systemd_finds_nothing_amiss_in_them(self):
        result = self.root.run("systemd-analyze", "verify", "--man=no", SERVICE, SOCKET)
        about_ours = [line for line in result.stderr.splitlines() if "farlightd" in line]
        self.assertEqual((result.returncode, about_ours), (0, []))

    def test_the_first_member_starts_it_and_strangers_stay_out(self):
        self.assert_mode(PATH, 0o660)
        for state in ("inactive", "active"):  # not by the socket alone, nor once the service has its folder
            refused = self.stats("stranger")
            self.assertEqual(refused.returncode, 1)
            self.assertIn("Permission denied", refused.stderr)
            self.assertEqual(self.shown("ActiveState"), state)
            self.assert_served()
        self.assert_mode(FOLDER, 0o755)
        self.systemctl("stop", SERVICE)
        self.assertEqual((self.shown("Result"), self.shown("ExecMainStatus")), ("success", "0"))
        self.assert_served()

    def test_it_is_enabled_and_started_by_one_command(self):
        """That of farlight-guide(7)."""
        self.systemctl("stop", SOCKET)
        self.systemctl("enable", "--now", "farlightd")
        self.assertEqual(self.shown("ActiveState"), "active")
        self.assert_served()
        self.systemctl("disable", "--now", "farlightd")

    def test_without_systemd_it_listens_at_the_same_address_for_the_same_users(self):
        self.systemctl("stop", SOCKET)
        self.systemctl("start", SERVICE)
        self.assert_mode(PATH, 0o660)
        self.assert_served()
        self.assertEqual(self.stats("stranger").returncode, 1)
        self.systemctl("stop", SERVICE)
        self.assertFalse(self.root.path(PATH).exists())
        self.assertTrue(self.root.path(FOLDER).is_dir())

    def test_it_renders_with_all_restrictions_on(self):
        self.succeed("farlight", "render", SCENE, "--server", f"unix:{PATH}", "-o", "/tmp/picture.png", "--size", "32x18",
                     user="member")
        pid = self.shown("MainPID")
        status = dict(line.split(":", 1) for line in self.root.path(f"/proc/{pid}/status").read_text().splitlines())
        self.assertEqual([status[name].strip().lstrip("0") for name in ("NoNewPrivs", "Seccomp", "CapBnd", "CapEff")],
                         ["1", "2", "", ""])
        for path, writable in (("/usr", False), ("/etc", False), ("/var", False), ("/home", False), (FOLDER, True),
                               ("/var/cache/farlight", True), ("/tmp", True)):
            touched = self.root.run("nsenter", f"--target={pid}", "--mount", "touch", f"{path}/touched")
            self.assertEqual(touched.returncode == 0, writable, f"{path}: {touched.stderr}")
        self.assertFalse(self.root.path("/tmp/touched").exists(), "its temporary files are its own")

    def test_its_memory_threads_and_core_files_are_limited(self):
        self.assert_served()
        memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        self.assertLess(int(self.shown("MemoryMax")), memory)
        self.assertGreater(int(self.shown("MemoryMax")), memory // 2)
        front = self.shown("MainPID")
        workers = self.root.path(f"/proc/{front}/task/{front}/children").read_text().split()
        threads = [thread for process in (front, *workers) for thread in self.root.path(f"/proc/{process}/task").iterdir()]
        self.assertLess(100 * len(threads), int(self.shown("TasksMax")))  # room for so many workers
        self.assertEqual((self.shown("TasksMax"), self.shown("LimitCORE")), ("16384", "0"))

    def test_a_reload_is_answered_and_a_broken_configuration_changes_nothing(self):
        self.assert_served()
        pid = self.shown("MainPID")
        for level, said in (("debug", "was read again"), ("nonsense", "stays as it was")):
            self.write(CONFIGURATION, f"[server]\nlog_level = {level}\n")
            self.systemctl("reload", SERVICE)
            end = time.monotonic() + TIMEOUT_S
            while said not in self.journal() and time.monotonic() < end:
                time.sleep(0.1)
            self.assertIn(said, self.journal())
        self.assertEqual((self.shown("MainPID"), self.shown("ActiveState")), (pid, "active"))

    def test_a_client_that_connects_after_a_kill_waits_for_the_restart(self):
        self.assert_served()
        self.kill("KILL")
        self.assert_served()
        self.assertEqual(self.shown("NRestarts"), "1")

    def test_one_that_hangs_is_ended_and_started_again(self):
        self.drop_in("WatchdogSec=3\nRestartSec=100ms")
        self.assert_served()
        self.kill("STOP")
        self.assert_served()
        self.assertGreaterEqual(int(self.shown("NRestarts")), 1)
        self.assertIn("Watchdog timeout", self.journal())

    def test_however_often_it_fails_it_is_tried_again(self):
        """As with a driver that is not there for a while; systemd gives up after five times unless told otherwise."""
        self.drop_in(f"ExecStart=\nExecStart=/bin/sh -c 'exit {os.EX_TEMPFAIL}'\nRestartSec=50ms")
        client = self.root.inside("farlight", "stats", "--server", f"unix:{PATH}", user="member")
        with subprocess.Popen(client, stdout=subprocess.DEVNULL) as waiting:
            end = time.monotonic() + TIMEOUT_S
            while (failed := int(self.shown("NRestarts"))) < 7 and time.monotonic() < end:
                time.sleep(0.1)
            self.assertGreaterEqual(failed, 7)
            self.assertEqual(self.shown("ActiveState", SOCKET), "active")
            self.root.path(DROP_IN).unlink()
            self.systemctl("daemon-reload")
            self.assertEqual(waiting.wait(TIMEOUT_S), 0)


if __name__ == "__main__":
    unittest.main()
