// SPDX-License-Identifier: GPL-3.0-or-later
// The mean of a picture's samples, step by step: a step is a picture of shifted or finer pixels, or as many rows of it as are drawn
// at once. The picture without samples comes first and is what readers see until then; its keys and data stay.
//
// Noise is what two halves of the pictures differ by (pt_sample_half). Were their pictures independent, the mean of m of the one
// and n of the other half would vary by m n / (m + n)^2 of the square of that difference; they lie evenly, so that it varies less.
#include "frame_samples.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    FINE_PIXELS = 1 << 22, // of a finer picture that is drawn at once: larger ones are drawn in bands
    PLANE_BYTES = 160,     // about, of a pixel's planes
};
// Linear colour at which the slope of picture levels ends: sRGB's is 12.9 there and below.
#define DARK 0.0015f

// What readers see, aside while finer pictures are drawn; and the finer picture's, aside while it is read.
struct aside {
    struct pt_buffer keys, planes[PT_PLANE_COUNT][PT_SLOTS]; // of these those of the crop
    struct pt_numbering key_ids;
    struct pt_shown shown;
    struct pt_layer layers[PATINA_MAX_LAYERS];
    struct pt_skipped skipped[PT_KERNEL_COUNT + 4];
    uint32_t layer_count, light_count, skipped_count;
    int keys_valid;
};

struct pt_mean {
    struct pt_sampling sampling;
    patina_settings settings; // of the scene, with what the picture chose for its error target
    uint32_t width, height;   // of the region
    uint32_t band;            // rows drawn at once
    uint32_t done, rows;      // whole pictures, and rows of the one under way
    int ended;
    float *sums[2]; // of each half of the pictures, 4 a pixel
    float *fine;    // finer pixels of a band
    struct aside aside;
};

static void swap_bytes(void *a, void *b, size_t size)
{
    unsigned char *x = a, *y = b;
    for (size_t i = 0; i < size; i++) {
        const unsigned char one = x[i];
        x[i] = y[i];
        y[i] = one;
    }
}

// Changes what readers see for what lies aside.
static void swap(struct patina_frame *frame, struct aside *aside)
{
    swap_bytes(&frame->planes.at[PT_PLANE_KEYS][0], &aside->keys, sizeof aside->keys);
    for (int p = 0; p < PT_PLANE_COUNT; p++)
        if (pt_plane_rows[p].size == PT_SIZE_CROP)
            swap_bytes(frame->planes.at[p], aside->planes[p], sizeof aside->planes[p]);
    swap_bytes(&frame->key_ids, &aside->key_ids, sizeof aside->key_ids);
    swap_bytes(&frame->shown, &aside->shown, sizeof aside->shown);
    swap_bytes(frame->layers, aside->layers, sizeof aside->layers);
    swap_bytes(frame->skipped, aside->skipped, sizeof aside->skipped);
    swap_bytes(&frame->layer_count, &aside->layer_count, sizeof aside->layer_count);
    swap_bytes(&frame->light_count, &aside->light_count, sizeof aside->light_count);
    swap_bytes(&frame->skipped_count, &aside->skipped_count, sizeof aside->skipped_count);
    swap_bytes(&frame->keys_valid, &aside->keys_valid, sizeof aside->keys_valid);
}

static void destroy_aside(struct patina_frame *frame, struct aside *aside)
{
    pt_numbering_release(&aside->key_ids);
    frame->device->ops->buffer_destroy(frame->device, &aside->keys);
    for (int p = 0; p < PT_PLANE_COUNT; p++)
        for (int slot = 0; slot < PT_SLOTS; slot++)
            frame->device->ops->buffer_destroy(frame->device, &aside->planes[p][slot]);
}

void pt_mean_destroy(struct patina_frame *frame)
{
    struct pt_mean *mean = frame->mean;
    if (!mean)
        return;
    destroy_aside(frame, &mean->aside);
    free(mean->sums[0]);
    free(mean->sums[1]);
    free(mean->fine);
    free(mean);
    frame->mean = NULL;
    frame->shown.stats.pixel_pending = 0;
}

// Rows of the region whose finer pixels are drawn at once.
static uint32_t rows_at_once(const struct patina_frame *frame, const struct pt_mean *mean)
{
    const uint32_t grid = mean->sampling.grid;
    uint64_t pixels = FINE_PIXELS;
    const uint64_t cap = frame->device->memory_cap / (2 * PLANE_BYTES), own = (uint64_t)mean->width * mean->height;
    pixels = pixels < own ? own : pixels; // there is room for a picture
    pixels = cap && cap < pixels ? cap : pixels;
    const uint64_t fit = pixels / ((uint64_t)mean->width * grid * grid);
    return fit < 1 ? 1 : fit < mean->height ? (uint32_t)fit : mean->height;
}

static int create(struct patina_frame *frame, const patina_settings *settings, const struct pt_sampling *sampling)
{
    struct pt_mean *mean = frame->mean = calloc(1, sizeof *mean);
    if (mean) {
        mean->sampling = *sampling;
        mean->settings = *settings;
        mean->width = settings->region[2] - settings->region[0];
        mean->height = settings->region[3] - settings->region[1];
        mean->band = rows_at_once(frame, mean);
        const size_t numbers = 4 * (size_t)mean->width * mean->height, finer = (size_t)sampling->grid * sampling->grid;
        mean->sums[0] = calloc(numbers, sizeof(float));
        mean->sums[1] = calloc(sampling->shifts > 1 ? numbers : 1, sizeof(float));
        mean->fine = malloc(4 * mean->width * mean->band * finer * sizeof(float));
        if (mean->sums[0] && mean->sums[1] && mean->fine)
            return PATINA_OK;
    }
    pt_mean_destroy(frame);
    return pt_fail(&frame->handle, PATINA_ERROR_MEMORY, "samples of a picture: out of memory");
}

// ---- noise ---------------------------------------------------------------------------------------------------------------

// Of so many pictures, and not of the others, noise is told: of halves that are alike, at four and by and by less often.
static int is_told(const struct pt_mean *mean)
{
    const uint32_t even = mean->done - (mean->sampling.shifts & 1u), fours = even / 4;
    if (mean->done == mean->sampling.shifts)
        return mean->done > 1;
    return even && even % 4 == 0 && (!(fours & (fours - 1)) || (fours % 3 == 0 && !(fours / 3 & (fours / 3 - 1))));
}

// Root mean square over the pixels whose samples differ, of the standard error of the mean, in levels of the picture: roots of
// its colours, near sRGB's levels. Of each pixel the colour, or the alpha, that is off most.
static float noise(const struct pt_mean *mean)
{
    uint32_t count[2] = {0, 0};
    for (uint32_t i = 0; i < mean->done; i++)
        count[pt_sample_half(&mean->sampling, i)]++;
    const float finer = (float)(mean->sampling.grid * mean->sampling.grid);
    const float share[2] = {1.0f / (finer * (float)count[0]), 1.0f / (finer * (float)count[1])};
    const double all = count[0] + count[1];
    double sum = 0.0, pixels = 0.0;
    for (size_t i = 0; i < (size_t)mean->width * mean->height; i++) {
        float most = 0.0f;
        for (int k = 0; k < 4; k++) {
            const float a = mean->sums[0][4 * i + k] * share[0], b = mean->sums[1][4 * i + k] * share[1];
            const float squared = (a - b) * (a - b), level = 0.5f * (a + b) > DARK ? 0.5f * (a + b) : DARK;
            const float off = k < 3 ? 0.25f * squared / level : squared; // the square of half a root's inverse
            most = off > most ? off : most;
        }
        sum += (double)most;
        pixels += most > 0.0f;
    }
    return pixels > 0.0 ? (float)sqrt(sum / pixels * (double)count[0] * (double)count[1] / (all * all)) : 0.0f;
}

// ---- steps ---------------------------------------------------------------------------------------------------------------

// Rows of the mean that threads add up, or share out.
struct rows {
    const struct pt_mean *mean;
    const float *fine; // of the first row
    float *out;
    uint32_t first; // of the rows, in the region
};

// Adds a finer picture's rows to those of the mean.
static void add_rows(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    (void)thread;
    const struct rows *rows = context;
    const uint32_t grid = rows->mean->sampling.grid, width = rows->mean->width;
    for (uint32_t y = begin; y < end; y++)
        for (uint32_t j = 0; j < grid; j++) {
            const float *restrict from = rows->fine + 4 * ((size_t)y * grid + j) * width * grid;
            float *restrict to = rows->out + 4 * (size_t)y * width;
            for (uint32_t x = 0; x < width; x++, to += 4)
                for (uint32_t i = 0; i < grid; i++, from += 4)
                    for (int k = 0; k < 4; k++)
                        to[k] += from[k];
        }
}

// Writes the mean of rows, in as many pictures as each has.
static void share_rows(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    (void)thread;
    const struct rows *rows = context;
    const struct pt_mean *mean = rows->mean;
    const uint32_t finer = mean->sampling.grid * mean->sampling.grid;
    for (uint32_t row = rows->first + begin; row < rows->first + end; row++) {
        const size_t numbers = 4 * (size_t)mean->width, at = row * numbers;
        const float share = 1.0f / (float)(finer * (mean->done + (row < mean->rows)));
        float *restrict to = rows->out + (row - rows->first) * numbers;
        const float *one = mean->sums[0] + at, *other = mean->sampling.shifts > 1 ? mean->sums[1] + at : NULL;
        for (size_t i = 0; i < numbers; i++)
            to[i] = (one[i] + (other ? other[i] : 0.0f)) * share;
    }
}

static void end_picture(struct patina_frame *frame, struct pt_mean *mean)
{
    patina_frame_stats *stats = &mean->aside.shown.stats; // of what readers see
    mean->done++;
    mean->rows = 0;
    if (is_told(mean))
        stats->pixel_error = noise(mean);
    mean->ended = mean->done == mean->sampling.shifts || (mean->settings.pixel_noise > 0.0f && mean->done >= PT_NOISE_SHIFTS &&
                                                          is_told(mean) && stats->pixel_error <= mean->settings.pixel_noise);
    frame->sampling[0] = mean->sampling.grid;
    frame->sampling[1] = mean->done;
    stats->pixel_samples = mean->sampling.grid * mean->sampling.grid * mean->done;
}

// A step, while what readers see lies aside.
static int draw_step(struct patina_frame *frame, const struct patina_scene *scene)
{
    struct pt_mean *mean = frame->mean;
    const uint32_t grid = mean->sampling.grid, first = mean->rows;
    const uint32_t end = first + mean->band < mean->height ? first + mean->band : mean->height;
    double shift[2];
    struct patina_scene plain = *scene, finer; // handles are not touched
    plain.settings = mean->settings;
    pt_sample_shift(&mean->sampling, mean->done, shift);
    pt_finer_scene(&plain, &mean->sampling, shift, first, end, &finer);
    frame->shown.picture_valid = 0; // nobody reads the finer picture before: writing this one may stop
    int error = pt_frame_draw(frame, &finer);
    if (!error && atomic_load(&frame->cancel)) // adding it up takes as long as some passes
        error = pt_fail(&frame->handle, PATINA_ERROR_CANCELLED, "rendering was cancelled");
    if (!error)
        error = pt_frame_read(frame, PATINA_PASS_COMBINED, mean->fine,
                              (size_t)mean->width * grid * (end - first) * grid * 4 * sizeof *mean->fine);
    if (error)
        return error;
    float *sums = mean->sums[pt_sample_half(&mean->sampling, mean->done)];
    struct rows rows = {mean, mean->fine, sums + 4 * (size_t)first * mean->width, first};
    pt_parallel(frame->device->pool, end - first, 0, add_rows, &rows);
    mean->rows = end;
    if (end == mean->height)
        end_picture(frame, mean);
    frame->progress_done += frame->progress_share;
    return PATINA_OK;
}

// Whether a picture has its fellow on the other side of the pixel's middle: without it the mean lies aside.
static int is_paired(const struct pt_mean *mean)
{
    return mean->sampling.shifts == 1 || !((mean->sampling.shifts - mean->done) & 1u);
}

// Writes the mean of what there is into the picture that readers see, a band at a time.
static int show(struct patina_frame *frame)
{
    struct pt_mean *mean = frame->mean;
    const uint32_t finer = mean->sampling.grid * mean->sampling.grid, width = mean->width;
    const uint32_t most = finer * mean->band, have = mean->done ? mean->height : mean->rows; // rows
    for (uint32_t y = 0; y < have; y += most) {
        const uint32_t end = y + most < have ? y + most : have;
        struct rows rows = {mean, NULL, mean->fine, y};
        pt_parallel(frame->device->pool, end - y, 0, share_rows, &rows);
        int error = frame->device->ops->buffer_write(frame->device, &frame->planes.at[PT_PLANE_COMBINED][0],
                                                     4 * (size_t)y * width * sizeof(float), mean->fine,
                                                     4 * (size_t)(end - y) * width * sizeof(float));
        if (error) {
            frame->shown.picture_valid = 0; // half a picture is none: the device failed
            return pt_fail_again(&frame->handle, error);
        }
    }
    return PATINA_OK;
}

// Steps until ms have passed, at least one. What they come to is shown, unless the picture is lost with an error.
static int advance(struct patina_frame *frame, const struct patina_scene *scene, double ms)
{
    const double start = pt_milliseconds();
    struct pt_mean *mean = frame->mean;
    int error = PATINA_OK;
    swap(frame, &mean->aside);
    do
        error = draw_step(frame, scene);
    while (!error && !mean->ended && ((!is_paired(mean) && !mean->rows) || pt_milliseconds() - start < ms));
    swap(frame, &mean->aside);
    const int lost = error && !mean->settings.pixel_progressive; // with the rest
    const int shown = lost || (mean->done == 1 && !is_paired(mean)) ? PATINA_OK : show(frame);
    frame->shown.stats.ms += pt_milliseconds() - start;
    frame->shown.stats.pixel_pending = mean->ended
                                           ? 0
                                           : mean->sampling.grid * mean->sampling.grid * (mean->sampling.shifts - mean->done);
    if (mean->ended) {
        pt_mean_destroy(frame);
        atomic_store(&frame->progress, 1.0f);
    }
    return error ? error : shown;
}

// Chooses how samples are taken; none when the picture is one sample.
static int begin(struct patina_frame *frame, const struct patina_scene *scene)
{
    struct pt_plan plan;
    struct patina_scene plain = *scene; // its handle is not touched
    int error = pt_plan_create(&plain, frame->device->pool, &plan);
    if (error)
        return pt_fail_again(&frame->handle, error);
    const struct pt_sampling sampling = pt_choose_sampling(scene, &plan);
    patina_settings settings = scene->settings;
    if (settings.error_target > 0.0f) { // what the picture asks for, its samples take
        settings.quality = plan.quality;
        settings.fill = plan.fill;
        settings.surface = PATINA_SURFACE_FILL;
        settings.error_target = 0.0f;
    }
    settings.shadow_lazy = settings.shadow_progressive = 0; // all of them take from whole textures
    pt_plan_destroy(&plan);
    if (sampling.grid == 1 && sampling.shifts == 1)
        return PATINA_OK;
    error = create(frame, &settings, &sampling);
    if (!error) {
        const uint32_t bands = (frame->mean->height + frame->mean->band - 1) / frame->mean->band;
        frame->progress_share = 1.0f / (float)(sampling.shifts * bands + 1);
    }
    return error;
}

static int draw_first(struct patina_frame *frame, const struct patina_scene *scene)
{
    struct patina_scene first = *scene;
    first.settings.shadow_lazy = 0; // its samples take from whole textures
    first.settings.shadow_progressive &= scene->settings.pixel_progressive;
    const int error = pt_frame_draw(frame, &first);
    if (error)
        return error;
    frame->progress_done = frame->progress_share;
    frame->shown.stats.pixel_pending = frame->mean->sampling.grid * frame->mean->sampling.grid * frame->mean->sampling.shifts;
    return PATINA_OK;
}

int pt_frame_sample(struct patina_frame *frame, const struct patina_scene *scene)
{
    int error = begin(frame, scene);
    if (error || !frame->mean)
        return error ? error : pt_frame_draw(frame, scene);
    if (scene->settings.pixel_progressive) {
        error = draw_first(frame, scene);
        if (error)
            pt_mean_destroy(frame);
        return error;
    }
    struct aside *last = calloc(1, sizeof *last); // what readers see, until there is all
    if (!last) {
        pt_mean_destroy(frame);
        return pt_fail(&frame->handle, PATINA_ERROR_MEMORY, "samples of a picture: out of memory");
    }
    swap(frame, last);
    error = draw_first(frame, scene);
    if (!error)
        error = advance(frame, scene, INFINITY);
    if (error) {
        pt_mean_destroy(frame);
        swap(frame, last);
        frame->keys_valid = 0;
    }
    destroy_aside(frame, last);
    free(last);
    return error;
}

int pt_frame_refine(struct patina_frame *frame, const struct patina_scene *scene, double ms)
{
    const struct pt_mean *mean = frame->mean;
    const patina_settings *settings = &scene->settings;
    int error;
    if (!mean || !frame->shown.picture_valid)
        return pt_fail(&frame->handle, PATINA_ERROR_EMPTY, "patina_frame_refine: no samples are pending");
    if (settings->width != mean->settings.width || settings->height != mean->settings.height ||
        memcmp(settings->region, mean->settings.region, sizeof settings->region) ||
        settings->pixel_samples != mean->settings.pixel_samples)
        return pt_fail(&frame->handle, PATINA_ERROR_ARGUMENT, "patina_frame_refine: the scene is not that of the picture");
    if (frame->shown.stats.shadow_pending) { // further samples of lights come first
        const float done = frame->progress_done;
        frame->progress_done = 0.0f;
        error = draw_first(frame, scene);
        frame->progress_done = error ? done : frame->progress_share;
    } else {
        error = advance(frame, scene, ms);
    }
    atomic_store(&frame->cancel, 0);
    return error;
}
