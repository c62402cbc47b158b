// SPDX-License-Identifier: GPL-3.0-or-later
#include "lines.h"

#include "patina/patina.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static int reserve(struct pt_line *line, uint32_t more)
{
    if (line->room - line->count >= more)
        return PATINA_OK;
    if (more > UINT32_MAX / 4 - line->count)
        return PATINA_ERROR_MEMORY;
    uint32_t room = line->room ? line->room : 16;
    while (room - line->count < more)
        room *= 2;
    double(*at)[2] = realloc(line->at, room * sizeof *at);
    if (!at)
        return PATINA_ERROR_MEMORY;
    line->at = at;
    double *depth = realloc(line->depth, room * sizeof *depth);
    if (!depth)
        return PATINA_ERROR_MEMORY;
    line->depth = depth;
    uint8_t *fixed = realloc(line->fixed, room);
    if (!fixed)
        return PATINA_ERROR_MEMORY;
    line->fixed = fixed;
    line->room = room;
    return PATINA_OK;
}

int pt_line_add(struct pt_line *line, const double place[2], int fixed)
{
    if (reserve(line, 1))
        return PATINA_ERROR_MEMORY;
    memcpy(line->at[line->count], place, sizeof *line->at);
    line->depth[line->count] = 0.0;
    line->fixed[line->count++] = (uint8_t)fixed;
    return PATINA_OK;
}

int pt_line_append(struct pt_line *line, const struct pt_line *other)
{
    if (!other->count)
        return PATINA_OK;
    if (reserve(line, other->count))
        return PATINA_ERROR_MEMORY;
    memcpy(line->at + line->count, other->at, other->count * sizeof *line->at);
    memcpy(line->depth + line->count, other->depth, other->count * sizeof *line->depth);
    memcpy(line->fixed + line->count, other->fixed, other->count);
    line->count += other->count;
    return PATINA_OK;
}

void pt_line_reverse(struct pt_line *line)
{
    for (uint32_t i = 0, j = line->count; i + 1 < j; i++) {
        double kept[2];
        const double depth = line->depth[i];
        const uint8_t fixed = line->fixed[i];
        j--;
        memcpy(kept, line->at[i], sizeof kept);
        memcpy(line->at[i], line->at[j], sizeof kept);
        memcpy(line->at[j], kept, sizeof kept);
        line->depth[i] = line->depth[j];
        line->depth[j] = depth;
        line->fixed[i] = line->fixed[j];
        line->fixed[j] = fixed;
    }
}

static double step_of(const struct pt_line *line, uint32_t i, uint32_t j)
{
    const double x = line->at[i][0] - line->at[j][0], y = line->at[i][1] - line->at[j][1];
    return sqrt(x * x + y * y);
}

double pt_line_length(const struct pt_line *line)
{
    double sum = line->closed && line->count > 1 ? step_of(line, line->count - 1, 0) : 0.0;
    for (uint32_t i = 1; i < line->count; i++)
        sum += step_of(line, i, i - 1);
    return sum;
}

void pt_line_trim(struct pt_line *line, double length)
{
    while (line->count > 2 && length > 0.0) {
        const uint32_t last = line->count - 1;
        const double step = step_of(line, last, last - 1);
        if (step > length) {
            const double share = length / step;
            for (int k = 0; k < 2; k++)
                line->at[last][k] += share * (line->at[last - 1][k] - line->at[last][k]);
            line->depth[last] += share * (line->depth[last - 1] - line->depth[last]);
            return;
        }
        length -= step;
        line->count--;
    }
}

void pt_line_free(struct pt_line *line)
{
    free(line->at);
    free(line->depth);
    free(line->fixed);
    *line = (struct pt_line){0};
}

int pt_lines_add(struct pt_lines *lines, struct pt_line *line)
{
    if (lines->count == lines->room) {
        const uint32_t room = lines->room ? 2 * lines->room : 32;
        struct pt_line *grown = lines->room < UINT32_MAX / 4 ? realloc(lines->at, room * sizeof *grown) : NULL;
        if (!grown) {
            pt_line_free(line);
            return PATINA_ERROR_MEMORY;
        }
        lines->at = grown;
        lines->room = room;
    }
    lines->at[lines->count++] = *line;
    *line = (struct pt_line){0};
    return PATINA_OK;
}

void pt_lines_free(struct pt_lines *lines)
{
    for (uint32_t i = 0; i < lines->count; i++)
        pt_line_free(&lines->at[i]);
    free(lines->at);
    *lines = (struct pt_lines){0};
}
