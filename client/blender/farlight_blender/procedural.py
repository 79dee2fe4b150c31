# SPDX-License-Identifier: MIT
"""Blender's procedural textures at many points, after Cycles' kernel (svm/noise.h, svm/noisetex.h, svm/voronoi.h, svm/brick.h,
svm/checker.h, svm/gradient.h, svm/wave.h, svm/magic.h; util/hash.h). Points are n x 3; all patterns are those of three dimensions."""
from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

# Cells; a pattern with more cells between its corners is finer than a baked picture, and is replaced by its mean
LATTICE_MAX = 1 << 22
BEGIN = 0xDEADBEEF
OCTAVES_MAX = 15


# ---- hashes

def _turned(values: Any, by: int) -> Any:
    return (values << np.uint32(by)) | (values >> np.uint32(32 - by))


def _hash(*keys: Any) -> Any:
    """Jenkins' hash of two to four 32-bit numbers, as numbers of 0 .. 1."""
    shape = np.broadcast_shapes(*(np.shape(key) for key in keys))
    full = [np.broadcast_to(np.asarray(key, np.uint32), shape) for key in keys]
    start = np.uint32((BEGIN + (len(keys) << 2) + 13) & 0xFFFFFFFF)
    a, b, c = (np.full(shape, start, np.uint32) for _ in range(3))
    a, b = a + full[0], b + full[1]
    if len(keys) > 2:
        c = c + full[2]
    if len(keys) > 3:
        for first, by in zip((0, 1, 2, 0, 1, 2), (4, 6, 8, 16, 19, 4)):  # Jenkins' macro `mix`
            three = [a, b, c]
            x, y, z = three[first], three[(first + 1) % 3], three[(first + 2) % 3]
            x = (x - z) ^ _turned(z, by)
            z = z + y
            three[first], three[(first + 2) % 3] = x, z
            a, b, c = three
        a = a + full[3]
    for first, by in zip((2, 0, 1, 2, 0, 1, 2), (14, 11, 25, 16, 4, 14, 24)):  # Jenkins' macro `final`
        three = [a, b, c]
        before = three[(first + 2) % 3]
        three[first] = (three[first] ^ before) - _turned(before, by)
        a, b, c = three
    return c


def _share(hashed: Any) -> Any:
    return (hashed / np.float32(0xFFFFFFFF)).astype(np.float32)


def _bits(values: Any) -> Any:
    return np.ascontiguousarray(np.asarray(values, np.float32) + np.float32(0)).view(np.uint32)  # avoids negative zero


def _colour_of(cells: Any) -> Any:
    """Cycles' hash_float3_to_float3."""
    x, y, z = (_bits(cells[..., axis]) for axis in range(3))
    one, two = (_bits(np.float32(number)).reshape(()) for number in (1, 2))
    return np.stack([_share(_hash(x, y, z)), _share(_hash(x, y, z, one)), _share(_hash(x, y, z, two))], axis=-1)


def white_noise(points: Any) -> Any:
    """White noise, n x 3; the first component is the value."""
    return _colour_of(points)


def _offset(seed: int) -> Any:
    return np.array([100 + 100 * float(_share(_hash(_bits(np.float32(seed)), _bits(np.float32(axis)))).reshape(())) for axis in range(3)],
                    np.float32)


class _Lattice:
    """The cells around points, with the values of a function at each cell."""

    def __init__(self, points: Any, margin: tuple[int, int]) -> None:
        self.cells = np.floor(points).astype(np.int64)
        self._low = self.cells.min(axis=0) - margin[0]
        self._size = self.cells.max(axis=0) + margin[1] + 1 - self._low
        self.is_small = bool(np.prod(self._size.astype(np.float64)) <= LATTICE_MAX)

    def values(self, of: Callable[[Any], Any]) -> Any:
        places = np.stack(np.meshgrid(*(np.arange(low, low + size) for low, size in zip(self._low, self._size)), indexing="ij"), axis=-1)
        return of(places.reshape(-1, 3))

    def at(self, offset: Any) -> Any:
        """Indices into values() of the cells at an offset from each point's own cell."""
        x, y, z = (self.cells + np.asarray(offset) - self._low).T
        return (x * self._size[1] + y) * self._size[2] + z


# ---- noise

def _signed_noise(points: Any) -> Any:
    """Perlin's noise, -1 .. 1."""
    lattice = _Lattice(points, (0, 1))
    if not lattice.is_small:
        return np.zeros(len(points), np.float32)

    def directions_of(cells: Any) -> Any:
        return _hash(*(cells[:, axis].astype(np.int32).view(np.uint32) for axis in range(3))) & np.uint32(15)
    chosen = lattice.values(directions_of)
    # The sixteen directions have two of x, y, z, each with a sign.
    directions = np.zeros((16, 3), np.float32)
    for one in range(16):
        u, v = (0 if one < 8 else 1), (1 if one < 4 else 0 if one in (12, 14) else 2)
        directions[one, u] += -1 if one & 1 else 1
        directions[one, v] += -1 if one & 2 else 1
    inside = (points - lattice.cells).astype(np.float32)
    eased = inside * inside * inside * (inside * (inside * 6 - 15) + 10)
    total = np.zeros(len(points), np.float32)
    for corner in np.ndindex(2, 2, 2):
        weights = np.where(corner, eased, 1 - eased).prod(axis=1)
        slopes = directions[chosen[lattice.at(corner)]]
        total += weights * (slopes * (inside - np.array(corner, np.float32))).sum(axis=1)
    return np.float32(0.9820) * total


def _fractal(points: Any, detail: float, roughness: float) -> Any:
    octaves = min(max(detail, 0.0), OCTAVES_MAX)
    total, size, most = np.zeros(len(points), np.float32), 1.0, 0.0
    for octave in range(int(octaves) + 1):
        total = total + (0.5 * _signed_noise(points * 2.0 ** octave) + 0.5) * size
        most += size
        size *= min(max(roughness, 0.0), 1.0)
    part = octaves - int(octaves)
    if part == 0:
        return total / most
    more = total + (0.5 * _signed_noise(points * 2.0 ** (int(octaves) + 1)) + 0.5) * size
    return (1 - part) * total / most + part * more / (most + size)


def noise(points: Any, detail: float, roughness: float, distortion: float, wants_colour: bool) -> Any:
    """Fractal noise, n x 3; without a colour the value three times."""
    if distortion != 0:
        points = points + distortion * np.stack([_signed_noise(points + _offset(seed)) for seed in range(3)], axis=-1)
    value = _fractal(points, detail, roughness)
    if not wants_colour:
        return np.repeat(value[:, None], 3, axis=1)
    return np.stack([value, *(_fractal(points + _offset(seed), detail, roughness) for seed in (3, 4))], axis=-1)


# ---- cells

def _distance(between: Any, metric: str, exponent: float) -> Any:
    size = np.abs(between)
    if metric == "MANHATTAN":
        return size.sum(axis=1)
    if metric == "CHEBYCHEV":
        return size.max(axis=1)
    if metric == "MINKOWSKI":
        return (size ** exponent).sum(axis=1) ** (1 / exponent)
    return np.sqrt((between * between).sum(axis=1))


def _neighbours() -> Iterator[tuple[int, int, int]]:
    for offset in np.ndindex(3, 3, 3):
        yield offset[2] - 1, offset[1] - 1, offset[0] - 1


def voronoi(points: Any, randomness: float, metric: str = "EUCLIDEAN", exponent: float = 0.5, wants_second: bool = False) -> tuple[Any, Any, Any]:
    """The distance to the nearest or second point, the colour of its cell, and its position."""
    lattice = _Lattice(points, (1, 1))
    if not lattice.is_small:
        return np.full(len(points), 0.5, np.float32), np.full((len(points), 3), 0.5, np.float32), points
    colours = lattice.values(lambda cells: _colour_of(cells.astype(np.float32)))
    nearest, second = (np.full(len(points), 8.0, np.float32) for _ in range(2))
    found, where = np.zeros((2, len(points)), np.int64), np.zeros((2, len(points), 3), np.float32)
    inside = (points - lattice.cells).astype(np.float32)
    for offset in _neighbours():
        at = lattice.at(offset)
        place = np.array(offset, np.float32) + colours[at] * np.float32(randomness)
        apart = _distance(place - inside, metric, exponent).astype(np.float32)
        is_nearest = apart < nearest
        is_second = ~is_nearest & (apart < second)
        for which, values in ((is_nearest, (nearest, found[0], where[0])), (is_second, (apart, at, place))):
            second[which], found[1][which], where[1][which] = (one[which] for one in values)
        nearest[is_nearest], found[0][is_nearest], where[0][is_nearest] = apart[is_nearest], at[is_nearest], place[is_nearest]
    chosen = 1 if wants_second else 0
    return (second if wants_second else nearest), colours[found[chosen]], where[chosen] + lattice.cells


def voronoi_edge(points: Any, randomness: float) -> Any:
    """The distance to the edge of the cell."""
    lattice = _Lattice(points, (1, 1))
    if not lattice.is_small:
        return np.full(len(points), 0.25, np.float32)
    colours = lattice.values(lambda cells: _colour_of(cells.astype(np.float32)))
    inside = (points - lattice.cells).astype(np.float32)
    others = [np.array(offset, np.float32) + colours[lattice.at(offset)] * np.float32(randomness) - inside for offset in _neighbours()]
    nearest = np.stack([(one * one).sum(axis=1) for one in others]).argmin(axis=0)
    own = np.stack(others)[nearest, np.arange(len(points))]
    edge = np.full(len(points), 8.0, np.float32)
    for one in others:
        across = one - own
        length = np.sqrt((across * across).sum(axis=1))
        middle = ((own + one) / 2 * across).sum(axis=1) / np.maximum(length, 1e-9)
        edge = np.where(length > 0.01, np.minimum(edge, middle), edge)
    return edge


def checker(points: Any) -> Any:
    """1 where the first colour is."""
    cells = np.floor((points + 0.000001) * 0.999999).astype(np.int64)
    return (cells.sum(axis=1) % 2).astype(np.float32)  # the cell at the origin has the second colour


def brick(points: Any, size: tuple[float, float], mortar: tuple[float, float], bias: float, offset: tuple[float, int],
          squash: tuple[float, int]) -> tuple[Any, Any]:
    """The colour weight of each brick, 0 .. 1, and the share of mortar. size: width and height of a brick; mortar: its size and
    smoothness; offset, squash: an amount, and the number of rows after which it applies."""
    row = np.floor(points[:, 1] / size[1]).astype(np.int64)
    width, shift = np.full(len(points), size[0]), np.zeros(len(points))
    if offset[1] and squash[1]:
        width = width * np.where(row % squash[1] != 0, 1.0, squash[0])
        shift = np.where(row % offset[1] != 0, 0.0, width * offset[0])
    number = np.floor((points[:, 0] + shift) / width).astype(np.int64)
    x, y = points[:, 0] + shift - width * number, points[:, 1] - size[1] * row
    n = (((row << 16) + (number & 0xFFFF) + 1013) & 0x7FFFFFFF).astype(np.uint32)
    n = (n >> np.uint32(13)) ^ n
    n = (n * (n * n * np.uint32(60493) + np.uint32(19990303)) + np.uint32(1376312589)) & np.uint32(0x7FFFFFFF)
    tint = np.clip(0.5 * (n / 1073741824.0) + bias, 0, 1)
    edge = np.minimum(np.minimum(x, y), np.minimum(width - x, size[1] - y))
    if mortar[0] <= 0:
        return tint, np.zeros(len(points))
    inner = 1 - edge / mortar[0]
    share = np.ones(len(points)) if mortar[1] == 0 else np.clip(inner / mortar[1], 0, 1)
    return tint, np.where(edge >= mortar[0], 0, share * share * (3 - 2 * share))


# ---- ramps

def gradient(points: Any, kind: str) -> Any:
    x, y = points[:, 0], points[:, 1]
    if kind == "QUADRATIC":
        return np.clip(x, 0, None) ** 2
    if kind == "EASING":
        eased = np.clip(x, 0, 1)
        return eased * eased * (3 - 2 * eased)
    if kind == "DIAGONAL":
        return (x + y) / 2
    if kind == "RADIAL":
        return np.arctan2(y, x) / (2 * np.pi) + 0.5
    if kind in {"SPHERICAL", "QUADRATIC_SPHERE"}:
        near = np.clip(0.999999 - np.sqrt((points * points).sum(axis=1)), 0, None)
        return near if kind == "SPHERICAL" else near * near
    return x


def wave(points: Any, kind: str, direction: str, profile: str, distortion: tuple[float, float, float, float], phase: float) -> Any:
    """Waves. distortion: amount, detail, scale and roughness."""
    points = (points + 0.000001) * 0.999999
    axes = {"X": (0,), "Y": (1,), "Z": (2,), "DIAGONAL": (0, 1, 2), "SPHERICAL": (0, 1, 2)}[direction]
    if kind == "BANDS":
        angle = points[:, axes].sum(axis=1) * (10 if direction == "DIAGONAL" else 20)
    else:
        about = axes if direction == "SPHERICAL" else [axis for axis in range(3) if axis not in axes]
        angle = 20 * np.sqrt((points[:, about] ** 2).sum(axis=1))
    angle = angle + phase
    if distortion[0] != 0:
        angle = angle + distortion[0] * (_fractal(points * distortion[2], distortion[1], distortion[3]) * 2 - 1)
    if profile == "SIN":
        return 0.5 + 0.5 * np.sin(angle - np.pi / 2)
    turns = angle / (2 * np.pi)
    return turns - np.floor(turns) if profile == "SAW" else np.abs(turns - np.floor(turns + 0.5)) * 2


def magic(points: Any, depth: int, distortion: float) -> Any:
    """The magic texture, n x 3."""
    px, py, pz = np.fmod(points, 2 * np.pi).T
    x, y, z = np.sin((px + py + pz) * 5), np.cos((-px + py - pz) * 5), -np.cos((-px - py + pz) * 5)
    if depth > 0:
        x, y, z = x * distortion, y * distortion, z * distortion
        y = -np.cos(x - y + z) * distortion
        steps: list[Callable[[Any, Any, Any], tuple[Any, Any, Any]]] = [
            lambda x, y, z: (np.cos(x - y - z), y, z), lambda x, y, z: (x, y, np.sin(-x - y - z)),
            lambda x, y, z: (-np.cos(-x + y - z), y, z), lambda x, y, z: (x, -np.sin(-x + y + z), z),
            lambda x, y, z: (x, -np.cos(-x + y + z), z), lambda x, y, z: (np.cos(x + y + z), y, z),
            lambda x, y, z: (x, y, np.sin(x + y - z)), lambda x, y, z: (-np.cos(-x - y + z), y, z),
            lambda x, y, z: (x, -np.sin(x - y + z), z)]
        changed = (0, 2, 0, 1, 1, 0, 2, 0, 1)
        for step, axis in list(zip(steps, changed))[:max(depth - 1, 0)]:
            three = list(step(x, y, z))
            three[axis] = three[axis] * distortion
            x, y, z = three
    if distortion != 0:
        x, y, z = (one / (distortion * 2) for one in (x, y, z))
    return np.stack([0.5 - x, 0.5 - y, 0.5 - z], axis=-1)
