// SPDX-License-Identifier: GPL-3.0-or-later
// toon: bands of light; twin of shaders/kernels/toon.comp
#include "device_cpu/rows.h"

static vf luminance(const vf color[4])
{
    return (vf_set(0.2126f) * color[0] + vf_set(0.7152f) * color[1]) + vf_set(0.0722f) * color[2];
}

// The light of a band, given the light.
static vf band_of(const struct toon_args *args, vf light)
{
    const vf half = vf_set(0.5f), zero = vf_zero(), one = vf_set(1.0f);
    vf root = light * vf_rsqrt(vf_max(light, vf_set(PT_TOON_DARK))); // as the eye has it
    vf at = root * vf_set(args->bands) + half, whole = vf_floor(at);
    vf edge = vf_min(vf_max((at - whole - half) * vf_set(args->steepness) + half, zero), one);
    edge = (edge * edge) * (vf_set(3.0f) - vf_set(2.0f) * edge);
    vf level = vf_max((whole - half) + edge, half) * vf_set(args->inverse);
    return level * level;
}

static void toon_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct toon_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    const size_t row = (size_t)y * args->view.width;
    const uint64_t *keys = (const uint64_t *)pt_cpu_data(call, 0) + row;
    const float *albedos = (const float *)pt_cpu_data(call, 1) + 4 * row;
    float *colors = (float *)pt_cpu_data(call, 2) + 4 * row;
    const vf dark = vf_set(PT_TOON_DARK), one = vf_set(1.0f);
    for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
        vm some = vm_and(vm_first(pt_lanes_left(x, rect[2])),
                         vm_not(vi_eq(vi_load_z(keys + x), vi_set(PT_KEY_EMPTY_Z))));
        vf albedo[4], color[4];
        if (!vm_bits(some))
            continue;
        vf_load4(albedos + 4 * (size_t)x, albedo);
        vf_load4(colors + 4 * (size_t)x, color);
        vf own = luminance(albedo);
        some = vm_and(some, vf_lt(dark, own)); // black has no light to be seen by
        vf light = luminance(color) * vf_rcp(vf_select(some, own, one));
        vm lit = vf_lt(dark, light);
        light = vf_select(some, light, one);
        vf band = band_of(args, light), ratio = band * vf_rcp(vf_select(lit, light, one));
        for (int k = 0; k < 3; k++)
            color[k] = vf_select(lit, color[k] * ratio, albedo[k] * band);
        vf_store4(colors + 4 * (size_t)x, color, vm_bits(some));
    }
}

int PT_KERNEL_ENTRY(toon)(const struct pt_cpu_call *call)
{
    const struct toon_args *args = call->arguments;
    return pt_rows(call, &args->view, toon_row);
}
