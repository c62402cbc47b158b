// SPDX-License-Identifier: GPL-3.0-or-later
// smooth: 3 x 3 low-pass over the neighbours of the same layer. [D 3.4, Table 1]; twin of shaders/kernels/smooth.comp
#include "device_cpu/rows.h"

static void smooth_pixel(const struct smooth_args *args, const struct pt_cpu_call *call, uint32_t x, uint32_t y)
{
    const struct view_args *view = &args->view;
    const uint64_t *keys = pt_cpu_data(call, 0);
    const uint32_t *from = pt_cpu_data(call, 1);
    const float *deff = pt_cpu_data(call, 2), *colors = pt_cpu_data(call, 3);
    size_t at = (size_t)y * view->width + x;
    float *out = (float *)pt_cpu_data(call, 4) + 4 * at, sum[4] = { 0.0f, 0.0f, 0.0f, 0.0f }, weights = 0.0f;
    uint32_t z_bits = (uint32_t)(keys[at] >> 32);
    if (z_bits == PT_KEY_EMPTY_Z) {
        memcpy(out, sum, sizeof sum);
        return;
    }
    float z = pt_float(z_bits), limit = deff[from[at] & ~PT_FROM_MIXED];
    for (int32_t dy = -1; dy <= 1; dy++)
        for (int32_t dx = -1; dx <= 1; dx++) {
            uint32_t qx = x + (uint32_t)dx, qy = y + (uint32_t)dy;
            if (qx >= view->width || qy >= view->height)
                continue;
            size_t q = (size_t)qy * view->width + qx;
            if (!(pt_abs(pt_float((uint32_t)(keys[q] >> 32)) - z) <= limit))
                continue; // nothing there, or another layer
            float weight = dx && dy ? args->corner : dx || dy ? args->edge : args->center;
            weights += weight;
            for (int k = 0; k < 4; k++)
                sum[k] = sum[k] + colors[4 * q + (size_t)k] * weight;
        }
    float scale = pt_rcp(weights);
    for (int k = 0; k < 3; k++)
        out[k] = sum[k] * scale;
    out[3] = 1.0f;
}

static void smooth_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct smooth_args *args = call->arguments;
    for (uint32_t x = args->view.rect[0]; x < args->view.rect[2]; x++)
        smooth_pixel(args, call, x, y);
}

int PT_KERNEL_ENTRY(smooth)(const struct pt_cpu_call *call)
{
    const struct smooth_args *args = call->arguments;
    return pt_rows(call, &args->view, smooth_row);
}
