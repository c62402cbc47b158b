// SPDX-License-Identifier: GPL-3.0-or-later
// Every sum is of integers, so that threads do not show.
#include "interval.h"
#include "base/compare.h"
#include "base/elementary.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define CLEARLY 0.7 // a grid is an even one, as a depth camera's, where directions then lie so much more alike

// Directions are counted in bins of equal solid angle: so many of the sine of elevation and of azimuth, joined by fours until the
// middling one holds ENOUGH: of 16 samples the lower quartile tells 7 % too little.
enum { RISES = 96, TURNS = 192, BINS = RISES * TURNS, LEVELS = 4, LEAST_SAMPLES = 1000, LEAST_IN_BIN = 8, ENOUGH = 64 };
enum { LINES_MOST = 1 << 16, LINE_SAMPLES = 8, LINE_STEPS = 4 };

struct line { // means of rows' elevations and columns' azimuths, in fixed point
    _Atomic int64_t sum[2];
    atomic_uint count;
};

struct lines {                 // of a station
    atomic_uint rows, columns; // how many; more than LINES_MOST: these words are no grid's
    struct line *row, *column; // NULL: not told
};

struct count {
    const struct patina_cloud *cloud;
    const patina_analysis_desc *desc;
    int told;
    atomic_uint *bins;   // BINS a station
    struct lines *lines; // of each station
};

uint32_t pt_station_of(const patina_analysis_desc *desc, uint32_t number, const double p[3])
{
    if (desc->station.data) {
        const char *at = (const char *)desc->station.data + number * desc->station.stride;
        uint16_t wide;
        uint32_t index = *(const uint8_t *)at;
        if (desc->station.type == PATINA_UINT16) {
            memcpy(&wide, at, sizeof wide);
            index = wide;
        }
        if (index < desc->station_count)
            return index;
    }
    uint32_t nearest = 0;
    double least = INFINITY;
    for (uint32_t s = 0; s < desc->station_count; s++) {
        double square = 0.0;
        for (int k = 0; k < 3; k++)
            square += (desc->stations[3 * s + k] - p[k]) * (desc->stations[3 * s + k] - p[k]);
        nearest = square < least ? s : nearest;
        least = fmin(least, square);
    }
    return nearest;
}

// ---- counting --------------------------------------------------------------------------------------------------------------

uint32_t pt_line_at(const patina_array *array, uint64_t number)
{
    const char *at = (const char *)array->data + number * array->stride;
    uint32_t wide;
    uint16_t half;
    if (array->type == PATINA_UINT16) {
        memcpy(&half, at, sizeof half);
        return half;
    }
    memcpy(&wide, at, sizeof wide);
    return wide; // below zero: far beyond
}

// The station of a point, and the way from there.
static uint32_t look(const struct count *count, const struct pt_chunk *chunk, uint32_t i, double d[3])
{
    double p[3];
    pt_point_place(count->cloud, chunk, i, p);
    const uint32_t s = pt_station_of(count->desc, pt_number_of(count->cloud, chunk->first + i), p);
    for (int k = 0; k < 3; k++)
        d[k] = p[k] - count->desc->stations[3 * s + k];
    return s;
}

static void most(atomic_uint *word, uint32_t value)
{
    uint32_t seen = atomic_load_explicit(word, memory_order_relaxed);
    while (value > seen &&
           !atomic_compare_exchange_weak_explicit(word, &seen, value, memory_order_relaxed, memory_order_relaxed))
        ;
}

static void measure_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct count *count = context;
    double d[3];
    (void)thread;
    for (uint32_t c = begin; c < end; c++) {
        const struct pt_chunk *chunk = &count->cloud->chunks[c];
        for (uint32_t i = 0; i < chunk->count; i++) {
            const uint32_t number = pt_number_of(count->cloud, chunk->first + i);
            struct lines *lines = &count->lines[look(count, chunk, i, d)];
            const uint32_t row = pt_line_at(&count->desc->row, number), column = pt_line_at(&count->desc->column, number);
            most(&lines->rows, row < LINES_MOST ? row + 1 : LINES_MOST + 1);
            most(&lines->columns, column < LINES_MOST ? column + 1 : LINES_MOST + 1);
        }
    }
}

static void add_line(struct line *line, double x, double y)
{
    atomic_fetch_add_explicit(&line->sum[0], (int64_t)(x * 0x1p30), memory_order_relaxed);
    atomic_fetch_add_explicit(&line->sum[1], (int64_t)(y * 0x1p30), memory_order_relaxed);
    atomic_fetch_add_explicit(&line->count, 1, memory_order_relaxed);
}

static void count_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct count *count = context;
    double d[3];
    (void)thread;
    for (uint32_t c = begin; c < end; c++) {
        const struct pt_chunk *chunk = &count->cloud->chunks[c];
        for (uint32_t i = 0; i < chunk->count; i++) {
            const uint32_t number = pt_number_of(count->cloud, chunk->first + i), s = look(count, chunk, i, d);
            const double flat = d[0] * d[0] + d[1] * d[1], length = sqrt(flat + d[2] * d[2]);
            if (!(length > 0.0) || !isfinite(length))
                continue;
            const double rise = 0.5 * RISES * (d[2] / length + 1.0), turn = TURNS * (0.5 + pt_atan2(d[1], d[0]) / (2.0 * PI));
            const uint32_t row = (uint32_t)fmin(rise, RISES - 1.0), column = (uint32_t)fmin(turn, TURNS - 1.0);
            atomic_fetch_add_explicit(&count->bins[(size_t)s * BINS + row * TURNS + column], 1, memory_order_relaxed);
            if (!count->lines[s].row || !(flat > 0.0))
                continue;
            add_line(&count->lines[s].row[pt_line_at(&count->desc->row, number)], pt_atan2(d[2], sqrt(flat)), 0.0);
            add_line(&count->lines[s].column[pt_line_at(&count->desc->column, number)], d[0] / sqrt(flat), d[1] / sqrt(flat));
        }
    }
}

// ---- from density ----------------------------------------------------------------------------------------------------------

// On a grid of equal steps d in elevation and azimuth, N samples in the solid angle W at elevation e: d^2 = W / (N cos(e));
// on an even one d^2 = W / N. Bins that hold an edge of what was seen, or dropped samples, tell too wide a step: the lower quartile
// counts. spread: of the squares, from quartile to quartile. bins: of a level, each 4^level of the first.
static double step_on(const uint32_t *bins, int level, int even, double *squares, double *spread)
{
    const uint32_t rises = RISES >> level, turns = TURNS >> level;
    uint32_t count = 0;
    for (uint32_t b = 0; b < rises * turns; b++) {
        const double sine = (b / turns + 0.5) * 2.0 / rises - 1.0;
        if (bins[b] >= LEAST_IN_BIN)
            squares[count++] = 4.0 * PI / (rises * turns) / (bins[b] * (even ? 1.0 : sqrt(1.0 - sine * sine)));
    }
    *spread = 1.0;
    if (!count)
        return 0.0;
    qsort(squares, count, sizeof *squares, pt_compare_doubles);
    *spread = squares[3 * (size_t)count / 4] / squares[count / 4];
    return sqrt(squares[count / 4]);
}

// Joins bins by fours, in place: what is read lies behind what is written.
static void join(uint32_t *bins, int level)
{
    const uint32_t rises = RISES >> level, turns = TURNS >> level;
    for (uint32_t y = 0; y < rises; y++)
        for (uint32_t x = 0; x < turns; x++) {
            const uint32_t *from = bins + 2 * y * (2 * turns) + 2 * x;
            bins[y * turns + x] = from[0] + from[1] + from[2 * turns] + from[2 * turns + 1];
        }
}

static double middling(const uint32_t *bins, int level, double *room)
{
    const uint32_t all = (RISES >> level) * (TURNS >> level);
    uint32_t count = 0;
    for (uint32_t b = 0; b < all; b++)
        if (bins[b])
            room[count++] = bins[b];
    qsort(room, count, sizeof *room, pt_compare_doubles);
    return count ? room[count / 2] : 0.0;
}

static struct pt_interval from_density(uint32_t *bins, double *room)
{
    uint64_t samples = 0;
    for (uint32_t b = 0; b < BINS; b++)
        samples += bins[b];
    if (samples < LEAST_SAMPLES)
        return (struct pt_interval){0};
    int level = 0;
    while (level + 1 < LEVELS && middling(bins, level, room) < ENOUGH)
        join(bins, ++level);
    double spread, spread_even;
    const double step = step_on(bins, level, 0, room, &spread), step_even = step_on(bins, level, 1, room, &spread_even);
    const int even = spread_even < CLEARLY * spread;
    return (struct pt_interval){even ? step_even : step, even ? step_even : step, even};
}

// ---- from rows and columns -------------------------------------------------------------------------------------------------

// The middling step from one line to the next; 0: too few are filled.
static double line_interval(const struct line *lines, uint32_t count, int round, double *steps)
{
    uint32_t found = 0;
    for (uint32_t i = 0; i + 1 < count; i++) {
        const struct line *a = &lines[i], *b = &lines[i + 1];
        if (a->count < LINE_SAMPLES || b->count < LINE_SAMPLES)
            continue;
        double step = round ? pt_atan2((double)b->sum[1], (double)b->sum[0]) - pt_atan2((double)a->sum[1], (double)a->sum[0])
                            : ((double)b->sum[0] / b->count - (double)a->sum[0] / a->count) * 0x1p-30;
        step = round && step > PI ? step - 2.0 * PI : round && step < -PI ? step + 2.0 * PI : step;
        steps[found++] = fabs(step);
    }
    qsort(steps, found, sizeof *steps, pt_compare_doubles);
    return found >= LINE_STEPS ? steps[found / 2] : 0.0;
}

// Where rows and columns say nothing sensible, as of a scanner that does not stand upright, density does.
static double sensible(double told, double found) { return told > 0.25 * found && told < 4.0 * found ? told : found; }

// Room for the lines of every station that has a grid. 0 without memory.
static int make_lines(const struct count *count)
{
    int good = 1;
    for (uint32_t s = 0; s < count->desc->station_count && good; s++) {
        struct lines *lines = &count->lines[s];
        if (lines->rows > LINES_MOST || lines->columns > LINES_MOST || !lines->rows || !lines->columns)
            continue;
        lines->row = calloc(lines->rows, sizeof *lines->row);
        lines->column = calloc(lines->columns, sizeof *lines->column);
        good = lines->row && lines->column;
    }
    return good;
}

static void settle(const struct count *count, double *room, struct pt_interval *out)
{
    for (uint32_t s = 0; s < count->desc->station_count; s++) {
        const struct lines *lines = &count->lines[s];
        out[s] = from_density((uint32_t *)count->bins + (size_t)s * BINS, room);
        if (!lines->row || out[s].even || !(out[s].azimuth > 0.0))
            continue;
        out[s].elevation = sensible(line_interval(lines->row, lines->rows, 0, room), out[s].elevation);
        out[s].azimuth = sensible(line_interval(lines->column, lines->columns, 1, room), out[s].azimuth);
    }
}

int pt_intervals_find(const struct patina_cloud *cloud, const patina_analysis_desc *desc, struct pt_pool *pool,
                      struct pt_interval *out)
{
    struct count count = {.cloud = cloud, .desc = desc, .told = desc->row.data && desc->column.data};
    const uint32_t stations = desc->station_count;
    double *room = malloc(LINES_MOST * sizeof *room); // more than BINS
    count.bins = calloc((size_t)stations * BINS, sizeof *count.bins);
    count.lines = calloc(stations, sizeof *count.lines);
    int error = room && count.bins && count.lines ? PATINA_OK : PATINA_ERROR_MEMORY;
    if (!error && count.told) {
        pt_parallel(pool, cloud->chunk_count, 4, measure_chunks, &count);
        error = make_lines(&count) ? PATINA_OK : PATINA_ERROR_MEMORY;
    }
    if (!error) {
        pt_parallel(pool, cloud->chunk_count, 4, count_chunks, &count);
        settle(&count, room, out);
    }
    for (uint32_t s = 0; s < stations && count.lines; s++) {
        free(count.lines[s].row);
        free(count.lines[s].column);
    }
    free(count.lines);
    free(count.bins);
    free(room);
    return error;
}
