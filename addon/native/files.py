# SPDX-License-Identifier: GPL-3.0-or-later
"""Point files that the library reads."""

from __future__ import annotations

import os
import weakref
from ctypes import byref, c_void_p
from dataclasses import dataclass

import numpy as np

from . import abi
from .handles import Handle, Progress, Task, destroy, handle_of
from .loader import TYPES, library


@dataclass(frozen=True)
class FileScan:
    """patina_file_scan."""

    name: str
    count: int
    direction: tuple[float, float, float]  # in which the scanner looked; 0: not known, or all around
    interval: float  # of neighbouring samples; 0: not known
    station: tuple[float, float, float] | None  # file coordinates
    pose: tuple[float, ...]  # these, from the scan's own: three rows of four
    grid: tuple[int, int]  # columns and rows; 0: there is none


class File(Handle):
    """An opened point file. Arrays are float32, 8-bit colours uint8 RGBA (sRGB), other colours float32 (linear)."""

    _kind = "file"

    def __init__(self, path: str, progress: Progress | None = None) -> None:
        super().__init__(os.fsencode(path), handle_of(progress), create="patina_file_open")
        self._learn()

    @classmethod
    def start(cls, path: str, progress: Progress | None = None) -> Task:
        """A task that gives the file."""
        def take(task: Task) -> File:
            file = cls.__new__(cls)
            Handle.__init__(file, task._handle, blame=(task._handle,), create="patina_task_take_file")
            file._learn()
            return file

        return Task("open_file", os.fsencode(path), handle_of(progress), keep=(progress,), finish=take)

    @classmethod
    def of_rows(cls, rows: Handle, most: int) -> File | None:
        """The next window of a file; None behind its last."""
        handle = c_void_p()
        rows._call("next", most, byref(handle))
        if not handle:
            return None
        file = cls.__new__(cls)
        file._handle = handle
        file._finalizer = weakref.finalize(file, destroy, library().patina_file_destroy, handle, None)
        file._learn()
        return file

    def _learn(self) -> None:
        info = abi.FileInfo()
        self._call("get_info", byref(info))
        self.format = info.format.decode()
        self.count = info.count
        self.origin = tuple(info.origin)
        self.invalid_positions = info.invalid_positions
        self.splats = bool(info.splats)  # whose attributes "opacity" and "radius" are those of their discs
        self.attributes = [self._attribute(index) for index in range(info.attributes)]
        self._info = info

    def _attribute(self, index: int) -> str:
        attribute = abi.FileAttribute()
        self._call("get_attribute", index, byref(attribute))
        return attribute.name.decode("utf-8", "replace")

    def _column(self, call: str, shape: tuple[int, ...], *index: int, dtype: type = np.float32) -> np.ndarray:
        column = np.empty(shape, dtype)
        self._call(call, *index, column.ctypes.data, column.nbytes)
        return column

    def positions(self) -> np.ndarray:
        return self._column("read_positions", (self.count, 3))

    def normals(self) -> np.ndarray | None:
        return self._column("read_normals", (self.count, 3)) if self._info.has_normals else None

    def colors(self) -> np.ndarray | None:
        if not self._info.color_type:
            return None
        if self._info.color_type == TYPES["uint8"]:
            return self._column("read_colors_u8", (self.count, 4), dtype=np.uint8)
        return self._column("read_colors_f32", (self.count, 4))

    def attribute(self, index: int) -> np.ndarray:
        return self._column("read_attribute", (self.count,), index)

    def stations(self) -> np.ndarray:
        """(n, 3) float64, where the scanner stood, in the file's coordinates: attribute "scan" tells which for a point."""
        count = self._info.stations
        return self._column("read_stations", (count, 3), dtype=np.float64) if count else np.empty((0, 3))

    def scans(self) -> list[FileScan]:
        """What the file says of its scans, in the order of their numbers."""
        return [self._scan(index) for index in range(self._info.scans)]

    def _scan(self, index: int) -> FileScan:
        scan = abi.FileScan()
        self._call("get_scan", index, byref(scan))
        return FileScan(scan.name.decode("utf-8", "replace"), scan.count, tuple(scan.direction), scan.interval,
                        tuple(scan.station) if scan.has_station else None, tuple(scan.pose), (scan.columns, scan.rows))
