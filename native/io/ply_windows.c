// SPDX-License-Identifier: GPL-3.0-or-later
// A PLY's points in windows, one after the other: each is read as a file of its own rows, relative to an origin that was chosen for all of
// them, so that together they are what the file comes to when it is read whole.
#include "base/platform.h"
#include "ply.h"

#include <stdlib.h>
#include <string.h>

enum { HELD = 1 << 23 }; // bytes of the input between two times that its pages are given back, while rows are looked for

struct ply_rows {
    const struct pt_input *input; // a mapped file
    struct ply_header header;
    const struct ply_element *points; // of the header
    struct ply_cursor at;             // of the next row
    double origin[3];                 // beside the header's
};

// Some rows of the points as an element of their own.
static struct ply_element window_of(const struct ply_rows *rows, uint64_t count)
{
    struct ply_element window = *rows->points;
    window.count = count;
    return window;
}

// Reads x, y and z of as many rows as an origin is chosen by.
static int choose_origin(struct ply_rows *rows)
{
    static const char *const names[] = {"x", "y", "z"};
    const uint64_t count = rows->points->count, step = (count + PT_ORIGIN_SAMPLES - 1) / PT_ORIGIN_SAMPLES;
    struct ply_target *targets = calloc(rows->points->properties + 1u, sizeof *targets);
    double *sample = malloc(PT_ORIGIN_SAMPLES * 3 * sizeof *sample);
    struct ply_cursor at = rows->at;
    uint64_t n = 0, held = at.offset;
    int code = targets && sample ? PATINA_OK : pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", rows->input->name);
    for (uint64_t i = 0; i < count && !code; i += step, n++) {
        const struct ply_element one = window_of(rows, 1);
        const uint64_t left = count - i - 1;
        const struct ply_element rest = window_of(rows, left < step - 1 ? left : step - 1);
        for (uint32_t k = 0; k < rows->points->properties; k++) {
            targets[k].wrap = rows->header.properties[rows->points->first + k].type ==
                              PATINA_INT8; // colors that a writer called so
            for (size_t c = 0; c < 3; c++)
                if (!strcmp(rows->header.properties[rows->points->first + k].name, names[c]))
                    targets[k] = (struct ply_target){.data = sample + 3 * n + c, .type = PATINA_FLOAT64, .step = 3, .scale = 1};
        }
        at.before = i;
        code = ply_read_rows(&at, &one, targets, NULL);
        at.before = i + 1;
        if (!code && rest.count)
            code = ply_read_rows(&at, &rest, NULL, NULL);
        if (at.offset - held >= HELD) {
            pt_pages_return((uint8_t *)(uintptr_t)rows->input->data + held, at.offset - held);
            held = at.offset;
        }
    }
    if (!code)
        pt_file_choose_origin(sample, n, rows->origin);
    free(sample);
    free(targets);
    return code;
}

// To the first point.
static int pass_over(struct ply_rows *rows)
{
    int code = PATINA_OK;
    rows->at = (struct ply_cursor){
        .input = rows->input, .header = &rows->header, .offset = rows->header.body, .line = rows->header.body_line};
    if ((code = ply_check_count(&rows->at, rows->points)) || (code = ply_check_line_ends(rows->input, &rows->header)))
        return code;
    for (const struct ply_element *e = rows->header.elements; e < rows->points && !code; e++)
        code = ply_read_rows(&rows->at, e, NULL, NULL);
    rows->at.all = rows->points->count;
    return code ? code : ply_check_count(&rows->at, rows->points);
}

int pt_ply_begin(const struct pt_input *input, struct ply_rows **out, const char **why)
{
    struct ply_rows *rows = *out = calloc(1, sizeof *rows);
    if (!rows)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", input->name);
    rows->input = input;
    int code = ply_read_header(input, &rows->header);
    if (!code && !(rows->points = ply_find_points(&rows->header)))
        code = pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: the header declares no element vertex", input->name);
    *why = code ? NULL : ply_why_whole(input, &rows->header, rows->points);
    if (!code && !*why) {
        struct patina_file none = {0}; // whether the columns can be read: before a look at their rows
        const struct ply_element nothing = window_of(rows, 0);
        rows->at = (struct ply_cursor){.input = input, .header = &rows->header, .offset = rows->header.body, .before = 1};
        code = ply_read_window(&none, &nothing, &rows->at, rows->origin);
        free(none.position);
        free(none.normal);
        free(none.color);
        for (uint32_t i = 0; i < none.attribute_count; i++)
            free(none.attributes[i].data);
        free(none.attributes);
        if (!code)
            code = pass_over(rows);
        if (!code && ply_is_fine(&rows->header, rows->points))
            code = choose_origin(rows);
    }
    if (!code && !*why)
        return PATINA_OK;
    pt_ply_end(rows);
    *out = NULL;
    return code;
}

uint64_t pt_ply_count(const struct ply_rows *rows) { return rows->points->count; }

// Says what is behind the points as the whole file's reader does.
static int read_behind(const struct ply_rows *rows)
{
    struct ply_cursor at = rows->at;
    at.tone = PLY_WARN;
    at.before = at.all = 0;
    for (const struct ply_element *e = rows->points + 1; e < rows->header.elements + rows->header.element_count; e++) {
        const int code = ply_read_rows(&at, e, NULL, NULL);
        if (code)
            return code == PATINA_ERROR_FORMAT ? PATINA_OK : code;
    }
    ply_warn_of_rest(at);
    return PATINA_OK;
}

int pt_ply_next(struct ply_rows *rows, uint64_t count, struct patina_file *file, uint64_t *behind)
{
    const uint64_t left = rows->points->count - rows->at.before;
    const struct ply_element window = window_of(rows, count < left ? count : left);
    int code = ply_read_window(file, &window, &rows->at, rows->origin);
    rows->at.before += window.count;
    *behind = rows->at.offset;
    return !code && window.count && window.count == left ? read_behind(rows) : code;
}

void pt_ply_end(struct ply_rows *rows) { free(rows); }
