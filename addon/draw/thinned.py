# SPDX-License-Identifier: GPL-3.0-or-later
"""Thinned, colored points in Wireframe, Solid and Material Preview shading, where Blender itself shows none of their colors.

Blender draws vertices without faces as black dots or not at all, and PointClouds gray in Solid shading, whatever its Color option says
(3.4 to 5.2). Material Preview shows a PointCloud with its material, so nothing is added there. Each cloud gives up to as many points as
the preferences allow: as discs that fill the spacing, drawn after the overlays, hidden by what Blender has drawn nearer. Nothing of the
scene changes. Objects in Edit Mode are left to Blender. Of linked files Blender holds a box: their points come from the saved cloud, or
from the coarsest levels of a file that is read as needed. Hidden and deleted points are left out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import bpy
import gpu
import numpy as np
from bpy.app.handlers import persistent
from gpu_extras.batch import batch_for_shader

from .. import choices, point_data
from ..sync.analyses import scans_of
from ..sync.points import attributes, edits
from ..sync.view import clips
from . import graphics, thinned_files

SHADINGS = {'WIREFRAME', 'SOLID', 'MATERIAL'}
NEARER = 1.5  # radii: before Blender's own spheres and dots of the same points
FILL = 1.2  # of the local spacing, a radius: discs of a random choice leave few gaps
WIDEST = 3.0  # of the middle radius: strays are no balls
TINT = 0.15  # of the color that marks selected objects: their dots are hidden
LIGHT = np.float32((0.3, -0.4, 0.87))  # where from points without colors are lit

_compiled = graphics.Shaders()
_handler: object | None = None


@dataclass
class _Part:
    """The points of one object's data."""

    places: np.ndarray  # (n, 4) float32: x, y, z, radius
    colors: np.ndarray  # (n, 4) float32, linear
    batch: gpu.types.GPUBatch | None = None


@dataclass(frozen=True)
class _Drawn:
    part: _Part
    owner: int  # the object's place in memory, of an instance its parent's: whether it is shown in a view
    matrix: object  # mathutils.Matrix
    cloud: bool  # a PointCloud that Blender shows and its material colors


_parts: dict[tuple[int, tuple, int], _Part | None] = {}  # by the object's place in memory, what is shown of it and the budget
_drawn: dict[tuple[int, int], list[_Drawn]] = {}  # by the view layer's place in memory and the budget; empty after a change


@persistent
def forget(*_: object) -> None:
    """After undo, or another file."""
    _parts.clear()
    _drawn.clear()
    thinned_files.forget()


# ---- what is shown ---------------------------------------------------------------------------------------------------


def chosen(count: int, budget: int) -> np.ndarray:
    """Sorted indices of up to budget of count points: one at random of each run of as many, since points of a file lie in an order."""
    if count <= budget:
        return np.arange(count)
    runs = count / budget
    return np.minimum(((np.arange(budget) + np.random.default_rng(1).random(budget)) * runs).astype(np.int64), count - 1)


def thin(obj: bpy.types.Object, budget: int) -> _Part | None:
    """Of an evaluated object; None if it has no points that can be drawn."""
    count = point_data.count_of(obj.data)
    places = attributes.positions(obj.data, count) if count else None
    if places is None:
        return None
    shown = _shown(obj, count)
    index = chosen(count, budget) if shown is None else shown[chosen(len(shown), budget)]
    index = index[np.isfinite(places[index]).all(axis=1)]
    if not len(index):
        return None
    few = places[index]
    return _Part(_sized(few), _colors(obj, count, index, few))


def _shown(obj: bpy.types.Object, count: int) -> np.ndarray | None:
    """Indices of the points of an evaluated object whose scans are not hidden; None: all."""
    state = edits.state_of(obj)
    if not state.hidden:
        return None
    columns = {name: attributes.scalars(obj.data, count, name) for name in scans_of.SCAN_NAMES}
    known, scans = scans_of.scans_in({name: values[:, 0] for name, values in columns.items() if values is not None})
    gone = edits.gone_of(state, count, known.numbers if known else (), scans)
    return None if gone is None else np.flatnonzero(~edits.flags(gone, count))


def _sized(places: np.ndarray) -> np.ndarray:
    """(n, 4) float32: x, y, z, radius."""
    radii = np.float32(FILL) * point_data.local_spacing(places)
    radii = np.minimum(radii, np.float32(WIDEST) * np.median(radii))
    return np.concatenate([places, radii.reshape(-1, 1)], 1)


def _of_file(points: thinned_files.Points) -> _Part | None:
    places, colors, normals, scalars = points
    finite = np.isfinite(places).all(axis=1) if len(places) else np.zeros(0, bool)
    if not finite.any():
        return None
    places, colors, normals, scalars = (values[finite] for values in (places, colors, normals, scalars))
    out = np.ones((len(places), 4), np.float32)
    if np.isfinite(colors).any():
        out[:, :3] = np.clip(np.nan_to_num(colors), 0.0, 1.0)
    else:
        out[:, :3] = _grays(places, scalars if np.isfinite(scalars).any() else None, normals if np.isfinite(normals).any() else None)
    return _Part(_sized(places), out)


def _colors(obj: bpy.types.Object, count: int, index: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(n, 4) float32, linear: the colors of the points; else grays by intensity, normal or height."""
    out = np.ones((len(index), 4), np.float32)
    found = attributes.colors(obj.data, count, obj.patina.color_attribute)
    if found is not None:
        few = found[index, :3]
        if few.dtype == np.uint8:
            few = few.astype(np.float32) / np.float32(255)
            few = np.where(few <= 0.04045, few / 12.92, ((few + 0.055) / 1.055) ** 2.4)
        out[:, :3] = np.clip(np.nan_to_num(few), 0.0, 1.0)
        return out
    found = attributes.scalars(obj.data, count, attributes.intensity_name(obj.data))
    normals = attributes.normals(obj.data, count, "") if found is None else None
    out[:, :3] = _grays(places, None if found is None else found[index, 0], None if normals is None else normals[index])
    return out


def _grays(places: np.ndarray, intensities: np.ndarray | None, normals: np.ndarray | None) -> np.ndarray:
    """(n, 1) float32, linear."""
    if intensities is not None:
        gray = _stretched(intensities)
    elif normals is not None:
        gray = np.abs(np.nan_to_num(normals) @ LIGHT)
    else:
        gray = _stretched(places[:, 2])
    return (0.05 + 0.6 * np.clip(gray, 0.0, 1.0)).reshape(-1, 1).astype(np.float32)


def _stretched(values: np.ndarray) -> np.ndarray:
    values = np.nan_to_num(values.astype(np.float64))
    low, high = np.quantile(values, (0.02, 0.98))
    return (values - low) / (high - low) if high > low else np.full(len(values), 0.5)


def _look_up(depsgraph: bpy.types.Depsgraph, budget: int) -> list[_Drawn]:
    there = {obj.as_pointer() for obj in bpy.data.objects}
    for key in [key for key in _parts if key[0] not in there]:
        del _parts[key]
    found = []
    for instance in depsgraph.object_instances:
        obj = instance.object
        if not instance.show_self or not point_data.is_cloud(obj) or clips.cuts(obj) or obj.mode == 'EDIT':
            continue
        part = _part_of_link(obj, depsgraph.scene.frame_current, budget) if obj.patina.linked_file else _part_of(obj, budget)
        if part is None:
            continue
        owner = instance.parent if instance.is_instance else obj
        cloud = obj.type == 'POINTCLOUD' and point_data.shows_spheres(obj) and any(slot.material for slot in obj.material_slots)
        found.append(_Drawn(part, owner.original.as_pointer(), instance.matrix_world.copy(), cloud))
    return found


def _part_of(obj: bpy.types.Object, budget: int) -> _Part | None:
    key = (obj.original.as_pointer(), (obj.patina.color_attribute, edits.state_of(obj).hidden), budget)
    if key not in _parts:
        for other in [other for other in _parts if other[0] == key[0] and other[2] == budget]:
            del _parts[other]
        _parts[key] = thin(obj, budget)
    return _parts[key]


def _part_of_link(obj: bpy.types.Object, frame: int, budget: int) -> _Part | None:
    """The points of the saved cloud. While they are read, those that were shown before."""
    pointer, place = obj.original.as_pointer(), thinned_files.place_of(obj, frame)
    if place is None:
        return None
    key = (pointer, place.key, budget)
    if key in _parts:
        return _parts[key]
    points = thinned_files.obtain(place, budget, _arrived)
    before = [other for other in _parts if other[0] == pointer]
    if points is None:
        return _parts[before[-1]] if before else None
    for other in before:
        del _parts[other]
    _parts[key] = _of_file(points)
    return _parts[key]


def _arrived() -> None:
    _drawn.clear()
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == 'VIEW_3D':
                area.tag_redraw()


# ---- drawing ---------------------------------------------------------------------------------------------------------

_VERTEX = """
void main()
{
    shade = color;
    vec4 clip = transform * vec4(place.xyz, 1.0);
    float radius = place.w * size.y;
    gl_PointSize = clamp(2.0 * radius * size.x / clip.w, 2.0, 64.0);
    bool perspective = view.y > 0.5;
    float nearer = perspective ? min(NEARER * radius, 0.5 * clip.w) : NEARER * radius;
    float w = perspective ? clip.w - nearer : clip.w;
    gl_Position = vec4(clip.xy * (w / clip.w), clip.z + view.x * nearer, w);
}
""".replace("NEARER", str(NEARER))

_FRAGMENT = """
void main()
{
    vec2 off = gl_PointCoord - 0.5;
    if (dot(off, off) > 0.25)
        discard;
    drawn = vec4(mix(shade.rgb, tint.rgb, tint.a), 1.0);
}
"""


def _create() -> gpu.types.GPUShader:
    info = gpu.types.GPUShaderCreateInfo()
    info.push_constant('MAT4', "transform")
    for name in ("tint", "size", "view"):
        info.push_constant('VEC4', name)
    interface = gpu.types.GPUStageInterfaceInfo("patina_thinned")
    interface.smooth('VEC4', "shade")
    info.vertex_in(0, 'VEC4', "place")
    info.vertex_in(1, 'VEC4', "color")
    info.vertex_out(interface)
    info.fragment_out(0, 'VEC4', "drawn")
    info.vertex_source(_VERTEX)
    info.fragment_source(_FRAGMENT)
    return gpu.shader.create_from_info(info)


def _draw() -> None:
    context = bpy.context
    space, budget = context.space_data, choices.preview_points()
    if not budget or space.shading.type not in SHADINGS:
        return
    key = (context.view_layer.as_pointer(), budget)
    if key not in _drawn:
        depsgraph = context.view_layer.depsgraph  # as drawn: evaluating again within a redraw may end Blender
        if depsgraph is None:
            return
        _drawn[key] = _look_up(depsgraph, budget)
    shown = [item for item in _drawn[key] if not item.cloud or space.shading.type != 'MATERIAL']
    if not shown:
        return
    visible = {obj.as_pointer(): obj for obj in context.visible_objects}
    try:
        shader = _compiled.get("thinned", _create)
    except graphics.GraphicsError:
        return  # Blender's own dots and spheres stay
    region, window, color = context.region_data, context.region_data.window_matrix, context.preferences.themes[0].view_3d
    scale, perspective = 0.5 * context.region.height * window[1][1], float(window[3][3] == 0.0)
    gpu.state.depth_test_set('LESS_EQUAL')
    gpu.state.depth_mask_set(True)
    gpu.state.blend_set('NONE')
    gpu.state.program_point_size_set(True)
    try:
        for item in shown:
            owner = visible.get(item.owner)
            if owner is None:
                continue
            if item.part.batch is None:
                item.part.batch = batch_for_shader(shader, 'POINTS', {"place": item.part.places, "color": item.part.colors})
            marked = color.object_active if owner == context.object else color.object_selected
            tint = (*marked.from_srgb_to_scene_linear(), TINT) if owner.select_get() else (0.0,) * 4
            shader.bind()
            shader.uniform_float("transform", region.perspective_matrix @ item.matrix)
            shader.uniform_float("tint", tint)
            shader.uniform_float("size", (scale, item.matrix.median_scale, 0.0, 0.0))
            shader.uniform_float("view", (window[2][2], perspective, 0.0, 0.0))
            item.part.batch.draw(shader)
    finally:
        gpu.state.program_point_size_set(False)
        gpu.state.depth_test_set('NONE')
        gpu.state.depth_mask_set(False)


# ---- changes ---------------------------------------------------------------------------------------------------------


@persistent
def _changed(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    _drawn.clear()
    if not _parts:
        return
    data = set()
    for update in depsgraph.updates:
        if update.is_updated_geometry or isinstance(update.id, (bpy.types.Mesh, bpy.types.PointCloud)):
            data.add(update.id.original.as_pointer())
    for key in [key for key in _parts if key[0] in data]:
        del _parts[key]


_HANDLERS: tuple[tuple[str, Callable[..., None]], ...] = (
    ("depsgraph_update_post", _changed), ("frame_change_post", _changed), ("undo_post", forget), ("redo_post", forget), ("load_pre", forget))


def register() -> None:
    global _handler
    if bpy.app.background:
        return
    _handler = bpy.types.SpaceView3D.draw_handler_add(_draw, (), 'WINDOW', 'POST_VIEW')
    for name, call in _HANDLERS:
        getattr(bpy.app.handlers, name).append(call)


def unregister() -> None:
    global _handler
    if _handler is None:
        return
    bpy.types.SpaceView3D.draw_handler_remove(_handler, 'WINDOW')
    _handler = None
    for name, call in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(call)
    forget()
    _compiled.forget()
