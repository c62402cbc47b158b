# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of [D Table 3]: its six scenes at 1024 x 1024, its columns, our frames a second beside the printed ones.

What is in ../shared/data is taken from there, the rest is generated in the printed sizes; the table says which."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from stage import ROOT, Stage, kept
from truth import look
from truth.surfaces import Torus

DATA = ROOT.parent / "shared/data"
MODES = ("surface", "3 layers", "6 layers", "shadows 1", "shadows 5", "shadows 10")
COLUMNS = ("local light", "3 layers", "6 layers", "1 shadow sample", "5", "10")


@dataclass(frozen=True)
class Printed:
    points: int
    fps: tuple[float, ...]  # by column, GTX 260


TABLE = {
    "Blade": Printed(882_954, (52, 17.5, 8.8, 25, 9, 5)),
    "Happy Buddha": Printed(543_652, (64, 22, 11, 39, 14, 7)),
    "Dragon": Printed(437_645, (68, 23, 12, 49, 17, 9)),
    "3 nested tori": Printed(6_000_000, (8, 2.7, 1.4, 3.7, 1.1, 0.6)),
    "Neghip": Printed(128_000, (82, 27, 14, 64, 35, 22)),
    "Hydrogen": Printed(535_000, (48, 15, 8, 31, 14, 7.5)),
}


def cases(device: str, quick: bool) -> list[dict[str, Any]]:
    return [{"group": "papers", "scene": name, "paper": name, "mode": mode, "device": device, "width": 1024,
             "height": 1024, "points": printed.points, "density": 0, "quality": quality, "threads": 0,
             "frames": 12 if quick else 24}
            for name, printed in TABLE.items()
            for mode in (MODES[:1] if quick else MODES)
            for quality in (("paper",) if quick else ("paper", "refined"))]


# ---- clouds --------------------------------------------------------------------------------------------------------


def _dragon(count: int) -> dict[str, np.ndarray] | None:
    path = DATA / "stanford/dragon_range_union/dragon_ranges_registered.ply"
    if not path.is_file():
        return None
    import native

    with native.File(str(path)) as file:
        position, normal = file.positions(), file.normals()
    chosen = np.random.default_rng(1).permutation(len(position))[:count]
    upright = [0, 2, 1]  # y is up in the file
    return {name: np.ascontiguousarray(array[chosen][:, upright] * np.float32([1, -1, 1]))
            for name, array in (("position", position), ("normal", normal))}


def _volume(name: str) -> tuple[np.ndarray, float]:
    """A 64^3 field and its level: the volume of the paper where it is there, else one like it."""
    files = {"Neghip": ("neghip_64x64x64_uint8.raw", np.uint8, 60.0),
             "Hydrogen": ("hydrogen_pyvista_64x64x64_float32.raw", np.float32, 0.05)}
    file, kind, level = files[name]
    path = DATA / "volumes" / file
    if path.is_file():
        return np.fromfile(path, kind).reshape(64, 64, 64).astype(np.float64), level
    x, y, z = np.meshgrid(*[np.linspace(-1.0, 1.0, 64)] * 3, indexing="ij")
    if name == "Hydrogen":  # density of the orbital 3d z^2
        r = np.sqrt(x * x + y * y + z * z)
        density = (3.0 * z * z - r * r) ** 2 * np.exp(-8.0 * r)
        return density / density.max(), 0.05
    field = np.zeros_like(x)
    for cx, cy, cz, charge in np.random.default_rng(5).uniform(-0.7, 0.7, (24, 4)):
        field += (0.4 + abs(charge)) * np.exp(-40.0 * ((x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2))
    return field / field.max(), 0.25


def _gyroid() -> tuple[np.ndarray, float]:
    """A 128^3 field: sheets in all directions within a ball."""
    x, y, z = np.meshgrid(*[np.linspace(-1.0, 1.0, 128)] * 3, indexing="ij")
    s, c = [np.sin(6.0 * axis) for axis in (x, y, z)], [np.cos(6.0 * axis) for axis in (x, y, z)]
    field = s[0] * c[1] + s[1] * c[2] + s[2] * c[0]
    return np.maximum(np.abs(field) - 0.3, 4.0 * (x * x + y * y + z * z - 0.9)), 0.0


def _isosurface(field: np.ndarray, level: float, count: int) -> dict[str, np.ndarray]:
    """Points uniform in area on the level's triangles, within [-1, 1]^3, normals from the field."""
    from skimage.measure import marching_cubes

    corner, face, normal, _ = marching_cubes(field, level)
    corner = corner * 2.0 / (len(field) - 1) - 1.0
    random = np.random.default_rng(2)
    a, b, c = (corner[face[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    chosen = random.choice(len(face), count, p=area / area.sum())
    u, v = random.random((2, count, 1))
    flip = u + v > 1.0
    u, v = np.where(flip, 1.0 - u, u), np.where(flip, 1.0 - v, v)

    def mixed(at: np.ndarray) -> np.ndarray:
        p, q, r = (at[face[chosen, k]] for k in range(3))
        return p + u * (q - p) + v * (r - p)

    return {"position": mixed(corner).astype(np.float32), "normal": mixed(normal).astype(np.float32)}


def _tori(count: int) -> dict[str, np.ndarray]:
    """As many points on each of the three."""
    random = np.random.default_rng(1)
    parts = [Torus(tube=tube).sample(count // 3, random) for tube in (0.4, 0.25, 0.1)]
    return {key: np.concatenate([part[k] for part in parts]).astype(np.float32)
            for k, key in enumerate(("position", "normal"))}


def origin_of(name: str) -> str:
    """What the scene's points are, for the table."""
    if name == "Dragon" and (DATA / "stanford/dragon_range_union").is_dir():
        return "the scans"
    if name in ("Neghip", "Hydrogen"):
        return "the volume's isosurface" if (DATA / "volumes").is_dir() else "isosurface of a field like it"
    return "as printed" if name == "3 nested tori" else "generated: a gyroid"


def stage(name: str) -> Stage:
    count = TABLE[name].points

    def make() -> dict[str, np.ndarray]:
        if name == "3 nested tori":
            return _tori(count)
        if name in ("Neghip", "Hydrogen"):
            return _isosurface(*_volume(name), count)
        return (_dragon(count) if name == "Dragon" else None) or _isosurface(*_gyroid(), count)

    closed = name == "3 nested tori" or origin_of(name) == "the scans"
    arrays = kept(f"paper-{name.replace(' ', '-')}-{origin_of(name).split(':')[0].replace(' ', '-')}", make)
    position, normal = arrays["position"], arrays["normal"]
    low, high = position.min(axis=0).astype(float), position.max(axis=0).astype(float)
    centre, size = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))

    def camera(turn: float):
        a, rise = np.radians(turn + 20.0), np.radians(20.0)
        back = np.array([np.sin(a) * np.cos(rise), -np.cos(a) * np.cos(rise), np.sin(rise)])
        one = look(centre + 1.9 * size * back, centre)
        return type(one)(**{**vars(one), "near": 0.1 * size, "far": 10.0 * size})

    sun = {"type": 1, "power": np.pi, "direction": [-0.36, 0.48, -0.8]}
    style = {"lighting": 2, "cull_back": int(closed)}
    return Stage(position, normal, None, size / np.sqrt(count), camera, style, (sun,))


# ---- the table -----------------------------------------------------------------------------------------------------


def ratios(result: dict[str, Any], quality: str) -> dict[tuple[str, str], tuple[float, float, float]]:
    """(scene, mode) -> printed fps, ours, ratio."""
    found = {}
    for row, detail in zip(result["rows"], result["details"]):
        if detail["group"] == "papers" and row["quality"] == quality:
            printed = TABLE[row["scene"]].fps[MODES.index(row["mode"])]
            ours = 1000.0 / row["ms_median"]
            found[row["scene"], row["mode"]] = printed, ours, ours / printed
    return found


def table(result: dict[str, Any], quality: str) -> str:
    cells = ratios(result, quality)
    head = ["scene", "points", "ours", *COLUMNS]
    body = []
    for name, printed in TABLE.items():
        line = [name, f"{printed.points:,}", origin_of(name)]
        for mode, fps in zip(MODES, printed.fps):
            cell = cells.get((name, mode))
            line.append(f"{fps:g} → {cell[1]:.1f} (**{cell[2]:.2f}×**)" if cell else f"{fps:g} → –")
        body.append(line)
    means = []
    for mode in MODES:
        values = [cell[2] for (_, one), cell in cells.items() if one == mode]
        means.append(f"{np.exp(np.mean(np.log(values))):.2f}×" if values else "–")
    body.append(["geometric mean", "", "", *means])
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in body])


def markdown(result: dict[str, Any]) -> str:
    text = ["## [D Table 3]: frames a second on a GTX 260 → ours", "",
            "1024×1024. A dash is a mode that is not built yet, or not in this run."]
    for quality, title in (("paper", "The paper's settings, one iteration of each filter"),
                           ("refined", "Our defaults")):
        if ratios(result, quality):
            text += ["", f"### {title}", "", table(result, quality)]
    return "\n".join(text)
