# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender draws a virtual scan as native points: python peer_scans_blender.py IN.npz OUT_FOLDER ENGINE RADIUS... with the
module bpy 4.2 to 4.5. Run by scans.py.

IN as for peer_scans.py; ENGINE: cycles (4 samples) or eevee. RADIUS: of every point's sphere, metres. Points emit their
colours: nothing is lit. OUT_FOLDER/RADIUS-VIEW.npz: linear rgb over the sky, depth float32. Prints {"RADIUS": [milliseconds a view]}."""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

ENGINES = {"cycles": 'CYCLES', "eevee": 'BLENDER_EEVEE_NEXT'}


def linear(srgb: np.ndarray) -> np.ndarray:
    value = np.asarray(srgb, np.float64)
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def material() -> bpy.types.Material:
    result = bpy.data.materials.new("points")
    result.use_nodes = True
    nodes, links = result.node_tree.nodes, result.node_tree.links
    nodes.clear()
    color, glow, output = (nodes.new(kind) for kind in (
        "ShaderNodeAttribute", "ShaderNodeEmission", "ShaderNodeOutputMaterial"))
    color.attribute_name = "Col"
    links.new(color.outputs["Color"], glow.inputs["Color"])
    links.new(glow.outputs[0], output.inputs["Surface"])
    return result


def stage(data: dict[str, np.ndarray], engine: str) -> tuple[bpy.types.Scene, bpy.types.NodeSocket]:
    """The scene, and the socket that holds the radius."""
    scene = bpy.context.scene
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    mesh = bpy.data.meshes.new("points")
    mesh.vertices.add(len(data["position"]))
    mesh.vertices.foreach_set("co", data["position"].ravel())
    color = np.pad(linear(data["color"] / 255.0).astype(np.float32), ((0, 0), (0, 1)), constant_values=1.0)
    mesh.attributes.new("Col", 'FLOAT_COLOR', 'POINT').data.foreach_set("color", color.ravel())
    obj = bpy.data.objects.new("points", mesh)
    tree = bpy.data.node_groups.new("points", 'GeometryNodeTree')
    for way in ('INPUT', 'OUTPUT'):
        tree.interface.new_socket("Geometry", in_out=way, socket_type='NodeSocketGeometry')
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    convert, paint = tree.nodes.new("GeometryNodeMeshToPoints"), tree.nodes.new("GeometryNodeSetMaterial")
    paint.inputs["Material"].default_value = material()
    tree.links.new(start.outputs[0], convert.inputs["Mesh"])
    tree.links.new(convert.outputs[0], paint.inputs["Geometry"])
    tree.links.new(paint.outputs[0], end.inputs[0])
    obj.modifiers.new("points", 'NODES').node_group = tree
    camera_data = bpy.data.cameras.new("camera")
    camera_data.sensor_fit = 'VERTICAL'
    camera_data.angle_y = np.radians(float(data["fov"]))
    camera_data.clip_start, camera_data.clip_end = float(data["near"]), float(data["far"])
    camera = bpy.data.objects.new("camera", camera_data)
    for one in (obj, camera):
        scene.collection.objects.link(one)
    scene.camera = camera
    render = scene.render
    render.engine = ENGINES[engine]
    render.resolution_x, render.resolution_y, render.resolution_percentage = int(data["width"]), int(data["height"]), 100
    render.film_transparent = True
    render.use_persistent_data = True
    scene.cycles.samples = 4
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.cycles.max_bounces = 0
    scene.eevee.taa_render_samples = 4
    scene.view_settings.view_transform = 'Raw'
    return scene, convert.inputs["Radius"]


def outputs(scene: bpy.types.Scene, folder: str) -> None:
    bpy.context.view_layer.use_pass_z = True
    scene.use_nodes = True
    tree = scene.node_tree
    tree.nodes.clear()
    source, output = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("CompositorNodeOutputFile")
    output.base_path = folder
    output.format.file_format = 'OPEN_EXR'
    output.format.color_depth = '32'
    output.format.color_mode = 'RGBA'
    output.file_slots.clear()
    for name in ("Image", "Depth"):
        output.file_slots.new(name)
        tree.links.new(source.outputs[name], output.inputs[name])


def read(folder: str, name: str) -> np.ndarray:
    path = next(Path(folder).glob(f"{name}*.exr"))
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = 'Non-Color'
    image.alpha_mode = 'CHANNEL_PACKED'
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    shape = image.size[1], image.size[0], -1
    bpy.data.images.remove(image)
    path.unlink()
    return pixels.reshape(shape)


def main() -> None:
    source, target, engine, *radii = sys.argv[1:]
    data = dict(np.load(source))
    scene, radius = stage(data, engine)
    sky = linear(data["sky"]).astype(np.float32)
    times: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        outputs(scene, folder)
        for size in radii:
            radius.default_value = float(size)
            for index, matrix in enumerate(data["matrix"]):
                scene.camera.matrix_world = Matrix(matrix)
                start = time.perf_counter()
                bpy.ops.render.render()
                times.setdefault(size, []).append(1e3 * (time.perf_counter() - start))
                rgba, depth = read(folder, "Image"), read(folder, "Depth")[..., 0]
                np.savez(Path(target) / f"{size}-{index}.npz", rgb=rgba[..., :3] + (1.0 - rgba[..., 3:4]) * sky,
                         depth=np.where((depth > 6e4) | (rgba[..., 3] < 0.5), np.inf, depth).astype(np.float32))
    print("\n" + json.dumps(times), flush=True)


main()
