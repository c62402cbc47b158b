// SPDX-License-Identifier: GPL-3.0-or-later
// Ambient obscurance: every pixel's taps, and the mean over 5 x 5 of them.
#ifndef PT_OBSCURE_H
#define PT_OBSCURE_H

#include "device_cpu/picture_rows.h"
#include "shared/effects.h"

enum { PT_OBSCURE_ROWS = 2 * PT_OBSCURE_BLUR + 1 }; // that a mean takes

struct pt_obscure_point {
    vf z, ray[2], n[3];
    vf radius, pixels, inverse; // of the taps: in the scene, on screen; 1 / radius
    vf turn[2];                 // cosine, sine
};

static inline void pt_obscure_place(const struct obscure_args *args, const vf shown[3], uint32_t x, uint32_t y, vm some,
                                    struct pt_obscure_point *p)
{
    const struct view_args *view = &args->view;
    const vf zero = vf_zero();
    vf width = vf_footprint(view, p->z), toward;
    vf_ray(view, x, y, p->ray);
    toward = zero - shown[2]; // n . r: a surface that faces away from the viewer is seen from behind
    if (view->perspective)
        toward = (shown[0] * p->ray[0] + shown[1] * p->ray[1]) - shown[2];
    for (int k = 0; k < 3; k++)
        p->n[k] = vf_select(vf_lt(zero, toward), zero - shown[k], shown[k]);
    p->pixels = vf_min(vf_set(args->radius) * vf_rcp(vf_select(some, width, vf_set(1.0f))), vf_set(PT_OBSCURE_MOST));
    p->radius = p->pixels * width;
    p->inverse = vf_rcp(vf_select(some, p->radius, vf_set(1.0f)));
    vi column = vi_add(vi_set((uint32_t)view->origin_x + x), vi_lanes());
    vi turn = vi_add(vi_and(column, vi_set(3)), vi_set(4 * (((uint32_t)view->origin_y + y) & 3u)));
    for (uint32_t k = 0; k < 2; k++)
        p->turn[k] = vf_gather(args->turns, vi_add(vi_mul(turn, vi_set(2)), vi_set(k)), some);
}

// What the tap adds.
static inline vf pt_obscure_tap(const struct obscure_args *args, const uint64_t *keys, const struct pt_obscure_point *p, int i,
                                uint32_t x, uint32_t y, vm some)
{
    const struct view_args *view = &args->view;
    const vf half = vf_set(0.5f), one = vf_set(1.0f), xs = vf_set(view->ray_xs), ys = vf_set(view->ray_ys);
    const vf sx = vf_set(args->spiral[2 * i]), sy = vf_set(args->spiral[2 * i + 1]);
    vf dx = vf_floor((p->turn[0] * sx - p->turn[1] * sy) * p->pixels + half);
    vf dy = vf_floor((p->turn[1] * sx + p->turn[0] * sy) * p->pixels + half);
    vi qx = vi_add(vi_add(vi_set(x), vi_lanes()), vf_int(dx)), qy = vi_add(vi_set(y), vf_int(dy));
    vm inside = vm_and(some, vm_and(vi_lt_unsigned(qx, vi_set(view->width)), vi_lt_unsigned(qy, vi_set(view->height))));
    vf z = vi_float(vi_gather_z(keys, vi_add(vi_mul(qy, vi_set(view->width)), qx), inside)), v[3];
    v[0] = xs * dx;
    v[1] = ys * dy;
    if (view->perspective) {
        v[0] = z * (p->ray[0] + v[0]) - p->z * p->ray[0];
        v[1] = z * (p->ray[1] + v[1]) - p->z * p->ray[1];
    }
    v[2] = p->z - z;
    for (int k = 0; k < 3; k++)
        v[k] = v[k] * p->inverse;
    vf square = (v[0] * v[0] + v[1] * v[1]) + v[2] * v[2];
    vm near = vm_and(inside, vf_lt(square, one)); // not where the tap is empty: its z is +inf
    square = vf_select(near, square, one);
    vf cosine = ((p->n[0] * v[0] + p->n[1] * v[1]) + p->n[2] * v[2]) * vf_rsqrt(square + vf_set(1e-4f));
    vf above = vf_max(vf_select(near, cosine, vf_zero()) - vf_set(PT_OBSCURE_BIAS), vf_zero());
    return vf_mul_where(near, above, one - square);
}

// How much of PT_LANES pixels from (x, y) on is obscured, before the mean. shown: the normals; keys: of the plane.
static inline vf pt_obscured(const struct obscure_args *args, const uint64_t *keys, vf z, const vf shown[3], uint32_t x,
                             uint32_t y, vm some)
{
    struct pt_obscure_point p = {.z = z};
    vf sum = vf_zero();
    pt_obscure_place(args, shown, x, y, some, &p);
    for (int i = 0; i < PT_OBSCURE_TAPS; i++)
        sum = sum + pt_obscure_tap(args, keys, &p, i, x, y, some);
    return vf_min(sum * vf_set(PT_OBSCURE_GAIN / PT_OBSCURE_TAPS), vf_set(1.0f));
}

// What the colours of PT_LANES pixels from x on are multiplied with. z, obscured: rows about theirs. deff: of what they show.
static inline vf pt_obscure_light(const struct obscure_args *args, const float *const z[PT_OBSCURE_ROWS],
                                  const float *const obscured[PT_OBSCURE_ROWS], vf deff, uint32_t x, vm some)
{
    static const float weights[PT_OBSCURE_ROWS] = {0.5f, 1.0f, 1.0f, 1.0f, 0.5f};
    const vf one = vf_set(1.0f), limit = vf_set(2.0f) * deff, own = vf_load(z[PT_OBSCURE_BLUR] + x);
    vf sum = vf_zero(), total = vf_zero();
    for (int dy = 0; dy < PT_OBSCURE_ROWS; dy++)
        for (int dx = 0; dx < PT_OBSCURE_ROWS; dx++) {
            const vf weight = vf_set(weights[dx] * weights[dy]);
            const int32_t at = (int32_t)x + dx - PT_OBSCURE_BLUR;
            vm same = vm_and(some, vf_le(vf_abs(vf_load(z[dy] + at) - own), limit));
            sum = sum + vf_mul_where(same, weight, vf_load(obscured[dy] + at));
            total = vf_add_where(same, total, weight);
        }
    vf mean = sum * vf_rcp(vf_select(some, total, one));
    return vf_max(one - vf_set(args->strength) * mean, vf_zero());
}

#endif
