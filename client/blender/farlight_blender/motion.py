# SPDX-License-Identifier: MIT
"""Motion while the shutter is open, or from the previous frame to the next.

Blender evaluates the scene as the shutter opens, halfway and as it closes: three more evaluations a frame. The daemon plays the
differences as clips: nodes that move, meshes that deform and hairs that bend are blurred by the shutter of the job, straight from
one time to the next; halfway, a hair that turns by 60 degrees is 13 % thinner. A camera and lights stand still within a frame of
the daemon's, so the picture is the mean of `Motion steps` frames (16), each for a part of the shutter's time and with its share of
the samples; they come as floats, so each step costs the transfer of a frame. Depth is that of the middle. Zoom, focus, colours,
thickness and visibility are those of the frame's time. Sampled tracers refuse motion.

The pass Vector corresponds to a shutter that is open from the previous frame to the next: a job with the daemon's layer motion
and no picture plays its clips. It is that of a pixel's first sample, where Cycles has the mean.
"""
from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Optional

import bpy
import numpy as np
from farlight.messages import Accumulation, ChannelPath, ClipUse, Interpolation, ObjectKind, SetChannel, SetClip

if TYPE_CHECKING:
    from .mirror import Mirror

KEYS = (0.0, 0.5, 1.0)  # shares of the open time, Cycles' default
MIDDLE = 1  # the key of meshes without a clip
CLIP_S = 1.0  # length of a clip, and of the job
SAME = 1e-6  # tolerance of matrices for rounding
FIRST = {"START": 0.0, "CENTER": -0.5, "END": -1.0}  # opening of the shutter, in open times from the frame's time


@dataclass
class Moment:
    """The movable parts of the scene at one key."""
    places: dict[Hashable, Any] = field(default_factory=dict)  # matrices, by the keys of nodes
    shapes: dict[Hashable, Any] = field(default_factory=dict)  # rows of corners or of points of strands, by the keys of meshes


def position_owner(scene: bpy.types.Scene) -> Any:
    """The owner of Blender's setting for the shutter's position in the frame, which moved in 4.2."""
    owners = (scene.render, getattr(scene, "cycles", None), getattr(scene, "eevee", None))
    return next((one for one in owners if hasattr(one, "motion_blur_position")), None)


def times(scene: bpy.types.Scene) -> list[float]:
    """Times of the keys, in Blender's frames."""
    shutter, first = 2.0, -0.5  # values for the pass Vector
    if is_wanted(scene):
        shutter = scene.render.motion_blur_shutter
        first = FIRST.get(getattr(position_owner(scene), "motion_blur_position", "CENTER"), -0.5)
    return [scene.frame_current_final + shutter * (first + key) for key in KEYS]


def is_wanted(scene: bpy.types.Scene) -> bool:
    """True if the picture has motion blur."""
    return bool(scene.render.use_motion_blur and scene.render.motion_blur_shutter > 0)


def has_vectors(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> bool:
    """True if there is the pass Vector: as in Cycles, not for a blurred picture."""
    return bool(layer.use_pass_vector and not is_wanted(scene))


def may_move(thing: bpy.types.Object, scene: bpy.types.Scene) -> bool:
    """True if the object may move; Cycles has a switch for each object, which the pass Vector ignores."""
    return not is_wanted(scene) or bool(getattr(getattr(thing, "cycles", None), "use_motion_blur", True))


def may_deform(thing: bpy.types.Object, scene: bpy.types.Scene) -> bool:
    """True if the object may deform; Cycles has a switch for this, too."""
    return may_move(thing, scene) and (not is_wanted(scene) or bool(getattr(getattr(thing, "cycles", None), "use_deform_motion", True)))


def deforms(thing: bpy.types.Object, scene: bpy.types.Scene) -> bool:
    """True if the mesh may change its shape while its points stay the same."""
    return bool(thing.type == "MESH" and may_deform(thing, scene) and thing.original.is_deform_modified(scene, "RENDER"))


class Motion:
    """The motion in a picture, and the clips that play it: `things` while the shutter is open, `watchers` (the camera and the
    lights) from frame to frame of the job."""

    def __init__(self, moments: list[Moment]) -> None:
        self._moments = moments
        self._clips: dict[str, int] = {}
        self._channels: dict[str, list[tuple[Hashable, int, ChannelPath, int, Any]]] = {"things": [], "watchers": []}

    def shape(self, mesh: Hashable, rows: int, rounding: float = 0) -> tuple[Optional[Any], bool]:
        """Rows of a deforming shape, keys x rows x columns, with positions in the first three columns; and whether it deforms
        although its points stay the same. rounding: tolerance of equal positions."""
        found = [one.shapes[mesh] for one in self._moments if mesh in one.shapes]
        if len(found) < len(self._moments):
            return None, False
        if any(len(one) != rows for one in found):
            return None, True
        stacked = np.stack(found)
        return (stacked if np.abs(stacked[..., :3] - stacked[0, :, :3]).max(initial=0) > rounding else None), False

    def follow(self, key: Hashable, node: int, rigid: Optional[Callable[[Any], Any]]) -> bool:
        """Animates a node like Blender's object with this key. rigid: reduces a place, for a light or the camera, to a rigid
        one. False: the object is sheared, which is lost."""
        places = [one.places.get(key) for one in self._moments]
        if any(one is None for one in places):
            return True  # appears or disappears
        matrices = [rigid(one) if rigid else one for one in places]
        first = np.array(matrices[0])
        if all(np.allclose(np.array(one), first, rtol=SAME, atol=SAME) for one in matrices[1:]):
            return True
        parts = [one.decompose() for one in matrices]
        whose = "watchers" if rigid else "things"
        paths: list[tuple[ChannelPath, Any]] = [
            (ChannelPath.NODE_TRANSLATION, [tuple(place) for place, _, _ in parts]),
            (ChannelPath.NODE_ROTATION, [(turn.x, turn.y, turn.z, turn.w) for _, turn, _ in parts])]
        if rigid is None:
            paths.append((ChannelPath.NODE_SCALE, [tuple(scale) for _, _, scale in parts]))
        for path, values in paths:
            self._channels[whose].append((key, node, path, len(values[0]), values))
        rebuilt = np.array(parts[0][1].to_matrix()) * tuple(parts[0][2])
        return rigid is not None or bool(np.allclose(rebuilt, first[:3, :3], atol=1e-4 * np.abs(first[:3, :3]).max()))

    def bend(self, key: Hashable, node: int) -> None:
        """Animates a node's mesh, whose targets are all keys but the middle one."""
        weights = np.delete(np.eye(len(KEYS)), MIDDLE, axis=1)
        self._channels["things"].append((key, node, ChannelPath.NODE_WEIGHTS, len(KEYS) - 1, weights))

    def has_any(self) -> bool:
        """True if anything moves."""
        return any(self._channels.values())

    def has_watchers(self) -> bool:
        """True if the camera or a light moves."""
        return bool(self._channels["watchers"])

    def send(self, mirror: Mirror) -> None:
        """Sets the clips."""
        for whose, channels in self._channels.items():
            if not channels:
                continue
            clip = self._clips[whose] = mirror.number(ObjectKind.CLIP, whose)
            numbers = np.concatenate([np.array(KEYS) * CLIP_S, *(np.ravel(values) for *_, values in channels)]).astype("<f4")
            mirror.scene.set(SetClip(clip=clip, arrays=[mirror.scene.blob(numbers.tobytes())], name=whose))
            first = len(KEYS)
            for key, node, path, width, _ in channels:
                mirror.scene.set(SetChannel(
                    channel=mirror.number(ObjectKind.CHANNEL, (whose, key, path)), clip=clip, path=path, object=node,
                    interpolation=Interpolation.LINEAR, width=width, key_count=len(KEYS), first_time=0, first_value=first))
                first += width * len(KEYS)

    def job(self, frames: int) -> dict[str, Any]:
        """Fields of a job whose frames are equal parts of the shutter's time. Watchers are placed at the middle of each."""
        starts = {"things": 0.0, "watchers": -0.5 * CLIP_S / frames}
        clips = [ClipUse(clip, starts[whose], 1.0, 0) for whose, clip in self._clips.items()]
        return {"clips": clips, "frames_per_second": frames / CLIP_S, "shutter": 1.0, "last_frame": frames - 1, "accumulate": Accumulation.OFF}

    def vector_job(self) -> dict[str, Any]:
        """Fields of a job of the layer motion, whose single frame is the middle key, with the others as its neighbours."""
        clips = [ClipUse(clip, -0.5 * CLIP_S, 1.0, 0) for clip in self._clips.values()]
        return {"clips": clips, "frames_per_second": 2 / CLIP_S, "layers": ("motion", "depth"), "samples": 1}
