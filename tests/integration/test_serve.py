# SPDX-License-Identifier: MIT
"""Scenes that are up for others: `farlight serve`, `farlight scenes`, and several clients on one scene.

What clients of the command line do not do, edits and the news of them, is done by clients of raw bytes.
"""
import json
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import threading
import time

from farlight_test import BIN, TIMEOUT_S, Case, Daemon, bundled_scenes, exr_attributes, farlight, long_test
from farlight_test import read_exr, read_png
from test_animate import children
from test_daemon import (EDIT_BEGIN, EDIT_COMMIT, ERROR, GOODBYE, OK, SCENE_OPEN, SET_NODE, STATS, STATS_REPLY, Peer,
                         error_code, error_text, named, set_node, text)

SCENE_ATTACH, SCENE_CHANGED, REMOVE = 0x103, 0x8108, 0x13f
PRIVATE, KEPT, DENIED = 0, 1, 13


class Serving:
    """A running `farlight serve`; a context manager, ready once it has printed its last address."""

    def __init__(self, *arguments, addresses=1, environment=None):
        self.arguments, self.addresses = list(map(str, arguments)), addresses
        self.environment = environment
        self.lines = []

    def __enter__(self):
        self.process = subprocess.Popen([BIN / "farlight", "serve", *self.arguments], stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True, env=self.environment)
        patience = threading.Timer(TIMEOUT_S, self.process.kill)
        patience.start()
        while len(self.lines) < 1 + self.addresses:
            line = self.process.stdout.readline()
            if not line:
                patience.cancel()
                raise AssertionError(f"farlight serve said {self.lines} and then: {self.process.communicate()[1]}")
            self.lines.append(line.rstrip("\n"))
        patience.cancel()
        return self

    @property
    def daemon(self):
        """The process of its daemon; None: it has none of its own."""
        children = pathlib.Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        named_so = [int(child) for child in children
                    if pathlib.Path(f"/proc/{child}/comm").read_text().strip() == "farlightd"]
        return named_so[0] if named_so else None

    def stop(self, number=signal.SIGINT):
        if self.process.poll() is None:
            self.process.send_signal(number)
        return self.process.wait(TIMEOUT_S)

    def __exit__(self, *_):
        self.stop(signal.SIGKILL)
        self.process.stdout.close()
        self.process.stderr.close()


def wait_until(what, message):
    deadline = time.monotonic() + TIMEOUT_S
    while not what():
        if time.monotonic() > deadline:
            raise AssertionError(message)
        time.sleep(0.01)


def is_gone(pid):
    """It has ended, or waits for nothing but to be looked at by who inherited it."""
    try:
        return pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] == "Z"
    except FileNotFoundError:
        return True


class Viewer(Peer):
    """A client of raw bytes on a scene that is up."""

    def __init__(self, path, name, scene=1):
        self.path = str(path)
        super().__init__(self)
        self.scene = scene
        self.send(SCENE_ATTACH, 1, struct.pack("<I", scene), text(name))
        kind, payload = self.answer(1)
        assert kind == OK, error_text(payload)
        self.revision = struct.unpack_from("<Q", payload, 2)[0]

    def edit(self, request, kind, fixed, counted=b""):
        """One edit; the type and the payload of the answer."""
        self.send(EDIT_BEGIN, request, struct.pack("<I", self.scene))
        self.send(kind, request, fixed, counted)
        self.send(EDIT_COMMIT, request)
        return self.answer(request)

    def changed(self):
        """The revision that it hears of next."""
        while True:
            kind, request, payload = self.receive()
            if kind == SCENE_CHANGED:
                assert request == 0
                scene, revision = struct.unpack_from("<IQ", payload, 2)
                assert scene == self.scene
                return revision


class Serve(Case):
    def setUp(self):
        super().setUp()
        self.socket = self.folder / "s"
        self.address = f"unix:{self.socket}"
        self.model = bundled_scenes() / "teapot.glb"

    def serve(self, *arguments, **options):
        serving = Serving(self.model, "--listen", self.address, *arguments, **options)
        self.addCleanup(serving.__exit__)
        return serving.__enter__()

    def test_without_a_runtime_folder_it_listens_in_a_private_one(self):
        environment = {name: value for name, value in os.environ.items() if name != "XDG_RUNTIME_DIR"}
        with Serving(self.model, environment=environment) as serving:
            address = serving.lines[-1].split()[-1]
            folder = pathlib.Path(address.removeprefix("unix:")).parent
            state = folder.stat()
            self.assertEqual((state.st_mode & 0o7777, state.st_uid), (0o700, os.getuid()))
            self.assertEqual([entry.name for entry in folder.iterdir()], [pathlib.Path(address).name])
            self.expect(farlight("scenes", "--server", address), 0)
            self.assertEqual(serving.stop(), 0)
        self.assertFalse(folder.exists())

    def render(self, path, *arguments, status=0, address=None):
        return self.expect(farlight("render", "--server", address or self.address, "--size", "48x36", "-o", path,
                                    *arguments), status)

    def scenes(self, address=None):
        result = self.expect(farlight("scenes", "--json", "--server", address or self.address), 0)
        return [json.loads(line) for line in result.stdout.splitlines()]

    # ---- one scene, several clients -----------------------------------------------------------------

    def test_a_scene_that_is_up_renders_as_its_model_does(self):
        serving = self.serve("--listen", "tcp:127.0.0.1:0", addresses=2)
        self.assertIn('"teapot.glb"', serving.lines[0])
        self.assertEqual(serving.lines[1], f"  farlight view --scene teapot.glb --server {self.address}")
        tcp = serving.lines[2].split()[-1]
        self.assertRegex(tcp, r"^tcp:127\.0\.0\.1:[1-9][0-9]*$")
        self.render(self.folder / "shared.png", "--scene", "teapot.glb")
        self.render(self.folder / "tcp.png", "--scene", "teapot.glb", address=tcp)
        self.expect(farlight("render", self.model, "--size", "48x36", "-o", self.folder / "own.png"), 0)
        own = read_png(self.folder / "own.png")
        self.assertEqual(read_png(self.folder / "shared.png"), own)
        self.assertEqual(read_png(self.folder / "tcp.png"), own)

    def test_an_edit_by_one_appears_to_all_with_its_revision(self):
        self.serve("--name", "pot")
        before, after = self.folder / "before.exr", self.folder / "after.exr"
        self.render(before, "--scene", "pot", "--metadata", "full")
        one, other = Viewer(self.socket, "pot"), Viewer(self.socket, "pot", scene=77)
        self.addCleanup(one.close)
        self.addCleanup(other.close)
        self.assertEqual((one.revision, other.revision), (1, 1))
        # A node under a number that nothing of the model has.
        kind, payload = one.edit(5, SET_NODE, set_node(1 << 30), named("mine"))
        self.assertEqual((kind, struct.unpack_from("<Q", payload, 2)[0]), (OK, 2), error_text(payload))
        self.assertEqual(other.changed(), 2)
        kind, payload = other.edit(6, REMOVE, struct.pack("<II", 0, 1))
        self.assertEqual((kind, struct.unpack_from("<Q", payload, 2)[0]), (OK, 3), error_text(payload))
        self.assertEqual(one.changed(), 3)
        self.render(after, "--scene", "pot", "--metadata", "full")
        revisions = [int(exr_attributes(path)["farlight/revision"]) for path in (before, after)]
        self.assertEqual(revisions, [1, 3])
        self.assertNotEqual(read_exr(before), read_exr(after))  # a part of it is gone
        self.assertEqual(self.scenes()[0]["revision"], 3)

    def test_a_scene_whose_model_is_not_there_yet_is_waited_for(self):
        self.serve("--name", "pot")
        other = Viewer(self.socket, "pot")
        self.addCleanup(other.close)
        other.send(SCENE_OPEN, 2, struct.pack("<II", 2, KEPT), text("mine"))
        self.assertEqual(other.answer(2)[0], OK)
        with subprocess.Popen([BIN / "farlight", "render", "--server", self.address, "--scene", "mine", "--size", "48x36", "-o",
                               self.folder / "mine.exr", "--metadata", "full"], stderr=subprocess.PIPE, text=True) as early:
            self.addCleanup(early.kill)
            self.assertIn("try again once its model is loaded", early.stderr.readline())
            other.scene = 2
            kind, payload = other.edit(3, SET_NODE, set_node(1), named("all"))
            self.assertEqual(kind, OK, error_text(payload))
            self.assertEqual(early.wait(TIMEOUT_S), 0)
        self.assertEqual(exr_attributes(self.folder / "mine.exr")["farlight/revision"], b"1")

    @long_test
    def test_an_animation_of_a_scene_that_is_up_leaves_it_as_it_was(self):
        self.serve()
        script = self.folder / "shot.json"
        script.write_text(json.dumps({
            "camera": {"eye": {"times": [0, 1], "values": [[3, 2, 4], [4, 2, 3]]}, "look_at": [0, 0, 0]},
            "frames": "0-2", "fps": 2, "size": [32, 24], "output": str(self.folder / "%d.png")}))
        self.expect(farlight("animate", "--scene", "teapot.glb", "--server", self.address, "--script", script), 0)
        pictures = [read_png(self.folder / f"{frame}.png") for frame in range(3)]
        self.assertNotEqual(pictures[0], pictures[2])
        # What the script keys came as a clip, and went again.
        scene = self.scenes()[0]
        self.assertEqual((scene["revision"], scene["clients"]), (3, 1))

    def test_scenes_are_listed_with_their_sharing_and_clients(self):
        self.serve("--name", "a pot 'of mine'")
        viewer = Viewer(self.socket, "a pot 'of mine'")
        self.addCleanup(viewer.close)
        viewer.send(SCENE_OPEN, 2, struct.pack("<II", 2, KEPT), text("mine"))
        self.assertEqual(viewer.answer(2)[0], OK)
        viewer.send(SCENE_OPEN, 3, struct.pack("<II", 3, PRIVATE), text("nobody's business"))
        self.assertEqual(viewer.answer(3)[0], OK)
        scenes = self.scenes()
        self.assertEqual([(scene["name"], scene["sharing"], scene["clients"]) for scene in scenes],
                         [("a pot 'of mine'", "shared", 2), ("mine", "kept", 1)])
        self.assertGreater(scenes[0]["triangles"], 1000)
        table = self.expect(farlight("scenes", "--server", self.address), 0).stdout.splitlines()
        self.assertEqual(len(table), 3)
        self.assertTrue(table[1].endswith("a pot 'of mine'"), table)

    def test_the_line_for_viewers_is_one_for_a_shell(self):
        serving = self.serve("--name", "it's $HOME")
        words = subprocess.run(["sh", "-c", "printf '%s\\n' " + serving.lines[1].split("farlight ", 1)[1]],
                               stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()
        self.assertEqual(words, ["view", "--scene", "it's $HOME", "--server", self.address])

    def test_the_holder_of_the_key_connects_from_everywhere(self):
        key = self.folder / "key"
        self.expect(farlight("key", key), 0)
        serving = self.serve("--listen", "tcp:0.0.0.0:0", "--key", key, addresses=2)
        view, address = serving.lines[2].split(" --server ")
        self.assertEqual(view, "  farlight view --scene teapot.glb")
        host, port, used = re.fullmatch(r"tcp:(.+):(\d+) --key (.+)", address).groups()
        self.assertEqual((host, used), (socket.gethostname(), str(key)))
        self.render(self.folder / "a.png", "--scene", "teapot.glb", "--key", key, address=f"tcp:127.0.0.1:{port}")

    # ---- who may change it --------------------------------------------------------------------------

    def test_a_reader_looks_and_is_refused_to_edit(self):
        config = self.folder / "conf"
        config.write_text(f"[server]\nreaders = {os.getuid()}\n")
        self.serve("--", "--config", config)  # whoever serves may edit his own
        self.render(self.folder / "a.png", "--scene", "teapot.glb")
        result = self.render(self.folder / "b.png", self.model, status=1)
        self.assertIn("may only look", result.stderr)
        self.assertIn("ask the daemon", result.stderr)
        self.assertNotIn("b.png", self.leftovers())
        viewer = Viewer(self.socket, "teapot.glb")
        self.addCleanup(viewer.close)
        kind, payload = viewer.edit(5, REMOVE, struct.pack("<II", 0, 1))
        self.assertEqual((kind, error_code(payload)), (ERROR, DENIED))
        self.assertEqual(self.scenes()[0]["revision"], 1)

    @long_test
    def test_a_model_that_changes_is_loaded_into_the_scene_that_is_up(self):
        tile = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nf 1 2 3\n"
        model = self.folder / "tile.obj"
        model.write_text(tile)
        with Daemon() as daemon, Serving(model, "--watch", "--server", daemon.address):
            viewer = Viewer(daemon.path, "tile.obj")
            self.addCleanup(viewer.close)
            model.write_text(tile + "f 1 3 2\n")
            self.assertEqual(viewer.changed(), viewer.revision + 1)
            scene, = self.scenes(daemon.address)
            self.assertEqual((scene["triangles"], scene["clients"]), (2, 2))

    # ---- lost connections ---------------------------------------------------------------------------

    def test_a_scene_outlives_a_cut_connection_and_can_be_attached_again(self):
        with Daemon() as daemon:
            with Serving(self.model, "--server", daemon.address) as serving:
                self.assertIsNone(serving.daemon)
                serving.stop(signal.SIGKILL)
            wait_until(lambda: self.scenes(daemon.address)[0]["clients"] == 0, "the daemon does not notice")
            self.render(self.folder / "a.png", "--scene", "teapot.glb", address=daemon.address)
            peer = Peer(daemon)
            peer.send(STATS, 1)
            kind, payload = peer.answer(1)
            self.assertEqual(kind, STATS_REPLY)
            peer.close()
            blob_bytes = struct.unpack_from("<Q", payload, 2 + 7 * 8)[0]
            self.assertGreater(blob_bytes, 1000)  # of the one whom nobody can ask again
            # Served again, it takes the place of the one that was left.
            with Serving(self.model, "--server", daemon.address) as serving:
                self.assertEqual([scene["clients"] for scene in self.scenes(daemon.address)], [1])
                self.assertEqual(serving.stop(signal.SIGTERM), 0)

    @long_test
    def test_a_scene_is_left_for_as_long_as_the_configuration_says(self):
        config = self.folder / "conf"
        config.write_text("[limits]\nscene_linger = 1\n")
        with Daemon("--config", config) as daemon:
            with Serving(self.model, "--server", daemon.address) as serving:
                self.assertEqual(serving.stop(), 0)
            wait_until(lambda: not self.scenes(daemon.address), "the scene stays")
            result = self.render(self.folder / "a.png", "--scene", "teapot.glb", status=1, address=daemon.address)
            self.assertIn("farlight scenes", result.stderr)

    @long_test
    def test_a_serving_client_is_not_idle(self):
        config = self.folder / "conf"
        config.write_text("[network]\nidle = 5000\n")
        with Daemon("--config", config) as daemon, Serving(self.model, "--server", daemon.address):
            Viewer(daemon.path, "teapot.glb").until_closed()  # so long that who says nothing is sent away
            self.assertEqual(self.scenes(daemon.address)[0]["clients"], 1)

    @long_test
    def test_an_importer_that_says_nothing_for_long_is_waited_for(self):
        config = self.folder / "conf"
        config.write_text("[network]\nidle = 1000\n")
        with Daemon("--config", config) as daemon:
            child = subprocess.Popen([BIN / "farlight", "render", self.model, "--server", daemon.address, "--size",
                                      "48x36", "-o", self.folder / "a.png"], stderr=subprocess.PIPE, text=True)
            self.addCleanup(child.stderr.close)
            wait_until(lambda: children(child.pid, "farlight-import"), "no importer is there")
            importer = children(child.pid, "farlight-import")[0]
            os.kill(importer, signal.SIGSTOP)  # as one that reads and thinks
            try:
                Peer(daemon).until_closed()  # who says nothing has been sent away ..
                Peer(daemon).until_closed()  # .. twice over
            finally:
                os.kill(importer, signal.SIGCONT)
            _, errors = child.communicate(timeout=TIMEOUT_S)
            self.assertEqual(child.returncode, 0, errors)

    def test_a_daemon_that_comes_back_has_the_scene_again_under_its_name(self):
        with Daemon() as daemon:
            with Serving(self.model, "--server", daemon.address, "--name", "mine", "--quiet") as serving:
                daemon.process.send_signal(signal.SIGTERM)
                daemon.process.wait(TIMEOUT_S)
                with Daemon("--listen", daemon.address) as another:
                    wait_until(lambda: self.scenes(another.address) != [], "the scene did not come back")
                    self.assertEqual([(scene["name"], scene["clients"]) for scene in self.scenes(another.address)],
                                     [("mine", 1)])
                    self.assertEqual(serving.stop(), 0)

    @long_test
    def test_the_client_that_started_a_daemon_may_be_silent(self):
        config = self.folder / "conf"
        config.write_text("[network]\nidle = 300\n")
        self.serve("--", "--config", config)  # whose import takes longer than that
        Viewer(self.socket, "teapot.glb").until_closed()
        self.assertEqual(self.scenes()[0]["clients"], 1)

    def test_two_scenes_of_one_name_are_refused(self):
        with Daemon() as daemon, Serving(self.model, "--server", daemon.address):
            result = self.expect(farlight("serve", self.model, "--server", daemon.address), 1)
            self.assertIn('a scene "teapot.glb" exists already', result.stderr)
            with Serving(self.model, "--server", daemon.address, "--name", "another"):
                self.assertEqual([scene["name"] for scene in self.scenes(daemon.address)], ["another", "teapot.glb"])

    # ---- ends ---------------------------------------------------------------------------------------

    def test_a_signal_ends_both_and_leaves_no_process_and_no_socket(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            serving = self.serve()
            daemon = serving.daemon
            self.assertTrue(self.socket.is_socket())
            viewer = Viewer(self.socket, "teapot.glb")
            self.assertEqual(serving.stop(number), 0, serving.process.stderr.read())
            self.assertTrue(is_gone(daemon))
            self.assertFalse(self.socket.exists())
            self.assertIn(GOODBYE, [kind for kind, _, _ in viewer.until_closed()], "no goodbye")

    def test_the_daemon_ends_with_a_server_that_is_killed(self):
        serving = self.serve()
        daemon = serving.daemon
        serving.stop(signal.SIGKILL)
        wait_until(lambda: is_gone(daemon), "the daemon stays")
        self.assertFalse(self.socket.exists())

    def test_a_killed_daemon_is_reported(self):
        serving = self.serve()
        os.kill(serving.daemon, signal.SIGKILL)
        self.assertEqual(serving.process.wait(TIMEOUT_S), 75)
        self.assertIn("signal 9", serving.process.stderr.read())

    # ---- mistakes -----------------------------------------------------------------------------------

    def test_mistakes_are_reported_before_anything_starts(self):
        for arguments, part in (
                (("serve",), "a model file is needed"),
                (("serve", self.model, "--name", ""), "need it to attach"),
                (("serve", self.model, "--server", "unix:/x", "--listen", "unix:/y"), "already has its addresses"),
                (("serve", self.model, "--server", "unix:/x", "--", "--device", "0"), "already has its options"),
                (("serve", *[self.model] * 65), "at most 64 models"),
                (("render", "--scene", "x", "-o", "x.png"), "no address of a daemon is given"),
                (("render", self.model, "--scene", "x", "--server", "unix:/x", "-o", "x.png"), "one or the other"),
                (("render", "--scene", "x", "--server", "unix:/x", "--environment", "a.hdr", "-o", "x.png"), "light"),
                (("scenes",), "no address of a daemon is given")):
            result = farlight(*arguments, cwd=self.folder)
            self.assertEqual(result.returncode, 2, arguments)
            self.assertIn(part, result.stderr)
        self.assertEqual(self.leftovers(), [])

    def test_an_unknown_name_is_reported(self):
        self.serve()
        result = self.render(self.folder / "a.png", "--scene", "teapot", status=1)
        self.assertIn('no scene "teapot"', result.stderr)
        self.assertEqual([name for name in self.leftovers() if name.endswith(".png")], [])
