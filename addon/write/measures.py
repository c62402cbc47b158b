# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes measurements to a table (.csv) or a drawing (.dxf, with ezdxf). A file appears once it is complete. Does not import bpy."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .. import whole
from ..description.measures import WORDS, Measurement
from ..read import readers
from .exporters import ExportError

FORMATS = ("CSV", "DXF")
LAYER = "measure"
TEXT = 0.02  # of the drawing's extent: the height of text
_NEEDED = tuple(name for name, formats in readers.PACKAGES.items() if formats == "DXF")


def write(path: Path, measured: Sequence[Measurement]) -> None:
    """The format that the name's ending says. ExportError if a package is missing, OSError if the file cannot be written."""
    data = _dxf(path, measured) if path.suffix.lower() == ".dxf" else _csv(measured)
    whole.write(path, data)


def _csv(measured: Sequence[Measurement]) -> bytes:
    """Areas are in square units, angles in degrees. Numbers have all their digits."""
    most = max((len(one.scene) for one in measured), default=0)
    columns = [f"{kind}{axis}{number}" for number in range(1, most + 1) for kind in ("", "file_") for axis in "xyz"]
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\r\n")
    rows.writerow(["name", "kind", "object", "value", "unit", "legs", "horizontal", "perimeter", *columns])
    for one in measured:
        places = [repr(float(value)) for pair in zip(one.scene, one.file, strict=True) for place in pair for value in place]
        rows.writerow([one.name, WORDS[one.kind], one.cloud, *_value(one), " ".join(repr(leg * one.factor) for leg in one.values.legs),
                       *(("" if value is None else repr(value * one.factor)) for value in (one.values.horizontal, one.values.perimeter)), *places])
    return text.getvalue().encode("utf-8")


def _value(one: Measurement) -> tuple[str, str]:
    """The number and its unit."""
    if one.kind == 'POINT':
        return "", ""
    if one.kind == 'ANGLE':
        return repr(math.degrees(one.values.value)), "deg"
    power = 2 if one.kind == 'AREA' else 1
    return repr(one.values.value * one.factor ** power), f"{one.unit}2" if one.unit and power == 2 else one.unit


def _dxf(path: Path, measured: Sequence[Measurement]) -> bytes:
    """Release 2018. Each line is a 3D POLYLINE, each value a TEXT, each measured point a POINT, on one layer."""
    missing = [name for name in _NEEDED if readers.lacks(name)]
    if missing:
        raise ExportError(f"'{path.name}': DXF needs the Python package{'s' * (len(missing) > 1)} {', '.join(missing)}. "
                          "Use Install Readers in the add-on's preferences, or export .csv")
    readers.load("ezdxf")
    import ezdxf
    document = ezdxf.new("R2018")
    units = {one.insert for one in measured}
    document.header["$INSUNITS"] = units.pop() if len(units) == 1 else 0
    document.header["$MEASUREMENT"] = 1
    document.layers.add(LAYER, color=2)
    space, layer = document.modelspace(), {"layer": LAYER}
    height = _text_height(measured)
    for one in measured:
        for line in one.figure.lines:
            closed = one.figure.closed
            space.add_polyline3d([tuple(map(float, place)) for place in (line[:-1] if closed else line)], close=closed, dxfattribs=layer)
        for place, text in one.figure.labels:
            shown = f"{one.name}: {text}" if one.kind == 'POINT' else text
            space.add_text(shown, height=height, dxfattribs=layer | {"insert": tuple(map(float, place))})
            if one.kind == 'POINT':
                space.add_point(tuple(map(float, place)), dxfattribs=layer)
    text = io.StringIO()
    document.write(text)
    return document.encode(text.getvalue())


def _text_height(measured: Sequence[Measurement]) -> float:
    places = np.concatenate([place[None] for one in measured for place, _ in one.figure.labels] +
                            [line for one in measured for line in one.figure.lines])
    return max(TEXT * float(np.ptp(places, axis=0).max()), 1e-3)
