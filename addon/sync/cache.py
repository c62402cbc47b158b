# SPDX-License-Identifier: GPL-3.0-or-later
"""The folder of caches: clouds of linked files, and packed files put down to be read. All in it can be made anew."""

from __future__ import annotations

from pathlib import Path

import bpy


def folder() -> Path:
    """Made where it is not there yet."""
    return Path(bpy.utils.user_resource('DATAFILES', path="patina", create=True))
