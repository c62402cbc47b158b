# SPDX-License-Identifier: GPL-3.0-or-later
"""The style that an artist picks. Choosing one applies it: one step of undo, as any other property."""

from __future__ import annotations

from bpy.types import Context, PropertyGroup, Scene

from ..styles import styles
from . import answers
from .heard import EnumProperty, StringProperty

_Item = tuple[str, str, str, int, int]
_lists: dict[frozenset[str], list[_Item]] = {}  # by the missing data; Blender does not keep the strings that a callback gives it


def _list(group: PatinaStyleProperties | None, _context: Context | None) -> list[_Item]:
    """One item per style. A style whose data no cloud of the scene has says so."""
    missing = answers.missing_data(group.id_data) if group and isinstance(group.id_data, Scene) else frozenset()
    fresh = [_item(entry, number, missing) for number, entry in enumerate(styles.entries())]
    if fresh != _lists.get(missing):
        _lists[missing] = fresh
    return _lists[missing]


def _item(entry: styles.Entry, number: int, missing: frozenset[str]) -> _Item:
    label, about = entry.label, entry.about
    lacks = next((name for name in entry.needs if name in missing), "")
    if lacks:
        label += f" (No {lacks.split()[-1].title()})"
        about = f"{about}. No points of this scene have {lacks}".lstrip(". ")
    return entry.key, label, about, styles.icon(entry), number


def _chosen(group: PatinaStyleProperties) -> int:
    keys = [item[0] for item in _list(None, None)]
    known = group.applied if group.applied in keys else styles.PLAIN
    return keys.index(known)


def _choose(group: PatinaStyleProperties, number: int) -> None:
    group.applied = _list(None, None)[number][0]


def _apply(group: PatinaStyleProperties, _context: Context) -> None:
    """What went wrong cannot be raised here: panels show the notice."""
    try:
        group.notice = "; ".join(styles.apply_to_scene(group.id_data, group.applied))
    except styles.StyleError as error:
        group.notice = str(error)


class PatinaStyleProperties(PropertyGroup):
    chosen: EnumProperty(
        name="Style", items=_list, get=_chosen, set=_choose, update=_apply, options=set(),
        description="Look of the points: lines, light, colors and background")
    objects: EnumProperty(
        name="Apply To", default='ALL', options=set(),
        description="Objects that a style changes, in addition to the scene",
        items=(
            ('ALL', "All Points", "All objects of the scene that Patina draws", 0),
            ('SELECTED', "Selected", "Only selected objects. Others keep their colors and lighting", 1)))
    applied: StringProperty(options={'HIDDEN'})
    notice: StringProperty(options={'HIDDEN', 'SKIP_SAVE'})
