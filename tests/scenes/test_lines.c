// SPDX-License-Identifier: GPL-3.0-or-later
// Silhouettes of exact shapes: where the contour is, as wide as asked for, none inside smooth surfaces; a region is the crop of
// the whole, and devices, threads and batches change nothing.
//
// Truth: rays at SUB x SUB places a pixel. A place is contour where a neighbour shows nothing, or of the torus, which alone hides
// itself, lies behind it by more than STEP. The line is what lies behind so, within the width of a contour place.
#include "analytic.h"
#include "clouds.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SIZE = 192, SUB = 4, FINE = SIZE * SUB };
static const double STEP = 0.12;

enum shape { BALL, RING, CUBE, SLOPE, SHAPES }; // SLOPE: a square seen at 80 degrees
static const char *const shape_names[] = {"sphere", "torus", "cube", "slope"};
static const double cube_half[3] = {0.6, 0.6, 0.6}, eye[3] = {0.8, -2.6, 1.5}, low_eye[3] = {0.1, -3.0, 0.53};

// ---- truth ---------------------------------------------------------------------------------------------------------------

static double cast_cube(const double origin[3], const double direction[3])
{
    double enter = 0.0, leave = HUGE_VAL;
    for (int k = 0; k < 3; k++) {
        double a = (-cube_half[k] - origin[k]) / direction[k], b = (cube_half[k] - origin[k]) / direction[k];
        enter = fmax(enter, fmin(a, b));
        leave = fmin(leave, fmax(a, b));
    }
    return enter < leave ? enter : HUGE_VAL;
}

static double cast(enum shape shape, const double origin[3], const double direction[3])
{
    struct analytic_shape exact = shape == BALL   ? analytic_shape(SPHERE, 1.0, 0.0)
                                  : shape == RING ? analytic_shape(TORUS, 0.8, 0.3)
                                                  : analytic_shape(PLANE, 1.8, 1.8);
    return shape == CUBE ? cast_cube(origin, direction) : analytic_cast(&exact, origin, direction).z;
}

static double *fine_depth(enum shape shape, const patina_camera *camera)
{
    double *z = malloc((size_t)FINE * FINE * sizeof *z), origin[3], direction[3];
    if (!z)
        support_die("out of memory");
    for (int y = 0; y < FINE; y++)
        for (int x = 0; x < FINE; x++) {
            camera_ray(camera, SIZE, SIZE, (x + 0.5) / SUB, (y + 0.5) / SUB, origin, direction);
            z[y * FINE + x] = cast(shape, origin, direction);
        }
    return z;
}

static int lies_behind(enum shape shape, double z, double contour)
{
    return shape == RING ? z > contour + STEP : isinf(z) && isfinite(contour);
}

static int is_contour(enum shape shape, const double *z, int x, int y)
{
    static const int dx[4] = {1, 0, -1, 0}, dy[4] = {0, 1, 0, -1};
    for (int i = 0; i < 4 && isfinite(z[y * FINE + x]); i++) {
        int qx = x + dx[i], qy = y + dy[i];
        if (qx >= 0 && qy >= 0 && qx < FINE && qy < FINE && lies_behind(shape, z[qy * FINE + qx], z[y * FINE + x]))
            return 1;
    }
    return 0;
}

// 1: line, 2: within reach of a contour, on either side.
static uint8_t *truth_of(enum shape shape, const double *z, double width, double margin)
{
    uint8_t *found = calloc((size_t)FINE, FINE);
    const int reach = (int)ceil((width + margin) * SUB);
    for (int i = 0; i < FINE * FINE && found; i++) {
        int x = i % FINE, y = i / FINE;
        for (int dy = -reach; dy <= reach && is_contour(shape, z, x, y); dy++)
            for (int dx = -reach; dx <= reach; dx++) {
                int qx = x + dx, qy = y + dy;
                double apart = sqrt(dx * dx + dy * dy) / SUB;
                if (qx < 0 || qy < 0 || qx >= FINE || qy >= FINE || apart > width + margin)
                    continue;
                found[qy * FINE + qx] |= 2;
                if (apart <= width && lies_behind(shape, z[qy * FINE + qx], z[i]))
                    found[qy * FINE + qx] |= 1;
            }
    }
    if (!found)
        support_die("out of memory");
    return found;
}

// ---- pictures ------------------------------------------------------------------------------------------------------------

static patina_cloud *sample(enum shape shape, uint64_t count, unsigned columns)
{
    struct points points = shape == BALL   ? points_sphere(count, 1.0, columns, 3)
                           : shape == RING ? points_torus(count, 0.8, 0.3, columns, 3)
                           : shape == CUBE ? points_box(count, cube_half, columns, 3)
                                           : points_rectangle(count, 1.8, 1.8, columns, 3);
    patina_cloud *cloud = points_upload(&points);
    points_free(&points);
    return cloud;
}

static patina_camera camera_of(enum shape shape, int orthographic)
{
    static const double target[3] = {0.0, 0.0, 0.0};
    const double *from = shape == SLOPE || shape == RING ? low_eye : eye;
    return orthographic ? camera_orthographic(from, target, 2.6, SIZE, SIZE, 0.1, 20.0)
                        : camera_perspective(from, target, 50.0, SIZE, SIZE, 0.1, 20.0);
}

static float *render_lines(patina_device *device, patina_scene *scene, const patina_camera *camera, patina_settings settings,
                           const patina_lines *lines, float **depth)
{
    patina_frame *frame = NULL;
    uint32_t width = settings.region[2] ? settings.region[2] - settings.region[0] : settings.width;
    uint32_t height = settings.region[3] ? settings.region[3] - settings.region[1] : settings.height;
    size_t count = (size_t)width * height;
    float *line = malloc(count * sizeof *line);
    CHECK(patina_scene_set_camera(scene, camera), scene);
    CHECK(patina_scene_set_settings(scene, &settings), scene);
    CHECK(patina_scene_set_lines(scene, lines), scene);
    CHECK(patina_frame_create(device, &frame), device);
    CHECK(patina_frame_render(frame, scene), frame);
    CHECK(patina_frame_read(frame, PATINA_PASS_LINE, line, count * sizeof *line), frame);
    if (depth) {
        *depth = malloc(count * sizeof **depth);
        CHECK(patina_frame_read(frame, PATINA_PASS_DEPTH, *depth, count * sizeof **depth), frame);
    }
    patina_frame_destroy(frame);
    return line;
}

// ---- the contour ---------------------------------------------------------------------------------------------------------

struct found {
    double width;  // as if the line's whole area lay along the true line
    uint32_t away; // pixels with a line, of which no part lies within the width and two pixels of a contour: filling may carry
                   // a surface a pixel or two too far in corners
    uint32_t inside;         // of them, those that show the shape
    uint32_t whole, missing; // pixels wholly in the true line of which a line covers less than 45 %
};

static struct found compare(enum shape shape, const float *line, const float *depth, const double *z, double width)
{
    uint8_t *truth = truth_of(shape, z, width, 2.0);
    struct found found = {0};
    double drawn = 0.0, exact = 0.0;
    for (int i = 0; i < SIZE * SIZE; i++) {
        int x = i % SIZE * SUB, y = i / SIZE * SUB, on = 0, near = 0;
        for (int k = 0; k < SUB * SUB; k++) {
            uint8_t one = truth[(y + k / SUB) * FINE + x + k % SUB];
            on += one & 1;
            near += one >> 1;
        }
        drawn += (double)line[i];
        exact += (double)on / (SUB * SUB);
        found.away += line[i] > 0.0f && !near;
        found.inside += line[i] > 0.0f && !near && isfinite(depth[i]);
        found.whole += on == SUB * SUB;
        found.missing += on == SUB * SUB && line[i] < 0.45f;
    }
    found.width = width * drawn / exact;
    free(truth);
    return found;
}

// Per shape: points that give about 4 a pixel.
static const uint64_t counts[SHAPES] = {200000, 150000, 120000, 150000};

static void test_contours(void **state)
{
    (void)state;
    static const float widths[] = {1.0f, 2.0f, 4.0f, 9.0f};
    patina_device *device = support_device_first();
    printf("  shape   view  normals |  width asked for: found, pixels away from the contour, inside the shape, missing\n");
    for (int shape = BALL; shape < SHAPES; shape++)
        for (int way = 0; way < 4; way++) {
            const int orthographic = way & 1, plain = way >> 1;
            patina_camera camera = camera_of((enum shape)shape, orthographic);
            patina_cloud *cloud = sample((enum shape)shape, counts[shape], plain ? POINTS_PLAIN : POINTS_NORMALS);
            patina_scene *scene = scene_of(cloud, NULL);
            double *z = fine_depth((enum shape)shape, &camera);
            // where the torus begins to hide itself, the step is no more than that of two layers yet
            const uint32_t most = shape == RING ? 2 : 0; // percent
            printf("  %-7s %-5s %-7s |", shape_names[shape], orthographic ? "ortho" : "persp", plain ? "without" : "with");
            for (size_t w = 0; w < 4; w++) {
                patina_lines lines = {.struct_size = sizeof lines, .width = widths[w]};
                float *depth, *line = render_lines(device, scene, &camera, settings_default(SIZE, SIZE), &lines, &depth);
                struct found found = compare((enum shape)shape, line, depth, z, (double)widths[w]);
                printf("  %g: %.2f, %u, %u, %u", (double)widths[w], found.width, found.away, found.inside, found.missing);
                fflush(stdout);
                if (!plain &&
                    (fabs(found.width - (double)widths[w]) > 0.5 || found.away || 100 * found.missing > most * found.whole))
                    support_die("%s: a line %g wide was found %.2f wide, with %u pixels away from the contour and %u missing",
                                shape_names[shape], (double)widths[w], found.width, found.away, found.missing);
                free(line);
                free(depth);
            }
            printf("\n");
            free(z);
            patina_scene_destroy(scene);
            patina_cloud_destroy(cloud);
        }
    patina_device_destroy(device);
}

// A plane that fills the picture, tilted from 0 to 88 degrees, under a wide line.
static uint32_t count_on_slope(patina_device *device, int tilt, double density, unsigned columns)
{
    static const double target[3] = {0.0, 0.0, 0.0};
    const double angle = tilt * M_PI / 180.0, from[3] = {0.0, -3.0 * sin(angle), 3.0 * cos(angle)}, window = 1.4, side = 1.8;
    patina_camera camera = camera_orthographic(from, target, window, SIZE, SIZE, -100.0, 100.0);
    struct points points = points_rectangle((uint64_t)(density * pow(side / window * SIZE, 2.0)), side, side / cos(angle),
                                            columns, 3);
    patina_cloud *cloud = points_upload(&points);
    patina_scene *scene = scene_of(cloud, NULL);
    patina_lines lines = {.struct_size = sizeof lines, .width = 6.0f};
    float *line = render_lines(device, scene, &camera, settings_default(SIZE, SIZE), &lines, NULL);
    uint32_t count = 0;
    for (int i = 0; i < SIZE * SIZE; i++)
        count += line[i] > 0.0f;
    free(line);
    points_free(&points);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    return count;
}

static void test_slopes(void **state)
{
    (void)state;
    patina_device *device = support_device_first();
    printf("  of %d pixels of a tilted plane, so many show lines: with normals, without\n  tilt", SIZE * SIZE);
    static const double densities[] = {1.0, 4.0, 30.0};
    for (int d = 0; d < 3; d++)
        printf(" | %g points a pixel", densities[d]);
    uint32_t wrong = 0;
    for (int tilt = 0; tilt <= 88; tilt += 8) {
        printf("\n  %4d", tilt);
        for (int d = 0; d < 3; d++) {
            uint32_t with = count_on_slope(device, tilt, densities[d], POINTS_NORMALS);
            printf(" | %u, %u", with, count_on_slope(device, tilt, densities[d], POINTS_PLAIN));
            wrong += with;
        }
    }
    printf("\n");
    if (wrong)
        support_die("%u pixels of planes with normals show lines", wrong);
    patina_device_destroy(device);
}

// ---- one result ----------------------------------------------------------------------------------------------------------

// Two rings in each other before a square; the outer one may be clear.
static patina_scene *stage(patina_cloud *clouds[3], float transparency)
{
    patina_scene *scene = NULL;
    clouds[0] = sample(RING, 60000, POINTS_ALL);
    clouds[1] = sample(BALL, 60000, POINTS_COLORS);
    clouds[2] = sample(SLOPE, 60000, POINTS_NORMALS);
    CHECK(patina_scene_create(&scene), NULL);
    for (int i = 0; i < 3; i++) {
        patina_cloud_style style = {.struct_size = sizeof style, .transparency = i == 1 ? transparency : 0.0f};
        const double scale = i == 1 ? 0.6 : 1.0;
        const double matrix[16] = {scale, 0, 0, 0, 0, scale, 0, i == 2 ? 1.0 : 0, 0, 0, scale, 0, 0, 0, 0, 1};
        memcpy(style.world_from_object, matrix, sizeof matrix);
        CHECK(patina_scene_add_cloud(scene, clouds[i], &style), scene);
    }
    return scene;
}

static const struct {
    const char *name;
    patina_lines lines;
    float transparency;
    uint32_t layer_passes, antialias;
} looks[] = {
    {"hard", {.width = 2.0f}, 0.0f, 0, 0},
    {"wide and soft, over paper", {.width = 11.0f, .soft = 1.0f, .surface = PATINA_LINE_SURFACE_PAPER}, 0.0f, 0, 0},
    {"of points, in world units", {.width = 0.06f, .world = 1, .source = PATINA_LINE_POINT, .offset = 0.05f}, 0.0f, 0, 0},
    {"alone, without anti-aliasing", {.width = 3.0f, .surface = PATINA_LINE_SURFACE_NONE}, 0.0f, 0, PATINA_ANTIALIAS_OFF},
    {"by depth, through layers", {.width = 3.0f, .source = PATINA_LINE_DEPTH, .far_color = {1, 0, 0}}, 0.6f, 0, 0},
    {"alone, through layers", {.width = 4.0f, .surface = PATINA_LINE_SURFACE_NONE, .soft = 0.5f}, 0.6f, 0, 0},
    {"of points, with layers as passes", {.width = 4.0f, .source = PATINA_LINE_POINT}, 0.6f, 7, 0},
};
enum { LOOKS = sizeof looks / sizeof looks[0] };

struct result {
    struct picture picture;
    float *line;
};

static struct result draw(patina_device *device, uint32_t look, const uint32_t region[4])
{
    patina_cloud *clouds[3];
    patina_scene *scene = stage(clouds, looks[look].transparency);
    patina_camera camera = camera_of(BALL, look == 3);
    patina_settings settings = settings_default(SIZE, SIZE);
    patina_lines lines = looks[look].lines;
    struct result result;
    lines.struct_size = sizeof lines;
    settings.layer_passes = looks[look].layer_passes;
    settings.antialias = looks[look].antialias;
    if (region)
        memcpy(settings.region, region, sizeof settings.region);
    CHECK(patina_scene_set_lines(scene, &lines), scene);
    result.picture = picture_render(device, scene, &camera, &settings);
    result.line = render_lines(device, scene, &camera, settings, &lines, NULL);
    patina_scene_destroy(scene);
    for (int i = 0; i < 3; i++)
        patina_cloud_destroy(clouds[i]);
    return result;
}

static void free_result(struct result *result)
{
    picture_free(&result->picture);
    free(result->line);
}

static void test_regions(void **state)
{
    (void)state;
    static const uint32_t regions[][4] = {
        {0, 0, SIZE, SIZE}, {0, 0, 70, 40}, {53, 41, 150, 147}, {96, 20, 97, 21}, {0, 90, SIZE, 91}};
    patina_device *device = support_device_first();
    for (uint32_t look = 0; look < LOOKS; look++) {
        struct result whole = draw(device, look, NULL);
        for (size_t r = 0; r < sizeof regions / sizeof regions[0]; r++) {
            const uint32_t *at = regions[r], width = at[2] - at[0];
            struct result part = draw(device, look, at);
            picture_assert_identical(&part.picture, &whole.picture, at[0], at[1], looks[look].name);
            for (uint32_t y = at[1]; y < at[3]; y++)
                assert_memory_equal(part.line + (size_t)(y - at[1]) * width, whole.line + (size_t)y * SIZE + at[0], 4 * width);
            free_result(&part);
        }
        free_result(&whole);
    }
    patina_device_destroy(device);
}

static void test_threads(void **state)
{
    (void)state;
    static const uint32_t ways[][2] = {{1, 0}, {2, 0}, {3, 1}, {7, 2}, {2, 5}, {7, 64}};
    for (uint32_t look = 0; look < LOOKS; look++) {
        struct result first = {.line = NULL};
        for (size_t w = 0; w < sizeof ways / sizeof ways[0]; w++) {
            patina_device_desc desc = {.struct_size = sizeof desc, .name = "cpu", .threads = ways[w][0], .batch = ways[w][1]};
            patina_device *device = NULL;
            CHECK(patina_device_create(&desc, &device), NULL);
            struct result now = draw(device, look, NULL);
            patina_device_destroy(device);
            if (!first.line) {
                first = now;
                continue;
            }
            picture_assert_identical(&now.picture, &first.picture, 0, 0, looks[look].name);
            assert_memory_equal(now.line, first.line, SIZE * SIZE * sizeof *now.line);
            free_result(&now);
        }
        free_result(&first);
    }
}

// Lines and their depth are decisions: equal to the bit on every device. Colours nearly so.
static void test_devices(void **state)
{
    (void)state;
    for (uint32_t look = 0; look < LOOKS; look++) {
        struct result first = {.line = NULL};
        for (uint32_t k = 0; k < support_device_count(); k++) {
            const char *name = support_device_name(k);
            patina_device *device = support_device_open(name, 0, 0);
            if (!device)
                continue;
            struct result now = draw(device, look, NULL);
            patina_device_destroy(device);
            if (!first.line) {
                first = now;
                continue;
            }
            double most = 0.0;
            for (size_t i = 0; i < 4 * SIZE * SIZE; i++)
                most = fmax(most, fabs((double)now.picture.combined[i] - (double)first.picture.combined[i]));
            if (memcmp(now.line, first.line, SIZE * SIZE * sizeof *now.line))
                support_die("%s: lines differ on %s", looks[look].name, name);
            if (memcmp(now.picture.depth, first.picture.depth, SIZE * SIZE * sizeof(float)))
                support_die("%s: depths differ on %s", looks[look].name, name);
            if (most > 1e-4)
                support_die("%s: colours differ by %g on %s", looks[look].name, most, name);
            free_result(&now);
        }
        free_result(&first);
    }
}

// Pictures of a pixel, of a row, of one point, of none, of points at one place, from inside, seven decades deep: no failure, and
// shares from 0 to 1.
static void test_extremes(void **state)
{
    (void)state;
    static const float one[] = {0, 0, 0}, spread[] = {0, 0, 0, NAN, 1, 1, 0.5f, 0, 0, 0.5f, 0, 0, INFINITY, 0, 0};
    static const struct {
        const float *position;
        uint64_t count;
        uint32_t width, height;
        double near_clip, far_clip;
    } cases[] = {{one, 0, 64, 48, 0.1, 10},      {one, 1, 64, 48, 0.1, 10},      {one, 1, 1, 1, 0.1, 10},
                 {spread, 5, 64, 48, 1e-3, 1e4}, {spread, 5, 16384, 1, 0.1, 10}, {spread, 5, 1, 300, 0.1, 10}};
    patina_device *device = support_device_first();
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        for (int way = 0; way < 4; way++) {
            const double from[3] = {0.0, -2.0, 0.3}, target[3] = {0.0, 0.0, 0.0};
            patina_cloud_desc desc = {.struct_size = sizeof desc, .count = cases[i].count};
            desc.position = (patina_array){cases[i].position, PATINA_FLOAT32, 3, 0};
            patina_cloud *cloud = NULL;
            CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
            patina_cloud_style style = {.struct_size = sizeof style, .transparency = way >> 1 ? 0.5f : 0.0f};
            patina_scene *scene = scene_of(cloud, &style);
            const uint32_t w = cases[i].width, h = cases[i].height;
            patina_camera camera = way & 1
                                       ? camera_orthographic(from, target, 2.0, w, h, -cases[i].far_clip, cases[i].far_clip)
                                       : camera_perspective(from, target, 50.0, w, h, cases[i].near_clip, cases[i].far_clip);
            patina_lines lines = {.struct_size = sizeof lines, .width = way & 1 ? 16.0f : 1e6f, .world = !(way & 1)};
            float *line = render_lines(device, scene, &camera, settings_default(w, h), &lines, NULL);
            for (size_t k = 0; k < (size_t)w * h; k++)
                if (!(line[k] >= 0.0f && line[k] <= 1.0f))
                    support_die("case %zu: a share of %g", i, (double)line[k]);
            free(line);
            patina_scene_destroy(scene);
            patina_cloud_destroy(cloud);
        }
    patina_device_destroy(device);
}

static void test_refusals(void **state)
{
    (void)state;
    static const struct {
        patina_lines lines;
        const char *says;
    } bad[] = {{{.width = -1.0f}, "0 or more"},   {{.width = NAN}, "finite"},          {{.width = 17.0f}, "the most is 16"},
               {{.world = 1}, "above 0"},         {{.transparency = 2.0f}, "between"}, {{.soft = -0.5f}, "between"},
               {{.source = 3}, "no such"},        {{.surface = 3}, "no such"},         {{.offset = -1.0f}, "0 or more"},
               {{.color = {NAN, 0, 0}}, "finite"}};
    patina_scene *scene = NULL;
    CHECK(patina_scene_create(&scene), NULL);
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        patina_lines lines = bad[i].lines;
        lines.struct_size = sizeof lines;
        assert_int_equal(patina_scene_set_lines(scene, &lines), PATINA_ERROR_ARGUMENT);
        assert_non_null(strstr(support_message(scene), bad[i].says));
    }
    patina_lines unset = {.struct_size = 3};
    assert_int_equal(patina_scene_set_lines(scene, &unset), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_scene_set_lines(NULL, NULL), PATINA_ERROR_ARGUMENT);
    CHECK(patina_scene_set_lines(scene, NULL), scene);
    patina_scene_destroy(scene);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_contours), cmocka_unit_test(test_slopes),  cmocka_unit_test(test_regions),
        cmocka_unit_test(test_threads),  cmocka_unit_test(test_devices), cmocka_unit_test(test_extremes),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
