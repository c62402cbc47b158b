# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes with faces in the picture: where they are, what they hide, what hides them."""

import bpy
import numpy as np
from harness import add_light, add_points, check, check_close, new_scene, render, sphere

from patina.sync import meshes


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


def scene_with_points():
    scene = new_scene(96, 72)
    scene.patina.fill = 'CLOSED'
    scene.patina.meshes = 'POINTS'
    scene.patina.mesh_points = 50000
    positions, colors, normals = sphere(20000, 1.0, (0, 0, -4))
    add_points(positions, np.full_like(colors, (255, 255, 255, 255)), normals)
    return scene


def test_occlusion():
    """A plane before the sphere hides it, one behind is hidden; depths are the planes'."""
    scene_with_points()
    obj = plane(-2.0, 0.2)
    depth = render()["Depth"][..., 0]
    check_close(depth[36, 48], 2.0, 1e-3, "the plane in front")
    check(((depth > 1.99) & (depth < 2.01)).sum() > 300, "the plane's size")
    check(((depth > 2.99) & (depth < 4)).sum() > 500, "the sphere around it")
    obj.location.z = -4.0
    obj.scale = (20, 20, 1)
    depth = render()["Depth"][..., 0]
    check_close(depth[36, 48], 3.0, 2e-2, "the sphere before the plane")
    check_close(depth[2, 2], 6.0, 2e-2, "the plane around the sphere")


def test_lit_with_its_material():
    scene = scene_with_points()
    bpy.data.objects.remove(bpy.data.objects["points"])
    plane(-2.0, 0.5, (0.1, 0.6, 0.2))
    add_light('SUN', 3.0, direction=(0, 0, -1))
    color = render()["Combined"][36, 48]
    # a sun of strength 3 on a matt surface that faces it: colour times 3 / pi
    ratio = color[:3] / np.array((0.1, 0.6, 0.2))
    check(ratio.max() - ratio.min() < 0.02 * ratio.max() and ratio.min() > 0.3, f"{color}")
    scene.patina.meshes = 'OFF'
    check(not render()["Combined"][..., 3].any(), "drawn although switched off")


def test_even_spread():
    """Each part of a face gets its share, and every point lies on it."""
    new_scene()
    obj = plane(0.0, 1.0)
    bpy.context.view_layer.update()
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    positions, normals, colors = meshes.sample(evaluated, 10000)
    counts = np.histogram2d(positions[:, 0], positions[:, 1], bins=10, range=[[-1, 1], [-1, 1]])[0]
    check(counts.min() > 80 and counts.max() < 120, f"{counts.min()} to {counts.max()} of 100")
    check((positions[:, 2] == 0).all() and (normals == (0, 0, 1)).all(), "off the plane")
    check_close(colors[0], (0.8, 0.8, 0.8, 1), 1e-6, "no material")
