// SPDX-License-Identifier: GPL-3.0-or-later
// SPEC 6: between which distances from a cell's plane the means of single scans lie.
#include "reference.h"
#include "tolerances.h"
#include "shared/ranges.h"

#include <math.h>

static double middle(struct ref_range r) { return 0.5 * (r.lo + r.hi); }
static double half(struct ref_range r) { return 0.5 * (r.hi - r.lo); }

// How far a point lies off the plane; the error of it.
static double off_plane(const struct view_args *view, const struct ref_place *place, double behind, double wrong,
                        struct ref_vec n, int x, int y, double *error)
{
    const double z = middle(place->z), dx = middle(place->x) - (view->origin_x + x) - 0.5,
                 dy = middle(place->y) - (view->origin_y + y) - 0.5;
    const double xs = (double)view->ray_xs, ys = (double)view->ray_ys;
    const double u = (double)view->ray_x0 + xs * (view->origin_x + x + 0.5),
                 v = (double)view->ray_y0 + ys * (view->origin_y + y + 0.5);
    const double across = view->perspective ? u * behind + xs * dx * z : xs * dx,
                 up = view->perspective ? v * behind + ys * dy * z : ys * dy, wide = view->perspective ? z : 1.0;
    *error = fabs(n.z) * wrong + (view->perspective ? (fabs(n.x * u) + fabs(n.y * v)) * wrong : 0.0) +
             wide * (fabs(n.x * xs) * half(place->x) + fabs(n.y * ys) * half(place->y)) +
             16.0 * TOL_UNIT * (fabs(n.x * across) + fabs(n.y * up) + fabs(n.z * behind) + wide * (fabs(xs) + fabs(ys)));
    return n.x * across + n.y * up - n.z * behind;
}

struct ref_differ ref_differ(const struct differ_args *args, const struct ref_merged_point *points, const uint16_t *scans,
                             uint32_t count, float nearest, uint32_t id, const float *inclined, int x, int y)
{
    const struct view_args *view = &args->view;
    const double gamma = ref_range_gamma(view, args->gamma, args->gamma_cells, (double)nearest);
    const double reach = fmin(gamma, fmax((double)PT_RANGE_DEEPEST * ref_footprint(view, nearest), (double)PT_RANGE_LEAST));
    double sums[PT_DIFFER_SCANS] = {0.0}, errors[PT_DIFFER_SCANS] = {0.0};
    uint32_t known[PT_DIFFER_SCANS] = {0};
    struct ref_differ out = {.least = (double)PT_RANGE_MOST, .most = -(double)PT_RANGE_MOST};
    for (uint32_t i = 0; i < count; i++) {
        const struct ref_merged_point *p = &points[i];
        const uint32_t scan = scans[i] % PT_DIFFER_MOST - args->first;
        if (scan >= PT_DIFFER_SCANS || !p->splat.possible || x < p->splat.x0 || x > p->splat.x1 || y < p->splat.y0 ||
            y > p->splat.y1)
            continue;
        const int own = p->splat.id == id;
        const double behind = own ? 0.0 : middle(p->place.z) - (double)nearest,
                     wrong = own ? 0.0 : half(p->place.z) + TOL_SUM * fabs(behind), slack = wrong + 8.0 * TOL_UNIT * gamma;
        double error;
        if (!p->place.known || behind < -wrong || behind > gamma + slack)
            continue;
        out.unsure |= (!p->splat.definite && !own) || (!own && behind < wrong) || behind > gamma - slack;
        const double off = off_plane(view, &p->place, behind, wrong, ref_vec_of(inclined), x, y, &error);
        sums[scan] += fmin(fmax(off / reach, -1.0), 1.0);
        errors[scan] += error / reach + 8.0 * TOL_UNIT + 1.0 / (double)PT_SUM_SCALE;
        known[scan]++;
    }
    for (uint32_t k = 0; k < PT_DIFFER_SCANS; k++) {
        if (!known[k])
            continue;
        const double mean = sums[k] / known[k] * reach, error = errors[k] / known[k] * reach + 16.0 * TOL_UNIT * fabs(mean);
        out.least = fmin(out.least, mean);
        out.most = fmax(out.most, mean);
        out.error = fmax(out.error, error);
    }
    return out;
}
