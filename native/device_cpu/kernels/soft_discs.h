// SPDX-License-Identifier: GPL-3.0-or-later
// The Express model: discs across the rays to their centres, front to back over the pixels of a tile.
#ifndef PT_SOFT_DISCS_H
#define PT_SOFT_DISCS_H

#include "soft_tile.h"

struct pt_soft_disc { // q = (a dx + b dy) dx + c dy^2
    float x, y, z, a, b, c, opacity, weight, color[3], density, r;
    int32_t x0, y0, x1, y1; // of the tile, the latter beyond
};

// PT_LANES records of a list.
static inline void pt_soft_set_discs(const struct pt_soft_tile *tile, const uint32_t *list, uint32_t count,
                                     struct pt_soft_disc *out)
{
    const struct view_args *view = &tile->bins->args->view;
    const vm some = vm_first(count);
    const vi at = vi_mul(vi_load(list), vi_set(2));
    const vf one = vf_set(1.0f), xs = vf_set(view->ray_xs), ys = vf_set(view->ray_ys);
    vf p[4], look[4], u = vf_zero(), v = vf_zero();
    float lanes[8][PT_LANES], looks[4][PT_LANES];
    vf_gather4(tile->bins->points, at, some, p);
    vf_gather4(tile->bins->points, vi_add(at, vi_set(1)), some, look);
    vf scale = vf_rcp(vf_select(some, p[3], one));
    const vf density = (scale * scale) * vf_set(PT_SOFT_DISC);
    if (view->perspective) {
        const vf r = vf_rcp(vf_select(some, p[2], one));
        p[0] = p[0] * r;
        p[1] = p[1] * r;
        u = vf_set(view->ray_x0) + xs * p[0];
        v = vf_set(view->ray_y0) + ys * p[1];
        scale = scale * p[2];
    }
    const vf inverse = vf_rcp((u * u + v * v) + one), square = scale * scale;
    const vf columns[8] = {p[0],
                           p[1],
                           p[2],
                           (square * (xs * xs)) * (one - (u * u) * inverse),
                           (square * (xs * ys)) * (vf_set(-2.0f) * ((u * v) * inverse)),
                           (square * (ys * ys)) * (one - (v * v) * inverse),
                           density,
                           p[3]};
    for (int k = 0; k < 8; k++)
        vf_store(lanes[k], columns[k]);
    for (int k = 0; k < 4; k++)
        vf_store(looks[k], look[k]);
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t word = pt_bits(looks[3][i]);
        out[i] = (struct pt_soft_disc){lanes[0][i] - (float)(view->origin_x + tile->x) - 0.5f,
                                       lanes[1][i] - (float)(view->origin_y + tile->y) - 0.5f,
                                       lanes[2][i],
                                       lanes[3][i],
                                       lanes[4][i],
                                       lanes[5][i],
                                       (float)(word >> PT_SOFT_SHIFT) * (1.0f / PT_SOFT_STEPS),
                                       (float)(word & 255u) * (1.0f / 255.0f),
                                       {looks[0][i], looks[1][i], looks[2][i]},
                                       lanes[6][i],
                                       lanes[7][i],
                                       0,
                                       0,
                                       0,
                                       0};
        // q reaches 1 at these on each side of the middle
        const float flat = 4.0f * out[i].a * out[i].c - out[i].b * out[i].b,
                    wide = flat > 0.0f ? __builtin_sqrtf(4.0f * out[i].c / flat) + 0.01f : 1e9f;
        const float tall = flat > 0.0f ? __builtin_sqrtf(4.0f * out[i].a / flat) + 0.01f : 1e9f;
        out[i].x0 = (int32_t)pt_max(out[i].x - wide, 0.0f);
        out[i].y0 = (int32_t)pt_max(out[i].y - tall, 0.0f);
        out[i].x1 = (int32_t)pt_min(pt_max(out[i].x + wide + 1.0f, 0.0f), (float)PT_SOFT_TILE);
        out[i].y1 = (int32_t)pt_min(pt_max(out[i].y + tall + 1.0f, 0.0f), (float)PT_SOFT_TILE);
    }
}

// (cos(pi sqrt(q)) + 1) / 2, for q in 0..1.
static inline vf pt_soft_cosine(vf q)
{
    vf f = vf_set(PT_SOFT_COSINE_5) * q + vf_set(PT_SOFT_COSINE_4);
    f = f * q + vf_set(PT_SOFT_COSINE_3);
    f = f * q + vf_set(PT_SOFT_COSINE_2);
    f = f * q + vf_set(PT_SOFT_COSINE_1);
    f = f * q + vf_set(PT_SOFT_COSINE_0);
    return f * q + vf_set(1.0f);
}

// [S Eq. 22] of that.
static inline vf pt_soft_share_of(float weight, vf q, vf cosine)
{
    if (!(weight < 1.0f))
        return cosine;
    const vf root = q * vf_rsqrt(vf_max(q, vf_set(1e-20f)));
    return (vf_set(1.0f) - root) * vf_set(1.0f - weight) + cosine * vf_set(weight);
}

static inline void pt_soft_add_disc(struct pt_soft_tile *tile, const struct pt_soft_disc *d)
{
    const vf one = vf_set(1.0f), zero = vf_zero(), z = vf_set(d->z), spent = vf_set(PT_SOFT_SPENT), a = vf_set(d->a);
    const int counted = tile->bins->args->density != 0;
    for (int32_t y = d->y0; y < d->y1; y++) {
        const float dy = d->y - (float)y;
        const vf below = vf_set(d->b * dy), least = vf_set(d->c * (dy * dy));
        for (int32_t x = d->x0 / PT_LANES * PT_LANES; x < d->x1; x += PT_LANES) {
            const uint32_t at = (uint32_t)y * PT_SOFT_TILE + (uint32_t)x;
            const vf dx = vf_set(d->x) - vi_convert(vi_add(vi_set((uint32_t)x), vi_lanes()));
            const vf q = vf_max((a * dx + below) * dx + least, zero), through = vf_load(tile->through + at);
            const vm within = vm_and(vf_lt(vf_load(tile->from + at), z), vf_le(z, vf_load(tile->to + at)));
            const vm there = vm_and(vf_lt(q, one), within), some = vm_and(there, vf_le(spent, through));
            if (!vm_bits(counted ? there : some))
                continue;
            const vf f = pt_soft_cosine(q), share = pt_soft_share_of(d->weight, q, f);
            const vf part = vf_mul_where(some, through, share * vf_set(d->opacity));
            vf_store(tile->through + at, through - part);
            for (int k = 0; k < 3; k++)
                vf_store(tile->color[k] + at, vf_load(tile->color[k] + at) + part * vf_set(d->color[k]));
            if (counted) // whatever light is left
                vf_store(tile->density + at, vf_load(tile->density + at) + vf_mul_where(there, vf_set(d->density), f));
            tile->fragments += (uint32_t)__builtin_popcount(vm_bits(some));
        }
    }
}

static void pt_soft_discs(struct pt_soft_tile *tile, const uint32_t *list, uint32_t count)
{
    struct pt_soft_disc discs[PT_LANES];
    for (uint32_t i = 0; i < count; i += PT_LANES) {
        const uint32_t some = pt_lanes_left(i, count);
        if (i % 64 == 0 && !tile->bins->args->density && pt_soft_spent(tile))
            return;
        pt_soft_set_discs(tile, list + i, some, discs);
        for (uint32_t k = 0; k < some; k++)
            pt_soft_add_disc(tile, &discs[k]);
    }
}

// Whether no pixel's surface goes as far as z.
static inline int pt_soft_covered(const struct pt_soft_tile *tile, float z)
{
    vm open = vm_of_bits(0);
    for (uint32_t i = 0; i < PT_SOFT_PIXELS; i += PT_LANES) {
        const vm some = vm_not(vm_and(vf_lt(vf_zero(), vf_load(tile->weight + i)), vf_lt(vf_load(tile->front + i), vf_set(z))));
        open = vm_or(open, vm_and(some, vf_lt(vf_load(tile->from + i), vf_load(tile->to + i))));
    }
    return !vm_bits(open);
}

// Splats, One Layer: what of the disc belongs to a pixel's surface.
static inline void pt_soft_add_splat(struct pt_soft_tile *tile, const struct pt_soft_disc *d)
{
    const vf one = vf_set(1.0f), zero = vf_zero(), z = vf_set(d->z), a = vf_set(d->a), end = vf_set(d->z + d->r);
    for (int32_t y = d->y0; y < d->y1; y++) {
        const float dy = d->y - (float)y;
        const vf below = vf_set(d->b * dy), least = vf_set(d->c * (dy * dy));
        for (int32_t x = d->x0 / PT_LANES * PT_LANES; x < d->x1; x += PT_LANES) {
            const uint32_t at = (uint32_t)y * PT_SOFT_TILE + (uint32_t)x;
            const vf dx = vf_set(d->x) - vi_convert(vi_add(vi_set((uint32_t)x), vi_lanes()));
            const vf q = vf_max((a * dx + below) * dx + least, zero), weight = vf_load(tile->weight + at);
            const vm within = vm_and(vf_lt(vf_load(tile->from + at), z), vf_le(z, vf_load(tile->to + at)));
            const vm there = vm_and(vf_lt(q, one), within), first = vm_not(vf_lt(zero, weight));
            const vm some = vm_and(there, vm_or(first, vf_le(z, vf_load(tile->front + at))));
            if (!vm_bits(there))
                continue;
            const vf f = pt_soft_cosine(q) + vf_set(PT_SOFT_RIM), own = vf_select(some, f, zero);
            vf_store(tile->front + at, vf_select(vm_and(some, first), end, vf_load(tile->front + at)));
            vf_store(tile->weight + at, weight + own);
            vf_store(tile->opacity + at, vf_load(tile->opacity + at) + own * vf_set(d->opacity));
            for (int k = 0; k < 3; k++)
                vf_store(tile->color[k] + at, vf_load(tile->color[k] + at) + own * vf_set(d->color[k]));
            if (tile->bins->args->density != 0)
                vf_store(tile->density + at,
                         vf_load(tile->density + at) + vf_mul_where(there, vf_set(d->density), pt_soft_cosine(q)));
            tile->fragments += (uint32_t)__builtin_popcount(vm_bits(some));
        }
    }
}

static void pt_soft_splats(struct pt_soft_tile *tile, const uint32_t *list, uint32_t count)
{
    const struct soft_args *args = tile->bins->args;
    struct pt_soft_disc discs[PT_LANES];
    for (uint32_t i = 0; i < PT_SOFT_PIXELS; i++)
        tile->front[i] = tile->weight[i] = tile->opacity[i] = 0.0f;
    for (uint32_t i = 0; i < count; i += PT_LANES) {
        const uint32_t some = pt_lanes_left(i, count);
        pt_soft_set_discs(tile, list + i, some, discs);
        if (!args->density && pt_soft_covered(tile, discs[0].z))
            break;
        for (uint32_t k = 0; k < some; k++)
            pt_soft_add_splat(tile, &discs[k]);
    }
    for (uint32_t i = 0; i < PT_SOFT_PIXELS; i++) {
        if (!(tile->weight[i] > 0.0f))
            continue;
        const float share = 1.0f / tile->weight[i];
        const float opacity = args->model == PT_SOFT_SPLATS ? 1.0f : tile->opacity[i] * share, scale = opacity * share;
        for (int k = 0; k < 3; k++)
            tile->color[k][i] = tile->color[k][i] * scale;
        tile->through[i] = 1.0f - opacity;
    }
}

#endif
