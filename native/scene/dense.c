// SPDX-License-Identifier: GPL-3.0-or-later
// The core of a cloud is the box between the 5th and the 95th percentile on each axis. A point outside of it is dense where
// others are near: at least eight, and a hundred-thousandth of all, in 3 x 3 x 3 cells, which grow with the distance from
// the core, as the spacing of a scan does. Points are looked at in wide chunks only, whose box is larger than their spacing
// explains, and in small ones: strays lie in those, and a cloud without any is done at once.
#include "dense.h"
#include "base/elementary.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    BINS = 256,        // of a histogram
    PIECES = 8,        // that a chunk's box is spread over
    LEAST_POINTS = 64, // of a chunk that is dense by itself, and of a cloud that may have strays
    NEAR = 8,
    NEAR_SHARE = 100000,
    MOST_SAMPLES = 1 << 21, // that are looked at, else points of the first strata
};
// A chunk of an even surface is at most 2.3 of these wide, of Morton neighbours at a corner of the curve 3.
static const double WIDE = 3.0, SPARSE = 8.0;

struct cell {
    int64_t at[3];
    uint32_t level, count; // count 0: free
};

struct search {
    const struct patina_cloud *cloud;
    double spacing; // that half of the points are below
    uint32_t strata;
    double lower[3], upper[3], width; // of the core
    struct cell *cells;
    uint64_t room, used; // a power of two
};

static int compare(const void *a, const void *b)
{
    const struct pt_chunk *x = *(const struct pt_chunk *const *)a, *y = *(const struct pt_chunk *const *)b;
    return x->spacing != y->spacing ? (x->spacing > y->spacing) - (x->spacing < y->spacing) : (x > y) - (x < y);
}

// Of points, not of chunks: strays may have the most of those.
static int find_spacing(struct search *search)
{
    const struct patina_cloud *cloud = search->cloud;
    const struct pt_chunk **sorted = malloc((cloud->chunk_count + 1) * sizeof *sorted);
    if (!sorted)
        return PATINA_ERROR_MEMORY;
    for (uint32_t c = 0; c < cloud->chunk_count; c++)
        sorted[c] = &cloud->chunks[c];
    qsort(sorted, cloud->chunk_count, sizeof *sorted, compare);
    uint64_t below = 0;
    for (uint32_t c = 0; c < cloud->chunk_count && 2 * below <= cloud->info.drawn; c++) {
        search->spacing = (double)sorted[c]->spacing;
        below += sorted[c]->count;
    }
    free(sorted);
    return PATINA_OK;
}

static int is_wide(const struct search *search, const struct pt_chunk *chunk)
{
    double diagonal = 0.0;
    for (int k = 0; k < 3; k++)
        diagonal += pt_pow((double)chunk->box_max[k] - (double)chunk->box_min[k], 2.0);
    const double spacing = (double)chunk->spacing;
    return chunk->count < LEAST_POINTS || sqrt(diagonal) > WIDE * spacing * sqrt((double)chunk->count) ||
           spacing > SPARSE * search->spacing;
}

static uint32_t samples_of(const struct search *search, const struct pt_chunk *chunk)
{
    return pt_chunk_prefix(chunk, search->strata);
}

static double coordinate(const struct patina_cloud *cloud, const struct pt_chunk *chunk, uint32_t i, int k)
{
    double p[3];
    pt_point_place(cloud, chunk, i, p);
    return p[k];
}

// ---- the core ------------------------------------------------------------------------------------------------------

static void count_into(double bins[BINS + 2], double value, double lower, double upper, double weight)
{
    const double place = (value - lower) / (upper - lower) * BINS;
    bins[place < 0.0 ? 0 : place < BINS ? 1 + (int)place : BINS + 1] += weight;
}

static void fill_bins(const struct search *search, int k, double lower, double upper, double bins[BINS + 2])
{
    memset(bins, 0, (BINS + 2) * sizeof *bins);
    for (uint32_t c = 0; c < search->cloud->chunk_count; c++) {
        const struct pt_chunk *chunk = &search->cloud->chunks[c];
        const double low = chunk->origin[k] + (double)chunk->box_min[k], high = chunk->origin[k] + (double)chunk->box_max[k];
        const uint32_t samples = samples_of(search, chunk);
        if (is_wide(search, chunk))
            for (uint32_t i = 0; i < samples; i++)
                count_into(bins, coordinate(search->cloud, chunk, i, k), lower, upper, (double)chunk->count / samples);
        else
            for (int i = 0; i < PIECES; i++)
                count_into(bins, low + (high - low) * (i + 0.5) / PIECES, lower, upper, (double)chunk->count / PIECES);
    }
}

// Zooms in until the bins are fine beside the core.
static void find_core(struct search *search, int k)
{
    double bins[BINS + 2], lower = search->cloud->info.box_min[k], upper = search->cloud->info.box_max[k];
    for (int round = 0; round < 16 && upper > lower; round++) {
        const double total = (double)search->cloud->info.drawn, bin = (upper - lower) / BINS;
        double below = 0.0;
        int first = BINS, last = 0;
        fill_bins(search, k, lower, upper, bins);
        for (int b = 0; b < BINS + 2; b++) {
            below += bins[b];
            if (below <= 0.05 * total)
                first = b; // of those in the range, from 0, the one after
            if (below < 0.95 * total)
                last = b;
        }
        const double from = lower + (first == BINS ? 0 : first) * bin, to = lower + (last < BINS ? last + 1 : BINS) * bin;
        const int fine = to - from > (upper - lower) / 8.0;
        if (!(to - from < upper - lower)) // nothing left to zoom into
            break;
        lower = from;
        upper = to;
        if (fine)
            break;
    }
    search->lower[k] = lower;
    search->upper[k] = upper;
    search->width = fmax(search->width, upper - lower);
}

// ---- neighbours of points outside of it --------------------------------------------------------------------------------

// The cell of a point; 0 where it lies within the core.
static int cell_of(const struct search *search, const double p[3], struct cell *cell)
{
    double out = 0.0;
    for (int k = 0; k < 3; k++)
        out = fmax(out, fmax(search->lower[k] - p[k], p[k] - search->upper[k]));
    if (!(out > 0.0))
        return 0;
    const double level = fmin(fmax(floor(pt_log2(out / search->width)), 0.0), 100.0);
    const double side = fmax(search->width * pt_exp2(level) / 32.0, SPARSE * search->spacing);
    cell->level = (uint32_t)level;
    cell->count = 1;
    for (int k = 0; k < 3; k++)
        cell->at[k] = (int64_t)floor((p[k] - search->lower[k]) / side);
    return 1;
}

static struct cell *find(struct cell *cells, uint64_t room, const struct cell *wanted)
{
    uint64_t hash = wanted->level;
    for (int k = 0; k < 3; k++)
        hash = (hash ^ (uint64_t)wanted->at[k]) * 0x9E3779B97F4A7C15u;
    for (uint64_t i = hash >> 32;; i++) {
        struct cell *cell = &cells[i & (room - 1)];
        if (!cell->count || (cell->level == wanted->level && !memcmp(cell->at, wanted->at, sizeof cell->at)))
            return cell;
    }
}

static int grow(struct search *search)
{
    const uint64_t room = search->room ? 2 * search->room : 1024;
    struct cell *cells = calloc(room, sizeof *cells);
    if (!cells)
        return PATINA_ERROR_MEMORY;
    for (uint64_t i = 0; i < search->room; i++)
        if (search->cells[i].count)
            *find(cells, room, &search->cells[i]) = search->cells[i];
    free(search->cells);
    search->cells = cells;
    search->room = room;
    return PATINA_OK;
}

static int add(struct search *search, const struct cell *wanted)
{
    if (2 * search->used >= search->room && grow(search))
        return PATINA_ERROR_MEMORY;
    struct cell *cell = find(search->cells, search->room, wanted);
    const uint32_t count = cell->count;
    *cell = *wanted;
    cell->count = count + 1;
    search->used += !count;
    return PATINA_OK;
}

static int add_points(struct search *search)
{
    for (uint32_t c = 0; c < search->cloud->chunk_count; c++) {
        const struct pt_chunk *chunk = &search->cloud->chunks[c];
        for (uint32_t i = 0, n = is_wide(search, chunk) ? samples_of(search, chunk) : 0; i < n; i++) {
            struct cell cell;
            const double p[3] = {coordinate(search->cloud, chunk, i, 0), coordinate(search->cloud, chunk, i, 1),
                                 coordinate(search->cloud, chunk, i, 2)};
            if (cell_of(search, p, &cell) && add(search, &cell))
                return PATINA_ERROR_MEMORY;
        }
    }
    return PATINA_OK;
}

static int is_dense(const struct search *search, const double p[3])
{
    struct cell cell;
    if (!cell_of(search, p, &cell))
        return 1;
    const uint64_t least = (search->cloud->info.drawn >> (PT_STRATA - search->strata)) / NEAR_SHARE;
    uint64_t near = 0;
    for (int i = 0; i < 27; i++) {
        struct cell beside = cell;
        beside.at[0] += i % 3 - 1;
        beside.at[1] += i / 3 % 3 - 1;
        beside.at[2] += i / 9 - 1;
        near += find(search->cells, search->room, &beside)->count;
    }
    return near >= (least > NEAR ? least : NEAR);
}

// ---- boxes -------------------------------------------------------------------------------------------------------------

static void own_box(const struct pt_chunk *chunk, struct pt_dense *box)
{
    for (int k = 0; k < 3; k++) {
        box->lower[k] = chunk->origin[k] + (double)chunk->box_min[k];
        box->upper[k] = chunk->origin[k] + (double)chunk->box_max[k];
    }
}

static void dense_box(const struct search *search, const struct pt_chunk *chunk, struct pt_dense *box)
{
    struct pt_dense found = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    const uint32_t samples = samples_of(search, chunk);
    uint32_t strays = 0;
    for (uint32_t i = 0; i < samples; i++) {
        const double p[3] = {coordinate(search->cloud, chunk, i, 0), coordinate(search->cloud, chunk, i, 1),
                             coordinate(search->cloud, chunk, i, 2)};
        if (!is_dense(search, p)) {
            strays++;
            continue;
        }
        for (int k = 0; k < 3; k++) {
            found.lower[k] = fmin(found.lower[k], p[k]);
            found.upper[k] = fmax(found.upper[k], p[k]);
        }
    }
    if (strays)
        *box = found;
}

int pt_dense_chunks(const struct patina_cloud *cloud, struct pt_dense *boxes)
{
    struct search search = {.cloud = cloud, .strata = PT_STRATA};
    uint64_t wide = 0;
    if (find_spacing(&search))
        return PATINA_ERROR_MEMORY;
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        own_box(&cloud->chunks[c], &boxes[c]);
        wide += is_wide(&search, &cloud->chunks[c]) ? cloud->chunks[c].count : 0;
    }
    if (!wide || cloud->info.drawn < LEAST_POINTS)
        return PATINA_OK;
    while (search.strata > 1 && wide >> (PT_STRATA - search.strata) > MOST_SAMPLES)
        search.strata--;
    for (int k = 0; k < 3; k++)
        find_core(&search, k);
    if (!(search.width > 0.0)) // nearly all of them at one place
        return PATINA_OK;
    const int error = grow(&search) || add_points(&search) ? PATINA_ERROR_MEMORY : PATINA_OK;
    for (uint32_t c = 0; !error && c < cloud->chunk_count; c++)
        if (is_wide(&search, &cloud->chunks[c]))
            dense_box(&search, &cloud->chunks[c], &boxes[c]);
    free(search.cells);
    return error;
}
