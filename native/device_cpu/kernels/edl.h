// SPDX-License-Identifier: GPL-3.0-or-later
// Eye-dome lighting over rows of f(z) in a ring: a logarithm a pixel, and every neighbour is a plain load.
#ifndef PT_EDL_H
#define PT_EDL_H

#include "device_cpu/picture_rows.h"
#include "shared/effects.h"

// Row y of the plane.
static inline void pt_edl_load_row(const struct view_args *view, const uint64_t *keys, int32_t y, float *row)
{
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z)), beyond = vf_set(PT_EDL_BEYOND);
    const uint32_t inside = y < 0 || y >= (int32_t)view->height ? 0 : view->width;
    keys += (ptrdiff_t)y * view->width;
    for (int32_t x = -PT_ROW_PAD; x < 0; x += PT_LANES)
        vf_store(row + x, beyond);
    for (uint32_t x = 0; x < inside; x += PT_LANES) {
        vf z = vi_float(vi_load_z(keys + x));
        vm some = vf_lt(z, empty);
        vf depth = vf_set(PT_EDL_EMPTY);
        if (vm_bits(some))
            depth = vf_select(some, view->perspective ? vf_log2(vf_select(some, z, vf_set(1.0f))) : z, depth);
        vf_store(row + x, depth);
    }
    for (uint32_t x = inside; x < view->width + PT_ROW_PAD; x++)
        row[x] = PT_EDL_BEYOND;
}

// A ring of 2 reach + 1 rows.
struct pt_edl_ring {
    float *rows;
    size_t stride;
    uint32_t count;
};

static inline float *pt_edl_row(const struct pt_edl_ring *ring, int32_t y)
{
    const uint32_t slot = (uint32_t)(y + (int32_t)ring->count) % ring->count;
    return ring->rows + slot * ring->stride + PT_ROW_PAD;
}

// Neighbours' rows, at the offset.
static inline void pt_edl_near(const struct edl_args *args, const struct pt_edl_ring *ring, int32_t y,
                               const float *near[PT_EDL_NEIGHBOURS])
{
    for (int i = 0; i < PT_EDL_NEIGHBOURS; i++)
        near[i] = pt_edl_row(ring, y + args->offsets[2 * i + 1]) + args->offsets[2 * i];
}

// What the colours of PT_LANES pixels from x on are multiplied with.
static inline vf pt_edl_light(const struct edl_args *args, const float *const near[PT_EDL_NEIGHBOURS], vf depth, uint32_t x)
{
    const vf scale = vf_set(args->scale), zero = vf_zero(), most = vf_set(PT_EDL_STEP);
    vf sum = zero;
    for (int i = 0; i < PT_EDL_NEIGHBOURS; i++)
        sum = sum + vf_min(vf_max(scale * (depth - vf_load(near[i] + x)), zero), most);
    return vf_exp2(zero - vf_set(args->gain) * sum);
}

#endif
