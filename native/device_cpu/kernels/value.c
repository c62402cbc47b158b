// SPDX-License-Identifier: GPL-3.0-or-later
// value: the scalar of the point that a pixel shows; twin of shaders/kernels/value.comp
#include "device_cpu/rows.h"
#include "shared/effects.h"

static void value_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct value_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    const uint64_t *keys = (const uint64_t *)PT_DATA(call, value, keys) + (size_t)y * args->view.width;
    const float *scalars = PT_DATA(call, value, scalars);
    float *values = (float *)PT_DATA(call, value, values) + (size_t)y * args->view.width;
    const vf nothing = vi_float(vi_set(0x7FC00000u)), most = vf_set(PT_VALUE_MOST), least = vf_set(-PT_VALUE_MOST);
    for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
        vi id;
        const vm ours = pt_of_instance(keys + x, &args->instance, pt_lanes_left(x, rect[2]), &id);
        pt_fetch_ahead(keys, x + PT_LANES, rect[2], &args->instance, scalars, sizeof *scalars);
        const vf scalar = vf_gather(scalars, id, ours);
        const vm known = vi_lt_unsigned(vi_and(vf_bits(scalar), vi_set(0x7FFFFFFFu)), vi_set(0x7F800000u));
        const vf off = vf_min(vf_max(scalar - vf_set(args->offset), least), most);
        const vm written = args->first ? vm_first(pt_lanes_left(x, rect[2])) : ours;
        vf_store_where(values + x, vf_select(vm_and(ours, known), off, nothing), written);
    }
}

int PT_KERNEL_ENTRY(value)(const struct pt_cpu_call *call)
{
    const struct value_args *args = call->arguments;
    return pt_rows(call, &args->view, value_row);
}
