# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests in a window share: the 3D view in Rendered mode, what it shows, and its pixels."""

import os
import time

import bpy
import numpy as np
import screen
from harness import new_scene
from mathutils import Quaternion
from patina.draw import viewport
from patina.sync.analyses.analyzing import ANALYSES

KEEP = os.environ.get("PATINA_SCREENSHOTS")  # a folder that keeps them


def area():
    return next(area for area in bpy.context.window.screen.areas if area.type == 'VIEW_3D')


def window_region():
    return next(region for region in area().regions if region.type == 'WINDOW')


def override():
    window = bpy.context.window_manager.windows[0]
    return bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region())


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


def pause(seconds, rounds=5):
    """Waits so long, and so many rounds of Blender's own: on a slow machine one may take seconds."""
    until, left = time.perf_counter() + seconds, iter(range(rounds))
    return lambda: next(left, None) is None and time.perf_counter() > until


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
    """Alt B in Rendered shading; in Solid shading and then back where Blender allows it only there, as 5.2 does."""
    window, shading = bpy.context.window_manager.windows[0], area().spaces[0].shading
    with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
        if not bpy.ops.view3d.clip_border.poll():
            shading.type = 'SOLID'
        bpy.ops.view3d.clip_border(xmin=xmin, xmax=xmax, ymin=ymin, ymax=ymax)
    shading.type = 'RENDERED'
    area().tag_redraw()  # as the end of the gesture does


def toggle_local_view():
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
        bpy.ops.view3d.localview(frame_selected=False)


def screenshot(name):
    """The view's pixels on the screen, (height, width, 3) 0..1, row 0 at the bottom. Draws the window once more before."""
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
        bpy.ops.wm.redraw_timer(type='DRAW_WIN_SWAP', iterations=1)
    region = window_region()
    picture = screen.settled_pixels()[region.y:region.y + region.height, region.x:region.x + region.width]
    keep(name, picture)
    return picture.astype(np.float32) / np.float32(255)


def whole_window(name):
    """Writes the first window's pixels to the folder that PATINA_SCREENSHOTS names."""
    if KEEP:
        bpy.ops.wm.redraw_timer(type='DRAW_WIN_SWAP', iterations=1)
        keep(name, screen.settled_pixels())


def keep(name, picture):
    """Writes (height, width, 3) uint8 to the folder that PATINA_SCREENSHOTS names."""
    if KEEP:
        screen.write_png(os.path.join(KEEP, f"{name}.png"), picture)


def invoke_import(path, **options):
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
        return bpy.ops.import_scene.patina_points('INVOKE_DEFAULT', directory=str(path.parent), files=[{"name": path.name}],
                                                  **options)
