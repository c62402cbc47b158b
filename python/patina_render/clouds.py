# SPDX-License-Identifier: GPL-3.0-or-later
"""Clouds of points."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from . import _native

KINDS = tuple(name.lower() for name in _native.KINDS)  # what the numbers of analysis()["kind"] mean


def rows(name: str, values: ArrayLike | None, count: int, widths: tuple[int, ...], kinds: tuple[str, ...]) -> np.ndarray | None:
    """values as a contiguous array (count, width) of one of the types; others are converted to the last one. width 1: also (count,)."""
    if values is None:
        return None
    array = np.asarray(values)
    shape = " or ".join(f"({count}, {width})" for width in widths) + (f" or ({count},)" if 1 in widths else "")
    if array.ndim == 1 and 1 in widths:
        array = array[:, None]
    if array.ndim != 2 or len(array) != count or array.shape[1] not in widths:
        raise ValueError(f"{name} has the shape {np.shape(values)}; {shape} is needed")
    if array.dtype.kind not in "fiub":
        raise ValueError(f"{name} has the type {array.dtype}; numbers are needed")
    return np.ascontiguousarray(array, array.dtype if array.dtype.name in kinds else kinds[-1])


class Cloud:
    """Points with attributes. The arrays are copied.

    positions: (n, 3), world units; float32, or any other type as float64, which keeps the digits of map coordinates. Points with NaN or infinite coordinates are not drawn.
    colors: (n, 3) or (n, 4): uint8 or uint16 in sRGB, or floats, linear, 0 to 1. A fourth component is ignored.
    normals: (n, 3) of any length; 0 0 0: unknown.
    opacities: (n,), 0 to 1.
    radii: (n,), world units, of the points' discs.
    scalars: (n,), numbers that a ramp colors: `Scene.add`, color_by="scalar".
    classes: (n,) uint8, as in LAS.
    """

    def __init__(self, positions: ArrayLike, colors: ArrayLike | None = None, normals: ArrayLike | None = None, *,
                 opacities: ArrayLike | None = None, radii: ArrayLike | None = None, scalars: ArrayLike | None = None,
                 classes: ArrayLike | None = None) -> None:
        given = np.asarray(positions)
        count = len(given) if given.ndim else 0
        floats = ("float32", "float64")
        places = rows("positions", given, count, (3,), floats)
        self._cloud = _native.Cloud(places, rows("normals", normals, count, (3,), floats), _colors(colors, count), None, 0,
                                    rows("opacities", opacities, count, (1,), floats), (0.0,) * 3,
                                    rows("radii", radii, count, (1,), floats), rows("scalars", scalars, count, (1,), floats),
                                    _classes(classes, count))

    @classmethod
    def read(cls, path: str | os.PathLike) -> Cloud:
        """Reads PLY, XYZ, CSV, PTS, PTX or Stanford's .conf; maps a saved cloud (.cloud). Raises `Error` if the file is missing or damaged."""
        cloud = cls.__new__(cls)
        path = Path(path)
        cloud._cloud = _native.Cloud.open(path) if path.suffix == ".cloud" else _native.Cloud.load(path)
        return cloud

    def save(self, path: str | os.PathLike, overwrite: bool = False) -> None:
        """Writes the cloud with its analysis to a file that `read` maps: NAME.cloud. Raises FileExistsError unless overwrite is set."""
        path = Path(path)
        if path.suffix != ".cloud":
            raise ValueError(f"{path}: the name of a saved cloud ends in .cloud")
        if path.exists() and not overwrite:
            raise FileExistsError(f"{path} exists. Pass overwrite=True to replace it")
        self._cloud.start_save(path).result()

    def analyze(self, neighbors: int = 0, *, keep_normals: bool = True, stations: ArrayLike | None = None,
                station: ArrayLike | None = None, threads: int = 0) -> None:
        """Computes normal, footprint, thickness, kind and trust of each point. Renders then close no gap that no point reaches, and leave out
        points that are probably wrong.

        neighbors: 3 to 64; 0: 16, and 48 where these leave doubts. keep_normals: estimates only missing normals.
        stations: (k, 3), positions of the scanner, world units; normals face them. station: (n,), the number of each point's station;
        without it, the nearest one counts. threads: 0: one per core.
        """
        places = None if stations is None else rows("stations", stations, len(stations), (3,), ("float64",))
        self._cloud.analyse(neighbours=neighbors, keep_normals=keep_normals, stations=places, threads=threads,
                            station=rows("station", station, self.count, (1,), ("uint8", "uint16")))

    def analysis(self) -> dict[str, np.ndarray]:
        """What `analyze` found, in the order of the points: "normal" (n, 3) float32, 0 0 0: none; "spacing" (n,) float32, world units;
        "half_axes" (n, 2) float32, of the footprint, world units; "sigma" (n,) float32, thickness, world units, 0: unknown; "kind" (n,)
        uint8, see KINDS; "trust" (n,) float32, 0 to 1, the probability that the point is right."""
        return self._cloud.neighbourhoods("normal", "spacing", "half_axes", "sigma", "kind", "trust")

    @property
    def count(self) -> int:
        """Points as given."""
        return self._cloud.count

    @property
    def drawn(self) -> int:
        """Points with finite positions and an opacity above 0."""
        return self._cloud.drawn

    @property
    def box(self) -> np.ndarray:
        """(2, 3) float64: least and greatest corner, world units."""
        return np.array(self._cloud.box)

    @property
    def has_colors(self) -> bool:
        return self._cloud.has_colors

    @property
    def has_normals(self) -> bool:
        return self._cloud.has_normals

    @property
    def is_analyzed(self) -> bool:
        return self._cloud.has_shapes

    def __len__(self) -> int:
        return self.count

    def __repr__(self) -> str:
        return f"Cloud({self.count} points{', colors' * self.has_colors}{', normals' * self.has_normals}{', analyzed' * self.is_analyzed})"


def _colors(colors: ArrayLike | None, count: int) -> np.ndarray | None:
    """Integers stay bytes or words, everything else becomes float32."""
    if colors is not None and np.asarray(colors).dtype.kind in "iu" and np.asarray(colors).dtype.name not in ("uint8", "uint16"):
        raise ValueError(f"colors has the type {np.asarray(colors).dtype}; uint8, uint16 or floats are needed")
    return rows("colors", colors, count, (3, 4), ("uint8", "uint16", "float32"))


def _classes(classes: Sequence[int] | ArrayLike | None, count: int) -> np.ndarray | None:
    if classes is None:
        return None
    values = np.asarray(classes)
    if values.dtype.kind not in "iu" or values.size and not 0 <= values.min() <= values.max() <= 255:
        raise ValueError("classes are integers from 0 to 255")
    return rows("classes", values, count, (1,), ("uint8",))
