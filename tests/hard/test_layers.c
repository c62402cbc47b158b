// SPDX-License-Identifier: GPL-3.0-or-later
// When two depths are one surface and when they are two (SPEC 1, effective layer distance; SPEC 9).
#include "measured.h"
#include "scenes/clouds.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// A front plane of one point a pixel that lacks its middle, where a point `gap` behind it shows through.
// Returns the source of that pixel: 1 measured (same layer), else filled (occluded).
static float middle_source(patina_device *device, float gap, uint32_t fill, uint32_t quality, uint64_t *key)
{
    enum { SIDE = 9 };
    struct points points = points_grid(SIDE, SIDE, 1.0 / 16.0, POINTS_NORMALS);
    for (uint64_t i = 0; i < points.count; i++)
        points.position[3 * i + 2] = i == SIDE * SIDE / 2 ? 1.0f - gap : 1.0f;
    patina_cloud *cloud = points_upload(&points);
    points_free(&points);
    patina_cloud_style style = {.struct_size = sizeof style, .d_min = 0.5f};
    patina_scene *scene = scene_of(cloud, &style);
    const double eye[3] = {0.0, 0.0, 2.0}, target[3] = {0.0, 0.0, 0.0};
    patina_camera camera = camera_orthographic(eye, target, SIDE / 16.0, SIDE, SIDE, 0.0, 4.0);
    patina_settings settings = settings_default(SIDE, SIDE);
    settings.fill = fill;
    settings.quality = quality;
    settings.antialias = PATINA_ANTIALIAS_OFF;
    struct picture picture = picture_render(device, scene, &camera, &settings);
    assert_int_equal(picture_count(&picture), SIDE * SIDE);
    float source = picture.source[SIDE * SIDE / 2];
    *key = picture.keys[SIDE * SIDE / 2];
    picture_free(&picture);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    return source;
}

// d_eff is 0.5 (d~, seen from the front); z is 1.5, so 8 ulp(z) are 2^-20.
// Whether the point lies beside the middle one, 40, of rows of nine.
static int is_beside(uint32_t id)
{
    int dx = (int)(id % 9) - 4, dy = (int)(id / 9) - 4;
    return id != 40 && abs(dx) <= 1 && abs(dy) <= 1;
}

static void test_two_surfaces(void **state)
{
    (void)state;
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (!device)
            continue;
        for (uint32_t fill = PATINA_FILL_CLOSED; fill <= PATINA_FILL_OFF; fill++)
            for (uint32_t quality = 0; quality < 2; quality++) {
                uint64_t key;
                float same = middle_source(device, 0.5f - 0x1p-20f, fill, quality, &key);
                assert_true(same == 1.0f && key_id(key) == 40);
                float other = middle_source(device, 0.5f + 0x1p-20f, fill, quality, &key);
                if (fill == PATINA_FILL_OFF)
                    assert_true(other == 1.0f);
                else // filled from the front plane; the paper's single step takes one of the eight neighbours
                    assert_true(other >= 2.0f && other < 4.0f && key_id(key) != 40 && key_z(key) == 1.0f &&
                                (fill == PATINA_FILL_CLOSED || is_beside(key_id(key))));
            }
        patina_device_destroy(device);
    }
}

static uint64_t measured_pixels(const struct picture *picture)
{
    uint64_t count = 0;
    for (uint32_t i = 0; i < picture->width * picture->height; i++)
        count += picture->source[i] == 1.0f;
    return count;
}

// A plane that steps 1.5 d~ a pixel (the paper's constant would lose 95% of its pixels), and planes seen edge-on.
static void test_oblique_planes(void **state)
{
    (void)state;
    static const double degrees[] = {45.0, 80.0, 89.0, 89.9, 90.0};
    patina_device *device = support_device_first();
    for (uint32_t i = 0; i < sizeof degrees / sizeof degrees[0]; i++)
        for (int fixed = 0; fixed < 2; fixed++) {
            enum { SIZE = 128 };
            double tilt = degrees[i] * M_PI / 180.0, ct = cos(tilt), st = sin(tilt);
            struct points points = points_rectangle(60000, 1.6 * SIZE, 1.6 * SIZE / fmax(ct, 0.1), POINTS_NORMALS, 91);
            patina_cloud *cloud = points_upload(&points);
            points_free(&points);
            patina_cloud_style style = {.struct_size = sizeof style};
            const double m[16] = {1, 0, 0, 0, 0, ct, -st, 0, 0, st, ct, 0, 0, 0, 0, 1};
            memcpy(style.world_from_object, m, sizeof m);
            if (fixed)
                style.d_min = (float)(tan(tilt) < 100.0 ? tan(tilt) / 1.5 : 1.0);
            patina_scene *scene = scene_of(cloud, &style);
            const double eye[3] = {0.0, 0.0, 10.0}, target[3] = {0.0, 0.0, 0.0}; // one unit a pixel
            patina_camera camera = camera_orthographic(eye, target, SIZE, SIZE, SIZE, -3000.0, 3000.0);
            patina_settings settings = settings_default(SIZE, SIZE);
            settings.antialias = PATINA_ANTIALIAS_OFF;
            settings.fill = PATINA_FILL_OFF;
            struct picture open = picture_render(device, scene, &camera, &settings);
            settings.fill = PATINA_FILL_CLOSED;
            struct picture closed = picture_render(device, scene, &camera, &settings);
            measured_assert_sane(&closed, "oblique plane");
            uint64_t before = measured_pixels(&open), after = measured_pixels(&closed);
            printf("  %5.1f degrees, d~ %-6g measured %llu, after filling %llu, shown %llu\n", degrees[i], (double)style.d_min,
                   (unsigned long long)before, (unsigned long long)after, (unsigned long long)picture_count(&closed));
            assert_int_equal(before, after);
            if (degrees[i] == 90.0) // one row of pixels or two: filling must not thicken it
                assert_true(picture_count(&closed) <= picture_count(&open) + SIZE / 8);
            picture_free(&open);
            picture_free(&closed);
            patina_scene_destroy(scene);
            patina_cloud_destroy(cloud);
        }
    patina_device_destroy(device);
}

// A terrestrial scan: 30 points a pixel at one end, 0.1 at the other, in one cloud. Nothing measured is lost, every
// band is closed as well as its density allows, nothing grows.
static void test_falling_density(void **state)
{
    (void)state;
    enum { WIDTH = 384, HEIGHT = 128, BANDS = 8 };
    double ratio = 300.0, densest = 30.0, length = 368.0, breadth = 112.0;
    // Density 30 / 300^t over t in [0, 1]: invert its integral.
    double mean = densest * (1.0 - 1.0 / ratio) / log(ratio);
    struct points points = points_create((uint64_t)(mean * length * breadth), POINTS_NORMALS);
    struct pcg random = pcg_seed(95);
    for (uint64_t i = 0; i < points.count; i++) {
        double t = -log(1.0 - pcg_unit(&random) * (1.0 - 1.0 / ratio)) / log(ratio);
        points.position[3 * i] = (float)((t - 0.5) * length);
        points.position[3 * i + 1] = (float)(pcg_between(&random, -0.5, 0.5) * breadth);
        points.normal[3 * i + 2] = 1.0f;
    }
    patina_cloud *cloud = points_upload(&points);
    points_free(&points);
    patina_scene *scene = scene_of(cloud, NULL);
    const double eye[3] = {0.0, 0.0, 100.0}, target[3] = {0.0, 0.0, 0.0};
    patina_camera camera = camera_orthographic(eye, target, HEIGHT, WIDTH, HEIGHT, 1.0, 200.0);
    patina_settings settings = settings_default(WIDTH, HEIGHT);
    settings.antialias = PATINA_ANTIALIAS_OFF;
    patina_device *device = support_device_first();
    settings.fill = PATINA_FILL_OFF;
    struct picture open = picture_render(device, scene, &camera, &settings);
    settings.fill = PATINA_FILL_CLOSED;
    struct picture closed = picture_render(device, scene, &camera, &settings);
    assert_int_equal(measured_pixels(&open), measured_pixels(&closed));
    uint64_t outside = 0;
    double holes[BANDS] = {0}, area[BANDS] = {0};
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++) {
            int shown = closed.keys[y * WIDTH + x] != KEY_EMPTY;
            int inside = x >= 8 && x < 376 && y >= 8 && y < 120;
            uint32_t band = (x - 8) * BANDS / 368;
            if (inside) {
                area[band] += 1.0;
                holes[band] += !shown;
            } else {
                outside += (uint64_t)shown;
            }
        }
    printf("  points a pixel:");
    for (int b = 0; b < BANDS; b++)
        printf(" %7.2f", densest * pow(ratio, -(b + 0.5) / BANDS));
    printf("\n  open, %%:       ");
    for (int b = 0; b < BANDS; b++)
        printf(" %7.3f", 100.0 * holes[b] / area[b]);
    printf("\n  grown: %.3f%%\n", 100.0 * (double)outside / (length * breadth));
    for (int b = 0; b < BANDS; b++)
        assert_true(holes[b] / area[b] <= (b < 4 ? 0.001 : b < 7 ? 0.02 : 0.2));
    assert_true((double)outside / (length * breadth) <= 0.005);
    picture_free(&open);
    picture_free(&closed);
    patina_device_destroy(device);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

// From within a sphere every ray meets it: no pixel stays empty, none is far from the truth.
static void test_inside_a_sphere(void **state)
{
    (void)state;
    enum { SIZE = 128 };
    struct points points = points_sphere(400000, 1.0, POINTS_NORMALS, 96);
    patina_cloud *cloud = points_upload(&points);
    points_free(&points);
    patina_scene *scene = scene_of(cloud, NULL);
    const double eye[3] = {0.1, 0.0, 0.05}, target[3] = {0.0, 1.0, 0.0};
    patina_camera camera = camera_perspective(eye, target, 90.0, SIZE, SIZE, 0.01, 10.0);
    patina_settings settings = settings_default(SIZE, SIZE);
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (!device)
            continue;
        struct picture picture = picture_render(device, scene, &camera, &settings);
        measured_assert_sane(&picture, "inside a sphere");
        assert_int_equal(picture_count(&picture), SIZE * SIZE);
        double worst = 0.0;
        for (uint32_t i = 0; i < SIZE * SIZE; i++) {
            double o[3], d[3];
            camera_ray(&camera, SIZE, SIZE, i % SIZE + 0.5, i / SIZE + 0.5, o, d);
            double dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2], od = o[0] * d[0] + o[1] * d[1] + o[2] * d[2];
            double oo = o[0] * o[0] + o[1] * o[1] + o[2] * o[2];
            double z = (-od + sqrt(od * od - dd * (oo - 1.0))) / dd;
            worst = fmax(worst, fabs(z - (double)picture.depth[i]));
        }
        printf("  inside a sphere, %s: depth off by at most %.4f (a pixel is 0.016 wide)\n", support_device_name(k), worst);
        assert_true(worst < 0.05);
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
        cmocka_unit_test(test_two_surfaces),
        cmocka_unit_test(test_oblique_planes),
        cmocka_unit_test(test_falling_density),
        cmocka_unit_test(test_inside_a_sphere),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
