# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels, and Blender's own panels shown for our engine."""

from __future__ import annotations

from . import (
    animation,
    colors,
    combine,
    cryptomatte,
    drawings,
    effects,
    lines,
    marks,
    materials,
    measures,
    motion,
    panels,
    panorama,
    points,
    presets,
    ranges,
    sampling,
    scan_points,
    sequence,
    soft,
    standard,
    statistics,
    styles,
    trust,
    world,
)

# What makes the look comes first, then how it is drawn.
_MODULES = (presets, styles, lines, effects, panels, sampling, marks, cryptomatte, points, measures, drawings, trust, colors, soft, ranges, scan_points, motion, combine, panorama,
            sequence, materials, world, statistics, animation, standard)


def register() -> None:
    for module in _MODULES:
        module.register()


def unregister() -> None:
    for module in reversed(_MODULES):
        module.unregister()
