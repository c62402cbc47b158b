// SPDX-License-Identifier: GPL-3.0-or-later
// The scans of a PTX: their heads, and the cells of their grids.
#include "text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// Reads "columns, rows, position, three axes, four rows of a matrix". Returns how many of the ten lines are that; size: the two numbers
// of the first two. Ten: the caller checks the numbers.
static int read_head(struct pt_text *t, struct pt_text_scan *scan, double size[2], uint64_t *line_of_head)
{
    double values[MOST_COLUMNS];
    size[0] = size[1] = 0;
    for (int i = 0; i < 10; i++) {
        uint32_t wanted = i < 2 ? 1 : i < 6 ? 3 : 4;
        if (!pt_text_find_line(t))
            return i;
        *line_of_head = i ? *line_of_head : t->line;
        struct pt_line line = pt_text_read_line(t, values);
        if (line.count != wanted || line.strange)
            return i;
        if (i < 2)
            size[i] = values[0];
        else if (i >= 6)
            memcpy(scan->matrix + 4 * (i - 6), values, 4 * sizeof *values);
    }
    return 10;
}

int pt_text_read_scan(struct pt_text *t, struct pt_text_scan *scan, bool *found)
{
    double size[2];
    uint64_t line = t->line;
    *found = read_head(t, scan, size, &line) == 10;
    if (!*found)
        return PATINA_OK;
    if (!(size[0] >= 0 && size[1] >= 0 && size[0] < 4294967295.0 && size[1] < 4294967295.0 &&
          size[0] * size[1] < 4294967295.0 && size[0] == floor(size[0]) && size[1] == floor(size[1]))) {
        return pt_fail(
            NULL, PATINA_ERROR_FORMAT,
            "%s: line %llu: scan %u announces a grid of %.10g columns and %.10g rows: whole numbers, with fewer than 2^32 "
            "cells, are needed",
            t->input->name, (unsigned long long)line, t->scans, size[0], size[1]);
    }
    scan->columns = (uint32_t)size[0];
    scan->rows = (uint32_t)size[1];
    scan->left = (uint64_t)scan->columns * scan->rows;
    scan->cell = scan->surplus = 0;
    const double *place = scan->matrix + 12;
    scan->bad = !pt_turns(scan->matrix, 4) || !isfinite(place[0] + place[1] + place[2]);
    return PATINA_OK;
}

// The same; where it is none, t->at stays.
static int try_scan(struct pt_text *t, struct pt_text_scan *scan, bool *is_one)
{
    const uint8_t *at = t->at;
    const uint64_t line = t->line;
    const uint32_t breaks = t->breaks;
    struct pt_text_scan found = {0};
    const int code = pt_text_read_scan(t, &found, is_one);
    if (code || *is_one) {
        *scan = found;
        return code;
    }
    t->at = at;
    t->line = line;
    t->breaks = breaks;
    return PATINA_OK;
}

static int keep_scan(struct pt_text *t, const struct pt_text_scan *scan, uint64_t first)
{
    struct patina_file *file = t->file;
    if (file->scan_count == t->room) {
        uint32_t room = 2 * t->room + 8;
        struct pt_scan *grown = realloc(file->scans, room * sizeof *grown);
        if (!grown)
            return PATINA_ERROR_MEMORY;
        file->scans = grown;
        t->room = room;
    }
    struct pt_scan *kept = &file->scans[file->scan_count++];
    *kept = (struct pt_scan){.first = first, .columns = scan->columns, .rows = scan->rows, .nowhere = scan->bad};
    for (int i = 0; i < 12; i++)
        kept->pose[i] = scan->matrix[4 * (i % 4) + i / 4];
    if (!scan->bad)
        memcpy(kept->station, scan->matrix + 12, sizeof kept->station);
    return PATINA_OK;
}

void pt_text_keep_places(struct pt_text *t, const struct pt_text_scan *scan, uint64_t i)
{
    uint64_t cell = scan->cell - 1;
    const uint64_t values[3] = {t->file->scan_count - 1, cell / scan->rows, cell % scan->rows};
    t->file->scans[t->file->scan_count - 1].count++;
    for (int k = 0; k < 3; k++) {
        if (t->most < UINT16_MAX)
            ((uint16_t *)t->places[k])[i] = (uint16_t)values[k];
        else
            ((uint32_t *)t->places[k])[i] = (uint32_t)values[k];
    }
}

int pt_text_next_scan(struct pt_text *t, struct pt_text_scan *scan, bool storing, uint64_t i)
{
    const struct pt_text_scan before = *scan;
    double values[MOST_COLUMNS];
    bool is_one;
    const int code = try_scan(t, scan, &is_one);
    if (code)
        return code;
    if (!is_one) { // more lines than the grid has cells
        scan->surplus++;
        pt_text_read_line(t, values);
        return PATINA_OK;
    }
    if (storing && t->scans)
        pt_file_end_scan(t->file, before.left, before.surplus);
    t->scans++;
    t->most = scan->columns > t->most ? scan->columns : t->most;
    t->most = scan->rows > t->most ? scan->rows : t->most;
    t->most = t->scans > t->most ? t->scans : t->most;
    return storing ? keep_scan(t, scan, i) : PATINA_OK;
}

int pt_text_refuse_broken_head(struct pt_text *t, const uint8_t *first, uint64_t line)
{
    double size[2];
    struct pt_text_scan scan;
    uint64_t head;
    pt_text_rewind(t, first, line);
    const int lines = read_head(t, &scan, size, &head);
    const uint64_t broken = t->line;
    const bool ended = !pt_text_find_line(t);
    pt_text_rewind(t, first, line);
    if (lines < 2 || (lines == 2 && ended) || size[0] == 0)
        return PATINA_OK;
    return pt_fail(NULL, PATINA_ERROR_FORMAT,
                   "%s: line %llu: the head of scan 0 is broken: behind its columns and rows, four lines of three numbers and "
                   "four of four "
                   "are needed",
                   t->input->name, (unsigned long long)broken);
}
