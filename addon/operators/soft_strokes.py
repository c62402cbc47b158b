# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes of a brush over points of a cloud that is Blender's own: which of them they meet, and the attribute that keeps how soft each is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from bpy.types import Attribute, Context, Object

from .. import native, point_data
from ..sync.analyses.analyzing import ANALYSES
from ..sync.points import attributes, edits
from .view_tools import Place, Seen, describe

NAME = "soft"  # of a new attribute
CORNERS = 32  # of the brush


def why_not(obj: Object | None) -> str:
    """Why an object's points cannot be painted; empty: they can."""
    if not point_data.may_have_points(obj):
        return "the active object has no points"
    if obj.patina.linked_file:
        return "a linked file's points are not Blender's: let an attribute of the file say which are soft, or import it without Link"
    if obj.library or obj.data.library:
        return "the object belongs to another file"
    if obj.mode != 'OBJECT':
        return "only in Object Mode"
    if not point_data.holds_points(obj):
        return "the mesh has faces: only clouds of points are painted"
    return "" if point_data.count_of(obj.data) else "the object has no points"


# ---- the attribute ---------------------------------------------------------------------------------------------------


def _found(obj: Object, name: str) -> Attribute | None:
    found = obj.data.attributes.get(name) if name else None
    return found if found and (found.domain, found.data_type) == ('POINT', 'FLOAT') else None


def _attribute(obj: Object) -> Attribute:
    """What is painted: the attribute that the panel names, or one that it names from now on."""
    group = obj.patina.soft
    named = group.attribute if group.by == 'ATTRIBUTE' else ""
    found = _found(obj, named)
    if found is None:
        found = _begin(obj, named)
    if not group.use:
        group.use = True
    return found


def _begin(obj: Object, named: str) -> Attribute:
    """Another one for the panel, with what it goes by so far: weights of a group, whole numbers of 0 and 1."""
    group, count = obj.patina.soft, point_data.count_of(obj.data)
    old = attributes.scalars(obj.data, count, named)
    old = attributes.weights(obj, obj.data, count, named) if old is None else old
    going_on = old is not None and 0.0 <= old.min() and old.max() <= 1.0
    found = None if going_on else _found(obj, NAME)
    if found is None:
        found = obj.data.attributes.new(NAME, 'FLOAT', 'POINT')
        if going_on:
            found.data.foreach_set("value", old.reshape(-1))
    group.by, group.attribute = 'ATTRIBUTE', found.name
    if not (going_on and group.use_range):
        group.use_range, group.range_min, group.range_max = True, 0.0, 1.0
    group.invert = group.invert and going_on
    return found


def _number(obj: Object, values: np.ndarray, strength: float) -> float:
    """What the panel brings to a strength of 0 to 1. Numbers beyond those are given a range that stays."""
    group = obj.patina.soft
    known = values[np.isfinite(values)]
    if not group.use_range and len(known) and (known.min() < 0.0 or known.max() > 1.0):
        low, high = np.percentile(known, (1.0, 99.0))
        group.use_range, group.range_min, group.range_max = True, low, high if high > low else low + 1.0
    share = 1.0 - strength if group.invert else strength
    return group.range_min + share * (group.range_max - group.range_min) if group.use_range else share


def write(obj: Object, bits: edits.Bits, strength: float) -> None:
    """Makes points of an object as soft as that, and has pictures show it."""
    name, count = _attribute(obj).name, point_data.count_of(obj.data)
    values = attributes.scalars(obj.data, count, name).reshape(-1)
    values[edits.flags(bits, count)] = _number(obj, values, strength)
    point_data.writable(obj.data, name, 'FLOAT').data.foreach_set("value", values)
    point_data.changed(obj.data)


# ---- a stroke --------------------------------------------------------------------------------------------------------


class Stroke:
    """Gathers the points that a brush passes, as the view shows them at its beginning, soft ones as others. PatinaError, CameraError."""

    def __init__(self, context: Context, obj: Object, radius: float, through: bool) -> None:
        self.name, self.radius = obj.name, radius
        self._last: Place | None = None
        count = point_data.count_of(obj.data)
        self.bits = np.zeros((count + 7) // 8, np.uint8)
        with ANALYSES.drawing():
            description = describe(context)
            items = [item for item in description.clouds if item.name != obj.name or item.cloud.count == count]
            if len(items) < len(description.clouds):
                raise native.PatinaError(f"modifiers of '{obj.name}' make other points of it")
            self._seen = Seen(replace(description, clouds=items), {obj.name}, through)

    def to(self, place: Place, last: bool = False) -> bool:
        """Goes on to a place, where it is half a radius away or the last one. Whether it did."""
        way = 0.0 if self._last is None else np.hypot(*np.subtract(place, self._last))
        if self._last is not None and (way == 0.0 or way < 0.5 * self.radius and not last):
            return False
        with ANALYSES.drawing():
            for bits in self._seen.points(swept(self._last or place, place, self.radius)).values():
                self.bits |= bits
        self._last = place
        return True

    def close(self) -> None:
        self._seen.close()

    def __enter__(self) -> Stroke:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def swept(start: Place, end: Place, radius: float) -> np.ndarray:
    """Corners of what a disc covers on its way."""
    along = np.arctan2(end[1] - start[1], end[0] - start[0])
    angles = along + np.linspace(-0.5 * np.pi, 0.5 * np.pi, CORNERS // 2)
    half = radius * np.stack([np.cos(angles), np.sin(angles)], 1)
    return np.concatenate([np.asarray(end) + half, np.asarray(start) - half])
