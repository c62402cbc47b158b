// SPDX-License-Identifier: GPL-3.0-or-later
#include "effect.h"

#include <math.h>
#include <string.h>

static void check(struct harness *h, const struct effect *effect, const void *args, size_t size, const struct picture *picture,
                  const float *albedo, const float *slopes)
{
    size_t count = picture->count, open = 0;
    float *before = harness_alloc(h, count * 16);
    memcpy(before, picture->color, count * 16);
    for (size_t i = 0; i < count; i++)
        for (size_t c = 0; c < 4 && picture->keys[i] == REF_EMPTY_KEY; c++)
            before[4 * i + c] = NAN;
    struct pt_buffer *color = harness_buffer(h, before, count * 16), *bound[8];
    uint32_t bindings = 0;
    for (const char *b = effect->buffers; *b; b++)
        bound[bindings++] = *b == 'k'   ? harness_buffer(h, picture->keys, count * 8)
                            : *b == 'f' ? harness_buffer(h, picture->from, count * 4)
                            : *b == 'd' ? harness_buffer(h, picture->deff, count * 4)
                            : *b == 'n' ? harness_buffer(h, picture->normal, count * 16)
                            : *b == 'a' ? harness_buffer(h, albedo, count * 16)
                            : *b == 's' ? (slopes ? harness_buffer(h, slopes, count * 16) : NULL)
                                        : color;
    harness_run(h, effect->kernel, args, size, bound, bindings);
    const float *got = harness_read(h, color);
    struct ref_planes planes = picture_planes(picture);
    planes.shading = picture->normal;
    planes.albedo = albedo;
    planes.slopes = slopes;
    for (size_t i = 0; i < count; i++) {
        int x = (int)(i % picture->view.width), y = (int)(i / picture->view.width);
        if (picture->keys[i] == REF_EMPTY_KEY) {
            if (memcmp(got + 4 * i, before + 4 * i, 16) != 0)
                harness_fail(h, "color", x, y, "an empty pixel was written");
            continue;
        }
        struct ref_color expected = effect->reference(args, &planes, x, y);
        open += (size_t)expected.unsure;
        for (int c = 0; c < 4 && !expected.unsure; c++)
            if (!harness_near(got[4 * i + (size_t)c], expected.color[c], expected.error[c]))
                harness_fail(h, "color", x, y, "channel %d: got %.9g, expected %.9g +- %.2g", c, got[4 * i + (size_t)c],
                             expected.color[c], expected.error[c]);
    }
    harness_unsure(h, open, count, TOL_UNSURE_SHARE);
}

void effect_check(struct harness *h, const struct effect *effect, const void *args, size_t size, const struct picture *picture,
                  const float *albedo)
{
    check(h, effect, args, size, picture, albedo, NULL);
}

void effect_check_slopes(struct harness *h, const struct effect *effect, const void *args, size_t size,
                         const struct picture *picture, const float *slopes)
{
    check(h, effect, args, size, picture, NULL, slopes);
}

struct picture effect_picture(struct harness *h, uint64_t seed, uint32_t width, uint32_t height, int perspective,
                              enum picture_kind kind, int translucent)
{
    struct rng rng = {seed};
    struct picture picture = picture_random(h, &rng, picture_view(width, height, perspective), kind, kind % 2 ? 0.9 : 0.5);
    picture_invent(&picture, &rng, 0.5, 4);
    for (size_t i = 0; i < picture.count && translucent; i++) {
        float opacity = rng_below(&rng, 2) ? 0.3f : (float)rng_below(&rng, 2);
        for (size_t c = 0; c < 4; c++)
            picture.color[4 * i + c] *= opacity;
    }
    return picture;
}
