# SPDX-License-Identifier: GPL-3.0-or-later
"""Polls of operators that report why they cannot run."""

from __future__ import annotations

from bpy.types import Operator


def allowed(operator: type[Operator], why: str) -> bool:
    """Whether `why` is empty. If not, the tooltip of the disabled operator shows it."""
    if why:
        operator.poll_message_set(why)
    return not why
