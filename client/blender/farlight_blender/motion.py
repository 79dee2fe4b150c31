# SPDX-License-Identifier: MIT
"""What moves while the shutter is open, or from the frame before to the one behind.

Blender evaluates the scene as the shutter opens, halfway and as it closes. The daemon plays the differences as clips: nodes that
move and meshes that deform are blurred by the shutter of the job. A camera and lights stand still in a frame of the daemon's, so
that a job is several frames, each of a part of the shutter's time, of which the picture is the mean.

The pass Vector is like a shutter that is open from the frame before to the one behind: its clips are played by a job that has the
daemon's layer motion and no picture."""
from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Optional

import bpy
import numpy as np
from farlight.messages import Accumulation, ChannelPath, ClipUse, Interpolation, ObjectKind, SetChannel, SetClip

if TYPE_CHECKING:
    from .mirror import Mirror

KEYS = (0.0, 0.5, 1.0)  # of the open time: those of Cycles' default
MIDDLE = 1  # the key that meshes have without a clip
CLIP_S = 1.0  # length of a clip, that of the job
SAME = 1e-6  # numbers of a place that differ by less are rounding
FIRST = {"START": 0.0, "CENTER": -0.5, "END": -1.0}  # when the shutter opens, in open times from the frame's time on


@dataclass
class Moment:
    """What of the scene may move, as it is at one key."""
    places: dict[Hashable, Any] = field(default_factory=dict)  # matrices, by the keys of nodes
    shapes: dict[Hashable, Any] = field(default_factory=dict)  # rows of corners or of points of strands, by the keys of meshes


def position_owner(scene: bpy.types.Scene) -> Any:
    """Which of Blender's settings says where in the frame the shutter is open: it moved in 4.2."""
    owners = (scene.render, getattr(scene, "cycles", None), getattr(scene, "eevee", None))
    return next((one for one in owners if hasattr(one, "motion_blur_position")), None)


def times(scene: bpy.types.Scene) -> list[float]:
    """Of the keys, in Blender's frames."""
    shutter, first = 2.0, -0.5  # of the pass Vector
    if is_wanted(scene):
        shutter = scene.render.motion_blur_shutter
        first = FIRST.get(getattr(position_owner(scene), "motion_blur_position", "CENTER"), -0.5)
    return [scene.frame_current_final + shutter * (first + key) for key in KEYS]


def is_wanted(scene: bpy.types.Scene) -> bool:
    """Whether a picture is to be blurred."""
    return bool(scene.render.use_motion_blur and scene.render.motion_blur_shutter > 0)


def has_vectors(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> bool:
    """Whether there is the pass Vector: as in Cycles, not of a blurred picture."""
    return bool(layer.use_pass_vector and not is_wanted(scene))


def may_move(thing: bpy.types.Object, scene: bpy.types.Scene) -> bool:
    """Cycles has a switch for each object, which the pass Vector does not heed."""
    return not is_wanted(scene) or bool(getattr(getattr(thing, "cycles", None), "use_motion_blur", True))


def may_deform(thing: bpy.types.Object, scene: bpy.types.Scene) -> bool:
    """Cycles has a switch for this, too."""
    return may_move(thing, scene) and (not is_wanted(scene) or bool(getattr(getattr(thing, "cycles", None), "use_deform_motion", True)))


def deforms(thing: bpy.types.Object, scene: bpy.types.Scene) -> bool:
    """Whether its mesh may change its shape while its points stay the same."""
    return bool(thing.type == "MESH" and may_deform(thing, scene) and thing.original.is_deform_modified(scene, "RENDER"))


class Motion:
    """The motion in one picture, and the clips that play it: `things` while the shutter is open, `watchers` (the camera and the
    lights) from frame to frame of the job."""

    def __init__(self, moments: list[Moment]) -> None:
        self._moments = moments
        self._clips: dict[str, int] = {}
        self._channels: dict[str, list[tuple[Hashable, int, ChannelPath, int, Any]]] = {"things": [], "watchers": []}

    def shape(self, mesh: Hashable, rows: int, rounding: float = 0) -> tuple[Optional[Any], bool]:
        """Keys x rows x columns of what deforms, positions in the first three; and whether it would if its points stayed the same.
        rounding: by how much positions differ that are the same."""
        found = [one.shapes[mesh] for one in self._moments if mesh in one.shapes]
        if len(found) < len(self._moments):
            return None, False
        if any(len(one) != rows for one in found):
            return None, True
        stacked = np.stack(found)
        return (stacked if np.abs(stacked[..., :3] - stacked[0, :, :3]).max(initial=0) > rounding else None), False

    def follow(self, key: Hashable, node: int, rigid: Optional[Callable[[Any], Any]]) -> bool:
        """Lets a node move as Blender's object of that key. rigid: what is left of a place of a light or the camera. False: the
        object is sheared, which is lost."""
        places = [one.places.get(key) for one in self._moments]
        if any(one is None for one in places):
            return True  # it comes or goes
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
        """Lets a node's mesh, whose targets are all keys but the middle one, deform."""
        weights = np.delete(np.eye(len(KEYS)), MIDDLE, axis=1)
        self._channels["things"].append((key, node, ChannelPath.NODE_WEIGHTS, len(KEYS) - 1, weights))

    def has_any(self) -> bool:
        """Whether anything moves."""
        return any(self._channels.values())

    def has_watchers(self) -> bool:
        """Whether the camera or a light moves."""
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
        """Fields of a job whose frames are that many equal parts of the shutter's time. Watchers are where they are halfway
        through each."""
        starts = {"things": 0.0, "watchers": -0.5 * CLIP_S / frames}
        clips = [ClipUse(clip, starts[whose], 1.0, 0) for whose, clip in self._clips.items()]
        return {"clips": clips, "frames_per_second": frames / CLIP_S, "shutter": 1.0, "last_frame": frames - 1, "accumulate": Accumulation.OFF}

    def vector_job(self) -> dict[str, Any]:
        """Fields of a job of the layer motion, whose one frame is the middle key: its neighbours are the others."""
        clips = [ClipUse(clip, -0.5 * CLIP_S, 1.0, 0) for clip in self._clips.values()]
        return {"clips": clips, "frames_per_second": 2 / CLIP_S, "layers": ("motion", "depth"), "samples": 1}
