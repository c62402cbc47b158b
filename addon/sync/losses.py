# SPDX-License-Identifier: GPL-3.0-or-later
"""Notices that tell of something missing in the picture: with `--patina-strict` a frame that has one fails."""

from __future__ import annotations

import math
from collections.abc import Iterable

import bpy

from .. import native, options


class Loss(str):
    """A notice of what a picture was to show and does not."""


class MissingFile(Loss):
    """A linked file that does not exist. object_name: of the object that links it."""

    object_name: str

    def __new__(cls, text: str, object_name: str) -> MissingFile:
        notice = super().__new__(cls, text)
        notice.object_name = object_name
        return notice


def kind(notice: str) -> str:
    """How the report of a render shows a notice. In background a loss stays a warning: an error would end the script that renders,
    and only --patina-strict asks for that."""
    return 'ERROR' if isinstance(notice, Loss) and not bpy.app.background else 'WARNING'


def is_placed(instance: bpy.types.DepsgraphObjectInstance, notices: list[str]) -> bool:
    """Whether an object or instance stands somewhere; one that a driver, say, put at a place that is no number is named."""
    if math.isfinite(sum(map(sum, instance.matrix_world))):
        return True
    notice = Loss(f"'{instance.object.name}' is left out: its location, rotation or scale is not a number")
    if notice not in notices:
        notices.append(notice)
    return False


def check(notices: Iterable[str]) -> None:
    """PatinaError where the command line asks for whole pictures only, and this one lacks something."""
    lost = [notice for notice in notices if isinstance(notice, Loss)]
    if lost and options.read().get("strict"):
        raise native.PatinaError("; ".join(lost))
