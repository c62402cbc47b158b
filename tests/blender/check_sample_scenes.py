# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes of Help > Open Sample: they open as new files, to a rendered view, and render what they promise."""

import bpy
import numpy as np
from harness import check, saved
from patina import point_data
from patina.operators import samples

COLORS = {  # what a render shows: least and most share of the pixels, by red, green and blue from 0 to 1
    "Relief": ((lambda r, g, b: (r > 0.4) & (r > 1.15 * b), 0.15, 0.6), (lambda r, g, b: r + g + b < 0.45, 0.3, 0.8)),
    "Town": ((lambda r, g, b: r > 1.5 * g, 0.08, 0.5), (lambda r, g, b: (g > 1.15 * r) & (g > 1.3 * b), 0.05, 0.5),
             (lambda r, g, b: np.minimum(r, b) > 0.75, 0.1, 0.5)),
    "Soft Points": ((lambda r, g, b: r > 1.5 * g, 0.08, 0.4), (lambda r, g, b: g > 1.15 * np.maximum(r, b), 0.1, 0.6)),
}


class _Layout:
    """Records what a menu draws."""

    def __init__(self):
        self.items, self.operator_context = [], ""

    def operator(self, name, text, icon):
        self.items.append((name, text, type("Item", (), {})()))
        return self.items[-1][2]


def _items():
    """(operator, text, properties) of the menu."""
    layout = _Layout()
    samples.PATINA_MT_samples.draw(type("Menu", (), {"layout": layout})(), bpy.context)
    check(layout.operator_context == 'INVOKE_AREA', "Blender asks to save a changed file only if the operator is invoked")
    return layout.items


def _open(name):
    operator, _, item = next(found for found in _items() if found[1] == name)
    check(operator == "wm.read_homefile", operator)
    bpy.ops.wm.read_homefile(**vars(item))
    scene = bpy.context.scene
    check(bpy.data.filepath == "", "it opens as a new file: saving must not change the sample")
    check(scene.render.engine == 'PATINA' and scene.camera and any(map(point_data.is_cloud, scene.objects)), "engine, camera or points are missing")
    spaces = [area.spaces.active for screen in bpy.data.workspaces["Layout"].screens for area in screen.areas if area.type == 'VIEW_3D']
    check(spaces and all(space.shading.type == 'RENDERED' and space.region_3d.view_perspective == 'CAMERA' for space in spaces), "the view is not rendered")
    scene.render.resolution_percentage, scene.patina.samples = 25, 1
    picture = _picture()
    for number, (wanted, least, most) in enumerate(COLORS[name]):
        share = wanted(*np.moveaxis(picture, -1, 0)).mean()
        check(least < share < most, f"color {number} is on {share:.1%} of the pixels")
    return picture


def _picture():
    """F12, as Blender displays it: (height, width, 3)."""
    bpy.ops.render.render()
    return saved('PNG')[..., :3]


def test_relief_opens_and_renders():
    _open("Relief")


def test_town_opens_and_renders():
    _open("Town")


def test_soft_points_open_and_render():
    soft = _open("Soft Points")
    next(obj for obj in bpy.context.scene.objects if point_data.is_cloud(obj)).patina.soft.use = False
    check((np.abs(_picture() - soft).max(axis=2) > 0.1).mean() > 0.05, "the trees are not soft")


def test_the_menu_lists_files_that_exist():
    check([text for _, text, _ in _items()] == list(samples.NAMES), "not all are in the menu")
    check(all(samples.path_of(name).stat().st_size < 1_500_000 for name in samples.NAMES), "a sample is missing or large")
    check(any(draw is samples.draw_help for draw in bpy.types.TOPBAR_MT_help._dyn_ui_initialize()), "not in the menu Help")
