// SPDX-License-Identifier: GPL-3.0-or-later
// Takes an image in, and makes the coarser levels that it is drawn from where it is small on screen.
#include "texture.h"
#include "base/color.h"
#include "base/descriptor.h"

#include "scene/clouds/fingerprint.h"
#include "shared/colors.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_TEXELS = 1 << (PT_TEXTURE_LEVELS - 1) }; // on a side

static int fail(const char *what) { return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_texture_create: %s", what); }

// Linear values of an sRGB byte, and halfway to the next.
struct curve {
    float value[256], until[255];
};

static void fill_curve(struct curve *curve)
{
    for (int i = 0; i < 256; i++)
        curve->value[i] = (float)pt_linear_of_srgb(i / 255.0);
    for (int i = 0; i < 255; i++)
        curve->until[i] = (float)pt_linear_of_srgb((i + 0.5) / 255.0);
}

static uint32_t byte_of(float value) { return (uint32_t)(value * 255.0f + 0.5f); } // within 0..1

static uint32_t srgb_of(const struct curve *curve, float value)
{
    uint32_t low = 0, high = 255;
    while (low < high) { // the first whose end is beyond the value
        const uint32_t middle = (low + high) / 2;
        if (value < curve->until[middle])
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

static void read_texel(const struct patina_texture *texture, const struct curve *curve, size_t index, float c[4])
{
    if (texture->format == PT_TEXELS_FLOAT) {
        memcpy(c, texture->texels + 4 * index, 4 * sizeof *c);
        return;
    }
    for (uint32_t k = 0; k < 4; k++) {
        const uint32_t byte = texture->texels[index] >> 8 * k & 255u;
        c[k] = k < 3 && texture->format == PT_TEXELS_SRGB ? curve->value[byte] : (float)byte / 255.0f;
    }
}

static void write_texel(struct patina_texture *texture, const struct curve *curve, size_t index, const float c[4])
{
    if (texture->format == PT_TEXELS_FLOAT) {
        memcpy(texture->texels + 4 * index, c, 4 * sizeof *c);
        return;
    }
    texture->texels[index] = 0;
    for (uint32_t k = 0; k < 4; k++) {
        const float value = fminf(fmaxf(c[k], 0.0f), 1.0f);
        texture->texels[index] |= (k < 3 && texture->format == PT_TEXELS_SRGB ? srgb_of(curve, value) : byte_of(value))
                                  << 8 * k;
    }
}

// ---- the caller's image ------------------------------------------------------------------------------------------------

static float finite_or(float value, float other)
{
    return isfinite(value) ? fminf(fmaxf(value, -PT_BRIGHTEST), PT_BRIGHTEST) : other;
}

static void take_bytes(const patina_texture_desc *desc, struct patina_texture *texture, const uint8_t *from, size_t index)
{
    const uint32_t opacity = desc->pixels.components > 3 ? from[3] : 255;
    texture->texels[index] = from[0] | (uint32_t)from[1] << 8 | (uint32_t)from[2] << 16 | opacity << 24;
    texture->opaque &= opacity == 255;
}

static void take_floats(const patina_texture_desc *desc, struct patina_texture *texture, const uint8_t *from, size_t index)
{
    float c[4] = {0, 0, 0, 1};
    for (uint32_t k = 0; k < 4 && k < desc->pixels.components; k++) {
        uint16_t word;
        if (desc->pixels.type == PATINA_FLOAT32) {
            memcpy(&c[k], from + 4 * k, 4);
            c[k] = finite_or(c[k], k < 3 ? 0.0f : 1.0f);
            continue;
        }
        memcpy(&word, from + 2 * k, 2);
        c[k] = (float)(k < 3 && !desc->raw ? pt_linear_of_srgb(word / 65535.0) : word / 65535.0);
    }
    c[3] = fminf(fmaxf(c[3], 0.0f), 1.0f);
    texture->opaque &= c[3] == 1.0f;
    memcpy(texture->texels + 4 * index, c, sizeof c);
}

static void take_pixels(const patina_texture_desc *desc, struct patina_texture *texture)
{
    const size_t count = (size_t)desc->width * desc->height;
    texture->opaque = desc->wrap != PATINA_WRAP_CLIP;
    for (size_t i = 0; i < count; i++) {
        const uint8_t *from = (const uint8_t *)desc->pixels.data + i * desc->pixels.stride;
        if (desc->pixels.type == PATINA_UINT8)
            take_bytes(desc, texture, from, i);
        else
            take_floats(desc, texture, from, i);
    }
}

// ---- coarser levels ----------------------------------------------------------------------------------------------------

// Which of `fine` texels the i-th of `coarse` ones covers, at most four, and how much of each; returns how many.
static uint32_t covered(uint32_t i, uint32_t fine, uint32_t coarse, uint32_t *first, float share[4])
{
    const double begin = (double)i * fine / coarse, end = (double)(i + 1) * fine / coarse;
    uint32_t count = 0;
    *first = (uint32_t)begin;
    for (uint32_t k = *first; k < fine && k < end - 1e-9 && count < 4; k++)
        share[count++] = (float)((fmin(end, k + 1.0) - fmax(begin, k)) / (end - begin));
    return count;
}

// The mean of the level before, colours by their opacity.
static void make_texel(struct patina_texture *texture, const struct curve *curve, const uint32_t *fine, const uint32_t *coarse,
                       uint32_t x, uint32_t y)
{
    float across[4], up[4], c[4], sum[4] = {0, 0, 0, 0}, plain[3] = {0, 0, 0};
    uint32_t left, below;
    const uint32_t columns = covered(x, fine[0], coarse[0], &left, across), rows = covered(y, fine[1], coarse[1], &below, up);
    for (uint32_t j = 0; j < rows; j++)
        for (uint32_t i = 0; i < columns; i++) {
            const float share = across[i] * up[j];
            read_texel(texture, curve, fine[2] + (size_t)(below + j) * fine[0] + left + i, c);
            for (int k = 0; k < 3; k++) {
                sum[k] += share * c[3] * c[k];
                plain[k] += share * c[k];
            }
            sum[3] += share * c[3];
        }
    for (int k = 0; k < 3; k++)
        c[k] = sum[3] > 1e-6f ? sum[k] / sum[3] : plain[k];
    c[3] = fminf(sum[3], 1.0f);
    write_texel(texture, curve, coarse[2] + (size_t)y * coarse[0] + x, c);
}

static void make_levels(struct patina_texture *texture)
{
    struct curve curve;
    fill_curve(&curve);
    for (uint32_t level = 1; level < texture->levels; level++) {
        const uint32_t *fine = texture->sizes + 3 * (level - 1), *coarse = fine + 3;
        for (uint32_t y = 0; y < coarse[1]; y++)
            for (uint32_t x = 0; x < coarse[0]; x++)
                make_texel(texture, &curve, fine, coarse, x, y);
    }
}

// Sizes of the levels; returns how many texels they have.
static size_t lay_out(struct patina_texture *texture, uint32_t width, uint32_t height)
{
    size_t count = 0;
    for (;;) {
        uint32_t *size = texture->sizes + 3 * texture->levels++;
        size[0] = width;
        size[1] = height;
        size[2] = (uint32_t)count;
        count += (size_t)width * height;
        if (width == 1 && height == 1)
            return count;
        width = width > 1 ? width / 2 : 1;
        height = height > 1 ? height / 2 : 1;
    }
}

// ---- handles -----------------------------------------------------------------------------------------------------------

static int check_desc(patina_texture_desc *desc)
{
    const uint32_t types = 1u << PATINA_UINT8 | 1u << PATINA_UINT16 | 1u << PATINA_FLOAT32;
    if (!desc->width || !desc->height || desc->width > MOST_TEXELS || desc->height > MOST_TEXELS)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_texture_create: %u x %u texels; 1 to %d a side are possible",
                       desc->width, desc->height, MOST_TEXELS);
    if (!desc->pixels.data)
        return fail("pixels has no data");
    if (desc->raw > 1 || desc->nearest > 1 || desc->wrap > PATINA_WRAP_CLIP)
        return fail("raw and nearest are 0 or 1, wrap is a patina_wrap");
    return pt_check_array(&desc->pixels, "pixels", types, 3, 4);
}

static int build(const patina_texture_desc *desc, struct patina_texture *texture)
{
    const int floats = desc->pixels.type != PATINA_UINT8;
    texture->format = floats ? PT_TEXELS_FLOAT : desc->raw ? PT_TEXELS_LINEAR : PT_TEXELS_SRGB;
    texture->nearest = desc->nearest;
    texture->wrap = desc->wrap; // the same numbers
    texture->bytes = lay_out(texture, desc->width, desc->height) * (floats ? 16 : 4);
    texture->alive = calloc(1, sizeof *texture->alive);
    texture->texels = malloc(texture->bytes);
    if (!texture->alive || !texture->texels)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "a texture of %u x %u texels: out of memory", desc->width, desc->height);
    take_pixels(desc, texture);
    make_levels(texture);
    atomic_init(&texture->alive->references, 1);
    atomic_init(&texture->alive->alive, 1);
    const uint32_t how[] = {texture->format, texture->nearest, texture->wrap};
    const uint64_t words = pt_fingerprint(pt_fingerprint(0, how, sizeof how), texture->sizes, sizeof texture->sizes);
    atomic_init(&texture->alive->fingerprint, pt_fingerprint(words, texture->texels, texture->bytes));
    return PATINA_OK;
}

int patina_texture_create(const patina_texture_desc *desc, patina_texture **out)
{
    patina_texture_desc checked;
    if (!desc || !out)
        return fail("desc or out is NULL");
    *out = NULL;
    int error = pt_take(NULL, "patina_texture_create", desc, &checked, sizeof checked);
    error = error ? error : check_desc(&checked);
    if (error)
        return error;
    struct patina_texture *texture = calloc(1, sizeof *texture);
    error = texture ? build(&checked, texture) : pt_fail(NULL, PATINA_ERROR_MEMORY, "a texture: out of memory");
    if (error) {
        if (texture) {
            free(texture->alive); // nobody else knows it
            free(texture->texels);
        }
        free(texture);
        return error;
    }
    pt_handle_init(&texture->handle);
    *out = texture;
    return PATINA_OK;
}

void patina_texture_destroy(patina_texture *texture)
{
    if (!texture)
        return;
    pt_handle_destroy(&texture->handle);
    pt_alive_end(texture->alive);
    free(texture->texels);
    free(texture);
}
