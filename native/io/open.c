// SPDX-License-Identifier: GPL-3.0-or-later
// patina_file_open: maps a file and has it read. Formats are told apart by content, not by name.
#include "file.h"
#include "base/descriptor.h"
#include "base/platform.h"
#include "base/progress.h"
#include "base/words.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

// Formats that only the add-on reads, by their first bytes; NULL for others.
static const char *format_of_add_on(const struct pt_input *input)
{
    static const struct {
        const char *start, *format;
    } known[] = {
        {"LASF", "LAS, LAZ or COPC"}, {"ASTM-E57", "E57"}, {"# .PCD", "PCD"}, {"VERSION .7", "PCD"}, {"VERSION 0.7", "PCD"},
    };
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        if (input->size >= strlen(known[i].start) && !memcmp(input->data, known[i].start, strlen(known[i].start)))
            return known[i].format;
    return NULL;
}

// Packed splats, told by their names: their first bytes are gzip's, or nothing at all.
static const char *packed_splats(const char *name)
{
    static const char *const endings[] = {".spz", ".splat", ".ksplat", ".sog"};
    const size_t length = strlen(name);
    for (size_t i = 0; i < sizeof endings / sizeof *endings; i++) {
        const size_t size = strlen(endings[i]);
        if (length > size && pt_same_start(name + length - size, endings[i], size))
            return endings[i] + 1;
    }
    return NULL;
}

static pt_file_opener open_file;

static int refuse_others(const struct pt_input *input)
{
    const char *elsewhere = format_of_add_on(input);
    if (elsewhere)
        return pt_fail(
            NULL, PATINA_ERROR_FORMAT,
            "%s: a file of format %s, which Patina's add-on for Blender reads and exports as PLY; here PLY, XYZ, CSV, PTS, "
            "PTX and conf are read",
            input->name, elsewhere);
    const char *packed = packed_splats(input->name);
    if (packed)
        return pt_fail(NULL, PATINA_ERROR_FORMAT,
                       "%s: packed Gaussian splats (%s) are not read: convert them to a PLY, as SuperSplat exports it",
                       input->name, packed);
    return PATINA_OK;
}

// path: NULL where other files cannot be found from this one.
static int read_input(const struct pt_input *input, const char *path, patina_file **out)
{
    const int refused = refuse_others(input);
    if (refused)
        return refused;
    const bool conf = pt_conf_is(input);
    if (conf && !path)
        return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: a .conf names other files, which are not found from here", input->name);
    struct patina_file *file = calloc(1, sizeof *file);
    if (!file)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", input->name);
    pt_handle_init(&file->handle);
    int code = conf                ? pt_conf_read(file, input, path, open_file)
               : pt_text_is(input) ? pt_text_read(file, input)
                                   : pt_ply_read(file, input);
    if (!code && pt_file_measure_scans(file))
        code = pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", input->name);
    if (code) {
        patina_file_destroy(file);
        return code;
    }
    *out = file;
    return PATINA_OK;
}

static int fail_to_open(const struct pt_input *input, int error)
{
    char buffer[128];
    return pt_fail(NULL, PATINA_ERROR_FILE, "%s: cannot be read: %s", input->name, pt_error_text(error, buffer, sizeof buffer));
}

// *data: NULL where the file is empty, which cannot be mapped; the readers have the words for it.
static int map_disk(const struct pt_disk *disk, struct pt_input *input, void **data)
{
    *data = NULL;
    if (disk->kind != PT_DISK_FILE)
        return pt_fail(NULL, PATINA_ERROR_FILE, "%s: is %s, not a file", input->name,
                       disk->kind == PT_DISK_FOLDER ? "a folder" : "a device or pipe");
    input->size = (size_t)disk->size;
    const int error = input->size ? pt_disk_map(disk, 0, input->size, PT_DISK_ONCE, data) : 0;
    input->data = *data;
    return error ? fail_to_open(input, error) : PATINA_OK;
}

// The input, mapped; to be freed as pages.
static int map_file(const char *path, struct pt_input *input, void **data)
{
    struct pt_disk disk;
    pt_clip_name(input->name, sizeof input->name, path);
    if (pt_same_start(path, "http://", 7) || pt_same_start(path, "https://", 8))
        return pt_fail(NULL, PATINA_ERROR_UNSUPPORTED,
                       "%s: an address, whose COPC Patina's add-on for Blender shows, by Python; here files are read",
                       input->name);
    pt_progress_set(input->progress, 0);
    const int error = pt_disk_open(path, &disk);
    if (error)
        return fail_to_open(input, error);
    const int code = map_disk(&disk, input, data);
    pt_disk_close(&disk);
    return code;
}

// Whether something of the file could not be read while it was: what was made of it is not what it holds.
static int fail_lost(const struct pt_input *input)
{
    return pt_pages_lost(input->data, input->size)
               ? pt_fail(NULL, PATINA_ERROR_FILE, "%s: cannot be read: it was cut short meanwhile, or its disk is gone",
                         input->name)
               : PATINA_OK;
}

static int open_file(const char *path, bool alone, struct patina_progress *progress, struct patina_file **out)
{
    struct pt_input input = {.progress = progress};
    void *data;
    int code = map_file(path, &input, &data);
    if (code)
        return code;
    code = read_input(&input, alone ? NULL : path, out);
    if (fail_lost(&input)) {
        if (!code)
            patina_file_destroy(*out);
        *out = NULL;
        code = PATINA_ERROR_FILE;
    }
    pt_pages_free(data, input.size);
    return code;
}

int patina_file_open(const char *path, patina_progress *progress, patina_file **out)
{
    if (!out)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_file_open: out is NULL");
    *out = NULL;
    if (!path)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_file_open: path is NULL");
    return open_file(path, false, progress, out);
}

int patina_file_open_memory(const void *data, size_t size, patina_file **out)
{
    if (!out)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_file_open_memory: out is NULL");
    *out = NULL;
    if (!data && size)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_file_open_memory: data is NULL");
    struct pt_input input = {.name = "(memory)", .data = data, .size = size};
    return read_input(&input, NULL, out);
}

// ---- by and by -----------------------------------------------------------------------------------------------------

struct patina_rows {
    struct pt_handle handle;
    struct pt_input input;
    void *data; // the input's, mapped
    char *path;
    struct ply_rows *ply; // NULL: the file is read whole
    const char *whole;    // why
    uint64_t returned;    // bytes of the input that are held no longer
    bool over;
};

void patina_rows_destroy(patina_rows *rows)
{
    if (!rows)
        return;
    pt_ply_end(rows->ply);
    pt_pages_free(rows->data, rows->input.size);
    free(rows->path);
    pt_handle_destroy(&rows->handle);
    free(rows);
}

static int begin_rows(struct patina_rows *rows, const char *path)
{
    int code = map_file(path, &rows->input, &rows->data);
    if (!code)
        code = refuse_others(&rows->input);
    if (code)
        return code;
    if (pt_conf_is(&rows->input))
        rows->whole = "its scans are placed together";
    else if (pt_text_is(&rows->input))
        rows->whole = "what the columns of a text hold is known when all its lines are";
    else
        code = pt_ply_begin(&rows->input, &rows->ply, &rows->whole);
    const int lost = fail_lost(&rows->input);
    return lost ? lost : code;
}

int patina_rows_open(const char *path, patina_progress *progress, patina_rows **out)
{
    if (!path || !out)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_rows_open: bad arguments");
    *out = NULL;
    struct patina_rows *rows = calloc(1, sizeof *rows);
    if (!rows)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", path);
    pt_handle_init(&rows->handle);
    rows->input.progress = progress;
    rows->path = malloc(strlen(path) + 1);
    int code = rows->path ? begin_rows(rows, path) : pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", path);
    if (code) {
        patina_rows_destroy(rows);
        return code;
    }
    memcpy(rows->path, path, strlen(path) + 1);
    *out = rows;
    return PATINA_OK;
}

int patina_rows_get_info(const patina_rows *rows, patina_rows_info *info)
{
    if (!rows || !info)
        return pt_fail(rows ? &rows->handle : NULL, PATINA_ERROR_ARGUMENT, "patina_rows_get_info: bad arguments");
    patina_rows_info ours = {.count = rows->ply ? pt_ply_count(rows->ply) : 0};
    if (rows->whole)
        memcpy(ours.whole, rows->whole, strlen(rows->whole) + 1);
    return pt_give(&rows->handle, "patina_rows_get_info", &ours, sizeof ours, info);
}

static int next_window(struct patina_rows *rows, uint64_t most, patina_file **out)
{
    uint64_t behind;
    struct patina_file *file = calloc(1, sizeof *file);
    if (!file)
        return pt_fail(&rows->handle, PATINA_ERROR_MEMORY, "%s: out of memory", rows->input.name);
    pt_handle_init(&file->handle);
    int code = pt_ply_next(rows->ply, most, file, &behind);
    const int lost = fail_lost(&rows->input);
    code = lost ? lost : code;
    if (code || !file->count) {
        patina_file_destroy(file);
        return code ? pt_fail_again(&rows->handle, code) : PATINA_OK;
    }
    if (behind > rows->returned)
        pt_pages_return((char *)rows->data + rows->returned, behind - rows->returned);
    rows->returned = behind;
    *out = file;
    return PATINA_OK;
}

int patina_rows_next(patina_rows *rows, uint64_t most, patina_file **out)
{
    if (!rows || !out || !most)
        return pt_fail(rows ? &rows->handle : NULL, PATINA_ERROR_ARGUMENT, "patina_rows_next: bad arguments");
    *out = NULL;
    if (rows->ply)
        return next_window(rows, most, out);
    if (rows->over)
        return PATINA_OK;
    rows->over = true;
    const int code = open_file(rows->path, false, rows->input.progress, out);
    return code ? pt_fail_again(&rows->handle, code) : PATINA_OK;
}
