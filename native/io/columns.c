// SPDX-License-Identifier: GPL-3.0-or-later
// Columns of a file in memory, and what readers know of their types.
#include "file.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

size_t pt_type_size(uint32_t type)
{
    switch (type) {
    case PATINA_INT8:
    case PATINA_UINT8: return 1;
    case PATINA_INT16:
    case PATINA_UINT16: return 2;
    case PATINA_INT32:
    case PATINA_UINT32:
    case PATINA_FLOAT32: return 4;
    case PATINA_FLOAT64: return 8;
    }
    return 0;
}

int pt_file_add_attribute(struct patina_file *file, const char *name, uint32_t type, void *data)
{
    struct pt_column *grown = realloc(file->attributes, (file->attribute_count + 1) * sizeof *grown);
    if (!grown) {
        free(data);
        return PATINA_ERROR_MEMORY;
    }
    file->attributes = grown;
    struct pt_column *column = &grown[file->attribute_count++];
    *column = (struct pt_column){.type = type, .data = data};
    snprintf(column->name, sizeof column->name, "%s", name);
    return PATINA_OK;
}

const struct pt_column *pt_file_find_attribute(const struct patina_file *file, const char *name)
{
    for (uint32_t i = 0; i < file->attribute_count; i++)
        if (!strcmp(file->attributes[i].name, name))
            return &file->attributes[i];
    return NULL;
}

double pt_file_value(const struct pt_column *column, uint64_t i)
{
    switch (column->type) {
    case PATINA_INT8: return ((const int8_t *)column->data)[i];
    case PATINA_UINT8: return ((const uint8_t *)column->data)[i];
    case PATINA_INT16: return ((const int16_t *)column->data)[i];
    case PATINA_UINT16: return ((const uint16_t *)column->data)[i];
    case PATINA_INT32: return ((const int32_t *)column->data)[i];
    case PATINA_UINT32: return ((const uint32_t *)column->data)[i];
    case PATINA_FLOAT64: return ((const double *)column->data)[i];
    }
    return (double)((const float *)column->data)[i];
}
