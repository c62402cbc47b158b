// SPDX-License-Identifier: GPL-3.0-or-later
// reveal: how far scans lie apart where pixels show an instance, into the crop; twin of shaders/kernels/reveal.comp
#include "device_cpu/rows.h"
#include "shared/picture.h"

static void reveal_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct reveal_args *args = call->arguments;
    const uint32_t *rect = args->view.rect,
                   *from = (const uint32_t *)PT_DATA(call, reveal, from) + (size_t)y * args->view.width;
    const uint64_t *keys = (const uint64_t *)PT_DATA(call, reveal, keys) + (size_t)y * args->view.width;
    float *out = (float *)PT_DATA(call, reveal, disagreement) + (size_t)(y - args->crop_y) * args->crop_width;
    for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
        vi id;
        const uint32_t count = pt_lanes_left(x, rect[2]);
        const vm lanes = vm_first(count), ours = pt_of_instance(keys + x, &args->instance, count, &id);
        const vf apart = vf_gather(PT_DATA(call, reveal, apart), pt_source_of(from, x), ours);
        vf_store_where(out + (x - args->crop_x), vf_select(ours, apart, vf_zero()), args->first ? lanes : ours);
    }
}

int PT_KERNEL_ENTRY(reveal)(const struct pt_cpu_call *call)
{
    const struct reveal_args *args = call->arguments;
    return pt_rows(call, &args->view, reveal_row);
}
