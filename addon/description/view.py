# SPDX-License-Identifier: GPL-3.0-or-later
"""Camera, panorama, focus, clips and mist of an image."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Camera:
    """patina_camera: the window at distance 1 (perspective) or in world units (orthographic)."""

    orthographic: int
    world_from_camera: tuple[float, ...]  # 16, row-major
    left: float
    right: float
    bottom: float
    top: float
    near_clip: float
    far_clip: float
    panorama_face: int = 0  # 1: a face of a panorama
    camera_unused: int = 0


@dataclass(frozen=True)
class Focus:
    """A lens with depth of field: what it is sharp at, along the view, and its diameter; Blender's units."""

    distance: float
    aperture: float


@dataclass(frozen=True)
class Panorama:
    """patina_panorama: a picture all around."""

    width: int
    height: int
    region: tuple[int, int, int, int]
    world_from_camera: tuple[float, ...]  # 16, row-major
    longitude: tuple[float, float]
    latitude: tuple[float, float]
    near_clip: float
    far_clip: float


@dataclass(frozen=True)
class View:
    """What is drawn: the full picture's size, the part of it, and the camera of the full picture."""

    width: int
    height: int
    region: tuple[int, int, int, int]  # x0, y0, x1, y1 from the bottom left; the whole picture when no border
    camera: Camera
    focus: Focus | None = None  # None: all is sharp
    panorama: Panorama | None = None  # then the camera says no more than where it stands
    notice: str = ""  # what of the camera is not drawn as it says


@dataclass(frozen=True)
class Clip:
    """patina_clip."""

    world_from_clip: tuple[float, ...]
    shape: int
    cut: int
    tint: tuple[float, float, float]
    tint_strength: float
    tint_width: float


@dataclass(frozen=True)
class Mist:
    """How far away things vanish, as Blender's world says."""

    start: float
    depth: float
    falloff: str
