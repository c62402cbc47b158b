// SPDX-License-Identifier: GPL-3.0-or-later
// A surface of the ground, found from coarse to fine grids. Each level knows points by their height above the coarser surface, so that
// slopes are level there.
#ifndef PT_RELIEF_H
#define PT_RELIEF_H

#include <stdint.h>

struct pt_pool;
struct patina_progress;

// Heights at the centers of cells, linear between and beyond them. Coordinates begin at the grid's low corner.
struct pt_relief {
    double cell;
    int64_t width, height; // cells
    float *z;              // row by row
};

// The lowest point of a cell. z NaN: none.
struct pt_lowest {
    float x, y, z;
};

static inline double pt_relief_at(const struct pt_relief *relief, double x, double y)
{
    const double u = x / relief->cell - 0.5, v = y / relief->cell - 0.5;
    int64_t i = u > 0 ? (int64_t)u : 0, j = v > 0 ? (int64_t)v : 0;
    i = i > relief->width - 2 ? relief->width - 2 : i;
    j = j > relief->height - 2 ? relief->height - 2 : j;
    const int64_t right = relief->width > 1, up = relief->height > 1;
    i = i < 0 ? 0 : i;
    j = j < 0 ? 0 : j;
    const float *at = relief->z + j * relief->width + i;
    const double a = right ? u - (double)i : 0, b = up ? v - (double)j : 0;
    const double below = (double)at[0] + a * ((double)at[right] - (double)at[0]);
    const float *above = at + up * relief->width;
    return below + b * ((double)above[0] + a * ((double)above[right] - (double)above[0]) - below);
}

// The ground that the lowest points of cells (shape: without z) tell, on cells twice as wide as theirs. largest: width of objects that the
// coarsest cells reach over; threshold: height of what may be ground beside a plane. Strays were left out. *out: z is to be freed.
// PATINA_ERROR_MEMORY or PATINA_ERROR_CANCELLED without a message.
int pt_relief_find(const struct pt_lowest *lowest, const struct pt_relief *shape, double largest, double threshold,
                   struct pt_pool *pool, struct patina_progress *progress, double begin, double end, struct pt_relief *out);

// One level: accepts residuals (heights above the coarser surface, of each cell; NaN: no point) that may be ground, and replaces all others
// by NaN.
int pt_relief_accept(float *residual, const struct pt_relief *shape, double threshold, const struct patina_progress *progress);
// Replaces NaN by a membrane between the others; zeros where there are none.
int pt_relief_fill(float *values, int64_t width, int64_t height, const struct patina_progress *progress);

#endif
