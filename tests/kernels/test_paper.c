// SPDX-License-Identifier: GPL-3.0-or-later
// paper: tints and grains, places of crops in the picture, transparent pixels.
#include "harness.h"
#include "shared/picture.h"

#include <math.h>

static void check(struct harness *h, uint32_t width, uint32_t height, uint32_t x, uint32_t y, float grain)
{
    struct paper_args args = {.view = picture_view(width, height, 1),
                              .crop_width = width,
                              .crop_height = height,
                              .x = x,
                              .y = y,
                              .color = {0.97f, 0.9f, 0.0f},
                              .grain = grain};
    size_t count = (size_t)width * height;
    struct rng rng = {width + x};
    float *before = harness_alloc(h, count * 16);
    for (size_t i = 0; i < 4 * count; i++)
        before[i] = rng_below(&rng, 5) ? (float)rng_range(&rng, 0.0, 4.0) : 0.0f;
    struct pt_buffer *combined = harness_buffer(h, before, count * 16);
    HARNESS_RUN(h, paper, &args, combined);
    const float *got = harness_read(h, combined);
    for (size_t i = 0; i < count; i++) {
        struct ref_color expected = ref_paper(&args, before, (int)(i % width), (int)(i / width));
        for (int c = 0; c < 4; c++)
            if (!harness_near(got[4 * i + (size_t)c], expected.color[c], expected.error[c]))
                harness_fail(h, "combined", (int)(i % width), (int)(i / width), "channel %d: got %.9g, expected %.9g +- %.2g",
                             c, got[4 * i + (size_t)c], expected.color[c], expected.error[c]);
    }
}

static void places(struct harness *h)
{
    check(h, 67, 45, 0, 0, 0.3f);
    check(h, 67, 45, 13, 5, 0.0f);
    check(h, 1, 1, 65535, 65535, 1.0f);
    check(h, 16384, 1, 3, 7, 0.5f);
    check(h, 1, 70, 1, 1, 0.1f);
}

// Reference alone: the mean of the grain is a half, and a crop is a crop.
static void sanity(struct harness *h)
{
    struct paper_args args = {.crop_width = 256, .crop_height = 256, .color = {1, 1, 1}, .grain = 1.0f};
    struct paper_args crop = {.crop_width = 3, .crop_height = 3, .x = 100, .y = 50, .color = {1, 1, 1}, .grain = 1.0f};
    float *white = harness_alloc(h, 256 * 256 * 16);
    double sum = 0.0;
    for (size_t i = 0; i < 256 * 256 * 4; i++)
        white[i] = 1.0f;
    for (int i = 0; i < 256 * 256; i++)
        sum += ref_paper(&args, white, i % 256, i / 256).color[1];
    HARNESS_CHECK(h, fabs(sum / (256 * 256) - 0.5) < 0.01);
    HARNESS_CHECK(h, ref_paper(&args, white, 102, 51).color[0] == ref_paper(&crop, white, 2, 1).color[0]);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {{"sanity", sanity, 1}, {"places", places, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
