// SPDX-License-Identifier: GPL-3.0-or-later
// The calls of patina/drawings.h, but for writing.
#include "drawing.h"
#include "base/compare.h"
#include "contour.h"
#include "join.h"
#include "samples.h"
#include "trace.h"
#include "base/descriptor.h"
#include "base/progress.h"
#include "scene/clouds/paged.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LEAST_ON_PAPER 0.5e-3 // a line that is joined to none and shorter on paper is no line

const struct pt_draw_layer pt_draw_layers[PATINA_DRAWING_LAYERS] = {
    {"cut", 35, 7, 0},           {"cut-bridged", 35, 7, 1}, {"outline", 25, 7, 0}, {"crease", 9, 8, 0}, {"contour", 13, 8, 0},
    {"contour-index", 25, 7, 0}, {"profile", 25, 5, 0},     {"frame", 70, 7, 0},   {"text", 13, 7, 0},
};

static int is_length(double value) { return isfinite(value) && value >= 0.0 && value < 1e15; }

int patina_drawing_create(const patina_drawing_desc *given, patina_drawing **out)
{
    patina_drawing_desc desc;
    if (!given || !out)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_drawing_create: desc or out is NULL");
    *out = NULL;
    const int error = pt_take(NULL, "patina_drawing_create", given, &desc, sizeof desc);
    if (error)
        return error;
    struct pt_draw_plane plane = {.half = {0.5 * desc.extent[0], 0.5 * desc.extent[1]}, .front = desc.front, .back = desc.back};
    if (pt_draw_plane_frame(&plane, desc.origin, desc.right, desc.up))
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT,
                       "patina_drawing_create: origin, right and up must be finite, and right and up not zero or parallel");
    if (!is_length(desc.extent[0]) || !is_length(desc.extent[1]) || !(desc.extent[0] > 0.0) || !(desc.extent[1] > 0.0))
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_drawing_create: extent: width and height must be above 0");
    if (!is_length(desc.front) || !is_length(desc.back))
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_drawing_create: front and back must be at least 0");
    if (!isfinite(desc.scale) || desc.scale < 0.0 || (desc.scale > 0.0 && (desc.scale < 1e-6 || desc.scale > 1e9)))
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_drawing_create: scale: N of 1:N, from 1e-6 to 1e9");
    struct patina_drawing *drawing = calloc(1, sizeof *drawing);
    if (!drawing)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "patina_drawing_create: out of memory");
    pt_handle_init(&drawing->handle);
    drawing->plane = plane;
    drawing->scale = desc.scale > 0.0 ? desc.scale : 50.0;
    drawing->epsg = desc.epsg;
    *out = drawing;
    return PATINA_OK;
}

void patina_drawing_destroy(patina_drawing *drawing)
{
    if (!drawing)
        return;
    pt_lines_free(&drawing->lines);
    pt_handle_destroy(&drawing->handle);
    free(drawing);
}

// ---- cutting -----------------------------------------------------------------------------------------------------------------

static int gather(const patina_drawing *drawing, const patina_cloud *const *clouds, uint32_t count, const patina_cut_desc *desc,
                  patina_progress *progress, struct pt_cut_samples *samples)
{
    int error = PATINA_OK;
    for (uint32_t i = 0; i < count && !error; i++) {
        const struct pt_cut_source source = {.cloud = clouds[i],
                                             .place = desc->places ? desc->places + (size_t)16 * i : NULL,
                                             .shown = desc->shown ? desc->shown[i] : NULL};
        error = pt_whole_enter(clouds[i], "patina_drawing_cut");
        if (error)
            return pt_fail_again(&drawing->handle, error);
        if (clouds[i]->info.drawn)
            error = pt_cut_gather(&drawing->plane, desc->thickness, &source, progress, samples);
        pt_paged_leave(clouds[i]);
        if (error == PATINA_ERROR_ARGUMENT)
            return pt_fail(&drawing->handle, error,
                           "patina_drawing_cut: the place of cloud %u must be finite, and scale all axes alike", i);
    }
    return error;
}

// Leaves out lines that nobody would see on paper, and simplifies the rest.
static int tidy(const patina_drawing *drawing, struct pt_lines *lines)
{
    const double least = LEAST_ON_PAPER * drawing->scale, tolerance = PT_DRAW_TOLERANCE * drawing->scale;
    uint32_t kept = 0;
    int error = PATINA_OK;
    for (uint32_t i = 0; i < lines->count; i++) {
        struct pt_line line = lines->at[i];
        lines->at[i] = (struct pt_line){0};
        if (line.layer == PATINA_DRAWING_CUT && !line.closed && pt_line_length(&line) < least) {
            pt_line_free(&line);
            continue;
        }
        if (!error)
            error = pt_line_simplify(&line, tolerance);
        lines->at[kept++] = line;
    }
    lines->count = kept;
    return error ? error : pt_lines_clip(lines, drawing->plane.half);
}

static int summarize(const struct pt_cut_samples *samples, patina_drawing_info *info)
{
    float *sorted = malloc((samples->count + 1) * sizeof *sorted);
    if (!sorted)
        return PATINA_ERROR_MEMORY;
    double *const medians[2] = {&info->spacing, &info->sigma};
    for (int k = 0; k < 2; k++) {
        for (uint32_t i = 0; i < samples->count; i++)
            sorted[i] = k ? samples->at[i].sigma : samples->at[i].spacing;
        qsort(sorted, samples->count, sizeof *sorted, pt_compare_floats);
        *medians[k] = samples->count ? (double)sorted[samples->count / 2] : 0.0;
    }
    free(sorted);
    info->samples = samples->count;
    info->untrusted = samples->untrusted;
    info->thickness = samples->thickness;
    return PATINA_OK;
}

int pt_draw_replace(patina_drawing *drawing, uint32_t first, uint32_t last, struct pt_lines *by)
{
    struct pt_lines *lines = &drawing->lines;
    uint32_t kept = 0;
    for (uint32_t i = 0; i < lines->count; i++)
        if (lines->at[i].layer >= first && lines->at[i].layer <= last)
            pt_line_free(&lines->at[i]);
        else
            lines->at[kept++] = lines->at[i];
    lines->count = kept;
    int error = PATINA_OK;
    for (uint32_t i = 0; i < by->count && !error; i++)
        error = pt_lines_add(lines, &by->at[i]);
    return error;
}

int pt_draw_check_clouds(const patina_drawing *drawing, const char *call, const patina_cloud *const *clouds, uint32_t count)
{
    if (!drawing || (count && !clouds))
        return pt_fail(drawing ? &drawing->handle : NULL, PATINA_ERROR_ARGUMENT, "%s: drawing or clouds is NULL", call);
    for (uint32_t i = 0; i < count; i++)
        if (!clouds[i])
            return pt_fail(&drawing->handle, PATINA_ERROR_ARGUMENT, "%s: cloud %u is NULL", call, i);
        else if (!clouds[i]->shapes && clouds[i]->info.drawn)
            return pt_fail(&drawing->handle, PATINA_ERROR_EMPTY,
                           "%s: cloud %u is not analyzed: call patina_cloud_analyse first", call, i);
    return PATINA_OK;
}

int patina_drawing_cut(patina_drawing *drawing, const patina_cloud *const *clouds, uint32_t count, const patina_cut_desc *given,
                       patina_progress *progress)
{
    patina_cut_desc desc;
    struct pt_cut_samples samples = {0};
    struct pt_lines lines = {0};
    patina_drawing_info info = {0};
    int error = pt_draw_check_clouds(drawing, "patina_drawing_cut", clouds, count);
    if (error)
        return error;
    error = pt_take(&drawing->handle, "patina_drawing_cut", given, &desc, sizeof desc);
    if (error)
        return error;
    if (!is_length(desc.thickness))
        return pt_fail(&drawing->handle, PATINA_ERROR_ARGUMENT, "patina_drawing_cut: thickness must be at least 0");
    error = gather(drawing, clouds, count, &desc, progress, &samples);
    if (!error && !samples.count)
        error = pt_fail(&drawing->handle, PATINA_ERROR_EMPTY,
                        "the plane meets no surface of the clouds within its extent: move it, or make the extent larger");
    else if (!error)
        error = pt_trace_lines(&samples, desc.threads, progress, &lines);
    if (!error)
        error = pt_join_lines(&samples, &lines, PATINA_DRAWING_CUT_BRIDGED);
    if (!error)
        error = tidy(drawing, &lines);
    if (!error)
        error = summarize(&samples, &info);
    if (!error)
        error = pt_draw_replace(drawing, PATINA_DRAWING_CUT, PATINA_DRAWING_CUT_BRIDGED, &lines);
    if (!error)
        drawing->info = info;
    pt_cut_free(&samples);
    pt_lines_free(&lines);
    if (error == PATINA_ERROR_MEMORY || error == PATINA_ERROR_CANCELLED || error == PATINA_ERROR_TOO_MANY_POINTS)
        return pt_fail(&drawing->handle, error, "patina_drawing_cut: %s", patina_error_text(error));
    if (!error)
        pt_progress_set(progress, 1.0);
    return error;
}

// ---- reading -----------------------------------------------------------------------------------------------------------------

int patina_drawing_get_info(const patina_drawing *drawing, patina_drawing_info *info)
{
    if (!drawing)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_drawing_get_info: drawing is NULL");
    patina_drawing_info all = drawing->info;
    all.struct_size = sizeof all;
    all.lines = drawing->lines.count;
    for (uint32_t i = 0; i < drawing->lines.count; i++) {
        const struct pt_line *line = &drawing->lines.at[i];
        all.layer_lines[line->layer]++;
        all.layer_lengths[line->layer] += pt_line_length(line);
    }
    return pt_give(&drawing->handle, "patina_drawing_get_info", &all, sizeof all, info);
}

static const struct pt_line *line_at(const patina_drawing *drawing, uint32_t index, const char *call, int *error)
{
    *error = PATINA_OK;
    if (drawing && index < drawing->lines.count)
        return &drawing->lines.at[index];
    *error = drawing ? pt_fail(&drawing->handle, PATINA_ERROR_ARGUMENT, "%s: there is no line %u: the drawing has %u", call,
                               index, drawing->lines.count)
                     : pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s: drawing is NULL", call);
    return NULL;
}

int patina_drawing_get_line(const patina_drawing *drawing, uint32_t index, patina_drawing_line *out)
{
    int error;
    const struct pt_line *line = line_at(drawing, index, "patina_drawing_get_line", &error);
    if (!line)
        return error;
    const patina_drawing_line told = {
        .struct_size = sizeof told, .layer = line->layer, .closed = line->closed != 0, .vertices = line->count};
    return pt_give(&drawing->handle, "patina_drawing_get_line", &told, sizeof told, out);
}

static int read_line(const patina_drawing *drawing, uint32_t index, const char *call, int depths, double *to, size_t size)
{
    int error;
    const struct pt_line *line = line_at(drawing, index, call, &error);
    if (!line)
        return error;
    const size_t all = line->count * (depths ? sizeof *line->depth : sizeof *line->at);
    if (!to || size != all)
        return pt_fail(&drawing->handle, PATINA_ERROR_ARGUMENT, "%s: line %u takes %zu bytes, not %zu", call, index, all,
                       to ? size : 0);
    memcpy(to, depths ? line->depth : line->at[0], size);
    return PATINA_OK;
}

int patina_drawing_read_line(const patina_drawing *drawing, uint32_t index, double *places, size_t size)
{
    return read_line(drawing, index, "patina_drawing_read_line", 0, places, size);
}

int patina_drawing_read_depths(const patina_drawing *drawing, uint32_t index, double *depths, size_t size)
{
    return read_line(drawing, index, "patina_drawing_read_depths", 1, depths, size);
}
