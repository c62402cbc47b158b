# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadows in Blender: a ball over a floor, switches of lights and objects, the pass, baking and loading."""

import os

import bpy
import numpy as np
from harness import SCRATCH, add_light, add_points, check, check_close, new_scene, render, reports, sphere

SIDE = 96
SHADOWED, OPEN = (-1.2, 0.0), (1.2, 0.0)  # on the floor: behind the ball, and beside it


def stage(kind='SUN', **light):
    """An orthographic camera looks down on 4 x 4 units; the light comes from +x, 45 degrees high."""
    scene = new_scene(SIDE, SIDE)
    scene.camera.data.type = 'ORTHO'
    scene.camera.data.ortho_scale = 4.0
    across = np.linspace(-2, 2, 201)
    x, y = np.meshgrid(across, across)
    floor = np.stack([x.ravel(), y.ravel(), np.full(x.size, -5.0)], 1)
    add_points(floor, normals=np.tile((0.0, 0.0, 1.0), (len(floor), 1)), name="floor")
    places, _, normals = sphere(20000, 0.5, (0, 0, -3.8))
    add_points(places, normals=normals, name="ball")
    lamp = add_light(kind, 3.0 if kind == 'SUN' else 2000.0, (6, 0, 2.2), direction=(-1, 0, -1))
    if kind == 'SUN':
        lamp.data.angle = 0.0
    else:
        lamp.data.shadow_soft_size = 0.0
    for name, value in light.items():
        setattr(lamp.data, name, value)
    bpy.context.view_layer.patina.use_pass_shadow = True
    return scene


def pixel(picture, place, name="Combined"):
    row, column = (int((c + 2) / 4 * SIDE) for c in (place[1], place[0]))
    return picture[name][row, column]


def test_suns_and_points_cast():
    for kind in ('SUN', 'POINT', 'SPOT'):
        stage(kind)
        if kind == 'SPOT':
            bpy.data.lights[-1].spot_size = 1.2
        picture = render()
        check(pixel(picture, SHADOWED)[:3].max() == 0.0, f"{kind}: {pixel(picture, SHADOWED)} in the shadow")
        check(pixel(picture, OPEN)[:3].min() > 0.1, f"{kind}: {pixel(picture, OPEN)} in the light")
        check_close(pixel(picture, SHADOWED, "Shadow"), (0, 0, 0), 0, f"{kind}: the pass in the shadow")
        check_close(pixel(picture, OPEN, "Shadow"), (1, 1, 1), 0, f"{kind}: the pass in the light")


def test_a_panel_casts_soft_shadows():
    stage('AREA')
    bpy.data.lights[-1].size = 3.0
    shadow = render()["Shadow"][SIDE // 2, :SIDE // 2, 0]
    check(shadow.min() < 0.3 and shadow.max() == 1.0, f"from {shadow.min()} to {shadow.max()}")
    check(((shadow > 0.1) & (shadow < 0.9)).sum() > 6, f"no penumbra: {shadow}")


def lit(scene_change):
    """Whether the shadowed place is lit once something has been changed."""
    scene = stage()
    scene_change(scene)
    return pixel(render(), SHADOWED)[:3].min() > 0.1


def test_switches():
    check(lit(lambda scene: setattr(scene.patina, "use_shadows", False)), "the scene's switch")
    check(lit(lambda scene: setattr(bpy.data.lights[-1], "use_shadow", False)), "the light's switch")
    check(lit(lambda scene: setattr(scene.objects["ball"].patina, "cast_shadows", False)), "cast")
    check(lit(lambda scene: setattr(scene.objects["ball"], "visible_shadow", False)), "ray visibility")
    check(lit(lambda scene: setattr(scene.objects["floor"].patina, "receive_shadows", False)), "receive")
    check(not lit(lambda scene: setattr(scene.objects["ball"].patina, "receive_shadows", False)), "the ball casts still")
    check(not lit(lambda scene: setattr(scene.objects["floor"].patina, "self_shadows", False)), "others' shadows fall")


def test_opacities_of_points():
    """A ball whose points let three quarters through, by an attribute: once above and once below it."""
    scene = stage()
    mesh = scene.objects["ball"].data
    values = np.full(len(mesh.vertices), 0.25, np.float32)
    mesh.attributes.new("glass", 'FLOAT', 'POINT').data.foreach_set("value", values)
    scene.objects["ball"].patina.opacity_attribute = "glass"
    share = float(pixel(render(), SHADOWED, "Shadow")[0])
    check(abs(share - 0.75**2) < 0.01, f"{share} of the light arrives")


def test_error_target():
    """The tighter the target, the nearer to the shadow of many samples; the samples set are not asked."""
    scene = stage('AREA')
    bpy.data.lights[-1].size = 3.0

    def shadow(error, samples):
        scene.patina.shadow_error, scene.patina.shadow_samples = error, samples
        return render()["Shadow"][..., 0]

    many, one = shadow(0.0, 512), shadow(0.0, 1)
    soft = (many > 0.0) & (many < 1.0)
    loose, tight = (float(np.sqrt(np.square(shadow(error, 1) - many)[soft].mean())) for error in (20.0, 2.0))
    check(tight < 0.02 and loose < 0.2 and tight < 0.5 * loose, f"off by {loose} and {tight}")
    check(np.sqrt(np.square(one - many)[soft].mean()) > 0.2, "one sample is far off")


def test_bake_and_load():
    path = str(SCRATCH / "scene.patina-shadows")
    scene = stage(angle=0.1)
    fresh = render()["Combined"]
    check(bpy.ops.patina.bake_shadows(filepath=path) == {'FINISHED'} and os.path.getsize(path) > 60000, "baked")
    check(scene.patina.shadow_file == path, "the scene takes them from there")
    check_close(render()["Combined"], fresh, 0, "baked shadows")
    check(not any("not used" in message for _, message in reports), f"reports {reports}")
    bpy.data.lights[-1].angle = 0.2
    changed = render()["Combined"]
    check(any("stale" in message for _, message in reports), f"reports {reports}")
    check(np.abs(changed - fresh).max() > 0.05, "they were computed instead")
    try:
        bpy.ops.patina.load_shadows(filepath=path)
        message = ""
    except RuntimeError as error:
        message = str(error)
    check("stale" in message, f"loading said: {message}")
    bpy.data.lights[-1].angle = 0.1
    check(bpy.ops.patina.load_shadows(filepath=path) == {'FINISHED'}, "loaded")
    check_close(render()["Combined"], fresh, 0, "loaded shadows")
    os.unlink(path)
