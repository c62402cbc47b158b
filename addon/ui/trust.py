# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel of the trust of an object's points: the threshold in a histogram, and how many points it leaves out."""

from __future__ import annotations

import bpy
from bpy.types import Context, Object, Panel, PropertyGroup, UILayout

from .. import point_data
from ..draw import histogram
from ..operators.untrusted import PATINA_OT_select_untrusted
from ..sync.analyses import trust
from . import rows
from .panels import PatinaPanel

HISTOGRAM = 6.0  # lines of the panel


def draw_slider(layout: UILayout, patina: PropertyGroup) -> None:
    rows.automatic(layout, patina, "least_trust", otherwise=_automatic(patina)).active = patina.analysis != 'OFF'


def _automatic(patina: PropertyGroup) -> str:
    return f"Automatic ({histogram.automatic_trust(patina.id_data.name):.2f})"


class PATINA_PT_trust(PatinaPanel, Panel):
    bl_label = "Trust"
    bl_context = "data"
    bl_parent_id = "PATINA_PT_points"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and point_data.may_have_points(context.object)

    def draw(self, context: Context) -> None:
        layout, obj = self.layout, context.object
        self._draw_threshold(layout, obj.patina)
        if obj.patina.analysis == 'OFF':
            rows.sentence(context, layout, "Trust is known of analyzed points: see Analysis", 'NONE')
            return
        self._draw_histogram(context, layout, obj)
        layout.operator(PATINA_OT_select_untrusted.bl_idname, icon='RESTRICT_SELECT_OFF')

    def _draw_threshold(self, layout: UILayout, patina: PropertyGroup) -> None:
        """As wide as the panel."""
        row = layout.row(align=True)
        row.active = patina.analysis != 'OFF'
        row.prop(patina, "use_least_trust", text="")
        if patina.use_least_trust:
            row.prop(patina, "least_trust", slider=True)
        else:
            row.label(text=_automatic(patina))

    def _draw_histogram(self, context: Context, layout: UILayout, obj: Object) -> None:
        known = histogram.trust_of(obj)
        if known is None:
            rows.sentence(context, layout, "A histogram is shown here once a view in Rendered shading, or a render, has drawn the analyzed "
                                           "points", 'NONE')
            return
        cloud, least = known.cloud(), trust.least_of(obj.patina)
        level, total = trust.level_from(cloud, least), int(known.counts.sum())
        layout.template_icon(histogram.trust_icon(obj, known, level), scale=HISTOGRAM)
        if trust.none_is_trusted(cloud, least):
            rows.sentence(context, layout, f"None of {total:,} points is trusted, so all of them are drawn", 'ERROR')
            return
        out = trust.left_out(cloud, least)
        said = f"{out:,} of {total:,} points ({out / total:.2%}) are left out. Their bars are red" if out else f"All {total:,} points are drawn"
        rows.sentence(context, layout, f"{said}. Trust is 0 at the left, 1 at the right", 'NONE')


register, unregister = bpy.utils.register_classes_factory((PATINA_PT_trust,))
