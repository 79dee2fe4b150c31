# SPDX-License-Identifier: MIT
"""Reading of Blender's shader nodes: where a socket's value comes from."""
from __future__ import annotations

from typing import Optional

import bpy


def source(socket: Optional[bpy.types.NodeSocket]) -> Optional[bpy.types.NodeSocket]:
    """The output that feeds it, past reroutes; None: it has its own value."""
    while socket is not None and socket.is_linked:
        start = socket.links[0].from_socket
        if start.node.type != "REROUTE":
            return start
        socket = start.node.inputs[0]
    return None


def _shader(tree: bpy.types.NodeTree, name: str) -> Optional[bpy.types.Node]:
    output = tree.get_output_node("CYCLES") or tree.get_output_node("ALL")
    start = source(output.inputs[name]) if output is not None else None
    return start.node if start else None


def surface(tree: bpy.types.NodeTree) -> Optional[bpy.types.Node]:
    """The shader of the active output."""
    return _shader(tree, "Surface")


def volume(tree: bpy.types.NodeTree) -> Optional[bpy.types.Node]:
    """The volume of the active output."""
    return _shader(tree, "Volume")


def number(socket: Optional[bpy.types.NodeSocket], missing: float = 0.0) -> float:
    """Its value, or that of a Value node."""
    if socket is None:
        return missing
    start = source(socket)
    if start is not None and start.node.type == "VALUE":
        return float(start.default_value)
    value = socket.default_value
    return float(value if isinstance(value, (int, float)) else sum(value[:3]) / 3)


def colour(socket: bpy.types.NodeSocket) -> tuple[tuple[float, float, float], bool]:
    """Its colour, or that of an RGB node; and whether nothing else feeds it."""
    start = source(socket)
    if start is not None and start.node.type == "RGB":
        value = start.default_value
        return (value[0], value[1], value[2]), True
    value = socket.default_value
    return (value[0], value[1], value[2]), start is None


def first(node: bpy.types.Node, *names: str) -> Optional[bpy.types.NodeSocket]:
    """The input that has one of the names: they differ between versions of Blender."""
    return next((node.inputs[name] for name in names if name in node.inputs), None)
