// SPDX-License-Identifier: GPL-3.0-or-later
// Averages of the points about a surface: truer than the nearest point where several fall into a pixel, steadier while the object
// turns. Keys and depths as without; equal on all devices, for any threads; a region is the crop of the whole.
#include "staging.h"
#include "tolerances.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIZE = 128 };

// What a sphere of radius 1 is painted with, by place: stripes, eight pixels wide at least.
static double paint(const double p[3]) { return 0.5 + 0.45 * sin(14.0 * p[0]) * cos(11.0 * p[2]); }

// Turned about z by an angle.
static struct stage painted_sphere(double density, double angle, uint32_t average)
{
    const double pixel = 3.0 / SIZE, area = area_sphere(1.0), c = cos(angle), s = sin(angle);
    const uint64_t count = (uint64_t)(density * area / (pixel * pixel));
    struct points points = points_sphere(count, 1.0, POINTS_NORMALS, 11);
    float *colors = malloc((size_t)count * 12);
    assert_non_null(colors);
    for (uint64_t i = 0; i < count; i++) {
        const double p[3] = {points.position[3 * i], points.position[3 * i + 1], points.position[3 * i + 2]};
        for (uint64_t k = 0; k < 3; k++)
            colors[3 * i + k] = (float)paint(p);
    }
    patina_cloud_desc desc = points_desc(&points);
    desc.color = (patina_array){.data = colors, .type = PATINA_FLOAT32, .components = 3};
    patina_cloud_style style = {.struct_size = sizeof style, .cull_back = 1};
    const double turned[16] = {c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    memcpy(style.world_from_object, turned, sizeof turned);
    struct stage stage = {0};
    CHECK(patina_cloud_create(&desc, NULL, &stage.cloud), NULL);
    const double eye[3] = {0, -5, 0}, target[3] = {0, 0, 0};
    stage.scene = scene_of(stage.cloud, &style);
    stage.camera = camera_orthographic(eye, target, 3.0, SIZE, SIZE, 0.1, 100.0);
    stage.settings = settings_default(SIZE, SIZE);
    stage.settings.average = average;
    free(colors);
    points_free(&points);
    return stage;
}

// The picture less the paint that lies in the middle of its pixels, to 84 % of the radius; elsewhere 0. Returns how many are not.
static uint32_t differences(const struct picture *picture, double angle, double *off)
{
    uint32_t count = 0;
    for (uint32_t y = 0; y < SIZE; y++)
        for (uint32_t x = 0; x < SIZE; x++) {
            const double u = 3.0 * (x + 0.5) / SIZE - 1.5, v = 3.0 * (y + 0.5) / SIZE - 1.5, square = u * u + v * v;
            off[y * SIZE + x] = 0.0;
            if (square > 0.7)
                continue;
            const double w = -sqrt(1.0 - square), p[3] = {cos(angle) * u + sin(angle) * w, cos(angle) * w - sin(angle) * u, v};
            off[y * SIZE + x] = (double)picture->combined[4 * (y * SIZE + x)] - paint(p);
            count++;
        }
    return count;
}

static double root_mean_square(const double *a, const double *less, uint32_t count)
{
    double squares = 0.0;
    for (size_t i = 0; i < (size_t)SIZE * SIZE; i++)
        squares += (a[i] - (less ? less[i] : 0.0)) * (a[i] - (less ? less[i] : 0.0));
    return sqrt(squares / count);
}

static void test_truer_and_steadier(void **state)
{
    (void)state;
    static const struct {
        double density, error, flicker; // at most so much of what they are without
    } cases[] = {{0.2, 0.65, 0.75}, {1.0, 0.5, 0.3}, {4.0, 0.5, 0.3}, {16.0, 0.5, 0.3}};
    const double step = 0.05 * 3.14159265358979323846 / 180.0;
    static double off[2][SIZE * SIZE];
    patina_device *device = support_device_first();
    for (int i = 0; i < 4; i++) {
        double error[2], flicker[2];
        struct picture plain = {0};
        for (uint32_t average = 0; average < 2; average++) {
            uint32_t count = 0;
            for (int frame = 0; frame < 2; frame++) {
                struct stage stage = painted_sphere(cases[i].density, frame * step, average);
                struct picture picture = picture_render(device, stage.scene, &stage.camera, &stage.settings);
                count = differences(&picture, frame * step, off[frame]);
                if (average && !frame) { // what is seen, and how deep, is not touched
                    assert_memory_equal(picture.keys, plain.keys, SIZE * SIZE * sizeof *plain.keys);
                    assert_memory_equal(picture.depth, plain.depth, SIZE * SIZE * sizeof *plain.depth);
                    assert_memory_equal(picture.source, plain.source, SIZE * SIZE * sizeof *plain.source);
                }
                if (!average && !frame)
                    plain = picture;
                else
                    picture_free(&picture);
                stage_free(&stage);
            }
            error[average] = 255.0 * root_mean_square(off[0], NULL, count);
            flicker[average] = 255.0 * root_mean_square(off[1], off[0], count);
        }
        picture_free(&plain);
        print_message("  %4.1f points a pixel: off by %.2f, flickers by %.2f levels; averages %.2f, %.2f\n", cases[i].density,
                      error[0], flicker[0], error[1], flicker[1]);
        assert_true(error[1] < cases[i].error * error[0]);
        assert_true(flicker[1] < cases[i].flicker * flicker[0]);
        assert_true(flicker[1] < 0.5 || cases[i].density < 2.0);
    }
    patina_device_destroy(device);
}

// The same bytes on every processor's level and for any threads, colours within the table on others; a region is the crop.
static void test_parity_and_regions(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < staging_count; i++) {
        struct picture first = {0};
        struct stage stage = stage_build(&stagings[i]);
        stage.settings.average = 1;
        const uint32_t w = stage.settings.width, h = stage.settings.height;
        for (uint32_t k = 0; k < support_device_count() && w <= 203; k++) {
            const char *name = support_device_name(k);
            patina_device *device = support_device_open(name, k % 2 ? 3 : 0, 0);
            if (!device)
                continue;
            memset(stage.settings.region, 0, sizeof stage.settings.region);
            struct picture whole = picture_render(device, stage.scene, &stage.camera, &stage.settings);
            if (first.keys && !support_is_gl(name))
                picture_assert_identical(&whole, &first, 0, 0, stagings[i].name);
            for (size_t p = 0; first.keys && p < 4 * (size_t)w * h; p++)
                if (!(fabs((double)whole.combined[p] - (double)first.combined[p]) <= 10.0 * TOL_COLOR))
                    support_die("%s, %s: colour at pixel %zu is %.9g, the first device has %.9g", name, stagings[i].name, p / 4,
                                (double)whole.combined[p], (double)first.combined[p]);
            const uint32_t region[4] = {w / 3, h / 4, w - w / 5, h - h / 3};
            memcpy(stage.settings.region, region, sizeof region);
            struct picture part = picture_render(device, stage.scene, &stage.camera, &stage.settings);
            picture_assert_identical(&part, &whole, region[0], region[1], stagings[i].name);
            picture_free(&part);
            if (first.keys)
                picture_free(&whole);
            else
                first = whole;
            patina_device_destroy(device);
        }
        picture_free(&first);
        stage_free(&stage);
    }
}

// Points of their own opacity show the nearest one's colour, and so do ramps: the plan says why.
static void test_left_out(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    struct stage stage = painted_sphere(1.0, 0.0, 0);
    char text[8192];
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_scene_set_camera(stage.scene, &stage.camera), stage.scene);
    for (uint32_t average = 0; average < 2; average++) {
        stage.settings.average = average;
        CHECK(patina_scene_set_settings(stage.scene, &stage.settings), stage.scene);
        assert_true(patina_frame_plan_text(frame, stage.scene, text, sizeof text) < sizeof text);
        assert_non_null(strstr(text, average ? "run  average" : "skip average    the settings ask for the nearest points"));
    }
    stage.settings.average = 2;
    assert_int_equal(patina_scene_set_settings(stage.scene, &stage.settings), PATINA_ERROR_ARGUMENT);
    patina_frame_destroy(frame);
    stage_free(&stage);
    patina_device_destroy(device);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_truer_and_steadier), cmocka_unit_test(test_parity_and_regions),
                                       cmocka_unit_test(test_left_out)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
