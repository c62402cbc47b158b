// SPDX-License-Identifier: GPL-3.0-or-later
// contour: perspective and orthographic views, all slopes, intervals from far finer than pixels to wider than the picture, level
// surfaces, surfaces edge-on and without normals, far ones; lines of values that change slowly, fast and not at all.
#include "effect.h"
#include "shared/effects.h"

#include <math.h>
#include <string.h>

static struct ref_color reference(const void *args, const struct ref_planes *planes, int x, int y)
{
    return ref_contour(args, planes, x, y);
}

static const struct effect contour = {PT_KERNEL_contour, reference, "knsc"};

static void set_kind(struct contour_args *args, int kind, float interval, float width)
{
    args->interval[kind] = interval;
    args->inverse[kind] = 1.0f / interval;
    args->width[kind] = width;
    args->even[kind] = 2.0f * fmaxf(width, 1.0f);
    args->per_even[kind] = 1.0f / args->even[kind];
}

static struct contour_args args_of(const struct view_args *view, float interval, float width, uint32_t kinds)
{
    struct contour_args args = {.view = *view,
                                .eye_z = view->perspective ? 0.0f : 0.5f,
                                .axis = {0.48f, 0.64f, 0.6f},
                                .offset = 0.3f,
                                .opacity = 0.9f,
                                .color = {0.3f, 0.1f, 0.02f},
                                .kinds = kinds};
    set_kind(&args, 0, interval, width);
    set_kind(&args, 1, 5.0f * interval, 2.0f * width);
    return args;
}

static void kinds(struct harness *h)
{
    static const float intervals[] = {0.1f, 0.5f, 0.02f};
    for (int p = 0; p < 2; p++)
        for (int kind = 0; kind < PICTURE_KINDS; kind++) {
            if (kind == PICTURE_RANGE)
                continue; // lines at depths of 1e4 are finer than their places
            struct picture picture = effect_picture(h, (uint64_t)kind, 67, 45, p, (enum picture_kind)kind, kind % 2);
            struct contour_args args = args_of(&picture.view, intervals[kind % 3], 0.4f + 0.8f * (float)kind,
                                               1 + (uint32_t)kind % 2);
            effect_check(h, &contour, &args, sizeof args, &picture, NULL);
        }
}

static void hard(struct harness *h)
{
    static const uint32_t sizes[][2] = {{67, 45}, {1, 1}, {16384, 1}, {1, 70}};
    static const float intervals[] = {1e-9f, 1e-4f, 0.05f, 1e9f};
    for (size_t s = 0; s < 4; s++) {
        struct picture picture = effect_picture(h, s, sizes[s][0], sizes[s][1], 1, PICTURE_SURFACES, 1);
        struct contour_args args = args_of(&picture.view, 0.05f, 1.0f, 2);
        effect_check(h, &contour, &args, sizeof args, &picture, NULL);
        for (size_t i = 0; i < picture.count; i++) // without normals surfaces face the viewer
            memset(picture.normal + 4 * i, 0, 12);
        effect_check(h, &contour, &args, sizeof args, &picture, NULL);
        for (size_t i = 0; i < picture.count; i++) // level, edge-on or between, seen from anywhere
            for (size_t k = 0; k < 3; k++)
                picture.normal[4 * i + k] = i % 3 ? args.axis[k] : k == i / 3 % 3;
        effect_check(h, &contour, &args, sizeof args, &picture, NULL);
    }
    // too fine, too wide, seven decades of depth: colours stay between ink and ground
    for (size_t i = 0; i < 4; i++)
        for (int range = 0; range < 2; range++) {
            struct picture picture = effect_picture(h, 5 + i, 67, 45, 1, range ? PICTURE_RANGE : PICTURE_SURFACES, 0);
            struct contour_args args = args_of(&picture.view, intervals[i], 1.0f, 2);
            struct pt_buffer *color = harness_buffer(h, picture.color, picture.count * 16);
            HARNESS_RUN(h, contour, &args, harness_buffer(h, picture.keys, picture.count * 8),
                        harness_buffer(h, picture.normal, picture.count * 16), NULL, color);
            const float *got = harness_read(h, color);
            for (size_t k = 0; k < 4 * picture.count; k++)
                if (picture.keys[k / 4] != REF_EMPTY_KEY && k % 4 < 3 &&
                    !(got[k] >= 0.0f && got[k] <= fmaxf(picture.color[k], 0.3f) * 1.001f))
                    harness_fail(h, "color", (int)(k / 4 % 67), (int)(k / 4 / 67), "got %.9g of %.9g", (double)got[k],
                                 (double)picture.color[k]);
        }
}

// Values by a plane of slopes: across lines, between them, level at the height of one, unknown, of any size.
static void values(struct harness *h)
{
    static const double sizes[] = {1.0, 1e-6, 1e6, 1e30};
    for (size_t s = 0; s < 4; s++)
        for (int p = 0; p < 2; p++) {
            struct picture picture = effect_picture(h, 11 + s, 67, 45, p, PICTURE_SURFACES, p);
            struct rng rng = {s};
            struct contour_args args = args_of(&picture.view, (float)fmin(0.5 * sizes[s], 1e9), 1.0f + (float)s,
                                               1 + (uint32_t)p);
            float *slopes = harness_alloc(h, picture.count * 16);
            args.of_values = 1;
            for (size_t i = 0; i < picture.count; i++) {
                const double rate = sizes[s] * exp2(-(double)rng_below(&rng, 30));
                slopes[4 * i] = (float)(sizes[s] * ((double)rng_below(&rng, 100000) / 5000.0 - 10.0));
                slopes[4 * i + 1] = (float)(rate * ((double)rng_below(&rng, 1000) / 500.0 - 1.0));
                slopes[4 * i + 2] = (float)(rate * ((double)rng_below(&rng, 1000) / 500.0 - 1.0));
                slopes[4 * i + 3] = 1.0f;
                if (rng_below(&rng, 8) == 0) // level, at a line
                    memcpy(slopes + 4 * i, (float[]){2.0f * args.interval[0], 0.0f, 0.0f, 1.0f}, 16);
                if (rng_below(&rng, 8) == 0)
                    memset(slopes + 4 * i, 0, 16);
                if (s == 3) // as steep as slopes are
                    slopes[4 * i + 1] = rng_below(&rng, 2) ? 1e18f : -1e18f;
            }
            effect_check_slopes(h, &contour, &args, sizeof args, &picture, slopes);
        }
}

// ---- the reference alone, on planes that cross the view ---------------------------------------------------------------

struct wall { // white, seen by parallel rays; its height grows by `slope` a pixel on
    struct picture picture;
    struct ref_planes planes;
    struct contour_args args;
};

static struct wall wall_of(struct harness *h, double tilt, double interval_px, float width)
{
    struct rng rng = {5};
    struct wall w = {.picture = picture_random(h, &rng, picture_view(640, 1, 0), PICTURE_FLAT, 1.0)};
    double pixel = w.picture.view.ray_xs, c = cos(tilt), s = sin(tilt);
    w.args = args_of(&w.picture.view, (float)(interval_px * pixel * tan(tilt)), width, 1);
    w.args.eye_z = w.args.offset = 0.0f;
    w.args.opacity = 1.0f;
    memset(w.args.color, 0, sizeof w.args.color);
    w.args.axis[0] = w.args.axis[1] = 0.0f; // height is what comes towards the viewer
    w.args.axis[2] = 1.0f;
    for (int x = 0; x < 640; x++) {
        float z = (float)(5.0 - tan(tilt) * (w.picture.view.ray_x0 + pixel * (w.picture.view.origin_x + x + 0.5)));
        w.picture.keys[x] = ref_key(z, 1);
        for (int k = 0; k < 4; k++) {
            w.picture.color[4 * x + k] = 1.0f;
            w.picture.normal[4 * x + k] = k == 0 ? (float)-s : k == 2 ? (float)c : 0.0f;
        }
    }
    return w;
}

static double ink_of(struct wall *w, double *least, double *most)
{
    double sum = 0.0;
    w->planes = picture_planes(&w->picture);
    w->planes.shading = w->picture.normal;
    *least = 1.0;
    *most = 0.0;
    for (int x = 0; x < 640; x++) {
        double ink = 1.0 - ref_contour(&w->args, &w->planes, x, 0).color[0];
        sum += ink / 640.0;
        *least = fmin(*least, ink);
        *most = fmax(*most, ink);
    }
    return sum;
}

// Lines take the same share of the picture at any slope; too fine ones are an even tone; a level wall has none at all.
static void sanity(struct harness *h)
{
    double least, most;
    for (int i = 0; i < 4; i++) {
        const double tilts[] = {0.03, 0.3, 0.9, 1.4};
        struct wall w = wall_of(h, tilts[i], 16.0, 2.0f);
        double ink = ink_of(&w, &least, &most);
        HARNESS_CHECK(h, fabs(ink - 2.0 / 16.0) < 0.006 && least == 0.0 && most > 0.999);
        w = wall_of(h, tilts[i], 0.37, 1.0f);
        ink = ink_of(&w, &least, &most);
        HARNESS_CHECK(h, fabs(ink - 0.5) < 1e-5 && most - least < 1e-5);
    }
    struct wall w = wall_of(h, 0.3, 16.0, 2.0f);
    for (int x = 0; x < 640; x++) { // at the height of a line
        w.picture.keys[x] = ref_key(w.args.interval[0] * 8.0f, 1);
        w.picture.normal[4 * x] = 0.0f;
        w.picture.normal[4 * x + 2] = 1.0f;
    }
    HARNESS_CHECK(h, ink_of(&w, &least, &most) == 0.0);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"sanity", sanity, 1}, {"pictures of all kinds", kinds, 0}, {"hard", hard, 0}, {"values", values, 0}};
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
