// SPDX-License-Identifier: GPL-3.0-or-later
// What a file's scans are: in which direction the scanner looked, and how far apart its samples lie.
#include "file.h"
#include "base/compare.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_SAMPLES = 1 << 16 }; // of a scan, evenly spread
static const uint32_t NONE = UINT32_MAX;

static const double all_around = 0.75; // the mean of the unit vectors of a cone of 60 degrees: what is shorter has no direction

static bool counts(const struct pt_column *column)
{
    return column && (column->type == PATINA_UINT16 || column->type == PATINA_UINT32);
}

static uint64_t value_of(const struct pt_column *column, uint64_t i) { return (uint64_t)pt_file_value(column, i); }

static void measure_direction(const struct patina_file *file, struct pt_scan *scan)
{
    double sum[3] = {0}, n = 0;
    const uint64_t step = scan->count / MOST_SAMPLES + 1;
    for (int k = 0; k < 3 && scan->parallel; k++)
        sum[k] = -scan->station[k];
    for (uint64_t i = scan->first; i < scan->first + scan->count && !scan->parallel && !scan->nowhere; i += step) {
        double v[3], square = 0;
        for (int k = 0; k < 3; k++) {
            v[k] = (double)file->position[3 * i + (uint64_t)k] + file->origin[k] - scan->station[k];
            square += v[k] * v[k];
        }
        if (!(square > 0) || !isfinite(square))
            continue;
        n++;
        for (int k = 0; k < 3; k++)
            sum[k] += v[k] / sqrt(square);
    }
    const double length = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    const bool known = length > 0 && isfinite(length) && (scan->parallel || length >= all_around * n);
    for (int k = 0; k < 3; k++)
        scan->direction[k] = known ? sum[k] / length : 0;
}

static double way_between(const float *a, const float *b)
{
    double square = 0;
    for (int k = 0; k < 3; k++)
        square += ((double)a[k] - (double)b[k]) * ((double)a[k] - (double)b[k]);
    return sqrt(square);
}

// cells: column by column, the point in each.
static void measure_interval(const struct patina_file *file, struct pt_scan *scan, const uint32_t *cells, double *ways)
{
    const uint64_t count = (uint64_t)scan->columns * scan->rows, step = count / (MOST_SAMPLES / 2) + 1;
    size_t found = 0;
    for (uint64_t cell = 0; cell < count; cell += step) {
        const uint64_t beside[2] = {(cell + 1) % scan->rows ? cell + 1 : count, cell + scan->rows};
        for (int k = 0; k < 2 && cells[cell] != NONE; k++) {
            if (beside[k] >= count || cells[beside[k]] == NONE)
                continue;
            const double way = way_between(file->position + 3 * (uint64_t)cells[cell],
                                           file->position + 3 * (uint64_t)cells[beside[k]]);
            if (isfinite(way) && found < MOST_SAMPLES)
                ways[found++] = way;
        }
    }
    qsort(ways, found, sizeof *ways, pt_compare_doubles);
    scan->interval = found ? ways[found / 2] : 0;
}

static int measure(const struct patina_file *file, struct pt_scan *scan, const struct pt_column *columns,
                   const struct pt_column *rows)
{
    const uint64_t count = (uint64_t)scan->columns * scan->rows;
    uint32_t *cells = malloc(count * sizeof *cells);
    double *ways = malloc(MOST_SAMPLES * sizeof *ways);
    if (cells && ways) {
        memset(cells, 0xFF, count * sizeof *cells);
        for (uint64_t i = scan->first; i < scan->first + scan->count; i++) {
            const uint64_t column = value_of(columns, i), row = value_of(rows, i);
            if (column < scan->columns && row < scan->rows)
                cells[column * scan->rows + row] = (uint32_t)i;
        }
        measure_interval(file, scan, cells, ways);
    }
    const bool good = cells && ways;
    free(cells);
    free(ways);
    return good ? PATINA_OK : PATINA_ERROR_MEMORY;
}

int pt_file_measure_scans(struct patina_file *file)
{
    const struct pt_column *columns = pt_file_find_attribute(file, "column"), *rows = pt_file_find_attribute(file, "row");
    int code = PATINA_OK;
    for (uint32_t s = 0; s < file->scan_count && !code; s++) {
        struct pt_scan *scan = &file->scans[s];
        if (scan->told)
            continue;
        measure_direction(file, scan);
        if (scan->count > 1 && scan->columns && scan->rows && counts(columns) && counts(rows) &&
            !pt_grid_is_empty(scan->columns, scan->rows, scan->count))
            code = measure(file, scan, columns, rows);
    }
    return code;
}

bool pt_grid_is_empty(uint64_t columns, uint64_t rows, uint64_t points)
{
    return columns > UINT32_MAX || rows > UINT32_MAX || columns * rows > 64 * points + 65536;
}

void pt_file_end_scan(struct patina_file *file, uint64_t missing, uint64_t surplus)
{
    struct pt_scan *scan = &file->scans[file->scan_count - 1];
    scan->missing = missing;
    scan->surplus = surplus;
    scan->announced[0] = scan->columns;
    scan->announced[1] = scan->rows;
    if (!missing)
        return;
    const uint64_t seen = (uint64_t)scan->columns * scan->rows - missing; // no memory for cells that never came
    scan->rows = seen < scan->rows ? (uint32_t)seen : scan->rows;
    scan->columns = scan->rows ? (uint32_t)((seen + scan->rows - 1) / scan->rows) : 0;
}

// ---- what is wrong with them -----------------------------------------------------------------------------------------

enum fault { CUT, SURPLUS, NO_POSE, NO_POINTS, ONE_POINT, FAULTS };
enum { LISTED = 5 }; // scans that a warning names

static uint64_t amount(const struct pt_scan *scan, enum fault fault)
{
    switch (fault) {
    case CUT: return scan->missing;
    case SURPLUS: return scan->surplus;
    case NO_POSE: return scan->nowhere;
    case NO_POINTS: return !scan->nowhere && !scan->count;
    default: return !scan->nowhere && scan->count == 1;
    }
}

static void tell_one(const struct pt_scan *scan, const char *name, uint32_t number, enum fault fault)
{
    if (fault == CUT)
        pt_log(PT_LOG_WARNING, "%s: scan %u ends %llu cells before its grid of %u x %u does", name, number,
               (unsigned long long)scan->missing, scan->announced[0], scan->announced[1]);
    else if (fault == SURPLUS)
        pt_log(PT_LOG_WARNING, "%s: scan %u: %llu lines behind its grid of %u x %u are left out", name, number,
               (unsigned long long)scan->surplus, scan->announced[0], scan->announced[1]);
    else if (fault == NO_POSE)
        pt_log(PT_LOG_WARNING, "%s: scan %u is left out: its matrix is none of a pose", name, number);
    else
        pt_log(PT_LOG_WARNING, "%s: scan %u has %s", name, number, scan->count ? "one point" : "no points");
}

static void tell_several(const char *name, enum fault fault, uint32_t count, uint64_t sum, const char *numbers)
{
    if (fault == CUT)
        pt_log(PT_LOG_WARNING, "%s: %u scans end before their grids do, by %llu cells in all: %s", name, count,
               (unsigned long long)sum, numbers);
    else if (fault == SURPLUS)
        pt_log(PT_LOG_WARNING, "%s: %u scans have lines behind their grids, which are left out, %llu in all: %s", name, count,
               (unsigned long long)sum, numbers);
    else if (fault == NO_POSE)
        pt_log(PT_LOG_WARNING, "%s: %u scans are left out, because their matrices are none of a pose: %s", name, count,
               numbers);
    else
        pt_log(PT_LOG_WARNING, "%s: %u scans have %s: %s", name, count, fault == ONE_POINT ? "one point each" : "no points",
               numbers);
}

void pt_file_tell_scans(const struct patina_file *file, const char *name)
{
    for (enum fault fault = 0; fault < FAULTS; fault++) {
        char numbers[96] = ""; // LISTED of ten digits
        uint32_t found = 0, last = 0;
        uint64_t sum = 0;
        for (uint32_t s = 0; s < file->scan_count; s++) {
            const uint64_t of = amount(&file->scans[s], fault);
            if (!of)
                continue;
            if (found < LISTED)
                snprintf(numbers + strlen(numbers), sizeof numbers - strlen(numbers), "%s%u", found ? ", " : "scans ", s);
            found++;
            sum += of;
            last = s;
        }
        if (found == 1)
            tell_one(&file->scans[last], name, last, fault);
        else if (found)
            tell_several(name, fault, found, sum, found > LISTED ? strcat(numbers, ", ...") : numbers);
    }
}

bool pt_turns(const double *m, int stride)
{
    double dot[3], length[3], most = 0;
    for (int i = 0; i < 3; i++) {
        const double *a = m + i * stride, *b = m + (i + 1) % 3 * stride;
        length[i] = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
        dot[i] = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        most = fmax(most, length[i]);
    }
    const double *a = m, *b = m + stride, *c = m + 2 * stride;
    const double volume = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
                          a[2] * (b[0] * c[1] - b[1] * c[0]);
    bool good = most > 0 && isfinite(most) && volume > 0;
    for (int i = 0; i < 3; i++)
        good &= fabs(dot[i]) <= 0.01 * most * most && length[i] >= 0.99 * most;
    return good;
}
