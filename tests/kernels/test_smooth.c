// SPDX-License-Identifier: GPL-3.0-or-later
// smooth: the four filters, on pictures with measured and filled pixels.
#include "harness.h"
#include "shared/colors.h"

#include <math.h>
#include <string.h>

static int translucent(const struct picture *picture)
{
    for (size_t i = 0; i < picture->count; i++)
        if (picture->keys[i] != REF_EMPTY_KEY && picture->color[4 * i + 3] != 1.0f)
            return 1;
    return 0;
}

static void check(struct harness *h, const struct picture *picture, float center, float edge, float corner)
{
    struct smooth_args args = {.view = picture->view, .center = center, .edge = edge, .corner = corner};
    args.translucent = translucent(picture) != 0;
    size_t count = picture->count, open = 0;
    struct pt_buffer *keys = harness_buffer(h, picture->keys, count * 8);
    struct pt_buffer *from = harness_buffer(h, picture->from, count * 4);
    struct pt_buffer *deff = harness_buffer(h, picture->deff, count * 4);
    float *colors = harness_alloc(h, count * 16); // what empty pixels hold must not matter
    memcpy(colors, picture->color, count * 16);
    for (size_t i = 0; i < count; i++)
        for (size_t c = 0; c < 4 && picture->keys[i] == REF_EMPTY_KEY; c++)
            colors[4 * i + c] = NAN;
    struct pt_buffer *color = harness_buffer(h, colors, count * 16);
    float *unset = harness_alloc(h, count * 16);
    for (size_t i = 0; i < count * 4; i++)
        unset[i] = NAN;
    struct pt_buffer *out = harness_buffer(h, unset, count * 16);
    HARNESS_RUN(h, smooth, &args, keys, from, deff, color, out);
    const float *got = harness_read(h, out);
    struct ref_planes planes = picture_planes(picture);
    for (size_t i = 0; i < count; i++) {
        int x = (int)(i % picture->view.width), y = (int)(i / picture->view.width);
        if (picture->keys[i] == REF_EMPTY_KEY)
            continue; // undefined there
        struct ref_color expected = ref_smooth(&args, &planes, x, y);
        open += (size_t)expected.unsure;
        for (int c = 0; c < 4 && !expected.unsure; c++)
            if (!harness_near(got[4 * i + (size_t)c], expected.color[c], expected.error[c]))
                harness_fail(h, "color", x, y, "channel %d: got %.9g, expected %.9g +- %.2g", c, got[4 * i + (size_t)c],
                             expected.color[c], expected.error[c]);
    }
    harness_unsure(h, open, count, TOL_UNSURE_SHARE);
}

static void all_filters(struct harness *h, const struct picture *picture)
{
    check(h, picture, 16.0f, 2.0f, 1.0f); // alleviated Gaussian
    check(h, picture, 4.0f, 2.0f, 1.0f);  // Gaussian
    check(h, picture, 1.0f, 1.0f, 1.0f);  // box
}

static void kinds(struct harness *h)
{
    for (int p = 0; p < 2; p++)
        for (int kind = 0; kind < PICTURE_KINDS; kind++) {
            struct rng rng = {(uint64_t)kind};
            struct picture picture = picture_random(h, &rng, picture_view(67, 45, p), (enum picture_kind)kind,
                                                    kind % 2 ? 0.9 : 0.5);
            picture_invent(&picture, &rng, 0.5, 4);
            all_filters(h, &picture);
            for (size_t i = 0; i < picture.count; i++) {
                float opacity = rng_below(&rng, 2) ? 0.3f : (float)rng_below(&rng, 2);
                for (size_t c = 0; c < 4; c++)
                    picture.color[4 * i + c] *= opacity;
            }
            all_filters(h, &picture);
        }
}

static void shapes(struct harness *h)
{
    static const uint32_t sizes[][2] = {{1, 1}, {16384, 1}, {1, 70}, {64, 64}, {2, 2}};
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        struct rng rng = {s};
        struct picture picture = picture_random(h, &rng, picture_view(sizes[s][0], sizes[s][1], 1), PICTURE_SURFACES, 0.9);
        check(h, &picture, 16.0f, 2.0f, 1.0f);
    }
}

// Bright beside black, and beside the highest values that float16 files bring.
static void contrast(struct harness *h)
{
    struct rng rng = {3};
    struct picture picture = picture_random(h, &rng, picture_view(67, 45, 1), PICTURE_FLAT, 0.9);
    for (size_t i = 0; i < picture.count; i++)
        for (size_t c = 0; c < 3 && picture.keys[i] != REF_EMPTY_KEY; c++)
            picture.color[4 * i + c] = rng_below(&rng, 2) ? 0.0f : rng_below(&rng, 2) ? 65504.0f : 1e-6f;
    all_filters(h, &picture);
}

static void rectangle(struct harness *h)
{
    struct rng rng = {4};
    struct picture picture = picture_random(h, &rng, picture_view(67, 45, 1), PICTURE_SURFACES, 0.9);
    const uint32_t rect[4] = {3, 2, 50, 30};
    memcpy(picture.view.rect, rect, sizeof rect);
    for (size_t i = 0; i < picture.count; i++) { // nothing lies outside it
        uint32_t x = (uint32_t)(i % 67), y = (uint32_t)(i / 67);
        if (x < rect[0] || x >= rect[2] || y < rect[1] || y >= rect[3])
            picture.keys[i] = REF_EMPTY_KEY;
    }
    all_filters(h, &picture);
}

// Reference alone: a lone pixel keeps its colour, a full window of ones stays one, a step in depth keeps layers apart.
static void sanity(struct harness *h)
{
    struct rng rng = {5};
    struct picture picture = picture_random(h, &rng, picture_view(3, 3, 0), PICTURE_FLAT, 1.0);
    struct smooth_args args = {.view = picture.view, .center = 16.0f, .edge = 2.0f, .corner = 1.0f};
    struct ref_planes planes = picture_planes(&picture);
    for (size_t i = 0; i < 9; i++)
        picture.color[4 * i] = i == 4 ? 1.0f : 0.0f;
    HARNESS_CHECK(h, fabs(ref_smooth(&args, &planes, 1, 1).color[0] - 16.0 / 28.0) < 1e-12); // [D Table 1]
    HARNESS_CHECK(h, fabs(ref_smooth(&args, &planes, 1, 1).color[3] - 1.0) < 1e-12);
    HARNESS_CHECK(h, fabs(ref_smooth(&args, &planes, 0, 0).color[0] - 1.0 / 21.0) < 1e-12);
    picture.keys[4] = ref_key(4.0f, 1);
    HARNESS_CHECK(h, ref_smooth(&args, &planes, 1, 1).color[0] == 1.0);
    HARNESS_CHECK(h, ref_smooth(&args, &planes, 0, 0).color[0] == 0.0);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"sanity", sanity, 1},     {"pictures of all kinds", kinds, 0}, {"shapes of planes", shapes, 0},
        {"contrast", contrast, 0}, {"rectangle", rectangle, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
