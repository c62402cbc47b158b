// SPDX-License-Identifier: GPL-3.0-or-later
#include "cells.h"
#include "number.h"
#include "base/words.h"

#include <math.h>
#include <string.h>

enum { LOOKED_AT = 1000, LONGEST_NUMBER = 64, LONGEST_NOTE = 4096 };

bool pt_is_comment(const uint8_t *at, const uint8_t *end)
{
    return at < end && (*at == '#' || *at == '!' || (*at == '/' && at + 1 < end && at[1] == '/'));
}

// What parts cells; 0 where there are none.
static uint8_t separator(enum pt_parting parting)
{
    return parting == PT_PARTED_BY_COMMA       ? ','
           : parting == PT_PARTED_BY_SEMICOLON ? ';'
           : parting == PT_PARTED_BY_TAB       ? '\t'
                                               : 0;
}

static bool parts(enum pt_parting parting, uint8_t c)
{
    return pt_is_blank(c) || (parting == PT_PARTED_LOOSELY && (c == ',' || c == ';'));
}

bool pt_cells_skips(enum pt_parting parting, uint8_t c) { return parts(parting, c) && c != separator(parting); }

struct span {
    const uint8_t *begin, *end;
};

// The quote that ends a cell whose text begins at `at`; doubled ones are part of it. NULL where none does: within the line, or
// of a table's cell, where line ends may stand between, within LONGEST_NOTE bytes and before a separator or line end.
static const uint8_t *closing_quote(uint8_t between, const uint8_t *at, const uint8_t *end)
{
    bool broken = false;
    end = end - at > LONGEST_NOTE ? at + LONGEST_NOTE : end;
    for (; at < end; at++) {
        broken |= pt_is_line_end(*at);
        if (broken && !between)
            return NULL;
        if (*at != '"')
            continue;
        if (at + 1 < end && at[1] == '"')
            at++;
        else
            return !broken || at + 1 == end || at[1] == between || pt_is_line_end(at[1]) ? at : NULL;
    }
    return NULL;
}

// The cell or word at `at`, without blanks around it and without its quotes; *next: behind it and, of a cell, before the
// separator. Quotes keep separators.
static inline struct span take(enum pt_parting parting, const uint8_t *at, const uint8_t *end, const uint8_t **next)
{
    uint8_t between = separator(parting);
    bool quoted = at < end && *at == '"';
    struct span found = {at + quoted, at};
    if (quoted) {
        const uint8_t *closing = closing_quote(between, at + 1, end);
        for (at = closing ? closing : at + 1; at < end && *at != '"' && !pt_is_line_end(*at); at++)
            ;
        found.end = at;
    }
    while (at < end && !pt_is_line_end(*at) && (between ? *at != between : !parts(parting, *at)))
        at++;
    if (!quoted)
        for (found.end = at; found.end > found.begin && pt_is_blank(found.end[-1]); found.end--)
            ;
    *next = at;
    return found;
}

// Line ends in a cell.
static uint32_t count_breaks(struct span cell)
{
    uint32_t count = 0;
    for (const uint8_t *at = cell.begin; at < cell.end; at++)
        count += *at == '\n' || (*at == '\r' && (at + 1 == cell.end || at[1] != '\n'));
    return count;
}

// A number whose decimals stand behind a comma.
static bool read_comma(struct span word, double *value)
{
    char text[LONGEST_NUMBER];
    size_t length = (size_t)(word.end - word.begin);
    if (length >= sizeof text || memchr(word.begin, '.', length))
        return false;
    memcpy(text, word.begin, length);
    char *comma = memchr(text, ',', length);
    if (!comma || comma == text || comma + 1 == text + length) // "1," and ",1" stand in lists
        return false;
    *comma = '.';
    const uint8_t *end = (const uint8_t *)text + length;
    return pt_parse_number((const uint8_t *)text, end, value) == end;
}

static inline bool read_number(struct pt_cells *cells, enum pt_parting parting, struct span word, double *value)
{
    if (pt_parse_number(word.begin, word.end, value) == word.end) {
        if (parting != PT_PARTED_LOOSELY && !cells->points)
            cells->points = memchr(word.begin, '.', (size_t)(word.end - word.begin)) != NULL;
        return true;
    }
    bool comma = parting != PT_PARTED_LOOSELY && read_comma(word, value);
    cells->commas |= comma;
    return comma;
}

// For one parting each, which the compiler knows: words are read in four fifths of the time.
static inline __attribute__((always_inline)) const uint8_t *read_line(struct pt_cells *cells, enum pt_parting parting,
                                                                      const uint8_t *at, const uint8_t *end, double *values,
                                                                      uint32_t most, struct pt_line *line)
{
    uint8_t between = separator(parting);
    struct pt_line found = {0};
    for (;;) {
        while (at < end && pt_cells_skips(parting, *at))
            at++;
        if (!between && (at == end || pt_is_line_end(*at)))
            break;
        struct span word = take(parting, at, end, &at);
        double value = NAN;
        if (word.begin == word.end) {
            found.empty++;
        } else if (!read_number(cells, parting, word, &value)) {
            value = NAN;
            found.strange++;
            found.breaks += between ? count_breaks(word) : 0;
            found.strange_columns |= found.count < 32 ? UINT32_C(1) << found.count : 0;
        }
        found.width++;
        if (found.count < most)
            values[found.count++] = value;
        if (between && (at == end || *at != between))
            break;
        at += between != 0;
    }
    *line = found;
    return at;
}

const uint8_t *pt_cells_read(struct pt_cells *cells, const uint8_t *at, const uint8_t *end, double *values, uint32_t most,
                             struct pt_line *line)
{
    switch (cells->parting) {
    case PT_PARTED_LOOSELY: return read_line(cells, PT_PARTED_LOOSELY, at, end, values, most, line);
    case PT_PARTED_BY_COMMA: return read_line(cells, PT_PARTED_BY_COMMA, at, end, values, most, line);
    default: return read_line(cells, cells->parting, at, end, values, most, line);
    }
}

const uint8_t *pt_cells_name(enum pt_parting parting, const uint8_t *at, const uint8_t *end, char *name, size_t size)
{
    while (at < end && pt_cells_skips(parting, *at))
        at++;
    if (at >= end || pt_is_line_end(*at))
        return NULL;
    struct span word = take(parting, at, end, &at);
    size_t length = 0;
    for (const uint8_t *p = word.begin; p < word.end && length + 1 < size; p++) {
        name[length++] = (char)(pt_is_line_end(*p) ? ' ' : *p);
        p += *p == '"' && p + 1 < word.end && p[1] == '"';
    }
    name[length] = 0;
    return at + (at < end && separator(parting) && *at == separator(parting));
}

bool pt_cells_says_empty(const char *word)
{
    static const char *const said[] = {"-", "--", "n/a", "na", "#N/A", "null", "none", "nil", "<null>", "?"};
    for (size_t i = 0; i < sizeof said / sizeof *said; i++)
        if (pt_same_word(word, said[i]))
            return true;
    return false;
}

// ---- which parting ---------------------------------------------------------------------------------------------------------

// The next line that holds something and is no comment, behind its first blanks; `end` where there is none.
static const uint8_t *next_line(enum pt_parting parting, const uint8_t *at, const uint8_t *end)
{
    for (;;) {
        while (at < end && (pt_cells_skips(parting, *at) || pt_is_line_end(*at)))
            at++;
        if (!pt_is_comment(at, end))
            return at;
        at = pt_line_end(at, end);
    }
}

// Whether a cell holds several words, all of them numbers: then blanks part numbers too.
static bool holds_numbers(struct span cell)
{
    uint32_t words = 0;
    for (const uint8_t *at = cell.begin; at < cell.end; words++) {
        struct span word = take(PT_PARTED_BY_BLANKS, at, cell.end, &at);
        double value;
        if (pt_parse_number(word.begin, word.end, &value) != word.end)
            return false;
        while (at < cell.end && pt_is_blank(*at))
            at++;
    }
    return words > 1;
}

// Whether the lines are a table of that parting: equally many separators, and below the first line no several numbers within a
// cell. Tabs also align words: then cells of the first line are empty.
static bool is_table(enum pt_parting parting, const uint8_t *at, const uint8_t *end)
{
    uint32_t wanted = 0, lines = 0;
    for (at = next_line(parting, at, end); at < end && lines < LOOKED_AT; at = next_line(parting, at, end), lines++) {
        uint32_t found = 0;
        for (bool more = true; more; found += more, at += more) {
            while (at < end && pt_cells_skips(parting, *at))
                at++;
            struct span word = take(parting, at, end, &at);
            if ((!lines && parting == PT_PARTED_BY_TAB && word.begin == word.end) || (lines && holds_numbers(word)))
                return false;
            more = at < end && *at == separator(parting);
        }
        wanted = lines ? wanted : found;
        if (found < 2 || found != wanted)
            return false;
    }
    return lines > 0;
}

// Whether blanks part numbers of which some have decimals behind a comma: equally many in each line, at least three. The first
// line does not count where it holds names.
static bool has_decimal_commas(const uint8_t *at, const uint8_t *end)
{
    struct pt_cells cells = {.parting = PT_PARTED_BY_BLANKS};
    uint32_t wanted = 0, lines = 0;
    at = next_line(cells.parting, at, end);
    for (; at < end && lines < LOOKED_AT; at = next_line(cells.parting, pt_line_end(at, end), end), lines++) {
        struct pt_line line;
        double values[1];
        uint32_t words = 0;
        pt_cells_read(&cells, at, end, values, 1, &line);
        char name[2];
        for (const uint8_t *p = at; (p = pt_cells_name(PT_PARTED_BY_BLANKS, p, end, name, sizeof name));)
            words++;
        if (!lines && line.strange)
            continue;
        wanted = wanted ? wanted : words;
        if (line.strange || words < 3 || words != wanted)
            return false;
    }
    return cells.commas > 0;
}

enum pt_parting pt_cells_look(const uint8_t *at, const uint8_t *end)
{
    static const enum pt_parting tables[] = {PT_PARTED_BY_SEMICOLON, PT_PARTED_BY_TAB, PT_PARTED_BY_COMMA};
    for (size_t i = 0; i < sizeof tables / sizeof *tables; i++)
        if (is_table(tables[i], at, end))
            return tables[i];
    return has_decimal_commas(at, end) ? PT_PARTED_BY_BLANKS : PT_PARTED_LOOSELY;
}
