# SPDX-License-Identifier: GPL-3.0-or-later
"""The named scenes; all fit the camera that truth.orbit() gives."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .light import Light
from .scene import Scene
from .shapes import SHAPES
from .surfaces import Box, Gyroid, Rectangle, Saddle, Sphere, Surface, Torus, rotation, translation

SUN = Light(power=np.pi, towards=np.array([0.36, -0.48, 0.8]))  # a white Lambert surface that faces it shows 1
STEP = 0.05  # between the two parallel planes, world units


def tilted(degrees: float) -> Rectangle:
    """A rectangle whose normal is so far off the direction to the camera at azimuth 0."""
    return Rectangle(width=2.0, height=2.0).placed(rotation("x", 50.0 - degrees))


SURFACES: dict[str, Callable[[], tuple[Surface, ...]]] = {
    "sphere": lambda: (Sphere(),),
    "torus": lambda: (Torus(),),
    # the outer ones let the inner ones through
    "tori": lambda: (Torus(tube=0.1), Torus(tube=0.25, opacity=0.5), Torus(tube=0.4, opacity=0.3)),
    "plane45": lambda: (tilted(45.0),),
    "plane75": lambda: (tilted(75.0),),
    "plane85": lambda: (tilted(85.0),),
    "step": lambda: (Rectangle(width=2.0, height=2.0),
                     Rectangle(width=1.0, height=2.0).placed(translation(0.5, 0.0, STEP))),
    "saddle": lambda: (Saddle(),),
    "gyroid": lambda: (Gyroid(),),
    "fin": lambda: (Rectangle(width=2.0, height=2.0),
                    Box(half=(0.7, 0.004, 0.35)).placed(rotation("z", 30.0), translation(0.0, 0.0, 0.35))),
    "corner": lambda: (Box(half=(0.65, 0.65, 0.65)).placed(rotation("z", 30.0)),),
    "shadow": lambda: (Rectangle(width=2.0, height=2.0), Sphere(radius=0.4).placed(translation(0.0, 0.0, 0.6))),
}


def build(name: str) -> Scene:
    """A scene by name, under one sun."""
    made = (SURFACES | SHAPES).get(name)
    if not made:
        raise ValueError(f"no scene '{name}': there are {', '.join(SURFACES | SHAPES)}")
    return Scene(made(), (SUN,))
