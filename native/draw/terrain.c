// SPDX-License-Identifier: GPL-3.0-or-later
#include "terrain.h"
#include "base/compare.h"
#include "base/elementary.h"
#include "base/pool.h"
#include "base/progress.h"
#include "base/vector.h"
#include "scene/analysis/analysis.h"
#include "scene/clouds/cloud.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_NODES = 4096, MOST_IN_CELL = 12, MOST_AROUND = 25 * MOST_IN_CELL };
#define CELL_SPACINGS 2.0
#define CELL_ON_PAPER 0.25e-3 // meters
#define KERNEL 0.8            // standard deviation of weights, in cells
#define STEEPEST 0.26         // cosine of the angle from the normal: walls are no ground (75 degrees)
#define LOWEST 0.25           // share of the points around a node that may lie below its first guess
#define BAND_SIGMAS 3.5
#define ROUNDS 4

struct sample {
    float u, v, h; // from the cell's lower left corner, in cells; height, meters
};

struct building {
    const struct pt_draw_plane *plane;
    struct pt_terrain *terrain;
    struct sample *samples; // MOST_IN_CELL a cell; cells are around nodes
    uint8_t *filled;        // of each cell
    patina_progress *progress;
};

// ---- points into cells ---------------------------------------------------------------------------------------------------------

static int is_ground(const struct pt_draw_plane *plane, const patina_cloud *cloud, uint64_t slot, double least_trust)
{
    const uint32_t shape = cloud->shapes[slot], kind = PT_SHAPE_KIND(shape), bits = cloud->surfels[slot] & PT_NORMAL_BITS;
    double normal[3];
    if ((kind != PT_KIND_SURFACE && kind != PT_KIND_BORDER) || bits == PT_NORMAL_NONE ||
        pt_trust_of_level(shape >> PT_SHAPE_TRUST_SHIFT & 15u) < least_trust)
        return 0;
    pt_decode_normal(bits, normal);
    return fabs(pt_dot(normal, plane->normal)) > STEEPEST;
}

static void put(struct building *b, const double place[3])
{
    const struct pt_height_grid *grid = &b->terrain->grid;
    const double x = (pt_dot(place, b->plane->right) - grid->low[0]) / grid->cell + 0.5,
                 y = (pt_dot(place, b->plane->up) - grid->low[1]) / grid->cell + 0.5, h = pt_dot(place, b->plane->normal);
    if (!(x >= 0.0) || !(y >= 0.0) || x >= grid->width || y >= grid->height || h > b->plane->front || h < -b->plane->back)
        return;
    const size_t cell = (size_t)y * grid->width + (size_t)x;
    if (b->filled[cell] < MOST_IN_CELL) // those that come first are spread evenly: a cloud's strata
        b->samples[cell * MOST_IN_CELL + b->filled[cell]++] = (struct sample){(float)(x - floor(x)), (float)(y - floor(y)),
                                                                              (float)h};
}

static int fill(struct building *b, const patina_cloud *cloud)
{
    const double least_trust = pt_trust_of_level(pt_default_level(cloud->info.trusts)) - 1e-6;
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        const struct pt_chunk *chunk = &cloud->chunks[c];
        const uint64_t slot = pt_chunk_slot(cloud, chunk);
        for (uint32_t i = 0; i < chunk->count; i++) {
            double place[3];
            if (!is_ground(b->plane, cloud, slot + i, least_trust))
                continue;
            pt_point_place(cloud, chunk, i, place);
            for (int k = 0; k < 3; k++)
                place[k] -= b->plane->origin[k];
            put(b, place);
        }
        if (pt_progress_cancelled(b->progress))
            return PATINA_ERROR_CANCELLED;
    }
    return PATINA_OK;
}

// ---- heights of nodes ------------------------------------------------------------------------------------------------------------

struct around {
    uint32_t count;
    double x[MOST_AROUND], y[MOST_AROUND], h[MOST_AROUND], weight[MOST_AROUND], sorted[MOST_AROUND];
};

static void look_around(const struct building *b, uint32_t column, uint32_t row, struct around *a)
{
    const struct pt_height_grid *grid = &b->terrain->grid;
    a->count = 0;
    for (int dy = -2; dy <= 2; dy++)
        for (int dx = -2; dx <= 2; dx++) {
            const int64_t x = (int64_t)column + dx, y = (int64_t)row + dy;
            if (x < 0 || y < 0 || x >= grid->width || y >= grid->height)
                continue;
            const size_t cell = (size_t)y * grid->width + (size_t)x;
            for (uint32_t i = 0; i < b->filled[cell]; i++) {
                const struct sample *s = &b->samples[cell * MOST_IN_CELL + i];
                const uint32_t at = a->count++;
                a->x[at] = dx + (double)s->u - 0.5;
                a->y[at] = dy + (double)s->v - 0.5;
                a->h[at] = (double)s->h;
                a->weight[at] = pt_exp(-0.5 * (a->x[at] * a->x[at] + a->y[at] * a->y[at]) / (KERNEL * KERNEL));
            }
        }
}

// Whether points lie on both sides of the node, in both directions, within a cell and a half.
static int is_surrounded(const struct around *a)
{
    int seen = 0;
    for (uint32_t i = 0; i < a->count; i++)
        if (fabs(a->x[i]) < 1.5 && fabs(a->y[i]) < 1.5)
            seen |= 1 << ((a->x[i] > 0.0) + 2 * (a->y[i] > 0.0));
    return seen == 15 || seen == 14 || seen == 13 || seen == 11 || seen == 7;
}

// One round: the plane h = p[0] + p[1] x + p[2] y, by weighted least squares. Returns the rms distance, or -1.
static double fit_plane(const struct around *a, double band, double p[3])
{
    double m[3][4] = {{0}}, square = 0.0, weight = 0.0;
    for (uint32_t i = 0; i < a->count; i++) {
        const double row[3] = {1.0, a->x[i], a->y[i]}, r = a->h[i] - p[0] - p[1] * row[1] - p[2] * row[2], t = r / band;
        const double w = fabs(t) < 1.0 ? a->weight[i] * (1.0 - t * t) * (1.0 - t * t) : 0.0;
        for (int j = 0; j < 3; j++) {
            for (int k = 0; k < 3; k++)
                m[j][k] += w * row[j] * row[k];
            m[j][3] += w * row[j] * a->h[i];
        }
        square += w * r * r;
        weight += w;
    }
    m[1][1] += 1e-3 * weight;
    m[2][2] += 1e-3 * weight;
    for (int j = 0; j < 3; j++) { // Gauss and Jordan; the matrix is positive definite
        if (!(m[j][j] > 1e-12))
            return -1.0;
        for (int i = 0; i < 3; i++)
            for (int k = 3; i != j && k >= j; k--)
                m[i][k] -= m[i][j] / m[j][j] * m[j][k];
    }
    for (int j = 0; j < 3; j++)
        p[j] = m[j][3] / m[j][j];
    return sqrt(square / weight);
}

static double height_at(const struct building *b, uint32_t column, uint32_t row, struct around *a)
{
    look_around(b, column, row, a);
    if (a->count < 6 || !is_surrounded(a))
        return NAN;
    memcpy(a->sorted, a->h, a->count * sizeof *a->h);
    qsort(a->sorted, a->count, sizeof *a->sorted, pt_compare_doubles);
    double p[3] = {a->sorted[(uint32_t)(LOWEST * a->count)], 0.0, 0.0};
    double band = 3.0 * b->terrain->grid.cell; // as steep as ground can be within the kernel
    for (int i = 0; i < ROUNDS; i++) {
        const double rms = fit_plane(a, band, p);
        if (rms < 0.0)
            return NAN;
        band = fmin(band, fmax(BAND_SIGMAS * 1.2 * rms, 1e-3 * b->terrain->grid.cell));
    }
    return p[0];
}

static void find_heights(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct building *b = context;
    struct around around;
    (void)thread;
    for (uint32_t row = begin; row < end && !pt_progress_cancelled(b->progress); row++)
        for (uint32_t column = 0; column < b->terrain->grid.width; column++)
            b->terrain->values[(size_t)row * b->terrain->grid.width + column] = height_at(b, column, row, &around);
}

// ------------------------------------------------------------------------------------------------------------------------------

static void set_grid(const struct pt_draw_plane *plane, double scale, double cell, struct pt_terrain *terrain)
{
    struct pt_height_grid *grid = &terrain->grid;
    const double widest = 2.0 * fmax(plane->half[0], plane->half[1]);
    grid->cell = cell > 0.0 ? cell : fmax(CELL_SPACINGS * terrain->spacing, CELL_ON_PAPER * scale);
    grid->cell = fmax(grid->cell, widest / (MOST_NODES - 2));
    grid->width = (uint32_t)(2.0 * plane->half[0] / grid->cell) + 2;
    grid->height = (uint32_t)(2.0 * plane->half[1] / grid->cell) + 2;
    grid->low[0] = -0.5 * grid->cell * (grid->width - 1);
    grid->low[1] = -0.5 * grid->cell * (grid->height - 1);
}

int pt_terrain_create(const struct pt_draw_plane *plane, double scale, const patina_cloud *const *clouds, uint32_t count,
                      double cell, uint32_t threads, patina_progress *progress, struct pt_terrain *terrain)
{
    *terrain = (struct pt_terrain){.low = INFINITY, .high = -INFINITY};
    struct building b = {.plane = plane, .terrain = terrain, .progress = progress};
    for (uint32_t i = 0; i < count; i++)
        terrain->spacing = fmax(terrain->spacing, clouds[i]->info.spacing);
    set_grid(plane, scale, cell, terrain);
    const size_t nodes = (size_t)terrain->grid.width * terrain->grid.height;
    terrain->grid.values = terrain->values = malloc(nodes * sizeof *terrain->values);
    b.samples = malloc(nodes * MOST_IN_CELL * sizeof *b.samples);
    b.filled = calloc(nodes, 1);
    struct pt_pool *pool = pt_pool_create(threads, 0);
    int error = terrain->values && b.samples && b.filled && pool ? PATINA_OK : PATINA_ERROR_MEMORY;
    for (uint32_t i = 0; i < count && !error; i++)
        error = fill(&b, clouds[i]);
    if (!error)
        pt_parallel(pool, terrain->grid.height, 4, find_heights, &b);
    for (size_t i = 0; i < nodes && !error; i++) {
        terrain->low = fmin(terrain->low, terrain->values[i]); // NaN is left out
        terrain->high = fmax(terrain->high, terrain->values[i]);
    }
    pt_pool_destroy(pool);
    free(b.samples);
    free(b.filled);
    return error                             ? error
           : pt_progress_cancelled(progress) ? PATINA_ERROR_CANCELLED
           : terrain->low <= terrain->high   ? 0
                                             : PATINA_ERROR_EMPTY;
}

void pt_terrain_destroy(struct pt_terrain *terrain)
{
    free(terrain->values);
    terrain->values = NULL;
}
