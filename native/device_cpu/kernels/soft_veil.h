// SPDX-License-Identifier: GPL-3.0-or-later
// A light's view of soft points: what its rays have lost in each slab of depth. Nothing is in an order, but every pixel's sums are
// made in that of the list.
#ifndef PT_SOFT_VEIL_H
#define PT_SOFT_VEIL_H

#include "soft_balls.h"
#include "soft_discs.h"

struct pt_soft_veil {
    float lost[PT_SOFT_VEILS][PT_SOFT_PIXELS];
};

// Where slab k ends, or (k = 0) the first begins; what lies before it counts in the first, what lies behind the last in that.
static inline float pt_soft_border(const struct soft_args *args, uint32_t k)
{
    const float border = k == 0             ? args->view.z_near
                         : k == args->veils ? pt_float(PT_KEY_EMPTY_Z)
                                            : args->veil_from + (float)k * args->veil_deep;
    return pt_min(pt_max(border, args->z_from), args->z_to);
}

// The slabs that what reaches from z - r to z + r may lie in: both included.
static inline void pt_soft_slabs(const struct soft_args *args, float z, float r, uint32_t slabs[2])
{
    const float scale = 1.0f / args->veil_deep, reach = 1.001f * r, most = (float)(args->veils - 1);
    const float ends[2] = {(z - reach - args->veil_from) * scale - 0.01f, (z + reach - args->veil_from) * scale + 0.01f};
    for (int k = 0; k < 2; k++)
        slabs[k] = (uint32_t)pt_min(pt_max(ends[k], 0.0f), most);
}

static inline vf pt_soft_lambda(vf a) { return vf_zero() - pt_soft_log1p(vf_zero() - vf_min(a, vf_set(PT_SOFT_FULLEST))); }

static inline void pt_soft_lose(struct pt_soft_veil *veil, uint32_t slab, uint32_t at, vf lost, vm some)
{
    vf_store(veil->lost[slab] + at, vf_load(veil->lost[slab] + at) + vf_select(some, lost, vf_zero()));
}

// What the balls lose from `low` to `high` in radii from where the ray is nearest to their centres; Express: evenly over 2.
static inline vf pt_soft_lost(const struct soft_args *args, vf shells, vf d, vf low, vf high, vm some)
{
    if (args->model != PT_SOFT_EXPRESS)
        return pt_soft_depth(args, shells, d, low, high, some);
    return (high - low) * vf_set(0.5f);
}

// PT_LANES pixels of a row from x on.
static inline void pt_soft_veil_ball(const struct pt_soft_tile *tile, const float *record, int32_t x, int32_t y,
                                     struct pt_soft_veil *veil)
{
    const struct soft_args *args = tile->bins->args;
    const struct view_args *view = &args->view;
    const vf one = vf_set(1.0f), zero = vf_zero(), half = vf_set(0.5f),
             p[4] = {vf_set(record[0]), vf_set(record[1]), vf_set(record[2]), vf_set(record[3])};
    const vf px = vi_convert(vi_add(vi_set((uint32_t)x), vi_lanes())) + vf_set((float)(view->origin_x + tile->x)) + half,
             py = vf_set((float)(view->origin_y + tile->y + y) + 0.5f);
    vf u = zero, v = zero, scale = one, n = one, root = one;
    if (view->perspective) {
        u = vf_set(view->ray_x0) + vf_set(view->ray_xs) * px;
        v = vf_set(view->ray_y0) + vf_set(view->ray_ys) * py;
        n = (u * u + v * v) + one;
        root = n * vf_rsqrt(n);
        scale = p[2];
    }
    const vf ex = (p[0] - px * scale) * vf_set(view->ray_xs), ey = (p[1] - py * scale) * vf_set(view->ray_ys);
    const vf across = ex * u + ey * v, inverse = vf_rcp(p[3]);
    const vf square = vf_max(((ex * ex + ey * ey) - (across * across) * vf_rcp(n)) * (inverse * inverse), zero);
    const vf left = one - square, along = (p[2] * n + across) * vf_rcp(root);
    const vm some = vf_lt(zero, left);
    if (!vm_bits(some))
        return;
    vf chord = left * vf_rsqrt(vf_select(some, left, one));
    const vf d = square * vf_rsqrt(vf_max(square, vf_set(1e-30f)));
    const vf shells = pt_soft_shell_count(args, p[2], p[3], some);
    const uint32_t word = pt_bits(record[7]);
    const float opacity = (float)(word >> PT_SOFT_SHIFT) * (1.0f / PT_SOFT_STEPS),
                weight = (float)(word & 255u) * (1.0f / 255.0f);
    vf depth;
    if (args->model == PT_SOFT_EXPRESS) {
        depth = pt_soft_lambda(pt_soft_share_of(weight, square, pt_soft_cosine(square)) * vf_set(opacity));
        chord = one;
    } else {
        depth = pt_soft_density(args, shells, d, chord, vf_set(opacity), vf_set(weight), some);
    }
    uint32_t slabs[2];
    pt_soft_slabs(args, record[2], 2.0f * record[3], slabs); // a slanting ray is nearest to the centre up to r before it
    for (uint32_t k = slabs[0]; k <= slabs[1]; k++) {
        const vf low = vf_max((vf_set(pt_soft_border(args, k)) * root - along) * inverse, zero - chord),
                 high = vf_max(vf_min((vf_set(pt_soft_border(args, k + 1)) * root - along) * inverse, chord), low);
        const vm within = vm_and(some, vf_lt(low, high));
        if (vm_bits(within))
            pt_soft_lose(veil, k, (uint32_t)y * PT_SOFT_TILE + (uint32_t)x,
                         depth * pt_soft_lost(args, shells, vf_select(within, d, zero), vf_select(within, low, zero),
                                              vf_select(within, high, zero), within),
                         within);
    }
}

static inline void pt_soft_add_veils(const struct pt_soft_tile *tile, const uint32_t *list, uint32_t count,
                                     struct pt_soft_veil *veil)
{
    for (uint32_t i = 0; i < count; i++) {
        const float *record = tile->bins->points + (size_t)PT_SOFT_WORDS * list[i];
        for (uint32_t at = 0; at < PT_SOFT_PIXELS; at += PT_LANES)
            pt_soft_veil_ball(tile, record, (int32_t)(at % PT_SOFT_TILE), (int32_t)(at / PT_SOFT_TILE), veil);
    }
}

// A tile's rays; with `last`, their slabs become sums of all up to their ends.
static void pt_soft_veils(const struct pt_soft_tile *tile, const uint32_t *list, uint32_t count)
{
    const struct soft_args *args = tile->bins->args;
    struct pt_soft_veil veil;
    memset(veil.lost, 0, args->veils * sizeof *veil.lost);
    pt_soft_add_veils(tile, list, count, &veil);
    for (uint32_t y = 0; y < tile->height; y++)
        for (uint32_t x = 0; x < tile->width; x++) {
            const size_t at = ((size_t)tile->y + y) * args->view.width + (size_t)tile->x + x;
            float *out = (float *)PT_DATA(tile->bins->call, soft, veil) + at * args->veils, sum = 0.0f;
            for (uint32_t k = 0; k < args->veils; k++) {
                sum = args->last ? sum + out[k] : out[k] + veil.lost[k][y * PT_SOFT_TILE + x];
                out[k] = sum;
            }
        }
}

#endif
