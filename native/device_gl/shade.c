// SPDX-License-Identifier: GPL-3.0-or-later
// shade's runner: normals, then the few that are blended from many neighbours, densely, then colours.
#include "device_gl.h"

enum { NORMALS = 0, BLEND = 1, COLORS = 2, TILE_PIXELS = 256, GROUP = 64 };

static int programs(struct pt_gl_device *d, const struct shade_args *args, uint32_t colors)
{
    static const char *const definitions[] = {"#define STEP 2\n#define COLOR_FORMAT 0\n#define LIT 0\n",
                                              "#define STEP 2\n#define COLOR_FORMAT 0\n#define LIT 1\n",
                                              "#define STEP 2\n#define COLOR_FORMAT 1\n#define LIT 0\n",
                                              "#define STEP 2\n#define COLOR_FORMAT 1\n#define LIT 1\n",
                                              "#define STEP 2\n#define COLOR_FORMAT 2\n#define LIT 0\n",
                                              "#define STEP 2\n#define COLOR_FORMAT 2\n#define LIT 1\n"};
    int result = pt_gl_kernel_program(d, PT_KERNEL_shade, NORMALS, "#define STEP 0\n");
    if (result == PATINA_OK && args->refined)
        result = pt_gl_kernel_program(d, PT_KERNEL_shade, BLEND, "#define STEP 1\n");
    if (result == PATINA_OK)
        result = pt_gl_kernel_program(d, PT_KERNEL_shade, colors, definitions[colors - COLORS]);
    return result;
}

static int prepare(struct pt_gl_device *d)
{
    static const uint32_t none;
    size_t pixels = (size_t)d->tiles.count[PT_GL_TILES_POINTS] * TILE_PIXELS;
    int result = pt_gl_scratch(d, PT_GL_SCRATCH_COUNTERS, sizeof none, 0);
    if (result == PATINA_OK)
        result = pt_gl_scratch(d, PT_GL_SCRATCH_PIXELS, pixels * 4, 0);
    if (result == PATINA_OK)
        result = pt_gl_bind(d, 9, d->scratch[PT_GL_SCRATCH_COUNTERS].name, 0, sizeof none, "shade");
    if (result == PATINA_OK)
        result = pt_gl_bind(d, 10, d->scratch[PT_GL_SCRATCH_PIXELS].name, 0, pixels * 4, "shade");
    d->gl.BindBuffer(GL_COPY_WRITE_BUFFER, d->scratch[PT_GL_SCRATCH_COUNTERS].name);
    d->gl.BufferSubData(GL_COPY_WRITE_BUFFER, 0, sizeof none, &none);
    return result;
}

static int blend(struct pt_gl_device *d)
{
    uint32_t count = 0, x, y;
    d->gl.BindBuffer(GL_COPY_READ_BUFFER, d->scratch[PT_GL_SCRATCH_COUNTERS].name);
    d->gl.GetBufferSubData(GL_COPY_READ_BUFFER, 0, sizeof count, &count);
    pt_gl_grid((count + GROUP - 1) / GROUP, &x, &y);
    d->gl.ProgramUniform1ui(d->programs[PT_KERNEL_shade][BLEND], 0, count);
    return pt_gl_dispatch(d, PT_KERNEL_shade, BLEND, x, y);
}

// In a uniform array: read once for all lanes, where a block would be read once a lane.
static void set_lights(struct pt_gl_device *d, const struct shade_args *args, uint32_t colors)
{
    GLfloat lights[PT_MAX_LIGHTS][8] = {{0}};
    for (uint32_t i = 0; i < args->light_count && i < PT_MAX_LIGHTS; i++) {
        const struct light_args *light = &args->lights[i];
        for (int k = 0; k < 3; k++) {
            lights[i][k] = light->color[k];
            lights[i][4 + k] = light->vector[k];
        }
        lights[i][3] = (GLfloat)light->type;
    }
    d->gl.ProgramUniform4fv(d->programs[PT_KERNEL_shade][colors], 16, 2 * PT_MAX_LIGHTS, &lights[0][0]);
}

int pt_gl_shade(struct pt_gl_device *d, const struct shade_args *args)
{
    uint32_t colors = COLORS + 2 * (args->instance.color_format % 3) + (args->instance.lit != 0);
    if (!d->tiles.count[PT_GL_TILES_POINTS])
        return PATINA_OK;
    int result = programs(d, args, colors);
    if (result == PATINA_OK)
        result = prepare(d);
    if (result == PATINA_OK)
        result = pt_gl_dispatch_tiles(d, PT_KERNEL_shade, NORMALS, PT_GL_TILES_POINTS);
    if (result == PATINA_OK && args->refined)
        result = blend(d);
    if (result == PATINA_OK && args->instance.lit)
        set_lights(d, args, colors);
    return result == PATINA_OK ? pt_gl_dispatch_tiles(d, PT_KERNEL_shade, colors, PT_GL_TILES_POINTS) : result;
}
