// SPDX-License-Identifier: GPL-3.0-or-later
// focus: sharp to the widest circles, perspective and orthographic views, crops, transparent film.
#include "harness.h"
#include "shared/picture.h"

#include <math.h>
#include <string.h>

static struct focus_args args_of(const struct view_args *view, const uint32_t crop[4], float distance, float scale)
{
    struct focus_args args = {.view = *view,
                              .crop_x = crop[0],
                              .crop_y = crop[1],
                              .crop_width = crop[2],
                              .crop_height = crop[3],
                              .distance = distance,
                              .scale = scale,
                              .most = fminf(scale * 3.0f, (float)PT_FOCUS_MOST)};
    args.reach = (uint32_t)ceilf(args.most + 0.5f);
    args.reach = args.reach < PT_FOCUS_MOST ? args.reach : PT_FOCUS_MOST;
    return args;
}

static void check(struct harness *h, const struct picture *picture, const struct focus_args *args)
{
    size_t count = picture->count, inside = (size_t)args->crop_width * args->crop_height;
    float *colors = harness_alloc(h, count * 16);
    memcpy(colors, picture->color, count * 16);
    for (size_t i = 0; i < count; i++)
        for (size_t c = 0; c < 4 && picture->keys[i] == REF_EMPTY_KEY; c++)
            colors[4 * i + c] = NAN;
    struct pt_buffer *out = harness_buffer(h, NULL, inside * 16);
    HARNESS_RUN(h, focus, args, harness_buffer(h, picture->keys, count * 8), harness_buffer(h, colors, count * 16), out);
    const float *got = harness_read(h, out);
    struct ref_planes planes = picture_planes(picture);
    for (size_t i = 0; i < inside; i++) {
        int x = (int)(i % args->crop_width), y = (int)(i / args->crop_width);
        struct ref_color expected = ref_focus(args, &planes, x, y);
        for (int c = 0; c < 4; c++)
            if (!harness_near(got[4 * i + (size_t)c], expected.color[c], expected.error[c]))
                harness_fail(h, "combined", x, y, "channel %d: got %.9g, expected %.9g +- %.2g", c, got[4 * i + (size_t)c],
                             expected.color[c], expected.error[c]);
    }
}

static struct picture random_picture(struct harness *h, uint64_t seed, uint32_t width, uint32_t height, int perspective,
                                     enum picture_kind kind)
{
    struct rng rng = {seed};
    struct picture picture = picture_random(h, &rng, picture_view(width, height, perspective), kind, kind % 2 ? 0.9 : 0.5);
    picture_invent(&picture, &rng, 0.5, 4);
    for (size_t i = 0; i < picture.count; i++) {
        float alpha = rng_below(&rng, 3) ? 1.0f : (float)rng_unit(&rng);
        for (size_t c = 0; c < 4; c++)
            picture.color[4 * i + c] *= alpha;
    }
    return picture;
}

static void kinds(struct harness *h)
{
    static const float scales[] = {0.0f, 0.7f, 4.0f, 11.0f};
    const uint32_t whole[4] = {0, 0, 67, 45};
    for (int p = 0; p < 2; p++)
        for (int kind = 0; kind < PICTURE_KINDS; kind++) {
            struct picture picture = random_picture(h, (uint64_t)kind, 67, 45, p, (enum picture_kind)kind);
            struct focus_args args = args_of(&picture.view, whole, 4.5f, scales[kind % 4]);
            check(h, &picture, &args);
        }
}

static void hard(struct harness *h)
{
    static const uint32_t sizes[][2] = {{67, 45}, {1, 1}, {700, 1}, {1, 70}};
    static const float background[4] = {0.05f, 0.1f, 0.2f, 1.0f};
    for (size_t s = 0; s < 4; s++) {
        struct picture picture = random_picture(h, s, sizes[s][0], sizes[s][1], 1, PICTURE_SURFACES);
        const uint32_t crop[4] = {sizes[s][0] / 3, sizes[s][1] / 4, sizes[s][0] - sizes[s][0] / 3,
                                  sizes[s][1] - sizes[s][1] / 4};
        struct focus_args args = args_of(&picture.view, crop, 4.0f, 6.0f);
        memcpy(args.background, background, sizeof background);
        check(h, &picture, &args);
    }
    struct picture picture = random_picture(h, 9, 67, 45, 1, PICTURE_RANGE); // nearly all as wide as may be
    const uint32_t crop[4] = {30, 20, 9, 5};
    struct focus_args args = args_of(&picture.view, crop, 1.0f, 1e6f);
    check(h, &picture, &args);
}

// Reference alone: what is in focus stays, a point out of focus keeps its light, a plane out of focus stays a plane.
static void sanity(struct harness *h)
{
    struct rng rng = {5};
    struct picture picture = picture_random(h, &rng, picture_view(33, 33, 1), PICTURE_FLAT, 1.0);
    struct ref_planes planes = picture_planes(&picture);
    const uint32_t whole[4] = {0, 0, 33, 33};
    struct focus_args args = args_of(&picture.view, whole, 5.0f, 6.0f);
    HARNESS_CHECK(h, fabs(ref_focus(&args, &planes, 16, 16).color[0] - (double)picture.color[4 * (16 * 33 + 16)]) < 1e-6);
    args.distance = 8.0f;
    for (size_t i = 0; i < picture.count; i++)
        for (size_t c = 0; c < 4; c++)
            picture.color[4 * i + c] = 0.25f;
    HARNESS_CHECK(h, fabs(ref_focus(&args, &planes, 16, 16).color[2] - 0.25) < 1e-9);
    double light = 0.0;
    for (size_t i = 0; i < picture.count; i++)
        if (i != 16 * 33 + 16)
            picture.keys[i] = REF_EMPTY_KEY;
    for (int i = 0; i < 33 * 33; i++)
        light += ref_focus(&args, &planes, i % 33, i / 33).color[3];
    HARNESS_CHECK(h, fabs(light / 0.25 - 1.0) < 0.1);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {{"sanity", sanity, 1}, {"pictures of all kinds", kinds, 0}, {"hard", hard, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
