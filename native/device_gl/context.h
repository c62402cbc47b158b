// SPDX-License-Identifier: GPL-3.0-or-later
// How a GL context comes to be. A context is made, used and destroyed in one thread; none of them needs a display or a
// window that is seen, and none ever touches the host program's own.
#ifndef PT_GL_CONTEXT_H
#define PT_GL_CONTEXT_H

#include <stddef.h>

typedef void (*pt_gl_function)(void);

struct pt_gl_context_ops {
    const char *name; // of the device: "gl-egl"
    // Opens the library at run time, makes a core context of GL 4.3 or newer and makes it current in this thread.
    // NULL when it cannot be had; why then says the reason in a sentence.
    void *(*create)(char *why, size_t why_size);
    void (*destroy)(void *context);
    pt_gl_function (*function)(void *context, const char *name);
};

extern const struct pt_gl_context_ops pt_gl_context_egl;    // Linux: GPU drivers, Mesa's llvmpipe
extern const struct pt_gl_context_ops pt_gl_context_osmesa; // Mesa's llvmpipe without EGL
extern const struct pt_gl_context_ops pt_gl_context_wgl;    // Windows

#endif
