# SPDX-License-Identifier: GPL-3.0-or-later
"""LAZ (LASzip's VLR, its chunk table and its layers) through lazrs. Every size is compared with the file before lazrs sees it: lazrs
allocates what a file announces, up to 64 GiB. Used by main.py, and by the process that streams COPC and EPT. Imports nothing of the add-on.
"""

from __future__ import annotations

import struct
from typing import Any, BinaryIO

COUNT, LARGE = 1 << 22, 64 << 20  # points and bytes of a chunk above which it is unpacked piece by piece, on one thread
VARIABLE = 0xFFFFFFFF  # a chunk size: the table says how many points each chunk has
_LAYERS = {10: 9, 11: 1, 12: 2, 13: 1}  # of an item of point formats 6 to 10; type 14 has one for each byte
_PLAIN = {0, 6, 7, 8, 9}  # items of point formats 0 to 5


class LazError(Exception):
    """The text is for the artist."""


def layers_of(vlr: bytes, record: int) -> int:
    """How many layers a chunk has; 0 for point formats 0 to 5. LazError where the VLR does not describe records of that many bytes."""
    if len(vlr) < 34:
        raise LazError(f"its LASzip record is {len(vlr)} bytes long, at least 34 are needed")
    count, = struct.unpack_from("<H", vlr, 32)
    if len(vlr) < 34 + 6 * count:
        raise LazError(f"its LASzip record announces {count:,} items and is {len(vlr)} bytes long")
    items = [struct.unpack_from("<3H", vlr, 34 + 6 * i) for i in range(count)]
    if sum(size for _, size, _ in items) != record:
        raise LazError(f"its LASzip record describes points of {sum(size for _, size, _ in items):,} bytes, its header of {record:,}")
    if any(kind not in _PLAIN and kind not in _LAYERS and kind != 14 for kind, _, _ in items):
        raise LazError("its LASzip record names an unknown kind of item")
    return sum(size if kind == 14 else _LAYERS.get(kind, 0) for kind, size, _ in items)


def check_chunk(head: bytes, size: int, points: int | None, record: int, layers: int) -> None:
    """LazError where a chunk's first bytes announce layers that are longer than the chunk's size, or other points. After the first point
    come the number of points and the sizes of the layers."""
    start = record + 4 * (1 + layers)
    if size < start or len(head) < start:
        raise LazError(f"a chunk of {size:,} bytes is too short for {layers} layers")
    told, *sizes = struct.unpack_from(f"<I{layers}I", head, record)
    if sum(sizes) > size - start:
        raise LazError(f"a chunk of {size:,} bytes announces layers of {sum(sizes):,} bytes")
    if points is not None and told != points:
        raise LazError(f"a chunk announces {told:,} points instead of {points:,}")


def chunks_of(file: BinaryIO, total: int, offset: int, vlr: bytes, record: int, points: int) -> list[tuple[int, int]]:
    """(points, bytes) of each chunk; the last may have fewer points. total: bytes of the file."""
    import lazrs
    chunk, = struct.unpack_from("<I", vlr, 12)
    file.seek(offset)
    place = file.read(8)
    table = struct.unpack("<q", place)[0] if len(place) == 8 else 0
    if table == -1:  # written at the end, by a writer that could not go back
        file.seek(max(total - 8, 0))
        table, = struct.unpack("<q", file.read(8))
    if not offset + 8 <= table <= total - 8:
        raise LazError(f"its chunk table is at byte {table:,} of {total:,}")
    file.seek(table)
    version, count = struct.unpack("<II", file.read(8))
    room = table - offset - 8
    if version or count > room // record + 1:
        raise LazError(f"its chunk table announces {count:,} chunks in {room:,} bytes")
    if chunk != VARIABLE and count * chunk < points:
        raise LazError(f"its {count:,} chunks of {chunk:,} points cannot hold {points:,} points")
    file.seek(offset)
    found = [(held, size) for held, size in lazrs.read_chunk_table(file, lazrs.LazVlr(vlr))]
    if sum(size for _, size in found) > room or any(size < record for held, size in found if held and size):
        raise LazError(f"its chunk table announces {sum(size for _, size in found):,} bytes of points, of which the file has {room:,}")
    if sum(held for held, _ in found) < points:
        raise LazError(f"its chunks hold {sum(held for held, _ in found):,} of {points:,} points")
    return found


def run(path: str, order: dict[str, Any], channel: Any) -> None:
    """Unpacks all points. order: offset of the points, vlr (hexadecimal), record (bytes of a point), points, piece (points of an
    answer). LazError."""
    import lazrs
    vlr, record, points, offset = bytes.fromhex(order["vlr"]), order["record"], order["points"], order["offset"]
    layers = layers_of(vlr, record)
    with open(path, "rb") as file, open(path, "rb") as beside:
        total = file.seek(0, 2)
        chunks = chunks_of(beside, total, offset, vlr, record, points) if struct.unpack_from("<H", vlr)[0] != 1 else []
        largest = max((held for held, _ in chunks), default=points)
        file.seek(offset)
        parallel = chunks and largest <= COUNT and largest * record <= LARGE
        unpacker = (lazrs.ParLasZipDecompressor if parallel else lazrs.LasZipDecompressor)(file, vlr)
        checked, covered, place = 0, 0, offset + 8
        for first in range(0, points, order["piece"]):
            count = min(order["piece"], points - first)
            while layers and checked < len(chunks) and covered < first + count:
                held, size = chunks[checked]
                beside.seek(place)
                last = checked == len(chunks) - 1
                check_chunk(beside.read(record + 4 * (1 + layers)), size, None if last else held, record, layers)
                checked, covered, place = checked + 1, covered + held, place + size
            slot, memory = channel.slot()
            unpacker.decompress_many(memory[:count * record])
            channel.say({"slot": slot, "count": count})
    channel.say({"end": True})
