// SPDX-License-Identifier: GPL-3.0-or-later
// Runners of kernels that pick out a few pixels: a pass over tiles lists them, the costly part walks the list densely.
// (llvmpipe runs all lanes of a vector when one of them needs it.)
#include "device_gl.h"
#include "shared/lines.h"
#include "shared/colors.h"
#include "shared/filling.h"

#include <stdio.h>
#include <string.h>

enum { TILE_PIXELS = 64, GROUP = 64, TAKEN_EACH = 4 }; // TAKEN_EACH: as in push.comp

// A list of pixels, bound there, that `find` fills while it walks the tiles with points; then it is known how many workgroups walk it,
// `entries` each.
static int make_list(struct pt_gl_device *d, uint32_t binding, uint32_t tile_pixels, enum pt_kernel kernel, uint32_t find,
                     uint32_t entries)
{
    const size_t tiles = (size_t)d->tiles.columns * d->tiles.rows;
    int result = pt_gl_list_begin(d, PT_GL_SCRATCH_PIXELS, binding, tiles * tile_pixels * 4);
    if (result == PATINA_OK)
        result = pt_gl_dispatch_tiles(d, kernel, find, PT_GL_TILES_POINTS);
    return result == PATINA_OK ? pt_gl_list_groups(d, binding, 1, 0, entries, 1) : result;
}

static int dispatch_list(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant)
{
    return pt_gl_list_dispatch(d, kernel, variant, d->scratch[PT_GL_SCRATCH_PIXELS].name, 0);
}

// ---- shade -----------------------------------------------------------------------------------------------------

enum { MOST_UNROLLED = 8 };          // lights
enum { SHOWN = PT_GL_VARIANTS - 1 }; // among shade's programs: lib/shown.glsl

// What a light kernel must know: llvmpipe runs every branch that any lane may take.
static int plain_lights(const struct shade_args *args)
{
    return !args->casting && args->light_types < 2u << PATINA_LIGHT_POINT;
}

static int of_plane(const struct instance_args *instance)
{
    return instance->color_format == PT_COLOR_OF_PLANE || instance->color_format == PT_COLOR_OF_PIXEL;
}

// What the program knows beforehand, as llvmpipe runs all that it may have to: branches, and loops once more than they turn.
static void shade_definitions(const struct shade_args *args, int shading, char *text, size_t size)
{
    static const char *const blend[] = {"", "#define BLEND 1\n", "#define WIDE 1\n"};
    const struct instance_args *instance = &args->instance;
    const uint32_t opacity = !instance->has_opacities ? 0 : of_plane(instance) ? 2 : 1;
    char lights[24] = "args.light_count";
    if (args->light_count <= MOST_UNROLLED)
        snprintf(lights, sizeof lights, "%uu", args->light_count);
    snprintf(text, size,
             "#define SHADING %d\n#define ARRIVED %d\n#define OPACITY %u\n#define COLOR_FORMAT %u\n#define LIT %d\n"
             "#define LIGHTS %s\n#define PLAIN %d\n#define CASTING %d\n#define RECOLOR %d\n#define DIRECTED %d\n%s",
             shading, args->arrived != 0, opacity, instance->color_format % 6,
             !instance->lit              ? 0
             : instance->specular > 0.0f ? 2
                                         : 1,
             lights, plain_lights(args), args->casting > 0, args->recolor.source || args->recolor.graded,
             args->directed && instance->lit, blend[args->blend < 2 ? args->blend : 2]);
}

// Variants are numbered as they come; once there is no number left, the one that was not used for longest gives way.
static int shade_program(struct pt_gl_device *d, const char *definitions, uint32_t *variant)
{
    uint32_t v = 0;
    while (v < d->shade_count && strcmp(d->shade_definitions[v], definitions) != 0)
        v++;
    if (v == SHOWN) {
        v = 0;
        for (uint32_t i = 1; i < SHOWN; i++)
            v = d->shade_used[i] < d->shade_used[v] ? i : v;
        d->gl.DeleteProgram(d->programs[PT_KERNEL_shade][v]);
        d->programs[PT_KERNEL_shade][v] = 0;
    }
    d->shade_used[v] = ++d->shade_uses;
    snprintf(d->shade_definitions[v], sizeof d->shade_definitions[v], "%s", definitions);
    d->shade_count = v < d->shade_count ? d->shade_count : v + 1;
    *variant = v;
    return pt_gl_kernel_program(d, PT_KERNEL_shade, v, definitions);
}

// In a uniform array: read once for all lanes, where a block would be read once a lane.
void pt_gl_set_scales(struct pt_gl_device *d, GLuint program, const struct shade_args *args)
{
    if (args->casting)
        d->gl.ProgramUniform1fv(program, 16, PT_MAX_LIGHTS, args->scales);
}

// What a wide blend of normals fetches, once for all instances.
static int bind_shown(struct pt_gl_device *d, const struct view_args *view, const struct pt_buffer *keys)
{
    const size_t size = (size_t)view->width * view->height * 16;
    GLuint *program = &d->programs[PT_KERNEL_shade][SHOWN];
    int result = pt_gl_scratch(d, PT_GL_SCRATCH_SHOWN, size, 0);
    const GLuint name = d->scratch[PT_GL_SCRATCH_SHOWN].name;
    if (result == PATINA_OK && d->shown != keys->name) {
        result = *program ? PATINA_OK : pt_gl_program(d, "lib/shown.glsl", "", program);
        if (result == PATINA_OK)
            result = pt_gl_bind(d, PT_BIND_shade_shown, name, 0, size, "shade");
        if (result == PATINA_OK)
            result = pt_gl_dispatch_rows(d, PT_KERNEL_shade, SHOWN, view->width, view->height);
        d->shown = result == PATINA_OK ? keys->name : 0;
    }
    return result == PATINA_OK ? pt_gl_bind_texels(d, PT_UNIT_other_float4, name, 0, size) : result;
}

int pt_gl_shade(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    const struct shade_args *args = work->arguments;
    const struct pt_buffer *shading = work->buffers[PT_BUF_shade_shading];
    char definitions[sizeof d->shade_definitions[0]];
    uint32_t variant;
    shade_definitions(args, shading && shading->name, definitions, sizeof definitions);
    int result = shade_program(d, definitions, &variant);
    if (result == PATINA_OK && args->blend > 1)
        result = bind_shown(d, &args->view, work->buffers[PT_BUF_shade_keys]);
    if (result == PATINA_OK)
        pt_gl_set_scales(d, d->programs[PT_KERNEL_shade][variant], args);
    return result == PATINA_OK ? pt_gl_dispatch_tiles(d, PT_KERNEL_shade, variant, PT_GL_TILES_POINTS) : result;
}

// ---- antialias -------------------------------------------------------------------------------------------------

enum { FIND = 0, MIX = 1, APPLY = 2 };

// On a GPU: colours of edges lie by pixel, and which pixels are edges in a word for each invocation that walks a line of tiles.
static int antialias_lines(struct pt_gl_device *d, uint32_t variant)
{
    const size_t groups = ((size_t)d->tiles.columns * d->tiles.rows + 3) / 4, size = PT_GL_LIST_HEAD + groups * GROUP / 2 * 4;
    int result = pt_gl_scratch(d, PT_GL_SCRATCH_PIXELS, size, 0);
    if (result == PATINA_OK)
        result = pt_gl_bind(d, PT_BIND_antialias_edges, d->scratch[PT_GL_SCRATCH_PIXELS].name, 0, size, "antialias");
    if (result == PATINA_OK)
        result = pt_gl_dispatch_tiles(d, PT_KERNEL_antialias, variant + FIND, PT_GL_TILES_POINTS);
    return result == PATINA_OK ? pt_gl_dispatch_tiles(d, PT_KERNEL_antialias, variant + APPLY, PT_GL_TILES_POINTS) : result;
}

int pt_gl_antialias(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    const int hardware = (int)d->base.info.hardware;
    const struct antialias_args *args = work->arguments;
    const uint32_t variant = 3 * args->behind + 6 * args->inked, *rect = args->view.rect;
    const size_t size = hardware ? (size_t)args->view.width * args->view.height * 16
                                 : (size_t)(rect[2] - rect[0]) * (rect[3] - rect[1]) * 16; // if all were edges
    int result = PATINA_OK;
    for (uint32_t step = FIND; step <= APPLY && result == PATINA_OK; step += hardware ? APPLY - FIND : 1) {
        char definitions[64];
        snprintf(definitions, sizeof definitions, "#define STEP %u\n#define BEHIND %u\n#define INKED %u\n", step, args->behind,
                 args->inked);
        result = pt_gl_kernel_program(d, PT_KERNEL_antialias, variant + step, definitions);
    }
    if (result == PATINA_OK)
        result = pt_gl_scratch(d, PT_GL_SCRATCH_SHADED, size, 0);
    if (result == PATINA_OK)
        result = pt_gl_bind(d, PT_BIND_antialias_mixed, d->scratch[PT_GL_SCRATCH_SHADED].name, 0, size, "antialias");
    if (result == PATINA_OK && hardware)
        return antialias_lines(d, variant);
    if (result == PATINA_OK)
        result = make_list(d, PT_BIND_antialias_edges, TILE_PIXELS, PT_KERNEL_antialias, variant + FIND, GROUP);
    if (result == PATINA_OK)
        result = dispatch_list(d, PT_KERNEL_antialias, variant + MIX);
    return result == PATINA_OK ? dispatch_list(d, PT_KERNEL_antialias, variant + APPLY) : result;
}

// ---- smooth, antialias and compose as one -----------------------------------------------------------------

enum { TAIL = 1 }; // among compose's programs: two steps, and two where lines are drawn

// Of smooth, antialias and compose, as lib/tail.glsl reads them.
struct tail_args {
    struct smooth_args smooth;
    struct antialias_args antialias;
    struct compose_args compose;
    uint32_t walked[4];
};

// On a GPU the picture's background is written as well: the rectangle grows by the crop.
static void find_walked(const struct pt_gl_device *d, struct tail_args *args)
{
    const struct compose_args *c = &args->compose;
    uint32_t *walked = args->walked;
    memcpy(walked, args->smooth.view.rect, sizeof args->walked);
    if (!d->base.info.hardware)
        return;
    if (walked[2] <= walked[0] || walked[3] <= walked[1])
        memcpy(walked, (const uint32_t[]){c->crop_x, c->crop_y, c->crop_x, c->crop_y}, sizeof args->walked);
    walked[0] = c->crop_x < walked[0] ? c->crop_x : walked[0];
    walked[1] = c->crop_y < walked[1] ? c->crop_y : walked[1];
    walked[2] = c->crop_x + c->crop_width > walked[2] ? c->crop_x + c->crop_width : walked[2];
    walked[3] = c->crop_y + c->crop_height > walked[3] ? c->crop_y + c->crop_height : walked[3];
}

static int bind_tail(struct pt_gl_device *d, const struct tail_args *args, const struct pt_bound_pass *passes,
                     const struct pt_buffer *shaded)
{
    struct pt_buffer *const *planes = passes[0].buffers; // of smooth
    const struct pt_buffer *combined = passes[2].buffers[PT_BUF_compose_combined];
    const struct pt_buffer *line = args->antialias.inked ? passes[1].buffers[PT_BUF_antialias_line] : combined;
    pt_gl_arguments(d, args, sizeof *args);
    int result = pt_gl_bind(d, PT_BIND_tail_combined, combined->name, 0, combined->size, "tail");
    if (result == PATINA_OK)
        result = pt_gl_bind(d, PT_BIND_tail_line, line->name, 0, line->size, "tail");
    if (result == PATINA_OK)
        result = pt_gl_bind_texture(d, PT_UNIT_key, planes[PT_BUF_smooth_keys]);
    if (result == PATINA_OK)
        result = pt_gl_bind_texture(d, PT_UNIT_from, planes[PT_BUF_smooth_from]);
    if (result == PATINA_OK)
        result = pt_gl_bind_texture(d, PT_UNIT_deff, planes[PT_BUF_smooth_deff]);
    return result == PATINA_OK ? pt_gl_bind_texture(d, PT_UNIT_float4, shaded) : result;
}

// What shows no point is background; the rest is smoothed into the picture, and then its edges.
int pt_gl_tail(struct pt_gl_device *d, const struct pt_bound_pass *passes, const struct pt_buffer *shaded)
{
    struct tail_args args = {.smooth = *(const struct smooth_args *)passes[0].arguments,
                             .antialias = *(const struct antialias_args *)passes[1].arguments,
                             .compose = *(const struct compose_args *)passes[2].arguments};
    const int hardware = (int)d->base.info.hardware;
    static const char *const definitions[] = {"#define STEP 0\n#define INKED 0\n", "#define STEP 1\n#define INKED 0\n",
                                              "#define STEP 0\n#define INKED 1\n", "#define STEP 1\n#define INKED 1\n"};
    const struct pt_buffer *combined = passes[2].buffers[PT_BUF_compose_combined];
    const uint32_t find = 2 * (args.antialias.inked != 0);
    uint32_t words[4];
    memcpy(words, args.compose.background, sizeof words);
    find_walked(d, &args);
    struct view_args view = args.smooth.view;
    memcpy(view.rect, args.walked, sizeof view.rect);
    int result = hardware ? PATINA_OK : pt_gl_clear(d, combined->name, 0, combined->size, words);
    if (result == PATINA_OK)
        result = pt_gl_tiles(d, passes[0].buffers[PT_BUF_smooth_keys], &view);
    for (uint32_t i = find; i < find + (hardware ? 1 : 2) && result == PATINA_OK; i++)
        if (!d->programs[PT_KERNEL_compose][TAIL + i])
            result = pt_gl_program(d, "lib/tail.glsl", definitions[i], &d->programs[PT_KERNEL_compose][TAIL + i]);
    if (result == PATINA_OK)
        result = bind_tail(d, &args, passes, shaded);
    if (result == PATINA_OK && hardware)
        return pt_gl_dispatch_tiles(d, PT_KERNEL_compose, TAIL + find, PT_GL_TILES_POINTS);
    if (result == PATINA_OK)
        result = make_list(d, PT_BIND_tail_edges, TILE_PIXELS, PT_KERNEL_compose, TAIL + find, GROUP);
    return result == PATINA_OK ? dispatch_list(d, PT_KERNEL_compose, TAIL + find + 1) : result;
}

// ---- push ------------------------------------------------------------------------------------------------------

enum { COVERED = 0, TAKE = 1 };

struct view_args pt_gl_coarse_view(const struct push_args *args)
{
    struct view_args view = args->view;
    view.width = args->coarse_width;
    view.height = args->coarse_height;
    view.rect[0] >>= 1;
    view.rect[1] >>= 1;
    view.rect[2] = (view.rect[2] + 1) >> 1;
    view.rect[3] = (view.rect[3] + 1) >> 1;
    return view;
}

int pt_gl_push(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    (void)work;
    int result = pt_gl_kernel_program(d, PT_KERNEL_push, COVERED, "#define STEP 0\n");
    if (d->base.info.hardware)
        return result == PATINA_OK ? pt_gl_dispatch_tiles(d, PT_KERNEL_push, COVERED, PT_GL_TILES_POINTS) : result;
    if (result == PATINA_OK)
        result = pt_gl_kernel_program(d, PT_KERNEL_push, TAKE, "#define STEP 1\n");
    if (result == PATINA_OK) // a tile has twice the columns of a tile of its own level
        result = make_list(d, PT_BIND_push_taken, 4 * TILE_PIXELS, PT_KERNEL_push, COVERED, TAKEN_EACH * GROUP);
    return result == PATINA_OK ? dispatch_list(d, PT_KERNEL_push, TAKE) : result;
}

// ---- lines -----------------------------------------------------------------------------------------------------

int pt_gl_lines(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    const struct lines_args *args = work->arguments;
    enum { STEPS = 3, SIDE = 16 };
    static const char *const definitions[STEPS] = {"#define STEP 0\n", "#define STEP 1\n", "#define STEP 2\n"};
    const struct view_args *view = &args->view;
    const size_t size = (size_t)view->width * view->height * 4;
    const uint32_t columns = (view->rect[2] - view->rect[0] + SIDE - 1) / SIDE;
    const uint32_t rows = (view->rect[3] - view->rect[1] + SIDE - 1) / SIDE;
    int result = pt_gl_scratch(d, PT_GL_SCRATCH_PIXELS, size, 0);
    if (result == PATINA_OK)
        result = pt_gl_scratch(d, PT_GL_SCRATCH_COLORS, size, 0);
    if (result == PATINA_OK)
        result = pt_gl_bind(d, PT_BIND_lines_steps, d->scratch[PT_GL_SCRATCH_PIXELS].name, 0, size, "lines");
    if (result == PATINA_OK)
        result = pt_gl_bind(d, PT_BIND_lines_discs, d->scratch[PT_GL_SCRATCH_COLORS].name, 0, size, "lines");
    for (uint32_t step = 0; step < STEPS && result == PATINA_OK; step++) {
        result = pt_gl_kernel_program(d, PT_KERNEL_lines, step, definitions[step]);
        if (result == PATINA_OK)
            result = pt_gl_dispatch(d, PT_KERNEL_lines, step, columns, rows);
    }
    return result;
}
