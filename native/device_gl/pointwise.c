// SPDX-License-Identifier: GPL-3.0-or-later
// Pointwise kernels: lib/pointwise.glsl around the body of each.
#include "device_gl.h"

#include <stdio.h>

static const struct pointwise {
    int keys, shading, albedo, clips, color, result; // which of its buffers these are, -1: none
    const char *name;                                // NULL: not pointwise
} kernels[PT_KERNEL_COUNT] = {
#define PT_POINTWISE(name, ...) [PT_KERNEL_##name] = {__VA_ARGS__, #name},
#include "pointwise.def"
#undef PT_POINTWISE
};

int pt_gl_is_pointwise(enum pt_kernel kernel) { return kernels[kernel].name != NULL; }

int pt_gl_of_crop(enum pt_kernel kernel)
{
    return kernels[kernel].name && (kernels[kernel].keys < 0 || kernels[kernel].result >= 0);
}

static int program(struct pt_gl_device *d, enum pt_kernel kernel)
{
    const struct pointwise *k = &kernels[kernel];
    char definitions[256], body[64];
    if (d->programs[kernel][0])
        return PATINA_OK;
    snprintf(definitions, sizeof definitions,
             "#define PT_ARGUMENTS %s_args\n#define PT_RUN pt_%s\n#define KEYS %d\n#define SHADING %d\n#define ALBEDO %d\n"
             "#define CLIPS %d\n#define COLOR %d\n#define RESULT %d\n",
             k->name, k->name, k->keys >= 0, k->shading >= 0, k->albedo >= 0, k->clips + 1, k->color + 1, k->result + 1);
    snprintf(body, sizeof body, "pointwise/%s.h", k->name);
    return pt_gl_program_of_body(d, "lib/pointwise.glsl", definitions, body, &d->programs[kernel][0]);
}

int pt_gl_pointwise_planes(struct pt_gl_device *d, enum pt_kernel kernel, struct pt_buffer *const *buffers)
{
    const struct pointwise *k = &kernels[kernel];
    const int first = k->shading >= 0 ? k->shading : k->albedo >= 0 ? k->albedo : k->result >= 0 ? k->color : -1;
    int result = k->keys >= 0 ? pt_gl_bind_texture(d, 0, buffers[k->keys]) : PATINA_OK;
    if (result == PATINA_OK && first >= 0)
        result = pt_gl_bind_texture(d, 3, buffers[first]);
    if (result == PATINA_OK && k->shading >= 0 && k->albedo >= 0)
        result = pt_gl_bind_texture(d, 4, buffers[k->albedo]);
    return result;
}

int pt_gl_pointwise(struct pt_gl_device *d, enum pt_kernel kernel, const void *arguments)
{
    const struct { // what arguments of kernels of the crop begin with
        struct view_args view;
        uint32_t crop_x, crop_y, crop_width, crop_height;
    } *crop = arguments;
    int result = program(d, kernel);
    if (result != PATINA_OK)
        return result;
    return pt_gl_of_crop(kernel) ? pt_gl_dispatch_rows(d, kernel, 0, crop->crop_width, crop->crop_height)
                                 : pt_gl_dispatch_tiles(d, kernel, 0, PT_GL_TILES_POINTS);
}
