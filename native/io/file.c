// SPDX-License-Identifier: GPL-3.0-or-later
// patina_file_*: hands columns out. open.c opens files.
#include "file.h"
#include "base/descriptor.h"
#include "base/elementary.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void pt_clip_name(char *name, size_t size, const char *path)
{
    size_t length = strlen(path);
    if (length < size) {
        memcpy(name, path, length + 1);
        return;
    }
    const char *end = path + length - (size - 4);
    while ((*end & 0xc0) == 0x80) // not within a UTF-8 character
        end++;
    memcpy(name, "...", 3);
    memcpy(name + 3, end, strlen(end) + 1);
}

void patina_file_destroy(patina_file *file)
{
    if (!file)
        return;
    for (uint32_t i = 0; i < file->attribute_count; i++)
        free(file->attributes[i].data);
    free(file->attributes);
    free(file->scans);
    free(file->position);
    free(file->normal);
    free(file->color);
    pt_handle_destroy(&file->handle);
    free(file);
}

// ---- what is in it -------------------------------------------------------------------------------------------------

// Stations are told by scan, so all scans with points must have one.
static uint32_t count_stations(const patina_file *file)
{
    for (uint32_t i = 0; i < file->scan_count; i++)
        if (file->scans[i].parallel || (file->scans[i].nowhere && file->scans[i].count))
            return 0;
    return file->scan_count;
}

int patina_file_get_info(const patina_file *file, patina_file_info *info)
{
    if (!file || !info)
        return pt_fail(file ? &file->handle : NULL, PATINA_ERROR_ARGUMENT, "patina_file_get_info: %s is NULL",
                       file ? "info" : "file");
    patina_file_info ours = {.count = file->count,
                             .attributes = file->attribute_count,
                             .position_type = file->position_type,
                             .color_type = file->color_type,
                             .has_normals = file->normal != NULL,
                             .invalid_positions = file->invalid_positions,
                             .stations = count_stations(file),
                             .scans = file->scan_count,
                             .splats = file->splats};
    memcpy(ours.format, file->format, sizeof ours.format);
    memcpy(ours.origin, file->origin, sizeof ours.origin);
    memcpy(ours.box_min, file->box_min, sizeof ours.box_min);
    memcpy(ours.box_max, file->box_max, sizeof ours.box_max);
    return pt_give(&file->handle, "patina_file_get_info", &ours, sizeof ours, info);
}

int patina_file_get_scan(const patina_file *file, uint32_t index, patina_file_scan *scan)
{
    if (!file || !scan)
        return pt_fail(file ? &file->handle : NULL, PATINA_ERROR_ARGUMENT, "patina_file_get_scan: %s is NULL",
                       file ? "scan" : "file");
    if (index >= file->scan_count)
        return pt_fail(&file->handle, PATINA_ERROR_ARGUMENT, "patina_file_get_scan: there is no scan %u, the file has %u",
                       index, file->scan_count);
    const struct pt_scan *found = &file->scans[index];
    patina_file_scan ours = {.first = found->first,
                             .count = found->count,
                             .columns = found->columns,
                             .rows = found->rows,
                             .has_station = !found->parallel && !found->nowhere,
                             .interval = found->interval};
    memcpy(ours.name, found->name, sizeof ours.name);
    memcpy(ours.pose, found->pose, sizeof ours.pose);
    memcpy(ours.direction, found->direction, sizeof ours.direction);
    if (ours.has_station)
        memcpy(ours.station, found->station, sizeof ours.station);
    return pt_give(&file->handle, "patina_file_get_scan", &ours, sizeof ours, scan);
}

static int check_index(const patina_file *file, const char *call, uint32_t index)
{
    if (index < file->attribute_count)
        return PATINA_OK;
    return pt_fail(&file->handle, PATINA_ERROR_ARGUMENT, "%s: there is no attribute %u, the file has %u", call, index,
                   file->attribute_count);
}

int patina_file_get_attribute(const patina_file *file, uint32_t index, patina_file_attribute *attribute)
{
    if (!file || !attribute)
        return pt_fail(file ? &file->handle : NULL, PATINA_ERROR_ARGUMENT, "patina_file_get_attribute: %s is NULL",
                       file ? "attribute" : "file");
    int code = check_index(file, "patina_file_get_attribute", index);
    if (code)
        return code;
    patina_file_attribute ours = {.type = file->attributes[index].type};
    memcpy(ours.name, file->attributes[index].name, sizeof ours.name);
    return pt_give(&file->handle, "patina_file_get_attribute", &ours, sizeof ours, attribute);
}

// ---- columns -------------------------------------------------------------------------------------------------------

// A column of point_size bytes a point, into a buffer of `size` bytes.
static int check_read(const patina_file *file, const char *call, bool has, const char *column, const void *buffer, size_t size,
                      size_t point_size)
{
    if (!file)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s: file is NULL", call);
    if (!has)
        return pt_fail(&file->handle, PATINA_ERROR_EMPTY, "%s: the file has no %s", call, column);
    if (size / point_size < file->count)
        return pt_fail(&file->handle, PATINA_ERROR_ARGUMENT, "%s: a buffer of %zu bytes cannot hold %llu points of %zu", call,
                       size, (unsigned long long)file->count, point_size);
    if (!buffer && file->count)
        return pt_fail(&file->handle, PATINA_ERROR_ARGUMENT, "%s: the buffer is NULL", call);
    return PATINA_OK;
}

int patina_file_read_positions(const patina_file *file, float *xyz, size_t size)
{
    int code = check_read(file, "patina_file_read_positions", true, "positions", xyz, size, 3 * sizeof *xyz);
    if (!code && file->count)
        memcpy(xyz, file->position, (size_t)file->count * 3 * sizeof *xyz);
    return code;
}

int patina_file_read_normals(const patina_file *file, float *xyz, size_t size)
{
    int code = check_read(file, "patina_file_read_normals", file && file->normal, "normals", xyz, size, 3 * sizeof *xyz);
    if (!code && file->count)
        memcpy(xyz, file->normal, (size_t)file->count * 3 * sizeof *xyz);
    return code;
}

// IEC 61966-2-1, both ways.
static float linear_from_srgb(float s)
{
    return s <= 0.04045f ? s / 12.92f : (float)pt_pow((double)((s + 0.055f) / 1.055f), (double)2.4f);
}

static float srgb_from_linear(float l)
{
    return l <= 0.0031308f ? l * 12.92f : 1.055f * (float)pt_pow((double)l, (double)(1 / 2.4f)) - 0.055f;
}

static uint8_t byte_from_unit(float value)
{
    return (uint8_t)((value > 0 ? (value < 1 ? value : 1) : 0) * 255 + 0.5f); // NaN: 0
}

int patina_file_read_colors_u8(const patina_file *file, uint8_t *rgba, size_t size)
{
    int code = check_read(file, "patina_file_read_colors_u8", file && file->color, "colours", rgba, size, 4);
    if (code)
        return code;
    const uint16_t *u16 = file->color;
    const float *f32 = file->color;
    switch (file->color_type) {
    case PATINA_UINT8:
        if (file->count)
            memcpy(rgba, file->color, (size_t)file->count * 4);
        break;
    case PATINA_UINT16:
        for (uint64_t i = 0; i < 4 * file->count; i++)
            rgba[i] = (uint8_t)((u16[i] * 255u + 32767u) / 65535u);
        break;
    default:
        for (uint64_t i = 0; i < 4 * file->count; i++)
            rgba[i] = byte_from_unit(i % 4 == 3 ? f32[i] : srgb_from_linear(f32[i]));
    }
    return PATINA_OK;
}

int patina_file_read_colors_f32(const patina_file *file, float *rgba, size_t size)
{
    int code = check_read(file, "patina_file_read_colors_f32", file && file->color, "colours", rgba, size, 4 * sizeof *rgba);
    if (code)
        return code;
    const uint8_t *u8 = file->color;
    const uint16_t *u16 = file->color;
    float decoded[256];
    for (int i = 0; i < 256; i++)
        decoded[i] = linear_from_srgb((float)i / 255);
    switch (file->color_type) {
    case PATINA_UINT8:
        for (uint64_t i = 0; i < 4 * file->count; i++)
            rgba[i] = i % 4 == 3 ? (float)u8[i] / 255 : decoded[u8[i]];
        break;
    case PATINA_UINT16:
        for (uint64_t i = 0; i < 4 * file->count; i++)
            rgba[i] = i % 4 == 3 ? (float)u16[i] / 65535 : linear_from_srgb((float)u16[i] / 65535);
        break;
    default:
        if (file->count)
            memcpy(rgba, file->color, (size_t)file->count * 4 * sizeof *rgba);
    }
    return PATINA_OK;
}

int patina_file_read_stations(const patina_file *file, double *xyz, size_t size)
{
    if (!file || (!xyz && count_stations(file)))
        return pt_fail(file ? &file->handle : NULL, PATINA_ERROR_ARGUMENT, "patina_file_read_stations: %s is NULL",
                       file ? "the buffer" : "file");
    uint32_t count = count_stations(file);
    if (!count)
        return pt_fail(&file->handle, PATINA_ERROR_EMPTY, "patina_file_read_stations: the file has no stations");
    if (size / (3 * sizeof *xyz) < count)
        return pt_fail(&file->handle, PATINA_ERROR_ARGUMENT,
                       "patina_file_read_stations: a buffer of %zu bytes cannot hold %u stations", size, count);
    for (uint32_t i = 0; i < count; i++)
        memcpy(xyz + 3 * i, file->scans[i].station, 3 * sizeof *xyz);
    return PATINA_OK;
}

int patina_file_read_attribute(const patina_file *file, uint32_t index, float *values, size_t size)
{
    int code = check_read(file, "patina_file_read_attribute", true, "attributes", values, size, sizeof *values);
    if (!code)
        code = check_index(file, "patina_file_read_attribute", index);
    if (code)
        return code;
    const struct pt_column *column = &file->attributes[index];
    for (uint64_t i = 0; i < file->count; i++)
        values[i] = (float)pt_file_value(column, i);
    return PATINA_OK;
}
