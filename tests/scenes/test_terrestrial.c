// SPDX-License-Identifier: GPL-3.0-or-later
// A terrestrial scan: ground and a wall from a tripod, more than a thousand times as dense beside it as far off, in one picture. What
// filling, discs and range images make of it near the scanner and far from it, against the truth: one cell size cannot follow that, nested
// ones can.
#include "support.h"

#include <math.h>
#include <stdlib.h>

enum { WIDTH = 320, HEIGHT = 200, MOST = 400000 };

static const double tripod = 1.6, wall = 30.0, step = 0.0052, wave = 0.105; // metres; radians: 0.3 degrees, and 6

struct scan {
    float place[MOST][3], color[MOST][3];
    uint64_t count;
};

// Stripes that fan out from the tripod.
static double shade(const double place[3]) { return 0.5 + 0.3 * sin(6.283185307179586 / wave * atan2(place[0], place[1])); }

// Where a ray meets the ground, z = 0, or the wall, y = 30 m; +inf: nothing.
static double meet(const double from[3], const double way[3])
{
    const double ground = way[2] < 0.0 ? -from[2] / way[2] : INFINITY,
                 far = way[1] > 0.0 ? (wall - from[1]) / way[1] : INFINITY;
    const double t = fmin(ground, far);
    return isfinite(t) && fabs(from[0] + t * way[0]) < 20.0 && from[2] + t * way[2] < 8.0 ? t : INFINITY;
}

static struct scan *take(void)
{
    struct scan *scan = calloc(1, sizeof *scan);
    const double from[3] = {0.0, 0.0, tripod};
    assert_non_null(scan);
    for (int row = -200; row < 50; row++)
        for (int column = -260; column < 260; column++) {
            const double e = (row + 0.5) * step, a = (column + 0.5) * step;
            const double way[3] = {sin(a) * cos(e), cos(a) * cos(e), sin(e)}, t = meet(from, way);
            if (isinf(t))
                continue;
            const double place[3] = {from[0] + t * way[0], from[1] + t * way[1], from[2] + t * way[2]};
            for (int k = 0; k < 3; k++) {
                scan->place[scan->count][k] = (float)place[k];
                scan->color[scan->count][k] = (float)shade(place);
            }
            scan->count++;
        }
    return scan;
}

struct off {
    double open, depth, color, pixels; // share of pixels; root mean square, of the distance, and of white
};

// [0] near the scanner, [1] far from it, where the camera stands.
static void measure(const struct picture *picture, const patina_camera *camera, struct off off[2])
{
    for (int k = 0; k < 2; k++)
        off[k] = (struct off){0};
    for (uint32_t y = 2; y < HEIGHT - 2; y++)
        for (uint32_t x = 2; x < WIDTH - 2; x++) {
            const size_t at = (size_t)y * WIDTH + x;
            double from[3], way[3];
            camera_ray(camera, WIDTH, HEIGHT, x + 0.5, y + 0.5, from, way);
            const double t = meet(from, way), depth = (double)picture->depth[at];
            const double place[3] = {from[0] + t * way[0], from[1] + t * way[1], from[2] + t * way[2]};
            const double range = hypot(place[0], place[1]);
            const int far = range > 8.0;
            if (isinf(t) || range < 1.6 || (range > 5.0 && !far) || range > 16.0 || fabs(atan2(place[0], place[1])) > 1.2)
                continue;
            off[far].pixels++;
            if (isinf(depth)) {
                off[far].open++;
                continue;
            }
            const double wrong = (double)picture->combined[4 * at] - shade(place);
            off[far].depth += (depth / t - 1.0) * (depth / t - 1.0);
            off[far].color += wrong * wrong;
        }
    for (int k = 0; k < 2; k++) {
        const double shown = fmax(off[k].pixels - off[k].open, 1.0);
        off[k].depth = sqrt(off[k].depth / shown);
        off[k].color = sqrt(off[k].color / shown);
        off[k].open /= off[k].pixels;
    }
}

static void test_near_and_far(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        uint32_t surface;
        float pixel;
    } cases[] = {{"automatic", PATINA_SURFACE_AUTO, 0.0f},
                 {"filling", PATINA_SURFACE_FILL, 0.0f},
                 {"discs", PATINA_SURFACE_SPLATS, 0.0f},
                 {"range images, automatic cells", PATINA_SURFACE_RANGES, 0.0f},
                 {"range images, cells of 2", PATINA_SURFACE_RANGES, 2.0f},
                 {"range images, cells of 16", PATINA_SURFACE_RANGES, 16.0f}};
    // away from the tripod, and back to it
    const double eye[3] = {2.0, 15.0, 2.5}, target[3] = {0.0, 3.0, 0.0};
    const patina_camera camera = camera_perspective(eye, target, 50.0, WIDTH, HEIGHT, 0.1, 200.0);
    struct scan *scan = take();
    patina_device *device = support_device_first();
    const patina_cloud_desc desc = {.struct_size = sizeof desc,
                                    .count = scan->count,
                                    .position = {scan->place, PATINA_FLOAT32, 3, 0},
                                    .color = {scan->color, PATINA_FLOAT32, 3, 0}};
    patina_cloud *cloud = NULL;
    const double station[3] = {0.0, 0.0, tripod};
    const patina_analysis_desc how = {.struct_size = sizeof how, .station_count = 1, .stations = station};
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    CHECK(patina_cloud_analyse(cloud, &how, NULL), cloud);
    patina_cloud_info info = {.struct_size = sizeof info};
    CHECK(patina_cloud_get_info(cloud, &info), cloud);
    print_message("  %llu points, %.4f to %.4f m apart: %.0f : 1 in density\n", (unsigned long long)scan->count,
                  info.spacing_min, info.spacing_max, pow(info.spacing_max / info.spacing_min, 2.0));
    assert_true(pow(info.spacing_max / info.spacing_min, 2.0) > 300.0);
    struct off off[6][2];
    for (int k = 0; k < 6; k++) {
        patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
        patina_settings settings = settings_default(WIDTH, HEIGHT);
        settings.surface = cases[k].surface;
        style.range_pixel = cases[k].pixel;
        patina_scene *scene = scene_of(cloud, &style);
        struct picture picture = picture_render(device, scene, &camera, &settings);
        measure(&picture, &camera, off[k]);
        print_message("  %-30s near: %.2f %% open, depth %.2f %%, colour %.1f %% off; far: %.2f %% open, %.2f %%, %.1f %%\n",
                      cases[k].name, 100.0 * off[k][0].open, 100.0 * off[k][0].depth, 100.0 * off[k][0].color,
                      100.0 * off[k][1].open, 100.0 * off[k][1].depth, 100.0 * off[k][1].color);
        assert_true(off[k][0].pixels > 1500.0 && off[k][1].pixels > 3000.0);
        picture_free(&picture);
        patina_scene_destroy(scene);
    }
    // What the manual says: Automatic draws both; of range images small cells draw what is dense, wide ones what is sparse, and nested
    // ones both.
    assert_true(off[0][0].open < 0.001 && off[0][1].open < 0.001 && off[0][0].depth < 0.015 && off[0][1].depth < 0.002);
    assert_true(off[0][1].color < 0.03 && off[2][1].color < 0.03 && off[2][0].color < 0.6 * off[0][0].color);
    assert_true(off[4][0].open < 0.02 && off[4][1].open > 0.5 && off[5][0].open > 0.3 && off[5][1].open < 0.03);
    assert_true(off[3][0].open < 0.03 && off[3][1].open < 0.001 && off[3][0].depth < 0.05 && off[3][1].depth < 0.025);
    patina_cloud_destroy(cloud);
    patina_device_destroy(device);
    free(scan);
}

// Nested cells on every device: the same keys.
static void test_devices(void **state)
{
    (void)state;
    const double eye[3] = {2.0, 15.0, 2.5}, target[3] = {0.0, 3.0, 0.0};
    const patina_camera camera = camera_perspective(eye, target, 50.0, WIDTH, HEIGHT, 0.1, 200.0);
    const patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
    patina_settings settings = settings_default(WIDTH, HEIGHT);
    settings.surface = PATINA_SURFACE_RANGES;
    struct scan *scan = take();
    const patina_cloud_desc desc = {
        .struct_size = sizeof desc, .count = scan->count, .position = {scan->place, PATINA_FLOAT32, 3, 0}};
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    patina_scene *scene = scene_of(cloud, &style);
    struct picture first = {0};
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (!device)
            continue;
        struct picture picture = picture_render(device, scene, &camera, &settings);
        if (!first.keys)
            first = picture;
        assert_memory_equal(picture.keys, first.keys, sizeof *picture.keys * WIDTH * HEIGHT);
        if (picture.keys != first.keys)
            picture_free(&picture);
        patina_device_destroy(device);
    }
    picture_free(&first);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    free(scan);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_near_and_far), cmocka_unit_test(test_devices)};
    support_arguments(argc, argv);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
