// SPDX-License-Identifier: GPL-3.0-or-later
// Premultiplied colour over the background.
#ifndef PT_COMPOSE_H
#define PT_COMPOSE_H

#include "device_cpu/vector_math.h"

static inline void pt_compose(const vf color[4], const vf background[4], vm some, vf out[4])
{
    vf through = vf_set(1.0f) - color[3];
    for (int k = 0; k < 4; k++)
        out[k] = vf_select(some, color[k] + through * background[k], background[k]);
}

#endif
