# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows that panels share."""

from __future__ import annotations

import blf
from bpy.types import Context, PropertyGroup, UILayout


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


# ---- texts of a width that is known only when they are drawn ---------------------------------------------------------

MARGINS = 57  # between a sidebar and the lines of its panels, its tabs included: measured in Blender 3.4
LEAST = 220 - MARGINS  # of a sidebar as it opens first, in pixels at a resolution scale of 1
_PAD, _ICON = 10, 20  # around a label's text, before it


def text_width(context: Context, text: str) -> float:
    """Pixels at a resolution scale of 1, as the interface writes it."""
    points = context.preferences.ui_styles[0].widget.points
    blf.size(0, points)
    return blf.dimensions(0, text)[0]


def room(context: Context) -> float:
    """Pixels at a resolution scale of 1 that a panel's line has in this region."""
    scale = context.preferences.system.ui_scale
    return max(context.region.width / scale - MARGINS, LEAST / 2) if context.region and scale else LEAST


def lines(context: Context, text: str, width: float) -> list[str]:
    """A text on as many lines as it needs to be read; a word that is wider than a line is on one of its own."""
    found: list[str] = []
    for word in text.split():
        if found and text_width(context, f"{found[-1]} {word}") <= width - _PAD:
            found[-1] += f" {word}"
        else:
            found.append(word)
    return found


def sentence(context: Context, layout: UILayout, text: str, icon: str) -> None:
    """On as many lines as the region needs."""
    column = layout.column(align=True)
    column.scale_y = 0.8
    for line in lines(context, text, room(context) - (_ICON if icon != 'NONE' else 0)):
        column.label(text=line, icon=icon)
        icon = 'BLANK1' if icon != 'NONE' else 'NONE'


def table(context: Context, layout: UILayout, rows: list[tuple[str, str]]) -> None:
    """Names and values. A value that is too wide stands below its name."""
    column, width = layout.column(align=True), room(context)
    for name, value in rows:
        if text_width(context, name) <= 0.4 * width - _PAD and text_width(context, value) <= 0.6 * width - _PAD:
            split = column.split(factor=0.4)
            split.label(text=name)
            split.label(text=value)
            continue
        column.label(text=name)
        for line in lines(context, value, 0.9 * width):
            split = column.split(factor=0.1)
            split.label()
            split.label(text=line)
