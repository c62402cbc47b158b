# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes drawn as triangles against meshes drawn as points spread over them, both against the exact shape: a box seen at a
corner, and a ball. bench.py calls measure(); the file runs itself in a bpy module, for the add-on reads Blender's meshes.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SIZE = 1024
EYE, ALBEDO, SUN = (3.0, -4.0, 3.0), 0.8, (0.5, -0.4, 0.9)  # towards the sun
FRAMES = 9


def measure(library: Path) -> str:
    """A table, or "skip: " and why there is none."""
    python = ROOT / "build/out/bpy45/bin/python"
    if not python.exists():
        return "skip: need build/out/bpy45 (build/setup test)."
    with tempfile.TemporaryDirectory(prefix="patina-bench-") as name:
        (Path(name) / "patina").symlink_to(ROOT / "addon")
        environment = {**os.environ, "PYTHONPATH": name, "PATINA_LIBRARY": str(library), "PYTHONDONTWRITEBYTECODE": "1"}
        done = subprocess.run([python, __file__], env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        return f"skip: {(done.stderr.strip().splitlines() or ['failed'])[-1]}"
    rows = json.loads(done.stdout.splitlines()[-1])
    lines = [f"| {shape} | {kind} | {wrong:.3f} | {depth:.3f} | {normal:.2f} | {color:.4f} | {build:.0f} | {ms:.1f} |"
             for shape, kind, wrong, depth, normal, color, build, ms in rows]
    return "\n".join(["| shape | drawn as | pixels wrong, % | depth rms, pixels | normal mean, ° | colour rms | taking in, ms | "
                      "ms a frame |", "|---|---|---|---|---|---|---|---|", *lines])


def main() -> None:
    import bpy
    import numpy as np
    from patina import native
    from patina.sync.objects import meshes

    def unit(v):
        return np.asarray(v) / np.linalg.norm(v, axis=-1, keepdims=True)

    # the camera: rows of pixels from the bottom
    back = unit(np.array(EYE))
    right = unit(np.cross((0, 0, 1), back))
    up = np.cross(back, right)
    half = 0.35
    steps = (np.arange(SIZE) + 0.5) / SIZE * 2.0 * half - half
    ways = steps[None, :, None] * right + steps[:, None, None] * up - back  # z of a hit is its parameter
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = np.stack([right, up, back], 1), EYE
    toward = unit(np.array(SUN))

    def box():
        with np.errstate(divide='ignore'):
            ends = np.sort((np.stack([np.full(3, -0.8), np.full(3, 0.8)], -1) - np.array(EYE)[:, None]) / ways[..., None], -1)
        near, far = ends[..., 0].max(-1), ends[..., 1].min(-1)
        normal = -np.sign(ways) * (ends[..., 0] == near[..., None])
        return np.where(near <= far, near, np.inf), normal

    def ball():
        a, b, c = (ways ** 2).sum(-1), ways @ np.array(EYE), np.dot(EYE, EYE) - 1.0
        root = b * b - a * c
        z = np.where(root >= 0.0, (-b - np.sqrt(np.maximum(root, 0.0))) / a, np.inf)
        return z, np.array(EYE) + np.where(np.isfinite(z), z, 0.0)[..., None] * ways

    def picture(truth, add):
        device = native.Device("cpu")
        z, normal = truth
        with native.Scene() as scene, native.Frame(device) as frame:
            scene.set_settings(width=SIZE, height=SIZE, film_transparent=1, passes=0b1111)
            scene.set_camera(world_from_camera=matrix.ravel().tolist(), left=-half, right=half, bottom=-half, top=half,
                             near_clip=0.1, far_clip=100.0)
            scene.add_light(type=1, power=3.0, direction=(-toward).tolist())
            start = time.perf_counter()
            add(scene)
            build = time.perf_counter() - start
            times = []
            for _ in range(FRAMES):
                frame.render(scene)
                times.append(frame.stats()["ms"])
            depth, shown, color = (frame.read(name) for name in ("DEPTH", "NORMAL", "COMBINED"))
        depth = depth[..., 0].astype(float)
        hit, drawn = np.isfinite(z), np.isfinite(depth)
        both = hit & drawn
        width = 2.0 * half / SIZE * z[both]
        cosine = np.clip((shown[both] * normal[both]).sum(-1), -1.0, 1.0)
        lit = ALBEDO * 3.0 / np.pi * np.maximum(normal @ toward, 0.0)
        off = np.where(hit, lit, 0.0)[hit | drawn] - color[hit | drawn][:, 0]
        return (100.0 * (hit != drawn).sum() / hit.sum(), float(np.sqrt((((depth[both] - z[both]) / width) ** 2).mean())),
                float(np.degrees(np.arccos(cosine)).mean()), float(np.sqrt((off ** 2).mean())), 1e3 * build, min(times))

    rows = []
    for name, truth in (("box", box()), ("ball", ball())):
        if name == "box":
            bpy.ops.mesh.primitive_cube_add(size=1.6)
        else:
            bpy.ops.mesh.primitive_uv_sphere_add(segments=512, ring_count=256, radius=1.0)
            bpy.context.object.data.shade_smooth()
        obj = bpy.context.object.evaluated_get(bpy.context.evaluated_depsgraph_get())
        keep = []

        def as_triangles(scene, obj=obj, keep=keep):
            keep.append(native.Mesh(*meshes.triangles(obj)))
            scene.add_mesh(keep[-1], color=(ALBEDO,) * 3)

        rows.append((name, f"{len(obj.data.loop_triangles):,} triangles", *picture(truth, as_triangles)))
        for count in (100_000, 500_000, 2_000_000):
            def as_points(scene, obj=obj, keep=keep, count=count):
                positions, normals, _ = meshes.sample(obj, count)
                keep.append(native.Cloud(positions, normals))
                scene.add_cloud(keep[-1], lighting=2, color=(ALBEDO,) * 3)

            rows.append((name, f"{count:,} points", *picture(truth, as_points)))
    print(json.dumps(rows))


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)  # the bpy module may hang in its own clean-up
