# SPDX-License-Identifier: GPL-3.0-or-later
"""Holdouts and shadow catchers, of points and of faces; what is not known is told once."""

import bpy
import numpy as np
from harness import Skip, add_light, add_points, check, check_close, new_scene, render, reports, saved, set_world
from patina import point_data

SIZE = 64


def square(z, half, name="square", meshes='TRIANGLES', x=0.0, dense=120):
    """Across the view, of faces, or of points."""
    scene = bpy.context.scene
    scene.patina.meshes = 'TRIANGLES'
    if meshes == 'POINTS':
        u, v = np.meshgrid(np.linspace(-half, half, dense), np.linspace(-half, half, dense))
        places = np.stack([u.ravel() + x, v.ravel(), np.full(u.size, z)], 1)
        return add_points(places, np.full((u.size, 4), 200, np.uint8), np.tile((0.0, 0.0, 1.0), (u.size, 1)), name)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(x - half, -half, z), (x + half, -half, z), (x + half, half, z), (x - half, half, z)], [], [(0, 1, 2, 3)])
    obj = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(obj)
    return obj


def flat_scene():
    """A pixel is 1/16 of a unit; what lies between -2 and 2 is seen."""
    scene = new_scene(SIZE, SIZE)
    scene.camera.data.type, scene.camera.data.ortho_scale = 'ORTHO', 4.0
    set_world((0.5, 0.5, 0.5))
    return scene


def test_holdout():
    """A hole in colour and alpha where the holdout is nearest; what lies before it stays as it was, in every film."""
    for kind in ('POINTS', 'TRIANGLES'):
        scene = flat_scene()
        back, hole = square(-5.0, 1.5, "back", 'POINTS'), square(-4.0, 0.75, "hole", kind)
        front = square(-3.0, 0.4, "front", 'POINTS', x=-0.75)
        front.data.attributes["Col"].data.foreach_set("color_srgb", np.tile(np.float32([1, 0, 0, 1]), point_data.count_of(front.data)))
        for film in (True, False):
            scene.render.film_transparent = film
            hole.is_holdout = False
            hole.hide_render = True
            without = render()["Combined"]
            hole.hide_render = False
            hole.is_holdout = True
            picture = render()["Combined"]
            where = f"{kind}, transparent {film}"
            check(not picture[30:34, 34:42].any(), f"{where}: the hole shows {picture[32, 38]}")
            check_close(picture[32, 18:22], without[32, 18:22], 1e-6, f"{where}: what lies before it")
            check_close(picture[32, 50:54], without[32, 50:54], 1e-6, f"{where}: what lies beside it")
            check_close(picture[2, 2], without[2, 2], 1e-6, f"{where}: the background")
            check(back.name in bpy.data.objects, "kept")


def test_holdout_of_a_collection_at_soft_edges():
    """A collection's holdout; at edges alpha is the share of what is not held out, for layers' and samples' anti-aliasing."""
    for samples, antialias, share in ((1, 'LAYERS', 0.1), (16, 'OFF', 0.05)):
        scene = flat_scene()
        scene.patina.samples, scene.patina.antialias, scene.patina.fill = samples, antialias, 'CLOSED'
        square(-5.0, 1.5, "back", 'POINTS')
        hole = square(-4.0, 0.70, "hole", 'TRIANGLES')
        group = bpy.data.collections.new("holes")
        scene.collection.children.link(group)
        scene.collection.objects.unlink(hole)
        group.objects.link(hole)
        hole.hide_render = True
        whole = render()["Combined"]
        hole.hide_render = False
        bpy.context.view_layer.layer_collection.children["holes"].holdout = True
        picture = render()["Combined"]
        lost = float((whole[..., 3] - picture[..., 3]).sum()) / 256
        check(abs(lost / (1.4 * 1.4) - 1.0) < share, f"{samples} samples: {lost:.3f} of {1.4 * 1.4:.3f} square units held out")
        color = picture[..., :3][picture[..., 3] > 0.3] / picture[..., 3:][picture[..., 3] > 0.3]
        check(np.ptp(color) < 0.03, f"{samples} samples: colours from {color.min():.3f} to {color.max():.3f} where one was")


def caught(kind):
    scene = flat_scene()
    set_world((0.0, 0.0, 0.0))
    scene.patina.use_shadows = True
    floor = square(-5.0, 1.9, "floor", kind, dense=240)
    blocker = square(-3.0, 0.5, "blocker", 'POINTS')
    blocker.visible_camera = True
    light = add_light('SUN', 3.0, direction=(0.5, 0, -1))
    return scene, floor, blocker, light


def test_shadow_catcher():
    """Nothing but the shadow of what stands above, of the darkness that the shadow has; no shadow, no catcher."""
    for kind in ('POINTS', 'TRIANGLES'):
        scene, floor, blocker, light = caught(kind)
        floor.is_shadow_catcher = True
        scene.patina.fill = 'CLOSED'
        scene.patina.shadow_samples = 4  # nothing that is looked at lies at the shadow's edge
        picture = render()["Combined"]
        # the sun moves the shadow by one unit: its middle is pixel column 32 + 16
        check_close(picture[32, 50:54], np.tile((0, 0, 0, 1), (4, 1)), 0.02, f"{kind}: in the shadow")
        check_close(picture[32, 6:12, 3], 0.0, 0.02, f"{kind}: outside of it")
        check(picture[32, 32, 3] == 1.0 and picture[32, 32, :3].max() > 0.1, f"{kind}: the blocker {picture[32, 32]}")
        set_world((0.5, 0.5, 0.5))
        half = render()["Combined"][32, 52, 3]
        check(0.1 < half < 0.9, f"{kind}: with light from all sides alpha is {half}")
        scene.render.film_transparent = False
        opaque = render()["Combined"]
        check_close(opaque[32, 52, :3], 0.5 * (1.0 - half), 0.02, f"{kind}: over the world")
        check_close(opaque[32, 8], (0.5, 0.5, 0.5, 1.0), 0.02, f"{kind}: the world beside the shadow")
        light.data.use_shadow = False
        scene.render.film_transparent = True
        check(render()["Combined"][32, 52, 3] < 0.02, f"{kind}: a light without shadows")


def cycles():
    scene = bpy.context.scene
    try:
        scene.render.engine = 'CYCLES'
    except TypeError:
        raise Skip("this Blender has no Cycles") from None
    scene.cycles.device, scene.cycles.samples, scene.cycles.use_denoising = 'CPU', 16, False
    scene.cycles.max_bounces = 0
    bpy.ops.render.render()
    scene.render.engine = 'PATINA'
    return saved()


def test_beside_cycles():
    """The same scene, its alpha by both: a hole and a shadow."""
    scene, floor, blocker, light = caught('TRIANGLES')
    bpy.data.objects.remove(blocker)
    blocker = square(-3.0, 0.5, "blocker", 'TRIANGLES')
    hole = square(-2.0, 0.4, "hole", 'TRIANGLES', x=-1.2)
    hole.visible_shadow = False
    light.data.angle = 0.0
    floor.is_shadow_catcher = hole.is_holdout = True
    scene.patina.fill, scene.patina.samples = 'CLOSED', 16
    ours = render()["Combined"][..., 3]
    theirs = cycles()[..., 3]
    off = np.abs(ours - theirs)
    print(f"  alpha beside Cycles: {off.mean():.4f} off in the mean, {(off > 0.1).mean():.2%} of the pixels by more than 0.1")
    check(theirs.mean() > 0.05 and off.mean() < 0.01 and (off > 0.1).mean() < 0.04, f"{off.mean():.4f}, {(off > 0.1).mean():.2%}")
    floor.is_shadow_catcher = False
    ours, theirs = render()["Combined"][..., 3], cycles()[..., 3]
    off = np.abs(ours - theirs)
    print(f"  the hole alone: {off.mean():.4f} off in the mean, {(off > 0.1).mean():.2%} of the pixels by more than 0.1")
    check(off.mean() < 0.01 and (off > 0.1).mean() < 0.03, f"the hole: {off.mean():.4f}, {(off > 0.1).mean():.2%}")


def test_materials_and_tints():
    """A mesh of two materials is held out whole, and does not count as one where it is not."""
    scene = flat_scene()
    mesh = bpy.data.meshes.new("two")
    mesh.from_pydata([(x, y, -4.0) for x in (-1, 0, 1) for y in (-1, 1)], [], [(0, 2, 3, 1), (2, 4, 5, 3)])
    for name, color in (("red", (1, 0, 0, 1)), ("green", (0, 1, 0, 1))):
        material = bpy.data.materials.new(name)
        material.diffuse_color = color
        mesh.materials.append(material)
    mesh.polygons[1].material_index = 1
    obj = bpy.data.objects.new("two", mesh)
    scene.collection.objects.link(obj)
    hole = square(-3.0, 0.3, "hole", 'POINTS')
    hole.is_holdout = True
    picture = render()["Combined"]
    check(not picture[32, 32].any() and picture[32, 20, 3] == 1.0 and picture[32, 44, 3] == 1.0, f"{picture[32, [20, 32, 44]]}")
    obj.is_holdout = True
    check(not render()["Combined"].any(), "all is held out")


def test_unknown_is_told_once():
    scene = flat_scene()
    for number in range(5):
        obj = square(-4.0 - number, 0.3, f"part {number}", 'POINTS')
        group = bpy.data.collections.new(f"group {number}")
        scene.collection.children.link(group)
        scene.collection.objects.unlink(obj)
        group.objects.link(obj)
        bpy.context.view_layer.layer_collection.children[group.name].indirect_only = True
    bpy.context.view_layer.material_override = bpy.data.materials.new("clay")
    if bpy.app.version >= (4, 0, 0):
        obj.light_linking.receiver_collection = bpy.data.collections.new("receivers")
    render()
    for part in ("'part 0', 'part 1', 'part 2' and 2 more", "material override 'clay'",
                 *(["light linking"] if bpy.app.version >= (4, 0, 0) else [])):
        check(len([text for _, text in reports if part in text]) == 1, f"{part}: {reports}")


def test_light_linking_of_lamps_is_told():
    """As artists set it: on the light, with receivers or blockers; an empty collection too."""
    if bpy.app.version < (4, 0, 0):
        raise Skip("light linking came with Blender 4.0")
    scene = flat_scene()
    square(-4.0, 0.3, "part", 'POINTS')
    lamp = add_light('SUN', 2.0)
    lamp = lamp if isinstance(lamp, bpy.types.Object) else next(obj for obj in scene.objects if obj.type == 'LIGHT')
    render()
    check(not [text for _, text in reports if "light linking" in text], f"{reports}")
    for name in ("receiver_collection", "blocker_collection"):
        setattr(lamp.light_linking, name, bpy.data.collections.new(name))
        render()
        said = [text for _, text in reports if "light linking" in text]
        check(len(said) == 1 and f"'{lamp.name}'" in said[0], f"{name}: {reports}")
        setattr(lamp.light_linking, name, None)
