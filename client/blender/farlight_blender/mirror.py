# SPDX-License-Identifier: MIT
"""Blender's evaluated scene as a farlight.Scene.

A mirror outlives renders. Each time the whole scene is read again and set again under the numbers that it had; what is the
same as before is no change of the farlight.Scene and is not sent. All nodes are below one that turns Blender's axes (z up)
into the protocol's (y up), so that all transforms are Blender's own."""
from __future__ import annotations

from collections.abc import Hashable
from typing import Any, Optional

import bpy
import farlight
import numpy as np
from farlight.scene import Object
from farlight.messages import NodeKind, ObjectKind, SetNode

from . import cameras, lights, materials, meshes, world

WORLD_FROM_BLENDER = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], dtype=np.float64)
WITH_SURFACE = {"MESH", "META"}  # the surfaces of curves and texts come as objects of the type mesh beside them
# Blender adds the normals of faces up in several threads, in any order: by rounding they differ from time to time.
SAME_DIRECTION = 1e-5
NOT_DRAWN = {"VOLUME": "volumes", "CURVES": "hair", "POINTCLOUD": "point clouds", "GPENCIL": "grease pencil"}


class Mirror:
    """`scene` is what clients send; `notes` is what could not be said in the protocol's terms."""

    def __init__(self) -> None:
        self.scene = farlight.Scene()
        self.notes: list[str] = []
        self._steady: dict[tuple[int, str], Any] = {}
        self._numbers: dict[tuple[ObjectKind, Hashable], int] = {}
        self._last: dict[ObjectKind, int] = {}
        self._seen: set[tuple[ObjectKind, Hashable]] = set()

    # ---- for the modules that read Blender's data

    def number(self, kind: ObjectKind, key: Hashable) -> int:
        """Of the object that stands for the key: always the same. Others are removed at the end of update()."""
        if (kind, key) not in self._numbers:
            self._last[kind] = self._last.get(kind, 0) + 1
            self._numbers[kind, key] = self._last[kind]
        self._seen.add((kind, key))
        return self._numbers[kind, key]

    def is_seen(self, kind: ObjectKind, key: Hashable) -> bool:
        """Whether this update has set it already."""
        return (kind, key) in self._seen

    def steady(self, mesh: int, name: str, values: Any) -> Any:
        """The directions that a mesh had the last time, if these differ from them by rounding alone."""
        before = self._steady.get((mesh, name))
        if before is not None and before.shape == values.shape and np.abs(values - before).max(initial=0) < SAME_DIRECTION:
            return before
        self._steady[mesh, name] = values
        return values

    def note(self, text: str) -> None:
        """Says once what the picture lacks."""
        if text not in self.notes:
            self.notes.append(text)

    def place(self, key: Hashable, shows: Object, matrix: Any, name: str) -> Object:
        """Shows a thing at a place in Blender's world."""
        node = self.number(ObjectKind.NODE, key)
        return self.scene.add_node(shows, np.array(matrix), parent=self._root(), node=node, name=name[:100])

    def _root(self) -> Object:
        return Object(ObjectKind.NODE, self.number(ObjectKind.NODE, "root"))

    # ---- an update

    def update(self, depsgraph: bpy.types.Depsgraph,
               seen_by: Optional[tuple[bpy.types.Object, cameras.Lens]] = None) -> Optional[Object]:
        """Makes the scene what Blender's is. seen_by: a camera; its node is returned."""
        self._seen.clear()
        self.notes.clear()
        self.scene.set(SetNode(node=self._root().number, kind=NodeKind.GROUP, name="Blender",
                               parent_from_node=[float(one) for one in WORLD_FROM_BLENDER[:3].ravel()]))
        world.update(self, depsgraph.scene_eval)
        shared = meshes.Shared(self, materials.Reader(self))
        for instance in depsgraph.object_instances:
            self._instance(instance, shared)
        node = cameras.update(self, *seen_by) if seen_by else None
        self._sweep()
        return node

    def _instance(self, instance: bpy.types.DepsgraphObjectInstance, shared: "meshes.Shared") -> None:
        if not instance.show_self:
            return
        thing = instance.object
        key: Hashable = (instance.parent.name_full, thing.name_full, tuple(instance.persistent_id)) \
            if instance.is_instance else thing.name_full
        if thing.type in WITH_SURFACE:
            mesh = shared.mesh(thing)
            if mesh is not None:
                self.place(key, mesh, instance.matrix_world, thing.name)
        elif thing.type == "LIGHT":
            lights.update(self, key, thing, instance.matrix_world)
        elif thing.type in NOT_DRAWN:
            self.note(f"{thing.name}: {NOT_DRAWN[thing.type]} are not drawn")

    def _sweep(self) -> None:
        gone = [one for one in self._numbers if one not in self._seen]
        for kind, key in sorted(gone, key=lambda one: one[0] != ObjectKind.NODE):  # they use the others
            number = self._numbers.pop((kind, key))
            self.scene.remove(Object(kind, number))
            if kind == ObjectKind.MESH:
                self._steady = {key: values for key, values in self._steady.items() if key[0] != number}


_mirrors: dict[Hashable, Mirror] = {}


def mirror(key: Hashable) -> Mirror:
    """That of a scene of Blender's: one for all its renders."""
    return _mirrors.setdefault(key, Mirror())


def forget_all() -> list[Mirror]:
    """Another file has other scenes; those that were there."""
    gone = list(_mirrors.values())
    _mirrors.clear()
    return gone
