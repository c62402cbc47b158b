# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a run's figures into README.md, between <!-- bench NAME --> and <!-- end -->, and its plots into .pictures/."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import papers
import plots
from report import Row, count, joined, name_of, table

NAMES = {"cpu-avx512": "processor, AVX-512", "cpu-avx2": "processor, AVX2", "cpu-sse42": "processor, SSE4.2",
         "gl-egl": "OpenGL, EGL", "gl-osmesa": "OpenGL, OSMesa"}
QUALITIES = {"refined": "refined", "paper": "as in the paper", "unfilled": "points alone"}


def _line(row: Row) -> list[str]:
    e = row["error"]
    ours = row["group"] != "peers"
    device = NAMES.get(name_of(row), name_of(row)) if ours else row["device"]
    depth = f"{e['depth_rms_spacings']:.2f}" if "depth_rms_spacings" in e else "–"
    normal = f"{e['normal_mean_degrees']:.2f}" if "normal_mean_degrees" in e else "–"
    return [device, count(row["points"]), QUALITIES.get(row["quality"], row["quality"]),
            f"**{row['ms_median']:.1f}**" if ours else f"{row['ms_median']:.0f}",
            f"{100 * e['false_holes']:.3f}", f"{100 * e['false_growth']:.2f} ({100 * e['outer_growth']:.2f})", depth, normal,
            f"{e['color_rms']:.4f}", f"{e['color_psnr']:.1f}", f"{e['color_ssim']:.3f}"]


def speed(result: dict[str, Any]) -> str:
    rows = [row for row in joined(result, "headline", "points", "peers")
            if row["error"] and row["width"] == 1024 and row["points"] >= 100_000 and row["scene"] == "torus"]
    head = ["drawn by", "points", "quality", "ms a frame", "open, %", "grown, % (off the outline)",
            "depth rms, spacings", "normal mean, °", "colour rms", "PSNR, dB", "SSIM"]
    return (f"Measured on {result['date']}, version {result['version']}: {result['processor']}, {result['cores']} cores.\n\n"
            + table(head, [_line(row) for row in rows]))


def update(result: dict[str, Any], root: Path) -> str:
    """Returns what was written, in a sentence."""
    against = [row for row in joined(result, "headline", "peers") if row["points"] == 1_000_000 and row["error"]]
    title = f"{result['processor']}, {result['cores']} cores, {result['date']}"
    plots.pareto(against, root / ".pictures/pareto.png", title)
    parts = {"speed": speed(result)}
    for quality in ("paper", "refined"):
        if papers.ratios(result, quality):
            parts[f"papers {quality}"] = papers.table(result, quality)
    path = root / "README.md"
    text, written = path.read_text(), []
    for name, part in parts.items():
        marks = re.compile(rf"(<!-- bench {name} -->\n).*?(<!-- end -->)", re.DOTALL)
        text, times = marks.subn(lambda match: f"{match[1]}{part}\n{match[2]}", text)  # noqa: B023
        written += [name] * bool(times)
    path.write_text(text)
    return f"README.md: {', '.join(written) or 'no marks found'}; .pictures/pareto.png"
