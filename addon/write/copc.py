# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes COPC 1.0: LAZ 1.4 whose chunks are the nodes of an octree, with the hierarchy behind them. Does not import bpy.

A node with more than LEAF points keeps one point of each of GRID cells per axis, and passes the others to its children. So the nodes down
to any level are a sample of the cloud.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

GRID_BITS = 7  # a node has 2**7 cells per axis
LEAF = 20_000  # points that are not split any more: about 200 kB of a node
BITS = 21  # of a Morton code per axis
PIECE = 1_000_000  # points that are compressed at a time, on all cores

_BASE = [("X", "<i4"), ("Y", "<i4"), ("Z", "<i4"), ("intensity", "<u2"), ("bit_fields", "u1"), ("flags", "u1"), ("raw_classification", "u1"),
         ("user_data", "u1"), ("scan_angle", "<i2"), ("point_source_id", "<u2"), ("gps_time", "<f8")]
PLAIN, COLORED = np.dtype(_BASE), np.dtype([*_BASE, ("red", "<u2"), ("green", "<u2"), ("blue", "<u2")])  # point formats 6 and 7
_ENTRY = np.dtype([("key", "<i4", 4), ("offset", "<u8"), ("size", "<i4"), ("count", "<i4")])
_HEAD, _VLR, _EVLR, _INFO = 375, "<H16sHH32s", "<H16sHQ32s", "<5d2Q2d88x"


def write(path: Path, rows: np.ndarray, scale: float, offset: np.ndarray, crs: bytes) -> None:
    """Writes records of PLAIN or COLORED, at least one. A coordinate is its integer times scale, plus offset (3,). crs: WKT, 0 at its end, or b"".

    OSError if the file cannot be written; errors of lazrs as they are."""
    import lazrs
    corner = np.array([int(rows[axis].min()) for axis in "XYZ"], np.int64)
    bits = max(max(int(rows[axis].max()) - int(low) for axis, low in zip("XYZ", corner, strict=True)).bit_length(), 1)
    order, keys, counts = _octree(rows, corner, bits)
    laszip = lazrs.LazVlr.new_for_compression(7 if rows.dtype == COLORED else 6, 0, True)
    half = 2.0 ** (bits - 1) * scale
    cube = (*((corner + 2 ** (bits - 1)) * scale + offset), half, 2.0 * half / 2 ** GRID_BITS)
    times = (float(rows["gps_time"].min()), float(rows["gps_time"].max()))
    records = [(b"copc", 1, bytes(struct.calcsize(_INFO))), (b"laszip encoded", 22204, bytes(laszip.record_data()))]
    records += [(b"LASF_Projection", 2112, crs)] if crs else []
    start = _HEAD + sum(54 + len(data) for _, _, data in records)
    with open(path, "w+b") as file:
        file.write(bytes(_HEAD))
        for user, number, data in records:
            file.write(struct.pack(_VLR, 0, user, number, len(data), b"") + data)
        sizes = _compress(file, laszip, rows, order, counts, start)
        entries = np.zeros(len(counts), _ENTRY)
        entries["key"], entries["size"], entries["count"] = keys, sizes, counts
        entries["offset"] = start + 8 + np.concatenate([[0], np.cumsum(sizes)[:-1]])
        end = file.seek(0, 2)
        file.write(struct.pack(_EVLR, 0, b"copc", 1000, entries.nbytes, b"") + entries.tobytes())
        file.seek(0)
        file.write(_head(rows, scale, offset, start, len(records), end, bool(crs)))
        file.seek(_HEAD + 54)
        file.write(struct.pack(_INFO, *cube, end + 60, entries.nbytes, *times))


def _octree(rows: np.ndarray, corner: np.ndarray, bits: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The rows by node, (n,), and of each node its key (depth, x, y, z) and count, coarse nodes first. The root's side is 2**bits integers."""
    codes = _morton(rows, corner, bits)
    left = np.argsort(codes, kind="stable")
    codes = codes[left]
    order, keys, counts = [], [], []
    deepest = BITS - GRID_BITS
    for depth in range(deepest + 1):
        nodes = codes >> np.uint64(3 * (BITS - depth))
        begins = np.flatnonzero(np.diff(nodes, prepend=~nodes[:1]))
        held = np.diff(begins, append=len(nodes))
        keep = np.repeat((held <= LEAF) | (depth == deepest), held)
        cells = np.flatnonzero(np.diff(codes >> np.uint64(3 * (deepest - depth)), prepend=~codes[:1], append=~codes[-1:]))
        keep[(cells[:-1] + cells[1:]) // 2] = True  # the middle of each cell's points along the curve
        order.append(left[keep])
        keys.append(np.column_stack([np.full(len(begins), depth), _places(nodes[begins])]))
        counts.append(np.add.reduceat(keep, begins, dtype=np.int64))
        left, codes = left[~keep], codes[~keep]
        if not len(left):
            break
    return np.concatenate(order), np.concatenate(keys), np.concatenate(counts)


def _morton(rows: np.ndarray, corner: np.ndarray, bits: int) -> np.ndarray:
    """(n,) uint64: codes of BITS bits per axis; the bits of x come last."""
    codes = np.zeros(len(rows), np.uint64)
    for axis, name in enumerate("XYZ"):
        cells = rows[name].astype(np.int64) - corner[axis]
        spread = (cells >> bits - BITS if bits > BITS else cells << BITS - bits).astype(np.uint64)
        for shift, kept in ((32, 0x1F00000000FFFF), (16, 0x1F0000FF0000FF), (8, 0x100F00F00F00F00F), (4, 0x10C30C30C30C30C3),
                            (2, 0x1249249249249249)):
            spread = (spread | spread << np.uint64(shift)) & np.uint64(kept)
        codes |= spread << np.uint64(axis)
    return codes


def _places(nodes: np.ndarray) -> np.ndarray:
    """(n, 3) int64 of Morton codes."""
    found = np.zeros((len(nodes), 3), np.int64)
    for bit in range(BITS):
        for axis in range(3):
            found[:, axis] |= (nodes >> np.uint64(3 * bit + axis) & np.uint64(1)).astype(np.int64) << bit
    return found


def _compress(file: object, laszip: object, rows: np.ndarray, order: np.ndarray, counts: np.ndarray, start: int) -> np.ndarray:
    """Writes one chunk for each node and the table of chunks. Returns their sizes in bytes."""
    import lazrs
    packer = lazrs.ParLasZipCompressor(file, laszip)
    packer.reserve_offset_to_chunk_table()
    ends = np.cumsum(counts)
    first = 0
    while first < len(counts):
        begin = int(ends[first] - counts[first])
        last = max(int(np.searchsorted(ends, begin + PIECE, "right")), first + 1)
        piece = rows[order[begin:ends[last - 1]]]
        packer.compress_chunks([piece[a - begin:b - begin].tobytes()
                                for a, b in zip(ends[first:last] - counts[first:last], ends[first:last], strict=True)])
        first = last
    packer.done()
    file.seek(start)
    return np.array([size for _, size in lazrs.read_chunk_table(file, laszip)], np.int64)


def _head(rows: np.ndarray, scale: float, offset: np.ndarray, start: int, records: int, end: int, has_crs: bool) -> bytes:
    """The header of LAS 1.4; end: where the extended records begin."""
    box = [float(limit(rows[axis])) * scale + offset[i] for i, axis in enumerate("XYZ") for limit in (np.max, np.min)]
    by_return = np.bincount(rows["bit_fields"] & 15, minlength=16)[1:16]
    form = (7 if rows.dtype == COLORED else 6) | 0x80
    head = struct.pack("<4sHH16xBB32s32sHHHIIBH24x", b"LASF", 0, 16 * has_crs, 1, 4, b"Patina", b"Patina", 1, 1, _HEAD, start, records, form,
                       rows.dtype.itemsize)
    head += struct.pack("<12d", *[scale] * 3, *offset, *box)
    return head + struct.pack("<QQIQ15Q", 0, end, 1, len(rows), *by_return.tolist())
