// SPDX-License-Identifier: GPL-3.0-or-later
// scatter: the least key of every pixel, where the reference says which points may and which must be there.
#include "points.h"
#include "hidden.h"
#include "shared/points.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint64_t *run_scatter(struct harness *h, struct scene *scene)
{
    struct pt_buffer *buffers[3 + 4 * MOST_INSTANCES];
    size_t pixels = (size_t)scene->view.width * scene->view.height;
    uint64_t *empty = harness_alloc(h, pixels * 8);
    for (size_t i = 0; i < pixels; i++)
        empty[i] = REF_EMPTY_KEY;
    uint32_t n = 0;
    buffers[n++] = harness_buffer(h, empty, pixels * 8);
    buffers[n++] = scene->limit ? harness_buffer(h, scene->limit, pixels * 4) : NULL;
    buffers[n++] = scene->drawn ? harness_buffer(h, scene->drawn, 4 * (size_t)scene->words) : NULL;
    for (uint32_t i = 0; i < scene->count; i++) {
        struct cloud *cloud = &scene->clouds[i];
        points_pad(cloud);
        buffers[n++] = harness_buffer(h, cloud->chunks, cloud->chunk_count * sizeof *cloud->chunks);
        buffers[n++] = points_positions(h, cloud->chunks, cloud->chunk_count, cloud->positions, cloud->slots);
        buffers[n++] = harness_buffer(h, cloud->surfels, 4 * (size_t)cloud->slots);
    }
    struct scatter_args args = {.view = scene->view, .instances = scene->count, .behind = scene->limit != NULL};
    args.sifted = scene->drawn != NULL;
    harness_run(h, PT_KERNEL_scatter, &args, sizeof args, buffers, n);
    uint64_t *keys = harness_read(h, buffers[0]);
    harness_same(h, "keys", keys, pixels, 8, 1, scene->view.width);
    return keys;
}

static int by_id(const void *a, const void *b)
{
    const struct ref_splat *x = a, *y = b;
    return x->id < y->id ? -1 : x->id > y->id;
}

// Runs the scene and holds every pixel against the points that may, and those that must, be there.
static uint64_t *check_scene(struct harness *h, struct scene *scene)
{
    uint64_t *keys = run_scatter(h, scene);
    if (harness_settled(h))
        return keys;
    uint32_t width = scene->view.width, total = 0, n = 0, open = 0;
    size_t pixels = (size_t)width * scene->view.height, covered = 0;
    for (uint32_t i = 0; i < scene->count; i++)
        total += scene->clouds[i].slots;
    struct ref_splat *splats = harness_alloc(h, (total + 1) * sizeof *splats);
    double *farthest = harness_alloc(h, pixels * sizeof *farthest); // no result may lie behind this
    for (size_t i = 0; i < pixels; i++)
        farthest[i] = INFINITY;
    for (uint32_t i = 0; i < scene->count; i++) {
        const struct cloud *cloud = &scene->clouds[i];
        for (uint32_t c = 0; c < cloud->chunk_count; c++)
            for (uint32_t s = 0; s < cloud->chunks[c].count; s++) {
                splats[n] = ref_scatter(&scene->view, &cloud->chunks[c], cloud->positions, cloud->surfels, s);
                const uint32_t word = cloud->chunks[c].sifted;
                if (word && !(scene->drawn[word - 1 + s / PT_SLOTS_A_WORD] >> s % PT_SLOTS_A_WORD & 1u))
                    splats[n].possible = 0;
                n++;
            }
    }
    for (uint32_t i = 0; i < n; i++) {
        open += splats[i].possible && !splats[i].definite;
        if (splats[i].possible && splats[i].definite) {
            size_t pixel = (size_t)splats[i].y0 * width + (size_t)splats[i].x0;
            double *at = &farthest[pixel];
            if (scene->limit && !(splats[i].z.lo > scene->limit[pixel])) // may be refused
                continue;
            *at = fmin(*at, splats[i].z.hi);
        }
    }
    qsort(splats, n, sizeof *splats, by_id);
    for (size_t i = 0; i < pixels; i++) {
        int x = (int)(i % width), y = (int)(i / width);
        double z = ref_key_z(keys[i]);
        covered += keys[i] != REF_EMPTY_KEY;
        if (z > farthest[i])
            harness_fail(h, "keys", x, y, "got z %.9g id %u, expected at most z %.9g", z, ref_key_id(keys[i]), farthest[i]);
        if (keys[i] == REF_EMPTY_KEY)
            continue;
        if (scene->limit && !(z > scene->limit[i]))
            harness_fail(h, "keys", x, y, "got z %.9g, which is not beyond the limit %.9g", z, scene->limit[i]);
        struct ref_splat wanted = {.id = ref_key_id(keys[i])};
        const struct ref_splat *splat = bsearch(&wanted, splats, n, sizeof *splats, by_id);
        if (!splat)
            harness_fail(h, "keys", x, y, "got id %u, which no point has", wanted.id);
        else if (!splat->possible || x < splat->x0 || x > splat->x1 || y < splat->y0 || y > splat->y1)
            harness_fail(h, "keys", x, y, "got id %u, expected it at (%d..%d, %d..%d), possible %d", wanted.id, splat->x0,
                         splat->x1, splat->y0, splat->y1, splat->possible);
        else if (!(z >= splat->z.lo && z <= splat->z.hi))
            harness_fail(h, "keys", x, y, "got id %u at z %.9g, expected %.9g to %.9g", wanted.id, z, splat->z.lo, splat->z.hi);
    }
    if (n > 1000 && open > 0.05 * n)
        harness_fail(h, "reference", 0, 0, "leaves %u of %u points open", open, n);
    harness_note(h, "%u points, %u open, %zu of %zu pixels covered", n, open, covered, pixels);
    return keys;
}

static const uint32_t sizes[] = {1, 15, 16, 17, 300, 1000, 31, 2};
enum { SIZES = sizeof sizes / sizeof sizes[0] };

static void random_clouds(struct harness *h, int perspective, uint32_t seed)
{
    struct rng rng = {seed};
    struct scene scene = {.view = points_window(67, 45, perspective, perspective ? 60.0 : 20.0)};
    for (uint32_t i = 0; i < 3; i++) {
        struct camera camera = points_look(&rng, &scene.view, 1.0 / scene.view.ray_xs, 4.0);
        // The second is mirrored, the third squeezed.
        for (int k = 0; k < 9; k++)
            camera.rotation[k] *= i == 1 ? -1.0 : i == 2 && k % 3 == 0 ? 0.05 : 1.0;
        points_scatter_about(&rng, points_add_cloud(h, &rng, &scene, &camera, sizes, SIZES, i != 1, i * 5000),
                             i == 0 ? 1.0 : 5.0);
    }
    check_scene(h, &scene);
}

// Some chunks sifted: half of their points, all, none; with a limit and without.
static void sifted(struct harness *h)
{
    for (uint32_t i = 0; i < 4; i++) {
        struct rng rng = {40 + i};
        struct scene scene = {.view = points_window(67, 45, i % 2 != 0, i % 2 ? 60.0 : 20.0)};
        for (uint32_t k = 0; k < 2; k++) {
            struct camera camera = points_look(&rng, &scene.view, 1.0 / scene.view.ray_xs, 4.0);
            points_scatter_about(&rng, points_add_cloud(h, &rng, &scene, &camera, sizes, SIZES, k != 0, k * 5000), 1.0);
            for (uint32_t c = k; c < SIZES; c += 2) {
                scene.clouds[k].chunks[c].sifted = 1 + scene.words;
                scene.words += scene.clouds[k].chunks[c].padded / PT_SLOTS_A_WORD;
            }
        }
        scene.drawn = harness_alloc(h, 4 * (size_t)scene.words);
        for (uint32_t k = 0; k < scene.words; k++)
            scene.drawn[k] = k % 5 ? (uint32_t)rng_next(&rng) & 0xFFFFu : k % 2 ? 0xFFFFu : 0;
        for (uint32_t k = 0; k < 2 * SIZES; k++) { // padding is drawn as the point that it repeats
            const struct chunk_view *chunk = &scene.clouds[k / SIZES].chunks[k % SIZES];
            uint32_t last = (chunk->count - 1) % PT_SLOTS_A_WORD,
                     *word = scene.drawn + chunk->sifted + (chunk->padded / PT_SLOTS_A_WORD) - 2;
            if (chunk->sifted)
                *word = (*word & ((2u << last) - 1u)) | (*word >> last & 1u ? 0xFFFFu << last & 0xFFFFu : 0u);
        }
        float *limit = harness_alloc(h, (size_t)scene.view.width * scene.view.height * 4);
        for (uint32_t k = 0; k < scene.view.width * scene.view.height; k++)
            limit[k] = 3.9f;
        scene.limit = i > 1 ? limit : NULL;
        check_scene(h, &scene);
    }
}

static void perspective(struct harness *h) { random_clouds(h, 1, 1); }

static void orthographic(struct harness *h) { random_clouds(h, 0, 2); }

static void plane_sizes(struct harness *h)
{
    static const uint32_t shapes[][2] = {{1, 1}, {16384, 1}, {1, 333}, {64, 64}, {17, 2}};
    struct rng rng = {3};
    for (size_t i = 0; i < sizeof shapes / sizeof shapes[0]; i++) {
        double focal = shapes[i][0];
        struct scene scene = {.view = points_window(shapes[i][0], shapes[i][1], 1, focal)};
        struct camera camera = points_look(&rng, &scene.view, focal, 3.0);
        for (int k = 0; k < 6; k++) // squeezed into the window's shape
            camera.rotation[k] *= k < 3 ? 1.0 : (double)shapes[i][1] / shapes[i][0];
        camera.shift[0] = camera.shift[1] = 0.0;
        points_scatter_about(&rng, points_add_cloud(h, &rng, &scene, &camera, sizes, SIZES, 0, 0), 1.5);
        check_scene(h, &scene);
    }
}

// Guard bands reach to the left of and below the picture.
static void negative_origin(struct harness *h)
{
    for (int p = 0; p < 2; p++) {
        struct rng rng = {4};
        struct scene scene = {.view = points_window(67, 45, p, p ? 60.0 : 20.0)};
        scene.view.origin_x = scene.view.origin_y = -32;
        struct camera camera = points_look(&rng, &scene.view, p ? 60.0 : 20.0, 4.0);
        points_scatter_about(&rng, points_add_cloud(h, &rng, &scene, &camera, sizes, SIZES, 0, 0), 2.0);
        check_scene(h, &scene);
    }
}

static void not_numbers(struct harness *h)
{
    static const float odd[] = {NAN, INFINITY, -INFINITY, 3e38f, -3e38f, 1e-40f, -0.0f, 0x1p31f, -0x1p31f, 0x1p32f};
    enum { ODD = sizeof odd / sizeof odd[0] };
    for (int p = 0; p < 2; p++) {
        struct rng rng = {5};
        struct scene scene = {.view = points_window(67, 45, p, p ? 60.0 : 20.0)};
        struct camera camera = points_look(&rng, &scene.view, p ? 60.0 : 20.0, 4.0);
        struct cloud *cloud = points_add_cloud(h, &rng, &scene, &camera, sizes, SIZES, 1, 0);
        points_scatter_about(&rng, cloud, 1.0);
        for (uint32_t i = 0; i < 1000; i += 2)
            *points_coordinate(cloud, 5, i, (int)rng_below(&rng, 3)) = odd[rng_below(&rng, ODD)];
        check_scene(h, &scene);
    }
}

// z exact in float32: boundaries belong to the view, one ulp beyond does not; whole screen positions floor to themselves.
static void exact_borders(struct harness *h)
{
    static const uint32_t one[] = {8};
    struct rng rng = {6};
    for (int p = 0; p < 2; p++) {
        struct scene scene = {.view = points_window(4, 2, p, 1.0)};
        scene.view.origin_x = scene.view.origin_y = 0;
        scene.view.z_near = p ? 0.5f : 0.0f;
        scene.view.z_far = 64.0f;
        struct camera camera = {.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .focal = 1.0};
        struct cloud *cloud = points_add_cloud(h, &rng, &scene, &camera, one, 1, 0, 0);
        // Slot i at screen (i % 4, i / 4) exactly.
        const float z[8] = {scene.view.z_near,
                            float_step(p ? 0.5f : 0x1p-126f, p ? -1 : 0),
                            64.0f,
                            float_step(64.0f, 1),
                            1.0f,
                            2.0f,
                            4.0f,
                            8.0f};
        for (uint32_t i = 0; i < 8; i++) {
            float depth = !p && i == 1 ? -z[i] : z[i]; // before the near plane
            *points_coordinate(cloud, 0, i, 0) = (float)(i % 4) * (p ? depth : 1.0f);
            *points_coordinate(cloud, 0, i, 1) = (float)(i / 4) * (p ? depth : 1.0f);
            *points_coordinate(cloud, 0, i, 2) = -depth;
        }
        uint64_t *keys = run_scatter(h, &scene);
        for (uint32_t i = 0; i < 8; i++) {
            // rcp may round x below a whole number: only its row of zeros and z are exact in perspective.
            int exact = !p || i % 4 == 0, drawn = i != 1 && i != 3;
            uint64_t expected = drawn ? ref_key(z[i], i) : REF_EMPTY_KEY;
            if ((!p || i < 4) && exact && keys[i] != expected)
                harness_fail(h, p ? "perspective" : "orthographic", (int)(i % 4), (int)(i / 4), "got %016llx, expected %016llx",
                             (unsigned long long)keys[i], (unsigned long long)expected);
        }
        check_scene(h, &scene);
    }
}

static void camera_plane(struct harness *h)
{
    struct rng rng = {7};
    struct scene scene = {.view = points_window(67, 45, 1, 60.0)};
    struct camera camera = points_look(&rng, &scene.view, 60.0, 0.0); // in the middle of the cloud
    struct cloud *cloud = points_add_cloud(h, &rng, &scene, &camera, sizes, SIZES, 1, 0);
    points_scatter_about(&rng, cloud, 1.0);
    for (uint32_t i = 0; i < 500; i++) // exactly at the eye, and nearly
        for (int axis = 0; axis < 3; axis++)
            *points_coordinate(cloud, 5, i, axis) =
                (float)(-(camera.rotation[axis] * camera.shift[0] + camera.rotation[3 + axis] * camera.shift[1] +
                          camera.rotation[6 + axis] * camera.shift[2]) +
                        (i ? rng_range(&rng, -1.0, 1.0) * pow(10.0, -rng_range(&rng, 0.0, 12.0)) : 0.0));
    check_scene(h, &scene);
    scene.view.z_near = 0x1p-126f; // the least that is not denormal
    check_scene(h, &scene);
}

// All points share one place: the least id wins, whichever chunk, thread or lane it is in. ids up to 2^32 - 3.
static void coincident(struct harness *h)
{
    for (int p = 0; p < 2; p++) {
        struct rng rng = {8};
        struct scene scene = {.view = points_window(67, 45, p, 60.0)};
        struct camera camera = points_look(&rng, &scene.view, 60.0, 4.0);
        uint32_t bases[3] = {0xFFFFFFFEu - 1440u, 70000u, 0x80000000u};
        for (int i = 0; i < 3; i++) {
            struct cloud *cloud = points_add_cloud(h, &rng, &scene, &camera, sizes, SIZES, 0, bases[i]);
            if (i == 0)
                HARNESS_CHECK(h, cloud->slots == 1440);
        }
        uint64_t *keys = check_scene(h, &scene);
        size_t found = 0;
        for (size_t i = 0; i < (size_t)scene.view.width * scene.view.height; i++) {
            found += keys[i] != REF_EMPTY_KEY;
            if (keys[i] != REF_EMPTY_KEY && ref_key_id(keys[i]) != 70000u)
                harness_fail(h, "keys", (int)(i % 67), (int)(i / 67), "got id %u, expected 70000", ref_key_id(keys[i]));
        }
        HARNESS_CHECK(h, found == 1);
        scene.clouds[1] = scene.clouds[2] = scene.clouds[0]; // the greatest ids alone
        scene.count = 1;
        keys = check_scene(h, &scene);
        for (size_t i = 0; i < (size_t)scene.view.width * scene.view.height; i++)
            if (keys[i] != REF_EMPTY_KEY && ref_key_id(keys[i]) != bases[0])
                harness_fail(h, "keys", (int)(i % 67), (int)(i / 67), "got id %u, expected %u", ref_key_id(keys[i]), bases[0]);
    }
}

static void depth_range(struct harness *h) // far / near = 10^7
{
    struct rng rng = {9};
    struct scene scene = {.view = points_window(67, 45, 1, 60.0)};
    scene.view.z_near = 1e-3f;
    scene.view.z_far = 1e4f;
    struct camera camera = points_look(&rng, &scene.view, 60.0, 0.0);
    camera.shift[0] = camera.shift[1] = 0.0;
    struct cloud *cloud = points_add_cloud(h, &rng, &scene, &camera, sizes, SIZES, 0, 0);
    for (uint32_t c = 0; c < SIZES; c++)
        for (uint32_t i = 0; i < sizes[c]; i++) {
            double z = pow(10.0, rng_range(&rng, -3.5, 4.5)), v[3];
            v[0] = rng_range(&rng, -0.6, 0.6) * z;
            v[1] = rng_range(&rng, -0.4, 0.4) * z;
            v[2] = -z;
            for (int a = 0; a < 3; a++)
                *points_coordinate(cloud, c, i, a) = (float)(camera.rotation[a] * v[0] + camera.rotation[3 + a] * v[1] +
                                                             camera.rotation[6 + a] * v[2]);
        }
    check_scene(h, &scene);
}

static void orthographic_scales(struct harness *h)
{
    static const double scales[] = {1e-6, 1e6};
    for (int i = 0; i < 2; i++) {
        struct rng rng = {10};
        double focal = 67.0 / scales[i];
        struct scene scene = {.view = points_window(67, 45, 0, focal)};
        scene.view.z_far = (float)(200.0 * scales[i]); // near = -far = -100 scales
        struct camera camera = points_look(&rng, &scene.view, focal, 0.0);
        camera.near_clip = -100.0 * scales[i];
        camera.shift[0] = camera.shift[1] = 0.0;
        points_scatter_about(&rng, points_add_cloud(h, &rng, &scene, &camera, sizes, SIZES, 1, 0), 0.6 * scales[i]);
        check_scene(h, &scene);
    }
}

// A camera 5 10^6 away from the chunk's origin, and matrices of rank 0 to 2.
static void far_and_flat(struct harness *h)
{
    struct rng rng = {11};
    struct scene scene = {.view = points_window(67, 45, 1, 60.0)};
    scene.view.z_far = 1e7f;
    struct camera camera = points_look(&rng, &scene.view, 60.0 * 2e6, 5000000.23); // lo counts
    points_scatter_about(&rng, points_add_cloud(h, &rng, &scene, &camera, sizes, SIZES, 0, 0), 1.0);
    check_scene(h, &scene);
    for (int rank = 0; rank < 3; rank++) {
        struct scene flat = {.view = points_window(67, 45, 1, 60.0)};
        struct camera view = points_look(&rng, &flat.view, 60.0, 4.0);
        for (int k = 0; k < 9; k++)
            view.rotation[k] *= k % 3 < rank;
        points_scatter_about(&rng, points_add_cloud(h, &rng, &flat, &view, sizes, SIZES, 1, 0), 1.0);
        check_scene(h, &flat);
    }
}

// Facing away, edge-on to the bit, and without a normal.
static void culling(struct harness *h)
{
    static const uint32_t four[] = {4};
    struct rng rng = {12};
    struct scene scene = {.view = points_window(4, 1, 0, 1.0)};
    scene.view.origin_x = scene.view.origin_y = 0;
    struct camera camera = {.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .focal = 1.0};
    struct cloud *cloud = points_add_cloud(h, &rng, &scene, &camera, four, 1, 1, 0);
    // (0,0,1) towards the viewer, (0,0,-1), (1,0,0) edge-on, none; spacing bits must not matter
    const uint32_t words[4] = {4095u | 4095u << 13 | 7u << 26, 8190u | 8190u << 13, 8190u | 4095u << 13 | 9u << 26,
                               PT_NORMAL_NONE | 3u << 26};
    for (uint32_t i = 0; i < 4; i++) {
        *points_coordinate(cloud, 0, i, 0) = (float)i + 0.5f;
        *points_coordinate(cloud, 0, i, 1) = 0.5f;
        *points_coordinate(cloud, 0, i, 2) = -3.0f;
        cloud->surfels[i] = words[i];
    }
    uint64_t *keys = check_scene(h, &scene);
    for (uint32_t i = 0; i < 4; i++) {
        uint64_t expected = i == 0 || i == 3 ? ref_key(3.0f, i) : REF_EMPTY_KEY;
        if (keys[i] != expected)
            harness_fail(h, "keys", (int)i, 0, "got %016llx, expected %016llx", (unsigned long long)keys[i],
                         (unsigned long long)expected);
    }
}

// Behind a layer: limits in disorder, at the first layer's own depths to the ulp, and none left.
static void limits(struct harness *h)
{
    for (int p = 0; p < 2; p++) {
        struct rng rng = {13};
        struct scene scene = {.view = points_window(67, 45, p, p ? 60.0 : 20.0)};
        for (uint32_t i = 0; i < 3; i++) {
            struct camera camera = points_look(&rng, &scene.view, p ? 60.0 : 20.0, 4.0);
            points_scatter_about(&rng, points_add_cloud(h, &rng, &scene, &camera, sizes, SIZES, i == 1, i * 5000), 2.0);
        }
        size_t pixels = (size_t)67 * 45, emptied = 0;
        const uint64_t *front = check_scene(h, &scene);
        float *limit = harness_alloc(h, pixels * 4);
        scene.limit = limit;
        for (int way = 0; way < 4; way++) {
            for (size_t i = 0; i < pixels; i++) {
                float z = front[i] == REF_EMPTY_KEY ? 4.0f : (float)ref_key_z(front[i]);
                const float limits_of[4] = {(float)rng_range(&rng, 0.0, 6.0), z, float_step(z, -1), INFINITY};
                limit[i] = limits_of[way];
            }
            const uint64_t *keys = check_scene(h, &scene);
            for (size_t i = 0; i < pixels; i++) {
                emptied += way == 1 && keys[i] == REF_EMPTY_KEY && front[i] != REF_EMPTY_KEY;
                if (way == 1 && keys[i] <= front[i] && keys[i] != REF_EMPTY_KEY)
                    harness_fail(h, "behind", (int)(i % 67), (int)(i / 67), "shows what lies at its limit");
                if (way == 2 && keys[i] != front[i] && front[i] != REF_EMPTY_KEY)
                    harness_fail(h, "an ulp before", (int)(i % 67), (int)(i / 67), "shows another point");
                if (way == 3 && keys[i] != REF_EMPTY_KEY)
                    harness_fail(h, "finished", (int)(i % 67), (int)(i / 67), "shows a point");
            }
        }
        HARNESS_CHECK(h, emptied > 0);
    }
}

// The rows that the chunk's points may fall into.
static void note_rows(const struct scene *scene, const struct cloud *cloud, struct chunk_view *chunk)
{
    chunk->row_first = scene->view.height;
    for (uint32_t s = 0; s < chunk->count; s++) {
        struct ref_splat splat = ref_scatter(&scene->view, chunk, cloud->positions, cloud->surfels, s);
        if (!splat.possible)
            continue;
        uint32_t first = splat.y0 < 0 ? 0 : (uint32_t)splat.y0, end = (uint32_t)splat.y1 + 1;
        chunk->row_first = first < chunk->row_first ? first : chunk->row_first;
        chunk->row_end = end > chunk->row_end ? end : chunk->row_end;
    }
    chunk->row_end = chunk->row_end < scene->view.height ? chunk->row_end : scene->view.height;
    if (chunk->row_first >= chunk->row_end)
        chunk->row_first = chunk->row_end = 0;
}

// And their columns, and the least depth.
static void note_place(const struct scene *scene, const struct cloud *cloud, struct chunk_view *chunk)
{
    double least = INFINITY;
    note_rows(scene, cloud, chunk);
    chunk->column_first = scene->view.width;
    for (uint32_t s = 0; s < chunk->count; s++) {
        struct ref_splat splat = ref_scatter(&scene->view, chunk, cloud->positions, cloud->surfels, s);
        if (!splat.possible)
            continue;
        const uint32_t first = splat.x0 < 0 ? 0 : (uint32_t)splat.x0, end = (uint32_t)splat.x1 + 1;
        chunk->column_first = first < chunk->column_first ? first : chunk->column_first;
        chunk->column_end = end > chunk->column_end ? end : chunk->column_end;
        least = fmin(least, splat.z.lo);
    }
    chunk->column_end = chunk->column_end < scene->view.width ? chunk->column_end : scene->view.width;
    if (chunk->column_first >= chunk->column_end)
        chunk->column_first = chunk->column_end = 0;
    chunk->z_least = least < INFINITY ? fmaxf(float_step((float)least, -1), 0.0f) : 0.0f;
}

// Chunks that say where they fall: most into a few rows, some across all, some do not say.
static void rows_known(struct harness *h)
{
    enum { CHUNKS = 48 };
    for (int p = 0; p < 2; p++) {
        struct rng rng = {50 + (uint64_t)p};
        uint32_t counts[CHUNKS];
        for (uint32_t c = 0; c < CHUNKS; c++)
            counts[c] = 1 + rng_below(&rng, 300);
        struct scene scene = {.view = points_window(67, 45, p, p ? 60.0 : 20.0)};
        struct camera camera = points_look(&rng, &scene.view, p ? 60.0 : 20.0, 4.0);
        struct cloud *cloud = points_add_cloud(h, &rng, &scene, &camera, counts, CHUNKS, 0, 0);
        points_scatter_about(&rng, cloud, 1.0);
        for (uint32_t c = 0; c < CHUNKS; c++) {
            float middle[3] = {0.0f, 0.0f, 0.0f};
            for (int axis = 0; axis < 3 && c % 8; axis++)
                middle[axis] = (float)rng_range(&rng, -1.0, 1.0);
            for (uint32_t i = 0; i < counts[c]; i++)
                for (int axis = 0; axis < 3 && c % 8; axis++)
                    *points_coordinate(cloud, c, i, axis) = middle[axis] + 0.1f * *points_coordinate(cloud, c, i, axis);
        }
        const uint64_t *unknown = run_scatter(h, &scene);
        uint32_t narrow = 0;
        for (uint32_t c = 0; c < CHUNKS; c++) {
            struct chunk_view *chunk = &cloud->chunks[c];
            if (c % 12)
                note_rows(&scene, cloud, chunk);
            narrow += chunk->row_end && chunk->row_end - chunk->row_first < 15;
        }
        const uint64_t *known = check_scene(h, &scene);
        HARNESS_CHECK(h, narrow > CHUNKS / 2);
        for (uint32_t i = 0; i < scene.view.width * scene.view.height; i++)
            HARNESS_CHECK(h, known[i] == unknown[i]);
    }
}

enum { WIDTH = 67, HEIGHT = 45 };

// With nothing known of tiles.
static int is_hidden(const struct chunk_view *chunk, const uint64_t *keys)
{
    uint32_t farthest[5 * 3];
    struct pt_tiles tiles;
    pt_tiles_begin(keys, WIDTH, HEIGHT, farthest, &tiles);
    return pt_is_hidden(chunk, &tiles);
}

// A wall, and behind it, in front of it and through it what may be hidden.
static void hidden(struct harness *h)
{
    uint64_t *keys = harness_alloc(h, sizeof *keys * WIDTH * HEIGHT);
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
        keys[i] = ref_key(3.0f, 0xFFFFFFFEu);
    struct chunk_view chunk = {.count = 100, .column_first = 3, .column_end = 13, .row_first = 35, .row_end = 45};
    const float depths[] = {0.0f, 0x1p-126f, 2.0f, float_step(3.0f, -1), 3.0f, float_step(3.0f, 1), 4.0f, INFINITY};
    for (uint32_t i = 0; i < sizeof depths / sizeof depths[0]; i++) { // of equal depths the numbers decide
        chunk.z_least = depths[i];
        HARNESS_CHECK(h, is_hidden(&chunk, keys) == (depths[i] > 3.0f));
    }
    chunk.z_least = 4.0f;
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) { // a hole of one pixel, and a pixel as far as the chunk
        const uint32_t x = i % WIDTH, y = i / WIDTH, within = x >= 3 && x < 13 && y >= 35;
        for (int way = 0; way < 2; way++) {
            keys[i] = way ? ref_key(4.0f, 0) : REF_EMPTY_KEY;
            HARNESS_CHECK(h, is_hidden(&chunk, keys) == !within);
        }
        keys[i] = ref_key(3.0f, 0);
    }
    chunk.row_first = chunk.row_end = 0; // it does not say where it is
    HARNESS_CHECK(h, !is_hidden(&chunk, keys));
    chunk.column_first = chunk.column_end = 0;
    HARNESS_CHECK(h, !is_hidden(&chunk, keys));
}

// Rectangles of any size, whose tiles tell what they found before keys became less: as looking at each pixel says, or that a chunk is open
// that is hidden only since then.
static void tiles(struct harness *h)
{
    struct rng rng = {26};
    uint32_t farthest[5 * 3], large = 0, stale = 0;
    uint64_t *keys = harness_alloc(h, sizeof *keys * WIDTH * HEIGHT);
    struct pt_tiles known;
    HARNESS_CHECK(h, pt_tile_count(WIDTH, HEIGHT) == sizeof farthest / sizeof *farthest);
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
        keys[i] = REF_EMPTY_KEY;
    pt_tiles_begin(keys, WIDTH, HEIGHT, farthest, &known);
    for (uint32_t k = 0; k < 20000; k++) {
        const uint32_t x = (uint32_t)rng_range(&rng, 0, WIDTH), y = (uint32_t)rng_range(&rng, 0, HEIGHT);
        struct chunk_view chunk = {
            .count = 4096, .column_first = x, .row_first = y, .z_least = (float)rng_range(&rng, 1.0, 9.0)};
        chunk.column_end = x + 1 + (uint32_t)rng_range(&rng, 0, WIDTH - x);
        chunk.row_end = y + 1 + (uint32_t)rng_range(&rng, 0, HEIGHT - y);
        int open = 0;
        for (uint32_t row = y; row < chunk.row_end; row++)
            for (uint32_t column = x; column < chunk.column_end; column++)
                open |= keys[row * WIDTH + column] >= ref_key(chunk.z_least, 0);
        HARNESS_CHECK(h, is_hidden(&chunk, keys) == !open);
        HARNESS_CHECK(h, pt_is_hidden(&chunk, &known) == !open);
        large += !open && (chunk.column_end - x) * (chunk.row_end - y) > 4 * PT_TILE * PT_TILE;
        for (uint32_t i = 0; i < 8; i++) { // all end at 0.5 to 3
            const uint32_t pixel = (uint32_t)rng_range(&rng, 0, WIDTH * HEIGHT);
            const uint64_t key = ref_key((float)rng_range(&rng, k < 10000 ? 3.0 : 0.5, 3.5), k);
            keys[pixel] = key < keys[pixel] ? key : keys[pixel];
        }
        stale += farthest[0] != UINT32_MAX;
    }
    HARNESS_CHECK(h, large > 100 && stale > 1000);
    struct chunk_view far = {
        .count = 20, .column_end = WIDTH, .row_end = HEIGHT, .z_least = 100.0f}; // fewer points than tiles are worth
    HARNESS_CHECK(h, !is_hidden(&far, keys));
    far.count = 60;
    HARNESS_CHECK(h, is_hidden(&far, keys));
}

// Dense chunks one behind another that say where they are: keys as of those that do not.
static void behind_a_wall(struct harness *h)
{
    enum { CHUNKS = 40 };
    for (int way = 0; way < 4; way++) { // orthographic or not; with a layer before
        const int p = way % 2;
        struct rng rng = {70 + (uint64_t)way};
        uint32_t counts[CHUNKS];
        for (uint32_t c = 0; c < CHUNKS; c++)
            counts[c] = c < 4 ? 20000 : 1500;
        struct scene scene = {.view = points_window(67, 45, p, p ? 60.0 : 20.0)};
        struct camera camera = points_look(&rng, &scene.view, p ? 60.0 : 20.0, 4.0);
        const double straight[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
        memcpy(camera.rotation, straight, sizeof straight);
        struct cloud *cloud = points_add_cloud(h, &rng, &scene, &camera, counts, CHUNKS, 0, 0);
        for (uint32_t c = 0; c < CHUNKS; c++) { // the nearest last, some at its depth
            const int wall = c < 4;
            const double depth = wall ? 0.0 : c % 9 ? -rng_range(&rng, 0.1, 8.0) : c % 2 ? 0.0 : 0.5;
            const double x = wall ? (c % 2 ? 1.0 : -1.0) : rng_range(&rng, -2.0, 2.0),
                         y = wall ? (c / 2 ? 0.7 : -0.7) : rng_range(&rng, -1.0, 1.0);
            for (uint32_t i = 0; i < counts[c]; i++) {
                const double wide = wall ? 1.02 : 0.2;
                *points_coordinate(cloud, c, i, 0) = (float)(x + rng_range(&rng, -wide, wide));
                *points_coordinate(cloud, c, i, 1) = (float)(y + 0.72 * rng_range(&rng, -wide, wide));
                *points_coordinate(cloud, c, i, 2) = (float)depth;
            }
        }
        float *limit = harness_alloc(h, (size_t)67 * 45 * sizeof *limit);
        for (uint32_t i = 0; i < 67 * 45; i++)
            limit[i] = i % 3 ? 4.0f : 3.4f;
        scene.limit = way > 1 ? limit : NULL;
        const uint64_t *unknown = run_scatter(h, &scene);
        uint32_t behind = 0;
        for (uint32_t c = 0; c < CHUNKS; c++)
            note_place(&scene, cloud, &cloud->chunks[c]);
        const uint64_t *known = check_scene(h, &scene);
        for (uint32_t i = 0; i < 67 * 45; i++)
            HARNESS_CHECK(h, known[i] == unknown[i]);
        for (uint32_t c = 4; c < CHUNKS; c++)
            behind += is_hidden(&cloud->chunks[c], known) != 0;
        HARNESS_CHECK(h, behind > (way > 1 ? 0u : CHUNKS / 4));
    }
}

// No instance at all, and a plane that already holds something nearer.
static void nothing(struct harness *h)
{
    struct scene scene = {.view = points_window(67, 45, 1, 60.0)};
    uint64_t *keys = run_scatter(h, &scene);
    for (size_t i = 0; i < (size_t)67 * 45; i++)
        HARNESS_CHECK(h, keys[i] == REF_EMPTY_KEY);
}

// Reference alone: a point on the axis falls into the middle pixel, at its distance.
static void sanity(struct harness *h)
{
    struct view_args view = points_window(64, 64, 1, 100.0);
    struct chunk_view chunk = {.row = {100, 0, -48, 0, 100, -40, 0, 0, -1}, .count = 1, .padded = 1, .id_base = 5};
    float p[3] = {0.01f, 0.01f, -2.0f};
    uint32_t words[2] = {0, 0};
    struct ref_splat splat = ref_scatter(&view, &chunk, p, words, 0);
    HARNESS_CHECK(h, splat.possible && splat.definite && splat.id == 5);
    HARNESS_CHECK(h, splat.x0 == 32 && splat.y0 == 32); // 48.5 - origin 16, 40.5 - origin 8
    HARNESS_CHECK(h, splat.z.lo <= 2.0 && splat.z.hi >= 2.0 && splat.z.hi - splat.z.lo < 1e-5);
    p[2] = 2.0f;
    HARNESS_CHECK(h, !ref_scatter(&view, &chunk, p, words, 0).possible);
}

static void packed(struct harness *h)
{
    points_packed(h, perspective);
    points_packed(h, orthographic);
    points_packed(h, culling);
    points_packed(h, sifted);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"packed positions", packed, 0},
        {"sanity", sanity, 1},
        {"random clouds, perspective", perspective, 0},
        {"random clouds, orthographic", orthographic, 0},
        {"plane sizes", plane_sizes, 0},
        {"window left of and below the picture", negative_origin, 0},
        {"NaN, Inf and huge positions", not_numbers, 0},
        {"z at near and far, whole screen positions", exact_borders, 0},
        {"points at and behind the camera plane", camera_plane, 0},
        {"coincident points, ids near 2^32 - 2", coincident, 0},
        {"far / near = 10^7", depth_range, 0},
        {"orthographic scales 1e-6 and 1e6, near = -far", orthographic_scales, 0},
        {"camera 5 10^6 away, singular matrices", far_and_flat, 0},
        {"back faces", culling, 0},
        {"behind a layer", limits, 0},
        {"sifted chunks", sifted, 0},
        {"chunks that know their rows", rows_known, 0},
        {"what is hidden", hidden, 1},
        {"what tiles of keys know", tiles, 1},
        {"chunks behind a wall", behind_a_wall, 0},
        {"nothing to draw", nothing, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
