# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties of an object → how its points and faces are drawn."""

from __future__ import annotations

import bpy
from mathutils import Matrix

from ...description.meshes import MeshStyle
from ...description.points import CloudStyle
from ...properties import enum_number
from ..analyses import analysis
from ..objects import images, materials
from ..view.camera import row_major
from . import colors, ranges


def style_of(obj: bpy.types.Object, matrix: Matrix) -> CloudStyle:
    patina = obj.patina
    return CloudStyle(
        world_from_object=row_major(matrix),
        lighting=enum_number(patina, "lighting"),
        cull_back=int(patina.cull_back),
        d_min=patina.d_min,
        color=materials.color(obj),
        ambient=patina.ambient,
        diffuse=patina.diffuse,
        specular=patina.specular,
        shininess=patina.shininess,
        transparency=1.0 - patina.opacity,
        shadow_off=_shadow_off(obj),
        radius=patina.radius,
        largest_gap=patina.largest_gap,
        free_space=enum_number(patina, "free_space"),
        least_trust=analysis.least_trust(patina),
        **ranges.style_fields(obj), **colors.style_fields(obj))


def mesh_style(obj: bpy.types.Object, matrix: Matrix, surface: images.Surface) -> MeshStyle:
    use = surface.use
    return MeshStyle(world_from_object=row_major(matrix), color=surface.color[:3],
                            shadow_off=_shadow_off(obj) & 3, unlit=int(surface.unlit), alpha=use.alpha if use else images.NONE,
                            alpha_least=use.alpha_least if use else 0.0)


def _shadow_off(obj: bpy.types.Object) -> int:
    """patina_shadow_off; Blender's own ray visibility counts too."""
    patina = obj.patina
    casts = patina.cast_shadows and obj.visible_shadow
    return (not casts) * 1 + (not patina.receive_shadows) * 2 + (not patina.self_shadows) * 4
