// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers of points up to 2^32 - 2 and beyond (SPEC 1): a scene holds any number of them, keys 32 bits of it, and a picture sees so many.
#include "scenes/clouds.h"
#include "scenes/support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// `count` rows that are not numbers, the last one at the origin: many ids, hardly any points.
static patina_cloud *hollow_cloud(uint64_t count)
{
    struct points points = points_create(count, POINTS_PLAIN);
    for (uint64_t i = 0; i < 3 * (count - 1); i++)
        points.position[i] = NAN;
    patina_cloud *cloud = points_upload(&points);
    points_free(&points);
    return cloud;
}

static int add_at(patina_scene *scene, const patina_cloud *cloud, double x, double y, double z)
{
    patina_cloud_style style = {.struct_size = sizeof style};
    const double m[16] = {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1};
    memcpy(style.world_from_object, m, sizeof m);
    return patina_scene_add_cloud(scene, cloud, &style);
}

static void expect_too_many(int code, const void *scene)
{
    assert_int_equal(code, PATINA_ERROR_TOO_MANY_POINTS);
    const char *message = support_message(scene);
    printf("  message: %s\n", message);
    assert_true(strstr(message, "points") != NULL); // it says what there is too much of
}

// Exactly 2^32 - 2 points: the last has the id 2^32 - 3, and is drawn with it on every device. With one point more keys say no, and numbers go
// on.
static void test_last_id(void **state)
{
    (void)state;
    const uint64_t step = 1u << 23, limit = 0xFFFFFFFEu;
    uint64_t full = limit / step, rest = limit - full * step;
    patina_cloud *cloud = hollow_cloud(step), *last = hollow_cloud(rest), *one = hollow_cloud(1);
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    for (uint64_t i = 0; i < full; i++) // columns of 32
        CHECK(add_at(scene, cloud, (double)(i % 32) + 0.5, (double)(i / 32) + 0.5, 0.0), scene);
    CHECK(add_at(scene, last, 31.5, 31.5, 0.0), scene);

    const double eye[3] = {16.0, 16.0, 5.0}, target[3] = {16.0, 16.0, 0.0};
    patina_camera camera = camera_orthographic(eye, target, 32.0, 32, 32, 0.1, 10.0);
    patina_settings settings = settings_default(32, 32);
    settings.fill = PATINA_FILL_OFF;
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (!device)
            continue;
        struct picture picture = picture_render(device, scene, &camera, &settings);
        for (uint64_t i = 0; i < full; i++)
            assert_int_equal(key_id(picture.keys[i]), (i + 1) * step - 1);
        assert_int_equal(key_id(picture.keys[1023]), limit - 1);
        assert_int_equal(picture_count(&picture), full + 1);
        picture_free(&picture);
        patina_device_destroy(device);
    }
    CHECK(add_at(scene, one, 0.5, 31.5, 1.0), scene); // before the first of the uppermost row
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    patina_device *device = support_device_first();
    patina_frame *frame = NULL;
    uint64_t numbers[1024];
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, scene), frame);
    expect_too_many(patina_frame_read_keys(frame, numbers, sizeof numbers), frame);
    assert_non_null(strstr(support_message(frame), "patina_frame_read_numbers"));
    CHECK(patina_frame_read_numbers(frame, numbers, sizeof numbers), frame);
    for (uint64_t i = 0; i < full; i++)
        assert_true(numbers[i] == (i == 31 * 32 ? limit : (i + 1) * step - 1));
    patina_frame_destroy(frame);
    patina_device_destroy(device);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    patina_cloud_destroy(last);
    patina_cloud_destroy(one);
}

// Five billion points in instances of an ordinary cloud. A picture sees the last of them; or all, and says that these are too many.
static void test_instances_of_a_million(void **state)
{
    (void)state;
    enum { INSTANCES = 5000, MILLION = 1000000 };
    struct points points = points_sphere(MILLION, 1.0, POINTS_PLAIN, 81);
    patina_cloud *cloud = points_upload(&points);
    points_free(&points);
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    for (uint32_t i = 0; i < INSTANCES; i++)
        CHECK(add_at(scene, cloud, i + 1 < INSTANCES ? 1e5 : 0.0, 0.0, 0.0), scene); // all but the last far out of view

    patina_device *device = support_device_first();
    const double eye[3] = {0.0, -6.0, 0.0}, target[3] = {0.0, 0.0, 0.0};
    const patina_camera camera = camera_perspective(eye, target, 40.0, 64, 64, 0.1, 20.0);
    const patina_settings settings = settings_default(64, 64);
    CHECK(patina_scene_set_camera(scene, &camera), scene);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, scene), frame);
    patina_frame_stats stats = {.struct_size = sizeof stats};
    CHECK(patina_frame_get_stats(frame, &stats), frame);
    printf("  %u instances of a million points, one in view: %.1f ms, %llu of %llu chunks culled\n", INSTANCES, stats.ms,
           (unsigned long long)stats.chunks_culled, (unsigned long long)stats.chunks);
    assert_true(stats.points == (uint64_t)INSTANCES * MILLION);
    assert_true(stats.points_scattered <= MILLION);
    uint64_t numbers[64 * 64];
    uint32_t shown = 0;
    expect_too_many(patina_frame_read_keys(frame, numbers, sizeof numbers), frame);
    CHECK(patina_frame_read_numbers(frame, numbers, sizeof numbers), frame);
    for (uint32_t i = 0; i < 64 * 64; i++) {
        shown += numbers[i] != UINT64_MAX;
        assert_true(numbers[i] == UINT64_MAX ||
                    (numbers[i] >= (INSTANCES - 1ull) * MILLION && numbers[i] < (uint64_t)INSTANCES * MILLION));
    }
    assert_in_range(shown, 400, 2000);

    const double beside[3] = {1e5, -6.0, 0.0}, there[3] = {1e5, 0.0, 0.0};
    const patina_camera all = camera_perspective(beside, there, 40.0, 64, 64, 0.1, 20.0);
    CHECK(patina_scene_set_camera(scene, &all), scene);
    expect_too_many(patina_frame_render(frame, scene), frame);
    assert_non_null(strstr(support_message(frame), "settings.detail"));
    CHECK(patina_scene_set_camera(scene, &camera), scene); // it stays usable
    CHECK(patina_frame_render(frame, scene), frame);
    patina_frame_destroy(frame);
    patina_device_destroy(device);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

// Ties in z go to the least id, within a cloud and between instances.
static void test_ties(void **state)
{
    (void)state;
    struct points points = points_create(3000, POINTS_PLAIN); // all at the origin
    patina_cloud *cloud = points_upload(&points);
    points_free(&points);
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    CHECK(add_at(scene, cloud, 3.0, 0.0, 0.0), scene);
    CHECK(add_at(scene, cloud, 0.0, 0.0, 0.0), scene);
    CHECK(add_at(scene, cloud, 0.0, 0.0, 0.0), scene);
    const double eye[3] = {0.0, 0.0, 5.0}, target[3] = {0.0, 0.0, 0.0};
    patina_camera camera = camera_orthographic(eye, target, 5.0, 5, 5, 0.1, 10.0);
    patina_settings settings = settings_default(5, 5);
    settings.fill = PATINA_FILL_OFF;
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (!device)
            continue;
        struct picture picture = picture_render(device, scene, &camera, &settings);
        assert_int_equal(picture_count(&picture), 1);
        assert_int_equal(key_id(picture.keys[12]), 3000);
        picture_free(&picture);
        patina_device_destroy(device);
    }
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_last_id),
        cmocka_unit_test(test_instances_of_a_million),
        cmocka_unit_test(test_ties),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
