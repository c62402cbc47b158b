// SPDX-License-Identifier: GPL-3.0-or-later
// Clouds in levels: pictures that leave finer ones out are closed, near the exact one, and the same on all devices; exact ones draw all
// (SPEC 13).
#include "clouds.h"
#include "plan/plan.h"
#include "scene/clouds/clusters.h"
#include "support.h"
#include "town.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { WIDTH = 320, HEIGHT = 180, QUARTER = 200000, ACROSS = 3, LEVELS = 4 };

static char path[] = "/tmp/patina-detail-XXXXXX";

static int make_file(void **state)
{
    (void)state;
    if (close(mkstemp(path)))
        support_die("no temporary file");
    town_write(path, ACROSS, QUARTER, LEVELS, 0);
    return 0;
}

static int remove_file(void **state)
{
    (void)state;
    return remove(path);
}

static struct picture draw(patina_device *device, patina_scene *scene, float detail, uint32_t surface,
                           patina_frame_stats *stats)
{
    patina_frame *frame = NULL;
    patina_settings settings = settings_default(WIDTH, HEIGHT);
    settings.detail = detail;
    settings.surface = surface;
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, scene), frame);
    *stats = (patina_frame_stats){.struct_size = sizeof *stats};
    CHECK(patina_frame_get_stats(frame, stats), frame);
    struct picture picture = picture_read(frame);
    patina_frame_destroy(frame);
    return picture;
}

static patina_scene *look_at_town(patina_cloud *cloud, int near)
{
    const double side = ACROSS * TOWN_QUARTER;
    const double far_eye[3] = {-0.4 * side, -0.75 * side, 0.75 * side}, middle[3] = {side / 2, side / 2, 4};
    const double near_eye[3] = {62, 46, 9}, street[3] = {74, 110, 6};
    patina_scene *scene = scene_of(cloud, NULL);
    const patina_camera camera = camera_perspective(near ? near_eye : far_eye, near ? street : middle, 45, WIDTH, HEIGHT, 0.1,
                                                    1000);
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    return scene;
}

struct errors {
    double color; // root mean square over pixels, of white
    double holes; // of the exact picture's pixels, that are empty
    double off;   // of those that both show, where depth is off by more than 2 % of z
};

static struct errors compare(const struct picture *picture, const struct picture *exact)
{
    struct errors errors = {0};
    uint64_t both = 0, shown = 0;
    for (size_t i = 0; i < WIDTH * HEIGHT; i++) {
        for (int k = 0; k < 3; k++) {
            const double d = (double)fminf(picture->combined[4 * i + k], 1) - (double)fminf(exact->combined[4 * i + k], 1);
            errors.color += d * d / (3.0 * WIDTH * HEIGHT);
        }
        if (!(exact->combined[4 * i + 3] > 0.5f) || !(exact->depth[i] < 1e29f))
            continue;
        shown++;
        if (!(picture->depth[i] < 1e29f))
            errors.holes++;
        else if (++both && fabsf(picture->depth[i] - exact->depth[i]) > 0.02f * exact->depth[i])
            errors.off++;
    }
    errors.color = sqrt(errors.color);
    errors.holes /= (double)shown;
    errors.off /= (double)both;
    return errors;
}

static void test_errors(void **state)
{
    (void)state;
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_open(path, &cloud), NULL);
    for (int near = 0; near < 2; near++) {
        patina_scene *scene = look_at_town(cloud, near);
        patina_device *device = support_device_first();
        patina_frame_stats all, some;
        struct picture exact = draw(device, scene, 0, 0, &all);
        struct picture all_drawn = draw(device, scene, 1e-6f, 0, &some);
        picture_assert_identical(&all_drawn, &exact, 0, 0, "a detail that nothing is below");
        picture_free(&all_drawn);
        uint64_t before = all.points_scattered;
        for (float detail = 0.5f; detail <= 4.0f; detail *= 2) {
            struct picture picture = draw(device, scene, detail, 0, &some);
            const struct errors errors = compare(&picture, &exact);
            printf("  %s, %.1f px: %.3f of the points, %.3f of the bytes, colour %.4f, open %.5f, depth off %.4f\n",
                   near ? "street" : "overview", (double)detail, (double)some.points_scattered / (double)all.points_scattered,
                   (double)some.mapped_read / (double)all.mapped_read, errors.color, errors.holes, errors.off);
            assert_true(some.points_scattered <= before && (near || some.points_scattered < all.points_scattered / 3));
            before = some.points_scattered;
            assert_true(errors.color < 0.04 && errors.holes < 0.03 && (detail > 1.0f || errors.holes < 0.01)); // as measured
            picture_free(&picture);
        }
        picture_free(&exact);
        patina_device_destroy(device);
        patina_scene_destroy(scene);
    }
    patina_cloud_destroy(cloud);
}

// Keys of all devices agree; and what does not go by levels is as ever.
static void test_devices(void **state)
{
    (void)state;
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_open(path, &cloud), NULL);
    patina_scene *scene = look_at_town(cloud, 0);
    struct picture first = {0};
    patina_frame_stats stats, all;
    for (uint32_t d = 0; d < support_device_count(); d++) {
        patina_device *device = support_device_open(support_device_name(d), 0, 0);
        if (!device)
            continue;
        struct picture picture = draw(device, scene, 2, 0, &stats);
        if (first.keys)
            assert_memory_equal(picture.keys, first.keys, WIDTH * HEIGHT * sizeof *picture.keys);
        else {
            struct picture exact = draw(device, scene, 0, PATINA_SURFACE_SPLATS, &all);
            struct picture discs = draw(device, scene, 2, PATINA_SURFACE_SPLATS, &stats);
            picture_assert_identical(&discs, &exact, 0, 0, "discs alone");
            picture_free(&exact);
            picture_free(&discs);
            first = picture;
            picture = (struct picture){0};
        }
        picture_free(&picture);
        patina_device_destroy(device);
    }
    picture_free(&first);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

// A plan is the same to the bit whether it looks at clusters of chunks first or at each chunk.
static void test_clusters(void **state)
{
    (void)state;
    struct pcg random = pcg_seed(26);
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_open(path, &cloud), NULL);
    patina_scene *scene = scene_of(cloud, NULL);
    struct pt_cluster *clusters = cloud->clusters;
    assert_non_null(clusters);
    uint64_t seen = 0, all = 0;
    for (int i = 0; i < 400; i++) {
        const double side = ACROSS * TOWN_QUARTER;
        double eye[3], target[3];
        for (int k = 0; k < 3; k++) {
            eye[k] = pcg_between(&random, -0.3, 1.3) * (k < 2 ? side : 20);
            target[k] = pcg_between(&random, 0, 1) * (k < 2 ? side : 10);
        }
        const double fov = pcg_between(&random, 4, 120), near_clip = pcg_between(&random, 0, 1) < 0.5 ? 0.01 : 5;
        const patina_camera camera = i % 4 ? camera_perspective(eye, target, fov, WIDTH, HEIGHT, near_clip, 150)
                                           : camera_orthographic(eye, target, fov, WIDTH, HEIGHT, near_clip, 150);
        patina_settings settings = settings_default(WIDTH, HEIGHT);
        settings.detail = i % 3 ? (float)pcg_between(&random, 0, 5) : 0.0f;
        CHECK(patina_scene_set_camera(scene, &camera), scene);
        CHECK(patina_scene_set_settings(scene, &settings), scene);
        struct pt_plan plan[2];
        for (int way = 0; way < 2; way++) {
            cloud->clusters = way ? NULL : clusters;
            CHECK(pt_plan_create(scene, NULL, &plan[way]), scene);
        }
        cloud->clusters = clusters;
        assert_true(plan[0].chunks_culled == plan[1].chunks_culled && plan[0].spacing_px == plan[1].spacing_px);
        assert_int_equal(plan[0].instance_count, plan[1].instance_count);
        for (uint32_t k = 0; k < plan[0].instance_count; k++) {
            const struct pt_plan_instance *one = &plan[0].instances[k], *other = &plan[1].instances[k];
            assert_int_equal(one->chunk_count, other->chunk_count);
            assert_memory_equal(one->chunks, other->chunks, one->chunk_count * sizeof *one->chunks);
        }
        seen += plan[0].chunks - plan[0].chunks_culled;
        all += plan[0].chunks;
        pt_plan_destroy(&plan[0]);
        pt_plan_destroy(&plan[1]);
    }
    print_message("%.0f %% of the chunks in view\n", 100.0 * (double)seen / (double)all);
    assert_true(seen > all / 50 && seen < all / 2);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

static void test_refused(void **state)
{
    (void)state;
    patina_scene *scene = NULL;
    patina_settings settings = settings_default(WIDTH, HEIGHT);
    assert_int_equal(patina_scene_create(&scene), PATINA_OK);
    settings.detail = -1;
    assert_int_equal(patina_scene_set_settings(scene, &settings), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(support_message(scene), "detail"));
    patina_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_errors), cmocka_unit_test(test_devices),
                                       cmocka_unit_test(test_clusters), cmocka_unit_test(test_refused)};
    return cmocka_run_group_tests(tests, make_file, remove_file);
}
