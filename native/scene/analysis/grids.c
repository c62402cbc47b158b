// SPDX-License-Identifier: GPL-3.0-or-later
#include "grids.h"
#include "io/grid.h"
#include "base/platform.h"
#include "base/progress.h"
#include "base/vector.h"
#include "shared/words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- the rule of edges: what is tuned, in one place ---------------------------------------------------------------------------

#define STEEP 4.0        // ways across the beam that depth may change by from cell to cell: 76 degrees
#define NOISE 5.0        // sigmas of a depth that are no step
#define ON_PLANE 0.4     // ways off the point's own plane: what lies on it is no step, however steep
#define FLAT 0.35        // ways that neighbours lie off the grid's plane, root mean square, where it tells the normal
#define CELL 1.04        // half axes in ways to the next cell: as those of beams
#define CELL_BORDER 0.44 // where the surface ends on a side of it
#define CERTAIN 0.8      // at least, where the grid tells a surface's normal

struct pt_grid_of {
    struct pt_grid grid; // points: slots. NULL: of no use
    struct pt_scan scan;
    double origin[3], direction[3];
    uint32_t station, directed; // UINT32_MAX: none; directed: beams are parallel
    int of_use;
};

enum side {
    SIDE_UNKNOWN, // the grid, or the surface, ends behind something that hides it
    SIDE_ON,      // the surface goes on
    SIDE_END,     // it ends: depth steps behind it, or nothing came back
};

// ---- whose grid -----------------------------------------------------------------------------------------------------------------

static uint32_t scan_of(const patina_analysis_desc *desc, uint32_t number)
{
    const patina_array *array = desc->scan.data ? &desc->scan : &desc->station;
    uint16_t wide;
    if (!array->data)
        return 0;
    const char *at = (const char *)array->data + number * array->stride;
    if (array->type == PATINA_UINT8)
        return *(const uint8_t *)at;
    memcpy(&wide, at, sizeof wide);
    return wide;
}

// Counts scans, and finds of each its grid's size, its station, and an origin near its points.
static int survey(const struct patina_cloud *cloud, const patina_analysis_desc *desc, struct pt_grids *out)
{
    uint32_t most = 0;
    for (uint32_t c = 0; c < cloud->chunk_count; pt_store_look(out->store), c++)
        for (uint32_t i = 0; i < cloud->chunks[c].count; i++) {
            const uint32_t scan = scan_of(desc, pt_number_of(cloud, cloud->chunks[c].first + i));
            most = scan > most ? scan : most;
        }
    out->each = calloc((size_t)most + 1, sizeof *out->each);
    if (!out->each)
        return PATINA_ERROR_MEMORY;
    out->count = most + 1;
    for (uint32_t c = 0; c < cloud->chunk_count; pt_store_look(out->store), c++)
        for (uint32_t i = 0; i < cloud->chunks[c].count; i++) {
            const struct pt_chunk *chunk = &cloud->chunks[c];
            const uint32_t number = pt_number_of(cloud, chunk->first + i);
            const uint64_t row = pt_line_at(&desc->row, number), column = pt_line_at(&desc->column, number);
            struct pt_grid_of *of = &out->each[scan_of(desc, number)];
            double p[3];
            if (!of->scan.count++) {
                memcpy(of->origin, chunk->origin, sizeof of->origin);
                pt_point_place(cloud, chunk, i, p);
                of->station = desc->station_count ? pt_station_of(desc, number, p) : UINT32_MAX;
            }
            if (row >= INT32_MAX || column >= INT32_MAX)
                continue;
            of->scan.rows = row + 1 > of->scan.rows ? (uint32_t)row + 1 : of->scan.rows;
            of->scan.columns = column + 1 > of->scan.columns ? (uint32_t)column + 1 : of->scan.columns;
        }
    return PATINA_OK;
}

// From where a scan was taken, in its own coordinates; 0: nobody knows.
static int stand(const patina_analysis_desc *desc, uint32_t number, struct pt_grid_of *of)
{
    const double *d = number < desc->direction_count ? desc->directions + 3 * number : NULL;
    const double length = d ? sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) : 0.0;
    of->scan.parallel = length > 0.0;
    for (int k = 0; k < 3; k++)
        of->grid.station[k] = length > 0.0                ? -d[k] / length
                              : of->station != UINT32_MAX ? desc->stations[3 * of->station + (uint32_t)k] - of->origin[k]
                                                          : 0.0;
    return length > 0.0 || of->station != UINT32_MAX;
}

// Of points in the same cell the first by the caller's order stays.
static void fill_cells(const struct patina_cloud *cloud, const patina_analysis_desc *desc, struct pt_grids *out)
{
    for (uint32_t c = 0; c < cloud->chunk_count; pt_store_look(out->store), c++)
        for (uint32_t i = 0; i < cloud->chunks[c].count; i++) {
            const struct pt_chunk *chunk = &cloud->chunks[c];
            const uint32_t slot = chunk->first + i, number = pt_number_of(cloud, slot);
            const uint64_t row = pt_line_at(&desc->row, number), column = pt_line_at(&desc->column, number);
            struct pt_grid_of *of = &out->each[scan_of(desc, number)];
            double p[3];
            pt_point_place(cloud, chunk, i, p);
            for (int k = 0; k < 3; k++)
                out->position[3 * (size_t)slot + (size_t)k] = (float)(p[k] - of->origin[k]);
            if (!of->grid.points || row >= of->scan.rows || column >= of->scan.columns)
                continue;
            uint32_t *cell = &of->grid.points[column * of->scan.rows + row];
            if (*cell == PT_GRID_NONE || number < pt_number_of(cloud, *cell))
                *cell = slot;
        }
}

struct measuring {
    struct pt_grids *grids;
    atomic_int failed;
};

static void measure(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct measuring *measuring = context;
    (void)thread;
    for (uint32_t s = begin; s < end; s++)
        if (measuring->grids->each[s].grid.points && pt_grid_measure_noise(&measuring->grids->each[s].grid))
            atomic_store(&measuring->failed, 1);
}

int pt_grids_create(const struct patina_cloud *cloud, const patina_analysis_desc *desc, struct pt_store *store,
                    struct pt_pool *pool, struct patina_progress *progress, struct pt_grids *out)
{
    *out = (struct pt_grids){.slots = cloud->slots, .store = store};
    if (!desc->grid || !desc->row.data || !desc->column.data || !cloud->chunk_count)
        return PATINA_OK;
    int error = survey(cloud, desc, out);
    out->position = error ? NULL : pt_store_alloc(store, 12 * (size_t)cloud->slots);
    error = out->position ? PATINA_OK : PATINA_ERROR_MEMORY;
    for (uint32_t s = 0; s < out->count && !error; s++) {
        struct pt_grid_of *of = &out->each[s];
        const uint64_t cells = (uint64_t)of->scan.columns * of->scan.rows;
        // A grid that is nearly empty is none, and its numbers may be anything.
        of->of_use = stand(desc, s, of) && of->scan.columns > 1 && of->scan.rows > 1 && cells <= 64 * of->scan.count + 65536;
        out->cell_count += of->of_use ? cells : 0;
    }
    out->cells = error ? NULL : pt_store_alloc(store, out->cell_count * sizeof *out->cells);
    error = error ? error : out->cells ? PATINA_OK : PATINA_ERROR_MEMORY;
    uint32_t *next = out->cells;
    for (uint32_t s = 0; s < out->count && !error; s++) {
        struct pt_grid_of *of = &out->each[s];
        const size_t cells = (size_t)of->scan.columns * of->scan.rows;
        if (!of->of_use)
            continue;
        of->grid.scan = &of->scan;
        of->grid.position = out->position;
        of->grid.points = next;
        memset(next, 0xFF, cells * sizeof *next);
        next += cells;
        pt_store_look(store);
    }
    if (!error)
        fill_cells(cloud, desc, out);
    if (!error) {
        struct measuring measuring = {.grids = out};
        pt_parallel(pool, out->count, 1, measure, &measuring);
        error = atomic_load(&measuring.failed)    ? PATINA_ERROR_MEMORY
                : pt_progress_cancelled(progress) ? PATINA_ERROR_CANCELLED
                                                  : PATINA_OK;
    }
    if (error)
        pt_grids_destroy(out);
    return error;
}

void pt_grids_destroy(struct pt_grids *grids)
{
    pt_store_free(grids->store, grids->cells, grids->cell_count * sizeof *grids->cells);
    pt_store_free(grids->store, grids->position, 12 * (size_t)grids->slots);
    free(grids->each);
    *grids = (struct pt_grids){0};
}

// ---- a point --------------------------------------------------------------------------------------------------------------------

struct looker {
    const struct pt_grid *grid;
    int64_t column, row;
    double p[3], towards[3];
    const double *normal; // of its plane, or NULL
    double sigma;         // off that plane
};

// What lies on one side, by so many cells; v: the way there, of one cell, where the surface goes on.
static enum side look(const struct looker *l, int dc, int dr, double v[3])
{
    uint32_t point = PT_GRID_NONE;
    int far = 1;
    for (; far <= 2; far++) { // a sample that did not come back is no hole
        const int64_t c = l->column + far * dc, r = l->row + far * dr;
        if (c < 0 || r < 0 || c >= l->grid->scan->columns || r >= l->grid->scan->rows)
            return SIDE_UNKNOWN;
        point = pt_grid_point(l->grid, c, r);
        if (point != PT_GRID_NONE)
            break;
    }
    if (point == PT_GRID_NONE)
        return SIDE_END;
    for (int k = 0; k < 3; k++)
        v[k] = (double)l->grid->position[3 * (size_t)point + (size_t)k] - l->p[k];
    const double depth = pt_dot(v, l->towards), way = sqrt(fmax(pt_dot(v, v) - depth * depth, 0.0));
    const int on = fabs(depth) <= STEEP * way + NOISE * l->grid->sigma ||
                   (l->normal && fabs(pt_dot(v, l->normal)) <= fmax(ON_PLANE * way, 3.0 * l->sigma));
    for (int k = 0; k < 3; k++)
        v[k] /= far;
    if (on)
        return SIDE_ON;
    return far == 1 && depth < 0.0 ? SIDE_END : SIDE_UNKNOWN;
}

// Of the two sides along a line of the grid: half the way from cell to cell, on the plane; 1 where the surface goes on on a side.
static int span_of(const struct looker *l, int dc, int dr, const double normal[3], double a[3], int *ends, int *on)
{
    double before[3], behind[3];
    const enum side first = look(l, -dc, -dr, before), second = look(l, dc, dr, behind);
    *ends = first == SIDE_END || second == SIDE_END;
    *on = (first == SIDE_ON) + (second == SIDE_ON);
    for (int k = 0; k < 3; k++)
        a[k] = first == SIDE_ON && second == SIDE_ON ? 0.5 * (behind[k] - before[k])
               : first == SIDE_ON                    ? -before[k]
               : second == SIDE_ON                   ? behind[k]
                                                     : 0.0;
    const double off = pt_dot(a, normal);
    for (int k = 0; k < 3; k++)
        a[k] -= off * normal[k];
    return *on > 0 && pt_dot(a, a) > 0.0;
}

// Where no neighbour tells how wide a cell is along one line: as wide as along the other, across it.
static void turn(const double normal[3], const double a[3], double b[3])
{
    b[0] = normal[1] * a[2] - normal[2] * a[1];
    b[1] = normal[2] * a[0] - normal[0] * a[2];
    b[2] = normal[0] * a[1] - normal[1] * a[0];
}

// How far the cells around lie off the plane, root mean square, in ways to the next cell.
static double roughness(const struct looker *l, const double normal[3])
{
    double squares = 0.0, ways = 0.0, v[3];
    int count = 0;
    for (int dc = -1; dc <= 1; dc++)
        for (int dr = -1; dr <= 1; dr++) {
            if ((!dc && !dr) || look(l, dc, dr, v) != SIDE_ON)
                continue;
            const double off = pt_dot(v, normal);
            squares += off * off;
            ways += pt_dot(v, v);
            count++;
        }
    return count >= 3 && ways > 0.0 ? sqrt(squares / ways) : INFINITY;
}

int pt_grids_describe(const struct pt_grids *grids, const patina_analysis_desc *desc, uint32_t slot, uint32_t number,
                      struct pt_neighbourhood *hood)
{
    if (!grids->count)
        return 0;
    const struct pt_grid_of *of = &grids->each[scan_of(desc, number)];
    const struct pt_grid *grid = &of->grid;
    struct looker l = {.grid = grid, .column = pt_line_at(&desc->column, number), .row = pt_line_at(&desc->row, number)};
    if (!grid->points || pt_grid_point(grid, l.column, l.row) != slot)
        return 0;
    for (int k = 0; k < 3; k++)
        l.p[k] = (double)grid->position[3 * (size_t)slot + (size_t)k];
    pt_grid_towards(grid, l.p, l.towards);
    // 1. The plane.
    float told[3] = {0.0f, 0.0f, 0.0f};
    double normal[3], a[3], b[3], axis[3], major, minor;
    pt_grid_normal(grid, l.column, l.row, told);
    const int found = told[0] != 0.0f || told[1] != 0.0f || told[2] != 0.0f;
    if (hood->kind != PT_KIND_SURFACE && hood->kind != PT_KIND_BORDER) // leaves and wires are none in the grid either
        return 0;
    for (int k = 0; k < 3; k++)
        normal[k] = found ? (double)told[k] : hood->normal[k];
    l.normal = normal;
    l.sigma = hood->sigma;
    const double rough = found ? roughness(&l, normal) : INFINITY;
    // 2. Sides, and the footprint up to them.
    int ends[2], on[2];
    const int along = span_of(&l, 1, 0, normal, a, &ends[0], &on[0]), across = span_of(&l, 0, 1, normal, b, &ends[1], &on[1]);
    if (!along && !across)
        return 0;
    if (!along)
        turn(normal, b, a);
    if (!across)
        turn(normal, a, b);
    for (int k = 0; k < 3; k++) {
        a[k] *= ends[0] || !along ? CELL_BORDER : CELL;
        b[k] *= ends[1] || !across ? CELL_BORDER : CELL;
    }
    pt_ellipse_of(a, b, axis, &major, &minor);
    // 3. What the grid knows better.
    const int border = ends[0] || ends[1], inner = on[0] == 2 && on[1] == 2;
    if (found && rough <= FLAT &&
        !(hood->has_normal && hood->certainty >= CERTAIN)) { // of several scans' points it is steadier
        hood->has_normal = 1;
        memcpy(hood->normal, normal, sizeof normal);
        hood->certainty = fmax(hood->certainty, CERTAIN * (1.0 - rough));
    }
    if (hood->has_normal) {
        const double side = pt_dot(hood->normal, l.towards) < 0.0 ? -1.0 : 1.0;
        for (int k = 0; k < 3; k++)
            hood->normal[k] *= side;
        hood->sided = 1;
    }
    if (border || inner)
        hood->kind = border ? PT_KIND_BORDER : PT_KIND_SURFACE;
    if (!(major * minor < hood->major * hood->minor))
        return 1;
    hood->spacing = fmin(hood->spacing, sqrt(major * minor) / CELL);
    hood->major = major;
    hood->minor = minor;
    memcpy(hood->axis, axis, sizeof axis);
    return 1;
}
