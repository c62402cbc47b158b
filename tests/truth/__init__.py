# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes whose exact picture is known without points, and points sampled from them. float64, numpy alone (blue noise:
scipy).

    from truth import scenes, orbit, sample
    scene = scenes.build("tori")
    picture = scene.picture(orbit(azimuth=0), 1024, 1024, layers=8, shadow_samples=0)   # what a ray caster sees: exact
    points = sample(scene, 1_000_000, "random", noise=0.5)                              # what a scanner brings home

On the command line, with tests/ as the folder: python3 -m truth --help.
"""

from . import scenes
from .camera import Camera, look, orbit, parallel
from .light import Light, places, visibility
from .sampling import PATTERNS, Points, count_for, sample
from .scene import Material, Picture, Scene, linear, srgb_bytes

__all__ = ["PATTERNS", "Camera", "Light", "Material", "Picture", "Points", "Scene", "count_for", "linear", "look",
           "orbit", "parallel", "places", "sample", "scenes", "srgb_bytes", "visibility"]
