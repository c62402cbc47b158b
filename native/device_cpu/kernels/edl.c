// SPDX-License-Identifier: GPL-3.0-or-later
// edl: eye-dome lighting; twin of shaders/kernels/edl.comp
//
// Rows of f(z) in a ring: a logarithm a pixel, and every neighbour is a plain load.
#include "device_cpu/picture_rows.h"
#include "shared/effects.h"

enum { BAND_ROWS = 32 };

struct edl {
    const struct pt_cpu_call *call;
    const struct edl_args *args;
    float *rows; // per thread: a ring
    size_t stride;
    uint32_t ring;
};

static float *ring_row(const struct edl *edl, uint32_t thread, int32_t y)
{
    uint32_t slot = (uint32_t)(y + (int32_t)edl->ring) % edl->ring;
    return edl->rows + ((size_t)thread * edl->ring + slot) * edl->stride + PT_ROW_PAD;
}

static void load_row(const struct edl *edl, int32_t y, float *row)
{
    const struct view_args *view = &edl->args->view;
    const uint64_t *keys = (const uint64_t *)PT_DATA(edl->call, edl, keys) + (ptrdiff_t)y * view->width;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z)), beyond = vf_set(PT_EDL_BEYOND);
    const uint32_t inside = y < 0 || y >= (int32_t)view->height ? 0 : view->width;
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

static void edl_row(const struct edl *edl, const float *const near[PT_EDL_NEIGHBOURS], const float *own, uint32_t y)
{
    const struct edl_args *args = edl->args;
    const uint32_t *rect = args->view.rect;
    const vf scale = vf_set(args->scale), zero = vf_zero(), most = vf_set(PT_EDL_STEP);
    float *colors = (float *)PT_DATA(edl->call, edl, color) + 4 * (size_t)y * args->view.width;
    for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
        vf depth = vf_load(own + x), sum = zero, color[4];
        vm some = vm_and(vm_first(pt_lanes_left(x, rect[2])), vf_lt(vf_set(PT_EDL_EMPTY), depth));
        if (!vm_bits(some))
            continue;
        for (int i = 0; i < PT_EDL_NEIGHBOURS; i++)
            sum = sum + vf_min(vf_max(scale * (depth - vf_load(near[i] + x)), zero), most);
        vf light = vf_exp2(zero - vf_set(args->gain) * sum);
        vf_load4(colors + 4 * (size_t)x, color);
        for (int k = 0; k < 3; k++)
            color[k] = color[k] * light;
        vf_store4(colors + 4 * (size_t)x, color, vm_bits(some));
    }
}

static void edl_bands(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct edl *edl = context;
    const struct edl_args *args = edl->args;
    const uint32_t *rect = args->view.rect;
    const int32_t reach = (int32_t)args->reach;
    for (uint32_t band = begin; band < end && !pt_cpu_cancelled(edl->call); band++) {
        int32_t first = (int32_t)(rect[1] + band * BAND_ROWS);
        int32_t last = first + BAND_ROWS < (int32_t)rect[3] ? first + BAND_ROWS : (int32_t)rect[3];
        for (int32_t y = first - reach; y < first + reach; y++)
            load_row(edl, y, ring_row(edl, thread, y));
        for (int32_t y = first; y < last; y++) {
            const float *near[PT_EDL_NEIGHBOURS];
            load_row(edl, y + reach, ring_row(edl, thread, y + reach));
            for (int i = 0; i < PT_EDL_NEIGHBOURS; i++)
                near[i] = ring_row(edl, thread, y + args->offsets[2 * i + 1]) + args->offsets[2 * i];
            edl_row(edl, near, ring_row(edl, thread, y), (uint32_t)y);
        }
    }
}

int PT_KERNEL_ENTRY(edl)(const struct pt_cpu_call *call)
{
    const struct edl_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    struct edl edl = {.call = call, .args = args, .stride = pt_row_stride(args->view.width), .ring = 2 * args->reach + 1};
    if (rect[0] >= rect[2] || rect[1] >= rect[3])
        return PATINA_OK;
    edl.rows = pt_cpu_scratch(call, 0, pt_pool_threads(call->pool) * edl.ring * edl.stride * sizeof(float));
    if (!edl.rows)
        return PATINA_ERROR_MEMORY;
    pt_parallel(call->pool, (rect[3] - rect[1] + BAND_ROWS - 1) / BAND_ROWS, 1, edl_bands, &edl);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
