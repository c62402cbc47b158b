// SPDX-License-Identifier: GPL-3.0-or-later
// pull: 2 x 2 -> 1, the least key: what a scatter at half the resolution gives. SPEC 2.2; twin of shaders/kernels/pull.comp
#include "device_cpu/rows.h"

static void pull_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct pull_args *args = call->arguments;
    const uint64_t *fine_keys = pt_cpu_data(call, 0);
    const uint32_t *fine_from = pt_cpu_data(call, 1);
    uint64_t *keys = pt_cpu_data(call, 2);
    uint32_t *from = pt_cpu_data(call, 3);
    for (uint32_t x = args->view.rect[0]; x < args->view.rect[2]; x++) {
        size_t best = (size_t)(2 * y) * args->fine_width + 2 * x;
        for (uint32_t child = 1; child < 4; child++) {
            uint32_t fx = 2 * x + (child & 1), fy = 2 * y + (child >> 1);
            size_t at = (size_t)fy * args->fine_width + fx;
            if (fx < args->fine_width && fy < args->fine_height && fine_keys[at] < fine_keys[best])
                best = at;
        }
        keys[(size_t)y * args->view.width + x] = fine_keys[best];
        from[(size_t)y * args->view.width + x] = fine_from[best];
    }
}

int PT_KERNEL_ENTRY(pull)(const struct pt_cpu_call *call)
{
    const struct pull_args *args = call->arguments;
    return pt_rows(call, &args->view, pull_row);
}
