// SPDX-License-Identifier: GPL-3.0-or-later
// fog: colours fade with distance; twin of shaders/kernels/fog.comp
#include "device_cpu/rows.h"

static void fog_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct fog_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    const size_t row = (size_t)y * args->view.width;
    const uint64_t *keys = (const uint64_t *)pt_cpu_data(call, 0) + row;
    float *colors = (float *)pt_cpu_data(call, 1) + 4 * row;
    const vf zero = vf_zero(), one = vf_set(1.0f), start = vf_set(args->start), inverse = vf_set(args->inverse);
    for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
        vf z = vi_float(vi_load_z(keys + x)), color[4];
        vm some = vm_and(vm_first(pt_lanes_left(x, rect[2])), vf_lt(z, vf_set(pt_float(PT_KEY_EMPTY_Z))));
        if (!vm_bits(some))
            continue;
        vf away = z;
        if (args->view.perspective) {
            vf ray[2];
            vf_ray(&args->view, x, y, ray);
            vf square = (ray[0] * ray[0] + ray[1] * ray[1]) + one;
            away = vf_select(some, z, one) * (square * vf_rsqrt(square));
        }
        vf share = vf_min(vf_max((away - start) * inverse, zero), one) * vf_set(args->density);
        vf_load4(colors + 4 * (size_t)x, color);
        vf veil = share * color[3];
        for (int k = 0; k < 3; k++)
            color[k] = color[k] * (one - share) + vf_set(args->color[k]) * veil;
        vf_store4(colors + 4 * (size_t)x, color, vm_bits(some));
    }
}

int PT_KERNEL_ENTRY(fog)(const struct pt_cpu_call *call)
{
    const struct fog_args *args = call->arguments;
    return pt_rows(call, &args->view, fog_row);
}
