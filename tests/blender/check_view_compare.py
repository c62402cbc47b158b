# SPDX-License-Identifier: GPL-3.0-or-later
"""Distance to Cloud and Height Above Ground as an artist calls them: the dialog with its suggestions, the work beside Blender, Esc, undo. See
test_window.py for what a yield means."""

import bpy
import numpy as np
from check_drop import press
from harness import Skip, add_points, check
from patina.operators import compare
from window import override, pause, settled, setup

SIDE = 100


def square(height, side=SIDE):
    x, y = (axis.ravel() / side for axis in np.mgrid[:side, :side])
    return np.stack([x, y, np.full(x.shape, height)], 1)


def scene_of_two(side=SIDE):
    if not bpy.app.use_event_simulate:
        raise Skip("no simulated events")
    setup()
    add_points(square(0.02, side), name="after")
    obj = add_points(square(0.0, side), name="before")
    bpy.context.view_layer.objects.active = obj
    return obj


def attributes():
    return bpy.data.objects["before"].data.attributes


def test_measured_in_the_view():
    """Enter takes the suggestions; one step of undo takes the result back."""
    scene_of_two()
    yield lambda: settled(2 * SIDE * SIDE)
    for name, written in (("patina_cloud_distance", "m3c2_distance"), ("patina_height_above_ground", "height_above_ground")):
        with override():
            bpy.ops.ed.undo_push(message="before")
            getattr(bpy.ops.object, name)('INVOKE_DEFAULT', True)
        yield pause(0.5)
        check(written not in attributes(), "a dialog comes first")
        yield from press('RET')
        yield lambda written=written: written in attributes()
        found = np.empty(SIDE * SIDE, np.float32)
        attributes()[written].data.foreach_get("value", found)
        check(np.abs(found - (0.02 if "m3c2" in written else 0.0)).max() < 1e-4, f"{written}: {found.min()} to {found.max()}")
        colors = bpy.data.objects["before"].patina.colors
        check(colors.scalar == written and colors.use_legend, f"colored by {colors.scalar}")
        yield lambda: settled(2 * SIDE * SIDE)
        with override():
            bpy.ops.ed.undo()
        check(written not in attributes() and bpy.data.objects["before"].patina.colors.source == 'OWN', f"{written}: undone")
        yield lambda: settled(2 * SIDE * SIDE)


def test_measuring_is_canceled():
    """Esc ends work of many seconds within a moment, and nothing is written."""
    side, ended, original = 300, [], compare._Measuring._measure

    def noted(self, context, obj):
        ended.append((yield from original(self, context, obj)))
        return ended[-1]

    scene_of_two(side)
    yield lambda: settled(2 * side * side)
    compare._Measuring._measure = noted
    with override():
        bpy.ops.object.patina_cloud_distance('INVOKE_DEFAULT', True, other="after", normal_scale=3.0)
    yield pause(0.5)
    yield from press('RET')
    check(not ended, "it takes many seconds")
    yield from press('ESC')
    yield pause(0.5)
    compare._Measuring._measure = original
    check(ended == [{'CANCELLED'}], f"ended: {ended}")
    check("m3c2_distance" not in attributes() and bpy.data.objects["before"].patina.colors.source == 'OWN', "written all the same")
