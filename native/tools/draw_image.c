// SPDX-License-Identifier: GPL-3.0-or-later
// The image of `patina draw`: what the drawing's viewer sees, rendered in strips, once for all files.
#include "draw.h"
#include "view.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PAPER_PIXEL (0.25e-3 / 3) // meters on paper: a third of a line of 0.25 mm
enum { STRIP_PIXELS = 4 << 20 };  // rendered at a time, some 600 MB

struct rendering {
    patina_device *device;
    patina_scene *scene;
    patina_scene *measured; // without a style that has depths of its own; NULL: scene
    patina_frame *frame;
    patina_settings settings;
    float *color, *depth, *source; // of a strip
};

static void destroy(struct rendering *r)
{
    tool_cancellable(NULL, NULL);
    patina_frame_destroy(r->frame);
    patina_scene_destroy(r->scene);
    patina_scene_destroy(r->measured);
    patina_device_destroy(r->device);
    free(r->color);
    free(r->depth);
    free(r->source);
}

// An orthographic view of the extent, whose near clip is the front of the drawing.
static void set_camera(const struct draw_image *image, patina_camera *camera)
{
    const patina_drawing_desc *desc = image->desc;
    double axes[3][3] = {{0}};
    draw_axes(desc, axes);
    *camera = (patina_camera){.struct_size = sizeof *camera, .orthographic = 1};
    for (int k = 0; k < 3; k++) {
        double *row = camera->world_from_camera + 4 * k;
        for (int i = 0; i < 3; i++)
            row[i] = axes[i][k];
        row[3] = desc->origin[k] + desc->front * axes[2][k];
    }
    camera->world_from_camera[15] = 1;
    camera->right = 0.5 * image->pixel * image->width;
    camera->left = -camera->right;
    camera->top = 0.5 * image->pixel * image->height;
    camera->bottom = -camera->top;
    camera->near_clip = 0;
    camera->far_clip = fmax(desc->front + desc->back, 1e-6);
}

// The clouds in a style, seen by the drawing's camera. NULL: as scanned.
static int make_scene(const struct draw_image *image, const struct draw_style *style, patina_scene **scene)
{
    const struct tool_options plain = {0};
    patina_camera camera;
    double axes[3][3] = {{0}};
    set_camera(image, &camera);
    draw_axes(image->desc, axes);
    int code = patina_scene_create(scene);
    for (int i = 0; i < image->options->file_count && !code; i++)
        code = draw_style_cloud(style, image->clouds[i], *scene);
    if (!code)
        code = draw_style_effects(style, *scene);
    if (!code)
        code = draw_style_lines(style, *scene);
    if (!code)
        code = patina_scene_set_camera(*scene, &camera);
    if (!code)
        code = style ? draw_style_lights(style, axes[0], *scene) : tool_lights(*scene, &plain, &camera);
    return code;
}

static int begin(const struct draw_image *image, struct rendering *r)
{
    const struct draw_options *options = image->options;
    const patina_device_desc device = {.struct_size = sizeof device, .name = options->device, .threads = options->threads};
    r->settings = (patina_settings){.struct_size = sizeof r->settings,
                                    .width = image->width,
                                    .height = image->height,
                                    .depth = PATINA_DEPTH_SURFACE,
                                    .passes = 1u << PATINA_PASS_COMBINED | 1u << PATINA_PASS_DEPTH | 1u << PATINA_PASS_SOURCE};
    draw_style_settings(options->style, &r->settings);
    int code = patina_device_create(&device, &r->device);
    if (!code)
        code = make_scene(image, options->style, &r->scene);
    if (!code && draw_style_moves_surface(options->style))
        code = make_scene(image, NULL, &r->measured);
    if (!code)
        code = patina_frame_create(r->device, &r->frame);
    tool_cancellable(NULL, r->frame);
    return code ? tool_failed("draw", r->scene, code) : TOOL_OK;
}

static int render_scene(struct rendering *r, patina_scene *scene)
{
    const int code = patina_scene_set_settings(scene, &r->settings);
    return code ? code : patina_frame_render(r->frame, scene);
}

// Rows [begin, end) from the bottom.
static int render(struct draw_image *image, struct rendering *r, uint32_t begin, uint32_t end)
{
    const size_t count = (size_t)image->width * (end - begin);
    memcpy(r->settings.region, (uint32_t[]){0, begin, image->width, end}, sizeof r->settings.region);
    int code = render_scene(r, r->scene);
    if (!code)
        code = patina_frame_read(r->frame, PATINA_PASS_COMBINED, r->color, 4 * count * sizeof *r->color);
    if (!code && r->measured)
        code = render_scene(r, r->measured);
    if (!code)
        code = patina_frame_read(r->frame, PATINA_PASS_DEPTH, r->depth, count * sizeof *r->depth);
    if (!code)
        code = patina_frame_read(r->frame, PATINA_PASS_SOURCE, r->source, count * sizeof *r->source);
    if (code)
        return tool_failed("draw", r->frame, code);
    const double front = image->desc->front, back = image->desc->back;
    for (size_t i = 0; i < count; i++) { // surfaces seen edge-on may be extended beyond what is drawn
        const float source = fabsf(r->source[i]);
        r->depth[i] = isfinite(r->depth[i]) ? (float)fmin(fmax(front - (double)r->depth[i], -back), front) : NAN;
        image->measured += source > 0.0f && source <= 1.0f;
        image->filled += source > 1.0f;
    }
    return TOOL_OK;
}

static int size_image(struct draw_image *image)
{
    const struct draw_options *options = image->options;
    image->pixel = options->pixel > 0 ? options->pixel : PAPER_PIXEL * options->scale;
    const double width = ceil(image->desc->extent[0] / image->pixel - 1e-9),
                 height = ceil(image->desc->extent[1] / image->pixel - 1e-9);
    if (!(width <= TOOL_MOST_SIZE) || !(height <= TOOL_MOST_SIZE)) {
        tool_say("%s: the image would have %.0f x %.0f pixels, and at most %d are possible: make --extent smaller, or --pixel "
                 "larger",
                 image->path, width, height, TOOL_MOST_SIZE);
        return TOOL_FAILED;
    }
    image->width = width < 1 ? 1 : (uint32_t)width;
    image->height = height < 1 ? 1 : (uint32_t)height;
    return TOOL_OK;
}

int draw_render(struct draw_image *image, void *to,
                int (*take)(void *to, const float *color, const float *depth, const float *source, uint32_t rows))
{
    struct rendering r = {0};
    const uint32_t fitting = STRIP_PIXELS / image->width, rows = fitting < 16 ? 16 : fitting;
    const uint32_t strip = rows < image->height ? rows : image->height;
    const size_t count = (size_t)image->width * strip;
    r.color = malloc(4 * count * sizeof *r.color);
    r.depth = malloc(count * sizeof *r.depth);
    r.source = malloc(count * sizeof *r.source);
    int result = r.color && r.depth && r.source ? TOOL_OK : tool_failed("draw", NULL, PATINA_ERROR_MEMORY);
    image->measured = image->filled = 0;
    if (!result)
        result = begin(image, &r);
    for (uint32_t end = image->height; end && !result;) {
        const uint32_t begin = end > strip ? end - strip : 0;
        result = render(image, &r, begin, end);
        if (!result)
            result = take(to, r.color, r.depth, r.source, end - begin);
        end = begin;
    }
    destroy(&r);
    return result;
}

// ---- files ---------------------------------------------------------------------------------------------------------

// What is written of an image while it is rendered.
struct files {
    struct tool_png *png;
    struct tool_tiff *color, *depth, *mask; // NULL: not wanted
};

struct sinks {
    uint32_t width;
    int deep, count;
    struct files files[DRAW_OUTPUTS];
    struct tool_picture *picture; // NULL: not wanted
    struct draw_depths *depths;   // the same
    void *row;                    // of a TIFF
};

static int take_tiff(struct sinks *sinks, struct files *files, const float *color, const float *depth, const float *source,
                     uint32_t rows)
{
    const size_t width = sinks->width;
    int bad = 0;
    for (size_t y = rows; y-- > 0 && !bad;) {
        uint8_t *bytes = sinks->row;
        if (sinks->deep)
            tool_encode_row16(sinks->row, color + 4 * y * width, sinks->width);
        else
            tool_encode_row(bytes, color + 4 * y * width, sinks->width, 1);
        bad = tool_tiff_row(files->color, bytes) || (files->depth && tool_tiff_row(files->depth, depth + y * width));
        for (size_t x = 0; files->mask && x < width; x++) {
            const float s = fabsf(source[y * width + x]);
            bytes[x] = s > 1.0f ? 2 : s > 0.0f ? 1 : 0;
        }
        bad = bad || (files->mask && tool_tiff_row(files->mask, bytes));
    }
    return bad;
}

static int take(void *to, const float *color, const float *depth, const float *source, uint32_t rows)
{
    struct sinks *sinks = to;
    int bad = sinks->picture && tool_picture_rows(sinks->picture, color, rows);
    for (int i = 0; i < sinks->count && !bad; i++)
        bad = sinks->files[i].png ? tool_png_rows(sinks->files[i].png, color, rows)
                                  : take_tiff(sinks, &sinks->files[i], color, depth, source, rows);
    if (sinks->depths)
        draw_take_depths(sinks->depths, depth, source, rows);
    return bad ? TOOL_FAILED : TOOL_OK;
}

static struct tool_tiff *open_beside(const struct draw_image *image, const char *ending, enum tool_tiff_kind kind,
                                     const struct tool_raster *raster)
{
    char *path = draw_path_with(image->path, ending);
    struct tool_tiff *tiff = path ? tool_tiff_open(path, image->width, image->height, kind, raster) : NULL;
    free(path);
    return tiff;
}

static int open_files(const struct draw_image *image, const struct tool_raster *raster, struct files *files)
{
    const struct draw_options *options = image->options;
    if (!draw_is_tiff(image->path)) {
        files->png = tool_png_open(image->path, image->width, image->height, 1, NULL, NULL);
        return files->png ? TOOL_OK : TOOL_FAILED;
    }
    files->color = tool_tiff_open(image->path, image->width, image->height, options->deep ? TIFF_RGBA16 : TIFF_RGBA, raster);
    if (files->color && options->depth_map)
        files->depth = open_beside(image, "-depth.tif", TIFF_FLOAT, raster);
    if (files->color && options->mask)
        files->mask = open_beside(image, "-mask.tif", TIFF_BYTE, raster);
    const int bad = !files->color || (options->depth_map && !files->depth) || (options->mask && !files->mask);
    return bad ? TOOL_FAILED : TOOL_OK;
}

static int close_files(struct files *files, int result)
{
    struct tool_tiff *const tiffs[] = {files->depth, files->mask, files->color};
    for (int i = 0; i < 3; i++)
        if (tiffs[i] && tool_tiff_close(tiffs[i], !result) && !result)
            result = TOOL_FAILED;
    if (files->png && tool_png_close(files->png, !result) && !result)
        result = TOOL_FAILED;
    return result;
}

double draw_filled(const struct draw_image *image)
{
    const uint64_t shown = image->measured + image->filled;
    return shown ? 100.0 * (double)image->filled / (double)shown : 0.0;
}

int draw_write_images(struct draw_image *image, const char *const *paths, int count, struct tool_picture *picture,
                      struct draw_depths *depths)
{
    struct sinks sinks = {.deep = image->options->deep};
    struct tool_raster raster;
    int result = size_image(image);
    if (result)
        return result;
    draw_raster(image, &raster);
    sinks.width = image->width;
    sinks.row = malloc(8 * (size_t)image->width);
    if (!sinks.row)
        result = tool_failed("draw", NULL, PATINA_ERROR_MEMORY);
    if (!result && picture) {
        sinks.picture = picture;
        result = tool_picture_begin(picture, image->width, image->height) ? TOOL_FAILED : TOOL_OK;
    }
    if (!result && depths) {
        sinks.depths = depths;
        result = draw_begin_depths(image, depths);
    }
    for (; sinks.count < count && !result; sinks.count++) {
        image->path = paths[sinks.count];
        result = open_files(image, &raster, &sinks.files[sinks.count]);
    }
    if (!result)
        result = draw_render(image, &sinks, take);
    if (!result && picture)
        result = tool_picture_end(picture) ? TOOL_FAILED : TOOL_OK;
    for (int i = 0; i < sinks.count; i++) {
        image->path = paths[i];
        result = close_files(&sinks.files[i], result);
        if (!result && draw_is_tiff(image->path))
            result = draw_write_beside(image, &raster);
        if (!result)
            tool_say("%s: 1:%g, %ux%u pixels of %.4g mm, %.1f %% of the surface filled", image->path, image->options->scale,
                     image->width, image->height, 1e3 * image->pixel, draw_filled(image));
    }
    free(sinks.row);
    return result;
}
