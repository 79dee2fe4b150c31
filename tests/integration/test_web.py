# SPDX-License-Identifier: MIT
"""farlight-web, as browsers and others see it: the link, the page, pictures of a view, and what is turned away."""
import json
import os
import pathlib
import signal
import tempfile
import time

from farlight_test import TIMEOUT_S, Case, bundled_scenes, farlight, long_test, run
from test_serve import Serving, is_gone
from web_client import BINARY, TEXT, Gateway, Socket

NAME = "pot"
SHOW = {"width": 96, "height": 64, "h264": False, "tracer": "bvh", "integrator": "whitted", "clip": 0}
LOOK = {"id": 7, "eye": [6, 4, 8], "at": [0, 1, 0], "up": [0, 1, 0], "fov": 0.7, "time": 0, "moving": True, "node": 0}
SAMPLES = 64  # of a view at rest
# JPEG of quality 90 loses about 38 dB of small pictures with many edges; another view of the scene has below 20.
PSNR_DB = 30
TOO_LARGE, NOT_TEXT, POLICY, PROTOCOL, BAD_TEXT, GOING = 1009, 1003, 1008, 1002, 1007, 1001


class Web(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.folder = cls.enterClassContext(tempfile.TemporaryDirectory(prefix="farlight-web-"))
        cls.address = f"unix:{cls.folder}/s"
        cls.serving = cls.enterClassContext(cls.serve())
        cls.gateway = cls.enterClassContext(Gateway("--server", cls.address, "--scene", NAME, "--viewers", 3, "--host", "view.example"))

    @classmethod
    def serve(cls, address=None):
        return Serving(bundled_scenes() / "teapot.glb", "--listen", address or cls.address, "--name", NAME, "--quiet")

    def view(self, gateway=None, **show):
        """An open view that has shown its first frame."""
        view = self.enterContext(Socket(gateway or self.gateway))
        self.assertEqual(view.status, 101)
        view.send({"show": {**SHOW, **show}})
        view.frame()
        return view

    def test_page_comes_with_its_rules(self):
        for name, kind in (("", "text/html"), ("page.js", "text/javascript"), ("page.css", "text/css")):
            status, headers, body = self.gateway.get(self.gateway.path + name)
            self.assertEqual(status, 200)
            self.assertTrue(headers["content-type"].startswith(kind), headers)
            self.assertEqual(int(headers["content-length"]), len(body))
            policy = headers["content-security-policy"]
            for rule in ("default-src 'none'", "script-src 'self';", "style-src 'self';", "frame-ancestors 'none'"):
                self.assertIn(rule, policy)
            self.assertEqual(headers["x-content-type-options"], "nosniff")
            self.assertEqual(headers["referrer-policy"], "no-referrer")
        self.assertNotIn(b"<script>", self.gateway.get(self.gateway.path)[2])

    def test_nothing_comes_without_the_token(self):
        path = self.gateway.path
        other = path[:5] + ("A" if path[5] != "A" else "B") + path[6:]
        for wrong in ("/", "/page.js", other, path[:-2] + "/", path[:-2], "/../etc/passwd", "/" + "A" * 3000):
            status, headers, body = self.gateway.get(wrong)
            self.assertIn(status, (401, 403, 404, 413, 431), wrong)
            self.assertNotIn(path[1:-1].encode(), body)
        self.assertIn(b"right link", self.gateway.get(other)[2])
        self.assertEqual(self.gateway.get(path + "../main.c")[0], 401)
        self.assertEqual(self.gateway.get(path + "main.c")[0], 404)
        self.assertEqual(self.gateway.get(path, "POST")[0], 405)

    def test_a_link_without_its_last_slash_leads_to_the_page(self):
        status, headers, _ = self.gateway.get(self.gateway.path[:-1])
        self.assertEqual((status, headers["location"]), (301, self.gateway.path[1:]))  # relative: a proxy may have a path in front

    def test_a_proxy_that_changes_the_host_is_named_once(self):
        with Gateway("--server", self.address, "--scene", NAME) as gateway:
            for _ in range(2):
                with Socket(gateway, origin="https://farm.example") as view:
                    self.assertEqual(view.status, 403)
            _, said = gateway.stop()
        self.assertEqual(said.count("was refused"), 1, said)
        self.assertIn(f"Origin is https://farm.example, but its Host {gateway.host} (a proxy", said)

    def test_sockets_need_token_and_origin(self):
        path = self.gateway.path
        for arguments, status in (({"path": "/view"}, 401), ({"path": "/" + "A" * 43 + "/view"}, 401), ({"path": path}, 401),
                                  ({"origin": ""}, 403), ({"origin": "http://elsewhere.example"}, 403),
                                  ({"origin": "null"}, 403), ({"origin": f"http://{self.gateway.host}.example"}, 403)):
            with Socket(self.gateway, **arguments) as view:
                self.assertEqual(view.status, status, arguments)

    def test_other_names_are_not_answered(self):
        path, port = self.gateway.path, self.gateway.port
        for host, status in ((f"evil.example:{port}", 421), ("localhost.evil.example", 421), ("", 421), ("127.0.0.1.evil", 421),
                             (f"localhost:{port}", 200), ("[::1]", 200), ("View.Example", 200), (f"192.168.7.7:{port}", 200)):
            got, headers, body = self.gateway.get(path, host=host)
            self.assertEqual(got, status, host)
            self.assertIn("content-security-policy", headers)
            self.assertNotIn(path[1:-1].encode(), body)
        # A name that was made to lead here is the origin of its own page.
        for host, status in (("evil.example", 421), ("view.example", 101)):
            with Socket(self.gateway, host=host, origin=f"http://{host}") as view:
                self.assertEqual(view.status, status, host)

    def test_picture_is_what_render_makes(self):
        view = self.view()
        frame = {"samples": 0}
        while frame["samples"] < SAMPLES:
            frame, jpeg = view.frame()
        self.assertEqual((frame["width"], frame["height"], frame["encoding"]), (96, 64, "jpeg"))
        shown, rendered = (pathlib.Path(self.folder) / name for name in ("shown.jpg", "rendered.png"))
        shown.write_bytes(jpeg)
        result = farlight("render", "--server", self.address, "--scene", NAME, "--size", "96x64", "--samples", SAMPLES,
                          "--integrator", "whitted", "-o", rendered, "-q")
        self.assertEqual(result.returncode, 0, result.stderr)
        result = farlight("compare", rendered, shown, "--json", "--ignore-alpha")
        self.assertGreater(json.loads(result.stdout)["psnr"], PSNR_DB)
        names = {stage[0] for stage in frame["stages"]}
        self.assertLessEqual({"trace", "shade", "encode"}, names)

    def errors(self, view, number):
        """(what is said of them, a byte a pixel) of the comparison of that number."""
        view.send({"compare": number})
        while True:
            kind, data = view.receive()
            size = int.from_bytes(data[:4], "little")
            if kind == BINARY:
                view.send({"shown": 1})
            else:
                self.assertNotIn(b"refused", data)
            if kind == BINARY and "errors" in (header := json.loads(data[4:4 + size])):
                return header["errors"], data[4 + size:]

    @long_test
    def test_errors_of_a_tracer_are_those_of_compare(self):
        view = self.view(tracer="abuffer")
        told, errors = self.errors(view, 5)
        self.assertEqual((told["compare"], told["width"], told["height"]), (5, 96, 64))
        self.assertEqual(len(errors), 96 * 64)
        result = farlight("compare", bundled_scenes() / "teapot.glb", "--tracers", "abuffer,reference", "--size", "96x64",
                          "--samples", 4, "--integrator", "whitted", "--json", "-q")
        figures = json.loads(result.stdout)
        for name in ("rays", "both_hit", "only_tracer", "only_reference", "far", "edges", "other_surface", "agree"):
            self.assertEqual(told["all"][name], figures["all"][name], name)
        self.assertEqual([(wave["wave"], wave["kind"], wave.get("normal_p99")) for wave in told["waves"]],
                         [(wave["wave"], wave["kind"], wave.get("normal_p99")) for wave in figures["waves"]])
        self.assertGreater(max(errors), 10)
        # Another camera, and another tracer, which has hardly any.
        view.send({"show": {**SHOW, "tracer": "bvh"}})
        view.send({"camera": {**LOOK, "moving": False}})
        told, errors = self.errors(view, 6)
        self.assertEqual((told["compare"], told["tracer"]), (6, "bvh"))
        self.assertGreater(told["all"]["agree"], 0.9999)
        self.assertLess(sum(errors), len(errors))

    @long_test
    def test_moving_on_ends_a_comparison(self):
        view = self.view(tracer="abuffer")
        view.send({"compare": 1})
        view.send({"camera": {**LOOK, "moving": False}})
        told, _ = self.errors(view, 2)
        self.assertEqual(told["compare"], 2)

    def test_each_viewer_has_a_camera_of_its_own(self):
        first, second = self.view(), self.view()
        eyes = {}
        for view, eye in ((first, [6, 4, 8]), (second, [-6, 5, 7])):
            view.send({"camera": {**LOOK, "eye": eye}})
        for view in (first, second):
            frame = {"id": 0}
            while frame["id"] != LOOK["id"]:
                frame, _ = view.frame()
            eyes[view] = [frame["camera"][i] for i in (3, 7, 11)]
        self.assertEqual((eyes[first], eyes[second]), ([6, 4, 8], [-6, 5, 7]))

    @long_test
    def test_more_viewers_than_allowed_wait(self):
        views = [self.view() for _ in range(3)]
        with Socket(self.gateway) as more:
            self.assertEqual(more.status, 503)
        views[0].peer.close()
        deadline, status = time.monotonic() + TIMEOUT_S, 0
        while status != 101 and time.monotonic() < deadline:
            with Socket(self.gateway) as again:
                status = again.status
        self.assertEqual(status, 101)

    def test_wrong_messages_end_the_connection(self):
        def camera(**changes):
            return {"camera": {**LOOK, **changes}}
        wrong = (
            (b"{", TEXT, POLICY), (b"[1]", TEXT, POLICY), (b"{}", TEXT, POLICY),
            (b'{"shown": 1, "key": true}', TEXT, POLICY), (b'{"shown": 0}', TEXT, POLICY), (b'{"shown": 1e9}', TEXT, POLICY),
            (b"[" * 1500, TEXT, POLICY), (b'{"other": 1}', TEXT, POLICY), (b'{"compare": -1}', TEXT, POLICY),
            (b'{"compare": true}', TEXT, POLICY), (b'{"compare": 4294967296}', TEXT, POLICY),
            ({"show": {**SHOW, "width": 100000}}, TEXT, POLICY), ({"show": {**SHOW, "width": -1}}, TEXT, POLICY),
            ({"show": {**SHOW, "tracer": "x"}}, TEXT, POLICY), ({"show": {**SHOW, "more": 1}}, TEXT, POLICY),
            (camera(eye=LOOK["at"]), TEXT, POLICY), (camera(eye=[1, 2]), TEXT, POLICY), (camera(up=[0, 0, 0]), TEXT, POLICY),
            (camera(eye=[1e300, 0, 0]), TEXT, POLICY), (camera(fov=0), TEXT, POLICY), (camera(time=1e9), TEXT, POLICY),
            (camera(id=-1), TEXT, POLICY), (b'{"camera": {"fov": NaN}}', TEXT, POLICY),
            ({"list": {"kind": "mesh", "match": ""}}, TEXT, POLICY), ({"list": {"kind": "node", "match": "x" * 200}}, TEXT, POLICY),
            ({"read": {"kind": "node", "id": 0}}, TEXT, POLICY), ({"undo": False}, TEXT, POLICY),
            ({"edit": {"kind": "material", "id": 1, "field": "roughness", "values": []}}, TEXT, POLICY),
            ({"edit": {"kind": "material", "id": 1, "field": "roughness", "values": ["1"]}}, TEXT, POLICY),
            # Well-formed, of a link that may look alone.
            ({"list": {"kind": "node", "match": ""}}, TEXT, POLICY), ({"undo": True}, TEXT, POLICY),
            ({"edit": {"kind": "material", "id": 1, "field": "roughness", "values": [0.5]}}, TEXT, POLICY),
            (b" " * 5000, TEXT, TOO_LARGE), (b"\x00\x01", BINARY, NOT_TEXT), (b'{"key": "\xff"}', TEXT, None),
            (b"x", 5, None),  # an opcode that does not exist
        )
        for message, kind, status in wrong:
            with Socket(self.gateway) as view:
                view.send(message, kind)
                closed = view.closed_with()
                self.assertIn(closed, (status,) if status else (0, PROTOCOL, BAD_TEXT, POLICY), message)
        with Socket(self.gateway) as view:  # a message without an end
            try:
                for part in range(100):
                    view.send(b" " * 100, TEXT if part == 0 else 0, final=False)
            except OSError:
                pass
            self.assertIn(view.closed_with(), (0, TOO_LARGE))
        self.view()

    def test_message_may_come_in_pieces(self):
        view = self.view()
        text = json.dumps({"camera": LOOK}).encode()
        view.send(text[:20], TEXT, final=False)
        view.send(text[20:], 0)
        frame = {"id": 0}
        while frame["id"] != LOOK["id"]:
            frame, _ = view.frame()

    def test_flood_ends_the_connection(self):
        with Socket(self.gateway) as view:
            try:
                for _ in range(3000):
                    view.send({"shown": 1})
            except OSError:
                pass
            self.assertIn(view.closed_with(), (0, POLICY))
        self.view()

    @long_test
    def test_lost_daemon_is_told_and_comes_back(self):
        address = f"unix:{self.folder}/again"
        with self.serve(address) as serving, Gateway("--server", address, "--scene", NAME) as gateway:
            view = self.view(gateway)
            serving.stop()
            kind, data = BINARY, b""
            while kind == BINARY:
                kind, data = view.receive()
            self.assertTrue(json.loads(data)["error"]["again"], data)
            self.assertNotIn(str(self.folder), data.decode(), "where the daemon is")
            self.assertEqual(view.closed_with(), GOING)
            with Socket(gateway) as late:
                late.send({"show": SHOW})
                _, data = late.receive()
                self.assertTrue(json.loads(data)["error"]["again"], data)
                self.assertNotIn(str(self.folder), data.decode(), "where the daemon is")
            for _ in range(5):  # pages that try again
                with Socket(gateway) as late:
                    late.send({"show": SHOW})
                    late.receive()
            with self.serve(address):
                for _ in range(2):
                    self.view(gateway)
                status, said = gateway.stop()
            self.assertEqual(status, 130)
            self.assertNotIn(gateway.path[1:-1], said)
            lost, back, interrupted = said.splitlines()
            self.assertRegex(lost, f"^farlight: {address}: the (daemon stops|connection is lost)")
            self.assertEqual(back, f"farlight: {address}: the daemon is back")
            self.assertIn("interrupted", interrupted)

    @long_test
    def test_what_a_page_is_refused_is_no_outage(self):
        with Gateway("--server", self.address, "--scene", NAME) as gateway:
            view = self.enterContext(Socket(gateway))
            view.send({"show": {**SHOW, "clip": 77}})  # there is none
            kind, data = BINARY, b""
            while kind == BINARY or b'"scene"' in data:
                kind, data = view.receive()
            self.assertIn(b"77", data)
            self.assertEqual(len(gateway.stop()[1].splitlines()), 1)  # that it was interrupted

    @long_test
    def test_command_line_says_what_is_wrong(self):
        def say(*arguments, server=self.address, scene=NAME):
            result = run("farlight-web", "--server", server, "--scene", scene, *arguments)
            self.assertEqual(result.stdout, "")
            return result.returncode, result.stderr
        status, said = say("--listen", "0.0.0.0:0")
        self.assertEqual(status, 2)
        self.assertIn("ssh -L", said)
        for arguments in (("--listen", "8080"), ("--listen", "127.0.0.1:x"), ("--listen", "nowhere:1"), ("--viewers", "0"),
                          ("--listen", "[::]:0"), ("--host", "http://a"), (bundled_scenes() / "teapot.glb",),
                          ("--", "--device", "software")):
            self.assertEqual(say(*arguments)[0], 2, arguments)
        self.assertIn("none", say(scene="none")[1])
        self.assertEqual(say(server=f"unix:{self.folder}/nobody")[0], 75)
        self.assertEqual(say("--listen", f"127.0.0.1:{self.gateway.port}")[0], 1)
        self.assertIn("--scene", run("farlight-web", "--server", self.address).stderr)
        self.assertIn("MODEL", run("farlight-web").stderr)
        self.assertEqual(say("--camera", "none")[0], 2)


class Edit(Case):
    """--allow-edit: a second link."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.folder = cls.enterClassContext(tempfile.TemporaryDirectory(prefix="farlight-web-"))
        cls.gateway = cls.enterClassContext(Gateway(bundled_scenes() / "teapot.glb", "--allow-edit",
                                                    environment={**os.environ, "XDG_RUNTIME_DIR": cls.folder}))

    def view(self, path):
        view = self.enterContext(Socket(self.gateway, path=path + "view"))
        self.assertEqual(view.status, 101)
        view.send({"show": SHOW})
        view.frame()
        return view

    @staticmethod
    def ask(view, message):
        """The answer, which is text; frames, and what the scene is now, are passed over."""
        view.send(message)
        while True:
            kind, data = view.receive()
            if kind == BINARY:
                view.send({"shown": 1})
            elif kind == TEXT and not data.startswith(b'{"scene"'):
                return json.loads(data)
            elif kind == TEXT:
                continue
            else:
                raise ConnectionError(data)

    def first(self, view, kind):
        return self.ask(view, {"list": {"kind": kind, "match": ""}})["objects"]["list"][0][0]

    def values(self, view, kind, number, field):
        found = self.ask(view, {"read": {"kind": kind, "id": number}})["object"]["fields"]
        return next(one["values"] for one in found if one["name"] == field)

    def test_change_is_seen_by_others_and_undone(self):
        editor, other, looker = self.view(self.gateway.edit_path), self.view(self.gateway.edit_path), self.view(self.gateway.path)
        material = self.first(editor, "material")
        before = self.values(editor, "material", material, "roughness")
        told = self.ask(editor, {"edit": {"kind": "material", "id": material, "field": "roughness", "values": [0.8125]}})["edited"]
        self.assertEqual((told["objects"], told["undos"]), (1, 1))
        self.assertEqual(self.values(other, "material", material, "roughness"), [0.8125])
        frame = {"revision": 0}
        while frame["revision"] < told["revision"]:
            frame, _ = looker.frame()
        # It is not the other's to undo.
        self.assertIn("no change", self.ask(other, {"undo": True})["refused"]["text"])
        told = self.ask(editor, {"undo": True})["edited"]
        self.assertEqual((told["undos"], told["redos"]), (0, 1))
        self.assertEqual(self.values(other, "material", material, "roughness"), before)
        told = self.ask(editor, {"redo": True})["edited"]
        self.assertEqual((told["undos"], told["redos"]), (1, 0))
        self.assertEqual(self.values(other, "material", material, "roughness"), [0.8125])
        self.assertIn("no change", self.ask(editor, {"redo": True})["refused"]["text"])
        self.ask(editor, {"undo": True})
        told = self.ask(editor, {"edit": {"kind": "material", "id": material, "field": "roughness", "values": [0.25]}})["edited"]
        self.assertEqual((told["undos"], told["redos"]), (1, 0), "a new change ends redoing")

    @long_test
    def test_lights_nodes_and_environment_are_edited(self):
        view = self.view(self.gateway.edit_path)
        for kind, field, values in (("light", "intensity", [3.5]), ("node", "translate", [0.25, 0.5, 0.75]),
                                    ("environment", "rotation", [90])):
            number = self.first(view, kind)
            told = self.ask(view, {"edit": {"kind": kind, "id": number, "field": field, "values": values}})
            self.assertIn("edited", told, kind)
            for now, wanted in zip(self.values(view, kind, number, field), values):
                self.assertAlmostEqual(now, wanted, places=4)

    def test_impossible_changes_are_refused_and_the_view_goes_on(self):
        view = self.view(self.gateway.edit_path)
        material = self.first(view, "material")
        for number, field, values in ((material, "nothing", [1]), (material, "roughness", [7]), (material, "base_colour", [1, 2]),
                                      (4000000000, "roughness", [1])):
            told = self.ask(view, {"edit": {"kind": "material", "id": number, "field": field, "values": values}})
            self.assertTrue(told["refused"]["edit"], field)
        self.assertIn("refused", self.ask(view, {"read": {"kind": "light", "id": 4000000000}}))
        self.assertEqual(self.ask(view, {"list": {"kind": "material", "match": "no such name"}})["objects"]["list"], [])
        view.send({"camera": LOOK})
        view.frame()

    def test_other_link_may_not_edit(self):
        self.assertNotEqual(self.gateway.path, self.gateway.edit_path)
        self.assertEqual((self.gateway.link_gives, self.gateway.edit_link_gives), ("to look", "to look and edit"))
        for message in ({"list": {"kind": "node", "match": ""}}, {"undo": True}):
            view = self.view(self.gateway.path)
            with self.assertRaises(ConnectionError, msg=f"{message} is answered"):
                self.ask(view, message)
        with Socket(self.gateway, path=self.gateway.edit_path + "view", origin="http://elsewhere.example") as view:
            self.assertEqual(view.status, 403)

    @long_test
    def test_changes_are_asked_one_at_a_time(self):
        view = self.view(self.gateway.edit_path)
        try:
            for _ in range(200):
                view.send({"list": {"kind": "node", "match": ""}})
        except OSError:
            pass
        self.assertIn(view.closed_with(), (0, POLICY))


class Model(Case):
    """farlight-web MODEL, without a daemon that was there before."""

    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory(prefix="farlight-web-"))
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": self.folder}

    def view(self, gateway, **show):
        view = self.enterContext(Socket(gateway))
        self.assertEqual(view.status, 101)
        view.send({"show": {name: value for name, value in {**SHOW, **show}.items() if value is not None}})
        return view, view.frame()[0]

    def test_model_is_shown_by_a_daemon_of_its_own(self):
        gateway = Gateway(bundled_scenes() / "teapot.glb", "--tracer", "abuffer", "--integrator", "raycast", "--eye", "6,4,8",
                          "--look-at", "0,1,0", "-q", environment=self.environment)
        with gateway:
            _, frame = self.view(gateway, tracer=None, integrator=None)
            self.assertEqual((frame["tracer"], frame["integrator"]), ("abuffer", "raycast"))
            for i, place in zip((3, 7, 11), (6, 4, 8)):
                self.assertAlmostEqual(frame["camera"][i], place, places=5)
            self.assertEqual(self.view(gateway)[1]["tracer"], SHOW["tracer"])
            daemon = gateway.daemon
            status, said = gateway.stop()
            self.assertEqual(status, 130)
            self.assertTrue(is_gone(daemon))
            self.assertNotIn(gateway.path[1:-1], said)
        self.assertEqual(os.listdir(self.folder), [])

    @long_test
    def test_killed_daemon_is_started_again(self):
        with Gateway(bundled_scenes() / "teapot.glb", environment=self.environment) as gateway:
            view, _ = self.view(gateway)
            first = gateway.daemon
            os.kill(first, signal.SIGKILL)
            kind, data = BINARY, b""
            while kind == BINARY:
                kind, data = view.receive()
            self.assertTrue(json.loads(data)["error"]["again"], data)
            self.assertNotIn(str(self.folder), data.decode(), "where the daemon is")
            self.assertEqual(view.closed_with(), GOING)
            deadline, frame = time.monotonic() + TIMEOUT_S, None
            while not frame and time.monotonic() < deadline:
                try:
                    _, frame = self.view(gateway)
                except AssertionError:
                    time.sleep(0.2)
            self.assertTrue(frame)
            self.assertNotIn(gateway.daemon, (None, first))
            # Pages may see the scene a moment before that is said.
            said = gateway.said_until("the scene is shared again\n")
            self.assertIn("farlightd was ended by signal 9\n", said)
            self.assertIn("the scene is shared again\n", said)

    @long_test
    def test_model_goes_to_a_daemon_that_runs(self):
        address = f"unix:{self.folder}/d"
        with Serving(bundled_scenes() / "teapot.glb", "--listen", address, "--name", "other", "--quiet"):
            with Gateway(bundled_scenes() / "carousel.glb", "--server", address, environment=self.environment) as gateway:
                self.view(gateway)
                self.assertIsNone(gateway.daemon)
                self.assertIn("carousel.glb", farlight("scenes", "--server", address).stdout)

    @long_test
    def test_files_that_change_are_shown_again_and_others_are_not(self):
        model = pathlib.Path(self.folder) / "tile.obj"
        tile = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nf 1 2 3\n"
        model.write_text(tile)
        with Gateway(model, "--watch", "--edit", "node.0.translate=0,0,1", environment=self.environment) as gateway:
            view, frame = self.view(gateway)
            view.send({"camera": {**LOOK, "moving": False}})
            while frame["id"] != LOOK["id"]:
                frame, _ = view.frame()
            camera, revision = frame["camera"], frame["revision"]
            for text, triangles in ((tile + "f 1 3 2\n", 2), (tile + "usemtl other\nf 1 3 2\nf 2 3 1\n", 3), (tile, 1)):
                model.write_text(text)
                told = self.described(view)
                self.assertEqual((told["triangles"], told["lower"][2]), (triangles, 1), "edits are made again")
                while frame["revision"] == revision or frame["samples"] < 2:
                    frame, _ = view.frame()
                revision = frame["revision"]
                self.assertEqual((frame["camera"], frame["id"]), (camera, LOOK["id"]))
            model.write_text("f 1 2 9\n")
            for line in gateway.process.stderr:
                if "tile.obj" in line and "new" not in line:
                    break
            view.send({"camera": LOOK})
            self.assertEqual(view.frame()[0]["revision"], revision, "what cannot be read leaves the view as it is")

    def described(self, view):
        """What the page is told of the scene the next time."""
        while True:
            kind, data = view.receive()
            if kind == BINARY:
                view.send({"shown": 1})
            elif b'"scene"' in data:
                return json.loads(data)["scene"]

    @long_test
    def test_page_is_served_at_ipv6_addresses(self):
        with Gateway(bundled_scenes() / "teapot.glb", "--listen", "127.0.0.1:0", listen="[::1]:0",
                     environment=self.environment) as gateway:
            self.assertEqual(gateway.machine, "::1")
            self.assertEqual(gateway.get(gateway.path)[0], 200)
            self.view(gateway)
            gateway.machine, gateway.host = "127.0.0.1", f"127.0.0.1:{gateway.port}"
            self.view(gateway)

    def test_wrong_models_are_told(self):
        for arguments, status in ((("none.glb",), 1), ((bundled_scenes() / "teapot.glb", "--camera", "none"), 2),
                                  ((bundled_scenes() / "teapot.glb", "--scene", "x"), 2), (("--at", "1,1,1"), 2),
                                  (("--server", "unix:/none", "--scene", "x", "--watch"), 2),
                                  ((bundled_scenes() / "teapot.glb", "--watch", "--edit", "camera.fov*=2"), 2)):
            result = run("farlight-web", "--listen", "127.0.0.1:0", *arguments, env=self.environment)
            self.assertEqual((result.returncode, result.stdout), (status, ""), (arguments, result.stderr))
        self.assertEqual(os.listdir(self.folder), [])
