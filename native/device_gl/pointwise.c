// SPDX-License-Identifier: GPL-3.0-or-later
// Pointwise kernels: lib/pointwise.glsl around the body of each.
#include "device_gl.h"

#include <stdio.h>

static const struct pointwise {
    int keys, shading, albedo, slopes, clips, color, result; // which of its buffers these are, -1: none
    const char *name;                                        // NULL: not pointwise
} kernels[PT_KERNEL_COUNT] = {
#define PT_POINTWISE(name, ...) [PT_KERNEL_##name] = {__VA_ARGS__, #name},
#include "pointwise.def"
#undef PT_POINTWISE
};

int pt_gl_is_pointwise(enum pt_kernel kernel) { return kernels[kernel].name != NULL; }

static int program(struct pt_gl_device *d, enum pt_kernel kernel)
{
    const struct pointwise *k = &kernels[kernel];
    char definitions[256], body[64];
    if (d->programs[kernel][0])
        return PATINA_OK;
    snprintf(definitions, sizeof definitions,
             "#define PT_ARGUMENTS %s_args\n#define PT_RUN pt_%s\n#define KEYS %d\n#define SHADING %d\n#define ALBEDO %d\n"
             "#define SLOPES %d\n#define CLIPS %d\n#define RESULT %d\n",
             k->name, k->name, k->keys >= 0, k->shading >= 0, k->albedo >= 0, k->slopes >= 0, k->clips >= 0, k->result >= 0);
    snprintf(body, sizeof body, "pointwise/%s.h", k->name);
    return pt_gl_program_of_body(d, "lib/pointwise.glsl", definitions, body, &d->programs[kernel][0]);
}

int pt_gl_pointwise(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    const struct pt_gl_crop_args *crop = work->arguments;
    int result = program(d, work->kernel);
    if (result != PATINA_OK)
        return result;
    return pt_kernels[work->kernel].domain == PT_DOMAIN_crop
               ? pt_gl_dispatch_rows(d, work->kernel, 0, crop->crop_width, crop->crop_height)
               : pt_gl_dispatch_tiles(d, work->kernel, 0, PT_GL_TILES_POINTS);
}
