// SPDX-License-Identifier: GPL-3.0-or-later
// One result: the CPU's whole picture is bit-identical for any number of threads, any scheduling batch, and
// from run to run (DESIGN rule 4).
#include "staging.h"

#include <stdio.h>

static void test_threads_and_batches(void **state)
{
    (void)state;
    static const uint32_t ways[][2] = {
        {1, 0}, {2, 0}, {3, 0}, {7, 0}, {1, 1}, {2, 1}, {3, 1},  {7, 1},  {1, 2},  {2, 2},
        {3, 2}, {7, 2}, {1, 5}, {2, 5}, {3, 5}, {7, 5}, {1, 64}, {2, 64}, {3, 64}, {7, 64},
    };
    const int quick = support_is_quick("four of five ways to share the work");
    for (uint32_t i = 0; i < staging_count; i++) {
        struct stage stage = stage_build(&stagings[i]);
        struct picture truth = {0};
        uint32_t step = quick || stagings[i].width > 500 ? 5 : 1; // the large scenes take every fifth way
        for (uint32_t k = 0; k < sizeof ways / sizeof ways[0]; k += step) {
            patina_device_desc desc = {.struct_size = sizeof desc, .name = "cpu"};
            desc.threads = ways[k][0];
            desc.batch = ways[k][1];
            patina_device *device = NULL;
            CHECK(patina_device_create(&desc, &device), NULL);
            for (int again = 0; again < (k == 3 ? 3 : 1); again++) {
                struct picture picture = picture_render(device, stage.scene, &stage.camera, &stage.settings);
                char what[128];
                snprintf(what, sizeof what, "%s: %u threads, batch %u against 1 thread", stagings[i].name, ways[k][0],
                         ways[k][1]);
                if (!truth.keys) {
                    truth = picture;
                    continue;
                }
                picture_assert_identical(&picture, &truth, 0, 0, what);
                picture_free(&picture);
            }
            patina_device_destroy(device);
        }
        picture_free(&truth);
        stage_free(&stage);
    }
}

// The number of threads that build a cloud changes nothing either.
static void test_cloud_threads(void **state)
{
    (void)state;
    struct points points = points_torus(200000, 1.0, 0.4, POINTS_ALL, 3);
    patina_device *device = support_device_open("cpu", 0, 0);
    assert_non_null(device);
    const double eye[3] = {0.3, -2.7, 2.3}, target[3] = {0, 0, 0};
    patina_camera camera = camera_perspective(eye, target, 45.8, 203, 151, 0.1, 100.0);
    patina_settings settings = settings_default(203, 151);
    struct picture truth = {0};
    for (uint32_t threads = 1; threads <= 7; threads += 2) {
        patina_cloud_desc desc = points_desc(&points);
        desc.threads = threads;
        patina_cloud *cloud = NULL;
        CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
        patina_scene *scene = scene_of(cloud, NULL);
        struct picture picture = picture_render(device, scene, &camera, &settings);
        if (truth.keys) {
            picture_assert_identical(&picture, &truth, 0, 0, "cloud built by several threads");
            picture_free(&picture);
        } else {
            truth = picture;
        }
        patina_scene_destroy(scene);
        patina_cloud_destroy(cloud);
    }
    picture_free(&truth);
    patina_device_destroy(device);
    points_free(&points);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_threads_and_batches),
        cmocka_unit_test(test_cloud_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
