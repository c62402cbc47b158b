# SPDX-License-Identifier: GPL-3.0-or-later
"""What tools for points in a 3D view share: the scene as the view shows it, which of its points an outline holds, and an operator that
draws an outline over the view while it runs."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import bpy
import gpu
import numpy as np
from bpy.types import Context, Event
from gpu_extras.batch import batch_for_shader

from .. import jobs, native, sync
from ..description.scene import SceneDescription
from ..description.view import View
from ..draw import render, viewport
from ..native.abi import SURFACE
from ..native.points import pick, pick_nearest
from ..sync.analyses.analyzing import ANALYSES
from ..sync.points import clouds, edits

LINE = (1.0, 1.0, 1.0, 0.9)
FILL = (1.0, 1.0, 1.0, 0.06)
Place = tuple[float, float]  # pixels of the view from its bottom left


def view_of(context: Context) -> View:
    """What the picture is that outlines are drawn on: the 3D view's; without one, as scripts have none, the final render's."""
    if context.region_data and context.space_data and context.space_data.type == 'VIEW_3D':
        return sync.viewport_view(context.region, context.space_data, context.region_data, context.scene)
    depsgraph = context.evaluated_depsgraph_get()
    camera = context.scene.camera
    return sync.final_view(camera and camera.evaluated_get(depsgraph), depsgraph)


def describe(context: Context) -> SceneDescription:
    """The scene as the view shows it, its clouds built, light and lines left out: what stands where is all that is asked. Soft points
    count as surface, and range images show single points."""
    depsgraph, view, notices = context.evaluated_depsgraph_get(), view_of(context), []
    drawing = viewport.of_area(context.area)
    trusted = drawing.trusted if drawing else sync.Trusted()
    space = context.space_data if context.region_data else None

    def visible(instance: bpy.types.DepsgraphObjectInstance) -> bool:
        obj = instance.parent if instance.is_instance else instance.object
        return space is None or obj.visible_in_viewport_get(space)

    items = clouds.collect(depsgraph, trusted.take(notices), notices, visible)
    description = sync.describe_items(depsgraph, view, notices, items)
    if any(item.cloud.built is None for item in description.clouds):
        ANALYSES.await_frames()  # building gives a cloud that is kept new colors, which a picture under way would meet
    with native.Progress() as progress:
        built = [replace(item, cloud=cloud, soft=None, style=replace(item.style, surface=0)) for item in description.clouds
                 if (cloud := jobs.finish(item.cloud.resolve(progress)))]
    clips, settings = sync.view_clips(context.region_data) if space else [], description.settings
    return replace(description, clouds=built, clips=[*description.clips, *clips], lights=[], headlight=None, lines=None, shadow_file="",
                   panorama=None, settings=replace(settings, pixel_samples=1, surface=0 if settings.surface == SURFACE["RANGES"] else settings.surface))


class Seen:
    """A scene that is asked for points, of the objects of these names; through: those that others hide too. PatinaError."""

    def __init__(self, description: SceneDescription, names: Collection[str], through: bool) -> None:
        self._wanted = [(index, item.name) for index, item in enumerate(description.clouds) if item.name in names]
        self._description = description
        device = render.device_for(description.device)
        self._scene = native.Scene()
        self._frame: native.Frame | None = None
        try:
            render.describe(self._scene, description, ["COMBINED", "DEPTH"])
            if not through:
                self._frame = native.Frame(device)
                self._frame.render(self._scene)
        except BaseException:
            self.close()
            raise

    def points(self, outline: np.ndarray) -> dict[str, edits.Bits]:
        """By object: which points an outline, (n, 2) pixels of the view, holds."""
        found: dict[str, edits.Bits] = {}
        for index, name in self._wanted:
            bits = pick(self._scene, index, outline, self._frame)
            found[name] = found[name] | bits if name in found else bits  # of instances each
        return found

    def nearest(self, outline: np.ndarray, place: Place) -> tuple[str, np.ndarray] | None:
        """Of the points in an outline the one that is drawn nearest to a place: its object, and where it is in the world."""
        best: tuple[str, np.ndarray] | None = None
        least = np.inf
        for index, name in self._wanted:
            found = pick_nearest(self._scene, index, outline, place, self._frame)
            if found and found[2] < least:
                matrix = np.array(self._description.clouds[index].style.world_from_object).reshape(4, 4)
                best, least = (name, matrix[:3, :3] @ found[1] + matrix[:3, 3]), found[2]
        return best

    def depth(self) -> np.ndarray:
        """(height, width, 1) float32, linear z, of what the view shows; infinity where nothing is."""
        return self._frame.read("DEPTH")

    def numbers(self) -> np.ndarray:
        return self._frame.read_numbers()

    def close(self) -> None:
        if self._frame:
            self._frame.close()
        self._scene.close()

    def __enter__(self) -> Seen:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


# ---- operators -------------------------------------------------------------------------------------------------------


# Begins of the events' types that move the view.
NAVIGATION = ('MIDDLEMOUSE', 'WHEEL', 'TRACKPAD', 'MOUSEROTATE', 'MOUSESMARTZOOM', 'NDOF', 'NUMPAD_', 'HOME', 'TIMER')


def is_view(context: Context) -> bool:
    return context.area is not None and context.area.type == 'VIEW_3D' and context.region.type == 'WINDOW'


def is_over(context: Context, event: Event) -> bool:
    """Whether the mouse is over the view and not over one of the regions that may lie upon it."""
    def holds(region: bpy.types.Region) -> bool:
        return 0 <= event.mouse_x - region.x < region.width and 0 <= event.mouse_y - region.y < region.height

    return holds(context.region) and not any(region.type != 'WINDOW' and region.width > 1 and region.height > 1 and holds(region)
                                             for region in context.area.regions)


def place_of(context: Context, event: Event) -> Place:
    return (float(event.mouse_x - context.region.x), float(event.mouse_y - context.region.y))


def largest_view(context: Context) -> tuple[bpy.types.Area, bpy.types.Region] | None:
    """The largest 3D view of the window, for tools that a button elsewhere begins; None: there is none."""
    areas = [area for area in context.screen.areas if area.type == 'VIEW_3D'] if context.screen else []
    if not areas:
        return None
    area = max(areas, key=lambda area: area.width * area.height)
    return area, next(region for region in area.regions if region.type == 'WINDOW')


class OverView:
    """Beside bpy.types.Operator, one that runs in a 3D view: begin() in invoke(), end() when it ends."""

    def shown(self) -> tuple[Sequence[Place], bool]:
        """Corners of what is drawn over the view, none: nothing; and whether it is filled, which has to be convex."""
        raise NotImplementedError

    def begin(self, context: Context, status: str) -> None:
        context.window.cursor_modal_set('CROSSHAIR')
        context.workspace.status_text_set(status)
        self._region = context.region
        self._drawing = context.space_data.draw_handler_add(self._draw_over, (), 'WINDOW', 'POST_PIXEL')
        context.window_manager.modal_handler_add(self)
        context.area.tag_redraw()

    def end(self, context: Context) -> None:
        if self._drawing:
            bpy.types.SpaceView3D.draw_handler_remove(self._drawing, 'WINDOW')
        self._drawing = None
        context.window.cursor_modal_restore()
        context.workspace.status_text_set(None)

    def cancel(self, context: Context) -> None:
        self.end(context)

    def _draw_over(self) -> None:
        corners, filled = self.shown() if bpy.context.region == self._region else ((), False)
        if not corners:
            return
        shader = gpu.shader.from_builtin('UNIFORM_COLOR' if bpy.app.version >= (4, 0, 0) else '2D_UNIFORM_COLOR')
        shader.bind()
        gpu.state.blend_set('ALPHA')
        if filled:
            shader.uniform_float("color", FILL)
            batch_for_shader(shader, 'TRI_FAN', {"pos": corners}).draw(shader)
        shader.uniform_float("color", LINE)
        batch_for_shader(shader, 'LINE_STRIP', {"pos": [*corners, corners[0]]}).draw(shader)
        gpu.state.blend_set('NONE')
