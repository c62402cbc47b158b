// SPDX-License-Identifier: GPL-3.0-or-later
// Eye-dome lighting: darker by how far a pixel lies behind those around it, in log depth, or in depth where the view is
// orthographic.
#include "reference.h"
#include "tolerances.h"
#include "shared/effects.h"

#include <math.h>

// log2 z with the error that float32 may have; z itself where the view is orthographic.
static double depth_of(const struct view_args *view, double z, double *error)
{
    *error = view->perspective ? TOL_LOG + TOL_UNIT * fabs(log2(z)) : 0.0;
    return view->perspective ? log2(z) : z;
}

struct ref_color ref_edl(const struct edl_args *args, const struct ref_planes *planes, int x, int y)
{
    const struct view_args *view = &args->view;
    size_t pixel = (size_t)y * view->width + (size_t)x;
    struct ref_color out = {0};
    double own_error, own = depth_of(view, ref_key_z(planes->keys[pixel]), &own_error), sum = 0.0, error = 0.0;
    for (int i = 0; i < PT_EDL_NEIGHBOURS; i++) {
        int qx = x + args->offsets[2 * i], qy = y + args->offsets[2 * i + 1];
        if (qx < 0 || qy < 0 || qx >= (int)view->width || qy >= (int)view->height)
            continue;
        uint64_t key = planes->keys[(size_t)qy * view->width + (size_t)qx];
        if (key == REF_EMPTY_KEY) {
            sum += (double)PT_EDL_STEP;
            continue;
        }
        double near_error, near = depth_of(view, ref_key_z(key), &near_error), behind = args->scale * (own - near);
        double most = args->scale * (own_error + near_error) + 2.0 * TOL_UNIT * fabs(behind);
        if (behind - most < (double)PT_EDL_STEP && behind + most > 0.0)
            error += most;
        sum += fmin(fmax(behind, 0.0), (double)PT_EDL_STEP);
    }
    double dark = args->gain * sum, light = exp2(-dark);
    // a step off by e takes ln 2 gain e of the light; eight sums, product and power round
    error = log(2.0) * (args->gain * error + 10.0 * TOL_UNIT * dark) + TOL_POWER;
    for (int c = 0; c < 4; c++) {
        out.color[c] = planes->color[4 * pixel + (size_t)c] * (c < 3 ? light : 1.0);
        out.error[c] = c < 3 ? (error + TOL_UNIT) * 1.01 * fabs(out.color[c]) : 0.0;
    }
    return out;
}
