# SPDX-License-Identifier: MIT
"""Blender's images as arrays, rows from the top."""
from __future__ import annotations

import hashlib
from typing import Any, Optional

import bpy
import numpy as np


def pixels(image: bpy.types.Image) -> Optional[Any]:
    """Height x width x 4 floats as in the file; None: the image cannot be read."""
    width, height = image.size
    if not width or not height or not image.has_data and not len(image.pixels):
        return None
    values = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(values)
    values = values.reshape(height, width, image.channels)[::-1]
    if image.channels == 4:
        return values
    full = np.ones((height, width, 4), np.float32)
    full[..., :3] = values[..., :3] if image.channels == 3 else values[..., :1]
    return full


def is_srgb(image: bpy.types.Image) -> bool:
    """True if the numbers are display values; float images are linear in Blender."""
    return not image.is_float and image.colorspace_settings.name == "sRGB"


def to_linear(values: Any) -> Any:
    """Converts sRGB to linear values."""
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def from_linear(values: Any) -> Any:
    """Converts linear values to sRGB."""
    return np.where(values <= 0.0031308, values * 12.92, 1.055 * np.maximum(values, 1e-9) ** (1 / 2.4) - 0.055)


def linear(image: bpy.types.Image) -> Optional[Any]:
    """Height x width x 3 linear floats."""
    values = pixels(image)
    if values is None:
        return None
    return to_linear(values[..., :3]) if is_srgb(image) else values[..., :3]


def channel(image: bpy.types.Image, name: str) -> Optional[Any]:
    """A channel of an image, height x width linear floats: Red, Green, Blue, Alpha, or the grey of a Color."""
    values = pixels(image)
    if values is None:
        return None
    if name == "Alpha":
        return values[..., 3]
    colours = to_linear(values[..., :3]) if is_srgb(image) else values[..., :3]
    if name in {"Red", "Green", "Blue"}:
        return colours[..., ("Red", "Green", "Blue").index(name)]
    return colours @ np.array((0.2126, 0.7152, 0.0722), np.float32)


def digest(image: bpy.types.Image) -> bytes:
    """A digest that is equal for equal pictures."""
    values = pixels(image)
    told = repr((image.name_full, image.colorspace_settings.name)).encode()
    return hashlib.blake2b(told if values is None else told + np.ascontiguousarray(values).tobytes(), digest_size=16).digest()
