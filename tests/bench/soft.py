# SPDX-License-Identifier: GPL-3.0-or-later
"""Soft shadows: their error against the time that they take. A ball over a plane under a wide sun; whole textures of
1 to 256 samples against our own of 4096 (what samples make wrong), and those against the exact penumbra (what maps
make wrong, however many samples there are). Errors are over the points that the truth has in the penumbra."""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

sys.path[:0] = [str(Path(__file__).resolve().parents[2] / "addon"), str(Path(__file__).resolve().parent)]

import numpy as np  # noqa: E402
import stage  # noqa: E402
from truth.light import visibility  # noqa: E402

import native  # noqa: E402

POINTS, ANGLE, MOST = 60_000, 0.2, 4096
STEPS = tuple(2**k for k in range(9))  # samples
PLANE = 0  # the surface whose points are compared: on the ball the shadow's border lies where light grazes


def _truth(shown: stage.Stage, points: Any) -> np.ndarray:
    light = replace(shown.scene.lights[0], angle=ANGLE)
    return stage.kept(f"soft-{POINTS}-{ANGLE:g}", lambda: {"m": visibility(
        shown.scene, light, points.position[points.surface == PLANE].astype(np.float64))})["m"]


def measure(name: str) -> dict[str, Any]:
    """steps: of each number of samples ms, rms, expected (the library's own estimate; 0: too few for one)."""
    shown = stage.analytic({"surface": "shadow", "points": POINTS})
    points = stage.points_of("shadow", shown.scene, POINTS, "random", 0.0)
    plane, exact = points.surface == PLANE, _truth(shown, points)
    soft = (exact > 0.0) & (exact < 1.0)
    device = native.Device(name)
    cloud = native.Cloud(shown.position, shown.normal, shown.color)

    def textures(samples: int, frames: int, **more: Any) -> tuple[np.ndarray, float, dict[str, Any]]:
        times = []
        for _ in range(frames):
            scene = native.Scene()
            scene.add_cloud(cloud, lighting=2)
            scene.add_light(**{**shown.lights[0], "shadows": 1, "angle": ANGLE})
            scene.set_settings(width=16, height=16, shadow_samples=samples, **more)
            scene.set_camera(**shown.camera(0.0).fields())
            frame = native.Frame(device)
            start = time.perf_counter()
            frame.bake_shadows(scene)
            times.append(1e3 * (time.perf_counter() - start))
        frame.render(scene)
        return frame.shadows(0, 0, POINTS)[plane], median(times), frame.stats()

    own, _, _ = textures(MOST, 1)
    textures(1, 3)  # warm
    steps = []
    for samples in STEPS:
        values, ms, _ = textures(samples, 9 if samples <= 16 else 3)
        expected = textures(samples, 1, shadow_error=1e-9)[2]["shadow_error"] if samples >= 4 else 0.0
        steps.append({"samples": samples, "ms": ms, "expected": float(expected),
                      "rms": float(np.sqrt(np.square(values - own)[soft].mean()))})
    rms = [step["rms"] for step in steps]
    return {"device": device.name, "points": POINTS, "angle": ANGLE, "soft": int(soft.sum()), "steps": steps,
            "falls": float(np.polyfit(np.log(STEPS), np.log(rms), 1)[0]),
            "bias": float((own - exact)[soft].mean()), "bias_rms": float(np.sqrt(np.square(own - exact)[soft].mean()))}


def markdown(soft: dict[str, Any]) -> str:
    head = ("| samples | ms | rms against 4096 samples | expected | rms × √samples |\n" + "|---" * 5 + "|\n")
    body = "\n".join(f"| {step['samples']} | {step['ms']:.1f} | {step['rms']:.4f} | "
                     f"{step['expected'] or float('nan'):.4f} | {step['rms'] * step['samples'] ** 0.5:.3f} |"
                     for step in soft["steps"]).replace("nan", "–")
    return (f"## Soft shadows: error against time\n\nWhole textures of {soft['points']:,} points, {soft['device']}, a sun "
            f"{soft['angle']:g} radians wide; errors over {soft['soft']:,} points of the plane in the penumbra. Falls as "
            f"n^{soft['falls']:.2f}. 4096 samples are off from the exact penumbra by {soft['bias']:+.4f} in the mean, "
            f"{soft['bias_rms']:.4f} rms.\n\n{head}{body}\n")
