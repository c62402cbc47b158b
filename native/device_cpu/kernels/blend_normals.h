// SPDX-License-Identifier: GPL-3.0-or-later
// Normals of filled pixels: blended over a window of what its pixels show (SPEC 2.2, refined; kernel_args.h). Twin of
// shaders/kernels/shade.comp.
//
// The four pixels at (+-dx, +-dy) weigh the same: they are summed first, columns before rows, and the order is the same where
// layers are told apart and where all is one layer; there, rows are paired once, and a pixel takes a quarter of the work.
#ifndef PT_BLEND_NORMALS_H
#define PT_BLEND_NORMALS_H

#include "device_cpu/picture_rows.h"

enum {
    PT_BLEND_MOST = 8,                                             // radius
    PT_BLEND_PAD = PT_LANES > PT_BLEND_MOST ? PT_LANES : PT_BLEND_MOST,
    PT_BLEND_AT_ONCE = 4,                                          // vectors, so that sums need not wait for each other
    PT_BLEND_COLUMNS = PT_LANES > 8 ? 192 : 128,                   // that the first-level cache holds all rows of
    PT_BLEND_ROW = PT_BLEND_COLUMNS + 2 * PT_BLEND_PAD,
};

// Weights of the blend by squared distance.
static inline void pt_blend_weights(float weights[2 * PT_BLEND_MOST * PT_BLEND_MOST + 1])
{
    for (int i = 0; i <= 2 * PT_BLEND_MOST * PT_BLEND_MOST; i++)
        weights[i] = pt_rcp((float)(1 + i));
}

static inline struct pt_nine pt_blend_nine(const float *weights) { return (struct pt_nine){ weights[0], weights[1], weights[2] }; }

// Of the rows dy below and above: which of the pixels dx to the side are of the layer.
static inline vm pt_blend_takes(const struct pt_seen_row *row, int32_t x, vf z, vf limit, vm filled)
{
    return vm_and(filled, vf_le(vf_abs(vf_load(row->z + x) - z), limit));
}

// Sums of the normals of (2 reach + 1)^2 pixels around those of PT_LANES pixels from x on that `filled` names, as far as they
// are of their layer. around[reach]: the pixels' own row.
static inline void pt_blend_sum(const struct pt_seen_row *const *around, int reach, const float *weights, uint32_t x, vm filled,
                                vf sum[3])
{
    const vf z = vf_load(around[reach]->z + x), limit = vf_load(around[reach]->limit + x), zero = vf_zero();
    if (reach == 1) {
        const float *const depths[3] = { around[0]->z + x, around[1]->z + x, around[2]->z + x };
        const struct pt_nine nine = pt_blend_nine(weights);
        vm same[3][3];
        pt_same_layer(depths, limit, filled, same);
        for (int k = 0; k < 3; k++) {
            const float *const rows[3] = { around[0]->normal[k] + x, around[1]->normal[k] + x, around[2]->normal[k] + x };
            sum[k] = pt_nine_pixels(&nine, rows, same);
        }
        return;
    }
    sum[0] = sum[1] = sum[2] = zero;
    for (int dy = 0; dy <= reach; dy++)
        for (int dx = 0; dx <= reach; dx++) {
            const struct pt_seen_row *below = around[reach - dy], *above = around[reach + dy];
            const int32_t west = (int32_t)x - dx, east = (int32_t)x + dx;
            const vf weight = vf_set(weights[dx * dx + dy * dy]);
            const vm none = vm_of_bits(0);
            vm low = pt_blend_takes(below, west, z, limit, filled), high = none, low_east = none, high_east = none;
            if (dy)
                high = pt_blend_takes(above, west, z, limit, filled);
            if (dx)
                low_east = pt_blend_takes(below, east, z, limit, filled);
            if (dx && dy)
                high_east = pt_blend_takes(above, east, z, limit, filled);
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

// Which of the vectors from x to end the window tells no layers apart in: all around each of their pixels is of its layer.
static inline int pt_blend_find_flat(const struct pt_seen_row *const *around, int reach, int32_t x, int32_t end, uint8_t *flat)
{
    float near[PT_BLEND_ROW], far[PT_BLEND_ROW];
    int some = 0;
    for (int32_t i = x - PT_BLEND_PAD; i < end + PT_BLEND_PAD; i += PT_LANES) {
        vf low = vf_load(around[0]->z + i), high = low;
        for (int k = 1; k <= 2 * reach; k++) {
            vf z = vf_load(around[k]->z + i);
            low = vf_min(low, z);
            high = vf_max(high, z);
        }
        vf_store(near + (i - x + PT_BLEND_PAD), low);
        vf_store(far + (i - x + PT_BLEND_PAD), high);
    }
    for (int32_t i = x; i < end; i += PT_LANES) {
        const float *first = near + (i - x + PT_BLEND_PAD - reach), *last = far + (i - x + PT_BLEND_PAD - reach);
        vf low = vf_load(first), high = vf_load(last);
        for (int k = 1; k <= 2 * reach; k++) {
            low = vf_min(low, vf_load(first + k));
            high = vf_max(high, vf_load(last + k));
        }
        vf z = vf_load(around[reach]->z + i), limit = vf_load(around[reach]->limit + i);
        flat[i / PT_LANES] = vm_bits(vm_and(vf_le(high - z, limit), vf_le(z - low, limit))) == PT_ALL;
        some |= flat[i / PT_LANES];
    }
    return some;
}

// The sums of pt_blend_sum from x to end, at most PT_BLEND_COLUMNS, wherever flat[] says that they are whole windows'.
static inline void pt_blend_flat(const struct pt_seen_row *const *around, int reach, const float *weights, int32_t x,
                                 int32_t end, uint8_t *flat, float *const sums[3])
{
    enum { STEP = PT_BLEND_AT_ONCE * PT_LANES };
    float pairs[PT_BLEND_MOST + 1][PT_BLEND_ROW];
    if (!pt_blend_find_flat(around, reach, x, end, flat))
        return;
    for (int k = 0; k < 3; k++) {
        for (int32_t i = -PT_BLEND_PAD; i < end - x + PT_BLEND_PAD; i += PT_LANES)
            vf_store(pairs[0] + PT_BLEND_PAD + i, vf_load(around[reach]->normal[k] + x + i));
        for (int dy = 1; dy <= reach; dy++) {
            const float *below = around[reach - dy]->normal[k] + x, *above = around[reach + dy]->normal[k] + x;
            for (int32_t i = -PT_BLEND_PAD; i < end - x + PT_BLEND_PAD; i += PT_LANES)
                vf_store(pairs[dy] + PT_BLEND_PAD + i, vf_load(below + i) + vf_load(above + i));
        }
        for (int32_t first = 0; first < end - x; first += STEP) {
            vf sum[PT_BLEND_AT_ONCE];
            for (int i = 0; i < PT_BLEND_AT_ONCE; i++)
                sum[i] = vf_zero();
            for (int dy = 0; dy <= reach; dy++) {
                const float *row = pairs[dy] + PT_BLEND_PAD + first;
                const vf own = vf_set(weights[dy * dy]);
                for (int i = 0; i < PT_BLEND_AT_ONCE; i++)
                    sum[i] = sum[i] + vf_load(row + i * PT_LANES) * own;
                for (int dx = 1; dx <= reach; dx++) {
                    const vf weight = vf_set(weights[dx * dx + dy * dy]);
                    for (int i = 0; i < PT_BLEND_AT_ONCE; i++)
                        sum[i] = sum[i] + (vf_load(row + i * PT_LANES - dx) + vf_load(row + i * PT_LANES + dx)) * weight;
                }
            }
            for (int32_t i = 0; i < PT_BLEND_AT_ONCE && first + i * PT_LANES < end - x; i++)
                vf_store(sums[k] + x + first + i * PT_LANES, sum[i]);
        }
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
