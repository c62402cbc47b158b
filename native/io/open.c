// SPDX-License-Identifier: GPL-3.0-or-later
// patina_file_open: maps a file and has it read. Formats are told apart by content, not by name.
#include "file.h"
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

// path: NULL where other files cannot be found from this one.
static int read_input(const struct pt_input *input, const char *path, patina_file **out)
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

// Maps the file and reads it.
static int read_disk(const struct pt_disk *disk, struct pt_input *input, const char *path, patina_file **out)
{
    if (disk->kind != PT_DISK_FILE)
        return pt_fail(NULL, PATINA_ERROR_FILE, "%s: is %s, not a file", input->name,
                       disk->kind == PT_DISK_FOLDER ? "a folder" : "a device or pipe");
    input->size = (size_t)disk->size;
    if (input->size == 0) // cannot be mapped; the reader has the words for it
        return read_input(input, path, out);
    void *data;
    int error = pt_disk_map(disk, 0, input->size, PT_DISK_ONCE, &data);
    if (error)
        return fail_to_open(input, error);
    input->data = data;
    int code = read_input(input, path, out);
    pt_pages_free(data, input->size);
    return code;
}

static int open_file(const char *path, bool alone, struct patina_progress *progress, struct patina_file **out)
{
    struct pt_input input = {.progress = progress};
    struct pt_disk disk;
    pt_clip_name(input.name, sizeof input.name, path);
    if (pt_same_start(path, "http://", 7) || pt_same_start(path, "https://", 8))
        return pt_fail(NULL, PATINA_ERROR_UNSUPPORTED,
                       "%s: an address, whose COPC Patina's add-on for Blender shows, by Python; here files are read",
                       input.name);
    pt_progress_set(progress, 0);
    int error = pt_disk_open(path, &disk);
    if (error)
        return fail_to_open(&input, error);
    int code = read_disk(&disk, &input, alone ? NULL : path, out);
    pt_disk_close(&disk);
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
