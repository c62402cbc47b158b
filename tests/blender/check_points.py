# SPDX-License-Identifier: GPL-3.0-or-later
"""Sources of points: meshes, point clouds, instances; their colours, normals and transforms."""

import bpy
import numpy as np
from check_camera import to_pixels
from harness import Skip, add_points, check, check_close, drawn, linear, move, new_scene, patina, points_of, render, reports, sphere
from mathutils import Euler, Matrix
from patina.sync.points import attributes, built


def pixel(scene, point):
    column, row = np.floor(to_pixels(scene, np.asarray([point], np.float64))[0]).astype(int)
    return row, column


def grid(count=12):
    """Points one to a pixel neighbourhood in front of the default camera."""
    x, y = np.meshgrid(np.linspace(-0.6, 0.6, count // 3), np.linspace(-0.4, 0.4, 3))
    return np.stack([x.ravel() + 0.003, y.ravel() + 0.007, np.full(x.size, -2.0)], 1)


def test_byte_colors():
    scene = new_scene()
    points = grid()
    colors = np.random.default_rng(3).integers(0, 256, (12, 4)).astype(np.uint8)
    colors[0, :3], colors[1, :3] = 0, 255
    add_points(points, colors)
    picture = render()["Combined"]
    for point, color in zip(points, colors):
        got = picture[pixel(scene, point)]
        check_close(got[:3], linear(color[:3]), 2e-6, "byte colour")
        check(got[3] == 1, "alpha of a point")


def test_bytes_are_read_in_place():
    """Byte colours and small whole numbers come from Blender's own memory, the same to the bit as it hands them out."""
    new_scene()
    count = 5000
    mesh = bpy.data.meshes.new("bytes")
    mesh.vertices.add(count)
    random = np.random.default_rng(8)
    colors = random.integers(0, 256, (count, 4)).astype(np.uint8)
    numbers = random.integers(-128, 128, count).astype(np.int32)
    mesh.attributes.new("paint", 'BYTE_COLOR', 'POINT').data.foreach_set("color_srgb", (colors / np.float32(255)).ravel())
    mesh.attributes.new("number", 'INT8', 'POINT').data.foreach_set("value", numbers)
    paint, number = mesh.attributes["paint"], mesh.attributes["number"]
    check(np.array_equal(attributes._in_place(paint, count), colors), "byte colours in place")
    check(np.array_equal(attributes._in_place(number, count)[:, 0], numbers), "small numbers in place")
    check(np.array_equal(attributes.colors(mesh, count, "paint"), colors), "byte colours")
    check(np.array_equal(attributes.scalars(mesh, count, "number")[:, 0], numbers), "small numbers")
    check(attributes._in_place(paint, count - 1) is None, "as many as there are, or nothing")
    looks = []
    attributes._in_place(paint, count, lambda: looks.append(1))
    check(len(looks) == 1, "a look at what the artist wants, each block")
    shown = attributes._BYTES
    attributes._BYTES = {}  # as where they lie in another way
    try:
        check(np.array_equal(attributes.colors(mesh, count, "paint"), colors), "byte colours as Blender hands them out")
        check(np.array_equal(attributes.scalars(mesh, count, "number")[:, 0], numbers), "small numbers, the same way")
    finally:
        attributes._BYTES = shown


def test_float_colors():
    scene = new_scene()
    points = grid()
    colors = np.random.default_rng(4).uniform(0, 3, (12, 4)).astype(np.float32)
    add_points(points, colors)
    picture = render()["Combined"]
    for point, color in zip(points, colors):
        check_close(picture[pixel(scene, point)][:3], color[:3], 1e-6, "float colour, brighter than white too")


def test_color_attribute_by_name():
    scene = new_scene()
    points = grid()
    obj = add_points(points, np.full((12, 4), 30, np.uint8))
    second = obj.data.attributes.new("scan", 'BYTE_COLOR', 'POINT')
    second.data.foreach_set("color_srgb", np.full(48, 200 / 255, np.float32))
    obj.patina.color_attribute = "scan"
    check_close(render()["Combined"][pixel(scene, points[5])][:3], linear([200] * 3), 2e-6, "named attribute")
    obj.patina.color_attribute = "nowhere"
    obj.patina.lighting = 'UNLIT'
    obj.patina.color = (0.25, 0.5, 0.75)
    check_close(render()["Combined"][pixel(scene, points[5])][:3], (0.25, 0.5, 0.75), 5e-3, "object colour")
    check(any("no point attribute 'nowhere'" in message for _, message in reports), f"reports {reports}")


def test_transforms():
    """Mirrored, non-uniform, sheared, all in one picture; normals follow by the inverse transpose."""
    scene = new_scene()
    shear = Matrix.Identity(4)
    shear[0][1] = 0.7
    matrices = [Matrix.Translation((-0.5, 0.3, -2)) @ Matrix.Diagonal((-1, 1, 1, 1)),
                Matrix.Translation((0.4, 0.2, -3)) @ Euler((0.3, 0.5, 0.9)).to_matrix().to_4x4()
                @ Matrix.Diagonal((3, 0.2, 1.5, 1)),
                Matrix.Translation((0.1, -0.4, -2.5)) @ shear @ Matrix.Diagonal((1, -2, 0.5, 1))]
    points = np.array([(0.1, 0.05, 0.0), (-0.07, -0.11, 0.1)])
    normals = np.array([(0.6, 0.0, 0.8), (0.36, 0.48, 0.8)])
    for index, matrix in enumerate(matrices):
        colors = np.full((2, 4), 60 + 60 * index, np.uint8)
        colors[1, 1] = 20
        add_points(points, colors, normals, f"object {index}", matrix)
    bpy.context.view_layer.update()
    picture = render()
    check(len(drawn(picture)) == 6, f"{len(drawn(picture))} of 6 points drawn")
    for index, matrix in enumerate(matrices):
        world = np.array(bpy.data.objects[f"object {index}"].matrix_world, np.float64)
        for point, normal, green in zip(points, normals, (60 + 60 * index, 20)):
            place = pixel(scene, (world @ np.append(point, 1))[:3])
            check_close(picture["Combined"][place][:2], linear([60 + 60 * index, green]), 2e-6, f"object {index}")
            turned = np.linalg.inv(world[:3, :3]).T @ normal
            check_close(picture["Normal"][place], turned / np.linalg.norm(turned), 5e-3, f"normal of {index}")


def test_nearest_object_hides():
    scene = new_scene()
    add_points([(0.01, 0.01, -3)], np.full((1, 4), 50, np.uint8), name="far")
    add_points([(0.007, 0.007, -2)], np.full((1, 4), 220, np.uint8), name="near")
    check(pixel(scene, (0.01, 0.01, -3)) == pixel(scene, (0.007, 0.007, -2)), "the test's own points")
    picture = render()
    check_close(picture["Combined"][pixel(scene, (0.01, 0.01, -3))][0], linear(220), 2e-6, "nearest point")


def test_backface_culling():
    new_scene()
    obj = add_points([(-0.3, 0, -2), (0.3, 0, -2)], normals=[(0, 0, 1), (0, 0, -1)])
    check(len(drawn(render())) == 2, "both points without culling")
    obj.patina.cull_back = True
    check(len(drawn(render())) == 1, "one point with culling")


def test_hidden_objects():
    scene = new_scene()
    place = (0.01, 0.02, -2)
    hidden = add_points([(0.3, 0, -2)], name="hidden")
    hidden.hide_render = True
    unseen = add_points([(-0.3, 0, -2)], name="unseen")
    unseen.visible_camera = False
    shown = add_points([place], name="shown")
    shown.hide_viewport = True  # says nothing about renders
    check(drawn(render()) == {pixel(scene, place)}, "only the object that renders show")


def test_collection_instances():
    scene = new_scene()
    collection = bpy.data.collections.new("scan")
    collection.objects.link(add_points([(0.05, 0.02, 0)], np.full((1, 4), 90, np.uint8), link=False))
    for index, matrix in enumerate((Matrix.Translation((-0.4, 0, -2)),
                                    Matrix.Translation((0.4, 0.2, -2)) @ Matrix.Diagonal((-2, 3, 1, 1)))):
        empty = bpy.data.objects.new(f"instance {index}", None)
        empty.instance_type, empty.instance_collection = 'COLLECTION', collection
        empty.matrix_world = matrix
        scene.collection.objects.link(empty)
    picture = render()
    wanted = {pixel(scene, (-0.35, 0.02, -2)), pixel(scene, (0.3, 0.26, -2))}
    check(drawn(picture) == wanted, f"{drawn(picture)} is not {wanted}")
    check(len(built.CACHE) >= 1 and "2 points" in stats_line(), f"statistics {stats_line()}")


def stats_line():
    import harness
    return harness.stats[-1]


def node_tree(obj, name):
    """A geometry node tree on an object, with a geometry in and out."""
    tree = bpy.data.node_groups.new(name, 'GeometryNodeTree')
    if hasattr(tree, "interface"):
        for direction in ('INPUT', 'OUTPUT'):
            tree.interface.new_socket("Geometry", in_out=direction, socket_type='NodeSocketGeometry')
    else:
        tree.inputs.new('NodeSocketGeometry', "Geometry")
        tree.outputs.new('NodeSocketGeometry', "Geometry")
    obj.modifiers.new(name, 'NODES').node_group = tree
    return tree


def mesh_to_points(obj):
    """Geometry nodes that turn an object's vertices into a point cloud."""
    tree = node_tree(obj, "to points")
    nodes = [tree.nodes.new(kind) for kind in ('NodeGroupInput', 'GeometryNodeMeshToPoints', 'NodeGroupOutput')]
    for first, second in zip(nodes, nodes[1:]):
        tree.links.new(first.outputs[0], second.inputs[0])


def test_geometry_nodes_points():
    scene = new_scene()
    points = grid()
    colors = np.full((12, 4), 150, np.uint8)
    obj = add_points(points, colors)
    mesh_to_points(obj)
    picture = render()
    check(drawn(picture) == {pixel(scene, point) for point in points}, "points of geometry nodes")
    check_close(picture["Combined"][pixel(scene, points[3])][:3], linear([150] * 3), 2e-6, "their colour")


def test_point_cloud_object():
    scene = new_scene()
    points = grid()
    obj = add_points(points, np.full((12, 4), 77, np.uint8))
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    try:
        bpy.ops.object.convert(target='POINTCLOUD')
    except (RuntimeError, TypeError) as error:
        raise Skip(f"this Blender makes no point cloud object: {error}") from None
    obj = bpy.context.view_layer.objects.active
    if obj.type != 'POINTCLOUD':
        raise Skip(f"this Blender converts to {obj.type}")
    picture = render()
    check(drawn(picture) == {pixel(scene, point) for point in points}, "points of the point cloud")
    check_close(picture["Combined"][pixel(scene, points[3])][:3], linear([77] * 3), 2e-6, "their colour")


def nodes_between(tree, first, last, *kinds):
    """New nodes, the geometry led through them one after another."""
    nodes = [tree.nodes.new(kind) for kind in kinds]
    for node in nodes:
        tree.links.new(first.outputs[0], next(one for one in node.inputs if one.type == 'GEOMETRY'))
        first = node
    tree.links.new(first.outputs[0], last.inputs[0])
    return nodes


def store(tree, node, name, kind, value):
    """Makes node store a point attribute: of another node's first output, or a value."""
    node.data_type, node.domain = kind, 'POINT'
    node.inputs["Name"].default_value = name
    socket = next(one for one in node.inputs if one.name == "Value" and one.enabled)
    if isinstance(value, bpy.types.Node):
        tree.links.new(value.outputs[0], socket)
    else:
        socket.default_value = value


def store_place_as_color(tree, node):
    """The attribute Col of each point: how far it lies from 0 along each axis."""
    place, size = tree.nodes.new('GeometryNodeInputPosition'), tree.nodes.new('ShaderNodeVectorMath')
    size.operation = 'ABSOLUTE'
    tree.links.new(place.outputs[0], size.inputs[0])
    store(tree, node, "Col", 'FLOAT_COLOR', size)


def check_places(scene, picture, places, colors, alpha, what):
    check(drawn(picture) == {pixel(scene, place) for place in places}, f"{what}: {len(drawn(picture))} pixels of {len(places)} points")
    for place, color in zip(places, colors):
        got = picture["Combined"][pixel(scene, place)]
        check_close(got[3], alpha, 2e-3, f"{what}: opacity at {place}")
        check_close(got[:3] / got[3], color, 2e-5, f"{what}: color at {place}")


def test_instances_of_geometry_nodes():
    """A point cloud that nodes make, with attributes that nodes store, twice: instances of it that nodes make, and an object's of a collection."""
    scene = new_scene()
    points = grid()
    obj = add_points(points, name="made")
    obj.patina.lighting, obj.patina.opacity_attribute = 'UNLIT', "faint"
    mesh_to_points(obj)
    tree = obj.modifiers[0].node_group
    made = next(node for node in tree.nodes if node.bl_idname == 'GeometryNodeMeshToPoints')
    out = next(node for node in tree.nodes if node.bl_idname == 'NodeGroupOutput')
    named = 'GeometryNodeStoreNamedAttribute'
    color, faint = nodes_between(tree, made, out, named, named)
    store_place_as_color(tree, color)
    store(tree, faint, "faint", 'FLOAT', 0.5)
    check_places(scene, render(), points, abs(points), 0.5, "made by nodes")

    line, copies = tree.nodes.new('GeometryNodeMeshLine'), tree.nodes.new('GeometryNodeInstanceOnPoints')
    line.inputs["Count"].default_value = 2
    line.inputs["Offset"].default_value = step = (0.05, -0.06, 0.0)
    for first, socket in ((line, copies.inputs["Points"]), (faint, copies.inputs["Instance"])):
        tree.links.new(first.outputs[0], socket)
    tree.links.new(copies.outputs[0], out.inputs[0])
    twice = np.concatenate([points, points + step])
    check_places(scene, render(), twice, np.tile(abs(points), (2, 1)), 0.5, "instances that nodes make")

    collection = bpy.data.collections.new("scan")
    scene.collection.objects.unlink(obj)
    collection.objects.link(obj)
    empty = bpy.data.objects.new("placed", None)
    empty.instance_type, empty.instance_collection = 'COLLECTION', collection
    empty.matrix_world = Matrix.Translation((-0.03, 0.02, 0.0))
    scene.collection.objects.link(empty)
    check_places(scene, render(), twice + (-0.03, 0.02, 0.0), np.tile(abs(points), (2, 1)), 0.5, "a collection's instance of instances")


def test_nodes_on_point_clouds():
    """An object that is a point cloud, with nodes on it: what they move and store counts, and a frame later what they make then."""
    scene = new_scene()
    points = grid()
    if hasattr(bpy.types.PointCloud, "resize"):  # Blender after 5.0
        cloud = bpy.data.pointclouds.new("cloud")
        cloud.resize(len(points))
        cloud.attributes["position"].data.foreach_set("vector", points.astype(np.float32).reshape(-1))
        obj = bpy.data.objects.new("cloud", cloud)
        scene.collection.objects.link(obj)
    else:
        obj = add_points(points)
        bpy.context.view_layer.objects.active = obj
        obj.select_set(True)
        try:
            bpy.ops.object.convert(target='POINTCLOUD')
        except (RuntimeError, TypeError) as error:
            raise Skip(f"this Blender makes no point cloud object: {error}") from None
        obj = bpy.context.view_layer.objects.active
    check(obj.type == 'POINTCLOUD', f"the object is {obj.type}")
    obj.patina.lighting = 'UNLIT'
    mesh_to_points(obj)
    tree = obj.modifiers[0].node_group
    first, out = (next(node for node in tree.nodes if node.bl_idname == f'NodeGroup{end}put') for end in ("In", "Out"))
    color, move = nodes_between(tree, first, out, 'GeometryNodeStoreNamedAttribute', 'GeometryNodeSetPosition')
    store_place_as_color(tree, color)
    move.inputs["Offset"].default_value = step = (0.04, 0.03, 0.0)
    check_places(scene, render(), points + step, abs(points), 1.0, "moved by nodes")
    move.inputs["Offset"].driver_add("default_value", 0).driver.expression = "frame * 0.01"
    scene.frame_set(7)
    check_places(scene, render(), points + (0.07, 0.03, 0.0), abs(points), 1.0, "at another frame")


def test_meshes_with_faces_are_named():
    new_scene().patina.meshes = 'OFF'
    mesh = bpy.data.meshes.new("triangle")
    mesh.from_pydata([(0, 0, -2), (1, 0, -2), (0, 1, -2)], [], [(0, 1, 2)])
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("triangle", mesh))
    check(not drawn(render()), "nothing drawn")
    texts = " ".join(message for _, message in reports)
    check("no visible object has points" in texts and "1 mesh object with faces" in texts, texts)


def test_invalid_positions():
    scene = new_scene()
    place = (0.01, 0.02, -2)
    add_points([place, (float("nan"), 0, -2), (float("inf"), 0, -2)])
    check(drawn(render()) == {pixel(scene, place)}, "only the finite point")
    check(any("2 points without a finite position" in message for _, message in reports), f"reports {reports}")


def test_cache():
    """Unchanged points are not built again; changed ones are; another file empties the cache."""
    new_scene()
    built.CACHE.clear()
    obj = add_points(*sphere(500))
    builds = []
    original = built.native.Cloud

    class Counting(original):
        @classmethod
        def start(cls, *arguments, **named):
            builds.append(1)
            return original.start(*arguments, **named)

    built.native.Cloud = Counting
    try:
        first = render()["Combined"]
        second = render()["Combined"]
        check(len(builds) == 1, f"{len(builds)} builds for two renders")
        check(np.array_equal(first, second), "two renders differ")
        obj.location.x = 0.3
        render()
        check(len(builds) == 1, "moving an object rebuilt its cloud")
        move(obj, 7, points_of(obj)[7] + (0.5, 0.0, 0.0))
        render()
        check(len(builds) == 2, "changed points were not rebuilt")
    finally:
        built.native.Cloud = original
    check(patina._forget in bpy.app.handlers.load_pre, "the load_pre handler")
    patina._forget()
    check(len(built.CACHE) == 0, "the cache is empty for another file")
