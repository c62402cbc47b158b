// SPDX-License-Identifier: GPL-3.0-or-later
// Points without a color among colored ones: an analysis gives them the mean of their trusted colored neighbors, as a reference here
// finds it; black surfaces stay black; once more, from a file, with new colors, in any number of threads the same.
#include "scene/clouds/cloud.h"
#include "scene/analysis/uncolored.h"
#include "base/color.h"
#include "scenes/clouds.h"
#include "scenes/support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { SIDE = 120, WALL = SIDE * SIDE, STRAYS = 9, POINTS = WALL + STRAYS, K = 16 };

struct wall {
    double position[POINTS][3];
    uint8_t color[POINTS][3];
    float light[POINTS][3];
    uint8_t black[POINTS];
};

// A rough wall of smooth colors, a share of which is black; strays before it are bright red.
static struct wall *wall_of(double share, uint32_t seed)
{
    struct wall *w = calloc(1, sizeof *w);
    struct pcg random = pcg_seed(seed);
    for (int i = 0; i < POINTS; i++) {
        const int row = i / SIDE, column = i % SIDE;
        w->position[i][0] = i < WALL ? 0.01 * column + pcg_between(&random, -0.003, 0.003) : 0.1 + 0.1 * (i - WALL);
        w->position[i][1] = i < WALL ? 0.01 * row + pcg_between(&random, -0.003, 0.003) : 0.6;
        w->position[i][2] = i < WALL ? pcg_between(&random, -0.0005, 0.0005) : 0.15 + 0.01 * (i % 3);
        w->black[i] = i < WALL && pcg_between(&random, 0, 1) < share;
        for (int k = 0; k < 3; k++) {
            const double light = 0.3 + 0.2 * sin(0.05 * column + k) * cos(0.04 * row);
            w->color[i][k] = w->black[i] ? 0 : i < WALL ? (uint8_t)(255 * srgb_of_linear(light) + 0.5) : k ? 0 : 255;
            w->light[i][k] = (float)pt_linear_of_srgb(w->color[i][k] / 255.0);
        }
    }
    return w;
}

static patina_cloud *cloud_of(const struct wall *w, int floats, uint32_t threads)
{
    return floats ? cloud_of_colors(POINTS, w->position, w->light, PATINA_FLOAT32, threads)
                  : cloud_of_colors(POINTS, w->position, w->color, PATINA_UINT8, threads);
}

static void analyse(patina_cloud *cloud, uint32_t threads, uint32_t keep)
{
    const patina_analysis_desc desc = {.struct_size = sizeof desc, .threads = threads, .keep_colors = keep};
    CHECK(patina_cloud_analyse(cloud, &desc, NULL), cloud);
}

static uint64_t uncolored(const patina_cloud *cloud)
{
    patina_cloud_info info = {.struct_size = sizeof info};
    CHECK(patina_cloud_get_info(cloud, &info), cloud);
    return info.uncolored;
}

// In the caller's order, in light; marks: bits of shape words.
static double *colors_of(const patina_cloud *cloud, uint8_t *marks)
{
    double *light = calloc(3 * POINTS, sizeof *light);
    for (uint32_t c = 0; c < cloud->chunk_count; c++)
        for (uint32_t i = 0; i < cloud->chunks[c].count; i++) {
            const size_t slot = cloud->chunks[c].first + i, at = pt_number_of(cloud, slot);
            for (size_t k = 0; k < 3; k++)
                light[3 * at + k] = cloud->color_format == PT_COLOR_SRGB8
                                        ? ((const uint8_t *)cloud->colors)[3 * slot + k]
                                        : (double)((const float *)cloud->colors)[3 * slot + k];
            if (marks)
                marks[at] = cloud->shapes[slot] >> 31;
        }
    return light;
}

// By all neighbors of all points, in float64.
static void test_reference(void **state)
{
    (void)state;
    for (int floats = 0; floats < 2; floats++) {
        struct wall *w = wall_of(0.12, 2);
        patina_cloud *cloud = cloud_of(w, floats, 1);
        analyse(cloud, 1, 0);
        uint32_t *numbers = malloc(POINTS * K * sizeof *numbers);
        float *trust = malloc(POINTS * sizeof *trust);
        patina_cloud_info info = {.struct_size = sizeof info};
        const patina_neighbourhoods wanted = {
            .struct_size = sizeof wanted, .trust = trust, .neighbours = K, .numbers = numbers};
        CHECK(patina_cloud_neighbourhoods(cloud, &wanted, NULL), cloud);
        CHECK(patina_cloud_get_info(cloud, &info), cloud);
        double *light = calloc(3 * POINTS, sizeof *light), worst = 0;
        uint8_t *round_of = calloc(POINTS, 1), *marks = calloc(POINTS, 1);
        for (int i = 0; i < POINTS; i++) {
            round_of[i] = w->black[i] ? 255 : 0;
            for (int k = 0; k < 3; k++)
                light[3 * i + k] = floats ? (double)w->light[i][k] : pt_linear_of_srgb(w->color[i][k] / 255.0);
        }
        uint64_t filled = 0, untrusted = 0;
        for (int round = 1; round <= 4; round++)
            for (int i = 0; i < POINTS; i++) {
                int with = 0, without = 0;
                double sum[3] = {0, 0, 0};
                for (int j = 0; j < K && round_of[i] == 255; j++) {
                    const uint32_t n = numbers[K * i + j];
                    if ((double)trust[n] < info.trust_default - 1e-6)
                        continue;
                    without += round_of[n] >= round;
                    with += round_of[n] < round;
                    for (int k = 0; k < 3 && round_of[n] < round; k++)
                        sum[k] += light[3 * n + (uint32_t)k];
                }
                if (round_of[i] != 255 || !with || 16 * without > 3 * (with + without))
                    continue;
                for (int k = 0; k < 3; k++) {
                    const double mean = sum[k] / with;
                    light[3 * i + k] = floats ? (double)(float)mean
                                              : pt_linear_of_srgb(floor(255 * srgb_of_linear(mean) + 0.5) / 255);
                }
                round_of[i] = (uint8_t)round;
                filled++;
            }
        double *got = colors_of(cloud, marks);
        for (int i = 0; i < POINTS; i++) {
            assert_int_equal(marks[i], round_of[i] > 0 && round_of[i] < 255);
            untrusted += (double)trust[i] < info.trust_default - 1e-6;
            for (int k = 0; k < 3; k++)
                worst = fmax(worst,
                             fabs((floats ? got[3 * i + k] : pt_linear_of_srgb(got[3 * i + k] / 255)) - light[3 * i + k]));
        }
        print_message("  %s: %llu of 12 %% black points got a color, %llu points are untrusted; off by %g\n",
                      floats ? "floats" : "bytes", (unsigned long long)filled, (unsigned long long)untrusted, worst);
        assert_true(filled > 0.97 * 0.12 * WALL && untrusted >= STRAYS && worst < 1e-6);
        assert_int_equal(uncolored(cloud), filled);
        free(got);
        free(light);
        free(round_of);
        free(marks);
        free(numbers);
        free(trust);
        patina_cloud_destroy(cloud);
        free(w);
    }
}

static void expect_colors(const patina_cloud *cloud, const double *wanted)
{
    double *got = colors_of(cloud, NULL);
    assert_memory_equal(got, wanted, 3 * POINTS * sizeof *got);
    free(got);
}

static void test_again(void **state)
{
    (void)state;
    const char *path = "uncolored.cloud", *to = "uncolored-analysed.cloud";
    struct wall *w = wall_of(0.05, 3);
    patina_cloud *cloud = cloud_of(w, 0, 1), *other = cloud_of(w, 0, 5), *kept = cloud_of(w, 0, 0), *opened = NULL;
    CHECK(patina_cloud_save(cloud, path), cloud);
    analyse(cloud, 1, 0);
    analyse(other, 5, 0);
    const uint64_t filled = uncolored(cloud);
    double *once = colors_of(cloud, NULL);
    assert_true(filled > 0.97 * 0.05 * WALL);
    expect_colors(other, once);
    analyse(cloud, 0, 0); // once more
    expect_colors(cloud, once);
    assert_int_equal(uncolored(cloud), filled);
    const patina_array colors = {w->color, PATINA_UINT8, 3, 0};
    CHECK(patina_cloud_set_colors(cloud, &colors), cloud); // the same colors
    expect_colors(cloud, once);
    assert_int_equal(uncolored(cloud), filled);
    for (uint64_t memory = 0; memory < 2; memory++) { // 0: as much as is free
        CHECK(patina_cloud_analyse_file(path, NULL, memory, to, NULL), NULL);
        CHECK(patina_cloud_open(to, &opened), NULL);
        expect_colors(opened, once);
        assert_int_equal(uncolored(opened), filled);
        analyse(opened, 0, 0); // of a mapped file
        expect_colors(opened, once);
        CHECK(patina_cloud_set_colors(opened, &colors), opened);
        expect_colors(opened, once);
        patina_cloud_destroy(opened);
    }
    analyse(kept, 0, 1); // keep_colors
    assert_int_equal(uncolored(kept), 0);
    CHECK(patina_cloud_set_colors(kept, &colors), kept);
    double *black = colors_of(kept, NULL);
    for (int i = 0; i < 3 * POINTS; i++)
        assert_true(black[i] == (double)w->color[i / 3][i % 3]);
    analyse(other, 0, 1); // gives the black ones back
    assert_int_equal(uncolored(other), 0);
    expect_colors(other, black);
    memset(w->color, 77, sizeof w->color); // all colored
    CHECK(patina_cloud_set_colors(cloud, &colors), cloud);
    assert_int_equal(uncolored(cloud), 0);
    const patina_array none = {0};
    CHECK(patina_cloud_set_colors(cloud, &none), cloud);
    analyse(cloud, 0, 0);
    assert_int_equal(uncolored(cloud), 0);
    unlink(path);
    unlink(to);
    free(once);
    free(black);
    patina_cloud_destroy(cloud);
    patina_cloud_destroy(other);
    patina_cloud_destroy(kept);
    free(w);
}

// A black square, and a black line a point wide, on a colored wall: these points are black in truth.
static void test_black_surfaces(void **state)
{
    (void)state;
    struct wall *w = wall_of(0.0, 4);
    int inside = 0, changed = 0;
    for (int i = 0; i < WALL; i++) {
        const int x = i % SIDE, y = i / SIDE;
        w->position[i][0] = 0.01 * x;
        w->position[i][1] = 0.01 * y;
        if ((x > 30 && x < 61 && y > 30 && y < 61) || (y == 90 && x > 10 && x < 110)) {
            memset(w->color[i], 0, 3);
            inside++;
        }
    }
    patina_cloud *cloud = cloud_of(w, 0, 0);
    analyse(cloud, 0, 0);
    double *got = colors_of(cloud, NULL);
    for (int i = 0; i < WALL; i++)
        changed += !(w->color[i][0] | w->color[i][1] | w->color[i][2]) && got[3 * i] > 0;
    print_message("  %d of %d black points of a square and a line got a color\n", changed, inside);
    assert_true(changed <= 20); // the line's ends
    free(got);
    patina_cloud_destroy(cloud);
    free(w);
}

static void expect_nothing(struct wall *w, int floats)
{
    patina_cloud *cloud = cloud_of(w, floats, 0);
    analyse(cloud, 0, 0);
    assert_int_equal(uncolored(cloud), 0);
    patina_cloud_destroy(cloud);
}

static void test_bad_colors(void **state)
{
    (void)state;
    struct wall *w = wall_of(0.0, 5);
    expect_nothing(w, 0);
    memset(w->color, 0, sizeof w->color); // all black
    expect_nothing(w, 0);
    memset(w->color, 200, sizeof w->color); // one color
    expect_nothing(w, 0);
    for (int i = 0; i < POINTS; i++) // no number anywhere
        w->light[i][i % 3] = i % 2 ? NAN : INFINITY;
    expect_nothing(w, 1);
    free(w);
    w = wall_of(0.0, 6);
    for (int i = 0; i < WALL; i += 25) // some of no number, in one channel
        w->light[i][1] = NAN;
    patina_cloud *cloud = cloud_of(w, 1, 0);
    analyse(cloud, 0, 0);
    assert_int_equal(uncolored(cloud), WALL / 25);
    double *got = colors_of(cloud, NULL);
    for (int i = 0; i < 3 * POINTS; i++)
        assert_true(isfinite(got[i]) && (i / 3 >= WALL || got[i] > 0.05));
    free(got);
    patina_cloud_destroy(cloud);
    memset(w->position, 0, sizeof w->position); // all at one place, every fifth black
    for (int i = 0; i < POINTS; i += 10)
        memset(w->color[i], 0, 3);
    cloud = cloud_of(w, 0, 0);
    analyse(cloud, 0, 0);
    patina_cloud_destroy(cloud);
    free(w);
}

// A frame keeps the addresses of a cloud's arrays. Other colors must not leave it with memory that was freed, the cloud's or a file's.
static void draw_again(patina_device *device, const char *name)
{
    const char *path = "uncolored-drawn.cloud";
    struct wall *w = wall_of(0.05, 7);
    const patina_array colors = {w->color, PATINA_UINT8, 3, 0};
    const patina_camera camera = camera_perspective((const double[]){0.6, 0.6, 1.5}, (const double[]){0.6, 0.6, 0}, 50, 160,
                                                    120, 0.1, 10);
    patina_settings settings = settings_default(160, 120);
    settings.surface = PATINA_SURFACE_SPLATS;
    patina_cloud *clouds[2] = {cloud_of(w, 0, 1), NULL};
    analyse(clouds[0], 1, 0);
    CHECK(patina_cloud_save(clouds[0], path), clouds[0]);
    CHECK(patina_cloud_open(path, &clouds[1]), NULL);
    for (int i = 0; i < 4; i++) { // each cloud with all points, which takes fewer passes, and with those that are trusted
        patina_cloud *cloud = clouds[i / 2];
        const patina_cloud_style style = {.struct_size = sizeof style, .least_trust = i % 2 ? 0.0f : -1.0f};
        patina_scene *scene = scene_of(cloud, &style);
        patina_frame *frame = NULL;
        CHECK(patina_scene_set_camera(scene, &camera), scene);
        CHECK(patina_scene_set_settings(scene, &settings), scene);
        CHECK(patina_frame_create(device, &frame), device);
        CHECK(patina_frame_render(frame, scene), frame);
        struct picture before = picture_read(frame);
        assert_true(picture_count(&before) > 5000);
        for (int turn = 0; turn < 3; turn++) {
            CHECK(patina_cloud_set_colors(cloud, &colors), cloud); // the same colors
            CHECK(patina_frame_render(frame, scene), frame);
            struct picture after = picture_read(frame);
            picture_assert_identical(&after, &before, 0, 0, name);
            picture_free(&after);
        }
        picture_free(&before);
        patina_frame_destroy(frame);
        patina_scene_destroy(scene);
    }
    patina_cloud_destroy(clouds[0]);
    patina_cloud_destroy(clouds[1]);
    unlink(path);
    free(w);
}

// A grade that keeps colors: uncolored points are black again, SOURCE is 1 there, and all others stay as they are.
static void keep_black(patina_device *device, const char *name)
{
    const patina_camera camera = camera_perspective((const double[]){0.6, 0.6, 1.5}, (const double[]){0.6, 0.6, 0}, 50, 96, 96,
                                                    0.1, 10);
    patina_settings settings = settings_default(96, 96);
    settings.antialias = PATINA_ANTIALIAS_OFF;
    settings.smooth = PATINA_SMOOTH_OFF;
    const patina_scan_grade bright = {2, 1, 1, 0};
    for (int floats = 0; floats < 2; floats++) {
        struct wall *w = wall_of(0.05, 7);
        patina_cloud *cloud = cloud_of(w, floats, 1);
        analyse(cloud, 1, 0);
        struct picture pictures[2];
        for (uint32_t keep = 0; keep < 2; keep++) {
            patina_grade *grade = NULL;
            CHECK(patina_grade_create_balanced(cloud, NULL, &bright, NULL, 1, keep, &grade), cloud);
            const patina_cloud_style style = {.struct_size = sizeof style, .lighting = PATINA_LIGHTING_UNLIT, .grade = grade};
            patina_scene *scene = scene_of(cloud, &style);
            pictures[keep] = picture_render(device, scene, &camera, &settings);
            patina_scene_destroy(scene);
            patina_grade_destroy(grade);
        }
        const float *source[2] = {pictures[0].source, pictures[1].source};
        uint32_t lent = 0, measured = 0;
        for (uint32_t i = 0; i < 96 * 96; i++) {
            const float *lit = pictures[0].combined + 4 * i, *dark = pictures[1].combined + 4 * i;
            assert_true(source[1][i] != 0.5f);
            if (source[0][i] == 0.5f) {
                lent++;
                assert_true(w->black[key_id(pictures[0].keys[i])] && source[1][i] == 1.0f);
                assert_true(lit[0] > 0.1f && dark[0] == 0.0f && dark[1] == 0.0f && dark[2] == 0.0f);
            } else if (source[0][i] == 1.0f) {
                measured++;
                assert_true(source[1][i] == 1.0f);
                assert_memory_equal(lit, dark, 4 * sizeof *lit);
            }
        }
        print_message("  %s, %s: %u pixels of uncolored points are black, %u of others stay\n", name,
                      floats ? "floats" : "bytes", lent, measured);
        assert_true(lent > 150 && measured > 3000);
        picture_free(&pictures[0]);
        picture_free(&pictures[1]);
        patina_cloud_destroy(cloud);
        free(w);
    }
}

static void test_kept_black(void **state)
{
    (void)state;
    support_each_device(keep_black);
}

static void test_drawn_again(void **state)
{
    (void)state;
    support_each_device(draw_again);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_reference),  cmocka_unit_test(test_again),       cmocka_unit_test(test_black_surfaces),
        cmocka_unit_test(test_bad_colors), cmocka_unit_test(test_drawn_again), cmocka_unit_test(test_kept_black),
    };
    support_arguments(argc, argv);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
