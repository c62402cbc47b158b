# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

# Nothing is filled in: for judging a scan.
patina = bpy.context.scene.patina

patina.surface = 'FILL'
patina.error_target = 0.0
patina.quality = 'REFINED'
patina.fill = 'OFF'
patina.fill_iterations = 0
patina.antialias = 'OFF'
patina.average = False
patina.samples = 1
patina.noise = 0.0
