// SPDX-License-Identifier: GPL-3.0-or-later
// A convex silhouette does not grow when holes are closed (SPEC 2.2); what the paper's single filling grows is printed.
// Truth: the exact polygon. Grown: pixels that show something though their square does not touch the shape, as a share
// of the shape's area. Missing: empty pixels whose square lies in the shape.
#include "analytic.h"
#include "clouds.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { SIZE = 256, TURNS = 9, ROUND = 4096 };
static const double unit = 96.0;  // pixels a world unit
static const double limit = 0.15; // percent that may grow at one point a pixel or more; tried: 0.12 for a disc, n = 4

enum kind { DISC, SQUARE, TRIANGLE };
static const char *const kind_names[] = {"disc", "square", "triangle"};
static const double triangle_corners[3][2] = {{-0.9, -0.7}, {1.0, -0.4}, {-0.2, 0.95}};

static double kind_area(enum kind kind)
{
    const double(*c)[2] = triangle_corners;
    switch (kind) {
    case DISC: return M_PI;
    case SQUARE: return 1.5 * 1.5;
    default: return 0.5 * fabs((c[1][0] - c[0][0]) * (c[2][1] - c[0][1]) - (c[2][0] - c[0][0]) * (c[1][1] - c[0][1]));
    }
}

static struct points sample(enum kind kind, uint64_t count, uint64_t seed)
{
    switch (kind) {
    case DISC: return points_disc(count, 1.0, POINTS_NORMALS, seed);
    case SQUARE: return points_rectangle(count, 1.5, 1.5, POINTS_NORMALS, seed);
    default: return points_triangle(count, triangle_corners, POINTS_NORMALS, seed);
    }
}

// Turned in its plane, then tilted, then turned in the picture's.
static void place(double turn, double tilt, double matrix[16])
{
    double c = cos(turn), s = sin(turn), ct = cos(tilt), st = sin(tilt);
    const double rows[16] = {c, -s * ct, s * st, 0.013, s, c * ct, -c * st, -0.007, 0, st, ct, 0, 0, 0, 0, 1};
    for (int k = 0; k < 16; k++)
        matrix[k] = rows[k];
}

static struct polygon outline(enum kind kind, const double m[16], const patina_camera *camera)
{
    uint32_t count = kind == DISC ? ROUND : kind == SQUARE ? 4 : 3;
    double(*corner)[3] = malloc(count * sizeof *corner);
    if (!corner)
        support_die("out of memory");
    for (uint32_t i = 0; i < count; i++) {
        double p[2];
        if (kind == DISC) {
            p[0] = cos(2.0 * M_PI * i / count);
            p[1] = sin(2.0 * M_PI * i / count);
        } else if (kind == SQUARE) {
            p[0] = i == 0 || i == 3 ? -0.75 : 0.75;
            p[1] = i < 2 ? -0.75 : 0.75;
        } else {
            p[0] = triangle_corners[i][0];
            p[1] = triangle_corners[i][1];
        }
        for (int k = 0; k < 3; k++)
            corner[i][k] = m[4 * k] * p[0] + m[4 * k + 1] * p[1] + m[4 * k + 3];
    }
    struct polygon polygon = polygon_project((const double(*)[3])corner, count, camera, SIZE, SIZE);
    free(corner);
    return polygon;
}

struct growth {
    double grown_mean, grown_worst, missing_mean, missing_worst; // percent
};

static patina_cloud *shape_cloud(enum kind kind, double tilt, double density)
{
    uint64_t count = (uint64_t)(density * kind_area(kind) * cos(tilt) * unit * unit);
    struct points points = sample(kind, count, 17 + (uint64_t)kind);
    patina_cloud *cloud = points_upload(&points);
    points_free(&points);
    return cloud;
}

static struct growth measure(patina_device *device, const patina_cloud *cloud, enum kind kind, double tilt, int orthographic,
                             uint32_t fill, uint32_t iterations)
{
    const double eye[3] = {0.0, 0.0, 8.0}, target[3] = {0.0, 0.0, 0.0};
    double window = SIZE / unit, fov = 2.0 * atan(0.5 * window / 8.0) * 180.0 / M_PI;
    patina_camera camera = orthographic ? camera_orthographic(eye, target, window, SIZE, SIZE, -20.0, 20.0)
                                        : camera_perspective(eye, target, fov, SIZE, SIZE, 0.1, 100.0);
    patina_settings settings = settings_default(SIZE, SIZE);
    settings.fill = fill;
    settings.fill_iterations = iterations;
    struct growth growth = {0};
    for (int turn = 0; turn < TURNS; turn++) {
        patina_cloud_style style = {.struct_size = sizeof style};
        place(turn * 0.5 * M_PI / (TURNS - 1), tilt, style.world_from_object);
        patina_scene *scene = scene_of(cloud, &style);
        struct picture picture = picture_render(device, scene, &camera, &settings);
        struct polygon polygon = outline(kind, style.world_from_object, &camera);
        struct silhouette found = polygon_compare(&polygon, &picture);
        double grown = 100.0 * (double)found.grown / found.area, missing = 100.0 * (double)found.missing / found.area;
        growth.grown_mean += grown / TURNS;
        growth.missing_mean += missing / TURNS;
        growth.grown_worst = fmax(growth.grown_worst, grown);
        growth.missing_worst = fmax(growth.missing_worst, missing);
        polygon_free(&polygon);
        picture_free(&picture);
        patina_scene_destroy(scene);
    }
    return growth;
}

static void test_convex_shapes(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    static const double tilts[] = {0.0, 45.0, 75.0}, densities[] = {0.2, 1.0, 2.0, 4.0, 10.0};
    double worst = 0.0, sparse = 0.0;
    printf("  %% of the shape's area, 9 turns from 0 to 90 degrees, mean (worst)\n"
           "  shape     view  tilt  points/px |  closed: grown        missing       | paper: grown         missing\n");
    for (int kind = DISC; kind <= TRIANGLE; kind++)
        for (uint32_t i = 0; i < 15; i++) {
            double tilt = tilts[i / 5] * M_PI / 180.0, density = densities[i % 5];
            patina_cloud *cloud = shape_cloud((enum kind)kind, tilt, density);
            for (int orthographic = 1; orthographic >= 0; orthographic--) {
                struct growth closed = measure(device, cloud, (enum kind)kind, tilt, orthographic, PATINA_FILL_CLOSED, 0);
                struct growth paper = measure(device, cloud, (enum kind)kind, tilt, orthographic, PATINA_FILL_PAPER, 0);
                printf("  %-9s %-5s %4.0f  %9g | %6.3f (%6.3f)  %6.3f (%6.3f) | %6.3f (%6.3f)  %6.3f (%6.3f)\n",
                       kind_names[kind], orthographic ? "ortho" : "persp", tilts[i / 5], density, closed.grown_mean,
                       closed.grown_worst, closed.missing_mean, closed.missing_worst, paper.grown_mean, paper.grown_worst,
                       paper.missing_mean, paper.missing_worst);
                if (density < 1.0)
                    sparse = fmax(sparse, closed.grown_worst);
                else
                    worst = fmax(worst, closed.grown_worst);
            }
            patina_cloud_destroy(cloud);
        }
    printf("  closed mode grows at most %.3f%% (allowed %.2f%%); at 0.2 points a pixel %.3f%%\n", worst, limit, sparse);
    if (worst > limit)
        support_die("a convex silhouette grew by %.3f%% of its area, more than %.2f%%", worst, limit);
    patina_device_destroy(device);
}

// The number of fills asked for must not matter to the growth either: an artist may ask for many.
static void test_iterations(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    double worst = 0.0;
    printf("  a front-facing disc at 1 point a pixel, by the number of fills, %%\n"
           "   n | closed: grown missing | paper: grown missing\n");
    patina_cloud *cloud = shape_cloud(DISC, 0.0, 1.0);
    for (uint32_t n = 1; n <= 16; n *= 2) {
        struct growth closed = measure(device, cloud, DISC, 0.0, 1, PATINA_FILL_CLOSED, n);
        struct growth paper = measure(device, cloud, DISC, 0.0, 1, PATINA_FILL_PAPER, n);
        printf("  %2u |        %6.3f  %6.3f |       %6.3f  %6.3f\n", n, closed.grown_worst, closed.missing_worst,
               paper.grown_worst, paper.missing_worst);
        worst = fmax(worst, closed.grown_worst);
    }
    patina_cloud_destroy(cloud);
    if (worst > limit)
        support_die("a disc grew by %.3f%% of its area, more than %.2f%%", worst, limit);
    patina_device_destroy(device);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_convex_shapes),
        cmocka_unit_test(test_iterations),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
