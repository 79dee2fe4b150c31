# SPDX-License-Identifier: MIT
"""PNG files, written with the standard library."""
from __future__ import annotations

import os
import struct
import tempfile
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import FileFailed, InvalidValue

_UP = 2  # the filter: each byte minus the one above it


def encode(pixels: npt.NDArray[Any]) -> bytes:
    """Height x width (grey), x 3 or x 4 of uint8."""
    if pixels.dtype != np.uint8 or pixels.ndim not in (2, 3) or (pixels.ndim == 3 and pixels.shape[2] not in (3, 4)):
        raise InvalidValue(f"has {pixels.dtype} and the shape {pixels.shape} where uint8 and (height, width[, 3 or 4]) belong",
                           field="pixels")
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
    """Complete or not at all: under a temporary name, then renamed."""
    data, name = encode(pixels), os.fspath(path)
    temporary = ""
    try:
        descriptor, temporary = tempfile.mkstemp(dir=os.path.dirname(name) or ".", prefix=".farlight-")
        with open(descriptor, "wb") as file:
            umask = os.umask(0)
            os.umask(umask)
            os.fchmod(file.fileno(), 0o666 & ~umask)
            file.write(data)
        os.replace(temporary, name)
    except OSError as why:
        if temporary and os.path.exists(temporary):
            os.unlink(temporary)
        raise FileFailed(f"cannot be written: {why.strerror}", field=name) from None
