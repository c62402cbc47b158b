// SPDX-License-Identifier: GPL-3.0-or-later
// From a file's columns to a cloud.
#include "cloud.h"
#include "io/file.h"
#include "base/words.h"

#include <stdlib.h>
#include <string.h>

static const struct pt_column *class_column(const struct patina_file *file)
{
    static const char prefix[] = "scalar_"; // as CloudCompare writes it
    for (uint32_t i = 0; i < file->attribute_count; i++) {
        const char *name = file->attributes[i].name;
        name += pt_same_start(name, prefix, sizeof prefix - 1) ? sizeof prefix - 1 : 0;
        if (pt_same_word(name, "class") || pt_same_word(name, "classification"))
            return &file->attributes[i];
    }
    return NULL;
}

// 0..255, others 0. NULL without memory.
static uint8_t *read_classes(const struct patina_file *file, const struct pt_column *column)
{
    uint8_t *classes = malloc(file->count + 1);
    float *values = malloc(file->count * sizeof *values + 1);
    int error = !classes || !values ||
                patina_file_read_attribute(file, (uint32_t)(column - file->attributes), values, file->count * sizeof *values);
    for (uint64_t i = 0; i < file->count && !error; i++)
        classes[i] = values[i] >= 0.0f && values[i] <= 255.0f ? (uint8_t)values[i] : 0;
    free(values);
    if (error)
        free(classes);
    return error ? NULL : classes;
}

int patina_file_cloud(const patina_file *file, uint32_t threads, patina_progress *progress, patina_cloud **out)
{
    if (!file)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_file_cloud: file is NULL");
    patina_cloud_desc desc = {
        .struct_size = sizeof desc,
        .count = file->count,
        .position = {.data = file->position, .type = PATINA_FLOAT32, .components = 3},
        .normal = {.data = file->normal, .type = PATINA_FLOAT32, .components = 3},
        .color = {.data = file->color, .type = file->color_type, .components = 4},
        .origin = {file->origin[0], file->origin[1], file->origin[2]},
        .threads = threads,
    };
    if (file->splats) {
        desc.opacity = (patina_array){.data = pt_file_find_attribute(file, "opacity")->data, PATINA_FLOAT32, 1, 0};
        desc.radius = (patina_array){.data = pt_file_find_attribute(file, "radius")->data, PATINA_FLOAT32, 1, 0};
    }
    const struct pt_column *column = class_column(file);
    uint8_t *classes = column ? read_classes(file, column) : NULL;
    if (column && !classes)
        return pt_fail(&file->handle, PATINA_ERROR_MEMORY, "classes of %llu points: out of memory",
                       (unsigned long long)file->count);
    desc.classes = (patina_array){.data = classes, .type = PATINA_UINT8, .components = 1};
    int error = patina_cloud_create(&desc, progress, out);
    free(classes);
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
