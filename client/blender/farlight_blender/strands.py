# SPDX-License-Identifier: MIT
"""Objects with places and radii but no faces: hairs of particle systems, curves and points.

Hairs and curves become tubes of triangles with six sides (a hair of 8 steps has 96), points exact spheres. The selection of hairs
and their thickness are as in Cycles.
"""
from __future__ import annotations

import itertools
import math
from collections.abc import Hashable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Optional

import bpy
import numpy as np
from farlight.scene import Object
from farlight.messages import ObjectKind

from .materials import Material, Reader
from .meshes import DIFFER, Names, read, with_moves, with_targets
from .motion import Motion

if TYPE_CHECKING:
    from .mirror import Mirror

# Number of a tube's sides: fur differs from Cycles' round hairs by 1.4 % of its light on average; with 4 by 2.4 %, with 3 by
# 3.3 %
SIDES = 6
# Tubes are on average as wide as round ones: the mean width of a convex outline is a pi-th of its length.
WIDER = math.pi / (SIDES * math.sin(math.pi / SIDES))
SMOOTH = 12  # curves with fewer points are subdivided up to this number: Cycles draws them as splines
CURVE_RADIUS = 0.005  # metres, for curves without radii; Cycles' default
TINY = 1e-12
ROUNDING = 1e-5  # metres: Blender reports places of hairs in the world, whose rounding varies as their object moves


@dataclass
class Strands:
    """Points by strand, in the space of their object."""
    points: Any  # n x 3
    radii: Any  # n
    strand: Any  # n, the number of each point's strand, ascending
    texcoords: Optional[Any] = None  # for each strand, v from below
    bent: Optional[Any] = None  # keys of the shutter x n x 3: the points of strands that bend


# ---- particle systems

def hairs_key(thing: bpy.types.Object, system: bpy.types.ParticleSystem) -> Hashable:
    """The key of the mesh of a particle system's hairs."""
    return "hairs", thing.name_full, system.name


def hairy(thing: bpy.types.Object, is_final: bool) -> Iterator[bpy.types.Modifier]:
    """The particle systems of an evaluated object whose hairs are visible."""
    for modifier in thing.modifiers:
        if modifier.type == "PARTICLE_SYSTEM" and (modifier.show_render if is_final else modifier.show_viewport):
            settings = modifier.particle_system.settings
            if settings.type == "HAIR" and settings.render_type == "PATH":
                yield modifier


def _numbers(system: bpy.types.ParticleSystem, is_final: bool) -> range:
    """Numbers of the visible hairs. Children come after their parents, which they hide."""
    settings, parents, children = system.settings, len(system.particles), len(system.child_particles)
    if not is_final:
        children = children * settings.display_percentage // 100
    has_children = settings.child_type != "NONE" and children > 0
    return range(parents if has_children else 0, parents + (children if settings.child_type != "NONE" else 0))


def _thickness(settings: bpy.types.ParticleSettings, share: Any, is_last: Any) -> Any:
    """Radii of points, by their share of the way from the root to the tip."""
    left, shape = 1 - share, settings.shape
    if shape != 0:
        left = left ** (1 + shape if shape < 0 else 1 / max(1 - shape, 1e-3))
    radii = 0.5 * settings.radius_scale * (settings.tip_radius + left * (settings.root_radius - settings.tip_radius))
    return np.where(is_last & settings.use_close_tip, 0, radii)


def _steps(settings: bpy.types.ParticleSettings, is_final: bool) -> int:
    """Number of points of each hair."""
    steps: int = (1 << (settings.render_step if is_final else settings.display_step)) + 1
    if settings.kink == "SPIRAL":
        steps += settings.kink_extra_steps
    return steps


def places(thing: bpy.types.Object, system: bpy.types.ParticleSystem, is_final: bool) -> Any:
    """The points of all hairs of a system, the same number for each, in the space of the object."""
    numbers, steps = _numbers(system, is_final) if len(system.particles) else range(0), _steps(system.settings, is_final)
    if not numbers:
        return np.empty((0, 3), np.float32)
    place = system.co_hair
    found = itertools.chain.from_iterable(place(thing, particle_no=number, step=step) for number in numbers for step in range(steps))
    world = np.fromiter(found, np.float64, 3 * len(numbers) * steps).reshape(-1, 3)
    is_there = world.any(axis=1)  # 0, 0, 0 behind the root: the hair has fewer steps
    is_there[::steps] = True
    world = world[np.maximum.accumulate(np.where(is_there, np.arange(len(world)), 0))]
    back = np.linalg.pinv(np.array(thing.matrix_world, np.float64))
    return (world @ back[:3, :3].T + back[:3, 3]).astype(np.float32)


def of_particles(thing: bpy.types.Object, modifier: bpy.types.Modifier, is_final: bool, points: Any,
                 bent: Optional[Any]) -> Optional[Strands]:
    """The hairs of a system, from the points of places(); None: it has none. bent: the points at the keys of the shutter."""
    if not len(points):
        return None
    system = modifier.particle_system
    settings, numbers, steps = system.settings, _numbers(system, is_final), _steps(system.settings, is_final)
    strand = np.repeat(np.arange(len(numbers)), steps)
    every = points[None] if bent is None else bent
    lengths = np.pad(np.linalg.norm(np.diff(every, axis=1), axis=2).max(axis=0), (1, 0))
    lengths[::steps] = 0
    keep = lengths > 0  # drops repeated places, equal at all keys
    keep[::steps] = True
    along = lengths.reshape(-1, steps).cumsum(axis=1)
    share = (along / np.maximum(along[:, -1:], TINY)).ravel()[keep]
    points, strand = points[keep], strand[keep]
    radii = _thickness(settings, share, np.r_[strand[1:] != strand[:-1], True])
    layers = thing.data.uv_layers
    at = next((one for one, layer in enumerate(layers) if layer.active_render), None)
    texcoords = None
    if at is not None:
        last = len(system.particles) - 1
        texcoords = np.array([system.uv_on_emitter(modifier, particle=system.particles[min(number, last)], particle_no=number,
                                                   uv_no=at)[:] for number in numbers], np.float32)
    return Strands(points, radii, strand, texcoords, None if bent is None else bent[:, keep])


# ---- curves

def _smooth(strands: Strands) -> Strands:
    """Inserts a point between each two (N. Dyn, D. Levin, J. Gregory: A 4-point interpolatory subdivision scheme, 1987)."""
    strand = strands.strand
    start = np.flatnonzero(strand[1:] == strand[:-1])
    before, after = np.maximum(start - 1, 0), np.minimum(start + 2, len(strand) - 1)
    before = np.where(strand[before] == strand[start], before, start)
    after = np.where(strand[after] == strand[start], after, start + 1)
    values = np.column_stack((strands.points, strands.radii))
    between = (9 * (values[start] + values[start + 1]) - values[before] - values[after]) / 16
    mixed = np.insert(values, start + 1, between, axis=0)
    return Strands(mixed[:, :3], np.maximum(mixed[:, 3], 0), np.insert(strand, start + 1, strand[start]))


def of_curves(data: bpy.types.Curves) -> Optional[Strands]:
    """The strands of an object of the type curves (hair); None: there are none."""
    counts = read(data.curves, "points_length", 1, np.int32)
    if not counts.any():
        return None
    points = read(data.points, "position", 3)
    radii = read(data.points, "radius", 1) if "radius" in data.attributes else np.full(len(points), CURVE_RADIUS, np.float32)
    made = Strands(points, np.maximum(radii, 0), np.repeat(np.arange(len(counts)), counts))
    while len(made.points) < SMOOTH * len(counts) and (counts > 1).any():
        made = _smooth(made)
    return made


# ---- tubes

def _normalised(vectors: Any, otherwise: Any) -> Any:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(lengths > TINY, vectors / np.maximum(lengths, TINY), otherwise)


def _across(directions: Any) -> Any:
    """For each direction a perpendicular one."""
    return _normalised(np.cross(directions, np.eye(3)[np.abs(directions).argmin(axis=1)]), (1.0, 0.0, 0.0))


def _frames(points: Any, strand: Any, like: Optional[Any] = None) -> tuple[Any, Any]:
    """Two directions across each point's strand, with minimal rotation along it. like: the first of each before it bent."""
    first = np.flatnonzero(np.r_[True, strand[1:] != strand[:-1]])
    counts = np.diff(np.r_[first, len(strand)])
    low, high = np.maximum(np.arange(len(strand)) - 1, np.repeat(first, counts)), np.arange(1, len(strand) + 1)
    high = np.minimum(high, np.repeat(first + counts - 1, counts))
    along = _normalised(points[high] - points[low], (0.0, 0.0, 1.0))
    if like is not None:
        across = _normalised(like - along * (like * along).sum(axis=1, keepdims=True), _across(along))
        return across, np.cross(along, across)
    across = _across(along)
    for step in range(1, counts.max()):
        at = first[counts > step] + step
        carried = across[at - 1] - along[at] * (across[at - 1] * along[at]).sum(axis=1, keepdims=True)
        across[at] = _normalised(carried, across[at])
    return across, np.cross(along, across)


def tubes(strands: Strands) -> Optional[dict[str, Any]]:
    """Arguments of Scene.add_mesh(); None: no strand has a length and a thickness."""
    strand = strands.strand
    start = np.flatnonzero((strand[1:] == strand[:-1]) & ((strands.radii[1:] > 0) | (strands.radii[:-1] > 0)))
    if not len(start):
        return None
    across, corners = None, []
    for points in (strands.points[None] if strands.bent is None else strands.bent).astype(np.float64):
        made, beside = _frames(points, strand, across)
        across = made if across is None else across
        angles = np.arange(SIDES) * (2 * math.pi / SIDES)
        normals = np.cos(angles)[:, None] * made[:, None] + np.sin(angles)[:, None] * beside[:, None]
        corners.append(np.concatenate((points[:, None] + WIDER * strands.radii[:, None, None] * normals, normals), axis=2).reshape(-1, 6))
    side = np.arange(SIDES)
    here, there = start[:, None] * SIDES + side, start[:, None] * SIDES + (side + 1) % SIDES
    wide = [np.broadcast_to(strands.radii[one, None] > 0, here.shape) for one in (start, start + 1)]  # else a tip: one triangle
    triangles = np.concatenate((np.stack((here, there, there + SIDES), axis=-1)[wide[0]],
                                np.stack((here, there + SIDES, here + SIDES), axis=-1)[wide[1]]))
    arrays = {**with_moves(np.stack(corners)), "triangles": triangles}
    if strands.texcoords is not None:
        # Rows of textures are counted from the top, Blender's v from below.
        arrays["texcoords"] = np.repeat(strands.texcoords[strand] * (1, -1) + (0, 1), SIDES, axis=0)
    return arrays


# ---- points

def rows(data: Any) -> Any:
    """Movable data of curves or a point cloud: the place of each point, and for curves its strand's number."""
    if isinstance(data, bpy.types.PointCloud):
        return read(data.points, "co", 3)
    made = of_curves(data)
    return np.column_stack((made.points, made.strand)) if made else np.empty((0, 4))


def of_points(data: bpy.types.PointCloud) -> Optional[tuple[Any, Any]]:
    """Centres and radii; None: there are no visible points."""
    if "radius" not in data.attributes:
        return None
    centres, radii = read(data.points, "co", 3), read(data.points, "radius", 1)
    return (centres[radii > 0], radii[radii > 0]) if (radii > 0).any() else None


# ---- an update

class Shared:
    """Strands read once in an update, for all their users."""

    def __init__(self, mirror: Mirror, reader: Reader, moves: Optional[Motion], is_final: bool) -> None:
        self._mirror, self._reader, self._motion, self._is_final = mirror, reader, moves, is_final
        self._names = Names()
        self._made: dict[Hashable, tuple[Optional[Object], bool]] = {}

    def _material(self, thing: bpy.types.Object, slot: int) -> Material:
        slots = thing.material_slots
        made = self._reader.material(slots[min(max(slot, 0), len(slots) - 1)].material if len(slots) else None)
        if made.colour_attribute is not None:
            self._mirror.note(f"{thing.name}: its strands have no colour attributes and are drawn as if these were white")
        return made

    def _bent(self, thing: bpy.types.Object, key: Hashable, count: int) -> Optional[Any]:
        """Rows at the keys of the shutter; None: they do not move."""
        bent, has_changed = self._motion.shape(key, count, ROUNDING) if self._motion else (None, False)
        if has_changed or bent is not None and (bent[..., 3:] != bent[0, :, 3:]).any():
            self._mirror.note(f"{thing.name}: {DIFFER}")
            return None
        return bent

    def _tubes(self, thing: bpy.types.Object, number: int, made: Optional[Strands], slot: int) -> tuple[Optional[Object], bool]:
        arrays = tubes(made) if made else None
        if arrays is None:
            return None, False
        look = self._material(thing, slot)
        if look.is_nothing:
            return None, False
        more = with_targets(self._mirror.scene, arrays)
        material = Object(ObjectKind.MATERIAL, look.number)
        return self._mirror.scene.add_mesh(arrays.pop("positions"), mesh=number, name=thing.name[:100], material=material, place=False, **arrays,
                                           **more), bool(more)

    def _fur(self, thing: bpy.types.Object, modifier: bpy.types.Modifier, key: Hashable) -> tuple[Optional[Object], bool]:
        number = self._mirror.number(ObjectKind.MESH, key)
        points = self._mirror.steady(number, "hairs", places(thing, modifier.particle_system, self._is_final))
        bent = self._bent(thing, key, len(points))
        if bent is not None:
            bent = self._mirror.steady(number, "bent", bent)
        made = of_particles(thing, modifier, self._is_final, points, bent)
        return self._tubes(thing, number, made, modifier.particle_system.settings.material - 1)

    def hairs(self, thing: bpy.types.Object) -> list[tuple[str, Optional[Object], bool]]:
        """Names and meshes of an evaluated object's hairs by particle system, and whether they bend while the shutter is open."""
        found = []
        for modifier in hairy(thing, self._is_final):
            name = modifier.particle_system.name
            key = hairs_key(thing, modifier.particle_system)
            if key not in self._made:
                self._made[key] = self._fur(thing, modifier, key)
            found.append((name, *self._made[key]))
        return found

    def own(self, thing: bpy.types.Object) -> tuple[Optional[Object], bool]:
        """The tubes or spheres of an object of the type curves or point cloud, and whether they bend; None: there are none."""
        name, is_new = self._names.of(thing)
        key = (thing.type, *name)
        if is_new:
            self._made[key] = (self._points(thing, key), False) if thing.type == "POINTCLOUD" else self._curves(thing, key)
        return self._made[key]

    def _curves(self, thing: bpy.types.Object, key: Hashable) -> tuple[Optional[Object], bool]:
        made = of_curves(thing.data)
        bent = self._bent(thing, key, len(made.points)) if made else None
        if made and bent is not None:
            made.bent = bent[..., :3]
        return self._tubes(thing, self._mirror.number(ObjectKind.MESH, key), made, 0)

    def _points(self, thing: bpy.types.Object, key: Hashable) -> Optional[Object]:
        found = of_points(thing.data)
        if found is None:
            return None
        if self._bent(thing, key, len(thing.data.points)) is not None:
            self._mirror.note(f"{thing.name}: its points move in it while the shutter is open, and are drawn where they are at the frame's time")
        material = Object(ObjectKind.MATERIAL, self._material(thing, 0).number)
        return self._mirror.scene.add_spheres(*found, material=material, place=False, name=thing.name[:100],
                                              spheres=self._mirror.number(ObjectKind.SPHERES, key))
