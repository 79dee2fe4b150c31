# SPDX-License-Identifier: MIT
"""The viewport: a view of the daemon's, whose newest frame is drawn."""
from __future__ import annotations

import math
from typing import Any, Optional

import bpy
import farlight
import gpu
import numpy as np
from farlight.aio import AsyncView
from farlight.frame import Frame
from farlight.messages import PixelFormat
from gpu_extras.presets import draw_texture_2d

from . import session, settings
from .mirror import WORLD_FROM_BLENDER, Mirror

LOOK_S = 0.03  # how often it is looked whether a frame has come
RETRY_S = 1.0  # before a view is begun again that has failed


def _camera(region: bpy.types.Region, view: bpy.types.RegionView3D) -> farlight.Camera:
    """That of the viewport; one without perspective is shown by one from far away."""
    eye_from_world = np.array(view.view_matrix)
    projection = np.array(view.window_matrix)
    world_from_eye = WORLD_FROM_BLENDER @ np.linalg.inv(eye_from_world)
    right, up, back, eye = world_from_eye[:3].T
    fov = 2 * math.atan(1 / projection[1, 1])
    if not view.is_perspective:
        height, fov = 2 / projection[1, 1], math.radians(1)
        eye = WORLD_FROM_BLENDER[:3, :3] @ np.array(view.view_location) + back * (height / 2 / math.tan(fov / 2))
    return farlight.Camera(tuple(eye), tuple(eye - back), tuple(up), math.degrees(fov))


class Viewport:
    """Of one engine: a mirror of its own, and a job that follows its camera."""

    def __init__(self, engine: bpy.types.RenderEngine, scene: bpy.types.Scene) -> None:
        self._engine = engine
        self._mirror = Mirror()
        self._session = session.session(*settings.server_of(scene))
        self._view: Optional[AsyncView] = None
        self._asked: Any = None
        self._camera: Optional[farlight.Camera] = None
        self._waiting: Any = None
        self._pixels: Any = None  # that have come and are no texture yet
        self._texture: Optional[gpu.types.GPUTexture] = None
        bpy.app.timers.register(self._look)

    # ---- what Blender calls

    def update(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Something has changed."""
        self._mirror.update(depsgraph)
        self._session.wait(self._session.send(self._mirror.scene))

    def draw(self, context: bpy.types.Context, scene: bpy.types.Scene) -> None:
        """Draws what there is, and asks for what is seen now."""
        camera = _camera(context.region, context.region_data)
        chosen = scene.farlight
        job = {"width": context.region.width, "height": context.region.height, "integrator": chosen.integrator,
               "tracer": chosen.tracer, "samples": chosen.view_samples, "depth": chosen.depth, "clamp": chosen.clamp,
               "denoise": chosen.denoise, "format": PixelFormat.RGBA16F, "moving_rate": 10}
        if job != self._asked:
            self._end()
            client = self._session.wait(self._session.client())
            self._view = self._session.wait(client.view(self._mirror.scene, camera, **job))
            self._asked, self._camera = job, camera
        elif camera != self._camera and self._view is not None:
            self._view.look(camera)
            self._camera = camera
        if self._pixels is not None:
            height, width = self._pixels.shape[:2]
            buffer = gpu.types.Buffer("FLOAT", self._pixels.size, self._pixels.ravel())
            self._texture, self._pixels = gpu.types.GPUTexture((width, height), format="RGBA16F", data=buffer), None
        if self._texture is not None:
            self._engine.bind_display_space_shader(scene)
            draw_texture_2d(self._texture, (0, 0), context.region.width, context.region.height)
            self._engine.unbind_display_space_shader()

    # ---- frames

    def _end(self) -> None:
        if self._waiting is not None:
            self._waiting.cancel()
            self._waiting = None
        if self._view is not None:
            view, self._view = self._view, None
            self._session.wait(view.close())

    def _look(self) -> Optional[float]:
        """A timer of Blender's: lets the connection go on, until the viewport shows something else."""
        try:
            self._engine.is_preview  # pylint: disable=pointless-statement  # raises once Blender has freed the engine
            self._take()
        except ReferenceError:
            self._end()
            self._session.start(self._session.forget(self._mirror.scene))
            return None
        except farlight.Error as why:
            self._asked = self._view = self._waiting = None  # the next draw begins a new view
            self._engine.update_stats("", f"farlight: {why}")
            self._engine.tag_redraw()
            return RETRY_S
        return LOOK_S

    def _take(self) -> None:
        if self._view is None:
            return
        if self._waiting is None:
            self._waiting = self._session.start(self._view.next_frame())
        self._session.slice(self._waiting, 0.001)
        if self._waiting.done():
            frame, self._waiting = self._waiting.result(), None
            self._show(frame)

    def _show(self, frame: Frame) -> None:
        self._pixels = np.array(frame.colour[::-1], np.float32, order="C")
        self._pixels[..., 3] = 1
        self._engine.update_stats("", f"farlight: {frame.begin.samples} samples")
        self._engine.tag_redraw()
