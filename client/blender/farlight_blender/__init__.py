# SPDX-License-Identifier: MIT
"""A render engine for Blender: F12, animations and the viewport on a farlight daemon."""
import pathlib
import sys

bl_info = {
    "name": "farlight",
    "description": "Renders on a farlight daemon: of one's own, or far away",
    "author": "the farlight authors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Render properties, render engine farlight",
    "category": "Render",
}

# Blender's own Python may not have the package farlight: a file made by `make blender-addon` has it.
_BUNDLED = pathlib.Path(__file__).parent / "bundled"
if _BUNDLED.is_dir() and str(_BUNDLED) not in sys.path:
    sys.path.append(str(_BUNDLED))

from . import engine, settings  # noqa: E402  pylint: disable=wrong-import-position


def register() -> None:
    """Blender calls it when the add-on is enabled."""
    settings.register()
    engine.register()


def unregister() -> None:
    """Blender calls it when the add-on is disabled."""
    engine.unregister()
    settings.unregister()
