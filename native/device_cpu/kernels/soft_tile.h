// SPDX-License-Identifier: GPL-3.0-or-later
// A tile of pixels that soft points lie before.
#ifndef PT_SOFT_TILE_H
#define PT_SOFT_TILE_H

#include "soft_bins.h"

enum { PT_SOFT_PIXELS = PT_SOFT_TILE * PT_SOFT_TILE };

struct pt_soft_tile {
    const struct pt_soft_bins *bins;
    int32_t x, y; // of the window
    uint32_t width, height;
    uint32_t thread;
    uint64_t fragments;
    float through[PT_SOFT_PIXELS], color[3][PT_SOFT_PIXELS], density[PT_SOFT_PIXELS];
    float from[PT_SOFT_PIXELS], to[PT_SOFT_PIXELS]; // z; beyond the rectangle there is nothing between
    float front[PT_SOFT_PIXELS], weight[PT_SOFT_PIXELS],
        opacity[PT_SOFT_PIXELS]; // Splats, One Layer: how far a surface goes, sums
};

// No pixel takes any more.
static inline int pt_soft_spent(const struct pt_soft_tile *tile)
{
    vm open = vm_of_bits(0);
    for (uint32_t i = 0; i < PT_SOFT_PIXELS; i += PT_LANES)
        open = vm_or(open, vm_and(vf_le(vf_set(PT_SOFT_SPENT), vf_load(tile->through + i)),
                                  vf_lt(vf_load(tile->from + i), vf_load(tile->to + i))));
    return !vm_bits(open);
}

#endif
