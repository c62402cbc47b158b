// SPDX-License-Identifier: GPL-3.0-or-later
// patina analyse FILE -o OUT.ply: what every point knows, as columns of a binary PLY. IN.cloud -o OUT.cloud: into a saved cloud, of any size.
#include "tool.h"
#include "base/words.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct columns {
    uint64_t count;
    int trusted;  // untrusted points are left out of the file
    double least; // trust of those that are not
    float *position, *normal, *spacing, *half_axes, *sigma, *trust;
    uint8_t *kind, *seen_through;
};

enum { ROW = 24 + 12 + 4 + 8 + 4 + 4 + 2, ROWS = 4096 }; // with positions in float64

static int allocate(struct columns *c, uint64_t count)
{
    c->count = count;
    float **floats[] = {&c->position, &c->normal, &c->half_axes, &c->spacing, &c->sigma, &c->trust};
    static const size_t widths[] = {3, 3, 2, 1, 1, 1};
    for (int i = 0; i < 6; i++)
        if (!(*floats[i] = malloc(count * widths[i] * sizeof(float) + 1)))
            return PATINA_ERROR_MEMORY;
    c->kind = malloc(count + 1);
    c->seen_through = malloc(count + 1);
    return c->kind && c->seen_through ? PATINA_OK : PATINA_ERROR_MEMORY;
}

static void release(struct columns *c)
{
    free(c->position);
    free(c->normal);
    free(c->half_axes);
    free(c->spacing);
    free(c->sigma);
    free(c->trust);
    free(c->kind);
    free(c->seen_through);
}

// How many points are below the least trust, of those whose trust is known.
static uint64_t count_untrusted(const struct columns *c)
{
    uint64_t untrusted = 0;
    for (uint64_t i = 0; i < c->count; i++)
        untrusted += c->kind[i] && (double)c->trust[i] < c->least - 1e-4;
    return untrusted;
}

static int is_left_out(const struct columns *c, uint64_t i) { return c->trusted && (double)c->trust[i] < c->least - 1e-4; }

static uint64_t count_written(const struct columns *c)
{
    uint64_t count = 0;
    for (uint64_t i = 0; i < c->count; i++)
        count += !is_left_out(c, i);
    return count;
}

static char *put(char *at, const void *bytes, size_t size)
{
    memcpy(at, bytes, size);
    return at + size;
}

static int write_rows(FILE *file, const struct columns *c, const double origin[3], int wide)
{
    char *block = malloc((size_t)ROW * ROWS);
    int good = block != NULL;
    for (uint64_t first = 0; first < c->count && good; first += ROWS) {
        char *at = block;
        for (uint64_t i = first; i < c->count && i < first + ROWS; i++) {
            if (is_left_out(c, i))
                continue;
            for (int k = 0; k < 3; k++) {
                const double place = origin[k] + (double)c->position[3 * i + (uint64_t)k];
                at = wide ? put(at, &place, 8) : put(at, &c->position[3 * i + (uint64_t)k], 4);
            }
            at = put(at, &c->normal[3 * i], 12);
            at = put(at, &c->spacing[i], 4);
            at = put(at, &c->half_axes[2 * i], 8);
            at = put(at, &c->sigma[i], 4);
            at = put(at, &c->trust[i], 4);
            at = put(at, &c->kind[i], 1);
            at = put(at, &c->seen_through[i], 1);
        }
        good = at == block || fwrite(block, (size_t)(at - block), 1, file) == 1;
    }
    free(block);
    return good;
}

// A file that is there is lost only to a whole one. Returns 0, or an error number.
static int write_ply(const char *path, const struct columns *c, const double origin[3])
{
    const int wide = origin[0] != 0 || origin[1] != 0 || origin[2] != 0;
    const char *type = wide ? "double" : "float";
    struct pt_whole whole;
    int error = pt_whole_begin(path, &whole);
    if (error)
        return error;
    FILE *file = whole.stream;
    fprintf(file,
            "ply\nformat binary_%s_endian 1.0\ncomment written by Patina %s\nelement vertex %llu\nproperty %s x\nproperty %s "
            "y\nproperty %s z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty float spacing\nproperty float "
            "radius\nproperty float radius_minor\nproperty float sigma\nproperty float trust\nproperty uchar kind\nproperty "
            "uchar seen_through\nend_header\n",
            __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__ ? "little" : "big", patina_version(),
            (unsigned long long)count_written(c), type, type, type);
    int good = write_rows(file, c, origin, wide) && !ferror(file);
    return pt_whole_end(&whole, good);
}

static int analyse(const char *in, const char *out, uint32_t neighbours, int grid, patina_progress *progress,
                   struct columns *columns)
{
    patina_file *file = NULL;
    patina_cloud *cloud = NULL;
    patina_file_info info = {.struct_size = sizeof info};
    patina_cloud_info built = {.struct_size = sizeof built};
    patina_analysis_desc desc = {.struct_size = sizeof desc, .neighbours = neighbours, .keep_normals = 1};
    struct tool_stations stations = {0};
    int code = patina_file_open(in, progress, &file);
    if (!code)
        code = patina_file_get_info(file, &info);
    if (!code)
        code = allocate(columns, info.count);
    if (!code && info.count)
        code = patina_file_read_positions(file, columns->position, info.count * 3 * sizeof(float));
    if (!code)
        code = patina_file_cloud(file, 0, progress, &cloud);
    if (!code)
        code = tool_take_stations(file, &stations);
    tool_describe_stations(&stations, &desc);
    if (grid && !code)
        tool_use_grid(&stations, in, &desc);
    desc.free_space = desc.station_count > 1; // one alone sees through nothing
    if (!code)
        code = patina_cloud_analyse(cloud, &desc, progress);
    tool_free_stations(&stations);
    if (!code)
        code = patina_cloud_get_info(cloud, &built);
    columns->least = built.trust_default;
    const patina_neighbourhoods wanted = {.struct_size = sizeof wanted,
                                          .normal = columns->normal,
                                          .spacing = columns->spacing,
                                          .half_axes = columns->half_axes,
                                          .sigma = columns->sigma,
                                          .kind = columns->kind,
                                          .trust = columns->trust,
                                          .seen_through = columns->seen_through};
    if (!code)
        code = patina_cloud_neighbourhoods(cloud, &wanted, NULL);
    int result = code ? tool_failed(in, NULL, code) : TOOL_OK;
    const uint64_t untrusted = code ? 0 : count_untrusted(columns);
    if (untrusted && untrusted == built.drawn) {
        tool_say("warning: %s: none of %llu points is trusted, so all of them are kept: they may be strays alone", in,
                 (unsigned long long)untrusted);
        columns->trusted = 0;
    }
    tool_cancellable(NULL, NULL);
    const int error = code ? 0 : write_ply(out, columns, info.origin);
    if (error) {
        char text[128];
        tool_say("%s: cannot be written: %s", out, pt_error_text(error, text, sizeof text));
        result = TOOL_FAILED;
    } else if (!code) {
        for (int i = 0; i < 6; i++)
            printf("%-12s %llu\n", tool_kinds[i], (unsigned long long)built.kinds[i]);
        printf("%-12s %llu\n", "untrusted", (unsigned long long)untrusted);
        if (desc.free_space)
            printf("seen_through %llu\n", (unsigned long long)built.seen_through);
    }
    patina_cloud_destroy(cloud);
    patina_file_destroy(file);
    return result;
}

static int analyse_cloud(const char *in, const char *out, uint32_t neighbours, uint32_t keep_colors, uint64_t memory,
                         patina_progress *progress)
{
    const patina_analysis_desc desc = {
        .struct_size = sizeof desc, .neighbours = neighbours, .keep_normals = 1, .keep_colors = keep_colors};
    patina_cloud *cloud = NULL;
    patina_cloud_info info = {.struct_size = sizeof info};
    int code = patina_cloud_analyse_file(in, &desc, memory, out, progress);
    if (!code)
        code = patina_cloud_open(out, &cloud);
    if (!code)
        code = patina_cloud_get_info(cloud, &info);
    const int result = code ? tool_failed(in, cloud, code) : TOOL_OK;
    for (int i = 0; i < 6 && !code; i++)
        printf("%-12s %llu\n", tool_kinds[i], (unsigned long long)info.kinds[i]);
    patina_cloud_destroy(cloud);
    return result;
}

int tool_analyse(int count, char **arguments)
{
    const char *in = NULL, *out = NULL;
    double neighbours = 0;
    uint64_t memory = 0;
    int grid = 0;
    uint32_t keep_colors = 0;
    struct columns columns = {0};
    for (int i = 0; i < count; i++) {
        const char *value = i + 1 < count ? arguments[i + 1] : NULL;
        if (arguments[i][0] != '-') {
            if (in)
                return tool_misuse("analyse: one file, please");
            in = arguments[i];
        } else if (!strcmp(arguments[i], "-o") && value) {
            out = value;
            i++;
        } else if (!strcmp(arguments[i], "--grid")) {
            grid = 1;
        } else if (!strcmp(arguments[i], "--keep-colors")) {
            keep_colors = 1;
        } else if (!strcmp(arguments[i], "--trusted")) {
            columns.trusted = 1;
        } else if (!strcmp(arguments[i], "--neighbours") && value) {
            if (parse_numbers(value, &neighbours, 1, 1) < 0 || neighbours < 3 || neighbours > 64)
                return tool_misuse("'%s' is no value for option '--neighbours': 3 to 64", value);
            i++;
        } else if (!strcmp(arguments[i], "--memory") && value) {
            if (tool_parse_memory(value, &memory))
                return tool_misuse("'%s' is no value for option '--memory': as 2G or 500M", value);
            i++;
        } else {
            return tool_misuse("analyse: '%s' is no option, or lacks its value", arguments[i]);
        }
    }
    if (!in || !out || !*out)
        return tool_misuse("analyse: a file to read, and -o OUT.ply, please");
    const int whole = pt_ends_in(out, ".cloud");
    if (whole != pt_ends_in(in, ".cloud") || (whole && (grid || columns.trusted)) || (!whole && (memory || keep_colors)))
        return tool_misuse("analyse: of IN.cloud -o OUT.cloud, with --memory or --keep-colors and without --grid or --trusted; "
                           "of any other file -o OUT.ply");
    patina_progress *progress = NULL;
    const int code = patina_progress_create(&progress);
    tool_cancellable(progress, NULL);
    const int result = code    ? tool_failed(in, NULL, code)
                       : whole ? analyse_cloud(in, out, (uint32_t)neighbours, keep_colors, memory, progress)
                               : analyse(in, out, (uint32_t)neighbours, grid, progress, &columns);
    tool_cancellable(NULL, NULL);
    tool_drain_log(1);
    patina_progress_destroy(progress);
    release(&columns);
    return result;
}
