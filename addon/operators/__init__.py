# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators and their places in menus."""

from __future__ import annotations

from . import (
    add_light,
    addresses,
    analyze,
    clips,
    colors,
    combine,
    convert_points,
    export_points,
    farm,
    import_points,
    level,
    linked_points,
    plan,
    points,
    points_keys,
    points_tools,
    preferences,
    scanner,
    scans,
    set_up,
    shadows,
    soft_brush,
    stations,
    styles,
    untrusted,
    view_transform,
    world,
)

_MODULES = (add_light, analyze, clips, colors, import_points, addresses, export_points, combine, convert_points, farm, level, linked_points, plan,
            points, points_keys, points_tools, preferences, scanner, scans, set_up, shadows, soft_brush, stations, styles, untrusted,
            view_transform, world)


def register() -> None:
    for module in _MODULES:
        module.register()


def unregister() -> None:
    for module in reversed(_MODULES):
        module.unregister()
