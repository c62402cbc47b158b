# SPDX-License-Identifier: GPL-3.0-or-later
"""The head of an E57 file (ASTM E2807): what its XML says of scans, read in one pass, and whether their points can be in the file. Needs
no package; libE57 takes quadratic time for wide and deep XML. Imports nothing of the add-on.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO
from xml.parsers import expat

PAGE, CHECKED = 1024, 4  # bytes of a page, and of the check sum at its end
MOST_DEPTH, MOST_PARTS, MOST_ELEMENTS = 64, 10_000, 1 << 20  # of XML; 10,000 scans take libE57 two seconds
MOST_TEXT = 1 << 20  # characters of one value
PIECE = 1 << 16


class E57Error(Exception):
    """The text is for the artist."""


@dataclass
class Field:
    """A number or text that each point has."""

    name: str
    kind: str  # Float, Integer, ScaledInteger or String
    bits: int  # of a value in the file, at least
    low: float  # limits that the file declares, scaled; NaN: none
    high: float


@dataclass
class Scan:
    name: str = ""
    points: int = 0
    place: int = 0  # of its points in the file, as a physical offset
    has_pose: bool = False
    rotation: dict[str, float] = field(default_factory=dict)
    translation: dict[str, float] = field(default_factory=dict)
    limits: dict[str, float] = field(default_factory=dict)  # of colors
    fields: list[Field] = field(default_factory=list)


@dataclass
class Head:
    scans: list[Scan] = field(default_factory=list)
    crs: str = ""
    xml: int = 0  # bytes
    whole: bool = True  # all of the XML was read


def read(path: Path, most: int | None = None) -> Head:
    """most: bytes of XML after which reading stops. E57Error where the file is none, or its XML is damaged or too large."""
    total = path.stat().st_size
    with open(path, "rb") as file:
        head = file.read(48)
        if len(head) < 48 or head[:8] != b"ASTM-E57":
            raise E57Error("not an E57 file: its first bytes are not 'ASTM-E57'")
        physical, offset, length, page = struct.unpack_from("<4Q", head, 16)
        if page != PAGE:
            raise E57Error(f"its pages are of {page:,} bytes, where E57 has {PAGE:,}")
        if physical > total:
            raise E57Error(f"ends after {total:,} of {physical:,} bytes")
        if not 48 <= offset < total or length > total - offset or offset % PAGE >= PAGE - CHECKED:
            raise E57Error(f"its XML of {length:,} bytes at byte {offset:,} is outside of its {total:,} bytes")
        found = _Parser()
        found.head.xml, found.head.whole = length, most is None or length <= most
        found.read(_logical(file, offset, length if most is None else min(length, most)), found.head.whole)
    return found.head


def check(path: Path, head: Head) -> None:
    """E57Error where a scan announces more points than its part of the file can hold."""
    total = path.stat().st_size
    with open(path, "rb") as file:
        for index, scan in enumerate(head.scans):
            if not scan.points or scan.place + 32 > total:
                continue  # libE57 reports the latter
            section = b"".join(_logical(file, scan.place, 32))
            length = min(struct.unpack_from("<Q", section, 8)[0], total) if len(section) == 32 else 0
            bits = sum(item.bits for item in scan.fields)
            most = 8 * length // bits if bits else 1 << 31
            if scan.points > most:
                raise E57Error(f"scan {index} announces {scan.points:,} points; its {length:,} bytes hold at most {most:,}")


def _logical(file: BinaryIO, offset: int, length: int) -> Iterator[bytes]:
    """The bytes from a physical offset on, without check sums."""
    file.seek(offset)
    inside = offset % PAGE
    while length > 0:
        data = file.read(min(PIECE - inside, length + CHECKED * (length // (PAGE - CHECKED) + 2)))
        if not data:
            return
        for start in range(-inside, len(data), PAGE):
            piece = data[max(start, 0):start + PAGE - CHECKED][:length]
            length -= len(piece)
            yield piece
        inside = (inside + len(data)) % PAGE


class _Parser:
    def __init__(self) -> None:
        self.head = Head()
        self._path: list[str] = []
        self._parts: list[int] = []  # of each element of the path
        self._elements = 0
        self._text: list[str] = []
        self._length = 0
        self._kind = ""

    def read(self, pieces: Iterator[bytes], whole: bool) -> None:
        parser = expat.ParserCreate()
        parser.buffer_text = True
        parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = self._start, self._end, self._data
        parser.StartDoctypeDeclHandler = self._no_types
        try:
            for piece in pieces:
                parser.Parse(piece, False)
            if whole:
                parser.Parse(b"", True)
        except expat.ExpatError as error:
            raise E57Error(f"its XML is damaged: {error}") from None
        except (ValueError, OverflowError, LookupError) as error:  # the last: of an encoding that nobody knows
            raise E57Error(f"its XML is damaged: {error}") from None

    def _no_types(self, *_: object) -> None:
        raise E57Error("its XML declares a document type, which E57 does not have")

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self._elements += 1
        if self._parts:
            self._parts[-1] += 1
            if self._parts[-1] > MOST_PARTS:
                raise E57Error(f"its XML has more than {MOST_PARTS:,} parts in '{self._path[-1][:40]}'")
        if len(self._path) >= MOST_DEPTH or self._elements > MOST_ELEMENTS:
            raise E57Error(f"its XML is deeper than {MOST_DEPTH} levels" if len(self._path) >= MOST_DEPTH else
                           f"its XML has more than {MOST_ELEMENTS:,} elements")
        self._path.append(tag)
        self._parts.append(0)
        self._text, self._length, self._kind = [], 0, attributes.get("type", "")
        if self._path[1:2] != ["data3D"]:
            return
        if len(self._path) == 3:
            self.head.scans.append(Scan())
        elif len(self._path) == 4 and tag == "pose":
            self.head.scans[-1].has_pose = True
        elif len(self._path) == 4 and tag == "points":
            scan = self.head.scans[-1]
            scan.points, scan.place = _whole(attributes, "recordCount"), _whole(attributes, "fileOffset")
        elif len(self._path) == 6 and self._path[3:5] == ["points", "prototype"]:
            self.head.scans[-1].fields.append(_field(tag, attributes))

    def _data(self, text: str) -> None:
        self._length += len(text)
        if self._length > MOST_TEXT:
            raise E57Error(f"its XML has a value of more than {MOST_TEXT:,} characters")
        self._text.append(text)

    def _end(self, tag: str) -> None:
        path, text = self._path, "".join(self._text)
        self._text = []
        if path[1:] == ["coordinateMetadata"]:
            self.head.crs = text
        elif path[1:2] == ["data3D"] and len(path) == 4 and tag == "name":
            self.head.scans[-1].name = text
        elif path[1:2] == ["data3D"] and len(path) == 6 and path[3] == "pose":
            into = {"rotation": self.head.scans[-1].rotation, "translation": self.head.scans[-1].translation}.get(path[4])
            if into is not None:
                into[tag] = _number(text)
        elif path[1:2] == ["data3D"] and len(path) == 5 and path[3] == "colorLimits":
            self.head.scans[-1].limits[tag] = _number(text)
        path.pop()
        self._parts.pop()


def _number(text: str) -> float:
    """0 for an empty element, as E57 says."""
    text = text.strip()
    return float(text) if text else 0.0


def _whole(attributes: dict[str, str], name: str) -> int:
    text = attributes.get(name, "0").strip()
    if not text.isascii() or not text.isdigit() or len(text) > 19:
        raise E57Error(f"its XML is damaged: {name} is '{text[:40]}'")
    return int(text)


def _field(name: str, attributes: dict[str, str]) -> Field:
    kind = attributes.get("type", "")
    low, high = (float(attributes[end]) if end in attributes else math.nan for end in ("minimum", "maximum"))
    if kind in {"Integer", "ScaledInteger"}:
        known = math.isfinite(low) and math.isfinite(high) and high >= low
        bits = int(int(attributes["maximum"]) - int(attributes["minimum"])).bit_length() if known else 64
        if kind == "ScaledInteger":
            scale, offset = float(attributes.get("scale", "1")), float(attributes.get("offset", "0"))
            low, high = low * scale + offset, high * scale + offset
        return Field(name, kind, bits, low, high)
    return Field(name, kind, 32 if attributes.get("precision") == "single" else 64 if kind == "Float" else 8, low, high)
