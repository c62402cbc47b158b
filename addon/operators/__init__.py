# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators and their places in menus."""

from __future__ import annotations

from . import (
    add_light,
    addresses,
    analyze,
    camera_paths,
    clips,
    colors,
    combine,
    compare,
    convert_points,
    drawings,
    export_drawings,
    export_points,
    farm,
    import_points,
    level,
    linked_points,
    measure,
    measures,
    plan,
    points,
    points_keys,
    points_tools,
    points_values,
    preferences,
    reveal,
    samples,
    scanner,
    scans,
    set_up,
    shadows,
    soft_brush,
    stations,
    styles,
    untrusted,
    view_from_here,
    view_transform,
    world,
)

_MODULES = (add_light, analyze, camera_paths, clips, colors, import_points, addresses, export_points, combine, compare, convert_points, farm, level, linked_points, plan,
            points, points_keys, points_tools, points_values, measure, measures, drawings, export_drawings, preferences, samples, reveal, scanner, scans,
            set_up, shadows, soft_brush, stations, styles, untrusted,
            view_from_here, view_transform, world)


def register() -> None:
    for module in _MODULES:
        module.register()


def unregister() -> None:
    for module in reversed(_MODULES):
        module.unregister()
