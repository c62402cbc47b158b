# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects in Edit Mode: Blender keeps their meshes in another structure, and the picture is the same."""

import bpy
import numpy as np
from harness import SCRATCH, add_points, check, new_scene, patina, render, reports, sphere
from patina.read.importers import library


def cube(scene):
    mesh = bpy.data.meshes.new("cube")
    corners = [(x, y, z) for x in (0.4, 0.8) for y in (0.4, 0.8) for z in (-3.0, -2.6)]
    mesh.from_pydata(corners, [], [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
    obj = bpy.data.objects.new("cube", mesh)
    scene.collection.objects.link(obj)
    return obj


def edit(*objects):
    bpy.context.view_layer.objects.active = objects[0]
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects)
    bpy.ops.object.mode_set(mode='EDIT')


def leave():
    if bpy.context.object and bpy.context.object.mode == 'EDIT':
        bpy.ops.object.mode_set(mode='OBJECT')


def same(before, after, what):
    check(before.keys() == after.keys() and after, f"{what}: {list(after)}")
    for name, pixels in before.items():
        check(np.array_equal(pixels, after[name]), f"{what}: {name} differs")


def test_points_and_faces():
    """Clouds, triangles and points on faces, with what modifiers make of them."""
    for meshes in ('TRIANGLES', 'POINTS'):
        scene = new_scene()
        scene.patina.meshes = meshes
        positions, colors, normals = sphere(3000)
        points, solid = add_points(positions, colors, normals), cube(scene)
        twins = points.modifiers.new("twins", 'ARRAY')
        try:
            for twins.show_viewport in (False, True):
                twins.show_render = twins.show_in_editmode = twins.show_viewport
                before = render()
                check((before["Combined"][..., 3] > 0).mean() > 0.05, "an empty picture")
                edit(points, solid)
                same(before, render(), f"{meshes}, modifier {twins.show_viewport}")
                check(not any("no visible object" in text for _, text in reports), f"{reports}")
                leave()
        finally:
            leave()


def test_file_saved_in_edit_mode():
    """As a farm opens it."""
    scene = new_scene()
    points = add_points(*sphere(3000))
    before = render()
    edit(points, cube(scene))
    bpy.data.objects["cube"].hide_render = True
    path = str(SCRATCH / "edited.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    leave()
    bpy.ops.wm.open_mainfile(filepath=path, load_ui=False)
    check(bpy.data.objects["points"].mode == 'EDIT', "the file is in Edit Mode")
    try:
        same(before, render(), "opened")
    finally:
        leave()


def test_export_and_framing():
    """What else looks at points."""
    new_scene()
    points = add_points(*sphere(2000, 1.0, (5, 5, -9)))
    path = SCRATCH / "edited.ply"
    edit(points)
    try:
        bpy.ops.export_scene.patina_points(overwrite=True, filepath=str(path), kind='PLY')
        file = library.read(path, patina.read.importers.Filter(), patina.read.importers.Progress())
        check(len(file.positions) == 2000 and file.colors is not None and file.normals is not None, "the exported file")
        check(bpy.ops.object.patina_frame_points() == {'FINISHED'}, "framing")
        check((render()["Combined"][..., 3] > 0).sum() > 100, "an empty picture")
        check(not bpy.ops.object.patina_mesh_to_linked.poll(), "an edited mesh cannot be taken away")
    finally:
        leave()
