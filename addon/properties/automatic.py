# SPDX-License-Identifier: GPL-3.0-or-later
"""Switches beside numbers of which one value, zero as a rule, leaves them to Patina: what an artist sees is a box and the word Automatic.

A switch holds nothing of its own, so that files, styles and scripts know only the number. It is the property `use_NAME` beside
NAME; ui/rows.py draws the two.
"""

from __future__ import annotations

from collections.abc import Callable

from bpy.types import PropertyGroup

from .heard import BoolProperty


def switch(name: str, start: float | Callable[[PropertyGroup], float], description: str, label: str = "",
           least: str = "", automatic: int = 0) -> BoolProperty:
    """Of the number `name`. start: what it becomes when the box is ticked; least: another number that it has to be above, else
    zero. automatic: what leaves it to Patina; where that is below zero, zero itself is a number of the artist's."""
    def bound(group: PropertyGroup) -> float:
        return getattr(group, least) if least else 0.0

    def get(group: PropertyGroup) -> bool:
        value = getattr(group, name)
        return value >= 0.0 if automatic < 0.0 else value > bound(group)

    def set_(group: PropertyGroup, value: bool) -> None:
        if value != get(group):
            setattr(group, name, (start(group) if callable(start) else start) if value else automatic)

    return BoolProperty(name=label or f"Set {name.replace('_', ' ').title()}", description=description, get=get, set=set_,
                        options={'SKIP_SAVE'}, override={'LIBRARY_OVERRIDABLE'})
