// SPDX-License-Identifier: GPL-3.0-or-later
// patina convert IN OUT.ply: any readable file to a binary PLY with position, normal and colour; IN OUT.cloud: to a built cloud.
#include "tool.h"
#include "base/words.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char out_of_memory[] = "out of memory";

// Reads the columns that the file has into desc; the arrays are the caller's to free, on failure too.
static int read_columns(const patina_file *file, const patina_file_info *info, patina_cloud_desc *desc, void *columns[3])
{
    const size_t count = (size_t)info->count;
    int code = PATINA_OK;
    desc->count = info->count;
    for (int i = 0; i < 3; i++)
        desc->origin[i] = info->origin[i];
    if (!count)
        return PATINA_OK;

    const size_t vectors = count * 3 * sizeof(float);
    if (!(columns[0] = malloc(vectors)))
        return PATINA_ERROR_MEMORY;
    code = patina_file_read_positions(file, columns[0], vectors);
    desc->position = (patina_array){.data = columns[0], .type = PATINA_FLOAT32, .components = 3};

    if (!code && info->has_normals) {
        if (!(columns[1] = malloc(vectors)))
            return PATINA_ERROR_MEMORY;
        code = patina_file_read_normals(file, columns[1], vectors);
        desc->normal = (patina_array){.data = columns[1], .type = PATINA_FLOAT32, .components = 3};
    }
    if (!code && info->color_type == PATINA_UINT8) {
        if (!(columns[2] = malloc(count * 4)))
            return PATINA_ERROR_MEMORY;
        code = patina_file_read_colors_u8(file, columns[2], count * 4);
        desc->color = (patina_array){.data = columns[2], .type = PATINA_UINT8, .components = 4};
    } else if (!code && info->color_type) { // 8 bits would lose something
        if (!(columns[2] = malloc(count * 4 * sizeof(float))))
            return PATINA_ERROR_MEMORY;
        code = patina_file_read_colors_f32(file, columns[2], count * 4 * sizeof(float));
        desc->color = (patina_array){.data = columns[2], .type = PATINA_FLOAT32, .components = 4};
    }
    return code;
}

static int parse_options(int count, char **arguments, struct tool_build *build)
{
    for (int i = 0; i < count; i += 2) {
        const char *name = arguments[i], *value = i + 1 < count ? arguments[i + 1] : NULL;
        if (strcmp(name, "--attribute") != 0 && strcmp(name, "--memory") != 0 && strcmp(name, "--analysis") != 0 &&
            strcmp(name, "--pack") != 0 && strcmp(name, "--order") != 0)
            return tool_misuse("convert: there is no option '%s'", name);
        if (!value)
            return tool_misuse("%s: a value, please", name);
        int bad = 0;
        if (!strcmp(name, "--attribute")) {
            build->attribute = value;
        } else if (!strcmp(name, "--memory")) {
            bad = tool_parse_memory(value, &build->memory);
        } else if (!strcmp(name, "--pack")) {
            build->pack = !strcmp(value, "on");
            bad = !build->pack && strcmp(value, "off") != 0;
        } else if (!strcmp(name, "--order")) {
            build->drop_order = !strcmp(value, "drop");
            bad = !build->drop_order && strcmp(value, "keep") != 0;
        } else {
            build->unanalysed = !strcmp(value, "off");
            bad = !build->unanalysed && strcmp(value, "on") != 0;
        }
        if (bad)
            return tool_misuse("%s: '%s' is no value of it", name, value);
    }
    return TOOL_OK;
}

int tool_convert(int count, char **arguments)
{
    struct tool_build build = {0};
    if (count < 2)
        return tool_misuse("convert: a file to read and a file to write, please");
    build.in = arguments[0];
    build.out = arguments[1];
    const int misused = parse_options(count - 2, arguments + 2, &build);
    if (misused)
        return misused;
    if (pt_ends_in(build.out, ".cloud"))
        return tool_convert_to_cloud(&build);
    if (count > 2)
        return tool_misuse("%s goes into a .cloud", arguments[2]);
    patina_progress *progress = NULL;
    patina_file *file = NULL;
    void *columns[3] = {NULL, NULL, NULL};
    int result = TOOL_FAILED;
    int code = patina_progress_create(&progress);
    tool_cancellable(progress, NULL);
    if (!code)
        code = patina_file_open(arguments[0], progress, &file);
    tool_cancellable(NULL, NULL); // from here on Ctrl-C just ends the program
    patina_file_info info = {.struct_size = sizeof info};
    if (!code)
        code = patina_file_get_info(file, &info);
    if (code) {
        result = tool_failed(arguments[0], NULL, code);
        goto done;
    }
    patina_cloud_desc desc = {.struct_size = sizeof desc};
    code = read_columns(file, &info, &desc, columns);
    if (code == PATINA_ERROR_MEMORY) {
        tool_say("%s", out_of_memory);
        goto done;
    }
    if (code) {
        result = tool_failed(arguments[0], file, code);
        goto done;
    }
    code = patina_write_ply(arguments[1], &desc);
    if (code) {
        result = tool_failed(arguments[1], NULL, code);
        goto done;
    }
    if (info.attributes)
        tool_say("note: %u further attributes of '%s' were left out", info.attributes, arguments[0]);
    result = TOOL_OK;
done:
    tool_drain_log(1);
    for (int i = 0; i < 3; i++)
        free(columns[i]);
    patina_file_destroy(file);
    patina_progress_destroy(progress);
    return result;
}
