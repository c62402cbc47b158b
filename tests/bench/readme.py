# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a run's figures into the pages that quote them, between <!-- bench NAME --> and <!-- end -->, and its plots
into .pictures/."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gpu
import papers
import plots
from tables import Row, count, joined, name_of, table

PAGES = ("README.md", "tests/bench/README.md")
NAMES = {"cpu-avx512": "processor, AVX-512", "cpu-avx2": "processor, AVX2", "cpu-sse42": "processor, SSE4.2", "cpu-neon": "processor, NEON",
         "cpu-scalar": "processor, plain", "gl-egl": "OpenGL, EGL", "gl-osmesa": "OpenGL, OSMesa"}
QUALITIES = {"refined": "refined", "paper": "as in the paper", "unfilled": "points alone", "splats": "discs",
             "analysed": "analysed", "averaged": "analysed, averages", "final": "analysed, 16 samples",
             "known discs": "analysed, discs"}


def _line(row: Row) -> list[str]:
    e = row["error"]
    return [NAMES.get(name_of(row), name_of(row)), count(row["points"]), QUALITIES.get(row["quality"], row["quality"]),
            f"{row['ms_median']:.1f}", f"{100 * e['false_holes']:.3f}",
            f"{100 * e['false_growth']:.2f} ({100 * e['outer_growth']:.2f})", f"{e['depth_rms_spacings']:.2f}",
            f"{e['normal_mean_degrees']:.2f}", f"{e['color_rms']:.4f}", f"{e['color_psnr']:.1f}",
            f"{e['color_ssim']:.3f}"]


def speed(result: dict[str, Any]) -> str:
    first = joined(result, "headline")[0]
    rows = [*joined(result, "headline"),
            *(row for row in joined(result, "points") if row["points"] > 10_000 and row["device"] == first["device"]),
            *(row for row in joined(result, "levels") if name_of(row) != name_of(first))]
    head = ["device", "points", "quality", "ms a frame", "open, %", "grown, % (off the outline)",
            "depth rms, spacings", "normal mean, °", "colour rms", "PSNR, dB", "SSIM"]
    return (f"Measured on {result['date']}, version {result['version']}: {result['processor']}, "
            f"{result['cores']} cores.\n\n" + table(head, [_line(row) for row in rows]))


def aims(result: dict[str, Any]) -> str:
    rows = {(row["device"], row["quality"]): row for row in joined(result, "headline")}
    row = rows[joined(result, "headline")[0]["device"], "refined"]
    return (f"The processor's {row['ms_median']:.1f} ms at a million points are "
            f"{row['ms_median'] / row['floor_ms']:.1f} times what moving the bytes alone would take at the "
            f"{result['bandwidth']:.0f} GB/s that a copy on "
            f"{result['cores']} threads moves here.")


def others(result: dict[str, Any]) -> str:
    """How many times as long other programs take, and what they leave wrong."""
    rows = joined(result, "peers")
    library = next(row for row in joined(result, "headline") if row["quality"] == "refined")
    ours = {row["quality"]: row["ms_median"] for row in rows if row["device"].startswith("Patina")}
    body = []
    for row in [library, *rows]:
        e, mine = row["error"], row["device"].startswith("Patina") or row is library
        same_way = ours.get(row["quality"])
        depth = f"{e['depth_rms_spacings']:.2f}" if "depth_rms_spacings" in e else "–"
        blender = not row["device"].startswith("VTK") and not mine and same_way
        body.append(["Patina's library" if row is library else row["device"],
                     "moving camera" if row is library else row["quality"], f"{row['ms_median']:.0f}",
                     "" if row is library else f"{row['ms_median'] / library['ms_median']:.1f}×",
                     f"{row['ms_median'] / same_way:.1f}×" if blender else "",
                     f"{100.0 * (1.0 - e['coverage_iou']):.2f}", depth, f"{e['color_psnr']:.1f}"])
    head = ["program", "what", "ms", "against the library", "against Patina in Blender", "coverage wrong, %",
            "depth rms, spacings", "PSNR, dB"]
    return table(head, body)


def effects(result: dict[str, Any]) -> str:
    """Layers and shadows of the headline's cloud, and what VTK takes for the same."""
    rows = joined(result, "effects")
    peer = {row["mode"]: row for row in rows if row["device"].startswith("VTK")}
    names = {"6 layers": "six layers of half transparent points", "shadows kept": "hard shadows of a sun at rest, the camera moves",
             "shadows 1": "hard shadows of a sun that moves, and the camera"}
    body = []
    for row in rows:
        if row["mode"] in peer and not row["device"].startswith("VTK"):
            other = peer[row["mode"]]
            body.append([names[row["mode"]], "as in the paper" if row["quality"] == "paper" else row["quality"],
                         f"{row['ms_median']:.1f}", other["device"], f"{other['ms_median']:.0f}",
                         f"{other['ms_median'] / row['ms_median']:.1f}×"])
    return table(["what", "quality", "ms", "peer", "ms", "ratio"], body)


def scaling(result: dict[str, Any]) -> str:
    """What more threads bring, and how many times as fast as one they are."""
    rows = joined(result, "scaling")
    threads = sorted({row["threads"] for row in rows})
    lines: dict[tuple[int, int], dict[int, float]] = {}
    for row in rows:
        lines.setdefault((row["points"], row["width"]), {})[row["threads"]] = row["ms_median"]
    body = [[count(points), f"{width}²",
             *(f"{ms[n]:.1f} ({ms[1] / ms[n]:.1f}×)" if n in ms and 1 in ms else "–" for n in threads)]
            for (points, width), ms in lines.items()]
    return (f"{result['date']}, {result['processor']}, {result['cores']} cores; ms a frame.\n\n" +
            table(["points", "picture", *(f"{n} thread{'s' * (n > 1)}" for n in threads)], body))


def inside(result: dict[str, Any]) -> str:
    """A camera among the points, with and without their normals."""
    body = [[NAMES.get(name_of(row), name_of(row)), count(row["points"]), "no" if row.get("bare") else "yes",
             f"{row['ms_median']:.1f}", f"{row['error']['normal_mean_degrees']:.2f}",
             f"{row['error']['normal_p99_degrees']:.1f}", f"{row['error']['color_psnr']:.1f}"]
            for row in joined(result, "inside")]
    return (f"{result['date']}, {result['processor']}, {result['cores']} cores.\n\n" +
            table(["device", "points", "with normals", "ms a frame", "normal mean, °", "normal 99%, °", "PSNR, dB"], body))


def discs(result: dict[str, Any]) -> str:
    """Filling against discs, few points and many."""
    body = [[count(row["points"]), QUALITIES[row["quality"]], f"{row['ms_median']:.1f}", f"{row['error']['color_psnr']:.1f}",
             f"{row['error']['depth_rms_spacings']:.2f}", f"{row['error']['normal_mean_degrees']:.2f}"]
            for row in joined(result, "discs")]
    return table(["points", "surface", "ms", "PSNR, dB", "depth rms, spacings", "normal mean, °"], body)


def lines(result: dict[str, Any]) -> str:
    """What lines add to the headline's picture."""
    plain, *wide = (row["ms_median"] for row in joined(result, "lines"))
    return (f"One million points at 1024 × 1024 take {plain:.1f} ms without lines and {', '.join(f'{ms:.1f}' for ms in wide)} with "
            f"lines of 2, 8 and 16 pixels.")


def styles(result: dict[str, Any]) -> str:
    """Every style's time on the headline's cloud, and as a multiple of the plain one's."""
    rows = joined(result, "styles")
    plain = next(row for row in rows if row["quality"] == "As Scanned")["ms_median"]
    body = [[row["quality"], f"{row['ms_median']:.1f}", f"{row['ms_median'] / plain:.1f}×",
             f"{100.0 * (1.0 - row['error']['coverage_iou']):.2f}", f"{row['error']['depth_rms_spacings']:.2f}"] for row in rows]
    return table(["style", "ms", "against As Scanned", "coverage wrong, %", "depth rms, spacings"], body)


def hard(rows: str) -> str:
    """The verdicts of the table of hard cases, in two sentences."""
    verdicts: dict[str, list[str]] = {}
    for line in rows.splitlines()[2:]:
        case, *_, verdict = (cell.strip() for cell in line.strip("|").split("|"))
        verdicts.setdefault(verdict, [])
        verdicts[verdict] += [case] * (case not in verdicts[verdict])
    told = [f"{len(verdicts.pop('holds', []))} hold on every device tried, the table in `bench.html` says by how much."]
    told += [f"{verdict[0].upper() + verdict[1:]}: {'; '.join(cases)}." for verdict, cases in verdicts.items()]
    return " ".join(told)


def memory(result: dict[str, Any]) -> str:
    row = joined(result, "headline")[0]
    return (f"**Memory and upload.** {row['cloud_bytes'] / row['points']:.1f} bytes a point at rest with colour and "
            f"normal, 8 more while building, beside the caller's own arrays. The planes of a picture take "
            f"{row['plane_bytes'] / 2**20:.0f} MB at 1024 × 1024. Taking in a million points takes "
            f"{row['upload_ms'] / 1e3:.2f} s.")


def independent(result: dict[str, Any]) -> str:
    """Shapes that no rule was made on: decibels by density, and of all else the worst at any of them."""
    rows = joined(result, "independent")
    densities = sorted({row["density"] for row in rows})
    body = []
    for scene, quality in dict.fromkeys((row["scene"], row["quality"]) for row in rows):
        own = {row["density"]: row for row in rows if (row["scene"], row["quality"]) == (scene, quality)}
        errors = [row["error"] for row in own.values()]
        flicker = [max((error[name] for error in errors if name in error), default=None) for name in ("flicker_inside", "flicker_edges")]
        body.append([scene, QUALITIES.get(quality, quality),
                     *(f"{own[density]['error']['color_psnr']:.1f}" if density in own else "–" for density in densities),
                     f"{max(row['ms_median'] for row in own.values()):.1f}",
                     f"{100.0 * max(error['inner_holes'] for error in errors):.2f}",
                     f"{100.0 * max(error['outer_growth'] for error in errors):.2f}",
                     f"{max(error['depth_rms_spacings'] for error in errors):.2f}",
                     f"{max((error['depth_bias_spacings'] for error in errors), key=abs):+.3f}",
                     " / ".join("–" if one is None else f"{one:.1f}" for one in flicker)])
    return table(["shape", "quality", *(f"dB at {density:g}" for density in densities), "slowest, ms", "open inside, %",
                  "grown off the outline, %", "depth rms, spacings", "depth bias, spacings", "flicker inside / at edges, levels"], body)


def short(result: dict[str, Any]) -> str:
    """The first page's table: ours and the peers' moving camera, each with its error."""
    library = next(row for row in joined(result, "headline") if row["quality"] == "refined")
    rows = [row for row in joined(result, "peers") if not row["device"].startswith("Patina") and row["quality"] == "moving camera"]
    body = []
    for row in [library, *rows]:
        own = row is library
        body.append(["**Patina**" if own else row["device"], f"{row['ms_median']:.0f}",
                     "" if own else f"{row['ms_median'] / library['ms_median']:.0f}×",
                     f"{100.0 * (1.0 - row['error']['coverage_iou']):.1f}", f"{row['error']['color_psnr']:.1f}"])
    return table(["program", "ms a frame", "as long", "coverage wrong, %", "PSNR, dB"], body)


def has_rows(part: str) -> bool:
    """Whether every table of a part has rows, so that nothing that was measured gives way to an empty one."""
    lines = [*part.splitlines(), ""]
    return not any(set(line) == set("|-") and not after.startswith("|") for line, after in zip(lines, lines[1:]))


def update(result: dict[str, Any], root: Path) -> str:
    """Writes what the run holds and the pages have marks for; returns what, in a sentence a page."""
    against = [row for row in joined(result, "headline", "peers") if row["points"] == 1_000_000 and row["error"]]
    title = f"{result['processor']}, {result['cores']} cores, {result['date']}"
    parts = {}
    if joined(result, "headline"):
        plots.pareto(against, root / ".pictures/pareto.png", title)
        parts |= {"speed": speed(result), "aims": aims(result), "memory": memory(result)}
        if joined(result, "peers"):
            parts |= {"others": others(result), "short": short(result)}
        if any(row["device"].startswith("VTK") for row in joined(result, "effects")):
            parts["effects"] = effects(result)
    for name, part in (("discs", discs), ("lines", lines), ("inside", inside), ("styles", styles),
                       ("independent", independent)):
        if joined(result, name):
            parts[name] = part(result)
    if result.get("scans"):
        import scans
        parts["scans"] = scans.markdown(result["scans"])
        plots.scans(result["scans"], root / ".pictures/scans.png", title)
    if result.get("ranges"):
        import ranges
        when = f"{title}; {result['load']:.0f} programs ran beside it.\n\n"
        parts |= {"ranges paper": when + ranges.paper(result["ranges"]), "ranges surfaces": when + ranges.surfaces(result["ranges"])}
        plots.ranges(result["ranges"], root / ".pictures/ranges.png", title)
    if any(row.get("hardware") for row in joined(result, "gpu")):
        parts["gpu"] = f"{result['date']}, beside {result['processor']}, {result['cores']} cores.\n\n" + gpu.markdown(result, few=True)
    if any(row["threads"] > 1 for row in joined(result, "scaling")):
        parts["scaling"] = scaling(result)
    for quality in ("paper", "refined"):
        if papers.ratios(result, quality):
            parts[f"papers {quality}"] = papers.table(result, quality)
    for name, part in result["parts"].items():
        if not any(line.startswith("skip") for line in part["text"].splitlines()):
            parts[name] = hard(part["text"]) if name == "hard" else f"{title}.\n\n" * (name == "frames") + part["text"]
    told = []
    for page in PAGES:
        path = root / page
        if not path.is_file():
            continue
        text, written = path.read_text(), []
        for name, part in parts.items():
            begin, end = f"<!-- bench {name} -->\n", "<!-- end -->"
            if begin in text and has_rows(part):
                before, rest = text.split(begin, 1)
                text = before + begin + part + "\n" + rest[rest.index(end):]
                written.append(name)
        path.write_text(text)
        told.append(f"{page}: {', '.join(written) or 'no marks found'}")
    return "\n".join(told)
