# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's own tools on points that Blender holds, in Rendered shading: Edit Mode, box and lasso, deletion, undo. On PointCloud objects from
Blender 4.5 on, on meshes of points in all. See test_window.py for what a yield means."""

import bpy
import numpy as np
from harness import check, sphere
from patina import point_data
from patina.read.importers import PointFile
from patina.sync.points import made
from window import area, override, screenshot, settled, setup, window_region

COUNT = 20_000
KINDS = (False, True) if point_data.HAS_CLOUDS else (False,)


def given(cloud):
    scene = setup(overlays=True)
    area().spaces[0].show_region_ui = False
    scene.patina.fill = 'CLOSED'
    scene.render.film_transparent = False
    positions, _, normals = sphere(2 * COUNT, 1.5, (0, 0, 0))  # the half that is seen: Blender's tools select no others
    positions, normals = (values[COUNT:] if positions[-1, 2] > 0 else values[:COUNT] for values in (positions, normals))
    points = PointFile("scan", positions.astype(np.float32), normals.astype(np.float32), np.tile(np.uint8((40, 200, 60, 255)), (COUNT, 1)), {},
                       (0.0, 0.0, 0.0), 0, {})
    obj = bpy.data.objects.new("scan", made.to_data(points, cloud))
    scene.collection.objects.link(obj)
    obj.patina.lighting = 'UNLIT'
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.ed.undo_push(message="begin")


def halves(picture):
    """Pixels in orange and in the cloud's green, of the left and of the right half of the view."""
    orange = (picture[..., 0] > 0.8) & (picture[..., 2] < 0.3)
    green = (picture[..., 1] > 0.55) & (picture[..., 0] < 0.4)
    half = picture.shape[1] // 2
    return tuple(int(found.sum()) for kind in (orange, green) for found in (kind[:, :half], kind[:, half:]))


def count():
    return point_data.count_of(bpy.data.objects["scan"].data)


def test_edit_mode_selects_and_deletes():
    """A box, a lasso, X, and undo of each: the image follows, and shows what is selected."""
    for cloud in KINDS:
        given(cloud)
        operators = bpy.ops.pointcloud if cloud else bpy.ops.mesh
        yield lambda: settled(COUNT)
        with override():
            bpy.ops.object.mode_set(mode='EDIT')
            operators.select_all(action='DESELECT')
        area().tag_redraw()
        yield lambda: settled(COUNT)
        none = halves(screenshot("edit none"))
        region = window_region()
        width, height = region.width, region.height
        with override():
            check(bpy.ops.view3d.select_box(xmin=0, xmax=width // 2, ymin=0, ymax=height, mode='SET') == {'FINISHED'}, "a box")
        area().tag_redraw()
        yield lambda: settled(COUNT)
        box = halves(screenshot("edit box"))
        check(box[0] > none[0] + 2000 and box[1] < none[1] + 1000, f"orange and green of both halves: {none} unselected, {box} in a box on the left")
        way = [{"name": "", "loc": place, "time": 0.0} for place in ((width // 2, 0), (width - 1, 0), (width - 1, height), (width // 2, height))]
        with override():
            check(bpy.ops.view3d.select_lasso(path=way, mode='SET') == {'FINISHED'}, "a lasso")
        area().tag_redraw()
        yield lambda: settled(COUNT)
        lasso = halves(screenshot("edit lasso"))
        check(lasso[1] > none[1] + 2000 and lasso[0] < none[0] + 1000, f"{none} unselected, {lasso} in a lasso on the right")
        with override():
            bpy.ops.ed.undo_push(message="selected")
            operators.delete(**({} if cloud else {"type": 'VERT'}))
            bpy.ops.object.mode_set(mode='OBJECT')
            bpy.ops.ed.undo_push(message="deleted")
        left = count()
        check(0 < left < 0.7 * COUNT, f"{left} of {COUNT} points are left")
        yield lambda left=left: settled(left)
        bpy.data.objects["scan"].select_set(False)
        yield lambda left=left: settled(left)
        gone = halves(screenshot("edit deleted"))
        check(gone[2] > 0.8 * none[2] and gone[3] < 0.3 * none[3], f"{none} before, {gone} after the right half was deleted")
        with override():
            bpy.ops.ed.undo()
            bpy.ops.ed.undo()
            if bpy.context.mode != 'OBJECT':
                bpy.ops.object.mode_set(mode='OBJECT')
        check(count() == COUNT, f"after undo: {count()} points")
        yield lambda: settled(COUNT)
