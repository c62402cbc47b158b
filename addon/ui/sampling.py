# SPDX-License-Identifier: GPL-3.0-or-later
"""How many samples a pixel has, in final pictures and in viewports at rest."""

from __future__ import annotations

import bpy
from bpy.types import Context, Panel

from . import rows
from .panels import PatinaPanel


class PATINA_PT_sampling(PatinaPanel, Panel):
    bl_label = "Sampling"
    bl_context = "render"

    def draw(self, context: Context) -> None:
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        patina = context.scene.patina
        for title, noise, samples in (("Viewport", "viewport_noise", "viewport_samples"), ("Render", "noise", "samples")):
            column = self.layout.column(align=True)
            column.label(text=title)
            rows.automatic(column, patina, noise, "Noise Threshold", "All Samples")
            column.prop(patina, samples, text="Most Samples" if getattr(patina, noise) else "Samples")


register, unregister = bpy.utils.register_classes_factory((PATINA_PT_sampling,))
