# SPDX-License-Identifier: GPL-3.0-or-later
"""Entwine Point Tiles 1 (entwine.io): a folder whose ept.json tells of an octree; each node is a LAZ file, or one of bare records. Knows neither
Blender nor the library: reader.py runs it in a process of its own, without the rest of the add-on.

As in a COPC, a node's points are a sample of its cube; those of all nodes over a place together are the cloud there.
"""

from __future__ import annotations

import io
import json
import re
import struct
import zlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import copc
import laz
import numpy as np
from address import last_of
from source import Pace, Source, SourceError, budget

ENDINGS = {"laszip": "laz", "binary": "bin"}
MOST_TEXT = 1 << 25  # bytes of a file of JSON: a million nodes
MOST_HEAD = 1 << 22  # bytes of ept.json
IN_MEMORY = 16  # times its bytes that JSON takes in Python
A_FILE = 65536  # bytes of a node's file beside its points
FETCHERS = 8  # of the hierarchy's files, at once
A_POINT = 10  # bytes, about, before a node was seen
A_RECORD = 67  # bytes of the widest point format of LAS: LAZ may hold more than the schema tells
MOST_HIERARCHY = 1 << 28  # bytes of all its files

_KEY = re.compile(r"(\d{1,2})-(\d{1,9})-(\d{1,9})-(\d{1,9})")
_NUMBERS = {("signed", 1): "i1", ("signed", 2): "<i2", ("signed", 4): "<i4", ("signed", 8): "<i8", ("unsigned", 1): "u1", ("unsigned", 2): "<u2",
            ("unsigned", 4): "<u4", ("unsigned", 8): "<u8", ("float", 4): "<f4", ("float", 8): "<f8"}

# What copc.SCALARS and others are called in LAS records, and among PDAL's dimensions.
_LAS = {"intensity": "intensity", "user_data": "user_data", "point_source_id": "point_source_id", "scan_angle": "scan_angle",
        "scan_angle_rank": "scan_angle", "nir": "nir", "gps_time": "gps_time", "red": "red", "green": "green", "blue": "blue", "X": "X", "Y": "Y", "Z": "Z"}
_PDAL = {"Intensity": "intensity", "UserData": "user_data", "PointSourceId": "point_source_id", "ScanAngleRank": "scan_angle",
         "ScanAngle": "scan_angle", "Infrared": "nir", "GpsTime": "gps_time", "Red": "red", "Green": "green", "Blue": "blue", "X": "X", "Y": "Y",
         "Z": "Z", "Classification": "class", "ReturnNumber": "return_number", "NumberOfReturns": "number_of_returns"}


@dataclass
class Tree:
    """What ept.json tells, and the nodes, parents before their children; as copc.Tree."""

    packed: str  # "laszip" or "binary"
    record: np.dtype | None  # of "binary"
    scale: np.ndarray  # (3,) float64, of "binary"; of "laszip" each node has its own
    offset: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    origin: np.ndarray
    wkt: str
    nodes: np.ndarray  # of copc.ENTRY; no offsets, and sizes are guesses
    parents: np.ndarray
    cubes: np.ndarray
    gaps: np.ndarray
    record_size: int = 0  # bytes of a point at most
    color: str = ""
    names: set[str] = field(default_factory=set)  # of what its points have


@dataclass
class Records:
    """A node's points, by name."""

    columns: dict[str, np.ndarray]
    scale: np.ndarray
    offset: np.ndarray


def read_tree(source: Source) -> Tree:
    """SourceError with a sentence where there is none."""
    name = last_of(source.name)
    head = _json(name, source.file(name, MOST_HEAD))
    try:
        bounds, tight = (np.array(box, float) for box in (head["bounds"], head.get("boundsConforming", head["bounds"])))
        packed, zipped, span = head["dataType"], {"json": False, "gzip": True}[head.get("hierarchyType", "json")], float(head.get("span", head.get("ticks")))
        fields = {item["name"]: (_NUMBERS.get((item["type"], item["size"]), f"V{int(item['size'])}"), float(item.get("scale", 1.0)),
                                 float(item.get("offset", 0.0))) for item in head["schema"]}
        wkt = head.get("srs", {}).get("wkt", "")
        scale, offset = (np.array([fields[axis][k] for axis in "XYZ"]) for k in (1, 2))
        record = np.dtype([(name, kind) for name, (kind, *_) in fields.items()])
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
        raise SourceError(f"{name} is damaged: bounds, span, schema or types are none of EPT's") from None
    if not isinstance(packed, str) or packed not in ENDINGS:
        raise SourceError(f"its points are packed as '{str(packed)[:40]}', which is not read: laszip and binary are")
    if packed == "binary" and any(fields[axis][0].startswith("V") for axis in "XYZ"):
        raise SourceError(f"{name} is damaged: X, Y or Z is no number that EPT has")
    if bounds.shape != (6,) or tight.shape != (6,) or not np.isfinite([*bounds, *tight, span, *scale, *offset]).all() or not span > 0 or not (scale > 0).all():
        raise SourceError(f"{name} is damaged: bounds, span or scale are none")
    sides = bounds[3:] - bounds[:3]
    if not sides.min() > 0 or sides.max() > sides.min() * (1 + 1e-6) or (tight[3:] < tight[:3]).any():
        raise SourceError(f"{name} is damaged: its bounds are no cube")
    lower, upper = tight[:3], tight[3:]
    nodes = _hierarchy(source, zipped)
    parents, cubes, gaps = copc.arrange(nodes, 0.5 * (bounds[:3] + bounds[3:]), 0.5 * float(sides[0]), float(sides[0]) / span)
    origin = copc.origin_of(lower, upper, float(scale.min()))
    grown = np.tile(np.array([-1, 1])[:, None] * scale, 1).reshape(1, 6)  # points are rounded to the scale
    return Tree(packed, record if packed == "binary" else None, scale, offset, lower, upper, origin, wkt if isinstance(wkt, str) else "", nodes,
                parents, cubes - np.tile(origin, 2) + grown, gaps, max(record.itemsize, A_RECORD))


def _json(name: str, data: bytes) -> dict:
    try:
        found = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise SourceError(f"{name} is damaged: {type(error).__name__}: {error}") from None
    if not isinstance(found, dict):
        raise SourceError(f"{name} is damaged: it holds no object")
    return found


def _hierarchy(source: Source, zipped: bool) -> np.ndarray:
    """Entries of all nodes with points, by their key."""
    waiting, seen, found, total = ["0-0-0-0"], {"0-0-0-0"}, [], 0
    pace = Pace(copc.MOST_PAGES, MOST_HIERARCHY)
    pool = ThreadPoolExecutor(FETCHERS)
    try:
        while waiting:
            below = []
            for page, (name, counts, size) in zip(waiting, pool.map(lambda key: _counts(source, key, zipped), waiting)):
                above = tuple(map(int, page.split("-")))
                pace.add(size)
                own: list[tuple[int, ...]] = []
                for key, count in counts.items():
                    match = _KEY.fullmatch(key)
                    if not match or type(count) is not int or not -1 <= count <= copc.MOST_POINTS:
                        raise SourceError(f"its octree is damaged: {name} says '{str(key)[:40]}': {str(count)[:40]}")
                    if count == -1:
                        if key in seen:
                            raise SourceError(f"its octree is damaged: {name} points to {key}, which was read before")
                        if not copc.is_below(tuple(map(int, match.groups())), above):
                            raise SourceError(copc.NOT_BELOW)
                        seen.add(key)
                        below.append(key)
                    elif count:
                        own.append((*map(int, match.groups()), count))
                found.append(np.array(own, np.int64).reshape(-1, 5))
                total += len(own)
                if total > copc.MOST_NODES:
                    raise SourceError(f"its octree is damaged: it has more than {copc.MOST_NODES:,} nodes")
                if len(seen) > copc.MOST_PAGES:
                    raise SourceError(f"its octree is damaged: its hierarchy has more than {copc.MOST_PAGES:,} pages")
            waiting = below
    finally:
        pool.shutdown(cancel_futures=True)
    if not total:
        raise SourceError("its octree is damaged: no node has points")
    nodes, numbers = np.zeros(total, copc.ENTRY), np.concatenate(found)
    nodes["key"], nodes["count"] = numbers[:, :4], numbers[:, 4]
    nodes["size"] = np.minimum(A_POINT * numbers[:, 4], 0x7fffffff)
    return copc.in_order(nodes)


def _counts(source: Source, key: str, zipped: bool) -> tuple[str, dict, int]:
    """A file of the hierarchy: its name, what it says, and its bytes."""
    name = f"ept-hierarchy/{key}.json" + ".gz" * zipped
    data = source.file(name, MOST_TEXT)
    if zipped:
        unzip = zlib.decompressobj(31)
        try:
            data = unzip.decompress(data, MOST_TEXT)
        except zlib.error as error:
            raise SourceError(f"{name} cannot be unpacked: {error}") from None
        if not unzip.eof:
            raise SourceError(f"{name} cannot be unpacked: it is cut, or too large")
    if data.count(b"{") > 1 or b"[" in data:  # Python takes twenty times as much memory for lists in lists
        raise SourceError(f"its octree is damaged: {name} holds lists or objects among its numbers")
    with budget.of(IN_MEMORY * len(data)):
        return name, _json(name, data), len(data)


def fetch(tree: Tree, index: int, source: Source) -> bytes:
    """A node's file."""
    return source.file(key_of(tree, index), _most(tree, index))


def _most(tree: Tree, index: int) -> int:
    """Bytes that a node's file takes at most."""
    return copc.PACKED * tree.record_size * int(tree.nodes["count"][index]) + A_FILE


def cost(tree: Tree, index: int) -> int:
    """As copc.cost."""
    return _most(tree, index) + int(tree.nodes["count"][index]) * (2 * tree.record_size + copc.A_POINT)


def key_of(tree: Tree, index: int) -> str:
    """Of a node, the name of its file."""
    return f"ept-data/{'-'.join(map(str, tree.nodes['key'][index].tolist()))}.{ENDINGS[tree.packed]}"


def unpack(tree: Tree, index: int, data: bytes) -> Records:
    """A node's points. SourceError where they are not what the folder promises."""
    count = int(tree.nodes["count"][index])
    if tree.packed == "binary":
        held, rest = divmod(len(data), tree.record.itemsize)
        if held != count or rest:
            raise SourceError(f"{key_of(tree, index)} holds {held:,} points, where the hierarchy says {count:,}")
        raw = np.frombuffer(data, tree.record)
        return Records({own: raw[name] for name, own in _PDAL.items() if name in raw.dtype.names and raw.dtype[name].kind != "V"}, tree.scale, tree.offset)
    raw, scale, offset = _laz(key_of(tree, index), data, count)
    names, old = raw.dtype.names, "raw_classification" in raw.dtype.names
    columns = {own: raw[name] for name, own in _LAS.items() if name in names}
    columns["class"] = raw["raw_classification"] & 31 if old else raw["classification"]
    columns["return_number"] = raw["bit_fields"] & (7 if old else 15)
    columns["number_of_returns"] = raw["bit_fields"] >> 3 & 7 if old else raw["bit_fields"] >> 4
    return Records(columns, scale, offset)


def _laz(name: str, data: bytes, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    import laspy
    import lazrs
    _check(name, data, count)
    try:
        with laspy.open(io.BytesIO(data), laz_backend=laspy.LazBackend.Lazrs) as file:
            header = file.header
            if header.point_count != count:
                raise SourceError(f"{name} holds {header.point_count:,} points, where the hierarchy says {count:,}")
            raw = file.read_points(count).array
            if len(raw) != count:
                raise SourceError(f"{name} ends after {len(raw):,} of {count:,} points")
            return raw, np.array(header.scales, float), np.array(header.offsets, float)
    except SourceError:
        raise
    except (laspy.errors.LaspyException, lazrs.LazrsError, ValueError, OSError, KeyError, IndexError, EOFError, MemoryError, OverflowError,
            struct.error) as error:
        raise SourceError(f"{name} cannot be unpacked: {error}") from None
    except BaseException as error:  # what lazrs has not thought of is none of Exception's kinds
        if type(error).__name__ != "PanicException":
            raise
        raise SourceError(f"{name} cannot be unpacked: {error}") from None


def _check(name: str, data: bytes, count: int) -> None:
    """Compares the sizes that a LAZ announces with its own, before lazrs allocates them."""
    if len(data) < 227 or data[:4] != b"LASF":
        raise SourceError(f"{name} is no LAS file")
    at, offset, records, form, record = struct.unpack_from("<HIIBH", data, 94)
    vlr = b""
    for _ in range(min(records, 4096)):
        if at + 54 > min(offset, len(data)):
            break
        number, length = struct.unpack_from("<HH", data, at + 18)
        if data[at + 2:at + 18].rstrip(b"\0") == b"laszip encoded" and number == 22204:
            vlr = data[at + 54:at + 54 + length]
        at += 54 + length
    if not form & 0xC0:
        return
    try:
        layers, place = laz.layers_of(vlr, record), offset + 8
        for held, size in laz.chunks_of(io.BytesIO(data), len(data), offset, vlr, record, count):
            if layers:
                laz.check_chunk(data[place:place + record + 4 * (1 + layers)], size, None, record, layers)
            place += size
    except (laz.LazError, struct.error, lazrs_error()) as error:
        raise SourceError(f"{name} cannot be unpacked: {error}") from None


def lazrs_error() -> type[Exception]:
    import lazrs
    return lazrs.LazrsError


def learn(tree: Tree, data: bytes, records: Records) -> None:
    """What ept.json does not tell, by the first node: what points have, how many bits colors have, and how well they are packed."""
    tree.names = set(records.columns)
    tree.nodes["size"] = np.clip(tree.nodes["count"] * (len(data) / int(tree.nodes["count"][0])), 1, 0x7fffffff)
    if {"red", "green", "blue"} <= tree.names:
        tree.color = copc.color_of(_rgb(records, 0))


def _rgb(records: Records, axis: int) -> np.ndarray:
    return np.stack([records.columns[name] for name in ("red", "green", "blue")], axis).astype(np.uint16, copy=False)


def columns(tree: Tree, index: int, records: Records, scalar: str) -> dict[str, np.ndarray]:
    """As copc.columns."""
    if tree.names - set(records.columns):
        raise SourceError(f"{key_of(tree, index)} lacks {', '.join(sorted(tree.names - set(records.columns)))}, which other nodes have")
    positions = copc.placed(records.columns, records.scale, records.offset - tree.origin, tree.cubes[index])
    classes = records.columns.get("class", np.zeros(len(positions), np.uint8))
    found = {"positions": positions, "classes": np.ascontiguousarray(classes.astype(np.uint8)[:, None])}
    if tree.color:
        found["colors"] = copc.colors_as(tree.color, _rgb(records, 1))
    if scalar:
        found["scalars"] = records.columns[scalar].astype(np.float32)[:, None]
    return found


def has_scalar(tree: Tree, name: str) -> bool:
    return name in copc.SCALARS and name in tree.names
