# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays as the library takes them, and what it computes of arrays alone."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import byref, c_uint64

import numpy as np

from . import abi
from .abi import MAX_RAMP as MOST_RAMP
from .handles import Task
from .loader import TYPES, PatinaError, check, library


def view(array: np.ndarray | None, count: int) -> abi.Array:
    """The library's view of a (count, components) array, which must stay alive during the call."""
    if array is None:
        return abi.Array()
    if array.ndim != 2 or len(array) != count or not array.flags.c_contiguous:
        raise PatinaError(f"an array of shape {array.shape} cannot hold {count} points")
    return abi.Array(data=array.ctypes.data, type=TYPES[array.dtype.name], components=array.shape[1])


def describe(positions: np.ndarray, normals: np.ndarray | None, colors: np.ndarray | None,
              opacities: np.ndarray | None, radii: np.ndarray | None = None, scalars: np.ndarray | None = None,
              classes: np.ndarray | None = None, threads: int = 0, origin: tuple[float, ...] = (0.0,) * 3) -> abi.CloudDesc:
    count = len(positions)
    return abi.CloudDesc(count=count, position=view(positions, count), normal=view(normals, count),
                      color=view(colors, count), opacity=view(opacities, count), radius=view(radii, count),
                      scalar=view(scalars, count), classes=view(classes, count), threads=threads, origin=origin)


def nearest_depths(depth: np.ndarray) -> np.ndarray:
    """The nearest of 5 x 5 pixels, for all pixels; (height, width, 1) float32."""
    depth = np.ascontiguousarray(depth, np.float32)
    nearest = np.empty_like(depth)
    check(library().patina_nearest_depths(depth.ctypes.data, depth.shape[1], depth.shape[0], nearest.ctypes.data, nearest.nbytes))
    return nearest


def ramp(name: str) -> np.ndarray:
    """(MOST_RAMP, 3) float32, linear: a ramp of the library's."""
    colors = np.empty((MOST_RAMP, 3), np.float32)
    check(library().patina_ramp(name.encode(), colors.ctypes.data))
    return colors


def start_fingerprint(*arrays: np.ndarray | None) -> Task:
    """A task that gives two numbers: of places, normals, opacities, radii and classes, and of colours and scalars. arrays:
    positions, normals, colors, opacities, radii, scalars, classes."""
    values = (c_uint64 * 2)()
    return Task("fingerprint", byref(describe(*arrays)), values, keep=(arrays, values), finish=lambda task: tuple(values))


def start_grid_normals(positions: np.ndarray, columns: np.ndarray, rows: np.ndarray, station: Sequence[float]) -> Task:
    """A task that gives (n, 3) normals of a scan's points, towards its scanner, out of its grid; 0 0 0 where there is none."""
    positions = np.ascontiguousarray(positions, np.float32)
    columns, rows = (np.ascontiguousarray(values, np.uint32) for values in (columns, rows))
    normals = np.empty((len(positions), 3), np.float32)
    grid = abi.GridDesc(count=len(positions), position=positions.ctypes.data, column=columns.ctypes.data, row=rows.ctypes.data,
                     station=tuple(station))
    return Task("grid_normals", byref(grid), None, normals.ctypes.data,
                keep=(positions, columns, rows, normals), finish=lambda task: normals)
