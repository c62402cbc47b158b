// SPDX-License-Identifier: GPL-3.0-or-later
#include "marching.h"

#include "patina/patina.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// A step of a contour through a cell, from one edge of the grid to another. Edge 2 * node is to the node on its right, 2 * node + 1 to that
// above. Each edge begins at most one step, and ends at most one: greater heights are on the left of all steps.
struct step {
    uint64_t from, to;
};

struct steps {
    struct step *at;
    size_t count, room;
};

static int add_step(struct steps *steps, uint64_t from, uint64_t to)
{
    if (steps->count == steps->room) {
        const size_t room = steps->room ? 2 * steps->room : 256;
        struct step *grown = realloc(steps->at, room * sizeof *grown);
        if (!grown)
            return PATINA_ERROR_MEMORY;
        steps->at = grown;
        steps->room = room;
    }
    steps->at[steps->count++] = (struct step){from, to};
    return PATINA_OK;
}

// Corners counterclockwise from the lower left. Side i is between corner i and the next one.
static int cross_cell(const struct pt_height_grid *grid, uint32_t x, uint32_t y, double level, struct steps *steps)
{
    const uint64_t node = (uint64_t)y * grid->width + x;
    const uint64_t side[4] = {2 * node, 2 * (node + 1) + 1, 2 * (node + grid->width), 2 * node + 1};
    const double v[4] = {grid->values[node], grid->values[node + 1], grid->values[node + grid->width + 1],
                         grid->values[node + grid->width]};
    const double sum = v[0] + v[1] + v[2] + v[3];
    unsigned above = 0;
    if (!isfinite(sum))
        return PATINA_OK;
    for (unsigned i = 0; i < 4; i++)
        above |= (unsigned)(v[i] >= level) << i;
    if (above == 0 || above == 15)
        return PATINA_OK;
    int error = PATINA_OK;
    for (unsigned i = 0; i < 4 && !error;
         i++) { // a step begins where a side goes from above to below, and ends at the side that ...
        if (!(above >> i & 1u) || (above >> (i + 1) % 4 & 1u))
            continue;
        unsigned end = 0;
        const int joined = (above == 5 || above == 10) && 0.25 * sum >= level; // ... cuts off what is below, or what is above
        for (unsigned k = 1; k < 4; k++) {
            const unsigned s = joined ? (i + k) % 4 : (i + 4 - k) % 4;
            if (!(above >> s & 1u) && (above >> (s + 1) % 4 & 1u)) {
                end = s;
                break;
            }
        }
        error = add_step(steps, side[i], side[end]);
    }
    return error;
}

static void place_of(const struct pt_height_grid *grid, uint64_t edge, double level, double place[2])
{
    const uint64_t node = edge / 2, next = node + (edge % 2 ? grid->width : 1);
    const double a = grid->values[node], b = grid->values[next], t = a == b ? 0.5 : fmin(fmax((level - a) / (b - a), 0.0), 1.0);
    place[0] = grid->low[0] + grid->cell * ((double)(node % grid->width) + (edge % 2 ? 0.0 : t));
    place[1] = grid->low[1] + grid->cell * ((double)(node / grid->width) + (edge % 2 ? t : 0.0));
}

static int compare_steps(const void *a, const void *b)
{
    const struct step *x = a, *y = b;
    return (x->from > y->from) - (x->from < y->from);
}

static size_t step_from(const struct steps *steps, uint64_t edge) // SIZE_MAX: none
{
    size_t low = 0, high = steps->count;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (steps->at[middle].from < edge)
            low = middle + 1;
        else
            high = middle;
    }
    return low < steps->count && steps->at[low].from == edge ? low : SIZE_MAX;
}

// Follows steps from one on, until there is no next or it was taken.
static int follow(const struct pt_height_grid *grid, const struct steps *steps, uint8_t *taken, size_t first, double level,
                  struct pt_line *line)
{
    double place[2];
    size_t at = first;
    place_of(grid, steps->at[first].from, level, place);
    int error = pt_line_add(line, place, 0);
    while (!error && at != SIZE_MAX && !taken[at]) {
        taken[at] = 1;
        if (steps->at[at].to == steps->at[first].from) {
            line->closed = 1;
            break;
        }
        place_of(grid, steps->at[at].to, level, place);
        error = pt_line_add(line, place, 0);
        at = step_from(steps, steps->at[at].to);
    }
    return error;
}

static int join(const struct pt_height_grid *grid, struct steps *steps, double level, uint32_t layer, struct pt_lines *lines)
{
    uint8_t *taken = calloc(steps->count + 1, 1), *led = calloc(steps->count + 1, 1);
    int error = taken && led ? PATINA_OK : PATINA_ERROR_MEMORY;
    if (!error && steps->count)
        qsort(steps->at, steps->count, sizeof *steps->at, compare_steps);
    for (size_t i = 0; i < steps->count && !error; i++) {
        const size_t next = step_from(steps, steps->at[i].to);
        if (next != SIZE_MAX)
            led[next] = 1;
    }
    for (int loops = 0; loops < 2 && !error; loops++) // first the lines that no step leads to
        for (size_t i = 0; i < steps->count && !error; i++) {
            struct pt_line line = {.layer = layer, .spacing = grid->cell};
            if (taken[i] || (!loops && led[i]))
                continue;
            error = follow(grid, steps, taken, i, level, &line);
            if (!error && line.count > 1)
                error = pt_lines_add(lines, &line);
            else
                pt_line_free(&line);
        }
    free(taken);
    free(led);
    return error;
}

int pt_contour_grid(const struct pt_height_grid *grid, double level, uint32_t layer, struct pt_lines *lines)
{
    struct steps steps = {0};
    int error = PATINA_OK;
    for (uint32_t y = 0; y + 1 < grid->height && !error; y++)
        for (uint32_t x = 0; x + 1 < grid->width && !error; x++)
            error = cross_cell(grid, x, y, level, &steps);
    if (!error)
        error = join(grid, &steps, level, layer, lines);
    free(steps.at);
    return error;
}
