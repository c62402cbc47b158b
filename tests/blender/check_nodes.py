# SPDX-License-Identifier: GPL-3.0-or-later
"""Point clouds that Geometry Nodes make: what they store by each name, instances turned and realized, points spread over faces or beside a
mesh. check_points and check_materials have their simpler kinds."""

import bpy
import numpy as np
from check_points import grid, node_tree, pixel, stats_line
from check_splats import size_of
from harness import Skip, add_points, check, check_close, drawn, linear, new_scene, render, reports
from mathutils import Matrix
from patina.sync.points import clouds, taking


class Nodes:
    """A tree on an object; its first node is the group's input."""

    def __init__(self, obj):
        self.tree = tree = node_tree(obj, "points")
        self.last, self._end = tree.nodes.new('NodeGroupInput'), tree.nodes.new('NodeGroupOutput')

    def node(self, kind, properties=None, **values):
        """Beside the chain. values: of inputs, by their names with _ for a space; a socket is linked."""
        node = self.tree.nodes.new(kind)
        for name, value in (properties or {}).items():
            setattr(node, name, value)
        for name, value in values.items():
            socket = next(one for one in node.inputs if one.name == name.replace("_", " ") and one.enabled)
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, socket)
            else:
                socket.default_value = value
        return node

    def then(self, kind, properties=None, **values):
        """Behind what there is, by its first input."""
        node = self.node(kind, properties, **values)
        self.tree.links.new(self.last.outputs[0], node.inputs[0])
        self.last = node
        return node

    def store(self, name, kind, value, domain='POINT'):
        """Store Named Attribute. value: a socket, or one for all points."""
        return self.then('GeometryNodeStoreNamedAttribute', {"data_type": kind, "domain": domain}, Name=name, Value=value)

    def index_below(self, count, low, high):
        """low where a point's number is less than count, else high."""
        index = self.node('GeometryNodeInputIndex').outputs[0]
        compared = self.node('FunctionNodeCompare', {"data_type": 'INT', "operation": 'LESS_THAN'}, A=index, B=count).outputs[0]
        return self.node('GeometryNodeSwitch', {"input_type": 'FLOAT' if isinstance(low, float) else 'RGBA'}, Switch=compared,
                         **{"True": low, "False": high}).outputs

    def end(self):
        self.tree.links.new(self.last.outputs[0], self._end.inputs[0])


def out(sockets):
    """The one that a node of several types has switched on."""
    return next(one for one in sockets if one.enabled)


RED, BLUE = (0.7, 0.1, 0.05, 1.0), (0.1, 0.2, 0.8, 1.0)


def test_nodes_attributes():
    """Colors, radii, opacities and numbers that nodes store on points: each counts, by its usual name or by the one that was chosen."""
    scene = new_scene()
    points = grid()
    obj = add_points(points)
    obj.patina.lighting = 'UNLIT'
    nodes = Nodes(obj)
    nodes.then('GeometryNodeMeshToPoints', Radius=0.05)
    stored = nodes.store("Col", 'FLOAT_COLOR', out(nodes.index_below(6, RED, BLUE)))
    nodes.store("width", 'FLOAT', out(nodes.index_below(6, 0.05, 0.1)))
    nodes.store("fade", 'FLOAT', out(nodes.index_below(3, 0.25, 1.0)))
    nodes.store("bytes", 'BYTE_COLOR', (0.2, 0.4, 0.6, 1.0))
    nodes.end()
    picture = render()["Combined"]
    check(drawn({"Combined": picture}) == {pixel(scene, point) for point in points}, "points alone where nobody asked for discs")
    for number, point in enumerate(points):
        check_close(picture[pixel(scene, point)][:3], (RED if number < 6 else BLUE)[:3], 1e-6, f"color of point {number}")
    obj.patina.opacity_attribute = "fade"
    picture = render()["Combined"]
    for number, point in enumerate(points):
        check_close(picture[pixel(scene, point)][3], 0.25 if number < 3 else 1, 0.003, f"opacity of point {number}")
    obj.patina.opacity_attribute, obj.patina.color_attribute = "", "bytes"
    shown = linear(np.rint(255 * encoded((0.2, 0.4, 0.6))))
    check_close(render()["Combined"][pixel(scene, points[8])][:3], shown, 2e-6, "one byte color for all points")
    obj.patina.color_attribute = ""

    scene.patina.surface = 'SPLATS'
    step = pixel(scene, points[0] + [1, 0, 0])[1] - pixel(scene, points[0])[1]

    def check_sizes(*radii):
        got = size_of(scene, points, render())
        wanted = np.pi * (step * np.repeat(radii, 6)) ** 2
        check(np.all(abs(got - wanted) <= 0.3 * wanted + 1), f"pixels {got}, not {wanted}")

    check_sizes(0.05, 0.05)  # the points' own
    obj.patina.radius_attribute = "width"
    check_sizes(0.05, 0.1)
    check_close(render()["Combined"][pixel(scene, points[0])][:3], RED[:3], 2e-4, "a disc's color")
    nodes.tree.links.remove(next(one for one in stored.inputs if one.name == "Value" and one.enabled).links[0])
    next(one for one in stored.inputs if one.name == "Value" and one.enabled).default_value = (0.0, 0.9, 0.0, 1.0)
    check_close(render()["Combined"][pixel(scene, points[0])][:3], (0, 0.9, 0), 2e-4, "nodes that changed")
    obj.patina.radius_attribute = "nowhere"
    render()
    check(any("no point attribute 'nowhere' to take as radius" in text for _, text in reports), f"reports {reports}")


def encoded(color):
    """Linear → sRGB from 0 to 1."""
    color = np.asarray(color, np.float64)
    return np.where(color <= 0.0031308, 12.92 * color, 1.055 * color ** (1 / 2.4) - 0.055)


# Points of a cloud to be instanced, and where.
SMALL = np.array([[0.0, 0.0, 0.0], [0.12, 0.0, 0.0], [0.0, 0.08, 0.0]])
PLACES = np.array([[-0.5, -0.3, -2.0], [0.45, -0.25, -2.0], [0.1, 0.3, -2.5]]) + [0.003, 0.007, 0.0]
TURNED = Matrix.Rotation(np.pi / 2, 4, 'Z') @ Matrix.Diagonal((2, 1, 1, 1))


def instanced(scene, realize=False, stored=()):
    """SMALL as a point cloud on each of PLACES, turned and stretched: (object, pixels by place)."""
    source = add_points(SMALL, np.array([[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255]], np.uint8), name="small", link=False)
    obj = add_points(PLACES, name="places")
    nodes = Nodes(obj)
    info = nodes.node('GeometryNodeObjectInfo')
    info.inputs["Object"].default_value = source
    scene.collection.objects.link(source)  # one that no scene holds is not evaluated
    source.hide_render = True
    cloud = nodes.node('GeometryNodeMeshToPoints', Mesh=info.outputs["Geometry"])
    nodes.then('GeometryNodeInstanceOnPoints', Instance=cloud.outputs[0], Rotation=(0.0, 0.0, np.pi / 2), Scale=(2.0, 1.0, 1.0))
    for name, kind, value in stored:
        nodes.store(name, kind, value, 'INSTANCE')
    if realize:
        nodes.then('GeometryNodeRealizeInstances')
    nodes.end()
    return obj, [[pixel(scene, place + np.array(TURNED.to_3x3()) @ point) for point in SMALL] for place in PLACES]


def test_nodes_instances():
    """Instances of a point cloud: each at its place, turned and stretched; one cloud for all of them; realized they look the same."""
    for realize in (False, True):
        scene = new_scene()
        obj, wanted = instanced(scene, realize)
        obj.patina.lighting = 'UNLIT'
        picture = render()
        check(drawn(picture) == {place for row in wanted for place in row}, f"realized {realize}: {drawn(picture)} is not {wanted}")
        for row in wanted:
            for number, place in enumerate(row):
                check_close(picture["Combined"][place][:3], np.eye(3)[number], 2e-6, f"realized {realize}: color {number}")
        items = [item for item in clouds.collect(bpy.context.evaluated_depsgraph_get(), taking.Trusted().take([]), []) if item.name != "small"]
        check(len(items) == (1 if realize else 3) and len({id(item.cloud) for item in items}) == 1, f"realized {realize}: {len(items)} clouds")
        obj.location.x += 0.1
        moved = {pixel(scene, place + np.array(TURNED.to_3x3()) @ point + [0.1, 0, 0]) for place in PLACES for point in SMALL}
        check(drawn(render()) == moved, f"realized {realize}: they go with their object")


def test_nodes_attributes_of_instances():
    """Stored on instances and realized they are the points' own."""
    scene = new_scene()
    obj, wanted = instanced(scene, realize=True, stored=[("tint", 'FLOAT_COLOR', RED), ("fade", 'FLOAT', 0.5)])
    obj.patina.lighting, obj.patina.color_attribute, obj.patina.opacity_attribute = 'UNLIT', "tint", "fade"
    pixels = render()["Combined"]
    for place in (place for row in wanted for place in row):
        check_close(pixels[place], [*(np.array(RED[:3]) * pixels[place][3]), pixels[place][3]], 2e-3, "color and opacity")
        check_close(pixels[place][3], 0.5, 3e-3, "opacity")


def test_nodes_on_faces():
    """Distribute Points on Faces: points on a mesh's faces and nowhere else, lit by the normals that nodes store."""
    scene = new_scene(96, 72)
    mesh = bpy.data.meshes.new("plane")
    mesh.from_pydata([(-0.5, -0.3, -2), (0.5, -0.3, -2), (0.5, 0.3, -2), (-0.5, 0.3, -2)], [], [(0, 1, 2, 3)])
    obj = bpy.data.objects.new("plane", mesh)
    scene.collection.objects.link(obj)
    nodes = Nodes(obj)
    spread = nodes.then('GeometryNodeDistributePointsOnFaces', Density=20000.0)
    nodes.store("Normal", 'FLOAT_VECTOR', spread.outputs["Normal"])
    nodes.end()
    picture = render()
    low, high = (pixel(scene, corner) for corner in ((-0.5, -0.3, -2), (0.5, 0.3, -2)))
    rows, columns = np.array(sorted(drawn(picture))).T
    check(low[0] <= rows.min() and rows.max() <= high[0] and low[1] <= columns.min() and columns.max() <= high[1], "beyond the face")
    check(len(rows) > 0.95 * (high[0] - low[0]) * (high[1] - low[1]), f"{len(rows)} pixels")
    check_close(picture["Normal"][rows, columns], (0, 0, 1), 1e-2, "normals")
    check("points" in stats_line() and not any("not drawn" in text for _, text in reports), f"{reports}")


HERE = (0.303, 0.207, -2.0)


def test_nodes_made_of_nothing():
    """Points that no mesh began with; with a mesh beside them in one object, each is drawn as what it is."""
    scene = new_scene(96, 72)
    obj = add_points(np.array([[0.0, 0.0, -2.0]]))
    nodes = Nodes(obj)
    try:
        made = nodes.node('GeometryNodePoints', Count=4, Position=HERE, Radius=0.05)
    except RuntimeError:
        raise Skip("this Blender has no node Points") from None
    plate = nodes.node('GeometryNodeMeshGrid', Size_X=0.2, Size_Y=0.2)
    placed = nodes.node('GeometryNodeTransform', Geometry=plate.outputs[0], Translation=(-0.4, 0.0, -2.0))
    join = nodes.node('GeometryNodeJoinGeometry')
    for socket in (made.outputs[0], placed.outputs[0]):
        nodes.tree.links.new(socket, join.inputs[0])
    nodes.last = join
    nodes.end()
    scene.patina.meshes = 'OFF'
    picture = render()
    check(drawn(picture) == {pixel(scene, HERE)}, f"the points {drawn(picture)}")
    check(any("mesh object with faces not drawn" in text for _, text in reports), f"the mesh is told: {reports}")
    scene.patina.meshes = 'TRIANGLES'
    found = drawn(render())
    left = {place for place in found if place[1] < 48}
    side = pixel(scene, (1, 0, -2))[1] - pixel(scene, (0, 0, -2))[1]
    check(found - left == {pixel(scene, HERE)} and abs(len(left) - (0.2 * side) ** 2) < side, f"{len(left)} pixels of the mesh")
