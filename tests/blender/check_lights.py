# SPDX-License-Identifier: GPL-3.0-or-later
"""Suns, points and the world, in Blender's units: albedo * E / pi * cos; a point light gives E = P / (4 pi d^2)."""

import bpy
import numpy as np
from check_points import pixel
from harness import Skip, add_light, add_points, check, check_close, linear, new_scene, render, reports, saved, set_world
from mathutils import Vector
from patina.operators import add_light as sun_operator

PIXEL = 2.0 * 36 / 50 / 64  # world size of one at the point, default camera
POINT = (0.5 * PIXEL, 1.5 * PIXEL, -2.0)  # at a pixel's centre, where deferred shading puts it
NORMAL = np.array((0.48, 0.36, 0.8))
ALBEDO = (200, 120, 60)


def lit_point(**properties):
    scene = new_scene()
    obj = add_points([POINT], np.array([(*ALBEDO, 255)], np.uint8), [NORMAL])
    obj.patina.lighting = 'LIT'
    for name, value in properties.items():
        setattr(obj.patina, name, value)
    return scene


def shade(scene):
    return render()["Combined"][pixel(scene, POINT)][:3]


def test_sun():
    for direction in ((0, 0, -1), (-1, -0.5, -1), (0.3, 0.2, -0.4)):
        scene = lit_point()
        add_light('SUN', 2.5, direction=direction, color=(1.0, 0.5, 0.25))
        toward = -np.array(direction) / np.linalg.norm(direction)
        wanted = linear(ALBEDO) * 2.5 / np.pi * max(NORMAL @ toward, 0) * (1.0, 0.5, 0.25)
        check_close(shade(scene), wanted, 2e-3 * wanted.max(), f"sun from {toward}")


def test_point_light():
    for place in ((0.5, 0.4, -1.0), (2.0, -1.0, 3.0)):
        scene = lit_point()
        add_light('POINT', 120.0, place, color=(0.2, 1.0, 0.6))
        toward = np.array(place) - POINT
        distance = np.linalg.norm(toward)
        cosine = NORMAL @ toward / distance
        wanted = linear(ALBEDO) / np.pi * cosine * 120.0 / (4 * np.pi * distance ** 2) * (0.2, 1.0, 0.6)
        check_close(shade(scene), wanted, 2e-3 * wanted.max(), f"point light at {place}")


def test_lights_add_up():
    scene = lit_point()
    add_light('SUN', 1.0, direction=(0, 0, -1))
    first = shade(scene)
    add_light('SUN', 2.0, direction=(0, 0, -1))
    check_close(shade(scene), 3 * first, 1e-5, "three times the light")


def test_headlight():
    """It shines the way the camera looks, beside the other lights; a panorama has none."""
    scene = lit_point()
    scene.patina.studio.use_headlight = True
    scene.patina.studio.headlight = 2.0
    once = linear(ALBEDO) * 2.0 / np.pi
    check_close(shade(scene), once * NORMAL[2], 2e-3 * once.max(), "from the front")
    add_light('SUN', 2.0, direction=-NORMAL)
    check_close(shade(scene), once * (1 + NORMAL[2]), 4e-3 * once.max(), "beside a sun")
    bpy.data.objects.remove(bpy.data.objects["light"])
    scene.camera.rotation_mode = 'QUATERNION'
    scene.camera.rotation_quaternion = Vector(-NORMAL).to_track_quat('-Z', 'Y')
    scene.camera.location = np.array(POINT) + 2 * NORMAL
    picture = render()["Combined"]
    row, column = np.argwhere(picture[..., 3] > 0)[0]
    check_close(picture[row, column, :3], once, 4e-3 * once.max(), "along the normal")
    for place in ((0, 0), (1, 0), (0, 1)):  # 32 lights are the most
        for _ in range(11):
            add_light('SUN', 0.1, location=(*place, 0))
    render()
    check(any("only the 31 strongest of 33 lights" in text for _, text in reports), f"{reports}")
    scene.camera.data.type = 'PANO'
    render()
    check(any("headlight is off" in text for _, text in reports), f"{reports}")


def test_points_without_light():
    """Lit points in a black scene: a warning names them, and Add Light shines on them from the camera's upper left."""
    scene = lit_point()
    scene.world = None
    check(sun_operator.is_dark(scene), "dark")
    check_close(shade(scene), (0, 0, 0), 1e-6, "black")
    check(any("no light reaches 'points'" in text for _, text in reports), f"{reports}")
    set_world((0, 0, 0))
    check(sun_operator.is_dark(scene), "dark under a black world")
    set_world((0.1, 0.1, 0.1))
    check(not sun_operator.is_dark(scene), "light under a gray world")
    scene.world = None
    check(bpy.ops.scene.patina_add_light() == {'FINISHED'} and not sun_operator.is_dark(scene), "Add Light")
    bpy.context.view_layer.update()
    sun = next(obj for obj in scene.objects if obj.type == 'LIGHT')
    travels = -sun.matrix_world.col[2].xyz  # the camera looks down -z, x to the right, y up
    check(travels.x > 0.3 and travels.y < -0.3 and travels.z < -0.3, f"shines along {travels}")
    check(max(shade(scene)) > 0.02, "still black")
    check(not any("no light" in text for _, text in reports), f"{reports}")


def test_light_from_behind():
    scene = lit_point()
    add_light('SUN', 5.0, direction=(0, 0, 1))
    check_close(shade(scene), (0, 0, 0), 1e-6, "light from behind")


def test_lighting_modes():
    """Points with colours are unlit unless asked, points without are lit."""
    scene = lit_point(lighting='AUTO')
    add_light('SUN', 1.0)
    check_close(shade(scene), linear(ALBEDO), 2e-6, "automatic, with colour")
    scene = new_scene()
    obj = add_points([POINT], normals=[NORMAL])
    add_light('SUN', np.pi)
    check_close(shade(scene), np.full(3, 0.8 * 0.8), 5e-3, "automatic, without colour")
    obj.patina.lighting = 'UNLIT'
    check_close(shade(scene), np.full(3, 0.8), 5e-3, "unlit, without colour")


def test_ambient():
    scene = lit_point(ambient=0.5)
    set_world((0.2, 0.4, 0.8))
    wanted = linear(ALBEDO) * 0.5 * np.array((0.2, 0.4, 0.8))
    check_close(shade(scene), wanted, 2e-3 * wanted.max(), "ambient")


def test_specular():
    scene = lit_point(diffuse=0.0, ambient=0.0, specular=1.0, shininess=8)
    mirrored = 2 * NORMAL * NORMAL[2] - (0, 0, 1)
    add_light('SUN', 1.0, direction=-mirrored)
    bright = shade(scene)
    scene.objects["points"].patina.shininess = 200
    check(bright.min() > 0, f"highlight {bright}")


def test_dark_light_is_no_default():
    scene = lit_point()
    add_light('SUN', 0.0)
    add_light('POINT', 10.0, color=(0, 0, 0))
    check_close(shade(scene), (0, 0, 0), 1e-6, "lights without power or colour")


def test_spot():
    """Smoothstep from the cone's edge inwards; outside nothing."""
    place = np.array((0.5, 0.4, -0.5))
    toward = place - POINT
    distance = np.linalg.norm(toward)
    for tilt in (0.0, 0.3, 0.45, 0.6):
        aim = -toward / distance
        aside = np.cross(aim, (0, 0, 1))
        aim = np.cos(tilt) * aim + np.sin(tilt) * aside / np.linalg.norm(aside)
        scene = lit_point()
        light = add_light('SPOT', 80.0, place, direction=aim).data
        light.spot_size, light.spot_blend = 1.0, 0.4
        edge = np.cos(0.5)
        x = np.clip((np.cos(tilt) - edge) / ((1 - edge) * 0.4), 0, 1)
        cosine = NORMAL @ toward / distance
        wanted = linear(ALBEDO) / np.pi * cosine * 80.0 / (4 * np.pi * distance ** 2) * x * x * (3 - 2 * x)
        check_close(shade(scene), wanted, 3e-3 * wanted.max() + 1e-6, f"spot turned by {tilt}")


def test_area():
    """A panel far away is W / pi times both cosines; its size does not matter then. Blender 3.4 radiates pi / 4."""
    place = np.array((3.0, 2.0, 6.0))
    toward = place - POINT
    distance = np.linalg.norm(toward)
    share = np.pi / 4 if bpy.app.version < (4, 2, 0) else 1.0
    for shape, size in (('SQUARE', 0.2), ('DISK', 0.3), ('RECTANGLE', 0.1)):
        scene = lit_point()
        light = add_light('AREA', 500.0, place, direction=(0, 0, -1)).data
        light.shape, light.size = shape, size
        wanted = linear(ALBEDO) / np.pi * (NORMAL @ toward / distance) * (toward[2] / distance)
        wanted = wanted * share * 500.0 / np.pi / distance ** 2
        check_close(shade(scene), wanted, 3e-3 * wanted.max(), f"panel, {shape}")
    scene = lit_point()
    add_light('AREA', 500.0, place, direction=(0, 0, 1))
    check_close(shade(scene), (0, 0, 0), 1e-6, "the back of a panel")


def matt(albedo):
    """A Lambert surface."""
    material = bpy.data.materials.new("matt")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    diffuse, out = tree.nodes.new('ShaderNodeBsdfDiffuse'), tree.nodes.new('ShaderNodeOutputMaterial')
    diffuse.inputs["Color"].default_value = (albedo, albedo, albedo, 1)
    tree.links.new(diffuse.outputs[0], out.inputs[0])
    return material


def test_like_cycles():
    """A wall of points under Patina is as bright as a wall under Cycles, for every kind of light."""
    try:
        scene = new_scene(32, 32)
        scene.render.engine = 'CYCLES'
        scene.cycles.samples, scene.cycles.max_bounces, scene.cycles.device = 64, 0, 'CPU'
        scene.cycles.use_denoising = False
    except (TypeError, AttributeError):
        raise Skip("this Blender has no Cycles") from None
    scene.camera.data.type, scene.camera.data.ortho_scale = 'ORTHO', 4.0
    across = np.linspace(-2.5, 2.5, 251)
    x, y = (grid.ravel() for grid in np.meshgrid(across, across))
    add_points(np.stack([x, y, np.full(x.size, -5.0)], 1), normals=np.tile((0.0, 0.0, 1.0), (x.size, 1)))
    bpy.ops.mesh.primitive_plane_add(size=6, location=(0, 0, -5))
    wall = bpy.context.object
    wall.data.materials.append(matt(0.8))
    spots = {} if bpy.app.version < (4, 2, 0) else {'SPOT': dict(spot_size=1.2, spot_blend=0.5, shadow_soft_size=0.01)}
    lights = {'SUN': dict(angle=0.1), 'POINT': dict(shadow_soft_size=0.1), 'AREA': dict(shape='DISK', size=1.0), **spots}
    for kind, properties in lights.items():
        obj = add_light(kind, 2.0 if kind == 'SUN' else 100.0, (0.5, 0.3, -2.5), direction=(-0.3, 0.2, -1))
        for name, value in properties.items():
            setattr(obj.data, name, value)
        pictures = {}
        for engine in ('CYCLES', 'PATINA'):
            scene.render.engine, wall.hide_render = engine, engine == 'PATINA'
            bpy.ops.render.render()
            pictures[engine] = saved()[4:-4, 4:-4, 0]
        bpy.data.objects.remove(obj)
        bright = pictures['CYCLES'].max()
        off = np.abs(pictures['PATINA'] - pictures['CYCLES']) / bright
        check(bright > 0.05 and off.mean() < 0.01 and off.max() < 0.08, f"{kind}: off by {off.mean():.4f}, {off.max():.4f} at most")


def background(scene):
    scene.render.film_transparent = False
    return render()["Combined"][0, 0]


def test_world_background_node():
    scene = lit_point()
    set_world((0.1, 0.3, 0.5), 2.0)
    check_close(background(scene), (0.2, 0.6, 1.0, 1.0), 1e-6, "world colour × strength")


def test_world_color_without_nodes():
    scene = lit_point()
    world = scene.world = bpy.data.worlds.new("plain")
    if world.node_tree and bpy.app.version >= (5, 0, 0):
        return  # worlds always have nodes there
    world.use_nodes = False
    world.color = (0.3, 0.2, 0.1)
    check_close(background(scene), (0.3, 0.2, 0.1, 1.0), 1e-6, "world colour")


def test_no_world():
    check_close(background(lit_point()), (0, 0, 0, 1), 0, "no world")


def test_linked_world_is_named():
    scene = lit_point()
    world = set_world((0.1, 0.3, 0.5))
    tree = world.node_tree
    node = tree.nodes.new('ShaderNodeTexSky')
    tree.links.new(node.outputs[0], tree.nodes["Background"].inputs["Color"])
    check_close(background(scene)[:3], (0.1, 0.3, 0.5), 1e-6, "its own colour")
    check(any("Sky Texture" in message for _, message in reports), f"reports {reports}")
