# SPDX-License-Identifier: MIT
"""Frames as arrays."""
from __future__ import annotations

import difflib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from . import png
from .errors import InvalidValue
from .messages import FrameBegin, FrameEnd, Layer, ObjectKind, PixelFormat, StructureRow
from .objects import Names, Object

Array = npt.NDArray[Any]
LayersOf = Union[str, Layer, Sequence[Union[str, Layer]]]

_TYPES = {PixelFormat.RGBA8: "u1", PixelFormat.RGBA16F: "<f2", PixelFormat.RGBA32F: "<f4"}


def pixels_bytes(begin: FrameBegin) -> int:
    """Size of all images, decoded."""
    bytes_per_pixel = 4 * np.dtype(_TYPES[PixelFormat(int(begin.format))]).itemsize
    return begin.width * begin.height * bytes_per_pixel * begin.layers.bit_count()


def _layers_of(name: Union[str, Layer]) -> "list[Layer]":
    """Finds layers; a name without its digit stands for all layers of the series: "crypto-object"."""
    wanted = name.replace("_", "-").lower() if isinstance(name, str) else ""
    whole = [layer for layer in Layer if wanted and layer.word.rstrip("0123456789").replace("_", "-") == wanted]
    return whole or [Layer(Layer.of(name))]


def layer_set(layers: LayersOf) -> int:
    """Converts "depth", or ("beauty", "depth"), to a set of bits."""
    try:
        names = (layers,) if isinstance(layers, (str, Layer)) else tuple(layers)
        return sum({1 << int(layer) for name in names for layer in _layers_of(name)})
    except (TypeError, ValueError) as why:
        raise InvalidValue(str(why), field="render.layers") from None


@dataclass(frozen=True)
class Frame:
    """A received picture. `begin` and `end` hold what the daemon reports about it: camera, revision, samples, digest, rays,
    times of the stages. Arrays are read-only views of `data`, its pixels, rows from the top. `is_checked`: the pixels match the
    daemon's digest; unknown for JPEG, and without libxxhash. `window`, for a crop: the pixels left of it and above it, and the
    size of the whole picture. `known`: the scene's names, with the layer id."""
    begin: FrameBegin
    end: FrameEnd
    data: memoryview
    is_checked: bool = False
    window: Union[tuple[int, int, int, int], None] = None
    known: Names = Names({}, {})

    def __repr__(self) -> str:
        width, height = self.size
        names = ", ".join(layer.word for layer in self.layers)
        return (f"<farlight.Frame {self.number}: {width}x{height} {PixelFormat(int(self.begin.format)).word}, {names}, "
                f"{self.begin.samples} samples>")

    @property
    def number(self) -> int:
        """The frame's number in the job's range."""
        return self.begin.frame

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        return self.begin.width, self.begin.height

    @property
    def layers(self) -> list[Layer]:
        """The layers of the frame, in the order of their images."""
        return [layer for layer in Layer if self.begin.layers >> layer & 1]

    def layer(self, layer: str | Layer) -> Array:
        """The values of one layer, height x width x 4, as the protocol defines them."""
        try:
            wanted = Layer(Layer.of(layer))
        except ValueError as why:
            raise InvalidValue(str(why), field="layer") from None
        if wanted not in self.layers:
            raise InvalidValue(f"the frame has {', '.join(one.word for one in self.layers)} and not {wanted.word}",
                               field="layer", remedy=f'ask for it: layers=("{wanted.word}", ...)')
        place = self.layers.index(wanted)
        shape = (self.begin.layers.bit_count(), self.begin.height, self.begin.width, 4)
        images = np.frombuffer(self.data, _TYPES[PixelFormat(int(self.begin.format))]).reshape(shape)
        one: Array = images[place]
        return one

    @property
    def colour(self) -> Array:
        """The picture itself, height x width x 4. uint8: tone-mapped sRGB and straight alpha; else linear floats and
        premultiplied alpha."""
        return self.layer(Layer.BEAUTY)

    @property
    def depth(self) -> Array:
        """Distance in metres along the view to the first surface, height x width; infinite where there is none."""
        layer = self.layer(Layer.DEPTH)
        return np.where(layer[..., 3] > 0, layer[..., 0], np.inf).astype(layer.dtype)

    @property
    def normal(self) -> Array:
        """Shading normal in world space, height x width x 3; 0 where there is no surface."""
        layer: Array = self.layer(Layer.NORMAL)[..., :3]
        return layer

    @property
    def albedo(self) -> Array:
        """Base colour, height x width x 3."""
        layer: Array = self.layer(Layer.ALBEDO)[..., :3]
        return layer

    @property
    def position(self) -> Array:
        """World position of the first surface, metres, height x width x 3."""
        layer: Array = self.layer(Layer.POSITION)[..., :3]
        return layer

    @property
    def ids(self) -> Array:
        """Numbers of node and material of the first surface, height x width x 2; 0 where there is none."""
        numbers: Array = self.layer(Layer.ID)[..., :2].astype(np.uint32)
        return numbers

    @property
    def motion(self) -> Array:
        """Motion of the first surface, height x width x 4: from its place to its place a frame later, x and y, then to its
        place a frame earlier, x and y; pixels, x to the right and y up. The optical flow of OpenCV and data sets has y down:
        `frame.motion[..., :2] * (1, -1)`. Only the camera's path and clips count: edits of the scene between two frames, or
        another camera in the next render(), are not known in advance."""
        return self.layer(Layer.MOTION)

    @property
    def names(self) -> dict[int, str]:
        """Names of the nodes by the numbers in `ids`; empty without the layer id."""
        return {number: entry.name for number, entry in self.known.nodes.items()}

    @property
    def material_names(self) -> dict[int, str]:
        """Names of the materials by the numbers in `ids`; empty without the layer id."""
        return {number: entry.name for number, entry in self.known.materials.items()}

    def mask(self, thing: Object | str) -> Array:
        """A mask, height x width: true where the first surface is of this node, a node below it, or this material. A name
        stands for all nodes with this name, and for materials if no node has it."""
        if isinstance(thing, str):
            nodes, materials = self.known.called(thing)
            if not nodes and not materials:
                names = sorted({*self.names.values(), *self.material_names.values()} - {""})
                like = difflib.get_close_matches(thing, names)
                raise InvalidValue(f"{thing!r:.80} is the name of no node and no material", field="mask", remedy=f"did you mean {' or '.join(like)}?"
                                   if like else "frame.names and frame.material_names have them")
        elif isinstance(thing, Object) and thing.kind in (ObjectKind.NODE, ObjectKind.MATERIAL):
            is_node = thing.kind == ObjectKind.NODE
            nodes, materials = self.known.below({thing.number}) if is_node else set(), set() if is_node else {thing.number}
        else:
            raise InvalidValue(f"{thing!r:.80} is no node or material", field="mask", remedy="give a name, or a result of an add_ function, find() "
                               "or objects() of the scene")
        ids = self.ids
        is_there: Array = np.isin(ids[..., 0], list(nodes)) if nodes else np.isin(ids[..., 1], list(materials))
        return is_there

    @property
    def world_from_view(self) -> Array:
        """4 x 4: the camera, which looks along -z, with y up. Of OpenCV's, which looks along +z with y down, columns 1 and 2
        have the other sign."""
        return np.array([*self.begin.world_from_view, 0, 0, 0, 1], dtype=np.float64).reshape(4, 4)

    @property
    def K(self) -> Array:  # the usual name
        """The camera matrix, 3 x 3: from the camera's space, with z along the view and y down, to pixels; the centre of the
        first pixel is (0.5, 0.5). An orthographic camera has none."""
        left, above, width, height = self.window or (0, 0, *self.size)
        if not self.begin.fov_y > 0:
            raise InvalidValue("the camera is orthographic", field="K")
        focal = height / 2 / math.tan(self.begin.fov_y / 2)
        return np.array([[focal, 0, width / 2 - left], [0, focal, height / 2 - above], [0, 0, 1]])

    def _repr_png_(self) -> bytes | None:
        """PNG for notebooks; frames of floats have no tone map and show as text."""
        return png.encode(self.colour) if self.begin.format == PixelFormat.RGBA8 and Layer.BEAUTY in self.layers else None

    @property
    def warnings(self) -> list[str]:
        """Warnings about missing parts of the picture, and remedies, in the tracer's words."""
        rows: list[StructureRow] = list(self.end.structure)
        return [row.warning for row in rows if row.warning]
