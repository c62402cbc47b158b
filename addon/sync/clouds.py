# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of evaluated objects → clouds in the library, built once and kept while their content stays."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix

from .. import jobs, native
from ..properties import enum_number
from . import attributes, estimates
from .camera import row_major

# Clouds that the last picture did not use may stay up to this many bytes (24 a point): enough for the other view
# layers and scenes of a session, little beside what Blender itself holds for the same points.
IDLE_BYTES = 1 << 30

NOTHING = 1e-20  # stands for zero where zero would mean "default" to the library


@dataclass(frozen=True)
class PointArrays:
    positions: np.ndarray  # (n, 3) float32
    normals: np.ndarray | None  # (n, 3) float32
    colors: np.ndarray | None  # (n, 4) uint8 sRGB, or (n, 3|4) float32 linear
    opacities: np.ndarray | None  # (n, 1) float32

    def fingerprint(self) -> bytes:
        """Of the content: what Blender's update tags miss (undo, geometry nodes, scripts) still shows. 1 GB/s."""
        digest = hashlib.blake2b(digest_size=16)
        for array in (self.positions, self.normals, self.colors, self.opacities):
            digest.update(b"-" if array is None else f"{array.dtype}{array.shape}".encode())
            if array is not None:
                digest.update(array)
        return digest.digest()


@dataclass(frozen=True)
class CloudStyle:
    """patina_cloud_style."""

    world_from_object: tuple[float, ...]
    lighting: int
    cull_back: int
    d_min: float
    color: tuple[float, float, float]
    ambient: float
    diffuse: float
    specular: float
    shininess: int
    transparency: float


@dataclass(frozen=True)
class CloudItem:
    cloud: native.Cloud
    style: CloudStyle


class CloudCache:
    """Clouds by the identity of the data they were built from. A scene that uses a cloud keeps it alive itself."""

    def __init__(self) -> None:
        self._entries: dict[tuple, tuple[bytes, native.Cloud]] = {}  # least recently used first

    def obtain(self, identity: tuple, arrays: PointArrays, build: Callable[[], native.Cloud]) -> native.Cloud:
        fingerprint = arrays.fingerprint()
        entry = self._entries.pop(identity, None)
        if entry is None or entry[0] != fingerprint:
            entry = None  # frees the old cloud before the new one is built
            entry = (fingerprint, build())
        self._entries[identity] = entry
        return entry[1]

    def trim(self, used: set[tuple]) -> None:
        idle = sum(cloud.bytes for identity, (_, cloud) in self._entries.items() if identity not in used)
        for identity in [identity for identity in self._entries if identity not in used]:
            if idle <= IDLE_BYTES:
                break
            idle -= self._entries.pop(identity)[1].bytes

    def clear(self) -> None:
        self._entries.clear()

    def __len__(self) -> int:
        return len(self._entries)


CACHE = CloudCache()


def collect(depsgraph: bpy.types.Depsgraph, poll: Callable[[str, float], bool],
            notices: list[str]) -> list[CloudItem]:
    """Every visible cloud, instances too. Iterates the depsgraph only; keeps no reference into it."""
    items: list[CloudItem] = []
    built: dict[tuple, native.Cloud | None] = {}  # by place in memory, which holds while the depsgraph does
    used: set[tuple] = set()
    faces: set[str] = set()
    distances: dict[str, float] = {}
    for instance in depsgraph.object_instances:
        obj = instance.object
        if obj.type not in {'MESH', 'POINTCLOUD'} or not instance.show_self or not obj.visible_camera:
            continue
        if obj.type == 'MESH' and len(obj.data.polygons):
            faces.add(obj.name)
            continue
        place = (obj.data.as_pointer(), *_attribute_names(obj))
        if place not in built:
            built[place] = _cloud(obj, used, poll, notices)
        if built[place]:
            items.append(CloudItem(built[place], _style(obj, instance.matrix_world)))
            scale = max(map(abs, instance.matrix_world.to_scale()))
            distances[obj.original.name_full] = built[place].layer_distance * scale
    CACHE.trim(used)
    estimates.keep(distances)
    if not items:
        notices.append("no visible object has points to draw")
    if faces:
        notices.append(f"{len(faces)} mesh object{'s' * (len(faces) > 1)} with faces not drawn: "
                       "Patina draws only points so far")
    return items


def _cloud(obj: bpy.types.Object, used: set[tuple], poll: Callable[[str, float], bool],
           notices: list[str]) -> native.Cloud | None:
    arrays = _read(obj, notices)
    if arrays is None:
        return None
    identity = _identity(obj, used)
    used.add(identity)
    name = obj.name

    def build() -> native.Cloud:
        with native.Progress() as progress:
            return jobs.run(
                lambda: native.Cloud(arrays.positions, arrays.normals, arrays.colors, progress,
                                     opacities=arrays.opacities),
                progress.cancel, lambda: poll(f"Reading points of '{name}'", progress.value()))

    cloud = CACHE.obtain(identity, arrays, build)
    if cloud.invalid_positions:
        notices.append(f"'{name}': {cloud.invalid_positions:,} points without a finite position left out")
    return cloud


def _identity(obj: bpy.types.Object, used: set[tuple]) -> tuple:
    """Names the data for this session. Geometry that modifiers made has no original: its object stands for it,
    counted where there are several."""
    original = obj.data.original
    owner = obj.original if original == obj.data else original
    # session_uid came with Blender 4.1
    base = (type(owner).__name__, getattr(owner, "session_uid", None) or owner.name_full, obj.type,
            *_attribute_names(obj))
    number = 0
    while (*base, number) in used:
        number += 1
    return (*base, number)


def _attribute_names(obj: bpy.types.Object) -> tuple[str, ...]:
    return (obj.patina.color_attribute, obj.patina.normal_attribute, obj.patina.opacity_attribute)


def _read(obj: bpy.types.Object, notices: list[str]) -> PointArrays | None:
    data = obj.data
    count = len(data.vertices if obj.type == 'MESH' else data.points)
    if count == 0:
        return None
    positions = attributes.positions(data, count)
    if positions is None:
        return None
    normals = attributes.normals(data, count, obj.patina.normal_attribute)
    colors = attributes.colors(data, count, obj.patina.color_attribute)
    opacities = attributes.opacities(data, count, obj.patina.opacity_attribute)
    for kind, name, found in (("colour", obj.patina.color_attribute, colors),
                              ("normal", obj.patina.normal_attribute, normals),
                              ("opacity", obj.patina.opacity_attribute, opacities)):
        if name and found is None:
            notices.append(f"'{obj.name}' has no point attribute '{name}' to take as {kind}")
    return PointArrays(positions, normals, colors, opacities)


def _style(obj: bpy.types.Object, matrix: Matrix) -> CloudStyle:
    patina = obj.patina
    dark = not (patina.ambient or patina.diffuse or patina.specular)
    return CloudStyle(
        world_from_object=row_major(matrix),
        lighting=enum_number(patina, "lighting"),
        cull_back=int(patina.cull_back),
        d_min=patina.d_min,
        color=tuple(patina.color) if any(patina.color) else (NOTHING,) * 3,
        ambient=NOTHING if dark else patina.ambient,
        diffuse=patina.diffuse,
        specular=patina.specular,
        shininess=patina.shininess,
        transparency=1.0 - patina.opacity)
