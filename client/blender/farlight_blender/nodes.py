# SPDX-License-Identifier: MIT
"""Reading of Blender's shader nodes: sources of sockets, across reroutes, muted nodes and the borders of groups."""
from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Optional

import bpy

LUMINANCE = (0.2126, 0.7152, 0.0722)
LINKS_MAX = 10000  # limit for one input; Blender marks cyclic links as invalid

Groups = tuple[Any, ...]  # the nodes of groups that lead to a tree, the outermost first


class _Within:
    """A part of a node tree, and the groups that lead to it, since a group used twice has its nodes twice. Other attributes are
    Blender's."""

    def __init__(self, own: Any, groups: Groups) -> None:
        self.own, self.groups = own, groups

    def __getattr__(self, name: str) -> Any:
        return getattr(self.own, name)

    def _key(self) -> tuple[int, ...]:
        return self.own.as_pointer(), *(group.as_pointer() for group in self.groups)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Within) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())


class Node(_Within):
    """A node, with sockets of its place."""

    @property
    def inputs(self) -> Sockets:
        return Sockets(self.own.inputs, self.groups)

    @property
    def outputs(self) -> Sockets:
        return Sockets(self.own.outputs, self.groups)


class Socket(_Within):
    """An input or an output; an unlinked input of a group may get its value from the group's node."""

    @property
    def node(self) -> Node:
        return Node(self.own.node, self.groups)

    @property
    def is_linked(self) -> bool:
        return bool(self.own.is_linked) if self.own.is_output else _trace(self)[0] is not None

    @property
    def default_value(self) -> Any:
        if self.own.is_output:
            return self.own.default_value
        start, end = _trace(self)
        return _as(end.own if start is None else self.own, self.own)


class Sockets:
    """Inputs or outputs of the node."""

    def __init__(self, own: Any, groups: Groups) -> None:
        self._own, self._groups = own, groups

    def __getitem__(self, which: Any) -> Any:
        found = self._own[which]
        return [Socket(one, self._groups) for one in found] if isinstance(which, slice) else Socket(found, self._groups)

    def __contains__(self, name: str) -> bool:
        return name in self._own

    def __iter__(self) -> Iterator[Socket]:
        return (Socket(one, self._groups) for one in self._own)

    def get(self, name: str) -> Optional[Socket]:
        return self[name] if name in self._own else None


def _as(given: bpy.types.NodeSocket, wanted: bpy.types.NodeSocket) -> Any:
    """Converts a socket's value to another type, by Cycles' rules: unlinked reroutes and muted nodes are 0."""
    value = getattr(given, "default_value", None)
    if value is not None and (given.node.type == "REROUTE" or given.node.mute):
        value = 0.0
    is_number, wants_number = isinstance(value, (int, float)), isinstance(getattr(wanted, "default_value", None), (int, float))
    if value is None or is_number == wants_number:
        return getattr(wanted, "default_value", None) if value is None else value
    if wants_number:
        shares = LUMINANCE if given.type == "RGBA" else (1 / 3,) * 3
        return sum(share * one for share, one in zip(shares, value))
    return (float(value),) * 3 + (1.0,) * (len(wanted.default_value) - 3)


def _named(sockets: Any, like: bpy.types.NodeSocket) -> Optional[bpy.types.NodeSocket]:
    """The socket of a group's other side."""
    return next((one for one in sockets if one.identifier == like.identifier), None)


def _behind(start: bpy.types.NodeSocket, groups: Groups) -> tuple[Optional[bpy.types.NodeSocket], Groups]:
    """Follows an output of a reroute, muted node or group to the input behind it; an output of a real node is returned itself."""
    node = start.node
    if node.type == "REROUTE":
        return node.inputs[0], groups
    if node.mute:
        return next((link.from_socket for link in node.internal_links if link.to_socket == start), None), groups
    if node.type == "GROUP_INPUT":
        return (_named(groups[-1].inputs, start), groups[:-1]) if groups else (None, groups)
    if node.type == "GROUP":
        ends = (one for one in node.node_tree.nodes if one.type == "GROUP_OUTPUT" and one.is_active_output) if node.node_tree else ()
        end = next(iter(ends), None)
        return (_named(end.inputs, start) if end else None), (*groups, node)
    return start, groups


def _trace(socket: Socket) -> tuple[Optional[Socket], Socket]:
    """The output of a real node that feeds an input; if there is none, None and the input whose own value counts."""
    at, groups = socket.own, socket.groups
    for _ in range(LINKS_MAX):
        start = next((link.from_socket for link in at.links if link.is_valid and not link.is_muted), None)
        if start is None:
            break
        found, found_groups = _behind(start, groups)
        if found is None:
            break
        if found.is_output:
            return Socket(found, found_groups), Socket(at, groups)
        at, groups = found, found_groups
    return None, Socket(at, groups)


def source(socket: Optional[Socket]) -> Optional[Socket]:
    """The output that feeds an input; None: the input has its own value."""
    return None if socket is None else _trace(socket)[0]


def _shader(tree: bpy.types.NodeTree, name: str) -> Optional[Node]:
    output = tree.get_output_node("CYCLES") or tree.get_output_node("ALL")
    start = source(Socket(output.inputs[name], ())) if output is not None else None
    return start.node if start else None


def surface(tree: bpy.types.NodeTree) -> Optional[Node]:
    """The shader of the active output."""
    return _shader(tree, "Surface")


def volume(tree: bpy.types.NodeTree) -> Optional[Node]:
    """The volume of the active output."""
    return _shader(tree, "Volume")


def number(socket: Optional[Socket], missing: float = 0.0) -> float:
    """The value of an input, or of the Value node that feeds it."""
    if socket is None:
        return missing
    start = source(socket)
    if start is not None and start.node.type == "VALUE":
        return float(start.default_value)
    value = socket.default_value
    return float(value if isinstance(value, (int, float)) else sum(value[:3]) / 3)


def colour(socket: Socket) -> tuple[tuple[float, float, float], bool]:
    """The colour of an input, or of the RGB node that feeds it; and whether no other node feeds it."""
    start = source(socket)
    if start is not None and start.node.type == "RGB":
        value = start.default_value
        return (value[0], value[1], value[2]), True
    value = socket.default_value
    return (value[0], value[1], value[2]), start is None


def first(node: Node, *names: str) -> Optional[Socket]:
    """The input with one of these names, which differ between versions of Blender."""
    return next((node.inputs[name] for name in names if name in node.inputs), None)
