# SPDX-License-Identifier: GPL-3.0-or-later
"""The world behind a picture, pixel by pixel: nothing here knows Blender."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .. import native
from ..description.scene import SceneDescription

BLOCK = 1 << 17  # pixels between two looks at whether to go on


def pixels(description: SceneDescription, stopped: Callable[[], bool] = lambda: False) -> np.ndarray:
    """(height, width, 3) float32 of the picture's region, row 0 at the bottom: what the middles of its pixels look at.
    stopped() is called now and then; PatinaCancelled where it returns True."""
    x0, y0, x1, y1 = (description.panorama or description.settings).region
    out = np.empty((y1 - y0, x1 - x0, 3), np.float32)
    rows = max(BLOCK // max(x1 - x0, 1), 1)
    for low in range(y0, y1, rows):
        if stopped():
            raise native.PatinaCancelled("cancelled", native.CANCELLED)
        high = min(low + rows, y1)
        looks = directions(description, low, high).reshape(-1, 3)
        out[low - y0:high - y0] = description.behind.seen(looks).reshape(high - low, x1 - x0, 3)
    return out


def over(color: np.ndarray, behind: np.ndarray) -> np.ndarray:
    """A premultiplied picture (height, width, 4) before what is behind."""
    out = np.empty_like(color)
    out[..., :3] = color[..., :3] + (1 - color[..., 3:]) * behind
    out[..., 3] = 1.0
    return out


def _turned(view: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """float32. Sum by sum: a product of matrices may round by how its rows lie in memory, and borders would differ from crops."""
    return (view[..., 0:1] * axes[:, 0] + view[..., 1:2] * axes[:, 1] + view[..., 2:3] * axes[:, 2]).astype(np.float32)


def directions(description: SceneDescription, low: int, high: int) -> np.ndarray:
    """(high - low, width, 3) float32, unit, in the world: of rows of the full picture."""
    camera = description.camera
    matrix = np.array(camera.world_from_camera).reshape(4, 4)[:3, :3]
    axes = matrix / np.linalg.norm(matrix, axis=0)
    if description.panorama:
        around = description.panorama
        x0, _, x1, _ = around.region
        (left, right), (bottom, top) = around.longitude, around.latitude
        x = (left + (np.arange(x0, x1) + 0.5) * (right - left) / around.width)[None]
        y = (bottom + (np.arange(low, high) + 0.5) * (top - bottom) / around.height)[:, None]
        view = np.stack(np.broadcast_arrays(np.cos(y) * np.sin(x), np.sin(y), -np.cos(y) * np.cos(x)), 2)
        return _turned(view, axes)
    settings = description.settings
    x0, _, x1, _ = settings.region
    if camera.orthographic:
        return np.broadcast_to((-axes[:, 2]).astype(np.float32), (high - low, x1 - x0, 3))
    x = (camera.left + (np.arange(x0, x1) + 0.5) * (camera.right - camera.left) / settings.width)[None]
    y = (camera.bottom + (np.arange(low, high) + 0.5) * (camera.top - camera.bottom) / settings.height)[:, None]
    view = np.stack(np.broadcast_arrays(x, y, np.float64(-1.0)), 2)
    view /= np.sqrt(x * x + y * y + 1.0)[..., None]
    return _turned(view, axes)
