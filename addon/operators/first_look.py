# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses the first look of points by the data that they have: colors, intensity, classes, or positions alone."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

import bpy
from bpy.types import Object, Scene

from .. import jobs, native, point_data
from ..sync.points import attributes, coloring, linked
from . import view_transform

PLASTER = "plaster"  # the style of points that have positions alone


class Data(Enum):
    """The best that an object's points can be colored by."""

    COLORS = "colors"
    INTENSITY = "intensity"
    CLASSES = "classes"
    POSITIONS = "positions"


def data_of(obj: Object, frame: int) -> Data:
    """What the points of an object have. Linked files are asked for colors alone. PatinaError if a linked file cannot be read."""
    if obj.patina.linked_file:
        source = linked.source_of(obj, frame, [])
        found = source and jobs.run(lambda: linked.load(source), lambda: None, lambda: False).cloud
        return Data.COLORS if not found or found.has_colors else Data.POSITIONS
    with attributes.readable(obj) as data:
        count = point_data.count_of(data)
        rgb = attributes.colors(data, count, obj.patina.color_attribute) if count else None
        if rgb is not None and attributes.colored(rgb).any():
            return Data.COLORS
        if attributes.intensity_name(obj.data):
            return Data.INTENSITY
        classes = attributes.classes(data, count, obj.patina.colors.class_attribute) if count else None
        return Data.CLASSES if classes is not None and classes.any() else Data.POSITIONS


def choose(scene: Scene, points: Sequence[Object]) -> list[str]:
    """Sets the look of points whose look nobody has chosen yet. Returns what was done, in sentences without full stops.

    Colors are shown unlit and as they were taken. Intensity is stretched between its 1st and 99th percentile. Classes get the LAS
    colors. If no object has any of these, the scene gets the style Plaster."""
    kinds = {obj: _data(obj, scene.frame_current) for obj in points if obj.patina.colors.source == 'OWN'}
    said = []
    if kinds and all(kind == Data.POSITIONS for kind in kinds.values()):
        scene.patina.style.chosen = PLASTER
        return ["The points have no colors: the style Plaster lights them"]
    for obj, kind in kinds.items():
        if kind == Data.INTENSITY:
            said.append(_show_intensity(obj, scene.frame_current))
        elif kind == Data.CLASSES:
            name = next(name for name in attributes.CLASS_NAMES if name in obj.data.attributes)
            coloring.apply(obj, coloring.Choice("Class", 'SCALAR', name, 'CLASSES'), scene.frame_current)
            said.append(f"'{obj.name}' is colored by its classes")
    if any(kind != Data.POSITIONS for kind in kinds.values()) and view_transform.changes_colors(scene):
        bpy.ops.render.patina_true_colors()
        said.append("The view transform is Standard, which shows the colors as they were taken")
    return said


def _data(obj: Object, frame: int) -> Data:
    try:
        return data_of(obj, frame)
    except native.PatinaError:
        return Data.COLORS  # the viewport reports the file


def _show_intensity(obj: Object, frame: int) -> str:
    name = attributes.intensity_name(obj.data)
    coloring.apply(obj, coloring.Choice("Intensity", 'SCALAR', name, 'GREY'), frame)
    group = obj.patina.colors
    stretched = f", stretched from {group.range_min:,.6g} to {group.range_max:,.6g}" if group.use_range else ""
    return f"'{obj.name}' is colored by '{name}'{stretched}"


def color_imported(obj: Object, frame: int) -> str:
    """Shows new points in their intensity if they have no colors and nobody has chosen a look. Returns what was done, or ""."""
    if obj.patina.linked_file or obj.patina.colors.source != 'OWN' or _data(obj, frame) != Data.INTENSITY:
        return ""
    return _show_intensity(obj, frame)
