# SPDX-License-Identifier: GPL-3.0-or-later
"""The brush for points: of the window manager, so that neither undo nor a picture follows it."""

from __future__ import annotations

from bpy.types import PropertyGroup

from .heard import BoolProperty, FloatProperty

STRENGTH = {"name": "Strength", "default": 1.0, "min": 0.0, "max": 1.0, "subtype": 'FACTOR',
            "description": "Number that the points get: with more than the threshold they are soft"}
RADIUS = {"name": "Radius", "default": 40.0, "min": 1.0, "max": 5000.0, "soft_max": 500.0, "subtype": 'PIXEL', "precision": 0,
          "description": "Of the brush, in pixels of the view"}
THROUGH = {"name": "Through", "default": False, "description": "Points that others hide too; else only those that the view shows"}


class PatinaBrushProperties(PropertyGroup):
    strength: FloatProperty(**STRENGTH)
    radius: FloatProperty(**RADIUS)
    through: BoolProperty(**THROUGH)
