# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist does with scans, over and over, in a real window. Run by long_session.py."""

import os
import time

import bpy
import numpy as np
from check_linked import dense
from check_sequence import scans
from harness import SCRATCH, check, render
from mathutils import Matrix, Quaternion
from patina.draw import viewport
from window import area, settled, setup, view, window_region

POINTS = 100000
SCAN = 4  # points of each of the linked ones


def operate(operator, **options):
    """Calls an operator as the 3D view would, and keeps an undo step."""
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, area=area(), region=window_region()):
        result = operator(**options)
        bpy.ops.ed.undo_push(message="session")
    return result


def undo(operator):
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, area=area(), region=window_region()):
        operator()


def long_session():
    """Import, orbit, paint, undo, redo, duplicate, link, animate, render, reload, for PATINA_SESSION_MINUTES. A line with
    the process's number first, so that its memory can be looked at from outside."""
    print(f"session: process {os.getpid()}", flush=True)
    path, sequence = dense("session.ply", POINTS, (0, 0, 0)), scans("session", range(1, 5))
    saved = str(SCRATCH / "session.blend")
    end = time.monotonic() + 60.0 * float(os.environ.get("PATINA_SESSION_MINUTES", "1"))
    number = 0
    while number < 2 or time.monotonic() < end:
        yield from one_round(number, path, sequence, saved)
        failed = [found.message for found in viewport._VIEWPORTS if found.message]
        check(not failed, f"round {number}: {failed}")
        number += 1
        print(f"session: round {number}", flush=True)


def one_round(number, path, sequence, saved):
    scene = setup()
    scene.render.resolution_x, scene.render.resolution_y = 160, 120
    scene.camera.matrix_world = Matrix.Translation((0, 0, 6))
    operate(bpy.ops.import_scene.patina_points, filepath=str(path))
    yield lambda: settled(POINTS)
    for step in range(8):
        view().view_rotation = Quaternion((0, 1, 0), 0.2 * step)
        yield lambda: settled(POINTS)
    name = bpy.context.view_layer.objects.active.name
    color = np.tile(np.float32([1, number % 2, 0, 1]), POINTS)
    bpy.data.objects[name].data.attributes["Col"].data.foreach_set("color_srgb", color)
    bpy.data.objects[name].data.update()
    operate(bpy.ops.object.shade_flat)
    operate(bpy.ops.object.duplicate)
    yield lambda: settled(2 * POINTS)
    undo(bpy.ops.ed.undo)
    yield lambda: settled(POINTS)
    undo(bpy.ops.ed.redo)
    yield lambda: settled(2 * POINTS)
    operate(bpy.ops.import_scene.patina_points, filepath=str(sequence), link=True, sequence=True)
    moved = bpy.data.objects[name]
    for frame in (1, 4):
        moved.location.x = 0.2 * frame
        moved.keyframe_insert("location", frame=frame)
    for frame in range(1, 5):
        bpy.context.scene.frame_set(frame)
        yield lambda: settled(2 * POINTS + SCAN)
    check(render()["Combined"][..., 3].any(), "an empty render")
    undo(lambda: bpy.ops.wm.save_as_mainfile(filepath=saved, check_existing=False))
    undo(lambda: bpy.ops.wm.open_mainfile(filepath=saved, load_ui=False))
    yield lambda: settled(2 * POINTS + SCAN)
    check(abs(bpy.data.objects[name].matrix_world.translation.x - 0.8) < 1e-6, "the file came back otherwise")
    for kind in (bpy.data.actions, bpy.data.images):
        for item in list(kind):
            if item.name != "Render Result":
                kind.remove(item)
