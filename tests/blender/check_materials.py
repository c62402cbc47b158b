# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender itself knows of points counts: vertex groups, radii of point clouds, materials of Geometry Nodes."""

import bpy
import numpy as np
from check_points import grid, mesh_to_points, pixel
from check_splats import size_of
from harness import add_points, check, check_close, drawn, new_scene, render, reports
from patina.sync.points import clouds, taking


def test_vertex_groups_as_opacity():
    """Weights are opacities, 0 where a vertex is in no group; as numbers for ramps too."""
    scene = new_scene()
    points = grid()
    obj = add_points(points, np.full((12, 4), 255, np.uint8))
    other, group = obj.vertex_groups.new(name="other"), obj.vertex_groups.new(name="fade")
    other.add(list(range(12)), 1.0, 'REPLACE')
    weights = [0.0, 0.25, 0.5, 0.75, 1.0]
    for index, weight in enumerate(weights):
        group.add([index], weight, 'REPLACE')
    obj.patina.opacity_attribute, obj.patina.lighting = "fade", 'UNLIT'
    picture = render()["Combined"]
    for index, weight in enumerate([*weights, 0.0, 0.0]):
        check_close(picture[pixel(scene, points[index])][3], weight, 0.003, f"weight {weight}")
    group.add([0], 1.0, 'REPLACE')
    check_close(render()["Combined"][pixel(scene, points[0])][3], 1.0, 1e-6, "painted anew")
    obj.patina.opacity_attribute = ""
    obj.patina.colors.source, obj.patina.colors.scalar, obj.patina.colors.ramp = 'SCALAR', "fade", 'GREY'
    picture = render()["Combined"]
    brightness = [picture[pixel(scene, points[index])][0] for index in range(5)]
    check(brightness[0] > 0.9 and all(a < b for a, b in zip(brightness[1:], brightness[2:])), f"a ramp over weights {brightness}")
    check(not any("no point attribute" in text for _, text in reports), f"{reports}")


def with_nodes(obj, *chain):
    """Geometry nodes behind Mesh to Points: (kind, {input: value}) each; links from fields are (input, kind, {property: value})."""
    mesh_to_points(obj)
    tree = obj.modifiers[0].node_group
    points = next(node for node in tree.nodes if node.bl_idname == 'GeometryNodeMeshToPoints')
    last, out = points, next(node for node in tree.nodes if node.bl_idname == 'NodeGroupOutput')
    for kind, inputs in chain:
        node = tree.nodes.new(kind)
        for name, value in inputs.items():
            node.inputs[name].default_value = value
        tree.links.new(last.outputs[0], next(one for one in node.inputs if one.type == 'GEOMETRY'))
        last = node
    tree.links.new(last.outputs[0], out.inputs[0])
    return tree, points


def test_radii_of_point_clouds():
    """Where all points are discs these are as wide as Geometry Nodes says; elsewhere nodes change nothing."""
    scene = new_scene()
    points = grid()
    obj = add_points(points)
    tree, node = with_nodes(obj)
    scene.patina.surface = 'SPLATS'
    sizes = []
    for radius in (0.05, 0.1):
        node.inputs["Radius"].default_value = radius
        sizes.append(size_of(scene, points, render()))
        step = (pixel(scene, points[0] + [1, 0, 0])[1] - pixel(scene, points[0])[1]) * radius
        check(np.all(abs(sizes[-1] - np.pi * step ** 2) <= 0.3 * np.pi * step ** 2 + 1), f"pixels {sizes[-1]}, radius {step}")
    obj.patina.radius = 0.05
    check((size_of(scene, points, render()) == sizes[0]).all(), "the artist's radius counts first")
    obj.patina.radius = 0.0
    scene.patina.surface = 'AUTO'
    check(len(drawn(render())) == len(points), "points stay points")


def material(name, color):
    found = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        found.use_nodes = True
    found.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*color, 1)
    return found


def test_materials_of_geometry_nodes():
    """Set Material: each point cloud has the color of its own; a color attribute, and the artist's color, come first."""
    red, blue = material("red", (0.7, 0.1, 0.05)), material("blue", (0.1, 0.2, 0.8))
    scene = new_scene()
    points = grid()
    obj = add_points(points)
    obj.patina.lighting = 'UNLIT'
    tree, _ = with_nodes(obj, ('GeometryNodeSetMaterial', {"Material": red}))
    picture = render()["Combined"]
    for point in points:
        check_close(picture[pixel(scene, point)][:3], (0.7, 0.1, 0.05), 1e-5, "the material's")
    join = tree.nodes.new('GeometryNodeJoinGeometry')
    own = next(node for node in tree.nodes if node.bl_idname == 'GeometryNodeMeshToPoints')
    index, compare = tree.nodes.new('GeometryNodeInputIndex'), tree.nodes.new('FunctionNodeCompare')
    compare.data_type, compare.operation = 'INT', 'LESS_THAN'
    bound = [one for one in compare.inputs if one.type == 'INT']
    bound[1].default_value = 6
    part = tree.nodes.new('GeometryNodeSeparateGeometry')
    tree.links.new(index.outputs[0], bound[0])
    tree.links.new(compare.outputs[0], part.inputs["Selection"])
    tree.links.new(own.outputs[0], part.inputs[0])
    for output, color in zip(part.outputs, (blue, red)):
        node, instance = tree.nodes.new('GeometryNodeSetMaterial'), tree.nodes.new('GeometryNodeGeometryToInstance')
        node.inputs["Material"].default_value = color
        tree.links.new(output, node.inputs[0])
        tree.links.new(node.outputs[0], instance.inputs[0])
        tree.links.new(instance.outputs[0], join.inputs[0])
    tree.links.new(join.outputs[0], next(node for node in tree.nodes if node.bl_idname == 'NodeGroupOutput').inputs[0])
    picture = render()["Combined"]
    for number, point in enumerate(points):
        check_close(picture[pixel(scene, point)][:3], (0.1, 0.2, 0.8) if number < 6 else (0.7, 0.1, 0.05), 1e-5, f"point {number}")
    items = clouds.collect(bpy.context.evaluated_depsgraph_get(), taking.Trusted().take([]), [])
    check(len(items) == 2 and items[0].cloud is not items[1].cloud, "in a viewport each has its own points too")
    blue.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.0, 0.9, 0.0, 1)
    check_close(render()["Combined"][pixel(scene, points[0])][:3], (0, 0.9, 0), 1e-5, "a material that changed")
    obj.patina.color = (0.3, 0.4, 0.5)
    check_close(render()["Combined"][pixel(scene, points[3])][:3], (0.3, 0.4, 0.5), 1e-5, "the artist's own color")


def test_material_of_points():
    """A material on points without colors is their color, until the artist sets one."""
    scene = new_scene()
    points = grid()
    obj = add_points(points)
    obj.patina.lighting = 'UNLIT'
    obj.data.materials.append(material("green", (0.1, 0.6, 0.2)))
    check_close(render()["Combined"][pixel(scene, points[3])][:3], (0.1, 0.6, 0.2), 1e-5, "the material's")
    obj.patina.color = (0.3, 0.4, 0.5)
    check_close(render()["Combined"][pixel(scene, points[3])][:3], (0.3, 0.4, 0.5), 1e-5, "the artist's")
