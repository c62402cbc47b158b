# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of older versions: what their scenes meant is what they show."""

import contextlib

import bpy
import numpy as np
from harness import REPOSITORY, SCRATCH, add_points, check, new_scene, render, reports
from patina import migrate

CURRENT = len(migrate.STEPS)


@contextlib.contextmanager
def before_migration():
    """As an add-on that knew no versions: nothing is stamped."""
    migrate.unregister()
    try:
        yield
    finally:
        migrate.register()


def saved(name):
    path = str(SCRATCH / name)
    bpy.ops.wm.save_as_mainfile(filepath=path, check_existing=False)
    return path


def load(path):
    bpy.ops.wm.open_mainfile(filepath=path, load_ui=False)
    return bpy.context.scene


def test_an_old_file_keeps_its_picture():
    """A scene of before version 1 that said nothing of meshes left them out; it still does, and one that asked keeps that."""
    scene = new_scene()
    mine = scene.name
    scene.patina.property_unset("samples")
    check(scene.patina.version == 0, "a new scene has no stamp yet")
    asked = bpy.data.scenes.new("asked")
    asked.render.engine, asked.patina.meshes = 'PATINA', 'POINTS'
    other = bpy.data.scenes.new("other")
    other.render.engine = 'BLENDER_WORKBENCH'
    with before_migration():
        path = saved("old.blend")
    load(path)
    scenes = bpy.data.scenes
    check([scenes[name].patina.meshes for name in (mine, "asked")] == ['OFF', 'POINTS'], "meshes")
    check(scenes[mine].patina.is_property_set("meshes"), "what was meant is written down")
    check([scenes[name].patina.samples for name in (mine, "asked")] == [1, 1], "one sample was the default")
    check(not scenes["other"].patina.is_property_set("meshes"), "another engine's scene is left alone")
    check({scene.patina.version for scene in scenes} == {CURRENT}, "stamps")
    for name in ("asked", "other"):
        scenes.remove(scenes[name])


def test_a_present_file_is_left_alone():
    scene = new_scene()
    path = saved("present.blend")
    check(scene.patina.version == CURRENT, "saving stamps")
    check(not load(path).patina.is_property_set("meshes"), "a step was done again")


def test_steps_are_done_once_in_order():
    new_scene()
    with before_migration():
        path = saved("steps.blend")
    done, steps = [], migrate.STEPS
    migrate.STEPS = (lambda scene: done.append(1), lambda scene: done.append(2))
    try:
        load(path)
        check(done == [1, 2], f"steps {done}")
        scene = load(saved("steps.blend"))
        check(done == [1, 2] and scene.patina.version == 2, f"steps {done}")
        migrate.STEPS += (lambda scene: done.append(3),)
        load(path)
        check(done == [1, 2, 3], f"only the new one: {done}")
    finally:
        migrate.STEPS = steps


def test_a_newer_file_is_said():
    scene = new_scene()
    scene.patina.version = CURRENT + 1
    load(saved("newer.blend"))
    check(bpy.context.scene.patina.version == CURRENT + 1, "its stamp stays")
    add_points([(0, 0, -4)])
    render()
    check(any("newer version of Patina" in text for _, text in reports), f"{reports}")


def test_files_of_older_addons():
    """Written by old commits: tests/files/compatibility/README.md. They keep their look, and render."""
    for number in range(3):
        path = SCRATCH / f"settings-{number}.blend"
        path.write_bytes((REPOSITORY / "tests/files/compatibility" / path.name).read_bytes())
        scene = load(str(path))
        settings, points = scene.patina, scene.objects["points"]
        check(scene.render.engine == 'PATINA' and settings.version == CURRENT, f"{number}: version {settings.version}")
        check(settings.is_property_set("samples") and settings.samples == 1, f"{number}: one sample was the default")
        check(settings.is_property_set("meshes") == (number == 0) and (settings.meshes == 'OFF') == (number == 0), f"{number}: {settings.meshes}")
        check("hide_stray" not in (migrate._stored(points) or {}), f"{number}: the switch of strays is still there")
        planes = render()
        combined = planes["Combined"]
        check(combined.shape[:2] == (64, 96), f"{combined.shape}")
        color = combined[32, 30, :3]
        check(combined[32, 30, 3] == 1.0 and np.allclose(color, [1.0, 0.214, 0.0513], atol=0.01), f"{number}: {color}")
        check((combined[32, 88, 3] > 0.0) == (number > 0), f"{number}: the mesh is drawn from version 1 on")
