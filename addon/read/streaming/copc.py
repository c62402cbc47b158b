# SPDX-License-Identifier: GPL-3.0-or-later
"""COPC 1.0: LAZ whose points are an octree's nodes, each to be read by itself. Knows neither Blender nor the library: reader.py runs it in a
process of its own, without the rest of the add-on.

A node's points are a sample of its cube; those of all nodes over a place together are the cloud there.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from source import Pace, Source, SourceError

# Budgets of a file. Ten billion points in nodes of 65,000 are 150,000 nodes.
MOST_NODES = 1 << 21
MOST_PAGES = 10_000  # of the hierarchy
MOST_DEPTH = 30  # levels
MOST_HEAD = 1 << 24  # bytes before the points
MOST_POINTS = 1 << 24  # of a node: more is no octree
PACKED = 2  # times the bytes of its records, and EXTRA bytes: more than a node ever takes when it is packed
EXTRA = 4096
A_POINT = 40  # bytes, of the columns that are made of a point, twice
_INFO = 160  # bytes of its record
ENTRY = np.dtype([("key", "<i4", 4), ("offset", "<u8"), ("size", "<i4"), ("count", "<i4")])

_BASE = [("X", "<i4"), ("Y", "<i4"), ("Z", "<i4"), ("intensity", "<u2"), ("bits", "u1"), ("flags", "u1"), ("class", "u1"),
         ("user_data", "u1"), ("scan_angle", "<i2"), ("point_source_id", "<u2"), ("gps_time", "<f8")]
_RGB = [("red", "<u2"), ("green", "<u2"), ("blue", "<u2")]
_FORMATS = {6: _BASE, 7: _BASE + _RGB, 8: _BASE + _RGB + [("nir", "<u2")]}
SCALARS = ("intensity", "user_data", "point_source_id", "scan_angle", "nir", "gps_time", "return_number", "number_of_returns")


@dataclass
class Tree:
    """The file's head and its nodes, parents before their children."""

    kind: np.dtype  # of a record
    scale: np.ndarray  # (3,) float64
    offset: np.ndarray
    lower: np.ndarray  # box of all points
    upper: np.ndarray
    origin: np.ndarray  # (3,) float64; positions are relative to it
    laszip: bytes
    wkt: str
    nodes: np.ndarray  # of ENTRY
    parents: np.ndarray  # (n,) int64; -1: none
    cubes: np.ndarray  # (n, 6) float64, relative to the origin
    gaps: np.ndarray  # (n,) float64
    color: str = ""  # how colours become bytes: "low", "high", "wide" for 16 bits, "": there are none

    @property
    def points(self) -> int:
        return int(self.nodes["count"].sum())


def is_copc(head: bytes) -> bool:
    """Of a file's first 429 bytes."""
    return head[:4] == b"LASF" and head[377:381] == b"copc" and len(head) >= 429


def read_tree(source: Source) -> Tree:
    """SourceError with a sentence where it is none."""
    head = source.read(0, 375 + 54 + _INFO)
    if not is_copc(head) or head[24:26] != b"\x01\x04":
        raise SourceError("no COPC file: its first record is not 'copc'")
    header_size, data_offset, records, form, record_size = struct.unpack_from("<HIIBH", head, 94)
    scale, offset = (np.array(struct.unpack_from("<3d", head, at)) for at in (131, 155))
    high_x, low_x, high_y, low_y, high_z, low_z = struct.unpack_from("<6d", head, 179)
    lower, upper = np.array([low_x, low_y, low_z]), np.array([high_x, high_y, high_z])
    center_half_gap = struct.unpack_from("<5d", head, 429)
    root, root_size = struct.unpack_from("<2Q", head, 469)
    fields = _FORMATS.get(form & 0x3F)
    numbers = np.concatenate([scale, offset, lower, upper, center_half_gap])
    if fields is None or not np.isfinite(numbers).all() or center_half_gap[3] <= 0 or center_half_gap[4] <= 0 or (scale <= 0).any():
        raise SourceError("its head is damaged: point format, scale, box or octree are none")
    more = record_size - np.dtype(fields).itemsize
    if more < 0 or header_size != 375 or not 375 <= data_offset <= MOST_HEAD:
        raise SourceError(f"its head is damaged: records of {record_size:,} bytes are too short, or points at byte {data_offset:,} lie nowhere")
    laszip, wkt = _records(source, data_offset, records)
    nodes = _hierarchy(source, root, root_size, record_size)
    parents, cubes, gaps = arrange(nodes, np.array(center_half_gap[:3]), center_half_gap[3], center_half_gap[4])
    origin = origin_of(lower, upper, float(scale.min()))
    grown = np.tile(np.array([-1, 1])[:, None] * scale, 1).reshape(1, 6)  # points are rounded to the scale
    return Tree(np.dtype(fields + [("more", f"V{more}")] * bool(more)), scale, offset, lower, upper, origin, laszip, wkt, nodes,
                parents, cubes - np.tile(origin, 2) + grown, gaps)


def origin_of(lower: np.ndarray, upper: np.ndarray, step: float) -> np.ndarray:
    """What positions are relative to, so that float32 holds steps of the file's."""
    return np.floor(lower) if np.abs([lower, upper]).max() * 2.0 ** -24 > 0.5 * step else np.zeros(3)


def _records(source: Source, end: int, count: int) -> tuple[bytes, str]:
    """What LAZ needs to know, and the coordinate system's text."""
    head = source.read(375, end - 375)
    at, laszip, wkt = 0, b"", ""
    for _ in range(min(count, 4096)):
        if at + 54 > len(head):
            break
        number, length = struct.unpack_from("<HH", head, at + 18)
        user, data = head[at + 2:at + 18].rstrip(b"\0"), head[at + 54:at + 54 + length]
        if user == b"laszip encoded" and number == 22204:
            laszip = data
        elif user == b"LASF_Projection" and number == 2112:
            wkt = data.rstrip(b"\0").decode("utf-8", "replace")
        at += 54 + length
    if not laszip:
        raise SourceError("its head is damaged: it does not say how its points are packed")
    return laszip, wkt


def _hierarchy(source: Source, root: int, root_size: int, record_size: int) -> np.ndarray:
    """Entries of all nodes with points, by their key."""
    pages, found, seen, total = [(root, root_size, None)], [], set(), 0
    pace = Pace(MOST_PAGES, ENTRY.itemsize * (MOST_NODES + MOST_PAGES))
    while pages:
        offset, size, key = pages.pop()
        if offset in seen or offset > 1 << 60 or size <= 0 or size % ENTRY.itemsize or size > ENTRY.itemsize * MOST_NODES:
            raise SourceError("its octree is damaged: a page of the hierarchy lies nowhere, or twice")
        seen.add(offset)
        entries = np.frombuffer(source.read(offset, size), ENTRY)
        pace.add(size)
        if len(pages) + len(seen) + int((entries["count"] == -1).sum()) > MOST_PAGES:
            raise SourceError(f"its octree is damaged: its hierarchy has more than {MOST_PAGES:,} pages")
        for entry in entries[entries["count"] == -1]:
            below = tuple(entry["key"].tolist())
            if key is not None and not is_below(below, key):
                raise SourceError(NOT_BELOW)
            pages.append((int(entry["offset"]), int(entry["size"]), below))
        found.append(entries[entries["count"] > 0])
        total += len(found[-1])
        if total > MOST_NODES:
            raise SourceError(f"its octree is damaged: it has more than {MOST_NODES:,} nodes")
    nodes = np.concatenate(found)
    if not len(nodes) or (nodes["size"] <= 0).any() or (nodes["count"] > MOST_POINTS).any():
        raise SourceError("its octree is damaged: a node has no points, or too many")
    most = PACKED * record_size * nodes["count"].astype(np.int64) + EXTRA
    if (nodes["size"] > most).any():
        worst = nodes[np.argmax(nodes["size"] > most)]
        raise SourceError(f"its octree is damaged: a node of {worst['count']:,} points takes {worst['size']:,} bytes")
    return in_order(nodes)


NOT_BELOW = "its octree is damaged: a page of its hierarchy leads to one that is not below it"


def is_below(key: tuple[int, ...], above: tuple[int, ...]) -> bool:
    """Whether a cube, (depth, x, y, z), lies within another and is smaller: chains of pages are no longer than the octree is deep."""
    levels = key[0] - above[0]
    return 0 < levels and key[0] <= MOST_DEPTH and all(own >> levels == its for own, its in zip(key[1:], above[1:]))


def in_order(nodes: np.ndarray) -> np.ndarray:
    """By depth, and along Morton's curve: a picture's ids reach from the first to the last node in view of each of the cloud's parts, so that
    what lies together in space should do so in numbers, too."""
    keys = nodes["key"]
    fine, coarse = (sum(_spread(keys[:, 3 - axis] >> shift) << np.uint64(axis) for axis in range(3)) for shift in (0, 21))
    return nodes[np.lexsort([fine, coarse, keys[:, 0]])]


def _spread(numbers: np.ndarray) -> np.ndarray:
    """(N,) uint64: the low 21 bits, two places apart."""
    spread = numbers.astype(np.uint64) & np.uint64(0x1FFFFF)
    for shift, kept in ((32, 0x1F00000000FFFF), (16, 0x1F0000FF0000FF), (8, 0x100F00F00F00F00F), (4, 0x10C30C30C30C30C3), (2, 0x1249249249249249)):
        spread = (spread | spread << np.uint64(shift)) & np.uint64(kept)
    return spread


def arrange(nodes: np.ndarray, center: np.ndarray, half: float, gap: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of nodes sorted by key: parents, cubes and gaps. SourceError where they are no octree's."""
    keys = nodes["key"].astype(np.int64)
    depth = keys[:, 0]
    if depth.min() < 0 or depth.max() > MOST_DEPTH or (keys[:, 1:] < 0).any() or (keys[:, 1:] >= (1 << depth)[:, None]).any():
        raise SourceError("its octree is damaged: a node lies outside of it")
    parents = _parents(keys)
    side = 2.0 * half / (1 << depth)
    lower = center - half + keys[:, 1:] * side[:, None]
    return parents, np.hstack([lower, lower + side[:, None]]), gap / (1 << depth)


def _parents(keys: np.ndarray) -> np.ndarray:
    """The nearest node above each one that has points; -1: there is none. SourceError where a node is there twice."""
    odd = np.frombuffer(os.urandom(24), np.uint64) | np.uint64(1)  # nobody can make keys of one number
    found = np.full(len(keys), -1, np.int64)
    above: list[tuple[np.ndarray, np.ndarray]] = []  # by level: sorted numbers of keys, and the nodes they are of
    for level in range(int(keys[:, 0].max()) + 1):
        own = np.flatnonzero(keys[:, 0] == level)
        waiting, places = own, keys[own, 1:]
        for higher in reversed(range(level)):
            places = places >> 1
            numbers, nodes = above[higher]
            if len(numbers) and len(waiting):
                at = np.minimum(np.searchsorted(numbers, _numbers(places, odd)), len(numbers) - 1)
                there = (keys[nodes[at], 1:] == places).all(axis=1)
                found[waiting[there]] = nodes[at[there]]
                waiting, places = waiting[~there], places[~there]
        numbers = _numbers(keys[own, 1:], odd)
        order = np.argsort(numbers)
        if (np.diff(numbers[order]) == 0).any():
            raise SourceError("its octree is damaged: a node is there twice")
        above.append((numbers[order], own[order]))
    return found


def _numbers(places: np.ndarray, odd: np.ndarray) -> np.ndarray:
    with np.errstate(over="ignore"):
        mixed = places.astype(np.uint64) * odd
        return mixed[:, 0] + (mixed[:, 1] ^ mixed[:, 1] >> np.uint64(29)) + (mixed[:, 2] ^ mixed[:, 2] >> np.uint64(31))


def cost(tree: Tree, index: int) -> int:
    """Bytes of memory that a node takes while it is read: as it lies in the file, its records, and what is made of them."""
    return int(tree.nodes["size"][index]) + int(tree.nodes["count"][index]) * (2 * tree.kind.itemsize + A_POINT)


def fetch(tree: Tree, index: int, source: Source) -> bytes:
    """A node as it lies in the file."""
    return source.read(int(tree.nodes["offset"][index]), int(tree.nodes["size"][index]))


def key_of(tree: Tree, index: int) -> str:
    """Of a node, as Source.forget takes it."""
    return f"{tree.nodes['offset'][index]}-{tree.nodes['size'][index]}"


def unpack(tree: Tree, index: int, data: bytes) -> np.ndarray:
    """A node's records. SourceError where they are not what the file promises."""
    import lazrs
    count = int(tree.nodes["count"][index])
    if not _fits(tree.kind, count, data):
        raise SourceError("cannot be unpacked: its layers are longer than it is, or of other points")
    records = np.zeros(count, tree.kind)
    try:
        lazrs.decompress_points_with_chunk_table(data, tree.laszip, records.view(np.uint8), [(count, len(data))],
                                                 lazrs.DecompressionSelection(lazrs.SELECTIVE_DECOMPRESS_ALL))
    except Exception as error:
        raise SourceError(f"cannot be unpacked: {error}") from None
    except BaseException as error:  # what lazrs has not thought of is none of Exception's kinds
        if type(error).__name__ != "PanicException":
            raise
        raise SourceError(f"cannot be unpacked: {error}") from None
    return records


def _fits(kind: np.dtype, count: int, data: bytes) -> bool:
    """Whether a chunk's head is one: lazrs takes memory for layers as long as they say they are, 4 GB each. After the first point come the
    number of points and the sizes of the layers: nine, one of colours, one of infrared, one of each further byte."""
    names = kind.names
    layers = 9 + ("red" in names) + ("nir" in names) + (kind["more"].itemsize if "more" in names else 0)
    rest = len(data) - kind.itemsize - 4 * (1 + layers)
    if rest < 0:
        return False
    told, *sizes = struct.unpack_from(f"<I{layers}I", data, kind.itemsize)
    return told == count and sum(sizes) <= rest


def learn(tree: Tree, data: bytes, records: np.ndarray) -> None:
    """What the head does not tell, by the first node: how many bits colors have."""
    if "red" in tree.kind.names:
        tree.color = color_of(np.stack([records[name] for name in ("red", "green", "blue")]))


def color_of(rgb: np.ndarray) -> str:
    """How many bits colours have, by some of them."""
    if rgb.max() <= 255:
        return "low"
    return "high" if not (rgb & 255).any() or (rgb == (rgb >> 8) * 257).all() else "wide"


def columns(tree: Tree, index: int, records: np.ndarray, scalar: str) -> dict[str, np.ndarray]:
    """positions (n, 3) float32, relative to the origin; colors (n, 3) uint8 or uint16; scalars (n, 1) float32; classes (n, 1) uint8."""
    positions = placed(records, tree.scale, tree.offset - tree.origin, tree.cubes[index])
    found = {"positions": positions, "classes": np.ascontiguousarray(records["class"][:, None])}
    if tree.color:
        found["colors"] = colors_as(tree.color, np.stack([records[name] for name in ("red", "green", "blue")], 1))
    if scalar:
        found["scalars"] = scalar_of(records, scalar)
    return found


def placed(records: Mapping[str, np.ndarray] | np.ndarray, scale: np.ndarray, offset: np.ndarray, box: np.ndarray) -> np.ndarray:
    """(n, 3) float32 of X, Y and Z. SourceError where they are outside of the box, (6,)."""
    positions = np.empty((len(records["X"]), 3), np.float32)
    for axis, name in enumerate("XYZ"):
        exact = records[name] * scale[axis] + offset[axis]
        if not (exact.min() >= box[axis] and exact.max() <= box[3 + axis]):  # nor NaN
            raise SourceError("points outside of its cube")
        positions[:, axis] = exact
    return positions


def colors_as(how: str, rgb: np.ndarray) -> np.ndarray:
    """(n, 3) of the file as "low", "high" or "wide" has them."""
    if how == "wide":
        return rgb
    return np.minimum(rgb, 255).astype(np.uint8) if how == "low" else (rgb >> 8).astype(np.uint8)


def scalar_of(records: np.ndarray, name: str) -> np.ndarray:
    if name == "return_number":
        values = records["bits"] & 15
    elif name == "number_of_returns":
        values = records["bits"] >> 4
    else:
        values = records[name]
    return values.astype(np.float32)[:, None]


def has_scalar(tree: Tree, name: str) -> bool:
    return name in SCALARS and (name in tree.kind.names or name in {"return_number", "number_of_returns"})
