// SPDX-License-Identifier: GPL-3.0-or-later
// magnify: pixels that show the faces between cells.
#include "cells.h"
#include "shared/ranges.h"

#include <math.h>
#include <string.h>

enum { UNTOUCHED = -77 };

struct setup {
    struct magnify_args args;
    uint64_t *cells, *keys;
    float *places, *merged, *inclined, *limit, *away, *least, *most;
};

static struct setup make(struct harness *h, struct rng *rng, uint32_t width, uint32_t height, int perspective, float pixel,
                         enum cells_kind kind)
{
    struct setup s = {.args = {.view = picture_view(width, height, perspective), .gamma = 0.02f, .d_min = 0.01f}};
    struct view_args *view = &s.args.view, *cells = &s.args.cells;
    *cells = *view;
    cells->origin_x = (int32_t)floor(view->origin_x / (double)pixel) - 1;
    cells->origin_y = (int32_t)floor(view->origin_y / (double)pixel) - 1;
    cells->width = (uint32_t)(floor((view->origin_x + (double)width) / (double)pixel) + 2.0 - cells->origin_x);
    cells->height = (uint32_t)(floor((view->origin_y + (double)height) / (double)pixel) + 2.0 - cells->origin_y);
    cells->rect[0] = cells->rect[1] = 0;
    cells->rect[2] = cells->width;
    cells->rect[3] = cells->height;
    cells->ray_xs *= pixel;
    cells->ray_ys *= pixel;
    cells->footprint *= pixel;
    s.args.pixel = pixel;
    s.args.inverse = 1.0f / pixel;
    const size_t count = (size_t)cells->width * cells->height, pixels = (size_t)width * height;
    s.places = cells_random(h, rng, cells, kind);
    s.cells = harness_alloc(h, count * 8);
    s.merged = harness_alloc(h, count * 16);
    s.inclined = harness_alloc(h, count * 16);
    s.least = harness_alloc(h, count * 4);
    s.most = harness_alloc(h, count * 4);
    s.keys = harness_alloc(h, pixels * 8);
    s.limit = harness_alloc(h, pixels * 4);
    s.away = harness_alloc(h, pixels * 4);
    s.args.id_base = 491;
    s.args.id_first = 9;
    s.args.id_count = (uint32_t)count;
    s.args.most = 7.0f;
    s.args.cosine = 0.7f;
    for (size_t i = 0; i < count; i++) {
        s.cells[i] = s.places[4 * i + 3] > 0.0f ? ref_key(s.places[4 * i + 2], 500 + (uint32_t)i) : REF_EMPTY_KEY;
        for (int k = 0; k < 4; k++)
            s.merged[4 * i + (size_t)k] = s.places[4 * i + 3] > 0.0f ? (float)rng_unit(rng) : NAN;
        s.least[i] = rng_below(rng, 5) ? (float)rng_range(rng, -0.01, 0.01) : PT_RANGE_MOST;
        s.most[i] = s.least[i] < PT_RANGE_MOST ? s.least[i] + (float)rng_range(rng, 0.0, 0.02) : -PT_RANGE_MOST;
        float n[3];
        rng_direction(rng, n);
        n[2] = fabsf(n[2]) + 1.0f;
        const float scale = 1.0f / sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int k = 0; k < 3; k++)
            s.inclined[4 * i + (size_t)k] = n[k] * scale;
        s.inclined[4 * i + 3] = rng_below(rng, 4) ? 8.0f : (float)rng_below(rng, 8);
    }
    for (size_t i = 0; i < pixels; i++) {
        s.keys[i] = rng_below(rng, 3) ? REF_EMPTY_KEY : ref_key((float)rng_range(rng, 2.0, 8.0), 9);
        s.limit[i] = rng_below(rng, 3) ? (float)rng_range(rng, 2.0, 6.0) : INFINITY;
        s.away[i] = UNTOUCHED;
    }
    return s;
}

struct shown {
    const uint64_t *keys;
    const uint32_t *from;
    const float *normal, *deff, *albedo, *away, *span, *apart;
};

// As the first of two passes left it: own pixels near the cells' depths, some marked.
static void leave(struct setup *s, struct rng *rng)
{
    const struct view_args *view = &s->args.view, *cells = &s->args.cells;
    s->args.pass |= PT_RANGE_FINE;
    for (size_t i = 0; i < (size_t)view->width * view->height; i++) {
        const double px = (view->origin_x + (double)(i % view->width) + 0.5) / (double)s->args.pixel,
                     py = (view->origin_y + (double)(i / view->width) + 0.5) / (double)s->args.pixel;
        const size_t cell = (size_t)(floor(py) - cells->origin_y) * cells->width + (size_t)(floor(px) - cells->origin_x);
        const float *place = s->places + 4 * cell;
        if (!rng_below(rng, 3))
            continue;
        s->keys[i] = ref_key(place[3] > 0.0f ? place[2] * (float)rng_range(rng, 0.97, 1.03) : 5.0f,
                             500 + rng_below(rng, s->args.id_count));
        s->away[i] = (float)rng_range(rng, 0.0, 3.0);
        if (rng_below(rng, 2))
            s->away[i] = -1.0f - s->away[i];
    }
}

// Of the second of two passes, over a pixel of the instance's own: whether it may take its place.
static enum ref_truth takes(const struct setup *s, const struct ref_magnify *found, double before, int marked)
{
    const double step = ref_range_step(&s->args.cells, s->args.gamma, s->args.gamma_cells, before);
    const double slack = found->z_error + 8.0 * TOL_UNIT * (step + before);
    if (!found->shown)
        return REF_NO;
    if (fabs(found->z - (before - step)) <= slack || (marked && fabs(found->z - (before + step)) <= slack))
        return REF_UNSURE;
    return found->z < before - step || (marked && found->z < before + step) ? REF_YES : REF_NO;
}

static void compare(struct harness *h, const struct setup *s, const struct shown *got, size_t at, size_t *unsure, size_t *some)
{
    const struct view_args *view = &s->args.view;
    const int x = (int)(at % view->width), y = (int)(at / view->width);
    const struct ref_magnify expected = ref_magnify(&s->args, s->cells, s->places, s->merged, s->inclined, x, y);
    const double before = ref_key_z(s->keys[at]), limit = (double)s->limit[at];
    const uint32_t of = ref_key_id(s->keys[at]) - s->args.id_base;
    const int own = s->args.pass & PT_RANGE_FINE && isfinite(before) && of - s->args.id_first < s->args.id_count;
    const int marked = own && s->away[at] < 0.0f;
    const enum ref_truth front = own ? takes(s, &expected, before, marked) : expected.z < before ? REF_YES : REF_NO;
    const int shown = expected.shown && front == REF_YES && (!s->args.behind || expected.z > limit);
    const int open = expected.unsure || front == REF_UNSURE || (expected.shown && expected.marked == REF_UNSURE) ||
                     (expected.shown && ((!own && fabs(expected.z - before) <= expected.z_error) ||
                                         (s->args.behind && fabs(expected.z - limit) <= expected.z_error)));
    (*some)++;
    *unsure += open != 0;
    if (open)
        return;
    if (!shown) {
        if (got->keys[at] != s->keys[at] || got->deff[at] != UNTOUCHED || got->normal[4 * at] != UNTOUCHED ||
            got->albedo[4 * at] != UNTOUCHED || (got->apart && got->apart[at] != UNTOUCHED) ||
            got->away[at] != (marked ? -1.0f - s->away[at] : s->away[at]))
            harness_fail(h, "keys", x, y, "was written");
        return;
    }
    const double n[3] = {expected.n.x, expected.n.y, expected.n.z};
    if (ref_key_id(got->keys[at]) != expected.id || !harness_near(ref_key_z(got->keys[at]), expected.z, expected.z_error))
        harness_fail(h, "keys", x, y, "got %u at %.9g, expected %u at %.9g +- %.2g", ref_key_id(got->keys[at]),
                     ref_key_z(got->keys[at]), expected.id, expected.z, expected.z_error);
    if (got->from[at] != at || !harness_near(got->deff[at], expected.deff, expected.deff_error))
        harness_fail(h, "deff", x, y, "got %.9g, expected %.9g +- %.2g", got->deff[at], expected.deff, expected.deff_error);
    if (expected.marked == REF_YES ? !harness_near(-1.0 - got->away[at], expected.away, expected.away_error + 1e-5)
                                   : !harness_near(got->away[at], expected.away, expected.away_error))
        harness_fail(h, "away", x, y, "got %.9g, expected %.9g +- %.2g", got->away[at], expected.away, expected.away_error);
    const float apart = fmaxf(s->most[expected.cell] - s->least[expected.cell], 0.0f);
    if (got->apart && got->apart[at] != apart)
        harness_fail(h, "apart", x, y, "got %.9g, expected %.9g", got->apart[at], apart);
    for (int k = 0; k < 3; k++)
        if (!harness_near(got->normal[4 * at + (size_t)k], n[k], expected.normal_error))
            harness_fail(h, "normal", x, y, "axis %d: got %.9g, expected %.9g +- %.2g", k, got->normal[4 * at + (size_t)k],
                         n[k], expected.normal_error);
    for (int k = 0; k < 4; k++)
        if (!harness_near(got->albedo[4 * at + (size_t)k], expected.color[k], expected.color_error))
            harness_fail(h, "albedo", x, y, "channel %d: got %.9g, expected %.9g +- %.2g", k, got->albedo[4 * at + (size_t)k],
                         expected.color[k], expected.color_error);
}

static struct shown run(struct harness *h, const struct setup *s, double open)
{
    const struct view_args *view = &s->args.view, *of = &s->args.cells;
    const size_t count = (size_t)of->width * of->height, pixels = (size_t)view->width * view->height;
    float *unset = harness_alloc(h, pixels * 16);
    size_t unsure = 0, some = 0;
    for (size_t i = 0; i < 4 * pixels; i++)
        unset[i] = UNTOUCHED;
    struct pt_buffer *cells = harness_buffer(h, s->cells, count * 8), *place = harness_buffer(h, s->places, count * 16);
    struct pt_buffer *merged = harness_buffer(h, s->merged, count * 16), *inclined = harness_buffer(h, s->inclined, count * 16);
    struct pt_buffer *keys = harness_buffer(h, s->keys, pixels * 8), *from = harness_buffer(h, unset, pixels * 4);
    struct pt_buffer *normal = harness_buffer(h, unset, pixels * 16), *deff = harness_buffer(h, unset, pixels * 4);
    struct pt_buffer *albedo = harness_buffer(h, unset, pixels * 16), *away = harness_buffer(h, s->away, pixels * 4);
    struct pt_buffer *span = s->args.with_span ? harness_buffer(h, unset, pixels * 4) : NULL;
    struct pt_buffer *limit = s->args.behind ? harness_buffer(h, s->limit, pixels * 4) : NULL;
    struct pt_buffer *least = s->args.with_apart ? harness_buffer(h, s->least, count * 4) : NULL;
    struct pt_buffer *most = s->args.with_apart ? harness_buffer(h, s->most, count * 4) : NULL;
    struct pt_buffer *apart = s->args.with_apart ? harness_buffer(h, unset, pixels * 4) : NULL;
    HARNESS_RUN(h, magnify, &s->args, cells, place, merged, inclined, keys, from, normal, deff, albedo, away, span, limit,
                least, most, apart);
    struct shown got = {.keys = harness_read(h, keys),
                        .from = harness_read(h, from),
                        .normal = harness_read(h, normal),
                        .deff = harness_read(h, deff),
                        .albedo = harness_read(h, albedo),
                        .away = harness_read(h, away),
                        .span = span ? harness_read(h, span) : NULL,
                        .apart = apart ? harness_read(h, apart) : NULL};
    harness_same(h, "keys", got.keys, pixels, 8, 1, view->width);
    harness_same(h, "normal", got.normal, pixels * 4, 4, 4, view->width);
    harness_same(h, "deff", got.deff, pixels, 4, 1, view->width);
    harness_same(h, "albedo", got.albedo, pixels * 4, 4, 4, view->width);
    harness_same(h, "away", got.away, pixels, 4, 1, view->width);
    if (apart)
        harness_same(h, "apart", got.apart, pixels, 4, 1, view->width);
    if (span)
        HARNESS_CHECK(h, !memcmp(got.span, got.deff, pixels * 4));
    for (uint32_t y = view->rect[1]; y < view->rect[3] && !harness_settled(h); y++)
        for (uint32_t x = view->rect[0]; x < view->rect[2]; x++)
            compare(h, s, &got, (size_t)y * view->width + x, &unsure, &some);
    harness_unsure(h, unsure, some, open);
    return got;
}

static void pictures(struct harness *h)
{
    static const uint32_t shapes[][2] = {{67, 45}, {1, 1}, {300, 1}, {1, 70}};
    static const float pixels[] = {1.0f, 2.7f, 5.0f, 64.0f}, gammas[][2] = {{0.02f, 0.0f}, {1e-30f, 2.0f}, {1e30f, 0.0f}};
    for (size_t s = 0; s < 4; s++)
        for (size_t p = 0; p < 4; p++)
            for (int kind = 0; kind < CELLS_KINDS; kind++) {
                struct rng rng = {s + 10 * p + 100 * (uint64_t)kind};
                struct setup setup = make(h, &rng, shapes[s][0], shapes[s][1], kind % 2, pixels[p], (enum cells_kind)kind);
                setup.args.gamma = gammas[(p + s) % 3][0];
                setup.args.gamma_cells = gammas[(p + s) % 3][1];
                setup.args.behind = (p + (uint32_t)kind) % 2;
                setup.args.with_span = s == 0;
                setup.args.with_apart = s != 1;
                if ((p + (size_t)kind + s) % 4 == 1 || (p + (size_t)kind + s) % 4 == 3)
                    setup.args.pass = PT_RANGE_COARSE;
                if ((p + (size_t)kind + s) % 4 >= 2) // 3: of three the one between
                    leave(&setup, &rng);
                if (s == 0 && p == 1) {
                    setup.args.view.rect[0] = 5;
                    setup.args.view.rect[3] = 41;
                    setup.args.cells.rect[0] = 3;
                }
                run(h, &setup, TOL_UNSURE_HARD);
            }
}

// A whole plane of cells: no pixel stays open, and each lies on it.
static void plane(struct harness *h)
{
    for (int perspective = 0; perspective < 2; perspective++) {
        struct rng rng = {9};
        struct setup s = make(h, &rng, 67, 45, perspective, 3.3f, CELLS_FLAT);
        const struct view_args *cells = &s.args.cells;
        const double slope = 0.5;
        for (size_t i = 0; i < (size_t)cells->width * cells->height; i++) {
            float *place = s.places + 4 * i;
            place[0] = (float)rng_unit(&rng);
            place[1] = (float)rng_unit(&rng);
            const double u = cells->ray_x0 +
                             (double)cells->ray_xs * (cells->origin_x + (double)(i % cells->width) + (double)place[0]);
            place[2] = (float)(perspective ? 5.0 / (1.0 - slope * u) : 5.0 + slope * u);
            place[3] = 1.0f;
            s.cells[i] = ref_key(place[2], (uint32_t)i);
            s.merged[4 * i] = s.merged[4 * i + 1] = s.merged[4 * i + 2] = 0.5f;
            s.merged[4 * i + 3] = 1.0f;
        }
        for (size_t i = 0; i < (size_t)67 * 45; i++)
            s.keys[i] = REF_EMPTY_KEY;
        s.args.gamma = 0.5f;
        const struct shown got = run(h, &s, 1.0);
        for (size_t i = 0; i < (size_t)67 * 45; i++) {
            const struct ref_ray ray = ref_ray(&s.args.view, (int)(i % 67), (int)(i / 67));
            const double z = perspective ? 5.0 / (1.0 - slope * ray.u) : 5.0 + slope * ray.u;
            if (!harness_near(ref_key_z(got.keys[i]), z, 1e-5 * z))
                harness_fail(h, "keys", (int)(i % 67), (int)(i / 67), "got %.9g, expected %.9g", ref_key_z(got.keys[i]), z);
            if (!harness_near(got.albedo[4 * i], 0.5, 1e-5) || !harness_near(got.albedo[4 * i + 3], 1.0, 1e-5))
                harness_fail(h, "albedo", (int)(i % 67), (int)(i / 67), "got %.9g", got.albedo[4 * i]);
        }
    }
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {{"pictures", pictures, 0}, {"a whole plane", plane, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
