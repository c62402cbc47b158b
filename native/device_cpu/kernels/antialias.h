// SPDX-License-Identifier: GPL-3.0-or-later
// Laplace on depth as steps. [D 3.5]
//
// k of the four cross neighbours are farther than d_eff (or empty). A pixel is drawn when a point falls anywhere in it, so
// an edge pixel's true coverage is below 1: for a straight edge at 0 degrees (k = 1) it is uniform in 0..1, mean 1/2; at
// 45 degrees the outermost pixels (k = 2) cover t^2/2, mean 1/6. Both are met by coverage = 5/6 - k/3, floored at 1/6 so
// that lone pixels stay visible.
#ifndef PT_ANTIALIAS_H
#define PT_ANTIALIAS_H

#include "device_cpu/math.h"

static const int8_t pt_cross[4][2] = { { 1, 0 }, { 0, 1 }, { -1, 0 }, { 0, -1 } };

// sum: of the colours of the `count` > 0 neighbours that are farther, empty ones counting as nothing.
static inline void pt_mix_edge(float color[4], const float sum[4], float count)
{
    float coverage = pt_max((float)(5.0 / 6.0) - count * (float)(1.0 / 3.0), (float)(1.0 / 6.0));
    float share = (1.0f - coverage) * pt_rcp(count);
    for (size_t k = 0; k < 4; k++)
        color[k] = color[k] * coverage + sum[k] * share;
}

#endif
