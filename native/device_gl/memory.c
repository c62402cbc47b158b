// SPDX-License-Identifier: GPL-3.0-or-later
// Memory: what kernels keep between runs; buffers cleared, written and read back.
#include "device_gl.h"

#include <string.h>

enum { PIECE = 1 << 24 }; // bytes that are written or read at one go

int pt_gl_scratch(struct pt_gl_device *d, enum pt_gl_scratch_use use, size_t size, size_t keep)
{
    const GladGLContext *gl = &d->gl;
    struct pt_gl_scratch *scratch = &d->scratch[use];
    if (size <= scratch->size)
        return PATINA_OK;
    size = (size + size / 4 + 4095) & ~(size_t)4095;
    GLuint name = 0;
    gl->GenBuffers(1, &name);
    gl->BindBuffer(GL_COPY_WRITE_BUFFER, name);
    gl->BufferData(GL_COPY_WRITE_BUFFER, (GLsizeiptr)size, NULL, GL_DYNAMIC_COPY);
    if (keep) {
        gl->BindBuffer(GL_COPY_READ_BUFFER, scratch->name);
        gl->CopyBufferSubData(GL_COPY_READ_BUFFER, GL_COPY_WRITE_BUFFER, 0, 0, (GLsizeiptr)keep);
    }
    int result = pt_gl_check(d, "making room for a kernel");
    if (result != PATINA_OK) {
        gl->DeleteBuffers(1, &name);
        return result;
    }
    gl->DeleteBuffers(1, &scratch->name);
    pt_gl_bound_forget(d);
    *scratch = (struct pt_gl_scratch){name, size};
    return PATINA_OK;
}

// ---- clearing --------------------------------------------------------------------------------------------------------

// In software the memory is at hand, and the driver clears by a call every 8 bytes: 2.0 ms for the keys of 1024² in place of 0.3.
static int clear_mapped(struct pt_gl_device *d, size_t offset, size_t size, uint64_t first, uint64_t second)
{
    const size_t count = (size + 7) / 8; // buffers are padded
    uint64_t *to = d->gl.MapBufferRange(GL_COPY_WRITE_BUFFER, (GLintptr)offset, (GLsizeiptr)(8 * count),
                                        GL_MAP_WRITE_BIT | GL_MAP_INVALIDATE_RANGE_BIT);
    if (!to)
        return pt_gl_check(d, "clearing a buffer");
    for (size_t i = 0; i < count / 2; i++) {
        to[2 * i] = first;
        to[2 * i + 1] = second;
    }
    if (count & 1)
        to[count - 1] = first;
    d->gl.UnmapBuffer(GL_COPY_WRITE_BUFFER);
    return pt_gl_check(d, "clearing a buffer");
}

enum { CLEAR_GROUP = 256, CLEAR_EACH = 4, PAIR = 8 }; // as in lib/clear.glsl

// One block's worth, in the arguments' place: what else is bound stays.
static int clear_block(struct pt_gl_device *d, GLuint name, size_t offset, size_t size, const uint32_t words[4])
{
    const size_t base = offset / d->alignment * d->alignment, pairs = (size + PAIR - 1) / PAIR; // buffers are padded
    uint32_t x, y;
    d->gl.ProgramUniform4ui(d->clear_program, 0, words[0], words[1], words[2], words[3]);
    d->gl.ProgramUniform2ui(d->clear_program, 1, (GLuint)((offset - base) / PAIR), (GLuint)pairs);
    d->gl.BindBufferRange(GL_SHADER_STORAGE_BUFFER, PT_BIND_arguments, name, (GLintptr)base,
                          (GLsizeiptr)(offset - base + PAIR * pairs));
    pt_gl_grid((uint32_t)((pairs + CLEAR_GROUP * CLEAR_EACH - 1) / (CLEAR_GROUP * CLEAR_EACH)), &x, &y);
    pt_gl_use(d, d->clear_program);
    d->gl.DispatchCompute(x, y, 1);
    d->gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, PT_BIND_arguments, d->arguments);
    return pt_gl_check_dispatch(d, "clearing a buffer");
}

// By a kernel: a driver's own clearing was seen to write 40 GB/s where the card's memory takes 4000, and planes are cleared each frame.
int pt_gl_clear(struct pt_gl_device *d, GLuint name, size_t offset, size_t size, const uint32_t words[4])
{
    const size_t most = (d->block_size - d->alignment) / 4096 * 4096;
    int result = PATINA_OK;
    if (!size)
        return result;
    d->gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    d->gl.BindBuffer(GL_COPY_WRITE_BUFFER, name);
    if (!d->base.info.hardware)
        return clear_mapped(d, offset, size, (uint64_t)words[1] << 32 | words[0], (uint64_t)words[3] << 32 | words[2]);
    if (!d->clear_program)
        result = pt_gl_program(d, "lib/clear.glsl", "", &d->clear_program);
    for (size_t at = 0; at < size && result == PATINA_OK; at += most)
        result = clear_block(d, name, offset + at, size - at < most ? size - at : most, words);
    d->gl.MemoryBarrier(PT_GL_BARRIERS);
    return result;
}

// ---- writing ---------------------------------------------------------------------------------------------------------

// What shaders write is written to by copies that the device makes, too: a driver was seen to lose what BufferSubData brought behind a
// kernel's writes, barrier or not.
int pt_gl_write(struct pt_gl_device *d, GLuint name, size_t offset, size_t size, const void *source)
{
    const GladGLContext *gl = &d->gl;
    gl->BindBuffer(GL_COPY_WRITE_BUFFER, name);
    if (!d->base.info.hardware) {
        gl->BufferSubData(GL_COPY_WRITE_BUFFER, (GLintptr)offset, (GLsizeiptr)size, source);
        return pt_gl_check(d, "writing a buffer");
    }
    gl->BindBuffer(GL_COPY_READ_BUFFER, d->upload);
    for (size_t at = 0; at < size; at += PIECE) {
        const size_t some = size - at < PIECE ? size - at : PIECE;
        gl->BufferData(GL_COPY_READ_BUFFER, (GLsizeiptr)some, (const char *)source + at, GL_STREAM_DRAW);
        gl->CopyBufferSubData(GL_COPY_READ_BUFFER, GL_COPY_WRITE_BUFFER, 0, (GLintptr)(offset + at), (GLsizeiptr)some);
    }
    return pt_gl_check(d, "writing a buffer");
}

void pt_gl_zero(struct pt_gl_device *d, GLuint name, size_t offset, size_t size)
{
    static const uint32_t zeros[PT_GL_ZEROS / 4];
    const GladGLContext *gl = &d->gl;
    gl->BindBuffer(GL_COPY_WRITE_BUFFER, name);
    if (!d->base.info.hardware) {
        gl->BufferSubData(GL_COPY_WRITE_BUFFER, (GLintptr)offset, (GLsizeiptr)size, zeros);
        return;
    }
    gl->BindBuffer(GL_COPY_READ_BUFFER, d->zeros);
    gl->CopyBufferSubData(GL_COPY_READ_BUFFER, GL_COPY_WRITE_BUFFER, 0, (GLintptr)offset, (GLsizeiptr)size);
}

// ---- reading back ----------------------------------------------------------------------------------------------------

// By a copy that the device makes: a driver was seen to hand out, of a buffer that had been read before, what had been there then,
// though kernels had written since; and of memory made for reading, the host reads faster.
static int read_piece(struct pt_gl_device *d, GLuint name, size_t offset, size_t size, void *target)
{
    const GladGLContext *gl = &d->gl;
    gl->BindBuffer(GL_COPY_READ_BUFFER, name);
    gl->BindBuffer(GL_COPY_WRITE_BUFFER, d->staging.name);
    gl->CopyBufferSubData(GL_COPY_READ_BUFFER, GL_COPY_WRITE_BUFFER, (GLintptr)offset, 0, (GLsizeiptr)size);
    const void *copy = gl->MapBufferRange(GL_COPY_WRITE_BUFFER, 0, (GLsizeiptr)size, GL_MAP_READ_BIT);
    if (copy) {
        memcpy(target, copy, size);
        gl->UnmapBuffer(GL_COPY_WRITE_BUFFER);
    }
    return pt_gl_check(d, "reading a buffer back");
}

int pt_gl_read(struct pt_gl_device *d, GLuint name, size_t offset, size_t size, void *target)
{
    const GladGLContext *gl = &d->gl;
    const size_t room = size < PIECE ? size : PIECE;
    int result = PATINA_OK;
    gl->MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    if (!d->base.info.hardware) {
        gl->BindBuffer(GL_COPY_READ_BUFFER, name);
        gl->GetBufferSubData(GL_COPY_READ_BUFFER, (GLintptr)offset, (GLsizeiptr)size, target);
        return pt_gl_check(d, "reading a buffer back");
    }
    if (room > d->staging.size) {
        if (!d->staging.name)
            gl->GenBuffers(1, &d->staging.name);
        gl->BindBuffer(GL_COPY_WRITE_BUFFER, d->staging.name);
        gl->BufferData(GL_COPY_WRITE_BUFFER, (GLsizeiptr)room, NULL, GL_STREAM_READ);
        result = pt_gl_check(d, "making room to read a buffer back");
        d->staging.size = result == PATINA_OK ? room : 0;
    }
    for (size_t at = 0; at < size && result == PATINA_OK; at += PIECE)
        result = read_piece(d, name, offset + at, size - at < PIECE ? size - at : PIECE, (char *)target + at);
    return result;
}
