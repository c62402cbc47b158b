// SPDX-License-Identifier: GPL-3.0-or-later
// extract: the passes beside the colour, into the crop: z, world-space normal, source (SPEC 2.2: scholars must see what
// is scan and what is invention); twin of shaders/kernels/extract.comp
#include "device_cpu/rows.h"

static float source_value(const struct view_args *view, uint32_t from, uint32_t x, uint32_t y)
{
    uint32_t source = from & ~PT_FROM_MIXED;
    float dx = (float)((int32_t)(source % view->width) - (int32_t)x);
    float dy = (float)((int32_t)(source / view->width) - (int32_t)y);
    float square = dx * dx + dy * dy;
    float value = square > 0.0f ? 1.0f + square * pt_rsqrt(square) : 1.0f;
    return from & PT_FROM_MIXED ? -value : value;
}

static void extract_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct extract_args *args = call->arguments;
    const uint64_t *keys = pt_cpu_data(call, 0);
    const uint32_t *from = pt_cpu_data(call, 1);
    const float *shading = pt_cpu_data(call, 2), *m = args->world_from_view;
    float *depth = pt_cpu_data(call, 3), *normal = pt_cpu_data(call, 4), *source = pt_cpu_data(call, 5);
    size_t row = (size_t)(args->crop_y + y) * args->view.width + args->crop_x, out = (size_t)y * args->crop_width;
    for (uint32_t x = 0; x < args->crop_width; x++) {
        uint32_t z_bits = (uint32_t)(keys[row + x] >> 32);
        int some = z_bits != PT_KEY_EMPTY_Z;
        const float *n = shading + 4 * (row + x);
        if (args->depth)
            depth[out + x] = pt_float(z_bits);
        for (size_t k = 0; args->normal && k < 3; k++)
            normal[3 * (out + x) + k] =
                some ? (m[3 * k] * n[0] + m[3 * k + 1] * n[1]) + m[3 * k + 2] * n[2] : 0.0f;
        if (args->source)
            source[out + x] =
                some ? source_value(&args->view, from[row + x], args->crop_x + x, args->crop_y + y) : 0.0f;
    }
}

int PT_KERNEL_ENTRY(extract)(const struct pt_cpu_call *call)
{
    const struct extract_args *args = call->arguments;
    struct view_args crop = args->view;
    crop.rect[0] = crop.rect[1] = 0;
    crop.rect[2] = args->crop_width;
    crop.rect[3] = args->crop_height;
    return pt_rows(call, &crop, extract_row);
}
