// SPDX-License-Identifier: GPL-3.0-or-later
// Lines of a text file as numbers, whatever parts them: words between blanks, commas and semicolons, or the cells of a table
// as spreadsheets write it: quoted, empty, decimals behind a comma.
#ifndef PT_CELLS_H
#define PT_CELLS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum pt_parting {
    PT_PARTED_LOOSELY,   // blanks, commas and semicolons, any number of them
    PT_PARTED_BY_BLANKS, // commas are decimal ones
    PT_PARTED_BY_COMMA,  // the rest are tables: exactly one between two cells, which may be empty
    PT_PARTED_BY_SEMICOLON,
    PT_PARTED_BY_TAB,
};

struct pt_cells {
    enum pt_parting parting;
    bool commas, points; // whether there were decimals of either sign so far; not told where parted loosely
};

// What one line held.
struct pt_line {
    uint32_t count;           // numbers and others, at most `most`
    uint32_t width;           // all of them
    uint32_t strange;         // words that are no numbers, NaN in the values
    uint32_t strange_columns; // which of the first 32 they are, a bit each
    uint32_t empty;           // cells without anything, NaN in the values
    uint32_t breaks;          // line ends within quotes
};

// Which parting the lines from `at` have, by the first thousand of them: a table has as many separators in each, at least
// two. The first line may be one of names. Comments (see pt_is_comment) do not count.
enum pt_parting pt_cells_look(const uint8_t *at, const uint8_t *end);

// Reads the line at `at`, returns where it ends (at the line end, not behind it); in a table, quotes keep line ends. Values beyond `most` are dropped.
const uint8_t *pt_cells_read(struct pt_cells *cells, const uint8_t *at, const uint8_t *end, double *values, uint32_t most,
                             struct pt_line *line);

// The next word of a line, without its quotes, cut to fit `size` bytes with its 0. Returns where to go on; NULL at the
// line's end, when there was none.
const uint8_t *pt_cells_name(enum pt_parting parting, const uint8_t *at, const uint8_t *end, char *name, size_t size);

// Blanks, and what else may stand before the first number of a line.
bool pt_cells_skips(enum pt_parting parting, uint8_t c);

// Whether a cell says that there is nothing in it: -, n/a, #N/A, null and the like.
bool pt_cells_says_empty(const char *word);

// A line that begins with #, ! or //.
bool pt_is_comment(const uint8_t *at, const uint8_t *end);

#endif
