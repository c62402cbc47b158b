// SPDX-License-Identifier: GPL-3.0-or-later
// shadow_test: points before, on and behind the surfaces of a map, with normals and without; what samples and maps add up to.
#include "marks.h"
#include "points.h"
#include "shared/shadows.h"
#include "shared/words.h"

#include <math.h>
#include <string.h>

enum { POINTS = 3000, CHUNKS = 3, SLOTS = CHUNKS * 1024, LIGHTS = 3, WORDS = LIGHTS * (SLOTS + 1) + 7 };

struct setup {
    struct picture map;
    struct shadow_test_args args;
    struct chunk_view chunks[CHUNKS];
    float *positions;
    uint32_t *surfels, *words, *marks;
    uint8_t *opacities; // opacities: of the map's points
};

// Looks as the map's view does: object and view space are the same, but for z.
static void set_chunk(const struct view_args *view, struct chunk_view *chunk)
{
    double sx = 1.0 / view->ray_xs, sy = 1.0 / view->ray_ys, ox = -view->ray_x0 * sx, oy = -view->ray_y0 * sy;
    const double rows[9] = {sx, 0.0, view->perspective ? -ox : 0.0, 0.0, sy, view->perspective ? -oy : 0.0, 0.0, 0.0, -1.0};
    for (int k = 0; k < 9; k++)
        chunk->row[k] = (float)rows[k];
    if (!view->perspective) {
        chunk->hi[0] = (float)ox;
        chunk->hi[1] = (float)oy;
    }
}

// Points near what the map shows, a few d_eff before or behind it, and some anywhere.
static void place(struct rng *rng, struct setup *s, uint32_t chunk, uint32_t slot)
{
    const struct view_args *view = &s->map.view;
    double x = rng_range(rng, -2.0, view->width + 2.0), y = rng_range(rng, -2.0, view->height + 2.0),
           z = rng_range(rng, 0.5, 12.0);
    double inside_x = fmin(fmax(x, 0.0), view->width - 1.0), inside_y = fmin(fmax(y, 0.0), view->height - 1.0);
    size_t pixel = (size_t)inside_y * view->width + (size_t)inside_x;
    if (s->map.keys[pixel] != REF_EMPTY_KEY && rng_below(rng, 8))
        z = ref_key_z(s->map.keys[pixel]) + rng_range(rng, -3.0, 6.0) * s->map.deff[s->map.from[pixel]];
    if (rng_below(rng, 50) == 0)
        z = -z; // behind the light
    double u = view->ray_x0 + view->ray_xs * (view->origin_x + x), v = view->ray_y0 + view->ray_ys * (view->origin_y + y);
    const double p[3] = {view->perspective ? u * z : u, view->perspective ? v * z : v, -z};
    for (uint32_t k = 0; k < 3; k++)
        s->positions[3 * (size_t)s->chunks[chunk].first + k * s->chunks[chunk].padded + slot] = (float)p[k];
}

static struct setup make(struct harness *h, struct rng *rng, int perspective, enum picture_kind kind)
{
    struct setup s = {.map = picture_random(h, rng, picture_view(67, 45, perspective), kind, 0.5)};
    picture_invent(&s.map, rng, 0.7, 5);
    s.args = (struct shadow_test_args){.view = s.map.view, .loss = 255, .step = 1, .alone = 1, .samples = 1};
    s.args.window[0] = (float)s.map.view.origin_x;
    s.args.window[1] = (float)s.map.view.origin_y;
    s.args.window[2] = (float)(s.map.view.origin_x + (int32_t)s.map.view.width);
    s.args.window[3] = (float)(s.map.view.origin_y + (int32_t)s.map.view.height);
    s.args.instance.has_normals = 1;
    for (int i = 0; i < PT_SPACINGS; i++)
        s.args.instance.spacing[i] = (float)(1e-3 * pow(1.1, i));
    for (int i = 0; i < 9; i++)
        s.args.instance.normal_matrix[i] = (float)rng_range(rng, -1.0, 1.0);
    s.positions = harness_alloc(h, SLOTS * 12);
    s.surfels = harness_alloc(h, SLOTS * 4);
    s.words = harness_alloc(h, WORDS * 4);
    uint8_t *shown = harness_alloc(h, SLOTS);
    uint32_t words;
    s.opacities = harness_alloc(h, s.map.count + 4);
    for (size_t i = 0; i < s.map.count; i++)
        s.opacities[i] = (uint8_t)rng_next(rng);
    s.args.caster = s.map.id_base;
    for (uint32_t i = 0; i < SLOTS; i++) {
        s.surfels[i] = (uint32_t)rng_next(rng) | (rng_below(rng, 10) ? 0 : PT_NORMAL_NONE);
        shown[i] = (uint8_t)rng_below(rng, 2);
    }
    s.marks = marks_of(h, shown, SLOTS, 1, &words);
    for (uint32_t c = 0; c < CHUNKS; c++) {
        s.chunks[c] = (struct chunk_view){.first = 1024 * c, .count = POINTS / CHUNKS, .padded = 1008};
        set_chunk(&s.map.view, &s.chunks[c]);
        for (uint32_t i = 0; i < s.chunks[c].count; i++) {
            place(rng, &s, c, i);
        }
    }
    points_settle(s.chunks, CHUNKS, s.positions);
    return s;
}

static void check(struct harness *h, const struct setup *s, uint32_t base, double most_open)
{
    struct shadow_test_args args = s->args;
    size_t count = s->map.count, open = 0;
    uint32_t differs = 0, expected_differs = 0;
    uint8_t *written = harness_alloc(h, WORDS);
    args.base = base;
    struct pt_buffer *keys = harness_buffer(h, s->map.keys, count * 8), *from = harness_buffer(h, s->map.from, count * 4);
    struct pt_buffer *deff = harness_buffer(h, s->map.deff, count * 4);
    struct pt_buffer *chunks = harness_buffer(h, s->chunks, sizeof s->chunks);
    struct pt_buffer *positions = points_positions(h, s->chunks, CHUNKS, s->positions, SLOTS);
    struct pt_buffer *surfels = harness_buffer(h, s->surfels, SLOTS * 4),
                     *marks = harness_buffer(h, s->marks, marks_size(SLOTS));
    struct pt_buffer *words = harness_buffer(h, s->words, WORDS * 4), *flag = harness_buffer(h, &differs, 4);
    struct pt_buffer *opacities = harness_buffer(h, s->opacities, count + 4);
    HARNESS_RUN(h, shadow_test, &args, keys, from, deff, chunks, positions, surfels, marks, words, flag, opacities);
    const uint32_t *got = harness_read(h, words), *got_flag = harness_read(h, flag);
    harness_same(h, "words", got, WORDS, 4, 1, WORDS);
    struct ref_planes planes = picture_planes(&s->map);
    planes.surfels = s->surfels;
    planes.opacities = s->opacities;
    for (uint32_t c = 0; c < CHUNKS; c++)
        for (uint32_t i = 0; i < s->chunks[c].count; i++) {
            uint32_t id = s->chunks[c].first + i;
            if (args.marked && !ref_shown(s->marks, id))
                continue;
            const uint32_t at = base + args.step * (args.marked ? ref_shown_place(s->marks, id) : id), word = s->words[at];
            written[at] = 1;
            enum ref_truth truth = ref_shadow_test(&args, &planes, &s->chunks[c], s->positions, i);
            struct shadow_test_args own = args;
            if (!ref_shadow_test_loss(&args, &planes, &s->chunks[c], s->positions, i, &own.loss)) {
                open++;
                continue;
            }
            uint32_t dark = ref_shadow_word(&own, word, 1), light = ref_shadow_word(&own, word, 0), now = got[at];
            int undone = !args.alone && !args.close; // what the sample lost so far is in the upper bits
            expected_differs |= (args.alone || args.close) &&
                                (now & PT_SHADOW_SUM) != args.samples * (now - (word & PT_SHADOW_SUM));
            open += truth == REF_UNSURE;
            if ((truth == REF_UNSURE && now != dark && now != light) || (truth == REF_YES && now != dark) ||
                (truth == REF_NO && now != light))
                harness_fail(h, "word", (int)id, (int)c, "got %08x, expected %08x%s%s", now, truth == REF_NO ? light : dark,
                             truth == REF_UNSURE ? " or lit" : "", undone ? " (open sample)" : "");
        }
    if (args.compare && !open)
        HARNESS_CHECK(h, (*got_flag != 0) == (expected_differs != 0));
    for (uint32_t i = 0; i < WORDS; i++)
        if (!written[i] && got[i] != s->words[i])
            harness_fail(h, "another's", (int)i, 0, "was written");
    harness_unsure(h, open, POINTS, most_open);
}

static void maps(struct harness *h)
{
    for (int p = 0; p < 2; p++)
        for (int kind = 0; kind < PICTURE_KINDS; kind++) {
            struct rng rng = {(uint64_t)kind};
            struct setup s = make(h, &rng, p, (enum picture_kind)kind);
            check(h, &s, 0, TOL_UNSURE_SHARE);
            s.args.instance.has_normals = 0;
            check(h, &s, 7, TOL_UNSURE_SHARE);
        }
}

static void marks(struct harness *h)
{
    struct rng rng = {20};
    struct setup s = make(h, &rng, 1, PICTURE_SURFACES);
    s.args.marked = 1;
    s.args.step = LIGHTS;
    for (uint32_t light = 0; light < LIGHTS; light++)
        check(h, &s, light, TOL_UNSURE_SHARE);
}

static void window(struct harness *h)
{
    struct rng rng = {21};
    struct setup s = make(h, &rng, 1, PICTURE_SURFACES);
    for (int k = 0; k < 2; k++) {
        s.args.window[k] += 9.0f;
        s.args.window[2 + k] -= 9.0f;
    }
    check(h, &s, 0, TOL_UNSURE_SHARE);
    memset(s.args.window, 0, sizeof s.args.window); // nothing counts
    check(h, &s, 0, TOL_UNSURE_SHARE);
}

// A sample of several maps, of transparent casters among them; later samples upon earlier ones.
static void samples(struct harness *h)
{
    static const uint32_t losses[] = {255, 1, 77, 128, 254};
    for (size_t i = 0; i < 5; i++)
        for (uint32_t mode = 0; mode < 3; mode++) {
            struct rng rng = {30 + i};
            struct setup s = make(h, &rng, 1, PICTURE_SURFACES);
            s.args.loss = losses[i];
            s.args.alone = mode == 0;
            s.args.close = mode == 1;
            s.args.samples = 5;
            s.args.compare = 1;
            for (uint32_t k = 0; k < WORDS; k++)
                s.words[k] = rng_below(&rng, 4 * 255 + 1) | (mode ? rng_below(&rng, 256) << PT_SHADOW_SHIFT : 0);
            check(h, &s, 0, TOL_UNSURE_SHARE);
        }
}

// Casters whose points have opacities of their own, 0 and 255 among them.
static void faint(struct harness *h)
{
    for (uint32_t mode = 0; mode < 3; mode++)
        for (int kind = 0; kind < PICTURE_KINDS; kind++) {
            struct rng rng = {60 + mode};
            struct setup s = make(h, &rng, kind % 2, (enum picture_kind)kind);
            s.args.faint = 1;
            s.args.loss = mode == 2 ? 99 : 255;
            s.args.alone = mode == 0;
            for (size_t i = 0; i < s.map.count; i += 7)
                s.opacities[i] = i % 2 ? 255 : 0;
            check(h, &s, 0, TOL_UNSURE_SHARE);
        }
}

// What early stops ask: all samples alike, or one point of one sample not.
static void agreement(struct harness *h)
{
    for (uint32_t odd = 0; odd < 2; odd++) {
        struct rng rng = {40};
        struct setup s = make(h, &rng, 1, PICTURE_SURFACES);
        memset(s.args.window, 0, sizeof s.args.window); // everything is lit
        s.args.samples = 4;
        s.args.compare = 1;
        s.words[SLOTS / 2] = odd ? 255 : 0;
        check(h, &s, 0, TOL_UNSURE_SHARE);
    }
}

// Reference alone: a wall seen head-on, a point before and behind it; a stray texel casts no shadow, a line of three does.
static void sanity(struct harness *h)
{
    uint64_t keys[9];
    uint32_t from[9], surfels = PT_NORMAL_NONE;
    float deff[9], positions[3 * 16] = {0};
    struct shadow_test_args args = {
        .view = {.width = 3, .height = 3, .ray_x0 = -1.5f, .ray_xs = 1.0f, .ray_y0 = -1.5f, .ray_ys = 1.0f, .footprint = 1e-3f},
        .loss = 255,
        .alone = 1,
        .window = {0, 0, 3, 3},
        .samples = 1};
    struct chunk_view chunk = {.count = 1, .padded = 16};
    for (uint32_t i = 0; i < 9; i++) {
        keys[i] = ref_key(2.0f, i);
        from[i] = i;
        deff[i] = 0.5f;
    }
    args.instance.spacing[0] = 0.1f;
    set_chunk(&args.view, &chunk);
    struct ref_planes planes = {.keys = keys, .from = from, .deff = deff, .surfels = &surfels};
    positions[32] = -2.45f; // within what the map's own surface allows
    HARNESS_CHECK(h, ref_shadow_test(&args, &planes, &chunk, positions, 0) == REF_NO);
    positions[32] = -2.55f;
    HARNESS_CHECK(h, ref_shadow_test(&args, &planes, &chunk, positions, 0) == REF_YES);
    keys[0] = ref_key(2.2f, 0); // one neighbour is farther
    HARNESS_CHECK(h, ref_shadow_test(&args, &planes, &chunk, positions, 0) == REF_NO);
    keys[0] = REF_EMPTY_KEY; // the surface ends there: 20 times 0.2
    positions[32] = -5.95f;
    HARNESS_CHECK(h, ref_shadow_test(&args, &planes, &chunk, positions, 0) == REF_NO);
    positions[32] = -6.05f;
    HARNESS_CHECK(h, ref_shadow_test(&args, &planes, &chunk, positions, 0) == REF_YES);
    keys[0] = ref_key(2.2f, 0);
    positions[32] = -2.55f;
    args.instance.has_normals = 1;
    surfels = 4095u | 4095u << 13; // towards the light: 0.2
    for (int k = 0; k < 9; k += 4)
        args.instance.normal_matrix[k] = 1.0f;
    HARNESS_CHECK(h, ref_shadow_test(&args, &planes, &chunk, positions, 0) == REF_YES);
    positions[32] = -2.19f;
    HARNESS_CHECK(h, ref_shadow_test(&args, &planes, &chunk, positions, 0) == REF_NO);
    positions[32] = -1.0f;
    HARNESS_CHECK(h, ref_shadow_test(&args, &planes, &chunk, positions, 0) == REF_NO);
    positions[32] = -2.55f;
    for (uint32_t i = 0; i < 9; i++)
        keys[i] = i == 4 ? keys[i] : REF_EMPTY_KEY;
    HARNESS_CHECK(h, ref_shadow_test(&args, &planes, &chunk, positions, 0) == REF_NO);
    keys[3] = keys[5] = keys[4];
    HARNESS_CHECK(h, ref_shadow_test(&args, &planes, &chunk, positions, 0) == REF_YES);
    for (uint32_t i = 0; i < 9; i++)
        keys[i] = ref_key(i == 4 ? 1.5f : i == 0 ? 3.6f : 1.5f, i); // in perspective: beyond 1.5 + 4 * 0.5 lies another surface
    args.view.perspective = 1;
    args.instance.has_normals = 0;
    chunk = (struct chunk_view){.count = 1, .padded = 16};
    set_chunk(&args.view, &chunk);
    HARNESS_CHECK(h, ref_shadow_test(&args, &planes, &chunk, positions, 0) == REF_YES);
    keys[0] = ref_key(3.4f, 0);
    HARNESS_CHECK(h, ref_shadow_test(&args, &planes, &chunk, positions, 0) == REF_NO);
    args.loss = 128;
    HARNESS_CHECK(h, ref_shadow_word(&args, 255, 1) == 255 + 128 && ref_shadow_word(&args, 255, 0) == 255);
}

// [D 6] tells of two ways: a test of each point against the map; and taking the nearest points of what is within reach of the
// map again and again, marking their ids, until nothing is left. Both mark the same points.
static void two_ways(struct harness *h)
{
    for (int p = 0; p < 2; p++)
        for (uint32_t normals = 0; normals < 2; normals++) {
            struct rng rng = {50};
            struct setup s = make(h, &rng, p, PICTURE_SURFACES);
            for (int i = 0; i < 8; i++) // hardly a hole: without normals little is dark beside one
                picture_invent(&s.map, &rng, 1.0, 5);
            struct ref_planes planes = picture_planes(&s.map);
            planes.surfels = s.surfels;
            s.args.instance.has_normals = normals;
            uint64_t *nearest = harness_alloc(h, s.map.count * 8);
            uint8_t *marked = harness_alloc(h, SLOTS);
            uint32_t rounds = 0, found = 1, lit = 0, dark = 0;
            for (; found; rounds++) {
                found = 0;
                for (size_t i = 0; i < s.map.count; i++)
                    nearest[i] = REF_EMPTY_KEY;
                for (uint32_t c = 0; c < CHUNKS; c++)
                    for (uint32_t i = 0; i < s.chunks[c].count; i++) {
                        uint32_t id = s.chunks[c].first + i;
                        struct ref_place place = ref_place(&s.args.view, &s.chunks[c], s.positions, i);
                        // what the map does not reach is discarded, what is marked left out
                        if (marked[id] || !place.known ||
                            ref_shadow_test(&s.args, &planes, &s.chunks[c], s.positions, i) != REF_NO)
                            continue;
                        double x = floor(0.5 * (place.x.lo + place.x.hi)), y = floor(0.5 * (place.y.lo + place.y.hi));
                        x -= s.args.view.origin_x;
                        y -= s.args.view.origin_y;
                        if (!(x >= 0.0 && y >= 0.0 && x < s.args.view.width && y < s.args.view.height)) {
                            marked[id] = 1; // outside the map: lit
                            continue;
                        }
                        uint64_t key = ref_key((float)fmax(0.5 * (place.z.lo + place.z.hi), 0.0), id),
                                 *at = &nearest[(size_t)(y * s.args.view.width + x)];
                        *at = key < *at ? key : *at;
                    }
                for (size_t i = 0; i < s.map.count; i++)
                    if (nearest[i] != REF_EMPTY_KEY)
                        found = marked[ref_key_id(nearest[i])] = 1;
            }
            for (uint32_t c = 0; c < CHUNKS; c++)
                for (uint32_t i = 0; i < s.chunks[c].count; i++) {
                    uint32_t id = s.chunks[c].first + i;
                    struct ref_place place = ref_place(&s.args.view, &s.chunks[c], s.positions, i);
                    int is_lit = ref_shadow_test(&s.args, &planes, &s.chunks[c], s.positions, i) == REF_NO;
                    lit += (uint32_t)is_lit;
                    dark += (uint32_t)!is_lit;
                    if (place.known && is_lit != marked[id])
                        harness_fail(h, "ways", (int)id, (int)c, "tested %s, marked %s", is_lit ? "lit" : "dark",
                                     marked[id] ? "lit" : "dark");
                }
            HARNESS_CHECK(h, rounds > 3 && lit > POINTS / 10 && dark > POINTS / 10);
        }
}

static void packed(struct harness *h)
{
    points_packed(h, maps);
    points_packed(h, samples);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"packed positions", packed, 0},
        {"sanity", sanity, 1},
        {"two ways mark the same points", two_ways, 1},
        {"maps of all kinds", maps, 0},
        {"marked points only", marks, 0},
        {"windows", window, 0},
        {"samples of several maps", samples, 0},
        {"points of opacities of their own", faint, 0},
        {"agreement", agreement, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
