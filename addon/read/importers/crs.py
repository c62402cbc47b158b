# SPDX-License-Identifier: GPL-3.0-or-later
"""How long the units of a coordinate reference system are: from its WKT (OGC 01-009, ISO 19162), else from GeoTIFF keys (units,
else the EPSG number of a system), else from the words beside those. Plain: no Blender, no library."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from . import epsg

FOOT, US_FOOT = 0.3048, 1200.0 / 3937.0  # metres
NAMES = {1.0: "meters", FOOT: "feet", US_FOOT: "US survey feet"}

# EPSG numbers of units
_UNITS = {9001: 1.0, 9002: FOOT, 9003: US_FOOT, 9005: 0.3047972654, 9036: 1000.0, 9096: 0.9144}

# GeoTIFF keys
_MODEL, _LINEAR, _LINEAR_SIZE, _VERTICAL = 1024, 3076, 3077, 4099
_PROJECTED, _HEIGHT = 3072, 4096  # EPSG numbers of systems
_HEIGHT_WORDS = 4097  # where they begin
_GEOGRAPHIC = 2  # a model

_HORIZONTAL = {"PROJCS", "PROJCRS", "PROJECTEDCRS", "LOCAL_CS", "ENGCRS", "ENGINEERINGCRS", "GEOCCS"}
_ANGULAR = {"GEOGCS", "GEOGCRS", "GEOGRAPHICCRS"}
_HEIGHTS = {"VERT_CS", "VERTCS", "VERTCRS", "VERTICALCRS"}
_ROOTS = _HORIZONTAL | _ANGULAR | _HEIGHTS | {"COMPD_CS", "COMPOUNDCRS", "BOUNDCRS"}
_LENGTHS = {"UNIT", "LENGTHUNIT"}

_TOKENS = re.compile(r'"(?:[^"]|"")*"|[\[\](),]|[^\s"\[\](),]+')


@dataclass(frozen=True)
class Units:
    across: float  # metres of a unit of x and y
    up: float  # and of z
    degrees: bool = False  # x and y are angles: across says nothing

    def __str__(self) -> str:
        across, up = "degrees" if self.degrees else _called(self.across), _called(self.up)
        same = across == up or (self.degrees and self.up == 1.0)
        return across if same else f"{across}, heights in {up}"


def _called(size: float) -> str:
    return next((name for metres, name in NAMES.items() if abs(size / metres - 1.0) < 1e-7), f"{size:.9g} m")


def units(text: str, keys: Mapping[int, float] | None = None) -> Units | None:
    """Of a coordinate reference system in WKT, or in words with the numbers of its GeoTIFF keys; None where nothing says."""
    keys = keys or {}
    root = _parsed(text)
    if root and root[0] in _ROOTS:
        return _of_wkt(root)
    heights, places = _in_parts(text, keys)
    up = _UNITS.get(int(keys.get(_VERTICAL, 0))) or _of_number(epsg.UP, keys.get(_HEIGHT)) or heights
    if keys.get(_MODEL) == _GEOGRAPHIC:
        return Units(1.0, up or 1.0, True)
    number = keys.get(_PROJECTED)
    across = _UNITS.get(int(keys.get(_LINEAR, 0)), keys.get(_LINEAR_SIZE)) or _of_number(epsg.ACROSS, number, places)
    if across is None and up is None:
        return None
    return Units(across or up or 1.0, up or across or 1.0)


def _of_number(table: dict[float, str], number: float | None, words: float | None = None) -> float | None:
    """Metres of the unit of a system by its EPSG number, else as words beside it say; the systems that the table does not
    name are in metres. None without either."""
    code = int(number or 0)
    known = 1024 <= code < 32767 and not 5000 <= code < 5200  # those are datums of heights, of any unit
    return epsg.metres(table, code) or words or (1.0 if known else None)


def _in_parts(text: str, keys: Mapping[int, float]) -> tuple[float | None, float | None]:
    """What the words say of heights, and of x and y: parts behind each other, with a | behind each. Which are of heights a key
    says, else all but the first are."""
    begin, parts = 0, {}
    for part in text.split("|"):
        parts[begin] = part
        begin += len(part) + 1
    of_heights = {int(keys[_HEIGHT_WORDS])} if _HEIGHT_WORDS in keys else set(parts) - {0}
    heights, places = ([_in_words(part) for begin, part in parts.items() if (begin in of_heights) == up] for up in (True, False))
    return next(filter(None, heights), None), next(filter(None, places), None)


def name(text: str) -> str:
    """For people: of WKT the system's own name, with its EPSG number where it says so; words as they are, without their marks."""
    root = _parsed(text)
    parts = root[1] if root and root[0] in _ROOTS else []
    if not parts or not isinstance(parts[0], str):
        return " ".join(text.replace("|", " ").split())
    numbers = [str(item[1][1]).strip('"') for item in parts if isinstance(item, tuple) and item[0] in {"AUTHORITY", "ID"}
               and len(item[1]) > 1 and str(item[1][0]).strip('"').upper() == "EPSG"]
    plain = parts[0].strip('"').replace("_", " ")
    return f"{plain} (EPSG {numbers[0]})" if numbers else plain


def _in_words(text: str) -> float | None:
    if re.search(r"us[ _-]*(survey)?[ _-]*(ft|foot|feet)\b|\bft[ _-]*us\b", text, re.I):
        return US_FOOT
    return FOOT if re.search(r"\b(ft|foot|feet)\b", text, re.I) else None


Node = tuple[str, list]  # keyword, and what stands in its brackets: texts and nodes


def _parsed(text: str) -> Node | None:
    """The first element of a WKT."""
    stack: list[list] = [[]]
    for token in _TOKENS.findall(text):
        if token in "[(":
            if not stack[-1] or not isinstance(stack[-1][-1], str):
                return None
            node: Node = (stack[-1].pop().upper(), [])
            stack[-1].append(node)
            stack.append(node[1])
        elif token in "])":
            stack.pop()
            if len(stack) == 1:
                break
        elif token != ",":
            stack[-1].append(token)
        if not stack or len(stack) > 64:
            return None
    return next((item for item in stack[0] if isinstance(item, tuple)), None)


def _find(node: Node, names: set[str]) -> Node | None:
    """The element itself, or the first below it, by such a name."""
    if node[0] in names:
        return node
    return next(filter(None, (_find(item, names) for item in node[1] if isinstance(item, tuple))), None)


def _length(node: Node) -> float | None:
    """Metres of the unit of an element or of its axes, not of what it is based on."""
    for keyword, inner in (item for item in node[1] if isinstance(item, tuple)):
        if keyword in _LENGTHS and len(inner) > 1 and isinstance(inner[1], str):
            try:
                found = float(inner[1])
            except ValueError:
                continue
            if 1e-6 < found < 1e6:
                return found
    axes = (item for item in node[1] if isinstance(item, tuple) and item[0] == "AXIS")
    return next(filter(None, map(_length, axes)), None)


def _of_wkt(root: Node) -> Units | None:
    base = _find(root, {"SOURCECRS"}) or root  # of a bound one
    level, height = _find(base, _HORIZONTAL), _find(base, _HEIGHTS)
    across = _length(level) if level else None
    up = _length(height) if height else None
    if across is not None:
        return Units(across, up or across)
    if _find(base, _ANGULAR) and level is None:
        return Units(1.0, up or 1.0, True)
    return Units(up, up) if up else None
