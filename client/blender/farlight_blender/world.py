# SPDX-License-Identifier: MIT
"""Blender's world as the environment."""
from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import bpy

from . import images, nodes

if TYPE_CHECKING:
    from .mirror import Mirror

# The middle of Blender's picture is +x, the middle of the protocol's is -z, which is Blender's +y: a quarter turn about the
# vertical.
QUARTER_TURN = -math.pi / 2


def _turn(mirror: Mirror, node: nodes.Node) -> float:
    """The rotation of the picture about the vertical by a Mapping node before it."""
    mapping = nodes.source(node.inputs["Vector"])
    if mapping is None or mapping.node.type == "TEX_COORD":
        return 0.0
    rotation = mapping.node.inputs["Rotation"].default_value if mapping.node.type == "MAPPING" else (0, 0, 0)
    if mapping.node.type != "MAPPING" or abs(rotation[0]) + abs(rotation[1]) > 1e-6:
        mirror.note("the world's picture is turned about the vertical axis alone")
    # Mapping rotates the direction of the lookup, so the picture turns the other way.
    return -float(rotation[2])


def update(mirror: Mirror, scene: bpy.types.Scene) -> None:
    """Sets the environment."""
    world = scene.world
    if world is None:
        mirror.scene.set_environment((0, 0, 0))
        return
    group = mirror.light_groups.get(world.lightgroup, 0)
    if world.use_nodes and world.node_tree and nodes.volume(world.node_tree):
        mirror.note("the world's volume is not drawn")
    background = nodes.surface(world.node_tree) if world.use_nodes and world.node_tree else None
    if background is None or background.type != "BACKGROUND":
        if background is not None:
            mirror.note(f"the world's node {background.name} is not known: its viewport colour is used")
        mirror.scene.set_environment(tuple(world.color), light_group=group)
        return
    strength = nodes.number(background.inputs["Strength"])
    start = nodes.source(background.inputs["Color"])
    if start is not None and start.node.type == "TEX_ENVIRONMENT" and start.node.image:
        if start.node.projection != "EQUIRECTANGULAR":
            mirror.note("a mirror ball is taken as an equirectangular picture")
        image: Any = images.linear(start.node.image)
        if image is not None:
            mirror.scene.set_environment((strength,) * 3, image, rotation=QUARTER_TURN + _turn(mirror, start.node),
                                         light_group=group)
            return
    colour, is_known = nodes.colour(background.inputs["Color"])
    if not is_known:
        mirror.note("the world's colour comes from unsupported nodes")
    mirror.scene.set_environment(tuple(one * strength for one in colour), light_group=group)
