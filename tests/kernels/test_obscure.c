// SPDX-License-Identifier: GPL-3.0-or-later
// obscure: taps against the reference, and the mean of the device's own taps; radii from a thousandth of a pixel to more than the
// picture, depths over seven decades, normals edge-on.
#include "harness.h"
#include "shared/effects.h"

#include <math.h>
#include <string.h>

static struct obscure_args args_of(const struct view_args *view, float radius, float strength)
{
    struct obscure_args args = {.view = *view, .radius = radius, .strength = strength};
    for (int i = 0; i < PT_OBSCURE_TAPS; i++) {
        double angle = 2.4 * i, at = (i + 0.5) / PT_OBSCURE_TAPS;
        args.spiral[2 * i] = (float)(at * cos(angle));
        args.spiral[2 * i + 1] = (float)(at * sin(angle));
    }
    for (int i = 0; i < PT_OBSCURE_TURNS; i++) {
        double angle = 0.37 + 6.283185307179586 * i / PT_OBSCURE_TURNS;
        args.turns[2 * i] = (float)cos(angle);
        args.turns[2 * i + 1] = (float)sin(angle);
    }
    return args;
}

static void check(struct harness *h, const struct picture *picture, float radius, float strength, double open_most)
{
    struct obscure_args args = args_of(&picture->view, radius, strength);
    size_t count = picture->count, open = 0;
    float *before = harness_alloc(h, count * 16), *unset = harness_alloc(h, count * 4);
    memcpy(before, picture->color, count * 16);
    for (size_t i = 0; i < count; i++) {
        unset[i] = NAN;
        for (size_t c = 0; c < 4 && picture->keys[i] == REF_EMPTY_KEY; c++)
            before[4 * i + c] = NAN;
    }
    struct pt_buffer *keys = harness_buffer(h, picture->keys, count * 8);
    struct pt_buffer *from = harness_buffer(h, picture->from, count * 4);
    struct pt_buffer *deff = harness_buffer(h, picture->deff, count * 4);
    struct pt_buffer *shading = harness_buffer(h, picture->normal, count * 16);
    struct pt_buffer *color = harness_buffer(h, before, count * 16);
    struct pt_buffer *obscured = harness_buffer(h, unset, count * 4);
    HARNESS_RUN(h, obscure, &args, keys, from, deff, shading, color, obscured);
    const float *got = harness_read(h, color), *taps = harness_read(h, obscured);
    struct ref_planes planes = picture_planes(picture);
    planes.shading = picture->normal;
    planes.obscured = taps;
    for (size_t i = 0; i < count; i++) {
        int x = (int)(i % picture->view.width), y = (int)(i / picture->view.width), unsure = 0;
        if (picture->keys[i] == REF_EMPTY_KEY) {
            if (memcmp(got + 4 * i, before + 4 * i, 16) != 0)
                harness_fail(h, "color", x, y, "an empty pixel was written");
            continue;
        }
        double error, value = ref_obscured(&args, &planes, x, y, &error, &unsure);
        struct ref_color expected = ref_obscure(&args, &planes, x, y);
        open += (size_t)(unsure || expected.unsure);
        if (unsure ? !(taps[i] >= 0.0f && taps[i] <= 1.0f) : !harness_near(taps[i], value, error + 1e-6))
            harness_fail(h, "obscured", x, y, "got %.9g, expected %.9g +- %.2g", taps[i], value, error);
        for (int c = 0; c < 4 && !expected.unsure; c++)
            if (!harness_near(got[4 * i + (size_t)c], expected.color[c], expected.error[c]))
                harness_fail(h, "color", x, y, "channel %d: got %.9g, expected %.9g +- %.2g", c, got[4 * i + (size_t)c],
                             expected.color[c], expected.error[c]);
    }
    harness_unsure(h, open, count, open_most);
}

static struct picture random_picture(struct harness *h, uint64_t seed, uint32_t width, uint32_t height, int perspective,
                                     enum picture_kind kind)
{
    struct rng rng = {seed};
    struct picture picture = picture_random(h, &rng, picture_view(width, height, perspective), kind, kind % 2 ? 0.9 : 0.5);
    picture_invent(&picture, &rng, 0.5, 4);
    return picture;
}

static void kinds(struct harness *h)
{
    static const float radii[] = {0.05f, 0.6f, 40.0f};
    for (int p = 0; p < 2; p++)
        for (int kind = 0; kind < PICTURE_KINDS; kind++)
            for (int r = 0; r < 3; r++) {
                struct picture picture = random_picture(h, (uint64_t)kind, 67, 45, p, (enum picture_kind)kind);
                double most = kind == PICTURE_GRAZING ? 1.0 : TOL_UNSURE_SHARE; // edge-on by design
                check(h, &picture, radii[r], 0.4f * (float)(r + 1), most);
            }
}

static void shapes(struct harness *h)
{
    static const uint32_t sizes[][2] = {{1, 1}, {16384, 1}, {1, 70}, {64, 64}};
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        struct picture picture = random_picture(h, s, sizes[s][0], sizes[s][1], 1, PICTURE_SURFACES);
        check(h, &picture, 0.5f, 1.0f, TOL_UNSURE_SHARE);
    }
}

static void hard(struct harness *h)
{
    struct picture picture = random_picture(h, 3, 67, 45, 1, PICTURE_SURFACES);
    check(h, &picture, 1e-6f, 1.0f, TOL_UNSURE_SHARE); // thousandths of a pixel: every tap is the pixel itself
    check(h, &picture, 1e6f, 10.0f, TOL_UNSURE_SHARE);
    for (size_t i = 0; i < picture.count; i++) // no normals
        memset(picture.normal + 4 * i, 0, 12);
    check(h, &picture, 0.5f, 1.0f, TOL_UNSURE_SHARE);
}

// Reference alone: a plane is clear, a pit is dark, empty pixels say nothing.
static void sanity(struct harness *h)
{
    struct rng rng = {5};
    struct picture picture = picture_random(h, &rng, picture_view(65, 65, 0), PICTURE_FLAT, 1.0);
    struct ref_planes planes = picture_planes(&picture);
    double width = (double)picture.view.footprint, error;
    struct obscure_args args = args_of(&picture.view, (float)(20.0 * width), 1.0f);
    int unsure = 0;
    planes.shading = picture.normal;
    HARNESS_CHECK(h, ref_obscured(&args, &planes, 32, 32, &error, &unsure) == 0.0);
    for (size_t i = 0; i < picture.count; i++) { // a pit of radius 8 pixels, 10 deep
        double dx = (double)(i % 65) - 32.0, dy = (double)(i / 65) - 32.0;
        if (dx * dx + dy * dy > 64.0)
            picture.keys[i] = ref_key((float)(5.0 - 10.0 * width), (uint32_t)i);
    }
    HARNESS_CHECK(h, ref_obscured(&args, &planes, 32, 32, &error, &unsure) > 0.3);
    for (size_t i = 0; i < picture.count; i++)
        if (ref_key_z(picture.keys[i]) < 4.99)
            picture.keys[i] = REF_EMPTY_KEY;
    HARNESS_CHECK(h, ref_obscured(&args, &planes, 32, 32, &error, &unsure) == 0.0);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"sanity", sanity, 1}, {"pictures of all kinds", kinds, 0}, {"shapes of planes", shapes, 0}, {"hard", hard, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
