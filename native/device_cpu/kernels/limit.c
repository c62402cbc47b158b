// SPDX-License-Identifier: GPL-3.0-or-later
// limit: from where on a light's next map of a faint caster sees its points [D 6]; twin of shaders/kernels/limit.comp
#include "device_cpu/rows.h"
#include "shared/shadows.h"

static void limit_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct limit_args *args = call->arguments;
    const uint32_t *rect = args->view.rect;
    const size_t row = (size_t)y * args->view.width;
    const uint64_t *keys = (const uint64_t *)PT_DATA(call, limit, keys) + row;
    const uint32_t *from = (const uint32_t *)PT_DATA(call, limit, from) + row;
    float *limit = (float *)PT_DATA(call, limit, limit) + row;
    const vf finished = vf_set(pt_float(PT_KEY_EMPTY_Z));
    uint32_t any = 0;
    for (uint32_t x = rect[0]; x < rect[2]; x += PT_LANES) {
        vm lanes = vm_first(pt_lanes_left(x, rect[2]));
        vf z = vi_float(vi_load_z(keys + x)), next = finished;
        vm some = vm_and(lanes, vf_lt(z, finished));
        if (args->loss == 255 && vm_bits(some)) {
            vi id = vi_sub(vi_load_id(keys + x), vi_set(args->caster));
            vi opacity = vi_and(vi_gather_bytes(PT_DATA(call, limit, opacities), id, some), vi_set(255));
            some = vm_and(some, vm_not(vi_eq(opacity, vi_set(255))));
        }
        if (vm_bits(some)) {
            vi source = vi_and(vi_load(from + x), vi_set(~PT_FROM_MIXED));
            next = vf_select(some, z + vf_gather(PT_DATA(call, limit, deff), source, some), finished);
        }
        vf_store_where(limit + x, next, lanes);
        any |= vm_bits(some);
    }
    if (any)
        __atomic_store_n((uint32_t *)PT_DATA(call, limit, some), 1, __ATOMIC_RELAXED);
}

int PT_KERNEL_ENTRY(limit)(const struct pt_cpu_call *call)
{
    const struct limit_args *args = call->arguments;
    return pt_rows(call, &args->view, limit_row);
}
