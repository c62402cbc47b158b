// SPDX-License-Identifier: GPL-3.0-or-later
// Shadow textures, a part of patina.h, which includes it. Its conventions and thread rules hold here too.
#ifndef PATINA_SHADOWS_H
#define PATINA_SHADOWS_H

#ifndef PATINA_H
#error "include patina/patina.h"
#endif

#ifdef __cplusplus
extern "C" {
#endif

// ---- shadow textures -------------------------------------------------------------------------------------------------

// The frame keeps them while points, casters, lights' places and sizes, samples and resolution stay. Lights' power and color, and lights
// and clouds that move together, change nothing. `light` counts the lights that cast.

// Computes the whole textures of every casting light without a picture (shadow_lazy and shadow_progressive do not count).
// Blocks; patina_frame_cancel stops it. PATINA_ERROR_EMPTY when no light casts.
PATINA_API int patina_frame_bake_shadows(patina_frame *frame, const patina_scene *scene);
// Copies the share of a light that arrives at each point, 0..1, in file order: count floats, size in bytes must fit exactly.
// After a lazy render only the points that the picture showed say something; the others are 1. Gone with the cloud.
PATINA_API int patina_frame_read_shadows(const patina_frame *frame, uint32_t instance, uint32_t light, float *values,
                                         size_t size);
// Writes the frame's whole textures to a file, 1, 2 or 4 bytes a point and light, with what they depend on and a checksum.
PATINA_API int patina_frame_save_shadows(const patina_frame *frame, const char *path);
// Takes textures from such a file instead of computing them. PATINA_ERROR_FORMAT, and the frame as it was, if the file is damaged, of
// another version, for other points, or stale: the message says which, and of which light or cloud.
PATINA_API int patina_frame_load_shadows(patina_frame *frame, const patina_scene *scene, const char *path);

#ifdef __cplusplus
}
#endif
#endif
