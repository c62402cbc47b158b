# SPDX-License-Identifier: GPL-3.0-or-later
"""Which clouds are analyzed, and where the scanners of their points stood."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import bpy
import numpy as np

from .. import native, styles
from . import attributes, files, sequence

SCANNERS = "patina_scanners"  # of the data: x, y, z of each, as the points' own coordinates
SCAN, ROW, COLUMN = "scan", "row", "column"  # point attributes: by which of them, and where in its grid

# Modifiers whose points move without a curve of their own.
_MOVING = {'ARMATURE', 'BUILD', 'CLOTH', 'DYNAMIC_PAINT', 'EXPLODE', 'FLUID', 'HOOK', 'MESH_SEQUENCE_CACHE', 'OCEAN',
           'PARTICLE_INSTANCE', 'PARTICLE_SYSTEM', 'SOFT_BODY', 'WAVE'}
_MOVING_NODES = {'GeometryNodeInputSceneTime', 'GeometryNodeSimulationInput'}


@dataclass(frozen=True)
class Stations:
    places: np.ndarray  # (n, 3) float64
    of_points: np.ndarray | None  # (count, 1) uint16: which of them saw each point; None: the nearest
    grid: tuple[np.ndarray, np.ndarray] | None = None  # (count, 1) uint32: row and column of each

    @property
    def tells_free_space(self) -> bool:
        return self.of_points is not None and len(self.places) > 1


def label(cloud: native.Cloud) -> str:
    return f"Analyzing {cloud.count:,} points"


def wanted(obj: bpy.types.Object) -> bool:
    """Whether the points of an object, evaluated or not, are to be analyzed."""
    return obj.patina.analysis == 'ALWAYS' or obj.patina.analysis == 'AUTO' and not _moves(obj.original)


def stations(obj: bpy.types.Object, data: bpy.types.ID, count: int) -> Stations | None:
    """data: the object's, to read attributes from."""
    known = obj.original.data.get(SCANNERS)
    return of_columns(known, *(attributes.scalars(data, count, name) for name in (SCAN, ROW, COLUMN))) if known else None


def of_columns(places: Iterable[float], scan: np.ndarray | None = None, row: np.ndarray | None = None,
               column: np.ndarray | None = None) -> Stations | None:
    """places: x, y, z of each, NaN where that is not known. The others: numbers of all points, or None."""
    found = np.array(places, np.float64).reshape(-1, 3)
    somewhere = np.isfinite(found).all(axis=1)
    if not somewhere.any():
        return None
    scan = _whole(scan, len(found), np.uint16) if somewhere.all() else None
    grid = (_whole(row, 1 << 24, np.uint32), _whole(column, 1 << 24, np.uint32))
    return Stations(found[somewhere], scan, None if scan is None or grid[0] is None or grid[1] is None else grid)


def _whole(values: np.ndarray | None, end: int, kind: type) -> np.ndarray | None:
    """(count, 1); None where not all of them are numbers from 0 on below the end."""
    if values is None or not len(values) or not (values.min() >= 0 and values.max() < end):
        return None
    return np.ascontiguousarray(values, kind).reshape(-1, 1)


def _moves(obj: bpy.types.Object) -> bool:
    """Whether its points are others in every frame."""
    path = files.path_of(obj)
    if path:
        return sequence.is_pattern(path)
    keys = getattr(obj.data, "shape_keys", None)
    return bool(styles.animated(obj.data) or keys and styles.animated(keys)
                or any(path.startswith("modifiers") for path in styles.animated(obj))
                or any(_modifier_moves(modifier) for modifier in obj.modifiers))


def _modifier_moves(modifier: bpy.types.Modifier) -> bool:
    return modifier.type in _MOVING or modifier.type == 'NODES' and _nodes_move(modifier.node_group)


def _nodes_move(group: bpy.types.NodeTree | None) -> bool:
    return group is not None and bool(styles.animated(group) or any(
        node.bl_idname in _MOVING_NODES or node.type == 'GROUP' and _nodes_move(node.node_tree) for node in group.nodes))
