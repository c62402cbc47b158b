// SPDX-License-Identifier: GPL-3.0-or-later
// tint: bands along the cuts of boxes and planes, on pictures of all kinds.
#include "harness.h"
#include "shared/effects.h"

#include <math.h>
#include <string.h>

enum { MOST_CLIPS = 12 };

struct setup {
    struct picture picture;
    struct tint_args args;
    struct clip_view clips[MOST_CLIPS];
};

static struct setup make(struct harness *h, struct rng *rng, int perspective, enum picture_kind kind, uint32_t count)
{
    struct setup s = {.picture = picture_random(h, rng, picture_view(67, 45, perspective), kind, 0.5)};
    picture_invent(&s.picture, rng, 0.7, 5);
    s.args = (struct tint_args){.view = s.picture.view,
                                .id_base = s.picture.id_base,
                                .id_first = (uint32_t)(s.picture.count / 16),
                                .id_count = (uint32_t)(s.picture.count * 11 / 16), // the rest is somebody else's
                                .clip_first = 1,
                                .clip_count = count,
                                .eye_z = perspective ? 0.0f : -3.0f};
    for (uint32_t i = 1; i <= count; i++) {
        struct clip_view *clip = &s.clips[i];
        clip->shape = i <= count / 2 ? PT_CLIP_KEEP : i % 2 ? PT_CLIP_CUT : PT_CLIP_PLANE;
        clip->strength = (float)rng_range(rng, 0.3, 1.0);
        clip->width = i % 4 == 3 ? 0.0f : (float)rng_range(rng, 0.05, 0.8); // some are not tinted
        for (int k = clip->shape == PT_CLIP_PLANE ? 2 : 0; k < 3; k++) {
            float direction[3];
            double half = clip->shape == PT_CLIP_PLANE ? 1.0 : rng_range(rng, 1.0, 4.0);
            rng_direction(rng, direction);
            for (int c = 0; c < 3; c++)
                clip->row[3 * k + c] = (float)(direction[c] / half);
            clip->hi[k] = (float)(direction[2] * rng_range(rng, 3.0, 6.0) / half); // around the picture's surfaces
            clip->half_size[k] = (float)half;
            clip->tint[k] = (float)rng_unit(rng);
        }
        clip->tint[0] = (float)rng_unit(rng);
    }
    return s;
}

static void check(struct harness *h, const struct setup *s)
{
    const struct picture *picture = &s->picture;
    const size_t count = picture->count;
    struct pt_buffer *keys = harness_buffer(h, picture->keys, count * 8);
    struct pt_buffer *clips = harness_buffer(h, s->clips, sizeof s->clips);
    struct pt_buffer *color = harness_buffer(h, picture->color, count * 16);
    HARNESS_RUN(h, tint, &s->args, keys, clips, color);
    const float *got = harness_read(h, color);
    struct ref_planes planes = picture_planes(picture);
    size_t open = 0, ours = 0, changed = 0;
    for (size_t i = 0; i < count; i++) {
        int x = (int)(i % picture->view.width), y = (int)(i / picture->view.width);
        struct ref_color expected = ref_tint(&s->args, &planes, s->clips, x, y);
        uint32_t id = ref_key_id(picture->keys[i]) - s->args.id_base;
        int is_ours = picture->keys[i] != REF_EMPTY_KEY && id - s->args.id_first < s->args.id_count;
        ours += (size_t)is_ours;
        changed += memcmp(got + 4 * i, picture->color + 4 * i, 16) != 0;
        if (!is_ours && memcmp(got + 4 * i, picture->color + 4 * i, 16))
            harness_fail(h, "untouched", x, y, "was written");
        open += (size_t)expected.unsure;
        for (int k = 0; k < 4 && is_ours && !expected.unsure; k++)
            if (!harness_near(got[4 * i + (size_t)k], expected.color[k], expected.error[k]))
                harness_fail(h, "color", x, y, "channel %d: got %.9g, expected %.9g +- %.2g", k, got[4 * i + (size_t)k],
                             expected.color[k], expected.error[k]);
    }
    harness_unsure(h, open, count, TOL_UNSURE_SHARE);
    harness_note(h, "%zu of %zu pixels are tinted", changed, ours);
}

static void pictures(struct harness *h)
{
    for (int p = 0; p < 2; p++)
        for (int kind = 0; kind < PICTURE_KINDS; kind++)
            for (uint32_t count = 1; count < MOST_CLIPS; count += 5) {
                struct rng rng = {(uint64_t)kind + 10 * count};
                struct setup s = make(h, &rng, p, (enum picture_kind)kind, count);
                check(h, &s);
            }
}

// Reference alone: a wall 5 away, a plane 1 before it that cuts what lies before: bands of width 2 reach the wall, of 0.5 not.
static void sanity(struct harness *h)
{
    uint64_t key = ref_key(5.0f, 0);
    float color[4] = {0.2f, 0.4f, 0.6f, 0.5f};
    struct clip_view clip = {.row = {0, 0, 0, 0, 0, 0, 0, 0, 1},
                             .hi = {0, 0, 4},
                             .shape = PT_CLIP_PLANE,
                             .tint = {1, 0, 0},
                             .strength = 1.0f,
                             .width = 2.0f};
    struct tint_args args = {
        .view = {.width = 1, .height = 1, .perspective = 1, .footprint = 0.001f}, .id_count = 1, .clip_count = 1};
    struct ref_planes planes = {.keys = &key, .color = color};
    struct ref_color out = ref_tint(&args, &planes, &clip, 0, 0);
    HARNESS_CHECK(h, fabs(out.color[0] - 0.5) < 1e-6 && fabs(out.color[1]) < 1e-6 && out.color[3] == 0.5);
    clip.width = 0.5f;
    HARNESS_CHECK(h, fabs(ref_tint(&args, &planes, &clip, 0, 0).color[1] - 0.4) < 1e-6);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {{"sanity", sanity, 1}, {"pictures of all kinds", pictures, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
