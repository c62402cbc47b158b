// SPDX-License-Identifier: GPL-3.0-or-later
// antialias: background edges alone, and layer edges too.
#include "harness.h"
#include "shared/colors.h"

#include <math.h>
#include <string.h>

// through: NULL for the first layer
static void check(struct harness *h, const struct picture *picture, uint32_t layers, const float *through)
{
    struct antialias_args args = {.view = picture->view, .layers = layers, .behind = through != NULL};
    args.mesh_base = picture->id_base + (uint32_t)picture->count / 2; // some of them are triangles
    args.mesh_count = (uint32_t)picture->count / 4;
    size_t count = picture->count, open = 0, mixed = 0;
    float *colors = harness_alloc(h, count * 16); // what empty pixels hold must not matter
    memcpy(colors, picture->color, count * 16);
    for (size_t i = 0; i < count; i++)
        for (size_t c = 0; c < 4 && picture->keys[i] == REF_EMPTY_KEY; c++)
            colors[4 * i + c] = NAN;
    struct pt_buffer *keys = harness_buffer(h, picture->keys, count * 8);
    struct pt_buffer *from = harness_buffer(h, picture->from, count * 4);
    struct pt_buffer *deff = harness_buffer(h, picture->deff, count * 4);
    struct pt_buffer *color = harness_buffer(h, colors, count * 16);
    HARNESS_RUN(h, antialias, &args, keys, from, deff, color, through ? harness_buffer(h, through, count * 4) : NULL, NULL);
    const float *got = harness_read(h, color);
    uint32_t *got_from = harness_read(h, from);
    struct ref_planes planes = picture_planes(picture);
    planes.through = through;
    for (size_t i = 0; i < count; i++) {
        int x = (int)(i % picture->view.width), y = (int)(i / picture->view.width);
        if (picture->keys[i] == REF_EMPTY_KEY) {
            got_from[i] = 0; // undefined there
            continue;
        }
        struct ref_color expected = ref_antialias(&args, &planes, x, y);
        open += (size_t)expected.unsure;
        if (expected.unsure)
            continue;
        mixed += (size_t)expected.mixed;
        uint32_t source = picture->from[i] | (expected.mixed ? PT_FROM_MIXED : 0);
        if (got_from[i] != source)
            harness_fail(h, "from", x, y, "got %08x, expected %08x", got_from[i], source);
        for (int c = 0; c < 4; c++)
            if (!harness_near(got[4 * i + (size_t)c], expected.color[c], expected.error[c]))
                harness_fail(h, "color", x, y, "channel %d: got %.9g, expected %.9g +- %.2g", c, got[4 * i + (size_t)c],
                             expected.color[c], expected.error[c]);
    }
    harness_same(h, "from", got_from, count, 4, 1, picture->view.width);
    harness_unsure(h, open, count, TOL_UNSURE_SHARE);
    HARNESS_CHECK(h, mixed || count < 1000);
}

static void kinds(struct harness *h)
{
    for (int p = 0; p < 2; p++)
        for (int kind = 0; kind < PICTURE_KINDS; kind++) {
            struct rng rng = {(uint64_t)kind};
            struct picture picture = picture_random(h, &rng, picture_view(67, 45, p), (enum picture_kind)kind,
                                                    kind % 2 ? 0.9 : 0.5);
            picture_invent(&picture, &rng, 0.5, 4);
            check(h, &picture, 0, NULL);
            check(h, &picture, 1, NULL);
            float *through = harness_alloc(h, picture.count * 4); // light, no light, and about as little as counts for none
            for (size_t i = 0; i < picture.count; i++)
                through[i] = rng_below(&rng, 2) ? PT_SPENT : rng_below(&rng, 2) ? 0.0f : float_step(PT_SPENT, -1);
            check(h, &picture, 0, through);
            check(h, &picture, 1, through);
        }
}

static void shapes(struct harness *h)
{
    static const uint32_t sizes[][2] = {{1, 1}, {16384, 1}, {1, 70}, {64, 64}, {2, 2}};
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        struct rng rng = {s};
        struct picture picture = picture_random(h, &rng, picture_view(sizes[s][0], sizes[s][1], 1), PICTURE_SURFACES, 0.9);
        check(h, &picture, 1, NULL);
    }
}

// Reference alone: coverage by the number of far neighbours; nothing known beyond the plane.
static void sanity(struct harness *h)
{
    static const double coverage[5] = {1.0, 0.5, 1.0 / 6.0, 1.0 / 6.0, 1.0 / 6.0};
    static const size_t around[4] = {5, 7, 3, 1};
    struct rng rng = {6};
    struct picture picture = picture_random(h, &rng, picture_view(3, 3, 0), PICTURE_FLAT, 1.0);
    struct antialias_args args = {.view = picture.view};
    struct ref_planes planes = picture_planes(&picture);
    HARNESS_CHECK(h, !ref_antialias(&args, &planes, 0, 0).mixed);
    for (int k = 0; k <= 4; k++) {
        struct ref_color out = ref_antialias(&args, &planes, 1, 1);
        HARNESS_CHECK(h, fabs(out.color[3] - coverage[k]) < 1e-12 && out.mixed == (k > 0));
        if (k < 4)
            picture.keys[around[k]] = REF_EMPTY_KEY;
    }
    picture.keys[5] = ref_key(6.0f, 1); // a layer behind, not background
    picture.color[4 * 5 + 3] = 1.0f;
    picture.deff[4] = 0.5f;
    HARNESS_CHECK(h, fabs(ref_antialias(&args, &planes, 1, 1).color[3] - 1.0 / 6.0) < 1e-12); // k = 3
    args.layers = 1;
    HARNESS_CHECK(h, fabs(ref_antialias(&args, &planes, 1, 1).color[3] - (1.0 / 6.0 + 5.0 / 24.0)) < 1e-12);
    picture.deff[4] = 2.0f;
    HARNESS_CHECK(h, fabs(ref_antialias(&args, &planes, 1, 1).color[3] - 1.0 / 6.0) < 1e-12);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"sanity", sanity, 1},
        {"pictures of all kinds", kinds, 0},
        {"shapes of planes", shapes, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
