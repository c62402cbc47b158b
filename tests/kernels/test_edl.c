// SPDX-License-Identifier: GPL-3.0-or-later
// edl: radii, perspective and orthographic views, depths over seven decades, silhouettes, points from dense to sparse.
#include "effect.h"
#include "shared/effects.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct ref_color reference(const void *args, const struct ref_planes *planes, int x, int y)
{
    return ref_edl(args, planes, x, y);
}

static const struct effect edl = {PT_KERNEL_edl, reference, "kfdnc"};

static struct edl_args args_of(const struct view_args *view, int radius, float scale, float gain)
{
    static const int8_t ring[16] = {1, 0, 1, 1, 0, 1, -1, 1, -1, 0, -1, -1, 0, -1, 1, -1};
    struct edl_args args = {.view = *view, .scale = scale};
    for (int k = 0; k < PT_EDL_RADII; k++) {
        const int wider = radius << k < PT_EDL_MOST ? radius << k : PT_EDL_MOST;
        for (int i = 0; i < 16; i++)
            args.offsets[16 * k + i] = ring[i] * wider;
        args.gain[k] = gain * (float)radius / (float)wider;
        args.wide[k] = 1.87f * (float)wider; // no picture has surfaces just so wide
        args.reach = (uint32_t)wider;
        args.narrow = 1.0f / args.wide[k];
    }
    return args;
}

// Makes d_eff of each row so many footprints of its surface as the row says, from 2^-3 to 2^9, but of none smaller.
static void spread(struct picture *picture)
{
    for (size_t i = 0; i < picture->count; i++) {
        const int y = (int)(i / picture->view.width);
        if (picture->keys[i] != REF_EMPTY_KEY)
            picture->deff[i] = (float)(ref_footprint(&picture->view, ref_key_z(picture->keys[i])) * exp2(y % 25 / 2.0 - 3.1));
    }
}

static void widths(struct harness *h)
{
    static const int radii[] = {1, 2, 16, PT_EDL_MOST};
    for (int p = 0; p < 2; p++)
        for (int kind = 0; kind < PICTURE_KINDS; kind++)
            for (int r = 0; r < 4; r++) {
                struct picture picture = effect_picture(h, (uint64_t)(kind + 40), 67, 75, p, (enum picture_kind)kind, r == 1);
                struct edl_args args = args_of(&picture.view, radii[r], p ? 300.0f : 5.0f, 0.1f);
                spread(&picture);
                effect_check(h, &edl, &args, sizeof args, &picture, NULL);
            }
}

static void kinds(struct harness *h)
{
    static const int radii[] = {1, 3, PT_EDL_MOST};
    for (int p = 0; p < 2; p++)
        for (int kind = 0; kind < PICTURE_KINDS; kind++)
            for (int r = 0; r < 3; r++) {
                struct picture picture = effect_picture(h, (uint64_t)kind, 67, 45, p, (enum picture_kind)kind, r == 1);
                struct edl_args args = args_of(&picture.view, radii[r], p ? 300.0f : 5.0f, 0.05f * (float)(r + 1));
                effect_check(h, &edl, &args, sizeof args, &picture, NULL);
            }
}

// Faces of panoramas: depths are distances from the eye.
static void faces(struct harness *h)
{
    for (int kind = 0; kind < PICTURE_KINDS; kind++)
        for (int r = 0; r < 2; r++) {
            struct picture picture = effect_picture(h, (uint64_t)(kind + 80), 67, 45, 1, (enum picture_kind)kind, r == 1);
            struct edl_args args = args_of(&picture.view, r ? 16 : 1, 300.0f, 0.1f);
            args.from_eye = 1;
            effect_check(h, &edl, &args, sizeof args, &picture, NULL);
        }
}

static void shapes(struct harness *h)
{
    static const uint32_t sizes[][2] = {{1, 1}, {16384, 1}, {1, 70}, {64, 64}};
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        struct picture picture = effect_picture(h, s, sizes[s][0], sizes[s][1], 1, PICTURE_SURFACES, 0);
        struct edl_args args = args_of(&picture.view, 2, 300.0f, 0.1f);
        effect_check(h, &edl, &args, sizeof args, &picture, NULL);
    }
}

// Orthographic pixels of 1e-6 and 1e6: scales that leave float32 where they are multiplied.
static void scales(struct harness *h)
{
    static const float scale[] = {1e9f, 4e5f, 1e-6f, 1e-30f};
    for (size_t s = 0; s < sizeof scale / sizeof scale[0]; s++) {
        struct picture picture = effect_picture(h, s, 67, 45, 0, PICTURE_RANGE, 0);
        struct edl_args args = args_of(&picture.view, 1, scale[s], 1.0f);
        effect_check(h, &edl, &args, sizeof args, &picture, NULL);
    }
}

static void rectangle(struct harness *h)
{
    struct picture picture = effect_picture(h, 4, 67, 45, 1, PICTURE_SURFACES, 0);
    const uint32_t rect[4] = {3, 2, 50, 30};
    memcpy(picture.view.rect, rect, sizeof rect);
    for (size_t i = 0; i < picture.count; i++) { // nothing lies outside it
        uint32_t x = (uint32_t)(i % 67), y = (uint32_t)(i / 67);
        if (x < rect[0] || x >= rect[2] || y < rect[1] || y >= rect[3])
            picture.keys[i] = REF_EMPTY_KEY;
    }
    struct edl_args args = args_of(&picture.view, 2, 300.0f, 0.1f);
    effect_check(h, &edl, &args, sizeof args, &picture, NULL);
}

// Reference alone: one depth stays as bright as it was, what lies behind is darker and what lies before is not.
static void sanity(struct harness *h)
{
    struct rng rng = {5};
    struct picture picture = picture_random(h, &rng, picture_view(5, 5, 1), PICTURE_FLAT, 1.0);
    struct edl_args args = args_of(&picture.view, 1, 300.0f, 0.1f);
    struct ref_planes planes = picture_planes(&picture);
    double whole = picture.color[4 * 12];
    HARNESS_CHECK(h, ref_edl(&args, &planes, 2, 2).color[0] == whole);
    HARNESS_CHECK(h, ref_edl(&args, &planes, 0, 0).color[0] == (double)picture.color[0]); // beyond the plane nothing is known
    picture.keys[12] = ref_key(5.005f, 1);
    HARNESS_CHECK(h, fabs(ref_edl(&args, &planes, 2, 2).color[0] / whole - exp2(-0.8 * 300.0 * log2(1.001))) < 1e-5);
    picture.keys[12] = ref_key(4.995f, 1);
    HARNESS_CHECK(h, ref_edl(&args, &planes, 2, 2).color[0] == whole);
    picture.keys[13] = REF_EMPTY_KEY; // one of eight is a silhouette
    const double edge = exp2(-(double)args.gain[0] * (double)PT_EDL_STEP);
    HARNESS_CHECK(h, fabs(ref_edl(&args, &planes, 2, 2).color[0] / whole - edge) < 1e-9);
    // the wider what it shows, the farther away its neighbours are, till they are beyond the plane; then it fades
    const float footprint = (float)ref_footprint(&picture.view, ref_key_z(picture.keys[12]));
    for (size_t i = 0; i < picture.count; i++) {
        const float toward[4] = {0.0f, 0.0f, 1.0f, 1.0f};
        memcpy(picture.normal + 4 * i, toward, sizeof toward);
        picture.from[i] = (uint32_t)i;
        picture.deff[i] = 3.7f * footprint;
    }
    HARNESS_CHECK(h, ref_edl(&args, &planes, 2, 2).color[0] == whole);
    picture.keys[14] = REF_EMPTY_KEY; // twice as far, half as dark
    HARNESS_CHECK(h, fabs(ref_edl(&args, &planes, 2, 2).color[0] / whole - sqrt(edge)) < 1e-9);
    for (size_t i = 0; i < picture.count; i++)
        picture.deff[i] = 7.4f * footprint;
    HARNESS_CHECK(h, ref_edl(&args, &planes, 2, 2).color[0] == whole);
    for (size_t i = 0; i < picture.count; i++)
        picture.deff[i] = 17.0f * footprint;
    HARNESS_CHECK(h, ref_edl(&args, &planes, 2, 2).color[0] == whole);
    picture.deff[11] = 1.0f * footprint; // beside what is dense it is as there
    HARNESS_CHECK(h, fabs(ref_edl(&args, &planes, 2, 2).color[0] / whole - edge) < 1e-9);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"sanity", sanity, 1},
        {"pictures of all kinds", kinds, 0},
        {"shapes of planes", shapes, 0},
        {"scales", scales, 0},
        {"dense and sparse points", widths, 0},
        {"rectangle", rectangle, 0},
        {"faces of panoramas", faces, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
