// SPDX-License-Identifier: GPL-3.0-or-later
// Files of lines of numbers, as they are read: text.c
#ifndef PT_TEXT_H
#define PT_TEXT_H

#include "cells.h"
#include "file.h"
#include "roles.h"

#include <stdbool.h>

enum { MOST_COLUMNS = 32 };

// The words that one column holds among its numbers.
struct pt_text_words {
    uint64_t count, first_line;
    char first[48];
};

struct pt_text {
    const struct pt_input *input;
    struct patina_file *file;
    struct pt_cells cells;
    const uint8_t *at, *end;
    uint64_t line;     // of `at`, from 1
    uint32_t breaks;   // line ends within the quotes of the line before `at`
    uint32_t columns;  // numbers of a row
    uint32_t width;    // words of a row, those that are left out too
    uint32_t left_out; // columns of words, or that number the points: a bit each
    uint32_t needed;   // columns that must hold none: what their names say is no attribute, or all but the first row's words
    uint64_t odd_line; // the first row that has not as many words as the first, 0: all have
    uint32_t odd_width;
    bool words; // there were some, of any kind
    struct pt_text_words found[MOST_COLUMNS];
    uint64_t filled[MOST_COLUMNS]; // numbers of a column
    uint32_t name_count;
    char names[MOST_COLUMNS][NAME_SIZE];
    bool named, ptx, pts;
    enum role roles[MOST_COLUMNS];
    bool float_colors; // 0..1
    double maximum;    // of integer colours: 255 or 65535
    double *staged;
    float **attributes; // a column each, in the order of the columns
    // Of a PTS:
    double announced;      // points, by the lines with a single number
    uint64_t announced_at; // the first of these lines
    // Of a PTX:
    uint32_t most;   // columns or rows of a grid, or scans
    uint32_t scans;  // that were begun
    uint32_t room;   // of file->scans
    void *places[3]; // each point's scan, column and row, from 0: uint16, or uint32 where `most` does not fit
};

// A scan of a PTX.
struct pt_text_scan {
    uint64_t left; // points still to come
    uint64_t cell; // behind the last one: column by column
    uint32_t columns, rows;
    bool bad;          // its matrix is none of a pose: its points are left out
    uint64_t surplus;  // lines behind the grid's that are no header
    double matrix[16]; // as in the file: rows of the transposed
};

// text_lines.c

// Comes to the next line that holds something; false at the end.
bool pt_text_find_line(struct pt_text *t);
// The words of the line at t->at as numbers; t->at comes to its end.
struct pt_line pt_text_read_line(struct pt_text *t, double values[MOST_COLUMNS]);
// Goes back to a line.
void pt_text_rewind(struct pt_text *t, const uint8_t *at, uint64_t line);

// text_scans.c. Those that return a code fail with a message that names the file and the line.

// Whether there is a scan's head. An error where it has a head's lines, but numbers of columns and rows that no grid has.
int pt_text_read_scan(struct pt_text *t, struct pt_text_scan *scan, bool *found);
// Where a scan's header is due, or comes too early. i: the first point behind it.
int pt_text_next_scan(struct pt_text *t, struct pt_text_scan *scan, bool storing, uint64_t i);
// Stores in which cell of the scan's grid point i lies.
void pt_text_keep_places(struct pt_text *t, const struct pt_text_scan *scan, uint64_t i);
// A file that begins as a PTX does, but whose first head is none: its lines would become points. A PTS has one number before its points,
// or several where there are none.
int pt_text_refuse_broken_head(struct pt_text *t, const uint8_t *first, uint64_t line);

#endif
