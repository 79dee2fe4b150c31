# SPDX-License-Identifier: MIT
"""Values of Blender's colour and number nodes at many points of a surface, where no field of a material can express them."""
from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Optional

import bpy
import numpy as np

from . import images, nodes, procedural

GREY = np.array((0.2126, 0.7152, 0.0722), np.float32)
RAMP_STEPS = 1024


class Unknown(Exception):
    """A node of an unknown type, which is the text."""


@dataclass
class Points:
    """Points of a surface. Arrays are n x 3, except `uv`, n x 2 with Blender's v, counted from below."""
    uv: Optional[Any]
    generated: Any
    place: Any
    normal: Any
    colours: Callable[[str], Any]  # values of a colour attribute; None: there is none
    made: dict[Any, Any] = field(default_factory=dict)  # results of nodes

    def __len__(self) -> int:
        return len(self.place)


def value(socket: nodes.Socket, points: Points) -> Any:
    """Values of an input: n numbers, or n x 3 for a colour or a vector."""
    start = nodes.source(socket)
    if start is None:
        if socket.type == "VALUE":
            return np.full(len(points), socket.default_value, np.float32)
        return np.tile(np.array(socket.default_value[:3], np.float32), (len(points), 1))
    if start not in points.made:
        points.made[start] = _node(start.node, start, points)
    return _as(points.made[start], start.type, socket.type)


def _as(values: Any, made: str, wanted: str) -> Any:
    if wanted == "VALUE" and values.ndim == 2:
        return values @ GREY if made == "RGBA" else values.mean(axis=1)
    if wanted != "VALUE" and values.ndim == 1:
        return np.repeat(values[:, None], 3, axis=1)
    return values


def _node(node: nodes.Node, output: nodes.Socket, points: Points) -> Any:
    made = READ.get(node.type)
    if made is None:
        raise Unknown(node.name)
    with np.errstate(all="ignore"):
        values = made(node, output, points)
    return np.nan_to_num(np.asarray(values, np.float32), posinf=0.0, neginf=0.0)


def _mean(node: nodes.Node, name: str, points: Points) -> float:
    return float(value(node.inputs[name], points).mean())


# ---- where

def _uv(points: Points) -> Any:
    if points.uv is None:
        return np.zeros((len(points), 3), np.float32)
    return np.column_stack((points.uv, np.zeros(len(points), np.float32)))


def _coordinate(node: nodes.Node, output: nodes.Socket, points: Points) -> Any:
    made = {"Generated": points.generated, "UV": _uv(points), "Object": points.place, "Normal": points.normal}
    if output.identifier not in made or node.object is not None:
        raise Unknown(f"{output.name} of {node.name}")
    return made[output.identifier]


def _mapping(node: nodes.Node, _: nodes.Socket, points: Points) -> Any:
    given = value(node.inputs["Vector"], points)
    shift, turn, scale = (np.array([_axis(node.inputs[name], axis, points) if name in node.inputs else 0 for axis in range(3)])
                          for name in ("Location", "Rotation", "Scale"))
    if node.vector_type not in {"POINT", "VECTOR", "TEXTURE"}:
        raise Unknown(f"{node.vector_type.title()} of {node.name}")
    (cx, cy, cz), (sx, sy, sz) = np.cos(turn), np.sin(turn)
    turned = (np.array(((cz, -sz, 0), (sz, cz, 0), (0, 0, 1))) @ np.array(((cy, 0, sy), (0, 1, 0), (-sy, 0, cy))) @
              np.array(((1, 0, 0), (0, cx, -sx), (0, sx, cx))))
    if node.vector_type == "TEXTURE":
        return (given - shift) @ turned / np.where(scale == 0, 1, scale)
    return (given * scale) @ turned.T + (shift if node.vector_type == "POINT" else 0)


def _axis(socket: nodes.Socket, axis: int, points: Points) -> float:
    return float(value(socket, points)[:, axis].mean())


def _where(node: nodes.Node, points: Points, scale: bool = True) -> Any:
    """The coordinates in a texture."""
    socket = node.inputs["Vector"]
    place = value(socket, points) if socket.is_linked or node.type == "TEX_WHITE_NOISE" else points.generated
    dimensions = getattr(node, "noise_dimensions", None) or getattr(node, "voronoi_dimensions", "3D")
    if dimensions in {"1D", "4D"}:
        depth = value(node.inputs["W"], points)
        place = np.column_stack((depth, depth * 0, depth * 0)) if dimensions == "1D" else place + depth[:, None]
    elif dimensions == "2D":
        place = place * (1, 1, 0)
    return place * value(node.inputs["Scale"], points)[:, None] if scale else place


# ---- textures

def _image(node: nodes.Node, output: nodes.Socket, points: Points) -> Any:
    picture = images.pixels(node.image) if node.image else None
    if picture is None or node.projection != "FLAT":
        raise Unknown(node.name)
    place = value(node.inputs["Vector"], points) if node.inputs["Vector"].is_linked else _uv(points)
    height, width = picture.shape[:2]
    at = np.stack((place[:, 0] * width - 0.5, (1 - place[:, 1]) * height - 0.5), axis=-1)
    if node.interpolation == "Closest":
        at = np.rint(at)
    low = np.floor(at).astype(np.int64)
    part, total = at - low, np.zeros((len(points), 4))
    for x, y in np.ndindex(2, 2):
        columns, rows = ((low[:, axis] + step) for axis, step in ((0, x), (1, y)))
        share = (part[:, 0] if x else 1 - part[:, 0]) * (part[:, 1] if y else 1 - part[:, 1])
        texels = picture[_wrapped(rows, height, node.extension), _wrapped(columns, width, node.extension)]
        if node.extension == "CLIP":
            texels = texels * ((columns >= 0) & (columns < width) & (rows >= 0) & (rows < height))[:, None]
        total += share[:, None] * texels
    if output.identifier == "Alpha":
        return total[:, 3]
    return images.to_linear(total[:, :3]) if images.is_srgb(node.image) else total[:, :3]


def _wrapped(at: Any, size: int, extension: str) -> Any:
    if extension == "MIRROR":
        at = at % (2 * size)
        return np.minimum(at, 2 * size - 1 - at)
    return at % size if extension == "REPEAT" else np.clip(at, 0, size - 1)


def _noise(node: nodes.Node, output: nodes.Socket, points: Points) -> Any:
    detail, roughness, distortion = (_mean(node, name, points) for name in ("Detail", "Roughness", "Distortion"))
    made = procedural.noise(_where(node, points), detail, roughness, distortion, output.identifier == "Color")
    return made if output.identifier == "Color" else made[:, 0]


def _white(node: nodes.Node, output: nodes.Socket, points: Points) -> Any:
    made = procedural.white_noise(_where(node, points, scale=False))
    return made if output.identifier == "Color" else made[:, 0]


def _voronoi(node: nodes.Node, output: nodes.Socket, points: Points) -> Any:
    randomness = min(max(_mean(node, "Randomness", points), 0), 1)
    if node.feature == "DISTANCE_TO_EDGE":
        return procedural.voronoi_edge(_where(node, points), randomness)
    if node.feature not in {"F1", "F2", "SMOOTH_F1"} or output.identifier not in {"Distance", "Color", "Position"}:
        raise Unknown(f"{output.name} of {node.name}")
    distance, colour, place = procedural.voronoi(_where(node, points), randomness, node.distance, max(_mean(node, "Exponent", points), 0.01),
                                                 node.feature == "F2")
    if output.identifier == "Position":
        return place / value(node.inputs["Scale"], points)[:, None]
    return colour if output.identifier == "Color" else distance


def _checker(node: nodes.Node, output: nodes.Socket, points: Points) -> Any:
    first = procedural.checker(_where(node, points))
    if output.identifier == "Fac":
        return first
    one, other = (value(node.inputs[name], points) for name in ("Color1", "Color2"))
    return np.where(first[:, None] > 0, one, other)


def _brick(node: nodes.Node, output: nodes.Socket, points: Points) -> Any:
    names = ("Brick Width", "Row Height", "Mortar Size", "Mortar Smooth", "Bias")
    width, height, size, smooth, bias = (_mean(node, name, points) for name in names)
    tint, mortar = procedural.brick(_where(node, points), (max(width, 1e-6), max(height, 1e-6)), (size, smooth), bias,
                                    (node.offset, node.offset_frequency), (node.squash, node.squash_frequency))
    if output.identifier == "Fac":
        return mortar
    first, second, between = (value(node.inputs[name], points) for name in ("Color1", "Color2", "Mortar"))
    bricks = first + (second - first) * tint[:, None]
    return bricks + (between - bricks) * mortar[:, None]


def _gradient(node: nodes.Node, output: nodes.Socket, points: Points) -> Any:
    made = np.clip(procedural.gradient(_where(node, points, scale=False), node.gradient_type), 0, 1)
    return _as(made, "VALUE", output.type)


def _wave(node: nodes.Node, output: nodes.Socket, points: Points) -> Any:
    direction = node.bands_direction if node.wave_type == "BANDS" else node.rings_direction
    much, detail, scale, roughness, phase = (_mean(node, name, points) for name in ("Distortion", "Detail", "Detail Scale", "Detail Roughness",
                                                                                    "Phase Offset"))
    made = procedural.wave(_where(node, points), node.wave_type, direction, node.wave_profile, (much, detail, scale, roughness), phase)
    return _as(made, "VALUE", output.type)


def _magic(node: nodes.Node, output: nodes.Socket, points: Points) -> Any:
    made = procedural.magic(_where(node, points), node.turbulence_depth, _mean(node, "Distortion", points))
    return made if output.identifier == "Color" else made.mean(axis=1)


# ---- colours

def _ramp(node: nodes.Node, output: nodes.Socket, points: Points) -> Any:
    ramp = node.color_ramp
    colours = np.array([ramp.evaluate(step / (RAMP_STEPS - 1)) for step in range(RAMP_STEPS)], np.float32)
    at = np.clip(value(node.inputs["Fac"], points), 0, 1) * (RAMP_STEPS - 1)
    low = np.minimum(at.astype(np.int64), RAMP_STEPS - 2)
    part = (at - low)[:, None] if ramp.interpolation != "CONSTANT" else np.rint(at - low)[:, None]
    made = colours[low] * (1 - part) + colours[low + 1] * part
    return made[:, 3] if output.identifier == "Alpha" else made[:, :3]


def _blended(kind: str, share: Any, a: Any, b: Any) -> Any:
    one: dict[str, Callable[[], Any]] = {
        "MIX": lambda: b, "ADD": lambda: a + b, "SUBTRACT": lambda: a - b, "MULTIPLY": lambda: a * b, "DARKEN": lambda: np.minimum(a, b),
        "LIGHTEN": lambda: np.maximum(a, b), "DIFFERENCE": lambda: np.abs(a - b), "SCREEN": lambda: 1 - (1 - a) * (1 - b),
        "DIVIDE": lambda: np.where(b != 0, a / b, a), "OVERLAY": lambda: np.where(a < 0.5, 2 * a * b, 1 - 2 * (1 - a) * (1 - b)),
        "SOFT_LIGHT": lambda: (1 - a) * b * a + a * (1 - (1 - b) * (1 - a)), "LINEAR_LIGHT": lambda: a + 2 * b - 1,
        "EXCLUSION": lambda: a + b - 2 * a * b}
    if kind not in one:
        raise Unknown(kind.replace("_", " ").title())
    return a + (one[kind]() - a) * share


def _mix(node: nodes.Node, _: nodes.Socket, points: Points) -> Any:
    by_name = {one.identifier: one for one in node.inputs}
    if node.type == "MIX_RGB":
        share, a, b = (value(by_name[name], points) for name in ("Fac", "Color1", "Color2"))
        made = _blended(node.blend_type, np.clip(share, 0, 1)[:, None], a, b)
        return np.clip(made, 0, 1) if node.use_clamp else made
    kind = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color"}.get(node.data_type)
    if kind is None:
        raise Unknown(node.name)
    a, b = (value(by_name[f"{one}_{kind}"], points) for one in "AB")
    is_uniform = kind != "Vector" or node.factor_mode == "UNIFORM"
    share = value(by_name["Factor_Float" if is_uniform else "Factor_Vector"], points)
    share = np.clip(share, 0, 1) if node.clamp_factor else share
    share = share[:, None] if a.ndim == 2 and is_uniform else share
    made = _blended(node.blend_type, share, a, b) if kind == "Color" else a + (b - a) * share
    return np.clip(made, 0, 1) if kind == "Color" and node.clamp_result else made


def _hsv(colour: Any) -> Any:
    most, least = colour.max(axis=1), colour.min(axis=1)
    span = most - least
    r, g, b = colour.T
    hue = np.select([r == most, g == most], [(g - b) / span, 2 + (b - r) / span], 4 + (r - g) / span) / 6 % 1
    return np.stack((np.where(span == 0, 0, hue), np.where(most == 0, 0, span / most), most), axis=-1)


def _from_hsv(colour: Any) -> Any:
    hue, saturation, most = colour.T
    shares = np.clip(np.abs((hue[:, None] * 6 + (0, 4, 2)) % 6 - 3) - 1, 0, 1)
    return most[:, None] * (1 - saturation[:, None] * (1 - shares))


def _hue(node: nodes.Node, _: nodes.Socket, points: Points) -> Any:
    colour = value(node.inputs["Color"], points)
    hue, saturation, most, share = (value(node.inputs[name], points) for name in ("Hue", "Saturation", "Value", "Fac"))
    made = _hsv(colour)
    made = np.stack(((made[:, 0] + hue + 0.5) % 1, np.clip(made[:, 1] * saturation, 0, 1), made[:, 2] * most), axis=-1)
    return colour + (np.clip(_from_hsv(made), 0, None) - colour) * share[:, None]


def _bright(node: nodes.Node, _: nodes.Socket, points: Points) -> Any:
    colour, bright, contrast = (value(node.inputs[name], points) for name in ("Color", "Bright", "Contrast"))
    return np.clip((1 + contrast)[:, None] * colour + (bright - contrast / 2)[:, None], 0, None)


def _invert(node: nodes.Node, _: nodes.Socket, points: Points) -> Any:
    colour = value(node.inputs["Color"], points)
    return colour + (1 - 2 * colour) * value(node.inputs["Fac"], points)[:, None]


def _gamma(node: nodes.Node, _: nodes.Socket, points: Points) -> Any:
    colour = value(node.inputs["Color"], points)
    return np.where(colour > 0, np.abs(colour) ** value(node.inputs["Gamma"], points)[:, None], colour)


def _curves(node: nodes.Node, _: nodes.Socket, points: Points) -> Any:
    colour, mapping = value(node.inputs["Color"], points), node.mapping
    mapping.initialize()
    steps = np.linspace(0, 1, RAMP_STEPS // 4 + 1)
    common, *own = ([mapping.evaluate(mapping.curves[place], float(step)) for step in steps] for place in (3, 0, 1, 2))
    made = np.stack([np.interp(np.interp(colour[:, axis], steps, common), steps, own[axis]) for axis in range(3)], axis=-1)
    return colour + (made - colour) * value(node.inputs["Fac"], points)[:, None]


def _separate(node: nodes.Node, output: nodes.Socket, points: Points) -> Any:
    if getattr(node, "mode", "RGB") == "HSL":
        raise Unknown(node.name)
    values = value(node.inputs[0], points)
    if getattr(node, "mode", "RGB") == "HSV":
        values = _hsv(values)
    return values[:, list(node.outputs).index(output)]


def _combine(node: nodes.Node, _: nodes.Socket, points: Points) -> Any:
    if getattr(node, "mode", "RGB") == "HSL":
        raise Unknown(node.name)
    values = np.stack([value(one, points) for one in node.inputs[:3]], axis=-1)
    return _from_hsv(values) if getattr(node, "mode", "RGB") == "HSV" else values


def _attribute(node: nodes.Node, output: nodes.Socket, points: Points) -> Any:
    name = node.attribute_name if node.type == "ATTRIBUTE" else node.layer_name
    made = points.colours(name)
    if made is None or output.name not in {"Color", "Fac"}:
        raise Unknown(node.name)
    return _as(made, "RGBA", output.type)


# ---- numbers

MATHS: dict[str, Callable[..., Any]] = {
    "ADD": lambda a, b, c: a + b, "SUBTRACT": lambda a, b, c: a - b, "MULTIPLY": lambda a, b, c: a * b,
    "DIVIDE": lambda a, b, c: np.where(b != 0, a / b, 0), "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b, c: np.where(a >= 0, np.abs(a) ** b, np.where(b == np.rint(b), np.sign(a) ** np.abs(b) * np.abs(a) ** b, 0)),
    "LOGARITHM": lambda a, b, c: np.log(a) / np.log(b), "SQRT": lambda a, b, c: np.sqrt(np.maximum(a, 0)),
    "INVERSE_SQRT": lambda a, b, c: np.where(a > 0, 1 / np.sqrt(a), 0), "ABSOLUTE": lambda a, b, c: np.abs(a), "EXPONENT": lambda a, b, c: np.exp(a),
    "MINIMUM": lambda a, b, c: np.minimum(a, b), "MAXIMUM": lambda a, b, c: np.maximum(a, b), "LESS_THAN": lambda a, b, c: a < b,
    "GREATER_THAN": lambda a, b, c: a > b, "SIGN": lambda a, b, c: np.sign(a), "COMPARE": lambda a, b, c: np.abs(a - b) <= np.maximum(c, 1e-5),
    "ROUND": lambda a, b, c: np.floor(a + 0.5), "FLOOR": lambda a, b, c: np.floor(a), "CEIL": lambda a, b, c: np.ceil(a),
    "TRUNC": lambda a, b, c: np.trunc(a), "FRACT": lambda a, b, c: a - np.floor(a), "MODULO": lambda a, b, c: np.where(b != 0, np.fmod(a, b), 0),
    "WRAP": lambda a, b, c: np.where(b != c, a - (b - c) * np.floor((a - c) / (b - c)), c),
    "SNAP": lambda a, b, c: np.where(b != 0, np.floor(a / b) * b, 0),
    "PINGPONG": lambda a, b, c: np.where(b != 0, np.abs(((a - b) / (2 * b) - np.floor((a - b) / (2 * b))) * 2 * b - b), 0),
    "SINE": lambda a, b, c: np.sin(a), "COSINE": lambda a, b, c: np.cos(a), "TANGENT": lambda a, b, c: np.tan(a),
    "ARCSINE": lambda a, b, c: np.arcsin(np.clip(a, -1, 1)), "ARCCOSINE": lambda a, b, c: np.arccos(np.clip(a, -1, 1)),
    "ARCTANGENT": lambda a, b, c: np.arctan(a), "ARCTAN2": lambda a, b, c: np.arctan2(a, b), "SINH": lambda a, b, c: np.sinh(a),
    "COSH": lambda a, b, c: np.cosh(a), "TANH": lambda a, b, c: np.tanh(a), "RADIANS": lambda a, b, c: a * math.pi / 180,
    "DEGREES": lambda a, b, c: a * 180 / math.pi,
    "SMOOTH_MIN": lambda a, b, c: np.where(c != 0, np.minimum(a, b) - np.maximum(c - np.abs(a - b), 0) ** 3 / (6 * c * c), np.minimum(a, b)),
    "SMOOTH_MAX": lambda a, b, c: np.where(c != 0, np.maximum(a, b) + np.maximum(c - np.abs(a - b), 0) ** 3 / (6 * c * c), np.maximum(a, b))}
BY_AXIS = {"ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "MULTIPLY_ADD", "WRAP", "SNAP", "FLOOR", "CEIL", "MODULO", "ABSOLUTE", "MINIMUM", "MAXIMUM",
           "SINE", "COSINE", "TANGENT"}


def _fraction(node: nodes.Node, _: nodes.Socket, points: Points) -> Any:
    if node.operation not in MATHS:
        raise Unknown(node.name)
    made = MATHS[node.operation](*(value(one, points) for one in node.inputs[:3]))
    return np.clip(made, 0, 1) if node.use_clamp else made


def _vector(node: nodes.Node, _: nodes.Socket, points: Points) -> Any:
    a, b, c = (value(one, points) for one in node.inputs[:3])
    if node.operation in BY_AXIS:
        return MATHS[node.operation](a, b, c)
    if node.operation == "FRACTION":
        return a - np.floor(a)
    if node.operation == "SCALE":
        return a * value(node.inputs["Scale"], points)[:, None]
    if node.operation == "DOT_PRODUCT":
        return (a * b).sum(axis=1)
    if node.operation == "CROSS_PRODUCT":
        return np.cross(a, b)
    if node.operation in {"LENGTH", "DISTANCE", "NORMALIZE"}:
        length = np.sqrt(((a - b if node.operation == "DISTANCE" else a) ** 2).sum(axis=1))
        return a / np.maximum(length, 1e-30)[:, None] if node.operation == "NORMALIZE" else length
    raise Unknown(node.name)


def _range(node: nodes.Node, _: nodes.Socket, points: Points) -> Any:
    if node.data_type != "FLOAT" or node.interpolation_type == "STEPPED":
        raise Unknown(node.name)
    given, low, high, first, last = (value(one, points) for one in node.inputs[:5])
    share = np.where(high != low, (given - low) / (high - low), 0)
    if node.interpolation_type != "LINEAR":
        share = np.clip(share, 0, 1)
        share = share * share * (3 - 2 * share) if node.interpolation_type == "SMOOTHSTEP" else share ** 3 * (share * (share * 6 - 15) + 10)
    elif node.clamp:
        share = np.clip(share, 0, 1)
    return first + share * (last - first)


def _clamp(node: nodes.Node, _: nodes.Socket, points: Points) -> Any:
    given, low, high = (value(one, points) for one in node.inputs[:3])
    if node.clamp_type == "RANGE":
        low, high = np.minimum(low, high), np.maximum(low, high)
    return np.minimum(np.maximum(given, low), high)


def _own(_: nodes.Node, output: nodes.Socket, points: Points) -> Any:
    given = output.default_value
    return np.full(len(points), given) if output.type == "VALUE" else np.tile(np.array(given[:3]), (len(points), 1))


READ: dict[str, Callable[[nodes.Node, nodes.Socket, Points], Any]] = {
    "TEX_COORD": _coordinate, "UVMAP": lambda node, output, points: _uv(points), "MAPPING": _mapping, "TEX_IMAGE": _image, "TEX_NOISE": _noise,
    "TEX_WHITE_NOISE": _white, "TEX_VORONOI": _voronoi, "TEX_CHECKER": _checker, "TEX_BRICK": _brick, "TEX_GRADIENT": _gradient,
    "TEX_WAVE": _wave, "TEX_MAGIC": _magic, "VALTORGB": _ramp, "MIX": _mix, "MIX_RGB": _mix, "HUE_SAT": _hue, "BRIGHTCONTRAST": _bright,
    "INVERT": _invert, "GAMMA": _gamma, "CURVE_RGB": _curves, "SEPARATE_COLOR": _separate, "SEPRGB": _separate, "SEPXYZ": _separate,
    "COMBINE_COLOR": _combine, "COMBRGB": _combine, "COMBXYZ": _combine, "VERTEX_COLOR": _attribute, "ATTRIBUTE": _attribute, "MATH": _fraction,
    "VECT_MATH": _vector, "MAP_RANGE": _range, "CLAMP": _clamp, "VALUE": _own, "RGB": _own,
    "RGBTOBW": lambda node, output, points: value(node.inputs[0], points) @ GREY}


def is_constant(socket: nodes.Socket, known: Optional[dict[Any, bool]] = None) -> bool:
    """True if an input is the same everywhere, computed from numbers alone. `known`: results for nodes."""
    start = nodes.source(socket)
    if start is None:
        return True
    known, kind = {} if known is None else known, start.node.type
    if start.node not in known:
        known[start.node] = kind in READ and not kind.startswith("TEX_") and kind not in PLACES and \
            all(is_constant(one, known) for one in start.node.inputs)
    return known[start.node]


def nowhere() -> Points:
    """A single point, for values that are the same everywhere."""
    zeros = np.zeros((1, 3), np.float32)
    return Points(None, zeros, zeros, zeros, lambda name: None)


PLACES = {"UVMAP", "VERTEX_COLOR", "ATTRIBUTE"}


# ---- the view

def ior_of(node: nodes.Node) -> float:
    """The index of refraction of a Fresnel or Layer Weight node."""
    if node.type == "FRESNEL":
        return min(max(nodes.number(node.inputs["IOR"]), 1.0), 10.0)
    return min(1 / max(1 - nodes.number(node.inputs["Blend"]), 0.1), 10.0)


def mean_of_view(output: nodes.Socket) -> float:
    """The mean of Fresnel or Layer Weight over the directions from which a surface is lit."""
    cosine = np.sqrt((np.arange(256) + 0.5) / 256)
    if output.name == "Facing":
        blend = min(max(nodes.number(output.node.inputs["Blend"]), 0), 0.99999)
        return float((1 - cosine ** (2 * blend if blend < 0.5 else 0.5 / (1 - blend))).mean())
    below = np.sqrt(ior_of(output.node) ** 2 - 1 + cosine * cosine)
    first = (below - cosine) / (below + cosine)
    return float((first * first * (1 + ((cosine * (below + cosine) - 1) / (cosine * (below - cosine) + 1)) ** 2) / 2).mean())
