// SPDX-License-Identifier: GPL-3.0-or-later
// Runners of the kernels that walk points, in batches where a cloud is larger than a storage block. scatter: two 32-bit
// passes over all chunks of all instances (or one of 64 bits); lit: one instance.
#include "device_gl.h"

#include <stdlib.h>

enum {
    SLICES = 16,     // workgroups that share a chunk on a GPU: 4096 points are too many for one where cores abound
    LONG_RUN = 4096, // chunks between two looks at cancel
};

struct instance_buffers {
    enum pt_kernel kernel;
    uint32_t binding; // of chunks; positions, ids and surface follow
    const struct pt_buffer *chunks, *positions, *ids, *surface;
};

struct batch {
    uint32_t first_chunk, chunk_count;
    uint64_t first_slot, slots; // bound part
};

static int bind_batch(struct pt_gl_device *d, const struct instance_buffers *b, const struct batch *batch)
{
    const char *what = pt_kernel_names[b->kernel];
    int result = pt_gl_bind(d, b->binding, b->chunks->name, 0, b->chunks->size, what);
    if (result == PATINA_OK)
        result = pt_gl_bind(d, b->binding + 1, b->positions->name, batch->first_slot * 12, batch->slots * 12, what);
    if (result == PATINA_OK)
        result = pt_gl_bind(d, b->binding + 2, b->ids->name, batch->first_slot * 4, batch->slots * 4, what);
    if (result == PATINA_OK)
        result = pt_gl_bind(d, b->binding + 3, b->surface->name, 0, b->surface->size, what);
    return result;
}

static int run_batch(struct pt_gl_device *d, const struct instance_buffers *b, const struct batch *batch, uint32_t pass,
                     const atomic_int *cancel)
{
    int result = bind_batch(d, b, batch);
    for (uint32_t done = 0; done < batch->chunk_count && result == PATINA_OK; done += LONG_RUN) {
        uint32_t groups = batch->chunk_count - done < LONG_RUN ? batch->chunk_count - done : LONG_RUN;
        if (cancel && atomic_load(cancel))
            return pt_gl_fail(d, PATINA_ERROR_CANCELLED, "cancelled");
        d->gl.ProgramUniform1ui(d->programs[b->kernel][pass], 0, batch->first_chunk + done);
        d->gl.ProgramUniform1ui(d->programs[b->kernel][pass], 1, (GLuint)batch->first_slot);
        // llvmpipe: 1M points in 21 ms with one, 27 ms with 4: setting a chunk up costs more than idle lanes.
        result = pt_gl_dispatch(d, b->kernel, pass, groups, d->base.info.hardware ? SLICES : 1);
    }
    return result;
}

// The next run of chunks whose slots fit into a block.
static struct batch next_batch(const struct pt_gl_device *d, const struct chunk_view *chunks, uint32_t count,
                               uint32_t first)
{
    uint64_t limit = d->block_size / 12, begin = UINT64_MAX, end = 0;
    struct batch batch = {.first_chunk = first};
    for (uint32_t c = first; c < count; c++) {
        // Offsets are multiples of the driver's alignment for every element size when slots are.
        uint64_t slot = chunks[c].first - chunks[c].first % d->alignment;
        uint64_t new_begin = slot < begin ? slot : begin;
        uint64_t new_end = (uint64_t)chunks[c].first + chunks[c].padded;
        if (new_end < end)
            new_end = end;
        if (new_end - new_begin > limit && c > first)
            break;
        begin = new_begin;
        end = new_end;
        batch.chunk_count++;
    }
    batch.first_slot = begin;
    batch.slots = end - begin;
    return batch;
}

static int run_instance(struct pt_gl_device *d, const struct instance_buffers *b, uint32_t pass,
                        const atomic_int *cancel)
{
    uint32_t count = (uint32_t)(b->chunks->size / sizeof(struct chunk_view));
    if (!count)
        return PATINA_OK;
    if (b->positions->size <= d->block_size) {
        struct batch whole = {.chunk_count = count, .slots = b->ids->size / 4};
        return run_batch(d, b, &whole, pass, cancel);
    }
    struct chunk_view *chunks = malloc(b->chunks->size);
    if (!chunks)
        return pt_gl_fail(d, PATINA_ERROR_MEMORY, "out of memory");
    d->gl.BindBuffer(GL_COPY_READ_BUFFER, b->chunks->name);
    d->gl.GetBufferSubData(GL_COPY_READ_BUFFER, 0, (GLsizeiptr)(count * sizeof *chunks), chunks);
    int result = pt_gl_check(d, "reading a list of chunks");
    for (struct batch batch = {0}; batch.first_chunk < count && result == PATINA_OK;
         batch.first_chunk += batch.chunk_count) {
        batch = next_batch(d, chunks, count, batch.first_chunk);
        result = run_batch(d, b, &batch, pass, cancel);
    }
    free(chunks);
    return result;
}

int pt_gl_scatter(struct pt_gl_device *d, const struct scatter_args *args, struct pt_buffer *const *buffers,
                  uint32_t count, const atomic_int *cancel)
{
    static const char *const definitions[] = {"#define PASS 0\n", "#define PASS 1\n", "#define PASS 2\n"};
    uint32_t first = d->base.info.key64 ? 2 : 0, last = d->base.info.key64 ? 2 : 1;
    const struct pt_buffer *limit = args->behind ? buffers[1 + 4 * args->instances] : buffers[0]; // any stands in
    int result = pt_gl_bind(d, 1, buffers[0]->name, 0, buffers[0]->size, "scatter");
    if (result == PATINA_OK)
        result = pt_gl_bind(d, 6, limit->name, 0, limit->size, "scatter");
    for (uint32_t pass = first; pass <= last && result == PATINA_OK; pass++) {
        result = pt_gl_kernel_program(d, PT_KERNEL_scatter, pass, definitions[pass]);
        for (uint32_t i = 0; i < args->instances && 4 * i + 4 < count && result == PATINA_OK; i++) {
            struct instance_buffers b = {PT_KERNEL_scatter, 2, buffers[4 * i + 1], buffers[4 * i + 2], buffers[4 * i + 3],
                                         buffers[4 * i + 4]};
            result = run_instance(d, &b, pass, cancel);
        }
    }
    return result;
}

int pt_gl_lit(struct pt_gl_device *d, size_t argument_size, struct pt_buffer *const *buffers, uint32_t count,
              const atomic_int *cancel)
{
    // positions and ids are bound in parts, which here would be too large at once
    static struct pt_buffer none;
    struct pt_buffer *rest[16];
    for (uint32_t i = 0; i < count; i++)
        rest[i] = i == 4 || i == 5 ? &none : buffers[i];
    int result = pt_gl_kernel_program(d, PT_KERNEL_lit, 0, "");
    if (result == PATINA_OK)
        result = pt_gl_bind_buffers(d, PT_KERNEL_lit, argument_size, rest, count);
    struct instance_buffers b = {PT_KERNEL_lit, 4, buffers[3], buffers[4], buffers[5], buffers[6]};
    return result == PATINA_OK ? run_instance(d, &b, 0, cancel) : result;
}
