# SPDX-License-Identifier: GPL-3.0-or-later
"""The bench's plots: speed against error, time against points, pixels and threads, time by pass, error against
density."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from report import pass_names  # noqa: E402
from tables import count, joined, name_of  # noqa: E402

Row = dict[str, Any]


def front(places: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Those that no other beats in both, by x."""
    best, found = float("inf"), []
    for x, y in sorted(places):
        if y < 0.999 * best:
            best = y
            found.append((x, y))
    return found


def pareto(rows: list[Row], path: Path, title: str) -> bool:
    """1M random torus points at 1024 x 1024: time against the error of coverage, colour and depth. Depth only of
    pictures that are less than 5 % open: a few right pixels are no picture."""
    shown = (("1 − IoU of coverage", lambda e: 1.0 - e["coverage_iou"]),
             ("colour rms over the whole picture, sRGB", lambda e: 10.0 ** (-e["color_psnr"] / 20.0)),
             ("depth rms, spacings", lambda e: e["depth_rms_spacings"] if e["false_holes"] < 0.05 else None))
    if not rows:
        return False
    figure, axes = plt.subplots(1, 3, figsize=(15, 6.2))
    styles: dict[str, tuple[str, Any]] = {}
    for row in rows:
        peer = row["group"] == "peers"
        name = f"{row['device']}, {row['quality']}" if peer else f"Patina {name_of(row)}, {row['quality']}"
        marker = "s" if peer else "o" if name_of(row).startswith("cpu") else "D"
        styles.setdefault(name, (marker, plt.get_cmap("tab20")(len(styles) % 20)))
        for axis, (_, value) in zip(axes, shown):
            try:
                y = value(row["error"])
            except KeyError:
                continue
            if y is not None:
                marker, color = styles[name]
                axis.plot(row["ms_median"], max(y, 1e-4), marker, color=color, markeredgecolor="black", markersize=8,
                          label=name)
    for axis, (label, _) in zip(axes, shown):
        places = [(line.get_xdata()[0], line.get_ydata()[0]) for line in axis.lines]
        if places:
            axis.step(*zip(*front(places)), "-", color="tab:green", where="post", zorder=0, label="Pareto front")
        axis.set(xscale="log", yscale="log", xlabel="ms a frame", ylabel=label)
        axis.margins(0.12, 0.12)
        axis.grid(True, which="both", alpha=0.2)
    handles = {name: handle for axis in axes for handle, name in zip(*axis.get_legend_handles_labels())}
    figure.suptitle(f"Speed against error, 1,000,000 points, 1024×1024 (lower left is better): {title}", fontsize=10)
    figure.legend(handles.values(), handles.keys(), fontsize=8, ncol=4, loc="lower center")
    figure.tight_layout(rect=(0.0, 0.02 + 0.035 * ((len(handles) + 3) // 4), 1.0, 1.0))
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return True


def _lines(axis: Any, rows: list[Row], key: Any, floor: bool = False) -> None:
    for name in dict.fromkeys(row["device"] for row in rows):
        line = sorted((row for row in rows if row["device"] == name), key=key)
        middle = [row["ms_median"] for row in line]
        low = [row["ms_median"] - row["ms_min"] for row in line]
        high = [row["ms_max"] - row["ms_median"] for row in line]
        axis.errorbar([key(row) for row in line], middle, yerr=[low, high], marker="o", capsize=3, label=name)
    if floor and rows:
        axis.plot(*zip(*sorted({key(row): row["floor_ms"] for row in rows}.items())), "k--", label="floor (memory)")


def scaling(result: dict[str, Any], path: Path) -> bool:
    headline = [row for row in joined(result, "headline") if row["quality"] == "refined"]
    panels = (("points", "points", lambda row: row["points"]),
              ("pixels", "pixels", lambda row: row["width"] * row["height"]),
              ("threads", "threads", lambda row: row["threads"]))
    if not headline:
        return False
    figure, axes = plt.subplots(1, 3, figsize=(15, 4.6))
    for axis, (group, label, key) in zip(axes, panels):
        rows = joined(result, group)
        if group != "threads" and rows:
            rows = rows + [row for row in headline if row["device"] in {one["device"] for one in rows}]
        _lines(axis, rows, key, floor=group != "threads")
        if group == "threads" and rows:
            one = min(rows, key=key)
            axis.plot([key(row) for row in rows], [one["ms_median"] * key(one) / key(row) for row in rows], "k:",
                      label="as many times faster")
        if not rows:
            axis.text(0.5, 0.5, "not in this run", transform=axis.transAxes, ha="center")
            continue
        axis.set(xscale="log", yscale="log", xlabel=label, ylabel="ms a frame", title=f"Time against {label}")
        axis.grid(True, which="both", alpha=0.25)
        axis.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return True


def passes(rows: list[Row], path: Path) -> bool:
    if not rows:
        return False
    figure, axis = plt.subplots(figsize=(12, 0.5 * len(rows) + 1.8))
    labels = [f"{name_of(r)}, {count(r['points'])}, {r['width']}², {r['quality']}" for r in rows]
    left = [0.0] * len(rows)
    axis.set_prop_cycle(color=plt.get_cmap("tab20").colors)
    for name in pass_names(rows):
        share = [100.0 * max(r["passes"].get(name, 0.0), 0.0) / sum(r["passes"].values()) for r in rows]
        axis.barh(range(len(rows)), share, left=left, label=name)
        left = [a + b for a, b in zip(left, share)]
    for k, row in enumerate(rows):
        axis.text(101.0, k, f"{row['ms_median']:.1f} ms", va="center", fontsize=8)
    axis.set_yticks(range(len(rows)), labels, fontsize=8)
    axis.invert_yaxis()
    axis.set(xlabel="% of the frame", title="Time by pass", xlim=(0, 110))
    axis.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return True


def densities(rows: list[Row], path: Path) -> bool:
    rows = [row for row in rows if row["device"] == rows[0]["device"] and row["width"] == rows[0]["width"]]
    if len({row["density"] for row in rows}) < 2:
        return False
    shown = (("false_holes", "open, share"), ("false_growth", "grown, share"),
             ("depth_rms_spacings", "depth rms, spacings"), ("color_psnr", "colour PSNR, dB"))
    figure, axes = plt.subplots(2, 4, figsize=(17, 8), sharex=True)
    for line, quality in zip(axes, ("refined", "paper")):
        for axis, (name, label) in zip(line, shown):
            for scene in dict.fromkeys(row["scene"] for row in rows):
                some = sorted((row for row in rows if row["scene"] == scene and row["quality"] == quality
                               and name in row["error"]), key=lambda row: row["density"])
                axis.plot([row["density"] for row in some], [row["error"][name] for row in some], ".-", label=scene)
            axis.set(xscale="log", xlabel="points a pixel", ylabel=label, title=f"{quality}: {label}")
            if name != "color_psnr":
                axis.set_yscale("symlog", linthresh=1e-4 if name.startswith("false") else 0.1)
            axis.grid(True, which="both", alpha=0.2)
    axes[0][0].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(path, dpi=100)
    plt.close(figure)
    return True


def soft(found: dict[str, Any] | None, path: Path) -> bool:
    """Error of soft shadows against milliseconds, with the line of 1 / sqrt(n)."""
    if not found:
        return False
    steps = found["steps"]
    ms, rms = [step["ms"] for step in steps], [step["rms"] for step in steps]
    figure, axis = plt.subplots(figsize=(8, 5.5))
    axis.plot(ms, rms, "o-", label=f"against own 4096 samples: n^{found['falls']:.2f}")
    axis.plot(ms, [rms[0] / step["samples"] ** 0.5 for step in steps], "k:", label="1 / √n")
    axis.plot(*zip(*[(step["ms"], step["expected"]) for step in steps if step["expected"]]), "s--", color="tab:orange",
              label="expected by the library")
    axis.axhline(found["bias_rms"], color="tab:red", linewidth=1, label="4096 samples against the exact penumbra")
    for step in steps:
        axis.annotate(str(step["samples"]), (step["ms"], step["rms"]), textcoords="offset points", xytext=(5, 5))
    axis.set(xscale="log", yscale="log", xlabel=f"ms for the shadows of {found['points']:,} points",
             ylabel="rms error in the penumbra", title=f"Soft shadows, 1 to 256 samples, {found['device']}")
    axis.grid(True, which="both", alpha=0.25)
    axis.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return True


def scans(rows: list[Row] | None, path: Path, title: str) -> bool:
    """False surface against PSNR, a dot a scene and a large one for their mean, of every mode."""
    if not rows:
        return False
    figure, axes = plt.subplots(1, 2, figsize=(13, 5.6), sharey=True)
    for axis, held_out in zip(axes, (False, True)):
        for number, mode in enumerate(dict.fromkeys(row["mode"] for row in rows)):
            places = []
            for scene in dict.fromkeys(row["scene"] for row in rows if row["held_out"] == held_out):
                some = [row for row in rows if row["mode"] == mode and row["scene"] == scene]
                if some:
                    places.append((100.0 * sum(row["false"] for row in some) / len(some),
                                   sum(row["psnr"] for row in some) / len(some)))
            if places:
                color = plt.get_cmap("tab20")(number % 20)
                axis.plot(*zip(*places), ".", color=color, alpha=0.5)
                axis.plot(sum(x for x, _ in places) / len(places), sum(y for _, y in places) / len(places),
                          "s" if mode.startswith("vtk") else "o", color=color, markeredgecolor="black", markersize=10, label=mode)
        axis.set(xlabel="false surface, % of scanned pixels", title="scenes held out" if held_out else "scenes for tuning")
        axis.grid(True, alpha=0.25)
    axes[0].set_ylabel("PSNR over scanned pixels, dB")
    axes[0].legend(fontsize=8)
    figure.suptitle(f"Virtual scans against exact views (upper left is better): {title}", fontsize=10)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return True


def ranges(found: dict[str, Any] | None, path: Path, title: str) -> bool:
    """Filling, discs and range images on the same scans: the processor's time against what is wrong, a line a surface, a dot a density."""
    if not found:
        return False
    shown = (("PSNR, dB (upper left is better)", lambda e: e["color_psnr"]), ("normals off, °", lambda e: e["normal_mean_degrees"]),
             ("coverage wrong, %", lambda e: 100.0 * (1.0 - e["coverage_iou"])))
    figure, axes = plt.subplots(1, 3, figsize=(15, 5.2))
    for axis, (label, value) in zip(axes, shown):
        for number, name in enumerate(dict.fromkeys(row["surface"] for row in found["surfaces"])):
            rows = [row for row in found["surfaces"] if row["surface"] == name]
            axis.plot([row["work_ms"] for row in rows], [value(row["error"]) for row in rows], "o-", color=plt.get_cmap("tab10")(number), label=name)
            for row in rows:
                axis.annotate(count(row["points"]), (row["work_ms"], value(row["error"])), fontsize=7, xytext=(4, 4), textcoords="offset points")
        axis.set(xscale="log", xlabel="the processor's ms a frame, without analysis", ylabel=label)
        axis.grid(True, which="both", alpha=0.2)
    axes[0].legend(fontsize=8)
    figure.suptitle(f"Eighteen scans of a torus, 512 x 512: {title}", fontsize=10)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)
    return True


def draw(result: dict[str, Any], folder: Path) -> list[str]:
    """Draws what the run holds; the names of the files."""
    title = f"{result['processor']}, {result['cores']} cores, {result['date']}"
    against = [row for row in joined(result, "headline", "peers") if row["points"] == 1_000_000 and row["error"]]
    scenes = joined(result, "scenes")
    drawn = []
    for name, done in (("pareto.png", lambda path: pareto(against, path, title)),
                       ("scaling.png", lambda path: scaling(result, path)),
                       ("passes.png", lambda path: passes(joined(result, "headline", "points"), path)),
                       ("scans.png", lambda path: scans(result.get("scans"), path, title)),
                       ("ranges.png", lambda path: ranges(result.get("ranges"), path, title)),
                       ("soft.png", lambda path: soft(result.get("soft"), path)),
                       ("densities.png", lambda path: bool(scenes) and densities(scenes, path))):
        if done(folder / name):
            drawn.append(name)
        else:
            (folder / name).unlink(missing_ok=True)
    return drawn
