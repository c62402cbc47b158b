# SPDX-License-Identifier: GPL-3.0-or-later
"""Turntable, Walk-Through and Reveal: ordinary keyframes, and what their frames show."""

import math

import bpy
import check_linked  # noqa: F401  no test leaves files with the user
import numpy as np
from check_import import import_ply, write_ply
from check_scans import WALL, text_file
from harness import add_points, check, check_close, new_scene, render
from mathutils import Matrix, Vector
from patina.operators import keys, tour

FAR = (5_000_000.0, 5_000_000.0, 500.0)


def bar(name="bar"):
    """A long flat bar of points: of another width from each side."""
    grid = np.stack(np.meshgrid(np.linspace(-4, 4, 60), np.linspace(-1, 1, 20), np.linspace(0, 1, 8), indexing='ij'), -1)
    positions = grid.reshape(-1, 3)
    colors = np.tile(np.uint8((200, 120, 40, 255)), (len(positions), 1))
    return positions, colors


def failing(operator, **options):
    try:
        operator(**options)
    except RuntimeError as error:
        return str(error)
    raise AssertionError("the operator did not fail")


def scene_of_bar(link=False, matrix=None):
    scene = new_scene(96, 64)
    scene.frame_start, scene.frame_end = 1, 40
    positions, colors = bar()
    if link:
        path = write_ply("bar.ply", [(axis, "f8", positions[:, i]) for i, axis in enumerate("xyz")]
                         + [(name, "u1", colors[:, i]) for i, name in enumerate(("red", "green", "blue"))])
        obj, = import_ply(path, link=True)
    else:
        obj = add_points(positions, colors, name="bar")
    if matrix:
        obj.matrix_world = matrix
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    bpy.context.view_layer.update()
    return scene, obj


def angle_at(scene, frame, center):
    """Of the camera around a place, seen from above."""
    scene.frame_set(frame)
    bpy.context.view_layer.update()
    away = scene.camera.matrix_world.translation - Vector(center)
    return math.atan2(away.y, away.x)


def test_turntable_frames_all_angles():
    """The whole cloud stays in the image and touches no border, and the image is well filled: imported, linked, and far away."""
    for link, place in ((False, (0, 0, 0)), (True, (0, 0, 0)), (False, FAR)):
        scene, obj = scene_of_bar(link, Matrix.Translation(place))
        old = scene.camera
        check(bpy.ops.object.patina_turntable() == {'FINISHED'}, "turntable")
        camera = scene.camera
        check(camera != old and camera.name.startswith("Turntable") and old.name in bpy.data.objects, camera.name)
        widest = 0.0
        for frame in range(1, 41, 3):
            scene.frame_set(frame)
            picture = render()["Combined"][..., 3] > 0.5
            rows, columns = np.nonzero(picture)
            said = f"link {link}, at {place}, frame {frame}"
            check(len(rows), f"{said}: nothing is drawn")
            edge = picture[0].any() or picture[-1].any() or picture[:, 0].any() or picture[:, -1].any()
            check(not edge, f"{said}: points touch the border")
            widest = max(widest, np.ptp(columns) / picture.shape[1], np.ptp(rows) / picture.shape[0])
        check(widest > (0.7 if place == FAR else 0.8), f"link {link}, at {place}: it fills {widest:.0%} of the image")


def test_turntable_turns_evenly():
    """Constant speed, from frame to frame and from the last frame to the first; options are followed, and keys are ordinary ones."""
    scene, obj = scene_of_bar()
    bpy.ops.object.patina_turntable()
    center = (0.0, 0.0, 0.5)
    angles = np.unwrap([angle_at(scene, frame, center) for frame in (*range(1, 41), 1)])
    check_close(np.diff(angles), np.full(40, 2 * math.pi / 40), 1e-4, "steps of the turn, the loop's too")
    check_close(angles[0], -math.pi / 2, 1e-4, "it starts at the front")
    pivot = scene.camera.parent
    curve, = keys.curves_of(pivot)
    check([point.interpolation for point in curve.keyframe_points] == ['LINEAR'] * 2, "linear keys")
    check(len(curve.keyframe_points) == 2 and curve.data_path == "rotation_euler", f"{curve.data_path}")
    scene, obj = scene_of_bar()
    bpy.ops.object.patina_turntable(frames=10, turns=2.0, direction='RIGHT', elevation=math.radians(45))
    check(scene.frame_end == 10, f"the scene ends at {scene.frame_end}")
    angles = np.unwrap([angle_at(scene, frame, center) for frame in range(1, 11)])
    check_close(np.diff(angles), np.full(9, -4 * math.pi / 10), 1e-4, "two turns clockwise")
    away = scene.camera.matrix_world.translation - Vector(center)
    looks = scene.camera.matrix_world.to_quaternion() @ Vector((0, 0, -1))
    check_close(math.degrees(math.asin(-looks.z)), 45.0, 1e-3, "elevation")
    check(away.z > 0, "from above")


def test_one_undo_step():
    """Undo takes away all that an operator added, and the scene has its camera and frames again."""
    for call, options in (("patina_turntable", {"frames": 30}), ("patina_reveal", {"by": 'HEIGHT', "frames": 30})):
        scene_of_bar()
        bpy.ops.ed.undo_push(message="before")
        before = sorted(obj.name for obj in bpy.data.objects)
        getattr(bpy.ops.object, call)('EXEC_DEFAULT', True, **options)
        check(len(bpy.data.objects) > len(before) and bpy.context.scene.frame_end == 30, f"{call}: nothing was added")
        bpy.ops.ed.undo()
        scene = bpy.context.scene
        check(sorted(obj.name for obj in bpy.data.objects) == before, f"{call}: {[obj.name for obj in bpy.data.objects]}")
        check(scene.frame_end == 40 and scene.camera.name == "camera", f"{call}: {scene.frame_end}, {scene.camera.name}")


def test_turntable_needs_points():
    new_scene()
    check(not bpy.ops.object.patina_turntable.poll() and not bpy.ops.object.patina_walk_through.poll(), "without points")
    scene = new_scene()
    add_points([(math.nan, 0.0, 0.0)] * 3)
    before = set(bpy.data.objects)
    check("no points to orbit" in failing(bpy.ops.object.patina_turntable), "points without a place")
    check(set(bpy.data.objects) == before and scene.camera.name == "camera", "something was added")
    new_scene()
    add_points([(3.0, 4.0, 5.0)])
    check(bpy.ops.object.patina_turntable() == {'FINISHED'}, "one point")
    check(render()["Combined"][..., 3].any(), "one point is seen")


def stations_file(name, places):
    """A PTX file with a scan at each place."""
    text = ""
    for x, y, z in places:
        text += f"3\n2\n{x} {y} {z}\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n{x} {y} {z} 1\n" + WALL
    return text_file(name, text)


ROOM = [(0, 0, 1.6), (12, 0, 1.6), (4, 0, 1.6), (12, 6, 1.9), (8, 0.5, 1.6)]


def test_walk_through_stations():
    """The camera passes each station at its height, in the order of a short tour, and looks along its path."""
    for link in (False, True):
        scene = new_scene()
        scene.frame_start, scene.frame_end = 1, 100
        bpy.ops.import_scene.patina_points(filepath=str(stations_file("tour.ptx", ROOM)), link=link)
        check(bpy.ops.object.patina_walk_through() == {'FINISHED'}, "walk")
        camera = scene.camera
        check(camera.name.startswith("Walk-Through") and camera.data.lens == 24.0, camera.name)
        curves = {(curve.data_path, curve.array_index): curve for curve in keys.curves_of(camera)}
        places = np.array([[point.co[1] for point in curves["location", axis].keyframe_points] for axis in range(3)]).T
        check_close(places, [ROOM[i] for i in (0, 2, 4, 1, 3)], 1e-4, f"link {link}: the order of stations")
        frames = [point.co[0] for point in curves["location", 0].keyframe_points]
        check(frames[0] == 1 and frames[-1] == 100, f"{frames}")
        lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
        check_close(np.diff(frames) / 99, lengths / lengths.sum(), 1e-4, "constant speed from station to station")
        check({point.interpolation for curve in curves.values() for point in curve.keyframe_points} == {'BEZIER'}, "Bezier keys")
        for index, (start, end) in enumerate(zip(places[:-1], places[1:], strict=True)):
            middle = 0.5 * (frames[index] + frames[index + 1])
            scene.frame_set(int(middle), subframe=middle % 1)
            looks = camera.matrix_world.to_quaternion() @ Vector((0, 0, -1))
            check_close(looks, Vector(end - start).normalized(), 1e-3, f"between stations {index} and {index + 1}")
            check(camera.matrix_world.to_quaternion() @ Vector((0, 1, 0)) @ Vector((0, 0, 1)) > 0.9, "it is upright")
        first = bpy.data.objects[next(obj.name for obj in bpy.data.objects if obj.get("patina_station") == 0)]
        second = next(obj for obj in bpy.data.objects if obj.get("patina_station") == 1)
        bpy.ops.object.select_all(action='DESELECT')
        for empty in (first, second):
            empty.select_set(True)
        bpy.ops.object.patina_walk_through(reverse=True, height=0.5, frames=20)
        curves = {(curve.data_path, curve.array_index): curve for curve in keys.curves_of(scene.camera)}
        places = np.array([[point.co[1] for point in curves["location", axis].keyframe_points] for axis in range(3)]).T
        check_close(places, [(12, 0, 2.1), (0, 0, 2.1)], 1e-4, "two chosen stations, reversed and higher")
        check(scene.frame_end == 20, f"{scene.frame_end}")


def test_walk_through_needs_stations():
    for places, part in (([], "have no stations"), (ROOM[:1], "one station")):
        scene = new_scene()
        if places:
            bpy.ops.import_scene.patina_points(filepath=str(stations_file("one.ptx", places)))
        else:
            add_points(bar()[0])
        camera, before = scene.camera, len(bpy.data.objects)
        said = failing(bpy.ops.object.patina_walk_through)
        check(part in said and "at least two" in said, said)
        check(scene.camera == camera and len(bpy.data.objects) == before, "something was added")


def test_tours_are_short():
    """Of places in a circle, in any order, the tour is around it; and of random ones within 8 % of the best tour that many tries find."""
    rng = np.random.default_rng(3)
    angle = np.sort(rng.uniform(0, 2 * np.pi, 60))
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1)
    mixed = rng.permutation(60)
    found = mixed[tour.order(circle[mixed])]
    steps = np.diff(found) % 60
    check(set(steps.tolist()) in ({1}, {59}), f"around the circle: {found}")
    for _ in range(3):
        places = rng.uniform(0, 1, (8, 3))
        away = np.linalg.norm(places[:, None] - places[None], axis=2)
        mine = tour.order(places)
        best = np.inf
        for _ in range(20_000):
            other = rng.permutation(8)
            best = min(best, away[other[:-1], other[1:]].sum())
        check(sorted(mine) == list(range(8)) and away[mine[:-1], mine[1:]].sum() < 1.08 * best, f"{away[mine[:-1], mine[1:]].sum():.3f} {best:.3f}")
    check(tour.order(np.array([(1, 1, 1)] * 3 + [(2, 2, 2.0)])) == [0, 3], "places that repeat are left out")
    check(tour.order(np.zeros((0, 3))) == [] and tour.order(np.zeros((1, 3))) == [0], "few")


# ---- Reveal ----------------------------------------------------------------------------------------------------------


def wall(link=False, place=(0, 0, 0), scalars=True):
    """(scene, object, (n, 3) places): a wall of points that fills the image; classes 2, 5 and 6 from left to right, times from the right."""
    scene = new_scene(64, 48)
    scene.frame_start, scene.frame_end = 1, 12
    scene.patina.surface = 'FILL'
    x, z = (values.ravel() for values in np.meshgrid(np.linspace(-2, 2, 41), np.linspace(-1.5, 1.5, 31)))
    positions = np.stack([x, 0 * x, z], 1)
    named = {"classification": np.select([x < -0.7, x < 0.7], [2, 5], 6), "gps_time": 1000.0 - 100.0 * x}
    colors = np.tile(np.uint8((200, 120, 40, 255)), (len(x), 1))
    if link:
        path = write_ply("wall.ply", [(axis, "f8", positions[:, i]) for i, axis in enumerate("xyz")]
                         + [(name, "u1", colors[:, i]) for i, name in enumerate(("red", "green", "blue"))]
                         + [(name, "f4", values) for name, values in named.items()])
        obj, = import_ply(path, link=True)
    else:
        obj = add_points(positions, colors)
        for name, values in named.items() if scalars else ():
            obj.data.attributes.new(name, 'FLOAT', 'POINT').data.foreach_set("value", np.float32(values))
    obj.patina.analysis = 'OFF'
    obj.matrix_world = Matrix.Translation(place) @ obj.matrix_world
    scene.camera.data.type, scene.camera.data.ortho_scale = 'ORTHO', 5.0
    scene.camera.matrix_world = Matrix.Translation(Vector(place) + Vector((0, -8, 0))) @ Matrix.Rotation(math.pi / 2, 4, 'X')
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.context.view_layer.update()
    return scene, obj, positions


def shown(scene, frame, positions):
    """(n,) bool: which points the image of a frame shows."""
    scene.frame_set(frame)
    bpy.context.view_layer.update()
    alpha = render()["Combined"][..., 3]
    height, width = alpha.shape
    column, row = (positions[::7, 0] / 5.0 + 0.5) * width, positions[::7, 2] / 5.0 * width + 0.5 * height
    near = [alpha[(row + dy).astype(int), (column + dx).astype(int)] for dx in (-0.02, 0.02) for dy in (-0.02, 0.02)]  # points on a pixel's edge
    return np.max(near, axis=0) > 0.5


def grows(scene, positions, value, vanish=False, slack=0.05):
    """Nothing at the first frame, all at the last; between them the share that the frame says, those of the least values."""
    order = value[::7]
    for frame in (1, 4, 7, 10, 12):
        seen = shown(scene, frame, positions)
        share = (12 - frame if vanish else frame - 1) / 11
        limit = order.min() + share * np.ptp(order)
        span = slack * np.ptp(order)
        sure_in, sure_out = order < limit - span, order > limit + span
        if share in (0.0, 1.0):
            sure_in, sure_out = np.full(len(order), share == 1.0), np.full(len(order), share == 0.0)
        check(seen[sure_in].all() and not seen[sure_out].any(), f"frame {frame}: {seen[sure_in].mean() if sure_in.any() else 1:.2f} of the "
              f"points that appeared, {seen[sure_out].mean() if sure_out.any() else 0:.2f} of the others")


def test_reveal_by_height():
    """A clip plane rises, or falls; linked and far away, too."""
    for link, place, invert, vanish in ((False, (0, 0, 0), False, False), (True, (0, 0, 0), True, False), (False, FAR, False, False),
                                        (False, (0, 0, 0), False, True)):
        scene, obj, positions = wall(link, place)
        check(bpy.ops.object.patina_reveal(by='HEIGHT', invert=invert, vanish=vanish) == {'FINISHED'}, "reveal")
        plane = next(item for item in bpy.data.objects if item.name.startswith("Reveal Plane"))
        check(plane.patina.clip.shape == 'PLANE' and [curve.data_path for curve in keys.curves_of(plane)] == ["location"], "the keys")
        grows(scene, positions, -positions[:, 2] if invert else positions[:, 2], vanish)


def test_reveal_by_height_keeps_strays_short():
    """A point at ten heights above takes the last frame alone; at that frame it shows, too."""
    scene, obj, positions = wall(scalars=False)
    tall = np.concatenate([positions, [(0.0, 0.0, 30.0)]])
    bpy.data.objects.remove(obj)
    obj = add_points(np.concatenate([tall, np.repeat(positions, 3, 0)]))
    obj.patina.analysis = 'OFF'
    obj.select_set(True)
    bpy.context.view_layer.update()
    bpy.ops.object.patina_reveal(by='HEIGHT')
    check(0.3 < shown(scene, 6, positions).mean() < 0.7, f"in the middle {shown(scene, 6, positions).mean():.2f} is there")
    plane = bpy.data.objects["Reveal Plane"]
    scene.frame_set(12)
    check(plane.location.z > 30.0, f"in the end the plane is at {plane.location.z}")


def test_reveal_by_time_and_distance():
    """The threshold of soft points that are hidden is keyed: by an attribute, and by the distance from an empty."""
    for link in (False, True):
        scene, obj, positions = wall(link)
        options = {"attribute": "gps_time"} if link else {}
        check(bpy.ops.object.patina_reveal(by='TIME', **options) == {'FINISHED'}, "reveal")
        check(obj.patina.soft.attribute == "gps_time" and obj.patina.soft.hide, obj.patina.soft.attribute)
        grows(scene, positions, -positions[:, 0])
    scene, obj, positions = wall()
    bpy.ops.object.patina_reveal(by='TIME', invert=True)
    grows(scene, positions, positions[:, 0])
    for link in (False, True):
        scene, obj, positions = wall(link)
        bpy.ops.object.patina_reveal(by='DISTANCE', vanish=link)
        check(obj.patina.soft.target.name == "Reveal Center", obj.patina.soft.target.name)
        grows(scene, positions, np.linalg.norm(positions, axis=1), vanish=link)
    scene, obj, positions = wall()
    corner = bpy.data.objects.new("corner", None)
    corner.location = (-2, 0, -1.5)
    scene.collection.objects.link(corner)
    corner.select_set(True)
    bpy.context.view_layer.update()
    bpy.ops.object.patina_reveal(by='DISTANCE')
    check(obj.patina.soft.target == corner, "the selected empty is the center")
    grows(scene, positions, np.linalg.norm(positions - (-2, 0, -1.5), axis=1))


def test_reveal_by_class():
    """One class after another; classes that the user has hidden stay so."""
    for link in (False, True):
        scene, obj, positions = wall(link)
        check(bpy.ops.object.patina_reveal(by='CLASS') == {'FINISHED'}, "reveal")
        classes = np.select([positions[:, 0] < -0.7, positions[:, 0] < 0.7], [2, 5], 6)[::7]
        inside = np.abs(np.abs(positions[::7, 0]) - 0.7) > 0.15
        for frame, there in ((1, {2}), (4, {2}), (5, {2, 5}), (8, {2, 5}), (9, {2, 5, 6}), (12, {2, 5, 6})):
            seen, wanted = shown(scene, frame, positions), np.isin(classes, list(there))
            check((seen == wanted)[inside].all(), f"link {link}, frame {frame}: {(seen != wanted)[inside].mean():.2f} are wrong")
    check({point.interpolation for curve in keys.curves_of(obj) for point in curve.keyframe_points} == {'CONSTANT'}, "constant keys")
    bpy.ops.object.patina_reveal(by='CLASS', invert=True)
    seen = shown(scene, 1, positions)
    check((seen == (classes == 6))[inside].all(), "again, from the last class")
    scene, obj, positions = wall()
    obj.patina.colors.hidden[5] = True
    bpy.ops.object.patina_reveal(by='CLASS')
    seen = shown(scene, 12, positions)
    check((seen == (classes != 5))[inside].all(), "a hidden class stays hidden")


def test_reveal_refuses():
    """One message each, and nothing changes."""
    scene, obj, _ = wall(scalars=False)
    before = set(bpy.data.objects)
    for by, part in (('TIME', "no attribute for the time"), ('CLASS', "at least two")):
        said = failing(bpy.ops.object.patina_reveal, by=by)
        check(part in said, said)
    said = failing(bpy.ops.object.patina_reveal, by='TIME', attribute="there is none")
    check("no attribute 'there is none'" in said and not obj.patina.soft.use and not obj.patina.soft.attribute, said)
    obj.patina.soft.use = True
    said = failing(bpy.ops.object.patina_reveal, by='DISTANCE')
    check("has soft points" in said and not obj.patina.soft.hide, said)
    check(set(bpy.data.objects) == before and not obj.animation_data, "something was added")
    scene, obj, _ = wall(link=True)
    obj.patina.colors.source, obj.patina.colors.scalar = 'SCALAR', "classification"
    said = failing(bpy.ops.object.patina_reveal, by='TIME', attribute="gps_time")
    check("holds one column" in said and not obj.patina.soft.use, said)


def test_hidden_by_an_attribute():
    """Soft Points > Hide without keys: points above the threshold are not drawn and cast no shadow."""
    scene, obj, positions = wall()
    group = obj.patina.soft
    group.use, group.by, group.attribute, group.hide = True, 'ATTRIBUTE', "classification", True
    group.use_range, group.range_min, group.range_max, group.threshold = True, 0.0, 10.0, 0.3
    obj.update_tag()
    seen, wanted = shown(scene, 1, positions), (positions[:, 0] < -0.7)[::7]
    inside = np.abs(positions[::7, 0] + 0.7) > 0.15
    check((seen == wanted)[inside].all(), f"{(seen != wanted)[inside].mean():.2f} are wrong")
    group.hide = False
    alpha = render()["Combined"][..., 3]
    check(((alpha > 0.1) & (alpha < 0.99)).mean() > 0.2, "soft balls again")
    group.hide, group.by = True, 'ALL'
    alpha = render()["Combined"][..., 3]
    check(((alpha > 0.1) & (alpha < 0.99)).mean() > 0.2, "all points soft: Hide does nothing")
