// SPDX-License-Identifier: GPL-3.0-or-later
// The plane that fits values around a pixel best: weighted least squares, with a ridge.
#include "reference.h"
#include "tolerances.h"
#include "shared/effects.h"

#include <math.h>
#include <stdlib.h>

// Of the window: two spacings across the view, in pixels.
static int radius_at(const struct slope_args *args, const struct ref_planes *planes, int x, int y, double z, double limit,
                     int *unsure)
{
    const uint32_t source = planes->from[(size_t)y * args->view.width + (size_t)x] & ~PT_FROM_MIXED;
    const struct ref_vec viewer = ref_viewer(&args->view, ref_ray(&args->view, x, y));
    const double cosine = fabs(ref_dot(ref_vec_of(planes->normal + 4 * (size_t)source), viewer));
    const double wide = limit * fmax(cosine, (double)PT_SLOPE_GRAZING) / ref_footprint(&args->view, z);
    const double least = (double)PT_SLOPE_LEAST, most = PT_SLOPE_MOST,
                 error = 64.0 * TOL_UNIT * (1.0 + limit / ref_footprint(&args->view, z));
    const double low = fmin(fmax(floor(wide - error + 0.5), least), most),
                 high = fmin(fmax(floor(wide + error + 0.5), least), most);
    *unsure |= low != high;
    return (int)low;
}

struct ref_slope ref_slope(const struct slope_args *args, const struct ref_planes *planes, const float *values, int x, int y)
{
    const struct view_args *view = &args->view;
    const size_t at = (size_t)y * view->width + (size_t)x;
    struct ref_slope out = {.known = isfinite(values[at])};
    if (!out.known)
        return out;
    const double z = ref_key_z(planes->keys[at]), own = values[at];
    const double limit = planes->deff[planes->from[at] & ~PT_FROM_MIXED];
    const int radius = radius_at(args, planes, x, y, z, limit, &out.unsure);
    const int step = (radius + PT_SLOPE_TAPS - 1) / PT_SLOPE_TAPS, taps = radius / step;
    double w = 0.0, mx = 0.0, my = 0.0, mv = 0.0, xx = 0.0, xy = 0.0, yy = 0.0, xv = 0.0, yv = 0.0;
    double most = 0.0, ax = 0.0, ay = 0.0, av = 0.0, axv = 0.0, ayv = 0.0; // sums of sizes
    for (int j = -taps; j <= taps; j++)
        for (int i = -taps; i <= taps; i++) {
            const int dx = step * i, dy = step * j, qx = x + dx, qy = y + dy;
            const double part = 1.0 - (dx * dx + dy * dy) / ((radius + 1.0) * (radius + 1.0));
            if (dx * dx + dy * dy >= (radius + 1) * (radius + 1) || qx < (int)view->rect[0] || qy < (int)view->rect[1] ||
                qx >= (int)view->rect[2] || qy >= (int)view->rect[3])
                continue;
            const size_t q = (size_t)qy * view->width + (size_t)qx;
            if (planes->keys[q] == REF_EMPTY_KEY || !isfinite(values[q]))
                continue;
            const double off = fabs(ref_key_z(planes->keys[q]) - z);
            const enum ref_truth same = ref_less_equal(ref_rounded(ref_exactly(off)), ref_exactly(limit));
            out.unsure |= same == REF_UNSURE;
            if (same == REF_NO)
                continue;
            const double v = values[q] - own;
            most = fmax(most, fabs(v));
            ax += part * abs(dx);
            ay += part * abs(dy);
            av += part * fabs(v);
            axv += part * fabs(dx * v);
            ayv += part * fabs(dy * v);
            w += part;
            mx += part * dx;
            my += part * dy;
            mv += part * v;
            xx += part * dx * dx;
            xy += part * dx * dy;
            yy += part * dy * dy;
            xv += part * dx * v;
            yv += part * dy * v;
        }
    // sums of so many terms, whose means cancel: each is off by some roundings of what was added
    const double unit = 64.0 * TOL_UNIT, r = sqrt((xx + yy) / w);
    const double xx_error = unit * (xx / w + ax * ax / (w * w)), yy_error = unit * (yy / w + ay * ay / (w * w));
    const double xy_error = sqrt(xx_error * yy_error);
    const double xv_error = unit * (axv / w + ax * av / (w * w)), yv_error = unit * (ayv / w + ay * av / (w * w));
    mx /= w;
    my /= w;
    mv /= w;
    xx = xx / w - mx * mx + (double)PT_SLOPE_RIDGE;
    yy = yy / w - my * my + (double)PT_SLOPE_RIDGE;
    xy = xy / w - mx * my;
    xv = xv / w - mx * mv;
    yv = yv / w - my * mv;
    const double det = xx * yy - xy * xy;
    out.x = (yy * xv - xy * yv) / det;
    out.y = (xx * yv - xy * xv) / det;
    out.value = own + (mv - (out.x * mx + out.y * my));
    const double det_error = (xx_error * yy + yy_error * xx + 2.0 * xy_error * fabs(xy) + unit * (xx * yy + xy * xy)) / det;
    out.x_error = ((yy_error + unit * yy) * fabs(xv) + yy * xv_error + (xy_error + unit * fabs(xy)) * fabs(yv) +
                   fabs(xy) * yv_error) /
                      det +
                  fabs(out.x) * det_error;
    out.y_error = ((xx_error + unit * xx) * fabs(yv) + xx * yv_error + (xy_error + unit * fabs(xy)) * fabs(xv) +
                   fabs(xy) * xv_error) /
                      det +
                  fabs(out.y) * det_error;
    out.value_error = unit * (most + fabs(own)) + r * (out.x_error + out.y_error) + unit * r * (fabs(out.x) + fabs(out.y));
    out.unsure |= det_error > 0.1;
    return out;
}
