// SPDX-License-Identifier: GPL-3.0-or-later
// compose: colour over the background, into the crop; twin of shaders/kernels/compose.comp
#include "device_cpu/rows.h"

static void compose_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct compose_args *args = call->arguments;
    const uint64_t *keys = pt_cpu_data(call, 0);
    const float *colors = pt_cpu_data(call, 1);
    size_t row = (size_t)(args->crop_y + y) * args->view.width + args->crop_x;
    float *out = (float *)pt_cpu_data(call, 2) + 4 * (size_t)y * args->crop_width;
    for (uint32_t x = 0; x < args->crop_width; x++, out += 4) {
        if ((uint32_t)(keys[row + x] >> 32) == PT_KEY_EMPTY_Z) {
            memcpy(out, args->background, 16);
            continue;
        }
        const float *color = colors + 4 * (row + x);
        float through = 1.0f - color[3];
        for (int k = 0; k < 4; k++)
            out[k] = color[k] + through * args->background[k];
    }
}

int PT_KERNEL_ENTRY(compose)(const struct pt_cpu_call *call)
{
    const struct compose_args *args = call->arguments;
    struct view_args crop = args->view; // the rows of the crop
    crop.rect[0] = crop.rect[1] = 0;
    crop.rect[2] = args->crop_width;
    crop.rect[3] = args->crop_height;
    return pt_rows(call, &crop, compose_row);
}
