# SPDX-License-Identifier: GPL-3.0-or-later
"""Points fall on exactly the pixels that Blender's own camera predicts, and come back from there."""

import bpy
import numpy as np
from bpy_extras.object_utils import world_to_camera_view
from harness import add_points, check, check_close, drawn, linear, new_scene, render
from mathutils import Euler, Matrix, Vector

MARGIN = 0.02  # pixels: nearer to a pixel's edge float32 may fall on either side


def projection(scene):
    """Blender's matrix (float64) from world to clip space for the full picture, and the picture's size."""
    settings = scene.render
    width = settings.resolution_x * settings.resolution_percentage // 100
    height = settings.resolution_y * settings.resolution_percentage // 100
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    camera = scene.camera.evaluated_get(depsgraph)
    matrix = camera.calc_matrix_camera(depsgraph, x=width, y=height, scale_x=settings.pixel_aspect_x,
                                       scale_y=settings.pixel_aspect_y)
    view = np.linalg.inv(np.array(camera.matrix_world.normalized(), np.float64))
    return np.array(matrix, np.float64) @ view, width, height


def to_pixels(scene, points):
    matrix, width, height = projection(scene)
    clip = np.concatenate([points, np.ones((len(points), 1))], 1) @ matrix.T
    return (clip[:, :2] / clip[:, 3:] * 0.5 + 0.5) * (width, height)


def border_of(scene, width, height):
    settings = scene.render
    if not settings.use_border:
        return 0, 0, width, height
    low = np.float32([settings.border_min_x, settings.border_min_y])
    high = np.float32([settings.border_max_x, settings.border_max_y])
    size = np.float32([width, height])
    return (*map(int, low * size), *map(int, high * size))


def points_in_view(scene, count, seed):
    """World points whose pixels are inside the picture, apart from each other, away from pixel edges."""
    rng = np.random.default_rng(seed)
    matrix, width, height = projection(scene)
    camera = np.array(scene.camera.matrix_world.normalized(), np.float64)
    inverse = np.linalg.inv(matrix)
    points, taken = [], []
    while len(points) < count:
        clip = np.append(rng.uniform(-0.98, 0.98, 2), 0.0)
        near_point = inverse @ np.append(clip, 1.0)
        near_point = near_point[:3] / near_point[3]
        if scene.camera.data.type == 'ORTHO':
            point = near_point - camera[:3, 2] * rng.uniform(0, 9)
        else:
            point = camera[:3, 3] + (near_point - camera[:3, 3]) * rng.uniform(20, 120)
        point = np.float32(point).astype(np.float64)
        place = to_pixels(scene, point[None])[0]
        edge = np.abs(place - np.round(place)).min()
        if edge > MARGIN and all(np.abs(place - other).max() > 2 for other in taken):
            points.append(point)
            taken.append(place)
    return np.array(points), np.array(taken)


def check_projection(scene, seed=1, count=20):
    """Forth: each point's colour stands at its predicted pixel and nowhere else. Back: pixel and depth give the
    point."""
    points, places = points_in_view(scene, count, seed)
    colors = np.full((count, 4), 255, np.uint8)
    colors[:, 0] = 10 + 12 * np.arange(count)
    colors[:, 1] = 255 - colors[:, 0]
    for point, place in zip(points, places):  # the two predictions of Blender agree
        share = world_to_camera_view(scene, scene.camera, Vector(point))
        _, width, height = projection(scene)
        # which knows nothing of sizes that the percentage cuts to whole pixels
        tolerance = 0.01 if scene.render.resolution_percentage == 100 else 1.0
        check_close(np.array(share[:2]) * (width, height), place, tolerance, "world_to_camera_view")
    add_points(points, colors)
    picture = render()
    matrix, width, height = projection(scene)
    x0, y0, x1, y1 = border_of(scene, width, height)
    check(picture["Combined"].shape == (y1 - y0, x1 - x0, 4), f"picture is {picture['Combined'].shape}")
    columns, rows = np.floor(places).astype(int).T
    inside = (columns >= x0) & (columns < x1) & (rows >= y0) & (rows < y1)
    check(inside.any(), "no point inside the border")
    wanted = {(row - y0, column - x0) for row, column in zip(rows[inside].tolist(), columns[inside].tolist())}
    check(drawn(picture) == wanted, f"drawn {sorted(drawn(picture) - wanted)} instead of "
                                    f"{sorted(wanted - drawn(picture))}")
    for index in np.flatnonzero(inside):
        row, column = rows[index] - y0, columns[index] - x0
        check_close(picture["Combined"][row, column, :3], linear(colors[index, :3]), 1e-5, f"colour of {index}")
        check_back(scene, matrix, (width, height), places[index], picture["Depth"][row, column, 0], points[index])


def check_back(scene, matrix, size, place, depth, point):
    """The world point at a screen place and depth (from the camera's plane)."""
    camera = np.array(scene.camera.matrix_world.normalized(), np.float64)
    ends = []
    for z in (-1.0, 0.5):
        end = np.linalg.inv(matrix) @ np.append(place / size * 2 - 1, (z, 1.0))
        ends.append(end[:3] / end[3])
    away = [(end - camera[:3, 3]) @ -camera[:3, 2] for end in ends]
    share = (depth - away[0]) / (away[1] - away[0])
    back = ends[0] + (ends[1] - ends[0]) * share
    check_close(back, point, 1e-4 * max(1.0, np.abs(point).max()), "point from pixel and depth")


def tilted(scene, scale=(1, 1, 1)):
    rotation = Euler((1.1, 0.2, 0.7)).to_matrix().to_4x4()
    scene.camera.matrix_world = Matrix.Translation((3, -4, 2)) @ rotation @ Matrix.Diagonal((*scale, 1))


def test_perspective():
    check_projection(new_scene())


def test_perspective_many_points():
    check_projection(new_scene(211, 157), seed=2, count=20)


def test_rotated_camera():
    scene = new_scene()
    tilted(scene)
    check_projection(scene)


def test_scaled_camera():
    scene = new_scene()
    tilted(scene, (2.0, 0.5, 3.0))
    check_projection(scene)


def test_mirrored_camera():
    scene = new_scene()
    tilted(scene, (-1.0, 1.0, 1.0))
    check_projection(scene)


def test_shift():
    for x, y in ((0.3, 0.0), (0.0, -0.4), (-0.25, 0.35)):
        scene = new_scene()
        scene.camera.data.shift_x, scene.camera.data.shift_y = x, y
        check_projection(scene)


def test_sensor_fits():
    for fit in ('AUTO', 'HORIZONTAL', 'VERTICAL'):
        for size in ((64, 36), (36, 64)):
            scene = new_scene(*size)
            data = scene.camera.data
            data.sensor_fit, data.sensor_width, data.sensor_height, data.lens = fit, 30, 22, 28
            data.shift_x = 0.1
            check_projection(scene)


def test_pixel_aspect():
    for aspect in ((2.0, 1.0), (1.0, 1.5)):
        for fit in ('AUTO', 'VERTICAL'):
            scene = new_scene(60, 50)
            scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = aspect
            scene.camera.data.sensor_fit = fit
            scene.camera.data.shift_y = -0.15
            check_projection(scene)


def test_orthographic():
    scene = new_scene()
    scene.camera.data.type = 'ORTHO'
    scene.camera.data.ortho_scale = 7.5
    tilted(scene)
    check_projection(scene)


def test_orthographic_shift_aspect_portrait():
    for fit in ('AUTO', 'HORIZONTAL', 'VERTICAL'):
        scene = new_scene(40, 62)
        data = scene.camera.data
        data.type, data.ortho_scale, data.sensor_fit = 'ORTHO', 3.3, fit
        data.shift_x, data.shift_y = 0.2, -0.3
        scene.render.pixel_aspect_y = 1.25
        check_projection(scene)


def test_percentage():
    for percentage in (37, 150):
        scene = new_scene(101, 67)
        scene.render.resolution_percentage = percentage
        check_projection(scene)


def test_border_projection():
    for crop in (False, True):
        scene = new_scene(97, 61)
        settings = scene.render
        settings.use_border, settings.use_crop_to_border = True, crop
        settings.border_min_x, settings.border_max_x = 0.13, 0.81
        settings.border_min_y, settings.border_max_y = 0.29, 0.97
        scene.camera.data.shift_x = 0.1
        check_projection(scene)


def test_clip_distances():
    scene = new_scene()
    scene.camera.data.clip_start, scene.camera.data.clip_end = 2.0, 5.0
    add_points([(0, 0, -1), (0.5, 0, -3), (-0.5, 0, -6)])
    check(len(drawn(render())) == 1, "points before clip_start and beyond clip_end must not show")
