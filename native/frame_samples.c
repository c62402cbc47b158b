// SPDX-License-Identifier: GPL-3.0-or-later
// Samples of a final picture: the mean over each pixel of pictures whose pixels are finer.
//
// A filled picture's outline lies up to a pixel outside the surface, however many of them are averaged: what shifts alone
// converge to is grown by that. Finer pixels take that away with the pixel's width. A sphere at 4 points a pixel, dB: one
// picture 42.9, sixteen shifted ones 44.0, 2 x 2 finer pixels 44.7, with four shifts 45.7; as discs 43.0, 44.6, and 51.8 of 4 x 4
// finer pixels, in a fourth of the time. Points that are filled want about one to a finer pixel: below that their gaps are closed by
// coarser cells, which grow outlines again (a knot at 1 point a pixel: 30.9, with 4 x 4 finer pixels 28.2). So filled ones get a
// grid of about the root of the points a pixel, and shifts for the rest; discs the whole grid. Finer pictures are anti-aliased as
// any other: without that the sphere's 4 x 4 have 42.9 in place of 46.9.
#include "frame_samples.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define GOLDEN 0.61803398874989485
// Finer pixels that filled points lie apart, about: at 1 some gaps stay open (16 points a pixel, 9 samples in place of 16: a
// sphere 53.3 dB for 47.0, a knot 42.6 for 42.3).
#define FILLED_SPACING 0.85
enum {
    WIDEST = 65536,     // pixels of a side
    FINE_PIXELS = 1 << 22, // of a finer picture that is drawn at once: larger ones are drawn in bands
    PLANE_BYTES = 160,  // about, of a pixel's planes
    EDL_WIDEST = 16,    // radius, pixels
};

static uint32_t at_most(uint32_t value, uint32_t most) { return value < most ? value : most; }

// The largest grid that lets the scene look as it does: what is measured in pixels, and bounded, grows with it.
static uint32_t largest_grid(const struct patina_scene *scene, const struct pt_plan *plan)
{
    const patina_settings *settings = &scene->settings;
    const patina_effects *effects = &scene->effects;
    const uint32_t side = settings->width > settings->height ? settings->width : settings->height;
    uint32_t most = WIDEST / side;
    if (plan->fill != PATINA_FILL_CLOSED && settings->surface != PATINA_SURFACE_SPLATS)
        return 1; // a point is a pixel wide, or as wide as the paper's filling makes it
    if (effects->obscurance_strength > 0.0f || effects->focus_aperture > 0.0f || effects->paper_grain > 0.0f)
        return 1;
    if (effects->edl_strength > 0.0f)
        most = at_most(most, (uint32_t)(EDL_WIDEST / effects->edl_radius));
    if (plan->line_radius > 0.0f)
        most = at_most(most, (uint32_t)(PT_LINE_MOST / plan->line_radius));
    return most ? most : 1;
}

static uint32_t filled_grid(double spacing)
{
    const double grid = spacing > 0.0 ? floor(FILLED_SPACING / spacing + 0.5) : 1.0;
    return grid < 1.0 ? 1 : grid < WIDEST ? (uint32_t)grid : WIDEST;
}

struct pt_sampling pt_choose_sampling(const struct patina_scene *scene, const struct pt_plan *plan)
{
    const uint32_t samples = scene->settings.pixel_samples;
    struct pt_sampling sampling = { 1, 1, 0 };
    if (samples < 2 || !pt_plan_shows(plan))
        return sampling;
    if (!scene->instance_count) // meshes alone
        return (struct pt_sampling){ 1, samples, 1 };
    uint32_t grid = (uint32_t)sqrt((double)samples); // exact below 2^26
    if (plan->filled) // of points by themselves no spacing is known: each is a pixel wide
        grid = at_most(grid, filled_grid(plan->spacing_middle));
    sampling.grid = at_most(grid, largest_grid(scene, plan));
    sampling.shifts = samples / (sampling.grid * sampling.grid);
    return sampling;
}

void pt_sample_shift(const struct pt_sampling *sampling, uint32_t i, double shift[2])
{
    const double count = sampling->shifts; // a lattice: columns in turn, rows by the golden section, about their middle
    double middle = 0.0;
    for (uint32_t k = 0; k < sampling->shifts; k++)
        middle += fmod(k * GOLDEN + 0.5, 1.0) / count;
    shift[0] = (i + 0.5) / count - 0.5;
    shift[1] = fmod(i * GOLDEN + 0.5, 1.0) - middle;
}

void pt_finer_scene(const struct patina_scene *scene, const struct pt_sampling *sampling, const double shift[2], uint32_t first,
                    uint32_t end, struct patina_scene *out)
{
    const uint32_t grid = sampling->grid;
    *out = *scene;
    patina_settings *settings = &out->settings;
    patina_camera *camera = &out->camera;
    const double right = shift[0] * (camera->right - camera->left) / ((double)settings->width * grid);
    const double up = shift[1] * (camera->top - camera->bottom) / ((double)settings->height * grid);
    camera->left += right;
    camera->right += right;
    camera->bottom += up;
    camera->top += up;
    settings->width *= grid;
    settings->height *= grid;
    settings->region[0] *= grid;
    settings->region[2] *= grid;
    settings->region[1] = (scene->settings.region[1] + first) * grid;
    settings->region[3] = (scene->settings.region[1] + end) * grid;
    settings->fill_iterations = at_most(settings->fill_iterations * grid, 64);
    settings->antialias = sampling->hard ? PATINA_ANTIALIAS_OFF : settings->antialias;
    settings->passes = 1u << PATINA_PASS_COMBINED;
    settings->layer_passes = 0;
    out->finer = grid;
    out->effects.edl_radius *= (float)grid;
    out->effects.hatch_spacing *= (float)grid;
    if (!out->lines.world)
        out->lines.width *= (float)grid;
}

// ---- the mean ------------------------------------------------------------------------------------------------------------

// Adds a finer picture's rows to those of the mean.
static void add_up(const float *fine, uint32_t grid, uint32_t width, uint32_t rows, float *sum)
{
    for (uint32_t y = 0; y < rows; y++)
        for (uint32_t j = 0; j < grid; j++) {
            const float *from = fine + 4 * ((size_t)y * grid + j) * width * grid;
            float *to = sum + 4 * (size_t)y * width;
            for (uint32_t x = 0; x < width; x++, to += 4)
                for (uint32_t i = 0; i < grid; i++, from += 4)
                    for (int k = 0; k < 4; k++)
                        to[k] += from[k];
        }
}

// What readers see of a picture, while others are made.
struct kept {
    struct pt_buffer planes[PT_PLANE_COUNT];
    struct pt_shown shown;
};

static void put_aside(struct patina_frame *frame, struct kept *kept)
{
    memset(kept, 0, sizeof *kept);
    for (int p = PT_PLANE_COMBINED; p < PT_PLANE_LAYER_COMBINED; p++) {
        kept->planes[p] = frame->planes[p][0];
        frame->planes[p][0] = (struct pt_buffer){ 0 };
    }
    kept->shown = frame->shown;
}

static void put_back(struct patina_frame *frame, const struct kept *kept)
{
    for (int p = PT_PLANE_COMBINED; p < PT_PLANE_LAYER_COMBINED; p++) {
        frame->device->ops->buffer_destroy(frame->device, &frame->planes[p][0]);
        frame->planes[p][0] = kept->planes[p];
    }
    frame->shown = kept->shown;
    frame->keys_valid = 0;
}

// Rows of the region whose finer pixels are drawn at once.
static uint32_t rows_at_once(const struct patina_frame *frame, uint32_t width, uint32_t rows, uint32_t grid)
{
    uint64_t pixels = FINE_PIXELS;
    const uint64_t cap = frame->device->memory_cap / (2 * PLANE_BYTES), own = (uint64_t)width * rows;
    pixels = pixels < own ? own : pixels; // there is room for a picture
    pixels = cap && cap < pixels ? cap : pixels;
    const uint64_t fit = pixels / ((uint64_t)width * grid * grid);
    return fit < 1 ? 1 : fit < rows ? (uint32_t)fit : rows;
}

static int draw_samples(struct patina_frame *frame, const struct patina_scene *scene, const struct pt_sampling *sampling, float *sum)
{
    const uint32_t *region = scene->settings.region, grid = sampling->grid;
    const uint32_t width = region[2] - region[0], rows = region[3] - region[1], some = rows_at_once(frame, width, rows, grid);
    const float share = 1.0f / (float)(sampling->shifts * ((rows + some - 1) / some) + 1);
    float *fine = malloc((size_t)width * grid * some * grid * 4 * sizeof *fine);
    int error = fine ? PATINA_OK : pt_fail(&frame->handle, PATINA_ERROR_MEMORY, "samples of a picture: out of memory");
    frame->progress_share = share;
    for (uint32_t i = 0; i < sampling->shifts && !error; i++) {
        double shift[2];
        pt_sample_shift(sampling, i, shift);
        for (uint32_t y = 0; y < rows && !error; y += some) {
            const uint32_t end = y + some < rows ? y + some : rows;
            struct patina_scene finer;
            pt_finer_scene(scene, sampling, shift, y, end, &finer);
            error = pt_frame_draw(frame, &finer);
            if (!error)
                error = pt_frame_read(frame, PATINA_PASS_COMBINED, fine,
                                      (size_t)width * grid * (end - y) * grid * 4 * sizeof *fine);
            if (!error)
                add_up(fine, grid, width, end - y, sum + 4 * (size_t)y * width);
            frame->progress_done += share;
        }
    }
    free(fine);
    return error;
}

int pt_frame_sample(struct patina_frame *frame, const struct patina_scene *scene)
{
    struct pt_plan plan;
    struct patina_scene plain = *scene; // its handle is not touched
    int error = pt_plan_create(&plain, &plan);
    if (error)
        return pt_fail_again(&frame->handle, error);
    const struct pt_sampling sampling = pt_choose_sampling(scene, &plan);
    if (plain.settings.error_target > 0.0f) { // what the picture asks for, its samples take
        plain.settings.quality = plan.quality;
        plain.settings.fill = plan.fill;
        plain.settings.surface = PATINA_SURFACE_FILL;
        plain.settings.error_target = 0.0f;
    }
    pt_plan_destroy(&plan);
    if (sampling.grid == 1 && sampling.shifts == 1)
        return pt_frame_draw(frame, scene);
    plain.settings.shadow_lazy = plain.settings.shadow_progressive = 0; // all of them take from whole textures

    const uint32_t *region = scene->settings.region;
    const size_t numbers = 4 * (size_t)(region[2] - region[0]) * (region[3] - region[1]);
    float *sum = calloc(numbers, sizeof *sum);
    if (!sum)
        return pt_fail(&frame->handle, PATINA_ERROR_MEMORY, "samples of a picture: out of memory");
    struct kept kept;
    put_aside(frame, &kept);
    error = draw_samples(frame, &plain, &sampling, sum);
    put_back(frame, &kept);
    struct patina_scene shown = *scene;
    shown.settings.shadow_lazy = shown.settings.shadow_progressive = 0;
    if (!error)
        error = pt_frame_draw(frame, &shown);
    const float share = 1.0f / (float)(sampling.grid * sampling.grid * sampling.shifts);
    for (size_t i = 0; i < numbers && !error; i++)
        sum[i] *= share;
    if (!error)
        error = frame->device->ops->buffer_write(frame->device, &frame->planes[PT_PLANE_COMBINED][0], 0, sum, numbers * sizeof *sum);
    if (!error)
        frame->sampling[0] = sampling.grid, frame->sampling[1] = sampling.shifts;
    free(sum);
    return error;
}
