# SPDX-License-Identifier: GPL-3.0-or-later
"""Gaussian splats that Blender holds (a kind of PointCloud from 5.3 on) as discs, as native/io/ply_splats.c makes them of files.

Blender's importers of PLY, SPZ and USD all write the same attributes (source/blender/io/gsplat): "scale", a vector as it is; "rotation", a
quaternion, its real part first; "radiance:base", four numbers, the spherical harmonics' constant term and the opacity from 0 to 1;
"radiance:sh_K", the terms that turn with the view, which discs do not. Where these lack, for somebody's nodes made the splats, the names
that files have are tried, as logarithms and logits, then others that are usual.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from . import attributes

HARMONIC = 0.28209479177387814  # Y00, sqrt(1 / (4 pi))

RADIANCE = "radiance:base"
SCALES, TURNS, OPACITIES = ("scale", "scales"), ("rotation", "orientation", "rot"), ("opacity", "alpha")
BASES = ("f_dc", "sh_dc", "sh_0", "sh0")


@dataclass(frozen=True)
class Discs:
    """Of each splat; None where its attributes do not say it."""

    normals: np.ndarray | None  # (n, 3) float32
    colors: np.ndarray | None  # (n, 3) uint8 sRGB
    opacities: np.ndarray | None  # (n, 1) float32
    radii: np.ndarray | None  # (n, 1) float32


def are(data: bpy.types.ID) -> bool:
    return isinstance(data, bpy.types.PointCloud) and getattr(data, "type", "") == 'GAUSSIAN_SPLAT'


def read(name: str, data: bpy.types.ID, count: int, notices: list[str]) -> Discs:
    radiance = _own(data, count, (RADIANCE,), 4)
    scales = _own(data, count, SCALES, 3)
    logarithms = _of_file(data, count, "scale", 3) if scales is None else None
    scales = scales if logarithms is None else np.exp(logarithms)
    turns = _own(data, count, TURNS, 4)
    turns = _of_file(data, count, "rot", 4) if turns is None else turns
    if radiance is not None:
        base, opacities = radiance[:, :3], radiance[:, 3:]
    else:
        base = _of_file(data, count, "f_dc", 3)
        base = _own(data, count, BASES, 3) if base is None else base
        opacities = _own(data, count, OPACITIES, 1)
        if opacities is not None and logarithms is not None:  # as in files: a logit
            opacities = 1 / (1 + np.exp(-opacities))
    colors = None if base is None else np.clip(np.rint(255 * (0.5 + HARMONIC * base)), 0, 255).astype(np.uint8)
    missing = [f"{what} ({attribute})" for what, attribute, found in
               (("size", SCALES[0], scales), ("rotation", TURNS[0], turns), ("color", RADIANCE, base), ("opacity", RADIANCE, opacities))
               if found is None]
    shown = "plain points" if scales is None else "discs of even color"
    notices.append(f"'{name}' holds Gaussian splats: they are drawn as {shown}" +
                   (f"; no attribute tells their {', '.join(missing)}" if missing else ""))
    return Discs(None if scales is None or turns is None else normals_of(scales, turns), colors,
                 None if opacities is None else opacities.astype(np.float32), None if scales is None else radii_of(scales))


def normals_of(scales: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """(n, 3) float32: the axis of the least scale. turns: (n, 4), real part first; 0 0 0 of a quaternion that is none."""
    w, x, y, z = turns.astype(np.float64).T
    axes = np.array([[w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)],
                     [2 * (x * y - w * z), w * w - x * x + y * y - z * z, 2 * (y * z + w * x)],
                     [2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z]])  # axis, component, splat
    square = (turns.astype(np.float64) ** 2).sum(1)
    least = np.argmin(scales, axis=1)
    chosen = axes[least, :, np.arange(len(scales))]
    return np.divide(chosen, square[:, None], out=np.zeros_like(chosen), where=square[:, None] > 0).astype(np.float32)


def radii_of(scales: np.ndarray) -> np.ndarray:
    """(n, 1) float32: the disc has the area that the Gaussian weighs in the plane of its two greater axes."""
    greater = np.sort(scales.astype(np.float64), axis=1)[:, 1:]
    return np.sqrt(2 * greater.prod(axis=1, keepdims=True)).astype(np.float32)


def _of_file(data: bpy.types.ID, count: int, name: str, width: int) -> np.ndarray | None:
    """(count, width) float64 of attributes name_0, name_1, ..."""
    columns = [attributes.numbers(data, count, f"{name}_{k}", 1) for k in range(width)]
    return None if any(column is None for column in columns) else np.concatenate(columns, axis=1).astype(np.float64)


def _own(data: bpy.types.ID, count: int, names: tuple[str, ...], width: int) -> np.ndarray | None:
    found = (attributes.numbers(data, count, name, width) for name in names)
    return next((values.astype(np.float64) for values in found if values is not None), None)
