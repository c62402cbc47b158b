// SPDX-License-Identifier: GPL-3.0-or-later
// Running a kernel: its arguments and buffers are bound (bind.c), and it is dispatched once over its domain. Some have runners of
// their own.
#include "device_gl.h"
#include "shared/measured.h"
#include "shared/picture.h"
#include "shared/colors.h"

#include <stdio.h>

static int run_over(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, const char *definitions, uint32_t width,
                    uint32_t height)
{
    GLint group[3] = {1, 1, 1};
    int result = pt_gl_kernel_program(d, kernel, variant, definitions);
    if (result != PATINA_OK)
        return result;
    d->gl.GetProgramiv(d->programs[kernel][variant], GL_COMPUTE_WORK_GROUP_SIZE, group);
    return pt_gl_dispatch(d, kernel, variant, (width + (uint32_t)group[0] - 1) / (uint32_t)group[0],
                          (height + (uint32_t)group[1] - 1) / (uint32_t)group[1]);
}

static int run_rows(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t width, uint32_t height)
{
    int result = pt_gl_kernel_program(d, kernel, 0, "");
    return result == PATINA_OK ? pt_gl_dispatch_rows(d, kernel, 0, width, height) : result;
}

// ---- kernels with runners of their own: see the table below ------------------------------------------------------------

static int run_extract(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    static const char *const definitions[] = {"#define PLANE 0\n", "#define PLANE 1\n", "#define PLANE 2\n",
                                              "#define PLANE 3\n"};
    const struct extract_args *args = work->arguments;
    const uint32_t asked[] = {args->depth, args->normal, args->source, args->shadow};
    int result = PATINA_OK;
    for (uint32_t i = 0; i < 4 && result == PATINA_OK; i++)
        if (asked[i])
            result = run_over(d, PT_KERNEL_extract, i, definitions[i], args->crop_width, args->crop_height);
    return result;
}

static int run_ink(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    static const char *const definitions[] = {"#define COLOR_FORMAT 0\n", "#define COLOR_FORMAT 1\n",
                                              "#define COLOR_FORMAT 2\n"};
    const struct ink_args *args = work->arguments;
    const uint32_t format = args->instance.color_format % 3;
    return run_over(d, PT_KERNEL_ink, format, definitions[format], args->crop_width, args->crop_height);
}

static int run_resolve(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    const struct resolve_args *args = work->arguments;
    const uint32_t normals = args->instance.has_normals != 0, sigmas = args->sigma_scale > 0.0f, span = args->with_span != 0;
    const uint32_t variant = normals + 2 * sigmas + 4 * span;
    char definitions[64];
    snprintf(definitions, sizeof definitions, "#define NORMALS %u\n#define SIGMAS %u\n#define SPAN %u\n", normals, sigmas,
             span);
    int result = pt_gl_kernel_program(d, PT_KERNEL_resolve, variant, definitions);
    if (result != PATINA_OK)
        return result;
    d->gl.ProgramUniform1fv(d->programs[PT_KERNEL_resolve][variant], 16, PT_SPACINGS, args->instance.spacing);
    return pt_gl_dispatch_tiles(d, PT_KERNEL_resolve, variant, PT_GL_TILES_POINTS);
}

// Every pixel is gathered before any is blurred.
static int run_obscure(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    static const char *const definitions[] = {"#define STEP 0\n", "#define STEP 1\n"};
    int result = PATINA_OK;
    for (uint32_t step = 0; step < 2 && result == PATINA_OK; step++) {
        result = pt_gl_kernel_program(d, work->kernel, step, definitions[step]);
        if (result == PATINA_OK)
            result = pt_gl_dispatch_tiles(d, work->kernel, step, PT_GL_TILES_POINTS);
    }
    return result;
}

static int run_pull(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    const struct view_args *view = work->arguments;
    return run_rows(d, PT_KERNEL_pull, view->rect[2] - view->rect[0], view->rect[3] - view->rect[1]);
}

// Whole tiles, counted from the plane's corner.
static int run_peel(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    const struct view_args *view = work->arguments;
    return run_over(d, PT_KERNEL_peel, 0, "", view->rect[2] - (view->rect[0] >> PT_TILE_LEVEL << PT_TILE_LEVEL),
                    view->rect[3] - (view->rect[1] >> PT_TILE_LEVEL << PT_TILE_LEVEL));
}

// Pointwise kernels are pointwise.c's. The others have one dispatch over their domain: tiles with points in them, the rectangle or the
// crop.
static pt_gl_runner *const runners[PT_KERNEL_COUNT] = {
    [PT_KERNEL_sift] = pt_gl_points,   [PT_KERNEL_scatter] = pt_gl_scatter,
    [PT_KERNEL_splat] = pt_gl_splat,   [PT_KERNEL_resolve] = run_resolve,
    [PT_KERNEL_blend] = pt_gl_blend,   [PT_KERNEL_center] = pt_gl_points,
    [PT_KERNEL_pull] = run_pull,       [PT_KERNEL_fill] = pt_gl_fill,
    [PT_KERNEL_push] = pt_gl_push,     [PT_KERNEL_average] = pt_gl_average,
    [PT_KERNEL_raster] = pt_gl_raster, [PT_KERNEL_shadow_test] = pt_gl_points,
    [PT_KERNEL_lines] = pt_gl_lines,   [PT_KERNEL_shade] = pt_gl_shade,
    [PT_KERNEL_obscure] = run_obscure, [PT_KERNEL_antialias] = pt_gl_antialias,
    [PT_KERNEL_peel] = run_peel,       [PT_KERNEL_extract] = run_extract,
    [PT_KERNEL_ink] = run_ink,         [PT_KERNEL_gather] = pt_gl_gather,
    [PT_KERNEL_soft] = pt_gl_soft,     [PT_KERNEL_merge] = pt_gl_merge,
    [PT_KERNEL_differ] = pt_gl_differ, [PT_KERNEL_dim] = pt_gl_points,
    [PT_KERNEL_rank] = pt_gl_points,
};

static int run_once(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    const struct view_args *view = work->arguments;
    const struct pt_gl_crop_args *crop = work->arguments;
    if (pt_gl_is_pointwise(work->kernel))
        return pt_gl_pointwise(d, work);
    if (pt_kernels[work->kernel].domain == PT_DOMAIN_crop)
        return run_over(d, work->kernel, 0, "", crop->crop_width, crop->crop_height);
    if (pt_kernels[work->kernel].domain == PT_DOMAIN_rectangle)
        return run_over(d, work->kernel, 0, "", view->rect[2] - view->rect[0], view->rect[3] - view->rect[1]);
    int result = pt_gl_kernel_program(d, work->kernel, 0, "");
    return result == PATINA_OK ? pt_gl_dispatch_tiles(d, work->kernel, 0, PT_GL_TILES_POINTS) : result;
}

// Of a kernel's keys before it writes them; fill says itself when it has.
static void forget_tiles(struct pt_gl_device *d, const struct pt_gl_work *work)
{
    const struct pt_kernel_row *row = &pt_kernels[work->kernel];
    for (uint32_t i = 0; i < row->fixed && work->kernel != PT_KERNEL_fill; i++)
        if (row->buffers[i].written && row->buffers[i].formats & 1u << PT_FORMAT_key && work->buffers[i] &&
            work->buffers[i]->name == d->tiles.keys)
            pt_gl_tiles_forget(d);
}

// The keys that tell which tiles a kernel visits: those that it reads as a texture.
static const struct pt_buffer *keys_of(const struct pt_gl_work *work)
{
    const struct pt_buffer_row *rows = pt_kernels[work->kernel].buffers;
    uint32_t i = 0;
    while (rows[i].unit != 1 + PT_UNIT_key)
        i++;
    return work->buffers[i];
}

int pt_gl_run(struct pt_gl_device *d, const struct pt_gl_work *given)
{
    struct pt_gl_work copy = *given, *work = &copy;
    struct pt_gl_winners winners;
    const struct view_args *view = work->arguments; // every argument struct but that of sift begins with its view
    const enum pt_domain domain = pt_kernels[work->kernel].domain;
    int result = PATINA_OK;
    pt_gl_arguments(d, work->arguments, work->argument_size);
    if (work->kernel != PT_KERNEL_shade) // it writes nothing that normals are blended from
        d->shown = 0;
    if ((domain == PT_DOMAIN_tiles || domain == PT_DOMAIN_rectangle) &&
        (view->rect[2] <= view->rect[0] || view->rect[3] <= view->rect[1]))
        return PATINA_OK;
    forget_tiles(d, work);
    if (domain == PT_DOMAIN_tiles) {
        const struct view_args tiles = work->kernel == PT_KERNEL_push ? pt_gl_coarse_view(work->arguments) : *view;
        result = pt_gl_tiles(d, keys_of(work), &tiles);
    }
    d->rounds = 0;
    if (result == PATINA_OK)
        result = pt_gl_take_winners(d, work, &winners);
    if (result == PATINA_OK)
        result = pt_gl_bind_buffers(d, work);
    if (result == PATINA_OK)
        result = runners[work->kernel] ? runners[work->kernel](d, work) : run_once(d, work);
    d->base.ranges.rounds = d->rounds > d->base.ranges.rounds ? d->rounds : d->base.ranges.rounds;
    return result;
}

int pt_gl_run_tail(struct pt_gl_device *d, const struct pt_bound_pass *passes, uint32_t count)
{
    const struct pt_bound_pass *tail = passes + count - 3;
    const struct view_args *view = tail->arguments;
    const size_t size = (size_t)view->width * view->height * 16;
    int result = pt_gl_scratch(d, PT_GL_SCRATCH_SHADED, size, 0);
    struct pt_buffer shaded = {.size = size, .name = d->scratch[PT_GL_SCRATCH_SHADED].name};
    for (const struct pt_bound_pass *shade = passes; shade < tail && result == PATINA_OK; shade++) {
        shade->buffers[PT_BUF_shade_shading] = NULL;
        shade->buffers[PT_BUF_shade_color] = &shaded;
        result = pt_gl_run(d, &(struct pt_gl_work){.kernel = PT_KERNEL_shade,
                                                   .arguments = shade->arguments,
                                                   .argument_size = sizeof(struct shade_args),
                                                   .buffers = shade->buffers});
    }
    return result == PATINA_OK ? pt_gl_tail(d, tail, &shaded) : result;
}
