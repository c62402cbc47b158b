# SPDX-License-Identifier: GPL-3.0-or-later
"""Panoramic cameras, and cameras where a scanner stood."""

import math

import bpy
import numpy as np
from check_motion import make_linear
from harness import add_points, check, check_close, new_scene, render, sphere
from mathutils import Euler

EYE = (3.0, -2.0, 1.0)


def stage(width=128, height=64):
    """A panoramic camera off the origin that looks north, level."""
    scene = new_scene(width, height)
    scene.camera.data.type = 'PANO'
    scene.camera.location, scene.camera.rotation_euler = EYE, (math.pi / 2, 0, 0)
    layer = scene.view_layers[0]
    layer.use_pass_position = layer.use_pass_object_index = True
    return scene


def place(bearing, height, away):
    """Seen from the eye: degrees from north to the east, degrees above the horizon."""
    bearing, height = math.radians(bearing), math.radians(height)
    return (EYE[0] + away * math.cos(height) * math.sin(bearing), EYE[1] + away * math.cos(height) * math.cos(bearing),
            EYE[2] + away * math.sin(height))


def test_points_all_around():
    """Each patch of points where a compass and a level would put it; passes tell its distance, its place, its object."""
    stage()
    rng = np.random.default_rng(1)
    seen = ((1, 1, 4.0), (91, 10, 5.0), (-134, -50, 6.0), (170, 40, 3.0), (-45, 75, 2.0))
    for number, direction in enumerate(seen):
        patch = np.array(place(*direction)) + rng.uniform(-0.04, 0.04, (300, 3)) * direction[2]  # two pixels wide
        add_points(patch, name=f"point {number}").pass_index = number + 1
    picture = render()
    for number, (bearing, height, away) in enumerate(seen):
        column, row = (bearing + 180) / 360 * 128, (height + 90) / 180 * 64
        mine = np.argwhere(picture["IndexOB" if "IndexOB" in picture else "Object Index"][..., 0] == number + 1)
        check(len(mine), f"point {number} is not seen")
        off = (np.abs(mine[:, ::-1].mean(axis=0) + 0.5 - (column, row)) * (math.cos(math.radians(height)), 1)).max()
        check(off <= 0.8, f"point {number}: {mine.mean(axis=0)} is not {row}, {column}")
        at = tuple(mine[len(mine) // 2])
        check_close(picture["Depth"][at][0], away, 0.06 * away, f"distance {number}")
        check_close(picture["Position"][at], place(bearing, height, away), 0.09 * away, f"place {number}")
        check(picture["Combined"][at][3] > 0.15, f"point {number}: alpha {picture['Combined'][at][3]}")


def test_within_a_ball():
    """No gap all around, and colours that go on over the borders of the faces."""
    scene = stage(256, 128)
    scene.patina.fill, scene.patina.smooth, scene.patina.antialias = 'CLOSED', 'ALLEVIATED', 'LAYERS'
    positions, colors, normals = sphere(200000, 2.0, EYE)
    add_points(positions, (np.pad(0.5 + 0.4 * normals, ((0, 0), (0, 1)), constant_values=1)).astype(np.float32))
    scene.render.resolution_x = 256
    picture = render()
    check_close(picture["Combined"][..., 3], 1.0, 1e-5, "alpha")
    bearing = ((np.arange(256) + 0.5) / 256 - 0.5) * 2 * np.pi
    height = (((np.arange(128) + 0.5) / 128 - 0.5) * np.pi)[:, None]
    wanted = np.stack(np.broadcast_arrays(np.cos(height) * np.sin(bearing), np.cos(height) * np.cos(bearing), np.sin(height)), 2)
    check_close(picture["Combined"][..., :3], 0.5 + 0.4 * wanted, 0.012, "colours")
    check_close(picture["Depth"][..., 0], 2.0, 0.06, "distance")
    render_settings = scene.render
    render_settings.use_border = render_settings.use_crop_to_border = True
    render_settings.border_min_x, render_settings.border_max_x = 0.25, 0.5
    render_settings.border_min_y, render_settings.border_max_y = 0.5, 0.75
    part = render()["Combined"]
    check_close(part, picture["Combined"][64:96, 64:128], 0, "a border's part")


def test_samples_and_motion():
    """The mean of samples, and what moves, in a panorama too."""
    scene = stage()
    scene.patina.samples = 4
    add_points([place(0, 0, 4.0)] * 3)
    picture = render()["Combined"]
    check_close(picture[..., 3].sum(), 1.0, 0.35, "what a point covers")
    scene.render.use_motion_blur, scene.render.motion_blur_shutter, scene.patina.motion_steps = True, 1.0, 4
    for frame in (0, 2):
        scene.camera.rotation_euler = Euler((math.pi / 2, 0, math.radians(20.0 * (frame - 1))))
        scene.camera.keyframe_insert("rotation_euler", frame=frame)
    make_linear(scene.camera)
    scene.frame_set(1)
    columns = np.flatnonzero(render()["Combined"][..., 3].sum(axis=0) > 0.05)
    wide = columns.max() - columns.min() + 1
    wanted = 20 / 360 * 128 * 3 / 4
    check(abs(wide - wanted) < 3.5, f"smeared over {wide} columns, not {wanted:.1f}")
