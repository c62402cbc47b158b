# SPDX-License-Identifier: GPL-3.0-or-later
"""Where files go in the scene: float64 origins of georeferenced ones, units, and the axis that is up.

Blender's matrices and vertices are float32: half a metre at 5e6 m. So positions stay relative to an origin that each object
remembers in a custom property, as float64, in the file's own units and axes: file = origin + the object's own coordinates.
Objects that lie together share a place of the world that is Blender's zero, and remember it too:
world = shared origin + Blender's coordinates = axes (origin + the object's own coordinates), in metres.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Matrix

PROPERTY = "patina_origin"  # of an object: its file's; of a scene: the first shared one that is not zero
SHARED = "patina_shared_origin"  # of an object that was placed by one
AXES = "patina_axes"  # of an object: 9 numbers, row-major, where a file's units and axes are not Blender's
ZERO = (0.0, 0.0, 0.0)

# An object farther than this from the scene's origin loses more than 1 mm in float32.
FAR = 8192.0

# Files nearer to each other, in metres, are of one survey and keep their places to each other; a file that begins at zero has
# coordinates of its own where the others are FAR. What has nothing in common lies near zero each, whatever came first.
TOGETHER = 100_000.0

UNITS = {'METERS': 1.0, 'CENTIMETERS': 0.01, 'MILLIMETERS': 0.001, 'FEET': 0.3048, 'US_FEET': 1200.0 / 3937.0, 'INCHES': 0.0254}
_TURNS = {'Z': Matrix.Identity(3), 'Y': Matrix.Rotation(math.pi / 2, 3, 'X'), 'NEGATIVE_Y': Matrix.Rotation(-math.pi / 2, 3, 'X')}

Origin = tuple[float, float, float]


def axes(up: str, across: float, height: float) -> np.ndarray:
    """(3, 3), a file's coordinates → Blender's. up: which of its axes is; metres of its units of x and y, and of z."""
    turn = np.rint(np.array(_TURNS[up], np.float64))
    return turn @ np.diag((across, across, height if up == 'Z' else across))


def shared(scene: bpy.types.Scene, origin: Sequence[float], turn: np.ndarray | None = None) -> Origin:
    """The shared origin, in metres, of a file that comes into the scene: of those that it lies near, else its own. The scene's
    is forgotten with the last object that it placed."""
    place = _moved(origin, turn)
    known = _known(scene)
    if not known and PROPERTY in scene:
        del scene[PROPERTY]
    found = next((other for other in known if _together(other, place)), place)
    if any(found) and PROPERTY not in scene:
        scene[PROPERTY] = list(found)
    return found


def apart(scene: bpy.types.Scene, found: Sequence[float]) -> float:
    """Kilometres from a new shared origin to the nearest in the scene; 0 where there is none, or it is not new."""
    known = _known(scene)
    return 0.0 if tuple(found) in known else min((math.dist(other, found) for other in known), default=0.0) / 1000.0


def place(obj: bpy.types.Object, origin: Sequence[float], shared_origin: Sequence[float] | None,
          turn: np.ndarray | None = None) -> str:
    """Remembers a file's origin at its object and moves the object to its place in the scene (None: leaves it near
    zero). Returns a warning when the place is too far away for float32."""
    obj[PROPERTY] = [float(value) for value in origin]
    matrix = Matrix.Identity(4) if turn is None else Matrix(turn.tolist()).to_4x4()
    if turn is not None:
        obj[AXES] = [float(value) for value in turn.ravel()]
    offset = ZERO
    if shared_origin is not None:
        obj[SHARED] = [float(value) for value in shared_origin]
        offset = [a - b for a, b in zip(_moved(origin, turn), shared_origin, strict=True)]
    obj.matrix_world = Matrix.Translation(offset) @ matrix
    if max(map(abs, offset)) <= FAR:
        return ""
    return (f"'{obj.name}' lies {max(map(abs, offset)) / 1000.0:,.1f} km from the scene's origin, where Blender's "
            "coordinates are coarse: import it with its own origin to see it near zero")


def axes_of(obj: bpy.types.Object) -> np.ndarray:
    """(3, 3), the coordinates of the file that an object came from → Blender's."""
    return np.array(obj[AXES], np.float64).reshape(3, 3) if AXES in obj else np.eye(3)


def shared_of(obj: bpy.types.Object, scene: bpy.types.Scene) -> np.ndarray:
    """(3,) the place of the world, in metres, that Blender's zero is to an object."""
    return np.array(obj.get(SHARED, scene.get(PROPERTY, ZERO)), np.float64)


def to_file(obj: bpy.types.Object, scene: bpy.types.Scene) -> tuple[np.ndarray, np.ndarray]:
    """(3, 3) and (3,): an evaluated object's coordinates → those of the file that it came from, or of the world."""
    shared = shared_of(obj.original, scene)
    inverse = np.linalg.inv(axes_of(obj.original))
    own = np.array(obj.original.get(PROPERTY, inverse @ shared), np.float64)
    matrix = np.array(obj.matrix_world, np.float64)
    turn, place = inverse @ matrix[:3, :3], matrix[:3, 3]
    # an object that still lies where its import put it goes back to its file's coordinates to the last bit
    home = axes_of(obj.original) @ own - shared
    at_place = np.allclose(place, home, rtol=0, atol=1e-3 + 1e-6 * np.abs(home).max())
    if at_place and np.allclose(turn, np.eye(3), rtol=0, atol=1e-6):
        turn = np.eye(3)
    together = any(shared) or SHARED in obj.original
    return turn, own if at_place else inverse @ (shared + place) if together else own + inverse @ place


def zero_of(scene: bpy.types.Scene) -> np.ndarray:
    """(3,) the place of the world, in metres, that Blender's zero is to most objects of the scene."""
    return np.array(next(iter(_known(scene)), scene.get(PROPERTY, ZERO)), np.float64)


def _moved(origin: Sequence[float], turn: np.ndarray | None) -> Origin:
    return tuple(float(value) for value in (origin if turn is None else turn @ np.array(origin, np.float64)))


def _together(one: Origin, other: Origin) -> bool:
    return math.dist(one, other) <= (TOGETHER if any(one) and any(other) else FAR)


def _known(scene: bpy.types.Scene) -> list[Origin]:
    """Shared origins of the objects in the scene, the most used first."""
    found: dict[Origin, int] = {}
    for obj in scene.objects:
        if PROPERTY in obj:
            value = obj.get(SHARED, scene.get(PROPERTY))  # before the first one was remembered by objects
            if value is not None:
                found[tuple(value)] = found.get(tuple(value), 0) + 1
    return sorted(found, key=lambda value: -found[value])
