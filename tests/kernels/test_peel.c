// SPDX-License-Identifier: GPL-3.0-or-later
// peel: limits, what comes through and keys bit by bit, blended colours within the table, tiles counted again.
#include "harness.h"
#include "shared/colors.h"

#include <math.h>
#include <string.h>

enum { TILE = 1 << PT_TILE_LEVEL };

struct setup {
    struct picture picture;
    struct peel_args args;
    float *shading, *limit, *through, *over;
};

// A layer before which others may lie: limits around its own depth, some of them that depth itself.
static struct setup make(struct harness *h, struct rng *rng, struct picture picture, int first, int stop)
{
    static const float opacities[] = {0.0f, 1.0f, 0.3f, 0.5f, 0.998f};
    struct setup s = {.picture = picture, .args = {.view = picture.view, .first = first != 0, .stop = stop != 0}};
    size_t count = picture.count;
    s.shading = harness_alloc(h, count * 16);
    s.limit = harness_alloc(h, count * 4);
    s.through = harness_alloc(h, count * 4);
    s.over = harness_alloc(h, count * 16);
    for (size_t i = 0; i < count; i++) {
        float opacity = rng_below(rng, 2) ? opacities[rng_below(rng, 5)] : (float)rng_unit(rng);
        float z = (float)ref_key_z(picture.keys[i]);
        if (picture.keys[i] == REF_EMPTY_KEY) { // undefined there
            for (size_t c = 0; c < 4; c++)
                picture.color[4 * i + c] = s.shading[4 * i + c] = NAN;
            z = 5.0f;
        } else {
            s.shading[4 * i + 3] = opacity;
            for (size_t c = 0; c < 4; c++)
                picture.color[4 * i + c] *= opacity;
            picture.from[i] |= rng_below(rng, 8) ? 0u : PT_FROM_MIXED;
        }
        uint32_t kind = rng_below(rng, 6);
        s.limit[i] = first       ? NAN
                     : kind == 0 ? INFINITY
                     : kind == 1 ? z
                     : kind == 2 ? float_step(z, (int)rng_below(rng, 17) - 8)
                                 : z * (float)rng_range(rng, 0.5, 1.1);
        s.through[i] = first ? NAN : rng_below(rng, 3) ? (float)rng_unit(rng) : (float)rng_range(rng, 0.0, 0.004);
        for (size_t c = 0; c < 4; c++)
            s.over[4 * i + c] = first ? NAN : (float)rng_unit(rng);
    }
    return s;
}

static void check_tiles(struct harness *h, const struct setup *s, const float *limit, const uint8_t *covered,
                        const uint32_t *tiles)
{
    const struct view_args *view = &s->args.view;
    const uint32_t *rect = view->rect, columns = (view->width + TILE - 1) / TILE;
    for (uint32_t ty = rect[1] / TILE; ty * TILE < rect[3]; ty++)
        for (uint32_t tx = rect[0] / TILE; tx * TILE < rect[2]; tx++) {
            float least = INFINITY, got;
            uint32_t count = 0;
            for (uint32_t i = 0; i < TILE * TILE; i++) {
                uint32_t x = tx * TILE + i % TILE, y = ty * TILE + i / TILE;
                if (x < rect[0] || x >= rect[2] || y < rect[1] || y >= rect[3])
                    continue;
                least = fminf(least, limit[(size_t)y * view->width + x]);
                count += covered[(size_t)y * view->width + x];
            }
            const uint32_t *tile = tiles + 2 * ((size_t)ty * columns + tx);
            memcpy(&got, tile, 4);
            if (got != least || tile[1] != count)
                harness_fail(h, "tile", (int)tx, (int)ty, "got %.9g and %u pixels, expected %.9g and %u", got, tile[1], least,
                             count);
        }
}

static void check(struct harness *h, const struct setup *s)
{
    const struct picture *picture = &s->picture;
    const struct view_args *view = &s->args.view;
    size_t count = picture->count;
    size_t tile_bytes = (size_t)((view->width + TILE - 1) / TILE) * ((view->height + TILE - 1) / TILE) * 8;
    struct pt_buffer *keys = harness_buffer(h, picture->keys, count * 8);
    struct pt_buffer *from = harness_buffer(h, picture->from, count * 4);
    struct pt_buffer *deff = harness_buffer(h, picture->deff, count * 4);
    struct pt_buffer *shading = harness_buffer(h, s->shading, count * 16);
    struct pt_buffer *color = harness_buffer(h, picture->color, count * 16);
    struct pt_buffer *limit = harness_buffer(h, s->limit, count * 4);
    struct pt_buffer *through = harness_buffer(h, s->through, count * 4);
    struct pt_buffer *over = harness_buffer(h, s->over, count * 16);
    struct pt_buffer *tiles = harness_buffer(h, NULL, tile_bytes);
    HARNESS_RUN(h, peel, &s->args, keys, from, deff, shading, color, limit, through, over, tiles);
    const uint64_t *got_keys = harness_read(h, keys);
    const float *got_limit = harness_read(h, limit), *got_through = harness_read(h, through);
    const float *got_over = harness_read(h, over);
    struct ref_planes planes = picture_planes(picture);
    planes.shading = s->shading;
    uint8_t *covered = harness_alloc(h, count);
    for (size_t i = 0; i < count; i++) {
        uint32_t x = (uint32_t)(i % view->width), y = (uint32_t)(i / view->width);
        if (x < view->rect[0] || x >= view->rect[2] || y < view->rect[1] || y >= view->rect[3])
            continue;
        struct ref_peel expected = ref_peel(&s->args, &planes, s->limit, s->through, s->over, (int)x, (int)y);
        covered[i] = (uint8_t)expected.covered;
        if (got_keys[i] != expected.key)
            harness_fail(h, "key", (int)x, (int)y, "got %016llx, expected %016llx", (unsigned long long)got_keys[i],
                         (unsigned long long)expected.key);
        if (got_limit[i] != expected.limit)
            harness_fail(h, "limit", (int)x, (int)y, "got %.9g, expected %.9g", got_limit[i], expected.limit);
        if (got_through[i] != expected.through)
            harness_fail(h, "through", (int)x, (int)y, "got %.9g, expected %.9g", got_through[i], expected.through);
        for (int c = 0; c < 4; c++)
            if (!harness_near(got_over[4 * i + (size_t)c], expected.over[c], expected.error[c]))
                harness_fail(h, "over", (int)x, (int)y, "channel %d: got %.9g, expected %.9g +- %.2g", c,
                             got_over[4 * i + (size_t)c], expected.over[c], expected.error[c]);
    }
    check_tiles(h, s, got_limit, covered, harness_read(h, tiles));
    if (view->rect[2] - view->rect[0] == view->width && view->rect[3] - view->rect[1] == view->height) {
        harness_same(h, "keys", got_keys, count, 8, 1, view->width);
        harness_same(h, "limit", got_limit, count, 4, 1, view->width);
        harness_same(h, "through", got_through, count, 4, 1, view->width);
    }
}

static void kinds(struct harness *h)
{
    for (int p = 0; p < 2; p++)
        for (int kind = 0; kind < PICTURE_KINDS; kind++)
            for (int way = 0; way < 4; way++) {
                struct rng rng = {(uint64_t)(10 * kind + way)};
                struct picture picture = picture_random(h, &rng, picture_view(67, 45, p), (enum picture_kind)kind, 0.5);
                picture_invent(&picture, &rng, 0.5, 4);
                struct setup s = make(h, &rng, picture, way & 1, way >> 1);
                check(h, &s);
            }
}

static void shapes(struct harness *h)
{
    static const uint32_t sizes[][2] = {{1, 1}, {16384, 1}, {1, 70}, {64, 64}, {16, 16}, {17, 15}, {2, 2}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        struct rng rng = {i};
        struct picture picture = picture_random(h, &rng, picture_view(sizes[i][0], sizes[i][1], 1), PICTURE_SURFACES, 0.7);
        struct setup s = make(h, &rng, picture, 0, 1);
        check(h, &s);
    }
}

// A rectangle that cuts tiles.
static void rectangle(struct harness *h)
{
    static const uint32_t rects[][4] = {{3, 2, 50, 30}, {16, 16, 48, 32}, {40, 20, 41, 21}};
    for (size_t i = 0; i < sizeof rects / sizeof rects[0]; i++) {
        struct rng rng = {i};
        struct picture picture = picture_random(h, &rng, picture_view(67, 45, 1), PICTURE_NOISE, 0.7);
        memcpy(picture.view.rect, rects[i], sizeof rects[i]);
        struct setup s = make(h, &rng, picture, (int)(i & 1), 1);
        check(h, &s);
    }
}

// Nothing, everything, and a layer that is all before its limits.
static void extremes(struct harness *h)
{
    for (int way = 0; way < 3; way++) {
        struct rng rng = {20};
        struct picture picture = picture_random(h, &rng, picture_view(67, 45, 0), PICTURE_FLAT, way ? 1.0 : 0.0);
        struct setup s = make(h, &rng, picture, 0, 1);
        for (size_t i = 0; i < picture.count && way == 2; i++)
            s.limit[i] = INFINITY;
        check(h, &s);
    }
}

// Reference alone: half of the light through a half-clear layer, nothing behind an opaque one.
static void sanity(struct harness *h)
{
    uint64_t key = ref_key(2.0f, 7);
    uint32_t from = 0;
    float deff = 0.25f, color[4] = {0.5f, 0.0f, 0.0f, 0.5f}, shading[4] = {0, 0, 1, 0.5f};
    float limit = 1.0f, through = 0.5f, over[4] = {0, 0.25f, 0, 0.5f};
    struct peel_args args = {.view = {.width = 1, .height = 1}, .stop = 1};
    struct ref_planes planes = {.keys = &key, .from = &from, .deff = &deff, .color = color, .shading = shading};
    struct ref_peel out = ref_peel(&args, &planes, &limit, &through, over, 0, 0);
    HARNESS_CHECK(h, out.limit == 2.25f && out.through == 0.25f && out.covered && out.key == key);
    HARNESS_CHECK(h, out.over[0] == 0.25 && out.over[1] == 0.25 && out.over[3] == 0.75);
    shading[3] = 1.0f;
    HARNESS_CHECK(h, ref_peel(&args, &planes, &limit, &through, over, 0, 0).limit == INFINITY);
    args.stop = 0;
    HARNESS_CHECK(h, ref_peel(&args, &planes, &limit, &through, over, 0, 0).limit == 2.25f);
    limit = 2.0f; // not beyond it
    out = ref_peel(&args, &planes, &limit, &through, over, 0, 0);
    HARNESS_CHECK(h, out.key == REF_EMPTY_KEY && out.limit == 2.0f && out.through == 0.5f && out.over[3] == 0.5);
    args.first = 1;
    out = ref_peel(&args, &planes, NULL, NULL, NULL, 0, 0);
    HARNESS_CHECK(h, out.limit == 2.25f && out.through == 0.0f && out.over[0] == 0.5);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"sanity", sanity, 1},
        {"pictures of all kinds, first and later layers", kinds, 0},
        {"shapes of planes", shapes, 0},
        {"rectangles that cut tiles", rectangle, 0},
        {"nothing, everything, all refused", extremes, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
