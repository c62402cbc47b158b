# SPDX-License-Identifier: GPL-3.0-or-later
"""Cryptomatte (Friedman and Jones, Fully Automatic ID Mattes with Support for Motion Blur and Transparency, SIGGRAPH 2015; its
specification 1.2.0): whose surface each pixel shows, and how much of it. Nothing here knows Blender.

How much is told by more pictures of the same scene, by the same filters: three objects a picture, in pure red, green and blue. What
never comes near each other shares a color, so that two or three pictures do for a scene of many objects.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..description.roles import SEEN
from ..description.scene import SceneDescription
from . import mattes

KINDS = ("Object", "Asset")
PLANE = "CRYPTO"  # begins the names of planes that are made here: CRYPTO Object 0
MOST_RANKS = 16
REACH = 2  # pixels that filters spread an edge over
LEAST = 1 / 4096  # of a pixel: less is what rounding leaves


@dataclass(frozen=True)
class Ranks:
    """Of each pixel: hashes of names, 0 for none, and shares; (height, width, count)."""

    hashes: np.ndarray  # uint32
    shares: np.ndarray  # float32


def hash_of(name: str) -> int:
    """MurmurHash3 of 32 bits (Appleby), seed 0, of a name's UTF-8."""
    data, mask = name.encode(), 0xFFFFFFFF

    def turned(value: int, by: int) -> int:
        return (value << by | value >> (32 - by)) & mask

    def mixed(word: int) -> int:
        return turned(word * 0xCC9E2D51 & mask, 15) * 0x1B873593 & mask

    whole = len(data) // 4 * 4
    state = 0
    for at in range(0, whole, 4):
        state = (turned(state ^ mixed(int.from_bytes(data[at:at + 4], "little")), 13) * 5 + 0xE6546B64) & mask
    if data[whole:]:
        state ^= mixed(int.from_bytes(data[whole:], "little"))
    state ^= len(data)
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35), (16, 1)):
        state = (state ^ state >> shift) * factor & mask
    return state


def as_floats(hashes: np.ndarray) -> np.ndarray:
    """float32 with the hashes' bits, exponents kept off those of zeros, infinities and what is no number."""
    exponents = np.clip(hashes >> np.uint32(23) & np.uint32(255), 1, 254).astype(np.uint32)
    bits = hashes & np.uint32(0x807FFFFF) | exponents << np.uint32(23)
    return np.where(hashes == 0, np.uint32(0), bits).view(np.float32)


def metadata(layer: str, kind: str, names: Iterable[str]) -> dict[str, str]:
    """What readers look for in a file's header. layer: of the view."""
    name = f"{layer}.Crypto{kind}"
    prefix = f"cryptomatte/{hash_of(name):08x}"[:len("cryptomatte/") + 7]
    manifest = {one: f"{int(as_floats(np.array([hash_of(one)], np.uint32)).view(np.uint32)[0]):08x}" for one in sorted(set(names))}
    return {f"{prefix}/name": name, f"{prefix}/hash": "MurmurHash3_32", f"{prefix}/conversion": "uint32_to_float32",
            f"{prefix}/manifest": json.dumps(manifest, separators=(",", ":"), ensure_ascii=False)}


def names(description: SceneDescription, kind: str) -> list[str]:
    """Of all that is drawn."""
    return [_name(item, kind) for item in (*description.clouds, *description.meshes)]


def _name(item: mattes.Item, kind: str) -> str:
    return item.name if kind == "Object" else item.asset


# ---- which pictures ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Plan:
    """Pictures to make, and whose share a color of one is."""

    scenes: list[SceneDescription]
    owners: list[np.ndarray]  # for each color in turn: (height, width) or (1, 1), index of a group, -1: nobody's
    groups: list[tuple[str, str]]  # object's and asset's name


def plan(description: SceneDescription, numbers: np.ndarray | None) -> Plan:
    """numbers: (height, width, 1), what each pixel shows; None: not known, or no measure of what is near (glass, lenses)."""
    items = [*description.clouds, *description.meshes]
    groups = list(dict.fromkeys((item.name, item.asset) for item in items if item.role == SEEN))
    number = {group: index for index, group in enumerate(groups)}
    of_item = np.array([number[item.name, item.asset] if item.role == SEEN else -1 for item in items] + [-1])
    if numbers is None or len(groups) <= 3:
        owners, colors = [np.full((1, 1), index) for index in range(len(groups))], np.arange(len(groups))
    else:
        shown = of_item[shown_items(numbers, description)]
        colors = _colors(shown, len(groups))
        painted = np.append(colors, -1)[shown]
        owners = [_spread(np.where(painted == color, shown, -1), REACH) for color in range(colors.max(initial=-1) + 1)]
    scenes = []
    for first in range(0, len(owners), 3):
        paint = {group: mattes.CHANNELS[colors[index] - first] for group, index in number.items()
                 if first <= colors[index] < first + 3}
        flat = mattes.unlit(description, lambda item, paint=paint: paint.get((item.name, item.asset), mattes.BLACK)
                            if item.role == SEEN else mattes.BLACK)
        scenes.append(replace(flat, behind=None, clouds=[replace(item, role=SEEN) for item in flat.clouds],
                              meshes=[replace(item, role=SEEN) for item in flat.meshes]))
    return Plan(scenes, owners, groups)


def shown_items(numbers: np.ndarray, description: SceneDescription) -> np.ndarray:
    """(height, width): index of the cloud or, behind all clouds, mesh that each pixel shows; one past the last where none."""
    counts = [*(item.cloud.count for item in description.clouds), *(item.mesh.count for item in description.meshes)]
    firsts = np.cumsum(np.array([0, *counts], np.uint64), dtype=np.uint64)
    return np.minimum(np.searchsorted(firsts, numbers[..., 0], side='right') - 1, len(counts))


def _colors(shown: np.ndarray, count: int) -> np.ndarray:
    """A number for each group, -1 where nothing of it is seen: groups that come within 2 REACH pixels of each other differ."""
    height, width = shown.shape
    near = 2 * REACH
    beside: list[set[int]] = [set() for _ in range(count)]
    for dy in range(near + 1):
        for dx in range(-near if dy else 1, near + 1):
            a = shown[:height - dy, max(-dx, 0):width - max(dx, 0)]
            b = shown[dy:, max(dx, 0):width - max(-dx, 0)]
            differ = (a != b) & (a >= 0) & (b >= 0)
            for pair in np.unique(a[differ] * count + b[differ]).tolist():
                one, other = divmod(pair, count)
                beside[one].add(other)
                beside[other].add(one)
    seen = np.unique(shown[shown >= 0]).tolist()
    colors = np.full(count, -1)
    for one in sorted(seen, key=lambda index: -len(beside[index])):
        taken = {int(colors[other]) for other in beside[one]}
        colors[one] = next(color for color in range(count) if color not in taken)
    return colors


def _spread(labels: np.ndarray, reach: int) -> np.ndarray:
    """The label within reach of a pixel, along rows and columns; there is one at most."""
    for axis in (0, 1):
        out = labels.copy()
        for by in range(1, reach + 1):
            low, high = [slice(None)] * 2, [slice(None)] * 2
            low[axis], high[axis] = slice(None, -by), slice(by, None)
            out[tuple(low)] = np.maximum(out[tuple(low)], labels[tuple(high)])
            out[tuple(high)] = np.maximum(out[tuple(high)], labels[tuple(low)])
        labels = out
    return labels


# ---- what they say -------------------------------------------------------------------------------------------------------


def ranks(made: Plan, pictures: Sequence[np.ndarray], kind: str) -> Ranks:
    """pictures: the planes COMBINED of made.scenes."""
    hashes = np.array([hash_of(group[KINDS.index(kind)]) for group in made.groups] + [0], np.uint32)
    size = pictures[0].shape[:2]
    found = merge([])
    parts = []
    for color, owner in enumerate(made.owners):
        shares = np.where(owner >= 0, np.clip(pictures[color // 3][..., color % 3], 0, 1), 0)
        parts.append(Ranks(np.broadcast_to(hashes[owner], size)[..., None], shares[..., None]))
    for first in range(0, len(parts), MOST_RANKS):  # so many in memory at a time
        found = merge([found, *parts[first:first + MOST_RANKS]])
    return found


def merge(parts: Sequence[Ranks]) -> Ranks:
    """All shares, the greatest first; those of one name add up."""
    parts = [part for part in parts if part.shares.size]
    if not parts:
        return Ranks(np.zeros((0, 0, 0), np.uint32), np.zeros((0, 0, 0), np.float32))
    hashes = np.concatenate([part.hashes for part in parts], 2)
    shares = np.concatenate([part.shares for part in parts], 2).astype(np.float32)
    shares[shares < LEAST] = 0
    for later in range(1, hashes.shape[2]):
        for first in range(later):
            same = hashes[..., later] == hashes[..., first]
            shares[..., first] += np.where(same, shares[..., later], 0)
            shares[..., later][same] = 0
    order = np.argsort(-shares, axis=2, kind='stable')[..., :MOST_RANKS]
    shares = np.take_along_axis(shares, order, 2)
    return Ranks(np.where(shares > 0, np.take_along_axis(hashes, order, 2), 0), shares)


def gather(ranks: dict[str, Ranks], more: dict[str, Ranks]) -> None:
    """Adds those of a moment to those of moments before."""
    for kind, found in more.items():
        ranks[kind] = merge([ranks[kind], found]) if kind in ranks else found


def planes(ranks: dict[str, Ranks], wanted: Iterable[str], size: tuple[int, int], weight: float) -> dict[str, np.ndarray]:
    """(height, width, 4) float32 of the wanted planes that are made here: two names with weight times their shares each."""
    made = {}
    for name in wanted:
        if not name.startswith(PLANE):
            continue
        _, kind, number = name.split()
        found, out = ranks.get(kind), np.zeros((*size, 4), np.float32)
        first = 2 * int(number)
        for at, rank in enumerate(range(first, min(first + 2, found.shares.shape[2] if found else 0))):
            out[..., 2 * at] = as_floats(found.hashes[..., rank])
            out[..., 2 * at + 1] = found.shares[..., rank] * np.float32(weight)
        made[name] = out
    return made
