// SPDX-License-Identifier: GPL-3.0-or-later
// normals: planes fitted on the screen, against float64 and against the plane that the points were taken from.
#include "harness.h"
#include "shared/measured.h"

#include <math.h>
#include <string.h>

static uint32_t steep; // of all pictures

static struct normals_args arguments(const struct picture *picture, uint32_t radius)
{
    struct normals_args args = {.view = picture->view, .radius = radius, .steep = steep};
    args.instance.id_base = picture->id_base;
    picture_slots(&args.instance, picture->count * 3 / 4); // the rest belongs to somebody else, and counts as neighbour
    for (int i = 0; i < PT_SPACINGS; i++)
        args.instance.spacing[i] = (float)(1e-4 * pow(1.2, i));
    return args;
}

static uint32_t *words_without(struct harness *h, struct rng *rng, size_t count)
{
    uint32_t *words = harness_alloc(h, (count ? count : 1) * 4);
    for (size_t i = 0; i < count; i++)
        words[i] = PT_NORMAL_NONE | rng_below(rng, PT_SPACINGS) << PT_SPACING_SHIFT;
    return words;
}

static float *run(struct harness *h, const struct picture *picture, const struct normals_args *args, const uint32_t *words,
                  const float *before)
{
    struct pt_buffer *keys = harness_buffer(h, picture->keys, picture->count * 8);
    struct pt_buffer *surfels = harness_buffer(h, words, (size_t)(args->instance.slots + !args->instance.slots) * 4);
    struct pt_buffer *normal = harness_buffer(h, before, picture->count * 16);
    HARNESS_RUN(h, normals, args, keys, surfels, normal);
    float *got = harness_read(h, normal);
    harness_same(h, "normal", got, picture->count * 4, 4, 4, picture->view.width);
    return got;
}

static void check(struct harness *h, const struct picture *picture, const struct normals_args *args, const uint32_t *words)
{
    size_t open = 0, rough = 0, seen = 0;
    float *before = harness_alloc(h, picture->count * 16);
    for (size_t i = 0; i < picture->count * 4; i++)
        before[i] = 7.0f;
    const float *got = run(h, picture, args, words, before);
    if (harness_settled(h))
        return;
    struct ref_planes planes = {.keys = picture->keys, .surfels = words};
    for (size_t i = 0; i < picture->count; i++) {
        int x = (int)(i % picture->view.width), y = (int)(i / picture->view.width);
        const float *n = got + 4 * i;
        if (!ref_is_of(&args->instance, picture->keys[i])) {
            if (memcmp(n, before + 4 * i, 16))
                harness_fail(h, "untouched", x, y, "was written");
            continue;
        }
        seen++;
        if (n[3] != 0.0f)
            harness_fail(h, "normal.w", x, y, "got %g, expected 0", n[3]);
        struct ref_normal expected = ref_normals(args, &planes, x, y);
        if (expected.decided == REF_UNSURE) {
            open++;
            continue;
        }
        double length = ref_length(ref_vec_of(n));
        if (ref_length(expected.n) == 0.0) {
            if (length != 0.0)
                harness_fail(h, "normal", x, y, "got (%g %g %g), expected none", n[0], n[1], n[2]);
            continue;
        }
        if (!harness_near(length, 1.0, TOL_NORMAL))
            harness_fail(h, "normal", x, y, "got (%g %g %g) of length %.9g, expected (%g %g %g)", n[0], n[1], n[2], length,
                         expected.n.x, expected.n.y, expected.n.z);
        if (expected.error > TOL_FIT_LIMIT) {
            rough++;
            continue;
        }
        double off = ref_length(ref_add(ref_vec_of(n), ref_scale(expected.n, -1.0)));
        if (expected.either_side)
            off = fmin(off, ref_length(ref_add(ref_vec_of(n), expected.n)));
        if (!(off <= expected.error))
            harness_fail(h, "normal", x, y, "got (%.7f %.7f %.7f), expected (%.7f %.7f %.7f) +- %.2g", n[0], n[1], n[2],
                         expected.n.x, expected.n.y, expected.n.z, expected.error);
    }
    if (rough)
        harness_note(h, "%zu of %zu fits hold no normal in float32", rough, seen);
    harness_unsure(h, open, picture->count, TOL_UNSURE_SHARE);
}

static void kinds(struct harness *h)
{
    static const double densities[] = {0.05, 0.4, 1.0};
    for (int p = 0; p < 2; p++)
        for (int kind = 0; kind < PICTURE_KINDS; kind++)
            for (size_t d = 0; d < 3; d++) {
                struct rng rng = {(uint64_t)(p * 1000 + kind * 10) + d};
                struct picture picture = picture_random(h, &rng, picture_view(45, 29, p), (enum picture_kind)kind,
                                                        densities[d]);
                struct normals_args args = arguments(&picture, d == 0 ? 16 : 1 + rng_below(&rng, 6));
                check(h, &picture, &args, words_without(h, &rng, args.instance.slots));
            }
}

static void shapes(struct harness *h)
{
    static const uint32_t sizes[][2] = {{1, 1}, {1, 40}, {2000, 1}, {2, 2}, {64, 3}};
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        struct rng rng = {s};
        struct picture picture = picture_random(h, &rng, picture_view(sizes[s][0], sizes[s][1], 1), PICTURE_SURFACES, 0.9);
        struct normals_args args = arguments(&picture, 16);
        args.instance.id_first = 0;
        args.instance.slots = args.instance.id_count = (uint32_t)picture.count;
        check(h, &picture, &args, words_without(h, &rng, picture.count));
    }
}

// Points on one line of the screen span no plane, whatever its slope.
static void lines(struct harness *h)
{
    static const int slopes[][2] = {{1, 0}, {0, 1}, {1, 1}, {2, 1}, {1, -1}, {1, 3}, {-3, 2}};
    for (size_t s = 0; s < sizeof slopes / sizeof slopes[0]; s++) {
        struct rng rng = {s};
        struct picture picture = picture_random(h, &rng, picture_view(32, 32, 1), PICTURE_SURFACES, 1.0);
        for (int y = 0; y < 32; y++)
            for (int x = 0; x < 32; x++) {
                int on = (x - 16) * slopes[s][1] == (y - 16) * slopes[s][0];
                picture.keys[y * 32 + x] = on ? ref_key((float)(5.0 + 0.001 * x), picture.id_base + (uint32_t)(y * 32 + x))
                                              : REF_EMPTY_KEY;
            }
        struct normals_args args = arguments(&picture, 16);
        args.instance.id_first = 0;
        args.instance.slots = args.instance.id_count = (uint32_t)picture.count;
        args.instance.d_min = 10.0f;
        check(h, &picture, &args, words_without(h, &rng, picture.count));
    }
}

// Float32 depths of a known plane: the estimate is the plane's normal, at 5 to 80 degrees, at z = 1 and at z = 1000.
static void analytic(struct harness *h)
{
    double worst = 0.0;
    for (int p = 0; p < 2; p++)
        for (int tilt = 5; tilt <= 80; tilt += 25)
            for (int far = 0; far < 2; far++) {
                struct rng rng = {(uint64_t)tilt};
                struct picture picture = picture_random(h, &rng, picture_view(45, 29, p), PICTURE_FLAT, 1.0);
                double angle = tilt * 0.017453292519943295, z0 = far ? 900.0 : 2.0;
                struct ref_vec n = {sin(angle) * 0.6, sin(angle) * 0.8, cos(angle)};
                for (size_t i = 0; i < picture.count; i++) {
                    struct ref_ray ray = ref_ray(&picture.view, (int)(i % 45), (int)(i / 45));
                    double z = p ? z0 * n.z / (n.z - n.x * ray.u - n.y * ray.v) : z0 + 40.0 + (n.x * ray.u + n.y * ray.v) / n.z;
                    picture.keys[i] = z > 0.0 && rng_below(&rng, 3) ? ref_key((float)z, picture.id_base + (uint32_t)i)
                                                                    : REF_EMPTY_KEY;
                }
                struct normals_args args = arguments(&picture, 3);
                args.instance.id_first = 0;
                args.instance.slots = args.instance.id_count = (uint32_t)picture.count;
                args.instance.d_min = 1000.0f;
                uint32_t *words = words_without(h, &rng, picture.count);
                const float *got = run(h, &picture, &args, words, picture.normal);
                struct ref_planes planes = {.keys = picture.keys, .surfels = words};
                for (size_t i = 0; i < picture.count; i++) {
                    if (picture.keys[i] == REF_EMPTY_KEY)
                        continue;
                    int x = (int)(i % 45), y = (int)(i / 45);
                    struct ref_normal expected = ref_normals(&args, &planes, x, y);
                    if (expected.decided != REF_YES || ref_length(expected.n) == 0.0)
                        continue; // too few neighbours within four layer distances
                    double off = ref_length(ref_add(ref_vec_of(got + 4 * i), ref_scale(n, -1.0)));
                    double turned = ref_length(ref_add(ref_vec_of(got + 4 * i), n));
                    off = fmin(off, turned);
                    worst = fmax(worst, off);
                    // The depths themselves were rounded to float32: as much again.
                    if (!(off <= 2.0 * expected.error))
                        harness_fail(h, "normal", x, y, "%d degrees: got (%g %g %g), expected (%g %g %g) +- %.2g", tilt,
                                     got[4 * i], got[4 * i + 1], got[4 * i + 2], n.x, n.y, n.z, expected.error);
                }
            }
    harness_note(h, "planes of known slope: at most %.2g radians off", worst);
}

// A rough plane at 88 degrees, as a low sun sees the ground.
static void steep_plane(struct harness *h)
{
    struct rng rng = {3};
    struct picture picture = picture_random(h, &rng, picture_view(45, 29, 0), PICTURE_FLAT, 1.0);
    const double angle = 88 * 0.017453292519943295;
    const struct ref_vec n = {sin(angle) * 0.6, sin(angle) * 0.8, cos(angle)};
    for (size_t i = 0; i < picture.count; i++) {
        struct ref_ray ray = ref_ray(&picture.view, (int)(i % 45), (int)(i / 45));
        double rough = 0.4 * (rng_unit(&rng) - 0.5) * (double)picture.view.ray_xs * tan(angle);
        picture.keys[i] = ref_key((float)(1000.0 + (n.x * ray.u + n.y * ray.v) / n.z + rough), picture.id_base + (uint32_t)i);
    }
    size_t found[2] = {0};
    for (steep = 0; steep < 2; steep++) {
        struct normals_args args = arguments(&picture, 3);
        args.instance.id_first = 0;
        args.instance.slots = args.instance.id_count = (uint32_t)picture.count;
        for (int i = 0; i < PT_SPACINGS; i++)
            args.instance.spacing[i] = 1e-4f;
        uint32_t *words = words_without(h, &rng, picture.count);
        check(h, &picture, &args, words);
        const float *got = run(h, &picture, &args, words, picture.normal);
        for (size_t i = 0; i < picture.count; i++)
            found[steep] += fabs(ref_dot(ref_vec_of(got + 4 * i), n)) > cos(0.02);
    }
    steep = 0;
    harness_note(h, "within a degree in %zu of %zu pixels, in %zu without `steep`", found[1], picture.count, found[0]);
    if (found[1] < picture.count * 9 / 10 || found[0] > picture.count / 2)
        harness_fail(h, "normal", 0, 0, "found in %zu and %zu of %zu pixels", found[1], found[0], picture.count);
}

static void steeply(struct harness *h)
{
    steep = 1;
    kinds(h);
    shapes(h);
    lines(h);
    analytic(h);
    steep = 0;
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"pictures of all kinds", kinds, 0},    {"shapes of planes", shapes, 0},   {"points on a line", lines, 0},
        {"planes of known slope", analytic, 0}, {"a steep plane", steep_plane, 0}, {"all of these, steep", steeply, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
