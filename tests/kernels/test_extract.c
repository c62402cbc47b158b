// SPDX-License-Identifier: GPL-3.0-or-later
// extract: depth, world-space normal and source, each alone and all together, whole and cropped.
#include "harness.h"
#include "shared/colors.h"

#include <math.h>
#include <string.h>

static void compare(struct harness *h, const char *label, int x, int y, double got, double expected, double error)
{
    if (!harness_near(got, expected, error))
        harness_fail(h, label, x, y, "got %.9g, expected %.9g +- %.2g", got, expected, error);
}

static void check(struct harness *h, const struct picture *picture, const float *shading, const uint32_t crop[4],
                  uint32_t wanted, const float matrix[9], const uint32_t discs[2], uint32_t centered)
{
    struct extract_args args = {.view = picture->view,
                                .crop_x = crop[0],
                                .crop_y = crop[1],
                                .crop_width = crop[2],
                                .crop_height = crop[3],
                                .depth = wanted & 1,
                                .normal = wanted >> 1 & 1,
                                .source = wanted >> 2 & 1,
                                .shadow = wanted >> 3 & 1,
                                .discs_first = discs[0],
                                .discs_count = discs[1],
                                .centered = centered};
    memcpy(args.world_from_view, matrix, 9 * sizeof *matrix);
    size_t count = picture->count, inside = (size_t)crop[2] * crop[3];
    float *unset = harness_alloc(h, inside * 12);
    for (size_t i = 0; i < inside * 3; i++)
        unset[i] = -77.0f;
    struct pt_buffer *keys = harness_buffer(h, picture->keys, count * 8);
    struct pt_buffer *from = harness_buffer(h, picture->from, count * 4);
    struct pt_buffer *lit = harness_buffer(h, shading, count * 16);
    struct pt_buffer *depth = harness_buffer(h, unset, inside * 4), *normal = harness_buffer(h, unset, inside * 12);
    struct pt_buffer *source = harness_buffer(h, unset, inside * 4);
    float *shares = harness_alloc(h, count * 4);
    for (size_t i = 0; i < count; i++)
        shares[i] = (float)(i % 97) / 96.0f;
    struct pt_buffer *arrived = harness_buffer(h, shares, count * 4);
    struct pt_buffer *shadow = harness_buffer(h, unset, inside * 4);
    float *off = harness_alloc(h, count * 4);
    for (size_t i = 0; i < count; i++)
        off[i] = (float)(i % 41) * 0.5f;
    struct pt_buffer *away = harness_buffer(h, off, count * 4);
    float *steps = harness_alloc(h, count * 4);
    for (size_t i = 0; i < count; i++)
        steps[i] = ((float)(i % 53) - 26.0f) * 0.03125f;
    struct pt_buffer *offset = harness_buffer(h, steps, count * 4);
    HARNESS_RUN(h, extract, &args, keys, from, lit, depth, normal, source, arrived, shadow, away, offset);
    const float *got_depth = harness_read(h, depth), *got_normal = harness_read(h, normal);
    const float *got_source = harness_read(h, source), *got_shadow = harness_read(h, shadow);
    struct ref_planes planes = picture_planes(picture);
    planes.shading = shading;
    planes.arrived = shares;
    planes.away = off;
    planes.offset = steps;
    for (size_t i = 0; i < inside; i++) {
        int x = (int)(i % crop[2]), y = (int)(i / crop[2]);
        struct ref_extract expected = ref_extract(&args, &planes, x, y);
        compare(h, "depth", x, y, got_depth[i], args.depth ? expected.depth : -77.0, 0.0);
        compare(h, "normal.x", x, y, got_normal[3 * i], args.normal ? expected.normal.x : -77.0, expected.normal_error);
        compare(h, "normal.y", x, y, got_normal[3 * i + 1], args.normal ? expected.normal.y : -77.0, expected.normal_error);
        compare(h, "normal.z", x, y, got_normal[3 * i + 2], args.normal ? expected.normal.z : -77.0, expected.normal_error);
        compare(h, "source", x, y, got_source[i], args.source ? expected.source : -77.0, TOL_DISTANCE * fabs(expected.source));
        compare(h, "shadow", x, y, got_shadow[i], args.shadow ? expected.shadow : -77.0, 0.0);
    }
    harness_same(h, "depth", got_depth, inside, 4, 1, crop[2]);
}

static void passes(struct harness *h)
{
    static const uint32_t crops[][4] = {{0, 0, 67, 45}, {5, 3, 40, 30}, {66, 44, 1, 1}};
    static const uint32_t discs[][2] = {{0, 0}, {0, 0xFFFFFFFFu}, {0xFFFFFFFEu - 67 * 45 + 700, 900}};
    for (int kind = 0; kind < PICTURE_KINDS; kind++)
        for (uint32_t wanted = 1; wanted < 16; wanted++) {
            struct rng rng = {(uint64_t)kind};
            struct picture picture = picture_random(h, &rng, picture_view(67, 45, kind % 2), (enum picture_kind)kind, 0.5);
            picture_invent(&picture, &rng, 0.5, 30);
            float matrix[9], *shading = harness_alloc(h, picture.count * 16);
            for (int k = 0; k < 3; k++)
                rng_direction(&rng, matrix + 3 * k);
            for (size_t i = 0; i < picture.count; i++) {
                if (picture.keys[i] == REF_EMPTY_KEY) { // anything: it must not matter
                    shading[4 * i] = NAN;
                    continue;
                }
                memcpy(shading + 4 * i, picture.normal + 4 * (size_t)picture.from[i], 12);
                if (rng_below(&rng, 3) == 0)
                    picture.from[i] |= PT_FROM_MIXED;
            }
            check(h, &picture, shading, crops[wanted % 3], wanted, matrix, discs[(wanted / 4 + (uint32_t)kind) % 3],
                  (uint32_t[]){0, 0xFFFFFFFFu, picture.id_base + 700}[(wanted / 2) % 3]);
        }
}

static void shapes(struct harness *h)
{
    static const uint32_t sizes[][2] = {{1, 1}, {16384, 1}, {1, 70}};
    static const float identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    static const uint32_t no_discs[2] = {0, 0};
    for (size_t s = 0; s < 3; s++) {
        struct rng rng = {s};
        struct picture picture = picture_random(h, &rng, picture_view(sizes[s][0], sizes[s][1], 1), PICTURE_FLAT, 0.5);
        for (size_t i = 0; i < picture.count; i++) // as far away as the plane allows
            picture.from[i] = rng_below(&rng, (uint32_t)picture.count);
        const uint32_t crop[4] = {0, 0, sizes[s][0], sizes[s][1]};
        check(h, &picture, picture.normal, crop, 15, identity, no_discs, s == 1 ? 0xFFFFFFFFu : 0);
    }
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"every choice of passes", passes, 0},
        {"shapes of planes", shapes, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
