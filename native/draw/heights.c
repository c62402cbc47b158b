// SPDX-License-Identifier: GPL-3.0-or-later
// Contours of ground, or of a facade, as lines of a drawing.
#include "contour.h"
#include "drawing.h"
#include "terrain.h"
#include "base/descriptor.h"
#include "base/progress.h"
#include "base/vector.h"
#include "scene/clouds/paged.h"

#include <math.h>

#define LEAST_ON_PAPER 1e-3 // shorter contours are noise, meters on paper
#define UPRIGHT 0.9999      // of the normal's z: heights are those of the world
enum { MOST_LEVELS = 20000 };

static int add_levels(const patina_drawing *drawing, const struct pt_terrain *terrain, double interval, uint32_t every,
                      struct pt_lines *lines)
{
    const struct pt_draw_plane *plane = &drawing->plane;
    const double base = fabs(plane->normal[2]) > UPRIGHT ? pt_dot(plane->normal, plane->origin) : 0.0;
    const double first = ceil((terrain->low + base) / interval), last = floor((terrain->high + base) / interval);
    int error = PATINA_OK;
    if (last - first > MOST_LEVELS)
        return pt_fail(&drawing->handle, PATINA_ERROR_ARGUMENT,
                       "patina_drawing_contour: the interval gives %.0f contours, and at most %d are possible: make it larger",
                       last - first, MOST_LEVELS);
    for (double k = first; k <= last && !error; k++) {
        const int index = fmod(k, every) == 0.0;
        const double level = k * interval - base; // before the plane
        const uint32_t before = lines->count;
        error = pt_contour_grid(&terrain->grid, level, index ? PATINA_DRAWING_CONTOUR_INDEX : PATINA_DRAWING_CONTOUR, lines);
        for (uint32_t i = before; i < lines->count; i++)
            for (uint32_t j = 0; j < lines->at[i].count; j++)
                lines->at[i].depth[j] = level;
    }
    return error;
}

static int tidy(const patina_drawing *drawing, struct pt_lines *lines)
{
    uint32_t kept = 0;
    int error = PATINA_OK;
    for (uint32_t i = 0; i < lines->count; i++) {
        struct pt_line line = lines->at[i];
        lines->at[i] = (struct pt_line){0};
        if (pt_line_length(&line) < LEAST_ON_PAPER * drawing->scale) {
            pt_line_free(&line);
            continue;
        }
        if (!error)
            error = pt_line_simplify(&line, PT_DRAW_TOLERANCE * drawing->scale);
        lines->at[kept++] = line;
    }
    lines->count = kept;
    return error ? error : pt_lines_clip(lines, drawing->plane.half);
}

// Around the work on all clouds: they are entered, and left again.
static int make_terrain(const patina_drawing *drawing, const patina_cloud *const *clouds, uint32_t count,
                        const patina_contour_desc *desc, patina_progress *progress, struct pt_terrain *terrain)
{
    uint32_t entered = 0;
    int error = PATINA_OK;
    while (entered < count && !error) {
        error = pt_whole_enter(clouds[entered], "patina_drawing_contour");
        entered += !error;
    }
    const int refused = error;
    if (!error)
        error = pt_terrain_create(&drawing->plane, drawing->scale, clouds, count, desc->cell, desc->threads, progress, terrain);
    while (entered)
        pt_paged_leave(clouds[--entered]);
    return refused ? pt_fail_again(&drawing->handle, refused) : error;
}

int patina_drawing_contour(patina_drawing *drawing, const patina_cloud *const *clouds, uint32_t count,
                           const patina_contour_desc *given, patina_progress *progress)
{
    patina_contour_desc desc;
    struct pt_terrain terrain = {0};
    struct pt_lines lines = {0};
    int error = pt_draw_check_clouds(drawing, "patina_drawing_contour", clouds, count);
    if (error)
        return error;
    error = pt_take(&drawing->handle, "patina_drawing_contour", given, &desc, sizeof desc);
    if (error)
        return error;
    if (!isfinite(desc.interval) || !(desc.interval > 0.0) || !isfinite(desc.cell) || desc.cell < 0.0)
        return pt_fail(&drawing->handle, PATINA_ERROR_ARGUMENT,
                       "patina_drawing_contour: interval must be above 0, and cell at least 0");
    error = make_terrain(drawing, clouds, count, &desc, progress, &terrain);
    if (error == PATINA_ERROR_EMPTY)
        pt_fail(&drawing->handle, error, "there is no ground within the drawing's extent and depth: make them larger");
    if (!error)
        error = add_levels(drawing, &terrain, desc.interval, desc.index ? desc.index : 5, &lines);
    if (!error)
        error = tidy(drawing, &lines);
    if (!error)
        error = pt_draw_replace(drawing, PATINA_DRAWING_CONTOUR, PATINA_DRAWING_CONTOUR_INDEX, &lines);
    pt_terrain_destroy(&terrain);
    pt_lines_free(&lines);
    if (error == PATINA_ERROR_MEMORY || error == PATINA_ERROR_CANCELLED)
        return pt_fail(&drawing->handle, error, "patina_drawing_contour: %s", patina_error_text(error));
    if (!error)
        pt_progress_set(progress, 1.0);
    return error;
}
