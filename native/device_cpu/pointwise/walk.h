// SPDX-License-Identifier: GPL-3.0-or-later
// Pointwise kernels over rows: by themselves (walk.c), or as steps of the fused tail (fused/tail.c).
#ifndef PT_WALK_H
#define PT_WALK_H

#include "device_cpu/cpu.h"

// A row of pixels that a kernel changes, from column `first` on to `end`, which may lie in the middle of a vector.
struct pt_walk_row {
    const void *args;
    const void *clips;
    uint32_t y, first, end;
    const uint64_t *keys;          // at column 0. Of pictures that have none NULL: all pixels hold something
    const float *z;                // at column 0; NULL: the keys' own. Beyond the row's end +inf, as far as a vector goes
    const float *slopes;           // float4, at column 0; NULL: the body does without
    const float *shading, *albedo; // float4, at column 0; or, where these are NULL:
    const float *normal_rows[3], *albedo_rows[3];
    const float *from;    // float4: the colours that are read; NULL: color
    float *color;         // float4, at column 0; NULL:
    float *color_rows[4]; // the last one NULL: all is opaque
};

// keys ... result: which of its buffers these are, -1: none. A result is a picture of the crop; without one colours are changed in
// place, and those without keys are the crop's. step: NULL: the kernel is not pointwise.
struct pt_pointwise {
    int keys, shading, albedo, slopes, clips, color, result;
    void (*step)(const struct pt_walk_row *row);
};

// The slopes that a pass binds, from a pixel on; NULL: none.
static inline const float *pt_walk_slopes(const struct pt_cpu_call *call, int which, size_t at)
{
    const float *slopes = which >= 0 ? pt_cpu_data(call, (uint32_t)which) : NULL;
    return slopes ? slopes + 4 * at : NULL;
}

// By kernel.
#define PT_POINTWISE_KERNELS PT_CONCAT(pt_pointwise_, PT_ISA)
extern const struct pt_pointwise PT_POINTWISE_KERNELS[PT_KERNEL_COUNT];

#endif
