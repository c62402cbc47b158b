// SPDX-License-Identifier: GPL-3.0-or-later
// SPEC 6: the least finite limit of the pixels that a cell has a part of.
#include "reference.h"
#include "tolerances.h"
#include "shared/ranges.h"

#include <math.h>

// slack: pixels by which the cell is taken wider.
static float least(const struct coarsen_args *args, const float *limit, int x, int y, double slack)
{
    const int at[2] = {args->view.origin_x + x, args->view.origin_y + y}, origin[2] = {args->origin_x, args->origin_y};
    const uint32_t size[2] = {args->width, args->height};
    int first[2], last[2];
    float out = INFINITY;
    for (int k = 0; k < 2; k++) {
        const double low = at[k] * (double)args->pixel, high = (at[k] + 1) * (double)args->pixel;
        first[k] = (int)fmax(floor(low - slack) - origin[k], 0.0);
        last[k] = (int)fmin(ceil(high + slack) - origin[k], size[k]);
    }
    for (int py = first[1]; py < last[1]; py++)
        for (int px = first[0]; px < last[0]; px++)
            out = fminf(out, limit[(size_t)py * args->width + (size_t)px]);
    return out;
}

struct ref_range ref_coarsen(const struct coarsen_args *args, const float *limit, int x, int y)
{
    const double far = fabs((double)args->view.origin_x + x) + fabs((double)args->view.origin_y + y) + 2.0;
    const double slack = 2.0 * TOL_UNIT * far * (double)args->pixel;
    return (struct ref_range){(double)least(args, limit, x, y, slack), (double)least(args, limit, x, y, -slack)};
}
