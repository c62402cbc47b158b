// SPDX-License-Identifier: GPL-3.0-or-later
// Soft points as records [S 3, Eq. 22]: where their balls lie, how opaque they are in the middle, and their light: that of shade, of a
// picture of one pixel that the point fills.
#include "reference.h"
#include "tolerances.h"
#include "shared/balls.h"

#include <math.h>

// lo + R p + hi with a bound of what float32 adds to it.
static double project(const struct chunk_view *chunk, int row, const double p[3], double *error)
{
    const float *r = chunk->row + 3 * row;
    const double terms = fabs((double)chunk->lo[row]) + fabs(r[0] * p[0]) + fabs(r[1] * p[1]) + fabs(r[2] * p[2]);
    const double value = chunk->lo[row] + r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + chunk->hi[row];
    *error = TOL_PROJECT * terms + TOL_SUM * fabs(value);
    return value;
}

static enum ref_truth both(enum ref_truth a, enum ref_truth b)
{
    return a == REF_NO || b == REF_NO ? REF_NO : a == REF_YES && b == REF_YES ? REF_YES : REF_UNSURE;
}

static double field_radius(const struct gather_args *args, uint32_t word)
{
    const uint32_t steps = args->whole ? word : word % 65536u;
    const union {
        uint32_t word;
        float number;
    } of = {args->radius_base + steps * args->radius_step};
    return steps ? (double)of.number : 0.0;
}

// The light on it: shade's, of a pixel whose ray is the point's.
static void light(const struct gather_args *args, const struct ref_planes *points, uint32_t id, struct ref_record *out)
{
    struct shade_args shade = args->shade;
    const uint32_t from = 0, word = points->surfels[id];
    struct view_args *view = &shade.view;
    const double before = view->perspective ? out->place[2] : 1.0;
    struct ref_vec n;
    float normal[4] = {0.0f, 0.0f, 1.0f, 1.0f}, far_off = 1e30f;
    if (ref_decode_normal(word, &n)) {
        const float *m = shade.instance.normal_matrix;
        const struct ref_vec turned = ref_unit(ref_vec(
            m[0] * n.x + m[1] * n.y + m[2] * n.z, m[3] * n.x + m[4] * n.y + m[5] * n.z, m[6] * n.x + m[7] * n.y + m[8] * n.z));
        normal[0] = (float)turned.x;
        normal[1] = (float)turned.y;
        normal[2] = (float)turned.z;
        if (!(ref_length(turned) > 0.0))
            normal[2] = 1.0f;
    }
    *view = (struct view_args){
        .width = 1, .height = 1, .rect = {0, 0, 1, 1}, .perspective = view->perspective, .footprint = view->footprint};
    const struct view_args *own = &args->shade.view;
    if (before > (double)PT_SOFT_BEFORE) {
        view->ray_x0 = (float)((double)own->ray_x0 + (double)own->ray_xs * out->place[0] / before);
        view->ray_y0 = (float)((double)own->ray_y0 + (double)own->ray_ys * out->place[1] / before);
    }
    const uint64_t key = ref_key((float)out->place[2], shade.instance.id_base + id);
    struct ref_planes planes = *points;
    planes.keys = &key;
    planes.from = &from;
    planes.normal = normal;
    planes.deff = &far_off;
    shade.blend = 0;
    shade.instance.opacity = 1.0f;
    shade.instance.has_opacities = 0;
    const struct ref_shade shaded = ref_shade(&shade, &planes, 0, 0);
    out->unsure = shaded.unsure;
    out->singular = shaded.singular;
    for (int c = 0; c < 3; c++) {
        out->color[c] = shaded.color[c];
        out->color_error[c] = shaded.color_error[c] + 64.0 * TOL_UNIT * fabs(shaded.color[c]);
    }
}

struct ref_record ref_gather(const struct gather_args *args, const struct chunk_view *chunk, const float *positions,
                             const uint32_t *field, const uint32_t *drawn, const struct ref_planes *points, uint32_t slot)
{
    const struct view_args *view = &args->shade.view;
    const struct instance_args *instance = &args->shade.instance;
    const uint32_t id = chunk->first + slot, f = args->whole ? 65535u : field[id] >> PT_FIELD_SHIFT;
    struct ref_record out = {.drawn = REF_NO};
    if (slot >= chunk->count || f <= args->threshold)
        return out;
    if (chunk->sifted && !(drawn[chunk->sifted - 1 + slot / PT_SLOTS_A_WORD] >> slot % PT_SLOTS_A_WORD & 1u))
        return out;
    double p[3];
    for (size_t k = 0; k < 3; k++)
        p[k] = positions[3 * (size_t)chunk->first + k * chunk->padded + slot];
    for (int k = 0; k < 3; k++)
        out.place[k] = project(chunk, k, p, &out.place_error[k]);
    // 1. its ball
    const double own = fmin(field_radius(args, field[id]) * (double)args->radius_scale, (double)PT_SOFT_WIDEST);
    const double least = fmax(ref_footprint(view, out.place[2]) * (double)PT_SOFT_LEAST, -1.0);
    out.radius = fmax(own, least);
    out.radius_error = 4.0 * TOL_UNIT * fabs(out.radius) +
                       (view->perspective ? (double)view->footprint * out.place_error[2] : 0.0);
    // 2. whether it shows
    if (!(fabs(out.place[0]) <= (double)PT_SOFT_FARTHEST && fabs(out.place[1]) <= (double)PT_SOFT_FARTHEST))
        return out; // NaN too
    const double reach = args->within ? out.radius : 0.0, off = out.place_error[2] + (args->within ? out.radius_error : 0.0);
    const double farther = out.place[2] + reach, nearer = out.place[2] - reach,
                 slack = off + TOL_SUM * (fabs(farther) + fabs(nearer));
    out.drawn = both(ref_less_equal(ref_exactly(view->z_near), (struct ref_range){farther - slack, farther + slack}),
                     ref_less_equal((struct ref_range){nearer - slack, nearer + slack}, ref_exactly(view->z_far)));
    if (!(out.radius > 0.0) || !(out.place[2] + slack > -1e37))
        out.drawn = REF_NO;
    // 3. its opacity, and W
    const double share = own / out.radius, byte = instance->has_opacities ? points->opacities[id] / 255.0 : 1.0;
    out.opacity = fmin(fmax((double)args->opacity * share * share * (double)instance->opacity * byte, 0.0), 1.0);
    out.opacity_error = out.opacity * (24.0 * TOL_UNIT + 2.0 * out.radius_error / out.radius) + 1.0 / (double)PT_SOFT_STEPS;
    out.weight = args->weight > 0.0f ? fmin((f - args->threshold) * (double)args->weight, 1.0) : 1.0;
    if (out.opacity < 0.4 / (double)PT_SOFT_STEPS) // half a step is one
        out.drawn = REF_NO;
    else if (out.opacity < 0.6 / (double)PT_SOFT_STEPS && out.drawn == REF_YES)
        out.drawn = REF_UNSURE;
    if (out.drawn != REF_NO)
        light(args, points, id, &out);
    return out;
}
