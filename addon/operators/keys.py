# SPDX-License-Identifier: GPL-3.0-or-later
"""Keyframes that operators add: ordinary ones, which the user can edit."""

from __future__ import annotations

from collections.abc import Sequence

from bpy.types import ID, FCurve, Operator, Scene

from ..styles import styles

LEAST_FRAMES = 2


def curves_of(owner: ID) -> list[FCurve]:
    """The F-curves of an ID's action."""
    found = owner.animation_data
    return styles.curves_in(found.action, getattr(found, "action_slot", None)) if found and found.action else []


def add(owner: ID, path: str, index: int, keys: Sequence[tuple[float, float]], interpolation: str, ends: str = 'CONSTANT') -> None:
    """Keys one number of an ID's property at (frame, value) pairs, in place of its earlier keys. index: -1 for a property that is no array.
    ends: extrapolation, CONSTANT or LINEAR. The handles of BEZIER do not overshoot."""
    group, _, name = path.rpartition(".")
    holder = owner.path_resolve(group) if group else owner
    if earlier := _curve(owner, path, index):
        for point in reversed(earlier.keyframe_points):
            earlier.keyframe_points.remove(point, fast=True)
    for frame, value in keys:
        if index < 0:
            setattr(holder, name, value)
        else:
            values = getattr(holder, name)
            values[index] = type(values[index])(value)
        owner.keyframe_insert(path, index=index, frame=frame)
    curve = _curve(owner, path, index)
    for point in curve.keyframe_points:
        point.interpolation = interpolation
        point.handle_left_type = point.handle_right_type = 'AUTO_CLAMPED'
    curve.extrapolation = ends
    curve.update()


def is_keyed(owner: ID, path: str, index: int) -> bool:
    return _curve(owner, path, index) is not None


def _curve(owner: ID, path: str, index: int) -> FCurve | None:
    return next((curve for curve in curves_of(owner) if curve.data_path == path and curve.array_index == max(index, 0)), None)


def take_frames(operator: Operator, scene: Scene) -> int:
    """The operator's number of frames: by default as many as the scene has. The scene's frame range ends after them."""
    if not operator.properties.is_property_set("frames"):
        operator.frames = max(scene.frame_end - scene.frame_start + 1, LEAST_FRAMES)
    scene.frame_end = scene.frame_start + operator.frames - 1
    return operator.frames
