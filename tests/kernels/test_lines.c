// SPDX-License-Identifier: GPL-3.0-or-later
// lines: shares within the table, and bit by bit between devices; the pixel that each line belongs to, exactly.
#include "harness.h"
#include "plan/lines.h"

#include <math.h>
#include <string.h>

struct way {
    float width; // 0..16 pixels; world: of the footprint at z = 1
    uint32_t world, antialias, behind;
    float offset, soft;
};

static struct lines_args args_of(const struct picture *picture, const struct way *way)
{
    const struct view_args *view = &picture->view;
    struct lines_args args = {.view = *view,
                              .width = way->world ? way->width * view->footprint : way->width,
                              .world = way->world && view->perspective,
                              .most = fminf(way->world ? way->width / 3.0f : way->width, PT_LINE_MOST),
                              .offset = way->offset,
                              .soft = way->soft,
                              .antialias = way->antialias,
                              .behind = way->behind};
    pt_line_taps(&args);
    return args;
}

// share: of pixels that may stay open
static size_t check(struct harness *h, const struct picture *picture, const struct way *way, double share)
{
    const struct lines_args args = args_of(picture, way);
    const struct view_args *view = &args.view;
    const size_t count = picture->count;
    struct rng rng = {count};
    float *limit = harness_alloc(h, count * 4), *through = harness_alloc(h, count * 4);
    size_t open = 0, lines = 0;
    for (size_t i = 0; i < count; i++) {
        static const float lights[] = {1.0f, 0.0f, 0.001953125f, 0.0019531f, 0.5f};
        float z = picture->keys[i] == REF_EMPTY_KEY ? 5.0f : (float)ref_key_z(picture->keys[i]);
        limit[i] = rng_below(&rng, 3) ? 0.5f * z : picture->keys[i] == REF_EMPTY_KEY ? 2.25f : z;
        through[i] = lights[rng_below(&rng, 5)];
    }
    struct pt_buffer *line = harness_buffer(h, NULL, count * 4), *nearest = harness_buffer(h, NULL, count * 4);
    HARNESS_RUN(h, lines, &args, harness_buffer(h, picture->keys, count * 8), harness_buffer(h, picture->from, count * 4),
                harness_buffer(h, picture->normal, count * 16), harness_buffer(h, picture->deff, count * 4), line, nearest,
                harness_buffer(h, limit, count * 4), harness_buffer(h, through, count * 4));
    const float *got = harness_read(h, line);
    uint32_t *got_nearest = harness_read(h, nearest);
    struct ref_planes planes = picture_planes(picture);
    planes.through = through;
    const int whole = view->rect[2] - view->rect[0] == view->width && view->rect[3] - view->rect[1] == view->height;
    if (whole) {
        harness_same(h, "line", got, count, 4, 1, view->width);
        for (size_t i = 0; i < count; i++)
            if (got[i] == 0.0f)
                got_nearest[i] = 0; // undefined there
        harness_same(h, "nearest", got_nearest, count, 4, 1, view->width);
    }
    for (size_t i = 0; i < count; i++) {
        int x = (int)(i % view->width), y = (int)(i / view->width);
        if (x < (int)view->rect[0] || y < (int)view->rect[1] || x >= (int)view->rect[2] || y >= (int)view->rect[3])
            continue;
        lines += got[i] > 0.0f;
        if (whole && harness_settled(h))
            continue;
        struct ref_line expected = ref_lines(&args, &planes, limit, x, y);
        open += (size_t)expected.unsure;
        if (expected.unsure)
            continue;
        if (!harness_near(got[i], expected.share, expected.error))
            harness_fail(h, "share", x, y, "got %.9g, expected %.9g +- %.2g", got[i], expected.share, expected.error);
        if (got[i] > 0.0f && !expected.shared && got_nearest[i] != expected.nearest)
            harness_fail(h, "nearest", x, y, "got %u, expected %u", got_nearest[i], expected.nearest);
    }
    harness_unsure(h, open, count, share);
    return lines;
}

static const struct way ways[] = {
    {.width = 2.0f, .antialias = 1},
    {.width = 1.0f},
    {.width = 3.5f, .antialias = 1, .soft = 1.0f},
    {.width = 2.5f, .antialias = 1, .behind = 1, .soft = 0.5f},
    {.width = 12.0f, .antialias = 1, .world = 1},
    {.width = 0.3f, .antialias = 1, .offset = 0.05f},
    {.width = 5.0f, .behind = 1, .offset = 0.2f},
    {.width = 16.0f, .antialias = 1},
};

static void kinds(struct harness *h)
{
    size_t lines = 0;
    for (int p = 0; p < 2; p++)
        for (int kind = 0; kind < PICTURE_KINDS; kind++)
            for (size_t way = 0; way < sizeof ways / sizeof ways[0]; way++) {
                struct rng rng = {(uint64_t)(10 * kind) + way};
                struct picture picture = picture_random(h, &rng, picture_view(67, 45, p), (enum picture_kind)kind, 0.7);
                picture_invent(&picture, &rng, 0.8, 3);
                lines += check(h, &picture, &ways[way],
                               kind == PICTURE_TIGHT || kind == PICTURE_GRAZING ? TOL_UNSURE_HARD : TOL_UNSURE_SHARE);
            }
    HARNESS_CHECK(h, lines > 20000);
}

static void shapes(struct harness *h)
{
    static const uint32_t sizes[][2] = {{1, 1}, {16384, 1}, {1, 70}, {64, 64}, {17, 33}, {2, 2}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++)
        for (size_t way = 0; way < 4; way++) {
            struct rng rng = {i};
            struct picture picture = picture_random(h, &rng, picture_view(sizes[i][0], sizes[i][1], 1), PICTURE_NOISE, 0.5);
            check(h, &picture, &ways[way], TOL_UNSURE_HARD);
        }
}

// Beyond the rectangle nothing is known.
static void rectangle(struct harness *h)
{
    static const uint32_t rects[][4] = {{3, 2, 50, 30}, {16, 16, 48, 32}, {40, 20, 41, 21}, {0, 30, 67, 45}};
    for (size_t i = 0; i < sizeof rects / sizeof rects[0]; i++) {
        struct rng rng = {i};
        struct picture picture = picture_random(h, &rng, picture_view(67, 45, 1), PICTURE_SURFACES, 0.7);
        memcpy(picture.view.rect, rects[i], sizeof rects[i]);
        check(h, &picture, &ways[i], TOL_UNSURE_HARD);
    }
}

static void extremes(struct harness *h)
{
    for (int way = 0; way < 2; way++) {
        struct rng rng = {20};
        struct picture picture = picture_random(h, &rng, picture_view(67, 45, 1), PICTURE_FLAT, way ? 1.0 : 0.0);
        HARNESS_CHECK(h, check(h, &picture, &ways[0], 0.0) == 0); // nothing, and one plane that fills all
    }
}

// A ball, and a bowl, one point a pixel, to their rims: their own surface shows no lines. A bowl's rim does lie before its inside,
// where lines are wider than a fifth of its radius.
static void smooth_surfaces(struct harness *h)
{
    enum { SIDE = 120 };
    for (int bowl = 0; bowl < 2; bowl++)
        for (int p = 0; p < 2; p++) {
            struct rng rng = {1};
            struct picture picture = picture_random(h, &rng, picture_view(SIDE, SIDE, p), PICTURE_FLAT, 1.0);
            const struct view_args *view = &picture.view;
            struct ref_ray middle = ref_ray(view, SIDE / 2, SIDE / 2);
            const double radius = 50.0 * (double)view->footprint * (p ? 5.0 : 1.0);
            for (size_t i = 0; i < picture.count; i++) {
                struct ref_ray ray = ref_ray(view, (int)(i % SIDE), (int)(i / SIDE));
                double u = (ray.u - middle.u) * (p ? 5.0 : 1.0), v = (ray.v - middle.v) * (p ? 5.0 : 1.0);
                double square = radius * radius - u * u - v * v, height = sqrt(fmax(square, 0.0)) * (bowl ? 1.0 : -1.0);
                struct ref_vec n = ref_unit(ref_vec(bowl ? -u : u, bowl ? -v : v, fabs(height)));
                if (p) // seen as in an orthographic view, shrunk so far that rays hardly part
                    n = ref_unit(ref_vec(n.x, n.y, n.z + ray.u * n.x + ray.v * n.y));
                double cosine = fabs(ref_dot(n, ref_viewer(view, ray)));
                if (square <= 0.0) {
                    picture.keys[i] = REF_EMPTY_KEY;
                    continue;
                }
                picture.keys[i] = ref_key((float)(5.0 + height), ref_key_id(picture.keys[i]));
                picture.normal[4 * i] = (float)n.x;
                picture.normal[4 * i + 1] = (float)n.y;
                picture.normal[4 * i + 2] = (float)n.z;
                picture.normal[4 * i + 3] = (float)(1.0 / fmax(cosine, (double)PT_COSINE_FLOOR));
                picture.deff[i] = 2.0f * (float)ref_footprint(view, 5.0 + height) * picture.normal[4 * i + 3];
            }
            for (uint32_t width = 1; width <= (bowl ? 10u : 16u); width++) {
                struct way way = {.width = (float)width};
                struct lines_args args = args_of(&picture, &way);
                struct pt_buffer *line = harness_buffer(h, NULL, picture.count * 4);
                HARNESS_RUN(h, lines, &args, harness_buffer(h, picture.keys, picture.count * 8),
                            harness_buffer(h, picture.from, picture.count * 4),
                            harness_buffer(h, picture.normal, picture.count * 16),
                            harness_buffer(h, picture.deff, picture.count * 4), line,
                            harness_buffer(h, NULL, picture.count * 4), NULL, NULL);
                const float *got = harness_read(h, line);
                size_t wrong = 0;
                for (size_t i = 0; i < picture.count; i++)
                    wrong += picture.keys[i] != REF_EMPTY_KEY && got[i] > 0.0f;
                if (wrong)
                    harness_fail(h, bowl ? "bowl" : "ball", (int)width, p, "%zu pixels of its surface show lines", wrong);
            }
        }
}

// Reference alone: a near block of four pixels in the middle of a far plane, facing the viewer.
static void sanity(struct harness *h)
{
    enum { SIDE = 10 };
    uint64_t keys[SIDE * SIDE];
    uint32_t from[SIDE * SIDE];
    float normal[SIDE * SIDE][4], deff[SIDE * SIDE];
    for (uint32_t i = 0; i < SIDE * SIDE; i++) {
        uint32_t x = i % SIDE, y = i / SIDE;
        keys[i] = ref_key((x == 4 || x == 5) && (y == 4 || y == 5) ? 2.0f : 4.0f, i);
        from[i] = i;
        deff[i] = 0.5f;
        normal[i][0] = normal[i][1] = 0.0f;
        normal[i][2] = normal[i][3] = 1.0f;
    }
    struct lines_args args = {.view = {.width = SIDE, .height = SIDE, .rect = {0, 0, SIDE, SIDE}, .ray_xs = 1, .ray_ys = 1},
                              .most = 2.0f,
                              .antialias = 1};
    struct ref_planes planes = {.keys = keys, .from = from, .normal = &normal[0][0], .deff = deff};
    pt_line_taps(&args);
    HARNESS_CHECK(h, args.reach == 2 && args.tap_count == 20 && args.taps[0] == (128u | 127u << 8 | 1u << 16));
    HARNESS_CHECK(h, ref_lines(&args, &planes, NULL, 6, 4).share == 1.0 && ref_lines(&args, &planes, NULL, 6, 4).nearest == 45);
    HARNESS_CHECK(h, ref_lines(&args, &planes, NULL, 7, 4).share == 0.5 && ref_lines(&args, &planes, NULL, 8, 4).share == 0.0);
    HARNESS_CHECK(h, fabs(ref_lines(&args, &planes, NULL, 4, 4).share - 5.0 / 6.0) < 1e-12); // two sides: a sixth stays
    args.soft = 1.0f;
    HARNESS_CHECK(h, fabs(ref_lines(&args, &planes, NULL, 6, 4).share - 0.6) < 1e-12);
    args.soft = 0.0f;
    keys[45] = keys[54] = keys[55] = keys[0]; // one pixel alone
    HARNESS_CHECK(h, ref_lines(&args, &planes, NULL, 6, 4).share == 0.0 && ref_lines(&args, &planes, NULL, 4, 4).share == 0.0);
    keys[45] = keys[54] = keys[44]; // three of them
    HARNESS_CHECK(h, ref_lines(&args, &planes, NULL, 6, 4).share == 1.0);
    for (uint32_t i = 0; i < SIDE * SIDE; i++)
        deff[i] = 2.0f; // the step is no more than that
    HARNESS_CHECK(h, ref_lines(&args, &planes, NULL, 6, 4).share == 0.0);
    args.most = PT_LINE_MOST;
    pt_line_taps(&args);
    HARNESS_CHECK(h, args.reach == 16 && args.tap_count == 860 && args.tap_count <= PT_LINE_TAPS);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"kinds of pictures", kinds, 0},         {"shapes of planes", shapes, 0},         {"rectangles", rectangle, 0},
        {"nothing and everything", extremes, 0}, {"smooth surfaces", smooth_surfaces, 0}, {"the reference itself", sanity, 1},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
