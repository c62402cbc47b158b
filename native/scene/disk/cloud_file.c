// SPDX-License-Identifier: GPL-3.0-or-later
// From a file's columns to a cloud.
#include "builder.h"
#include "scene/clouds/cloud.h"
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

// What a file's columns are of a cloud; *classes: to be freed. PATINA_OK, or PATINA_ERROR_MEMORY without words.
static int describe(const patina_file *file, patina_cloud_desc *desc, uint8_t **classes)
{
    *desc = (patina_cloud_desc){
        .struct_size = sizeof *desc,
        .count = file->count,
        .position = {.data = file->position, .type = PATINA_FLOAT32, .components = 3},
        .normal = {.data = file->normal, .type = PATINA_FLOAT32, .components = 3},
        .color = {.data = file->color, .type = file->color_type, .components = 4},
        .origin = {file->origin[0], file->origin[1], file->origin[2]},
    };
    if (file->splats) {
        desc->opacity = (patina_array){.data = pt_file_find_attribute(file, "opacity")->data, PATINA_FLOAT32, 1, 0};
        desc->radius = (patina_array){.data = pt_file_find_attribute(file, "radius")->data, PATINA_FLOAT32, 1, 0};
    }
    const struct pt_column *column = class_column(file);
    *classes = column ? read_classes(file, column) : NULL;
    desc->classes = (patina_array){.data = *classes, .type = PATINA_UINT8, .components = 1};
    return column && !*classes ? PATINA_ERROR_MEMORY : PATINA_OK;
}

int patina_file_cloud(const patina_file *file, uint32_t threads, patina_progress *progress, patina_cloud **out)
{
    patina_cloud_desc desc;
    uint8_t *classes;
    if (!file)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_file_cloud: file is NULL");
    int error = describe(file, &desc, &classes);
    if (error)
        return pt_fail(&file->handle, error, "classes of %llu points: out of memory", (unsigned long long)file->count);
    desc.threads = threads;
    error = patina_cloud_create(&desc, progress, out);
    free(classes);
    return error ? pt_fail_again(&file->handle, error) : PATINA_OK;
}

static const struct pt_column *scalar_column(const patina_file *file, const char *name)
{
    for (uint32_t i = 0; i < file->attribute_count; i++)
        if (!strcmp(file->attributes[i].name, name))
            return &file->attributes[i];
    return NULL;
}

int patina_builder_add_file(patina_builder *builder, const patina_file *file, const char *scalar)
{
    patina_cloud_desc desc;
    uint8_t *classes;
    if (!builder || !file)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_builder_add_file: %s is NULL", builder ? "file" : "builder");
    const struct pt_column *column = scalar ? scalar_column(file, scalar) : NULL;
    if (scalar && !column)
        return pt_fail(&builder->handle, PATINA_ERROR_ARGUMENT, "patina_builder_add_file: there is no attribute '%s'", scalar);
    int error = describe(file, &desc, &classes);
    float *values = column ? malloc((size_t)file->count * sizeof *values + 1) : NULL;
    if (error || (column && !values)) {
        free(classes);
        free(values);
        return pt_fail(&builder->handle, PATINA_ERROR_MEMORY, "%llu points: out of memory", (unsigned long long)file->count);
    }
    for (uint64_t i = 0; column && i < file->count; i++)
        values[i] = (float)pt_file_value(column, i);
    desc.scalar = (patina_array){.data = values, .type = PATINA_FLOAT32, .components = 1};
    error = patina_builder_add(builder, &desc);
    free(values);
    free(classes);
    return error;
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
