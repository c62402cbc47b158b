// SPDX-License-Identifier: GPL-3.0-or-later
// assess: trust and thickness of the points that pixels show, into the crop; twin of shaders/kernels/assess.comp
#include "device_cpu/rows.h"
#include "shared/picture.h"

static void assess_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct assess_args *args = call->arguments;
    const uint32_t *rect = args->view.rect, *shapes = PT_DATA(call, assess, shapes);
    const uint64_t *keys = (const uint64_t *)PT_DATA(call, assess, keys) + (size_t)y * args->view.width;
    const size_t row = (size_t)(y - args->crop_y) * args->crop_width;
    float *trust = args->trust ? (float *)PT_DATA(call, assess, trust) + row : NULL;
    float *thickness = args->thickness ? (float *)PT_DATA(call, assess, thickness) + row : NULL;
    for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
        const uint32_t lanes = pt_lanes_left(x, rect[2]), to = x - args->crop_x;
        pt_fetch_ahead(keys, x + PT_LANES, rect[2], &args->instance, shapes, sizeof *shapes);
        vi id;
        const vm ours = pt_of_instance(keys + x, &args->instance, lanes, &id), written = args->first ? vm_first(lanes) : ours;
        if (!vm_bits(written))
            continue;
        vf sure = vf_zero(), sigma = vf_zero();
        if (vm_bits(ours)) {
            const vi word = vi_gather(shapes, id, ours);
            const vi class = vi_and(vi_shr(word, PT_SHAPE_SIGMA_SHIFT), vi_set(PT_SHAPE_CLASS_BITS));
            const vi level = vi_and(vi_shr(word, PT_SHAPE_TRUST_SHIFT), vi_set(15u));
            const vf doubt = vi_convert(vi_sub(vi_set(15u), level));
            sure = vf_select(ours, (vf_set(225.0f) - doubt * doubt) * vf_set(PT_TRUST_STEP), sure);
            const vm known = vm_and(ours, vm_not(vi_eq(class, vi_set(0))));
            sigma = vf_select(known, vf_look_up(args->instance.spacing, PT_SPACINGS, class) * vf_set(args->sigma_scale), sigma);
        }
        if (args->trust)
            vf_store_where(trust + to, sure, written);
        if (args->thickness)
            vf_store_where(thickness + to, sigma, written);
    }
}

int PT_KERNEL_ENTRY(assess)(const struct pt_cpu_call *call)
{
    const struct assess_args *args = call->arguments;
    return pt_rows(call, &args->view, assess_row);
}
