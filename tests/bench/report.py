# SPDX-License-Identifier: GPL-3.0-or-later
"""The bench's rows as Markdown, and against an older run."""

from __future__ import annotations

from typing import Any

import gpu
import papers
import soft
from metrics import MEANING
from tables import Row, count, joined, name_of, table

KEY = ("scene", "mode", "device", "width", "height", "points", "quality", "threads")
PERCENT = ("false_holes", "inner_holes", "false_growth", "outer_growth")


def pass_names(rows: list[Row]) -> list[str]:
    """In the order of the frame, what is in no pass last."""
    names = list(dict.fromkeys(name for row in rows for name in row["passes"] if name != "rest"))
    order = sorted(names, key=lambda name: max(list(r["passes"]).index(name) for r in rows if name in r["passes"]))
    return [*order, "rest"]


def _cell(name: str, error: dict[str, float]) -> str:
    if name not in error:
        return "–"
    value = error[name]
    if name in PERCENT:
        return f"{100.0 * value:.3f} %"
    return f"{value:.2e}" if name == "temporal_variance" else f"{value:.2f}" if abs(value) >= 10.0 else f"{value:.4f}"


def _what(row: Row) -> list[str]:
    return [row["scene"], name_of(row), f"{row['width']}²", count(row["points"]), row["quality"]]


def times_table(rows: list[Row]) -> str:
    head = ["scene", "device", "size", "points", "quality", "ms median", "min–max", "frames", "work ms", "floor ms",
            "× floor", "upload ms", "peak MB", "planes MB", "cloud B/pt"]
    body = [[*_what(r), f"{r['ms_median']:.2f}", f"{r['ms_min']:.2f}–{r['ms_max']:.2f}", str(r["frames"]),
             f"{r['work_ms']:.2f}", f"{r['floor_ms']:.2f}", f"{r['ms_median'] / r['floor_ms']:.1f}",
             f"{r['upload_ms']:.0f}", f"{r['peak_mb']:.0f}", f"{r['plane_bytes'] / 2**20:.0f}",
             f"{r['cloud_bytes'] / r['points']:.1f}"] for r in rows]
    return table(head, body)


def errors_table(rows: list[Row]) -> str:
    names = [name for name in MEANING if any(name in row["error"] for row in rows)]
    head = ["scene", "device", "size", "points", "quality", "ms", *(name.replace("_", " ") for name in names)]
    body = [[*_what(r), f"{r['ms_median']:.2f}", *(_cell(name, r["error"]) for name in names)] for r in rows]
    return table(head, body)


def passes_table(rows: list[Row]) -> str:
    names = pass_names(rows)
    body = [[*_what(r), *(f"{r['passes'][name]:.2f}" if name in r["passes"] else "–" for name in names)]
            for r in rows]
    return table(["scene", "device", "size", "points", "quality", *names], body)


def markdown(result: dict[str, Any]) -> str:
    timed = joined(result, "headline", "points", "pixels", "threads")
    text = [f"# Bench, {result['date']}", "",
            f"{result['processor']}, {result['cores']} cores. Patina {result['version']}. Lit by a sun; the camera "
            f"{result['distance']} away, {result['elevation']}° up, field of view {result['fov']}°; each frame a "
            "degree further, medians after a warm-up. Scenes, their exact pictures and the points are those of "
            "tests/truth. "
            f"Load average when it began: {result['load']:.1f} (other programs' share of the processor shows in the "
            "maxima).", "",
            f"Floor: 12 bytes a point and the bytes of all planes ÷ {result['bandwidth']:.1f} GB/s, what a copy by "
            f"numpy on {result['cores']} threads moves (read + written); a single thread: "
            f"{result['bandwidth_one']:.1f} GB/s. Work: processor time of all threads. Peak: resident memory "
            "beyond what the program held before.", ""]
    if timed:
        text += ["## Time", "", times_table(timed), "", "## Milliseconds by pass", "", passes_table(timed), "",
                 "## Error beside time", "", "Truth: rays through pixel centres, edges averaged over 64 rays; spacing "
                 "= 1/√(points per area).", "", errors_table(timed), ""]
    against = [row for row in joined(result, "headline", "peers") if row["points"] == 1_000_000]
    if joined(result, "peers"):
        text += ["## Other programs, the same points, camera and truth", "", errors_table(against), "",
                 *notes(joined(result, "peers")), ""]
    for group, title in (("levels", "Processors that have less"), ("discs", "Filling or discs"),
                         ("inside", "Among the points"), ("effects", "Layers and shadows of the torus"),
                         ("lines", "Lines around the torus"),
                         ("styles", "Styles, one row each"),
                         ("scenes", "Scenes and densities"), ("layers", "Nested tori, opacities 0.3, 0.5, 1"),
                         ("shadows", "A ball's shadow on a plane"), ("patterns", "Patterns and noise"),
                         ("steady", "Steadiness under a slow turn"),
                         ("independent", "Shapes that no rule was made on")):
        rows = joined(result, group)
        if rows:
            text += [f"## {title}", "", errors_table(rows), ""]
    if joined(result, "gpu"):
        text += ["## Frames of OpenGL, pass by pass", "", gpu.markdown(result), ""]
    if joined(result, "scaling"):
        text += ["## Over threads", "", times_table(joined(result, "scaling")), ""]
    if result.get("ranges"):
        import ranges  # which imports this
        text += [ranges.markdown(result["ranges"]), ""]
    if result.get("soft"):
        text += [soft.markdown(result["soft"]), ""]
    if result.get("scans"):
        import scans
        text += ["## Virtual scans against exact views", "", scans.markdown(result["scans"]), "",
                 *(f"- {name}: {meaning}" for name, meaning in scans.metrics.MEANING.items()), ""]
    if joined(result, "papers"):
        text += [papers.markdown(result), ""]
    for part in result["parts"].values():
        text += [f"## {part['title']}", "", part["text"], ""]
    skipped = {name: reason for row in joined(result) for name, reason in (row.get("skipped") or {}).items()}
    if skipped:
        text += ["Left out: " + "; ".join(f"*{name}*: {reason}" for name, reason in sorted(skipped.items())) + ".", ""]
    if result["absent"]:
        text += ["## Not measured", ""]
        text += [f"- {row['group']}: {row['scene']}, {row['mode']}, {row['device']}, {count(row['points'] or 0)} "
                 f"points, {row['quality']}: {row['unavailable']}" for row in result["absent"]]
    text += ["", "## What the errors mean", ""]
    text += [f"- {name.replace('_', ' ')}: {meaning}" for name, meaning in MEANING.items()]
    return "\n".join(text) + "\n"


def notes(rows: list[Row]) -> list[str]:
    return [f"- {row['device']}: {row['note']}" for row in rows if row.get("note")]


def compare(new: dict[str, Any], old: dict[str, Any]) -> str:
    """Ratios new / old of the cases that both runs have."""
    before = {}
    for index, row in enumerate(old["rows"]):
        if "unavailable" not in row:
            more = old["details"][index] if "details" in old else {}
            before[tuple(row[k] for k in KEY)] = {**more, **row}
    body = []
    for row in joined(new):
        other = before.get(tuple(row[k] for k in KEY))
        if other is None:
            continue
        cells = [*_what(row), f"{other['ms_median']:.2f} → {row['ms_median']:.2f}",
                 f"{row['ms_median'] / other['ms_median']:.3f}"]
        for name in ("work_ms", "upload_ms", "peak_mb"):
            both = row.get(name) and other.get(name)
            cells.append(f"{row[name] / other[name]:.3f}" if both else "–")
        error, past = row["error"], other["error"]
        for name in ("depth_rms_spacings", "normal_mean_degrees", "color_rms"):
            both = name in error and past.get(name)
            cells.append(f"{error[name] / past[name]:.3f}" if both else "–")
        both = "coverage_iou" in error and "coverage_iou" in past
        cells.append(f"{error['coverage_iou'] - past['coverage_iou']:+.5f}" if both else "–")
        body.append(cells)
    head = ["scene", "device", "size", "points", "quality", "ms", "× time", "× work", "× upload", "× peak MB",
            "× depth error", "× normal error", "× colour error", "IoU change"]
    machine = "" if old.get("processor") == new["processor"] else f" (another machine: {old.get('processor')})"
    return f"## Against {old.get('date', 'an older run')}{machine}\n\n" + table(head, body) + "\n"
