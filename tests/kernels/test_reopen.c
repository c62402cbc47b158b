// SPDX-License-Identifier: GPL-3.0-or-later
// reopen: what is found, shown and taken back, by the reference; hard stations; devices agree to the bit.
#include "harness.h"
#include "shared/filling.h"

#include <math.h>
#include <string.h>

enum { STATIONS = 5, ACROSS = 24, CELLS = 6 * ACROSS * ACROSS };

struct setup {
    struct picture picture;
    struct {
        struct reopen_args args;
        struct station_args stations[STATIONS];
    } all;
    uint32_t *words;
    float *away, *color;
    uint64_t *kept;
};

static uint32_t bits_of(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

// Turned, stretched, mirrored for every other seed.
static void random_rows(struct rng *rng, float rows[9])
{
    float a[3], b[3];
    rng_direction(rng, a);
    do
        rng_direction(rng, b);
    while (fabsf(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) > 0.9f);
    for (int k = 0; k < 3; k++) {
        rows[k] = a[k];
        rows[3 + k] = 0.7f * b[k];
        rows[6 + k] = 1.6f * (a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]);
    }
}

static struct setup make(struct harness *h, struct rng *rng, enum picture_kind kind, int perspective)
{
    struct setup s = {.picture = picture_random(h, rng, picture_view(67, 45, perspective), kind, 0.4)};
    const size_t count = s.picture.count;
    picture_invent(&s.picture, rng, 0.8, 9);
    s.words = harness_alloc(h, STATIONS * CELLS / 2 * 4);
    s.away = harness_alloc(h, count * 4);
    s.color = harness_alloc(h, count * 16);
    s.kept = harness_alloc(h, count * 8);
    s.all.args = (struct reopen_args){.view = s.picture.view,
                                      .id_base = s.picture.id_base,
                                      .id_first = (uint32_t)count / 8,
                                      .id_count = (uint32_t)count / 2,
                                      .first = 1,
                                      .stations = STATIONS,
                                      .discs = rng_below(rng, 2),
                                      .eye_z = perspective ? 0.0f : 0.3f};
    random_rows(rng, s.all.args.rows);
    for (uint32_t i = 0; i < STATIONS * CELLS / 2; i++)
        for (int k = 0; k < 2; k++) {
            const float range = (float)exp2(rng_range(rng, -4.0, 12.0));
            const uint32_t value = rng_below(rng, 3) ? (bits_of(range) - bits_of(0x1p-5f)) >> PT_SIGHT_SHIFT : 0;
            s.words[i] |= value << 16 * k;
        }
    for (uint32_t i = 0; i < STATIONS; i++) {
        s.all.stations[i] = (struct station_args){
            .grow = 1.0201f, .first = i * CELLS, .across = ACROSS, .base = bits_of(0x1p-5f)};
        for (int k = 0; k < 3; k++)
            s.all.stations[i].eye[k] = i ? (float)rng_range(rng, -8.0, 8.0) : 0.0f; // the first stands where the camera does
    }
    s.all.stations[1].across = 7;
    for (size_t i = 0; i < count; i++) {
        s.away[i] = (float)rng_range(rng, 0.0, 8.0);
        s.kept[i] = rng_below(rng, 3)
                        ? ref_key((float)rng_range(rng, 0.5, 50.0), s.picture.id_base + rng_below(rng, (uint32_t)count))
                        : REF_EMPTY_KEY;
        for (int k = 0; k < 4; k++)
            s.color[4 * i + (size_t)k] = (float)rng_unit(rng);
    }
    return s;
}

struct drawn {
    const uint64_t *keys, *kept;
    const uint32_t *from;
    const float *limit, *color;
};

static struct drawn run(struct harness *h, const struct setup *s)
{
    const size_t count = s->picture.count;
    float *unset = harness_alloc(h, count * 4);
    for (size_t i = 0; i < count; i++)
        unset[i] = -7.0f;
    struct pt_buffer *buffers[8] = {harness_buffer(h, s->picture.keys, count * 8),
                                    harness_buffer(h, s->picture.from, count * 4),
                                    harness_buffer(h, s->picture.deff, count * 4),
                                    harness_buffer(h, s->away, count * 4),
                                    harness_buffer(h, s->words, STATIONS * CELLS / 2 * 4),
                                    harness_buffer(h, unset, count * 4),
                                    harness_buffer(h, s->kept, count * 8),
                                    harness_buffer(h, s->color, count * 16)};
    harness_run(h, PT_KERNEL_reopen, &s->all, sizeof s->all, buffers, 8);
    struct drawn out = {harness_read(h, buffers[0]), harness_read(h, buffers[6]), harness_read(h, buffers[1]),
                        harness_read(h, buffers[5]), harness_read(h, buffers[7])};
    harness_same(h, "keys", out.keys, count, 8, 1, s->picture.view.width);
    harness_same(h, "from", out.from, count, 4, 1, s->picture.view.width);
    harness_same(h, "limit", out.limit, count, 4, 1, s->picture.view.width);
    harness_same(h, "kept", out.kept, count, 8, 1, s->picture.view.width);
    harness_same(h, "color", out.color, 4 * count, 4, 4, s->picture.view.width);
    return out;
}

static enum ref_truth seen_at(const struct setup *s, int x, int y, double z)
{
    return ref_seen_through(&s->all.args, s->all.stations, s->words, x, y, z);
}

// What TAKE leaves: of a filled pixel what was kept, unless that is a disc's, closed and seen through as well.
static uint64_t left(const struct setup *s, int x, int y, size_t at, int *unsure)
{
    const uint64_t kept = s->kept[at];
    if (s->picture.from[at] == at)
        return REF_EMPTY_KEY;
    const int ours = !isinf(ref_key_z(kept)) &&
                     ref_key_id(kept) - s->all.args.id_base - s->all.args.id_first < s->all.args.id_count;
    if (!s->all.args.discs || !ours || !(s->away[at] > 4.0f))
        return kept;
    const enum ref_truth seen = seen_at(s, x, y, ref_key_z(kept));
    *unsure |= seen == REF_UNSURE;
    return seen == REF_YES ? REF_EMPTY_KEY : kept;
}

static void expect(struct harness *h, const char *label, int x, int y, int same, const char *what)
{
    if (!same)
        harness_fail(h, label, x, y, "%s", what);
}

static size_t check(struct harness *h, struct setup *s, size_t *unsure)
{
    struct ref_planes planes = picture_planes(&s->picture);
    planes.away = s->away;
    const struct drawn got = run(h, s);
    const struct reopen_args *args = &s->all.args;
    const int finds = args->phase == PT_REOPEN_FIND, takes = args->phase == PT_REOPEN_TAKE,
              shows = args->phase == PT_REOPEN_SHOW;
    size_t found = 0;
    for (int y = 0; y < (int)args->view.height; y++)
        for (int x = 0; x < (int)args->view.width; x++) {
            const size_t at = (size_t)y * args->view.width + (size_t)x;
            const uint64_t key = s->picture.keys[at];
            const int closed = ref_closed(args, &planes, x, y);
            const enum ref_truth seen = closed ? seen_at(s, x, y, ref_key_z(key)) : REF_NO;
            int open = seen == REF_UNSURE;
            const int taken = takes && seen == REF_YES;
            const uint64_t expected = finds && args->last ? REF_EMPTY_KEY : taken ? left(s, x, y, at, &open) : key;
            *unsure += (size_t)open;
            if (open)
                continue;
            found += seen == REF_YES;
            const float z = (float)ref_key_z(key), beyond = seen == REF_YES ? z + s->picture.deff[s->picture.from[at]] : -1.0f;
            const float limit = finds && (args->first || seen == REF_YES) ? beyond : -7.0f;
            const float red = shows && seen == REF_YES ? s->color[4 * at + 3] : s->color[4 * at];
            const float green = shows && seen == REF_YES ? 0.0f : s->color[4 * at + 1];
            expect(h, "key", x, y, got.keys[at] == expected, "is another");
            expect(h, "from", x, y, got.from[at] == (taken ? at : s->picture.from[at]), "is another");
            expect(h, "limit", x, y, got.limit[at] == limit, "is another");
            expect(h, "kept", x, y, got.kept[at] == (args->phase == PT_REOPEN_KEEP ? key : s->kept[at]), "is another");
            expect(h, "color", x, y,
                   got.color[4 * at] == red && got.color[4 * at + 1] == green && got.color[4 * at + 3] == s->color[4 * at + 3],
                   "is another");
        }
    return found;
}

static void phases(struct harness *h)
{
    size_t unsure = 0, pixels = 0;
    for (int kind = 0; kind < PICTURE_KINDS; kind++)
        for (uint32_t phase = 0; phase < 4; phase++)
            for (int perspective = 0; perspective < 2; perspective++) {
                struct rng rng = {(uint64_t)kind + 10 * phase + 100 * (uint64_t)perspective};
                struct setup s = make(h, &rng, (enum picture_kind)kind, perspective);
                s.all.args.phase = phase;
                s.all.args.first = perspective ? 1 : rng_below(&rng, 2);
                s.all.args.last = rng_below(&rng, 2);
                const size_t found = check(h, &s, &unsure);
                HARNESS_CHECK(h, kind == PICTURE_RANGE || phase == PT_REOPEN_KEEP || found > s.picture.count / 50);
                pixels += s.picture.count;
            }
    harness_unsure(h, unsure, pixels, TOL_UNSURE_SHARE);
}

// No station; empty sights; ranges without end; stations that are nowhere, at infinity, or beyond what is looked up.
static void hard(struct harness *h)
{
    size_t unsure = 0;
    for (int what = 0; what < 6; what++) {
        struct rng rng = {(uint64_t)what + 40};
        struct setup s = make(h, &rng, PICTURE_SURFACES, what % 2);
        s.all.args.stations = what ? 1 : 0;
        if (what == 1)
            memset(s.words, 0, STATIONS * CELLS / 2 * 4);
        if (what == 2) {
            memset(s.words, 0xFF, STATIONS * CELLS / 2 * 4);
            s.all.stations[0].base = PT_KEY_EMPTY_Z - (0xFFFFu << PT_SIGHT_SHIFT); // +inf
        }
        if (what >= 3)
            s.all.stations[0].eye[what % 3] = what == 3 ? NAN : what == 4 ? INFINITY : 1e25f;
        const size_t found = check(h, &s, &unsure);
        HARNESS_CHECK(h, (found > 0) == (what == 2));
    }
    HARNESS_CHECK(h, unsure < 100);
}

// Reference alone: a station behind the camera that looked 10 far straight ahead.
static void sanity(struct harness *h)
{
    static uint32_t words[CELLS / 2];
    struct reopen_args args = {
        .view = {.width = 1, .height = 1, .perspective = 1}, .stations = 1, .rows = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    const struct station_args station = {.eye = {0, 0, -1}, .grow = 1.0201f, .across = ACROSS, .base = bits_of(0x1p-5f)};
    const uint32_t cell = 5 * ACROSS * ACROSS + ACROSS / 2 * ACROSS + ACROSS / 2; // down -z
    args.view.ray_x0 = args.view.ray_y0 = 0.01f;
    words[cell / 2] |= (bits_of(10.0f) - station.base) >> PT_SIGHT_SHIFT << cell % 2 * 16;
    HARNESS_CHECK(h, ref_seen_through(&args, &station, words, 0, 0, 8.8) == REF_YES);
    HARNESS_CHECK(h, ref_seen_through(&args, &station, words, 0, 0, 9.1) == REF_NO);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {{"sanity", sanity, 1}, {"every phase", phases, 0}, {"hard stations", hard, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
