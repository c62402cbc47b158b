// SPDX-License-Identifier: GPL-3.0-or-later
// patina draw FILE... --plane PLANE -o OUT.dxf: a survey drawing of clouds, to scale.
#include "draw.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// ---- clouds ------------------------------------------------------------------------------------------------------

static int load(const struct draw_options *options, int i, struct draw_clouds *clouds)
{
    const char *path = options->files[i];
    const struct tool_color color = {0};
    struct tool_stations stations = {0};
    patina_cloud_info info = {.struct_size = sizeof info};
    patina_analysis_desc desc = {.struct_size = sizeof desc, .threads = options->threads, .keep_normals = 1};
    double low[3], high[3];
    int code = tool_load_cloud(path, &color, "", clouds->progress, &clouds->list[i], NULL, &stations, NULL);
    tool_describe_stations(&stations, &desc);
    if (!code)
        code = patina_cloud_get_info(clouds->list[i], &info);
    if (!code && info.count && !info.has_shapes)
        code = patina_cloud_analyse(clouds->list[i], &desc, clouds->progress);
    tool_free_stations(&stations);
    if (!code)
        code = patina_cloud_dense_box(clouds->list[i], low, high);
    if (code)
        return tool_failed(path, NULL, code);
    clouds->spacing = fmax(clouds->spacing, info.spacing);
    if (!info.drawn)
        tool_say("warning: %s holds no points", path);
    for (int k = 0; k < 3 && info.drawn; k++) {
        clouds->box_min[k] = fmin(clouds->box_min[k], low[k]);
        clouds->box_max[k] = fmax(clouds->box_max[k], high[k]);
    }
    return TOOL_OK;
}

static int load_all(const struct draw_options *options, struct draw_clouds *clouds)
{
    int result = TOOL_OK;
    for (int k = 0; k < 3; k++) {
        clouds->box_min[k] = INFINITY;
        clouds->box_max[k] = -INFINITY;
    }
    const int code = patina_progress_create(&clouds->progress);
    if (code)
        return tool_failed("draw", NULL, code);
    tool_cancellable(clouds->progress, NULL);
    for (int i = 0; i < options->file_count && !result; i++)
        result = load(options, i, clouds);
    if (!result && !(clouds->box_min[0] <= clouds->box_max[0])) {
        tool_say("draw: there are no points to draw");
        result = TOOL_FAILED;
    }
    return result;
}

// ---- drawing -----------------------------------------------------------------------------------------------------

struct job {
    const struct draw_options *options;
    const struct draw_clouds *clouds;
    patina_drawing *drawing;
    double zero[3]; // of the plane's own coordinates
};

// needed: an output has nothing but lines.
static int cut(struct job *job, int needed)
{
    const patina_cut_desc desc = {
        .struct_size = sizeof desc, .thickness = job->options->thickness, .threads = job->options->threads};
    const int code = patina_drawing_cut(job->drawing, (const patina_cloud *const *)job->clouds->list,
                                        (uint32_t)job->options->file_count, &desc, job->clouds->progress);
    if (code == PATINA_ERROR_EMPTY && (job->options->contours > 0 || job->options->outlines || !needed))
        return TOOL_OK; // a plane over the ground, or before a facade
    return code ? tool_failed("draw", job->drawing, code) : TOOL_OK;
}

static int contour(struct job *job)
{
    const patina_contour_desc wanted = {
        .struct_size = sizeof wanted, .interval = job->options->contours, .threads = job->options->threads};
    const int code = patina_drawing_contour(job->drawing, (const patina_cloud *const *)job->clouds->list,
                                            (uint32_t)job->options->file_count, &wanted, job->clouds->progress);
    return code ? tool_failed("draw", job->drawing, code) : TOOL_OK;
}

static void tell(const struct job *job, const char *path)
{
    patina_drawing_info info = {.struct_size = sizeof info};
    char left_out[64] = "";
    if (patina_drawing_get_info(job->drawing, &info))
        return;
    if (info.untrusted)
        snprintf(left_out, sizeof left_out, " (%llu left out for their trust)", (unsigned long long)info.untrusted);
    const double *lengths = info.layer_lengths,
                 contours = lengths[PATINA_DRAWING_CONTOUR] + lengths[PATINA_DRAWING_CONTOUR_INDEX];
    if (job->options->contours > 0)
        tool_say("%s: 1:%g, contours of %.4g m at an interval of %g m", path, job->options->scale, contours,
                 job->options->contours);
    if (job->options->outlines)
        tool_say("%s: 1:%g, outlines of %.4g m", path, job->options->scale, lengths[PATINA_DRAWING_OUTLINE]);
    if (!info.samples)
        return;
    tool_say(
        "%s: 1:%g, cut lines of %.4g m, bridged %.4g m, from %llu points%s; points every %.2g mm, noise %.2g mm; the scale "
        "allows an error of %.2g mm",
        path, job->options->scale, info.layer_lengths[PATINA_DRAWING_CUT], info.layer_lengths[PATINA_DRAWING_CUT_BRIDGED],
        (unsigned long long)info.samples, left_out, 1e3 * info.spacing, 1e3 * info.sigma, 0.18 * job->options->scale);
}

static void tell_page(const struct draw_content *content, const struct page *page, const char *path)
{
    const struct draw_image *image = content->image;
    const char *sheet = content->layout->sheet;
    tool_say("%s: %s%s%.4g x %.4g mm, 1:%g, an image of %ux%u pixels of %.4g mm, %.1f %% of the surface filled", path,
             sheet ? sheet : "", sheet ? ", " : "", page->size[0], page->size[1], page->scale, image->width, image->height,
             1e3 * image->pixel, draw_filled(image));
}

// ---- all outputs -------------------------------------------------------------------------------------------------

struct outputs {
    const char *images[DRAW_OUTPUTS], *pages[DRAW_OUTPUTS], *lines[DRAW_OUTPUTS];
    int image_count, page_count, line_count;
};

static void sort_outputs(const struct draw_options *options, struct outputs *sorted)
{
    for (int i = 0; i < options->output_count; i++) {
        const char *path = options->outputs[i];
        if (draw_is_image(path))
            sorted->images[sorted->image_count++] = path;
        else if (draw_is_page(options, path))
            sorted->pages[sorted->page_count++] = path;
        else
            sorted->lines[sorted->line_count++] = path;
    }
}

static int write_lines(const struct job *job, const struct outputs *outputs)
{
    for (int i = 0; i < outputs->line_count; i++) {
        const int bad = patina_drawing_write(job->drawing, outputs->lines[i], job->options->flat ? 1 : 0);
        if (bad)
            return tool_failed(outputs->lines[i], job->drawing, bad);
        tell(job, outputs->lines[i]);
    }
    return TOOL_OK;
}

static int write_pages(const struct job *job, const struct outputs *outputs, const struct draw_content *content)
{
    struct page page = {0};
    int result = draw_make_page(content, &page);
    for (int i = 0; i < outputs->page_count && !result; i++) {
        result = page_write(&page, outputs->pages[i]) ? TOOL_FAILED : TOOL_OK;
        if (!result) {
            tell_page(content, &page, outputs->pages[i]);
            tell(job, outputs->pages[i]);
        }
    }
    page_free(&page);
    return result;
}

static int run(struct job *job)
{
    const struct draw_options *options = job->options;
    const struct draw_clouds *clouds = job->clouds;
    patina_drawing_desc desc = {.struct_size = sizeof desc};
    struct draw_image image = {
        .options = options, .desc = &desc, .zero = job->zero, .clouds = clouds->list, .path = options->outputs[0]};
    struct outputs outputs = {0};
    struct draw_layout layout = {0};
    struct tool_picture picture = {0};
    struct draw_depths depths = {0};
    sort_outputs(options, &outputs);
    int result = draw_describe(options, clouds->box_min, clouds->box_max, &desc, job->zero);
    if (!result && outputs.page_count)
        result = draw_place(options, desc.extent, &layout);
    const int code = result ? 0 : patina_drawing_create(&desc, &job->drawing);
    if (code)
        return tool_failed("draw", NULL, code);
    const int outlines = options->outlines && outputs.line_count + outputs.page_count;
    if (!result && (outlines || outputs.image_count + outputs.page_count)) // images first: they need no surface in the plane
        result = draw_write_images(&image, outputs.images, outputs.image_count, outputs.page_count ? &picture : NULL,
                                   outlines ? &depths : NULL);
    if (!result && outputs.line_count + outputs.page_count)
        result = cut(job, outputs.line_count);
    if (!result && outputs.line_count + outputs.page_count && options->contours > 0)
        result = contour(job);
    if (!result && outlines)
        result = draw_outlines(&image, &depths, job->drawing);
    if (!result)
        result = write_lines(job, &outputs);
    if (!result && outputs.page_count) {
        const struct draw_content content = {
            .image = &image, .layout = &layout, .picture = &picture, .drawing = job->drawing, .spacing = clouds->spacing};
        result = write_pages(job, &outputs, &content);
    }
    tool_picture_free(&picture);
    draw_free_depths(&depths);
    return result;
}

int draw_one(const struct draw_options *options, const struct draw_clouds *clouds)
{
    struct job job = {.options = options, .clouds = clouds};
    tool_cancellable(clouds->progress, NULL);
    const int result = run(&job);
    tool_cancellable(NULL, NULL);
    tool_drain_log(1);
    patina_drawing_destroy(job.drawing);
    return result;
}

int tool_draw_lines(int count, char **arguments)
{
    struct draw_options options;
    struct draw_batch *batch = NULL;
    int result = draw_parse(count, arguments, &options);
    if (!result && options.batch)
        batch = draw_read_batch(&options, &result);
    struct draw_clouds *clouds = calloc(1, sizeof *clouds);
    if (!result)
        result = clouds ? load_all(&options, clouds) : tool_failed("draw", NULL, PATINA_ERROR_MEMORY);
    if (!result)
        result = batch ? draw_all(batch, clouds) : draw_one(&options, clouds);
    tool_cancellable(NULL, NULL);
    tool_drain_log(1);
    for (int i = 0; clouds && i < DRAW_FILES; i++)
        patina_cloud_destroy(clouds->list[i]);
    if (clouds)
        patina_progress_destroy(clouds->progress);
    free(clouds);
    draw_free_batch(batch);
    return result;
}
