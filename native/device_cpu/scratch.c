// SPDX-License-Identifier: GPL-3.0-or-later
#include "cpu.h"
#include "base/platform.h"

static void *take(uint32_t index, size_t size)
{
    if (index != PT_CPU_SPARSE)
        return pt_pages_alloc(size);
    void *memory = pt_pages_reserve(size);
    if (memory && pt_pages_need(memory, size)) {
        pt_pages_free(memory, size);
        return NULL;
    }
    return memory;
}

void *pt_cpu_scratch(const struct pt_cpu_call *call, uint32_t index, size_t size)
{
    struct pt_cpu_scratch *scratch = &call->scratch[index];
    size += PT_SLACK;
    if (scratch->size >= size)
        return scratch->memory;
    size += scratch->size ? size / 8 : 0; // a moving camera asks for a little more every time
    pt_pages_free(scratch->memory, scratch->size);
    scratch->memory = take(index, size);
    scratch->size = scratch->memory ? size : 0;
    return scratch->memory;
}
