# SPDX-License-Identifier: GPL-3.0-or-later
"""A first image: a torus of points that numpy makes, analyzed and rendered.

    python -m patina_render.example torus.png
"""

import sys

import numpy as np

import patina_render as patina


def main(path: str) -> None:
    # 200,000 points, evenly spread over a torus with the radii 1 and 0.4, colored by the angle around its axis
    number = np.arange(200_000)
    around, across = 2 * np.pi * (0.754878 * number % 1), 2 * np.pi * (0.569840 * number % 1)
    ring = 1 + 0.4 * np.cos(across)
    positions = np.stack([ring * np.cos(around), ring * np.sin(around), 0.4 * np.sin(across)], axis=1)  # (n, 3)
    colors = 0.5 + 0.4 * np.cos(around[:, None] + [0, 2, 4])  # (n, 3), linear

    cloud = patina.Cloud(positions, colors)
    cloud.analyze()

    scene = patina.Scene(background=(1, 1, 1))
    scene.add(cloud, lit=True)
    scene.add_sun((0.5, 1, -1.5), angle=1, shadows=True)
    scene.frame(azimuth=20, elevation=35)
    result = patina.render(scene, 640, 480, samples=4, device="cpu")

    near = np.isfinite(result.depth)
    print(f"{near.mean():.0%} of the pixels show the torus, {result.depth[near].min():.2f} to {result.depth[near].max():.2f} away")
    patina.write_png(path, result.image)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
