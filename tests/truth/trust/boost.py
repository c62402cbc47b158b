# SPDX-License-Identifier: GPL-3.0-or-later
"""Small boosted trees in whole numbers: the same samples give the same trees on every machine.

Features are sorted into at most BINS bins each. A tree is complete and DEPTH deep. Leaves are int16 in units of 1 / UNIT of the
log odds that a sample is right; a score is their sum. Gradients are whole numbers too (SIGMOID has 2^16 for one), so that sums
over samples are exact in any order (Chen and Guestrin 2016 for the gain)."""

from __future__ import annotations

import ctypes
import functools
import math
import os
import subprocess
from ctypes import c_int32, c_int64, c_void_p
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]

BINS = 32
DEPTH = 4
UNIT = 1024
ONE = 1 << 16  # of a probability
WIDEST = 16  # log odds beyond which a probability changes no more
RATE = 0.15
LEAST = 40.0  # of the second derivatives in a leaf, in samples times a quarter
DAMPED = 8.0  # added to a leaf's second derivatives
LEVELS = 16  # of trust, in four bits
TRUST = 1.0 - ((LEVELS - 1 - np.arange(LEVELS)) / (LEVELS - 1)) ** 2
QUANTILES = 200_000  # samples that thresholds are taken from
NEVER = 1 << 30  # a score that none reaches
LEAF = 0xFFFF  # in place of a node's feature
STEP = 16  # units of a score between two entries of SIGMOID
SIGMOID = np.array([round(ONE / (1.0 + math.exp(-k * STEP / UNIT)))
                    for k in range(-WIDEST * UNIT // STEP, WIDEST * UNIT // STEP + 1)], np.int64)


def thresholds(values: np.ndarray, bins: int = BINS) -> np.ndarray:
    """(n, F) → (F, bins - 1) float32, ascending: quantiles; where a feature has fewer values, the last ones are infinite."""
    out = np.full((values.shape[1], bins - 1), np.inf, np.float32)
    for f in range(values.shape[1]):
        column = np.sort(values[np.isfinite(values[:, f]), f])
        if len(column):
            at = np.unique(column[(np.arange(1, bins) * len(column)) // bins])
            out[f, : len(at)] = at
    return out


def binned(values: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """(n, F) float32 → uint8: how many thresholds of its feature are at most the value; all for what is not a number, which
    goes right in C as well."""
    out = np.empty(values.shape, np.uint8)
    for f in range(values.shape[1]):
        column = values[:, f]
        out[:, f] = np.searchsorted(edges[f], np.where(np.isnan(column), np.inf, column), side="right")
    return out


@dataclass(eq=False)
class Forest:
    """feature, bin (trees, 2^DEPTH - 1) uint8: breadth first; a sample goes right if its bin is at least the node's. leaf
    (trees, 2^DEPTH) int16."""

    edges: np.ndarray
    feature: np.ndarray
    bin: np.ndarray
    leaf: np.ndarray

    def score(self, bins: np.ndarray, trees: int | None = None) -> np.ndarray:
        """(n, F) uint8 → int32 (n,), of the first trees or all."""
        total = np.zeros(len(bins), np.int32)
        for feature, at, leaf in list(zip(self.feature, self.bin, self.leaf))[:trees]:
            total += leaf[leaves_of(bins, feature, at)]
        return total

    def nodes(self, tree: int) -> list[tuple[float, int, int]]:
        """(most, value, feature) in preorder: features up to `most` go left, to the next node; others `value` nodes on. A leaf has
        the feature LEAF and its score as value. Nodes that part nothing are left out."""
        out: list[tuple[float, int, int]] = []

        def add(node: int) -> None:
            if node >= 2**DEPTH - 1:
                out.append((0.0, int(self.leaf[tree, node - (2**DEPTH - 1)]), LEAF))
                return
            feature, at = int(self.feature[tree, node]), int(self.bin[tree, node])
            edge = self.edges[feature, at - 1] if at < BINS else np.float32(np.inf)
            if np.isinf(edge):
                add(2 * node + 1)
                return
            here = len(out)
            out.append((float(np.nextafter(edge, np.float32(-np.inf))), 0, feature))
            add(2 * node + 1)
            out[here] = (out[here][0], len(out) - here, feature)
            add(2 * node + 2)

        add(0)
        return out


@functools.cache
def _library() -> ctypes.CDLL:
    """trees.c, compiled where it is not yet."""
    path = ROOT / "build/out/truth-cache/libtruth_trees.so"
    if not path.is_file() or path.stat().st_mtime < max((HERE / f"trees.{ending}").stat().st_mtime for ending in "ch"):
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_suffix(f".{os.getpid()}")
        subprocess.run([os.environ.get("CC", "cc"), "-std=c11", "-O3", "-fPIC", "-shared", "-o", str(partial),
                        str(HERE / "trees.c")], check=True)
        partial.replace(path)
    library = ctypes.CDLL(str(path))
    library.trees_sums.restype = library.trees_leaves.restype = None
    library.trees_sums.argtypes = (c_void_p, c_int64, c_void_p, c_int64, c_void_p, c_int32, c_void_p, c_int32, c_int32, c_void_p,
                                   c_void_p, c_void_p)
    library.trees_leaves.argtypes = (c_void_p, c_int64, c_int64, c_void_p, c_void_p, c_int32, c_void_p)
    return library


def leaves_of(bins: np.ndarray, feature: np.ndarray, at: np.ndarray) -> np.ndarray:
    """The leaf (n,) int32 of each sample, in a complete tree. bins (n, F) uint8, C order."""
    out = np.empty(len(bins), np.int32)
    feature, at = np.ascontiguousarray(feature), np.ascontiguousarray(at)
    _library().trees_leaves(bins.ctypes.data, bins.shape[1], len(bins), feature.ctypes.data, at.ctypes.data, DEPTH, out.ctypes.data)
    return out


def _tree(bins: np.ndarray, some: np.ndarray, gradient: np.ndarray, second: np.ndarray, columns: np.ndarray
          ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A tree on some binned samples. gradient, second: int64 of these; columns: int32, features that it may use."""
    feature, at = np.zeros(2**DEPTH - 1, np.uint8), np.full(2**DEPTH - 1, 255, np.uint8)
    node = np.zeros(len(some), np.int32)  # within its level
    for level in range(DEPTH + 1):
        wide = 2**level
        sums = np.zeros((len(columns) if level < DEPTH else 1, wide, BINS, 2), np.int64)
        _library().trees_sums(bins.ctypes.data, bins.shape[1], some.ctypes.data, len(some), columns.ctypes.data, len(sums),
                              node.ctypes.data, wide, BINS, gradient.ctypes.data, second.ctypes.data, sums.ctypes.data)
        if level == DEPTH:
            break
        below = np.cumsum(sums, axis=2).astype(np.float64)
        (left_g, left_h), (all_g, all_h) = (np.moveaxis(x, -1, 0) for x in (below[:, :, :-1], below[:, :, -1:]))
        right_g, right_h = all_g - left_g, all_h - left_h
        gain = left_g**2 / (left_h + DAMPED * ONE) + right_g**2 / (right_h + DAMPED * ONE) - all_g**2 / (all_h + DAMPED * ONE)
        gain[(left_h < LEAST * ONE / 4) | (right_h < LEAST * ONE / 4)] = 0.0
        flat = np.moveaxis(gain, 1, 0).reshape(wide, -1)  # of equal ones the first column and bin count
        which, first = flat.argmax(axis=1), wide - 1
        parts = flat[np.arange(wide), which] > 0.0
        feature[first : first + wide][parts] = columns[which[parts] // (BINS - 1)]
        at[first : first + wide][parts] = which[parts] % (BINS - 1) + 1
        node = (2 * node + (bins[some, feature[first + node]] >= at[first + node])).astype(np.int32)
    g, h = np.moveaxis(sums[0].sum(axis=1).astype(np.float64), -1, 0)
    leaf = np.rint(UNIT * RATE * g / (h + DAMPED * ONE)).astype(np.int16)
    return feature, at, leaf


def train(values: np.ndarray, right: np.ndarray, weight: np.ndarray, trees: int, seed: int = 1, share: float = 0.2,
          columns: float = 0.5) -> Forest:
    """values (n, F) float32, right (n,) bool, weight (n,) small whole numbers. Each tree sees a share of the samples and of the
    features. An empty node keeps bin 255, so that all its samples go left."""
    random = np.random.default_rng(seed)
    edges = thresholds(values[:: max(1, len(values) // QUANTILES)])
    bins = binned(values, edges)
    score = np.zeros(len(bins), np.int32)
    found = []
    for _ in range(trees):
        some = np.flatnonzero(random.random(len(bins)) < share).astype(np.int64)
        mine = np.sort(random.permutation(bins.shape[1])[: max(1, math.ceil(columns * bins.shape[1]))]).astype(np.int32)
        entry = np.clip(score[some] // STEP + WIDEST * UNIT // STEP, 0, len(SIGMOID) - 1)
        p = SIGMOID[entry]
        w = weight[some].astype(np.int64)
        tree = _tree(bins, some, w * (right[some] * ONE - p), w * (p * (ONE - p) // ONE), mine)
        found.append(tree)
        score += tree[2][leaves_of(bins, tree[0], tree[1])]
    return Forest(edges, *(np.stack(part) for part in zip(*found)))


def isotonic(score: np.ndarray, right: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The rising step function nearest to `right` (pool adjacent violators): the middle score and the value of each step."""
    order = np.argsort(score, kind="stable")
    s, inverse = np.unique(score[order], return_inverse=True)
    w = np.bincount(inverse, weight[order])
    y = np.bincount(inverse, (weight * right)[order]) / np.maximum(w, 1e-300)
    middle, value, heavy = [], [], []
    for a, b, c in zip(s.astype(float), y, w):
        middle.append(a)
        value.append(b)
        heavy.append(c)
        while len(value) > 1 and value[-2] >= value[-1]:
            m, v, h = middle.pop(), value.pop(), heavy.pop()
            both = heavy[-1] + h
            middle[-1] = (middle[-1] * heavy[-1] + m * h) / both
            value[-1] = (value[-1] * heavy[-1] + v * h) / both
            heavy[-1] = both
    return np.array(middle), np.array(value)


@dataclass(eq=False)
class Calibration:
    """least (LEVELS - 1,) int32, rising: a sample is of the level that counts how many of these its score reaches. Level l stands
    for trust TRUST[l]. After `after` trees a score of at least `sure` is of the highest level at once."""

    least: np.ndarray
    after: int = 0
    sure: int = NEVER

    def level(self, score: np.ndarray, early: np.ndarray | None = None) -> np.ndarray:
        found = np.searchsorted(self.least, score, side="right")
        return found if early is None else np.where(early >= self.sure, LEVELS - 1, found)

    def trust(self, score: np.ndarray, early: np.ndarray | None = None) -> np.ndarray:
        return TRUST[self.level(score, early)]


def calibrate(score: np.ndarray, right: np.ndarray, weight: np.ndarray) -> Calibration:
    """Levels meet where the share of right samples, by isotonic regression, is halfway between what they stand for."""
    middle, value = isotonic(score, right.astype(float), weight)
    every = np.arange(int(score.min()), int(score.max()) + 1)
    share = np.interp(every, middle, value)
    halfway = 0.5 * (TRUST[1:] + TRUST[:-1])
    at = np.searchsorted(share, halfway)
    return Calibration(np.where(at < len(every), every[np.minimum(at, len(every) - 1)], NEVER).astype(np.int32))


def auc(score: np.ndarray, right: np.ndarray, weight: np.ndarray | None = None) -> float:
    """How often a right sample scores above a wrong one; ties count half."""
    weight = np.ones(len(score)) if weight is None else weight
    _, place = np.unique(score, return_inverse=True)
    good, bad = np.bincount(place, weight * right), np.bincount(place, weight * ~right)
    below = np.cumsum(bad) - bad
    whole = good.sum() * bad.sum()
    return float((good * (below + 0.5 * bad)).sum() / whole) if whole else float("nan")
