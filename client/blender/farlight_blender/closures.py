# SPDX-License-Identifier: MIT
"""Blender's shaders, and mixtures of them by Mix and Add Shader, also by a mask, as a single material of metal, dielectric and alpha.
A volume without a surface shows none: only its absorption is drawn.
"""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Optional

import bpy
import numpy as np

from . import nodes, shading
from .shading import Points

# Before 4.0, Blender's varnish of strength 1 mirrors a quarter of the light that Fresnel's equations give.
CLEARCOAT_SHARE = 0.25 if bpy.app.version < (4, 0) else 1.0
# Before 4.0, Blender's sheen, Schlick's weight of the angle between light and facet, reflects 1.2 % of uniform light. These
# fibres are the nearest, within 2 % of the light of three balls below a sky and a panel; the sheen of 4.0 is the protocol's.
IS_OLD_SHEEN = bpy.app.version < (4, 0)
SHEEN_SHARE, SHEEN_ROUGHNESS = (0.11, 0.34) if IS_OLD_SHEEN else (1.0, 0.5)
LEFT_OUT = ("Subsurface", "Subsurface Weight", "Anisotropic", "Specular Tint")  # inputs of the Principled BSDF that are ignored
PLAIN_IOR = 1.5
PLAIN_MIRROR = 0.04  # mirrored share of perpendicular light for that index
BLACK, WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
Constant = Any  # a number, or a tuple of three


@dataclass
class Value:
    """A number or a colour: the same everywhere (constant), `scale` times what feeds a socket, or else what at() says."""
    at: Callable[[Points], Any]
    constant: Optional[Constant] = None
    socket: Optional[nodes.Socket] = None
    scale: Constant = 1.0

    def same(self, other: Value) -> bool:
        if self.constant is not None or other.constant is not None:
            return self.constant == other.constant
        return self is other or self.socket is not None and self.socket == other.socket and self.scale == other.scale

    def unread(self) -> Constant:
        """The value of a socket."""
        return self.socket.default_value[:3] if self.socket is not None else WHITE

    def number(self) -> Optional[float]:
        """The constant as a number."""
        return self.constant if self.constant is None or isinstance(self.constant, float) else sum(self.constant) / 3


def constant(value: Constant) -> Value:
    return Value(lambda points: np.tile(np.array(value, np.float32), (len(points), *(1,) * np.ndim(value))), value)


def _with_width(one: Any, other: Any) -> tuple[Any, Any]:
    """Numbers beside colours."""
    return (one[:, None] if one.ndim < other.ndim else one), (other[:, None] if other.ndim < one.ndim else other)


def _joined(join: Callable[[Any, Any], Any], one: Value, other: Value) -> Value:
    if one.constant is not None and other.constant is not None:
        made = join(np.array(one.constant), np.array(other.constant))
        return constant(tuple(float(part) for part in made) if made.ndim else float(made))
    return Value(lambda points: join(*_with_width(one.at(points), other.at(points))))


def times(one: Value, other: Value) -> Value:
    for first, second in ((one, other), (other, one)):
        if first.constant == 1.0:
            return second
        if first.constant is not None and not np.any(first.constant):
            return first
        if first.constant is not None and second.socket is not None:
            made = np.array(first.constant) * np.array(second.scale)
            scale = tuple(float(part) for part in made) if made.ndim else float(made)
            return Value(lambda points: np.multiply(*_with_width(first.at(points), second.at(points))), socket=second.socket, scale=scale)
    return _joined(np.multiply, one, other)


def plus(one: Value, other: Value) -> Value:
    for first, second in ((one, other), (other, one)):
        if first.constant is not None and not np.any(first.constant):
            return second
    return _joined(np.add, one, other)


def rest(share: Value) -> Value:
    """1 - share."""
    return _joined(lambda one, other: one - other, constant(1.0), share)


def mixed(one: Value, other: Value, share: Value) -> Value:
    """Mixes two values: `share` of the other, the rest of the one."""
    if share.constant == 0.0 or one.same(other):
        return one
    if share.constant == 1.0 or one.constant == 0.0 and other.constant == 1.0:
        return other if share.constant == 1.0 else share
    return plus(times(rest(share), one), times(share, other))


@dataclass
class Closure:
    """A shader. kind: its role in mixtures. more: fields of set_material by name; MORE has the defaults."""
    kind: str
    base: Value = field(default_factory=lambda: constant((0.8, 0.8, 0.8)))
    alpha: Value = field(default_factory=lambda: constant(1.0))
    metallic: Value = field(default_factory=lambda: constant(0.0))
    roughness: Value = field(default_factory=lambda: constant(1.0))
    emission: Value = field(default_factory=lambda: constant(BLACK))
    normal: Optional[nodes.Socket] = None
    more: dict[str, Value] = field(default_factory=dict)

    def get(self, name: str) -> Value:
        return self.more.get(name, constant(MORE[name]))


MORE: dict[str, Constant] = {"specular": 1.0, "specular_colour": WHITE, "ior": PLAIN_IOR, "transmission": 0.0, "clearcoat": 0.0,
                             "clearcoat_roughness": 0.0, "sheen": BLACK, "sheen_roughness": SHEEN_ROUGHNESS, "diffuse_transmission": 0.0,
                             "diffuse_transmission_colour": WHITE}
NAMES = {"DIFFUSE": "Diffuse", "GLOSSY": "Glossy", "GLASS": "Glass", "REFRACTION": "Refraction", "TRANSLUCENT": "Translucent", "EMISSION": "Emission",
         "TRANSPARENT": "Transparent", "PRINCIPLED": "Principled"}


class Closures:
    """Reads the shaders of a material. note: called with missing features."""

    def __init__(self, note: Callable[[str], None]) -> None:
        self._note = note

    def of(self, node: nodes.Node) -> Optional[Closure]:
        """Reads a node; None: its type is unknown."""
        read: dict[str, Callable[[nodes.Node], Optional[Closure]]] = {"BSDF_PRINCIPLED": self._principled, "EMISSION": self._emission, "BSDF_DIFFUSE": self._diffuse, "BSDF_GLOSSY": self._glossy,
                "BSDF_GLASS": self._glass, "BSDF_REFRACTION": self._refraction, "BSDF_TRANSPARENT": self._transparent,
                "BSDF_TRANSLUCENT": self._translucent, "MIX_SHADER": self._mixture, "ADD_SHADER": self._sum}
        return read[node.type](node) if node.type in read else None

    # ---- values

    def value(self, socket: Optional[nodes.Socket], missing: float = 0.0) -> Value:
        """Reads an input."""
        if socket is None:
            return constant(missing)
        start = nodes.source(socket)
        own: Any = start if start is not None and start.node.type in {"VALUE", "RGB"} else socket
        given = own.default_value
        fixed: Constant = float(given) if isinstance(given, (int, float)) else tuple(float(one) for one in given[:3])
        if isinstance(fixed, float) != (socket.type == "VALUE"):
            fixed = sum(fixed) / 3 if isinstance(fixed, tuple) else (fixed,) * 3
        if start is None or own is start:
            return constant(fixed)
        name = socket.name
        if start.node.type in {"FRESNEL", "LAYER_WEIGHT"}:
            self._note(f"{name} depends on the view: its mean is used")
            return constant(shading.mean_of_view(start))

        fed: nodes.Socket = socket

        def at(points: Points) -> Any:
            try:
                return shading.value(fed, points)
            except shading.Unknown as unknown:
                self._note(f"{name} comes from the unsupported node {unknown}: its own value is used")
                return constant(fixed).at(points)
        if shading.is_constant(socket):
            first = at(shading.nowhere())[0]
            return constant(tuple(float(one) for one in first) if np.ndim(first) else float(first))
        return Value(at, socket=socket)

    # ---- shaders

    def _principled(self, node: nodes.Node) -> Closure:
        more = {"transmission": self.value(nodes.first(node, "Transmission", "Transmission Weight")),
                "clearcoat": times(self.value(nodes.first(node, "Clearcoat", "Coat Weight")), constant(CLEARCOAT_SHARE)),
                "clearcoat_roughness": self.value(nodes.first(node, "Clearcoat Roughness", "Coat Roughness"))}
        level = nodes.number(nodes.first(node, "Specular", "Specular IOR Level"), 0.5)
        # Blender's specular is F0 / 0.08; Cycles derives the index of refraction from it, except for glass.
        share = float(np.sqrt(min(max(0.08 * level, 0), 0.98)))
        is_glass = more["transmission"].constant != 0.0
        more["ior"] = constant(max(nodes.number(node.inputs["IOR"]), 1.0) if is_glass else min((1 + share) / (1 - share), 10.0))
        base = self.value(node.inputs["Base Color"])
        sheen = self.value(nodes.first(node, "Sheen", "Sheen Weight"))
        if sheen.constant != 0.0:
            more["sheen"] = times(times(sheen, self._sheen_colour(node, base)), constant((SHEEN_SHARE,) * 3))
            more["sheen_roughness"] = constant(SHEEN_ROUGHNESS) if IS_OLD_SHEEN else self.value(node.inputs["Sheen Roughness"])
        emission = nodes.first(node, "Emission", "Emission Color")
        shine = times(self.value(emission), self.value(node.inputs["Emission Strength"])) if emission is not None else constant(BLACK)
        for name in LEFT_OUT:
            socket = node.inputs.get(name)
            if socket is not None and socket.type == "VALUE" and (socket.is_linked or socket.default_value > 0):
                self._note(f"{name} is left out")
        return Closure("PRINCIPLED", base, self.value(node.inputs["Alpha"]), self.value(node.inputs["Metallic"]), self.value(node.inputs["Roughness"]),
                       shine, node.inputs["Normal"], more)

    def _sheen_colour(self, node: nodes.Node, base: Value) -> Value:
        """The sheen's colour: white, tinted by the base, and only where the surface is neither metal nor glass."""
        tint = self.value(node.inputs["Sheen Tint"])
        if not IS_OLD_SHEEN:
            return times(tint, constant(WHITE))
        given: Any = WHITE if base.constant is None else base.constant
        light = float(np.dot(given, shading.GREY))
        own = constant(tuple(float(one) / light for one in given) if light > 0 else WHITE)
        scattered = times(rest(self.value(node.inputs["Metallic"])), rest(self.value(node.inputs["Transmission"])))
        return times(mixed(constant(WHITE), own, tint), scattered)

    def _emission(self, node: nodes.Node) -> Closure:
        """Reads an emission. Cycles shows a surface of strength 1 as white: the strength is radiance."""
        shine = times(self.value(node.inputs["Color"]), self.value(node.inputs["Strength"]))
        return Closure("EMISSION", constant(BLACK), emission=shine, more={"specular": constant(0.0)})

    def _diffuse(self, node: nodes.Node) -> Closure:
        return Closure("DIFFUSE", self.value(node.inputs["Color"]), normal=node.inputs["Normal"], more={"specular": constant(0.0)})

    def _glossy(self, node: nodes.Node) -> Closure:
        return Closure("GLOSSY", self.value(node.inputs["Color"]), metallic=constant(1.0), roughness=self.value(node.inputs["Roughness"]),
                       normal=node.inputs["Normal"])

    def _glass(self, node: nodes.Node) -> Closure:
        return Closure("GLASS", self.value(node.inputs["Color"]), roughness=self.value(node.inputs["Roughness"]), normal=node.inputs["Normal"],
                       more={"transmission": constant(1.0), "ior": constant(max(nodes.number(node.inputs["IOR"]), 1.0))})

    def _refraction(self, node: nodes.Node) -> Closure:
        made = self._glass(node)
        return replace(made, kind="REFRACTION", more={**made.more, "specular": constant(0.0)})

    def _translucent(self, node: nodes.Node) -> Closure:
        colour = self.value(node.inputs["Color"])
        return Closure("TRANSLUCENT", constant(BLACK), normal=node.inputs["Normal"],
                       more={"specular": constant(0.0), "diffuse_transmission": constant(1.0), "diffuse_transmission_colour": colour})

    def _transparent(self, node: nodes.Node) -> Closure:
        colour = self.value(node.inputs["Color"])
        if colour.constant is None or min(colour.constant) < 0.999:
            self._note(f"the colour of {node.name} is left out: it is clear")
        return Closure("TRANSPARENT", alpha=constant(0.0))

    # ---- mixtures

    def _parts(self, node: nodes.Node) -> list[Closure]:
        """Reads the inputs of a mixture. An empty socket is black, as in Cycles."""
        made = []
        for socket in [one for one in node.inputs if one.type == "SHADER"]:
            start = nodes.source(socket)
            part = self.of(start.node) if start is not None else Closure("EMISSION", constant(BLACK), more={"specular": constant(0.0)})
            if part is not None:
                made.append(part)
            elif start is not None:
                self._note(f"the node {start.node.name} is unsupported and is left out of {node.name}")
        return made

    def _mixture(self, node: nodes.Node) -> Optional[Closure]:
        parts, start = self._parts(node), nodes.source(node.inputs["Fac"])
        if len(parts) < 2:
            return parts[0] if parts else None
        one, other = parts
        if start is not None and start.node.type in {"FRESNEL", "LAYER_WEIGHT"} and start.name != "Facing" and other.kind == "GLOSSY":
            made = _dielectric(one, other, shading.ior_of(start.node))
            if made is not None:
                return made
        return self._mix(node, one, other, self.value(node.inputs["Fac"]))

    def _mix(self, node: nodes.Node, one: Closure, other: Closure, share: Value) -> Closure:
        kept, taken = times(rest(share), one.alpha), times(share, other.alpha)
        alpha = mixed(one.alpha, other.alpha, share)
        if one.kind == "TRANSPARENT" or other.kind == "TRANSPARENT":
            return replace(other if one.kind == "TRANSPARENT" else one, alpha=taken if one.kind == "TRANSPARENT" else kept)
        if not one.alpha.same(other.alpha):
            share = Value(lambda points: taken.at(points) / np.maximum(alpha.at(points), 1e-6)) if alpha.constant is None else \
                constant(taken.constant / max(alpha.constant, 1e-6))
        emission = mixed(one.emission, other.emission, share)
        for first, second, weight in ((one, other, rest(share)), (other, one, share)):
            if second.kind == "EMISSION":
                more = {**first.more, **{name: times(first.get(name), weight) for name in ("specular", "clearcoat", "sheen")}}
                return replace(first, base=times(first.base, weight), alpha=alpha, emission=emission, more=more)
            if {one.kind, other.kind} == {"DIFFUSE", "GLOSSY"} and second.kind == "GLOSSY" and not first.base.same(second.base):
                made = _coated(first, second, rest(weight))
                if made is not None:
                    return replace(made, alpha=alpha, normal=self._normal(node, one, other, share))
        return self._blend(node, one, other, share, alpha)

    def _blend(self, node: nodes.Node, one: Closure, other: Closure, share: Value, alpha: Value) -> Closure:
        """Mixes the fields of two closures; a field that only one of them has is taken over."""
        if not one.metallic.same(other.metallic) and not one.base.same(other.base):
            made = _metal_over(one, other, share)
            if made is None:
                self._note(f"{node.name}: {NAMES[one.kind]} and {NAMES[other.kind]} have the mean of their colours")
            else:
                one, other = made
        more = {name: mixed(one.get(name), other.get(name), share) for name in {**one.more, **other.more}}
        roughness = mixed(one.roughness, other.roughness, share)
        base = mixed(one.base, other.base, share)
        for first, second in ((one, other), (other, one)):
            if first.get("specular").constant == 0.0 and first.kind != "REFRACTION":  # there is no lobe that roughness blurs
                roughness, more["ior"] = second.roughness, second.get("ior")
            for name, detail in (("clearcoat", "clearcoat_roughness"), ("diffuse_transmission", "diffuse_transmission_colour")):
                if first.get(name).constant == 0.0:
                    more[detail] = second.get(detail)
            if first.kind == "TRANSLUCENT":  # which has no base
                base = second.base
        return Closure(one.kind if one.kind == other.kind else "PRINCIPLED", base, alpha, mixed(one.metallic, other.metallic, share), roughness,
                       mixed(one.emission, other.emission, share), self._normal(node, one, other, share), more)

    def _normal(self, node: nodes.Node, one: Closure, other: Closure, share: Value) -> Optional[nodes.Socket]:
        starts = nodes.source(one.normal), nodes.source(other.normal)
        if starts[0] != starts[1] and None not in starts:
            self._note(f"{node.name}: its shaders have different normals: those of the heavier one are used")
        if starts[0] is None or starts[1] is None:
            return one.normal if starts[0] is not None else other.normal
        return other.normal if (share.number() or 0) > 0.5 else one.normal

    def _sum(self, node: nodes.Node) -> Optional[Closure]:
        parts = self._parts(node)
        if len(parts) < 2:
            return parts[0] if parts else None
        for first, second in (parts, parts[::-1]):
            if second.kind == "EMISSION" and first.kind != "TRANSPARENT":
                return replace(first, emission=plus(first.emission, second.emission))
            if first.kind == "DIFFUSE" and second.kind == "GLOSSY":
                made = _coated(first, second, constant(1.0))
                if made is not None:
                    return made
        one, other = parts
        if one.kind == other.kind == "DIFFUSE":
            return replace(one, base=plus(one.base, other.base), normal=self._normal(node, one, other, constant(0.0)))
        heavier = other if one.kind == "TRANSPARENT" else one
        self._note(f"{node.name} adds {NAMES[one.kind]} and {NAMES[other.kind]}: {NAMES[heavier.kind]} alone is shown")
        return heavier


def _coated(below: Closure, above: Closure, share: Value) -> Optional[Closure]:
    """Puts a mirror of this share over a scattering closure. None: the mirror's colour varies."""
    if share.constant is None or above.base.constant is None:
        return None
    colour = tuple(min(one / PLAIN_MIRROR, 1000.0) for one in above.base.constant)
    return replace(below, kind="PRINCIPLED", roughness=above.roughness,
                   more={**below.more, "ior": constant(PLAIN_IOR), "specular": share, "specular_colour": constant(colour)})


def _metal_over(one: Closure, other: Closure, share: Value) -> Optional[tuple[Closure, Closure]]:
    """Mixes a metal and a scattering closure, each of a single colour, as dielectrics with coloured mirrors: mirrored and
    scattered light are mixed separately, and both add up to the mixture's. None: a value is not constant."""
    if share.constant is None:
        return None
    parts = []
    for part in (one, other):
        given: list[Any] = [value.constant for value in (part.base, part.metallic, *map(part.get, ("specular", "ior", "transmission")))]
        base, metal, level, ior, glass = given
        if None in given or glass > 0:
            return None
        colour = np.array(base)
        above = (1 - metal) * level
        parts.append((metal * colour + above * ((ior - 1) / (ior + 1)) ** 2, (1 - metal) * colour, metal + above))
    mirrored, scattered, edge = (first + (second - first) * share.constant for first, second in zip(*parts))
    if edge <= 0:
        return None
    # Light that is not mirrored reaches the base, colour by colour
    below = np.clip(scattered / np.maximum(1 - mirrored, 1e-3), 0, 1).tolist()
    tint = np.clip(mirrored / edge / PLAIN_MIRROR, 0, 1000).tolist()
    more = {"ior": constant(PLAIN_IOR), "specular": constant(float(edge)), "specular_colour": constant(tuple(tint))}
    made = [replace(part, base=constant(tuple(below)), metallic=constant(0.0), more={**part.more, **more}) for part in (one, other)]
    return made[0], made[1]


def _dielectric(below: Closure, above: Closure, ior: float) -> Optional[Closure]:
    """Puts a mirror by Fresnel's equations over a closure. None: the closure's kind has no such mirror."""
    if below.kind not in {"DIFFUSE", "GLASS", "REFRACTION", "TRANSLUCENT"} or above.base.constant is None:
        return None
    more = {**below.more, "ior": constant(ior), "specular": constant(1.0), "specular_colour": above.base}
    return replace(below, kind="PRINCIPLED", roughness=above.roughness if below.kind != "GLASS" else below.roughness, more=more,
                   normal=below.normal if nodes.source(below.normal) else above.normal)
