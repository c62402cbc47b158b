// SPDX-License-Identifier: GPL-3.0-or-later
// incline: normals of cells from those around.
#include "cells.h"
#include "shared/ranges.h"

#include <math.h>
#include <string.h>

static void check(struct harness *h, struct view_args view, const float *places, float gamma, float gamma_cells, double open)
{
    const struct incline_args args = {.view = view, .gamma = gamma, .gamma_cells = gamma_cells};
    const size_t count = (size_t)view.width * view.height;
    float *before = harness_alloc(h, count * 16);
    size_t unsure = 0, written = 0;
    for (size_t i = 0; i < 4 * count; i++)
        before[i] = -77.0f;
    struct pt_buffer *place = harness_buffer(h, places, count * 16), *inclined = harness_buffer(h, before, count * 16);
    HARNESS_RUN(h, incline, &args, place, inclined);
    const float *got = harness_read(h, inclined);
    harness_same(h, "inclined", got, count * 4, 4, 4, view.width);
    for (size_t i = 0; i < count; i++) {
        const int x = (int)(i % view.width), y = (int)(i / view.width);
        const int inside = x >= (int)view.rect[0] && x < (int)view.rect[2] && y >= (int)view.rect[1] && y < (int)view.rect[3];
        const float *n = got + 4 * i;
        if (!inside || !(places[4 * i + 3] > 0.0f)) {
            if (n[0] != -77.0f)
                harness_fail(h, "inclined", x, y, "was written");
            continue;
        }
        const struct ref_incline expected = ref_incline(&args, places, x, y);
        const double axes[3] = {expected.n.x, expected.n.y, expected.n.z};
        written++;
        unsure += expected.unsure != 0;
        for (int k = 0; k < 3 && !expected.unsure; k++)
            if (!harness_near(n[k], axes[k], expected.error))
                harness_fail(h, "inclined", x, y, "axis %d: got %.9g, expected %.9g +- %.2g", k, n[k], axes[k], expected.error);
        if (!expected.unsure && n[3] != (float)expected.joined)
            harness_fail(h, "inclined", x, y, "%.9g cells are joined, expected %d", n[3], expected.joined);
        if (!harness_near(hypot(hypot(n[0], n[1]), n[2]), 1.0, 1e-6))
            harness_fail(h, "inclined", x, y, "is not unit: %.9g %.9g %.9g", n[0], n[1], n[2]);
    }
    harness_unsure(h, unsure, written, open);
}

static void pictures(struct harness *h)
{
    static const uint32_t shapes[][2] = {{67, 45}, {1, 1}, {300, 1}, {1, 70}, {3, 3}};
    static const float gammas[][2] = {{0.3f, 0.0f}, {1e-30f, 2.0f}, {1e30f, 0.0f}};
    for (size_t s = 0; s < 5; s++)
        for (int kind = 0; kind < CELLS_KINDS; kind++)
            for (int g = 0; g < 3; g++) {
                struct rng rng = {s + 10 * (uint64_t)kind};
                struct view_args view = picture_view(shapes[s][0], shapes[s][1], (kind + g) % 2);
                const float *places = cells_random(h, &rng, &view, (enum cells_kind)kind);
                if (s == 0) {
                    view.rect[0] = 3;
                    view.rect[3] = 40;
                }
                check(h, view, places, gammas[g][0], gammas[g][1], TOL_UNSURE_HARD);
            }
}

// A plane at 60 degrees, seen from the front: its normal wherever the points fell in their cells.
static void plane(struct harness *h)
{
    for (int perspective = 0; perspective < 2; perspective++) {
        struct rng rng = {4};
        const struct view_args view = picture_view(40, 30, perspective);
        float *places = cells_random(h, &rng, &view, CELLS_FLAT);
        const struct ref_vec n = ref_unit(ref_vec(sqrt(3.0), 0.0, 1.0));
        for (size_t i = 0; i < (size_t)40 * 30; i++) {
            float *place = places + 4 * i;
            const double u = view.ray_x0 + (double)view.ray_xs * (view.origin_x + (double)(i % 40) + (double)place[0]);
            place[2] = (float)(perspective ? 5.0 * n.z / (n.z - u * n.x) : 5.0 + u * n.x / n.z);
        }
        const struct incline_args args = {.view = view, .gamma = 0.1f};
        struct pt_buffer *place = harness_buffer(h, places, (size_t)40 * 30 * 16);
        struct pt_buffer *inclined = harness_buffer(h, harness_alloc(h, (size_t)40 * 30 * 16), (size_t)40 * 30 * 16);
        HARNESS_RUN(h, incline, &args, place, inclined);
        const float *got = harness_read(h, inclined);
        size_t right = 0, some = 0;
        for (size_t i = 0; i < (size_t)40 * 30; i++)
            if (places[4 * i + 3] > 0.0f) {
                some++;
                right += fabs(got[4 * i] - n.x) < 1e-3 && fabs(got[4 * i + 1]) < 1e-3 && fabs(got[4 * i + 2] - n.z) < 1e-3;
            }
        harness_note(h, "%zu of %zu cells", right, some);
        HARNESS_CHECK(h, right == some);
    }
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {{"pictures", pictures, 0}, {"a plane at 60 degrees", plane, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
