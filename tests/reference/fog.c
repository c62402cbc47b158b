// SPDX-License-Identifier: GPL-3.0-or-later
// Depth fog: from nothing at its start to its density at its end, over premultiplied colours.
#include "reference.h"
#include "tolerances.h"

#include <math.h>

struct ref_color ref_fog(const struct fog_args *args, const struct ref_planes *planes, int x, int y)
{
    size_t pixel = (size_t)y * args->view.width + (size_t)x;
    double z = ref_key_z(planes->keys[pixel]), alpha = planes->color[4 * pixel + 3];
    double share = fmin(fmax((z - args->start) * args->inverse, 0.0), 1.0) * args->density;
    struct ref_color out = {0};
    for (int c = 0; c < 3; c++) {
        double own = planes->color[4 * pixel + (size_t)c] * (1.0 - share), veil = args->color[c] * share * alpha;
        out.color[c] = own + veil;
        // of the share: a difference, two products
        out.error[c] = 6.0 * TOL_UNIT *
                       (fabs((double)planes->color[4 * pixel + (size_t)c]) + fabs(args->color[c] * alpha));
    }
    out.color[3] = alpha;
    return out;
}
