# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows that panels share."""

from __future__ import annotations

from bpy.types import PropertyGroup, UILayout


def automatic(layout: UILayout, group: PropertyGroup, name: str, text: str = "", otherwise: str = "Automatic") -> UILayout:
    """A number that zero leaves to Patina: a box, and beside it the number, or `otherwise` where it is left. Returns the row."""
    row = layout.row(heading=text or group.bl_rna.properties[name].name, align=True)
    row.use_property_decorate = False
    row.prop(group, f"use_{name}", text="")
    if not getattr(group, f"use_{name}"):
        row.label(text=otherwise)
        return row
    row.prop(group, name, text="")
    if layout.use_property_decorate:
        row.prop_decorator(group, name)
    return row
