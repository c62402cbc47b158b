# SPDX-License-Identifier: GPL-3.0-or-later
"""Which clouds are analyzed, and where the scanners of their points stood."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from .. import native, styles
from . import attributes, sequence

SCANNERS = "patina_scanners"  # of the data: x, y, z of each, as the points' own coordinates
SCAN = "scan"  # point attribute: by which of them

# Modifiers whose points move without a curve of their own.
_MOVING = {'ARMATURE', 'BUILD', 'CLOTH', 'DYNAMIC_PAINT', 'EXPLODE', 'FLUID', 'HOOK', 'MESH_SEQUENCE_CACHE', 'OCEAN',
           'PARTICLE_INSTANCE', 'PARTICLE_SYSTEM', 'SOFT_BODY', 'WAVE'}
_MOVING_NODES = {'GeometryNodeInputSceneTime', 'GeometryNodeSimulationInput'}


@dataclass(frozen=True)
class Stations:
    places: np.ndarray  # (n, 3) float64
    of_points: np.ndarray | None  # (count, 1) uint16: which of them saw each point; None: the nearest


def label(cloud: native.Cloud) -> str:
    return f"Analyzing {cloud.count:,} points"


def wanted(obj: bpy.types.Object) -> bool:
    """Whether the points of an object, evaluated or not, are to be analyzed."""
    return obj.patina.analysis == 'ALWAYS' or obj.patina.analysis == 'AUTO' and not _moves(obj.original)


def stations(obj: bpy.types.Object, count: int) -> Stations | None:
    known = obj.original.data.get(SCANNERS)
    return of_columns(known, attributes.scalars(obj.data, count, SCAN)) if known else None


def of_columns(places: Iterable[float], scan: np.ndarray | None) -> Stations | None:
    """places: x, y, z of each. scan: numbers of all points, or None."""
    found = np.array(places, np.float64).reshape(-1, 3)
    if not len(found):
        return None
    # a file may know the places of some scans only
    known = scan is not None and len(scan) and scan.min() >= 0 and scan.max() < len(found)
    return Stations(found, np.ascontiguousarray(scan, np.uint16).reshape(-1, 1) if known else None)


def _moves(obj: bpy.types.Object) -> bool:
    """Whether its points are others in every frame."""
    if obj.patina.linked_file:
        return sequence.is_pattern(Path(obj.patina.linked_file))
    keys = getattr(obj.data, "shape_keys", None)
    return bool(styles.animated(obj.data) or keys and styles.animated(keys)
                or any(path.startswith("modifiers") for path in styles.animated(obj))
                or any(_modifier_moves(modifier) for modifier in obj.modifiers))


def _modifier_moves(modifier: bpy.types.Modifier) -> bool:
    return modifier.type in _MOVING or modifier.type == 'NODES' and _nodes_move(modifier.node_group)


def _nodes_move(group: bpy.types.NodeTree | None) -> bool:
    return group is not None and bool(styles.animated(group) or any(
        node.bl_idname in _MOVING_NODES or node.type == 'GROUP' and _nodes_move(node.node_tree) for node in group.nodes))
