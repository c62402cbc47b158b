// SPDX-License-Identifier: GPL-3.0-or-later
// splat: the least key of every pixel, where the reference says which discs may and which must cover it.
#include "discs.h"
#include "shared/points.h"

#include <math.h>

static const uint32_t sizes[] = {1, 15, 16, 17, 300, 500, 31, 2};
enum { SIZES = sizeof sizes / sizeof sizes[0] };

static uint64_t *check_scene(struct harness *h, struct disc_scene *scene)
{
    const struct view_args *view = &scene->points.view;
    const uint32_t width = view->width;
    const size_t pixels = (size_t)width * view->height;
    uint64_t *keys = harness_read(h, discs_splat(h, scene));
    harness_same(h, "keys", keys, pixels, 8, 1, width);
    if (harness_settled(h))
        return keys;
    uint32_t count;
    const struct ref_disc *discs = discs_reference(h, scene, &count);
    size_t covered = 0;
    struct around around = {.strip = -1};
    for (size_t p = 0; p < pixels; p++) {
        const int x = (int)(p % width), y = (int)(p / width);
        const double z = ref_key_z(keys[p]);
        double farthest = INFINITY;
        discs_around(h, &around, view, discs, count, x, y);
        for (uint32_t k = 0; k < around.count; k++) {
            const uint32_t i = around.places[k];
            if (!discs[i].definite)
                continue;
            const struct ref_met cover = ref_disc_at(view, &discs[i], x, y);
            if (cover.covered == REF_YES && !(scene->points.limit && !(cover.z.lo > scene->points.limit[p])))
                farthest = fmin(farthest, cover.z.hi);
        }
        covered += keys[p] != REF_EMPTY_KEY;
        if (z > farthest)
            harness_fail(h, "keys", x, y, "got z %.9g id %u, expected at most z %.9g", z, ref_key_id(keys[p]), farthest);
        if (keys[p] == REF_EMPTY_KEY)
            continue;
        if (scene->points.limit && !(z > scene->points.limit[p]))
            harness_fail(h, "keys", x, y, "got z %.9g, which is not beyond the limit %.9g", z, scene->points.limit[p]);
        const struct ref_disc *disc = discs_find(discs, count, ref_key_id(keys[p]));
        if (!disc || !disc->possible) {
            harness_fail(h, "keys", x, y, "got id %u, which no drawn point has", ref_key_id(keys[p]));
            continue;
        }
        const struct ref_met cover = ref_disc_at(view, disc, x, y);
        if (cover.covered == REF_NO)
            harness_fail(h, "keys", x, y, "got id %u, whose disc is not there", disc->id);
        else if (!(z >= cover.z.lo && z <= cover.z.hi))
            harness_fail(h, "keys", x, y, "got id %u at z %.9g, expected %.9g to %.9g", disc->id, z, cover.z.lo, cover.z.hi);
    }
    harness_note(h, "%u discs, %zu of %zu pixels covered", count, covered, pixels);
    return keys;
}

static void random_discs(struct harness *h, int perspective, uint32_t seed, double largest, float radius)
{
    struct rng rng = {seed};
    const double focal = perspective ? 60.0 : 20.0;
    struct disc_scene scene = {.points = {.view = discs_window(67, 45, perspective, focal)}};
    for (uint32_t i = 0; i < 3; i++) {
        struct camera camera = points_look(&rng, &scene.points.view, focal, 4.0);
        for (int k = 0; k < 9; k++) // the second is mirrored
            camera.rotation[k] *= i == 1 ? -1.0 : 1.0;
        points_scatter_about(&rng, points_add_cloud(h, &rng, &scene.points, &camera, sizes, SIZES, i == 1, i * 5000),
                             i == 0 ? 1.0 : 3.0);
        discs_describe(h, &rng, &scene, i, &camera, i == 1 ? radius : 0.0f, largest, i != 2);
    }
    scene.discs[0].has_radii = 0; // by their spacing
    check_scene(h, &scene);
}

static void perspective(struct harness *h) { random_discs(h, 1, 1, 0.3, 0.1f); }

static void orthographic(struct harness *h) { random_discs(h, 0, 2, 0.3, 0.1f); }

// Ellipses: as they are, mirrored and cut off, of an object that is stretched.
static void ellipses(struct harness *h)
{
    static const double stretch[3] = {0.3, 1.0, 2.5};
    for (int p = 0; p < 2; p++)
        for (uint32_t seed = 0; seed < 3; seed++) {
            struct rng rng = {13 + seed};
            const double focal = p ? 60.0 : 20.0;
            struct disc_scene scene = {.points = {.view = discs_window(67, 45, p, focal)}};
            for (uint32_t i = 0; i < 3; i++) {
                struct camera camera = points_look(&rng, &scene.points.view, focal, 4.0), seen;
                for (int k = 0; k < 9; k++)
                    camera.rotation[k] *= i == 1 ? -1.0 : 1.0;
                seen = camera;
                for (int k = 0; k < 9 && i == 2; k++)
                    seen.rotation[k] *= stretch[k % 3];
                points_scatter_about(&rng, points_add_cloud(h, &rng, &scene.points, &seen, sizes, SIZES, 0, i * 5000),
                                     i == 0 ? 1.0 : 2.0);
                discs_describe(h, &rng, &scene, i, &camera, 0.0f, seed == 2 ? 3.0 : 0.5, 1);
                discs_shape(h, &rng, &scene, i, &camera, i == 2 ? stretch : NULL);
                scene.discs[i].radius_most = i == 1 ? 0.15f : 0.0f;
                scene.discs[i].surface_scale = i == 2 ? 1.0f : 1.45f;
            }
            check_scene(h, &scene);
        }
}

// Words without a class, without normals, beside a radius that all points have; and clouds whose normals are not known.
static void shapes_of_none(struct harness *h)
{
    for (uint32_t way = 0; way < 3; way++) {
        struct rng rng = {16 + way};
        struct disc_scene scene = {.points = {.view = discs_window(67, 45, 1, 60.0)}};
        struct camera camera = points_look(&rng, &scene.points.view, 60.0, 4.0);
        struct cloud *cloud = points_add_cloud(h, &rng, &scene.points, &camera, sizes, SIZES, 0, 0);
        points_scatter_about(&rng, cloud, 1.0);
        discs_describe(h, &rng, &scene, 0, &camera, 0.0f, 0.3, way != 1);
        discs_shape(h, &rng, &scene, 0, &camera, NULL);
        uint32_t *words = scene.radii[0];
        for (uint32_t i = 0; i < cloud->slots && way == 0; i++)
            words[i] &= ~PT_SHAPE_CLASS_BITS;
        scene.discs[0].radius = way == 2 ? 0.1f : 0.0f;
        check_scene(h, &scene);
    }
}

static void small_and_huge(struct harness *h)
{
    static const double largest[] = {1e-3, 5.0, 1e20};
    static const float radius[] = {1e-20f, 100.0f, 3e38f};
    for (int i = 0; i < 3; i++)
        for (int p = 0; p < 2; p++)
            random_discs(h, p, 3 + (uint32_t)i, largest[i], radius[i]);
}

// Discs of no radius are points: the keys are those of scatter, to the bit.
static void points(struct harness *h)
{
    for (int p = 0; p < 2; p++) {
        struct rng rng = {5};
        struct disc_scene scene = {.points = {.view = discs_window(67, 45, p, p ? 60.0 : 20.0)}};
        struct camera camera = points_look(&rng, &scene.points.view, p ? 60.0 : 20.0, 4.0);
        struct cloud *cloud = points_add_cloud(h, &rng, &scene.points, &camera, sizes, SIZES, 1, 0);
        points_scatter_about(&rng, cloud, 2.0);
        discs_describe(h, &rng, &scene, 0, &camera, 0.0f, 0.0, 1);
        const uint64_t *keys = check_scene(h, &scene);
        const size_t pixels = (size_t)67 * 45;
        uint64_t *empty = harness_alloc(h, pixels * 8);
        for (size_t i = 0; i < pixels; i++)
            empty[i] = REF_EMPTY_KEY;
        struct pt_buffer *plane = harness_buffer(h, empty, pixels * 8);
        const struct scatter_args args = {.view = scene.points.view, .instances = 1};
        HARNESS_RUN(h, scatter, &args, plane, NULL, NULL,
                    harness_buffer(h, cloud->chunks, cloud->chunk_count * sizeof *cloud->chunks),
                    points_positions(h, cloud->chunks, cloud->chunk_count, cloud->positions, cloud->slots),
                    harness_buffer(h, cloud->surfels, 4 * (size_t)cloud->slots));
        const uint64_t *scattered = harness_read(h, plane);
        for (size_t i = 0; i < pixels; i++)
            if (keys[i] != scattered[i])
                harness_fail(h, "points", (int)(i % 67), (int)(i / 67), "got %016llx, scatter %016llx",
                             (unsigned long long)keys[i], (unsigned long long)scattered[i]);
    }
}

static void plane_sizes(struct harness *h)
{
    static const uint32_t shapes[][2] = {{1, 1}, {16384, 1}, {1, 333}, {64, 64}, {17, 2}};
    struct rng rng = {6};
    for (size_t i = 0; i < sizeof shapes / sizeof shapes[0]; i++) {
        struct disc_scene scene = discs_in_window(h, &rng, shapes[i][0], shapes[i][1], 0.1);
        check_scene(h, &scene);
    }
}

// Numbers that are none, in positions and radii.
static void not_numbers(struct harness *h)
{
    static const float odd[] = {NAN, INFINITY, -INFINITY, 3e38f, -3e38f, 1e-40f, -0.0f, 0x1p31f, -0x1p31f, 0x1p32f};
    enum { ODD = sizeof odd / sizeof odd[0] };
    for (int p = 0; p < 2; p++) {
        struct rng rng = {7};
        struct disc_scene scene = {.points = {.view = discs_window(67, 45, p, p ? 60.0 : 20.0)}};
        struct camera camera = points_look(&rng, &scene.points.view, p ? 60.0 : 20.0, 4.0);
        struct cloud *cloud = points_add_cloud(h, &rng, &scene.points, &camera, sizes, SIZES, 1, 0);
        points_scatter_about(&rng, cloud, 1.0);
        for (uint32_t i = 0; i < 500; i += 2)
            *points_coordinate(cloud, 5, i, (int)rng_below(&rng, 3)) = odd[rng_below(&rng, ODD)];
        discs_describe(h, &rng, &scene, 0, &camera, 0.0f, 0.2, 1);
        check_scene(h, &scene);
    }
}

// Points at and around the camera's plane, with discs that reach through it.
static void camera_plane(struct harness *h)
{
    struct rng rng = {8};
    struct disc_scene scene = {.points = {.view = discs_window(67, 45, 1, 60.0)}};
    struct camera camera = points_look(&rng, &scene.points.view, 60.0, 0.0); // in the middle of the cloud
    points_scatter_about(&rng, points_add_cloud(h, &rng, &scene.points, &camera, sizes, SIZES, 0, 0), 1.0);
    discs_describe(h, &rng, &scene, 0, &camera, 0.0f, 0.6, 1);
    check_scene(h, &scene);
}

// Nothing of them is seen.
static void beside_the_camera(struct harness *h)
{
    struct rng rng = {18};
    for (int own = 0; own < 2; own++) {
        struct disc_scene scene = {.points = {.view = discs_window(160, 120, 1, 130.0)}};
        discs_beside(h, &rng, &scene, 130.0, own ? 0.0f : 0.25f);
        const uint64_t *keys = check_scene(h, &scene);
        for (size_t i = 0; i < (size_t)160 * 120; i++)
            if (keys[i] != REF_EMPTY_KEY)
                harness_fail(h, "keys", (int)(i % 160), (int)(i / 160), "shows a disc that lies beside the view");
    }
}

// Discs of 1 to 3000 pixels, as wide as no loop of a driver is long: the same keys everywhere, and of each its very middle and
// pixels at its rim.
static void large(struct harness *h)
{
    enum { WIDTH = 1500, HEIGHT = 1100, DISCS = 24 };
    static const uint32_t many[] = {DISCS};
    for (int p = 0; p < 2; p++) {
        struct rng rng = {19};
        struct disc_scene scene = {.points = {.view = discs_window(WIDTH, HEIGHT, p, 1000.0)}};
        struct camera camera = {.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .focal = 1000.0};
        camera.center_x = scene.points.view.origin_x + 0.5 * WIDTH;
        camera.center_y = scene.points.view.origin_y + 0.5 * HEIGHT;
        struct cloud *cloud = points_add_cloud(h, &rng, &scene.points, &camera, many, 1, 0, 0);
        for (uint32_t i = 0; i < DISCS; i++) {
            *points_coordinate(cloud, 0, i, 0) = (float)rng_range(&rng, -0.8, 0.8);
            *points_coordinate(cloud, 0, i, 1) = (float)rng_range(&rng, -0.5, 0.5);
            *points_coordinate(cloud, 0, i, 2) = -1.0f - (float)i;
            cloud->surfels[i] = (4095u + rng_below(&rng, 1500)) | (4095u - rng_below(&rng, 1500)) << 13;
        }
        discs_describe(h, &rng, &scene, 0, &camera, 0.0f, 0.0, 1);
        for (uint32_t i = 0; i < DISCS; i++) // the nearer, the smaller
            ((float *)scene.radii[0])[i] = (float)(5e-4 * pow(3000.0, i / (DISCS - 1.0)) * (p ? 1.0 + i : 1.0));
        const uint64_t *keys = harness_read(h, discs_splat(h, &scene));
        harness_same(h, "keys", keys, (size_t)WIDTH * HEIGHT, 8, 1, WIDTH);
        if (harness_settled(h))
            continue;
        uint32_t count;
        const struct ref_disc *discs = discs_reference(h, &scene, &count);
        for (uint32_t k = 0; k < 20000; k++) {
            const int x = (int)rng_below(&rng, WIDTH), y = (int)rng_below(&rng, HEIGHT);
            const uint64_t key = keys[(size_t)y * WIDTH + (size_t)x];
            double farthest = INFINITY;
            for (uint32_t i = 0; i < count; i++) {
                const struct ref_met cover = ref_disc_at(&scene.points.view, &discs[i], x, y);
                if (cover.covered == REF_YES)
                    farthest = fmin(farthest, cover.z.hi);
            }
            if (ref_key_z(key) > farthest)
                harness_fail(h, "keys", x, y, "got z %.9g, expected at most %.9g", ref_key_z(key), farthest);
            const struct ref_disc *disc = discs_find(discs, count, ref_key_id(key));
            if (key != REF_EMPTY_KEY && (!disc || ref_disc_at(&scene.points.view, disc, x, y).covered == REF_NO))
                harness_fail(h, "keys", x, y, "got id %u, whose disc is not there", ref_key_id(key));
        }
    }
}

// One place, many discs: the least id wins where all have one normal, whichever thread, tile or lane.
static void coincident(struct harness *h)
{
    for (int p = 0; p < 2; p++) {
        struct rng rng = {9};
        struct disc_scene scene = {.points = {.view = discs_window(67, 45, p, 60.0)}};
        struct camera camera = points_look(&rng, &scene.points.view, 60.0, 4.0);
        const uint32_t bases[3] = {0xFFFFFFFEu - 944u, 70000u, 0x80000000u};
        for (uint32_t i = 0; i < 3; i++) {
            struct cloud *cloud = points_add_cloud(h, &rng, &scene.points, &camera, sizes, SIZES, 0, bases[i]);
            for (uint32_t k = 0; k < cloud->slots; k++)
                cloud->surfels[k] = 5000u | 3000u << 13;
            discs_describe(h, &rng, &scene, i, &camera, 0.8f, 0.0, 1);
        }
        const uint64_t *keys = check_scene(h, &scene);
        size_t found = 0;
        for (size_t i = 0; i < (size_t)67 * 45; i++) {
            found += keys[i] != REF_EMPTY_KEY;
            if (keys[i] != REF_EMPTY_KEY && ref_key_id(keys[i]) != 70000u)
                harness_fail(h, "keys", (int)(i % 67), (int)(i / 67), "got id %u, expected 70000", ref_key_id(keys[i]));
        }
        HARNESS_CHECK(h, found > 50);
    }
}

// Every disc seen from its edge, to the bit and nearly: its own pixel is there all the same.
static void edge_on(struct harness *h)
{
    static const uint32_t six[] = {6};
    static const double lean[6] = {0.0, 1e-7, 1e-6, 1e-4, 1e-2, 0.1};
    struct rng rng = {10};
    for (int p = 0; p < 2; p++) {
        struct disc_scene scene = {.points = {.view = discs_window(48, 6, p, 10.0)}};
        scene.points.view.origin_x = scene.points.view.origin_y = 0;
        scene.points.view.ray_x0 = scene.points.view.ray_y0 = 0.0f;
        struct camera camera = {.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .focal = 10.0};
        struct cloud *cloud = points_add_cloud(h, &rng, &scene.points, &camera, six, 1, 0, 0);
        for (uint32_t i = 0; i < 6; i++) {
            *points_coordinate(cloud, 0, i, 0) = p ? 0.0f : (float)(0.8 * i + 0.45);
            *points_coordinate(cloud, 0, i, 1) = (float)(0.1 * i + 0.05);
            *points_coordinate(cloud, 0, i, 2) = -1.0f;
            cloud->surfels[i] = 8190u | (4095u + (uint32_t)(lean[i] * 4095.0)) << 13;
        }
        discs_describe(h, &rng, &scene, 0, &camera, 0.2f, 0.0, 1);
        const uint64_t *keys = check_scene(h, &scene);
        for (uint32_t i = 0; i < 6; i++) {
            const size_t pixel = (size_t)i * 48 + (p ? 0 : 8 * i + 4);
            if (keys[pixel] == REF_EMPTY_KEY)
                harness_fail(h, "own pixel", (int)(pixel % 48), (int)(pixel / 48), "is empty");
        }
    }
}

static void limits(struct harness *h)
{
    struct rng rng = {11};
    struct disc_scene scene = {.points = {.view = discs_window(67, 45, 1, 60.0)}};
    for (uint32_t i = 0; i < 2; i++) {
        struct camera camera = points_look(&rng, &scene.points.view, 60.0, 4.0);
        points_scatter_about(&rng, points_add_cloud(h, &rng, &scene.points, &camera, sizes, SIZES, 0, i * 5000), 2.0);
        discs_describe(h, &rng, &scene, i, &camera, 0.0f, 0.3, 1);
    }
    const size_t pixels = (size_t)67 * 45;
    const uint64_t *front = check_scene(h, &scene);
    float *limit = harness_alloc(h, pixels * 4);
    scene.points.limit = limit;
    for (int way = 0; way < 3; way++) {
        for (size_t i = 0; i < pixels; i++) {
            const float z = front[i] == REF_EMPTY_KEY ? 4.0f : (float)ref_key_z(front[i]);
            const float ways[3] = {(float)rng_range(&rng, 0.0, 6.0), float_step(z, -1), INFINITY};
            limit[i] = ways[way];
        }
        const uint64_t *keys = check_scene(h, &scene);
        for (size_t i = 0; i < pixels; i++)
            if ((way == 1 && front[i] != REF_EMPTY_KEY && keys[i] != front[i]) || (way == 2 && keys[i] != REF_EMPTY_KEY))
                harness_fail(h, way == 1 ? "an ulp before" : "finished", (int)(i % 67), (int)(i / 67), "shows another disc");
    }
}

static void orthographic_scales(struct harness *h)
{
    static const double scales[] = {1e-6, 1e6};
    for (int i = 0; i < 2; i++) {
        struct rng rng = {12};
        const double focal = 67.0 / scales[i];
        struct disc_scene scene = {.points = {.view = discs_window(67, 45, 0, focal)}};
        scene.points.view.z_far = (float)(200.0 * scales[i]); // near = -far = -100 scales
        struct camera camera = points_look(&rng, &scene.points.view, focal, 0.0);
        camera.near_clip = -100.0 * scales[i];
        camera.shift[0] = camera.shift[1] = 0.0;
        points_scatter_about(&rng, points_add_cloud(h, &rng, &scene.points, &camera, sizes, SIZES, 1, 0), 0.6 * scales[i]);
        discs_describe(h, &rng, &scene, 0, &camera, 0.0f, 0.05 * scales[i], 1);
        check_scene(h, &scene);
    }
}

static void nothing(struct harness *h)
{
    struct disc_scene scene = {.points = {.view = discs_window(67, 45, 1, 60.0)}};
    const uint64_t *keys = harness_read(h, discs_splat(h, &scene));
    for (size_t i = 0; i < (size_t)67 * 45; i++)
        HARNESS_CHECK(h, keys[i] == REF_EMPTY_KEY);
}

// Reference alone: a disc that faces the view is a circle, and flatter the more it leans.
static void sanity(struct harness *h)
{
    const struct view_args view = discs_window(64, 64, 0, 10.0);
    const struct chunk_view chunk = {.row = {10, 0, 0, 0, 10, 0, 0, 0, -1}, .hi = {48.5f, 40.5f, 0}, .count = 1, .padded = 1};
    const float p[3] = {0.0f, 0.0f, -2.0f};
    struct disc_args args = {.instance = {.has_normals = 1, .normal_matrix = {1, 0, 0, 0, 1, 0, 0, 0, 1}}, .radius = 1.0f};
    const uint32_t straight = 4095u | 4095u << 13, leaning = 6142u | 4095u << 13; // (1/2, 0, 1/2): 45 degrees
    for (int lean = 0; lean < 2; lean++) {
        const struct ref_disc disc = ref_disc(&view, &args, &chunk, p, lean ? &leaning : &straight, NULL, 0);
        int across = 0, up = 0;
        for (int i = 0; i < 64; i++) {
            across += ref_disc_at(&view, &disc, i, 32).covered == REF_YES;
            up += ref_disc_at(&view, &disc, 32, i).covered == REF_YES;
        }
        HARNESS_CHECK(h, disc.possible && disc.definite);
        HARNESS_CHECK(h, up >= 19 && up <= 21 && across == (lean ? 15 : up));
        const struct ref_met beside = ref_disc_at(&view, &disc, 35, 32);
        HARNESS_CHECK(h, harness_near(0.5 * (beside.z.lo + beside.z.hi), lean ? 2.3 : 2.0, 1e-3));
    }
}

static void packed(struct harness *h)
{
    points_packed(h, perspective);
    points_packed(h, orthographic);
    points_packed(h, large);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"packed positions", packed, 0},
        {"sanity", sanity, 1},
        {"random discs, perspective", perspective, 0},
        {"random discs, orthographic", orthographic, 0},
        {"ellipses", ellipses, 0},
        {"shapes of points that are none", shapes_of_none, 0},
        {"discs under a pixel and over the whole view", small_and_huge, 0},
        {"no radius: as scatter", points, 0},
        {"plane sizes", plane_sizes, 0},
        {"NaN, Inf and huge positions", not_numbers, 0},
        {"discs through the camera plane", camera_plane, 0},
        {"discs beside the camera, before its plane", beside_the_camera, 0},
        {"discs of 1 to 3000 pixels", large, 0},
        {"coincident discs, ids near 2^32 - 2", coincident, 0},
        {"seen from their edge", edge_on, 0},
        {"behind a layer", limits, 0},
        {"orthographic scales 1e-6 and 1e6, near = -far", orthographic_scales, 0},
        {"nothing to draw", nothing, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
