// SPDX-License-Identifier: GPL-3.0-or-later
// Panoramas against a direct projection of known points; seams; what is refused.
#include <patina/patina.h>

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define PI 3.14159265358979323846

enum { WIDTH = 512, HEIGHT = 256 };

static patina_device *device;

static int open_device(void **state)
{
    (void)state;
    const patina_device_desc desc = {.struct_size = sizeof desc, .name = "cpu"};
    return patina_device_create(&desc, &device);
}

static int close_device(void **state)
{
    (void)state;
    patina_device_destroy(device);
    return 0;
}

struct pictures {
    float *color, *depth;
    uint64_t *keys;
    uint32_t side;
};

static void free_pictures(struct pictures *pictures)
{
    free(pictures->color);
    free(pictures->depth);
    free(pictures->keys);
}

// Draws the six faces of unlit points and joins them.
static struct pictures draw(const patina_panorama *panorama, const float (*points)[3], const float (*colors)[3], uint32_t count,
                            uint32_t fill)
{
    const patina_cloud_desc desc = {.struct_size = sizeof desc,
                                    .count = count,
                                    .position = {points, PATINA_FLOAT32, 3, 0},
                                    .color = {colors, PATINA_FLOAT32, 3, 0}};
    patina_settings settings = {.struct_size = sizeof settings,
                                .fill = fill,
                                .smooth = fill == PATINA_FILL_OFF ? PATINA_SMOOTH_OFF : PATINA_SMOOTH_ALLEVIATED,
                                .antialias = fill == PATINA_FILL_OFF ? PATINA_ANTIALIAS_OFF : PATINA_ANTIALIAS_LAYERS,
                                .film_transparent = 1};
    patina_cloud *cloud = NULL;
    patina_scene *scene = NULL;
    patina_frame *frame = NULL;
    patina_camera camera = {.struct_size = sizeof camera};
    struct pictures out = {0};
    float *color[6], *depth[6];
    uint64_t *keys[6];
    assert_int_equal(patina_cloud_create(&desc, NULL, &cloud), PATINA_OK);
    assert_int_equal(patina_scene_create(&scene), PATINA_OK);
    assert_int_equal(patina_scene_add_cloud(scene, cloud, NULL), PATINA_OK);
    assert_int_equal(patina_frame_create(device, &frame), PATINA_OK);
    for (uint32_t face = 0; face < 6; face++) {
        assert_int_equal(patina_panorama_camera(panorama, face, &camera, &out.side), PATINA_OK);
        const size_t pixels = (size_t)out.side * out.side;
        settings.width = settings.height = out.side;
        assert_int_equal(patina_scene_set_camera(scene, &camera), PATINA_OK);
        assert_int_equal(patina_scene_set_settings(scene, &settings), PATINA_OK);
        assert_int_equal(patina_frame_render(frame, scene), PATINA_OK);
        color[face] = malloc(pixels * 16);
        depth[face] = malloc(pixels * 4);
        keys[face] = malloc(pixels * 8);
        assert_int_equal(patina_frame_read(frame, PATINA_PASS_COMBINED, color[face], pixels * 16), PATINA_OK);
        assert_int_equal(patina_frame_read(frame, PATINA_PASS_DEPTH, depth[face], pixels * 4), PATINA_OK);
        assert_int_equal(patina_frame_read_keys(frame, keys[face], pixels * 8), PATINA_OK);
    }
    const uint32_t *r = panorama->region;
    const size_t all = r[2] ? (size_t)(r[2] - r[0]) * (r[3] - r[1]) : (size_t)panorama->width * panorama->height;
    out.color = malloc(all * 16);
    out.depth = malloc(all * 4);
    out.keys = malloc(all * 8);
    assert_int_equal(patina_panorama_join(panorama, PATINA_PASS_COMBINED, (const float *const *)color, out.color, all * 16),
                     PATINA_OK);
    assert_int_equal(patina_panorama_join(panorama, PATINA_PASS_DEPTH, (const float *const *)depth, out.depth, all * 4),
                     PATINA_OK);
    assert_int_equal(patina_panorama_join_keys(panorama, (const uint64_t *const *)keys, out.keys, all * 8), PATINA_OK);
    for (int face = 0; face < 6; face++) {
        free(color[face]);
        free(depth[face]);
        free(keys[face]);
    }
    patina_frame_destroy(frame);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
    return out;
}

// An eye off the origin, that looks along y with z up: the panorama of surveys.
static patina_panorama around(void)
{
    return (patina_panorama){.struct_size = sizeof(patina_panorama),
                             .width = WIDTH,
                             .height = HEIGHT,
                             .world_from_camera = {1, 0, 0, 3, 0, 0, -1, -2, 0, 1, 0, 1, 0, 0, 0, 1},
                             .near_clip = 0.01,
                             .far_clip = 1000};
}

// Single points all around, at bearings and heights that a compass and a spirit level would read.
static void test_points_fall_where_they_are_seen(void **state)
{
    (void)state;
    enum { COUNT = 60 };
    float points[COUNT][3], colors[COUNT][3];
    double columns[COUNT], rows[COUNT], away[COUNT];
    for (int i = 0; i < COUNT; i++) {
        const double bearing = 2 * PI * fmod(0.618033988 * i, 1) - PI, height = asin(2 * (i + 0.5) / COUNT - 1);
        away[i] = 2 + i % 7;
        points[i][0] = (float)(3 + away[i] * cos(height) * sin(bearing));
        points[i][1] = (float)(-2 + away[i] * cos(height) * cos(bearing));
        points[i][2] = (float)(1 + away[i] * sin(height));
        columns[i] = (bearing + PI) / (2 * PI) * WIDTH;
        rows[i] = (height + PI / 2) / PI * HEIGHT;
        for (int k = 0; k < 3; k++)
            colors[i][k] = 1;
    }
    const patina_panorama panorama = around();
    struct pictures got = draw(&panorama, (const float(*)[3])points, (const float(*)[3])colors, COUNT, PATINA_FILL_OFF);
    for (int i = 0; i < COUNT; i++) {
        // the middle of what a point leaves; near the poles a pixel of a face is wide in longitude
        const int wide = 3 + (int)(2 / cos(rows[i] / HEIGHT * PI - PI / 2)); // columns
        const double shrink = cos(rows[i] / HEIGHT * PI - PI / 2);
        double sum = 0, x = 0, y = 0;
        for (int row = (int)rows[i] - 3; row <= (int)rows[i] + 3; row++)
            for (int column = (int)columns[i] - wide; column <= (int)columns[i] + wide; column++) {
                if (row < 0 || row >= HEIGHT)
                    continue;
                const size_t at = (size_t)row * WIDTH + (column + WIDTH) % WIDTH;
                const double alpha = got.color[4 * at + 3];
                sum += alpha;
                x += alpha * (column + 0.5);
                y += alpha * (row + 0.5);
            }
        if (sum * shrink < 0.15 || sum * shrink > 1.3) // of a pixel's area at the equator; in a cube's corner a fifth
            printf("point %d at %.1f, %.1f covers %.3f\n", i, columns[i], rows[i], sum * shrink);
        assert_true(sum * shrink > 0.15 && sum * shrink < 1.3);
        if (fabs(x / sum - columns[i]) * shrink > 0.75 || fabs(y / sum - rows[i]) > 0.75) {
            printf("point %d is at %.2f, %.2f, not %.2f, %.2f\n", i, x / sum, y / sum, columns[i], rows[i]);
            fail();
        }
    }
    // each pixel of data tells its own point, at that point's distance from the eye
    int found = 0;
    for (size_t at = 0; at < (size_t)WIDTH * HEIGHT; at++) {
        const uint32_t id = (uint32_t)got.keys[at];
        if (id >= COUNT) {
            assert_true(isinf(got.depth[at]));
            continue;
        }
        assert_true(fabs(got.depth[at] - away[id]) < 0.03 * away[id]); // z of the point at its pixel's middle
        found++;
    }
    assert_true(found >= COUNT * 3 / 4); // a face's pixels are finer at its corners: some fall between the picture's
    free_pictures(&got);
}

// A ball around the eye, coloured by direction: no gap anywhere, no step where faces meet.
static void test_no_seams(void **state)
{
    (void)state;
    enum { COUNT = 400000 };
    float(*points)[3] = malloc(COUNT * sizeof *points), (*colors)[3] = malloc(COUNT * sizeof *colors);
    for (int i = 0; i < COUNT; i++) {
        const double z = 1 - 2 * (i + 0.5) / COUNT, turn = i * PI * (1 + sqrt(5)), ring = sqrt(1 - z * z);
        const double normal[3] = {ring * cos(turn), ring * sin(turn), z}, eye[3] = {3, -2, 1};
        for (int k = 0; k < 3; k++) {
            points[i][k] = (float)(eye[k] + 5 * normal[k]);
            colors[i][k] = (float)(0.5 + 0.4 * normal[k]);
        }
    }
    const patina_panorama panorama = around();
    struct pictures got = draw(&panorama, (const float(*)[3])points, (const float(*)[3])colors, COUNT, PATINA_FILL_CLOSED);
    double worst = 0, worst_depth = 0;
    for (int row = 0; row < HEIGHT; row++)
        for (int column = 0; column < WIDTH; column++) {
            const size_t at = (size_t)row * WIDTH + column;
            const double bearing = (column + 0.5) / WIDTH * 2 * PI - PI, height = (row + 0.5) / HEIGHT * PI - PI / 2;
            const double wanted[3] = {cos(height) * sin(bearing), cos(height) * cos(bearing), sin(height)};
            assert_true(fabs(got.color[4 * at + 3] - 1) < 1e-5);
            for (int k = 0; k < 3; k++)
                worst = fmax(worst, fabs(got.color[4 * at + k] - (0.5 + 0.4 * wanted[k])));
            worst_depth = fmax(worst_depth, fabs(got.depth[at] - 5));
        }
    printf("colour within %.4f, distance within %.4f of 5\n", worst, worst_depth);
    assert_true(worst < 0.01); // a pixel of the picture is 0.005 of a colour
    assert_true(worst_depth < 0.1);
    free_pictures(&got);
    free(points);
    free(colors);
}

static void test_a_region_is_a_crop(void **state)
{
    (void)state;
    const float points[2][3] = {{3, 0, 1}, {6, -2, 1}}, colors[2][3] = {{1, 0, 0}, {0, 1, 0}};
    patina_panorama panorama = around();
    struct pictures whole = draw(&panorama, points, colors, 2, PATINA_FILL_OFF);
    const uint32_t region[4] = {200, 100, 420, 140};
    memcpy(panorama.region, region, sizeof region);
    struct pictures part = draw(&panorama, points, colors, 2, PATINA_FILL_OFF);
    double covered = 0;
    for (uint32_t y = 100; y < 140; y++)
        for (uint32_t x = 200; x < 420; x++) {
            const float *a = whole.color + 4 * ((size_t)y * WIDTH + x),
                        *b = part.color + 4 * ((size_t)(y - 100) * 220 + x - 200);
            assert_memory_equal(a, b, 16);
            covered += a[3];
        }
    assert_true(covered > 1); // ahead in the middle, to the right at three quarters
    free_pictures(&whole);
    free_pictures(&part);
}

static void test_ranges(void **state)
{
    (void)state;
    const float points[1][3] = {{3, 0, 1}}, colors[1][3] = {{1, 1, 1}}; // straight ahead
    patina_panorama panorama = around();
    panorama.longitude[0] = -PI / 4;
    panorama.longitude[1] = PI / 2;
    panorama.latitude[0] = -PI / 8;
    panorama.latitude[1] = PI / 8;
    struct pictures got = draw(&panorama, points, colors, 1, PATINA_FILL_OFF);
    double sum = 0, x = 0, y = 0;
    for (size_t at = 0; at < (size_t)WIDTH * HEIGHT; at++) {
        sum += got.color[4 * at + 3];
        x += got.color[4 * at + 3] * (at % WIDTH + 0.5);
        y += got.color[4 * at + 3] * (at / WIDTH + 0.5);
    }
    assert_true(fabs(x / sum - WIDTH / 3.0) < 1 && fabs(y / sum - HEIGHT / 2.0) < 1);
    free_pictures(&got);
}

static void test_refusals(void **state)
{
    (void)state;
    patina_camera camera = {.struct_size = sizeof camera};
    uint32_t side;
    patina_panorama panorama = around();
    assert_int_equal(patina_panorama_camera(&panorama, 6, &camera, &side), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_panorama_camera(NULL, 0, &camera, &side), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_panorama_join(&panorama, PATINA_PASS_DEPTH, NULL, NULL, 0), PATINA_ERROR_ARGUMENT);
    const float pixel[4] = {0};
    const float *const faces[6] = {pixel, pixel, pixel, pixel, pixel, pixel};
    float out[4];
    assert_int_equal(patina_panorama_join(&panorama, PATINA_PASS_COMBINED, faces, out, sizeof out), PATINA_ERROR_ARGUMENT);
    panorama.latitude[0] = 1;
    panorama.latitude[1] = 2;
    assert_int_equal(patina_panorama_camera(&panorama, 0, &camera, &side), PATINA_ERROR_ARGUMENT);
    panorama = around();
    panorama.region[2] = WIDTH + 1;
    assert_int_equal(patina_panorama_camera(&panorama, 0, &camera, &side), PATINA_ERROR_ARGUMENT);
    panorama = around();
    panorama.width = 0;
    assert_int_equal(patina_panorama_camera(&panorama, 0, &camera, &side), PATINA_ERROR_ARGUMENT);
    char text[256];
    assert_true(patina_message(NULL, text, sizeof text) > 0 && strstr(text, "0 x 256"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_points_fall_where_they_are_seen),
        cmocka_unit_test(test_no_seams),
        cmocka_unit_test(test_a_region_is_a_crop),
        cmocka_unit_test(test_ranges),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
