# SPDX-License-Identifier: MIT
"""Scenes from arrays. Lengths are metres, colours linear Rec. 709, transforms 4 x 4 or 3 x 4 matrices from a node's space to
its parent's."""
from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Union

import numpy as np

from . import arrays, fields, messages
from .arrays import Array, Numbers
from .camera import Camera, CameraOf, look_at
from .errors import InvalidValue
from .fields import Message, takes
from .messages import LightKind, NodeKind, ObjectKind, Sharing
from .objects import ENVIRONMENT, SHOWN, Object, Objects, make

__all__ = ["ENVIRONMENT", "Camera", "CameraOf", "Object", "Scene", "Sharing", "look_at"]

PLACES = tuple(place.name.lower() for place in messages.MaterialTexture)
RANGES_MAX = 4096  # limit for a mesh or for spheres
MaterialsOf = Union[Sequence[Union[Object, int]], Array, None]
Textures = Union[Object, Mapping[Union[int, str], Object], None]


class Scene(Objects):
    """A scene: objects by number. `sharing`: which clients may attach to it, and whether it lingers (private, kept, shared; the
    last two need a name). `origin`: subtracted by farlight.load() from all positions of a model that is far from the origin."""

    def __init__(self, name: str = "", sharing: Sharing | str = Sharing.PRIVATE) -> None:
        super().__init__(name, sharing)
        self.origin = (0.0, 0.0, 0.0)
        self._unplaced: dict[Object, None] = {}  # meshes and spheres that no node shows yet

    def set(self, edit: Message) -> Object:
        if isinstance(edit, messages.SetNode):
            for kind in (ObjectKind.MESH, ObjectKind.SPHERES):
                if edit.kind == SHOWN[kind]:
                    self._unplaced.pop(Object(kind, edit.object), None)
        return super().set(edit)

    def show_unplaced(self) -> None:
        """Adds nodes for objects that no node shows. Clients call it before they send the scene; without a call the daemon
        warns about an empty scene."""
        for thing in [one for one in self._unplaced if one in self]:
            self.add_node(thing)
        self._unplaced.clear()
        shows = any(isinstance(edit, messages.SetDisc) or isinstance(edit, messages.SetNode) and
                    edit.kind in (NodeKind.MESH, NodeKind.SPHERES) for _, edit, _ in self._objects.values())
        if not shows and not self.is_attached:
            warnings.warn("the scene shows nothing: no node shows a mesh or spheres; add_mesh(), add_spheres() or add_node() do", stacklevel=2)

    def _placed(self, thing: Object, place: bool) -> Object:
        if place:
            self._unplaced[thing] = None
        return thing

    # ---- things that are seen

    @takes(messages.material_keywords)
    def add_material(self, base_colour: Numbers = (0.8, 0.8, 0.8, 1.0), *, roughness: float = 0.5,
                     textures: Textures = None, **values: Any) -> Object:
        """Adds a material of glTF 2.0. base_colour: 3 or 4 numbers of 0 .. 1; `values` are other fields of set_material
        (messages.SetMaterial). textures: one for the base colour, or {place: texture} with a place of scene.PLACES."""
        wanted = "3 or 4 numbers of 0 .. 1"
        base = arrays.numbers(base_colour, "base_colour", wanted)
        if base.shape not in ((3,), (4,)):
            raise InvalidValue(f"has the shape {base.shape}; allowed: {wanted}", field="base_colour")
        start = {"roughness": roughness, "material": self._next(ObjectKind.MATERIAL), "base_colour": [*base, 1.0][:4],
                 "textures": self._texture_uses(textures)}
        return self.set(make(messages.SetMaterial, {**start, **values}))

    def _texture_uses(self, textures: Textures) -> list[messages.TextureUse]:
        if textures is None or isinstance(textures, Object):
            textures = {0: textures} if textures else {}
        if not isinstance(textures, Mapping):
            raise InvalidValue(f"{textures!r:.80}; allowed: a texture, or {{place: texture}}", field="textures")
        uses: list[messages.TextureUse] = []
        for place, texture in textures.items():
            at = PLACES.index(place) if place in PLACES else place
            if not isinstance(at, (int, np.integer)) or not 0 <= at < len(PLACES):
                raise InvalidValue(f"{place!r} is none of {', '.join(PLACES)}, and not 0 .. {len(PLACES) - 1}", field="textures")
            number = self.check(texture, (ObjectKind.TEXTURE,), f"textures[{place!r}]")
            uses += [messages.TextureUse(0, 0, (1, 0, 0, 0, 1, 0), 1) for _ in range(at + 1 - len(uses))]
            uses[at].texture = number
        return uses

    @takes(messages.texture_keywords)
    def add_texture(self, image: Numbers, *, srgb: bool = True, **values: Any) -> Object:
        """Adds a texture: height x width (grey), x 3 or x 4, rows from the top; whole numbers of 0 .. 255, or floats, which are
        clipped to 0 .. 1. `srgb`: colours; False: data."""
        texels = arrays.image(image, "image")
        made = messages.TextureFormat.RGBA8_SRGB if srgb else messages.TextureFormat.RGBA8_LINEAR
        start = {"texture": self._next(ObjectKind.TEXTURE), "width": texels.shape[1], "height": texels.shape[0],
                 "format": made, "arrays": [self.blob(texels.data)]}
        return self.set(make(messages.SetTexture, {**start, **values}))

    def _ranges(self, material: Object | None, per_primitive: MaterialsOf, count: int) -> list[messages.MaterialRange]:
        if per_primitive is None:
            number = 0 if material is None else self.check(material, (ObjectKind.MATERIAL,), "material")
            return [messages.MaterialRange(0, count, number)] if number else []
        if not isinstance(per_primitive, np.ndarray):
            per_primitive = np.array([self.check(one, (ObjectKind.MATERIAL,), "materials") if isinstance(one, Object) else one
                                      for one in per_primitive])
        numbers = arrays.table(per_primitive, "<u4", 1, "materials", count)[:, 0]
        edges = [0, *(int(at) + 1 for at in np.flatnonzero(np.diff(numbers))), count]
        if len(edges) > RANGES_MAX + 1:
            raise InvalidValue(f"{len(edges) - 1} runs of one material; allowed: {RANGES_MAX}", field="materials",
                               remedy="sort the triangles or spheres by material")
        return [messages.MaterialRange(first, end - first, int(numbers[first]))
                for first, end in zip(edges[:-1], edges[1:])]

    @takes(messages.mesh_keywords)
    def add_mesh(self, positions: Numbers, triangles: Numbers | None = None, *, material: Object | None = None,
                 materials: MaterialsOf = None, normals: Numbers | None = None, tangents: Numbers | None = None,
                 texcoords: Numbers | None = None, colours: Numbers | None = None, place: bool = True, **values: Any) -> Object:
        """Adds a mesh. positions: n x 3. triangles: m x 3 indices, counter-clockwise seen from the front; None: each three
        positions form a triangle. materials: one for all, or one for each triangle, in at most 4096 runs of equal neighbours.
        normals n x 3, tangents n x 4, texcoords n x 2, colours n x 3 or 4, linear, of 0 .. 255 or floats of 0 .. 1. Arrays are
        copied once. place: shows the mesh at its positions, unless a node shows it by the time that the scene is sent."""
        points = arrays.table(positions, "<f4", 3, "positions")
        if triangles is None and len(points) % 3:
            raise InvalidValue(f"{len(points)} points; allowed without triangles: three for each triangle", field="positions",
                               remedy="give `triangles`, the indices of their corners")
        corners = arrays.table(np.arange(len(points), dtype="<u4") if triangles is None else triangles, "<u4", 3, "triangles")
        if not len(points) or not len(corners):
            raise InvalidValue("is empty", field="positions" if not len(points) else "triangles")
        if int(corners.max()) >= len(points):
            raise InvalidValue(f"names vertex {corners.max()}; allowed: 0 .. {len(points) - 1}", field="triangles")
        given = [points, corners, None if normals is None else arrays.table(normals, "<f4", 3, "normals", len(points)),
                 None if tangents is None else arrays.table(tangents, "<f4", 4, "tangents", len(points)),
                 None if texcoords is None else arrays.table(texcoords, "<f4", 2, "texcoords", len(points)), None,
                 None if colours is None else arrays.colours(colours, "colours", len(points))]
        ranges = self._ranges(material, materials, len(corners))
        while given[-1] is None:
            given.pop()
        start = {"mesh": self._next(ObjectKind.MESH), "vertex_count": len(points), "triangle_count": len(corners),
                 "arrays": [messages.BlobRef() if one is None else self.blob(one.data) for one in given], "ranges": ranges}
        return self._placed(self.set(make(messages.SetMesh, {**start, **values})), place)

    @takes(messages.spheres_keywords)
    def add_spheres(self, centres: Numbers, radii: Numbers, *, material: Object | None = None, materials: MaterialsOf = None,
                    place: bool = True, **values: Any) -> Object:
        """Adds exact spheres: centres n x 3, radii n or one for all; materials and place as for add_mesh()."""
        points = arrays.table(centres, "<f4", 3, "centres")
        wanted = f"one positive number, or one for each of the {len(points)} centres"
        sizes = arrays.numbers(radii, "radii", wanted)
        if not len(points) or sizes.size not in (1, len(points)) or not (sizes > 0).all():
            raise InvalidValue(f"{sizes.size} of them, the smallest {sizes.min() if sizes.size else 'missing'}; allowed: {wanted}",
                               field="radii" if len(points) else "centres")
        packed = np.empty((len(points), 4), "<f4")
        packed[:, :3], packed[:, 3] = points, sizes.reshape(-1)
        packed = arrays.table(packed, "<f4", 4, "radii")
        start = {"spheres": self._next(ObjectKind.SPHERES), "sphere_count": len(points), "arrays": [self.blob(packed.data)],
                 "ranges": self._ranges(material, materials, len(points))}
        return self._placed(self.set(make(messages.SetSpheres, {**start, **values})), place)

    @takes(messages.disc_keywords)
    def add_disc(self, centre: Numbers, normal: Numbers, radius: float, *, material: Object | None = None,
                 **values: Any) -> Object:
        """Adds a disc in world space, such as a ground."""
        direction = arrays.vector(normal, "normal")
        length = math.hypot(*direction)
        if not length > 0:
            raise InvalidValue("has no length", field="normal")
        number = 0 if material is None else self.check(material, (ObjectKind.MATERIAL,), "material")
        start = {"disc": self._next(ObjectKind.DISC), "material": number, "centre_world": arrays.vector(centre, "centre"),
                 "normal_world": [one / length for one in direction], "radius": radius}
        return self.set(make(messages.SetDisc, {**start, **values}))

    # ---- lights, cameras, places

    def _place(self, made: Message, transform: Numbers | None, parent: Object | None) -> Object:
        """Adds the node of a new object, and neither if the node is invalid."""
        fields.encode(made)
        node = self._node(NodeKind.GROUP, 0, transform, parent)
        shows = self.set(made)
        return self.set(replace(node, kind=SHOWN[shows.kind], object=shows.number))

    def _node(self, kind: NodeKind, shows: int, transform: Numbers | None, parent: Object | None) -> messages.SetNode:
        above = 0 if parent is None else self.check(parent, (ObjectKind.NODE,), "parent")
        return messages.SetNode(self._next(ObjectKind.NODE), above, kind, shows, parent_from_node=arrays.transform(transform))

    @takes(messages.light_keywords)
    def add_light(self, kind: LightKind | str, colour: Numbers, transform: Numbers | None = None,
                  parent: Object | None = None, **values: Any) -> Object:
        """Adds a light and its node, which is returned: scene.move(light, ...). The colour is power in the kind's unit: point
        and spot W/sr, directional W/m2, rectangle and sphere W/(m2 sr)."""
        start = {"light": self._next(ObjectKind.LIGHT), "kind": kind, "colour": colour}
        return self._place(make(messages.SetLight, {**start, **values}), transform, parent)

    @takes(messages.camera_keywords)
    def add_camera(self, fov_degrees: float = 40.0, transform: Numbers | None = None, parent: Object | None = None,
                   **values: Any) -> Object:
        """Adds a camera and its node, which is returned: render(camera=node)."""
        start = {"camera": self._next(ObjectKind.CAMERA), "fov_y": math.radians(arrays.number(fov_degrees, "fov_degrees"))}
        return self._place(make(messages.SetCamera, {**start, **values}), transform, parent)

    @takes(messages.node_keywords)
    def add_node(self, shows: Object | None = None, transform: Numbers | None = None, *, parent: Object | None = None,
                 **values: Any) -> Object:
        """Adds a node that places a mesh, spheres, a light or a camera; without `shows` a group."""
        number = 0 if shows is None else self.check(shows, SHOWN, "shows")
        node = self._node(NodeKind.GROUP if shows is None else SHOWN[shows.kind], number, transform, parent)
        make(messages.SetNode, values)
        return self.set(replace(node, **values))

    def add_instances(self, shows: Object, transforms: Iterable[Numbers], parent: Object | None = None) -> list[Object]:
        """Adds nodes that show an object, stored once, at many places."""
        if not isinstance(transforms, Iterable):
            raise InvalidValue(f"{transforms!r:.80}; allowed: several matrices", field="transforms")
        return [self.add_node(shows, transform, parent=parent) for transform in transforms]

    def move(self, node: Object, transform: Numbers) -> None:
        """Moves a node to another place."""
        self.check(node, (ObjectKind.NODE,), "node")
        self.change(node, parent_from_node=arrays.transform(transform))

    @takes(messages.environment_keywords)
    def set_environment(self, colour: Numbers = (1, 1, 1), image: Numbers | None = None, **values: Any) -> Object:
        """Sets the light from all around. image: height x width x 3 linear floats, equirectangular, rows from +y down; the
        colour multiplies it. change(farlight.ENVIRONMENT, rotation=1.5) keeps the image."""
        start: dict[str, Any] = {"colour": arrays.vector(colour, "colour")}
        if image is not None:
            texels = arrays.sky(image, "image")
            start.update(width=texels.shape[1], height=texels.shape[0], arrays=[self.blob(texels.data)])
        return self.set(make(messages.SetEnvironment, {**start, **values}))
