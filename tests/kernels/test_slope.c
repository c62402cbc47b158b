// SPDX-License-Identifier: GPL-3.0-or-later
// slope: values in planes, with noise, with gaps and steps, of any size; windows from the least to the widest.
#include "harness.h"
#include "shared/effects.h"

#include <math.h>
#include <string.h>

// wide: what d_eff is widened by.
static void check(struct harness *h, const struct picture *picture, const float *values, float wide, double share)
{
    const struct slope_args args = {.view = picture->view};
    const size_t count = picture->count;
    float *unset = harness_alloc(h, count * 16), *deff = harness_alloc(h, count * 4);
    size_t open = 0;
    for (size_t i = 0; i < 4 * count; i++)
        unset[i] = NAN;
    for (size_t i = 0; i < count; i++)
        deff[i] = picture->deff[i] * wide;
    struct pt_buffer *slopes = harness_buffer(h, unset, count * 16);
    HARNESS_RUN(h, slope, &args, harness_buffer(h, picture->keys, count * 8), harness_buffer(h, picture->from, count * 4),
                harness_buffer(h, picture->normal, count * 16), harness_buffer(h, deff, count * 4),
                harness_buffer(h, values, count * 4), slopes);
    const float *got = harness_read(h, slopes);
    struct ref_planes planes = picture_planes(picture);
    planes.deff = deff;
    for (size_t i = 0; i < count; i++) {
        const int x = (int)(i % picture->view.width), y = (int)(i / picture->view.width);
        const uint32_t *rect = args.view.rect;
        const float *own = got + 4 * i;
        if (picture->keys[i] == REF_EMPTY_KEY || (uint32_t)x < rect[0] || (uint32_t)y < rect[1] || (uint32_t)x >= rect[2] ||
            (uint32_t)y >= rect[3])
            continue;
        const struct ref_slope expected = ref_slope(&args, &planes, values, x, y);
        open += (size_t)expected.unsure;
        if (own[3] != (expected.known ? 1.0f : 0.0f) ||
            (!expected.known && (own[0] != 0.0f || own[1] != 0.0f || own[2] != 0.0f)))
            harness_fail(h, "slope", x, y, "got %.9g, %.9g, %.9g, %.9g where the value is %s", (double)own[0], (double)own[1],
                         (double)own[2], (double)own[3], expected.known ? "known" : "not known");
        if (!expected.known || expected.unsure)
            continue;
        if (!harness_near(own[0], expected.value, expected.value_error) ||
            !harness_near(own[1], expected.x, expected.x_error) || !harness_near(own[2], expected.y, expected.y_error))
            harness_fail(h, "slope", x, y, "got %.9g, %.9g, %.9g, expected %.9g, %.9g, %.9g +- %.2g, %.2g, %.2g",
                         (double)own[0], (double)own[1], (double)own[2], expected.value, expected.x, expected.y,
                         expected.value_error, expected.x_error, expected.y_error);
    }
    harness_unsure(h, open, count, share);
}

static float *values_of(struct harness *h, struct rng *rng, const struct picture *picture, double size, int noise)
{
    float *values = harness_alloc(h, picture->count * 4);
    for (size_t i = 0; i < picture->count; i++) {
        const double x = (double)(i % picture->view.width), y = (double)(i / picture->view.width);
        values[i] = (float)(size * (0.3 * x - 0.7 * y + 4.0 + noise * ((double)rng_below(rng, 1000) / 500.0 - 1.0)));
        if (noise && rng_below(rng, 9) == 0)
            values[i] = NAN;
    }
    return values;
}

static void kinds(struct harness *h)
{
    static const float widths[] = {0.021f, 1.07f, 3.1f, 11.3f};
    for (int kind = 0; kind < PICTURE_KINDS; kind++)
        for (size_t w = 0; w < 4; w++) {
            struct rng rng = {(uint64_t)kind};
            struct picture picture = picture_random(h, &rng, picture_view(67, 45, kind % 2), (enum picture_kind)kind,
                                                    kind % 3 ? 0.9 : 0.4);
            picture_invent(&picture, &rng, 0.5, 4);
            const double size = w == 1 ? 1e-7 : w == 2 ? 1e9 : 1.0;
            check(h, &picture, values_of(h, &rng, &picture, size, (int)w % 2 + kind % 2), widths[w], TOL_UNSURE_SHARE);
        }
}

static void shapes(struct harness *h)
{
    static const uint32_t sizes[][2] = {{1, 1}, {16384, 1}, {1, 70}, {64, 64}, {2, 2}};
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        struct rng rng = {s};
        struct picture picture = picture_random(h, &rng, picture_view(sizes[s][0], sizes[s][1], 1), PICTURE_SURFACES, 0.9);
        check(h, &picture, values_of(h, &rng, &picture, 1.0, 1), 1.0f, TOL_UNSURE_SHARE);
    }
}

static void rectangle(struct harness *h)
{
    struct rng rng = {4};
    struct picture picture = picture_random(h, &rng, picture_view(67, 45, 1), PICTURE_SURFACES, 0.9);
    const uint32_t rect[4] = {3, 2, 50, 30};
    memcpy(picture.view.rect, rect, sizeof rect);
    check(h, &picture, values_of(h, &rng, &picture, 1.0, 1), 2.0f, TOL_UNSURE_SHARE);
}

// Reference alone: a plane comes out as it is; of one value there is no slope; across a line of pixels none.
static void sanity(struct harness *h)
{
    struct rng rng = {5};
    struct picture picture = picture_random(h, &rng, picture_view(21, 21, 0), PICTURE_FLAT, 1.0);
    const struct slope_args args = {.view = picture.view};
    const struct ref_planes planes = picture_planes(&picture);
    float *values = values_of(h, &rng, &picture, 1.0, 0);
    struct ref_slope found = ref_slope(&args, &planes, values, 10, 10);
    HARNESS_CHECK(h, found.known && fabs(found.value - values[10 * 21 + 10]) < 1e-5);
    HARNESS_CHECK(h, fabs(found.x - 0.3) < 0.003 && fabs(found.y + 0.7) < 0.006); // the ridge takes a share
    for (size_t i = 0; i < picture.count; i++)
        values[i] = i % 21 == 10 ? values[i] : NAN;
    found = ref_slope(&args, &planes, values, 10, 10);
    HARNESS_CHECK(h, fabs(found.x) < 1e-12 && fabs(found.y + 0.7) < 0.006);
    for (size_t i = 0; i < picture.count; i++)
        values[i] = i == 10 * 21 + 10 ? 3.0f : NAN;
    found = ref_slope(&args, &planes, values, 10, 10);
    HARNESS_CHECK(h, found.value == 3.0 && found.x == 0.0 && found.y == 0.0);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {{"sanity", sanity, 1},
                                                {"pictures of all kinds", kinds, 0},
                                                {"shapes of planes", shapes, 0},
                                                {"rectangle", rectangle, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
