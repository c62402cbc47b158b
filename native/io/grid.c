// SPDX-License-Identifier: GPL-3.0-or-later
// Normals of scans from their grids. A scanner's error lies along its rays, while the rays themselves are known well: so
// positions are fitted as a linear function of column and row (least squares over a window), and the normal is the cross
// product of the two slopes. Neighbours in space would mix both errors, and take in what lies behind an edge.
//
// A cell belongs to a window when a chain of cells leads to it from the middle without a step in depth: a step is more than
// STEEP times the way across the rays and NOISE sigma. Sigma comes from the second differences along the columns. The window
// grows where sigma is large beside the way from cell to cell, until the slope is known to LOOSE.
#include "grid.h"

#include "base/compare.h"
#include "base/descriptor.h"
#include "base/progress.h"
#include "base/vector.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { WIDEST = 5, SIDE = 2 * WIDEST + 1, MOST_SAMPLES = 65536, POLL_POINTS = 65536 };

static const double steep = 4;    // 76 degrees from the ray's own plane
static const double noise = 4;    // sigmas that are no step
static const double loose = 0.05; // of a slope: 3 degrees

uint32_t pt_grid_point(const struct pt_grid *g, int64_t column, int64_t row)
{
    if (column < 0 || row < 0 || column >= g->scan->columns || row >= g->scan->rows)
        return PT_GRID_NONE;
    return g->points[(uint64_t)column * g->scan->rows + (uint64_t)row];
}

static void place_of(const struct pt_grid *g, uint32_t point, double p[3])
{
    for (int k = 0; k < 3; k++)
        p[k] = (double)g->position[3 * (size_t)point + (size_t)k];
}

void pt_grid_towards(const struct pt_grid *g, const double p[3], double d[3])
{
    for (int k = 0; k < 3; k++)
        d[k] = g->station[k] - (g->scan->parallel ? 0 : p[k]);
    double length = sqrt(pt_dot(d, d));
    for (int k = 0; k < 3; k++)
        d[k] /= length;
}

// Along the direction d, and across it.
static double depth_and_way(const double a[3], const double b[3], const double d[3], double *way)
{
    const double v[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    double depth = pt_dot(v, d);
    *way = sqrt(fmax(pt_dot(v, v) - depth * depth, 0));
    return fabs(depth);
}

// ---- the noise of a scan -------------------------------------------------------------------------------------------

static double depth_of(const struct pt_grid *g, uint32_t point)
{
    double p[3], d[3];
    place_of(g, point, p);
    if (g->scan->parallel)
        return pt_dot(p, g->station);
    for (int k = 0; k < 3; k++)
        d[k] = p[k] - g->station[k];
    return sqrt(pt_dot(d, d));
}

int pt_grid_measure_noise(struct pt_grid *g)
{
    uint64_t cells = (uint64_t)g->scan->columns * g->scan->rows, step = cells / MOST_SAMPLES + 1;
    double *samples = malloc(MOST_SAMPLES * sizeof *samples);
    size_t count = 0;
    if (!samples)
        return PATINA_ERROR_MEMORY;
    for (uint64_t i = 1; i + 1 < cells; i += step) {
        if (i % g->scan->rows == 0 || (i + 1) % g->scan->rows == 0 || g->points[i - 1] == PT_GRID_NONE ||
            g->points[i] == PT_GRID_NONE || g->points[i + 1] == PT_GRID_NONE)
            continue;
        double bend = depth_of(g, g->points[i - 1]) - 2 * depth_of(g, g->points[i]) + depth_of(g, g->points[i + 1]);
        if (isfinite(bend))
            samples[count++] = fabs(bend);
    }
    qsort(samples, count, sizeof *samples, pt_compare_doubles);
    g->sigma = count ? samples[count / 2] / (0.6745 * sqrt(6)) : 0;
    free(samples);
    return PATINA_OK;
}

// ---- the fit of one point ------------------------------------------------------------------------------------------

struct window {
    double at[SIDE][SIDE][3]; // positions, [column][row]
    bool in[SIDE][SIDE];
};

// How many cells the window must reach so that the slope is known well: its error is sigma / (way sqrt(sum of squares)).
static int reach_of(const struct pt_grid *g, double way)
{
    for (int r = 1; r < WIDEST; r++) {
        double squares = (2 * r + 1) * (2 * r + 1) * r * (r + 1) / 3.0;
        if (g->sigma <= loose * way * sqrt(squares))
            return r;
    }
    return WIDEST;
}

static int sign(int v) { return (v > 0) - (v < 0); }

// Takes in the cells of ring r that a cell of the ring within leads to; returns the mean way to those of them beside it.
static double take_ring(const struct pt_grid *g, struct window *w, int64_t column, int64_t row, int r, const double d[3])
{
    double sum = 0;
    int found = 0;
    for (int u = -r; u <= r; u++)
        for (int v = -r; v <= r; v += abs(u) == r ? 1 : 2 * r) {
            int a = u - sign(u) * (abs(u) == r), b = v - sign(v) * (abs(v) == r);
            uint32_t point = pt_grid_point(g, column + u, row + v);
            double *q = w->at[WIDEST + u][WIDEST + v], way;
            w->in[WIDEST + u][WIDEST + v] = false;
            if (point == PT_GRID_NONE || !w->in[WIDEST + a][WIDEST + b])
                continue;
            place_of(g, point, q);
            double depth = depth_and_way(w->at[WIDEST + a][WIDEST + b], q, d, &way);
            if (!(depth <= steep * way + noise * g->sigma)) // not for NaN either
                continue;
            w->in[WIDEST + u][WIDEST + v] = true;
            if (u == 0 || v == 0) {
                sum += way;
                found++;
            }
        }
    return found ? sum / found : 0;
}

// Slopes of position over column and row, by least squares over the window; false where its cells do not span a plane.
static bool fit(const struct window *w, int r, double by_column[3], double by_row[3])
{
    double n = 0, su = 0, sv = 0, suu = 0, suv = 0, svv = 0, sp[3] = {0}, sup[3] = {0}, svp[3] = {0};
    for (int u = -r; u <= r; u++)
        for (int v = -r; v <= r; v++) {
            if (!w->in[WIDEST + u][WIDEST + v])
                continue;
            n++, su += u, sv += v, suu += u * u, suv += u * v, svv += v * v;
            for (int k = 0; k < 3; k++) {
                double p = w->at[WIDEST + u][WIDEST + v][k] - w->at[WIDEST][WIDEST][k];
                sp[k] += p, sup[k] += u * p, svp[k] += v * p;
            }
        }
    suu -= su * su / n, suv -= su * sv / n, svv -= sv * sv / n; // about the mean
    double determinant = suu * svv - suv * suv;
    if (n < 3 || determinant < 0.1) // three cells in a corner: 1/3; on a line: 0
        return false;
    for (int k = 0; k < 3; k++) {
        double up = sup[k] - su * sp[k] / n, vp = svp[k] - sv * sp[k] / n;
        by_column[k] = (svv * up - suv * vp) / determinant;
        by_row[k] = (suu * vp - suv * up) / determinant;
    }
    return true;
}

void pt_grid_normal(const struct pt_grid *g, int64_t column, int64_t row, float normal[3])
{
    struct window w;
    double d[3], a[3], b[3], *p = w.at[WIDEST][WIDEST];
    place_of(g, pt_grid_point(g, column, row), p);
    pt_grid_towards(g, p, d);
    w.in[WIDEST][WIDEST] = true;
    int reach = reach_of(g, take_ring(g, &w, column, row, 1, d));
    for (int r = 2; r <= reach; r++)
        take_ring(g, &w, column, row, r, d);
    if (!fit(&w, reach, a, b))
        return;
    double n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    double length = sqrt(pt_dot(n, n)) * (pt_dot(n, d) < 0 ? -1 : 1);
    for (int k = 0; k < 3; k++)
        normal[k] = length != 0 && isfinite(length) ? (float)(n[k] / length) : 0;
}

// ---- scans ---------------------------------------------------------------------------------------------------------

// Where the points lie in the grid: columns of uint16 or of uint32.
struct cells {
    const void *column, *row;
    bool wide;
};

static uint64_t value_at(const void *values, bool wide, uint64_t i)
{
    return wide ? ((const uint32_t *)values)[i] : ((const uint16_t *)values)[i];
}

// g: scan, position and station are set. Cancelled when the progress says so; the caller has the words for errors.
static int find_normals(struct pt_grid *g, const struct cells *cells, struct patina_progress *progress, float *normals)
{
    const struct pt_scan *scan = g->scan;
    uint64_t count = (uint64_t)scan->columns * scan->rows;
    if (!count || pt_grid_is_empty(scan->columns, scan->rows, scan->count))
        return PATINA_OK;
    g->points = malloc(count * sizeof *g->points);
    if (!g->points)
        return PATINA_ERROR_MEMORY;
    memset(g->points, 0xFF, count * sizeof *g->points);
    for (uint64_t i = scan->first; i < scan->first + scan->count; i++) {
        uint64_t column = value_at(cells->column, cells->wide, i), row = value_at(cells->row, cells->wide, i);
        if (column < scan->columns && row < scan->rows)
            g->points[column * scan->rows + row] = (uint32_t)i;
    }
    int code = pt_grid_measure_noise(g);
    for (uint64_t i = scan->first; i < scan->first + scan->count && !code; i++) {
        uint64_t column = value_at(cells->column, cells->wide, i), row = value_at(cells->row, cells->wide, i);
        if (i % POLL_POINTS == 0 && pt_progress_cancelled(progress))
            code = PATINA_ERROR_CANCELLED;
        if (column < scan->columns && row < scan->rows)
            pt_grid_normal(g, (int64_t)column, (int64_t)row, normals + 3 * i);
    }
    free(g->points);
    return code;
}

int pt_file_grid_normals(struct patina_file *file, const struct pt_input *input)
{
    const struct pt_column *columns = pt_file_find_attribute(file, "column"), *rows = pt_file_find_attribute(file, "row");
    bool any = false;
    for (uint32_t s = 0; s < file->scan_count; s++)
        any |= file->scans[s].columns > 1 && file->scans[s].rows > 1;
    if (file->normal || !any || !columns || !rows)
        return PATINA_OK;
    file->normal = calloc(file->count + 1, 3 * sizeof *file->normal);
    int code = file->normal ? PATINA_OK : PATINA_ERROR_MEMORY;
    const struct cells cells = {columns->data, rows->data, columns->type == PATINA_UINT32};
    for (uint32_t s = 0; s < file->scan_count && !code; s++) {
        struct pt_grid g = {.scan = &file->scans[s], .position = file->position};
        for (int k = 0; k < 3; k++)
            g.station[k] = g.scan->station[k] - (g.scan->parallel ? 0 : file->origin[k]);
        code = find_normals(&g, &cells, input->progress, file->normal);
    }
    if (code == PATINA_ERROR_MEMORY)
        pt_fail(NULL, code, "%s: no memory for the normals of %llu points", input->name, (unsigned long long)file->count);
    if (code == PATINA_ERROR_CANCELLED)
        pt_fail(NULL, code, "%s: reading was cancelled", input->name);
    return code;
}

#define MOST_POINTS (1ull << 48)

int patina_grid_normals(const patina_grid_desc *given, patina_progress *progress, float *normals)
{
    patina_grid_desc taken;
    const patina_grid_desc *const desc = &taken;
    const int wrong = given ? pt_take(NULL, "patina_grid_normals", given, &taken, sizeof taken) : PATINA_OK;
    if (wrong)
        return wrong;
    if (!given || (desc->count && !(desc->position && desc->column && desc->row && normals)))
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_grid_normals: bad arguments");
    if (desc->count > MOST_POINTS)
        return pt_fail(NULL, PATINA_ERROR_TOO_MANY_POINTS, "patina_grid_normals: %llu points are more than any array holds",
                       (unsigned long long)desc->count);
    struct pt_scan scan = {.count = desc->count};
    struct pt_grid g = {.scan = &scan, .position = desc->position};
    memcpy(g.station, desc->station, sizeof g.station);
    if (desc->count)
        memset(normals, 0, desc->count * 3 * sizeof *normals);
    uint64_t columns = 0, rows = 0;
    for (uint64_t i = 0; i < desc->count; i++) {
        columns = desc->column[i] >= columns ? desc->column[i] + 1ull : columns;
        rows = desc->row[i] >= rows ? desc->row[i] + 1ull : rows;
    }
    // A grid that is nearly empty is none, and its numbers may be anything.
    if (desc->count > UINT32_MAX - 1 || pt_grid_is_empty(columns, rows, desc->count))
        return PATINA_OK;
    scan.columns = (uint32_t)columns;
    scan.rows = (uint32_t)rows;
    int code = find_normals(&g, &(struct cells){desc->column, desc->row, true}, progress, normals);
    return code ? pt_fail(NULL, code, "normals of a scanner's grid: %s", patina_error_text(code)) : PATINA_OK;
}
