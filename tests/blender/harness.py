# SPDX-License-Identifier: GPL-3.0-or-later
"""What the add-on's tests share: the loaded add-on, small scenes, rendered pixels as arrays."""

import atexit
import os
import re
import shutil
import sys
import tempfile
import warnings
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

REPOSITORY = Path(__file__).resolve().parents[2]
SCRATCH = Path(tempfile.mkdtemp(prefix="patina-test-"))
atexit.register(shutil.rmtree, SCRATCH, ignore_errors=True)


OURS = re.compile(r"(patina|check_\w+|harness|window|screen|figures|frame_figures|session_rounds|copc_files|ept_files|range_server|test_\w+)(\.|$)")
deprecated: list[str] = []  # what our modules used that Blender or Python deprecates, since the last take_deprecated()
_showwarning = warnings.showwarning


def _record_warning(message, category, filename, lineno, file=None, line=None):
    """Also in callbacks, where an exception would only be printed."""
    if issubclass(category, DeprecationWarning):
        deprecated.append(f"{message} ({Path(filename).name}:{lineno})")
    _showwarning(message, category, filename, lineno, file, line)


def take_deprecated():
    """What was recorded, as one text without repetitions."""
    found = "; ".join(dict.fromkeys(deprecated))
    deprecated.clear()
    return found


warnings.filterwarnings("always", category=DeprecationWarning, module=OURS.pattern)
warnings.showwarning = _record_warning


class Skip(Exception):
    """This Blender cannot run the test; the text says why."""


def load_addon():
    """Imports and registers the repository's addon/ as package `patina`."""
    packages = SCRATCH / "packages"
    packages.mkdir()
    (packages / "patina").symlink_to(REPOSITORY / "addon", target_is_directory=True)
    sys.path.insert(0, str(packages))
    sys.dont_write_bytecode = True
    import patina
    patina.register()
    return patina


patina = load_addon()
from patina import point_data  # noqa: E402
from patina.draw import engine, passes  # noqa: E402
from patina.sync.points import attributes  # noqa: E402
from patina.sync.view import combination  # noqa: E402

reports: list[tuple[str, str]] = []  # (kind, message) of the last render
stats: list[str] = []
written: list[tuple[str, dict[str, np.ndarray]]] = []  # (stereo view, planes) of the last render
_pixels: dict[str, dict[str, np.ndarray]] = {}


def _record_tell(self, kind, text):
    reports.append((kind, text))
    _tell(self, kind, text)


def _record_status(self, text, progress):
    stats.append(text)
    _status(self, text, progress)


def _record_write(self, layer, scene, planes, eye="", begun=None):
    _write(self, layer, scene, planes, eye, begun)
    written.append((eye, planes))
    result = self.get_result()  # what Blender holds now, not what we think we gave
    size = (result.resolution_y, result.resolution_x)
    _pixels[layer.name] = {item.name: _rect(item, *size) for item in result.layers[layer.name].passes}


def _rect(item, height, width):
    flat = np.empty((height * width, item.channels), np.float32)
    try:
        item.rect.foreach_get(flat.reshape(-1))
    except TypeError:  # Blender 3.x
        item.rect.foreach_get(flat)
    return flat.reshape(height, width, item.channels)


# Blender looks up its own methods (report, test_break) before ours, so ours are the ones to listen at.
_write, passes.write = passes.write, _record_write
_Engine = engine.PatinaRenderEngine
_tell, _Engine._tell = _Engine._tell, _record_tell
_status, _Engine._status = _Engine._status, _record_status


# ---- scenes --------------------------------------------------------------------------------------------------


def new_scene(width=64, height=48):
    """Empties the file; a camera at the origin that looks down -z, no filters, transparent film, all passes."""
    for collection in (bpy.data.objects, bpy.data.meshes, bpy.data.pointclouds, bpy.data.lights, bpy.data.cameras, bpy.data.worlds,
                       bpy.data.collections, bpy.data.node_groups):
        for item in list(collection):
            collection.remove(item)
    old = list(bpy.data.scenes)
    bpy.context.window.scene = scene = bpy.data.scenes.new("test")
    for other in old:
        bpy.data.scenes.remove(other)
    render = scene.render
    render.engine = 'PATINA'
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    render.film_transparent = True
    settings = scene.patina
    settings.fill = settings.smooth = settings.antialias = 'OFF'
    settings.device, settings.samples = 'CPU', 1
    layer = scene.view_layers[0]
    layer.use_pass_z = layer.use_pass_normal = layer.patina.use_pass_source = True
    scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(scene.camera)
    return scene


kind = 'MESH'  # of the objects that add_points makes; 'POINTCLOUD': check_kinds.py runs tests once more with these


def add_points(positions, colors=None, normals=None, name="points", matrix=None, link=True):
    """An object of points alone: a mesh, or a PointCloud where `kind` says so. colors: uint8 (sRGB) or float32 (linear), (n, 4); normals:
    attribute "Normal"."""
    data = point_data.new(name, np.asarray(positions, np.float32).reshape(-1, 3), kind == 'POINTCLOUD')
    if colors is not None and colors.dtype == np.uint8:
        attribute = data.attributes.new("Col", 'BYTE_COLOR', 'POINT')
        attribute.data.foreach_set("color_srgb", (colors / np.float32(255)).reshape(-1))
    elif colors is not None:
        data.attributes.new("Col", 'FLOAT_COLOR', 'POINT').data.foreach_set("color", colors.reshape(-1))
    if normals is not None:
        values = np.asarray(normals, np.float32).reshape(-1)
        data.attributes.new("Normal", 'FLOAT_VECTOR', 'POINT').data.foreach_set("vector", values)
    if kind == 'POINTCLOUD':
        data = point_data.finished(data, True)
    obj = bpy.data.objects.new(name, data)
    obj.matrix_world = Matrix(matrix) if matrix is not None else Matrix()
    if link:
        bpy.context.scene.collection.objects.link(obj)
    return obj


def add_light(kind, energy, location=(0, 0, 0), direction=(0, 0, -1), color=(1, 1, 1)):
    light = bpy.data.lights.new("light", kind)
    light.energy, light.color = energy, color
    obj = bpy.data.objects.new("light", light)
    obj.location = location
    obj.rotation_mode = 'QUATERNION'
    obj.rotation_quaternion = Vector(direction).to_track_quat('-Z', 'Y')
    bpy.context.scene.collection.objects.link(obj)
    return obj


def set_world(color, strength=1.0):
    world = bpy.data.worlds.new("world")
    bpy.context.scene.world = world
    if bpy.app.version < (5, 0, 0):
        world.use_nodes = True
    node = next(node for node in world.node_tree.nodes if node.bl_idname == 'ShaderNodeBackground')
    node.inputs["Color"].default_value = (*color, 1)
    node.inputs["Strength"].default_value = strength
    return world


def sphere(count=6000, radius=1.0, center=(0, 0, -4)):
    """Evenly spread points of a sphere with their normals and byte colours."""
    index = np.arange(count) + 0.5
    z, angle = 1 - 2 * index / count, index * np.pi * (1 + 5 ** 0.5)
    ring = np.sqrt(1 - z * z)
    normals = np.stack([ring * np.cos(angle), ring * np.sin(angle), z], 1)
    colors = np.concatenate([normals * 100 + 128, np.full((count, 1), 255)], 1).astype(np.uint8)
    return normals * radius + np.asarray(center), colors, normals


def points_of(obj):
    """(n, 3) float32: an object's own points, of a mesh or a PointCloud."""
    count = point_data.count_of(obj.data)
    return attributes.positions(obj.data, count) if count else np.zeros((0, 3), np.float32)


def move(obj, index, place):
    """Puts a point of an object, mesh or PointCloud, somewhere else in its own space."""
    if obj.type == 'MESH':
        obj.data.vertices[index].co = place
    else:
        obj.data.attributes["position"].data[index].vector = place
    point_data.changed(obj.data)


# ---- pictures ------------------------------------------------------------------------------------------------


def compositor(scene):
    """The tree of a new compositor, and its output node. Blender 5 has node groups for it, older versions the scene's own tree."""
    if bpy.app.version >= (5, 0, 0):
        tree = bpy.data.node_groups.new("compositor", 'CompositorNodeTree')
        combination.set_tree(scene, tree)
        tree.interface.new_socket("Image", in_out='OUTPUT', socket_type='NodeSocketColor')
        return tree, tree.nodes.new('NodeGroupOutput')
    scene.use_nodes = True
    scene.node_tree.nodes.clear()
    return scene.node_tree, scene.node_tree.nodes.new('CompositorNodeComposite')


def end_compositor(scene):
    if bpy.app.version >= (5, 0, 0):
        combination.set_tree(scene, None)
    else:
        scene.use_nodes = False


def render():
    """F12 in the background. The passes of the first view layer as Blender holds them; {} when none were written."""
    pictures = render_layers()
    return pictures.get(bpy.context.scene.view_layers[0].name, {})


def render_layers():
    for record in (reports, stats, written, _pixels):
        record.clear()
    bpy.context.view_layer.update()
    bpy.ops.render.render()
    return dict(_pixels)


def failing_render():
    """The message of a render that must fail."""
    try:
        render()
    except RuntimeError as error:
        return str(error)
    raise AssertionError("the render did not fail")


def saved(kind='OPEN_EXR'):
    """The picture as Blender saves it, (height, width, 4), row 0 at the bottom."""
    settings = bpy.context.scene.render.image_settings
    settings.file_format, settings.color_mode = kind, 'RGBA'
    settings.color_depth = '32' if kind == 'OPEN_EXR' else '8'
    path = SCRATCH / ("picture.exr" if kind == 'OPEN_EXR' else "picture.png")
    bpy.data.images['Render Result'].save_render(str(path))
    image = bpy.data.images.load(str(path))
    try:
        width, height = image.size
        pixels = np.empty(width * height * 4, np.float32)
        image.pixels.foreach_get(pixels)
        return pixels.reshape(height, width, 4)
    finally:
        bpy.data.images.remove(image)
        os.unlink(path)


def linear(bytes_):
    """sRGB bytes → linear, float64."""
    s = np.asarray(bytes_, np.float64) / 255
    return np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4)


def drawn(picture):
    """(row, column) of every pixel that is not background, as a set."""
    return {tuple(place) for place in np.argwhere(picture["Combined"][..., 3] > 0).tolist()}


def check_deprecated():
    """Fails if a test used what Blender or Python deprecates: it will be gone in a later version."""
    found = take_deprecated()
    check(not found, f"deprecated: {found}")


def check(condition, message):
    if not condition:
        raise AssertionError(message)


@contextmanager
def read_only(folder):
    """Within: this process can write nothing into the folder, which is its own. Root, whom modes do not bind, is another user meanwhile."""
    nobody = 65534
    if os.name == "nt":
        raise Skip("Windows has no modes of folders")
    root, mode = os.geteuid() == 0, SCRATCH.stat().st_mode
    folder.mkdir(exist_ok=True)
    try:
        if root:
            SCRATCH.chmod(0o777)
            os.chown(folder, nobody, nobody)
            os.setresuid(nobody, nobody, 0)
        folder.chmod(0o500)
        if os.access(folder, os.W_OK):
            raise Skip(f"modes of folders do not bind this user: {folder} can be written to")
        yield
    except PermissionError as error:
        if os.geteuid() or not root:
            raise
        raise Skip(f"root cannot be another user here: {error}") from None
    finally:
        if root:
            os.setresuid(0, 0, 0)
        folder.chmod(0o700)
        SCRATCH.chmod(mode)


def forget_files():
    """Removes the images and volumes of other tests: Blender cannot pack those whose files are missing, and a farm's job names them."""
    for collection in (bpy.data.images, bpy.data.volumes):
        for item in list(collection):
            collection.remove(item)


def check_close(got, wanted, tolerance, what):
    error = np.abs(np.asarray(got, np.float64) - np.asarray(wanted, np.float64)).max()
    check(error <= tolerance, f"{what}: {np.asarray(got)} is not {np.asarray(wanted)} (off by {error:.3g})")
