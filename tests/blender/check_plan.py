# SPDX-License-Identifier: GPL-3.0-or-later
"""Plans to scale: where each pixel lies in the world, to the world file's word."""

import bpy
import numpy as np
from check_survival import full_disk
from harness import SCRATCH, add_points, check, check_close, new_scene
from patina.operators import images_to_scale, plan, view_transform


def picture_of(path):
    image = bpy.data.images.load(str(path))
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)[::-1]  # row 0 at the top, as world files count


def test_plan():
    """Points at known world coordinates lie in the pixels that the world file gives them."""
    scene = new_scene()
    scene["patina_origin"] = [431000.0, 4581000.0, 2000.0]
    places = np.array([(0.0, 0.0, 1.0), (4.0, 0.0, 5.0), (0.0, 3.0, 0.0), (2.5, 1.5, 9.0)])
    add_points(places, np.full((4, 4), 255, np.uint8)).select_set(True)
    bpy.context.view_layer.update()
    for name, size in (("plan.png", ".pgw"), ("plan.tif", ".tfw")):
        path = SCRATCH / name
        bpy.ops.render.patina_plan(filepath=str(path), scale=100.0, dpi=254.0, margin=0.05)
        a, d, b, e, c, f = (float(line) for line in path.with_suffix(size).read_text().split())
        check_close((a, d, b, e), (0.01, 0, 0, -0.01), 1e-9, "a pixel's size")
        picture = picture_of(path)
        check(picture.shape[:2] == (340, 440), f"{picture.shape}")
        for x, y, _ in places:
            column, row = (431000 + x - c) / a, (4581000 + y - f) / e
            found = np.argwhere(picture[..., 3] > 0.5)
            off = np.abs(found - (row, column)).max(axis=1).min()
            check(off <= 0.51, f"{name}: ({x}, {y}) is {off:.2f} pixels from its place")
        check((picture[..., 3] > 0.5).sum() == 4, "four points")


def test_plan_restores_the_scene():
    """A render leaves camera, resolution and objects as they were, and writes pixels. Without one, the scene keeps the plan's."""
    scene = new_scene()
    add_points(np.array([(0.0, 0.0, 0.0), (4.0, 3.0, 1.0)]), np.full((2, 4), 255, np.uint8)).select_set(True)
    own = bpy.data.objects.new("own", bpy.data.cameras.new("own"))
    scene.collection.objects.link(own)
    scene.camera, scene.render.resolution_x, scene.render.resolution_y = own, 123, 77
    scene.render.resolution_percentage, scene.render.use_border, scene.render.pixel_aspect_x = 50, True, 2.0
    bpy.context.view_layer.update()

    def state():
        return (scene.camera, [getattr(scene.render, name) for name in images_to_scale.RESTORED],
                scene.render.image_settings.file_format, len(bpy.data.objects), len(bpy.data.cameras))
    before, path = state(), SCRATCH / "restored.png"
    bpy.ops.render.patina_plan(filepath=str(path), scale=100.0, dpi=254.0, margin=0.0)
    check(state() == before, f"{state()}, not {before}")
    picture = picture_of(path)
    check(picture.shape[:2] == (300, 400) and (picture[..., 3] > 0.5).any(), f"{picture.shape}")
    bpy.ops.render.patina_plan(filepath=str(path), scale=100.0, dpi=254.0, margin=0.0, write_picture=False)
    check(scene.camera.name == "Plan" and scene.render.resolution_x == 400, "not set up")


def test_plan_fits_the_sheet():
    scene = new_scene()
    box = np.zeros(3), np.array([30.0, 12.0, 5.0])
    for sheet, unit, scale in (("A4", 1.0, 200.0), ("A3", 1.0, 100.0), ("A0", 1.0, 50.0), ("A3", 0.001, 0.1), ("A3", 1000.0, 1e5)):
        found = plan.scale_for(box, plan.SHEETS[sheet], 0.02, unit)
        check_close(found, scale, 1e-6 * scale, f"{sheet}, {unit}")
        long, short = sorted(plan.SHEETS[sheet], reverse=True)
        check(31.2 * unit / found <= long and 13.2 * unit / found <= short, "it is larger than the sheet")
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = 'PNG', '8'
    text = plan._size_text(scene, box, 100.0, 150.0, 0.0)
    check(text == "1,772 x 709 pixels, at most 5.0 MB", text)


def test_plan_refuses():
    new_scene()
    for part, options in (("select objects", {}), ("The most is", {"scale": 0.001})):
        if options:
            add_points([(0, 0, 0), (100, 100, 1)]).select_set(True)
            bpy.context.view_layer.update()
        try:
            bpy.ops.render.patina_plan(filepath=str(SCRATCH / "no.png"), **options)
        except RuntimeError as error:
            check(part in str(error), str(error))
        else:
            check(False, f"no refusal for {options}")


def test_world_file_on_a_full_disk():
    """One message, and the world file of before."""
    new_scene()
    add_points([(0, 0, 0), (10, 10, 1)]).select_set(True)
    bpy.context.view_layer.update()
    target = SCRATCH / "full.pgw"
    target.write_text("before")
    try:
        with full_disk():
            bpy.ops.render.patina_plan(filepath=str(SCRATCH / "full.png"), write_picture=False)
    except RuntimeError as error:
        check("full.pgw cannot be written: File too large" in str(error), str(error))
    else:
        check(False, "it was written")
    check(target.read_text() == "before" and [path.name for path in SCRATCH.glob("full.pgw*")] == ["full.pgw"], f"{list(SCRATCH.glob('full*'))}")


def test_view_transform_hint():
    scene = new_scene()
    scene.view_settings.view_transform = 'Filmic'
    check(view_transform.changes_colors(scene), "Filmic is not noticed")
    bpy.ops.render.patina_true_colors()
    check(not view_transform.changes_colors(scene), f"{scene.view_settings.view_transform}")


def test_world_file():
    frame = plan.frame_of((np.zeros(3), np.array((5.0, 3.0, 1.0))), 0.5, 0.0)
    lines = images_to_scale.world_file(frame, *frame.size(), np.array((1000.0, 1997.0, 0.0))).split()
    check([float(line) for line in lines] == [0.5, 0, 0, -0.5, 1000.25, 1999.75], f"{lines}")
