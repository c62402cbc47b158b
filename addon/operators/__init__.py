# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators and their places in menus."""

from __future__ import annotations

from . import import_ply


def register() -> None:
    import_ply.register()


def unregister() -> None:
    import_ply.unregister()
