# SPDX-License-Identifier: GPL-3.0-or-later
"""Panoramic cameras, and cameras where a scanner stood."""

import importlib.util
import math

import bpy
import check_linked  # noqa: F401  no test leaves files with the user
import numpy as np
from check_import import import_ply as import_points
from check_motion import make_linear
from harness import REPOSITORY, SCRATCH, Skip, add_points, check, check_close, failing_render, new_scene, render, sphere
from mathutils import Euler
from patina import memory, native
from patina.operators import scanner
from patina.read import importers
from patina.sync.analyses.analysis import SCANNERS

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


def test_fog_is_round():
    """What is equally far is equally veiled, whichever face it lies on."""
    scene = stage(256, 128)
    scene.patina.fill = 'CLOSED'
    positions, colors, _ = sphere(200000, 2.0, EYE)
    add_points(positions, np.full(colors.shape, 1.0, np.float32))
    effects = scene.patina.effects
    effects.use_fog, effects.fog_start, effects.fog_end, effects.fog_density = True, 1.0, 3.0, 0.8
    effects.fog_use_color, effects.fog_color = True, (0.0, 0.5, 1.0)
    check_close(render()["Combined"][..., :3] - (0.6, 0.8, 1.0), 0.0, 0.01, "half way through the fog")


def test_faces_that_do_not_fit():
    """Six faces and what they are joined to that are larger than the free memory are refused before any of them is drawn."""
    stage(256, 128)
    add_points([place(0, 0, 4.0)] * 3)
    drawn, honest, free = [], native.Frame.render, memory.free
    native.Frame.render = lambda self, scene: drawn.append(scene) or honest(self, scene)
    memory.free = lambda: 500_000
    try:
        message = failing_render()
    finally:
        native.Frame.render, memory.free = honest, free
    check("the panorama, with its six faces, needs" in message and not drawn, f"{message}, {len(drawn)} drawn")
    render()


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


def two_scans(origin):
    """A PTX of two scans, each a patch of points 2 north of its scanner."""
    lines = []
    for x in (0.0, 5.0):
        lines += ["4", "4", f"{x + origin[0]:.3f} {origin[1]:.3f} {origin[2]:.3f}", "1 0 0", "0 1 0", "0 0 1", "1 0 0 0",
                  "0 1 0 0", "0 0 1 0", f"{x + origin[0]:.3f} {origin[1]:.3f} {origin[2]:.3f} 1"]
        lines += [f"{0.05 * (i % 4) - 0.075:.4f} 2 {0.05 * (i // 4) - 0.075:.4f} 0.5" for i in range(16)]
    path = SCRATCH / "two.ptx"
    path.write_text("\n".join(lines) + "\n")
    return path


def check_scanner_cameras(origin, link):
    """Through the camera of each scan its points are straight ahead, 2 away."""
    scene = new_scene(128, 64)
    obj, = import_points(two_scans(origin), link=link)
    check(len(scanner.positions(obj)) == 2, f"{obj.data.get(SCANNERS)}")
    for scan in (0, 1):
        bpy.context.view_layer.objects.active = obj
        bpy.ops.object.patina_camera_at_scanner(scan=scan)
        check(scene.camera.data.type == 'PANO', "a panoramic camera")
        depth = render()["Depth"][..., 0]
        seen = np.argwhere(np.abs(depth - 2.0) < 0.06)
        check(len(seen) and np.abs(seen.mean(axis=0) + 0.5 - (32, 64)).max() < 0.8, f"scan {scan} is seen at {seen}")
    bpy.context.view_layer.objects.active = obj
    try:
        bpy.ops.object.patina_camera_at_scanner(scan=2)
    except RuntimeError as error:
        check("scans 0 to 1, there is no 2" in str(error), str(error))
    else:
        check(False, "a third scan")


def test_camera_at_scanner():
    for link in (False, True):
        check_scanner_cameras((10.0, 20.0, 1.5), link)
        check_scanner_cameras((485432.125, 5428765.25, 312.5), link)


def test_scanner_of_e57():
    """The pose that an E57 tells is kept, relative to the origin of the points."""
    if importlib.util.find_spec("pye57") is None:
        raise Skip("pye57 is not installed here")
    path = REPOSITORY.parent / "shared/data/formats/e57/pye57/translationWithoutRotation.e57"
    if not path.exists():
        raise Skip("there is no ../shared/data/formats/e57/pye57/translationWithoutRotation.e57")
    import pye57
    file = pye57.E57(str(path))
    wanted = np.array(file.get_header(0).translation)
    points = importers.reader(path).read(path, importers.Filter(), importers.Progress())
    check_close(np.array(points.notes["scanners"]) + points.origin, wanted, 1e-6, "the scanner")
