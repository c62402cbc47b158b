# SPDX-License-Identifier: GPL-3.0-or-later
"""The model in force: the constants that train.py wrote, read back from C, and a sum over the features that the library computes."""

from __future__ import annotations

import hashlib
import os
import re
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .boost import LEAF, Calibration

ROOT = Path(__file__).resolve().parents[3]
CONSTANTS = ROOT / "native/scene/analysis/trust_constants.h"
FEATURES = ROOT / "native/scene/analysis/trust_features.h"
COUNT = 6000  # points of the cloud that the sum is over


@dataclass(eq=False)
class Model:
    """Nodes of all trees in preorder: features up to `most` go left, to the next node; others `value` nodes on. A leaf's value is its
    score."""

    most: np.ndarray
    value: np.ndarray
    feature: np.ndarray
    roots: np.ndarray
    calibration: Calibration
    limit: int  # the default level

    def score(self, values: np.ndarray, trees: int | None = None) -> np.ndarray:
        """(n, F) float32 → int32 (n,), of the first trees or all."""
        total = np.zeros(len(values), np.int32)
        for root in self.roots[:trees]:
            node = np.full(len(values), root)
            while (inner := np.flatnonzero(self.feature[node] != LEAF)).size:
                at = node[inner]
                left = values[inner, self.feature[at]] <= self.most[at]
                node[inner] = at + np.where(left, 1, self.value[at])
            total += self.value[node]
        return total

    def level(self, values: np.ndarray) -> np.ndarray:
        """(n,) 0 to LEVELS - 1, as pt_trust_level."""
        return self.calibration.level(self.judged(values))

    def judged(self, values: np.ndarray) -> np.ndarray:
        """Scores; those that are sure after the first trees are of the highest level."""
        early, score = self.score(values, self.calibration.after), self.score(values)
        return np.where(early >= self.calibration.sure, np.maximum(score, self.calibration.least[-1]), score)


def read(text: str) -> Model:
    """Of trust_constants.h. ValueError where train.py did not write it."""
    numbers = re.search(r"SURE_AFTER = (\d+), SURE_SCORE = (-?\d+)", text)
    limit = re.search(r"are below level (\d+)", text)
    tables = re.findall(r"= \{\n(.*?)\n\};", text, re.S)
    if not numbers or not limit or len(tables) != 3:
        raise ValueError("no file that train.py wrote")
    nodes = np.array([[float(most), int(value), int(feature)] for most, value, feature in
                      re.findall(r"\{([-\d.e+]+)f?, (-?\d+), (\d+)\}", tables[2])])
    return Model(nodes[:, 0].astype(np.float32), nodes[:, 1].astype(np.int32), nodes[:, 2].astype(np.int64),
                 np.array([int(word) for word in re.findall(r"\d+", tables[1])]),
                 Calibration(np.array([int(word) for word in re.findall(r"-?\d+", tables[0])], np.int32), int(numbers[1]),
                             int(numbers[2])), int(limit[1]))


def fixed_cloud() -> tuple[np.ndarray, np.ndarray]:
    """Positions (COUNT, 3) float32 and two stations: walls that two scans see, a bar, a crown and strays. Whole steps of 2^-12 of a
    polynomial of random bits, so that every machine has the same."""
    random = np.random.RandomState(45)
    u, v, w = random.randint(0, 1 << 12, (3, COUNT)) / float(1 << 12)
    part = np.arange(COUNT) % 12
    position = np.stack([4.0 * u, 3.0 + 0.02 * w, 3.0 * v], 1)  # a wall
    floor, bar, crown, stray = part > 5, part == 9, part == 10, (part == 11) & (np.arange(COUNT) % 7 == 0)
    position[floor] = np.stack([4.0 * u, 3.0 * v, 0.01 * w], 1)[floor]
    position[bar] = np.stack([1.0 + 0.02 * u, 1.5 + 0.02 * v, 2.0 * w], 1)[bar]
    position[crown] = np.stack([2.5 + u, 1.0 + v, 1.5 + w], 1)[crown]
    position[stray] = np.stack([4.0 * u, 3.0 * v, 3.0 * w], 1)[stray]
    return (np.rint(position * (1 << 12)) / (1 << 12)).astype(np.float32), np.array([[0.5, 0.5, 1.5], [3.5, 0.5, 1.5]])


def library() -> Any:
    """The add-on's wrapper of the library: $PATINA_LIBRARY, else build/out/release/libpatina.so. None where there is none."""
    path = Path(os.environ.setdefault("PATINA_LIBRARY", str(ROOT / "build/out/release/libpatina.so")))
    if not path.is_file():
        return None
    sys.path.insert(0, str(ROOT / "addon"))
    import native
    return native


def sum_of_features(native: Any) -> str:
    """16 hexadecimal digits: a sum over the features of the fixed cloud, with and without stations. Features have the same bits on every
    machine."""
    position, stations = fixed_cloud()
    digest = hashlib.sha256()
    for given in ({}, {"stations": stations, "station": (np.arange(COUNT) % 2).astype(np.uint8)[:, None]}):
        cloud = native.Cloud(position, None, None)
        features = np.zeros((COUNT, native.abi.TRUST_FEATURES), np.float32)
        cloud.analyse(trust_features=features, **given)
        digest.update(features.tobytes())
    return digest.hexdigest()[:16]
