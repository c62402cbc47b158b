// SPDX-License-Identifier: GPL-3.0-or-later
// The CPU device: buffers are memory, kernels are functions of the best instruction set that the processor has.
#include "cpu.h"
#include "base/platform.h"
#include "tables.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct cpu_device {
    struct patina_device base;
    const struct pt_cpu_isa *isa;
    struct pt_cpu_scratch scratch[PT_CPU_SCRATCHES];
};

// The best instruction set first that this processor has; ends with the scalar one.
static uint32_t available_isas(const struct pt_cpu_isa *isas[4])
{
    uint32_t count = 0;
#define PT_X(isa, known)                                                                                                       \
    if (known)                                                                                                                 \
        isas[count++] = &pt_cpu_isa_##isa;
    PT_EACH_ISA(PT_X)
#undef PT_X
    return count;
}

// ---- buffers ---------------------------------------------------------------------------------------------------------

static int cpu_buffer_create(struct patina_device *device, size_t size, const void *source, int how, struct pt_buffer *out)
{
    *out = (struct pt_buffer){.size = size, .room = size, .wrapped = source && how & PT_BORROW};
    if (out->wrapped) {
        out->data = (void *)source;
        return PATINA_OK;
    }
    out->data = pt_pages_alloc(size + PT_SLACK); // zeroed
    if (!out->data) {
        *out = (struct pt_buffer){0};
        return pt_fail(&device->handle, PATINA_ERROR_MEMORY, "%s: out of memory for a buffer of %zu bytes", device->info.name,
                       size);
    }
    if (source)
        memcpy(out->data, source, size);
    return PATINA_OK;
}

static void cpu_buffer_destroy(struct patina_device *device, struct pt_buffer *buffer)
{
    (void)device;
    if (!buffer->wrapped && buffer->data)
        pt_pages_free(buffer->data, buffer->room + PT_SLACK);
    *buffer = (struct pt_buffer){0};
}

static int cpu_buffer_write(struct patina_device *device, struct pt_buffer *buffer, size_t offset, const void *source,
                            size_t size)
{
    (void)device;
    memcpy((char *)buffer->data + offset, source, size);
    return PATINA_OK;
}

static int cpu_buffer_read(struct patina_device *device, const struct pt_buffer *buffer, size_t offset, void *target,
                           size_t size)
{
    (void)device;
    memcpy(target, (const char *)buffer->data + offset, size);
    return PATINA_OK;
}

struct fill_job {
    uint64_t *words;
    uint64_t pattern;
    size_t count;
};

enum { FILL_BLOCK = 1 << 13 }; // words: 64 KiB

static void fill_words(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct fill_job *job = context;
    size_t last = (size_t)end * FILL_BLOCK < job->count ? (size_t)end * FILL_BLOCK : job->count;
    (void)thread;
    for (size_t i = (size_t)begin * FILL_BLOCK; i < last; i++)
        job->words[i] = job->pattern;
}

static int cpu_buffer_fill(struct patina_device *device, struct pt_buffer *buffer, size_t offset, size_t size, uint64_t pattern,
                           uint32_t bytes)
{
    struct cpu_device *cpu = (struct cpu_device *)device;
    if (bytes == 4)
        pattern = (pattern & 0xFFFFFFFFu) | pattern << 32;
    char *data = (char *)buffer->data + offset;
    struct fill_job job = {(uint64_t *)(void *)data, pattern, size / 8};
    pt_parallel(cpu->base.pool, (uint32_t)((job.count + FILL_BLOCK - 1) / FILL_BLOCK), 4, fill_words, &job);
    if (size % 8)
        memcpy(data + size / 8 * 8, &pattern, size % 8);
    return PATINA_OK;
}

// ---- kernels ---------------------------------------------------------------------------------------------------------

static int cpu_run(struct patina_device *device, enum pt_kernel kernel, const void *arguments, size_t argument_size,
                   struct pt_buffer *const *buffers, uint32_t buffer_count, const atomic_int *cancel)
{
    struct cpu_device *cpu = (struct cpu_device *)device;
    const struct pt_cpu_call call = {.arguments = arguments,
                                     .buffers = buffers,
                                     .buffer_count = buffer_count,
                                     .pool = cpu->base.pool,
                                     .cancel = cancel,
                                     .scratch = cpu->scratch};
    (void)argument_size;
    int error = cpu->isa->kernels[kernel](&call);
    if (error == PATINA_ERROR_MEMORY)
        return pt_fail(&device->handle, error, "%s: out of memory for the scratch of kernel %s", device->info.name,
                       pt_kernels[kernel].name);
    return error;
}

static int cpu_run_tail(struct patina_device *device, const struct pt_bound_pass *passes, uint32_t count,
                        const atomic_int *cancel)
{
    struct cpu_device *cpu = (struct cpu_device *)device;
    struct pt_cpu_pass *bound = malloc(count * sizeof *bound);
    int error = bound ? PATINA_OK : PATINA_ERROR_MEMORY;
    for (uint32_t i = 0; i < count && bound; i++)
        bound[i] = (struct pt_cpu_pass){passes[i].kernel,
                                        {.arguments = passes[i].arguments,
                                         .buffers = passes[i].buffers,
                                         .buffer_count = passes[i].buffer_count,
                                         .pool = cpu->base.pool,
                                         .cancel = cancel,
                                         .scratch = cpu->scratch}};
    if (!error)
        error = cpu->isa->tail(bound, count);
    free(bound);
    if (error == PATINA_ERROR_MEMORY)
        return pt_fail(&device->handle, error, "%s: out of memory for rows of the picture", device->info.name);
    return error;
}

static int cpu_wait(struct patina_device *device)
{
    (void)device;
    return PATINA_OK;
}

static void cpu_watch(struct patina_device *device, void (*look)(void *context), void *context)
{
    pt_pool_watch(device->pool, look, context);
}

static void cpu_destroy(struct patina_device *device)
{
    struct cpu_device *cpu = (struct cpu_device *)device;
    for (int i = 0; i < PT_CPU_SCRATCHES; i++)
        pt_pages_free(cpu->scratch[i].memory, cpu->scratch[i].size);
    pt_pool_destroy(cpu->base.pool);
    pt_handle_destroy(&device->handle);
    free(cpu);
}

static int cpu_counts(struct patina_device *device, struct pt_counts *out)
{
    *out = (struct pt_counts){.steps = pt_pool_steps(device->pool)};
    return PATINA_OK;
}

static const struct pt_device_ops cpu_ops = {
    .destroy = cpu_destroy,
    .buffer_create = cpu_buffer_create,
    .buffer_destroy = cpu_buffer_destroy,
    .buffer_write = cpu_buffer_write,
    .buffer_read = cpu_buffer_read,
    .buffer_fill = cpu_buffer_fill,
    .run = cpu_run,
    .run_tail = cpu_run_tail,
    .wait = cpu_wait,
    .watch = cpu_watch,
    .counts = cpu_counts,
};

int pt_device_cpu_create(const patina_device_desc *desc, const char *isa, struct patina_device **out)
{
    static struct pt_once once;
    const struct pt_cpu_isa *isas[4];
    uint32_t count = available_isas(isas), chosen = 0;
    pt_once(&once, pt_cpu_tables_fill);
    while (chosen < count && strcmp(isa, "cpu") != 0 && strcmp(isa, isas[chosen]->name) != 0)
        chosen++;
    if (chosen == count)
        return pt_fail(NULL, PATINA_ERROR_UNSUPPORTED, "device %s: this processor or build has no such instruction set", isa);

    struct cpu_device *cpu = calloc(1, sizeof *cpu);
    struct pt_pool *pool = pt_pool_create(desc->threads, desc->batch);
    if (!cpu || !pool) {
        free(cpu);
        pt_pool_destroy(pool);
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "device %s: no memory or threads for %u workers", isa, desc->threads);
    }
    pt_handle_init(&cpu->base.handle);
    cpu->base.ops = &cpu_ops;
    cpu->isa = isas[chosen];
    cpu->base.pool = pool;
    cpu->base.memory_cap = desc->memory_cap;
    cpu->base.bin_threads = pt_pool_threads(pool);
    cpu->base.info = (patina_device_info){.struct_size = sizeof cpu->base.info, .threads = pt_pool_threads(pool)};
    snprintf(cpu->base.info.name, sizeof cpu->base.info.name, "%s", cpu->isa->name);
    pt_processor_name(cpu->base.info.description, sizeof cpu->base.info.description);
    *out = &cpu->base;
    return PATINA_OK;
}
