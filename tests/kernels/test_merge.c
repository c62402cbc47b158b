// SPDX-License-Identifier: GPL-3.0-or-later
// merge: means over the points of each cell, over keys that scatter made.
#include "points.h"
#include "shared/points.h"
#include "shared/ranges.h"

#include <math.h>
#include <string.h>

static const uint32_t sizes[] = {1, 15, 16, 17, 300, 500, 31, 2};
enum { SIZES = sizeof sizes / sizeof sizes[0], UNTOUCHED = -77 };

struct setup {
    struct scene scene;
    struct merge_args args;
    void *colors;
    uint8_t *opacities; // NULL: none
    size_t color_bytes;
};

static struct setup look_at(struct harness *h, struct rng *rng, uint32_t width, uint32_t height, int perspective, double focal,
                            const uint32_t *counts, uint32_t chunks, uint32_t format)
{
    struct setup s = {.scene = {.view = points_window(width, height, perspective, focal)}};
    const struct camera camera = points_look(rng, &s.scene.view, focal, 4.0);
    struct cloud *cloud = points_add_cloud(h, rng, &s.scene, &camera, counts, chunks, 1, 7000);
    s.args.view = s.scene.view;
    s.args.instance = (struct instance_args){.id_base = 7000,
                                             .id_count = cloud->slots,
                                             .slots = cloud->slots,
                                             .color_format = format,
                                             .opacity = 0.75f,
                                             .color = {0.2f, 0.7f, 3.0f}};
    s.args.gamma = 0.6f;
    points_scatter_about(rng, cloud, 1.0);
    s.color_bytes = (size_t)cloud->slots * (format == 2 ? 12 : 3) + 4;
    s.colors = harness_alloc(h, s.color_bytes);
    for (size_t i = 0; i < 3 * (size_t)cloud->slots; i++)
        if (format == 2)
            ((float *)s.colors)[i] = (float)(rng_below(rng, 50) ? rng_range(rng, -0.5, 1.5) : 60000.0);
        else
            ((uint8_t *)s.colors)[i] = (uint8_t)rng_next(rng);
    return s;
}

static struct ref_look look_of(const struct setup *s, uint32_t at)
{
    struct ref_look look = {.opacity = (double)s->args.instance.opacity * (s->opacities ? s->opacities[at] / 255.0 : 1.0)};
    for (uint32_t k = 0; k < 3; k++)
        look.color[k] = s->args.instance.color_format == 0   ? (double)s->args.instance.color[k]
                        : s->args.instance.color_format == 1 ? ref_srgb(((const uint8_t *)s->colors)[3 * at + k])
                                                             : (double)((const float *)s->colors)[3 * at + k];
    return look;
}

struct cells {
    const uint64_t *keys;
    const float *place, *merged;
};

static void hold_against(struct harness *h, const struct setup *s, const struct cells *got, double open)
{
    const struct cloud *cloud = &s->scene.clouds[0];
    const uint32_t width = s->scene.view.width;
    struct ref_merged_point *points = harness_alloc(h, cloud->slots * sizeof *points);
    uint32_t count = 0;
    size_t unsure = 0, shown = 0;
    for (uint32_t c = 0; c < cloud->chunk_count; c++)
        for (uint32_t i = 0; i < cloud->chunks[c].count; i++, count++) {
            points[count].splat = ref_scatter(&s->scene.view, &cloud->chunks[c], cloud->positions, cloud->surfels, i);
            points[count].place = ref_place(&s->scene.view, &cloud->chunks[c], cloud->positions, i);
            points[count].look = look_of(s, cloud->chunks[c].first + i);
        }
    for (size_t p = 0; p < (size_t)width * s->scene.view.height; p++) {
        const int x = (int)(p % width), y = (int)(p / width);
        const float *place = got->place + 4 * p, *color = got->merged + 4 * p;
        if (got->keys[p] == REF_EMPTY_KEY) {
            if (place[3] != 0.0f)
                harness_fail(h, "place", x, y, "%.9g points in an empty cell", place[3]);
            continue;
        }
        const struct ref_merge expected = ref_merge(&s->args, points, count, (float)ref_key_z(got->keys[p]),
                                                    ref_key_id(got->keys[p]), x, y);
        shown++;
        unsure += expected.unsure != 0;
        if (!(place[3] >= 0.999f) || !(place[0] >= 0.0f && place[0] <= 1.0f && place[1] >= 0.0f && place[1] <= 1.0f))
            harness_fail(h, "place", x, y, "%.9g %.9g, %.9g points", place[0], place[1], place[3]);
        for (int k = 0; k < 4 && !expected.unsure; k++) {
            if (!harness_near(place[k], expected.place[k], expected.place_error[k]))
                harness_fail(h, "place", x, y, "%d: got %.9g, expected %.9g +- %.2g", k, place[k], expected.place[k],
                             expected.place_error[k]);
            if (!harness_near(color[k], expected.color[k], expected.color_error[k] + 3e-6))
                harness_fail(h, "merged", x, y, "channel %d: got %.9g, expected %.9g +- %.2g", k, color[k], expected.color[k],
                             expected.color_error[k]);
        }
    }
    harness_note(h, "%zu cells, %zu open", shown, unsure);
    HARNESS_CHECK(h, shown > 0);
    harness_unsure(h, unsure, shown, open);
}

static struct cells run(struct harness *h, struct setup *s, double open)
{
    struct scene *scene = &s->scene;
    struct cloud *cloud = &scene->clouds[0];
    const size_t count = (size_t)scene->view.width * scene->view.height;
    struct cells cells;
    uint64_t *empty = harness_alloc(h, count * 8);
    float *unset = harness_alloc(h, count * 16);
    for (size_t i = 0; i < count; i++)
        empty[i] = REF_EMPTY_KEY;
    for (size_t i = 0; i < 4 * count; i++)
        unset[i] = UNTOUCHED;
    points_pad(cloud);
    struct pt_buffer *keys = harness_buffer(h, empty, count * 8), *merged = harness_buffer(h, unset, count * 16);
    struct pt_buffer *place = harness_buffer(h, unset, count * 16);
    struct pt_buffer *chunks = harness_buffer(h, cloud->chunks, cloud->chunk_count * sizeof *cloud->chunks);
    struct pt_buffer *positions = points_positions(h, cloud->chunks, cloud->chunk_count, cloud->positions, cloud->slots);
    struct pt_buffer *surfels = harness_buffer(h, cloud->surfels, 4 * (size_t)cloud->slots);
    struct pt_buffer *colors = harness_buffer(h, s->colors, s->color_bytes);
    struct pt_buffer *opacities = s->opacities ? harness_buffer(h, s->opacities, (size_t)cloud->slots + 4) : NULL;
    struct pt_buffer *drawn = s->args.sifted ? harness_buffer(h, scene->drawn, 4 * (size_t)scene->words) : NULL;
    const struct scatter_args scatter = {.view = scene->view, .instances = 1, .sifted = s->args.sifted};
    HARNESS_RUN(h, scatter, &scatter, keys, NULL, drawn, chunks, positions, surfels);
    HARNESS_RUN(h, merge, &s->args, keys, place, merged, chunks, positions, surfels, colors, opacities, drawn);
    cells.keys = harness_read(h, keys);
    cells.place = harness_read(h, place);
    cells.merged = harness_read(h, merged);
    harness_same(h, "place", cells.place, count * 4, 4, 4, scene->view.width);
    harness_same(h, "merged", cells.merged, count * 4, 4, 4, scene->view.width);
    if (!s->args.sifted)
        hold_against(h, s, &cells, open);
    return cells;
}

static void random_clouds(struct harness *h, int perspective)
{
    for (uint32_t format = 0; format < 3; format++) {
        struct rng rng = {31 + format};
        struct setup s = look_at(h, &rng, 37, 25, perspective, perspective ? 30.0 : 10.0, sizes, SIZES, format);
        if (format == 1) { // of their own, some 0
            s.args.instance.has_opacities = 1;
            s.opacities = harness_alloc(h, (size_t)s.scene.clouds[0].slots + 4);
            for (uint32_t i = 0; i < s.scene.clouds[0].slots; i++)
                s.opacities[i] = rng_below(&rng, 5) ? (uint8_t)rng_next(&rng) : 0;
        }
        run(h, &s, TOL_UNSURE_SHARE);
    }
}

static void perspective(struct harness *h) { random_clouds(h, 1); }
static void orthographic(struct harness *h) { random_clouds(h, 0); }

// Of no depth, of any, and of so many cells.
static void gammas(struct harness *h)
{
    static const float gammas[][2] = {{PT_RANGE_LEAST, 0.0f}, {PT_RANGE_MOST, 0.0f}, {1e-3f, 2.0f}, {0.05f, 0.0f}};
    for (size_t g = 0; g < sizeof gammas / sizeof gammas[0]; g++) {
        struct rng rng = {50 + g};
        struct setup s = look_at(h, &rng, 37, 25, 1, 30.0, sizes, SIZES, 1);
        s.args.gamma = gammas[g][0];
        s.args.gamma_cells = gammas[g][1];
        const struct cells cells = run(h, &s, TOL_UNSURE_SHARE);
        for (size_t p = 0; p < (size_t)37 * 25 && !g; p++) // the nearest alone
            if (cells.keys[p] != REF_EMPTY_KEY && (double)cells.place[4 * p + 2] != ref_key_z(cells.keys[p]))
                harness_fail(h, "place", (int)(p % 37), (int)(p / 37), "z %.9g", cells.place[4 * p + 2]);
    }
}

// Many bright points in a few cells: sums pass 32 bits, and end below 0.
static void overflow(struct harness *h)
{
    static const uint32_t many[] = {4096, 4096, 4096, 100};
    struct rng rng = {7};
    struct setup s = look_at(h, &rng, 9, 7, 1, 2.0, many, 4, 2);
    struct cloud *cloud = &s.scene.clouds[0];
    s.args.gamma = 10.0f;
    for (uint32_t i = 0; i < cloud->slots; i++) {
        float *rgb = (float *)s.colors + 3 * (size_t)i;
        rgb[0] = 4000.0f;
        rgb[1] = i % 2 ? -3000.0f : 1000.0f;
        rgb[2] = 1e-3f;
    }
    run(h, &s, TOL_UNSURE_HARD);
}

// Of colours up to white: so many points in a cell that 32 bits, in which the processor begins, are too few for their weights.
static void crowd(struct harness *h)
{
    static const uint32_t many[] = {4096, 4096, 4096, 4096, 100};
    for (uint32_t format = 0; format < 2; format++) {
        struct rng rng = {9 + format};
        struct setup s = look_at(h, &rng, 2, 2, 1, 2.0, many, 5, format);
        struct cloud *cloud = &s.scene.clouds[0];
        double most = 0.0;
        s.args.instance.color[2] = 1.0f;
        s.args.gamma = 1000.0f;
        for (uint32_t c = 0; c < cloud->chunk_count; c++) {
            cloud->chunks[c].cull = 0;
            for (uint32_t k = 0; k < cloud->chunks[c].count; k++)
                for (int axis = 0; axis < 3; axis++)
                    *points_coordinate(cloud, c, k, axis) *= 0.05f;
        }
        const struct cells cells = run(h, &s, TOL_UNSURE_HARD);
        for (size_t p = 0; p < 4; p++)
            most = fmax(most, (double)cells.place[4 * p + 3]);
        if (!(most > 8192.0)) // 2^31 in all
            harness_fail(h, "place", 0, 0, "%.9g points at most in a cell", most);
    }
}

// What is sifted out adds nothing: every other slot, all of which are red.
static void sifted(struct harness *h)
{
    static const uint32_t many[] = {4000, 333};
    struct rng rng = {8};
    struct setup s = look_at(h, &rng, 37, 25, 1, 30.0, many, 2, 1);
    struct cloud *cloud = &s.scene.clouds[0];
    s.args.sifted = 1;
    s.scene.words = cloud->slots / PT_SLOTS_A_WORD + 1;
    s.scene.drawn = harness_alloc(h, 4 * (size_t)s.scene.words);
    for (uint32_t i = 0; i < s.scene.words; i++)
        s.scene.drawn[i] = 0x5555u;
    for (uint32_t c = 0; c < 2; c++)
        cloud->chunks[c].sifted = 1 + cloud->chunks[c].first / PT_SLOTS_A_WORD;
    for (uint32_t i = 0; i < cloud->slots; i++) {
        uint8_t *rgb = (uint8_t *)s.colors + 3 * (size_t)i;
        rgb[0] = i % 2 ? 255 : 0;
        rgb[1] = i % 2 ? 0 : 255;
        rgb[2] = 0;
    }
    const struct cells cells = run(h, &s, 1.0);
    size_t shown = 0;
    for (size_t p = 0; p < (size_t)37 * 25; p++)
        if (cells.keys[p] != REF_EMPTY_KEY) {
            shown++;
            HARNESS_CHECK(h, cells.merged[4 * p] == 0.0f && harness_near(cells.merged[4 * p + 1], 1.0, 1e-5));
        }
    HARNESS_CHECK(h, shown > 100);
}

static void plane_sizes(struct harness *h)
{
    static const uint32_t shapes[][2] = {{1, 1}, {16384, 1}, {1, 333}};
    for (size_t i = 0; i < sizeof shapes / sizeof shapes[0]; i++) {
        struct rng rng = {8};
        struct setup s = look_at(h, &rng, shapes[i][0], shapes[i][1], 1, 60.0, sizes, SIZES, 1);
        struct cloud *cloud = &s.scene.clouds[0];
        for (uint32_t c = 0; c < cloud->chunk_count; c++) { // all about the middle: some point falls into every plane
            cloud->chunks[c].cull = 0;
            for (uint32_t k = 0; k < cloud->chunks[c].count; k++)
                for (int axis = 0; axis < 3; axis++)
                    *points_coordinate(cloud, c, k, axis) *= 0.05f;
        }
        run(h, &s, TOL_UNSURE_HARD);
    }
}

// Reference alone: [K Eq. 2] as it is meant. The nearest of two counts twice what one half of gamma behind it does.
static void sanity(struct harness *h)
{
    const struct merge_args args = {.view = {.width = 8, .height = 8, .footprint = 0.1f}, .gamma = 1.0f};
    struct ref_merged_point points[2] = {{.splat = {.possible = 1, .definite = 1, .x0 = 4, .x1 = 4, .y0 = 4, .y1 = 4},
                                          .place = {1, {4.25, 4.25}, {4.5, 4.5}, {2.0, 2.0}},
                                          .look = {{1.0, 0.0, 0.0}, 1.0}}};
    points[1] = points[0];
    points[1].splat.id = 1;
    points[1].place.x = (struct ref_range){4.75, 4.75};
    points[1].place.z = (struct ref_range){2.5, 2.5};
    points[1].look = (struct ref_look){{0.0, 1.0, 0.0}, 1.0};
    const struct ref_merge both = ref_merge(&args, points, 2, 2.0f, 0, 4, 4);
    HARNESS_CHECK(h,
                  !both.unsure && harness_near(both.color[0], 2.0 / 3.0, 1e-9) && harness_near(both.color[1], 1.0 / 3.0, 1e-9));
    HARNESS_CHECK(h, harness_near(both.place[0], 0.25 + 0.5 / 3.0, 1e-9) && harness_near(both.place[2], 2.0 + 0.5 / 3.0, 1e-9));
    points[1].place.z = (struct ref_range){3.0, 3.0};
    HARNESS_CHECK(h, harness_near(ref_merge(&args, points, 2, 2.0f, 0, 4, 4).place[3], 1.0, 1e-9));
}

static void packed(struct harness *h)
{
    points_packed(h, perspective);
    points_packed(h, orthographic);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"packed positions", packed, 0},
        {"sanity", sanity, 1},
        {"random points, perspective", perspective, 0},
        {"random points, orthographic", orthographic, 0},
        {"gamma of nothing and of anything", gammas, 0},
        {"sums beyond 32 bits", overflow, 0},
        {"weights beyond 32 bits", crowd, 0},
        {"what is sifted out", sifted, 0},
        {"plane sizes", plane_sizes, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
