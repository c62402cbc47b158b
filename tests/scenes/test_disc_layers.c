// SPDX-License-Identifier: GPL-3.0-or-later
// Half transparent discs, with normals and without: a surface is one layer, however it is tilted, and nested surfaces are as many
// layers as a ray meets (SPEC 3). On every device.
#include "clouds.h"
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { SIZE = 160 };
static const double half = 1.1, level = 1.0 / 255.0; // the picture's half height, world units; a step of eight bits

static struct picture render(patina_device *device, const struct points *points, const double eye[3], float radius)
{
    const double target[3] = {0};
    const patina_camera camera = camera_orthographic(eye, target, 2.0 * half, SIZE, SIZE, 0.1, 20.0);
    const patina_cloud_style style = {
        .struct_size = sizeof style, .lighting = PATINA_LIGHTING_UNLIT, .transparency = 0.5f, .radius = radius};
    patina_settings settings = settings_default(SIZE, SIZE);
    settings.surface = PATINA_SURFACE_SPLATS;
    settings.film_transparent = 1;
    patina_cloud *cloud = points_upload(points);
    patina_scene *scene = scene_of(cloud, &style);
    const struct picture picture = picture_render(device, scene, &camera, &settings);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    return picture;
}

// Share of the picture's inner pixels that are not half transparent.
static double blended_twice(patina_device *device, double degrees, float radius)
{
    struct points plane = points_rectangle(100000, 16.0, 4.0, POINTS_PLAIN, 5); // half a point a pixel, facing
    const double angle = degrees * M_PI / 180.0, eye[3] = {6.0 * sin(angle), 0.0, 6.0 * cos(angle)};
    struct picture picture = render(device, &plane, eye, radius);
    uint32_t all = 0, off = 0;
    for (int i = 0; i < SIZE * SIZE; i++) {
        const int x = i % SIZE, y = i / SIZE, edge = SIZE / 8;
        if (x < edge || y < edge || x >= SIZE - edge || y >= SIZE - edge)
            continue;
        all++;
        off += fabs((double)picture.combined[4 * i + 3] - 0.5) > level;
    }
    picture_free(&picture);
    points_free(&plane);
    return (double)off / all;
}

static void test_tilted(void **state)
{
    (void)state;
    for (uint32_t i = 0; i < support_device_count(); i++) {
        patina_device *device = support_device_open(support_device_name(i), 0, 0);
        if (!device)
            continue;
        for (double degrees = 0.0; degrees <= 75.0; degrees += 15.0) {
            const double own = blended_twice(device, degrees, 0.0f), wide = blended_twice(device, degrees, 0.08f);
            printf("  %s: %2.0f degrees: %.2f %% of pixels blend twice, %.2f %% with a radius\n", support_device_name(i),
                   degrees, 100.0 * own, 100.0 * wide);
            assert_true(own <= 0.01);
            assert_true(wide <= 0.01);
        }
        patina_device_destroy(device);
    }
}

// Share of the outer sphere's pixels whose opacity is that of the layers which their middle meets.
static double right(patina_device *device, double density, unsigned columns)
{
    static const double radius[2] = {1.0, 0.6};
    const double pixel = 2.0 * half / SIZE, eye[3] = {0.0, -4.0, 0.0};
    struct points sphere[2];
    for (int k = 0; k < 2; k++)
        sphere[k] = points_sphere((uint64_t)(density * area_sphere(radius[k]) / (pixel * pixel)), radius[k], columns,
                                  3 + (uint64_t)k);
    struct points both = points_create(sphere[0].count + sphere[1].count, columns);
    for (int k = 0; k < 2; k++) {
        const uint64_t first = k ? sphere[0].count : 0;
        memcpy(both.position + 3 * first, sphere[k].position, sphere[k].count * 12);
        if (columns & POINTS_NORMALS)
            memcpy(both.normal + 3 * first, sphere[k].normal, sphere[k].count * 12);
        points_free(&sphere[k]);
    }
    struct picture picture = render(device, &both, eye, 0.0f);
    uint32_t all = 0, as_many = 0;
    for (int i = 0; i < SIZE * SIZE; i++) {
        const double x = i % SIZE + 0.5 - SIZE / 2.0, y = (i - i % SIZE) / SIZE + 0.5 - SIZE / 2.0, away = pixel * hypot(x, y);
        if (away >= radius[0])
            continue;
        all++;
        as_many += fabs((double)picture.combined[4 * i + 3] - (1.0 - pow(0.5, away < radius[1] ? 4.0 : 2.0))) <= level;
    }
    picture_free(&picture);
    points_free(&both);
    return (double)as_many / all;
}

static void test_nested(void **state)
{
    (void)state;
    static const double densities[] = {1.0, 4.0}, least[2][2] = {{0.8, 0.85}, {0.92, 0.94}}; // without normals, with them
    for (uint32_t i = 0; i < support_device_count(); i++) {
        patina_device *device = support_device_open(support_device_name(i), 0, 0);
        if (!device)
            continue;
        for (unsigned normals = 0; normals <= 1; normals++)
            for (int k = 0; k < 2; k++) {
                const double share = right(device, densities[k], normals ? POINTS_NORMALS : POINTS_PLAIN);
                printf("  %s: %g points a pixel, normals %u: %.1f %% of pixels have as many layers as they meet\n",
                       support_device_name(i), densities[k], normals, 100.0 * share);
                assert_true(share >= least[normals][k]);
            }
        patina_device_destroy(device);
    }
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_tilted), cmocka_unit_test(test_nested)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
