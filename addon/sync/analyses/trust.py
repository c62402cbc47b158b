# SPDX-License-Identifier: GPL-3.0-or-later
"""Trust: which points of a cloud are left out, how many, and what to tell the artist.

The library knows 16 levels of trust. A least trust is given as patina_cloud_style has it: 0 is the cloud's own default, below 0 all points
are drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import bpy
import numpy as np

from ... import native
from ...description.points import CloudItem
from ...native.abi import TRUST_DEFAULT
from ..points import linked
from ..points.taking import of_object
from . import analysis

LEVELS = 16
DEFAULT = TRUST_DEFAULT
least_of = analysis.least_trust  # of an object's properties
_SLACK = 1e-4  # levels are float32 in the library


def of_level(level: int) -> float:
    """The trust that a level stands for."""
    return 1.0 - ((LEVELS - 1 - level) / (LEVELS - 1)) ** 2


def level_from(cloud: native.Cloud, least: float) -> int:
    """The first level that is drawn, were there points of it."""
    wanted = cloud.trust_default if least == 0.0 else least
    return next((level for level in range(LEVELS) if of_level(level) >= wanted - _SLACK), LEVELS - 1)


def left_out(cloud: native.Cloud, least: float) -> int:
    """How many points are not drawn. 0 where none is trusted: then all are drawn."""
    if not cloud.has_shapes:
        return 0
    below = sum(cloud.trusts[:level_from(cloud, least)])
    return below if below < sum(cloud.trusts) else 0


def none_is_trusted(cloud: native.Cloud, least: float) -> bool:
    return bool(cloud.has_shapes and 0 < sum(cloud.trusts) == sum(cloud.trusts[:level_from(cloud, least)]))


def untrusted(cloud: native.Cloud, least: float) -> np.ndarray:
    """(count,) bool, in the caller's order: the points that are left out. With `least` below 0 those that the default leaves out."""
    least = max(least, 0.0)
    if not left_out(cloud, least):
        return np.zeros(cloud.count, bool)
    found = cloud.neighbourhoods("trust", "kind")
    known = (found["kind"] > 0) | (found["trust"] > 0.0)  # others have no place, or are alone
    return known & (found["trust"] < of_level(level_from(cloud, least)) - _SLACK)


def notices(items: Iterable[CloudItem]) -> list[str]:
    """What an artist should know of the clouds of a picture, once each."""
    found = []
    for item in items:
        if none_is_trusted(item.cloud, item.style.least_trust):
            found.append(f"'{item.name}': no point is trusted, so all of them are drawn. They may be strays alone. "
                         "Set Points > Trust to 0 if they are not")
        if item.cloud.renewed:
            found.append(f"'{item.name}': {item.cloud.renewed}")
    return list(dict.fromkeys(found))


def analyzed_cloud(obj: bpy.types.Object, scene: bpy.types.Scene, poll: Callable[[str, float], bool] = lambda what, share: False
                   ) -> native.Cloud:
    """The cloud of an object's own points, before modifiers, or of its linked file: the one that pictures have, or a new one. Analyzes
    it if nobody did. PatinaError where that cannot be."""
    if obj.patina.analysis == 'OFF':
        raise native.PatinaError("Points > Analysis is Off, so the trust of its points is not known")
    said: list[str] = []
    link = linked.source_of(obj, scene.frame_current, said, True) if obj.patina.linked_file else None
    if obj.patina.linked_file and link is None:
        raise native.PatinaError(said[0] if said else "the file is missing")
    if link and link.streamed:
        raise native.PatinaError("its points are read as needed, without an analysis. Set Points > Read to Whole")
    cloud = of_object(obj, scene.patina.surface, link, poll, said)
    if cloud is None:
        raise native.PatinaError(said[0] if said else "it has no points")
    if not cloud.has_shapes and cloud.drawn:
        raise native.PatinaError("its points are not analyzed. Set Points > Analysis to Always, or analyze the saved cloud: "
                                 "patina analyse IN.cloud -o OUT.cloud")
    return cloud
