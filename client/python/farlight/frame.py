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
    """Of all its images, decoded."""
    bytes_per_pixel = 4 * np.dtype(_TYPES[PixelFormat(int(begin.format))]).itemsize
    return begin.width * begin.height * bytes_per_pixel * begin.layers.bit_count()


def _layers_of(name: Union[str, Layer]) -> "list[Layer]":
    """A name without its digit stands for all that have it: "crypto-object"."""
    wanted = name.replace("_", "-").lower() if isinstance(name, str) else ""
    whole = [layer for layer in Layer if wanted and layer.word.rstrip("0123456789").replace("_", "-") == wanted]
    return whole or [Layer(Layer.of(name))]


def layer_set(layers: LayersOf) -> int:
    """The set of bits of "depth", or of ("beauty", "depth")."""
    try:
        names = (layers,) if isinstance(layers, (str, Layer)) else tuple(layers)
        return sum({1 << int(layer) for name in names for layer in _layers_of(name)})
    except (TypeError, ValueError) as why:
        raise InvalidValue(str(why), field="render.layers") from None


@dataclass(frozen=True)
class Frame:
    """A picture as it came. `begin` and `end` are all that the daemon says of it: camera, revision, samples, digest,
    rays, times of the stages. Arrays are views of `data`, its pixels, rows from the top, and cannot be written to.
    `is_checked`: they have the digest that the daemon computed; not known of JPEG, and without libxxhash. `window`: of a
    crop, the pixels left of it and above it, and the size of the whole picture. `known`: the scene's names, with the layer id."""
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
        """In the job's range."""
        return self.begin.frame

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        return self.begin.width, self.begin.height

    @property
    def layers(self) -> list[Layer]:
        """Those that are there, in the order of their images."""
        return [layer for layer in Layer if self.begin.layers >> layer & 1]

    def layer(self, layer: str | Layer) -> Array:
        """Height x width x 4 numbers of one layer: what the protocol says of it."""
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
        """Height x width x 4: the picture itself. uint8: tone-mapped sRGB and straight alpha; else linear floats and
        premultiplied alpha."""
        return self.layer(Layer.BEAUTY)

    @property
    def depth(self) -> Array:
        """Height x width: metres along the view to the first surface; infinite where there is none."""
        layer = self.layer(Layer.DEPTH)
        return np.where(layer[..., 3] > 0, layer[..., 0], np.inf).astype(layer.dtype)

    @property
    def normal(self) -> Array:
        """Height x width x 3: the shading normal in world space; 0 where there is no surface."""
        layer: Array = self.layer(Layer.NORMAL)[..., :3]
        return layer

    @property
    def albedo(self) -> Array:
        """Height x width x 3: base colour."""
        layer: Array = self.layer(Layer.ALBEDO)[..., :3]
        return layer

    @property
    def position(self) -> Array:
        """Height x width x 3: world position of the first surface, metres."""
        layer: Array = self.layer(Layer.POSITION)[..., :3]
        return layer

    @property
    def ids(self) -> Array:
        """Height x width x 2: the numbers of node and material of the first surface; 0 where there is none."""
        numbers: Array = self.layer(Layer.ID)[..., :2].astype(np.uint32)
        return numbers

    @property
    def motion(self) -> Array:
        """Height x width x 4: from where the first surface is seen to where it is seen a frame later, x and y, then to where it
        was seen a frame earlier, x and y; pixels, x to the right and y up. What OpenCV and data sets call the optical flow has
        y down: `frame.motion[..., :2] * (1, -1)`. Only the camera's path and clips count: a scene that is edited between two
        frames, or another camera of the next render(), is not known beforehand."""
        return self.layer(Layer.MOTION)

    @property
    def names(self) -> dict[int, str]:
        """The names of the nodes by their numbers, which `ids` has; without the layer id none."""
        return {number: entry.name for number, entry in self.known.nodes.items()}

    @property
    def material_names(self) -> dict[int, str]:
        """Likewise, of materials."""
        return {number: entry.name for number, entry in self.known.materials.items()}

    def mask(self, thing: Object | str) -> Array:
        """Height x width: where the first surface is of that node, or hangs below it, or of that material. A name stands for all
        nodes that have it, and for materials if no node has."""
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
            raise InvalidValue(f"{thing!r:.80} is no node or material", field="mask", remedy="give a name, or what an add_ function, find() "
                               "or objects() of the scene returned")
        ids = self.ids
        is_there: Array = np.isin(ids[..., 0], list(nodes)) if nodes else np.isin(ids[..., 1], list(materials))
        return is_there

    @property
    def world_from_view(self) -> Array:
        """4 x 4: the camera, which looks along -z, with y up. Of OpenCV's, which looks along +z with y down, columns 1 and 2
        have the other sign."""
        return np.array([*self.begin.world_from_view, 0, 0, 0, 1], dtype=np.float64).reshape(4, 4)

    @property
    def K(self) -> Array:  # as everybody calls it
        """3 x 3: from the camera's space, with z along the view and y down, to pixels; the first one's middle is (0.5, 0.5). Of
        an orthographic camera there is none."""
        left, above, width, height = self.window or (0, 0, *self.size)
        if not self.begin.fov_y > 0:
            raise InvalidValue("the camera is orthographic", field="K")
        focal = height / 2 / math.tan(self.begin.fov_y / 2)
        return np.array([[focal, 0, width / 2 - left], [0, focal, height / 2 - above], [0, 0, 1]])

    def _repr_png_(self) -> bytes | None:
        """For notebooks; floats have no tone map, and show as text."""
        return png.encode(self.colour) if self.begin.format == PixelFormat.RGBA8 and Layer.BEAUTY in self.layers else None

    @property
    def warnings(self) -> list[str]:
        """What the picture lacks, and the remedy, in the tracer's words."""
        rows: list[StructureRow] = list(self.end.structure)
        return [row.warning for row in rows if row.warning]
