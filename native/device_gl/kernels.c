// SPDX-License-Identifier: GPL-3.0-or-later
// Running a kernel: bind its arguments and buffers, one dispatch over view.rect. scatter and fill have their own runners.
#include "device_gl.h"

#include <stdio.h>

int pt_gl_kernel_program(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, const char *definitions)
{
    if (d->programs[kernel][variant])
        return PATINA_OK;
    char name[64];
    snprintf(name, sizeof name, "kernels/%s.comp", pt_kernel_names[kernel]);
    return pt_gl_program(d, name, definitions, &d->programs[kernel][variant]);
}

int pt_gl_bind(struct pt_gl_device *d, uint32_t binding, GLuint name, size_t offset, size_t size, const char *what)
{
    if (size > d->block_size)
        return pt_gl_fail(d, PATINA_ERROR_UNSUPPORTED,
                          "%s: a buffer of %zu bytes; this OpenGL driver's shaders reach %zu at most", what, size,
                          d->block_size);
    size_t padded = size ? (size + 15) & ~(size_t)15 : 16; // as buffers are made
    d->gl.BindBufferRange(GL_SHADER_STORAGE_BUFFER, binding, name, (GLintptr)offset, (GLsizeiptr)padded);
    return PATINA_OK;
}

int pt_gl_dispatch(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, uint32_t x, uint32_t y)
{
    if (x && y) {
        d->gl.UseProgram(d->programs[kernel][variant]);
        d->gl.DispatchCompute(x, y, 1);
        d->gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
    }
    return pt_gl_check(d, pt_kernel_names[kernel]);
}

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
    *scratch = (struct pt_gl_scratch){name, size};
    return PATINA_OK;
}

// The pixels that a kernel runs over: view.rect, with which every argument struct begins, or the crop that it writes.
static void extent(enum pt_kernel kernel, const void *arguments, uint32_t *width, uint32_t *height)
{
    const struct view_args *view = arguments;
    *width = view->rect[2] > view->rect[0] ? view->rect[2] - view->rect[0] : 0;
    *height = view->rect[3] > view->rect[1] ? view->rect[3] - view->rect[1] : 0;
    if (kernel == PT_KERNEL_compose) {
        *width = ((const struct compose_args *)arguments)->crop_width;
        *height = ((const struct compose_args *)arguments)->crop_height;
    } else if (kernel == PT_KERNEL_extract) {
        *width = ((const struct extract_args *)arguments)->crop_width;
        *height = ((const struct extract_args *)arguments)->crop_height;
    }
}

static int run_filter(struct pt_gl_device *d, enum pt_kernel kernel, const void *arguments)
{
    GLint group[3] = {1, 1, 1};
    uint32_t width, height;
    int result = pt_gl_kernel_program(d, kernel, 0, "");
    if (result != PATINA_OK)
        return result;
    d->gl.GetProgramiv(d->programs[kernel][0], GL_COMPUTE_WORK_GROUP_SIZE, group);
    extent(kernel, arguments, &width, &height);
    return pt_gl_dispatch(d, kernel, 0, (width + (uint32_t)group[0] - 1) / (uint32_t)group[0],
                          (height + (uint32_t)group[1] - 1) / (uint32_t)group[1]);
}

int pt_gl_run(struct pt_gl_device *d, enum pt_kernel kernel, const void *arguments, size_t argument_size,
              struct pt_buffer *const *buffers, uint32_t count, const atomic_int *cancel)
{
    d->gl.BindBuffer(GL_COPY_WRITE_BUFFER, d->arguments);
    d->gl.BufferData(GL_COPY_WRITE_BUFFER, (GLsizeiptr)((argument_size + 15) & ~(size_t)15), NULL, GL_STREAM_DRAW);
    d->gl.BufferSubData(GL_COPY_WRITE_BUFFER, 0, (GLsizeiptr)argument_size, arguments);
    d->gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, d->arguments);
    if (kernel == PT_KERNEL_scatter)
        return pt_gl_scatter(d, arguments, buffers, count, cancel);
    for (uint32_t i = 0; i < count; i++) {
        // A buffer that a kernel may do without (colors, a pass that nobody asked for) is missing: any other stands in.
        int missing = !buffers[i] || !buffers[i]->name;
        int result = pt_gl_bind(d, 1 + i, missing ? d->arguments : buffers[i]->name, 0,
                                missing ? argument_size : buffers[i]->size, pt_kernel_names[kernel]);
        if (result != PATINA_OK)
            return result;
    }
    if (kernel == PT_KERNEL_fill)
        return pt_gl_fill(d, arguments, cancel);
    return run_filter(d, kernel, arguments);
}
