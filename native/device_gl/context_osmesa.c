// SPDX-License-Identifier: GPL-3.0-or-later
// Mesa's off-screen library: llvmpipe without EGL, for machines whose EGL is missing or broken. The interface is small
// enough to be declared here, so that a build needs no Mesa headers.
#include "context.h"
#include "base/platform.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

enum {
    OSMESA_RGBA = 0x1908,
    OSMESA_FORMAT = 0x22,
    OSMESA_DEPTH_BITS = 0x30,
    OSMESA_PROFILE = 0x33,
    OSMESA_CORE_PROFILE = 0x34,
    OSMESA_CONTEXT_MAJOR_VERSION = 0x36,
    OSMESA_CONTEXT_MINOR_VERSION = 0x37,
    UNSIGNED_BYTE = 0x1401,
    SIDE = 16, // of the colour buffer that OSMesa insists on; nothing is ever drawn into it
};

struct osmesa {
    void *library;
    void *context;
    void *(*create)(const int *attributes, void *share);
    void (*destroy)(void *context);
    unsigned char (*make_current)(void *context, void *buffer, unsigned type, int width, int height);
    pt_gl_function (*get_proc)(const char *name);
    uint32_t pixels[SIDE * SIDE];
};

static int load(struct osmesa *c, char *why, size_t why_size)
{
    static const char *const names[] = {"libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"};
    for (unsigned i = 0; i < sizeof names / sizeof *names && !c->library; i++)
        c->library = pt_library_open(names[i]);
    if (!c->library) {
        snprintf(why, why_size, "libOSMesa.so.8 is not installed");
        return -1;
    }
    *(void **)&c->create = pt_library_find(c->library, "OSMesaCreateContextAttribs");
    *(void **)&c->destroy = pt_library_find(c->library, "OSMesaDestroyContext");
    *(void **)&c->make_current = pt_library_find(c->library, "OSMesaMakeCurrent");
    *(void **)&c->get_proc = pt_library_find(c->library, "OSMesaGetProcAddress");
    if (!c->create || !c->destroy || !c->make_current || !c->get_proc) {
        snprintf(why, why_size, "this libOSMesa is too old: OSMesaCreateContextAttribs is missing");
        return -1;
    }
    return 0;
}

static void destroy(void *context)
{
    struct osmesa *c = context;
    if (c->context) {
        c->make_current(NULL, NULL, 0, 0, 0);
        c->destroy(c->context);
    }
    pt_library_close(c->library);
    free(c);
}

static void *create(char *why, size_t why_size)
{
    static const int attributes[] = {OSMESA_FORMAT,
                                     OSMESA_RGBA,
                                     OSMESA_DEPTH_BITS,
                                     0,
                                     OSMESA_PROFILE,
                                     OSMESA_CORE_PROFILE,
                                     OSMESA_CONTEXT_MAJOR_VERSION,
                                     4,
                                     OSMESA_CONTEXT_MINOR_VERSION,
                                     3,
                                     0};
    struct osmesa *c = calloc(1, sizeof *c);
    if (!c) {
        snprintf(why, why_size, "out of memory");
        return NULL;
    }
    if (load(c, why, why_size) < 0)
        goto fail;
    c->context = c->create(attributes, NULL);
    if (!c->context || !c->make_current(c->context, c->pixels, UNSIGNED_BYTE, SIDE, SIDE)) {
        snprintf(why, why_size, "OSMesa gives no core context of OpenGL 4.3");
        goto fail;
    }
    return c;
fail:
    destroy(c);
    return NULL;
}

static pt_gl_function function(void *context, const char *name) { return ((struct osmesa *)context)->get_proc(name); }

const struct pt_gl_context_ops pt_gl_context_osmesa = {"gl-osmesa", create, destroy, function};
