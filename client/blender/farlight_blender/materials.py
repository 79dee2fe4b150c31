# SPDX-License-Identifier: MIT
"""Blender's materials: the Principled BSDF and simpler ones, and image textures, in the terms of glTF 2.0."""
from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Optional

import bpy
import numpy as np
from farlight.messages import AlphaMode, ObjectKind, SetMaterial, TextureUse, Wrap

from . import images, nodes

if TYPE_CHECKING:
    from .mirror import Mirror

BASE_COLOUR, NORMAL, METALLIC_ROUGHNESS, EMISSION, BUMP = 0, 1, 2, 4, 6  # places in set_material.textures
# Blender's varnish of 1 mirrors a quarter of what Fresnel's equations say, until 4.0.
CLEARCOAT_SHARE = 0.25 if bpy.app.version < (4, 0) else 1.0
SHEEN_ROUGHNESS = 0.5  # of the fibres, where Blender's sheen has none
LEFT_OUT = ("Subsurface", "Subsurface Weight", "Anisotropic", "Specular Tint")  # inputs of the Principled BSDF
WRAPS = {"REPEAT": Wrap.REPEAT, "EXTEND": Wrap.CLAMP, "CLIP": Wrap.CLAMP, "MIRROR": Wrap.MIRROR}


@dataclass
class Material:
    """A material that meshes name, and what they must have for it."""
    number: int
    has_normal_map: bool = False
    colour_attribute: Optional[str] = None  # empty: the active one


@dataclass
class _Reading:
    """One material while it is read."""
    name: str
    values: dict[str, Any] = field(default_factory=dict)
    textures: dict[int, TextureUse] = field(default_factory=dict)
    colour_attribute: Optional[str] = None


def _uv_transform(mirror: Mirror, name: str, node: bpy.types.Node) -> tuple[float, ...]:
    """Rows (a b c), (d e f) of the protocol, of the Mapping node before an image."""
    start = nodes.source(node.inputs["Vector"])
    if start is None or start.node.type == "UVMAP" or (start.node.type == "TEX_COORD" and start.name == "UV"):
        return 1, 0, 0, 0, 1, 0
    if start.node.type != "MAPPING" or start.node.vector_type not in {"POINT", "TEXTURE"}:
        mirror.note(f"{name}: {node.name} takes its coordinates from the active UV map")
        return 1, 0, 0, 0, 1, 0
    inputs = start.node.inputs
    angle, (sx, sy) = inputs["Rotation"].default_value[2], inputs["Scale"].default_value[:2]
    shift = inputs["Location"].default_value[:2] if "Location" in inputs else (0, 0)
    turn = np.array(((math.cos(angle), -math.sin(angle)), (math.sin(angle), math.cos(angle))))
    made = np.eye(3)
    made[:2, :2], made[:2, 2] = turn * (sx, sy), shift
    if start.node.vector_type == "TEXTURE":
        made = np.linalg.inv(made)
    upside_down = np.array(((1, 0, 0), (0, -1, 1), (0, 0, 1)))  # v is counted from the top
    return tuple(float(one) for one in (upside_down @ made @ upside_down)[:2].ravel())


class Reader:
    """The materials of one update."""

    def __init__(self, mirror: Mirror) -> None:
        self._mirror = mirror
        self._made: dict[str, Material] = {}

    def material(self, material: Optional[bpy.types.Material]) -> Material:
        """That of a slot; None: the slot is empty."""
        name = material.name_full if material else ""
        if name not in self._made:
            self._made[name] = self._make(name, material)
        return self._made[name]

    def _make(self, name: str, material: Optional[bpy.types.Material]) -> Material:
        reading = _Reading(name)
        shader = nodes.surface(material.node_tree) if material and material.use_nodes and material.node_tree else None
        read = {"BSDF_PRINCIPLED": self._principled, "EMISSION": self._emission, "BSDF_DIFFUSE": self._diffuse,
                "BSDF_GLOSSY": self._glossy, "BSDF_GLASS": self._glass}.get(shader.type if shader else "")
        if shader is not None and read is not None:
            read(reading, shader)
        elif material is not None and shader is None and material.use_nodes:
            reading.values.update(base_colour=(0, 0, 0, 1), specular=0.0)  # no shader: black, as in Cycles
        elif material is not None:
            if shader is not None:
                self._mirror.note(f"{name}: the node {shader.name} is not known: the material's viewport colour is used")
            reading.values.update(base_colour=_in_range((*material.diffuse_color[:3], 1)), metallic=material.metallic,
                                  roughness=material.roughness)
        else:
            reading.values.update(roughness=1.0, specular=0.0)
        if material is not None and material.use_nodes and material.node_tree and nodes.has_volume(material.node_tree):
            self._mirror.note(f"{name}: its volume is not drawn: render it with Cycles")
        number = self._mirror.number(ObjectKind.MATERIAL, name)
        places = range(max(reading.textures, default=-1) + 1)
        uses = [reading.textures.get(place, TextureUse(0, 0, (1, 0, 0, 0, 1, 0), 1)) for place in places]
        values: dict[str, Any] = {"base_colour": (0.8, 0.8, 0.8, 1), **reading.values}
        self._mirror.scene.set(SetMaterial(material=number, double_sided=1, textures=uses, name=name[:100], **values))
        return Material(number, NORMAL in reading.textures, reading.colour_attribute)

    # ---- shaders

    def _principled(self, reading: _Reading, node: bpy.types.Node) -> None:
        values = reading.values
        transmission = min(max(nodes.number(nodes.first(node, "Transmission", "Transmission Weight")), 0), 1)
        level = nodes.number(nodes.first(node, "Specular", "Specular IOR Level"), 0.5)
        values["transmission"] = transmission
        # Blender's specular is F0 / 0.08; Cycles makes the index of refraction from it, but for glass.
        share = math.sqrt(min(max(0.08 * level, 0), 0.98))
        values["ior"] = max(nodes.number(node.inputs["IOR"]), 1.0) if transmission > 0 else min((1 + share) / (1 - share), 10.0)
        values["clearcoat"] = _share(nodes.number(nodes.first(node, "Clearcoat", "Coat Weight")) * CLEARCOAT_SHARE)
        values["clearcoat_roughness"] = _share(nodes.number(nodes.first(node, "Clearcoat Roughness", "Coat Roughness")))
        sheen = _share(nodes.number(nodes.first(node, "Sheen", "Sheen Weight")))
        if sheen > 0:
            values.update(sheen=(sheen,) * 3, sheen_roughness=SHEEN_ROUGHNESS)
        self._metallic_roughness(reading, node.inputs["Metallic"], node.inputs["Roughness"])
        self._base(reading, node.inputs["Base Color"], node.inputs["Alpha"])
        emission = nodes.first(node, "Emission", "Emission Color")
        if emission is not None:
            self._shine(reading, emission, nodes.number(node.inputs["Emission Strength"]))
        self._normal(reading, node.inputs["Normal"])
        for name in LEFT_OUT:
            socket = node.inputs.get(name)
            if socket is not None and socket.type == "VALUE" and (socket.is_linked or socket.default_value > 0):
                self._mirror.note(f"{reading.name}: {name} is left out")

    def _emission(self, reading: _Reading, node: bpy.types.Node) -> None:
        reading.values.update(base_colour=(0, 0, 0, 1), specular=0.0)
        self._shine(reading, node.inputs["Color"], nodes.number(node.inputs["Strength"]))

    def _diffuse(self, reading: _Reading, node: bpy.types.Node) -> None:
        reading.values.update(roughness=1.0, specular=0.0)
        self._base(reading, node.inputs["Color"], None)
        self._normal(reading, node.inputs["Normal"])

    def _glossy(self, reading: _Reading, node: bpy.types.Node) -> None:
        reading.values.update(metallic=1.0, roughness=_share(nodes.number(node.inputs["Roughness"])))
        self._base(reading, node.inputs["Color"], None)
        self._normal(reading, node.inputs["Normal"])

    def _glass(self, reading: _Reading, node: bpy.types.Node) -> None:
        reading.values.update(transmission=1.0, roughness=_share(nodes.number(node.inputs["Roughness"])),
                              ior=max(nodes.number(node.inputs["IOR"]), 1.0))
        self._base(reading, node.inputs["Color"], None)
        self._normal(reading, node.inputs["Normal"])

    # ---- inputs

    def _base(self, reading: _Reading, socket: bpy.types.NodeSocket, alpha: Optional[bpy.types.NodeSocket]) -> None:
        start, veil = nodes.source(socket), nodes.source(alpha)
        through = 1.0 if alpha is None or veil is not None else _share(nodes.number(alpha))
        colour, is_known = nodes.colour(socket)
        if start is not None and start.node.type == "TEX_IMAGE":
            is_cut = veil is not None and veil.node == start.node and veil.name == "Alpha"
            is_known = self._use(reading, BASE_COLOUR, start.node, has_alpha=is_cut)
            colour = (1, 1, 1) if is_known else colour
            if is_cut:
                reading.values["alpha_mode"], veil = AlphaMode.BLEND, None
        elif start is not None and start.node.type in {"VERTEX_COLOR", "ATTRIBUTE"}:
            is_attribute = start.node.type == "ATTRIBUTE"
            reading.colour_attribute = start.node.attribute_name if is_attribute else start.node.layer_name
            colour, is_known = (1, 1, 1), True
        if not is_known and start is not None:
            self._unknown(reading, socket, start)
        if veil is not None:
            self._unknown(reading, alpha, veil)
        reading.values["base_colour"] = _in_range((*colour, through))
        if through < 1:
            reading.values["alpha_mode"] = AlphaMode.BLEND

    def _shine(self, reading: _Reading, socket: bpy.types.NodeSocket, strength: float) -> None:
        """Cycles shows a surface of the strength 1 as white: it is radiance."""
        start = nodes.source(socket)
        colour, is_known = nodes.colour(socket)
        if strength > 0 and start is not None and start.node.type == "TEX_IMAGE":
            is_known = self._use(reading, EMISSION, start.node)
            colour = (1, 1, 1) if is_known else colour
        if not is_known and start is not None and strength > 0:
            self._unknown(reading, socket, start)
        reading.values["emission"] = tuple(min(max(one * strength, 0), 1e6) for one in colour)

    def _metallic_roughness(self, reading: _Reading, metallic: bpy.types.NodeSocket, roughness: bpy.types.NodeSocket) -> None:
        """One image of both: green and blue."""
        found = {"roughness": self._channel(reading, roughness), "metallic": self._channel(reading, metallic)}
        for name, socket in (("roughness", roughness), ("metallic", metallic)):
            reading.values[name] = 1.0 if found[name] is not None else _share(nodes.number(socket))
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

    def _channel(self, reading: _Reading, socket: bpy.types.NodeSocket) -> Optional[tuple[bpy.types.Node, Any, str]]:
        """The image that feeds a number: its node, its values and which channel they are."""
        start = nodes.source(socket)
        if start is None or start.node.type == "VALUE":
            return None
        name = start.name
        image = start
        if start.node.type in {"SEPRGB", "SEPARATE_COLOR"}:
            name = {"R": "Red", "G": "Green", "B": "Blue"}.get(name, name)
            image = nodes.source(start.node.inputs[0])
        if image is None or image.node.type != "TEX_IMAGE" or image.node.image is None:
            self._unknown(reading, socket, start)
            return None
        values = images.channel(image.node.image, name)
        if values is None:
            self._unread(reading, image.node)
            return None
        return image.node, values, name

    def _normal(self, reading: _Reading, socket: bpy.types.NodeSocket) -> None:
        start = nodes.source(socket)
        if start is None:
            return
        node = start.node
        if node.type == "NORMAL_MAP" and node.space == "TANGENT":
            place, picture, strength = NORMAL, nodes.source(node.inputs["Color"]), nodes.number(node.inputs["Strength"])
        elif node.type == "BUMP":
            place, picture = BUMP, nodes.source(node.inputs["Height"])
            strength = nodes.number(node.inputs["Strength"]) * nodes.number(node.inputs["Distance"]) * (-1 if node.invert else 1)
        else:
            self._unknown(reading, socket, start)
            return
        if picture is None or picture.node.type != "TEX_IMAGE":
            self._unknown(reading, socket, start)
            return
        self._use(reading, place, picture.node, strength=strength)

    # ---- textures

    def _use(self, reading: _Reading, place: int, node: bpy.types.Node, strength: float = 1.0, has_alpha: bool = False) -> bool:
        """An image at a place of the material; False: it cannot be read."""
        values = images.pixels(node.image) if node.image else None
        if values is None:
            self._unread(reading, node)
            return False
        texels = values if has_alpha else values[..., :3]
        key = (node.image.name_full, has_alpha)
        self._texture(reading, place, node, key, texels, images.is_srgb(node.image), strength)
        return True

    def _texture(self, reading: _Reading, place: int, node: bpy.types.Node, key: Hashable, texels: Any, is_srgb: bool,
                 strength: float = 1.0) -> None:
        full = (key, node.extension, node.interpolation)
        is_new = not self._mirror.is_seen(ObjectKind.TEXTURE, full)
        number = self._mirror.number(ObjectKind.TEXTURE, full)
        if is_new:
            wrap = WRAPS.get(node.extension, Wrap.REPEAT)
            self._mirror.scene.add_texture(texels, srgb=is_srgb, texture=number, wrap_u=wrap, wrap_v=wrap,
                                           nearest=int(node.interpolation == "Closest"))  # without its name, which is a file's
        reading.textures[place] = TextureUse(number, 0, _uv_transform(self._mirror, reading.name, node), strength)

    def _unknown(self, reading: _Reading, socket: bpy.types.NodeSocket, start: bpy.types.NodeSocket) -> None:
        self._mirror.note(f"{reading.name}: {socket.name} comes from {start.node.name}, which is not known: its own value is used")

    def _unread(self, reading: _Reading, node: bpy.types.Node) -> None:
        self._mirror.note(f"{reading.name}: the image of {node.name} cannot be read")


def _share(value: float) -> float:
    return min(max(value, 0.0), 1.0)


def _in_range(colour: Any) -> tuple[float, ...]:
    return tuple(_share(one) for one in colour)
