// SPDX-License-Identifier: GPL-3.0-or-later
// Points as lines of numbers: XYZ and CSV with or without a line of names, PTS (a line of how many points follow), PTX
// (scans with a matrix each, after Leica's description of the format). What parts their words: cells.h.
//
// What a column is follows from its name, else from how many columns there are and what the first rows hold: 4: x y z
// intensity; 6: x y z and colour bytes, or unit normals; 7: x y z intensity colour; 9: colour bytes and normals. What is
// none of these becomes an attribute.
//
// Words among the numbers, decided in this order once all rows are counted (decide_words):
// 1. A word where a coordinate, colour or normal is needed: the file is refused, by its line. Needed is what the names say
//    so, and without names every column in which the first row holds a number.
// 2. "-", "n/a" and the like are empty cells.
// 3. Of a column's cells that are not empty, more than a tenth are words: it is left out, and named.
// 4. Else those words are empty cells, counted and told.
// 5. Columns were left out, and a row has not as many words as the first: refused, since which is which cannot be told.
// 6. Without names, a first column of whole numbers that count up by one, at least four columns of numbers and words at the
//    row's end: it numbers the points and is left out; where that is not so, what was taken as x, y and z is told.
#include "base/color.h"
#include "base/progress.h"
#include "cells.h"
#include "file.h"
#include "number.h"
#include "roles.h"
#include "base/words.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_COLUMNS = 32, SAMPLES = 1000, POLL_LINES = 8192, WORD_SHARE = 10 };

// The words that one column holds among its numbers.
struct words {
    uint64_t count, first_line;
    char first[48];
};

struct text {
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
    struct words found[MOST_COLUMNS];
    uint64_t filled[MOST_COLUMNS]; // numbers of a column
    uint32_t name_count;
    char names[MOST_COLUMNS][NAME_SIZE];
    bool named, ptx, pts;
    enum role roles[MOST_COLUMNS];
    bool float_colors; // 0..1
    double maximum;    // of integer colours: 255 or 65535
    double *staged;
    float **attributes; // a column each, in the order of the columns
    // Of a PTX:
    double announced;      // of a PTS: points, by the lines with a single number
    uint64_t announced_at; // the first of these lines
    uint32_t most;         // columns or rows of a grid, or scans
    uint32_t scans;        // that were begun
    uint32_t room;         // of file->scans
    void *places[3];       // each point's scan, column and row, from 0: uint16, or uint32 where `most` does not fit
};

// ---- lines -----------------------------------------------------------------------------------------------------------

// Comes to the next line that holds something; false at the end.
static bool find_line(struct text *t)
{
    t->line += t->breaks;
    t->breaks = 0;
    for (;;) {
        while (t->at < t->end && (pt_cells_skips(t->cells.parting, *t->at) || pt_is_line_end(*t->at))) {
            t->line += *t->at == '\n' || (*t->at == '\r' && (t->at + 1 == t->end || t->at[1] != '\n'));
            t->at++;
        }
        if (t->at == t->end || !pt_is_comment(t->at, t->end))
            return t->at < t->end;
        while (t->at < t->end && !pt_is_line_end(*t->at))
            t->at++;
    }
}

// The words of the line at t->at as numbers; t->at comes to its end.
static struct pt_line read_line(struct text *t, double values[MOST_COLUMNS])
{
    struct pt_line line;
    t->at = pt_cells_read(&t->cells, t->at, t->end, values, MOST_COLUMNS, &line);
    t->breaks = line.breaks;
    return line;
}

static void leave_out(const struct text *t, double values[MOST_COLUMNS])
{
    uint32_t kept = 0;
    for (uint32_t c = 0; t->left_out && c < MOST_COLUMNS; c++)
        if (!(t->left_out >> c & 1))
            values[kept++] = values[c];
}

static int fail_at(const struct text *t, const char *what)
{
    return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: line %llu: %s", t->input->name, (unsigned long long)t->line, what);
}

// ---- what the columns are ----------------------------------------------------------------------------------------------

static void read_names(struct text *t, const uint8_t *at)
{
    char name[NAME_SIZE];
    t->named = true;
    for (t->name_count = 0; (at = pt_cells_name(t->cells.parting, at, t->end, name, sizeof name)); t->name_count++)
        if (t->name_count < MOST_COLUMNS)
            memcpy(t->names[t->name_count], name, NAME_SIZE);
    t->name_count = t->name_count < MOST_COLUMNS ? t->name_count : MOST_COLUMNS;
}

static bool has(const struct text *t, enum role first) { return pt_roles_have(t->roles, t->columns, first); }

static void set_three(struct text *t, uint32_t column, enum role first)
{
    for (uint32_t k = 0; k < 3; k++)
        t->roles[column + k] = first + k;
}

// Whether three columns of the sampled rows look like unit normals: nine of ten have a length within 2% of 1. Rows of NaN do
// not count.
static bool are_normals(double (*rows)[MOST_COLUMNS], uint32_t count, uint32_t column)
{
    uint32_t good = 0, finite = 0;
    for (uint32_t i = 0; i < count; i++) {
        const double *n = rows[i] + column, length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        finite += isfinite(length) != 0;
        good += fabs(length - 1.0) < 0.02;
    }
    return 10 * good >= 9 * finite && finite;
}

static void guess_roles(struct text *t, double (*rows)[MOST_COLUMNS], uint32_t count)
{
    set_three(t, 0, X);
    if (t->columns == 7) {
        snprintf(t->names[3], NAME_SIZE, "intensity");
        set_three(t, 4, RED);
    } else if (t->columns == 4) {
        snprintf(t->names[3], NAME_SIZE, "intensity");
    }
    if (t->columns != 6 && t->columns < 9)
        return;
    for (uint32_t column = 3; column <= 6 && column + 3 <= t->columns; column += 3)
        set_three(t, column, are_normals(rows, count, column) && !has(t, NX) ? NX : has(t, RED) ? ATTRIBUTE : RED);
    for (uint32_t c = 3; c < t->columns; c++)
        t->roles[c] = t->roles[c] > ALPHA || (c > 8) ? ATTRIBUTE : t->roles[c];
}

// Colours that stay at or below 1 with parts of it are shares of 1; above 255 they have 16 bits.
static void guess_colors(struct text *t, double (*rows)[MOST_COLUMNS], uint32_t count)
{
    double most = 0.0;
    bool whole = true;
    for (uint32_t i = 0; i < count; i++)
        for (uint32_t c = 0; c < t->columns; c++)
            if (t->roles[c] >= RED && t->roles[c] <= BLUE && isfinite(rows[i][c])) {
                most = fmax(most, rows[i][c]);
                whole &= rows[i][c] == floor(rows[i][c]);
            }
    t->float_colors = most <= 1.0 && !whole;
    t->maximum = t->float_colors ? 1.0 : most > 255.0 ? 65535.0 : 255.0;
}

// ---- the scans of a PTX --------------------------------------------------------------------------------------------------

struct scan {
    uint64_t left; // points still to come
    uint64_t cell; // behind the last one: column by column
    uint32_t columns, rows;
    bool bad;          // its matrix is none of a pose: its points are left out
    uint64_t surplus;  // lines behind the grid's that are no header
    double matrix[16]; // as in the file: rows of the transposed
};

// Reads "columns, rows, position, three axes, four rows of a matrix". Returns how many of the ten lines are that; size: the two numbers
// of the first two. Ten: the caller checks the numbers.
static int read_head(struct text *t, struct scan *scan, double size[2], uint64_t *line_of_head)
{
    double values[MOST_COLUMNS];
    size[0] = size[1] = 0;
    for (int i = 0; i < 10; i++) {
        uint32_t wanted = i < 2 ? 1 : i < 6 ? 3 : 4;
        if (!find_line(t))
            return i;
        *line_of_head = i ? *line_of_head : t->line;
        struct pt_line line = read_line(t, values);
        if (line.count != wanted || line.strange)
            return i;
        if (i < 2)
            size[i] = values[0];
        else if (i >= 6)
            memcpy(scan->matrix + 4 * (i - 6), values, 4 * sizeof *values);
    }
    return 10;
}

// Whether there is a scan's head. An error where it has a head's lines, but numbers of columns and rows that no grid has.
static int read_scan(struct text *t, struct scan *scan, bool *found)
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
static int try_scan(struct text *t, struct scan *scan, bool *is_one)
{
    const uint8_t *at = t->at;
    const uint64_t line = t->line;
    const uint32_t breaks = t->breaks;
    struct scan found = {0};
    const int code = read_scan(t, &found, is_one);
    if (code || *is_one) {
        *scan = found;
        return code;
    }
    t->at = at;
    t->line = line;
    t->breaks = breaks;
    return PATINA_OK;
}

static int keep_scan(struct text *t, const struct scan *scan, uint64_t first)
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

static void keep_places(struct text *t, const struct scan *scan, uint64_t i)
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

// ---- rows ------------------------------------------------------------------------------------------------------------------

static void place(const struct scan *scan, double p[3])
{
    double q[3];
    for (int k = 0; k < 3; k++)
        q[k] = p[0] * scan->matrix[k] + p[1] * scan->matrix[4 + k] + p[2] * scan->matrix[8 + k] + scan->matrix[12 + k];
    memcpy(p, q, sizeof q);
}

static void store(struct text *t, uint64_t i, const double values[MOST_COLUMNS])
{
    struct patina_file *file = t->file;
    uint32_t attribute = 0;
    for (uint32_t c = 0; c < t->columns; c++) {
        enum role role = t->roles[c];
        double v = values[c];
        if (role == ATTRIBUTE) {
            t->attributes[attribute++][i] = (float)v;
        } else if (role <= Z) {
            t->staged[3 * i + (role - X)] = v;
        } else if (role <= NZ) {
            file->normal[3 * i + (role - NX)] = (float)v;
        } else if (t->float_colors) {
            double s = v > 0.0 ? v : 0.0; // text colours of 0..1 are sRGB too
            ((float *)file->color)[4 * i + (role - RED)] = (float)(role == ALPHA ? s : pt_linear_of_srgb(s));
        } else {
            double clamped = v > 0.0 ? (v < t->maximum ? v + 0.5 : t->maximum) : 0.0;
            if (file->color_type == PATINA_UINT8)
                ((uint8_t *)file->color)[4 * i + (role - RED)] = (uint8_t)clamped;
            else
                ((uint16_t *)file->color)[4 * i + (role - RED)] = (uint16_t)clamped;
        }
    }
}

static void call_column(const struct text *t, uint32_t c, char called[NAME_SIZE + 16])
{
    if (c < t->name_count && t->names[c][0])
        snprintf(called, NAME_SIZE + 16, "column '%s'", t->names[c]);
    else
        snprintf(called, NAME_SIZE + 16, "column %u", c + 1);
}

static int refuse_word(const struct text *t, uint32_t column, const char *word)
{
    char what[320], called[NAME_SIZE + 16];
    bool thousands = strchr(word, ',') && strspn(word, "+-0123456789.,") == strlen(word);
    call_column(t, column, called);
    snprintf(what, sizeof what, "%s holds a word, '%.40s', where a number is needed; %s", called, word,
             thousands  ? "marks between thousands are not read, take them out"
             : t->named ? "take the line out, or correct it"
                        : "a first line that names x, y, z and the others lets columns of words be left out");
    return fail_at(t, what);
}

// Counts the words of the row at `at`, in these columns.
static int meet_words(struct text *t, const uint8_t *at, uint32_t columns)
{
    char word[NAME_SIZE] = "";
    for (uint32_t c = 0; c < MOST_COLUMNS && (at = pt_cells_name(t->cells.parting, at, t->end, word, sizeof word)); c++) {
        if (!(columns >> c & 1))
            continue;
        if (t->needed >> c & 1)
            return refuse_word(t, c, word);
        if (pt_cells_says_empty(word))
            continue;
        struct words *found = &t->found[c];
        if (!found->count++) {
            found->first_line = t->line;
            snprintf(found->first, sizeof found->first, "%.40s", word);
        }
    }
    return PATINA_OK;
}

static int fail_width(const struct text *t, const char *what, uint32_t width, uint32_t wanted)
{
    char text[96];
    snprintf(text, sizeof text, "%u %s; %u were expected", width, what, wanted);
    return fail_at(t, text);
}

// Before rows are stored: what a row has, against the first one.
static int check_row(struct text *t, const uint8_t *at, struct pt_line line, const double values[MOST_COLUMNS])
{
    if (!t->width) {
        t->width = line.width;
        t->columns = line.count;
    }
    if (line.width != t->width && !t->odd_line) {
        t->odd_line = t->line;
        t->odd_width = line.width;
    }
    int code = line.strange ? meet_words(t, at, line.strange_columns) : PATINA_OK;
    if (!code && (line.count < t->columns || (line.strange && line.width != t->width)))
        code = fail_width(t, line.strange || t->words ? "words" : "numbers", line.width, t->width);
    t->words |= line.strange > 0;
    for (uint32_t c = 0; c < line.count; c++)
        t->filled[c] += !isnan(values[c]);
    return code;
}

// Whether the line holds a single number, as a scan's header begins and no point does.
static bool is_single(struct text *t)
{
    const uint8_t *at = t->at;
    while (at<t->end && * at> ' ')
        at++;
    while (at < t->end && pt_is_blank(*at))
        at++;
    return at == t->end || pt_is_line_end(*at);
}

// Where a scan's header is due, or comes too early. i: the first point behind it.
static int next_scan(struct text *t, struct scan *scan, bool storing, uint64_t i)
{
    const struct scan before = *scan;
    double values[MOST_COLUMNS];
    bool is_one;
    const int code = try_scan(t, scan, &is_one);
    if (code)
        return code;
    if (!is_one) { // more lines than the grid has cells
        scan->surplus++;
        read_line(t, values);
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

// Goes over all rows; stores them, or only counts them and keeps the first ones.
static int walk(struct text *t, bool storing, double (*sample)[MOST_COLUMNS], uint64_t *count)
{
    struct scan scan = {0};
    uint64_t i = 0, polled = 0;
    t->scans = 0;
    while (find_line(t)) {
        double values[MOST_COLUMNS] = {0};
        if (++polled % POLL_LINES == 0) {
            float half = 0.5f * (float)((double)(t->at - t->input->data) / (double)t->input->size);
            pt_progress_set(t->input->progress, storing ? 0.5f + half : half);
            if (pt_progress_cancelled(t->input->progress))
                return pt_fail(NULL, PATINA_ERROR_CANCELLED, "%s: reading was cancelled", t->input->name);
        }
        if (t->ptx && (!scan.left || is_single(t))) {
            int code = next_scan(t, &scan, storing, i);
            if (code)
                return code;
            continue;
        }
        const uint8_t *start = t->at;
        struct pt_line line = read_line(t, values);
        if (t->pts && line.count == 1 && !line.strange) { // how many points follow
            if (!storing) {
                t->announced += values[0];
                t->announced_at = t->announced_at ? t->announced_at : t->line;
            }
            continue;
        }
        if (line.empty && line.empty == line.width)
            continue; // a table's last lines
        if (t->ptx && t->at == t->end && line.count < t->columns)
            break; // the file was cut short within a point
        int code = storing ? PATINA_OK : check_row(t, start, line, values);
        if (code)
            return code;
        if (storing)
            leave_out(t, values);
        if (t->cells.commas && t->cells.points)
            return fail_at(t, "decimals behind a comma, and others in this file behind a point: which is which cannot be told");
        if (t->ptx) {
            scan.left--;
            scan.cell++;
            if (scan.bad || (values[0] == 0.0 && values[1] == 0.0 && values[2] == 0.0))
                continue; // the beam met nothing
            place(&scan, values);
        }
        if (sample && i < SAMPLES)
            memcpy(sample[i], values, sizeof values);
        if (storing) {
            store(t, i, values);
            if (t->ptx)
                keep_places(t, &scan, i);
        }
        i++;
    }
    if (storing && t->scans)
        pt_file_end_scan(t->file, scan.left, scan.surplus);
    if (storing)
        pt_file_tell_scans(t->file, t->input->name);
    *count = i;
    return PATINA_OK;
}

static void rewind_text(struct text *t, const uint8_t *body, uint64_t line)
{
    t->at = body;
    t->line = line;
    t->breaks = 0;
}

// ---- columns -----------------------------------------------------------------------------------------------------------------

static int add_attribute(struct text *t, const char *name, uint32_t type, void **data)
{
    *data = malloc(t->file->count * pt_type_size(type) + 1);
    return *data ? pt_file_add_attribute(t->file, name, type, *data) : PATINA_ERROR_MEMORY;
}

static int make_places(struct text *t)
{
    static const char *const names[] = {"scan", "column", "row"};
    uint32_t type = t->most < UINT16_MAX ? PATINA_UINT16 : PATINA_UINT32;
    for (int k = 0; k < 3; k++)
        if (add_attribute(t, names[k], type, &t->places[k]))
            return PATINA_ERROR_MEMORY;
    return PATINA_OK;
}

static int make_columns(struct text *t)
{
    struct patina_file *file = t->file;
    uint32_t attribute = 0;
    t->attributes = calloc(MOST_COLUMNS, sizeof *t->attributes);
    t->staged = malloc(file->count * 3 * sizeof *t->staged + 1);
    if (!t->attributes || !t->staged)
        return PATINA_ERROR_MEMORY;
    for (uint32_t c = 0; c < t->columns; c++) {
        if (!t->names[c][0])
            snprintf(t->names[c], NAME_SIZE, "column_%u", c + 1);
        void *data = NULL;
        if (t->roles[c] != ATTRIBUTE)
            continue;
        if (add_attribute(t, t->names[c], PATINA_FLOAT32, &data))
            return PATINA_ERROR_MEMORY;
        t->attributes[attribute++] = data;
    }
    if (t->ptx && make_places(t))
        return PATINA_ERROR_MEMORY;
    if (has(t, NX) && !(file->normal = malloc(file->count * 3 * sizeof(float) + 1)))
        return PATINA_ERROR_MEMORY;
    if (!has(t, RED))
        return PATINA_OK;
    file->color_type = t->float_colors ? PATINA_FLOAT32 : t->maximum > 255.0 ? PATINA_UINT16 : PATINA_UINT8;
    size_t size = pt_type_size(file->color_type);
    file->color = malloc(file->count * 4 * size + 1);
    if (!file->color)
        return PATINA_ERROR_MEMORY;
    if (file->color_type == PATINA_FLOAT32)
        for (uint64_t i = 0; i < 4 * file->count; i++)
            ((float *)file->color)[i] = 1.0f;
    else
        memset(file->color, 0xFF, file->count * 4 * size);
    return PATINA_OK;
}

// ---- the whole -----------------------------------------------------------------------------------------------------------------

// Whether there are names of x, y and z among the names.
static bool names_points(const struct text *t)
{
    struct text named = *t;
    named.columns = t->name_count;
    pt_roles_by_name(named.roles, named.names, named.columns);
    return has(&named, X);
}

// A bit for each of those that are no attributes.
static uint32_t needed_columns(const struct text *t)
{
    struct text named = *t;
    uint32_t found = 0;
    named.columns = t->name_count;
    pt_roles_by_name(named.roles, named.names, named.columns);
    for (uint32_t c = 0; c < t->name_count; c++)
        found |= (uint32_t)(named.roles[c] != ATTRIBUTE) << c;
    return found;
}

static int fail_names(const struct text *t)
{
    char names[128] = "";
    uint32_t c = 0;
    for (; c < t->name_count && strlen(names) + strlen(t->names[c]) + 8 < sizeof names; c++)
        snprintf(names + strlen(names), sizeof names - strlen(names), "%s%s", c ? ", " : "", t->names[c]);
    return pt_fail(NULL, PATINA_ERROR_FORMAT,
                   "%s: no columns x, y and z in its line of names: %s%s; rename the columns that are", t->input->name, names,
                   c < t->name_count ? ", ..." : "");
}

// A file that begins as a PTX does, but whose first head is none: its lines would become points. A PTS has one number before its points,
// or several where there are none.
static int refuse_broken_head(struct text *t, const uint8_t *first, uint64_t line)
{
    double size[2];
    struct scan scan;
    uint64_t head;
    rewind_text(t, first, line);
    const int lines = read_head(t, &scan, size, &head);
    const uint64_t broken = t->line;
    const bool ended = !find_line(t);
    rewind_text(t, first, line);
    if (lines < 2 || (lines == 2 && ended) || size[0] == 0)
        return PATINA_OK;
    return pt_fail(NULL, PATINA_ERROR_FORMAT,
                   "%s: line %llu: the head of scan 0 is broken: behind its columns and rows, four lines of three numbers and "
                   "four of four "
                   "are needed",
                   t->input->name, (unsigned long long)broken);
}

// Logs where a PTS announces another number of points than it holds.
static void compare_announced(const struct text *t)
{
    if (t->pts && t->announced_at && !(t->announced == (double)t->file->count))
        pt_log(PT_LOG_WARNING, "%s: line %llu announces %.15g points, the file holds %llu", t->input->name,
               (unsigned long long)t->announced_at, t->announced, (unsigned long long)t->file->count);
}

// Looks at the first lines: which of the formats this is, and where its rows begin.
static int look(struct text *t, const uint8_t **body, uint64_t *line)
{
    double values[MOST_COLUMNS];
    struct scan scan;
    const uint8_t *start = t->at;
    t->needed = ~UINT32_C(0);
    if (!find_line(t))
        return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: neither a PLY file nor lines of numbers: there is nothing in it",
                       t->input->name);
    while (t->at > start && !pt_is_line_end(t->at[-1]))
        t->at--; // a table's first cell may be empty
    const uint8_t *first = *body = t->at;
    *line = t->line;
    const int code = read_scan(t, &scan, &t->ptx);
    rewind_text(t, first, *line);
    if (code || t->ptx)
        return code;
    struct pt_line words = read_line(t, values);
    t->pts = words.count == 1 && !words.strange;
    if (t->pts)
        return refuse_broken_head(t, first, *line);
    t->cells.parting = pt_cells_look(first, t->end);
    t->at = first;
    words = read_line(t, values);
    t->cells.commas = t->cells.points = 0;
    if (words.strange && words.strange < 3 && words.count >= words.strange + 3) {
        t->needed = ~words.strange_columns; // point names before the numbers, a code behind them
    } else if (words.strange) {
        if (words.count < 3 || words.strange < 3)
            return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: neither a PLY file nor lines of numbers", t->input->name);
        read_names(t, first);
        if (!names_points(t))
            return fail_names(t);
        t->needed = needed_columns(t);
        find_line(t);
        *body = t->at;
        *line = t->line;
        return PATINA_OK;
    }
    rewind_text(t, first, *line);
    return PATINA_OK;
}

static bool always_empty(double (*sample)[MOST_COLUMNS], uint32_t count, uint32_t column)
{
    bool empty = true;
    for (uint32_t i = 0; i < count; i++)
        empty &= isnan(sample[i][column]);
    return empty;
}

static int choose_roles(struct text *t, double (*sample)[MOST_COLUMNS])
{
    uint32_t count = t->file->count < SAMPLES ? (uint32_t)t->file->count : SAMPLES;
    if (t->columns < 3)
        return fail_at(t, "fewer than three numbers");
    while (!t->named && t->columns > 3 && always_empty(sample, count, t->columns - 1))
        t->columns--; // each line ends with a separator
    pt_roles_by_name(t->roles, t->names, t->columns);
    if (t->named && !has(t, X))
        return fail_names(t);
    if (t->named && t->cells.parting == PT_PARTED_LOOSELY && t->columns == 2 * t->name_count)
        return fail_at(t, "twice as many numbers as names: commas between them and decimal commas cannot be told apart");
    if (!t->named)
        guess_roles(t, sample, count);
    guess_colors(t, sample, count);
    if (t->ptx && has(t, RED)) {
        t->float_colors = false;
        t->maximum = 255.0;
    }
    return PATINA_OK;
}

// Whether the sampled rows number the points in their first column, before four columns of numbers and words at their end.
static bool has_numbers_of_points(const struct text *t, double (*sample)[MOST_COLUMNS], uint32_t count)
{
    uint32_t left_out = 0;
    for (uint32_t c = 0; c < t->columns; c++)
        left_out += t->left_out >> c & 1;
    if (t->columns - left_out < 4 || !(t->left_out >> (t->columns - 1) & 1) || (t->left_out & 1) || count < 3)
        return false;
    bool counts = sample[0][0] == floor(sample[0][0]);
    for (uint32_t i = 1; i < count; i++)
        counts &= sample[i][0] == sample[i - 1][0] + 1.0;
    return counts;
}

// Says which columns of the file, from 1, are taken for a place where nothing names them.
static void tell_places(const struct text *t, bool numbered)
{
    uint32_t at[4] = {0}, found = 0;
    for (uint32_t c = 0; c < t->columns && found < 4; c++)
        if (!(t->left_out >> c & 1))
            at[found++] = c + 1;
    if (found == 4 || numbered)
        pt_log(PT_LOG_WARNING, "%s: %sx, y and z are taken from columns %u, %u and %u; a first line of names would tell",
               t->input->name, numbered ? "column 1 counts up by one: point numbers, left out; " : "", at[0], at[1], at[2]);
}

// What becomes of columns with words: see the head.
static int decide_words(struct text *t, double (*sample)[MOST_COLUMNS])
{
    char called[NAME_SIZE + 16];
    for (uint32_t c = 0; c < MOST_COLUMNS; c++) {
        const struct words *found = &t->found[c];
        if (!found->count)
            continue;
        call_column(t, c, called);
        if (WORD_SHARE * found->count > found->count + t->filled[c]) {
            t->left_out |= UINT32_C(1) << c;
            pt_log(PT_LOG_WARNING, "%s: %s holds words ('%s' in line %llu) and is left out", t->input->name, called,
                   found->first, (unsigned long long)found->first_line);
        } else {
            pt_log(PT_LOG_WARNING, "%s: %s holds %llu word%s among its numbers ('%s' in line %llu), taken as empty",
                   t->input->name, called, (unsigned long long)found->count, found->count > 1 ? "s" : "", found->first,
                   (unsigned long long)found->first_line);
        }
    }
    if (!t->left_out)
        return PATINA_OK;
    bool loose = t->cells.parting == PT_PARTED_LOOSELY || t->cells.parting == PT_PARTED_BY_BLANKS;
    if (t->odd_line) {
        t->line = t->odd_line;
        return fail_width(t, "words", t->odd_width, t->width);
    }
    if (t->named && (t->width < t->name_count || (loose && t->width > t->name_count)))
        return fail_at(t, t->width < t->name_count ? "fewer words than names: which column is which cannot be told"
                                                   : "more words than names: which column is which cannot be told");
    uint32_t count = t->file->count < SAMPLES ? (uint32_t)t->file->count : SAMPLES;
    if (!t->named) {
        bool numbered = has_numbers_of_points(t, sample, count);
        t->left_out |= numbered;
        tell_places(t, numbered);
    }
    uint32_t kept = 0, columns = t->columns;
    for (uint32_t c = 0; c < columns; c++)
        if (!(t->left_out >> c & 1))
            memmove(t->names[kept++], t->names[c], NAME_SIZE);
    for (t->columns = kept; kept < MOST_COLUMNS; kept++)
        t->names[kept][0] = 0;
    t->name_count = t->named ? t->columns : 0;
    for (uint32_t i = 0; i < count; i++)
        leave_out(t, sample[i]);
    return PATINA_OK;
}

static int read_all(struct text *t)
{
    double(*sample)[MOST_COLUMNS] = calloc(SAMPLES, sizeof *sample);
    const uint8_t *body = t->at;
    uint64_t line = 1, count;
    int code = sample ? look(t, &body, &line) : PATINA_ERROR_MEMORY;
    if (!code) {
        rewind_text(t, body, line);
        code = walk(t, false, sample, &t->file->count);
    }
    if (!code) {
        compare_announced(t);
        t->line = line;
        code = decide_words(t, sample);
    }
    if (!code && t->file->count > UINT32_MAX - 1)
        code = pt_fail(NULL, PATINA_ERROR_TOO_MANY_POINTS, "%s: %llu points, more than 2^32 - 2", t->input->name,
                       (unsigned long long)t->file->count);
    if (!code && t->file->count && !(code = choose_roles(t, sample)) && !(code = make_columns(t))) {
        rewind_text(t, body, line);
        code = walk(t, true, NULL, &count);
    }
    free(sample);
    if (code == PATINA_ERROR_MEMORY)
        pt_fail(NULL, code, "%s: no memory for %llu points", t->input->name, (unsigned long long)t->file->count);
    return code;
}

// Where the lines begin: behind a byte order mark, and behind a first line "sep=;" as Excel writes it.
static struct text begin(const struct pt_input *input)
{
    struct text t = {.input = input, .at = input->data, .end = input->data + input->size, .line = 1};
    if (input->size >= 3 && !memcmp(input->data, "\xEF\xBB\xBF", 3))
        t.at += 3;
    if (t.end - t.at > 6 && pt_same_start((const char *)t.at, "sep=", 4) && pt_is_line_end(t.at[5]))
        t.at += 5;
    return t;
}

static bool is_utf16(const struct pt_input *input)
{
    return input->size >= 2 && (!memcmp(input->data, "\xFF\xFE", 2) || !memcmp(input->data, "\xFE\xFF", 2));
}

int pt_text_read(struct patina_file *file, const struct pt_input *input)
{
    if (is_utf16(input))
        return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: a text in UTF-16, which is not read; save it as CSV UTF-8", input->name);
    struct text t = begin(input);
    t.file = file;
    int code = read_all(&t);
    free(t.attributes);
    if (code || !t.staged) {
        free(t.staged);
        if (!code && !(file->position = malloc(sizeof *file->position)))
            code = PATINA_ERROR_MEMORY;
    } else {
        pt_file_place(file, t.staged);
        code = pt_file_grid_normals(file, input);
    }
    if (!code) {
        snprintf(file->format, sizeof file->format, "%s", t.ptx ? "PTX" : t.pts ? "PTS" : t.named ? "CSV" : "XYZ");
        file->position_type = PATINA_FLOAT64;
        pt_file_measure(file);
        pt_progress_set(input->progress, 1);
    }
    return code;
}

// By the name alone: then a first line that is neither numbers nor names is told as such.
static bool is_called_text(const char *name)
{
    static const char *const endings[] = {".xyz", ".txt", ".csv", ".asc", ".pts", ".ptx"};
    size_t length = strlen(name);
    for (size_t i = 0; i < sizeof endings / sizeof *endings; i++)
        if (length > 4 && pt_same_word(name + length - 4, endings[i]))
            return true;
    return false;
}

bool pt_text_is(const struct pt_input *input)
{
    static const uint8_t gzip[] = {0x1f, 0x8b};
    if (!input->size || !memcmp(input->data, gzip, input->size < 2 ? input->size : 2))
        return false;
    if (is_utf16(input))
        return true;
    struct text t = begin(input);
    char word[NAME_SIZE];
    if (!find_line(&t) || !pt_cells_name(PT_PARTED_LOOSELY, t.at, t.end, word, sizeof word))
        return false;
    if ((word[0] && strchr("0123456789-+.", word[0])) || pt_same_start(word, "nan", 3) || pt_same_start(word, "inf", 3))
        return true;
    if (!strcmp(word, "ply"))
        return false;
    read_names(&t, t.at);
    return names_points(&t) || is_called_text(input->name);
}
