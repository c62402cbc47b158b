# SPDX-License-Identifier: GPL-3.0-or-later
"""Help > Open Sample: small scenes that build/samples made."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.app.handlers import persistent
from bpy.types import Context, Menu

FOLDER = Path(__file__).resolve().parents[1] / "samples"
NAMES = ("Relief", "Town", "Soft Points")
MARK = "patina_sample"  # custom property of a sample's scene


def path_of(name: str) -> Path:
    """The file of one of NAMES."""
    return FOLDER / f"{name.lower().replace(' ', '-')}.blend"


class PATINA_MT_samples(Menu):
    """Open a small scene of points. Blender treats it as a new file, so that saving asks for a name"""

    bl_label = "Open Sample"

    def draw(self, _context: Context) -> None:
        # As File > New: Blender first offers to save changes. Opening would save over the sample itself.
        self.layout.operator_context = 'INVOKE_AREA'
        for name in NAMES:
            item = self.layout.operator("wm.read_homefile", text=name, icon='POINTCLOUD_DATA')
            item.filepath = str(path_of(name))
            item.load_ui, item.use_splash = True, False


@persistent
def _loaded(*_) -> None:
    """Shows a new file that came from a sample in Rendered shading. Blender opens each file in Solid shading at most."""
    if bpy.data.filepath or not any(MARK in scene for scene in bpy.data.scenes):
        return
    for area in (area for screen in bpy.data.screens for area in screen.areas if area.type == 'VIEW_3D'):
        area.spaces.active.shading.type = 'RENDERED'


def draw_help(menu: Menu, _context: Context) -> None:
    menu.layout.menu("PATINA_MT_samples", icon='POINTCLOUD_DATA')


_register_classes, _unregister_classes = bpy.utils.register_classes_factory((PATINA_MT_samples,))


def register() -> None:
    _register_classes()
    bpy.types.TOPBAR_MT_help.append(draw_help)
    bpy.app.handlers.load_post.append(_loaded)


def unregister() -> None:
    bpy.app.handlers.load_post.remove(_loaded)
    bpy.types.TOPBAR_MT_help.remove(draw_help)
    _unregister_classes()
