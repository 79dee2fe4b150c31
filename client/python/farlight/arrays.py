# SPDX-License-Identifier: MIT
"""Arrays and vectors from the caller, checked and converted to the protocol's form. Every error names the argument, its value,
and the allowed values."""
from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import InvalidValue

Numbers = npt.ArrayLike
Array = npt.NDArray[Any]

IDENTITY = np.eye(4)
U32_MAX, HALF_MAX = 0xffffffff, 65504.0


def numbers(values: Numbers, field: str, wanted: str) -> Array:
    """Converts to an array of numbers, without copying one."""
    try:
        array = np.asarray(values)
    except ValueError:
        raise InvalidValue(f"its rows differ in length; allowed: {wanted}", field=field) from None
    if array.dtype.kind not in "iufb":
        given = f"{values!r:.60}" if array.ndim == 0 else f"an array of {array.dtype}"
        raise InvalidValue(f"{given} is no array of numbers; allowed: {wanted}", field=field)
    return array


def table(values: Numbers, kind: str, columns: int, field: str, count: int | None = None) -> Array:
    """A contiguous, read-only little-endian copy with this number of columns."""
    rows = "n" if count is None else str(count)
    shape = f"({rows},)" if columns == 1 else f"({rows}, {columns})"
    wanted = f"the shape {shape}, {'whole numbers of 0 .. 4294967295' if kind == '<u4' else 'numbers'}"
    array = numbers(values, field, wanted)
    if array.ndim == 1 and (columns == 1 or (count is None and array.size % columns == 0)):
        array = array.reshape(-1, columns)
    if array.ndim != 2 or array.shape[1] != columns or (count is not None and array.shape[0] != count):
        raise InvalidValue(f"an array of {array.dtype} with the shape {np.shape(values)}; allowed: {wanted}", field=field)
    if kind == "<u4" and array.size:
        if array.dtype.kind not in "iu":
            raise InvalidValue(f"an array of {array.dtype}; allowed: {wanted}", field=field,
                               remedy="make whole numbers of it with .astype(numpy.uint32)")
        if array.min() < 0 or array.max() > U32_MAX:
            raise InvalidValue(f"{array.min()} .. {array.max()}; allowed: {wanted}", field=field)
    with np.errstate(over="ignore"):  # values that are too large become infinite, and are refused below
        made = np.array(array, dtype=kind, order="C")
    if kind[1] == "f" and made.size and not (np.isfinite(made.min()) and np.isfinite(made.max())):  # min() keeps NaN
        wrong = np.argwhere(~np.isfinite(made))[0]
        raise InvalidValue(f"{array[tuple(wrong)]} at [{wrong[0]}, {wrong[1]}]; allowed: finite numbers of 32 bits", field=field)
    made.setflags(write=False)
    return made


def vector(values: Numbers, field: str, count: int = 3) -> list[float]:
    """Reads `count` finite numbers."""
    wanted = f"{count} finite numbers"
    array = numbers(values, field, wanted)
    if array.shape != (count,) or not np.isfinite(array).all():
        raise InvalidValue(f"{values!r:.80}; allowed: {wanted}", field=field)
    return [float(one) for one in array]


def number(value: Any, field: str) -> float:
    """Reads a finite number."""
    array = numbers(value, field, "a finite number")
    if array.ndim or not np.isfinite(array):
        raise InvalidValue(f"{value!r:.80}; allowed: a finite number", field=field)
    return float(array)


def transform(matrix: Numbers | None) -> list[float]:
    """Converts a 4 x 4 or 3 x 4 matrix to the protocol's 12 numbers; None: the identity."""
    wanted = "a matrix with the shape (4, 4) or (3, 4)"
    remedy = "farlight.translate(x, y, z) and farlight.look_at(eye, target) make matrices"
    array = numbers(IDENTITY if matrix is None else matrix, "transform", wanted)
    if array.shape not in ((4, 4), (3, 4)):
        raise InvalidValue(f"has the shape {array.shape}; allowed: {wanted}", field="transform", remedy=remedy)
    if array.shape == (4, 4) and array[3].tolist() != [0, 0, 0, 1]:
        raise InvalidValue(f"its last row is {array[3]}; allowed: 0 0 0 1", field="transform",
                           remedy="transpose it if its translation is in the last row")
    return [float(one) for one in array[:3].ravel().tolist()]


def as_bytes(array: Array, field: str) -> Array:
    """Converts whole numbers of 0 .. 255, or floats clipped to 0 .. 1, to uint8."""
    if array.dtype == np.uint8:
        return array
    if array.dtype.kind == "f":
        made: Array = np.rint(np.clip(np.nan_to_num(array), 0, 1) * 255).astype(np.uint8)
        return made
    if array.dtype.kind == "b" or (array.size and (array.min() < 0 or array.max() > 255)):
        raise InvalidValue(f"{array.min()} .. {array.max()} of {array.dtype}; allowed: whole numbers of 0 .. 255, or floats "
                           "of 0 .. 1", field=field)
    return array.astype(np.uint8)


def image(values: Numbers, field: str) -> Array:
    """Converts grey, x 3 or x 4 values to height x width x 4 of uint8."""
    wanted = "the shape (height, width), (height, width, 3) or (height, width, 4), uint8 or floats of 0 .. 1"
    array = numbers(values, field, wanted)
    if array.ndim == 3 and array.shape[2] == 1:
        array = array[..., 0]
    if array.ndim not in (2, 3) or (array.ndim == 3 and array.shape[2] not in (3, 4)) or not array.size:
        raise InvalidValue(f"an array of {array.dtype} with the shape {array.shape}; allowed: {wanted}", field=field)
    texels = np.full(array.shape[:2] + (4,), 255, np.uint8)
    texels[..., :3 if array.ndim == 2 else array.shape[2]] = as_bytes(array[..., None] if array.ndim == 2 else array, field)
    return texels


def colours(values: Numbers, field: str, count: int) -> Array:
    """Converts x 3 or x 4 values to count x 4 of uint16, or of uint8 if that loses nothing."""
    wanted = f"the shape ({count}, 3) or ({count}, 4), uint8 or floats of 0 .. 1"
    array = numbers(values, field, wanted)
    if array.ndim != 2 or array.shape[0] != count or array.shape[1] not in (3, 4):
        raise InvalidValue(f"an array of {array.dtype} with the shape {array.shape}; allowed: {wanted}", field=field)
    made = np.full((count, 4), 65535, "<u2")
    if array.dtype.kind == "f":
        made[:, :array.shape[1]] = np.rint(np.clip(np.nan_to_num(array), 0, 1) * 65535)
    else:
        made[:, :array.shape[1]] = as_bytes(array, field) * np.uint16(257)
    return made if (made % 257).any() else (made // 257).astype(np.uint8)


def sky(values: Numbers, field: str) -> Array:
    """Converts height x width x 3 linear floats to height x width x 4 half floats."""
    wanted = "the shape (height, width, 3), finite linear numbers of 0 and more"
    pixels = numbers(values, field, wanted)
    if pixels.ndim != 3 or pixels.shape[2] != 3 or not pixels.size:
        raise InvalidValue(f"an array of {pixels.dtype} with the shape {pixels.shape}; allowed: {wanted}", field=field)
    if not np.isfinite(pixels).all():
        raise InvalidValue(f"has NaN or infinity; allowed: {wanted}", field=field)
    halves = np.zeros(pixels.shape[:2] + (4,), "<f2")
    halves[..., :3] = np.clip(pixels, 0, HALF_MAX)
    return halves
