// SPDX-License-Identifier: GPL-3.0-or-later
// What a file knows of its scanner: stations, and of each point its scan, row and column, for an analysis; scans, for range images.
#include "tool.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// The attribute by this name as numbers; *out stays NULL where there is none.
static int read_numbers(const patina_file *file, const char *name, int32_t **out)
{
    uint64_t count;
    uint32_t index;
    int code = tool_find_attribute(file, name, &count, &index);
    if (code || index == UINT32_MAX)
        return code;
    float *values = malloc(count * sizeof *values + 1); // exact: whole numbers below 2^24
    *out = malloc(count * sizeof **out + 1);
    code = values && *out ? patina_file_read_attribute(file, index, values, count * sizeof *values) : PATINA_ERROR_MEMORY;
    for (uint64_t i = 0; i < count && !code; i++)
        (*out)[i] = values[i] >= 0 && values[i] < 0x1p24f ? (int32_t)values[i] : -1;
    free(values);
    return code;
}

// Directions of scans whose beams are parallel; without any, none.
static int read_directions(const patina_file *file, uint32_t scans, struct tool_stations *out)
{
    int some = 0, code = PATINA_OK;
    out->directions = calloc((size_t)scans + 1, 3 * sizeof *out->directions);
    for (uint32_t i = 0; i < scans && out->directions && !code; i++) {
        patina_file_scan scan = {.struct_size = sizeof scan};
        code = patina_file_get_scan(file, i, &scan);
        for (int k = 0; k < 3 && !code && !scan.has_station; k++) {
            out->directions[3 * i + (uint32_t)k] = scan.direction[k];
            some |= scan.direction[k] != 0;
        }
    }
    out->direction_count = some ? scans : 0;
    return code || out->directions ? code : PATINA_ERROR_MEMORY;
}

int tool_take_stations(const patina_file *file, struct tool_stations *out)
{
    patina_file_info info = {.struct_size = sizeof info};
    int32_t *scan = NULL;
    *out = (struct tool_stations){0};
    int code = patina_file_get_info(file, &info);
    if (code || info.stations > UINT16_MAX || info.scans > UINT16_MAX)
        return code;
    code = read_numbers(file, "scan", &scan);
    if (!code && !scan && (info.stations != 1 && info.scans != 1))
        return PATINA_OK; // whose points are whose is not known
    out->told = scan != NULL;
    out->count = info.stations;
    out->places = malloc(3 * sizeof(double) * info.stations + 1);
    out->station = calloc(info.count + 1, sizeof *out->station);
    if (!code)
        code = out->places && out->station ? PATINA_OK : PATINA_ERROR_MEMORY;
    if (!code && info.stations)
        code = patina_file_read_stations(file, out->places, 3 * sizeof(double) * info.stations);
    for (uint64_t i = 0; i < info.count && scan && !code; i++)
        out->station[i] = scan[i] >= 0 && scan[i] < UINT16_MAX ? (uint16_t)scan[i] : UINT16_MAX;
    free(scan);
    if (!code && !info.stations)
        code = read_directions(file, info.scans, out);
    if (!code)
        code = read_numbers(file, "row", &out->row);
    return code ? code : read_numbers(file, "column", &out->column);
}

int tool_take_scans(const patina_file *file, const struct tool_stations *stations, const patina_cloud *cloud,
                    struct tool_scans *out)
{
    patina_file_info info = {.struct_size = sizeof info};
    *out = (struct tool_scans){0};
    int code = patina_file_get_info(file, &info);
    if (code || !info.scans || !stations->station || !info.count)
        return code;
    if (!stations->told && info.scans > 1)
        return PATINA_OK; // whose points are whose is not known
    patina_scan *known = calloc(info.scans, sizeof *known);
    code = known ? PATINA_OK : PATINA_ERROR_MEMORY;
    for (uint32_t i = 0; i < info.scans && !code; i++) {
        patina_file_scan told = {.struct_size = sizeof told};
        code = patina_file_get_scan(file, i, &told);
        known[i].interval = told.interval;
        for (int k = 0; k < 3; k++) {
            known[i].direction[k] = told.direction[k];
            out->directed |= told.direction[k] != 0.0;
        }
    }
    if (!code)
        code = patina_scans_create(cloud, stations->station, known, info.scans, &out->made);
    free(known);
    return code;
}

void tool_describe_stations(const struct tool_stations *stations, patina_analysis_desc *desc)
{
    if (!stations->station)
        return;
    const patina_array scan = {.data = stations->station, .type = PATINA_UINT16, .components = 1};
    desc->station_count = stations->count;
    desc->stations = stations->count ? stations->places : NULL;
    desc->station = stations->count ? scan : desc->station;
    desc->scan = scan;
    desc->direction_count = stations->direction_count;
    desc->directions = stations->directions;
    desc->row = (patina_array){.data = stations->row, .type = PATINA_INT32, .components = 1};
    desc->column = (patina_array){.data = stations->column, .type = PATINA_INT32, .components = 1};
}

void tool_use_grid(const struct tool_stations *stations, const char *path, patina_analysis_desc *desc)
{
    desc->grid = stations->row && stations->column && (stations->count || stations->direction_count);
    if (!desc->grid)
        tool_say("%s: no scan has a grid and tells from where it was taken: neighbours in space tell all", path);
}

int tool_make_scans(const struct tool_stations *stations, const char *path, const patina_cloud *cloud, patina_scans **out)
{
    const patina_scan unknown = {.interval = 0};
    if (stations->station)
        return patina_scans_create(cloud, stations->station, &unknown, 1, out);
    tool_say("%s: which scan each point is of is not known", path);
    return PATINA_OK;
}

int tool_balance(const struct tool_stations *stations, const struct tool_color *color, const patina_cloud *cloud,
                 patina_progress *progress, patina_grade **out)
{
    patina_cloud_info info = {.struct_size = sizeof info};
    uint32_t scans = 0, balanced = 0;
    int code = patina_cloud_get_info(cloud, &info);
    if (code || !stations->told || !info.has_colors || color->source != PATINA_COLOR_OWN || color->unbalanced)
        return code;
    for (uint64_t i = 0; i < info.count; i++)
        scans = stations->station[i] < UINT16_MAX && stations->station[i] >= scans ? stations->station[i] + 1u : scans;
    if (scans < 2)
        return PATINA_OK;
    float *gains = malloc(3 * sizeof *gains * scans);
    patina_scan_grade *grades = malloc(sizeof *grades * scans);
    code = gains && grades ? patina_cloud_balance(cloud, stations->station, scans, progress, gains) : PATINA_ERROR_MEMORY;
    for (uint32_t i = 0; i < scans && !code; i++) {
        grades[i] = (patina_scan_grade){1.0f, 1.0f, 1.0f, 0.0f};
        balanced += gains[3 * i] != 1.0f || gains[3 * i + 1] != 1.0f || gains[3 * i + 2] != 1.0f;
    }
    if (!code && balanced)
        code = patina_grade_create_balanced(cloud, stations->station, grades, gains, scans, 0, out);
    free(gains);
    free(grades);
    return code;
}

void tool_free_stations(struct tool_stations *stations)
{
    free(stations->places);
    free(stations->directions);
    free(stations->station);
    free(stations->row);
    free(stations->column);
    *stations = (struct tool_stations){0};
}
