# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses the first look of points by the data that they have: colors, intensity, classes, or positions alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import bpy
import numpy as np
from bpy.types import Object, Scene

from .. import jobs, native, point_data
from ..sync.points import attributes, coloring, linked
from . import add_light, view_transform

PLASTER = "plaster"  # the style of points that have positions alone
FLAT = 0.1  # of the stretched intensity: where the middle half of the points spans less, they look alike without light
BRIGHT = 0.5  # of the stretched intensity: where the median is less, points that look alike are too dark for light
SAMPLED = 1 << 16  # points of a linked cloud whose colors are compared


class Data(Enum):
    """The best that an object's points can be colored by."""

    COLORS = "colors"
    INTENSITY = "intensity"
    CLASSES = "classes"
    POSITIONS = "positions"


@dataclass(frozen=True)
class Found:
    """What the points of an object have."""

    kind: Data
    flat: bool = False  # most have nearly the same intensity, which no stretch tells apart: scanners cut off what is too bright for them
    color: np.ndarray | None = None  # that all have, or that all of many points of a linked cloud have: sRGB bytes or linear floats


def data_of(obj: Object, frame: int) -> Found:
    """What the points of an object have that tells them apart: one color alone, or an intensity that would be black nearly everywhere, does
    not. Linked files are asked for colors alone. PatinaError if a linked file cannot be read."""
    if obj.patina.linked_file:
        cloud = _cloud_of(obj, frame)
        return _of_cloud(cloud) if cloud else Found(Data.COLORS)
    with attributes.readable(obj) as data:
        count = point_data.count_of(data)
        rgb = attributes.colors(data, count, obj.patina.color_attribute) if count else None
        color = None if rgb is None else attributes.constant(rgb)
        if rgb is not None and color is None and attributes.colored(rgb).any():
            return Found(Data.COLORS)
        spread = _intensities(data, count)
        if spread and (spread[1] >= FLAT or spread[0] >= BRIGHT):
            return Found(Data.INTENSITY, spread[1] < FLAT, color)
        classes = attributes.classes(data, count, obj.patina.colors.class_attribute) if count else None
        return Found(Data.CLASSES if classes is not None and classes.any() else Data.POSITIONS, color=color)


def _of_cloud(cloud: native.Cloud) -> Found:
    """What a linked cloud has. Its intensity and classes are not asked for."""
    color = attributes.constant(cloud.thinned(min(SAMPLED, cloud.count))[1]) if cloud.has_colors and cloud.count else None
    return Found(Data.COLORS if cloud.has_colors and color is None else Data.POSITIONS, color=color)


def _cloud_of(obj: Object, frame: int) -> native.Cloud | None:
    source = linked.source_of(obj, frame, [])
    return source and jobs.run(lambda: linked.load(source), lambda: None, lambda: False).cloud


def _intensities(data: bpy.types.ID, count: int) -> tuple[float, float] | None:
    """Of the intensities, stretched from 0 to 1 as they are shown: the median, and the distance between the quartiles. None: there are
    none, or all are the same."""
    values = attributes.scalars(data, count, attributes.intensity_name(data)) if count else None
    values = None if values is None else values[np.isfinite(values)]
    if values is None or not len(values):
        return None
    share = coloring.SHARE
    least, low, first, median, last, high, most = (float(value) for value in np.quantile(values, (0.0, share, 0.25, 0.5, 0.75, 1.0 - share, 1.0)))
    low, high = (low, high) if low < high else (least, most)
    return ((median - low) / (high - low), (last - first) / (high - low)) if low < high else None


def found_in(scene: Scene, points: Sequence[Object]) -> dict[Object, Found]:
    """What each object has. Colors, where a file cannot be read."""
    return {obj: _data(obj, scene.frame_current) for obj in points}


def is_lit(obj: Object, kind: Data) -> bool:
    """Whether points with such data are drawn in the light of the scene."""
    patina = obj.patina
    return patina.lighting == 'LIT' or patina.lighting == 'AUTO' and not (patina.colors.source in {'OWN', 'MATERIAL'} and kind == Data.COLORS)


def choose(scene: Scene, found: Mapping[Object, Found]) -> list[str]:
    """Sets the look of points whose look nobody has chosen yet. Returns what was done, in sentences without full stops.

    Colors are shown unlit and as they were taken. Intensity is stretched between its 1st and 99th percentile, and lit where most points have
    nearly the same. Classes get the LAS colors. If light shows the form of all objects, the scene gets the style Plaster."""
    frame = scene.frame_current
    chosen = {obj: each for obj, each in found.items() if obj.patina.colors.source == 'OWN'}
    said = []
    plaster = bool(chosen) and all(each.kind == Data.POSITIONS or each.flat for each in chosen.values())
    if plaster:
        what = "nearly the same intensity" if all(each.flat for each in chosen.values()) else "no colors"
        if any(each.kind == Data.POSITIONS and each.color is not None for each in chosen.values()):
            what = "only one color"
        scene.patina.style.chosen = PLASTER
        said.append(f"The points have {what}: the style Plaster lights them")
    for obj, each in chosen.items():
        if each.kind == Data.INTENSITY:
            said.append(_show_intensity(obj, each.flat, frame))
        elif each.kind == Data.CLASSES:
            name = next(name for name in attributes.CLASS_NAMES if name in obj.data.attributes)
            coloring.apply(obj, coloring.Choice("Class", 'SCALAR', name, 'CLASSES'), frame)
            said.append(f"'{obj.name}' is colored by its classes")
        elif each.kind == Data.POSITIONS and not plaster:
            said += filter(None, [_light_one_color(obj, each.color)])
    if not plaster and any(each.kind != Data.POSITIONS for each in chosen.values()) and view_transform.changes_colors(scene):
        bpy.ops.render.patina_true_colors()
        said.append("The view transform is Standard, which shows the colors as they were taken")
    return said


def _data(obj: Object, frame: int) -> Found:
    try:
        return data_of(obj, frame)
    except native.PatinaError:
        return Found(Data.COLORS)  # the viewport reports the file


def _show_intensity(obj: Object, flat: bool, frame: int) -> str:
    name = attributes.intensity_name(obj.data)
    if obj.patina.lighting == 'AUTO' and flat:
        obj.patina.lighting = 'LIT'
    coloring.apply(obj, coloring.Choice("Intensity", 'SCALAR', name, 'GREY'), frame)
    group = obj.patina.colors
    stretched = f", stretched from {group.range_min:,.6g} to {group.range_max:,.6g}" if group.use_range else ""
    lit = ", and lit, since most points have nearly the same" if obj.patina.lighting == 'LIT' else ""
    return f"'{obj.name}' is colored by '{name}'{stretched}{lit}"


def _light_one_color(obj: Object, color: np.ndarray | None) -> str:
    """Lights points that have one color alone, which shows no form without light. Black ones become as points without colors. Returns what
    was done, or ""."""
    if color is None:
        return ""
    if not attributes.colored(color[None]).any():
        obj.patina.colors.source = 'FIXED'
    elif obj.patina.lighting == 'AUTO':
        obj.patina.lighting = 'LIT'
    return f"The points of '{obj.name}' have only one color, and are lit"


def color_imported(obj: Object, frame: int, cloud: native.Cloud | None = None) -> str:
    """Shows new points in their intensity if they have no colors and nobody has chosen a look. Lights those of one color, unless they would be
    black in the scene. cloud: of a linked file. Returns what was done, or ""."""
    if obj.patina.colors.source != 'OWN':
        return ""
    found = _of_cloud(cloud) if cloud else _data(obj, frame)
    if found.kind == Data.INTENSITY:
        return _show_intensity(obj, found.flat, frame)
    if found.kind == Data.COLORS or add_light.is_dark(bpy.context.scene):
        return ""
    return _light_one_color(obj, found.color)
