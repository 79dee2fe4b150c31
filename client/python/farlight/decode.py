# SPDX-License-Identifier: MIT
"""Pixels of frames: raw, or decoded by the system's libzstd and libturbojpeg. Lossless pixels are checked against the daemon's
digest if the system has libxxhash. H.264 and `predicted` are not supported."""
from __future__ import annotations

import ctypes
import functools

import numpy as np
import numpy.typing as npt

from . import libraries, messages
from .errors import InvalidValue, ProtocolError
from .messages import Encoding, FrameBegin

Pixels = npt.NDArray[np.uint8]

DECODED = (Encoding.RAW, Encoding.ZSTD, Encoding.JPEG)
JPEG_EXTRA_BYTES = 65536  # besides its pixels, as in the C client
RGBA, STOP_ON_WARNING, LIMIT_SCANS = 7, 8192, 32768  # constants of turbojpeg.h

_POINTER, _SIZE, _INT, _LONG = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int, ctypes.c_ulong
_OUT = ctypes.POINTER(ctypes.c_int)


@functools.cache
def _zstd() -> ctypes.CDLL:
    library = libraries.need("zstd", 1, "frames in zstd", ", or leave encoding out")
    library.ZSTD_decompress.argtypes, library.ZSTD_decompress.restype = [_POINTER, _SIZE, _POINTER, _SIZE], _SIZE
    library.ZSTD_isError.argtypes = [_SIZE]
    return library


@functools.cache
def _turbojpeg() -> ctypes.CDLL:
    library = libraries.need("turbojpeg", 0, "frames in jpeg", ", or leave encoding out")
    library.tjInitDecompress.restype = _POINTER
    library.tjDestroy.argtypes = [_POINTER]
    library.tjDecompressHeader3.argtypes = [_POINTER, _POINTER, _LONG, _OUT, _OUT, _OUT, _OUT]
    library.tjDecompress2.argtypes = [_POINTER, _POINTER, _LONG, _POINTER, _INT, _INT, _INT, _INT, _INT]
    return library


def check_wanted(render: messages.Render) -> None:
    """Checks that frames of the job can be decoded. Raises InvalidValue, or FileFailed for a missing library."""
    for name in ("encoding", "still_encoding"):
        encoding = Encoding(int(getattr(render, name)))
        if encoding not in DECODED:
            raise InvalidValue(f"{encoding.word} cannot be decoded here; allowed: {', '.join(one.word for one in DECODED)}",
                               field=f"render.{name}",
                               remedy="use jpeg" if encoding == Encoding.H264 else "use zstd")
        if encoding == Encoding.ZSTD:
            _zstd()
        if encoding == Encoding.JPEG:
            _turbojpeg()


def encoded_bytes_max(begin: FrameBegin, pixels_bytes: int) -> int:
    """Maximum size of a correctly encoded picture."""
    if begin.encoding == Encoding.ZSTD:  # ZSTD_compressBound
        return pixels_bytes + (pixels_bytes >> 8) + max(0, (131072 - pixels_bytes) >> 11)
    if begin.encoding == Encoding.JPEG:  # tjBufSize without subsampling
        return 6 * (begin.width + -begin.width % 8) * (begin.height + -begin.height % 8) + 2048 + JPEG_EXTRA_BYTES
    return pixels_bytes


def _decode_zstd(encoded: Pixels, pixels: Pixels) -> None:
    size = _zstd().ZSTD_decompress(pixels.ctypes.data, pixels.size, encoded.ctypes.data, encoded.size)
    if _zstd().ZSTD_isError(size) or size != pixels.size:
        raise ProtocolError(f"the frame does not decompress to its {pixels.size} bytes", field="frame_data")


def _decode_jpeg(encoded: Pixels, pixels: Pixels, begin: FrameBegin) -> None:
    library = _turbojpeg()
    decoder = library.tjInitDecompress()
    if not decoder:
        raise MemoryError
    size = [ctypes.c_int() for _ in range(4)]
    try:
        failed = library.tjDecompressHeader3(decoder, encoded.ctypes.data, encoded.size, *size)
        if failed or (size[0].value, size[1].value) != (begin.width, begin.height):
            raise ProtocolError(f"this is no JPEG of {begin.width}x{begin.height}", field="frame_data")
        # A hostile JPEG may have any number of scans, each of which costs time for all pixels.
        if library.tjDecompress2(decoder, encoded.ctypes.data, encoded.size, pixels.ctypes.data, begin.width, 0, begin.height,
                                 RGBA, STOP_ON_WARNING | LIMIT_SCANS):
            raise ProtocolError("the JPEG is damaged", field="frame_data")
    finally:
        library.tjDestroy(decoder)


@functools.cache
def _xxhash() -> ctypes.CDLL | None:
    library = libraries.find("xxhash", 0)
    if library is not None:
        library.XXH3_64bits.argtypes, library.XXH3_64bits.restype = [_POINTER, _SIZE], ctypes.c_uint64
    return library


def decode(begin: FrameBegin, data: bytearray, pixels_bytes: int) -> tuple[memoryview, bool]:
    """Returns the pixels, read-only, and whether they match the daemon's digest; raises ProtocolError if they do not."""
    encoded = np.frombuffer(data, np.uint8)
    pixels = encoded if begin.encoding == Encoding.RAW else np.empty(pixels_bytes, np.uint8)
    if begin.encoding == Encoding.JPEG:
        _decode_jpeg(encoded, pixels, begin)
    elif begin.encoding == Encoding.ZSTD:
        _decode_zstd(encoded, pixels)
    library = _xxhash() if begin.encoding != Encoding.JPEG else None
    if library is not None and library.XXH3_64bits(pixels.ctypes.data, pixels.size) != begin.digest:
        raise ProtocolError(f"the pixels of frame {begin.frame} differ from those that were rendered", field="frame_begin.digest")
    return pixels.data.toreadonly(), library is not None
