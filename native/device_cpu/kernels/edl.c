// SPDX-License-Identifier: GPL-3.0-or-later
// edl: eye-dome lighting; twin of shaders/kernels/edl.comp
#include "edl.h"
#include "shared/effects.h"

enum { BAND_ROWS = 32 };

struct edl {
    const struct pt_cpu_call *call;
    const struct edl_args *args;
    struct pt_edl_ring ring; // the first thread's; the others' follow
};

static void edl_row(const struct edl *edl, const struct pt_edl_ring *ring, uint32_t y)
{
    const struct edl_args *args = edl->args;
    const uint32_t *rect = args->view.rect;
    const float *near[PT_EDL_RADII * PT_EDL_NEIGHBOURS], *own = pt_edl_row(ring, (int32_t)y);
    float *colors = (float *)PT_DATA(edl->call, edl, color) + 4 * (size_t)y * args->view.width;
    const struct pt_edl_planes planes = PT_EDL_PLANES(edl->call);
    pt_edl_near(args, ring, (int32_t)y, near);
    for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
        vf depth = vf_load(own + x), color[4];
        vm some = vm_and(vm_first(pt_lanes_left(x, rect[2])), vf_lt(vf_set(PT_EDL_EMPTY), depth));
        if (!vm_bits(some))
            continue;
        vf light = pt_edl_light(args, &planes, near, depth, x, y, some);
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
    const uint64_t *keys = PT_DATA(edl->call, edl, keys);
    const uint32_t *rect = args->view.rect;
    const int32_t reach = (int32_t)args->reach;
    struct pt_edl_ring ring = edl->ring;
    ring.rows += thread * ring.count * ring.stride;
    for (uint32_t band = begin; band < end && !pt_cpu_cancelled(edl->call); band++) {
        int32_t first = (int32_t)(rect[1] + band * BAND_ROWS);
        int32_t last = first + BAND_ROWS < (int32_t)rect[3] ? first + BAND_ROWS : (int32_t)rect[3];
        for (int32_t y = first - reach; y < first + reach; y++)
            pt_edl_load_row(args, keys, y, pt_edl_row(&ring, y));
        for (int32_t y = first; y < last; y++) {
            pt_edl_load_row(args, keys, y + reach, pt_edl_row(&ring, y + reach));
            edl_row(edl, &ring, (uint32_t)y);
        }
    }
}

int PT_KERNEL_ENTRY(edl)(const struct pt_cpu_call *call)
{
    const struct edl_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    struct edl edl = {
        .call = call, .args = args, .ring = {.stride = pt_edl_stride(args->view.width), .count = 2 * args->reach + 1}};
    if (rect[0] >= rect[2] || rect[1] >= rect[3])
        return PATINA_OK;
    edl.ring.rows = pt_cpu_scratch(call, 0, pt_pool_threads(call->pool) * edl.ring.count * edl.ring.stride * sizeof(float));
    if (!edl.ring.rows)
        return PATINA_ERROR_MEMORY;
    pt_parallel(call->pool, (rect[3] - rect[1] + BAND_ROWS - 1) / BAND_ROWS, 1, edl_bands, &edl);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
