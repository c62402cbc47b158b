// SPDX-License-Identifier: GPL-3.0-or-later
// reveal: how far scans lie apart, of measured pixels and of those that show the surface of another; whole and cropped.
#include "harness.h"
#include "shared/picture.h"

#include <string.h>

static void check(struct harness *h, enum picture_kind kind, const uint32_t crop[4], uint32_t first)
{
    struct rng rng = {(uint64_t)kind + 10 * first};
    struct picture picture = picture_random(h, &rng, picture_view(67, 45, kind % 2), kind, 0.6);
    picture_invent(&picture, &rng, 0.5, 3);
    const uint32_t count = (uint32_t)picture.count;
    const size_t inside = (size_t)crop[2] * crop[3];
    struct reveal_args args = {.view = picture.view,
                               .instance = {.id_base = picture.id_base, .id_first = count / 8, .id_count = count / 2},
                               .crop_x = crop[0],
                               .crop_y = crop[1],
                               .crop_width = crop[2],
                               .first = first};
    const uint32_t rect[4] = {crop[0], crop[1], crop[0] + crop[2], crop[1] + crop[3]};
    memcpy(args.view.rect, rect, sizeof rect);
    float *apart = harness_alloc(h, picture.count * 4), *unset = harness_alloc(h, inside * 4);
    size_t ours = 0;
    for (size_t i = 0; i < picture.count; i++)
        apart[i] = (float)rng_range(&rng, 0.5, 1.5);
    for (size_t i = 0; i < picture.count; i++)
        if (picture.keys[i] != REF_EMPTY_KEY && rng_below(&rng, 4) == 0)
            picture.from[i] |= PT_FROM_MIXED;
    for (size_t i = 0; i < inside; i++)
        unset[i] = -77.0f;
    struct pt_buffer *keys = harness_buffer(h, picture.keys, picture.count * 8);
    struct pt_buffer *from = harness_buffer(h, picture.from, picture.count * 4);
    struct pt_buffer *told = harness_buffer(h, apart, picture.count * 4), *out = harness_buffer(h, unset, inside * 4);
    HARNESS_RUN(h, reveal, &args, keys, from, told, out);
    const float *got = harness_read(h, out);
    const struct ref_planes planes = picture_planes(&picture);
    for (size_t i = 0; i < inside; i++) {
        const int x = (int)(i % crop[2] + crop[0]), y = (int)(i / crop[2] + crop[1]);
        const struct ref_reveal expected = ref_reveal(&args, &planes, apart, x, y);
        const double wanted = expected.written ? expected.apart : -77.0;
        ours += expected.apart > 0.0;
        if ((double)got[i] != wanted)
            harness_fail(h, "disagreement", x, y, "got %.9g, expected %.9g", got[i], wanted);
    }
    HARNESS_CHECK(h, inside < 100 || ours > inside / 20);
    harness_same(h, "disagreement", got, inside, 4, 1, crop[2]);
}

static void pictures(struct harness *h)
{
    static const uint32_t crops[][4] = {{0, 0, 67, 45}, {5, 3, 40, 30}, {66, 44, 1, 1}};
    for (int kind = 0; kind < PICTURE_KINDS; kind++)
        for (uint32_t k = 0; k < 6; k++)
            check(h, (enum picture_kind)kind, crops[k % 3], k / 3);
}

// Reference alone: a pixel that shows another's surface, and one of nothing.
static void sanity(struct harness *h)
{
    const uint64_t keys[3] = {ref_key(5.0f, 7), ref_key(5.0f, 7), REF_EMPTY_KEY};
    const uint32_t from[3] = {0, 0, 77};
    const float apart[3] = {0.25f, 9.0f, 9.0f};
    const struct reveal_args args = {.view = {.width = 3, .height = 1}, .instance = {.id_base = 7, .id_count = 1}};
    const struct ref_planes planes = {.keys = keys, .from = from};
    HARNESS_CHECK(h, ref_reveal(&args, &planes, apart, 1, 0).apart == 0.25);
    HARNESS_CHECK(h, !ref_reveal(&args, &planes, apart, 2, 0).written);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {{"sanity", sanity, 1}, {"pictures", pictures, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
