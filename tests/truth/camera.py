# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras as patina.h describes them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Camera:
    """matrix: world from camera, looking down -z; the window lies at distance 1, or is in world units
    (orthographic)."""

    matrix: np.ndarray
    left: float
    right: float
    bottom: float
    top: float
    near: float = 0.1
    far: float = 100.0
    orthographic: bool = False

    def fields(self) -> dict[str, object]:
        """The fields of patina_camera."""
        return {"orthographic": int(self.orthographic), "world_from_camera": self.matrix.ravel().tolist(),
                "left": self.left, "right": self.right, "bottom": self.bottom, "top": self.top,
                "near_clip": self.near, "far_clip": self.far}

    @property
    def eye(self) -> np.ndarray:
        return self.matrix[:3, 3]

    def rays(self, x: np.ndarray, y: np.ndarray, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
        """Through places of the picture, in pixels from the bottom left: origin + z direction lies at pass depth z."""
        u = self.left + (self.right - self.left) * x / width
        v = self.bottom + (self.top - self.bottom) * y / height
        right, up, back = self.matrix[:3, 0], self.matrix[:3, 1], self.matrix[:3, 2]
        if self.orthographic:
            origin = self.eye + u[:, None] * right + v[:, None] * up - self.near * back
            return origin, np.broadcast_to(-back, origin.shape)
        direction = u[:, None] * right + v[:, None] * up - back
        return np.broadcast_to(self.eye, direction.shape), direction

    def project(self, point: np.ndarray, width: int, height: int) -> np.ndarray:
        """World points (n, 3) -> x, y in pixels and pass depth z; x, y are not finite on the camera plane."""
        local = (point - self.eye) @ self.matrix[:3, :3]
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = 1.0 if self.orthographic else -1.0 / local[:, 2]
            x = (local[:, 0] * scale - self.left) / (self.right - self.left) * width
            y = (local[:, 1] * scale - self.bottom) / (self.top - self.bottom) * height
        return np.stack([x, y, -local[:, 2] - (self.near if self.orthographic else 0.0)], axis=1)

    def pixel(self, height: int, distance: float) -> float:
        """Height of a pixel at a distance, world units."""
        return (self.top - self.bottom) / height * (1.0 if self.orthographic else distance)


def look(eye: np.ndarray, target: np.ndarray, fov: float = 45.8, aspect: float = 1.0) -> Camera:
    """z up; fov: vertical, degrees."""
    back = np.asarray(eye, float) - target
    back /= np.linalg.norm(back)
    pole = np.array([0.0, 1.0, 0.0] if abs(back[2]) > 0.999999 else [0.0, 0.0, 1.0])
    right = np.cross(pole, back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = right, np.cross(back, right), back, eye
    half = float(np.tan(np.radians(fov) / 2.0))
    return Camera(matrix, -half * aspect, half * aspect, -half, half)


def orbit(azimuth: float = 0.0, elevation: float = 40.0, distance: float = 3.6, fov: float = 45.8,
          aspect: float = 1.0) -> Camera:
    """Looks at the origin; azimuth: degrees around z from -y."""
    turn, rise = np.radians(azimuth), np.radians(elevation)
    back = np.array([np.sin(turn) * np.cos(rise), -np.cos(turn) * np.cos(rise), np.sin(rise)])
    matrix = np.eye(4)
    matrix[:3, 0] = np.cos(turn), np.sin(turn), 0.0
    matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = np.cross(back, matrix[:3, 0]), back, distance * back
    half = float(np.tan(np.radians(fov) / 2.0))
    return Camera(matrix, -half * aspect, half * aspect, -half, half)


def parallel(camera: Camera, distance: float) -> Camera:
    """The orthographic camera that shows the plane at `distance` as large as a perspective one does."""
    return Camera(camera.matrix, camera.left * distance, camera.right * distance, camera.bottom * distance,
                  camera.top * distance, -10.0, 20.0, True)
