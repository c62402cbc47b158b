# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendering scenes to arrays."""

from __future__ import annotations

import functools
import operator
import threading
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import _native
from .scenes import Scene

PASSES = tuple(name.lower() for name in _native.PLANES if name != "COMBINED")


@dataclass(frozen=True)
class Render:
    """Passes of one image. Row 0 is the top row.

    image: (height, width, 4) float32: linear, premultiplied RGB and alpha.
    passes: name → (height, width) float32, of "normal" (height, width, 3).
    stats: of the render, such as "ms" and "points".
    """

    image: np.ndarray
    passes: dict[str, np.ndarray]
    stats: dict[str, Any] = field(repr=False)

    @property
    def depth(self) -> np.ndarray:
        """(height, width) float32: distance to the camera's plane, world units; +inf where nothing is."""
        return self._pass("depth")

    @property
    def normal(self) -> np.ndarray:
        """(height, width, 3) float32: unit normal, world; 0 0 0 where nothing is."""
        return self._pass("normal")

    def _pass(self, name: str) -> np.ndarray:
        if name not in self.passes:
            raise KeyError(f"the pass {name} was not rendered: render(..., passes=[..., {name!r}])")
        return self.passes[name]


class Renderer:
    """A device and what it keeps from image to image. `render` uses one for each device; make your own for a thread of your own.

    device: "auto" (a graphics card with OpenGL 4.3, else the processor), "cpu", "gl-egl", or a level of the processor such as "cpu-avx2". A
    device that is missing raises `Error`. threads: of the processor; 0: one per core.
    """

    def __init__(self, device: str = "auto", threads: int = 0) -> None:
        self._device = _native.Device(device, threads)
        self._frame = _native.Frame(self._device)
        self._lock = threading.Lock()  # a frame renders one image at a time

    @property
    def device(self) -> str:
        """Its name, such as "cpu-avx512"."""
        return self._device.name

    def render(self, scene: Scene, width: int = 1024, height: int = 1024, *, passes: Sequence[str] = ("depth", "normal"),
               samples: int = 1) -> Render:
        """As the function `render`. Any thread."""
        unknown = [name for name in passes if name not in PASSES]
        if unknown:
            raise ValueError(f"there is no pass {unknown[0]!r}; the passes are {', '.join(PASSES)}")
        width, height, samples = (operator.index(value) for value in (width, height, samples))
        if not (0 < width <= 65536 and 0 < height <= 65536):
            raise ValueError(f"the size is {width} x {height}; 1 to 65536 pixels are needed")
        prepared, nearest = scene._native_scene(width, height, passes, samples)
        with self._lock, prepared:
            self._frame.render(prepared)
            planes = {name: self._frame.read(name.upper())[::-1] for name in ("combined", *passes)}
            stats = self._frame.stats()
        planes = {name: np.ascontiguousarray(plane[..., 0] if plane.shape[2] == 1 else plane) for name, plane in planes.items()}
        if "depth" in planes:
            planes["depth"] += np.float32(nearest)
        return Render(planes.pop("combined"), planes, stats)

    def close(self) -> None:
        """Frees the device."""
        self._frame.close()
        self._device.close()


@functools.lru_cache(maxsize=4)
def _renderer(device: str, threads: int) -> Renderer:
    return Renderer(device, threads)


def render(scene: Scene, width: int = 1024, height: int = 1024, *, passes: Sequence[str] = ("depth", "normal"), samples: int = 1,
           device: str = "auto", threads: int = 0) -> Render:
    """Renders a scene. The same arguments give the same bytes on each run, for any number of threads.

    width, height: pixels. passes: beside the image: "depth", "normal", "source", "shadow", "line", "trust", "thickness", "density",
    "disagreement"; patina.h says what they contain. samples: per pixel, 1 to 4096. device, threads: as of `Renderer`.
    """
    return _renderer(device, threads).render(scene, width, height, passes=passes, samples=samples)
