// SPDX-License-Identifier: GPL-3.0-or-later
// Windows: a context on a window of our own, which is never shown. The interface is small enough to be declared here, so that only
// platform.h asks for the system's headers.
//
// Windows gives a core context by a function that it hands out only while another context is current: one of old kind is made first.
// A window's pixel format is set once, so both live on the same.
#include "context.h"
#include "base/platform.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

enum {
    PFD_DRAW_TO_WINDOW = 0x04,
    PFD_SUPPORT_OPENGL = 0x20,
    WGL_CONTEXT_MAJOR_VERSION = 0x2091,
    WGL_CONTEXT_MINOR_VERSION = 0x2092,
    WGL_CONTEXT_PROFILE_MASK = 0x9126,
    WGL_CONTEXT_CORE_PROFILE_BIT = 0x0001,
    WGL_CONTEXT_RESET_NOTIFICATION_STRATEGY = 0x8256,
    WGL_LOSE_CONTEXT_ON_RESET = 0x8252,
};

// PIXELFORMATDESCRIPTOR
struct pixel_format {
    uint16_t size, version;
    uint32_t flags;
    uint8_t pixel_type, color_bits, other[16], layer_type, reserved; // other: shifts, alpha, accumulation, depth, stencil
    uint32_t layer_mask, visible_mask, damage_mask;
};
_Static_assert(sizeof(struct pixel_format) == 40, "as Windows has it");

typedef void *create_attributes_function(void *device, void *share, const int *attributes);

struct wgl {
    void *opengl, *gdi, *user; // libraries
    void *(*create_window)(uint32_t more, const uint16_t *kind, const uint16_t *title, uint32_t style, int x, int y, int width,
                           int height, void *parent, void *menu, void *instance, void *parameter);
    int (*destroy_window)(void *window);
    void *(*get_dc)(void *window);
    int (*release_dc)(void *window, void *device);
    int (*choose_format)(void *device, const struct pixel_format *format);
    int (*set_format)(void *device, int index, const struct pixel_format *format);
    void *(*create_context)(void *device);
    int (*delete_context)(void *context);
    int (*make_current)(void *device, void *context);
    pt_gl_function (*get_proc)(const char *name);
    void *window, *device, *context;
};

static int load(struct wgl *c, char *why, size_t why_size)
{
    c->opengl = pt_library_open("opengl32.dll");
    c->gdi = pt_library_open("gdi32.dll");
    c->user = pt_library_open("user32.dll");
    if (!c->opengl || !c->gdi || !c->user) {
        snprintf(why, why_size, "there is no opengl32.dll");
        return -1;
    }
    *(void **)&c->create_window = pt_library_find(c->user, "CreateWindowExW");
    *(void **)&c->destroy_window = pt_library_find(c->user, "DestroyWindow");
    *(void **)&c->get_dc = pt_library_find(c->user, "GetDC");
    *(void **)&c->release_dc = pt_library_find(c->user, "ReleaseDC");
    *(void **)&c->choose_format = pt_library_find(c->gdi, "ChoosePixelFormat");
    *(void **)&c->set_format = pt_library_find(c->gdi, "SetPixelFormat");
    *(void **)&c->create_context = pt_library_find(c->opengl, "wglCreateContext");
    *(void **)&c->delete_context = pt_library_find(c->opengl, "wglDeleteContext");
    *(void **)&c->make_current = pt_library_find(c->opengl, "wglMakeCurrent");
    *(void **)&c->get_proc = pt_library_find(c->opengl, "wglGetProcAddress");
    if (!c->create_window || !c->destroy_window || !c->get_dc || !c->release_dc || !c->choose_format || !c->set_format ||
        !c->create_context || !c->delete_context || !c->make_current || !c->get_proc) {
        snprintf(why, why_size, "this opengl32.dll lacks functions of WGL");
        return -1;
    }
    return 0;
}

// A window of a kind that every program has, whose messages nobody needs to answer: it is never shown.
static int open_window(struct wgl *c, char *why, size_t why_size)
{
    static const uint16_t kind[] = {'S', 'T', 'A', 'T', 'I', 'C', 0}, title[] = {0};
    const struct pixel_format format = {
        .size = sizeof format, .version = 1, .flags = PFD_DRAW_TO_WINDOW | PFD_SUPPORT_OPENGL, .color_bits = 24};
    c->window = c->create_window(0, kind, title, 0, 0, 0, 1, 1, NULL, NULL, NULL, NULL);
    c->device = c->window ? c->get_dc(c->window) : NULL;
    const int index = c->device ? c->choose_format(c->device, &format) : 0;
    if (!index || !c->set_format(c->device, index, &format)) {
        snprintf(why, why_size, "Windows gives no window that OpenGL could draw in");
        return -1;
    }
    return 0;
}

static int open_context(struct wgl *c, char *why, size_t why_size)
{
    int attributes[] = {WGL_CONTEXT_MAJOR_VERSION,
                        4,
                        WGL_CONTEXT_MINOR_VERSION,
                        3,
                        WGL_CONTEXT_PROFILE_MASK,
                        WGL_CONTEXT_CORE_PROFILE_BIT,
                        WGL_CONTEXT_RESET_NOTIFICATION_STRATEGY,
                        WGL_LOSE_CONTEXT_ON_RESET,
                        0};
    void *old = c->create_context(c->device);
    if (!old || !c->make_current(c->device, old)) {
        snprintf(why, why_size, "Windows has no driver for OpenGL");
        if (old)
            c->delete_context(old);
        return -1;
    }
    create_attributes_function *const create = (create_attributes_function *)c->get_proc("wglCreateContextAttribsARB");
    c->context = create ? create(c->device, NULL, attributes) : NULL;
    if (create && !c->context) { // a driver that cannot tell about resets
        attributes[6] = 0;
        c->context = create(c->device, NULL, attributes);
    }
    c->make_current(NULL, NULL);
    c->delete_context(old);
    if (!c->context || !c->make_current(c->device, c->context)) {
        snprintf(why, why_size, "Windows gives no core context of OpenGL 4.3");
        return -1;
    }
    return 0;
}

static void destroy(void *context)
{
    struct wgl *c = context;
    if (c->context) {
        c->make_current(NULL, NULL);
        c->delete_context(c->context);
    }
    if (c->device)
        c->release_dc(c->window, c->device);
    if (c->window)
        c->destroy_window(c->window);
    pt_library_close(c->user);
    pt_library_close(c->gdi);
    pt_library_close(c->opengl);
    free(c);
}

static void *create(char *why, size_t why_size)
{
    struct wgl *c = calloc(1, sizeof *c);
    if (!c) {
        snprintf(why, why_size, "out of memory");
        return NULL;
    }
    if (load(c, why, why_size) < 0 || open_window(c, why, why_size) < 0 || open_context(c, why, why_size) < 0) {
        destroy(c);
        return NULL;
    }
    return c;
}

// What is of OpenGL 1.1 lies in the library itself; for it some drivers answer with small numbers.
static pt_gl_function function(void *context, const char *name)
{
    const struct wgl *c = context;
    const pt_gl_function found = c->get_proc(name);
    const intptr_t number = (intptr_t)found;
    return number < -1 || number > 3 ? found : (pt_gl_function)pt_library_find(c->opengl, name);
}

const struct pt_gl_context_ops pt_gl_context_wgl = {"gl-wgl", create, destroy, function};
