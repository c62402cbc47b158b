# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's own panels (camera, output, world, view layer, ...) appear for our engine too."""

from __future__ import annotations

import bpy

from ..draw.engine import PatinaRenderEngine

ENGINE = PatinaRenderEngine.bl_idname

# Panels for every simple engine that show what Patina does not do, or shows in its own panel.
EXCLUDED = {
    'VIEWLAYER_PT_filter', 'VIEWLAYER_PT_layer_passes', 'RENDER_PT_simplify', 'RENDER_PT_freestyle',
    'RENDER_PT_freestyle_options', 'DATA_PT_light', 'NODE_DATA_PT_light', 'RENDER_PT_gpencil',
}
# Panels of another engine that fit ours.
BORROWED = {'EEVEE_WORLD_PT_surface', 'EEVEE_MATERIAL_PT_context_material'}


def _panels() -> list[type]:
    return [panel for panel in bpy.types.Panel.__subclasses__()
            if 'BLENDER_RENDER' in getattr(panel, "COMPAT_ENGINES", ()) and panel.__name__ not in EXCLUDED
            or panel.__name__ in BORROWED and hasattr(panel, "COMPAT_ENGINES")]


def _catcher(self: bpy.types.Panel, context: bpy.types.Context) -> None:
    """Below Blender's own switch of holdouts."""
    if context.engine == ENGINE:
        self.layout.prop(context.object, "is_shadow_catcher")


def register() -> None:
    for panel in _panels():
        panel.COMPAT_ENGINES.add(ENGINE)
    bpy.types.OBJECT_PT_visibility.append(_catcher)


def unregister() -> None:
    bpy.types.OBJECT_PT_visibility.remove(_catcher)
    for panel in bpy.types.Panel.__subclasses__():
        if ENGINE in getattr(panel, "COMPAT_ENGINES", ()):
            panel.COMPAT_ENGINES.discard(ENGINE)
