// SPDX-License-Identifier: GPL-3.0-or-later
// patina distance FILE OTHER -o OUT.ply and patina ground FILE -o OUT.ply: a cloud with all of its columns, and what was measured behind them.
#include "tool.h"
#include "base/compare.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS = 4096, NAMES = 64, RESULTS = 2 };

// A column of a binary PLY: `components` values of `size` bytes a point.
struct column {
    char names[4][NAMES];
    const char *type;
    void *data;
    size_t size;
    uint32_t components;
};

struct measured {
    const char *in, *other, *out;
    patina_file *file;
    patina_file_info info;
    struct column *columns; // position, normal, color, attributes, results
    uint32_t count;
};

// ---- columns ---------------------------------------------------------------------------------------------------------

// Adds a column without values. NULL without memory.
static struct column *add(struct measured *m, const char *type, size_t size, uint32_t components, const char *const *names)
{
    struct column *grown = realloc(m->columns, (m->count + 1) * sizeof *grown);
    if (!grown)
        return NULL;
    m->columns = grown;
    struct column *column = &grown[m->count];
    *column = (struct column){.type = type, .size = size, .components = components};
    column->data = malloc((size_t)m->info.count * size * components + 1);
    if (!column->data)
        return NULL;
    for (uint32_t i = 0; i < components; i++)
        snprintf(column->names[i], NAMES, "%s", names[i]);
    m->count++;
    return column;
}

static void release(struct measured *m)
{
    for (uint32_t i = 0; i < m->count; i++)
        free(m->columns[i].data);
    free(m->columns);
    patina_file_destroy(m->file);
}

static size_t bytes_of(const struct measured *m, const struct column *column)
{
    return (size_t)m->info.count * column->size * column->components;
}

static int read_colors(struct measured *m)
{
    static const char *const names[] = {"red", "green", "blue", "alpha"};
    const int bytes = m->info.color_type == PATINA_UINT8;
    struct column *column = add(m, bytes ? "uchar" : "float", bytes ? 1 : sizeof(float), 4, names);
    if (!column)
        return PATINA_ERROR_MEMORY;
    return bytes ? patina_file_read_colors_u8(m->file, column->data, bytes_of(m, column))
                 : patina_file_read_colors_f32(m->file, column->data, bytes_of(m, column));
}

static int read_attributes(struct measured *m, const char *const *results)
{
    int code = PATINA_OK;
    for (uint32_t i = 0; i < m->info.attributes && !code; i++) {
        patina_file_attribute attribute = {.struct_size = sizeof attribute};
        const char *name = attribute.name;
        int replaced = 0;
        code = patina_file_get_attribute(m->file, i, &attribute);
        for (int k = 0; k < RESULTS && results[k]; k++)
            replaced |= !strcmp(results[k], name);
        if (code || replaced)
            continue;
        struct column *column = add(m, "float", sizeof(float), 1, &name);
        code = column ? patina_file_read_attribute(m->file, i, column->data, bytes_of(m, column)) : PATINA_ERROR_MEMORY;
    }
    return code;
}

// Reads the file with all of its columns. results: names of those that will be measured.
static int read_file(struct measured *m, const char *const *results, patina_progress *progress)
{
    static const char *const position[] = {"x", "y", "z"}, *const normal[] = {"nx", "ny", "nz"};
    m->info.struct_size = sizeof m->info;
    int code = patina_file_open(m->in, progress, &m->file);
    if (!code)
        code = patina_file_get_info(m->file, &m->info);
    struct column *column = code ? NULL : add(m, "float", sizeof(float), 3, position);
    if (!code)
        code = column ? PATINA_OK : PATINA_ERROR_MEMORY;
    if (!code && m->info.count)
        code = patina_file_read_positions(m->file, column->data, bytes_of(m, column));
    if (!code && m->info.count && m->info.has_normals) {
        column = add(m, "float", sizeof(float), 3, normal);
        code = column ? patina_file_read_normals(m->file, column->data, bytes_of(m, column)) : PATINA_ERROR_MEMORY;
    }
    if (!code && m->info.count && m->info.color_type)
        code = read_colors(m);
    if (!code && m->info.count)
        code = read_attributes(m, results);
    return code;
}

// ---- the file --------------------------------------------------------------------------------------------------------

static int write_rows(FILE *file, const struct measured *m, size_t row, int wide)
{
    char *block = malloc(row * ROWS);
    int good = block != NULL;
    for (uint64_t first = 0; first < m->info.count && good; first += ROWS) {
        char *at = block;
        for (uint64_t i = first; i < m->info.count && i < first + ROWS; i++)
            for (uint32_t c = 0; c < m->count; c++) {
                const struct column *column = &m->columns[c];
                const size_t size = column->size * column->components;
                const char *from = (const char *)column->data + i * size;
                for (int k = 0; k < 3 && !c && wide; k++, at += sizeof(double)) {
                    const double place = m->info.origin[k] + (double)((const float *)column->data)[3 * i + (uint64_t)k];
                    memcpy(at, &place, sizeof place);
                }
                if (c || !wide) {
                    memcpy(at, from, size);
                    at += size;
                }
            }
        good = fwrite(block, 1, (size_t)(at - block), file) == (size_t)(at - block);
    }
    free(block);
    return good;
}

// Whole or not at all. Returns 0, or an error number.
static int write_ply(const struct measured *m)
{
    const int wide = m->info.origin[0] != 0 || m->info.origin[1] != 0 || m->info.origin[2] != 0;
    struct pt_whole whole;
    size_t row = wide ? 3 * (sizeof(double) - sizeof(float)) : 0;
    const int error = pt_whole_begin(m->out, &whole);
    if (error)
        return error;
    FILE *file = whole.stream;
    fprintf(file, "ply\nformat binary_%s_endian 1.0\ncomment written by Patina %s\nelement vertex %llu\n",
            __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__ ? "little" : "big", patina_version(), (unsigned long long)m->info.count);
    for (uint32_t c = 0; c < m->count; c++)
        for (uint32_t i = 0; i < m->columns[c].components; i++) {
            fprintf(file, "property %s %s\n", !c && wide ? "double" : m->columns[c].type, m->columns[c].names[i]);
            row += m->columns[c].size;
        }
    fprintf(file, "end_header\n");
    return pt_whole_end(&whole, write_rows(file, m, row, wide) && !ferror(file));
}

static int finish(struct measured *m, int code)
{
    tool_cancellable(NULL, NULL);
    if (code)
        return tool_failed(m->in, NULL, code);
    const int error = write_ply(m);
    if (error) {
        char text[128];
        tool_say("%s: cannot be written: %s", m->out, pt_error_text(error, text, sizeof text));
    }
    return error ? TOOL_FAILED : TOOL_OK;
}

// ---- distance --------------------------------------------------------------------------------------------------------

static void print_distances(const struct measured *m, const patina_distance_desc *desc, const float *distance,
                            const float *interval)
{
    float *sorted = malloc((size_t)m->info.count * sizeof *sorted + 1);
    uint64_t known = 0, significant = 0;
    for (uint64_t i = 0; i < m->info.count && sorted; i++)
        if (isfinite(distance[i])) {
            sorted[known++] = distance[i];
            significant += fabsf(distance[i]) > interval[i];
        }
    printf("cylinder     %.4g\nnormal scale %.4g\ndepth        %.4g\n", desc->cylinder, desc->normal_scale, desc->depth);
    printf("measured     %llu of %llu points\n", (unsigned long long)known, (unsigned long long)m->info.count);
    printf("significant  %llu\n", (unsigned long long)significant);
    if (known) {
        qsort(sorted, (size_t)known, sizeof *sorted, pt_compare_floats);
        printf("distance     %.4g median, %.4g to %.4g for 98 %%\n", (double)sorted[known / 2], (double)sorted[known / 100],
               (double)sorted[known - 1 - known / 100]);
    }
    free(sorted);
}

static int measure_distance(struct measured *m, patina_distance_desc *desc, patina_progress *progress)
{
    static const char *const names[RESULTS + 1] = {"m3c2_distance", "m3c2_interval", NULL};
    patina_file *other = NULL;
    patina_file_info info = {.struct_size = sizeof info};
    float *positions = NULL;
    int code = read_file(m, names, progress);
    if (!code)
        code = patina_file_open(m->other, progress, &other);
    if (!code)
        code = patina_file_get_info(other, &info);
    if (!code && !info.count) {
        tool_cancellable(NULL, NULL);
        tool_say("%s: no points to measure to", m->other);
        patina_file_destroy(other);
        return TOOL_FAILED;
    }
    if (!code) {
        const size_t size = (size_t)info.count * 3 * sizeof *positions;
        positions = malloc(size);
        code = positions ? patina_file_read_positions(other, positions, size) : PATINA_ERROR_MEMORY;
    }
    struct column *distance = code ? NULL : add(m, "float", sizeof(float), 1, names);
    struct column *interval = distance ? add(m, "float", sizeof(float), 1, names + 1) : NULL;
    if (!code && !interval)
        code = PATINA_ERROR_MEMORY;
    if (!code) {
        desc->count = m->info.count;
        desc->other_count = info.count;
        desc->position = (patina_array){.data = m->columns[0].data, .type = PATINA_FLOAT32, .components = 3};
        desc->other = (patina_array){.data = positions, .type = PATINA_FLOAT32, .components = 3};
        memcpy(desc->origin, m->info.origin, sizeof desc->origin);
        memcpy(desc->other_origin, info.origin, sizeof desc->other_origin);
        code = desc->count ? patina_distance_defaults(desc) : PATINA_OK;
    }
    if (!code) {
        if (m->info.has_normals && m->info.count)
            desc->normal = (patina_array){.data = m->columns[1].data, .type = PATINA_FLOAT32, .components = 3};
        code = patina_cloud_distance(desc, progress, m->columns[m->count - 2].data, m->columns[m->count - 1].data);
    }
    const int result = finish(m, code);
    if (!result)
        print_distances(m, desc, m->columns[m->count - 2].data, m->columns[m->count - 1].data);
    free(positions);
    patina_file_destroy(other);
    return result;
}

// ---- ground ----------------------------------------------------------------------------------------------------------

static int measure_ground(struct measured *m, patina_ground_desc *desc, patina_progress *progress)
{
    static const char *const names[RESULTS + 1] = {"height_above_ground", NULL, NULL};
    uint8_t *ground = NULL;
    int code = read_file(m, names, progress);
    if (!code && (!add(m, "float", sizeof(float), 1, names) || !(ground = calloc((size_t)m->info.count + 1, 1))))
        code = PATINA_ERROR_MEMORY;
    if (!code) {
        desc->count = m->info.count;
        desc->position = (patina_array){.data = m->columns[0].data, .type = PATINA_FLOAT32, .components = 3};
        code = desc->count ? patina_ground_defaults(desc) : PATINA_OK;
    }
    if (!code)
        code = patina_ground(desc, progress, m->columns[m->count - 1].data, ground);
    const int result = finish(m, code);
    if (!result) {
        uint64_t count = 0;
        for (uint64_t i = 0; i < m->info.count; i++)
            count += ground[i];
        printf("cell         %.4g\nthreshold    %.4g\nlargest      %.4g\n", desc->cell, desc->threshold, desc->largest);
        printf("ground       %llu of %llu points\n", (unsigned long long)count, (unsigned long long)m->info.count);
    }
    free(ground);
    return result;
}

// ---- arguments -------------------------------------------------------------------------------------------------------

struct length {
    const char *name;
    double *value;
};

// files: 1 or 2. A tool_exit.
static int parse(const char *command, int count, char **arguments, int files, const struct length *lengths, struct measured *m)
{
    const char **const places[] = {&m->in, &m->other};
    int found = 0;
    for (int i = 0; i < count; i++) {
        const char *name = arguments[i], *value = i + 1 < count ? arguments[i + 1] : NULL;
        if (name[0] != '-') {
            if (found == files)
                return tool_misuse("%s: '%s' is one file too many", command, name);
            *places[found++] = name;
            continue;
        }
        const struct length *length = lengths;
        while (length->name && strcmp(length->name, name) != 0)
            length++;
        if (!value || (!length->name && strcmp(name, "-o") != 0))
            return tool_misuse("%s: '%s' is no option, or lacks its value", command, name);
        if (!length->name)
            m->out = value;
        else if (parse_numbers(value, length->value, 1, 1) < 0 || *length->value < 0)
            return tool_misuse("'%s' is no value for option '%s': a length", value, name);
        i++;
    }
    if (found < files || !m->out || !*m->out)
        return tool_misuse("%s: %s to read, and -o OUT.ply, please", command, files > 1 ? "two files" : "a file");
    return TOOL_OK;
}

int tool_distance(int count, char **arguments)
{
    struct measured m = {0};
    patina_distance_desc desc = {.struct_size = sizeof desc};
    const struct length lengths[] = {{"--normal-scale", &desc.normal_scale},
                                     {"--cylinder", &desc.cylinder},
                                     {"--depth", &desc.depth},
                                     {"--registration-error", &desc.registration_error},
                                     {NULL, NULL}};
    patina_progress *progress = NULL;
    const int misused = parse("distance", count, arguments, 2, lengths, &m);
    if (misused)
        return misused;
    const int code = patina_progress_create(&progress);
    tool_cancellable(progress, NULL);
    const int result = code ? tool_failed(m.in, NULL, code) : measure_distance(&m, &desc, progress);
    tool_cancellable(NULL, NULL);
    tool_drain_log(1);
    release(&m);
    patina_progress_destroy(progress);
    return result;
}

int tool_ground(int count, char **arguments)
{
    struct measured m = {0};
    patina_ground_desc desc = {.struct_size = sizeof desc};
    const struct length lengths[] = {
        {"--cell", &desc.cell}, {"--threshold", &desc.threshold}, {"--largest", &desc.largest}, {NULL, NULL}};
    patina_progress *progress = NULL;
    const int misused = parse("ground", count, arguments, 1, lengths, &m);
    if (misused)
        return misused;
    const int code = patina_progress_create(&progress);
    tool_cancellable(progress, NULL);
    const int result = code ? tool_failed(m.in, NULL, code) : measure_ground(&m, &desc, progress);
    tool_cancellable(NULL, NULL);
    tool_drain_log(1);
    release(&m);
    patina_progress_destroy(progress);
    return result;
}
