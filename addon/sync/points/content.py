# SPDX-License-Identifier: GPL-3.0-or-later
"""What objects with points hold: arrays, and the identity of the data that they came from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import bpy
import numpy as np

from ... import native, point_data
from ...jobs import Steps
from ..analyses import analysis
from ..analyses.scans_of import SCAN_NAMES, Scans, scans_in
from ..objects import meshes
from . import attributes, colors, node_colors, soft, splats


@dataclass(frozen=True)
class PointArrays:
    positions: np.ndarray  # (n, 3) float32
    normals: np.ndarray | None  # (n, 3) float32
    colors: np.ndarray | None  # (n, 4) uint8 sRGB, or (n, 3|4) float32 linear
    opacities: np.ndarray | None  # (n, 1) float32
    scalars: np.ndarray | None = None  # (n, 1) float32
    classes: np.ndarray | None = None  # (n, 1) uint8
    radii: np.ndarray | None = None  # (n, 1) float32
    analyzed: bool = False
    stations: analysis.Stations | None = None  # where the scanners stood
    numbers: np.ndarray | None = None  # (n, 1) float32, that points are soft by
    scans: Scans | None = None  # where there are several
    scan_of: np.ndarray | None = None  # (n,) uint16, which of them each point is of

    def fingerprint(self) -> Steps[tuple[int, int]]:
        """Of the places, normals, opacities, radii and classes, and of the colours and scalars: what Blender's update tags miss
        (undo, geometry nodes, scripts) still shows."""
        task = native.start_fingerprint(self.positions, self.normals, self.colors, self.opacities, self.radii, self.scalars,
                                        self.classes)
        yield task
        return task.result()


def identity_of(obj: bpy.types.Object, used: set[tuple], radius: str, faces_as: int | str) -> tuple:
    """Names the data for this session. Geometry that modifiers made has no original: its object stands for it,
    counted where there are several."""
    original = obj.data.original
    owner = obj.original if original == obj.data else original
    # session_uid came with Blender 4.1
    base = (type(owner).__name__, getattr(owner, "session_uid", None) or owner.name_full, obj.type,
            *attribute_names(obj), analysis.wanted(obj))
    number = 0
    while (radius, *base, number, faces_as) in used:
        number += 1
    return (radius, *base, number, faces_as)


def attribute_names(obj: bpy.types.Object) -> tuple[str | bool | tuple, ...]:
    return (obj.patina.color_attribute, obj.patina.normal_attribute, obj.patina.opacity_attribute, colors.scalar_name(obj),
            obj.patina.colors.class_attribute, obj.patina.radius_attribute, obj.patina.hide_uncolored, soft.attribute_name(obj),
            *node_colors.identity(obj))


def radius_name(obj: bpy.types.Object, surface: str) -> str:
    """The attribute that discs' radii are taken from. Geometry Nodes gives every point cloud radii, asked or not: they count where
    the artist wants discs."""
    if obj.patina.radius_attribute or obj.type != 'POINTCLOUD' or surface != 'SPLATS':
        return obj.patina.radius_attribute
    return point_data.RADIUS if point_data.RADIUS in obj.data.attributes and not point_data.are_for_display(obj.data) else ""


def read(obj: bpy.types.Object, notices: list[str], radius_name: str, mesh_points: int,
          pause: Callable[[], None] = lambda: None) -> PointArrays | None:
    """The object's points; mesh_points > 0: so many on its faces. pause() is called between steps and may raise."""
    pause()
    with attributes.readable(obj) as data:
        return _read_data(obj, data, notices, radius_name, mesh_points, pause)


def _read_data(obj: bpy.types.Object, data: bpy.types.ID, notices: list[str], radius_name: str, mesh_points: int,
               pause: Callable[[], None]) -> PointArrays | None:
    if mesh_points:
        found = meshes.sample(obj, data, mesh_points)
        return PointArrays(*found, None) if found else None
    count = point_data.count_of(data)
    if count == 0:
        return None
    positions = attributes.positions(data, count)
    if positions is None:
        return None
    pause()
    normals = attributes.normals(data, count, obj.patina.normal_attribute)
    pause()
    rgb = attributes.colors(data, count, obj.patina.color_attribute, pause)
    pause()
    scalar, class_name = colors.scalar_name(obj), obj.patina.colors.class_attribute

    def numbers(name: str) -> np.ndarray | None:
        found = attributes.scalars(data, count, name)
        return attributes.weights(obj, data, count, name, pause) if found is None else found

    scalars = numbers(scalar)
    classes = attributes.classes(data, count, class_name)
    pause()
    opacities = attributes.opacities(data, count, obj.patina.opacity_attribute)
    if opacities is None:
        opacities = attributes.weights(obj, data, count, obj.patina.opacity_attribute, pause)
    radii = numbers(radius_name)
    if splats.are(data):
        discs = splats.read(obj.name, data, count, notices)
        normals = discs.normals if normals is None else normals
        rgb = rgb if obj.patina.color_attribute or discs.colors is None else discs.colors
        opacities = discs.opacities if opacities is None else opacities
        radii = radii if obj.patina.radius_attribute or discs.radii is None else discs.radii
    if radii is not None:
        radii = _within_box(obj.name, radii, positions, notices)
    for kind, name, found in (("color", obj.patina.color_attribute, rgb),
                              ("normal", obj.patina.normal_attribute, normals),
                              ("opacity", obj.patina.opacity_attribute, opacities),
                              ("radius", radius_name, radii),
                              ("scalar", scalar, scalars), ("class", class_name, classes)):
        if name and found is None:
            notices.append(f"'{obj.name}' has no point attribute '{name}' to take as {kind}")
    softened = soft.attribute_name(obj)
    by = numbers(softened)
    if softened and by is None:
        notices.append(f"'{obj.name}' has no point attribute '{softened}' to be soft by")
    if obj.patina.hide_uncolored:
        opacities, rgb = attributes.without_uncolored(opacities, rgb)
    if node_colors.used(obj):
        rgb, shown = node_colors.read(obj, data, positions, normals, notices, pause)
        opacities = opacities if shown is None else shown if opacities is None else opacities * shown
    analyzed = analysis.wanted(obj)
    stations = analysis.stations(obj, data, count, analyzed == 2) if analyzed else None
    if analyzed == 2 and not (stations and stations.by_grid):
        notices.append(f"'{obj.name}': {analysis.NO_GRID}")
    scans, scan_of = scans_in({name: column[:, 0] for name in SCAN_NAMES
                                      if (column := attributes.scalars(data, count, name)) is not None})
    return PointArrays(positions, normals, rgb, opacities, scalars, classes, radii, bool(analyzed), stations, by, scans, scan_of)


def _within_box(name: str, radii: np.ndarray, positions: np.ndarray, notices: list[str]) -> np.ndarray:
    """The radii (n, 1), none larger than half the diagonal of the finite points' bounding box; 0 for NaN. Says how many were changed: one
    infinite disc would cover the whole image. Points at one place keep finite radii."""
    wrong = np.isnan(radii)
    finite = positions[np.isfinite(positions).all(axis=1)]
    most = 0.5 * float(np.linalg.norm(np.ptp(finite.astype(np.float64), axis=0))) if len(finite) else 0.0
    large = radii > most if most > 0.0 else np.isposinf(radii)
    count = int(np.count_nonzero(wrong | large))
    if not count:
        return radii
    notices.append(f"'{name}': {count:,} disc radi{'us is' if count == 1 else 'i are'} not a number or larger than the cloud, and limited to it. "
                   "Check the attribute Disc Radius")
    return np.where(wrong, np.float32(0.0), np.where(large, np.float32(most), radii)).astype(np.float32)
