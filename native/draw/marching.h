// SPDX-License-Identifier: GPL-3.0-or-later
// Contours of a grid of heights.
#ifndef PT_DRAW_MARCHING_H
#define PT_DRAW_MARCHING_H

#include "lines.h"

struct pt_height_grid {
    uint32_t width, height; // nodes
    double low[2], cell;    // place of the first node; distance of nodes
    const double *values;   // width * height, row by row; NaN: nothing is known there
};

// Adds the lines where the heights are `level` (marching squares, Lorensen and Cline 1987 in two dimensions; a saddle is divided by the mean of
// its four corners). Lines are closed, or end at the border and where heights are not known. The greater heights are on their left.
// 0 or PATINA_ERROR_MEMORY.
int pt_contour_grid(const struct pt_height_grid *grid, double level, uint32_t layer, struct pt_lines *lines);

#endif
