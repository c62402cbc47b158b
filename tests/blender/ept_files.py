# SPDX-License-Identifier: GPL-3.0-or-later
"""Folders of Entwine Point Tiles of known points, for tests: the octree that copc_files.py writes as a COPC."""

import gzip
import io
import json

import numpy as np
from copc_files import SCALE, nodes_of

HALF = 1.001
_SCHEMA = (("X", "signed", 4, "<i4"), ("Y", "signed", 4, "<i4"), ("Z", "signed", 4, "<i4"), ("Intensity", "unsigned", 2, "<u2"),
           ("ReturnNumber", "unsigned", 1, "u1"), ("NumberOfReturns", "unsigned", 1, "u1"), ("Classification", "unsigned", 1, "u1"),
           ("GpsTime", "float", 8, "<f8"), ("Red", "unsigned", 2, "<u2"), ("Green", "unsigned", 2, "<u2"), ("Blue", "unsigned", 2, "<u2"))


def write_ept(folder, records, offset=(0.0, 0.0, 0.0), least=400, packed="laszip", zipped=False, split=False, form=7):
    """split: each child of the root has a file of the hierarchy. form: of the LAZ files' points. Returns the counts by key."""
    for name in ("ept-data", "ept-hierarchy"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    counts = {}
    for key, part in nodes_of(records, HALF, least):
        name = "-".join(map(str, key))
        counts[name] = len(part)
        data = _laz(part, offset, form) if packed == "laszip" else _bare(part)
        (folder / "ept-data" / f"{name}.{'laz' if packed == 'laszip' else 'bin'}").write_bytes(data)
    for name, found in _hierarchy(counts, split).items():
        data = json.dumps(found).encode()
        (folder / "ept-hierarchy" / f"{name}.json{'.gz' * zipped}").write_bytes(gzip.compress(data) if zipped else data)
    low, high = ([float(getattr(records[axis].astype(np.int64), which)() * SCALE + offset[k]) for k, axis in enumerate("XYZ")] for which in ("min", "max"))
    (folder / "ept.json").write_text(json.dumps({
        "bounds": [*(value - HALF for value in offset), *(value + HALF for value in offset)], "boundsConforming": [*low, *high],
        "dataType": packed, "hierarchyType": "gzip" if zipped else "json", "points": len(records), "span": 32, "srs": {}, "version": "1.0.0",
        "schema": [{"name": name, "type": kind, "size": size} | ({"scale": SCALE, "offset": offset["XYZ".index(name)]} if name in "XYZ" else {})
                   for name, kind, size, _ in _SCHEMA]}))
    return counts


def _laz(part, offset, form):
    import laspy
    header = laspy.LasHeader(point_format=form, version="1.4" if form > 5 else "1.2")
    header.scales, header.offsets = [SCALE] * 3, list(offset)
    record = laspy.ScaleAwarePointRecord.zeros(len(part), header=header)
    for name in ("X", "Y", "Z", "intensity", "gps_time", "red", "green", "blue"):
        record[name] = part[name]
    record.classification = part["class"]
    record.return_number, record.number_of_returns = part["bits"] & 15, part["bits"] >> 4
    stream = io.BytesIO()
    with laspy.open(stream, mode="w", header=header, do_compress=True, closefd=False) as file:
        file.write_points(record)
    return stream.getvalue()


def _bare(part):
    found = np.zeros(len(part), [(name, kind) for name, *_, kind in _SCHEMA])
    for name, own in (("X", "X"), ("Y", "Y"), ("Z", "Z"), ("Intensity", "intensity"), ("Classification", "class"), ("GpsTime", "gps_time"),
                      ("Red", "red"), ("Green", "green"), ("Blue", "blue")):
        found[name] = part[own]
    found["ReturnNumber"], found["NumberOfReturns"] = part["bits"] & 15, part["bits"] >> 4
    return found.tobytes()


def _hierarchy(counts, split):
    if not split:
        return {"0-0-0-0": counts}
    found = {"0-0-0-0": {"0-0-0-0": counts["0-0-0-0"]}}
    for name, count in counts.items():
        depth, *place = map(int, name.split("-"))
        if depth:
            first = "-".join(map(str, (1, *(value >> depth - 1 for value in place))))
            found["0-0-0-0"][first] = -1
            found.setdefault(first, {})[name] = count
    return found
