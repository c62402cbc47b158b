// SPDX-License-Identifier: GPL-3.0-or-later
#include "cells.h"

#include <math.h>

const char *const cells_kind_names[CELLS_KINDS] = {"surfaces", "noise", "flat", "sparse"};

float *cells_random(struct harness *h, struct rng *rng, const struct view_args *view, enum cells_kind kind)
{
    const size_t count = (size_t)view->width * view->height;
    float *places = harness_alloc(h, count * 16);
    for (size_t i = 0; i < count; i++) {
        const double x = (double)(i % view->width) / view->width, y = (double)(i / view->width) / view->height;
        const int near = hypot(x - 0.5, y - 0.5) < 0.3,
                  empty = kind == CELLS_SPARSE ? rng_below(rng, 4) > 0 : !rng_below(rng, 12);
        const double wall = near ? 3.0 + 0.4 * x : 5.0 + 1.5 * y;
        float *place = places + 4 * i;
        place[0] = empty ? NAN : (float)rng_unit(rng);
        place[1] = empty ? NAN : (float)rng_unit(rng);
        place[2] = empty                 ? NAN
                   : kind == CELLS_NOISE ? (float)rng_range(rng, 4.0, 6.0)
                   : kind == CELLS_FLAT  ? 5.0f
                                         : (float)(wall + rng_range(rng, -1e-2, 1e-2));
        place[3] = empty ? 0.0f : (float)rng_range(rng, 1.0, 9.0);
    }
    return places;
}
