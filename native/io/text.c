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
#include "number.h"
#include "text.h"
#include "base/words.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 1000, POLL_LINES = 8192, WORD_SHARE = 10 };

// ---- lines -----------------------------------------------------------------------------------------------------------

static void leave_out(const struct pt_text *t, double values[MOST_COLUMNS])
{
    uint32_t kept = 0;
    for (uint32_t c = 0; t->left_out && c < MOST_COLUMNS; c++)
        if (!(t->left_out >> c & 1))
            values[kept++] = values[c];
}

static int fail_at(const struct pt_text *t, const char *what)
{
    return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: line %llu: %s", t->input->name, (unsigned long long)t->line, what);
}

// ---- what the columns are ----------------------------------------------------------------------------------------------

static void read_names(struct pt_text *t, const uint8_t *at)
{
    char name[NAME_SIZE];
    t->named = true;
    for (t->name_count = 0; (at = pt_cells_name(t->cells.parting, at, t->end, name, sizeof name)); t->name_count++)
        if (t->name_count < MOST_COLUMNS)
            memcpy(t->names[t->name_count], name, NAME_SIZE);
    t->name_count = t->name_count < MOST_COLUMNS ? t->name_count : MOST_COLUMNS;
}

static bool has(const struct pt_text *t, enum role first) { return pt_roles_have(t->roles, t->columns, first); }

static void set_three(struct pt_text *t, uint32_t column, enum role first)
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

static void guess_roles(struct pt_text *t, double (*rows)[MOST_COLUMNS], uint32_t count)
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
static void guess_colors(struct pt_text *t, double (*rows)[MOST_COLUMNS], uint32_t count)
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

// ---- rows ------------------------------------------------------------------------------------------------------------------

static void place(const struct pt_text_scan *scan, double p[3])
{
    double q[3];
    for (int k = 0; k < 3; k++)
        q[k] = p[0] * scan->matrix[k] + p[1] * scan->matrix[4 + k] + p[2] * scan->matrix[8 + k] + scan->matrix[12 + k];
    memcpy(p, q, sizeof q);
}

static void store(struct pt_text *t, uint64_t i, const double values[MOST_COLUMNS])
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

static void call_column(const struct pt_text *t, uint32_t c, char called[NAME_SIZE + 16])
{
    if (c < t->name_count && t->names[c][0])
        snprintf(called, NAME_SIZE + 16, "column '%s'", t->names[c]);
    else
        snprintf(called, NAME_SIZE + 16, "column %u", c + 1);
}

static int refuse_word(const struct pt_text *t, uint32_t column, const char *word)
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
static int meet_words(struct pt_text *t, const uint8_t *at, uint32_t columns)
{
    char word[NAME_SIZE] = "";
    for (uint32_t c = 0; c < MOST_COLUMNS && (at = pt_cells_name(t->cells.parting, at, t->end, word, sizeof word)); c++) {
        if (!(columns >> c & 1))
            continue;
        if (t->needed >> c & 1)
            return refuse_word(t, c, word);
        if (pt_cells_says_empty(word))
            continue;
        struct pt_text_words *found = &t->found[c];
        if (!found->count++) {
            found->first_line = t->line;
            snprintf(found->first, sizeof found->first, "%.40s", word);
        }
    }
    return PATINA_OK;
}

static int fail_width(const struct pt_text *t, const char *what, uint32_t width, uint32_t wanted)
{
    char text[96];
    snprintf(text, sizeof text, "%u %s; %u were expected", width, what, wanted);
    return fail_at(t, text);
}

// Before rows are stored: what a row has, against the first one.
static int check_row(struct pt_text *t, const uint8_t *at, struct pt_line line, const double values[MOST_COLUMNS])
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
static bool is_single(struct pt_text *t)
{
    const uint8_t *at = t->at;
    while (at<t->end && * at> ' ')
        at++;
    while (at < t->end && pt_is_blank(*at))
        at++;
    return at == t->end || pt_is_line_end(*at);
}

// Goes over all rows; stores them, or only counts them and keeps the first ones.
static int walk(struct pt_text *t, bool storing, double (*sample)[MOST_COLUMNS], uint64_t *count)
{
    struct pt_text_scan scan = {0};
    uint64_t i = 0, polled = 0;
    t->scans = 0;
    while (pt_text_find_line(t)) {
        double values[MOST_COLUMNS] = {0};
        if (++polled % POLL_LINES == 0) {
            float half = 0.5f * (float)((double)(t->at - t->input->data) / (double)t->input->size);
            pt_progress_set(t->input->progress, storing ? 0.5f + half : half);
            if (pt_progress_cancelled(t->input->progress))
                return pt_fail(NULL, PATINA_ERROR_CANCELLED, "%s: reading was cancelled", t->input->name);
        }
        if (t->ptx && (!scan.left || is_single(t))) {
            int code = pt_text_next_scan(t, &scan, storing, i);
            if (code)
                return code;
            continue;
        }
        const uint8_t *start = t->at;
        struct pt_line line = pt_text_read_line(t, values);
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
                pt_text_keep_places(t, &scan, i);
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

// ---- columns -----------------------------------------------------------------------------------------------------------------

static int add_attribute(struct pt_text *t, const char *name, uint32_t type, void **data)
{
    *data = malloc(t->file->count * pt_type_size(type) + 1);
    return *data ? pt_file_add_attribute(t->file, name, type, *data) : PATINA_ERROR_MEMORY;
}

static int make_places(struct pt_text *t)
{
    static const char *const names[] = {"scan", "column", "row"};
    uint32_t type = t->most < UINT16_MAX ? PATINA_UINT16 : PATINA_UINT32;
    for (int k = 0; k < 3; k++)
        if (add_attribute(t, names[k], type, &t->places[k]))
            return PATINA_ERROR_MEMORY;
    return PATINA_OK;
}

static int make_columns(struct pt_text *t)
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
static bool names_points(const struct pt_text *t)
{
    struct pt_text named = *t;
    named.columns = t->name_count;
    pt_roles_by_name(named.roles, named.names, named.columns);
    return has(&named, X);
}

// A bit for each of those that are no attributes.
static uint32_t needed_columns(const struct pt_text *t)
{
    struct pt_text named = *t;
    uint32_t found = 0;
    named.columns = t->name_count;
    pt_roles_by_name(named.roles, named.names, named.columns);
    for (uint32_t c = 0; c < t->name_count; c++)
        found |= (uint32_t)(named.roles[c] != ATTRIBUTE) << c;
    return found;
}

static int fail_names(const struct pt_text *t)
{
    char names[128] = "";
    uint32_t c = 0;
    for (; c < t->name_count && strlen(names) + strlen(t->names[c]) + 8 < sizeof names; c++)
        snprintf(names + strlen(names), sizeof names - strlen(names), "%s%s", c ? ", " : "", t->names[c]);
    return pt_fail(NULL, PATINA_ERROR_FORMAT,
                   "%s: no columns x, y and z in its line of names: %s%s; rename the columns that are", t->input->name, names,
                   c < t->name_count ? ", ..." : "");
}

// Logs where a PTS announces another number of points than it holds.
static void compare_announced(const struct pt_text *t)
{
    if (t->pts && t->announced_at && !(t->announced == (double)t->file->count))
        pt_log(PT_LOG_WARNING, "%s: line %llu announces %.15g points, the file holds %llu", t->input->name,
               (unsigned long long)t->announced_at, t->announced, (unsigned long long)t->file->count);
}

// Looks at the first lines: which of the formats this is, and where its rows begin.
static int look(struct pt_text *t, const uint8_t **body, uint64_t *line)
{
    double values[MOST_COLUMNS];
    struct pt_text_scan scan;
    const uint8_t *start = t->at;
    t->needed = ~UINT32_C(0);
    if (!pt_text_find_line(t))
        return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: neither a PLY file nor lines of numbers: there is nothing in it",
                       t->input->name);
    while (t->at > start && !pt_is_line_end(t->at[-1]))
        t->at--; // a table's first cell may be empty
    const uint8_t *first = *body = t->at;
    *line = t->line;
    const int code = pt_text_read_scan(t, &scan, &t->ptx);
    pt_text_rewind(t, first, *line);
    if (code || t->ptx)
        return code;
    struct pt_line words = pt_text_read_line(t, values);
    t->pts = words.count == 1 && !words.strange;
    if (t->pts)
        return pt_text_refuse_broken_head(t, first, *line);
    t->cells.parting = pt_cells_look(first, t->end);
    t->at = first;
    words = pt_text_read_line(t, values);
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
        pt_text_find_line(t);
        *body = t->at;
        *line = t->line;
        return PATINA_OK;
    }
    pt_text_rewind(t, first, *line);
    return PATINA_OK;
}

static bool always_empty(double (*sample)[MOST_COLUMNS], uint32_t count, uint32_t column)
{
    bool empty = true;
    for (uint32_t i = 0; i < count; i++)
        empty &= isnan(sample[i][column]);
    return empty;
}

static int choose_roles(struct pt_text *t, double (*sample)[MOST_COLUMNS])
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
static bool has_numbers_of_points(const struct pt_text *t, double (*sample)[MOST_COLUMNS], uint32_t count)
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
static void tell_places(const struct pt_text *t, bool numbered)
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
static int decide_words(struct pt_text *t, double (*sample)[MOST_COLUMNS])
{
    char called[NAME_SIZE + 16];
    for (uint32_t c = 0; c < MOST_COLUMNS; c++) {
        const struct pt_text_words *found = &t->found[c];
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

static int read_all(struct pt_text *t)
{
    double(*sample)[MOST_COLUMNS] = calloc(SAMPLES, sizeof *sample);
    const uint8_t *body = t->at;
    uint64_t line = 1, count;
    int code = sample ? look(t, &body, &line) : PATINA_ERROR_MEMORY;
    if (!code) {
        pt_text_rewind(t, body, line);
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
        pt_text_rewind(t, body, line);
        code = walk(t, true, NULL, &count);
    }
    free(sample);
    if (code == PATINA_ERROR_MEMORY)
        pt_fail(NULL, code, "%s: no memory for %llu points", t->input->name, (unsigned long long)t->file->count);
    return code;
}

// Where the lines begin: behind a byte order mark, and behind a first line "sep=;" as Excel writes it.
static struct pt_text begin(const struct pt_input *input)
{
    struct pt_text t = {.input = input, .at = input->data, .end = input->data + input->size, .line = 1};
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
    struct pt_text t = begin(input);
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
    struct pt_text t = begin(input);
    char word[NAME_SIZE];
    if (!pt_text_find_line(&t) || !pt_cells_name(PT_PARTED_LOOSELY, t.at, t.end, word, sizeof word))
        return false;
    if ((word[0] && strchr("0123456789-+.", word[0])) || pt_same_start(word, "nan", 3) || pt_same_start(word, "inf", 3))
        return true;
    if (!strcmp(word, "ply"))
        return false;
    read_names(&t, t.at);
    return names_points(&t) || is_called_text(input->name);
}
