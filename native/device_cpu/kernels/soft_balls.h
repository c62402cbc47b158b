// SPDX-License-Identifier: GPL-3.0-or-later
// The Base and Concentric models: a pixel's balls, cut where any of them begins or ends, front to back.
#ifndef PT_SOFT_BALLS_H
#define PT_SOFT_BALLS_H

#include "soft_tile.h"

enum {
    PT_SOFT_NUMBERS = 10, // floats kept of a ball
    PT_SOFT_SUMS = 16     // the most lanes of any instruction set
};

// Of the balls that a pixel's ray meets; room for a list, and PT_LANES more.
struct pt_soft_hits {
    uint32_t count;
    float *d, *along, *inverse, *half; // d, half of the chord: in radii; inverse: 1 / radius
    float *depth, *weight, *color[3];  // depth: m lambda; weight: of the colour
    float *shells;
    uint32_t *record, *open;
    uint64_t *ends, *other; // order of the place << 32 | hit << 1 | 1 at its end
};

// log(1 + x) for x > -1.
static inline vf pt_soft_log1p(vf x)
{
    const vf one = vf_set(1.0f), u = one + x, moved = u - one;
    const vm some = vf_lt(vf_zero(), vf_abs(moved));
    const vf size = vf_select(some, vf_abs(moved), one), log = vf_abs(vf_log2(u)) * vf_set(0.69314718056f);
    const vf own = vf_abs(x) * (log * vf_rcp(size));
    return vf_select(some, vf_select(vf_lt(x, vf_zero()), vf_zero() - own, own), x);
}

// From low to high, 0 <= low <= high, of 1 - sqrt(t^2 + d^2): SPEC 5.
static inline vf pt_soft_side(vf square, vf low, vf high)
{
    const vf tiny = vf_set(1e-18f), one = vf_set(1.0f), half = vf_set(0.5f);
    const vf a = low * low + square, b = high * high + square;
    const vf root_a = a * vf_rsqrt(vf_max(a, vf_set(1e-36f))), root_b = b * vf_rsqrt(vf_max(b, vf_set(1e-36f)));
    const vf length = high - low, roots = root_a + root_b, sum = low + high, share = sum * vf_rcp(vf_max(roots, tiny));
    const vf log = pt_soft_log1p((length * (one + share)) * vf_rcp(vf_max(low + root_a, tiny)));
    return length * (one - half * (half * roots + half * (sum * share))) - half * (square * log);
}

static inline vf pt_soft_integral(vf d, vf from, vf to)
{
    const vf zero = vf_zero(), square = d * d;
    return pt_soft_side(square, vf_max(from, zero), vf_max(to, zero)) +
           pt_soft_side(square, vf_max(zero - to, zero), vf_max(zero - from, zero));
}

static inline vf pt_soft_shells(uint32_t mu, vf shells, vf d, vf from, vf to, vm some)
{
    const vf zero = vf_zero(), one = vf_set(1.0f), even = vf_rcp(vf_select(some, shells, one));
    const int most = (int)PT_SOFT_SHELLS > 256 ? (int)PT_SOFT_SHELLS : 256;
    vf sum = zero;
    for (int i = 0; i < most; i++) {
        const vf index = vf_set((float)i);
        const vm there = vm_and(some, vf_lt(index, shells));
        if (!vm_bits(there))
            break;
        const vf radius = vf_select(there, one - index * even, one), square = radius * radius - d * d;
        const vm met = vm_and(there, vf_lt(zero, square));
        const vf half = square * vf_rsqrt(vf_select(met, square, one));
        vf weight = even;
        if (mu != PT_SOFT_EVEN)
            weight = even * vf_rcp(radius);
        if (mu == PT_SOFT_EQ15)
            weight = weight * (one - d * vf_rcp(radius));
        sum = sum + vf_mul_where(met, weight, vf_max(vf_min(to, half) - vf_max(from, zero - half), zero));
    }
    vf center = vf_set(2.0f); // of whole balls at d = 0
    if (mu == PT_SOFT_EVEN)
        center = one + even;
    return sum * vf_rcp(center);
}

static inline vf pt_soft_depth(const struct soft_args *args, vf shells, vf d, vf from, vf to, vm some)
{
    return args->model == PT_SOFT_BASE ? pt_soft_integral(d, from, to) : pt_soft_shells(args->mu, shells, d, from, to, some);
}

// How many shells balls have; 1 or more.
static inline vf pt_soft_shell_count(const struct soft_args *args, vf z, vf r, vm some)
{
    const vf one = vf_set(1.0f);
    if (args->shells)
        return vf_set((float)args->shells);
    const vf pixels = r * vf_rcp(vf_select(some, vf_max(vf_footprint(&args->view, z), vf_set(1e-30f)), one));
    const vf wanted = vf_min(pixels * vf_set(1.0f / PT_SOFT_RING), vf_set(PT_SOFT_SHELLS)), whole = vf_floor(wanted);
    const vf shells = vf_max(vf_select(vf_lt(whole, wanted), whole + one, whole), one);
    return vf_select(vf_lt(vf_zero(), z), shells, vf_set(PT_SOFT_SHELLS));
}

// m lambda of balls: what their depth is multiplied by. half: of the chord; a, w: of the record.
static inline vf pt_soft_density(const struct soft_args *args, vf shells, vf d, vf half, vf a, vf w, vm some)
{
    const vf one = vf_set(1.0f), zero = vf_zero();
    const vf full = vf_min(a, vf_set(PT_SOFT_FULLEST)), lambda = zero - pt_soft_log1p(zero - full);
    vf factor = one;
    if (vm_bits(vm_and(some, vf_lt(w, one)))) { // [S Eq. 22]
        const vf whole = lambda * pt_soft_depth(args, shells, d, zero - half, half, some);
        const vf own = one - vf_exp2(vf_max(whole * vf_set(-1.44269504f), vf_set(-126.0f)));
        const vf opacity = (full * (one - d)) * (one - w) + own * w;
        const vm sure = vm_and(vf_lt(w, one), vf_lt(vf_set(1e-9f), whole));
        factor = vf_select(
            sure, (zero - pt_soft_log1p(zero - vf_min(opacity, vf_set(PT_SOFT_FULLEST)))) * vf_rcp(vf_select(sure, whole, one)),
            one);
    }
    return factor * lambda;
}

struct pt_soft_ray {
    float x, y, u, v, n, root; // x, y: pixel's centre
    float from, to;            // along it
};

// Which of a list's balls the ray meets.
static inline void pt_soft_meet(const struct pt_soft_tile *tile, const struct pt_soft_ray *ray, const uint32_t *list,
                                uint32_t count, struct pt_soft_hits *hits)
{
    const struct soft_args *args = tile->bins->args;
    const vf one = vf_set(1.0f), zero = vf_zero(), u = vf_set(ray->u), v = vf_set(ray->v);
    hits->count = 0;
    for (uint32_t i = 0; i < count; i += PT_LANES) {
        vm some = vm_first(pt_lanes_left(i, count));
        vf p[4];
        vf_gather4(tile->bins->points, vi_mul(vi_load(list + i), vi_set(2)), some, p);
        vf scale = one;
        if (args->view.perspective)
            scale = p[2];
        const vf ex = (p[0] - vf_set(ray->x) * scale) * vf_set(args->view.ray_xs),
                 ey = (p[1] - vf_set(ray->y) * scale) * vf_set(args->view.ray_ys);
        const vf across = ex * u + ey * v, inverse = vf_rcp(vf_select(some, p[3], one));
        const vf square = vf_max(((ex * ex + ey * ey) - (across * across) * vf_set(1.0f / ray->n)) * (inverse * inverse), zero);
        const vf along = (p[2] * vf_set(ray->n) + across) * vf_set(1.0f / ray->root), left = one - square;
        some = vm_and(some, vf_lt(vf_zero(), left));
        const vf half = left * vf_rsqrt(vf_select(some, left, one));
        some = vm_and(some, vm_and(vf_lt(vf_set(ray->from), along + half * p[3]), vf_lt(along - half * p[3], vf_set(ray->to))));
        const uint32_t lanes = vm_bits(some);
        if (!lanes)
            continue;
        const vf d = square * vf_rsqrt(vf_max(square, vf_set(1e-30f)));
        const vf shells = pt_soft_shell_count(args, p[2], p[3], some);
        const uint32_t at = hits->count;
        vi_pack((uint32_t *)(void *)(hits->d + at), vf_bits(d), lanes);
        vi_pack((uint32_t *)(void *)(hits->along + at), vf_bits(along), lanes);
        vi_pack((uint32_t *)(void *)(hits->inverse + at), vf_bits(inverse), lanes);
        vi_pack((uint32_t *)(void *)(hits->half + at), vf_bits(half), lanes);
        vi_pack((uint32_t *)(void *)(hits->shells + at), vf_bits(shells), lanes);
        vi_pack(hits->record + at, vi_load(list + i), lanes);
        hits->count += (uint32_t)__builtin_popcount(lanes);
    }
}

// What they lose and look like; returns the density along the ray.
static inline float pt_soft_weigh(const struct pt_soft_tile *tile, const struct pt_soft_ray *ray, struct pt_soft_hits *hits)
{
    const struct soft_args *args = tile->bins->args;
    const vf one = vf_set(1.0f), zero = vf_zero();
    float density = 0.0f;
    for (uint32_t i = 0; i < hits->count; i += PT_LANES) {
        const vm some = vm_first(pt_lanes_left(i, hits->count));
        vf look[4], sums;
        float lanes[PT_LANES];
        vf_gather4(tile->bins->points, vi_add(vi_mul(vi_load(hits->record + i), vi_set(2)), vi_set(1)), some, look);
        const vf d = vf_select(some, vf_load(hits->d + i), zero), half = vf_select(some, vf_load(hits->half + i), one);
        const vf inverse = vf_select(some, vf_load(hits->inverse + i), one),
                 along = vf_select(some, vf_load(hits->along + i), zero);
        const vf shells = vf_select(some, vf_load(hits->shells + i), one);
        const vi word = vf_bits(vf_select(some, look[3], zero));
        const vf a = vi_convert(vi_shr(word, PT_SOFT_SHIFT)) * vf_set(1.0f / PT_SOFT_STEPS),
                 w = vi_convert(vi_and(word, vi_set(255))) * vf_set(1.0f / 255.0f);
        vf_store(hits->depth + i, pt_soft_density(args, shells, d, half, a, w, some));
        vf_store(hits->weight + i, (one - d) * a);
        for (int k = 0; k < 3; k++)
            vf_store(hits->color[k] + i, vf_select(some, look[k], zero));
        if (!args->density)
            continue;
        const vf begin = vf_max((vf_set(ray->from) - along) * inverse, zero - half),
                 end = vf_min((vf_set(ray->to) - along) * inverse, half);
        sums = vf_mul_where(some, (inverse * inverse) * vf_set(PT_SOFT_BALL), pt_soft_integral(d, begin, vf_max(begin, end)));
        vf_store(lanes, sums);
        for (uint32_t k = 0; k < PT_LANES; k++)
            density += lanes[k];
    }
    return density;
}

static inline void pt_soft_sort_ends(struct pt_soft_hits *hits, uint32_t count)
{
    for (uint32_t begin = 0; begin < count; begin += 16) // runs
        for (uint32_t i = begin + 1; i < count && i < begin + 16; i++) {
            const uint64_t own = hits->ends[i];
            uint32_t k = i;
            for (; k > begin && hits->ends[k - 1] > own; k--)
                hits->ends[k] = hits->ends[k - 1];
            hits->ends[k] = own;
        }
    for (uint32_t run = 16; run < count; run *= 2) {
        for (uint32_t begin = 0; begin < count; begin += 2 * run) {
            const uint32_t middle = begin + run < count ? begin + run : count,
                           end = begin + 2 * run < count ? begin + 2 * run : count;
            for (uint32_t a = begin, b = middle, to = begin; to < end; to++)
                hits->other[to] = b == end || (a < middle && hits->ends[a] <= hits->ends[b]) ? hits->ends[a++]
                                                                                             : hits->ends[b++];
        }
        uint64_t *swap = hits->ends;
        hits->ends = hits->other;
        hits->other = swap;
    }
}

static inline float pt_soft_place(uint64_t end)
{
    const uint32_t order = (uint32_t)(end >> 32);
    return pt_float(order >> 31 ? order & 0x7FFFFFFFu : ~order);
}

// What the open balls lose between two places, and the mean of their colours.
static inline float pt_soft_piece(const struct pt_soft_tile *tile, const struct pt_soft_hits *hits, uint32_t open, float from,
                                  float to, float color[3])
{
    const vf zero = vf_zero(), one = vf_set(1.0f);
    vf sums[PT_SOFT_SUMS / PT_LANES][5]; // of every 16th hit, however many lanes there are: each level adds in the same order
    float totals[5] = {0.0f};
    for (int at = 0; at < PT_SOFT_SUMS / PT_LANES; at++)
        for (int k = 0; k < 5; k++)
            sums[at][k] = zero;
    for (uint32_t i = 0; i < open; i += PT_LANES) {
        const vm some = vm_first(pt_lanes_left(i, open));
        const vi hit = vi_load(hits->open + i);
        const vf half = vf_gather(hits->half, hit, some), inverse = vf_gather(hits->inverse, hit, some),
                 along = vf_gather(hits->along, hit, some);
        const vf begin = vf_max((vf_set(from) - along) * inverse, zero - half),
                 end = vf_max(vf_min((vf_set(to) - along) * inverse, half), begin);
        const vf shells = vf_select(some, vf_gather(hits->shells, hit, some), one), weight = vf_gather(hits->weight, hit, some);
        const vf depth = pt_soft_depth(tile->bins->args, shells, vf_gather(hits->d, hit, some), begin, end, some);
        vf *sum = sums[i / PT_LANES % (PT_SOFT_SUMS / PT_LANES)];
        sum[0] = sum[0] + vf_mul_where(some, vf_gather(hits->depth, hit, some), depth);
        sum[1] = sum[1] + vf_mul_where(some, weight, one);
        for (int k = 0; k < 3; k++)
            sum[2 + k] = sum[2 + k] + vf_mul_where(some, weight, vf_gather(hits->color[k], hit, some));
    }
    for (int at = 0; at < PT_SOFT_SUMS / PT_LANES; at++)
        for (int k = 0; k < 5; k++) {
            float lanes[PT_LANES];
            vf_store(lanes, sums[at][k]);
            for (uint32_t i = 0; i < PT_LANES; i++)
                totals[k] += lanes[i];
        }
    for (int k = 0; k < 3; k++)
        color[k] = totals[1] > 0.0f ? totals[2 + k] / totals[1] : 0.0f;
    return totals[0];
}

static inline float pt_soft_left(double lost)
{
    float lanes[PT_LANES];
    vf_store(lanes, vf_exp2(vf_max(vf_set((float)(lost * -1.4426950408889634)), vf_set(-126.0f))));
    return lost > 0.0 ? lanes[0] : 1.0f;
}

static inline void pt_soft_pixel(struct pt_soft_tile *tile, const struct pt_soft_ray *ray, struct pt_soft_hits *hits,
                                 uint32_t at)
{
    uint32_t count = 0, open = 0;
    double lost = 0.0;
    float through = 1.0f, before = 0.0f;
    for (uint32_t i = 0; i < hits->count; i++) {
        const float reach = hits->half[i] / hits->inverse[i];
        const float begin = pt_max(hits->along[i] - reach, ray->from), end = pt_min(hits->along[i] + reach, ray->to);
        hits->ends[count++] = (uint64_t)pt_soft_order(begin) << 32 | 2 * i;
        hits->ends[count++] = (uint64_t)pt_soft_order(pt_max(begin, end)) << 32 | (2 * i + 1);
    }
    pt_soft_sort_ends(hits, count);
    for (uint32_t k = 0; k < count && through >= PT_SOFT_SPENT; k++) {
        const float place = pt_soft_place(hits->ends[k]);
        const uint32_t hit = (uint32_t)hits->ends[k] >> 1;
        if (open && before < place) {
            float color[3];
            lost += (double)pt_soft_piece(tile, hits, open, before, place, color);
            const float left = pt_min(pt_soft_left(lost), through);
            for (int c = 0; c < 3; c++)
                tile->color[c][at] += (through - left) * color[c];
            through = left;
        }
        before = place;
        if (!(hits->ends[k] & 1u)) {
            hits->open[open++] = hit;
            continue;
        }
        uint32_t i = 0;
        while (i < open && hits->open[i] != hit)
            i++;
        if (i < open) // the order of those that stay is that of their beginnings
            memmove(hits->open + i, hits->open + i + 1, (--open - i) * sizeof *hits->open);
    }
    tile->through[at] = through;
}

static void pt_soft_lay_out(struct pt_soft_hits *hits, char *memory, uint32_t room)
{
    float **const floats[PT_SOFT_NUMBERS] = {&hits->d,      &hits->along,    &hits->inverse,  &hits->half,     &hits->depth,
                                             &hits->weight, &hits->color[0], &hits->color[1], &hits->color[2], &hits->shells};
    for (uint32_t k = 0; k < PT_SOFT_NUMBERS; k++)
        *floats[k] = (float *)(void *)(memory + 4 * (size_t)room * k);
    hits->record = (uint32_t *)(void *)(memory + 4 * (size_t)room * PT_SOFT_NUMBERS);
    hits->open = hits->record + room;
    hits->ends = (uint64_t *)(void *)(hits->open + room);
    hits->other = hits->ends + 2 * (size_t)room;
}

// Bytes for a list of `room`, a multiple of 16.
static inline size_t pt_soft_hit_bytes(uint32_t room)
{
    return (size_t)room * (4 * (PT_SOFT_NUMBERS + 2) + 4 * sizeof(uint64_t));
}

static void pt_soft_balls(struct pt_soft_tile *tile, const uint32_t *list, uint32_t count, char *memory, uint32_t room)
{
    const struct view_args *view = &tile->bins->args->view;
    struct pt_soft_hits hits;
    pt_soft_lay_out(&hits, memory, room);
    for (uint32_t y = 0; y < tile->height; y++)
        for (uint32_t x = 0; x < tile->width; x++) {
            const uint32_t at = pt_soft_at(x, y);
            struct pt_soft_ray ray = {.x = (float)(view->origin_x + tile->x + (int32_t)x) + 0.5f,
                                      .y = (float)(view->origin_y + tile->y + (int32_t)y) + 0.5f,
                                      .n = 1.0f,
                                      .root = 1.0f};
            if (view->perspective) {
                ray.u = view->ray_x0 + view->ray_xs * ray.x;
                ray.v = view->ray_y0 + view->ray_ys * ray.y;
                ray.n = (ray.u * ray.u + ray.v * ray.v) + 1.0f;
                ray.root = __builtin_sqrtf(ray.n);
            }
            ray.from = pt_max(tile->from[at], view->z_near) * ray.root;
            ray.to = tile->to[at] * ray.root;
            if (!(ray.from < ray.to))
                continue;
            pt_soft_meet(tile, &ray, list, count, &hits);
            tile->fragments += hits.count;
            tile->density[at] = pt_soft_weigh(tile, &ray, &hits);
            pt_soft_pixel(tile, &ray, &hits, at);
        }
}

#endif
