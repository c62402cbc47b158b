# SPDX-License-Identifier: GPL-3.0-or-later
"""Patina: image-space rendering of point clouds in Blender. This file registers, nothing else."""

bl_info = {  # for Blender 3.4 to 4.1; later ones read blender_manifest.toml
    "name": "Patina",
    "author": "The Patina authors",
    "version": (1, 0, 0),
    "blender": (3, 4, 0),
    "location": "Render Properties > Render Engine > Patina; File > Import > Point Cloud",
    "description": "Image-space rendering of point clouds",
    "category": "Render",
}

import bpy
from bpy.app.handlers import persistent

try:
    import numpy  # noqa: F401  Blenders of blender.org contain it
except ImportError as error:
    raise ImportError("Patina needs numpy, which this Blender's Python lacks. On Debian and Ubuntu, run 'sudo apt install python3-numpy' and "
                      "restart Blender. Blenders from blender.org contain it.") from error

from . import migrate, operators, preferences, properties, ui, versions
from .draw import drawings, engine, histogram, measures, missing, overlays, render, thinned, viewport
from .properties import answers
from .sync.analyses import estimates
from .sync.objects import images, meshes
from .sync.points import attributes, built, files, node_colors
from .sync.view import pairs

_MODULES = (preferences, properties, files, migrate, pairs, overlays, missing, measures, drawings, thinned, engine, operators, ui)
_UNDO = (bpy.app.handlers.undo_post, bpy.app.handlers.redo_post)


@persistent
def _forget(*_) -> None:
    """Another file: its data may carry the names of the last one's."""
    viewport.close_all()
    histogram.forget()
    built.CACHE.clear()
    meshes.CACHE.clear()
    images.CACHE.clear()
    node_colors.forget()


@persistent
def _undone(*_) -> None:
    viewport.forget_points()


def register() -> None:
    answers.layer_distance, answers.automatic_trust = estimates.layer_distance, histogram.automatic_trust
    answers.missing_data = attributes.missing
    answers.linked_file, answers.link_file = files.shown_text_of, files.assign
    for module in _MODULES:
        module.register()
    bpy.app.handlers.load_pre.append(_forget)
    for handlers in _UNDO:
        handlers.append(_undone)
    versions.tell()


def unregister() -> None:
    bpy.app.handlers.load_pre.remove(_forget)
    for handlers in _UNDO:
        handlers.remove(_undone)
    viewport.close_all()
    histogram.forget()
    for module in reversed(_MODULES):
        module.unregister()
    built.CACHE.clear()
    meshes.CACHE.clear()
    images.CACHE.clear()
    node_colors.forget()
    render.forget_device()
