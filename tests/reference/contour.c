// SPDX-License-Identifier: GPL-3.0-or-later
// Contour lines: where the height above a plane is a multiple of an interval.
#include "reference.h"
#include "tolerances.h"
#include "shared/effects.h"

#include <math.h>

struct slope {
    double along, along_error; // height, and by how much float32 may be off
    double rate, rate_error;   // how much it grows a pixel on; relative
};

// What lines of this kind cover of the pixel.
static double lines(const struct contour_args *args, int kind, const struct slope *slope, double *error)
{
    double wide = args->width[kind], interval = args->interval[kind], even = args->even[kind];
    double at = slope->along / interval, apart = interval / slope->rate;
    double off = fabs(at - floor(at + 0.5)) * apart;
    double line = fmin(fmax(wide / 2.0 - off + 0.5, 0.0), 1.0) * fmin(wide, 1.0);
    double tone = wide / fmax(apart, even), told = fmin(fmax(apart / even - 1.0, 0.0), 1.0);
    // the place of a line counts in intervals, of which float32 keeps some
    double at_error = slope->along_error / interval + 4.0 * TOL_UNIT * fabs(at);
    double off_error = at_error * apart + off * (slope->rate_error + 8.0 * TOL_UNIT);
    double told_error = apart / even < 3.0 ? (apart / even) * (slope->rate_error + 8.0 * TOL_UNIT) : 0.0;
    int away = off - off_error > wide / 2.0 + 0.5 && apart / 2.0 > wide / 2.0 + 0.5; // no line is near
    double line_error = away ? 0.0 : fmin(2.0 * off_error, 1.0);
    *error = told * line_error + fmin(told_error, 1.0) + tone * (slope->rate_error + 8.0 * TOL_UNIT) + 8.0 * TOL_UNIT;
    return tone + told * (line - tone);
}

struct ref_color ref_contour(const struct contour_args *args, const struct ref_planes *planes, int x, int y)
{
    const struct view_args *view = &args->view;
    size_t pixel = (size_t)y * view->width + (size_t)x;
    double z = ref_key_z(planes->keys[pixel]), xs = view->ray_xs, ys = view->ray_ys;
    struct ref_ray at = ref_ray(view, x, y);
    struct ref_vec a = ref_vec_of(args->axis), n = ref_vec_of(planes->shading + 4 * pixel);
    struct ref_vec ray = ref_vec(0.0, 0.0, -1.0), place = ref_vec(at.u, at.v, -(z + args->eye_z));
    struct ref_color out = {0};
    if (view->perspective) {
        ray = ref_vec(at.u, at.v, -1.0);
        place = ref_vec(at.u * z, at.v * z, -z);
        xs *= z;
        ys *= z;
    }
    double facing = ref_dot(n, ray), turn = ref_dot(a, ray) * facing / fmax(facing * facing, (double)PT_CONTOUR_GRAZING);
    double gx = xs * (a.x - turn * n.x), gy = ys * (a.y - turn * n.y);
    struct slope slope = {.along = ref_dot(a, place) + args->offset, .rate = sqrt(fmax(gx * gx + gy * gy, 1e-30))};
    slope.along_error = 8.0 * TOL_UNIT * (ref_length(place) + fabs((double)args->offset));
    // each term of the rate is rounded a few times; where they cancel, their sum is off by more
    slope.rate_error = 24.0 * TOL_UNIT * (fabs(xs) + fabs(ys)) * (1.0 + fabs(turn)) * (1.0 + ref_length(ray)) / slope.rate;
    struct ref_vec cross = ref_vec(a.y * n.z - a.z * n.y, a.z * n.x - a.x * n.z, a.x * n.y - a.y * n.x);
    if (args->of_values) {
        const float *found = planes->slopes + 4 * pixel;
        slope.along = found[0];
        slope.along_error = 0.0;
        slope.rate = fmax(hypot((double)found[1], (double)found[2]), 1e-15);
        slope.rate_error = 8.0 * TOL_UNIT;
    }
    double steep = ref_dot(n, n) < 0.5 ? 1.0 : ref_dot(cross, cross),
           share = (steep - (double)PT_CONTOUR_FLAT) * (double)PT_CONTOUR_RISE;
    double shown = args->opacity * fmin(fmax(share, 0.0), 1.0);
    double shown_error = share < 2.0 ? 16.0 * TOL_UNIT * (sqrt(steep) + steep) * (double)PT_CONTOUR_RISE : 4.0 * TOL_UNIT;
    if (args->of_values) {
        const double fading = 2.0 - args->interval[0] / slope.rate * (double)PT_CONTOUR_PER_APART;
        shown = args->opacity * fmin(fmax(fading, 0.0), 1.0) * (double)planes->slopes[4 * pixel + 3];
        shown_error = 32.0 * TOL_UNIT;
    }
    double error, covered = lines(args, 0, &slope, &error);
    if (args->kinds > 1) {
        double bold_error, bold = lines(args, 1, &slope, &bold_error);
        error = fmax(error, bold_error);
        covered = fmax(covered, bold);
    }
    // a rate that is next to nothing: of what faces along the axis, which is level or has no normal
    out.unsure = slope.rate_error > 0.05 && shown > 0.0;
    double ink = shown * covered, ink_error = covered * shown_error + shown * error;
    const float *c = planes->color + 4 * pixel;
    for (int k = 0; k < 3; k++) {
        double over = args->color[k] * (double)c[3];
        out.color[k] = c[k] * (1.0 - ink) + over * ink;
        out.error[k] = (fabs((double)c[k]) + fabs(over)) * (ink_error + 8.0 * TOL_UNIT);
    }
    out.color[3] = c[3];
    return out;
}
