# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of soft points for the manual: build/soft_pictures runs it.

    blender -b --factory-startup --python-exit-code 1 --python tests/blender/soft_pictures.py -- SCAN.ply TREES.las GROVE.npz FOLDER

A scan is painted step by step, by the brush's own operator: FOLDER/paint-N.png. A scan with trees and a grove that is made up, as
splats (SP), with one layer of transparency (OLT) and with soft points (ST): FOLDER/trees-MODE.png, grove-MODE.png."""

import sys
import tempfile
from math import radians, tan
from pathlib import Path

import bpy
import numpy as np
from mathutils import Euler, Vector

SIZE = (760, 570)
MODES = {"SP": "SPLATS", "OLT": "ONE_LAYER", "ST": "EXPRESS"}
BEFORE, BESIDE = (150, 12, 0.55), (32, 14, 0.5)  # the lion's sides: azimuth, elevation, share of the box's diagonal that is seen
LEAVES = (  # strokes over the leaves, seen from beside: places in parts of the picture, from its bottom left, and the brush's radius
    ([(0.04, 0.30), (0.06, 0.45), (0.12, 0.55), (0.06, 0.68)], 0.07),
    ([(0.84, 0.52), (0.90, 0.40), (0.94, 0.44), (0.84, 0.33)], 0.06),
    ([(0.72, 0.65), (0.74, 0.63)], 0.04))


def start():
    folder = Path(tempfile.mkdtemp(prefix="patina-pictures-"))
    (folder / "patina").symlink_to(Path(__file__).resolve().parents[2] / "addon", target_is_directory=True)
    sys.path.insert(0, str(folder))
    sys.dont_write_bytecode = True
    import patina
    patina.register()


def stage():
    """An empty scene in Patina, on a pale ground."""
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    scene = bpy.context.scene
    scene.render.engine = 'PATINA'
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = *SIZE, 100
    scene.view_settings.view_transform = 'Standard'
    scene.render.image_settings.file_format = 'PNG'
    studio = scene.patina.studio
    studio.use_background, studio.background = True, (0.78, 0.82, 0.86)
    return scene


def aim(scene, obj, azimuth, elevation, keep, at=(0.5, 0.5, 0.5)):
    """A camera that looks at a place in parts of the points' box, from so far that `keep` of its diagonal fills the picture's height."""
    from patina import point_data
    from patina.sync.points import attributes
    places = attributes.positions(obj.data, point_data.count_of(obj.data))
    low, high = np.percentile(places.astype(np.float64), (1.0, 99.0), axis=0)
    data = bpy.data.cameras.new("camera")
    camera = bpy.data.objects.new("camera", data)
    camera.rotation_euler = Euler((radians(90 - elevation), 0, radians(azimuth)))
    away = keep * np.linalg.norm(high - low) / 2 / tan(data.angle / 2) * SIZE[0] / SIZE[1]
    middle = Vector(low + (high - low) * np.array(at)) + obj.location
    camera.location = middle + camera.rotation_euler.to_matrix() @ Vector((0, 0, away))
    data.clip_start, data.clip_end = away * 0.01, away * 10
    scene.collection.objects.link(camera)
    scene.camera = camera
    return camera


def save(path):
    bpy.context.scene.render.filepath = str(path)
    bpy.context.view_layer.update()
    bpy.ops.render.render(write_still=True)
    print(path, flush=True)


def painted(scan, folder):
    """Four steps: leaves stand before the lion; from beside strokes are painted over them, shown as a ramp; soft; and fainter."""
    scene = stage()
    bpy.ops.import_scene.patina_points(filepath=str(scan))
    obj = bpy.context.view_layer.objects.active
    aim(scene, obj, *BEFORE)
    save(folder / "paint-1.png")
    aim(scene, obj, *BESIDE)
    for places, radius in LEAVES:
        bpy.context.view_layer.update()
        bpy.ops.object.patina_soft_brush(path=[{"name": "", "loc": (x * SIZE[0], y * SIZE[1]), "time": 0.0} for x, y in places],
                                         radius=radius * SIZE[0], through=True)
    group, colors = obj.patina.soft, obj.patina.colors
    group.use = False
    colors.source, colors.scalar, colors.use_range, colors.range_min, colors.range_max = 'SCALAR', group.attribute, True, 0.0, 1.0
    save(folder / "paint-2.png")
    colors.source = 'OWN'
    group.use, group.opacity = True, 0.3
    aim(scene, obj, *BEFORE)
    save(folder / "paint-3.png")
    from patina.draw import histogram
    from patina.draw.thumbnails import save as write
    known = histogram.of(obj)
    pixels = histogram.picture(known.counts, group.threshold, group.transition)[::-1]
    write(np.round(pixels * 255).astype(np.uint8), folder / "paint-histogram.png")
    group.opacity = 0.05
    save(folder / "paint-4.png")


def compared(obj, name, folder):
    """As surface, and each way that this Patina knows."""
    scene = bpy.context.scene
    known = {item.identifier for item in scene.patina.bl_rna.properties["soft_model"].enum_items}
    obj.patina.soft.use = False
    save(folder / f"{name}-surface.png")
    obj.patina.soft.use = True
    for mode, model in MODES.items():
        if model in known:
            scene.patina.soft_model = model
            save(folder / f"{name}-{mode}.png")


def trees(scan, folder):
    """An airborne scan without classes: trees are where neighbors disagree with normals."""
    scene = stage()
    bpy.ops.import_scene.patina_points(filepath=str(scan))
    obj = bpy.context.view_layer.objects.active
    aim(scene, obj, 60, 12, 0.09, (0.12, 0.75, 0.5))
    soft = obj.patina.soft
    soft.by, soft.threshold, soft.opacity = 'UNCERTAINTY', 0.35, 0.12
    compared(obj, "trees", folder)


def grove(source, folder):
    scene = stage()
    points = np.load(source)
    mesh = bpy.data.meshes.new("grove")
    mesh.vertices.add(len(points["position"]))
    mesh.vertices.foreach_set("co", points["position"].reshape(-1))
    colors = np.concatenate([points["color"] / np.float32(255), np.ones((len(points["color"]), 1), np.float32)], 1)
    mesh.attributes.new("Col", 'BYTE_COLOR', 'POINT').data.foreach_set("color_srgb", colors.astype(np.float32).reshape(-1))
    mesh.attributes.new("classification", 'INT', 'POINT').data.foreach_set("value", points["classes"].astype(np.int32))
    mesh.attributes.new("Normal", 'FLOAT_VECTOR', 'POINT').data.foreach_set("vector", points["normal"].reshape(-1))
    obj = bpy.data.objects.new("grove", mesh)
    scene.collection.objects.link(obj)
    aim(scene, obj, 8, 8, 0.5, (0.5, 0.6, 0.45))
    soft = obj.patina.soft
    soft.by, soft.classes, soft.opacity = 'CLASSES', "5", 0.08
    compared(obj, "grove", folder)


def main():
    scan, airborne, made, folder = map(Path, sys.argv[sys.argv.index("--") + 1:])
    folder.mkdir(parents=True, exist_ok=True)
    start()
    painted(scan, folder)
    grove(made, folder)
    trees(airborne, folder)


main()
