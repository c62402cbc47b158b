# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws measurements over 3D views: lines, values and the point that a tool would snap to."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence

import blf
import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader
from mathutils import Vector
from mathutils.geometry import tessellate_polygon

from ..description import measures as description
from ..description.measures import Figure, MeasureError
from ..sync import measures
from .over_views import OverViews

INK, SHADE, PAPER = (1.0, 0.78, 0.16, 1.0), (0.0, 0.0, 0.0, 0.75), (0.03, 0.03, 0.03, 0.72)  # of lines, around them, behind text
UNFINISHED, SNAPPED = (1.0, 1.0, 1.0, 1.0), (0.3, 1.0, 0.45, 1.0)
VEIL = 0.18  # opacity of areas
WIDTH, SHADE_WIDTH, TEXT, DOT, RING = 1.8, 4.0, 12.0, 3.0, 8.0  # pixels at a resolution scale of 1
NEAREST = 1e-6  # of a homogeneous coordinate: what is nearer to the eye is cut

Color = tuple[float, float, float, float]
Point = tuple[float, float]


def _shader(name: str) -> gpu.types.GPUShader:
    modern = bpy.app.version >= (4, 0, 0)
    return gpu.shader.from_builtin({"line": 'POLYLINE_UNIFORM_COLOR' if modern else '3D_POLYLINE_UNIFORM_COLOR',
                                    "fill": 'UNIFORM_COLOR' if modern else '2D_UNIFORM_COLOR'}[name])


class Pen:
    """Draws on a region in its pixels."""

    def __init__(self, context: bpy.types.Context) -> None:
        region = context.region
        self.size = (region.width, region.height)
        self.scale = context.preferences.system.ui_scale
        self._matrix = np.array(context.region_data.perspective_matrix, np.float64)
        self._panels: list[tuple[float, float, float, float]] = []  # behind texts that were written

    def _clip(self, points: np.ndarray) -> np.ndarray:
        return np.column_stack([points, np.ones(len(points))]) @ self._matrix.T

    def _pixel(self, clip: np.ndarray) -> Point:
        return ((clip[0] / clip[3] * 0.5 + 0.5) * self.size[0], (clip[1] / clip[3] * 0.5 + 0.5) * self.size[1])

    def place(self, point: np.ndarray) -> Point | None:
        """None: behind the eye."""
        clip = self._clip(point[None])[0]
        return self._pixel(clip) if clip[3] > NEAREST else None

    def segments(self, line: np.ndarray) -> list[Point]:
        """Both ends of each segment, as far as it is before the eye."""
        clip, found = self._clip(line), []
        for one, other in zip(clip, clip[1:], strict=False):
            if max(one[3], other[3]) <= NEAREST:
                continue
            if min(one[3], other[3]) <= NEAREST:
                share = (NEAREST - one[3]) / (other[3] - one[3])
                middle = one + share * (other - one)
                one, other = (middle, other) if one[3] <= NEAREST else (one, middle)
            found += [self._pixel(one), self._pixel(other)]
        return found

    def lines(self, places: Sequence[Point], color: Color) -> None:
        if not places:
            return
        shader = _shader("line")
        gpu.state.blend_set('ALPHA')
        batch = batch_for_shader(shader, 'LINES', {"pos": [(*place, 0.0) for place in places]})
        shader.bind()
        shader.uniform_float("viewportSize", self.size)
        for shade, width in ((SHADE, SHADE_WIDTH), (color, WIDTH)):
            shader.uniform_float("lineWidth", width * self.scale)
            shader.uniform_float("color", shade)
            batch.draw(shader)

    def fill(self, places: Sequence[Point], color: Color, kind: str = 'TRI_FAN') -> None:
        shader = _shader("fill")
        gpu.state.blend_set('ALPHA')  # text leaves another one
        shader.bind()
        shader.uniform_float("color", color)
        batch_for_shader(shader, kind, {"pos": list(places)}).draw(shader)

    def disc(self, place: Point, radius: float, color: Color) -> None:
        self.fill(_ring(place, radius * self.scale), color)

    def ring(self, place: Point, color: Color) -> None:
        corners = _ring(place, RING * self.scale)
        self.lines([corner for pair in zip(corners, [*corners[1:], corners[0]], strict=True) for corner in pair], color)

    def text(self, place: Point, text: str) -> None:
        """Above and to the right of a place, on a dark panel; higher where another text is."""
        blf.size(0, TEXT * self.scale)
        pad = 4.0 * self.scale
        width, height = (size + 2.0 * pad for size in blf.dimensions(0, text))
        x, y = round(place[0] + 6.0 * self.scale), round(place[1] + 6.0 * self.scale)
        for left, bottom, right, top in sorted(self._panels, key=lambda panel: panel[1]):
            if left < x + width and x < right and bottom < y + height and y < top:
                y = math.ceil(top) + 1
        self._panels.append((x, y, x + width, y + height))
        self.fill([(x, y), (x + width, y), (x + width, y + height), (x, y + height)], PAPER)
        blf.color(0, 1.0, 1.0, 1.0, 1.0)
        blf.position(0, x + pad, y + pad, 0.0)
        blf.draw(0, text)


def _ring(place: Point, radius: float) -> list[Point]:
    return [(place[0] + radius * math.cos(turn), place[1] + radius * math.sin(turn)) for turn in (2.0 * math.pi * i / 24 for i in range(24))]


def _draw_figure(pen: Pen, figure: Figure, points: Sequence[np.ndarray], color: Color) -> None:
    if figure.closed:
        places = [pen.place(point) for point in figure.lines[0][:-1]]
        if all(places):
            corners = [Vector((*place, 0.0)) for place in places]
            triangles = [places[index] for triangle in tessellate_polygon([corners]) for index in triangle]
            if triangles:
                pen.fill(triangles, (*color[:3], VEIL), 'TRIS')
    pen.lines([place for line in figure.lines for place in pen.segments(line)], color)
    for place in filter(None, map(pen.place, points)):
        pen.disc(place, DOT + 1.0, SHADE)
        pen.disc(place, DOT, color)
    for place, text in figure.labels:
        at = pen.place(place)
        if at and text:
            pen.text(at, text)


def draw_unfinished(context: bpy.types.Context, kind: str, points: list[np.ndarray], snapped: bool) -> None:
    """What a tool has so far, the place under the mouse the last; snapped: it is a point."""
    if not points:
        return
    pen, places = Pen(context), np.stack(points)
    gpu.state.blend_set('ALPHA')
    try:
        texts = measures.texts(context.scene)
        figure, shown = Figure((places,), ()), 'DISTANCE'
        with contextlib.suppress(MeasureError):
            description.check(kind, places)
            shown = kind
        if len(points) > 1:
            figure = description.figure(shown, places, description.values(shown, places), texts, "")
        _draw_figure(pen, figure, points, UNFINISHED)
        at = pen.place(places[-1])
        if snapped and at:
            pen.ring(at, SNAPPED)
    finally:
        gpu.state.blend_set('NONE')


def _draw() -> None:
    """Measurements of visible objects, where the view shows overlays."""
    context = bpy.context
    if context.region_data is None or not context.space_data.overlay.show_overlays:
        return
    found = list(measures.shown(context.view_layer, context.space_data))
    if not found:
        return
    pen = Pen(context)
    gpu.state.blend_set('ALPHA')
    try:
        for one in found:
            _draw_figure(pen, measures.figure(one, context.scene), list(one.points), INK)
    except MeasureError:
        pass
    finally:
        gpu.state.blend_set('NONE')


_over = OverViews(_draw, 'POST_PIXEL')
register, unregister = _over.register, _over.unregister
