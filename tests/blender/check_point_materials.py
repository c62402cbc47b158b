# SPDX-License-Identifier: GPL-3.0-or-later
"""Node trees of materials on points: evaluated for each point, as colors and opacities."""

import bpy
import numpy as np
from check_color import write_las
from check_points import grid, pixel
from harness import SCRATCH, Skip, add_points, check, check_close, new_scene, render, reports, saved
from mathutils import Euler
from patina import point_data
from patina.sync.points import attributes, clouds, coloring, node_colors, taking


class Tree:
    """The node tree of a new material on an object, whose Principled BSDF is `surface`."""

    def __init__(self, obj, name="nodes"):
        self.material = bpy.data.materials.new(name)
        if bpy.app.version < (5, 0, 0):
            self.material.use_nodes = True
        self.tree = self.material.node_tree
        self.surface = self.tree.nodes["Principled BSDF"]
        obj.data.materials.append(self.material)

    def node(self, kind, properties=None, **values):
        """values: of inputs by name with _ for a space, or by number as _0; a socket is linked. Skips the test where there is no such node."""
        try:
            node = self.tree.nodes.new(kind)
        except RuntimeError:
            raise Skip(f"this Blender has no {kind}") from None
        for name, value in (properties or {}).items():
            setattr(node, name, value)
        for name, value in values.items():
            socket = node.inputs[int(name[1:])] if name[0] == "_" else next(
                one for one in node.inputs if one.name == name.replace("_", " ") and one.enabled)
            self.set(socket, value)
        return node

    def set(self, socket, value):
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        else:
            socket.default_value = value

    def attribute(self, name, output="Fac"):
        node = self.node('ShaderNodeAttribute', {"attribute_name": name})
        return next(one for one in node.outputs if one.name == output or output == "Fac" and one.name == "Factor")

    def color(self, socket):
        self.set(self.surface.inputs["Base Color"], socket)


def numbered(name="value"):
    """(scene, points, object, values): points without colors, with an attribute from 0 to 1."""
    scene = new_scene()
    points = grid()
    obj = add_points(points)
    values = np.linspace(0, 1, 12).astype(np.float32)
    obj.data.attributes.new(name, 'FLOAT', 'POINT').data.foreach_set("value", values)
    obj.patina.lighting = 'UNLIT'
    return scene, points, obj, values


def evaluated(obj):
    """(n, 3): the colors of the object as renders take them, and the notices."""
    notices, depsgraph = [], bpy.context.evaluated_depsgraph_get()
    found = obj.evaluated_get(depsgraph)
    check(node_colors.used(found), "nodes are used")
    with attributes.readable(found) as data:
        count = len(points_data(data))
        colors, opacities = node_colors.read(found, data, attributes.positions(data, count), attributes.normals(data, count, ""),
                                             notices, lambda: None)
    return colors, opacities, notices


def points_data(data):
    return data.vertices if isinstance(data, bpy.types.Mesh) else data.points


def check_pixels(scene, points, wanted, what, tolerance=1e-5):
    picture = render()["Combined"]
    for number, point in enumerate(points):
        check_close(picture[pixel(scene, point)][:3], wanted[number], tolerance, f"{what}, point {number}")


def ramp_of(tree, factor):
    """Red to blue, with a green stop at 0.25."""
    ramp = tree.node('ShaderNodeValToRGB', _0=factor)
    elements = ramp.color_ramp.elements
    elements[0].color, elements[1].color = (0.8, 0.1, 0.0, 1), (0.0, 0.2, 0.9, 1)
    elements.new(0.25).color = (0.1, 0.7, 0.1, 1)
    return ramp


def ramp_at(values):
    stops = np.array([(0.8, 0.1, 0.0), (0.1, 0.7, 0.1), (0.0, 0.2, 0.9)])
    return np.stack([np.interp(values, (0, 0.25, 1), channel) for channel in stops.T], 1)


def test_attribute_ramp_color():
    """Attribute, Color Ramp, Base Color: each point has its color, automatically. A changed ramp counts in the next image."""
    scene, points, obj, values = numbered()
    tree = Tree(obj)
    ramp = ramp_of(tree, tree.attribute("value"))
    tree.color(ramp.outputs["Color"])
    check_pixels(scene, points, ramp_at(values), "ramp")
    check(not any("cannot be evaluated" in text for _, text in reports), f"{reports}")
    check(coloring.current(obj) == "Material", f"Color By shows {coloring.current(obj)}")
    kept = len(node_colors._kept)
    render()
    check(len(node_colors._kept) == kept, "an unchanged tree is not evaluated again")
    ramp.color_ramp.interpolation = 'CONSTANT'
    wanted = np.array([(0.8, 0.1, 0.0), (0.1, 0.7, 0.1), (0.0, 0.2, 0.9)])[np.digitize(values, (0.25, 1.0))]
    check_pixels(scene, points, wanted, "constant ramp")
    obj.patina.lighting = 'AUTO'
    check(render()["Combined"][pixel(scene, points[0])][0] < 0.79, "a Principled BSDF is lit")


def test_own_colors_come_first():
    """A cloud with colors keeps them until Material is chosen; One Color is One Color."""
    scene = new_scene()
    points = grid()
    colors = np.random.default_rng(2).uniform(0, 1, (12, 4)).astype(np.float32)
    obj = add_points(points, colors)
    tree = Tree(obj)
    tree.color(tree.node('ShaderNodeInvert', Color=tree.attribute("Col", "Color")).outputs[0])
    obj.patina.lighting = 'UNLIT'
    check_pixels(scene, points, colors[:, :3], "own colors")
    bpy.context.view_layer.objects.active = obj
    check("Material" in [choice.label for choice in coloring.choices(obj)], "Material is listed")
    check(bpy.ops.object.patina_color_by(choice="Material") == {'FINISHED'}, "chosen")
    check_pixels(scene, points, 1 - colors[:, :3], "inverted")
    obj.patina.colors.source = 'FIXED'
    check_pixels(scene, points, [tuple(obj.patina.color)] * 12, "one color")


def test_position_math_mix():
    """World positions: they follow the object. Mix by a number, in its new form and its old one."""
    scene, points, obj, _ = numbered()
    tree = Tree(obj)
    position = tree.node('ShaderNodeNewGeometry').outputs["Position"]
    x = tree.node('ShaderNodeSeparateXYZ', _0=position).outputs["X"]
    share = tree.node('ShaderNodeMath', {"operation": 'MULTIPLY_ADD'}, _0=x, _1=0.5, _2=0.5).outputs[0]
    a, b = np.array((0.9, 0.2, 0.1)), np.array((0.1, 0.3, 0.8))
    mixed = tree.node('ShaderNodeMix', {"data_type": 'RGBA', "blend_type": 'MIX'}, Factor=share, A=(*a, 1), B=(*b, 1))
    tree.color(next(one for one in mixed.outputs if one.enabled))

    def wanted(moved):
        t = (0.5 * (points[:, :1] + moved) + 0.5).clip(0, 1)
        return a * (1 - t) + b * t

    check_pixels(scene, points, wanted(0), "at first")
    obj.location.x = 0.1
    check_pixels(scene, points + [0.1, 0, 0], wanted(0.1), "moved")
    obj.location.x = 0.0
    trusted = taking.Trusted()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    clouds.collect(depsgraph, trusted.take([]), [])
    clouds.collect(depsgraph, trusted.take([]), [])
    check(trusted.reads == 1, "a viewport reads once")
    try:
        old = tree.node('ShaderNodeMixRGB', {"blend_type": 'SCREEN'}, _0=share, _1=(*a, 1), _2=(*b, 1))
    except Skip:
        return
    tree.color(old.outputs[0])
    t = (0.5 * points[:, :1] + 0.5).clip(0, 1)
    check_pixels(scene, points, a * (1 - t) + (1 - (1 - a) * (1 - b)) * t, "screen")
    trusted.forget({("Material", tree.material.name_full)})
    clouds.collect(bpy.context.evaluated_depsgraph_get(), trusted.take([]), [])
    check(trusted.reads == 2, "and again after the material changed")


def test_what_cannot_be_evaluated():
    """It is named once; its default color counts. So is an attribute that is missing."""
    scene, points, obj, values = numbered()
    tree = Tree(obj, "rust")
    occluded = tree.node('ShaderNodeAmbientOcclusion')
    mix = tree.node('ShaderNodeMix', {"data_type": 'RGBA', "blend_type": 'MULTIPLY'}, Factor=1.0,
                    A=tree.attribute("value", "Color"), B=(0.5, 0.25, 1.0, 1))
    tree.set(next(one for one in mix.inputs if one.name == "B" and one.enabled), occluded.outputs["Color"])
    tree.color(next(one for one in mix.outputs if one.enabled))
    said = f"Material '{tree.material.name}': the node 'Ambient Occlusion' (Ambient Occlusion) cannot be evaluated per point. Its default color is used."
    check_pixels(scene, points, values[:, None] * np.array((0.5, 0.25, 1.0)), "the socket's value")
    check(sum(said in text for _, text in reports) == 1, f"{reports}")
    check(node_colors.unknown_of(obj, tree.material) == said, node_colors.unknown_of(obj, tree.material))
    add_points(points, name="second").data.materials.append(tree.material)
    notices = []
    clouds.collect(bpy.context.evaluated_depsgraph_get(), taking.Trusted().take(notices), notices)
    check(notices.count(said) == 1, f"a viewport says it once for two objects: {notices}")
    bpy.data.objects.remove(bpy.data.objects["second"])
    tree.set(tree.surface.inputs["Alpha"], tree.attribute("nowhere"))
    render()
    check(any("has no point attribute 'nowhere'" in text for _, text in reports), f"{reports}")


def test_alpha():
    scene, points, obj, values = numbered()
    tree = Tree(obj)
    tree.surface.inputs["Base Color"].default_value = (0.2, 0.4, 0.6, 1)
    color = tree.node('ShaderNodeRGB').outputs[0]
    color.default_value = (0.2, 0.4, 0.6, 1)
    tree.color(color)
    tree.set(tree.surface.inputs["Alpha"], tree.attribute("value"))
    picture = render()["Combined"]
    for number in (3, 6, 11):
        check_close(picture[pixel(scene, points[number])][3], values[number], 0.004, "opacity")


def test_undo():
    scene, points, obj, values = numbered()
    tree = Tree(obj)
    ramp = ramp_of(tree, tree.attribute("value"))
    tree.color(ramp.outputs["Color"])
    name = tree.material.name
    bpy.ops.ed.undo_push(message="ramp")
    ramp.color_ramp.elements[0].color = (0.0, 0.0, 0.0, 1)
    bpy.ops.ed.undo_push(message="black")
    check(render()["Combined"][pixel(scene, points[0])][:3].max() < 1e-6, "black")
    bpy.ops.ed.undo()
    check(name in bpy.data.materials, "the material is there")
    check_close(render()["Combined"][pixel(bpy.context.scene, points[0])][:3], (0.8, 0.1, 0.0), 1e-5, "undone")


def test_animated():
    """A keyed value of a node counts frame by frame."""
    scene, points, obj, _ = numbered()
    tree = Tree(obj)
    value = tree.node('ShaderNodeValue')
    for frame, strength in ((1, 0.25), (2, 0.75)):
        value.outputs[0].default_value = strength
        value.outputs[0].keyframe_insert("default_value", frame=frame)
    tree.color(value.outputs[0])
    for frame, strength in ((1, 0.25), (2, 0.75), (1, 0.25)):
        scene.frame_set(frame)
        check_pixels(scene, points, [(strength,) * 3] * 12, f"frame {frame}")


def test_nodes_by_numbers():
    """Each kind of node beside what it means."""
    _, points, obj, v = numbered()
    paint = np.random.default_rng(5).uniform(0, 1, (12, 4)).astype(np.float32)
    obj.data.attributes.new("paint", 'FLOAT_VECTOR', 'POINT').data.foreach_set("vector", paint[:, :3].ravel())
    tree = Tree(obj)
    rgb, number = paint[:, :3].astype(np.float64), v.astype(np.float64)
    fac, color = tree.attribute("value"), tree.attribute("paint", "Vector")

    def gray(values):
        return np.repeat(np.asarray(values, np.float64).reshape(-1, 1), 3, 1)

    def check_node(what, socket, wanted, tolerance=2e-6):
        tree.color(socket)
        got, _, notices = evaluated(obj)
        check(not notices, f"{what}: {notices}")
        check_close(got, np.maximum(wanted, 0), tolerance, what)

    for kind, wanted in (("SUBTRACT", number - 0.3), ("DIVIDE", number / 0.3), ("POWER", number ** 0.3), ("MODULO", np.fmod(number, 0.3)),
                         ("PINGPONG", 0.3 - abs(number % 0.6 - 0.3)), ("SNAP", np.floor(number / 0.3) * 0.3), ("GREATER_THAN", number > 0.3),
                         ("WRAP", number % 0.3), ("ARCTAN2", np.arctan2(number, 0.3)), ("COSINE", np.cos(number))):
        check_node(kind, tree.node('ShaderNodeMath', {"operation": kind}, _0=fac, _1=0.3, _2=0.0).outputs[0], gray(wanted), 3e-6)
    for kind, wanted in (("CROSS_PRODUCT", np.cross(rgb, (0.2, 0.5, 0.9))), ("NORMALIZE", rgb / np.linalg.norm(rgb, axis=1)[:, None])):
        check_node(kind, tree.node('ShaderNodeVectorMath', {"operation": kind}, _0=color, _1=(0.2, 0.5, 0.9)).outputs[0], wanted)
    check_node("DISTANCE", tree.node('ShaderNodeVectorMath', {"operation": 'DISTANCE'}, _0=color, _1=(0.2, 0.5, 0.9)).outputs["Value"],
               gray(np.linalg.norm(rgb - (0.2, 0.5, 0.9), axis=1)))
    for kind, wanted in (("LINEAR", 2 + 3 * (number - 0.2) / 0.6), ("SMOOTHSTEP", 2 + 3 * (t := ((number - 0.2) / 0.6).clip(0, 1)) ** 2 * (3 - 2 * t))):
        mapped = tree.node('ShaderNodeMapRange', {"interpolation_type": kind, "clamp": False}, _0=fac, _1=0.2, _2=0.8, _3=2.0, _4=5.0)
        check_node(f"Map Range {kind}", mapped.outputs[0], gray(wanted), 1e-5)
    check_node("Clamp", tree.node('ShaderNodeClamp', _0=fac, _1=0.3, _2=0.6).outputs[0], gray(number.clip(0.3, 0.6)))
    turn = tree.node('ShaderNodeMapping', Vector=color, Location=(0.1, 0.2, 0.3), Rotation=(0.4, 0.5, 0.6), Scale=(1.0, 2.0, 3.0))
    matrix = np.array(Euler((0.4, 0.5, 0.6)).to_matrix())
    check_node("Mapping", turn.outputs[0], (rgb * (1, 2, 3)) @ matrix.T + (0.1, 0.2, 0.3), 1e-5)
    turn.vector_type = 'TEXTURE'
    check_node("Mapping as texture", turn.outputs[0], (rgb - (0.1, 0.2, 0.3)) @ matrix / (1, 2, 3), 1e-5)
    turn.vector_type = 'POINT'
    tree.set(turn.inputs["Rotation"], color)
    check_node("Mapping turned for each point", turn.outputs[0],
               [np.array(Euler(one).to_matrix()) @ (one * (1, 2, 3)) + (0.1, 0.2, 0.3) for one in rgb], 1e-5)
    checker = tree.node('ShaderNodeTexChecker', Vector=color, Color1=(1, 0, 0, 1), Color2=(0, 0, 1, 1), Scale=4.0)
    check_node("Checker", checker.outputs["Color"], np.where(np.floor(rgb * 4).sum(1)[:, None] % 2 == 1, (1, 0, 0), (0, 0, 1)))
    low, size = points.min(0), np.ptp(points, axis=0)
    generated = tree.node('ShaderNodeTexCoord').outputs["Generated"]
    check_node("Generated", generated, np.where(size > 0, (points - low) / np.where(size > 0, size, 1), 0.5), 1e-5)
    curves = tree.node('ShaderNodeRGBCurve', Color=color)
    check_node("RGB Curves left alone", curves.outputs[0], rgb, 1e-4)
    for old, new in (("RGB", "Color"), ("HSV", "Color")):
        names = [(f'ShaderNodeSeparate{new}', f'ShaderNodeCombine{new}', {"mode": old})]
        if hasattr(bpy.types, f'ShaderNodeSeparate{old}'):
            names.append((f'ShaderNodeSeparate{old}', f'ShaderNodeCombine{old}', {}))
        for apart, together, mode in names:
            first = tree.node(apart, mode, _0=color)
            second = tree.node(together, mode, **{f"_{at}": first.outputs[at] for at in range(3)})
            check_node(f"{apart} and {together} {old}", second.outputs[0], rgb)


def test_groups_cycles_and_reroutes():
    """A group's input and output, a reroute, a muted node; a chain whose nodes are each used twice; a cycle ends."""
    _, _, obj, v = numbered()
    tree = Tree(obj)
    group = bpy.data.node_groups.new("double", 'ShaderNodeTree')
    if hasattr(group, "interface"):
        group.interface.new_socket("In", in_out='INPUT', socket_type='NodeSocketFloat')
        group.interface.new_socket("Out", in_out='OUTPUT', socket_type='NodeSocketFloat')
    else:
        group.inputs.new('NodeSocketFloat', "In")
        group.outputs.new('NodeSocketFloat', "Out")
    begin, work, end = (group.nodes.new(kind) for kind in ('NodeGroupInput', 'ShaderNodeMath', 'NodeGroupOutput'))
    for at in range(2):
        group.links.new(begin.outputs[0], work.inputs[at])
    group.links.new(work.outputs[0], end.inputs[0])
    first = tree.node('ShaderNodeGroup', {"node_tree": group})
    reroute = tree.tree.nodes.new('NodeReroute')
    tree.set(reroute.inputs[0], tree.attribute("value"))
    tree.set(first.inputs[0], reroute.outputs[0])
    second = tree.node('ShaderNodeGroup', {"node_tree": group}, _0=first.outputs[0])
    tree.color(second.outputs[0])
    check_close(evaluated(obj)[0], np.repeat(4 * v[:, None], 3, 1), 1e-6, "a group in a group's chain")
    socket = second.outputs[0]
    for _ in range(40):
        socket = tree.node('ShaderNodeMath', {"operation": 'MAXIMUM'}, _0=socket, _1=socket).outputs[0]
    tree.color(socket)
    check_close(evaluated(obj)[0], np.repeat(4 * v[:, None], 3, 1), 1e-6, "a chain of 40 that uses each twice")
    one, two = (tree.node('ShaderNodeMath', {"operation": 'ADD'}, _0=0.25, _1=0.25) for _ in range(2))
    tree.set(one.inputs[0], two.outputs[0])
    tree.set(two.inputs[0], one.outputs[0])
    tree.color(one.outputs[0])
    check(np.isfinite(evaluated(obj)[0]).all(), "a cycle ends")


def test_images_by_position():
    """An image by a vector: nearest and linear, repeated and clipped."""
    _, points, obj, _ = numbered()
    tree = Tree(obj)
    image = bpy.data.images.new("tiles", 4, 4, float_buffer=True)
    image.colorspace_settings.name = 'Non-Color'
    pixels = np.random.default_rng(7).uniform(0, 1, (4, 4, 4)).astype(np.float32)
    pixels[..., 3] = 1
    image.pixels.foreach_set(pixels.ravel())
    place = tree.node('ShaderNodeTexCoord').outputs["Object"]
    texture = tree.node('ShaderNodeTexImage', {"image": image, "interpolation": 'Closest'}, Vector=place)
    tree.color(texture.outputs["Color"])
    column, row = (np.floor(points[:, axis] * 4).astype(int) for axis in (0, 1))
    check_close(evaluated(obj)[0], pixels[row % 4, column % 4, :3], 1e-6, "nearest, repeated")
    texture.extension = 'CLIP'
    inside = ((points[:, :2] >= 0) & (points[:, :2] <= 1)).all(1)
    check_close(evaluated(obj)[0], np.where(inside[:, None], pixels[row % 4, column % 4, :3], 0), 1e-6, "clipped")
    texture.extension, texture.interpolation = 'EXTEND', 'Linear'
    u, v = (points[:, axis].clip(0, 1) * 4 - 0.5 for axis in (0, 1))
    x, y = (np.floor(one).astype(int) for one in (u, v))
    at = [pixels[np.clip(y + j, 0, 3), np.clip(x + i, 0, 3), :3] for j in (0, 1) for i in (0, 1)]
    s, t = (u - x)[:, None], (v - y)[:, None]
    wanted = (at[0] * (1 - s) + at[1] * s) * (1 - t) + (at[2] * (1 - s) + at[3] * s) * t
    check_close(evaluated(obj)[0], wanted, 1e-5, "linear, extended")
    bpy.data.images.remove(image)


def test_shared_data():
    """Objects that share their points have materials of their own."""
    scene, points, obj, values = numbered()
    tree = Tree(obj, "first")
    tree.color(tree.attribute("value", "Color"))
    other = bpy.data.objects.new("other", obj.data)
    other.location.x, other.patina.lighting = 0.05, 'UNLIT'
    scene.collection.objects.link(other)
    second = Tree(obj, "second")
    obj.data.materials.pop()
    second.color(second.node('ShaderNodeInvert', Color=second.attribute("value", "Color")).outputs[0])
    other.material_slots[0].link = 'OBJECT'
    other.material_slots[0].material = second.material
    picture = render()["Combined"]
    check_close(picture[pixel(scene, points[9])][:3], (values[9],) * 3, 1e-5, "the first")
    check_close(picture[pixel(scene, points[9] + [0.05, 0, 0])][:3], (1 - values[9],) * 3, 1e-5, "the second")


def test_materials_by_index():
    """Each point has the material of its index; one without nodes has its plain color."""
    if not point_data.HAS_CLOUDS:
        raise Skip("point clouds are made of points from Blender 4.5 on")
    scene = new_scene()
    points = grid()
    data = point_data.new("points", points.astype(np.float32), True)
    values = np.linspace(0, 1, 12).astype(np.float32)
    data.attributes.new("value", 'FLOAT', 'POINT').data.foreach_set("value", values)
    data = point_data.finished(data, True)
    data.attributes.new("material_index", 'INT', 'POINT').data.foreach_set("value", np.arange(12, dtype=np.int32) % 3)
    obj = bpy.data.objects.new("points", data)
    scene.collection.objects.link(obj)
    obj.patina.lighting = 'UNLIT'
    first, second = Tree(obj, "first"), Tree(obj, "second")
    first.color(first.attribute("value", "Color"))
    second.surface.inputs["Base Color"].default_value = (0.1, 0.6, 0.2, 1)
    second.set(second.surface.inputs["Alpha"], second.attribute("value"))
    obj.data.materials.append(None)
    wanted = np.where(np.arange(12)[:, None] % 3 == 0, values[:, None], np.where(np.arange(12)[:, None] % 3 == 1, (0.1, 0.6, 0.2), 0.8))
    colors, opacities, notices = evaluated(obj)
    check_close(colors, wanted, 1e-6, "colors")
    check_close(opacities[:, 0], np.where(np.arange(12) % 3 == 1, values, 1), 1e-6, "opacities")
    check(not notices, f"{notices}")
    picture = render()["Combined"]
    for number in (0, 2, 3, 5, 6):
        check_close(picture[pixel(scene, points[number])][:3], wanted[number], 1e-5, f"point {number}")


def test_bad_values():
    """Positions and values that are no numbers end in finite colors; a cloud without points in nothing."""
    scene, points, obj, values = numbered()
    values[3:6] = np.nan, np.inf, -np.inf
    obj.data.attributes["value"].data.foreach_set("value", values)
    tree = Tree(obj)
    ramp = ramp_of(tree, tree.attribute("value"))
    checker = tree.node('ShaderNodeTexChecker', Vector=tree.attribute("value", "Vector"), Color1=ramp.outputs["Color"])
    logarithm = tree.node('ShaderNodeMath', {"operation": 'LOGARITHM'}, _0=tree.attribute("value"), _1=0.0)
    for socket in (ramp.outputs["Color"], checker.outputs["Color"], logarithm.outputs[0], tree.attribute("value", "Color")):
        tree.color(socket)
        check(np.isfinite(evaluated(obj)[0]).all(), f"{socket.node.name} is finite")
        check(np.isfinite(render()["Combined"]).all(), f"so is the image of {socket.node.name}")
    empty = add_points(np.zeros((0, 3)), name="empty")
    empty.data.materials.append(tree.material)
    render()
    check(not any("empty" in text for _, text in reports), f"{reports}")


def test_linked_files_keep_their_colors():
    new_scene()
    path = SCRATCH / "by_material.las"
    write_las(path)
    bpy.ops.import_scene.patina_points(filepath=str(path), files=[{"name": path.name}], directory=str(SCRATCH), link=True)
    obj = bpy.context.view_layer.objects.active
    tree = Tree(obj)
    tree.color(tree.attribute("intensity", "Color"))
    obj.patina.colors.source = 'OWN'
    render()
    check(not any("keeps the colors" in text for _, text in reports), f"{reports}")
    obj.patina.colors.source = 'MATERIAL'
    check(coloring.current(obj) == "Material", "shown")
    render()
    check(sum("keeps the colors of the file" in text for _, text in reports) == 1, f"{reports}")
    path.unlink()


SIDE = 48


def test_like_cycles():
    """What Cycles renders of the same nodes on a plane, whose pixels are the points."""
    scene = new_scene(SIDE, SIDE)
    if not hasattr(scene, "cycles"):
        raise Skip("this Blender has no Cycles")
    along = (np.arange(SIDE) + 0.5) / SIDE - 0.5
    x, y = np.meshgrid(along, along)
    obj = add_points(np.stack([x.ravel(), y.ravel(), np.full(x.size, -2.0)], 1))
    tree = Tree(obj)
    place = tree.node('ShaderNodeMapping', Vector=tree.node('ShaderNodeNewGeometry').outputs["Position"], Location=(0.13, 0.21, 0.3),
                      Rotation=(0.2, 0.3, 0.4), Scale=(2.0, 3.0, 1.0)).outputs[0]
    gradient = tree.node('ShaderNodeTexGradient', Vector=place)
    ramp = ramp_of(tree, gradient.outputs[1])
    ramp.color_ramp.interpolation = 'EASE'
    first = ramp.outputs[0]
    hue = tree.node('ShaderNodeHueSaturation', Color=first, Hue=0.7, Saturation=1.3)
    curves = tree.node('ShaderNodeRGBCurve', Color=hue.outputs[0])
    curves.mapping.curves[3].points.new(0.4, 0.7)
    curves.mapping.update()
    color = curves.outputs[0]
    found = [tree.node('ShaderNodeTexChecker', Vector=place, Scale=2.0).outputs["Color"], color,
             tree.node('ShaderNodeBrightContrast', _0=color, _1=0.1, _2=0.3).outputs[0],
             tree.node('ShaderNodeGamma', Color=color, Gamma=1.7).outputs[0],
             tree.node('ShaderNodeSeparateColor', {"mode": 'HSV'}, _0=color).outputs[0],
             tree.node('ShaderNodeMapRange', {"interpolation_type": 'STEPPED'}, _0=place, _1=-0.8, _2=0.9, _3=0.1, _4=0.8, _5=3.0).outputs[0]]
    found += [tree.node('ShaderNodeMath', {"operation": kind}, _0=place, _1=0.2, _2=third).outputs[0]
              for kind, third in (("PINGPONG", 0.0), ("SMOOTH_MIN", 0.3), ("SMOOTH_MAX", 0.3), ("WRAP", -0.1), ("COMPARE", 0.1), ("SNAP", 0.0))]
    for kind in ("ADD", "SUBTRACT", "MULTIPLY", "SCREEN", "DIVIDE", "DIFFERENCE", "DARKEN", "LIGHTEN"):
        mix = tree.node('ShaderNodeMix', {"data_type": 'RGBA', "blend_type": kind}, Factor=0.6, A=color, B=first)
        found.append(next(one for one in mix.outputs if one.enabled))
    ours = []
    for socket in found:
        tree.color(socket)
        colors, _, notices = evaluated(obj)
        check(not notices, f"{notices}")
        ours.append(colors)

    mesh = bpy.data.meshes.new("plane")
    mesh.from_pydata([(-0.5, -0.5, -2), (0.5, -0.5, -2), (0.5, 0.5, -2), (-0.5, 0.5, -2)], [], [(0, 1, 2, 3)])
    mesh.materials.append(tree.material)
    scene.collection.objects.link(bpy.data.objects.new("plane", mesh))
    obj.hide_render = True
    scene.camera.data.type, scene.camera.data.ortho_scale = 'ORTHO', 1.0
    scene.render.engine = 'CYCLES'
    scene.cycles.samples, scene.cycles.use_denoising = 1, False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = 'BOX', 0.01
    shine = tree.node('ShaderNodeEmission')
    tree.tree.links.new(shine.outputs[0], tree.tree.get_output_node('ALL').inputs[0])
    for socket, colors in zip(found, ours):
        tree.set(shine.inputs[0], socket)
        bpy.ops.render.render()
        off = np.abs(np.maximum(saved()[..., :3].reshape(-1, 3), 0) - colors)
        what = f"{socket.node.bl_label} {getattr(socket.node, 'operation', getattr(socket.node, 'blend_type', ''))}"
        check(np.quantile(off, 0.99) < 2e-3, f"{what}: {np.quantile(off, 0.99):.3g} off in 1 % of the pixels")
        check(np.median(off) < 5e-5, f"{what}: {np.median(off):.3g} off in half of the pixels")
