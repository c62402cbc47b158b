# SPDX-License-Identifier: GPL-3.0-or-later
"""Suns, points and the world, in Blender's units: albedo * E / pi * cos; a point light gives E = P / (4 pi d^2)."""

import bpy
import numpy as np
from check_points import pixel
from harness import add_light, add_points, check, check_close, linear, new_scene, render, reports, set_world

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


def test_other_lights_are_named():
    lit_point()
    add_light('AREA', 10.0).name = "panel"
    add_light('SPOT', 10.0).name = "cone"
    render()
    texts = [message for kind, message in reports if "sun and point lights" in message]
    check(len(texts) == 1 and "'cone', 'panel'" in texts[0], f"reports {reports}")


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
    check(any("Background node" in message for _, message in reports), f"reports {reports}")
