# SPDX-License-Identifier: GPL-3.0-or-later
"""Brings the colors of scans to each other that were exposed differently: a gain a scan and channel, found where scans overlap.

Space is cut into cells of a few points a scan. A cell that holds points of two scans says by which factor their light differs; the
median over their cells is that of the pair, and the gains are the least squares of all pairs, in logarithms. Of scans that hang
together the mean over their points stays.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np
from bpy.types import Context, Object, Operator

from .. import importers, jobs, native, point_data
from ..sync import attributes, edits, linked, scans_of
from . import scans

MOST_POINTS = 4_000_000  # looked at; of more every so-manieth
A_CELL = 6.0  # points of a scan in a cell, in the mean
LEAST_POINTS = 3  # of a scan in a cell that counts
LEAST_CELLS = 8  # of two scans that overlap
DARK, BRIGHT = 0.002, 0.98  # light: below there is noise, above it was cut off


@dataclass(frozen=True)
class Balance:
    gains: np.ndarray  # (scans, 3)
    alone: list[int]  # scans that overlap no other; their gains are 1


def find(positions: np.ndarray, light: np.ndarray, of: np.ndarray, count: int) -> Balance:
    """positions, light: (n, 3), linear; of: (n,) below count, the scan of each."""
    points = np.bincount(of, minlength=count)
    good = np.isfinite(positions).all(axis=1) & (light > DARK).all(axis=1) & (light < BRIGHT).all(axis=1)
    positions, light, of = positions[good].astype(np.float64), light[good].astype(np.float64), of[good].astype(np.int64)
    first, second, ways, weights = _pairs(*_groups(positions, light, of, count))
    rows, sides = [], []
    graph = np.eye(count, dtype=bool)
    for pair in np.unique(first * count + second):
        own = first * count + second == pair
        if own.sum() < LEAST_CELLS:
            continue
        i, j = divmod(int(pair), count)
        row = np.zeros(count)
        row[i], row[j] = 1.0, -1.0
        share = np.sqrt(weights[own].sum())
        rows.append(row * share)
        sides.append(-_medians(ways[own], weights[own]) * share)
        graph[i, j] = graph[j, i] = True
    if not rows:
        return Balance(np.ones((count, 3)), list(range(count)))
    logs = np.linalg.lstsq(np.array(rows), np.array(sides), rcond=None)[0]
    for together in _islands(graph):
        logs[together] -= (logs[together] * points[together, None]).sum(axis=0) / max(points[together].sum(), 1)
    return Balance(np.exp(logs), [scan for scan in range(count) if graph[scan].sum() == 1])


def _groups(positions: np.ndarray, light: np.ndarray, of: np.ndarray, count: int) -> tuple[np.ndarray, ...]:
    """Of each cell and each scan in it: the cell's number, the scan, the light's mean and how many points; by cells."""
    lower = positions.min(axis=0, initial=np.inf)
    extent = max(float((positions.max(axis=0, initial=-np.inf) - lower).max()), 1e-30) if len(positions) else 1.0
    edge = extent / 2048.0
    while True:
        cell = ((positions - lower) / edge).astype(np.int64)
        key = ((cell[:, 0] << 26 | cell[:, 1] << 13 | cell[:, 2]) * count) + of
        keys, group = np.unique(key, return_inverse=True)
        if not len(keys) or len(key) / len(keys) >= A_CELL or edge > extent / 8.0:
            break
        edge *= 1.5
    sizes = np.bincount(group, minlength=len(keys)) if len(keys) else np.zeros(0)
    means = np.stack([np.bincount(group, light[:, k], len(keys)) for k in range(3)], 1) / sizes[:, None] if len(keys) else np.zeros((0, 3))
    return keys // count, keys % count, means, sizes


def _pairs(cells: np.ndarray, of: np.ndarray, means: np.ndarray, sizes: np.ndarray) -> tuple[np.ndarray, ...]:
    """Of each two scans in a cell: which (the lower first), the logarithm of the light's ratio, and a weight."""
    enough = sizes >= LEAST_POINTS
    cells, of, means, sizes = cells[enough], of[enough], np.log(means[enough]), sizes[enough]
    found = []
    for apart in range(1, len(cells)):
        same = np.flatnonzero(cells[apart:] == cells[:-apart])
        if not len(same):
            break
        found.append((of[same], of[same + apart], means[same] - means[same + apart], np.minimum(sizes[same], sizes[same + apart])))
    if not found:
        return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0)
    return tuple(np.concatenate(column) for column in zip(*found, strict=True))


def _medians(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(3,) of (n, 3), weighted: outliers, as where something moved between two scans, do not count."""
    found = np.empty(3)
    for k in range(3):
        order = np.argsort(values[:, k])
        sums = np.cumsum(weights[order])
        found[k] = values[order, k][np.searchsorted(sums, 0.5 * sums[-1])]
    return found


def _islands(graph: np.ndarray) -> list[np.ndarray]:
    """Indices of the scans that hang together."""
    reach = graph.copy()
    while (wider := reach @ graph).sum() > reach.sum():
        reach = wider
    return [np.flatnonzero(row) for row in np.unique(reach, axis=0)]


def read(obj: Object, context: Context) -> tuple[np.ndarray, np.ndarray | None, scans_of.Scans | None, np.ndarray | None]:
    """Positions, light or None, scans, and which of them each point is of. PatinaError where a linked file cannot be read."""
    if obj.patina.linked_file:
        notices: list[str] = []
        source = linked.source_of(obj, context.scene.frame_current, notices)
        if source is None:
            raise native.PatinaError(notices[0] if notices else "the file is missing")
        module = importers.reader(source.path)
        file = jobs.run(lambda: module.read(source.path, importers.Filter(), importers.Progress()), lambda: None, lambda: False)
        return file.positions, _light(file.colors), *scans_of.scans_in(file.scalars)
    data = obj.data
    count = point_data.count_of(data)
    return (attributes.positions(data, count), _light(attributes.colors(data, count, obj.patina.color_attribute)), *scans.of_points(obj))


def _light(colors: np.ndarray | None) -> np.ndarray | None:
    if colors is None or colors.dtype != np.uint8:
        return None if colors is None else colors[:, :3]
    s = np.arange(256) / 255.0
    return np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4).astype(np.float32)[colors[:, :3]]


class PATINA_OT_scans_balance(scans.OfScans, Operator):
    """Find by how much the colors of scans differ where these overlap, as with other exposures, and bring them to each other. Balance
    switches it off and on; what is graded by hand stays"""

    bl_idname = "object.patina_scans_balance"
    bl_label = "Balance Colors"

    def change(self, context: Context, obj: Object) -> set[str]:
        positions, light, found, of = read(obj, context)
        if light is None or found is None:
            lacks = "no colors" if light is None else "not several scans"
            self.report({'ERROR'}, f"Patina: '{obj.name}' has {lacks} to balance")
            return {'CANCELLED'}
        step = len(of) // MOST_POINTS + 1
        balance = find(positions[::step], light[::step], of[::step], len(found.numbers))
        scans.listed(obj, found, of)
        group = obj.patina.points
        by_number = {edits.number_of(item): item for item in group.scans}
        for number, gains in zip(found.numbers, balance.gains, strict=True):
            by_number[number].balance = gains
        group.use_balance = len(balance.alone) < len(found.numbers)
        if balance.alone:
            names = ", ".join(by_number[found.numbers[index]].name for index in balance.alone[:5])
            self.report({'WARNING'}, f"Patina: '{obj.name}': {names}{', ...' * (len(balance.alone) > 5)}: overlap no other scan and were not changed")
        if not group.use_balance:
            return {'CANCELLED'}
        spread = balance.gains.max(axis=0) / balance.gains.min(axis=0)
        self.report({'INFO'}, f"Balanced {len(found.numbers) - len(balance.alone)} scans, which were up to {spread.max() - 1.0:.0%} apart")
        return {'FINISHED'}


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_scans_balance,))
