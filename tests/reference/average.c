// SPDX-License-Identifier: GPL-3.0-or-later
// Means over the points within d_eff of a pixel's surface, weighted by a tent about the pixel's centre.
#include "reference.h"
#include "tolerances.h"
#include "shared/means.h"
#include "shared/words.h"

#include <math.h>

static double middle(struct ref_range r) { return 0.5 * (r.lo + r.hi); }

struct ref_tent ref_tent(const struct average_args *args, const struct chunk_view *chunk, const float *positions,
                         const uint32_t *surfels, uint32_t slot)
{
    const struct view_args *view = &args->view;
    const struct instance_args *instance = &args->instance;
    const uint32_t id = chunk->first + slot, word = surfels[id];
    const struct ref_splat splat = ref_scatter(view, chunk, positions, surfels, slot);
    struct ref_tent tent = {.id = chunk->id_base + id, .possible = splat.possible, .definite = splat.definite};
    struct ref_vec own;
    if (!tent.possible)
        return tent;
    tent.place = ref_place(view, chunk, positions, slot);
    if (!tent.place.known) {
        tent.definite = 0;
        return tent;
    }
    const double pixels = (double)PT_AVERAGE_TENT * instance->spacing[word >> PT_SPACING_SHIFT] /
                          ref_footprint(view, middle(tent.place.z));
    tent.half = fmax(fmin(pixels, (double)PT_AVERAGE_WIDEST), 1.0);
    const double z = middle(tent.place.z), off = (tent.place.z.hi - tent.place.z.lo) / fmax(z, 1e-30);
    tent.half_error = tent.half * (4.0 * TOL_QUOTIENT + off);
    tent.n = ref_vec(0.0, 0.0, 0.0);
    if (!args->normals || !ref_decode_normal(word, &own))
        return tent;
    const float *m = instance->normal_matrix;
    double terms = 0.0;
    for (int i = 0; i < 9; i++)
        terms += fabs((double)m[i]);
    struct ref_vec n = ref_vec(m[0] * own.x + m[1] * own.y + m[2] * own.z, m[3] * own.x + m[4] * own.y + m[5] * own.z,
                               m[6] * own.x + m[7] * own.y + m[8] * own.z);
    if (!(ref_length(n) > 0.0))
        return tent;
    tent.normal_error = TOL_NORMAL * terms / ref_length(n);
    n = ref_unit(n);
    struct ref_vec ray = {0.0, 0.0, -1.0};
    if (view->perspective)
        ray = ref_vec(view->ray_x0 + (double)view->ray_xs * middle(tent.place.x),
                      view->ray_y0 + (double)view->ray_ys * middle(tent.place.y), -1.0);
    const double facing = ref_dot(n, ray);
    tent.across = fabs(facing) < 1e-4;
    tent.n = facing > 0.0 ? ref_scale(n, -1.0) : n;
    return tent;
}

// 1 - |d| / h; below 0 the point lies beside the tent.
static double side(struct ref_range place, double center, const struct ref_tent *tent, double *error)
{
    const double away = fabs(center - middle(place)), off = 0.5 * (place.hi - place.lo) + TOL_SUM * (fabs(center) + away);
    *error = off / tent->half + away * tent->half_error / (tent->half * tent->half) + 4.0 * TOL_UNIT;
    return 1.0 - away / tent->half;
}

struct ref_average ref_average(const struct average_args *args, const struct ref_tent *tents, const struct ref_look *looks,
                               uint32_t count, uint32_t nearest, float z, float deff, const float n[3], int measured, int x,
                               int y)
{
    const struct view_args *view = &args->view;
    const double slack = 2.0 * TOL_UNIT * (z + (double)deff), cut = 1.0 / (double)PT_SUM_SCALE;
    double weights = 0.0, weights_error = 0.0, color[3] = {0}, color_error[3] = {0}, normal_error = 0.0;
    struct ref_vec normal = {0.0, 0.0, 0.0};
    struct ref_average out = {.unsure = 0};
    for (uint32_t i = 0; i < count; i++) {
        const struct ref_tent *tent = &tents[i];
        if (!tent->possible || tent->place.z.hi < z - (double)deff - slack || tent->place.z.lo > z + (double)deff + slack)
            continue;
        if (!tent->place.known) {
            out.unsure = 1;
            continue;
        }
        double error_x, error_y;
        const double wide = side(tent->place.x, view->origin_x + x + 0.5, tent, &error_x);
        const double tall = side(tent->place.y, view->origin_y + y + 0.5, tent, &error_y);
        if (wide + error_x <= 0.0 || tall + error_y <= 0.0)
            continue;
        const int sure = tent->definite && tent->place.z.lo >= z - (double)deff + slack &&
                         tent->place.z.hi <= z + (double)deff - slack;
        const double w = fmax(wide, 0.0) * fmax(tall, 0.0);
        double error = fabs(wide) * error_y + fabs(tall) * error_x + error_x * error_y;
        if (!sure) // it may be left out
            error += w;
        if (tent->across) // and turned round
            normal_error += 2.0 * w;
        weights += w;
        weights_error += error + cut;
        for (int k = 0; k < 3; k++) {
            const double c = fmax(fmin(looks[i].color[k], (double)PT_SUM_BRIGHTEST), -(double)PT_SUM_BRIGHTEST);
            color[k] += w * c;
            color_error[k] += error * fabs(c) + cut + 8.0 * TOL_UNIT * fabs(c);
        }
        normal = ref_add(normal, ref_scale(tent->n, w));
        normal_error += error + 2.0 * cut + w * tent->normal_error;
    }
    out.unsure |= weights < 8.0 * weights_error && weights + weights_error > cut; // as good as none, or none
    for (int k = 0; k < 3; k++) {
        out.color[k] = weights > cut ? color[k] / weights : looks[nearest].color[k];
        out.color_error[k] = weights > cut
                                 ? (color_error[k] + fabs(out.color[k]) * weights_error) / fmax(weights - weights_error, 1e-12)
                                 : 0.0;
        out.color_error[k] += 1e-6 * fabs(out.color[k]) + 1e-9;
    }
    out.n = ref_vec_of(n);
    if (!args->normals || !measured || !(weights > cut) || !(ref_length(normal) > 0.0))
        return out;
    const struct ref_ray ray = ref_ray(view, x, y);
    const double facing = view->perspective ? n[0] * ray.u + n[1] * ray.v - n[2] : -(double)n[2];
    out.n = ref_scale(ref_unit(normal), facing > 0.0 ? -1.0 : 1.0);
    out.normal_error = 2.0 * normal_error / ref_length(normal) + 1e-6;
    out.unsure |= fabs(facing) < 1e-4 || ref_length(normal) < fmax(1e-2 * weights, 4.0 * normal_error);
    return out;
}
