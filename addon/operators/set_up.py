# SPDX-License-Identifier: GPL-3.0-or-later
"""From Blender's start scene to a picture of points: engine, camera, look and light, offered after the first import."""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy
from bpy.types import Context, Object, Operator, Scene
from mathutils import Vector

from .. import native, point_data
from ..draw.engine import PatinaRenderEngine
from . import analyze, clip_range, first_look, stations

START = {"Cube": 'MESH', "Camera": 'CAMERA', "Light": 'LIGHT'}  # what Blender begins with
LEAST = 0.05  # W/m2 from a lamp that count as light; the start scene's gives a cube beside it 1.5


def untouched(scene: Scene) -> bool:
    """Whether there is nothing but points, what came with them, and what Blender's start scene holds."""
    others = [obj for obj in scene.objects if not point_data.is_cloud(obj) and not _imported(obj)]
    return (not bpy.data.filepath and len(bpy.data.scenes) == 1 and "EEVEE" in scene.render.engine
            and all(START.get(obj.name) == obj.type for obj in others) and all(map(_as_it_came, others)))


def _imported(obj: Object) -> bool:
    """Whether an import added it beside the points: a station, or a camera at one."""
    return obj.parent is not None and (point_data.is_cloud(obj.parent) or stations.PROPERTY in obj.parent) and obj.type in {'EMPTY', 'CAMERA'} \
        and (obj.type == 'CAMERA' or stations.PROPERTY in obj)


def _as_it_came(obj: Object) -> bool:
    return obj.type != 'MESH' or len(obj.data.vertices) == 8 and obj.matrix_world.is_identity and not obj.modifiers


def unlit(scene: Scene, points: Sequence[Object]) -> bool:
    """Whether some of the points get light of none. Those with colours of their own too: a ramp over heights or classes is lit."""
    lamps = [lamp for lamp in scene.objects if lamp.type == 'LIGHT' and not lamp.hide_render]
    if scene.patina.studio.use_light or any(lamp.data.type == 'SUN' and lamp.data.energy > LEAST for lamp in lamps):
        return False
    return not lamps or not all(any(_reaches(lamp, corners) for lamp in lamps) for corners in (_corners(scene, obj) for obj in points))


def _corners(scene: Scene, obj: Object) -> list[Vector]:
    """In the world, of the box without strays; of a file that cannot be read the box that the object shows."""
    found = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    try:
        corners = analyze.dense_corners(found, scene.frame_current)
    except native.PatinaError:
        corners = []
    return [obj.matrix_world @ corner for corner in corners or map(Vector, obj.bound_box)]


def _reaches(lamp: Object, corners: Sequence[Vector]) -> bool:
    """Where it stands amid them, too, it must reach. No sun."""
    away = sum((lamp.matrix_world.translation - corner).length_squared for corner in corners) / 8.0
    return lamp.data.type != 'SUN' and lamp.data.energy > LEAST * 4.0 * math.pi * math.pi * max(away, 1e-12)


class PATINA_OT_set_up(Operator):
    """Set up the scene: delete the default cube, frame the points, look through the camera. Scan colors are unlit, intensity and classes become colors, other points get the style Plaster. Adds a headlight if no light reaches the points"""

    bl_idname = "scene.patina_set_up"
    bl_label = "Set Up for Points"
    bl_options = {'REGISTER', 'UNDO'}

    def execute(self, context: Context) -> set[str]:
        points = [obj for obj in context.view_layer.objects if point_data.is_cloud(obj) and obj.visible_get()]
        if not points:
            self.report({'ERROR'}, "Patina: the scene has no points")
            return {'CANCELLED'}
        for text in apply(context, points):
            self.report({'INFO'}, text)
        return {'FINISHED'}


def apply(context: Context, points: Sequence[Object]) -> list[str]:
    """Sets up the scene for visible points. Returns what was done, in sentences without full stops."""
    scene = context.scene
    cube = scene.objects.get("Cube")
    fresh = untouched(scene)
    if fresh and cube:
        bpy.data.objects.remove(cube)
    scene.render.engine = PatinaRenderEngine.bl_idname
    context.view_layer.update()
    for obj in context.view_layer.objects:
        obj.select_set(obj in points)
    said = _frame(context, points, fresh) if scene.camera else []
    found = first_look.found_in(scene, points)
    said += first_look.choose(scene, found)
    if unlit(scene, points):
        scene.patina.studio.use_headlight = True
        lit = any(first_look.is_lit(obj, each.kind) for obj, each in found.items())
        said.append("No light reaches the points. Enabled the headlight" if lit else
                    "Enabled the headlight for color ramps and lit styles. The points' own colors are shown without light")
    return said


def _frame(context: Context, points: Sequence[Object], fresh: bool) -> list[str]:
    """The camera and the 3D views see the points, and their clip distances fit. fresh: nobody has chosen others. Returns what was set."""
    scene = context.scene
    camera = scene.camera.data
    before = camera.clip_start, camera.clip_end
    try:
        corners = analyze.corners_of(context.evaluated_depsgraph_get(), set(points), scene.frame_current)
    except native.PatinaError as error:
        return [f"The camera stays where it is: {error}"]
    if corners:
        analyze.frame(context, corners)
        analyze.widen_clips(scene.camera, corners)
    _fit_clips(context, points, fresh)
    _look_through_camera(context)
    changed = [f"{name} to {new:.6g}" for name, old, new in
               zip(("Clip Start", "Clip End"), before, (camera.clip_start, camera.clip_end), strict=True) if new != old]
    return [f"Set the camera's {' and '.join(changed)}"] if changed else []


def _fit_clips(context: Context, points: Sequence[Object], fresh: bool) -> None:
    """The clip distances of the scene's camera and of the 3D views, for the points as they were framed just now."""
    context.view_layer.update()
    corners = [corner for obj in points for corner in _corners(context.scene, obj)]
    extent = clip_range.extent_of(corners)
    eye = context.scene.camera.matrix_world.translation
    clip_range.fit(context.scene.camera.data, extent, max((corner - eye).length for corner in corners), not fresh)
    for area in context.screen.areas if context.screen else ():
        space = area.spaces.active
        if area.type == 'VIEW_3D' and space.region_3d:
            clip_range.fit(space, extent, 2.0 * (space.region_3d.view_distance + extent), not fresh)


def _look_through_camera(context: Context) -> None:
    """In the largest 3D view of the window, as 0 on the number pad does: the points may lie far from where it looks."""
    views = [area for area in context.window.screen.areas if area.type == 'VIEW_3D'] if context.window else []
    if views:
        space = max(views, key=lambda area: area.width * area.height).spaces[0]
        if space.region_3d:
            space.region_3d.view_perspective = 'CAMERA'


def offer(context: Context) -> None:
    """Asks, once the points are there, and goes away by itself."""
    def draw(self: bpy.types.Menu, _context: Context) -> None:
        self.layout.operator(PATINA_OT_set_up.bl_idname, icon='RESTRICT_RENDER_OFF')
        self.layout.label(text="Set the engine, camera and light for point clouds")

    context.window_manager.popup_menu(draw, title="Render with Patina?", icon='QUESTION')


def _menu(self: bpy.types.Menu, context: Context) -> None:
    """Where it is found by its name too: F3 looks through menus."""
    if any(map(point_data.is_cloud, context.view_layer.objects)):
        self.layout.separator()
        self.layout.operator(PATINA_OT_set_up.bl_idname)


_register, _unregister = bpy.utils.register_classes_factory((PATINA_OT_set_up,))


def register() -> None:
    _register()
    bpy.types.TOPBAR_MT_render.append(_menu)


def unregister() -> None:
    bpy.types.TOPBAR_MT_render.remove(_menu)
    _unregister()
