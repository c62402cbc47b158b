# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

# The cheapest way to a colour error of two percent.
patina = bpy.context.scene.patina

patina.surface = 'FILL'
patina.error_target = 2.0
patina.quality = 'REFINED'
patina.fill = 'CLOSED'
patina.fill_iterations = 0
patina.antialias = 'LAYERS'
patina.average = False
patina.samples = 1
patina.noise = 0.0
