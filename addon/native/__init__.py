# SPDX-License-Identifier: GPL-3.0-or-later
"""The library's handles as Python's objects. This folder alone knows ctypes.

Every call that fails raises `PatinaError` with the library's own sentence. Calls release the GIL. A handle may be used
from any thread, one call at a time; `Frame.cancel`, `Frame.progress`, `Progress.cancel` and `Progress.value` at any time.
What `start` in a name begins is a `Task`, which runs without Python.
"""

from __future__ import annotations

from . import abi, points
from .abi import MAX_LAYERS as MOST_LAYERS
from .abi import MAX_RAMP as MOST_RAMP
from .abi import PASSES as PLANES
from .arrays import nearest_depths, ramp, start_fingerprint, start_grid_normals
from .clouds import KINDS, WRAPS, Cloud, Mesh, Texture
from .files import File, FileScan
from .frames import Frame, Panorama, Scene
from .handles import Device, Progress, Task, losses
from .loader import (
    CANCELLED,
    FILE,
    FORMAT,
    INTERNAL,
    MEMORY,
    NEIGHBOURHOODS,
    TOO_LARGE,
    TOO_MANY_POINTS,
    PatinaCancelled,
    PatinaError,
    forget_library,
    library,
    library_path,
    log_lines,
    split_plane,
)

__all__ = ["CANCELLED", "abi", "FILE", "FORMAT", "INTERNAL", "KINDS", "MEMORY", "MOST_LAYERS", "MOST_RAMP", "NEIGHBOURHOODS", "PLANES", "Cloud", "Device", "File", "FileScan",
           "Frame", "Mesh", "Panorama", "PatinaCancelled", "PatinaError", "Progress", "Scene", "TOO_LARGE", "TOO_MANY_POINTS", "Task", "Texture", "WRAPS",
           "forget_library", "library", "library_path", "log_lines", "losses", "nearest_depths", "points", "ramp", "split_plane", "start_fingerprint", "start_grid_normals"]
