# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the thumbnails of the shipped styles into addon/presets/styles: build/styles --thumbnails."""

import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(__file__))

from check_styles import shipped, stage  # noqa: E402
from patina.draw import thumbnails  # noqa: E402
from patina.styles import styles  # noqa: E402

for key in shipped():
    _, obj = stage()
    bpy.ops.patina.apply_style(style=key)
    pixels = thumbnails.of_sample(bpy.context.evaluated_depsgraph_get(), obj)
    thumbnails.save(pixels, styles.SHIPPED / f"{key}.png")
    print(f"{key}.png", flush=True)
