// SPDX-License-Identifier: GPL-3.0-or-later
// Samples step by step: what comes in the end is what comes at one go, to the bit; every step is nearer to it; what is cut off
// stays and goes on; noise is told as it is, and ends them.
#include "meshes.h"
#include "staging.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SIZE = 96 };

enum { FILLED, DISCS, TRIANGLES, KINDS };

static patina_mesh *box;

static struct stage stage_of(int kind, uint32_t size)
{
    const double eye[3] = {0.3, -2.7, 2.3}, middle[3] = {0, 0, 0}, half[3] = {0.71, 0.5, 0.63};
    struct stage stage = {.settings = settings_default(size, size)};
    if (kind == TRIANGLES) {
        CHECK(patina_scene_create(&stage.scene), NULL);
        mesh_add(stage.scene, box = mesh_box(middle, half), 0.5f, 0.25f, 0.125f);
    } else {
        struct points points = points_torus(20000, 1.0, 0.4, POINTS_ALL, 3);
        stage.cloud = points_upload(&points);
        stage.scene = scene_of(stage.cloud, NULL);
        points_free(&points);
    }
    stage.settings.surface = kind == DISCS ? PATINA_SURFACE_SPLATS : PATINA_SURFACE_FILL;
    stage.settings.film_transparent = 1;
    stage.camera = camera_perspective(eye, middle, 45.8, size, size, 0.1, 100.0);
    CHECK(patina_scene_set_camera(stage.scene, &stage.camera), stage.scene);
    return stage;
}

static void end_stage(struct stage *stage)
{
    stage_free(stage);
    patina_mesh_destroy(box);
    box = NULL;
}

static patina_frame_stats stats_of(const patina_frame *frame)
{
    patina_frame_stats stats = {.struct_size = sizeof stats};
    CHECK(patina_frame_get_stats(frame, &stats), frame);
    return stats;
}

static patina_frame *begin(patina_device *device, struct stage *stage)
{
    patina_frame *frame = NULL;
    stage->settings.pixel_progressive = 1;
    CHECK(patina_scene_set_settings(stage->scene, &stage->settings), stage->scene);
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, stage->scene), frame);
    return frame;
}

static struct picture at_one_go(patina_device *device, const struct stage *stage, uint32_t samples)
{
    patina_settings settings = stage->settings;
    settings.pixel_samples = samples;
    settings.pixel_progressive = 0;
    return picture_render(device, stage->scene, &stage->camera, &settings);
}

static double off(const struct picture *a, const struct picture *b)
{
    double sum = 0.0;
    for (size_t i = 0; i < 4 * (size_t)a->width * a->height; i++)
        sum += pow((double)a->combined[i] - (double)b->combined[i], 2.0);
    return sqrt(sum);
}

// Every step: its pictures' number, what is pending, and the distance to the end, which is that of one go.
static void test_steps(void **state)
{
    (void)state;
    static const uint32_t samples[] = {7, 16, 40};
    patina_device *device = support_device_first();
    for (int kind = 0; kind < KINDS; kind++)
        for (uint32_t s = 0; s < 3; s++) {
            struct stage stage = stage_of(kind, SIZE);
            struct picture whole = at_one_go(device, &stage, samples[s]), one = at_one_go(device, &stage, 1);
            stage.settings.pixel_samples = samples[s];
            patina_frame *frame = begin(device, &stage);
            struct picture picture = picture_read(frame);
            picture_assert_identical(&picture, &one, 0, 0, "the first sample");
            const double first = off(&picture, &whole);
            double last = first;
            uint32_t steps = 0, pending = stats_of(frame).pixel_pending;
            assert_int_equal(stats_of(frame).pixel_samples, 1);
            assert_true(pending > samples[s] / 2 && pending <= samples[s]);
            for (; stats_of(frame).pixel_pending; steps++) {
                picture_free(&picture);
                CHECK(patina_frame_refine(frame, stage.scene, 0.0), frame);
                assert_true(stats_of(frame).pixel_pending < pending);
                pending = stats_of(frame).pixel_pending;
                picture = picture_read(frame);
                last = pending && steps == 1 ? off(&picture, &whole) : last; // of four samples or five
            }
            print_message("  kind %d, %u samples: %u steps, off by %.2f at first, %.2f after two\n", kind, samples[s], steps,
                          first, last);
            assert_true(steps < 3 || last < 0.7 * first);
            assert_true(patina_frame_progress(frame) > 0.999f);
            picture_assert_identical(&picture, &whole, 0, 0, "steps and one go");
            assert_int_equal(patina_frame_refine(frame, stage.scene, 0.0), PATINA_ERROR_EMPTY);
            picture_free(&picture);
            picture_free(&whole);
            picture_free(&one);
            patina_frame_destroy(frame);
            end_stage(&stage);
        }
    patina_device_destroy(device);
}

// All devices and any threads: the same steps; a device's own picture each.
static void test_devices(void **state)
{
    (void)state;
    for (uint32_t k = 0; k < support_device_count(); k++)
        for (uint32_t threads = 1; threads < 4; threads += 2) {
            patina_device *device = support_device_open(support_device_name(k), threads, 0);
            if (!device)
                continue;
            struct stage stage = stage_of(FILLED, 48);
            struct picture whole = at_one_go(device, &stage, 5);
            stage.settings.pixel_samples = 5;
            patina_frame *frame = begin(device, &stage);
            while (stats_of(frame).pixel_pending)
                CHECK(patina_frame_refine(frame, stage.scene, 2.0), frame);
            struct picture picture = picture_read(frame);
            picture_assert_identical(&picture, &whole, 0, 0, support_device_name(k));
            picture_free(&picture);
            picture_free(&whole);
            patina_frame_destroy(frame);
            end_stage(&stage);
            patina_device_destroy(device);
        }
}

// Finer pixels that are drawn in bands: what is not drawn yet is of the picture before.
static void test_bands(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    struct stage stage = stage_of(DISCS, 640);
    struct picture one = at_one_go(device, &stage, 1), whole = at_one_go(device, &stage, 16);
    stage.settings.pixel_samples = 16;
    patina_frame *frame = begin(device, &stage);
    CHECK(patina_frame_refine(frame, stage.scene, 0.0), frame);
    assert_int_equal(stats_of(frame).pixel_pending, 16);
    struct picture picture = picture_read(frame);
    uint32_t row = 0;
    const size_t width = (size_t)4 * 640;
    while (row < 640 && !memcmp(picture.combined + row * width, whole.combined + row * width, width * sizeof(float)))
        row++;
    print_message("  %u of 640 rows after the first step\n", row);
    assert_true(row > 200 && row < 640);
    while (row < 640 && !memcmp(picture.combined + row * width, one.combined + row * width, width * sizeof(float)))
        row++;
    assert_int_equal(row, 640);
    picture_free(&picture);
    CHECK(patina_frame_refine(frame, stage.scene, 1e9), frame);
    picture = picture_read(frame);
    picture_assert_identical(&picture, &whole, 0, 0, "bands");
    picture_free(&picture);
    picture_free(&whole);
    picture_free(&one);
    patina_frame_destroy(frame);
    end_stage(&stage);
    patina_device_destroy(device);
}

// What is cut off keeps what it has, keys too, and goes on to the same end.
static void test_cut_off(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    struct stage stage = stage_of(FILLED, SIZE);
    struct picture whole = at_one_go(device, &stage, 12);
    stage.settings.pixel_samples = 12;
    patina_frame *frame = begin(device, &stage);
    CHECK(patina_frame_refine(frame, stage.scene, 0.0), frame);
    struct picture before = picture_read(frame);
    patina_frame_cancel(frame);
    assert_int_equal(patina_frame_refine(frame, stage.scene, 1e9), PATINA_ERROR_CANCELLED);
    struct picture then = picture_read(frame);
    picture_assert_identical(&then, &before, 0, 0, "what was cut off");
    assert_true(stats_of(frame).pixel_pending > 0);
    while (stats_of(frame).pixel_pending)
        CHECK(patina_frame_refine(frame, stage.scene, 0.0), frame);
    picture_free(&then);
    then = picture_read(frame);
    picture_assert_identical(&then, &whole, 0, 0, "what went on");
    picture_free(&then);
    picture_free(&before);
    picture_free(&whole);
    patina_frame_destroy(frame);
    end_stage(&stage);
    patina_device_destroy(device);
}

static void test_refusals(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    struct stage stage = stage_of(FILLED, SIZE);
    patina_frame *frame = begin(device, &stage); // one sample
    assert_int_equal(patina_frame_refine(frame, stage.scene, 0.0), PATINA_ERROR_EMPTY);
    assert_int_equal(patina_frame_refine(NULL, stage.scene, 0.0), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_frame_refine(frame, stage.scene, (double)NAN), PATINA_ERROR_ARGUMENT);
    stage.settings.pixel_samples = 8;
    CHECK(patina_scene_set_settings(stage.scene, &stage.settings), stage.scene);
    CHECK(patina_frame_render(frame, stage.scene), frame);
    stage.settings.pixel_samples = 9;
    CHECK(patina_scene_set_settings(stage.scene, &stage.settings), stage.scene);
    assert_int_equal(patina_frame_refine(frame, stage.scene, 0.0), PATINA_ERROR_ARGUMENT);
    patina_frame_cancel(frame); // another picture ends it, though it fails
    assert_int_equal(patina_frame_render(frame, stage.scene), PATINA_ERROR_CANCELLED);
    assert_int_equal(stats_of(frame).pixel_pending, 0);
    assert_int_equal(patina_frame_refine(frame, stage.scene, 0.0), PATINA_ERROR_EMPTY);
    stage.settings.pixel_noise = -1.0f;
    assert_int_equal(patina_scene_set_settings(stage.scene, &stage.settings), PATINA_ERROR_ARGUMENT);
    stage.settings.pixel_noise = 0.0f;
    stage.settings.pixel_progressive = 2;
    assert_int_equal(patina_scene_set_settings(stage.scene, &stage.settings), PATINA_ERROR_ARGUMENT);
    patina_frame_destroy(frame);
    end_stage(&stage);
    patina_device_destroy(device);
}

// Levels as sRGB's of the colours that are off most, root mean square over pixels that differ at all.
static double levels_off(const struct picture *a, const struct picture *b)
{
    double sum = 0.0, pixels = 0.0;
    for (size_t i = 0; i < (size_t)a->width * a->height; i++) {
        double most = 0.0;
        for (int k = 0; k < 3; k++) {
            double level[2];
            for (int j = 0; j < 2; j++)
                level[j] = srgb_of_linear(fmin(fmax((double)(j ? b : a)->combined[4 * i + k], 0.0), 1.0));
            most = fmax(most, fabs(level[0] - level[1]));
        }
        sum += most * most;
        pixels += most > 0.0;
    }
    return sqrt(sum / pixels);
}

// The error that a picture says of itself, against a thousand samples: never half of what it is, nor thrice.
static void test_noise(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    for (int kind = 0; kind < KINDS; kind++) {
        struct stage stage = stage_of(kind, 64);
        stage.settings.film_transparent = 0;
        stage.settings.world_color[0] = stage.settings.world_color[1] = stage.settings.world_color[2] = 0.5f;
        stage.settings.pixel_noise = 1e-6f; // none gets there: the grid is that of noise
        struct picture much = at_one_go(device, &stage, 1024);
        for (uint32_t samples = 16; samples <= 256; samples *= 4) {
            stage.settings.pixel_samples = samples;
            patina_frame *frame = begin(device, &stage);
            CHECK(patina_frame_refine(frame, stage.scene, 1e9), frame);
            struct picture picture = picture_read(frame);
            const double told = (double)stats_of(frame).pixel_error, is = levels_off(&picture, &much);
            print_message("  kind %d, %u samples: noise %.5f told, %.5f found\n", kind, samples, told, is);
            assert_true(told > 0.5 * is && told < 3.0 * is);
            picture_free(&picture);
            patina_frame_destroy(frame);
        }
        picture_free(&much);
        end_stage(&stage);
    }
    patina_device_destroy(device);
}

// A target ends them, early and by itself, in steps as at one go; without a number at 256.
static void test_target(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    static const float targets[] = {0.03f, 0.015f, 0.0075f};
    for (int kind = 0; kind < KINDS; kind++) {
        uint32_t taken = 3;
        for (uint32_t t = 0; t < 3; t++) {
            struct stage stage = stage_of(kind, SIZE);
            stage.settings.pixel_noise = targets[t];
            struct picture whole = at_one_go(device, &stage, 0);
            patina_frame *frame = begin(device, &stage);
            while (stats_of(frame).pixel_pending)
                CHECK(patina_frame_refine(frame, stage.scene, 0.0), frame);
            const patina_frame_stats stats = stats_of(frame);
            struct picture picture = picture_read(frame);
            print_message("  kind %d, target %.4f: %u samples, %.4f\n", kind, (double)targets[t], stats.pixel_samples,
                          (double)stats.pixel_error);
            assert_true(stats.pixel_error > 0.0f && (stats.pixel_error <= targets[t] || stats.pixel_samples > 200));
            assert_true(stats.pixel_samples >= taken && stats.pixel_samples <= 256 && (t || stats.pixel_samples < 200));
            picture_assert_identical(&picture, &whole, 0, 0, "a noise target");
            taken = stats.pixel_samples;
            picture_free(&picture);
            picture_free(&whole);
            patina_frame_destroy(frame);
            end_stage(&stage);
        }
    }
    patina_device_destroy(device);
}

// Soft shadows that are refined first: then the pixels' samples, and the same end.
static void test_shadows(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    struct stage stage = stage_of(FILLED, 64);
    patina_light_desc sun = {.struct_size = sizeof sun, .type = PATINA_LIGHT_SUN, .power = 3.0f, .angle = 0.5f, .shadows = 1};
    sun.direction[0] = 1.0, sun.direction[2] = -0.5;
    CHECK(patina_scene_add_light(stage.scene, &sun), stage.scene);
    patina_cloud_style style = {.struct_size = sizeof style, .lighting = PATINA_LIGHTING_LIT};
    CHECK(patina_scene_add_cloud(stage.scene, stage.cloud, &style), stage.scene);
    stage.settings.shadow_samples = 8;
    struct picture whole = at_one_go(device, &stage, 4);
    stage.settings.pixel_samples = 4;
    stage.settings.shadow_progressive = 1;
    patina_frame *frame = begin(device, &stage);
    assert_true(stats_of(frame).shadow_pending > 0);
    while (stats_of(frame).shadow_pending) {
        assert_int_equal(stats_of(frame).pixel_samples, 1);
        CHECK(patina_frame_refine(frame, stage.scene, 0.0), frame);
    }
    assert_int_equal(stats_of(frame).pixel_samples, 1);
    assert_true(stats_of(frame).pixel_pending > 0);
    CHECK(patina_frame_refine(frame, stage.scene, 1e9), frame);
    struct picture picture = picture_read(frame);
    picture_assert_identical(&picture, &whole, 0, 0, "after shadows");
    picture_free(&picture);
    picture_free(&whole);
    patina_frame_destroy(frame);
    end_stage(&stage);
    patina_device_destroy(device);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_steps),   cmocka_unit_test(test_devices),  cmocka_unit_test(test_bands),
        cmocka_unit_test(test_cut_off), cmocka_unit_test(test_refusals), cmocka_unit_test(test_noise),
        cmocka_unit_test(test_target),  cmocka_unit_test(test_shadows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
