# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar of a 3D view: what its last picture took, and why passes were left out."""

from __future__ import annotations

import bpy
from bpy.types import Context, Panel

from .. import point_data, versions
from ..draw import pace, viewport
from ..draw.engine import PatinaRenderEngine
from ..operators import set_up, view_from_here
from ..sync.analyses.analyzing import ANALYSES
from . import rows


def expected_text(expected: dict[str, float]) -> str:
    """What is expected on even, smooth surfaces, and how much it may be on others."""
    most = min(expected["color"] * expected["doubt"], 1.0)
    return f"{expected['color']:.2%} of white, up to {most:.0%}" if expected["color"] <= 1.0 else "not known: points lie too far apart"


class SidebarPanel:
    """In the sidebar's tab Patina. Shown while Patina is the engine, unless a panel has a poll of its own."""

    bl_space_type = 'VIEW_3D'
    bl_region_type = 'UI'
    bl_category = "Patina"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.engine == PatinaRenderEngine.bl_idname


class PATINA_PT_sidebar_set_up(SidebarPanel, Panel):
    bl_label = "Set Up"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.engine != PatinaRenderEngine.bl_idname and any(map(point_data.is_cloud, context.view_layer.objects))

    def draw(self, context: Context) -> None:
        self.layout.operator(set_up.PATINA_OT_set_up.bl_idname, icon='RESTRICT_RENDER_OFF')
        rows.sentence(context, self.layout, "Renders points with Patina, from a camera that sees them", 'NONE')


class PATINA_PT_sidebar_camera(SidebarPanel, Panel):
    bl_label = "Camera"
    bl_order = 2

    def draw(self, context: Context) -> None:
        column = self.layout.column(align=True)
        column.operator("object.patina_frame_points")
        column.operator(view_from_here.PATINA_OT_view_from_here.bl_idname)
        row = column.row(align=True)
        row.operator_context = 'INVOKE_REGION_WIN'  # the view, not the sidebar
        row.operator(view_from_here.PATINA_OT_walk.bl_idname)
        self.layout.prop(context.scene.patina.studio, "use_headlight")


class PATINA_PT_statistics(SidebarPanel, Panel):
    bl_label = "Statistics"
    bl_order = 3

    def draw(self, context: Context) -> None:
        layout = self.layout
        if untested := versions.notice():
            rows.sentence(context, layout, untested, 'INFO')
        found = viewport.of_area(context.area)
        if found and found.message:
            rows.sentence(context, layout, found.message, 'ERROR')
        if not found or not found.shown:
            rows.sentence(context, layout, "Switch to Rendered shading to see figures", 'NONE')
            return
        shown = found.shown
        stats, level = shown.stats, shown.wish.level
        figures = [("Points", f"{stats['points']:,}"), ("In View", f"{stats['points_scattered']:,}"),
                   ("Left Out for Trust", f"{stats['untrusted']:,}"),
                   ("Triangles", f"{stats['triangles']:,}"),
                   ("Chunks", f"{stats['chunks'] - stats['chunks_culled']:,} of {stats['chunks']:,}"),
                   ("Spacing", f"{stats['spacing_px']:.2f} pixels"),
                   ("Expected Error", expected_text(stats["expected"])),
                   ("Picture", f"{stats['width']} x {stats['height']}"), ("Time", f"{stats['ms']:.1f} ms"),
                   ("Planes", f"{stats['plane_bytes'] / 1e6:,.0f} MB"),
                   ("Clouds", f"{sum(item.cloud.bytes for item in shown.clouds) / 1e6:,.0f} MB"), ("Device", shown.device)]
        shares = [share for item in shown.clouds if (share := ANALYSES.progress(item.cloud)) is not None]
        if shares:
            figures.append(("Analysis", f"{shares[0]:.0%}"))
        elif shown.clouds and not any(item.analyzed for item in shown.clouds):
            figures.append(("Analysis", "None is needed"))
        if level != pace.FULL:
            figures.append(("Moving", f"{2.0 ** (level.strata - pace.STRATA):.0%} of points, 1/{level.shrink} size"))
        if stats["shadow_samples"]:
            expected = f", expected error {stats['shadow_error']:.2%}" if stats["shadow_error"] else ""
            figures.append(("Shadows", f"{stats['shadow_samples']} samples{expected}"))
        rows.table(context, layout, figures)
        for notice in found.notices:
            rows.sentence(context, layout, notice, 'INFO')


class PATINA_PT_statistics_passes(SidebarPanel, Panel):
    bl_label = "Passes"
    bl_parent_id = "PATINA_PT_statistics"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context: Context) -> None:
        found = viewport.of_area(context.area)
        if not found or not found.shown:
            return
        found.measures = True  # from the next image on
        passes = found.shown.passes
        rows.table(context, self.layout, [(name, f"{ms:.2f} ms") for name, ms in passes["passes"].items()])
        for name, reason in passes["skipped"].items():
            rows.sentence(context, self.layout, f"no {name}: {reason}", 'NONE')


_CLASSES = (PATINA_PT_sidebar_set_up, PATINA_PT_sidebar_camera, PATINA_PT_statistics, PATINA_PT_statistics_passes)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
