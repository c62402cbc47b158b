# SPDX-License-Identifier: GPL-3.0-or-later
"""Polls of operators that report why they cannot run."""

from __future__ import annotations

from bpy.types import Context, Operator

from .. import point_data
from ..draw.engine import PatinaRenderEngine


def has_points(context: Context) -> bool:
    """Whether tools for points are of use: Patina is the engine, or the view layer has a cloud."""
    return context.engine == PatinaRenderEngine.bl_idname or any(map(point_data.is_cloud, context.view_layer.objects))


def allowed(operator: type[Operator], why: str) -> bool:
    """Whether `why` is empty. If not, the tooltip of the disabled operator shows it."""
    if why:
        operator.poll_message_set(why)
    return not why
