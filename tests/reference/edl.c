// SPDX-License-Identifier: GPL-3.0-or-later
// Eye-dome lighting: darker by how far a pixel lies behind those around it, in log depth, or in depth where the view is
// orthographic.
#include "reference.h"
#include "tolerances.h"
#include "shared/effects.h"

#include <math.h>

// log2 of z, or of the distance from the eye, with the error that float32 may have; z itself where the view is orthographic.
static double depth_of(const struct edl_args *args, double z, int x, int y, double *error)
{
    *error = 0.0;
    if (!args->view.perspective)
        return z;
    *error = TOL_LOG + TOL_UNIT * fabs(log2(z));
    if (!args->from_eye)
        return log2(z);
    const struct ref_ray ray = ref_ray(&args->view, x, y);
    const double square = ray.u * ray.u + ray.v * ray.v + 1.0, depth = log2(z) + 0.5 * log2(square);
    // of the square's roundings each is a share of it, log2 takes 1.4427 of that; u and v round on their way, too
    *error += 0.5 * (TOL_LOG + TOL_UNIT * log2(square)) + 0.5 * 1.4427 * 12.0 * TOL_UNIT + 2.0 * TOL_UNIT * fabs(depth);
    return depth;
}

// Two spacings of what the pixel shows, in pixels, and how far float32 may be off.
static double width_at(const struct edl_args *args, const struct ref_planes *planes, int x, int y, double z, double *error)
{
    const uint32_t source = planes->from[(size_t)y * args->view.width + (size_t)x] & ~PT_FROM_MIXED;
    const struct ref_vec viewer = ref_viewer(&args->view, ref_ray(&args->view, x, y));
    const double cosine = fabs(ref_dot(ref_vec_of(planes->normal + 4 * (size_t)source), viewer));
    const double most = planes->deff[source] / ref_footprint(&args->view, z);
    *error = 64.0 * TOL_UNIT * most;
    return most * fmin(fmax(cosine, (double)PT_EDL_GRAZING), 1.0);
}

// The least of the pixel and its first neighbours. Below the first of wide any value is as good.
static double least_width(const struct edl_args *args, const struct ref_planes *planes, int x, int y, double z, double *error)
{
    double least = width_at(args, planes, x, y, z, error);
    for (int i = 0; i < PT_EDL_NEIGHBOURS; i++) {
        const int qx = x + args->offsets[2 * i], qy = y + args->offsets[2 * i + 1];
        if (qx < 0 || qy < 0 || qx >= (int)args->view.width || qy >= (int)args->view.height)
            continue;
        const uint64_t key = planes->keys[(size_t)qy * args->view.width + (size_t)qx];
        double near_error;
        if (key == REF_EMPTY_KEY)
            continue;
        least = fmin(least, width_at(args, planes, qx, qy, ref_key_z(key), &near_error));
        *error = fmax(*error, near_error);
    }
    return least;
}

struct ref_color ref_edl(const struct edl_args *args, const struct ref_planes *planes, int x, int y)
{
    const struct view_args *view = &args->view;
    size_t pixel = (size_t)y * view->width + (size_t)x;
    struct ref_color out = {0};
    double own_error, own = depth_of(args, ref_key_z(planes->keys[pixel]), x, y, &own_error), sum = 0.0, error = 0.0;
    double width_error, width = least_width(args, planes, x, y, ref_key_z(planes->keys[pixel]), &width_error);
    int radius = 0;
    while (radius < PT_EDL_RADII - 1 && width > args->wide[radius])
        radius++;
    for (int k = 0; k < PT_EDL_RADII - 1; k++)
        out.unsure |= fabs(width - args->wide[k]) <= width_error;
    const int32_t *offsets = args->offsets + 2 * PT_EDL_NEIGHBOURS * radius;
    for (int i = 0; i < PT_EDL_NEIGHBOURS; i++) {
        int qx = x + offsets[2 * i], qy = y + offsets[2 * i + 1];
        if (qx < 0 || qy < 0 || qx >= (int)view->width || qy >= (int)view->height)
            continue;
        uint64_t key = planes->keys[(size_t)qy * view->width + (size_t)qx];
        if (key == REF_EMPTY_KEY) {
            sum += (double)PT_EDL_STEP;
            continue;
        }
        double near_error, near = depth_of(args, ref_key_z(key), qx, qy, &near_error), behind = args->scale * (own - near);
        double most = args->scale * (own_error + near_error) + 2.0 * TOL_UNIT * fabs(behind);
        if (behind - most < (double)PT_EDL_STEP && behind + most > 0.0)
            error += most;
        sum += fmin(fmax(behind, 0.0), (double)PT_EDL_STEP);
    }
    const double fade = fmin(fmax(2.0 - width * args->narrow, 0.0), 1.0);
    const double off = (width_error + 4.0 * TOL_UNIT * width) * args->narrow + 2.0 * TOL_UNIT;
    const double fade_error = fmin(fmax(2.0 - width * args->narrow + off, 0.0), 1.0) -
                              fmin(fmax(2.0 - width * args->narrow - off, 0.0), 1.0);
    double dark = args->gain[radius] * fade * sum, light = exp2(-dark);
    // a step off by e takes ln 2 gain e of the light; eight sums, product and power round
    error = log(2.0) *
                (args->gain[radius] * (error * fmin(fade + fade_error, 1.0) + sum * fade_error) + 11.0 * TOL_UNIT * dark) +
            TOL_POWER;
    for (int c = 0; c < 4; c++) {
        out.color[c] = planes->color[4 * pixel + (size_t)c] * (c < 3 ? light : 1.0);
        out.error[c] = c < 3 ? (error + TOL_UNIT) * 1.01 * fabs(out.color[c]) : 0.0;
    }
    return out;
}
