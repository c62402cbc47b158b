// SPDX-License-Identifier: GPL-3.0-or-later
// A station's grid lies over azimuth and elevation, a cell as wide as its directions are apart, so that each direction has
// about one; scanners turn about the vertical, hence no cell is starved where they look steeply up. A cell holds the nearest
// of its samples. One grid at a time; every sum and minimum is of integers, so that threads do not show.
#include "free_space.h"
#include "base/platform.h"
#include "base/progress.h"
#include "base/elementary.h"
#include "shared/words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

// Of a grid: 128 MiB. Directions closer than that share cells, which hold the nearest all the same.
enum { COLUMNS_MOST = 8192, ROWS_MOST = 4096 };
// Of the 3 x 3 cells around a direction that must be filled: beside what did not return, nothing is known.
enum { FILLED_LEAST = 5 };
static const double farther_share = 0.01; // of the range: what registration and a slope within a cell may be off by
static const double farther_sigmas = 3.0;
// Of a shape word, while stations are asked: one of them has a sample beside the point. Bars and leaves are missed by some of
// a station's directions and met by another's.
#define MET (1u << 30)

struct look { // of one station
    struct pt_free_space *job;
    const patina_array *station;
    uint32_t number;
    double eye[3];
    uint32_t across, up; // cells
    double cell[2];      // radians
    atomic_uint *grid;   // float bits of the nearest range; +inf: none
    double farthest;
    atomic_uint farthest_bits;
    struct pt_sight_builder sight; // the same for pictures; without cells where none is asked for
};

struct sight { // of a place, from a station
    double range, azimuth, elevation;
};

// ---- points ----------------------------------------------------------------------------------------------------------------

static uint32_t station_at(const patina_array *array, uint64_t number)
{
    const char *at = (const char *)array->data + number * array->stride;
    uint16_t wide;
    if (array->type == PATINA_UINT8)
        return *(const uint8_t *)at;
    memcpy(&wide, at, sizeof wide);
    return wide;
}

static struct sight sight_of(const struct look *look, const struct pt_chunk *chunk, uint32_t i)
{
    double v[3];
    pt_point_place(look->job->cloud, chunk, i, v);
    for (size_t k = 0; k < 3; k++)
        v[k] -= look->eye[k];
    const double flat = v[0] * v[0] + v[1] * v[1];
    return (struct sight){sqrt(flat + v[2] * v[2]), pt_atan2(v[1], v[0]), pt_atan2(v[2], sqrt(flat))};
}

static int is_own(const struct look *look, const struct pt_chunk *chunk, uint32_t i)
{
    return station_at(look->station, pt_number_of(look->job->cloud, chunk->first + i)) == look->number;
}

// ---- the grid ----------------------------------------------------------------------------------------------------------------

static void least(atomic_uint *word, uint32_t bits)
{
    uint32_t seen = atomic_load_explicit(word, memory_order_relaxed);
    while (bits < seen && !atomic_compare_exchange_weak_explicit(word, &seen, bits, memory_order_relaxed, memory_order_relaxed))
        ;
}

static uint32_t bits_of(double range)
{
    const float f = (float)range;
    uint32_t bits;
    memcpy(&bits, &f, sizeof bits);
    return bits;
}

static void cell_of(const struct look *look, const struct sight *at, uint32_t *x, uint32_t *y)
{
    *x = (uint32_t)((at->azimuth + PI) / look->cell[0]) % look->across;
    *y = (uint32_t)((at->elevation + 0.5 * PI) / look->cell[1]);
    *y = *y < look->up ? *y : look->up - 1;
}

static void add_sight(struct look *look, const struct sight *at)
{
    const double flat = pt_cos(at->elevation);
    pt_sight_add(&look->sight, (double[]){flat * pt_cos(at->azimuth), flat * pt_sin(at->azimuth), pt_sin(at->elevation)},
                 at->range);
}

static void fill_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct look *look = context;
    uint32_t farthest = 0, x, y;
    (void)thread;
    for (uint32_t c = begin; c < end && !pt_progress_cancelled(look->job->progress); c++) {
        const struct pt_chunk *chunk = &look->job->cloud->chunks[c];
        for (uint32_t i = 0; i < chunk->count; i++) {
            if (!is_own(look, chunk, i))
                continue;
            const struct sight at = sight_of(look, chunk, i);
            const uint32_t bits = bits_of(at.range);
            cell_of(look, &at, &x, &y);
            least(&look->grid[(size_t)y * look->across + x], bits);
            if (look->sight.nearest)
                add_sight(look, &at);
            farthest = bits > farthest ? bits : farthest;
        }
    }
    uint32_t seen = atomic_load(&look->farthest_bits);
    while (farthest > seen && !atomic_compare_exchange_weak(&look->farthest_bits, &seen, farthest))
        ;
}

static void clear_rows(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct look *look = context;
    (void)thread;
    for (size_t i = (size_t)begin * look->across; i < (size_t)end * look->across; i++)
        atomic_init(&look->grid[i], PT_KEY_EMPTY_Z);
}

// ---- what it saw through -----------------------------------------------------------------------------------------------------

// What the 3 x 3 cells around (x, y) say of a point at `range`: PT_SHAPE_SEEN_THROUGH where the nearest of them lies farther by
// more than `by`, MET where some is no farther off than that, 0: nothing.
static uint32_t look_around(const struct look *look, uint32_t x, uint32_t y, double range, double by)
{
    const uint32_t columns[3] = {(x + look->across - 1) % look->across, x, (x + 1) % look->across};
    uint32_t filled = 0, farther = 0;
    for (uint32_t row = y ? y - 1 : 0; row <= y + 1 && row < look->up; row++)
        for (int k = 0; k < 3; k++) {
            const uint32_t bits = atomic_load_explicit(&look->grid[(size_t)row * look->across + columns[k]],
                                                       memory_order_relaxed);
            float met;
            memcpy(&met, &bits, sizeof met);
            if (fabs((double)met - range) <= by)
                return MET;
            filled += bits != PT_KEY_EMPTY_Z;
            farther += bits != PT_KEY_EMPTY_Z && (double)met > range;
        }
    return filled >= FILLED_LEAST && farther == filled ? PT_SHAPE_SEEN_THROUGH : 0;
}

// By how much farther than a point the nearest must lie: by its surface's thickness, by the way to the next sample there, and
// by a share of the range.
static double farther_by(const struct look *look, const struct sight *at, uint32_t shape)
{
    const uint32_t kind = PT_SHAPE_KIND(shape);
    const double sigma = look->job->spacing_base / 16.0 * pt_spacing_of_class(shape >> PT_SHAPE_SIGMA_SHIFT & 63u);
    const double step = fmax(look->cell[0] * pt_cos(at->elevation), look->cell[1]);
    const double thick = kind == PT_KIND_SURFACE || kind == PT_KIND_BORDER ? farther_sigmas * sigma : 0.0;
    return fmax(thick, at->range * fmax(step, farther_share));
}

// Whether all of the chunk lies beyond what the station saw.
static int is_beyond(const struct look *look, const struct pt_chunk *chunk)
{
    double square = 0.0;
    for (int k = 0; k < 3; k++) {
        const double low = chunk->origin[k] + (double)chunk->box_min[k] - look->eye[k];
        const double high = chunk->origin[k] + (double)chunk->box_max[k] - look->eye[k];
        const double way = fmax(fmax(low, -high), 0.0);
        square += way * way;
    }
    return square > look->farthest * look->farthest;
}

static void judge_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct look *look = context;
    uint32_t x, y;
    (void)thread;
    for (uint32_t c = begin; c < end && !pt_progress_cancelled(look->job->progress); c++) {
        const struct pt_chunk *chunk = &look->job->cloud->chunks[c];
        uint32_t *shapes = look->job->shapes + chunk->first;
        for (uint32_t i = 0; i < chunk->count && !is_beyond(look, chunk); i++) {
            if ((shapes[i] & MET) || is_own(look, chunk, i))
                continue;
            const struct sight at = sight_of(look, chunk, i);
            cell_of(look, &at, &x, &y);
            shapes[i] |= look_around(look, x, y, at.range, farther_by(look, &at, shapes[i]));
        }
    }
}

static uint64_t settle(const struct pt_free_space *job)
{
    uint64_t marked = 0;
    for (uint32_t c = 0; c < job->cloud->chunk_count; c++) {
        const struct pt_chunk *chunk = &job->cloud->chunks[c];
        uint32_t *shapes = job->shapes + chunk->first;
        for (uint32_t i = 0; i < chunk->count; i++) {
            shapes[i] &= shapes[i] & MET ? ~(MET | PT_SHAPE_SEEN_THROUGH) : ~0u;
            marked += (shapes[i] & PT_SHAPE_SEEN_THROUGH) != 0;
        }
        pt_store_look(job->store);
        for (uint32_t i = chunk->count; i < chunk->padded; i++)
            shapes[i] = shapes[chunk->count - 1];
    }
    return marked;
}

// ---- stations ----------------------------------------------------------------------------------------------------------------

static struct look look_from(struct pt_free_space *job, uint32_t number)
{
    struct look look = {.job = job, .station = &job->desc->station, .number = number};
    memcpy(look.eye, job->desc->stations + 3 * (size_t)number, sizeof look.eye);
    return look;
}

static int look_through(struct look *look, struct pt_pool *pool)
{
    const struct pt_interval *interval = &look->job->beams->each[look->number].interval;
    if (!(interval->azimuth > 0.0))
        return PATINA_OK;
    look->across = (uint32_t)fmin(fmax(floor(2.0 * PI / interval->azimuth + 0.5), 4.0), COLUMNS_MOST);
    look->up = (uint32_t)fmin(fmax(floor(PI / interval->elevation + 0.5), 2.0), ROWS_MOST);
    look->cell[0] = 2.0 * PI / look->across;
    look->cell[1] = PI / look->up;
    const size_t bytes = (size_t)look->across * look->up * sizeof *look->grid;
    look->grid = pt_store_alloc(pt_store_is_small(look->job->store, bytes) ? NULL : look->job->store, bytes);
    if (!look->grid)
        return PATINA_ERROR_MEMORY;
    if (look->job->sights) {
        const double widest = fmax(interval->azimuth, interval->elevation), share = fmax(widest, farther_share);
        if (pt_sight_begin(&look->sight, look->eye, pt_sight_across(widest, look->job->desc->station_count), share)) {
            pt_store_free(look->job->store, look->grid, bytes);
            return PATINA_ERROR_MEMORY;
        }
    }
    pt_parallel(pool, look->up, 64, clear_rows, look);
    pt_parallel(pool, look->job->cloud->chunk_count, 4, fill_chunks, look);
    const uint32_t bits = look->farthest_bits;
    float farthest;
    memcpy(&farthest, &bits, sizeof farthest);
    look->farthest = (double)farthest;
    pt_parallel(pool, look->job->cloud->chunk_count, 4, judge_chunks, look);
    pt_store_free(look->job->store, look->grid, bytes);
    if (look->job->sights)
        pt_sight_end(&look->sight, look->farthest, look->job->sights);
    return PATINA_OK;
}

// Room for what every station saw, as cells are as fine as the finest of them asks for.
static int reserve_sights(const struct pt_free_space *job)
{
    uint32_t across = 1;
    for (uint32_t s = 0; s < job->beams->count; s++) {
        const struct pt_interval *interval = &job->beams->each[s].interval;
        const double widest = fmax(interval->azimuth, interval->elevation);
        const uint32_t wanted = widest > 0.0 ? pt_sight_across(widest, job->beams->count) : 1;
        across = wanted > across ? wanted : across;
    }
    return job->beams->count ? pt_sights_reserve(job->sights, job->beams->count, across) : PATINA_OK;
}

int pt_free_space_check(const patina_analysis_desc *desc)
{
    if (!desc->free_space)
        return PATINA_OK;
    if (desc->free_space > 1)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "free space: free_space is 0 or 1");
    if (!desc->station_count || !desc->stations)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "free space: the places of the stations are not known (stations)");
    if (!desc->station.data)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "free space: which station each point is of is not known (station)");
    return PATINA_OK;
}

int pt_free_space_mark(struct pt_free_space *free_space, struct pt_pool *pool)
{
    const patina_analysis_desc *desc = free_space->desc;
    int error = free_space->sights ? reserve_sights(free_space) : PATINA_OK;
    free_space->marked = 0;
    for (uint64_t i = 0; i < free_space->cloud->slots; i++) {
        free_space->shapes[i] &= ~(PT_SHAPE_SEEN_THROUGH | MET);
        if (i % PT_CHUNK_POINTS == 0)
            pt_store_look(free_space->store);
    }
    for (uint32_t s = 0; s < desc->station_count && !error; s++) {
        struct look look = look_from(free_space, s);
        error = look_through(&look, pool);
        if (!error && pt_progress_cancelled(free_space->progress))
            error = PATINA_ERROR_CANCELLED;
        pt_progress_raise(free_space->progress,
                          free_space->begin + (free_space->end - free_space->begin) * (s + 1) / desc->station_count);
    }
    free_space->marked = settle(free_space);
    return error;
}
