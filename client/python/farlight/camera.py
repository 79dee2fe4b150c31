# SPDX-License-Identifier: MIT
"""Cameras, and requests of pictures with them."""
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Union

import numpy as np

from . import arrays, decode, fields, messages
from .arrays import Array, Numbers
from .errors import InvalidValue
from .frame import LayersOf, layer_set
from .messages import Encoding, ObjectKind
from .objects import Object, make

CLAMP, CLAMP_SAMPLES, CLAMP_MIN = 10.0, 64, 1.25  # the command `farlight render` has the same
FOV_MIN, FOV_MAX = 0.06, 177.6  # degrees: the limits of messages, which are in radians


def look_at(eye: Numbers, target: Numbers, up: Numbers = (0, 1, 0)) -> Array:
    """The 4 x 4 transform of a node at `eye` whose -z points at `target`: for cameras, spots and rectangles."""
    place, at, above = (np.array(arrays.vector(one, f"look_at.{name}"))
                        for one, name in ((eye, "eye"), (target, "target"), (up, "up")))
    back = place - at
    right = np.cross(above, back)
    if not np.linalg.norm(back) > 0 or not np.linalg.norm(right) > 1e-12 * np.linalg.norm(back):
        raise InvalidValue("the eye is at its target, or looks along `up`", field="look_at",
                           remedy="move one of them, or give another `up`")
    back, right = back / np.linalg.norm(back), right / np.linalg.norm(right)
    made = np.eye(4)
    made[:3] = np.column_stack((right, np.cross(back, right), back, place))
    return made


def translate(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Array:
    """The 4 x 4 transform of a node at this place."""
    made = np.eye(4)
    made[:3, 3] = arrays.vector((x, y, z), "translate")
    return made


def command(camera: Any, moving: bool, time_s: float) -> messages.ViewCamera:
    """Makes a camera message of a view."""
    if not isinstance(camera, Camera):
        raise InvalidValue(f"{camera!r:.80} is no farlight.Camera", field="camera")
    return messages.ViewCamera(moving=int(moving), time_s=time_s, eye_world=camera.eye, look_at_world=camera.look_at,
                               up_world=camera.up, fov_y=math.radians(camera.fov_degrees))


@dataclass(frozen=True)
class Camera:
    """A camera of a job: its position, the point at the centre of its picture, its vertical field of view."""
    eye: Sequence[float]
    look_at: Sequence[float] = (0.0, 0.0, 0.0)
    up: Sequence[float] = (0.0, 1.0, 0.0)
    fov_degrees: float = 40.0
    time_s: float = 0.0

    def __post_init__(self) -> None:
        for name in ("eye", "look_at", "up"):
            object.__setattr__(self, name, tuple(arrays.vector(getattr(self, name), f"camera.{name}")))
        for name in ("fov_degrees", "time_s"):
            object.__setattr__(self, name, arrays.number(getattr(self, name), f"camera.{name}"))
        if not FOV_MIN <= self.fov_degrees <= FOV_MAX:
            raise InvalidValue(f"{self.fov_degrees:g} is not within {FOV_MIN} .. {FOV_MAX}", field="camera.fov_degrees")

    @classmethod
    def from_matrix(cls, world_from_camera: Numbers, fov_degrees: float = 40.0, *, convention: str = "opengl",
                    time_s: float = 0.0) -> Camera:
        """Makes a camera from a 4 x 4 or 3 x 4 pose. convention: "opengl", as in Blender and Frame.world_from_view, has the
        view along -z and y up; "opencv", as in COLMAP's inverse poses, along +z and y down."""
        if convention not in ("opengl", "opencv"):
            raise InvalidValue(f"{convention!r:.80}; allowed: opengl, opencv", field="convention")
        pose = np.array(arrays.transform(world_from_camera)).reshape(3, 4)
        sign = 1 if convention == "opengl" else -1
        eye, look_at, up = pose[:, 3], pose[:, 3] - sign * pose[:, 2], sign * pose[:, 1]
        return cls(eye.tolist(), look_at.tolist(), up.tolist(), fov_degrees, time_s)

    @classmethod
    def intrinsics(cls, K: Numbers, width: int, height: int, world_from_camera: Numbers, *,
                   convention: str = "opencv", time_s: float = 0.0) -> tuple[Camera, dict[str, int]]:
        """Makes a camera from a pinhole's 3 x 3 matrix, where the centre of the first pixel is (0.5, 0.5), and a pose as in
        from_matrix(). Returns the camera, and the values for render() that give the picture this size: a picture whose
        principal point is not its centre is a part of a larger one. The point is rounded to half a pixel."""
        k = arrays.numbers(K, "K", "3 x 3 numbers")
        if k.shape != (3, 3) or not k[0, 0] > 0 or not abs(k[1, 1] - k[0, 0]) <= 1e-3 * k[0, 0] or abs(k[0, 1]) > 1e-3 * k[0, 0]:
            raise InvalidValue("has pixels that are not square, or is no matrix of a pinhole", field="K",
                               remedy="give [[f, 0, cx], [0, f, cy], [0, 0, 1]], and resize the picture if fx and fy differ")
        values = {"width": width, "height": height}
        crop = {}
        for axis, name, size in ((0, "x", width), (1, "y", height)):
            twice = round(2 * float(k[axis, 2]))  # half pixels from the first edge
            if not 0 < twice < 2 * size:
                raise InvalidValue(f"has its principal point outside the picture of {width} x {height}", field="K")
            crop[f"crop_{name}"] = max(0, size - twice)
            values["width" if name == "x" else "height"] = max(twice, 2 * size - twice)
        if any(values[name] != size for name, size in (("width", width), ("height", height))):
            values.update(crop, crop_width=width, crop_height=height)
        fov = 2 * math.atan(values["height"] / 2 / ((float(k[0, 0]) + float(k[1, 1])) / 2))
        return cls.from_matrix(world_from_camera, math.degrees(fov), convention=convention, time_s=time_s), values

    def key(self) -> messages.CameraKey:
        """Converts to a key of a job's camera."""
        return messages.CameraKey(self.time_s, self.eye, self.look_at, self.up, math.radians(self.fov_degrees))


CameraOf = Union[Camera, Object, Sequence[Camera], None]


def _look(render: messages.Render, camera: CameraOf) -> None:
    if isinstance(camera, Object):
        if camera.kind != ObjectKind.NODE:
            raise InvalidValue(f"is a {camera.kind.word}", field="camera", remedy="give the node that shows a camera")
        render.camera_path, render.camera_node = messages.CameraPath.NODE, camera.number
        return
    keys = [camera] if isinstance(camera, Camera) else list(camera) if isinstance(camera, (list, tuple)) else []
    if not keys or not all(isinstance(one, Camera) for one in keys):
        raise InvalidValue(f"{camera!r:.80} is no camera", field="camera", remedy="give a farlight.Camera(eye, look_at), several "
                           "of them, a node of the scene that shows a camera, or nothing, for all of the scene in view")
    render.keys = [one.key() for one in keys]
    if render.camera_path in ("auto", messages.CameraPath.AUTO):
        render.camera_path = messages.CameraPath.KEYS


def request(camera: CameraOf, layers: LayersOf, values: dict[str, Any]) -> messages.Render:
    """Makes the message of a job, complete except for the scene. camera: a Camera, a node of the scene with a camera, several
    cameras as keys over time, or None: the whole scene in view. `clips` may be the scene's: clips=scene.objects("clip")."""
    if isinstance(values.get("clips"), (list, tuple)):
        values = {**values, "clips": [messages.ClipUse(one.number, 0.0, 1.0) if isinstance(one, Object) and one.kind == ObjectKind.CLIP
                                      else one for one in values["clips"]]}
    render: messages.Render = make(messages.Render, values)
    if camera is not None:
        _look(render, camera)
    if layers:
        render.layers, render.format = layer_set(layers), messages.PixelFormat.RGBA32F
    fields.encode(replace(render, scene=1, channel=2))
    for name in ("encoding", "still_encoding"):
        setattr(render, name, Encoding.of(getattr(render, name)))
    decode.check_wanted(render)
    for name in ("attachments", "parts", "margin", "hidden_layers"):
        if getattr(render, name):
            raise InvalidValue("this package takes whole pictures alone", field=f"render.{name}",
                               remedy=f"leave {name} out" + "; frames() has layers" * (name == "attachments"))
    return render


def usual_clamp(samples: int) -> float:
    """The clamp of indirect light for a picture with this number of samples: the fewer, the more visible are rare bright ones."""
    return max(CLAMP * min(samples / CLAMP_SAMPLES, 1.0), CLAMP_MIN)


def one_frame(values: dict[str, Any]) -> dict[str, Any]:
    """Returns the values for a job of one picture."""
    first = values.get("first_frame", 0)
    if values.get("last_frame", first) != first:
        raise InvalidValue("render() makes one picture", field="render.last_frame", remedy="frames() makes several")
    return {**values, "last_frame": first}
