# SPDX-License-Identifier: GPL-3.0-or-later
"""Why a picture may be empty: the points lie where the camera does not look, or beyond what it sees."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...description.points import CloudItem
from ...description.view import View
from ..points.built import Pending


def notice(items: Sequence[CloudItem], view: View) -> str:
    """A sentence where all clouds lie behind the camera, beyond Clip End or before Clip Start; mostly nothing. Those that are
    not built yet are left out."""
    places = [(cloud, item.style.world_from_object) for item in items
              if (cloud := item.cloud.built if isinstance(item.cloud, Pending) else item.cloud) and cloud.drawn]
    if not places:
        return ""
    near, far = _distances(_corners(places), view)
    clip_start, clip_end = view.camera.near_clip, view.camera.far_clip
    front = far > min(clip_start, 0.0)
    if not front.any():
        return "all points lie behind the camera"
    if (near[front] > clip_end).all():
        return (f"all points lie beyond Clip End, {clip_end:.4g}: the nearest are {near[front].min():.4g} away. "
                "In the sidebar, Patina > Frame Points sees to it")
    if (far[front] < clip_start).all():
        return f"all points lie before Clip Start, {clip_start:.4g}: the farthest are {far[front].max():.4g} away"
    return ""


def _corners(places: list) -> np.ndarray:
    """(n, 8, 3) of the boxes, in the world."""
    boxes = np.array([cloud.box for cloud, _ in places], np.float64)
    matrices = np.array([matrix for _, matrix in places], np.float64).reshape(-1, 4, 4)
    index = np.arange(8)[:, None] >> np.arange(3) & 1
    corners = np.take_along_axis(boxes, index[None].repeat(len(boxes), 0), axis=1)
    return corners @ matrices[:, :3, :3].transpose(0, 2, 1) + matrices[:, None, :3, 3]


def _distances(corners: np.ndarray, view: View) -> tuple[np.ndarray, np.ndarray]:
    """(n,) each, least and most: along the view, of a panorama as the crow flies."""
    matrix = np.array(view.camera.world_from_camera, np.float64).reshape(4, 4)
    if view.panorama:
        low, high = corners.min(axis=1), corners.max(axis=1)
        eye = matrix[:3, 3]
        return (np.linalg.norm(np.clip(eye, low, high) - eye, axis=1), np.linalg.norm(corners - eye, axis=2).max(axis=1))
    axis = matrix[:3, 2] / np.linalg.norm(matrix[:3, 2])
    along = (matrix[:3, 3] - corners) @ axis
    return along.min(axis=1), along.max(axis=1)
