// SPDX-License-Identifier: GPL-3.0-or-later
// Running a kernel: bind its arguments and buffers, one dispatch over view.rect. Some have their own runners.
#include "device_gl.h"

#include <stdio.h>

int pt_gl_kernel_program(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, const char *definitions)
{
    if (d->programs[kernel][variant])
        return PATINA_OK;
    char name[64];
    snprintf(name, sizeof name, "kernels/%s.comp", pt_kernel_names[kernel]);
    return pt_gl_program(d, name, definitions, &d->programs[kernel][variant]);
}

int pt_gl_bind(struct pt_gl_device *d, uint32_t binding, GLuint name, size_t offset, size_t size, const char *what)
{
    if (size > d->block_size)
        return pt_gl_fail(d, PATINA_ERROR_UNSUPPORTED,
                          "%s: a buffer of %zu bytes; this OpenGL driver's shaders reach %zu at most", what, size,
                          d->block_size);
    size_t padded = size ? (size + 15) & ~(size_t)15 : 16; // as buffers are made
    d->gl.BindBufferRange(GL_SHADER_STORAGE_BUFFER, binding, name, (GLintptr)offset, (GLsizeiptr)padded);
    return PATINA_OK;
}

int pt_gl_dispatch(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, uint32_t x, uint32_t y)
{
    if (x && y) {
        d->gl.UseProgram(d->programs[kernel][variant]);
        d->gl.DispatchCompute(x, y, 1);
        d->gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT |
                            GL_TEXTURE_FETCH_BARRIER_BIT);
    }
    char doing[64];
    snprintf(doing, sizeof doing, "running %s", pt_kernel_names[kernel]);
    return pt_gl_check(d, doing);
}

int pt_gl_scratch(struct pt_gl_device *d, enum pt_gl_scratch_use use, size_t size, size_t keep)
{
    const GladGLContext *gl = &d->gl;
    struct pt_gl_scratch *scratch = &d->scratch[use];
    if (size <= scratch->size)
        return PATINA_OK;
    size = (size + size / 4 + 4095) & ~(size_t)4095;
    GLuint name = 0;
    gl->GenBuffers(1, &name);
    gl->BindBuffer(GL_COPY_WRITE_BUFFER, name);
    gl->BufferData(GL_COPY_WRITE_BUFFER, (GLsizeiptr)size, NULL, GL_DYNAMIC_COPY);
    if (keep) {
        gl->BindBuffer(GL_COPY_READ_BUFFER, scratch->name);
        gl->CopyBufferSubData(GL_COPY_READ_BUFFER, GL_COPY_WRITE_BUFFER, 0, 0, (GLsizeiptr)keep);
    }
    int result = pt_gl_check(d, "making room for a kernel");
    if (result != PATINA_OK) {
        gl->DeleteBuffers(1, &name);
        return result;
    }
    gl->DeleteBuffers(1, &scratch->name);
    *scratch = (struct pt_gl_scratch){name, size};
    return PATINA_OK;
}

// Planes that shaders read as buffer textures (lib/planes.glsl): numbers of buffers in kernels.def, from 1; 0: none.
static const uint8_t textures[PT_KERNEL_COUNT][PT_GL_TEXTURES] = {
    // keys, from, deff, float4, float4, words (of points: by their runners; of others: span)
    [PT_KERNEL_normals] = {1},          [PT_KERNEL_surface] = {1, 0, 0, 3},   [PT_KERNEL_pull] = {1, 2},
    [PT_KERNEL_fill] = {1, 2, 4, 3, 0, 5}, [PT_KERNEL_push] = {1, 2, 6, 5, 0, 7}, [PT_KERNEL_shade] = {1, 2, 4, 3},
    [PT_KERNEL_smooth] = {1, 2, 3, 4},  [PT_KERNEL_antialias] = {1, 2, 3, 4},
    [PT_KERNEL_extract] = {1, 2, 0, 3}, [PT_KERNEL_peel] = {1, 2, 3, 4, 5},   [PT_KERNEL_mark] = {1},
    [PT_KERNEL_lit] = {1, 2, 3},        [PT_KERNEL_edl] = {1},
    [PT_KERNEL_obscure] = {1, 2, 3, 4}, [PT_KERNEL_focus] = {1, 0, 0, 2},
    [PT_KERNEL_lines] = {1, 2, 4, 3},   [PT_KERNEL_ink] = {1},            [PT_KERNEL_limit] = {1, 2, 3},
    [PT_KERNEL_assess] = {1},           [PT_KERNEL_reopen] = {1, 2, 3},
};

int pt_gl_bind_texture(struct pt_gl_device *d, uint32_t unit, const struct pt_buffer *plane)
{
    return pt_gl_bind_texels(d, unit, plane->name, 0, plane->size);
}

int pt_gl_bind_texels(struct pt_gl_device *d, uint32_t unit, GLuint name, size_t offset, size_t size)
{
    static const GLenum formats[PT_GL_TEXTURES] = {GL_RG32UI, GL_R32UI, GL_R32F, GL_RGBA32F, GL_RGBA32F, GL_R32UI};
    static const uint8_t sizes[PT_GL_TEXTURES] = {8, 4, 4, 16, 16, 4};
    size_t texels = size / sizes[unit];
    if (texels > d->texels)
        return pt_gl_fail(d, PATINA_ERROR_UNSUPPORTED,
                          "a plane of %zu pixels; this OpenGL driver's buffer textures hold %zu at most", texels,
                          d->texels);
    d->gl.ActiveTexture(GL_TEXTURE0 + unit);
    d->gl.BindTexture(GL_TEXTURE_BUFFER, d->textures[unit]);
    d->gl.TexBufferRange(GL_TEXTURE_BUFFER, formats[unit], name, (GLintptr)offset,
                         (GLsizeiptr)(size ? size : 16)); // as buffers are made
    return PATINA_OK;
}

// Filters that visit listed tiles only. The others write every pixel, or are rare.
static int tiled(enum pt_kernel kernel)
{
    return kernel == PT_KERNEL_normals || kernel == PT_KERNEL_surface || kernel == PT_KERNEL_shade ||
           kernel == PT_KERNEL_smooth || kernel == PT_KERNEL_antialias ||
           kernel == PT_KERNEL_push || kernel == PT_KERNEL_mark || kernel == PT_KERNEL_edl ||
           kernel == PT_KERNEL_obscure || (pt_gl_is_pointwise(kernel) && !pt_gl_of_crop(kernel));
}

static int run_over(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, const char *definitions,
                    uint32_t width, uint32_t height)
{
    GLint group[3] = {1, 1, 1};
    int result = pt_gl_kernel_program(d, kernel, variant, definitions);
    if (result != PATINA_OK)
        return result;
    d->gl.GetProgramiv(d->programs[kernel][variant], GL_COMPUTE_WORK_GROUP_SIZE, group);
    return pt_gl_dispatch(d, kernel, variant, (width + (uint32_t)group[0] - 1) / (uint32_t)group[0],
                          (height + (uint32_t)group[1] - 1) / (uint32_t)group[1]);
}

// llvmpipe spends as much on an invocation as on a pixel.
int pt_gl_dispatch_rows(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t variant, uint32_t width, uint32_t height)
{
    enum { COLUMNS = 64, ROWS = 4 }; // of a workgroup, as in lib/planes.glsl
    return pt_gl_dispatch(d, kernel, variant, (width + COLUMNS - 1) / COLUMNS, (height + ROWS - 1) / ROWS);
}

static int run_rows(struct pt_gl_device *d, enum pt_kernel kernel, uint32_t width, uint32_t height)
{
    int result = pt_gl_kernel_program(d, kernel, 0, "");
    return result == PATINA_OK ? pt_gl_dispatch_rows(d, kernel, 0, width, height) : result;
}

static int run_extract(struct pt_gl_device *d, const struct extract_args *args)
{
    static const char *const definitions[] = {"#define PLANE 0\n", "#define PLANE 1\n", "#define PLANE 2\n", "#define PLANE 3\n"};
    const uint32_t asked[] = {args->depth, args->normal, args->source, args->shadow};
    int result = PATINA_OK;
    for (uint32_t i = 0; i < 4 && result == PATINA_OK; i++)
        if (asked[i])
            result = run_over(d, PT_KERNEL_extract, i, definitions[i], args->crop_width, args->crop_height);
    return result;
}

static int run_surface(struct pt_gl_device *d, const struct surface_args *args, const struct pt_buffer *words)
{
    const uint32_t normals = args->instance.has_normals != 0, sigmas = args->sigma_scale > 0.0f, span = args->with_span != 0;
    const uint32_t variant = normals + 2 * sigmas + 4 * span;
    char definitions[64];
    snprintf(definitions, sizeof definitions, "#define NORMALS %u\n#define SIGMAS %u\n#define SPAN %u\n", normals, sigmas, span);
    int result = pt_gl_kernel_program(d, PT_KERNEL_surface, variant, definitions);
    if (result == PATINA_OK && !d->base.info.hardware)
        result = pt_gl_bind_texture(d, 5, words);
    if (result != PATINA_OK)
        return result;
    d->gl.ProgramUniform1fv(d->programs[PT_KERNEL_surface][variant], 16, PT_SPACINGS, args->instance.spacing);
    return pt_gl_dispatch_tiles(d, PT_KERNEL_surface, variant, PT_GL_TILES_POINTS);
}

// Every pixel is gathered before any is blurred.
static int run_obscure(struct pt_gl_device *d)
{
    static const char *const definitions[] = {"#define STEP 0\n", "#define STEP 1\n"};
    int result = PATINA_OK;
    for (uint32_t step = 0; step < 2 && result == PATINA_OK; step++) {
        result = pt_gl_kernel_program(d, PT_KERNEL_obscure, step, definitions[step]);
        if (result == PATINA_OK)
            result = pt_gl_dispatch_tiles(d, PT_KERNEL_obscure, step, PT_GL_TILES_POINTS);
    }
    return result;
}

static int run_ink(struct pt_gl_device *d, const struct ink_args *args)
{
    static const char *const definitions[] = {"#define COLOR_FORMAT 0\n", "#define COLOR_FORMAT 1\n", "#define COLOR_FORMAT 2\n"};
    const uint32_t format = args->instance.color_format % 3;
    return run_over(d, PT_KERNEL_ink, format, definitions[format], args->crop_width, args->crop_height);
}

// Only tiles with points in them.
static int run_tiles(struct pt_gl_device *d, enum pt_kernel kernel)
{
    int result = pt_gl_kernel_program(d, kernel, 0, "");
    return result == PATINA_OK ? pt_gl_dispatch_tiles(d, kernel, 0, PT_GL_TILES_POINTS) : result;
}

int pt_gl_bind_buffers(struct pt_gl_device *d, enum pt_kernel kernel, size_t argument_size,
                        struct pt_buffer *const *buffers, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        // A buffer that a kernel may do without (colors, a pass that nobody asked for) is missing: any other stands in.
        int missing = !buffers[i] || !buffers[i]->name;
        int result = pt_gl_bind(d, 1 + i, missing ? d->arguments : buffers[i]->name, 0,
                                missing ? argument_size : buffers[i]->size, pt_kernel_names[kernel]);
        if (result != PATINA_OK)
            return result;
    }
    for (uint32_t unit = 0; unit < PT_GL_TEXTURES; unit++) {
        uint32_t number = textures[kernel][unit];
        if (!number || number > count || !buffers[number - 1] || !buffers[number - 1]->name)
            continue;
        int result = pt_gl_bind_texture(d, unit, buffers[number - 1]);
        if (result != PATINA_OK)
            return result;
    }
    return PATINA_OK;
}

static int run_filter(struct pt_gl_device *d, enum pt_kernel kernel, const void *arguments, struct pt_buffer *const *buffers)
{
    const struct view_args *view = arguments; // every argument struct begins with its view
    if (pt_gl_is_pointwise(kernel))
        return pt_gl_pointwise(d, kernel, arguments);
    switch (kernel) {
    case PT_KERNEL_shade:
        return pt_gl_shade(d, arguments, buffers);
    case PT_KERNEL_push:
        return pt_gl_push(d);
    case PT_KERNEL_antialias:
        return pt_gl_antialias(d, arguments);
    case PT_KERNEL_obscure:
        return run_obscure(d);
    case PT_KERNEL_surface:
        return run_surface(d, arguments, buffers[1]);
    case PT_KERNEL_normals:
    case PT_KERNEL_smooth:
    case PT_KERNEL_mark:
    case PT_KERNEL_edl:
        return run_tiles(d, kernel);
    case PT_KERNEL_focus: {
        const struct focus_args *args = arguments;
        return run_over(d, kernel, 0, "", args->crop_width, args->crop_height);
    }
    case PT_KERNEL_extract:
        return run_extract(d, arguments);
    case PT_KERNEL_assess:
        return run_over(d, kernel, 0, "", view->rect[2] - view->rect[0], view->rect[3] - view->rect[1]);
    case PT_KERNEL_lines:
        return pt_gl_lines(d, arguments);
    case PT_KERNEL_ink:
        return run_ink(d, arguments);
    case PT_KERNEL_peel: // whole tiles, counted from the plane's corner
        pt_gl_tiles_forget(d);
        return run_over(d, kernel, 0, "", view->rect[2] - (view->rect[0] >> PT_TILE_LEVEL << PT_TILE_LEVEL),
                        view->rect[3] - (view->rect[1] >> PT_TILE_LEVEL << PT_TILE_LEVEL));
    case PT_KERNEL_pull:
        pt_gl_tiles_forget(d);
        return run_rows(d, kernel, view->rect[2] - view->rect[0], view->rect[3] - view->rect[1]);
    default:
        pt_gl_tiles_forget(d); // cover writes keys
        return run_over(d, kernel, 0, "", view->rect[2] - view->rect[0], view->rect[3] - view->rect[1]);
    }
}

void pt_gl_arguments(struct pt_gl_device *d, const void *arguments, size_t size)
{
    d->gl.BindBuffer(GL_COPY_WRITE_BUFFER, d->arguments);
    d->gl.BufferData(GL_COPY_WRITE_BUFFER, (GLsizeiptr)((size + 15) & ~(size_t)15), NULL, GL_STREAM_DRAW);
    d->gl.BufferSubData(GL_COPY_WRITE_BUFFER, 0, (GLsizeiptr)size, arguments);
    d->gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, d->arguments);
}

int pt_gl_run(struct pt_gl_device *d, enum pt_kernel kernel, const void *arguments, size_t argument_size,
              struct pt_buffer *const *buffers, uint32_t count, const atomic_int *cancel)
{
    const struct view_args *view = arguments;
    pt_gl_arguments(d, arguments, argument_size);
    if (kernel != PT_KERNEL_shade) // it writes nothing that normals are blended from
        d->shown = 0;
    if (kernel == PT_KERNEL_scatter) {
        pt_gl_tiles_forget(d);
        return pt_gl_scatter(d, arguments, buffers, count, cancel);
    }
    if (kernel == PT_KERNEL_raster)
        return pt_gl_raster(d, arguments, argument_size, buffers, count, cancel);
    if (kernel == PT_KERNEL_splat) {
        pt_gl_tiles_forget(d);
        return pt_gl_splat(d, arguments, buffers, cancel);
    }
    if (kernel == PT_KERNEL_blend)
        return pt_gl_blend(d, arguments, buffers, cancel);
    if (kernel == PT_KERNEL_average)
        return pt_gl_average(d, arguments, buffers, cancel);
    if (kernel == PT_KERNEL_lit)
        return pt_gl_lit(d, argument_size, buffers, count, cancel);
    if (kernel == PT_KERNEL_center)
        return pt_gl_center(d, argument_size, buffers, count, cancel);
    if (kernel == PT_KERNEL_sift)
        return pt_gl_sift(d, argument_size, buffers, count, cancel);
    int crops = pt_gl_of_crop(kernel) || kernel == PT_KERNEL_focus || kernel == PT_KERNEL_extract || kernel == PT_KERNEL_ink;
    if (!crops && (view->rect[2] <= view->rect[0] || view->rect[3] <= view->rect[1]))
        return PATINA_OK;
    if (kernel == PT_KERNEL_fill)
        return pt_gl_fill(d, arguments, buffers, count, cancel);
    struct view_args tiles = kernel == PT_KERNEL_push ? pt_gl_coarse_view(arguments) : *view;
    int result = tiled(kernel) ? pt_gl_tiles(d, buffers[0], &tiles) : PATINA_OK;
    if (result == PATINA_OK)
        result = pt_gl_bind_buffers(d, kernel, argument_size, buffers, count);
    if (result == PATINA_OK && pt_gl_is_pointwise(kernel))
        result = pt_gl_pointwise_planes(d, kernel, buffers);
    return result == PATINA_OK ? run_filter(d, kernel, arguments, buffers) : result;
}
