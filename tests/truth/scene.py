# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of known surfaces, and their exact pictures by casting rays in float64."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field, fields

import numpy as np

from .camera import Camera
from .light import Light, phong, visibility
from .surfaces import Surface

CHUNK = 1 << 17  # rays at once: bounds memory


def srgb_bytes(position: np.ndarray) -> np.ndarray:
    """A colour that varies smoothly over space, before rounding to bytes."""
    turned = np.roll(position, -1, axis=-1)
    return 127.5 + 100.0 * np.sin(3.0 * position + turned + np.arange(3))


def linear(srgb: np.ndarray) -> np.ndarray:
    """sRGB 0..255 to linear 0..1."""
    value = np.clip(srgb / 255.0, 0.0, 1.0)
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def smooth_color(surface: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Linear albedo (n, 3)."""
    return linear(srgb_bytes(position))


@dataclass(frozen=True)
class Material:
    """Phong factors."""

    ambient: float = 1.0
    diffuse: float = 1.0
    specular: float = 0.0
    shininess: int = 32


@dataclass(frozen=True, eq=False)
class Scene:
    """world: grey light from everywhere. albedo(surface index (n), position (n, 3)) -> linear (n, 3)."""

    surfaces: tuple[Surface, ...]
    lights: tuple[Light, ...] = ()
    world: float = 0.05
    material: Material = field(default_factory=Material)
    albedo: Callable[[np.ndarray, np.ndarray], np.ndarray] = smooth_color

    @property
    def area(self) -> float:
        return sum(surface.area for surface in self.surfaces)

    @property
    def opacities(self) -> np.ndarray:
        return np.array([surface.opacity for surface in self.surfaces])

    def crossings(self, origin: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Every t at which the lines origin + t direction meet a surface, ascending (n, most), inf-padded, and
        whose."""
        tables = [surface.crossings(origin, direction) for surface in self.surfaces]
        owner = np.repeat(np.arange(len(tables)), [table.shape[1] for table in tables])
        t = np.concatenate(tables, axis=1)
        t = np.where(np.isnan(t), np.inf, t)
        order = np.argsort(t, axis=1, kind="stable")
        return np.take_along_axis(t, order, axis=1), owner[order]

    def passage(self, point: np.ndarray, way: np.ndarray) -> np.ndarray:
        """Share of light that passes from point (n, 3) to point + way; surfaces nearer than 1e-6 units do not count,
        nor does what lies behind the way's end."""
        result = np.ones(len(point))
        through = 1.0 - self.opacities
        for begin in range(0, len(point), CHUNK):
            part = slice(begin, begin + CHUNK)
            least = 1e-6 / np.linalg.norm(way[part], axis=1)[:, None]
            for surface, share in zip(self.surfaces, through):
                t = surface.crossings(point[part], way[part])
                with np.errstate(invalid="ignore"):
                    between = ((t > least) & (t < 1.0 - least)).sum(axis=1)
                result[part] *= share**between
        return result

    def normals(self, surface: np.ndarray, point: np.ndarray) -> np.ndarray:
        normal = np.zeros_like(point)
        for index, one in enumerate(self.surfaces):
            mine = np.flatnonzero(surface == index)
            normal[mine] = one.normal(point[mine])
        return normal

    def shade(self, surface: np.ndarray, point: np.ndarray, viewer: np.ndarray, shadow_samples: int = 0
              ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Normals, colours (n, 3) and m of each light (n, lights) at points of surfaces. shadow_samples 0: no
        shadows."""
        normal = self.normals(surface, point)
        lit = [visibility(self, light, point, shadow_samples) if shadow_samples else np.ones(len(point))
               for light in self.lights]
        color = phong(self, surface, point, normal, viewer, lit)
        return normal, color, np.stack(lit, axis=1) if lit else np.ones((len(point), 0))

    def picture(self, camera: Camera, width: int, height: int, layers: int = 1, antialias: int = 8,
                shadow_samples: int = 0) -> Picture:
        """The exact picture: the first `layers` surfaces along each pixel's central ray, front to back; what lies
        deeper is cut. antialias: edges are averaged over that many rays squared (0: `smooth` is `rgba`).
        shadow_samples: 0 no shadows, else quadrature places on each light's area."""
        y, x = np.divmod(np.arange(width * height), width)
        taken = self._take(camera, x + 0.5, y + 0.5, width, height, layers, shadow_samples)
        shape = (height, width)
        depth, surface, normal, color, lit, transmittance, rgba = taken
        smooth = rgba.copy()
        if antialias:
            edge = np.flatnonzero(self._edges(camera, width, height, depth[0], normal[0], surface) |
                                  _differs(lit.sum(axis=2).reshape(layers, height, width), 0.02))
            offsets = (np.arange(antialias) + 0.5) / antialias
            for begin in range(0, len(edge), max(CHUNK // antialias**2, 1)):
                part = edge[begin : begin + max(CHUNK // antialias**2, 1)]
                u = (x[part, None, None] + np.broadcast_to(offsets, (antialias, antialias))).reshape(-1)
                v = (y[part, None, None] + np.broadcast_to(offsets[:, None], (antialias, antialias))).reshape(-1)
                rays = self._take(camera, u, v, width, height, layers, shadow_samples)[-1]
                smooth[part] = rays.reshape(len(part), antialias**2, 4).mean(axis=1)
        return Picture(depth[0].reshape(shape), normal[0].reshape(*shape, 3), color[0].reshape(*shape, 3),
                       rgba.reshape(*shape, 4), smooth.reshape(*shape, 4), surface[0].reshape(shape),
                       depth.reshape(-1, *shape), transmittance.reshape(-1, *shape), color.reshape(-1, *shape, 3),
                       lit[0].reshape(*shape, len(self.lights)))

    def _take(self, camera: Camera, x: np.ndarray, y: np.ndarray, width: int, height: int, layers: int,
              shadow_samples: int) -> tuple[np.ndarray, ...]:
        """depth, surface, normal, color, lit of each layer (layers, n, ...), transmittance behind it, blended rgba (n,
        4)."""
        n = len(x)
        depth, surface = np.full((layers, n), np.inf), np.full((layers, n), -1, np.int16)
        normal, color = np.zeros((layers, n, 3)), np.zeros((layers, n, 3))
        lit = np.ones((layers, n, len(self.lights)))
        transmittance, rgba = np.ones((layers, n)), np.zeros((n, 4))
        opacity = np.append(self.opacities, 0.0)
        first = 0.0 if camera.orthographic else camera.near
        last = camera.far - camera.near if camera.orthographic else camera.far
        for begin in range(0, n, CHUNK):
            part = np.arange(begin, min(begin + CHUNK, n))
            origin, direction = camera.rays(x[part], y[part], width, height)
            t, owner = self.crossings(origin, direction)
            hidden = (t < first) | (t > last)
            if hidden.any():  # what is clipped goes to the end
                t = np.where(hidden, np.inf, t)
                order = np.argsort(t, axis=1, kind="stable")
                t, owner = np.take_along_axis(t, order, axis=1), np.take_along_axis(owner, order, axis=1)
            left = np.ones(len(part))
            length = np.linalg.norm(direction, axis=1)[:, None]
            for k in range(layers):
                if k < t.shape[1]:
                    hit = np.flatnonzero(np.isfinite(t[:, k]) & (left > 0.0))
                    if not len(hit):
                        transmittance[k:, part] = left
                        break
                    at, whose = part[hit], owner[hit, k]
                    point = origin[hit] + t[hit, k, None] * direction[hit]
                    viewer = -direction[hit] / length[hit]
                    depth[k, at], surface[k, at] = t[hit, k], whose
                    normal[k, at], color[k, at], lit[k, at] = self.shade(whose, point, viewer, shadow_samples)
                    share = left[hit] * opacity[whose]
                    rgba[at] += share[:, None] * np.column_stack([color[k, at], np.ones(len(hit))])
                    left[hit] -= share
                transmittance[k, part] = left
        return depth, surface, normal, color, lit, transmittance, rgba

    def _edges(self, camera: Camera, width: int, height: int, depth: np.ndarray, normal: np.ndarray,
               surface: np.ndarray) -> np.ndarray:
        """Pixels that an outline or a crease of any layer may cross: the surfaces met, or the tangent planes, differ
        within the 3 x 3 pixels around, or between the pixel's centre and its corners."""
        shape = (height, width)
        met = np.zeros(width * height, np.int64)
        for layer in surface:
            met = met * (len(self.surfaces) + 1) + layer + 1
        result = _differs(met.reshape(1, *shape), 0).reshape(shape)
        y, x = np.divmod(np.arange((width + 1) * (height + 1)), width + 1)
        origin, direction = camera.rays(x.astype(float), y.astype(float), width, height)
        corner = np.zeros(len(x), np.int64)
        for begin in range(0, len(x), CHUNK):
            part = slice(begin, begin + CHUNK)
            t, owner = self.crossings(origin[part], direction[part])
            for k in range(len(surface)):
                whose = np.where(np.isfinite(t[:, k]), owner[:, k] + 1, 0) if k < t.shape[1] else 0
                corner[part] = corner[part] * (len(self.surfaces) + 1) + whose
        corner = corner.reshape(height + 1, width + 1)
        centre = met.reshape(shape)
        for dy in range(2):
            for dx in range(2):
                here = corner[dy : dy + height, dx : dx + width]
                if len(surface) == 1 and self.opacities.min() == 1.0:
                    result |= here != centre
                else:  # behind an opaque surface the centre's list ends, the corner's does not
                    result |= (here == 0) != (centre == 0)
        # a depth that the tangent plane does not foresee: the surface's own outline, or a crease
        z, n = depth.reshape(shape), normal.reshape(*shape, 3)
        right, up = camera.matrix[:3, 0], camera.matrix[:3, 1]
        view = (camera.rays(*(np.indices(shape)[::-1].reshape(2, -1) + 0.5), width, height)[1]).reshape(*shape, 3)
        facing = np.einsum("ijk,ijk->ij", n, view)
        for step, axis, size in ((right, 1, (camera.right - camera.left) / width),
                                 (up, 0, (camera.top - camera.bottom) / height)):
            with np.errstate(divide="ignore", invalid="ignore"):
                slope = -size * np.einsum("ijk,k->ij", n, step) / facing * (1.0 if camera.orthographic else z)
                ahead = np.diff(z, axis=axis)
                here = np.delete(slope, -1, axis=axis)
                there = np.delete(slope, 0, axis=axis)
                loose = 0.5 * np.abs(here - there) + 0.02 * np.abs(here) + 1e-9
                odd = np.isfinite(ahead) & (np.abs(ahead - 0.5 * (here + there)) > loose)
            turned = np.einsum("ijk,ijk->ij", np.delete(n, -1, axis=axis), np.delete(n, 0, axis=axis)) < 0.9
            odd |= np.isfinite(ahead) & turned
            pad = [(0, 0), (0, 0)]
            pad[axis] = (0, 1)
            result |= np.pad(odd, pad)
            pad[axis] = (1, 0)
            result |= np.pad(odd, pad)
        return result.ravel()


def _differs(values: np.ndarray, limit: float) -> np.ndarray:
    """(k, h, w) values: does one of the eight around differ by more than limit, in any of k? (h * w)"""
    k, h, w = values.shape
    wide = np.pad(values, ((0, 0), (1, 1), (1, 1)), mode="edge")
    result = np.zeros((h, w), bool)
    for dy in range(3):
        for dx in range(3):
            result |= (np.abs(wide[:, dy : dy + h, dx : dx + w] - values) > limit).any(axis=0)
    return result.ravel()


@dataclass(frozen=True, eq=False)
class Picture:
    """Exact, row 0 at the bottom. At pixel centres, of the first surface: depth (h, w), +inf where nothing is; normal,
    world space, and colour, linear, not premultiplied (h, w, 3); m of each light (h, w, lights). rgba: the layers
    blended, premultiplied, background transparent; smooth: the same, averaged over each pixel's area where an edge
    crosses it (alpha is then its exact coverage). layer_depth, layer_transmittance (behind the layer), layer_color
    (layers, h, w, ...) of the k-th surface along the ray."""

    depth: np.ndarray
    normal: np.ndarray
    color: np.ndarray
    rgba: np.ndarray
    smooth: np.ndarray
    surface: np.ndarray
    layer_depth: np.ndarray
    layer_transmittance: np.ndarray
    layer_color: np.ndarray
    lit: np.ndarray

    def save(self, path: str) -> None:
        np.savez_compressed(path, **asdict(self))

    @staticmethod
    def load(path: str) -> Picture:
        with np.load(path) as arrays:
            return Picture(**{one.name: arrays[one.name] for one in fields(Picture)})
