# SPDX-License-Identifier: MIT
"""The render engine: F12, animations, and the viewport."""
from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Optional

import bpy
import farlight
import numpy as np
from farlight.frame import Frame
from farlight.messages import Accumulation, Background, Layer

from . import cameras, motion, session, settings
from .mirror import Mirror, forget_all, mirror, moment
from .viewport import Viewport

NOTHING_THERE = 1e10  # Blender's depth where there is no surface
ALBEDO = "Denoising Albedo"
GROUP = "Combined_"  # followed by the name of a light group: Cycles' name of that pass
NOTES_LIGHT = ("path", "distributed")  # integrators whose samples are single paths
FULLY_DENOISED = 128  # number of samples from which a daemon's `auto` filters no noise


def _names(groups: dict[str, int]) -> dict[str, str]:
    """The pass of each layer but the beauty."""
    return {"albedo": ALBEDO, "normal": "Normal", "depth": "Depth",
            **{Layer(Layer.LIGHT_REST + number).word: GROUP + name for name, number in groups.items()}}


def _wanted_layers(layer: bpy.types.RenderLayer, names: dict[str, str]) -> tuple[str, ...]:
    return ("beauty", *(one for one, name in names.items() if name in layer.passes))


def _steps(samples: int, most: int) -> tuple[int, int]:
    """Number of steps, and samples of each."""
    count = -(-samples // most)
    return count, -(-samples // count)


def _job(scene: bpy.types.Scene, view: cameras.Lens, moves: Optional[motion.Motion]) -> dict[str, Any]:
    """Fields of a request for F12."""
    chosen = scene.farlight
    most = chosen.step_samples
    if moves is not None and moves.has_watchers():
        most = max(1, min(most, chosen.samples // chosen.motion_steps))
    steps, samples = _steps(chosen.samples, most)
    background = Background.TRANSPARENT if scene.render.film_transparent else Background.ENVIRONMENT
    job = {**view.fields(may_crop=chosen.denoise == "off"), "integrator": chosen.integrator, "tracer": chosen.tracer,
            "samples": samples, "last_frame": steps - 1, "accumulate": Accumulation.ANEW, "depth": chosen.depth,
            "clamp": settings.clamp_of(chosen), "denoise": chosen.denoise, "background": background, "seed": scene.frame_current}
    if moves is None or not moves.has_any():
        return job
    # The daemon cannot know this, as its frames have few samples
    if chosen.denoise == "auto" and steps * samples > FULLY_DENOISED:
        job["denoise"] = "off"
    return {**job, **moves.job(steps)}


def _passes(frame: Frame, view: cameras.Lens, names: dict[str, str], is_transparent: bool) -> dict[str, Any]:
    """Arrays by the names of Blender's passes, rows from the top."""
    made = {"Combined": frame.colour}
    if not is_transparent:  # the visible world is opaque, however dark
        made["Combined"] = np.array(frame.colour)
        made["Combined"][..., 3] = 1
    words = [one.word for one in frame.layers]
    if "depth" in words:
        made["Depth"] = np.where(np.isinf(frame.depth), NOTHING_THERE, frame.depth)[..., None]
    if "normal" in words:
        normal = frame.normal
        made["Normal"] = np.stack((normal[..., 0], -normal[..., 2], normal[..., 1]), axis=-1)  # z up again
    if "albedo" in words:
        made[ALBEDO] = frame.albedo
    made.update({names[word]: frame.layer(word)[..., :3] for word in words if names.get(word, "").startswith(GROUP)})
    return {name: view.cut(image) for name, image in made.items()}


def _vectors(frame: Frame) -> Any:
    """Motion vectors as in Cycles: from here to the surface's place a frame earlier, and from its place a frame later to here. Zero
    where there is no surface."""
    vectors = np.concatenate((frame.motion[..., 2:], -frame.motion[..., :2]), axis=-1)
    return np.where(np.isinf(frame.depth)[..., None], 0, vectors)


_reported: set[str] = set()  # notes already shown to users of viewports


class _Mean:
    """The mean of frames that each cover a part of the shutter's time."""

    def __init__(self, frames: int) -> None:
        self._middle, self._added = frames // 2, 0
        self._images: dict[str, Any] = {}

    def add(self, images: dict[str, Any]) -> dict[str, Any]:
        """Adds a frame; returns the images so far. Depths are not averaged: the middle frame's is kept."""
        for name, image in images.items():
            before = self._images.get(name)
            if name == "Depth":
                self._images[name] = image if self._added <= self._middle else before
            else:
                self._images[name] = image if before is None else before + (image - before) / (self._added + 1)
        self._added += 1
        return self._images


class FarlightEngine(bpy.types.RenderEngine):  # type: ignore[misc]
    """The render engine; Blender makes an instance for each picture."""
    bl_idname, bl_label = settings.ENGINE, "farlight"
    bl_use_shading_nodes_custom = False
    bl_use_eevee_viewport = True  # for the preview of materials
    _viewport: Optional[Viewport] = None

    # ---- what Blender calls

    def update_render_passes(self, scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> None:
        """Registers the passes."""
        self.register_pass(scene, layer, "Combined", 4, "RGBA", "COLOR")
        if layer.use_pass_z:
            self.register_pass(scene, layer, "Depth", 1, "Z", "VALUE")
        if layer.use_pass_normal:
            self.register_pass(scene, layer, "Normal", 3, "XYZ", "VECTOR")
        if motion.has_vectors(scene, layer):
            self.register_pass(scene, layer, "Vector", 4, "XYZW", "VECTOR")
        if scene.farlight.use_pass_albedo:
            self.register_pass(scene, layer, ALBEDO, 3, "RGB", "COLOR")
        for group in layer.lightgroups:
            self.register_pass(scene, layer, GROUP + group.name, 3, "RGB", "COLOR")

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Renders a view layer."""
        try:
            self._render(depsgraph)
        except session.Stopped:
            pass
        except farlight.ConnectionLost as why:
            self._fail(str(why) if why.remedy else f"{why}; render again, which connects again and sends everything")
        except (farlight.Error, cameras.TooLarge) as why:
            self._fail(str(why))

    def view_update(self, _: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Called after changes of the viewport's scene."""
        self._seen(lambda: self._note(self._viewport_of(depsgraph).update(depsgraph)))

    def view_draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Called to draw the viewport."""
        self._seen(lambda: self._viewport_of(depsgraph).draw(context, depsgraph.scene_eval))

    def _viewport_of(self, depsgraph: bpy.types.Depsgraph) -> Viewport:
        if self._viewport is None:
            self._viewport = Viewport(self, depsgraph.scene_eval)
        return self._viewport

    def _note(self, notes: list[str]) -> None:
        """Reports features that the viewport lacks, once a session, since every change of the scene would repeat them."""
        for note in notes:
            if note not in _reported:
                _reported.add(note)
                self._warn(note)

    def _seen(self, action: Callable[[], None]) -> None:
        try:
            action()
        except farlight.Error as why:
            self.say(str(why))

    # ---- a picture

    def say(self, text: str) -> None:
        """Shows a text in the picture's or the viewport's corner."""
        self.update_stats("", f"farlight: {text}")

    def _warn(self, text: str) -> None:
        self.report({"WARNING"}, f"farlight: {text}")

    def _fail(self, text: str) -> None:
        self.report({"ERROR"}, f"farlight: {text}")
        self.error_set(f"farlight: {text}")

    def _render(self, depsgraph: bpy.types.Depsgraph) -> None:
        scene = depsgraph.scene_eval
        camera = scene.camera
        if camera is None or camera.type != "CAMERA":
            self._fail("the scene has no camera")
            return
        if camera.data.type == "PANO":
            self._fail(f"{camera.name} is panoramic; perspective and orthographic cameras can be rendered")
            return
        self.say("reading the scene")
        moves = self._moves(depsgraph, camera)
        view = cameras.lens(camera.evaluated_get(depsgraph), depsgraph, *_size(scene), _border(scene))
        image = mirror((scene.name_full, depsgraph.view_layer_eval.name))
        node = image.update(depsgraph, (camera.evaluated_get(depsgraph), view), moves)
        for note in image.notes:
            self._warn(note)
        self.say("sending the scene")
        daemon = session.session(*settings.server_of(scene))
        daemon.wait(daemon.send(image.scene), self.test_break)
        layer = depsgraph.view_layer_eval.name
        if scene.farlight.use_pass_albedo:
            self.add_pass(ALBEDO, 3, "RGB", layer=layer)
        for group in depsgraph.view_layer_eval.lightgroups:
            self.add_pass(GROUP + group.name, 3, "RGB", layer=layer)
        result = self.begin_result(0, 0, view.part_width, view.part_height, layer=layer)
        try:
            job = _job(scene, view, moves if motion.is_wanted(scene) else None)
            self._show(result, daemon, image, node, view, job, self._vector_pass(scene, daemon, image, node, view, moves))
        finally:
            self.end_result(result)  # shows the partial picture

    def _moves(self, depsgraph: bpy.types.Depsgraph, camera: bpy.types.Object) -> Optional[motion.Motion]:
        """Evaluates Blender's scene at the keys of the shutter, then at the frame's time again."""
        scene = depsgraph.scene_eval
        if not motion.is_wanted(scene) and not motion.has_vectors(scene, depsgraph.view_layer_eval):
            return None
        now, moments = (scene.frame_current, scene.frame_subframe), []
        for time in motion.times(scene):
            self.frame_set(math.floor(time), time - math.floor(time))
            moments.append(moment(depsgraph, camera.evaluated_get(depsgraph)))
        self.frame_set(*now)
        return motion.Motion(moments)

    def _vector_pass(self, scene: bpy.types.Scene, daemon: session.Session, image: Mirror, node: Any, view: cameras.Lens,
                     moves: Optional[motion.Motion]) -> dict[str, Any]:
        """The pass Vector by its name; empty if it is not wanted or nothing moves."""
        if moves is None or motion.is_wanted(scene) or not moves.has_any():
            return {}
        job = {**view.fields(may_crop=True), "aperture": 0, "tracer": scene.farlight.tracer, **moves.vector_job()}
        return {"Vector": view.cut(_vectors(daemon.wait(daemon.render(image.scene, node, **job), self.test_break)))}

    def _show(self, result: bpy.types.RenderResult, daemon: session.Session, image: Mirror, node: Any, view: cameras.Lens,
              job: dict[str, Any], vectors: dict[str, Any]) -> None:
        layer = result.layers[0]
        count = job["last_frame"] + 1
        self.say(f"{job['samples'] * count} samples")
        mean = _Mean(count) if "clips" in job else None
        groups = image.light_groups if job["integrator"] in NOTES_LIGHT else {}
        if len(groups) < len(image.light_groups):
            self._warn(f"light groups are black: the integrator {job['integrator']} does not note them, and path does")
        names = _names(groups)
        for frame in daemon.frames(image.scene, node, self.test_break, layers=_wanted_layers(layer, names), **job):
            images = _passes(frame, view, names, job["background"] == Background.TRANSPARENT)
            _write(layer, mean.add(images) if mean else {**images, **vectors})
            self.update_result(result)
            self.update_progress((frame.number + 1) / count)
        for warning in frame.warnings:
            self._warn(warning)


def _write(layer: bpy.types.RenderLayer, images: dict[str, Any]) -> None:
    """Writes all passes at once, rows from below: set one by one, Blender converts them to Python lists, fifty times slower."""
    nothing = np.zeros(images["Combined"].shape[:2])
    rows = [images[one.name] if one.name in images else np.repeat(nothing[..., None], one.channels, axis=2) for one in layer.passes]
    layer.passes.foreach_set("rect", np.concatenate([one[::-1].astype(np.float32).ravel() for one in rows]))


def _size(scene: bpy.types.Scene) -> tuple[int, int]:
    share = scene.render.resolution_percentage / 100
    return max(1, int(scene.render.resolution_x * share)), max(1, int(scene.render.resolution_y * share))


def _border(scene: bpy.types.Scene) -> Optional[tuple[float, float, float, float]]:
    """Left, right, lower and upper edge of the part to be rendered."""
    render = scene.render
    return (render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y) if render.use_border else None


@bpy.app.handlers.persistent  # type: ignore[misc]
def _forget(_: Any) -> None:
    for one in forget_all():
        session.release(one.scene)


def register() -> None:
    """Called when the add-on is enabled."""
    bpy.utils.register_class(FarlightEngine)
    bpy.app.handlers.load_pre.append(_forget)
    bpy.app.timers.register(session.idle, persistent=True)


def unregister() -> None:
    """Called when the add-on is disabled."""
    bpy.app.timers.unregister(session.idle)
    bpy.app.handlers.load_pre.remove(_forget)
    bpy.utils.unregister_class(FarlightEngine)
    forget_all()
    session.close_all()
