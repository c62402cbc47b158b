# SPDX-License-Identifier: GPL-3.0-or-later
"""Distance to another cloud and height above ground: attributes, colors, legend, undo, and what cannot be measured."""

from dataclasses import replace

import bpy
import check_linked  # noqa: F401  no test leaves files with the user
import numpy as np
from check_formats import with_laspy
from check_import import import_ply, write_ply
from check_marks import pictures
from check_points import pixel
from copc_files import points_of, write_copc
from harness import SCRATCH, add_points, check, new_scene, render
from mathutils import Matrix
from patina import native
from patina.native.measure import Scales, start_distance
from patina.read.importers import Progress
from patina.sync.points import coloring, edits
from patina.sync.view import marks

SIDE = 60


def plane(height, step=None, width=1.0, seed=1):
    """A square of SIDE by SIDE points in z = height; step: the right half is so much higher."""
    x, y = (axis.ravel() * (width / SIDE) for axis in np.mgrid[:SIDE, :SIDE] + 0.5)
    z = height + np.random.default_rng(seed).normal(0, 0.001, x.shape)
    return np.stack([x, y, z + (step or 0.0) * (x > width / 2)], 1)


def values(obj, name):
    found = np.empty(len(obj.data.vertices), np.float32)
    obj.data.attributes[name].data.foreach_get("value", found)
    return found


def active(obj):
    bpy.context.view_layer.objects.active = obj
    return obj


def refused(operator, wanted, **given):
    """The operator ends with an error that says this."""
    try:
        done = operator(**given)
    except RuntimeError as error:
        check(wanted in str(error) and str(error).count("Patina") == 1, f"{error}")
    else:
        check(False, f"{done}, not an error with '{wanted}'")


def top_view(scene, width=1.0):
    """An orthographic camera over the square."""
    camera = scene.camera
    camera.data.type, camera.data.ortho_scale = 'ORTHO', 1.2 * width
    camera.matrix_world = Matrix.Translation((width / 2, width / 2, 10 * width))
    camera.data.clip_end = 100 * width
    scene.view_settings.view_transform = 'Standard'


def test_distance_to_cloud():
    """The object lies elsewhere and is scaled: distances are of the world, stored in the object's unit. The step is red, its mirror blue."""
    scene = new_scene()
    before, after = plane(0.0), plane(0.0, 0.04, seed=2)
    obj = active(add_points((before - (5, 0, 0)) / 2, name="before"))
    obj.matrix_world = Matrix.Translation((5, 0, 0)) @ Matrix.Scale(2.0, 4)
    add_points(after, name="after")
    bpy.context.view_layer.update()
    check(bpy.ops.object.patina_cloud_distance(other="after") == {'FINISHED'}, "finished")
    distance, interval = values(obj, "m3c2_distance"), values(obj, "m3c2_interval")
    left, right = before[:, 0] < 0.35, before[:, 0] > 0.65
    check(np.abs(2 * distance[left]).max() < 1e-3 and np.abs(2 * distance[right] - 0.04).max() < 1e-3, f"{distance[right].mean()}")
    check((interval > 0).all() and 2 * interval.max() < 0.03, f"intervals to {interval.max()}")
    group = obj.patina.colors
    check((group.source, group.scalar, group.ramp, group.use_legend) == ('SCALAR', "m3c2_distance", 'DIVERGING', True), "Color By")
    check(group.use_range and np.isclose(group.range_max, -group.range_min) and 2 * group.range_max > 0.035, "a range about zero")
    bpy.data.objects["after"].hide_render = True
    top_view(scene)
    picture = render()["Combined"]
    ramp = native.ramp("diverging")
    for x, wanted in ((0.2, ramp[128]), (0.8, ramp[-1])):
        row, column = pixel(scene, (x, 0.5, 0.0))
        check(np.abs(picture[row, column, :3] - wanted).max() < 0.06, f"{x}: {picture[row, column]} is not {wanted}")


def test_distance_to_linked():
    """A linked cloud is the other one, as it stands in the world, without its deleted points; it holds no distances itself. Files that are
    read as needed are refused with what to do."""
    with_laspy()
    new_scene()
    before, after = plane(0.0), plane(0.05, seed=2)
    path = write_ply("after.ply", [(axis, "f4", after[:, i] + (0, 0, -3)[i]) for i, axis in enumerate("xyz")])
    other, = import_ply(path, link=True)
    other.matrix_world = Matrix.Translation((0, 0, 3)) @ other.matrix_world
    other[edits.PROPERTY] = replace(edits.none(len(after)), deleted=edits.of_flags(after[:, 0] > 0.6)).packed()
    obj = active(add_points(before, name="before"))
    bpy.context.view_layer.update()
    check(bpy.ops.object.patina_cloud_distance(other=other.name, depth=0.2) == {'FINISHED'}, "finished")
    distance = values(obj, "m3c2_distance")
    check(np.abs(distance[before[:, 0] < 0.5] - 0.05).max() < 1e-3, f"{distance[before[:, 0] < 0.5]}")
    check(np.isnan(distance[before[:, 0] > 0.7]).all(), "deleted points were measured")
    active(other)
    for operator in (bpy.ops.object.patina_cloud_distance, bpy.ops.object.patina_height_above_ground):
        try:
            operator('EXEC_DEFAULT')
        except RuntimeError as error:
            check("Convert to Mesh" in str(error) or bpy.app.version < (4, 0), str(error))
        else:
            check(False, "a linked cloud took attributes")
    path = SCRATCH / "asneeded.copc.laz"
    write_copc(path, points_of(2000)[0])
    bpy.ops.import_scene.patina_points(filepath=str(path), link=True, stream='ON')
    streamed = bpy.context.object
    active(obj)
    refused(bpy.ops.object.patina_cloud_distance, "Read Whole", other=streamed.name)
    active(streamed)
    refused(bpy.ops.object.patina_level, "Read Whole")


def test_distance_to_mesh():
    new_scene()
    obj = active(add_points(plane(0.03), name="scan"))
    bpy.ops.mesh.primitive_plane_add(size=4)
    mesh = bpy.context.object
    active(obj)
    check(bpy.ops.object.patina_cloud_distance(other=mesh.name, cylinder=0.1) == {'FINISHED'}, "finished")
    check(abs(np.median(values(obj, "m3c2_distance")) + 0.03) < 5e-4, "below the points")


def test_distance_refusals():
    """One message each; nothing is written."""
    new_scene()
    obj = active(add_points(plane(0.0), name="scan"))
    check(not bpy.ops.object.patina_cloud_distance.poll(), "no other cloud")
    far = add_points(plane(9.0), name="far")
    refused(bpy.ops.object.patina_cloud_distance, "Depth", other="far", depth=0.5)
    far.patina.linked_file = "scan.ply"
    refused(bpy.ops.object.patina_cloud_distance, "is missing", other="far")
    far.patina.linked_file = ""
    empty = add_points(np.empty((0, 3)), name="empty")
    refused(bpy.ops.object.patina_cloud_distance, "'empty' has no points", other="empty")
    check("m3c2_distance" not in obj.data.attributes and obj.patina.colors.source == 'OWN', "nothing was written")
    lost = add_points(np.full((9, 3), np.nan), name="lost")
    for which in (empty, lost):
        active(which)
        refused(bpy.ops.object.patina_height_above_ground, which.name)
    active(far).patina.linked_file = "scan.ply"
    check(not bpy.ops.object.patina_cloud_distance.poll() and not bpy.ops.object.patina_height_above_ground.poll(), "linked, active")


def test_linked_refusals_say_what_works():
    """Convert to Mesh is advised for files that it can read, and disabled for the others. There the scan itself is advised."""
    new_scene()
    obj = active(add_points(plane(0.0), name="scan"))
    measuring = (bpy.ops.object.patina_cloud_distance, bpy.ops.object.patina_height_above_ground)
    convert = bpy.ops.object.patina_linked_to_mesh
    for path, advice in (("scan.ply", "Convert to Mesh"), ("scan.CLOUD", "Import the file that it was made from"),
                         ("scan/ept.json", "Import a file that it was made from")):
        obj.patina.linked_file = path
        can = path == "scan.ply"
        check(convert.poll() == can, f"Convert to Mesh of {path}")
        for operator in measuring if can else (*measuring, convert):
            try:
                operator()
            except RuntimeError as error:
                check(advice in str(error), f"{path}: {error}")
            else:
                check(False, f"{operator} took {path}")


def site():
    """A slope with a house of 5 m and a stray below: points, heights above ground."""
    random = np.random.default_rng(5)
    x, y = random.uniform(0, 60, (2, 20000))
    above = np.where((x > 20) & (x < 32) & (y > 20) & (y < 34), 5.0, 0.0)
    above[7] = -15.0
    return np.stack([x, y, 0.2 * x + above], 1), above


def test_height_above_ground():
    scene = new_scene()
    points, above = site()
    obj = active(add_points(points, name="site"))
    bpy.ops.ed.undo_push(message="before")
    check(bpy.ops.object.patina_height_above_ground(cell=1.0) == {'FINISHED'}, "finished")
    found = values(obj, "height_above_ground")
    check(np.abs(found - above).max() < 0.6, f"off by {np.abs(found - above).max()}")
    group = obj.patina.colors
    check((group.source, group.scalar, group.ramp, group.use_legend) == ('SCALAR', "height_above_ground", 'VIRIDIS', True), "Color By")
    top_view(scene, 60.0)
    picture = render()["Combined"]
    ramp = native.ramp("viridis")
    for x, wanted in ((10.0, ramp[0]), (26.0, ramp[-1])):
        row, column = pixel(scene, (x, 27.0, 0.0))
        check(np.abs(picture[row, column, :3] - wanted).max() < 0.1, f"{x}: {picture[row, column]} is not {wanted}")
    scene.render.resolution_x, scene.render.resolution_y = 640, 400
    _, overlay = pictures(scene, "ground")
    check((np.abs(overlay[..., :3] - ramp[-1]).max(axis=2) < 0.02).any() and not overlay[:, :400].any(), "the legend is at the right")
    check(coloring.current(obj) in marks._LENGTHS, "its values have the scene's unit")
    bpy.ops.ed.undo_push(message="measured")
    bpy.ops.ed.undo()
    obj = bpy.data.objects["site"]
    check("height_above_ground" not in obj.data.attributes and obj.patina.colors.source == 'OWN', "one step of undo")


def test_soft_by_height():
    """A mask by the attribute: what is above the ground is soft, and the ground shows through."""
    scene = new_scene()
    points, above = site()
    obj = active(add_points(points, np.where(above[:, None] > 1, [255, 0, 0, 255], [0, 255, 0, 255]).astype(np.uint8), name="site"))
    check(bpy.ops.object.patina_height_above_ground(cell=1.0) == {'FINISHED'}, "finished")
    obj.patina.colors.source, obj.patina.colors.use_legend = 'OWN', False
    top_view(scene, 60.0)
    row, column = pixel(scene, (26.0, 27.0, 0.0))
    solid = render()["Combined"][row, column]
    soft = obj.patina.soft
    soft.use, soft.by, soft.attribute, soft.opacity = True, 'ATTRIBUTE', "height_above_ground", 0.05
    soft.use_range, soft.range_min, soft.range_max, soft.threshold = True, 0.0, 4.0, 0.5
    seen = render()["Combined"][row, column]
    check(solid[0] > 0.9 and seen[0] < 0.6, f"{solid} became {seen}")


def test_cancel():
    """A progress that was cancelled ends the call; what it was given stays."""
    own = plane(0.0).astype(np.float64)
    progress = Progress()
    progress.cancel()
    with progress.inner() as inner:
        task = start_distance(own, own, None, Scales(0.1, 2.0, 1.0), inner)
    try:
        task.result()
        check(False, "not cancelled")
    except native.PatinaCancelled:
        pass
