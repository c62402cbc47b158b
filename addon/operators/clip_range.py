# SPDX-License-Identifier: GPL-3.0-or-later
"""Clip distances of cameras and 3D views that fit the size of a scan: a camera in a room, and one before a grain of sand."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from bpy.types import Camera, SpaceView3D
from mathutils import Vector

NEAR = 2e-4  # of the extent, where a camera begins to see: 2 mm in a room of 10 m
FAR = 10.0  # extents, where it ends: Blender's depths of 24 bits tell overlays from points between these
AIR = 1.2  # times the farthest place that must be seen


def extent_of(corners: Iterable[Vector]) -> float:
    """The longest side of a box around finite corners; 0 without."""
    places = np.array([tuple(corner) for corner in corners], np.float64).reshape(-1, 3)
    places = places[np.isfinite(places).all(axis=1)]
    return float(np.ptp(places, axis=0).max()) if len(places) else 0.0


def fit(settings: Camera | SpaceView3D, extent: float, farthest: float = 0.0, only_widen: bool = False) -> None:
    """Sets Clip Start and Clip End for a scan of an extent, and for places as far as `farthest`. only_widen: never sees less than before."""
    if not extent > 0.0:
        return
    start, end = NEAR * extent, max(FAR * extent, AIR * farthest)
    settings.clip_start = min(start, settings.clip_start) if only_widen else start
    settings.clip_end = max(end, settings.clip_end) if only_widen else end
