# SPDX-License-Identifier: MIT
"""PNG files, written with the standard library."""
from __future__ import annotations

import os
import struct
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt

from . import files
from .errors import InvalidValue

_UP = 2  # the filter: each byte minus the one above it


def encode(pixels: npt.NDArray[Any]) -> bytes:
    """Height x width (grey), x 3 or x 4 of uint8."""
    pixels = np.asarray(pixels)
    if pixels.dtype != np.uint8 or pixels.ndim not in (2, 3) or pixels.shape[2:] not in ((), (3,), (4,)) or not pixels.size:
        raise InvalidValue(f"an array of {pixels.dtype} with the shape {pixels.shape}; allowed: uint8 with the shape (height, "
                           "width), (height, width, 3) or (height, width, 4)", field="pixels",
                           remedy="render without `layers` and `format`, whose floats have no tone map")
    height, width = pixels.shape[:2]
    channels = 1 if pixels.ndim == 2 else pixels.shape[2]
    rows = np.ascontiguousarray(pixels).reshape(height, width * channels)
    filtered = np.full((height, 1 + width * channels), _UP, np.uint8)
    filtered[0, 1:] = rows[0]
    np.subtract(rows[1:], rows[:-1], out=filtered[1:, 1:])

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", width, height, 8, {1: 0, 3: 2, 4: 6}[channels], 0, 0, 0)
    return b"".join((b"\x89PNG\r\n\x1a\n", chunk(b"IHDR", head), chunk(b"sRGB", b"\0"),
                     chunk(b"IDAT", zlib.compress(filtered.tobytes(), 6)), chunk(b"IEND", b"")))


def write(path: str | os.PathLike[str], pixels: npt.NDArray[Any]) -> None:
    """Complete or not at all."""
    data = encode(pixels)
    files.write(path, lambda file: file.write(data))
