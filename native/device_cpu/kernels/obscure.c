// SPDX-License-Identifier: GPL-3.0-or-later
// obscure: ambient obscurance within a view-space radius; twin of shaders/kernels/obscure.comp
//   1. every pixel's taps   2. the mean over 5 x 5 of them, and the colour
#include "obscure.h"
#include "shared/effects.h"

enum { BAND_ROWS = 32, REACH = PT_OBSCURE_BLUR, RING = PT_OBSCURE_ROWS };

struct obscure {
    const struct pt_cpu_call *call;
    const struct obscure_args *args;
    struct pt_planes planes;
    float *rows; // per thread: a ring of rows of z and of what is obscured
    size_t stride;
};

struct row {
    float *z, *obscured;
};

// ---- 1. taps -----------------------------------------------------------------------------------------------------------

static void gather_row(void *context, uint32_t y)
{
    const struct obscure *obscure = context;
    const struct view_args *view = &obscure->args->view;
    float *out = PT_DATA(obscure->call, obscure, obscured);
    for (uint32_t x = view->rect[0]; x < view->rect[2]; x += PT_LANES) {
        size_t at = (size_t)y * view->width + x;
        vf z = vi_float(vi_load_z(obscure->planes.keys + at)), shown[4];
        vm some = vm_and(vm_first(pt_lanes_left(x, view->rect[2])), vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z))));
        if (!vm_bits(some))
            continue;
        vf_load4((const float *)PT_DATA(obscure->call, obscure, shading) + 4 * at, shown);
        vf_store_where(out + at, pt_obscured(obscure->args, obscure->planes.keys, z, shown, x, y, some), some);
    }
}

// ---- 2. mean and colour ------------------------------------------------------------------------------------------------

static struct row ring_row(const struct obscure *obscure, uint32_t thread, int32_t y)
{
    const uint32_t slot = (uint32_t)(y + RING) % RING;
    float *row = obscure->rows + ((size_t)thread * RING + slot) * 2 * obscure->stride + PT_ROW_PAD;
    return (struct row){row, row + obscure->stride};
}

static void load_row(const struct obscure *obscure, int32_t y, const struct row *row)
{
    const uint32_t width = obscure->args->view.width;
    pt_empty_row(row->z, width);
    if (y < 0 || y >= (int32_t)obscure->args->view.height)
        return;
    const float *from = (const float *)PT_DATA(obscure->call, obscure, obscured) + (size_t)y * width;
    for (uint32_t x = 0; x < width; x += PT_LANES) {
        vm lanes = vm_first(pt_lanes_left(x, width));
        vf_store_where(row->z + x, vi_float(vi_load_z(obscure->planes.keys + (size_t)y * width + x)), lanes);
        vf_store_where(row->obscured + x, vf_load(from + x), lanes);
    }
}

static void blur_row(const struct obscure *obscure, const struct row rows[RING], uint32_t y)
{
    const struct view_args *view = &obscure->args->view;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    const float *z[RING], *obscured[RING];
    float *colors = PT_DATA(obscure->call, obscure, color);
    for (int i = 0; i < RING; i++) {
        z[i] = rows[i].z;
        obscured[i] = rows[i].obscured;
    }
    for (uint32_t x = view->rect[0]; x < view->rect[2]; x += PT_LANES) {
        size_t at = (size_t)y * view->width + x;
        vf color[4];
        vm some = vm_and(vm_first(pt_lanes_left(x, view->rect[2])), vf_lt(vf_load(rows[REACH].z + x), empty));
        if (!vm_bits(some))
            continue;
        vf deff = vf_gather(obscure->planes.deff, pt_source(&obscure->planes, at), some);
        vf light = pt_obscure_light(obscure->args, z, obscured, deff, x, some);
        vf_load4(colors + 4 * at, color);
        for (int k = 0; k < 3; k++)
            color[k] = color[k] * light;
        vf_store4(colors + 4 * at, color, vm_bits(some));
    }
}

static void blur_bands(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct obscure *obscure = context;
    const uint32_t *rect = obscure->args->view.rect;
    for (uint32_t band = begin; band < end && !pt_cpu_cancelled(obscure->call); band++) {
        int32_t first = (int32_t)(rect[1] + band * BAND_ROWS);
        int32_t last = first + BAND_ROWS < (int32_t)rect[3] ? first + BAND_ROWS : (int32_t)rect[3];
        for (int32_t y = first - 2 * REACH; y < last; y++) {
            struct row row = ring_row(obscure, thread, y + REACH), rows[RING];
            load_row(obscure, y + REACH, &row);
            if (y < first)
                continue;
            for (int32_t k = 0; k < RING; k++)
                rows[k] = ring_row(obscure, thread, y + k - REACH);
            blur_row(obscure, rows, (uint32_t)y);
        }
    }
}

static void gather_rows(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct obscure *obscure = context;
    (void)thread;
    for (uint32_t y = begin; y < end && !pt_cpu_cancelled(obscure->call); y++)
        gather_row(context, obscure->args->view.rect[1] + y);
}

int PT_KERNEL_ENTRY(obscure)(const struct pt_cpu_call *call)
{
    const struct obscure_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    struct obscure obscure = {.call = call,
                              .args = args,
                              .planes = {.view = &args->view,
                                         .keys = PT_DATA(call, obscure, keys),
                                         .from = PT_DATA(call, obscure, from),
                                         .deff = PT_DATA(call, obscure, deff)},
                              .stride = pt_row_stride(args->view.width)};
    if (rect[0] >= rect[2] || rect[1] >= rect[3])
        return PATINA_OK;
    obscure.rows = pt_cpu_scratch(call, 0, pt_pool_threads(call->pool) * RING * 2 * obscure.stride * sizeof(float));
    if (!obscure.rows)
        return PATINA_ERROR_MEMORY;
    pt_parallel(call->pool, rect[3] - rect[1], 8, gather_rows, &obscure);
    if (!pt_cpu_cancelled(call))
        pt_parallel(call->pool, (rect[3] - rect[1] + BAND_ROWS - 1) / BAND_ROWS, 1, blur_bands, &obscure);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
