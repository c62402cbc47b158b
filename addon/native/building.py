# SPDX-License-Identifier: GPL-3.0-or-later
"""Saved clouds of more points than memory holds: built on the disk, from pieces, and analyzed there."""

from __future__ import annotations

import os
import weakref
from ctypes import byref, c_double
from pathlib import Path
from typing import Any

import numpy as np

from . import abi
from .arrays import describe
from .clouds import Cloud
from .handles import Handle, Progress, Task, handle_of
from .loader import PatinaError

Corner = tuple[float, float, float]


class Builder(Handle):
    """Writes a file that Cloud.open maps. memory: bytes that it takes at most, 0: a third of what is free; count and box of all points,
    as far as known. narrow: what add() says of it; zeros: whether what is zero everywhere stays. Nothing of it is left where it is closed before its end.
    Pieces are sorted while the caller reads the next one."""

    _kind = "builder"

    def __init__(self, path: Path, memory: int = 0, count: int = 0, box: tuple[Corner, Corner] | None = None, threads: int = 0,
                 narrow: bool = True, zeros: bool = False) -> None:
        lower, upper = box or ((0.0,) * 3, (0.0,) * 3)
        self._desc = abi.BuilderDesc(memory=memory, count=count, box_min=(c_double * 3)(*lower), box_max=(c_double * 3)(*upper),
                                     threads=threads, narrow_colors=(2 if zeros else 1) if narrow else 0)
        super().__init__(os.fsencode(path), byref(self._desc), create="patina_builder_begin")
        self._adding: list[Task] = []  # one at the most
        self._failed: PatinaError | None = None  # what kept a piece out: without it the file is none
        weakref.finalize(self, _settle, self._adding)  # before the builder goes

    def close(self) -> None:
        _settle(self._adding)
        super().close()

    def add(self, positions: np.ndarray, normals: np.ndarray | None = None, colors: np.ndarray | None = None,
            opacities: np.ndarray | None = None, radii: np.ndarray | None = None, scalars: np.ndarray | None = None,
            classes: np.ndarray | None = None, origin: Corner = (0.0,) * 3) -> None:
        """The next points, as Cloud takes them, which stay as they are; what the first piece has, all have. Narrow: colors of 16 bits that 8 hold
        become bytes, and normals, colors, scalars and classes that are zero everywhere are none, unless zeros stay. Raises what kept the piece
        before from being taken, and whatever comes after it, too."""
        arrays = positions, normals, colors, opacities, radii, scalars, classes
        self._wait()
        self._adding.append(Task("add_to_build", self._handle, byref(describe(*arrays, origin=origin)), keep=arrays))

    def _wait(self) -> None:
        if not self._finalizer.alive:
            raise PatinaError("this builder is closed")
        try:
            while self._adding:
                self._adding.pop().result()
        except PatinaError as error:
            self._failed = error
        if self._failed:
            raise self._failed

    def start_end(self, progress: Progress | None = None) -> Task:
        """A task that writes the file: once, and then nothing may be added."""
        self._wait()
        return Task("end_build", self._handle, handle_of(progress), keep=(self, progress))


def _settle(adding: list[Task]) -> None:
    while adding:
        adding.pop().close()


def start_analysis(cloud: Cloud, path: Path, to: Path, memory: int = 0, progress: Progress | None = None, **given: Any) -> Task:
    """A task that writes the saved cloud in path, which cloud maps and which stays, with what an analysis finds, to another file: whole or not at
    all. memory: bytes that it takes at most, 0: a third of what is free. given: as Cloud.analyse."""
    described, kept = cloud.describe_analysis(**given)
    return Task("analyse_file", os.fsencode(path), byref(described), memory, os.fsencode(to), handle_of(progress), keep=(*kept, progress))
