// SPDX-License-Identifier: GPL-3.0-or-later
// Normals of filled pixels: blended over a window of what its pixels show (SPEC 2.2, refined; shared/colors.h). Twin of
// shaders/kernels/shade.comp.
//
// The four pixels at (+-dx, +-dy) weigh the same: they are summed first, columns before rows, and the order is the same where
// layers are told apart and where all is one layer; there, rows are paired once, and a pixel takes a quarter of the work.
#ifndef PT_BLEND_NORMALS_H
#define PT_BLEND_NORMALS_H

#include "device_cpu/picture_rows.h"
#include "shared/colors.h"

enum {
    PT_BLEND_MOST = 8, // radius
    PT_BLEND_PAD = PT_LANES > PT_BLEND_MOST ? PT_LANES : PT_BLEND_MOST,
    PT_BLEND_COLUMNS = 128, // that the first-level cache holds all rows of
    PT_BLEND_ROW = PT_BLEND_COLUMNS + 2 * PT_BLEND_PAD,
};

struct pt_blend { // of the pixels of a row
    const struct view_args *view;
    int most;                                // radius of their windows
    const float *weights;                    // by squared distance
    const struct pt_seen_row *const *around; // rows from `most` below on
};

// Radius of a pixel's window, of a wide blend: shared/colors.h.
static inline vf pt_blend_reach(const struct pt_blend *blend, vf z, vf limit)
{
    vf spacings = limit * vf_rcp(vf_footprint(blend->view, z));
    vf reach = vf_floor(spacings * vf_set(1.0f / PT_SPACING_FACTOR) + vf_set(0.5f));
    return vf_max(vf_min(reach, vf_set((float)blend->most)), vf_set(1.0f));
}

static inline void pt_blend_weights(float weights[2 * PT_BLEND_MOST * PT_BLEND_MOST + 1])
{
    for (int i = 0; i <= 2 * PT_BLEND_MOST * PT_BLEND_MOST; i++)
        weights[i] = pt_rcp((float)(1 + i));
}

static inline struct pt_nine pt_blend_nine(const float *weights)
{
    return (struct pt_nine){weights[0], weights[1], weights[2]};
}

// Which pixels of PT_LANES, at x, are of the layer.
static inline vm pt_blend_takes(const struct pt_seen_row *row, int32_t x, vf z, vf limit, vm within)
{
    return vm_and(within, vf_le(vf_abs(vf_load(row->z + x) - z), limit));
}

static inline void pt_blend_nine_sum(const struct pt_blend *blend, uint32_t x, vf limit, vm filled, vf sum[3])
{
    const struct pt_seen_row *const *rows = blend->around;
    const float *const depths[3] = {rows[0]->z + x, rows[1]->z + x, rows[2]->z + x};
    const struct pt_nine nine = pt_blend_nine(blend->weights);
    vm same[3][3];
    pt_same_layer(depths, limit, filled, same);
    for (int k = 0; k < 3; k++) {
        const float *const normals[3] = {rows[0]->normal[k] + x, rows[1]->normal[k] + x, rows[2]->normal[k] + x};
        sum[k] = pt_nine_pixels(&nine, normals, same);
    }
}

// Sums of the normals of the pixels around those of PT_LANES pixels from x on that `filled` names, as far as they are of their
// layer.
static inline void pt_blend_sum(const struct pt_blend *blend, uint32_t x, vm filled, vf sum[3])
{
    const struct pt_seen_row *const *own = blend->around + blend->most;
    const vf z = vf_load(own[0]->z + x), limit = vf_load(own[0]->limit + x), zero = vf_zero();
    if (blend->most == 1) {
        pt_blend_nine_sum(blend, x, limit, filled, sum);
        return;
    }
    const vf reach = pt_blend_reach(blend, z, limit);
    const int most = vf_greatest(reach, filled, blend->most);
    sum[0] = sum[1] = sum[2] = zero;
    for (int dy = 0; dy <= most; dy++)
        for (int dx = 0; dx <= most; dx++) {
            const struct pt_seen_row *below = own[-dy], *above = own[dy];
            const int32_t west = (int32_t)x - dx, east = (int32_t)x + dx;
            const vf weight = vf_set(blend->weights[dx * dx + dy * dy]);
            const vm none = vm_of_bits(0), within = vm_and(filled, vf_le(vf_set((float)(dx > dy ? dx : dy)), reach));
            vm low = pt_blend_takes(below, west, z, limit, within), high = none, low_east = none, high_east = none;
            if (dy)
                high = pt_blend_takes(above, west, z, limit, within);
            if (dx)
                low_east = pt_blend_takes(below, east, z, limit, within);
            if (dx && dy)
                high_east = pt_blend_takes(above, east, z, limit, within);
            for (int k = 0; k < 3; k++) {
                vf column = vf_select(low, vf_load(below->normal[k] + west), zero), other = zero;
                if (dy)
                    column = column + vf_select(high, vf_load(above->normal[k] + west), zero);
                if (dx)
                    other = vf_select(low_east, vf_load(below->normal[k] + east), zero);
                if (dx && dy)
                    other = other + vf_select(high_east, vf_load(above->normal[k] + east), zero);
                sum[k] = sum[k] + (column + other) * weight;
            }
        }
}

// ---- where the window tells no layers apart ------------------------------------------------------------------------------

// The radius that PT_LANES pixels share, 0 where they do not.
static inline int pt_blend_shared_reach(const struct pt_blend *blend, int32_t x)
{
    const struct pt_seen_row *own = blend->around[blend->most];
    const vf reach = pt_blend_reach(blend, vf_load(own->z + x), vf_load(own->limit + x));
    const int most = vf_greatest(reach, vm_first(PT_LANES), blend->most);
    return vm_bits(vf_le(vf_set((float)most), reach)) == PT_ALL ? most : 0;
}

// flat: the radius of vectors from x to end where all around each pixel is of its layer, else 0. Returns the greatest.
static inline int pt_blend_find_flat(const struct pt_blend *blend, int32_t x, int32_t end, uint8_t *flat)
{
    const struct pt_seen_row *const *own = blend->around + blend->most;
    float near[PT_BLEND_ROW], far[PT_BLEND_ROW];
    int most = 0, flat_most = 0;
    for (int32_t i = x; i < end; i += PT_LANES) {
        flat[i / PT_LANES] = (uint8_t)pt_blend_shared_reach(blend, i);
        most = flat[i / PT_LANES] > most ? flat[i / PT_LANES] : most;
    }
    for (int32_t i = -PT_BLEND_PAD; most && i < end - x + PT_BLEND_PAD; i += PT_LANES) {
        vf low = vf_load(own[0]->z + x + i), high = low;
        for (int k = 1; k <= most; k++) {
            vf below = vf_load(own[-k]->z + x + i), above = vf_load(own[k]->z + x + i);
            low = vf_min(vf_min(low, below), above);
            high = vf_max(vf_max(high, below), above);
        }
        vf_store(near + PT_BLEND_PAD + i, low);
        vf_store(far + PT_BLEND_PAD + i, high);
    }
    for (int32_t i = x; i < end; i += PT_LANES) {
        const int reach = flat[i / PT_LANES];
        const float *lows = near + PT_BLEND_PAD + (i - x), *highs = far + PT_BLEND_PAD + (i - x);
        if (!reach)
            continue;
        vf low = vf_load(lows), high = vf_load(highs), z = vf_load(own[0]->z + i), limit = vf_load(own[0]->limit + i);
        for (int k = 1; k <= reach; k++) {
            low = vf_min(vf_min(low, vf_load(lows - k)), vf_load(lows + k));
            high = vf_max(vf_max(high, vf_load(highs - k)), vf_load(highs + k));
        }
        if (vm_bits(vm_and(vf_le(high - z, limit), vf_le(z - low, limit))) != PT_ALL)
            flat[i / PT_LANES] = 0;
        flat_most = flat[i / PT_LANES] > flat_most ? flat[i / PT_LANES] : flat_most;
    }
    return flat_most;
}

// The sums of pt_blend_sum from x to end, at most PT_BLEND_COLUMNS, wherever they are whole windows'; flat says where.
static inline void pt_blend_flat(const struct pt_blend *blend, int32_t x, int32_t end, uint8_t *flat, float *const sums[3])
{
    const struct pt_seen_row *const *own = blend->around + blend->most;
    float pairs[PT_BLEND_MOST + 1][3][PT_BLEND_ROW]; // of rows dy below and above, sums
    const int most = pt_blend_find_flat(blend, x, end, flat);
    for (int dy = 0; most && dy <= most; dy++)
        for (int k = 0; k < 3; k++) {
            const float *below = own[-dy]->normal[k] + x, *above = own[dy]->normal[k] + x;
            float *out = pairs[dy][k] + PT_BLEND_PAD;
            for (int32_t i = -PT_BLEND_PAD; i < end - x + PT_BLEND_PAD; i += PT_LANES) {
                vf pair = vf_load(below + i);
                if (dy)
                    pair = pair + vf_load(above + i);
                vf_store(out + i, pair);
            }
        }
    for (int32_t i = 0; i < end - x; i += PT_LANES) {
        const int reach = flat[(x + i) / PT_LANES];
        vf sum[3] = {vf_zero(), vf_zero(), vf_zero()};
        if (!reach)
            continue;
        for (int dy = 0; dy <= reach; dy++) {
            const float *const rows[3] = {pairs[dy][0] + PT_BLEND_PAD + i, pairs[dy][1] + PT_BLEND_PAD + i,
                                          pairs[dy][2] + PT_BLEND_PAD + i};
            for (int k = 0; k < 3; k++)
                sum[k] = sum[k] + vf_load(rows[k]) * vf_set(blend->weights[dy * dy]);
            for (int dx = 1; dx <= reach; dx++) {
                const vf weight = vf_set(blend->weights[dx * dx + dy * dy]);
                for (int k = 0; k < 3; k++)
                    sum[k] = sum[k] + (vf_load(rows[k] - dx) + vf_load(rows[k] + dx)) * weight;
            }
        }
        for (int k = 0; k < 3; k++)
            vf_store(sums[k] + x + i, sum[k]);
    }
}

// Normals of pixels that `filled` names: their sums as units; the others keep n.
static inline void pt_blend_normals(const vf sum[3], vm filled, vf n[3])
{
    vf square = (sum[0] * sum[0] + sum[1] * sum[1]) + sum[2] * sum[2];
    vm blended = vf_lt(vf_set(1e-12f), square);
    vf scale = vf_rsqrt(vf_select(blended, square, vf_set(1.0f)));
    for (int k = 0; k < 3; k++) {
        vf whole = n[k] * vf_set(1.0f / PT_BLEND_FILLED); // where the blend is nothing, the source's own
        n[k] = vf_select(filled, vf_select(blended, sum[k] * scale, whole), n[k]);
    }
}

#endif
