// SPDX-License-Identifier: GPL-3.0-or-later
// [K II.C, Fig. 4], SPEC 6: the 24 triangles of which a cell is a corner, one by one.
#include "reference.h"
#include "tolerances.h"
#include "shared/ranges.h"

#include <math.h>

static const int ring[8][2] = {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}};

static struct ref_vec position(const struct view_args *view, const float *place, int x, int y)
{
    const double z = (double)place[2], scale = view->perspective ? z : 1.0;
    const double u = view->ray_x0 + (double)view->ray_xs * (view->origin_x + x + (double)place[0]);
    const double v = view->ray_y0 + (double)view->ray_ys * (view->origin_y + y + (double)place[1]);
    return ref_vec(u * scale, v * scale, -z);
}

static struct ref_vec cross(struct ref_vec a, struct ref_vec b)
{
    return ref_vec(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

struct ref_incline ref_incline(const struct incline_args *args, const float *places, int x, int y)
{
    const struct view_args *view = &args->view;
    const float *own = places + 4 * ((size_t)y * view->width + (size_t)x);
    const struct ref_vec here = position(view, own, x, y);
    const double cell = ref_footprint(view, own[2]);
    struct ref_incline out = {.written = own[3] > 0.0f};
    struct ref_vec steps[8], n = ref_vec(0.0, 0.0, 0.0);
    int joined[8];
    double terms = 0.0;
    for (int k = 0; k < 8 && out.written; k++) {
        const int ox = x + ring[k][0], oy = y + ring[k][1];
        const int inside = ox >= (int)view->rect[0] && ox < (int)view->rect[2] && oy >= (int)view->rect[1] &&
                           oy < (int)view->rect[3];
        const float *other = inside ? places + 4 * ((size_t)oy * view->width + (size_t)ox) : own;
        joined[k] = inside && other[3] > 0.0f;
        if (!joined[k])
            continue;
        const double deep = fabs((double)other[2] - (double)own[2]);
        const double most = ref_range_step(view, args->gamma, args->gamma_cells, fmin((double)other[2], (double)own[2]));
        out.unsure |= fabs(deep - most) <= 8.0 * TOL_UNIT * (most + (double)own[2]);
        joined[k] = deep <= most;
        out.joined += joined[k];
        steps[k] = ref_scale(ref_add(position(view, other, ox, oy), ref_scale(here, -1.0)), 1.0 / cell);
    }
    for (int k = 0; k < 8 && out.written; k++)
        for (int turn = 1; turn < 4; turn++)
            if (joined[k] && joined[(k + turn) % 8]) {
                n = ref_add(n, cross(steps[k], steps[(k + turn) % 8]));
                terms += (ref_length(steps[k]) + 1.0) * (ref_length(steps[(k + turn) % 8]) + 1.0);
            }
    const double u = view->ray_x0 + (double)view->ray_xs * (view->origin_x + x + (double)own[0]);
    const double v = view->ray_y0 + (double)view->ray_ys * (view->origin_y + y + (double)own[1]);
    const struct ref_vec towards = view->perspective ? ref_unit(ref_vec(-u, -v, 1.0)) : ref_vec(0.0, 0.0, 1.0);
    const double length = ref_length(n);
    out.n = towards;
    out.error = 32.0 * TOL_UNIT * (1.0 + fabs(u) + fabs(v));
    if (terms > 0.0) { // rays, differences, products and sums: some twenty roundings of each term
        const double facing = ref_dot(n, towards);
        const double reach = fabs((double)view->ray_x0) + fabs((double)view->ray_y0) + fabs(u) + fabs(v) + 1.0;
        out.error = 64.0 * TOL_UNIT * terms * reach / fmax(length, 1e-30) + 8.0 * TOL_UNIT;
        out.unsure |= length < 1e-5 || out.error > 0.1 || fabs(facing) < 4.0 * out.error * length;
        out.n = ref_scale(ref_unit(n), facing < 0.0 ? -1.0 : 1.0);
    }
    return out;
}
