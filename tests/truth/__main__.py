# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes exact pictures and points to .npz files.

    cd tests && python3 -m truth picture torus torus.npz --size 512 --layers 8
    cd tests && python3 -m truth points torus points.npz --count 100000 --pattern blue --noise 0.5

A picture holds the arrays of truth.Picture and the camera (world_from_camera, window, near, far); points hold position,
normal, color, surface, spacing.
"""

from __future__ import annotations

import argparse
import dataclasses

import numpy as np

from . import scenes
from .camera import orbit, parallel
from .sampling import PATTERNS, sample


def main() -> None:
    parser = argparse.ArgumentParser(prog="python3 -m truth", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    kinds = parser.add_subparsers(dest="kind", required=True)
    picture, points = kinds.add_parser("picture"), kinds.add_parser("points")
    for one in (picture, points):
        one.add_argument("scene", choices=scenes.SURFACES)
        one.add_argument("output")
    picture.add_argument("--size", type=int, default=512)
    picture.add_argument("--azimuth", type=float, default=0.0)
    picture.add_argument("--elevation", type=float, default=40.0)
    picture.add_argument("--orthographic", action="store_true")
    picture.add_argument("--layers", type=int, default=1)
    picture.add_argument("--antialias", type=int, default=8, help="rays squared on edges (default 8)")
    picture.add_argument("--shadow-samples", type=int, default=0, help="places on each light; 0: no shadows")
    picture.add_argument("--sun-angle", type=float, default=0.0, help="degrees across")
    points.add_argument("--count", type=int, default=100_000)
    points.add_argument("--pattern", choices=PATTERNS, default="random")
    points.add_argument("--noise", type=float, default=0.0, help="standard deviation along the normal, spacings")
    points.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    scene = scenes.build(options.scene)
    if options.kind == "points":
        cloud = sample(scene, options.count, options.pattern, options.noise, options.seed)
        np.savez(options.output, **dataclasses.asdict(cloud))
        return
    if options.sun_angle:
        lights = tuple(dataclasses.replace(one, angle=np.radians(options.sun_angle)) for one in scene.lights)
        scene = dataclasses.replace(scene, lights=lights)
    camera = orbit(options.azimuth, options.elevation)
    if options.orthographic:
        camera = parallel(camera, 3.6)
    exact = scene.picture(camera, options.size, options.size, options.layers, options.antialias, options.shadow_samples)
    np.savez_compressed(options.output, **dataclasses.asdict(exact), world_from_camera=camera.matrix,
                        window=[camera.left, camera.right, camera.bottom, camera.top], near=camera.near, far=camera.far)


if __name__ == "__main__":
    main()
