# SPDX-License-Identifier: GPL-3.0-or-later
"""Scans that lie on their back or are tilted: the estimated vertical, the hint after an import, and Level."""

import math

import bpy
import check_linked  # noqa: F401  no test leaves files with the user
import numpy as np
from check_import import import_ply, write_ply
from harness import add_points, check, new_scene, points_of, sphere
from mathutils import Matrix, Vector
from patina import jobs
from patina.operators import level
from patina.read.importers import Progress

COUNT = 24_000
TILT = math.radians(17.0)


def room(seed=3, noise=0.004):
    """A room of 8 by 6 m, 2.7 m high, with floor and four walls, no ceiling, and a ball of 1 m on the floor: (n, 3), z up."""
    rng = np.random.default_rng(seed)
    x, y, z = rng.uniform((0, 0, 0), (8, 6, 2.7), (COUNT, 3)).T
    areas = np.array([48.0, 21.6, 21.6, 16.2, 16.2])
    side = rng.choice(5, COUNT, p=areas / areas.sum())
    points = np.stack([x, y, z], 1)
    for number, (axis, place) in enumerate(((2, 0.0), (1, 0.0), (1, 6.0), (0, 0.0), (0, 8.0))):
        points[side == number, axis] = place
    ball = sphere(1500, 0.5, (3, 3, 0.5))[0]
    return np.concatenate([points + rng.normal(0, noise, points.shape), ball])


def turned(angle, axis="X", heading=0.4):
    matrix = Matrix.Rotation(angle, 4, axis) @ Matrix.Rotation(heading, 4, 'Z')
    return room() @ np.array(matrix.to_3x3()).T


def off(obj, angle, axis="X"):
    """Degrees between the room's vertical, as the object shows it, and the world's."""
    up = obj.matrix_world.to_3x3() @ Matrix.Rotation(angle, 3, axis) @ Vector((0.0, 0.0, 1.0))
    return math.degrees(up.angle(Vector((0.0, 0.0, 1.0))))


def test_level_turns_upright():
    """A tilted room and one on its back, whatever the object's own matrix: to half a degree, around the middle. The points stay."""
    for angle, axis in ((TILT, 'X'), (-TILT, 'Y'), (math.radians(90), 'X'), (math.radians(3), 'X')):
        for matrix in (None, Matrix.Translation((50, -20, 7)) @ Matrix.Rotation(0.3, 4, 'Z') @ Matrix.Scale(2.0, 4)):
            new_scene()
            obj = add_points(turned(angle, axis), matrix=matrix)
            bpy.context.view_layer.objects.active = obj
            bpy.context.view_layer.update()
            before, middle = points_of(obj).copy(), np.array(obj.matrix_world @ (sum(map(Vector, obj.bound_box), Vector()) / 8))
            said = f"{math.degrees(angle):.0f} degrees about {axis}"
            check(off(obj, angle, axis) > 2.0, said)
            check(bpy.ops.object.patina_level() == {'FINISHED'}, said)
            bpy.context.view_layer.update()
            check(off(obj, angle, axis) < 0.5, f"{said}: {off(obj, angle, axis):.2f} degrees remain")
            check((points_of(obj) == before).all(), "the points moved in their own space")
            moved = np.array(obj.matrix_world @ (sum(map(Vector, obj.bound_box), Vector()) / 8))
            check(np.linalg.norm(moved - middle) < 1e-3, f"{said}: the middle moved by {np.linalg.norm(moved - middle)}")


def test_upright_and_unknown_stay():
    """An upright room, a ball without planes and a slope without walls are left alone; the last two with a message."""
    new_scene()
    slope = np.random.default_rng(4).uniform((0, 0, 0), (100, 100, 0.05), (20_000, 3)) @ np.array(Matrix.Rotation(math.radians(5), 3, 'X')).T
    for name, points in (("room", turned(0.0)), ("slope", slope), ("ball", sphere(8000, 1.0, (0, 0, 0))[0])):
        obj = add_points(points, name=name)
        bpy.context.view_layer.objects.active = obj
        before = obj.matrix_world.copy()
        check(bpy.ops.object.patina_level() == ({'FINISHED'} if name == "room" else {'CANCELLED'}), name)
        check(obj.matrix_world == before, f"{name} was turned")
    found = jobs.finish(level.estimate(obj, Progress()))
    check(found is None, f"the vertical of a ball: {found}")


def test_an_import_offers_level():
    """A tilted file is noted and imported as it is; an upright one is not noted. Level ends the hint, and undo takes it back in one step."""
    for name, angle in (("tilted.ply", TILT), ("upright.ply", 0.0)):
        new_scene()
        points = turned(angle)
        obj, = import_ply(write_ply(name, [(axis, "f4", points[:, i]) for i, axis in enumerate("xyz")]))
        tilt = obj.get(level.TILTED, 0.0)
        check(abs(tilt - math.degrees(angle)) < 0.5, f"{name}: noted as tilted by {tilt} degrees")
        check(abs(off(obj, angle) - math.degrees(angle)) < 0.01, f"{name} was turned")
    points = turned(TILT)
    obj, = import_ply(write_ply("tilted.ply", [(axis, "f4", points[:, i]) for i, axis in enumerate("xyz")]))
    obj.name = "room"
    bpy.ops.ed.undo_push(message="Import")
    check(bpy.ops.object.patina_level() == {'FINISHED'} and level.TILTED not in obj, "level")
    bpy.ops.ed.undo_push(message="Level")
    bpy.ops.ed.undo()
    obj = bpy.data.objects["room"]
    check(off(obj, TILT) > 16.0 and level.TILTED in obj, "one step of undo")


def test_esc_leaves_the_tilt_unknown():
    """Pressed while the vertical is estimated: the points are there, and nothing fails."""
    new_scene()
    obj, progress = add_points(turned(TILT)), Progress()
    steps = level.note(obj, progress)
    next(steps)
    progress.cancel()
    check(jobs.finish(steps) == "" and level.TILTED not in obj, "no hint")


def test_level_needs_points():
    """Linked clouds are leveled by the points of their files; meshes with faces, missing files and those that are read as needed are not."""
    new_scene()
    points = turned(TILT)
    obj, = import_ply(write_ply("tilted.ply", [(axis, "f4", points[:, i]) for i, axis in enumerate("xyz")]), link=True)
    bpy.context.view_layer.objects.active = obj
    check(bpy.ops.object.patina_level() == {'FINISHED'}, "linked")
    check(off(obj, TILT) < 0.5, f"linked: {off(obj, TILT):.2f} degrees remain")
    obj.patina.linked_file = "gone.ply"
    before = obj.matrix_world.copy()
    try:
        bpy.ops.object.patina_level()
    except RuntimeError as error:
        check("gone.ply is missing" in str(error), str(error))
    else:
        check(False, "a missing file was leveled")
    check(obj.matrix_world == before, "it moved")
    bpy.ops.mesh.primitive_cube_add()
    check(not bpy.ops.object.patina_level.poll(), "a mesh with faces")
