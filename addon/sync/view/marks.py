# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of a scene → what is written over its image."""

from __future__ import annotations

import math
import weakref
from dataclasses import asdict

import bpy
import numpy as np

from ... import native, point_data
from ...description.marks import Bar, Legend, Marks, Strokes
from ...description.points import CloudItem
from ...description.view import View
from ...native.abi import COLOR_SOURCE
from ...properties.colors import class_name
from .. import measures
from ..points import attributes, coloring

BAR = 0.22  # of the image's width: the longest bar
TICKS = 5  # about so many values beside a ramp
LEAST_NORTH = 0.1  # of its length: how much of the direction to the north must lie in the image
# meters, name, by the scene's system of units
_UNITS = {'METRIC': ((1000.0, "km"), (1.0, "m"), (0.01, "cm"), (0.001, "mm")), 'IMPERIAL': ((1609.344, "mi"), (0.3048, "ft"), (0.0254, "in"))}
_LENGTHS = {"Height Above Ground", "Spacing", "Thickness", "Distance to Other"}  # attributes in the object's units
_spans: weakref.WeakKeyDictionary[native.Cloud, tuple[tuple, tuple[float, float]]] = weakref.WeakKeyDictionary()
_classes: weakref.WeakKeyDictionary[native.Cloud, tuple[int, ...]] = weakref.WeakKeyDictionary()


def read(scene: bpy.types.Scene, view: View, items: list[CloudItem], layer: bpy.types.ViewLayer | None = None) -> Marks | None:
    """None: nothing is written. Main thread, or that of a final render. layer: whose measurements are written; None: none."""
    group = scene.patina.marks
    titles = tuple(filter(None, (group.title or scene.name, group.note))) if group.use_title else ()
    marks = Marks(tuple(filter(None, (_legend(scene, item, view) for item in items))),
                  _bar(scene, view) if group.use_bar else None, _north(group.north, view) if group.use_north else None,
                  titles, group.size, group.burn, _strokes(scene, view, layer) if layer and group.use_measures else None)
    return marks if marks.legends or marks.bar or marks.north is not None or marks.titles or marks.strokes else None


def round_step(value: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not above value."""
    power = 10.0 ** math.floor(math.log10(value))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= value * (1.0 + 1e-9))


def ticks(low: float, high: float) -> list[tuple[float, str]]:
    """Round values from low to high and their texts, all with the same digits after the point."""
    if not low < high:
        return [(low, f"{low:.6g}")]
    step = round_step((high - low) / (TICKS - 1))
    digits = max(-math.floor(math.log10(step) + 1e-9), 0)
    first, last = math.ceil(low / step - 1e-6), math.floor(high / step + 1e-6)
    return [(number * step, f"{number * step + 0.0:,.{digits}f}") for number in range(first, last + 1)]


def unit_of(scene: bpy.types.Scene, length: float) -> tuple[float, str]:
    """How many of its unit one scene unit is, and the unit's name, for lengths about so long in scene units. Empty name: no units."""
    settings = scene.unit_settings
    if settings.system not in _UNITS:
        return 1.0, ""
    meters = abs(length) * settings.scale_length
    size, name = next((unit for unit in _UNITS[settings.system] if meters >= unit[0] * (1.0 - 1e-9)), _UNITS[settings.system][-1])
    return settings.scale_length / size, name


def _bar(scene: bpy.types.Scene, view: View) -> Bar | None:
    camera, distance = view.camera, scene.patina.marks.bar_distance
    if view.panorama or not camera.orthographic and distance <= 0.0:
        return None
    width = (camera.right - camera.left) * (1.0 if camera.orthographic else distance)
    if not width > 0.0:
        return None
    factor, name = unit_of(scene, BAR * width)
    length = round_step(BAR * width * factor)
    text = f"{length:,.10g} {name}".strip()
    if not camera.orthographic:
        far, unit = unit_of(scene, distance)
        text += f" at {distance * far:,.4g} {unit}".rstrip()
    return Bar(length / factor / width, text)


def _north(turn: float, view: View) -> float | None:
    if view.panorama:
        return None
    matrix = np.array(view.camera.world_from_camera).reshape(4, 4)[:3, :3]
    axes = matrix / np.linalg.norm(matrix, axis=0)
    x, y, _ = axes.T @ (math.sin(turn), math.cos(turn), 0.0)
    return math.atan2(y, x) if math.hypot(x, y) > LEAST_NORTH else None


def _strokes(scene: bpy.types.Scene, view: View, layer: bpy.types.ViewLayer) -> Strokes | None:
    """None: there are none, or a panorama is drawn."""
    found = [] if view.panorama else list(measures.shown(layer))
    figures = [measures.figure(one, scene) for one in found]
    segments = [_on_image(view, np.stack(pair)) for figure in figures for line in figure.lines for pair in zip(line, line[1:], strict=False)]
    dots = [_on_image(view, np.stack([place, place])) for one in found for place in one.points]
    labels = [(_on_image(view, np.stack([place, place])), text) for figure in figures for place, text in figure.labels]
    return Strokes(tuple(filter(None, segments)), tuple(dot[:2] for dot in dots if dot), tuple((*at[:2], text) for at, text in labels if at)) \
        if found else None


def _on_image(view: View, ends: np.ndarray) -> tuple[float, float, float, float] | None:
    """Pixels of a segment's ends in the part of the image that is drawn, as far as it lies beyond the near clip. None: nowhere."""
    camera = view.camera
    local = (np.column_stack([ends, np.ones(2)]) @ np.linalg.inv(np.array(camera.world_from_camera).reshape(4, 4)).T)[:, :3]
    depths = -local[:, 2] - camera.near_clip
    if depths.max() <= 0.0:
        return None
    if depths.min() < 0.0:
        behind = int(np.argmin(depths))
        local[behind] += (local[1 - behind] - local[behind]) * (-depths[behind] / (depths[1 - behind] - depths[behind]))
    over = np.ones(2) if camera.orthographic else -local[:, 2]
    x = (local[:, 0] / over - camera.left) / (camera.right - camera.left) * view.width - view.region[0]
    y = (local[:, 1] / over - camera.bottom) / (camera.top - camera.bottom) * view.height - view.region[1]
    return float(x[0]), float(y[0]), float(x[1]), float(y[1])


def _legend(scene: bpy.types.Scene, item: CloudItem, view: View) -> Legend | None:
    obj = bpy.data.objects.get(item.name)
    if obj is None or not obj.patina.colors.use_legend or not item.style.ramp:
        return None
    group, label, style = obj.patina.colors, coloring.current(obj), item.style
    cloud = item.cloud if isinstance(item.cloud, native.Cloud) else item.cloud.built
    if group.source == 'SCALAR' and group.ramp == 'CLASSES':
        found = _swatches(obj, cloud)
        return Legend(label, swatches=found) if found else None
    low, high = style.ramp_range if style.ramp_range[0] != style.ramp_range[1] else _automatic(item, cloud, view)
    if not low < high and not high < low:  # one value, or the cloud is not there yet
        return Legend(label, style.ramp, ((0.0, "lowest"), (1.0, "highest")))
    factor, unit = 1.0, ""
    if group.source in {'HEIGHT', 'DISTANCE'}:
        factor, unit = unit_of(scene, high - low)
    elif group.source == 'OBJECT_HEIGHT' or label in _LENGTHS:
        size = obj.matrix_world.median_scale
        factor, unit = unit_of(scene, (high - low) * size)
        factor *= size
    shown = tuple(((value / factor - low) / (high - low), text) for value, text in ticks(low * factor, high * factor))
    return Legend(f"{label} ({unit})" if unit else label, style.ramp, shown)


def _automatic(item: CloudItem, cloud: native.Cloud | None, view: View) -> tuple[float, float]:
    """The ends of a ramp without a range of its own, as the library takes them for images. 0, 0: they are not known."""
    style = item.style
    if cloud is None or view.panorama and style.color_source == COLOR_SOURCE["DISTANCE"] or \
            style.color_source == COLOR_SOURCE["SCALAR"] and not cloud.has_scalars:
        return 0.0, 0.0
    key = (style.color_source, style.world_from_object, view.camera if style.color_source == COLOR_SOURCE["DISTANCE"] else None)
    known = _spans.get(cloud)
    if known is None or known[0] != key:
        try:
            with native.Scene() as scene:
                scene.add_cloud(cloud, color_source=style.color_source, world_from_object=style.world_from_object)
                scene.set_camera(**asdict(view.camera))
                known = key, scene.ramp_range(0)
        except native.PatinaError:  # it has no points
            known = key, (0.0, 0.0)
        if style.color_source != COLOR_SOURCE["SCALAR"]:  # scalars are exchanged under the same cloud
            _spans[cloud] = known
    return known[1]


def _swatches(obj: bpy.types.Object, cloud: native.Cloud | None) -> tuple[tuple[tuple[float, float, float], str], ...]:
    """The classes of the points that are not hidden. Of a linked file, all between the smallest and the largest."""
    group = obj.patina.colors
    table = native.ramp("classes")
    return tuple((tuple(map(float, table[number])), class_name(number)) for number in _classes_of(obj, cloud)
                 if number < len(table) and not (number < len(group.hidden) and group.hidden[number]))


def _classes_of(obj: bpy.types.Object, cloud: native.Cloud | None) -> tuple[int, ...]:
    if cloud is None or not cloud.has_scalars:
        return ()
    if cloud not in _classes:
        low, high = cloud.scalar_range(0.0)
        found = range(max(round(low), 0), min(round(high), 255) + 1)
        if not obj.patina.linked_file:
            with attributes.readable(obj) as data:
                values = attributes.scalars(data, point_data.count_of(data), obj.patina.colors.scalar)
            if values is not None:
                found = np.unique(attributes.as_classes(values))
        _classes[cloud] = tuple(map(int, found))
    return _classes[cloud]
