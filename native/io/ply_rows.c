// SPDX-License-Identifier: GPL-3.0-or-later
// What the readers of text rows and of byte rows share.
#include "base/progress.h"
#include "number.h"
#include "ply.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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
        at->input->name, element->name, (unsigned long long)element->count, (unsigned long long)row,
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

int ply_read_rows(struct ply_cursor *at, const struct ply_element *element, const struct ply_target *targets,
                  struct ply_lists *lists)
{
    return at->header->format == PLY_ASCII ? ply_read_ascii(at, element, targets, lists)
                                           : ply_read_binary(at, element, targets, lists);
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

// A count that is too small leaves points out: that deserves a line in the log.
void ply_warn_of_rest(struct ply_cursor at)
{
    const uint8_t *p = at.input->data + at.offset, *end = at.input->data + at.input->size;
    if (at.header->format != PLY_ASCII) {
        if (p != end)
            pt_log(PT_LOG_WARNING, "%s: %llu bytes follow behind byte %llu, where the header's rows end, and were not read",
                   at.input->name, (unsigned long long)(end - p), (unsigned long long)at.offset);
        return;
    }
    for (; p != end && (pt_is_blank(*p) || pt_is_line_end(*p)); p++)
        at.line += *p == '\n' || (*p == '\r' && (p + 1 == end || p[1] != '\n'));
    if (p != end)
        pt_log(PT_LOG_WARNING, "%s: line %llu and what follows is more than the header declares, and was not read",
               at.input->name, (unsigned long long)at.line);
}

// ---- a body that was copied as text --------------------------------------------------------------------------------

// How many line feeds the body holds; 0 when one of them has no carriage return before it.
static uint64_t count_line_ends(const struct pt_input *input, uint64_t body)
{
    const uint8_t *p = input->data + body, *end = input->data + input->size;
    uint64_t count = 0;
    for (; p < end && (p = memchr(p, '\n', (size_t)(end - p))); p++, count++)
        if (p == input->data + body || p[-1] != '\r')
            return 0;
    return count;
}

// An honest body of n bytes has n / 256 line feeds, of which one in 256 follows a carriage return: that all do, and that
// the rows do not end where the file does, is no accident.
int ply_check_line_ends(const struct pt_input *input, const struct ply_header *header)
{
    uint64_t count = header->crlf && header->format != PLY_ASCII ? count_line_ends(input, header->body) : 0;
    struct ply_cursor at = { .input = input, .header = header, .offset = header->body, .tone = PLY_QUIET };
    int code = PATINA_OK;
    if (!count)
        return PATINA_OK;
    for (uint32_t e = 0; e < header->element_count && !code; e++)
        code = ply_read_binary(&at, &header->elements[e], NULL, NULL);
    bool lists = false; // behind one that is read wrongly, anything may follow
    for (uint32_t k = 0; k < header->property_count; k++)
        lists |= header->properties[k].count_type != PATINA_NONE;
    uint64_t left = input->size - at.offset;
    if (code == PATINA_ERROR_CANCELLED || (!code && (left == 0 || (!lists && left > count))))
        return code;
    return pt_fail(NULL, PATINA_ERROR_FORMAT,
                   "%s: damaged by being copied as text: each of the %llu bytes 0A in its binary rows has a 0D before it, so "
                   "that they no longer lie where the header says; copy it anew as binary",
                   input->name, (unsigned long long)count);
}
