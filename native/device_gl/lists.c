// SPDX-License-Identifier: GPL-3.0-or-later
// Lists that one program writes and the next ones walk. A list begins with its head: the workgroups that walk it, as an indirect
// dispatch takes them, and its length. So nobody waits to learn how long it has become.
#include "device_gl.h"

#include <stdio.h>

int pt_gl_list_begin(struct pt_gl_device *d, enum pt_gl_scratch_use use, uint32_t binding, size_t size)
{
    int result = pt_gl_scratch(d, use, PT_GL_LIST_HEAD + size, 0);
    if (result == PATINA_OK)
        result = pt_gl_bind(d, binding, d->scratch[use].name, 0, PT_GL_LIST_HEAD + size, "a list");
    if (result != PATINA_OK)
        return result;
    pt_gl_zero(d, d->scratch[use].name, 0, PT_GL_LIST_HEAD);
    return PATINA_OK;
}

int pt_gl_list_groups(struct pt_gl_device *d, uint32_t binding, uint32_t count, size_t stride, uint32_t entries, uint32_t parts)
{
    int result = PATINA_OK;
    if (!d->list_program)
        result = pt_gl_program(d, "lib/list_groups.glsl", "", &d->list_program);
    if (result != PATINA_OK)
        return result;
    d->gl.ShaderStorageBlockBinding(d->list_program, 0, binding); // what else is bound stays
    d->gl.ProgramUniform1ui(d->list_program, 0, (GLuint)(stride / 4));
    d->gl.ProgramUniform1ui(d->list_program, 1, entries);
    d->gl.ProgramUniform1ui(d->list_program, 2, parts);
    pt_gl_use(d, d->list_program);
    d->gl.DispatchCompute(count, 1, 1);
    d->gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
    return pt_gl_check_dispatch(d, "counting a list");
}

int pt_gl_list_dispatch(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, GLuint name, size_t head)
{
    char doing[64];
    const int polled = pt_gl_poll(d);
    if (polled != PATINA_OK)
        return polled;
    pt_gl_tell_by_pixel(d, kernel, variant);
    pt_gl_use(d, d->programs[kernel][variant]);
    d->gl.BindBuffer(GL_DISPATCH_INDIRECT_BUFFER, name);
    d->gl.DispatchComputeIndirect((GLintptr)head);
    d->gl.MemoryBarrier(PT_GL_BARRIERS);
    snprintf(doing, sizeof doing, "running %s", pt_kernels[kernel].name);
    return pt_gl_check_dispatch(d, doing);
}
