# SPDX-License-Identifier: GPL-3.0-or-later
"""Virtual scanners with the errors of real ones. scanner.py has the simpler ones, which never change.

A beam is a bundle of rays with the weights of a Gaussian spot. Each ray returns w ρ cos / r²; a laser's speckle scatters that.
Returns that lie closer together than the pulse is long give one range, their mean by power: a mixed pixel, anywhere between
the surfaces. Of echoes farther apart the instrument reports the strongest, the first or the last. Panes return a little,
more when met squarely, let the beam through, and mirror it; polished and wet surfaces mirror it, too. Noise along the beam
grows with 1 / cos of incidence and on dark surfaces. Strays lie anywhere on a beam, drops near the scanner; who walks by is
met by one scan alone. A station is moved by its registration error, a walk by a drift that changes slowly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .scanner import (
    MIRRORED,
    MIXED,
    PANE,
    PASSER,
    RAIN,
    STRAY,
    Scan,
    finish,
    judged,
    small_turn,
)
from .solids import GLASS, Place, World

# Rays of a beam: radius in shares of the spot's (1/e²), number, weight each: the Gaussian's mean over the ring's area.
RINGS = ((0.0, 1, 0.0625), (0.5, 6, 0.0506), (1.0, 6, 0.0226))
WHOLE = sum(count * weight for _, count, weight in RINGS)
FLAT = 0.004  # metres by which the rays of a beam may miss the plane of its middle one, to be of one surface
GREY = 0.18  # albedo at which an instrument's noise is stated
STEEPEST = 0.1  # cosine below which noise grows no more
DARKEST = 0.05  # albedo below which noise grows no more: makers state a ratio of about three from white to black
NEAREST = 0.4  # metres; nothing nearer returns
SPECKLES = 4.0  # grains of speckle in a ray's return: its power varies by 1 / sqrt of that
DROPS = 12.0  # metres within which drops of rain return
DUST = 2e-4  # albedo of a pane's dust
FALL = 1.33, 1.52  # refractive indices of water and glass
CHUNK = 1 << 16


@dataclass(frozen=True)
class Instrument:
    """step: degrees between beams; noise: metres, one sigma, on grey that is met squarely; divergence: radians, half the
    cone (1/e²); pulse: metres; reach: metres at which white that is met squarely just returns; picks: the echo it reports; filters: the
    share of mixed pixels that it notices and drops itself."""

    step: float = 0.2
    noise: float = 0.002
    divergence: float = 0.0005
    aperture: float = 0.003
    pulse: float = 0.6
    reach: float = 120.0
    picks: str = "strongest"
    filters: float = 0.0
    lowest: float = -60.0
    highest: float = 88.0
    strays: float = 1e-4  # share of beams
    rain: float = 0.0  # share of beams
    registration: float = 0.004  # metres
    drift: float = 0.0  # metres, of a walk


@dataclass(frozen=True)
class Passer:
    """Walks from a to b while the scanner turns from share `begin` to share `end` of its way."""

    a: Place
    b: Place
    begin: float
    end: float


@dataclass(frozen=True)
class Station:
    eye: Place
    instrument: Instrument
    passers: tuple[Passer, ...] = ()


@dataclass(frozen=True)
class Walk:
    """A scanner carried along a path, its beams in all directions: `count` of them."""

    path: tuple[Place, ...]
    instrument: Instrument
    count: int


@dataclass(frozen=True)
class Campaign:
    setups: tuple[Station, ...]
    walks: tuple[Walk, ...] = ()

    @property
    def stations(self) -> tuple[Place, ...]:
        return tuple(one.eye for one in self.setups)


def noise_of(instrument: Instrument, cosine: np.ndarray, albedo: np.ndarray) -> np.ndarray:
    """Sigma of the range, metres."""
    return instrument.noise / np.maximum(cosine, STEEPEST) * np.sqrt(GREY / np.maximum(albedo, DARKEST))


def reflected(cosine: np.ndarray, index: float, faces: int) -> np.ndarray:
    """The share that a surface of a refractive index mirrors (Schlick 1994), or both faces of a pane."""
    least = ((index - 1.0) / (index + 1.0)) ** 2
    once = least + (1.0 - least) * (1.0 - cosine) ** 5
    return once if faces == 1 else 2.0 * once / (1.0 + once)


def bundle(way: np.ndarray, instrument: Instrument, rings: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of beams (n, 3): offsets of origins (k, n, 3), directions (k, n, 3), weights (k,) of the rays of some rings."""
    u = np.cross(way, np.array([0.31, 0.52, 0.795]))
    u /= np.linalg.norm(u, axis=1)[:, None]
    v = np.cross(way, u)
    start, ray, weight = [], [], []
    for ring in rings:
        radius, count, each = RINGS[ring]
        for k in range(count):
            turn = 2.0 * np.pi * (k + 0.5 * (ring == 2)) / count
            out = radius * (np.cos(turn) * u + np.sin(turn) * v)
            start.append(instrument.aperture * out)
            ray.append(way + instrument.divergence * out)
            weight.append(each)
    return np.array(start), np.array(ray), np.array(weight)


BODY = (((0.0, 0.0, 1.62), (0.11, 0.11, 0.14)), ((0.0, 0.0, 1.15), (0.24, 0.2, 0.36)), ((0.1, 0.0, 0.45), (0.1, 0.12, 0.47)),
        ((-0.1, 0.0, 0.45), (0.1, 0.12, 0.47)))  # middles and radii of ellipsoids


def bodies(origin: np.ndarray, ray: np.ndarray, time: np.ndarray, passers: tuple[Passer, ...]
           ) -> tuple[np.ndarray, np.ndarray]:
    """t (n,) at which rays (n, 3) meet who walks by at that time, 0..1, and the cosine there; inf where nobody is."""
    t, cosine = np.full(len(ray), np.inf), np.ones(len(ray))
    for passer in passers:
        mine = np.flatnonzero((time >= passer.begin) & (time < passer.end))
        if not len(mine):
            continue
        share = (time[mine] - passer.begin) / (passer.end - passer.begin)
        at = np.asarray(passer.a) + share[:, None] * (np.asarray(passer.b) - np.asarray(passer.a))
        start = origin if origin.ndim == 1 else origin[mine]
        for middle, radii in BODY:
            o, d = (start - at - middle) / np.asarray(radii), ray[mine] / np.asarray(radii)
            a, b, c = np.einsum("ij,ij->i", d, d), np.einsum("ij,ij->i", o, d), np.einsum("ij,ij->i", o, o) - 1.0
            root = b * b - a * c
            near = (-b - np.sqrt(np.maximum(root, 0.0))) / a
            good = (root > 0.0) & (near > NEAREST) & (near < t[mine])
            normal = (o + near[:, None] * d) / np.asarray(radii)
            normal /= np.linalg.norm(normal, axis=1)[:, None]
            t[mine[good]] = near[good]
            cosine[mine[good]] = np.abs(np.einsum("ij,ij->i", normal, ray[mine]))[good]
    return t, cosine


@dataclass(eq=False)
class Returns:
    """What rays bring back, (k, n) each: distance, inf for nothing; power; part of the world, -1: none of it; triangle; cosine;
    albedo (k, n, 3); kind: SURFACE, MIRRORED, PANE or PASSER."""

    t: np.ndarray
    power: np.ndarray
    part: np.ndarray
    triangle: np.ndarray
    cosine: np.ndarray
    albedo: np.ndarray
    kind: np.ndarray

    @staticmethod
    def joined(all_: list[Returns]) -> Returns:
        return Returns(*(np.concatenate([getattr(one, name) for one in all_])
                         for name in ("t", "power", "part", "triangle", "cosine", "albedo", "kind")))


def _diffuse(world: World, rays: object, numbers: np.ndarray | None, start: np.ndarray, ray: np.ndarray
             ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """t, triangle of the world, cosine and albedo of the nearest hits; numbers: the world's of the rays' triangles."""
    t, triangle = rays.trace(start, ray)
    hit = triangle >= 0
    cosine, rgb = np.ones(len(t)), np.zeros((len(t), 3), np.float32)
    rgb[hit] = rays.albedo((start if start.ndim == 1 else start[hit]) + t[hit, None] * ray[hit], triangle[hit])
    if numbers is not None:
        triangle = np.where(hit, numbers[triangle], -1)
    length = np.linalg.norm(ray, axis=1)
    cosine[hit] = np.abs(np.einsum("ij,ij->i", world.normal[triangle[hit]], ray[hit])) / length[hit]
    return t, triangle, cosine, rgb


def trace(world: World, start: np.ndarray, ray: np.ndarray, weight: np.ndarray, time: np.ndarray, passers: tuple[Passer, ...]
          ) -> Returns:
    """start, ray (k, n, 3) with weights (k,): rows of what the rays meet first, and, where there are panes or wet surfaces, of
    what is behind and of what is mirrored."""
    count, n = ray.shape[:2]
    found: list[Returns] = []
    for k in range(count):
        t, triangle, cosine, rgb = _diffuse(world, world.rays, None, start[k], ray[k])
        kind = np.zeros(n, np.uint8)
        if passers:
            body, slope = bodies(start[k], ray[k], time, passers)
            met = body < t
            t, triangle = np.where(met, body, t), np.where(met, -1, triangle)
            cosine = np.where(met, slope, cosine)
            rgb[met] = (0.12, 0.14, 0.22)
            kind[met] = PASSER
        part = np.where(triangle >= 0, world.surface[triangle], -1)
        gloss = np.where(part >= 0, world.gloss[part], 0)
        white = rgb.mean(axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            power = np.where(np.isfinite(t), weight[k] * white * cosine / np.square(t), 0.0)
        rows = [[t, power, part, triangle, cosine, rgb, kind]]
        shiny = np.flatnonzero(gloss > 0)
        if len(shiny):
            pane = gloss[shiny] == GLASS
            once = np.where(pane, reflected(cosine[shiny], FALL[1], 2), reflected(cosine[shiny], FALL[0], 1))
            # dust and the pane's own lobe; a wet surface: what is not mirrored
            lobe = np.clip((cosine[shiny] - 0.985) / 0.015, 0.0, 1.0)
            power[shiny] = np.where(pane, weight[k] * (DUST * cosine[shiny] + 0.5 * lobe) / np.square(t[shiny]),
                                    power[shiny] * (1.0 - once) ** 2)
            kind[shiny[pane]] = PANE
            rows += [_through(world, start[k], ray[k], shiny[pane], weight[k], once[pane], n)] if pane.any() else []
            rows.append(_mirrored(world, start[k], ray[k], shiny, t[shiny], triangle[shiny], weight[k], once, n))
        found += [Returns(*(column[None] for column in row)) for row in rows]
    return Returns.joined(found)


def _empty(n: int) -> list[np.ndarray]:
    return [np.full(n, np.inf), np.zeros(n), np.full(n, -1), np.full(n, -1), np.ones(n), np.zeros((n, 3), np.float32),
            np.zeros(n, np.uint8)]


def _through(world: World, start: np.ndarray, ray: np.ndarray, some: np.ndarray, weight: float, once: np.ndarray, n: int
             ) -> list[np.ndarray]:
    """What is behind panes: twice through."""
    out = _empty(n)
    t, triangle, cosine, rgb = _diffuse(world, world.clear, world.solid, start[some], ray[some])
    hit = triangle >= 0
    at = some[hit]
    out[0][at], out[2][at], out[3][at] = t[hit], world.surface[triangle[hit]], triangle[hit]
    out[1][at] = (weight * rgb.mean(axis=1) * cosine * np.square(0.96 * (1.0 - once)) / np.square(np.where(hit, t, 1.0)))[hit]
    out[4][at], out[5][at], out[6][at] = cosine[hit], rgb[hit], PANE
    return out


def _mirrored(world: World, start: np.ndarray, ray: np.ndarray, some: np.ndarray, t: np.ndarray, triangle: np.ndarray,
              weight: float, once: np.ndarray, n: int) -> list[np.ndarray]:
    """What panes and wet surfaces mirror; it appears straight behind them."""
    out = _empty(n)
    normal = world.normal[triangle]
    way = ray[some]
    turned = way - 2.0 * np.einsum("ij,ij->i", way, normal)[:, None] * normal
    place = start[some] + t[:, None] * way - 1e-6 * np.sign(np.einsum("ij,ij->i", way, normal))[:, None] * normal
    more, other, cosine, rgb = _diffuse(world, world.clear, world.solid, place, turned)
    hit = other >= 0
    at = some[hit]
    whole = t[hit] + more[hit]
    out[0][at], out[3][at] = whole, other[hit]
    out[1][at] = weight * rgb.mean(axis=1)[hit] * cosine[hit] * np.square(once[hit]) / np.square(whole)
    out[4][at], out[5][at], out[6][at] = cosine[hit], rgb[hit], MIRRORED
    return out


def echo(all_: Returns, instrument: Instrument, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of each beam: its range and power, and the share (k, n) of each return in it."""
    n = all_.t.shape[1]
    power = all_.power * random.gamma(SPECKLES, 1.0 / SPECKLES, all_.power.shape)
    order = np.argsort(all_.t, axis=0, kind="stable")
    t, p = np.take_along_axis(all_.t, order, 0), np.take_along_axis(power, order, 0)
    with np.errstate(invalid="ignore"):
        apart = np.vstack([np.zeros((1, n), bool), ~(t[1:] - t[:-1] < instrument.pulse)])
    group = np.cumsum(apart, axis=0)
    groups = int(group.max()) + 1
    sums = np.stack([np.where(group == g, p, 0.0).sum(axis=0) for g in range(groups)])
    least = detectable(instrument)
    if instrument.picks == "strongest":
        chosen = sums.argmax(axis=0)
    elif instrument.picks == "first":
        chosen = (sums > least).argmax(axis=0)
    else:
        chosen = groups - 1 - (sums > least)[::-1].argmax(axis=0)
    mine = (group == chosen[None]) & np.isfinite(t)
    p = np.where(mine, p, 0.0)
    whole = p.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        range_ = np.where(mine, p * t, 0.0).sum(axis=0) / whole
        share = p / whole
    back = np.empty_like(share)
    np.put_along_axis(back, order, share, 0)
    return range_, whole, back


def detectable(instrument: Instrument) -> float:
    """The least power that returns: a white surface's at the instrument's reach."""
    return WHOLE / instrument.reach**2


def beams(world: World, origin: np.ndarray, way: np.ndarray, time: np.ndarray, instrument: Instrument,
          passers: tuple[Passer, ...], random: np.random.Generator) -> dict[str, np.ndarray]:
    """Unit directions (n, 3), origin (3,) or (n, 3), time (n,) 0..1 → of the beams that return: index, range with noise, color,
    surface, true_position, cosine, normal, beam, and off, wrong, sigma, cause."""
    found = []
    for begin in range(0, len(way), CHUNK):
        some = slice(begin, begin + CHUNK)
        start = np.broadcast_to(origin, way.shape)[some] if origin.ndim == 1 else origin[some]
        one = _chunk(world, start, way[some], time[some], instrument, passers, random)
        one["index"] = one["index"] + begin
        found.append(one)
    return {name: np.concatenate([one[name] for one in found]) for name in found[0]}


def _plain(world: World, start: np.ndarray, ray: np.ndarray, time: np.ndarray, passers: tuple[Passer, ...]
           ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """t and triangle of the middle rays, which are the first; and which beams meet one matt surface, flat within FLAT, or the
    sky, with all of their rays (k, n, 3)."""
    t, triangle = world.rays.trace(start[0], ray[0])
    hit = triangle >= 0
    part = np.where(hit, world.surface[triangle], -1)
    plain = (part < 0) | (world.gloss[part] == 0)
    normal = world.normal[triangle]
    place = start[0] + np.where(hit, t, 0.0)[:, None] * ray[0]
    for k in range(len(ray)):
        if k:
            other, tri = world.rays.trace(start[k], ray[k])
            with np.errstate(invalid="ignore", divide="ignore"):
                wanted = np.einsum("ij,ij->i", place - start[k], normal) / np.einsum("ij,ij->i", ray[k], normal)
                plain &= np.where(hit, (np.where(tri >= 0, world.surface[tri], -1) == part) & (np.abs(other - wanted) < FLAT),
                                  tri < 0)
        if passers:
            plain &= ~np.isfinite(bodies(start[k], ray[k], time, passers)[0])
    return t, triangle, plain


def _chunk(world: World, origin: np.ndarray, way: np.ndarray, time: np.ndarray, instrument: Instrument,
           passers: tuple[Passer, ...], random: np.random.Generator) -> dict[str, np.ndarray]:
    n = len(way)
    offset, ray, _ = bundle(way, instrument, (0, 2))
    range_, triangle, simple = _plain(world, origin + offset, ray, time, passers)
    part = np.where(triangle >= 0, world.surface[triangle], -1)
    kind, cosine, color, power = np.zeros(n, np.uint8), np.ones(n), np.zeros((n, 3)), np.zeros(n)
    parts = np.full((n, 8), -1, np.int32)
    parts[:, 0] = part
    hits = np.full((n, sum(count for _, count, _ in RINGS)), np.inf)
    hits[:, 0] = range_
    at = np.flatnonzero(simple & (part >= 0))
    tri = triangle[at]
    color[at] = world.rays.albedo(origin[at] + range_[at, None] * way[at], tri)
    cosine[at] = np.abs(np.einsum("ij,ij->i", world.normal[tri], way[at]))
    power[at] = WHOLE * color[at].mean(axis=1) * cosine[at] / np.square(range_[at])
    rough = np.flatnonzero(~simple)
    if len(rough):
        offset, ray, weight = bundle(way[rough], instrument, (0, 1, 2))
        all_ = trace(world, origin[rough] + offset, ray, weight, time[rough], passers)
        r, p, share = echo(all_, instrument, random)
        lead = share.argmax(axis=0)
        each = np.arange(len(rough))
        range_[rough], power[rough] = r, p
        triangle[rough], part[rough] = all_.triangle[lead, each], all_.part[lead, each]
        cosine[rough], kind[rough] = all_.cosine[lead, each], all_.kind[lead, each]
        color[rough] = np.nansum(share[..., None] * all_.albedo, axis=0)
        parts[rough] = _parts(all_.part)
        hits[rough] = np.inf
        met = np.sort(np.where(all_.part >= 0, all_.t, np.inf), axis=0)[:hits.shape[1]]
        hits[rough, :] = met.T
    power = power * random.gamma(SPECKLES, 1.0 / SPECKLES, n)
    with np.errstate(invalid="ignore"):
        seen = np.isfinite(range_) & (range_ > NEAREST) & (power > detectable(instrument))
    stray = random.random(n) < instrument.strays
    drop = random.random(n) < instrument.rain
    far = np.where(np.isfinite(range_), range_, 0.3 * instrument.reach)
    anywhere = NEAREST + random.random(n) * np.maximum(far - NEAREST, 0.1)
    fallen = NEAREST + random.random(n) * np.maximum(np.minimum(far, DROPS) - NEAREST, 0.1)
    false = np.where(stray, anywhere, fallen)
    keep = np.flatnonzero(seen | stray | drop)
    none = (stray | drop)[keep]
    white = color.mean(axis=1)
    sigma = noise_of(instrument, cosine, white)[keep]
    clean = np.where(none, false[keep], range_[keep])
    noisy = clean + random.normal(size=len(keep)) * np.where(none, instrument.noise, sigma)
    start, along = origin[keep], way[keep]
    truth = judged(world, start, along, noisy, clean, hits[keep], parts[keep], np.full(len(keep), instrument.noise))
    cause = truth["cause"]
    noticed = (cause == MIXED) & ~none & (random.random(len(keep)) < instrument.filters)
    cause[(kind[keep] == PANE) & (cause != MIXED)] = PANE
    cause[kind[keep] == MIRRORED] = MIRRORED
    cause[kind[keep] == PASSER] = PASSER
    cause[none] = np.where(stray[keep], STRAY, RAIN)[none]
    known = (part[keep] >= 0) & ~none & (cause != MIXED) & (cause != PASSER) & (cause != MIRRORED)
    tri = triangle[keep]
    normal = world.normal[tri] * -np.sign(np.einsum("ij,ij->i", along, world.normal[tri]))[:, None]
    tint = np.where(none[:, None], 0.4 + 0.2 * random.random((len(keep), 1)), color[keep])
    out = {"index": keep, "range": noisy, "color": tint, "surface": np.where(known, part[keep], -1),
           "true_position": start + clean[:, None] * along, "cosine": cosine[keep], "normal": normal.astype(np.float32),
           "beam": along.astype(np.float32), **truth}
    return {name: values[~noticed] for name, values in out.items()}


def _parts(part: np.ndarray) -> np.ndarray:
    """(k, n) → (n, 8): the different parts, -1 behind them."""
    ordered = np.sort(part, axis=0)[::-1]
    fresh = np.vstack([np.ones((1, part.shape[1]), bool), ordered[1:] != ordered[:-1]]) & (ordered >= 0)
    rank = np.cumsum(fresh, axis=0) - 1
    out = np.full((part.shape[1], 8), -1, np.int32)
    k, i = np.nonzero(fresh & (rank < 8))
    out[i, rank[k, i]] = ordered[k, i]
    return out


def station(world: World, setup: Station, number: int, random: np.random.Generator) -> tuple[dict[str, np.ndarray],
                                                                                              tuple[int, int]]:
    """A spherical grid, row 0 lowest, its columns one after another; and its rows and columns."""
    it = setup.instrument
    rows, columns = int((it.highest - it.lowest) / it.step), int(round(360.0 / it.step))
    rise = np.radians(it.lowest + it.step * np.arange(rows))
    a, e = np.meshgrid(np.radians(it.step * (np.arange(columns) + 0.37 * number)), rise)
    way = np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], axis=2).reshape(-1, 3)
    eye = np.asarray(setup.eye, float)
    got = beams(world, eye, way, np.tile(np.arange(columns) / columns, rows), it, setup.passers, random)
    index = got.pop("index")
    away = got.pop("range")[:, None] * way[index]
    place = eye + away @ small_turn(random, 2e-4 if it.registration else 0.0).T + random.normal(scale=it.registration / np.sqrt(3.0), size=3)
    reach = np.linalg.norm(away, axis=1)
    return {**got, "position": place, "scan": np.full(len(index), number), "row": index // columns, "column": index % columns,
            "interval": reach * np.radians(it.step), "shift": np.linalg.norm(place - eye - away, axis=1)}, (rows, columns)


def drifts(instrument: Instrument, time: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """(n, 3) metres: six slow waves, `drift` metres in the root of the mean square."""
    out = np.zeros((len(time), 3))
    for wave in range(1, 7):
        size, phase = random.normal(size=3), random.uniform(0.0, 2.0 * np.pi, 3)
        out += size * np.sin(np.pi * wave * time[:, None] + phase)
    return out * instrument.drift / max(float(np.sqrt(np.mean(np.sum(np.square(out), axis=1)))), 1e-12)


def walk(world: World, made: Walk, number: int, random: np.random.Generator) -> dict[str, np.ndarray]:
    path = np.asarray(made.path, float)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    time = (np.arange(made.count) + random.random(made.count)) / made.count
    eye = np.stack([np.interp(time * length[-1], length, path[:, a]) for a in range(3)], axis=1)
    eye[:, 2] += 0.03 * np.sin(2.0 * np.pi * time * length[-1] / 0.75)  # steps of a walker
    z, turn = random.uniform(-1.0, 1.0, made.count), random.uniform(0.0, 2.0 * np.pi, made.count)
    flat = np.sqrt(1.0 - z * z)
    way = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
    got = beams(world, eye, way, time, made.instrument, (), random)
    index = got.pop("index")
    away = got.pop("range")[:, None] * way[index]
    moved = drifts(made.instrument, time, random)[index] + random.normal(
        scale=made.instrument.registration / np.sqrt(3.0), size=3)
    # beams of two metres of the path share a place's surroundings
    near = made.count * min(2.0 / max(length[-1], 1e-9), 1.0)
    interval = np.linalg.norm(away, axis=1) * np.sqrt(4.0 * np.pi / near)
    return {**got, "position": eye[index] + away + moved, "scan": np.full(len(index), number), "row": np.zeros(len(index)),
            "column": np.zeros(len(index)), "interval": interval, "shift": np.linalg.norm(moved, axis=1)}


def scan(world: World, campaign: Campaign, random: np.random.Generator) -> Scan:
    """Walks follow the stations; their `scan` numbers are beyond those of the stations."""
    parts, shapes = [], []
    for number, setup in enumerate(campaign.setups):
        part, shape = station(world, setup, number, random)
        parts.append(part)
        shapes.append(shape)
    for number, one in enumerate(campaign.walks, len(campaign.setups)):
        parts.append(walk(world, one, number, random))
    eyes = np.array(campaign.stations, float).reshape(-1, 3)
    return finish(parts, eyes, np.array(shapes, np.int64).reshape(-1, 2), random)

