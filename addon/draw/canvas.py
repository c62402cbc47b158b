# SPDX-License-Identifier: GPL-3.0-or-later
"""A finished picture in a 3D view: drawn there, with Blender's overlays hidden behind it."""

from __future__ import annotations

import math
from collections.abc import Callable

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader
from mathutils import Color

from ..description.marks import Marks
from ..sync.view.camera import camera_frame
from . import graphics, marks, overlays, painting, sky
from .pictures import Shown

HIDDEN, SHOWN = 4.0, -8.0  # pixels' width that a depth is nearer than the surface: Blender's dots of vertices are hidden, or not
ROUNDING = 4.0 * 2.0 ** -24  # and by so many steps of Blender's depths of 24 bits: each may be meters, far away in a view that begins near


class Canvas:
    """Of one 3D view region. On Blender's thread."""

    def __init__(self) -> None:
        self.drawn: tuple[Shown, gpu.types.GPUTexture, gpu.types.GPUTexture | None] | None = None  # colour; depth for overlays
        self._chosen: np.ndarray | None = None  # places of vertices that are selected in Edit Mode
        self._chosen_batch: gpu.types.GPUBatch | None = None
        self._sky = sky.Sky()
        self._marks: tuple[tuple[Marks, int, int], gpu.types.GPUTexture] | None = None

    def choose(self, places: np.ndarray | None) -> None:
        """Vertices that are selected in Edit Mode, which are drawn over the picture."""
        self._chosen, self._chosen_batch = places, None

    def clear(self) -> None:
        """Frees the textures."""
        self.drawn = self._chosen_batch = self._marks = None
        self._sky = sky.Sky()

    def draws(self, shown: Shown) -> bool:
        """Whether this picture is drawn already."""
        return self.drawn is not None and self.drawn[0] is shown

    def draw(self, context: bpy.types.Context, shown: Shown, finish: Callable[[], None]) -> None:
        """Draws the picture. finish: is called after Blender has drawn the overlays, where these need finish_overlays()."""
        try:
            self._draw(context, shown, finish)
        finally:  # what Blender draws next needs this, also after an error
            gpu.state.color_mask_set(True, True, True, True)
            gpu.state.depth_test_set('NONE')
            gpu.state.depth_mask_set(False)
            gpu.state.blend_set('NONE')

    def _draw(self, context: bpy.types.Context, shown: Shown, finish: Callable[[], None]) -> None:
        shows_overlays = context.space_data.overlay.show_overlays
        if not self.draws(shown):
            same = self.drawn and self.drawn[0].depth is shown.depth
            self.drawn = (shown, _upload(shown), self.drawn[2] if same else None)
        hides = shows_overlays and (shown.hiding is not None or self._chosen is not None)
        if hides and self.drawn[2] is None:
            depth = shown.depth if shown.hiding is None else shown.hiding
            self.drawn = (*self.drawn[:2], graphics.texture(painting.covering(depth), 'R32F'))
        color = self.drawn[1]
        corners = [2.0 * share - 1.0 for share in shown.place]
        gpu.state.depth_test_set('NONE')
        gpu.state.depth_mask_set(False)
        gpu.state.blend_set('NONE')  # Blender has cleared what is beneath
        if shown.behind:
            self._sky.draw(shown.behind, shown.wish.view.camera, shown.place)
            gpu.state.blend_set('ALPHA_PREMULT')
        painting.fill_rectangle(corners, 'EXACT' if shown.wish.level.shrink == 1 else 'SMOOTH', color)
        gpu.state.blend_set('NONE')
        if not hides:
            return
        if overlays.KEEPS_DEPTH:
            self._hide_overlays(context, 'DEPTH')
        if not overlays.KEEPS_DEPTH or self._chosen is not None:
            overlays.after(context.region, finish)

    def draw_marks(self, context: bpy.types.Context, shown: Marks | None) -> None:
        """Draws legends, scale bar, north arrow and title where the view shows overlays. GraphicsError."""
        if shown is None or not context.space_data.overlay.show_overlays:
            self._marks = None
            return
        region = context.region
        x0, y0, x1, y1 = _marked(context)
        key = (shown, x1 - x0, y1 - y0)
        if min(key[1:]) < 1:
            return
        if self._marks is None or self._marks[0] != key:
            self._marks = (key, graphics.texture(marks.paint(*key, region.width), 'RGBA16F'))
        gpu.state.depth_test_set('NONE')
        gpu.state.blend_set('ALPHA_PREMULT')
        try:
            corners = [2.0 * place / size - 1.0 for place, size in zip((x0, y0, x1, y1), (region.width, region.height) * 2, strict=True)]
            painting.fill_rectangle(corners, 'EXACT', self._marks[1])
        finally:
            gpu.state.blend_set('NONE')

    def _hide_overlays(self, context: bpy.types.Context, kind: str) -> None:
        """Hides the overlays behind the picture: by a depth that Blender tests them against, or ERASE: those that are drawn already."""
        shown, _, depth = self.drawn
        if kind == 'DEPTH':  # where nothing of Blender's is nearer
            gpu.state.color_mask_set(False, False, False, False)
        gpu.state.depth_test_set('LESS_EQUAL')
        gpu.state.depth_mask_set(kind == 'DEPTH')
        painting.fill_rectangle([2.0 * share - 1.0 for share in shown.place], kind, depth, **self._depths(context, HIDDEN))
        gpu.state.color_mask_set(True, True, True, True)
        gpu.state.depth_test_set('NONE')
        gpu.state.depth_mask_set(False)

    def _depths(self, context: bpy.types.Context, cover: float) -> dict[str, float | tuple[float, ...]]:
        """Uniforms that turn the picture's linear z into depths of Blender's projection."""
        projection, camera = context.region_data.window_matrix, self.drawn[0].wish.view.camera
        near = camera.near_clip if camera.orthographic else 0.0
        return {"cover": cover * self.drawn[0].pixel, "rounding": math.copysign(ROUNDING, cover),
                "away": context.region_data.view_matrix.translation.length,
                "projection": (projection[2][2], projection[2][3], near, camera.orthographic)}

    def finish_overlays(self, context: bpy.types.Context) -> None:
        """After Blender has drawn the overlays. GraphicsError."""
        if self.drawn is None or self.drawn[2] is None:
            return
        if not overlays.KEEPS_DEPTH and self.drawn[0].hiding is not None:
            gpu.state.blend_set('NONE')
            self._hide_overlays(context, 'ERASE')
            overlays.draw_marks(context)
        if self._chosen is not None and len(self._chosen):
            self._draw_chosen(context)

    def _draw_chosen(self, context: bpy.types.Context) -> None:
        """Vertices that are selected in Edit Mode, on the side that is seen."""
        theme, scale = context.preferences.themes[0].view_3d, context.preferences.system.ui_scale
        shader = painting.shader('CHOSEN')
        if self._chosen_batch is None:
            self._chosen_batch = batch_for_shader(shader, 'POINTS', {"pos": self._chosen})
        x0, y0, x1, y1 = self.drawn[0].place
        gpu.state.program_point_size_set(True)
        shader.bind()
        shader.uniform_sampler("picture", self.drawn[2])
        shader.uniform_float("transform", context.region_data.perspective_matrix)
        shader.uniform_float("region", (x0, y0, x1 - x0, y1 - y0))
        red, green, blue = (round(255.0 * part) for part in Color(theme.vertex_select).from_srgb_to_scene_linear())  # turned back by the framebuffer
        depths = self._depths(context, SHOWN)
        shader.uniform_float("offset", (depths["cover"], depths["rounding"], depths["away"], (theme.vertex_size + 1.0) * scale))
        *projection, orthographic = depths["projection"]
        packed = 1.0 + red + 256.0 * green + 65536.0 * blue
        shader.uniform_float("projection", (*projection, packed if orthographic else -packed))
        self._chosen_batch.draw(shader)
        gpu.state.program_point_size_set(False)


def _marked(context: bpy.types.Context) -> tuple[int, int, int, int]:
    """x0, y0, x1, y1 of the region's pixels that marks are drawn in: those that no header and no sidebar covers, and of a view through a
    camera those within its frame, where a render has them."""
    region, space, view = context.region, context.space_data, context.region_data
    right, top = _free(context.area, region)
    x0, y0, x1, y1 = 0, 0, region.width - right, region.height - top
    camera = space.camera or context.scene.camera
    if view.view_perspective == 'CAMERA' and camera is not None and camera.type == 'CAMERA':
        left, bottom, end, upper = map(round, camera_frame(region, view, camera, context.scene))
        x0, y0, x1, y1 = max(x0, left), max(y0, bottom), min(x1, end), min(y1, upper)
    return x0, y0, x1, y1


def _free(area: bpy.types.Area, region: bpy.types.Region) -> tuple[int, int]:
    """Pixels of the region that a sidebar covers at the right, and headers at the top."""
    right = top = 0
    for other in area.regions:
        if other.width < 2 or other.height < 2:  # hidden
            continue
        if other.type == 'UI' and other.x > region.x:
            right = max(right, region.x + region.width - other.x)
        if other.type in {'HEADER', 'TOOL_HEADER'} and other.y > region.y + region.height // 2:
            top = max(top, region.y + region.height - other.y)
    return max(right, 0), max(top, 0)


def _upload(shown: Shown) -> gpu.types.GPUTexture:
    # as it is: what is too bright is cut in the shader. In half floats it would take Blender 5.2 a third longer, most of it on Vulkan
    return graphics.texture(shown.color, 'RGBA32F')


def redraw(area_pointer: int, region_pointer: int, panels: bool) -> bool:
    """Has a view drawn wholly, and panels beside it. Whether it is there. An engine's own tag_redraw does not do: Blender then
    puts back the depths of its last whole redraw after the engine has drawn, and shows overlays by them."""
    found = False
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.as_pointer() == area_pointer:
                for region in area.regions:
                    own = region.as_pointer() == region_pointer
                    found |= own
                    if own or panels and region.type == 'UI':
                        region.tag_redraw()
    return found
