// SPDX-License-Identifier: GPL-3.0-or-later
// Runners of the kernels that walk points, in batches where a cloud is larger than a storage block. scatter: two 32-bit
// passes over all chunks of all instances (or one of 64 bits); splat: the same; blend, average: a pass a band of rows; lit, sift,
// center, average: one instance.
#include "device_gl.h"

#include <stdio.h>
#include <stdlib.h>

enum {
    SLICES = 16,     // workgroups that share a chunk on a GPU: 4096 points are too many for one where cores abound
    LONG_RUN = 4096, // chunks between two looks at cancel
    DISC_RUN = 256,  // chunks, with discs: a list holds the large ones of a run
    CHUNK_MOST = 4096, // points of a chunk
    DISC_STEPS = 8192, // through the loops of an invocation for a large disc: see lib/disc.glsl
};

struct instance_buffers {
    enum pt_kernel kernel;
    uint32_t binding; // of chunks; positions and surface follow
    const struct pt_buffer *chunks, *positions, *surface; // surface: NULL where none is read
    uint32_t large, parts; // discs: the program of large ones, and workgroups for each; 0: no discs
};

struct batch {
    uint32_t first_chunk, chunk_count;
    uint64_t first_slot, slots; // bound part
};

static int bind_batch(struct pt_gl_device *d, const struct instance_buffers *b, const struct batch *batch)
{
    const char *what = pt_kernel_names[b->kernel];
    int result = pt_gl_bind(d, b->binding, b->chunks->name, 0, b->chunks->size, what);
    if (b->kernel == PT_KERNEL_scatter) { // both as textures
        const size_t first = batch->first_slot * 4, left = b->surface->size - first, size = batch->slots * 4;
        if (result == PATINA_OK)
            result = pt_gl_bind_texels(d, 5, b->surface->name, first, size < left ? size : left);
        if (result == PATINA_OK)
            result = pt_gl_bind_texels(d, 2, b->positions->name, 3 * first, 3 * size);
        return result;
    }
    if (result == PATINA_OK)
        result = pt_gl_bind(d, b->binding + 1, b->positions->name, batch->first_slot * 12, batch->slots * 12, what);
    if (result == PATINA_OK && b->surface)
        result = pt_gl_bind(d, b->binding + 2, b->surface->name, 0, b->surface->size, what);
    return result;
}

// The discs that a run listed as large: its own program draws them.
static int run_large(struct pt_gl_device *d, const struct instance_buffers *b, const struct batch *batch)
{
    const GLuint program = d->programs[b->kernel][b->large];
    uint32_t count = 0, x, y;
    d->gl.BindBuffer(GL_COPY_READ_BUFFER, d->scratch[PT_GL_SCRATCH_LARGE].name);
    d->gl.GetBufferSubData(GL_COPY_READ_BUFFER, 0, sizeof count, &count);
    pt_gl_grid(count * b->parts, &x, &y);
    d->gl.ProgramUniform1ui(program, 1, (GLuint)batch->first_slot);
    d->gl.ProgramUniform1ui(program, 5, b->parts);
    return pt_gl_dispatch(d, b->kernel, b->large, x, y);
}

// Makes room for the large discs of a run.
static int begin_large(struct pt_gl_device *d, const struct instance_buffers *b)
{
    const uint32_t none = 0;
    const uint64_t slots = b->positions->size / 12, most = (uint64_t)DISC_RUN * CHUNK_MOST;
    const size_t size = 4 + 8 * (size_t)(slots < most ? slots : most);
    int result = pt_gl_scratch(d, PT_GL_SCRATCH_LARGE, size, 0);
    if (result == PATINA_OK)
        result = pt_gl_bind(d, 10, d->scratch[PT_GL_SCRATCH_LARGE].name, 0, size, pt_kernel_names[b->kernel]);
    d->gl.BindBuffer(GL_COPY_WRITE_BUFFER, d->scratch[PT_GL_SCRATCH_LARGE].name);
    d->gl.BufferSubData(GL_COPY_WRITE_BUFFER, 0, sizeof none, &none);
    return result;
}

static int run_batch(struct pt_gl_device *d, const struct instance_buffers *b, const struct batch *batch, uint32_t pass,
                     const atomic_int *cancel)
{
    int result = bind_batch(d, b, batch);
    const uint32_t run = b->parts ? DISC_RUN : LONG_RUN;
    for (uint32_t done = 0; done < batch->chunk_count && result == PATINA_OK; done += run) {
        uint32_t groups = batch->chunk_count - done < run ? batch->chunk_count - done : run;
        if (cancel && atomic_load(cancel))
            return pt_gl_fail(d, PATINA_ERROR_CANCELLED, "cancelled");
        if (b->parts && (result = begin_large(d, b)) != PATINA_OK)
            break;
        d->gl.ProgramUniform1ui(d->programs[b->kernel][pass], 0, batch->first_chunk + done);
        d->gl.ProgramUniform1ui(d->programs[b->kernel][pass], 1, (GLuint)batch->first_slot);
        // llvmpipe: 1M points in 21 ms with one, 27 ms with 4: setting a chunk up costs more than idle lanes.
        result = pt_gl_dispatch(d, b->kernel, pass, groups, d->base.info.hardware ? SLICES : 1);
        if (b->parts && result == PATINA_OK)
            result = run_large(d, b, batch);
    }
    return result;
}

// That fit into a block, and a texture.
static uint64_t most_slots(const struct pt_gl_device *d)
{
    return d->block_size / 12 < d->texels / 3 ? d->block_size / 12 : d->texels / 3;
}

// The next run of chunks whose slots fit.
static struct batch next_batch(const struct pt_gl_device *d, const struct chunk_view *chunks, uint32_t count,
                               uint32_t first)
{
    uint64_t limit = most_slots(d), begin = UINT64_MAX, end = 0;
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
    if (b->positions->size / 12 <= most_slots(d)) {
        struct batch whole = {.chunk_count = count, .slots = b->positions->size / 12};
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

// Of scatter and splat, by pass.
static const char *const passes[] = {"#define PASS 0\n", "#define PASS 1\n", "#define PASS 2\n"};

int pt_gl_scatter(struct pt_gl_device *d, const struct scatter_args *args, struct pt_buffer *const *buffers,
                  uint32_t count, const atomic_int *cancel)
{
    uint32_t first = d->base.info.key64 ? 2 : 0, last = d->base.info.key64 ? 2 : 1;
    const struct pt_buffer *limit = args->behind ? buffers[1 + 3 * args->instances] : buffers[0]; // any stands in
    const struct pt_buffer *drawn = args->sifted ? buffers[1 + 3 * args->instances + args->behind] : buffers[0];
    int result = pt_gl_bind(d, 1, buffers[0]->name, 0, buffers[0]->size, "scatter");
    if (result == PATINA_OK)
        result = pt_gl_bind_texture(d, 0, buffers[0]);
    if (result == PATINA_OK)
        result = pt_gl_bind(d, 5, limit->name, 0, limit->size, "scatter");
    if (result == PATINA_OK)
        result = pt_gl_bind(d, 6, drawn->name, 0, drawn->size, "scatter");
    for (uint32_t pass = first; pass <= last && result == PATINA_OK; pass++) {
        const uint32_t variant = pass + 3 * args->behind + 6 * args->sifted;
        char definitions[64];
        snprintf(definitions, sizeof definitions, "%s#define BEHIND %u\n#define SIFTED %u\n", passes[pass], args->behind,
                 args->sifted);
        result = pt_gl_kernel_program(d, PT_KERNEL_scatter, variant, definitions);
        for (uint32_t i = 0; i < args->instances && 3 * i + 3 < count && result == PATINA_OK; i++) {
            struct instance_buffers b = {PT_KERNEL_scatter, 2, buffers[3 * i + 1], buffers[3 * i + 2], buffers[3 * i + 3], 0, 0};
            result = run_instance(d, &b, variant, cancel);
        }
    }
    return result;
}

// ---- discs ---------------------------------------------------------------------------------------------------------------

// Programs of discs: those of large ones follow.
enum { LARGE = 3 };

static int disc_programs(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t pass, const char *definition)
{
    int result = PATINA_OK;
    for (uint32_t large = 0; large < 2 && result == PATINA_OK; large++) {
        char definitions[64];
        snprintf(definitions, sizeof definitions, "%s#define LARGE %u\n", definition, large);
        result = pt_gl_kernel_program(d, kernel, pass + LARGE * large, definitions);
    }
    return result;
}

// All points of instance i, whose buffers start at buffers[0]: chunks, positions, surface, radii and the rest up to `count`,
// from binding 2 on. At most so many pixels each.
static int run_discs(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t pass, uint32_t i, struct pt_buffer *const *buffers,
                     uint32_t count, uint32_t width, uint32_t height, const atomic_int *cancel)
{
    const uint64_t steps = (uint64_t)(width / 8 + 2) * (height / 8 + 1), fewest = d->base.info.hardware ? 8 : 1;
    const uint64_t parts = (steps + DISC_STEPS - 1) / DISC_STEPS;
    struct instance_buffers b = {kernel, 2, buffers[0], buffers[1], buffers[2], pass + LARGE,
                                 (uint32_t)(parts < fewest ? fewest : parts)};
    int result = PATINA_OK;
    for (uint32_t k = 3; k < count && result == PATINA_OK; k++) {
        int missing = !buffers[k] || !buffers[k]->name; // any stands in
        result = pt_gl_bind(d, 2 + k, missing ? d->arguments : buffers[k]->name, 0,
                            missing ? sizeof(struct splat_args) : buffers[k]->size, pt_kernel_names[kernel]);
    }
    d->gl.ProgramUniform1ui(d->programs[kernel][pass], 2, i);
    d->gl.ProgramUniform1ui(d->programs[kernel][pass + LARGE], 2, i);
    return result == PATINA_OK ? run_instance(d, &b, pass, cancel) : result;
}

int pt_gl_splat(struct pt_gl_device *d, const struct splat_args *args, struct pt_buffer *const *buffers,
                const atomic_int *cancel)
{
    uint32_t first = d->base.info.key64 ? 2 : 0, last = d->base.info.key64 ? 2 : 1;
    const struct pt_buffer *limit = args->behind ? buffers[1 + 4 * args->instances] : buffers[0]; // any stands in
    int result = pt_gl_bind(d, 1, buffers[0]->name, 0, buffers[0]->size, "splat");
    if (result == PATINA_OK)
        result = pt_gl_bind(d, 6, limit->name, 0, limit->size, "splat");
    if (result == PATINA_OK && args->sifted)
        result = pt_gl_bind_texture(d, 5, buffers[1 + 4 * args->instances + args->behind]);
    for (uint32_t pass = first; pass <= last && result == PATINA_OK; pass++) {
        result = disc_programs(d, PT_KERNEL_splat, pass, passes[pass]);
        for (uint32_t i = 0; i < args->instances && result == PATINA_OK; i++)
            result = run_discs(d, PT_KERNEL_splat, pass, i, buffers + 1 + 4 * i, 4, args->view.width, args->view.height, cancel);
    }
    return result;
}

enum { ADD = 0, MEAN = 1, BAND_BYTES = 1 << 26, SUM_BYTES = 64 };

// Room for the sums of as many rows as fit, at most `height`; bound.
static int make_sums(struct pt_gl_device *d, uint32_t width, uint32_t height, const char *what, uint32_t *rows)
{
    const size_t most = d->block_size < BAND_BYTES ? d->block_size : BAND_BYTES;
    *rows = (uint32_t)(most / SUM_BYTES / width);
    *rows = *rows < 1 ? 1 : *rows < height ? *rows : height;
    const size_t size = (size_t)*rows * width * SUM_BYTES;
    const int result = pt_gl_scratch(d, PT_GL_SCRATCH_SUMS, size, 0);
    return result == PATINA_OK ? pt_gl_bind(d, 1, d->scratch[PT_GL_SCRATCH_SUMS].name, 0, size, what) : result;
}

static void clear_sums(struct pt_gl_device *d, uint32_t width, uint32_t rows)
{
    const uint32_t zero = 0;
    d->gl.BindBuffer(GL_COPY_WRITE_BUFFER, d->scratch[PT_GL_SCRATCH_SUMS].name);
    d->gl.ClearBufferSubData(GL_COPY_WRITE_BUFFER, GL_R32UI, 0, (GLsizeiptr)((size_t)rows * width * SUM_BYTES), GL_RED_INTEGER,
                             GL_UNSIGNED_INT, &zero);
    d->gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
}

static int blend_band(struct pt_gl_device *d, const struct blend_args *args, struct pt_buffer *const *buffers, uint32_t first,
                      uint32_t end, const atomic_int *cancel)
{
    const uint32_t width = args->view.width;
    int result = PATINA_OK;
    clear_sums(d, width, end - first);
    for (uint32_t step = 0; step < 3; step++) {
        const GLuint program = d->programs[PT_KERNEL_blend][step == 2 ? ADD + LARGE : step];
        d->gl.ProgramUniform1i(program, 3, (GLint)first);
        d->gl.ProgramUniform1i(program, 4, (GLint)end);
    }
    for (uint32_t i = 0; i < args->instances && result == PATINA_OK; i++)
        result = run_discs(d, PT_KERNEL_blend, ADD, i, buffers + 5 + 6 * i, 6, width, end - first, cancel);
    return result == PATINA_OK ? pt_gl_dispatch(d, PT_KERNEL_blend, MEAN, (width + 31) / 32, (end - first + 7) / 8) : result;
}

int pt_gl_blend(struct pt_gl_device *d, const struct blend_args *args, struct pt_buffer *const *buffers,
                const atomic_int *cancel)
{
    const uint32_t height = args->view.height;
    uint32_t rows = height;
    int result = disc_programs(d, PT_KERNEL_blend, ADD, "#define STEP 0\n");
    if (result == PATINA_OK)
        result = pt_gl_kernel_program(d, PT_KERNEL_blend, MEAN, "#define STEP 1\n#define LARGE 1\n");
    if (result == PATINA_OK)
        result = make_sums(d, args->view.width, height, "blend", &rows);
    if (result == PATINA_OK)
        result = pt_gl_bind(d, 8, buffers[2]->name, 0, buffers[2]->size, "blend");
    if (result == PATINA_OK)
        result = pt_gl_bind(d, 9, buffers[3]->name, 0, buffers[3]->size, "blend");
    if (result == PATINA_OK)
        result = pt_gl_bind(d, 11, buffers[4]->name, 0, buffers[4]->size, "blend");
    if (result == PATINA_OK)
        result = pt_gl_bind_texture(d, 0, buffers[0]);
    if (result == PATINA_OK)
        result = pt_gl_bind_texture(d, 2, buffers[1]);
    if (result == PATINA_OK && args->sifted)
        result = pt_gl_bind_texture(d, 5, buffers[5 + 6 * args->instances]);
    for (uint32_t y = 0; y < height && result == PATINA_OK; y += rows)
        result = blend_band(d, args, buffers, y, y + rows < height ? y + rows : height, cancel);
    return result;
}

// The instance's buffers begin at buffers[5]: chunks, positions, surface, colours, and words of what is drawn.
static int bind_average(struct pt_gl_device *d, const struct average_args *args, struct pt_buffer *const *buffers)
{
    const struct pt_buffer *const planes[] = {args->sifted ? buffers[9] : NULL, buffers[8], buffers[3], buffers[4]};
    int result = PATINA_OK;
    for (uint32_t k = 0; k < 4 && result == PATINA_OK; k++) {
        const int missing = !planes[k] || !planes[k]->name; // any stands in
        result = pt_gl_bind(d, 5 + k, missing ? d->arguments : planes[k]->name, 0, missing ? sizeof *args : planes[k]->size,
                            "average");
    }
    for (uint32_t k = 0; k < 3 && result == PATINA_OK; k++) // keys, from, deff
        result = pt_gl_bind_texture(d, k, buffers[k]);
    return result;
}

static int average_band(struct pt_gl_device *d, const struct average_args *args, const struct instance_buffers *b, uint32_t first,
                        uint32_t end, const atomic_int *cancel)
{
    const uint32_t width = args->view.width;
    clear_sums(d, width, end - first);
    for (uint32_t step = ADD; step <= MEAN; step++) {
        d->gl.ProgramUniform1i(d->programs[PT_KERNEL_average][step], 3, (GLint)first);
        d->gl.ProgramUniform1i(d->programs[PT_KERNEL_average][step], 4, (GLint)end);
    }
    int result = run_instance(d, b, ADD, cancel);
    return result == PATINA_OK ? pt_gl_dispatch(d, PT_KERNEL_average, MEAN, (width + 31) / 32, (end - first + 7) / 8) : result;
}

int pt_gl_average(struct pt_gl_device *d, const struct average_args *args, struct pt_buffer *const *buffers,
                  const atomic_int *cancel)
{
    const uint32_t begin = args->view.rect[1], last = args->view.rect[3];
    const struct instance_buffers b = {PT_KERNEL_average, 2, buffers[5], buffers[6], buffers[7], 0, 0};
    uint32_t rows = 1;
    if (begin >= last || !buffers[5]->size)
        return PATINA_OK;
    int result = pt_gl_kernel_program(d, PT_KERNEL_average, ADD, "#define STEP 0\n");
    if (result == PATINA_OK)
        result = pt_gl_kernel_program(d, PT_KERNEL_average, MEAN, "#define STEP 1\n");
    if (result == PATINA_OK)
        result = make_sums(d, args->view.width, last - begin, "average", &rows);
    if (result == PATINA_OK)
        result = bind_average(d, args, buffers);
    for (uint32_t y = begin; y < last && result == PATINA_OK; y += rows)
        result = average_band(d, args, &b, y, y + rows < last ? y + rows : last, cancel);
    return result;
}

int pt_gl_lit(struct pt_gl_device *d, size_t argument_size, struct pt_buffer *const *buffers, uint32_t count,
              const atomic_int *cancel)
{
    // positions are bound in parts, which here would be too large at once
    static struct pt_buffer none;
    struct pt_buffer *rest[16];
    for (uint32_t i = 0; i < count; i++)
        rest[i] = i == 4 ? &none : buffers[i];
    int result = pt_gl_kernel_program(d, PT_KERNEL_lit, 0, "");
    if (result == PATINA_OK)
        result = pt_gl_bind_buffers(d, PT_KERNEL_lit, argument_size, rest, count);
    struct instance_buffers b = {PT_KERNEL_lit, 4, buffers[3], buffers[4], buffers[5], 0, 0};
    return result == PATINA_OK ? run_instance(d, &b, 0, cancel) : result;
}

int pt_gl_sift(struct pt_gl_device *d, size_t argument_size, struct pt_buffer *const *buffers, uint32_t count,
               const atomic_int *cancel)
{
    static struct pt_buffer none;
    struct pt_buffer *rest[] = {buffers[0], &none, buffers[2], buffers[3], buffers[4], buffers[5], buffers[6]};
    int result = pt_gl_kernel_program(d, PT_KERNEL_sift, 0, "");
    if (result == PATINA_OK)
        result = pt_gl_bind_buffers(d, PT_KERNEL_sift, argument_size, rest, count);
    struct instance_buffers b = {PT_KERNEL_sift, 1, buffers[0], buffers[1], NULL, 0, 0};
    return result == PATINA_OK ? run_instance(d, &b, 0, cancel) : result;
}

int pt_gl_center(struct pt_gl_device *d, size_t argument_size, struct pt_buffer *const *buffers, uint32_t count,
                 const atomic_int *cancel)
{
    static struct pt_buffer none;
    struct pt_buffer *rest[] = {buffers[0], buffers[1], buffers[2], buffers[3], buffers[4], &none};
    int result = pt_gl_kernel_program(d, PT_KERNEL_center, 0, "");
    if (result == PATINA_OK)
        result = pt_gl_bind_buffers(d, PT_KERNEL_center, argument_size, rest, count);
    struct instance_buffers b = {PT_KERNEL_center, 5, buffers[4], buffers[5], NULL, 0, 0};
    return result == PATINA_OK ? run_instance(d, &b, 0, cancel) : result;
}
