// SPDX-License-Identifier: GPL-3.0-or-later
// Premultiplied linear float RGBA -> 8-bit sRGB PNG.
#include "tool.h"
#include "base/elementary.h"

#include <errno.h>
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// IEC 61966-2-1; NaN and negative values are black.
static uint8_t encode_srgb(float linear)
{
    if (!(linear > 0.0f))
        return 0;
    if (linear >= 1.0f)
        return 255;
    const float curve = linear <= 0.0031308f ? 12.92f * linear
                                             : 1.055f * (float)pt_pow((double)linear, (double)(1.0f / 2.4f)) - 0.055f;
    return (uint8_t)(curve * 255.0f + 0.5f);
}

static uint8_t encode_linear(float value)
{
    if (!(value > 0.0f))
        return 0;
    return value >= 1.0f ? 255 : (uint8_t)(value * 255.0f + 0.5f);
}

// One row. PNG's alpha is not premultiplied, and its colours are encoded after the division.
static void encode_row(uint8_t *row, const float *pixels, uint32_t width, int alpha)
{
    for (uint32_t x = 0; x < width; x++, pixels += 4) {
        const float inverse = alpha && pixels[3] > 0.0f ? 1.0f / pixels[3] : alpha ? 0.0f : 1.0f;
        for (int i = 0; i < 3; i++)
            *row++ = encode_srgb(pixels[i] * inverse);
        if (alpha)
            *row++ = encode_linear(pixels[3]);
    }
}

int tool_write_png(const char *path, const float *pixels, uint32_t width, uint32_t height, int alpha)
{
    const size_t stride = (size_t)width * (alpha ? 4 : 3);
    uint8_t *bytes = malloc(stride * height);
    if (!bytes) {
        tool_say("out of memory");
        return -1;
    }
    for (uint32_t y = 0; y < height; y++) // our row 0 is at the bottom, PNG's at the top
        encode_row(bytes + stride * (height - 1 - y), pixels + (size_t)y * width * 4, width, alpha);
    png_image image = {.version = PNG_IMAGE_VERSION, .width = width, .height = height};
    image.format = alpha ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
    errno = 0;
    FILE *file = pt_stream_open(path, "wb");
    int good = file && png_image_write_to_stdio(&image, file, 0, bytes, 0, NULL), error = errno;
    if (file && fclose(file) && good) {
        error = errno;
        good = 0;
    }
    if (!good) {
        char text[128];
        tool_say("'%s' cannot be written: %s", path, error ? pt_error_text(error, text, sizeof text) : image.message);
        if (file)
            pt_file_remove(path);
    }
    free(bytes);
    return good ? 0 : -1;
}
