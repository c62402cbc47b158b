# SPDX-License-Identifier: GPL-3.0-or-later
"""Phong light as the shade kernel has it, and shadows by casting rays [D 6]."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .scene import Scene


@dataclass(frozen=True)
class Light:
    """A sun of irradiance `power` W/m2 from the unit vector `towards`, or a point light of `power` W at `position`. Its
    area: a sun's disc of `angle` radians across, a disc of `radius` that faces the point it lights, or the
    parallelogram that the half edges `across` span around `position`."""

    power: float
    towards: np.ndarray | None = None
    position: np.ndarray | None = None
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    angle: float = 0.0
    radius: float = 0.0
    across: tuple[np.ndarray, np.ndarray] | None = None

    @property
    def has_area(self) -> bool:
        return self.angle > 0.0 or self.radius > 0.0 or self.across is not None

    def fields(self) -> dict[str, object]:
        """The fields of patina_light_desc; its area is not among them."""
        if self.towards is not None:
            return {"type": 1, "power": self.power, "color": self.color, "direction": (-self.towards).tolist()}
        return {"type": 2, "power": self.power, "color": self.color, "position": self.position.tolist()}

    def reach(self, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Unit vectors towards the light's centre (n, 3) and irradiance at right angles (n)."""
        if self.towards is not None:
            return np.broadcast_to(self.towards, point.shape), np.full(len(point), self.power)
        way = self.position - point
        squared = np.einsum("ij,ij->i", way, way)
        return way / np.sqrt(squared)[:, None], self.power / (4.0 * np.pi * squared)

    def targets(self, point: np.ndarray, place: np.ndarray) -> np.ndarray:
        """From points (n, 3) to places (2) of the light's area, in the unit disc (sun, ball) or in [-1, 1]^2: vectors
        whose end is the light (for a sun: far out)."""
        if self.across is not None:
            return self.position + place[0] * self.across[0] + place[1] * self.across[1] - point
        way = np.broadcast_to(self.towards, point.shape) if self.towards is not None else self.position - point
        if not self.has_area:
            return way * (1e3 if self.towards is not None else 1.0)
        axis = np.eye(3)[np.abs(way).argmin(axis=1)]
        u = np.cross(axis, way)
        u /= np.linalg.norm(u, axis=1)[:, None]
        length = np.linalg.norm(way, axis=1)[:, None]
        v = np.cross(way / length, u)
        size = np.tan(0.5 * self.angle) if self.towards is not None else self.radius
        end = way + size * (place[0] * u + place[1] * v)
        return end * 1e3 if self.towards is not None else end


def places(light: Light, count: int) -> np.ndarray:
    """Quadrature places of a light's area (about count, 2): a sunflower in the disc, middles of cells in the square."""
    if not light.has_area:
        return np.zeros((1, 2))
    if light.across is not None:
        side = max(int(np.sqrt(count)), 1)
        middle = (np.arange(side) + 0.5) / side * 2.0 - 1.0
        return np.stack(np.meshgrid(middle, middle), axis=-1).reshape(-1, 2)
    k = np.arange(count)
    turn, far = k * np.pi * (3.0 - np.sqrt(5.0)), np.sqrt((k + 0.5) / count)
    return np.stack([far * np.cos(turn), far * np.sin(turn)], axis=1)


def _rim(light: Light) -> np.ndarray:
    """24 places on the border of a light's area."""
    turn = np.arange(24) * np.pi / 12.0
    rim = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return rim / np.abs(rim).max(axis=1)[:, None] if light.across is not None else rim


def visibility(scene: Scene, light: Light, point: np.ndarray, samples: int = 1024) -> np.ndarray:
    """m in [0, 1] at points (n, 3) of the scene's surfaces: the share of the light's area that they see, uniform in
    area. A surface of opacity a lets 1 - a through. Points that 36 places within the area and 24 on its border agree on
    are in full light or full shadow; the others take all `samples`."""
    def mean(points: np.ndarray, quadrature: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        total, least, most = np.zeros(len(points)), np.ones(len(points)), np.zeros(len(points))
        for place in quadrature:
            seen = scene.passage(points, light.targets(points, place))
            total += seen
            least, most = np.minimum(least, seen), np.maximum(most, seen)
        return total / len(quadrature), least != most

    if not light.has_area or samples <= 60:
        return mean(point, places(light, samples))[0]
    result, mixed = mean(point, np.concatenate([places(light, 36), _rim(light)]))
    if mixed.any():
        result[mixed] = mean(point[mixed], places(light, samples))[0]
    return result


def phong(scene: Scene, surface: np.ndarray, point: np.ndarray, normal: np.ndarray, viewer: np.ndarray,
          lit: list[np.ndarray] | None = None) -> np.ndarray:
    """albedo (k_a world + sum m E/pi (k_d max(n.l, 0) + k_s max(r.v, 0)^shininess)) of points (n, 3): linear (n, 3).
    viewer: unit vectors towards the eye; normals are turned to it; highlights only where n.l > 0. lit: m by light."""
    normal = np.where(np.einsum("ij,ij->i", normal, viewer)[:, None] < 0.0, -normal, normal)
    material = scene.material
    result = np.full(point.shape, material.ambient) * scene.world
    for index, light in enumerate(scene.lights):
        way, strength = light.reach(point)
        cosine = np.einsum("ij,ij->i", normal, way)
        mirrored = 2.0 * cosine[:, None] * normal - way
        shine = np.clip(np.einsum("ij,ij->i", mirrored, viewer), 0.0, 1.0) ** material.shininess
        share = material.diffuse * np.maximum(cosine, 0.0) + material.specular * np.where(cosine > 0.0, shine, 0.0)
        share *= strength / np.pi * (1.0 if lit is None else lit[index])
        result += share[:, None] * np.array(light.color)
    return scene.albedo(surface, point) * result
