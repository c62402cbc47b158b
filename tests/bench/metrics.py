# SPDX-License-Identifier: GPL-3.0-or-later
"""What separates a picture from the exact one. Every figure is an error except coverage_iou, color_psnr and
color_ssim."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from skimage.metrics import structural_similarity

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from truth import Picture  # noqa: E402

MEANING = {  # name -> unit and what it says; the order of tables
    "coverage_iou": "shared by both ÷ covered by either, at pixel centres (1 is best)",
    "false_holes": "share of the truth's pixels that show nothing",
    "inner_holes": "of them, a pixel or more within the outline",
    "false_growth": "pixels shown beyond the truth, as a share of its pixels",
    "outer_growth": "of them, a pixel or more off the outline",
    "alpha_rms": "alpha against exact coverage, pixels that an outline crosses",
    "depth_rms_spacings": "depth, root mean square, in spacings of the points",
    "depth_bias_spacings": "depth, mean, spacings: less than 0 is in front",
    "depth_p999_spacings": "depth, 99.9th percentile, spacings",
    "normal_mean_degrees": "normals, mean angle",
    "normal_p99_degrees": "normals, 99th percentile",
    "color_rms": "linear colour, root mean square, inner pixels",
    "color_psnr": "dB, sRGB over grey, pixels that either covers (more is better)",
    "color_ssim": "structural similarity of the same (1 is best)",
    "transmittance_rms": "1 - alpha, inner pixels of transparent scenes",
    "shadow_rms": "light that shadows leave, in shares of the full light, inner pixels",
    "temporal_variance": "per-pixel variance of colour minus truth over a slow turn of the camera",
    "flicker_inside": "levels of 255 by which colour minus truth changes from picture to picture of that turn, inner pixels",
    "flicker_edges": "the same, pixels that an outline crosses",
}
BEST_HIGH = ("coverage_iou", "color_psnr", "color_ssim")
GREY = 0.2140  # linear; sRGB 0.5


@dataclass(frozen=True, eq=False)
class Shown:
    """A renderer's picture, row 0 at the bottom: rgba (h, w, 4) linear premultiplied; depth (h, w) to the camera plane,
    inf where nothing is, or None; normal (h, w, 3) in world space, or None."""

    rgba: np.ndarray
    depth: np.ndarray | None = None
    normal: np.ndarray | None = None

    @property
    def covered(self) -> np.ndarray:
        return np.isfinite(self.depth) if self.depth is not None else self.rgba[..., 3] >= 0.5


def around(mask: np.ndarray) -> np.ndarray:
    """How many of the 3x3 pixels around are set; beyond the border counts as the border does."""
    wide = np.pad(mask.astype(np.uint8), 1, mode="edge")
    rows = wide[:-2] + wide[1:-1] + wide[2:]
    return rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:]


def srgb(linear: np.ndarray) -> np.ndarray:
    value = np.clip(linear, 0.0, 1.0)
    return np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1.0 / 2.4) - 0.055)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else 0.0


def errors(exact: Picture, shown: Shown, spacing: float) -> dict[str, float]:
    """spacing: 1 / sqrt(points per area), world units. Depth, normals and plain colour where the truth covers the 3x3
    pixels around. Depth and normals are those of the nearest surface."""
    expected, covered = np.isfinite(exact.depth), shown.covered
    near = around(expected)
    area = max(float(expected.sum()), 1.0)
    inner = (near == 9) & covered
    result = {
        "coverage_iou": float((expected & covered).sum() / max((expected | covered).sum(), 1)),
        "false_holes": float((expected & ~covered).sum() / area),
        "inner_holes": float(((near == 9) & ~covered).sum() / area),
        "false_growth": float((~expected & covered).sum() / area),
        "outer_growth": float(((near == 0) & covered).sum() / area),
    }
    alpha, exact_alpha = shown.rgba[..., 3].astype(np.float64), exact.smooth[..., 3]
    result["alpha_rms"] = _rms((alpha - exact_alpha)[(near > 0) & (near < 9)])
    if inner.any():
        if shown.depth is not None:
            off = (shown.depth[inner].astype(np.float64) - exact.depth[inner]) / spacing
            result |= {"depth_rms_spacings": _rms(off), "depth_bias_spacings": float(off.mean()),
                       "depth_p999_spacings": float(np.quantile(np.abs(off), 0.999))}
        if shown.normal is not None:
            dots = np.sum(shown.normal[inner].astype(np.float64) * exact.normal[inner], axis=1)
            view = np.degrees(np.arccos(np.clip(dots, -1.0, 1.0)))
            result["normal_mean_degrees"] = float(np.mean(view))
            result["normal_p99_degrees"] = float(np.quantile(view, 0.99))
        plain = shown.rgba[inner][:, :3] / np.maximum(alpha[inner], 1e-6)[:, None]
        whole = exact.rgba[inner][:, :3] / np.maximum(exact.rgba[inner][:, 3:4], 1e-6)
        result["color_rms"] = _rms(plain - whole)
    return result | seen(exact, shown) | transmittance(exact, shown, near == 9)


def seen(exact: Picture, shown: Shown) -> dict[str, float]:
    """As eyes have it: over grey, sRGB, edges averaged; PSNR and SSIM over the pixels that either picture covers."""
    ours = srgb(shown.rgba[..., :3] + (1.0 - shown.rgba[..., 3:4]) * GREY)
    theirs = srgb(exact.smooth[..., :3] + (1.0 - exact.smooth[..., 3:4]) * GREY)
    region = (exact.smooth[..., 3] > 0.0) | (shown.rgba[..., 3] > 0.0)
    if not region.any():
        return {}
    square = float(np.mean((ours - theirs)[region] ** 2))
    _, similar = structural_similarity(theirs, ours, data_range=1.0, channel_axis=2, gaussian_weights=True, sigma=1.5,
                                       use_sample_covariance=False, full=True)
    return {"color_psnr": float(-10.0 * np.log10(max(square, 1e-12))), "color_ssim": float(similar[region].mean())}


def transmittance(exact: Picture, shown: Shown, inner: np.ndarray) -> dict[str, float]:
    behind = exact.layer_transmittance[-1]
    if not ((behind[inner] > 0.0).any()):
        return {}
    return {"transmittance_rms": _rms((1.0 - shown.rgba[..., 3].astype(np.float64) - behind)[inner])}


def shadow(exact: Picture, unshadowed: Picture, ambient: np.ndarray, shown: Shown) -> dict[str, float]:
    """Light that shadows leave: (colour - ambient) as a share of (full light - ambient), where the full light is more
    than 0.02. ambient: linear colour (h, w, 3) without any light. For opaque scenes."""
    span = (unshadowed.color - ambient).sum(axis=2)
    inner = (around(np.isfinite(exact.depth)) == 9) & shown.covered & (span > 0.02)
    plain = shown.rgba[inner][:, :3] / np.maximum(shown.rgba[inner][:, 3:4].astype(np.float64), 1e-6)
    return {"shadow_rms": _rms((plain - exact.color[inner]).sum(axis=1) / span[inner])}


def levels(rgba: np.ndarray) -> np.ndarray:
    """Of 255, sRGB, over grey."""
    return 255.0 * srgb(rgba[..., :3] + (1.0 - rgba[..., 3:4]) * GREY)


class Steadiness:
    """Per-pixel variance of (picture - truth) over the pictures that are added, mean over pixels and channels. Counted
    where the truth covers the 3x3 pixels around in every picture. Flicker: root mean square of what that difference changes by
    from one picture to the next, there and where an outline crosses the 3x3 pixels in some picture."""

    def __init__(self) -> None:
        self._count, self._inside, self._sum, self._squares = 0, True, 0.0, 0.0
        self._crossed: np.ndarray | bool = False
        self._last: np.ndarray | None = None
        self._changes: np.ndarray | float = 0.0

    def add(self, exact: Picture, shown: Shown) -> None:
        off = shown.rgba.astype(np.float64) - exact.smooth
        near = around(np.isfinite(exact.depth))
        self._inside, self._crossed = self._inside & (near == 9), self._crossed | ((near > 0) & (near < 9))
        self._sum, self._squares, self._count = self._sum + off, self._squares + off**2, self._count + 1
        seen_off = levels(shown.rgba.astype(np.float64)) - levels(exact.smooth)
        if self._last is not None:
            self._changes = self._changes + (seen_off - self._last) ** 2
        self._last = seen_off

    def result(self) -> dict[str, float]:
        variance = self._squares / self._count - (self._sum / self._count) ** 2
        result = {"temporal_variance": float(np.maximum(variance, 0.0)[self._inside].mean())}
        for name, where in (("flicker_inside", self._inside), ("flicker_edges", self._crossed)):
            if self._count > 1 and where.any():
                result[name] = float(np.sqrt(np.mean(np.asarray(self._changes)[where] / (self._count - 1))))
        return result
