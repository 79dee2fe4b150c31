# SPDX-License-Identifier: MIT
"""Blender's evaluated scene as a farlight.Scene.

A mirror outlives renders. Each update reads the whole scene and sets the objects again under their old numbers; an unchanged
object is no change of the farlight.Scene and is not sent. All nodes are below one that turns Blender's axes (z up) into the
protocol's (y up), so that all transforms are Blender's own."""
from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from typing import Any, Optional

import bpy
import farlight
import numpy as np
from farlight.scene import Object
from farlight.messages import NodeKind, ObjectKind, SetNode
from mathutils import Vector

from . import cameras, lights, materials, meshes, motion, strands, world

WORLD_FROM_BLENDER = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], dtype=np.float64)
WITH_SURFACE = {"MESH", "META"}  # surfaces of curves and texts come as further objects of type mesh
# Blender sums the normals of faces in several threads, in any order, so that they differ by rounding from time to time.
SAME_DIRECTION = 1e-5
# Order of removal: users of other objects first.
SWEPT = {ObjectKind.CHANNEL: 0, ObjectKind.CLIP: 1, ObjectKind.NODE: 2}
WITHOUT_FACES = {"CURVES", "POINTCLOUD"}
NOT_DRAWN = {"VOLUME": "volumes are not drawn: make a surface of it (modifier Volume to Mesh) or render it with Cycles",
             "GPENCIL": "grease pencil is not drawn: convert it to a curve or a mesh"}
PARTICLES = {"HALO": "halos", "LINE": "lines"}

ROOT, CAMERA = ("root",), ("camera",)  # keys of nodes that represent no object of a name


def _key(instance: bpy.types.DepsgraphObjectInstance) -> Hashable:
    """The key of the node of an instance."""
    thing = instance.object
    # Distinct from a mesh of the same name
    name: Hashable = (thing.type, thing.name_full) if thing.type in WITHOUT_FACES else thing.name_full
    return (instance.parent.name_full, name, tuple(instance.persistent_id)) if instance.is_instance else name


def _has_hairs(instance: bpy.types.DepsgraphObjectInstance) -> bool:
    """True if the object's hairs belong to the instance; geometry nodes make meshes under an object's name without its hairs."""
    thing = instance.object
    if not instance.show_particles or thing.type != "MESH":
        return False
    return not instance.is_instance or bool(instance.instance_object.data == thing.data)


def _hairs_key(key: Hashable, system: str) -> Hashable:
    return "hairs", key, system


def moment(depsgraph: bpy.types.Depsgraph, camera: bpy.types.Object) -> motion.Moment:
    """Places of objects, and shapes of deforming ones, at the current time of Blender's scene."""
    made, names, others = motion.Moment(), meshes.Names(), meshes.Names()
    scene = depsgraph.scene_eval
    for instance in depsgraph.object_instances:
        thing = instance.object
        key = _key(instance)
        if motion.may_move(thing, scene) and thing.type in WITH_SURFACE | WITHOUT_FACES | {"LIGHT"}:
            made.places[key] = instance.matrix_world.copy()
            for hairs in strands.hairy(thing, True) if _has_hairs(instance) else ():
                made.places[_hairs_key(key, hairs.particle_system.name)] = made.places[key]
                mesh = strands.hairs_key(thing, hairs.particle_system)
                if mesh not in made.shapes and motion.may_deform(thing, scene):
                    made.shapes[mesh] = strands.places(thing, hairs.particle_system, True)
        if instance.show_self and thing.type in WITH_SURFACE:
            mesh, is_new = names.of(thing)
            if is_new and motion.deforms(thing, scene):
                made.shapes[mesh] = meshes.shape(thing.data)
        if instance.show_self and thing.type in WITHOUT_FACES:
            name, is_new = others.of(thing)
            if is_new and motion.may_deform(thing, scene):
                made.shapes[thing.type, *name] = strands.rows(thing.data)
    if motion.may_move(camera, scene):
        made.places[CAMERA] = camera.matrix_world.copy()
    return made


class _Extent:
    """The extent of the scene from its origin."""

    def __init__(self) -> None:
        self._radii: dict[Object, float] = {}
        self._farthest = 1e-3

    def add(self, shown: Object, thing: bpy.types.Object, matrix: Any) -> None:
        """Extends it by an object with a surface, at a place."""
        if shown not in self._radii:
            self._radii[shown] = max(Vector(corner).length for corner in thing.bound_box)
        self._farthest = max(self._farthest, matrix.translation.length + self._radii[shown] * max(abs(one) for one in matrix.to_scale()))

    def radius(self) -> float:
        """The extent rounded up to a power of two, so that it rarely changes."""
        return float(2 ** math.ceil(math.log2(self._farthest)))


class Mirror:
    """A mirror of a scene. `scene` is the copy for clients; `notes` lists features that the protocol lacks."""

    def __init__(self) -> None:
        self.scene = farlight.Scene()
        self.notes: list[str] = []
        self.light_groups: dict[str, int] = {}  # the view layer's; nodes and the world refer to them by number
        self._steady: dict[tuple[int, str], Any] = {}
        self._numbers: dict[tuple[ObjectKind, Hashable], int] = {}
        self._last: dict[ObjectKind, int] = {}
        self._seen: set[tuple[ObjectKind, Hashable]] = set()
        self._motion: Optional[motion.Motion] = None
        self._remembered: dict[Hashable, tuple[Hashable, Any]] = {}
        self._asked: set[Hashable] = set()

    # ---- for the modules that read Blender's data

    def number(self, kind: ObjectKind, key: Hashable) -> int:
        """The number of the key's object, which never changes. Objects that an update does not touch are removed at its end."""
        if (kind, key) not in self._numbers:
            self._last[kind] = self._last.get(kind, 0) + 1
            self._numbers[kind, key] = self._last[kind]
        self._seen.add((kind, key))
        return self._numbers[kind, key]

    def is_seen(self, kind: ObjectKind, key: Hashable) -> bool:
        """True if this update has set the object already."""
        return (kind, key) in self._seen

    def steady(self, mesh: int, name: str, values: Any) -> Any:
        """The directions that a mesh had in the last update, if these differ by rounding only."""
        before = self._steady.get((mesh, name))
        if before is not None and before.shape == values.shape and np.abs(values - before).max(initial=0) < SAME_DIRECTION:
            return before
        self._steady[mesh, name] = values
        return values

    def remembered(self, key: Hashable, told: Hashable, make: Callable[[], Any]) -> Any:
        """Caches a slow result until its inputs differ; dropped after an update that does not use it."""
        self._asked.add(key)
        if key not in self._remembered or self._remembered[key][0] != told:
            self._remembered[key] = told, make()
        return self._remembered[key][1]

    def note(self, text: str) -> None:
        """Records a missing feature once."""
        if text not in self.notes:
            self.notes.append(text)

    def place(self, key: Hashable, shows: Object, matrix: Any, thing: bpy.types.Object,
              rigid: Optional[Callable[[Any], Any]] = None, *, bends: bool = False) -> Object:
        """Shows an object at a place in Blender's world. rigid: reduces a place, for a light or the camera, to a rigid one.
        bends: the mesh has targets."""
        node = self.number(ObjectKind.NODE, key)
        if self._motion is not None and not self._motion.follow(key, node, rigid):
            self.note(f"{thing.name}: it is sheared, which its motion leaves out")
        if self._motion is not None and bends:
            self._motion.bend(key, node)
        return self.scene.add_node(shows, np.array(rigid(matrix) if rigid else matrix), parent=self._root(), node=node,
                                   name=thing.name[:100], light_group=self.light_groups.get(thing.lightgroup, 0))

    def _root(self) -> Object:
        return Object(ObjectKind.NODE, self.number(ObjectKind.NODE, ROOT))

    # ---- an update

    def update(self, depsgraph: bpy.types.Depsgraph,
               seen_by: Optional[tuple[bpy.types.Object, cameras.Lens]] = None,
               moves: Optional[motion.Motion] = None) -> Optional[Object]:
        """Updates the scene to Blender's. seen_by: a camera, whose node is returned. moves: the motion."""
        self._motion = moves
        self._seen.clear()
        self._asked.clear()
        self.notes.clear()
        self.light_groups = lights.groups(self, depsgraph.view_layer_eval)
        self.scene.set(SetNode(node=self._root().number, kind=NodeKind.GROUP, name="Blender",
                               parent_from_node=[float(one) for one in WORLD_FROM_BLENDER[:3].ravel()]))
        world.update(self, depsgraph.scene_eval)
        reader = materials.Reader(self)
        shared = meshes.Shared(self, reader, moves), strands.Shared(self, reader, moves, depsgraph.mode == "RENDER")
        found: list[tuple[Hashable, bpy.types.Object, Any]] = []  # lights
        extent = _Extent()
        for instance in depsgraph.object_instances:
            self._instance(instance, shared, found, extent)
        for light in found:
            lights.update(self, *light, extent.radius())
        node = cameras.update(self, CAMERA, *seen_by) if seen_by else None
        if moves is not None:
            moves.send(self)
        self._sweep()
        return node

    def _instance(self, instance: bpy.types.DepsgraphObjectInstance, shared: tuple[meshes.Shared, strands.Shared],
                  found: list[tuple[Hashable, bpy.types.Object, Any]], extent: _Extent) -> None:
        thing, key, place = instance.object, _key(instance), instance.matrix_world
        if instance.show_self and thing.type in WITH_SURFACE:
            for system in thing.particle_systems if not instance.is_instance else ():
                if system.settings.render_type in PARTICLES:  # others are hairs or instances
                    self.note(f"{thing.name}: the {PARTICLES[system.settings.render_type]} of {system.name} are not drawn: "
                              "render them as objects")
            mesh, bends = shared[0].mesh(thing)
            if mesh is not None:
                extent.add(mesh, thing, place)
                self.place(key, mesh, place, thing, bends=bends)
        elif instance.show_self and thing.type in WITHOUT_FACES:
            shown, bends = shared[1].own(thing)
            if shown is not None:
                extent.add(shown, thing, place)
                self.place(key, shown, place, thing, bends=bends)
        elif instance.show_self and thing.type == "LIGHT":
            found.append((key, thing, place.copy()))
        elif instance.show_self and thing.type in NOT_DRAWN:
            self.note(f"{thing.name}: {NOT_DRAWN[thing.type]}")
        for name, hairs, bends in shared[1].hairs(thing) if _has_hairs(instance) else ():
            if hairs is not None:
                self.place(_hairs_key(key, name), hairs, place, thing, bends=bends)

    def _sweep(self) -> None:
        self._remembered = {key: made for key, made in self._remembered.items() if key in self._asked}
        gone = [one for one in self._numbers if one not in self._seen]
        for kind, key in sorted(gone, key=lambda one: SWEPT.get(one[0], len(SWEPT))):
            number = self._numbers.pop((kind, key))
            if Object(kind, number) in self.scene:  # a node is removed together with its parent
                self.scene.remove(Object(kind, number))
            if kind == ObjectKind.MESH:
                self._steady = {key: values for key, values in self._steady.items() if key[0] != number}


_mirrors: dict[Hashable, Mirror] = {}


def mirror(key: Hashable) -> Mirror:
    """The mirror of a scene of Blender's, shared by all its renders."""
    return _mirrors.setdefault(key, Mirror())


def forget_all() -> list[Mirror]:
    """Drops all mirrors, for another file; returns them."""
    gone = list(_mirrors.values())
    _mirrors.clear()
    return gone
