// SPDX-License-Identifier: GPL-3.0-or-later
// The grid of one scan: which point lies in each cell, how noisy depths are, and the normals that neighbours in it tell.
#ifndef PT_GRID_H
#define PT_GRID_H

#include "file.h"

enum { PT_GRID_NONE = UINT32_MAX };

struct pt_grid {
    const struct pt_scan *scan; // columns, rows, parallel
    const float *position;      // 3 a point
    double station[3];          // in the same coordinates; of a parallel scan the direction towards it
    uint32_t *points;           // of each cell, column by column; PT_GRID_NONE
    double sigma;               // of a depth: pt_grid_measure_noise
};

uint32_t pt_grid_point(const struct pt_grid *grid, int64_t column, int64_t row); // PT_GRID_NONE outside, too
// From p towards the scanner, of length 1.
void pt_grid_towards(const struct pt_grid *grid, const double p[3], double direction[3]);
int pt_grid_measure_noise(struct pt_grid *grid); // 0 or PATINA_ERROR_MEMORY
// Of a cell with a point, towards the scanner. Where no plane is told, normal stays, or becomes 0.
void pt_grid_normal(const struct pt_grid *grid, int64_t column, int64_t row, float normal[3]);

#endif
