# SPDX-License-Identifier: MIT
"""Evaluated meshes as arrays: triangles, split normals, coordinates of the active UV map, colours where a material asks."""
from __future__ import annotations

import functools
from collections.abc import Callable, Hashable
from typing import TYPE_CHECKING, Any, Optional

import bpy
import numpy as np
from farlight.scene import Object
from farlight.messages import ObjectKind

from .materials import Material, Reader

if TYPE_CHECKING:
    from .mirror import Mirror

Steady = Callable[[str, Any], Any]  # Mirror.steady() of one mesh

def _read(items: Any, field: str, width: int, kind: Any = np.float32) -> Any:
    values = np.empty(len(items) * width, kind)
    items.foreach_get(field, values)
    return values.reshape(-1, width) if width > 1 else values


def _normals(mesh: bpy.types.Mesh) -> Any:
    if hasattr(mesh, "corner_normals"):  # Blender 4.1 and later
        return _read(mesh.corner_normals, "vector", 3)
    mesh.calc_normals_split()
    return _read(mesh.loops, "normal", 3)


def _colours(mesh: bpy.types.Mesh, name: str) -> Any:
    """Four bytes for each corner; None: there are no such ones."""
    attribute = mesh.color_attributes.get(name) or mesh.color_attributes.active_color
    if attribute is None:
        return None
    values = _read(attribute.data, "color", 4)
    if attribute.domain == "POINT":
        values = values[_read(mesh.loops, "vertex_index", 1, np.int32)]
    return np.rint(np.clip(values, 0, 1) * 255).astype(np.uint8)


def _corners(mesh: bpy.types.Mesh, uses: list[Material], steady: Steady) -> dict[str, Any]:
    """What Scene.add_mesh() takes of each corner."""
    points = _read(mesh.vertices, "co", 3)[_read(mesh.loops, "vertex_index", 1, np.int32)]
    arrays = {"positions": points, "normals": steady("normals", _normals(mesh))}
    layer = next((one for one in mesh.uv_layers if one.active_render), None)
    if layer is not None:
        # Rows of textures are counted from the top, Blender's v from below.
        arrays["texcoords"] = _read(layer.data, "uv", 2) * (1, -1) + (0, 1)
        if any(use.has_normal_map for use in uses):
            mesh.calc_tangents(uvmap=layer.name)
            tangents = np.column_stack((_read(mesh.loops, "tangent", 3), _read(mesh.loops, "bitangent_sign", 1)))
            arrays["tangents"] = steady("tangents", tangents)
    name = next((use.colour_attribute for use in uses if use.colour_attribute is not None), None)
    if name is not None:
        arrays["colours"] = _colours(mesh, name)
    return arrays


def _arrays(mesh: bpy.types.Mesh, uses: list[Material], steady: Steady) -> Optional[dict[str, Any]]:
    mesh.calc_loop_triangles()
    triangles = _read(mesh.loop_triangles, "loops", 3, np.int32)
    if not len(triangles):
        return None
    slots = np.clip(_read(mesh.loop_triangles, "material_index", 1, np.int32), 0, len(uses) - 1)
    order = np.argsort(slots, kind="stable")  # few runs of materials
    numbers = np.array([use.number for use in uses], np.uint32)
    corners = _corners(mesh, uses, steady)
    # Corners that are the same in everything are one vertex.
    rows = np.column_stack([np.ascontiguousarray(one, np.uint8 if name == "colours" else np.float32).view(np.uint8)
                            for name, one in corners.items() if one is not None])
    _, first, vertex = np.unique(rows.view(f"V{rows.shape[1]}").ravel(), return_index=True, return_inverse=True)
    return {**{name: None if one is None else one[first] for name, one in corners.items()},
            "triangles": vertex[triangles[order]], "materials": numbers[slots[order]]}


class Shared:
    """The meshes of one update: what several objects share is read and stored once."""

    def __init__(self, mirror: Mirror, reader: Reader) -> None:
        self._mirror, self._reader = mirror, reader
        self._made: dict[Hashable, Optional[Object]] = {}
        self._named: dict[str, int] = {}

    def mesh(self, thing: bpy.types.Object) -> Optional[Object]:
        """That of an evaluated object; None: it has no surface."""
        names = tuple(slot.material.name_full if slot.material else "" for slot in thing.material_slots)
        what = thing.data.as_pointer() if thing.type == "MESH" else thing.name_full, names
        if what not in self._made:
            self._made[what] = self._make(thing)
        return self._made[what]

    def _make(self, thing: bpy.types.Object) -> Optional[Object]:
        uses = [self._reader.material(slot.material) for slot in thing.material_slots] or [self._reader.material(None)]
        # The same name may stand for several meshes, of an object and of what geometry nodes make from it.
        count = self._named[thing.name_full] = self._named.get(thing.name_full, 0) + 1
        number = self._mirror.number(ObjectKind.MESH, (thing.name_full, count))
        mesh = thing.data if thing.type == "MESH" else thing.to_mesh()
        try:
            arrays = _arrays(mesh, uses, functools.partial(self._mirror.steady, number)) if mesh else None
        finally:
            if thing.type != "MESH":
                thing.to_mesh_clear()
        if arrays is None:
            return None
        return self._mirror.scene.add_mesh(arrays.pop("positions"), mesh=number, name=thing.name[:100], **arrays)
