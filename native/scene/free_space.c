// SPDX-License-Identifier: GPL-3.0-or-later
// A station's grid lies over azimuth and elevation, a cell as wide as its directions are apart, so that each direction has
// about one; scanners turn about the vertical, hence no cell is starved where they look steeply up. A cell holds the nearest
// of its samples. One grid at a time; every sum and minimum is of integers, so that threads do not show.
#include "free_space.h"
#include "kernel_args.h"
#include "memory.h"
#include "progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

// Of a grid: 128 MiB. Directions closer than that share cells, which hold the nearest all the same.
enum { COLUMNS_MOST = 8192, ROWS_MOST = 4096, LINES_MOST = 1 << 16 };
// Density is counted in bins of a quarter degree, joined until so many samples lie in the middling one.
enum { BINS_ROUND = 1440, BINS_UP = 720, BIN_LEVELS = 6, BIN_SAMPLES = 16 };
// Of the 3 x 3 cells around a direction that must be filled: beside what did not return, nothing is known.
enum { FILLED_LEAST = 5 };
static const double farther_share = 0.01; // of the range: what registration and a slope within a cell may be off by
static const double farther_sigmas = 3.0;
// Of a shape word, while stations are asked: one of them has a sample beside the point. Bars and leaves are missed by some of
// a station's directions and met by another's.
#define MET (1u << 30)

struct lines { // means of rows' elevations and columns' azimuths, in fixed point
    _Atomic int64_t sum[2];
    atomic_uint count;
};

struct look { // of one station
    struct pt_free_space *job;
    const patina_array *station, *row, *column;
    uint32_t number;
    double eye[3];
    atomic_uint *bins;
    struct lines *rows, *columns; // NULL: not told
    atomic_uint beyond;           // a row or column that is none
    uint32_t across, up;          // cells
    double cell[2];               // radians
    atomic_uint *grid;            // float bits of the nearest range; +inf: none
    double farthest;
    atomic_uint farthest_bits;
};

struct sight { // of a place, from a station
    double range, azimuth, elevation;
};

// ---- points ----------------------------------------------------------------------------------------------------------------

static uint32_t value_at(const patina_array *array, uint64_t number)
{
    const char *at = (const char *)array->data + number * array->stride;
    uint32_t wide;
    uint16_t half;
    if (array->type == PATINA_UINT8)
        return *(const uint8_t *)at;
    if (array->type == PATINA_UINT16) {
        memcpy(&half, at, sizeof half);
        return half;
    }
    memcpy(&wide, at, sizeof wide);
    return wide; // below zero: far beyond
}

static struct sight sight_of(const struct look *look, const struct pt_chunk *chunk, uint32_t i)
{
    const float *p = look->job->cloud->positions + 3 * (size_t)chunk->first + i;
    double v[3];
    for (size_t k = 0; k < 3; k++)
        v[k] = chunk->origin[k] + (double)p[k * chunk->padded] - look->eye[k];
    const double flat = v[0] * v[0] + v[1] * v[1];
    return (struct sight){sqrt(flat + v[2] * v[2]), atan2(v[1], v[0]), atan2(v[2], sqrt(flat))};
}

static int is_own(const struct look *look, const struct pt_chunk *chunk, uint32_t i)
{
    return value_at(look->station, look->job->cloud->order[chunk->first + i]) == look->number;
}

static void add(atomic_uint *count)
{
    atomic_fetch_add_explicit(count, 1, memory_order_relaxed);
}

// ---- how far apart directions are --------------------------------------------------------------------------------------------

static void add_line(struct look *look, struct lines *lines, uint32_t index, double x, double y)
{
    if (index >= LINES_MOST) {
        atomic_store_explicit(&look->beyond, 1, memory_order_relaxed);
        return;
    }
    atomic_fetch_add_explicit(&lines[index].sum[0], (int64_t)(x * 0x1p30), memory_order_relaxed);
    atomic_fetch_add_explicit(&lines[index].sum[1], (int64_t)(y * 0x1p30), memory_order_relaxed);
    add(&lines[index].count);
}

static void count_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct look *look = context;
    (void)thread;
    for (uint32_t c = begin; c < end && !pt_progress_cancelled(look->job->progress); c++) {
        const struct pt_chunk *chunk = &look->job->cloud->chunks[c];
        for (uint32_t i = 0; i < chunk->count; i++) {
            if (!is_own(look, chunk, i))
                continue;
            const struct sight at = sight_of(look, chunk, i);
            const uint32_t number = look->job->cloud->order[chunk->first + i];
            uint32_t x = (uint32_t)((at.azimuth + PI) * (BINS_ROUND / (2.0 * PI))) % BINS_ROUND;
            uint32_t y = (uint32_t)((at.elevation + 0.5 * PI) * (BINS_UP / PI));
            add(&look->bins[(y < BINS_UP ? y : BINS_UP - 1) * BINS_ROUND + x]);
            if (!look->rows)
                continue;
            add_line(look, look->rows, value_at(look->row, number), at.elevation, 0.0);
            add_line(look, look->columns, value_at(look->column, number), cos(at.azimuth), sin(at.azimuth));
        }
    }
}

static int compare_words(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// The middling count of bins whose neighbours are filled, too: others hold a border. 0: there are none.
static uint32_t middling(const uint32_t *bins, uint32_t across, uint32_t up, uint32_t *inner)
{
    uint32_t count = 0;
    for (uint32_t y = 1; y + 1 < up; y++)
        for (uint32_t x = 0; x < across; x++) {
            const uint32_t west = (x + across - 1) % across, east = (x + 1) % across, at = y * across;
            int filled = bins[at + x] > 0;
            for (uint32_t row = at - across; row <= at + across && filled; row += across)
                filled = bins[row + west] && bins[row + x] && bins[row + east];
            if (filled)
                inner[count++] = bins[at + x];
        }
    qsort(inner, count, sizeof *inner, compare_words);
    return count ? inner[count / 2] : 0;
}

// From how dense the directions are over azimuth and elevation, alike in both.
static double density_interval(uint32_t *bins, uint32_t *inner)
{
    uint32_t across = BINS_ROUND, up = BINS_UP;
    for (int level = 0;; level++) {
        const uint32_t count = middling(bins, across, up, inner);
        if (count >= BIN_SAMPLES || level + 1 == BIN_LEVELS)
            return count ? 2.0 * PI / across / sqrt(count) : 0.0;
        across /= 2;
        up = up / 2;
        for (uint32_t y = 0; y < up; y++) // in place: what is read lies behind what is written
            for (uint32_t x = 0; x < across; x++) {
                const uint32_t *from = bins + 2 * y * (2 * across) + 2 * x;
                bins[y * across + x] = from[0] + from[1] + from[2 * across] + from[2 * across + 1];
            }
    }
}

// The middling step from one line to the next; 0: too few are filled.
static double line_interval(const struct lines *lines, int round, double *steps)
{
    enum { SAMPLES_LEAST = 8, STEPS_LEAST = 4 };
    uint32_t count = 0;
    for (uint32_t i = 0; i + 1 < LINES_MOST; i++) {
        const struct lines *a = &lines[i], *b = &lines[i + 1];
        if (a->count < SAMPLES_LEAST || b->count < SAMPLES_LEAST)
            continue;
        double step = round ? atan2((double)b->sum[1], (double)b->sum[0]) - atan2((double)a->sum[1], (double)a->sum[0])
                            : ((double)b->sum[0] / b->count - (double)a->sum[0] / a->count) * 0x1p-30;
        step = round && step > PI ? step - 2.0 * PI : round && step < -PI ? step + 2.0 * PI : step;
        steps[count++] = fabs(step);
    }
    qsort(steps, count, sizeof *steps, compare_doubles);
    return count >= STEPS_LEAST ? steps[count / 2] : 0.0;
}

// Where rows and columns say nothing sensible, as of a scanner that does not stand upright, density does.
static double sensible(double told, double found)
{
    return told > 0.25 * found && told < 4.0 * found ? told : found;
}

static int find_interval(struct look *look, struct pt_pool *pool, struct pt_interval *out)
{
    const size_t bin_bytes = sizeof(uint32_t) * BINS_ROUND * BINS_UP, line_bytes = LINES_MOST * sizeof(struct lines);
    const int told = look->row->data && look->column->data;
    uint32_t *inner = malloc(bin_bytes);
    double *steps = malloc(LINES_MOST * sizeof *steps);
    look->bins = calloc(1, bin_bytes);
    look->rows = told ? calloc(1, line_bytes) : NULL;
    look->columns = told ? calloc(1, line_bytes) : NULL;
    int error = inner && steps && look->bins && (!told || (look->rows && look->columns)) ? PATINA_OK
                                                                                         : PATINA_ERROR_MEMORY;
    if (!error) {
        pt_parallel(pool, look->job->cloud->chunk_count, 4, count_chunks, look);
        out->azimuth = out->elevation = density_interval((uint32_t *)look->bins, inner);
        if (told && !look->beyond) {
            out->elevation = sensible(line_interval(look->rows, 0, steps), out->elevation);
            out->azimuth = sensible(line_interval(look->columns, 1, steps), out->azimuth);
        }
    }
    free(steps);
    free(inner);
    free(look->columns);
    free(look->rows);
    free(look->bins);
    return error;
}

// ---- the grid ----------------------------------------------------------------------------------------------------------------

static void least(atomic_uint *word, uint32_t bits)
{
    uint32_t seen = atomic_load_explicit(word, memory_order_relaxed);
    while (bits < seen &&
           !atomic_compare_exchange_weak_explicit(word, &seen, bits, memory_order_relaxed, memory_order_relaxed))
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
    const uint32_t kind = shape >> PT_SHAPE_KIND_SHIFT & 7u;
    const double sigma = look->job->spacing_base / 16.0 * pt_spacing_of_class(shape >> PT_SHAPE_SIGMA_SHIFT & 63u);
    const double step = fmax(look->cell[0] * cos(at->elevation), look->cell[1]);
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
        for (uint32_t i = chunk->count; i < chunk->padded; i++)
            shapes[i] = shapes[chunk->count - 1];
    }
    return marked;
}

// ---- stations ----------------------------------------------------------------------------------------------------------------

static struct look look_from(struct pt_free_space *job, uint32_t number)
{
    struct look look = {
        .job = job, .station = &job->desc->station, .row = &job->desc->row, .column = &job->desc->column};
    look.number = number;
    memcpy(look.eye, job->desc->stations + 3 * (size_t)number, sizeof look.eye);
    return look;
}

static int look_through(struct look *look, struct pt_pool *pool)
{
    struct pt_interval interval;
    int error = find_interval(look, pool, &interval);
    if (error || !(interval.azimuth > 0.0))
        return error;
    look->across = (uint32_t)fmin(fmax(floor(2.0 * PI / interval.azimuth + 0.5), 4.0), COLUMNS_MOST);
    look->up = (uint32_t)fmin(fmax(floor(PI / interval.elevation + 0.5), 2.0), ROWS_MOST);
    look->cell[0] = 2.0 * PI / look->across;
    look->cell[1] = PI / look->up;
    const size_t bytes = (size_t)look->across * look->up * sizeof *look->grid;
    look->grid = pt_pages_alloc(bytes);
    if (!look->grid)
        return PATINA_ERROR_MEMORY;
    pt_parallel(pool, look->up, 64, clear_rows, look);
    pt_parallel(pool, look->job->cloud->chunk_count, 4, fill_chunks, look);
    const uint32_t bits = look->farthest_bits;
    float farthest;
    memcpy(&farthest, &bits, sizeof farthest);
    look->farthest = (double)farthest;
    pt_parallel(pool, look->job->cloud->chunk_count, 4, judge_chunks, look);
    pt_pages_free(look->grid, bytes);
    return PATINA_OK;
}

int pt_free_space_interval(const struct pt_free_space *free_space, struct pt_pool *pool, uint32_t station,
                           struct pt_interval *out)
{
    struct pt_free_space job = *free_space;
    struct look look = look_from(&job, station);
    return find_interval(&look, pool, out) == PATINA_OK && out->azimuth > 0.0;
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
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT,
                       "free space: which station each point is of is not known (station)");
    return PATINA_OK;
}

int pt_free_space_mark(struct pt_free_space *free_space, struct pt_pool *pool)
{
    const patina_analysis_desc *desc = free_space->desc;
    int error = PATINA_OK;
    free_space->marked = 0;
    for (uint64_t i = 0; i < free_space->cloud->slots; i++)
        free_space->shapes[i] &= ~(PT_SHAPE_SEEN_THROUGH | MET);
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
