// SPDX-License-Identifier: GPL-3.0-or-later
// Random scenes of small clouds, meshes and lights: every option of the header, within what it allows.
#ifndef PT_RANDOM_SCENES_H
#define PT_RANDOM_SCENES_H

#include "patina/patina.h"

enum {
    RANDOM_WIDTH = 64, // of the widest image
    RANDOM_HEIGHT = 48,
    RANDOM_FLOATS = RANDOM_WIDTH * RANDOM_HEIGHT * (32 + 4 * PATINA_MAX_LAYERS), // that random_read fills at most
    RANDOM_KEYS = RANDOM_WIDTH * RANDOM_HEIGHT,
};

void random_scenes_begin(void); // makes the clouds and meshes that all scenes share
void random_scenes_end(void);

// The scene of that seed. The caller destroys it.
patina_scene *random_scene(uint32_t seed);

// Every pass and layer that there is, behind one another; those that are not stay as they were. keys: of the image's pixels.
void random_read(const patina_frame *frame, float *pixels, uint64_t *keys);

#endif
