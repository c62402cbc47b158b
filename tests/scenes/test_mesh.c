// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes among points: exact outlines and depths, hiding and hidden, lit, shadows, layers, regions.
#include "clouds.h"
#include "meshes.h"
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SIZE = 320 };

static const double eye[3] = {3.0, -4.0, 3.0}, target[3] = {0.0, 0.0, 0.3};

static patina_camera the_camera(void) { return camera_perspective(eye, target, 40.0, SIZE, SIZE, 0.1, 100.0); }

static void add_sun(patina_scene *scene, uint32_t shadows)
{
    const patina_light_desc sun = {
        .struct_size = sizeof sun, .type = PATINA_LIGHT_SUN, .power = 3.0f, .direction = {-0.6, 0.2, -1.0}, .shadows = shadows};
    CHECK(patina_scene_add_light(scene, &sun), scene);
}

// The ground: 60,000 points on z = 0, four units wide.
static patina_cloud *ground(void)
{
    struct points points = points_rectangle(60000, 4.0, 4.0, POINTS_NORMALS, 5);
    patina_cloud *cloud = points_upload(&points);
    points_free(&points);
    return cloud;
}

// Where a ray meets the box: distance along the camera's axis, or infinity.
static double box_depth(const patina_camera *camera, double x, double y, const double middle[3], const double half[3])
{
    double origin[3], way[3], in = 0.0, out = INFINITY;
    camera_ray(camera, SIZE, SIZE, x, y, origin, way);
    for (int k = 0; k < 3; k++) {
        double a = (middle[k] - half[k] - origin[k]) / way[k], b = (middle[k] + half[k] - origin[k]) / way[k];
        in = fmax(in, fmin(a, b));
        out = fmin(out, fmax(a, b));
    }
    return in <= out ? in : INFINITY;
}

static double sphere_depth(const patina_camera *camera, double x, double y, const double middle[3], double radius)
{
    double origin[3], way[3], a = 0.0, b = 0.0, c = -radius * radius;
    camera_ray(camera, SIZE, SIZE, x, y, origin, way);
    for (int k = 0; k < 3; k++) {
        a += way[k] * way[k];
        b += way[k] * (origin[k] - middle[k]);
        c += (origin[k] - middle[k]) * (origin[k] - middle[k]);
    }
    return b * b >= a * c ? (-b - sqrt(b * b - a * c)) / a : INFINITY;
}

// A mesh alone is exact: every centre on the right side of the outline, depth to float32, every pixel measured.
static void box_is_exact(void **state)
{
    const double middle[3] = {0.1, 0.2, 0.5}, half[3] = {0.6, 0.4, 0.5};
    (void)state;
    for (uint32_t d = 0; d < support_device_count(); d++) {
        patina_device *device = support_device_open(support_device_name(d), 0, 0);
        if (!device)
            continue;
        patina_mesh *mesh = mesh_box(middle, half);
        patina_scene *scene = NULL;
        CHECK(patina_scene_create(&scene), NULL);
        mesh_add(scene, mesh, 0.5f, 0.25f, 0.125f);
        add_sun(scene, 0);
        patina_camera camera = the_camera();
        patina_settings settings = settings_default(SIZE, SIZE);
        struct picture picture = picture_render(device, scene, &camera, &settings);
        uint32_t wrong = 0, covered = 0;
        double worst = 0.0;
        for (uint32_t i = 0; i < SIZE * SIZE; i++) {
            double z = box_depth(&camera, i % SIZE + 0.5, i / SIZE + 0.5, middle, half);
            if (isfinite(z) != isfinite((double)picture.depth[i])) {
                wrong++;
                continue;
            }
            if (!isfinite(z))
                continue;
            covered++;
            worst = fmax(worst, fabs(z - (double)picture.depth[i]) / z);
            assert_true(picture.source[i] == 1.0f || picture.source[i] == -1.0f);
            assert_true(key_id(picture.keys[i]) < 12);
        }
        printf("%s: box: %u of %u centres on the wrong side of the outline, depth off by %.2g at most\n",
               support_device_name(d), wrong, covered, worst);
        assert_true(covered > 10000 && wrong <= 8 && worst < 1e-4); // wrong: corners are rounded to 1/256 pixel
        picture_free(&picture);
        patina_scene_destroy(scene);
        patina_mesh_destroy(mesh);
        patina_device_destroy(device);
    }
}

// A ball mesh in the ground: each hides the other where it is nearer, and what shows is the right one.
static void hide_each_other(void **state)
{
    const double middle[3] = {0.0, 0.0, 0.2};
    (void)state;
    patina_device *device = support_device_first();
    patina_mesh *mesh = mesh_sphere(middle, 0.8, 64, 1);
    patina_cloud *cloud = ground();
    patina_scene *scene = scene_of(cloud, NULL);
    mesh_add(scene, mesh, 0.1f, 0.2f, 0.9f);
    add_sun(scene, 0);
    patina_camera camera = the_camera();
    patina_settings settings = settings_default(SIZE, SIZE);
    struct picture picture = picture_render(device, scene, &camera, &settings);
    uint32_t wrong = 0, tested = 0, balls = 0;
    for (uint32_t i = 0; i < SIZE * SIZE; i++) {
        double x = i % SIZE + 0.5, y = i / SIZE + 0.5, origin[3], way[3];
        double ball = sphere_depth(&camera, x, y, middle, 0.8);
        camera_ray(&camera, SIZE, SIZE, x, y, origin, way);
        double floor_z = -origin[2] / way[2];
        if (fabs(origin[0] + floor_z * way[0]) > 1.9 || fabs(origin[1] + floor_z * way[1]) > 1.9)
            continue;
        if (fabs(ball - floor_z) < 0.03)
            continue; // within the points' spacing of the crossing
        tested++;
        balls += ball < floor_z;
        wrong += (key_id(picture.keys[i]) >= 60000) != (ball < floor_z);
    }
    printf("ball in the ground: %u of %u pixels show the wrong one, %u show the ball\n", wrong, tested, balls);
    assert_true(tested > 20000 && balls > 5000 && wrong <= tested / 500);
    picture_free(&picture);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    patina_mesh_destroy(mesh);
    patina_device_destroy(device);
}

// Points and a mesh of the same ball, same colour and light: the same picture within what points can do.
static void lit_as_points(void **state)
{
    const double middle[3] = {0.0, 0.0, 0.0};
    (void)state;
    patina_device *device = support_device_first();
    patina_camera camera = the_camera();
    patina_settings settings = settings_default(SIZE, SIZE);
    struct points points = points_sphere(400000, 0.9, POINTS_NORMALS, 3);
    patina_cloud *cloud = points_upload(&points);
    points_free(&points);
    patina_mesh *mesh = mesh_sphere(middle, 0.9, 128, 1);
    patina_cloud_style style = {.struct_size = sizeof style, .color = {0.8f, 0.4f, 0.2f}};
    patina_scene *scenes[2] = {scene_of(cloud, &style), NULL};
    struct picture pictures[2];
    CHECK(patina_scene_create(&scenes[1]), NULL);
    mesh_add(scenes[1], mesh, 0.8f, 0.4f, 0.2f);
    for (int k = 0; k < 2; k++) {
        add_sun(scenes[k], 0);
        pictures[k] = picture_render(device, scenes[k], &camera, &settings);
    }
    double worst = 0.0, sum = 0.0;
    uint32_t count = 0;
    for (uint32_t i = 0; i < SIZE * SIZE; i++) {
        double edge = sphere_depth(&camera, i % SIZE + 0.5, i / SIZE + 0.5, middle, 0.87);
        if (!isfinite(edge))
            continue;
        for (int k = 0; k < 3; k++) {
            double off = fabs((double)pictures[0].combined[4 * i + (uint32_t)k] -
                              (double)pictures[1].combined[4 * i + (uint32_t)k]);
            worst = fmax(worst, off);
            sum += off;
        }
        count++;
    }
    printf("ball of points and ball of triangles: colours differ by %.4f on average, %.3f at most\n", sum / (3.0 * count),
           worst);
    assert_true(count > 10000 && sum / (3.0 * count) < 0.002 && worst < 0.05);
    for (int k = 0; k < 2; k++) {
        picture_free(&pictures[k]);
        patina_scene_destroy(scenes[k]);
    }
    patina_cloud_destroy(cloud);
    patina_mesh_destroy(mesh);
    patina_device_destroy(device);
}

// A box above the ground keeps the sun from the points under it, and from no others.
static void casts_on_points(void **state)
{
    const double middle[3] = {0.0, 0.0, 1.0}, half[3] = {0.4, 0.3, 0.05};
    (void)state;
    patina_device *device = support_device_first();
    patina_mesh *mesh = mesh_box(middle, half);
    struct points points = points_rectangle(60000, 4.0, 4.0, POINTS_NORMALS, 5);
    patina_cloud *cloud = points_upload(&points);
    patina_scene *scene = scene_of(cloud, NULL);
    patina_settings settings = settings_default(SIZE, SIZE);
    patina_frame *frame = NULL;
    float *arrives = malloc(60000 * sizeof *arrives);
    mesh_add(scene, mesh, 0.8f, 0.8f, 0.8f);
    add_sun(scene, 1);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_bake_shadows(frame, scene), frame);
    CHECK(patina_frame_read_shadows(frame, 0, 0, arrives, 60000 * sizeof *arrives), frame);
    uint32_t wrong = 0, dark = 0;
    for (uint32_t i = 0; i < 60000; i++) {
        // up along the sun's way, to the middle of the slab; its borders are left out by a texel
        double x = (double)points.position[3 * i] + 0.6, y = (double)points.position[3 * i + 1] - 0.2, slack = 0.08;
        int inside = fabs(x) < half[0] - slack && fabs(y)<half[1] - slack, outside = fabs(x)> half[0] + slack ||
                     fabs(y) > half[1] + slack;
        wrong += (inside && arrives[i] > 0.5f) || (outside && arrives[i] < 0.5f);
        dark += inside != 0;
    }
    printf("shadow of a box on points: %u of %u wrong\n", wrong, dark);
    assert_true(dark > 500 && wrong == 0);
    free(arrives);
    points_free(&points);
    patina_frame_destroy(frame);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    patina_mesh_destroy(mesh);
    patina_device_destroy(device);
}

// Glass of points before a box: the box shows through, and the layers say so.
static void through_glass(void **state)
{
    const double middle[3] = {0.0, 0.0, -1.0}, half[3] = {0.5, 0.5, 0.2};
    (void)state;
    patina_device *device = support_device_first();
    patina_mesh *mesh = mesh_box(middle, half);
    patina_cloud *cloud = ground();
    patina_cloud_style style = {.struct_size = sizeof style, .transparency = 0.5f};
    patina_scene *scene = scene_of(cloud, &style);
    mesh_add(scene, mesh, 1.0f, 0.0f, 0.0f);
    const double above[3] = {0.0, 0.0, 6.0}, down[3] = {0.0, 0.0, 0.0};
    patina_camera camera = camera_perspective(above, down, 30.0, SIZE, SIZE, 0.1, 100.0);
    patina_settings settings = settings_default(SIZE, SIZE);
    settings.world_color[0] = settings.world_color[1] = settings.world_color[2] = 1.0f; // ambient light alone
    settings.film_transparent = 1;
    struct picture picture = picture_render(device, scene, &camera, &settings);
    const float *at = picture.combined + 4 * (SIZE / 2 * SIZE + SIZE / 2),
                *beside = picture.combined + 4 * (SIZE / 2 * SIZE + SIZE / 6);
    printf("through glass: %.3f %.3f %.3f %.3f, beside: %.3f %.3f\n", (double)at[0], (double)at[1], (double)at[2],
           (double)at[3], (double)beside[0], (double)beside[3]);
    assert_true(fabs((double)at[0] - (0.5 * 0.8 + 0.5)) < 0.02 && fabs((double)at[1] - 0.4) < 0.02 && at[3] > 0.99f);
    assert_true(fabs((double)beside[0] - 0.4) < 0.02 && fabs((double)beside[3] - 0.5) < 0.02);
    picture_free(&picture);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    patina_mesh_destroy(mesh);
    patina_device_destroy(device);
}

static void region_is_a_crop(void **state)
{
    const double middle[3] = {0.0, 0.0, 0.2}, sun_middle[3] = {0.0, 0.0, 1.6}, half[3] = {3.0, 0.2, 0.1};
    (void)state;
    patina_device *device = support_device_first();
    patina_mesh *ball = mesh_sphere(middle, 0.8, 48, 1), *beam = mesh_box(sun_middle, half);
    patina_cloud *cloud = ground();
    patina_scene *scene = scene_of(cloud, NULL);
    mesh_add(scene, ball, 0.1f, 0.2f, 0.9f);
    mesh_add(scene, beam, 0.9f, 0.2f, 0.1f);
    add_sun(scene, 1);
    patina_camera camera = the_camera();
    patina_settings settings = settings_default(SIZE, SIZE);
    struct picture whole = picture_render(device, scene, &camera, &settings);
    settings.region[0] = 75;
    settings.region[1] = 120;
    settings.region[2] = 203;
    settings.region[3] = 201;
    struct picture part = picture_render(device, scene, &camera, &settings);
    picture_assert_identical(&part, &whole, 75, 120, "a region with meshes");
    picture_free(&part);
    picture_free(&whole);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    patina_mesh_destroy(ball);
    patina_mesh_destroy(beam);
    patina_device_destroy(device);
}

static void refuses(void **state)
{
    const float p[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const uint32_t bad[3] = {0, 1, 3};
    patina_mesh_desc desc = {.struct_size = sizeof desc,
                             .vertex_count = 3,
                             .triangle_count = 1,
                             .indices = bad,
                             .position = {.data = p, .type = PATINA_FLOAT32, .components = 3}};
    patina_mesh *mesh = NULL;
    (void)state;
    assert_int_equal(patina_mesh_create(&desc, &mesh), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(support_message(NULL), "index 3 of triangle 0"));
    desc.indices = NULL;
    desc.triangle_count = 2;
    assert_int_equal(patina_mesh_create(&desc, &mesh), PATINA_ERROR_ARGUMENT);
    desc.position.components = 2;
    assert_int_equal(patina_mesh_create(&desc, &mesh), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_mesh_create(NULL, &mesh), PATINA_ERROR_ARGUMENT);
    assert_null(mesh);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(box_is_exact),    cmocka_unit_test(hide_each_other), cmocka_unit_test(lit_as_points),
        cmocka_unit_test(casts_on_points), cmocka_unit_test(through_glass),   cmocka_unit_test(region_is_a_crop),
        cmocka_unit_test(refuses),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
