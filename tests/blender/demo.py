# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the demo picture: imports points through the operator, lights them, looks at them, saves a PNG; for a folder,
one in every style that is shipped, STYLE.png.

    blender -b --factory-startup --python-exit-code 1 --python tests/blender/demo.py -- FILE.ply OUT.png|FOLDER
    python tests/blender/demo.py FILE.ply OUT.png|FOLDER

PATINA_DEMO_PLY and PATINA_DEMO_PNG stand for missing arguments; PATINA_LIBRARY names the library;
PATINA_DEMO_LIT=1 lights points that have colours too; PATINA_DEMO_VIEW=32,14 looks from azimuth 32 and 14 degrees up;
PATINA_DEMO_SIZE=1024,1024 is the picture's; PATINA_DEMO_KEEP=0.6 keeps that middle part of the points' extent in view.
"""

import os
import shutil
import sys
import tempfile
import time
from math import radians, tan
from pathlib import Path

import bpy
import numpy as np
from mathutils import Euler

WIDTH, HEIGHT = (int(side) for side in os.environ.get("PATINA_DEMO_SIZE", "1280,960").split(","))
KEEP = float(os.environ.get("PATINA_DEMO_KEEP", "1"))
AZIMUTH, ELEVATION = (float(angle) for angle in os.environ.get("PATINA_DEMO_VIEW", "25,40").split(","))
# degrees around z from -y, and above the horizon
MARGIN = 1.05


def arguments():
    given = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:]
    if Path(sys.argv[0]).name != Path(__file__).name and "--" not in sys.argv:
        given = []
    source = given[0] if given else os.environ.get("PATINA_DEMO_PLY")
    target = given[1] if len(given) > 1 else os.environ.get("PATINA_DEMO_PNG")
    if not source or not target:
        sys.exit("demo.py: which PLY file, and where to save the picture?")
    return Path(source).resolve(), Path(target).resolve()


def load_addon(folder):
    (folder / "patina").symlink_to(Path(__file__).resolve().parents[2] / "addon", target_is_directory=True)
    sys.path.insert(0, str(folder))
    sys.dont_write_bytecode = True
    import patina
    patina.register()
    return patina


def import_points(path):
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    bpy.ops.import_scene.patina_points(filepath=str(path))
    return bpy.context.view_layer.objects.active


def finite_points(obj):
    from patina import point_data
    from patina.sync.points import attributes
    points = attributes.positions(obj.data, point_data.count_of(obj.data)).astype(np.float64)
    return points[np.isfinite(points).all(axis=1)] + np.array(obj.location)


def add_camera(scene, obj):
    """Looks down at the cloud from so near that it just fits: the frustum's four planes touch it."""
    data = bpy.data.cameras.new("camera")
    camera = bpy.data.objects.new("camera", data)
    camera.rotation_euler = Euler((radians(90 - ELEVATION), 0, radians(AZIMUTH)))
    axes = np.array(camera.rotation_euler.to_matrix(), np.float64)  # columns: right, up, back
    x, y, z = (finite_points(obj) @ axes).T
    place, away = [], []
    wide = 1 if WIDTH > HEIGHT else WIDTH / HEIGHT  # the angle is the larger side's
    for across, half in ((x, tan(data.angle / 2) * wide), (y, tan(data.angle / 2) * wide * HEIGHT / WIDTH)):
        half /= MARGIN
        high, low = (across + half * z).max(), (half * z - across).max()
        place.append((high - low) / 2)
        away.append((high + low) / 2 / half)
    back = max(away)
    middle = (z.max() + z.min()) / 2
    back = middle + (back - middle) * KEEP
    camera.location = axes @ (*place, back)
    data.clip_start, data.clip_end = max(back - z.max(), back - middle) * 0.05, (back - z.min()) * 1.1
    scene.collection.objects.link(camera)
    scene.camera = camera


def add_light_and_world(scene, obj):
    light = bpy.data.lights.new("sun", 'SUN')
    light.energy, light.color = 3.0, (1.0, 0.95, 0.88)
    sun = bpy.data.objects.new("sun", light)
    sun.rotation_euler = (radians(50), 0, radians(-35))
    scene.collection.objects.link(sun)
    world = scene.world or bpy.data.worlds.new("world")
    scene.world = world
    node = next((node for node in world.node_tree.nodes if node.bl_idname == 'ShaderNodeBackground'), None) \
        if world.node_tree else None
    if node:
        node.inputs["Color"].default_value = (0.16, 0.18, 0.21, 1)
        node.inputs["Strength"].default_value = 1.0
    else:
        world.color = (0.16, 0.18, 0.21)
    if os.environ.get("PATINA_DEMO_LIT") == "1":  # colours of generated clouds hold no light; scans' do
        obj.patina.lighting = 'LIT'


def save(target):
    bpy.context.scene.render.filepath = str(target)
    target.unlink(missing_ok=True)
    bpy.ops.render.render(write_still=True)
    if not target.is_file():
        raise RuntimeError(f"Blender saved no picture at {target}")


def render_styles(scene, folder):
    from patina.styles import styles
    for entry in styles.entries():
        if entry.own:
            continue
        bpy.ops.patina.apply_style(style=entry.key)
        if scene.patina.style.notice:
            raise RuntimeError(scene.patina.style.notice)
        save(folder / f"{entry.key}.png")


def main(folder):
    source, target = arguments()
    load_addon(folder)
    start = time.perf_counter()
    obj = import_points(source)
    imported = time.perf_counter()
    scene = bpy.context.scene
    add_camera(scene, obj)
    add_light_and_world(scene, obj)
    scene.render.engine = 'PATINA'
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = WIDTH, HEIGHT, 100
    scene.view_settings.view_transform = 'Standard'  # shows a scan's colours as they were taken
    scene.render.image_settings.file_format = 'PNG'
    if target.suffix:
        save(target)
    else:
        render_styles(scene, target)
    rendered = time.perf_counter()
    print(f"Blender {bpy.app.version_string}: {len(finite_points(obj)):,} points imported in "
          f"{imported - start:.2f} s, rendered and saved in {rendered - imported:.2f} s: {target}", flush=True)


def run():
    folder = Path(tempfile.mkdtemp(prefix="patina-demo-"))
    try:
        main(folder)
    except Exception as error:
        print(f"demo.py: {' '.join(str(error).split())}", flush=True)
        return 1
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return 0


code = run()
sys.stdout.flush()
os._exit(code)
