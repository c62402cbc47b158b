# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads a GeoJSON file with GDAL for cli_maps.py: its system and its lines on standard output, as JSON."""

import json
import struct
import sys

import pyogrio


def vertices(shape):
    """Of a LineString in well-known binary, with three coordinates each."""
    order = "<" if shape[0] else ">"
    kind, count = struct.unpack_from(f"{order}II", shape, 1)
    assert kind in (1002, 0x80000002), kind
    numbers = struct.unpack_from(f"{order}{3 * count}d", shape, 9)
    return [list(numbers[i:i + 3]) for i in range(0, 3 * count, 3)]


about, _, shapes, (layers,) = pyogrio.raw.read(sys.argv[1])
assert list(about["fields"]) == ["layer"], about
print(json.dumps({"epsg": about["crs"], "lines": [[layer, vertices(shape)] for layer, shape in zip(layers, shapes, strict=True)]}))
