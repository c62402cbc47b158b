# SPDX-License-Identifier: GPL-3.0-or-later
"""Legend, scale bar, north arrow and title in a window."""

import bpy
import numpy as np
from harness import add_points, check
from patina.sync.view.camera import camera_frame
from window import area, newer, screenshot, settled, setup, shown, view, window_region


def _changed(before, after):
    """Shares of pixels that differ: lower left, lower right, upper left, upper right."""
    differ = np.abs(np.asarray(after, np.float32) - before)[..., :3].max(axis=2) > 0.05 * max(float(np.max(before)), 1.0)
    height, width = differ.shape
    return [float(part.mean()) for half in (differ[:height // 2], differ[height // 2:]) for part in (half[:, :width // 2], half[:, width // 2:])]


def test_marks_over_the_view():
    """They are drawn at the edges of the view, with its overlays, and go with them."""
    scene = setup(overlays=True)
    points = np.random.default_rng(1).uniform(-1, 1, (2000, 3)).astype(np.float32)
    obj = add_points(points)
    bpy.context.view_layer.objects.active = obj
    obj.patina.lighting = 'UNLIT'
    bpy.ops.object.patina_color_by(choice="Local Height")
    yield lambda: settled(2000)
    plain = screenshot("marks-none")
    before = shown().pictures
    marks = scene.patina.marks
    marks.use_bar = marks.use_north = marks.use_title = obj.patina.colors.use_legend = True
    marks.bar_distance, marks.title = 10.0, "Test"
    yield lambda: newer(before)() and settled(2000)
    drawn = screenshot("marks-all")
    shares = _changed(plain, drawn)
    shares.pop(2)
    check(all(share > 0.003 for share in shares), f"changed in three corners: {shares}")
    area().spaces.active.overlay.show_overlays = False
    area().tag_redraw()
    yield lambda: shown().canvas._marks is None


def test_marks_within_the_camera_frame():
    """Through a camera they are where a render has them: at the corners of its frame, and nowhere outside."""
    scene = setup(overlays=True)
    obj = add_points(np.random.default_rng(2).uniform(-1, 1, (2000, 3)).astype(np.float32) - (0, 0, 8))
    bpy.context.view_layer.objects.active = obj
    obj.patina.lighting = 'UNLIT'
    bpy.ops.object.patina_color_by(choice="Local Height")
    scene.render.resolution_x = scene.render.resolution_y = 500
    view().view_perspective, view().view_camera_zoom = 'CAMERA', 0.0
    overlay = area().spaces.active.overlay
    overlay.show_extras = overlay.show_text = False
    yield lambda: settled(2000)
    plain, before = screenshot("frame-none"), shown().pictures
    marks = scene.patina.marks
    marks.use_bar = marks.use_title = obj.patina.colors.use_legend = True
    marks.bar_distance, marks.title = 8.0, "Test"
    yield lambda: newer(before)() and settled(2000)
    x0, y0, x1, y1 = map(round, camera_frame(window_region(), view(), scene.camera, scene))
    check(x0 > 100 and window_region().width - x1 > 100, f"a frame from {x0} to {x1} of {window_region().width}")
    differ = np.abs(screenshot("frame-all") - plain).max(axis=2) > 0.05
    inside = differ[y0:y1, x0:x1]
    check(differ.sum() == inside.sum(), f"{differ.sum() - inside.sum()} pixels outside of the frame")
    shares = _changed(plain[y0:y1, x0:x1], np.where(inside[..., None], 1.0, plain[y0:y1, x0:x1]))
    shares.pop(2)
    check(all(share > 0.003 for share in shares), f"changed in three corners of the frame: {shares}")
    view().view_perspective = 'PERSP'
    overlay.show_extras = overlay.show_text = True
