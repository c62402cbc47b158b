// SPDX-License-Identifier: GPL-3.0-or-later
// coarsen: cells are emptied, and take the least limit of their pixels.
#include "harness.h"
#include "shared/ranges.h"

#include <math.h>
#include <string.h>

static void check(struct harness *h, uint32_t width, uint32_t height, int32_t origin, float pixel, int behind)
{
    struct rng rng = {width + (uint64_t)(100.0f * pixel)};
    const size_t pixels = (size_t)width * height;
    struct coarsen_args args = {.width = width,
                                .height = height,
                                .origin_x = origin,
                                .origin_y = 2 * origin,
                                .pixel = pixel,
                                .behind = (uint32_t)behind};
    args.view.origin_x = (int32_t)floor(args.origin_x / (double)pixel) - 1;
    args.view.origin_y = (int32_t)floor(args.origin_y / (double)pixel) - 1;
    args.view.width = (uint32_t)(floor((args.origin_x + (double)width) / (double)pixel) + 2.0 - args.view.origin_x);
    args.view.height = (uint32_t)(floor((args.origin_y + (double)height) / (double)pixel) + 2.0 - args.view.origin_y);
    args.view.rect[0] = args.view.width > 4;
    args.view.rect[2] = args.view.width;
    args.view.rect[3] = args.view.height - (args.view.height > 4);
    const size_t cells = (size_t)args.view.width * args.view.height;
    float *limits = harness_alloc(h, pixels * 4), *before = harness_alloc(h, cells * 4);
    uint64_t *keys = harness_alloc(h, cells * 8);
    for (size_t i = 0; i < pixels; i++)
        limits[i] = rng_below(&rng, 4) ? (float)rng_range(&rng, 1.0, 9.0) : INFINITY;
    for (size_t i = 0; i < cells; i++) {
        before[i] = -1.0f;
        keys[i] = 77;
    }
    struct pt_buffer *made = harness_buffer(h, keys, cells * 8), *limit = harness_buffer(h, limits, pixels * 4);
    struct pt_buffer *beyond = harness_buffer(h, before, cells * 4);
    HARNESS_RUN(h, coarsen, &args, made, behind ? limit : NULL, behind ? beyond : NULL);
    const uint64_t *got_keys = harness_read(h, made);
    const float *got = harness_read(h, beyond);
    harness_same(h, "beyond", got, cells, 4, 1, args.view.width);
    for (uint32_t y = 0; y < args.view.height; y++)
        for (uint32_t x = 0; x < args.view.width; x++) {
            const size_t at = (size_t)y * args.view.width + x;
            const int inside = x >= args.view.rect[0] && x < args.view.rect[2] && y < args.view.rect[3];
            const struct ref_range expected = ref_coarsen(&args, limits, (int)x, (int)y);
            if (got_keys[at] != (inside ? REF_EMPTY_KEY : 77))
                harness_fail(h, "keys", (int)x, (int)y, "got %llx", (unsigned long long)got_keys[at]);
            if (!inside || !behind ? got[at] != -1.0f : !((double)got[at] >= expected.lo && (double)got[at] <= expected.hi))
                harness_fail(h, "beyond", (int)x, (int)y, "got %.9g, expected %.9g to %.9g", (double)got[at], expected.lo,
                             expected.hi);
        }
}

static void sizes(struct harness *h)
{
    static const uint32_t shapes[][2] = {{67, 45}, {1, 1}, {300, 1}, {1, 70}};
    static const float pixels[] = {1.0f, 1.37f, 2.0f, 3.5f, 64.0f, 4096.0f};
    for (size_t s = 0; s < 4; s++)
        for (size_t p = 0; p < 6; p++)
            for (int behind = 0; behind < 2; behind++)
                check(h, shapes[s][0], shapes[s][1], (int32_t)(5 * s), pixels[p], behind);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {{"sizes", sizes, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
