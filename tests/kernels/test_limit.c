// SPDX-License-Identifier: GPL-3.0-or-later
// limit: exact, and says whether anything is left.
#include "harness.h"
#include "shared/shadows.h"

#include <math.h>
#include <string.h>

static void check(struct harness *h, const struct picture *picture, const uint8_t *opacities, uint32_t loss,
                  const uint32_t rect[4])
{
    struct limit_args args = {.view = picture->view, .caster = picture->id_base, .loss = loss};
    uint32_t none = 0, some = 0;
    memcpy(args.view.rect, rect, sizeof args.view.rect);
    float *before = harness_alloc(h, picture->count * 4);
    for (size_t i = 0; i < picture->count; i++)
        before[i] = -1.0f;
    struct pt_buffer *keys = harness_buffer(h, picture->keys, picture->count * 8);
    struct pt_buffer *from = harness_buffer(h, picture->from, picture->count * 4);
    struct pt_buffer *deff = harness_buffer(h, picture->deff, picture->count * 4);
    struct pt_buffer *opaque = harness_buffer(h, opacities, picture->count + 4);
    struct pt_buffer *limit = harness_buffer(h, before, picture->count * 4), *flag = harness_buffer(h, &none, 4);
    HARNESS_RUN(h, limit, &args, keys, from, deff, opaque, limit, flag);
    const float *got = harness_read(h, limit);
    struct ref_planes planes = picture_planes(picture);
    planes.opacities = opacities;
    for (int y = 0; y < (int)picture->view.height; y++)
        for (int x = 0; x < (int)picture->view.width; x++) {
            float is = got[(size_t)y * picture->view.width + (size_t)x];
            int inside = x >= (int)rect[0] && x < (int)rect[2] && y >= (int)rect[1] && y < (int)rect[3];
            float expected = inside ? ref_limit(&args, &planes, x, y) : -1.0f;
            some |= inside && isfinite(expected);
            if (is != expected)
                harness_fail(h, "limit", x, y, "got %.9g, expected %.9g", (double)is, (double)expected);
        }
    HARNESS_CHECK(h, *(const uint32_t *)harness_read(h, flag) == some);
}

static void pictures(struct harness *h)
{
    static const uint32_t sizes[][2] = {{67, 45}, {1, 1}, {300, 1}, {1, 70}}, losses[] = {255, 254, 1};
    for (size_t s = 0; s < 4; s++)
        for (int kind = 0; kind < PICTURE_KINDS; kind++) {
            struct rng rng = {s};
            struct picture picture = picture_random(h, &rng, picture_view(sizes[s][0], sizes[s][1], kind % 2),
                                                    (enum picture_kind)kind, 0.5);
            picture_invent(&picture, &rng, 0.5, 5);
            uint8_t *opacities = harness_alloc(h, picture.count + 4);
            for (size_t i = 0; i < picture.count; i++)
                opacities[i] = rng_below(&rng, 3) ? (uint8_t)rng_next(&rng) : 255;
            const uint32_t whole[4] = {0, 0, sizes[s][0], sizes[s][1]};
            for (size_t l = 0; l < 3; l++)
                check(h, &picture, opacities, losses[l], whole);
        }
}

// Part of the plane; and nothing left where every point is opaque.
static void spent(struct harness *h)
{
    static const uint32_t rect[4] = {5, 7, 38, 40}, whole[4] = {0, 0, 67, 45};
    struct rng rng = {5};
    struct picture picture = picture_random(h, &rng, picture_view(67, 45, 1), PICTURE_SURFACES, 0.9);
    uint8_t *opacities = harness_alloc(h, picture.count + 4);
    memset(opacities, 255, picture.count);
    check(h, &picture, opacities, 200, rect);
    check(h, &picture, opacities, 255, whole);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"pictures", pictures, 0},
        {"spent, rectangle", spent, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
