// SPDX-License-Identifier: GPL-3.0-or-later
// [K II.B], SPEC 6: the weighted mean of a cell's points up to gamma behind the nearest.
#include "reference.h"
#include "tolerances.h"
#include "shared/ranges.h"

#include <math.h>

struct sum {
    double value, error;
};

// Adds w x, both with errors, cut to a whole number.
static void add(struct sum *sum, struct sum w, double x, double off)
{
    sum->value += w.value * x;
    sum->error += w.error * fabs(x) + w.value * off + w.error * off + 1.0 / (double)PT_SUM_SCALE +
                  4.0 * TOL_UNIT * fabs(w.value * x);
}

static struct sum share(struct sum part, struct sum whole)
{
    const double least = fmax(whole.value - whole.error, 1e-12), value = part.value / whole.value;
    return (struct sum){value, (part.error + fabs(value) * whole.error) / least + 8.0 * TOL_UNIT * fabs(value)};
}

static double middle(struct ref_range r) { return 0.5 * (r.lo + r.hi); }
static double half(struct ref_range r) { return 0.5 * (r.hi - r.lo); }

double ref_range_gamma(const struct view_args *cells, float gamma, float gamma_cells, double z)
{
    return fmax((double)gamma, (double)gamma_cells * ref_footprint(cells, z));
}

double ref_range_step(const struct view_args *cells, float gamma, float gamma_cells, double z)
{
    return fmax(ref_range_gamma(cells, gamma, gamma_cells, z), (double)PT_RANGE_STEEP * ref_footprint(cells, z));
}

struct ref_merge ref_merge(const struct merge_args *args, const struct ref_merged_point *points, uint32_t count, float nearest,
                           uint32_t id, int x, int y)
{
    const struct view_args *view = &args->view;
    const double gamma = ref_range_gamma(view, args->gamma, args->gamma_cells, nearest);
    const double reach = fmin(gamma, fmax((double)PT_RANGE_DEEPEST * ref_footprint(view, nearest), (double)PT_RANGE_LEAST));
    struct sum weight = {0}, place[3] = {{0}}, color[3] = {{0}}, opacity = {0};
    struct ref_merge out = {.unsure = 0};
    for (uint32_t i = 0; i < count; i++) {
        const struct ref_merged_point *p = &points[i];
        if (!p->splat.possible || x < p->splat.x0 || x > p->splat.x1 || y < p->splat.y0 || y > p->splat.y1)
            continue;
        const int own = p->splat.id == id; // z of the key is its own, to the bit
        const double behind = own ? 0.0 : middle(p->place.z) - (double)nearest;
        const double off = own ? 0.0 : half(p->place.z) + TOL_SUM * fabs(behind);
        if (!p->place.known || behind + off < 0.0 || behind - off > gamma * (1.0 + 8.0 * TOL_UNIT))
            continue;
        struct sum w = {fmin(fmax(1.0 - behind / gamma, 0.0), 1.0), fmin(off / gamma + 8.0 * TOL_UNIT, 1.0)};
        if (!p->splat.definite && !own)
            w.error = 1.0;
        const struct sum seen = {w.value * p->look.opacity, w.error * p->look.opacity + TOL_OPACITY};
        const double deep = fmin(fmax(behind / reach, 0.0), 1.0);
        add(&weight, w, 1.0, 0.0);
        add(&place[0], w, middle(p->place.x) - view->origin_x - x, half(p->place.x) + 1e-9);
        add(&place[1], w, middle(p->place.y) - view->origin_y - y, half(p->place.y) + 1e-9);
        add(&place[2], w, deep, fmin(off / reach + 8.0 * TOL_UNIT, 1.0));
        add(&opacity, seen, 1.0, 0.0);
        for (int k = 0; k < 3; k++)
            add(&color[k], seen, fmax(fmin(p->look.color[k], (double)PT_SUM_BRIGHTEST), -(double)PT_SUM_BRIGHTEST), 0.0);
    }
    out.unsure = !(weight.value > 8.0 * weight.error);
    for (int k = 0; k < 3; k++) {
        const struct sum s = share(place[k], weight), c = share(color[k], opacity);
        out.place[k] = k < 2 ? s.value : (double)nearest + reach * s.value;
        out.place_error[k] = (k < 2 ? s.error : reach * s.error + 2.0 * TOL_UNIT * out.place[k]) + 1e-9 * (k < 2);
        out.color[k] = opacity.value > 0.0 ? c.value : 0.0;
        out.color_error[k] = opacity.value > 0.0 ? c.error + 1e-9 : 0.0;
        out.unsure |= opacity.value > 0.0 && !(opacity.value > 8.0 * opacity.error);
    }
    out.place[3] = weight.value;
    out.place_error[3] = weight.error;
    out.color[3] = fmin(share(opacity, weight).value, 1.0);
    out.color_error[3] = share(opacity, weight).error;
    return out;
}
