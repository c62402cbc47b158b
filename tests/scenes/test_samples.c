// SPDX-License-Identifier: GPL-3.0-or-later
// Samples of a pixel: a region is the crop of the whole to the bit, in bands too; threads change nothing; keys and data are those
// of one sample; an outline is soft and covers what it should; what fails leaves the last picture.
#include "meshes.h"
#include "staging.h"

#include <math.h>
#include <pthread.h>
#include <sched.h>
#include <stdio.h>
#include <string.h>

static void compare_region(patina_device *device, const struct stage *stage, const patina_settings *wanted,
                           const struct picture *whole, const uint32_t region[4], const char *name)
{
    patina_settings settings = *wanted;
    memcpy(settings.region, region, sizeof settings.region);
    struct picture part = picture_render(device, stage->scene, &stage->camera, &settings);
    char what[128];
    snprintf(what, sizeof what, "%s, %u samples, from %u %u on", name, settings.pixel_samples, region[0], region[1]);
    picture_assert_identical(&part, whole, region[0], region[1], what);
    picture_free(&part);
}

static void test_regions(void **state)
{
    (void)state;
    static const uint32_t some[] = {2, 9}; // shifts; finer pixels where points lie as dense or are discs
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = strncmp(support_device_name(k), "cpu-", 4) ? support_device_open(support_device_name(k), 0, 0)
                                                                           : NULL;
        for (uint32_t i = 0; device && i < staging_count; i++) {
            if (stagings[i].width > 203 || (support_is_gl(support_device_name(k)) && i % 5 != 3))
                continue;
            struct stage stage = stage_build(&stagings[i]);
            const uint32_t w = stage.settings.width, h = stage.settings.height;
            for (uint32_t s = 0; s < 2; s++) {
                patina_settings settings = stage.settings;
                settings.pixel_samples = some[s];
                struct picture whole = picture_render(device, stage.scene, &stage.camera, &settings);
                compare_region(device, &stage, &settings, &whole, (uint32_t[4]){w / 3, h / 4, w - w / 5, h - h / 3},
                               stagings[i].name);
                compare_region(device, &stage, &settings, &whole, (uint32_t[4]){0, h / 2, w, h / 2 + 1}, stagings[i].name);
                picture_free(&whole);
            }
            stage_free(&stage);
        }
        if (device)
            patina_device_destroy(device);
    }
}

// So many finer pixels that they are drawn in bands, which begin elsewhere in a region.
static void test_bands(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    struct points points = points_torus(30000, 1.0, 0.4, POINTS_ALL, 3);
    struct stage stage = {.cloud = points_upload(&points)};
    const double eye[3] = {0.3, -2.7, 2.3}, target[3] = {0, 0, 0};
    stage.scene = scene_of(stage.cloud, NULL);
    stage.camera = camera_perspective(eye, target, 45.8, 640, 640, 0.1, 100.0);
    stage.settings = settings_default(640, 640);
    stage.settings.surface = PATINA_SURFACE_SPLATS;
    stage.settings.pixel_samples = 16;
    struct picture whole = picture_render(device, stage.scene, &stage.camera, &stage.settings);
    compare_region(device, &stage, &stage.settings, &whole, (uint32_t[4]){100, 37, 500, 600}, "bands");
    picture_free(&whole);
    points_free(&points);
    stage_free(&stage);
    patina_device_destroy(device);
}

static struct stage sphere(uint32_t size, uint64_t count)
{
    struct points points = points_sphere(count, 1.0, POINTS_NORMALS, 7);
    patina_cloud_style style = {.struct_size = sizeof style, .lighting = PATINA_LIGHTING_UNLIT, .cull_back = 1};
    struct stage stage = {.cloud = points_upload(&points)};
    const double eye[3] = {0, -5, 0}, target[3] = {0, 0, 0};
    stage.scene = scene_of(stage.cloud, &style);
    stage.camera = camera_orthographic(eye, target, 3.0, size, size, 0.1, 100.0);
    stage.settings = settings_default(size, size);
    stage.settings.film_transparent = 1;
    points_free(&points);
    return stage;
}

static void test_threads(void **state)
{
    (void)state;
    struct stage stage = sphere(96, 40000);
    struct picture first = {0};
    stage.settings.pixel_samples = 12;
    for (uint32_t threads = 1; threads < 6; threads += 2) {
        patina_device *device = support_device_open("cpu", threads, 0);
        struct picture picture = picture_render(device, stage.scene, &stage.camera, &stage.settings);
        if (first.keys) {
            picture_assert_identical(&picture, &first, 0, 0, "samples with other threads");
            picture_free(&picture);
        } else {
            first = picture;
        }
        patina_device_destroy(device);
    }
    picture_free(&first);
    stage_free(&stage);
}

// The disc that a sphere is: every pixel's alpha against its exact share, with more samples nearer to it.
static double alpha_error(const struct picture *picture, double radius)
{
    double sum = 0.0, count = 0.0;
    for (uint32_t y = 0; y < picture->height; y++)
        for (uint32_t x = 0; x < picture->width; x++) {
            double share = 0.0, middle = 0.5 * picture->width;
            for (int i = 0; i < 64; i++)
                share += hypot(x + (i % 8 + 0.5) / 8 - middle, y + (i / 8 + 0.5) / 8 - middle) < radius ? 1.0 / 64 : 0.0;
            const double off = (double)picture->combined[4 * ((size_t)y * picture->width + x) + 3] - share;
            sum += off * off;
            count += share > 0.0 && share < 1.0;
        }
    return sqrt(sum / count);
}

static void test_outline(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    static const uint32_t surfaces[] = {PATINA_SURFACE_FILL, PATINA_SURFACE_SPLATS};
    for (uint32_t i = 0; i < 2; i++) {
        struct stage stage = sphere(128, 4 * 3 * 128 * 128 / 2); // about 4 points a pixel
        double last = 1.0;
        struct picture one = {0};
        for (uint32_t samples = 1; samples <= 64; samples *= 4) {
            stage.settings.surface = surfaces[i];
            stage.settings.pixel_samples = samples;
            struct picture picture = picture_render(device, stage.scene, &stage.camera, &stage.settings);
            const double error = alpha_error(&picture, 128 / 3.0);
            print_message("  %s, %u samples: alpha off by %.3f rms along the outline\n", i ? "discs" : "filled", samples,
                          error);
            assert_true(error < last * 1.05);
            assert_true(samples < 16 || error < 0.10);
            last = error;
            if (!one.keys) {
                one = picture;
                continue;
            }
            for (size_t k = 0; k < (size_t)128 * 128; k++) { // all but the colour: as with one
                assert_true(one.keys[k] == picture.keys[k]);
                assert_memory_equal(&one.depth[k], &picture.depth[k], sizeof(float));
                assert_memory_equal(&one.normal[3 * k], &picture.normal[3 * k], 3 * sizeof(float));
                assert_memory_equal(&one.source[k], &picture.source[k], sizeof(float));
            }
            picture_free(&picture);
        }
        picture_free(&one);
        stage_free(&stage);
    }
    patina_device_destroy(device);
}

// Triangles alone: sixteen samples cover what they cover, to a sixteenth of a pixel of their border.
static void test_meshes(void **state)
{
    (void)state;
    const double eye[3] = {0, -5, 0}, target[3] = {0, 0, 0}, middle[3] = {0, 0, 0}, half[3] = {0.71, 0.5, 0.63};
    patina_device *device = support_device_first();
    patina_mesh *mesh = mesh_box(middle, half);
    struct stage stage = {.settings = settings_default(64, 64)};
    assert_int_equal(patina_scene_create(&stage.scene), PATINA_OK);
    mesh_add(stage.scene, mesh, 0.5f, 0.25f, 0.125f);
    stage.camera = camera_orthographic(eye, target, 3.0, 64, 64, 0.1, 100.0);
    stage.settings.film_transparent = 1;
    const double width = 1.42 / 3.0 * 64, height = 1.26 / 3.0 * 64;
    for (uint32_t samples = 1; samples <= 16; samples *= 16) {
        stage.settings.pixel_samples = samples;
        struct picture picture = picture_render(device, stage.scene, &stage.camera, &stage.settings);
        double alpha = 0.0;
        for (size_t k = 0; k < (size_t)64 * 64; k++)
            alpha += (double)picture.combined[4 * k + 3];
        print_message("  a box, %u samples: covers %.1f pixels of %.1f\n", samples, alpha, width * height);
        assert_true(samples < 16 || fabs(alpha - width * height) < 2.0 * (width + height) / 16.0);
        picture_free(&picture);
    }
    patina_scene_destroy(stage.scene);
    patina_mesh_destroy(mesh);
    patina_device_destroy(device);
}

static double mean_light(const struct picture *picture)
{
    double sum = 0.0;
    for (size_t k = 0; k < 4 * (size_t)picture->width * picture->height; k++)
        sum += (double)picture->combined[k];
    return sum / ((double)picture->width * picture->height);
}

// What is measured in pixels is as wide and as dark in finer ones.
static void test_looks(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    for (int look = 0; look < 3; look++) {
        struct stage stage = sphere(128, 12 * 128 * 128);
        patina_effects effects = {.struct_size = sizeof effects};
        patina_lines lines = {.struct_size = sizeof lines, .width = 4.0f, .color = {1.0f, 0.0f, 0.0f}};
        effects.edl_strength = look == 0 ? 2.0f : 0.0f;
        effects.edl_radius = 3.0f;
        effects.hatch_levels = look == 1 ? 2 : 0;
        CHECK(patina_scene_set_effects(stage.scene, &effects), stage.scene);
        CHECK(patina_scene_set_lines(stage.scene, look == 2 ? &lines : NULL), stage.scene);
        double light[2];
        for (uint32_t i = 0; i < 2; i++) {
            stage.settings.pixel_samples = i ? 9 : 1;
            struct picture picture = picture_render(device, stage.scene, &stage.camera, &stage.settings);
            light[i] = mean_light(&picture);
            picture_free(&picture);
        }
        print_message("  look %d: light %.4f with one sample, %.4f with nine\n", look, light[0], light[1]);
        assert_true(fabs(light[1] / light[0] - 1.0) < 0.02);
        stage_free(&stage);
    }
    patina_device_destroy(device);
}

static void test_failures(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    struct stage stage = sphere(64, 20000);
    patina_frame *frame = NULL;
    static float first[64 * 64 * 4], then[64 * 64 * 4];
    CHECK(patina_scene_set_camera(stage.scene, &stage.camera), stage.scene);
    CHECK(patina_scene_set_settings(stage.scene, &stage.settings), stage.scene);
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, stage.scene), frame);
    CHECK(patina_frame_read(frame, PATINA_PASS_COMBINED, first, sizeof first), frame);
    stage.settings.pixel_samples = 16;
    CHECK(patina_scene_set_settings(stage.scene, &stage.settings), stage.scene);
    patina_frame_cancel(frame);
    assert_int_equal(patina_frame_render(frame, stage.scene), PATINA_ERROR_CANCELLED);
    CHECK(patina_frame_read(frame, PATINA_PASS_COMBINED, then, sizeof then), frame);
    assert_memory_equal(first, then, sizeof first);
    CHECK(patina_frame_render(frame, stage.scene), frame);
    assert_true(patina_frame_progress(frame) > 0.999f);
    CHECK(patina_frame_read(frame, PATINA_PASS_COMBINED, then, sizeof then), frame);
    assert_memory_not_equal(first, then, sizeof first);
    stage.settings.pixel_samples = 4097;
    assert_int_equal(patina_scene_set_settings(stage.scene, &stage.settings), PATINA_ERROR_ARGUMENT);
    patina_frame_destroy(frame);
    stage_free(&stage);
    patina_device_destroy(device);
}

static void *cancel_later(void *context) // within the samples
{
    patina_frame *frame = context;
    while (patina_frame_progress(frame) < 0.02f || patina_frame_progress(frame) > 0.9f)
        sched_yield();
    patina_frame_cancel(frame);
    return NULL;
}

// Samples that are cut off leave every pass of the last picture, trust too, which the samples themselves do not make.
static void test_cut_off(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    struct stage stage = sphere(64, 20000);
    patina_frame *frame = NULL;
    pthread_t thread;
    static float first[64 * 64], then[64 * 64];
    CHECK(patina_cloud_analyse(stage.cloud, NULL, NULL), stage.cloud);
    stage.settings.passes |= 1u << PATINA_PASS_TRUST;
    CHECK(patina_scene_set_camera(stage.scene, &stage.camera), stage.scene);
    CHECK(patina_scene_set_settings(stage.scene, &stage.settings), stage.scene);
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, stage.scene), frame);
    CHECK(patina_frame_read(frame, PATINA_PASS_TRUST, first, sizeof first), frame);
    stage.settings.pixel_samples = 4096;
    CHECK(patina_scene_set_settings(stage.scene, &stage.settings), stage.scene);
    assert_int_equal(pthread_create(&thread, NULL, cancel_later, frame), 0);
    assert_int_equal(patina_frame_render(frame, stage.scene), PATINA_ERROR_CANCELLED);
    pthread_join(thread, NULL);
    CHECK(patina_frame_read(frame, PATINA_PASS_TRUST, then, sizeof then), frame);
    assert_true(first[64 * 32 + 32] > 0.0f);
    assert_memory_equal(first, then, sizeof first);
    patina_frame_destroy(frame);
    stage_free(&stage);
    patina_device_destroy(device);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_regions),  cmocka_unit_test(test_bands),   cmocka_unit_test(test_threads),
        cmocka_unit_test(test_outline),  cmocka_unit_test(test_meshes),  cmocka_unit_test(test_looks),
        cmocka_unit_test(test_failures), cmocka_unit_test(test_cut_off),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
