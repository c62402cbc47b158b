# SPDX-License-Identifier: GPL-3.0-or-later
"""Linked files that are missing or cannot be read, frames without points: a warning, and with --patina-strict a failure."""

import contextlib
import math
import subprocess
import sys

import bpy
from check_import import import_ply
from check_linked import dense
from check_sequence import link, scans, shown
from harness import (
    REPOSITORY,
    SCRATCH,
    Skip,
    add_light,
    add_points,
    check,
    drawn,
    failing_render,
    new_scene,
    render,
    reports,
    sphere,
    written,
)
from mathutils import Matrix


@contextlib.contextmanager
def strictly():
    before = sys.argv
    sys.argv = ["blender", "--", "--patina-strict"]
    try:
        yield
    finally:
        sys.argv = before


def spoil(path):
    """Its header promises what is not there any more."""
    path.write_bytes(path.read_bytes()[:-200])


def test_left_out_with_a_warning():
    """What is wrong with one file does not touch the others."""
    for name, harm in (("spoilt.ply", spoil), ("vanished.ply", lambda path: path.unlink())):
        new_scene()
        path = dense(name)
        import_ply(path, link=True)
        add_points(*sphere(3000, 0.5))
        harm(path)
        picture = render()
        check(len(drawn(picture)) > 100, f"{name}: an empty picture")
        said = [(kind, text) for kind, text in reports if str(path) in text]
        check([kind for kind, _ in said] == ['WARNING'], f"{name}: {reports}")
        with strictly():
            message = failing_render()
            check(str(path) in message and not written, message)


def nowhere(obj):
    """As a driver that divides by zero leaves it."""
    obj.matrix_world = Matrix.Translation((float("nan"), 0.0, 0.0))
    return obj


def test_objects_without_a_place():
    """What stands at a place that is no number is left out and named once, whatever it is; the others are drawn."""
    def face(name):
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
        bpy.context.scene.collection.objects.link(obj := bpy.data.objects.new(name, mesh))
        return obj

    def clip(name):
        bpy.context.scene.collection.objects.link(obj := bpy.data.objects.new(name, None))
        obj.patina.clip.shape = 'BOX'
        return obj

    def lamp(name):
        obj = add_light('POINT', 100.0)
        obj.name = name
        return obj

    def cloud(name):
        return add_points(*sphere(3000, 0.5), name=name)

    for make in (face, clip, lamp, cloud):
        scene = new_scene()
        add_points(*sphere(3000, 0.5))
        whole = len(drawn(render()))
        scene.patina.meshes = 'TRIANGLES'
        nowhere(make("nowhere"))
        check(len(drawn(render())) == whole > 100, f"{make.__name__}: {len(drawn(render()))} pixels where {whole} were")
        check([kind for kind, text in reports if "'nowhere'" in text] == ['WARNING'] and len(reports) == 1, f"{make.__name__}: {reports}")
        with strictly():
            check("'nowhere'" in failing_render(), make.__name__)
    bpy.ops.object.patina_frame_points()
    check(all(map(math.isfinite, scene.camera.location)), f"the camera went to {scene.camera.location[:]}")


def test_an_animation_goes_on():
    """Each frame is rendered; only those with the spoilt file warn."""
    link(scans("spoilt", (1, 2, 3)))
    spoilt = SCRATCH / "spoilt/scan_0002.ply"
    spoilt.write_bytes(spoilt.read_bytes()[:-20])
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 3
    scene.render.filepath = str(SCRATCH / "spoilt_frame_")
    reports.clear()
    bpy.ops.render.render(animation=True)
    check(all((SCRATCH / f"spoilt_frame_{frame:04}.png").exists() for frame in (1, 2, 3)), "every frame")
    check([text for kind, text in reports if kind == 'ERROR'] == [], f"{reports}")
    check(len([text for _, text in reports if str(spoilt) in text]) == 1, f"{reports}")


def test_a_spoilt_file_keeps_the_one_before():
    """As a missing one does; the warning names it once."""
    first = link(scans("kept_before", (1, 2, 3, 4)))
    folder = SCRATCH / "kept_before"
    for number in (2, 3):
        path = folder / f"scan_{number:04}.ply"
        path.write_bytes(path.read_bytes()[:-20])
        check(shown(number) == 1, f"frame {number}")
        said = [(kind, text) for kind, text in reports if path.name in text]
        check(len(said) == 1 and said[0][0] == 'WARNING' and said[0][1].count(path.name) == 1 and
              "scan_0001.ply stays" in said[0][1] and "cut short" in said[0][1], f"{reports}")
        with strictly():
            check(path.name in failing_render(), f"{reports}")
    check(shown(4) == 4 and not [text for _, text in reports if "cut short" in text], f"{reports}")
    (folder / "scan_0001.ply").write_bytes(b"ply")
    check(shown(3) == 0 and [text for _, text in reports if "left out" in text], f"none before it can be read: {reports}")
    check(first.name == "scan", first.name)


def test_nothing_to_draw():
    new_scene()
    check(not drawn(render()) and any("no visible object" in text for _, text in reports), f"{reports}")
    with strictly():
        check("no visible object" in failing_render(), f"{reports}")
        add_points(*sphere(3000))
        check(len(drawn(render())) > 100, "a whole picture is a picture")


def test_farm_learns_of_it():
    """Blender's exit code and what it wrote, as a farm's node starts it."""
    if not bpy.app.binary_path:
        raise Skip("needs Blender itself, not the module")
    new_scene()
    path = dense("farm.ply")
    import_ply(path, link=True)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 2
    scene.render.filepath = str(SCRATCH / "farm_")
    file = SCRATCH / "farm.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file), copy=True)
    start = SCRATCH / "farm_start.py"
    start.write_text(f"import sys\nsys.path.insert(0, {str(REPOSITORY / 'tests/blender')!r})\nimport harness, check_linked\n")
    command = [bpy.app.binary_path, "-b", "--factory-startup", "--python", str(start), str(file), "-E", "PATINA", "-a"]

    def farm(*options):
        for frame in SCRATCH.glob("farm_0*.png"):
            frame.unlink()
        done = subprocess.run([*command, "--", *options], capture_output=True, text=True, check=False)
        return done.returncode, len(list(SCRATCH.glob("farm_0*.png"))), done.stdout + done.stderr

    for options in ((), ("--patina-strict",)):
        code, frames, said = farm(*options)
        check((code, frames) == (0, 2), f"{options}: exit code {code}, {frames} frames: {said[-600:]}")
    spoil(path)
    code, frames, said = farm()
    check((code, frames) == (0, 2) and str(path) in said, f"exit code {code}, {frames} frames: {said[-600:]}")
    code, frames, said = farm("--patina-strict")
    check(code != 0 and frames == 0 and str(path) in said, f"strict: exit code {code}, {frames} frames: {said[-600:]}")
