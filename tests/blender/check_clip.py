# SPDX-License-Identifier: GPL-3.0-or-later
"""Clip boxes and planes: what they leave, tint, shadows, operators."""

import math

import bpy
import numpy as np
from check_points import pixel
from harness import add_light, add_points, check, check_close, drawn, linear, new_scene, render
from mathutils import Matrix

GREEN = (30, 180, 90, 255)


def wall(matrix=None):
    """(scene, points): 13 x 9 points on a wall at z = -3."""
    scene = new_scene()
    points = np.array([(x * 0.1, y * 0.1, -3.0) for x in range(-6, 7) for y in range(-4, 5)])
    obj = add_points(points, np.tile(np.array(GREEN, np.uint8), (len(points), 1)), matrix=matrix)
    return scene, points, obj


def add_clip(shape, matrix, name="clip"):
    empty = bpy.data.objects.new(name, None)
    empty.matrix_world = matrix
    empty.empty_display_size = 0.5
    empty.patina.clip.shape = shape
    bpy.context.scene.collection.objects.link(empty)
    return empty


def shown(scene, points, keep):
    return {tuple(pixel(scene, point)) for point in points if keep(point)}


def test_box():
    scene, points, obj = wall()
    place = Matrix.Translation((0.15, 0.05, -3)) @ Matrix.Diagonal((0.8, 0.4, 1, 1))  # half sizes 0.4, 0.2, 0.5
    box = add_clip('BOX', place)

    def inside(point):
        return abs(point[0] - 0.15) < 0.4 and abs(point[1] - 0.05) < 0.2

    check(drawn(render()) == shown(scene, points, inside), "a box keeps what lies in it")
    box.patina.clip.cut = True
    check(drawn(render()) == shown(scene, points, lambda point: not inside(point)), "and cuts it out")
    obj.patina.colors.use_clips = False
    check(len(drawn(render())) == len(points), "a cloud may opt out")
    obj.patina.colors.use_clips = True
    box.patina.clip.cut = False
    box.location.x += 0.5
    check(drawn(render()) == shown(scene, points, lambda point: inside((point[0] - 0.5, point[1]))), "moved")
    other = add_clip('BOX', Matrix.Translation((-0.45, 0, -3)) @ Matrix.Diagonal((0.2, 2, 1, 1)))
    check(drawn(render()) == shown(scene, points, lambda point: inside((point[0] - 0.5, point[1])) or
                                   -0.55 < point[0] < -0.35), "either of two boxes")
    other.hide_render = True
    check(drawn(render()) == shown(scene, points, lambda point: inside((point[0] - 0.5, point[1]))), "a box that is off")


def test_turned_box():
    """Turned and mirrored, on a turned cloud."""
    turn = Matrix.Rotation(0.5, 4, 'Z')
    scene, points, _ = wall(turn)
    place = Matrix.Translation((0.1, 0, -3)) @ Matrix.Rotation(0.3, 4, 'Z') @ Matrix.Diagonal((-1.0, 0.5, 1, 1))
    add_clip('BOX', place)
    world = [turn @ Matrix.Translation(point).translation for point in points]

    def inside(point):
        q = place.inverted() @ point
        return all(abs(value) < 0.5 for value in q)

    check(drawn(render()) == shown(scene, world, inside), "a turned, mirrored box")


def test_mesh_box():
    scene, points, _ = wall()
    mesh = bpy.data.meshes.new("box")
    mesh.from_pydata([(0, 0, 0), (4, 0, 0), (4, 2, 0), (0, 0, 1)], [], [(0, 1, 2)])
    obj = bpy.data.objects.new("box", mesh)
    obj.matrix_world = Matrix.Translation((0.05, -0.05, -3.5)) @ Matrix.Scale(0.1, 4) @ Matrix.Diagonal((1, 1, 10, 1))
    obj.patina.clip.shape = 'BOX'
    scene.collection.objects.link(obj)
    picture = render()
    check(drawn(picture) == shown(scene, points, lambda point: 0.05 < point[0] < 0.45 and -0.05 < point[1] < 0.15),
          "the bounding box of a mesh, which is not drawn itself")


def test_plane():
    scene, points, _ = wall()
    plane = add_clip('PLANE', Matrix.Translation((0, 0.05, -3)) @ Matrix.Rotation(-math.pi / 2, 4, 'X'))  # z goes up
    check(drawn(render()) == shown(scene, points, lambda point: point[1] < 0.05), "what lies above is cut off")
    plane.patina.clip.cut = True
    check(drawn(render()) == shown(scene, points, lambda point: point[1] > 0.05), "or below")
    plane.patina.clip.cut = False
    plane.patina.clip.tint = (1, 0, 0)
    plane.patina.clip.tint_strength = 1.0
    plane.patina.clip.tint_width = 0.1
    picture = render()["Combined"]
    for point in points[::2]:
        if point[1] > 0.05:
            continue
        wanted = (1, 0, 0) if point[1] > -0.02 else linear(GREEN[:3])
        check_close(picture[pixel(scene, point)][:3], wanted, 2e-6, f"tint at {point}")


def test_shadow():
    """A sheet that shadows another goes, and its shadow with it, unless it is to stay."""
    scene = new_scene()
    axis = np.linspace(-0.8, 0.8, 60)
    sheet = np.array([(x, y, -3.0) for x in axis for y in axis])
    floor = add_points(sheet, normals=np.tile((0.0, 0.0, 1.0), (len(sheet), 1)), name="floor")
    add_points(sheet * (1, 1, 0.5), normals=np.tile((0.0, 0.0, 1.0), (len(sheet), 1)), name="roof")
    for obj in (floor, bpy.data.objects["roof"]):
        obj.patina.lighting = 'LIT'
    add_light('SUN', 3.0)
    add_clip('PLANE', Matrix.Translation((0, 0, -2)))
    middle = (scene.render.resolution_y // 2, scene.render.resolution_x // 2)
    scene.patina.fill = 'CLOSED'
    bright = render()["Combined"][middle][0]
    check(bright > 0.3, f"lit where the roof is cut away: {bright}")
    scene.patina.shadow_uncut = True
    dark = render()["Combined"][middle][0]
    check(dark < 0.1 * bright, f"its shadow stays when asked for: {dark}")


def test_operators():
    scene, points, obj = wall()
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    bpy.context.view_layer.update()
    check(bpy.ops.object.patina_add_clip_box() == {'FINISHED'}, "a box was added")
    box = bpy.context.view_layer.objects.active
    check(box.patina.clip.shape == 'BOX' and box.type == 'EMPTY', "an empty that clips")
    check_close(box.location, (0, 0, -3), 1e-6, "around the cloud")
    check_close(box.scale, (0.6, 0.4, 1e-3), 1e-6, "as large as it")
    box.scale = (0.61, 0.41, 0.1)
    check(len(drawn(render())) == len(points), "all points are in it")
    box.scale.x = 0.25
    check(drawn(render()) == shown(scene, points, lambda point: abs(point[0]) < 0.25), "a narrower one")
    bpy.data.objects.remove(box)
    obj.select_set(True)
    check(bpy.ops.object.patina_add_clip_plane() == {'FINISHED'}, "a plane was added")
    check(bpy.context.view_layer.objects.active.patina.clip.shape == 'PLANE', "that clips")
