// SPDX-License-Identifier: GPL-3.0-or-later
// patina_drawing_outline: lines of a plane of distances, tidied.
#include "drawing.h"
#include "contour.h"
#include "outline.h"
#include "base/descriptor.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LEAST_ON_PAPER 1e-3 // a shorter line is left out; meters
#define LEAST_SPACINGS 12.0 // as is one of fewer spacings: a stray point has an outline of about nine
#define STEP_SPACINGS 3.0   // smaller steps may be noise
#define SUPPORT 0.75        // spacings that a surface reaches beyond its points: half of them are as near to its true border

enum { MOST_DEEP = 16 }; // pixels that are taken from a surface

// Keeps vertices where the distance bends, so that straight stretches between them are within the tolerance of the line's distances (Williams
// 1978). One distance does where all are that alike.
static void keep_depths(struct pt_line *line, double tolerance)
{
    double low = INFINITY, high = -INFINITY, sum = 0.0, along = 0.0, least = -INFINITY, most = INFINITY;
    for (uint32_t i = 0; i < line->count; i++) {
        low = fmin(low, line->depth[i]);
        high = fmax(high, line->depth[i]);
        sum += line->depth[i];
    }
    if (high - low <= 2.0 * tolerance) {
        for (uint32_t i = 0; i < line->count; i++)
            line->depth[i] = sum / line->count;
        return;
    }
    for (uint32_t i = 1, from = 0; i < line->count; i++) {
        along += pt_distance(line->at[i], line->at[i - 1]);
        double rise = line->depth[i] - line->depth[from];
        if (rise < least * along || rise > most * along) { // out of the cone through all since the last one that was kept
            from = i - 1;
            line->fixed[from] = 1;
            along = pt_distance(line->at[i], line->at[from]);
            rise = line->depth[i] - line->depth[from];
            least = -INFINITY;
            most = INFINITY;
        }
        if (along > 0.0) {
            least = fmax(least, (rise - tolerance) / along);
            most = fmin(most, (rise + tolerance) / along);
        }
    }
    if (line->closed)
        line->fixed[0] = line->fixed[line->count - 1] = 1;
}

static int tidy(const patina_drawing *drawing, const patina_outline_desc *desc, struct pt_lines *lines)
{
    const double tolerance = fmax(PT_DRAW_TOLERANCE * drawing->scale, 0.5 * desc->pixel);
    int error = PATINA_OK;
    for (uint32_t i = 0; i < lines->count && !error; i++) {
        keep_depths(&lines->at[i], desc->spacing);
        error = pt_line_simplify(&lines->at[i], tolerance);
    }
    return error ? error : pt_lines_clip(lines, drawing->plane.half);
}

static int outline(patina_drawing *drawing, const patina_outline_desc *desc)
{
    const size_t pixels = (size_t)desc->width * desc->height;
    const double step = STEP_SPACINGS * desc->spacing, deep = ceil(desc->spacing / desc->pixel);
    struct pt_depth_plane plane = {desc->width, desc->height, desc->pixel, malloc(pixels * sizeof *plane.depth),
                                   desc->measured};
    struct pt_lines lines = {0};
    int error = plane.depth ? PATINA_OK : PATINA_ERROR_MEMORY;
    if (!error) {
        memcpy(plane.depth, desc->depth, pixels * sizeof *plane.depth);
        error = pt_depth_sharpen(&plane, step);
    }
    if (!error)
        error = pt_depth_shrink(&plane, step, fmax(SUPPORT * desc->spacing, desc->pixel), (uint32_t)fmin(deep, MOST_DEEP));
    if (!error)
        error = pt_depth_outlines(&plane, step, fmax(LEAST_ON_PAPER * drawing->scale, LEAST_SPACINGS * desc->spacing),
                                  PATINA_DRAWING_OUTLINE, &lines);
    if (!error)
        error = tidy(drawing, desc, &lines);
    if (!error)
        error = pt_draw_replace(drawing, PATINA_DRAWING_OUTLINE, PATINA_DRAWING_OUTLINE, &lines);
    free(plane.depth);
    pt_lines_free(&lines);
    return error;
}

int patina_drawing_outline(patina_drawing *drawing, const patina_outline_desc *given)
{
    patina_outline_desc desc;
    if (!drawing || !given)
        return pt_fail(drawing ? &drawing->handle : NULL, PATINA_ERROR_ARGUMENT,
                       "patina_drawing_outline: drawing or desc is NULL");
    int error = pt_take(&drawing->handle, "patina_drawing_outline", given, &desc, sizeof desc);
    if (error)
        return error;
    if (!desc.depth || !desc.width || !desc.height || desc.width > PATINA_OUTLINE_SIZE || desc.height > PATINA_OUTLINE_SIZE)
        return pt_fail(&drawing->handle, PATINA_ERROR_ARGUMENT,
                       "patina_drawing_outline: depth must not be NULL, and width and height be 1 to %d", PATINA_OUTLINE_SIZE);
    if (!isfinite(desc.pixel) || !(desc.pixel > 0.0) || !isfinite(desc.spacing) || !(desc.spacing > 0.0))
        return pt_fail(&drawing->handle, PATINA_ERROR_ARGUMENT, "patina_drawing_outline: pixel and spacing must be above 0");
    error = outline(drawing, &desc);
    return error ? pt_fail(&drawing->handle, error, "patina_drawing_outline: %s", patina_error_text(error)) : PATINA_OK;
}
