# SPDX-License-Identifier: MIT
"""Blender's materials in the terms of glTF 2.0: closures as fields, images as textures, values of other nodes as baked
textures."""
from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Optional

import bpy
import numpy as np
from farlight.messages import AlphaMode, ObjectKind, SetMaterial, TextureUse, Wrap

from . import bake, closures, images, nodes, shading
from .closures import Closure, Value

if TYPE_CHECKING:
    from .mirror import Mirror

BASE_COLOUR, NORMAL, METALLIC_ROUGHNESS, EMISSION, BUMP = 0, 1, 2, 4, 6  # places in set_material.textures
UNLINKED = (1, 0, 0, 0, 1, 0)
WRAPS = {"REPEAT": Wrap.REPEAT, "EXTEND": Wrap.CLAMP, "CLIP": Wrap.CLAMP, "MIRROR": Wrap.MIRROR}
RANGES = {"specular_colour": 1000.0, "ior": 10.0}  # limits of fields that may exceed 1


@dataclass
class Material:
    """A material that meshes name, and what they must have for it."""
    number: int
    has_normal_map: bool = False
    colour_attribute: Optional[str] = None  # empty: the active one
    is_nothing: bool = False  # not drawn


@dataclass
class _Reading:
    """The state of reading a material."""
    name: str
    source: Optional[bpy.types.Material] = None
    surface: Optional[bake.Surface] = None
    slot: int = 0
    values: dict[str, Any] = field(default_factory=dict)
    textures: dict[int, TextureUse] = field(default_factory=dict)
    colour_attribute: Optional[str] = None
    is_own: bool = False  # belongs to a single mesh
    is_nothing: bool = False
    points: Optional[shading.Points] = None  # points for means


def _uv_transform(node: nodes.Node) -> Optional[tuple[float, ...]]:
    """Rows (a b c), (d e f) of the protocol for the Mapping node before an image. None: the image is not laid out by the active
    UV map."""
    start = nodes.source(node.inputs["Vector"])
    if start is None or start.node.type == "UVMAP" or (start.node.type == "TEX_COORD" and start.name == "UV"):
        return UNLINKED
    if start.node.type != "MAPPING" or start.node.vector_type not in {"POINT", "TEXTURE"}:
        return None
    inputs, before = start.node.inputs, nodes.source(start.node.inputs["Vector"])
    if any(inputs[name].is_linked for name in ("Rotation", "Scale", "Location") if name in inputs):
        return None
    if before is not None and before.node.type != "UVMAP" and not (before.node.type == "TEX_COORD" and before.name == "UV"):
        return None
    angle, (sx, sy) = inputs["Rotation"].default_value[2], inputs["Scale"].default_value[:2]
    shift = inputs["Location"].default_value[:2] if "Location" in inputs else (0, 0)
    turn = np.array(((math.cos(angle), -math.sin(angle)), (math.sin(angle), math.cos(angle))))
    made = np.eye(3)
    made[:2, :2], made[:2, 2] = turn * (sx, sy), shift
    if start.node.vector_type == "TEXTURE":
        made = np.linalg.inv(made)
    upside_down = np.array(((1, 0, 0), (0, -1, 1), (0, 0, 1)))  # v is counted from the top
    return tuple(float(one) for one in (upside_down @ made @ upside_down)[:2].ravel())


def _image_of(start: Optional[nodes.Socket]) -> Optional[nodes.Node]:
    """The node of an image that can be sent unchanged."""
    if start is None or start.node.type != "TEX_IMAGE" or start.node.projection != "FLAT" or _uv_transform(start.node) is None:
        return None
    return start.node


def _colour(constant: closures.Constant) -> Any:
    return (float(constant),) * 3 if isinstance(constant, (int, float)) else constant


class Reader:
    """The materials of an update."""

    def __init__(self, mirror: Mirror) -> None:
        self._mirror = mirror
        self._made: dict[Hashable, Material] = {}

    def material(self, material: Optional[bpy.types.Material], surface: Optional[bake.Surface] = None, slot: int = 0) -> Material:
        """The material of a mesh's slot; None: the slot is empty. Without a surface, values of unknown nodes are replaced by
        their mean."""
        name = material.name_full if material else ""
        own = (name, surface.key, slot) if surface else None
        for key in (name, own):
            if key in self._made:
                return self._made[key]
        reading = _Reading(name, material, surface, slot)
        self._read(reading)
        key = own if reading.is_own and own else name
        self._made[key] = self._send(reading, key)
        return self._made[key]

    def _send(self, reading: _Reading, key: Hashable) -> Material:
        number = self._mirror.number(ObjectKind.MATERIAL, key)
        places = range(max(reading.textures, default=-1) + 1)
        uses = [reading.textures.get(place, TextureUse(0, 0, UNLINKED, 1)) for place in places]
        values: dict[str, Any] = {"base_colour": (0.8, 0.8, 0.8, 1), **reading.values}
        self._mirror.scene.set(SetMaterial(material=number, double_sided=1, textures=uses, name=reading.name[:100], **values))
        return Material(number, NORMAL in reading.textures, reading.colour_attribute, reading.is_nothing)

    def _note(self, reading: _Reading, text: str) -> None:
        self._mirror.note(f"{reading.name}: {text}")

    def _read(self, reading: _Reading) -> None:
        material = reading.source
        if material is None:
            reading.values.update(roughness=1.0, specular=0.0)
            return
        tree = material.node_tree if material.use_nodes else None
        shader = nodes.surface(tree) if tree else None
        closure = closures.Closures(lambda text: self._note(reading, text)).of(shader) if shader else None
        volume = nodes.volume(tree) if tree else None
        if closure is not None:
            self._closure(reading, closure)
        elif tree is not None and shader is None:
            reading.values.update(base_colour=(0, 0, 0, 1), specular=0.0)  # no shader: black, as in Cycles
        else:
            if shader is not None:
                self._note(reading, f"the node {shader.name} is unsupported: the material's viewport colour is used")
            reading.values.update(base_colour=_in_range((*material.diffuse_color[:3], 1)), metallic=material.metallic,
                                  roughness=material.roughness)
        if volume is not None:
            is_seen = shader is not None and (closure is None or closure.kind != "TRANSPARENT" or closure.alpha.constant != 0.0)
            self._volume(reading, volume, is_seen)

    def _volume(self, reading: _Reading, node: nodes.Node, is_seen: bool) -> None:
        """Reads absorption as a body of glass, which without a surface neither mirrors nor refracts; other volumes are not
        drawn."""
        density = nodes.number(node.inputs["Density"]) if node.type == "VOLUME_ABSORPTION" and not node.inputs["Density"].is_linked else 0
        colour, is_known = nodes.colour(node.inputs["Color"]) if density > 0 else (closures.BLACK, False)
        if is_known and (not is_seen or reading.values.get("transmission", 0) > 0):
            if not is_seen:
                reading.values.update(base_colour=(1, 1, 1, 1), alpha_mode=AlphaMode.OPAQUE, transmission=1.0, ior=1.0, roughness=0.0, specular=0.0)
            reading.values["attenuation_distance"] = 1 / density
            for name, share in zip(("red", "green", "blue"), colour):
                reading.values[f"attenuation_{name}"] = math.exp(-max(1 - share, 0))
            if reading.surface is not None:
                reading.values["thickness"], reading.is_own = reading.surface.extent(), True
            return
        self._note(reading, "its volume is not drawn: render it with Cycles")
        reading.is_nothing = not is_seen

    # ---- fields

    def _closure(self, reading: _Reading, closure: Closure) -> None:
        self._base(reading, closure.base, closure.alpha)
        self._metallic_roughness(reading, closure.metallic, closure.roughness)
        self._shine(reading, closure.emission)
        self._normal(reading, closure.normal)
        for name, value in closure.more.items():
            made: Any = np.clip(self._mean(reading, value, name.replace("_", " ")), 1 if name == "ior" else 0, RANGES.get(name, 1)).tolist()
            if name in {"specular_colour", "diffuse_transmission_colour"}:
                colours = zip(("red", "green", "blue"), _colour(made))
                reading.values.update({f"{name.removesuffix('_colour')}_{one}": share for one, share in colours})
            else:
                reading.values[name] = _colour(made) if name == "sheen" else made

    def _points(self, reading: _Reading) -> shading.Points:
        if reading.points is None:
            reading.is_own = reading.surface is not None
            reading.points = reading.surface.samples(reading.slot) if reading.surface else None
            reading.points = reading.points or bake.anywhere()
        return reading.points

    def _mean(self, reading: _Reading, value: Value, name: str) -> closures.Constant:
        """Reduces a value to one number or colour."""
        if value.constant is not None:
            return value.constant
        self._note(reading, f"its {name} is the mean of its nodes' result")
        made = value.at(self._points(reading)).mean(axis=0)
        return tuple(float(one) for one in made) if made.ndim else float(made)

    def _picture(self, reading: _Reading, place: int, values: tuple[Value, ...], pack: Callable[..., Any]) -> Optional[Any]:
        """Bakes values at each texel into a texture of 0 .. 1, and returns the remaining factors. None: no texture is possible."""
        surface, material = reading.surface, reading.source
        if surface is None or material is None:
            return None
        reading.is_own, size = True, bake.size_for(material.original.users)
        told = surface.digest, bake.digest_of(material.node_tree, images.digest), size, reading.slot, str(place)
        key = reading.name, surface.key, reading.slot, place

        def make() -> Any:
            assert surface is not None
            picture, before = surface.picture(reading.slot, size), len(self._mirror.notes)
            return picture and (*pack(*(picture.filled(value.at(picture.points)) for value in values)), picture.transform, self._mirror.notes[before:])
        made = self._mirror.remembered(key, told, make)
        if made is None:
            self._note(reading, "a mesh without a UV map has the mean of its nodes' result")
            return None
        texels, left, transform, notes = made
        for note in notes:
            self._mirror.note(note)
        self._note(reading, f"the result of its nodes is baked into pictures of {size} x {size} texels")
        number = self._mirror.number(ObjectKind.TEXTURE, ("baked", *key))
        self._mirror.scene.add_texture(texels, srgb=place in {BASE_COLOUR, EMISSION}, texture=number, wrap_u=Wrap.CLAMP, wrap_v=Wrap.CLAMP)
        reading.textures[place] = TextureUse(number, 0, transform, 1)
        return left

    def _base(self, reading: _Reading, base: Value, alpha: Value) -> None:
        """The colour, and the alpha."""
        start, veil = nodes.source(base.socket), nodes.source(alpha.socket)
        colour, through, image = _colour(base.constant), alpha.constant, _image_of(start)
        is_cut = veil is not None and image is not None and veil.node == image and veil.name == "Alpha" and alpha.scale == 1.0
        painted = start.node if start is not None and start.node.type in {"VERTEX_COLOR", "ATTRIBUTE"} and start.name == "Color" else None
        if image is not None and (through is not None or is_cut):
            is_there = self._use(reading, BASE_COLOUR, image, has_alpha=is_cut)
            colour = _colour(base.scale) if is_there else base.unread()
            through = 1.0 if is_cut else through
        elif painted is not None and through is not None:
            reading.colour_attribute = painted.attribute_name if painted.type == "ATTRIBUTE" else painted.layer_name
            colour = _colour(base.scale)
        elif colour is None or through is None:
            colour, through, is_cut = self._baked_base(reading, base, alpha)
        reading.values["base_colour"] = _in_range((*(colour or closures.WHITE), through))
        if is_cut or through is not None and through < 1:
            reading.values["alpha_mode"] = AlphaMode.BLEND

    def _baked_base(self, reading: _Reading, base: Value, alpha: Value) -> tuple[Any, Any, bool]:
        """The factors of a picture of both, and whether it has alpha."""
        colour, through, is_cut = _colour(base.constant), alpha.constant, alpha.constant is None

        def pack(colours: Any, veil: Any) -> Any:
            scale = (1.0,) * 3 if colour is None else colour
            texels = colours if colour is None else np.ones_like(colours)
            return _coded(np.dstack((texels, veil)) if is_cut else texels), scale
        scale = self._picture(reading, BASE_COLOUR, (base if colour is None else closures.constant(colour), alpha), pack)
        if scale is not None:
            return scale, 1.0 if is_cut else through, is_cut
        colour = _colour(self._mean(reading, base, "colour")) if colour is None else colour
        return colour, self._mean(reading, alpha, "alpha"), False

    def _shine(self, reading: _Reading, emission: Value) -> None:
        colour, image = _colour(emission.constant), _image_of(nodes.source(emission.socket))
        if image is not None:
            colour = _colour(emission.scale) if self._use(reading, EMISSION, image) else (0.0, 0.0, 0.0)
        elif colour is None:
            def pack(shine: Any) -> Any:
                most = max(float(shine.max()), 1e-6)
                return _coded(np.clip(shine, 0, None) / most), (most,) * 3
            colour = self._picture(reading, EMISSION, (emission,), pack) or _colour(self._mean(reading, emission, "emission"))
        reading.values["emission"] = tuple(min(max(one, 0), 1e6) for one in colour or closures.BLACK)

    def _metallic_roughness(self, reading: _Reading, metallic: Value, roughness: Value) -> None:
        """Combines both in one image: green and blue."""
        values = {"roughness": roughness, "metallic": metallic}
        found = {name: self._channel(reading, value) for name, value in values.items()}
        is_plain = {name: value.constant is not None or found[name] is not None for name, value in values.items()}
        if not all(is_plain.values()):
            def pack(rough: Any, metal: Any) -> Any:
                return np.clip(np.dstack((np.ones_like(rough), rough, metal)), 0, 1), True
            is_baked = self._picture(reading, METALLIC_ROUGHNESS, (roughness, metallic), pack)
            reading.values.update({name: 1.0 if is_baked else _share(self._mean(reading, value, name)) for name, value in values.items()})
            return
        for name, value in values.items():
            reading.values[name] = _share(value.constant if found[name] is None else value.scale)
        given = [one for one in found.values() if one is not None]
        if not given:
            return
        size = max((one[1].shape for one in given), key=math.prod)
        packed = np.ones((*size, 3), np.float32)
        for place, one in ((1, found["roughness"]), (2, found["metallic"])):
            if one is not None:
                rows, columns = (np.arange(to) * have // to for to, have in zip(size, one[1].shape))
                packed[..., place] = one[1][rows[:, None], columns]
        key = ("packed", *(one and (one[0].image.name_full, one[2]) for one in found.values()))
        self._texture(reading, METALLIC_ROUGHNESS, given[0][0], key, packed, is_srgb=False)

    def _channel(self, reading: _Reading, value: Value) -> Optional[tuple[nodes.Node, Any, str]]:
        """The image that feeds a number: its node, its values, and their channel."""
        start = nodes.source(value.socket)
        if start is None or not isinstance(value.scale, float):
            return None
        name = start.name
        image: Optional[nodes.Socket] = start
        if start.node.type in {"SEPRGB", "SEPARATE_COLOR"}:
            name = {"R": "Red", "G": "Green", "B": "Blue"}.get(name, name)
            image = nodes.source(start.node.inputs[0])
        node = _image_of(image)
        if node is None or node.image is None:
            return None
        values = images.channel(node.image, name)
        if values is None:
            self._unread(reading, node)
            return None
        return node, values, name

    def _normal(self, reading: _Reading, socket: Optional[nodes.Socket]) -> None:
        start = nodes.source(socket)
        if start is None or socket is None:
            return
        node = start.node
        if node.type == "NORMAL_MAP" and node.space == "TANGENT":
            picture = _image_of(nodes.source(node.inputs["Color"]))
            if picture is not None:
                self._use(reading, NORMAL, picture, strength=nodes.number(node.inputs["Strength"]))
                return
        elif node.type == "BUMP":
            self._bump(reading, node)
            return
        self._note(reading, f"{socket.name} comes from the unsupported node {start.node.name}: its own value is used")

    def _bump(self, reading: _Reading, node: nodes.Node) -> None:
        strength = nodes.number(node.inputs["Strength"]) * nodes.number(node.inputs["Distance"]) * (-1 if node.invert else 1)
        picture = _image_of(nodes.source(node.inputs["Height"]))
        if picture is not None:
            self._use(reading, BUMP, picture, strength=strength)
            return
        height = closures.Closures(lambda text: self._note(reading, text)).value(node.inputs["Height"])
        if height.constant is not None:
            return

        def pack(heights: Any) -> Any:
            low, high = float(heights.min()), float(heights.max())
            return (heights - low) / max(high - low, 1e-9), high - low
        span = self._picture(reading, BUMP, (height,), pack)
        if span is not None:
            reading.textures[BUMP].strength = strength * span

    # ---- textures

    def _use(self, reading: _Reading, place: int, node: nodes.Node, strength: float = 1.0, has_alpha: bool = False) -> bool:
        """Puts an image at a place of the material; False: it cannot be read."""
        values = images.pixels(node.image) if node.image else None
        if values is None:
            self._unread(reading, node)
            return False
        texels = values if has_alpha else values[..., :3]
        key = (node.image.name_full, has_alpha)
        self._texture(reading, place, node, key, texels, images.is_srgb(node.image), strength)
        return True

    def _texture(self, reading: _Reading, place: int, node: nodes.Node, key: Hashable, texels: Any, is_srgb: bool,
                 strength: float = 1.0) -> None:
        full = (key, node.extension, node.interpolation)
        is_new = not self._mirror.is_seen(ObjectKind.TEXTURE, full)
        number = self._mirror.number(ObjectKind.TEXTURE, full)
        if is_new:
            wrap = WRAPS.get(node.extension, Wrap.REPEAT)
            self._mirror.scene.add_texture(texels, srgb=is_srgb, texture=number, wrap_u=wrap, wrap_v=wrap,
                                           nearest=int(node.interpolation == "Closest"))  # no name, as it would be a file's
        reading.textures[place] = TextureUse(number, 0, _uv_transform(node) or UNLINKED, strength)

    def _unread(self, reading: _Reading, node: nodes.Node) -> None:
        self._note(reading, f"the image of {node.name} cannot be read")


def _coded(texels: Any) -> Any:
    """Converts linear colours to sRGB; alpha stays."""
    made = np.clip(texels, 0, 1)
    made[..., :3] = images.from_linear(made[..., :3])
    return made


def _share(value: float) -> float:
    return min(max(value, 0.0), 1.0)


def _in_range(colour: Any) -> tuple[float, ...]:
    return tuple(_share(one) for one in colour)
