# SPDX-License-Identifier: GPL-3.0-or-later
"""Float64 origins of georeferenced files.

Blender's matrices and vertices are float32: half a metre at 5e6 m. So positions stay relative to an origin that the
scene and each object remember in a custom property, as float64: world = origin + Blender's coordinates.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import bpy

PROPERTY = "patina_origin"
ZERO = (0.0, 0.0, 0.0)

# An object farther than this from the scene's origin loses more than 1 mm in float32.
FAR = 8192.0

Origin = tuple[float, float, float]


def shared(scene: bpy.types.Scene, origins: Iterable[Sequence[float]]) -> Origin:
    """The scene's origin; a scene without one takes the first file origin that is not zero."""
    known = scene.get(PROPERTY)
    if known is not None:
        return tuple(known)
    first = next((tuple(origin) for origin in origins if any(origin)), ZERO)
    if any(first):
        scene[PROPERTY] = list(first)
    return first


def place(obj: bpy.types.Object, origin: Sequence[float], scene_origin: Sequence[float] | None) -> str:
    """Remembers a file's origin at its object and moves the object to its place in the scene (None: leaves it near
    zero). Returns a warning when the place is too far away for float32."""
    obj[PROPERTY] = [float(value) for value in origin]
    if scene_origin is None:
        return ""
    offset = [a - b for a, b in zip(origin, scene_origin, strict=True)]
    obj.location = offset
    if max(map(abs, offset)) <= FAR:
        return ""
    return (f"'{obj.name}' lies {max(map(abs, offset)) / 1000.0:,.1f} km from the scene's origin, where Blender's "
            "coordinates are coarse: import it with its own origin to see it near zero")
