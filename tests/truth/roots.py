# SPDX-License-Identifier: GPL-3.0-or-later
"""All real roots of many functions at once, in float64."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Function = Callable[[np.ndarray, np.ndarray], np.ndarray]


def polish(f: Function, slope: Function, rows: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The root of f(row, t) in each bracket [a, b] with a change of sign: Newton, kept within the bracket by
    bisection."""
    a, b = a.copy(), b.copy()
    rising = f(rows, b) > 0.0
    t = 0.5 * (a + b)
    active = np.arange(len(t))
    for _ in range(80):
        if not len(active):
            break
        x = t[active]
        value = f(rows[active], x)
        above = (value > 0.0) == rising[active]
        b[active] = np.where(above, x, b[active])
        a[active] = np.where(above, a[active], x)
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = x - value / slope(rows[active], x)
        inside = (newton >= a[active]) & (newton <= b[active])
        following = np.where(inside, newton, 0.5 * (a[active] + b[active]))
        t[active] = following
        active = active[(np.abs(following - x) > 4e-16 * (1.0 + np.abs(x))) & (value != 0.0)]
    return t


def polynomial(c: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Roots in [low, high] of polynomials c (n, degree + 1), ascending powers: (n, degree), ascending, NaN where there
    is none. Between the roots of the derivative a polynomial is monotone: a change of sign is a root, and the only
    one."""
    n, degree = len(c), c.shape[1] - 1
    if degree == 1:
        with np.errstate(divide="ignore", invalid="ignore"):
            t = -c[:, 0] / c[:, 1]
        return np.where((t >= low) & (t <= high), t, np.nan)[:, None]
    derivative = c[:, 1:] * np.arange(1, degree + 1)
    turns = polynomial(derivative, low, high)
    edges = np.column_stack([low, np.sort(np.where(np.isnan(turns), high[:, None], turns), axis=1), high])

    def value(rows: np.ndarray, t: np.ndarray) -> np.ndarray:
        result = c[rows, degree]
        for k in range(degree - 1, -1, -1):
            result = result * t + c[rows, k]
        return result

    def slope(rows: np.ndarray, t: np.ndarray) -> np.ndarray:
        result = derivative[rows, degree - 1]
        for k in range(degree - 2, -1, -1):
            result = result * t + derivative[rows, k]
        return result

    everyone = np.arange(n)
    signs = np.stack([value(everyone, edges[:, k]) > 0.0 for k in range(degree + 1)], axis=1)
    rows, interval = np.nonzero(signs[:, 1:] != signs[:, :-1])
    roots = np.full((n, degree), np.nan)
    roots[rows, interval] = polish(value, slope, rows, edges[rows, interval], edges[rows, interval + 1])
    return np.sort(roots, axis=1)


def smooth(f: Function, slope: Function, bend: np.ndarray, low: np.ndarray, high: np.ndarray, steps: int) -> np.ndarray:
    """Roots in [low, high] of functions whose second derivative nowhere exceeds `bend` (n): (n, most), ascending,
    padded with NaN. Intervals are halved until each surely holds none or surely is monotone, so that none is missed,
    but for pairs closer than about 1e-7 of the range."""
    n = len(low)
    share = np.linspace(0.0, 1.0, steps + 1)
    grid = low[:, None] + (high - low)[:, None] * share
    rows = np.repeat(np.arange(n), steps)
    a, b = grid[:, :-1].ravel(), grid[:, 1:].ravel()
    least = 1e-7 * (high - low)
    found_rows, found = [], []
    while len(rows):
        fa, fb = f(rows, a), f(rows, b)
        width, m = b - a, bend[rows]
        change = (fa > 0.0) != (fb > 0.0)
        free = ~change & (np.minimum(np.abs(fa), np.abs(fb)) > m * width**2 / 8.0)
        monotone = np.abs(slope(rows, 0.5 * (a + b))) > 0.5 * m * width
        settled = free | monotone | (width < least[rows])
        one = settled & change
        if one.any():
            found_rows.append(rows[one])
            found.append(polish(f, slope, rows[one], a[one], b[one]))
        rows, a, b = rows[~settled], a[~settled], b[~settled]
        middle = 0.5 * (a + b)
        rows, a, b = np.concatenate([rows, rows]), np.concatenate([a, middle]), np.concatenate([middle, b])
    if not found:
        return np.full((n, 1), np.nan)
    return packed(np.concatenate(found_rows), np.concatenate(found), n)


def packed(rows: np.ndarray, values: np.ndarray, n: int) -> np.ndarray:
    """values of rows, ascending, as a table (n, most in one row), padded with NaN."""
    order = np.lexsort((values, rows))
    rows, values = rows[order], values[order]
    counts = np.bincount(rows, minlength=n)
    table = np.full((n, max(int(counts.max()), 1)), np.nan)
    table[rows, np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)] = values
    return table
