// SPDX-License-Identifier: GPL-3.0-or-later
// value: scalars of any size, and none, of an instance among others; the first of them and those after it.
#include "harness.h"
#include "shared/effects.h"

#include <math.h>
#include <string.h>

static void check(struct harness *h, struct rng *rng, const struct picture *picture, uint32_t first, float offset, float size)
{
    const uint32_t count = (uint32_t)picture->count;
    struct value_args args = {.view = picture->view,
                              .instance = {.id_base = picture->id_base, .id_first = count / 8, .id_count = count / 2 + 1},
                              .offset = offset,
                              .first = first};
    const uint32_t slots = args.instance.id_first + args.instance.id_count;
    float *scalars = harness_alloc(h, slots * (size_t)4), *unset = harness_alloc(h, count * (size_t)4);
    for (uint32_t i = 0; i < slots; i++) {
        const uint32_t kind = rng_below(rng, 16);
        scalars[i] = kind == 0   ? NAN
                     : kind == 1 ? (rng_below(rng, 2) ? INFINITY : -INFINITY)
                     : kind == 2 ? 3e38f
                                 : size * ((float)rng_below(rng, 2001) - 1000.0f);
    }
    for (uint32_t i = 0; i < count; i++)
        unset[i] = -77.0f;
    struct pt_buffer *values = harness_buffer(h, unset, count * (size_t)4);
    HARNESS_RUN(h, value, &args, harness_buffer(h, picture->keys, count * (size_t)8),
                harness_buffer(h, scalars, slots * (size_t)4), values);
    const float *got = harness_read(h, values);
    const struct ref_planes planes = picture_planes(picture);
    uint32_t ours = 0;
    for (uint32_t i = 0; i < count; i++) {
        const int x = (int)(i % picture->view.width), y = (int)(i / picture->view.width);
        if (picture->keys[i] == REF_EMPTY_KEY)
            continue; // undefined there
        const struct ref_value expected = ref_value(&args, &planes, scalars, x, y);
        ours += (uint32_t)expected.known;
        if (!expected.written && got[i] != -77.0f)
            harness_fail(h, "value", x, y, "another instance's was written: %.9g", (double)got[i]);
        if (expected.written && expected.known == isnan(got[i]))
            harness_fail(h, "value", x, y, "got %.9g, where it is %s", (double)got[i], expected.known ? "known" : "not known");
        if (expected.known && !harness_near(got[i], expected.value, TOL_UNIT * fabs(expected.value)))
            harness_fail(h, "value", x, y, "got %.9g, expected %.9g", (double)got[i], expected.value);
    }
    HARNESS_CHECK(h, count < 100 || picture->kind == PICTURE_FLAT || ours > count / 64);
}

static void kinds(struct harness *h)
{
    for (int kind = 0; kind < PICTURE_KINDS; kind++)
        for (uint32_t first = 0; first < 2; first++) {
            struct rng rng = {(uint64_t)kind};
            struct picture picture = picture_random(h, &rng, picture_view(67, 45, kind % 2), (enum picture_kind)kind, 0.7);
            picture_invent(&picture, &rng, 0.5, 4);
            check(h, &rng, &picture, first, 0.0f, 0.37f);
            check(h, &rng, &picture, first, 5e6f, 1e4f);
            check(h, &rng, &picture, first, -1e30f, 1e27f);
        }
}

static void shapes(struct harness *h)
{
    static const uint32_t sizes[][2] = {{1, 1}, {16384, 1}, {1, 70}, {64, 64}};
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        struct rng rng = {s};
        struct picture picture = picture_random(h, &rng, picture_view(sizes[s][0], sizes[s][1], 1), PICTURE_SURFACES, 0.9);
        check(h, &rng, &picture, 1, 0.0f, 1.0f);
    }
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {{"pictures of all kinds", kinds, 0}, {"shapes of planes", shapes, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
