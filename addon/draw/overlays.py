# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's overlays over the image in a 3D view: which of them the points hide.

Up to Blender 4.3 the overlays test against the depth that an engine writes in view_draw. Blender 4.4 rewrote the overlays: they clear that
depth and draw another one of meshes with faces, PointCloud objects and the like (overlay_instance.cc, is_render_depth_available). Vertices of
meshes without faces write none, so their dots covered the whole image. There the overlays that the points hide are erased after Blender has
drawn them: in a POST_VIEW handler the bound framebuffer holds the overlays alone, with their depth. Nothing of the scene, the view or the
preferences changes. The handler also draws again what has no depth and was erased too: the 3D cursor and the origins of objects; and, in
Edit Mode, the selected vertices, for the dots of all vertices are hidden.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader
from mathutils import Matrix, Vector

from .. import native
from ..description.scene import SceneDescription
from ..sync.points import attributes
from . import cryptomatte
from .over_views import OverViews

KEEPS_DEPTH = bpy.app.version < (4, 4, 0)  # whether overlays test against the depth that an engine writes
FAR = 1e30  # of a depth: nothing is there

MOST_ORIGINS = 1000  # that are drawn again
CORNERS = 16  # of a disc
CURSOR = (4.0, 10.0, 20.0)  # pixels: where the lines of the 3D cursor begin, the radius of its ring, where the lines end

Color = tuple[float, float, float, float]
_waiting: dict[int, Callable[[], None]] = {}  # by region: work for the end of its drawing


def after(region: bpy.types.Region, work: Callable[[], None]) -> None:
    """Calls work() once, after Blender has drawn the overlays of the region that is drawn now."""
    _waiting[region.as_pointer()] = work


def _after_view() -> None:
    work = _waiting.pop(bpy.context.region.as_pointer(), None)
    if work:
        try:
            work()
        finally:
            gpu.state.depth_test_set('NONE')
            gpu.state.depth_mask_set(False)
            gpu.state.blend_set('NONE')


# ---- selected vertices -----------------------------------------------------------------------------------------------


def selected_vertices(context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> np.ndarray | None:
    """(n, 3) float32, world positions of the vertices that are selected in Edit Mode, of meshes without faces. None: no such mesh is
    edited."""
    found = []
    for obj in context.objects_in_mode if context.mode == 'EDIT_MESH' else ():
        evaluated = obj.evaluated_get(depsgraph)
        with attributes.readable(evaluated) as mesh:
            if mesh is None or len(mesh.polygons):
                continue
            flags, places = np.empty(len(mesh.vertices), bool), np.empty(3 * len(mesh.vertices), np.float32)
            mesh.vertices.foreach_get("select", flags)
            mesh.vertices.foreach_get("co", places)
        matrix = np.array(evaluated.matrix_world, np.float64)
        found.append((places.reshape(-1, 3)[flags] @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32))
    return np.concatenate(found) if found else None


# ---- what has no depth -----------------------------------------------------------------------------------------------


def draw_marks(context: bpy.types.Context) -> None:
    """Draws the origins of objects and the 3D cursor as Blender does."""
    overlay, scale = context.space_data.overlay, context.preferences.system.ui_scale
    triangles: list[tuple[float, float]] = []
    colors: list[Color] = []
    theme = context.preferences.themes[0].view_3d
    for place, color in _origins(context, theme) if overlay.show_object_origins else ():
        for radius, shade in ((0.5 * theme.object_origin_size + 1.0, (0.0, 0.0, 0.0, 1.0)), (0.5 * theme.object_origin_size, color)):
            _add_disc(triangles, colors, place, radius * scale, shade)
    _draw('TRIS', triangles, colors, context.region)
    if overlay.show_cursor:
        place = _on_screen(context, context.scene.cursor.location)
        if place:
            lines, colors = _cursor(place, scale, (*theme.wire, 1.0), context.scene.cursor.matrix, context.region_data.view_matrix)
            _draw('LINES', lines, colors, context.region)


def _origins(context: bpy.types.Context, theme: bpy.types.ThemeView3D) -> Iterator[tuple[tuple[float, float], Color]]:
    """Where on the screen, and in which color, the origins of selected objects lie, or those of all."""
    chosen = context.visible_objects if context.space_data.overlay.show_object_origins_all else context.selected_objects
    for obj in list(chosen)[:MOST_ORIGINS]:
        place = _on_screen(context, obj.matrix_world.translation)
        if place and obj.mode == 'OBJECT':
            shown = theme.object_active if obj == context.object else theme.object_selected
            yield place, (*shown, 1.0) if obj.select_get() else (*theme.wire, 1.0)


def _on_screen(context: bpy.types.Context, place: Vector) -> tuple[float, float] | None:
    """Pixels of the region; None outside of it or behind the view."""
    clip = context.region_data.perspective_matrix @ Vector((*place, 1.0))
    if clip.w <= 0.0:
        return None
    x, y = clip.x / clip.w, clip.y / clip.w
    return ((x + 1.0) * 0.5 * context.region.width, (y + 1.0) * 0.5 * context.region.height) if max(abs(x), abs(y)) < 1.0 else None


def _add_disc(triangles: list[tuple[float, float]], colors: list[Color], place: tuple[float, float], radius: float, color: Color) -> None:
    ring = [(place[0] + radius * math.cos(2.0 * math.pi * i / CORNERS), place[1] + radius * math.sin(2.0 * math.pi * i / CORNERS))
            for i in range(CORNERS + 1)]
    for one, other in zip(ring, ring[1:], strict=False):
        triangles += [place, one, other]
        colors += [color] * 3


def _cursor(place: tuple[float, float], scale: float, wire: Color, cursor: Matrix, view: Matrix
            ) -> tuple[list[tuple[float, float]], list[Color]]:
    """A ring of red and white dashes, and both ends of the three axes."""
    lines: list[tuple[float, float]] = []
    colors: list[Color] = []
    begin, radius, end = (scale * length for length in CURSOR)
    for i in range(CORNERS):
        for angle in (2.0 * math.pi * i / CORNERS, 2.0 * math.pi * (i + 1) / CORNERS):
            lines.append((place[0] + radius * math.cos(angle), place[1] + radius * math.sin(angle)))
        colors += [(1.0, 1.0, 1.0, 1.0) if i % 2 else (1.0, 0.0, 0.0, 1.0)] * 2
    for axis in (view.to_3x3() @ cursor.to_3x3().normalized()).col:
        for sign in (-1.0, 1.0):
            for length in (begin, end):
                lines.append((place[0] + sign * length * axis.x, place[1] + sign * length * axis.y))
            colors += [wire] * 2
    return lines, colors


def _draw(kind: str, places: list[tuple[float, float]], colors: list[Color], region: bpy.types.Region) -> None:
    """Pixels of the region, over all that is there."""
    if not places:
        return
    gpu.state.depth_test_set('NONE')
    gpu.state.blend_set('NONE')
    shader = gpu.shader.from_builtin('FLAT_COLOR')
    at = [(2.0 * x / region.width - 1.0, 2.0 * y / region.height - 1.0, 0.0) for x, y in places]
    with gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
        gpu.matrix.load_identity()
        gpu.matrix.load_projection_matrix(Matrix())
        batch_for_shader(shader, kind, {"pos": at, "color": colors}).draw(shader)


def without_own(frame: native.Frame, description: SceneDescription, depth: np.ndarray) -> np.ndarray | None:
    """The depth, far away where a pixel shows what Blender's overlays draw a depth of: PointCloud objects and faces. None: they draw
    that of all."""
    own = [*(item.blender_depth for item in description.clouds), *(True for _ in description.meshes)]
    if KEEPS_DEPTH or not any(own):
        return depth
    if all(own):
        return None
    x0, y0, x1, y1 = description.settings.region
    shown = cryptomatte.shown_items(frame.read_numbers(), description)
    shown = shown if shown.shape == depth.shape[:2] else shown[y0:y1, x0:x1]
    return np.where(np.array([*own, False])[shown][..., None], np.float32(FAR), depth)


_over = OverViews(_after_view, 'POST_VIEW')
register = _over.register


def unregister() -> None:
    _over.unregister()
    _waiting.clear()
