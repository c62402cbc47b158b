// SPDX-License-Identifier: GPL-3.0-or-later
// Outlines of `patina draw`: lines of the distances of its image.
#include "draw.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_PIXELS = 1 << 28 }; // of which all distances are held: 1.25 GiB, and 2.25 more while lines are traced

int draw_begin_depths(const struct draw_image *image, struct draw_depths *depths)
{
    const size_t pixels = (size_t)image->width * image->height;
    if (pixels > MOST_PIXELS) {
        tool_say(
            "draw: --outlines would need %u x %u pixels, and at most %d are possible: make --pixel larger, or --extent smaller",
            image->width, image->height, MOST_PIXELS);
        return TOOL_FAILED;
    }
    *depths = (struct draw_depths){malloc(pixels * sizeof *depths->depth), malloc(pixels), image->width, image->height};
    return depths->depth && depths->measured ? TOOL_OK : tool_failed("draw", NULL, PATINA_ERROR_MEMORY);
}

void draw_take_depths(struct draw_depths *depths, const float *depth, const float *source, uint32_t rows)
{
    const size_t count = rows * depths->width;
    depths->rows -= rows;
    memcpy(depths->depth + depths->rows * depths->width, depth, count * sizeof *depth);
    for (size_t i = 0; i < count; i++) {
        const float s = fabsf(source[i]);
        depths->measured[depths->rows * depths->width + i] = s > 0.0f && s <= 1.0f;
    }
}

void draw_free_depths(struct draw_depths *depths)
{
    free(depths->depth);
    free(depths->measured);
}

// The spacing is that of the coarsest cloud.
int draw_outlines(const struct draw_image *image, const struct draw_depths *depths, patina_drawing *drawing)
{
    patina_outline_desc desc = {.struct_size = sizeof desc,
                                .depth = depths->depth,
                                .measured = depths->measured,
                                .width = image->width,
                                .height = image->height,
                                .pixel = image->pixel};
    int code = PATINA_OK;
    for (int i = 0; i < image->options->file_count && !code; i++) {
        patina_cloud_info info = {.struct_size = sizeof info};
        code = patina_cloud_get_info(image->clouds[i], &info);
        desc.spacing = fmax(desc.spacing, info.spacing);
    }
    desc.spacing = fmax(desc.spacing, 1e-9); // of a single point
    if (!code)
        code = patina_drawing_outline(drawing, &desc);
    return code ? tool_failed("draw", drawing, code) : TOOL_OK;
}
