# SPDX-License-Identifier: MIT
"""A scene as its client keeps it: plain data, no connection. Clients send what has changed since the last time; to a new
connection they send all of it. Lengths are metres, colours linear Rec. 709, transforms 4 x 4 or 3 x 4 matrices that
take a node's space to its parent's."""
from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Optional, Union

import numpy as np
import numpy.typing as npt

from . import fields, messages
from .blobs import blob_hash
from .errors import InvalidValue
from .fields import Bytes, Message
from .frame import layer_set
from .messages import LightKind, NodeKind, ObjectKind, Sharing

__all__ = ["Camera", "Object", "Scene", "Sharing", "look_at"]

Numbers = npt.ArrayLike
Array = npt.NDArray[Any]
IDENTITY = np.eye(4)
ATTACHED_FROM = 1 << 20  # identifiers of new objects in a scene that others have made


class Object(NamedTuple):
    """An object of a scene: its kind and its number among those of that kind."""
    kind: ObjectKind
    number: int


_KINDS: dict[type[Message], ObjectKind] = {
    messages.SetNode: ObjectKind.NODE, messages.SetMesh: ObjectKind.MESH, messages.SetSpheres: ObjectKind.SPHERES,
    messages.SetMaterial: ObjectKind.MATERIAL, messages.SetTexture: ObjectKind.TEXTURE,
    messages.SetLight: ObjectKind.LIGHT, messages.SetCamera: ObjectKind.CAMERA, messages.SetDisc: ObjectKind.DISC,
    messages.SetSkin: ObjectKind.SKIN, messages.SetClip: ObjectKind.CLIP, messages.SetChannel: ObjectKind.CHANNEL,
}
_SHOWN = {ObjectKind.MESH: NodeKind.MESH, ObjectKind.SPHERES: NodeKind.SPHERES, ObjectKind.LIGHT: NodeKind.LIGHT,
          ObjectKind.CAMERA: NodeKind.CAMERA}
_Key = Optional[Object]  # None: the environment


def look_at(eye: Numbers, target: Numbers, up: Numbers = (0, 1, 0)) -> Array:
    """The 4 x 4 transform of a node at `eye` whose -z points at `target`: for cameras, spots and rectangles."""
    place, at, above = (np.asarray(one, dtype=np.float64) for one in (eye, target, up))
    back = place - at
    right = np.cross(above, back)
    if not np.linalg.norm(back) > 0 or not np.linalg.norm(right) > 1e-12 * np.linalg.norm(back):
        raise InvalidValue("the eye is at its target, or looks along `up`", field="look_at",
                           remedy="move one of them, or give another `up`")
    back, right = back / np.linalg.norm(back), right / np.linalg.norm(right)
    made = np.eye(4)
    made[:3] = np.column_stack((right, np.cross(back, right), back, place))
    return made


@dataclass(frozen=True)
class Camera:
    """A camera of a job: where it is, what is at the centre of its picture, its vertical field of view."""
    eye: Sequence[float]
    look_at: Sequence[float] = (0.0, 0.0, 0.0)
    up: Sequence[float] = (0.0, 1.0, 0.0)
    fov_degrees: float = 40.0
    time_s: float = 0.0

    def key(self) -> messages.CameraKey:
        """As a job's camera."""
        return messages.CameraKey(self.time_s, self.eye, self.look_at, self.up, math.radians(self.fov_degrees))

    def command(self, moving: bool, time_s: float) -> messages.ViewCamera:
        """As a view's camera."""
        return messages.ViewCamera(moving=int(moving), time_s=time_s, eye_world=self.eye, look_at_world=self.look_at,
                                   up_world=self.up, fov_y=math.radians(self.fov_degrees))


def _array(values: Numbers, kind: str, columns: int, field: str, count: int | None = None) -> Array:
    """A contiguous little-endian copy of so many columns."""
    array = np.asarray(values)
    if kind == "<u4" and (array.dtype.kind not in "iu" or (array.size and (array.min() < 0 or array.max() > 0xffffffff))):
        raise InvalidValue("are no whole numbers of 0 .. 4294967295", field=field)
    if array.dtype.kind not in "iufb":
        raise InvalidValue(f"are no numbers but {array.dtype}", field=field)
    if array.ndim == 1 and array.size % columns == 0:
        array = array.reshape(-1, columns)
    if array.ndim != 2 or array.shape[1] != columns or (count is not None and array.shape[0] != count):
        raise InvalidValue(f"has the shape {np.shape(values)} where ({'n' if count is None else count}, {columns}) belongs",
                           field=field)
    if kind[1] == "f" and not np.isfinite(array).all():
        raise InvalidValue("has NaN or infinity", field=field)
    made = np.array(array, dtype=kind, order="C")
    made.setflags(write=False)
    return made


def _transform(transform: Numbers | None) -> list[float]:
    matrix = np.asarray(IDENTITY if transform is None else transform, dtype=np.float64)
    if matrix.shape not in ((4, 4), (3, 4)):
        raise InvalidValue(f"has the shape {matrix.shape} where (4, 4) or (3, 4) belongs", field="transform")
    if matrix.shape == (4, 4) and not np.array_equal(matrix[3], (0, 0, 0, 1)):
        raise InvalidValue("its last row is not 0 0 0 1", field="transform")
    return [float(one) for one in matrix[:3].ravel()]


def _make(kind: type[Message], values: dict[str, Any]) -> Any:
    known = {field.name for field in kind.FIELDS}
    for name in values:
        if name not in known:
            like = difflib.get_close_matches(name, known)
            raise InvalidValue("there is no such field", field=f"{kind.NAME}.{name}",
                               remedy=f"did you mean {' or '.join(like)}?" if like else
                               f"help(farlight.messages.{kind.__name__}) lists them")
    return kind(**values)


class Scene:
    """Objects by number. `sharing`: who else may attach to it, and whether it lingers (private, kept, shared; the last
    two need a name)."""

    def __init__(self, name: str = "", sharing: Sharing | str = Sharing.PRIVATE) -> None:
        try:
            self.sharing = Sharing(Sharing.of(sharing))
        except ValueError as why:
            raise InvalidValue(str(why), field="scene_open.sharing") from None
        self.name, self.is_attached = name, False
        self.version = 0  # counts changes
        self.notes: list[str] = []  # of an import
        self._objects: dict[_Key, tuple[int, Message]] = {}  # with the version that set it
        self._made: dict[_Key, int] = {}  # the version that made it
        self._removed: dict[Object, tuple[int, int]] = {}  # the versions that made and removed it
        self._numbers: dict[ObjectKind, int] = {}
        self._blobs: dict[bytes, Bytes] = {}

    # ---- any object

    def set(self, edit: Message) -> Object | None:
        """Creates or replaces an object by its message; what it names in blobs is given by blob(). The message that it
        already has changes nothing."""
        kind = _KINDS.get(type(edit))
        if kind is None and not isinstance(edit, messages.SetEnvironment):
            raise InvalidValue("is no edit of an object", field=edit.NAME)
        encoded = fields.encode(edit)
        key = None if kind is None else Object(kind, getattr(edit, edit.FIELDS[0].name))
        if key in self._objects and fields.encode(self._objects[key][1]) == encoded:
            return key  # as it is: nothing to be sent
        self.version += 1
        self._objects[key] = (self.version, edit)
        self._made.setdefault(key, self._removed[key][0] if key in self._removed else self.version)
        if key is not None:
            self._removed.pop(key, None)
            self._numbers[key.kind] = max(self._numbers.get(key.kind, 0), key.number)
        return key

    def get(self, thing: Object) -> Any:
        """The message that makes it, to be looked at; change() changes it."""
        if thing not in self._objects:
            raise InvalidValue(f"{thing.kind.word} {thing.number} is not here", field="object")
        return self._objects[thing][1]

    def change(self, thing: Object, **values: Any) -> None:
        """Other values for some of its fields: change(steel, roughness=0.2)."""
        edit = self.get(thing)
        _make(type(edit), values)
        self.set(replace(edit, **values))

    def shown(self, node: Object) -> Object | None:
        """What a node shows: change(shown(light), colour=(9, 9, 9))."""
        edit = self.get(node)
        kind = next((kind for kind, shows in _SHOWN.items() if shows == edit.kind), None)
        return None if kind is None else Object(kind, edit.object)

    def remove(self, thing: Object) -> None:
        """With a node all below it, as the daemon does it; refused at the commit if a remaining node uses it."""
        below, at = [thing], 0
        while at < len(below) and thing.kind == ObjectKind.NODE:
            below += [key for key, (_, edit) in self._objects.items() if key and key not in below and
                      isinstance(edit, messages.SetNode) and edit.parent == below[at].number]
            at += 1
        for one in reversed(below):  # each before what is above it
            if self._objects.pop(one, None):
                self.version += 1
                self._removed[one] = (self._made.pop(one), self.version)

    def find(self, kind: ObjectKind | str, name: str) -> list[Object]:
        """Those of a name: those of a file have the file's."""
        wanted = ObjectKind.of(kind)
        return [key for key, (_, edit) in self._objects.items()
                if key and key.kind == wanted and getattr(edit, "name", None) == name]

    def objects(self, kind: ObjectKind | str) -> list[Object]:
        """All of a kind."""
        wanted = ObjectKind.of(kind)
        return [key for key in self._objects if key and key.kind == wanted]

    def blob(self, data: Bytes) -> messages.BlobRef:
        """Keeps the bytes, and names them."""
        view = memoryview(data).cast("B")
        name = blob_hash(view)
        self._blobs[name] = view
        return messages.BlobRef(len(view), name)

    def blob_bytes(self, reference: messages.BlobRef) -> Bytes:
        """Those that it names."""
        return self._blobs[reference.hash]

    def _next(self, kind: ObjectKind) -> int:
        self._numbers[kind] = self._numbers.get(kind, ATTACHED_FROM if self.is_attached else 0) + 1
        return self._numbers[kind]

    def _add(self, edit: Message) -> Object:
        key = self.set(edit)
        assert key is not None
        return key

    # ---- things that are seen

    def add_material(self, base_colour: Sequence[float] = (0.8, 0.8, 0.8, 1.0), *, textures: dict[int, Object] | None = None,
                     **values: Any) -> Object:
        """A material of glTF 2.0; `values` are fields of set_material (messages.SetMaterial). textures: {place: texture},
        0 base colour, 1 normal, 2 metallic and roughness, 4 emission; the others are listed there."""
        base = tuple(base_colour) + (1.0,) * (4 - len(base_colour))
        uses = []
        for place in range(max(textures, default=-1) + 1 if textures else 0):
            texture = textures.get(place) if textures else None
            uses.append(messages.TextureUse(texture.number if texture else 0, 0, (1, 0, 0, 0, 1, 0), 1))
        start = {"roughness": 0.5, "material": self._next(ObjectKind.MATERIAL), "base_colour": base, "textures": uses}
        return self._add(_make(messages.SetMaterial, {**start, **values}))

    def add_texture(self, image: Numbers, *, srgb: bool = True, **values: Any) -> Object:
        """Height x width (grey), x 3 or x 4: uint8, or floats of 0 .. 1. `srgb`: colours; False: data."""
        array = np.asarray(image)
        if array.ndim == 2:
            array = np.repeat(array[..., None], 3, axis=2)
        if array.ndim != 3 or array.shape[2] not in (3, 4):
            raise InvalidValue(f"has the shape {np.shape(image)} where (height, width[, 3 or 4]) belongs", field="image")
        if array.dtype.kind == "f":
            array = np.rint(np.clip(np.nan_to_num(array), 0, 1) * 255)
        elif array.dtype != np.uint8:
            raise InvalidValue(f"has {array.dtype} where uint8 or floats belong", field="image")
        texels = np.full(array.shape[:2] + (4,), 255, np.uint8)
        texels[..., :array.shape[2]] = array
        made = messages.TextureFormat.RGBA8_SRGB if srgb else messages.TextureFormat.RGBA8_LINEAR
        start = {"texture": self._next(ObjectKind.TEXTURE), "width": array.shape[1], "height": array.shape[0],
                 "format": made, "arrays": [self.blob(texels.tobytes())]}
        return self._add(_make(messages.SetTexture, {**start, **values}))

    def _ranges(self, material: Object | None, per_primitive: Numbers | None, count: int,
                field: str) -> list[messages.MaterialRange]:
        if per_primitive is None:
            return [messages.MaterialRange(0, count, material.number)] if material else []
        numbers = _array(per_primitive, "<u4", 1, field, count)[:, 0]
        edges = [0, *(int(at) + 1 for at in np.flatnonzero(np.diff(numbers))), count]
        return [messages.MaterialRange(first, end - first, int(numbers[first]))
                for first, end in zip(edges[:-1], edges[1:])]

    def add_mesh(self, positions: Numbers, triangles: Numbers | None = None, *, material: Object | None = None,
                 materials: Numbers | None = None, normals: Numbers | None = None, tangents: Numbers | None = None,
                 texcoords: Numbers | None = None, colours: Numbers | None = None, **values: Any) -> Object:
        """positions: n x 3. triangles: m x 3 indices, counter-clockwise where they are in front; None: each three
        positions are one. materials: the number of each triangle's material (Object.number), neighbours alike: at most
        4096 runs. normals n x 3, tangents n x 4, texcoords n x 2, colours n x 4 uint8, linear."""
        points = _array(positions, "<f4", 3, "positions")
        corners = _array(np.arange(len(points), dtype=np.uint32) if triangles is None else triangles, "<u4", 3, "triangles")
        if not len(points) or not len(corners):
            raise InvalidValue("is empty", field="positions" if not len(points) else "triangles")
        if int(corners.max()) >= len(points):
            raise InvalidValue(f"names vertex {corners.max()} of {len(points)}", field="triangles")
        given = [points, corners, None if normals is None else _array(normals, "<f4", 3, "normals", len(points)),
                 None if tangents is None else _array(tangents, "<f4", 4, "tangents", len(points)),
                 None if texcoords is None else _array(texcoords, "<f4", 2, "texcoords", len(points)), None,
                 None if colours is None else _array(colours, "|u1", 4, "colours", len(points))]
        while given[-1] is None:
            given.pop()
        arrays = [messages.BlobRef() if one is None else self.blob(one.data) for one in given]
        start = {"mesh": self._next(ObjectKind.MESH), "vertex_count": len(points), "triangle_count": len(corners),
                 "arrays": arrays, "ranges": self._ranges(material, materials, len(corners), "materials")}
        return self._add(_make(messages.SetMesh, {**start, **values}))

    def add_spheres(self, centres: Numbers, radii: Numbers, *, material: Object | None = None,
                    materials: Numbers | None = None, **values: Any) -> Object:
        """Exact spheres: centres n x 3, radii n or one for all."""
        points = _array(centres, "<f4", 3, "centres")
        sizes = np.broadcast_to(np.asarray(radii, dtype=np.float64).reshape(-1), len(points)) if np.size(radii) in (
            1, len(points)) else None
        if not len(points) or sizes is None or not (sizes > 0).all():
            raise InvalidValue(f"are not one positive number, or one for each of the {len(points)} centres", field="radii")
        packed = _array(np.column_stack((points, sizes)), "<f4", 4, "radii")
        start = {"spheres": self._next(ObjectKind.SPHERES), "sphere_count": len(points), "arrays": [self.blob(packed.data)],
                 "ranges": self._ranges(material, materials, len(points), "materials")}
        return self._add(_make(messages.SetSpheres, {**start, **values}))

    def add_disc(self, centre: Sequence[float], normal: Sequence[float], radius: float, *,
                 material: Object | None = None, **values: Any) -> Object:
        """A disc in world space, such as a ground."""
        length = math.hypot(*normal)
        if not length > 0:
            raise InvalidValue("has no length", field="normal")
        start = {"disc": self._next(ObjectKind.DISC), "material": material.number if material else 0, "centre_world": centre,
                 "normal_world": [one / length for one in normal], "radius": radius}
        return self._add(_make(messages.SetDisc, {**start, **values}))

    # ---- lights, cameras, places

    def add_light(self, kind: LightKind | str, colour: Sequence[float], transform: Numbers | None = None,
                  parent: Object | None = None, **values: Any) -> Object:
        """A light, and the node that places it, which is returned: scene.move(light, ...). The colour is power in the
        kind's unit: point and spot W/sr, directional W/m2, rectangle and sphere W/(m2 sr)."""
        start = {"light": self._next(ObjectKind.LIGHT), "kind": kind, "colour": colour}
        return self.add_node(self._add(_make(messages.SetLight, {**start, **values})), transform, parent=parent)

    def add_camera(self, fov_degrees: float = 40.0, transform: Numbers | None = None, parent: Object | None = None,
                   **values: Any) -> Object:
        """A camera of the scene, and the node that places it, which is returned: render(camera=node)."""
        start = {"camera": self._next(ObjectKind.CAMERA), "fov_y": math.radians(fov_degrees)}
        return self.add_node(self._add(_make(messages.SetCamera, {**start, **values})), transform, parent=parent)

    def add_node(self, shows: Object | None = None, transform: Numbers | None = None, *, parent: Object | None = None,
                 **values: Any) -> Object:
        """Puts something where it is seen; without `shows` a group."""
        if shows is not None and shows.kind not in _SHOWN:
            raise InvalidValue(f"a node cannot show a {shows.kind.word}", field="shows",
                               remedy="give a mesh, spheres, a light or a camera")
        if parent is not None and parent.kind != ObjectKind.NODE:
            raise InvalidValue("is no node", field="parent")
        start = {"node": self._next(ObjectKind.NODE), "parent": parent.number if parent else 0,
                 "kind": _SHOWN[shows.kind] if shows else NodeKind.GROUP, "object": shows.number if shows else 0,
                 "parent_from_node": _transform(transform)}
        return self._add(_make(messages.SetNode, {**start, **values}))

    def add_instances(self, shows: Object, transforms: Iterable[Numbers], parent: Object | None = None) -> list[Object]:
        """The same thing at many places: it is stored once."""
        return [self.add_node(shows, transform, parent=parent) for transform in transforms]

    def move(self, node: Object, transform: Numbers) -> None:
        """Another place for a node."""
        self.change(node, parent_from_node=_transform(transform))

    def set_environment(self, colour: Sequence[float] = (1, 1, 1), image: Numbers | None = None,
                        **values: Any) -> None:
        """Light from all around; image: height x width x 3 linear floats, equirectangular, rows from +y down."""
        start: dict[str, Any] = {"colour": colour}
        if image is not None:
            pixels = np.asarray(image, dtype=np.float32)
            if pixels.ndim != 3 or pixels.shape[2] != 3 or not np.isfinite(pixels).all():
                raise InvalidValue(f"has the shape {pixels.shape}, or NaN or infinity, where (height, width, 3) belongs",
                                   field="image")
            halves = np.zeros(pixels.shape[:2] + (4,), "<f2")
            halves[..., :3] = np.clip(pixels, 0, 65504)
            start.update(width=pixels.shape[1], height=pixels.shape[0], arrays=[self.blob(halves.tobytes())])
        self.set(_make(messages.SetEnvironment, {**start, **values}))

    # ---- for clients

    def edits_since(self, version: int) -> list[Message]:
        """What makes of the scene at that version this one."""
        gone = sorted((at, thing) for thing, (made, at) in self._removed.items() if made <= version < at)
        edits: list[Message] = [messages.Remove(thing.kind, thing.number) for _, thing in gone]
        named = {one.hash for _, edit in self._objects.values() for one in getattr(edit, "arrays", ())}
        self._blobs = {name: data for name, data in self._blobs.items() if name in named}
        return edits + [edit for at, edit in sorted(self._objects.values(), key=lambda one: one[0]) if at > version]

    def blobs_of(self, edits: Iterable[Message]) -> dict[bytes, Bytes]:
        """By their hashes: those that edits name."""
        named = (one for edit in edits for one in getattr(edit, "arrays", ()) if one.size_bytes)
        return {one.hash: self._blobs[one.hash] for one in named}


CameraOf = Union[Camera, Object, Sequence[Camera], None]


def request(camera: CameraOf, layers: Any, values: dict[str, Any]) -> messages.Render:
    """The message of a job. camera: one, a node of the scene that shows one, several as keys over time, or None: all of
    the scene is in view."""
    render: messages.Render = _make(messages.Render, values)
    if isinstance(camera, Object):
        render.camera_path, render.camera_node = messages.CameraPath.NODE, camera.number
    elif camera is not None:
        keys = [camera] if isinstance(camera, Camera) else list(camera)
        render.keys = [one.key() for one in keys]
        if render.camera_path == messages.CameraPath.AUTO:
            render.camera_path = messages.CameraPath.KEYS
    if layers:
        render.layers, render.format = layer_set(layers), messages.PixelFormat.RGBA32F
    try:
        raw = messages.Encoding.of(render.encoding) == messages.Encoding.RAW
    except ValueError:
        raw = False
    if not raw or render.attachments or render.parts or render.margin or render.hidden_layers:
        raise InvalidValue("frames come as raw pixels here, without attachments, parts and margins", field="render.encoding",
                           remedy="leave encoding, attachments, parts, margin and hidden_layers out")
    return render
