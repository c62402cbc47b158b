# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

# What a new scene has.
patina = bpy.context.scene.patina

patina.surface = 'AUTO'
patina.error_target = 0.0
patina.quality = 'REFINED'
patina.fill = 'CLOSED'
patina.fill_iterations = 0
patina.antialias = 'LAYERS'
patina.average = False
patina.samples = 4
patina.noise = 0.0
