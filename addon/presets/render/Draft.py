# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

# What a quick look needs: filling as in the paper, one sample.
patina = bpy.context.scene.patina

patina.surface = 'AUTO'
patina.error_target = 0.0
patina.quality = 'PAPER'
patina.fill = 'PAPER'
patina.fill_iterations = 0
patina.antialias = 'BACKGROUND'
patina.average = False
patina.samples = 1
patina.noise = 0.0
