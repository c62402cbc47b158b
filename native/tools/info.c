// SPDX-License-Identifier: GPL-3.0-or-later
// patina info FILE
#include "tool.h"

#include <stdio.h>

static const char *type_name(uint32_t type)
{
    static const char *const names[] = {"none", "float32", "float64", "uint8", "uint16", "uint32", "int8", "int16", "int32"};
    return type < sizeof names / sizeof *names ? names[type] : "?";
}

static void print_file(const patina_file_info *info)
{
    tool_print("format      %s", info->format);
    printf("\n");
    printf("points      %llu\n", (unsigned long long)info->count);
    printf("positions   %s\n", type_name(info->position_type));
    if (info->invalid_positions)
        printf("  not finite %llu\n", (unsigned long long)info->invalid_positions);
    if (info->origin[0] != 0 || info->origin[1] != 0 || info->origin[2] != 0)
        printf("origin      %.17g %.17g %.17g\n", info->origin[0], info->origin[1], info->origin[2]);
    if (info->box_min[0] <= info->box_max[0]) {
        printf("box         %.9g %.9g %.9g\n", info->box_min[0], info->box_min[1], info->box_min[2]);
        printf("            %.9g %.9g %.9g\n", info->box_max[0], info->box_max[1], info->box_max[2]);
        printf("size        %.6g %.6g %.6g\n", info->box_max[0] - info->box_min[0], info->box_max[1] - info->box_min[1],
               info->box_max[2] - info->box_min[2]);
    }
    printf("normals     %s\n", info->has_normals ? "yes" : "no");
    printf("colours     %s\n", info->color_type ? type_name(info->color_type) : "no");
    if (info->stations)
        printf("stations    %u\n", info->stations);
}

static void print_attributes(const patina_file *file, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        patina_file_attribute attribute = {.struct_size = sizeof attribute};
        if (patina_file_get_attribute(file, i, &attribute))
            continue;
        tool_print("attribute   %s (%s)", attribute.name, type_name(attribute.type));
        printf("\n");
    }
}

static void print_scans(const patina_file *file, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        patina_file_scan scan = {.struct_size = sizeof scan};
        if (patina_file_get_scan(file, i, &scan))
            continue;
        tool_print("scan %-6u %s%s%llu points", i, scan.name, scan.name[0] ? ", " : "", (unsigned long long)scan.count);
        if (scan.columns)
            printf(", grid %u x %u", scan.columns, scan.rows);
        if (scan.interval > 0)
            printf(", interval %.4g", scan.interval);
        if (scan.has_station)
            printf(", from %.9g %.9g %.9g", scan.station[0], scan.station[1], scan.station[2]);
        if (scan.direction[0] != 0 || scan.direction[1] != 0 || scan.direction[2] != 0)
            printf(", looking %.3f %.3f %.3f", scan.direction[0], scan.direction[1], scan.direction[2]);
        printf("\n");
    }
}

static void print_cloud(const patina_cloud_info *info)
{
    printf("spacing     %.4g (%.4g to %.4g)\n", info->spacing, info->spacing_min, info->spacing_max);
    if (info->invalid_normals)
        printf("  no normal  %llu\n", (unsigned long long)info->invalid_normals);
    if (info->invalid_colors)
        printf("  no colour  %llu\n", (unsigned long long)info->invalid_colors);
    printf("chunks      %llu\n", (unsigned long long)info->chunks);
    printf("memory      %.1f MB", (double)info->bytes / 1e6);
    if (info->drawn)
        printf(", %.1f bytes a point", (double)info->bytes / (double)info->drawn);
    printf("\n");
}

static int info_of_saved(const char *path)
{
    patina_cloud_info info = {.struct_size = sizeof info};
    patina_cloud *cloud = NULL;
    int code = patina_cloud_open(path, &cloud);
    if (!code)
        code = patina_cloud_get_info(cloud, &info);
    if (code) {
        const int result = tool_failed(path, cloud, code);
        patina_cloud_destroy(cloud);
        return result;
    }
    printf("format      saved cloud\n");
    printf("points      %llu%s\n", (unsigned long long)info.count, info.numbered ? ", numbered as they lie" : "");
    if (info.packed)
        printf("positions   packed, which moved them by %.3g at most\n", info.packed_error);
    else
        printf("positions   float32 a chunk\n");
    if (info.box_min[0] <= info.box_max[0]) {
        printf("box         %.9g %.9g %.9g\n", info.box_min[0], info.box_min[1], info.box_min[2]);
        printf("            %.9g %.9g %.9g\n", info.box_max[0], info.box_max[1], info.box_max[2]);
    }
    printf("normals     %s\n", info.has_normals ? "yes" : "no");
    printf("colours     %s\n", info.has_colors ? "yes" : "no");
    printf("analysed    %s\n", info.has_shapes ? "yes" : "no");
    if (info.uncolored)
        printf("uncoloured  %llu points have the colour of their neighbours\n", (unsigned long long)info.uncolored);
    print_cloud(&info);
    patina_cloud_destroy(cloud);
    return TOOL_OK;
}

int tool_info(int count, char **arguments)
{
    if (count != 1)
        return tool_misuse("info: one file, please");
    if (tool_begins(arguments[0], "patina\n\x1a", 8))
        return info_of_saved(arguments[0]);
    patina_progress *progress = NULL;
    patina_file *file = NULL;
    patina_cloud *cloud = NULL;
    int result = TOOL_FAILED;
    int code = patina_progress_create(&progress);
    tool_cancellable(progress, NULL);
    if (!code)
        code = patina_file_open(arguments[0], progress, &file);
    if (code) {
        result = tool_failed(arguments[0], NULL, code);
        goto done;
    }
    patina_file_info info = {.struct_size = sizeof info};
    code = patina_file_get_info(file, &info);
    if (code) {
        result = tool_failed(arguments[0], file, code);
        goto done;
    }
    print_file(&info);
    print_attributes(file, info.attributes);
    print_scans(file, info.scans);
    fflush(stdout);
    code = patina_file_cloud(file, 0, progress, &cloud);
    patina_cloud_info built = {.struct_size = sizeof built};
    if (!code)
        code = patina_cloud_get_info(cloud, &built);
    if (code) {
        result = tool_failed(arguments[0], NULL, code);
        goto done;
    }
    print_cloud(&built);
    result = TOOL_OK;
done:
    tool_cancellable(NULL, NULL);
    tool_drain_log(1);
    patina_cloud_destroy(cloud);
    patina_file_destroy(file);
    patina_progress_destroy(progress);
    return result;
}
