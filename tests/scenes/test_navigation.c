// SPDX-License-Identifier: GPL-3.0-or-later
// What the viewport needs: quick pictures of a few strata that still close, and colours that change alone.
#include "clouds.h"
#include "scene/clouds/cloud.h"
#include "support.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { SIDE = 256, POINTS = 400000 };

static patina_camera camera(void)
{
    const double eye[3] = {0, -3, 2}, target[3] = {0, 0, 0};
    return camera_perspective(eye, target, 45, SIDE, SIDE, 0.1, 100);
}

static struct picture draw(patina_device *device, patina_scene *scene, uint32_t strata)
{
    patina_camera view = camera();
    patina_settings settings = settings_default(SIDE, SIDE);
    settings.strata = strata;
    return picture_render(device, scene, &view, &settings);
}

// Every prefix of the strata closes the shape; keys agree on all devices.
static void test_strata(void **state)
{
    (void)state;
    struct points points = points_torus(POINTS, 1.0, 0.4, POINTS_ALL, 3);
    patina_cloud *cloud = points_upload(&points);
    patina_scene *scene = scene_of(cloud, NULL);
    for (uint32_t strata = 1; strata <= 6; strata++) {
        struct picture first = {0};
        for (uint32_t d = 0; d < support_device_count(); d++) {
            patina_device *device = support_device_open(support_device_name(d), 0, 0);
            if (!device)
                continue;
            struct picture whole = draw(device, scene, 0), picture = draw(device, scene, strata);
            uint64_t drawn = picture_count(&picture), wanted = picture_count(&whole);
            double share = (double)drawn / (double)wanted;
            if (!d)
                printf("  %u of 6 strata: %.4f of the whole picture's pixels\n", strata, share);
            assert_true(share > 0.99 && share < 1.03); // measured: 1.000 to 1.025
            if (strata == 6)
                picture_assert_identical(&picture, &whole, 0, 0, "all strata");
            if (first.keys)
                assert_memory_equal(picture.keys, first.keys, SIDE * SIDE * sizeof *picture.keys);
            picture_free(&whole);
            if (first.keys)
                picture_free(&picture);
            else
                first = picture;
            patina_device_destroy(device);
        }
        picture_free(&first);
    }
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    points_free(&points);
}

static void test_strata_scattered(void **state)
{
    (void)state;
    struct points points = points_torus(POINTS, 1.0, 0.4, POINTS_ALL, 3);
    patina_cloud *cloud = points_upload(&points);
    patina_scene *scene = scene_of(cloud, NULL);
    patina_device *device = support_device_first();
    patina_frame *frame = NULL;
    patina_camera view = camera();
    assert_int_equal(patina_frame_create(device, &frame), PATINA_OK);
    assert_int_equal(patina_scene_set_camera(scene, &view), PATINA_OK);
    uint64_t before = 0;
    for (uint32_t strata = 1; strata <= 6; strata++) {
        patina_settings settings = settings_default(SIDE, SIDE);
        patina_frame_stats stats = {.struct_size = sizeof stats};
        settings.strata = strata;
        assert_int_equal(patina_scene_set_settings(scene, &settings), PATINA_OK);
        assert_int_equal(patina_frame_render(frame, scene), PATINA_OK);
        assert_int_equal(patina_frame_get_stats(frame, &stats), PATINA_OK);
        if (before) { // twice as many, but for whole vectors of 16 in each chunk
            assert_true(stats.points_scattered <= 2 * before);
            assert_true(stats.points_scattered + 16 * stats.chunks >= 2 * before - 16 * stats.chunks);
        }
        before = stats.points_scattered;
    }
    patina_settings settings = settings_default(SIDE, SIDE);
    settings.strata = 7;
    assert_int_equal(patina_scene_set_settings(scene, &settings), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(support_message(scene), "7 strata"));
    patina_frame_destroy(frame);
    patina_device_destroy(device);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    points_free(&points);
}

// New colours give the picture of a cloud made with them, on a device that had uploaded the old ones.
static void test_colors(void **state)
{
    (void)state;
    struct points points = points_torus(20000, 1.0, 0.4, POINTS_ALL, 3);
    patina_cloud *cloud = points_upload(&points);
    uint8_t(*painted)[3] = malloc(20000 * sizeof *painted);
    for (int i = 0; i < 20000; i++)
        for (int k = 0; k < 3; k++)
            painted[i][k] = (uint8_t)(i * (k + 3) >> 2);
    const patina_array arrays[2] = {{painted, PATINA_UINT8, 3, 0}, {NULL, 0, 0, 0}};
    patina_cloud_desc desc = points_desc(&points);
    for (uint32_t d = 0; d < support_device_count(); d++) {
        patina_device *device = support_device_open(support_device_name(d), 0, 0);
        if (!device)
            continue;
        patina_frame *frame = NULL;
        assert_int_equal(patina_frame_create(device, &frame), PATINA_OK);
        for (int i = 0; i < 2; i++) {
            patina_cloud *wanted = NULL;
            patina_camera view = camera();
            patina_settings settings = settings_default(SIDE, SIDE);
            patina_scene *scene = scene_of(cloud, NULL); // its lighting follows the colours that the cloud has now
            assert_int_equal(patina_scene_set_camera(scene, &view), PATINA_OK);
            assert_int_equal(patina_scene_set_settings(scene, &settings), PATINA_OK);
            assert_int_equal(patina_frame_render(frame, scene), PATINA_OK); // the colours before
            patina_scene_destroy(scene);
            assert_int_equal(patina_cloud_set_colors(cloud, &arrays[i]), PATINA_OK);
            scene = scene_of(cloud, NULL);
            patina_scene_set_camera(scene, &view);
            patina_scene_set_settings(scene, &settings);
            assert_int_equal(patina_frame_render(frame, scene), PATINA_OK);
            struct picture got = picture_read(frame);
            desc.color = arrays[i];
            assert_int_equal(patina_cloud_create(&desc, NULL, &wanted), PATINA_OK);
            patina_scene *other = scene_of(wanted, NULL);
            struct picture picture = picture_render(device, other, &view, &settings);
            picture_assert_identical(&got, &picture, 0, 0, i ? "no colours" : "painted");
            picture_free(&got);
            picture_free(&picture);
            patina_scene_destroy(scene);
            patina_scene_destroy(other);
            patina_cloud_destroy(wanted);
        }
        patina_frame_destroy(frame);
        patina_device_destroy(device);
    }
    const patina_array wrong = {painted, PATINA_FLOAT64, 3, 0};
    assert_int_equal(patina_cloud_set_colors(cloud, &wrong), PATINA_ERROR_ARGUMENT);
    patina_cloud_destroy(cloud);
    points_free(&points);
    free(painted);
}

// A saved cloud opens with the same picture; damaged files are refused.
static void test_saved(void **state)
{
    (void)state;
    char path[] = "/tmp/patina-cloud-XXXXXX";
    close(mkstemp(path));
    for (unsigned columns = 0; columns < 2; columns++) {
        struct points points = points_torus(50000, 1.0, 0.4, columns ? POINTS_ALL : 0, 3);
        patina_cloud *cloud = points_upload(&points), *opened = NULL;
        assert_int_equal(patina_cloud_save(cloud, path), PATINA_OK);
        assert_int_equal(patina_cloud_open(path, &opened), PATINA_OK);
        patina_cloud_info info = {.struct_size = sizeof info};
        assert_int_equal(patina_cloud_get_info(opened, &info), PATINA_OK);
        assert_true(info.count == 50000 && info.bytes < 50000);
        assert_true(pt_cloud_fingerprint(opened) == pt_cloud_fingerprint(cloud)); // shadow textures know it again
        struct points strange = points_torus(50000, 1.0, 0.4, columns ? POINTS_ALL : 0, 4);
        patina_cloud *foreign = points_upload(&strange);
        assert_true(pt_cloud_fingerprint(foreign) != pt_cloud_fingerprint(opened));
        patina_cloud_destroy(foreign);
        points_free(&strange);
        for (uint32_t d = 0; d < support_device_count(); d++) {
            patina_device *device = support_device_open(support_device_name(d), 0, 0);
            if (!device)
                continue;
            patina_scene *one = scene_of(cloud, NULL), *other = scene_of(opened, NULL);
            struct picture a = draw(device, one, 0), b = draw(device, other, 0);
            picture_assert_identical(&b, &a, 0, 0, "opened");
            picture_free(&a);
            picture_free(&b);
            patina_scene_destroy(one);
            patina_scene_destroy(other);
            patina_device_destroy(device);
        }
        patina_cloud_destroy(cloud);
        patina_cloud_destroy(opened);
        points_free(&points);
    }
    FILE *file = fopen(path, "r+b");
    struct pcg random = pcg_seed(9);
    int refused = 0;
    for (int i = 0; i < 200; i++) { // a byte of the header or of a chunk: opened or refused, never a crash
        patina_cloud *opened = NULL;
        long at = (long)(pcg_u32(&random) % 200) + (i % 2 ? 65536 : 0);
        fseek(file, at, SEEK_SET);
        int was = fgetc(file);
        fseek(file, at, SEEK_SET);
        fputc(was ^ (int)(1 + pcg_u32(&random) % 255), file);
        fflush(file);
        int code = patina_cloud_open(path, &opened);
        assert_true(code == PATINA_OK || code == PATINA_ERROR_FORMAT || code == PATINA_ERROR_FILE);
        refused += code != PATINA_OK;
        patina_cloud_destroy(opened);
        fseek(file, at, SEEK_SET);
        fputc(was, file);
        fflush(file);
    }
    assert_true(refused > 190);
    assert_int_equal(ftruncate(fileno(file), 100000), 0);
    fclose(file);
    patina_cloud *opened = NULL;
    assert_int_equal(patina_cloud_open(path, &opened), PATINA_ERROR_FORMAT);
    unlink(path);
    assert_int_equal(patina_cloud_open(path, &opened), PATINA_ERROR_FILE);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_strata),
        cmocka_unit_test(test_strata_scattered),
        cmocka_unit_test(test_colors),
        cmocka_unit_test(test_saved),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
