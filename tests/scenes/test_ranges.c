// SPDX-License-Identifier: GPL-3.0-or-later
// Range images: scans that do not quite fit are one surface, nearer to the truth than the nearest point; outlines border on what lies
// behind; hard input draws something sound; what is wrong is refused.
#include "clouds.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIZE = 160 };

static const double window = 2.6; // world units that the picture is high

enum shape { SPHERE, BOX };

// z of the front of a ball or a box turned by 30 degrees, seen along -y from (x, z); NAN: nothing. n: its normal.
static double front(enum shape shape, double x, double z, double n[3])
{
    if (shape == SPHERE) {
        const double square = 1.0 - x * x - z * z;
        if (!(square > 0.0))
            return NAN;
        n[0] = x;
        n[1] = -sqrt(square);
        n[2] = z;
        return n[1];
    }
    const double c = cos(0.5), s = sin(0.5), half = 0.7; // corner at (half (c - s), -half (c + s))
    const double corner = half * (c - s);
    if (fabs(z) > half || x < -half * (c + s) || x > half * (c + s))
        return NAN;
    const int right = x > corner;
    n[0] = right ? c : -s;
    n[1] = right ? -s : -c;
    n[2] = 0.0;
    return -half * (c + s) + fabs(x - corner) * (right ? c / s : s / c);
}

// Two scans, each a grid of directions from its own side, off by `offset` along their view and by noise; both in intervals.
static patina_cloud *two_scans(enum shape shape, double interval, double offset, double noise)
{
    const uint32_t side = (uint32_t)(2.4 / interval);
    struct points points = points_create(2 * (uint64_t)side * side, POINTS_PLAIN);
    struct pcg random = pcg_seed(3);
    uint64_t count = 0;
    for (int scan = 0; scan < 2; scan++) {
        const double turn = scan ? 0.35 : -0.35, c = cos(turn), s = sin(turn); // seen from there
        for (uint32_t i = 0; i < side * side; i++) {
            const double u = -1.2 + interval * (i % side + pcg_unit(&random) * 0.2),
                         v = -1.2 + interval * (i / side + 0.1 * scan);
            double n[3], best = NAN, place[3] = {0};
            // marches along the scanner's ray to the surface
            for (double along = -1.5; along < 1.0 && isnan(best); along += 0.002) {
                const double x = c * u - s * along, y = s * u + c * along, surface = front(shape, x, v, n);
                if (y >= surface) {
                    best = along + interval * (noise * (pcg_unit(&random) + pcg_unit(&random) + pcg_unit(&random) - 1.5) * 2.0 +
                                               (scan ? 0.5 : -0.5) * offset);
                    place[0] = c * u - s * best;
                    place[1] = s * u + c * best;
                    place[2] = v;
                }
            }
            for (int k = 0; k < 3 && !isnan(best); k++)
                points.position[3 * count + (uint64_t)k] = (float)place[k];
            count += !isnan(best);
        }
    }
    points.count = count;
    patina_cloud *cloud = points_upload(&points);
    points_free(&points);
    return cloud;
}

struct off {
    double depth, normal, missing; // root mean square, intervals; mean angle, degrees; share of the pixels
};

static struct off measure(const struct picture *picture, enum shape shape, double interval)
{
    struct off off = {0};
    double pixels = 0.0, open = 0.0;
    for (uint32_t y = 0; y < SIZE; y++)
        for (uint32_t x = 0; x < SIZE; x++) {
            const double u = window * ((x + 0.5) / SIZE - 0.5), v = window * ((y + 0.5) / SIZE - 0.5);
            const size_t at = (size_t)y * SIZE + x;
            double n[3];
            const double depth = front(shape, u, v, n);
            if (isnan(depth) || n[1] > -0.6 ||
                (shape == BOX && (fabs(v) > 0.6 || fabs(u - 0.7 * (cos(0.5) - sin(0.5))) < 0.08)))
                continue;
            pixels += 1.0;
            if (isinf(picture->depth[at])) {
                open += 1.0;
                continue;
            }
            const float *m = picture->normal + 3 * at;
            const double wrong = ((double)picture->depth[at] - (5.0 - 0.1 + depth)) / interval;
            const double cosine = m[0] * n[0] + m[1] * n[1] + m[2] * n[2];
            off.depth += wrong * wrong;
            off.normal += acos(fmax(fmin(cosine, 1.0), -1.0)) * 57.29577951308232;
        }
    off.depth = sqrt(off.depth / (pixels - open));
    off.normal /= pixels - open;
    off.missing = open / pixels;
    return off;
}

static struct picture draw(patina_device *device, const patina_cloud *cloud, const patina_cloud_style *style, uint32_t surface)
{
    const double eye[3] = {0, -5, 0}, target[3] = {0, 0, 0};
    const patina_camera camera = camera_orthographic(eye, target, window, SIZE, SIZE, 0.1, 100.0);
    patina_settings settings = settings_default(SIZE, SIZE);
    settings.surface = surface;
    patina_scene *scene = scene_of(cloud, style);
    struct picture picture = picture_render(device, scene, &camera, &settings);
    patina_scene_destroy(scene);
    return picture;
}

// Against the nearest point alone (gamma next to nothing), and against filling and discs.
static void test_registration(void **state)
{
    (void)state;
    static const double interval = 0.03, cases[][2] = {{0.0, 0.3}, {1.0, 0.3}, {1.5, 0.0}};
    patina_device *device = support_device_first();
    for (int i = 0; i < 6; i++) {
        const enum shape shape = i < 3 ? SPHERE : BOX;
        patina_cloud *cloud = two_scans(shape, interval, cases[i % 3][0], cases[i % 3][1]);
        patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
        struct off off[4];
        for (int k = 0; k < 4; k++) {
            style.range_gamma = k == 1 ? 1e-9f : (float)(3.0 * interval);
            struct picture picture = draw(device, cloud, &style,
                                          k < 2    ? PATINA_SURFACE_RANGES
                                          : k == 2 ? PATINA_SURFACE_FILL
                                                   : PATINA_SURFACE_SPLATS);
            off[k] = measure(&picture, shape, interval);
            picture_free(&picture);
        }
        print_message(
            "  %s, %.1f intervals apart, noise %.1f: depth %.3f, without gamma %.3f, filled %.3f, discs %.3f intervals; "
            "normals %.1f, %.1f, %.1f, %.1f degrees; open %.2f %%\n",
            shape == SPHERE ? "sphere" : "box", cases[i % 3][0], cases[i % 3][1], off[0].depth, off[1].depth, off[2].depth,
            off[3].depth, off[0].normal, off[1].normal, off[2].normal, off[3].normal, 100.0 * off[0].missing);
        assert_true(off[0].depth < 0.8 * off[1].depth);
        assert_true(cases[i % 3][1] == 0.0 || off[0].normal < (cases[i % 3][0] > 0.0 ? 1.2 : 0.8) * off[1].normal);
        assert_true(off[0].normal < off[2].normal && off[0].normal < off[3].normal);
        assert_true(off[0].depth < off[2].depth && off[0].depth < off[3].depth);
        assert_true(off[0].missing < 0.002);
        patina_cloud_destroy(cloud);
    }
    patina_device_destroy(device);
}

static patina_cloud *cloud_of(const float *positions, uint64_t count, const double origin[3])
{
    patina_cloud_desc desc = {.struct_size = sizeof desc, .count = count};
    patina_cloud *cloud = NULL;
    desc.position = (patina_array){.data = positions, .type = PATINA_FLOAT32, .components = 3};
    memcpy(desc.origin, origin, sizeof desc.origin);
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    return cloud;
}

static const double nowhere[3] = {0, 0, 0};

// A point is its pixel, whatever the cells; no point is nothing.
static void test_few_points(void **state)
{
    (void)state;
    const float place[] = {0.3f, 0.0f, 0.2f, -0.4f, 0.0f, 0.2f};
    static const float pixels[] = {0.0f, 1.0f, 7.3f, 64.0f}; // the last as wide as both
    patina_device *device = support_device_first();
    for (uint64_t count = 0; count < 3; count++)
        for (int k = 0; k < (count < 2 ? 4 : 3); k++) {
            patina_cloud *cloud = cloud_of(place, count, nowhere);
            patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
            style.range_pixel = pixels[k];
            struct picture picture = draw(device, cloud, &style, PATINA_SURFACE_RANGES);
            assert_int_equal(picture_count(&picture), count);
            for (uint64_t i = 0; i < count; i++) {
                const uint32_t x = (uint32_t)(SIZE * ((double)place[3 * i] / window + 0.5)),
                               y = (uint32_t)(SIZE * (0.2 / window + 0.5));
                const size_t at = (size_t)y * SIZE + x;
                assert_int_equal(key_id(picture.keys[at]), i);
                assert_true(fabs((double)picture.depth[at] - 4.9) < 1e-5 && fabsf(picture.source[at]) == 1.0f);
            }
            picture_free(&picture);
            patina_cloud_destroy(cloud);
        }
    patina_device_destroy(device);
}

// The same sphere far from the origin, with gamma of anything, with cells wider than the picture, and seen from within.
static void test_hard(void **state)
{
    (void)state;
    struct points points = points_sphere(40000, 1.0, POINTS_PLAIN, 5);
    const double far[3] = {5e6, -5e6, 5e6}, eye[3] = {0, -0.5, 0}, target[3] = {0, 1, 0};
    patina_device *device = support_device_first();
    patina_cloud *near = cloud_of(points.position, points.count, nowhere), *away = cloud_of(points.position, points.count, far);
    patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
    struct picture first = draw(device, near, &style, PATINA_SURFACE_RANGES);
    for (int k = 0; k < 3; k++)
        style.world_from_object[5 * k] = 1.0;
    style.world_from_object[15] = 1.0;
    for (int k = 0; k < 3; k++)
        style.world_from_object[4 * k + 3] = -far[k];
    struct picture second = draw(device, away, &style, PATINA_SURFACE_RANGES);
    for (size_t i = 0; i < (size_t)SIZE * SIZE; i++)
        assert_true(first.depth[i] == second.depth[i] || fabsf(first.depth[i] - second.depth[i]) < 1e-5f);
    picture_free(&second);
    style = (patina_cloud_style)PATINA_CLOUD_STYLE_INIT;
    style.range_gamma = INFINITY; // front and back are one surface, in its middle, but the outline stays
    second = draw(device, near, &style, PATINA_SURFACE_RANGES);
    assert_true(fabs((double)picture_count(&second) - (double)picture_count(&first)) < 0.02 * (double)picture_count(&first));
    for (size_t i = 0; i < (size_t)SIZE * SIZE; i++)
        assert_true(isinf(second.depth[i]) || (second.depth[i] > 3.85f && second.depth[i] < 5.95f));
    picture_free(&second);
    style.range_gamma = 0.0f;
    style.range_pixel = 64.0f;
    second = draw(device, near, &style, PATINA_SURFACE_RANGES);
    assert_true(picture_count(&second) > 0);
    picture_free(&second);
    picture_free(&first);
    style.range_pixel = 0.0f;
    const patina_camera camera = camera_perspective(eye, target, 90.0, SIZE, SIZE, 0.01, 100.0);
    patina_settings settings = settings_default(SIZE, SIZE);
    settings.surface = PATINA_SURFACE_RANGES;
    patina_scene *scene = scene_of(near, &style);
    second = picture_render(device, scene, &camera, &settings);
    assert_int_equal(picture_count(&second), SIZE * SIZE); // all around, and nothing of what lies behind the eye
    for (size_t i = 0; i < (size_t)SIZE * SIZE; i++)
        assert_true(second.depth[i] > 0.2f && second.depth[i] < 1.55f);
    picture_free(&second);
    patina_scene_destroy(scene);
    points_free(&points);
    patina_cloud_destroy(near);
    patina_cloud_destroy(away);
    patina_device_destroy(device);
}

// Two sheets of glass, one behind the other: two layers, each where it is, and light comes through both.
static void test_layers(void **state)
{
    (void)state;
    const uint32_t side = 90;
    float *place = malloc(2 * 3 * sizeof *place * side * side);
    for (uint32_t i = 0; i < 2 * side * side; i++) {
        const uint32_t at = i % (side * side);
        place[3 * i] = 0.025f * (float)(at % side) - 1.1f;
        place[3 * i + 1] = i < side * side ? 0.0f : 0.5f;
        place[3 * i + 2] = 0.025f * (float)(at / side) - 1.1f;
    }
    patina_device *device = support_device_first();
    patina_cloud *cloud = cloud_of(place, 2 * side * side, nowhere);
    patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
    style.transparency = 0.5f;
    style.lighting = PATINA_LIGHTING_UNLIT;
    const double eye[3] = {0, -5, 0}, target[3] = {0, 0, 0};
    const patina_camera camera = camera_orthographic(eye, target, window, SIZE, SIZE, 0.1, 100.0);
    patina_settings settings = settings_default(SIZE, SIZE);
    settings.surface = PATINA_SURFACE_RANGES;
    settings.film_transparent = 1;
    settings.layer_passes = 1u << PATINA_PASS_COMBINED | 1u << PATINA_PASS_DEPTH | 1u << PATINA_PASS_NORMAL;
    patina_scene *scene = scene_of(cloud, &style);
    struct picture picture = picture_render(device, scene, &camera, &settings);
    for (uint32_t y = SIZE / 5; y < SIZE - SIZE / 5; y++)
        for (uint32_t x = SIZE / 5; x < SIZE - SIZE / 5; x++) {
            const size_t at = (size_t)y * SIZE + x, pixels = (size_t)SIZE * SIZE;
            assert_true(fabs((double)picture.layer_depth[at] - 4.9) < 1e-4);
            assert_true(fabs((double)picture.layer_depth[pixels + at] - 5.4) < 1e-4);
            assert_true(isinf(picture.layer_depth[2 * pixels + at]));
            assert_true(fabs((double)picture.combined[4 * at + 3] - 0.75) < 1e-3);
            assert_true(fabs((double)picture.normal[3 * at + 1] + 1.0) < 1e-4);
        }
    picture_free(&picture);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    patina_device_destroy(device);
    free(place);
}

// A ball of range images over a floor that is filled: the ball hides it, and shadows it.
static void test_beside_others(void **state)
{
    (void)state;
    const double eye[3] = {0, -3, 2.5}, target[3] = {0, 0, 0}, flat[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, up[3] = {0, 0, 0.8},
                 down[3] = {0, 0, -0.2};
    struct points ball = points_sphere(30000, 0.4, POINTS_PLAIN, 5), floor_points = points_disc(60000, 2.0, POINTS_NORMALS, 6);
    points_transform(&ball, flat, up);
    points_transform(&floor_points, flat, down);
    patina_cloud *clouds[2] = {points_upload(&ball), points_upload(&floor_points)};
    patina_device *device = support_device_first();
    patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
    patina_light_desc sun = {.struct_size = sizeof sun, .type = PATINA_LIGHT_SUN, .power = 3.0f, .shadows = 1};
    const patina_camera camera = camera_perspective(eye, target, 50.0, SIZE, SIZE, 0.1, 100.0);
    const double middle[3] = {0, 0, 0.8}, under[3] = {0, 0, -0.2}, beside[3] = {0.9, 0, -0.2};
    static const uint32_t surfaces[] = {PATINA_SURFACE_FILL, PATINA_SURFACE_SPLATS, PATINA_SURFACE_AUTO};
    sun.direction[2] = -1.0;
    for (int k = 0; k < 3; k++) {
        patina_scene *scene = NULL;
        patina_settings settings = settings_default(SIZE, SIZE);
        double x, y, z;
        settings.surface = surfaces[k];
        style.surface = PATINA_SURFACE_RANGES;
        CHECK(patina_scene_create(&scene), NULL);
        CHECK(patina_scene_add_cloud(scene, clouds[0], &style), scene);
        style.surface = 0;
        CHECK(patina_scene_add_cloud(scene, clouds[1], &style), scene);
        CHECK(patina_scene_add_light(scene, &sun), scene);
        struct picture picture = picture_render(device, scene, &camera, &settings);
        camera_project(&camera, SIZE, SIZE, middle, &x, &y, &z);
        size_t at = (size_t)y * SIZE + (size_t)x;
        assert_true(key_id(picture.keys[at]) < ball.count && (double)picture.depth[at] < z - 0.35);
        camera_project(&camera, SIZE, SIZE, under, &x, &y, &z);
        at = (size_t)y * SIZE + (size_t)x;
        const float dark = picture.combined[4 * at];
        assert_true(key_id(picture.keys[at]) >= ball.count);
        camera_project(&camera, SIZE, SIZE, beside, &x, &y, &z);
        at = (size_t)y * SIZE + (size_t)x;
        assert_true(dark < 0.5f * picture.combined[4 * at]);
        picture_free(&picture);
        patina_scene_destroy(scene);
    }
    for (int k = 0; k < 2; k++)
        patina_cloud_destroy(clouds[k]);
    points_free(&ball);
    points_free(&floor_points);
    patina_device_destroy(device);
}

// A sphere in two scans, from before and from behind: what looks away from the view is left out, and with it the back.
static void test_cull(void **state)
{
    (void)state;
    struct points points = points_sphere(40000, 1.0, POINTS_PLAIN, 5);
    uint16_t *of = malloc(points.count * sizeof *of);
    for (uint64_t i = 0; i < points.count; i++)
        of[i] = points.position[3 * i + 1] > 0.0f;
    // before: seen along +y; behind: the other way; a scan without points, and one that looks all around
    const patina_scan scans[] = {{{0, 3, 0}, 0.01}, {{0, -1, 0}, 0.01}, {{0, -1, 0}, 0.0}, {{0, 0, 0}, 0.0}};
    patina_device *device = support_device_first();
    patina_cloud *cloud = points_upload(&points);
    patina_scans *known = NULL;
    patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
    CHECK(patina_scans_create(cloud, of, scans, 4, &known), cloud);
    style.scans = known;
    style.transparency = 0.5f;
    const double eye[3] = {0, -5, 0}, target[3] = {0, 0, 0};
    const patina_camera camera = camera_orthographic(eye, target, window, SIZE, SIZE, 0.1, 100.0);
    patina_settings settings = settings_default(SIZE, SIZE);
    const size_t middle = (size_t)SIZE * (SIZE / 2) + SIZE / 2, pixels = (size_t)SIZE * SIZE;
    settings.layer_passes = 1u << PATINA_PASS_COMBINED | 1u << PATINA_PASS_DEPTH | 1u << PATINA_PASS_NORMAL;
    static const struct {
        uint32_t surface;
        float cull;
        int back;
    } cases[] = {{PATINA_SURFACE_RANGES, 0.0f, 1},
                 {PATINA_SURFACE_RANGES, 1.5f, 0},
                 {PATINA_SURFACE_RANGES, 3.1415926f, 1},
                 {PATINA_SURFACE_FILL, 1.5f, 1}};
    for (int k = 0; k < 4; k++) {
        settings.surface = cases[k].surface;
        style.range_cull = cases[k].cull;
        patina_scene *scene = scene_of(cloud, &style);
        struct picture picture = picture_render(device, scene, &camera, &settings);
        assert_true(fabs((double)picture.layer_depth[middle] - 3.9) < 0.02);
        assert_int_equal(isfinite(picture.layer_depth[pixels + middle]) != 0, cases[k].back);
        picture_free(&picture);
        patina_scene_destroy(scene);
    }
    patina_scans_destroy(known);
    patina_cloud_destroy(cloud);
    patina_device_destroy(device);
    points_free(&points);
    free(of);
}

// A sphere's outline against the truth, in one pass and in two: shares of its pixels that are missing or too many.
static void test_sharpness(void **state)
{
    (void)state;
    static const float sharpness[] = {0.0f, 0.83f, 0.66f};
    struct points points = points_sphere(60000, 1.0, POINTS_PLAIN, 5);
    patina_device *device = support_device_first();
    patina_cloud *cloud = points_upload(&points);
    double wrong[3], normal[3];
    for (int k = 0; k < 3; k++) {
        patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
        style.range_pixel = 4.0f;
        style.range_sharpness = sharpness[k];
        struct picture picture = draw(device, cloud, &style, PATINA_SURFACE_RANGES);
        double off = 0.0, pixels = 0.0, open = 0.0;
        for (uint32_t y = 0; y < SIZE; y++)
            for (uint32_t x = 0; x < SIZE; x++) {
                const double u = window * ((x + 0.5) / SIZE - 0.5), v = window * ((y + 0.5) / SIZE - 0.5);
                const size_t at = (size_t)y * SIZE + x;
                const int inside = u * u + v * v < 1.0, shown = isfinite(picture.depth[at]) != 0;
                off += inside != shown;
                open += u * u + v * v < 0.8 && !shown;
                pixels += inside;
                assert_true(picture.source[at] == 0.0f || fabsf(picture.source[at]) >= 1.0f); // no mark is left
            }
        wrong[k] = off / pixels;
        normal[k] = measure(&picture, SPHERE, 0.015).normal;
        assert_true(open == 0.0);
        picture_free(&picture);
    }
    print_message(
        "  outline of a sphere, cells of 4 pixels: %.2f %% of it wrong in one pass, %.2f and %.2f in two of 0.83 and 0.66; "
        "normals %.2f, %.2f, %.2f degrees\n",
        100.0 * wrong[0], 100.0 * wrong[1], 100.0 * wrong[2], normal[0], normal[1], normal[2]);
    assert_true(wrong[1] < 0.85 * wrong[0] && wrong[2] < 0.85 * wrong[0]);
    points_free(&points);
    patina_cloud_destroy(cloud);
    patina_device_destroy(device);
}

static void refuse(const patina_cloud *cloud, const patina_cloud_style *style, const char *says)
{
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    assert_int_equal(patina_scene_add_cloud(scene, cloud, style), PATINA_ERROR_ARGUMENT);
    assert_non_null(strstr(support_message(scene), says));
    patina_scene_destroy(scene);
}

static void test_refused(void **state)
{
    (void)state;
    struct points points = points_sphere(100, 1.0, POINTS_PLAIN, 5);
    patina_cloud *cloud = points_upload(&points), *other = points_upload(&points);
    const patina_scan good = {.direction = {0, 0, -2}, .interval = 0.1},
                      bad[] = {{.interval = -1.0}, {.direction = {NAN, 0, 0}}};
    uint16_t of[100];
    patina_scans *scans = NULL;
    for (int i = 0; i < 100; i++)
        of[i] = (uint16_t)(i % 3); // a scan that is not told of, too
    for (int k = 0; k < 2; k++) {
        assert_int_equal(patina_scans_create(cloud, of, &bad[k], 1, &scans), PATINA_ERROR_ARGUMENT);
        assert_null(scans);
        assert_non_null(strstr(support_message(cloud), "scan 0"));
    }
    assert_int_equal(patina_scans_create(cloud, of, &good, 0, &scans), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_scans_create(cloud, NULL, &good, 1, NULL), PATINA_ERROR_ARGUMENT);
    CHECK(patina_scans_create(other, of, &good, 1, &scans), NULL);
    patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
    style.scans = scans;
    refuse(cloud, &style, "another cloud");
    style.scans = NULL;
    style.surface = PATINA_SURFACE_FILL;
    refuse(cloud, &style, "surface");
    style.surface = PATINA_SURFACE_RANGES;
    style.range_gamma = NAN;
    refuse(cloud, &style, "range_gamma");
    style.range_gamma = 0.0f;
    style.range_pixel = 0.5f;
    refuse(cloud, &style, "range_pixel");
    style.range_pixel = 0.0f;
    style.range_sharpness = 0.2f;
    refuse(cloud, &style, "range_sharpness");
    style.range_sharpness = 0.0f;
    style.range_cull = 4.0f;
    refuse(cloud, &style, "range_cull");
    patina_scans_destroy(scans);
    patina_scans_destroy(NULL);
    patina_cloud_destroy(cloud);
    patina_cloud_destroy(other);
    points_free(&points);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_registration), cmocka_unit_test(test_few_points),    cmocka_unit_test(test_hard),
        cmocka_unit_test(test_layers),       cmocka_unit_test(test_beside_others), cmocka_unit_test(test_cull),
        cmocka_unit_test(test_sharpness),    cmocka_unit_test(test_refused),
    };
    support_arguments(argc, argv);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
