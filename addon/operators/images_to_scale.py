# SPDX-License-Identifier: GPL-3.0-or-later
"""Images without perspective, at a scale: a camera for them, a render that leaves the scene as it was, and the world file of a plan."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ..description.drawings import Frame
from ..draw.engine import PatinaRenderEngine
from ..sync import drawings

WORLD_FILES = {".png": ".pgw", ".tif": ".tfw", ".tiff": ".tfw", ".jpg": ".jgw", ".jpeg": ".jgw"}
_SIZE = ("resolution_x", "resolution_y", "resolution_percentage", "pixel_aspect_x", "pixel_aspect_y", "use_border")
RESTORED = (*_SIZE, "engine", "filepath", "use_file_extension", "use_multiview", "use_sequencer")


@contextlib.contextmanager
def restored(scene: bpy.types.Scene) -> Iterator[None]:
    """Restores camera, resolution and output of the scene afterwards, whatever happens. Until then no marker binds a camera."""
    camera, values = scene.camera, {name: getattr(scene.render, name) for name in RESTORED}
    settings = scene.render.image_settings
    formats = {name: getattr(settings, name) for name in ("media_type", "file_format", "color_mode", "color_depth") if hasattr(settings, name)}
    bound = [(marker, marker.camera) for marker in scene.timeline_markers if marker.camera]
    for marker, _ in bound:
        marker.camera = None
    try:
        yield
    finally:
        for marker, other in bound:
            marker.camera = other
        scene.camera = camera
        for group, kept in ((scene.render, values), (settings, formats)):
            for name, value in kept.items():
                setattr(group, name, value)


def write(scene: bpy.types.Scene, path: Path) -> bool:
    """Renders the scene to a PNG or TIFF file, which is there whole or not at all. Within restored(). False if the user canceled. OSError."""
    render, part = scene.render, path.with_name(f"{path.stem}.part{path.suffix}")
    render.engine = PatinaRenderEngine.bl_idname
    render.filepath, render.use_file_extension = str(part), False
    render.use_multiview = render.use_sequencer = False
    if hasattr(render.image_settings, "media_type"):
        render.image_settings.media_type = 'IMAGE'
    render.image_settings.file_format = 'TIFF' if path.suffix.lower().startswith(".tif") else 'PNG'
    try:
        done = bpy.ops.render.render(write_still=True) == {'FINISHED'}
        if done:
            os.replace(part, path)
        return done
    finally:
        part.unlink(missing_ok=True)


def set_up(scene: bpy.types.Scene, camera: bpy.types.Object, frame: Frame, width: int, height: int) -> None:
    """Makes the scene render the drawing through the camera. The image is that of the extent's middle."""
    render, data = scene.render, camera.data
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    render.pixel_aspect_x = render.pixel_aspect_y = 1.0
    render.use_border = False
    scene.camera = camera
    depth = frame.front + frame.back
    room = max(0.01 * depth, 10.0 * frame.side)
    camera.matrix_world = Matrix(drawings.camera_matrix(frame, frame.front + room).tolist())
    data.type, data.sensor_fit = 'ORTHO', 'HORIZONTAL'
    data.ortho_scale = width * frame.side
    data.shift_x = data.shift_y = 0.0
    data.clip_start, data.clip_end = room, depth + room


@contextlib.contextmanager
def camera_for(scene: bpy.types.Scene, frame: Frame, width: int, height: int) -> Iterator[bpy.types.Object]:
    """A camera of the drawing in the scene. Afterwards it is gone and the scene is as it was."""
    with restored(scene):
        camera = bpy.data.objects.new("Drawing", bpy.data.cameras.new("Drawing"))
        try:
            scene.collection.objects.link(camera)
            set_up(scene, camera, frame, width, height)
            yield camera
        finally:
            bpy.data.cameras.remove(camera.data)  # and its object


def world_file(frame: Frame, width: int, height: int, zero: np.ndarray, unit: float = 1.0) -> str:
    """The six lines of a level drawing's world file: how a pixel to the right and one down move, the center of the upper left pixel. zero: what
    Blender's is in the world; unit: of it, how many meters the file's is."""
    right, down = frame.side * frame.right / unit, -frame.side * frame.up / unit
    first = (zero + frame.origin) / unit - 0.5 * (width - 1) * right - 0.5 * (height - 1) * down
    values = (right[0], right[1], down[0], down[1], first[0], first[1])
    return "".join(f"{value + 0.0:.10f}\n" for value in values)


def is_level(frame: Frame) -> bool:
    """Whether the drawing is a map, as world files are for."""
    return abs(frame.normal[2]) > 1.0 - 1e-9
