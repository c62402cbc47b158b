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
#include "shared/lines.h"

#include <math.h>

// Of two numbers whose multiples share out a square evenly, however many are taken: x^3 = x + 1, 1 / x and 1 / x^2. Edges at any
// angle, root mean square over the pixels that they cross: 4 samples are off by 0.101, 16 by 0.040, 64 by 0.015, 256 by 0.006.
#define ACROSS 0.75487766624669276
#define ALONG 0.56984029099805327
// Turns by which pairs change halves: of edges at any angle the noise so told is 0.8 to 2.8 times what it is, at 4 to 256 samples;
// by turns 1.1 to 4.1, upright edges most.
#define GOLDEN 0.38196601125010515
// Finer pixels that filled points lie apart, about: at 1 some gaps stay open (16 points a pixel, 9 samples in place of 16: a
// sphere 53.3 dB for 47.0, a knot 42.6 for 42.3).
#define FILLED_SPACING 0.85
enum {
    WIDEST = 65536, // pixels of a side
    NOISE_GRID = 4, // with a noise target: what is drawn at once is not much more than what is asked for
};

static uint32_t at_most(uint32_t value, uint32_t most) { return value < most ? value : most; }

// The largest grid that lets the scene look as it does: what is measured in pixels, and bounded, grows with it.
static uint32_t largest_grid(const struct patina_scene *scene, const struct pt_plan *plan)
{
    const patina_settings *settings = &scene->settings;
    const uint32_t side = settings->width > settings->height ? settings->width : settings->height;
    uint32_t most = WIDEST / side;
    if (plan->fill != PATINA_FILL_CLOSED && settings->surface != PATINA_SURFACE_SPLATS && plan->filled)
        return 1; // a point is a pixel wide, or as wide as the paper's filling makes it
    most = pt_effects_grid(&scene->effects, most);
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
    struct pt_sampling sampling = {1, 1, 0};
    if (samples < 2 || !pt_plan_shows(plan))
        return sampling;
    if (!scene->cloud_count) // meshes alone
        return (struct pt_sampling){1, samples, 1};
    uint32_t grid = (uint32_t)sqrt((double)samples); // exact below 2^26
    if (scene->settings.pixel_noise > 0.0f && samples >= PT_NOISE_SHIFTS)
        grid = at_most((uint32_t)sqrt((double)(samples / PT_NOISE_SHIFTS)), NOISE_GRID);
    if (plan->filled) // of points by themselves no spacing is known: each is a pixel wide
        grid = at_most(grid, filled_grid(plan->spacing_middle));
    sampling.grid = at_most(grid, largest_grid(scene, plan));
    sampling.shifts = samples / (sampling.grid * sampling.grid);
    return sampling;
}

static double turned(double turns) { return turns - floor(turns + 0.5); }

void pt_sample_shift(const struct pt_sampling *sampling, uint32_t i, double shift[2])
{
    const uint32_t odd = sampling->shifts & 1u;
    const double turn = i < odd ? 0.0 : (i - odd) / 2 + (odd ? 1.0 : 0.5);
    const double side = i < odd || (i - odd) & 1u ? -1.0 : 1.0;
    const double width = sampling->shifts == 2 ? 0.66 : 1.0; // each in the middle of a half
    shift[0] = width * side * turned(turn * ACROSS);
    shift[1] = -width * side * turned(turn * ALONG);
}

uint32_t pt_sample_half(const struct pt_sampling *sampling, uint32_t i)
{
    if (sampling->shifts < PT_NOISE_SHIFTS)
        return i > 0;
    const uint32_t odd = sampling->shifts & 1u;
    return i >= odd && turned((i - odd) / 2 * GOLDEN - 0.25) >= 0.0;
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
    pt_effects_scale(&out->effects, (float)grid);
    if (!out->lines.world)
        out->lines.width *= (float)grid;
}
