# SPDX-License-Identifier: GPL-3.0-or-later
"""What a place is: a path or an address. Apart from source.py, since Blender's start asks it, and HTTP with its encryption would make
that longer."""

from __future__ import annotations

import os
import urllib.parse


def is_address(place: str) -> bool:
    return place.lower().startswith(("http://", "https://"))


def last_of(place: str) -> str:
    """The name of what a path or an address names, without its folder."""
    return (urllib.parse.urlsplit(place).path if is_address(place) else place.replace(os.sep, "/")).rpartition("/")[2]


def is_ept(place: str) -> bool:
    """Whether it tells of a folder of Entwine point tiles."""
    return last_of(place).lower() == "ept.json"
