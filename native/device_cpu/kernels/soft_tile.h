// SPDX-License-Identifier: GPL-3.0-or-later
// A tile of pixels that soft points lie before. Pixels lie in groups of 4 wide, so that what a disc of a few pixels meets is few
// vectors of them.
#ifndef PT_SOFT_TILE_H
#define PT_SOFT_TILE_H

#include "soft_bins.h"

enum {
    PT_SOFT_PIXELS = PT_SOFT_TILE * PT_SOFT_TILE,
    PT_SOFT_WIDE = 4, // pixels of a group
    PT_SOFT_TALL = PT_LANES > 8 ? 4 : 2,
    PT_SOFT_GROUP = PT_SOFT_WIDE * PT_SOFT_TALL,
    PT_SOFT_ACROSS = PT_SOFT_TILE / PT_SOFT_WIDE, // groups
    PT_SOFT_GROUPS = PT_SOFT_PIXELS / PT_SOFT_GROUP
};

struct pt_soft_tile {
    const struct pt_soft_bins *bins;
    int32_t x, y; // of the window
    uint32_t width, height;
    uint64_t fragments;
    float through[PT_SOFT_PIXELS], color[3][PT_SOFT_PIXELS], density[PT_SOFT_PIXELS];
    float from[PT_SOFT_PIXELS], to[PT_SOFT_PIXELS]; // z; beyond the rectangle there is nothing between
    float front[PT_SOFT_PIXELS], weight[PT_SOFT_PIXELS],
        opacity[PT_SOFT_PIXELS]; // Splats, One Layer: how far a surface goes, sums
};

// Where pixel (x, y) of the tile lies in its arrays.
static inline uint32_t pt_soft_at(uint32_t x, uint32_t y)
{
    return (y / PT_SOFT_TALL * PT_SOFT_ACROSS + x / PT_SOFT_WIDE) * PT_SOFT_GROUP + y % PT_SOFT_TALL * PT_SOFT_WIDE +
           x % PT_SOFT_WIDE;
}

#endif
