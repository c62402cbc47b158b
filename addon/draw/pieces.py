# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures that are drawn piece by piece: tiles of large ones, faces of panoramas. A piece's pixels are those of the whole picture (the
library keeps a guard band around it), so pieces only save memory. Nothing here knows Blender."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace

import numpy as np

from .. import native
from ..description.scene import SceneDescription
from ..description.view import Camera

# Planes take some 130 bytes a pixel: 2 GB for a picture of that size. Larger ones are made in tiles, and smaller ones too
# where memory is short; the smaller the tiles, the more of the time goes into the band around each.
PIXEL_BYTES = 130
LARGE_PICTURE = 1 << 24  # pixels
LEAST_TILE, TILE_STEP = 512, 256  # pixels a side

Planes = dict[str, np.ndarray]  # (height, width, channels) by plane name, row 0 at the bottom
Region = tuple[int, int, int, int]  # x0, y0, x1, y1 from the bottom left


def tiles(region: Region, size: int, budget: int | None = None) -> list[Region]:
    """Regions that make up a region, rows from the bottom. size 0: one, unless the picture is large; budget: bytes for planes,
    None: as many as a large picture takes."""
    x0, y0, x1, y1 = region
    across, along = size or x1 - x0, size or y1 - y0
    most = LARGE_PICTURE if budget is None else min(LARGE_PICTURE, budget // PIXEL_BYTES)
    if not size and across * along > most:
        side = max(math.isqrt(most) // TILE_STEP * TILE_STEP, LEAST_TILE)
        across, along = (math.ceil(length / math.ceil(length / side)) for length in (across, along))  # none much smaller
    return [(x, y, min(x + across, x1), min(y + along, y1)) for y in range(y0, y1, along) for x in range(x0, x1, across)]


@dataclass(frozen=True)
class Piece:
    description: SceneDescription  # of this piece alone: its camera and its region
    face: int  # of a panorama; else 0


class Canvas:
    """The pieces of one picture, and what has been drawn of them."""

    def __init__(self, description: SceneDescription, tile_size: int, budget: int | None) -> None:
        self._panorama = native.Panorama(**asdict(description.panorama)) if description.panorama else None
        views = list(self._faces(description)) if self._panorama else [description]
        self._regions = [view.settings.region for view in views]
        self._joined = [description.panorama.region] if description.panorama else []
        self._planes: list[Planes] = [{} for _ in views]
        self.pieces: list[Piece] = []
        for face, view in enumerate(views):
            regions = tiles(view.settings.region, tile_size, budget)
            # tiles take from whole shadow textures, all of them
            lazy = view.settings.shadow_lazy if len(regions) == 1 else 0
            self.pieces += [Piece(replace(view, settings=replace(view.settings, region=region, shadow_lazy=lazy)), face)
                            for region in regions]

    def _faces(self, description: SceneDescription) -> Iterable[SceneDescription]:
        for face in range(native.Panorama.FACES):
            camera, side = self._panorama.camera(face)
            settings = replace(description.settings, width=side, height=side, region=(0, 0, side, side))
            yield replace(description, panorama=None, camera=Camera(**camera), settings=settings)

    def put(self, piece: Piece, planes: Planes) -> None:
        """A piece's pixels, of some planes; the arrays may be kept."""
        x0, y0, x1, y1 = self._regions[piece.face]
        left, low, right, high = piece.description.settings.region
        for name, pixels in planes.items():
            if (left, low, right, high) == (x0, y0, x1, y1):
                self._planes[piece.face][name] = pixels
                continue
            whole = self._planes[piece.face].get(name)
            if whole is None:
                whole = self._planes[piece.face][name] = np.empty((y1 - y0, x1 - x0, pixels.shape[2]), pixels.dtype)
            whole[low - y0:high - y0, left - x0:right - x0] = pixels

    def bytes(self, wanted: Iterable[str]) -> int:
        """What these planes of all pieces take, and those that faces are joined to."""
        pixels = sum((x1 - x0) * (y1 - y0) for x0, y0, x1, y1 in (*self._regions, *self._joined))
        return pixels * sum(8 if name in ("KEYS", "NUMBERS") else 4 * native.PLANES[native.split_plane(name)[0]][1] for name in wanted)

    def planes(self, wanted: Iterable[str]) -> Planes:
        """The whole picture. Where it is not joined out of faces the arrays are those that put() writes into."""
        if self._panorama:
            return {name: self._panorama.join(name, [face[name] for face in self._planes]) for name in wanted}
        return {name: self._planes[0][name] for name in wanted}
