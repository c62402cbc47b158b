// SPDX-License-Identifier: GPL-3.0-or-later
// soft: balls along rays. The reference itself is held against numerical quadrature of the density [S Eq. 1, 5, 10, 11].
#include "harness.h"
#include "shared/balls.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- the reference against quadrature ---------------------------------------------------------------------------------------

struct place {
    double center[3], r, a, color[3];
};

enum { STEPS = 40000 };

// Marches along the ray from the origin: no closed form, no pieces.
static struct ref_soft march(const struct place *balls, uint32_t count, const double ray[3], double from, double to)
{
    struct ref_soft out = {.through = 1.0};
    const double step = (to - from) / STEPS;
    for (uint32_t k = 0; k < STEPS; k++) {
        const double s = from + (k + 0.5) * step;
        double lost = 0.0, weights = 0.0, color[3] = {0.0};
        for (uint32_t i = 0; i < count; i++) {
            const struct place *b = &balls[i];
            double square = 0.0, along = 0.0, apart = 0.0;
            for (int c = 0; c < 3; c++) {
                const double off = s * ray[c] - b->center[c];
                square += off * off;
                along += ray[c] * b->center[c];
                apart += b->center[c] * b->center[c];
            }
            if (square >= b->r * b->r)
                continue;
            const double weight = (1.0 - sqrt(fmax(apart - along * along, 0.0)) / b->r) * b->a;
            lost += -log1p(-b->a) * (1.0 - sqrt(square) / b->r) * step / b->r;
            out.density += 3.0 / (3.14159265358979323846 * b->r * b->r) * (1.0 - sqrt(square) / b->r) * step / b->r;
            weights += weight;
            for (int c = 0; c < 3; c++)
                color[c] += weight * b->color[c];
        }
        for (int c = 0; c < 3 && weights > 0.0; c++)
            out.color[c] += out.through * -expm1(-lost) * color[c] / weights;
        out.through *= exp(-lost);
    }
    return out;
}

// The same balls as the reference takes them.
static struct ref_soft exactly(const struct place *balls, uint32_t count, const double ray[3], double from, double to,
                               const struct ref_soft_model *model, uint32_t shells)
{
    struct ref_ball *list = calloc(count, sizeof *list);
    for (uint32_t i = 0; i < count; i++) {
        const struct place *b = &balls[i];
        double along = 0.0, apart = 0.0;
        for (int c = 0; c < 3; c++) {
            along += ray[c] * b->center[c];
            apart += b->center[c] * b->center[c];
            list[i].color[c] = b->color[c];
        }
        list[i].r = b->r;
        list[i].along = along;
        list[i].d = sqrt(fmax(apart - along * along, 0.0)) / b->r;
        list[i].a = b->a;
        list[i].w = 1.0;
        list[i].shells = shells;
    }
    const struct ref_soft out = ref_soft_ray(list, count, model, from, to);
    free(list);
    return out;
}

static const struct ref_soft_model base = {PT_SOFT_BASE, PT_SOFT_EVEN};

static void hold(struct harness *h, const char *what, const struct place *balls, uint32_t count, double from, double to)
{
    const double ray[3] = {0.0, 0.0, 1.0};
    const struct ref_soft expected = march(balls, count, ray, from, to), got = exactly(balls, count, ray, from, to, &base, 1);
    if (!harness_near(got.through, expected.through, 1e-4) ||
        !harness_near(got.density, expected.density, 1e-4 * expected.density + 1e-9))
        harness_fail(h, what, 0, 0, "through %.9g, density %.9g; quadrature has %.9g, %.9g", got.through, got.density,
                     expected.through, expected.density);
    for (int c = 0; c < 3; c++)
        if (!harness_near(got.color[c], expected.color[c], 1e-4))
            harness_fail(h, what, 0, 0, "color %d: %.9g, quadrature has %.9g", c, got.color[c], expected.color[c]);
}

// One ball, two that intersect, a chain of ten, the eye inside; radii from 1e-3 to 1e3.
static void quadrature(struct harness *h)
{
    static const double radii[] = {1e-3, 0.04, 1.0, 37.0, 1e3};
    for (size_t k = 0; k < sizeof radii / sizeof radii[0]; k++) {
        const double r = radii[k];
        struct place chain[10];
        for (double d = 0.0; d < 1.0; d += 0.19) {
            const struct place one = {{d * r, 0.0, 3.0 * r}, r, 0.9, {1.0, 0.5, 0.1}};
            hold(h, "one ball", &one, 1, 1.5 * r, 4.5 * r);
            hold(h, "the eye inside", &one, 1, 2.7 * r, 4.5 * r);
            hold(h, "a wall inside", &one, 1, 1.5 * r, 3.4 * r);
            const struct place two[2] = {one, {{0.0, 0.5 * r, 3.8 * r}, 1.3 * r, 0.6, {0.0, 0.2, 1.0}}};
            hold(h, "two balls", two, 2, 1.5 * r, 5.5 * r);
        }
        for (int i = 0; i < 10; i++)
            chain[i] = (struct place){{0.3 * r * sin(i), 0.3 * r * cos(2.0 * i), (2.0 + 0.6 * i) * r},
                                      (0.7 + 0.05 * i) * r,
                                      0.05 + 0.09 * i,
                                      {i % 2, i % 3, i % 5}};
        hold(h, "a chain of ten", chain, 10, 0.5 * r, 10.0 * r);
    }
}

// d = 0 and d = r, pieces of no length, radii of nearly nothing.
static void ends(struct harness *h)
{
    HARNESS_CHECK(h, harness_near(ref_soft_integral(0.0, -1.0, 1.0), 1.0, 1e-15));
    HARNESS_CHECK(h, ref_soft_integral(1.0, 0.0, 0.0) == 0.0);
    HARNESS_CHECK(h, ref_soft_integral(0.3, 0.2, 0.2) == 0.0);
    HARNESS_CHECK(h, harness_near(ref_soft_integral(1e-12, -1.0, 1.0), 1.0, 1e-12));
    const struct place solid = {{0.0, 0.0, 1.0}, 1e-30, 0.5, {1.0, 1.0, 1.0}},
                       clear = {{0.0, 0.0, 1.0}, 1.0, 0.0, {1.0, 1.0, 1.0}};
    const double ray[3] = {0.0, 0.0, 1.0};
    HARNESS_CHECK(h,
                  harness_near(exactly(&solid, 1, ray, 0.0, 2.0, &base, 1).through, 1.0, 1e-4) ||
                      harness_near(exactly(&solid, 1, ray, 0.0, 2.0, &base, 1).through, 0.5, 1e-4)); // narrower than s resolves
    HARNESS_CHECK(h, exactly(&clear, 1, ray, 0.0, 2.0, &base, 1).through == 1.0);
}

// At a = 0.9 and half a radius: what the three weights of shells come to, and what Base has.
static void shells(struct harness *h)
{
    const struct place one = {{0.5, 0.0, 3.0}, 1.0, 0.9, {1.0, 1.0, 1.0}};
    const double ray[3] = {0.0, 0.0, 1.0}, of_base = 1.0 - exactly(&one, 1, ray, 1.0, 5.0, &base, 1).through;
    static const double limits[] = {0.7095, 0.546, 0.236};
    double before = 1.0;
    HARNESS_CHECK(h, harness_near(of_base, 0.7095, 5e-5));
    for (uint32_t mu = 0; mu < 3; mu++) {
        const struct ref_soft_model model = {PT_SOFT_CONCENTRIC, mu};
        HARNESS_CHECK(h, harness_near(1.0 - exactly(&one, 1, ray, 1.0, 5.0, &model, 1000).through, limits[mu], 1.5e-3));
    }
    for (uint32_t count = 4; count <= 1024; count *= 4) { // to Base as shells become more
        const struct ref_soft_model model = {PT_SOFT_CONCENTRIC, PT_SOFT_EVEN};
        const double off = fabs(1.0 - exactly(&one, 1, ray, 1.0, 5.0, &model, count).through - of_base);
        harness_note(h, "%u shells: opacity off by %.2g", count, off);
        HARNESS_CHECK(h, off < 0.5 * before);
        before = off;
    }
    HARNESS_CHECK(h, before < 1e-3);
}

// [S Eq. 22]: at the threshold the cone a (1 - d/r), beyond l_m the model's own opacity.
static void modulation(struct harness *h)
{
    struct ref_ball ball = {.r = 2.0, .along = 5.0, .d = 0.3, .a = 0.8, .w = 0.0};
    HARNESS_CHECK(h, harness_near(1.0 - ref_soft_ray(&ball, 1, &base, 0.0, 10.0).through, 0.8 * 0.7, 1e-12));
    ball.w = 1.0;
    const double own = 1.0 - ref_soft_ray(&ball, 1, &base, 0.0, 10.0).through;
    ball.w = 0.25;
    HARNESS_CHECK(h, harness_near(1.0 - ref_soft_ray(&ball, 1, &base, 0.0, 10.0).through, 0.75 * 0.56 + 0.25 * own, 1e-12));
    HARNESS_CHECK(h, harness_near(ref_soft_disc(0.09, 0.8, 0.0), 0.56, 1e-12) && ref_soft_disc(0.0, 0.8, 1.0) == 0.8);
    HARNESS_CHECK(h, harness_near(ref_soft_disc(1.0, 0.8, 1.0), 0.0, 1e-15) && ref_soft_disc(1.0, 0.8, 0.0) == 0.0);
}

// ---- the kernel -------------------------------------------------------------------------------------------------------------

struct setup {
    struct soft_args args;
    uint32_t *records;
    uint64_t *keys;
    size_t pixels;
    size_t lists; // bytes of the bins for lists, of each record; 0: 16
};

static void put(struct setup *s, uint32_t i, double x, double y, double z, double r, double a, double w, const double color[3])
{
    const double scale = s->args.view.perspective ? z : 1.0;
    const float numbers[7] = {(float)(x * scale), (float)(y * scale), (float)z,       (float)r,
                              (float)color[0],    (float)color[1],    (float)color[2]};
    memcpy(s->records + PT_SOFT_WORDS * i, numbers, sizeof numbers);
    s->records[PT_SOFT_WORDS * i + 7] = (uint32_t)(a * (double)PT_SOFT_STEPS + 0.5) << PT_SOFT_SHIFT |
                                        (uint32_t)(w * 255.0 + 0.5);
}

// Balls of 1 to 30 pixels about a window of a larger picture, solid surfaces here and there behind and between.
static struct setup look_at(struct harness *h, struct rng *rng, uint32_t width, uint32_t height, int perspective,
                            uint32_t model, uint32_t records)
{
    struct setup s = {.args = {.view = picture_view(width, height, perspective),
                               .records = (records + 15) / 16 * 16,
                               .model = model,
                               .z_from = -1.0f,
                               .z_to = INFINITY,
                               .crop_width = width,
                               .density = 1}};
    struct view_args *view = &s.args.view;
    s.pixels = (size_t)width * height;
    s.args.view.rect[2] = width;
    s.args.view.rect[3] = height;
    s.records = harness_alloc(h, 4 * PT_SOFT_WORDS * (size_t)s.args.records);
    s.keys = harness_alloc(h, 8 * s.pixels);
    for (size_t i = 0; i < s.pixels; i++)
        s.keys[i] = rng_below(rng, 3) ? REF_EMPTY_KEY : ref_key((float)rng_range(rng, 3.0, 9.0), 5);
    for (uint32_t i = 0; i < s.args.records; i++) {
        const double color[3] = {rng_unit(rng), rng_range(rng, 0.0, 3.0), rng_unit(rng)}, z = rng_range(rng, 2.0, 8.0);
        const double pixels = rng_below(rng, 8) ? rng_range(rng, 1.0, 6.0) : rng_range(rng, 6.0, 30.0);
        put(&s, i, view->origin_x + rng_range(rng, -8.0, width + 8.0), view->origin_y + rng_range(rng, -8.0, height + 8.0), z,
            pixels * ref_footprint(view, z), rng_range(rng, 0.05, 0.95), rng_below(rng, 3) ? 1.0 : rng_unit(rng), color);
        if (i >= records || !rng_below(rng, 10))
            s.records[PT_SOFT_WORDS * i + 2] = PT_KEY_EMPTY_Z;
    }
    return s;
}

enum check { EVERYTHING = 1, ALPHA };

// What comes through balls that nothing cuts, whatever their order.
static double through_each(const struct setup *s, int x, int y)
{
    const struct ref_soft_model model = {s->args.model, s->args.mu};
    double through = 1.0;
    for (uint32_t i = 0; i < s->args.records; i++) {
        const struct ref_ball ball = ref_ball_at(&s->args, s->records, i, x, y);
        if (ball.d < 1.0)
            through *= ref_soft_ray(&ball, 1, &model, -INFINITY, INFINITY).through;
    }
    return through;
}

static void check_alpha(struct harness *h, const struct setup *s, const float *got, const float *before)
{
    for (size_t i = 0; i < s->pixels; i++) {
        const int x = (int)(i % s->args.view.width), y = (int)(i / s->args.view.width);
        const double through = through_each(s, x, y), wanted = 1.0 - through + through * (double)before[4 * i + 3];
        HARNESS_CHECK(h, through < 0.9 && through > 0.01);
        if (!harness_near(got[4 * i + 3], wanted, 3e-4))
            harness_fail(h, "alpha", x, y, "got %.9g, expected %.9g", (double)got[4 * i + 3], wanted);
    }
}

// Of the disc that is densest in its middle: what rounding at another one's rim is told against. 0 but for Express.
static double densest(const struct setup *s)
{
    double most = 0.0;
    for (uint32_t i = 0; i < s->args.records && s->args.model == PT_SOFT_EXPRESS; i++) {
        float r;
        memcpy(&r, &s->records[PT_SOFT_WORDS * i + 3], sizeof r);
        most = r > 0.0f ? fmax(most, (double)PT_SOFT_DISC / ((double)r * (double)r)) : most;
    }
    return most;
}

// Of every pixel. It takes longer than all devices together, so the first one's serves the others.
static const struct ref_soft *reference(struct harness *h, const struct setup *s, const float *reached)
{
    const struct ref_soft *kept = harness_kept(h);
    if (kept)
        return kept;
    struct ref_soft *out = harness_alloc(h, s->pixels * sizeof *out);
    for (size_t i = 0; i < s->pixels; i++)
        out[i] = ref_soft(&s->args, s->records, (int)(i % s->args.view.width), (int)(i / s->args.view.width),
                          (double)reached[i], ref_key_z(s->keys[i]));
    harness_keep(h, out, s->pixels * sizeof *out);
    return out;
}

static void run(struct harness *h, struct setup *s, enum check check)
{
    const uint32_t width = s->args.view.width;
    float *target = harness_alloc(h, 16 * s->pixels), *reached = harness_alloc(h, 4 * s->pixels);
    for (size_t i = 0; i < s->pixels; i++) {
        for (int k = 0; k < 4; k++)
            target[4 * i + k] = 0.05f * (float)(i % 7) + 0.1f * (float)k;
        reached[i] = i % 4 ? -1.0f : 4.0f;
    }
    struct pt_buffer *keys = harness_buffer(h, s->keys, 8 * s->pixels);
    struct pt_buffer *records = harness_buffer(h, s->records, 4 * PT_SOFT_WORDS * (size_t)s->args.records);
    const size_t room = 64 + (16 + (s->lists ? s->lists : 16)) * (size_t)s->args.records;
    struct pt_buffer *bins = harness_buffer(h, harness_alloc(h, room), room),
                     *before = harness_buffer(h, reached, 4 * s->pixels);
    struct pt_buffer *into = harness_buffer(h, target, 16 * s->pixels),
                     *density = harness_buffer(h, harness_alloc(h, 4 * s->pixels), 4 * s->pixels);
    HARNESS_RUN(h, soft, &s->args, keys, records, bins, before, into, density, NULL);
    const float *got = harness_read(h, into), *sums = harness_read(h, density), *went = harness_read(h, before);
    const double peak = densest(s);
    double worst = 0.0;
    if (check == ALPHA)
        check_alpha(h, s, got, target);
    const struct ref_soft *all = check == EVERYTHING ? reference(h, s, reached) : NULL;
    for (size_t i = 0; i < s->pixels && all; i++) {
        const int x = (int)(i % width), y = (int)(i / width);
        const double z = ref_key_z(s->keys[i]);
        const struct ref_soft expected = all[i];
        const double alpha = 1.0 - expected.through, left = 1.0 - (double)target[4 * i + 3];
        for (int k = 0; k < 4; k++) {
            const double own = k < 3 ? expected.color[k] : alpha, old = (double)target[4 * i + k];
            const double wanted = s->args.layered ? old + left * own : own + expected.through * old;
            worst = fmax(worst, fabs((double)got[4 * i + k] - wanted));
            if (!harness_near(got[4 * i + k], wanted, k < 3 ? 1e-3 : 3e-4)) // 2^-12 of light may be left
                harness_fail(h, "target", x, y, "channel %d: got %.9g, expected %.9g, %u fragments", k, got[4 * i + k], wanted,
                             expected.fragments);
        }
        const double beyond = fmax(z, (double)reached[i]);
        if (s->args.layered && s->args.last && went[i] != (float)beyond)
            harness_fail(h, "reached", x, y, "got %.9g, expected %.9g", went[i], beyond);
        if (!harness_near(sums[i], expected.density, 1e-3 * expected.density + 1e-5 * fmax(peak, 1.0)))
            harness_fail(h, "density", x, y, "got %.9g, expected %.9g", sums[i], expected.density);
    }
    harness_note(h, "off by %.2g at most", worst);
}

static void random_balls(struct harness *h)
{
    for (uint32_t model = 0; model < 3; model++)
        for (int perspective = 0; perspective < 2; perspective++)
            for (uint32_t layered = 0; layered < 3; layered++) {
                struct rng rng = {3 + model + 4 * layered};
                struct setup s = look_at(h, &rng, 67, 45, perspective, model, 300);
                s.args.layered = layered;
                s.args.last = layered == 1;
                s.args.mu = model == PT_SOFT_CONCENTRIC && layered ? PT_SOFT_EQ15 : PT_SOFT_EVEN;
                run(h, &s, EVERYTHING);
            }
}

// 10^4 balls over one pixel: all of them count, none is dropped. In pieces the reference of Base takes a minute for so many: 2000;
// of 10^4 it is held against that what comes through all is the product of what comes through each.
static void many(struct harness *h)
{
    for (uint32_t k = 0; k < 4; k++) {
        static const uint32_t models[] = {PT_SOFT_EXPRESS, PT_SOFT_CONCENTRIC, PT_SOFT_BASE, PT_SOFT_BASE};
        struct rng rng = {9};
        const uint32_t count = k == 3 ? 2000 : 10000;
        struct setup s = look_at(h, &rng, 2, 1, 1, models[k], count);
        for (uint32_t i = 0; i < count; i++) {
            const double color[3] = {rng_unit(&rng), rng_unit(&rng), 1.0}, z = rng_range(&rng, 2.0, 8.0);
            put(&s, i, s.args.view.origin_x + 1.0, s.args.view.origin_y + 0.5, z, 0.7 * ref_footprint(&s.args.view, z), 4e-4,
                1.0, color);
        }
        s.keys[0] = s.keys[1] = REF_EMPTY_KEY;
        s.args.shells = k == 1 ? 1 : 3; // OpenGL in software takes half a minute for 3 of each
        run(h, &s, k == 1 || k == 2 ? ALPHA : EVERYTHING);
    }
}

// Memory is bounded by the records: with room for no more than one list of all of them, tiles go in batches, and all balls count.
static void bounded(struct harness *h)
{
    for (uint32_t model = 0; model < 3; model++) {
        struct rng rng = {17};
        struct setup s = look_at(h, &rng, 40, 33, 1, model, 48);
        s.lists = 4;
        for (uint32_t i = 0; i < 48; i++) { // each over most of the tiles: 9
            const double color[3] = {rng_unit(&rng), 0.5, rng_unit(&rng)}, z = rng_range(&rng, 3.0, 8.0);
            put(&s, i, s.args.view.origin_x + rng_range(&rng, 10.0, 30.0), s.args.view.origin_y + rng_range(&rng, 8.0, 25.0), z,
                rng_range(&rng, 15.0, 40.0) * ref_footprint(&s.args.view, z), 0.03, 1.0, color);
        }
        run(h, &s, EVERYTHING);
    }
}

// No record at all, none that is drawn, one ball on one tile of many.
static void empty_tiles(struct harness *h)
{
    for (uint32_t model = 0; model < 3; model++) {
        struct rng rng = {19};
        struct setup s = look_at(h, &rng, 67, 45, 0, model, 0);
        s.args.records = 0;
        run(h, &s, EVERYTHING);
        s = look_at(h, &rng, 67, 45, 0, model, 16);
        for (uint32_t i = 0; i < 16; i++)
            s.records[PT_SOFT_WORDS * i + 2] = PT_KEY_EMPTY_Z;
        run(h, &s, EVERYTHING);
        const double white[3] = {1.0, 1.0, 1.0};
        put(&s, 5, s.args.view.origin_x + 40.0, s.args.view.origin_y + 20.0, 3.0, 3.0 * ref_footprint(&s.args.view, 3.0), 0.5,
            1.0, white);
        run(h, &s, EVERYTHING);
    }
}

// Radii from 1e-3 to 1e3 of the world, in scenes as large.
static void scales(struct harness *h)
{
    for (uint32_t model = 0; model < 3; model++)
        for (double scale = 1e-3; scale <= 1e3; scale *= 1e3) {
            struct rng rng = {23};
            struct setup s = look_at(h, &rng, 33, 17, 1, model, 40);
            for (uint32_t i = 0; i < s.args.records; i++) {
                float numbers[4];
                memcpy(numbers, s.records + PT_SOFT_WORDS * i, sizeof numbers);
                for (int k = 0; k < 4; k++)
                    numbers[k] *= (float)scale;
                memcpy(s.records + PT_SOFT_WORDS * i, numbers, sizeof numbers);
            }
            for (size_t i = 0; i < s.pixels; i++)
                s.keys[i] = REF_EMPTY_KEY;
            s.args.view.z_near *= (float)scale;
            run(h, &s, EVERYTHING);
        }
}

// The eye stands in a ball, whose centre may lie behind it.
static void inside(struct harness *h)
{
    for (uint32_t model = PT_SOFT_CONCENTRIC; model <= PT_SOFT_BASE; model++)
        for (double z = -0.5; z < 1.0; z += 0.3) {
            struct rng rng = {9};
            struct setup s = look_at(h, &rng, 33, 17, 1, model, 16);
            const double white[3] = {1.0, 1.0, 1.0};
            put(&s, 0, s.args.view.origin_x + 10.0, s.args.view.origin_y + 4.0, z, 2.0, 0.7, 1.0, white);
            run(h, &s, EVERYTHING);
        }
}

// ---- splats, one layer -------------------------------------------------------------------------------------------------------

// Random discs: what is nearest, and a radius of that behind it.
static void splats(struct harness *h)
{
    for (uint32_t model = PT_SOFT_SPLATS; model <= PT_SOFT_ONE_LAYER; model++)
        for (int perspective = 0; perspective < 2; perspective++)
            for (uint32_t layered = 0; layered < 3; layered++) {
                struct rng rng = {5 + model + 4 * layered};
                struct setup s = look_at(h, &rng, 67, 45, perspective, model, 300);
                s.args.layered = layered;
                s.args.last = layered == 1;
                run(h, &s, EVERYTHING);
            }
}

// One disc: its own colour all over it, opaque or as faint as it is; of two the farther one shows where it lies beyond a radius.
static void nearest(struct harness *h)
{
    struct ref_ball balls[2] = {{.z = 3.0, .r = 0.5, .square = 0.3, .a = 0.4, .w = 1.0, .color = {1.0, 0.5, 0.0}},
                                {.z = 3.6, .r = 0.5, .square = 0.0, .a = 0.9, .w = 1.0, .color = {0.0, 0.0, 1.0}, .record = 1}};
    struct ref_soft is = ref_soft_splats(balls, 2, 0, 0.0, 9.0);
    HARNESS_CHECK(h, is.through == 0.0 && harness_near(is.color[0], 1.0, 1e-12) && harness_near(is.color[2], 0.0, 1e-12));
    is = ref_soft_splats(balls, 2, 1, 0.0, 9.0);
    HARNESS_CHECK(h, harness_near(is.through, 0.6, 1e-12) && harness_near(is.color[1], 0.2, 1e-12));
    balls[1].z = 3.4;
    is = ref_soft_splats(balls, 2, 0, 0.0, 9.0);
    HARNESS_CHECK(h, is.fragments == 2 && is.color[2] > 0.5);
}

// ---- of a light's view ---------------------------------------------------------------------------------------------------------

// Random balls in slabs, in two passes: added up, and then summed. Of each texel and slab -ln of what comes through to its end.
static void check_veils(struct harness *h, struct setup *s, uint32_t veils)
{
    const size_t count = s->pixels * veils;
    const float ends[2] = {s->args.z_from, s->args.z_to};
    float *none = harness_alloc(h, 4 * count);
    double worst = 0.0;
    memset(none, 0, 4 * count);
    s->args.veils = veils;
    s->args.veil_from = 1.5f;
    s->args.veil_deep = 7.0f / (float)veils;
    const size_t room = 64 + 32 * (size_t)s->args.records;
    struct pt_buffer *keys = harness_buffer(h, s->keys, 8 * s->pixels);
    struct pt_buffer *records = harness_buffer(h, s->records, 4 * PT_SOFT_WORDS * (size_t)s->args.records);
    struct pt_buffer *bins = harness_buffer(h, harness_alloc(h, room), room), *veil = harness_buffer(h, none, 4 * count);
    for (int half = 0; half < 2; half++) { // parts: before z = 5, and behind it
        s->args.z_from = half ? 5.0f : ends[0];
        s->args.z_to = half ? ends[1] : 5.0f;
        HARNESS_RUN(h, soft, &s->args, keys, records, bins, NULL, NULL, NULL, veil);
    }
    struct soft_args whole = s->args;
    whole.z_from = ends[0];
    whole.records = 0;
    whole.last = 1;
    HARNESS_RUN(h, soft, &whole, keys, records, bins, NULL, NULL, NULL, veil);
    const float *got = harness_read(h, veil);
    whole.records = s->args.records;
    for (size_t i = 0; i < s->pixels; i++)
        for (uint32_t k = 0; k < veils; k++) {
            const double end = k + 1 == veils ? INFINITY : (double)s->args.veil_from + (k + 1.0) * (double)s->args.veil_deep;
            const double expected = ref_soft_veil(&whole, s->records, (int)(i % s->args.view.width),
                                                  (int)(i / s->args.view.width), end);
            worst = fmax(worst, fabs(exp(-expected) - exp(-(double)got[i * veils + k])));
            if (!harness_near(exp(-(double)got[i * veils + k]), exp(-expected), 1e-3) ||
                !harness_near(got[i * veils + k], expected, 1e-3 + 1e-3 * expected))
                harness_fail(h, "veil", (int)(i % s->args.view.width), (int)(i / s->args.view.width),
                             "slab %u: got %.9g, expected %.9g", k, (double)got[i * veils + k], expected);
        }
    harness_note(h, "light off by %.2g at most", worst);
}

static void veils(struct harness *h)
{
    static const uint32_t counts[] = {PT_SOFT_VEILS, 7, 1};
    for (uint32_t model = 0; model < 3; model++)
        for (int perspective = 0; perspective < 2; perspective++)
            for (int k = 0; k < 3; k++) {
                struct rng rng = {31 + model + 4 * (uint32_t)k};
                struct setup s = look_at(h, &rng, 37, 23, perspective, model, 120);
                check_veils(h, &s, counts[k]);
            }
}

// The light stands in a ball; and 3000 balls over one texel, as faint as 4e-4.
static void veils_at_ends(struct harness *h)
{
    const double white[3] = {1.0, 1.0, 1.0};
    for (uint32_t model = 0; model < 3; model++) {
        struct rng rng = {37};
        struct setup s = look_at(h, &rng, 33, 17, 1, model, 16);
        put(&s, 0, s.args.view.origin_x + 10.0, s.args.view.origin_y + 4.0, 0.3, 2.0, 0.7, 1.0, white);
        check_veils(h, &s, 16);
        s = look_at(h, &rng, 2, 1, 1, model, 3000);
        for (uint32_t i = 0; i < 3000; i++) {
            const double z = rng_range(&rng, 2.0, 8.0);
            put(&s, i, s.args.view.origin_x + 1.0, s.args.view.origin_y + 0.5, z, 0.7 * ref_footprint(&s.args.view, z), 4e-4,
                1.0, white);
        }
        s.args.shells = 3;
        check_veils(h, &s, 9);
    }
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"quadrature", quadrature, 1},
        {"ends", ends, 1},
        {"shells", shells, 1},
        {"modulation", modulation, 1},
        {"random balls", random_balls, 0},
        {"10000 balls a pixel", many, 0},
        {"bounded memory", bounded, 0},
        {"empty tiles", empty_tiles, 0},
        {"scales from 1e-3 to 1e3", scales, 0},
        {"the eye inside", inside, 0},
        {"splats and one layer", splats, 0},
        {"what is nearest", nearest, 1},
        {"slabs of a light's view", veils, 0},
        {"slabs, the light inside, many balls", veils_at_ends, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
