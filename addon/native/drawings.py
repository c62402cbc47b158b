# SPDX-License-Identifier: GPL-3.0-or-later
"""Survey drawings: lines of clouds on a plane, to scale."""

from __future__ import annotations

import os
from collections.abc import Sequence
from ctypes import byref, c_double, c_void_p
from pathlib import Path

import numpy as np

from . import abi
from .clouds import Cloud
from .handles import Handle, Progress, handle_of


class Drawing(Handle):
    """A plane with an extent; arguments are as patina_drawing_desc has them, in meters."""

    _kind = "drawing"

    def __init__(self, origin: Sequence[float], right: Sequence[float], up: Sequence[float], extent: tuple[float, float], front: float, back: float,
                 scale: float) -> None:
        super().__init__(byref(abi.DrawingDesc(origin=tuple(origin), right=tuple(right), up=tuple(up), extent=extent, front=front, back=back, scale=scale)))

    def cut(self, clouds: Sequence[Cloud], places: np.ndarray, shown: Sequence[np.ndarray], thickness: float = 0.0,
            progress: Progress | None = None) -> None:
        """Traces cut lines. places: (clouds, 4, 4) float64, from each cloud to the drawing's world; shown: the bits of each cloud's points to use,
        as points.pick gives them. PatinaError, also if the plane meets no points."""
        count, table = len(clouds), np.ascontiguousarray(places, np.float64)
        handles = (c_void_p * max(count, 1))(*(cloud._handle for cloud in clouds))
        bits = (c_void_p * max(count, 1))(*(plane.ctypes.data for plane in shown))
        desc = abi.CutDesc(thickness=thickness, places=table.ctypes.data, shown=bits)
        self._call("cut", handles, count, byref(desc), handle_of(progress))

    def info(self) -> dict[str, float]:
        """The numbers of patina_drawing_info, and the lengths of layers as "cut" and "bridged"."""
        info = abi.DrawingInfo()
        self._call("get_info", byref(info))
        return {name: getattr(info, name) for name in ("lines", "samples", "untrusted", "spacing", "sigma", "thickness")} | {
            "cut": info.layer_lengths[0], "bridged": info.layer_lengths[1]}

    def lines(self) -> list[tuple[str, bool, np.ndarray]]:
        """The layer of each line, whether it is closed, and its vertices, (n, 2) float64: right and up from the middle of the extent, in meters."""
        names = {number: name.lower().replace("_", "-") for name, number in abi.DRAWING_LAYER.items()}
        found = []
        for index in range(int(self.info()["lines"])):
            line = abi.DrawingLine()
            self._call("get_line", index, byref(line))
            places = (c_double * (2 * line.vertices))()
            self._call("read_line", index, places, 16 * line.vertices)
            found.append((names[line.layer], bool(line.closed), np.array(places).reshape(-1, 2)))
        return found

    def write(self, path: Path, flat: bool = False) -> None:
        """As DXF or SVG, by the path's ending."""
        self._call("write", os.fsencode(path), int(flat))
