// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces one behind the other at 1.5 spacings: how much of the inner one shows, where the analysis tells them apart
// (SPEC 1, effective layer distance). Two spheres, the outer red, the inner blue, on every device.
#include "clouds.h"
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SIZE = 240 };
static const double distance = 4.0, fov = 35.0, gap = 1.5; // spacings

// density: points a pixel where the sphere is nearest.
static patina_cloud *spheres(double density)
{
    const double pixel = 2.0 * tan(0.5 * fov * M_PI / 180.0) * (distance - 1.0) / SIZE, spacing = pixel / sqrt(density);
    const double inner = 1.0 - gap * spacing;
    struct points a = points_sphere((uint64_t)(area_sphere(1.0) / (spacing * spacing)), 1.0, POINTS_ALL, 1);
    struct points b = points_sphere((uint64_t)(area_sphere(inner) / (spacing * spacing)), inner, POINTS_ALL, 2);
    struct points all = points_create(a.count + b.count, POINTS_ALL);
    memcpy(all.position, a.position, a.count * 12);
    memcpy(all.normal, a.normal, a.count * 12);
    memcpy(all.position + 3 * a.count, b.position, b.count * 12);
    memcpy(all.normal + 3 * a.count, b.normal, b.count * 12);
    for (uint64_t i = 0; i < all.count; i++) {
        all.color[3 * i] = i < a.count ? 255 : 0;
        all.color[3 * i + 1] = 0;
        all.color[3 * i + 2] = i < a.count ? 0 : 255;
    }
    patina_cloud *cloud = points_upload(&all);
    points_free(&a);
    points_free(&b);
    points_free(&all);
    CHECK(patina_cloud_analyse(cloud, NULL, NULL), cloud);
    return cloud;
}

// Share of the outer sphere's pixels, but for its rim, that are a quarter blue or more.
static double through(const struct picture *picture)
{
    const double rim = 0.97 * tan(asin(1.0 / distance)) / tan(0.5 * fov * M_PI / 180.0) * SIZE / 2.0;
    uint32_t all = 0, blue = 0;
    for (int i = 0; i < SIZE * SIZE; i++) {
        if (hypot(i % SIZE + 0.5 - SIZE / 2.0, (i - i % SIZE) / SIZE + 0.5 - SIZE / 2.0) > rim)
            continue;
        all++;
        blue += picture->combined[4 * i + 2] > 0.25f;
    }
    return (double)blue / all;
}

static void test_through(void **state)
{
    (void)state;
    static const double densities[] = {0.3, 1.0, 1.5, 4.0};
    const double eye[3] = {0.6 * distance, -0.64 * distance, 0.48 * distance}, target[3] = {0};
    const patina_camera camera = camera_perspective(eye, target, fov, SIZE, SIZE, 0.1, 100.0);
    const patina_settings settings = settings_default(SIZE, SIZE);
    for (uint32_t d = 0; d < sizeof densities / sizeof *densities; d++) {
        patina_cloud *cloud = spheres(densities[d]);
        patina_scene *scene = scene_of(cloud, NULL);
        struct picture first = {0};
        for (uint32_t i = 0; i < support_device_count(); i++) {
            patina_device *device = support_device_open(support_device_name(i), 0, 0);
            if (!device)
                continue;
            struct picture picture = picture_render(device, scene, &camera, &settings);
            const double share = through(&picture);
            printf("  %g points a pixel, %s: the inner sphere shows in %.2f %%\n", densities[d], support_device_name(i),
                   100.0 * share);
            assert_true(share <= 0.02);
            if (first.keys)
                assert_memory_equal(first.keys, picture.keys, (size_t)SIZE * SIZE * 8);
            if (first.keys)
                picture_free(&picture);
            else
                first = picture;
            patina_device_destroy(device);
        }
        picture_free(&first);
        patina_scene_destroy(scene);
        patina_cloud_destroy(cloud);
    }
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_through)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
