# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests in a window share: the 3D view in Rendered mode, what it shows, and its pixels."""

import os

import bpy
import numpy as np
from harness import SCRATCH, new_scene
from mathutils import Quaternion
from patina import viewport
from patina.sync.analyzing import ANALYSES

KEEP = os.environ.get("PATINA_SCREENSHOTS")  # a folder that keeps them


def area():
    return next(area for area in bpy.context.window.screen.areas if area.type == 'VIEW_3D')


def window_region():
    return next(region for region in area().regions if region.type == 'WINDOW')


def view():
    return area().spaces[0].region_3d


def shown():
    """The viewport's engine, when its whole picture is there."""
    found = viewport.of_area(area())
    if found and found.shown and found.shown.wish.whole() and found._last is found.shown.wish:
        return found
    return None


def settled(points):
    """Whether the whole picture of what the view shows now is there, with so many points in the scene."""
    found = shown()
    return found is not None and not ANALYSES.busy() and found.shown.stats["points"] == points and \
        found.shown.wish.view == viewport.sync.viewport_view(window_region(), area().spaces[0], view(), bpy.context.scene)


def newer(than):
    """Waits for a whole picture after so many."""
    return lambda: (found := shown()) is not None and found.pictures > than


def setup(overlays=False):
    """A scene in Rendered mode, seen from the front, 6 away."""
    scene = new_scene()
    scene.view_settings.view_transform = 'Standard'
    space = area().spaces[0]
    space.overlay.show_overlays = overlays
    space.show_gizmo = False
    space.shading.type = 'SOLID'
    rv3d = space.region_3d
    rv3d.view_perspective = 'PERSP'
    rv3d.view_location, rv3d.view_distance = (0, 0, 0), 6.0
    rv3d.view_rotation = Quaternion()
    space.shading.type = 'RENDERED'
    return scene


def clip_border(xmin, xmax, ymin, ymax):
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
        bpy.ops.view3d.clip_border(xmin=xmin, xmax=xmax, ymin=ymin, ymax=ymax)
    area().tag_redraw()  # as the end of the gesture does


def toggle_local_view():
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
        bpy.ops.view3d.localview(frame_selected=False)


def screenshot(name):
    """The view's pixels as shown, (height, width, 4) 0..1, row 0 at the bottom."""
    path = os.path.join(KEEP or str(SCRATCH), f"{name}.png")
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
        bpy.ops.wm.redraw_timer(type='DRAW_WIN_SWAP', iterations=1)
        bpy.ops.screen.screenshot(filepath=path)
    image = bpy.data.images.load(path)
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    region = window_region()
    return pixels.reshape(height, width, 4)[region.y:region.y + region.height, region.x:region.x + region.width]


def invoke_import(path, **options):
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
        return bpy.ops.import_scene.patina_points('INVOKE_DEFAULT', directory=str(path.parent), files=[{"name": path.name}],
                                                  **options)
