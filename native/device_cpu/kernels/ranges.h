// SPDX-License-Identifier: GPL-3.0-or-later
// What the kernels of range images share: which depths are one surface. Twin of shaders/lib/ranges.glsl
#ifndef PT_RANGES_H
#define PT_RANGES_H

#include "device_cpu/rows.h"
#include "shared/ranges.h"

// How far behind z a point of the same surface may lie. cells: their view.
static inline vf pt_range_gamma(const struct view_args *cells, float gamma, float gamma_cells, vf z)
{
    return vf_max(vf_set(gamma), vf_set(gamma_cells) * vf_footprint(cells, z));
}

// The greatest step between cells that are joined, from the nearer one's z on.
static inline vf pt_range_step(const struct view_args *cells, float gamma, float gamma_cells, vf z)
{
    return vf_max(pt_range_gamma(cells, gamma, gamma_cells, z), vf_set(PT_RANGE_STEEP) * vf_footprint(cells, z));
}

// Cells that there are: those of the rectangle.
static inline vm pt_range_inside(const struct view_args *cells, vi x, vi y)
{
    const uint32_t *rect = cells->rect;
    return vm_and(vi_lt_unsigned(vi_sub(x, vi_set(rect[0])), vi_set(rect[2] - rect[0])),
                  vi_lt_unsigned(vi_sub(y, vi_set(rect[1])), vi_set(rect[3] - rect[1])));
}

#endif
