// SPDX-License-Identifier: GPL-3.0-or-later
// differ: how far scans lie apart, cell by cell, over keys that scatter made: random clouds of several scans, and two planes.
#include "points.h"
#include "shared/points.h"
#include "shared/ranges.h"

#include <math.h>

static const uint32_t sizes[] = {1, 15, 16, 17, 300, 500, 31, 2};
enum { SIZES = sizeof sizes / sizeof sizes[0], WIDTH = 37, HEIGHT = 25, CELLS = WIDTH * HEIGHT };

struct setup {
    struct scene scene;
    struct differ_args args;
    uint16_t *scans;
    float *inclined;
};

static struct setup look_at(struct harness *h, struct rng *rng, int perspective, const uint32_t *counts, uint32_t chunks,
                            uint32_t scans)
{
    const double focal = perspective ? 30.0 : 10.0;
    struct setup s = {.scene = {.view = points_window(WIDTH, HEIGHT, perspective, focal)}};
    const struct camera camera = points_look(rng, &s.scene.view, focal, 4.0);
    struct cloud *cloud = points_add_cloud(h, rng, &s.scene, &camera, counts, chunks, 1, 7000);
    s.args.view = s.scene.view;
    s.args.gamma = 0.6f;
    points_scatter_about(rng, cloud, 1.0);
    s.scans = harness_alloc(h, (size_t)cloud->slots * 2 + 4);
    for (uint32_t i = 0; i < cloud->slots; i++)
        s.scans[i] = (uint16_t)rng_below(rng, scans);
    s.inclined = harness_alloc(h, (size_t)CELLS * 16);
    for (size_t i = 0; i < CELLS; i++) {
        float n[3];
        rng_direction(rng, n);
        n[2] = fabsf(n[2]) + 0.5f;
        const float scale = 1.0f / sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int k = 0; k < 3; k++)
            s.inclined[4 * i + (size_t)k] = n[k] * scale;
        s.inclined[4 * i + 3] = 8.0f;
    }
    return s;
}

struct cells {
    const uint64_t *keys;
    const float *least, *most;
};

static void hold_against(struct harness *h, const struct setup *s, const struct cells *got, const float *least,
                         const float *most, double open)
{
    const struct cloud *cloud = &s->scene.clouds[0];
    struct ref_merged_point *points = harness_alloc(h, cloud->slots * sizeof *points);
    uint16_t *scans = harness_alloc(h, cloud->slots * sizeof *scans);
    uint32_t count = 0;
    size_t unsure = 0, shown = 0;
    for (uint32_t c = 0; c < cloud->chunk_count; c++)
        for (uint32_t i = 0; i < cloud->chunks[c].count; i++, count++) {
            points[count].splat = ref_scatter(&s->scene.view, &cloud->chunks[c], cloud->positions, cloud->surfels, i);
            points[count].place = ref_place(&s->scene.view, &cloud->chunks[c], cloud->positions, i);
            scans[count] = s->scans[cloud->chunks[c].first + i];
        }
    for (size_t p = 0; p < CELLS; p++) {
        const int x = (int)(p % WIDTH), y = (int)(p / WIDTH);
        if (got->keys[p] == REF_EMPTY_KEY)
            continue;
        const struct ref_differ expected = ref_differ(&s->args, points, scans, count, (float)ref_key_z(got->keys[p]),
                                                      ref_key_id(got->keys[p]), s->inclined + 4 * p, x, y);
        const double low = s->args.start ? expected.least : fmin(expected.least, (double)least[p]);
        const double high = s->args.start ? expected.most : fmax(expected.most, (double)most[p]);
        shown++;
        unsure += expected.unsure != 0;
        if (expected.unsure)
            continue;
        if (!harness_near(got->least[p], low, expected.error + TOL_UNIT * fabs(low)) ||
            !harness_near(got->most[p], high, expected.error + TOL_UNIT * fabs(high)))
            harness_fail(h, "differ", x, y, "got %.9g to %.9g, expected %.9g to %.9g +- %.2g", got->least[p], got->most[p], low,
                         high, expected.error);
    }
    harness_note(h, "%zu cells, %zu open", shown, unsure);
    HARNESS_CHECK(h, shown > 0);
    harness_unsure(h, unsure, shown, open);
}

static struct cells run(struct harness *h, struct setup *s, double open)
{
    struct scene *scene = &s->scene;
    struct cloud *cloud = &scene->clouds[0];
    struct rng rng = {99};
    struct cells cells;
    uint64_t *empty = harness_alloc(h, (size_t)CELLS * 8);
    float *low = harness_alloc(h, (size_t)CELLS * 4), *high = harness_alloc(h, (size_t)CELLS * 4);
    for (size_t i = 0; i < CELLS; i++) {
        empty[i] = REF_EMPTY_KEY;
        low[i] = rng_below(&rng, 3) ? (float)rng_range(&rng, -0.2, 0.0) : PT_RANGE_MOST;
        high[i] = low[i] < PT_RANGE_MOST ? low[i] + 0.1f : -PT_RANGE_MOST;
    }
    points_pad(cloud);
    struct pt_buffer *keys = harness_buffer(h, empty, (size_t)CELLS * 8), *least = harness_buffer(h, low, (size_t)CELLS * 4);
    struct pt_buffer *most = harness_buffer(h, high, (size_t)CELLS * 4);
    struct pt_buffer *inclined = harness_buffer(h, s->inclined, (size_t)CELLS * 16);
    struct pt_buffer *chunks = harness_buffer(h, cloud->chunks, cloud->chunk_count * sizeof *cloud->chunks);
    struct pt_buffer *positions = points_positions(h, cloud->chunks, cloud->chunk_count, cloud->positions, cloud->slots);
    struct pt_buffer *surfels = harness_buffer(h, cloud->surfels, 4 * (size_t)cloud->slots);
    struct pt_buffer *scans = harness_buffer(h, s->scans, (size_t)cloud->slots * 2 + 4);
    struct pt_buffer *drawn = s->args.sifted ? harness_buffer(h, scene->drawn, 4 * (size_t)scene->words) : NULL;
    const struct scatter_args scatter = {.view = scene->view, .instances = 1, .sifted = s->args.sifted};
    HARNESS_RUN(h, scatter, &scatter, keys, NULL, drawn, chunks, positions, surfels);
    HARNESS_RUN(h, differ, &s->args, keys, inclined, least, most, chunks, positions, surfels, scans, drawn);
    cells.keys = harness_read(h, keys);
    cells.least = harness_read(h, least);
    cells.most = harness_read(h, most);
    harness_same(h, "least", cells.least, CELLS, 4, 1, WIDTH);
    harness_same(h, "most", cells.most, CELLS, 4, 1, WIDTH);
    if (!s->args.sifted)
        hold_against(h, s, &cells, low, high, open);
    return cells;
}

// Of one scan, of fewer and of more than are counted at a time, and of those whose numbers are shared; first and further ones.
static void random_clouds(struct harness *h, int perspective)
{
    static const uint32_t scans[] = {1, 3, 9, 60000}, firsts[] = {0, 0, 4, 8};
    for (uint32_t k = 0; k < 4; k++) {
        struct rng rng = {31 + k};
        struct setup s = look_at(h, &rng, perspective, sizes, SIZES, scans[k]);
        s.args.first = firsts[k];
        s.args.start = k < 2;
        run(h, &s, 0.05);
    }
}

static void perspective(struct harness *h) { random_clouds(h, 1); }
static void orthographic(struct harness *h) { random_clouds(h, 0); }

static void gammas(struct harness *h)
{
    static const float gammas[][2] = {{PT_RANGE_LEAST, 0.0f}, {PT_RANGE_MOST, 0.0f}, {1e-3f, 2.0f}, {0.05f, 0.0f}};
    for (size_t g = 0; g < sizeof gammas / sizeof gammas[0]; g++) {
        struct rng rng = {50 + g};
        struct setup s = look_at(h, &rng, 1, sizes, SIZES, 4);
        s.args.gamma = gammas[g][0];
        s.args.gamma_cells = gammas[g][1];
        s.args.start = 1;
        run(h, &s, g ? 0.05 : 1.0); // of no depth: whoever lies at the nearest one's
    }
}

// What is sifted out says nothing: every other slot, all that the second scan has.
static void sifted(struct harness *h)
{
    static const uint32_t many[] = {4000, 333};
    struct rng rng = {8};
    struct setup s = look_at(h, &rng, 1, many, 2, 2);
    struct cloud *cloud = &s.scene.clouds[0];
    s.args.sifted = 1;
    s.args.start = 1;
    s.scene.words = cloud->slots / PT_SLOTS_A_WORD + 1;
    s.scene.drawn = harness_alloc(h, 4 * (size_t)s.scene.words);
    for (uint32_t i = 0; i < s.scene.words; i++)
        s.scene.drawn[i] = 0x5555u;
    for (uint32_t c = 0; c < 2; c++)
        cloud->chunks[c].sifted = 1 + cloud->chunks[c].first / PT_SLOTS_A_WORD;
    for (uint32_t i = 0; i < cloud->slots; i++)
        s.scans[i] = (uint16_t)(i % 2);
    const struct cells cells = run(h, &s, 1.0);
    size_t shown = 0;
    for (size_t p = 0; p < CELLS; p++)
        if (cells.keys[p] != REF_EMPTY_KEY) {
            shown++;
            HARNESS_CHECK(h, cells.least[p] == cells.most[p]);
        }
    HARNESS_CHECK(h, shown > 100);
}

// Reference alone: of two scans on parallel planes the distance along the normal is told, however the planes lean.
static void sanity(struct harness *h)
{
    const struct differ_args args = {
        .view = {.width = 8, .height = 8, .footprint = 0.1f, .ray_xs = 0.1f, .ray_ys = 0.1f}, .gamma = 1.0f, .start = 1};
    const float slope = 0.75f, n[4] = {0.6f, 0.0f, 0.8f, 8.0f}; // z falls by 0.75 along x: n . (x, y, -z) stays
    struct ref_merged_point points[4];
    const uint16_t scans[4] = {0, 0, 2, 2};
    for (int i = 0; i < 4; i++) {
        const double x = 4.1 + 0.7 * (i % 2), z = 2.0 + (double)slope * 0.1 * (x - 4.5) + (i / 2 ? 0.25 : 0.0);
        points[i] = (struct ref_merged_point){
            .splat = {.possible = 1, .definite = 1, .x0 = 4, .x1 = 4, .y0 = 4, .y1 = 4, .id = (uint32_t)i},
            .place = {1, {x, x}, {4.5, 4.5}, {z, z}}};
    }
    const float nearest = (float)(points[0].place.z.lo);
    const struct ref_differ both = ref_differ(&args, points, scans, 4, nearest, 0, n, 4, 4);
    HARNESS_CHECK(h, !both.unsure && harness_near(both.most - both.least, 0.8 * 0.25, 1e-6));
    const struct ref_differ one = ref_differ(&args, points, scans, 2, nearest, 0, n, 4, 4);
    HARNESS_CHECK(h, harness_near(one.most - one.least, 0.0, 1e-9));
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
        {"what is sifted out", sifted, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
