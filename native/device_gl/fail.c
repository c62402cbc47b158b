// SPDX-License-Identifier: GPL-3.0-or-later
// What went wrong in OpenGL, as a code and a sentence.
#include "device_gl.h"

#include <stdio.h>

int pt_gl_fail(struct pt_gl_device *d, int code, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vsnprintf(d->message, sizeof d->message, format, args);
    va_end(args);
    return code;
}

int pt_gl_check(struct pt_gl_device *d, const char *doing)
{
    const GladGLContext *gl = &d->gl;
    GLenum reset = GL_NO_ERROR;
    if (gl->KHR_robustness && gl->GetGraphicsResetStatus)
        reset = gl->GetGraphicsResetStatus();
    else if (gl->ARB_robustness && gl->GetGraphicsResetStatusARB)
        reset = gl->GetGraphicsResetStatusARB();
    GLenum first = gl->GetError(), error = first;
    for (int i = 0; i < 16 && error != GL_NO_ERROR && error != GL_CONTEXT_LOST; i++)
        error = gl->GetError();
    if (reset != GL_NO_ERROR || first == GL_CONTEXT_LOST || error == GL_CONTEXT_LOST) {
        d->lost = 1;
        return pt_gl_fail(d, PATINA_ERROR_DEVICE, "the OpenGL context was lost while %s", doing);
    }
    if (first == GL_NO_ERROR)
        return PATINA_OK;
    if (first == GL_OUT_OF_MEMORY)
        return pt_gl_fail(d, PATINA_ERROR_MEMORY, "OpenGL ran out of memory while %s", doing);
    return pt_gl_fail(d, PATINA_ERROR_DEVICE, "OpenGL error 0x%04X while %s", first, doing);
}
