# SPDX-License-Identifier: MIT
"""The system's libraries, by ctypes."""
from __future__ import annotations

import ctypes
import ctypes.util
import functools

from .errors import FileFailed


@functools.cache
def find(name: str, version: int) -> ctypes.CDLL | None:
    """None: it is not installed."""
    for file in (f"lib{name}.so.{version}", None):
        file = file or ctypes.util.find_library(name)
        try:
            return ctypes.CDLL(file) if file else None
        except OSError:
            continue
    return None


def need(name: str, version: int, purpose: str, remedy: str = "") -> ctypes.CDLL:
    """FileFailed names the package to install."""
    library = find(name, version)
    if library is None:
        raise FileFailed(f"{purpose} need this library", field=f"lib{name}",
                         remedy=f"install the package lib{name}{version}{remedy}")
    return library
