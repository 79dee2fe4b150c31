# SPDX-License-Identifier: MIT
"""The viewport, in a Blender with a window: what is drawn follows the world, a thing and the camera.

Run by `make blender-test` on a virtual screen. Blender's timers drive it: each step waits until what it expects is on the screen."""
import os
import pathlib
import sys
import tempfile
import time
import traceback

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
BUILD = os.path.abspath(sys.argv[sys.argv.index("--") + 1])
sys.path[:0] = [f"{BUILD}/python", str(ROOT / "client/blender"), str(HERE)]

import bpy  # pylint: disable=wrong-import-position
from mathutils import Euler  # pylint: disable=wrong-import-position
from farlight.aio import AsyncClient  # pylint: disable=wrong-import-position
import farlight_blender  # pylint: disable=wrong-import-position
from farlight_blender import engine, session  # pylint: disable=wrong-import-position
import scenes  # pylint: disable=wrong-import-position

WAIT_S = 60
FOLDER = tempfile.TemporaryDirectory(prefix="farlight-viewport-")


def area():
    return next(one for one in bpy.context.window_manager.windows[0].screen.areas if one.type == "VIEW_3D")


def middle():
    """The screen's colour in the middle of the viewport: red, green, blue."""
    path = pathlib.Path(FOLDER.name) / "screen.png"
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.screen.screenshot(filepath=str(path))
    picture, place = scenes.load(path)[::-1], area()
    row, column = place.y + place.height // 2, place.x + place.width // 2
    return picture[row - 2:row + 3, column - 2:column + 3, :3].mean(axis=(0, 1))


def world(colour):
    bpy.context.scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (*colour, 1)


def begin():
    scene = scenes.empty((0.8, 0.1, 0.1))
    scene.render.engine, scene.farlight.view_samples = "FARLIGHT", 4
    scene.farlight.samples, scene.farlight.use_auto_clamp = 16, True
    area().spaces.active.overlay.show_overlays = area().spaces.active.show_gizmo = False
    area().spaces.active.shading.type = "RENDERED"


def is_red():
    """And the view clamps as F12 with 16 samples does, at a quarter of 10."""
    red, green, _ = middle()
    if red <= 0.5 or red <= 2 * green:
        return False
    assert set(clamps) == {2.5}, clamps
    return True


def is_green():
    red, green, _ = middle()
    return green > 0.4 and green > 1.5 * red


def is_blue():
    red, _, blue = middle()
    return blue > 1.5 * red


def shine(colour):
    bpy.data.materials["shining"].node_tree.nodes["Principled BSDF"].inputs["Emission"].default_value = (*colour, 1)


def put_a_ball():
    shining = scenes.material("shining", Base_Color=(0, 0, 0, 1), Emission=(0, 0, 1, 1), Emission_Strength=1)
    scenes.ball("ball", shining, (0, 0, 0), 2)


def orbit():
    """Half about the ball: it is in the middle from everywhere."""
    area().spaces.active.region_3d.view_rotation.rotate(Euler((0, 0, 3)))


def look_away():
    area().spaces.active.region_3d.view_location.x = 40


def kill_the_daemon():
    session._sessions[None, None]._client._link.process.kill()
    told.clear()
    world((0.8, 0.1, 0.1))


def is_told_and_red():
    """The message says what has happened, and the next daemon has the scene."""
    return any("connection" in one and "tried again in 1 s" in one for one in told) and is_red()


def no_view_is_left():
    only = session._sessions[None, None]
    return only.wait(only._client.stats()).jobs == 0


STEPS = [(begin, is_red), (lambda: world((0.1, 0.6, 0.1)), is_green), (put_a_ball, is_blue), (orbit, is_blue),
         (lambda: shine((1, 0, 0)), is_red), (look_away, is_green), (kill_the_daemon, is_told_and_red),
         (lambda: setattr(area().spaces.active.shading, "type", "SOLID"), no_view_is_left)]


def step(state={"at": 0, "since": None}):  # pylint: disable=dangerous-default-value
    try:
        action, is_there = STEPS[state["at"]]
        if state["since"] is None:
            action()
            state["since"] = time.monotonic()
            return 1
        if not is_there():
            if time.monotonic() > state["since"] + WAIT_S:
                raise AssertionError(f"step {state['at']}: the middle is {middle()}")
            return 1
        print(f"viewport: step {state['at']} ok", flush=True)
        state.update(at=state["at"] + 1, since=None)
        if state["at"] < len(STEPS):
            return 0.1
        farlight_blender.unregister()
        os._exit(0)
    except Exception:  # pylint: disable=broad-except  # Blender would go on
        traceback.print_exc()
        os._exit(1)


os.environ["FARLIGHT_LIBEXEC"] = BUILD
bpy.context.preferences.view.show_splash = False
clamps = []  # that views were asked for
told = []  # what the viewport's engine has said
farlight_blender.register()
view = AsyncClient.view
AsyncClient.view = lambda self, *job, **values: (clamps.append(values["clamp"]), view(self, *job, **values))[1]
say = engine.FarlightEngine.say
engine.FarlightEngine.say = lambda self, text: (told.append(text), say(self, text))
bpy.app.timers.register(step, first_interval=2)
