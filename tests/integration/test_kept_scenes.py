# SPDX-License-Identifier: MIT
"""Scenes on disk: what a daemon that was killed had, the next one has."""
import json
import os
import signal
import struct

from farlight_test import Case, Daemon, bundled_scenes, farlight, read_png
from test_daemon import OK, SCENE_OPEN, SET_NODE, named, set_node, text
from test_serve import KEPT, Serving, Viewer, wait_until
from test_staying_up import Manager


class KeptScenes(Case):
    def setUp(self):
        super().setUp()
        self.store = self.folder / "store"
        self.own = self.store / f"{os.getuid():016x}"  # of this user

    def daemon(self, **options):
        environment = {**os.environ, "FARLIGHT_SCENES_STORE": str(self.store)}
        environment.update({f"FARLIGHT_{name.upper()}": str(value) for name, value in options.items()})
        return Daemon(environment=environment)

    def records(self):
        folder = self.own / "scenes"
        return sorted(entry.name for entry in folder.iterdir() if "." not in entry.name) if folder.exists() else []

    def scenes(self, daemon):
        result = self.expect(farlight("scenes", "--json", "--server", daemon.address), 0)
        return [json.loads(line) for line in result.stdout.splitlines()]

    def picture(self, daemon, name):
        path = self.folder / "picture.png"
        self.expect(farlight("render", "--scene", name, "--server", daemon.address, "--size", "64x48", "-o", path), 0)
        return read_png(path)

    def kill(self, daemon):
        daemon.stop(signal.SIGKILL)

    def test_scenes_of_a_killed_daemon_come_back(self):
        models = {name: bundled_scenes() / name for name in ("teapot.glb", "cornell.glb", "sphereflake-2.nff")}
        before = {}
        with self.daemon() as daemon:
            for name, path in models.items():
                with Serving(path, "--server", daemon.address):
                    before[name] = self.picture(daemon, name)
            wait_until(lambda: len(self.records()) == len(models), f"only {len(self.records())} scenes are written")
            told = self.scenes(daemon)
            self.kill(daemon)
        with self.daemon() as daemon:
            self.assertEqual(self.scenes(daemon), told)
            for name in models:
                with self.subTest(scene=name):
                    self.assertEqual(self.picture(daemon, name), before[name])
            self.assertEqual(daemon.stop(), 0)
            self.assertEqual(daemon.messages().count("restored scene"), len(models))

    def test_edits_and_kept_scenes_come_back_too(self):
        with self.daemon() as daemon:
            with Serving(bundled_scenes() / "teapot.glb", "--server", daemon.address, "--name", "pot"):
                one = Viewer(daemon.path, "pot")
                self.addCleanup(one.close)
                one.send(SCENE_OPEN, 2, struct.pack("<II", 2, KEPT), text("mine"))
                self.assertEqual(one.answer(2)[0], OK)
                one.scene = 2
                self.assertEqual(one.edit(3, SET_NODE, set_node(1), named("a node"))[0], OK)
                one.scene = 1
                self.assertEqual(one.edit(4, SET_NODE, set_node(1 << 30), named("another"))[0], OK)
                wait_until(lambda: len(self.records()) == 2, "the scenes are not written")
                # What changes right before the daemon is told to stop is not lost.
                self.assertEqual(one.edit(5, SET_NODE, set_node(1 << 30), named("the same"))[0], OK)
                self.assertEqual(daemon.stop(signal.SIGTERM), 0)
        with self.daemon() as daemon:
            self.assertEqual([(scene["name"], scene["sharing"], scene["revision"]) for scene in self.scenes(daemon)],
                             [("mine", "kept", 1), ("pot", "shared", 3)])

    def test_a_scene_that_ends_is_removed_with_its_blobs(self):
        with self.daemon(limits_scene_linger=1) as daemon:
            with Serving(bundled_scenes() / "teapot.glb", "--server", daemon.address) as serving:
                wait_until(self.records, "the scene is not written")
                serving.stop()
            wait_until(lambda: not self.scenes(daemon), "the scene stays")
            wait_until(lambda: not any((self.own / "blobs").iterdir()), "its blobs stay")
            self.assertEqual(self.records(), [])

    def test_what_was_tampered_with_is_left_out_and_the_rest_is_there(self):
        with self.daemon() as daemon:
            for name in ("teapot.glb", "cornell.glb", "sphereflake-2.nff"):
                with Serving(bundled_scenes() / name, "--server", daemon.address):
                    pass
            expected = len(self.scenes(daemon))
            wait_until(lambda: len(self.records()) == expected, "the scenes are not written")
            self.kill(daemon)
        self.assertEqual(expected, 3)
        record = self.own / "scenes" / self.records()[0]
        data = bytearray(record.read_bytes())
        data[-1] ^= 1
        record.write_bytes(data)
        with self.daemon() as daemon:
            self.assertEqual(len(self.scenes(daemon)), expected - 1)
            self.assertIn("no scene that can be restored", daemon.messages())
        blob = next((self.own / "blobs").iterdir())
        data = bytearray(blob.read_bytes())
        data[0] ^= 1
        blob.write_bytes(data)
        with self.daemon() as daemon:
            self.assertLess(len(self.scenes(daemon)), expected - 1)
            self.assertIn("cannot be restored", daemon.messages())

    def test_a_scene_on_which_the_daemon_ended_is_tried_once(self):
        with self.daemon() as daemon:
            with Serving(bundled_scenes() / "teapot.glb", "--server", daemon.address):
                wait_until(self.records, "the scene is not written")
            self.kill(daemon)
        record = self.own / "scenes" / self.records()[0]
        record.rename(record.with_suffix(".trying"))
        with self.daemon() as daemon:
            self.assertEqual(self.scenes(daemon), [])
            self.assertIn("ended while it restored", daemon.messages())
        self.assertEqual(self.records(), [])

    def test_the_service_manager_waits_while_scenes_are_restored(self):
        with self.daemon() as daemon:
            with Serving(bundled_scenes() / "teapot.glb", "--server", daemon.address):
                wait_until(self.records, "the scene is not written")
            self.kill(daemon)
        manager = Manager(self.folder)
        self.addCleanup(manager.close)
        with Daemon(environment=manager.environment(FARLIGHT_SCENES_STORE=str(self.store))):
            self.assertIn("EXTEND_TIMEOUT_USEC", manager.hear())
            self.assertEqual(manager.wait_for("READY"), {"READY": "1"})

    def test_a_folder_of_another_daemon_or_for_others_is_refused(self):
        with self.daemon():
            with self.assertRaises(AssertionError) as refused, self.daemon():
                pass
            self.assertIn("another daemon uses the folder", str(refused.exception))
            self.assertIn("scenes.store", str(refused.exception))
        self.store.chmod(0o755)
        with self.assertRaises(AssertionError) as refused, self.daemon():
            pass
        self.assertIn("0700", str(refused.exception))
