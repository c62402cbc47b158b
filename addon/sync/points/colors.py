# SPDX-License-Identifier: GPL-3.0-or-later
"""What an object says of its points' colours → the fields of patina_cloud_style."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import bpy
import numpy as np

from ... import native
from ...properties import enum_number
from ...properties.colors import CLASSES

OWN = 0  # PATINA_COLOR_OWN
FIXED = 1  # PATINA_COLOR_FIXED
SCALAR = 2  # PATINA_COLOR_SCALAR
TRUST = 6  # PATINA_COLOR_TRUST
UNCLASSIFIED = 1 << 0 | 1 << 1  # bits of the classes: never classified, unassigned


def style_fields(obj: bpy.types.Object) -> dict[str, Any]:
    group = obj.patina.colors
    return {
        "color_source": OWN if group.source == 'MATERIAL' else enum_number(group, "source"),
        "ramp": _ramp(group),
        "ramp_range": _range(group),
        "exposure": group.exposure,
        "contrast": group.contrast,
        "hidden_classes": _hidden_classes(obj),
        "clip_off": int(not group.use_clips),
    }


def scalar_name(obj: bpy.types.Object) -> str:
    """The attribute that a ramp is laid over, else that which contour lines follow: a cloud has one. Empty: none."""
    group = obj.patina.colors
    return group.scalar if group.source == 'SCALAR' else group.contour


def _ramp(group: bpy.types.PropertyGroup) -> bytes:
    """Linear RGB, float32. A custom ramp that is not there is grey."""
    if group.source in {'OWN', 'FIXED', 'MATERIAL'}:
        return b""
    if group.ramp != 'CUSTOM':
        return native.ramp(group.ramp.lower()).tobytes()
    texture = group.texture
    if texture is None or texture.color_ramp is None:
        return b""
    places = np.linspace(0.0, 1.0, native.MOST_RAMP)
    return np.array([texture.color_ramp.evaluate(place)[:3] for place in places], np.float32).tobytes()


def _range(group: bpy.types.PropertyGroup) -> tuple[float, float]:
    """Equal values: automatic."""
    if group.use_range:
        return (group.range_min, group.range_max)
    return (0.0, 255.0) if group.ramp == 'CLASSES' and group.source == 'SCALAR' else (0.0, 0.0)


def _hidden_classes(obj: bpy.types.Object) -> tuple[int, ...]:
    first, *others = hidden_classes(obj.patina.colors)
    return (first | UNCLASSIFIED * obj.patina.hide_unclassified, *others)


def hidden_classes(group: bpy.types.PropertyGroup) -> tuple[int, ...]:
    """256 bits in eight words."""
    return class_bits(group.hidden_more, {number for number in range(CLASSES) if group.hidden[number]})


def class_bits(listed: str, beside: Iterable[int] = ()) -> tuple[int, ...]:
    """256 bits in eight words, of a list as 3-5, 64 and others beside it. What is no class in the list is left out."""
    numbers = set(beside)
    for part in listed.split(","):
        first, _, last = (text.strip() for text in part.partition("-"))
        if first.isdigit() and (last.isdigit() or not last):
            numbers.update(range(int(first), min(int(last or first), 255) + 1))
    return tuple(sum(1 << number % 32 for number in numbers if number // 32 == word) for word in range(8))
