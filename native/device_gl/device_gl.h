// SPDX-License-Identifier: GPL-3.0-or-later
// The OpenGL device: compute shaders in a context of its own, in a thread of its own. Everything below runs in that
// thread; device.c brings the calls there and carries results and messages back.
#ifndef PT_DEVICE_GL_H
#define PT_DEVICE_GL_H

#include "context.h"
#include "device.h"
#include "glad/gl.h"

enum {
    PT_GL_VARIANTS = 4,  // programs of one kernel: passes, or 64-bit atomics
    PT_GL_BINDINGS = 12, // storage blocks a kernel may use: its arguments, its buffers, scratch
};

// Memory that kernels keep between runs; grows, never shrinks.
struct pt_gl_scratch {
    GLuint name;
    size_t size;
};

enum pt_gl_scratch_use {
    PT_GL_SCRATCH_COUNTERS,
    PT_GL_SCRATCH_CHANGED, // fill: this iteration's changes
    PT_GL_SCRATCH_SAVED,   // fill: pixels as they were before the phase
    PT_GL_SCRATCH_FILLED,  // fill: a bit for each pixel filled in this phase
    PT_GL_SCRATCH_TILES,   // fill: tiles that the next iteration must look at
    PT_GL_SCRATCH_COUNT
};

struct pt_gl_call;

struct pt_gl_device {
    struct patina_device base;
    const struct pt_gl_context_ops *context_ops;

    // The hand-over: one call at a time, the caller waits.
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t changed;
    struct pt_gl_call *call;

    // Of the GL thread alone.
    GladGLContext gl;
    void *context;
    int lost;
    char message[512];
    size_t block_size; // greatest storage block
    size_t alignment;  // of a block's offset in its buffer
    GLuint arguments;
    GLuint srgb;    // uniform block: linear values of the 256 sRGB bytes
    uint32_t stamp; // fill: of the current step
    GLuint programs[PT_KERNEL_COUNT][PT_GL_VARIANTS];
    struct pt_gl_scratch scratch[PT_GL_SCRATCH_COUNT];
};

// device.c
// Keeps the sentence for the handle of the device; returns code.
int pt_gl_fail(struct pt_gl_device *d, int code, const char *format, ...) __attribute__((format(printf, 3, 4)));
// Turns whatever GL has to complain about into a code and a sentence: "OpenGL ran out of memory while ...".
int pt_gl_check(struct pt_gl_device *d, const char *doing);

// program.c
// Compiles shaders/NAME with a line of definitions ("#define PASS 1\n") into a program.
int pt_gl_program(struct pt_gl_device *d, const char *name, const char *definitions, GLuint *program);

// kernels.c
int pt_gl_run(struct pt_gl_device *d, enum pt_kernel kernel, const void *arguments, size_t argument_size,
              struct pt_buffer *const *buffers, uint32_t count, const atomic_int *cancel);
// Steps that a kernel's own runner shares with the default one.
int pt_gl_kernel_program(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, const char *definitions);
int pt_gl_bind(struct pt_gl_device *d, uint32_t binding, GLuint name, size_t offset, size_t size, const char *what);
int pt_gl_dispatch(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, uint32_t x, uint32_t y);
// At least `size` bytes; keeps the first `keep` bytes when it has to grow.
int pt_gl_scratch(struct pt_gl_device *d, enum pt_gl_scratch_use use, size_t size, size_t keep);

// scatter.c, fill.c
int pt_gl_scatter(struct pt_gl_device *d, const struct scatter_args *args, struct pt_buffer *const *buffers,
                  uint32_t count, const atomic_int *cancel);
int pt_gl_fill(struct pt_gl_device *d, const struct fill_args *args, const atomic_int *cancel);

// selftest.c
// Whether 64-bit atomics of this driver give what the CPU says; 0 too where the driver has none.
int pt_gl_key64_works(struct pt_gl_device *d);

#endif
