# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples of the virtual scans with their features and the truth about them, for training and for reports."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from ..scans import campaigns, exact
from ..scans.scanner import CAUSES
from . import features as plain

RIGHT, WRONG = 40_000, 20_000  # samples a scene, at most
GROUPS = 5  # of scenes that are trained on in turns
KINDS = ("mixed", "noise", "mirrored", "stray", "rain", "passer")


@dataclass(eq=False)
class Samples:
    """values (n, F) float32; right (n,) bool; weight (n,): samples of the scan that one stands for; cause (n,) of CAUSES; off
    (n,) metres."""

    values: np.ndarray
    right: np.ndarray
    weight: np.ndarray
    cause: np.ndarray
    off: np.ndarray


def chosen(wrong: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the samples that are looked at, ascending, and what each stands for."""
    random = np.random.default_rng(seed)
    parts, weights = [], []
    for which, most in ((np.flatnonzero(~wrong), RIGHT), (np.flatnonzero(wrong), WRONG)):
        some = which if len(which) <= most else random.choice(which, most, replace=False)
        parts.append(some)
        weights.append(np.full(len(some), len(which) / max(len(some), 1)))
    numbers, weight = np.concatenate(parts), np.concatenate(weights)
    order = np.argsort(numbers)
    return numbers[order], weight[order]


def read(folder: Path, name: str, count: int, wanted: int) -> np.ndarray:
    """NAME.f32 of a folder: (count, wanted) float32, a row a point in the order of the scan."""
    values = np.memmap(folder / f"{name}.f32", np.float32, "r")
    if values.size != count * wanted:
        raise ValueError(f"{folder / name}.f32 has {values.size} numbers; {count} points with {wanted} features need "
                         f"{count * wanted}")
    return values.reshape(count, wanted)


def load(name: str, folder: Path | None, wanted: int) -> dict[str, Samples]:
    """Of a scene: NAME, and "NAME known" with features that used the stations, where the folder has NAME.known.f32. folder: where
    features lie; None: they are computed plainly here (minutes), and kept."""
    scene = campaigns.named(name)
    scan = exact.Stage(scene).scan
    some, weight = chosen(scan.wrong, scene.seed)
    rest = {"right": ~scan.wrong[some], "weight": weight, "cause": scan.cause[some], "off": scan.off[some]}
    if folder:
        return {title: Samples(read(folder, file, len(scan), wanted)[some], **rest)
                for title, file in ((name, name), (f"{name} known", f"{name}.known")) if file == name or (folder / f"{file}.f32").is_file()}
    key = hashlib.sha256(exact.meaning(Path(plain.__file__)).encode() + scan.position.tobytes()).hexdigest()[:12]
    path = exact.CACHE / f"trust-{name}-{key}.npz"
    if path.is_file():
        with np.load(path) as kept:
            return {name: Samples(**{one.name: kept[one.name] for one in fields(Samples)})}
    made = Samples(plain.features(scan.position, some), **rest)
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(path, **{one.name: getattr(made, one.name) for one in fields(Samples)})
    return {name: made}


def load_all(names: list[str], folder: Path | None, wanted: int) -> dict[str, Samples]:
    out: dict[str, Samples] = {}
    for name in names:
        out |= load(name, folder, wanted)
    return out


def world_of(title: str) -> str:
    return title.removesuffix(" known").removesuffix("-errors")


def groups(titles: list[str]) -> list[list[str]]:
    """GROUPS lists of scenes; all that shows one world is in one, so that no group knows another's world."""
    worlds = sorted({world_of(title) for title in titles})
    return [[title for title in titles if worlds.index(world_of(title)) % GROUPS == k] for k in range(GROUPS)]


def checked(names: list[str]) -> list[str]:
    """The names, or an error where one is held out: training must not see it."""
    held = [name for name in names if campaigns.named(name).held_out or name in campaigns.SPLIT["held out"]]
    if held:
        raise ValueError(f"{', '.join(held)}: held out by split.json. Train on other scenes.")
    return names


def kind_of(samples: Samples, kind: str) -> np.ndarray:
    return samples.cause == CAUSES.index(kind)
