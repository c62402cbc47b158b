// SPDX-License-Identifier: GPL-3.0-or-later
// assess: trust and thickness, each alone and both, over all pixels and over an instance's, whole and cropped.
#include "harness.h"
#include "shared/picture.h"

#include <math.h>
#include <string.h>

struct setup {
    struct picture picture;
    struct assess_args args;
    uint32_t crop[4];
    uint32_t *shapes;
    size_t shape_count;
};

static struct setup make(struct harness *h, struct rng *rng, enum picture_kind kind, const uint32_t crop[4], uint32_t wanted)
{
    struct setup s = {.picture = picture_random(h, rng, picture_view(67, 45, kind % 2), kind, 0.6)};
    const uint32_t count = (uint32_t)s.picture.count;
    memcpy(s.crop, crop, sizeof s.crop);
    s.args = (struct assess_args){.view = s.picture.view,
                                  .instance = {.id_base = s.picture.id_base, .id_first = count / 8, .id_count = count / 2},
                                  .crop_x = crop[0],
                                  .crop_y = crop[1],
                                  .crop_width = crop[2],
                                  .first = wanted & 1,
                                  .trust = wanted >> 1 & 1,
                                  .thickness = wanted >> 2 & 1,
                                  .sigma_scale = 0.0625f};
    s.args.view.rect[0] = crop[0] + (wanted & 1 ? 0 : crop[2] / 3);
    s.args.view.rect[1] = crop[1] + (wanted & 1 ? 0 : crop[3] / 4);
    s.args.view.rect[2] = crop[0] + crop[2];
    s.args.view.rect[3] = crop[1] + crop[3];
    for (int k = 0; k < PT_SPACINGS; k++)
        s.args.instance.spacing[k] = (float)(0.001 * exp2(k / 4.0)); // of class 0, too: it must not matter
    s.shape_count = count / 8 + count / 2;
    s.shapes = harness_alloc(h, s.shape_count * 4);
    for (size_t i = 0; i < s.shape_count; i++) {
        s.shapes[i] = rng_below(rng, 0xFFFFFFFFu);
        if (rng_below(rng, 4) == 0)
            s.shapes[i] &= ~(PT_SHAPE_CLASS_BITS << PT_SHAPE_SIGMA_SHIFT); // not known
        if (rng_below(rng, 4) == 0)
            s.shapes[i] |= 15u << PT_SHAPE_TRUST_SHIFT;
    }
    return s;
}

static void compare(struct harness *h, const char *label, int x, int y, double got, double expected)
{
    if (!harness_near(got, expected, TOL_KNOWN * fabs(expected)))
        harness_fail(h, label, x, y, "got %.9g, expected %.9g", got, expected);
}

static void check(struct harness *h, const struct setup *s)
{
    const struct assess_args *args = &s->args;
    const size_t inside = (size_t)s->crop[2] * s->crop[3];
    float *unset = harness_alloc(h, inside * 4);
    size_t ours = 0;
    for (size_t i = 0; i < inside; i++)
        unset[i] = -77.0f;
    struct pt_buffer *keys = harness_buffer(h, s->picture.keys, s->picture.count * 8);
    struct pt_buffer *shapes = harness_buffer(h, s->shapes, s->shape_count * 4);
    struct pt_buffer *trust = harness_buffer(h, unset, inside * 4), *thickness = harness_buffer(h, unset, inside * 4);
    HARNESS_RUN(h, assess, args, keys, shapes, trust, thickness);
    const float *sure = harness_read(h, trust), *sigma = harness_read(h, thickness);
    const struct ref_planes planes = picture_planes(&s->picture);
    for (size_t i = 0; i < inside; i++) {
        const int x = (int)(i % s->crop[2] + s->crop[0]), y = (int)(i / s->crop[2] + s->crop[1]);
        const uint32_t *rect = args->view.rect;
        struct ref_assess expected = {0};
        if ((uint32_t)x >= rect[0] && (uint32_t)y >= rect[1] && (uint32_t)x < rect[2] && (uint32_t)y < rect[3])
            expected = ref_assess(args, &planes, s->shapes, x, y);
        ours += expected.trust > 0.0;
        compare(h, "trust", x, y, sure[i], args->trust && expected.written ? expected.trust : -77.0);
        compare(h, "thickness", x, y, sigma[i], args->thickness && expected.written ? expected.thickness : -77.0);
        if (sure[i] > 1.0f)
            harness_fail(h, "trust", x, y, "%.9g is above 1", sure[i]);
    }
    HARNESS_CHECK(h, inside < 100 || ours > inside / 20);
    harness_same(h, "trust", sure, inside, 4, 1, s->crop[2]);
    harness_same(h, "thickness", sigma, inside, 4, 1, s->crop[2]);
}

static void passes(struct harness *h)
{
    static const uint32_t crops[][4] = {{0, 0, 67, 45}, {5, 3, 40, 30}, {66, 44, 1, 1}};
    for (int kind = 0; kind < PICTURE_KINDS; kind++)
        for (uint32_t wanted = 2; wanted < 8; wanted++) {
            struct rng rng = {(uint64_t)kind + 100 * wanted};
            struct setup s = make(h, &rng, (enum picture_kind)kind, crops[wanted % 3], wanted);
            check(h, &s);
        }
}

// Reference alone: one point of the twelfth level of trust, 0.96, and of the third class, and nothing.
static void sanity(struct harness *h)
{
    const uint64_t keys[2] = {ref_key(5.0f, 7), REF_EMPTY_KEY};
    const uint32_t shape = 12u << PT_SHAPE_TRUST_SHIFT | 3u << PT_SHAPE_SIGMA_SHIFT | PT_SHAPE_SEEN_THROUGH | 63u;
    struct assess_args args = {
        .view = {.width = 2, .height = 1}, .instance = {.id_base = 7, .id_count = 1}, .sigma_scale = 0.25f};
    const struct ref_planes planes = {.keys = keys};
    args.instance.spacing[3] = 2.0f;
    struct ref_assess out = ref_assess(&args, &planes, &shape, 0, 0);
    HARNESS_CHECK(h, out.written && fabs(out.trust - 0.96) < 1e-12 && out.thickness == 0.5);
    HARNESS_CHECK(h, !ref_assess(&args, &planes, &shape, 1, 0).written);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {{"sanity", sanity, 1}, {"every choice of passes", passes, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
