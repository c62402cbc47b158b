// SPDX-License-Identifier: GPL-3.0-or-later
// SVG 1.1 of a page: a user unit is a millimeter, layers are groups, and the image is a PNG inside.
#include "page.h"

#include <string.h>
#include <zlib.h>

// ---- the image in base64 -----------------------------------------------------------------------------------------

struct base64 {
    FILE *file;
    uint32_t held; // bytes that are not written yet
    int count;
};

static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

static void put(struct base64 *to, const void *bytes, size_t size)
{
    for (const uint8_t *at = bytes; size--; at++) {
        to->held = to->held << 8 | *at;
        if (++to->count < 3)
            continue;
        for (int shift = 18; shift >= 0; shift -= 6)
            putc(digits[to->held >> shift & 63], to->file);
        to->held = 0;
        to->count = 0;
    }
}

static void finish(struct base64 *to)
{
    const int missing = to->count ? 3 - to->count : 0;
    if (!missing)
        return;
    put(to, (const uint8_t[2]){0}, (size_t)missing - 1);
    const uint32_t held = to->held << 8;
    for (int i = 0; i < 4 - missing; i++)
        putc(digits[held >> (18 - 6 * i) & 63], to->file);
    fputs(missing == 2 ? "==" : "=", to->file);
}

static void put_number(struct base64 *to, uint32_t number)
{
    put(to, (const uint8_t[4]){(uint8_t)(number >> 24), (uint8_t)(number >> 16), (uint8_t)(number >> 8), (uint8_t)number}, 4);
}

static void put_chunk(struct base64 *to, const char kind[4], const uint8_t *bytes, size_t size)
{
    put_number(to, (uint32_t)size);
    put(to, kind, 4);
    put(to, bytes, size);
    put_number(to, (uint32_t)crc32(crc32(0, (const uint8_t *)kind, 4), size ? bytes : (const uint8_t *)"", (uInt)size));
}

static void write_png(const struct tool_picture *picture, FILE *file)
{
    enum { PART = 1 << 30 }; // a chunk has less than 2 GiB
    const uint32_t w = picture->width, h = picture->height;
    const uint8_t head[13] = {(uint8_t)(w >> 24), (uint8_t)(w >> 16), (uint8_t)(w >> 8), (uint8_t)w, (uint8_t)(h >> 24),
                              (uint8_t)(h >> 16), (uint8_t)(h >> 8),  (uint8_t)h,        8,          2}; // 8 bits, RGB
    struct base64 to = {.file = file};
    put(&to, "\x89PNG\r\n\x1a\n", 8);
    put_chunk(&to, "IHDR", head, sizeof head);
    put_chunk(&to, "sRGB", (const uint8_t[1]){0}, 1);
    for (size_t at = 0; at < picture->size; at += PART)
        put_chunk(&to, "IDAT", picture->packed + at, picture->size - at < PART ? picture->size - at : PART);
    put_chunk(&to, "IEND", NULL, 0);
    finish(&to);
}

// ---- the page ----------------------------------------------------------------------------------------------------

static void write_text(const char *text, FILE *file)
{
    for (; text && *text; text++)
        if (*text == '<')
            fputs("&lt;", file);
        else if (*text == '&')
            fputs("&amp;", file);
        else
            putc((unsigned char)*text < 32 ? ' ' : *text, file);
}

static void write_shape(const struct page *page, const struct page_shape *shape, FILE *file)
{
    fputs("<path", file);
    if (shape->filled)
        fputs(" fill=\"#000000\" stroke=\"none\"", file);
    else if (shape->width != page_layers[shape->layer].weight)
        fprintf(file, " stroke-width=\"%.4g\"", shape->width);
    fputs(" d=\"", file);
    for (uint32_t i = 0; i < shape->count; i++) {
        const double *point = page->points[shape->first + i];
        fprintf(file, "%s%.4f,%.4f", i ? " L" : "M", point[0], page->size[1] - point[1]);
    }
    fprintf(file, "%s\"/>\n", shape->closed ? " Z" : "");
}

static void begin_layer(const char *name, FILE *file)
{
    fprintf(file, "<g id=\"%s\" inkscape:groupmode=\"layer\" inkscape:label=\"%s\"", name, name);
}

int page_write_svg(const struct page *page, FILE *file)
{
    fprintf(file,
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" "
            "xmlns:xlink=\"http://www.w3.org/1999/xlink\" xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" "
            "version=\"1.1\" width=\"%.10gmm\" height=\"%.10gmm\" viewBox=\"0 0 %.10g %.10g\">\n<title>",
            page->size[0], page->size[1], page->size[0], page->size[1]);
    write_text(page->title, file);
    fprintf(file, "</title>\n<desc>Scale 1:%.10g. Written by Patina %s.</desc>\n", page->scale, patina_version());
    begin_layer("image", file);
    fputs(">\n", file);
    if (page->picture) {
        fprintf(file,
                "<image x=\"%.6f\" y=\"%.6f\" width=\"%.6f\" height=\"%.6f\" preserveAspectRatio=\"none\" "
                "xlink:href=\"data:image/png;base64,",
                page->image[0], page->size[1] - page->image[1] - page->image[3], page->image[2], page->image[3]);
        write_png(page->picture, file);
        fputs("\"/>\n", file);
    }
    fputs("</g>\n", file);
    for (uint32_t layer = 0; layer < PAGE_IMAGE; layer++) {
        begin_layer(page_layers[layer].name, file);
        fprintf(file,
                " fill=\"none\" stroke=\"#000000\" stroke-width=\"%g\" stroke-linecap=\"round\" stroke-linejoin=\"round\"%s>\n",
                page_layers[layer].weight, page_layers[layer].dashed ? " stroke-dasharray=\"2 1\"" : "");
        for (size_t i = 0; i < page->shape_count; i++)
            if (page->shapes[i].layer == layer)
                write_shape(page, &page->shapes[i], file);
        fputs("</g>\n", file);
    }
    fputs("</svg>\n", file);
    return 0;
}
