// SPDX-License-Identifier: GPL-3.0-or-later
// Effects on the colour plane: runs a kernel on a picture and compares every pixel with the reference.
#ifndef PT_EFFECT_H
#define PT_EFFECT_H

#include "harness.h"

typedef struct ref_color effect_reference(const void *args, const struct ref_planes *planes, int x, int y);

struct effect {
    enum pt_kernel kernel;
    effect_reference *reference;
    const char *
        buffers; // in the kernel's order: k keys, f sources, d d_eff, n normals shown, a albedo, s slopes, c the colours that change
};

// albedo may be NULL, and slopes, which others than effect_check_slopes have none of. Colours of empty pixels are NaN before and must stay so.
void effect_check(struct harness *h, const struct effect *effect, const void *args, size_t size, const struct picture *picture,
                  const float *albedo);
void effect_check_slopes(struct harness *h, const struct effect *effect, const void *args, size_t size,
                         const struct picture *picture, const float *slopes);
// A picture of this kind with filled pixels and, with `translucent`, opacities.
struct picture effect_picture(struct harness *h, uint64_t seed, uint32_t width, uint32_t height, int perspective,
                              enum picture_kind kind, int translucent);

#endif
