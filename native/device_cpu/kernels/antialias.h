// SPDX-License-Identifier: GPL-3.0-or-later
// Laplace on depth as steps. [D 3.5]
//
// k of the four cross neighbours are farther than d_eff (or empty). A pixel is drawn when a point falls anywhere in it, so
// an edge pixel's true coverage is below 1: for a straight edge at 0 degrees (k = 1) it is uniform in 0..1, mean 1/2; at
// 45 degrees the outermost pixels (k = 2) cover t^2/2, mean 1/6. Both are met by coverage = 5/6 - k/3, floored at 1/6 so
// that lone pixels stay visible.
#ifndef PT_ANTIALIAS_H
#define PT_ANTIALIAS_H

#include "device_cpu/vector_math.h"
#include "shared/colors.h"

static const int8_t pt_cross[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};

#define PT_COVERAGE_NONE ((float)(5.0 / 6.0)) // at k = 0
#define PT_COVERAGE_STEP ((float)(1.0 / 3.0))
#define PT_COVERAGE_LEAST ((float)(1.0 / 6.0))

// sum: of the colours of the `count` > 0 neighbours that are farther, empty ones counting as nothing.
static inline void pt_mix_edge(float color[4], const float sum[4], float count, int mesh)
{
    float coverage = mesh ? PT_MESH_COVERAGE : pt_max(PT_COVERAGE_NONE - count * PT_COVERAGE_STEP, PT_COVERAGE_LEAST);
    float share = (1.0f - coverage) * pt_rcp(count);
    for (int k = 0; k < 4; k++)
        color[k] = color[k] * coverage + sum[k] * share;
}

static inline void pt_mix_edges(const vf color[4], const vf sum[4], vf count, vf mixed[4])
{
    vf coverage = vf_max(vf_set(PT_COVERAGE_NONE) - count * vf_set(PT_COVERAGE_STEP), vf_set(PT_COVERAGE_LEAST));
    vf share = (vf_set(1.0f) - coverage) * vf_rcp(count);
    for (int k = 0; k < 4; k++)
        mixed[k] = color[k] * coverage + sum[k] * share;
}

#endif
