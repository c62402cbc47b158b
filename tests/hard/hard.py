# SPDX-License-Identifier: GPL-3.0-or-later
"""The hard cases (SPEC 9), each on each device, against float64: what is off, by how much, and whether that is within
the limit that the case states. What the library cannot do yet is in the table too.

    hard.py [--device NAME]... [--library libpatina.so] [--programs FOLDER]

Ends with "N passed, N failed, N skipped"; the cases that are not built yet are the skipped ones. --programs: where the
C tests lie that stand for cases which need more than the binding gives (ids, layers to the last bit)."""

from __future__ import annotations

import argparse
import ctypes
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "tests")]

from native.abi import SOFT, SOFT_MODEL  # noqa: E402
from truth import Camera, Light, Scene, look, orbit  # noqa: E402
from truth.surfaces import Rectangle, Sphere  # noqa: E402

import native  # noqa: E402

EMPTY = 0x7F800000FFFFFFFF
DEVICES = ("cpu", "cpu-scalar", "cpu-sse42", "cpu-avx2", "cpu-avx512", "gl-egl", "gl-osmesa")
ULP = 2.0**-24  # unit roundoff of float32


@dataclass(frozen=True)
class Verdict:
    case: str
    device: str
    error: str  # with its unit, and the limit
    verdict: str  # "holds", "FAILS", "not built yet", or why it could not be tried


@dataclass(frozen=True, eq=False)
class Shown:
    depth: np.ndarray
    rgba: np.ndarray
    source: np.ndarray
    keys: np.ndarray


CASES: list[tuple[str, Callable[[native.Device], tuple[str, bool]]]] = []

# what SPEC 9 names beyond today's library -> what it needs
NOT_BUILT: dict[str, str] = {}

# what C tests hold against the float64 reference, key by key -> program, test
IN_C = {
    "two surfaces d_eff ± 8 ulp apart": ("test_layers", "test_two_surfaces"),
    "ids at 2³² − 2": ("test_ids", "test_last_id"),
    "4294 instances of a million points": ("test_ids", "test_instances_of_a_million"),
    "cloud, object or camera at 5·10⁶: bit-equal pictures": ("test_precision", "test_far_from_origin"),
}


def hard(name: str) -> Callable:
    def add(function: Callable) -> Callable:
        CASES.append((name, function))
        return function
    return add


# ---- drawing -------------------------------------------------------------------------------------------------------


def draw(device: native.Device, clouds: list[native.Cloud], camera: Camera, width: int, height: int,
         lights: tuple[Light, ...] = (), style: dict[str, Any] | None = None, effects: dict[str, Any] | None = None,
         **settings: Any) -> Shown:
    scene = native.Scene()
    scene.set_effects(**(effects or {}))
    for cloud in clouds:
        scene.add_cloud(cloud, **(style or {}))
    for light in lights:
        scene.add_light(**light.fields())
    scene.set_camera(**camera.fields())
    scene.set_settings(width=width, height=height, film_transparent=1, **settings)
    frame = native.Frame(device)
    frame.render(scene)
    keys = np.empty((height, width), np.uint64)
    call = native.library().patina_frame_read_keys
    call.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t)
    if call(frame._handle, keys.ctypes.data, keys.nbytes):
        raise native.PatinaError("the keys cannot be read")
    return Shown(frame.read("DEPTH")[..., 0], frame.read("COMBINED"), frame.read("SOURCE")[..., 0], keys)


def cloud_of(position: np.ndarray, normal: np.ndarray | None = None, color: np.ndarray | None = None) -> native.Cloud:
    return native.Cloud(*(np.ascontiguousarray(one) if one is not None else None for one in (position, normal, color)))


OFF = {"fill": 2, "smooth": 3, "antialias": 2}  # measured pixels alone


def projected(shown: Shown, camera: Camera, world: np.ndarray, width: int, height: int, margin: float = 1e-3
              ) -> dict[str, float]:
    """Measured pixels against float64: worst z error (world units, and as a share of z), how far the true place of a
    shown point lies outside its pixel, by how much a nearer point was missed, pixels that should show a point and do
    not, and ids or depths that cannot be."""
    at = camera.project(world, width, height)
    first = 0.0 if camera.orthographic else camera.near
    last = camera.far - camera.near if camera.orthographic else camera.far
    with np.errstate(invalid="ignore"):
        cell = np.floor(at[:, :2])
        sure = ((at[:, :2] - cell > margin) & (cell + 1.0 - at[:, :2] > margin)).all(axis=1)
        sure &= (cell >= 0).all(axis=1) & (cell[:, 0] < width) & (cell[:, 1] < height)
        sure &= (at[:, 2] > first * (1.0 + 1e-6)) & (at[:, 2] < last * (1.0 - 1e-6))
    nearest = np.full((height, width), np.inf)
    x, y = cell[sure].astype(int).T
    np.minimum.at(nearest, (y, x), at[sure, 2])
    full = shown.keys != EMPTY
    ids = (shown.keys & np.uint64(0xFFFFFFFF)).astype(np.int64)
    wrong = int((full & (ids >= len(world))).sum() + (full & ~np.isfinite(shown.depth)).sum())
    rows, columns = np.nonzero(full & (ids < len(world)))
    true = at[ids[rows, columns]]
    z = shown.depth[rows, columns].astype(np.float64)
    outside = np.maximum(np.maximum(np.stack([columns, rows], 1) - true[:, :2], true[:, :2] - np.stack(
        [columns, rows], 1) - 1.0), 0.0)
    late = true[:, 2] - nearest[rows, columns]
    return {"pixels": len(rows), "z": float(np.abs(z - true[:, 2]).max(initial=0.0)),
            "share": float((np.abs(z - true[:, 2]) / np.maximum(true[:, 2], 1e-300)).max(initial=0.0)),
            "stray": float(outside.max(initial=0.0)),
            "late": float(np.where(np.isfinite(late), late, 0.0).max(initial=0.0)),
            "missed": int((~full & np.isfinite(nearest)).sum()), "wrong": wrong}


def sane(shown: Shown) -> str:
    """What in a picture cannot be, or ""."""
    full = shown.keys != EMPTY
    if not np.isfinite(shown.rgba).all() or (shown.rgba < 0.0).any() or (shown.rgba[..., 3] > 1.00001).any():
        return "colours are not finite, or beyond 0..1 in alpha"
    if not (np.isfinite(shown.depth) == full).all() or (shown.depth[full] < 0.0).any():
        return "depth is not finite where something is"
    return ""


def checked(error: dict[str, float], z: float, unit: str = "z", stray: float = 1e-3, late: float | None = None
            ) -> tuple[str, bool]:
    """The line and verdict of projected()."""
    late = 2.0 * z if late is None and unit == "z" else late
    holds = (error[unit] <= z and error["stray"] <= stray and not error["missed"] and not error["wrong"]
             and error["pixels"] > 100 and (late is None or error["late"] <= late))
    what = "depth" if unit == "z" else "depth as a share"
    return (f"{what} {error[unit]:.1e} (≤ {z:.1e}), stray {error['stray']:.1e} px (≤ {stray:g}), "
            f"missed {error['missed']} of {error['pixels']}", holds)


def same(name: str, value: float, limit: float, shown: Shown | None = None) -> tuple[str, bool]:
    problem = sane(shown) if shown else ""
    return f"{name} {value:.3g} (≤ {limit:g})" + (f"; {problem}" if problem else ""), value <= limit and not problem


# ---- far, wide, deep -----------------------------------------------------------------------------------------------


@hard("origin at 5·10⁶, 1 mm detail")
def far_origin(device: native.Device) -> tuple[str, bool]:
    random = np.random.default_rng(1)
    place = np.array([5e6, 4e6, 300.0])
    world = place + np.rint(random.uniform(-1.0, 1.0, (20_000, 3)) * 1000.0) / 1000.0
    camera = look(place + [0.3, -3.0, 2.0], place)
    shown = draw(device, [cloud_of(world)], camera, 400, 300, **OFF)
    return checked(projected(shown, camera, world, 400, 300), 1e-6)


@hard("16 km extent, 1 mm detail")
def wide(device: native.Device) -> tuple[str, bool]:
    random = np.random.default_rng(2)
    world = random.uniform([-8000, -8000, 0], [8000, 8000, 40], (40_000, 3))
    world[:20_000] = np.rint(random.uniform([7990, 7990, 0], [7994, 7994, 0.1], (20_000, 3)) * 1000.0) / 1000.0
    worst: dict[str, float] = {}
    for eye, target, size in (((7980.0, 7980.0, 9.0), (7992.0, 7992.0, 0.0), 512),
                              ((10.0, -20.0, 15000.0), (0.0, 0.0, 0.0), 512)):
        camera = look(np.array(eye), np.array(target), 60.0)
        camera = Camera(**{**vars(camera), "near": 1.0, "far": 16384.0})
        one = projected(draw(device, [cloud_of(world)], camera, size, size, **OFF), camera, world, size, size, 0.01)
        worst = {key: max(value, worst.get(key, 0)) for key, value in one.items()}
    return checked(worst, 1e-3, stray=0.01)


def decades(parts: int) -> np.ndarray:
    random = np.random.default_rng(3)
    z = 10.0 ** (-3.0 + 7.0 * (np.arange(28_000) // 4000 + random.random(28_000)) / 7.0)
    return np.stack([z * random.uniform(-0.45, 0.45, len(z)), z * random.uniform(-0.45, 0.45, len(z)), -z], axis=1)


def deep_view(device: native.Device, clouds: int) -> tuple[str, bool]:
    world = decades(clouds)
    camera = look(np.zeros(3), np.array([0.0, 0.0, -1.0]), 53.13)
    camera = Camera(**{**vars(camera), "near": 1e-3, "far": 1e4})
    shown = draw(device, [cloud_of(part) for part in np.split(world, clouds)], camera, 256, 256, **OFF)
    return checked(projected(shown, camera, world, 256, 256), 8e-6, "share")


@hard("far/near = 10⁷, a cloud a decade")
def deep(device: native.Device) -> tuple[str, bool]:
    return deep_view(device, 7)


@hard("far/near = 10⁷, one cloud")
def deep_one(device: native.Device) -> tuple[str, bool]:
    return deep_view(device, 1)


@hard("points on and behind the camera plane")
def camera_plane(device: native.Device) -> tuple[str, bool]:
    random = np.random.default_rng(4)
    world = random.uniform(-1.0, 1.0, (20_000, 3))
    world[:600, 2] = np.tile([0.0, 1e-30, -1e-30], 200)
    world[0] = 0.0
    camera = look(np.zeros(3), np.array([0.0, 0.0, -1.0]), 90.0, 200 / 120)
    camera = Camera(**{**vars(camera), "near": 0.01, "far": 10.0})
    shown = draw(device, [cloud_of(world)], camera, 200, 120, **OFF)
    return checked(projected(shown, camera, world, 200, 120), 8 * ULP)


@hard("orthographic scale 10⁻⁶ and 10⁶, near = −far")
def scales(device: native.Device) -> tuple[str, bool]:
    worst: dict[str, float] = {}
    for scale in (1e-6, 1e6):
        world = np.random.default_rng(5).uniform(-0.55, 0.55, (20_000, 3)) * scale
        camera = look(np.array([0.1, -0.2, 0.3]) * scale, np.zeros(3))
        half = 0.5 * scale
        camera = Camera(camera.matrix, -half, half, -half, half, -2.0 * scale, 2.0 * scale, True)
        one = projected(draw(device, [cloud_of(world)], camera, 256, 256, **OFF), camera, world, 256, 256)
        one["z"] /= scale
        one["late"] /= scale
        worst = {key: max(value, worst.get(key, 0)) for key, value in one.items()}
    return checked(worst, 20 * ULP)


# ---- nonsense, and next to nothing ---------------------------------------------------------------------------------


def ball(count: int = 6000, seed: int = 6) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    position, normal = Sphere().sample(count, np.random.default_rng(seed))
    return position.astype(np.float32), normal.astype(np.float32), np.full((count, 3), 0.5, np.float32)


VIEW = look(np.array([0.3, -2.75, 2.25]), np.zeros(3))
SUN = Light(power=3.0, towards=np.array([0.36, -0.48, 0.8]))


@hard("NaN and Inf in positions, normals, colours")
def not_numbers(device: native.Device) -> tuple[str, bool]:
    position, normal, color = ball()
    for k, bad in enumerate((np.nan, np.inf, -np.inf, 1e30, 3e38)):
        if k < 3:
            position[k::35, k % 3] = bad
        normal[k + 5 :: 31, k % 3] = bad
        color[k + 11 :: 29, k % 3] = bad
    good = np.isfinite(position).all(axis=1)
    shown = draw(device, [cloud_of(position, normal, color)], VIEW, 120, 120, (SUN,), {"lighting": 2})
    measured = draw(device, [cloud_of(position, normal, color)], VIEW, 120, 120, **OFF)
    error = projected(measured, VIEW, np.where(good[:, None], position.astype(np.float64), 1e300), 120, 120)
    text, holds = checked(error, 1e-6)
    problem = sane(shown)
    return text + (f"; {problem}" if problem else ""), holds and not problem


@hard("zero normals")
def zero_normals(device: native.Device) -> tuple[str, bool]:
    position, normal, _ = ball(60_000)
    normal[:] = 0.0
    shown = draw(device, [cloud_of(position, normal)], VIEW, 200, 200, (SUN,), {"lighting": 2, "cull_back": 1})
    exact = Scene((Sphere(),)).picture(VIEW, 200, 200, antialias=0)
    inside = np.isfinite(exact.depth)
    return same("open pixels", float((inside & ~np.isfinite(shown.depth)).sum()), 0.0, shown)


@hard("all points coincident")
def coincident(device: native.Device) -> tuple[str, bool]:
    shown = draw(device, [cloud_of(np.tile(np.float32([0.125, 0.0, 0.0]), (5000, 1)))], VIEW, 67, 45)
    full = shown.keys != EMPTY
    wrong = abs(int(full.sum()) - 1) + int((shown.keys[full] & np.uint64(0xFFFFFFFF)).sum())
    return same("pixels but one, ids but 0:", wrong, 0.0, shown)


@hard("one point")
def one_point(device: native.Device) -> tuple[str, bool]:
    world = np.array([[0.2, 0.1, -0.3]])
    shown = draw(device, [cloud_of(world)], VIEW, 67, 45)
    at = VIEW.project(world, 67, 45)[0]
    full = np.argwhere(shown.keys != EMPTY)
    wrong = abs(len(full) - 1) or int((full[0] != np.floor(at[1::-1])).any())
    return same("pixels at a wrong place", wrong, 0.0, shown)


@hard("no points")
def nothing(device: native.Device) -> tuple[str, bool]:
    empty, unreal = np.zeros((0, 3), np.float32), np.full((3, 3), np.nan, np.float32)
    shown = draw(device, [cloud_of(empty), cloud_of(unreal)], VIEW, 67, 45)
    return same("pixels", float((shown.keys != EMPTY).sum() + (shown.rgba != 0).sum()), 0.0, shown)


@hard("1×1 and 16384×1 images")
def sizes(device: native.Device) -> tuple[str, bool]:
    position, _, _ = ball(40_000)
    world = position.astype(np.float64)
    missed, off = 0, 0.0
    for width, height in ((1, 1), (16384, 1), (1, 16384)):
        camera = Camera(**{**vars(VIEW), "left": -0.2, "right": 0.2, "bottom": -0.2, "top": 0.2})
        shown = draw(device, [cloud_of(position)], camera, width, height, **OFF)
        error = projected(shown, camera, world, width, height, 0.02)
        missed += error["missed"] + error["wrong"]
        off = max(off, error["z"], 1e-6 if error["stray"] > 0.02 else 0.0)
    return f"depth {off:.1e} (≤ 1e-06), missed {missed}", off <= 1e-6 and not missed


@hard("mirrored and zero-scale object matrices")
def matrices(device: native.Device) -> tuple[str, bool]:
    position, normal, _ = ball(20_000)
    problems, off = [], 0.0
    for diagonal in ((-1, 1, 1), (-1, -1, -1), (1, 1, 0), (1, 0, 0), (0, 0, 0), (1e-12,) * 3, (1e-30, 1e30, 1)):
        matrix = np.diag([*map(float, diagonal), 1.0])
        style = {"world_from_object": matrix.ravel().tolist()}
        culled = draw(device, [cloud_of(position, normal)], VIEW, 90, 90, (SUN,),
                      {**style, "lighting": 2, "cull_back": 1})
        problems += [sane(culled)] * bool(sane(culled))
        shown = draw(device, [cloud_of(position)], VIEW, 90, 90, (), style, **OFF)
        if max(np.abs(diagonal)) <= 1.0:
            error = projected(shown, VIEW, position.astype(np.float64) @ matrix[:3, :3], 90, 90)
            off = max(off, error["z"])
            problems += ["points missed"] * bool(error["missed"] or error["wrong"])
    return f"depth {off:.1e} (≤ 1e-06)" + "".join(f"; {one}" for one in problems), off <= 1e-6 and not problems


# ---- surfaces ------------------------------------------------------------------------------------------------------


def plane_at(device: native.Device, degrees: float, layer: float = 0.0) -> tuple[Shown, Shown, float, float]:
    """A plane so steep, one unit a pixel: without and with filling, area shown, area of the truth."""
    size, turn = 128, np.radians(degrees)
    height = 1.6 * size / max(np.cos(turn), 0.1)
    position, normal = Rectangle(width=1.6 * size, height=height).sample(60_000, np.random.default_rng(7))
    c, s = np.cos(turn), np.sin(turn)
    turned = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    camera = look(np.array([0.0, 0.0, 10.0]), np.zeros(3))
    half = 0.5 * size
    camera = Camera(camera.matrix, -half, half, -half, half, -3000.0, 3000.0, True)
    cloud = [cloud_of(position @ turned.T, normal @ turned.T)]
    style = {"d_min": layer} if layer else None
    open_, closed = (draw(device, cloud, camera, size, size, (), style, **{**OFF, "fill": fill}) for fill in (2, 0))
    return open_, closed, float((closed.keys != EMPTY).sum()), size * min(size, height * c)


@hard("a plane edge-on (n·v → 0)")
def edge_on(device: native.Device) -> tuple[str, bool]:
    worst, lost = 0.0, 0
    for degrees in (89.0, 89.9, 90.0):
        open_, closed, area, _ = plane_at(device, degrees)
        lost += int(((open_.source == 1.0) & (closed.source != 1.0)).sum())
        rows = (open_.keys != EMPTY).any(axis=1)  # filling may close these rows, not add more than an eighth of one
        worst = max(worst, area - 128.0 * rows.sum())
    return f"measured pixels lost {lost}, grown {max(worst, 0.0):.0f} px (≤ 16)", not lost and worst <= 16


@hard("a plane at 45° that steps 1.5 d̃ a pixel")
def steep_steps(device: native.Device) -> tuple[str, bool]:
    open_, closed, area, true = plane_at(device, 45.0, 1.0 / 1.5)
    lost = int(((open_.source == 1.0) & (closed.source != 1.0)).sum())
    hole = 1.0 - area / true
    return f"measured pixels lost {lost}, open {100 * hole:.3f} % (≤ 0.1)", not lost and hole <= 1e-3


@hard("camera inside a sphere")
def inside(device: native.Device) -> tuple[str, bool]:
    position, normal = Sphere().sample(400_000, np.random.default_rng(8))
    camera = look(np.array([0.2, 0.1, 0.0]), np.array([1.0, 0.5, 0.2]), 70.0)
    camera = Camera(**{**vars(camera), "near": 0.01, "far": 10.0})
    shown = draw(device, [cloud_of(position, normal)], camera, 128, 128, (SUN,), {"lighting": 2})
    exact = Scene((Sphere(),)).picture(camera, 128, 128, antialias=0)
    off = np.abs(shown.depth - exact.depth)
    return same("depth", float(off.max()), 0.01, shown)  # half a pixel's slope


@hard("camera inside a sphere, 170°")
def inside_wide(device: native.Device) -> tuple[str, bool]:
    """Towards its rim such a view draws everything some ten times as long as in its middle."""
    position, normal = Sphere().sample(100_000, np.random.default_rng(8))
    camera = Camera(**{**vars(look(np.array([0.05, 0.02, 0.0]), np.array([0.05, 1.02, 0.0]), 170.0)), "near": 1e-3})
    cloud = cloud_of(position, -normal)
    cloud.analyse()
    open_ = 100.0 * float(np.isinf(draw(device, [cloud], camera, 256, 256).depth).mean())
    return f"{open_:.3f} % of the picture open, at most 0.1", open_ <= 0.1


@hard("0.1 % of strays")
def strays(device: native.Device) -> tuple[str, bool]:
    """A stray is a dot; it closes nothing around it, analysed or not. Before, they closed two thirds as much again as the sphere covers."""
    random, worst, text = np.random.default_rng(9), 0.0, []
    position, _ = Sphere().sample(200_000, random)
    box = random.uniform(-1.3, 1.3, (200, 3))
    for analysed in (False, True):
        shown = []
        for points in (position, np.concatenate([position, box])):
            cloud = cloud_of(points.astype(np.float32))
            if analysed:
                cloud.analyse()
            shown.append(draw(device, [cloud], orbit(), 256, 256, smooth=3, antialias=2))
        before, after = (np.minimum(one.depth, 9.0) for one in shown)
        share = 100.0 * float((np.abs(after - before) > 0.05).mean())
        text.append(f"{share:.2f}")
        worst = max(worst, share)
    return f"{' and '.join(text)} % of the pixels changed, at most 0.6", worst <= 0.6


@hard("density from 30 to 0.1 points a pixel in one cloud")
def falling(device: native.Device) -> tuple[str, bool]:
    random = np.random.default_rng(9)
    long, high, dense, ratio = 640, 160, 30.0, 300.0
    share = random.random(int(dense * long * high * (1.0 - 1.0 / ratio) / np.log(ratio)))
    x = -np.log(1.0 - share * (1.0 - 1.0 / ratio)) / np.log(ratio) * long  # falls by the same factor every pixel
    world = np.stack([x, random.uniform(0, high, len(x)), np.zeros(len(x))], axis=1)
    camera = look(np.array([0.0, 0.0, 10.0]), np.zeros(3))
    camera = Camera(camera.matrix, -10.0, long + 10.0, -10.0, high + 10.0, 0.1, 100.0, True)
    shown = draw(device, [cloud_of(world, np.tile([0.0, 0.0, 1.0], (len(x), 1)))], camera, long + 20, high + 20)
    full = shown.keys != EMPTY
    hole = 1.0 - full[10:-10, 10:-10].mean()
    grown = (full.sum() - full[10:-10, 10:-10].sum()) / (long * high)
    text = f"open {100 * hole:.3f} % (≤ 1), grown {100 * grown:.3f} % (≤ 0.1)"
    return text, hole <= 0.01 and grown <= 1e-3 and not sane(shown)


@hard("opacity 0 and 1 exactly")
def opacities(device: native.Device) -> tuple[str, bool]:
    """A ball of opacity 0 in front of one of opacity 1, by style and by point: as if the first were not there."""
    position, normal = Sphere(radius=0.5).sample(60_000, np.random.default_rng(11))
    ball_, ghost = position.astype(np.float32), (position + VIEW.matrix[:3, 2]).astype(np.float32)
    normal = normal.astype(np.float32)
    alone = draw(device, [cloud_of(ball_, normal)], VIEW, 150, 150, (SUN,), {"lighting": 2}, layers=8)
    wrong = 0
    for by_style in (True, False):
        scene = native.Scene()
        scene.add_cloud(cloud_of(ball_, normal), lighting=2)
        clear = np.zeros((len(ghost), 1), np.float32)
        cloud = cloud_of(ghost, normal) if by_style else native.Cloud(ghost, normal, opacities=clear)
        scene.add_cloud(cloud, lighting=2, transparency=float(by_style))
        scene.add_light(**SUN.fields())
        scene.set_camera(**VIEW.fields())
        scene.set_settings(width=150, height=150, film_transparent=1, layers=8)
        frame = native.Frame(device)
        frame.render(scene)
        wrong += int((frame.read("COMBINED") != alone.rgba).any(axis=2).sum())
    solid = int(((alone.rgba[..., 3] != 1.0) & (alone.source >= 1.0)).sum())
    return f"pixels that differ {wrong} (≤ 0), pixels not solid {solid} (≤ 0)", not wrong and not solid


# ---- soft points ---------------------------------------------------------------------------------------------------

ACROSS = 2.0  # of the square that a parallel camera sees


def soft_alpha(device: native.Device, position: np.ndarray, radius: np.ndarray, size: int, opacity: float,
               opacities: np.ndarray | None = None) -> np.ndarray:
    """Alpha of balls (Base) before the square, each pixel seen through its centre."""
    cloud = native.Cloud(position.astype(np.float32), radii=radius.astype(np.float32).reshape(-1, 1), opacities=opacities)
    camera = look(np.array([0.0, 0.0, 10.0]), np.zeros(3))
    half = ACROSS / 2.0
    camera = Camera(camera.matrix, -half, half, -half, half, 0.1, 100.0, True)
    style = {"lighting": 1, "soft": SOFT["ALL"], "soft_model": SOFT_MODEL["BASE"], "soft_opacity": opacity, "color": (1.0, 1.0, 1.0)}
    return draw(device, [cloud], camera, size, size, style=style, **OFF).rgba[..., 3].astype(np.float64)


def soft_depth(position: np.ndarray, radius: np.ndarray, size: int) -> np.ndarray:
    """Of the same in float64, -ln of what comes through over that of a ball's middle: the integral of 1 - s / r along -z."""
    middle = ((np.arange(size) + 0.5) / size - 0.5) * ACROSS
    x, y = np.meshgrid(middle, middle)
    total = np.zeros((size, size))
    for place, r in zip(position.astype(np.float32).astype(np.float64), radius.astype(np.float32).astype(np.float64), strict=True):
        u = np.minimum(np.hypot(x - place[0], y - place[1]) / r, 1.0)
        half = np.sqrt(1.0 - u * u)
        total += half - u * u * np.arcsinh(half / np.maximum(u, 1e-300))
    return total


@hard("d = 0 and d = r in the density integral")
def soft_ends(device: native.Device) -> tuple[str, bool]:
    """Rays through a ball's centre, and through its rim and just beside that: of 9 x 9 pixels the middle one, and those 2 and more away."""
    step, worst = ACROSS / 9.0, 0.0
    for rim in (0.0, 1e-7, -1e-7, 1e-3, -1e-3):
        for reach in (2.0, np.sqrt(8.0), 3.0):
            position, radius = np.zeros((1, 3)), np.array([step * reach * (1.0 + rim)])
            exact = 1.0 - 0.1 ** soft_depth(position, radius, 9)
            got = soft_alpha(device, position, radius, 9, 0.9)
            worst = max(worst, float(np.abs(got - exact).max())) if np.isfinite(got).all() else np.inf
    return f"opacity {worst:.1e} (≤ 1e-4)", worst <= 1e-4


@hard("r → 0, r ≫ scene")
def soft_radii(device: native.Device) -> tuple[str, bool]:
    """A ball beside fifty of 1e-30 to 1e-4 is as it would be alone; of 1e3 to 1e15, the eye within, shows what lies before the eye."""
    here, off = np.array([[0.1, -0.2, 0.3]]), 0.0
    exact = 1.0 - 0.5 ** soft_depth(here, np.array([0.6]), 32)
    for tiny in (1e-30, 1e-12, 1e-6, 1e-4):
        position, radius = np.concatenate([here, np.random.default_rng(4).uniform(-0.9, 0.9, (50, 3))]), np.full(51, tiny)
        radius[0] = 0.6
        off = max(off, float(np.abs(soft_alpha(device, position, radius, 32, 0.5) - exact).max()))
    beyond = 0.0
    for wide in (1e3, 1e6, 1e15):
        before = (10.0 - 0.1 - 0.3) / wide  # of the ray between the near plane and the centre; the other half lies behind
        exact_wide = 1.0 - 0.5 ** (0.5 + before - 0.5 * before * before)
        got = soft_alpha(device, here, np.array([wide]), 8, 0.5)
        beyond = max(beyond, float(np.abs(got - exact_wide).max())) if np.isfinite(got).all() else np.inf
    return f"opacity {off:.1e} beside tiny balls, {beyond:.1e} within wide ones (≤ 1e-4)", off <= 1e-4 and beyond <= 1e-4


@hard("10⁴ soft fragments in one pixel")
def soft_many(device: native.Device) -> tuple[str, bool]:
    """10,000 balls before the only pixel, a tenth of 1/255 opaque each: what comes through all is the product."""
    random = np.random.default_rng(5)
    position, radius = random.uniform(-1.0, 1.0, (10_000, 3)), random.uniform(2.1, 2.8, 10_000)
    given = np.full((10_000, 1), 1.0 / 255.0, np.float32)
    exact = 1.0 - (1.0 - 0.1 / 255.0) ** soft_depth(position, radius, 1)
    off = float(np.abs(soft_alpha(device, position, radius, 1, 0.1, given) - exact).max())
    return f"opacity {off:.1e} of {exact.min():.3f} (≤ 3e-4)", off <= 3e-4


# ---- light ---------------------------------------------------------------------------------------------------------


def lit_ball(device: native.Device, light: Light, surface: Any = None, limit: float = 0.01) -> tuple[str, bool]:
    """Colour against the exact Lambert picture, inner pixels."""
    surface = surface or Sphere()
    scene = Scene((surface,), (light,), world=0.05, albedo=lambda owner, point: np.full(point.shape, 0.8))
    position, normal = surface.sample(400_000, np.random.default_rng(10))
    camera = orbit()
    shown = draw(device, [cloud_of(position, normal)], camera, 200, 200, (light,), {"lighting": 2},
                 world_color=[0.05] * 3)
    exact = scene.picture(camera, 200, 200, antialias=0)
    inner = np.isfinite(exact.depth)
    for _ in range(2):
        wide_ = np.pad(inner, 1)
        inner = np.logical_and.reduce([wide_[dy : dy + 200, dx : dx + 200] for dy in range(3) for dx in range(3)])
    scale = max(float(exact.color[inner].max()), 0.1)
    off = np.sqrt(np.mean((shown.rgba[inner][:, :3] - exact.color[inner]) ** 2)) / scale
    return same("colour rms, share of the brightest", float(off), limit, shown)


@hard("light inside the cloud")
def light_inside(device: native.Device) -> tuple[str, bool]:
    return lit_ball(device, Light(power=50.0, position=np.array([0.1, 0.2, 0.3])))


@hard("light at a point of the cloud")
def light_at_point(device: native.Device) -> tuple[str, bool]:
    position, normal, _ = ball(20_000)
    facing = int(np.argmax(position @ VIEW.eye.astype(np.float32)))
    light = Light(power=10.0, position=position[facing].astype(np.float64))
    shown = draw(device, [cloud_of(position, normal)], VIEW, 120, 120, (light,),
                 {"lighting": 2, "diffuse": 1.0, "specular": 1.0, "shininess": 1000})
    problem = sane(shown)
    return problem or "every pixel finite", not problem


@hard("light behind the plane")
def light_behind(device: native.Device) -> tuple[str, bool]:
    return lit_ball(device, Light(power=50.0, position=np.array([0.0, 0.0, -1.0])), Rectangle(), 1e-4)


@hard("sun at a grazing angle")
def grazing(device: native.Device) -> tuple[str, bool]:
    towards = np.array([np.cos(np.radians(1.0)), 0.0, np.sin(np.radians(1.0))])
    return lit_ball(device, Light(power=3.0, towards=towards), Rectangle(), 1e-3)


def unshadowed(device: native.Device, surface: Any, light: dict[str, Any], most: float = 0.0) -> tuple[str, bool]:
    """Nothing stands between the light and any point: the share of points that are dark all the same."""
    position, normal = surface.sample(100_000, np.random.default_rng(11))
    with native.Scene() as scene, native.Frame(device) as frame, native.Cloud(position.astype(np.float32),
                                                                             normal.astype(np.float32)) as cloud:
        scene.add_cloud(cloud, lighting=2)
        scene.add_light(power=1.0, shadows=1, **light)
        scene.set_settings(width=16, height=16)
        frame.bake_shadows(scene)
        share = frame.shadows(0, 0, len(position))
    good = bool(((share >= 0.0) & (share <= 1.0)).all())
    dark = float((share < 0.5).mean())
    return f"dark though nothing is in the way {dark:.2%} (≤ {most:.2%})", good and dark <= most


@hard("light inside the cloud: its shadows")
def shadows_from_inside(device: native.Device) -> tuple[str, bool]:
    return unshadowed(device, Sphere(), {"type": 2, "position": [0.1, 0.2, 0.3]})


@hard("light at a point of the cloud: its shadows")
def shadows_from_a_point(device: native.Device) -> tuple[str, bool]:
    position, _ = Sphere().sample(100_000, np.random.default_rng(11))
    return unshadowed(device, Sphere(), {"type": 2, "position": position[77].tolist()})


@hard("light behind the plane: its shadows")
def shadows_from_behind(device: native.Device) -> tuple[str, bool]:
    return unshadowed(device, Rectangle(), {"type": 2, "position": [0.0, 0.0, -1.0]})


@hard("sun at a grazing angle, 1 degree: its shadows")
def shadows_of_a_grazing_sun(device: native.Device) -> tuple[str, bool]:
    return unshadowed(device, Rectangle(), {"type": 1, "direction": [-np.cos(np.radians(1.0)), 0.0,
                                                                     -np.sin(np.radians(1.0))]})


# ---- depth cues and drawing ----------------------------------------------------------------------------------------

# Every effect of the table as Blender begins with it, but for what these scenes' sizes ask for.
EFFECTS = {field["name"]: field["start"] for effect in native.abi.EFFECTS for field in effect["fields"]
           if "start" in field and "automatic" not in field}
EFFECTS |= {"edl_strength": 1.0, "obscurance_strength": 1.0, "toon_bands": 4, "toon_softness": 0.5, "hatch_levels": 3,
            "hatch_ground": 0.5, "contour_opacity": 0.8, "contour_interval": 0.0625, "contour_every": 4, "fog_start": 1.0,
            "fog_end": 6.0, "fog_density": 0.7, "focus_aperture": 0.05, "focus_distance": 3.0, "paper_grain": 0.3}


@hard("depth cues and drawing at 2²³")
def effects_far(device: native.Device) -> tuple[str, bool]:
    """The same picture as at the origin; strokes of hatching lie elsewhere there, as much of them."""
    position, normal, color = ball(60_000)
    pictures, inks = [], []
    bare, strokes = {**EFFECTS, "hatch_levels": 0}, {"hatch_levels": 3, "hatch_ground": 1.0}
    for place in (0.0, 2.0**23):
        world = np.rint(position.astype(np.float64) * 2.0**20) / 2.0**20 + place
        camera = look(np.array([0.25, -2.75, 2.25]) + place, np.full(3, place))
        pictures.append(draw(device, [cloud_of(world, normal, color)], camera, 200, 200, effects=bare))
        inks.append(draw(device, [cloud_of(world, normal, color * 0.2)], camera, 200, 200, effects=strokes).rgba.sum())
    near, far = pictures
    both = np.isfinite(near.depth) & np.isfinite(far.depth)
    alike = np.abs(near.depth[both] - far.depth[both]) < 1e-5
    shares = np.abs(near.rgba[both] - far.rgba[both]).max(axis=1)[alike]
    ink = abs(inks[1] / inks[0] - 1.0)
    text, holds = same("colours off by", float(shares.max()), 1e-3, far)
    return f"{text}, ink by {ink:.2g} (≤ 0.01)", bool(holds and ink <= 0.01)


@hard("depth cues and drawing over nonsense and extremes")
def effects_of_nonsense(device: native.Device) -> tuple[str, bool]:
    position, normal, color = ball()
    position[::35, 0], normal[5::31, 1], color[11::29] = np.nan, np.inf, 0.0
    shown = [draw(device, [cloud_of(position, normal, color)], VIEW, 120, 120, (SUN,), {"lighting": 2}, EFFECTS),
             draw(device, [cloud_of(np.float32([[0.125, 0.0, 0.0]]))], VIEW, 67, 45, effects=EFFECTS),
             draw(device, [cloud_of(position, normal, color)], VIEW, 1, 1, effects=EFFECTS)]
    for scale in (1e-6, 1e6):
        world = np.random.default_rng(5).uniform(-0.55, 0.55, (20_000, 3)) * scale
        half = 0.5 * scale
        camera = Camera(look(np.array([0.1, -0.2, 0.3]) * scale, np.zeros(3)).matrix, -half, half, -half, half, -2.0 * scale,
                        2.0 * scale, True)
        scaled = {"fog_end": 1.0 * scale, "fog_start": -1.0 * scale, "focus_distance": scale, "focus_aperture": 0.2 * scale}
        shown.append(draw(device, [cloud_of(world)], camera, 128, 128, effects=EFFECTS | scaled))
    deepest = look(np.zeros(3), np.array([0.0, 0.0, -1.0]), 50.0)
    deepest = Camera(**{**vars(deepest), "near": 1e-3, "far": 1e4})
    shown.append(draw(device, [cloud_of(decades(1))], deepest, 128, 128, effects=EFFECTS))
    problems = [problem for problem in map(sane, shown) if problem]
    return "; ".join(problems) or f"{len(shown)} pictures, all sane", not problems


# ---- the table -----------------------------------------------------------------------------------------------------


def in_c(programs: Path, device: str) -> Iterator[Verdict]:
    """Runs each C program once and reads what it says of its tests."""
    said: dict[str, str] = {}
    for case, (program, test) in IN_C.items():
        path = programs / program
        if not path.is_file():
            yield Verdict(case, device, "", f"there is no {path.name}: build/compile release all_tests")
            continue
        if program not in said:
            done = subprocess.run([str(path), "--device", device], capture_output=True, text=True, timeout=600)
            said[program] = done.stdout + done.stderr
        holds = f"[       OK ] {test}\n" in said[program]
        yield Verdict(case, device, f"as the float64 reference has it, {program}", "holds" if holds else "FAILS")


def run(devices: list[str], programs: Path | None) -> Iterator[Verdict]:
    for name in devices:
        try:
            device = native.Device(name)
        except native.PatinaError as error:
            yield Verdict("all", name, "", f"cannot be had: {error}")
            continue
        for case, function in CASES:
            try:
                text, holds = function(device)
                yield Verdict(case, name, text, "holds" if holds else "FAILS")
            except native.PatinaError as error:
                yield Verdict(case, name, str(error), "FAILS")
        if programs:
            yield from in_c(programs, name)
    for case, needs in NOT_BUILT.items():
        yield Verdict(case, "–", f"needs {needs}", "not built yet")


def table(verdicts: list[Verdict]) -> str:
    """Markdown; devices that say the same share a line."""
    lines: dict[tuple[str, str, str], list[str]] = {}
    for one in verdicts:
        lines.setdefault((one.case, one.error, one.verdict), []).append(one.device)
    order = {case: k for k, case in enumerate(dict.fromkeys(one.case for one in verdicts))}
    body = [f"| {case} | {', '.join(devices)} | {error} | {verdict} |"
            for (case, error, verdict), devices in sorted(lines.items(), key=lambda item: order[item[0][0]])]
    return "\n".join(["| case | device | error against float64 | verdict |", "|---|---|---|---|", *body])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--device", action="append", help="may be repeated; default: all")
    parser.add_argument("--library", type=Path, default=ROOT / "build/out/release/libpatina.so")
    parser.add_argument("--programs", type=Path, default=ROOT / "build/out/release/tests/hard")
    options = parser.parse_args()
    os.environ["PATINA_LIBRARY"] = str(options.library.resolve())
    devices = [name for name in options.device or DEVICES if name != "all"] or list(DEVICES)
    verdicts = list(run(devices, options.programs))
    print(table(verdicts))
    counts = [sum(one.verdict == word for one in verdicts) for word in ("holds", "FAILS")]
    for one in verdicts:
        if one.verdict not in ("holds", "FAILS"):
            print(f"skip {one.case} on {one.device}: {one.verdict}" + f", {one.error}" * bool(one.error))
    print(f"{counts[0]} passed, {counts[1]} failed, {len(verdicts) - sum(counts)} skipped")
    return 1 if counts[1] else 0


if __name__ == "__main__":
    sys.exit(main())
