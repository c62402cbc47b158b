// SPDX-License-Identifier: GPL-3.0-or-later
// A drawing on a page: its lines over its image.
#include "draw.h"

#include <stdlib.h>

// A drawing's lines on the page.
static int add_lines(const patina_drawing *drawing, const struct draw_layout *layout, struct page *page)
{
    const double mm = 1000 / page->scale;
    patina_drawing_info info = {.struct_size = sizeof info};
    int code = patina_drawing_get_info(drawing, &info);
    for (uint32_t i = 0; i < info.lines && !code; i++) {
        patina_drawing_line line = {.struct_size = sizeof line};
        code = patina_drawing_get_line(drawing, i, &line);
        const size_t size = 2 * sizeof(double) * line.vertices;
        double *places = code ? NULL : malloc(size);
        if (!code)
            code = places ? patina_drawing_read_line(drawing, i, places, size) : PATINA_ERROR_MEMORY;
        if (!code)
            page_shape(page, line.layer, 0, line.closed != 0, 0);
        for (uint32_t k = 0; k < line.vertices && !code; k++)
            page_point(page, layout->middle[0] + mm * places[2 * k], layout->middle[1] + mm * places[2 * k + 1]);
        free(places);
    }
    return code ? tool_failed("draw", drawing, code) : TOOL_OK;
}

int draw_make_page(const struct draw_content *content, struct page *page)
{
    const struct draw_image *image = content->image;
    const struct draw_layout *layout = content->layout;
    const struct draw_options *options = image->options;
    const double mm = 1000 / options->scale, size[2] = {mm * image->pixel * image->width, mm * image->pixel * image->height};
    patina_drawing_info info = {.struct_size = sizeof info};
    *page = (struct page){.scale = options->scale,
                          .title = options->titles[DRAW_TITLE] ? options->titles[DRAW_TITLE] : "",
                          .picture = content->picture};
    for (int k = 0; k < 2; k++) {
        page->size[k] = layout->size[k];
        page->image[k] = layout->middle[k] - 0.5 * size[k];
        page->image[2 + k] = size[k];
        page->drawn[k] = layout->middle[k] - 0.5 * mm * image->desc->extent[k];
        page->drawn[2 + k] = layout->middle[k] + 0.5 * mm * image->desc->extent[k];
    }
    patina_drawing_get_info(content->drawing, &info);
    const struct draw_statement statement = {
        .spacing = info.samples ? info.spacing : content->spacing, .sigma = info.sigma, .filled = draw_filled(image)};
    const int result = add_lines(content->drawing, layout, page);
    if (!result && layout->sheet)
        draw_furnish(image, layout, &statement, page);
    return result;
}
