# SPDX-License-Identifier: GPL-3.0-or-later
"""Combine by Depth: Cycles or EEVEE renders the scene, Patina its points, and the compositor puts them together by who is nearer."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty
from bpy.types import Context, Operator, Scene, TOPBAR_MT_render

from ..sync.view import combination, pairs
from ..sync.view.pairs import MARK


class PATINA_OT_combine(Operator):
    """Render this scene with Cycles or EEVEE, and add Patina's points in the compositor. A second scene with the same objects, camera, resolution and frames renders the points. The nearer surface is shown"""

    bl_idname = "scene.patina_combine"
    bl_label = "Combine with Points by Depth"
    bl_options = {'REGISTER', 'UNDO'}

    engine: EnumProperty(
        name="Engine", default='CYCLES', description="Engine that renders everything except the points",
        items=(('CYCLES', "Cycles", "Cycles", 0), ('EEVEE', "EEVEE", "EEVEE", 1)))

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.scene is not None and pairs.first_of(context.scene) is None

    def execute(self, context: Context) -> set[str]:
        scene, layer = context.scene, context.view_layer.name
        if scene.camera is None:
            self.report({'ERROR'}, "Patina: the scene has no camera")
            return {'CANCELLED'}
        eevee = 'BLENDER_EEVEE_NEXT' if (4, 2, 0) <= bpy.app.version < (5, 0, 0) else 'BLENDER_EEVEE'
        try:
            scene.render.engine = 'CYCLES' if self.engine == 'CYCLES' else eevee
        except TypeError:
            self.report({'ERROR'}, f"Patina: this Blender has no {self.engine}: its add-on is disabled")
            return {'CANCELLED'}
        if self.engine == 'CYCLES' and scene.cycles.use_denoising and not _denoises():
            scene.cycles.use_denoising = False  # else F12 ends with an error and no picture
            self.report({'WARNING'}, "Denoise is off now: this Blender's Cycles was built without it")
        points = _points_scene(scene)
        for one in (scene, points):
            one.view_layers[layer].use_pass_z = True
        combination.link(scene, points, layer)
        self.report({'INFO'}, f"F12 renders '{scene.name}' with points now; Patina's settings are in scene '{points.name}'")
        return {'FINISHED'}


def _denoises() -> bool:
    """Whether Cycles was built with its denoiser: Debian's was not, though its new scenes ask for it."""
    try:
        import _cycles
    except ImportError:
        return True
    return getattr(_cycles, "with_openimagedenoise", True)


class PATINA_OT_other_scene(Operator):
    """Switch this window to the other one of the two combined scenes"""

    bl_idname = "scene.patina_other"
    bl_label = "Go to Other Scene"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.scene is not None and _other(context.scene) is not None

    def execute(self, context: Context) -> set[str]:
        context.window.scene = _other(context.scene)
        return {'FINISHED'}


def _other(scene: Scene) -> Scene | None:
    return pairs.first_of(scene) or pairs.points_of(scene)


def _points_scene(scene: Scene) -> Scene:
    """A scene of the same objects that Patina draws, without faces and without background. The one from last time goes."""
    old = pairs.points_of(scene)
    points = scene.copy()  # collections and objects are the same
    if old:  # what was set there stays, and what lies in it alone
        for name in old.patina.keys():
            points.patina[name] = old.patina[name]
        pairs.bring_own(points, old)
        combination.hand_over(scene, old, points)
        bpy.data.scenes.remove(old)
    points.name = f"{scene.name} Points"
    points[MARK] = scene
    pairs.follow(points, scene)
    points.render.engine = 'PATINA'
    points.render.film_transparent = True
    points.patina.meshes = 'OFF'
    if bpy.app.version < (5, 0, 0):
        points.use_nodes = False
    else:
        combination.set_tree(points, None)
    return points


def _menu(self: bpy.types.Menu, _context: Context) -> None:
    self.layout.operator_menu_enum(PATINA_OT_combine.bl_idname, "engine", text="Combine Points by Depth with")


def register() -> None:
    bpy.utils.register_class(PATINA_OT_combine)
    bpy.utils.register_class(PATINA_OT_other_scene)
    TOPBAR_MT_render.append(_menu)


def unregister() -> None:
    TOPBAR_MT_render.remove(_menu)
    bpy.utils.unregister_class(PATINA_OT_other_scene)
    bpy.utils.unregister_class(PATINA_OT_combine)
