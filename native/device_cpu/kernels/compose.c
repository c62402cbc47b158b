// SPDX-License-Identifier: GPL-3.0-or-later
// compose: colour over the background, into the crop; twin of shaders/kernels/compose.comp
#include "compose.h"
#include "device_cpu/rows.h"

static void compose_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct compose_args *args = call->arguments;
    size_t row = (size_t)(args->crop_y + y) * args->view.width + args->crop_x;
    const uint64_t *keys = (const uint64_t *)pt_cpu_data(call, 0) + row;
    const float *colors = (const float *)pt_cpu_data(call, 1) + 4 * row;
    float *out = (float *)pt_cpu_data(call, 2) + 4 * (size_t)y * args->crop_width;
    vf background[4];
    for (int k = 0; k < 4; k++)
        background[k] = vf_set(args->background[k]);
    for (uint32_t x = 0; x < args->crop_width; x += PT_LANES) {
        uint32_t count = pt_lanes_left(x, args->crop_width);
        vm some = vm_first(count);
        if (!args->everywhere)
            some = vm_and(some, vm_not(vi_eq(vi_load_z(keys + x), vi_set(PT_KEY_EMPTY_Z))));
        vf color[4], over[4];
        if (vm_bits(some))
            vf_load4(colors + 4 * (size_t)x, color);
        else
            memcpy(color, background, sizeof color);
        pt_compose(color, background, some, over);
        vf_put4(out + 4 * (size_t)x, over, count);
    }
}

int PT_KERNEL_ENTRY(compose)(const struct pt_cpu_call *call)
{
    const struct compose_args *args = call->arguments;
    return pt_crop_rows(call, &args->view, args->crop_width, args->crop_height, compose_row);
}
