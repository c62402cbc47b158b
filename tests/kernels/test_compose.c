// SPDX-License-Identifier: GPL-3.0-or-later
// compose: over opaque and transparent backgrounds, whole and cropped.
#include "harness.h"
#include "shared/colors.h"

#include <math.h>

static void check(struct harness *h, const struct picture *picture, const uint32_t crop[4], const float background[4],
                  uint32_t everywhere)
{
    struct compose_args args = {.view = picture->view,
                                .crop_x = crop[0],
                                .crop_y = crop[1],
                                .crop_width = crop[2],
                                .crop_height = crop[3],
                                .background = {background[0], background[1], background[2], background[3]},
                                .everywhere = everywhere};
    size_t count = picture->count, inside = (size_t)crop[2] * crop[3];
    struct pt_buffer *keys = harness_buffer(h, picture->keys, count * 8);
    struct pt_buffer *color = harness_buffer(h, picture->color, count * 16);
    struct pt_buffer *out = harness_buffer(h, NULL, inside * 16);
    HARNESS_RUN(h, compose, &args, keys, color, out);
    const float *got = harness_read(h, out);
    struct ref_planes planes = picture_planes(picture);
    for (size_t i = 0; i < inside; i++) {
        int x = (int)(i % crop[2]), y = (int)(i / crop[2]);
        struct ref_color expected = ref_compose(&args, &planes, x, y);
        for (int c = 0; c < 4; c++)
            if (!harness_near(got[4 * i + (size_t)c], expected.color[c], expected.error[c]))
                harness_fail(h, "combined", x, y, "channel %d: got %.9g, expected %.9g +- %.2g", c, got[4 * i + (size_t)c],
                             expected.color[c], expected.error[c]);
    }
}

static void backgrounds(struct harness *h)
{
    static const float colors[][4] = {{0, 0, 0, 0}, {0.05f, 0.1f, 0.2f, 1}, {1e4f, 0, 1e-6f, 1}};
    static const uint32_t crops[][4] = {{0, 0, 67, 45}, {5, 3, 40, 30}, {66, 44, 1, 1}, {0, 20, 67, 1}};
    for (size_t b = 0; b < 3; b++)
        for (size_t c = 0; c < 4; c++) {
            struct rng rng = {b * 10 + c};
            struct picture picture = picture_random(h, &rng, picture_view(67, 45, 1), PICTURE_SURFACES, 0.6);
            for (size_t i = 0; i < picture.count; i++) { // edges: premultiplied by what they cover; empty: anything
                float alpha = rng_below(&rng, 3) ? 1.0f : (float)rng_unit(&rng);
                for (size_t k = 0; k < 4; k++)
                    picture.color[4 * i + k] = picture.keys[i] == REF_EMPTY_KEY ? NAN : picture.color[4 * i + k] * alpha;
            }
            check(h, &picture, crops[c], colors[b], 0);
            for (size_t i = 0; i < 4 * picture.count; i++)
                picture.color[i] = picture.color[i] >= 0.0f ? picture.color[i] : 0.25f;
            check(h, &picture, crops[c], colors[b], 1);
        }
}

static void shapes(struct harness *h)
{
    static const uint32_t sizes[][2] = {{1, 1}, {16384, 1}, {1, 70}};
    static const float background[4] = {0.5f, 0.25f, 0.125f, 1.0f};
    for (size_t s = 0; s < 3; s++) {
        struct rng rng = {s};
        struct picture picture = picture_random(h, &rng, picture_view(sizes[s][0], sizes[s][1], 1), PICTURE_FLAT, 0.5);
        const uint32_t crop[4] = {0, 0, sizes[s][0], sizes[s][1]};
        check(h, &picture, crop, background, 0);
    }
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"backgrounds and crops", backgrounds, 0},
        {"shapes of planes", shapes, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
