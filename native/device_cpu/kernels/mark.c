// SPDX-License-Identifier: GPL-3.0-or-later
// mark: which points the picture shows (SPEC 4: shadows of no others are computed); twin of shaders/kernels/mark.comp
#include "device_cpu/rows.h"
#include "marks.h"
#include "shared/shadows.h"

static void mark_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct mark_args *args = call->arguments;
    const uint64_t *keys = (const uint64_t *)PT_DATA(call, mark, keys) + (size_t)y * args->view.width;
    uint32_t *marks = PT_DATA(call, mark, marks);
    for (uint32_t x = args->view.rect[0]; x < args->view.rect[2]; x++) {
        uint32_t id = (uint32_t)keys[x] - args->id_base;
        if (id - args->id_first < args->id_count && (uint32_t)(keys[x] >> 32) != PT_KEY_EMPTY_Z)
            pt_mark(marks, id);
    }
}

int PT_KERNEL_ENTRY(mark)(const struct pt_cpu_call *call)
{
    const struct mark_args *args = call->arguments;
    return pt_rows(call, &args->view, mark_row);
}
