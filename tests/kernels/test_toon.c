// SPDX-License-Identifier: GPL-3.0-or-later
// toon: numbers of bands, soft and hard edges, black albedos, no light, light far above 1.
#include "effect.h"
#include "shared/effects.h"

#include <math.h>

static struct ref_color reference(const void *args, const struct ref_planes *planes, int x, int y)
{
    return ref_toon(args, planes, x, y);
}

static const struct effect toon = {PT_KERNEL_toon, reference, "kac"};

static struct toon_args args_of(const struct view_args *view, float bands, float softness)
{
    return (struct toon_args){
        .view = *view, .bands = bands - 0.5f, .inverse = 1.0f / (bands - 0.5f), .steepness = 1.0f / softness};
}

static float *albedo_of(struct harness *h, const struct picture *picture, uint64_t seed)
{
    struct rng rng = {seed + 100};
    float *albedo = harness_alloc(h, picture->count * 16);
    for (size_t i = 0; i < picture->count; i++) {
        double kind = rng_unit(&rng);
        for (size_t c = 0; c < 3; c++)
            albedo[4 * i + c] = kind < 0.1 ? 0.0f : (float)rng_range(&rng, 0.0, 1.0);
        for (size_t c = 0; c < 3 && kind > 0.9; c++)
            picture->color[4 * i + c] = kind > 0.95 ? 0.0f : picture->color[4 * i + c] * 1000.0f;
    }
    return albedo;
}

static void kinds(struct harness *h)
{
    static const float bands[] = {2, 3, 16}, softness[] = {0.02f, 0.3f, 1.0f};
    for (int kind = 0; kind < PICTURE_KINDS; kind++) {
        struct picture picture = effect_picture(h, (uint64_t)kind, 67, 45, 1, (enum picture_kind)kind, kind % 2);
        float *albedo = albedo_of(h, &picture, (uint64_t)kind);
        struct toon_args args = args_of(&picture.view, bands[kind % 3], softness[kind / 2 % 3]);
        effect_check(h, &toon, &args, sizeof args, &picture, albedo);
    }
}

static void shapes(struct harness *h)
{
    static const uint32_t sizes[][2] = {{1, 1}, {16384, 1}, {1, 70}};
    for (size_t s = 0; s < 3; s++) {
        struct picture picture = effect_picture(h, s, sizes[s][0], sizes[s][1], 1, PICTURE_SURFACES, 0);
        float *albedo = albedo_of(h, &picture, s);
        struct toon_args args = args_of(&picture.view, 4, 0.2f);
        effect_check(h, &toon, &args, sizeof args, &picture, albedo);
    }
}

// Reference alone: what no light changed keeps its colour whatever the bands; two lights within a band look alike.
static void sanity(struct harness *h)
{
    struct rng rng = {5};
    struct picture picture = picture_random(h, &rng, picture_view(1, 1, 0), PICTURE_FLAT, 1.0);
    float albedo[4] = {picture.color[0], picture.color[1], picture.color[2], 1.0f};
    struct ref_planes planes = picture_planes(&picture);
    planes.albedo = albedo;
    for (int bands = 2; bands <= 16; bands++) {
        struct toon_args args = args_of(&picture.view, (float)bands, 0.02f);
        HARNESS_CHECK(h, fabs(ref_toon(&args, &planes, 0, 0).color[0] - (double)albedo[0]) < 1e-6 * (double)albedo[0]);
    }
    struct toon_args args = args_of(&picture.view, 3, 0.02f);
    double shown[2];
    for (int k = 0; k < 2; k++) {
        for (int c = 0; c < 3; c++)
            picture.color[c] = albedo[c] * (k ? 0.34f : 0.28f);
        shown[k] = ref_toon(&args, &planes, 0, 0).color[0];
    }
    HARNESS_CHECK(h, fabs(shown[0] - shown[1]) < 1e-6 && fabs(shown[0] / (double)albedo[0] - 0.36) < 1e-5); // (1.5 / 2.5)^2
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"sanity", sanity, 1}, {"pictures of all kinds", kinds, 0}, {"shapes of planes", shapes, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
