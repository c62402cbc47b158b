# SPDX-License-Identifier: GPL-3.0-or-later
"""What Patina takes of a material: the base color."""

from __future__ import annotations

import bpy
from bpy.types import Context, Material, Node, Panel

from .. import point_data
from ..sync.points import node_colors
from . import rows
from .panels import PatinaPanel

_INPUTS = {'BSDF_PRINCIPLED': "Base Color", 'BSDF_DIFFUSE': "Color"}


class PATINA_PT_material(PatinaPanel, Panel):
    bl_label = "Surface"
    bl_context = "material"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and context.material is not None and not context.material.grease_pencil

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        material = context.material
        node = _node(material)
        if node:
            layout.template_node_view(material.node_tree, node, node.inputs[_INPUTS[node.type]])
        else:
            layout.prop(material, "diffuse_color", text="Base Color")
        unknown = node_colors.unknown_of(context.object, material) if context.object and point_data.is_cloud(context.object) else ""
        if unknown:
            rows.sentence(context, layout, unknown, 'INFO')


def _node(material: Material) -> Node | None:
    if not material.node_tree or (bpy.app.version < (5, 0, 0) and not material.use_nodes):
        return None
    return next((node for node in material.node_tree.nodes if node.type in _INPUTS), None)


register, unregister = bpy.utils.register_classes_factory((PATINA_PT_material,))
