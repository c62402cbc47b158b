# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface that a 3D view shows, as a tool meets it: the place under the mouse, or the nearest trusted point to it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from bpy.types import Context

from ..description.scene import SceneDescription
from ..description.view import Camera
from ..draw.cryptomatte import shown_items
from ..sync.analyses.analyzing import ANALYSES
from .view_tools import Place, Seen, describe

CORNERS = 24  # of the disc in which points are looked for


@dataclass(frozen=True)
class Hit:
    """A place on a surface."""

    name: str  # of the object, with its library
    world: np.ndarray  # (3,) float64, Blender's coordinates
    snapped: bool  # to a point
    pixel: Place = (0.0, 0.0)  # of the view, where it was picked


class Surface:
    """What the view shows now. PatinaError, CameraError."""

    def __init__(self, context: Context) -> None:
        with ANALYSES.drawing():
            described = describe(context)
            names = {item.name for item in described.clouds}
            self._seen = Seen(described, names, through=False)
            self._trusted = self._seen
            try:
                x0, y0, x1, y1 = described.settings.region
                arrays = self._seen.depth(), shown_items(self._seen.numbers(), described)
                self._depth, self._items = (array if array.shape[:2] == (y1 - y0, x1 - x0) else array[y0:y1, x0:x1] for array in arrays)
                if any(item.style.least_trust < 0.0 for item in described.clouds):  # untrusted points are drawn too
                    self._trusted = Seen(_trusted_only(described), names, through=False)
            except BaseException:
                self.close()
                raise
        self._description = described

    def at(self, place: Place, radius: float) -> Hit | None:
        """At a place, in pixels from the view's bottom left. radius: how far, in pixels, a point may be that it snaps to; 0: it does not."""
        snapped = self._nearest(place, radius) if radius > 0.0 else None
        return snapped or self._under(place)

    def _nearest(self, place: Place, radius: float) -> Hit | None:
        turns = np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False)
        outline = np.asarray(place) + radius * np.stack([np.cos(turns), np.sin(turns)], 1)
        with ANALYSES.drawing():
            found = self._trusted.nearest(outline, place)
        return found and Hit(*found, snapped=True, pixel=place)

    def _under(self, place: Place) -> Hit | None:
        settings = self._description.settings
        x0, y0, x1, y1 = settings.region
        x, y = int(np.floor(place[0])), int(np.floor(place[1]))
        if not (x0 <= x < x1 and y0 <= y < y1):
            return None
        depth, item = float(self._depth[y - y0, x - x0, 0]), int(self._items[y - y0, x - x0])
        drawn = [*self._description.clouds, *self._description.meshes]
        if not np.isfinite(depth) or item >= len(drawn):
            return None
        return Hit(drawn[item].name, unprojected(self._description.camera, settings.width, settings.height, place, depth), snapped=False, pixel=place)

    def around(self, place: Place, radius: float) -> np.ndarray:
        """(n, 3) float64, in the world: the surface of trusted points at each pixel that is no farther than so many from the place."""
        settings = self._description.settings
        depth = self._trusted.depth()
        x0, y0, x1, y1 = settings.region
        depth = (depth if depth.shape[:2] == (y1 - y0, x1 - x0) else depth[y0:y1, x0:x1])[..., 0]
        rows, columns = np.nonzero(np.isfinite(depth))
        near = np.hypot(columns + x0 + 0.5 - place[0], rows + y0 + 0.5 - place[1]) <= radius
        return unprojected(self._description.camera, settings.width, settings.height, (columns[near] + x0 + 0.5, rows[near] + y0 + 0.5),
                           depth[rows[near], columns[near]].astype(np.float64))

    def towards(self, place: np.ndarray) -> np.ndarray:
        """(3,), a direction from a place in the world to the viewer."""
        matrix = np.array(self._description.camera.world_from_camera, np.float64).reshape(4, 4)
        return matrix[:3, 2] if self._description.camera.orthographic else matrix[:3, 3] - place

    def close(self) -> None:
        self._seen.close()
        if self._trusted is not self._seen:
            self._trusted.close()

    def __enter__(self) -> Surface:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _trusted_only(description: SceneDescription) -> SceneDescription:
    """With what automatic thresholds leave out left out."""
    return replace(description, clouds=[replace(item, style=replace(item.style, least_trust=max(item.style.least_trust, 0.0)))
                                        for item in description.clouds])


def unprojected(camera: Camera, width: int, height: int, place: Place | tuple[np.ndarray, np.ndarray], depth: float | np.ndarray) -> np.ndarray:
    """(3,) float64, in the world; of n places and depths (n, 3). depth: linear z, as the library's pass has it: from the eye, in orthographic
    views from the near clip."""
    x = camera.left + place[0] / width * (camera.right - camera.left)
    y = camera.bottom + place[1] / height * (camera.top - camera.bottom)
    matrix = np.array(camera.world_from_camera, np.float64).reshape(4, 4)
    axes = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
    local = (x, y, -(depth + camera.near_clip)) if camera.orthographic else (x * depth, y * depth, -depth)
    return np.stack(local, -1) @ axes.T + matrix[:3, 3]
