# SPDX-License-Identifier: GPL-3.0-or-later
"""Patina's own panels: they show properties and decide nothing."""

from __future__ import annotations

import bpy
from bpy.types import Context, Panel, Scene

from .. import point_data
from ..draw.engine import PatinaRenderEngine
from ..operators import view_transform
from ..sync.analyses import estimates
from . import rows
from .presets import PATINA_PT_presets


def _length(scene: Scene, meters: float) -> str:
    """A length in the scene's units."""
    units = scene.unit_settings
    if units.system == 'NONE':
        return f"{meters:.4g}"
    return bpy.utils.units.to_string(units.system, 'LENGTH', meters * units.scale_length, precision=4)


class PatinaPanel:
    bl_space_type = 'PROPERTIES'
    bl_region_type = 'WINDOW'
    COMPAT_ENGINES = {PatinaRenderEngine.bl_idname}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES


def shows_points(context: Context) -> bool:
    """Whether the active object is points, or may be: modifiers make points of faces."""
    obj = context.object
    return point_data.may_have_points(obj) and (point_data.is_cloud(obj) or bool(obj.modifiers) or context.scene.patina.meshes == 'POINTS')


class _PatinaObjectPanel(PatinaPanel):
    bl_context = "data"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and point_data.may_have_points(context.object)


class PATINA_PT_surface(PatinaPanel, Panel):
    bl_label = "Surface"
    bl_context = "render"

    def draw_header_preset(self, _context: Context) -> None:
        PATINA_PT_presets.draw_panel_header(self.layout)

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        patina = context.scene.patina
        layout.prop(patina, "surface")
        filled = patina.surface not in {'SPLATS', 'RANGES'}
        row = rows.automatic(layout, patina, "error_target", otherwise="As Set Below")
        row.active = filled
        column = layout.column()
        column.active = filled and not patina.error_target
        column.prop(patina, "quality")
        column.prop(patina, "fill")
        rows.automatic(column, patina, "fill_iterations").active = patina.fill != 'OFF'
        layout.prop(patina, "smooth")
        layout.prop(patina, "antialias")
        row = layout.row()
        row.active = filled
        row.prop(patina, "average")
        layout.prop(patina, "depth")
        layout.prop(patina, "meshes")
        if patina.meshes == 'POINTS':
            layout.prop(patina, "mesh_points")


class PATINA_PT_transparency(PatinaPanel, Panel):
    bl_label = "Transparency"
    bl_context = "render"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context: Context) -> None:
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        self.layout.prop(context.scene.patina, "layers")
        self.layout.prop(context.scene.patina, "soft_model", text="Soft Points")


class PATINA_PT_shadows(PatinaPanel, Panel):
    bl_label = "Shadows"
    bl_context = "render"

    def draw_header(self, context: Context) -> None:
        self.layout.prop(context.scene.patina, "use_shadows", text="")

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        patina = context.scene.patina
        layout.active = patina.use_shadows
        rows.automatic(layout, patina, "shadow_error", otherwise="As Set Below")
        row = layout.row()
        row.active = not patina.shadow_error
        row.prop(patina, "shadow_samples")
        layout.prop(patina, "shadow_resolution")
        layout.prop(patina, "shadow_uncut")
        layout.prop(patina, "shadow_file")
        row = layout.row(align=True)
        row.operator("patina.bake_shadows")
        row.operator("patina.load_shadows")


class PATINA_PT_film(PatinaPanel, Panel):
    bl_label = "Film"
    bl_context = "render"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context: Context) -> None:
        self.layout.use_property_split = True
        self.layout.prop(context.scene.render, "film_transparent", text="Transparent")
        studio = context.scene.patina.studio
        row = self.layout.row(heading="Background", align=True)
        row.active = not context.scene.render.film_transparent
        row.prop(studio, "use_background", text="")
        inner = row.row(align=True)
        inner.active = studio.use_background
        inner.prop(studio, "background", text="")
        if view_transform.changes_colors(context.scene):
            column = self.layout.column()
            rows.sentence(context, column, f"{context.scene.view_settings.view_transform} changes the colors of scans", 'INFO')
            column.operator(view_transform.PATINA_OT_true_colors.bl_idname)


class PATINA_PT_performance(PatinaPanel, Panel):
    bl_label = "Performance"
    bl_context = "render"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        patina = context.scene.patina
        layout.prop(patina, "device")
        rows.automatic(layout, patina, "threads")
        rows.automatic(layout, patina, "tile_size")
        layout.prop(patina, "navigation_ms", text="Viewport (ms)")


class PATINA_PT_passes(PatinaPanel, Panel):
    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layer = context.view_layer
        column = layout.column(heading="Include")
        column.prop(layer, "use_pass_z", text="Depth")
        column.prop(layer, "use_pass_mist")
        column.prop(layer, "use_pass_position")
        column.prop(layer, "use_pass_normal")
        column.prop(layer.patina, "use_pass_shadow")
        column.prop(layer, "use_pass_object_index")
        column.prop(layer.patina, "use_pass_source")
        column.prop(layer.patina, "use_pass_line")
        column.prop(layer.patina, "use_pass_trust")
        column.prop(layer.patina, "use_pass_thickness")
        column.prop(layer.patina, "use_pass_density")
        column.prop(layer.patina, "use_pass_disagreement")
        column.prop(layer.patina, "use_pass_overlay")
        layout.prop(layer.patina, "pass_layers")


class PATINA_PT_points(_PatinaObjectPanel, Panel):
    """The first panel of the tab, before those of Blender: Blender sorts panels without a header first. Its `bl_order` cannot be negative."""

    bl_label = "Points"
    bl_options = {'HIDE_HEADER'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and shows_points(context)

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.label(text=self.bl_label, icon='POINTCLOUD_DATA')
        layout.use_property_split = True
        patina = context.object.patina
        layout.prop(patina, "opacity")
        layout.prop(patina, "lighting")
        rows.automatic(layout, patina, "radius").active = context.scene.patina.surface in {'AUTO', 'SPLATS'} and not patina.ranges.use
        layout.prop(patina, "cull_back")
        column = layout.column()
        if patina.linked_file:
            held = patina.linked_data  # whose path is what holds
            column.prop(held or patina, "filepath" if held else "linked_file", text="Address" if patina.address else "Linked File")
            if patina.address:
                column.operator("object.patina_open_address")
            else:
                column.prop(patina, "stream")
            column.operator("object.patina_linked_to_mesh")
            column.operator("object.patina_level")
        else:
            if context.object.type == 'POINTCLOUD':
                column.operator("object.patina_to_mesh")
            elif point_data.HAS_CLOUDS:
                column.operator("object.patina_to_point_cloud")
            column.operator("object.patina_mesh_to_linked", text="Convert to Linked Cloud...")
            column.operator("object.patina_level")


class PATINA_PT_analysis(_PatinaObjectPanel, Panel):
    bl_label = "Analysis"
    bl_parent_id = "PATINA_PT_points"
    bl_options = {'DEFAULT_CLOSED'}
    bl_order = 1

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        patina = context.object.patina
        layout.prop(patina, "analysis")
        if not patina.linked_file:
            row = layout.row()
            row.active = patina.analysis != 'OFF'
            row.prop(patina, "analysis_grid")
            layout.operator("object.patina_analyze", text="Analyze to Attributes").by_grid = patina.analysis_grid
        known = estimates.layer_distance(context.object.name_full)
        rows.automatic(layout, patina, "d_min",
                       otherwise="Automatic" if known is None else f"Automatic ({_length(context.scene, known)})")
        rows.automatic(layout, patina, "largest_gap").active = context.scene.patina.surface in {'AUTO', 'SPLATS'} and not patina.ranges.use


class PATINA_PT_attributes(_PatinaObjectPanel, Panel):
    """Which of the points' attributes say what; the color's is in its own panel."""

    bl_label = "Attributes"
    bl_parent_id = "PATINA_PT_points"
    bl_options = {'DEFAULT_CLOSED'}
    bl_order = 1

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and not context.object.patina.linked_file

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        patina, data = context.object.patina, context.object.data
        layout.prop_search(patina, "normal_attribute", data, "attributes", text="Normal")
        layout.prop(patina, "opacity_attribute", text="Opacity")  # vertex groups too
        layout.prop(patina, "radius_attribute", text="Disc Radius")


class PATINA_PT_hidden(_PatinaObjectPanel, Panel):
    bl_label = "Hidden Points"
    bl_parent_id = "PATINA_PT_points"
    bl_options = {'DEFAULT_CLOSED'}
    bl_order = 1

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        patina = context.object.patina
        column = layout.column(heading="Hide")
        column.prop(patina, "hide_uncolored")
        column.prop(patina, "hide_unclassified")
        column = layout.column()
        column.active = patina.analysis != 'OFF'
        column.prop(patina, "free_space")


class PATINA_PT_shading(_PatinaObjectPanel, Panel):
    bl_label = "Shading"
    bl_parent_id = "PATINA_PT_points"
    bl_options = {'DEFAULT_CLOSED'}
    bl_order = 1

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        patina = context.object.patina
        layout.active = patina.lighting != 'UNLIT'
        layout.prop(patina, "ambient")
        layout.prop(patina, "diffuse")
        layout.prop(patina, "specular")
        row = layout.row()
        row.active = patina.specular > 0.0
        row.prop(patina, "shininess")


class PATINA_PT_point_shadows(_PatinaObjectPanel, Panel):
    bl_label = "Shadows"
    bl_parent_id = "PATINA_PT_points"
    bl_options = {'DEFAULT_CLOSED'}
    bl_order = 1

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        patina = context.object.patina
        layout.active = context.scene.patina.use_shadows
        layout.prop(patina, "cast_shadows")
        layout.prop(patina, "receive_shadows")
        row = layout.row()
        row.active = patina.cast_shadows and patina.receive_shadows
        row.prop(patina, "self_shadows")


class PATINA_PT_light(PatinaPanel, Panel):
    bl_label = "Light"
    bl_context = "data"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and context.light is not None

    def draw(self, context: Context) -> None:
        layout = self.layout
        light = context.light
        layout.row().prop(light, "type", expand=True)
        layout.use_property_split = True
        layout.prop(light, "color")
        layout.prop(light, "energy", text="Strength" if light.type == 'SUN' else "Power")
        if light.type == 'SUN':
            layout.prop(light, "angle")
        elif light.type == 'AREA':
            layout.prop(light, "shape")
            layout.prop(light, "size")
            if light.shape in {'RECTANGLE', 'ELLIPSE'}:
                layout.prop(light, "size_y", text="Y")
        else:
            layout.prop(light, "shadow_soft_size", text="Radius")
        if light.type == 'SPOT':
            layout.prop(light, "spot_size")
            layout.prop(light, "spot_blend")
        layout.prop(light, "use_shadow", text="Cast Shadow")


_CLASSES = (PATINA_PT_surface, PATINA_PT_transparency, PATINA_PT_shadows, PATINA_PT_film, PATINA_PT_performance,
            PATINA_PT_passes, PATINA_PT_points, PATINA_PT_analysis, PATINA_PT_attributes, PATINA_PT_hidden, PATINA_PT_shading,
            PATINA_PT_point_shadows, PATINA_PT_light)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
