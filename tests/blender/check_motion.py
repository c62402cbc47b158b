# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion blur of final pictures: what moves smears by as many pixels as it moves while the shutter is open."""

import numpy as np
from harness import add_points, check, check_close, new_scene, render, reports
from patina.sync.view import motion

SIZE, SCALE = 64, 8  # pixels, and pixels a unit


def make_linear(obj):
    """What is animated moves evenly."""
    action = obj.animation_data.action
    curves = action.fcurves if hasattr(action, "fcurves") else action.layers[0].strips[0].channelbags[0].fcurves
    for curve in curves:
        for key in curve.keyframe_points:
            key.interpolation = 'LINEAR'


def stage(moving="points"):
    """A tile of 8 x 8 pixels in the middle of the picture at frame 1, a point a pixel; it or the camera moves by 2 units a
    frame, 16 pixels."""
    scene = new_scene(SIZE, SIZE)
    scene.camera.data.type, scene.camera.data.ortho_scale = 'ORTHO', SIZE / SCALE
    grid = (np.mgrid[0:8, 0:8].reshape(2, -1).T + 0.5) / SCALE - 0.5
    obj = add_points(np.column_stack([grid, np.full(len(grid), -4.0)]))
    obj.patina.lighting, obj.patina.color = 'UNLIT', (1, 1, 1)
    mover, sign = (obj, 1) if moving == "points" else (scene.camera, -1)
    for frame in (0, 2):
        mover.location.x = 2.0 * sign * (frame - 1)
        mover.keyframe_insert("location", frame=frame)
    make_linear(mover)
    scene.frame_set(1)
    scene.render.use_motion_blur = True
    scene.render.motion_blur_shutter = 0.5
    place, name = motion.position_property(scene)
    setattr(place, name, 'CENTER')
    scene.patina.motion_steps = 8
    return scene


def profile(picture):
    """Alpha along the tile's rows, which must all be alike."""
    rows = picture["Combined"][30:34, :, 3]
    check_close(rows, np.broadcast_to(rows[:1], rows.shape), 1e-6, "rows")
    return rows[0]


def smear(offsets):
    """Share of each pixel that the tile covers at each of these places, in pixels; the mean of them."""
    pixels = np.arange(SIZE)
    return np.mean([np.clip(np.minimum(pixels + 1, 36 + offset) - np.maximum(pixels, 28 + offset), 0, 1)
                    for offset in offsets], axis=0)


def check_smear(scene, offsets, what):
    """The samples' jitter may move an edge by a pixel in a single sample."""
    found, wanted = profile(render()), smear(offsets)
    edge = 1.5 / len(offsets)
    check(abs(found - wanted).max() <= edge, f"{what}: {found.round(3)} is not {wanted.round(3)}")
    check_close(found.sum(), 8.0, 0.01, f"{what}: what covers")
    shift = (found - wanted) @ np.arange(SIZE) / 8.0
    check(abs(shift) < 0.5, f"{what}: {shift:.2f} pixels aside")
    return found


def test_smears_by_what_it_moves():
    """Half a frame at 16 pixels a frame: 8 moments a pixel apart."""
    centered = np.arange(8) - 3.5
    for moving in ("points", "camera"):
        scene = stage(moving)
        place, name = motion.position_property(scene)
        for kind, shift in (('CENTER', 0), ('START', 4), ('END', -4)):
            setattr(place, name, kind)
            found = check_smear(scene, centered + shift, f"{moving}, {kind}")
            check(14 <= (found > 0.01).sum() <= 16, f"{(found > 0.01).sum()} pixels are touched")
        check(scene.frame_current == 1 and scene.frame_subframe == 0.0, "the frame is the artist's again")


def test_shutter_and_steps():
    scene = stage()
    scene.render.motion_blur_shutter, scene.patina.motion_steps = 1.0, 4
    check_smear(scene, [-6, -2, 2, 6], "a whole frame in four")
    scene.patina.samples = 8
    check_smear(scene, [-6, -2, 2, 6], "with samples for edges")
    check([moment.samples for moment in motion.moments(scene)] == [2] * 4, "two samples a moment")
    scene.render.use_motion_blur = False
    scene.patina.samples = 1
    check_smear(scene, [0], "off")


def test_the_same_again():
    scene = stage()
    first = render()["Combined"]
    check(np.array_equal(first, render()["Combined"]), "two renders differ")
    scene.patina.tile_size = 24
    check(np.array_equal(first, render()["Combined"]), "tiles change the picture")


def test_premultiplied():
    """What crosses a coloured background mixes with it by how long it covers."""
    stage()
    picture = render()["Combined"]
    check_close(picture[..., 0], picture[..., 3], 1e-6, "white points: colour is alpha")


def test_data_are_the_frames():
    """Depth comes from the moment of the frame alone."""
    scene = stage()
    scene.patina.motion_steps = 5
    depth = render()["Depth"][..., 0]
    columns = np.flatnonzero((depth < 100).any(axis=0))
    check(columns.min() == 28 and columns.max() == 35, f"columns {columns}")


def test_said_once():
    scene = stage()
    next(obj for obj in scene.objects if obj.type == 'MESH').patina.color_attribute = "nowhere"
    render()
    check(len([text for _, text in reports if "nowhere" in text]) == 1, f"{reports}")
