# SPDX-License-Identifier: GPL-3.0-or-later
"""Send to Farm: the folder that it writes, and that its tasks draw what F12 draws, in Blenders of their own."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
from check_import import import_ply
from check_linked import dense
from harness import REPOSITORY, SCRATCH, Skip, add_points, check, forget_files, new_scene, render
from patina import native
from patina.farm import task
from patina.read import importers
from patina.sync.points import built, linked


def pixels_of(path):
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = 'Non-Color'
    flat = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(flat)
    bpy.data.images.remove(image)
    return flat


def clean_scene():
    """Without the materials, images and volumes of other tests: a job names their files."""
    scene = new_scene()
    for item in list(bpy.data.materials):
        bpy.data.materials.remove(item)
    forget_files()
    return scene


def scene_of_points():
    scene = clean_scene()
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 61, 47, 100
    scene.render.image_settings.file_format, scene.render.image_settings.color_mode = 'PNG', 'RGBA'
    scene.render.dither_intensity = 0.0  # grain is of the whole picture
    scene.frame_start, scene.frame_end, scene.frame_step = 1, 3, 2
    draw = np.random.default_rng(4)
    points = draw.uniform(-1, 1, (4000, 3))
    obj = add_points(points, draw.integers(30, 255, (4000, 4), dtype=np.uint8))
    for frame, angle in ((1, 0.0), (3, 0.7)):
        obj.rotation_euler[2] = angle
        obj.keyframe_insert("rotation_euler", frame=frame)
    return scene


def farm_blender():
    """A Blender that starts with the add-on of this tree, as a farm's would with one installed."""
    program = bpy.app.binary_path or ""
    if not program:
        raise Skip("this Blender is a module: a farm's is a program")
    package = SCRATCH / "farm" / "patina"
    if not package.exists():
        package.parent.mkdir(exist_ok=True)
        package.symlink_to(REPOSITORY / "addon", target_is_directory=True)
    script = SCRATCH / "farm" / "blender"
    script.write_text(f'#!/bin/sh\n[ "$1" = --version ] && exec "{program}" --version\nexec "{program}" --factory-startup "$@"\n', encoding="utf-8")
    script.chmod(0o755)
    return dict(os.environ, PATINA_BLENDER=str(script), PATINA_ADDON=str(package), PYTHONDONTWRITEBYTECODE="1")


def run_task(folder, *arguments, env, code=0):
    # Debian's Blender finds its modules by the first python3 of the path: the one that it was built for
    python = "/usr/bin/python3" if Path("/usr/bin/python3").exists() else shutil.which("python3") or sys.executable
    done = subprocess.run([python, folder / "task.py", *map(str, arguments)], env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          check=False)
    check(done.returncode == code, f"{arguments}: {done.returncode}: {done.stdout[-1500:]}")
    return done.stdout


def refused(part, **options):
    try:
        bpy.ops.render.patina_farm(directory=str(SCRATCH / "no-farm"), **options)
    except RuntimeError as error:
        check(part in str(error), str(error))
    else:
        check(False, f"no refusal: {part}")
    check(not (SCRATCH / "no-farm").exists(), "a folder was written")


def test_farm_draws_frames():
    env = farm_blender()
    scene = scene_of_points()
    scene.render.filepath = str(SCRATCH / "film" / "f_##")
    folder = SCRATCH / "film-farm"
    bpy.ops.render.patina_farm(directory=str(folder), kind='FRAMES')
    job = json.loads((folder / "job.json").read_text("utf-8"))
    check(job["frames"] == [1, 3] and job["by"] == "blender" and job["version"] == f"Blender {bpy.app.version_string}", f"{job}")
    check(all((folder / name).is_file() for name in ("slurm.py", "template.json", "patina.js", "README.txt", "scene.blend")), "files are missing")
    run_task(folder, "check", env=env)
    for frame in (1, 3):
        run_task(folder, "frame", frame, env=env)
        scene.frame_set(frame)
        scene.render.filepath = str(SCRATCH / f"whole{frame}.png")
        bpy.ops.render.render(write_still=True)
        check(np.array_equal(pixels_of(SCRATCH / "film" / f"f_{frame:02d}.png"), pixels_of(SCRATCH / f"whole{frame}.png")), f"frame {frame} differs")
    check(not np.array_equal(pixels_of(SCRATCH / "whole1.png"), pixels_of(SCRATCH / "whole3.png")), "nothing moves")
    check("has no frame 2" in run_task(folder, "frame", 2, env=env, code=1), "frame 2")
    job["addon"] = [9, 9, 9]
    (folder / "job.json").write_text(json.dumps(job), encoding="utf-8")
    check("made with Patina 9.9.9" in run_task(folder, "frame", 1, env=env, code=1), "another version of the add-on")


def test_farm_draws_tiles():
    env = farm_blender()
    scene = scene_of_points()
    scene.frame_set(3)
    scene.render.filepath = str(SCRATCH / "still.png")
    folder = SCRATCH / "still-farm"
    bpy.ops.render.patina_farm(directory=str(folder), kind='TILES', columns=3, rows=1)
    for tile in (1, 2):
        run_task(folder, "tile", tile, env=env)
    check("tile 3 of 3 x 1 has not run" in run_task(folder, "merge", env=env, code=1), "tile 3 is not named")
    run_task(folder, "tile", 3, env=env)
    run_task(folder, "merge", env=env)
    scene.render.filepath = str(SCRATCH / "whole.png")
    bpy.ops.render.render(write_still=True)
    merged, whole = pixels_of(SCRATCH / "still.png"), pixels_of(SCRATCH / "whole.png")
    check(merged.shape == whole.shape and np.array_equal(merged, whole), f"{np.abs(merged - whole).max() * 255:.1f} of 255 off")
    check(whole.reshape(-1, 4)[:, 3].min() < whole.reshape(-1, 4)[:, :3].max(), "nothing to be seen")


def test_farm_refuses():
    scene = scene_of_points()
    scene.render.filepath = str(SCRATCH / "x.png")
    scene.render.use_border = True
    refused("Render Region", kind='TILES')
    scene.render.use_border = False
    scene.patina.noise = 0.01
    refused("noise threshold", kind='TILES')
    scene.patina.noise = 0.0
    refused("too small", kind='TILES', columns=40, rows=40)
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = 'MULTI_LAYER_IMAGE'
    settings.file_format = 'OPEN_EXR_MULTILAYER'
    refused("multilayer", kind='TILES', columns=2, rows=2)
    if hasattr(settings, "media_type"):
        settings.media_type = 'IMAGE'
    settings.file_format = 'PNG'
    image = bpy.data.images.new("gone", 4, 4)
    image.source, image.filepath = 'FILE', str(SCRATCH / "gone.png")
    image.use_fake_user = True  # as if a material had it
    refused("gone.png cannot be read")
    bpy.data.images.remove(image)
    scene.camera = None
    refused("no camera")


def test_farm_asks_for_nothing_that_is_gone():
    """What objects that are deleted have left behind, until Blender begins anew, may miss its file."""
    scene = scene_of_points()
    scene.render.filepath = str(SCRATCH / "left" / "x.png")
    gone = dense("left_behind.ply")
    obj, = import_ply(gone, link=True)
    gone.unlink()
    refused("left_behind.ply cannot be read")
    bpy.data.objects.remove(obj)
    bpy.data.images.new("left", 4, 4).source = 'FILE'
    bpy.data.images["left"].filepath = str(SCRATCH / "left.png")
    check([volume.users for volume in bpy.data.volumes if "left_behind" in volume.filepath] == [0], "nothing is left behind")
    check(bpy.ops.render.patina_farm(directory=str(SCRATCH / "left-farm")) == {'FINISHED'}, "refused")
    files = json.loads((SCRATCH / "left-farm" / "job.json").read_text("utf-8"))["files"]
    check([Path(name).name for name in files] == ["scene.blend"], f"{files}")
    bpy.data.images.remove(bpy.data.images["left"])


def test_farm_shares_built_clouds():
    """A machine whose own folder holds nothing finds what is kept beside the scan, and reads the scan no more."""
    folder = SCRATCH / "shared"
    folder.mkdir()
    clean_scene()
    obj, = import_ply(dense("shared/scan.ply"), link=True)
    whole = render()["Combined"].copy()
    own = linked.source_of(obj, 1, []).kept
    check(own.is_file() and own.parent != folder, f"{own}")
    bpy.context.scene.render.filepath = str(folder / "x.png")
    bpy.ops.render.patina_farm(directory=str(folder / "job"), kind='FRAMES')
    shared = folder / ".patina" / own.name
    check(shared.read_bytes() == own.read_bytes() and shared.with_suffix(".json").is_file(), "nothing is beside the scan")
    aside = own.with_suffix(".aside")
    own.rename(aside)
    steps, importers.steps = importers.steps, None  # whoever reads the scan fails
    try:
        source = linked.source_of(obj, 1, [])
        check(source.kept == shared, f"{source.kept}")
        built.CACHE.clear()
        check((render()["Combined"] == whole).all(), "it looks different")
    finally:
        importers.steps = steps
        built.CACHE.clear()
        aside.rename(own)


# Runs in each of several Blenders before the file is opened: none builds a cloud until all of them are about to.
_TOGETHER = """
import os, sys, time
from pathlib import Path
sys.path.insert(0, str(Path(os.environ["PATINA_ADDON"]).parent))
import patina
from patina.sync.points import linked
patina.register()
here, make = Path({folder!r}), linked._make

def together(*arguments):
    (here / str(os.getpid())).touch()
    until = time.monotonic() + 100
    while len(list(here.iterdir())) < 3 and time.monotonic() < until:
        time.sleep(0.002)
    yield from ()
    return (yield from make(*arguments))

linked._make = together
"""


def test_three_build_one_cloud_at_once():
    """Two Blenders and a task of a farm: each draws the same image, and one whole file is left of what they built and analyzed."""
    env = farm_blender()
    folder, cache, met = (SCRATCH / f"at-once{end}" for end in ("", "-cache", "-met"))
    for place in (folder, cache, met):
        place.mkdir()
    scene = clean_scene()
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 61, 47, 100
    scene.render.image_settings.file_format, scene.render.dither_intensity = 'PNG', 0.0
    scene.camera.location.z = 5.0  # scans lie at zero
    obj, = import_ply(dense("at-once/scan.ply", 30000), link=True)
    scene.render.filepath = str(SCRATCH / "alone.png")
    bpy.ops.render.render(write_still=True)
    alone = pixels_of(SCRATCH / "alone.png")
    check(len(np.unique(alone)) > 20, "nothing is drawn")
    own = linked.source_of(obj, 1, []).kept
    scene.render.filepath = str(folder / "task-#.png")
    bpy.ops.render.patina_farm(directory=str(folder / "job"), kind='FRAMES')
    shutil.rmtree(folder / ".patina")  # what the job brought along
    script, together = Path(env["PATINA_BLENDER"]).with_name("together"), met.with_suffix(".py")
    together.write_text(_TOGETHER.replace("{folder!r}", repr(str(met))), encoding="utf-8")
    script.write_text(f'#!/bin/sh\n[ "$1" = --version ] && exec "{bpy.app.binary_path}" --version\n'
                      f'exec "{bpy.app.binary_path}" --factory-startup --python-exit-code 1 --python "{together}" "$@"\n', encoding="utf-8")
    script.chmod(0o755)
    env |= {"PATINA_BLENDER": str(script), "BLENDER_USER_DATAFILES": str(cache)}
    others = [subprocess.Popen([script, "-b", folder / "job/scene.blend", "-o", folder / f"{name}-#", "-f", "1"], env=env, stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT, text=True) for name in ("one", "two")]
    said = [run_task(folder / "job", "frame", 1, env=env), *(other.communicate(timeout=200)[0] for other in others)]
    check([other.returncode for other in others] == [0, 0], f"{said[1:]}"[-1500:])
    check(len(list(met.iterdir())) == 3, f"{len(list(met.iterdir()))} of 3 built: {said}"[-1500:])
    for name in ("task", "one", "two"):
        check(np.array_equal(pixels_of(folder / f"{name}-1.png"), alone), f"{name} differs")
    left = {path.name: path for path in cache.rglob("*") if path.is_file()}
    check(set(left) == {own.name, own.with_suffix(".json").name}, f"{sorted(left)}")
    check(left[own.name].read_bytes() == own.read_bytes(), "the cloud is another one")
    native.Cloud.start_verifying(left[own.name]).result()
    with native.Cloud.open(left[own.name]) as cloud:
        check(cloud.has_shapes and cloud.count == 30000, "it is not analyzed")


def test_farm_tasks_are_named():
    """Where frames go, by the name that Blender's output has."""
    for given, expected in (("a##.png", "a07.png"), ("a.png", "a0007.png"), ("b_######.exr", "b_000007.exr")):
        found = task.frame_path({"directory": "/x", "output": given}, 7)
        check(found.name == expected, f"{given}: {found}")
