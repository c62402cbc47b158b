# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of a linked cloud whose files follow one another."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.types import Context, Panel

from ..engine import PatinaRenderEngine
from ..sync import sequence


class PATINA_PT_sequence(Panel):
    bl_label = "Sequence"
    bl_parent_id = "PATINA_PT_points"
    bl_space_type = 'PROPERTIES'
    bl_region_type = 'WINDOW'
    bl_context = "data"
    COMPAT_ENGINES = {PatinaRenderEngine.bl_idname}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return (context.engine in cls.COMPAT_ENGINES and context.object is not None
                and "#" in context.object.patina.linked_file)

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        obj = context.object
        settings = obj.patina.sequence
        layout.prop(settings, "start")
        layout.prop(settings, "step")
        layout.prop(settings, "outside")
        pattern = Path(bpy.path.abspath(obj.patina.linked_file, library=obj.library))
        files = sequence.files_of(pattern)
        layout.label(text=f"{len(files)} files, {min(files)} to {max(files)}" if files else "no file fits", icon='INFO')


register, unregister = bpy.utils.register_classes_factory((PATINA_PT_sequence,))
