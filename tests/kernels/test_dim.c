// SPDX-License-Identifier: GPL-3.0-or-later
// dim: points before, in and behind the slabs of a light's view; what samples and maps add up to.
#include "marks.h"
#include "points.h"
#include "shared/balls.h"
#include "shared/shadows.h"
#include "shared/words.h"

#include <math.h>
#include <string.h>

enum {
    CHUNKS = 3,
    POINTS = 1000,
    SLOTS = CHUNKS * 1024,
    OTHERS = 7,
    LIGHTS = 3,
    WORDS = LIGHTS * (SLOTS + 1) + OTHERS,
    WIDTH = 41,
    HEIGHT = 29
};

struct setup {
    struct dim_args args;
    struct chunk_view chunks[CHUNKS];
    float *positions, *veil;
    uint32_t *words, *marks;
};

// Looks as the map's view does: object and view space are the same, but for z.
static void set_chunk(const struct view_args *view, struct chunk_view *chunk)
{
    const double sx = 1.0 / view->ray_xs, sy = 1.0 / view->ray_ys, ox = -view->ray_x0 * sx, oy = -view->ray_y0 * sy;
    const double rows[9] = {sx, 0.0, view->perspective ? -ox : 0.0, 0.0, sy, view->perspective ? -oy : 0.0, 0.0, 0.0, -1.0};
    for (int k = 0; k < 9; k++)
        chunk->row[k] = (float)rows[k];
    if (!view->perspective) {
        chunk->hi[0] = (float)ox;
        chunk->hi[1] = (float)oy;
    }
}

static struct setup make(struct harness *h, struct rng *rng, int perspective, uint32_t veils)
{
    struct setup s = {.args = {.view = picture_view(WIDTH, HEIGHT, perspective),
                               .step = 1,
                               .alone = 1,
                               .samples = 1,
                               .veils = veils,
                               .veil_from = 2.0f,
                               .veil_scale = (float)veils / 5.0f}};
    const struct view_args *view = &s.args.view;
    s.args.window[0] = (float)view->origin_x;
    s.args.window[1] = (float)view->origin_y;
    s.args.window[2] = (float)(view->origin_x + WIDTH);
    s.args.window[3] = (float)(view->origin_y + HEIGHT);
    s.positions = harness_alloc(h, SLOTS * 12);
    s.words = harness_alloc(h, WORDS * 4);
    uint8_t *shown = harness_alloc(h, SLOTS);
    s.veil = harness_alloc(h, (size_t)WIDTH * HEIGHT * veils * 4);
    for (size_t i = 0; i < (size_t)WIDTH * HEIGHT; i++) { // grows with depth; some rays meet nothing
        double sum = 0.0;
        for (uint32_t k = 0; k < veils; k++) {
            sum += i % 5 ? rng_range(rng, 0.0, 3.0 / veils) : 0.0;
            s.veil[i * veils + k] = (float)sum;
        }
    }
    for (uint32_t c = 0; c < CHUNKS; c++) {
        s.chunks[c] = (struct chunk_view){.first = 1024 * c, .count = POINTS, .padded = 1008};
        set_chunk(view, &s.chunks[c]);
        for (uint32_t i = 0; i < POINTS; i++) {
            const double x = rng_range(rng, -2.0, WIDTH + 2.0), y = rng_range(rng, -2.0, HEIGHT + 2.0),
                         z = rng_below(rng, 50) ? rng_range(rng, 0.5, 9.0) : -1.0;
            const double u = view->ray_x0 + view->ray_xs * (view->origin_x + x),
                         v = view->ray_y0 + view->ray_ys * (view->origin_y + y);
            const double p[3] = {perspective ? u * z : u, perspective ? v * z : v, -z};
            for (uint32_t k = 0; k < 3; k++)
                s.positions[3 * (size_t)s.chunks[c].first + k * s.chunks[c].padded + i] = (float)p[k];
        }
    }
    points_settle(s.chunks, CHUNKS, s.positions);
    for (uint32_t i = 0; i < SLOTS; i++)
        shown[i] = (uint8_t)rng_below(rng, 2);
    uint32_t words;
    s.marks = marks_of(h, shown, SLOTS, 1, &words);
    return s;
}

// What the word may become: the loss is a whole number next to the exact one.
static int admissible(const struct dim_args *args, uint32_t before, uint32_t now, const double loss[2])
{
    struct shadow_test_args as = {.alone = args->alone, .close = args->close, .samples = args->samples};
    for (double k = floor(loss[0] + 0.49); k <= floor(loss[1] + 0.51); k++) {
        as.loss = (uint32_t)k;
        if (ref_shadow_word(&as, before, k > 0.0) == now)
            return 1;
    }
    return 0;
}

static void check(struct harness *h, const struct setup *s, uint32_t base)
{
    struct dim_args args = s->args;
    uint32_t differs = 0, expected_differs = 0, tested = 0;
    uint8_t *own = harness_alloc(h, WORDS);
    args.base = base;
    struct pt_buffer *veil = harness_buffer(h, s->veil, (size_t)WIDTH * HEIGHT * args.veils * 4);
    struct pt_buffer *chunks = harness_buffer(h, s->chunks, sizeof s->chunks);
    struct pt_buffer *positions = points_positions(h, s->chunks, CHUNKS, s->positions, SLOTS),
                     *marks = harness_buffer(h, s->marks, marks_size(SLOTS));
    struct pt_buffer *words = harness_buffer(h, s->words, WORDS * 4), *flag = harness_buffer(h, &differs, 4);
    HARNESS_RUN(h, dim, &args, veil, chunks, positions, marks, words, flag);
    const uint32_t *got = harness_read(h, words), *got_flag = harness_read(h, flag);
    for (uint32_t c = 0; c < CHUNKS; c++)
        for (uint32_t i = 0; i < s->chunks[c].count; i++) {
            const uint32_t id = s->chunks[c].first + i;
            static const double none[2] = {0.0, 0.0};
            double loss[2];
            if (args.marked && !ref_shown(s->marks, id))
                continue;
            const uint32_t at = base + args.step * (args.marked ? ref_shown_place(s->marks, id) : id), word = s->words[at],
                           now = got[at];
            own[at] = 1;
            const enum ref_truth inside = ref_dim(&args, s->veil, &s->chunks[c], s->positions, i, loss);
            tested += loss[1] > 0.5;
            expected_differs |= (args.alone || args.close) &&
                                (now & PT_SHADOW_SUM) != args.samples * (now - (word & PT_SHADOW_SUM));
            if (!(inside != REF_NO && admissible(&args, word, now, loss)) &&
                !(inside != REF_YES && admissible(&args, word, now, none)))
                harness_fail(h, "word", (int)id, (int)c, "got %08x from %08x, expected a loss of %.3f to %.3f of 255", now,
                             word, loss[0], loss[1]);
        }
    HARNESS_CHECK(h, tested > POINTS || args.marked);
    if (args.compare)
        HARNESS_CHECK(h, (*got_flag != 0) == (expected_differs != 0));
    for (uint32_t i = 0; i < WORDS; i++)
        if (!own[i] && got[i] != s->words[i])
            harness_fail(h, "another's", (int)i, 0, "was written");
}

static void maps(struct harness *h)
{
    static const uint32_t counts[] = {1, 8, PT_SOFT_VEILS};
    for (int p = 0; p < 2; p++)
        for (int k = 0; k < 3; k++) {
            struct rng rng = {3 + (uint64_t)k};
            struct setup s = make(h, &rng, p, counts[k]);
            check(h, &s, k ? OTHERS : 0);
            s.args.marked = 1;
            s.args.step = LIGHTS;
            check(h, &s, (uint32_t)k);
        }
}

// A sample of several maps; later samples upon earlier ones; what early stops ask.
static void samples(struct harness *h)
{
    for (uint32_t mode = 0; mode < 3; mode++)
        for (uint32_t compare = 0; compare < 2; compare++) {
            struct rng rng = {11 + mode};
            struct setup s = make(h, &rng, 1, 8);
            s.args.alone = mode == 0;
            s.args.close = mode == 1;
            s.args.samples = 5;
            s.args.compare = compare;
            for (uint32_t k = 0; k < WORDS; k++)
                s.words[k] = rng_below(&rng, 4 * 255 + 1) | (mode ? rng_below(&rng, 256) << PT_SHADOW_SHIFT : 0);
            check(h, &s, 0);
        }
}

// Reference alone: in the middle of a texel and at a slab's end the plane's own number; halfway between, the mean.
static void sanity(struct harness *h)
{
    const float veil[4] = {0.5f, 2.0f, 1.5f, 2.5f};
    struct dim_args args = {.view = {.width = 2, .height = 1}, .veils = 2, .veil_from = 1.0f, .veil_scale = 0.5f};
    HARNESS_CHECK(h, harness_near(ref_dim_at(&args, veil, 0.5, 0.5, 3.0), 0.5, 1e-12));
    HARNESS_CHECK(h, harness_near(ref_dim_at(&args, veil, 0.5, 0.5, 2.0), 0.25, 1e-12));
    HARNESS_CHECK(h, harness_near(ref_dim_at(&args, veil, 1.0, 0.5, 9.0), 2.25, 1e-12));
    HARNESS_CHECK(h, ref_dim_at(&args, veil, 0.5, 0.5, 0.5) == 0.0);
}

static void packed(struct harness *h)
{
    points_packed(h, maps);
    points_packed(h, samples);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"maps", maps, 0},
        {"samples", samples, 0},
        {"packed positions", packed, 0},
        {"sanity", sanity, 1},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
