// SPDX-License-Identifier: GPL-3.0-or-later
// libFuzzer target: any bytes as a PLY file; what opens is read in full, column by column.
#include "patina/patina.h"

#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void require(int condition)
{
    if (!condition)
        abort();
}

static void read_columns(const patina_file *file, const patina_file_info *info)
{
    size_t count = (size_t)info->count;
    float *floats = malloc((count ? count : 1) * 4 * sizeof *floats);
    require(floats != NULL);
    require(patina_file_read_positions(file, floats, count * 3 * sizeof *floats) == PATINA_OK);
    require((patina_file_read_normals(file, floats, count * 3 * sizeof *floats) == PATINA_OK) ==
            (info->has_normals != 0));
    int code = patina_file_read_colors_f32(file, floats, count * 4 * sizeof *floats);
    require((code == PATINA_OK) == (info->color_type != PATINA_NONE));
    require(patina_file_read_colors_u8(file, (uint8_t *)floats, count * 4) == code);
    for (uint32_t i = 0; i < info->attributes; i++) {
        patina_file_attribute attribute = { .struct_size = sizeof attribute };
        require(patina_file_get_attribute(file, i, &attribute) == PATINA_OK);
        require(patina_file_read_attribute(file, i, floats, count * sizeof *floats) == PATINA_OK);
    }
    free(floats);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    patina_file *file = NULL;
    char message[512];
    if (patina_file_open_memory(data, size, &file) != PATINA_OK) {
        require(!file && patina_message(NULL, message, sizeof message) > 0);
        return 0;
    }
    patina_file_info info = { .struct_size = sizeof info };
    require(patina_file_get_info(file, &info) == PATINA_OK);
    require(info.count <= size && info.invalid_positions <= info.count); // a point takes three bytes at least
    read_columns(file, &info);
    patina_file_destroy(file);
    return 0;
}
