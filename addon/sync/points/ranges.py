# SPDX-License-Identifier: GPL-3.0-or-later
"""What an object says of range images → fields of patina_cloud_style, and the scans that its points are of."""

from __future__ import annotations

from typing import Any

import bpy

from ... import native
from ...native.abi import SURFACE
from ...native.points import ScanSet
from ...read.importers import scans
from ..analyses import analysis
from . import edits

LEAST = 1.0  # pixel size
LEAST_SHARPNESS = 0.5


def style_fields(obj: bpy.types.Object) -> dict[str, Any]:
    group = obj.patina.ranges
    return {
        "surface": SURFACE["RANGES"] if group.use else 0,
        "range_gamma": group.gamma,
        "range_pixel": max(group.pixel, LEAST) if group.pixel > 0.0 else 0.0,
        "range_sharpness": max(group.sharpness, LEAST_SHARPNESS) if group.sharpness > 0.0 else 0.0,
        "range_cull": group.cull if group.use_cull else 0.0,
    }


def spare_analysis(obj: bpy.types.Object, surface: str, layer: bpy.types.ViewLayer) -> bool:
    """Whether an object is drawn as range images, and nothing else asks for what an analysis finds: it may have one, and its picture is
    the same. surface: of the scene."""
    patina = obj.patina
    asked = (patina.analysis == 'ALWAYS' or patina.soft.use or patina.cull_back or patina.colors.source == 'TRUST'
             or analysis.least_trust(patina) > 0.0 or patina.free_space != 'OFF')
    return ((patina.ranges.use or surface == 'RANGES') and not asked
            and not (layer.patina.use_pass_trust or layer.patina.use_pass_thickness))


def told_of(obj: bpy.types.Object, surface: str) -> str:
    """What the object's file told of its scans, where they are drawn as range images; surface: of the scene."""
    if not obj.patina.ranges.use and surface != 'RANGES':
        return ""
    told = obj.original.data.get(scans.PROPERTY, "")
    return told if isinstance(told, str) else ""


def scans_of(cloud: native.Cloud, told: str, used: bool) -> ScanSet | None:
    """Any thread. None where nothing is known of the scans that the points are of; used: the cloud is drawn as range images."""
    if not used:
        return None
    known = scans.unpacked(told) if told else []
    of = edits.scans_of(cloud)
    numbers = cloud.scan_numbers if of is not None else (0,)
    records = [(known[number].direction, known[number].interval) if number < len(known) else (scans.UNKNOWN, 0.0) for number in numbers]
    if of is None and not any(any(direction) or interval for direction, interval in records):
        return None
    return edits.keep(cloud, ("scans", told, cloud.scan_stamp), lambda: ScanSet(cloud, of, records))
