// SPDX-License-Identifier: GPL-3.0-or-later
// P. Axelsson, DEM generation from laser scanner data using adaptive TIN models, 2000: the ground grows from few sure points to those that
// are near its surface. Here the surface is a grid in place of triangles, and surer points are the lowest ones of larger cells.
#include "relief.h"
#include "base/pool.h"
#include "base/progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FIRST_ROUNDS = 4, ROUNDS = 2, SWEEPS = 4, LOOK = 1 << 16 }; // LOOK: cells between two looks at a cancel

#define SLOPE 0.1
#define STEP 0.7
#define CAP 3.0
#define FREE 4.5 // thresholds: on cells up to this width steps are so small that nothing but ground grows, however high
#define STEEPEST 2.0
#define PIT_PEERS 2    // neighbors that a deep cell needs
#define COARSE_LEAST 3 // cells that the longer side has on the coarsest level

static double limit_of(double cell, double threshold) { return 0.5 * threshold + SLOPE * cell; }

// ---- which cells are ground ---------------------------------------------------------------------------------------------

struct front { // cells that were accepted, whose neighbors are to be looked at
    uint32_t *cell;
    uint64_t count;
};

static void leave_out_pits(float *r, const struct pt_relief *shape, double limit, const struct patina_progress *progress)
{
    for (int64_t y = 0; y < shape->height && !pt_progress_cancelled(progress); y++)
        for (int64_t x = 0; x < shape->width; x++) {
            float *own = r + y * shape->width + x;
            int peers = 0;
            if (!((double)*own < -limit))
                continue;
            for (int64_t j = y > 0 ? y - 1 : 0; j <= y + 1 && j < shape->height; j++)
                for (int64_t i = x > 0 ? x - 1 : 0; i <= x + 1 && i < shape->width; i++)
                    peers += (double)r[j * shape->width + i] <= (double)*own + limit;
            if (peers <= PIT_PEERS) // itself is one
                *own = NAN;
        }
}

// Whether the cell beside an accepted one continues it. behind: the residual on the other side, NaN where that is not accepted.
static int continues(double value, double from, double behind, double limit, double cap, double steepest)
{
    double step = isfinite(behind) ? from - behind : 0;
    step = fmin(fmax(step, -steepest), steepest);
    return value <= cap && (fabs(value - from) <= STEP * limit || fabs(value - from - step) <= STEP * limit);
}

static void grow(const float *r, uint8_t *accepted, const struct pt_relief *shape, double limit, double cap,
                 struct front *front, const struct patina_progress *progress)
{
    static const int ways[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
    const int64_t width = shape->width, height = shape->height;
    for (uint64_t next = 0; next < front->count; next++) {
        const int64_t x = front->cell[next] % width, y = front->cell[next] / width, own = y * width + x;
        if (next % LOOK == 0 && pt_progress_cancelled(progress))
            return;
        for (int way = 0; way < 4; way++) {
            const int64_t i = x + ways[way][0], j = y + ways[way][1], k = x - ways[way][0], l = y - ways[way][1];
            if (i < 0 || j < 0 || i >= width || j >= height || accepted[j * width + i] || !isfinite(r[j * width + i]))
                continue;
            const int has = k >= 0 && l >= 0 && k < width && l < height && accepted[l * width + k];
            if (!continues((double)r[j * width + i], (double)r[own], has ? (double)r[l * width + k] : NAN, limit, cap,
                           STEEPEST * shape->cell))
                continue;
            accepted[j * width + i] = 1;
            front->cell[front->count++] = (uint32_t)(j * width + i);
        }
    }
}

int pt_relief_accept(float *residual, const struct pt_relief *shape, double threshold, const struct patina_progress *progress)
{
    const uint64_t cells = (uint64_t)(shape->width * shape->height);
    const double limit = limit_of(shape->cell, threshold);
    struct front front = {.cell = malloc(cells * sizeof *front.cell)};
    uint8_t *accepted = calloc(cells, 1);
    int error = front.cell && accepted ? PATINA_OK : PATINA_ERROR_MEMORY;
    if (!error) {
        leave_out_pits(residual, shape, limit, progress);
        for (uint64_t i = 0; i < cells && !(i % LOOK == 0 && pt_progress_cancelled(progress)); i++)
            if ((double)residual[i] <= limit) {
                accepted[i] = 1;
                front.cell[front.count++] = (uint32_t)i;
            }
        grow(residual, accepted, shape, limit, shape->cell > FREE * threshold ? CAP * limit : INFINITY, &front, progress);
        for (uint64_t i = 0; i < cells && !(i % LOOK == 0 && pt_progress_cancelled(progress)); i++)
            residual[i] = accepted[i] ? residual[i] : NAN;
        error = pt_progress_cancelled(progress) ? PATINA_ERROR_CANCELLED : PATINA_OK;
    }
    free(front.cell);
    free(accepted);
    return error;
}

// ---- a membrane between what is known ------------------------------------------------------------------------------------

static int64_t half(int64_t size) { return (size + 1) / 2; }

static void halve(const float *values, int64_t width, int64_t height, float *out, const struct patina_progress *progress)
{
    for (int64_t y = 0; y < half(height) && !pt_progress_cancelled(progress); y++)
        for (int64_t x = 0; x < half(width); x++) {
            double sum = 0, count = 0;
            for (int64_t j = 2 * y; j < 2 * y + 2 && j < height; j++)
                for (int64_t i = 2 * x; i < 2 * x + 2 && i < width; i++)
                    if (isfinite(values[j * width + i])) {
                        sum += (double)values[j * width + i];
                        count += 1;
                    }
            out[y * half(width) + x] = count > 0 ? (float)(sum / count) : NAN;
        }
}

static void sweep(float *values, const uint8_t *known, int64_t width, int64_t height, int odd,
                  const struct patina_progress *progress)
{
    for (int64_t y = 0; y < height && !pt_progress_cancelled(progress); y++)
        for (int64_t x = (y + odd) & 1; x < width; x += 2) {
            const int64_t at = y * width + x;
            double sum = 0, count = 0;
            if (known[at])
                continue;
            if (x > 0)
                sum += (double)values[at - 1], count += 1;
            if (x + 1 < width)
                sum += (double)values[at + 1], count += 1;
            if (y > 0)
                sum += (double)values[at - width], count += 1;
            if (y + 1 < height)
                sum += (double)values[at + width], count += 1;
            values[at] = (float)(sum / count);
        }
}

int pt_relief_fill(float *values, int64_t width, int64_t height, const struct patina_progress *progress)
{
    const int64_t cells = width * height;
    int64_t unknown = 0;
    for (int64_t i = 0; i < cells; i++)
        unknown += !isfinite(values[i]); // 0.1 s of 2^26
    if (!unknown)
        return PATINA_OK;
    if (unknown == cells || cells == 1) {
        memset(values, 0, (size_t)cells * sizeof *values);
        return PATINA_OK;
    }
    if (pt_progress_cancelled(progress))
        return PATINA_ERROR_CANCELLED;
    struct pt_relief coarse = {.cell = 2, .width = half(width), .height = half(height)};
    coarse.z = malloc((size_t)(coarse.width * coarse.height) * sizeof *coarse.z);
    uint8_t *known = malloc((size_t)cells);
    int error = coarse.z && known ? PATINA_OK : PATINA_ERROR_MEMORY;
    if (!error) {
        halve(values, width, height, coarse.z, progress);
        error = pt_relief_fill(coarse.z, coarse.width, coarse.height, progress);
    }
    for (int64_t i = 0; i < cells && !error; i++) {
        known[i] = isfinite(values[i]);
        if (!known[i])
            values[i] = (float)pt_relief_at(&coarse, (double)(i % width) + 0.5, (double)(i / width) + 0.5);
        if (i % LOOK == 0 && pt_progress_cancelled(progress))
            error = PATINA_ERROR_CANCELLED;
    }
    for (int i = 0; i < 2 * SWEEPS && !error; i++) {
        sweep(values, known, width, height, i & 1, progress);
        error = pt_progress_cancelled(progress) ? PATINA_ERROR_CANCELLED : PATINA_OK;
    }
    free(coarse.z);
    free(known);
    return error;
}

// ---- levels ----------------------------------------------------------------------------------------------------------------

struct level {
    const struct pt_lowest *lowest;
    const struct pt_relief *fine, *coarser; // fine: the cells of `lowest`
    struct pt_relief own;
    int64_t times; // its cells are as wide as so many fine ones
    float *residual;
    const struct patina_progress *progress;
};

static void find_residuals(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct level *level = context;
    const int64_t width = level->own.width;
    (void)thread;
    for (int64_t y = begin; y < end && !pt_progress_cancelled(level->progress); y++) {
        float *row = level->residual + y * width;
        for (int64_t x = 0; x < width; x++)
            row[x] = NAN;
        for (int64_t j = y * level->times; j < (y + 1) * level->times && j < level->fine->height; j++)
            for (int64_t i = 0; i < level->fine->width; i++) {
                const struct pt_lowest *p = &level->lowest[j * level->fine->width + i];
                if (!isfinite(p->z))
                    continue;
                const double above = (double)p->z - pt_relief_at(level->coarser, (double)p->x, (double)p->y);
                float *least = &row[i / level->times];
                if (!((double)*least <= above))
                    *least = (float)above;
            }
    }
}

// Takes the residuals for the surface, which the next round begins with.
static void raise_surface(struct level *level)
{
    for (int64_t y = 0; y < level->own.height && !pt_progress_cancelled(level->progress); y++)
        for (int64_t x = 0; x < level->own.width; x++) {
            const int64_t at = y * level->own.width + x;
            const double cell = level->own.cell;
            level->residual[at] += (float)pt_relief_at(level->coarser, ((double)x + 0.5) * cell, ((double)y + 0.5) * cell);
        }
    float *const kept = level->own.z;
    level->own.z = level->residual;
    level->residual = kept;
}

static int run_level(struct level *level, const struct pt_relief *coarser, int first, double threshold, struct pt_pool *pool)
{
    const size_t cells = (size_t)(level->own.width * level->own.height);
    level->own.z = malloc(cells * sizeof *level->own.z);
    level->residual = malloc(cells * sizeof *level->residual);
    int error = level->own.z && level->residual ? PATINA_OK : PATINA_ERROR_MEMORY;
    level->coarser = coarser;
    for (int round = 0; round < (first ? FIRST_ROUNDS : ROUNDS) && !error; round++) {
        pt_parallel(pool, (uint32_t)level->own.height, 0, find_residuals, level);
        if (!first)
            error = pt_relief_accept(level->residual, &level->own, threshold, level->progress);
        if (!error)
            error = pt_relief_fill(level->residual, level->own.width, level->own.height, level->progress);
        if (!error)
            raise_surface(level);
        level->coarser = &level->own;
    }
    free(level->residual);
    level->residual = NULL;
    return error;
}

int pt_relief_find(const struct pt_lowest *lowest, const struct pt_relief *shape, double largest, double threshold,
                   struct pt_pool *pool, struct patina_progress *progress, double begin, double end, struct pt_relief *out)
{
    float flat = 0;
    struct pt_relief coarser = {.cell = 1, .width = 1, .height = 1, .z = &flat};
    const int64_t longer = shape->width > shape->height ? shape->width : shape->height;
    int64_t times = 2;
    int first = 1, error = PATINA_OK;
    while (times * shape->cell < largest && COARSE_LEAST * 2 * times <= longer)
        times *= 2;
    for (; times >= 2 && !error; times /= 2, first = 0) {
        struct level level = {.lowest = lowest, .fine = shape, .times = times, .progress = progress};
        level.own = (struct pt_relief){.cell = shape->cell * (double)times,
                                       .width = (shape->width + times - 1) / times,
                                       .height = (shape->height + times - 1) / times};
        error = run_level(&level, &coarser, first, threshold, pool);
        if (!first)
            free(coarser.z);
        coarser = level.own;
        pt_progress_raise(progress, begin + (end - begin) / (double)times);
    }
    if (error)
        free(coarser.z == &flat ? NULL : coarser.z);
    else
        *out = coarser;
    return error;
}
