# SPDX-License-Identifier: MIT
"""The viewport: a view of the daemon's, whose newest frame is drawn.

It has a scene and a job of its own; a flat view is a perspective one with a field of 1 degree. Nothing waits for the daemon: a lost
one is tried again after 1 s, then 2, up to 8.
"""
from __future__ import annotations

import asyncio
import math
from typing import TYPE_CHECKING, Any, Optional

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

if TYPE_CHECKING:
    from .engine import FarlightEngine

LOOK_S = 0.03  # interval of polling for frames
# Delay before a failed view is started again, and its maximum, since each attempt may start an ssh
RETRY_S, RETRY_MAX_S = 1.0, 8.0


def _camera(region: bpy.types.Region, view: bpy.types.RegionView3D) -> farlight.Camera:
    """The viewport's camera; a view without perspective becomes one from far away."""
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
    """The viewport of an engine: a mirror of its own, and a job that follows its camera. Nothing here waits: the connection
    runs in slices of a timer, so that a slow or lost daemon does not block Blender."""

    def __init__(self, engine: FarlightEngine, scene: bpy.types.Scene) -> None:
        self._engine = engine
        self._mirror = Mirror()
        self._session = session.session(*settings.server_of(scene))
        self._view: Optional[AsyncView] = None
        self._wanted: Optional[tuple[Any, farlight.Camera]] = None  # job and camera
        self._asked: Any = None  # the job of the view
        self._camera: Optional[farlight.Camera] = None
        self._is_sent = True
        self._pause = RETRY_S
        self._working: Optional[asyncio.Task[Any]] = None  # opens a view, or sends the scene
        self._waiting: Optional[asyncio.Task[Frame]] = None
        self._pixels: Any = None  # received pixels, not uploaded as a texture yet
        self._texture: Optional[gpu.types.GPUTexture] = None
        bpy.app.timers.register(self._look)

    # ---- what Blender calls

    def update(self, depsgraph: bpy.types.Depsgraph) -> list[str]:
        """Updates the mirror after a change; returns missing features."""
        self._mirror.update(depsgraph)
        self._is_sent = False
        return self._mirror.notes

    def draw(self, context: bpy.types.Context, scene: bpy.types.Scene) -> None:
        """Draws the newest frame, and requests the current view."""
        camera = _camera(context.region, context.region_data)
        chosen = scene.farlight
        job = {"width": context.region.width, "height": context.region.height, "integrator": chosen.integrator,
               "tracer": chosen.tracer, "samples": chosen.view_samples, "depth": chosen.depth,
               "clamp": settings.clamp_of(chosen), "denoise": chosen.denoise, "format": PixelFormat.RGBA16F, "moving_rate": 10}
        self._wanted = job, camera
        if self._view is not None and job == self._asked and camera != self._camera:
            self._view.set_camera(camera)
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

    async def _open(self, job: Any, camera: farlight.Camera) -> None:
        """Replaces the view by another one."""
        if self._view is not None:
            view, self._view = self._view, None
            await view.close()
        client = await self._session.client()
        self._view = await client.view(self._mirror.scene, camera, **job)
        self._asked, self._camera = job, camera

    def _stop(self) -> Optional[AsyncView]:
        """Ends the view, if there is one."""
        for task in (self._working, self._waiting):
            if task is not None:
                task.cancel()
        view, self._view, self._asked, self._working, self._waiting = self._view, None, None, None, None
        return view

    def _look(self) -> Optional[float]:
        """Called by a timer of Blender's: runs the connection, until the viewport shows something else."""
        try:
            self._engine.is_preview  # pylint: disable=pointless-statement  # raises once Blender has freed the engine
            self._go_on()
        except ReferenceError:
            view = self._stop()
            if view is not None:
                self._session.start(view.close())
            self._session.start(self._session.forget(self._mirror.scene))
            return None
        except farlight.Error as why:
            self._stop()
            pause, self._pause = self._pause, min(2 * self._pause, RETRY_MAX_S)
            self._engine.say(f"{why} (tried again in {pause:g} s)")
            self._engine.tag_redraw()
            return pause
        return LOOK_S

    def _begin(self) -> None:
        """Starts the next task, if none is running."""
        if self._wanted is not None and self._wanted[0] != self._asked:
            if self._waiting is not None:
                self._waiting.cancel()
                self._waiting = None
            self._is_sent = True  # sent with the view
            self._working = self._session.start(self._open(*self._wanted))
        elif not self._is_sent and self._view is not None:
            self._is_sent = True
            self._working = self._session.start(self._session.send(self._mirror.scene))

    def _go_on(self) -> None:
        if self._working is None:
            self._begin()
        if self._waiting is None and self._working is None and self._view is not None:
            self._waiting = self._session.start(self._view.next_frame())
        for task in (self._working, self._waiting):
            if task is not None:
                self._session.slice(task, 0.001)
        if self._working is not None and self._working.done():
            done, self._working = self._working, None
            done.result()
        if self._waiting is not None and self._waiting.done():
            come, self._waiting = self._waiting, None
            self._show(come.result())

    def _show(self, frame: Frame) -> None:
        self._pause = RETRY_S
        self._pixels = np.array(frame.colour[::-1], np.float32, order="C")
        self._pixels[..., 3] = 1
        self._engine.say(f"{frame.begin.samples} samples")
        self._engine.tag_redraw()
