# SPDX-License-Identifier: MIT
"""Blender's lights in the protocol's units."""
from __future__ import annotations

import functools
import math
from collections.abc import Hashable
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from farlight.messages import Layer, LightKind, ObjectKind, SetLight
from mathutils import Vector

if TYPE_CHECKING:
    from .mirror import Mirror

# A point of P watts has P / 4 pi W/sr in all directions; a spot has the same within its cone.
INTENSITY_OF_POWER = 1 / (4 * math.pi)
# A sphere of radius r has the same intensity as a point, spread over its visible disc pi r^2.
RADIANCE_OF_INTENSITY = 1 / math.pi
# Cycles gives P watts on an area A the radiance P / (4 A), where a Lambertian panel of P watts has P / (pi A).
RADIANCE_OF_AREA_POWER = 1 / 4


# A sun's disc becomes a sphere at this multiple of the scene's radius: at the scene's edge its light is off by a quarter of a
# degree.
SUN_REACH = 256
SUN_MIN = 1e-4  # radians; a smaller sun is a point of the sky
SUN_MAX = 1.5  # limit of half the angle, which keeps the scene outside of the sphere
# Cones whose sum approximates Blender's: where each starts and is full, from the edge (0) to the axis (1) by cosines: first +
# blend x second.
CONES = (((0, 0), (0, 0.5)), ((0, 0), (0, 0.85)), ((0, 0), (0.5, 0.5)), ((0.3, 0), (1, 0)))
HAS_COSINE = bpy.app.version < (4, 0)  # spots of Cycles were weaker by the cosine from their axis before 4.0
SPOT_MAX = 1.57  # radians from the axis, the protocol's limit for spots
GROUPS_MAX = Layer.LIGHT_GROUP7 - Layer.LIGHT_REST

Part = tuple[LightKind, float, dict[str, Any]]  # kind, factor of the colour, other fields


def _weights(columns: Any, wanted: Any) -> Any:
    """Finds non-negative weights of columns whose sum is nearest to the wanted one, by trying all sets of columns."""
    best, error = np.zeros(columns.shape[1]), math.inf
    for chosen in range(1, 1 << columns.shape[1]):
        used = [one for one in range(columns.shape[1]) if chosen >> one & 1]
        weights = np.linalg.lstsq(columns[:, used], wanted, rcond=None)[0]
        apart = np.square(columns[:, used] @ weights - wanted).sum()
        if weights.min() >= 0 and apart < error:
            best, error = np.zeros(columns.shape[1]), apart
            best[used] = weights
    return best


@functools.lru_cache(64)
def _cones(half_angle: float, blend: float) -> list[tuple[float, float, float]]:
    """Weight, inner and outer angle of cones of glTF, whose edges are squares, that approximate Blender's cone, whose edge is a
    smooth step: within 1 % on average at a blend of 0.15, 3 % at 1."""
    edge = math.cos(half_angle)
    share = (np.arange(256) + 0.5) / 256
    step = np.clip(share / max(blend, 1e-3), 0, 1)
    wanted = step ** 2 * (3 - 2 * step) * (edge + (1 - edge) * share if HAS_COSINE else 1)
    ends = [(a + blend * b, max(c + blend * d, a + blend * b + 1e-3)) for (a, b), (c, d) in CONES]
    weights = _weights(np.stack([np.clip((share - first) / (full - first), 0, 1) ** 2 for first, full in ends], axis=1), wanted)

    def angle(at: float) -> float:
        return min(math.acos(min(edge + (1 - edge) * at, 1.0)), SPOT_MAX)
    return [(weight, angle(full), angle(first)) for weight, (first, full) in zip(weights, ends) if weight > 1e-3]


def _area(mirror: Mirror, source: bpy.types.Light, scale: Any) -> Part:
    width = source.size * abs(scale[0])
    height = (source.size_y if source.shape in {"RECTANGLE", "ELLIPSE"} else source.size) * abs(scale[1])
    if source.shape in {"DISK", "ELLIPSE"}:  # a rectangle of the same area
        width, height = width * math.sqrt(math.pi) / 2, height * math.sqrt(math.pi) / 2
        mirror.note(f"{source.name}: a round panel shines as a rectangle of the same area")
    if getattr(source, "spread", math.pi) < math.pi - 1e-3:
        mirror.note(f"{source.name}: a panel shines to all sides, whatever its spread")
    area = max(width * height, 1e-12)
    return LightKind.RECTANGLE, source.energy * RADIANCE_OF_AREA_POWER / area, {"size": (width, height)}


def _parts(mirror: Mirror, source: bpy.types.Light, scale: Any, reach: float) -> list[Part]:
    """The lights of the protocol that together form this one."""
    if source.type == "SUN":
        if reach <= 0:
            return [(LightKind.DIRECTIONAL, source.energy, {})]
        half = min(source.angle / 2, SUN_MAX)
        # 1 - cos(half), without cancellation. Cycles takes the strength of a sun as its radiance times its solid angle.
        solid_angle = 2 * math.pi * 2 * math.sin(half / 2) ** 2
        return [(LightKind.SPHERE, source.energy / solid_angle, {"size": (reach * math.sin(half), 0)})]
    if source.type == "AREA":
        return [_area(mirror, source, scale)]
    intensity, radius = source.energy * INTENSITY_OF_POWER, source.shadow_soft_size
    if source.type == "SPOT":
        if radius > 1e-6:
            mirror.note(f"{source.name}: a spot shines from a point: its shadows are sharp")
        return [(LightKind.SPOT, intensity * weight, {"inner_cone": inner, "outer_cone": outer})
                for weight, inner, outer in _cones(min(source.spot_size / 2, SPOT_MAX), source.spot_blend)]
    if radius > 1e-6:
        return [(LightKind.SPHERE, intensity * RADIANCE_OF_INTENSITY / radius ** 2, {"size": (radius, 0)})]
    return [(LightKind.POINT, intensity, {})]


def groups(mirror: Mirror, layer: bpy.types.ViewLayer) -> dict[str, int]:
    """Light groups of a view layer, by name."""
    names = [one.name for one in layer.lightgroups]
    for name in names[GROUPS_MAX:]:
        mirror.note(f"the light group {name} is one too many: there may be {GROUPS_MAX}")
    return {name: number for number, name in enumerate(names[:GROUPS_MAX], 1)}


def update(mirror: Mirror, key: Hashable, thing: bpy.types.Object, matrix: Any, radius: float) -> None:
    """Sets a light and its node. radius: the scene's, from its origin."""
    source = thing.data
    is_disc = source.type == "SUN" and source.angle >= SUN_MIN
    reach = SUN_REACH * radius if is_disc else 0.0

    def rigid(matrix: Any) -> Any:
        place, turn, _ = matrix.decompose()
        made = turn.to_matrix().to_4x4()
        made.translation = turn @ Vector((0, 0, reach)) if is_disc else place
        return made
    lights = []
    for place, (kind, factor, values) in enumerate(_parts(mirror, source, matrix.to_scale(), reach)):
        number = mirror.number(ObjectKind.LIGHT, (key, place))
        made = mirror.scene.set(SetLight(light=number, kind=kind, colour=[one * factor for one in source.color],
                                         name=thing.name[:100], **values))
        assert made is not None
        lights.append(made)
    node = mirror.place(key, lights[0], matrix, thing, rigid)
    for place, one in enumerate(lights[1:]):
        mirror.scene.add_node(one, parent=node, node=mirror.number(ObjectKind.NODE, (key, "with", place)), name=thing.name[:100])
