// SPDX-License-Identifier: GPL-3.0-or-later
// 64-bit atomics switch themselves on only where the driver has them and this test agrees with the CPU (DESIGN rule 4).
#include "device_gl.h"

#include <string.h>

enum { CELLS = 64, VALUES = 4096, GROUP = 64 };

// Values that collide in cells, agree in one word or the other, and use all bits.
static uint64_t next(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    uint64_t value = *state ^ *state >> 29;
    switch (*state >> 60) {
    case 0: return value & 0xFFFFFFFFu;
    case 1: return value & 0xFFFFFFFF00000000u;
    case 2: return value | 0xFFFFFFFF00000000u;
    default: return value;
    }
}

static int run(struct pt_gl_device *d, GLuint program)
{
    const GladGLContext *gl = &d->gl;
    uint64_t values[VALUES], expected[CELLS], result[CELLS], state = 1;
    GLuint names[2] = {0, 0};
    memset(expected, 0xFF, sizeof expected);
    memset(result, 0, sizeof result);
    for (int i = 0; i < VALUES; i++) {
        values[i] = next(&state);
        if (values[i] < expected[i % CELLS])
            expected[i % CELLS] = values[i];
    }
    gl->GenBuffers(2, names);
    gl->BindBuffer(GL_COPY_WRITE_BUFFER, names[0]);
    gl->BufferData(GL_COPY_WRITE_BUFFER, sizeof values, values, GL_STATIC_DRAW);
    gl->BindBuffer(GL_COPY_WRITE_BUFFER, names[1]);
    uint64_t ones[CELLS];
    memset(ones, 0xFF, sizeof ones);
    gl->BufferData(GL_COPY_WRITE_BUFFER, sizeof ones, ones, GL_DYNAMIC_COPY);
    gl->BindBufferBase(GL_SHADER_STORAGE_BUFFER, PT_BIND_key64_test_values, names[0]);
    gl->BindBufferBase(GL_SHADER_STORAGE_BUFFER, PT_BIND_key64_test_cells, names[1]);
    gl->UseProgram(program);
    gl->DispatchCompute(VALUES / GROUP, 1, 1);
    gl->MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    gl->GetBufferSubData(GL_COPY_WRITE_BUFFER, 0, sizeof result, result);
    gl->DeleteBuffers(2, names);
    return pt_gl_check(d, "testing 64-bit atomics") == PATINA_OK && !memcmp(result, expected, sizeof expected);
}

int pt_gl_key64_works(struct pt_gl_device *d)
{
    GLuint program = 0;
    if (!d->gl.ARB_gpu_shader_int64 || !d->gl.NV_shader_atomic_int64)
        return 0;
    if (pt_gl_program(d, "lib/key64_test.glsl", "", &program) != PATINA_OK) {
        if (!d->lost)
            pt_log(PT_LOG_WARNING, "%s: 64-bit atomics do not compile, 32-bit ones are used: %s", d->base.info.description,
                   d->message);
        return 0;
    }
    int works = run(d, program);
    d->gl.DeleteProgram(program);
    if (!works && !d->lost)
        pt_log(PT_LOG_WARNING, "%s: 64-bit atomics are wrong, 32-bit ones are used", d->base.info.description);
    return works;
}
