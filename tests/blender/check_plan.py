# SPDX-License-Identifier: GPL-3.0-or-later
"""Plans to scale: where each pixel lies in the world, to the world file's word."""

import bpy
import numpy as np
from harness import SCRATCH, add_points, check, check_close, new_scene
from patina.operators import plan, view_transform


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


def test_plan_refuses():
    new_scene()
    for part, options in (("select objects", {}), ("the most is", {"scale": 0.001})):
        if options:
            add_points([(0, 0, 0), (100, 100, 1)]).select_set(True)
            bpy.context.view_layer.update()
        try:
            bpy.ops.render.patina_plan(filepath=str(SCRATCH / "no.png"), **options)
        except RuntimeError as error:
            check(part in str(error), str(error))
        else:
            check(False, f"no refusal for {options}")


def test_view_transform_hint():
    scene = new_scene()
    scene.view_settings.view_transform = 'Filmic'
    check(view_transform.changes_colors(scene), "Filmic is not noticed")
    bpy.ops.render.patina_true_colors()
    check(not view_transform.changes_colors(scene), f"{scene.view_settings.view_transform}")


def test_world_file():
    lines = plan.world_file(1000.0, 2000.0, 0.5).split()
    check([float(line) for line in lines] == [0.5, 0, 0, -0.5, 1000.25, 1999.75], f"{lines}")
