// SPDX-License-Identifier: GPL-3.0-or-later
// center: how far the tangent planes of measured points lie behind them in the middle of their pixels.
#include "points.h"
#include "shared/measured.h"
#include "shared/points.h"

#include <math.h>
#include <string.h>

enum { UNTOUCHED = -77 };

static const uint32_t sizes[] = {1, 15, 16, 17, 300, 1000, 31, 2};
enum { SIZES = sizeof sizes / sizeof sizes[0] };

static uint64_t *keys_of(struct harness *h, struct scene *scene, struct pt_buffer **chunks, struct pt_buffer **positions,
                         struct pt_buffer **keys)
{
    struct pt_buffer *buffers[3 + 3 * MOST_INSTANCES];
    const size_t pixels = (size_t)scene->view.width * scene->view.height;
    uint64_t *empty = harness_alloc(h, pixels * 8);
    for (size_t i = 0; i < pixels; i++)
        empty[i] = REF_EMPTY_KEY;
    uint32_t n = 0;
    buffers[n++] = *keys = harness_buffer(h, empty, pixels * 8);
    buffers[n++] = NULL; // limit
    buffers[n++] = NULL; // drawn
    for (uint32_t i = 0; i < scene->count; i++) {
        struct cloud *cloud = &scene->clouds[i];
        points_pad(cloud);
        buffers[n++] = chunks[i] = harness_buffer(h, cloud->chunks, cloud->chunk_count * sizeof *cloud->chunks);
        buffers[n++] = positions[i] = points_positions(h, cloud->chunks, cloud->chunk_count, cloud->positions, cloud->slots);
        buffers[n++] = harness_buffer(h, cloud->surfels, 4 * (size_t)cloud->slots);
    }
    struct scatter_args args = {.view = scene->view, .instances = scene->count};
    harness_run(h, PT_KERNEL_scatter, &args, sizeof args, buffers, n);
    return harness_read(h, *keys);
}

// The point that a key names, and whether it is one of instance i.
static int find_point(const struct cloud *cloud, uint32_t id, uint32_t *chunk, uint32_t *slot)
{
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        const struct chunk_view *view = &cloud->chunks[c];
        *slot = id - view->id_base - view->first;
        if (*slot < view->count) {
            *chunk = c;
            return 1;
        }
    }
    return 0;
}

// Normals of any kind, most towards the viewer; layer distances from tight to wide.
static void random_surfaces(struct harness *h, struct rng *rng, size_t pixels, float **normal, float **deff)
{
    *normal = harness_alloc(h, pixels * 16);
    *deff = harness_alloc(h, pixels * 4);
    for (size_t i = 0; i < pixels; i++) {
        rng_direction(rng, *normal + 4 * i);
        if (rng_below(rng, 12) == 0)
            (*normal)[4 * i + 2] = 0.0f; // across the view
        (*normal)[4 * i + 3] = 1.0f;
        (*deff)[i] = (float)pow(10.0, rng_range(rng, -5.0, 1.0));
    }
}

static void check_scene(struct harness *h, struct rng *rng, struct scene *scene)
{
    struct pt_buffer *chunks[MOST_INSTANCES], *positions[MOST_INSTANCES], *keys_buffer;
    const uint32_t width = scene->view.width;
    const size_t pixels = (size_t)width * scene->view.height;
    const uint64_t *keys = keys_of(h, scene, chunks, positions, &keys_buffer);
    float *normal, *deff, *unset = harness_alloc(h, pixels * 4);
    size_t measured = 0;
    random_surfaces(h, rng, pixels, &normal, &deff);
    for (size_t i = 0; i < pixels; i++)
        unset[i] = UNTOUCHED;
    struct pt_buffer *normal_buffer = harness_buffer(h, normal, pixels * 16),
                     *deff_buffer = harness_buffer(h, deff, pixels * 4);
    struct pt_buffer *offset_buffer = harness_buffer(h, unset, pixels * 4);
    const struct center_args args = {.view = scene->view};
    for (uint32_t i = 0; i + 1 < scene->count || i == 0; i++) // the last of several keeps out
        HARNESS_RUN(h, center, &args, keys_buffer, normal_buffer, deff_buffer, offset_buffer, chunks[i], positions[i]);
    const float *offset = harness_read(h, offset_buffer);
    harness_same(h, "offset", offset, pixels, 4, 1, width);
    for (size_t i = 0; i < pixels; i++) {
        const int x = (int)(i % width), y = (int)(i / width);
        uint32_t c = 0, slot = 0, k = 0;
        int found = 0;
        for (; k < scene->count && keys[i] != REF_EMPTY_KEY && !found; k += !found)
            found = (k + 1 < scene->count || k == 0) && find_point(&scene->clouds[k], ref_key_id(keys[i]), &c, &slot);
        if (!found) {
            if (offset[i] != UNTOUCHED)
                harness_fail(h, "untouched", x, y, "was written: %g", (double)offset[i]);
            continue;
        }
        const struct ref_place place = ref_place(&scene->view, &scene->clouds[k].chunks[c], scene->clouds[k].positions, slot);
        const struct ref_center wanted = ref_center(&scene->view, normal + 4 * i, (double)deff[i], &place, x, y);
        measured++;
        if (!((double)offset[i] >= wanted.low && (double)offset[i] <= wanted.high))
            harness_fail(h, "offset", x, y, "got %.9g, expected %.9g to %.9g", (double)offset[i], wanted.low, wanted.high);
    }
    harness_note(h, "%zu of %zu pixels measured", measured, pixels);
    HARNESS_CHECK(h, measured > 0);
}

static void random_clouds(struct harness *h, int perspective, uint32_t seed)
{
    struct rng rng = {seed};
    struct scene scene = {.view = points_window(67, 45, perspective, perspective ? 60.0 : 20.0)};
    for (uint32_t i = 0; i < 3; i++) {
        struct camera camera = points_look(&rng, &scene.view, 1.0 / (double)scene.view.ray_xs, 4.0);
        points_scatter_about(&rng, points_add_cloud(h, &rng, &scene, &camera, sizes, SIZES, i == 1, i * 5000),
                             i == 0 ? 1.0 : 3.0);
    }
    check_scene(h, &rng, &scene);
}

static void perspective(struct harness *h) { random_clouds(h, 1, 21); }
static void orthographic(struct harness *h) { random_clouds(h, 0, 22); }

static void crowded(struct harness *h)
{
    for (int p = 0; p < 2; p++) {
        struct rng rng = {23};
        struct scene scene = {.view = points_window(5, 3, p, 6.0)};
        struct camera camera = points_look(&rng, &scene.view, 1.0 / (double)scene.view.ray_xs, 4.0);
        points_scatter_about(&rng, points_add_cloud(h, &rng, &scene, &camera, sizes, SIZES, 0, 7), 1.0);
        check_scene(h, &rng, &scene);
    }
}

// Reference alone: a plane of slope 1 seen straight on, a point a quarter of a pixel left of the middle.
static void sanity(struct harness *h)
{
    const struct view_args view = {.width = 1, .height = 1, .ray_xs = 2.0f, .ray_ys = 2.0f, .footprint = 2.0f};
    const float normal[3] = {-(float)sqrt(0.5), 0.0f, (float)sqrt(0.5)};
    struct ref_place place = {.known = 1, .x = {0.25, 0.25}, .y = {0.5, 0.5}, .z = {8.0, 8.0}};
    struct ref_center out = ref_center(&view, normal, 4.0, &place, 0, 0);
    HARNESS_CHECK(h, fabs(out.low + 0.5) < 1e-5 && fabs(out.high + 0.5) < 1e-5); // it rises towards the viewer
    out = ref_center(&view, normal, 0.125, &place, 0, 0);
    HARNESS_CHECK(h, fabs(out.low + 0.125) < 1e-5 && fabs(out.high + 0.125) < 1e-5);
}

static void packed(struct harness *h)
{
    points_packed(h, perspective);
    points_packed(h, orthographic);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"packed positions", packed, 0},     {"sanity", sanity, 1},
        {"perspective", perspective, 0},     {"orthographic", orthographic, 0},
        {"many points a pixel", crowded, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
