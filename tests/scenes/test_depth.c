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
            const double off = ((double)picture->depth[y * SIZE + x] - (4.9 - sqrt(1.0 - square))) /
                               spacing; // z is from the near plane on
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
        print_message("  %4.1f points a pixel: points %+.3f, rms %.3f; surfaces %+.4f, rms %.3f spacings\n", densities[i],
                      bias[0], rms[0], bias[1], rms[1]);
        assert_true(fabs(bias[1]) <= 0.03);
        assert_true(rms[1] < 0.2 * rms[0]);
    }
    patina_device_destroy(device);
}

// A sphere of discs whose points lie off it by `noise` spacings: what the depth of surfaces is off by.
static double noisy_discs(patina_device *device, double density, double noise, uint32_t depth, double *bias)
{
    const double pixel = 3.0 / SIZE, area = area_sphere(1.0), eye[3] = {0, -5, 0}, target[3] = {0, 0, 0};
    const uint64_t count = (uint64_t)(density * area / (pixel * pixel));
    const double spacing = sqrt(area / (double)count);
    struct points points = points_sphere(count, 1.0, POINTS_NORMALS, 11);
    uint64_t state = 7;
    for (uint64_t i = 0; i < count; i++) {
        double sum = -6.0; // of twelve uniform numbers: nearly normal
        for (int k = 0; k < 12; k++) {
            state = state * 6364136223846793005u + 1442695040888963407u;
            sum += (double)(state >> 40) / 16777216.0;
        }
        for (int k = 0; k < 3; k++)
            points.position[3 * i + (uint64_t)k] *= (float)(1.0 + noise * spacing * sum);
    }
    patina_cloud_style style = {.struct_size = sizeof style, .cull_back = 1};
    struct stage stage = {.cloud = points_upload(&points), .settings = settings_default(SIZE, SIZE)};
    stage.scene = scene_of(stage.cloud, &style);
    stage.camera = camera_orthographic(eye, target, 3.0, SIZE, SIZE, 0.1, 100.0);
    stage.settings.surface = PATINA_SURFACE_SPLATS;
    stage.settings.depth = depth;
    struct picture picture = picture_render(device, stage.scene, &stage.camera, &stage.settings);
    const double rms = depth_error(&picture, spacing, bias);
    points_free(&points);
    picture_free(&picture);
    stage_free(&stage);
    return rms;
}

static void test_discs(void **state)
{
    (void)state;
    static const double densities[] = {1.0, 4.0, 16.0}, noises[] = {0.0, 0.5, 1.0};
    patina_device *device = support_device_first();
    for (int i = 0; i < 9; i++) {
        double bias[2], rms[2];
        for (uint32_t depth = 0; depth < 2; depth++)
            rms[depth] = noisy_discs(device, densities[i / 3], noises[i % 3], depth, &bias[depth]);
        print_message(
            "  discs, %4.1f points a pixel, noise of %.1f spacings: nearest %+.3f, rms %.3f; mean %+.4f, rms %.3f spacings\n",
            densities[i / 3], noises[i % 3], bias[0], rms[0], bias[1], rms[1]);
        assert_true(fabs(bias[1]) <= (noises[i % 3] > 0.0 ? 0.08 : 0.03));
        assert_true(rms[1] < 0.7);
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

// Nothing in view: nothing is read of what no pass wrote. (Discs crashed.)
static void test_nothing(void **state)
{
    (void)state;
    static const double eye[3] = {0, -5, 0}, away[3] = {0, -9, 0};
    static const uint32_t surfaces[] = {PATINA_SURFACE_SPLATS, PATINA_SURFACE_FILL, PATINA_SURFACE_RANGES};
    patina_device *device = support_device_first();
    for (int k = 0; k < 3; k++) {
        double spacing;
        struct stage stage = sphere(1.0, PATINA_DEPTH_SURFACE, &spacing);
        stage.camera = camera_perspective(eye, away, 45.0, SIZE, SIZE, 0.01, 1000.0);
        stage.settings.surface = surfaces[k];
        struct picture picture = picture_render(device, stage.scene, &stage.camera, &stage.settings);
        assert_int_equal(picture_count(&picture), 0);
        for (size_t i = 0; i < (size_t)SIZE * SIZE; i++)
            assert_true(isinf(picture.depth[i]));
        picture_free(&picture);
        stage_free(&stage);
    }
    patina_device_destroy(device);
}

// How far the picture's surface leaves the box of the points, in spacings.
static double leaves(const patina_cloud_info *info, const patina_camera *camera, const struct picture *picture)
{
    double most = 0.0;
    for (uint32_t y = 0; y < picture->height; y++)
        for (uint32_t x = 0; x < picture->width; x++) {
            const double z = (double)picture->depth[y * picture->width + x];
            double origin[3], direction[3];
            if (isinf(z))
                continue;
            camera_ray(camera, picture->width, picture->height, x + 0.5, y + 0.5, origin, direction);
            for (int k = 0; k < 3; k++) {
                const double place = origin[k] + z * direction[k];
                most = fmax(most, fmax(info->box_min[k] - place, place - info->box_max[k]));
            }
        }
    return most / info->spacing_max;
}

// What is filled lies where points are: at its rim a closed surface goes at most two spacings deeper than where it was measured, and
// half of one aside. (It was up to 83 spacings.)
static void test_within_the_cloud(void **state)
{
    (void)state;
    static const uint64_t counts[] = {300, 1000, 4000, 20000};
    static const double eye[3] = {0.3, -3.0, 1.3}, target[3] = {0, 0, 0};
    patina_device *device = support_device_first();
    for (int kind = 0; kind < 16; kind++) {
        const uint64_t count = counts[kind / 4];
        struct points points = kind & 1 ? points_torus(count, 1.0, 0.4, POINTS_NORMALS, 3)
                                        : points_sphere(count, 1.0, POINTS_NORMALS, 3);
        patina_cloud_style style = {.struct_size = sizeof style};
        patina_cloud_info info = {.struct_size = sizeof info};
        struct stage stage = {.cloud = points_upload(&points), .settings = settings_default(SIZE, SIZE)};
        if (kind & 2)
            assert_int_equal(patina_cloud_analyse(stage.cloud, NULL, NULL), PATINA_OK);
        stage.scene = scene_of(stage.cloud, &style);
        stage.camera = camera_perspective(eye, target, 45.0, SIZE, SIZE, 0.01, 1000.0);
        assert_int_equal(patina_cloud_get_info(stage.cloud, &info), PATINA_OK);
        struct picture picture = picture_render(device, stage.scene, &stage.camera, &stage.settings);
        const double most = leaves(&info, &stage.camera, &picture);
        print_message("  %s of %llu points%s: %.2f spacings beyond the cloud\n", kind & 1 ? "torus" : "sphere",
                      (unsigned long long)count, kind & 2 ? ", analysed" : "", most);
        assert_true(most <= 2.5);
        picture_free(&picture);
        points_free(&points);
        stage_free(&stage);
    }
    patina_device_destroy(device);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_bias), cmocka_unit_test(test_discs),
                                       cmocka_unit_test(test_parity_and_regions), cmocka_unit_test(test_nothing),
                                       cmocka_unit_test(test_within_the_cloud)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
