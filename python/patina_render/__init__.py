# SPDX-License-Identifier: GPL-3.0-or-later
"""Patina renders point clouds as closed surfaces: numpy arrays in, numpy arrays out.

    import patina_render as patina

    cloud = patina.Cloud.read("statue.ply")          # or patina.Cloud(positions, colors)
    cloud.analyze()
    scene = patina.Scene()
    scene.add(cloud)
    scene.frame(azimuth=30, elevation=20)            # degrees
    result = patina.render(scene, 1280, 720)
    result.image                                     # (720, 1280, 4) float32
    patina.write_png("statue.png", result.image)

Conventions: positions are in world units of your choice, z is up, angles are in degrees. Colors of images are linear and premultiplied.
Row 0 of an image is its top row. What the library refuses raises `Error` with the library's message; arrays of a wrong shape or type raise
`ValueError`. Calls release the GIL. Do not change a cloud or a
scene while another thread renders it.
"""

from ._native import PatinaError as Error
from ._native import library as _library
from .clouds import KINDS, Cloud
from .images import to_srgb, write_png
from .renders import Render, Renderer, render
from .scenes import Scene

__all__ = ["KINDS", "Cloud", "Error", "Render", "Renderer", "Scene", "render", "to_srgb", "version", "write_png"]


def version() -> str:
    """MAJOR.MINOR.PATCH+CHECKSUM of the library. Equal checksums mean equal images."""
    return _library().patina_version().decode()
