# SPDX-License-Identifier: GPL-3.0-or-later
"""Virtual scanners: what stations, an aircraft, or photographs bring home of a world of triangles.

A beam is six rays: its middle and five around it. Where they meet surfaces at different distances, the range is between
them in proportion (a mixed pixel), if they lie within the length of the pulse; else most of it decides. Noise lies along the
beam; each station is off by a small turn and shift."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .scenes import Survey
from .solids import World

# What made a sample: its surface and nothing else; a beam on several surfaces; its surface, but with noise beyond the limit of
# a wrong sample; something seen in a mirror; a pane, or what is behind one; nothing at all; a drop; someone who walked by.
CAUSES = ("surface", "mixed", "noise", "mirrored", "glass", "stray", "rain", "passer")
SURFACE, MIXED, NOISE, MIRRORED, PANE, STRAY, RAIN, PASSER = range(len(CAUSES))
LEAST_OFF = 0.02  # metres: a sample that is nearer to a surface of its beam is never wrong
SIGMAS = 3.0
NOWHERE = 1e3  # metres: how far a sample is off whose beam met nothing

AROUND = 5  # rays of a beam beside its middle
PULSE = 1.5  # metres; surfaces further apart than this are told apart, as a rule
LOWEST = -62.0  # degrees; a station does not see the ground beneath its tripod
HIGHEST = 85.0
DARK = 0.04  # linear albedo below which half of the returns are lost
CHUNK = 1 << 18


@dataclass(eq=False)
class Scan:
    """position float64 (n, 3) as told; color uint8 sRGB (n, 3); scan, row, column int32 (n,); stations (k, 3). What only the
    truth knows: true_position (n, 3), surface (n,) of the nearest part in the beam, -1 for a place between two; interval
    (n,): metres between samples across the beam, cosine (n,) at the surface, normal float32 (n, 3) toward the scanner, beam
    (n, 3) float32: the way of the light. shape: rows and columns of each scan's grid.

    wrong (n,) bool: off > max(LEAST_OFF, SIGMAS sigma). off (n,) float32: metres from the nearest surface (part) of its beam;
    sigma (n,) float32: the scanner's stated noise there; cause (n,) uint8: of CAUSES. These three are meant in the scan's own
    frame. shift (n,) float32: metres by which registration or drift moved the sample, which is not in `off`: a scan that is
    moved as a whole has no wrong samples for that."""

    position: np.ndarray
    color: np.ndarray
    scan: np.ndarray
    row: np.ndarray
    column: np.ndarray
    stations: np.ndarray
    true_position: np.ndarray
    surface: np.ndarray
    interval: np.ndarray
    cosine: np.ndarray
    normal: np.ndarray
    beam: np.ndarray
    shape: np.ndarray
    off: np.ndarray
    wrong: np.ndarray
    sigma: np.ndarray
    cause: np.ndarray
    shift: np.ndarray

    def __len__(self) -> int:
        return len(self.position)


def srgb_bytes(linear: np.ndarray) -> np.ndarray:
    value = np.clip(linear, 0.0, 1.0)
    return np.rint(255.0 * np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)).astype(np.uint8)


def beams(world: World, origin: np.ndarray, direction: np.ndarray, survey: Survey, random: np.random.Generator,
          aperture: float = 0.006) -> dict[str, np.ndarray]:
    """Unit directions (n, 3), origin (3,) or (n, 3) → index of the beams that return (k,), range (k,) without noise, colour,
    surface, true_position, cosine; parts and distances that all its rays met (k, 6), -1
    and inf for none, each (k, ...)."""
    found: list[dict[str, np.ndarray]] = []
    for begin in range(0, len(direction), CHUNK):
        way = direction[begin : begin + CHUNK]
        start = origin[begin : begin + CHUNK] if origin.ndim == 2 else origin
        n = len(way)
        u = np.cross(way, np.array([0.31, 0.52, 0.795]))
        u /= np.linalg.norm(u, axis=1)[:, None]
        v = np.cross(way, u)
        t, triangle = np.empty((AROUND + 1, n)), np.empty((AROUND + 1, n), np.int32)
        place, rgb = np.empty((AROUND + 1, n, 3)), np.zeros((AROUND + 1, n, 3), np.float32)
        for k in range(AROUND + 1):
            turn, wide = 2.0 * np.pi * k / AROUND, 0.35 * (k > 0)
            out = wide * (np.cos(turn) * u + np.sin(turn) * v)
            from_, ray = start + aperture * out, way + survey.divergence * out
            t[k], triangle[k] = world.rays.trace(from_, ray)
            hit = triangle[k] >= 0
            place[k] = np.where(hit[:, None], from_ + np.where(hit, t[k], 0.0)[:, None] * ray, np.nan)
            rgb[k, hit] = world.rays.albedo(place[k, hit], triangle[k, hit])
        met = np.isfinite(t)
        count = met.sum(axis=0)
        nearest = np.where(met, t, np.inf).min(axis=0)
        first = met & (t < nearest + 0.05)  # of the nearest surface
        share = first.sum(axis=0) / np.maximum(count, 1)
        with np.errstate(invalid="ignore"):
            behind = np.nansum(np.where(met & ~first, t, 0.0), axis=0) / np.maximum((met & ~first).sum(axis=0), 1)
            near = np.sum(np.where(first, t, 0.0), axis=0) / np.maximum(first.sum(axis=0), 1)
        mixed = (share < 1.0) & (count > 0)
        blend = mixed & (behind - near < PULSE)
        far_wins = mixed & ~blend & (random.random(n) > share)
        range_ = np.where(blend, share * near + (1.0 - share) * behind, np.where(far_wins, behind, near))
        chosen = np.where(blend[None], met, np.where(far_wins[None], met & ~first, first))
        weight = chosen[..., None] / np.maximum(chosen.sum(axis=0), 1)[None, :, None]
        color = (weight * rgb).sum(axis=0)
        which = np.where(chosen[0], 0, chosen.argmax(axis=0))
        each = np.arange(n)
        tri = triangle[which, each]
        truth = place[which, each]
        slope = np.einsum("ij,ij->i", way, world.normal[tri])
        cosine, normal = np.abs(slope), world.normal[tri] * -np.sign(slope)[:, None]
        between = blend & (np.abs(range_ - t[which, each]) > 0.02)
        lost = (count < 3) | (random.random(n) < survey.drop)
        lost |= random.random(n) > np.clip(cosine / 0.06, 0.0, 1.0)
        lost |= (color.mean(axis=1) < DARK) & (random.random(n) < 0.5)
        keep = np.flatnonzero(~lost)
        found.append({"index": keep + begin, "range": range_[keep], "color": color[keep], "true_position": truth[keep],
                      "surface": np.where(between[keep], -1, world.surface[tri[keep]]), "cosine": cosine[keep],
                      "normal": normal[keep].astype(np.float32), "beam": way[keep].astype(np.float32),
                      "parts": np.where(met, world.surface[triangle], -1).T[keep], "hits": t.T[keep]})
    return {name: np.concatenate([one[name] for one in found]) for name in found[0]}


def judged(world: World, origin: np.ndarray, way: np.ndarray, noisy: np.ndarray, clean: np.ndarray, hits: np.ndarray,
           parts: np.ndarray, sigma: np.ndarray) -> dict[str, np.ndarray]:
    """The truth of samples on beams from origins (3,) or (n, 3) along unit directions (n, 3), in the scan's own frame. noisy,
    clean (n,): ranges; hits (n, k): where rays of the beam met surfaces, inf for none; parts (n, k'): these; sigma (n,) → off,
    wrong, sigma, and the causes SURFACE, MIXED and NOISE."""
    def off(range_: np.ndarray) -> np.ndarray:
        # A hit bounds the search, with what its ray is away from the beam's middle.
        bound = np.minimum(np.abs(hits - range_[:, None]).min(axis=1) + 0.02 + 0.004 * range_, NOWHERE)
        found = world.off(origin + range_[:, None] * way, parts, bound)
        return np.where(np.isfinite(hits).any(axis=1), found, NOWHERE)

    away = off(noisy).astype(np.float32)
    wrong = away > np.maximum(LEAST_OFF, SIGMAS * sigma)
    mixed = off(clean) > 0.5 * LEAST_OFF
    return {"off": away, "wrong": wrong, "sigma": np.asarray(sigma, np.float32),
            "cause": np.where(mixed, MIXED, np.where(wrong, NOISE, SURFACE)).astype(np.uint8)}


def small_turn(random: np.random.Generator, angle: float) -> np.ndarray:
    x, y, z = random.normal(scale=angle, size=3)
    q, _ = np.linalg.qr(np.array([[1.0, -z, y], [z, 1.0, -x], [-y, x, 1.0]]))
    return q * np.sign(np.diag(q))


def finish(parts: list[dict[str, np.ndarray]], stations: np.ndarray, shape: np.ndarray, random: np.random.Generator) -> Scan:
    whole = {name: np.concatenate([one[name] for one in parts]) for name in parts[0]}
    color = srgb_bytes(whole["color"]).astype(np.int16) + np.rint(
        random.normal(scale=1.5, size=whole["color"].shape)).astype(np.int16)
    return Scan(whole["position"], np.clip(color, 0, 255).astype(np.uint8), whole["scan"].astype(np.int32),
                whole["row"].astype(np.int32), whole["column"].astype(np.int32), stations, whole["true_position"],
                whole["surface"].astype(np.int32), whole["interval"], whole["cosine"], whole["normal"], whole["beam"], shape,
                whole["off"], whole["wrong"], whole["sigma"], whole["cause"], whole["shift"].astype(np.float32))


def stations(world: World, survey: Survey, random: np.random.Generator) -> Scan:
    """Spherical grids, row 0 lowest."""
    rows, columns = int((HIGHEST - LOWEST) / survey.step), int(round(360.0 / survey.step))
    rise = np.radians(LOWEST + survey.step * np.arange(rows))
    parts = []
    for number, eye in enumerate(survey.stations):
        eye = np.asarray(eye, float)
        turn = np.radians(survey.step * (np.arange(columns) + 0.37 * number))
        a, e = np.meshgrid(turn, rise)
        way = np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], axis=2).reshape(-1, 3)
        got = beams(world, eye, way, survey, random)
        index = got.pop("index")
        noisy = got["range"] + random.normal(scale=survey.noise, size=len(index))
        shift = random.normal(scale=survey.registration / np.sqrt(3.0), size=3)
        own = eye + noisy[:, None] * way[index]
        place = eye + (noisy[:, None] * way[index]) @ small_turn(random, 2e-4).T + shift
        truth = judged(world, eye, way[index], noisy, got["range"], got.pop("hits"), got.pop("parts"),
                       np.full(len(index), survey.noise))
        parts.append({**got, **truth, "shift": np.linalg.norm(place - own, axis=1), "position": place, "scan": np.full(len(index), number), "row": index // columns,
                      "column": index % columns, "interval": got["range"] * np.radians(survey.step)})
    return finish(parts, np.array(survey.stations), np.array([[rows, columns]] * len(survey.stations)), random)


def airborne(world: World, survey: Survey, random: np.random.Generator) -> Scan:
    """Two strips of parallel lines, seen from 20 degrees to either side, 200 m away; no stations are told."""
    x0, y0, x1, y1 = survey.area
    parts = []
    for number, tilt in enumerate((20.0, -20.0)):
        step = survey.step * np.sqrt(2.0)
        x, y = np.meshgrid(np.arange(x0, x1, step), np.arange(y0, y1, step))
        x = x + random.normal(scale=0.1 * step, size=x.shape)
        y = y + random.normal(scale=0.1 * step, size=y.shape)
        columns = x.shape[1]
        down = np.array([np.sin(np.radians(tilt)), 0.0, -np.cos(np.radians(tilt))])
        sway = np.radians(4.0) * np.sin(np.linspace(0, np.pi, columns))[None, :, None] * np.array([0.0, 1.0, 0.0])
        way = (down + np.broadcast_to(sway, (*x.shape, 3))).reshape(-1, 3)
        way = way / np.linalg.norm(way, axis=1)[:, None]
        eye = np.stack([x, y, np.zeros_like(x)], axis=2).reshape(-1, 3) - 200.0 * way
        got = beams(world, eye, way, survey, random)
        index = got.pop("index")
        noisy = got["range"] + random.normal(scale=survey.noise, size=len(index))
        shift = random.normal(scale=survey.registration / np.sqrt(3.0), size=3)
        truth = judged(world, eye[index], way[index], noisy, got["range"], got.pop("hits"), got.pop("parts"),
                       np.full(len(index), survey.noise))
        parts.append({**got, **truth, "shift": np.full(len(index), np.linalg.norm(shift)),
                      "position": eye[index] + noisy[:, None] * way[index] + shift, "scan": np.full(len(index), number),
                      "row": index // columns, "column": index % columns, "interval": np.full(len(index), step)})
    return finish(parts, np.zeros((0, 3)), np.zeros((0, 2), int), random)


def photos(world: World, survey: Survey, random: np.random.Generator) -> Scan:
    """Pixels of photographs, more where they are textured; depth noise along the view rays that grows with the distance, in
    patches; holes where nothing is textured; no grids are told."""
    each = int(4.0 * survey.count / len(survey.stations))
    parts = []
    for number, eye in enumerate(survey.stations):
        eye = np.asarray(eye, float)
        middle = 0.5 * (world.corners.reshape(-1, 3).min(axis=0) + world.corners.reshape(-1, 3).max(axis=0))
        back = eye - middle * [1.0, 1.0, 0.8]
        back /= np.linalg.norm(back)
        right = np.cross([0.0, 0.0, 1.0], back)
        right /= np.linalg.norm(right)
        up = np.cross(back, right)
        uv = random.uniform(-1.0, 1.0, (each, 2)) * np.tan(np.radians(38.0))
        way = uv[:, :1] * right + uv[:, 1:] * up - back
        way /= np.linalg.norm(way, axis=1)[:, None]
        got = beams(world, eye, way, survey, random, 0.0)
        index = got.pop("index")
        _, other = world.rays.trace(eye, way[index] + 0.002 * random.normal(size=(len(index), 3)))
        hit = other >= 0
        contrast = np.zeros(len(index))
        near = world.rays.albedo(got["true_position"] + 0.008 * random.normal(size=(len(index), 3)), np.where(hit, other, 0))
        contrast[hit] = np.abs(near - got["color"]).mean(axis=1)[hit]
        keep = np.flatnonzero(random.random(len(index)) < np.clip(0.3 + 12.0 * contrast, 0.0, 1.0))
        got, index = {name: values[keep] for name, values in got.items()}, index[keep]
        patch = np.sin(31.0 * got["true_position"][:, 0] + number) * np.sin(27.0 * got["true_position"][:, 2] + 2.0 * number)
        depth = got["range"] * survey.noise * (random.normal(size=len(index)) + 0.7 * patch)
        stray = random.random(len(index)) < 0.004
        depth[stray] += random.normal(scale=0.06, size=int(stray.sum()))
        shift = random.normal(scale=0.001, size=3)
        truth = judged(world, eye, way[index], got["range"] + depth, got["range"], got.pop("hits"), got.pop("parts"),
                       got["range"] * survey.noise)
        truth["cause"][stray] = STRAY
        place = eye + (got["range"] + depth)[:, None] * way[index] + shift
        alone = got["range"] * 2.0 * np.tan(np.radians(38.0)) * np.sqrt(1.0 / (0.65 * each))
        parts.append({**got, **truth, "shift": np.full(len(index), np.linalg.norm(shift)), "position": place,
                      "scan": np.full(len(index), number), "row": np.zeros(len(index)),
                      "column": np.zeros(len(index)), "interval": alone})
    return finish(parts, np.zeros((0, 3)), np.zeros((0, 2), int), random)


PATTERNS = {"stations": stations, "airborne": airborne, "photos": photos}


def scan(world: World, survey: Survey, seed: int = 1) -> Scan:
    """survey: a Survey, or a Campaign with the errors of campaign.py."""
    if not isinstance(survey, Survey):
        from .campaign import scan as scan_campaign
        return scan_campaign(world, survey, np.random.default_rng(seed))
    return PATTERNS[survey.pattern](world, survey, np.random.default_rng(seed))
