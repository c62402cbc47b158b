# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of objects in one space, in float64, for what is measured between them."""

from __future__ import annotations

import bpy
import numpy as np

from ... import native, point_data
from ...jobs import Steps
from ...read.importers import Progress
from ..points import attributes, built, edits, linked

DISTANCE, INTERVAL, HEIGHT = "m3c2_distance", "m3c2_interval", attributes.HEIGHT_NAME  # attributes that are written
SAMPLES = 8.0  # of a mesh, along the diameter of a cylinder
MOST_SAMPLES = 4_000_000


def places(obj: bpy.types.Object, data: bpy.types.ID, zero: np.ndarray) -> np.ndarray:
    """(n, 3) float64, the points of an object in the world, from `zero`. PatinaError if there are none."""
    count = point_data.count_of(data)
    found = attributes.positions(data, count) if count else None
    if found is None:
        raise native.PatinaError(f"'{obj.name}' has no points")
    return in_world(obj, found, zero)


def linked_places(obj: bpy.types.Object, frame: int, most: int | None, progress: Progress) -> Steps[np.ndarray]:
    """(n, 3) float32, points of a linked cloud in its own space, up to so many (None: all), without hidden and deleted ones. PatinaError
    if they cannot be read, or are read as needed."""
    notices: list[str] = []
    source = linked.source_of(obj, frame, notices)
    if source is None:
        raise native.PatinaError(notices[0] if notices else f"'{obj.name}': the file is missing")
    if source.streamed:
        raise native.PatinaError(f"'{obj.name}': its points are read as needed. Use Linked File > Read Whole to read all of them")
    cloud = yield from built.CACHE.obtain_linked(source, progress)
    hidden = edits.gone_of(edits.state_of(obj), cloud.count, cloud.scan_numbers, edits.scans_of(cloud))
    found = cloud.places(cloud.count if most is None else most, hidden)
    if not len(found):
        raise native.PatinaError(f"'{obj.name}' has no points")
    return found


def in_world(obj: bpy.types.Object, found: np.ndarray, zero: np.ndarray) -> np.ndarray:
    """(n, 3) float64, points of an object's own space in the world, from `zero`."""
    matrix = np.array(obj.matrix_world, np.float64)
    return np.ascontiguousarray(found.astype(np.float64) @ matrix[:3, :3].T + (matrix[:3, 3] - zero))


def normals(obj: bpy.types.Object) -> np.ndarray | None:
    """(n, 3) float64, the normals that an object's points have, in the world."""
    found = attributes.normals(obj.data, point_data.count_of(obj.data), obj.patina.normal_attribute)
    if found is None:
        return None
    matrix = np.array(obj.matrix_world.to_3x3().inverted_safe(), np.float64)
    return np.ascontiguousarray(found.astype(np.float64) @ matrix)


def sampled(obj: bpy.types.Object, mesh: bpy.types.Mesh, zero: np.ndarray, gap: float) -> np.ndarray:
    """(n, 3) float64, points on the faces of a mesh, about `gap` apart, in the world, from `zero`. The same ones each time."""
    mesh.calc_loop_triangles()
    triangles = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles)
    corners = in_world(obj, attributes.positions(mesh, len(mesh.vertices)), zero)[triangles.reshape(-1, 3)]
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    areas[~np.isfinite(areas)] = 0.0
    total = float(areas.sum())
    if not total > 0.0:
        raise native.PatinaError(f"'{obj.name}' has no faces with an area")
    random = np.random.default_rng(1)
    count = int(min(max(total / gap ** 2, 1000.0), MOST_SAMPLES))
    chosen = corners[random.choice(len(areas), count, p=areas / total)]
    u, v = random.random((2, count, 1))
    flip = u + v > 1.0
    u, v = np.where(flip, 1.0 - u, u), np.where(flip, 1.0 - v, v)
    return np.ascontiguousarray(chosen[:, 0] + u * (chosen[:, 1] - chosen[:, 0]) + v * (chosen[:, 2] - chosen[:, 0]))


def scale_of(obj: bpy.types.Object) -> float:
    """How long one unit of the object is in the world. Attributes are in the object's unit, and legends multiply them by this."""
    return obj.matrix_world.median_scale or 1.0


def write(obj: bpy.types.Object, name: str, values: np.ndarray) -> None:
    """Stores lengths of the world as a point attribute."""
    attribute = point_data.writable(obj.data, name, 'FLOAT')
    attribute.data.foreach_set("value", (values / np.float32(scale_of(obj))).astype(np.float32))
