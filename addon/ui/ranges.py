# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel of an object that is drawn as range images."""

from __future__ import annotations

import bpy
from bpy.types import Context, Panel

from ..read.importers import scans
from . import rows
from .colors import ColorPanel


class PATINA_PT_ranges(ColorPanel, Panel):
    bl_label = "Range Images"
    bl_options = {'DEFAULT_CLOSED'}
    bl_order = 1

    def draw_header(self, context: Context) -> None:
        self.layout.prop(context.object.patina.ranges, "use", text="")

    def draw(self, context: Context) -> None:
        layout, obj = self.layout, context.object
        layout.use_property_split = True
        group = obj.patina.ranges
        layout.active = group.use or context.scene.patina.surface == 'RANGES'
        if layout.active and obj.patina.soft.use:
            rows.sentence(context, layout, "Soft points are balls, and no range images", 'INFO')
        rows.automatic(layout, group, "gamma")
        rows.automatic(layout, group, "pixel")
        rows.automatic(layout, group, "sharpness", otherwise="One Pass")
        rows.automatic(layout, obj.patina, "d_min", text="Layer Distance")
        known = any(any(scan.direction) for scan in scans.unpacked(obj.data.get(scans.PROPERTY)))
        row = layout.row(heading="Cull Scans")
        row.active = known
        row.use_property_decorate = False
        row.prop(group, "use_cull", text="")
        row = row.row()
        row.active = group.use_cull
        row.prop(group, "cull", text="")
        if not known:
            rows.sentence(context, layout, "The file does not say in which direction its scans were taken", 'INFO')


register, unregister = bpy.utils.register_classes_factory((PATINA_PT_ranges,))
