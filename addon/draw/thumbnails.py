# SPDX-License-Identifier: GPL-3.0-or-later
"""Small pictures of styles: of the scene as it is, or of the sample cloud in the scene's look."""

from __future__ import annotations

import struct
import zlib
from dataclasses import replace
from math import cos, radians, sin, tan
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from .. import native, sync, whole
from ..description.points import CloudItem
from ..description.scene import SceneDescription
from ..description.view import Camera, View
from ..sync.points.colors import TRUST
from ..sync.points.soft import soft_of
from . import render, sample

SIZE = 192  # pixels a side
SHRINK = 2  # drawn larger by this: lines are as fine as in a large picture
SAMPLE_POINTS = 300_000
STRAYS = 250  # that the sample has where a look shows trust


def of_scene(depsgraph: bpy.types.Depsgraph) -> np.ndarray:
    """The middle square of what F12 would render: (SIZE, SIZE, 4) uint8 sRGB, row 0 at the top. PatinaError,
    CameraError."""
    camera = depsgraph.scene.camera
    view = sync.final_view(camera and camera.evaluated_get(depsgraph), depsgraph)
    camera, side = view.camera, SIZE * SHRINK
    half = min(camera.right - camera.left, camera.top - camera.bottom) / 2
    x, y = (camera.left + camera.right) / 2, (camera.bottom + camera.top) / 2
    camera = replace(camera, left=x - half, right=x + half, bottom=y - half, top=y + half)
    view = View(side, side, (0, 0, side, side), camera)
    return _draw(sync.describe(depsgraph, view, lambda what, progress: False))


def of_sample(depsgraph: bpy.types.Depsgraph, obj: bpy.types.Object) -> np.ndarray:
    """The sample in the look of the scene and of an object with points. PatinaError."""
    side = SIZE * SHRINK
    view = View(side, side, (0, 0, side, side), _camera())
    look = obj.evaluated_get(depsgraph)
    style = replace(sync.style_of(look, Matrix()), d_min=0.0)
    softened = soft_of(look, Matrix(), depsgraph.scene_eval)
    if softened and softened.by == 'DISTANCE':  # from where the sample is seen
        softened = replace(softened, desc=(*softened.desc, ("world_from_shape", view.camera.world_from_camera)), placed=True)
    doubted = style.color_source == TRUST
    cloud = native.Cloud(*(_with_strays if doubted else tuple)(sample.points(SAMPLE_POINTS)),
                         classes=None if doubted else sample.classes(SAMPLE_POINTS).reshape(-1, 1))
    if doubted:
        cloud.analyse()
    elif softened and softened.by == 'ATTRIBUTE':  # its height above the floor
        cloud.numbers = np.ascontiguousarray(sample.points(SAMPLE_POINTS)[0][:, 2])
    return _draw(sync.describe_items(depsgraph, view, [], [CloudItem(cloud, style, 0, soft=softened)]))


def _with_strays(columns: tuple[np.ndarray, ...]) -> tuple[np.ndarray, ...]:
    """The sample with points in the air around it, so that a look at trust has some to show."""
    random = np.random.default_rng(STRAYS)
    some = random.integers(0, len(columns[0]), STRAYS)
    positions = random.uniform((-1.1, -1.1, 0.0), (1.1, 1.1, 1.1 * sample.HEIGHT), (STRAYS, 3)).astype(np.float32)
    return (np.concatenate([columns[0], positions]), *(np.concatenate([column, column[some]]) for column in columns[1:]))


def _camera(azimuth: float = radians(28), height: float = radians(16), away: float = 4.6) -> Camera:
    right = (cos(azimuth), sin(azimuth), 0.0)
    back = (sin(azimuth) * cos(height), -cos(azimuth) * cos(height), sin(height))
    up = (back[1] * right[2] - back[2] * right[1], back[2] * right[0] - back[0] * right[2],
          back[0] * right[1] - back[1] * right[0])
    place = tuple(away * value for value in back[:2]) + (away * back[2] + 0.47 * sample.HEIGHT,)
    matrix = [(right[i], up[i], back[i], place[i]) for i in range(3)] + [(0.0, 0.0, 0.0, 1.0)]
    half = tan(radians(11))
    return Camera(0, tuple(value for row in matrix for value in row), -half, half, -half, half, 0.1, 100.0)


def _draw(description: SceneDescription) -> np.ndarray:
    picture = render.draw(description, ["COMBINED"], lambda progress: False).planes["COMBINED"][::-1]
    picture = picture.reshape(SIZE, SHRINK, SIZE, SHRINK, 4).mean((1, 3))
    alpha = picture[..., 3:]
    color = np.clip(picture[..., :3] / np.maximum(alpha, 1e-6), 0.0, 1.0)
    color = np.where(color <= 0.0031308, 12.92 * color, 1.055 * color ** (1 / 2.4) - 0.055)
    return np.round(np.concatenate([color, np.clip(alpha, 0.0, 1.0)], 2) * 255).astype(np.uint8)


def save(pixels: np.ndarray, path: Path) -> None:
    """As a PNG, without alpha where all is opaque. OSError."""
    if (pixels[..., 3] == 255).all():
        pixels = pixels[..., :3]
    height, width, channels = pixels.shape
    rows = np.concatenate([np.zeros((height, 1), np.uint8), pixels.reshape(height, -1)], 1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 2 if channels == 3 else 6, 0, 0, 0)
    whole.write(path, b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 9)) +
                chunk(b"IEND", b""))
