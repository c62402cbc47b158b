// SPDX-License-Identifier: GPL-3.0-or-later
// Shadows against analytic truth [D 6], SPEC 4: a ball on a plane under suns of any height, hard and soft, and under points,
// spots and panels. Acne: a point that the truth lights, away from the shadow's border, is dark. Leak: the other way round.
#include "clouds.h"
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

enum { PLANE = 160000, BALL = 80000, FEW = 24000, ROUND = 12000 };
static const double radius = 0.5, lift = 0.55; // of the ball, and its middle above the plane
static const double half_side = 2.0;
static double spacing; // of the plane's points

// The plane's points first, then the ball's.
static struct points ball_on_plane(uint64_t plane, uint64_t ball, unsigned columns)
{
    struct points points = points_create(plane + ball, columns);
    struct points flat = points_rectangle(plane, 2 * half_side, 2 * half_side, columns, 11);
    struct points round = points_sphere(ball, radius, columns, 12);
    static const double unit[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, up[3] = {0, 0, lift};
    points_transform(&round, unit, up);
    memcpy(points.position, flat.position, plane * 12);
    memcpy(points.position + 3 * plane, round.position, ball * 12);
    if (columns & POINTS_NORMALS) {
        memcpy(points.normal, flat.normal, plane * 12);
        memcpy(points.normal + 3 * plane, round.normal, ball * 12);
    }
    points_free(&flat);
    points_free(&round);
    spacing = 2 * half_side / sqrt((double)plane);
    return points;
}

// Where a ray from p along unit d leaves the ball, or -1; `miss`: how far the line passes from the ball's rim.
static double leaves_ball(const double p[3], const double d[3], double *miss)
{
    double to[3] = {-p[0], -p[1], lift - p[2]}, along = 0, square = 0;
    for (int k = 0; k < 3; k++) {
        along += to[k] * d[k];
        square += to[k] * to[k];
    }
    double off = sqrt(fmax(square - along * along, 0.0));
    *miss = fabs(off - radius);
    return off < radius && along > 0.0 ? along + sqrt(radius * radius - off * off) : -1.0;
}

struct truth {
    double lit; // 1 or 0
    int near;   // so close to a border or a contact that a map's texel and d_eff decide
};

// What a light in unit direction d does to point i; texel: width of the map's there. rim: cosines below it are near the
// ball's terminator: 0.15 with normals; without them shadows end a texel early, as seen from the light.
static struct truth truth_of(const struct points *points, uint64_t i, const double d[3], double texel, double rim)
{
    const float *q = points->position + 3 * i;
    double p[3] = {q[0], q[1], q[2]}, miss;
    struct truth truth = {1.0, 0};
    if (i >= PLANE) { // its own far side is dark, whatever the rest does
        double cosine = (p[0] * d[0] + p[1] * d[1] + (p[2] - lift) * d[2]) / radius;
        truth.lit = cosine > 0.0;
        truth.near = fabs(cosine) < rim;
        return truth;
    }
    double out = leaves_ball(p, d, &miss), layer = 2.0 * fmax(spacing, texel) / fmax(fabs(d[2]), 0.05);
    truth.lit = out < 0.0;
    truth.near = miss < 4.0 * fmax(texel, spacing) || (out >= 0.0 && out < 2.0 * layer);
    return truth;
}

// Gets no light, whatever the shadow says.
static int turned_away(const struct points *points, uint64_t i, const double d[3])
{
    const float *p = points->position + 3 * i;
    return i >= PLANE && p[0] * d[0] + p[1] * d[1] + (p[2] - lift) * d[2] < 0.0;
}

static patina_frame *frame_on(patina_device *device)
{
    patina_frame *frame = NULL;
    CHECK(patina_frame_create(device, &frame), device);
    return frame;
}

static patina_light_desc sun_at(double height_degrees, double turn_degrees)
{
    double h = height_degrees * PI / 180, t = turn_degrees * PI / 180;
    return (patina_light_desc){.struct_size = sizeof(patina_light_desc),
                               .type = PATINA_LIGHT_SUN,
                               .power = 1.0f,
                               .direction = {-cos(h) * cos(t), -cos(h) * sin(t), -sin(h)},
                               .shadows = 1};
}

static float *bake(patina_device *device, patina_scene *scene, const patina_light_desc *light, uint32_t samples, uint64_t count,
                   patina_frame **keep)
{
    patina_settings settings = settings_default(64, 64);
    settings.shadow_samples = samples;
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    if (light)
        CHECK(patina_scene_add_light(scene, light), scene);
    patina_frame *frame = frame_on(device);
    CHECK(patina_frame_bake_shadows(frame, scene), frame);
    float *values = malloc(count * sizeof *values);
    CHECK(patina_frame_read_shadows(frame, 0, 0, values, count * sizeof *values), frame);
    if (keep)
        *keep = frame;
    else
        patina_frame_destroy(frame);
    return values;
}

// Suns from 2 to 90 degrees, with normals and without: the share of points that are wrong, and how many of them far from
// any border.
static void test_sun_heights(void **state)
{
    (void)state;
    static const double heights[] = {2, 3, 5, 7, 10, 15, 20, 30, 45, 60, 75, 90};
    patina_device *device = support_device_first();
    printf("height, normals: wrong %%, of them acne and leaks away from borders\n");
    for (unsigned columns = POINTS_NORMALS; columns + 1 > 0; columns--) {
        struct points points = ball_on_plane(PLANE, BALL, columns);
        patina_cloud *cloud = points_upload(&points);
        for (size_t h = 0; h < sizeof heights / sizeof *heights; h++) {
            patina_light_desc sun = sun_at(heights[h], 25);
            double d[3] = {-sun.direction[0], -sun.direction[1], -sun.direction[2]};
            patina_scene *scene = scene_of(cloud, NULL);
            float *values = bake(device, scene, &sun, 1, points.count, NULL);
            uint64_t wrong = 0, acne = 0, leaks = 0;
            for (uint64_t i = 0; i < points.count; i++) {
                struct truth truth = truth_of(&points, i, d, spacing, columns ? 0.15 : 0.35);
                int bad = fabs(values[i] - truth.lit) > 0.5;
                wrong += (uint64_t)(bad && !turned_away(&points, i, d));
                acne += bad && !truth.near && truth.lit > 0.5;
                leaks += bad && !truth.near && truth.lit < 0.5;
            }
            printf("  %4.0f %s  %.3f  %llu %llu\n", heights[h], columns ? "with   " : "without",
                   100.0 * (double)wrong / (double)points.count, (unsigned long long)acne, (unsigned long long)leaks);
            assert_int_equal(acne, 0);
            assert_int_equal(leaks, 0);
            assert_true((double)wrong <= 0.01 * (double)points.count);
            free(values);
            patina_scene_destroy(scene);
        }
        patina_cloud_destroy(cloud);
        points_free(&points);
        if (!columns)
            break;
    }
    patina_device_destroy(device);
}

// How much of a sun's disc a point of the plane sees: counted on a fine grid of the disc.
static double disc_seen(const float *q, const patina_light_desc *sun, int grid)
{
    double p[3] = {q[0], q[1], q[2]}, z[3], x[3], y[3], seen = 0, all = 0, miss, tangent = tan(0.5 * (double)sun->angle);
    for (int k = 0; k < 3; k++)
        z[k] = -sun->direction[k];
    double flat = hypot(z[0], z[1]);
    x[0] = -z[1] / flat, x[1] = z[0] / flat, x[2] = 0;
    for (int k = 0; k < 3; k++)
        y[k] = z[(k + 1) % 3] * x[(k + 2) % 3] - z[(k + 2) % 3] * x[(k + 1) % 3];
    for (int i = 0; i < grid * grid; i++) {
        double a = 2.0 * (i % grid + 0.5) / grid - 1.0, b = 2.0 * (i / grid + 0.5) / grid - 1.0, d[3], length = 0;
        if (a * a + b * b > 1.0)
            continue;
        for (int k = 0; k < 3; k++) {
            d[k] = z[k] + tangent * (a * x[k] + b * y[k]);
            length += d[k] * d[k];
        }
        for (int k = 0; k < 3; k++)
            d[k] /= sqrt(length);
        all++;
        seen += leaves_ball(p, d, &miss) < 0.0;
    }
    return seen / all;
}

// Soft shadows: the error against our own 4096 samples falls at least as 1 / sqrt(n); the bias against the truth is told apart.
static void test_soft_converges(void **state)
{
    (void)state;
    enum { STEPS = 9 };
    patina_device *device = support_device_first();
    struct points points = ball_on_plane(FEW, ROUND, POINTS_NORMALS);
    patina_cloud *cloud = points_upload(&points);
    patina_light_desc sun = sun_at(50, 25);
    sun.angle = 0.3f;
    patina_scene *scene = scene_of(cloud, NULL);
    float *truth = bake(device, scene, &sun, 4096, points.count, NULL);
    double bias = 0, penumbra = 0, slope_top = 0, slope_bottom = 0, mean_x = 0, mean_y = 0, logs[STEPS][2];
    for (uint64_t i = 0; i < FEW; i++) {
        double seen = disc_seen(points.position + 3 * i, &sun, 24);
        bias += (truth[i] - seen) * (truth[i] - seen);
        penumbra += seen > 0.0 && seen < 1.0;
    }
    printf("  %.0f of %d points in the penumbra; rms of 4096 samples against the truth %.4f\n", penumbra, FEW,
           sqrt(bias / FEW));
    assert_true(sqrt(bias / FEW) < 0.05);
    for (int step = 0; step < STEPS; step++) {
        double square = 0;
        patina_frame *frame;
        float *values = bake(device, scene, NULL, 1u << step, points.count, &frame);
        for (uint64_t i = 0; i < FEW; i++)
            square += (values[i] - truth[i]) * (values[i] - truth[i]);
        logs[step][0] = step * log(2.0);
        logs[step][1] = 0.5 * log(square / FEW);
        mean_x += logs[step][0] / STEPS;
        mean_y += logs[step][1] / STEPS;
        printf("  %4u samples: rms %.5f\n", 1u << step, exp(logs[step][1]));
        patina_frame_destroy(frame);
        free(values);
    }
    for (int step = 0; step < STEPS; step++) {
        slope_top += (logs[step][0] - mean_x) * (logs[step][1] - mean_y);
        slope_bottom += (logs[step][0] - mean_x) * (logs[step][0] - mean_x);
    }
    printf("  falls as n^%.2f\n", slope_top / slope_bottom);
    assert_true(slope_top / slope_bottom <= -0.5);
    free(truth);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    points_free(&points);
    patina_device_destroy(device);
}

static double off_in_penumbra(const float *values, const float *truth, uint64_t count)
{
    double square = 0, between = 0;
    for (uint64_t i = 0; i < count; i++)
        if (truth[i] > 0.0f && truth[i] < 1.0f) {
            square += ((double)values[i] - (double)truth[i]) * ((double)values[i] - (double)truth[i]);
            between++;
        }
    return sqrt(square / fmax(between, 1.0));
}

// Samples double until the error is expected to be at most the target; against our own 4096 it is. The tighter, the more.
static void test_error_target(void **state)
{
    (void)state;
    static const float targets[] = {0.2f, 0.1f, 0.05f, 0.025f};
    patina_device *device = support_device_first();
    struct points points = ball_on_plane(FEW, ROUND, POINTS_NORMALS);
    patina_cloud *cloud = points_upload(&points);
    for (uint32_t type = PATINA_LIGHT_SUN; type <= PATINA_LIGHT_AREA; type += 3) {
        patina_light_desc light = sun_at(50, 25);
        light.angle = 0.3f;
        light.type = type;
        light.position[0] = 1.5, light.position[2] = 2.5;
        patina_scene *scene = scene_of(cloud, NULL);
        float *truth = bake(device, scene, &light, 4096, points.count, NULL);
        uint32_t before = 0;
        for (size_t k = 0; k < sizeof targets / sizeof *targets; k++) {
            patina_settings settings = settings_default(64, 64);
            patina_camera camera = {.struct_size = sizeof camera};
            patina_frame_stats stats = {.struct_size = sizeof stats};
            patina_frame *frame = frame_on(device);
            float *values = malloc(points.count * sizeof *values);
            settings.shadow_error = targets[k];
            CHECK(patina_scene_set_settings(scene, &settings), scene);
            CHECK(patina_scene_frame_camera(scene, 20, 60, 0, &camera), scene);
            CHECK(patina_scene_set_camera(scene, &camera), scene);
            CHECK(patina_frame_render(frame, scene), frame);
            CHECK(patina_frame_get_stats(frame, &stats), frame);
            CHECK(patina_frame_read_shadows(frame, 0, 0, values, points.count * sizeof *values), frame);
            double off = off_in_penumbra(values, truth, points.count);
            printf("  %s, target %.3f: %u samples, expected %.4f, is %.4f\n", type == PATINA_LIGHT_SUN ? "sun  " : "panel",
                   (double)targets[k], stats.shadow_samples, (double)stats.shadow_error, off);
            assert_true(stats.shadow_error <= targets[k] && stats.shadow_error > 0.0f && off <= (double)stats.shadow_error);
            assert_true(stats.shadow_samples >= before && stats.shadow_maps == stats.shadow_samples && !stats.shadow_pending);
            before = stats.shadow_samples;
            free(values);
            patina_frame_destroy(frame);
        }
        free(truth);
        patina_scene_destroy(scene);
    }
    patina_cloud_destroy(cloud);
    points_free(&points);
    patina_device_destroy(device);
}

// Points, spots and panels above, beside and within reach of the ball: no acne and no leaks either.
static void test_near_lights(void **state)
{
    (void)state;
    static const struct {
        uint32_t type;
        double at[3];
    } lights[] = {
        {PATINA_LIGHT_POINT, {3, 2, 4}},       // one perspective view
        {PATINA_LIGHT_POINT, {1.2, 0.3, 0.9}}, // a cube: the plane is all around
        {PATINA_LIGHT_POINT, {0, 0, 1.6}},     {PATINA_LIGHT_SPOT, {-2.5, 0, 2.5}}, {PATINA_LIGHT_AREA, {0.4, -2.0, 2.2}},
    };
    patina_device *device = support_device_first();
    struct points points = ball_on_plane(PLANE, BALL, POINTS_NORMALS);
    patina_cloud *cloud = points_upload(&points);
    for (size_t l = 0; l < sizeof lights / sizeof *lights; l++) {
        patina_light_desc light = {
            .struct_size = sizeof light, .type = lights[l].type, .power = 10, .shadows = 1, .cone = 2.0f};
        memcpy(light.position, lights[l].at, sizeof light.position);
        light.size[0] = light.size[1] = 1e-6f;
        patina_scene *scene = scene_of(cloud, NULL);
        float *values = bake(device, scene, &light, 1, points.count, NULL);
        uint64_t wrong = 0, acne = 0, leaks = 0;
        for (uint64_t i = 0; i < points.count; i++) {
            double d[3], length = 0;
            for (int k = 0; k < 3; k++)
                d[k] = light.position[k] - points.position[3 * i + (uint64_t)k];
            for (int k = 0; k < 3; k++)
                length += d[k] * d[k];
            for (int k = 0; k < 3; k++)
                d[k] /= sqrt(length);
            struct truth truth = truth_of(&points, i, d, 2.0 * spacing, 0.2); // spacing varies with the distance
            int bad = fabs(values[i] - truth.lit) > 0.5;
            wrong += (uint64_t)(bad && !turned_away(&points, i, d));
            acne += bad && !truth.near && truth.lit > 0.5;
            leaks += bad && !truth.near && truth.lit < 0.5 && !turned_away(&points, i, d);
        }
        printf("  light %zu: %.3f%% wrong, %llu acne, %llu leaks\n", l, 100.0 * (double)wrong / (double)points.count,
               (unsigned long long)acne, (unsigned long long)leaks);
        assert_int_equal(acne, 0);
        assert_int_equal(leaks, 0);
        free(values);
        patina_scene_destroy(scene);
    }
    patina_cloud_destroy(cloud);
    points_free(&points);
    patina_device_destroy(device);
}

// A plate of random points, 1 x 1, half way from a lamp to a floor 1.2 below it, both as far apart: how much of the umbra is lit, away
// from its border, and over all of it where normals are known. A chunk holds parts of both: it is not seen as dense as the floor alone.
static void test_umbra(void **state)
{
    (void)state;
    enum { BARE, NORMALS, ANALYSED };
    static const char *const ways[] = {"without normals", "with normals", "analysed"};
    static const uint32_t types[] = {PATINA_LIGHT_POINT, PATINA_LIGHT_AREA, PATINA_LIGHT_SUN};
    static const char *const names[] = {"lamp", "panel", "sun"};
    patina_device *device = support_device_first();
    for (int fine = 0; fine < 2; fine++)
        for (int way = BARE; way <= ANALYSED; way++) {
            const double apart = fine ? 0.01 : 0.02, height = 1.2, side = 4.0;
            const uint64_t floor = (uint64_t)(side * side / (apart * apart) + 0.5),
                           plate = (uint64_t)(1.0 / (apart * apart) + 0.5);
            const unsigned columns = way == NORMALS ? POINTS_NORMALS : 0;
            struct points points = points_create(floor + plate, columns);
            struct points below = points_rectangle(floor, side, side, columns, 21),
                          above = points_rectangle(plate, 1.0, 1.0, columns, 22);
            static const double unit[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, up[3] = {0, 0, 0.6};
            points_transform(&above, unit, up);
            memcpy(points.position, below.position, floor * 12);
            memcpy(points.position + 3 * floor, above.position, plate * 12);
            if (columns) {
                memcpy(points.normal, below.normal, floor * 12);
                memcpy(points.normal + 3 * floor, above.normal, plate * 12);
            }
            points_free(&below);
            points_free(&above);
            patina_cloud *cloud = points_upload(&points);
            if (way == ANALYSED)
                CHECK(patina_cloud_analyse(cloud, NULL, NULL), NULL);
            for (size_t l = 0; l < sizeof types / sizeof *types; l++) {
                patina_light_desc light = {
                    .struct_size = sizeof light, .type = types[l], .power = 10, .shadows = 1, .size = {0.3f, 0.3f}};
                light.position[2] = height;
                light.direction[2] = -1.0;
                light.side[0] = 1.0;
                const double umbra = types[l] == PATINA_LIGHT_SUN ? 0.5 : types[l] == PATINA_LIGHT_AREA ? 0.85 : 1.0;
                const double margin = 4.0 * apart; // the plate's last two spacings, and as its shadow is twice as wide
                patina_scene *scene = scene_of(cloud, NULL);
                float *values = bake(device, scene, &light, types[l] == PATINA_LIGHT_AREA ? 16 : 1, points.count, NULL);
                double all = 0, lit = 0, inner = 0, leaks = 0, open = 0, dark = 0;
                for (uint64_t i = 0; i < floor; i++) {
                    const double off = fmax(fabs((double)points.position[3 * i]), fabs((double)points.position[3 * i + 1]));
                    all += off < umbra;
                    lit += off < umbra ? (double)values[i] : 0.0;
                    inner += off < umbra - margin;
                    leaks += off < umbra - margin ? (double)values[i] : 0.0;
                    open += off > 1.5;
                    dark += off > 1.5 ? 1.0 - (double)values[i] : 0.0;
                }
                printf("  spacing %.2f, %-5s %-15s: %.2f%% of the umbra lit, %.2f%% inside of it; %.2f%% of the light outside "
                       "lost\n",
                       apart, names[l], ways[way], 100.0 * lit / all, 100.0 * leaks / inner, 100.0 * dark / open);
                assert_true(leaks <= 0.01 * inner);
                assert_true(way == BARE || lit <= 0.02 * all); // the border itself, where the plate has its last random points
                assert_true(dark <= 0.001 * open);
                free(values);
                patina_scene_destroy(scene);
            }
            patina_cloud_destroy(cloud);
            points_free(&points);
        }
    patina_device_destroy(device);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sun_heights),    cmocka_unit_test(test_near_lights),  cmocka_unit_test(test_umbra),
        cmocka_unit_test(test_soft_converges), cmocka_unit_test(test_error_target),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
