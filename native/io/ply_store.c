// SPDX-License-Identifier: GPL-3.0-or-later
// What the readers of text rows and of byte rows share: where values go, and how faults are told.
#include "base/progress.h"
#include "ply.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

int ply_poll(const struct pt_input *input, uint64_t offset)
{
    pt_progress_set(input->progress, (double)offset / (double)input->size);
    if (pt_progress_cancelled(input->progress))
        return pt_fail(NULL, PATINA_ERROR_CANCELLED, "%s: reading was cancelled", input->name);
    return PATINA_OK;
}

static double clamp(double value, double low, double high)
{
    return value > low ? (value < high ? value : high) : low; // NaN: low
}

static double to_byte(const struct ply_target *target, double value)
{
    value = value * target->scale + target->offset;
    return clamp(target->wrap && value < 0 ? value + 256 : value, 0, 255) + 0.5;
}

void ply_store(const struct ply_target *target, uint64_t first, size_t n, const double *values)
{
    size_t step = target->step, start = (size_t)first * step;
    double scale = target->scale;
    switch (target->type) {
    case PATINA_FLOAT32:
        for (size_t i = 0; i < n; i++)
            ((float *)target->data)[start + i * step] = (float)(values[i] * scale);
        break;
    case PATINA_FLOAT64:
        for (size_t i = 0; i < n; i++)
            ((double *)target->data)[start + i * step] = values[i] * scale;
        break;
    case PATINA_UINT8:
        for (size_t i = 0; i < n; i++)
            ((uint8_t *)target->data)[start + i * step] = (uint8_t)to_byte(target, values[i]);
        break;
    case PATINA_UINT16:
        for (size_t i = 0; i < n; i++)
            ((uint16_t *)target->data)[start + i * step] = (uint16_t)(clamp(values[i] * scale, 0, UINT16_MAX) + 0.5);
        break;
    case PATINA_UINT32:
        for (size_t i = 0; i < n; i++)
            ((uint32_t *)target->data)[start + i * step] = (uint32_t)clamp(values[i], 0, UINT32_MAX);
        break;
    case PATINA_INT8:
        for (size_t i = 0; i < n; i++)
            ((int8_t *)target->data)[start + i * step] = (int8_t)clamp(values[i], INT8_MIN, INT8_MAX);
        break;
    case PATINA_INT16:
        for (size_t i = 0; i < n; i++)
            ((int16_t *)target->data)[start + i * step] = (int16_t)clamp(values[i], INT16_MIN, INT16_MAX);
        break;
    case PATINA_INT32:
        for (size_t i = 0; i < n; i++)
            ((int32_t *)target->data)[start + i * step] = (int32_t)clamp(values[i], INT32_MIN, INT32_MAX);
        break;
    }
}

// Bytes that a row takes at the least. Text: a digit and a blank or line end a scalar, and lists may be absent. Bytes:
// every list with its count alone.
static uint64_t least_row(const struct ply_header *header, const struct ply_element *element)
{
    bool text = header->format == PLY_ASCII;
    uint64_t size = 0;
    for (uint32_t k = 0; k < element->properties; k++) {
        const struct ply_property *property = &header->properties[element->first + k];
        if (property->count_type == PATINA_NONE)
            size += text ? 2 : pt_type_size(property->type);
        else
            size += text ? 0 : pt_type_size(property->count_type);
    }
    return text && element->properties && size == 0 ? 2 : size;
}

int ply_check_count(const struct ply_cursor *at, const struct ply_element *element)
{
    uint64_t row = least_row(at->header, element), there = at->input->size - at->offset;
    uint64_t usable = there + (at->header->format == PLY_ASCII); // the last line of a text needs no end
    if (row == 0 || element->count <= usable / row)
        return PATINA_OK;
    return ply_fault(
        at, "%s: cut short: element %s declares %llu rows of at least %llu bytes, but only %llu bytes follow from byte %llu on",
        at->input->name, element->name, (unsigned long long)(at->all ? at->all : element->count), (unsigned long long)row,
        (unsigned long long)there, (unsigned long long)at->offset);
}

int ply_fault(const struct ply_cursor *at, const char *format, ...)
{
    char text[512];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (at->tone == PLY_REFUSE)
        return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s", text);
    if (at->tone == PLY_WARN)
        pt_log(PT_LOG_WARNING, "%s", text);
    return PATINA_ERROR_FORMAT;
}

int ply_make_room(const struct ply_cursor *at, struct ply_lists *lists, size_t count)
{
    if (count <= lists->room)
        return PATINA_OK;
    size_t room = 2 * count;
    double *grown = realloc(lists->items, room * sizeof *grown);
    if (!grown)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: no memory for a list of %zu", at->input->name, count);
    lists->items = grown;
    lists->room = room;
    return PATINA_OK;
}
