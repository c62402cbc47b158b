// SPDX-License-Identifier: GPL-3.0-or-later
// A slot: Windows contexts need a hidden window of their own and wglCreateContextAttribsARB.
#include "context.h"

#include <stdio.h>

static void *create(char *why, size_t why_size)
{
    snprintf(why, why_size, "OpenGL through WGL is not written yet");
    return NULL;
}

static void destroy(void *context) { (void)context; }

static pt_gl_function function(void *context, const char *name)
{
    (void)context, (void)name;
    return NULL;
}

const struct pt_gl_context_ops pt_gl_context_wgl = {"gl-wgl", create, destroy, function};
