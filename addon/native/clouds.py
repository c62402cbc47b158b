# SPDX-License-Identifier: GPL-3.0-or-later
"""Clouds, meshes and textures: what scenes are made of."""

from __future__ import annotations

import ctypes
import os
import threading
from collections.abc import Sequence
from ctypes import byref, c_double, c_float, c_uint32, c_uint64
from pathlib import Path
from typing import Any

import numpy as np

from . import abi
from .arrays import describe, view
from .handles import Handle, Progress, Task, handle_of, losses
from .loader import NEIGHBOURHOODS, TYPES

KINDS = tuple(abi.KIND)  # patina_kind
WRAPS = tuple(abi.WRAP)  # patina_wrap
NO_PAGE = 2 ** 32 - 1  # PATINA_NO_PAGE


def _room_for(most: int) -> list[np.ndarray]:
    """Arrays of so many positions, colors, normals and scalars, NaN all of them."""
    return [*(np.full((most, 3), np.nan, np.float32) for _ in range(3)), np.full(most, np.nan, np.float32)]


class Cloud(Handle):
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

    def __new__(cls, *_: Any, **__: Any) -> Cloud:
        cloud = super().__new__(cls)
        cloud._turn = threading.RLock()  # the library takes one call at a time of a cloud; an analysis may be applied on another thread
        return cloud

    def __init__(self, positions: np.ndarray, normals: np.ndarray | None = None, colors: np.ndarray | None = None,
                 progress: Progress | None = None, threads: int = 0, opacities: np.ndarray | None = None,
                 origin: tuple[float, ...] = (0.0,) * 3, radii: np.ndarray | None = None,
                 scalars: np.ndarray | None = None, classes: np.ndarray | None = None) -> None:
        super().__init__(byref(describe(positions, normals, colors, opacities, radii, scalars, classes, threads, origin)),
                         handle_of(progress))
        self._learn()

    @classmethod
    def start(cls, positions: np.ndarray, normals: np.ndarray | None, colors: np.ndarray | None,
              opacities: np.ndarray | None, progress: Progress | None = None, radii: np.ndarray | None = None,
              scalars: np.ndarray | None = None, classes: np.ndarray | None = None,
              origin: tuple[float, ...] = (0.0,) * 3) -> Task:
        """A task that gives the cloud."""
        def take(task: Task) -> Cloud:
            cloud = cls.__new__(cls)
            Handle.__init__(cloud, task._handle, blame=(task._handle,), create="patina_task_take_cloud")
            cloud._learn()
            return cloud

        arrays = (positions, normals, colors, opacities, radii, scalars, classes)
        return Task("build", byref(describe(*arrays, origin=origin)), handle_of(progress), keep=(arrays, progress),
                    finish=take)

    @classmethod
    def open(cls, path: Path, offset: Sequence[float] = (0.0, 0.0, 0.0)) -> Cloud:
        """A saved cloud, mapped; offset: added to every position, float64. PatinaError when it is not one of this version."""
        cloud = cls.__new__(cls)
        Handle.__init__(cloud, os.fsencode(path), (c_double * 3)(*offset), create="patina_cloud_open_at")
        cloud.losses = losses()
        cloud._learn()
        return cloud

    @classmethod
    def load(cls, path: Path, progress: Progress | None = None) -> Cloud:
        """A cloud of the points of a file that the library reads (PLY, XYZ, CSV, PTS, PTX, .conf), with their normals, colors and classes."""
        cloud = cls.__new__(cls)
        Handle.__init__(cloud, os.fsencode(path), handle_of(progress), create="patina_cloud_load")
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
        Handle.__init__(cloud, byref(abi.PagesDesc(
            pages=ctypes.addressof(pages), page_count=len(gaps), color_type=TYPES.get(color_type, 0), has_scalars=scalars,
            has_classes=classes, box_min=tuple(box[0]), box_max=tuple(box[1]), memory_cap=memory_cap)), create="patina_cloud_pages_begin")
        cloud._learn()
        return cloud

    def start_page(self, page: int, positions: np.ndarray, colors: np.ndarray | None, scalars: np.ndarray | None,
                   classes: np.ndarray | None) -> Task:
        """A task that hands a page's points in; its result() raises PatinaError where they are not what was promised. At any time."""
        arrays = (positions, None, colors, None, None, scalars, classes)
        return Task("give_page", self._handle, page, byref(describe(*arrays)), keep=(self, arrays))

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
    def start_thinning(path: Path, offset: Sequence[float], most: int, hidden: np.ndarray | None = None) -> Task:
        """A task that opens a saved cloud, and gives up to so many of its points, evenly chosen: positions (n, 3), linear colors (n, 3),
        normals (n, 3) and scalars (n,), all float32, NaN where the cloud has none. offset: added to every position, float64. hidden: bits
        of points that are left out, uint8."""
        arrays, count = _room_for(most), c_uint64()
        bits = () if hidden is None else (np.ascontiguousarray(hidden, np.uint8),)
        return Task("thin", os.fsencode(path), (c_double * 3)(*offset), *([bits[0].ctypes.data, len(bits[0])] if bits else [None, 0]), most,
                    *(values.ctypes.data for values in arrays), byref(count), keep=(arrays, count, bits),
                    finish=lambda task: tuple(values[:count.value] for values in arrays))

    def thinned(self, most: int) -> tuple[np.ndarray, ...]:
        """The same of this cloud, at once; of one in pages those that arrived."""
        arrays, count = _room_for(most), c_uint64()
        self._call("thin", None, 0, most, *(values.ctypes.data for values in arrays), byref(count))
        return tuple(values[:count.value] for values in arrays)

    def places(self, most: int, hidden: np.ndarray | None = None) -> np.ndarray:
        """(n, 3) float32: positions of up to so many points, without those whose bits are set in hidden."""
        found, count = np.empty((most, 3), np.float32), c_uint64()
        bits = None if hidden is None else np.ascontiguousarray(hidden, np.uint8)
        self._call("thin", *((None, 0) if bits is None else (bits.ctypes.data, len(bits))), most, found.ctypes.data, None, None, None, byref(count))
        return found[:count.value]

    @staticmethod
    def start_verifying(path: Path, progress: Progress | None = None) -> Task:
        """A task that reads a saved cloud whole; its result() raises PatinaError where it is damaged."""
        return Task("verify", os.fsencode(path), handle_of(progress), keep=(progress,))

    def start_save(self, path: Path) -> Task:
        """A task that writes the cloud."""
        return Task("save", self._handle, os.fsencode(path), keep=(self,))

    def _call(self, name: str, *arguments: Any) -> None:
        with self._turn:
            super()._call(name, *arguments)

    def _learn(self) -> None:
        info = abi.CloudInfo()
        self._call("get_info", byref(info))
        vars(self).update(_told(info))  # all at once: other threads read them

    def start_colors(self, colors: np.ndarray | None) -> Task:
        """Other colours for the same points; no picture of them may be drawn meanwhile."""
        return Task("set_colors", self._handle, byref(view(colors, self.count)), keep=(self, colors))

    def describe_analysis(self, neighbours: int = 0, stations: np.ndarray | None = None, station: np.ndarray | None = None,
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
                             stations=stations.ctypes.data if count else None, station=view(station, self.count),
                             free_space=free_space, row=view(row, self.count), column=view(column, self.count), grid=by_grid,
                             scan=view(scan, self.count), direction_count=ways,
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
        described, _kept = self.describe_analysis(**given)
        self._call("analyse", byref(described), handle_of(progress))
        self._learn()

    def start_analysis(self, progress: Progress | None = None, **given: Any) -> Task:
        """analyse, beside pictures: its result() changes the cloud, and no picture of it may be drawn then."""
        def apply(task: Task) -> None:
            with self._turn:  # no other call of this cloud meets it, and none sees what is not learned yet
                task._call("apply")
                self._learn()

        described, kept = self.describe_analysis(**given)
        return Task("analyse", self._handle, byref(described), handle_of(progress), keep=(*kept, progress), finish=apply)

    def neighbourhoods(self, *names: str, neighbours: int = 16, progress: Progress | None = None,
                       threads: int = 0) -> dict[str, np.ndarray]:
        """Arrays by name: those of NEIGHBOURHOODS that are named, else all that need no walk to neighbours."""
        arrays = {}
        for name in names or list(NEIGHBOURHOODS)[:8]:
            kind, width = NEIGHBOURHOODS[name]
            arrays[name] = np.empty((self.count, neighbours if width < 0 else width) if width else self.count, kind)
        self._call("neighbourhoods", byref(abi.Neighbourhoods(neighbours=neighbours, threads=threads,
                                                           **{name: a.ctypes.data for name, a in arrays.items()})),
                   handle_of(progress))
        return arrays

    def set_scalars(self, scalars: np.ndarray | None) -> None:
        """Other scalars for the same points; as start_colors."""
        self._call("set_scalars", byref(view(scalars, self.count)))
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


def _told(info: abi.CloudInfo) -> dict[str, Any]:
    """What a cloud tells of itself, by attribute."""
    return {
        "count": info.count, "drawn": info.drawn, "bytes": info.bytes,
        "footprint": max(info.bytes, 23 * info.count),  # with what of a mapped file may be in memory
        "invalid_positions": info.invalid_positions,
        "has_normals": bool(info.has_normals),
        "has_colors": bool(info.has_colors),
        "class_bits": tuple(info.class_bits),  # classes that drawn points have
        "has_scalars": bool(info.has_scalars),
        "has_classes": bool(info.has_classes),
        "has_opacities": bool(info.has_opacities),
        "has_shapes": bool(info.has_shapes),  # analysed
        "normals_oriented": bool(info.normals_oriented),
        "kinds": tuple(info.kinds),  # points of each of KINDS
        "trusts": tuple(info.trusts),  # drawn points of each level of trust; see sync/analyses/trust.py
        "trust_default": info.trust_default,  # least trust of points that are drawn by default
        "seen_through": info.seen_through,  # points that a station saw through
        "uncolored": info.uncolored,  # points with a color that their neighbors lent
        "spacing": info.spacing,  # median, object units
        "layer_distance": info.layer_distance,  # what d_min = 0 stands for at the median spacing, object units
        "box": (tuple(info.box_min), tuple(info.box_max)),
        "radius_most": info.radius_most,  # of points' own radii, object units; 0: they have none
    }


class Mesh(Handle):
    """Triangles, three corners each: positions (3 n, 3), normals (3 n, 3) or None, linear colors (3 n, 3|4) or None, where each
    lies on an image (3 n, 2) or None, all float32."""

    _kind = "mesh"

    def __init__(self, positions: np.ndarray, normals: np.ndarray | None, colors: np.ndarray | None,
                 uv: np.ndarray | None = None) -> None:
        corners = len(positions)
        super().__init__(byref(abi.MeshDesc(vertex_count=corners, position=view(positions, corners),
                                         normal=view(normals, corners), color=view(colors, corners),
                                         triangle_count=corners // 3, uv=view(uv, corners))))
        self.count = corners // 3
        self.bare: Mesh | None = None  # the same without colors, where somebody asked for it


class Texture(Handle):
    """An image for meshes: pixels (height, width, 4), uint8 or float32, rows from the bottom, opacity last. raw: bytes are linear,
    not sRGB. wrap: of WRAPS."""

    _kind = "texture"

    def __init__(self, pixels: np.ndarray, raw: bool, nearest: bool, wrap: str) -> None:
        height, width = pixels.shape[:2]
        super().__init__(byref(abi.TextureDesc(width=width, height=height, pixels=view(pixels.reshape(-1, 4), height * width),
                                            raw=raw, nearest=nearest, wrap=WRAPS.index(wrap))))
