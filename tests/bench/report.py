# SPDX-License-Identifier: GPL-3.0-or-later
"""The bench's rows as Markdown, as a plot, and against an older run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

Row = dict[str, Any]
KEY = ("scene", "mode", "device", "width", "height", "points", "quality", "threads")


def _table(head: list[str], rows: list[list[str]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def _count(points: int) -> str:
    return f"{points // 1_000_000}M" if points >= 1_000_000 else f"{points // 1000}k"


def name_of(row: Row) -> str:
    threads = f", {row['threads']} threads" if row["threads"] > 1 else ", 1 thread" if row["threads"] else ""
    return f"{row.get('device_name', row['device'])}{threads}"


def _pass_names(rows: list[Row]) -> list[str]:
    """In the order of the frame, what is in no pass last."""
    names = list(dict.fromkeys(name for row in rows for name in row["passes"] if name != "rest"))
    order = sorted(names, key=lambda name: max(list(r["passes"]).index(name) for r in rows if name in r["passes"]))
    return [*order, "rest"]


def times_table(rows: list[Row]) -> str:
    head = ["device", "points", "quality", "ms median", "min–max", "work ms", "floor ms", "× floor", "upload ms",
            "peak MB", "planes MB", "cloud B/pt"]
    body = [[name_of(r), _count(r["points"]), r["quality"], f"{r['ms_median']:.2f}",
             f"{r['ms_min']:.2f}–{r['ms_max']:.2f}", f"{r['work_ms']:.2f}", f"{r['floor_ms']:.2f}",
             f"{r['ms_median'] / r['floor_ms']:.1f}", f"{r['upload_ms']:.0f}", f"{r['peak_mb']:.0f}",
             f"{r['plane_bytes'] / 2**20:.0f}", f"{r['cloud_bytes'] / r['points']:.1f}"] for r in rows]
    return _table(head, body)


def errors_table(rows: list[Row]) -> str:
    head = ["device", "points", "quality", "ms", "IoU", "false holes (inner) %", "growth (outer) %",
            "depth rms, p99.9 spacings", "normal mean, p99 °", "colour rms"]
    body = []
    for r in rows:
        e = r["error"]
        body.append([name_of(r), _count(r["points"]), r["quality"], f"{r['ms_median']:.2f}",
                     f"{e['coverage_iou']:.4f}",
                     f"{100 * e['false_holes']:.3f} ({100 * e['inner_holes']:.4f})",
                     f"{100 * e['false_growth']:.3f} ({100 * e['outer_growth']:.4f})",
                     f"{e['depth_rms_spacings']:.3f}, {e['depth_p999_spacings']:.2f}",
                     f"{e['normal_mean_degrees']:.2f}, {e['normal_p99_degrees']:.2f}", f"{e['color_rms']:.4f}"])
    return _table(head, body)


def passes_table(rows: list[Row]) -> str:
    names = _pass_names(rows)
    body = []
    for r in rows:
        cells = [f"{r['passes'][name]:.2f}" if name in r["passes"] else "–" for name in names]
        body.append([name_of(r), _count(r["points"]), r["quality"], *cells])
    return _table(["device", "points", "quality", *names], body)


def markdown(result: dict[str, Any]) -> str:
    rows = [row for row in result["rows"] if "unavailable" not in row]
    absent = [row for row in result["rows"] if "unavailable" in row]
    text = [f"# Bench, {result['date']}", "",
            f"{result['processor']}, {result['cores']} cores. Patina {result['version']}. Random torus (R 1, r 0.4), "
            f"normals and colours, lit by a sun, culled; camera {result['distance']} away, {result['elevation']}° up, "
            f"field of view {result['fov']}°, 1024×1024; at least {result['frames']} frames, one degree apart, after a "
            f"warm-up. All passes of the surface pipeline. Load average when it began: "
            f"{result['load']:.1f} (other programs' share of the processor shows in the maxima).", "",
            f"Floor: 12 bytes a point and the bytes of all planes ÷ {result['bandwidth']:.1f} GB/s, what a copy by "
            f"numpy on {result['cores']} threads moves (read + written); a single thread: "
            f"{result['bandwidth_one']:.1f} GB/s. Work: processor time of all threads.", "",
            "## Time", "", times_table(rows), "",
            "## Error against the analytic torus, beside the time", "",
            "Truth at pixel centres; spacing = 1/√(points per area); inner, outer: away from the silhouette.", "",
            errors_table(rows), "", "## Milliseconds by pass", "", passes_table(rows), ""]
    skipped = {name: reason for row in rows for name, reason in row["skipped"].items()}
    if skipped:
        text += ["Left out: " + "; ".join(f"*{name}*: {reason}" for name, reason in sorted(skipped.items())) + ".", ""]
    text += [f"- {row['device']}: {row['unavailable']}" for row in absent]
    return "\n".join(text) + "\n"


def plot(result: dict[str, Any], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    rows = [row for row in result["rows"] if "unavailable" not in row]
    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 5.2))
    for name in dict.fromkeys((name_of(r), r["quality"]) for r in rows):
        line = sorted((r for r in rows if (name_of(r), r["quality"]) == name), key=lambda r: r["points"])
        low = [r["ms_median"] - r["ms_min"] for r in line]
        high = [r["ms_max"] - r["ms_median"] for r in line]
        left.errorbar([r["points"] for r in line], [r["ms_median"] for r in line], yerr=[low, high], marker="o",
                      capsize=3, label=", ".join(name))
    floors = sorted({r["points"]: r["floor_ms"] for r in rows}.items())
    left.plot(*zip(*floors), "k--", label="floor (memory)")
    left.set(xscale="log", yscale="log", xlabel="points", ylabel="ms a frame, 1024×1024", title="Time against points")
    left.grid(True, which="both", alpha=0.25)
    left.legend(fontsize=8)

    labels = [f"{name_of(r)}\n{_count(r['points'])} {r['quality']}" for r in rows]
    bottom = [0.0] * len(rows)
    right.set_prop_cycle(color=plt.get_cmap("tab20").colors)
    for name in _pass_names(rows):
        share = [100.0 * max(r["passes"].get(name, 0.0), 0.0) / r["ms_median"] for r in rows]
        right.bar(labels, share, bottom=bottom, label=name)
        bottom = [b + s for b, s in zip(bottom, share)]
    right.set(ylabel="% of the frame", title="Where the time goes", ylim=(0, 105))
    right.tick_params(axis="x", labelsize=7, rotation=60)
    right.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    figure.suptitle(f"{result['processor']}, {result['cores']} cores, {result['date']}", fontsize=10)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


def compare(new: dict[str, Any], old: dict[str, Any]) -> str:
    """Ratios new / old of the cases that both runs have."""
    before = {tuple(row[k] for k in KEY): row for row in old["rows"] if "unavailable" not in row}
    body = []
    for row in new["rows"]:
        other = before.get(tuple(row[k] for k in KEY))
        if "unavailable" in row or other is None:
            continue
        error, past = row["error"], other["error"]
        body.append([name_of(row), _count(row["points"]), row["quality"],
                     f"{other['ms_median']:.2f} → {row['ms_median']:.2f}",
                     f"{row['ms_median'] / other['ms_median']:.3f}",
                     f"{row['work_ms'] / other['work_ms']:.3f}",
                     f"{row['upload_ms'] / other['upload_ms']:.3f}", f"{row['peak_mb'] / other['peak_mb']:.3f}",
                     f"{error['depth_rms_spacings'] / max(past['depth_rms_spacings'], 1e-12):.3f}",
                     f"{error['normal_mean_degrees'] / max(past['normal_mean_degrees'], 1e-12):.3f}",
                     f"{error['coverage_iou'] - past['coverage_iou']:+.5f}"])
    head = ["device", "points", "quality", "ms", "× time", "× work", "× upload", "× peak MB", "× depth error",
            "× normal error", "IoU change"]
    machine = "" if old.get("processor") == new["processor"] else f" (another machine: {old.get('processor')})"
    return f"## Against {old.get('date', 'an older run')}{machine}\n\n" + _table(head, body) + "\n"
