// SPDX-License-Identifier: GPL-3.0-or-later
// From a file's columns to a cloud.
#include "cloud.h"
#include "io/file.h"

int patina_file_cloud(const patina_file *file, uint32_t threads, patina_progress *progress, patina_cloud **out)
{
    if (!file)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_file_cloud: file is NULL");
    patina_cloud_desc desc = {
        .struct_size = sizeof desc,
        .count = file->count,
        .position = { .data = file->position, .type = PATINA_FLOAT32, .components = 3 },
        .normal = { .data = file->normal, .type = PATINA_FLOAT32, .components = 3 },
        .color = { .data = file->color, .type = file->color_type, .components = 4 },
        .origin = { file->origin[0], file->origin[1], file->origin[2] },
        .threads = threads,
    };
    int error = patina_cloud_create(&desc, progress, out);
    return error ? pt_fail_again(&file->handle, error) : PATINA_OK;
}

int patina_cloud_load(const char *path, patina_progress *progress, patina_cloud **out)
{
    patina_file *file = NULL;
    if (!out)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_load: out is NULL");
    *out = NULL;
    int error = patina_file_open(path, progress, &file);
    if (error)
        return error;
    error = patina_file_cloud(file, 0, progress, out); // its progress starts over: 0..1 for the file, 0..1 for the cloud
    patina_file_destroy(file);
    return error;
}
