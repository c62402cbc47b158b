# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's colour: background and ambient light."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

BLACK = (0.0, 0.0, 0.0)


def background(world: bpy.types.World | None, notices: list[str]) -> tuple[float, float, float]:
    """The colour of the Background node times its strength, or the plain colour of a world without nodes."""
    if world is None:
        return BLACK
    # Worlds always have nodes from Blender 5.0 on, where asking warns.
    if not world.node_tree or (bpy.app.version < (5, 0, 0) and not world.use_nodes):
        return tuple(world.color)
    output = world.node_tree.get_output_node('ALL')
    node = _source(output.inputs["Surface"]) if output else None
    if node is None:
        return BLACK
    if node.bl_idname != 'ShaderNodeBackground':
        notices.append(f"the world's '{node.name}' node is not drawn yet, only a Background node is")
        return BLACK
    color, strength = node.inputs["Color"], node.inputs["Strength"]
    if color.is_linked or strength.is_linked:
        notices.append("what is linked to the world's Background node is not drawn yet, only its own color is")
    return tuple(max(value * strength.default_value, 0.0) for value in color.default_value[:3])


@dataclass(frozen=True)
class Mist:
    """How far away things vanish, as Blender's world says."""

    start: float
    depth: float
    falloff: str


def mist(world: bpy.types.World | None) -> Mist | None:
    if world is None:
        return None
    settings = world.mist_settings
    return Mist(settings.start, settings.depth, settings.falloff)


def _source(socket: bpy.types.NodeSocket) -> bpy.types.Node | None:
    """The node that feeds a socket, through reroutes."""
    while socket.is_linked:
        node = socket.links[0].from_node
        if node.bl_idname != 'NodeReroute':
            return node
        socket = node.inputs[0]
    return None
