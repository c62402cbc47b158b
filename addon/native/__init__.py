# SPDX-License-Identifier: GPL-3.0-or-later
"""The library's handles as Python's objects. This folder alone knows ctypes.

Every call that fails raises `PatinaError` with the library's own sentence. Calls release the GIL. A handle may be used
from any thread, one call at a time; `Frame.cancel`, `Frame.progress`, `Progress.cancel` and `Progress.value` at any time.
What `start` in a name begins is a `Task`, which runs without Python.
"""

from __future__ import annotations

import ctypes
import json
import os
import weakref
from collections.abc import Callable, Sequence
from ctypes import byref, c_double, c_float, c_uint32, c_uint64, c_void_p
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from . import abi, devices
from .abi import MAX_LAYERS as MOST_LAYERS
from .abi import MAX_RAMP as MOST_RAMP
from .abi import PASSES as PLANES
from .loader import (
    CANCELLED,
    FILE,
    FORMAT,
    INTERNAL,
    MEMORY,
    NEIGHBOURHOODS,
    TOO_MANY_POINTS,
    TYPES,
    PatinaCancelled,
    PatinaError,
    check,
    forget_library,
    library,
    library_path,
    log_lines,
    split_plane,
)

__all__ = ["CANCELLED", "FILE", "FORMAT", "INTERNAL", "KINDS", "MEMORY", "MOST_LAYERS", "MOST_RAMP", "NEIGHBOURHOODS", "PLANES", "Cloud", "Device", "File",
           "Frame", "Mesh", "Panorama", "PatinaCancelled", "PatinaError", "Progress", "Scene", "TOO_MANY_POINTS", "Task", "Texture", "WRAPS",
           "forget_library", "library", "library_path", "log_lines", "losses", "nearest_depths", "ramp", "split_plane", "start_fingerprint", "start_grid_normals"]


KINDS = tuple(abi.KIND)  # patina_kind
WRAPS = tuple(abi.WRAP)  # patina_wrap
NO_PAGE = 2 ** 32 - 1  # PATINA_NO_PAGE
_losses = [0]  # pictures that lacked points of files that cannot be read any more


def losses() -> int:
    """Grows whenever a picture lacked such points: clouds that were opened before may be such files."""
    return _losses[0]


def _destroy(destroy: Callable[[c_void_p], None], handle: c_void_p, _keep: Any) -> None:
    destroy(handle)


class _Handle:
    """Owns a native handle until close(), the end of a `with`, or the last reference. `keep` lives as long."""

    _kind = ""

    def __init__(self, *arguments: Any, blame: tuple[c_void_p, ...] = (), create: str = "", keep: Any = None) -> None:
        lib = library()
        handle = c_void_p()
        check(getattr(lib, create or f"patina_{self._kind}_create")(*arguments, byref(handle)), *blame)
        self._handle = handle
        self._finalizer = weakref.finalize(self, _destroy, getattr(lib, f"patina_{self._kind}_destroy"), handle, keep)

    def close(self) -> None:
        self._finalizer()

    def __enter__(self):
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def _call(self, name: str, *arguments: Any) -> None:
        if not self._finalizer.alive:
            raise PatinaError(f"this {self._kind} is closed")
        check(getattr(library(), f"patina_{self._kind}_{name}")(self._handle, *arguments), self._handle)


class Progress(_Handle):
    """Of a long call that has no frame; value() and cancel() may be called while it runs."""

    _kind = "progress"

    def cancel(self) -> None:
        library().patina_progress_cancel(self._handle)

    def value(self) -> float:
        return library().patina_progress_value(self._handle)


class Task(_Handle):
    """A call that runs on a native thread; what it uses stays alive until it ends. close() waits for it."""

    _kind = "task"

    def __init__(self, call: str, *arguments: Any, keep: tuple,
                 finish: Callable[[Task], Any] = lambda task: None) -> None:
        super().__init__(*arguments, create=f"patina_task_{call}", keep=keep)
        self._finish = finish

    def done(self) -> bool:
        return not self._finalizer.alive or bool(library().patina_task_done(self._handle))

    def result(self) -> Any:
        """Waits; raises what the call would have raised, else gives its result. Once: then the task is closed."""
        try:
            self._call("wait")
            return self._finish(self)
        finally:
            self.close()


def _handle_of(progress: Progress | None) -> c_void_p | None:
    return progress._handle if progress else None


class Device(_Handle):
    _kind = "device"

    def __init__(self, name: str = "auto", threads: int = 0, mapped: int = 0) -> None:
        """mapped: bytes that a picture holds of mapped clouds at a time; 0: a third of what is free."""
        super().__init__(byref(abi.DeviceDesc(name=name.encode(), threads=threads, mapped_cap=mapped)))
        info = abi.DeviceInfo()
        self._call("get_info", byref(info))
        self.name = info.name.decode()
        self.description = info.description.decode("utf-8", "replace")
        self.hardware = bool(info.hardware)
        self.label = devices.label(self.name, self.description, self.hardware)  # for people


def _view(array: np.ndarray | None, count: int) -> abi.Array:
    """The library's view of a (count, components) array, which must stay alive during the call."""
    if array is None:
        return abi.Array()
    if array.ndim != 2 or len(array) != count or not array.flags.c_contiguous:
        raise PatinaError(f"an array of shape {array.shape} cannot hold {count} points")
    return abi.Array(data=array.ctypes.data, type=TYPES[array.dtype.name], components=array.shape[1])


def _describe(positions: np.ndarray, normals: np.ndarray | None, colors: np.ndarray | None,
              opacities: np.ndarray | None, radii: np.ndarray | None = None, scalars: np.ndarray | None = None,
              classes: np.ndarray | None = None, threads: int = 0, origin: tuple[float, ...] = (0.0,) * 3) -> abi.CloudDesc:
    count = len(positions)
    return abi.CloudDesc(count=count, position=_view(positions, count), normal=_view(normals, count),
                      color=_view(colors, count), opacity=_view(opacities, count), radius=_view(radii, count),
                      scalar=_view(scalars, count), classes=_view(classes, count), threads=threads, origin=origin)


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
    return Task("fingerprint", byref(_describe(*arrays)), values, keep=(arrays, values), finish=lambda task: tuple(values))


def start_grid_normals(positions: np.ndarray, columns: np.ndarray, rows: np.ndarray, station: Sequence[float]) -> Task:
    """A task that gives (n, 3) normals of a scan's points, towards its scanner, out of its grid; 0 0 0 where there is none."""
    positions = np.ascontiguousarray(positions, np.float32)
    columns, rows = (np.ascontiguousarray(values, np.uint32) for values in (columns, rows))
    normals = np.empty((len(positions), 3), np.float32)
    grid = abi.GridDesc(count=len(positions), position=positions.ctypes.data, column=columns.ctypes.data, row=rows.ctypes.data,
                     station=tuple(station))
    return Task("grid_normals", byref(grid), None, normals.ctypes.data,
                keep=(positions, columns, rows, normals), finish=lambda task: normals)


class Cloud(_Handle):
    """Points: positions (n, 3); normals (n, 3) or None; colors (n, 3|4), integers sRGB, floats linear, or None;
    opacities (n, 1), floats 0 to 1, or None; origin is added to the positions, in float64; radii of discs (n, 1), floats,
    or None; scalars (n, 1), any numbers, or None; classes (n, 1) uint8 or None."""

    _kind = "cloud"

    # Of several scans: a uint16 for each point, in the given order, says which it is of, or a file of them, for linked ones; the
    # attribute that named them, and as what. scan_stamp counts how often they changed, color_stamp how often the colors did.
    scan_file: Path | None = None
    scan_of: np.ndarray | None = None
    scan_stamp = 0
    color_stamp = 0
    stream: Any = None  # of one whose points arrive page by page: streaming.Stream
    numbers: np.ndarray | None = None  # (count,) that points may be soft by, in the given order; whoever reads the points sets them, and
    numbers_stamp = 0  # counts how often they changed
    scan_name: str = ""
    scan_numbers: tuple[int, ...] = ()
    renewed = ""  # what to tell of a saved cloud whose points were analyzed again
    losses: int | None = None  # of a mapped file: losses() as it was opened

    def __init__(self, positions: np.ndarray, normals: np.ndarray | None = None, colors: np.ndarray | None = None,
                 progress: Progress | None = None, threads: int = 0, opacities: np.ndarray | None = None,
                 origin: tuple[float, ...] = (0.0,) * 3, radii: np.ndarray | None = None,
                 scalars: np.ndarray | None = None, classes: np.ndarray | None = None) -> None:
        super().__init__(byref(_describe(positions, normals, colors, opacities, radii, scalars, classes, threads, origin)),
                         _handle_of(progress))
        self._learn()

    @classmethod
    def start(cls, positions: np.ndarray, normals: np.ndarray | None, colors: np.ndarray | None,
              opacities: np.ndarray | None, progress: Progress | None = None, radii: np.ndarray | None = None,
              scalars: np.ndarray | None = None, classes: np.ndarray | None = None,
              origin: tuple[float, ...] = (0.0,) * 3) -> Task:
        """A task that gives the cloud."""
        def take(task: Task) -> Cloud:
            cloud = cls.__new__(cls)
            _Handle.__init__(cloud, task._handle, blame=(task._handle,), create="patina_task_take_cloud")
            cloud._learn()
            return cloud

        arrays = (positions, normals, colors, opacities, radii, scalars, classes)
        return Task("build", byref(_describe(*arrays, origin=origin)), _handle_of(progress), keep=(arrays, progress),
                    finish=take)

    @classmethod
    def open(cls, path: Path, offset: Sequence[float] = (0.0, 0.0, 0.0)) -> Cloud:
        """A saved cloud, mapped; offset: added to every position, float64. PatinaError when it is not one of this version."""
        cloud = cls.__new__(cls)
        _Handle.__init__(cloud, os.fsencode(path), (c_double * 3)(*offset), create="patina_cloud_open_at")
        cloud.losses = losses()
        cloud._learn()
        return cloud

    @classmethod
    def begin(cls, boxes: np.ndarray, gaps: np.ndarray, counts: np.ndarray, parents: np.ndarray, color_type: str, scalars: bool,
              classes: bool, box: tuple[Sequence[float], Sequence[float]], memory_cap: int = 0) -> Cloud:
        """A cloud whose points arrive page by page: boxes (n, 6), lower corners first; parents' index or -1; color_type: of numpy,
        "" without colors."""
        pages = (abi.Page * len(gaps))()
        values = np.frombuffer(pages, [("box", "f8", 6), ("gap", "f8"), ("count", "u4"), ("parent", "u4")])
        values["box"], values["gap"], values["count"] = boxes, gaps, counts
        values["parent"] = np.where(parents < 0, NO_PAGE, parents)
        cloud = cls.__new__(cls)
        _Handle.__init__(cloud, byref(abi.PagesDesc(
            pages=ctypes.addressof(pages), page_count=len(gaps), color_type=TYPES.get(color_type, 0), has_scalars=scalars,
            has_classes=classes, box_min=tuple(box[0]), box_max=tuple(box[1]), memory_cap=memory_cap)), create="patina_cloud_pages_begin")
        cloud._learn()
        return cloud

    def start_page(self, page: int, positions: np.ndarray, colors: np.ndarray | None, scalars: np.ndarray | None,
                   classes: np.ndarray | None) -> Task:
        """A task that hands a page's points in; its result() raises PatinaError where they are not what was promised. At any time."""
        arrays = (positions, None, colors, None, None, scalars, classes)
        return Task("give_page", self._handle, page, byref(_describe(*arrays)), keep=(self, arrays))

    def wanted(self, least_px: float, room: int) -> list[int]:
        """Absent pages that pictures wanted since the last call, near and coarse ones first: their parents' gap is more pixels."""
        found, count = (c_uint32 * room)(), c_uint32()
        self._call("wanted", least_px, found, room, byref(count))
        return list(found[:count.value])

    def pages(self) -> dict[str, int]:
        """The fields of patina_pages_info."""
        info = abi.PagesInfo()
        self._call("get_pages", byref(info))
        return {name: getattr(info, name) for name, _ in abi.PagesInfo._fields_[1:]}

    @staticmethod
    def start_verifying(path: Path, progress: Progress | None = None) -> Task:
        """A task that reads a saved cloud whole; its result() raises PatinaError where it is damaged."""
        return Task("verify", os.fsencode(path), _handle_of(progress), keep=(progress,))

    def start_save(self, path: Path) -> Task:
        """A task that writes the cloud."""
        return Task("save", self._handle, os.fsencode(path), keep=(self,))

    def _learn(self) -> None:
        info = abi.CloudInfo()
        self._call("get_info", byref(info))
        self.count, self.drawn, self.bytes = info.count, info.drawn, info.bytes
        self.footprint = max(info.bytes, 23 * info.count)  # with what of a mapped file may be in memory
        self.invalid_positions = info.invalid_positions
        self.has_normals = bool(info.has_normals)
        self.has_colors = bool(info.has_colors)
        self.class_bits = tuple(info.class_bits)  # classes that drawn points have
        self.has_scalars = bool(info.has_scalars)
        self.has_classes = bool(info.has_classes)
        self.has_opacities = bool(info.has_opacities)
        self.has_shapes = bool(info.has_shapes)  # analysed
        self.normals_oriented = bool(info.normals_oriented)
        self.kinds = tuple(info.kinds)  # points of each of KINDS
        self.trusts = tuple(info.trusts)  # drawn points of each level of trust; see sync/trust.py
        self.trust_default = info.trust_default  # least trust of points that are drawn by default
        self.seen_through = info.seen_through  # points that a station saw through
        self.uncolored = info.uncolored  # points with a color that their neighbors lent
        self.layer_distance = info.layer_distance  # what d_min = 0 stands for at the median spacing, object units
        self.box = (tuple(info.box_min), tuple(info.box_max))
        self.radius_most = info.radius_most  # of points' own radii, object units; 0: they have none

    def start_colors(self, colors: np.ndarray | None) -> Task:
        """Other colours for the same points; no picture of them may be drawn meanwhile."""
        return Task("set_colors", self._handle, byref(_view(colors, self.count)), keep=(self, colors))

    def _describe_analysis(self, neighbours: int = 0, stations: np.ndarray | None = None, station: np.ndarray | None = None,
                           keep_normals: bool = True, threads: int = 0, free_space: bool = False,
                           grid: tuple[np.ndarray, np.ndarray] | None = None, by_grid: bool = False,
                           scan: np.ndarray | None = None, directions: np.ndarray | None = None,
                           trust_features: np.ndarray | None = None, keep_colors: bool = False) -> tuple[abi.AnalysisDesc, tuple]:
        """The description, and what it needs to stay."""
        stations, directions = (None if places is None else np.ascontiguousarray(places, np.float64)
                                for places in (stations, directions))
        row, column = grid or (None, None)
        count, ways = (0 if places is None else len(places) for places in (stations, directions))
        return abi.AnalysisDesc(neighbours=neighbours, threads=threads, keep_normals=keep_normals, station_count=count,
                             stations=stations.ctypes.data if count else None, station=_view(station, self.count),
                             free_space=free_space, row=_view(row, self.count), column=_view(column, self.count), grid=by_grid,
                             scan=_view(scan, self.count), direction_count=ways,
                             directions=directions.ctypes.data if ways else None, keep_colors=keep_colors,
                             trust_features=None if trust_features is None else trust_features.ctypes.data), \
            (self, stations, station, grid, scan, directions, trust_features)

    def analyse(self, progress: Progress | None = None, **given: Any) -> None:
        """Gives points normals, spacings and footprints of their own; as start_colors. given: neighbours; keep_normals; threads;
        stations: (n, 3) places of the scanner that normals face; station: (count, 1) uint8 or uint16, which of them saw the point;
        free_space: marks points that another station saw through; grid: row and column of each point, (count, 1) uint16, uint32 or
        int32; by_grid: neighbours there tell surfaces and where these end; scan: in whose grid each lies, as station;
        directions: (n, 3), in which scans looked whose beams are parallel, else 0; trust_features: (count, 33) float32 zeros, which
        what trust is found from goes into; keep_colors: points without a color stay black."""
        described, _kept = self._describe_analysis(**given)
        self._call("analyse", byref(described), _handle_of(progress))
        self._learn()

    def start_analysis(self, progress: Progress | None = None, **given: Any) -> Task:
        """analyse, beside pictures: its result() changes the cloud, and no picture of it may be drawn then."""
        def apply(task: Task) -> None:
            task._call("apply")
            self._learn()

        described, kept = self._describe_analysis(**given)
        return Task("analyse", self._handle, byref(described), _handle_of(progress), keep=(*kept, progress), finish=apply)

    def neighbourhoods(self, *names: str, neighbours: int = 16, progress: Progress | None = None,
                       threads: int = 0) -> dict[str, np.ndarray]:
        """Arrays by name: those of NEIGHBOURHOODS that are named, else all that need no walk to neighbours."""
        arrays = {}
        for name in names or list(NEIGHBOURHOODS)[:8]:
            kind, width = NEIGHBOURHOODS[name]
            arrays[name] = np.empty((self.count, neighbours if width < 0 else width) if width else self.count, kind)
        self._call("neighbourhoods", byref(abi.Neighbourhoods(neighbours=neighbours, threads=threads,
                                                           **{name: a.ctypes.data for name, a in arrays.items()})),
                   _handle_of(progress))
        return arrays

    def set_scalars(self, scalars: np.ndarray | None) -> None:
        """Other scalars for the same points; as start_colors."""
        self._call("set_scalars", byref(_view(scalars, self.count)))
        self.has_scalars = scalars is not None

    def dense_box(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Of the points without strays."""
        lower, upper = (c_double * 3)(), (c_double * 3)()
        self._call("dense_box", lower, upper)
        return tuple(lower), tuple(upper)

    def scalar_range(self, share: float) -> tuple[float, float]:
        """The scalars that this share of the points lies below and above."""
        found = (c_float * 2)()
        self._call("scalar_range", share, found)
        return tuple(found)


class Mesh(_Handle):
    """Triangles, three corners each: positions (3 n, 3), normals (3 n, 3) or None, linear colors (3 n, 3|4) or None, where each
    lies on an image (3 n, 2) or None, all float32."""

    _kind = "mesh"

    def __init__(self, positions: np.ndarray, normals: np.ndarray | None, colors: np.ndarray | None,
                 uv: np.ndarray | None = None) -> None:
        corners = len(positions)
        super().__init__(byref(abi.MeshDesc(vertex_count=corners, position=_view(positions, corners),
                                         normal=_view(normals, corners), color=_view(colors, corners),
                                         triangle_count=corners // 3, uv=_view(uv, corners))))
        self.count = corners // 3
        self.bare: Mesh | None = None  # the same without colors, where somebody asked for it


class Texture(_Handle):
    """An image for meshes: pixels (height, width, 4), uint8 or float32, rows from the bottom, opacity last. raw: bytes are linear,
    not sRGB. wrap: of WRAPS."""

    _kind = "texture"

    def __init__(self, pixels: np.ndarray, raw: bool, nearest: bool, wrap: str) -> None:
        height, width = pixels.shape[:2]
        super().__init__(byref(abi.TextureDesc(width=width, height=height, pixels=_view(pixels.reshape(-1, 4), height * width),
                                            raw=raw, nearest=nearest, wrap=WRAPS.index(wrap))))


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


class File(_Handle):
    """An opened point file. Arrays are float32, 8-bit colours uint8 RGBA (sRGB), other colours float32 (linear)."""

    _kind = "file"

    def __init__(self, path: str, progress: Progress | None = None) -> None:
        super().__init__(os.fsencode(path), _handle_of(progress), create="patina_file_open")
        self._learn()

    @classmethod
    def start(cls, path: str, progress: Progress | None = None) -> Task:
        """A task that gives the file."""
        def take(task: Task) -> File:
            file = cls.__new__(cls)
            _Handle.__init__(file, task._handle, blame=(task._handle,), create="patina_task_take_file")
            file._learn()
            return file

        return Task("open_file", os.fsencode(path), _handle_of(progress), keep=(progress,), finish=take)

    @classmethod
    def of_rows(cls, rows: _Handle, most: int) -> File | None:
        """The next window of a file; None behind its last."""
        handle = c_void_p()
        rows._call("next", most, byref(handle))
        if not handle:
            return None
        file = cls.__new__(cls)
        file._handle = handle
        file._finalizer = weakref.finalize(file, _destroy, library().patina_file_destroy, handle, None)
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


class Scene(_Handle):
    """Clouds, lights, a camera and settings; keyword arguments are the fields of the header's descriptors."""

    _kind = "scene"

    def __init__(self) -> None:
        super().__init__()
        self.clouds: list[Cloud] = []  # by instance; the native scene points to them and what is kept
        self._kept: list[_Handle] = []

    def add_cloud(self, cloud: Cloud, ramp: bytes = b"", mask: points.Mask | None = None, grade: points.Grade | None = None,
                  field: points.Field | None = None, scans: points.ScanSet | None = None, **style: Any) -> None:
        """ramp: linear RGB, float32, two colours or more; empty: black to white."""
        fields = abi.CloudStyle(**style, mask=mask and mask._handle, grade=grade and grade._handle, scans=scans and scans._handle,
                                field=field and field._handle)
        if ramp:
            colors = np.frombuffer(ramp, np.float32)  # the library copies it
            fields.ramp, fields.ramp_count = colors.ctypes.data, len(colors) // 3
        self._call("add_cloud", cloud._handle, byref(fields))
        self.clouds.append(cloud)
        self._kept += [handle for handle in (mask, grade, field, scans) if handle]

    def add_mesh(self, mesh: Mesh, texture: Texture | None = None, **style: Any) -> None:
        self._call("add_mesh", mesh._handle, byref(abi.MeshStyle(texture=texture._handle if texture else None, **style)))
        self._kept += [mesh, texture] if texture else [mesh]

    def add_clip(self, **clip: Any) -> None:
        self._call("add_clip", byref(abi.Clip(**clip)))

    def add_light(self, **light: Any) -> None:
        self._call("add_light", byref(abi.LightDesc(**light)))

    def set_camera(self, **camera: Any) -> None:
        self._call("set_camera", byref(abi.Camera(**camera)))

    def set_settings(self, **settings: Any) -> None:
        self._call("set_settings", byref(abi.Settings(**settings)))

    def set_effects(self, **effects: Any) -> None:
        self._call("set_effects", byref(abi.Effects(**effects)))

    def set_lines(self, **lines: Any) -> None:
        self._call("set_lines", byref(abi.Lines(**lines)))


class Frame(_Handle):
    """Renders scenes on a device and keeps the planes; closes before its device."""

    _kind = "frame"

    def __init__(self, device: Device) -> None:
        super().__init__(device._handle, blame=(device._handle,))
        self._device = device

    def render(self, scene: Scene) -> None:
        if not self._finalizer.alive:
            raise PatinaError("this frame is closed")
        check(library().patina_frame_render(self._handle, scene._handle), self._handle, scene._handle,
               self._device._handle)

    def start(self, scene: Scene, planes: Sequence[str], height: int, width: int,
              spare: Sequence[np.ndarray] = (), refine_ms: float | None = None) -> Task:
        """A task that renders, and gives these planes of the picture as read() would. Its size: of the scene's region.
        spare: what start() gave for another picture of these planes and is no longer needed; where it fits it is written
        again, for fresh memory costs more than what is written to it. refine_ms: as refine(), in place of rendering."""
        shapes = [(height, width, PLANES[plane][1]) for plane in planes]
        fits = [values.shape for values in spare] == shapes
        pixels = list(spare) if fits else [np.empty(shape, np.float32) for shape in shapes]
        reads = (abi.Read * len(pixels))(*(abi.Read(PLANES[plane][0], values.ctypes.data, values.nbytes)
                                        for plane, values in zip(planes, pixels, strict=True)))
        call, *how = ("render",) if refine_ms is None else ("refine", refine_ms)
        return Task(call, self._handle, scene._handle, *how, reads, len(reads),
                    keep=(self, self._device, scene, reads, pixels), finish=lambda task: pixels)

    def plan(self, scene: Scene) -> None:
        """Plans the picture without drawing it: clouds know then which pages it would want."""
        library().patina_frame_plan_text(self._handle, scene._handle, None, 0)

    def refine(self, scene: Scene, ms: float) -> None:
        """Betters the picture by samples of the same scene until so many milliseconds have passed, for as long as stats() say
        that some are pending. PatinaCancelled keeps those that there are."""
        if not self._finalizer.alive:
            raise PatinaError("this frame is closed")
        check(library().patina_frame_refine(self._handle, scene._handle, ms), self._handle, scene._handle, self._device._handle)

    def bake_shadows(self, scene: Scene) -> None:
        """Whole shadow textures of the scene's casting lights, without a picture."""
        self._call("bake_shadows", scene._handle)

    def save_shadows(self, path: str) -> None:
        self._call("save_shadows", os.fsencode(path))

    def load_shadows(self, scene: Scene, path: str) -> None:
        """Raises PatinaError with the reason when the file is damaged, stale, or of another scene."""
        self._call("load_shadows", scene._handle, os.fsencode(path))

    def shadows(self, instance: int, light: int, count: int) -> np.ndarray:
        """The share of a casting light that arrives at each of the instance's `count` points, float32."""
        values = np.empty(count, np.float32)
        self._call("read_shadows", instance, light, values.ctypes.data, values.nbytes)
        return values

    def cancel(self) -> None:
        library().patina_frame_cancel(self._handle)

    def progress(self) -> float:
        return library().patina_frame_progress(self._handle)

    def read(self, plane: str) -> np.ndarray:
        """A plane of the last picture or of one of its layers, (height, width, channels) float32, row 0 at the
        bottom."""
        name, layer = split_plane(plane)
        number, channels = PLANES[name]
        stats = self.stats()
        pixels = np.empty((stats["height"], stats["width"], channels), np.float32)
        if layer:
            self._call("read_layer", layer, number, pixels.ctypes.data, pixels.nbytes)
        else:
            self._call("read", number, pixels.ctypes.data, pixels.nbytes)
        return pixels

    def read_keys(self) -> np.ndarray:
        """What each pixel shows, (height, width, 1) uint64: float bits of z << 32 | id."""
        stats = self.stats()
        keys = np.empty((stats["height"], stats["width"], 1), np.uint64)
        self._call("read_keys", keys.ctypes.data, keys.nbytes)
        return keys

    def read_numbers(self) -> np.ndarray:
        """The number of what each pixel shows, (height, width, 1) uint64, in scenes of any size; 2**64 - 1: nothing."""
        stats = self.stats()
        numbers = np.empty((stats["height"], stats["width"], 1), np.uint64)
        self._call("read_numbers", numbers.ctypes.data, numbers.nbytes)
        return numbers

    def stats(self) -> dict[str, Any]:
        stats = abi.FrameStats()
        self._call("get_stats", byref(stats))
        values = {name: getattr(stats, name) for name, _ in abi.FrameStats._fields_[1:]}
        _losses[0] += values["points_lost"] > 0
        values["expected"] = {name: getattr(stats.expected, name) for name, _ in abi.ExpectedError._fields_}
        return values

    def measure(self, each: bool = True) -> None:
        """From the next render on a GPU times each pass by itself; at first it times most passes together, which takes fewer calls."""
        self._call("measure", int(each))

    def pass_stats(self) -> dict[str, Any]:
        """Milliseconds by pass, and why each other pass was left out."""
        size = library().patina_frame_stats_json(self._handle, None, 0) + 1
        buffer = ctypes.create_string_buffer(size)
        library().patina_frame_stats_json(self._handle, buffer, size)
        return json.loads(buffer.value or b"{}")


class Panorama:
    """An equirectangular picture; keyword arguments are the fields of patina_panorama."""

    FACES = 6

    def __init__(self, **fields: Any) -> None:
        self._panorama = abi.Panorama(**fields)
        x0, y0, x1, y1 = self._panorama.region
        self._size = (y1 - y0, x1 - x0)

    def camera(self, face: int) -> tuple[dict[str, Any], int]:
        """The fields of a face's camera, and the pixels of its side."""
        camera, side = abi.Camera(), c_uint32()
        check(library().patina_panorama_camera(byref(self._panorama), face, byref(camera), byref(side)))
        values = {name: getattr(camera, name) for name, _ in abi.Camera._fields_[1:]}
        return values | {"world_from_camera": tuple(camera.world_from_camera)}, side.value

    def join(self, plane: str, faces: list[np.ndarray]) -> np.ndarray:
        """The region's plane from those of the six faces, (height, width, channels)."""
        name, _ = split_plane(plane)
        pixels = np.empty((*self._size, faces[0].shape[2]), faces[0].dtype)
        pointers = (c_void_p * 6)(*(face.ctypes.data for face in faces))
        if name in ("KEYS", "NUMBERS"):
            check(library().patina_panorama_join_keys(byref(self._panorama), pointers, pixels.ctypes.data, pixels.nbytes))
        else:
            check(library().patina_panorama_join(byref(self._panorama), PLANES[name][0], pointers, pixels.ctypes.data,
                                                  pixels.nbytes))
        return pixels


from . import points  # noqa: E402  which builds on these
