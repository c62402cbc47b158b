// SPDX-License-Identifier: GPL-3.0-or-later
// Coordinates that float32 cannot hold: 5 10^6 m from the origin, 16 km at 1 mm, far/near = 10^7, orthographic windows
// of 10^-6 and 10^6 (SPEC 1 and 9).
#include "measured.h"
#include "scenes/clouds.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

static double *doubles(uint64_t count)
{
    double *values = malloc((size_t)(count ? count : 1) * 3 * sizeof *values);
    if (!values)
        support_die("out of memory");
    return values;
}

static patina_cloud *upload_doubles(const double *position, uint64_t count)
{
    patina_cloud_desc desc = {.struct_size = sizeof desc, .count = count};
    desc.position = (patina_array){.data = position, .type = PATINA_FLOAT64, .components = 3};
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    return cloud;
}

// Every picture is drawn from one of four descriptions of the same cloud in the same place.
enum way { AT_ORIGIN, BY_ORIGIN, BY_POSITIONS, BY_MATRIX, WAYS };
static const char *const way_names[] = {"at the origin", "origin in the descriptor", "float64 positions", "object matrix"};

static patina_cloud *far_cloud(const struct points *points, const double place[3], enum way way)
{
    patina_cloud_desc desc = points_desc(points);
    patina_cloud *cloud = NULL;
    double *position = NULL;
    if (way == BY_ORIGIN)
        memcpy(desc.origin, place, sizeof desc.origin);
    if (way == BY_POSITIONS) {
        position = doubles(points->count);
        for (uint64_t i = 0; i < 3 * points->count; i++)
            position[i] = (double)points->position[i] + place[i % 3];
        desc.position = (patina_array){.data = position, .type = PATINA_FLOAT64, .components = 3};
    }
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    free(position);
    return cloud;
}

static void test_far_from_origin(void **state)
{
    (void)state;
    const double place[3] = {5e6, 4e6, 3e2};
    struct points points = points_torus(60000, 1.0, 0.4, POINTS_ALL, 11);
    for (uint64_t i = 0; i < 3 * points.count; i++) // multiples of 2^-20: exact in float64 at 5 10^6 too
        points.position[i] = (float)(rint((double)points.position[i] * 0x1p20) * 0x1p-20);
    for (uint32_t k = 0; k < support_device_count(); k++) {
        patina_device *device = support_device_open(support_device_name(k), 0, 0);
        if (!device)
            continue;
        for (int orthographic = 0; orthographic < 2; orthographic++) {
            struct picture truth = {0};
            for (enum way way = AT_ORIGIN; way < WAYS; way++) {
                patina_cloud *cloud = far_cloud(&points, place, way);
                patina_cloud_style style = {.struct_size = sizeof style, .cull_back = 1};
                memcpy(style.world_from_object, identity, sizeof identity);
                // Both exact: the eye is a multiple of 2^-20 as well.
                const double eye[3] = {0.25, -2.75, 2.25}, target[3] = {0.0, 0.0, 0.0};
                patina_camera camera = orthographic ? camera_orthographic(eye, target, 3.0, 151, 113, -9.0, 9.0)
                                                    : camera_perspective(eye, target, 45.8, 151, 113, 0.1, 100.0);
                for (int axis = 0; axis < 3 && way != AT_ORIGIN; axis++) {
                    camera.world_from_camera[4 * axis + 3] += place[axis];
                    if (way == BY_MATRIX)
                        style.world_from_object[4 * axis + 3] = place[axis];
                }
                patina_scene *scene = scene_of(cloud, &style);
                patina_settings settings = settings_default(151, 113);
                struct picture picture = picture_render(device, scene, &camera, &settings);
                char what[96];
                snprintf(what, sizeof what, "%s, %s, %s", support_device_name(k), way_names[way],
                         orthographic ? "orthographic" : "perspective");
                measured_assert_sane(&picture, what);
                if (way == AT_ORIGIN) {
                    assert_true(picture_count(&picture) > 3000);
                    truth = picture;
                } else {
                    picture_assert_identical(&picture, &truth, 0, 0, what);
                    picture_free(&picture);
                }
                patina_scene_destroy(scene);
                patina_cloud_destroy(cloud);
            }
            picture_free(&truth);
        }
        patina_device_destroy(device);
    }
    points_free(&points);
}

// The box that a cloud reports keeps the millimetres.
static void test_far_box(void **state)
{
    (void)state;
    const double position[6] = {5e6 + 0.001, 4e6 - 0.002, 300.003, 5e6 + 7.004, 4e6 + 3.005, 299.996};
    patina_cloud *cloud = upload_doubles(position, 2);
    patina_cloud_info info = {.struct_size = sizeof info};
    CHECK(patina_cloud_get_info(cloud, &info), cloud);
    for (int k = 0; k < 3; k++) {
        assert_true(fabs(info.box_min[k] - fmin(position[k], position[3 + k])) < 1e-6);
        assert_true(fabs(info.box_max[k] - fmax(position[k], position[3 + k])) < 1e-6);
    }
    patina_cloud_destroy(cloud);
}

// Draws points without filling and holds every pixel against float64. parts: clouds that share the points evenly.
static struct measured draw_parts(patina_device *device, const double *world, uint64_t count, uint32_t parts,
                                  const patina_camera *camera, uint32_t width, uint32_t height, double margin, const char *what)
{
    patina_cloud *clouds[16];
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    uint64_t share = count / parts;
    for (uint32_t i = 0; i < parts; i++) {
        clouds[i] = upload_doubles(world + 3 * share * i, share);
        CHECK(patina_scene_add_cloud(scene, clouds[i], NULL), scene);
    }
    patina_settings settings = settings_default(width, height);
    settings.fill = PATINA_FILL_OFF;
    struct picture picture = picture_render(device, scene, camera, &settings);
    measured_assert_sane(&picture, what);
    struct measured result = measured_compare(&picture, world, share * parts, camera, margin);
    printf("  %-44s %8llu pixels, z off by %.2e (%.2e of z), late by %.2e, stray %.1e px, missed %llu\n", what,
           (unsigned long long)result.pixels, result.z_error, result.z_share, result.z_late, result.stray,
           (unsigned long long)result.missed);
    picture_free(&picture);
    patina_scene_destroy(scene);
    for (uint32_t i = 0; i < parts; i++)
        patina_cloud_destroy(clouds[i]);
    assert_int_equal(result.impossible, 0);
    return result;
}

static struct measured draw(patina_device *device, const double *world, uint64_t count, const patina_camera *camera,
                            uint32_t width, uint32_t height, double margin, const char *what)
{
    struct measured result = draw_parts(device, world, count, 1, camera, width, height, margin, what);
    assert_int_equal(result.missed, 0);
    return result;
}

// A region of 16 km, seen whole from above and from a corner: depth holds 1 mm.
static void test_sixteen_kilometres(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    uint64_t count = 40000;
    double *world = doubles(count);
    struct pcg random = pcg_seed(31);
    for (uint64_t i = 0; i < count; i++) {
        int dense = i >= count / 2; // half of the points in a patch of 4 m at the far corner, to the millimetre
        world[3 * i] = dense ? 7990.0 + floor(pcg_between(&random, 0, 4000)) * 0.001 : pcg_between(&random, -8000, 8000);
        world[3 * i + 1] = dense ? 7990.0 + floor(pcg_between(&random, 0, 4000)) * 0.001 : pcg_between(&random, -8000, 8000);
        world[3 * i + 2] = dense ? floor(pcg_between(&random, 0, 100)) * 0.001 : pcg_between(&random, 0, 40);
    }
    // No view reaches beyond z = 16384: there a float32 holds every other millimetre only.
    static const struct {
        const char *name;
        double eye[3], target[3], window; // window 0: perspective, 60 degrees
    } views[] = {
        {"16 km, perspective from above", {10.0, -20.0, 15000.0}, {0, 0, 0}, 0},
        {"16 km, perspective from the edge", {-8100.0, 0.0, 900.0}, {0, 0, 0}, 0},
        {"16 km, perspective from a corner", {-8100.0, -8100.0, 900.0}, {-3000, -3000, 0}, 0},
        {"16 km, orthographic from above", {0.0, 0.0, 8000.0}, {0, 0, 0}, 16500.0},
        {"16 km, orthographic from the side", {-3.0, -8000.0, 2000.0}, {0, 0, 0}, 16500.0},
        {"16 km, the patch alone", {7980.0, 7980.0, 9.0}, {7992.0, 7992.0, 0}, 0},
        {"16 km, the patch from the other side", {-7900.0, 7992.0, 2000.0}, {7992.0, 7992.0, 0}, 10.0},
    };
    for (uint32_t i = 0; i < sizeof views / sizeof views[0]; i++) {
        patina_camera camera = views[i].window > 0.0
                                   ? camera_orthographic(views[i].eye, views[i].target, views[i].window, 512, 512, 0.0, 40000.0)
                                   : camera_perspective(views[i].eye, views[i].target, 60.0, 512, 512, 1.0, 16384.0);
        struct measured result = draw(device, world, count, &camera, 512, 512, 0.01, views[i].name);
        assert_true(result.pixels > 100);
        assert_true(result.z_error <= 0.001);
        // The last view shows 2 cm a pixel from 16 km; everywhere a point stays within a hundredth of its pixel.
        assert_true(result.stray <= 0.01);
        assert_true(result.z_late <= 0.002);
    }
    free(world);
    patina_device_destroy(device);
}

// Seven decades of distance in one view. As a cloud a decade every point is as exact as float32 is; in one cloud a point is as
// exact as 2^-24 of its chunk's extent, and chunks that span decades are cut.
static void test_far_over_near(void **state)
{
    (void)state;
    enum { PARTS = 8, SHARE = 4000 };
    patina_device *device = support_device_first();
    double *world = doubles(PARTS * SHARE);
    struct pcg random = pcg_seed(41);
    for (uint64_t i = 0; i < PARTS * SHARE; i++) {
        double z = pow(10.0, -3.5 + (double)(i / SHARE) + pcg_unit(&random)); // beyond both clips too
        world[3 * i] = z * pcg_between(&random, -0.6, 0.6);
        world[3 * i + 1] = z * pcg_between(&random, -0.6, 0.6);
        world[3 * i + 2] = -z;
    }
    const double eye[3] = {0, 0, 0}, target[3] = {0, 0, -1};
    patina_camera camera = camera_perspective(eye, target, 53.13, 256, 256, 1e-3, 1e4);
    struct measured result = draw_parts(device, world, PARTS * SHARE, PARTS, &camera, 256, 256, 1e-3,
                                        "far / near = 10^7, a cloud a decade");
    assert_true(result.pixels > 15000);
    assert_int_equal(result.missed, 0);
    assert_true(result.z_share <= 8e-6); // 24 bits of ten times z, and the product's roundings
    assert_true(result.stray <= 1e-3);
    result = draw_parts(device, world, PARTS * SHARE, 1, &camera, 256, 256, 1e-2, "far / near = 10^7, one cloud");
    assert_int_equal(result.missed, 0);
    assert_true(result.z_share <= 2e-5); // a chunk spans two decades at most where it holds few points
    assert_true(result.stray <= 2e-3);
    free(world);
    patina_device_destroy(device);
}

// One stray point a thousand kilometres away does not cost the others their digits.
static void test_outlier(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    uint64_t count = 30000;
    double *world = doubles(count);
    struct points points = points_sphere(count, 1.0, POINTS_PLAIN, 45);
    for (uint64_t i = 0; i < 3 * count; i++)
        world[i] = (double)points.position[i];
    points_free(&points);
    world[3 * 777] = 1e6;
    const double eye[3] = {0.0, -4.0, 1.0}, target[3] = {0, 0, 0};
    patina_camera camera = camera_perspective(eye, target, 40.0, 256, 256, 0.1, 100.0);
    struct measured result = draw_parts(device, world, count, 1, &camera, 256, 256, 1e-3, "a point 1000 km away");
    assert_int_equal(result.missed, 0);
    assert_true(result.z_error <= 1e-5);
    assert_true(result.stray <= 0.01);
    free(world);
    patina_device_destroy(device);
}

static void test_orthographic_scales(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    uint64_t count = 20000;
    double *world = doubles(count);
    static const double scales[] = {1e-6, 1.0, 1e6};
    for (uint32_t s = 0; s < 3; s++) {
        double scale = scales[s];
        struct pcg random = pcg_seed(51);
        for (uint64_t i = 0; i < count; i++)
            for (int k = 0; k < 3; k++)
                world[3 * i + k] = scale * pcg_between(&random, -0.55, 0.55);
        const double eye[3] = {0.1 * scale, -0.2 * scale, 0.3 * scale}, target[3] = {0, 0, 0};
        for (int clip = 0; clip < 2; clip++) { // near = -far as Blender's viewport has it; tight and wide
            double far_clip = (clip ? 1000.0 : 2.0) * scale;
            patina_camera camera = camera_orthographic(eye, target, scale, 256, 256, -far_clip, far_clip);
            char what[64];
            snprintf(what, sizeof what, "orthographic scale %g, near = -far = %g", scale, -far_clip);
            struct measured result = draw(device, world, count, &camera, 256, 256, 1e-3, what);
            assert_true(result.pixels > 10000);
            assert_true(result.z_error <= 4.0 * 0x1p-24 * 2.0 * far_clip + 4.0 * 0x1p-24 * scale);
            assert_true(result.stray <= 1e-3);
        }
    }
    free(world);
    patina_device_destroy(device);
}

// Points on, behind and just before the camera plane; the camera amid the points.
static void test_camera_plane(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    uint64_t count = 20000;
    double *world = doubles(count);
    struct pcg random = pcg_seed(61);
    for (uint64_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            world[3 * i + k] = pcg_between(&random, -1.0, 1.0);
    for (uint64_t i = 0; i < 600; i++) // exactly on the camera plane, at the eye, and a hair before and behind it
        world[3 * i + 2] = (i % 3 == 0) ? 0.0 : (i % 3 == 1) ? 1e-30 : -1e-30;
    for (int k = 0; k < 3; k++)
        world[k] = 0.0;
    const double eye[3] = {0, 0, 0}, target[3] = {0, 0, -1};
    patina_camera camera = camera_perspective(eye, target, 90.0, 200, 120, 0.01, 10.0);
    struct measured result = draw(device, world, count, &camera, 200, 120, 1e-3, "camera amid the points");
    assert_true(result.pixels > 1000);
    assert_true(result.z_error <= 4.0 * 0x1p-24 * 2.0);
    assert_true(result.stray <= 1e-3);
    camera = camera_orthographic(eye, target, 1.8, 200, 120, -0.5, 0.5);
    result = draw(device, world, count, &camera, 200, 120, 1e-3, "camera amid the points, orthographic");
    assert_true(result.pixels > 1000);
    assert_true(result.stray <= 1e-3);
    free(world);
    patina_device_destroy(device);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_far_from_origin), cmocka_unit_test(test_far_box), cmocka_unit_test(test_sixteen_kilometres),
        cmocka_unit_test(test_far_over_near),   cmocka_unit_test(test_outlier), cmocka_unit_test(test_orthographic_scales),
        cmocka_unit_test(test_camera_plane),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
