# SPDX-License-Identifier: GPL-3.0-or-later
"""What a camera would see of a scene, exactly; what of it was scanned; and both kept in files under a name that changes with
whatever makes them."""

from __future__ import annotations

import functools
import hashlib
import os
import re
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from ..camera import Camera, look
from . import scanner
from .rays import ROOT, SOURCES
from .scanner import LOWEST, Scan
from .scenes import FOV, HEIGHT, SKY, STEP, WIDTH, Scene, View
from .solids import World, linear

CACHE = Path(os.environ.get("PATINA_TRUTH_CACHE", ROOT / "build/out/truth-cache"))
REACH = 1.5  # sample intervals within which a place counts as scanned
OBLIQUE = 0.1  # least cosine that widens an interval along the surface
INSIDE = np.array([(0.5, 0.5), (0.125, 0.375), (0.375, 0.875), (0.625, 0.125), (0.875, 0.625)])  # rays of a pixel
ROWS = 80  # traced at once


@dataclass(eq=False)
class Exact:
    """A view, row 0 at the bottom. near, middle, far (h, w) float32: depth of the nearest, the central, the farthest of
    a pixel's rays, inf for the sky; a pane counts as nearest alone, so that neither it nor what is behind is wrong; color (h, w, 3) linear, the mean over the pixel; surface (h, w) of the central
    ray, -1 for the sky; sky: no ray meets anything; thin: a bar, wire or leaf; scanned: see SPEC; ceiling (h, w, 3) sRGB
    bytes: the colour of the nearest sample of that surface."""

    near: np.ndarray
    middle: np.ndarray
    far: np.ndarray
    color: np.ndarray
    surface: np.ndarray
    sky: np.ndarray
    thin: np.ndarray
    scanned: np.ndarray
    ceiling: np.ndarray


def camera(view: View, step: float = 0.0, width: int = WIDTH, height: int = HEIGHT) -> Camera:
    """step: metres to the right, for the second frame of a pair."""
    found = look(np.asarray(view.eye, float), np.asarray(view.target, float), FOV, width / height)
    matrix = found.matrix.copy()
    matrix[:3, 3] += step * matrix[:3, 0]
    return replace(found, matrix=matrix, near=0.05, far=500.0)


def _by_grid(scan: Scan, eyes: np.ndarray, step: float, place: np.ndarray, fits: Callable[[np.ndarray, np.ndarray], np.ndarray]
             ) -> np.ndarray:
    """Nearest fitting sample of each place among the 3×3 cells around it in every station's grid, else -1."""
    best, found = np.full(len(place), np.inf), np.full(len(place), -1, np.int64)
    for number, eye in enumerate(eyes):
        rows, columns = scan.shape[number]
        mine = np.flatnonzero(scan.scan == number)
        table = np.full((rows, columns), -1, np.int64)
        table[scan.row[mine], scan.column[mine]] = mine
        way = place - eye
        turn = np.degrees(np.arctan2(way[:, 1], way[:, 0])) / step - 0.37 * number
        rise = (np.degrees(np.arctan2(way[:, 2], np.hypot(way[:, 0], way[:, 1]))) - LOWEST) / step
        c, r = np.rint(turn).astype(np.int64), np.rint(rise).astype(np.int64)
        for dr in (-1, 0, 1):
            for dc in (-1, 0, 1):
                row = r + dr
                inside = (row >= 0) & (row < rows)
                sample = np.where(inside, table[np.where(inside, row, 0), (c + dc) % columns], -1)
                _better(scan, place, sample, fits, best, found)
    return found


def _better(scan: Scan, place: np.ndarray, sample: np.ndarray, fits: Callable[[np.ndarray, np.ndarray], np.ndarray],
            best: np.ndarray, found: np.ndarray) -> None:
    at = np.flatnonzero(sample >= 0)
    sample = sample[at]
    off = place[at] - scan.true_position[sample]
    away, along = np.linalg.norm(off, axis=1), np.einsum("ij,ij->i", off, scan.beam[sample])
    reach = REACH * scan.interval[sample]
    good = (away * away - along * along <= reach * reach) & (away * np.maximum(scan.cosine[sample], OBLIQUE) <= reach)
    good &= (away < best[at]) & fits(at, sample)
    best[at[good]], found[at[good]] = away[good], sample[good]


def _by_tree(scan: Scan, tree: cKDTree, place: np.ndarray, fits: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
    best, found = np.full(len(place), np.inf), np.full(len(place), -1, np.int64)
    most = REACH * float(np.quantile(scan.interval / np.maximum(scan.cosine, OBLIQUE), 0.99))
    _, near = tree.query(place, k=8, distance_upper_bound=most, workers=-1)
    for k in range(near.shape[1]):
        _better(scan, place, np.where(near[:, k] < len(scan), near[:, k], -1), fits, best, found)
    return found


def picture(world: World, scan: Scan, scene: Scene, seen: Camera, tree: cKDTree | None = None, width: int = WIDTH,
            height: int = HEIGHT) -> Exact:
    sky = linear(np.array(SKY)).astype(np.float32)
    shape = height, width
    out = Exact(np.full(shape, np.inf, np.float32), np.full(shape, np.inf, np.float32), np.full(shape, -np.inf, np.float32),
                np.zeros((*shape, 3), np.float32), np.full(shape, -1, np.int32), np.zeros(shape, bool), np.zeros(shape, bool),
                np.zeros(shape, bool), np.zeros((*shape, 3), np.uint8))
    for begin in range(0, height, ROWS):
        rows = slice(begin, min(begin + ROWS, height))
        y, x = np.mgrid[rows, 0:width]
        for k, (dx, dy) in enumerate(INSIDE):
            origin, direction = seen.rays((x + dx).ravel(), (y + dy).ravel(), width, height)
            t, triangle = world.rays.trace(np.array(origin[0]), direction)
            out.near[rows] = np.minimum(out.near[rows], t.reshape(x.shape).astype(np.float32))
            if world.clear is not world.rays:  # a camera sees what is behind a pane
                t, triangle = world.clear.trace(np.array(origin[0]), direction)
                triangle = np.where(triangle >= 0, world.solid[triangle], -1)
            hit = np.flatnonzero(triangle >= 0)
            tri, place = triangle[hit], origin[0] + t[hit, None] * direction[hit]
            z = t.reshape(x.shape).astype(np.float32)
            out.far[rows] = np.maximum(out.far[rows], z)
            if k == 0:
                out.middle[rows] = z
                surface = np.full(len(t), -1, np.int32)
                surface[hit] = world.surface[tri]
                normal = world.normal[tri] * -np.sign(np.einsum("ij,ij->i", world.normal[tri], direction[hit]))[:, None]
                thin = world.thin[surface[hit]]

                def fits(at: np.ndarray, sample: np.ndarray, surface=surface[hit], normal=normal, thin=thin) -> np.ndarray:
                    facing = np.einsum("ij,ij->i", normal[at], scan.normal[sample]) > 0.2
                    return (scan.surface[sample] == surface[at]) & (thin[at] | facing)

                eyes = np.asarray(scene.survey.stations)
                found = _by_grid(scan, eyes, scene.survey.step, place, fits) if len(scan.stations) and hasattr(scene.survey, "step") \
                    else _by_tree(scan, tree or cKDTree(scan.true_position), place, fits)
                flat = [np.zeros(len(t), bool), np.zeros(len(t), bool), np.zeros((len(t), 3), np.uint8)]
                flat[0][hit], flat[1][hit] = thin, found >= 0
                flat[2][hit] = np.where((found >= 0)[:, None], scan.color[np.maximum(found, 0)], 0)
                out.surface[rows] = surface.reshape(x.shape)
                out.thin[rows], out.scanned[rows] = flat[0].reshape(x.shape), flat[1].reshape(x.shape)
                out.ceiling[rows] = flat[2].reshape(*x.shape, 3)
            else:
                rgb = np.broadcast_to(sky, (len(t), 3)).copy()
                rgb[hit] = world.rays.albedo(place, tri)
                out.color[rows] += rgb.reshape(*x.shape, 3) / np.float32(len(INSIDE) - 1)
        out.sky[rows] = np.isinf(out.near[rows])
    return out


# ---- what is kept ------------------------------------------------------------------------------------------------


def meaning(path: Path) -> str:
    """A source without its comments and layout, which make no difference."""
    return "".join(re.sub(r"//[^\n]*" if path.suffix != ".py" else r"#[^\n]*", "", path.read_text()).split())


@functools.cache
def _sources() -> str:
    here = Path(__file__).resolve().parent
    paths = (*SOURCES, *(here / f"{name}.py" for name in ("solids", "places", "scanner", "exact", "campaign", "worlds",
                                                          "worlds_held")))
    return hashlib.sha256("\n".join(meaning(path) for path in paths).encode()).hexdigest()


def _kept(kind: type, name: str, key: str, make: Callable[[], object]) -> object:
    path = CACHE / f"{name}-{hashlib.sha256((_sources() + key).encode()).hexdigest()[:12]}.npz"
    if path.is_file():
        with np.load(path) as arrays:
            return kind(**{one.name: arrays[one.name] for one in fields(kind)})
    made = make()
    CACHE.mkdir(parents=True, exist_ok=True)
    for old in CACHE.glob(f"{name}-????????????.npz") if "PATINA_TRUTH_CACHE" not in os.environ else ():
        old.unlink(missing_ok=True)  # in a folder of one's own
    partial = path.with_suffix(f".{os.getpid()}.npz")
    np.savez(partial, **{one.name: getattr(made, one.name) for one in fields(kind)})
    partial.replace(path)
    return made


class Stage:
    """A scene with its scan and exact views, made when they are asked for."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._world: World | None = None
        self._tree: cKDTree | None = None
        self._key = repr((scene.name, scene.survey, scene.seed))
        self.scan: Scan = _kept(Scan, f"{scene.name}-scan", self._key,
                                lambda: scanner.scan(self.world, scene.survey, scene.seed))

    @property
    def world(self) -> World:
        if self._world is None:
            self._world = self.scene.make().world()
        return self._world

    def _picture(self, view: View, step: float) -> Exact:
        if self._tree is None and not len(self.scan.stations):
            self._tree = cKDTree(self.scan.true_position)
        return picture(self.world, self.scan, self.scene, camera(view, step), self._tree)

    def view(self, index: int, moved: bool = False) -> Exact:
        view, step = self.scene.views[index], STEP if moved else 0.0
        return _kept(Exact, f"{self.scene.name}-{index}{'m' * moved}", self._key + repr((view.eye, view.target, step, WIDTH,
                     HEIGHT, FOV, SKY)), lambda: self._picture(view, step))
