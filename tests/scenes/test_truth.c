// SPDX-License-Identifier: GPL-3.0-or-later
// Sphere, torus and plane against their exact picture: coverage, depth, normal and Lambert colour. Not against another
// implementation of ours: against the surface that the points were drawn from.
#include "analytic.h"
#include "clouds.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { SIZE = 384 };

struct bounds {
    double iou;                       // at least
    double inner_holes, outer_growth; // at most, percent
    double depth_rms, depth_p999;     // spacings
    double normal_mean;               // degrees
    double color_rms;                 // share of white
};

struct scenario {
    const char *name;
    enum analytic_kind kind;
    double density; // points a pixel where the surface faces the camera; on the plane, everywhere
    int orthographic;
    unsigned columns;
    uint32_t quality; // DISCS: no filling, points are discs; ANALYSED: as wide as an analysis says
    struct bounds bounds;
};
enum { DISCS = 2, ANALYSED = 4 };

// Limits are what was measured when the test was written and a fifth or so: a picture that gets worse fails.
// Read with care: at 4 points a pixel the nearest of several points wins, which is half a pixel's slope before the
// surface at the pixel's centre, and a spacing is half a pixel: hence the larger figures in spacings.
// Discs are not culled here: of random points 0.007% of the pixels lie between them and show the far side, which is what the
// depth's root mean square counts beside its 99.9th percentile. They grow beyond a plane's border, by up to their radius.
// clang-format off
static const struct scenario scenarios[] = {
    //                                                               IoU   inner outer depth p99.9 normal color
    {"sphere",                 SPHERE, 0.3, 0, POINTS_NORMALS, 0, {0.982, 0.05, 0.30, 0.65, 3.2, 0.42, 0.0110}},
    {"sphere",                 SPHERE, 1.0, 0, POINTS_NORMALS, 0, {0.987, 0.01, 0.02, 0.56, 3.2, 0.31, 0.0037}},
    {"sphere",                 SPHERE, 4.0, 0, POINTS_NORMALS, 0, {0.986, 0.01, 0.02, 1.45, 7.0, 0.38, 0.0060}},
    {"sphere, paper's depth",  SPHERE, 1.0, 0, POINTS_NORMALS, 1, {0.987, 0.01, 0.02, 0.95, 5.3, 0.58, 0.0063}},
    {"sphere, orthographic",   SPHERE, 1.0, 1, POINTS_NORMALS, 0, {0.987, 0.01, 0.02, 0.66, 3.5, 0.34, 0.0042}},
    {"sphere without normals", SPHERE, 1.0, 0, POINTS_PLAIN,   0, {0.987, 0.01, 0.02, 0.56, 3.2, 1.05, 0.0108}},
    {"torus",                  TORUS,  0.3, 0, POINTS_NORMALS, 0, {0.974, 0.05, 0.70, 0.66, 3.9, 0.70, 0.0146}},
    {"torus",                  TORUS,  1.0, 0, POINTS_NORMALS, 0, {0.984, 0.01, 0.05, 0.55, 3.6, 0.52, 0.0052}},
    {"torus",                  TORUS,  4.0, 0, POINTS_NORMALS, 0, {0.984, 0.01, 0.02, 1.40, 8.5, 0.64, 0.0080}},
    {"torus, paper's depth",   TORUS,  1.0, 0, POINTS_NORMALS, 1, {0.984, 0.01, 0.05, 0.98, 5.5, 0.94, 0.0093}},
    {"torus, orthographic",    TORUS,  1.0, 1, POINTS_NORMALS, 0, {0.984, 0.01, 0.05, 0.60, 3.6, 0.56, 0.0060}},
    {"torus without normals",  TORUS,  4.0, 0, POINTS_PLAIN,   0, {0.984, 0.01, 0.02, 1.40, 8.5, 0.90, 0.0117}},
    {"plane at 60 degrees",    PLANE,  0.3, 0, POINTS_NORMALS, 0, {0.975, 0.40, 0.05, 0.65, 2.5, 0.01, 0.0005}},
    {"plane at 60 degrees",    PLANE,  1.0, 0, POINTS_NORMALS, 0, {0.988, 0.01, 0.02, 0.45, 1.0, 0.01, 0.0005}},
    {"plane at 60 degrees",    PLANE,  4.0, 0, POINTS_NORMALS, 0, {0.987, 0.01, 0.02, 1.00, 1.9, 0.01, 0.0005}},
    {"plane, paper's depth",   PLANE,  1.0, 0, POINTS_NORMALS, 1, {0.988, 0.01, 0.02, 1.20, 4.0, 0.01, 0.0005}},
    {"plane, orthographic",    PLANE,  1.0, 1, POINTS_NORMALS, 0, {0.988, 0.01, 0.02, 0.45, 0.8, 0.01, 0.0005}},
    {"plane without normals",  PLANE,  1.0, 0, POINTS_PLAIN,   0, {0.988, 0.01, 0.02, 0.65, 2.2, 1.00, 0.0060}},
    {"sphere, discs",          SPHERE, 0.3, 0, POINTS_NORMALS, DISCS, {0.989, 0.01, 0.02, 0.066, 0.26, 0.36, 0.0089}},
    {"sphere, discs",          SPHERE, 1.0, 0, POINTS_NORMALS, DISCS, {0.988, 0.01, 0.02, 0.668, 3.18, 0.19, 0.0047}},
    {"sphere, discs",          SPHERE, 4.0, 0, POINTS_NORMALS, DISCS, {0.987, 0.01, 0.02, 1.286, 7.08, 0.09, 0.002}},
    {"sphere, discs, ortho",   SPHERE, 1.0, 1, POINTS_NORMALS, DISCS, {0.988, 0.01, 0.02, 0.863, 3.54, 0.19, 0.0052}},
    {"sphere, discs, no normals", SPHERE, 1.0, 0, POINTS_PLAIN, DISCS, {0.959, 0.01, 1.6, 2.937, 11.65, 2.25, 0.0296}},
    {"torus, discs",           TORUS,  0.3, 0, POINTS_NORMALS, DISCS, {0.988, 0.01, 0.02, 0.382, 0.52, 0.71, 0.0212}},
    {"torus, discs",           TORUS,  1.0, 0, POINTS_NORMALS, DISCS, {0.986, 0.01, 0.02, 0.242, 3.57, 0.32, 0.0046}},
    {"torus, discs",           TORUS,  4.0, 0, POINTS_NORMALS, DISCS, {0.985, 0.01, 0.02, 1.147, 8.56, 0.16, 0.0036}},
    {"plane, discs",           PLANE,  1.0, 0, POINTS_NORMALS, DISCS, {0.949, 0.01, 1.42, 0.001, 0.002, 0.01, 0.0005}},
    {"sphere, analysed discs", SPHERE, 0.3, 0, POINTS_NORMALS, ANALYSED, {0.989, 0.01, 0.02, 0.94, 0.56, 0.41, 0.0138}},
    {"sphere, analysed discs", SPHERE, 1.0, 0, POINTS_NORMALS, ANALYSED, {0.988, 0.01, 0.02, 2.30, 3.23, 0.22, 0.0081}},
    {"sphere, analysed discs", SPHERE, 4.0, 0, POINTS_NORMALS, ANALYSED, {0.987, 0.01, 0.02, 1.33, 7.08, 0.10, 0.0026}},
    {"torus, analysed discs",  TORUS,  1.0, 0, POINTS_NORMALS, ANALYSED, {0.986, 0.01, 0.02, 1.00, 3.62, 0.40, 0.0066}},
};
// clang-format on

static const double sun_towards[3] = {0.36, -0.48, 0.8};

struct setting {
    struct analytic_shape shape;
    struct points points;
    patina_camera camera;
    double spacing; // 1 / sqrt(points per area), world units
};

static struct setting prepare(const struct scenario *scenario)
{
    struct setting set;
    double a = 1.0, b = 0.4, area;
    double pixel = 3.4 / SIZE; // world units at the target
    double distance = 6.0;
    if (scenario->kind == SPHERE) {
        area = area_sphere(a);
    } else if (scenario->kind == TORUS) {
        area = area_torus(a, b);
    } else {
        a = b = 1.8;
        area = a * b;
    }
    double facing = scenario->kind == PLANE ? 0.5 : 1.0; // cosine of the plane's tilt
    uint64_t count = (uint64_t)(scenario->density * area * facing / (pixel * pixel));
    set.shape = analytic_shape(scenario->kind, a, b);
    set.spacing = sqrt(area / (double)count);
    if (scenario->kind == SPHERE)
        set.points = points_sphere(count, a, scenario->columns, 21);
    else if (scenario->kind == TORUS)
        set.points = points_torus(count, a, b, scenario->columns, 22);
    else
        set.points = points_rectangle(count, a, b, scenario->columns, 23);
    double elevation = scenario->kind == PLANE ? 30.0 : 40.0; // above the horizon
    double high = sin(elevation * M_PI / 180.0), across = cos(elevation * M_PI / 180.0);
    const double eye[3] = {0.3 * distance * across, -0.9539392 * distance * across, distance * high};
    const double target[3] = {0.0, 0.0, 0.0};
    set.camera = scenario->orthographic
                     ? camera_orthographic(eye, target, 3.4, SIZE, SIZE, -10.0, 20.0)
                     : camera_perspective(eye, target, 2.0 * atan(1.7 / distance) * 180.0 / M_PI, SIZE, SIZE, 0.1, 100.0);
    return set;
}

static struct analytic_error measure(patina_device *device, const struct scenario *scenario)
{
    struct setting set = prepare(scenario);
    patina_cloud *cloud = points_upload(&set.points);
    points_free(&set.points);
    if (scenario->quality == ANALYSED)
        CHECK(patina_cloud_analyse(cloud, NULL, NULL), cloud);
    patina_cloud_style style = {.struct_size = sizeof style, .lighting = PATINA_LIGHTING_LIT};
    patina_scene *scene = scene_of(cloud, &style);
    patina_light_desc sun = {.struct_size = sizeof sun, .type = PATINA_LIGHT_SUN, .power = (float)M_PI};
    for (int k = 0; k < 3; k++)
        sun.direction[k] = -sun_towards[k];
    CHECK(patina_scene_add_light(scene, &sun), scene);
    patina_settings settings = settings_default(SIZE, SIZE);
    settings.film_transparent = 1;
    settings.quality = scenario->quality % DISCS;
    settings.surface = scenario->quality >= DISCS ? PATINA_SURFACE_SPLATS : PATINA_SURFACE_FILL;
    struct picture picture = picture_render(device, scene, &set.camera, &settings);
    struct analytic_hit *truth = analytic_picture(&set.shape, &set.camera, SIZE, SIZE);
    // A sun of pi W/m2 shows a Lambert surface that faces it in its own colour, 0.8.
    struct analytic_error error = analytic_compare(&picture, truth, set.spacing, sun_towards, 0.8);
    free(truth);
    picture_free(&picture);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    return error;
}

static int within(const struct analytic_error *error, const struct bounds *bounds)
{
    return error->iou >= bounds->iou && 100.0 * error->inner_holes <= bounds->inner_holes &&
           100.0 * error->outer_growth <= bounds->outer_growth && error->depth_rms <= bounds->depth_rms &&
           error->depth_p999 <= bounds->depth_p999 && error->normal_mean <= bounds->normal_mean &&
           error->color_rms <= bounds->color_rms;
}

static void test_known_shapes(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    uint32_t failures = 0;
    printf("  %dx%d; holes and growth in %% of the truth's pixels (inner, outer: a pixel away from its border); depth in\n"
           "  spacings, normals in degrees, colour as a share of white, all where the truth covers the 3x3 around\n"
           "  shape                   pts/px |    IoU |  holes  inner | growth  outer | depth rms  p99.9 | normal mean  "
           "p99 | colour rms   p99\n",
           SIZE, SIZE);
    for (uint32_t i = 0; i < sizeof scenarios / sizeof scenarios[0]; i++) {
        const struct scenario *scenario = &scenarios[i];
        struct analytic_error error = measure(device, scenario);
        int good = within(&error, &scenario->bounds);
        printf("  %-23s %6g | %.4f | %6.3f %6.4f | %6.3f %6.4f | %9.4f %6.3f | %11.3f %6.2f | %9.4f %6.4f%s\n", scenario->name,
               scenario->density, error.iou, 100.0 * error.holes, 100.0 * error.inner_holes, 100.0 * error.growth,
               100.0 * error.outer_growth, error.depth_rms, error.depth_p999, error.normal_mean, error.normal_p99,
               error.color_rms, error.color_p99, good ? "" : "  <- beyond its bounds");
        failures += (uint32_t)!good;
    }
    assert_int_equal(failures, 0);
    patina_device_destroy(device);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_known_shapes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
