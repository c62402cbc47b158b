# SPDX-License-Identifier: GPL-3.0-or-later
"""Survey drawings in a window: three clicks, a click on a wall, the frame over the view, looking through. See test_window.py for what a yield means."""

import bpy
import numpy as np
from check_view_measure import COUNT, TOOLS, begin, events, pixel_of
from harness import Skip, check, check_close
from patina.sync import drawings
from window import area, override, pause, screenshot, settled, view


def start(by, **options):
    if not bpy.app.use_event_simulate:
        raise Skip("needs --enable-event-simulate")
    with override():
        check(bpy.ops.object.patina_pick_drawing('INVOKE_DEFAULT', by=by, **options) == {'RUNNING_MODAL'}, "it does not run")


def blue(picture):
    """Pixels in the color of frames: (row, column) each."""
    picture = np.where((np.arange(picture.shape[1]) > TOOLS)[:, None], picture, 0.0)
    return np.argwhere((picture[..., 0] < 0.45) & (picture[..., 1] > 0.6) & (picture[..., 1] < 0.85) & (picture[..., 2] > 0.9))


def found():
    return drawings.of_scene(bpy.context.view_layer)


def test_drawings_by_clicks():
    """Three clicks beside points give a drawing through them, with a frame where its corners are; undo takes it away. A wall takes one click. The
    view looks through it, and comes back."""
    scene, wall = begin()
    yield lambda: settled(COUNT)
    check(not len(blue(screenshot("drawings_none"))), "nothing is drawn yet")
    left, right, above = (pixel_of(place) for place in ((-1.0, -0.5, 0.0), (1.0, -0.5, 0.0), (0.0, 1.0, 0.0)))
    start('POINTS')
    yield from events(*((kind, (place[0] + 3, place[1] - 2), False) for place in (left, right, above) for kind in ('MOUSEMOVE', 'LEFTMOUSE')))
    yield lambda: len(found()) == 1
    frame = drawings.frame_of(found()[0], scene)
    check_close(frame.normal, (0.0, 0.0, 1.0), 1e-6, "to the viewer")
    check_close(frame.origin, (0.0, 0.0, 0.0), 1e-6, "the middle of the wall")
    check_close((frame.width, frame.height), (4.16, 4.16), 1e-5, "its size, with 2 % of air")
    check(found()[0].patina.drawing.kind == 'PLAN', "a level one is a plan")
    yield pause(0.3)
    pixels = blue(screenshot("drawings_frame"))
    check(len(pixels) > 300, f"{len(pixels)} pixels of the frame")
    low, high = (np.array(pixel_of((sign * 2.08, sign * 2.08, 0.0))) for sign in (-1.0, 1.0))
    sides = np.minimum(np.abs(pixels[:, ::-1] + 0.5 - low), np.abs(pixels[:, ::-1] + 0.5 - high)).min(axis=1)
    check(np.percentile(sides, 90) < 3.0, f"the frame is {np.percentile(sides, 90):.1f} pixels off")
    with override():
        bpy.ops.ed.undo()
    yield lambda: not found()
    start('WALL', vertical=False)
    yield from events(('MOUSEMOVE', left, False), ('LEFTMOUSE', left, False))
    yield lambda: len(found()) == 1
    check_close(drawings.frame_of(found()[0], bpy.context.scene).normal, (0.0, 0.0, 1.0), 1e-4, "of the wall")
    start('LINE')
    yield from events(('MOUSEMOVE', left, False), ('LEFTMOUSE', left, False), ('ESC', left, False))
    check(len(found()) == 1, "Esc keeps something")
    name, before = found()[0].name, (view().view_perspective, view().view_location.copy(), view().view_distance, view().use_clip_planes)
    with override():
        bpy.ops.view3d.patina_look_through_drawing(drawing=name)
    check(view().view_perspective == 'ORTHO' and view().use_clip_planes, "it does not look through")
    yield lambda: settled(COUNT)
    found()[0].hide_set(True)
    yield pause(0.3)
    picture = screenshot("drawings_through")
    inside = (picture[..., 2] > picture[..., 0] + 0.2).sum(axis=1)
    check(inside.max() > 0.6 * picture.shape[0], f"the wall is {inside.max()} pixels wide of {picture.shape[0]}")
    with override():
        bpy.ops.view3d.patina_look_through_drawing(drawing=name)
    check((view().view_perspective, view().view_location, view().view_distance, view().use_clip_planes) == before, "the view is another one")
    area().spaces[0].show_region_ui = False
