# SPDX-License-Identifier: MIT
"""Blender's camera: a node with a camera, and the picture's fields of a job.

The axis of the protocol's cameras passes through the middle of the picture. A shifted camera, or a part of a picture (render
border), is therefore a part of a larger picture."""
from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from farlight.scene import Object
from farlight.messages import ObjectKind, SetCamera

if TYPE_CHECKING:
    from .mirror import Mirror

LARGEST = 8192  # pixels of a side, the protocol's limit


class TooLarge(Exception):
    """The picture exceeds the protocol's limits."""


@dataclass
class Lens:
    """The whole picture that is rendered, and the wanted part of it, pixels from the top left."""
    width: int
    height: int
    left: int
    top: int
    part_width: int
    part_height: int
    fov_y: float  # angle of the whole picture; 0: orthographic
    ortho_height: float
    aperture: float  # metres
    focus: float

    def is_part(self) -> bool:
        """True if only a part of the picture is wanted."""
        return (self.part_width, self.part_height) != (self.width, self.height)

    def fields(self, may_crop: bool) -> dict[str, Any]:
        """Fields of a job. may_crop: the daemon renders only the part."""
        crop = {"crop_x": self.left, "crop_y": self.top, "crop_width": self.part_width, "crop_height": self.part_height}
        lens = {"aperture": self.aperture, "focus": self.focus} if self.aperture > 0 else {}
        return {"width": self.width, "height": self.height, **lens, **(crop if may_crop and self.is_part() else {})}

    def cut(self, image: Any) -> Any:
        """Cuts the part out of an image, which may be the part already."""
        if image.shape[:2] == (self.part_height, self.part_width):
            return image
        return image[self.top:self.top + self.part_height, self.left:self.left + self.part_width]


def _focus(camera: bpy.types.Object) -> tuple[float, float]:
    """Diameter of the lens, and the distance along the view that is in focus, metres."""
    data = camera.data
    if not data.dof.use_dof or data.type != "PERSP":
        return 0.0, 0.0
    distance = data.dof.focus_distance
    if data.dof.focus_object is not None:
        local = camera.matrix_world.normalized().inverted() @ data.dof.focus_object.matrix_world.translation
        distance = abs(local.z)
    # The focal length is in millimetres; divided by the f-number it is the diameter.
    return data.lens * 1e-3 / max(data.dof.aperture_fstop, 1e-3), max(distance, 1e-3)


def lens(camera: bpy.types.Object, depsgraph: bpy.types.Depsgraph, width: int, height: int,
         border: tuple[float, float, float, float] | None) -> Lens:
    """Computes the lens of a camera. border: left, right, lower, upper as shares of the picture."""
    render = depsgraph.scene_eval.render
    projection = np.array(camera.calc_matrix_camera(depsgraph, x=width, y=height, scale_x=render.pixel_aspect_x,
                                                    scale_y=render.pixel_aspect_y))
    is_flat = camera.data.type == "ORTHO"
    column = 3 if is_flat else 2
    # Offset of the picture's middle from the axis, in pixels to the right and up.
    sign = -1 if is_flat else 1
    right, up = (round(sign * projection[row, column] * size / 2) for row, size in ((0, width), (1, height)))
    whole_width, whole_height = width + 2 * abs(right), height + 2 * abs(up)
    if max(whole_width, whole_height) > LARGEST:
        raise TooLarge(f"a picture of {whole_width}x{whole_height} pixels, with the camera's shift; {LARGEST} are the most")
    left, top = abs(right) + right, abs(up) - up
    part_width, part_height = width, height
    if border is not None:
        first, last, lower, upper = border
        left, part_width = left + int(first * width), max(1, int(last * width) - int(first * width))
        top, part_height = top + height - int(upper * height), max(1, int(upper * height) - int(lower * height))
    tangent = whole_height / height / projection[1, 1]
    aperture, focus = _focus(camera)
    return Lens(whole_width, whole_height, left, top, part_width, part_height,
                0.0 if is_flat else 2 * math.atan(tangent), 2 * tangent if is_flat else 0.0, aperture, focus)


def update(mirror: Mirror, key: Hashable, camera: bpy.types.Object, view: Lens) -> Object:
    """Sets the camera, and the node with this key that shows it."""
    number = mirror.number(ObjectKind.CAMERA, key)
    made = mirror.scene.set(SetCamera(camera=number, fov_y=view.fov_y, height=view.ortho_height,
                                      near=camera.data.clip_start, name=camera.name[:100]))
    assert made is not None
    return mirror.place(key, made, camera.matrix_world, camera, lambda matrix: matrix.normalized())
