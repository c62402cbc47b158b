// SPDX-License-Identifier: GPL-3.0-or-later
// Ambient obscurance: taps on a turned spiral, their mean over 5 x 5 pixels of the same layer.
#include "reference.h"
#include "tolerances.h"
#include "shared/effects.h"

#include <math.h>

static struct ref_vec point_of(const struct view_args *view, int x, int y, double z)
{
    struct ref_ray ray = ref_ray(view, x, y);
    return view->perspective ? ref_vec(ray.u * z, ray.v * z, -z) : ref_vec(ray.u, ray.v, -z);
}

double ref_obscured(const struct obscure_args *args, const struct ref_planes *planes, int x, int y, double *error, int *unsure)
{
    const struct view_args *view = &args->view;
    size_t pixel = (size_t)y * view->width + (size_t)x;
    double z = ref_key_z(planes->keys[pixel]), width = ref_footprint(view, z), sum = 0.0;
    double pixels = fmin(args->radius / width, (double)PT_OBSCURE_MOST), radius = pixels * width;
    struct ref_vec p = point_of(view, x, y, z), n = ref_vec_of(planes->shading + 4 * pixel);
    struct ref_vec viewer = ref_viewer(view, ref_ray(view, x, y));
    double toward = ref_dot(n, viewer);
    *unsure |= fabs(toward) < 1e-5 && ref_length(n) > 0.0; // edge-on: either side may be seen
    n = toward < 0.0 ? ref_scale(n, -1.0) : n;
    int turn = (int)(((uint32_t)view->origin_x + (uint32_t)x) & 3u) + 4 * (int)(((uint32_t)view->origin_y + (uint32_t)y) & 3u);
    double c = args->turns[2 * turn], s = args->turns[2 * turn + 1];
    *error = 0.0;
    for (int i = 0; i < PT_OBSCURE_TAPS; i++) {
        double sx = args->spiral[2 * i], sy = args->spiral[2 * i + 1];
        double dx = (c * sx - s * sy) * pixels + 0.5, dy = (s * sx + c * sy) * pixels + 0.5;
        double rounding = 16.0 * TOL_UNIT * (pixels + 1.0); // float32 may take the pixel beside
        *unsure |= fabs(dx - round(dx)) < rounding || fabs(dy - round(dy)) < rounding;
        int qx = x + (int)floor(dx), qy = y + (int)floor(dy);
        if (qx < 0 || qy < 0 || qx >= (int)view->width || qy >= (int)view->height)
            continue;
        uint64_t key = planes->keys[(size_t)qy * view->width + (size_t)qx];
        if (key == REF_EMPTY_KEY)
            continue;
        struct ref_vec q = point_of(view, qx, qy, ref_key_z(key));
        struct ref_vec v = ref_scale(ref_add(q, ref_scale(p, -1.0)), 1.0 / radius);
        double square = ref_dot(v, v), length = sqrt(square + 1e-4);
        // float32: what p and q are rounded by, in radii, moves v; where v is short that turns it
        double off = 8.0 * TOL_UNIT * (ref_length(p) + ref_length(q)) / radius + 16.0 * TOL_UNIT * (square + 1.0);
        if (square - 2.0 * off * (sqrt(square) + off) >= 1.0)
            continue;
        double above = fmax(ref_dot(n, v) / length - (double)PT_OBSCURE_BIAS, 0.0), share = fmax(1.0 - square, 0.0);
        sum += above * share;
        *error += 2.0 * off / length * share + 4.0 * off * (sqrt(square) + off + TOL_UNIT);
    }
    double scale = (double)PT_OBSCURE_GAIN / PT_OBSCURE_TAPS;
    *error = *error * scale + 16.0 * TOL_UNIT * sum * scale;
    return fmin(sum * scale, 1.0);
}

struct ref_color ref_obscure(const struct obscure_args *args, const struct ref_planes *planes, int x, int y)
{
    const struct view_args *view = &args->view;
    size_t pixel = (size_t)y * view->width + (size_t)x;
    double z = ref_key_z(planes->keys[pixel]), sum = 0.0, total = 0.0;
    struct ref_range d = ref_exactly(2.0 * (double)planes->deff[planes->from[pixel]]);
    struct ref_color out = {0};
    for (int dy = -2; dy <= 2; dy++)
        for (int dx = -2; dx <= 2; dx++) {
            int qx = x + dx, qy = y + dy;
            if (qx < 0 || qy < 0 || qx >= (int)view->width || qy >= (int)view->height)
                continue;
            size_t q = (size_t)qy * view->width + (size_t)qx;
            if (planes->keys[q] == REF_EMPTY_KEY)
                continue;
            double step = fabs(ref_key_z(planes->keys[q]) - z);
            enum ref_truth same = ref_less_equal(ref_rounded(ref_exactly(step)), d);
            out.unsure |= same == REF_UNSURE;
            if (same == REF_NO)
                continue;
            double weight = (dx == 2 || dx == -2 ? 0.5 : 1.0) * (dy == 2 || dy == -2 ? 0.5 : 1.0);
            sum += weight * planes->obscured[q];
            total += weight;
        }
    double light = fmax(1.0 - args->strength * sum / total, 0.0);
    for (int c = 0; c < 4; c++) {
        out.color[c] = planes->color[4 * pixel + (size_t)c] * (c < 3 ? light : 1.0);
        out.error[c] = c < 3 ? TOL_COLOR * fabs((double)planes->color[4 * pixel + (size_t)c]) * (1.0 + args->strength) : 0.0;
    }
    return out;
}
