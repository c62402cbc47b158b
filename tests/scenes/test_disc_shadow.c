// SPDX-License-Identifier: GPL-3.0-or-later
// Shadows on discs: a pixel takes its light from all discs that it takes its colour from, so that the border of a shadow does not jump
// when the view turns a little. SPEC 5.
#include "clouds.h"
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define PI 3.14159265358979323846

enum { SIZE = 256, JUMP = 20 };
static const double radius = 0.5, lift = 0.7, half_side = 2.0; // of the ball, its middle above the plane, of the plane
static const double turn = 0.05;                               // degrees

static struct points ball_over_plane(double density)
{
    const double pixel = 3.2 / SIZE;
    const uint64_t flat_count = (uint64_t)(density * 4.0 * half_side * half_side / (pixel * pixel));
    const uint64_t round_count = (uint64_t)(density * area_sphere(radius) / (pixel * pixel));
    static const double unit[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const double up[3] = {0, 0, lift};
    struct points points = points_create(flat_count + round_count, POINTS_NORMALS);
    struct points flat = points_rectangle(flat_count, 2 * half_side, 2 * half_side, POINTS_NORMALS, 21);
    struct points round = points_sphere(round_count, radius, POINTS_NORMALS, 22);
    points_transform(&round, unit, up);
    memcpy(points.position, flat.position, flat_count * 12);
    memcpy(points.normal, flat.normal, flat_count * 12);
    memcpy(points.position + 3 * flat_count, round.position, round_count * 12);
    memcpy(points.normal + 3 * flat_count, round.normal, round_count * 12);
    points_free(&flat);
    points_free(&round);
    return points;
}

// A sun of power pi, or a lamp that lights the plane below the ball as brightly.
static patina_light_desc light_of(uint32_t type)
{
    const double d[3] = {-0.5, -0.25, -1.0}, length = sqrt(0.25 + 0.0625 + 1.0), away = 3.0;
    patina_light_desc light = {.struct_size = sizeof light, .type = type, .shadows = 1};
    for (int k = 0; k < 3; k++) {
        light.direction[k] = d[k] / length;
        light.position[k] = (k == 2 ? lift : 0.0) - away * d[k] / length;
        light.color[k] = 1.0f;
    }
    light.power = (float)(type == PATINA_LIGHT_SUN ? PI : 4.0 * PI * PI * (away + 0.8) * (away + 0.8));
    return light;
}

static patina_camera camera_at(double degrees)
{
    const double angle = degrees * PI / 180.0, eye[3] = {4.0 * sin(angle), -4.0 * cos(angle), 4.0}, target[3] = {0.3, 0.1, 0.2};
    return camera_perspective(eye, target, 38.0, SIZE, SIZE, 0.1, 20.0);
}

// How far the line o + t d passes from the ball's middle, and where it is nearest.
static double passes(const double o[3], const double d[3], double *along)
{
    double to[3] = {-o[0], -o[1], lift - o[2]}, square = 0.0, length = 0.0;
    *along = 0.0;
    for (int k = 0; k < 3; k++) {
        *along += to[k] * d[k];
        square += to[k] * to[k];
        length += d[k] * d[k];
    }
    return sqrt(fmax(square - *along * *along / length, 0.0));
}

// Whether a pixel shows the plane where the shadow's border lies within `width` of its middle.
static int at_border(const patina_camera *camera, const patina_light_desc *light, int x, int y, double width)
{
    double o[3], d[3], p[3], to[3], along;
    camera_ray(camera, SIZE, SIZE, x + 0.5, y + 0.5, o, d);
    const double z = -o[2] / d[2];
    for (int k = 0; k < 3; k++) {
        p[k] = o[k] + z * d[k];
        to[k] = light->type == PATINA_LIGHT_SUN ? -light->direction[k] : light->position[k] - p[k];
    }
    if (!(z > 0.0) || passes(o, d, &along) < radius + 0.05 || fabs(p[0]) > half_side || fabs(p[1]) > half_side)
        return 0;
    return fabs(passes(p, to, &along) - radius) < width;
}

static double level_of(double light) { return 255.0 * srgb_of_linear(fmin(light, 1.0)); }

// Share of the shadow's border pixels that change by more than JUMP levels between two views `turn` apart, over some pairs.
static double jumps(patina_device *device, double density, uint32_t type, uint32_t samples)
{
    struct points points = ball_over_plane(density);
    patina_cloud *cloud = points_upload(&points);
    patina_scene *scene = scene_of(cloud, NULL);
    const patina_light_desc light = light_of(type);
    const double pixel = 3.2 / SIZE, width = fmax(pixel, pixel / sqrt(density));
    patina_settings settings = settings_default(SIZE, SIZE);
    uint64_t all = 0, far = 0;
    settings.surface = PATINA_SURFACE_SPLATS;
    settings.shadow_lazy = 1;
    settings.pixel_samples = samples;
    CHECK(patina_scene_add_light(scene, &light), scene);
    for (double at = 10.0; at < 60.0; at += 20.0) {
        struct picture pictures[2];
        const patina_camera cameras[2] = {camera_at(at), camera_at(at + turn)};
        for (int k = 0; k < 2; k++)
            pictures[k] = picture_render(device, scene, &cameras[k], &settings);
        for (int i = 0; i < SIZE * SIZE; i++) {
            if (!at_border(&cameras[0], &light, i % SIZE, i / SIZE, width))
                continue;
            const double one = level_of((double)pictures[0].combined[4 * i]),
                         other = level_of((double)pictures[1].combined[4 * i]);
            all++;
            far += fabs(one - other) > JUMP;
        }
        for (int k = 0; k < 2; k++)
            picture_free(&pictures[k]);
    }
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    points_free(&points);
    assert_true(all > 300);
    return (double)far / (double)all;
}

// All on the first device; on graphics processors without samples, which the executor takes; and one cloud on the processor's other
// levels: blend's light has the same bits everywhere (tests/kernels/test_blend.c).
static void test_turning(void **state)
{
    (void)state;
    static const double densities[] = {0.25, 1.0, 4.0}, most[] = {0.01, 0.01, 0.06}; // of one disc: 0.37 to 0.62
    int first = 1;
    for (uint32_t i = 0; i < support_device_count(); i++) {
        patina_device *device = support_device_open(support_device_name(i), 0, 0);
        if (!device)
            continue;
        const int level = !first && strncmp(support_device_name(i), "gl", 2) != 0;
        for (size_t k = 0; k < sizeof densities / sizeof *densities; k++)
            for (uint32_t type = PATINA_LIGHT_SUN; type <= PATINA_LIGHT_POINT; type++) {
                if (level && (densities[k] != 1.0 || type != PATINA_LIGHT_SUN))
                    continue;
                const char *name = type == PATINA_LIGHT_SUN ? "sun" : "lamp";
                const double share = jumps(device, densities[k], type, 1);
                printf("  %s: %g points a pixel, %s: %.2f %% of border pixels jump\n", support_device_name(i), densities[k],
                       name, 100.0 * share);
                assert_true(share <= most[k]);
                if (!first || type != PATINA_LIGHT_SUN || densities[k] > 1.0)
                    continue;
                const double many = jumps(device, densities[k], type, 16);
                printf("    %.2f %% with 16 samples\n", 100.0 * many);
                assert_true(many <= 0.01);
            }
        first = 0;
        patina_device_destroy(device);
    }
}

// Nine lights on two clouds, one of which casts and receives none: with shadows of those points alone that the picture shows, with all of
// them, and of a part of the picture. All are the same, and what receives none is not dark.
static void test_parts(void **state)
{
    (void)state;
    struct points points = ball_over_plane(0.25), wall = points_rectangle(4000, 2.0, 1.0, POINTS_NORMALS, 23);
    static const double upright[9] = {1, 0, 0, 0, 0, -1, 0, 1, 0}, move[3] = {0.9, 0.6, 0.5};
    points_transform(&wall, upright, move);
    patina_cloud *cloud = points_upload(&points), *other = points_upload(&wall);
    const patina_cloud_style bare = {.struct_size = sizeof bare,
                                     .shadow_off = PATINA_SHADOW_NO_CAST | PATINA_SHADOW_NO_RECEIVE};
    patina_scene *scene = scene_of(cloud, NULL);
    CHECK(patina_scene_add_cloud(scene, other, &bare), scene);
    for (uint32_t i = 0; i < 9; i++) {
        patina_light_desc light = light_of(PATINA_LIGHT_SUN);
        light.power /= 9.0f;
        light.direction[0] = 0.05 * i - 0.2;
        light.direction[1] = sqrt(1.0 - light.direction[0] * light.direction[0] - light.direction[2] * light.direction[2]);
        CHECK(patina_scene_add_light(scene, &light), scene);
    }
    const patina_camera camera = camera_at(20.0);
    for (uint32_t i = 0; i < support_device_count(); i++) {
        patina_device *device = support_device_open(support_device_name(i), 0, 0);
        if (!device)
            continue;
        patina_settings settings = settings_default(SIZE, SIZE);
        settings.surface = PATINA_SURFACE_SPLATS;
        struct picture whole = picture_render(device, scene, &camera, &settings);
        settings.shadow_lazy = 1;
        struct picture lazy = picture_render(device, scene, &camera, &settings);
        picture_assert_identical(&lazy, &whole, 0, 0, "shadows of shown points");
        settings.region[0] = settings.region[1] = 61;
        settings.region[2] = settings.region[3] = 190;
        struct picture part = picture_render(device, scene, &camera, &settings);
        picture_assert_identical(&part, &whole, 61, 61, "a part");
        uint32_t of_wall = 0, lit = 0;
        for (int k = 0; k < SIZE * SIZE; k++)
            if (whole.keys[k] != KEY_EMPTY && key_id(whole.keys[k]) >= points.count) {
                of_wall++;
                lit += whole.combined[4 * k] > 0.3f; // 0.44, whatever the ball hides
            }
        assert_true(of_wall > 1000 && lit > 0.95 * of_wall); // but for its rim
        picture_free(&whole);
        picture_free(&lazy);
        picture_free(&part);
        patina_device_destroy(device);
    }
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    patina_cloud_destroy(other);
    points_free(&points);
    points_free(&wall);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_turning), cmocka_unit_test(test_parts)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
