# SPDX-License-Identifier: GPL-3.0-or-later
"""View from Here: the 3D view and a camera at a station, with clip distances that fit the scan. Walk navigation without gravity."""

from types import SimpleNamespace

import bpy
import check_linked  # noqa: F401  no test leaves files with the user
import numpy as np
from check_animation import failing
from check_import import import_ply
from check_set_up import gray, start_scene
from harness import SCRATCH, check, check_close, new_scene, render
from mathutils import Vector
from patina.operators import stations, view_from_here

HEAD = "{n}\n1\n{0} {1} {2}\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n{0} {1} {2} 1\n"


def room_file(name, places, size=8.0, scale=1.0):
    """A PTX file: the walls of a room around the stations, each of which saw all of it. Lengths times scale."""
    side = np.linspace(-size / 2, size / 2, 40)
    u, v = (values.ravel() for values in np.meshgrid(side, np.linspace(0.0, 3.0, 16)))
    half = np.full_like(u, size / 2)
    walls = np.concatenate([np.stack(axes, 1) for axes in ((u, half, v), (u, -half, v), (half, u, v), (-half, u, v))])
    text = ""
    for place in places:
        text += HEAD.format(*(scale * np.array(place)), n=len(walls))
        text += "".join(f"{x:.7g} {y:.7g} {z:.7g} 0.5\n" for x, y, z in scale * (walls - place))
    path = SCRATCH / name
    path.write_text(text)
    return path


PLACES = [(1.0, -2.0, 1.6), (-2.0, 1.0, 1.6)]


def space_of():
    area = view_from_here.view_of(bpy.context)
    return area and area.spaces.active


def eye_of(view):
    return view.view_location + view.view_rotation @ Vector((0.0, 0.0, view.view_distance))


def room_scene(name="room.ptx", scale=1.0, link=False):
    scene = new_scene(96, 64)
    before = set(bpy.data.objects)
    bpy.ops.import_scene.patina_points(filepath=str(room_file(name, PLACES, scale=scale)), link=link)
    obj, = (item for item in set(bpy.data.objects) - before if item.type != 'EMPTY')
    obj.patina.analysis = 'OFF'
    bpy.context.view_layer.update()
    return scene, obj


def test_view_from_a_station():
    """The view is at the station, looks at the middle of the room, and its clip distances hold the room: in meters, millimeters and
    kilometers, imported and linked."""
    for scale, link in ((1.0, False), (1.0, True), (0.001, False), (1000.0, False)):
        scene, obj = room_scene(f"room_{scale:g}.ptx", scale, link)
        camera = scene.camera
        bpy.context.view_layer.objects.active = stations.of(obj)[1]
        check(bpy.ops.view3d.patina_view_from_here() == {'FINISHED'}, "view from here")
        check(scene.camera == camera, "a camera that nobody wanted")
        space = space_of()
        if space:
            view, said = space.region_3d, f"scale {scale}, link {link}"
            check_close(np.array(eye_of(view)) / scale, PLACES[1], 1e-4, f"{said}: the eye")
            wanted = (Vector((0, 0, 1.5)) - Vector(PLACES[1])).normalized()
            looks = view.view_rotation @ Vector((0, 0, -1))
            check_close(looks, wanted, 2e-2, f"{said}: it looks at the middle")
            check((view.view_rotation @ Vector((0, 1, 0))).z > 0.9, "it is upright")
            check(space.clip_start < 0.01 * scale * 2.0 and 10.0 * scale < space.clip_end < 1e6 * space.clip_start, f"{space.clip_start} to {space.clip_end}")
        bpy.context.view_layer.objects.active = obj
        check(bpy.ops.view3d.patina_view_from_here(scan=0, camera=True) == {'FINISHED'}, "of a scan, with a camera")
        check(scene.camera != camera and camera.name in bpy.data.objects, "a new camera")
        check_close(np.array(scene.camera.matrix_world.translation) / scale, PLACES[0], 1e-4, "the camera")
        check(scene.camera.data.clip_start < 0.02 * scale, f"{scene.camera.data.clip_start}")
        scene.patina.surface = 'FILL'
        scene.patina.fill = 'CLOSED'
        depth = render()["Depth"][..., 0]
        there = depth < 1e9
        check(there.mean() > 0.3 and 1.5 * scale < depth[there].min() < 12 * scale, f"{there.mean():.2f} is there, from {depth[there].min() / scale} on")


def test_view_says_what_f12_shows():
    """The view moves and the camera stays: a message says so, and how to render from here."""
    _, obj = room_scene()
    bpy.context.view_layer.objects.active = obj
    said = []
    operator = SimpleNamespace(scan=0, camera=False, report=lambda _kind, text: said.append(text))
    check(view_from_here.PATINA_OT_view_from_here.execute(operator, bpy.context) == {'FINISHED'}, f"{said}")
    check(len(said) == 1 and "Add Camera" in said[0], f"{said}")
    check(space_of() is None or "F12 shows the scene's camera" in said[0], f"{said}")


def test_view_where_the_scanner_looked():
    """A range image of a .conf looks in one direction; so does the view."""
    scene, obj = room_scene()
    from patina.read.importers import scans
    obj.data[scans.PROPERTY] = scans.packed([scans.Scan("a", 0, direction=(0.0, -1.0, 0.0)), scans.Scan("b", 0)])
    bpy.context.view_layer.objects.active = obj
    bpy.ops.view3d.patina_view_from_here(scan=0, camera=True)
    looks = scene.camera.matrix_world.to_quaternion() @ Vector((0, 0, -1))
    check_close(looks, (0, -1, 0), 1e-5, "it looks where the scanner looked")


def test_view_from_nowhere():
    scene = new_scene()
    obj, = import_ply(gray("no_station.ply", 1.0))
    bpy.context.view_layer.objects.active = obj
    check(not bpy.ops.view3d.patina_view_from_here.poll(), "points without stations")
    check("select a station" in view_from_here.why_not(obj), view_from_here.why_not(obj))
    scene, obj = room_scene()
    bpy.context.view_layer.objects.active = obj
    said = failing(bpy.ops.view3d.patina_view_from_here, scan=7)
    check("scan 7" in said and "0, 1" in said, said)


def test_set_up_fits_clip_distances():
    """Before a grain of sand and before a mountain: Clip Start and Clip End of camera and view hold the points, and what they frame."""
    for scale in (0.0005, 1.0, 50_000.0):
        scene = start_scene()
        obj, = import_ply(gray(f"clips_{scale:g}.ply", scale))
        check(bpy.ops.scene.patina_set_up() == {'FINISHED'}, "set up")
        scene.render.resolution_x, scene.render.resolution_y, scene.patina.device = 96, 64, 'CPU'
        for settings in filter(None, (scene.camera.data, space_of())):
            check(1e-4 * scale < settings.clip_start < 1e-2 * scale and settings.clip_end > 10.0 * scale, f"{scale}: {settings.clip_start} to {settings.clip_end}")
        picture = render()["Combined"][..., :3].max(axis=2)
        check((picture > 0.2).mean() > 0.1, f"scale {scale}: {(picture > 0.2).mean():.0%} of the image is bright")
    scene = start_scene()  # clip distances that somebody chose see no less than before
    bpy.ops.mesh.primitive_monkey_add()
    import_ply(gray("chosen_clips.ply", 1.0))
    scene.camera.data.clip_start, scene.camera.data.clip_end = 1e-5, 5e4
    bpy.ops.scene.patina_set_up()
    check_close((scene.camera.data.clip_start * 1e5, scene.camera.data.clip_end), (1.0, 5e4), 1e-3, "chosen ones")


def test_walk_leaves_the_preference():
    """Gravity is off while walk navigation starts, and as before afterward: also if walking fails."""
    settings, preferences = bpy.context.preferences.inputs.walk_navigation, bpy.context.preferences
    seen = []

    def fail():
        seen.append(settings.use_gravity)
        raise RuntimeError("no walking")

    first, dirty = settings.use_gravity, preferences.is_dirty
    try:
        for before in (True, False):
            settings.use_gravity = before
            preferences.is_dirty = False
            view_from_here.walk_without_gravity(bpy.context, lambda: seen.append(settings.use_gravity))
            try:
                view_from_here.walk_without_gravity(bpy.context, fail)
            except RuntimeError:
                pass
            check(settings.use_gravity == before and not preferences.is_dirty, f"gravity was {before}")
    finally:
        settings.use_gravity, preferences.is_dirty = first, dirty
    check(seen == [False] * 4, f"{seen}")
