// SPDX-License-Identifier: GPL-3.0-or-later
// SPEC 5, solid: means over the discs of a pixel that lie within d_eff behind the nearest.
#include "reference.h"
#include "tolerances.h"
#include "shared/discs.h"

#include <math.h>

static double middle_of(struct ref_range r) { return 0.5 * (r.lo + r.hi); }

// Weight of a disc at a pixel and how far float32 may be off; its own pixel counts it as a pixel wide at least.
static double weight_of(const struct view_args *view, const struct ref_disc *disc, const struct ref_met *cover, int x, int y,
                        double *error)
{
    const double px = 0.5 * (disc->place.x.lo + disc->place.x.hi), py = 0.5 * (disc->place.y.lo + disc->place.y.hi);
    const double dx = view->origin_x + x + 0.5 - px, dy = view->origin_y + y + 0.5 - py, pixel = 2.0 * (dx * dx + dy * dy);
    double lo = cover->square.lo, hi = cover->square.hi;
    if (floor(px) == view->origin_x + x && floor(py) == view->origin_y + y) {
        const double slack = 4.0 * (disc->place.x.hi - disc->place.x.lo + disc->place.y.hi - disc->place.y.lo) + 1e-5 * pixel;
        const int beside = !(disc->radius > 0.0) || lo > 1.0;
        lo = beside ? pixel - slack : fmin(lo, pixel - slack);
        hi = beside || hi > 1.0 ? pixel + slack : fmin(hi, pixel + slack);
    }
    const double least = exp(-2.0 * hi), most = exp(-2.0 * lo);
    *error = 0.5 * (most - least) + TOL_GAUSSIAN;
    return 0.5 * (most + least);
}

enum ref_truth ref_blend_takes(const struct ref_disc *disc, const struct ref_met *cover, int nearest, double z, double deff)
{
    const double farthest = z + deff, slack = 2.0 * TOL_UNIT * farthest;
    if (!disc->possible || cover->covered == REF_NO || (!nearest && cover->z.lo > farthest + slack))
        return REF_NO;
    if (disc->edge_on && disc->radius > 0.0)
        return REF_UNSURE;
    return !nearest && (cover->covered == REF_UNSURE || cover->z.hi > farthest - slack || !disc->definite) ? REF_UNSURE
                                                                                                           : REF_YES;
}

// The mean of how far the discs within PT_DISC_DEPTHS d_eff lie behind z.
static void mean_depth(const struct view_args *view, const struct ref_disc *discs, const uint32_t *around, uint32_t count,
                       uint32_t nearest, double z, double deff, int x, int y, struct ref_blend *out)
{
    const double reach = fmax(fmin((double)PT_DISC_DEPTHS * deff, (double)PT_DISC_MOST), (double)PT_DISC_LEAST);
    const double farthest = z + reach, slack = 2.0 * TOL_UNIT * farthest;
    double weights = 0.0, weights_error = 0.0, sum = 0.0, sum_error = 0.0;
    for (uint32_t j = 0; j < count; j++) {
        const uint32_t i = around[j];
        const struct ref_met cover = ref_disc_at(view, &discs[i], x, y);
        double error;
        if (!discs[i].possible || cover.covered == REF_NO || (i != nearest && cover.z.lo > farthest + slack))
            continue;
        if (i != nearest && (cover.covered == REF_UNSURE || cover.z.hi > farthest - slack || !discs[i].definite))
            out->unsure_offset = 1;
        out->unsure_offset |= discs[i].edge_on && discs[i].radius > 0.0;
        const double w = weight_of(view, &discs[i], &cover, x, y, &error), behind = i == nearest ? 0.0 : middle_of(cover.z) - z;
        error += 2.0 / (double)PT_SUM_SCALE;
        weights += w;
        weights_error += error;
        sum += w * behind;
        sum_error += error * fabs(behind) + w * (0.5 * (cover.z.hi - cover.z.lo) + 8.0 * TOL_UNIT * (fabs(z) + fabs(behind))) +
                     2.0 * reach / (double)PT_SUM_SCALE;
    }
    out->offset = sum / weights;
    out->offset_error = (sum_error + fabs(out->offset) * weights_error) / fmax(weights - weights_error, 1e-12);
}

struct ref_blend ref_blend(const struct view_args *view, const struct ref_disc *discs, const struct ref_look *looks,
                           const uint32_t *around, uint32_t count, uint32_t nearest, float z, float deff, const float n[3],
                           int x, int y)
{
    struct ref_blend out = {.color_error = {0}};
    double weights = 0.0, weights_error = 0.0, opaque = 0.0, opaque_error = 0.0, color[3] = {0}, color_error[3] = {0};
    double terms = 0.0, normal_error = 0.0;
    struct ref_vec normal = {0, 0, 0};
    for (uint32_t j = 0; j < count; j++) {
        const uint32_t i = around[j];
        const struct ref_met cover = ref_disc_at(view, &discs[i], x, y);
        const enum ref_truth taken = ref_blend_takes(&discs[i], &cover, i == nearest, (double)z, (double)deff);
        double error, w;
        if (taken == REF_NO)
            continue;
        out.unsure |= taken == REF_UNSURE;
        w = weight_of(view, &discs[i], &cover, x, y, &error);
        error += 2.0 / (double)PT_SUM_SCALE; // cut to whole numbers
        weights += w;
        weights_error += error;
        opaque += w * looks[i].opacity;
        opaque_error += error * looks[i].opacity + 1.0 / (double)PT_SUM_SCALE;
        for (int k = 0; k < 3; k++) {
            const double c = fmax(fmin(looks[i].color[k], (double)PT_SUM_BRIGHTEST), -(double)PT_SUM_BRIGHTEST) *
                             looks[i].opacity;
            color[k] += w * c;
            color_error[k] += error * fabs(c) + 1.0 / (double)PT_SUM_SCALE + 8.0 * TOL_UNIT * fabs(c);
        }
        if (discs[i].has_normal) {
            normal = ref_add(normal, ref_scale(discs[i].n, w));
            terms += w;
            normal_error += error + w * discs[i].normal_error;
        }
    }
    for (int k = 0; k < 3 && opaque > 0.0; k++) {
        out.color[k] = color[k] / opaque;
        out.color_error[k] = (color_error[k] + fabs(out.color[k]) * opaque_error) / fmax(opaque - opaque_error, 1e-12) +
                             1e-6 * fabs(out.color[k]);
    }
    out.color[3] = opaque / weights;
    out.color_error[3] = (opaque_error + out.color[3] * weights_error) / fmax(weights - weights_error, 1e-12) + 1e-6;
    mean_depth(view, discs, around, count, nearest, z, deff, x, y, &out);
    // on the side of the nearest disc's
    struct ref_ray at = ref_ray(view, x, y);
    double facing = view->perspective ? n[0] * at.u + n[1] * at.v - n[2] : -(double)n[2];
    out.n = ref_vec_of(n);
    if (discs[nearest].has_normals && terms > 0.0) {
        out.n = ref_scale(ref_unit(normal), facing > 0.0 ? -1.0 : 1.0);
        out.normal_error = 2.0 * normal_error / ref_length(normal) + 1e-6;
        out.unsure |= fabs(facing) < 1e-4 || ref_length(normal) < 1e-2 * terms;
    }
    const double px = 0.5 * (discs[nearest].place.x.lo + discs[nearest].place.x.hi);
    const double py = 0.5 * (discs[nearest].place.y.lo + discs[nearest].place.y.hi);
    const double dx = floor(px) - (view->origin_x + x), dy = floor(py) - (view->origin_y + y);
    out.away = sqrt(dx * dx + dy * dy);
    out.unsure |= floor(discs[nearest].place.x.lo) != floor(discs[nearest].place.x.hi) ||
                  floor(discs[nearest].place.y.lo) != floor(discs[nearest].place.y.hi);
    return out;
}
