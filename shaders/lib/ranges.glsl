// SPDX-License-Identifier: GPL-3.0-or-later
// What the kernels of range images share: which depths are one surface. Twin of native/device_cpu/kernels/ranges.h
#ifndef PT_RANGES_GLSL
#define PT_RANGES_GLSL

#include "shared/ranges.h"
#include "lib/math.glsl"

// How far behind z a point of the same surface may lie. cells: their view.
float pt_range_gamma(view_args cells, float gamma, float gamma_cells, float z)
{
    precise float wide = gamma_cells * pt_footprint(cells, z);
    return pt_max(gamma, wide);
}

// The greatest step between cells that are joined, from the nearer one's z on.
float pt_range_step(view_args cells, float gamma, float gamma_cells, float z)
{
    precise float steep = PT_RANGE_STEEP * pt_footprint(cells, z);
    return pt_max(pt_range_gamma(cells, gamma, gamma_cells, z), steep);
}

// Cells that there are: those of the rectangle.
bool pt_range_inside(view_args cells, int x, int y)
{
    return uint(x) - cells.rect[0] < cells.rect[2] - cells.rect[0] && uint(y) - cells.rect[1] < cells.rect[3] - cells.rect[1];
}

#endif
