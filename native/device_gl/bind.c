// SPDX-License-Identifier: GPL-3.0-or-later
// What runners of kernels share: programs, buffers bound as kernels.def lists them, dispatches.
#include "device_gl.h"
#include "shared/measured.h"

#include <stdio.h>
#include <string.h>

int pt_gl_kernel_program(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, const char *definitions)
{
    if (d->programs[kernel][variant])
        return PATINA_OK;
    char name[64];
    d->told_by_pixel[kernel][variant] = 0;
    snprintf(name, sizeof name, "kernels/%s.comp", pt_kernels[kernel].name);
    return pt_gl_program(d, name, definitions, &d->programs[kernel][variant]);
}

void pt_gl_use(struct pt_gl_device *d, GLuint program)
{
    if (d->program != program)
        d->gl.UseProgram(program);
    d->program = program;
}

void pt_gl_bound_forget(struct pt_gl_device *d)
{
    memset(d->blocks, 0, sizeof d->blocks);
    memset(d->texels_of, 0, sizeof d->texels_of);
}

int pt_gl_poll(struct pt_gl_device *d)
{
    if (d->look)
        d->look(d->watched);
    return d->cancel && atomic_load(d->cancel) ? pt_gl_fail(d, PATINA_ERROR_CANCELLED, "cancelled") : PATINA_OK;
}

int pt_gl_check_dispatch(struct pt_gl_device *d, const char *doing)
{
    return d->base.info.hardware ? PATINA_OK : pt_gl_check(d, doing);
}

int pt_gl_bind(struct pt_gl_device *d, uint32_t binding, GLuint name, size_t offset, size_t size, const char *what)
{
    if (size > d->block_size)
        return pt_gl_fail(d, PATINA_ERROR_TOO_LARGE,
                          "%s: a buffer of %zu bytes; this OpenGL driver's shaders reach %zu at most", what, size,
                          d->block_size);
    size_t padded = size ? (size + 15) & ~(size_t)15 : 16; // as buffers are made
    struct pt_gl_bound *bound = &d->blocks[binding];
    if (bound->name == name && bound->offset == offset && bound->size == padded)
        return PATINA_OK;
    *bound = (struct pt_gl_bound){name, offset, padded};
    d->gl.BindBufferRange(GL_SHADER_STORAGE_BUFFER, binding, name, (GLintptr)offset, (GLsizeiptr)padded);
    return PATINA_OK;
}

int pt_gl_bind_texture(struct pt_gl_device *d, enum pt_unit unit, const struct pt_buffer *plane)
{
    return pt_gl_bind_texels(d, unit, plane->name, 0, plane->size);
}

int pt_gl_bind_texels(struct pt_gl_device *d, enum pt_unit unit, GLuint name, size_t offset, size_t size)
{
    const size_t texels = size / pt_gl_units[unit].bytes;
    if (texels > d->texels)
        return pt_gl_fail(d, PATINA_ERROR_TOO_LARGE,
                          "a plane of %zu pixels; this OpenGL driver's buffer textures hold %zu at most", texels, d->texels);
    struct pt_gl_bound *bound = &d->texels_of[unit];
    if (bound->name == name && bound->offset == offset && bound->size == size)
        return PATINA_OK;
    d->gl.ActiveTexture(GL_TEXTURE0 + unit);
    if (!bound->name)
        d->gl.BindTexture(GL_TEXTURE_BUFFER, d->textures[unit]);
    *bound = (struct pt_gl_bound){name, offset, size};
    d->gl.TexBufferRange(GL_TEXTURE_BUFFER, pt_gl_units[unit].format, name, (GLintptr)offset,
                         (GLsizeiptr)(size ? size : 16)); // as buffers are made
    return PATINA_OK;
}

int pt_gl_is_part(const struct pt_gl_work *work, const struct pt_buffer_row *row)
{
    static const uint32_t of_points = 1u << PT_FORMAT_position | 1u << PT_FORMAT_word | 1u << PT_FORMAT_color |
                                      1u << PT_FORMAT_opacity | 1u << PT_FORMAT_radius | 1u << PT_FORMAT_scalar |
                                      1u << PT_FORMAT_class | 1u << PT_FORMAT_shape | 1u << PT_FORMAT_field |
                                      1u << PT_FORMAT_scan;
    const enum pt_domain domain = pt_kernels[work->kernel].domain;
    if (!(row->formats & of_points) || (domain != PT_DOMAIN_points && domain != PT_DOMAIN_bins))
        return 0;
    if (work->kernel == PT_KERNEL_shadow_test && row->formats & 1u << PT_FORMAT_opacity)
        return 0; // the caster's
    return work->kernel != PT_KERNEL_blend || !(row->formats & 1u << PT_FORMAT_color) ||
           ((const struct blend_args *)work->arguments)->part == PT_BLEND_COLORS; // else marks, or shadow words
}

static int is_texture(const struct pt_gl_device *d, const struct pt_buffer_row *row)
{
    return row->unit && !(row->soft && d->base.info.hardware);
}

static int is_block(const struct pt_gl_device *d, const struct pt_buffer_row *row)
{
    return row->binding && !(is_texture(d, row) && row->soft);
}

size_t pt_gl_most(const struct pt_gl_device *d, const struct pt_buffer_row *row)
{
    const size_t in_block = is_block(d, row) ? d->block_size : SIZE_MAX,
                 in_texture = is_texture(d, row) ? d->texels * pt_gl_units[row->unit - 1u].bytes : SIZE_MAX;
    return in_block < in_texture ? in_block : in_texture;
}

// In place of a block that is missing any other stands: the kernel does not touch it.
static int bind_row(struct pt_gl_device *d, const struct pt_gl_work *work, const struct pt_buffer_row *row,
                    const struct pt_buffer *buffer)
{
    const int missing = !buffer || !buffer->name, texture = is_texture(d, row);
    int result = PATINA_OK;
    if (row->uniform && !missing)
        d->gl.BindBufferRange(GL_UNIFORM_BUFFER, row->uniform, buffer->name, 0, (GLsizeiptr)buffer->size);
    if (is_block(d, row))
        result = pt_gl_bind(d, row->binding, missing ? d->arguments : buffer->name, 0,
                            missing ? work->argument_size : buffer->size, pt_kernels[work->kernel].name);
    return result == PATINA_OK && texture && !missing ? pt_gl_bind_texture(d, row->unit - 1u, buffer) : result;
}

int pt_gl_bind_rows(struct pt_gl_device *d, const struct pt_gl_work *work, uint32_t first, uint32_t count,
                    struct pt_buffer *const *buffers)
{
    const struct pt_buffer_row *rows = pt_kernels[work->kernel].buffers + first;
    int result = PATINA_OK;
    for (uint32_t i = 0; i < count && result == PATINA_OK; i++)
        if (!pt_gl_is_part(work, &rows[i]))
            result = bind_row(d, work, &rows[i], buffers[i]);
    return result;
}

int pt_gl_bind_buffers(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    return pt_gl_bind_rows(d, work, 0, pt_kernels[work->kernel].fixed, work->buffers);
}

void pt_gl_arguments(struct pt_gl_device *d, const void *arguments, size_t size)
{
    d->gl.BindBuffer(GL_COPY_WRITE_BUFFER, d->arguments);
    d->gl.BufferData(GL_COPY_WRITE_BUFFER, (GLsizeiptr)size, arguments, GL_STREAM_DRAW);
    d->gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, PT_BIND_arguments, d->arguments);
}

void pt_gl_tell_by_pixel(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant)
{
    uint8_t *told = &d->told_by_pixel[kernel][variant];
    if (*told == d->by_pixel)
        return;
    const GLuint program = d->programs[kernel][variant];
    d->gl.ProgramUniform1ui(program, d->gl.GetUniformLocation(program, "by_pixel"), d->by_pixel); // at no place: not asked
    *told = (uint8_t)d->by_pixel;
}

int pt_gl_dispatch(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, uint32_t x, uint32_t y)
{
    const int polled = pt_gl_poll(d);
    if (polled != PATINA_OK)
        return polled;
    if (x && y) {
        pt_gl_tell_by_pixel(d, kernel, variant);
        pt_gl_use(d, d->programs[kernel][variant]);
        d->gl.DispatchCompute(x, y, 1);
        d->gl.MemoryBarrier(PT_GL_BARRIERS);
    }
    char doing[64];
    snprintf(doing, sizeof doing, "running %s", pt_kernels[kernel].name);
    return pt_gl_check_dispatch(d, doing);
}

void pt_gl_grid(uint32_t count, uint32_t *x, uint32_t *y)
{
    enum { GROUPS_IN_ROW = 16384 };
    *x = count < GROUPS_IN_ROW ? count : GROUPS_IN_ROW;
    *y = *x ? (count + *x - 1) / *x : 0;
}

// llvmpipe spends as much on an invocation as on a pixel.
int pt_gl_dispatch_rows(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, uint32_t width, uint32_t height)
{
    enum { COLUMNS = 64, ROWS = 4 }; // of a workgroup, as in lib/planes.glsl
    return pt_gl_dispatch(d, kernel, variant, (width + COLUMNS - 1) / COLUMNS, (height + ROWS - 1) / ROWS);
}
