# SPDX-License-Identifier: MIT
"""Blender's lights in the protocol's units."""
from __future__ import annotations

import math
from collections.abc import Hashable
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from farlight.messages import LightKind, ObjectKind, SetLight

if TYPE_CHECKING:
    from .mirror import Mirror

# A point of P watts shines alike in all directions, a spot as if it did: P / 4 pi W/sr.
INTENSITY_OF_POWER = 1 / (4 * math.pi)
# A sphere of the radius r has the same intensity as a point, spread over the disc pi r^2 that it is seen as.
RADIANCE_OF_INTENSITY = 1 / math.pi
# Cycles takes P of an area A as the radiance P / (4 A), where a Lambertian panel of P watts has P / (pi A).
RADIANCE_OF_AREA_POWER = 1 / 4


# Over a span of cosines of 1 Blender's edge, a smooth step, lets 1/2 through and glTF's, a square, 1/3: with 3/4 of the span,
# and the rest full, it is as much.
SPAN_OF_BLEND = 3 / 4


def _spot(source: bpy.types.Light) -> dict[str, Any]:
    """Blender's spot is full where the cosine is `blend` of the way from the edge to the axis."""
    edge = math.cos(source.spot_size / 2)
    outer = min(source.spot_size / 2, 1.5707)
    inner = min(math.acos(min(1.0, edge + (1 - edge) * source.spot_blend * SPAN_OF_BLEND)), outer)
    return {"inner_cone": inner, "outer_cone": outer}


def _values(mirror: Mirror, source: bpy.types.Light, scale: Any) -> tuple[LightKind, float, dict[str, Any]]:
    """Kind, factor of the colour, and other fields."""
    if source.type == "SUN":
        return LightKind.DIRECTIONAL, source.energy, {}
    if source.type == "AREA":
        width = source.size * abs(scale[0])
        height = (source.size_y if source.shape in {"RECTANGLE", "ELLIPSE"} else source.size) * abs(scale[1])
        if source.shape in {"DISK", "ELLIPSE"}:  # a rectangle of the same area
            width, height = width * math.sqrt(math.pi) / 2, height * math.sqrt(math.pi) / 2
            mirror.note(f"{source.name}: a round panel shines as a rectangle of the same area")
        area = max(width * height, 1e-12)
        return LightKind.RECTANGLE, source.energy * RADIANCE_OF_AREA_POWER / area, {"size": (width, height)}
    intensity = source.energy * INTENSITY_OF_POWER
    if source.type == "SPOT":
        return LightKind.SPOT, intensity, _spot(source)
    radius = source.shadow_soft_size
    if radius > 1e-6:
        return LightKind.SPHERE, intensity * RADIANCE_OF_INTENSITY / radius ** 2, {"size": (radius, 0)}
    return LightKind.POINT, intensity, {}


def update(mirror: Mirror, key: Hashable, thing: bpy.types.Object, matrix: Any) -> None:
    """Sets a light and its node."""
    source = thing.data
    kind, factor, values = _values(mirror, source, matrix.to_scale())
    place, turn, _ = matrix.decompose()
    rigid = np.eye(4)
    rigid[:3, :3], rigid[:3, 3] = np.array(turn.to_matrix()), place
    number = mirror.number(ObjectKind.LIGHT, key)
    light = mirror.scene.set(SetLight(light=number, kind=kind, colour=[one * factor for one in source.color],
                                      name=thing.name[:100], **values))
    assert light is not None
    mirror.place(key, light, rigid, thing.name)
