// SPDX-License-Identifier: GPL-3.0-or-later
// mark: exactly the points that the picture shows.
#include "marks.h"
#include "shared/shadows.h"

#include <string.h>

static void check(struct harness *h, const struct picture *picture, const uint32_t rect[4])
{
    struct mark_args args = {.view = picture->view, .id_base = picture->id_base};
    const uint32_t slots = (uint32_t)(picture->count * 3 / 4); // the other ids belong to somebody else
    args.id_first = slots / 8;                                 // and those before these
    args.id_count = slots - args.id_first;
    memcpy(args.view.rect, rect, sizeof args.view.rect);
    const size_t size = marks_size(slots + 1);
    uint32_t *before = harness_alloc(h, size);
    struct pt_buffer *keys = harness_buffer(h, picture->keys, picture->count * 8);
    struct pt_buffer *marks = harness_buffer(h, before, size);
    HARNESS_RUN(h, mark, &args, keys, marks);
    const uint32_t *got = harness_read(h, marks);
    struct ref_planes planes = picture_planes(picture);
    for (uint32_t id = 0; id < slots; id++)
        if (ref_shown(got, id) != (id >= args.id_first && ref_mark(&args, &planes, id)))
            harness_fail(h, "mark", (int)id, 0, "got %d", ref_shown(got, id));
    for (uint32_t i = slots; i < size / 8 * PT_MARK_SLOTS; i++)
        if (ref_shown(got, i))
            harness_fail(h, "beyond", (int)i, 0, "was marked");
    for (size_t i = 0; i < size / 8; i++)
        if (got[2 * i + 1])
            harness_fail(h, "rank", (int)i, 0, "was written");
}

static void pictures(struct harness *h)
{
    static const uint32_t sizes[][2] = {{67, 45}, {1, 1}, {300, 1}, {1, 70}};
    for (size_t s = 0; s < 4; s++) {
        struct rng rng = {s};
        struct picture picture = picture_random(h, &rng, picture_view(sizes[s][0], sizes[s][1], 1), PICTURE_SURFACES, 0.5);
        picture_invent(&picture, &rng, 0.5, 5); // points that several pixels show
        const uint32_t whole[4] = {0, 0, sizes[s][0], sizes[s][1]};
        check(h, &picture, whole);
    }
}

static void rectangle(struct harness *h)
{
    static const uint32_t rect[4] = {5, 7, 38, 40}, empty[4] = {20, 20, 20, 30};
    struct rng rng = {5};
    struct picture picture = picture_random(h, &rng, picture_view(67, 45, 1), PICTURE_SURFACES, 0.9);
    check(h, &picture, rect);
    check(h, &picture, empty);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"pictures", pictures, 0},
        {"rectangle", rectangle, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
