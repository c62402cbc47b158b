# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads GeoTIFFs with rasterio for cli_rasters.py: {"paths": [...], "places": [[x, y], ...]} on standard input, what they hold on standard
output."""

import json
import sys
from pathlib import Path

import rasterio
from rasterio.crs import CRS


def describe(path, places):
    prj = Path(path).with_suffix(".prj")
    with rasterio.open(path) as file:
        return {"epsg": file.crs.to_epsg(), "crs": file.crs.to_wkt(), "types": file.dtypes, "nodata": file.nodata,
                "transform": list(file.transform)[:6], "area": file.tags()["AREA_OR_POINT"],
                "prj": CRS.from_wkt(prj.read_text(encoding="ascii")).to_epsg() if prj.exists() else None,
                "values": [values.tolist() for values in file.sample(places)]}


asked = json.load(sys.stdin)
print(json.dumps([describe(path, asked["places"]) for path in asked["paths"]]))
