# SPDX-License-Identifier: MIT
"""Editing in the viewer: what is picked is changed and changed back, and two viewers at one scene see each other's changes."""
import json
import shutil
import signal
import subprocess

from farlight_test import BIN, Daemon, bundled_scenes, long_test, read_png
from test_view import HIDE, Relay, Viewer, change_model, difference, drag, error_of, rest

POT = (160, 80)  # in the middle of the teapot
ABOVE_NOTICES = 120  # rows
QUICK = ["--samples", "2"]


def pick(x, y):
    return [{"mouse": how, "button": "left", "x": x, "y": y, "ctrl": True} for how in ("down", "up")]


def choose(edit, field, component=0):
    """Keys from the first row to a field's."""
    fields = list(edit["fields"])
    above = sum(len(edit["fields"][name]) for name in fields[:fields.index(field)])
    return [{"key": "down"}] * (1 + above + component)


def typed(number):
    return [*({"text": digit} for digit in number), {"key": "return"}]


class Editing(Viewer):
    edit = None

    def start(self, events, *options, **more):
        return super().start(events, *options, **{"size": (320, 180), **more})  # the panel needs room beside the pot

    def two_viewers(self, first, second):
        """Their states at one scene; the second one begins when the first one has told a state."""
        address = f"unix:{self.folder}/up"
        command = [BIN / "farlight", "serve", bundled_scenes() / "teapot.glb", "--name", "pot", "--listen", address]
        with subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, text=True) as server:
            try:
                while "farlight view" not in (line := server.stdout.readline()):
                    self.assertNotEqual(line, "")
                options = ["--headless", "--scene", "pot", "--server", address, *QUICK]
                waiting = self.start(first, *options, scene=None)
                self.assertIn("state", waiting.stdout.readline())
                other = self.replay(second, *options, scene=None)
                return self.end(waiting), other
            finally:
                server.send_signal(signal.SIGTERM)

    def picked(self):
        """The material at the pot, as the panel shows it."""
        if not Editing.edit:
            Editing.edit = self.replay([rest(1), *pick(*POT), rest(1), {"state": "picked"}])["picked"]["edit"]
            self.assertEqual(self.edit["kind"], "material")
        return self.edit

    def test_a_picked_material_is_changed_and_undone(self):
        """The panel is closed for the pictures; undoing returns the very picture."""
        edit = self.picked()
        states = self.replay([rest(2), *HIDE, {"screenshot": "before.png"}, *pick(*POT), rest(2), *choose(edit, "base_colour"),
                              *typed("0.9"), {"state": "red"}, {"key": "n"}, rest(2), {"screenshot": "red.png"}, {"key": "z"},
                              {"key": "n"}, {"state": "undone"}, {"key": "n"}, rest(2),
                              {"screenshot": "undone.png"}, {"key": "z", "shift": True}, rest(2),
                              {"screenshot": "redone.png"}, {"key": "z", "shift": True}, {"state": "no more"}], *QUICK)
        self.assertEqual(states["red"]["edit"]["row"], "base_colour r")
        self.assertAlmostEqual(states["red"]["edit"]["fields"]["base_colour"][0], 0.9, 6)
        self.assertEqual(states["undone"]["edit"]["fields"], edit["fields"])
        self.assertIn("undone", states["undone"]["notice"])
        self.assertIn("nothing to redo", states["no more"]["notice"])
        before, red, undone, redone = (read_png(self.folder / f"{name}.png")[2][:ABOVE_NOTICES]
                                       for name in ("before", "red", "undone", "redone"))
        self.assertGreater(error_of(before, red), 2 * sum(map(len, before)))
        self.assertEqual(before, undone)
        self.assertEqual(red, redone)

    def test_a_scene_without_lights_says_so(self):
        def darken(model):
            for node in model["nodes"]:
                node.get("extensions", {}).pop("KHR_lights_punctual", None)

        change_model(bundled_scenes() / "teapot.glb", self.folder / "dark.glb", darken)
        states = self.replay([rest(1), *pick(*POT), rest(1), {"key": "tab"}, {"state": "light"}, {"key": "tab", "shift": True},
                              {"state": "material"}], scene=self.folder / "dark.glb")
        self.assertEqual((states["light"]["edit"]["title"], states["light"]["edit"]["fields"]), ("the scene has no light", {}))
        self.assertEqual(states["material"]["edit"]["kind"], "material")
        self.assertNotEqual(states["material"]["edit"]["fields"], {})

    @long_test
    def test_what_is_changed_has_an_outline_at_rest_while_the_panel_is_open(self):
        """What the line goes around is tested in unit/viewer."""
        size, left = (640, 360), 640 - 12 - 376  # of the panel
        states = self.replay([rest(2), *HIDE, *pick(128, 180), rest(2), {"screenshot": "picked.png"}, {"key": "tab"},
                              {"screenshot": "light.png"}, {"key": "tab", "shift": True}, *drag(60, 340, 12, 0), {"state": "moving"},
                              {"screenshot": "moving.png"}, rest(2), {"screenshot": "moved.png"}, {"state": "moved"}, {"key": "n"},
                              {"screenshot": "closed.png"}], *QUICK, size=size)
        self.assertEqual((states["moving"]["eye"], states["moved"]["edit"]["name"]), (states["moved"]["eye"], "red"))
        for name, has_line in (("picked", True), ("light", False), ("moving", False), ("moved", True), ("closed", False)):
            _, _, rows, channels = read_png(self.folder / f"{name}.png")
            line = {tuple(row[channels * x:channels * x + 3]) for row in rows for x in range(left)} & {(255, 190, 92)}
            self.assertEqual(bool(line), has_line, name)

    @long_test
    def test_a_drag_is_one_change_and_nodes_and_lights_are_edited_too(self):
        edit = self.picked()
        # A panel of 376 pixels at the right of the window; its first row begins 68 below its top.
        row = sum(len(values) for values in list(edit["fields"].values())[:list(edit["fields"]).index("roughness")]) + 1
        y, x = 68 + 17 * row + 8, 1280 - 12 - 376 + 190
        moves = [{"mouse": "move", "x": x + 10 * step, "y": y + 40, "after": 0.06} for step in range(1, 9)]
        states = self.replay([rest(1), *pick(640, 320), rest(1), {"mouse": "down", "button": "left", "x": x, "y": y}, *moves,
                              {"mouse": "up", "button": "left", "x": x + 80, "y": y + 40}, {"state": "dragged"}, {"key": "z"},
                              {"state": "undone"}, {"key": "z"}, {"state": "no more"}, {"key": "tab"}, {"state": "light"},
                              {"key": "return"}, {"state": "its node"}, {"key": "down"}, {"key": "right"}, {"state": "moved"}],
                             "--scale", "8", size=(1280, 720))
        self.assertEqual(states["dragged"]["edit"]["row"], "roughness")
        self.assertAlmostEqual(states["dragged"]["edit"]["fields"]["roughness"][0], 80 / 96, 5)
        self.assertEqual(states["undone"]["edit"]["fields"], edit["fields"])
        self.assertIn("nothing to undo", states["no more"]["notice"])
        self.assertEqual([states[name]["edit"]["kind"] for name in ("light", "its node", "moved")], ["light", "node", "node"])
        self.assertNotEqual(states["its node"]["edit"]["fields"], states["moved"]["edit"]["fields"])
        self.assertEqual(states["dragged"]["eye"], states["moved"]["eye"])  # the camera is left alone

    @long_test
    def test_the_command_line_changes_the_model_before_it_is_shown(self):
        """Each time that it is loaded, but not one that is dropped in its place."""
        model = self.folder / "pot.glb"
        shutil.copy(bundled_scenes() / "teapot.glb", model)
        rough = float(self.picked()["fields"]["roughness"][0] <= 0.5)
        edit = ["--edit", f"material.*.roughness={rough}"]
        pick_it = [*pick(*POT), rest(1)]
        states = self.replay([rest(1), *pick_it, {"state": "edited"}, {"key": "z"}, {"state": "no undo"},
                              {"drop": str(model)}, rest(1), *pick_it, {"state": "dropped"}], *edit)
        self.assertEqual(states["edited"]["edit"]["fields"]["roughness"], [rough])
        self.assertIn("nothing to undo", states["no undo"]["notice"])
        self.assertEqual(states["dropped"]["edit"]["fields"], self.picked()["fields"])
        self.replay([rest(1)], "--edit", "material.nothing.roughness=1", status=2)
        self.assertIn("no material 'nothing'", self.errors)

    @long_test
    def test_what_changes_in_the_file_is_sent_alone_and_the_view_goes_on(self):
        """Camera, clip, selection and undo are kept, and so are edits of what the file does not change; the command line's
        are made again."""
        model = self.folder / "carousel.glb"
        shutil.copy(bundled_scenes() / "carousel.glb", model)

        def repaint(scene):
            scene["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = [0.9, 0.1, 0.1, 1]  # the floor's

        # One step of the clip: the pot is still where it is picked.
        events = [rest(1), *drag(160, 90, 40, 10), {"key": "v"}, {"key": "space"}, {"key": "right"}, rest(1), *pick(200, 108), rest(1),
                  {"state": "picked"}, *[{"key": "down"}] * 4, *typed("0.9"), rest(2), *HIDE, {"screenshot": "before.png"},
                  {"state": "before"}, {"wait": "change"}, {"state": "changed"}, rest(2), {"screenshot": "after.png"}, {"state": "after"},
                  {"key": "z"}, rest(2), {"state": "undone"}]
        with Daemon() as daemon, Relay(daemon.path, self.folder / "relay") as relay:
            process = self.start(events, model, "--watch", "--edit", "material.*.roughness=0.25", "--headless",
                                 "--server", f"unix:{self.folder}/relay", *QUICK, scene=None)
            states = [json.loads(process.stdout.readline()) for _ in range(2)]
            first = relay.sent
            change_model(model, model, repaint)
            states += self.end(process).values()
            again = relay.sent - first
        picked, before, changed, after, undone = states
        self.assertGreater(first, 1_000_000)
        self.assertLess(again, 20_000)  # cameras and questions, each a few hundred bytes
        self.assertEqual([state["times_live"] for state in states], [1] * 5)
        self.assertIn("nodes rebuilt 0, nodes refitted 0", after["structure"][0])
        for kept in ("eye", "look_at", "clip", "time_s", "edit"):
            self.assertEqual(before[kept], after[kept])
        self.assertGreater(before["time_s"], 0)
        self.assertGreater(difference(self.folder / "before.png", self.folder / "after.png"), 5)
        self.assertIn("carousel.glb is read again; sent 0.000 of", changed["notice"])
        self.assertNotEqual(after["edit"]["fields"]["base_colour"], picked["edit"]["fields"]["base_colour"])
        self.assertEqual(after["edit"]["fields"]["roughness"], [0.25])
        self.assertEqual(undone["edit"]["fields"], picked["edit"]["fields"])

    @long_test
    def test_two_viewers_see_what_the_other_one_changes(self):
        keys = choose(self.picked(), "base_colour")
        begin = [rest(2), *HIDE, *pick(*POT), rest(2), {"state": "picked"}]
        change, end = {"wait": "change"}, [{"after": 0.5}, {"key": "n"}, rest(2)]
        first = [*begin, change, {"after": 0.5}, {"state": "changed"}, *keys, {"key": "down"}, *typed("0.8"), {"state": "mine"},
                 *end, {"screenshot": "first.png"}]
        second = [*begin, *keys, *typed("0.9"), {"state": "mine"}, change, {"after": 0.5}, {"state": "changed"}, *end,
                  {"screenshot": "second.png"}]
        states, other = self.two_viewers(first, second)
        for state in (states["changed"], other["mine"]):
            self.assertAlmostEqual(state["edit"]["fields"]["base_colour"][0], 0.9, 6)
        for state in (states["mine"], other["changed"]):  # each keeps what the other one has changed
            self.assertEqual([round(value, 5) for value in state["edit"]["fields"]["base_colour"][:2]], [0.9, 0.8])
        self.assertEqual(difference(self.folder / "first.png", self.folder / "second.png"), 0)
