// SPDX-License-Identifier: GPL-3.0-or-later
// pull: exact, hence compared bit by bit.
#include "harness.h"
#include "shared/filling.h"

static void check(struct harness *h, const struct view_args *fine, const uint64_t *keys, const uint32_t *from)
{
    struct pull_args args = {.view = *fine, .fine_width = fine->width, .fine_height = fine->height};
    args.view.width = (fine->width + 1) / 2;
    args.view.height = (fine->height + 1) / 2;
    args.view.level++;
    args.view.rect[2] = args.view.width;
    args.view.rect[3] = args.view.height;
    size_t fine_count = (size_t)fine->width * fine->height, count = (size_t)args.view.width * args.view.height;
    struct pt_buffer *fine_keys = harness_buffer(h, keys, fine_count * 8);
    struct pt_buffer *fine_from = harness_buffer(h, from, fine_count * 4);
    struct pt_buffer *coarse_keys = harness_buffer(h, NULL, count * 8);
    struct pt_buffer *coarse_from = harness_buffer(h, NULL, count * 4);
    HARNESS_RUN(h, pull, &args, fine_keys, fine_from, coarse_keys, coarse_from);
    const uint64_t *got_keys = harness_read(h, coarse_keys);
    const uint32_t *got_from = harness_read(h, coarse_from);
    for (size_t i = 0; i < count; i++) {
        int x = (int)(i % args.view.width), y = (int)(i / args.view.width);
        uint64_t key;
        uint32_t source;
        ref_pull(&args, keys, from, x, y, &key, &source);
        if (got_keys[i] != key)
            harness_fail(h, "keys", x, y, "got %016llx, expected %016llx", (unsigned long long)got_keys[i],
                         (unsigned long long)key);
        if (key != REF_EMPTY_KEY && got_from[i] != source)
            harness_fail(h, "from", x, y, "got %u, expected %u", got_from[i], source);
    }
}

static void levels(struct harness *h)
{
    static const uint32_t shapes[][2] = {{67, 45}, {1, 1}, {2, 2}, {16384, 1}, {1, 77}, {128, 64}, {33, 2}};
    for (size_t s = 0; s < sizeof shapes / sizeof shapes[0]; s++) {
        for (int kind = 0; kind < PICTURE_KINDS; kind++) {
            struct rng rng = {s * 100 + (uint64_t)kind};
            if (s == 3 && kind > 1)
                continue;
            struct picture picture = picture_random(h, &rng, picture_view(shapes[s][0], shapes[s][1], 1),
                                                    (enum picture_kind)kind, kind % 2 ? 0.3 : 0.9);
            struct view_args view = picture.view;
            uint64_t *keys = picture.keys;
            uint32_t *from = picture.from;
            for (int level = 0; level < 2 && (level == 0 || s == 0); level++) {
                check(h, &view, keys, from);
                picture_pull(h, &view, &keys, &from);
            }
        }
    }
}

static void sanity(struct harness *h)
{
    const uint64_t keys[6] = {ref_key(2.0f, 1), ref_key(2.0f, 0), ref_key(1.0f, 9),
                              REF_EMPTY_KEY,    REF_EMPTY_KEY,    REF_EMPTY_KEY};
    const uint32_t from[6] = {0, 1, 2, 3, 4, 5};
    struct pull_args args = {.fine_width = 3, .fine_height = 2};
    uint64_t key;
    uint32_t source;
    ref_pull(&args, keys, from, 0, 0, &key, &source);
    HARNESS_CHECK(h, key == keys[1] && source == 1);
    ref_pull(&args, keys, from, 1, 0, &key, &source);
    HARNESS_CHECK(h, key == keys[2] && source == 2);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"sanity", sanity, 1},
        {"two levels of pictures of all kinds and shapes", levels, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
