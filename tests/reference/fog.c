// SPDX-License-Identifier: GPL-3.0-or-later
// Fog: from nothing at its start to its density at its end, over premultiplied colours.
#include "reference.h"
#include "tolerances.h"
#include "shared/effects.h"

#include <math.h>

// How much is hidden at this distance, which counts from the eye in perspective, from its plane in orthographic views.
static double hidden(const struct fog_args *args, double away)
{
    return fmin(fmax((away - args->start) * args->inverse, 0.0), 1.0) * args->density;
}

struct ref_color ref_fog(const struct fog_args *args, const struct ref_planes *planes, int x, int y)
{
    size_t pixel = (size_t)y * args->view.width + (size_t)x;
    double away = ref_key_z(planes->keys[pixel]), alpha = planes->color[4 * pixel + 3], off = 0.0;
    if (args->view.perspective) {
        struct ref_ray ray = ref_ray(&args->view, x, y);
        double square = 1.0 + ray.u * ray.u + ray.v * ray.v;
        away *= sqrt(square);
        off = away * (TOL_DISTANCE + (fabs(ray.u) * ray.error_u + fabs(ray.v) * ray.error_v) / square);
    }
    double share = hidden(args, away), unsure = hidden(args, away + off) - hidden(args, away - off);
    struct ref_color out = {0};
    for (int c = 0; c < 3; c++) {
        double own = planes->color[4 * pixel + (size_t)c] * (1.0 - share), veil = args->color[c] * share * alpha;
        out.color[c] = own + veil;
        // of the share: a difference, two products
        out.error[c] = (6.0 * TOL_UNIT + unsure) *
                       (fabs((double)planes->color[4 * pixel + (size_t)c]) + fabs(args->color[c] * alpha));
    }
    out.color[3] = alpha;
    return out;
}
