// SPDX-License-Identifier: GPL-3.0-or-later
// push: from every level of the pyramid to the one below, paper and refined; all pixels, and empty ones alone.
#include "harness.h"
#include "shared/filling.h"

#include <string.h>

struct level {
    struct view_args view;
    uint64_t *keys;
    uint32_t *from;
};

// Returns how many pixels took their parent's surface.
static size_t check(struct harness *h, const struct picture *picture, const struct level *fine, const struct level *coarse,
                    uint32_t refined, uint32_t background)
{
    struct push_args args = {.view = fine->view,
                             .coarse_width = coarse->view.width,
                             .coarse_height = coarse->view.height,
                             .refined = refined,
                             .background = background,
                             .from_width = picture->view.width};
    size_t count = (size_t)fine->view.width * fine->view.height, open = 0, taken = 0;
    size_t coarse_count = (size_t)coarse->view.width * coarse->view.height;
    struct pt_buffer *coarse_keys = harness_buffer(h, coarse->keys, coarse_count * 8);
    struct pt_buffer *coarse_from = harness_buffer(h, coarse->from, coarse_count * 4);
    struct pt_buffer *keys = harness_buffer(h, fine->keys, count * 8);
    struct pt_buffer *from = harness_buffer(h, fine->from, count * 4);
    struct pt_buffer *normal = harness_buffer(h, picture->normal, picture->count * 16);
    struct pt_buffer *deff = harness_buffer(h, picture->deff, picture->count * 4);
    struct pt_buffer *span = harness_buffer(h, picture->span, picture->count * 4);
    HARNESS_RUN(h, push, &args, coarse_keys, coarse_from, keys, from, normal, deff, span);
    uint64_t *got_keys = harness_read(h, keys);
    uint32_t *got_from = harness_read(h, from);
    struct ref_planes planes = picture_planes(picture);
    planes.keys = fine->keys;
    planes.from = fine->from;
    for (size_t i = 0; i < count; i++) {
        int x = (int)(i % fine->view.width), y = (int)(i / fine->view.width);
        struct ref_pixel expected = ref_push(&args, coarse->keys, coarse->from, &planes, x, y);
        double z = ref_key_z(got_keys[i]);
        taken += got_keys[i] != fine->keys[i];
        if (got_keys[i] == REF_EMPTY_KEY)
            got_from[i] = 0; // undefined there
        open += (size_t)expected.unsure;
        if (expected.unsure)
            continue;
        if (ref_key_id(got_keys[i]) != expected.id || !(z >= expected.z.lo && z <= expected.z.hi))
            harness_fail(h, "keys", x, y, "got z %.9g id %u, expected z %.9g to %.9g id %u (before: z %.9g id %u)", z,
                         ref_key_id(got_keys[i]), expected.z.lo, expected.z.hi, expected.id, ref_key_z(fine->keys[i]),
                         ref_key_id(fine->keys[i]));
        else if (got_keys[i] != REF_EMPTY_KEY && got_from[i] != expected.from)
            harness_fail(h, "from", x, y, "got %u, expected %u", got_from[i], expected.from);
    }
    harness_same(h, "keys", got_keys, count, 8, 1, fine->view.width);
    harness_same(h, "from", got_from, count, 4, 1, fine->view.width);
    int hard = refined && (picture->kind == PICTURE_TIGHT || picture->kind == PICTURE_GRAZING);
    harness_unsure(h, open, count, hard ? TOL_UNSURE_HARD : TOL_UNSURE_SHARE);
    return taken;
}

static void pyramid(struct harness *h, uint32_t width, uint32_t height, int perspective, enum picture_kind kind, double density,
                    uint32_t refined)
{
    struct rng rng = {width * 1000u + (uint64_t)kind * 10 + refined};
    struct picture picture = picture_random(h, &rng, picture_view(width, height, perspective), kind, density);
    for (size_t i = 0; i < picture.count; i++) // sparse surfaces, which are pushed, beside dense ones, which are not
        picture.span[i] *= i % 3 ? 8.0f : 1.0f;
    struct level levels[4] = {{picture.view, picture.keys, picture.from}};
    for (int l = 1; l < 4; l++) {
        levels[l] = levels[l - 1];
        picture_pull(h, &levels[l].view, &levels[l].keys, &levels[l].from);
    }
    size_t taken = 0, alone = 0;
    for (int l = 2; l >= 0; l--)
        taken += check(h, &picture, &levels[l], &levels[l + 1], refined, 0);
    HARNESS_CHECK(h, taken || width * height < 2000 || height == 1);
    for (int l = 2; l >= 0; l--)
        alone += check(h, &picture, &levels[l], &levels[l + 1], refined, 1);
    HARNESS_CHECK(h, alone <= taken);
}

static void kinds(struct harness *h)
{
    for (int p = 0; p < 2; p++)
        for (int kind = 0; kind < PICTURE_KINDS; kind++)
            for (uint32_t refined = 0; refined < 2; refined++)
                pyramid(h, 93, 70, p, (enum picture_kind)kind, kind % 2 ? 0.1 : 0.4, refined);
}

static void shapes(struct harness *h)
{
    static const uint32_t sizes[][2] = {{1, 1}, {2, 2}, {16384, 1}, {1, 99}, {64, 64}, {17, 5}};
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++)
        pyramid(h, sizes[s][0], sizes[s][1], 1, PICTURE_NOISE, 0.5, 1);
}

// Reference alone: parent and two of three, no less, and never a dense surface.
static void sanity(struct harness *h)
{
    uint32_t from[36] = {0}, coarse_from[9] = {0};
    uint64_t fine[36], coarse[9];
    float normal[4] = {0, 0, 1, 1}, deff[1] = {0.0f};
    for (int cells = 0; cells < 32; cells++) { // parent, horizontal, vertical, diagonal; dense
        deff[0] = cells & 16 ? 0.23f : 0.25f;  // of pixels that are 0.1 wide: K times 1.15 or 1.25 pixels
        for (int i = 0; i < 36; i++)
            fine[i] = REF_EMPTY_KEY;
        for (int i = 0; i < 9; i++)
            coarse[i] = REF_EMPTY_KEY;
        const int at[4] = {4, 5, 7, 8};
        for (int i = 0; i < 4; i++)
            if (cells >> i & 1)
                coarse[at[i]] = ref_key(2.0f, 7);
        struct push_args args = {.view = {.width = 6, .height = 6, .footprint = 0.1f}, .coarse_width = 3, .coarse_height = 3};
        struct ref_planes planes = {.keys = fine, .from = from, .normal = normal, .deff = deff, .span = deff};
        struct ref_pixel pixel = ref_push(&args, coarse, coarse_from, &planes, 3, 3);
        int sides = (cells >> 1 & 1) + (cells >> 2 & 1) + (cells >> 3 & 1);
        HARNESS_CHECK(h, (pixel.id == 7) == ((cells & 1) && sides >= 2 && !(cells & 16)));
    }
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"sanity", sanity, 1},
        {"pyramids of all kinds", kinds, 0},
        {"shapes of planes", shapes, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
