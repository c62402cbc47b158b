# SPDX-License-Identifier: GPL-3.0-or-later
"""A run's result as it grows, and bench.json, which holds it after every row. Needs numpy alone."""

from __future__ import annotations

import datetime
import json
import os
from pathlib import Path
from typing import Any

import machine
import stage

FIELDS = ("scene", "mode", "device", "width", "height", "points", "quality", "threads", "ms_median", "ms_min", "ms_max",
          "peak_mb", "passes", "error")  # of a row, as the README and other programs know it
ABSENT = ("group", "scene", "mode", "device", "points", "quality", "unavailable")


def begin(version: str, **more: Any) -> dict[str, Any]:
    """What is known of a run before anything is measured."""
    return {"date": datetime.date.today().isoformat(), "processor": machine.processor(), "cores": machine.cores(),
            "load": os.getloadavg()[0], "version": version, "distance": stage.DISTANCE, "elevation": stage.ELEVATION, "fov": stage.FOV,
            "bandwidth": machine.copy_bandwidth(machine.cores()), "bandwidth_one": machine.copy_bandwidth(1),
            "rows": [], "details": [], "absent": [], "parts": {}, **more}


def add(result: dict[str, Any], row: dict[str, Any]) -> None:
    """Puts a measured case where it belongs."""
    if "unavailable" in row:
        result["absent"].append({key: row.get(key) for key in ABSENT})
        return
    if row.get("plane_bytes"):
        row = {"floor_ms": (12 * row["points"] + row["plane_bytes"]) / result["bandwidth"] / 1e6, **row}
    result["rows"].append({name: row[name] for name in FIELDS})
    result["details"].append({key: value for key, value in row.items() if key not in FIELDS})


def write(result: dict[str, Any], folder: Path) -> None:
    """bench.json in the folder is never half written."""
    folder.mkdir(parents=True, exist_ok=True)
    partial = folder / "bench.json.part"
    partial.write_text(json.dumps(result, indent=1))
    partial.replace(folder / "bench.json")
