# SPDX-License-Identifier: GPL-3.0-or-later
"""COPC files of known points, for tests: laspy writes none. Each node is a chunk of LAZ, then the hierarchy (COPC 1.0)."""

import struct

import numpy as np

SCALE = 0.001
RECORD = np.dtype([("X", "<i4"), ("Y", "<i4"), ("Z", "<i4"), ("intensity", "<u2"), ("bits", "u1"), ("flags", "u1"), ("class", "u1"),
                   ("user_data", "u1"), ("scan_angle", "<i2"), ("point_source_id", "<u2"), ("gps_time", "<f8"), ("red", "<u2"),
                   ("green", "<u2"), ("blue", "<u2")])
DEPTH = 4  # levels, at most


def points_of(count, offset=(0.0, 0.0, 0.0), seed=1, wide=False):
    """Random points of a sphere of radius 1 with colors, classes and intensities, as records and as (n, 3) float64."""
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    records = np.zeros(count, RECORD)
    for k, name in enumerate("XYZ"):
        records[name] = np.round(directions[:, k] / SCALE)
        records[("red", "green", "blue")[k]] = (directions[:, k] * 100 + 128).astype(int) * (251 if wide else 257)
    records["class"] = 2 + (directions[:, 2] > 0)
    records["intensity"] = rng.integers(0, 60000, count)
    records["bits"] = 1 | 2 << 4
    positions = np.stack([records[name] for name in "XYZ"], 1) * SCALE + offset
    return records, positions


def write_copc(path, records, offset=(0.0, 0.0, 0.0), least=400, wkt="", pages=False):
    """pages: each child of the root has a page of the hierarchy. Returns the entries, (key, offset, size, count)."""
    import lazrs
    center, half = np.asarray(offset), 1.001
    gap = np.sqrt(4 * np.pi / max(least, 1))
    vlr = lazrs.LazVlr.new_for_compression(7, 0, True)
    laszip = bytes(vlr.record_data())
    nodes = nodes_of(records, half, least)
    info = np.zeros(160, np.uint8).tobytes()
    texts = [(b"copc", 1, info), (b"laszip encoded", 22204, laszip)] + ([(b"LASF_Projection", 2112, wkt.encode() + b"\0")] if wkt else [])
    data_offset = 375 + sum(54 + len(data) for _, _, data in texts)
    body, entries, at = [], [], data_offset + 8
    for key, part in nodes:
        packed = _pack(lazrs, vlr, part)
        entries.append((key, at, len(packed), len(part)))
        body.append(packed)
        at += len(packed)
    table = _chunk_table(lazrs, vlr, [(entry[3], entry[2]) for entry in entries])
    hierarchy, root_size = _hierarchy(entries, at + len(table) + 60, pages)
    info = struct.pack("<5d2Q2d", *center, half, gap, at + len(table) + 60, root_size, 0.0, 0.0) + bytes(88)
    texts[0] = (b"copc", 1, info)
    low, high = (np.array([records[name].astype(np.int64).__getattribute__(which)() for name in "XYZ"]) * SCALE + offset
                 for which in ("min", "max"))
    head = bytearray(375)
    head[:4], head[24:26] = b"LASF", b"\x01\x04"
    struct.pack_into("<HIIBHI", head, 94, 375, data_offset, len(texts), 7 | 0x80, RECORD.itemsize, 0)
    struct.pack_into("<H", head, 6, 16 if wkt else 0)
    struct.pack_into("<6d", head, 131, SCALE, SCALE, SCALE, *offset)
    struct.pack_into("<6d", head, 179, high[0], low[0], high[1], low[1], high[2], low[2])
    struct.pack_into("<QI", head, 235, at + len(table), 1)
    struct.pack_into("<Q", head, 247, len(records))
    with open(path, "wb") as file:
        file.write(head)
        for user, number, data in texts:
            file.write(struct.pack("<H16sHH32s", 0, user, number, len(data), b"") + data)
        file.write(struct.pack("<q", at) + b"".join(body) + table)
        file.write(struct.pack("<H16sHQ32s", 0, b"copc", 1000, len(hierarchy), b"") + hierarchy)
    return entries


def too_fine(depth, nodes=1400, count=1 << 24):
    """(key, count) of nodes that nobody made: billions of points, finer than all others."""
    side = np.arange(nodes)
    return [((depth, int(x), int(y), int(z)), count) for x, y, z in zip(side % 16, side // 16 % 16, side // 256, strict=True)]


def claim(path, to, entries, more):
    """The COPC in `path` again, whose hierarchy tells of `more`, too, which lie nowhere."""
    data = bytearray(path.read_bytes())
    rows = b"".join(struct.pack("<4iQii", *key, offset, size, count)
                    for key, offset, size, count in [*entries, *((key, 1 << 40, 1000, count) for key, count in more)])
    struct.pack_into("<2Q", data, 469, len(data), len(rows))
    struct.pack_into("<Q", data, 247, sum(entry[3] for entry in entries) + sum(count for _, count in more))
    to.write_bytes(bytes(data) + rows)


def nodes_of(records, half, least):
    """(key, records) by depth: each node keeps `least` points of its cube, evenly taken, the rest goes to its children."""
    found, waiting = [], [((0, 0, 0, 0), records)]
    while waiting:
        key, own = waiting.pop(0)
        last = key[0] == DEPTH - 1 or len(own) <= least
        keep = np.ones(len(own), bool) if last else np.zeros(len(own), bool)
        keep[np.linspace(0, len(own) - 1, least).astype(int)] = True
        found.append((key, own[keep]))
        rest, side = own[~keep], 2 * half / (1 << key[0] + 1)
        places = np.stack([((rest[name] * SCALE + half) // side).astype(int) for name in "XYZ"], 1)
        for child in np.unique(places, axis=0):
            waiting.append(((key[0] + 1, *map(int, child)), rest[(places == child).all(axis=1)]))
    return sorted(found, key=lambda node: node[0])


def _pack(lazrs, vlr, records):
    """One chunk, without the place of the table before it and the table behind."""
    import io
    stream = io.BytesIO()
    packer = lazrs.LasZipCompressor(stream, vlr)
    packer.compress_many(np.frombuffer(records.tobytes(), np.uint8))
    packer.finish_current_chunk()
    packer.done()
    data = stream.getvalue()
    table = struct.unpack("<q", data[:8])[0]
    return data[8:table]


def _chunk_table(lazrs, vlr, chunks):
    import io
    stream = io.BytesIO()
    lazrs.write_chunk_table(stream, chunks, vlr)
    return stream.getvalue()


def _hierarchy(entries, place, pages):
    def raw(rows):
        return b"".join(struct.pack("<4iQii", *key, offset, size, count) for key, offset, size, count in rows)

    if not pages:
        return raw(entries), 32 * len(entries)
    below = [[entry for entry in entries if entry[0][0] and _first(entry[0]) == child] for child in range(8)]
    below = [rows for rows in below if rows]
    top, tail, at = [entries[0]], b"", place + 32 * (1 + len(below))
    for rows in below:
        part = raw(rows)
        top.append((rows[0][0], at, len(part), -1))
        tail, at = tail + part, at + len(part)
    return raw(top) + tail, 32 * len(top)


def _first(key):
    """Which child of the root a node lies in."""
    return sum((value >> key[0] - 1) << k for k, value in enumerate(key[1:]))
