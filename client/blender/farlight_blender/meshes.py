# SPDX-License-Identifier: MIT
"""Evaluated meshes as arrays: triangles, split normals, coordinates of the active UV map, colours that materials use."""
from __future__ import annotations

import functools
from collections.abc import Callable, Hashable
from typing import TYPE_CHECKING, Any, Optional

import bpy
import numpy as np
from farlight.arrays import colours as pack_colours
from farlight.scene import Object, Scene
from farlight.messages import BlobRef, ObjectKind

from .bake import Surface
from .materials import Material, Reader
from .motion import MIDDLE, Motion

if TYPE_CHECKING:
    from .mirror import Mirror

DIFFER = "its points differ in number from time to time: its motion leaves out how it deforms"
Steady = Callable[[str, Any], Any]  # Mirror.steady() for one mesh


def read(items: Any, field: str, width: int, kind: Any = np.float32) -> Any:
    """Reads a field of all items: n numbers, or n x width."""
    values = np.empty(len(items) * width, kind)
    items.foreach_get(field, values)
    return values.reshape(-1, width) if width > 1 else values


def _normals(mesh: bpy.types.Mesh) -> Any:
    if hasattr(mesh, "corner_normals"):  # Blender 4.1 and later
        return read(mesh.corner_normals, "vector", 3)
    mesh.calc_normals_split()
    return read(mesh.loops, "normal", 3)


def _colours(mesh: bpy.types.Mesh, name: str) -> Any:
    """Linear colours of 0 .. 1, four numbers for each corner; None: there is no such attribute."""
    attribute = mesh.color_attributes.get(name) or mesh.color_attributes.active_color
    if attribute is None:
        return None
    values = read(attribute.data, "color", 4)
    if attribute.domain == "POINT":
        values = values[read(mesh.loops, "vertex_index", 1, np.int32)]
    return np.clip(values, 0, 1)


def shape(mesh: bpy.types.Mesh) -> Any:
    """Positions and normals, corners x 6."""
    return np.column_stack((read(mesh.vertices, "co", 3)[read(mesh.loops, "vertex_index", 1, np.int32)], _normals(mesh)))


def _corners(mesh: bpy.types.Mesh, uses: list[Material], steady: Steady) -> dict[str, Any]:
    """Arguments of Scene.add_mesh() for each corner."""
    corners = shape(mesh)
    arrays = {"positions": corners[:, :3], "normals": steady("normals", corners[:, 3:])}
    layer = next((one for one in mesh.uv_layers if one.active_render), None)
    if layer is not None:
        # Rows of textures are counted from the top, Blender's v from below.
        arrays["texcoords"] = read(layer.data, "uv", 2) * (1, -1) + (0, 1)
        if any(use.has_normal_map for use in uses):
            mesh.calc_tangents(uvmap=layer.name)
            tangents = np.column_stack((read(mesh.loops, "tangent", 3), read(mesh.loops, "bitangent_sign", 1)))
            arrays["tangents"] = steady("tangents", tangents)
    name = next((use.colour_attribute for use in uses if use.colour_attribute is not None), None)
    if name is not None:
        arrays["colours"] = _colours(mesh, name)
    return arrays


def _arrays(mesh: bpy.types.Mesh, uses: list[Material], steady: Steady, bent: Optional[Any]) -> Optional[dict[str, Any]]:
    """Arguments of Scene.add_mesh(), and "moves". bent: keys of the shutter x corners x 6, positions and normals."""
    mesh.calc_loop_triangles()
    triangles = read(mesh.loop_triangles, "loops", 3, np.int32)
    slots = np.clip(read(mesh.loop_triangles, "material_index", 1, np.int32), 0, len(uses) - 1)
    is_drawn = ~np.array([use.is_nothing for use in uses])[slots]
    triangles, slots = triangles[is_drawn], slots[is_drawn]
    if not len(triangles):
        return None
    order = np.argsort(slots, kind="stable")  # sorting gives few runs of materials
    numbers = np.array([use.number for use in uses], np.uint32)
    corners = _corners(mesh, uses, steady)
    if bent is not None:
        bent[..., 3:] = steady("bent", bent[..., 3:])
        corners.update(with_moves(bent))
    # Corners that are equal in everything become one vertex.
    rows = np.column_stack([np.ascontiguousarray(one, np.float32).view(np.uint8)
                            for one in corners.values() if one is not None])
    _, first, vertex = np.unique(rows.view(f"V{rows.shape[1]}").ravel(), return_index=True, return_inverse=True)
    return {**{name: None if one is None else one[first] for name, one in corners.items()},
            "triangles": vertex[triangles[order]], "materials": numbers[slots[order]]}


def with_moves(bent: Any) -> dict[str, Any]:
    """Arguments of Scene.add_mesh() from the middle or only key, and "moves" to the others. bent: keys x vertices x 6,
    positions and normals."""
    middle = bent[MIDDLE if len(bent) > 1 else 0]
    made = {"positions": middle[:, :3], "normals": middle[:, 3:]}
    return {**made, "moves": np.column_stack(list(np.delete(bent, MIDDLE, axis=0) - middle))} if len(bent) > 1 else made


def with_targets(scene: Scene, arrays: dict[str, Any]) -> dict[str, Any]:
    """Fields of set_mesh for a mesh that deforms: morph targets, the offsets to each key but the middle one."""
    moves = arrays.pop("moves", None)
    if moves is None:
        return {}
    targets = moves.reshape(len(moves), -1, 2, 3).transpose(2, 1, 0, 3)  # positions and normals x targets x vertices x 3
    colours = None if arrays.get("colours") is None else pack_colours(arrays["colours"], "colours", len(arrays["colours"]))
    by_place = {0: (arrays["positions"], "<f4"), 1: (arrays["triangles"], "<u4"), 2: (arrays["normals"], "<f4"),
                3: (arrays.get("tangents"), "<f4"), 4: (arrays.get("texcoords"), "<f4"),
                6: (colours, "" if colours is None else colours.dtype.str),
                9: (targets[0], "<f4"), 10: (targets[1], "<f4")}
    given = [by_place.get(place, (None, "")) for place in range(11)]
    return {"target_count": targets.shape[1],
            "arrays": [BlobRef() if one is None else scene.blob(np.array(one, kind, order="C").data) for one, kind in given]}


class Names:
    """Keys of meshes; objects that share a mesh share its key."""

    def __init__(self) -> None:
        self._keys: dict[Hashable, tuple[str, int]] = {}
        self._named: dict[str, int] = {}

    def of(self, thing: bpy.types.Object) -> tuple[tuple[str, int], bool]:
        """The key of an evaluated object's data, and whether it is new."""
        names = tuple(slot.material.name_full if slot.material else "" for slot in thing.material_slots)
        what = thing.name_full if thing.type == "META" else thing.data.as_pointer(), names
        if what in self._keys:
            return self._keys[what], False
        # Several meshes may have the same name: an object's, and those that geometry nodes make from it.
        count = self._named[thing.name_full] = self._named.get(thing.name_full, 0) + 1
        self._keys[what] = thing.name_full, count
        return self._keys[what], True


class Shared:
    """The meshes of an update; a mesh that objects share is read and stored once."""

    def __init__(self, mirror: Mirror, reader: Reader, motion: Optional[Motion]) -> None:
        self._mirror, self._reader, self._motion = mirror, reader, motion
        self._names = Names()
        self._made: dict[Hashable, tuple[Optional[Object], bool]] = {}

    def mesh(self, thing: bpy.types.Object) -> tuple[Optional[Object], bool]:
        """The mesh of an evaluated object, and whether it deforms while the shutter is open; None: it has no surface."""
        key, is_new = self._names.of(thing)
        if is_new:
            self._made[key] = self._make(thing, key)
        return self._made[key]

    def _bent(self, thing: bpy.types.Object, key: Hashable, mesh: bpy.types.Mesh) -> Optional[Any]:
        bent, has_changed = self._motion.shape(key, len(mesh.loops)) if self._motion else (None, False)
        if has_changed:
            self._mirror.note(f"{thing.name}: {DIFFER}")
        return bent

    def _make(self, thing: bpy.types.Object, key: Hashable) -> tuple[Optional[Object], bool]:
        number = self._mirror.number(ObjectKind.MESH, key)
        mesh = thing.data if thing.type == "MESH" else thing.to_mesh()
        try:
            surface = Surface(mesh, key) if mesh else None
            uses = [self._reader.material(slot.material, surface, place) for place, slot in enumerate(thing.material_slots)]
            uses = uses or [self._reader.material(None)]
            bent = self._bent(thing, key, mesh) if mesh else None
            arrays = _arrays(mesh, uses, functools.partial(self._mirror.steady, number), bent) if mesh else None
        finally:
            if thing.type != "MESH":
                thing.to_mesh_clear()
        if arrays is None:
            return None, False
        more = with_targets(self._mirror.scene, arrays)
        return self._mirror.scene.add_mesh(arrays.pop("positions"), mesh=number, name=thing.name[:100], place=False, **arrays, **more), bool(more)
