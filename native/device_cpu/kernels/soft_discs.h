// SPDX-License-Identifier: GPL-3.0-or-later
// The Express model: discs across the rays to their centres, front to back over the pixels of a tile. Splats and One Layer: the same
// discs. They are taken 64 at a time: what each looks like on the tile, then of each group of pixels those that reach it, with the
// group's pixels in registers.
#ifndef PT_SOFT_DISCS_H
#define PT_SOFT_DISCS_H

#include "soft_order.h"
#include "soft_tile.h"

#define PT_SOFT_INLINE static inline __attribute__((always_inline))

enum {
    PT_SOFT_TAKEN = 64, // discs at a time
    PT_SOFT_VECTORS = PT_SOFT_GROUP / PT_LANES
};

struct pt_soft_discs { // q = (a dx + b dy) dx + c dy^2
    uint32_t count;
    int plain; // every weight is 1
    float x[PT_SOFT_TAKEN], y[PT_SOFT_TAKEN], z[PT_SOFT_TAKEN], a[PT_SOFT_TAKEN], b[PT_SOFT_TAKEN], c[PT_SOFT_TAKEN];
    float opacity[PT_SOFT_TAKEN], weight[PT_SOFT_TAKEN], color[3][PT_SOFT_TAKEN], density[PT_SOFT_TAKEN], end[PT_SOFT_TAKEN];
    uint32_t groups[PT_SOFT_TAKEN];    // of the tile's, which it may reach
    uint64_t reaching[PT_SOFT_GROUPS]; // which of the discs may reach a group
};

// Groups of the tile that pixels x0..x1, y0..y1 lie in, the latter beyond.
static inline uint32_t pt_soft_groups(uint32_t x0, uint32_t y0, uint32_t x1, uint32_t y1)
{
    if (x0 >= x1 || y0 >= y1)
        return 0;
    const uint32_t row = (2u << (x1 - 1) / PT_SOFT_WIDE) - (1u << x0 / PT_SOFT_WIDE);
    const uint32_t first = y0 / PT_SOFT_TALL * PT_SOFT_ACROSS, last = ((y1 - 1) / PT_SOFT_TALL + 1) * PT_SOFT_ACROSS;
    return row * 0x11111111u & (uint32_t)((1ull << last) - (1ull << first));
}

// Pixels from *low to *high, the latter beyond, are within `reach` of the middle, of the tile's.
static inline void pt_soft_span(vf middle, vf reach, vi *low, vi *high)
{
    const vf zero = vf_zero(), most = vf_set(PT_SOFT_TILE);
    *low = vf_int(vf_min(vf_max(middle - reach, zero), most));
    *high = vf_int(vf_min(vf_max(middle + reach + vf_set(1.0f), zero), most));
}

// PT_LANES entries of a list become discs from `to` on.
static inline void pt_soft_set_discs(const struct pt_soft_tile *tile, const uint64_t *list, uint32_t count, uint32_t to,
                                     struct pt_soft_discs *out)
{
    const struct view_args *view = &tile->bins->args->view;
    const vm some = vm_first(count);
    const vf one = vf_set(1.0f), four = vf_set(4.0f), xs = vf_set(view->ray_xs), ys = vf_set(view->ray_ys);
    uint32_t records[PT_LANES] = {0}, spans[4][PT_LANES];
    vf p[4], look[4], u = vf_zero(), v = vf_zero();
    vi ends[4];
    for (uint32_t k = 0; k < count; k++)
        records[k] = 2u * (uint32_t)list[k];
    vf_gather4(tile->bins->points, vi_load(records), some, p);
    vf_gather4(tile->bins->points, vi_add(vi_load(records), vi_set(1)), some, look);
    vf scale = vf_rcp(vf_select(some, p[3], one));
    vf_store(out->density + to, (scale * scale) * vf_set(PT_SOFT_DISC));
    if (view->perspective) {
        const vf r = vf_rcp(vf_select(some, p[2], one));
        p[0] = p[0] * r;
        p[1] = p[1] * r;
        u = vf_set(view->ray_x0) + xs * p[0];
        v = vf_set(view->ray_y0) + ys * p[1];
        scale = scale * p[2];
    }
    const vf inverse = vf_rcp((u * u + v * v) + one), square = scale * scale;
    const vf a = (square * (xs * xs)) * (one - (u * u) * inverse),
             b = (square * (xs * ys)) * (vf_set(-2.0f) * ((u * v) * inverse)),
             c = (square * (ys * ys)) * (one - (v * v) * inverse);
    const vf x = (p[0] - vf_set((float)(view->origin_x + tile->x))) - vf_set(0.5f),
             y = (p[1] - vf_set((float)(view->origin_y + tile->y))) - vf_set(0.5f);
    const vi word = vf_bits(look[3]);
    const vf columns[11] = {x,
                            y,
                            p[2],
                            a,
                            b,
                            c,
                            p[2] + p[3],
                            look[0],
                            look[1],
                            look[2],
                            vi_convert(vi_shr(word, PT_SOFT_SHIFT)) * vf_set(1.0f / PT_SOFT_STEPS)};
    float *const of[11] = {out->x,   out->y,        out->z,        out->a,        out->b,      out->c,
                           out->end, out->color[0], out->color[1], out->color[2], out->opacity};
    for (int k = 0; k < 11; k++)
        vf_store(of[k] + to, columns[k]);
    const vi share = vi_and(word, vi_set(255));
    vf_store(out->weight + to, vi_convert(share) * vf_set(1.0f / 255.0f));
    out->plain &= !vm_bits(vm_and(some, vm_not(vi_eq(share, vi_set(255)))));
    // q reaches 1 at these on each side of the middle
    const vf flat = (four * a) * c - b * b, far = vf_set(1e9f), wider = vf_set(1.0001f), over = vf_set(0.01f);
    const vm sure = vm_and(some, vm_and(vf_lt(vf_set(1e-30f), flat), vf_lt(flat, vf_set(1e30f))));
    const vf share_of_flat = four * vf_rcp(vf_select(sure, flat, one));
    const vf wide = vf_max(c * share_of_flat, vf_set(1e-30f)), tall = vf_max(a * share_of_flat, vf_set(1e-30f));
    pt_soft_span(x, vf_select(sure, (wide * vf_rsqrt(wide)) * wider + over, far), &ends[0], &ends[2]);
    pt_soft_span(y, vf_select(sure, (tall * vf_rsqrt(tall)) * wider + over, far), &ends[1], &ends[3]);
    for (int k = 0; k < 4; k++)
        vi_store(spans[k], ends[k]);
    for (uint32_t k = 0; k < PT_LANES; k++)
        out->groups[to + k] = k < count ? pt_soft_groups(spans[0][k], spans[1][k], spans[2][k], spans[3][k]) : 0;
}

// Asks for the records of the discs from i on: each is a miss of its own.
static inline void pt_soft_fetch(const struct pt_soft_tile *tile, struct pt_soft_order *order, uint32_t i)
{
    pt_soft_order_to(order, i + PT_SOFT_TAKEN);
    for (uint32_t k = i; k < i + PT_SOFT_TAKEN && k < order->count; k++)
        __builtin_prefetch(tile->bins->points + PT_SOFT_WORDS * (size_t)(uint32_t)order->list[k]);
}

// The next discs of a list from i on, and which of them reach each of the groups.
static inline void pt_soft_take(const struct pt_soft_tile *tile, struct pt_soft_order *order, uint32_t i, uint32_t groups,
                                struct pt_soft_discs *out)
{
    const uint64_t *list = order->list + i;
    out->count = order->count - i < PT_SOFT_TAKEN ? order->count - i : PT_SOFT_TAKEN;
    out->plain = 1;
    if (i == 0)
        pt_soft_fetch(tile, order, 0);
    pt_soft_fetch(tile, order, i + PT_SOFT_TAKEN); // while these are drawn
    for (uint32_t k = 0; k < out->count; k += PT_LANES)
        pt_soft_set_discs(tile, list + k, pt_lanes_left(k, out->count), k, out);
    for (; groups; groups &= groups - 1) {
        const uint32_t group = (uint32_t)__builtin_ctz(groups);
        const vi bit = vi_set(1u << group);
        uint64_t reaching = 0;
        for (uint32_t k = 0; k < out->count; k += PT_LANES)
            reaching |= (uint64_t)vm_bits(vi_eq(vi_and(vi_load(out->groups + k), bit), bit)) << k;
        out->reaching[group] = reaching;
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

// ---- a group -------------------------------------------------------------------------------------------------------------

struct pt_soft_group { // PT_LANES pixels of one
    vf x, y, from, to;
};

static inline struct pt_soft_group pt_soft_group_at(const struct pt_soft_tile *tile, uint32_t group, uint32_t vector)
{
    static const float x[16] = {0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3},
                       y[16] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};
    const uint32_t own = vector * PT_LANES, at = group * PT_SOFT_GROUP + own;
    return (struct pt_soft_group){vf_load(x + own) + vf_set((float)(group % PT_SOFT_ACROSS * PT_SOFT_WIDE)),
                                  vf_load(y + own) + vf_set((float)(group / PT_SOFT_ACROSS * PT_SOFT_TALL)),
                                  vf_load(tile->from + at), vf_load(tile->to + at)};
}

// Whether all of a group's pixels see all of the discs.
static inline int pt_soft_clear(const struct pt_soft_tile *tile, const struct pt_soft_discs *discs, uint32_t group)
{
    const vf first = vf_set(discs->z[0]), last = vf_set(discs->z[discs->count - 1]);
    vm clear = vm_first(PT_LANES);
    for (uint32_t v = 0; v < PT_SOFT_VECTORS; v++) {
        const struct pt_soft_group own = pt_soft_group_at(tile, group, v);
        clear = vm_and(clear, vm_and(vf_lt(own.from, first), vf_le(last, own.to)));
    }
    return vm_bits(clear) == PT_ALL;
}

// Which of the pixels disc k covers, and its q. clear: all of them see it.
PT_SOFT_INLINE vm pt_soft_covers(const struct pt_soft_discs *discs, uint32_t k, const struct pt_soft_group *own, int clear,
                                 vf *q)
{
    const vf dx = vf_set(discs->x[k]) - own->x, dy = vf_set(discs->y[k]) - own->y, z = vf_set(discs->z[k]);
    *q = vf_max((vf_set(discs->a[k]) * dx + vf_set(discs->b[k]) * dy) * dx + vf_set(discs->c[k]) * (dy * dy), vf_zero());
    const vm there = vf_lt(*q, vf_set(1.0f));
    return clear ? there : vm_and(there, vm_and(vf_lt(own->from, z), vf_le(z, own->to)));
}

// What the discs take of a group's light; whether it takes any more.
PT_SOFT_INLINE int pt_soft_add_discs(struct pt_soft_tile *tile, const struct pt_soft_discs *discs, uint32_t group, int counted,
                                     int plain, int clear, vf *fragments)
{
    const vf one = vf_set(1.0f), spent = vf_set(PT_SOFT_SPENT), last = vf_set(discs->z[discs->count - 1]);
    vm open = vm_of_bits(0);
    for (uint32_t v = 0; v < PT_SOFT_VECTORS; v++) {
        const uint32_t at = group * PT_SOFT_GROUP + v * PT_LANES;
        const struct pt_soft_group own = pt_soft_group_at(tile, group, v);
        vf through = vf_load(tile->through + at), density = vf_load(tile->density + at), many = *fragments;
        vf color[3] = {vf_load(tile->color[0] + at), vf_load(tile->color[1] + at), vf_load(tile->color[2] + at)};
        for (uint64_t left = discs->reaching[group]; left; left &= left - 1) {
            const uint32_t k = (uint32_t)__builtin_ctzll(left);
            vf q;
            const vm there = pt_soft_covers(discs, k, &own, clear, &q), some = vm_and(there, vf_le(spent, through));
            if (PT_LANES == 1 && !vm_bits(there))
                continue;
            const vf f = pt_soft_cosine(q), share = plain ? f : pt_soft_share_of(discs->weight[k], q, f);
            const vf part = vf_mul_where(some, through, share * vf_set(discs->opacity[k]));
            through = through - part;
            for (int c = 0; c < 3; c++)
                color[c] = color[c] + part * vf_set(discs->color[c][k]);
            if (counted) // whatever light is left
                density = density + vf_mul_where(there, vf_set(discs->density[k]), f);
            many = vf_add_where(some, many, one);
        }
        vf_store(tile->through + at, through);
        for (int c = 0; c < 3; c++)
            vf_store(tile->color[c] + at, color[c]);
        if (counted)
            vf_store(tile->density + at, density);
        *fragments = many;
        const vm before = vf_le(last, own.to);
        open = vm_or(open, counted ? before : vm_and(before, vf_le(spent, through)));
    }
    return vm_bits(open) != 0;
}

// Splats, One Layer: what of the discs belongs to the pixels' surfaces; whether any may go farther.
PT_SOFT_INLINE int pt_soft_add_splats(struct pt_soft_tile *tile, const struct pt_soft_discs *discs, uint32_t group, int counted,
                                      vf *fragments)
{
    const vf one = vf_set(1.0f), zero = vf_zero(), last = vf_set(discs->z[discs->count - 1]);
    vm open = vm_of_bits(0);
    for (uint32_t v = 0; v < PT_SOFT_VECTORS; v++) {
        const uint32_t at = group * PT_SOFT_GROUP + v * PT_LANES;
        const struct pt_soft_group own = pt_soft_group_at(tile, group, v);
        vf front = vf_load(tile->front + at), weight = vf_load(tile->weight + at), opacity = vf_load(tile->opacity + at),
           density = vf_load(tile->density + at), many = *fragments;
        vf color[3] = {vf_load(tile->color[0] + at), vf_load(tile->color[1] + at), vf_load(tile->color[2] + at)};
        for (uint64_t left = discs->reaching[group]; left; left &= left - 1) {
            const uint32_t k = (uint32_t)__builtin_ctzll(left);
            vf q;
            const vm there = pt_soft_covers(discs, k, &own, 0, &q), first = vm_not(vf_lt(zero, weight)),
                     some = vm_and(there, vm_or(first, vf_le(vf_set(discs->z[k]), front)));
            if (PT_LANES == 1 && !vm_bits(there))
                continue;
            const vf f = pt_soft_cosine(q), share = vf_select(some, f + vf_set(PT_SOFT_RIM), zero);
            front = vf_select(vm_and(some, first), vf_set(discs->end[k]), front);
            weight = weight + share;
            opacity = opacity + share * vf_set(discs->opacity[k]);
            for (int c = 0; c < 3; c++)
                color[c] = color[c] + share * vf_set(discs->color[c][k]);
            if (counted)
                density = density + vf_mul_where(there, vf_set(discs->density[k]), f);
            many = vf_add_where(some, many, one);
        }
        vf_store(tile->front + at, front);
        vf_store(tile->weight + at, weight);
        vf_store(tile->opacity + at, opacity);
        for (int c = 0; c < 3; c++)
            vf_store(tile->color[c] + at, color[c]);
        if (counted)
            vf_store(tile->density + at, density);
        *fragments = many;
        const vm before = vf_le(last, own.to);
        open = vm_or(open, counted ? before : vm_and(before, vm_not(vm_and(vf_lt(zero, weight), vf_lt(front, last)))));
    }
    return vm_bits(open) != 0;
}

// ---- a tile --------------------------------------------------------------------------------------------------------------

static inline uint32_t pt_soft_open_groups(const struct pt_soft_tile *tile)
{
    uint32_t open = 0;
    for (uint32_t at = 0; at < PT_SOFT_PIXELS; at += PT_LANES)
        open |= (uint32_t)(vm_bits(vf_lt(vf_load(tile->from + at), vf_load(tile->to + at))) != 0) << at / PT_SOFT_GROUP;
    return open;
}

static inline void pt_soft_draw_discs(struct pt_soft_tile *tile, struct pt_soft_order *order)
{
    const struct soft_args *args = tile->bins->args;
    const int counted = args->density != 0, splats = args->model != PT_SOFT_EXPRESS;
    uint32_t open = pt_soft_open_groups(tile);
    struct pt_soft_discs discs;
    for (uint32_t i = 0; i < order->count && open; i += PT_SOFT_TAKEN) {
        vf fragments = vf_zero();
        float lanes[PT_LANES];
        pt_soft_take(tile, order, i, open, &discs);
        for (uint32_t left = open; left; left &= left - 1) {
            const uint32_t group = (uint32_t)__builtin_ctz(left);
            int more = 1;
            if (!discs.reaching[group])
                continue;
            if (splats)
                more = counted ? pt_soft_add_splats(tile, &discs, group, 1, &fragments)
                               : pt_soft_add_splats(tile, &discs, group, 0, &fragments);
            else if (counted || !discs.plain)
                more = pt_soft_add_discs(tile, &discs, group, counted, 0, 0, &fragments);
            else if (pt_soft_clear(tile, &discs, group))
                more = pt_soft_add_discs(tile, &discs, group, 0, 1, 1, &fragments);
            else
                more = pt_soft_add_discs(tile, &discs, group, 0, 1, 0, &fragments);
            if (!more)
                open &= ~(1u << group);
        }
        vf_store(lanes, fragments);
        for (uint32_t k = 0; k < PT_LANES; k++)
            tile->fragments += (uint32_t)lanes[k];
    }
}

// Splats, One Layer: the mean of what a pixel's surface is made of.
static inline void pt_soft_mean(struct pt_soft_tile *tile)
{
    const uint32_t model = tile->bins->args->model;
    for (uint32_t i = 0; i < PT_SOFT_PIXELS; i++) {
        if (!(tile->weight[i] > 0.0f))
            continue;
        const float share = 1.0f / tile->weight[i];
        const float opacity = model == PT_SOFT_SPLATS ? 1.0f : tile->opacity[i] * share, scale = opacity * share;
        for (int k = 0; k < 3; k++)
            tile->color[k][i] = tile->color[k][i] * scale;
        tile->through[i] = 1.0f - opacity;
    }
}

static void pt_soft_tile_discs(struct pt_soft_tile *tile, struct pt_soft_order *order)
{
    if (tile->bins->args->model == PT_SOFT_EXPRESS) {
        pt_soft_draw_discs(tile, order);
        return;
    }
    memset(tile->front, 0, sizeof tile->front);
    memset(tile->weight, 0, sizeof tile->weight);
    memset(tile->opacity, 0, sizeof tile->opacity);
    pt_soft_draw_discs(tile, order);
    pt_soft_mean(tile);
}

#endif
