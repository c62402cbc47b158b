// SPDX-License-Identifier: GPL-3.0-or-later
// ink: every source of colour, over a picture and behind a sum of layers, with and without z, shares and blanked surfaces.
#include "harness.h"
#include "shared/picture.h"

#include <math.h>
#include <string.h>

struct setup {
    struct picture picture;
    struct ink_args args;
    float *line, *color, *depth;
    uint32_t *nearest;
    void *colors; // of the points
    size_t color_bytes;
};

static struct setup make(struct harness *h, struct rng *rng, const uint32_t crop[4], uint32_t format, int perspective)
{
    struct setup s = {.picture = picture_random(h, rng, picture_view(67, 45, perspective), PICTURE_SURFACES, 0.7)};
    const size_t count = s.picture.count, inside = (size_t)crop[2] * crop[3];
    s.args = (struct ink_args){.view = s.picture.view,
                               .instance = {.id_base = s.picture.id_base, .id_count = (uint32_t)count, .color_format = format},
                               .crop_x = crop[0],
                               .crop_y = crop[1],
                               .crop_width = crop[2],
                               .crop_height = crop[3],
                               .color = {0.5f, 0.25f, 0.0f},
                               .far_color = {0.0f, 0.75f, 1.0f},
                               .start = 3.0f,
                               .scale = 0.25f,
                               .opacity = 0.75f,
                               .color_target = 1,
                               .background = {0.1f, 0.2f, 0.3f, 1.0f}};
    memcpy(s.args.instance.color, (const float[]){0.9f, 0.8f, 0.7f}, 12);
    s.line = harness_alloc(h, count * 4);
    s.nearest = harness_alloc(h, count * 4);
    s.color = harness_alloc(h, inside * 16);
    s.depth = harness_alloc(h, inside * 4);
    s.color_bytes = count * (format == 1 ? 3 : format == 2 ? 12 : 0) + 4;
    s.colors = harness_alloc(h, s.color_bytes);
    for (size_t i = 0; i < count * 3 && format; i++)
        if (format == 1)
            ((uint8_t *)s.colors)[i] = (uint8_t)rng_below(rng, 256);
        else
            ((float *)s.colors)[i] = (float)rng_unit(rng);
    for (size_t i = 0; i < count; i++) {
        static const float shares[] = {0.0f, 1.0f, 0.5f, 0.49999997f};
        s.nearest[i] = 0xFFFFFFF0u; // nobody may follow it
        size_t source = rng_below(rng, (uint32_t)count);
        if (s.picture.keys[source] == REF_EMPTY_KEY)
            continue;
        s.nearest[i] = (uint32_t)source;
        s.line[i] = rng_below(rng, 2) ? shares[rng_below(rng, 4)] : (float)rng_unit(rng);
        if (s.line[i] == 0.0f)
            s.nearest[i] = 0xFFFFFFF0u;
    }
    for (size_t i = 0; i < inside; i++) {
        s.depth[i] = (float)rng_range(rng, 1.0, 9.0);
        for (size_t c = 0; c < 4; c++)
            s.color[4 * i + c] = (float)rng_unit(rng);
    }
    return s;
}

static void check(struct harness *h, const struct setup *s)
{
    const struct ink_args *args = &s->args;
    const size_t count = s->picture.count, inside = (size_t)args->crop_width * args->crop_height;
    struct pt_buffer *color = harness_buffer(h, s->color, inside * 16), *depth = harness_buffer(h, s->depth, inside * 4);
    struct pt_buffer *mask = harness_buffer(h, s->depth, inside * 4); // any numbers
    HARNESS_RUN(h, ink, args, harness_buffer(h, s->picture.keys, count * 8), harness_buffer(h, s->line, count * 4),
                harness_buffer(h, s->nearest, count * 4), harness_buffer(h, s->colors, s->color_bytes), color, depth, mask);
    const float *got = harness_read(h, color), *got_depth = harness_read(h, depth), *got_mask = harness_read(h, mask);
    struct ref_planes planes = picture_planes(&s->picture);
    planes.colors = s->colors;
    for (size_t i = 0; i < inside; i++) {
        int x = (int)(i % args->crop_width), y = (int)(i / args->crop_width);
        struct ref_ink expected = ref_ink(args, &planes, s->line, s->nearest, s->color + 4 * i, s->depth[i], x, y);
        for (int c = 0; c < 4; c++)
            if (!harness_near(got[4 * i + (size_t)c], expected.color[c], expected.error[c]))
                harness_fail(h, "colour", x, y, "channel %d: got %.9g, expected %.9g +- %.2g", c, got[4 * i + (size_t)c],
                             expected.color[c], expected.error[c]);
        if (got_depth[i] != (float)expected.depth)
            harness_fail(h, "depth", x, y, "got %.9g, expected %.9g", got_depth[i], expected.depth);
        if (got_mask[i] != (args->mask ? (float)expected.mask : s->depth[i]))
            harness_fail(h, "mask", x, y, "got %.9g, expected %.9g", got_mask[i], expected.mask);
    }
    harness_same(h, "depth", got_depth, inside, 4, 1, args->crop_width);
    harness_same(h, "mask", got_mask, inside, 4, 1, args->crop_width);
}

static const uint32_t crops[][4] = {{0, 0, 67, 45}, {5, 3, 40, 30}, {66, 44, 1, 1}, {0, 20, 67, 1}};

static void sources(struct harness *h)
{
    for (uint32_t source = 0; source < 3; source++)
        for (uint32_t format = 0; format < 3; format++)
            for (uint32_t way = 0; way < 8; way++) {
                struct rng rng = {10 * source + way};
                struct setup s = make(h, &rng, crops[way % 4], format, way & 1);
                s.args.source = source;
                s.args.depth = way & 1;
                s.args.mask = way >> 1 & 1;
                s.args.blank = way >> 2 & 1;
                check(h, &s);
                s.args.behind = 1;
                s.args.blank = s.args.depth = s.args.mask = 0;
                check(h, &s);
                s.args.color_target = 0;
                s.args.depth = s.args.mask = 1;
                check(h, &s);
            }
}

// Lines are known in a rectangle, and some belong to another instance.
static void strangers(struct harness *h)
{
    static const uint32_t rects[][4] = {{3, 2, 50, 30}, {16, 16, 48, 32}, {40, 20, 41, 21}, {0, 0, 0, 0}};
    for (uint32_t i = 0; i < 4; i++) {
        struct rng rng = {i};
        struct setup s = make(h, &rng, crops[i % 2], 1, 1);
        memcpy(s.args.view.rect, rects[i], sizeof rects[i]);
        s.args.instance.id_count /= 2;
        s.args.instance.id_first = s.args.instance.id_count / 8;
        s.args.mask = s.args.depth = s.args.blank = 1;
        check(h, &s);
    }
}

// Reference alone: half a black line over white, behind half a red, and on nothing.
static void sanity(struct harness *h)
{
    uint64_t key = ref_key(2.0f, 0);
    uint32_t nearest = 0;
    float line = 0.5f;
    struct ink_args args = {.view = {.width = 1, .height = 1, .rect = {0, 0, 1, 1}},
                            .instance = {.id_count = 1},
                            .crop_width = 1,
                            .crop_height = 1,
                            .opacity = 1.0f,
                            .color_target = 1,
                            .depth = 1};
    struct ref_planes planes = {.keys = &key};
    const float white[4] = {1, 1, 1, 1}, red[4] = {0.5f, 0, 0, 0.5f}, clear[4] = {0, 0, 0, 0};
    struct ref_ink out = ref_ink(&args, &planes, &line, &nearest, white, 9.0f, 0, 0);
    HARNESS_CHECK(h, out.color[0] == 0.5 && out.color[3] == 1.0 && out.depth == 2.0 && out.mask == 0.5);
    HARNESS_CHECK(h, ref_ink(&args, &planes, &line, &nearest, clear, 9.0f, 0, 0).color[3] == 0.5);
    args.behind = 1;
    out = ref_ink(&args, &planes, &line, &nearest, red, 9.0f, 0, 0);
    HARNESS_CHECK(h, out.color[0] == 0.5 && out.color[3] == 0.75);
    line = 0.25f;
    HARNESS_CHECK(h, ref_ink(&args, &planes, &line, &nearest, red, 9.0f, 0, 0).depth == 9.0);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"sources and targets", sources, 0},
        {"rectangles and other instances", strangers, 0},
        {"the reference itself", sanity, 1},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
