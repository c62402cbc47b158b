// SPDX-License-Identifier: GPL-3.0-or-later
// sift: boxes that keep and cut, planes, hidden classes, hidden shapes, masks, fields, scans; degenerate and huge ones. Bits are equal on every device.
#include "points.h"
#include "shared/points.h"

#include <math.h>
#include <string.h>

enum { CHUNKS = 9, MOST_CLIPS = 40 };

struct setup {
    struct sift_args args;
    struct chunk_view chunks[CHUNKS];
    struct clip_view clips[MOST_CLIPS];
    uint32_t clip_count, slots, words;
    float *positions;
    uint8_t *classes;
    uint32_t *shapes;
    uint32_t *mask; // a word of each 16 slots: the upper half says nothing here
    uint32_t *field;
    uint16_t *scans;
};

static struct setup make(struct harness *h, struct rng *rng)
{
    static const uint32_t sizes[CHUNKS] = {1, 15, 16, 17, 300, 1000, 31, 2, 4096};
    struct setup s = {0};
    for (uint32_t c = 0; c < CHUNKS; c++) {
        struct chunk_view *chunk = &s.chunks[c];
        chunk->first = s.slots;
        chunk->count = sizes[c];
        chunk->padded = (sizes[c] + 15) / 16 * 16;
        s.slots += chunk->padded;
        if (c == 3)
            continue; // whole: nothing is written for it
        chunk->sifted = 1 + s.words;
        s.words += chunk->padded / PT_SLOTS_A_WORD;
    }
    s.positions = harness_alloc(h, 12 * (size_t)s.slots);
    s.classes = harness_alloc(h, (size_t)s.slots + 4);
    s.shapes = harness_alloc(h, 4 * (size_t)s.slots);
    for (uint32_t i = 0; i < 3 * s.slots; i++)
        s.positions[i] = (float)rng_range(rng, -2.0, 2.0);
    points_settle(s.chunks, CHUNKS, s.positions);
    for (uint32_t i = 0; i < s.slots; i++)
        s.classes[i] = (uint8_t)(rng_below(rng, 4) ? rng_below(rng, 8) : rng_below(rng, 256));
    for (uint32_t i = 0; i < s.slots; i++)
        s.shapes[i] = (uint32_t)rng_next(rng); // kinds and bits that no analysis writes as well
    s.mask = harness_alloc(h, s.slots / 4);
    for (uint32_t i = 0; i < s.slots / 16; i++)
        s.mask[i] = (uint32_t)rng_next(rng);
    s.field = harness_alloc(h, 4 * (size_t)s.slots);
    s.scans = harness_alloc(h, 2 * (size_t)s.slots + 4);
    for (uint32_t i = 0; i < s.slots; i++)
        s.field[i] = (uint32_t)rng_next(rng);
    for (uint32_t i = 0; i < s.slots; i++)
        s.scans[i] = (uint16_t)(i % 5 ? i % 7 : 1000 + i % 60000);
    return s;
}

static struct clip_view random_clip(struct rng *rng, uint32_t shape, double size)
{
    struct clip_view clip = {.shape = shape};
    for (int k = shape == PT_CLIP_PLANE ? 2 : 0; k < 3; k++) {
        float direction[3];
        rng_direction(rng, direction);
        for (int i = 0; i < 3; i++)
            clip.row[3 * k + i] = (float)(direction[i] * size);
        double shift = rng_range(rng, -1.0, 1.0);
        clip.hi[k] = (float)shift;
        clip.lo[k] = (float)(shift - clip.hi[k]);
    }
    return clip;
}

// Every divided chunk gets `keeps` boxes that keep, then `cuts` boxes and planes.
static void add_clips(struct setup *s, struct rng *rng, uint32_t keeps, uint32_t cuts, double size)
{
    s->clip_count = keeps + cuts;
    for (uint32_t i = 0; i < s->clip_count; i++)
        s->clips[i] = random_clip(rng, i < keeps ? PT_CLIP_KEEP : i % 2 ? PT_CLIP_CUT : PT_CLIP_PLANE, size);
    for (uint32_t c = 0; c < CHUNKS; c++) {
        s->chunks[c].clip_count = s->clip_count;
        s->chunks[c].clip_keeps = keeps;
    }
}

static void check(struct harness *h, const struct setup *s)
{
    uint32_t *before = harness_alloc(h, 4 * (size_t)(s->words + 1));
    memset(before, 0xAA, 4 * (size_t)(s->words + 1));
    struct pt_buffer *chunks = harness_buffer(h, s->chunks, sizeof s->chunks);
    struct pt_buffer *positions = points_positions(h, s->chunks, CHUNKS, s->positions, s->slots);
    struct pt_buffer *classes = harness_buffer(h, s->classes, (s->slots + 3) / 4 * 4);
    struct pt_buffer *clips = harness_buffer(h, s->clips, (s->clip_count ? s->clip_count : 1) * sizeof *s->clips);
    struct pt_buffer *drawn = harness_buffer(h, before, 4 * (size_t)(s->words + 1));
    struct pt_buffer *shapes = harness_buffer(h, s->shapes, 4 * (size_t)s->slots),
                     *mask = harness_buffer(h, s->mask, s->slots / 4);
    struct pt_buffer *field = harness_buffer(h, s->field, 4 * (size_t)s->slots);
    struct pt_buffer *scans = harness_buffer(h, s->scans, 2 * (size_t)s->slots + 4);
    HARNESS_RUN(h, sift, &s->args, chunks, positions, classes, clips, drawn, shapes, mask, field, scans);
    uint32_t *got = harness_read(h, drawn);
    size_t open = 0, points = 0, kept = 0;
    for (uint32_t c = 0; c < CHUNKS; c++) {
        const struct chunk_view *chunk = &s->chunks[c];
        for (uint32_t i = 0; i < chunk->count && chunk->sifted; i++, points++) {
            int bit = got[chunk->sifted - 1 + i / PT_SLOTS_A_WORD] >> i % PT_SLOTS_A_WORD & 1u;
            enum ref_truth expected = ref_sift(&s->args, chunk, s->positions, s->classes, s->shapes, s->mask, s->field,
                                               s->scans, s->clips, i);
            open += expected == REF_UNSURE;
            kept += (size_t)bit;
            if (expected != REF_UNSURE && bit != (expected == REF_YES))
                harness_fail(h, "drawn", (int)i, (int)c, "got %d, expected %d", bit, expected == REF_YES);
        }
    }
    HARNESS_CHECK(h, got[s->words] == 0xAAAAAAAAu); // beyond the last word
    harness_same(h, "drawn", got, s->words, 4, 1, s->words);
    harness_unsure(h, open, points, TOL_UNSURE_SHARE);
    harness_note(h, "%zu of %zu points are drawn", kept, points);
}

static void shapes(struct harness *h)
{
    static const uint32_t counts[][2] = {{1, 0}, {0, 1}, {0, 2}, {3, 0}, {2, 5}, {8, 8}, {20, 20}};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++) {
        struct rng rng = {i};
        struct setup s = make(h, &rng);
        add_clips(&s, &rng, counts[i][0], counts[i][1], 0.7);
        check(h, &s);
    }
}

static void classes(struct harness *h)
{
    for (uint64_t seed = 0; seed < 4; seed++) {
        struct rng rng = {seed};
        struct setup s = make(h, &rng);
        s.args.by_class = 1;
        for (int k = 0; k < 8; k++)
            s.args.hidden[k] = seed == 3 ? ~0u : (uint32_t)rng_next(&rng); // all of them at last
        if (seed == 1)
            add_clips(&s, &rng, 1, 2, 0.7);
        check(h, &s);
        s.args.by_class = 0; // then they do not count
        check(h, &s);
    }
}

// One bit of the 256 by itself, all of them, none; with classes and clips beside them.
static void shape_words(struct harness *h)
{
    static const uint32_t single[] = {0, 5, 31, 32, 64 + 3, 128, 255};
    for (uint64_t seed = 0; seed < 12; seed++) {
        struct rng rng = {seed + 40};
        struct setup s = make(h, &rng);
        s.args.by_shape = 1;
        if (seed < 7)
            s.args.hidden_shapes[single[seed] / 32] = 1u << single[seed] % 32;
        for (int k = 0; k < 8 && seed >= 7; k++)
            s.args.hidden_shapes[k] = seed == 7 ? 0 : seed == 8 ? ~0u : (uint32_t)rng_next(&rng);
        for (uint32_t i = 0; i < s.slots && seed == 3; i++)
            s.shapes[i] &= ~(0xFFu << PT_SHAPE_SIGHT_SHIFT); // all of them say 0: none is hidden
        if (seed >= 10)
            add_clips(&s, &rng, 1, 2, 0.7);
        s.args.by_class = seed == 11;
        for (int k = 0; k < 8; k++)
            s.args.hidden[k] = (uint32_t)rng_next(&rng);
        check(h, &s);
        s.args.by_shape = 0; // then they do not count
        check(h, &s);
    }
}

// Bits at random, none and all of them, by themselves and beside all else.
static void masks(struct harness *h)
{
    for (uint64_t seed = 0; seed < 6; seed++) {
        struct rng rng = {seed + 60};
        struct setup s = make(h, &rng);
        s.args.by_mask = 1;
        for (uint32_t i = 0; i < s.slots / 16 && seed >= 4; i++)
            s.mask[i] = seed == 4 ? 0xFFFF0000u : 0xFFFFu; // all selected and none hidden; the reverse
        if (seed == 2 || seed == 3)
            add_clips(&s, &rng, 1, 2, 0.7);
        s.args.by_class = s.args.by_shape = seed == 3;
        for (int k = 0; k < 8; k++) {
            s.args.hidden[k] = (uint32_t)rng_next(&rng);
            s.args.hidden_shapes[k] = (uint32_t)rng_next(&rng);
        }
        check(h, &s);
        s.args.by_mask = 0; // then it does not count
        check(h, &s);
    }
}

// Fields beside all else: thresholds that leave some, all but the last step, and nothing; F at the threshold itself is solid.
// Hidden ones, some that are never: 1024 and beyond.
static void scans(struct harness *h)
{
    for (uint64_t seed = 0; seed < 3; seed++) {
        struct rng rng = {seed};
        struct setup s = make(h, &rng);
        s.args.by_scan = 1;
        for (int k = 0; k < PT_SCAN_WORDS; k++)
            s.args.hidden_scans[k] = seed == 2 ? 0xFFFFFFFFu : (uint32_t)rng_next(&rng);
        if (seed == 1)
            add_clips(&s, &rng, 2, 2, 0.7);
        check(h, &s);
    }
}

static void fields(struct harness *h)
{
    static const uint32_t thresholds[] = {0, 1, 32768, 65534, 65535};
    for (uint64_t seed = 0; seed < 10; seed++) {
        struct rng rng = {seed + 80};
        struct setup s = make(h, &rng);
        s.args.by_field = 1;
        s.args.threshold = thresholds[seed % 5];
        for (uint32_t i = 0; i < s.slots; i += 2) // at it, and a step beside it
            s.field[i] = (s.args.threshold + i / 2 % 3 - (s.args.threshold > 0)) << PT_FIELD_SHIFT | (i & PT_FIELD_RADIUS);
        s.args.by_class = s.args.by_shape = s.args.by_mask = seed == 7;
        for (int k = 0; k < 8; k++) {
            s.args.hidden[k] = (uint32_t)rng_next(&rng);
            s.args.hidden_shapes[k] = (uint32_t)rng_next(&rng);
        }
        if (seed >= 5)
            add_clips(&s, &rng, 1, 2, 0.7);
        check(h, &s);
        s.args.by_field = 0; // then it does not count
        check(h, &s);
    }
}

// Boxes as small and as large as float32 has them, around points far from the chunk's origin; NaN where infinities meet.
static void extremes(struct harness *h)
{
    static const double sizes[] = {1e-30, 1e-6, 1e6, 1e30, 3e38};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        struct rng rng = {i + 20};
        struct setup s = make(h, &rng);
        add_clips(&s, &rng, 1, 3, sizes[i]);
        for (uint32_t k = 0; k < s.slots && i < 4; k++)
            s.positions[k] *= (float)(1.0 / sizes[i]);
        if (i < 4) {
            check(h, &s);
            continue;
        }
        for (uint32_t k = 0; k < s.clip_count; k++) // sums overflow: no float64 says what; devices agree
            s.clips[k].row[0] = s.clips[k].row[4] = s.clips[k].row[8] = INFINITY;
        struct pt_buffer *buffers[9] = {harness_buffer(h, s.chunks, sizeof s.chunks),
                                        harness_buffer(h, s.positions, 12 * (size_t)s.slots),
                                        harness_buffer(h, s.classes, (s.slots + 3) / 4 * 4),
                                        harness_buffer(h, s.clips, sizeof s.clips),
                                        harness_buffer(h, NULL, 0),
                                        harness_buffer(h, s.shapes, 4 * (size_t)s.slots),
                                        harness_buffer(h, s.mask, s.slots / 4),
                                        harness_buffer(h, s.field, 4 * (size_t)s.slots),
                                        NULL};
        uint32_t *zero = harness_alloc(h, 4 * (size_t)s.words);
        buffers[4] = harness_buffer(h, zero, 4 * (size_t)s.words);
        harness_run(h, PT_KERNEL_sift, &s.args, sizeof s.args, buffers, 9);
        harness_same(h, "infinite", harness_read(h, buffers[4]), s.words, 4, 1, s.words);
    }
}

// Reference alone: a box of half size 2 around (1, 0, 0), and a plane through it.
static void sanity(struct harness *h)
{
    struct clip_view clips[2] = {{.row = {0.5f, 0, 0, 0, 0.5f, 0, 0, 0, 0.5f}, .hi = {-0.5f, 0, 0}, .shape = PT_CLIP_KEEP},
                                 {.row = {0, 0, 0, 0, 0, 0, 0, 0, 1}, .hi = {0, 0, -1}, .shape = PT_CLIP_PLANE}};
    const float points[3 * 16] = {[0] = 2.9f, [1] = 3.1f, [2] = 0.0f, [32 + 2] = 1.5f};
    struct chunk_view chunk = {.count = 3, .padded = 16, .clip_count = 1, .clip_keeps = 1};
    struct sift_args args = {0};
    HARNESS_CHECK(h, ref_sift(&args, &chunk, points, NULL, NULL, NULL, NULL, NULL, clips, 0) == REF_YES);
    HARNESS_CHECK(h, ref_sift(&args, &chunk, points, NULL, NULL, NULL, NULL, NULL, clips, 1) == REF_NO);
    HARNESS_CHECK(h, ref_sift(&args, &chunk, points, NULL, NULL, NULL, NULL, NULL, clips, 2) == REF_YES);
    chunk.clip_count = 2; // cuts what lies above z = 1
    HARNESS_CHECK(h, ref_sift(&args, &chunk, points, NULL, NULL, NULL, NULL, NULL, clips, 2) == REF_NO);
    clips[0].shape = PT_CLIP_CUT;
    chunk.clip_keeps = 0;
    HARNESS_CHECK(h, ref_sift(&args, &chunk, points, NULL, NULL, NULL, NULL, NULL, clips, 1) == REF_YES);
    HARNESS_CHECK(h, ref_sift(&args, &chunk, points, NULL, NULL, NULL, NULL, NULL, clips, 0) == REF_NO);
    const uint32_t shapes[] = {PT_KIND_STRAY << PT_SHAPE_KIND_SHIFT | 15u << PT_SHAPE_TRUST_SHIFT,
                               15u << PT_SHAPE_TRUST_SHIFT | PT_SHAPE_SEEN_THROUGH};
    args = (struct sift_args){.by_shape = 1, .hidden_shapes = {[(5 + 8 * 15) / 32] = 1u << (5 + 8 * 15) % 32}};
    chunk.clip_count = 0;
    HARNESS_CHECK(h, ref_sift(&args, &chunk, points, NULL, shapes, NULL, NULL, NULL, clips, 0) == REF_NO);
    HARNESS_CHECK(h, ref_sift(&args, &chunk, points, NULL, shapes, NULL, NULL, NULL, clips, 1) == REF_YES);
    const uint32_t mask = 1u << 1 | 1u << 16; // hides point 1, selects point 0
    args = (struct sift_args){.by_mask = 1};
    HARNESS_CHECK(h, ref_sift(&args, &chunk, points, NULL, NULL, &mask, NULL, NULL, clips, 0) == REF_YES);
    HARNESS_CHECK(h, ref_sift(&args, &chunk, points, NULL, NULL, &mask, NULL, NULL, clips, 1) == REF_NO);
    const uint32_t field[] = {7u << PT_FIELD_SHIFT | 9u, 8u << PT_FIELD_SHIFT};
    args = (struct sift_args){.by_field = 1, .threshold = 7};
    HARNESS_CHECK(h, ref_sift(&args, &chunk, points, NULL, NULL, NULL, field, NULL, clips, 0) == REF_YES);
    HARNESS_CHECK(h, ref_sift(&args, &chunk, points, NULL, NULL, NULL, field, NULL, clips, 1) == REF_NO);
}

static void packed(struct harness *h) { points_packed(h, shapes); }

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {{"packed positions", packed, 0},
                                                {"sanity", sanity, 1},
                                                {"boxes and planes", shapes, 0},
                                                {"hidden classes", classes, 0},
                                                {"hidden shapes", shape_words, 0},
                                                {"masks", masks, 0},
                                                {"fields", fields, 0},
                                                {"scans", scans, 0},
                                                {"extreme sizes", extremes, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
