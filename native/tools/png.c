// SPDX-License-Identifier: GPL-3.0-or-later
// Premultiplied linear float RGBA -> 8-bit sRGB PNG, row by row from the top, so that a picture need not be in memory whole. The same
// rows make the same bytes, however many are written at a time.
#include "png_errors.h"
#include "tool.h"
#include "base/elementary.h"

#include <errno.h>
#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct tool_png {
    char *path;
    struct pt_whole whole;
    png_structp state;
    png_infop info;
    uint32_t width;
    int alpha, failed;
    char why[TOOL_PNG_WHY];
    uint8_t *row;
};

// IEC 61966-2-1, from 0 to `most`; NaN and negative values are black.
static float encode_srgb(float linear, float most)
{
    if (!(linear > 0.0f))
        return 0.0f;
    if (linear >= 1.0f)
        return most;
    const float curve = linear <= 0.0031308f ? 12.92f * linear
                                             : 1.055f * (float)pt_pow((double)linear, (double)(1.0f / 2.4f)) - 0.055f;
    return curve * most + 0.5f;
}

static float encode_linear(float value, float most)
{
    if (!(value > 0.0f))
        return 0.0f;
    return value >= 1.0f ? most : value * most + 0.5f;
}

// PNG's and TIFF's alpha is not premultiplied, and colours are encoded after the division.
static float undo_alpha(const float *pixel, int alpha)
{
    return alpha && pixel[3] > 0.0f ? 1.0f / pixel[3] : alpha ? 0.0f : 1.0f;
}

void tool_encode_row(uint8_t *row, const float *pixels, uint32_t width, int alpha)
{
    for (uint32_t x = 0; x < width; x++, pixels += 4) {
        const float inverse = undo_alpha(pixels, alpha);
        for (int i = 0; i < 3; i++)
            *row++ = (uint8_t)encode_srgb(pixels[i] * inverse, 255.0f);
        if (alpha)
            *row++ = (uint8_t)encode_linear(pixels[3], 255.0f);
    }
}

void tool_encode_row16(uint16_t *row, const float *pixels, uint32_t width)
{
    for (uint32_t x = 0; x < width; x++, pixels += 4) {
        const float inverse = undo_alpha(pixels, 1);
        for (int i = 0; i < 3; i++)
            *row++ = (uint16_t)encode_srgb(pixels[i] * inverse, 65535.0f);
        *row++ = (uint16_t)encode_linear(pixels[3], 65535.0f);
    }
}

void tool_png_error(png_structp state, png_const_charp text)
{
    snprintf(png_get_error_ptr(state), TOOL_PNG_WHY, "%s", text);
    longjmp(*png_set_longjmp_fn(state, longjmp, sizeof(jmp_buf)), 1);
}

void tool_png_warning(png_structp state, png_const_charp text)
{
    (void)state;
    (void)text;
}

static int begin(struct tool_png *png, uint32_t height, const char *name, const char *text)
{
    png->state = png_create_write_struct(PNG_LIBPNG_VER_STRING, png->why, tool_png_error, tool_png_warning);
    png->info = png->state ? png_create_info_struct(png->state) : NULL;
    if (!png->info)
        return -1;
    if (setjmp(png_jmpbuf(png->state)))
        return -1;
    png_init_io(png->state, png->whole.stream);
    png_set_IHDR(png->state, png->info, png->width, height, 8, png->alpha ? PNG_COLOR_TYPE_RGB_ALPHA : PNG_COLOR_TYPE_RGB,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_BASE, PNG_FILTER_TYPE_BASE);
    png_set_sRGB(png->state, png->info, PNG_sRGB_INTENT_PERCEPTUAL);
    if (name) {
        png_text told = {.compression = PNG_TEXT_COMPRESSION_NONE, .key = (char *)name, .text = (char *)text};
        png_set_text(png->state, png->info, &told, 1);
    }
    png_write_info(png->state, png->info);
    return 0;
}

static void say_failed(const struct tool_png *png, int error)
{
    char text[128];
    tool_say("'%s' cannot be written: %s", png->path,
             error         ? pt_error_text(error, text, sizeof text)
             : png->why[0] ? png->why
                           : "out of memory");
}

static int end(struct tool_png *png, int good)
{
    const int wanted = good;
    good = good && !png->failed;
    if (png->state)
        png_destroy_write_struct(&png->state, &png->info);
    const int failed = png->whole.stream ? ferror(png->whole.stream) : 0;
    const int error = png->whole.stream ? pt_whole_end(&png->whole, good && !failed) : 0;
    if (wanted && (!good || error))
        say_failed(png, error);
    good = good && !error;
    free(png->row);
    free(png->path);
    free(png);
    return good ? 0 : -1;
}

struct tool_png *tool_png_open(const char *path, uint32_t width, uint32_t height, int alpha, const char *name, const char *text)
{
    struct tool_png *png = calloc(1, sizeof *png);
    if (!png) {
        tool_say("out of memory");
        return NULL;
    }
    png->width = width;
    png->alpha = alpha;
    png->path = malloc(strlen(path) + 1);
    png->row = malloc(4 * (size_t)width + 1);
    if (png->path)
        strcpy(png->path, path);
    int error = png->path && png->row ? pt_whole_begin(path, &png->whole) : ENOMEM;
    if (error) {
        char why[128];
        png->whole.stream = NULL;
        tool_say("'%s' cannot be written: %s", path, pt_error_text(error, why, sizeof why));
    } else if (!begin(png, height, name, text)) {
        return png;
    } else {
        say_failed(png, 0);
    }
    end(png, 0);
    return NULL;
}

int tool_png_bytes(struct tool_png *png, const uint8_t *row)
{
    if (png->failed)
        return -1;
    if (setjmp(png_jmpbuf(png->state))) {
        png->failed = 1;
        return -1;
    }
    png_write_row(png->state, row);
    return 0;
}

int tool_png_rows(struct tool_png *png, const float *pixels, uint32_t rows)
{
    int bad = 0;
    for (uint32_t y = rows; y-- > 0 && !bad;) { // our row 0 is at the bottom
        tool_encode_row(png->row, pixels + 4 * (size_t)y * png->width, png->width, png->alpha);
        bad = tool_png_bytes(png, png->row);
    }
    return bad;
}

int tool_png_close(struct tool_png *png, int good)
{
    if (good && !png->failed) {
        if (setjmp(png_jmpbuf(png->state)))
            png->failed = 1;
        else
            png_write_end(png->state, png->info);
    }
    return end(png, good);
}

int tool_write_png(const char *path, const float *pixels, uint32_t width, uint32_t height, int alpha, const char *name,
                   const char *text)
{
    struct tool_png *png = tool_png_open(path, width, height, alpha, name, text);
    return png ? tool_png_close(png, !tool_png_rows(png, pixels, height) || 1) : -1;
}
