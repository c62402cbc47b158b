# SPDX-License-Identifier: GPL-3.0-or-later
"""The binding of rays.h: exact rays against triangles. The library is a target of the build (truth_rays); where it is not
built, the compiler makes it from the two sources."""

from __future__ import annotations

import ctypes
import os
import subprocess
from ctypes import POINTER, c_double, c_float, c_int32, c_int64, c_void_p
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]
SOURCES = [HERE / "rays.c", HERE / "albedo.c", HERE / "rays.h"]
PATTERNS = {"plain": 0, "bricks": 1, "tiles": 2, "wood": 3, "clouds": 4, "checks": 5}
THREADS = os.cpu_count() or 1


class Material(ctypes.Structure):
    _fields_ = [("pattern", c_int32), ("unused", c_int32), ("first", c_double * 3), ("second", c_double * 3),
                ("length", c_double), ("grain", c_double)]


def _load() -> ctypes.CDLL:
    path = ROOT / "build/out/release/tests/truth/libtruth_rays.so"
    if not path.is_file() or path.stat().st_mtime < max(one.stat().st_mtime for one in SOURCES):
        path = ROOT / "build/out/truth-cache/libtruth_rays.so"
        if not path.is_file() or path.stat().st_mtime < max(one.stat().st_mtime for one in SOURCES):
            path.parent.mkdir(parents=True, exist_ok=True)
            partial = path.with_suffix(f".{os.getpid()}")
            subprocess.run([os.environ.get("CC", "cc"), "-std=c11", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fPIC",
                            "-shared", "-D_GNU_SOURCE", "-pthread", "-o", str(partial), str(SOURCES[0]), str(SOURCES[1]),
                            "-lm"], check=True)
            partial.replace(path)
    lib = ctypes.CDLL(str(path))
    lib.rays_create.restype, lib.rays_create.argtypes = c_void_p, (c_void_p, c_int64)
    lib.rays_destroy.restype, lib.rays_destroy.argtypes = None, (c_void_p,)
    lib.rays_trace.argtypes = (c_void_p, c_void_p, c_int32, c_void_p, c_int64, POINTER(c_double), POINTER(c_int32), c_int32)
    lib.rays_nearest.argtypes = (c_void_p, c_void_p, c_void_p, c_void_p, c_int32, c_int64, c_void_p, POINTER(c_double), c_int32)
    lib.rays_albedo.restype = None
    lib.rays_albedo.argtypes = (POINTER(Material), c_void_p, c_void_p, c_void_p, c_int64, POINTER(c_float))
    return lib


_library: ctypes.CDLL | None = None


def library() -> ctypes.CDLL:
    global _library
    if _library is None:
        _library = _load()
    return _library


class Rays:
    """corners (n, 3, 3) float64; material (n,) indices into materials."""

    def __init__(self, corners: np.ndarray, material: np.ndarray, materials: list[Material]) -> None:
        corners = np.ascontiguousarray(corners, np.float64)
        self._handle = library().rays_create(corners.ctypes.data, len(corners))
        if not self._handle:
            raise MemoryError("no tree for so many triangles")
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        self.normal = normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-30)[:, None]
        self.material = np.ascontiguousarray(material, np.int32)
        self._materials = (Material * len(materials))(*materials)

    def __del__(self) -> None:
        if getattr(self, "_handle", None):
            library().rays_destroy(self._handle)

    def trace(self, origin: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """origin (3,) or (n, 3), direction (n, 3) → t (n,), inf where nothing is met; triangle (n,), else -1."""
        direction = np.ascontiguousarray(direction, np.float64)
        origin = np.ascontiguousarray(origin, np.float64)
        count = len(direction)
        t, triangle = np.empty(count), np.empty(count, np.int32)
        code = library().rays_trace(self._handle, origin.ctypes.data, int(origin.ndim == 1), direction.ctypes.data, count,
                                    t.ctypes.data_as(POINTER(c_double)), triangle.ctypes.data_as(POINTER(c_int32)), THREADS)
        if code:
            raise RuntimeError("no thread for the rays")
        return t, triangle

    def nearest(self, place: np.ndarray, part: np.ndarray, parts: np.ndarray, most: np.ndarray) -> np.ndarray:
        """place (n, 3); part of each triangle; parts (n, k) of each place, -1 for none → distance (n,) from the nearest
        triangle of these parts, or `most` (n,) where none is nearer; a small one makes the search short."""
        most = np.ascontiguousarray(most, np.float64)
        place, part = np.ascontiguousarray(place, np.float64), np.ascontiguousarray(part, np.int32)
        parts = np.ascontiguousarray(parts, np.int32)
        distance = np.empty(len(place))
        code = library().rays_nearest(self._handle, part.ctypes.data, place.ctypes.data, parts.ctypes.data, parts.shape[1],
                                      len(place), most.ctypes.data, distance.ctypes.data_as(POINTER(c_double)), THREADS)
        if code:
            raise RuntimeError("no thread for the distances")
        return distance

    def albedo(self, place: np.ndarray, triangle: np.ndarray) -> np.ndarray:
        """Linear colours (n, 3) float32 at places on triangles."""
        place = np.ascontiguousarray(place, np.float64)
        which, normal = self.material[triangle], np.ascontiguousarray(self.normal[triangle])
        rgb = np.empty((len(place), 3), np.float32)
        library().rays_albedo(self._materials, which.ctypes.data, place.ctypes.data, normal.ctypes.data, len(place),
                              rgb.ctypes.data_as(POINTER(c_float)))
        return rgb
