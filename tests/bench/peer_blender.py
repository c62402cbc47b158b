# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender draws a cloud: blender -b --factory-startup --python peer_blender.py -- MODE IN.npz OUT.npz ADDON. Run by
peers.py.

MODE: cycles (native points, 1 sample), eevee (oriented quads: it draws no points), workbench (native points), patina,
styles.
IN as for peer_vtk.py. OUT: rgba, depth of the first camera. Prints as JSON the times of whole renders (F12), each from
a new camera, and with `persistent` data where the engine can keep it. No shadows; ambient light is emission: nothing is
left to chance. styles: times of the library alone, of the scene that each style makes; OUT: KEY rgba, KEY depth."""

import json
import resource
import sys
import tempfile
import time
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

MODE, SOURCE, TARGET, ADDON = sys.argv[sys.argv.index("--") + 1:]
DATA = dict(np.load(SOURCE))
ENGINES = {"cycles": 'CYCLES', "eevee": 'BLENDER_EEVEE', "workbench": 'BLENDER_WORKBENCH', "patina": 'PATINA',
           "styles": 'PATINA'}


def material() -> bpy.types.Material:
    """Lambert in the points' colours, and as much emission as the world would add."""
    result = bpy.data.materials.new("points")
    result.use_nodes = True
    nodes, links = result.node_tree.nodes, result.node_tree.links
    nodes.clear()
    color, diffuse, glow = (nodes.new(kind) for kind in ("ShaderNodeAttribute", "ShaderNodeBsdfDiffuse",
                                                         "ShaderNodeEmission"))
    both, output = nodes.new("ShaderNodeAddShader"), nodes.new("ShaderNodeOutputMaterial")
    color.attribute_name = "Col"
    glow.inputs["Strength"].default_value = float(DATA["world"])
    links.new(color.outputs["Color"], diffuse.inputs["Color"])
    links.new(color.outputs["Color"], glow.inputs["Color"])
    links.new(diffuse.outputs[0], both.inputs[0])
    links.new(glow.outputs[0], both.inputs[1])
    links.new(both.outputs[0], output.inputs["Surface"])
    return result


def points() -> bpy.types.Object:
    """A mesh of vertices alone."""
    mesh = bpy.data.meshes.new("points")
    mesh.vertices.add(len(DATA["position"]))
    mesh.vertices.foreach_set("co", DATA["position"].ravel())
    color = np.pad(DATA["color"], ((0, 0), (0, 1)), constant_values=1.0)
    mesh.attributes.new("Col", 'FLOAT_COLOR', 'POINT').data.foreach_set("color", color.ravel())
    mesh.attributes.new("Normal", 'FLOAT_VECTOR', 'POINT').data.foreach_set("vector", DATA["normal"].ravel())
    return bpy.data.objects.new("points", mesh)


def as_spheres(obj: bpy.types.Object, look: bpy.types.Material) -> None:
    """Geometry nodes that make native points of the vertices."""
    tree = bpy.data.node_groups.new("points", 'GeometryNodeTree')
    tree.inputs.new('NodeSocketGeometry', "Geometry")
    tree.outputs.new('NodeSocketGeometry', "Geometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    convert, paint = tree.nodes.new("GeometryNodeMeshToPoints"), tree.nodes.new("GeometryNodeSetMaterial")
    convert.inputs["Radius"].default_value = 1.5 * float(DATA["spacing"])  # 0.1 % of random points' surface stays open
    paint.inputs["Material"].default_value = look
    tree.links.new(start.outputs[0], convert.inputs["Mesh"])
    tree.links.new(convert.outputs[0], paint.inputs["Geometry"])
    tree.links.new(paint.outputs[0], end.inputs[0])
    obj.modifiers.new("points", 'NODES').node_group = tree


def quads(look: bpy.types.Material) -> bpy.types.Object:
    """A square of 3 spacings across the normal of every point: 0.01 % of the surface stays open."""
    position, normal = DATA["position"], DATA["normal"]
    count = len(position)
    axis = np.eye(3, dtype=np.float32)[np.abs(normal).argmin(axis=1)]
    u = np.cross(axis, normal)
    u *= 1.5 * DATA["spacing"] / np.linalg.norm(u, axis=1)[:, None]
    v = np.cross(normal, u)
    corners = np.stack([position - u - v, position + u - v, position + u + v, position - u + v], axis=1)
    mesh = bpy.data.meshes.new("quads")
    mesh.vertices.add(4 * count)
    mesh.vertices.foreach_set("co", corners.astype(np.float32).ravel())
    mesh.loops.add(4 * count)
    mesh.loops.foreach_set("vertex_index", np.arange(4 * count, dtype=np.int32))
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", np.arange(0, 4 * count, 4, dtype=np.int32))
    mesh.polygons.foreach_set("loop_total", np.full(count, 4, np.int32))
    color = np.repeat(np.pad(DATA["color"], ((0, 0), (0, 1)), constant_values=1.0), 4, axis=0)
    mesh.attributes.new("Col", 'FLOAT_COLOR', 'POINT').data.foreach_set("color", color.ravel())
    mesh.update(calc_edges=True)
    mesh.materials.append(look)
    return bpy.data.objects.new("quads", mesh)


def stage() -> bpy.types.Scene:
    scene = bpy.context.scene
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    if MODE == "eevee":
        obj = quads(material())
    else:
        obj = points()
        if ENGINES[MODE] == 'PATINA':
            obj.patina.lighting = 'LIT'
            obj.patina.cull_back = True
        else:
            as_spheres(obj, material())
    sun_data = bpy.data.lights.new("sun", 'SUN')
    sun_data.energy = float(DATA["power"])
    sun_data.angle = 0.0
    sun_data.use_shadow = False
    if hasattr(sun_data, "cycles"):
        sun_data.cycles.cast_shadow = False
    sun = bpy.data.objects.new("sun", sun_data)
    back = DATA["towards"] / np.linalg.norm(DATA["towards"])
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = right, np.cross(back, right), back
    sun.matrix_world = Matrix(matrix)
    camera_data = bpy.data.cameras.new("camera")
    camera_data.angle = np.radians(float(DATA["fov"]))
    camera_data.clip_start, camera_data.clip_end = 0.1, 100.0
    camera = bpy.data.objects.new("camera", camera_data)
    for one in (obj, sun, camera):
        scene.collection.objects.link(one)
    scene.camera = camera
    world = bpy.data.worlds.new("world")
    world.use_nodes = False
    ambient = float(DATA["world"]) if ENGINES[MODE] == 'PATINA' else 0.0
    world.color = (ambient, ambient, ambient)
    scene.world = world
    render = scene.render
    render.engine = ENGINES[MODE]
    render.resolution_x = render.resolution_y = int(DATA["size"])
    render.resolution_percentage = 100
    render.film_transparent = True
    render.use_persistent_data = False
    scene.cycles.samples = 1
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.cycles.max_bounces = 0
    scene.eevee.taa_render_samples = 1
    scene.display.render_aa = 'OFF'
    scene.display.shading.color_type = 'VERTEX'
    return scene


def timed(scene: bpy.types.Scene, matrix: np.ndarray) -> float:
    scene.camera.matrix_world = Matrix(matrix)
    start = time.perf_counter()
    bpy.ops.render.render()
    return 1e3 * (time.perf_counter() - start)


def planes(scene: bpy.types.Scene, folder: str) -> dict:
    """Renders once more, with the passes written to files and read back."""
    layer = bpy.context.view_layer
    with_depth = MODE != "workbench"
    layer.use_pass_z = with_depth
    scene.use_nodes = True
    tree = scene.node_tree
    tree.nodes.clear()
    source, output = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("CompositorNodeOutputFile")
    output.base_path = folder
    output.format.file_format = 'OPEN_EXR'
    output.format.color_depth = '32'
    output.format.color_mode = 'RGBA'
    output.file_slots.clear()
    for name in ["Image"] + ["Depth"] * with_depth:
        output.file_slots.new(name)
        tree.links.new(source.outputs[name], output.inputs[name])
    timed(scene, DATA["matrix"][0])
    found = {}
    for key, name, channels in [("rgba", "Image", 4)] + [("depth", "Depth", 1)] * with_depth:
        image = bpy.data.images.load(str(next(Path(folder).glob(f"{name}*.exr"))))
        image.colorspace_settings.name = 'Non-Color'
        image.alpha_mode = 'CHANNEL_PACKED'
        pixels = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(pixels)
        height, width = image.size[1], image.size[0]
        found[key] = pixels.reshape(height, width, -1)[..., :channels]
    if with_depth:
        depth = found["depth"][..., 0]
        found["depth"] = np.where(depth > 6e4, np.inf, depth)  # EEVEE: the largest half float
    return found


def in_styles(scene: bpy.types.Scene) -> dict:
    """By style: label, device, milliseconds of each frame but the first, of each pass in the last."""
    from patina import native, sync
    from patina.description.settings import DeviceChoice
    from patina.draw import render
    from patina.styles import styles
    result, pictures = {}, {}
    for entry in styles.entries():
        if entry.own:
            continue
        bpy.ops.patina.apply_style(style=entry.key)
        times = []
        with native.Frame(render.device_for(DeviceChoice("cpu", 0))) as frame:
            for matrix in reversed(DATA["matrix"]):  # the first camera's picture is the last, and kept
                scene.camera.matrix_world = Matrix(matrix)
                depsgraph = bpy.context.evaluated_depsgraph_get()
                view = sync.final_view(scene.camera.evaluated_get(depsgraph), depsgraph)
                description = sync.describe(depsgraph, view, lambda what, progress: False)
                with native.Scene() as described:
                    render.describe(described, description, ["DEPTH"])
                    frame.render(described)
                times.append(frame.stats()["ms"])
            result[entry.key] = {"label": entry.label, "times": times[1:], "passes": frame.pass_stats()["passes"],
                                 "device": render.device_for(DeviceChoice("cpu", 0)).name}
            pictures |= {f"{entry.key} rgba": frame.read("COMBINED"), f"{entry.key} depth": frame.read("DEPTH")[..., 0]}
    np.savez(TARGET, **pictures)
    return result


def main() -> None:
    if ENGINES[MODE] == 'PATINA':
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "patina").symlink_to(ADDON, target_is_directory=True)
            sys.path.insert(0, folder)
            sys.dont_write_bytecode = True
            import patina
            patina.register()
    scene = stage()
    if MODE == "styles":
        print(json.dumps(in_styles(scene)), flush=True)
        return
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    full = [timed(scene, matrix) for matrix in DATA["matrix"][:4]]
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    scene.render.use_persistent_data = True
    moving = [timed(scene, matrix) for matrix in DATA["matrix"][:5]][2:]
    scene.render.use_persistent_data = False
    with tempfile.TemporaryDirectory() as folder:
        np.savez(TARGET, **planes(scene, folder))
    print(json.dumps({"times": {"F12": full[1:], "moving camera": moving}, "peak_mb": peak / 1024.0,
                      "note": f"the first F12 took {full[0]:.0f} ms"}), flush=True)


main()
