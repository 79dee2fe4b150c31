# SPDX-License-Identifier: MIT
"""Editing in the viewer: what is picked is changed and changed back, and two viewers at one scene see each other's changes."""
import shutil
import signal
import subprocess

from farlight_test import BIN, bundled_scenes, read_png
from test_view import HIDE, Viewer, difference, error_of, rest

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

    def test_two_viewers_see_what_the_other_one_changes(self):
        keys = choose(self.picked(), "base_colour")
        begin = [rest(2), *HIDE, *pick(*POT), rest(2), {"state": "picked"}]
        change, end = {"wait": "change"}, [{"after": 0.5}, {"key": "n"}, rest(2)]
        first = [*begin, change, {"after": 0.5}, {"state": "changed"}, *keys, {"key": "down"}, *typed("0.8"), {"state": "mine"},
                 *end, {"screenshot": "first.png"}]
        second = [*begin, *keys, *typed("0.9"), {"state": "mine"}, change, {"after": 0.5}, {"state": "changed"}, *end,
                  {"screenshot": "second.png"}]
        address = f"unix:{self.folder}/up"
        command = [BIN / "farlight", "serve", bundled_scenes() / "teapot.glb", "--name", "pot", "--listen", address]
        with subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, text=True) as server:
            try:
                while "farlight view" not in (line := server.stdout.readline()):
                    self.assertNotEqual(line, "")
                options = ["--headless", "--scene", "pot", "--server", address, *QUICK]
                waiting = self.start(first, *options, scene=None)
                self.assertIn("picked", waiting.stdout.readline())
                other = self.replay(second, *options, scene=None)
                states = self.end(waiting)
            finally:
                server.send_signal(signal.SIGTERM)
        for state in (states["changed"], other["mine"]):
            self.assertAlmostEqual(state["edit"]["fields"]["base_colour"][0], 0.9, 6)
        for state in (states["mine"], other["changed"]):  # each keeps what the other one has changed
            self.assertEqual([round(value, 5) for value in state["edit"]["fields"]["base_colour"][:2]], [0.9, 0.8])
        self.assertEqual(difference(self.folder / "first.png", self.folder / "second.png"), 0)
