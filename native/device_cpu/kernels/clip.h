// SPDX-License-Identifier: GPL-3.0-or-later
// Where points lie to a clip; twin of shaders/lib/clip.glsl
#ifndef PT_CLIP_ROW_H
#define PT_CLIP_ROW_H

#include "device_cpu/vector_math.h"
#include "shared/clips.h"

// Row k of (lo + R p) + hi.
static inline vf pt_clip_row(const struct clip_view *clip, int k, const vf p[3])
{
    const float *row = clip->row + 3 * k;
    vf sum = ((vf_set(clip->lo[k]) + vf_set(row[0]) * p[0]) + vf_set(row[1]) * p[1]) + vf_set(row[2]) * p[2];
    return sum + vf_set(clip->hi[k]);
}

#endif
