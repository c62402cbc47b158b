// SPDX-License-Identifier: GPL-3.0-or-later
// The ground under a cloud, and the height of each point above it: patina_ground. Passes over the points; relief.c has the surface.
#include "places.h"
#include "relief.h"
#include "base/compare.h"
#include "base/descriptor.h"
#include "base/error.h"
#include "base/pool.h"
#include "base/progress.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

enum { PIECE = 1 << 14, STRAY_CELLS = 4, STRAY_PEERS = 3, STRAY_ROUNDS = 3, FEW = 16, SAMPLE = 4096, MOST_CELLS = 1 << 26 };

#define BAND 0.25 // of the threshold: a cell's ground is the mean of what is so little above its lowest point
#define BAND_STEPS 65535.0
#define SPACINGS 3.0  // of a cell
#define TERRAIN 0.5   // width of a cell, if the cloud is large enough
#define PARTS 60.0    // cells across a smaller cloud
#define LARGEST 100.0 // cells

struct job {
    struct pt_places places;
    double low[3]; // x and y of the grid's corner; z in the middle
    double high[2];
    struct pt_relief grid;  // of the finest cells
    struct pt_relief under; // the surface that values are above; z NULL: a plane
    double threshold;
    _Atomic uint64_t *least; // of each cell: value, made sortable, and number of the lowest point
    uint8_t *left_out;       // strays, of each point
    int64_t times;           // cells of a pass are as wide as so many of the grid's
    _Atomic uint32_t *near;  // points little above their cell's lowest
    uint8_t *bad;            // cells whose lowest points are strays
    double margin;
    _Atomic uint64_t *band; // of each cell: number of points << 40 | sum of steps above its lowest
    float *residual, *height;
    uint8_t *ground;
    patina_progress *progress;
};

#define NONE UINT64_MAX

// ---- one point ---------------------------------------------------------------------------------------------------------

// A float's bits in an order of their own: lower values first.
static uint32_t sortable(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits & 0x80000000u ? ~bits : bits | 0x80000000u;
}

static float from_sortable(uint32_t bits)
{
    float value;
    bits = bits & 0x80000000u ? bits & 0x7FFFFFFFu : ~bits;
    memcpy(&value, &bits, sizeof value);
    return value;
}

// Places of a point in the grid's frame. Returns 0 where it lies beside the grid.
static int take(const struct job *job, uint64_t i, double p[3])
{
    if (!pt_place(&job->places, i, p))
        return 0;
    for (int k = 0; k < 3; k++)
        p[k] -= job->low[k];
    return p[0] >= 0 && p[1] >= 0 && p[0] <= job->high[0] && p[1] <= job->high[1];
}

static int64_t cells_across(const struct job *job, int64_t size) { return (size + job->times - 1) / job->times; }

static int64_t cell_of(const struct job *job, const double p[3])
{
    const double width = job->grid.cell * (double)job->times;
    int64_t x = (int64_t)(p[0] / width), y = (int64_t)(p[1] / width);
    const int64_t most_x = cells_across(job, job->grid.width) - 1, most_y = cells_across(job, job->grid.height) - 1;
    x = x > most_x ? most_x : x;
    y = y > most_y ? most_y : y;
    return y * (most_x + 1) + x;
}

static float value_of(const struct job *job, const double p[3])
{
    return (float)(job->under.z ? p[2] - pt_relief_at(&job->under, p[0], p[1]) : p[2]);
}

// ---- passes over the points ----------------------------------------------------------------------------------------------

typedef void visit(struct job *job, uint64_t i, const double p[3]);

struct walk {
    struct job *job;
    visit *each;
    int strays_too;
};

static void walk_pieces(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct walk *walk = context;
    struct job *job = walk->job;
    (void)thread;
    for (uint64_t piece = begin; piece < end && !pt_progress_cancelled(job->progress); piece++)
        for (uint64_t i = piece * PIECE; i < (piece + 1) * PIECE && i < job->places.count; i++) {
            double p[3];
            if ((walk->strays_too || !job->left_out[i]) && take(job, i, p))
                walk->each(job, i, p);
        }
}

static void visit_points(struct job *job, struct pt_pool *pool, int strays_too, visit *each)
{
    struct walk walk = {job, each, strays_too};
    pt_parallel(pool, (uint32_t)((job->places.count + PIECE - 1) / PIECE), 4, walk_pieces, &walk);
}

static void note_least(struct job *job, uint64_t i, const double p[3])
{
    const uint64_t key = (uint64_t)sortable(value_of(job, p)) << 32 | i;
    _Atomic uint64_t *at = &job->least[cell_of(job, p)];
    uint64_t seen = atomic_load_explicit(at, memory_order_relaxed);
    while (key < seen && !atomic_compare_exchange_weak_explicit(at, &seen, key, memory_order_relaxed, memory_order_relaxed))
        ;
}

static double least_of(const struct job *job, int64_t cell)
{
    return (double)from_sortable((uint32_t)(job->least[cell] >> 32));
}

static int is_near_least(const struct job *job, int64_t cell, const double p[3])
{
    return (double)value_of(job, p) <= least_of(job, cell) + job->margin;
}

static void count_near(struct job *job, uint64_t i, const double p[3])
{
    const int64_t cell = cell_of(job, p);
    (void)i;
    if (is_near_least(job, cell, p))
        atomic_fetch_add_explicit(&job->near[cell], 1, memory_order_relaxed);
}

static void leave_out(struct job *job, uint64_t i, const double p[3])
{
    const int64_t cell = cell_of(job, p);
    if (job->bad[cell] && is_near_least(job, cell, p))
        job->left_out[i] = 1;
}

static void add_to_band(struct job *job, uint64_t i, const double p[3])
{
    const int64_t cell = cell_of(job, p);
    const double above = ((double)value_of(job, p) - least_of(job, cell)) / (BAND * job->threshold);
    (void)i;
    if (isfinite(job->residual[cell]) && above <= 1 && job->band[cell] < 0xFFFFFFull << 40)
        atomic_fetch_add_explicit(&job->band[cell], 1ull << 40 | (uint64_t)(fmax(above, 0) * BAND_STEPS), memory_order_relaxed);
}

static void tell_height(struct job *job, uint64_t i, const double p[3])
{
    const double above = p[2] - pt_relief_at(&job->under, p[0], p[1]);
    job->height[i] = (float)above;
    job->ground[i] = fabs(above) < job->threshold;
}

// ---- strays below the ground -----------------------------------------------------------------------------------------------

// Marks cells whose lowest points are few, and lower than those of all cells around.
static int mark_strays(struct job *job)
{
    const int64_t width = cells_across(job, job->grid.width), height = cells_across(job, job->grid.height);
    int any = 0;
    for (int64_t y = 0; y < height && !pt_progress_cancelled(job->progress); y++)
        for (int64_t x = 0; x < width; x++) {
            const int64_t own = y * width + x;
            job->bad[own] = 0;
            if (job->least[own] == NONE)
                continue;
            uint32_t peers = job->near[own] - 1;
            for (int64_t j = y > 0 ? y - 1 : 0; j <= y + 1 && j < height; j++)
                for (int64_t i = x > 0 ? x - 1 : 0; i <= x + 1 && i < width; i++)
                    if (j * width + i != own && job->least[j * width + i] != NONE)
                        peers += least_of(job, j * width + i) <= least_of(job, own) + job->margin;
            job->bad[own] = peers < STRAY_PEERS;
            any |= job->bad[own];
        }
    return any;
}

// margin: a lower point than those around is no stray if it is less below them.
static int leave_out_strays(struct job *job, struct pt_pool *pool, double margin)
{
    job->times = STRAY_CELLS;
    job->margin = margin;
    const size_t cells = (size_t)(cells_across(job, job->grid.width) * cells_across(job, job->grid.height));
    job->near = malloc(cells * sizeof *job->near);
    job->bad = malloc(cells);
    int any = job->near && job->bad && job->places.count >= FEW;
    for (int round = 0; round < STRAY_ROUNDS && any; round++) {
        memset((void *)job->least, 0xFF, cells * sizeof *job->least);
        memset((void *)job->near, 0, cells * sizeof *job->near);
        visit_points(job, pool, 0, note_least);
        visit_points(job, pool, 0, count_near);
        any = !pt_progress_cancelled(job->progress) && mark_strays(job);
        if (any)
            visit_points(job, pool, 0, leave_out);
    }
    const int error = job->near && job->bad ? PATINA_OK : PATINA_ERROR_MEMORY;
    free((void *)job->near);
    free(job->bad);
    job->times = 1;
    return error ? error : pt_progress_cancelled(job->progress) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}

// ---- the grid ----------------------------------------------------------------------------------------------------------------

// Where the cloud lies: all of it, or, where that is `most` times as wide as nearly all of it, the latter and half as much to each side.
static int find_box(const struct pt_places *places, double low[3], double high[3], double most)
{
    const uint64_t step = (places->count + SAMPLE - 1) / SAMPLE;
    double *sorted = malloc(3 * SAMPLE * sizeof *sorted), p[3];
    size_t count = 0;
    if (!sorted)
        return PATINA_ERROR_MEMORY;
    if (!pt_places_box(places, low, high)) {
        free(sorted);
        return PATINA_ERROR_EMPTY;
    }
    for (uint64_t i = 0; i < places->count; i += step)
        if (pt_place(places, i, p)) {
            for (int k = 0; k < 3; k++)
                sorted[k * SAMPLE + (int)count] = p[k];
            count++;
        }
    for (int k = 0; k < 3 && count; k++) {
        double *own = sorted + k * SAMPLE;
        qsort(own, count, sizeof *own, pt_compare_doubles);
        const size_t cut = count / 100 + (count >= FEW);
        const double from = own[cut], to = own[count - 1 - cut];
        if (to > from && high[k] - low[k] > most * (to - from)) {
            low[k] = fmax(low[k], from - 0.5 * (to - from));
            high[k] = fmin(high[k], to + 0.5 * (to - from));
        }
    }
    free(sorted);
    return PATINA_OK;
}

enum { WIDE = 8 }; // times: a cloud that its strays widen so much has none of them in its grid

static int set_defaults(const char *call, patina_ground_desc *desc, const struct pt_places *places)
{
    double low[3], high[3];
    if (desc->cell > 0) {
        // given
    } else {
        const int error = find_box(places, low, high, WIDE);
        if (error == PATINA_ERROR_MEMORY)
            return pt_fail(NULL, error, "%s: out of memory", call);
        const double extent = error ? 0 : fmax(high[0] - low[0], high[1] - low[1]);
        desc->cell = fmax(fmin(TERRAIN, extent / PARTS), SPACINGS * pt_places_spacing(places));
        desc->cell = fmax(desc->cell, extent / 8000);
        if (error || !(desc->cell > 0) || !isfinite(desc->cell))
            return pt_fail(NULL, PATINA_ERROR_EMPTY, "%s: fewer than two points, so that there is no size to choose cells by",
                           call);
    }
    if (!(desc->threshold > 0))
        desc->threshold = desc->cell;
    if (!(desc->largest > 0))
        desc->largest = LARGEST * desc->cell;
    return PATINA_OK;
}

static int make_grid(struct job *job, double cell)
{
    double low[3], high[3];
    const int error = find_box(&job->places, low, high, WIDE);
    if (error)
        return error;
    const double width = floor((high[0] - low[0]) / cell) + 1, height = floor((high[1] - low[1]) / cell) + 1;
    if (!(width * height <= MOST_CELLS))
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT,
                       "patina_ground: cells of %g make a grid of %.3g cells, more than 2^26: use cells of %.3g or more", cell,
                       width * height, 1.01 * cell * sqrt(width * height / MOST_CELLS));
    job->grid = (struct pt_relief){.cell = cell, .width = (int64_t)width, .height = (int64_t)height};
    memcpy(job->low, low, sizeof low);
    job->low[2] = 0.5 * (low[2] + high[2]);
    job->high[0] = high[0] - low[0];
    job->high[1] = high[1] - low[1];
    return PATINA_OK;
}

// ---- the surface ---------------------------------------------------------------------------------------------------------------

// Whether a walk over cells ends at this one since it was cancelled.
static int is_over(const struct job *job, int64_t i) { return i % PIECE == 0 && pt_progress_cancelled(job->progress); }

static int coarse_surface(struct job *job, struct pt_pool *pool, double largest, double begin, double end)
{
    const size_t cells = (size_t)(job->grid.width * job->grid.height);
    struct pt_lowest *lowest = malloc(cells * sizeof *lowest);
    if (!lowest)
        return PATINA_ERROR_MEMORY;
    memset((void *)job->least, 0xFF, cells * sizeof *job->least);
    visit_points(job, pool, 0, note_least);
    for (size_t i = 0; i < cells; i++) {
        double p[3];
        if (is_over(job, (int64_t)i))
            break;
        if (job->least[i] == NONE) {
            lowest[i] = (struct pt_lowest){0, 0, NAN};
            continue;
        }
        take(job, job->least[i] & UINT32_MAX, p);
        lowest[i] = (struct pt_lowest){(float)p[0], (float)p[1], (float)p[2]};
    }
    const int error = pt_progress_cancelled(job->progress) ? PATINA_ERROR_CANCELLED
                                                           : pt_relief_find(lowest, &job->grid, largest, job->threshold, pool,
                                                                            job->progress, begin, end, &job->under);
    free(lowest);
    return error;
}

// On the finest cells: which of them are ground, and the mean of their ground.
static int fine_surface(struct job *job, struct pt_pool *pool)
{
    const int64_t width = job->grid.width, cells = width * job->grid.height;
    memset((void *)job->least, 0xFF, (size_t)cells * sizeof *job->least);
    visit_points(job, pool, 0, note_least);
    job->residual = malloc((size_t)cells * sizeof *job->residual);
    job->band = calloc((size_t)cells, sizeof *job->band);
    int error = job->residual && job->band ? PATINA_OK : PATINA_ERROR_MEMORY;
    for (int64_t i = 0; i < cells && !error && !is_over(job, i); i++)
        job->residual[i] = job->least[i] == NONE ? NAN : (float)least_of(job, i);
    if (!error)
        error = pt_relief_accept(job->residual, &job->grid, job->threshold, job->progress);
    pt_progress_raise(job->progress, 0.7);
    if (!error)
        visit_points(job, pool, 0, add_to_band);
    for (int64_t i = 0; i < cells && !error && !is_over(job, i); i++)
        if (isfinite(job->residual[i]) && job->band[i] >> 40)
            job->residual[i] += (float)(BAND * job->threshold * (double)(job->band[i] & 0xFFFFFFFFFFull) / BAND_STEPS /
                                        (double)(job->band[i] >> 40));
    if (!error)
        error = pt_relief_fill(job->residual, width, job->grid.height, job->progress);
    for (int64_t i = 0; i < cells && !error && !is_over(job, i); i++)
        job->residual[i] += (float)pt_relief_at(&job->under, ((double)(i % width) + 0.5) * job->grid.cell,
                                                ((double)(i / width) + 0.5) * job->grid.cell);
    return error;
}

static int find_ground(struct job *job, struct pt_pool *pool, double largest)
{
    const size_t cells = (size_t)(job->grid.width * job->grid.height);
    int error = PATINA_OK;
    job->least = malloc(cells * sizeof *job->least);
    job->left_out = calloc((size_t)job->places.count, 1);
    if (!job->least || !job->left_out)
        error = PATINA_ERROR_MEMORY;
    // Strays above a plane first, where slopes of 45 degrees are no strays; then above the surface, where what is left of them shows.
    for (int round = 0; round < 2 && !error; round++) {
        error = leave_out_strays(job, pool, round ? job->threshold : STRAY_CELLS * job->grid.cell);
        free(job->under.z);
        job->under.z = NULL;
        if (!error)
            error = coarse_surface(job, pool, largest, 0.3 * round, 0.3 * round + 0.3);
    }
    if (!error)
        error = fine_surface(job, pool);
    if (!error) {
        free(job->under.z);
        job->under = job->grid;
        job->under.z = job->residual;
        job->residual = NULL;
        pt_progress_raise(job->progress, 0.8);
        visit_points(job, pool, 1, tell_height);
        error = pt_progress_cancelled(job->progress) ? PATINA_ERROR_CANCELLED : PATINA_OK;
    }
    free((void *)job->least);
    free(job->left_out);
    free((void *)job->band);
    free(job->residual);
    free(job->under.z);
    return error;
}

// ---- the call --------------------------------------------------------------------------------------------------------------------

static int check(const char *call, patina_ground_desc *desc, struct pt_places *places)
{
    *places = (struct pt_places){.array = desc->position, .count = desc->count};
    if (!pt_is_length(desc->cell) || !pt_is_length(desc->threshold) || !pt_is_length(desc->largest))
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s: cell, threshold and largest have to be 0 or more, and finite", call);
    return pt_places_check(call, "the cloud", places);
}

int patina_ground_defaults(patina_ground_desc *desc)
{
    static const char call[] = "patina_ground_defaults";
    patina_ground_desc taken;
    struct pt_places places;
    if (!desc)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s: desc is NULL", call);
    int error = pt_take(NULL, call, desc, &taken, sizeof taken);
    if (!error)
        error = check(call, &taken, &places);
    if (!error)
        error = set_defaults(call, &taken, &places);
    if (error)
        return error;
    taken.position = desc->position;
    return pt_give(NULL, call, &taken, sizeof taken, desc);
}

int patina_ground(const patina_ground_desc *given, patina_progress *progress, float *height, uint8_t *ground)
{
    static const char call[] = "patina_ground";
    patina_ground_desc desc;
    struct job job = {.progress = progress, .times = 1};
    double middle[3];
    if (!given)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s: desc is NULL", call);
    int error = pt_take(NULL, call, given, &desc, sizeof desc);
    if (!error)
        error = check(call, &desc, &job.places);
    if (!error && desc.count && !height)
        error = pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s: height is NULL", call);
    if (error || !desc.count)
        return error;
    const size_t count = (size_t)desc.count;
    struct pt_pool *pool = NULL;
    job.height = malloc(count * sizeof *job.height);
    job.ground = calloc(count, 1);
    for (size_t i = 0; i < count && job.height; i++)
        job.height[i] = NAN;
    if (!job.height || !job.ground) {
        error = PATINA_ERROR_MEMORY;
    } else if (pt_places_middle(&job.places, middle)) { // else no point is finite
        error = set_defaults(call, &desc, &job.places);
        if (!error)
            error = make_grid(&job, desc.cell);
        if (!error && !(pool = pt_pool_create(pt_pool_threads_for(desc.threads, desc.count), 0)))
            error = PATINA_ERROR_MEMORY;
        job.threshold = desc.threshold;
        if (!error)
            error = find_ground(&job, pool, desc.largest);
    }
    if (!error) {
        memcpy(height, job.height, count * sizeof *height);
        if (ground)
            memcpy(ground, job.ground, count);
        pt_progress_set(progress, 1);
    }
    pt_pool_destroy(pool);
    free(job.height);
    free(job.ground);
    return error == PATINA_ERROR_MEMORY || error == PATINA_ERROR_CANCELLED
               ? pt_fail(NULL, error, "%s: %s", call, patina_error_text(error))
               : error;
}
