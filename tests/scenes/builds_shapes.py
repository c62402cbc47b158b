# SPDX-License-Identifier: GPL-3.0-or-later
"""What the scenes of builds_cases.py show: clouds, meshes and images by name, the same numbers in every process. A recipe gives the
arguments of native.Cloud; `analysis`, taken out of them, those of Cloud.analyse."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Recipe = dict[str, Any]
FAR = (431_250.0, 5_391_125.0, 212.0)  # where a survey may lie, meters


def _random(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(seed))


def _torus(count: int, seed: int = 1, major: float = 1.0, minor: float = 0.4) -> tuple[np.ndarray, np.ndarray]:
    """Evenly by area: float64 positions and normals, (count, 3)."""
    random = _random(seed)
    around, along = random.uniform(0, 2 * np.pi, 3 * count), random.uniform(0, 2 * np.pi, 3 * count)
    kept = random.uniform(0, major + minor, 3 * count) < major + minor * np.cos(around)
    around, along = around[kept][:count], along[kept][:count]
    normal = np.stack([np.cos(around) * np.cos(along), np.cos(around) * np.sin(along), np.sin(around)], axis=1)
    return np.stack([major * np.cos(along), major * np.sin(along), 0 * along], axis=1) + minor * normal, normal


def _plane(count: int, half: float, height: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    random = _random(seed)
    position = np.stack([random.uniform(-half, half, count), random.uniform(-half, half, count), np.full(count, height)], axis=1)
    return position, np.tile([0.0, 0.0, 1.0], (count, 1))


def _bytes(position: np.ndarray) -> np.ndarray:
    """Colors that change over space, uint8 (n, 3)."""
    return (127.5 + 127 * np.sin(position * (3.0, 5.0, 7.0) + (0.3, 1.1, 2.0))).astype(np.uint8)


def _f4(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, np.float32)


def torus(count: int, **more: Any) -> Recipe:
    position, normal = _torus(count)
    return {"positions": _f4(position), "normals": _f4(normal), "colors": _bytes(position), **more}


def bare(count: int, **more: Any) -> Recipe:
    return {"positions": _f4(_torus(count, 2)[0]), **more}


def attributes() -> Recipe:
    """Opacities, radii, scalars with some that are no number, classes; colors with 16 bits; a part of the normals is missing."""
    position, normal = _torus(9000, 3)
    random = _random(4)
    normal[random.uniform(size=len(normal)) < 0.1] = 0.0
    scalars = _f4(position[:, :1] * 10)
    scalars[::97] = np.nan
    return {"positions": _f4(position), "normals": _f4(normal), "colors": _bytes(position).astype(np.uint16) * 257,
            "opacities": _f4(0.5 + 0.5 * np.sin(4 * position[:, 2:])), "radii": _f4(random.uniform(0.01, 0.05, (len(position), 1))),
            "scalars": scalars, "classes": (position[:, :1] > 0).astype(np.uint8) * 3 + 2}


def opaque_attributes() -> Recipe:
    recipe = attributes()
    del recipe["opacities"], recipe["radii"]
    return recipe


def linear() -> Recipe:
    """Colors of float32, positions of float64 far from the origin."""
    position, normal = _torus(9000, 5)
    return {"positions": position + FAR, "normals": _f4(normal), "colors": _f4(_bytes(position) / 200.0)}


def moved() -> Recipe:
    recipe = torus(6000)
    return {**recipe, "origin": FAR}


def ground() -> Recipe:
    position, normal = _plane(12000, 2.5, -0.6, 6)
    return {"positions": _f4(position), "normals": _f4(normal), "colors": _bytes(position / 3)}


def rows() -> Recipe:
    """A relief as scan lines leave it, dense along and sparse across."""
    x, y = np.meshgrid(np.linspace(-1.5, 1.5, 400), np.linspace(-1.5, 1.5, 60))
    z = 0.3 * np.sin(3 * x) * np.cos(2 * y)
    return {"positions": _f4(np.stack([x, y, z], axis=-1).reshape(-1, 3))}


def holes() -> Recipe:
    """NaN, infinities, the same place many times over, and a stray far away."""
    position = _torus(4000, 7)[0]
    position[::50] = np.nan
    position[7::91] = (np.inf, 0.0, 0.0)
    position[100:140] = position[99]
    position[200] = (900.0, 0.0, 0.0)
    return {"positions": _f4(position), "colors": _bytes(np.nan_to_num(position, posinf=0.0))}


def scan(**analysis: Any) -> Recipe:
    """A room's floor and wall, a wire, foliage and strays, noisy, seen by two stations; ghosts of one that the other saw through."""
    random = _random(8)
    floor, _ = _plane(9000, 2.0, -0.8, 9)
    wall = np.stack([random.uniform(-2, 2, 7000), np.full(7000, 1.9), random.uniform(-0.8, 1.2, 7000)], axis=1)
    wire = np.stack([np.linspace(-2, 2, 900), np.full(900, 0.4), np.full(900, 0.7)], axis=1)
    leaves = random.normal((-1.0, 0.6, 0.0), 0.25, (3000, 3))
    ghosts = np.stack([random.uniform(0.3, 0.9, 300), np.full(300, 0.9), random.uniform(-0.3, 0.3, 300)], axis=1)
    strays = random.uniform(-2, 2, (40, 3))
    parts = (floor, wall, wire, leaves, ghosts, strays)
    position = np.concatenate(parts) + random.normal(0, 0.003, (sum(map(len, parts)), 3))
    station = random.integers(0, 2, (len(position), 1)).astype(np.uint8)
    named = np.concatenate([np.full(len(part), i) for i, part in enumerate(parts)])
    station[named == 4] = 1
    return {"positions": _f4(position), "colors": _bytes(position), "classes": named.astype(np.uint8)[:, None],
            "scalars": _f4(random.uniform(0, 255, (len(position), 1))),
            "analysis": {"stations": np.array([[0.6, -1.5, 0.0], [-1.2, -1.2, 0.4]]), "station": station, **analysis}}


def gridded() -> Recipe:
    """What a scanner's grid gives: a row and a column of each point."""
    tilt, pan = np.meshgrid(np.linspace(-0.5, 0.5, 120), np.linspace(-0.9, 0.9, 200), indexing="ij")
    row, column = (values.reshape(-1, 1).astype(np.uint16) for values in np.meshgrid(np.arange(120), np.arange(200), indexing="ij"))
    direction = np.stack([np.sin(pan) * np.cos(tilt), np.cos(pan) * np.cos(tilt), np.sin(tilt)], axis=-1).reshape(-1, 3)
    far = np.where(np.abs(direction[:, 0]) < 0.2, 1.2, 2.0) / direction[:, 1]
    position = direction * far[:, None]
    return {"positions": _f4(position), "colors": _bytes(position),
            "analysis": {"stations": np.zeros((1, 3)), "station": np.zeros((len(position), 1), np.uint8), "free_space": True,
                         "grid": (row, column)}}


CLOUDS: dict[str, Callable[[], Recipe]] = {
    "torus": lambda: torus(20000),
    "sparse": lambda: torus(1500),
    "dense": lambda: torus(120000),
    "million": lambda: torus(1_000_000),  # for times
    "analysed": lambda: torus(20000, analysis={}),
    "bare": lambda: bare(12000),
    "bare analysed": lambda: bare(12000, analysis={"keep_normals": False}),
    "wide analysed": lambda: torus(1500, analysis={"neighbours": 8}),
    "attributes": attributes,
    "opaque attributes": opaque_attributes,
    "attributes analysed": lambda: {**attributes(), "analysis": {}},
    "linear": linear,
    "moved": moved,
    "ground": ground,
    "rows": rows,
    "rows analysed": lambda: {**rows(), "analysis": {}},
    "holes": holes,
    "holes analysed": lambda: {**holes(), "analysis": {}},
    "scan": scan,
    "scan seen through": lambda: scan(free_space=True),
    "grid": gridded,
    "one": lambda: {"positions": np.zeros((1, 3), np.float32)},
    "none": lambda: {"positions": np.zeros((0, 3), np.float32)},
}


def _ball(rings: int = 16) -> dict[str, np.ndarray]:
    """Corners of triangles of a ball of radius 0.5: positions, normals, colors, uv, float32."""
    u, v = np.meshgrid(np.linspace(0, 1, 2 * rings + 1), np.linspace(0, 1, rings + 1), indexing="ij")
    normal = np.stack([np.cos(2 * np.pi * u) * np.sin(np.pi * v), np.sin(2 * np.pi * u) * np.sin(np.pi * v), -np.cos(np.pi * v)], axis=-1)
    corners = []
    for values in (normal, np.stack([u, v], axis=-1)):
        a, b, c, d = values[:-1, :-1], values[1:, :-1], values[1:, 1:], values[:-1, 1:]
        corners.append(np.stack([a, b, c, a, c, d], axis=2).reshape(-1, values.shape[-1]))
    normal, uv = corners
    return {"positions": _f4(0.5 * normal), "normals": _f4(normal), "colors": _f4(0.5 + 0.5 * normal), "uv": _f4(uv)}


def _quad() -> dict[str, np.ndarray]:
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]], float)
    position = np.stack([3 * uv[:, 0] - 1.5, 0 * uv[:, 0], 3 * uv[:, 1] - 1.5], axis=1)
    return {"positions": _f4(position), "uv": _f4(2 * uv - 0.5)}


def meshes(name: str) -> dict[str, np.ndarray | None]:
    """Arguments of native.Mesh."""
    given = _quad() if name == "quad" else _ball()
    if name == "flat ball":
        given = {"positions": given["positions"]}
    return {"normals": None, "colors": None, **given}


def texture(name: str) -> tuple[np.ndarray, bool, bool, str]:
    """Arguments of native.Texture: a name is "byte" or "float", its filter "near" where it says so, and how it goes on beyond."""
    y, x = np.mgrid[0:48, 0:80] / 48.0
    pixels = np.stack([0.5 + 0.5 * np.sin(20 * x), 0.5 + 0.5 * np.cos(15 * y), x / 2, (np.sin(9 * x) * np.sin(9 * y) > -0.2) * (1 - y / 2)], -1)
    wrap = next(kind for kind in ("REPEAT", "EXTEND", "CLIP") if kind.lower() in name)
    pixels = (255 * pixels).astype(np.uint8) if "byte" in name else _f4(pixels * (2, 1, 1, 1))
    return np.ascontiguousarray(pixels), "raw" in name, "near" in name, wrap
