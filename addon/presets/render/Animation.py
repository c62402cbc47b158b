# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

# As Final, and means of the points: a turning sphere flickers by 0.1 to 0.5 levels of 255 inside, 1.6 to 1.9 at edges.
patina = bpy.context.scene.patina

patina.surface = 'AUTO'
patina.error_target = 0.0
patina.quality = 'REFINED'
patina.fill = 'CLOSED'
patina.fill_iterations = 0
patina.antialias = 'LAYERS'
patina.average = True
patina.samples = 16
patina.noise = 0.0
