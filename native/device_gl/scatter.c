// SPDX-License-Identifier: GPL-3.0-or-later
// Runners of the kernels that walk points, in batches where a cloud is larger than a storage block. scatter: two 32-bit
// passes over all chunks of all instances (or one of 64 bits); splat: the same; blend, average, merge, differ: a pass a band of rows; shadow_test, sift,
// center, average: one instance.
#include "device_gl.h"
#include "shared/measured.h"
#include "shared/packed.h"
#include "shared/points.h"

#include <stdio.h>
#include <stdlib.h>

enum {
    SLICES = 16,       // workgroups that share a chunk on a GPU: 4096 points are too many for one where cores abound
    LONG_RUN = 4096,   // chunks between two looks at cancel
    DISC_RUN = 256,    // chunks, with discs: a list holds the large ones of a run
    CHUNK_MOST = 4096, // points of a chunk
    DISC_STEPS = 8192, // through the loops of an invocation for a large disc: see lib/disc.glsl
};

struct instance_buffers {
    const struct pt_gl_work *work;
    const struct pt_buffer_row *rows; // of the kernel, from chunks on; positions follow
    struct pt_buffer *const *buffers; // likewise, the instance's
    uint32_t count;
    uint32_t programs;               // that run one after another over each part: `pass` and those behind it
    uint32_t parts;                  // discs: workgroups for each large one; 0: no discs
    const struct chunk_view *chunks; // the list, where somebody has to look into it
};

// Of instance i: those buffers that repeat, or else those from `chunks` on.
static struct instance_buffers instance_of(const struct pt_gl_work *work, uint32_t chunks, uint32_t i)
{
    const struct pt_kernel_row *row = &pt_kernels[work->kernel];
    return (struct instance_buffers){.work = work,
                                     .rows = row->buffers + chunks,
                                     .buffers = work->buffers + chunks + (size_t)i * row->each,
                                     .count = row->fixed + row->each - chunks,
                                     .programs = 1};
}

enum { CHUNKS, POSITIONS }; // of an instance's buffers
enum { LARGE = 3 };         // programs of discs: those of large ones follow

static const struct pt_buffer *chunks_of(const struct instance_buffers *b) { return b->buffers[CHUNKS]; }

static size_t position_bytes(const struct instance_buffers *b)
{
    const uint32_t packed = b->buffers[POSITIONS]->each;
    return packed ? packed : 4 * PT_POSITION_WORDS;
}

// 0: the kernel reads no positions, and nothing that is bound in parts.
static uint64_t slots_of(const struct instance_buffers *b)
{
    return b->rows[POSITIONS].formats & 1u << PT_FORMAT_position ? b->buffers[POSITIONS]->size / position_bytes(b) : 0;
}

// Bytes a slot; 0: it is not bound in parts.
static size_t bytes_of(const struct instance_buffers *b, uint32_t k)
{
    if (!pt_gl_is_part(b->work, &b->rows[k]))
        return 0;
    return k == POSITIONS ? position_bytes(b) : b->buffers[k] ? b->buffers[k]->size / slots_of(b) : 0;
}

// Some of what its points have does; here: some does not.
static int lies_in_ranges(const struct instance_buffers *b, int *here)
{
    int some = 0;
    *here = 0;
    for (uint32_t k = 0; k < b->count; k++)
        if (pt_gl_is_part(b->work, &b->rows[k]) && b->buffers[k] && b->buffers[k]->size) {
            some = some || pt_gl_in_ranges(b->buffers[k]);
            *here = *here || !pt_gl_in_ranges(b->buffers[k]);
        }
    return some;
}

// Of what is not here, a slot's bytes, and room for so many slots.
static size_t range_bytes(const struct pt_gl_device *d, const struct instance_buffers *b, uint64_t slots, size_t *room)
{
    size_t bytes = 0;
    *room = 0;
    for (uint32_t k = 0; k < b->count; k++) {
        const size_t each = pt_gl_in_ranges(b->buffers[k]) ? bytes_of(b, k) : 0;
        bytes += each;
        *room += each ? pt_gl_range_room(d, slots * each) : 0;
    }
    return bytes;
}

static int bind_part(struct pt_gl_device *d, const struct instance_buffers *b, const struct pt_slots *part, uint32_t k,
                     size_t each)
{
    const struct pt_buffer *buffer = b->buffers[k];
    const char *kernel = pt_kernels[b->work->kernel].name;
    const size_t first = part->first * each, left = buffer->size - first;
    size_t size = part->count * each, offset = first;
    GLuint name = buffer->name;
    int result = PATINA_OK;
    if (pt_gl_in_ranges(buffer)) {
        const int culled = b->work->kernel == PT_KERNEL_scatter && k != POSITIONS;
        result = pt_gl_range_add(d, buffer, each, part, b->chunks, culled, &name, &offset);
    } else {
        size = size < left ? size : left;
    }
    if (result == PATINA_OK)
        result = b->rows[k].binding ? pt_gl_bind(d, b->rows[k].binding, name, offset, size, kernel)
                                    : pt_gl_bind_texels(d, b->rows[k].unit - 1u, name, offset, size);
    return result;
}

// In place of a block that is missing any other stands: the kernel does not touch it.
static int bind_missing(struct pt_gl_device *d, const struct instance_buffers *b, uint32_t k)
{
    if (!pt_gl_is_part(b->work, &b->rows[k]) || !b->rows[k].binding)
        return PATINA_OK;
    return pt_gl_bind(d, b->rows[k].binding, d->arguments, 0, b->work->argument_size, pt_kernels[b->work->kernel].name);
}

static int bind_batch(struct pt_gl_device *d, const struct instance_buffers *b, const struct pt_slots *part)
{
    size_t room = 0;
    int result = range_bytes(d, b, part->count, &room) ? pt_gl_range_begin(d, room) : PATINA_OK;
    for (uint32_t k = 0; k < b->count && result == PATINA_OK; k++) {
        const size_t each = bytes_of(b, k);
        result = each ? bind_part(d, b, part, k, each) : bind_missing(d, b, k);
    }
    return result;
}

static uint32_t large_binding(const struct instance_buffers *b)
{
    return b->work->kernel == PT_KERNEL_splat ? PT_BIND_splat_large : PT_BIND_blend_large;
}

// The discs that a run listed as large: its own program draws them.
static int run_large(struct pt_gl_device *d, const struct instance_buffers *b, const struct pt_slots *part, uint32_t pass)
{
    const GLuint program = d->programs[b->work->kernel][pass + LARGE];
    const int result = pt_gl_list_groups(d, large_binding(b), 1, 0, 1, b->parts);
    d->gl.ProgramUniform1ui(program, 1, (GLuint)part->first);
    d->gl.ProgramUniform1ui(program, 5, b->parts);
    return result == PATINA_OK ? pt_gl_list_dispatch(d, b->work->kernel, pass + LARGE, d->scratch[PT_GL_SCRATCH_LARGE].name, 0)
                               : result;
}

// Makes room for the large discs of a run.
static int begin_large(struct pt_gl_device *d, const struct instance_buffers *b)
{
    const uint64_t slots = slots_of(b), most = (uint64_t)DISC_RUN * CHUNK_MOST;
    return pt_gl_list_begin(d, PT_GL_SCRATCH_LARGE, large_binding(b), 8 * (size_t)(slots < most ? slots : most));
}

// Of a part that is bound.
static int run_pass(struct pt_gl_device *d, const struct instance_buffers *b, const struct pt_slots *part, uint32_t pass)
{
    const uint32_t run = b->parts ? DISC_RUN : LONG_RUN;
    int result = PATINA_OK;
    for (uint32_t done = 0; done < part->chunk_count && result == PATINA_OK; done += run) {
        uint32_t groups = part->chunk_count - done < run ? part->chunk_count - done : run;
        if (b->parts && (result = begin_large(d, b)) != PATINA_OK)
            break;
        d->gl.ProgramUniform1ui(d->programs[b->work->kernel][pass], 0, part->first_chunk + done);
        if (slots_of(b))
            d->gl.ProgramUniform1ui(d->programs[b->work->kernel][pass], 1, (GLuint)part->first);
        // llvmpipe: 1M points in 21 ms with one, 27 ms with 4: setting a chunk up costs more than idle lanes.
        result = pt_gl_dispatch(d, b->work->kernel, pass, groups, d->base.info.hardware ? SLICES : 1);
        if (b->parts && result == PATINA_OK)
            result = run_large(d, b, part, pass);
    }
    return result;
}

static int run_part(struct pt_gl_device *d, const struct instance_buffers *b, const struct pt_slots *part, uint32_t pass)
{
    int result = bind_batch(d, b, part);
    for (uint32_t i = 0; i < b->programs && result == PATINA_OK; i++)
        result = run_pass(d, b, part, pass + i);
    return result;
}

// That fit into a block, and a texture of words; packed ones would fit as well.
static uint64_t most_slots(const struct pt_gl_device *d)
{
    const uint64_t in_block = d->block_size / (4 * PT_POSITION_WORDS), in_texture = d->texels / PT_POSITION_WORDS;
    return in_block < in_texture ? in_block : in_texture;
}

// How many slots a part has at most, and what its first is a multiple of.
// Returns whether they come in ranges.
static int limits_of(const struct pt_gl_device *d, const struct instance_buffers *b, uint64_t *most, uint64_t *alignment)
{
    size_t room;
    int here;
    *most = most_slots(d);
    *alignment = d->alignment; // offsets are multiples of the driver's alignment for every element size when slots are
    if (!lies_in_ranges(b, &here))
        return 0;
    const uint64_t in_range = d->base.ranges.most / range_bytes(d, b, 0, &room);
    *most = *most < in_range ? *most : in_range;
    *alignment = here ? d->alignment : PT_SLOTS_A_WORD; // a range lies where it may
    return 1;
}

// The list, read back where nobody has it any longer.
static int read_chunks(struct pt_gl_device *d, const struct pt_buffer *list, struct chunk_view **copy)
{
    *copy = malloc(list->size);
    if (!*copy)
        return pt_gl_fail(d, PATINA_ERROR_MEMORY, "out of memory");
    return pt_gl_read(d, list->name, 0, list->size, *copy);
}

static int run_instance(struct pt_gl_device *d, struct instance_buffers *b, uint32_t pass)
{
    const struct pt_buffer *list = chunks_of(b);
    const uint32_t count = (uint32_t)(list->size / sizeof(struct chunk_view));
    uint64_t most, alignment;
    struct chunk_view *copy = NULL;
    if (!count)
        return PATINA_OK;
    const int in_ranges = limits_of(d, b, &most, &alignment);
    if (slots_of(b) <= most && !in_ranges) {
        const struct pt_slots whole = {.chunk_count = count, .count = slots_of(b)};
        return run_part(d, b, &whole, pass);
    }
    int result = list->source ? PATINA_OK : read_chunks(d, list, &copy);
    b->chunks = list->source ? list->source : copy;
    for (struct pt_slots part = {0}; part.first_chunk < count && result == PATINA_OK; part.first_chunk += part.chunk_count) {
        part = pt_next_slots(b->chunks, count, part.first_chunk, most, alignment);
        result = run_part(d, b, &part, pass);
    }
    free(copy);
    return result;
}

// Of scatter and splat, by pass.
static const char *const passes[] = {"#define PASS 0\n", "#define PASS 1\n", "#define PASS 2\n"};

// Whether some cloud's points come in ranges: then both passes run over each, for it would be copied twice.
static int any_in_ranges(const struct pt_gl_work *work, uint32_t chunks, uint32_t instances)
{
    int some = 0, here;
    for (uint32_t i = 0; i < instances; i++) {
        const struct instance_buffers b = instance_of(work, chunks, i);
        some = some || lies_in_ranges(&b, &here);
    }
    return some;
}

// The programs from `first` on, of each instance in turn.
static int scatter_all(struct pt_gl_device *d, const struct pt_gl_work *work, uint32_t first, uint32_t programs)
{
    const struct scatter_args *args = work->arguments;
    int result = PATINA_OK;
    for (uint32_t i = 0; i < args->instances && result == PATINA_OK; i++) {
        struct instance_buffers b = instance_of(work, PT_BUF_scatter_chunks, i);
        b.programs = programs;
        result = pt_gl_bind_rows(d, work, PT_BUF_scatter_chunks, b.count, b.buffers);
        if (result == PATINA_OK)
            result = run_instance(d, &b, first);
    }
    return result;
}

int pt_gl_scatter(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    const struct scatter_args *args = work->arguments;
    const uint32_t first = d->base.info.key64 ? 2 : 0, last = d->base.info.key64 ? 2 : 1;
    const uint32_t ranges = first < last && any_in_ranges(work, PT_BUF_scatter_chunks, args->instances);
    const uint32_t variant = 3 * args->behind + 6 * args->sifted + 12 * ranges;
    int result = PATINA_OK;
    for (uint32_t pass = first; pass <= last && result == PATINA_OK; pass++) {
        char definitions[96];
        snprintf(definitions, sizeof definitions, "%s#define RANGES %u\n#define BEHIND %u\n#define SIFTED %u\n", passes[pass],
                 ranges, args->behind, args->sifted);
        result = pt_gl_kernel_program(d, PT_KERNEL_scatter, variant + pass, definitions);
    }
    if (ranges)
        return result == PATINA_OK ? scatter_all(d, work, variant, 2) : result;
    for (uint32_t pass = first; pass <= last && result == PATINA_OK; pass++)
        result = scatter_all(d, work, variant + pass, 1);
    return result;
}

// ---- discs ---------------------------------------------------------------------------------------------------------------

static int disc_programs(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t pass, const char *definition)
{
    int result = PATINA_OK;
    for (uint32_t large = 0; large < 2 && result == PATINA_OK; large++) {
        char definitions[96];
        snprintf(definitions, sizeof definitions, "%s#define LARGE %u\n", definition, large);
        result = pt_gl_kernel_program(d, kernel, pass + LARGE * large, definitions);
    }
    return result;
}

// All points of instance i, whose buffers are those from `chunks` on. At most so many pixels each.
static int run_discs(struct pt_gl_device *d, const struct pt_gl_work *work, uint32_t chunks, uint32_t pass, uint32_t programs,
                     uint32_t i, uint32_t width, uint32_t height)
{
    const uint64_t steps = (uint64_t)(width / 8 + 2) * (height / 8 + 1), fewest = d->base.info.hardware ? 8 : 1;
    const uint64_t parts = (steps + DISC_STEPS - 1) / DISC_STEPS;
    struct instance_buffers b = instance_of(work, chunks, i);
    int result = pt_gl_bind_rows(d, work, chunks, b.count, b.buffers);
    b.programs = programs;
    b.parts = (uint32_t)(parts < fewest ? fewest : parts);
    for (uint32_t k = pass; k < pass + programs; k++) {
        d->gl.ProgramUniform1ui(d->programs[work->kernel][k], 2, i);
        d->gl.ProgramUniform1ui(d->programs[work->kernel][k + LARGE], 2, i);
    }
    return result == PATINA_OK ? run_instance(d, &b, pass) : result;
}

int pt_gl_splat(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    const struct splat_args *args = work->arguments;
    uint32_t first = d->base.info.key64 ? 2 : 0, last = d->base.info.key64 ? 2 : 1;
    int result = PATINA_OK;
    const uint32_t together = any_in_ranges(work, PT_BUF_splat_chunks, args->instances) ? last - first + 1 : 1;
    for (uint32_t pass = first; pass <= last && result == PATINA_OK; pass++)
        result = disc_programs(d, PT_KERNEL_splat, pass, passes[pass]);
    for (uint32_t pass = first; pass <= last && result == PATINA_OK; pass += together)
        for (uint32_t i = 0; i < args->instances && result == PATINA_OK; i++)
            result = run_discs(d, work, PT_BUF_splat_chunks, pass, together, i, args->view.width, args->view.height);
    return result;
}

enum { ADD = 0, MEAN = 1, PART = 2 * LARGE, BAND_BYTES = 1 << 26, SUM_BYTES = 80 }; // blend sums ten, two words each

// Room for the sums of as many rows as fit, at most `height`; bound.
static int make_sums(struct pt_gl_device *d, uint32_t width, uint32_t height, uint32_t binding, const char *what,
                     uint32_t *rows)
{
    const size_t most = d->block_size < BAND_BYTES ? d->block_size : BAND_BYTES;
    *rows = (uint32_t)(most / SUM_BYTES / width);
    *rows = *rows < 1 ? 1 : *rows < height ? *rows : height;
    const size_t size = (size_t)*rows * width * SUM_BYTES;
    const int result = pt_gl_scratch(d, PT_GL_SCRATCH_SUMS, size, 0);
    return result == PATINA_OK ? pt_gl_bind(d, binding, d->scratch[PT_GL_SCRATCH_SUMS].name, 0, size, what) : result;
}

static int clear_sums(struct pt_gl_device *d, uint32_t width, uint32_t rows)
{
    return pt_gl_clear(d, d->scratch[PT_GL_SCRATCH_SUMS].name, 0, (size_t)rows * width * SUM_BYTES, (const uint32_t[4]){0});
}

static int blend_band(struct pt_gl_device *d, const struct pt_gl_work *work, uint32_t first, uint32_t end)
{
    const struct blend_args *args = work->arguments;
    const uint32_t width = args->view.width, part = PART * args->part;
    int result = clear_sums(d, width, end - first);
    for (uint32_t step = 0; step < 3; step++) {
        const GLuint program = d->programs[PT_KERNEL_blend][part + (step == 2 ? ADD + LARGE : step)];
        d->gl.ProgramUniform1i(program, 3, (GLint)first);
        d->gl.ProgramUniform1i(program, 4, (GLint)end);
    }
    for (uint32_t i = 0; i < args->instances && result == PATINA_OK; i++)
        result = run_discs(d, work, PT_BUF_blend_chunks, part + ADD, 1, i, width, end - first);
    static const uint32_t shared[] = {PT_BUF_blend_offset, PT_BUF_blend_normal}; // with large discs, and marks
    for (uint32_t i = 0; i < 2 && result == PATINA_OK; i++)
        result = pt_gl_bind_rows(d, work, shared[i], 1, work->buffers + shared[i]);
    if (result != PATINA_OK)
        return result;
    return pt_gl_dispatch(d, PT_KERNEL_blend, part + MEAN, (width + 31) / 32, (end - first + 7) / 8);
}

// Sums nothing.
static int blend_marks(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    const struct blend_args *args = work->arguments;
    const uint32_t part = PART * PT_BLEND_MARKS + ADD, width = args->view.width, height = args->view.height;
    int result = PATINA_OK;
    for (uint32_t large = 0; large <= LARGE; large += LARGE) {
        d->gl.ProgramUniform1i(d->programs[PT_KERNEL_blend][part + large], 3, 0);
        d->gl.ProgramUniform1i(d->programs[PT_KERNEL_blend][part + large], 4, (GLint)height);
    }
    for (uint32_t i = 0; i < args->instances && result == PATINA_OK; i++)
        result = run_discs(d, work, PT_BUF_blend_chunks, part, 1, i, width, height);
    return result;
}

int pt_gl_blend(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    const struct blend_args *args = work->arguments;
    const uint32_t height = args->view.height;
    const uint32_t part = PART * args->part;
    uint32_t rows = height;
    char step[2][64];
    for (int i = 0; i < 2; i++)
        snprintf(step[i], sizeof step[i], "#define STEP %d\n#define PART %u\n", i, args->part);
    int result = disc_programs(d, PT_KERNEL_blend, part + ADD, step[0]);
    if (args->part == PT_BLEND_MARKS)
        return result == PATINA_OK ? blend_marks(d, work) : result;
    if (result == PATINA_OK)
        result = pt_gl_kernel_program(d, PT_KERNEL_blend, part + MEAN, step[1]);
    if (result == PATINA_OK)
        result = make_sums(d, args->view.width, height, PT_BIND_blend_sums, "blend", &rows);
    for (uint32_t y = 0; y < height && result == PATINA_OK; y += rows)
        result = blend_band(d, work, y, y + rows < height ? y + rows : height);
    return result;
}

// Of average: where its sums are empty pixels show their own points' colours.
static int bind_shown_colors(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    struct pt_buffer gathered, *colors = work->buffers[PT_BUF_average_colors];
    int result = PATINA_OK;
    if (!colors || !colors->size)
        return PATINA_OK;
    if (pt_gl_in_ranges(colors)) {
        result = pt_gl_gather_winners(d, work, colors, 0, &gathered);
        colors = &gathered;
    }
    return result == PATINA_OK ? pt_gl_bind(d, PT_BIND_average_colors, colors->name, 0, colors->size, "average") : result;
}

// Of average, merge and differ, whose arguments begin with their view.
static int mean_band(struct pt_gl_device *d, struct instance_buffers *b, uint32_t first, uint32_t end)
{
    const struct view_args *view = b->work->arguments;
    const enum pt_kernel kernel = b->work->kernel;
    int result = clear_sums(d, view->width, end - first);
    for (uint32_t step = ADD; step <= MEAN; step++) {
        d->gl.ProgramUniform1i(d->programs[kernel][step], 3, (GLint)first);
        d->gl.ProgramUniform1i(d->programs[kernel][step], 4, (GLint)end);
    }
    if (result == PATINA_OK)
        result = run_instance(d, b, ADD);
    if (result == PATINA_OK && kernel == PT_KERNEL_average)
        result = bind_shown_colors(d, b->work);
    return result == PATINA_OK ? pt_gl_dispatch(d, kernel, MEAN, (view->width + 31) / 32, (end - first + 7) / 8) : result;
}

static int means(struct pt_gl_device *d, const struct pt_gl_work *work, uint32_t chunks, uint32_t sums)
{
    const struct view_args *view = work->arguments;
    const uint32_t begin = view->rect[1], last = view->rect[3];
    struct instance_buffers b = instance_of(work, chunks, 0);
    uint32_t rows = 1;
    if (begin >= last)
        return PATINA_OK;
    int result = pt_gl_kernel_program(d, work->kernel, ADD, "#define STEP 0\n");
    if (result == PATINA_OK)
        result = pt_gl_kernel_program(d, work->kernel, MEAN, "#define STEP 1\n");
    if (result == PATINA_OK)
        result = make_sums(d, view->width, last - begin, sums, pt_kernels[work->kernel].name, &rows);
    for (uint32_t y = begin; y < last && result == PATINA_OK; y += rows)
        result = mean_band(d, &b, y, y + rows < last ? y + rows : last);
    return result;
}

int pt_gl_average(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    return work->buffers[PT_BUF_average_chunks]->size ? means(d, work, PT_BUF_average_chunks, PT_BIND_average_sums) : PATINA_OK;
}

int pt_gl_merge(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    return means(d, work, PT_BUF_merge_chunks, PT_BIND_merge_sums);
}

int pt_gl_differ(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    return means(d, work, PT_BUF_differ_chunks, PT_BIND_differ_sums);
}

int pt_gl_points_of(struct pt_gl_device *d, const struct pt_gl_work *work, uint32_t variant)
{
    const struct pt_kernel_row *row = &pt_kernels[work->kernel];
    uint32_t chunks = 0;
    while (!(row->buffers[chunks].formats & 1u << PT_FORMAT_chunk))
        chunks++;
    struct instance_buffers b = instance_of(work, chunks, 0);
    return run_instance(d, &b, variant);
}

int pt_gl_points(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    int result = pt_gl_kernel_program(d, work->kernel, 0, "");
    return result == PATINA_OK ? pt_gl_points_of(d, work, 0) : result;
}
