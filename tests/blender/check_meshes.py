# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes with faces in the picture: where they are, what they hide, what hides them."""

import bpy
import numpy as np
from harness import add_light, add_points, check, check_close, new_scene, render, sphere
from patina.sync.objects import meshes


def plane(z, half, color=None, name="plane"):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(-half, -half, z), (half, -half, z), (half, half, z), (-half, half, z)], [], [(0, 1, 2, 3)])
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    if color:
        material = bpy.data.materials.new(name)
        if bpy.app.version < (5, 0, 0):
            material.use_nodes = True
        node = next(node for node in material.node_tree.nodes if node.type == 'BSDF_PRINCIPLED')
        node.inputs["Base Color"].default_value = (*color, 1)
        mesh.materials.append(material)
    return obj


def scene_with_points(kind='POINTS'):
    scene = new_scene(96, 72)
    scene.patina.fill = 'CLOSED'
    scene.patina.meshes = kind
    scene.patina.mesh_points = 50000
    positions, colors, normals = sphere(20000, 1.0, (0, 0, -4))
    add_points(positions, np.full_like(colors, (255, 255, 255, 255)), normals)
    return scene


def test_occlusion():
    """A plane before the sphere hides it, one behind is hidden; depths are the planes'."""
    for kind in ('POINTS', 'TRIANGLES'):
        scene_with_points(kind)
        obj = plane(-2.0, 0.2)
        depth = render()["Depth"][..., 0]
        check_close(depth[36, 48], 2.0, 1e-3, f"{kind}: the plane in front")
        check(((depth > 1.99) & (depth < 2.01)).sum() > 300, f"{kind}: the plane's size")
        check(((depth > 2.99) & (depth < 4)).sum() > 500, f"{kind}: the sphere around it")
        obj.location.z = -4.0
        obj.scale = (20, 20, 1)
        depth = render()["Depth"][..., 0]
        check_close(depth[36, 48], 3.0, 2e-2, f"{kind}: the sphere before the plane")
        check_close(depth[2, 2], 6.0, 2e-2, f"{kind}: the plane around the sphere")


def test_lit_with_its_material():
    for kind in ('POINTS', 'TRIANGLES'):
        scene = scene_with_points(kind)
        bpy.data.objects.remove(bpy.data.objects["points"])
        plane(-2.0, 0.5, (0.1, 0.6, 0.2))
        add_light('SUN', 3.0, direction=(0, 0, -1))
        color = render()["Combined"][36, 48]
        # a sun of strength 3 on a matt surface that faces it: colour times 3 / pi
        ratio = color[:3] / np.array((0.1, 0.6, 0.2))
        check(ratio.max() - ratio.min() < 0.02 * ratio.max() and ratio.min() > 0.3, f"{kind}: {color}")
        scene.patina.meshes = 'OFF'
        check(not render()["Combined"][..., 3].any(), "drawn although switched off")


def test_triangles_are_exact():
    """A square of 16 x 16 pixels, to the pixel; its depth, normal, source and object index; black is black."""
    scene = scene_with_points('TRIANGLES')
    layer = bpy.context.view_layer
    layer.use_pass_normal = layer.use_pass_object_index = layer.patina.use_pass_source = True
    scene.patina.antialias = 'OFF'
    obj = plane(-2.0, 0.5, (0, 0, 0))
    obj.pass_index = 7
    camera = scene.camera
    camera.data.type = 'ORTHO'
    camera.data.ortho_scale = 6.0  # 96 pixels
    picture = render()
    index = next(picture[name] for name in ("IndexOB", "Object Index") if name in picture)[..., 0]
    square = np.zeros((72, 96), bool)
    square[28:44, 40:56] = True
    check(np.array_equal(index == 7, square), f"{(index == 7).sum()} pixels of the square, expected 256")
    check_close(picture["Depth"][square], 2.0, 1e-5, "depth")
    check_close(picture["Normal"][square], (0, 0, 1), 1e-6, "normal")
    check((picture["Source"][square] == 1).all(), "a mesh is measured")
    check_close(picture["Combined"][square], (0, 0, 0, 1), 1e-6, "black")


def test_materials_and_smooth_shading():
    """Two faces of one mesh with different materials; a bent strip shaded smooth has the mean normal at its bend."""
    scene = scene_with_points('TRIANGLES')
    bpy.data.objects.remove(bpy.data.objects["points"])
    scene.world = bpy.data.worlds.new("white")
    if bpy.app.version < (5, 0, 0):
        scene.world.use_nodes = False
    scene.world.color = (1, 1, 1)
    mesh = bpy.data.meshes.new("strip")
    mesh.from_pydata([(-1, -1, -4), (0, -1, -3), (1, -1, -4), (-1, 1, -4), (0, 1, -3), (1, 1, -4)], [],
                     [(0, 1, 4, 3), (1, 2, 5, 4)])
    for name, color in (("red", (0.5, 0, 0, 1)), ("green", (0, 0.5, 0, 1))):
        material = bpy.data.materials.new(name)
        material.diffuse_color = color
        if bpy.app.version < (5, 0, 0):
            material.use_nodes = False
        else:
            material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = color
        mesh.materials.append(material)
    mesh.polygons[1].material_index = 1
    mesh.polygons.foreach_set("use_smooth", [True, True])
    obj = bpy.data.objects.new("strip", mesh)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.use_pass_normal = True
    picture = render()
    left, right = picture["Combined"][36, 40], picture["Combined"][36, 56]
    check(left[0] > 0.02 and left[1] == 0 and right[1] > 0.02 and right[0] == 0, f"{left} and {right}")
    check(picture["Normal"][36, 48, 2] > 0.99, f"smooth: {picture['Normal'][36, 48]} at the bend")
    mesh.polygons.foreach_set("use_smooth", [False, False])
    mesh.update()
    check_close(abs(render()["Normal"][36, 44]), (0.5 ** 0.5, 0, 0.5 ** 0.5), 1e-3, "flat")


def test_mesh_casts_on_points():
    scene = scene_with_points('TRIANGLES')
    positions = np.stack([*np.meshgrid(np.linspace(-2, 2, 300), np.linspace(-2, 2, 300)), np.full((300, 300), -4.0)], -1)
    bpy.data.objects.remove(bpy.data.objects["points"])
    ground = add_points(positions.reshape(-1, 3), None, np.tile((0.0, 0.0, 1.0), (90000, 1)))
    ground.patina.lighting = 'LIT'
    obj = plane(-3.5, 0.3)
    obj.location.x = 0.8
    light = add_light('SUN', 3.0, direction=(-0.7, 0, -1))
    light.data.angle = 0.0
    bpy.context.view_layer.patina.use_pass_shadow = True
    shadow = render()["Shadow"][..., 0]
    # the square's shadow lies 0.35 to the left of it, on the ground
    def pixel(x, y, z=-4.0):
        scale = 96 * scene.camera.data.lens / scene.camera.data.sensor_width / -z
        return round(36 + y * scale), round(48 + x * scale)
    check(shadow[pixel(0.38, 0.0)] == 0, f"under the square: {shadow[pixel(0.38, 0.0)]}")
    check(shadow[pixel(-0.3, 0.0)] == 1 and shadow[pixel(0.4, 0.6)] == 1, "beside it")
    obj.visible_shadow = False
    check(render()["Shadow"][pixel(0.38, 0.0)][0] == 1, "casts although Blender's ray visibility says no")


def test_even_spread():
    """Each part of a face gets its share, and every point lies on it."""
    new_scene()
    obj = plane(0.0, 1.0)
    bpy.context.view_layer.update()
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    positions, normals, colors = meshes.sample(evaluated, evaluated.data, 10000)
    counts = np.histogram2d(positions[:, 0], positions[:, 1], bins=10, range=[[-1, 1], [-1, 1]])[0]
    check(counts.min() > 80 and counts.max() < 120, f"{counts.min()} to {counts.max()} of 100")
    check((positions[:, 2] == 0).all() and (normals == (0, 0, 1)).all(), "off the plane")
    check_close(colors[0], (0.8, 0.8, 0.8, 1), 1e-6, "no material")
