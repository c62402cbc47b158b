# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds that differ by direction: behind the points and as their light, beside Cycles' own pictures of the same scene."""

import bpy
import numpy as np
from check_lights import matt
from harness import Skip, add_points, check, check_close, new_scene, render, reports, saved, set_world, sphere
from mathutils import Euler

SIZE = 64


def sky(width=256, sun=0.0, at=(0.35, 0.7), wide=0.03):
    """A picture all around, (width / 2, width, 3): three colored lobes over a dark ground, and a sun of so much W/m2."""
    height = width // 2
    u, v = (np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height
    angle, up = np.meshgrid((0.5 - u) * 2 * np.pi, (v - 0.5) * np.pi)
    look = np.stack([np.cos(up) * np.cos(angle), np.cos(up) * np.sin(angle), np.sin(up)], 2)
    picture = np.full((height, width, 3), 0.05)
    for way, color in (((1, 0.2, 0.5), (1.5, 0.4, 0.1)), ((-0.6, 0.8, 0.2), (0.1, 0.9, 0.3)), ((0, -0.5, 1), (0.2, 0.4, 1.8))):
        way = np.array(way) / np.linalg.norm(way)
        picture += np.maximum(look @ way, 0)[..., None] ** 3 * color
    if sun:
        place = (0.5 - at[0]) * 2 * np.pi, (at[1] - 0.5) * np.pi
        toward = np.array([np.cos(place[1]) * np.cos(place[0]), np.cos(place[1]) * np.sin(place[0]), np.sin(place[1])])
        disc = look @ toward > np.cos(wide)
        picture[disc] += sun / (2 * np.pi * (1 - np.cos(wide))) * np.array((1.0, 0.9, 0.7))
    return picture.astype(np.float32)


def image_of(picture, name="sky"):
    height, width = picture.shape[:2]
    image = bpy.data.images.new(name, width, height, alpha=False, float_buffer=True)
    image.pixels.foreach_set(np.concatenate([picture, np.ones((height, width, 1))], 2).astype(np.float32).ravel())
    image.update()
    return image


def world_with(kind, turn=None, **properties):
    """A world whose Background takes its color from a node of this kind, by a Mapping where it is turned."""
    world = set_world((0.0, 0.0, 0.0))
    tree = world.node_tree
    node = tree.nodes.new(kind)
    for name, value in properties.items():
        setattr(node, name, value)
    tree.links.new(node.outputs[0], tree.nodes["Background"].inputs["Color"])
    if turn:
        mapping, place = tree.nodes.new('ShaderNodeMapping'), tree.nodes.new('ShaderNodeTexCoord')
        mapping.inputs["Rotation"].default_value = turn
        tree.links.new(place.outputs["Generated"], mapping.inputs["Vector"])
        tree.links.new(mapping.outputs[0], node.inputs["Vector"])
    return world


def cycles_scene(samples=64):
    try:
        scene = new_scene(SIZE, SIZE)
        scene.render.engine = 'CYCLES'
        scene.cycles.samples, scene.cycles.max_bounces, scene.cycles.device = samples, 0, 'CPU'
        scene.cycles.use_denoising, scene.cycles.pixel_filter_type = False, 'BOX'
    except (TypeError, AttributeError):
        raise Skip("this Blender has no Cycles") from None
    scene.render.film_transparent = False
    scene.camera.rotation_euler = Euler((1.2, 0.1, 0.7))
    return scene


def both(scene):
    """The picture of Cycles and of Patina. Cycles may show less than nothing, Patina does not."""
    pictures = []
    scene.world.cycles.sampling_method = 'NONE'  # of light, which takes longer than the picture
    for engine in ('CYCLES', 'PATINA'):
        scene.render.engine = engine
        bpy.context.view_layer.update()
        bpy.ops.render.render()
        pictures.append(np.maximum(saved(), 0))
    return pictures


def test_backgrounds_like_cycles():
    """What is behind the points, by every camera and kind of picture: beside Cycles' with a box filter."""
    scene = cycles_scene()
    image = image_of(sky())
    add_points([(0, 0, 1e5)])
    for world, camera in (
            (dict(kind='ShaderNodeTexEnvironment', image=image), 'PERSP'),
            (dict(kind='ShaderNodeTexEnvironment', image=image, turn=(0.3, -0.2, 1.1)), 'PERSP'),
            (dict(kind='ShaderNodeTexEnvironment', image=image), 'ORTHO'),
            (dict(kind='ShaderNodeTexEnvironment', image=image, turn=(0.0, 0.0, 2.0)), 'PANO'),
            (dict(kind='ShaderNodeTexEnvironment', image=image, projection='MIRROR_BALL'), 'PERSP'),
            (dict(kind='ShaderNodeTexGradient'), 'PERSP'),
            (dict(kind='ShaderNodeTexGradient', gradient_type='EASING', turn=(0.0, 1.2, 0.4)), 'PERSP'),
            (dict(kind='ShaderNodeTexGradient', gradient_type='RADIAL', turn=(0.0, 0.0, 2.5)), 'PERSP')):
        world_with(**world)
        scene.camera.data.type = camera
        scene.camera.data.lens = 20.0
        panorama = scene.camera.data if hasattr(scene.camera.data, "panorama_type") else scene.camera.data.cycles
        panorama.panorama_type = 'EQUIRECTANGULAR'
        cycles, own = both(scene)
        off = np.abs(cycles - own)
        what = f"{world}, {camera}: {off[..., :3].mean():.5f}, {off.max():.4f} at most of {cycles.max():.3f}"
        print("   ", what)
        check(np.ptp(cycles[..., 2]) > 0.1 or camera == 'ORTHO' or world['kind'] == 'ShaderNodeTexGradient', f"{what}: nothing seen")
        most = np.percentile(off, 99.5)  # at a mirror ball's back all of the ball's rim lies in one pixel
        check(off.mean() < 0.002 * cycles.max() and most < 0.01 * cycles.max(), what)
        check((own[..., 3] == 1).all(), f"{what}: alpha")


def ball(count=40000):
    positions, _, normals = sphere(count, 1.0, (0, 0, 0))
    points = add_points(positions, normals=normals)
    points.patina.lighting = 'LIT'
    bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64, radius=1.0)
    mesh = bpy.context.object
    bpy.ops.object.shade_smooth()
    mesh.data.materials.append(matt(0.8))
    return points, mesh


def test_light_like_cycles():
    """A ball of points under a picture all around is as bright as a ball under Cycles, wherever it is looked at."""
    scene = cycles_scene()
    points, mesh = ball()
    scene.camera.data.type, scene.camera.data.ortho_scale = 'ORTHO', 2.2
    scene.patina.fill = 'CLOSED'
    for name, picture, most, mean in (("lobes", sky(), 0.04, 0.008), ("sun", sky(sun=4.0), 0.08, 0.02)):
        world = world_with('ShaderNodeTexEnvironment', image=image_of(picture))
        if name == "lobes":
            world.cycles.sampling_method, world.cycles.sample_map_resolution = 'MANUAL', 256
        for way in ((1.2, 0.1, 0.7), (2.4, 0.0, 2.6)):
            scene.camera.rotation_euler = Euler(way)
            scene.camera.location = scene.camera.rotation_euler.to_matrix().col[2] * 5
            pictures = []
            for engine in ('CYCLES', 'PATINA'):
                scene.render.engine, mesh.hide_render, points.hide_render = engine, engine == 'PATINA', engine == 'CYCLES'
                bpy.context.view_layer.update()
                bpy.ops.render.render()
                pictures.append(saved()[..., :3])
            y, x = np.mgrid[:SIZE, :SIZE]
            on = np.hypot(x + 0.5 - SIZE / 2, y + 0.5 - SIZE / 2) < 0.4 * SIZE
            off, bright = np.abs(pictures[0] - pictures[1])[on], pictures[0][on].max()
            what = f"{name} from {way}: off by {off.mean() / bright:.4f}, {off.max() / bright:.4f} at most of {bright:.3f}"
            print("   ", what)
            check(off.mean() < mean * bright and np.percentile(off, 99.5) < most * bright, what)


def chain(tree, *steps):
    """Nodes one behind the other, from the world's direction to its color. A step: (kind, input, {property: value}, {input: value},
    output)."""
    socket = tree.nodes.new('ShaderNodeTexCoord').outputs["Generated"]
    for kind, into, properties, inputs, out in steps:
        node = tree.nodes.new(kind)
        for name, value in properties.items():
            setattr(node, name, value)
        for name, value in inputs.items():
            node.inputs[name].default_value = value
        tree.links.new(socket, node.inputs[into])
        socket = node.outputs[out]
    tree.links.new(socket, tree.nodes["Background"].inputs["Color"])
    return socket


def test_nodes_like_cycles():
    """Chains of nodes give what Cycles makes of them."""
    scene = cycles_scene(16)
    add_points([(0, 0, 1e5)])
    scene.camera.data.lens = 16.0
    mix = ('ShaderNodeMixRGB', 0)
    for name, steps in {
        "mapped texture": [('ShaderNodeMapping', 0, dict(vector_type='TEXTURE'), {1: (0.1, 0.2, 0.3), 2: (0.4, 0.1, 0.9), 3: (1.5, 0.7, 1)}, 0)],
        "mapped normal": [('ShaderNodeMapping', 0, dict(vector_type='NORMAL'), {"Rotation": (0.4, 0.1, 0.9), "Scale": (1.5, 0.7, 1)}, 0)],
        "mapped vector": [('ShaderNodeMapping', 0, dict(vector_type='VECTOR'), {"Rotation": (0.4, 0.1, 0.9), "Scale": (1.5, 0.7, 1)}, 0)],
        "height": [('ShaderNodeSeparateXYZ', 0, {}, {}, "Z"), ('ShaderNodeMath', 0, dict(operation='MULTIPLY_ADD'), {1: 0.5, 2: 0.5}, 0),
                   ('ShaderNodeGamma', 0, {}, {1: 2.2}, 0), ('ShaderNodeBrightContrast', 0, {}, {1: 0.1, 2: 0.3}, 0)],
        "powers": [('ShaderNodeSeparateXYZ', 0, {}, {}, "X"), ('ShaderNodeMath', 0, dict(operation='ABSOLUTE'), {}, 0),
                   ('ShaderNodeMath', 0, dict(operation='POWER'), {1: 3.0}, 0),
                   ('ShaderNodeMath', 0, dict(operation='DIVIDE', use_clamp=True), {1: 0.3}, 0), ('ShaderNodeInvert', 1, {}, {0: 0.7}, 0)],
        "colors": [('ShaderNodeVectorMath', 0, dict(operation='ABSOLUTE'), {}, 0), ('ShaderNodeHueSaturation', 4, {}, {0: 0.7, 1: 0.6, 2: 1.3}, 0),
                   (*mix, dict(blend_type='MULTIPLY'), {1: (0.9, 0.3, 0.4, 1), 2: (0.2, 0.9, 0.5, 1)}, 0)],
        "range": [('ShaderNodeNormal', 0, {}, {}, "Dot"), ('ShaderNodeMapRange', 0, {}, {1: -0.5, 2: 0.8, 3: 2.0, 4: 0.1}, 0),
                  ('ShaderNodeClamp', 0, {}, {1: 0.2, 2: 1.5}, 0)],
        "screen": [('ShaderNodeVectorMath', 0, dict(operation='CROSS_PRODUCT'), {1: (0.3, 0.4, 0.9)}, 0), ('ShaderNodeVectorMath', 0, dict(operation='NORMALIZE'), {}, 0),
                   ('ShaderNodeVectorMath', 0, dict(operation='MAXIMUM'), {1: (0.0, 0.1, 0.0)}, 0),
                   ('ShaderNodeMixRGB', 2, dict(blend_type='SCREEN'), {0: 0.6, 1: (0.5, 0.2, 0.1, 1)}, 0)],
    }.items():
        chain(set_world((0, 0, 0)).node_tree, *steps)
        cycles, own = both(scene)
        off = np.abs(cycles - own)
        print("   ", name, f"{off.mean():.5f}, {off.max():.4f} of {cycles[..., :3].max():.3f}")
        check(np.ptp(cycles[..., :3]) > 0.1, f"{name}: nothing seen")
        check(off.mean() < 0.002 and np.percentile(off, 99) < 0.02, f"{name}: off by {off.mean():.5f}, {off.max():.4f} at most")
        check(not reports or not any("nodes" in text for _, text in reports), f"{name}: {reports}")
    for name in ("Normal", "Object", "Reflection"):
        tree = set_world((0, 0, 0)).node_tree
        tree.links.new(tree.nodes.new('ShaderNodeTexCoord').outputs[name], tree.nodes["Background"].inputs["Color"])
        cycles, own = both(scene)
        off = np.abs(cycles - own)
        check(np.percentile(off, 99) < 0.02, f"{name}: off by {off.mean():.5f}, {off.max():.4f} at most")


def test_ramps_groups_and_mutes():
    """A ramp within a group, beside a node that is muted."""
    scene = cycles_scene(16)
    add_points([(0, 0, 1e5)])
    scene.camera.data.lens = 16.0
    for interpolation in ('LINEAR', 'EASE', 'CONSTANT'):
        group = bpy.data.node_groups.new("sky", 'ShaderNodeTree')
        inside, ramp = group.nodes.new('NodeGroupInput'), group.nodes.new('ShaderNodeValToRGB')
        if hasattr(group, "interface"):
            group.interface.new_socket("t", in_out='INPUT', socket_type='NodeSocketFloat')
            group.interface.new_socket("c", in_out='OUTPUT', socket_type='NodeSocketColor')
        else:
            group.inputs.new('NodeSocketFloat', "t")
            group.outputs.new('NodeSocketColor', "c")
        outside = group.nodes.new('NodeGroupOutput')
        ramp.color_ramp.interpolation = interpolation
        ramp.color_ramp.elements.new(0.4).color = (0.9, 0.3, 0.1, 1)
        ramp.color_ramp.elements[0].color = (0.1, 0.1, 0.6, 1)
        group.links.new(inside.outputs[0], ramp.inputs[0])
        group.links.new(ramp.outputs[0], outside.inputs[0])
        tree = set_world((0, 0, 0)).node_tree
        socket = chain(tree, ('ShaderNodeSeparateXYZ', 0, {}, {}, "Z"), ('ShaderNodeMath', 0, dict(operation='MULTIPLY_ADD'), {1: 0.5, 2: 0.5}, 0))
        node, gamma = tree.nodes.new('ShaderNodeGroup'), tree.nodes.new('ShaderNodeGamma')
        node.node_tree, gamma.mute = group, True
        gamma.inputs[1].default_value = 5.0
        tree.links.new(socket, node.inputs[0])
        tree.links.new(node.outputs[0], gamma.inputs[0])
        tree.links.new(gamma.outputs[0], tree.nodes["Background"].inputs["Color"])
        cycles, own = both(scene)
        off = np.abs(cycles - own)
        check(np.ptp(cycles[..., 0]) > 0.3 and off.mean() < 0.003, f"{interpolation}: off by {off.mean():.5f}, {off.max():.4f} at most")


def backdrop_scene():
    scene = new_scene(SIZE, 48)
    scene.render.film_transparent = False
    scene.camera.rotation_euler = Euler((1.2, 0.1, 0.7))
    world_with('ShaderNodeTexEnvironment', image=image_of(sky()))
    return scene


def test_seen_and_lighting_apart():
    """Light Path > Is Camera Ray: one world is seen, another lights."""
    scene = backdrop_scene()
    obj = add_points([(0, 0, -2)], normals=[(0, 0, 1)])
    obj.patina.lighting = 'LIT'
    scene.camera.rotation_euler = (0, 0, 0)
    tree = scene.world.node_tree
    path, mix, plain = (tree.nodes.new(f'ShaderNode{kind}') for kind in ('LightPath', 'MixShader', 'Background'))
    plain.inputs[0].default_value = (0.2, 0.4, 0.6, 1)
    tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    tree.links.new(tree.nodes["Background"].outputs[0], mix.inputs[1])
    tree.links.new(plain.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.nodes["World Output"].inputs[0])
    picture = render()["Combined"]
    check_close(picture[0, 0], (0.2, 0.4, 0.6, 1), 1e-5, "seen")
    point = picture[np.abs(picture[..., :3] - picture[0, 0, :3]).max(2) > 1e-3]
    check(len(point) == 1 and abs(point[0, 0] / point[0, 2] - 0.2 / 0.6) > 0.05, f"lit by what is seen: {point}")
    tree.links.new(tree.nodes["Background"].outputs[0], mix.inputs[2])
    tree.links.new(plain.outputs[0], mix.inputs[1])
    picture = render()["Combined"]
    check(np.ptp(picture[..., 0]) > 0.05, "the picture is seen")
    row, column = np.argwhere(render_depth() < 10)[0]
    check_close(picture[row, column, :3], 0.8 * np.array((0.2, 0.4, 0.6)), 1e-4, "lit from all around")


def render_depth():
    return render()["Depth"][..., 0]


def test_backdrop_in_parts():
    """A border's pixels, those of tiles, and those behind the edges of points are those of the whole."""
    scene = backdrop_scene()
    positions, colors, _ = sphere(3000, 1.0, (0, 0, 0))
    add_points(positions, colors)
    scene.camera.location = scene.camera.rotation_euler.to_matrix().col[2] * 4
    scene.patina.fill, scene.patina.antialias = 'CLOSED', 'LAYERS'
    whole = render()["Combined"]
    check((whole[..., 3] == 1).all(), "alpha")
    scene.render.film_transparent = True
    alone = render()["Combined"]
    scene.render.film_transparent = False
    check(alone[0, 0, 3] == 0 and 0.2 < (alone[..., 3] > 0.99).mean() < 0.8, "a transparent film has no world")
    edge = (alone[..., 3] > 0.1) & (alone[..., 3] < 0.9)
    behind = (whole[..., :3] - alone[..., :3])[edge] / (1 - alone[..., 3:])[edge]
    check(edge.any() and 0.02 < behind.min() and behind.max() < 2.5, f"behind edges: {behind.min():.3f} to {behind.max():.3f}")
    scene.patina.tile_size = 16
    check_close(render()["Combined"], whole, 0, "tiles")
    scene.patina.tile_size = 0
    scene.render.use_border, scene.render.use_crop_to_border = True, True
    scene.render.border_min_x, scene.render.border_max_x, scene.render.border_min_y, scene.render.border_max_y = 0.25, 0.75, 0.25, 0.75
    check_close(render()["Combined"], whole[12:36, 16:48], 0, "a border")


def test_holdout_before_a_picture():
    """Where something is held out, the world is too."""
    scene = backdrop_scene()
    whole = render()["Combined"]
    across = np.linspace(-0.3, 0.3, 120)
    x, y = (one.ravel() for one in np.meshgrid(across, across))
    turn = np.array(scene.camera.rotation_euler.to_matrix())
    obj = add_points(np.stack([x, y, np.full(x.size, -2.0)], 1) @ turn.T)
    obj.is_holdout = True
    picture = render()["Combined"]
    check(not picture[20:28, 28:36].any(), f"held out: {picture[24, 32]}")
    check_close(picture[:4], whole[:4], 1e-6, "the world beside it")


def test_sun_of_a_picture_casts_shadows():
    """What a photographed sky's sun cannot reach is dark: a plate under another one."""
    scene = backdrop_scene()
    across = np.linspace(-1, 1, 150)
    x, y = (one.ravel() for one in np.meshgrid(across, across))
    up = np.tile((0.0, 0.0, 1.0), (x.size, 1))
    for z, size in ((-3.0, 1.0), (-2.0, 0.4)):
        obj = add_points(np.stack([x * size, y * size, np.full(x.size, z)], 1), normals=up)
        obj.patina.lighting = 'LIT'
    scene.camera.rotation_euler, scene.camera.location = (0, 0, 0), (1.3, 0, 0)
    scene.camera.data.type, scene.camera.data.ortho_scale, scene.camera.data.shift_x = 'ORTHO', 4.0, -0.3
    world_with('ShaderNodeTexEnvironment', image=image_of(sky(512, sun=6.0, at=(0.5, 0.75), wide=0.02)))
    scene.patina.use_shadows = False
    lit = render()["Combined"]
    scene.patina.use_shadows = True
    shaded = render()["Combined"]
    lost = (lit - shaded)[..., 0] > 0.3
    # the sun stands at 45 degrees over +x: the upper plate's shadow lies a unit towards -x
    check(150 * 0.3 < lost.sum() < 400, f"{lost.sum()} pixels in shadow")
    check(lost[:, :SIZE // 2].sum() > 0.9 * lost.sum(), "away from the sun")


def test_what_is_not_known_is_named():
    """Once, by the artist's names; pictures that are missing are pink, as in Cycles."""
    backdrop_scene()
    world = world_with('ShaderNodeTexBrick')
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.1, 0.2, 0.3, 1)
    picture = render()["Combined"]
    check_close(picture[0, 0, :3], (0.1, 0.2, 0.3), 1e-6, "the socket's own color")
    check(sum("Brick Texture" in text for _, text in reports) == 1, f"{reports}")
    image = bpy.data.images.new("sky that is lost", 4, 4)
    image.source, image.filepath = 'FILE', "//nowhere.exr"
    world_with('ShaderNodeTexEnvironment', image=image)
    check_close(render()["Combined"][0, 0, :3], (1, 0, 1), 1e-6, "pink")
    check(any("'sky that is lost'" in text for _, text in reports), f"{reports}")


def test_a_changed_picture_is_read_again():
    scene = backdrop_scene()
    before = render()["Combined"]
    image = scene.world.node_tree.nodes["Environment Texture"].image
    image.pixels.foreach_set(np.ones(len(image.pixels), np.float32))
    image.update()
    after = render()["Combined"]
    check_close(after[..., :3], np.ones_like(after[..., :3]), 1e-5, "painted white")
    check(np.ptp(before[..., 0]) > 0.05, "it was not")
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.5
    check_close(render()["Combined"][..., :3], np.full((48, SIZE, 3), 0.5), 1e-5, "half as strong")


def test_baked_skies_like_cycles():
    """Nodes that are not known: a picture of them, rendered once, lights and lies behind as Cycles' own."""
    scene = cycles_scene()
    points, mesh = ball()
    tree = set_world((0, 0, 0)).node_tree
    node = tree.nodes.new('ShaderNodeTexSky')
    node.sky_type = next(kind for kind in ('NISHITA', 'MULTIPLE_SCATTERING') if kind in node.bl_rna.properties["sky_type"].enum_items)
    node.sun_elevation, node.sun_rotation, node.sun_intensity = 0.6, 0.4, 0.02
    tree.links.new(node.outputs[0], tree.nodes["Background"].inputs["Color"])
    tree.nodes["Background"].inputs["Strength"].default_value = 0.1
    before = len(bpy.data.scenes), len(bpy.data.objects), len(bpy.data.cameras)
    check(bpy.ops.world.patina_bake(width=512, samples=9) == {'FINISHED'}, "not baked")
    check((len(bpy.data.scenes), len(bpy.data.objects), len(bpy.data.cameras)) == before, "something is left behind")
    scene.camera.location, scene.patina.fill = scene.camera.rotation_euler.to_matrix().col[2] * 4, 'CLOSED'
    scene.camera.data.type, scene.camera.data.lens = 'PERSP', 30.0
    pictures = []
    for engine in ('CYCLES', 'PATINA'):
        scene.render.engine, mesh.hide_render, points.hide_render = engine, engine == 'PATINA', engine == 'CYCLES'
        pictures.append(render() and saved()[..., :3] if engine == 'PATINA' else cycles_picture())
    y, x = np.mgrid[:SIZE, :SIZE]
    radius = np.hypot(x + 0.5 - SIZE / 2, y + 0.5 - SIZE / 2)
    covered = SIZE * 30.0 / 36.0 / np.sqrt(15.0)
    off, bright = np.abs(pictures[0] - pictures[1]), np.percentile(pictures[0], 99)
    on, beside = off[radius < 0.8 * covered], off[radius > 1.1 * covered]
    print(f"    on the ball {on.mean() / bright:.4f}, beside it {beside.mean() / bright:.4f} of {bright:.3f}")
    check(on.mean() < 0.02 * bright and beside.mean() < 0.005 * bright, f"off by {on.mean() / bright:.4f}, {beside.mean() / bright:.4f}")
    check(not any("Sky Texture" in text for _, text in reports), f"{reports}")
    scene.world.patina.use_picture = False
    render()
    check(any("Bake World" in text for _, text in reports), f"{reports}")


def cycles_picture():
    bpy.context.view_layer.update()
    bpy.ops.render.render()
    return saved()[..., :3]
