# SPDX-License-Identifier: GPL-3.0-or-later
"""Which clouds are analyzed, and where the scanners of their points stood."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import bpy
import numpy as np

from ... import native
from ...description.points import Stations
from ...read.importers import scans
from ...styles import styles
from ..points import attributes, files, sequence

SCANNERS = "patina_scanners"  # of the data: x, y, z of each, as the points' own coordinates
SCAN, ROW, COLUMN = "scan", "row", "column"  # point attributes: by which of them, and where in its grid
NO_GRID = "no scan says in which row and column each point lies and from where it was taken: neighbors in space tell all"

# Modifiers whose points move without a curve of their own.
_MOVING = {'ARMATURE', 'BUILD', 'CLOTH', 'DYNAMIC_PAINT', 'EXPLODE', 'FLUID', 'HOOK', 'MESH_SEQUENCE_CACHE', 'OCEAN',
           'PARTICLE_INSTANCE', 'PARTICLE_SYSTEM', 'SOFT_BODY', 'WAVE'}
_MOVING_NODES = {'GeometryNodeInputSceneTime', 'GeometryNodeSimulationInput'}


def label(cloud: native.Cloud) -> str:
    return f"Analyzing {cloud.count:,} points"


def wanted(obj: bpy.types.Object) -> int:
    """Whether the points of an object, evaluated or not, are to be analyzed: 0 not, 2 by their scans' grids, else 1."""
    if not (obj.patina.analysis == 'ALWAYS' or obj.patina.analysis == 'AUTO' and not _moves(obj.original)):
        return 0
    return 2 if obj.patina.analysis_grid and not obj.patina.linked_file else 1


def least_trust(patina: bpy.types.PropertyGroup) -> float:
    """As the library takes it: 0 is its default, and what is below 0 draws all points."""
    if patina.least_trust < 0.0:
        return 0.0
    return patina.least_trust if patina.least_trust > 0.0 else -1.0


def stations(obj: bpy.types.Object, data: bpy.types.ID, count: int, by_grid: bool) -> Stations | None:
    """data: the object's, to read attributes from."""
    known, told = obj.original.data.get(SCANNERS), obj.original.data.get(scans.PROPERTY)
    if not known and not by_grid:
        return None
    columns = [attributes.scalars(data, count, name) for name in (SCAN, ROW, COLUMN)]
    found = of_columns(known, *columns) if known else None
    return gridded(found, scans.unpacked(told), *columns) if by_grid else found


def gridded(found: Stations | None, told: list[scans.Scan], scan: np.ndarray | None, row: np.ndarray | None,
            column: np.ndarray | None) -> Stations | None:
    """With the neighbors in the scans' grids, where there are such: of scans whose places are known, or that tell their directions."""
    grid = (_whole(row, 1 << 24, np.uint32), _whole(column, 1 << 24, np.uint32))
    if grid[0] is None or grid[1] is None:
        return found
    if found is not None:
        return replace(found, grid=grid, by_grid=True) if found.of_points is not None or len(found.places) == 1 else found
    of = _whole(scan, len(told), np.uint16)
    if not any(any(one.direction) for one in told) or of is None and len(told) > 1:
        return None
    return Stations(np.zeros((0, 3)), None, grid, True, of, np.array([one.direction for one in told], np.float64))


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
