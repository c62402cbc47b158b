// SPDX-License-Identifier: GPL-3.0-or-later
// Clouds that are larger than what the device may hold of them (SPEC 13). What their points have stays where the host has it. Kernels that
// walk points get it range by range, in two buffers by turns, so that one is filled while the other is read. Kernels that walk pixels ask
// for single points, those that pixels show: the processor looks these up, and puts them where the pixels are (lib/by_pixel.glsl).
#include "device_gl.h"
#include "shared/shadows.h"

#include <stdlib.h>
#include <string.h>

enum { PIECE = 1 << 20 }; // bytes between two looks at what the process holds of files

int pt_gl_in_ranges(const struct pt_buffer *buffer) { return buffer && buffer->size && !buffer->name && buffer->source; }

static void look(const struct pt_gl_device *d)
{
    if (d->look)
        d->look(d->watched);
}

// ---- points --------------------------------------------------------------------------------------------------------------

int pt_gl_range_begin(struct pt_gl_device *d, size_t size)
{
    const GladGLContext *gl = &d->gl;
    struct pt_gl_scratch *range = &d->halves[d->turn ^= 1];
    d->used = 0;
    d->rounds++;
    if (size <= range->size)
        return PATINA_OK;
    gl->DeleteBuffers(1, &range->name);
    pt_gl_bound_forget(d);
    *range = (struct pt_gl_scratch){0};
    gl->GenBuffers(1, &range->name);
    gl->BindBuffer(GL_COPY_WRITE_BUFFER, range->name);
    gl->BufferData(GL_COPY_WRITE_BUFFER, (GLsizeiptr)size, NULL, GL_STREAM_DRAW);
    const int result = pt_gl_check(d, "making room for a range of points");
    range->size = result == PATINA_OK ? size : 0; // a name without room is made anew
    return result;
}

size_t pt_gl_range_room(const struct pt_gl_device *d, size_t size)
{
    return (size + 16 + d->alignment - 1) / d->alignment * d->alignment; // shaders read whole words and vectors
}

// Chunks that lie beside each other at one go. culled: only of chunks whose points' normals are tested.
int pt_gl_range_add(struct pt_gl_device *d, const struct pt_buffer *buffer, size_t each, const struct pt_slots *slots,
                    const struct chunk_view *chunks, int culled, GLuint *name, size_t *offset)
{
    const struct chunk_view *chunk = chunks + slots->first_chunk, *end = chunk + slots->chunk_count;
    *name = d->halves[d->turn].name;
    *offset = d->used;
    d->used += pt_gl_range_room(d, slots->count * each);
    d->gl.BindBuffer(GL_COPY_WRITE_BUFFER, *name);
    while (chunk < end) {
        uint64_t first = chunk->first, last = first + chunk->padded;
        const int taken = !culled || chunk->cull;
        for (chunk++; chunk < end && chunk->first == last && taken == (!culled || chunk->cull); chunk++)
            last += chunk->padded;
        for (uint64_t at = first * each, to = last * each; taken && at < to; at += PIECE) {
            const size_t size = to - at < PIECE ? to - at : PIECE;
            d->gl.BufferSubData(GL_COPY_WRITE_BUFFER, (GLintptr)(*offset + at - slots->first * each), (GLsizeiptr)size,
                                (const char *)buffer->source + at);
            d->base.ranges.read += size;
            look(d);
        }
    }
    return pt_gl_check(d, "copying a range of points");
}

// ---- pixels --------------------------------------------------------------------------------------------------------------

struct points {
    const uint8_t *source;
    size_t each;
    uint32_t base, first, count; // as in instance_args
};

// Of the points of a buffer that the kernel asks for: those with these ids. Arguments begin with the view and the instance, but where
// they name a caster in its place.
static struct points points_of(const struct pt_gl_work *work, const struct pt_buffer *buffer)
{
    const struct instance_args *instance = (const void *)((const char *)work->arguments + sizeof(struct view_args));
    struct points points = {.source = buffer->source, .each = 1, .count = (uint32_t)buffer->size}; // opacities
    if (work->kernel == PT_KERNEL_limit)
        points.base = ((const struct limit_args *)work->arguments)->caster;
    else if (work->kernel == PT_KERNEL_shadow_test)
        points.base = ((const struct shadow_test_args *)work->arguments)->caster;
    else
        points = (struct points){buffer->source, buffer->size / instance->slots, instance->id_base, instance->id_first,
                                 instance->id_count};
    return points;
}

static void gather(const struct points *points, const uint32_t *keys, size_t count, uint8_t *to)
{
    for (size_t i = 0; i < count; i++, to += points->each) {
        const uint32_t id = keys[2 * i] - points->base;
        if (id - points->first >= points->count || keys[2 * i + 1] == PT_KEY_EMPTY_Z)
            continue;
        const uint8_t *from = points->source + id * points->each;
        switch (points->each) {
        case 1: *to = *from; break;
        case 3: memcpy(to, from, 3); break;
        case 4: memcpy(to, from, 4); break;
        default: memcpy(to, from, points->each);
        }
    }
}

// The keys that say which: always the kernel's first plane.
static int read_keys(struct pt_gl_device *d, const struct pt_buffer *keys)
{
    if (d->host_size < keys->size) {
        free(d->host);
        d->host = malloc(keys->size);
        d->host_size = d->host ? keys->size : 0;
    }
    if (!d->host)
        return pt_gl_fail(d, PATINA_ERROR_MEMORY, "out of memory");
    return pt_gl_read(d, keys->name, 0, keys->size, d->host);
}

int pt_gl_gather_winners(struct pt_gl_device *d, const struct pt_gl_work *work, const struct pt_buffer *buffer, uint32_t place,
                         struct pt_buffer *out)
{
    const struct view_args *view = work->arguments;
    const struct pt_buffer *keys = *work->buffers;
    const struct points points = points_of(work, buffer);
    const size_t size = keys->size / 8 * points.each, row = view->width;
    const enum pt_gl_scratch_use use = PT_GL_SCRATCH_WINNERS + place;
    int result = read_keys(d, keys);
    if (result == PATINA_OK)
        result = pt_gl_scratch(d, use, size + 16, 0);
    if (result != PATINA_OK || !size)
        return result;
    *out = (struct pt_buffer){.size = size, .room = size, .name = d->scratch[use].name};
    d->gl.BindBuffer(GL_COPY_WRITE_BUFFER, out->name);
    uint8_t *to = d->gl.MapBufferRange(GL_COPY_WRITE_BUFFER, 0, (GLsizeiptr)size,
                                       GL_MAP_WRITE_BIT | GL_MAP_INVALIDATE_BUFFER_BIT);
    for (size_t at = 0; to && at < keys->size / 8; at += row) {
        gather(&points, d->host + 2 * at, keys->size / 8 - at < row ? keys->size / 8 - at : row, to + at * points.each);
        look(d);
    }
    if (to)
        d->gl.UnmapBuffer(GL_COPY_WRITE_BUFFER);
    d->by_pixel = 1;
    return pt_gl_check(d, "looking up the points that are shown");
}

int pt_gl_take_winners(struct pt_gl_device *d, struct pt_gl_work *work, struct pt_gl_winners *winners)
{
    const struct pt_kernel_row *row = &pt_kernels[work->kernel];
    int result = PATINA_OK;
    uint32_t found = 0;
    d->by_pixel = 0;
    for (uint32_t i = 0; i < row->fixed && result == PATINA_OK; i++) {
        if (!pt_gl_in_ranges(work->buffers[i]) || pt_gl_is_part(work, &row->buffers[i]))
            continue;
        if (row->fixed > PT_GL_BUFFERS || found == PT_GL_WINNERS)
            return pt_gl_fail(d, PATINA_ERROR_INTERNAL, "%s: more of points than is looked up for pixels", row->name);
        if (!found)
            memcpy(winners->buffers, work->buffers, row->fixed * sizeof *winners->buffers);
        result = pt_gl_gather_winners(d, work, work->buffers[i], found, &winners->gathered[found]);
        winners->buffers[i] = &winners->gathered[found++];
    }
    if (found)
        work->buffers = winners->buffers;
    return result;
}
