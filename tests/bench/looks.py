# SPDX-License-Identifier: GPL-3.0-or-later
"""Effects that are timed: of benches that draw by the add-on's binding, and of those that hold two trees against each other."""

from typing import Any

# Depth cues and means of drawing, by themselves; the torus lies 3.6 from the camera.
CUES: dict[str, dict[str, Any]] = {
    "eye-dome lighting": {"edl_strength": 1.0}, "ambient obscurance": {"obscurance_strength": 1.0},
    "toon bands": {"toon_bands": 3, "toon_softness": 0.15}, "hatching": {"hatch_levels": 2},
    "fog": {"fog_start": 2.5, "fog_end": 5.0, "fog_density": 1.0}, "depth of field": {"focus_distance": 3.2, "focus_aperture": 0.05},
    "paper": {"paper_color": (0.93, 0.88, 0.78), "paper_grain": 0.15},
}
