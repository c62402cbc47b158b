// SPDX-License-Identifier: GPL-3.0-or-later
// resolve: normals in view space, 1 / max(|n.v|, C), d_eff.
#include "harness.h"
#include "shared/measured.h"

#include <math.h>
#include <string.h>

// Two instances share the picture: the lower half of the ids is tested, the upper must stay untouched.
static struct resolve_args arguments(const struct picture *picture, struct rng *rng)
{
    struct resolve_args args = {.view = picture->view};
    args.instance.id_base = picture->id_base;
    picture_slots(&args.instance, picture->count * 3 / 4);
    args.instance.has_normals = 1;
    for (int i = 0; i < PT_SPACINGS; i++)
        args.instance.spacing[i] = (float)(1e-4 * pow(1.2, i));
    for (int i = 0; i < 9; i++)
        args.instance.normal_matrix[i] = (float)rng_range(rng, -1.0, 1.0);
    return args;
}

static uint32_t *random_words(struct harness *h, struct rng *rng, size_t count, int none_only)
{
    uint32_t *words = harness_alloc(h, count * 4);
    for (size_t i = 0; i < count; i++) {
        words[i] = (uint32_t)rng_next(rng);
        if (none_only || rng_below(rng, 10) == 0)
            words[i] |= PT_NORMAL_NONE;
    }
    return words;
}

static void compare(struct harness *h, const char *label, int x, int y, double got, double expected, double error)
{
    if (!harness_near(got, expected, error))
        harness_fail(h, label, x, y, "got %.9g, expected %.9g +- %.2g", got, expected, error);
}

// shapes: NULL where the cloud was not analysed.
static void check_shapes(struct harness *h, const struct picture *picture, const struct resolve_args *args,
                         const uint32_t *words, const uint32_t *shapes, const float *estimate)
{
    size_t count = picture->count;
    float *deff = harness_alloc(h, count * 4), *span = harness_alloc(h, count * 4);
    uint32_t *from = harness_alloc(h, count * 4);
    for (size_t i = 0; i < count; i++) {
        deff[i] = span[i] = -7.0f;
        from[i] = 0xABCDEF01u;
    }
    struct pt_buffer *keys_buffer = harness_buffer(h, picture->keys, count * 8);
    struct pt_buffer *words_buffer = harness_buffer(h, words, (size_t)args->instance.slots * 4);
    struct pt_buffer *normal_buffer = harness_buffer(h, estimate, count * 16);
    struct pt_buffer *deff_buffer = harness_buffer(h, deff, count * 4);
    struct pt_buffer *from_buffer = harness_buffer(h, from, count * 4);
    struct pt_buffer *shapes_buffer = harness_buffer(h, shapes ? shapes : words, (size_t)args->instance.slots * 4);
    struct pt_buffer *span_buffer = harness_buffer(h, span, count * 4);
    HARNESS_RUN(h, resolve, args, keys_buffer, words_buffer, normal_buffer, deff_buffer, from_buffer, shapes_buffer,
                span_buffer);
    const float *got_normal = harness_read(h, normal_buffer), *got_deff = harness_read(h, deff_buffer);
    const float *got_span = harness_read(h, span_buffer);
    const uint32_t *got_from = harness_read(h, from_buffer);
    uint32_t width = args->view.width;
    harness_same(h, "normal", got_normal, 4 * count, 4, 4, width);
    harness_same(h, "deff", got_deff, count, 4, 1, width);
    harness_same(h, "from", got_from, count, 4, 1, width);
    harness_same(h, "span", got_span, count, 4, 1, width);

    struct ref_planes planes = {.keys = picture->keys, .normal = estimate, .surfels = words, .shapes = shapes};
    const uint32_t *rect = args->view.rect;
    for (size_t i = 0; i < count; i++) {
        int x = (int)(i % width), y = (int)(i / width);
        int inside = (uint32_t)x >= rect[0] && (uint32_t)x < rect[2] && (uint32_t)y >= rect[1] && (uint32_t)y < rect[3];
        if (!inside || !ref_is_of(&args->instance, picture->keys[i])) {
            if (memcmp(got_normal + 4 * i, estimate + 4 * i, 16) || got_deff[i] != -7.0f || got_span[i] != -7.0f ||
                got_from[i] != 0xABCDEF01u)
                harness_fail(h, "untouched", x, y, "was written: d_eff %g, from %u", got_deff[i], got_from[i]);
            continue;
        }
        struct ref_resolve expected = ref_resolve(args, &planes, x, y);
        compare(h, "normal.x", x, y, got_normal[4 * i], expected.n.x, expected.normal_error);
        compare(h, "normal.y", x, y, got_normal[4 * i + 1], expected.n.y, expected.normal_error);
        compare(h, "normal.z", x, y, got_normal[4 * i + 2], expected.n.z, expected.normal_error);
        compare(h, "normal.w", x, y, got_normal[4 * i + 3], expected.inverse, expected.inverse_error);
        compare(h, "deff", x, y, got_deff[i], expected.deff, expected.deff_error);
        if (args->with_span)
            compare(h, "span", x, y, got_span[i], expected.span, expected.span_error);
        else if (got_span[i] != -7.0f)
            harness_fail(h, "span", x, y, "was written: %g", got_span[i]);
        if (got_from[i] != expected.from)
            harness_fail(h, "from", x, y, "got %u, expected %u", got_from[i], expected.from);
    }
}

static void check(struct harness *h, const struct picture *picture, const struct resolve_args *args, const uint32_t *words,
                  const float *estimate)
{
    check_shapes(h, picture, args, words, NULL, estimate);
}

static void random_normals(struct harness *h)
{
    static const uint32_t shapes[][2] = {{67, 45}, {1, 1}, {1024, 1}, {64, 16}, {3, 90}};
    struct rng rng = {1};
    for (int p = 0; p < 2; p++)
        for (size_t s = 0; s < sizeof shapes / sizeof shapes[0]; s++) {
            struct picture picture = picture_random(h, &rng, picture_view(shapes[s][0], shapes[s][1], p),
                                                    s % 2 ? PICTURE_RANGE : PICTURE_SURFACES, 0.8);
            struct resolve_args args = arguments(&picture, &rng);
            check(h, &picture, &args, random_words(h, &rng, args.instance.slots, 0), picture.normal);
        }
}

// No normals in the cloud: the estimate in the normal plane counts, all zero is none.
static void estimated(struct harness *h)
{
    struct rng rng = {2};
    for (int p = 0; p < 2; p++) {
        struct picture picture = picture_random(h, &rng, picture_view(67, 45, p), PICTURE_NOISE, 0.7);
        struct resolve_args args = arguments(&picture, &rng);
        args.instance.has_normals = 0;
        for (size_t i = 0; i < picture.count; i++) {
            picture.normal[4 * i + 3] = 0.0f;
            if (rng_below(&rng, 4) == 0)
                memset(picture.normal + 4 * i, 0, 16);
        }
        check(h, &picture, &args, random_words(h, &rng, args.instance.slots, 1), picture.normal);
    }
}

static void matrices(struct harness *h)
{
    static const float special[][9] = {
        {0},                                     // zero scale
        {-1, 0, 0, 0, 1, 0, 0, 0, 1},            // mirrored
        {1e-6f, 0, 0, 0, 1e-6f, 0, 0, 0, 1e-6f}, // tiny
        {1e6f, 0, 0, 0, 1e6f, 0, 0, 0, 1e6f},    // huge
        {1, 0, 0, 0, 1, 0, 0, 0, 0},             // flat: n.v -> 0
        {1, 0, 0, 0, 1, 0, 0, 0, 1e-3f},         // nearly flat
        {0, 0, 0, 0, 0, 0, 1, 1, 1},             // rank 1
    };
    struct rng rng = {3};
    for (int p = 0; p < 2; p++)
        for (size_t s = 0; s < sizeof special / sizeof special[0]; s++) {
            struct picture picture = picture_random(h, &rng, picture_view(35, 17, p), PICTURE_SURFACES, 0.9);
            struct resolve_args args = arguments(&picture, &rng);
            memcpy(args.instance.normal_matrix, special[s], sizeof special[s]);
            check(h, &picture, &args, random_words(h, &rng, args.instance.slots, 0), picture.normal);
        }
}

// Every part of d_eff's maximum gets its turn: d_min, spacing, footprint, ulp.
static void distances(struct harness *h)
{
    static const float d_min[] = {0.0f, 1e-3f, 10.0f, 1e30f};
    struct rng rng = {4};
    for (int p = 0; p < 2; p++)
        for (size_t s = 0; s < 4; s++) {
            struct picture picture = picture_random(h, &rng, picture_view(35, 17, p), PICTURE_RANGE, 0.9);
            picture.view.footprint = s == 1 ? 1e-12f : picture.view.footprint; // leaves 4 ulp to decide
            struct resolve_args args = arguments(&picture, &rng);
            args.instance.d_min = d_min[s];
            for (int i = 0; i < PT_SPACINGS; i++)
                args.instance.spacing[i] = s == 1 && i % 2 ? 0.0f : args.instance.spacing[i];
            check(h, &picture, &args, random_words(h, &rng, args.instance.slots, 0), picture.normal);
        }
}

// What is known of sigma takes the place of the spacing, and never more; the span plane is as if nothing were.
static void sigmas(struct harness *h)
{
    struct rng rng = {6};
    for (int p = 0; p < 2; p++)
        for (int spans = 0; spans < 2; spans++) {
            struct picture picture = picture_random(h, &rng, picture_view(67, 45, p), PICTURE_SURFACES, 0.9);
            struct resolve_args args = arguments(&picture, &rng);
            args.instance.has_normals = (uint32_t)spans;
            args.sigma_scale = 0.0625f;
            args.with_span = (uint32_t)spans;
            uint32_t *shapes = random_words(h, &rng, args.instance.slots, 0);
            for (size_t i = 0; i < args.instance.slots; i += 3)
                shapes[i] &= ~(63u << PT_SHAPE_SIGMA_SHIFT); // not known
            check_shapes(h, &picture, &args, random_words(h, &rng, args.instance.slots, !spans), shapes, picture.normal);
        }
}

static void rectangle(struct harness *h)
{
    struct rng rng = {5};
    struct picture picture = picture_random(h, &rng, picture_view(67, 45, 1), PICTURE_SURFACES, 0.9);
    struct resolve_args args = arguments(&picture, &rng);
    const uint32_t rect[4] = {5, 7, 38, 40};
    memcpy(args.view.rect, rect, sizeof rect);
    check(h, &picture, &args, random_words(h, &rng, args.instance.slots, 0), picture.normal);
}

// Reference alone: corners and middle of the octahedron, a surface seen at 60 degrees.
static void sanity(struct harness *h)
{
    static const struct {
        uint32_t x, y;
        struct ref_vec n;
    } known[] = {
        {4095, 4095, {0, 0, 1}}, {8190, 4095, {1, 0, 0}},  {0, 4095, {-1, 0, 0}},
        {4095, 8190, {0, 1, 0}}, {8190, 8190, {0, 0, -1}}, {0, 0, {0, 0, -1}},
    };
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        struct ref_vec n;
        HARNESS_CHECK(h, ref_decode_normal(known[i].x | known[i].y << 13, &n));
        HARNESS_CHECK(h, ref_length(ref_add(n, ref_scale(known[i].n, -1.0))) < 1e-12);
    }
    struct ref_vec n;
    HARNESS_CHECK(h, !ref_decode_normal(PT_NORMAL_NONE | 5u << 26, &n));
    HARNESS_CHECK(h, ref_ulp4(1.0) == 0x1p-21 && ref_ulp4(1.99) == 0x1p-21 && ref_ulp4(2.0) == 0x1p-20);

    uint64_t key = ref_key(8.0f, 3);
    float normal[4] = {(float)sqrt(0.75), 0.0f, 0.5f, 0.0f};
    uint32_t words[4] = {0, 0, 0, PT_NORMAL_NONE | 1u << 26};
    struct resolve_args args = {.view = {.width = 1, .height = 1, .footprint = 0.25f}};
    picture_slots(&args.instance, 4);
    args.instance.spacing[1] = 0.5f; // twice that is the greatest
    struct ref_planes planes = {.keys = &key, .normal = normal, .surfels = words};
    struct ref_resolve out = ref_resolve(&args, &planes, 0, 0);
    HARNESS_CHECK(h, fabs(out.inverse - 2.0) < 1e-6 && fabs(out.deff - 2.0) < 1e-6);
    const uint32_t thin[4] = {0, 0, 0, 1u << PT_SHAPE_SIGMA_SHIFT}; // a sigma of 0.01: 0.7 spacings decide
    planes.shapes = thin;
    args.sigma_scale = 0.02f;
    out = ref_resolve(&args, &planes, 0, 0);
    HARNESS_CHECK(h, fabs(out.deff - 0.7) < 1e-6 && fabs(out.span - 2.0) < 1e-6);
    args.sigma_scale = 0.4f; // 0.2: four of it
    HARNESS_CHECK(h, fabs(ref_resolve(&args, &planes, 0, 0).deff - 1.6) < 1e-6);
    args.sigma_scale = 4.0f; // no more than two spacings
    HARNESS_CHECK(h, fabs(ref_resolve(&args, &planes, 0, 0).deff - 2.0) < 1e-6);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"sanity", sanity, 1},
        {"random normals", random_normals, 0},
        {"estimated normals", estimated, 0},
        {"zero, mirrored, tiny, huge and flat matrices", matrices, 0},
        {"what d_eff consists of", distances, 0},
        {"sigmas", sigmas, 0},
        {"rectangle", rectangle, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
