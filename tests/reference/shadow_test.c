// SPDX-License-Identifier: GPL-3.0-or-later
// [D 6], SPEC 4: lit if z <= z_map + d_eff, d_eff of the point as the light sees it.
#include "reference.h"
#include "tolerances.h"
#include "shared/shadows.h"
#include "shared/words.h"

#include <math.h>

// d_eff of the point: its own spacing and slope; the texel PT_TEXEL_SLACK wider.
static struct ref_range layer_distance(const struct shadow_test_args *args, const struct ref_place *place, uint32_t word,
                                       int *has_normal)
{
    const struct instance_args *instance = &args->instance;
    struct view_args view = args->view;
    double x = 0.5 * (place->x.lo + place->x.hi), y = 0.5 * (place->y.lo + place->y.hi);
    double z = 0.5 * (place->z.lo + place->z.hi), error = 0.0, cosine = 1.0;
    struct ref_vec n, ray = ref_vec(view.ray_x0 + view.ray_xs * x, view.ray_y0 + view.ray_ys * y, -1.0);
    struct ref_vec viewer = view.perspective ? ref_scale(ref_unit(ray), -1.0) : ref_vec(0.0, 0.0, 1.0);
    *has_normal = instance->has_normals && ref_decode_normal(word, &n);
    if (*has_normal) {
        const float *m = instance->normal_matrix;
        double terms = 0.0, along;
        for (int i = 0; i < 9; i++)
            terms += fabs((double)m[i]);
        n = ref_vec(m[0] * n.x + m[1] * n.y + m[2] * n.z, m[3] * n.x + m[4] * n.y + m[5] * n.z,
                    m[6] * n.x + m[7] * n.y + m[8] * n.z);
        *has_normal = ref_length(n) > 0.0;
        along = *has_normal ? terms / ref_length(n) : 1.0;
        // the ray's own error: the position on screen, a product and a sum
        double off =
            TOL_RAY * (fabs((double)view.ray_x0) + fabs((double)view.ray_y0) + fabs(view.ray_xs * x) + fabs(view.ray_ys * y)) +
            fabs((double)view.ray_xs) * (place->x.hi - place->x.lo) + fabs((double)view.ray_ys) * (place->y.hi - place->y.lo);
        error = 2.0 * (TOL_NORMAL * along + (view.perspective ? off : 0.0));
        cosine = *has_normal ? fabs(ref_dot(ref_unit(n), viewer)) : 1.0;
    }
    view.footprint *= PT_TEXEL_SLACK;
    double floored = fmax(cosine, (double)PT_COSINE_FLOOR);
    double share = TOL_LAYER + (cosine + error > (double)PT_COSINE_FLOOR ? error / floored : 0.0);
    double d = ref_layer_minimum(&view, instance->d_min, instance->spacing[word >> PT_SPACING_SHIFT], z) / floored;
    share += (place->z.hi - place->z.lo) / fmax(fabs(z), 1e-30) + 4.0 * TOL_UNIT; // the texel grows with z
    return (struct ref_range){d * (1.0 - share), d * (1.0 + share)};
}

// Of what is not beyond `last`, a float as the kernel has it: which depths count is decided exactly.
static double farthest_around(const struct view_args *view, const uint64_t *keys, int px, int py, float last)
{
    double farthest = 0.0;
    for (int y = py - 1; y <= py + 1; y++)
        for (int x = px - 1; x <= px + 1; x++)
            if (x >= 0 && y >= 0 && x < (int)view->width && y < (int)view->height) {
                double z = ref_key_z(keys[(size_t)y * view->width + (size_t)x]);
                farthest = isfinite(z) && z <= (double)last ? fmax(farthest, z) : farthest;
            }
    return farthest;
}

// A surface ends beside texels that show nothing.
static int beside_nothing(const struct view_args *view, const uint64_t *keys, int px, int py)
{
    int count = 0;
    for (int y = py - 1; y <= py + 1; y++)
        for (int x = px - 1; x <= px + 1; x++)
            if (x >= 0 && y >= 0 && x < (int)view->width && y < (int)view->height)
                count += keys[(size_t)y * view->width + (size_t)x] == REF_EMPTY_KEY;
    return count > 0;
}

// Do enough of the texels around shadow a point at z with this d_eff?
static enum ref_truth supported(const struct view_args *view, const uint64_t *keys, int px, int py, struct ref_range d,
                                struct ref_range z)
{
    int surely = 0, perhaps = 0;
    for (int y = py - 1; y <= py + 1; y++)
        for (int x = px - 1; x <= px + 1; x++) {
            if ((x == px && y == py) || x < 0 || y < 0 || x >= (int)view->width || y >= (int)view->height)
                continue;
            double q = ref_key_z(keys[(size_t)y * view->width + (size_t)x]);
            if (!isfinite(q))
                continue;
            struct ref_range far = {(q + d.lo) * (1.0 - TOL_SUM), (q + d.hi) * (1.0 + TOL_SUM)};
            enum ref_truth behind = ref_less(far, z);
            surely += behind == REF_YES;
            perhaps += behind != REF_NO;
        }
    return surely >= PT_SHADOW_SUPPORT ? REF_YES : perhaps < PT_SHADOW_SUPPORT ? REF_NO : REF_UNSURE;
}

enum ref_truth ref_shadow_test(const struct shadow_test_args *args, const struct ref_planes *planes,
                               const struct chunk_view *chunk, const float *positions, uint32_t slot)
{
    const struct view_args *view = &args->view;
    struct ref_place place = ref_place(view, chunk, positions, slot);
    if (!place.known || place.z.hi < view->z_near)
        return REF_NO;
    int unsure = place.z.lo < view->z_near, shadowed = 0, lit = 0, has_normal;
    uint32_t word = planes->surfels[chunk->first + slot];
    struct ref_range own = layer_distance(args, &place, word, &has_normal);
    for (double py = floor(place.y.lo); py <= floor(place.y.hi); py++)
        for (double px = floor(place.x.lo); px <= floor(place.x.hi); px++) {
            if (!(px >= args->window[0] && px < args->window[2] && py >= args->window[1] && py < args->window[3])) {
                lit = 1;
                continue;
            }
            size_t pixel = (size_t)(py - view->origin_y) * view->width + (size_t)(px - view->origin_x);
            double map = ref_key_z(planes->keys[pixel]);
            struct ref_range d = own;
            enum ref_truth before = ref_less_equal(place.z, ref_exactly(map));
            if (!has_normal && isfinite(map)) { // what the map shows there may be steeper, and as far as its neighbours
                float shown = planes->deff[planes->from[pixel] & ~PT_FROM_MIXED], apart = PT_SHADOW_APART * shown;
                float last = view->perspective ? (float)map + apart : INFINITY;
                if (beside_nothing(view, planes->keys, (int)px - view->origin_x, (int)py - view->origin_y))
                    d = (struct ref_range){d.lo / (double)PT_COSINE_FLOOR, d.hi / (double)PT_COSINE_FLOOR};
                d = (struct ref_range){fmax(d.lo, (double)shown), fmax(d.hi, (double)shown)};
                map = farthest_around(view, planes->keys, (int)px - view->origin_x, (int)py - view->origin_y, last);
            }
            struct ref_range far = {(map + d.lo) * (1.0 - TOL_SUM), (map + d.hi) * (1.0 + TOL_SUM)};
            enum ref_truth behind = isfinite(map) && before != REF_YES ? ref_less(far, place.z) : REF_NO;
            if (behind != REF_NO) {
                enum ref_truth same = supported(view, planes->keys, (int)px - view->origin_x, (int)py - view->origin_y, d,
                                                place.z);
                behind = same == REF_NO ? REF_NO : same == REF_YES ? behind : REF_UNSURE;
            }
            unsure |= behind == REF_UNSURE;
            shadowed |= behind == REF_YES;
            lit |= behind == REF_NO;
        }
    return unsure || (shadowed && lit) ? REF_UNSURE : shadowed ? REF_YES : REF_NO;
}

int ref_shadow_test_loss(const struct shadow_test_args *args, const struct ref_planes *planes, const struct chunk_view *chunk,
                         const float *positions, uint32_t slot, uint32_t *loss)
{
    const struct view_args *view = &args->view;
    *loss = args->loss;
    if (!args->faint)
        return 1;
    struct ref_place place = ref_place(view, chunk, positions, slot);
    double x = floor(place.x.lo) - view->origin_x, y = floor(place.y.lo) - view->origin_y;
    if (place.known && (floor(place.x.hi) != floor(place.x.lo) || floor(place.y.hi) != floor(place.y.lo)))
        return 0;
    if (!(place.known && x >= 0.0 && y >= 0.0 && x < view->width && y < view->height))
        return 1; // beyond the map, or behind it: lit
    uint64_t key = planes->keys[(size_t)y * view->width + (size_t)x];
    if (key != REF_EMPTY_KEY)
        *loss = (uint32_t)floor(args->loss * planes->opacities[ref_key_id(key) - args->caster] / 255.0 + 0.5);
    return 1;
}

uint32_t ref_shadow_word(const struct shadow_test_args *args, uint32_t word, int shadowed)
{
    uint32_t sum = word & PT_SHADOW_SUM, lost = word >> PT_SHADOW_SHIFT;
    if (shadowed)
        lost += (uint32_t)floor((255.0 - lost) * args->loss / 255.0 + 0.5);
    return args->alone || args->close ? sum + lost : sum | lost << PT_SHADOW_SHIFT;
}
