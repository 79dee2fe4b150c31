# SPDX-License-Identifier: MIT
"""Baked textures: pictures of the values of nodes (Noise, Voronoi, Checker, Color Ramp ..) that no field of a material can express, laid
out by the active UV map. Without a UV map a value is replaced by its mean.
"""
from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass
from typing import Any, Optional

import bpy
import numpy as np

from .shading import Points

SIZE_MAX, SIZE_MIN = 1024, 128  # texels along a side
# Up to this number of meshes with one material, its pictures have the full size; beyond it the total number of texels stays
AT_FULL_SIZE = 4
SAMPLES = 4096  # samples of a mean
MARGIN = 1.5  # texels beyond a triangle's edges that filtering reaches
BATCH = 1 << 20  # texels tested at once


def size_for(users: int) -> int:
    """Size of the pictures of a material that this number of meshes have."""
    size = SIZE_MAX
    while size > SIZE_MIN and (size / SIZE_MAX) ** 2 * users > AT_FULL_SIZE:
        size //= 2
    return size


@dataclass
class Picture:
    """The texels of a square that triangles cover. transform: rows (a b c), (d e f) of the protocol, from the mesh's texture
    coordinates."""
    size: int
    texels: Any
    points: Points
    transform: tuple[float, ...]

    def filled(self, values: Any) -> Any:
        """Makes an image of size x size (x width) from values at the points; texels without a triangle get their mean."""
        made = np.empty((self.size * self.size, *values.shape[1:]), np.float32)
        made[:] = values.mean(axis=0)
        made[self.texels] = values
        return made.reshape(self.size, self.size, *values.shape[1:])


def _batches(corners: Any) -> Iterator[tuple[Any, Any]]:
    """Yields numbers of triangles, and the texels of their bounds, n x texels x 2; triangles of similar size form a batch."""
    low = np.floor(corners.min(axis=1)).astype(np.int64)
    span = (np.ceil(corners.max(axis=1)).astype(np.int64) - low).max(axis=1)
    side = 1 << np.ceil(np.log2(np.maximum(span, 1))).astype(np.int64)
    for one in np.unique(side):
        numbers = np.flatnonzero(side == one)
        grid = np.stack(np.meshgrid(np.arange(one), np.arange(one), indexing="ij"), axis=-1).reshape(-1, 2)
        step = max(1, BATCH // (one * one))
        for start in range(0, len(numbers), step):
            chosen = numbers[start:start + step]
            yield chosen, low[chosen, None] + grid


def _covered(corners: Any, size: int) -> tuple[Any, Any, Any]:
    """Finds the covered texels of a square, for triangles of m x 3 x 2 texels: their indices, triangles and barycentric
    weights."""
    owner = np.full(size * size, -1, np.int64)
    triangles, weights = np.zeros(size * size, np.int64), np.zeros((size * size, 3))
    edges = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)  # opposite edge of each corner
    area = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
    # Texels from each corner to its opposite edge
    heights = np.abs(area)[:, None] / np.maximum(np.sqrt((edges ** 2).sum(axis=2)), 1e-12)
    useful = np.flatnonzero(np.abs(area) > 1e-9)
    grown = np.stack((corners.min(axis=1) - MARGIN, corners.max(axis=1) + MARGIN), axis=1)
    for chosen, texels in _batches(grown[useful]):
        which = useful[chosen]
        shares = np.empty((*texels.shape[:2], 3))
        for corner in (0, 1):
            away, edge = texels + 0.5 - corners[which, None, corner + 1], edges[which, None, corner]
            shares[..., corner] = (edge[..., 0] * away[..., 1] - edge[..., 1] * away[..., 0]) / area[which, None]
        shares[..., 2] = 1 - shares[..., 0] - shares[..., 1]
        beyond = (shares * heights[which, None]).min(axis=2)  # texels
        is_there = ((texels >= 0) & (texels < size)).all(axis=2)
        for rank, accepted in ((0, (beyond >= -MARGIN) & (beyond < 0)), (1, beyond >= 0)):
            found = np.nonzero(accepted & is_there)
            at = texels[found][:, 1] * size + texels[found][:, 0]
            free = owner[at] < 2 * rank  # a texel beyond an edge never replaces one within a triangle
            at, found = at[free], tuple(one[free] for one in found)
            owner[at], triangles[at], weights[at] = rank, which[found[0]], shares[found]
    there = np.flatnonzero(owner >= 0)
    return there, triangles[there], weights[there]


class Surface:
    """A mesh of Blender's while it is read. `key` identifies it."""

    def __init__(self, mesh: bpy.types.Mesh, key: Hashable) -> None:
        self.key, self._mesh = key, mesh

    @functools.cached_property
    def _arrays(self) -> dict[str, Any]:
        """Arrays with a value for each corner; "uv" only if there is a map."""
        from .meshes import read, shape  # pylint: disable=import-outside-toplevel,cyclic-import
        mesh = self._mesh
        mesh.calc_loop_triangles()
        corners = shape(mesh)
        made = {"place": corners[:, :3], "normal": corners[:, 3:], "triangles": read(mesh.loop_triangles, "loops", 3, np.int32),
                "slots": read(mesh.loop_triangles, "material_index", 1, np.int32)}
        layer = next((one for one in mesh.uv_layers if one.active_render), None)
        if layer is not None:
            made["uv"] = read(layer.data, "uv", 2)
        for attribute in mesh.color_attributes:
            values = read(attribute.data, "color", 4)[:, :3]
            made[f"colours {attribute.name}"] = values[read(mesh.loops, "vertex_index", 1, np.int32)] if attribute.domain == "POINT" else values
        return made

    @functools.cached_property
    def digest(self) -> bytes:
        """A digest that is equal for equal arrays."""
        hashed = hashlib.blake2b(digest_size=16)
        for name, values in self._arrays.items():
            hashed.update(name.encode() + np.ascontiguousarray(values).tobytes())
        return hashed.digest()

    def extent(self) -> float:
        """The smallest side of the bounds."""
        place = self._arrays["place"]
        return float((place.max(axis=0) - place.min(axis=0)).min()) if len(place) else 0.0

    def _triangles(self, slot: int) -> Any:
        chosen = self._arrays["triangles"][self._arrays["slots"] == slot]
        return chosen if len(chosen) else self._arrays["triangles"]

    def _points(self, corners: Any, weights: Any) -> Points:
        """Random points inside triangles (n x 3 corners)."""
        arrays = self._arrays

        def inside(values: Any) -> Any:
            return np.einsum("nc,nck->nk", weights, values[corners]).astype(np.float32)

        def colours(name: str) -> Any:
            active = self._mesh.color_attributes.active_color
            found = arrays.get(f"colours {name or (active.name if active else '')}")
            return None if found is None else inside(found)
        low, high = arrays["place"].min(axis=0), arrays["place"].max(axis=0)
        place = inside(arrays["place"])
        generated = np.where(high > low, (place - low) / np.where(high > low, high - low, 1), 0.5)
        return Points(inside(arrays["uv"]) if "uv" in arrays else None, generated.astype(np.float32), place,
                      inside(arrays["normal"]), colours)

    def samples(self, slot: int) -> Optional[Points]:
        """Places spread over the triangles of a slot, always the same ones."""
        triangles = self._triangles(slot)
        if not len(triangles):
            return None
        one, two, three = (self._arrays["place"][triangles[:, corner]] for corner in range(3))
        areas = np.sqrt((np.cross(two - one, three - one) ** 2).sum(axis=1)).cumsum()
        random = np.random.default_rng(1)
        chosen = np.minimum(np.searchsorted(areas, random.random(SAMPLES) * areas[-1]), len(triangles) - 1)
        u, v = random.random((2, SAMPLES))
        return self._points(triangles[chosen], np.stack((1 - np.sqrt(u), np.sqrt(u) * (1 - v), np.sqrt(u) * v), axis=-1))

    def picture(self, slot: int, size: int) -> Optional[Picture]:
        """The triangles of a slot, laid out by their UV; None: there is no UV map, or it has no area."""
        triangles = self._triangles(slot)
        if "uv" not in self._arrays or not len(triangles):
            return None
        uv = self._arrays["uv"][triangles] * (1, -1) + (0, 1)  # rows are counted from the top
        low, high = uv.min(axis=(0, 1)), uv.max(axis=(0, 1))
        if not np.isfinite(uv).all() or not (high - low > 1e-9).all():
            return None
        texels, which, weights = _covered((uv - low) / (high - low) * size, size)
        if not len(texels):
            return None
        a, e = (float(one) for one in 1 / (high - low))
        return Picture(size, texels, self._points(triangles[which], weights), (a, 0, -a * float(low[0]), 0, e, -e * float(low[1])))


def anywhere() -> Points:
    """Points of the unit square, for objects without a mesh, such as hairs."""
    uv = np.random.default_rng(1).random((SAMPLES, 2)).astype(np.float32)
    place = np.column_stack((uv, np.full(SAMPLES, 0.5, np.float32)))
    return Points(uv, place, place, np.tile(np.array((0, 0, 1), np.float32), (SAMPLES, 1)), lambda name: None)


def digest_of(tree: bpy.types.NodeTree, of_image: Callable[[bpy.types.Image], bytes]) -> bytes:
    """A digest that is equal for equal nodes, including those of groups."""
    hashed = hashlib.blake2b(digest_size=16)

    def add(*given: Any) -> None:
        plain = (one if one is None or isinstance(one, (str, int, float)) else tuple(one) for one in given)
        hashed.update(repr(tuple(plain)).encode())
    for node in tree.nodes:
        for prop in node.bl_rna.properties:
            if prop.type in {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"} and prop.identifier not in LAYOUT:
                add(prop.identifier, getattr(node, prop.identifier))
        for socket in (*node.inputs, *(node.outputs if node.type in {"VALUE", "RGB"} else ())):
            add(socket.identifier, getattr(socket, "default_value", None))
        if node.type == "VALTORGB":
            add(node.color_ramp.interpolation, node.color_ramp.color_mode, node.color_ramp.hue_interpolation)
            for element in node.color_ramp.elements:
                add(element.position, element.color)
        for curve in node.mapping.curves if node.type == "CURVE_RGB" else ():
            for point in curve.points:
                add(point.location, point.handle_type)
        if getattr(node, "image", None) is not None:
            hashed.update(of_image(node.image))
        if node.type == "GROUP" and node.node_tree is not None:
            hashed.update(digest_of(node.node_tree, of_image))
    for link in tree.links:
        add(link.is_muted, link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier)
    return hashed.digest()


# Properties of a node that concern its place in the editor only.
LAYOUT = {"location", "location_absolute", "width", "width_hidden", "height", "select", "show_options", "show_preview", "show_texture", "hide",
          "label", "color", "use_custom_color", "dimensions", "warning_propagation"}
