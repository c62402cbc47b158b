# SPDX-License-Identifier: GPL-3.0-or-later
"""What properties need to know from modules above them, which they do not import. The add-on's registration sets these functions."""

from __future__ import annotations

from collections.abc import Callable

import bpy

# Full name of an object → the layer distance that the last image took for it, in its units; None if the image did not show it.
layer_distance: Callable[[str], float | None] = lambda name: None
# Name of an object → the least trust that the last image took for it.
automatic_trust: Callable[[str], float] = lambda name: 0.0
# Scene → what none of its clouds has and a style may need, such as "classes"; by the names in styles.Entry.needs.
missing_data: Callable[[bpy.types.Scene], frozenset[str]] = lambda scene: frozenset()
# Object → the file that it links, as Blender shows it; "" without one.
linked_file: Callable[[bpy.types.Object], str] = lambda obj: ""
# Links a file, by its path, to an object; "" removes the link.
link_file: Callable[[bpy.types.Object, str], None] = lambda obj, path: None
