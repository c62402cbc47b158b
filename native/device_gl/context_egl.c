// SPDX-License-Identifier: GPL-3.0-or-later
// A context without a surface on an EGL device (or on Mesa's surfaceless platform): never on a window system's display,
// which belongs to the host program. The interface is small enough to be declared here, so that a build needs no
// headers of EGL.
//
// The display of an EGL device is one per process and eglTerminate would end it for every user, our own other devices
// included: so it is never terminated. What remains of it is bounded: one display per process.
#include "context.h"
#include "base/platform.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    EGL_NONE = 0x3038,
    EGL_EXTENSIONS = 0x3055,
    EGL_SURFACE_TYPE = 0x3033,
    EGL_PBUFFER_BIT = 0x0001,
    EGL_RENDERABLE_TYPE = 0x3040,
    EGL_OPENGL_BIT = 0x0008,
    EGL_OPENGL_API = 0x30A2,
    EGL_CONTEXT_MAJOR_VERSION = 0x3098,
    EGL_CONTEXT_MINOR_VERSION = 0x30FB,
    EGL_CONTEXT_OPENGL_PROFILE_MASK = 0x30FD,
    EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT = 0x0001,
    EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY = 0x31BD,
    EGL_LOSE_CONTEXT_ON_RESET = 0x31BF,
    EGL_PLATFORM_DEVICE_EXT = 0x313F,
    EGL_PLATFORM_SURFACELESS_MESA = 0x31DD,
    MAX_DEVICES = 32,
};

typedef void *display_ext_function(unsigned platform, void *native, const int *attributes);
typedef unsigned devices_function(int max, void **devices, int *count);
typedef const char *device_string_function(void *device, int name);

struct egl {
    void *library;
    pt_gl_function (*get_proc)(const char *name);
    const char *(*query_string)(void *display, int name);
    void *(*get_platform_display)(unsigned platform, void *native, const intptr_t *attributes);
    display_ext_function *get_platform_display_ext;
    unsigned (*initialize)(void *display, int *major, int *minor);
    unsigned (*bind_api)(unsigned api);
    unsigned (*choose_config)(void *display, const int *attributes, void **configs, int size, int *count);
    void *(*create_context)(void *display, void *config, void *share, const int *attributes);
    unsigned (*destroy_context)(void *display, void *context);
    unsigned (*make_current)(void *display, void *draw, void *read, void *context);
    unsigned (*release_thread)(void);
    devices_function *query_devices;
    device_string_function *query_device_string;
    void *display, *context;
};

// Whether a list of words separated by spaces holds this one.
static int has(const char *list, const char *word)
{
    size_t length = strlen(word);
    for (const char *at = list; at && (at = strstr(at, word)); at += length)
        if ((at == list || at[-1] == ' ') && (at[length] == ' ' || !at[length]))
            return 1;
    return 0;
}

static int load(struct egl *c, char *why, size_t why_size)
{
    c->library = pt_library_open("libEGL.so.1");
    if (!c->library) {
        snprintf(why, why_size, "libEGL.so.1 is not installed");
        return -1;
    }
    *(void **)&c->get_proc = pt_library_find(c->library, "eglGetProcAddress");
    *(void **)&c->query_string = pt_library_find(c->library, "eglQueryString");
    *(void **)&c->get_platform_display = pt_library_find(c->library, "eglGetPlatformDisplay"); // EGL 1.5
    *(void **)&c->initialize = pt_library_find(c->library, "eglInitialize");
    *(void **)&c->bind_api = pt_library_find(c->library, "eglBindAPI");
    *(void **)&c->choose_config = pt_library_find(c->library, "eglChooseConfig");
    *(void **)&c->create_context = pt_library_find(c->library, "eglCreateContext");
    *(void **)&c->destroy_context = pt_library_find(c->library, "eglDestroyContext");
    *(void **)&c->make_current = pt_library_find(c->library, "eglMakeCurrent");
    *(void **)&c->release_thread = pt_library_find(c->library, "eglReleaseThread");
    if (!c->get_proc || !c->query_string || !c->initialize || !c->bind_api || !c->choose_config || !c->create_context ||
        !c->destroy_context || !c->make_current || !c->release_thread) {
        snprintf(why, why_size, "this libEGL.so.1 lacks functions of EGL 1.4");
        return -1;
    }
    if (!c->get_platform_display)
        c->get_platform_display_ext = (display_ext_function *)c->get_proc("eglGetPlatformDisplayEXT");
    if (!c->get_platform_display && !c->get_platform_display_ext) {
        snprintf(why, why_size, "this libEGL.so.1 knows no platforms (EGL 1.5 or EGL_EXT_platform_base)");
        return -1;
    }
    return 0;
}

static void *open_context(struct egl *c, void *display, void *config)
{
    int attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                        4,
                        EGL_CONTEXT_MINOR_VERSION,
                        3,
                        EGL_CONTEXT_OPENGL_PROFILE_MASK,
                        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                        EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY,
                        EGL_LOSE_CONTEXT_ON_RESET,
                        EGL_NONE};
    void *context = c->create_context(display, config, NULL, attributes);
    if (!context) { // a driver that cannot tell about resets
        attributes[6] = EGL_NONE;
        context = c->create_context(display, config, NULL, attributes);
    }
    return context;
}

// Makes and binds a context on this platform's display.
static int try_display(struct egl *c, unsigned platform, void *native, char *why, size_t why_size)
{
    static const int config_attributes[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    void *display = c->get_platform_display ? c->get_platform_display(platform, native, NULL)
                                            : c->get_platform_display_ext(platform, native, NULL);
    if (!display || !c->initialize(display, NULL, NULL) || !c->bind_api(EGL_OPENGL_API)) {
        snprintf(why, why_size, "the EGL display cannot be opened");
        return -1;
    }
    const char *extensions = c->query_string(display, EGL_EXTENSIONS);
    if (!has(extensions, "EGL_KHR_surfaceless_context")) {
        snprintf(why, why_size, "EGL_KHR_surfaceless_context is missing");
        return -1;
    }
    void *config = NULL; // EGL_NO_CONFIG_KHR
    int count = 0;
    if ((!c->choose_config(display, config_attributes, &config, 1, &count) || !count) &&
        !has(extensions, "EGL_KHR_no_config_context")) {
        snprintf(why, why_size, "the EGL display has no configuration for OpenGL");
        return -1;
    }
    void *context = open_context(c, display, count ? config : NULL);
    if (!context) {
        snprintf(why, why_size, "EGL gives no core context of OpenGL 4.3");
        return -1;
    }
    if (!c->make_current(display, NULL, NULL, context)) {
        snprintf(why, why_size, "the EGL context cannot be made current");
        c->destroy_context(display, context);
        return -1;
    }
    c->display = display;
    c->context = context;
    return 0;
}

// GPUs first, in the driver's order, then software devices.
static int try_devices(struct egl *c, char *why, size_t why_size)
{
    void *devices[MAX_DEVICES];
    int count = 0;
    c->query_devices = (devices_function *)c->get_proc("eglQueryDevicesEXT");
    c->query_device_string = (device_string_function *)c->get_proc("eglQueryDeviceStringEXT");
    if (!c->query_devices || !c->query_device_string || !c->query_devices(MAX_DEVICES, devices, &count))
        return -1;
    for (int software = 0; software < 2; software++)
        for (int i = 0; i < count; i++) {
            const char *extensions = c->query_device_string(devices[i], EGL_EXTENSIONS);
            if (has(extensions, "EGL_MESA_device_software") == software &&
                try_display(c, EGL_PLATFORM_DEVICE_EXT, devices[i], why, why_size) == 0)
                return 0;
        }
    return -1;
}

static void destroy(void *context)
{
    struct egl *c = context;
    if (c->context) {
        c->make_current(c->display, NULL, NULL, NULL);
        c->destroy_context(c->display, c->context);
        c->release_thread();
    }
    pt_library_close(c->library);
    free(c);
}

static void *create(char *why, size_t why_size)
{
    struct egl *c = calloc(1, sizeof *c);
    if (!c) {
        snprintf(why, why_size, "out of memory");
        return NULL;
    }
    if (load(c, why, why_size) < 0)
        goto fail;
    const char *extensions = c->query_string(NULL, EGL_EXTENSIONS); // of the client; NULL before EGL 1.5
    snprintf(why, why_size, "this EGL opens only the displays of window systems");
    if (has(extensions, "EGL_EXT_platform_device") && try_devices(c, why, why_size) == 0)
        return c;
    if (has(extensions, "EGL_MESA_platform_surfaceless") &&
        try_display(c, EGL_PLATFORM_SURFACELESS_MESA, NULL, why, why_size) == 0)
        return c;
fail:
    destroy(c);
    return NULL;
}

static pt_gl_function function(void *context, const char *name) { return ((struct egl *)context)->get_proc(name); }

const struct pt_gl_context_ops pt_gl_context_egl = {"gl-egl", create, destroy, function};
