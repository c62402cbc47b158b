// SPDX-License-Identifier: GPL-3.0-or-later
// fog: before, within and beyond its range, thin and thick, over opaque and translucent pixels.
#include "effect.h"
#include "shared/effects.h"

#include <math.h>

static struct ref_color reference(const void *args, const struct ref_planes *planes, int x, int y)
{
    return ref_fog(args, planes, x, y);
}

static const struct effect fog = {PT_KERNEL_fog, reference, "kc"};

static struct fog_args args_of(const struct view_args *view, float start, float end, float density)
{
    return (struct fog_args){
        .view = *view, .start = start, .inverse = 1.0f / (end - start), .density = density, .color = {0.6f, 0.7f, 40.0f}};
}

static void kinds(struct harness *h)
{
    for (int p = 0; p < 2; p++)
        for (int kind = 0; kind < PICTURE_KINDS; kind++) {
            struct picture picture = effect_picture(h, (uint64_t)kind, 67, 45, p, (enum picture_kind)kind, kind % 2);
            struct fog_args args = args_of(&picture.view, 3.0f, 5.5f, 0.8f);
            effect_check(h, &fog, &args, sizeof args, &picture, NULL);
        }
}

static void hard(struct harness *h)
{
    static const float ranges[][3] = {{0, 1e-6f, 1}, {-1e6f, 1e6f, 1}, {1e6f, 2e6f, 1}, {5, 5.0001f, 0.5f}};
    static const uint32_t sizes[][2] = {{67, 45}, {1, 1}, {16384, 1}, {1, 70}};
    for (size_t r = 0; r < 4; r++) {
        struct picture picture = effect_picture(h, r, sizes[r][0], sizes[r][1], 1, PICTURE_RANGE, 1);
        struct fog_args args = args_of(&picture.view, ranges[r][0], ranges[r][1], ranges[r][2]);
        effect_check(h, &fog, &args, sizeof args, &picture, NULL);
    }
}

// Reference alone: nothing at the start, the fog's colour times alpha at the end.
static void sanity(struct harness *h)
{
    struct rng rng = {5};
    struct picture picture = picture_random(h, &rng, picture_view(1, 1, 0), PICTURE_FLAT, 1.0);
    struct ref_planes planes = picture_planes(&picture);
    struct fog_args args = args_of(&picture.view, 5.0f, 7.0f, 1.0f);
    HARNESS_CHECK(h, ref_fog(&args, &planes, 0, 0).color[0] == (double)picture.color[0]);
    picture.keys[0] = ref_key(8.0f, 1);
    picture.color[3] = 0.5f;
    HARNESS_CHECK(h, fabs(ref_fog(&args, &planes, 0, 0).color[0] - 0.3) < 1e-7);
    HARNESS_CHECK(h, ref_fog(&args, &planes, 0, 0).color[3] == 0.5);
    // in perspective what lies aside is farther: 3, 4 and 12 are 13
    args = args_of(&picture.view, 12.0f, 14.0f, 1.0f);
    args.view.perspective = 1;
    args.view.ray_x0 = 0.25f;
    args.view.ray_y0 = 1.0f / 3.0f;
    args.view.ray_xs = args.view.ray_ys = 0.0f;
    picture.keys[0] = ref_key(12.0f, 1);
    picture.color[0] = 0.0f;
    HARNESS_CHECK(h, fabs(ref_fog(&args, &planes, 0, 0).color[0] - 0.5 * 0.5 * 0.6) < 1e-6);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {{"sanity", sanity, 1}, {"pictures of all kinds", kinds, 0}, {"hard", hard, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
