# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of a linked cloud whose files follow one another."""

from __future__ import annotations

import bpy
from bpy.types import Context, Panel

from ..draw.engine import PatinaRenderEngine
from ..sync.points import files, sequence
from . import rows


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
                and bool(context.object.patina.linked_file) and sequence.is_pattern(files.path_of(context.object)))

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        obj = context.object
        settings = obj.patina.sequence
        layout.prop(settings, "start")
        layout.prop(settings, "step")
        layout.prop(settings, "outside")
        found = sequence.files_of(files.path_of(obj))
        rows.sentence(context, layout, f"{len(found)} files, {min(found)} to {max(found)}" if found else "No file fits", 'INFO')
        if obj.patina.analysis == 'AUTO':
            rows.sentence(context, layout, "Drawn without an analysis: Analysis > Always makes sparse points finer, and each frame slower", 'NONE')


register, unregister = bpy.utils.register_classes_factory((PATINA_PT_sequence,))
