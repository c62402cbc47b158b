# SPDX-License-Identifier: GPL-3.0-or-later
"""When a linked cloud's files follow one another: a file a frame."""

from __future__ import annotations

from bpy.types import PropertyGroup

from .heard import EnumProperty, IntProperty

_OVERRIDE = {'LIBRARY_OVERRIDABLE'}


class PatinaSequenceProperties(PropertyGroup):
    """Used where the name of the linked file holds number signs, which stand for digits: scan_####.ply."""

    start: IntProperty(
        name="Start Frame", override=_OVERRIDE, default=1,
        description="Frame at which the file with the least number shows")
    step: IntProperty(
        name="Frames per File", override=_OVERRIDE, default=1, min=1, soft_max=100,
        description="How many frames a file stays")
    outside: EnumProperty(
        name="Outside", override=_OVERRIDE, default='HOLD',
        description="What shows before the first file and after the last",
        items=(
            ('HOLD', "Hold", "The first or the last file", 0),
            ('LOOP', "Loop", "The files over and over", 1),
            ('HIDE', "Hide", "Nothing", 2)))
