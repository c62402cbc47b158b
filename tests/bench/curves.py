# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures native/plan/expected_curves.def: what a picture is off by, against the spacing of points on screen, for each way to
close a surface. Sphere and torus, points at random, lit; the worse of the two counts."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "addon"), str(Path(__file__).resolve().parent)]

import case as cases  # noqa: E402
import metrics  # noqa: E402
import stage as stages  # noqa: E402
from modes import MODES, scene_of  # noqa: E402

import native  # noqa: E402

MEANS = {"UNFILLED": {"quality": 1, "fill": 2}, "PAPER": {"quality": 1, "fill": 1}, "CLOSED": {"quality": 1, "fill": 0},
         "REFINED": {"quality": 0, "fill": 0}, "SPLATS": {"surface": 1}}  # as enum pt_means
SURFACES = ("sphere", "torus")
DENSITIES = (30.0, 15.0, 8.0, 4.0, 2.0, 1.0, 0.5, 0.25, 0.1)  # points a pixel where the surface faces the camera
SIZE = 512
HEAD = """// SPDX-License-Identifier: GPL-3.0-or-later
// Measured by build/curves: do not edit. PT_CURVE(means, spacing in pixels, colour, coverage, depth, normal); see
// patina_expected_error for what they say. Sphere and torus, random points, {size} x {size}; the worse of the two.
"""


def rendered(frame: native.Frame, name: str, density: float, shape: dict[str, Any] | None = None, **settings: Any
             ) -> tuple[dict[str, Any], dict[str, float]]:
    """Statistics of a picture and its errors, in the units of patina_expected_error. shape: what more stage_of takes."""
    shown = stages.stage_of({"surface": name, "points": stages.density_count(name, density, SIZE), **(shape or {})})
    cloud = native.Cloud(shown.position, shown.normal, shown.color)
    frame.render(scene_of(cloud, shown, MODES["surface"], (SIZE, SIZE), 0.0, **settings))
    off = metrics.errors(shown.exact(0.0, SIZE, SIZE), cases.picture(frame), shown.spacing)
    return frame.stats(), {"color": 10.0 ** (-off["color_psnr"] / 20.0), "coverage": 1.0 - off["coverage_iou"],
                           "depth": off.get("depth_rms_spacings", 0.0), "normal": off.get("normal_mean_degrees", 0.0)}


def curve(frame: native.Frame, means: str) -> list[tuple[float, dict[str, float]]]:
    """(spacing on screen, errors), spacing rising."""
    points = []
    for density in DENSITIES:
        pictures = [rendered(frame, shape, density, **MEANS[means]) for shape in SURFACES]
        worst = {name: max(errors[name] for _, errors in pictures) for name in pictures[0][1]}
        points.append((sum(stats["spacing_px"] for stats, _ in pictures) / len(pictures), worst))
    return sorted(points, key=lambda point: point[0])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "native/plan/expected_curves.def")
    options = parser.parse_args()
    frame = native.Frame(native.Device("cpu", 0))
    lines = [HEAD.format(size=SIZE)]
    for means in MEANS:
        for spacing, errors in curve(frame, means):
            lines.append(f"PT_CURVE({means}, {spacing:.4f}, {errors['color']:.5f}f, {errors['coverage']:.5f}f, "
                         f"{errors['depth']:.4f}f, {errors['normal']:.4f}f)\n")
            print(lines[-1], end="")
    options.out.write_text("".join(lines), encoding="utf-8")
    print(f"curves: wrote {options.out}; compile anew")
    return 0


if __name__ == "__main__":
    sys.exit(main())
