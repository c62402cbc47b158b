# SPDX-License-Identifier: GPL-3.0-or-later
"""A sun for a scene without light."""

from __future__ import annotations

import math

import bpy
from bpy.types import Context, Operator, Scene
from mathutils import Euler

ENERGY = 3.0  # W/m2: white points that face the sun come close to white
FRONT = Euler((math.radians(90.0), 0.0, 0.0))  # a view along Blender's y axis, for scenes without a camera
UPPER_LEFT = Euler((math.radians(-35.0), math.radians(-35.0), 0.0))  # of a view, from straight along it


def is_dark(scene: Scene) -> bool:
    """Whether no light can reach points: no lamp that is on, no studio light, no headlight, and a black world without nodes."""
    studio, world = scene.patina.studio, scene.world
    if studio.use_light or studio.use_headlight:
        return False
    if any(obj.type == 'LIGHT' and not obj.hide_render and obj.data.energy > 0.0 for obj in scene.objects):
        return False
    if world is None:
        return True
    nodes = world.node_tree.nodes if world.node_tree and (bpy.app.version >= (5, 0, 0) or world.use_nodes) else ()
    backgrounds = [node for node in nodes if node.bl_idname == 'ShaderNodeBackground']
    if not backgrounds:
        return not any(world.color) and not len(nodes)
    return all(not node.inputs["Strength"].is_linked and not node.inputs["Color"].is_linked and
               (node.inputs["Strength"].default_value <= 0.0 or not any(node.inputs["Color"].default_value[:3])) for node in backgrounds)


class PATINA_OT_add_light(Operator):
    """Add a sun that shines from the upper left of the camera's view"""

    bl_idname = "scene.patina_add_light"
    bl_label = "Add Light"
    bl_options = {'REGISTER', 'UNDO'}

    def execute(self, context: Context) -> set[str]:
        light = bpy.data.lights.new("Sun", 'SUN')
        light.energy = ENERGY
        obj = bpy.data.objects.new("Sun", light)
        camera = context.scene.camera
        view = camera.matrix_world.to_3x3().normalized() if camera else FRONT.to_matrix()
        obj.rotation_euler = (view @ UPPER_LEFT.to_matrix()).to_euler()
        context.collection.objects.link(obj)
        self.report({'INFO'}, "Added a sun")
        return {'FINISHED'}


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_add_light,))
