# SPDX-License-Identifier: GPL-3.0-or-later
"""What an object's points can be colored by, and the range of its values."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ... import jobs, point_data
from ..analyses.scans_of import SCAN_NAMES
from . import attributes, linked, node_colors

SHARE = 0.01  # of the points that a range leaves out at either end
_NUMBERS = {'FLOAT', 'INT', 'INT8', 'BOOLEAN'}
LAS = {".las", ".laz"}  # files whose points always have an intensity and a class
# label, names of attributes in any case, ramp
_KNOWN = (
    ("Intensity", attributes.INTENSITY_NAMES, 'GREY'),
    ("Class", attributes.CLASS_NAMES, 'CLASSES'),
    ("Scan", SCAN_NAMES, 'SPECTRUM'),
    ("Time", ("gps_time", "time", "timestamp", "scalar_gpstime"), 'VIRIDIS'),
    ("Height Above Ground", ("height_above_ground", "heightaboveground", "hag"), 'VIRIDIS'),
    ("Spacing", ("spacing",), 'VIRIDIS'),
    ("Thickness", ("thickness",), 'VIRIDIS'),
    ("Kind", ("kind",), 'SPECTRUM'),
    ("Uncertainty", ("uncertainty",), 'HEAT'),
    ("Distance to Other", ("distance", "m3c2_distance", "cloud_distance", "mesh_distance"), 'DIVERGING'),
)
_UNLISTED = {"trust"}  # the analysis gives the same values to the source Trust


@dataclass(frozen=True)
class Choice:
    """One entry of Color By."""

    label: str
    source: str  # item of PatinaColorProperties.source
    attribute: str = ""  # of the source SCALAR; of OWN the color attribute, empty: the usual one
    ramp: str = ""  # empty: the current one stays


def choices(obj: bpy.types.Object) -> list[Choice]:
    """All that the points of this object can be colored by. Main thread."""
    found = [Choice("Color", 'OWN')] if _has_colors(obj) else []
    found.append(Choice("One Color", 'FIXED'))
    found += _scalars(obj)
    normal = "" if obj.patina.linked_file else _normal_name(obj)
    if normal:
        found.append(Choice("Normal", 'OWN', normal))
    if not obj.patina.linked_file and any(map(node_colors.is_linked, node_colors.materials_of(obj))):
        found.append(Choice("Material", 'MATERIAL'))
    return found + [Choice("Height", 'HEIGHT', ramp='RELIEF'), Choice("Local Height", 'OBJECT_HEIGHT', ramp='RELIEF'),
                    Choice("Distance from Camera", 'DISTANCE', ramp='VIRIDIS'), Choice("Trust", 'TRUST', ramp='VIRIDIS')]


def current(obj: bpy.types.Object) -> str:
    """The label of what the points are colored by now."""
    group = obj.patina.colors
    if group.source == 'SCALAR':
        return _label(group.scalar)[0] if group.scalar else "Attribute"
    if group.source == 'MATERIAL' or node_colors.used(obj):
        return "Material"
    if group.source == 'OWN':
        return "Normal" if obj.patina.color_attribute in attributes.NORMAL_NAMES else "Color"
    return next(choice.label for choice in choices(obj) if choice.source == group.source)


def apply(obj: bpy.types.Object, choice: Choice, frame: int) -> bool:
    """Colors the points by a choice. Values get the range between their 1st and 99th percentile, which for distances to another cloud or
    mesh is centered at 0. Returns whether the points have finite values. PatinaError if a linked file cannot be read."""
    patina, group = obj.patina, obj.patina.colors
    group.source = choice.source
    if choice.source == 'SCALAR':
        group.scalar = choice.attribute
    if choice.source == 'OWN':
        if choice.attribute or patina.color_attribute in attributes.NORMAL_NAMES:
            patina.color_attribute = choice.attribute
        return True
    if choice.ramp and group.ramp != 'CUSTOM':
        group.ramp = choice.ramp
    if choice.source == 'SCALAR' and patina.lighting == 'AUTO':
        patina.lighting = 'UNLIT'  # values can be told apart
    group.use_range = False
    if choice.source in {'FIXED', 'DISTANCE', 'TRUST', 'MATERIAL'} or group.ramp == 'CLASSES' and choice.source == 'SCALAR':
        return True
    found = value_range(obj, SHARE, frame)
    if found is None:
        return bool(patina.linked_file)
    low, high = found if found[0] < found[1] else value_range(obj, 0.0, frame) or found
    if group.ramp == 'DIVERGING':
        high = max(abs(low), abs(high))
        low = -high
    if low < high:
        group.range_min, group.range_max, group.use_range = low, high, True
    return True


def value_range(obj: bpy.types.Object, share: float, frame: int) -> tuple[float, float] | None:
    """The values of the color source that this share of the points lies below and above. None: there is no finite value, or only a
    picture can tell. PatinaError if a linked file cannot be read."""
    group = obj.patina.colors
    if obj.patina.linked_file:
        source = linked.source_of(obj, frame, [])
        if group.source != 'SCALAR' or source is None:
            return None
        cloud = jobs.run(lambda: linked.load(source), lambda: None, lambda: False).cloud
        return cloud.scalar_range(share) if cloud.has_scalars else None
    with attributes.readable(obj) as data:
        count = point_data.count_of(data)
        values = _values(obj, data, count) if count else None
    values = None if values is None else values[np.isfinite(values)]
    if values is None or not len(values):
        return None
    return tuple(float(value) for value in np.quantile(values, (share, 1.0 - share)))


def _values(obj: bpy.types.Object, data: bpy.types.ID, count: int) -> np.ndarray | None:
    """Float array with one value for each point."""
    group = obj.patina.colors
    if group.source == 'SCALAR':
        return attributes.scalars(data, count, group.scalar)
    if group.source not in {'HEIGHT', 'OBJECT_HEIGHT'}:
        return None
    places = attributes.positions(data, count)
    if places is None or group.source == 'OBJECT_HEIGHT':
        return None if places is None else places[:, 2]
    matrix = obj.matrix_world
    return places @ np.array(matrix[2][:3]) + matrix[2][3]


def _label(name: str) -> tuple[str, str, int]:
    """Label, ramp and place in the menu of a numeric attribute."""
    for place, (label, names, ramp) in enumerate(_KNOWN):
        if name.lower() in {known.lower() for known in names}:
            return label, ramp, place
    return name, '', len(_KNOWN)


def _scalars(obj: bpy.types.Object) -> list[Choice]:
    if obj.patina.linked_file:
        names = ["intensity", "class"] if Path(obj.patina.linked_file).suffix.lower() in LAS else []
        if obj.patina.colors.scalar and obj.patina.colors.scalar not in names:
            names.append(obj.patina.colors.scalar)
    else:
        names = [item.name for item in obj.data.attributes if item.domain == 'POINT' and item.data_type in _NUMBERS
                 and not item.name.startswith(".") and item.name not in _UNLISTED]
        if not names:
            return [Choice("Attribute", 'SCALAR')]  # the artist names it in the panel
    found = [(_label(name), name) for name in names]
    labels = [label for (label, _, _), _ in found]
    return [Choice(label if labels.count(label) == 1 else f"{label} ({name})", 'SCALAR', name, ramp)
            for (label, ramp, _), name in sorted(found, key=lambda item: (item[0][2], item[1]))]


def _normal_name(obj: bpy.types.Object) -> str:
    return next((item.name for item in obj.data.attributes if item.name in attributes.NORMAL_NAMES and item.domain == 'POINT'
                 and item.data_type == 'FLOAT_VECTOR'), "")


def _has_colors(obj: bpy.types.Object) -> bool:
    """Of a linked file only a picture can tell, so it counts as colored."""
    return bool(obj.patina.linked_file) or any(item.domain == 'POINT' and item.data_type in {'FLOAT_COLOR', 'BYTE_COLOR'}
                                               for item in obj.data.attributes)
