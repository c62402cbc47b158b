// SPDX-License-Identifier: GPL-3.0-or-later
// Depths as a host's overlays are hidden behind them.
#include "base/error.h"

#include <math.h>
#include <stdlib.h>

enum { AROUND = 2 };

static float nearer(float a, float b) { return a < b ? a : b; } // of vectors one instruction, unlike fminf

// The nearest of 2 AROUND + 1 rows.
static void join_rows(const float *const rows[2 * AROUND + 1], size_t width, float *restrict out)
{
    for (size_t x = 0; x < width; x++)
        out[x] = nearer(nearer(nearer(rows[0][x], rows[1][x]), nearer(rows[2][x], rows[3][x])), rows[4][x]);
}

// The nearest of as many columns; row begins AROUND before its first and ends as far behind its last.
static void join_columns(const float *restrict row, size_t width, float *restrict out)
{
    for (size_t x = 0; x < width; x++)
        out[x] = nearer(nearer(nearer(row[x], row[x + 1]), nearer(row[x + 2], row[x + 3])), row[x + 4]);
}

int patina_nearest_depths(const float *depths, uint32_t width, uint32_t height, float *nearest, size_t size)
{
    if (!depths || !nearest || depths == nearest)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_nearest_depths: depths or nearest is NULL, or both are one");
    if (size != (size_t)width * height * sizeof *nearest)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_nearest_depths: %u x %u floats; got %zu bytes", width, height,
                       size);
    float *row = malloc(((size_t)width + 2 * AROUND) * sizeof *row);
    if (!row)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "patina_nearest_depths: out of memory");
    for (int k = 0; k < AROUND; k++) // nothing is beyond the borders
        row[k] = row[width + AROUND + (size_t)k] = INFINITY;
    for (uint32_t y = 0; y < height; y++) {
        const float *rows[2 * AROUND + 1];
        for (int64_t k = 0; k <= 2 * AROUND; k++) {
            const int64_t at = (int64_t)y + k - AROUND, last = (int64_t)height - 1;
            rows[k] = depths + (size_t)(at < 0 ? 0 : at > last ? last : at) * width;
        }
        join_rows(rows, width, row + AROUND);
        join_columns(row, width, nearest + (size_t)y * width);
    }
    free(row);
    return PATINA_OK;
}
