# SPDX-License-Identifier: GPL-3.0-or-later
"""Neighbours beside scipy's cKDTree: python tests/bench/test_analysis.py. Needs PATINA_LIBRARY or a release build."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))
os.environ.setdefault("PATINA_LIBRARY", str(ROOT / "build/out/release/libpatina.so"))
import native  # noqa: E402

K = 16


def sets() -> dict[str, np.ndarray]:
    random = np.random.default_rng(19)
    angle, height = np.meshgrid(np.linspace(0, 1.5, 300), np.linspace(-0.5, 0.9, 120))
    direction = np.stack([np.cos(angle) * np.cos(height), np.sin(angle) * np.cos(height), np.sin(height)], -1).reshape(-1, 3)
    reach = 5 / np.maximum(np.abs(direction).max(1, keepdims=True), 0.1) * (1 + 1e-4 * random.standard_normal((len(direction), 1)))
    along = random.random((20000, 1))
    return {"random": random.random((40000, 3)),
            "scan": direction * reach,
            "lattice": np.stack(np.meshgrid(*[np.arange(24.0)] * 3), -1).reshape(-1, 3),
            "duplicates": np.repeat(np.round(random.random((4000, 3)) * 64) / 64, 5, 0),
            "collinear": along * [[1.0, 2.0, -0.5]],
            "uneven": np.exp(-7 * random.random((30000, 1))) * random.standard_normal((30000, 3)),
            "far": random.random((20000, 3)) + 5e6,
            "few": random.random((9, 3))}


def check(name: str, points: np.ndarray) -> None:
    """Equal distances, and equal numbers wherever a distance is a neighbour's alone; ties by number."""
    points = np.ascontiguousarray(points)
    cloud = native.Cloud(points)
    found = cloud.neighbourhoods("numbers", "distances", neighbours=K)
    wide = min(4 * K + 8, len(points))
    distances, numbers = cKDTree(points).query(points, wide)
    k = min(K, len(points) - 1)
    rounding = 1e-6 * np.ptp(points, 0).max() + 4 * np.spacing(np.abs(points).max())
    rows = np.arange(len(points))
    own = numbers == rows[:, None]
    own[~own.any(1), -1] = True  # among more duplicates than were asked for
    others = distances[~own].reshape(len(points), wide - 1)
    assert np.abs(found["distances"][:, :k] - others[:, :k]).max() <= rounding, name
    assert np.isinf(found["distances"][:, k:]).all() and (found["numbers"][:, k:] == 2**32 - 1).all(), name
    assert (found["numbers"][:, :k] != rows[:, None]).all(), name
    beyond = others[:, k] if others.shape[1] > k else np.full(len(points), np.inf)
    clear = beyond > others[:, k - 1] + 2 * rounding  # the set is the only one
    ours = np.sort(found["numbers"][:, :k], 1)
    theirs = np.sort(numbers[~own].reshape(len(points), wide - 1)[:, :k], 1)
    assert (ours[clear] == theirs[clear]).all(), name
    exact = np.linalg.norm(points[found["numbers"][:, :k].astype(np.int64)] - points[:, None], axis=2)
    assert np.abs(exact - found["distances"][:, :k]).max() <= rounding, name
    tied = np.diff(found["distances"][:, :k], axis=1) == 0
    assert (np.diff(found["numbers"][:, :k].astype(np.int64), axis=1)[tied] > 0).all(), name
    if name in ("lattice", "duplicates"):  # exact places: of those as far as the last, the least numbers
        for row in range(0, len(points), 97):
            square = ((points - points[row]) ** 2).sum(1)
            square[row] = np.inf
            assert (np.lexsort((rows, square))[:k] == found["numbers"][row, :k]).all(), (name, row)
    print(f"  {name}: {len(points)} points, {100 * clear.mean():.0f} % with one set of neighbours")


def main() -> int:
    failed = 0
    cases = sets()
    for name, points in cases.items():
        try:
            check(name, points)
        except AssertionError as error:
            failed += 1
            print(f"FAILED {name}: {error}")
    print(f"{len(cases) - failed} passed, {failed} failed, 0 skipped")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
