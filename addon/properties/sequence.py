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
        description="Frame that shows the file with the lowest number")
    step: IntProperty(
        name="Frames per File", override=_OVERRIDE, default=1, min=1, soft_max=100,
        description="Number of frames per file")
    outside: EnumProperty(
        name="Outside", override=_OVERRIDE, default='HOLD',
        description="What to show before the first and after the last file",
        items=(
            ('HOLD', "Hold", "The first or the last file", 0),
            ('LOOP', "Loop", "Repeat the files", 1),
            ('HIDE', "Hide", "Show nothing", 2)))
