// SPDX-License-Identifier: GPL-3.0-or-later
// antialias: Laplace on depth as steps. [D 3.5]; twin of shaders/kernels/antialias.comp
//
// k of the four cross neighbours are farther than d_eff (or empty). A pixel is drawn when a point falls anywhere in it, so
// an edge pixel's true coverage is below 1: for a straight edge at 0 degrees (k = 1) it is uniform in 0..1, mean 1/2; at
// 45 degrees the outermost pixels (k = 2) cover t^2/2, mean 1/6. Both are met by coverage = 5/6 - k/3, floored at 1/6 so
// that lone pixels stay visible.
#include "device_cpu/rows.h"

static void antialias_pixel(const struct antialias_args *args, const struct pt_cpu_call *call, uint32_t x, uint32_t y)
{
    static const int8_t cross[4][2] = { { 1, 0 }, { 0, 1 }, { -1, 0 }, { 0, -1 } };
    const struct view_args *view = &args->view;
    const uint64_t *keys = pt_cpu_data(call, 0);
    uint32_t *from = pt_cpu_data(call, 1);
    const float *deff = pt_cpu_data(call, 2), *colors = pt_cpu_data(call, 3);
    size_t at = (size_t)y * view->width + x;
    float *out = (float *)pt_cpu_data(call, 4) + 4 * at, far_color[4] = { 0.0f, 0.0f, 0.0f, 0.0f }, far_count = 0.0f;
    uint32_t z_bits = (uint32_t)(keys[at] >> 32);
    memcpy(out, colors + 4 * at, 16);
    if (z_bits == PT_KEY_EMPTY_Z)
        return;
    float empty = pt_float(PT_KEY_EMPTY_Z);
    float limit = args->layers ? pt_float(z_bits) + deff[from[at] & ~PT_FROM_MIXED] : empty;
    for (int i = 0; i < 4; i++) {
        uint32_t qx = x + (uint32_t)cross[i][0], qy = y + (uint32_t)cross[i][1];
        if (qx >= view->width || qy >= view->height)
            continue; // unknown: no edge
        size_t q = (size_t)qy * view->width + qx;
        float z = pt_float((uint32_t)(keys[q] >> 32));
        if (!(z > limit || z == empty))
            continue;
        far_count += 1.0f;
        for (int k = 0; k < 4 && z < empty; k++)
            far_color[k] = far_color[k] + colors[4 * q + (size_t)k];
    }
    if (!(far_count > 0.0f))
        return;
    float coverage = pt_max((float)(5.0 / 6.0) - far_count * (float)(1.0 / 3.0), (float)(1.0 / 6.0));
    float share = (1.0f - coverage) * pt_rcp(far_count);
    for (int k = 0; k < 4; k++)
        out[k] = colors[4 * at + (size_t)k] * coverage + far_color[k] * share;
    from[at] |= PT_FROM_MIXED;
}

static void antialias_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct antialias_args *args = call->arguments;
    for (uint32_t x = args->view.rect[0]; x < args->view.rect[2]; x++)
        antialias_pixel(args, call, x, y);
}

int PT_KERNEL_ENTRY(antialias)(const struct pt_cpu_call *call)
{
    const struct antialias_args *args = call->arguments;
    return pt_rows(call, &args->view, antialias_row);
}
