// SPDX-License-Identifier: GPL-3.0-or-later
// The depth pass of surfaces: z in the middle of the pixel, where that of points is nearer by what the pixel spans. Bit-equal on
// all devices, a region is the crop of the whole; keys stay the points'.
#include "staging.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIZE = 128 };

static struct stage sphere(double density, uint32_t depth, double *spacing)
{
    const double pixel = 3.0 / SIZE, area = area_sphere(1.0);
    const uint64_t count = (uint64_t)(density * area / (pixel * pixel));
    struct points points = points_sphere(count, 1.0, POINTS_NORMALS, 11);
    patina_cloud_style style = {.struct_size = sizeof style, .cull_back = 1};
    struct stage stage = {.cloud = points_upload(&points)};
    const double eye[3] = {0, -5, 0}, target[3] = {0, 0, 0};
    stage.scene = scene_of(stage.cloud, &style);
    stage.camera = camera_orthographic(eye, target, 3.0, SIZE, SIZE, 0.1, 100.0);
    stage.settings = settings_default(SIZE, SIZE);
    stage.settings.depth = depth;
    points_free(&points);
    *spacing = sqrt(area / (double)count);
    return stage;
}

// Mean and root mean square of what the depth is off by, spacings, to 84 % of the radius: 57 degrees.
static double depth_error(const struct picture *picture, double spacing, double *bias)
{
    double sum = 0.0, squares = 0.0, count = 0.0;
    for (uint32_t y = 0; y < SIZE; y++)
        for (uint32_t x = 0; x < SIZE; x++) {
            const double u = 3.0 * (x + 0.5) / SIZE - 1.5, v = 3.0 * (y + 0.5) / SIZE - 1.5, square = u * u + v * v;
            if (square > 0.7)
                continue;
            const double off = ((double)picture->depth[y * SIZE + x] - (4.9 - sqrt(1.0 - square))) / spacing; // z is from the near plane on
            sum += off;
            squares += off * off;
            count += 1.0;
        }
    *bias = sum / count;
    return sqrt(squares / count);
}

static void test_bias(void **state)
{
    (void)state;
    static const double densities[] = {1.0, 4.0, 16.0};
    patina_device *device = support_device_first();
    for (int i = 0; i < 3; i++) {
        double bias[2], rms[2];
        for (uint32_t depth = 0; depth < 2; depth++) {
            double spacing;
            struct stage stage = sphere(densities[i], depth, &spacing);
            struct picture picture = picture_render(device, stage.scene, &stage.camera, &stage.settings);
            rms[depth] = depth_error(&picture, spacing, &bias[depth]);
            if (!depth)
                for (size_t k = 0; k < (size_t)SIZE * SIZE; k++)
                    assert_true(picture.depth[k] == key_z(picture.keys[k]));
            picture_free(&picture);
            stage_free(&stage);
        }
        print_message("  %4.1f points a pixel: points %+.3f, rms %.3f; surfaces %+.4f, rms %.3f spacings\n", densities[i], bias[0],
                      rms[0], bias[1], rms[1]);
        assert_true(fabs(bias[1]) <= 0.03);
        assert_true(rms[1] < 0.2 * rms[0]);
    }
    patina_device_destroy(device);
}

static void test_parity_and_regions(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < staging_count; i++) {
        float *first = NULL;
        struct stage stage = stage_build(&stagings[i]);
        stage.settings.depth = PATINA_DEPTH_SURFACE;
        const uint32_t w = stage.settings.width, h = stage.settings.height;
        for (uint32_t k = 0; k < support_device_count() && w <= 203; k++) {
            patina_device *device = support_device_open(support_device_name(k), 0, 0);
            if (!device)
                continue;
            memset(stage.settings.region, 0, sizeof stage.settings.region);
            struct picture whole = picture_render(device, stage.scene, &stage.camera, &stage.settings);
            if (first)
                assert_memory_equal(first, whole.depth, (size_t)w * h * sizeof *first);
            const uint32_t region[4] = {w / 3, h / 4, w - w / 5, h - h / 3};
            memcpy(stage.settings.region, region, sizeof region);
            struct picture part = picture_render(device, stage.scene, &stage.camera, &stage.settings);
            picture_assert_identical(&part, &whole, region[0], region[1], stagings[i].name);
            picture_free(&part);
            if (!first) {
                first = whole.depth;
                whole.depth = NULL;
            }
            picture_free(&whole);
            patina_device_destroy(device);
        }
        free(first);
        stage_free(&stage);
    }
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_bias), cmocka_unit_test(test_parity_and_regions)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
