// SPDX-License-Identifier: GPL-3.0-or-later
#include "cells.h"
#include "base/pool.h"
#include "base/progress.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#define REACH 1048576.0 // cells to each side of the middle: keys have at most 63 bits

enum { DIGIT = 11, PIECE = 1 << 16 };

struct entry {
    uint64_t key;
    uint32_t number;
};

struct fill {
    const struct pt_places *places;
    struct patina_progress *progress;
    struct entry *entries;
    struct pt_cells *cells;
    double middle[3];
    _Atomic int64_t low[3], high[3]; // cells from the middle; high: negated
    uint64_t none;                   // key of points that are left out
};

static void lower(_Atomic int64_t *at, int64_t value)
{
    int64_t seen = atomic_load_explicit(at, memory_order_relaxed);
    while (value < seen && !atomic_compare_exchange_weak(at, &seen, value))
        ;
}

static int cell_of(const struct fill *fill, uint64_t i, int64_t cell[3])
{
    double p[3];
    if (!pt_place(fill->places, i, p))
        return 0;
    for (int k = 0; k < 3; k++) {
        const double at = floor((p[k] - fill->middle[k]) / fill->cells->edge);
        if (!(fabs(at) < REACH))
            return 0;
        cell[k] = (int64_t)at;
    }
    return 1;
}

static void find_extent(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct fill *fill = context;
    int64_t low[3] = {INT64_MAX, INT64_MAX, INT64_MAX}, high[3] = {INT64_MIN + 1, INT64_MIN + 1, INT64_MIN + 1}, cell[3];
    (void)thread;
    for (uint64_t i = (uint64_t)begin * PIECE; i < (uint64_t)end * PIECE && i < fill->places->count; i++) {
        if (i % PIECE == 0 && pt_progress_cancelled(fill->progress))
            return;
        if (!cell_of(fill, i, cell))
            continue;
        for (int k = 0; k < 3; k++) {
            low[k] = cell[k] < low[k] ? cell[k] : low[k];
            high[k] = cell[k] > high[k] ? cell[k] : high[k];
        }
    }
    for (int k = 0; k < 3; k++) {
        lower(&fill->low[k], low[k]);
        lower(&fill->high[k], -high[k]);
    }
}

static void fill_entries(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct fill *fill = context;
    const int64_t *size = fill->cells->size;
    int64_t cell[3];
    (void)thread;
    for (uint64_t i = (uint64_t)begin * PIECE; i < (uint64_t)end * PIECE && i < fill->places->count; i++) {
        if (i % PIECE == 0 && pt_progress_cancelled(fill->progress))
            return;
        uint64_t key = fill->none;
        if (cell_of(fill, i, cell))
            key = (uint64_t)(cell[0] - fill->low[0] + size[0] * (cell[1] - fill->low[1] + size[1] * (cell[2] - fill->low[2])));
        fill->entries[i] = (struct entry){key, (uint32_t)i};
    }
}

// Stable counting sorts, digit by digit from the lowest. Returns the array that has the result.
static struct entry *sort(struct entry *from, struct entry *to, uint64_t count, uint64_t most,
                          const struct patina_progress *progress)
{
    for (uint32_t shift = 0; shift < 64 && most >> shift; shift += DIGIT) {
        uint32_t first[1 << DIGIT] = {0}, sum = 0;
        for (uint64_t i = 0; i < count; i++)
            first[from[i].key >> shift & ((1 << DIGIT) - 1)]++;
        for (uint32_t d = 0; d < 1 << DIGIT; d++) {
            const uint32_t own = first[d];
            first[d] = sum;
            sum += own;
        }
        for (uint64_t i = 0; i < count; i++) {
            if (i % PIECE == 0 && pt_progress_cancelled(progress))
                return from;
            to[first[from[i].key >> shift & ((1 << DIGIT) - 1)]++] = from[i];
        }
        struct entry *const kept = from;
        from = to;
        to = kept;
    }
    return from;
}

static void fill_offsets(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct fill *fill = context;
    struct pt_cells *cells = fill->cells;
    (void)thread;
    for (uint64_t i = (uint64_t)begin * PIECE; i < (uint64_t)end * PIECE && i < cells->count; i++) {
        if (i % PIECE == 0 && pt_progress_cancelled(fill->progress))
            return;
        const struct entry *entry = &fill->entries[i];
        const int64_t cell[3] = {(int64_t)entry->key % cells->size[0], (int64_t)entry->key / cells->size[0] % cells->size[1],
                                 (int64_t)entry->key / cells->size[0] / cells->size[1]};
        double p[3];
        pt_place(fill->places, entry->number, p);
        cells->number[i] = entry->number;
        for (int k = 0; k < 3; k++)
            cells->offset[3 * i + (uint64_t)k] = (float)(p[k] - (cells->low[k] + (double)cell[k] * cells->edge));
    }
}

static int fill_table(struct pt_cells *cells, const struct entry *entries)
{
    uint64_t occupied = 0, room = 16;
    for (uint32_t i = 0; i < cells->count; i++)
        occupied += !i || entries[i].key != entries[i - 1].key;
    while (room < 2 * occupied)
        room *= 2;
    cells->table = calloc(room, sizeof *cells->table);
    cells->table_mask = room - 1;
    if (!cells->table)
        return PATINA_ERROR_MEMORY;
    for (uint32_t first = 0, end; first < cells->count; first = end) {
        const uint64_t key = entries[first].key;
        for (end = first + 1; end < cells->count && entries[end].key == key;)
            end++;
        uint64_t at = pt_cells_hash(key) & cells->table_mask;
        while (cells->table[at].count)
            at = (at + 1) & cells->table_mask;
        cells->table[at] = (struct pt_cell){key, first, end - first};
    }
    return PATINA_OK;
}

static int fill_cells(struct fill *fill, struct pt_pool *pool, double begin, double end)
{
    struct pt_cells *cells = fill->cells;
    const uint64_t count = fill->places->count;
    const uint32_t pieces = (uint32_t)((count + PIECE - 1) / PIECE);
    struct entry *room = malloc((count + 1) * sizeof *room), *more = malloc((count + 1) * sizeof *more);
    int error = room && more ? PATINA_OK : PATINA_ERROR_MEMORY;
    fill->entries = room;
    if (!error) {
        pt_parallel(pool, pieces, 1, fill_entries, fill);
        pt_progress_raise(fill->progress, begin + 0.2 * (end - begin));
        fill->entries = sort(room, more, count, fill->none, fill->progress);
        pt_progress_raise(fill->progress, begin + 0.7 * (end - begin));
        for (uint64_t i = count; i > 0 && fill->entries[i - 1].key == fill->none; i--)
            cells->count = (uint32_t)(i - 1);
        error = pt_progress_cancelled(fill->progress) ? PATINA_ERROR_CANCELLED : PATINA_OK;
    }
    if (!error) {
        cells->number = malloc((cells->count + 1) * sizeof *cells->number);
        cells->offset = malloc((3 * (size_t)cells->count + 1) * sizeof *cells->offset);
        error = cells->number && cells->offset ? fill_table(cells, fill->entries) : PATINA_ERROR_MEMORY;
    }
    if (!error) {
        pt_parallel(pool, pieces, 1, fill_offsets, fill);
        error = pt_progress_cancelled(fill->progress) ? PATINA_ERROR_CANCELLED : PATINA_OK;
    }
    free(room);
    free(more);
    return error;
}

int pt_cells_create(struct pt_cells *cells, const struct pt_places *places, double edge, struct pt_pool *pool,
                    struct patina_progress *progress, double begin, double end)
{
    struct fill fill = {.places = places, .progress = progress, .cells = cells};
    *cells = (struct pt_cells){.edge = edge, .count = (uint32_t)places->count, .size = {1, 1, 1}};
    if (!pt_places_middle(places, fill.middle)) {
        cells->count = 0;
        return fill_table(cells, NULL);
    }
    for (int k = 0; k < 3; k++) {
        atomic_init(&fill.low[k], INT64_MAX);
        atomic_init(&fill.high[k], INT64_MAX);
    }
    pt_parallel(pool, (uint32_t)((places->count + PIECE - 1) / PIECE), 1, find_extent, &fill);
    if (pt_progress_cancelled(progress))
        return PATINA_ERROR_CANCELLED;
    fill.none = 1;
    for (int k = 0; k < 3; k++) {
        if (fill.low[k] > -fill.high[k]) { // the middle is too far from each point, as between two
            cells->count = 0;
            return fill_table(cells, NULL);
        }
        cells->size[k] = -fill.high[k] - fill.low[k] + 1;
        cells->low[k] = fill.middle[k] + (double)fill.low[k] * cells->edge;
        fill.none *= (uint64_t)cells->size[k];
    }
    const int error = fill_cells(&fill, pool, begin, end);
    if (error)
        pt_cells_destroy(cells);
    return error;
}

void pt_cells_destroy(struct pt_cells *cells)
{
    free(cells->number);
    free(cells->offset);
    free(cells->table);
    *cells = (struct pt_cells){0};
}
