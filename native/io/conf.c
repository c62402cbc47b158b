// SPDX-License-Identifier: GPL-3.0-or-later
// Stanford's .conf: range scans in files of their own, a line "bmesh NAME tx ty tz qx qy qz qw" each: p' = R(conjugate of q) p + t.
// "mesh" names models that the scans were once made of and that nobody has; "camera" a view. All scans become one file, with the
// attribute "scan". A scan that cannot be read or placed is named in the log and left out.
#include "base/progress.h"
#include "file.h"
#include "number.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_SCANS = UINT16_MAX, NUMBERS = 7 };

static const double off_unit = 1e-3; // a quaternion's length may be so far from 1 before somebody is told

struct part {
    struct patina_file *file;
    char name[64];
    double pose[12];
    uint64_t first; // in the whole
};

struct conf {
    const struct pt_input *input;
    const char *path;
    pt_file_opener *open;
    const uint8_t *at, *end;
    unsigned long long line;
    struct part *parts;
    uint32_t count, room;
    uint32_t lines, begun; // that name scans: all, and those that were begun
};

struct word {
    const uint8_t *text;
    size_t length;
};

// ---- lines -----------------------------------------------------------------------------------------------------------

static struct word next_word(const uint8_t **at, const uint8_t *end)
{
    while (*at < end && pt_is_blank(**at))
        ++*at;
    struct word word = {*at, 0};
    while (*at < end && !pt_is_blank(**at) && !pt_is_line_end(**at))
        ++*at;
    word.length = (size_t)(*at - word.text);
    return word;
}

static bool is(struct word word, const char *text)
{
    return word.length == strlen(text) && !memcmp(word.text, text, word.length);
}

// Comes behind the line's end.
static void skip_line(struct conf *c)
{
    c->at = pt_line_end(c->at, c->end);
    if (c->at < c->end)
        c->at += c->at + 1 < c->end && c->at[0] == '\r' && c->at[1] == '\n' ? 2 : 1;
    c->line++;
}

bool pt_conf_is(const struct pt_input *input)
{
    if (!input->size)
        return false;
    const uint8_t *at = input->data, *end = at + input->size;
    for (;;) {
        while (at < end && (pt_is_blank(*at) || pt_is_line_end(*at)))
            at++;
        if (at == end || *at != '#')
            break;
        at = pt_line_end(at, end);
    }
    const struct word word = next_word(&at, end);
    return at < end && (is(word, "camera") || is(word, "bmesh") || is(word, "mesh"));
}

static void count_lines(struct conf *c)
{
    const uint8_t *at = c->at;
    while (at < c->end) {
        c->lines += is(next_word(&at, c->end), "bmesh");
        at = pt_line_end(at, c->end);
        at += at < c->end;
    }
}

__attribute__((format(printf, 3, 4))) static void tell(const struct conf *c, const char *name, const char *format, ...)
{
    char what[600];
    va_list list;
    va_start(list, format);
    vsnprintf(what, sizeof what, format, list);
    va_end(list);
    pt_log(PT_LOG_WARNING, "%s: line %llu: scan %.80s %s", c->input->name, c->line, name, what);
}

// ---- a scan ----------------------------------------------------------------------------------------------------------

// Seven numbers to the line's end.
static bool read_numbers(const uint8_t *at, const uint8_t *end, double values[NUMBERS])
{
    for (int i = 0; i < NUMBERS; i++) {
        const struct word word = next_word(&at, end);
        if (!word.length || pt_parse_number(word.text, word.text + word.length, &values[i]) != word.text + word.length)
            return false;
    }
    return !next_word(&at, end).length;
}

// The place: of the conjugate of a quaternion x y z w that is brought to length 1.
static void set_pose(const double values[NUMBERS], double length, double pose[12])
{
    const double x = -values[3] / length, y = -values[4] / length, z = -values[5] / length, w = values[6] / length;
    const double turn[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                               {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                               {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
    for (int i = 0; i < 3; i++) {
        memcpy(pose + 4 * i, turn[i], sizeof turn[i]);
        pose[4 * i + 3] = values[i];
    }
}

static bool find_pose(const struct conf *c, const char *name, const double values[NUMBERS], double pose[12])
{
    double square = 0;
    bool finite = true;
    for (int i = 0; i < NUMBERS; i++) {
        finite &= isfinite(values[i]) != 0;
        square += i < 3 ? 0 : values[i] * values[i];
    }
    const double length = sqrt(square);
    if (!finite || !(length > 1e-6) || !isfinite(length)) {
        tell(c, name, "is left out: its quaternion %g %g %g %g or its place is no pose", values[3], values[4], values[5],
             values[6]);
        return false;
    }
    if (fabs(length - 1) > off_unit)
        tell(c, name, "has a quaternion of length %g, which is taken as of length 1", length);
    set_pose(values, length, pose);
    return true;
}

static bool is_separator(char c)
{
#ifdef _WIN32
    if (c == '\\')
        return true;
#endif
    return c == '/';
}

// The file's path beside the conf; NULL without memory.
static char *path_of(const struct conf *c, struct word name)
{
    size_t folder = strlen(c->path);
    while (folder && !is_separator(c->path[folder - 1]))
        folder--;
    if (name.length && is_separator((char)name.text[0]))
        folder = 0;
    char *path = malloc(folder + name.length + 1);
    if (!path)
        return NULL;
    memcpy(path, c->path, folder);
    memcpy(path + folder, name.text, name.length);
    path[folder + name.length] = 0;
    return path;
}

static int keep_part(struct conf *c, const struct part *part)
{
    if (c->count == c->room) {
        const uint32_t room = 2 * c->room + 16;
        struct part *grown = realloc(c->parts, room * sizeof *grown);
        if (!grown)
            return PATINA_ERROR_MEMORY;
        c->parts = grown;
        c->room = room;
    }
    c->parts[c->count++] = *part;
    return PATINA_OK;
}

// Opens a scan's file. PATINA_OK too where it is told and left out: then part->file is NULL.
static int open_part(const struct conf *c, struct word name, struct part *part)
{
    struct patina_progress *progress = c->input->progress;
    char *path = path_of(c, name), message[512] = "";
    if (!path)
        return PATINA_ERROR_MEMORY;
    const float begin = progress ? progress->begin : 0, share = progress ? progress->share : 0;
    if (progress) {
        progress->begin = (float)c->begun / (float)c->lines * 0.9f;
        progress->share = 0.9f / (float)c->lines;
    }
    const int code = c->open(path, true, progress, &part->file);
    if (progress) {
        progress->begin = begin;
        progress->share = share;
    }
    free(path);
    if (code == PATINA_ERROR_MEMORY || code == PATINA_ERROR_CANCELLED)
        return code;
    if (code) {
        patina_message(NULL, message, sizeof message);
        tell(c, part->name, "is left out: %s", message);
    } else if (!part->file->count) {
        tell(c, part->name, "is left out: it has no points");
        patina_file_destroy(part->file);
        part->file = NULL;
    } else if (part->file->count == 1) {
        tell(c, part->name, "has one point");
    }
    return PATINA_OK;
}

// A line behind "bmesh".
static int read_scan(struct conf *c, const uint8_t *at)
{
    const uint8_t *end = pt_line_end(at, c->end);
    const struct word name = next_word(&at, end);
    struct part part = {0};
    double values[NUMBERS];
    char text[200];
    snprintf(text, sizeof text, "%.*s", name.length < sizeof text ? (int)name.length : (int)sizeof text - 1,
             (const char *)name.text);
    pt_clip_name(part.name, sizeof part.name, text);
    int code = PATINA_OK;
    if (!read_numbers(at, end, values))
        tell(c, part.name, "is left out: a name and seven numbers were expected");
    else if (find_pose(c, part.name, values, part.pose))
        code = open_part(c, name, &part);
    c->begun++;
    if (!code && part.file && (code = keep_part(c, &part)))
        patina_file_destroy(part.file);
    return code;
}

static int read_lines(struct conf *c)
{
    int code = PATINA_OK;
    for (; c->at < c->end && !code && c->count < MOST_SCANS; skip_line(c)) {
        const uint8_t *at = c->at;
        const struct word key = next_word(&at, c->end), name = is(key, "mesh") ? next_word(&at, c->end) : key;
        if (pt_progress_cancelled(c->input->progress))
            code = pt_fail(NULL, PATINA_ERROR_CANCELLED, "%s: reading was cancelled", c->input->name);
        else if (is(key, "bmesh"))
            code = read_scan(c, at);
        else if (is(key, "mesh"))
            pt_log(PT_LOG_WARNING, "%s: line %llu: mesh %.*s is left out: it is a model and no scan", c->input->name, c->line,
                   name.length < 80 ? (int)name.length : 80, (const char *)name.text);
    }
    return code;
}

// ---- the whole -------------------------------------------------------------------------------------------------------

static void move(const double pose[12], const double p[3], bool turn_alone, double q[3])
{
    for (int i = 0; i < 3; i++)
        q[i] = pose[4 * i] * p[0] + pose[4 * i + 1] * p[1] + pose[4 * i + 2] * p[2] + (turn_alone ? 0 : pose[4 * i + 3]);
}

static int join_positions(const struct conf *c, struct patina_file *file)
{
    double *staged = malloc(file->count * 3 * sizeof *staged);
    if (!staged)
        return PATINA_ERROR_MEMORY;
    for (uint32_t s = 0; s < c->count; s++) {
        const struct part *part = &c->parts[s];
        for (uint64_t i = 0; i < part->file->count; i++) {
            double p[3];
            for (int k = 0; k < 3; k++)
                p[k] = part->file->origin[k] + (double)part->file->position[3 * i + (uint64_t)k];
            move(part->pose, p, false, staged + 3 * (part->first + i));
        }
    }
    pt_file_place(file, staged);
    return PATINA_OK;
}

static int join_normals(const struct conf *c, struct patina_file *file)
{
    bool any = false;
    for (uint32_t s = 0; s < c->count; s++)
        any |= c->parts[s].file->normal != NULL;
    if (!any)
        return PATINA_OK;
    if (!(file->normal = calloc(file->count, 3 * sizeof *file->normal)))
        return PATINA_ERROR_MEMORY;
    for (uint32_t s = 0; s < c->count; s++) {
        const struct part *part = &c->parts[s];
        for (uint64_t i = 0; part->file->normal && i < part->file->count; i++) {
            double n[3], turned[3];
            for (int k = 0; k < 3; k++)
                n[k] = (double)part->file->normal[3 * i + (uint64_t)k];
            move(part->pose, n, true, turned);
            for (int k = 0; k < 3; k++)
                file->normal[3 * (part->first + i) + (uint64_t)k] = (float)turned[k];
        }
    }
    return PATINA_OK;
}

// As bytes, where all that have colours have bytes; else as light. Scans without colours are black.
static int join_colors(const struct conf *c, struct patina_file *file)
{
    for (uint32_t s = 0; s < c->count; s++) {
        const uint32_t type = c->parts[s].file->color_type;
        if (type != PATINA_NONE)
            file->color_type = type == PATINA_UINT8 && file->color_type != PATINA_FLOAT32 ? PATINA_UINT8 : PATINA_FLOAT32;
    }
    const size_t size = 4 * pt_type_size(file->color_type);
    if (!size)
        return PATINA_OK;
    if (!(file->color = malloc(file->count * size)))
        return PATINA_ERROR_MEMORY;
    for (uint32_t s = 0; s < c->count; s++) {
        const struct part *part = &c->parts[s];
        const size_t bytes = part->file->count * size;
        uint8_t *to = (uint8_t *)file->color + part->first * size;
        if (part->file->color && file->color_type == PATINA_UINT8)
            patina_file_read_colors_u8(part->file, to, bytes);
        else if (part->file->color)
            patina_file_read_colors_f32(part->file, (float *)(void *)to, bytes);
        for (size_t i = 0; !part->file->color && i < 4 * part->file->count; i++) {
            if (file->color_type == PATINA_UINT8)
                to[i] = i % 4 == 3 ? 255 : 0;
            else
                ((float *)(void *)to)[i] = i % 4 == 3 ? 1 : 0;
        }
    }
    return PATINA_OK;
}

static bool is_place(const char *name) { return !strcmp(name, "scan") || !strcmp(name, "column") || !strcmp(name, "row"); }

// Points of a scan without a grid, and of no cell, have the greatest number.
static int join_cells(const struct conf *c, struct patina_file *file, const char *name)
{
    bool any = false, wide = false;
    for (uint32_t s = 0; s < c->count; s++) {
        const struct pt_column *column = pt_file_find_attribute(c->parts[s].file, name);
        any |= column != NULL;
        wide |= column && column->type != PATINA_UINT16 && column->type != PATINA_UINT8;
    }
    if (!any)
        return PATINA_OK;
    const uint32_t none = wide ? UINT32_MAX : UINT16_MAX;
    void *data = malloc(file->count * (wide ? 4 : 2));
    if (!data)
        return PATINA_ERROR_MEMORY;
    for (uint32_t s = 0; s < c->count; s++) {
        const struct part *part = &c->parts[s];
        const struct pt_column *column = pt_file_find_attribute(part->file, name);
        for (uint64_t i = 0; i < part->file->count; i++) {
            const double value = column ? pt_file_value(column, i) : -1;
            const bool cell = value >= 0 && value < (double)none && !(column->type == PATINA_UINT16 && value == UINT16_MAX);
            if (wide)
                ((uint32_t *)data)[part->first + i] = cell ? (uint32_t)value : none;
            else
                ((uint16_t *)data)[part->first + i] = cell ? (uint16_t)value : UINT16_MAX;
        }
    }
    return pt_file_add_attribute(file, name, wide ? PATINA_UINT32 : PATINA_UINT16, data);
}

// All others as float32, 0 where a scan has none.
static int join_attribute(const struct conf *c, struct patina_file *file, const char *name)
{
    if (is_place(name) || pt_file_find_attribute(file, name))
        return PATINA_OK;
    float *data = calloc(file->count, sizeof *data);
    if (!data)
        return PATINA_ERROR_MEMORY;
    for (uint32_t s = 0; s < c->count; s++) {
        const struct part *part = &c->parts[s];
        const struct pt_column *column = pt_file_find_attribute(part->file, name);
        for (uint64_t i = 0; column && i < part->file->count; i++)
            data[part->first + i] = (float)pt_file_value(column, i);
    }
    return pt_file_add_attribute(file, name, PATINA_FLOAT32, data);
}

// What a file says of scans is moved with it; of several in one file the name says which.
static void join_scan(const struct part *part, uint32_t index, struct pt_scan *scan)
{
    const struct patina_file *from = part->file;
    const double identity[12] = {[0] = 1, [5] = 1, [10] = 1};
    struct pt_scan own = {.count = from->count, .nowhere = true};
    memcpy(own.pose, identity, sizeof own.pose);
    if (index < from->scan_count)
        own = from->scans[index];
    *scan = own;
    scan->first += part->first;
    memcpy(scan->name, part->name, sizeof scan->name);
    if (from->scan_count > 1)
        snprintf(scan->name, sizeof scan->name, "%.40s, scan %u", part->name, index);
    move(part->pose, own.station, own.parallel, scan->station);
    for (int k = 0; k < 4; k++) {
        const double column[3] = {own.pose[k], own.pose[4 + k], own.pose[8 + k]};
        double moved[3];
        move(part->pose, column, k < 3, moved);
        for (int i = 0; i < 3; i++)
            scan->pose[4 * i + k] = moved[i];
    }
}

static uint32_t scans_of(const struct part *part) { return part->file->scan_count ? part->file->scan_count : 1; }

static int join_scans(const struct conf *c, struct patina_file *file)
{
    uint32_t count = 0;
    for (uint32_t s = 0; s < c->count; s++)
        count += scans_of(&c->parts[s]);
    uint16_t *numbers = malloc(file->count * sizeof *numbers);
    file->scans = calloc(count, sizeof *file->scans);
    if (!numbers || !file->scans) {
        free(numbers);
        return PATINA_ERROR_MEMORY;
    }
    for (uint32_t s = 0; s < c->count; s++)
        for (uint32_t i = 0; i < scans_of(&c->parts[s]); i++) {
            struct pt_scan *scan = &file->scans[file->scan_count];
            join_scan(&c->parts[s], i, scan);
            for (uint64_t p = scan->first; p < scan->first + scan->count; p++)
                numbers[p] = (uint16_t)(file->scan_count < UINT16_MAX ? file->scan_count : UINT16_MAX);
            file->scan_count++;
        }
    return pt_file_add_attribute(file, "scan", PATINA_UINT16, numbers);
}

static int join(struct conf *c, struct patina_file *file)
{
    for (uint32_t s = 0; s < c->count; s++) {
        c->parts[s].first = file->count;
        file->count += c->parts[s].file->count;
    }
    if (file->count > UINT32_MAX - 1)
        return pt_fail(NULL, PATINA_ERROR_TOO_MANY_POINTS, "%s: %llu points, more than 2^32 - 2", c->input->name,
                       (unsigned long long)file->count);
    snprintf(file->format, sizeof file->format, "conf, %u scan%s", c->count, c->count == 1 ? "" : "s");
    file->position_type = PATINA_FLOAT64;
    int code = join_positions(c, file);
    code = code ? code : join_normals(c, file);
    code = code ? code : join_colors(c, file);
    code = code ? code : join_scans(c, file);
    code = code ? code : join_cells(c, file, "column");
    code = code ? code : join_cells(c, file, "row");
    for (uint32_t s = 0; s < c->count && !code; s++)
        for (uint32_t i = 0; i < c->parts[s].file->attribute_count && !code; i++)
            code = join_attribute(c, file, c->parts[s].file->attributes[i].name);
    return code;
}

int pt_conf_read(struct patina_file *file, const struct pt_input *input, const char *path, pt_file_opener *open)
{
    struct conf c = {
        .input = input, .path = path, .open = open, .at = input->data, .end = input->data + input->size, .line = 1};
    count_lines(&c);
    int code = read_lines(&c);
    if (!code && !c.lines)
        code = pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: no line begins with 'bmesh'", input->name);
    else if (!code && !c.count)
        code = pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: none of the %u scans that it names can be read", input->name, c.lines);
    else if (!code)
        code = join(&c, file);
    if (code == PATINA_ERROR_MEMORY)
        pt_fail(NULL, code, "%s: out of memory", input->name);
    for (uint32_t s = 0; s < c.count; s++)
        patina_file_destroy(c.parts[s].file);
    free(c.parts);
    if (!code) {
        pt_file_measure(file);
        pt_progress_set(input->progress, 1);
    }
    return code;
}
