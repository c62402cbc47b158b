# SPDX-License-Identifier: GPL-3.0-or-later
"""What an object says of soft points → fields of patina_cloud_style, and the field that divides its points."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ... import native
from ...description.points import Soft
from ...native.abi import FIELD_SOURCE, SOFT
from ...native.points import Field
from ...properties import enum_number
from ..view.camera import row_major
from .colors import class_bits
from .edits import keep


def attribute_name(obj: bpy.types.Object) -> str:
    """Whose numbers points are soft by; empty: of none."""
    group = obj.patina.soft
    return group.attribute if group.use and group.by == 'ATTRIBUTE' else ""


def soft_of(obj: bpy.types.Object, matrix: Matrix, scene: bpy.types.Scene) -> Soft | None:
    """Of an evaluated object, which lies at matrix in an evaluated scene; None: its points are surface."""
    group = obj.patina.soft
    if not group.use:
        return None
    style = {
        "soft": SOFT["ALL" if group.by == 'ALL' else "FIELD"],
        "soft_model": enum_number(scene.patina, "soft_model"),
        "soft_radius": group.radius if group.use_radius else 0.0,
        "soft_opacity": group.opacity,
        "soft_modulation": group.transition,
    }
    if group.by == 'ALL':
        return Soft(group.by, "", tuple(style.items()))
    if group.hide:
        style["soft"] = SOFT["HIDDEN"]
    style["soft_threshold"] = group.threshold
    desc: dict[str, Any] = {"source": enum_number(group, "by")}
    if group.by == 'CLASSES':
        desc["classes"] = class_bits(group.classes)
    placed = True
    if group.by == 'DISTANCE':
        target = group.target or scene.camera
        placed = not target or math.isfinite(sum(map(sum, target.matrix_world)))
        desc["shape"] = enum_number(group, "shape")
        desc["world_from_object"] = row_major(matrix)
        desc["world_from_shape"] = row_major(target.matrix_world if target else Matrix())
    if group.use_range:
        desc["range"] = (group.range_min, group.range_max)
    return Soft(group.by, group.attribute, tuple(style.items()), (*desc.items(), ("invert", group.invert)), placed)


def field_of(cloud: native.Cloud, soft: Soft) -> Field | None:
    """Any thread. None where all points are soft."""
    if soft.by == 'ALL':
        return None
    desc = dict(soft.desc)
    values = cloud.numbers if soft.by == 'ATTRIBUTE' else None
    return keep(cloud, ("field", soft.desc, cloud.numbers_stamp), lambda: _make(cloud, values, **desc))


def _make(cloud: native.Cloud, values: np.ndarray | None, **desc: Any) -> Field:
    return Field(cloud, values, **desc | ({"source": FIELD_SOURCE["VALUES"]} if values is not None else {}))
