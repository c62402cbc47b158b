# SPDX-License-Identifier: GPL-3.0-or-later
"""What separates a picture of a scan from the exact view. Shares are 0..1."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter

from .exact import Exact

NEAR, SHARE = 0.05, 0.01  # metres, and of z: what is off by more than both is wrong
MEANING = {  # name → what it says; the order of tables
    "false": "of scanned pixels: drawn nearer than the truth by more than 5 cm and 1 % of z",
    "lost": "of scanned pixels: empty, or farther by as much",
    "sky": "of the true sky's pixels: drawn",
    "psnr": "dB, sRGB, scanned pixels (more is better)",
    "ssim": "structural similarity of grey, scanned pixels (1 is best)",
    "thin": "of scanned pixels of bars, wires and leaves: drawn where they are (1 is best)",
    "width": "pixels drawn at the depth of a bar, wire or leaf, over those of them where it is: 1 is best, 2 is twice as wide",
    "outline": "pixels from the truth's edges in depth to the picture's, mean, at most 20",
    "invented": "of pixels whose surface was not scanned: drawn",
    "hiding": "of them, nearer than the truth by more than 5 cm and 1 % of z",
    "flicker": "rms change between two frames 1 cm apart, less the truth's own, sRGB levels of 255, scanned pixels",
    "ceiling": "PSNR of the nearest samples placed on the true surface",
}
FAR = 20.0  # pixels
EDGE = 0.1  # of z: a step in depth that is an outline


def srgb(linear: np.ndarray) -> np.ndarray:
    value = np.clip(linear, 0.0, 1.0)
    return np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1.0 / 2.4) - 0.055).astype(np.float32)


def _share(of: np.ndarray, within: np.ndarray) -> float:
    count = int(within.sum())
    return float((of & within).sum() / count) if count else float("nan")


def psnr(a: np.ndarray, b: np.ndarray, where: np.ndarray) -> float:
    if not where.any():
        return float("nan")
    return float(-10.0 * np.log10(max(float(np.mean(np.square(a[where] - b[where], dtype=np.float64))), 1e-9)))


def ssim(a: np.ndarray, b: np.ndarray, where: np.ndarray) -> float:
    """Wang 2004 on grey (h, w), Gaussian of 1.5 pixels."""
    def mean(x: np.ndarray) -> np.ndarray:
        return gaussian_filter(x, 1.5, truncate=3.3)

    ma, mb = mean(a), mean(b)
    va, vb, both = mean(a * a) - ma * ma, mean(b * b) - mb * mb, mean(a * b) - ma * mb
    c1, c2 = 0.01**2, 0.03**2
    similar = (2 * ma * mb + c1) * (2 * both + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2))
    return float(similar[where].mean()) if where.any() else float("nan")


def edges(depth: np.ndarray) -> np.ndarray:
    """(h, w) bool: where depth steps by more than a tenth, on the nearer side."""
    z = np.where(np.isfinite(depth), depth, 1e6)
    found = np.zeros(z.shape, bool)
    for axis in (0, 1):
        a, b = (z[:-1], z[1:]) if axis == 0 else (z[:, :-1], z[:, 1:])
        near_a, near_b = b > a * (1.0 + EDGE) + NEAR, a > b * (1.0 + EDGE) + NEAR
        found[:-1] |= near_a if axis == 0 else False
        found[1:] |= near_b if axis == 0 else False
        if axis == 1:
            found[:, :-1] |= near_a
            found[:, 1:] |= near_b
    return found


def classes(exact: Exact, depth: np.ndarray) -> dict[str, np.ndarray]:
    """Masks (h, w) of what is wrong. depth: drawn, inf where nothing is."""
    drawn = np.isfinite(depth)
    z = np.where(drawn, depth, 0.0)
    nearer = drawn & (exact.near - z > np.maximum(NEAR, SHARE * exact.near))
    with np.errstate(invalid="ignore"):
        farther = ~drawn & np.isfinite(exact.far)
        farther |= drawn & (z - exact.far > np.maximum(NEAR, SHARE * exact.far))
    solid = np.isfinite(exact.middle)
    return {"false": exact.scanned & nearer, "lost": exact.scanned & farther, "sky": exact.sky & drawn,
            "invented": solid & ~exact.scanned & drawn, "hiding": solid & ~exact.scanned & nearer,
            "thin lost": exact.scanned & exact.thin & (nearer | farther), "nearer": nearer, "farther": farther}


def thin_width(exact: Exact, depth: np.ndarray, wrong: dict[str, np.ndarray]) -> float:
    """Drawn area of thin parts over the area of those that are drawn where they are. A pixel that is false, or sky, belongs to
    the nearest thin part within FAR pixels if it has its depth, within twice what counts as wrong."""
    right = exact.thin & np.isfinite(depth) & ~wrong["nearer"] & ~wrong["farther"]
    if right.mean() < 0.001:
        return float("nan")
    away, (row, column) = distance_transform_edt(~exact.thin, return_indices=True)
    beside = np.isfinite(depth) & ~exact.thin & (away <= FAR) & (wrong["nearer"] | wrong["sky"])
    z, own = depth[beside], exact.near[row[beside], column[beside]]
    swollen = np.abs(z - own) <= 2.0 * np.maximum(NEAR, SHARE * own)
    return float((right.sum() + swollen.sum()) / right.sum())


def measure(exact: Exact, color: np.ndarray, depth: np.ndarray) -> dict[str, float]:
    """color (h, w, 3) linear, over the sky's colour; depth (h, w), inf where nothing is drawn."""
    wrong = classes(exact, depth)
    solid = np.isfinite(exact.middle)
    ours, theirs = srgb(color), srgb(exact.color)
    thin = exact.scanned & exact.thin
    wanted = edges(exact.middle) & exact.scanned
    away = np.minimum(distance_transform_edt(~edges(depth)), FAR) if wanted.any() else np.zeros(1)
    grey = np.array([0.299, 0.587, 0.114], np.float32)
    return {"false": _share(wrong["false"], exact.scanned), "lost": _share(wrong["lost"], exact.scanned),
            "sky": _share(wrong["sky"], exact.sky) if exact.sky.mean() > 0.005 else float("nan"),
            "psnr": psnr(ours, theirs, exact.scanned),
            "ssim": ssim(ours @ grey, theirs @ grey, exact.scanned),
            "thin": 1.0 - _share(wrong["thin lost"], thin) if thin.mean() > 0.001 else float("nan"),
            "width": thin_width(exact, depth, wrong),
            "outline": float(away[wanted].mean()) if wanted.any() else float("nan"),
            "invented": _share(wrong["invented"], solid & ~exact.scanned),
            "hiding": _share(wrong["hiding"], solid & ~exact.scanned),
            "ceiling": psnr(exact.ceiling.astype(np.float32) / 255.0, theirs, exact.scanned)}


def flicker(exact: tuple[Exact, Exact], color: tuple[np.ndarray, np.ndarray]) -> float:
    """Of two frames; see MEANING."""
    where = exact[0].scanned & exact[1].scanned
    change = (srgb(color[1]) - srgb(color[0])) - (srgb(exact[1].color) - srgb(exact[0].color))
    return float(255.0 * np.sqrt(np.mean(np.square(change[where], dtype=np.float64)))) if where.any() else float("nan")
