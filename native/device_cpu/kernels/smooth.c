// SPDX-License-Identifier: GPL-3.0-or-later
// smooth: 3 x 3 low-pass over the neighbours of the same layer. [D 3.4, Table 1]; twin of shaders/kernels/smooth.comp
//
// A ring of three rows holds z and colour as separate vectors, so that each of the nine taps is a plain load: 3.4 times
// faster than gathering float4 pixels.
#include "device_cpu/rows.h"

enum { BAND_ROWS = 32 }; // the ring's channels: z, r, g, b

struct smooth {
    const struct pt_cpu_call *call;
    const struct smooth_args *args;
    float *rows;   // per thread: a ring of 3 rows
    size_t stride; // floats of one channel of a row
};

// The rectangle's columns and one more on both sides; beyond the plane z is +inf.
static void load_row(const struct smooth *smooth, float *rows, uint32_t slot, int32_t y)
{
    const struct view_args *view = &smooth->args->view;
    const float empty = pt_float(PT_KEY_EMPTY_Z);
    float *out[PT_RING_CHANNELS];
    uint32_t first = view->rect[0], last = view->rect[2];
    for (uint32_t k = 0; k < PT_RING_CHANNELS; k++)
        out[k] = pt_ring_channel(rows, smooth->stride, slot, k);
    if (y < (int32_t)view->rect[1] || y >= (int32_t)view->rect[3]) { // nothing outside the rectangle
        for (uint32_t i = 0; i < last - first + 2 * PT_RING_PAD; i++)
            out[0][(int32_t)i - PT_RING_PAD] = empty;
        return;
    }
    const uint64_t *keys = (const uint64_t *)pt_cpu_data(smooth->call, 0) + (size_t)y * view->width;
    const float *colors = (const float *)pt_cpu_data(smooth->call, 3) + 4 * (size_t)y * view->width;
    for (uint32_t x = first; x < last; x += PT_LANES) {
        vf z = vi_float(vi_load_z(keys + x)), rgb[4];
        vf_store(out[0] + (x - first), z, vm_first(PT_LANES));
        if (!vm_bits(vf_lt(z, vf_set(empty))))
            continue;
        vf_load4(colors + 4 * (size_t)x, rgb);
        for (uint32_t k = 0; k < 3; k++)
            vf_store(out[1 + k] + (x - first), rgb[k], vm_first(PT_LANES));
    }
    for (uint32_t i = 0; i < PT_RING_PAD; i++)
        out[0][-1 - (int32_t)i] = out[0][last - first + i] = empty;
}

static void smooth_pixels(const struct smooth *smooth, float *const around[3], uint32_t x, uint32_t y, uint32_t lanes)
{
    const struct smooth_args *args = smooth->args;
    const uint32_t *from = pt_cpu_data(smooth->call, 1);
    size_t at = (size_t)y * args->view.width + x, column = x - args->view.rect[0];
    const vf zero = vf_zero(), z = vf_load(around[1] + column);
    vm some = vm_and(vm_first(lanes), vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z))));
    vf sum[4] = { zero, zero, zero, zero }, weights = zero;
    float *out = (float *)pt_cpu_data(smooth->call, 4) + 4 * at;
    if (!vm_bits(some))
        return; // nothing reads the colour of an empty pixel
    vf limit = vf_gather(pt_cpu_data(smooth->call, 2), vi_and(vi_load(from + at), vi_set(~PT_FROM_MIXED)), some);
    for (int dy = -1; dy <= 1; dy++)
        for (int dx = -1; dx <= 1; dx++) {
            const float *tap = around[1 + dy] + column + dx;
            vm same = vm_and(some, vf_le(vf_abs(vf_load(tap) - z), limit)); // else another layer, or nothing
            vf weight = vf_select(same, vf_set(dx && dy ? args->corner : dx || dy ? args->edge : args->center), zero);
            weights = weights + weight;
            for (size_t k = 0; k < 3; k++) // what an empty pixel's colour holds is anything, NaN too
                sum[k] = sum[k] + vf_select(same, vf_load(tap + (1 + k) * smooth->stride), zero) * weight;
        }
    vf scale = vf_rcp(vf_select(some, weights, vf_set(1.0f)));
    for (int k = 0; k < 3; k++)
        sum[k] = sum[k] * scale;
    sum[3] = vf_set(1.0f);
    vf_store4(out, sum, vm_bits(some));
}

static void smooth_bands(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct smooth *smooth = context;
    const uint32_t *rect = smooth->args->view.rect;
    float *rows = smooth->rows + thread * 3 * PT_RING_CHANNELS * smooth->stride;
    for (uint32_t band = begin; band < end && !pt_cpu_cancelled(smooth->call); band++) {
        uint32_t first = rect[1] + band * BAND_ROWS, last = first + BAND_ROWS < rect[3] ? first + BAND_ROWS : rect[3];
        load_row(smooth, rows, 0, (int32_t)first - 1);
        load_row(smooth, rows, 1, (int32_t)first);
        for (uint32_t y = first; y < last; y++) {
            float *around[3];
            for (uint32_t k = 0; k < 3; k++)
                around[k] = pt_ring_channel(rows, smooth->stride, (y - first + k) % 3, 0);
            load_row(smooth, rows, (y - first + 2) % 3, (int32_t)y + 1);
            for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES)
                smooth_pixels(smooth, around, x, y, pt_lanes_left(x, rect[2]));
        }
    }
}

int PT_KERNEL_ENTRY(smooth)(const struct pt_cpu_call *call)
{
    const struct smooth_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    struct smooth smooth = { .call = call, .args = args, .stride = pt_ring_stride(rect) };
    if (rect[0] >= rect[2] || rect[1] >= rect[3])
        return PATINA_OK;
    smooth.rows = pt_cpu_scratch(call, 0, pt_pool_threads(call->pool) * 3 * PT_RING_CHANNELS * smooth.stride * sizeof(float));
    if (!smooth.rows)
        return PATINA_ERROR_MEMORY;
    pt_parallel(call->pool, (rect[3] - rect[1] + BAND_ROWS - 1) / BAND_ROWS, 1, smooth_bands, &smooth);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
